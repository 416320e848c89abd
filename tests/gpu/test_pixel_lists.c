/* SPDX-License-Identifier: MIT */
/* The camera's exact per-pixel lists against the product of the layers, at any depth of the stack.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <epoxy/gl.h>

#include "glb/glb_builder.h"
#include "tests/support/gl_hooks.h"
#include "tests/support/render_support.h"

enum { SIDE_PX = 24 };

/* n clear panes of filter t between an orthographic camera and a glowing wall; `order` permutes how
 * they are stored. */
static void build_stack(int n, const double *t, const int *order, bool blended, void **glb,
                        size_t *size)
{
    static const float positions[] = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0};
    static const float normals[] = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
    static const uint32_t indices[] = {0, 1, 2, 0, 2, 3};
    struct error err = {0};
    struct glb_builder *b = glb_builder_create("stack", &err);
    struct glb_primitive_desc quad = {.vertex_count = 4,
                                      .positions = positions,
                                      .normals = normals,
                                      .indices = indices,
                                      .index_count = 6};
    quad.material = glb_builder_add_material(
        b,
        &(struct glb_material_desc){.name = "wall", .is_unlit = true, .base_color = {1, 1, 1, 1}});
    int wall = glb_builder_add_mesh(b, "wall", &quad, 1);
    glb_builder_add_node(
        b, &(struct glb_node_desc){.name = "wall", .mesh = wall, .translation = {0, 0, -50}});
    for (int k = 0; k < n; k++) {
        int i = order ? order[k] : k;
        struct glb_material_desc pane = {
            .name = "pane", .roughness = 1, .has_ior = true, .ior = 1, .is_double_sided = true};
        if (blended) {
            pane.alpha_mode = GLB_BLEND;
            pane.base_color[3] = 1 - t[3 * i];
        } else {
            pane.transmission = 1;
            pane.base_color[3] = 1;
            for (int c = 0; c < 3; c++)
                pane.base_color[c] = t[3 * i + c];
        }
        quad.material = glb_builder_add_material(b, &pane);
        int mesh = glb_builder_add_mesh(b, "pane", &quad, 1);
        glb_builder_add_node(b, &(struct glb_node_desc){.name = "pane",
                                                        .mesh = mesh,
                                                        .translation = {0, 0, -0.002 * (i + 1)}});
    }
    assert_true(glb_builder_finish(b, glb, size, &err));
    glb_builder_destroy(b);
}

static bool try_stack(struct renderer *renderer, const void *glb, size_t size, int samples,
                      struct frame *frame, struct error *err)
{
    struct rig_scene scene;
    assert_true(rig_scene_from_glb(&scene, renderer, "stack", glb, size, err));
    struct view view = {
        .width_px = SIDE_PX,
        .height_px = SIDE_PX,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 0, 10}, .ortho_height = 1.5},
        .ignore_scene_lights = true,
        .quality.samples = samples,
    };
    bool is_made = renderer_render(renderer, scene.key, &view, frame, err);
    rig_scene_finish(&scene, renderer);
    return is_made;
}

static void render_stack(struct renderer *renderer, const void *glb, size_t size, int samples,
                         struct frame *frame)
{
    struct error err = {0};
    if (!try_stack(renderer, glb, size, samples, frame, &err))
        fail_msg("%s", err.message);
}

/* A device that is not our own processors walks a pixel's list once for each sample. One that ends
 * loops, too, which only tests make, has no room for 10,000 layers at four samples. */
static void expect_refusal(struct renderer *renderer, const struct error *err, int layers,
                           int samples)
{
    struct renderer_info info;
    renderer_get_info(renderer, &info);
    if (info.is_software || !info.loop_end || samples == 1 || layers < 10000)
        fail_msg("%d layers: %s", layers, err->message);
    assert_int_equal(err->code, ERROR_OVER_BUDGET);
    assert_non_null(strstr(err->message, "loop steps, limit is"));
}

static void assert_is_product(const struct frame *frame, int n, const double *t)
{
    double expected[3] = {1, 1, 1};
    for (int i = 0; i < 3 * n; i++)
        expected[i % 3] *= t[i];
    for (int y = 0; y < SIDE_PX; y++) {
        for (int x = 0; x < SIDE_PX; x++) {
            const float *p = image_pixel_f32(&frame->outputs[VIEW_OUTPUT_COLOR], x, y);
            for (int c = 0; c < 3; c++)
                if (!(fabs((double)p[c] - expected[c]) <= 2e-7 * n * expected[c] + 2e-6))
                    fail_msg("pixel %d,%d channel %d of %d layers: %.9g, expected %.9g", x, y, c, n,
                             (double)p[c], expected[c]);
        }
    }
}

static void layers_multiply_at_any_depth(void **state)
{
    static const int counts[] = {1, 2, 7, 15, 16, 17, 33, 64, 100, 1000, 10000};
    double *t = calloc(3 * 10000, sizeof *t);
    for (size_t k = 0; k < sizeof counts / sizeof *counts; k++) {
        for (int samples = 1; samples <= 4; samples += 3) {
            int n = counts[k];
            for (int i = 0; i < 3 * n; i++)
                t[i] = 1 - (double)(n > 1000 ? i % 2 : (1 + (i * 7919) % 97) * (n > 64 ? 1 : 20)) /
                               65521.0;
            void *glb;
            size_t size;
            struct frame frame;
            struct error err = {0};
            build_stack(n, t, NULL, false, &glb, &size);
            if (try_stack(*state, glb, size, samples, &frame, &err)) {
                assert_is_product(&frame, n, t);
                assert_true(frame.report.counts.longest_pixel_list >= (uint64_t)n);
                frame_finish(&frame);
            } else {
                expect_refusal(*state, &err, n, samples);
            }
            free(glb);
        }
    }
    free(t);
}

static void storage_order_does_not_change_a_bit(void **state)
{
    enum { N = 40 };
    double t[3 * N];
    int order[N];
    for (int i = 0; i < 3 * N; i++)
        t[i] = 0.5 + 0.5 * ((i * 37) % 64) / 64.0;
    struct frame first = {0};
    for (int round = 0; round < 4; round++) {
        int step = (int[]){1, 7, 9, 11}[round]; /* coprime to N: a permutation */
        for (int i = 0; i < N; i++)
            order[i] = (i * step + round) % N;
        void *glb;
        size_t size;
        struct frame frame;
        build_stack(N, t, order, false, &glb, &size);
        render_stack(*state, glb, size, 4, &frame);
        free(glb);
        if (round == 0) {
            first = frame;
            continue;
        }
        const struct image *a = &first.outputs[VIEW_OUTPUT_COLOR],
                           *b = &frame.outputs[VIEW_OUTPUT_COLOR];
        assert_memory_equal(a->pixels, b->pixels, image_size_bytes(a));
        frame_finish(&frame);
    }
    frame_finish(&first);
}

static void blended_layers_cover(void **state)
{
    double t[3 * 5];
    for (int i = 0; i < 5; i++)
        t[3 * i] = t[3 * i + 1] = t[3 * i + 2] = 0.25 + 0.125 * i;
    void *glb;
    size_t size;
    struct frame frame;
    build_stack(5, t, NULL, true, &glb, &size);
    render_stack(*state, glb, size, 4, &frame);
    assert_is_product(&frame, 5, t);
    frame_finish(&frame);
    free(glb);
}

static void nothing_transparent_costs_no_list(void **state)
{
    void *glb;
    size_t size;
    struct frame frame;
    build_stack(0, NULL, NULL, false, &glb, &size);
    render_stack(*state, glb, size, 4, &frame);
    for (int i = 0; i < frame.report.pass_count; i++)
        assert_null(strstr(frame.report.passes[i].pass, "transparency"));
    frame_finish(&frame);
    free(glb);
}

static void read_nothing(GLuint buffer, GLintptr offset, GLsizeiptr size, void *data)
{
    (void)buffer, (void)offset, (void)size, (void)data;
}

/* As after a reset of the device: what asks for numbers gets none. */
static void what_a_lost_context_does_not_read_is_zero(void **state)
{
    const double t[3 * 3] = {0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5};
    PFNGLGETNAMEDBUFFERSUBDATAPROC read;
    void *glb;
    size_t size;
    build_stack(3, t, NULL, false, &glb, &size);
    GL_SPY_BEGIN(GetNamedBufferSubData, read, read_nothing);
    for (int samples = 1; samples <= 4; samples += 3) {
        struct frame frame;
        render_stack(*state, glb, size, samples, &frame);
        assert_int_equal(frame.report.counts.transparent_fragments, 0);
        assert_int_equal(frame.report.counts.longest_pixel_list, 0);
        frame_finish(&frame);
    }
    GL_SPY_END(GetNamedBufferSubData, read);
    free(glb);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        /* first, as sizes that a frame before has told are not read again on all devices */
        cmocka_unit_test(what_a_lost_context_does_not_read_is_zero),
        cmocka_unit_test(layers_multiply_at_any_depth),
        cmocka_unit_test(storage_order_does_not_change_a_bit),
        cmocka_unit_test(blended_layers_cover),
        cmocka_unit_test(nothing_transparent_costs_no_list),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
