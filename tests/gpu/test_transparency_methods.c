/* SPDX-License-Identifier: MIT */
/* What holds of every transparency method in the table: a single layer is exact, runs give the same
 * bits, the report has the passes of the method that the request names, and what its row lacks is
 * drawn by another with a warning. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "renderer/transparency/method.h"
#include "tests/support/render_support.h"

enum { SIDE_PX = 24 };

static const float pane_color[3] = {0.75f, 0.5f, 0.25f};

/* A clear pane before a glowing wall. */
static void build_pane(void **glb, size_t *size)
{
    static const float positions[] = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0};
    static const float normals[] = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
    static const uint32_t indices[] = {0, 1, 2, 0, 2, 3};
    const struct glb_material_desc materials[] = {
        {.name = "wall", .is_unlit = true, .base_color = {1, 1, 1, 1}},
        {.name = "pane",
         .roughness = 1,
         .has_ior = true,
         .ior = 1,
         .transmission = 1,
         .base_color = {pane_color[0], pane_color[1], pane_color[2], 1},
         .is_double_sided = true},
    };
    struct error err = {0};
    struct glb_builder *b = glb_builder_create("pane", &err);
    for (int i = 0; i < 2; i++) {
        struct glb_primitive_desc quad = {.vertex_count = 4,
                                          .positions = positions,
                                          .normals = normals,
                                          .indices = indices,
                                          .index_count = 6};
        quad.material = glb_builder_add_material(b, &materials[i]);
        int mesh = glb_builder_add_mesh(b, materials[i].name, &quad, 1);
        glb_builder_add_node(b, &(struct glb_node_desc){.name = materials[i].name,
                                                        .mesh = mesh,
                                                        .translation = {0, 0, i ? 0 : -5}});
    }
    assert_true(glb_builder_finish(b, glb, size, &err));
    glb_builder_destroy(b);
}

static void render_pane_at(struct renderer *renderer, int transparency, uint32_t outputs,
                           int samples, struct frame *frame)
{
    struct rig_scene scene;
    struct error err = {0};
    void *glb;
    size_t size;
    const struct view view = {
        .width_px = SIDE_PX,
        .height_px = SIDE_PX,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 0, 10}, .ortho_height = 1.5},
        .ignore_scene_lights = true,
        .outputs = outputs,
        .quality = {.transparency = (enum transparency)transparency, .samples = samples},
    };
    build_pane(&glb, &size);
    assert_true(rig_scene_from_glb(&scene, renderer, "pane", glb, size, &err));
    if (!renderer_render(renderer, scene.key, &view, frame, &err))
        fail_msg("%s: %s", transparency_name(transparency), err.message);
    rig_scene_finish(&scene, renderer);
    free(glb);
}

static void render_pane(struct renderer *renderer, int transparency, uint32_t outputs,
                        struct frame *frame)
{
    render_pane_at(renderer, transparency, outputs, 4, frame);
}

static void a_single_layer_is_exact(void **state)
{
    for (int i = 0; i < TRANSPARENCIES_COUNT; i++) {
        struct frame frame;
        render_pane(*state, i, 1u << VIEW_OUTPUT_COLOR, &frame);
        for (int k = 0; k < 3 * SIDE_PX * SIDE_PX; k++) {
            int pixel = k / 3, c = k % 3;
            double seen = (double)image_pixel_f32(&frame.outputs[VIEW_OUTPUT_COLOR],
                                                  pixel % SIDE_PX, pixel / SIDE_PX)[c];
            if (!(fabs(seen - (double)pane_color[c]) < 1e-4))
                fail_msg("%s: %g", transparency_name(i), seen);
        }
        frame_finish(&frame);
    }
}

static void runs_give_the_same_bits(void **state)
{
    for (int i = 0; i < TRANSPARENCIES_COUNT; i++) {
        struct frame frames[2];
        for (int k = 0; k < 2; k++)
            render_pane(*state, i, 1u << VIEW_OUTPUT_COLOR, &frames[k]);
        const struct image *a = &frames[0].outputs[VIEW_OUTPUT_COLOR],
                           *b = &frames[1].outputs[VIEW_OUTPUT_COLOR];
        assert_memory_equal(a->pixels, b->pixels, image_size_bytes(a));
        frame_finish(&frames[0]);
        frame_finish(&frames[1]);
    }
}

static bool has_pass(const struct frame_report *report, const char *pass, const char *technique)
{
    for (int i = 0; i < report->pass_count; i++)
        if (!strcmp(report->passes[i].pass, pass) &&
            !strcmp(report->passes[i].technique, technique))
            return true;
    return false;
}

static void the_report_has_the_passes_of_the_method(void **state)
{
    for (int i = TRANSPARENCY_AUTO + 1; i < TRANSPARENCIES_COUNT; i++) {
        const struct transparency_method *method = transparency_method_of((enum transparency)i);
        struct frame frame;
        for (int samples = 1; samples <= 4; samples += 3) { /* the second finds nothing kept */
            render_pane_at(*state, i, 1u << VIEW_OUTPUT_COLOR, samples, &frame);
            if (samples == 1)
                frame_finish(&frame);
        }
        for (const struct transparency_pass *pass = method->passes; pass->name; pass++)
            if (!has_pass(&frame.report, pass->name, transparency_name(i)))
                fail_msg("%s by %s", pass->name, transparency_name(i));
        assert_true(has_pass(&frame.report, "shade.transparent", transparency_name(i)));
        frame_finish(&frame);
    }
}

static bool is_warned_of(const struct frame_report *report, const char *text)
{
    for (int i = 0; i < report->warning_count; i++)
        if (strstr(report->warnings[i], text))
            return true;
    return false;
}

static void what_a_row_lacks_is_drawn_by_another_with_a_warning(void **state)
{
    for (int i = 0; i < TRANSPARENCIES_COUNT; i++) {
        struct frame frame;
        bool can = transparency_rows[i].can & TRANSPARENCY_CAN_OUTPUTS;
        render_pane(*state, i, 1u << VIEW_OUTPUT_COLOR | 1u << VIEW_OUTPUT_LAYERS, &frame);
        assert_int_equal(is_warned_of(&frame.report, "does not go with outputs"), !can);
        const uint32_t *layers = frame.outputs[VIEW_OUTPUT_LAYERS].pixels;
        assert_int_equal(layers[SIDE_PX * SIDE_PX / 2], 1);
        frame_finish(&frame);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_single_layer_is_exact),
        cmocka_unit_test(runs_give_the_same_bits),
        cmocka_unit_test(the_report_has_the_passes_of_the_method),
        cmocka_unit_test(what_a_row_lacks_is_drawn_by_another_with_a_warning),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
