/* SPDX-License-Identifier: MIT */
/* Layers that are peeled, from one side or from both, give the picture of `lists`: random panes,
 * coplanar ones, many behind one another, samples, tiles, shadows of every kind, lights in batches.
 * Memory does not go by the number of layers; peeling ends where nothing is let through, and says
 * what it drops. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "tests/support/image_checks.h"
#include "tests/support/techniques.h"

enum { WIDTH_PX = 32, HEIGHT_PX = 20, PANES = 48, LAYERS_MOST = 512, PEELERS = 2 };

static const enum transparency peelers[PEELERS] = {TRANSPARENCY_DEPTH_PEELING,
                                                   TRANSPARENCY_DUAL_DEPTH_PEELING};

/* ---- scenes ---- */

/* Quads of the plane z = 0, a corner after the other; beyond one quad each lies behind the last. */
static int add_mesh(struct glb_builder *b, int material, int quads, double step)
{
    static const float corners[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    static const uint32_t order[6] = {0, 1, 2, 0, 2, 3};
    float *positions = calloc((size_t)quads * 12, sizeof *positions);
    float *normals = calloc((size_t)quads * 12, sizeof *normals);
    uint32_t *indices = calloc((size_t)quads * 6, sizeof *indices);
    assert_true(positions && normals && indices);
    for (int i = 0; i < quads * 4; i++) {
        int quad = i / 4;
        positions[3 * i] = corners[i % 4][0];
        positions[3 * i + 1] = corners[i % 4][1];
        positions[3 * i + 2] = (float)(-step * quad);
        normals[3 * i + 2] = 1;
    }
    for (int i = 0; i < quads * 6; i++)
        indices[i] = (uint32_t)(i / 6 * 4) + order[i % 6];
    const struct glb_primitive_desc primitive = {.material = material,
                                                 .vertex_count = (size_t)quads * 4,
                                                 .positions = positions,
                                                 .normals = normals,
                                                 .indices = indices,
                                                 .index_count = (size_t)quads * 6};
    int mesh = glb_builder_add_mesh(b, "quads", &primitive, 1);
    free(positions);
    free(normals);
    free(indices);
    return mesh;
}

static void open_scene(struct glb_builder *b, struct renderer *renderer, struct rig_scene *scene)
{
    struct error err = {0};
    void *glb;
    size_t size;
    assert_true(glb_builder_finish(b, &glb, &size, &err));
    glb_builder_destroy(b);
    rig_scene_open(scene, renderer, "peeled", glb, size);
    free(glb);
}

static double random_unit(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (double)(*state >> 8) / (1 << 24);
}

/* Cloth and glass that interlock before a wall, under a lamp of each kind. */
static void open_random(struct renderer *renderer, struct rig_scene *scene)
{
    struct error err = {0};
    uint32_t seed = 7;
    struct glb_builder *b = glb_builder_create("random", &err);
    struct glb_material_desc wall = {.name = "wall", .roughness = 0.8};
    struct glb_node_desc node = {.mesh = add_mesh(b, glb_builder_add_material(b, &wall), 1, 0),
                                 .translation = {0, 0, -2},
                                 .scale = {3, 3, 1}};
    glb_builder_add_node(b, &node);
    for (int i = 0; i < PANES; i++) {
        struct glb_material_desc pane = {
            .name = "pane", .is_double_sided = true, .base_color[3] = 1};
        for (int k = 0; k < 3; k++)
            pane.base_color[k] = 0.2 + 0.8 * random_unit(&seed);
        if (i % 3) {
            pane.alpha_mode = GLB_BLEND;
            pane.roughness = 0.6;
            pane.base_color[3] = 0.1 + 0.7 * random_unit(&seed);
        } else {
            pane.transmission = 1;
        }
        node = (struct glb_node_desc){.mesh = add_mesh(b, glb_builder_add_material(b, &pane), 1, 0),
                                      .scale = {0.6, 0.6, 0.6}};
        double axis[3] = {random_unit(&seed) - 0.5, random_unit(&seed) - 0.5, 0.3}, length;
        length = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
        for (int k = 0; k < 3; k++) {
            axis[k] /= length;
            node.translation[k] = 2 * random_unit(&seed) - 1;
        }
        glb_node_rotate(&node, axis, 360 * random_unit(&seed));
        glb_builder_add_node(b, &node);
    }
    open_scene(b, renderer, scene);
}

struct stack {
    int count;
    double step, alpha; /* of each pane */
};

static const double stack_color[3] = {0.75, 0.5, 0.25};

/* Panes of light of their own behind one another, in one drawable, before the void. */
static void open_stack(const struct stack *stack, struct renderer *renderer,
                       struct rig_scene *scene)
{
    struct error err = {0};
    struct glb_builder *b = glb_builder_create("stack", &err);
    struct glb_material_desc pane = {
        .name = "pane",
        .alpha_mode = GLB_BLEND,
        .is_unlit = true,
        .is_double_sided = true,
        .base_color = {stack_color[0], stack_color[1], stack_color[2], stack->alpha}};
    struct glb_node_desc node = {
        .mesh = add_mesh(b, glb_builder_add_material(b, &pane), stack->count, stack->step)};
    glb_builder_add_node(b, &node);
    open_scene(b, renderer, scene);
}

static struct view stack_view(int peeler, int side_px, int samples)
{
    return (struct view){
        .width_px = side_px,
        .height_px = side_px,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 0, 9}, .ortho_height = 1},
        .ignore_scene_lights = true,
        .studio = VIEW_STUDIO_OFF,
        .outputs = 1u << VIEW_OUTPUT_COLOR,
        .quality = {.transparency = peelers[peeler], .samples = samples}};
}

/* ---- comparing ---- */

static const struct view_light lamps[] = {
    {.type = SCENE_LIGHT_POINT, .position = {1, 2, 3}, .color = {1, 0.9f, 0.8f}, .intensity = 20},
    {.type = SCENE_LIGHT_SPOT,
     .position = {-2, 1, 4},
     .direction = {0.4, -0.2, -1},
     .color = {0.8f, 0.9f, 1},
     .intensity = 40},
    {.type = SCENE_LIGHT_DIRECTIONAL,
     .direction = {-0.2, -1, -0.7},
     .color = {1, 1, 1},
     .intensity = 2},
};

static struct view random_view(int peeler, enum shadow_technique shadows, int samples)
{
    return (struct view){.width_px = WIDTH_PX,
                         .height_px = HEIGHT_PX,
                         .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0.4, 0.3, 3.5}},
                         .lights = lamps,
                         .light_count = sizeof lamps / sizeof *lamps,
                         .outputs = 1u << VIEW_OUTPUT_COLOR,
                         .has_environment = true,
                         .sky = {0.3f, 0.3f, 0.4f},
                         .ground = {0.1f, 0.1f, 0.1f},
                         .quality = {.shadows = shadows,
                                     .samples = samples,
                                     .shadow_resolution = 64,
                                     .transparency = peelers[peeler]}};
}

static void assert_as_lists(struct renderer *renderer, const struct rig_scene *scene,
                            const struct view *view, uint64_t layers_least)
{
    struct view listed = *view;
    struct frame peeled, lists;
    listed.quality.transparency = TRANSPARENCY_LISTS;
    shoot(renderer, scene, view, &peeled);
    shoot(renderer, scene, &listed, &lists);
    assert_true(report_has_pass(&peeled.report, "transparency.peel",
                                transparency_name((int)view->quality.transparency)));
    assert_true(peeled.report.counts.peeled_layers >= layers_least);
    assert_int_equal(peeled.report.counts.transparent_fragments,
                     lists.report.counts.transparent_fragments);
    assert_images_close(&peeled.outputs[VIEW_OUTPUT_COLOR], &lists.outputs[VIEW_OUTPUT_COLOR], 1e-3,
                        1e-6);
    frame_finish(&peeled);
    frame_finish(&lists);
}

/* ---- claims ---- */

static void interlocking_panes_are_as_in_lists_with_any_samples(void **state)
{
    struct rig_scene scene;
    open_random(*state, &scene);
    for (int i = 0; i < PEELERS; i++) {
        for (int samples = 1; samples <= 16; samples *= 4) {
            struct view view = random_view(i, SHADOWS_DEEP, samples);
            view.camera.ortho_height = samples == 4 ? 2 : 0; /* triangles are clipped */
            assert_as_lists(*state, &scene, &view, 10);
        }
        const struct view view = random_view(i, SHADOWS_DEEP, 4);
        assert_as_lists(*state, &scene, &view, 10);
        struct image color = shoot_color(*state, &scene, &view);
        struct image again = shoot_color(*state, &scene, &view);
        assert_same_bits(&color, &again);
        save_picture(&color, transparency_name((int)peelers[i]));
        image_finish(&color);
        image_finish(&again);
    }
    rig_scene_finish(&scene, *state);
}

static void layers_are_lit_through_shadows_of_every_kind(void **state)
{
    struct rig_scene scene;
    enum shadow_technique techniques[SHADOWS_COUNT];
    size_t count = raster_techniques(0, techniques);
    open_random(*state, &scene);
    for (size_t i = 0; i < count; i++) {
        const struct view view = random_view((int)i % PEELERS, techniques[i], 1);
        if (shadow_technique_family(techniques[i]) != SHADOW_FAMILY_POINTS)
            assert_as_lists(*state, &scene, &view, 10);
    }
    rig_scene_finish(&scene, *state);
}

/* Each is a layer of its own, in the order of the lists. */
static void coplanar_panes_are_all_there(void **state)
{
    for (int i = 0; i < 4 * PEELERS; i++) {
        struct rig_scene scene;
        int layers = 5 + i / PEELERS % 2, samples = i / PEELERS < 2 ? 1 : 4;
        const struct view view = stack_view(i % PEELERS, 8, samples);
        const struct stack stack = {.count = layers, .alpha = 0.25};
        open_stack(&stack, *state, &scene);
        assert_as_lists(*state, &scene, &view, (uint64_t)layers);
        struct image color = shoot_color(*state, &scene, &view);
        double covered = 1 - pow(0.75, layers);
        for (int k = 0; k < 3; k++)
            assert_true(fabs((double)image_pixel_f32(&color, 4, 4)[k] - stack_color[k] * covered) <
                        1e-4);
        image_finish(&color);
        rig_scene_finish(&scene, *state);
    }
}

static uint64_t memory_of(struct renderer *renderer, int peeler, int count,
                          struct frame_report *report)
{
    struct rig_scene scene;
    struct frame frame;
    const struct view view = stack_view(peeler, 16, 1);
    const struct stack stack = {.count = count, .step = 0.01, .alpha = 1.0 / 64};
    open_stack(&stack, renderer, &scene);
    shoot(renderer, &scene, &view, &frame);
    double covered = 1 - pow(1 - stack.alpha, count);
    const float *seen = image_pixel_f32(&frame.outputs[VIEW_OUTPUT_COLOR], 8, 8);
    for (int k = 0; k < 3; k++)
        assert_true(fabs((double)seen[k] - stack_color[k] * covered) < 1e-3);
    *report = frame.report;
    frame_finish(&frame);
    rig_scene_finish(&scene, renderer);
    return report_bytes_of(report, "peeled_layers");
}

static void memory_goes_by_pixels_alone(void **state)
{
    for (int i = 0; i < PEELERS; i++) {
        struct frame_report report;
        uint64_t few = memory_of(*state, i, 2, &report);
        assert_int_equal(report.counts.peeled_layers, 2);
        uint64_t many = memory_of(*state, i, 199, &report);
        assert_int_equal(report.counts.peeled_layers, 199);
        assert_int_equal(report.counts.dropped_layers, 0);
        assert_int_equal(report.counts.longest_pixel_list, 199);
        assert_true(few > 0);
        assert_int_equal(few, many);
    }
}

static void nothing_is_peeled_behind_what_lets_nothing_through(void **state)
{
    for (int i = 0; i < PEELERS; i++) {
        struct rig_scene scene;
        struct frame frame;
        const struct view view = stack_view(i, 8, 1);
        const struct stack stack = {.count = 40, .step = 0.01, .alpha = 0.99};
        open_stack(&stack, *state, &scene);
        shoot(*state, &scene, &view, &frame);
        assert_int_equal(frame.report.counts.longest_pixel_list, 40);
        assert_int_equal(frame.report.counts.peeled_layers, 8 * (i + 1));
        assert_int_equal(frame.report.counts.dropped_layers, 0);
        frame_finish(&frame);
        assert_as_lists(*state, &scene, &view, 8);
        rig_scene_finish(&scene, *state);
    }
}

static void what_is_dropped_is_counted_and_warned_of(void **state)
{
    enum { SIDE_PX = 2, MORE = 3 };
    for (int i = 0; i < PEELERS; i++) {
        struct rig_scene scene;
        struct frame frame;
        const struct view view = stack_view(i, SIDE_PX, 1);
        const struct stack stack = {.count = LAYERS_MOST + MORE, .step = 1e-3, .alpha = 1e-3};
        open_stack(&stack, *state, &scene);
        shoot(*state, &scene, &view, &frame);
        assert_int_equal(frame.report.counts.peeled_layers, LAYERS_MOST);
        assert_int_equal(frame.report.counts.dropped_layers, MORE * SIDE_PX * SIDE_PX);
        assert_true(report_has_warning(&frame.report, "depth-peeling ends after 512 of them"));
        double covered = 1 - pow(1 - stack.alpha, LAYERS_MOST);
        assert_true(fabs((double)image_pixel_f32(&frame.outputs[VIEW_OUTPUT_COLOR], 1, 1)[0] -
                         stack_color[0] * covered) < 1e-3);
        frame_finish(&frame);
        rig_scene_finish(&scene, *state);
    }
}

static void tiles_have_the_bits_of_the_whole(void **state)
{
    static const struct view_tile tiles[] = {{0, 0, 13, 20}, {13, 5, 19, 9}};
    struct rig_scene scene;
    struct view view = random_view(1, SHADOWS_DEEP, 4);
    open_random(*state, &scene);
    struct image whole = shoot_color(*state, &scene, &view);
    for (size_t i = 0; i < sizeof tiles / sizeof *tiles; i++) {
        const struct view_tile *tile = &tiles[i];
        view.tile = *tile;
        struct image part = shoot_color(*state, &scene, &view);
        for (int y = 0; y < tile->height_px; y++)
            assert_memory_equal(image_pixel_f32(&part, 0, y),
                                image_pixel_f32(&whole, tile->x_px, tile->y_px + y),
                                (size_t)tile->width_px * 4 * sizeof(float));
        image_finish(&part);
    }
    image_finish(&whole);
    rig_scene_finish(&scene, *state);
}

/* Each batch peels the layers anew, and adds to their light. */
static void batches_of_lights_add_up(void **state)
{
    struct error err = {0};
    struct rig_scene scene;
    struct frame frame;
    (void)state;
    struct renderer *renderer = renderer_create(
        &(struct renderer_desc){.is_strict = true, .gpu_budget_bytes = 36 << 20}, &err);
    assert_non_null(renderer);
    struct view view = random_view(1, SHADOWS_DEEP, 1);
    struct view_light spots[6];
    for (int i = 0; i < 6; i++) { /* a map of one face each */
        spots[i] = lamps[1];
        spots[i].position[0] += 0.5 * i;
    }
    view.lights = spots;
    view.light_count = 6;
    view.quality.shadow_resolution = 512;
    open_random(renderer, &scene);
    shoot(renderer, &scene, &view, &frame);
    assert_int_in_range(frame.report.counts.light_batches, 2, 100);
    frame_finish(&frame);
    for (int i = 0; i < PEELERS; i++) {
        view.quality.transparency = peelers[i];
        assert_as_lists(renderer, &scene, &view, 10);
    }
    rig_scene_finish(&scene, renderer);
    renderer_destroy(renderer);
}

/* Where f64 is slow: also what is joined of both sides. */
static void pairs_of_floats_add_up_as_well(void **state)
{
    struct error err = {0};
    struct rig_scene scene;
    (void)state;
    const struct renderer_desc desc = {.is_strict = true,
                                       .hooks.wide_floats = WIDE_FLOATS_PAIRS_SPLIT};
    struct renderer *renderer = renderer_create(&desc, &err);
    assert_non_null(renderer);
    open_random(renderer, &scene);
    for (int i = 0; i < PEELERS; i++) {
        const struct view view = random_view(i, SHADOWS_DEEP, 4);
        assert_as_lists(renderer, &scene, &view, 10);
    }
    rig_scene_finish(&scene, renderer);
    renderer_destroy(renderer);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(interlocking_panes_are_as_in_lists_with_any_samples),
        cmocka_unit_test(layers_are_lit_through_shadows_of_every_kind),
        cmocka_unit_test(coplanar_panes_are_all_there),
        cmocka_unit_test(memory_goes_by_pixels_alone),
        cmocka_unit_test(nothing_is_peeled_behind_what_lets_nothing_through),
        cmocka_unit_test(what_is_dropped_is_counted_and_warned_of),
        cmocka_unit_test(tiles_have_the_bits_of_the_whole),
    };
    const struct CMUnitTest with_a_renderer_of_their_own[] = {
        cmocka_unit_test(batches_of_lights_add_up),
        cmocka_unit_test(pairs_of_floats_add_up_as_well),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown) +
           cmocka_run_group_tests(with_a_renderer_of_their_own, NULL, NULL);
}
