/* SPDX-License-Identifier: MIT */
/* Picking by rays agrees with the pictures: node, material, depth, layers and rectangles. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/image_checks.h"

enum { WIDTH = 96, HEIGHT = 54 };

struct demo {
    struct renderer *renderer;
    struct rig_scene rig;
};

static struct view nave_view(void)
{
    return (struct view){.width_px = WIDTH, .height_px = HEIGHT, .quality.samples = 1};
}

static struct pick_result pick(const struct demo *demo, const struct view *view,
                               const struct pick_desc *desc)
{
    struct error problem = {0};
    struct pick_result result;
    bool is_good = renderer_pick(demo->renderer, demo->rig.key, view, desc, &result, &problem);
    if (!is_good)
        fail_msg("%s", problem.message);
    return result;
}

/* At edges the f32 of the rasteriser and the f64 of the rays may choose different neighbours. */
static void every_pixel_picks_what_the_picture_shows(void **state)
{
    const struct demo *demo = *state;
    struct view view = nave_view();
    struct frame frame;
    view.outputs = 1u << VIEW_OUTPUT_NODE | 1u << VIEW_OUTPUT_MATERIAL | 1u << VIEW_OUTPUT_DEPTH;
    assert_true(renderer_render(demo->renderer, demo->rig.key, &view, &frame, NULL));
    const uint32_t *nodes = frame.outputs[VIEW_OUTPUT_NODE].pixels;
    const uint32_t *materials = frame.outputs[VIEW_OUTPUT_MATERIAL].pixels;
    const float *depths = frame.outputs[VIEW_OUTPUT_DEPTH].pixels;
    int differing = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        struct pick_result result =
            pick(demo, &view, &(struct pick_desc){.x = i % WIDTH + 0.5, .y = i / WIDTH + 0.5});
        uint32_t node = result.layer_count ? result.layers[0].node + 1 : 0;
        uint32_t material = result.layer_count ? result.layers[0].material + 1 : 0;
        if (node != nodes[i] || material != materials[i])
            differing++;
        else if (node)
            differing += fabs(result.layers[0].depth / (double)depths[i] - 1) > 1e-3;
        pick_result_finish(&result);
    }
    print_message("%d of %d pixels differ\n", differing, WIDTH * HEIGHT);
    assert_true(differing < WIDTH * HEIGHT / 200);
    frame_finish(&frame);
}

static void layers_come_nearest_first_and_end_at_the_first_opaque_one(void **state)
{
    const struct demo *demo = *state;
    struct view view = nave_view();
    size_t deepest = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i += 7) {
        struct pick_desc desc = {.x = i % WIDTH + 0.5, .y = i / WIDTH + 0.5, .is_through = true};
        struct pick_result all = pick(demo, &view, &desc);
        desc.is_through = false;
        struct pick_result one = pick(demo, &view, &desc);
        assert_int_equal(one.layer_count, all.layer_count > 0);
        if (all.layer_count)
            assert_memory_equal(one.layers, all.layers, sizeof *one.layers);
        for (size_t k = 0; k + 1 < all.layer_count; k++) {
            assert_true(all.layers[k].is_transparent);
            assert_true(all.layers[k].depth <= all.layers[k + 1].depth);
        }
        deepest = all.layer_count > deepest ? all.layer_count : deepest;
        pick_result_finish(&all);
        pick_result_finish(&one);
    }
    assert_true(deepest > 2);
}

static void a_rectangle_counts_the_pixels_of_each_node_once(void **state)
{
    const struct demo *demo = *state;
    struct view view = nave_view();
    uint64_t counted[4096] = {0};
    struct pick_result all =
        pick(demo, &view, &(struct pick_desc){.x = 10, .y = 5, .width = 40, .height = 30});
    for (int i = 0; i < 40 * 30; i++) {
        struct pick_result one =
            pick(demo, &view, &(struct pick_desc){.x = 10.5 + i % 40, .y = 5.5 + i / 40});
        if (one.layer_count)
            counted[one.layers[0].node]++;
        pick_result_finish(&one);
    }
    assert_true(all.node_count > 3);
    for (size_t i = 0; i < all.node_count; i++) {
        assert_int_equal(counted[all.nodes[i].node], all.nodes[i].pixels);
        counted[all.nodes[i].node] = 0;
    }
    for (size_t i = 0; i < 4096; i++)
        assert_int_equal(counted[i], 0);
    pick_result_finish(&all);
}

static void a_hidden_node_is_not_picked(void **state)
{
    const struct demo *demo = *state;
    struct view view = nave_view();
    const struct pick_desc centre = {.x = WIDTH / 2., .y = HEIGHT / 2.};
    struct pick_result before = pick(demo, &view, &centre);
    assert_int_equal(before.layer_count, 1);
    char name[16];
    snprintf(name, sizeof name, "#%u", before.layers[0].node);
    const struct view_node_override hide = {.node = name, .has_visible = true};
    view.nodes = &hide;
    view.node_override_count = 1;
    struct pick_result after = pick(demo, &view, &centre);
    assert_true(after.layer_count == 0 || after.layers[0].node != before.layers[0].node);
    pick_result_finish(&before);
    pick_result_finish(&after);
}

static void the_picked_point_projects_back_to_its_pixel(void **state)
{
    const struct demo *demo = *state;
    struct view view = nave_view();
    view.camera =
        (struct view_camera){.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 2, 4}, .target = {0, 2.5, -2}};
    for (int i = 0; i < 40; i++) {
        double x = 2.25 + i * 2.3, y = 1.75 + i * 1.3, pixel[2];
        struct pick_result result = pick(demo, &view, &(struct pick_desc){.x = x, .y = y});
        if (result.layer_count) {
            assert_true(view_project(&view, result.layers[0].position, pixel));
            assert_true(fabs(pixel[0] - x) < 1e-6 && fabs(pixel[1] - y) < 1e-6);
        }
        pick_result_finish(&result);
    }
}

static int setup(void **state)
{
    struct demo *demo = calloc(1, sizeof *demo);
    assert_non_null(demo);
    demo->renderer = render_rig_create();
    rig_demo_open_fine(&demo->rig, demo->renderer, "pick", 64);
    *state = demo;
    return 0;
}

static int teardown(void **state)
{
    struct demo *demo = *state;
    rig_scene_finish(&demo->rig, demo->renderer);
    renderer_destroy(demo->renderer);
    free(demo);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_pixel_picks_what_the_picture_shows),
        cmocka_unit_test(layers_come_nearest_first_and_end_at_the_first_opaque_one),
        cmocka_unit_test(a_rectangle_counts_the_pixels_of_each_node_once),
        cmocka_unit_test(a_hidden_node_is_not_picked),
        cmocka_unit_test(the_picked_point_projects_back_to_its_pixel),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
