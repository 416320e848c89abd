/* SPDX-License-Identifier: MIT */
/* Texture lookups and material evaluation for rays. */
#include "renderer/raytrace/rt_surface.h"

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_film.h"
#include "renderer/raytrace/rt_lobes.h"
#include "renderer/raytrace/rt_math.h"
#include "renderer/scene/blend_law.h"

static double clamp01(double x)
{
    return x < 0 ? 0 : x > 1 ? 1 : x;
}

/* A hit, and what lookups there share. */
struct place {
    const struct rt_scene *scene;
    const struct rt_hit *hit;
    const struct rt_footprint *footprint; /* NULL: finest levels */
    const struct rt_mesh *mesh;
    uint32_t vertices[3];
    struct {
        bool is_known;
        double at[3][2]; /* at the hit, and how far it goes in a pixel to the right, and one down */
    } texcoords[2];      /* by set, before a slot's transform */
    struct rt_texel_sum found[SCENE_TEXTURE_SLOT_COUNT]; /* of slots that find_slots found */
};

static void find_place(const struct rt_scene *scene, const struct rt_hit *hit,
                       const struct rt_footprint *footprint, struct place *place)
{
    const struct rt_mesh *mesh = &scene->meshes[hit->mesh];
    place->scene = scene;
    place->hit = hit;
    place->footprint = footprint;
    place->mesh = mesh;
    memset(place->texcoords, 0, sizeof place->texcoords);
    rt_mesh_triangle(mesh, hit->triangle, place->vertices);
}

/* first: the vertex that the stream begins at. */
static void interpolate(const struct place *place, const float *stream, uint32_t first, int width,
                        double *out)
{
    const struct rt_hit *hit = place->hit;
    const double weights[3] = {1 - hit->u - hit->v, hit->u, hit->v};
    for (int c = 0; c < width; c++) {
        out[c] = 0;
        for (int k = 0; k < 3; k++)
            out[c] +=
                weights[k] *
                (double)stream[(size_t)(place->vertices[k] - first) * (size_t)width + (size_t)c];
    }
}

static bool slot_is_sampled(const struct place *place, int slot)
{
    return place->mesh->slots >> slot & 1;
}

static const double (*texcoords_of(struct place *place, uint32_t set))[2]
{
    double(*at)[2] = place->texcoords[set].at;
    const float *stream =
        set ? place->mesh->streams->texcoords_1 : place->mesh->streams->texcoords_0;
    const struct rt_footprint *footprint = place->footprint;
    if (place->texcoords[set].is_known)
        return (const double(*)[2])at;
    place->texcoords[set].is_known = true;
    for (size_t c = 0; stream && c < 2; c++) {
        double first = (double)stream[2 * (size_t)place->vertices[0] + c];
        double u = (double)stream[2 * (size_t)place->vertices[1] + c] - first;
        double v = (double)stream[2 * (size_t)place->vertices[2] + c] - first;
        at[0][c] = first + place->hit->u * u + place->hit->v * v;
        at[1][c] = footprint ? footprint->right[0] * u + footprint->right[1] * v : 0;
        at[2][c] = footprint ? footprint->down[0] * u + footprint->down[1] * v : 0;
    }
    return (const double(*)[2])at;
}

/* How a slot's texture is looked up. */
static bool find_slot(struct place *place, int slot, struct rt_texture_lookup *lookup)
{
    if (!slot_is_sampled(place, slot))
        return false;
    const struct scene_texture_ref *ref = &place->mesh->material->textures[slot];
    const struct scene_texture *texture = &place->scene->state->scene->textures[ref->texture];
    const double(*from)[2] = texcoords_of(place, ref->texcoord);
    lookup->image = &place->scene->images[texture->image];
    lookup->texture = texture;
    lookup->is_srgb = scene_slot_is_srgb(slot);
    lookup->is_finest = !place->footprint;
    for (int row = 0; row < 2; row++) {
        const float *m = ref->uv_transform + 3 * row;
        lookup->at[row] = (double)m[0] * from[0][0] + (double)m[1] * from[0][1] + (double)m[2];
        for (int step = 0; step < 2; step++)
            lookup->per_pixel[step][row] =
                (double)m[0] * from[1 + step][0] + (double)m[1] * from[1 + step][1];
    }
    return true;
}

/* Finds the texels of those of the slots that are sampled, before any of them is read: most of the
 * time of a sample is that of memory. */
static void find_slots(struct place *place, uint32_t slots)
{
    struct rt_texture_lookup lookup;
    for (slots &= place->mesh->slots; slots; slots &= slots - 1) {
        int slot = __builtin_ctz(slots);
        if (find_slot(place, slot, &lookup))
            rt_texture_find(&lookup, &place->found[slot]);
    }
}

/* After find_slots. */
static void sample_slot(const struct place *place, int slot, double out[4])
{
    if (slot_is_sampled(place, slot))
        rt_texture_add_up(&place->found[slot], &place->scene->tables, out);
    else
        out[0] = out[1] = out[2] = out[3] = 1;
}

/* Alpha is a mean of the square's texels. One that their bounds, further out by far more than
 * rounding, put on one side of the cutoff is decided without them. */
bool rt_surface_is_solid(const struct rt_scene *scene, const struct rt_hit *hit)
{
    static const double slack = 1e-9;
    struct place place;
    find_place(scene, hit, NULL, &place);
    const struct scene_material *m = place.mesh->material;
    double alpha = 1, cutoff = (double)m->alpha_cutoff, factor = (double)m->base_color[3];
    struct rt_texture_lookup lookup;
    struct rt_texel_square square;
    bool is_found = find_slot(&place, SCENE_TEXTURE_BASE_COLOR, &lookup);
    if (is_found)
        rt_texture_find_finest(&lookup, &square);
    if (place.mesh->primitive->flags & SCENE_PRIMITIVE_HAS_COLORS) {
        double color[4];
        interpolate(&place, place.mesh->streams->colors, 0, 4, color);
        factor *= color[3];
    }
    const struct rt_mask *mask = is_found ? &scene->masks[lookup.texture->image] : NULL;
    const bool is_in_mask = is_found && square.is_whole && mask->bounds;
    if (is_in_mask && factor >= 0) {
        __builtin_prefetch(mask->alpha[rt_mask_block(mask, square.x, square.y)]);
        const uint8_t *b = rt_mask_bounds(mask, square.x, square.y);
        if (clamp01(b[0] / 255.0 * factor) >= cutoff + slack)
            return true;
        if (clamp01(b[1] / 255.0 * factor) < cutoff - slack)
            return false;
    }
    if (is_found)
        alpha = 0;
    for (size_t i = 0; is_found && i < (size_t)square.count; i++) {
        uint8_t texel = is_in_mask ? rt_mask_alpha(mask, square.x + (i & 1), square.y + (i >> 1))
                                   : square.texels[i][3];
        alpha += square.weights[i] * (texel / 255.0);
    }
    return clamp01(alpha * factor) >= cutoff;
}

static void find_base(const struct place *place, double base[4])
{
    double color[4] = {1, 1, 1, 1};
    sample_slot(place, SCENE_TEXTURE_BASE_COLOR, base);
    if (place->mesh->primitive->flags & SCENE_PRIMITIVE_HAS_COLORS)
        interpolate(place, place->mesh->streams->colors, 0, 4, color);
    for (int k = 0; k < 4; k++)
        base[k] = clamp01(base[k] * (double)place->mesh->material->base_color[k] * color[k]);
}

void rt_surface_base(const struct rt_scene *scene, const struct rt_hit *hit,
                     const struct rt_footprint *footprint, double base[4])
{
    struct place place;
    find_place(scene, hit, footprint, &place);
    find_slots(&place, 1u << SCENE_TEXTURE_BASE_COLOR);
    find_base(&place, base);
}

/* Direction in which one texture coordinate grows, from the triangle's own edges. */
static bool triangle_tangents(const struct place *place, int slot, double tangent[3],
                              double bitangent[3])
{
    const struct scene_texture_ref *ref = &place->mesh->material->textures[slot];
    const float *stream =
        ref->texcoord ? place->mesh->streams->texcoords_1 : place->mesh->streams->texcoords_0;
    const uint32_t *vertices = place->vertices, first = place->mesh->first_vertex;
    double uv[3][2], at[3][3], e1[3], e2[3];
    if (!stream) /* the material names a set that no primitive has */
        return false;
    for (int k = 0; k < 3; k++)
        for (int row = 0; row < 2; row++) {
            const float *m = ref->uv_transform + 3 * row;
            uv[k][row] = (double)m[0] * (double)stream[2 * (size_t)vertices[k]] +
                         (double)m[1] * (double)stream[2 * (size_t)vertices[k] + 1];
        }
    for (int k = 0; k < 3; k++)
        rt_mesh_vertex(place->mesh, vertices[k] - first, at[k]);
    vec3_sub(at[1], at[0], e1);
    vec3_sub(at[2], at[0], e2);
    double du1 = uv[1][0] - uv[0][0], dv1 = uv[1][1] - uv[0][1];
    double du2 = uv[2][0] - uv[0][0], dv2 = uv[2][1] - uv[0][1];
    double det = du1 * dv2 - du2 * dv1;
    if (det == 0)
        return false;
    for (int k = 0; k < 3; k++) {
        tangent[k] = (dv2 * e1[k] - dv1 * e2[k]) / det;
        bitangent[k] = -(du1 * e2[k] - du2 * e1[k]) / det; /* v points down the image */
    }
    return true;
}

static bool tangent_frame(const struct place *place, int slot, const double n[3], double t[3],
                          double b[3])
{
    if (!(place->mesh->primitive->flags & SCENE_PRIMITIVE_HAS_TANGENTS))
        return triangle_tangents(place, slot, t, b) && vec3_normalize(t) && vec3_normalize(b);
    double local[4];
    interpolate(place, place->mesh->tangents, place->mesh->first_vertex, 4, local);
    mat4_transform_direction(place->mesh->world, local, t);
    double along = vec3_dot(t, n);
    for (int k = 0; k < 3; k++)
        t[k] -= n[k] * along;
    if (!vec3_normalize(t))
        return false;
    vec3_cross(n, t, b);
    double sign = local[3] * (place->mesh->is_mirrored ? -1 : 1);
    for (int k = 0; k < 3; k++)
        b[k] *= sign;
    return true;
}

/* Of the vertices, on the viewer's side. */
static void evaluate_vertex_normal(const struct place *place, double normal[3])
{
    double local[3];
    interpolate(place, place->mesh->normals, place->mesh->first_vertex, 3, local);
    for (int i = 0; i < 3; i++)
        normal[i] = vec3_dot(place->mesh->normal_matrix[i], local);
    if (!vec3_normalize(normal))
        rt_scene_normal(place->scene, place->hit, normal);
    for (int k = 0; k < 3 && !place->hit->is_front; k++)
        normal[k] = -normal[k];
}

static void evaluate_mapped_normal(const struct place *place, int slot, double scale,
                                   double normal[3])
{
    const struct scene_material *m = place->mesh->material;
    double t[3], b[3], texel[4];
    evaluate_vertex_normal(place, normal);
    if ((m->flags & SCENE_MATERIAL_UNLIT) || !slot_is_sampled(place, slot) ||
        !tangent_frame(place, slot, normal, t, b))
        return;
    sample_slot(place, slot, texel);
    double x = (texel[0] * 2 - 1) * scale;
    double y = (texel[1] * 2 - 1) * scale, z = texel[2] * 2 - 1;
    double mapped[3];
    for (int k = 0; k < 3; k++)
        mapped[k] = t[k] * x + b[k] * y + normal[k] * z;
    if (vec3_normalize(mapped))
        memcpy(normal, mapped, sizeof mapped);
}

/* The direction along which an anisotropic surface is rough, and by how much. Like a coat's, its
 * frame is that of the vertices' normal. */
static void evaluate_grain(const struct place *place, struct rt_surface *s)
{
    const struct scene_material *m = place->mesh->material;
    double n[3], t[3], b[3], texel[4], x = 1, y = 0, strength = 1;
    double c = cos((double)m->anisotropy_rad), sine = sin((double)m->anisotropy_rad);
    evaluate_vertex_normal(place, n);
    if (!tangent_frame(place, SCENE_TEXTURE_ANISOTROPY, n, t, b))
        return;
    if (slot_is_sampled(place, SCENE_TEXTURE_ANISOTROPY)) {
        sample_slot(place, SCENE_TEXTURE_ANISOTROPY, texel);
        x = texel[0] * 2 - 1;
        y = texel[1] * 2 - 1;
        strength = texel[2];
    }
    for (int k = 0; k < 3; k++)
        s->along[k] = t[k] * (x * c - y * sine) + b[k] * (x * sine + y * c);
    if (vec3_dot(s->along, s->along) > 1e-6)
        s->grain = (double)m->anisotropy * strength;
}

static void evaluate_lobes(const struct place *place, struct rt_surface *s)
{
    const struct scene_material *m = place->mesh->material;
    double texel[4];
    if (m->flags & SCENE_MATERIAL_SPECULAR) {
        sample_slot(place, SCENE_TEXTURE_SPECULAR, texel);
        s->specular = (double)m->specular * texel[3];
        sample_slot(place, SCENE_TEXTURE_SPECULAR_COLOR, texel);
        for (int k = 0; k < 3; k++)
            s->specular_color[k] = (double)m->specular_color[k] * texel[k];
    }
    if (m->clearcoat > 0) {
        sample_slot(place, SCENE_TEXTURE_CLEARCOAT, texel);
        s->coat = (double)m->clearcoat * texel[0];
        sample_slot(place, SCENE_TEXTURE_CLEARCOAT_ROUGHNESS, texel);
        s->coat_roughness = (double)m->clearcoat_roughness * texel[1];
        evaluate_mapped_normal(place, SCENE_TEXTURE_CLEARCOAT_NORMAL,
                               (double)m->clearcoat_normal_scale, s->coat_normal);
    }
    if (scene_material_has_sheen(m)) {
        sample_slot(place, SCENE_TEXTURE_SHEEN_COLOR, texel);
        for (int k = 0; k < 3; k++)
            s->sheen_color[k] = (double)m->sheen_color[k] * texel[k];
        sample_slot(place, SCENE_TEXTURE_SHEEN_ROUGHNESS, texel);
        s->sheen_roughness = (double)m->sheen_roughness * texel[3];
    }
    s->film = s->grain = s->translucence = 0;
    if (m->diffuse_transmission > 0) {
        sample_slot(place, SCENE_TEXTURE_DIFFUSE_TRANSMISSION, texel);
        s->translucence = (double)m->diffuse_transmission * texel[3];
        sample_slot(place, SCENE_TEXTURE_DIFFUSE_TRANSMISSION_COLOR, texel);
        for (int k = 0; k < 3; k++)
            s->translucent[k] = (double)m->diffuse_transmission_color[k] * texel[k];
    }
    if (m->anisotropy > 0)
        evaluate_grain(place, s);
    if (m->iridescence > 0) {
        double least = (double)m->film_nm[0], most = (double)m->film_nm[1];
        sample_slot(place, SCENE_TEXTURE_IRIDESCENCE, texel);
        s->film = (double)m->iridescence * texel[0];
        sample_slot(place, SCENE_TEXTURE_IRIDESCENCE_THICKNESS, texel);
        s->film_nm = least + (most - least) * texel[1];
    }
}

/* Textures that decide what light loses. */
static const uint32_t FILTER_SLOTS = 1u << SCENE_TEXTURE_BASE_COLOR |
                                     1u << SCENE_TEXTURE_TRANSMISSION |
                                     1u << SCENE_TEXTURE_THICKNESS;

/* Of a mask that transmits: it is in the lists of hits, and there is nothing. Other masks are cut
 * before (rt_surface_is_solid). */
static bool is_hole(const struct scene_material *material, double alpha)
{
    return material->alpha_mode == SCENE_MASK && material->transmission > 0 &&
           alpha < (double)material->alpha_cutoff;
}

static void evaluate_filter(const struct place *place, struct rt_surface *surface)
{
    const struct scene_material *m = place->mesh->material;
    double base[4], texel[4];
    surface->material = m;
    find_base(place, base);
    memcpy(surface->base, base, sizeof surface->base);
    surface->alpha = m->alpha_mode == SCENE_BLEND ? base[3] : is_hole(m, base[3]) ? 0 : 1;
    surface->transmission = surface->thickness_m = 0;
    if (m->transmission <= 0)
        return;
    sample_slot(place, SCENE_TEXTURE_TRANSMISSION, texel);
    surface->transmission = (double)m->transmission * texel[0];
    if (m->thickness <= 0 || place->mesh->is_medium)
        return; /* the inside of a medium attenuates, not its surface: rt_path.h */
    sample_slot(place, SCENE_TEXTURE_THICKNESS, texel);
    surface->thickness_m =
        (double)m->thickness * texel[1] * (double)place->mesh->item->length_scale;
}

void rt_surface_evaluate_filter(const struct rt_scene *scene, const struct rt_hit *hit,
                                struct rt_surface *surface)
{
    struct place place;
    find_place(scene, hit, NULL, &place);
    find_slots(&place, FILTER_SLOTS);
    evaluate_filter(&place, surface);
}

uint32_t rt_surface_sampled_slots(const struct scene *scene, const struct scene_material *material,
                                  const struct scene_primitive *primitive)
{
    uint32_t slots = 0;
    if (!(primitive->flags & (SCENE_PRIMITIVE_HAS_TEXCOORDS_0 | SCENE_PRIMITIVE_HAS_TEXCOORDS_1)))
        return 0;
    for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++) {
        int32_t texture = material->textures[slot].texture;
        if (texture >= 0 && scene->textures[texture].image >= 0)
            slots |= 1u << slot;
    }
    return slots;
}

bool rt_surface_plain_filter(const struct rt_mesh *mesh, enum view_blend_filter blend,
                             double filter[3])
{
    const struct scene_material *m = mesh->material;
    struct place place = {.mesh = mesh};
    struct rt_surface surface;
    if (mesh->class_ != STATE_TRANSPARENT || m->pass_through == SCENE_PASS_SLAB ||
        m->pass_through == SCENE_PASS_EDGE || (mesh->slots & FILTER_SLOTS) ||
        (mesh->primitive->flags & SCENE_PRIMITIVE_HAS_COLORS))
        return false;
    evaluate_filter(&place, &surface);
    if (surface.thickness_m > 0) /* what enters is attenuated, what leaves is not */
        return false;
    rt_surface_light_filter(&surface, 1, false, blend, filter);
    return true;
}

bool rt_surface_is_bare(const struct rt_mesh *mesh)
{
    const struct scene_material *m = mesh->material;
    const bool has_lobes = m->clearcoat > 0 || scene_material_has_sheen(m) || m->anisotropy > 0 ||
                           m->iridescence > 0 || m->diffuse_transmission > 0;
    return !has_lobes && m->transmission <= 0 && !(m->flags & SCENE_MATERIAL_UNLIT);
}

bool rt_surface_is_plain(const struct rt_mesh *mesh)
{
    return rt_surface_is_bare(mesh) && !mesh->slots &&
           mesh->material->textures[SCENE_TEXTURE_BASE_COLOR].texture < 0 &&
           !(mesh->primitive->flags & SCENE_PRIMITIVE_HAS_COLORS);
}

void rt_surface_evaluate(const struct rt_scene *scene, const struct rt_hit *hit,
                         const struct rt_footprint *footprint, struct rt_surface *surface)
{
    struct place place;
    find_place(scene, hit, footprint, &place);
    const struct scene_material *m = place.mesh->material;
    double texel[4];
    find_slots(&place, place.mesh->slots);
    evaluate_filter(&place, surface);
    evaluate_mapped_normal(&place, SCENE_TEXTURE_NORMAL, (double)m->normal_scale, surface->normal);
    sample_slot(&place, SCENE_TEXTURE_METALLIC_ROUGHNESS, texel);
    surface->metallic = clamp01((double)m->metallic * texel[2]);
    surface->roughness = clamp01((double)m->roughness * texel[1]);
    sample_slot(&place, SCENE_TEXTURE_OCCLUSION, texel);
    surface->occlusion = clamp01(1 + (double)m->occlusion_strength * (texel[0] - 1));
    sample_slot(&place, SCENE_TEXTURE_EMISSIVE, texel);
    for (int k = 0; k < 3; k++)
        surface->emissive[k] = (double)m->emissive[k] * texel[k];
    double reflectance = ((double)m->ior - 1) / ((double)m->ior + 1);
    surface->f0 = m->ior > 0 ? reflectance * reflectance : 1;
    evaluate_lobes(&place, surface);
}

static void transmissive_filter(const struct rt_surface *s, bool enters, double t[3])
{
    const struct scene_material *m = s->material;
    for (int k = 0; k < 3; k++) {
        t[k] = s->transmission * s->base[k];
        if (enters && s->thickness_m > 0 && m->attenuation_distance > 0)
            t[k] *= pow(rt_max((double)m->attenuation_color[k], 1e-30),
                        s->thickness_m / (double)m->attenuation_distance);
    }
}

static void apply_angle(const struct rt_surface *s, double cosine, double t[3])
{
    const struct scene_material *m = s->material;
    double c = rt_min(rt_max(cosine, 1e-6), 1);
    for (int k = 0; k < 3; k++) {
        if (m->pass_through == SCENE_PASS_SLAB) {
            t[k] = pow(t[k], 1 / c);
        } else if (m->pass_through == SCENE_PASS_EDGE) {
            double w = pow(c, (double)m->edge_exponent);
            t[k] *= (double)m->edge_color[k] * (1 - w) + w;
        }
        t[k] = clamp01(t[k]);
    }
}

double rt_surface_specular(const struct rt_surface *s, double f0[3], double *weight)
{
    const struct scene_material *m = s->material;
    const bool is_other = m->flags & SCENE_MATERIAL_SPECULAR;
    double largest = 0;
    *weight = is_other ? s->specular : 1;
    for (int k = 0; k < 3; k++) {
        f0[k] = is_other ? rt_min(s->f0 * s->specular_color[k], 1) : s->f0;
        largest = rt_max(largest, f0[k]);
    }
    return largest;
}

/* The share of light from behind that the interface, fibres and a coat keep from the camera. */
static double reflected_to_camera(const struct rt_surface *s, const double view[3], double cosine)
{
    double c = 1 - clamp01(cosine), c2 = c * c, f0[3], weight;
    double largest = rt_surface_specular(s, f0, &weight);
    double edge = rt_max(s->f0 + rt_surface_edge(s), largest) - largest;
    double reflected = weight * (largest + edge * c2 * c2 * c), film[3];
    struct rt_lobes lobes;
    rt_lobes_init(&lobes, s, view);
    if (s->film > 0) {
        reflected = 0;
        rt_film_fresnel(f0, (double)s->material->film_ior, s->film_nm, clamp01(cosine), film);
        for (int k = 0; k < 3; k++) {
            double own = f0[k] + (rt_max(s->f0 + rt_surface_edge(s), f0[k]) - f0[k]) * c2 * c2 * c;
            reflected = rt_max(reflected, weight * (own + s->film * (film[k] - own)));
        }
    }
    return 1 - (1 - reflected) * rt_lobes_passed(&lobes);
}

void rt_surface_light_filter(const struct rt_surface *s, double cosine, bool enters,
                             enum view_blend_filter blend, double filter[3])
{
    const struct scene_material *m = s->material;
    double a = s->alpha;
    const bool is_empty = m->alpha_mode == SCENE_MASK && a <= 0;
    for (int k = 0; k < 3; k++)
        filter[k] = is_empty;
    if (is_empty)
        return;
    if (m->transmission > 0)
        transmissive_filter(s, enters, filter);
    for (int k = 0; k < 3 && m->alpha_mode == SCENE_BLEND; k++) {
        if (m->transmission > 0)
            filter[k] = 1 - a * (1 - filter[k]);
        else
            filter[k] = blend_law_filter(blend, a, s->base[k]);
    }
    apply_angle(s, cosine, filter);
}

void rt_surface_view_filter(const struct rt_surface *s, const double view[3], bool enters,
                            double filter[3])
{
    double cosine = fabs(vec3_dot(s->normal, view));
    if (s->material->transmission <= 0) {
        filter[0] = filter[1] = filter[2] = 1 - s->alpha;
        return;
    }
    rt_surface_light_filter(s, cosine, enters, VIEW_BLEND_COVERAGE, filter);
    double reflected = reflected_to_camera(s, view, cosine);
    for (int k = 0; k < 3; k++)
        filter[k] *= (1 - s->alpha * reflected) * (1 - s->alpha * s->metallic);
}
