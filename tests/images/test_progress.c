/* SPDX-License-Identifier: MIT */
/* Frames tell how far they are, by what is finished of them, and keep their bits. */
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/support/image_checks.h"

/* What was told of each stage. Rays are told of by several threads, which overtake each other. */
struct told {
    pthread_mutex_t mutex;
    struct {
        int count, falls; /* falls: less than before */
        double first, last, most;
    } stages[FRAME_STAGE_COUNT];
};

static void listen(void *context, enum frame_stage stage, double share)
{
    struct told *told = context;
    pthread_mutex_lock(&told->mutex);
    assert_true(share >= 0 && share <= 1 + 1e-9);
    if (!told->stages[stage].count++)
        told->stages[stage].first = share;
    told->stages[stage].falls += share < told->stages[stage].last - 1e-9;
    told->stages[stage].last = share;
    if (share > told->stages[stage].most)
        told->stages[stage].most = share;
    pthread_mutex_unlock(&told->mutex);
}

struct fixture {
    struct renderer *renderer;
    struct rig_scene demo;
    bool is_software;
};

static void fixture_init(struct fixture *fixture, const struct renderer_desc *desc)
{
    struct renderer_info info;
    *fixture = (struct fixture){.renderer = render_rig_create_as(desc)};
    renderer_get_info(fixture->renderer, &info);
    fixture->is_software = info.is_software;
    rig_demo_open(&fixture->demo, fixture->renderer, "demo", 64);
}

static void fixture_finish(struct fixture *fixture)
{
    rig_scene_finish(&fixture->demo, fixture->renderer);
    renderer_destroy(fixture->renderer);
}

static struct view demo_view(enum shadow_technique shadows)
{
    return (struct view){.width_px = 160,
                         .height_px = 96,
                         .quality = {.shadows = shadows, .shadow_resolution = 128}};
}

/* The picture's hash. */
static uint64_t render_and_listen(const struct fixture *fixture, const struct view *view,
                                  struct told *told, struct frame_report *report)
{
    struct frame frame;
    const struct frame_progress progress = {.context = told, .tell = listen};
    *told = (struct told){.mutex = PTHREAD_MUTEX_INITIALIZER};
    renderer_set_progress(fixture->renderer, &progress);
    shoot(fixture->renderer, &fixture->demo, view, &frame);
    renderer_set_progress(fixture->renderer, NULL);
    uint64_t hash = image_hash(&frame.outputs[VIEW_OUTPUT_COLOR]);
    if (report)
        *report = frame.report;
    frame_finish(&frame);
    return hash;
}

static void rays_tell_the_tiles_that_are_traced(void **state)
{
    (void)state;
    struct fixture fixture;
    struct told told;
    fixture_init(&fixture, &(struct renderer_desc){.is_strict = true});
    for (int is_reference = 0; is_reference < 2; is_reference++) {
        struct view view = demo_view(SHADOWS_RAYTRACED);
        view.quality.samples = is_reference ? 1 : 4;
        view.quality.reference = is_reference;
        struct image plain = shoot_color(fixture.renderer, &fixture.demo, &view);
        assert_true(image_hash(&plain) == render_and_listen(&fixture, &view, &told, NULL));
        image_finish(&plain);
        assert_in_range(told.stages[FRAME_STAGE_RAYS].count, 4, INT32_MAX);
        assert_float_equal(0, told.stages[FRAME_STAGE_RAYS].first, 1e-9);
        assert_float_equal(1, told.stages[FRAME_STAGE_RAYS].most, 1e-9);
        assert_int_equal(0, told.stages[FRAME_STAGE_SHADOWS].count);
        assert_int_equal(0, told.stages[FRAME_STAGE_SHADING].count);
    }
    fixture_finish(&fixture);
}

static void shadows_tell_the_structures_that_stand(void **state)
{
    (void)state;
    struct fixture fixture;
    struct told told;
    struct frame_report report;
    fixture_init(&fixture, &(struct renderer_desc){.is_strict = true});
    struct view view = demo_view(SHADOWS_DEEP);
    uint64_t cold = render_and_listen(&fixture, &view, &told, &report);
    assert_in_range(report.counts.shadow_maps_built, 2, 100);
    assert_in_range(told.stages[FRAME_STAGE_SHADOWS].count, 1, report.counts.shadow_maps_built);
    assert_int_equal(0, told.stages[FRAME_STAGE_SHADOWS].falls);
    assert_true(told.stages[FRAME_STAGE_SHADOWS].first > 0);
    assert_float_equal(1, told.stages[FRAME_STAGE_SHADOWS].last, 1e-9);
    assert_true(cold == render_and_listen(&fixture, &view, &told, NULL)); /* all stand */
    assert_int_equal(0, told.stages[FRAME_STAGE_SHADOWS].count);
    fixture_finish(&fixture);
}

static bool is_never_due(void *context)
{
    (void)context;
    return false;
}

static void shading_tells_its_slices_and_never_falls(void **state)
{
    static const enum shadow_technique techniques[] = {SHADOWS_DEEP, SHADOWS_RAYTRACED_SHADOWS};
    (void)state;
    struct fixture fixture;
    struct told told;
    const struct yield_point yield = {.should_yield = is_never_due};
    fixture_init(&fixture, &(struct renderer_desc){.is_strict = true, .hooks.first_slice = 512});
    for (size_t i = 0; i < sizeof techniques / sizeof *techniques; i++) {
        struct view view = demo_view(techniques[i]);
        struct image plain = shoot_color(fixture.renderer, &fixture.demo, &view);
        renderer_set_yield_point(fixture.renderer, &yield);
        assert_true(image_hash(&plain) == render_and_listen(&fixture, &view, &told, NULL));
        renderer_set_yield_point(fixture.renderer, NULL);
        image_finish(&plain);
        assert_in_range(told.stages[FRAME_STAGE_SHADING].count, fixture.is_software ? 6 : 2,
                        INT32_MAX);
        if (techniques[i] == SHADOWS_DEEP) /* told by one thread */
            assert_int_equal(0, told.stages[FRAME_STAGE_SHADING].falls);
        assert_float_equal(0, told.stages[FRAME_STAGE_SHADING].first, 1e-9);
        assert_true(told.stages[FRAME_STAGE_SHADING].most >= 0.5);
    }
    fixture_finish(&fixture);
}

static void batches_of_lights_tell_the_lights_that_are_done(void **state)
{
    (void)state;
    struct fixture fixture;
    struct told told;
    struct frame_report report;
    fixture_init(&fixture,
                 &(struct renderer_desc){.is_strict = true, .gpu_budget_bytes = 36 << 20});
    struct view view = demo_view(SHADOWS_DEEP);
    view.quality.shadow_resolution = 256;
    uint64_t cold = render_and_listen(&fixture, &view, &told, NULL);
    assert_true(cold == render_and_listen(&fixture, &view, &told, &report));
    assert_in_range(report.counts.light_batches, 2, 100);
    assert_int_equal(0, told.stages[FRAME_STAGE_SHADOWS].count);
    assert_in_range(told.stages[FRAME_STAGE_SHADING].count, 2 * report.counts.light_batches,
                    INT32_MAX);
    assert_int_equal(0, told.stages[FRAME_STAGE_SHADING].falls);
    assert_true(told.stages[FRAME_STAGE_SHADING].last > 0.5);
    fixture_finish(&fixture);
}

static void windows_tell_their_share_of_the_picture(void **state)
{
    (void)state;
    struct fixture fixture;
    struct told told;
    fixture_init(&fixture, &(struct renderer_desc){.is_strict = true});
    struct view view = demo_view(SHADOWS_NONE);
    view.width_px = 8200; /* more than a window's side, twice */
    view.height_px = 16;
    view.quality.samples = 1;
    render_and_listen(&fixture, &view, &told, NULL);
    assert_in_range(told.stages[FRAME_STAGE_SHADING].count, 4, INT32_MAX);
    assert_int_equal(0, told.stages[FRAME_STAGE_SHADING].falls);
    assert_true(told.stages[FRAME_STAGE_SHADING].last >= 0.75);
    fixture_finish(&fixture);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rays_tell_the_tiles_that_are_traced),
        cmocka_unit_test(shadows_tell_the_structures_that_stand),
        cmocka_unit_test(shading_tells_its_slices_and_never_falls),
        cmocka_unit_test(batches_of_lights_tell_the_lights_that_are_done),
        cmocka_unit_test(windows_tell_their_share_of_the_picture),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
