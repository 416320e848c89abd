/* SPDX-License-Identifier: MIT */
/* What requests that leave something open become: server/worker/chooser, from offers of the front.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/mapping/choice_offer.h"
#include "server/worker/chooser.h"

static const struct auto_settings measured_speed = {.policy = AUTO_MEASURED,
                                                    .speed = {0.5, 1, 1, 1, 1}};
static const struct renderer_info info = {.budget_bytes = UINT64_C(1) << 30};

static struct choice_row row_of(enum shadow_technique shadows, int samples, double ms, double error)
{
    bool has_map = shadow_technique_has(shadows, SHADOW_HAS_MAP);
    return (struct choice_row){.setting = {.shadows = shadows,
                                           .shadow_resolution = has_map ? 1024 : 0,
                                           .shadow_taps = has_map ? 4 : 0,
                                           .samples = samples},
                               .ms = ms,
                               .error = error};
}

static void add(struct choice_rows *rows, struct choice_row row)
{
    rows->rows[rows->count++] = row;
}

/* Maps in 20 ms, rays in 10 and 40, the error of none. */
static json_t *offer_of_view(void)
{
    struct choice_offer *offer = calloc(1, sizeof *offer);
    assert_non_null(offer);
    offer->triangles = 1000;
    add(&offer->view, row_of(SHADOWS_DEEP, 4, 20, 0.02));
    add(&offer->view, row_of(SHADOWS_RAYTRACED, 4, 10, 0.02));
    add(&offer->view, row_of(SHADOWS_RAYTRACED, 1, 40, 0.01));
    add(&offer->view, row_of(SHADOWS_NONE, 4, 1, INFINITY));
    json_t *json = choice_offer_to_json(offer);
    free(offer);
    assert_non_null(json);
    return json;
}

struct rig {
    struct time_estimator *estimator;
    struct render_request request;
    struct frame_promise promise;
};

static void rig_init(struct rig *rig)
{
    struct error err = {0};
    *rig = (struct rig){.estimator = time_estimator_create(&err)};
    assert_non_null(rig->estimator);
    render_request_init_defaults(&rig->request);
}

static void rig_finish(struct rig *rig)
{
    time_estimator_destroy(rig->estimator);
    render_request_finish(&rig->request);
}

static bool choose(struct rig *rig, const json_t *offer, struct error *err)
{
    const struct chooser_desc desc = {
        .estimator = rig->estimator, .automatic = &measured_speed, .info = &info, .offer = offer};
    return chooser_choose(&desc, &rig->request, &rig->promise, err);
}

static void an_offer_comes_as_it_was_sent(void **state)
{
    (void)state;
    struct error err = {0};
    json_t *json = offer_of_view();
    struct choice_offer *offer = calloc(1, sizeof *offer);
    assert_non_null(offer);
    assert_true(choice_offer_from_json(json, offer, &err));
    assert_int_equal(offer->view.count, 4);
    assert_int_equal(offer->scene.count, 0);
    assert_int_equal(offer->triangles, 1000);
    assert_int_equal(offer->view.rows[0].setting.shadows, SHADOWS_DEEP);
    assert_int_equal(offer->view.rows[0].setting.shadow_resolution, 1024);
    assert_true(offer->view.rows[0].ms == 20 && offer->view.rows[0].error == 0.02);
    assert_true(isinf(offer->view.rows[3].error));
    json_t *again = choice_offer_to_json(offer);
    assert_true(json_equal(json, again));
    json_decref(again);
    json_decref(json);
    free(offer);
}

static void a_malformed_offer_is_refused(void **state)
{
    (void)state;
    static const char *const texts[] = {"{\"view\":[[\"deep\",1]]}", "{\"view\":[7]}",
                                        "{\"view\":[[\"cubist\",1,1,1,0.0,1,1.0,null]]}",
                                        "{\"scene\":[[\"deep\",1,1,1,0.0,1,\"soon\",null]]}"};
    struct rig rig;
    rig_init(&rig);
    rig.request.quality.max_error = 1;
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        struct error err = {0};
        json_t *json = json_loads(texts[i], 0, NULL);
        assert_non_null(json);
        assert_false(choose(&rig, json, &err));
        assert_int_equal(err.code, ERROR_INTERNAL);
        json_decref(json);
    }
    rig_finish(&rig);
}

static void a_target_takes_the_fastest_row_that_keeps_it(void **state)
{
    (void)state;
    struct rig rig;
    struct error err = {0};
    json_t *offer = offer_of_view();
    rig_init(&rig);
    rig.request.quality.max_error = 0.03;
    assert_true(choose(&rig, offer, &err));
    assert_int_equal(rig.request.quality.shadows, SHADOWS_RAYTRACED);
    assert_int_equal(rig.request.quality.samples, 4);
    assert_false(request_quality_asks(&rig.request.quality));
    assert_true(rig.promise.has_error && rig.promise.rmse == 0.02);
    assert_string_equal(rig.promise.chosen.shadows, "raytraced");
    json_decref(offer);
    rig_finish(&rig);
}

static void scenes_with_grids_take_what_draws_them(void **state)
{
    (void)state;
    struct rig rig;
    struct error err = {0};
    json_t *offer = offer_of_view(), *quick = json_array_get(json_object_get(offer, "view"), 0);
    rig_init(&rig);
    rig.request.quality.max_error = 0.03;
    rig.request.quality.budget_ms = 8;
    json_array_set_new(quick, 0, json_string("raytraced-shadows"));
    json_array_set_new(quick, 6, json_real(1));
    assert_true(choose(&rig, offer, &err));
    assert_string_equal(rig.promise.chosen.shadows, "raytraced-shadows");
    rig_finish(&rig);
    rig_init(&rig);
    rig.request.quality.max_error = 0.03;
    rig.request.quality.budget_ms = 8;
    json_object_set_new(offer, "has_grids", json_true());
    assert_true(choose(&rig, offer, &err));
    assert_string_equal(rig.promise.chosen.shadows, "raytraced");
    json_decref(offer);
    rig_finish(&rig);
}

/* The row of the view, and its like of 16 slices in half the time with twice the error. */
static json_t *offer_in_haze(void)
{
    struct choice_offer *offer = calloc(1, sizeof *offer);
    assert_non_null(offer);
    add(&offer->view, row_of(SHADOWS_DEEP, 4, 20, 0.02));
    add(&offer->view, row_of(SHADOWS_DEEP, 4, 10, 0.04));
    offer->view.rows[1].setting.atmosphere_samples = 16;
    add(&offer->view, row_of(SHADOWS_RAYTRACED, 4, 15, 0.02));
    json_t *json = choice_offer_to_json(offer);
    free(offer);
    assert_non_null(json);
    return json;
}

static void atmosphere_samples_are_chosen_in_haze_and_stay_where_they_were_said(void **state)
{
    (void)state;
    static const struct {
        double max_error;
        int said, chosen;
        double ms;
    } cases[] = {{0.05, 0, 16, 10}, {0.03, 0, 0, 15}, {0.05, 16, 16, 10}, {0.03, 16, 16, 10}};
    json_t *offer = offer_in_haze();
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct rig rig;
        struct error err = {0};
        rig_init(&rig);
        rig.request.atmosphere.density = 0.1;
        rig.request.quality.max_error = cases[i].max_error;
        rig.request.quality.atmosphere_samples = cases[i].said;
        assert_true(choose(&rig, offer, &err));
        assert_int_equal(rig.promise.chosen.atmosphere_samples, cases[i].chosen);
        assert_int_equal(rig.request.quality.atmosphere_samples, cases[i].chosen);
        assert_true(rig.promise.chosen.expected_ms == cases[i].ms);
        rig_finish(&rig);
    }
    json_decref(offer);
}

/* Without a target the technique alone is chosen, by rows of the samples that are drawn. */
static void auto_goes_by_rows_of_the_atmosphere_samples_that_are_drawn(void **state)
{
    (void)state;
    struct rig rig;
    struct error err = {0};
    json_t *offer = offer_in_haze();
    rig_init(&rig);
    rig.request.atmosphere.density = 0.1;
    assert_true(choose(&rig, offer, &err));
    assert_int_equal(rig.request.quality.shadows, SHADOWS_RAYTRACED);
    assert_true(rig.promise.chosen.expected_ms == 15);
    assert_int_equal(rig.request.quality.atmosphere_samples, 0);
    rig_finish(&rig);
    rig_init(&rig);
    rig.request.atmosphere.density = 0.1;
    rig.request.quality.atmosphere_samples = 16; /* of which no rays were measured */
    assert_true(choose(&rig, offer, &err));
    assert_int_equal(rig.request.quality.shadows, SHADOWS_AUTO);
    rig_finish(&rig);
    json_decref(offer);
}

static void what_was_said_stays(void **state)
{
    (void)state;
    struct rig rig;
    struct error err = {0};
    json_t *offer = offer_of_view();
    rig_init(&rig);
    rig.request.quality.max_error = 0.03;
    rig.request.quality.shadows = SHADOWS_DEEP;
    assert_true(choose(&rig, offer, &err));
    assert_int_equal(rig.request.quality.shadows, SHADOWS_DEEP);
    assert_true(rig.promise.chosen.expected_ms >= 20);
    json_decref(offer);
    rig_finish(&rig);
}

static void auto_is_the_fastest_of_what_was_measured_for_the_view(void **state)
{
    (void)state;
    struct rig rig;
    struct error err = {0};
    json_t *offer = offer_of_view();
    rig_init(&rig);
    assert_true(choose(&rig, offer, &err));
    assert_int_equal(rig.request.quality.shadows, SHADOWS_RAYTRACED);
    assert_true(rig.promise.chosen.expected_ms == 10);
    rig.request.quality.shadows = SHADOWS_AUTO;
    rig.request.quality.shadow_taps = 16; /* only maps have them */
    assert_true(choose(&rig, offer, &err));
    assert_int_equal(rig.request.quality.shadows, SHADOWS_AUTO);
    json_decref(offer);
    rig_finish(&rig);
}

static void without_an_offer_the_planner_decides(void **state)
{
    (void)state;
    struct rig rig;
    struct error err = {0};
    rig_init(&rig);
    assert_true(choose(&rig, NULL, &err));
    assert_int_equal(rig.request.quality.shadows, SHADOWS_AUTO);
    assert_string_equal(rig.promise.chosen.shadows, "");
    rig_finish(&rig);
}

static void the_reference_leaves_nothing_to_choose(void **state)
{
    (void)state;
    struct rig rig;
    struct error err = {0};
    rig_init(&rig);
    rig.request.quality.reference = true;
    rig.request.quality.budget_ms = 5;
    assert_true(choose(&rig, NULL, &err));
    assert_false(request_quality_asks(&rig.request.quality));
    assert_non_null(strstr(rig.promise.warning, "leaves nothing to choose"));
    rig_finish(&rig);
}

static void frames_that_take_longer_teach(void **state)
{
    (void)state;
    struct rig rig;
    struct error err = {0};
    json_t *offer = offer_of_view();
    struct frame_stats *stats = calloc(1, sizeof *stats);
    assert_non_null(stats);
    rig_init(&rig);
    strcpy(rig.request.scene, "abc");
    for (int i = 0; i < 8 && rig.request.quality.shadows != SHADOWS_DEEP; i++) {
        *stats = (struct frame_stats){.scene = "abc"};
        stats->timings_ms[FRAME_TIMING_TOTAL] = 100;
        rig.request.quality.shadows = SHADOWS_AUTO;
        rig.request.quality.samples = 0;
        rig.request.quality.max_error = 0.03;
        assert_true(choose(&rig, offer, &err));
        chooser_judge(rig.estimator, &rig.promise, stats);
    }
    assert_int_equal(rig.request.quality.shadows, SHADOWS_DEEP); /* 20 ms are less than 100 */
    free(stats);
    json_decref(offer);
    rig_finish(&rig);
}

/* Haze takes time in forecasts, and has an error. */
static void forecasts_know_of_haze(void **state)
{
    (void)state;
    struct error err = {0};
    json_t *offer = json_pack("{s:i,s:i}", "triangles", 1000, "scene_lights", 4);
    double expected_ms[2], rmse[2];
    for (int hazy = 0; hazy < 2; hazy++) {
        struct rig rig;
        rig_init(&rig);
        rig.request.quality.max_error = 0.5;
        rig.request.quality.shadows = SHADOWS_RAYTRACED;
        rig.request.quality.samples = 1;
        rig.request.quality.atmosphere_samples = 64;
        rig.request.atmosphere.density = hazy;
        if (!choose(&rig, offer, &err))
            fail_msg("%s", err.message);
        expected_ms[hazy] = rig.promise.chosen.expected_ms;
        rmse[hazy] = rig.promise.rmse;
        assert_null(strstr(rig.promise.chosen.because, "without that of the haze"));
        assert_int_equal(rig.promise.is_hazy, hazy);
        rig_finish(&rig);
    }
    assert_true(expected_ms[1] > 1.1 * expected_ms[0]);
    assert_true(rmse[0] > 0 && rmse[1] > rmse[0]);
    json_decref(offer);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_offer_comes_as_it_was_sent),
        cmocka_unit_test(a_malformed_offer_is_refused),
        cmocka_unit_test(a_target_takes_the_fastest_row_that_keeps_it),
        cmocka_unit_test(scenes_with_grids_take_what_draws_them),
        cmocka_unit_test(atmosphere_samples_are_chosen_in_haze_and_stay_where_they_were_said),
        cmocka_unit_test(auto_goes_by_rows_of_the_atmosphere_samples_that_are_drawn),
        cmocka_unit_test(what_was_said_stays),
        cmocka_unit_test(auto_is_the_fastest_of_what_was_measured_for_the_view),
        cmocka_unit_test(without_an_offer_the_planner_decides),
        cmocka_unit_test(the_reference_leaves_nothing_to_choose),
        cmocka_unit_test(frames_that_take_longer_teach),
        cmocka_unit_test(forecasts_know_of_haze),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
