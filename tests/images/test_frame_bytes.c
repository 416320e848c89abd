/* SPDX-License-Identifier: MIT */
/* What a frame says of memory is about that frame: the same on a fresh renderer and on one that has
 * served other scenes, sizes and techniques. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/image_checks.h"
#include "tests/support/techniques.h"

struct stage {
    struct renderer *renderer;
    struct rig_scene demo;
};

static void stage_begin(struct stage *stage)
{
    stage->renderer = render_rig_create();
    rig_demo_open_fine(&stage->demo, stage->renderer, "demo", 64);
}

static void stage_end(struct stage *stage)
{
    rig_scene_finish(&stage->demo, stage->renderer);
    renderer_destroy(stage->renderer);
}

static struct view view_of(enum shadow_technique shadows, int side)
{
    return (struct view){.width_px = side,
                         .height_px = side,
                         .quality = {.shadows = shadows, .shadow_resolution = 2 * side}};
}

static struct frame_report report_of(struct stage *stage, const struct view *view)
{
    struct frame frame;
    shoot(stage->renderer, &stage->demo, view, &frame);
    struct frame_report report = frame.report;
    frame_finish(&frame);
    return report;
}

static void expect_same(const struct frame_report *fresh, const struct frame_report *used)
{
    assert_int_equal(fresh->byte_count, used->byte_count);
    for (int i = 0; i < fresh->byte_count; i++) {
        const char *name = fresh->bytes[i].structure;
        if (report_bytes_of(used, name) != fresh->bytes[i].bytes)
            fail_msg("%s: %llu bytes on a fresh renderer, %llu on a used one", name,
                     (unsigned long long)fresh->bytes[i].bytes,
                     (unsigned long long)report_bytes_of(used, name));
    }
}

static void a_setting_has_the_same_bytes_whatever_was_before(void **state)
{
    enum shadow_technique techniques[SHADOWS_COUNT];
    int count = (int)raster_techniques(0, techniques);
    struct frame_report first[SHADOWS_COUNT]; /* one renderer at a time: each has a GL context */
    struct stage stage;
    (void)state;
    for (int i = 0; i < count; i++) {
        struct view view = view_of(techniques[i], 32);
        stage_begin(&stage);
        first[i] = report_of(&stage, &view);
        assert_true(first[i].resident_bytes >= report_bytes_of(&first[i], ""));
        struct frame_report kept = report_of(&stage, &view); /* its structures stand */
        expect_same(&first[i], &kept);
        stage_end(&stage);
    }
    stage_begin(&stage);
    for (int i = count - 1; i >= 0; i--) {
        struct view view = view_of(techniques[i], 64);
        bool may_be_linked = shadow_technique_can(techniques[i], SHADOW_CAN_LINKED_LISTS);
        view.quality.light_lists =
            may_be_linked && i % 2 ? VIEW_LIGHT_LISTS_LINKED : VIEW_LIGHT_LISTS_CLUSTERED;
        report_of(&stage, &view);
    }
    for (int i = 0; i < count; i++) {
        struct view view = view_of(techniques[i], 32);
        struct frame_report later = report_of(&stage, &view);
        expect_same(&first[i], &later);
        assert_true(later.resident_bytes > first[i].resident_bytes);
    }
    stage_end(&stage);
}

static void every_structure_is_counted_once(void **state)
{
    (void)state;
    struct stage stage;
    stage_begin(&stage);
    struct view view = view_of(SHADOWS_MAP, 32);
    struct frame_report map = report_of(&stage, &view);
    struct plan plan;
    struct error err = {0};
    assert_true(renderer_explain(stage.renderer, stage.demo.key, &view, &plan, &err));
    assert_int_equal(report_bytes_of(&map, "shadow"), plan.shadow_texels * 4);
    view.quality.shadows = SHADOWS_NONE;
    struct frame_report none = report_of(&stage, &view);
    assert_int_equal(report_bytes_of(&none, "shadow"), 0);
    assert_int_equal(none.counts.shadowed_lights, 0);
    view.quality.shadows = SHADOWS_RAYTRACED;
    struct frame_report traced = report_of(&stage, &view);
    assert_int_equal(traced.byte_count, 1);
    assert_string_equal(traced.bytes[0].structure, "raytrace");
    assert_int_equal(traced.counts.shadowed_lights, map.counts.shadowed_lights);
    assert_true(traced.counts.shadowed_lights > 0);
    stage_end(&stage);
}

static void a_scene_that_goes_takes_its_memory_along(void **state)
{
    (void)state;
    struct stage stage;
    struct renderer_info before, during, after;
    stage_begin(&stage);
    struct view view = view_of(SHADOWS_NONE, 32);
    report_of(&stage, &view);
    renderer_get_info(stage.renderer, &before);
    view.quality.shadows = SHADOWS_DEEP_LINKED;
    view.quality.shadow_resolution = 128;
    report_of(&stage, &view);
    view.quality.shadows = SHADOWS_DEEP;
    struct frame_report deep = report_of(&stage, &view);
    renderer_get_info(stage.renderer, &during);
    assert_true(during.used_bytes > before.used_bytes + report_bytes_of(&deep, "shadow"));
    rig_scene_finish(&stage.demo, stage.renderer);
    renderer_get_info(stage.renderer, &after);
    assert_true(after.used_bytes < before.used_bytes);
    rig_demo_open_fine(&stage.demo, stage.renderer, "demo", 64);
    struct frame_report again = report_of(&stage, &view);
    expect_same(&deep, &again);
    stage_end(&stage);
}

/* Lists of 12 lights, each with room for four elements a texel to begin with, one after the other.
 */
static void linked_lists_hold_little_more_than_they_need(void **state)
{
    (void)state;
    struct stage stage;
    struct renderer_info before, after;
    stage_begin(&stage);
    struct view view = view_of(SHADOWS_NONE, 32);
    report_of(&stage, &view);
    renderer_get_info(stage.renderer, &before);
    view.quality.shadows = SHADOWS_DEEP_LINKED;
    view.quality.shadow_resolution = 512;
    struct frame_report linked = report_of(&stage, &view);
    renderer_get_info(stage.renderer, &after);
    assert_int_equal(linked.counts.light_batches, 1);
    uint64_t held = after.used_bytes - before.used_bytes;
    uint64_t needed = report_bytes_of(&linked, "shadow");
    print_message("%llu of %llu bytes needed\n", (unsigned long long)needed,
                  (unsigned long long)held);
    assert_true(held < 2 * needed + (128u << 20));
    stage_end(&stage);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_setting_has_the_same_bytes_whatever_was_before),
        cmocka_unit_test(every_structure_is_counted_once),
        cmocka_unit_test(a_scene_that_goes_takes_its_memory_along),
        cmocka_unit_test(linked_lists_hold_little_more_than_they_need),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
