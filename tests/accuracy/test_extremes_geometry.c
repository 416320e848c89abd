/* SPDX-License-Identifier: MIT */
/* Triangles that are none, depths a billion apart, and what stands where two things should not
 * meet. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "clients/glb/shapes.h"
#include "tests/support/extreme_checks.h"
#include "tests/support/extreme_scene.h"
#include "tests/support/image_checks.h"

static const struct technique {
    const char *name;
    enum view_shadows shadows;
} techniques[] = {
    {"deep", VIEW_SHADOWS_DEEP},
    {"deep-linked", VIEW_SHADOWS_DEEP_LINKED},
    {"raytraced", VIEW_SHADOWS_RAYTRACED},
};
enum { TECHNIQUES = sizeof techniques / sizeof *techniques };

static struct image picture_of(struct renderer *renderer, const struct extreme_desc *desc,
                               enum view_shadows shadows, const char *name)
{
    struct extreme_scene scene;
    extreme_scene_open(&scene, renderer, "geometry", desc);
    scene.view.quality.shadows = shadows;
    struct image picture = shoot_color(renderer, &scene.rig, &scene.view);
    assert_image_is_sound(&picture, 1e6);
    if (name)
        save_picture(&picture, name);
    extreme_scene_finish(&scene, renderer);
    return picture;
}

/* Opaque and coloured materials in turn. */
static void add_soup(struct glb_builder *builder, int root, const float (*positions)[3],
                     size_t count)
{
    for (int i = 0; i < 2; i++) {
        struct glb_material_desc material = {.base_color = {0.5, 0.9, 0.2, 1},
                                             .transmission = i,
                                             .roughness = 0.5,
                                             .is_double_sided = true};
        struct glb_primitive_desc primitive = {
            .material = glb_builder_add_material(builder, &material),
            .vertex_count = count,
            .positions = positions[0],
        };
        struct glb_node_desc node = {.parent = root,
                                     .mesh = glb_builder_add_mesh(builder, "Soup", &primitive, 1)};
        glb_builder_add_node(builder, &node);
    }
}

/* Points, lines of repeated and of distinct vertices, and slivers narrower than f32 resolves. */
static void extend_degenerate(struct glb_builder *builder, int root, void *context)
{
    (void)context;
    static const float positions[][3] = {
        {0.1f, 0.5f, 0.2f},  {0.1f, 0.5f, 0.2f}, {0.1f, 0.5f, 0.2f}, /* a point */
        {0, 0.3f, 0},        {0.5f, 0.4f, 0.6f}, {0.5f, 0.4f, 0.6f}, /* a repeated vertex */
        {-0.5f, 0.2f, 0.5f}, {0, 0.4f, 0.5f},    {0.5f, 0.6f, 0.5f}, /* three on one line */
        {-1, 0.25f, -1},     {1, 1.25f, 1},      {0, 0.75f, 0},      /* the same, back and forth */
    };
    add_soup(builder, root, positions, sizeof positions / sizeof *positions);
}

static void triangles_without_area_leave_no_trace(void **state)
{
    for (int t = 0; t < TECHNIQUES; t++) {
        struct image without =
            picture_of(*state, &(struct extreme_desc){0}, techniques[t].shadows, NULL);
        struct image with = picture_of(*state, &(struct extreme_desc){.extend = extend_degenerate},
                                       techniques[t].shadows, NULL);
        extreme_expect(&(struct extreme_row){"triangles of no area, repeated vertices",
                                             techniques[t].name, "RMSE, relative", 0},
                       extreme_rmse(&with, &without));
        image_finish(&with);
        image_finish(&without);
    }
}

/* 1 m by 1 nm: thinner than any sample is likely to meet, never more than a row of pixels. */
static void extend_needles(struct glb_builder *builder, int root, void *context)
{
    (void)context;
    float positions[96][3];
    for (int i = 0; i < 32; i++) {
        float z = -0.9f + 0.05f * (float)i; /* at y = 0, where f32 resolves a nanometre */
        const float corners[3][3] = {{-0.5f, 0, z}, {0.5f, 0.5f, z}, {-0.5f, 1e-9f, z}};
        memcpy(positions[3 * i], corners, sizeof corners);
    }
    add_soup(builder, root, (const float(*)[3])positions, 96);
}

static void needles_leave_next_to_nothing(void **state)
{
    for (int t = 0; t < TECHNIQUES; t++) {
        struct image without =
            picture_of(*state, &(struct extreme_desc){0}, techniques[t].shadows, NULL);
        struct image with = picture_of(*state, &(struct extreme_desc){.extend = extend_needles},
                                       techniques[t].shadows, NULL);
        extreme_expect(&(struct extreme_row){"64 needles of 1 m by 1 nm", techniques[t].name,
                                             "RMSE, relative", 1e-3},
                       extreme_rmse(&with, &without));
        image_finish(&with);
        image_finish(&without);
    }
}

static int setup(void **state)
{
    *state = render_rig_create();
    return 0;
}

static int teardown(void **state)
{
    renderer_destroy(*state);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(triangles_without_area_leave_no_trace),
        cmocka_unit_test(needles_leave_next_to_nothing),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
