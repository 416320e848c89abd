/* SPDX-License-Identifier: MIT */
/* The keys beside the events of deep shadow maps: what they are, and that searches by them end at
 * the right event, in lists of every length and wherever keys cannot tell events apart. */
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

enum { SIDE = 11, CELLS = SIDE * SIDE, LONGEST = CELLS - 1 };

static struct shadow_rig rig;
static const double up[3] = {0, 1, 0};
static const double no_eye[3] = {0, 0, 0};
static const double LAMP_Y = 10;
static const double CELL = 0.1;   /* at a distance of 1 m along the axis */
static const double CLUMP = 3e-4; /* between neighbours; a key is twenty times as much */
static const double APART = 1e-4; /* of receivers from panes; rounding is a fifth */
static const struct view_light lamp = {.type = SCENE_LIGHT_SPOT,
                                       .position = {0, 10, 0},
                                       .direction = {0, -1, 0},
                                       .color = {1, 1, 1},
                                       .intensity = 1,
                                       .outer_cone_deg = 40};

struct cell_pane {
    double distance; /* along the axis [m] */
    float color[3];
};

/* Cell n has n panes, the odd ones a hair behind each other; random order. */
static struct cell_pane cells[CELLS][LONGEST];

static void cell_place(int cell, double distance, double out[3])
{
    int column = cell % SIDE - SIDE / 2, row = cell / SIDE - SIDE / 2;
    out[0] = column * CELL * distance;
    out[1] = LAMP_Y - distance;
    out[2] = row * CELL * distance;
}

static void make_cells(struct pane_scene *panes, int count)
{
    uint64_t seed = 5;
    for (int cell = 0; cell < count; cell++) {
        for (int i = 0; i < cell; i++) {
            struct cell_pane *p = &cells[cell][(i * 127 + cell) % cell];
            int pair = i / 2;
            p->distance = i % 2 ? 1 + CLUMP * pair : 0.5 + rig_random(&seed);
            struct pane pane = {.u = {0.4 * CELL * p->distance, 0, 0},
                                .v = {0, 0, -0.4 * CELL * p->distance}};
            for (int k = 0; k < 3; k++)
                p->color[k] = pane.color[k] = (float)(0.93 + 0.06 * rig_random(&seed));
            cell_place(cell, p->distance, pane.center);
            pane_scene_add(panes, &pane);
        }
    }
    struct pane far_away = {
        .center = {0, -200, 0}, .u = {1, 0, 0}, .v = {0, 0, -1}, .color = {0.5f, 0.5f, 0.5f}};
    pane_scene_add(panes, &far_away); /* makes a key 6 mm long */
}

static void prepare(const struct pane_scene *panes)
{
    struct error err = {0};
    struct view_quality quality = {.shadow_resolution = 512, .shadow_taps = 1};
    if (!shadow_rig_prepare(&rig, panes, &lamp, 1, no_eye, &quality, &err))
        fail_msg("%s", err.message);
}

/* False where rounding may decide. */
static bool expect(int cell, double distance, double product[3])
{
    for (int k = 0; k < 3; k++)
        product[k] = 1;
    for (int i = 0; i < cell; i++) {
        const struct cell_pane *p = &cells[cell][i];
        if (fabs(p->distance - distance) < APART)
            return false;
        for (int k = 0; k < 3 && p->distance < distance; k++)
            product[k] *= (double)p->color[k];
    }
    return true;
}

static int compare_cell(int cell, uint64_t *seed)
{
    enum { ASKED = 24 };
    double points[ASKED][3], distances[ASKED], expected[3];
    float t[ASKED][4];
    int compared = 0;
    for (int i = 0; i < ASKED; i++) {
        distances[i] = i % 2   ? 1 + CLUMP * (floor(rig_random(seed) * cell / 2) - 0.5)
                       : i < 4 ? 0.4 + i
                               : 0.5 + rig_random(seed);
        cell_place(cell, distances[i], points[i]);
    }
    shadow_rig_query(&rig, 0, (const double(*)[3])points, up, ASKED, UINT32_MAX, t);
    for (int i = 0; i < ASKED; i++) {
        if (!expect(cell, distances[i], expected))
            continue;
        compared++;
        for (int k = 0; k < 3; k++)
            if (!(fabs((double)t[i][k] - expected[k]) <= 1e-6))
                fail_msg("%d panes, %.9g m, channel %d: %.9g, not %.9g", cell, distances[i], k,
                         (double)t[i][k], expected[k]);
    }
    return compared;
}

/* Cells with fewer panes than `count`: whether keys are asked depends on the longest list. */
static void check_lists(int count, bool has_keys)
{
    struct pane_scene panes = {0};
    uint64_t seed = 9;
    int compared = 0;
    make_cells(&panes, count);
    prepare(&panes);
    assert_int_equal(rig.report.counts.longest_list, count - 1);
    assert_int_equal(strstr(shadow_system_defines(rig.shadows), "HAS_LONG") != NULL, has_keys);
    for (int cell = 0; cell < count; cell++)
        compared += compare_cell(cell, &seed);
    assert_true(compared > count * 20);
    pane_scene_finish(&panes);
}

static void lists_of_every_length_answer_between_their_events(void **state)
{
    (void)state;
    check_lists(CELLS, true);
}

static void short_lists_answer_without_keys(void **state)
{
    (void)state;
    check_lists(16, false);
    check_lists(17, true);
}

static uint32_t *read_pool(enum shadow_pool_kind kind, int stream, uint64_t offset, uint64_t bytes)
{
    const struct shadow_store *store = shadow_system_store(rig.shadows);
    uint32_t *words = malloc(bytes);
    assert_non_null(words);
    gl_buffer_read(&store->pools[kind].streams[stream], offset, bytes, words);
    return words;
}

static uint32_t key_of(uint32_t depth_bits, float keys_per_m)
{
    float depth;
    memcpy(&depth, &depth_bits, sizeof depth);
    return (uint32_t)fminf(depth * keys_per_m, SHADOW_KEY_MOST);
}

static void two_keys_to_a_word_stand_beside_all_events_but_the_first(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    make_cells(&panes, CELLS);
    prepare(&panes);
    const struct shadow_map *map = shadow_system_map(rig.shadows, 0);
    assert_non_null(map);
    uint32_t *heads = read_pool(SHADOW_POOL_HEADS, 0, map->heads.first * 4, map->heads.count * 4);
    uint32_t *events = read_pool(SHADOW_POOL_EVENTS, SHADOW_STREAM_EVENT, map->events.first * 16,
                                 map->events.count * 16);
    uint32_t *keys = read_pool(SHADOW_POOL_EVENTS, SHADOW_STREAM_KEYS, 0,
                               4 * ((map->events.first + map->events.count) / 2));
    uint64_t checked = 0;
    for (uint64_t texel = 0; texel + 1 < map->heads.count; texel++) {
        uint32_t first = heads[texel], n = heads[texel + 1] - first;
        const uint32_t *own = keys + SHADOW_KEYS_AT(map->events.first + first);
        for (uint32_t i = 1; i < n; i++, checked++)
            assert_int_equal(own[(i - 1) / 2] >> ((i - 1) % 2 * 16) & 0xffff,
                             key_of(events[4 * (first + i)], map->keys_per_m));
        if (n > 0 && n % 2 == 0)
            assert_int_equal(own[n / 2 - 1] >> 16, SHADOW_KEY_NONE);
    }
    assert_true(checked > 100000);
    free(heads);
    free(events);
    free(keys);
    pane_scene_finish(&panes);
}

int main(void)
{
    if (!shadow_rig_open(&rig, 0, 0))
        return 77;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lists_of_every_length_answer_between_their_events),
        cmocka_unit_test(short_lists_answer_without_keys),
        cmocka_unit_test(two_keys_to_a_word_stand_beside_all_events_but_the_first),
    };
    int failures = cmocka_run_group_tests(tests, NULL, NULL);
    shadow_rig_close(&rig);
    return failures;
}
