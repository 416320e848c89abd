/* SPDX-License-Identifier: MIT */
/* Weighted blending: the closed form of its picture for several layers, no layer lost among many,
 * the warning of what it approximates, and `lists` in its place where it does not go. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "tests/support/render_support.h"

enum { SIDE_PX = 8, MANY_PANES = 64 };
static const double eye_z = 10;

struct pane {
    double z, color[3], alpha, transmission;
};

static const struct pane three[] = {
    {.z = 2, .color = {1, 0.25, 0.125}, .alpha = 0.75},
    {.z = 1, .color = {0.125, 1, 0.25}, .alpha = 0.5},
    {.z = -6, .color = {0.25, 0.125, 1}, .alpha = 0.25},
};

static void add_quad(struct glb_builder *b, const struct glb_material_desc *material, double z)
{
    static const float positions[] = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0};
    static const float normals[] = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
    static const uint32_t indices[] = {0, 1, 2, 0, 2, 3};
    struct glb_primitive_desc quad = {.vertex_count = 4,
                                      .positions = positions,
                                      .normals = normals,
                                      .indices = indices,
                                      .index_count = 6};
    quad.material = glb_builder_add_material(b, material);
    int mesh = glb_builder_add_mesh(b, material->name, &quad, 1);
    glb_builder_add_node(
        b, &(struct glb_node_desc){.name = material->name, .mesh = mesh, .translation = {0, 0, z}});
}

/* Panes of light of their own before a white wall of light. */
static void build(const struct pane *panes, int count, void **glb, size_t *size)
{
    struct error err = {0};
    struct glb_builder *b = glb_builder_create("panes", &err);
    add_quad(b, &(struct glb_material_desc){.name = "wall", .is_unlit = true}, -20);
    for (int i = 0; i < count; i++) {
        const double *color = panes[i].color;
        struct glb_material_desc material = {
            .name = "pane",
            .is_double_sided = true,
            .roughness = 0.5,
            .base_color = {color[0], color[1], color[2], 1},
            .transmission = panes[i].transmission,

        };
        if (panes[i].transmission <= 0) {
            material.alpha_mode = GLB_BLEND;
            material.is_unlit = true;
            material.base_color[3] = panes[i].alpha;
        }
        add_quad(b, &material, panes[i].z);
    }
    assert_true(glb_builder_finish(b, glb, size, &err));
    glb_builder_destroy(b);
}

static void render(struct renderer *renderer, const struct pane *panes, int count,
                   enum transparency transparency, double haze, struct frame *frame)
{
    struct rig_scene scene;
    struct error err = {0};
    void *glb;
    size_t size;
    const struct view view = {
        .width_px = SIDE_PX,
        .height_px = SIDE_PX,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 0, eye_z}, .ortho_height = 1.5},
        .ignore_scene_lights = true,
        .outputs = 1u << VIEW_OUTPUT_COLOR,
        .atmosphere = {.density_per_m = haze, .color = {1, 1, 1}},
        .quality = {.transparency = transparency, .samples = 1},
    };
    build(panes, count, &glb, &size);
    assert_true(rig_scene_from_glb(&scene, renderer, "panes", glb, size, &err));
    if (!renderer_render(renderer, scene.key, &view, frame, &err))
        fail_msg("%s", err.message);
    rig_scene_finish(&scene, renderer);
    free(glb);
}

static bool is_warned_of(const struct frame_report *report, const char *text)
{
    for (int i = 0; i < report->warning_count; i++)
        if (strstr(report->warnings[i], text))
            return true;
    return false;
}

/* Equations 6 and 7 of McGuire and Bavoil 2013, before a wall of 1. */
static double expected(const struct pane *panes, int count, int channel)
{
    double light = 0, opacity = 0, through = 1;
    for (int i = 0; i < count; i++) {
        double z = eye_z - panes[i].z, alpha = panes[i].alpha;
        double weight =
            fmax(1e-2, fmin(3e3, 10 / (1e-5 + pow(z / 5, 2) + pow(z / 200, 6)))) * alpha;
        light += weight * alpha * panes[i].color[channel];
        opacity += weight * alpha;
        through *= 1 - alpha;
    }
    return light / opacity * (1 - through) + through;
}

static double exact(const struct pane *panes, int count, int channel)
{
    double light = 0, through = 1;
    for (int i = 0; i < count; i++) {
        light += through * panes[i].alpha * panes[i].color[channel];
        through *= 1 - panes[i].alpha;
    }
    return light + through;
}

static void layers_are_a_mean_by_weights(void **state)
{
    struct frame blended, listed;
    render(*state, three, 3, TRANSPARENCY_WEIGHTED_BLENDED, 0, &blended);
    render(*state, three, 3, TRANSPARENCY_LISTS, 0, &listed);
    const float *b = image_pixel_f32(&blended.outputs[VIEW_OUTPUT_COLOR], 4, 4);
    const float *l = image_pixel_f32(&listed.outputs[VIEW_OUTPUT_COLOR], 4, 4);
    for (int c = 0; c < 3; c++) {
        assert_true(fabs((double)b[c] - expected(three, 3, c)) < 1e-4);
        assert_true(fabs((double)l[c] - exact(three, 3, c)) < 1e-4);
    }
    assert_true(is_warned_of(&blended.report, "transparency weighted-blended averages"));
    assert_false(is_warned_of(&listed.report, "averages"));
    frame_finish(&blended);
    frame_finish(&listed);
}

/* Of one light, every mean is that light: exact for any number of layers, in any order. */
static void no_layer_is_lost_among_many(void **state)
{
    struct pane panes[MANY_PANES];
    struct frame frame;
    for (int i = 0; i < MANY_PANES; i++)
        panes[i] = (struct pane){.z = i * 37 % MANY_PANES * 0.1, .color = {0.5, 0.25, 0.125}};
    for (int i = 0; i < MANY_PANES; i++)
        panes[i].alpha = 1 / 64.0;
    render(*state, panes, MANY_PANES, TRANSPARENCY_WEIGHTED_BLENDED, 0, &frame);
    const float *seen = image_pixel_f32(&frame.outputs[VIEW_OUTPUT_COLOR], 4, 4);
    for (int c = 0; c < 3; c++)
        assert_true(fabs((double)seen[c] - exact(panes, MANY_PANES, c)) < 1e-4);
    assert_int_equal(frame.report.counts.longest_pixel_list, MANY_PANES);
    frame_finish(&frame);
}

static void expect_lists(struct renderer *renderer, const struct pane *panes, int count,
                         double haze, const char *warning)
{
    struct frame frames[2];
    render(renderer, panes, count, TRANSPARENCY_WEIGHTED_BLENDED, haze, &frames[0]);
    render(renderer, panes, count, TRANSPARENCY_LISTS, haze, &frames[1]);
    assert_true(is_warned_of(&frames[0].report, warning));
    assert_false(is_warned_of(&frames[0].report, "averages"));
    const struct image *a = &frames[0].outputs[VIEW_OUTPUT_COLOR],
                       *b = &frames[1].outputs[VIEW_OUTPUT_COLOR];
    assert_memory_equal(a->pixels, b->pixels, image_size_bytes(a));
    frame_finish(&frames[0]);
    frame_finish(&frames[1]);
}

/* A rough pane of glass scatters what is behind it. */
static void what_refracts_is_drawn_by_lists(void **state)
{
    const struct pane panes[] = {three[0], {.z = 0, .color = {0.5, 0.75, 1}, .transmission = 1}};
    expect_lists(*state, panes, 2, 0,
                 "weighted-blended does not go with refraction: lists takes its place");
}

/* Also where no light shines into it: it dims the layers and what is behind them. */
static void haze_is_drawn_by_lists(void **state)
{
    expect_lists(*state, three, 3, 0.05,
                 "weighted-blended does not go with haze: lists takes its place");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(layers_are_a_mean_by_weights),
        cmocka_unit_test(no_layer_is_lost_among_many),
        cmocka_unit_test(what_refracts_is_drawn_by_lists),
        cmocka_unit_test(haze_is_drawn_by_lists),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
