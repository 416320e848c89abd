/* SPDX-License-Identifier: MIT */
/* Leaves and strands at random in a slab of air. */
#include "tests/support/foliage_scene.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/matrix.h"
#include "tests/support/closed_form_internal.h"

enum { PIECES = 5 }; /* of a strand */

struct quads {
    float *positions, *normals;
    uint32_t *indices;
    size_t count, capacity;
};

static void begin_quads(struct quads *quads, size_t capacity)
{
    *quads = (struct quads){.capacity = capacity};
    quads->positions = calloc(capacity * 12 + 1, sizeof *quads->positions);
    quads->normals = calloc(capacity * 12 + 1, sizeof *quads->normals);
    quads->indices = calloc(capacity * 6 + 1, sizeof *quads->indices);
    assert(quads->positions && quads->normals && quads->indices);
}

static void add_quad(struct quads *quads, const double center[3], const double u[3],
                     const double v[3])
{
    static const int corners[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    static const uint32_t order[6] = {0, 1, 2, 0, 2, 3};
    double n[3];
    assert(quads->count < quads->capacity);
    vec3_cross(u, v, n);
    vec3_normalize(n);
    for (size_t c = 0; c < 4; c++)
        for (size_t k = 0; k < 3; k++) {
            size_t at = quads->count * 12 + 3 * c + k;
            quads->positions[at] = (float)(center[k] + corners[c][0] * u[k] + corners[c][1] * v[k]);
            quads->normals[at] = (float)n[k];
        }
    for (size_t i = 0; i < 6; i++)
        quads->indices[quads->count * 6 + i] = (uint32_t)(4 * quads->count) + order[i];
    quads->count++;
}

static void random_direction(uint64_t *seed, double out[3])
{
    do
        for (int k = 0; k < 3; k++)
            out[k] = closed_form_random(seed, -1, 1);
    while (vec3_dot(out, out) > 1 || vec3_dot(out, out) < 0.01);
    vec3_normalize(out);
}

/* Two directions at right angles, of the lengths given. */
static void random_axes(uint64_t *seed, double length, double width, double u[3], double v[3])
{
    double other[3];
    random_direction(seed, u);
    do {
        random_direction(seed, other);
        vec3_cross(u, other, v);
    } while (vec3_length(v) < 0.2);
    vec3_normalize(v);
    for (int k = 0; k < 3; k++) {
        u[k] *= length;
        v[k] *= width;
    }
}

static void random_place(uint64_t *seed, double out[3])
{
    out[0] = closed_form_random(seed, -0.8, 0.8);
    out[1] = closed_form_random(seed, 1.02, 1.58);
    out[2] = closed_form_random(seed, -0.8, 0.8);
}

static void add_strand(struct quads *quads, uint64_t *seed)
{
    const double piece_m = 0.06;
    double at[3], way[3], u[3], v[3], center[3], aside[3];
    random_place(seed, at);
    random_direction(seed, way);
    random_axes(seed, 1, closed_form_random(seed, 0.001, 0.002), aside, v);
    for (int i = 0; i < PIECES; i++) {
        way[1] -= 0.4;
        vec3_normalize(way);
        for (int k = 0; k < 3; k++) {
            u[k] = 0.5 * piece_m * way[k];
            center[k] = at[k] + u[k];
            at[k] += piece_m * way[k];
        }
        if (at[1] > 1)
            add_quad(quads, center, u, v);
    }
}

static void add_mesh(struct glb_builder *builder, const char *name, int material,
                     struct quads *quads)
{
    struct glb_primitive_desc primitive = {.material = material,
                                           .vertex_count = 4 * quads->count,
                                           .positions = quads->positions,
                                           .normals = quads->normals,
                                           .indices = quads->indices,
                                           .index_count = 6 * quads->count};
    if (quads->count)
        glb_builder_add_node(
            builder, &(struct glb_node_desc){
                         .name = name, .mesh = glb_builder_add_mesh(builder, name, &primitive, 1)});
    free(quads->positions);
    free(quads->normals);
    free(quads->indices);
}

void foliage_scene_build(const struct foliage_scene_desc *desc, struct closed_form_scene *scene)
{
    struct glb_builder *builder = closed_form_begin(scene, "Foliage", 0);
    uint64_t seed = 2000;
    struct quads leaves, strands;
    closed_form_floor(scene, builder, 3);
    int leaf = glb_builder_add_material(
        builder, &(struct glb_material_desc){.name = "Leaf",
                                             .base_color = {0.7, 0.88, 0.55, 1},
                                             .roughness = 1,
                                             .transmission = 1,
                                             .is_double_sided = true});
    int strand = glb_builder_add_material(
        builder, &(struct glb_material_desc){.name = "Strand",
                                             .base_color = {0.5, 0.3, 0.1, 0.35},
                                             .roughness = 1,
                                             .alpha_mode = GLB_BLEND,
                                             .is_double_sided = true});
    begin_quads(&leaves, (size_t)desc->leaves);
    for (int i = 0; i < desc->leaves; i++) {
        double center[3], u[3], v[3], length = closed_form_random(&seed, 0.01, 0.02);
        random_place(&seed, center);
        random_axes(&seed, length, 0.5 * length, u, v);
        add_quad(&leaves, center, u, v);
    }
    begin_quads(&strands, (size_t)desc->strands * PIECES);
    for (int i = 0; i < desc->strands; i++)
        add_strand(&strands, &seed);
    add_mesh(builder, "Leaves", leaf, &leaves);
    add_mesh(builder, "Strands", strand, &strands);
    closed_form_end(scene, builder);
}

struct view_camera foliage_camera(void)
{
    return (struct view_camera){.kind = VIEW_CAMERA_LOOK_AT,
                                .eye = {0, 0.95, 0},
                                .target = {0, 0, 0},
                                .up = {0, 0, -1},
                                .fov_y_deg = 50};
}

struct view_light foliage_spot(void)
{
    return (struct view_light){.type = SCENE_LIGHT_SPOT,
                               .position = {0.2, 5.3, 0.1},
                               .direction = {-0.04, -1, -0.02},
                               .color = {1, 1, 1},
                               .intensity = 60,
                               .inner_cone_deg = 16,
                               .outer_cone_deg = 18};
}
