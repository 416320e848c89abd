/* SPDX-License-Identifier: MIT */
/* Texture lookups and material evaluation for rays. */
#include "renderer/raytrace/rt_surface.h"

#include "renderer/raytrace/rt_math.h"
#include "renderer/scene/matrix.h"

enum { WRAP_CLAMP = 33071, WRAP_MIRROR = 33648, FILTER_NEAREST = 9728 }; /* numbers of glTF */

static double clamp01(double x)
{
    return x < 0 ? 0 : x > 1 ? 1 : x;
}

static int64_t wrap_texel(int64_t i, int64_t size, uint32_t mode)
{
    if (i >= 0 && i < size)
        return i;
    if (mode == WRAP_CLAMP)
        return i < 0 ? 0 : size - 1;
    if (mode == WRAP_MIRROR) {
        int64_t k = ((i % (2 * size)) + 2 * size) % (2 * size);
        return k < size ? k : 2 * size - 1 - k;
    }
    return ((i % size) + size) % size;
}

/* A texture coordinate in texels, as the two texels around it and the second one's weight; nearest:
 * both are the one it lies in. */
struct texel_pair {
    size_t at[2];
    double weight;
};

static struct texel_pair find_texels(double x, int64_t size, uint32_t wrap, bool is_nearest)
{
    double from = is_nearest ? x : x - 0.5;
    int64_t low = (int64_t)from;
    low -= from < (double)low; /* floor, without a call */
    struct texel_pair pair = {.weight = is_nearest ? 0 : from - (double)low};
    pair.at[0] = (size_t)wrap_texel(low, size, wrap);
    pair.at[1] = is_nearest ? pair.at[0] : (size_t)wrap_texel(low + 1, size, wrap);
    return pair;
}

struct texel_square {
    const uint8_t *texels[4]; /* RGBA */
    double weights[4];
    int count;
    uint32_t image;
    size_t x, y;   /* of the first */
    bool is_whole; /* the others are its neighbours to the right and below */
};

/* Bilinear at the finest level; supersampling does the rest of the filtering. */
static void find_texel_square(const struct rt_scene *rt, const struct scene_texture *texture,
                              const double uv[2], struct texel_square *square)
{
    const struct scene *scene = rt->state->scene;
    const struct scene_image *image = &scene->images[texture->image];
    const uint8_t *texels = scene_image_pixels(scene, image);
    bool is_nearest = texture->mag_filter == FILTER_NEAREST;
    struct texel_pair x =
        find_texels(uv[0] * image->width_px, image->width_px, texture->wrap_s, is_nearest);
    struct texel_pair y =
        find_texels(uv[1] * image->height_px, image->height_px, texture->wrap_t, is_nearest);
    square->count = is_nearest ? 1 : 4;
    square->image = (uint32_t)texture->image;
    square->x = x.at[0];
    square->y = y.at[0];
    square->is_whole = is_nearest || (x.at[1] == x.at[0] + 1 && y.at[1] == y.at[0] + 1);
    for (int i = 0; i < square->count; i++) {
        square->texels[i] = texels + 4 * (y.at[i >> 1] * image->width_px + x.at[i & 1]);
        square->weights[i] = (i & 1 ? x.weight : 1 - x.weight) * (i & 2 ? y.weight : 1 - y.weight);
    }
}

static void interpolate(const struct rt_scene *scene, const struct rt_hit *hit, const float *stream,
                        int width, double *out)
{
    uint32_t vertices[3];
    rt_scene_triangle(scene, hit->mesh, hit->triangle, vertices);
    const double weights[3] = {1 - hit->u - hit->v, hit->u, hit->v};
    for (int c = 0; c < width; c++) {
        out[c] = 0;
        for (int k = 0; k < 3; k++)
            out[c] += weights[k] * (double)stream[(size_t)vertices[k] * (size_t)width + (size_t)c];
    }
}

static const struct scene_primitive *hit_primitive(const struct rt_scene *scene,
                                                   const struct rt_hit *hit)
{
    return state_geometry_of(scene->state, scene->meshes[hit->mesh].item).primitive;
}

/* Whose streams the vertices of the hit count into. */
static const struct scene *hit_streams(const struct rt_scene *scene, const struct rt_hit *hit)
{
    return scene_of_primitive(scene->state->scene, hit_primitive(scene, hit));
}

static const struct scene_material *hit_material(const struct rt_scene *scene,
                                                 const struct rt_hit *hit)
{
    return &scene->state->materials[scene->meshes[hit->mesh].item->material].base;
}

static bool slot_is_sampled(const struct rt_scene *scene, const struct rt_hit *hit, int slot)
{
    const struct scene *s = scene->state->scene;
    const struct scene_texture_ref *ref = &hit_material(scene, hit)->textures[slot];
    const uint32_t uv = SCENE_PRIMITIVE_HAS_TEXCOORDS_0 | SCENE_PRIMITIVE_HAS_TEXCOORDS_1;
    return ref->texture >= 0 && s->textures[ref->texture].image >= 0 &&
           (hit_primitive(scene, hit)->flags & uv);
}

static bool find_slot(const struct rt_scene *scene, const struct rt_hit *hit, int slot,
                      struct texel_square *square)
{
    if (!slot_is_sampled(scene, hit, slot))
        return false;
    const struct scene *s = scene->state->scene;
    const struct scene_texture_ref *ref = &hit_material(scene, hit)->textures[slot];
    const struct scene *from = hit_streams(scene, hit);
    const float *stream = ref->texcoord ? from->texcoords_1 : from->texcoords_0;
    double raw[2] = {0}, uv[2];
    if (stream)
        interpolate(scene, hit, stream, 2, raw);
    for (int row = 0; row < 2; row++) {
        const float *m = ref->uv_transform + 3 * row;
        uv[row] = (double)m[0] * raw[0] + (double)m[1] * raw[1] + (double)m[2];
    }
    find_texel_square(scene, &s->textures[ref->texture], uv, square);
    return true;
}

static void sample_slot(const struct rt_scene *scene, const struct rt_hit *hit, int slot,
                        double out[4])
{
    struct texel_square square;
    bool is_srgb = slot == SCENE_TEXTURE_BASE_COLOR || slot == SCENE_TEXTURE_EMISSIVE;
    const double *linear = is_srgb ? scene->linear_from_srgb : scene->linear_from_unorm;
    bool is_found = find_slot(scene, hit, slot, &square);
    for (int k = 0; k < 4; k++)
        out[k] = is_found ? 0 : 1;
    for (int i = 0; is_found && i < square.count; i++) {
        for (int k = 0; k < 3; k++)
            out[k] += square.weights[i] * linear[square.texels[i][k]];
        out[3] += square.weights[i] * scene->linear_from_unorm[square.texels[i][3]];
    }
}

void rt_surface_prefetch(const struct rt_scene *scene, const struct rt_hit *hit)
{
    struct texel_square square;
    for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++) {
        if (!find_slot(scene, hit, slot, &square))
            continue;
        __builtin_prefetch(square.texels[0]);
        if (square.count == 4)
            __builtin_prefetch(square.texels[2]); /* the row below */
    }
}

/* Alpha is a mean of the square's texels. One that their bounds, further out by far more than
 * rounding, put on one side of the cutoff is decided without them. */
bool rt_surface_is_solid(const struct rt_scene *scene, const struct rt_hit *hit)
{
    static const double slack = 1e-9;
    const struct scene_material *m = hit_material(scene, hit);
    double alpha = 1, cutoff = (double)m->alpha_cutoff, factor = (double)m->base_color[3];
    struct texel_square square;
    bool is_found = find_slot(scene, hit, SCENE_TEXTURE_BASE_COLOR, &square);
    if (hit_primitive(scene, hit)->flags & SCENE_PRIMITIVE_HAS_COLORS) {
        double color[4];
        interpolate(scene, hit, hit_streams(scene, hit)->colors, 4, color);
        factor *= color[3];
    }
    if (is_found && square.is_whole && factor >= 0 && scene->masks[square.image].bounds) {
        const uint8_t *b = rt_mask_bounds(&scene->masks[square.image], square.x, square.y);
        if (clamp01(b[0] / 255.0 * factor) >= cutoff + slack)
            return true;
        if (clamp01(b[1] / 255.0 * factor) < cutoff - slack)
            return false;
    }
    if (is_found)
        alpha = 0;
    for (int i = 0; is_found && i < square.count; i++)
        alpha += square.weights[i] * (square.texels[i][3] / 255.0);
    return clamp01(alpha * factor) >= cutoff;
}

void rt_surface_base(const struct rt_scene *scene, const struct rt_hit *hit, double base[4])
{
    const struct scene_material *m = hit_material(scene, hit);
    double color[4] = {1, 1, 1, 1};
    sample_slot(scene, hit, SCENE_TEXTURE_BASE_COLOR, base);
    if (hit_primitive(scene, hit)->flags & SCENE_PRIMITIVE_HAS_COLORS)
        interpolate(scene, hit, hit_streams(scene, hit)->colors, 4, color);
    for (int k = 0; k < 4; k++)
        base[k] = clamp01(base[k] * (double)m->base_color[k] * color[k]);
}

/* Normals go by the cofactor matrix, which is the inverse transpose up to a positive scale and the
 * mirror's sign. */
static void transform_normal(const struct rt_scene *scene, const struct rt_hit *hit,
                             const double in[3], double out[3])
{
    const struct state_item *item = scene->meshes[hit->mesh].item;
    const double *m = state_geometry_of(scene->state, item).world;
    double sign = item->is_mirrored ? -1 : 1;
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        out[i] = 0;
        for (int c = 0; c < 3; c++) {
            int a = 4 * ((c + 1) % 3), b = 4 * ((c + 2) % 3);
            out[i] += sign * (m[a + j] * m[b + k] - m[b + j] * m[a + k]) * in[c];
        }
    }
}

/* Direction in which one texture coordinate grows, from the triangle's own edges. */
static bool triangle_tangents(const struct rt_scene *scene, const struct rt_hit *hit,
                              double tangent[3], double bitangent[3])
{
    const struct scene *s = hit_streams(scene, hit);
    const struct scene_primitive *p = hit_primitive(scene, hit);
    const struct scene_texture_ref *ref = &hit_material(scene, hit)->textures[SCENE_TEXTURE_NORMAL];
    const float *stream = ref->texcoord ? s->texcoords_1 : s->texcoords_0;
    uint32_t vertices[3];
    double uv[3][2], e1[3], e2[3];
    rt_scene_triangle(scene, hit->mesh, hit->triangle, vertices);
    const double(*position)[3] = (const double(*)[3])scene->meshes[hit->mesh].positions;
    for (int k = 0; k < 3; k++)
        for (int row = 0; row < 2; row++) {
            const float *m = ref->uv_transform + 3 * row;
            uv[k][row] = (double)m[0] * (double)stream[2 * (size_t)vertices[k]] +
                         (double)m[1] * (double)stream[2 * (size_t)vertices[k] + 1];
        }
    vec3_sub(position[vertices[1] - p->first_vertex], position[vertices[0] - p->first_vertex], e1);
    vec3_sub(position[vertices[2] - p->first_vertex], position[vertices[0] - p->first_vertex], e2);
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

static bool tangent_frame(const struct rt_scene *scene, const struct rt_hit *hit, const double n[3],
                          double t[3], double b[3])
{
    if (!(hit_primitive(scene, hit)->flags & SCENE_PRIMITIVE_HAS_TANGENTS))
        return triangle_tangents(scene, hit, t, b) && vec3_normalize(t) && vec3_normalize(b);
    const struct state_item *item = scene->meshes[hit->mesh].item;
    double local[4];
    interpolate(scene, hit, hit_streams(scene, hit)->tangents, 4, local);
    mat4_transform_direction(scene->state->world[item->node], local, t);
    double along = vec3_dot(t, n);
    for (int k = 0; k < 3; k++)
        t[k] -= n[k] * along;
    if (!vec3_normalize(t))
        return false;
    vec3_cross(n, t, b);
    double sign = local[3] * (item->is_mirrored ? -1 : 1);
    for (int k = 0; k < 3; k++)
        b[k] *= sign;
    return true;
}

static void evaluate_normal(const struct rt_scene *scene, const struct rt_hit *hit,
                            const struct scene_material *m, double normal[3])
{
    double local[3];
    const struct state_item *item = scene->meshes[hit->mesh].item;
    interpolate(scene, hit, state_geometry_of(scene->state, item).normals, 3, local);
    transform_normal(scene, hit, local, normal);
    if (!vec3_normalize(normal))
        rt_scene_normal(scene, hit, normal);
    for (int k = 0; k < 3 && !hit->is_front; k++)
        normal[k] = -normal[k];
    double t[3], b[3], texel[4];
    if ((m->flags & SCENE_MATERIAL_UNLIT) || !slot_is_sampled(scene, hit, SCENE_TEXTURE_NORMAL) ||
        !tangent_frame(scene, hit, normal, t, b))
        return;
    sample_slot(scene, hit, SCENE_TEXTURE_NORMAL, texel);
    double x = (texel[0] * 2 - 1) * (double)m->normal_scale;
    double y = (texel[1] * 2 - 1) * (double)m->normal_scale, z = texel[2] * 2 - 1;
    double mapped[3];
    for (int k = 0; k < 3; k++)
        mapped[k] = t[k] * x + b[k] * y + normal[k] * z;
    if (vec3_normalize(mapped))
        memcpy(normal, mapped, sizeof mapped);
}

void rt_surface_evaluate_filter(const struct rt_scene *scene, const struct rt_hit *hit,
                                struct rt_surface *surface)
{
    const struct scene_material *m = hit_material(scene, hit);
    const struct state_item *item = scene->meshes[hit->mesh].item;
    double base[4], texel[4];
    surface->material = m;
    rt_surface_base(scene, hit, base);
    memcpy(surface->base, base, sizeof surface->base);
    surface->alpha = m->alpha_mode == SCENE_BLEND ? base[3] : 1;
    surface->transmission = surface->thickness_m = 0;
    if (m->transmission <= 0)
        return;
    sample_slot(scene, hit, SCENE_TEXTURE_TRANSMISSION, texel);
    surface->transmission = (double)m->transmission * texel[0];
    if (m->thickness <= 0 || item->is_medium)
        return; /* the inside of a medium attenuates, not its surface: rt_path.h */
    sample_slot(scene, hit, SCENE_TEXTURE_THICKNESS, texel);
    surface->thickness_m = (double)m->thickness * texel[1] * (double)item->length_scale;
}

void rt_surface_evaluate(const struct rt_scene *scene, const struct rt_hit *hit,
                         struct rt_surface *surface)
{
    const struct scene_material *m = hit_material(scene, hit);
    double texel[4];
    rt_surface_evaluate_filter(scene, hit, surface);
    evaluate_normal(scene, hit, m, surface->normal);
    sample_slot(scene, hit, SCENE_TEXTURE_METALLIC_ROUGHNESS, texel);
    surface->metallic = clamp01((double)m->metallic * texel[2]);
    surface->roughness = clamp01((double)m->roughness * texel[1]);
    sample_slot(scene, hit, SCENE_TEXTURE_OCCLUSION, texel);
    surface->occlusion = clamp01(1 + (double)m->occlusion_strength * (texel[0] - 1));
    sample_slot(scene, hit, SCENE_TEXTURE_EMISSIVE, texel);
    for (int k = 0; k < 3; k++)
        surface->emissive[k] = (double)m->emissive[k] * texel[k];
    double reflectance = ((double)m->ior - 1) / ((double)m->ior + 1);
    surface->f0 = m->ior > 0 ? reflectance * reflectance : 1;
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

double rt_surface_fresnel(const struct rt_surface *s, double cosine)
{
    double f90 = rt_min(50 * s->f0, 1);
    double c = 1 - clamp01(cosine), c2 = c * c;
    return s->f0 + (f90 - s->f0) * c2 * c2 * c;
}

void rt_surface_light_filter(const struct rt_surface *s, double cosine, bool enters,
                             enum view_blend_filter blend, double filter[3])
{
    const struct scene_material *m = s->material;
    double a = s->alpha;
    for (int k = 0; k < 3; k++)
        filter[k] = 0;
    if (m->transmission > 0)
        transmissive_filter(s, enters, filter);
    for (int k = 0; k < 3 && m->alpha_mode == SCENE_BLEND; k++) {
        if (m->transmission > 0)
            filter[k] = 1 - a * (1 - filter[k]);
        else if (blend == VIEW_BLEND_TINT)
            filter[k] = (1 - a) * (1 - a * (1 - s->base[k]));
        else
            filter[k] = (1 - a) * (blend == VIEW_BLEND_KIM ? s->base[k] : 1);
    }
    apply_angle(s, cosine, filter);
}

void rt_surface_view_filter(const struct rt_surface *s, double cosine, bool enters,
                            double filter[3])
{
    if (s->material->transmission <= 0) {
        filter[0] = filter[1] = filter[2] = 1 - s->alpha;
        return;
    }
    rt_surface_light_filter(s, cosine, enters, VIEW_BLEND_COVERAGE, filter);
    double fresnel = rt_surface_fresnel(s, cosine);
    for (int k = 0; k < 3; k++)
        filter[k] *= (1 - s->alpha * fresnel) * (1 - s->alpha * s->metallic);
}
