/* SPDX-License-Identifier: MIT */
/* What the camera sees through very many layers: their product; more than one pass can hold, in
 * parts; more than a list may have, refused. */
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
#include "tests/support/image_checks.h"

struct stack {
    int layers;
    double color[3]; /* of the panes */
    double coverage; /* of blended, unlit panes; 0: clear panes that filter by their colour */
    double glow[3];  /* of the floor; all 0 means 1 */
};

/* A glowing floor under panes of one colour, as one mesh, between y = 1 and y = 2. */
static void open_stack(struct rig_scene *scene, struct renderer *renderer,
                       const struct stack *stack)
{
    int layers = stack->layers;
    const double *color = stack->color, *glow_of = stack->glow;
    bool is_white = glow_of[0] + glow_of[1] + glow_of[2] == 0;
    struct error err = {0};
    struct glb_builder *b = glb_builder_create("Stack", &err);
    struct shape floor = {0}, panes = {0};
    void *bytes;
    size_t size;
    shape_add_quad(&floor, (double[]){-4, 0, 4}, (double[]){8, 0, 0}, (double[]){0, 0, -8});
    for (int i = 0; i < layers; i++)
        shape_add_quad(&panes, (double[]){-2, 1 + (double)i / layers, 2}, (double[]){4, 0, 0},
                       (double[]){0, 0, -4});
    struct glb_material_desc glow = {.base_color = {0, 0, 0, 1}};
    for (int k = 0; k < 3; k++)
        glow.emissive[k] = is_white ? 1 : glow_of[k];
    struct glb_material_desc glass = {.base_color = {color[0], color[1], color[2], 1},
                                      .transmission = 1,
                                      .has_ior = true,
                                      .ior = 1,
                                      .is_double_sided = true};
    if (stack->coverage > 0) {
        glass.transmission = 0;
        glass.alpha_mode = GLB_BLEND;
        glass.base_color[3] = stack->coverage;
        glass.is_unlit = true;
    }
    int floor_mesh = shape_give_mesh(&floor, b, "Floor", glb_builder_add_material(b, &glow));
    int pane_mesh = shape_give_mesh(&panes, b, "Panes", glb_builder_add_material(b, &glass));
    glb_builder_add_node(b, &(struct glb_node_desc){.name = "Floor", .mesh = floor_mesh});
    glb_builder_add_node(b, &(struct glb_node_desc){.name = "Panes", .mesh = pane_mesh});
    if (!glb_builder_finish(b, &bytes, &size, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(b);
    rig_scene_open(scene, renderer, "stack", bytes, size);
    free(bytes);
}

static struct view view_down(int width, int height)
{
    return (struct view){.width_px = width,
                         .height_px = height,
                         .ignore_scene_lights = true,
                         .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                    .eye = {0.1, 4, 0.2},
                                    .target = {0, 0, 0.1},
                                    .up = {0, 0, -1},
                                    .fov_y_deg = 30},
                         .quality = {.samples = 1}};
}

static void thousands_of_layers_are_seen_through_as_their_product(void **state)
{
    static const double filters[3] = {0.999, 0.5, 1 - 1e-7};
    static const char *const names[3] = {"0.999", "0.5", "1 - 1e-7"};
    static const int counts[] = {1, 100, 1000, 10000};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        struct rig_scene scene;
        struct view view = view_down(4, 4);
        open_stack(
            &scene, *state,
            &(struct stack){.layers = counts[i], .color = {filters[0], filters[1], filters[2]}});
        struct image seen = shoot_color(*state, &scene, &view);
        assert_image_is_sound(&seen, 1.001);
        for (int k = 0; k < 3; k++) {
            double expected = pow((double)(float)filters[k], counts[i]), worst = 0;
            for (int p = 0; p < 16; p++) {
                double value = (double)image_pixel_f32(&seen, p % 4, p / 4)[k];
                worst = fmax(worst, expected < 1e-38 ? (value > 0) : fabs(value / expected - 1));
            }
            char name[64];
            snprintf(name, sizeof name, "%d layers of %s before the camera", counts[i], names[k]);
            extreme_expect(&(struct extreme_row){name, "lists", "relative error", 1e-5}, worst);
        }
        image_finish(&seen);
        rig_scene_finish(&scene, *state);
    }
}

/* Red: what the panes add; blue: what they let through of the floor; green: both, which is 1. */
static void thousands_of_thin_veils_add_up_and_cover(void **state)
{
    static const double coverages[3] = {1e-3, 0.5, 1e-7};
    static const int counts[] = {1, 100, 1000, 10000};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        for (int c = 0; c < 3; c++) {
            struct rig_scene scene;
            struct view view = view_down(4, 4);
            /* with several samples a pixel may list both triangles of a pane */
            view.quality.samples = counts[i] > 5000 ? 1 : 4;
            open_stack(&scene, *state,
                       &(struct stack){.layers = counts[i],
                                       .color = {1, 1, 0},
                                       .coverage = coverages[c],
                                       .glow = {0, 1, 1}});
            struct image seen = shoot_color(*state, &scene, &view);
            double log_t = counts[i] * log1p(-(double)(float)coverages[c]), worst = 0;
            const double expected[3] = {-expm1(log_t), 1, exp(log_t)};
            for (int p = 0; p < 16; p++)
                for (int k = 0; k < 3; k++) {
                    double value = (double)image_pixel_f32(&seen, p % 4, p / 4)[k];
                    worst = fmax(worst,
                                 expected[k] < 1e-38 ? (value > 0) : fabs(value / expected[k] - 1));
                }
            char name[64];
            snprintf(name, sizeof name, "%d veils of %g before the camera", counts[i],
                     coverages[c]);
            extreme_expect(&(struct extreme_row){name, "lists", "relative error", 1e-5}, worst);
            image_finish(&seen);
            rig_scene_finish(&scene, *state);
        }
    }
}

/* 6.5 million fragments are more than a pass holds: the picture is made in parts, and is that of a
 * third of its size at the same points. */
static void a_window_of_too_many_layers_is_split_and_shows_the_same(void **state)
{
    struct rig_scene scene;
    struct frame frame;
    struct view view = view_down(48, 48);
    open_stack(&scene, *state, &(struct stack){.layers = 300, .color = {0.999, 0.99, 0.998}});
    struct image small = shoot_color(*state, &scene, &view);
    view = view_down(144, 144);
    shoot(*state, &scene, &view, &frame);
    bool is_split = false;
    for (int i = 0; i < frame.report.warning_count; i++)
        is_split = is_split || strstr(frame.report.warnings[i], "windows");
    assert_true(is_split);
    double worst = 0;
    for (int y = 0; y < 48; y++)
        for (int x = 0; x < 48; x++)
            for (int k = 0; k < 3; k++)
                worst = fmax(worst, fabs((double)image_pixel_f32(&small, x, y)[k] -
                                         (double)image_pixel_f32(&frame.outputs[VIEW_OUTPUT_COLOR],
                                                                 3 * x + 1, 3 * y + 1)[k]));
    extreme_expect(&(struct extreme_row){"6.2 million fragments in parts", "lists",
                                         "difference to one part", 0},
                   worst);
    frame_finish(&frame);
    image_finish(&small);
    rig_scene_finish(&scene, *state);
}

static void more_layers_than_a_list_holds_are_refused_by_number(void **state)
{
    struct rig_scene scene;
    struct frame frame;
    struct error err = {0};
    struct view view = view_down(2, 2);
    open_stack(&scene, *state, &(struct stack){.layers = 20001, .color = {0.999, 0.99, 0.998}});
    assert_false(renderer_render(*state, scene.key, &view, &frame, &err));
    assert_int_equal(err.code, ERROR_OVER_BUDGET);
    assert_non_null(strstr(err.message, "20001"));
    assert_non_null(strstr(err.message, "20000"));
    rig_scene_finish(&scene, *state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(thousands_of_layers_are_seen_through_as_their_product),
        cmocka_unit_test(thousands_of_thin_veils_add_up_and_cover),
        cmocka_unit_test(a_window_of_too_many_layers_is_split_and_shows_the_same),
        cmocka_unit_test(more_layers_than_a_list_holds_are_refused_by_number),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
