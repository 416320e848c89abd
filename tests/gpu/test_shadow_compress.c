/* SPDX-License-Identifier: MIT */
/* Compressed deep shadow maps against the exact lists that they stand for: the error that was asked
 * for holds everywhere, nothing grows brighter with depth, and the same bits come out however they
 * are built. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/base/matrix.h"
#include "renderer/shadows/shadow_compress.h"
#include "tests/support/shadow_rig.h"

enum { POINTS = 6000, LAMPS = 3 };

static struct shadow_rig rig;
static const double up[3] = {0, 1, 0}, no_eye[3] = {0, 0, 0};
static const struct view_light lamps[LAMPS] = {
    {.type = SCENE_LIGHT_DIRECTIONAL,
     .direction = {0.1, -1, 0.05},
     .color = {1, 1, 1},
     .intensity = 1},
    {.type = SCENE_LIGHT_POINT, .position = {0.1, 3, 0.2}, .color = {1, 1, 1}, .intensity = 1},
    {.type = SCENE_LIGHT_SPOT,
     .position = {0.1, 10, 0.2},
     .direction = {0, -1, 0},
     .color = {1, 1, 1},
     .intensity = 1,
     .outer_cone_deg = 30},
};

static void prepare(const struct pane_scene *panes, const struct view_quality *quality)
{
    struct error err = {0};
    if (!shadow_rig_prepare(&rig, panes, lamps, LAMPS, no_eye, quality, &err))
        fail_msg("%s", err.message);
}

static double symmetric(uint64_t *seed)
{
    return 2 * rig_random(seed) - 1;
}

/* Layers of light colours (many small steps), panes of strong ones, opaque ones, media. */
static void add_random(struct pane_scene *panes, int count, bool has_media, uint64_t *seed)
{
    for (int i = 0; i < count; i++) {
        struct pane pane = {.is_opaque = i % 16 == 15};
        double size = pane.is_opaque ? 0.3 : 2;
        bool is_faint = i % 3 != 0;
        for (int k = 0; k < 3; k++) {
            pane.center[k] = 2.5 * symmetric(seed) + (k == 1 ? 1 : 0);
            pane.u[k] = size * symmetric(seed);
            pane.v[k] = size * symmetric(seed);
            pane.color[k] = (float)(is_faint ? 1 - 0.05 * rig_random(seed) : rig_random(seed));
        }
        if (has_media && i % 4 == 1) {
            pane.shape = PANE_BOX;
            for (int k = 0; k < 3; k++) {
                pane.u[k] = k == 0 ? 0.2 + rig_random(seed) : 0;
                pane.v[k] = k == 1 ? 0.2 + rig_random(seed) : 0;
                pane.w[k] = k == 2 ? 0.2 + rig_random(seed) : 0;
                pane.sigma[k] = (float)(rig_random(seed) * (i % 8 == 1 ? 30 : 1));
                pane.color[k] = 1;
            }
        }
        pane_scene_add(panes, &pane);
    }
}

static void ask(double (*points)[3], float (*out)[4], uint32_t light)
{
    shadow_rig_query(&rig, light, (const double(*)[3])points, up, POINTS, UINT32_MAX, out);
}

static double largest_difference(float (*a)[4], float (*b)[4])
{
    double most = 0;
    for (int i = 0; i < POINTS; i++)
        for (int k = 0; k < 3; k++)
            most = fmax(most, fabs((double)a[i][k] - (double)b[i][k]));
    return most;
}

struct probes {
    double points[POINTS][3];
    float exact[LAMPS][POINTS][4], other[POINTS][4];
};

static struct probes *random_probes(uint64_t *seed)
{
    struct probes *probes = calloc(1, sizeof *probes);
    assert_non_null(probes);
    for (int i = 0; i < POINTS;) {
        double *p = probes->points[i];
        for (int k = 0; k < 3; k++)
            p[k] = 3 * symmetric(seed) + (k == 1 ? 1 : 0);
        /* None at grazing light. */
        i += fabs(p[1] - lamps[1].position[1]) > 0.3 * hypot(p[0], p[2]);
    }
    return probes;
}

static void no_answer_is_farther_off_than_was_asked_for(void **state)
{
    (void)state;
    static const double errors[] = {0.001, 0.005, 0.02, 0.05, 0.5};
    double shares[5] = {0}, worst[5] = {0};
    for (int scene = 0; scene < 8; scene++) {
        uint64_t seed = (uint64_t)scene + 1;
        struct pane_scene panes = {0};
        add_random(&panes, scene % 3 == 0 ? 150 : 12, scene % 2, &seed);
        struct probes *probes = random_probes(&seed);
        struct view_quality quality = {.shadow_resolution = 48, .shadow_taps = scene % 4 ? 1 : 4};
        prepare(&panes, &quality);
        for (uint32_t light = 0; light < LAMPS; light++)
            ask(probes->points, probes->exact[light], light);
        for (int e = 0; e < 5; e++) {
            quality.shadow_compression = errors[e];
            prepare(&panes, &quality);
            for (uint32_t light = 0; light < LAMPS; light++) {
                ask(probes->points, probes->other, light);
                double most = largest_difference(probes->exact[light], probes->other);
                const struct shadow_map *map = shadow_system_map(rig.shadows, light);
                worst[e] = fmax(worst[e], most);
                if (most > errors[e] + 1e-6)
                    fail_msg("scene %d, light %u, error %g: off by %.9g", scene, light, errors[e],
                             most);
                assert_true(map->compression == errors[e]);
                assert_int_equal(map->built_windows, 1);
                shares[e] += (double)map->event_count / (double)map->exact_events / 24;
            }
        }
        free(probes);
        pane_scene_finish(&panes);
    }
    for (int e = 0; e < 5; e++)
        print_message("error %g: %.3f nodes per event, off by %.3g\n", errors[e], shares[e],
                      worst[e]);
    assert_true(shares[2] < 1 && shares[3] < 0.7 && worst[3] > worst[1]);
}

/* Along the rays of texels: what is farther from the light is never brighter. */
static void light_never_grows_with_depth(void **state)
{
    (void)state;
    uint64_t seed = 77;
    struct pane_scene panes = {0};
    add_random(&panes, 120, true, &seed);
    struct probes *probes = random_probes(&seed);
    enum { RAYS = 60, STEPS = POINTS / RAYS };
    for (int ray = 0; ray < RAYS; ray++) { /* of the sun; the normal is that of the light's way */
        double x = 2 * symmetric(&seed), z = 2 * symmetric(&seed);
        for (int i = 0; i < STEPS; i++) {
            double way = 8.0 * i / STEPS;
            memcpy(probes->points[ray * STEPS + i],
                   (double[]){x + 0.1 * way, 5 - way, z + 0.05 * way}, sizeof probes->points[0]);
        }
    }
    for (int k = 1; k <= 3; k += 2) {
        struct view_quality quality = {.shadow_resolution = 64,
                                       .shadow_taps = 1,
                                       .shadow_compression = 0.02,
                                       .shadow_prefilter = k};
        prepare(&panes, &quality);
        shadow_rig_query(&rig, 0, (const double(*)[3])probes->points, (double[]){-0.1, 1, -0.05},
                         POINTS, UINT32_MAX, probes->other);
        int falls = 0;
        for (int i = 0; i + 1 < POINTS; i++)
            for (int c = 0; c < 3 && (i + 1) % STEPS; c++) {
                assert_true(probes->other[i][c] >= 0 && probes->other[i][c] <= 1);
                if (probes->other[i + 1][c] > probes->other[i][c] + 1e-6f)
                    fail_msg("%d samples: %.9g, then %.9g", k, (double)probes->other[i][c],
                             (double)probes->other[i + 1][c]);
                falls += probes->other[i + 1][c] < probes->other[i][c];
            }
        assert_true(falls > 500);
    }
    free(probes);
    pane_scene_finish(&panes);
}

struct nodes {
    uint32_t *heads;
    float *events;
    uint64_t head_count, event_count;
};

static struct nodes read_nodes(uint32_t light)
{
    const struct shadow_map *map = shadow_system_map(rig.shadows, light);
    const struct shadow_store *store = shadow_system_store(rig.shadows);
    struct nodes nodes = {.head_count = map->heads.count, .event_count = map->events.count};
    nodes.heads = malloc(4 * nodes.head_count + 1);
    nodes.events = malloc(16 * nodes.event_count + 1);
    assert_true(nodes.heads && nodes.events);
    gl_buffer_read(&store->pools[SHADOW_POOL_HEADS].streams[0], 4 * map->heads.first,
                   4 * nodes.head_count, nodes.heads);
    gl_buffer_read(&store->pools[SHADOW_POOL_EVENTS].streams[SHADOW_STREAM_EVENT],
                   16 * map->events.first, 16 * nodes.event_count, nodes.events);
    return nodes;
}

/* A1 within the error, and few strong panes without any: each is one node. */
static void parallel_panes_keep_their_closed_form(void **state)
{
    (void)state;
    for (int k = 1; k <= 4; k++) {
        struct pane_scene panes = {0};
        for (int i = 0; i < 4; i++) {
            struct pane pane = {.center = {0, 4 - i, 0},
                                .u = {3, 0.2 * i, 0},
                                .v = {0, 0.1 * i, -3},
                                .color = {0.5f, 0.25f, 0.75f}};
            pane_scene_add(&panes, &pane);
        }
        struct view_quality quality = {.shadow_resolution = 64,
                                       .shadow_taps = 4,
                                       .shadow_compression = 0.001,
                                       .shadow_prefilter = k};
        prepare(&panes, &quality);
        for (uint32_t light = 0; light < LAMPS; light += 2) /* the lamp is between them */
            assert_int_equal(shadow_system_map(rig.shadows, light)->longest_list, 4);
        for (int i = 0; i <= 4; i++) { /* between them, and on each: it does not shadow itself */
            for (int is_on = 0; is_on < 2; is_on++) {
                double x = 0.3, z = -0.2, y = 4 - i + 0.2 * i / 3 * x - 0.1 * i / 3 * z;
                double n[3] = {-0.2 * i / 3, 1, 0.1 * i / 3}, point[1][3] = {{x, y, z}};
                float t[1][4];
                point[0][1] += is_on && i < 4 ? 0 : 0.3;
                shadow_rig_query(&rig, 0, (const double(*)[3])point, n, 1, UINT32_MAX, t);
                for (int c = 0; c < 3; c++) {
                    double expected = pow((double)panes.panes[0].color[c], i);
                    if (fabs((double)t[0][c] - expected) > 0.001 + 1e-6)
                        fail_msg("%d samples, after %d panes: %.9g", k, i, (double)t[0][c]);
                }
            }
        }
        pane_scene_finish(&panes);
    }
}

static void free_nodes(struct nodes *nodes)
{
    free(nodes->heads);
    free(nodes->events);
}

static void same_nodes(const struct nodes *a, const struct nodes *b)
{
    assert_int_equal(a->head_count, b->head_count);
    assert_int_equal(a->event_count, b->event_count);
    assert_memory_equal(a->heads, b->heads, 4 * a->head_count);
    assert_memory_equal(a->events, b->events, 16 * a->event_count);
}

/* Scans on both devices, casters in reverse order, once more: the same words. */
static void nodes_are_the_same_bits_every_time(void **state)
{
    (void)state;
    struct nodes first[LAMPS] = {{0}};
    for (int k = 1; k <= 2; k++) {
        for (int round = 0; round < 4; round++) {
            uint64_t seed = 5;
            struct pane_scene panes = {0}, reversed = {0};
            add_random(&panes, 60, true, &seed);
            for (uint32_t i = panes.count; i-- > 0;)
                pane_scene_add(&reversed, &panes.panes[i]);
            struct view_quality quality = {
                .shadow_resolution = 40, .shadow_compression = 0.01, .shadow_prefilter = k};
            rig.shadows = rig.systems[round == 1];
            shadow_system_forget(rig.shadows, "panes");
            prepare(round == 2 ? &reversed : &panes, &quality);
            assert_int_equal(rig.report.counts.shadow_maps_built, LAMPS);
            for (uint32_t light = 0; light < LAMPS; light++) {
                struct nodes nodes = read_nodes(light);
                if (round) {
                    same_nodes(&nodes, &first[light]);
                    free_nodes(&nodes);
                } else {
                    free_nodes(&first[light]);
                    first[light] = nodes;
                }
            }
            pane_scene_finish(&panes);
            pane_scene_finish(&reversed);
        }
    }
    rig.shadows = rig.systems[0];
    for (int i = 0; i < LAMPS; i++)
        free_nodes(&first[i]);
}

/* A system of its own, whose structures may take so much. */
static void use_budget(uint64_t bytes)
{
    struct error err = {0};
    rig.shadows =
        shadow_system_create(&(struct shadow_system_desc){.programs = rig.programs,
                                                          .timeline = rig.timeline,
                                                          .limits = gl_context_limits(rig.context),
                                                          .budget_bytes = bytes},
                             &err);
    assert_non_null(rig.shadows);
}

static void drop_budget(void)
{
    shadow_system_destroy(rig.shadows);
    rig.shadows = rig.systems[0];
}

/* Where all exact lists at once exceed the budget the map is built in windows of its rows: the same
 * words. */
static void little_memory_means_more_windows_and_the_same_lists(void **state)
{
    (void)state;
    uint64_t seed = 31;
    struct pane_scene panes = {0};
    add_random(&panes, 200, false, &seed);
    struct probes *probes = random_probes(&seed);
    struct view_quality quality = {
        .shadow_resolution = 96, .shadow_compression = 0.02, .shadow_prefilter = 2};
    prepare(&panes, &quality);
    uint64_t whole = rig.report.compression.nodes;
    assert_int_equal(rig.report.compression.windows, LAMPS);
    for (uint32_t light = 0; light < LAMPS; light++)
        ask(probes->points, probes->exact[light], light);
    struct error err = {0};
    uint64_t budget = whole * 2 * SHADOW_NODE_BYTES + (6u << 20);
    assert_true(budget < rig.report.compression.exact_bytes / 2);
    use_budget(budget);
    if (!shadow_rig_prepare(&rig, &panes, lamps, LAMPS, no_eye, &quality, &err))
        fail_msg("%s", err.message);
    assert_true(rig.report.compression.windows > LAMPS);
    print_message("%d windows\n", (int)rig.report.compression.windows);
    assert_true(shadow_system_size_bytes(rig.shadows) <= budget);
    assert_int_equal(rig.report.compression.nodes, whole);
    for (uint32_t light = 0; light < LAMPS; light++) {
        shadow_rig_query(&rig, light, (const double(*)[3])probes->points, up, POINTS, UINT32_MAX,
                         probes->other);
        assert_memory_equal(probes->other, probes->exact[light], sizeof probes->other);
    }
    drop_budget();
    free(probes);
    pane_scene_finish(&panes);
}

/* With an error allowed, what exceeds the budget is compressed, and says so; without, refused. */
static void over_budget_is_compressed_where_an_error_is_allowed(void **state)
{
    (void)state;
    uint64_t seed = 32;
    struct pane_scene panes = {0};
    add_random(&panes, 200, false, &seed);
    struct probes *probes = random_probes(&seed);
    struct view_quality quality = {.shadow_resolution = 128};
    prepare(&panes, &quality);
    for (uint32_t light = 0; light < LAMPS; light++)
        ask(probes->points, probes->exact[light], light);
    struct error err = {0};
    use_budget(20u << 20);
    assert_false(shadow_rig_prepare(&rig, &panes, lamps, LAMPS, no_eye, &quality, &err));
    assert_int_equal(err.code, ERROR_OVER_BUDGET);
    quality.shadow_error_allowed = 0.05;
    for (int frame = 0; frame < 3; frame++) {
        err = (struct error){0};
        if (!shadow_rig_prepare(&rig, &panes, lamps, LAMPS, no_eye, &quality, &err))
            fail_msg("%s", err.message);
        assert_int_equal(rig.report.counts.shadow_maps_built, frame ? 0 : LAMPS);
        assert_int_equal(rig.report.compression.maps, LAMPS);
        assert_true(rig.report.compression.max_error == 0.05);
        assert_int_equal(rig.report.warning_count, 1);
        assert_non_null(strstr(rig.report.warnings[0], "budget"));
    }
    for (uint32_t light = 0; light < LAMPS; light++) {
        shadow_rig_query(&rig, light, (const double(*)[3])probes->points, up, POINTS, UINT32_MAX,
                         probes->other);
        assert_true(largest_difference(probes->other, probes->exact[light]) < 0.05 + 1e-6);
    }
    quality.shadow_resolution = 32; /* what fits stays exact */
    if (!shadow_rig_prepare(&rig, &panes, lamps, LAMPS, no_eye, &quality, &err))
        fail_msg("%s", err.message);
    assert_int_equal(rig.report.compression.maps, 0);
    assert_int_equal(rig.report.warning_count, 0);
    drop_budget();
    free(probes);
    pane_scene_finish(&panes);
}

/* Lists that leave objects out need each event: they stay as they are, with a warning. */
static void lists_with_objects_stay_exact(void **state)
{
    (void)state;
    uint64_t seed = 33;
    struct pane_scene panes = {0};
    add_random(&panes, 20, false, &seed);
    panes.panes[3].no_self_shadow = true;
    struct view_quality quality = {.shadow_resolution = 32, .shadow_compression = 0.02};
    prepare(&panes, &quality);
    assert_int_equal(rig.report.compression.maps, 0);
    assert_int_equal(rig.report.warning_count, 1);
    assert_non_null(strstr(rig.report.warnings[0], "3 of 3 lights"));
    pane_scene_finish(&panes);
}

int main(void)
{
    if (!shadow_rig_open(&rig, 0, 0))
        return 77;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_answer_is_farther_off_than_was_asked_for),
        cmocka_unit_test(light_never_grows_with_depth),
        cmocka_unit_test(parallel_panes_keep_their_closed_form),
        cmocka_unit_test(nodes_are_the_same_bits_every_time),
        cmocka_unit_test(little_memory_means_more_windows_and_the_same_lists),
        cmocka_unit_test(over_budget_is_compressed_where_an_error_is_allowed),
        cmocka_unit_test(lists_with_objects_stay_exact),
    };
    int failures = cmocka_run_group_tests(tests, NULL, NULL);
    shadow_rig_close(&rig);
    return failures;
}
