/* SPDX-License-Identifier: MIT */
/* Composited shadow maps: each of several transparent meshes gets the light that those nearer to
 * the light let through, whatever they are, and none of a mesh's own shadow. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/shadows/shadow_map.h"
#include "renderer/shadows/shadow_partitions.h"
#include "renderer/shadows/shadows.h"
#include "tests/support/shadow_rig.h"

enum { POINTS = 40 };
static struct shadow_rig rig;
static const double up[3] = {0, 1, 0};
static const uint32_t opaque = UINT32_MAX; /* what asks for no mesh */

static struct view_quality asked(enum shadow_technique shadows, bool faithful)
{
    return (struct view_quality){
        .shadows = shadows, .faithful = faithful, .shadow_resolution = 96, .shadow_taps = 4};
}

static void prepare(const struct pane_scene *panes, enum shadow_technique shadows, bool faithful)
{
    const struct view_quality quality = asked(shadows, faithful);
    shadow_rig_prepare_lamps(&rig, panes, &quality);
}

static void expect_at(uint32_t light, double y, uint32_t object, const double expected[3])
{
    double points[9][3];
    float found[9][4];
    for (int i = 0; i < 9; i++) {
        points[i][0] = 0.3 * (i % 3) - 0.3;
        points[i][1] = y;
        points[i][2] = 0.3 * (double)(i / 3) - 0.3;
    }
    shadow_rig_query(&rig, light, (const double(*)[3])points, up, 9, object, found);
    for (int i = 0; i < 9; i++)
        for (int k = 0; k < 3; k++)
            if (fabs((double)found[i][k] - expected[k]) > 1e-6)
                fail_msg("light %u at height %g: channel %d is %.8g instead of %.8g", light, y, k,
                         (double)found[i][k], expected[k]);
}

static uint32_t layers_of(uint32_t light)
{
    return shadow_system_map(rig.shadows, light)->layers;
}

static bool has_warning(const char *text)
{
    for (int i = 0; i < rig.report.warning_count; i++)
        if (strstr(rig.report.warnings[i], text))
            return true;
    return false;
}

enum { SHEETS = 4 };
static const float colors[SHEETS][3] = {
    {0.5f, 0.25f, 1}, {0.75f, 0.5f, 0.125f}, {0.25f, 1, 0.5f}, {1, 0.5f, 0.75f}};

/* Drawn in an order that is not theirs. */
static const int order[SHEETS] = {2, 0, 3, 1};

static void each_layer_gets_exactly_the_layers_nearer_to_the_light(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    uint32_t nodes[SHEETS];
    for (int i = 0; i < SHEETS; i++)
        nodes[order[i]] = pane_scene_add_sheet(&panes, 4 - 0.9 * order[i], colors[order[i]]);
    for (int form = 0; form < 4; form++) {
        rig.shadows = rig.systems[form / 2];
        prepare(&panes, SHADOWS_COMPOSITED, form % 2);
        for (uint32_t light = 0; light < SHADOW_RIG_LAMPS; light++) {
            double product[3] = {1, 1, 1};
            for (int i = 0; i < SHEETS; i++) {
                expect_at(light, 4 - 0.9 * i, nodes[i], product);
                for (int k = 0; k < 3; k++)
                    product[k] *= (double)colors[i][k];
            }
            expect_at(light, 0, opaque, product);
            assert_int_equal(layers_of(light), SHEETS);
        }
        assert_false(has_warning("composited"));
    }
    rig.shadows = rig.systems[0];
    /* which one colour for all of them fails */
    prepare(&panes, SHADOWS_TRANSLUCENT, false);
    expect_at(0, 4 - 0.9, nodes[1], (const double[3]){0.5 * 0.75 * 0.25, 0.0625, 0.046875});
    pane_scene_finish(&panes);
}

/* Level panes at heights of their own, some over others, and points a little above each of them;
 * off its edges, where a texel may be its neighbour's. */
static void scattered_panes_agree_with_the_model_from_few_partitions(void **state)
{
    (void)state;
    enum { PANES = 120 };
    struct pane_scene panes = {0};
    uint64_t seed = 3;
    double largest = 0;
    int compared = 0;
    for (int i = 0; i < PANES; i++) {
        double half = 0.2 + 0.4 * rig_random(&seed);
        struct pane pane = {.center = {6 * rig_random(&seed) - 3, 1 + 0.05 * (i * 37 % PANES),
                                       6 * rig_random(&seed) - 3},
                            .u = {half, 0, 0},
                            .v = {0, 0, half},
                            .is_opaque = i % 10 == 3};
        for (int k = 0; k < 3; k++)
            pane.color[k] = 0.1f + 0.9f * (float)rig_random(&seed);
        pane_scene_add(&panes, &pane);
    }
    shadow_rig_prepare_lamps(&rig, &panes,
                             &(struct view_quality){.shadows = SHADOWS_COMPOSITED,
                                                    .shadow_resolution = 256,
                                                    .shadow_taps = 1});
    for (uint32_t light = 0; light < SHADOW_RIG_LAMPS; light++) {
        print_message("light %u: %u partitions\n", light, layers_of(light));
        assert_true(layers_of(light) < PANES / 4);
        for (uint32_t i = 0; i < PANES; i++) {
            const struct pane *pane = &panes.panes[i];
            double points[POINTS][3];
            float found[POINTS][4];
            double half = pane->u[0] - 0.1;
            for (int p = 0; p < POINTS; p++) {
                points[p][0] = pane->center[0] + half * (2 * rig_random(&seed) - 1);
                points[p][1] = pane->center[1] + 1e-3;
                points[p][2] = pane->center[2] + half * (2 * rig_random(&seed) - 1);
            }
            shadow_rig_query(&rig, light, (const double(*)[3])points, up, POINTS,
                             pane->is_opaque ? opaque : i, found);
            for (int p = 0; p < POINTS; p++) {
                double expected[3];
                if (!shadow_rig_model(&rig, light, points[p], up, expected))
                    continue;
                compared++;
                for (int k = 0; k < 3; k++)
                    largest = fmax(largest, fabs((double)found[p][k] - expected[k]));
            }
        }
    }
    print_message("%d points, largest error %.3g\n", compared, largest);
    assert_true(compared > SHADOW_RIG_LAMPS * PANES * POINTS / 2);
    assert_true(largest <= 1e-5);
    pane_scene_finish(&panes);
}

/* Where deep lists have its front darken its back; and only there. */
static void a_mesh_casts_no_shadow_on_itself(void **state)
{
    (void)state;
    const double one[3] = {1, 1, 1}, once[3] = {0.5, 0.25, 1}, twice[3] = {0.25, 0.0625, 1};
    struct pane_scene panes = {0};
    uint32_t box = pane_scene_add(&panes, &(struct pane){.shape = PANE_BOX,
                                                         .center = {0, 2, 0},
                                                         .u = {3, 0, 0},
                                                         .v = {0, 0, -3},
                                                         .w = {0, 1, 0},
                                                         .color = {0.5f, 0.25f, 1}});
    for (uint32_t light = 0; light < SHADOW_RIG_LAMPS; light++) {
        prepare(&panes, SHADOWS_COMPOSITED, false);
        expect_at(light, 3, box, one);
        expect_at(light, 1, box, one);
        expect_at(light, 0, opaque, twice);
        assert_int_equal(layers_of(light), 1);
        prepare(&panes, SHADOWS_DEEP, false);
        expect_at(light, 3, box, one);
        expect_at(light, 1, opaque, once);
        expect_at(light, 0, opaque, twice);
    }
    pane_scene_finish(&panes);
}

static void meshes_beside_each_other_share_a_partition(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    struct error err = {0};
    const double no_eye[3] = {0, 0, 0};
    const struct view_quality faithful = asked(SHADOWS_COMPOSITED, true);
    for (int i = 0; i < 3 * 10 * 10; i++)
        pane_scene_add(&panes, &(struct pane){.center = {i % 10 - 4.5, 1 + 0.5 * (double)(i / 100),
                                                         i / 10 % 10 - 4.5},
                                              .u = {0.2, 0, 0},
                                              .v = {0, 0, 0.2},
                                              .color = {0.5f, 0.5f, 0.5f}});
    prepare(&panes, SHADOWS_COMPOSITED, false);
    for (uint32_t light = 0; light < SHADOW_RIG_LAMPS; light++)
        assert_int_equal(layers_of(light), 3);
    assert_false(shadow_rig_prepare(&rig, &panes, shadow_rig_lamps, SHADOW_RIG_LAMPS, no_eye,
                                    &faithful, &err));
    assert_int_equal(err.code, ERROR_UNSUPPORTED);
    assert_string_equal(err.message, "light 0: 300 transparent meshes, the limit is 256 where each "
                                     "has a partition: leave out faithful, and they share "
                                     "partitions");
    pane_scene_finish(&panes);
}

/* Pairs of more would take seconds to compare. */
static void more_meshes_than_the_limit_are_refused(void **state)
{
    (void)state;
    const double no_eye[3] = {0, 0, 0};
    const struct view_quality quality = asked(SHADOWS_COMPOSITED, false);
    struct pane_scene panes = {0};
    struct error err = {0};
    for (int i = 0; i <= (int)SHADOW_PARTITION_MESHES_MAX; i++)
        pane_scene_add(&panes, &(struct pane){.center = {0.1 * (i % 64) - 3.2, 2,
                                                         0.1 * (double)(i / 64) - 3.2},
                                              .u = {0.04, 0, 0},
                                              .v = {0, 0, 0.04},
                                              .color = {0.5f, 0.5f, 0.5f}});
    assert_false(shadow_rig_prepare(&rig, &panes, shadow_rig_lamps, SHADOW_RIG_LAMPS, no_eye,
                                    &quality, &err));
    assert_int_equal(err.code, ERROR_UNSUPPORTED);
    assert_string_equal(err.message, "light 0: 4097 transparent meshes, the limit of composited "
                                     "shadows is 4096");
    pane_scene_finish(&panes);
}

static void more_partitions_than_the_limit_are_one_with_a_warning(void **state)
{
    (void)state;
    enum { MANY = 300 };
    struct pane_scene panes = {0};
    double all = pow(0.99, MANY), last = pow(0.99, SHADOW_PARTITIONS_MAX - 1);
    for (int i = 0; i < MANY; i++)
        pane_scene_add_sheet(&panes, 4 - 0.01 * i, (const float[3]){0.99f, 1, 1});
    shadow_rig_prepare_lamps(&rig, &panes,
                             &(struct view_quality){.shadows = SHADOWS_COMPOSITED,
                                                    .shadow_resolution = 16,
                                                    .shadow_taps = 1});
    assert_true(has_warning("composited: 3 of 3 lights need more than 256 partitions, one of them "
                            "300: meshes behind the last but one cast no shadow on each other"));
    for (uint32_t light = 0; light < SHADOW_RIG_LAMPS; light++) {
        assert_int_equal(layers_of(light), SHADOW_PARTITIONS_MAX);
        expect_at(light, 4 - 0.01 * (MANY - 1), MANY - 1, (const double[3]){last, 1, 1});
        expect_at(light, 0, opaque, (const double[3]){all, 1, 1});
    }
    pane_scene_finish(&panes);
}

/* One nearer to the light on one side, the other on the other. */
static void meshes_that_cross_are_told_of(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    for (int i = -1; i <= 1; i += 2)
        pane_scene_add(&panes, &(struct pane){.center = {0, 2, 0},
                                              .u = {2, 0.5 * i, 0},
                                              .v = {0, 0, 2},
                                              .color = {0.5f, 0.5f, 0.5f}});
    prepare(&panes, SHADOWS_COMPOSITED, false);
    assert_true(
        has_warning("composited: 3 of 3 lights see transparent meshes whose depths overlap, "
                    "one of them 1: their middles order them"));
    for (uint32_t light = 0; light < SHADOW_RIG_LAMPS; light++)
        expect_at(light, 0, opaque, (const double[3]){0.25, 0.25, 0.25});
    pane_scene_finish(&panes);
}

static void a_map_that_stands_is_reused_and_its_memory_is_told(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    uint64_t bytes = 0;
    for (int i = 0; i < SHEETS; i++)
        pane_scene_add_sheet(&panes, 4 - 0.9 * i, colors[i]);
    prepare(&panes, SHADOWS_COMPOSITED, false);
    assert_int_equal(rig.report.counts.shadow_maps_built, SHADOW_RIG_LAMPS);
    for (size_t i = 0; i < (size_t)rig.report.byte_count; i++)
        if (!strcmp(rig.report.bytes[i].structure, "shadow.texels"))
            bytes = rig.report.bytes[i].bytes;
    assert_int_equal(bytes, SHEETS * 16ull * 96 * 96 * 8); /* a sun, a spot and six faces */
    prepare(&panes, SHADOWS_COMPOSITED, false);
    assert_int_equal(rig.report.counts.shadow_maps_built, 0);
    expect_at(0, 4 - 0.9, 1, (const double[3]){0.5, 0.25, 1});
    pane_scene_finish(&panes);
}

static void layers_beyond_the_budget_are_refused_by_their_bytes(void **state)
{
    (void)state;
    const double no_eye[3] = {0, 0, 0};
    const struct view_quality quality = asked(SHADOWS_COMPOSITED, false);
    struct pane_scene panes = {0};
    struct error err = {0};
    for (int i = 0; i < SHEETS; i++)
        pane_scene_add_sheet(&panes, 4 - 0.9 * i, colors[i]);
    shadow_rig_close(&rig);
    assert_true(shadow_rig_open(&rig, 4 << 20, 0));
    assert_false(shadow_rig_prepare(&rig, &panes, shadow_rig_lamps, SHADOW_RIG_LAMPS, no_eye,
                                    &quality, &err));
    assert_int_equal(err.code, ERROR_OVER_BUDGET);
    assert_non_null(strstr(err.message, "the budget is 4194304 bytes"));
    shadow_rig_close(&rig);
    assert_true(shadow_rig_open(&rig, 0, 0));
    pane_scene_finish(&panes);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_layer_gets_exactly_the_layers_nearer_to_the_light),
        cmocka_unit_test(scattered_panes_agree_with_the_model_from_few_partitions),
        cmocka_unit_test(a_mesh_casts_no_shadow_on_itself),
        cmocka_unit_test(meshes_beside_each_other_share_a_partition),
        cmocka_unit_test(more_meshes_than_the_limit_are_refused),
        cmocka_unit_test(more_partitions_than_the_limit_are_one_with_a_warning),
        cmocka_unit_test(meshes_that_cross_are_told_of),
        cmocka_unit_test(a_map_that_stands_is_reused_and_its_memory_is_told),
        cmocka_unit_test(layers_beyond_the_budget_are_refused_by_their_bytes),
    };
    if (!shadow_rig_open(&rig, 0, 0))
        return 77;
    int failures = cmocka_run_group_tests(tests, NULL, NULL);
    shadow_rig_close(&rig);
    return failures;
}
