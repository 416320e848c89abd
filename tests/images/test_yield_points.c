/* SPDX-License-Identifier: MIT */
/* Frames that stop for others have the bits of frames that do not, whatever the others are; and the
 * others have theirs. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/closed_form_scenes.h"
#include "tests/support/image_checks.h"
#include "tests/support/techniques.h"

enum { OTHERS = 4, PAUSES = 6, PAUSES_MAX = 16 };

/* What is rendered at a yield point, and what it looks like without one. */
struct other {
    const struct rig_scene *scene;
    struct view view;
    uint64_t hash;
};

struct interruption {
    struct renderer *renderer;
    struct other others[OTHERS];
    int pauses, pauses_left, served; /* pauses: at most in a frame; 0: PAUSES */
    int wanted;                      /* after so many pauses the frame is unwanted; 0: never */
};

static bool is_due(void *context)
{
    const struct interruption *interruption = context;
    return interruption->pauses_left > 0;
}

static bool serve(void *context, struct error *err)
{
    (void)err;
    struct interruption *in = context;
    const struct other *other = &in->others[in->served % OTHERS];
    struct image color = shoot_color(in->renderer, other->scene, &other->view);
    assert_int_equal(other->hash, image_hash(&color));
    image_finish(&color);
    in->served++;
    in->pauses_left--;
    return !in->wanted || in->served < in->wanted;
}

struct fixture {
    struct renderer *renderer;
    struct rig_scene demo, panes;
    struct interruption interruption;
};

static struct view demo_view(enum shadow_technique shadows)
{
    return (struct view){
        .width_px = 80, .height_px = 48, .quality = {.shadows = shadows, .shadow_resolution = 128}};
}

static void open_panes(struct rig_scene *rig, struct renderer *renderer)
{
    struct closed_form_scene scene;
    random_panes_scene_build(&(struct random_panes_scene_desc){.pane_count = 9, .seed = 5}, &scene);
    rig_scene_open(rig, renderer, "panes", scene.glb, scene.size_bytes);
    closed_form_scene_finish(&scene);
}

/* The same scene rasterised with other lights; traced from elsewhere, cut and with a node away;
 * another scene rasterised, and traced. */
static void choose_others(struct fixture *fixture)
{
    static const double plane[1][4] = {{0, -1, 0, 2}};
    static const struct view_light light = {.type = SCENE_LIGHT_DIRECTIONAL,
                                            .direction = {0.3, -1, 0.2},
                                            .color = {1, 0.5, 0.2},
                                            .intensity = 4};
    const struct view_camera camera = {
        .kind = VIEW_CAMERA_LOOK_AT, .eye = {3, 4.5, 3}, .target = {0, 1.5, 0}};
    struct other *others = fixture->interruption.others;
    others[0] = (struct other){&fixture->demo, demo_view(SHADOWS_DEEP), 0};
    others[0].view.width_px = 50;
    others[0].view.lights = &light;
    others[0].view.light_count = 1;
    others[0].view.quality.samples = 1;
    others[1] = (struct other){&fixture->demo, demo_view(SHADOWS_RAYTRACED), 0};
    others[1].view.camera = camera;
    others[1].view.clip_planes = plane;
    others[1].view.clip_plane_count = 1;
    others[2] = (struct other){&fixture->panes, demo_view(SHADOWS_RAYTRACED), 0};
    others[2].view.camera = camera;
    others[3] = (struct other){&fixture->panes, demo_view(SHADOWS_MAP), 0};
    others[3].view.camera = camera;
    for (int i = 0; i < OTHERS; i++) {
        struct image color = shoot_color(fixture->renderer, others[i].scene, &others[i].view);
        others[i].hash = image_hash(&color);
        image_finish(&color);
    }
}

static void fixture_init(struct fixture *fixture, struct renderer *renderer)
{
    *fixture = (struct fixture){.renderer = renderer, .interruption.renderer = renderer};
    rig_demo_open(&fixture->demo, renderer, "demo", 64);
    open_panes(&fixture->panes, renderer);
    choose_others(fixture);
}

static void fixture_finish(struct fixture *fixture)
{
    rig_scene_finish(&fixture->panes, fixture->renderer);
    rig_scene_finish(&fixture->demo, fixture->renderer);
    renderer_destroy(fixture->renderer);
}

/* Renders the view with pauses; the frame is empty and err set when it is not wanted. */
static bool render_with_pauses(struct fixture *fixture, const struct view *view,
                               struct frame *frame, struct error *err)
{
    const struct yield_point yield = {
        .context = &fixture->interruption, .should_yield = is_due, .run_urgent = serve};
    fixture->interruption.served = 0;
    fixture->interruption.pauses_left =
        fixture->interruption.pauses ? fixture->interruption.pauses : PAUSES;
    renderer_set_yield_point(fixture->renderer, &yield);
    bool ok = renderer_render(fixture->renderer, "demo", view, frame, err);
    renderer_set_yield_point(fixture->renderer, NULL);
    return ok;
}

static void assert_pauses_change_nothing(struct fixture *fixture, const struct view *view,
                                         int least_pauses)
{
    struct frame plain, paused;
    struct error err = {0};
    shoot(fixture->renderer, &fixture->demo, view, &plain);
    if (!render_with_pauses(fixture, view, &paused, &err))
        fail_msg("%s", err.message);
    assert_int_in_range(fixture->interruption.served, least_pauses,
                        fixture->interruption.pauses ? fixture->interruption.pauses : PAUSES);
    for (int i = 0; i < VIEW_OUTPUT_COUNT; i++)
        if (plain.outputs[i].pixels)
            assert_same_bits(&plain.outputs[i], &paused.outputs[i]);
    assert_int_equal(plain.report.counts.lookups, paused.report.counts.lookups);
    assert_int_equal(plain.report.counts.shadow_rays, paused.report.counts.shadow_rays);
    assert_int_equal(0, paused.report.counts.programs_built);
    assert_true(plain.report.paused_ms == 0);
    assert_true(paused.report.paused_ms > 0);
    frame_finish(&plain);
    frame_finish(&paused);
}

static void ray_traced_frames_keep_their_bits(void **state)
{
    struct fixture fixture;
    (void)state;
    fixture_init(&fixture, render_rig_create());
    struct view view = demo_view(SHADOWS_RAYTRACED);
    assert_pauses_change_nothing(&fixture, &view, PAUSES);
    view.quality.reference = true;
    view.quality.samples = 1;
    assert_pauses_change_nothing(&fixture, &view, PAUSES);
    fixture_finish(&fixture);
}

/* Five steps of a window at least: surfaces, layers, light lists, shading, reading. */
static void rasterised_frames_keep_their_bits(void **state)
{
    enum shadow_technique techniques[SHADOWS_COUNT];
    size_t count = raster_techniques(0, techniques);
    struct fixture fixture;
    (void)state;
    fixture_init(&fixture, render_rig_create());
    for (size_t i = 0; i < count; i++) {
        struct view view = demo_view(techniques[i]);
        view.outputs = 1u << VIEW_OUTPUT_COLOR | 1u << VIEW_OUTPUT_LAYERS;
        assert_pauses_change_nothing(&fixture, &view, 5);
    }
    fixture_finish(&fixture);
}

static struct renderer *create_renderer(const struct renderer_desc *desc)
{
    struct error err = {0};
    struct renderer *renderer = renderer_create(desc, &err);
    if (!renderer)
        fail_msg("%s", err.message);
    return renderer;
}

static void batches_of_lights_keep_their_bits(void **state)
{
    (void)state;
    struct fixture fixture;
    struct renderer *renderer =
        create_renderer(&(struct renderer_desc){.is_strict = true, .gpu_budget_bytes = 36 << 20});
    fixture_init(&fixture, renderer);
    struct view view = demo_view(SHADOWS_DEEP);
    view.quality.shadow_resolution = 256;
    struct frame frame;
    shoot(renderer, &fixture.demo, &view, &frame);
    assert_int_in_range(frame.report.counts.light_batches, 2, 100);
    frame_finish(&frame);
    assert_pauses_change_nothing(&fixture, &view, 4);
    fixture_finish(&fixture);
}

/* A picture of 3,840 pixels in pieces that begin with 128: five steps, and three pieces at least
 * of the pixels and of the entries; in batches of lights, too. Devices that are not our own
 * processors have learned from the frame before that this is soon done. */
static void shading_stops_between_time_slices(void **state)
{
    static const enum shadow_technique techniques[] = {SHADOWS_DEEP, SHADOWS_RAYTRACED_SHADOWS};
    struct fixture fixture;
    (void)state;
    for (int budget_mib = 0; budget_mib <= 36; budget_mib += 36) {
        fixture_init(&fixture, create_renderer(&(struct renderer_desc){
                                   .is_strict = true,
                                   .hooks.first_slice = 128,
                                   .gpu_budget_bytes = (uint64_t)budget_mib << 20}));
        fixture.interruption.pauses = PAUSES_MAX;
        struct renderer_info info;
        renderer_get_info(fixture.renderer, &info);
        for (int i = 0; i < (budget_mib ? 1 : 2); i++) {
            struct view view = demo_view(techniques[i]);
            view.quality.shadow_resolution = 256;
            struct image warm = shoot_color(fixture.renderer, &fixture.demo, &view);
            image_finish(&warm);
            assert_pauses_change_nothing(&fixture, &view, info.is_software ? 5 + 2 + 2 : 5);
        }
        fixture_finish(&fixture);
    }
}

/* How often a pass has a line in the report: once for each reason. */
static int count_lines(const struct frame_report *report, const char *pass)
{
    int count = 0;
    for (int i = 0; i < report->pass_count; i++)
        count += strcmp(report->passes[i].pass, pass) == 0;
    return count;
}

/* Shadow structures that nobody has built yet: others go first between them, and the report is that
 * of a frame that built them at once. */
static void building_stops_between_lights(void **state)
{
    static const enum shadow_technique techniques[] = {SHADOWS_MAP, SHADOWS_DEEP,
                                                       SHADOWS_DEEP_LINKED};
    struct fixture fixture;
    (void)state;
    fixture_init(&fixture, render_rig_create());
    fixture.interruption.pauses = 4;
    for (size_t i = 0; i < sizeof techniques / sizeof *techniques; i++) {
        struct view view = demo_view(techniques[i]);
        view.quality.shadow_resolution = 256;
        struct frame plain, paused;
        struct error err = {0};
        shoot(fixture.renderer, &fixture.demo, &view, &plain);
        uint64_t built = plain.report.counts.shadow_maps_built;
        assert_true(built > 4);
        renderer_drop_structures(fixture.renderer, fixture.demo.key);
        if (!render_with_pauses(&fixture, &view, &paused, &err))
            fail_msg("%s", err.message);
        assert_int_equal(fixture.interruption.served, 4);
        assert_same_bits(&plain.outputs[VIEW_OUTPUT_COLOR], &paused.outputs[VIEW_OUTPUT_COLOR]);
        assert_int_equal(paused.report.counts.shadow_maps_built, built);
        assert_int_equal(paused.report.counts.shadow_maps_reused, 0);
        assert_int_equal(paused.report.counts.shadow_draws, plain.report.counts.shadow_draws);
        assert_int_equal(paused.report.counts.events, plain.report.counts.events);
        assert_int_equal(count_lines(&paused.report, "shadow.depth"), 1);
        frame_finish(&plain);
        frame_finish(&paused);
    }
    fixture_finish(&fixture);
}

static void an_unwanted_frame_ends_and_the_next_is_whole(void **state)
{
    static const enum shadow_technique techniques[] = {SHADOWS_RAYTRACED, SHADOWS_DEEP};
    struct fixture fixture;
    (void)state;
    fixture_init(&fixture, render_rig_create());
    for (int i = 0; i < 2; i++) {
        struct view view = demo_view(techniques[i]);
        struct frame frame;
        struct error err = {0};
        fixture.interruption.wanted = 2;
        assert_false(render_with_pauses(&fixture, &view, &frame, &err));
        assert_int_equal(ERROR_OVERLOADED, err.code);
        assert_null(frame.outputs[VIEW_OUTPUT_COLOR].pixels);
        assert_int_equal(2, fixture.interruption.served);
        fixture.interruption.wanted = 0;
        assert_pauses_change_nothing(&fixture, &view, 4);
    }
    fixture_finish(&fixture);
}

/* -- rays that nobody waits for -- */

static bool is_never_due(void *context)
{
    (void)context;
    return false;
}

static bool is_unwanted_from_the_third_question_on(void *context)
{
    return atomic_fetch_add((atomic_int *)context, 1) >= 2;
}

/* One tile, or row, of many rays: it does not have to be done. */
static void rays_of_an_unwanted_frame_end_within_a_tile(void **state)
{
    static const struct view_quality qualities[] = {
        {.reference = true, .samples = 256, .area_samples = 4096},
        {.shadows = SHADOWS_RAYTRACED, .area_samples = 4096},
        {.shadows = SHADOWS_RAYTRACED_SHADOWS, .area_samples = 128}};
    static const struct view_light area = {.type = SCENE_LIGHT_DISK,
                                           .position = {0, 6, 0},
                                           .direction = {0, -1, 0},
                                           .color = {1, 1, 1},
                                           .intensity = 1,
                                           .radius_m = 1};
    struct fixture fixture;
    (void)state;
    fixture_init(&fixture, render_rig_create());
    for (size_t i = 0; i < sizeof qualities / sizeof *qualities; i++) {
        atomic_int questions = 0;
        const struct yield_point yield = {.context = &questions,
                                          .should_yield = is_never_due,
                                          .is_unwanted = is_unwanted_from_the_third_question_on};
        struct view view = {.width_px = 16,
                            .height_px = 16,
                            .lights = &area,
                            .light_count = 1,
                            .quality = qualities[i]};
        struct frame frame;
        struct error err = {0};
        renderer_set_yield_point(fixture.renderer, &yield);
        assert_false(renderer_render(fixture.renderer, "demo", &view, &frame, &err));
        renderer_set_yield_point(fixture.renderer, NULL);
        if (err.code != ERROR_TIMEOUT)
            fail_msg("form %zu: %s", i, err.message);
        assert_null(frame.outputs[VIEW_OUTPUT_COLOR].pixels);
        assert_int_in_range(atomic_load(&questions), 3, 16);
        view.quality = (struct view_quality){.shadows = qualities[i].shadows, .samples = 1};
        shoot(fixture.renderer, &fixture.demo, &view, &frame);
        frame_finish(&frame);
    }
    fixture_finish(&fixture);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ray_traced_frames_keep_their_bits),
        cmocka_unit_test(rasterised_frames_keep_their_bits),
        cmocka_unit_test(batches_of_lights_keep_their_bits),
        cmocka_unit_test(shading_stops_between_time_slices),
        cmocka_unit_test(building_stops_between_lights),
        cmocka_unit_test(an_unwanted_frame_ends_and_the_next_is_whole),
        cmocka_unit_test(rays_of_an_unwanted_frame_end_within_a_tile),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
