/* SPDX-License-Identifier: MIT */
/* Linked shadow lists, corrected and as published, with locks and without, against the default form
 * and against their own model. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/shadows/shadow_map.h"
#include "tests/support/shadow_rig.h"

static struct shadow_rig rig;
static const double up[3] = {0, 1, 0};
static const double no_eye[3] = {0, 0, 0};
enum { LAMPS = SHADOW_RIG_LAMPS, POINTS = 3000 };

static void prepare(const struct pane_scene *panes, enum shadow_technique shadows, bool faithful)
{
    const struct view_quality quality = {
        .shadows = shadows, .faithful = faithful, .shadow_resolution = 96, .shadow_taps = 1};
    shadow_rig_prepare_lamps(&rig, panes, &quality);
}

static double points[POINTS][3];
static float first[POINTS][4], second[POINTS][4];

static void ask(uint32_t light, float (*out)[4])
{
    shadow_rig_ask(&rig, light, (const double(*)[3])points, POINTS, out);
}

static double largest_difference(void)
{
    double largest = 0;
    for (int i = 0; i < POINTS; i++)
        for (int k = 0; k < 3; k++)
            largest = fmax(largest, fabs((double)first[i][k] - (double)second[i][k]));
    return largest;
}

static void corrected_lists_agree_with_the_default_form(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    pane_scene_add_random(&panes, 60, 5);
    rig_random_points(points, POINTS, 3, 0, 6);
    for (uint32_t light = 0; light < LAMPS; light++) {
        prepare(&panes, SHADOWS_DEEP, false);
        uint64_t events = rig.report.counts.events, longest = rig.report.counts.longest_list;
        ask(light, first);
        prepare(&panes, SHADOWS_DEEP_LINKED, false);
        assert_int_equal(rig.report.counts.events, events);
        assert_int_equal(rig.report.counts.longest_list, longest);
        ask(light, second);
        /* half a step of unorm16 per layer */
        assert_true(largest_difference() <= 0.5 / 65535 * (double)longest + 1e-6);
    }
    pane_scene_finish(&panes);
}

/* The published form quantises to eight bits; with colours already on those steps, its model is the
 * product itself. */
static void faithful_lists_agree_with_the_quantised_model(void **state)
{
    (void)state;
    struct pane_scene panes = {0}, quantised = {0};
    pane_scene_add_random(&panes, 60, 6);
    for (uint32_t i = 0; i < panes.count; i++) {
        struct pane pane = panes.panes[i];
        for (int k = 0; k < 3; k++)
            pane.color[k] = roundf(pane.color[k] * 255) / 255;
        pane_scene_add(&quantised, &pane);
    }
    prepare(&panes, SHADOWS_DEEP_LINKED, true);
    rig.panes = &quantised;
    rig_random_points(points, POINTS, 3, 0, 6);
    for (uint32_t light = 0; light < LAMPS; light++) {
        int compared = 0;
        ask(light, first);
        for (int i = 0; i < POINTS; i++) {
            double expected[3];
            if (!shadow_rig_model(&rig, light, points[i], up, expected))
                continue;
            compared++;
            for (int k = 0; k < 3; k++)
                assert_true(fabs((double)first[i][k] - expected[k]) < 1e-6);
        }
        assert_true(compared > POINTS / 2);
    }
    pane_scene_finish(&panes);
    pane_scene_finish(&quantised);
}

static void the_sources_worked_example_holds_in_every_form_and_order(void **state)
{
    (void)state;
    static const float filters[3] = {0.8f, 0.6f, 0.4f}; /* in steps of 1/255 and 1/65535, too */
    static const double depths[3] = {0.2, 0.35, 0.5};
    static const int orders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2},
                                     {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    for (int form = 0; form < 3; form++) {
        for (int order = 0; order < 6; order++) {
            struct pane_scene panes = {0};
            for (int i = 0; i < 3; i++) {
                int which = orders[order][i];
                float c = filters[which];
                pane_scene_add(&panes, &(struct pane){.center = {0, 1 - depths[which], 0},
                                                      .u = {1, 0, 0},
                                                      .v = {0, 0, -1},
                                                      .color = {c, c, c}});
            }
            prepare(&panes, form ? SHADOWS_DEEP_LINKED : SHADOWS_DEEP, form == 2);
            static const double heights[4] = {0.4, 0.5, 0.65, 0.9};
            static const float expected[4] = {0.8f * 0.6f * 0.4f, 0.8f * 0.6f, 0.8f, 1};
            for (int i = 0; i < 4; i++) {
                float t[1][4];
                shadow_rig_query(&rig, 0, &(double[3]){0.01, heights[i], 0.02}, up, 1, UINT32_MAX,
                                 t);
                assert_true(fabsf(t[0][0] - expected[i]) < 1e-6f);
            }
            pane_scene_finish(&panes);
        }
    }
}

static void an_opaque_caster_in_front_ends_a_faithful_list(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    for (int i = 0; i < 5; i++) { /* drawn back to front: the last one unlinks what is behind it */
        double half = i == 4 ? 3 : 1;
        struct pane pane = {.center = {0, 1 + i, 0},
                            .u = {half, 0, 0},
                            .v = {0, 0, -half},
                            .color = {0.5f, 0.5f, 0.5f},
                            .is_opaque = i == 4};
        pane_scene_add(&panes, &pane);
    }
    prepare(&panes, SHADOWS_DEEP_LINKED, true);
    assert_int_equal(rig.report.counts.longest_list, 1);
    float t[2][4];
    shadow_rig_query(&rig, 0, (const double[2][3]){{0, 4.5, 0}, {0, 5.5, 0}}, up, 2, UINT32_MAX, t);
    assert_true(t[0][0] == 0 && t[1][0] == 1);
    pane_scene_finish(&panes);
}

static void exclusions_hold_in_linked_lists(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    pane_scene_add(&panes, &(struct pane){.center = {0, 2, 0},
                                          .u = {1, 0, 0},
                                          .v = {0, 0, -1},
                                          .color = {0.8f, 0.8f, 0.8f},
                                          .cast_once = true});
    pane_scene_add(&panes, &(struct pane){.center = {0, 1, 0},
                                          .u = {1, 0, 0},
                                          .v = {0, 0, -1},
                                          .color = {0.6f, 0.6f, 0.6f},
                                          .no_self_shadow = true});
    static const uint32_t twice[12] = {0, 1, 2, 0, 2, 3, 0, 1, 2, 0, 2, 3};
    panes.scene.indices = twice;
    panes.scene.index_count = 12;
    panes.primitives[0].index_count = 12; /* the first object is crossed twice */
    for (int faithful = 0; faithful < 2; faithful++) {
        prepare(&panes, SHADOWS_DEEP_LINKED, faithful);
        float t[1][4];
        shadow_rig_query(&rig, 0, &(double[3]){0, 0.5, 0}, up, 1, UINT32_MAX, t);
        assert_true(fabsf(t[0][0] - 0.48f) < 1e-5f);
        shadow_rig_query(&rig, 0, &(double[3]){0, 0.5, 0}, up, 1, 1, t);
        assert_true(fabsf(t[0][0] - 0.8f) < 1e-5f);
    }
    pane_scene_finish(&panes);
}

static void a_pool_of_one_element_grows_until_the_lists_are_the_same(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    pane_scene_add_random(&panes, 60, 7);
    rig_random_points(points, POINTS, 3, 0, 6);
    prepare(&panes, SHADOWS_DEEP_LINKED, false);
    ask(1, first);
    uint64_t events = rig.report.counts.events;
    shadow_rig_close(&rig);
    assert_true(shadow_rig_open(&rig, 0, 1));
    prepare(&panes, SHADOWS_DEEP_LINKED, false);
    ask(1, second);
    assert_int_equal(rig.report.counts.events, events);
    assert_true(largest_difference() == 0);
    pane_scene_finish(&panes);
}

/* A light that moves takes the room that its map had, not a guess; and where a guess has none, the
 * lists tell how much they need. */
static void the_room_of_lists_follows_what_they_had(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    struct error err = {0};
    struct view_light lamp = shadow_rig_lamps[0];
    const struct view_quality quality = {.shadows = SHADOWS_DEEP_LINKED, .shadow_resolution = 256};
    pane_scene_add_random(&panes, 6, 8);
    shadow_rig_close(&rig);
    assert_true(shadow_rig_open(&rig, 0, 0));
    assert_true(shadow_rig_prepare(&rig, &panes, &lamp, 1, no_eye, &quality, &err));
    assert_int_equal(shadow_system_map(rig.shadows, 0)->expected_nodes, 0);
    uint64_t nodes = shadow_system_map(rig.shadows, 0)->nodes.count;
    assert_int_in_range(nodes, 1000, 65536 - 1);
    lamp.direction[0] += 0.01;
    assert_true(shadow_rig_prepare(&rig, &panes, &lamp, 1, no_eye, &quality, &err));
    assert_int_equal(shadow_system_map(rig.shadows, 0)->expected_nodes, nodes);
    shadow_rig_close(&rig);
    /* depths, heads and the target take 768 KiB, a guess of one a texel 1 MiB */
    assert_true(shadow_rig_open(&rig, (768 << 10) + 16 * 2 * nodes, 0));
    if (!shadow_rig_prepare(&rig, &panes, &lamp, 1, no_eye, &quality, &err))
        fail_msg("%s", err.message);
    pane_scene_finish(&panes);
}

static const char *lock_warning(void)
{
    for (int i = 0; i < rig.report.warning_count; i++)
        if (strstr(rig.report.warnings[i], "found no lock"))
            return rig.report.warnings[i];
    return NULL;
}

static float locked[LAMPS][POINTS][4];

/* The lists of light 1, or of all lights, after their elements got no locks, against those with
 * locks: in the order of drawing on our own cores, so equal to the bit. */
static void check_refused(const struct pane_scene *panes, uint64_t refused, uint64_t room)
{
    const char *expected = refused == 2 ? "of 1 lights" : "of 3 lights";
    shadow_rig_close(&rig);
    assert_true(shadow_rig_open_without_locks(&rig, 0, room, refused));
    for (int system = 0; system < 2; system++) {
        rig.shadows = rig.systems[system];
        for (int again = 0; again < 2; again++) { /* the lists are kept, and so is the warning */
            prepare(panes, SHADOWS_DEEP_LINKED, true);
            assert_non_null(lock_warning());
            assert_non_null(strstr(lock_warning(), expected));
            assert_int_equal(rig.report.counts.shadow_maps_built, again ? 0 : LAMPS);
        }
        for (uint32_t light = 0; light < LAMPS; light++) {
            ask(light, second);
            assert_memory_equal(second, locked[light], sizeof second);
        }
        prepare(panes, SHADOWS_DEEP_LINKED, false); /* has no locks that could be refused */
        assert_null(lock_warning());
    }
}

static void a_light_without_locks_is_made_again_with_the_same_lists_and_a_warning(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    pane_scene_add_random(&panes, 60, 9);
    /* equal depths, one of them opaque, and what casts once */
    for (uint32_t i = 0; i < 12; i++) {
        struct pane pane = panes.panes[i];
        pane.is_opaque = i % 4 == 3;
        pane.cast_once = i % 3 == 0;
        pane.color[i % 3] *= 0.5f;
        pane_scene_add(&panes, &pane);
    }
    rig_random_points(points, POINTS, 3, 0, 6);
    shadow_rig_close(&rig);
    assert_true(shadow_rig_open(&rig, 0, 0));
    prepare(&panes, SHADOWS_DEEP_LINKED, true);
    assert_null(lock_warning());
    for (uint32_t light = 0; light < LAMPS; light++)
        ask(light, locked[light]);
    check_refused(&panes, 2, 0);
    check_refused(&panes, 2, 1);
    check_refused(&panes, UINT64_MAX, 0);
    shadow_rig_close(&rig);
    assert_true(shadow_rig_open(&rig, 0, 0));
    pane_scene_finish(&panes);
}

/* llvmpipe 22.3 ends loops after 65,535 steps without a word: an element that would lie behind as
 * many is missed. Other devices get there, and have lists too long for shading. */
static void lists_longer_than_a_loop_are_refused(void **state)
{
    (void)state;
    enum { QUADS = 66000 };
    static const uint32_t corners[6] = {0, 1, 2, 0, 2, 3};
    static uint32_t many[6 * QUADS];
    struct pane_scene panes = {0};
    for (int i = 0; i < 6 * QUADS; i++)
        many[i] = corners[i % 6];
    for (int k = 0; k < 2; k++) /* the nearer one first, and often */
        pane_scene_add(&panes, &(struct pane){.center = {0, 2 - k, 0},
                                              .u = {1, 0, 0},
                                              .v = {0, 0, -1},
                                              .color = {0.8f, 0.8f, 0.8f}});
    panes.scene.indices = many;
    panes.scene.index_count = 6 * QUADS;
    panes.primitives[0].index_count = 6 * QUADS;
    for (int faithful = 0; faithful < 2; faithful++) {
        struct error err = {0};
        const struct view_quality quality = {.shadows = SHADOWS_DEEP_LINKED,
                                             .faithful = faithful,
                                             .shadow_resolution = 1,
                                             .shadow_taps = 1};
        assert_false(shadow_rig_prepare(&rig, &panes, shadow_rig_lamps, 1, no_eye, &quality, &err));
        assert_non_null(strstr(err.message, "linked lists"));
    }
    pane_scene_finish(&panes);
}

int main(void)
{
    if (!shadow_rig_open(&rig, 0, 0))
        return 77;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(corrected_lists_agree_with_the_default_form),
        cmocka_unit_test(faithful_lists_agree_with_the_quantised_model),
        cmocka_unit_test(the_sources_worked_example_holds_in_every_form_and_order),
        cmocka_unit_test(an_opaque_caster_in_front_ends_a_faithful_list),
        cmocka_unit_test(exclusions_hold_in_linked_lists),
        cmocka_unit_test(a_pool_of_one_element_grows_until_the_lists_are_the_same),
        cmocka_unit_test(the_room_of_lists_follows_what_they_had),
        cmocka_unit_test(a_light_without_locks_is_made_again_with_the_same_lists_and_a_warning),
        cmocka_unit_test(lists_longer_than_a_loop_are_refused),
    };
    int failures = cmocka_run_group_tests(tests, NULL, NULL);
    shadow_rig_close(&rig);
    return failures;
}
