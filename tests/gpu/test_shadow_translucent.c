/* SPDX-License-Identifier: MIT */
/* Translucent shadow maps: right above and behind all transparent casters, and behind the first of
 * several the product of all of them, as published. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/shadows/shadow_map.h"
#include "tests/support/shadow_rig.h"

enum { POINTS = 1500 };
static struct shadow_rig rig;
static const double up[3] = {0, 1, 0};
static double points[POINTS][3];
static float found[POINTS][4], again[POINTS][4];

static void prepare(const struct pane_scene *panes, enum shadow_technique shadows, int taps)
{
    const struct view_quality quality = {
        .shadows = shadows, .shadow_resolution = 96, .shadow_taps = taps};
    shadow_rig_prepare_lamps(&rig, panes, &quality);
}

static void ask(uint32_t light, uint32_t count, float (*out)[4])
{
    shadow_rig_ask(&rig, light, (const double(*)[3])points, count, out);
}

static void add_sheet(struct pane_scene *panes, double y, float r, float g, float b)
{
    pane_scene_add_sheet(panes, y, (const float[3]){r, g, b});
}

/* Every light, every width of the tent, one face after the other and all faces at once. */
static void receivers_behind_all_panes_get_the_product(void **state)
{
    (void)state;
    static const int taps[] = {1, 4, 64};
    struct pane_scene panes = {0};
    double largest = 0;
    struct pane floor = {.center = {0, -3, 0}, .u = {5, 0, 0}, .v = {0, 0, 5}, .is_opaque = true};
    pane_scene_add_random(&panes, 16, 5);
    pane_scene_add(&panes, &floor);
    rig_random_points(points, POINTS, 3, -2, 0);
    for (int s = 0; s < 2; s++) {
        rig.shadows = rig.systems[s];
        for (int t = 0; t < 3; t++) {
            prepare(&panes, SHADOWS_TRANSLUCENT, taps[t]);
            for (uint32_t light = 0; light < SHADOW_RIG_LAMPS; light++) {
                int compared = 0;
                ask(light, POINTS, found);
                for (int i = 0; i < POINTS; i++) {
                    double expected[3];
                    if (!shadow_rig_model(&rig, light, points[i], up, expected))
                        continue;
                    compared++;
                    for (int k = 0; k < 3; k++)
                        largest = fmax(largest, fabs((double)found[i][k] - expected[k]));
                }
                assert_true(compared > (taps[t] == 64 ? 20 : POINTS / 2)); /* off all edges */
            }
        }
    }
    rig.shadows = rig.systems[0];
    print_message("largest error %.3g\n", largest);
    assert_true(largest <= 1e-5);
    pane_scene_finish(&panes);
}

static void expect_at(uint32_t light, double y, const double expected[3])
{
    for (int i = 0; i < 9; i++) {
        points[i][0] = 0.3 * (i % 3) - 0.3;
        points[i][1] = y;
        points[i][2] = 0.3 * (double)(i / 3) - 0.3;
    }
    ask(light, 9, found);
    for (int i = 0; i < 9; i++)
        for (int k = 0; k < 3; k++)
            if (fabs((double)found[i][k] - expected[k]) > 1e-6)
                fail_msg("light %u at height %g: channel %d is %.8g instead of %.8g", light, y, k,
                         (double)found[i][k], expected[k]);
}

/* The known limitation, exactly there and only there. */
static void transparent_surfaces_behind_the_first_get_the_product_of_all(void **state)
{
    (void)state;
    const double one[3] = {1, 1, 1}, first[3] = {0.5, 0.25, 1};
    const double all[3] = {0.5 * 0.75, 0.25 * 0.5, 0.125};
    struct pane_scene panes = {0};
    add_sheet(&panes, 2, 0.5f, 0.25f, 1);
    add_sheet(&panes, 1, 0.75f, 0.5f, 0.125f);
    for (uint32_t light = 0; light < SHADOW_RIG_LAMPS; light++) {
        prepare(&panes, SHADOWS_TRANSLUCENT, 4);
        expect_at(light, 2.5, one);
        expect_at(light, 2, one); /* its own filter does not apply */
        expect_at(light, 1.5, all);
        expect_at(light, 1, all);
        expect_at(light, 0, all);
        prepare(&panes, SHADOWS_DEEP, 4);
        expect_at(light, 1.5, first);
        expect_at(light, 1, first);
        expect_at(light, 0, all);
    }
    pane_scene_finish(&panes);
}

/* As published, surfaces are blended over each other from the light on: blue glass behind red glass
 * adds blue, in whichever order they are drawn, where the product lets hardly any light pass. */
static void the_published_form_adds_colours_and_the_default_does_not(void **state)
{
    (void)state;
    const double red[3] = {0.9, 0.1, 0.1}, both[3] = {0.09, 0.01, 0.09};
    const double blue_over_red[3] = {0.09, 0.01, 0.8 + 0.1 * 0.1};
    for (int is_turned = 0; is_turned < 2; is_turned++) {
        struct pane_scene panes = {0};
        struct view_quality quality = {
            .shadows = SHADOWS_TRANSLUCENT, .shadow_resolution = 96, .shadow_taps = 4};
        for (int i = 0; i < 2; i++)
            if (i == is_turned)
                add_sheet(&panes, 2, 0.9f, 0.1f, 0.1f);
            else
                add_sheet(&panes, 1, 0.1f, 0.1f, 0.9f);
        for (int s = 0; s < 2; s++) {
            rig.shadows = rig.systems[s];
            quality.faithful = true;
            shadow_rig_prepare_lamps(&rig, &panes, &quality);
            for (uint32_t light = 0; light < SHADOW_RIG_LAMPS; light++)
                expect_at(light, 0, blue_over_red);
            quality.faithful = false;
            shadow_rig_prepare_lamps(&rig, &panes, &quality);
            for (uint32_t light = 0; light < SHADOW_RIG_LAMPS; light++)
                expect_at(light, 0, both);
        }
        rig.shadows = rig.systems[0];
        pane_scene_finish(&panes);
    }
    struct pane_scene one = {0};
    add_sheet(&one, 2, 0.9f, 0.1f, 0.1f);
    shadow_rig_prepare_lamps(&rig, &one,
                             &(struct view_quality){.shadows = SHADOWS_TRANSLUCENT,
                                                    .faithful = true,
                                                    .shadow_resolution = 96});
    for (uint32_t light = 0; light < SHADOW_RIG_LAMPS; light++)
        expect_at(light, 0, red); /* a single one is right */
    pane_scene_finish(&one);
}

static void an_opaque_surface_between_panes_gets_those_before_it(void **state)
{
    (void)state;
    const double first[3] = {0.5, 0.25, 1}, none[3] = {0, 0, 0};
    struct pane_scene panes = {0};
    struct pane wall = {.center = {0, 1.5, 0}, .u = {3, 0, 0}, .v = {0, 0, 3}, .is_opaque = true};
    add_sheet(&panes, 1, 0.75f, 0.5f, 0.125f);
    add_sheet(&panes, 2, 0.5f, 0.25f, 1);
    pane_scene_add(&panes, &wall);
    prepare(&panes, SHADOWS_TRANSLUCENT, 4);
    for (uint32_t light = 0; light < SHADOW_RIG_LAMPS; light++) {
        expect_at(light, 1.5, first);
        expect_at(light, 0.5, none);
    }
    pane_scene_finish(&panes);
}

static void extremes_are_exact(void **state)
{
    (void)state;
    static const float filters[] = {0, 1, 0.999f};
    for (int i = 0; i < 3; i++) {
        struct pane_scene panes = {0};
        double expected[3];
        for (int n = 0; n < 100; n++)
            add_sheet(&panes, 1 + 0.01 * n, filters[i], filters[i], 1);
        prepare(&panes, SHADOWS_TRANSLUCENT, 4);
        expected[0] = expected[1] = pow((double)filters[i], 100);
        expected[2] = 1;
        for (uint32_t light = 0; light < SHADOW_RIG_LAMPS; light++)
            expect_at(light, 0, expected);
        pane_scene_finish(&panes);
    }
}

static void the_order_of_the_casters_does_not_matter(void **state)
{
    (void)state;
    struct pane_scene panes = {0}, turned = {0};
    pane_scene_add_random(&panes, 30, 8);
    for (uint32_t i = panes.count; i-- > 0;)
        pane_scene_add(&turned, &panes.panes[i]);
    rig_random_points(points, POINTS, 3, -2, 6);
    for (uint32_t light = 0; light < SHADOW_RIG_LAMPS; light++) {
        prepare(&panes, SHADOWS_TRANSLUCENT, 1);
        ask(light, POINTS, found);
        shadow_system_forget(rig.shadows, "panes");
        prepare(&panes, SHADOWS_TRANSLUCENT, 1);
        ask(light, POINTS, again);
        assert_memory_equal(found, again, sizeof found);
        prepare(&turned, SHADOWS_TRANSLUCENT, 1);
        ask(light, POINTS, again);
        for (int i = 0; i < POINTS; i++)
            for (int k = 0; k < 3; k++)
                assert_float_equal(found[i][k], again[i][k], 1e-6f);
    }
    pane_scene_finish(&panes);
    pane_scene_finish(&turned);
}

static void a_map_that_stands_is_reused_and_its_memory_is_told(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    uint64_t bytes = 0;
    add_sheet(&panes, 1, 0.75f, 0.5f, 0.125f);
    prepare(&panes, SHADOWS_TRANSLUCENT, 4);
    assert_int_equal(rig.report.counts.shadow_maps_built, SHADOW_RIG_LAMPS);
    for (size_t i = 0; i < (size_t)rig.report.byte_count; i++)
        if (!strcmp(rig.report.bytes[i].structure, "shadow.texels"))
            bytes = rig.report.bytes[i].bytes;
    assert_int_equal(bytes, 16ull * 96 * 96 * 8); /* a sun, a spot and six faces */
    prepare(&panes, SHADOWS_TRANSLUCENT, 4);
    assert_int_equal(rig.report.counts.shadow_maps_built, 0);
    assert_int_equal(rig.report.counts.shadow_maps_reused, SHADOW_RIG_LAMPS);
    pane_scene_finish(&panes);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(receivers_behind_all_panes_get_the_product),
        cmocka_unit_test(transparent_surfaces_behind_the_first_get_the_product_of_all),
        cmocka_unit_test(the_published_form_adds_colours_and_the_default_does_not),
        cmocka_unit_test(an_opaque_surface_between_panes_gets_those_before_it),
        cmocka_unit_test(extremes_are_exact),
        cmocka_unit_test(the_order_of_the_casters_does_not_matter),
        cmocka_unit_test(a_map_that_stands_is_reused_and_its_memory_is_told),
    };
    if (!shadow_rig_open(&rig, 0, 0))
        return 77;
    int failures = cmocka_run_group_tests(tests, NULL, NULL);
    shadow_rig_close(&rig);
    return failures;
}
