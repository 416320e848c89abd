/* SPDX-License-Identifier: MIT */
/* What is kept between frames, what is rebuilt and why, and what the budget refuses. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/shadows/technique.h"
#include "shaders/shared/layout.h"
#include "tests/support/shadow_rig.h"

#include "shaders/shared/records.h"

static struct shadow_rig rig;
static const double no_eye[3] = {0, 0, 0};
static const double up[3] = {0, 1, 0};
/* two spots side by side whose cones do not meet, and a point light that reaches neither */
static struct view_light lamps[] = {
    {.type = SCENE_LIGHT_SPOT,
     .position = {-10, 5, 0},
     .direction = {0, -1, 0},
     .color = {1, 1, 1},
     .intensity = 1,
     .outer_cone_deg = 25},
    {.type = SCENE_LIGHT_SPOT,
     .position = {10, 5, 0},
     .direction = {0, -1, 0},
     .color = {1, 1, 1},
     .intensity = 1,
     .outer_cone_deg = 25},
    {.type = SCENE_LIGHT_POINT,
     .position = {0, 5, 100},
     .color = {1, 1, 1},
     .intensity = 1,
     .range = 5},
};

static struct pane_scene make_scene(void)
{
    struct pane_scene panes = {0};
    for (int side = -1; side <= 1; side += 2) {
        pane_scene_add(&panes, &(struct pane){.center = {10 * side, 3, 0},
                                              .u = {0.5, 0, 0},
                                              .v = {0, 0, -0.5},
                                              .color = {0.5f, 0.25f, 1}});
        pane_scene_add(&panes, &(struct pane){.center = {10 * side, 0, 0},
                                              .u = {4, 0, 0},
                                              .v = {0, 0, -4},
                                              .is_opaque = true});
    }
    return panes;
}

static bool try_prepare(const struct pane_scene *panes, size_t lights, const double eye[3],
                        const struct view_quality *quality, struct error *err)
{
    return shadow_rig_prepare(&rig, panes, lamps, lights, eye, quality, err);
}

static void expect(const struct pane_scene *panes, const double eye[3],
                   const struct view_quality *quality, uint64_t built, uint64_t reused)
{
    struct error err = {0};
    if (!try_prepare(panes, 3, eye, quality, &err))
        fail_msg("%s", err.message);
    assert_int_equal(rig.report.counts.shadow_maps_built, built);
    assert_int_equal(rig.report.counts.shadow_maps_reused, reused);
    assert_int_equal(rig.report.counts.shadowed_lights, built + reused);
}

static bool has_pass(const char *name)
{
    for (int i = 0; i < rig.report.pass_count; i++)
        if (!strcmp(rig.report.passes[i].pass, name))
            return true;
    return false;
}

static void a_new_camera_rebuilds_nothing(void **state)
{
    (void)state;
    struct pane_scene panes = make_scene();
    const struct view_quality quality = {.shadow_resolution = 64};
    shadow_system_forget(rig.shadows, "panes");
    expect(&panes, no_eye, &quality, 2, 0);
    assert_true(has_pass("shadow.deep.count") && has_pass("shadow.deep.sort"));
    assert_non_null(strstr(rig.report.passes[0].because, "in reach"));
    /* Nothing within its range. */
    assert_int_equal(shadow_system_record(rig.shadows, 2), NO_SHADOW);
    float before[1][4], after[1][4];
    shadow_rig_query(&rig, 0, &(double[3]){-10.1, 1, 0.1}, up, 1, UINT32_MAX, before);
    expect(&panes, (double[3]){-7, 2, 40}, &quality, 0, 2);
    assert_int_equal(rig.report.pass_count, 0);
    assert_int_equal(rig.report.reused_count, 1);
    assert_string_equal(rig.report.reused[0], "shadow.deep");
    shadow_rig_query(&rig, 0, &(double[3]){-10.1, 1, 0.1}, up, 1, UINT32_MAX, after);
    assert_true(fabsf(before[0][0] - 0.5f) < 1e-6f && fabsf(after[0][0] - 0.5f) < 1e-6f);
    pane_scene_finish(&panes);
}

static void an_edit_rebuilds_only_the_lights_that_it_reaches(void **state)
{
    (void)state;
    struct pane_scene panes = make_scene();
    const struct view_quality quality = {.shadow_resolution = 64};
    shadow_system_forget(rig.shadows, "panes");
    expect(&panes, no_eye, &quality, 2, 0);
    struct pane pane = panes.panes[0];
    pane.center[0] += 0.1;
    pane_scene_set(&panes, 0, &pane);
    expect(&panes, no_eye, &quality, 1, 1);
    pane.color[0] = 0.9f;
    pane_scene_set(&panes, 0, &pane);
    expect(&panes, no_eye, &quality, 1, 1);
    lamps[1].intensity = 7; /* brightness is no part of a shadow */
    expect(&panes, no_eye, &quality, 0, 2);
    lamps[1].position[1] += 0.5;
    expect(&panes, no_eye, &quality, 1, 1);
    lamps[1].position[1] -= 0.5;
    expect(&panes, no_eye, &quality, 0, 2); /* the old one was kept */
    expect(&panes, no_eye, &(struct view_quality){.shadow_resolution = 32}, 2, 0);
    expect(&panes, no_eye, &quality, 0, 2);
    pane_scene_finish(&panes);
}

static void a_light_gets_no_more_than_its_casters_call_for(void **state)
{
    (void)state;
    struct pane_scene panes = make_scene();
    const struct view_quality quality = {.shadow_resolution = 64};
    shadow_system_forget(rig.shadows, "panes");
    struct pane pane = panes.panes[0];
    pane.is_opaque = true;
    pane_scene_set(&panes, 0, &pane);
    expect(&panes, no_eye, &quality, 2, 0);
    assert_ptr_equal(shadow_system_map(rig.shadows, 0)->method, &shadow_method_map);
    assert_ptr_equal(shadow_system_map(rig.shadows, 1)->method, &shadow_method_deep);
    expect(&panes, no_eye, &(struct view_quality){.shadow_resolution = 64, .shadows = SHADOWS_NONE},
           0, 0);
    assert_string_equal(shadow_system_defines(rig.shadows), "");
    for (uint32_t i = 0; i < 2; i++) { /* no caster left under the first lamp */
        pane.center[0] = 10;
        pane_scene_set(&panes, i, &pane);
    }
    expect(&panes, no_eye, &quality, 1, 0);
    assert_int_equal(shadow_system_record(rig.shadows, 0), NO_SHADOW);
    assert_int_equal(shadow_system_record(rig.shadows, 1), 0);
    pane_scene_finish(&panes);
}

static void the_budget_refuses_with_numbers_and_the_next_request_works(void **state)
{
    (void)state;
    shadow_rig_close(&rig);
    assert_true(shadow_rig_open(&rig, 1 << 20, 0));
    struct pane_scene panes = make_scene();
    struct error err = {0};
    assert_false(
        try_prepare(&panes, 2, no_eye, &(struct view_quality){.shadow_resolution = 1024}, &err));
    assert_int_equal(err.code, ERROR_OVER_BUDGET);
    assert_non_null(strstr(err.message, "1048576"));
    /* each resolution fits alone, not both: the older one makes room */
    for (int round = 0; round < 4; round++) {
        int resolution = round % 2 ? 160 : 176;
        expect(&panes, no_eye, &(struct view_quality){.shadow_resolution = resolution}, 2, 0);
        assert_true(shadow_store_size_bytes(shadow_system_store(rig.shadows)) <= 1 << 20);
        float t[1][4];
        shadow_rig_query(&rig, 0, &(double[3]){-10.1, 1, 0.1}, up, 1, UINT32_MAX, t);
        assert_true(fabsf(t[0][1] - 0.25f) < 1e-6f);
    }
    pane_scene_finish(&panes);
    shadow_rig_close(&rig);
    assert_true(shadow_rig_open(&rig, 0, 0));
}

/* A long run of edits: what nobody asks for again is freed before the pools grow. */
static void edits_leave_no_growing_trail(void **state)
{
    (void)state;
    struct pane_scene panes = make_scene();
    const struct view_quality quality = {.shadow_resolution = 128};
    uint64_t early = 0;
    shadow_system_forget(rig.shadows, "panes");
    for (int edit = 0; edit < 400; edit++) {
        struct pane pane = panes.panes[0];
        pane.center[0] += 1e-4;
        pane_scene_set(&panes, 0, &pane);
        expect(&panes, no_eye, &quality, edit ? 1 : 2, edit ? 1 : 0);
        if (edit == 150)
            early = shadow_system_size_bytes(rig.shadows);
    }
    assert_int_equal(shadow_system_size_bytes(rig.shadows), early);
    pane_scene_finish(&panes);
}

static void a_map_of_one_texel_works(void **state)
{
    (void)state;
    struct pane_scene panes = make_scene();
    expect(&panes, no_eye, &(struct view_quality){.shadow_resolution = 1, .shadow_taps = 16}, 2, 0);
    float t[1][4];
    shadow_rig_query(&rig, 0, &(double[3]){-10, 1, 0}, up, 1, UINT32_MAX, t);
    assert_true(fabsf(t[0][1] - 0.25f) < 1e-6f);
    pane_scene_finish(&panes);
}

static void ranges_merge_and_are_found_again(void **state)
{
    (void)state;
    struct shadow_ranges ranges = {0};
    struct error err = {0};
    struct shadow_range taken[64];
    assert_true(shadow_ranges_grow(&ranges, 6400, &err));
    for (int i = 0; i < 64; i++) {
        assert_true(shadow_ranges_take(&ranges, 100, &taken[i]));
        assert_int_equal(taken[i].first, 100 * i);
    }
    assert_false(shadow_ranges_take(&ranges, 1, &taken[0]));
    assert_int_equal(shadow_ranges_capacity_for(&ranges, 7), 6407);
    uint64_t all = 0;
    assert_true(
        shadow_ranges_capacity_for_all(&ranges, (const uint64_t[]){7, 0, 5}, 3, &all, &err));
    assert_int_equal(all, 6412);
    for (int i = 0; i < 64; i += 2) /* holes first, then what lies between */
        assert_true(shadow_ranges_free(&ranges, &taken[i], &err));
    assert_int_equal(ranges.free_count, 32);
    /* three in the first two holes, one too long for any, one in the third */
    assert_true(shadow_ranges_capacity_for_all(&ranges, (const uint64_t[]){60, 50, 40, 101, 100}, 5,
                                               &all, &err));
    assert_int_equal(all, 6501);
    assert_int_equal(ranges.free_count, 32); /* nothing was taken */
    assert_int_equal(ranges.capacity, 6400);
    for (int i = 1; i < 64; i += 2)
        assert_true(shadow_ranges_free(&ranges, &taken[i], &err));
    assert_int_equal(ranges.free_count, 1);
    assert_int_equal(ranges.free[0].count, 6400);
    shadow_ranges_finish(&ranges);
}

int main(void)
{
    if (!shadow_rig_open(&rig, 0, 0))
        return 77;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_new_camera_rebuilds_nothing),
        cmocka_unit_test(an_edit_rebuilds_only_the_lights_that_it_reaches),
        cmocka_unit_test(a_light_gets_no_more_than_its_casters_call_for),
        cmocka_unit_test(the_budget_refuses_with_numbers_and_the_next_request_works),
        cmocka_unit_test(edits_leave_no_growing_trail),
        cmocka_unit_test(a_map_of_one_texel_works),
        cmocka_unit_test(ranges_merge_and_are_found_again),
    };
    int failures = cmocka_run_group_tests(tests, NULL, NULL);
    shadow_rig_close(&rig);
    return failures;
}
