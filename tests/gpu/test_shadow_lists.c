/* SPDX-License-Identifier: MIT */
/* Lists of deep shadow maps at their extremes: order, coplanar surfaces, ten thousand layers,
 * exclusions, holes. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "shaders/shared/layout.h"
#include "tests/support/shadow_rig.h"

#include "shaders/shared/records.h"

static struct shadow_rig rig;
static const double up[3] = {0, 1, 0};
static const double no_eye[3] = {0, 0, 0};
static const struct view_light sun = {
    .type = SCENE_LIGHT_DIRECTIONAL, .direction = {0, -1, 0}, .color = {1, 1, 1}, .intensity = 1};

static void prepare(const struct pane_scene *panes, const struct view_quality *quality)
{
    struct error err = {0};
    if (!shadow_rig_prepare(&rig, panes, &sun, 1, no_eye, quality, &err))
        fail_msg("%s", err.message);
}

static struct pane level_pane(double height, float r, float g, float b)
{
    return (struct pane){
        .center = {0, height, 0}, .u = {3, 0, 0}, .v = {0, 0, -3}, .color = {r, g, b}};
}

static void ask(double x, double height, double z, uint32_t object, float t[4])
{
    float out[1][4];
    shadow_rig_query(&rig, 0, &(double[3]){x, height, z}, up, 1, object, out);
    memcpy(t, out[0], sizeof out[0]);
}

static uint64_t stream_bytes(const struct shadow_map *map, int stream)
{
    uint64_t media = map->flags & SHADOW_FLAG_MEDIA ? 16 : 0;
    uint64_t objects = map->flags & SHADOW_FLAG_RAW ? 4 : 0;
    uint64_t each = stream == SHADOW_STREAM_EVENT    ? 16
                    : stream == SHADOW_STREAM_MEDIUM ? media
                                                     : objects;
    return map->events.count * each;
}

/* Heads and events of the first light, one after another, and what media and objects there are;
 * caller frees. */
static uint32_t *read_lists(size_t *words)
{
    static const int streams[] = {SHADOW_STREAM_EVENT, SHADOW_STREAM_MEDIUM, SHADOW_STREAM_OBJECT};
    const struct shadow_map *map = shadow_system_map(rig.shadows, 0);
    const struct shadow_store *store = shadow_system_store(rig.shadows);
    assert_non_null(map);
    uint32_t *lists = malloc((map->heads.count + 9 * map->events.count) * sizeof *lists);
    assert_non_null(lists);
    gl_buffer_read(&store->pools[SHADOW_POOL_HEADS].streams[0], map->heads.first * 4,
                   map->heads.count * 4, lists);
    *words = map->heads.count;
    for (size_t i = 0; i < sizeof streams / sizeof *streams; i++) {
        uint64_t bytes = stream_bytes(map, streams[i]), each = bytes / map->events.count;
        if (bytes)
            gl_buffer_read(&store->pools[SHADOW_POOL_EVENTS].streams[streams[i]],
                           map->events.first * each, bytes, lists + *words);
        *words += bytes / 4;
    }
    return lists;
}

static void shuffle(struct pane *panes, int count, uint64_t *seed)
{
    for (int i = count - 1; i > 0; i--) {
        int j = (int)(rig_random(seed) * (i + 1));
        struct pane swapped = panes[i];
        panes[i] = panes[j];
        panes[j] = swapped;
    }
}

struct crowd {
    struct pane panes[512];
    int count;
    bool has_media, has_objects;
};

/* Panes of all list lengths in the corners of the map, many of them coplanar. */
static void make_crowd(struct crowd *crowd, uint64_t *seed)
{
    crowd->count = 0;
    for (int corner = 0; corner < 4; corner++) {
        int layers = corner == 0 ? 3 : corner == 1 ? 20 : corner == 2 ? 45 : 300;
        for (int i = 0; i < layers; i++) {
            struct pane pane = level_pane(i % 3 == 0 ? 2 : 1 + 3 * rig_random(seed),
                                          (float)rig_random(seed), (float)rig_random(seed), 0.5f);
            double half = 0.2 + 0.8 * rig_random(seed);
            pane.center[0] = corner & 1 ? 2 : -2;
            pane.center[2] = corner & 2 ? 2 : -2;
            pane.u[0] = half;
            pane.v[2] = -half;
            if (crowd->has_media && i % 3 == 0) { /* many bodies of one height */
                pane.shape = PANE_BOX;
                memcpy(pane.v, (double[]){0, 0.1 * (1 + i % 4), 0}, sizeof pane.v);
                memcpy(pane.w, (double[]){0, 0, half}, sizeof pane.w);
                memcpy(pane.sigma, (float[]){0.1f, 0.2f, 0.4f}, sizeof pane.sigma);
            }
            pane.no_self_shadow = crowd->has_objects && i % 5 == 0;
            crowd->panes[crowd->count++] = pane;
        }
    }
}

/* By one system or the other: i % 2. */
static uint32_t *lists_of(const struct crowd *crowd, int i, size_t *words)
{
    struct pane_scene panes = {0};
    for (int k = 0; k < crowd->count; k++)
        pane_scene_add(&panes, &crowd->panes[k]);
    rig.shadows = rig.systems[i % 2];
    shadow_system_forget(rig.shadows, "panes");
    prepare(&panes, &(struct view_quality){.shadow_resolution = 100});
    assert_int_equal(rig.report.counts.shadow_maps_built, 1);
    assert_true(rig.report.counts.longest_list > 250);
    pane_scene_finish(&panes);
    return read_lists(words);
}

static void lists_do_not_depend_on_draw_order_or_on_who_scans(void **state)
{
    (void)state;
    static struct crowd crowd;
    uint64_t seed = 3;
    make_crowd(&crowd, &seed);
    uint32_t *first = NULL;
    size_t words = 0;
    for (int round = 0; round < 6; round++) {
        size_t read;
        uint32_t *lists = lists_of(&crowd, round, &read);
        if (!first) {
            first = lists;
            words = read;
        } else {
            assert_int_equal(read, words);
            assert_memory_equal(lists, first, words * sizeof *lists);
            free(lists);
        }
        if (round > 1)
            shuffle(crowd.panes, crowd.count, &seed);
    }
    free(first);
    rig.shadows = rig.systems[0];
}

/* On our own processors events are sorted whole, elsewhere by their depths. */
static void lists_with_media_and_objects_do_not_depend_on_who_sorts(void **state)
{
    (void)state;
    for (int variant = 1; variant < 4; variant++) {
        static struct crowd crowd;
        uint64_t seed = 3;
        size_t words[2];
        uint32_t *lists[2];
        crowd.has_media = variant & 1;
        crowd.has_objects = variant & 2;
        make_crowd(&crowd, &seed);
        for (int i = 0; i < 2; i++)
            lists[i] = lists_of(&crowd, i, &words[i]);
        const struct shadow_map *map = shadow_system_map(rig.shadows, 0);
        assert_int_equal(stream_bytes(map, SHADOW_STREAM_MEDIUM) > 0, crowd.has_media);
        assert_int_equal(stream_bytes(map, SHADOW_STREAM_OBJECT) > 0, crowd.has_objects);
        assert_int_equal(words[0], words[1]);
        assert_memory_equal(lists[0], lists[1], words[0] * sizeof *lists[0]);
        free(lists[0]);
        free(lists[1]);
    }
    rig.shadows = rig.systems[0];
}

static void red_green_blue_in_any_order_give_the_same_bits(void **state)
{
    (void)state;
    static const float colors[3][3] = {
        {0.9f, 0.1f, 0.07f}, {0.13f, 0.83f, 0.21f}, {0.03f, 0.31f, 0.77f}};
    static const int orders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2},
                                     {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    float first[4];
    for (int order = 0; order < 6; order++) {
        struct pane_scene panes = {0};
        for (int i = 0; i < 3; i++) {
            const float *c = colors[orders[order][i]];
            struct pane pane = level_pane(3 - i, c[0], c[1], c[2]);
            pane_scene_add(&panes, &pane);
        }
        prepare(&panes, &(struct view_quality){.shadow_resolution = 64, .shadow_taps = 9});
        float t[4];
        ask(0.3, 0, 0.4, UINT32_MAX, t);
        if (order == 0)
            memcpy(first, t, sizeof t);
        assert_memory_equal(t, first, sizeof t);
        assert_true(fabsf(t[0] - 0.9f * 0.13f * 0.03f) < 1e-7f);
        pane_scene_finish(&panes);
    }
}

static void ten_thousand_layers_in_one_texel_give_the_power(void **state)
{
    (void)state;
    static const float filters[] = {0.999f, 0.5f, 0.9999999f};
    for (int n = 1000; n <= 10000; n *= 10) {
        struct pane_scene panes = {0};
        for (int i = 0; i < n; i++) {
            struct pane pane = level_pane(1 + 3.0 * i / n, filters[0], filters[1], filters[2]);
            pane_scene_add(&panes, &pane);
        }
        prepare(&panes, &(struct view_quality){.shadow_resolution = 8, .shadow_taps = 4});
        assert_int_equal(rig.report.counts.longest_list, n);
        for (int part = 0; part <= 2; part++) {
            float t[4];
            double layers = part * n / 2;
            ask(0.1, 4 - 1.5 * part - 1.5 / n, 0.2, UINT32_MAX, t);
            for (int k = 0; k < 3; k++) {
                double expected = pow((double)filters[k], layers);
                assert_true(fabs((double)t[k] - expected) <= 1e-5 * expected + 1e-38);
            }
        }
        pane_scene_finish(&panes);
    }
}

static void coplanar_panes_all_count(void **state)
{
    (void)state;
    for (int n = 2; n <= 1000; n = n < 600 ? n * 3 : n + 400) {
        struct pane_scene panes = {0};
        uint64_t seed = 9;
        double expected[3] = {1, 1, 1};
        for (int i = 0; i < n; i++) {
            struct pane pane =
                level_pane(2, (float)(1 - rig_random(&seed) / n), (float)rig_random(&seed), 1);
            if (i % 2)
                pane.v[2] = 3; /* the other winding */
            for (int k = 0; k < 3; k++)
                expected[k] *= (double)pane.color[k];
            pane_scene_add(&panes, &pane);
        }
        prepare(&panes, &(struct view_quality){.shadow_resolution = 16, .shadow_taps = 1});
        float below[4], on[4];
        ask(0.1, 1, 0.2, UINT32_MAX, below);
        ask(0.1, 2, 0.2, UINT32_MAX, on);
        for (int k = 0; k < 3; k++) {
            assert_true(fabs((double)below[k] - expected[k]) < 1e-6);
            assert_true(on[k] == 1);
        }
        pane_scene_finish(&panes);
    }
}

static void clear_panes_make_no_event_and_black_ones_stop_their_channels(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    struct pane clear = level_pane(3, 1, 1, 1), red = level_pane(2, 1, 0, 0),
                dark = level_pane(1, 0, 1, 1);
    pane_scene_add(&panes, &clear);
    prepare(&panes, &(struct view_quality){.shadow_resolution = 16});
    assert_int_equal(rig.report.counts.events, 0);
    pane_scene_add(&panes, &red);
    pane_scene_add(&panes, &dark);
    prepare(&panes, &(struct view_quality){.shadow_resolution = 16});
    assert_int_equal(rig.report.counts.longest_list, 2);
    float t[4];
    ask(0.1, 1.5, 0.1, UINT32_MAX, t);
    assert_true(t[0] == 1 && t[1] == 0 && t[2] == 0);
    ask(0.1, 0.5, 0.1, UINT32_MAX, t);
    assert_true(t[0] == 0 && t[1] == 0 && t[2] == 0);
    pane_scene_finish(&panes);
}

static void opaque_casters_cull_what_lies_behind_them(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    for (int i = 0; i < 6; i++) {
        struct pane pane = level_pane(4 - 0.5 * i, 0.5f, 0.5f, 0.5f);
        pane.is_opaque = i == 2;
        pane_scene_add(&panes, &pane);
    }
    prepare(&panes, &(struct view_quality){.shadow_resolution = 16});
    assert_int_equal(rig.report.counts.longest_list, 2);
    float t[4];
    ask(0.1, 3, 0.1, UINT32_MAX, t); /* on the opaque pane */
    assert_true(t[0] == 0.25f);
    ask(0.1, 2.9, 0.1, UINT32_MAX, t);
    assert_true(t[0] == 0);
    prepare(&panes, &(struct view_quality){.shadow_resolution = 16, .shadows = SHADOWS_MAP});
    assert_int_equal(rig.report.counts.events, 0);
    ask(0.1, 3, 0.1, UINT32_MAX, t);
    assert_true(t[0] == 1);
    ask(0.1, 2.9, 0.1, UINT32_MAX, t);
    assert_true(t[0] == 0);
    pane_scene_finish(&panes);
}

static void no_self_shadow_leaves_out_the_receivers_own_events(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    for (int i = 0; i < 300; i++) { /* more objects than eight bits tell apart */
        struct pane pane = level_pane(4 - 0.01 * i, 0.99f, 0.5f + 0.001f * (float)i, 1);
        pane.no_self_shadow = i == 7;
        pane_scene_add(&panes, &pane);
    }
    prepare(&panes, &(struct view_quality){.shadow_resolution = 16});
    float all[4], others[4], wrong[4];
    ask(0.1, 0.5, 0.1, UINT32_MAX, all);
    ask(0.1, 0.5, 0.1, 7, others);
    ask(0.1, 0.5, 0.1, 7 + 256, wrong);
    assert_true(fabsf(all[0] / others[0] - 0.99f) < 1e-5f);
    /* The query names the object, whoever it is. */
    assert_true(fabsf(all[0] / wrong[0] - 0.99f) < 1e-5f);
    ask(0.1, 3.95, 0.1, 200, others);
    ask(0.1, 3.95, 0.1, UINT32_MAX, all);
    /* An object behind the receiver changes nothing. */
    assert_memory_equal(all, others, sizeof all);
    pane_scene_finish(&panes);
}

static void cast_once_counts_neighbouring_events_of_an_object_once(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    struct pane pane = level_pane(3, 0.5f, 0.5f, 0.5f), other = level_pane(2.5, 0.5f, 0.5f, 0.5f);
    pane.cast_once = true;
    uint32_t node = pane_scene_add(&panes, &pane);
    pane_scene_add(&panes, &other);
    /* the object again, as further primitives of its mesh cannot be had here: three nodes share the
     * light's ray only when drawn as one, so the mesh gets the quad three times over */
    static const uint32_t thrice[18] = {0, 1, 2, 0, 2, 3, 0, 1, 2, 0, 2, 3, 0, 1, 2, 0, 2, 3};
    panes.scene.indices = thrice;
    panes.scene.index_count = 18;
    panes.primitives[node].index_count = 18;
    prepare(&panes, &(struct view_quality){.shadow_resolution = 16});
    assert_int_equal(rig.report.counts.longest_list, 4);
    float t[4];
    ask(0.1, 2.75, 0.1, UINT32_MAX, t);
    assert_true(t[0] == 0.5f);
    ask(0.1, 1, 0.1, UINT32_MAX, t);
    assert_true(t[0] == 0.25f);
    pane_scene_finish(&panes);
}

static void holes_of_textured_panes_let_light_through(void **state)
{
    (void)state;
    for (int blended = 0; blended < 2; blended++) {
        struct pane_scene panes = {0};
        struct pane pane = level_pane(2, 0.25f, 0.5f, 0);
        pane.is_checkered = true;
        pane.is_blended = blended;
        pane.is_opaque = !blended;
        pane_scene_add(&panes, &pane);
        prepare(&panes, &(struct view_quality){.shadow_resolution = 64, .shadow_taps = 1});
        float hole[4], glass[4];
        ask(1.5, 1, -1.5, UINT32_MAX, glass); /* b grows along -z */
        ask(1.5, 1, 1.5, UINT32_MAX, hole);
        assert_true(hole[0] == 1 && hole[1] == 1 && hole[2] == 1);
        /* Alpha 1 lets nothing through. */
        assert_true(glass[0] == 0 && glass[1] == 0 && glass[2] == 0);
        if (blended) { /* holes make no event: half of the map has none */
            assert_int_equal(rig.report.counts.longest_list, 1);
            assert_int_in_range(rig.report.counts.events, 1500, 2300);
        }
        pane_scene_finish(&panes);
    }
}

int main(void)
{
    if (!shadow_rig_open(&rig, 0, 0))
        return 77;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lists_do_not_depend_on_draw_order_or_on_who_scans),
        cmocka_unit_test(lists_with_media_and_objects_do_not_depend_on_who_sorts),
        cmocka_unit_test(red_green_blue_in_any_order_give_the_same_bits),
        cmocka_unit_test(ten_thousand_layers_in_one_texel_give_the_power),
        cmocka_unit_test(coplanar_panes_all_count),
        cmocka_unit_test(clear_panes_make_no_event_and_black_ones_stop_their_channels),
        cmocka_unit_test(opaque_casters_cull_what_lies_behind_them),
        cmocka_unit_test(no_self_shadow_leaves_out_the_receivers_own_events),
        cmocka_unit_test(cast_once_counts_neighbouring_events_of_an_object_once),
        cmocka_unit_test(holes_of_textured_panes_let_light_through),
    };
    int failures = cmocka_run_group_tests(tests, NULL, NULL);
    shadow_rig_close(&rig);
    return failures;
}
