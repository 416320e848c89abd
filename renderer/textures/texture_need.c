/* SPDX-License-Identifier: MIT */
/* The bound. With J, the texels per metre of a triangle (two rows, u and v), and A, the way on the
 * triangle per pixel to the right and down, the footprint is J A, and its greatest entry is at
 * least |J A|_F / 2 >= |J|_F smin(A) / 2. A pinhole's A shrinks nothing by more than pixel * depth
 * / slant: the picture of a step of length 1 at depth z is no longer than slant / z. */
#include "renderer/textures/texture_need.h"

#include <math.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "renderer/scene/texture_levels.h"

enum { FILTER_LINEAR = 9729, FILTER_TRILINEAR = 9987 }; /* numbers of glTF */

/* Differences of neighbouring pixels, a pixel beyond a triangle's edge too, for derivatives. */
static const double MARGIN = 0.9;

struct texture_density {
    const struct scene *scene;
    float (*least)[SCENE_TEXTURE_SLOT_COUNT]; /* per primitive: |J|_F of model space */
    bool *is_known;
    struct texture_density **parts; /* of a composed scene, instead of the two */
};

struct texture_density *texture_density_create(const struct scene *scene, struct error *err)
{
    struct texture_density *density = calloc(1, sizeof *density);
    if (density) {
        density->scene = scene;
        density->least = calloc((size_t)scene->primitive_count + 1, sizeof *density->least);
        density->is_known = calloc((size_t)scene->primitive_count + 1, sizeof *density->is_known);
    }
    if (density && density->least && density->is_known)
        return density;
    texture_density_destroy(density);
    error_set(err, ERROR_NO_MEMORY, "%u primitives", scene->primitive_count);
    return NULL;
}

struct texture_density *texture_density_compose(const struct scene *scene, struct error *err)
{
    struct texture_density *density = calloc(1, sizeof *density);
    if (density) {
        density->scene = scene;
        density->parts = calloc(scene->part_count, sizeof(*density->parts));
    }
    if (density && density->parts)
        return density;
    texture_density_destroy(density);
    error_set(err, ERROR_NO_MEMORY, "%u parts", scene->part_count);
    return NULL;
}

void texture_density_set_part(struct texture_density *density, uint32_t part,
                              struct texture_density *of_part)
{
    density->parts[part] = of_part;
}

void texture_density_destroy(struct texture_density *density)
{
    if (!density)
        return;
    free(density->parts);
    free(density->least);
    free(density->is_known);
    free(density);
}

/* d G^-1 d for the Gram matrix G of two edges: the squared gradient of a value that grows by d
 * along them. */
static double squared_gradient(const double gram[3], double determinant, const double d[2])
{
    return (gram[2] * d[0] * d[0] - 2 * gram[1] * d[0] * d[1] + gram[0] * d[1] * d[1]) /
           determinant;
}

/* |J|_F^2 of one triangle; infinite where it has no area, and is not seen. */
static double triangle_density(const struct scene *scene, const uint32_t vertices[3],
                               const struct scene_texture_ref *ref, const struct scene_image *image)
{
    const float *stream = ref->texcoord ? scene->texcoords_1 : scene->texcoords_0;
    double edges[2][3], texels[2][2], gram[3];
    for (int e = 0; e < 2; e++) {
        const float *a = scene->positions + 3 * (size_t)vertices[0];
        const float *b = scene->positions + 3 * (size_t)vertices[e + 1];
        for (int k = 0; k < 3; k++)
            edges[e][k] = (double)b[k] - (double)a[k];
        double du =
            (double)stream[2 * (size_t)vertices[e + 1]] - (double)stream[2 * (size_t)vertices[0]];
        double dv = (double)stream[2 * (size_t)vertices[e + 1] + 1] -
                    (double)stream[2 * (size_t)vertices[0] + 1];
        for (int row = 0; row < 2; row++) {
            const float *m = ref->uv_transform + 3 * row;
            double side = row ? image->height_px : image->width_px;
            texels[row][e] = side * ((double)m[0] * du + (double)m[1] * dv);
        }
    }
    gram[0] = vec3_dot(edges[0], edges[0]);
    gram[1] = vec3_dot(edges[0], edges[1]);
    gram[2] = vec3_dot(edges[1], edges[1]);
    double determinant = gram[0] * gram[2] - gram[1] * gram[1];
    if (!(determinant > 0))
        return INFINITY;
    return squared_gradient(gram, determinant, texels[0]) +
           squared_gradient(gram, determinant, texels[1]);
}

static double find_least(const struct scene *scene, const struct scene_primitive *primitive,
                         const struct scene_material *m, int slot)
{
    const struct scene_texture_ref *ref = &m->textures[slot];
    const struct scene_image *image = &scene->images[scene->textures[ref->texture].image];
    uint32_t has =
        ref->texcoord ? SCENE_PRIMITIVE_HAS_TEXCOORDS_1 : SCENE_PRIMITIVE_HAS_TEXCOORDS_0;
    double least = INFINITY;
    if (primitive->topology != SCENE_TRIANGLES || !(primitive->flags & has))
        return 0; /* one point of the image is sampled, or lines are: the finest level */
    for (uint32_t i = 0; i + 2 < primitive->index_count; i += 3) {
        uint32_t vertices[3];
        for (uint32_t k = 0; k < 3; k++)
            vertices[k] = primitive->first_vertex + scene->indices[primitive->first_index + i + k];
        least = fmin(least, triangle_density(scene, vertices, ref, image));
    }
    return least < 0 ? 0 : sqrt(least);
}

static int32_t image_of(const struct scene *scene, const struct scene_material *m, int slot)
{
    int32_t texture = m->textures[slot].texture;
    return texture >= 0 ? scene->textures[texture].image : -1;
}

static void add_material(struct texture_density *density, uint32_t index, uint32_t material)
{
    const struct scene *scene = density->scene;
    const struct scene_material *m = &scene->materials[material];
    float *least = density->least[index];
    for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++)
        if (image_of(scene, m, slot) >= 0)
            least[slot] =
                fminf(least[slot], (float)find_least(scene, &scene->primitives[index], m, slot));
}

/* The least of all materials that the primitive may have: finer levels than one of them needs. */
static void add_variants(struct texture_density *density, uint32_t index)
{
    const struct scene *scene = density->scene;
    uint32_t low = 0, high = scene->variant_material_count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (scene->variant_materials[middle].primitive < index)
            low = middle + 1;
        else
            high = middle;
    }
    for (; low < scene->variant_material_count && scene->variant_materials[low].primitive == index;
         low++)
        add_material(density, index, scene->variant_materials[low].material);
}

/* Edits of a view change no textures, so what a part's own scene knows holds in a composed one. */
static const float *density_of(struct texture_density *density, uint32_t index)
{
    if (density->parts) {
        uint32_t part = density->scene->primitives[index].part;
        index -= density->scene->parts[part].first_primitive;
        density = density->parts[part];
    }
    if (!density->is_known[index]) {
        for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++)
            density->least[index][slot] = INFINITY;
        add_material(density, index, density->scene->primitives[index].material);
        add_variants(density, index);
        density->is_known[index] = true;
    }
    return density->least[index];
}

/* Greatest singular value of the upper 3x3, from the characteristic polynomial of its square (Smith
 * 1961, "Eigenvalues of a symmetric 3 x 3 matrix"); a little more, for rounding. */
static double greatest_stretch(const double m[16])
{
    double a[3][3], trace = 0, spread = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            a[i][j] = vec3_dot(m + 4 * (size_t)i, m + 4 * (size_t)j);
    for (int i = 0; i < 3; i++)
        trace += a[i][i] / 3;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            a[i][j] -= i == j ? trace : 0;
            spread += a[i][j] * a[i][j] / 6;
        }
    double p = sqrt(spread), half = 0;
    if (p > 0)
        half = (a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) -
                a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
                a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0])) /
               (2 * p * p * p);
    double angle = acos(fmax(-1, fmin(1, half))) / 3;
    return sqrt(trace + 2 * p * cos(angle)) * (1 + 1e-6);
}

static double least_depth(const struct texture_lens *lens, const struct state_item *item)
{
    double offset[3], gap[3], half[3], middle[3];
    for (int k = 0; k < 3; k++) {
        middle[k] = (item->bounds_min[k] + item->bounds_max[k]) / 2 - lens->eye[k];
        half[k] = (item->bounds_max[k] - item->bounds_min[k]) / 2;
        gap[k] = fmax(0, fabs(middle[k]) - half[k]);
    }
    vec3_sub(item->center, lens->eye, offset);
    double depth;
    if (lens->depth_share > 0) {
        double distance = fmax(vec3_length(gap), vec3_length(offset) - item->radius_m);
        depth = distance * lens->depth_share;
    } else {
        double box = vec3_dot(middle, lens->forward);
        for (int k = 0; k < 3; k++)
            box -= half[k] * fabs(lens->forward[k]);
        depth = fmax(box, vec3_dot(offset, lens->forward) - item->radius_m);
    }
    return fmax(depth, lens->near_m);
}

/* Of a sampler that blends levels and treats its finest one like the others; else one more is
 * kept, so that magnification begins where it did. */
static uint32_t level_for(const struct scene_texture *texture, double texels_per_pixel)
{
    if (texture->min_filter < 9984 || !(texels_per_pixel >= 1))
        return 0;
    double lambda = fmin(floor(log2(texels_per_pixel)), 31);
    bool is_plain = texture->min_filter == FILTER_TRILINEAR && texture->mag_filter == FILTER_LINEAR;
    return (uint32_t)fmax(0, lambda - !is_plain);
}

/* The coarsest level by which others are chosen as by level 0, or nearly: 0.006 levels off. */
static uint32_t last_equal_level(const struct scene_image *image)
{
    static const uint32_t large = 256;
    uint32_t last = texture_level_count(image->width_px, image->height_px) - 1, level = 0;
    for (uint32_t i = 1; i <= last; i++) {
        uint32_t rest = (1u << i) - 1;
        bool width_is_fit = image->width_px >> i >= large || !(image->width_px & rest);
        bool height_is_fit = image->height_px >> i >= large || !(image->height_px & rest);
        if (width_is_fit && height_is_fit)
            level = i;
    }
    return level;
}

/* Whether an animation has given the texture's matrix another scale or rotation. */
static bool is_turned(const struct scene_state *state, uint32_t material, int slot)
{
    const float *now = state->materials[material].base.textures[slot].uv_transform;
    const float *at_rest = state->scene->materials[material].textures[slot].uv_transform;
    return now[0] != at_rest[0] || now[1] != at_rest[1] || now[3] != at_rest[3] ||
           now[4] != at_rest[4];
}

static void add_item(const struct texture_need_desc *desc, const struct state_item *item,
                     uint8_t *levels)
{
    const struct scene *scene = desc->state->scene;
    const struct scene_material *m = &scene->materials[item->material];
    const float *density = NULL;
    double metres = 0;
    for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++) {
        int32_t index = image_of(scene, m, slot);
        if (!(desc->slots >> slot & 1) || index < 0)
            continue;
        if (!density) {
            const struct texture_lens *lens = desc->lens;
            double depth = lens->is_parallel ? 1 : least_depth(lens, item) / lens->slant;
            density = density_of(desc->density, item->primitive);
            metres =
                MARGIN * lens->pixel * depth / greatest_stretch(desc->state->world[item->node]);
        }
        const struct scene_image *image = &scene->images[index];
        const struct scene_texture *texture = &scene->textures[m->textures[slot].texture];
        /* poses and animations may stretch a triangle and its texture as far as they like */
        bool is_stretched = item->deformed || is_turned(desc->state, item->material, slot);
        uint32_t level = is_stretched ? 0 : level_for(texture, (double)density[slot] / 2 * metres);
        uint32_t last = last_equal_level(image);
        uint8_t *least = &levels[texture_key((uint32_t)index, scene_slot_is_srgb(slot))];
        level = level < last ? level : last;
        *least = level < *least ? (uint8_t)level : *least;
    }
}

void texture_need_add(const struct texture_need_desc *desc, uint8_t *levels)
{
    for (size_t i = 0; i < desc->item_count; i++)
        if (!desc->state->items[desc->items[i]].cap) /* caps have no textures */
            add_item(desc, &desc->state->items[desc->items[i]], levels);
}
