/* SPDX-License-Identifier: MIT */
/* The demo scene: its windows colour its floor. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/image_checks.h"

struct demo {
    struct renderer *renderer;
    struct rig_scene rig;
    struct frame frame; /* the default view, with the node output */
};

static struct view nave_view(void)
{
    return (struct view){.width_px = 480, .height_px = 270};
}

static struct image nave_without_shadows(const struct demo *demo)
{
    struct view view = nave_view();
    view.quality.shadows = SHADOWS_NONE;
    return shoot_color(demo->renderer, &demo->rig, &view);
}

static void image_is_sound_and_well_exposed(void **state)
{
    const struct demo *demo = *state;
    const struct image *color = &demo->frame.outputs[VIEW_OUTPUT_COLOR];
    double mean[3];
    assert_image_is_sound(color, 1e4);
    image_mean(color, (double[]){0, 0, 1, 1}, mean);
    for (int c = 0; c < 3; c++)
        assert_true(mean[c] > 0.02 && mean[c] < 1);
    for (int i = 0; i < 480 * 270; i++) /* inside: no way out of the chapel */
        assert_true(((const float *)color->pixels)[4 * i + 3] == 1);
}

static void twelve_lights_shine_through_deep_maps(void **state)
{
    const struct frame_report *report = &((struct demo *)*state)->frame.report;
    assert_int_equal(report->counts.lights, 12);
    assert_true(report->counts.shadowed_lights > 0);
    assert_true(report->counts.events > 100000);
    assert_true(report->counts.transparent_fragments > 1000);
    assert_true(report_has_pass(report, "shadow.", "deep"));
    assert_true(report_has_pass(report, "light_list", NULL));
    assert_int_equal(report->warning_count, 0);
}

static double chroma(const double color[3])
{
    double high = fmax(color[0], fmax(color[1], color[2]));
    double low = fmin(color[0], fmin(color[1], color[2]));
    return high > 0 ? (high - low) / high : 0;
}

/* Shares of pixels in the rectangle whose chroma is above 0.5. */
static double vivid_share(const struct image *color, const double r[4])
{
    int vivid = 0, count = 0;
    for (int y = (int)(r[1] * color->height_px); y < (int)(r[3] * color->height_px); y++) {
        for (int x = (int)(r[0] * color->width_px); x < (int)(r[2] * color->width_px); x++) {
            const float *p = image_pixel_f32(color, x, y);
            vivid += chroma((double[]){p[0], p[1], p[2]}) > 0.5;
            count++;
        }
    }
    return (double)vivid / count;
}

static const double pool[4] = {0.35, 0.62, 0.65, 0.95}; /* the floor between the benches */
static const double rose[4] = {0.42, 0.18, 0.58, 0.42}; /* of the far wall */

static void floor_is_coloured_by_the_windows(void **state)
{
    const struct demo *demo = *state;
    const struct image *lit = &demo->frame.outputs[VIEW_OUTPUT_COLOR];
    struct image open = nave_without_shadows(demo);
    double with[3], without[3], vivid_without = vivid_share(&open, pool);
    image_mean(lit, pool, with);
    image_mean(&open, pool, without);
    image_finish(&open);
    assert_true(vivid_share(lit, pool) > 0.5);
    assert_true(vivid_share(lit, pool) > 2 * vivid_without); /* its own colours are pale */
    for (int c = 0; c < 3; c++)
        assert_true(with[c] < without[c]);
}

static void rose_window_is_seen_in_many_colours(void **state)
{
    const struct image *lit = &((struct demo *)*state)->frame.outputs[VIEW_OUTPUT_COLOR];
    int by_hue[3] = {0};
    for (int y = (int)(rose[1] * 270); y < (int)(rose[3] * 270); y++)
        for (int x = (int)(rose[0] * 480); x < (int)(rose[2] * 480); x++) {
            const float *p = image_pixel_f32(lit, x, y);
            int c = p[0] > p[1] ? (p[0] > p[2] ? 0 : 2) : (p[1] > p[2] ? 1 : 2);
            by_hue[c] += chroma((double[]){p[0], p[1], p[2]}) > 0.4;
        }
    assert_true(vivid_share(lit, rose) > 0.3);
    assert_true(by_hue[0] > 50 && by_hue[2] > 50);
}

static int setup(void **state)
{
    struct demo *demo = calloc(1, sizeof *demo);
    assert_non_null(demo);
    demo->renderer = render_rig_create();
    struct view view = nave_view();
    view.outputs = 1u << VIEW_OUTPUT_COLOR | 1u << VIEW_OUTPUT_NODE;
    rig_demo_open(&demo->rig, demo->renderer, "demo", 512);
    shoot(demo->renderer, &demo->rig, &view, &demo->frame);
    save_picture(&demo->frame.outputs[VIEW_OUTPUT_COLOR], "demo");
    *state = demo;
    return 0;
}

static int teardown(void **state)
{
    struct demo *demo = *state;
    frame_finish(&demo->frame);
    rig_scene_finish(&demo->rig, demo->renderer);
    renderer_destroy(demo->renderer);
    free(demo);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(image_is_sound_and_well_exposed),
        cmocka_unit_test(twelve_lights_shine_through_deep_maps),
        cmocka_unit_test(floor_is_coloured_by_the_windows),
        cmocka_unit_test(rose_window_is_seen_in_many_colours),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
