/* SPDX-License-Identifier: MIT */
/* Choosing a setting by error and time: renderer/cost/choice. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "protocol/quality_defaults.h"
#include "renderer/cost/auto_technique.h"
#include "renderer/cost/choice.h"

#define MAP(resolution, taps, samples)                      \
    {                                                       \
        SHADOWS_DEEP, resolution, taps, samples, 0, 0, 0, 0 \
    }

/* Slower is better, but for one row that is worse in both. */
static const struct choice_row rows[] = {
    {MAP(256, 1, 1), 10, 0.10, 0},
    {MAP(512, 4, 1), 20, 0.05, 0},
    {MAP(512, 4, 4), 90, 0.06, 0},
    {MAP(1024, 4, 4), 40, 0.02, 0},
    {{SHADOWS_RAYTRACED, 0, 0, 4, 0, 0, 0, 0}, 80, 0.01, 0},
};
enum { ROWS = sizeof rows / sizeof rows[0] };

static struct choice choose(const struct quality_target *target)
{
    struct choice choice;
    assert_true(choice_make(rows, ROWS, target, &choice));
    return choice;
}

static void max_error_takes_the_fastest_within_it(void **state)
{
    (void)state;
    struct choice choice = choose(&(struct quality_target){.max_error = 0.05});
    assert_ptr_equal(choice.row, &rows[1]);
    assert_true(choice.keeps_error && choice.keeps_budget);
    assert_ptr_equal(choose(&(struct quality_target){.max_error = 1}).row, &rows[0]);
}

static void max_error_below_all_takes_the_most_accurate_and_says_so(void **state)
{
    (void)state;
    struct choice choice = choose(&(struct quality_target){.max_error = 0.001});
    assert_ptr_equal(choice.row, &rows[4]);
    assert_false(choice.keeps_error);
}

static void rays_of_more_samples_follow_the_one_with_most(void **state)
{
    (void)state;
    struct choice_row more[8] = {
        {{SHADOWS_RAYTRACED, 0, 0, 4, 0, 0, 0, 0}, 80, 0.01, 0},
        {{SHADOWS_RAYTRACED, 0, 0, 1, 0, 0, 0, 0}, 30, 0.03, 0},
        {MAP(1024, 4, 4), 40, 0.02, 0},
    };
    assert_int_equal(choice_add_traced(more, 3, 8), 6);
    for (int i = 3; i < 6; i++) {
        assert_int_equal(more[i].setting.shadows, SHADOWS_RAYTRACED);
        assert_int_equal(more[i].setting.samples, 4 << 2 * (i - 2));
        assert_true(more[i].ms == 80 * (1 << 2 * (i - 2)));
        assert_true(more[i].error < more[i == 3 ? 0 : i - 1].error);
    }
    assert_int_equal(choice_add_traced(more, 3, 4), 4);
    assert_int_equal(choice_add_traced(&more[2], 1, 6), 1);
}

static void budget_takes_the_most_accurate_within_it(void **state)
{
    (void)state;
    assert_ptr_equal(choose(&(struct quality_target){.budget_ms = 79}).row, &rows[3]);
    assert_ptr_equal(choose(&(struct quality_target){.budget_ms = 1000}).row, &rows[4]);
    struct choice choice = choose(&(struct quality_target){.budget_ms = 1});
    assert_ptr_equal(choice.row, &rows[0]);
    assert_false(choice.keeps_budget);
}

static void both_take_the_fastest_within_both(void **state)
{
    (void)state;
    struct choice choice = choose(&(struct quality_target){.max_error = 0.05, .budget_ms = 50});
    assert_ptr_equal(choice.row, &rows[1]);
    assert_true(choice.keeps_error && choice.keeps_budget);
}

static void both_out_of_reach_keep_the_time_before_the_error(void **state)
{
    (void)state;
    struct choice choice = choose(&(struct quality_target){.max_error = 0.01, .budget_ms = 50});
    assert_ptr_equal(choice.row, &rows[3]);
    assert_true(choice.keeps_budget && !choice.keeps_error);
    choice = choose(&(struct quality_target){.max_error = 0.05, .budget_ms = 5});
    assert_ptr_equal(choice.row, &rows[1]);
    assert_true(choice.keeps_error && !choice.keeps_budget);
    choice = choose(&(struct quality_target){.max_error = 0.001, .budget_ms = 5});
    assert_ptr_equal(choice.row, &rows[0]);
    assert_true(!choice.keeps_error && !choice.keeps_budget);
}

static void what_was_said_stays(void **state)
{
    (void)state;
    struct quality_target target = {.max_error = 0.5, .samples = 4};
    assert_ptr_equal(choose(&target).row, &rows[3]);
    target = (struct quality_target){.max_error = 0.5, .shadows = SHADOWS_RAYTRACED};
    assert_ptr_equal(choose(&target).row, &rows[4]);
    target = (struct quality_target){.max_error = 0.02, .shadow_resolution = 512};
    assert_ptr_equal(choose(&target).row, &rows[4]); /* which has no map to be of another size */
    struct choice choice;
    target = (struct quality_target){.max_error = 0.5, .shadows = SHADOWS_MAP};
    assert_false(choice_make(rows, ROWS, &target, &choice));
    assert_false(choice_make(rows, 0, &(struct quality_target){.max_error = 1}, &choice));
}

static void an_unknown_error_is_never_promised(void **state)
{
    (void)state;
    const struct choice_row unknown[] = {{{SHADOWS_NONE, 0, 0, 1, 0, 0, 0, 0}, 1, INFINITY, 0}};
    struct choice choice;
    assert_true(choice_make(unknown, 1, &(struct quality_target){.max_error = 1e6}, &choice));
    assert_false(choice.keeps_error);
}

static void equal_rows_go_to_the_first(void **state)
{
    (void)state;
    const struct choice_row equal[] = {rows[1], rows[1], rows[1]};
    struct choice choice;
    assert_true(choice_make(equal, 3, &(struct quality_target){.budget_ms = 100}, &choice));
    assert_ptr_equal(choice.row, &equal[0]);
}

/* ---- models ---- */

static const struct choice_row *find(const struct choice_row *estimates, size_t count,
                                     struct quality_setting wanted)
{
    for (size_t i = 0; i < count; i++) {
        const struct quality_setting *setting = &estimates[i].setting;
        if (setting->shadows == wanted.shadows && setting->samples == wanted.samples &&
            setting->shadow_resolution == wanted.shadow_resolution &&
            setting->shadow_taps == wanted.shadow_taps)
            return &estimates[i];
    }
    fail_msg("no estimate");
    return NULL;
}

static void models_grow_with_what_they_are_made_of(void **state)
{
    (void)state;
    struct choice_row small[CHOICE_ESTIMATES_MAX], large[CHOICE_ESTIMATES_MAX];
    const struct quality_target open = {.max_error = 1};
    const struct choice_frame frame = {
        .width_px = 400, .height_px = 250, .lights = 4, .triangles = 1000};
    struct choice_frame more = frame;
    size_t count = choice_estimate(&frame, &open, small);
    const struct choice_row *coarse =
        find(small, count, (struct quality_setting){SHADOWS_DEEP, 256, 4, 4, 0, 0, 0, 0});
    const struct choice_row *fine =
        find(small, count, (struct quality_setting){SHADOWS_DEEP, 2048, 4, 4, 0, 0, 0, 0});
    assert_true(fine->error < coarse->error && fine->ms > coarse->ms);
    const struct choice_row *one =
        find(small, count, (struct quality_setting){SHADOWS_DEEP, 256, 4, 1, 0, 0, 0, 0});
    assert_true(one->error > coarse->error && one->ms < coarse->ms);
    more.has_haze = true;
    const struct quality_target usual = {.max_error = 1, .atmosphere_samples = 64};
    assert_int_equal(choice_estimate(&more, &usual, large), count);
    for (size_t i = 0; i < count; i++) {
        assert_true(large[i].ms > small[i].ms + 1 && isfinite(large[i].ms));
        assert_true(large[i].error > small[i].error || isinf(small[i].error));
        bool is_traced = large[i].setting.shadows == SHADOWS_RAYTRACED;
        assert_false(large[i].error < (is_traced ? 0.0245 : 0.039));
    }
    more.has_haze = false;
    more.has_grids = true;
    const struct quality_target rays = {.max_error = 1, .shadows = SHADOWS_RAYTRACED};
    struct choice_row clear[CHOICE_ESTIMATES_MAX], smoky[CHOICE_ESTIMATES_MAX];
    size_t traced = choice_estimate(&frame, &rays, clear);
    assert_int_equal(choice_estimate(&more, &rays, smoky), traced);
    for (size_t i = 0; i < traced; i++)
        assert_true(smoky[i].ms > 5 * clear[i].ms && isfinite(smoky[i].ms));
    more.lights = 40;
    more.width_px = more.height_px = 1000;
    assert_int_equal(choice_estimate(&more, &open, large), count);
    for (size_t i = 0; i < count; i++) {
        assert_true(large[i].ms > small[i].ms && isfinite(large[i].ms));
        assert_true(small[i].error > 0 && isfinite(small[i].error));
    }
}

/* Fewer slices are quicker and worse, so that a target can choose them; without haze all are one.
 */
static void models_offer_slices_of_haze(void **state)
{
    (void)state;
    static const enum shadow_technique techniques[] = {SHADOWS_DEEP, SHADOWS_RAYTRACED};
    static const int slices[] = {16, 0, 256};
    struct choice_row estimates[CHOICE_ESTIMATES_MAX];
    struct choice_frame frame = {
        .width_px = 640, .height_px = 360, .lights = 4, .triangles = 1000, .has_haze = true};
    for (size_t t = 0; t < 2; t++) {
        struct quality_target target = {.max_error = 1,
                                        .shadows = techniques[t],
                                        .shadow_resolution = 1024,
                                        .shadow_taps = 4,
                                        .samples = 4};
        const struct choice_row *found[3] = {NULL};
        frame.has_haze = true;
        assert_int_equal(choice_estimate(&frame, &target, estimates), 3);
        for (int i = 0; i < 3; i++)
            for (int s = 0; s < 3; s++)
                if (estimates[i].setting.atmosphere_samples == slices[s])
                    found[s] = &estimates[i];
        for (int s = 0; s < 3; s++)
            assert_non_null(found[s]);
        for (int s = 1; s < 3; s++)
            assert_true(found[s]->ms > found[s - 1]->ms && found[s]->error < found[s - 1]->error);
        target.atmosphere_samples = 48;
        assert_int_equal(choice_estimate(&frame, &target, estimates), 1);
        assert_int_equal(estimates[0].setting.atmosphere_samples, 48);
        assert_true(choice_row_fits(&estimates[0], &target));
        assert_false(choice_row_fits(
            &(struct choice_row){.setting = {.shadows = techniques[t], .samples = 4}}, &target));
        frame.has_haze = false;
        target.atmosphere_samples = 0;
        assert_int_equal(choice_estimate(&frame, &target, estimates), 1);
        assert_int_equal(estimates[0].setting.atmosphere_samples, 0);
    }
}

static void rays_go_up_to_256_samples_for_small_errors(void **state)
{
    (void)state;
    struct choice_row estimates[CHOICE_ESTIMATES_MAX];
    const struct choice_frame frame = {
        .width_px = 160, .height_px = 90, .lights = 4, .triangles = 3000};
    static const struct {
        double max_error;
        int samples;
    } cases[] = {{0.015, 16}, {0.01, 64}, {0.005, 256}}; /* the rasteriser is at 0.025 */
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const struct quality_target target = {.max_error = cases[i].max_error};
        struct choice choice;
        size_t count = choice_estimate(&frame, &target, estimates);
        assert_true(choice_make(estimates, count, &target, &choice));
        assert_true(choice.keeps_error);
        assert_int_equal(choice.row->setting.shadows, SHADOWS_RAYTRACED);
        assert_int_equal(choice.row->setting.samples, cases[i].samples);
    }
    const struct quality_target quick = {.max_error = 0.1};
    struct choice choice;
    size_t count = choice_estimate(&frame, &quick, estimates);
    assert_true(choice_make(estimates, count, &quick, &choice));
    assert_int_in_range(choice.row->setting.samples, 1, 4);
}

static void models_give_only_what_was_said(void **state)
{
    (void)state;
    struct choice_row estimates[CHOICE_ESTIMATES_MAX];
    const struct choice_frame frame = {
        .width_px = 400, .height_px = 250, .lights = 4, .triangles = 1000};
    static const struct quality_target targets[] = {
        {.max_error = 1, .shadows = SHADOWS_DEEP, .shadow_resolution = 700},
        {.max_error = 1, .shadows = SHADOWS_RAYTRACED, .samples = 64},
        {.max_error = 1, .shadows = SHADOWS_NONE},
        {.max_error = 1, .samples = 1, .shadow_taps = 9},
        {.budget_ms = 1e6, .needs = SHADOW_CAN_LINKED_LISTS},
    };
    for (size_t w = 0; w < sizeof targets / sizeof targets[0]; w++) {
        size_t count = choice_estimate(&frame, &targets[w], estimates);
        assert_int_in_range(count, 1, CHOICE_ESTIMATES_MAX);
        for (size_t i = 0; i < count; i++) {
            const struct quality_setting *setting = &estimates[i].setting;
            assert_true(choice_row_fits(&estimates[i], &targets[w]));
            assert_true(setting->samples <= 4 || setting->shadows == SHADOWS_RAYTRACED);
        }
    }
}

/* A target that nothing keeps takes the nearest, which has to have room. */
static void layered_maps_are_no_larger_than_the_default_but_where_it_was_said(void **state)
{
    (void)state;
    static const enum shadow_technique layered[] = {SHADOWS_COMPOSITED, SHADOWS_MOMENTS};
    const struct choice_frame frame = {
        .width_px = 400, .height_px = 250, .lights = 4, .triangles = 1000};
    struct choice_row estimates[CHOICE_ESTIMATES_MAX];
    struct choice choice;
    for (size_t t = 0; t < sizeof layered / sizeof *layered; t++) {
        struct quality_target target = {.max_error = 1e-4, .shadows = layered[t]};
        size_t count = choice_estimate(&frame, &target, estimates);
        assert_true(choice_make(estimates, count, &target, &choice) && !choice.keeps_error);
        assert_int_equal(choice.row->setting.shadow_resolution, SHADOW_RESOLUTION_DEFAULT);
        target.shadow_resolution = 4096;
        count = choice_estimate(&frame, &target, estimates);
        assert_true(choice_make(estimates, count, &target, &choice));
        assert_int_equal(choice.row->setting.shadow_resolution, 4096);
    }
    const struct quality_target deep = {.max_error = 1e-4, .shadows = SHADOWS_DEEP};
    assert_true(choice_make(estimates, choice_estimate(&frame, &deep, estimates), &deep, &choice));
    assert_int_equal(choice.row->setting.shadow_resolution, 4096);
}

static double peeled_ms(int sides, bool has_haze)
{
    struct choice_row estimates[CHOICE_ESTIMATES_MAX];
    const struct choice_frame frame = {.width_px = 400,
                                       .height_px = 250,
                                       .lights = 4,
                                       .triangles = 1000,
                                       .has_haze = has_haze,
                                       .peeled_sides = sides};
    const struct quality_target target = {.max_error = 1,
                                          .shadows = SHADOWS_DEEP,
                                          .samples = 4,
                                          .shadow_resolution = 512,
                                          .shadow_taps = 1,
                                          .atmosphere_samples = has_haze ? 16 : 0};
    assert_int_equal(choice_estimate(&frame, &target, estimates), 1);
    return estimates[0].ms;
}

static void models_count_peeled_layers_but_in_haze(void **state)
{
    (void)state;
    /* a side of 1e5 pixels with 4 samples: 21 ms */
    assert_true(peeled_ms(1, false) > peeled_ms(0, false) + 21);
    assert_true(peeled_ms(2, false) > peeled_ms(0, false) + 42);
    assert_true(peeled_ms(1, true) == peeled_ms(0, true)); /* haze takes lists */
}

/* Rounds draw all again but the shadow maps, and are taken only where they are asked for. */
static void models_count_the_rounds_of_samples(void **state)
{
    (void)state;
    static const int samples[] = {4, 8, 16};
    double ms[2][3], error[3];
    for (int warm = 0; warm < 2; warm++)
        for (int i = 0; i < 3; i++) {
            struct choice_row estimates[CHOICE_ESTIMATES_MAX];
            const struct choice_frame frame = {.width_px = 1000,
                                               .height_px = 1000,
                                               .lights = 4,
                                               .triangles = 1000,
                                               .is_warm = warm};
            const struct quality_target target = {.max_error = 1,
                                                  .shadows = SHADOWS_DEEP,
                                                  .samples = samples[i],
                                                  .shadow_resolution = 1024,
                                                  .shadow_taps = 4};
            assert_int_equal(choice_estimate(&frame, &target, estimates), 1);
            assert_int_equal(estimates[0].setting.samples, samples[i]);
            ms[warm][i] = estimates[0].ms;
            error[i] = estimates[0].error;
        }
    for (int i = 1; i < 3; i++) {
        double rounds = samples[i] / 4.0, drawn = ms[1][i] / ms[1][0];
        assert_true(drawn > 0.9 * rounds && drawn <= rounds + 1e-9);
        assert_true(fabs((ms[0][i] - ms[1][i]) - (ms[0][0] - ms[1][0])) < 1e-9 * ms[0][i]);
        assert_true(error[i] < error[i - 1]);
    }
}

static void rows_of_other_views_scale_with_their_pixels(void **state)
{
    (void)state;
    struct choice_row scaled = choice_scale(&rows[3], 1000, 4000);
    assert_true(scaled.ms == 160 && scaled.error == rows[3].error);
}

static void shadows_are_not_dropped_where_little_time_is_missing(void **state)
{
    (void)state;
    struct choice_row some[] = {
        {{SHADOWS_NONE, 0, 0, 1, 0, 0, 0, 0}, 20, 0.26, 0},
        {{SHADOWS_RAYTRACED, 0, 0, 1, 0, 0, 0, 0}, 70, 0.03, 0},
        {MAP(1024, 4, 4), 200, 0.02, 0},
    };
    struct choice choice;
    const struct quality_target target = {.budget_ms = 50};
    assert_true(choice_make(some, 3, &target, &choice));
    assert_ptr_equal(choice.row, &some[1]);
    assert_false(choice.keeps_budget); /* which is told */
    assert_true(choice_make(some, 3, &(struct quality_target){.budget_ms = 40}, &choice));
    assert_ptr_equal(choice.row, &some[0]); /* 70 is too late */
    assert_true(choice.keeps_budget);
    const struct quality_target bare = {.budget_ms = 50, .shadows = SHADOWS_NONE};
    assert_true(choice_make(some, 3, &bare, &choice));
    assert_ptr_equal(choice.row, &some[0]); /* asked for */
    some[1].error = 0.2;                    /* hardly better than no shadows at all */
    assert_true(choice_make(some, 3, &target, &choice));
    assert_ptr_equal(choice.row, &some[0]);
    some[1].error = INFINITY;
    assert_true(choice_make(some, 3, &target, &choice));
    assert_ptr_equal(choice.row, &some[0]);
}

/* Beside an error that was named, which a setting without shadows keeps or does not. */
static void an_error_that_was_named_says_what_shadows_are_worth(void **state)
{
    (void)state;
    const struct choice_row some[] = {
        {{SHADOWS_NONE, 0, 0, 1, 0, 0, 0, 0}, 20, 0.26, 0},
        {{SHADOWS_RAYTRACED, 0, 0, 1, 0, 0, 0, 0}, 70, 0.03, 0},
        {MAP(1024, 4, 4), 200, 0.02, 0},
    };
    static const struct {
        double max_error, budget_ms;
        int row;
        bool keeps_error, keeps_budget;
    } cases[] = {
        {0.3, 50, 0, true, true},   /* it keeps both */
        {0.3, 500, 0, true, true},  /* the fastest that does */
        {0.05, 50, 1, true, false}, /* dropping shadows for 20 ms is not worth an error of 0.26 */
        {0.05, 40, 0, false, true}, /* for 30 ms it is: the time bounds the error */
        {0.05, 100, 1, true, true},
        {0.01, 100, 1, false, true}, /* the most accurate within the time */
        {0.01, 10, 0, false, false}, /* the fastest */
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const struct quality_target target = {.max_error = cases[i].max_error,
                                              .budget_ms = cases[i].budget_ms};
        struct choice choice;
        assert_true(choice_make(some, 3, &target, &choice));
        assert_ptr_equal(choice.row, &some[cases[i].row]);
        assert_int_equal(choice.keeps_error, cases[i].keeps_error);
        assert_int_equal(choice.keeps_budget, cases[i].keeps_budget);
    }
}

/* Twelve maps of 4096 do not stay where there is room for four: they are made for each frame. */
static void maps_that_do_not_stay_are_made_in_each_frame(void **state)
{
    (void)state;
    struct choice_row kept[CHOICE_ESTIMATES_MAX], rebuilt[CHOICE_ESTIMATES_MAX];
    struct choice_frame frame = {
        .width_px = 1000, .height_px = 1000, .lights = 12, .triangles = 50000, .is_warm = true};
    const struct quality_target target = {.budget_ms = 500, .shadows = SHADOWS_DEEP};
    size_t count = choice_estimate(&frame, &target, kept);
    frame.shadow_bytes = 256e6;
    assert_int_equal(choice_estimate(&frame, &target, rebuilt), count);
    bool has_kept = false, has_rebuilt = false;
    for (size_t i = 0; i < count; i++) {
        int resolution = kept[i].setting.shadow_resolution;
        assert_true(resolution <= 512 ? rebuilt[i].ms == kept[i].ms : true);
        assert_true(resolution == 4096 ? rebuilt[i].ms > 3 * kept[i].ms : true);
        has_kept |= resolution <= 512;
        has_rebuilt |= resolution == 4096;
    }
    assert_true(has_kept && has_rebuilt);
}

/* Rows of what a candidate becomes stand for it: the maps of opaque casters are plain. */
static void a_technique_stands_for_the_candidate_that_becomes_it(void **state)
{
    (void)state;
    assert_int_equal(choice_candidate_of(SHADOWS_MAP), SHADOWS_RASTER_DEFAULT);
    for (int i = 0; i < SHADOWS_COUNT; i++)
        if (i != SHADOWS_MAP)
            assert_int_equal(choice_candidate_of((enum shadow_technique)i), i);
}

static void times_are_told_of_candidates_that_have_any(void **state)
{
    (void)state;
    char text[AUTO_TIMES_BYTES];
    double ms[SHADOWS_COUNT];
    for (int i = 0; i < SHADOWS_COUNT; i++)
        ms[i] = -1;
    auto_times_text(ms, text);
    assert_string_equal(text, "");
    ms[SHADOWS_DEEP] = 80.5;
    ms[SHADOWS_MAP] = 5; /* no candidate */
    ms[SHADOWS_RAYTRACED] = 120;
    auto_times_text(ms, text);
    assert_string_equal(text, "120 ms ray traced, 80.5 ms rasterised");
    ms[SHADOWS_RAYTRACED_SHADOWS] = 0;
    auto_times_text(ms, text);
    assert_string_equal(text, "120 ms ray traced, 80.5 ms rasterised, 0 ms with traced shadows");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(max_error_takes_the_fastest_within_it),
        cmocka_unit_test(max_error_below_all_takes_the_most_accurate_and_says_so),
        cmocka_unit_test(rays_of_more_samples_follow_the_one_with_most),
        cmocka_unit_test(budget_takes_the_most_accurate_within_it),
        cmocka_unit_test(both_take_the_fastest_within_both),
        cmocka_unit_test(both_out_of_reach_keep_the_time_before_the_error),
        cmocka_unit_test(what_was_said_stays),
        cmocka_unit_test(an_unknown_error_is_never_promised),
        cmocka_unit_test(equal_rows_go_to_the_first),
        cmocka_unit_test(shadows_are_not_dropped_where_little_time_is_missing),
        cmocka_unit_test(an_error_that_was_named_says_what_shadows_are_worth),
        cmocka_unit_test(maps_that_do_not_stay_are_made_in_each_frame),
        cmocka_unit_test(models_grow_with_what_they_are_made_of),
        cmocka_unit_test(models_offer_slices_of_haze),
        cmocka_unit_test(rays_go_up_to_256_samples_for_small_errors),
        cmocka_unit_test(models_give_only_what_was_said),
        cmocka_unit_test(layered_maps_are_no_larger_than_the_default_but_where_it_was_said),
        cmocka_unit_test(models_count_peeled_layers_but_in_haze),
        cmocka_unit_test(models_count_the_rounds_of_samples),
        cmocka_unit_test(rows_of_other_views_scale_with_their_pixels),
        cmocka_unit_test(a_technique_stands_for_the_candidate_that_becomes_it),
        cmocka_unit_test(times_are_told_of_candidates_that_have_any),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
