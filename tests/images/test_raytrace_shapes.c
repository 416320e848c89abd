/* SPDX-License-Identifier: MIT */
/* A large scene whose nodes share meshes is in the ray tracer's memory once per mesh, and its
 * picture is that of the same scene where each node has a mesh of its own. */
#include <assert.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/shapes.h"
#include "renderer/raytrace/raytrace.h"
#include "renderer/raytrace/rt_shape.h"
#include "renderer/scene/camera.h"
#include "tests/support/import_support.h"

enum { KINDS = 4, SIDE_PX = 128, NODES = 36, CELLS = 160, TRIANGLES = 2 * CELLS * CELLS };

/* What nodes show. */
enum content {
    SHEETS, /* of four kinds */
    BALLS,  /* of solid glass that refracts, over opaque sheets */
};

struct shown {
    struct imported_scene imported;
    struct scene_state state;
    struct view view;
};

/* Kinds: opaque, glass, opaque from one side, opaque and sheared so much that it is not shared. */
static int add_mesh(struct glb_builder *b, const int materials[3], int kind)
{
    struct shape shape = {0};
    shape_add_grid(&shape, (double[]){-0.5, 0, 0.5}, (double[]){1, kind == 2 ? 0.5 : 0.2, 0},
                   (double[]){0, 0.1, -1}, CELLS, CELLS);
    return shape_give_mesh(&shape, b, "Sheet", materials[kind % 3]);
}

static int add_ball(struct glb_builder *b, const int materials[3], int kind)
{
    struct shape shape = {0};
    if (kind % 2 == 0)
        return add_mesh(b, materials, 0);
    shape_add_sphere(&shape, (const double[3]){0, 0.7, 0}, 0.3 + 0.1 * kind, CELLS, CELLS);
    return shape_give_mesh(&shape, b, "Ball", materials[1]);
}

static void place(struct glb_node_desc *node, int i)
{
    double turn = 0.7 * i, grow = 0.6 + 0.02 * i, squash = i % KINDS == 3 ? 0.05 : 0.8;
    int row = i / 6;
    double mirror = i % 5 == 0 ? -1 : 1, y = 0.3 * (i % 3);
    const double matrix[16] = {grow * cos(turn) * mirror,
                               0,
                               -grow * sin(turn) * mirror,
                               0,
                               0,
                               squash,
                               0,
                               0,
                               grow * sin(turn),
                               0,
                               grow * cos(turn),
                               0,
                               0.8 * (i % 6) - 2,
                               y,
                               0.8 * row - 2,
                               1};
    node->has_matrix = true;
    memcpy(node->matrix, matrix, sizeof matrix);
}

static void build(struct shown *shown, enum content content, bool shares)
{
    int (*add)(struct glb_builder *, const int *, int) = content == BALLS ? add_ball : add_mesh;
    struct error err = {0};
    struct glb_builder *b = glb_builder_create("Shapes", &err);
    int materials[3], meshes[KINDS];
    for (int i = 0; i < 3; i++)
        materials[i] = glb_builder_add_material(
            b, &(struct glb_material_desc){.base_color = {0.8, 0.5 + 0.1 * i, 0.3, 1},
                                           .roughness = 0.5,
                                           .transmission = i == 1,
                                           .thickness = content == BALLS && i == 1,
                                           .is_double_sided = i != 2});
    for (int i = 0; i < KINDS; i++)
        meshes[i] = add(b, materials, i);
    for (int i = 0; i < NODES; i++) {
        struct glb_node_desc node = {.mesh =
                                         shares ? meshes[i % KINDS] : add(b, materials, i % KINDS)};
        place(&node, i);
        glb_builder_add_node(b, &node);
    }
    struct scene_file file = {.name = ""};
    void *bytes;
    if (!glb_builder_finish(b, &bytes, &file.size_bytes, &err))
        fail_msg("%s", err.message);
    file.bytes = bytes;
    glb_builder_destroy(b);
    if (!imported_scene_init(&shown->imported, &file, 1, &err))
        fail_msg("%s", err.message);
    free(bytes);
}

static const struct view_light lamp = {.type = SCENE_LIGHT_SPOT,
                                       .position = {1, 6, 2},
                                       .direction = {-0.15, -1, -0.3},
                                       .color = {1, 1, 1},
                                       .intensity = 100,
                                       .outer_cone_deg = 50};

static void show(struct shown *shown, enum content content, bool shares)
{
    struct error err = {0};
    build(shown, content, shares);
    shown->view = (struct view){
        .width_px = SIDE_PX,
        .height_px = SIDE_PX,
        .lights = &lamp,
        .light_count = 1,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {1, 3, 5}, .target = {0, 0.3, 0}}};
    if (!scene_state_init(&shown->state, &shown->imported.scene, &shown->view, &err))
        fail_msg("%s", err.message);
    assert_true(NODES * TRIANGLES > RT_SHARING_TRIANGLES);
}

static void finish(struct shown *shown)
{
    scene_state_finish(&shown->state);
    imported_scene_finish(&shown->imported);
}

static uint64_t trace(struct shown *shown, struct raytrace_cache *cache, bool is_reference,
                      struct image *image)
{
    struct error err = {0};
    struct camera camera;
    struct raytrace_stats stats = {0};
    shown->view.quality.reference = is_reference;
    if (!camera_resolve(&camera, &shown->view, &shown->state, &err) ||
        !raytrace_render(
            &(struct raytrace_desc){
                .view = &shown->view, .state = &shown->state, .camera = &camera, .cache = cache},
            image, &stats, &err))
        fail_msg("%s", err.message);
    return stats.scene_bytes;
}

/* Pixels that differ by more than rounding: f32 decides otherwise about a ray at a border. */
static int count_different(const struct image *a, const struct image *b)
{
    const float *x = a->pixels, *y = b->pixels;
    int different = 0;
    assert(x && y);
    for (int i = 0; i < 4 * SIDE_PX * SIDE_PX; i += 4) {
        bool is_same = true;
        for (int k = 0; k < 4; k++)
            is_same = is_same && fabs((double)x[i + k] - (double)y[i + k]) <=
                                     1e-5 * (1 + fabs((double)y[i + k]));
        different += !is_same;
    }
    return different;
}

/* The same scene with meshes that are shared and with one for each node. */
static void compare(enum content content)
{
    struct error err = {0};
    struct shown shared = {0}, whole = {0};
    struct raytrace_cache *cache = raytrace_cache_create(&err);
    show(&shared, content, true);
    show(&whole, content, false);
    for (int is_reference = 0; is_reference < 2; is_reference++) {
        struct image one = {0}, other = {0};
        uint64_t shared_bytes = trace(&shared, cache, is_reference, &one);
        uint64_t whole_bytes = trace(&whole, NULL, is_reference, &other);
        int different = count_different(&one, &other);
        print_message("%s: %.1f against %.1f MB, %d of %d pixels differ\n",
                      is_reference ? "reference" : "raytraced", (double)shared_bytes / 1e6,
                      (double)whole_bytes / 1e6, different, SIDE_PX * SIDE_PX);
        assert_true(shared_bytes < whole_bytes / 2);
        assert_true(different <= 4);
        image_finish(&one);
        image_finish(&other);
    }
    raytrace_cache_destroy(cache);
    finish(&whole);
    finish(&shared);
}

static void nodes_of_a_large_scene_share_their_mesh_and_look_the_same(void **unused)
{
    (void)unused;
    compare(SHEETS);
}

static void glass_that_nodes_share_refracts_the_same(void **unused)
{
    (void)unused;
    compare(BALLS);
}

static void assert_same_bits(struct image *a, struct image *b)
{
    assert_memory_equal(a->pixels, b->pixels, sizeof(float[4]) * SIDE_PX * SIDE_PX);
    image_finish(a);
    image_finish(b);
}

/* Also where an instance is moved, and where it is bent so much that it no longer is one. */
static void follow(enum content content)
{
    struct error err = {0};
    struct shown shared = {0};
    struct image moved = {0}, fresh = {0};
    struct raytrace_cache *cache = raytrace_cache_create(&err);
    show(&shared, content, true);
    trace(&shared, cache, false, &moved);
    image_finish(&moved);
    for (int step = 0; step < 2; step++) {
        double *m = shared.state.world[9];
        m[12] -= 0.25;
        for (int k = 4; k < 8 && step == 1; k++)
            m[k] *= 0.01;
        trace(&shared, cache, false, &moved);
        trace(&shared, NULL, false, &fresh);
        assert_same_bits(&moved, &fresh);
    }
    raytrace_cache_destroy(cache);
    finish(&shared);
}

static void instances_follow_their_nodes(void **unused)
{
    (void)unused;
    follow(SHEETS);
}

static void instances_that_refract_follow_their_nodes(void **unused)
{
    (void)unused;
    follow(BALLS);
}

/* Else the tests of balls would show nothing. */
static void balls_bend_what_is_behind_them(void **unused)
{
    (void)unused;
    struct shown shared = {0};
    struct image bent = {0}, straight = {0};
    show(&shared, BALLS, true);
    trace(&shared, NULL, false, &bent);
    shared.view.quality.refraction = VIEW_REFRACTION_OFF;
    trace(&shared, NULL, false, &straight);
    assert_true(count_different(&bent, &straight) > SIDE_PX * SIDE_PX / 20);
    image_finish(&bent);
    image_finish(&straight);
    finish(&shared);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nodes_of_a_large_scene_share_their_mesh_and_look_the_same),
        cmocka_unit_test(glass_that_nodes_share_refracts_the_same),
        cmocka_unit_test(balls_bend_what_is_behind_them),
        cmocka_unit_test(instances_follow_their_nodes),
        cmocka_unit_test(instances_that_refract_follow_their_nodes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
