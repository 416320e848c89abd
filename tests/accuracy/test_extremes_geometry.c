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

#include "glb/shapes.h"
#include "tests/support/extreme_checks.h"
#include "tests/support/extreme_scene.h"
#include "tests/support/image_checks.h"

static const struct technique {
    const char *name;
    enum shadow_technique shadows;
} techniques[] = {
    {"deep", SHADOWS_DEEP},
    {"deep-linked", SHADOWS_DEEP_LINKED},
    {"raytraced", SHADOWS_RAYTRACED},
};
enum { TECHNIQUES = sizeof techniques / sizeof *techniques };

static struct image picture_of(struct renderer *renderer, const struct extreme_desc *desc,
                               enum shadow_technique shadows, const char *name)
{
    struct extreme_scene scene;
    extreme_scene_open(&scene, renderer, "geometry", desc);
    scene.view.quality.shadows = shadows;
    scene.view.light_count = 2; /* without the sun, whose map is as wide as all that casts */
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

/* A wall a thousand kilometres away behind the room, and a speck 2 mm before the eye. */
static void extend_far_and_near(struct glb_builder *builder, int root, void *context)
{
    (void)context;
    static const double eye[3] = {-1.1, 1.5, 2.6}, to[3] = {1.2, -1.05, -2.6};
    struct shape wall = {0}, speck = {0};
    double at[3], length = sqrt(to[0] * to[0] + to[1] * to[1] + to[2] * to[2]);
    for (int k = 0; k < 3; k++)
        at[k] = eye[k] + 2e-3 * to[k] / length;
    shape_add_quad(&wall, (double[]){-1e6, -4e6, -1e6}, (double[]){9e6, 0, 0},
                   (double[]){0, 8e6, 0});
    shape_add_quad(&speck, (double[]){at[0] - 6e-4, at[1] + 2e-4, at[2]}, (double[]){3e-4, 0, 0},
                   (double[]){0, 3e-4, 0});
    struct glb_material_desc green = {
        .base_color = {0, 0, 0, 1}, .emissive = {0, 0.0625, 0}, .has_ior = true, .ior = 1};
    struct glb_material_desc blue = {
        .base_color = {0, 0, 0, 1}, .emissive = {0, 0, 0.5}, .has_ior = true, .ior = 1};
    int materials[2] = {glb_builder_add_material(builder, &green),
                        glb_builder_add_material(builder, &blue)};
    struct glb_node_desc far_node = {.parent = root,
                                     .mesh = shape_give_mesh(&wall, builder, "Wall", materials[0])};
    struct glb_node_desc near_node = {
        .parent = root, .mesh = shape_give_mesh(&speck, builder, "Speck", materials[1])};
    glb_builder_add_node(builder, &far_node);
    glb_builder_add_node(builder, &near_node);
}

/* Of the pixels that show the room: the share that the other picture shows differently; of all, the
 * share through which nothing is seen. */
struct billion {
    double room_differing, rest_missing;
    int speck, wall;
};

static struct billion compare_rooms(const struct image *room, const struct image *all)
{
    struct billion result = {0};
    int room_count = 0, room_differing = 0, rest_missing = 0;
    for (int y = 0; y < all->height_px; y++) {
        for (int x = 0; x < all->width_px; x++) {
            const float *p = image_pixel_f32(room, x, y), *q = image_pixel_f32(all, x, y);
            bool is_speck = q[2] > 0.499f && q[0] == 0, is_wall = q[1] > 0.06f && q[0] == 0;
            result.speck += is_speck;
            result.wall += is_wall;
            if (p[3] < 1 || is_speck) {
                rest_missing += q[3] < 0.999f; /* the wall is behind all */
                continue;
            }
            room_count++;
            bool differs = false;
            for (int k = 0; k < 3; k++)
                differs |= !(fabsf(p[k] - q[k]) <= 0.02f * fmaxf(p[k], 0.02f));
            room_differing += differs;
        }
    }
    result.room_differing = (double)room_differing / room_count;
    result.rest_missing = (double)rest_missing / (all->width_px * all->height_px);
    return result;
}

/* Not ray traced: its triangles are f32 about the scene's centre, a millionth of its radius apart.
 */
static void near_and_far_may_be_a_billion_apart(void **state)
{
    struct extreme_desc desc = {0};
    for (int t = 0; t < TECHNIQUES - 1; t++) {
        char name[64];
        desc.extend = NULL;
        struct image room = picture_of(*state, &desc, techniques[t].shadows, NULL);
        desc.extend = extend_far_and_near;
        snprintf(name, sizeof name, "extreme_far_%s", techniques[t].name);
        struct image all = picture_of(*state, &desc, techniques[t].shadows, name);
        struct billion result = compare_rooms(&room, &all);
        print_message("%d pixels of the speck, %d of the wall\n", result.speck, result.wall);
        assert_true(result.speck > 300 && result.wall > 3000);
        extreme_expect(&(struct extreme_row){"from 2 mm to 1000 km in one picture",
                                             techniques[t].name, "share of the room off by 2 %",
                                             0.02},
                       result.room_differing);
        extreme_expect(&(struct extreme_row){"from 2 mm to 1000 km in one picture",
                                             techniques[t].name, "share of holes", 0},
                       result.rest_missing);
        image_finish(&room);
        image_finish(&all);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(triangles_without_area_leave_no_trace),
        cmocka_unit_test(needles_leave_next_to_nothing),
        cmocka_unit_test(near_and_far_may_be_a_billion_apart),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
