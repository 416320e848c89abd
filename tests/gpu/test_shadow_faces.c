/* SPDX-License-Identifier: MIT */
/* The faces of lights, drawn in one pass, are those that are drawn one after the other; and what
 * this asks of GL does not grow with the lights. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/shadows/technique.h"
#include "shaders/shared/layout.h"
#include "tests/support/gl_counts.h"
#include "tests/support/shadow_rig.h"

#include "shaders/shared/records.h"

enum { LAMPS = 20, SIDE = 64, PANES = 24 };

static struct shadow_rig rig;
static const double no_eye[3] = {0, 0, 0};

/* Panes of all kinds all around, some of them opaque, with holes, boxes of a medium. */
static void make_room(struct pane_scene *panes)
{
    uint64_t seed = 11;
    for (int i = 0; i < PANES; i++) {
        struct pane pane = {.shape = i % 6 == 5 ? PANE_BOX : PANE_FLAT,
                            .is_opaque = i % 6 == 0,
                            .is_checkered = i % 6 == 1 || i % 12 == 0,
                            .is_blended = i % 6 == 2};
        for (int k = 0; k < 3; k++) {
            pane.center[k] = 6 * rig_random(&seed) - 3;
            pane.u[k] = rig_random(&seed) - 0.5;
            pane.v[k] = rig_random(&seed) - 0.5;
            pane.color[k] = (float)rig_random(&seed);
            pane.sigma[k] = pane.shape == PANE_BOX ? 0.5f : 0;
        }
        pane.w[0] = pane.u[1] * pane.v[2] - pane.u[2] * pane.v[1];
        pane.w[1] = pane.u[2] * pane.v[0] - pane.u[0] * pane.v[2];
        pane.w[2] = pane.u[0] * pane.v[1] - pane.u[1] * pane.v[0];
        pane_scene_add(panes, &pane);
    }
}

/* Cubes, and among them lights of one face. */
static void make_lamps(struct view_light lamps[LAMPS])
{
    uint64_t seed = 5;
    for (int i = 0; i < LAMPS; i++) {
        lamps[i] = shadow_rig_lamps[i % 4 ? 1 : i ? 2 : 0];
        for (int k = 0; k < 3; k++)
            lamps[i].position[k] = 2 * rig_random(&seed) - 1;
    }
}

static void prepare(const struct pane_scene *panes, const struct view_light *lamps, size_t count,
                    bool at_once, const struct view_quality *quality)
{
    struct error err = {0};
    rig.shadows = rig.systems[at_once];
    shadow_system_forget(rig.shadows, "panes");
    if (!shadow_rig_prepare(&rig, panes, lamps, count, no_eye, quality, &err))
        fail_msg("%s", err.message);
    assert_int_in_range(rig.report.counts.shadow_maps_built, (count + 1) / 2, count);
}

struct words {
    uint32_t *words;
    size_t count;
};

static void read_pool(struct words *all, enum shadow_pool_kind kind,
                      const struct shadow_range *range, size_t element_words)
{
    const struct shadow_store *store = shadow_system_store(rig.shadows);
    size_t count = range->count * element_words;
    uint32_t *grown = realloc(all->words, (all->count + count + 1) * sizeof *grown);
    assert_non_null(grown);
    all->words = grown;
    gl_buffer_read(&store->pools[kind].streams[0], range->first * element_words * 4, count * 4,
                   grown + all->count);
    all->count += count;
}

/* Opaque depths, heads and events of all lights. */
static struct words read_maps(size_t light_count)
{
    struct words all = {0};
    for (size_t i = 0; i < light_count; i++) {
        const struct shadow_map *map = shadow_system_map(rig.shadows, i);
        if (!map) /* it meets nothing */
            continue;
        read_pool(&all, SHADOW_POOL_DEPTHS, &map->depths, 1);
        if (map->method != &shadow_method_deep)
            continue;
        read_pool(&all, SHADOW_POOL_HEADS, &map->heads, 1);
        read_pool(&all, SHADOW_POOL_EVENTS, &map->events, 4);
    }
    return all;
}

static void check_same_maps(const struct view_quality *quality)
{
    struct view_light lamps[LAMPS];
    struct pane_scene panes = {0};
    make_room(&panes);
    make_lamps(lamps);
    struct words maps[2];
    for (int at_once = 0; at_once < 2; at_once++) {
        prepare(&panes, lamps, LAMPS, at_once, quality);
        maps[at_once] = read_maps(LAMPS);
    }
    assert_int_equal(maps[0].count, maps[1].count);
    assert_memory_equal(maps[0].words, maps[1].words, maps[0].count * 4);
    free(maps[0].words);
    free(maps[1].words);
    pane_scene_finish(&panes);
}

static void deep_maps_of_all_faces_at_once_are_those_of_faces_apart(void **state)
{
    (void)state;
    check_same_maps(&(struct view_quality){.shadow_resolution = SIDE, .shadows = SHADOWS_DEEP});
}

static void depths_of_all_faces_at_once_are_those_of_faces_apart(void **state)
{
    (void)state;
    check_same_maps(&(struct view_quality){.shadow_resolution = SIDE, .shadows = SHADOWS_MAP});
}

static void linked_lists_of_all_faces_at_once_answer_alike(void **state)
{
    (void)state;
    static const double normal[3] = {0, 1, 0};
    enum { POINTS = 200 };
    const struct view_quality quality = {.shadow_resolution = SIDE, .shadows = SHADOWS_DEEP_LINKED};
    struct view_light lamps[LAMPS];
    struct pane_scene panes = {0};
    double points[POINTS][3];
    float answers[2][POINTS][4];
    uint64_t seed = 3;
    make_room(&panes);
    make_lamps(lamps);
    for (int i = 0; i < POINTS; i++)
        for (int k = 0; k < 3; k++)
            points[i][k] = 8 * rig_random(&seed) - 4;
    for (uint32_t light = 0; light < LAMPS; light += 7) {
        for (int at_once = 0; at_once < 2; at_once++) {
            prepare(&panes, lamps, LAMPS, at_once, &quality);
            shadow_rig_query(&rig, light, points, normal, POINTS, UINT32_MAX, answers[at_once]);
        }
        assert_memory_equal(answers[0], answers[1], sizeof answers[0]);
    }
    pane_scene_finish(&panes);
}

static struct gl_counts count_build(const struct pane_scene *panes, const struct view_light *lamps,
                                    size_t lamp_count)
{
    const struct view_quality quality = {.shadow_resolution = SIDE, .shadows = SHADOWS_DEEP};
    struct gl_counts before, after;
    prepare(panes, lamps, lamp_count, true, &quality); /* programs and buffers are there then */
    gl_counts_get(&before);
    prepare(panes, lamps, lamp_count, true, &quality);
    gl_counts_get(&after);
    return gl_counts_between(&before, &after);
}

/* Draws, uploads, framebuffers: what the raster passes ask of GL. */
static void lights_share_draws_uploads_and_framebuffers(void **state)
{
    (void)state;
    struct view_light lamps[LAMPS];
    struct pane_scene panes = {0};
    make_room(&panes);
    make_lamps(lamps);
    for (int i = 0; i < LAMPS; i++)
        lamps[i].type = SCENE_LIGHT_POINT; /* so that one light has the variants of all */
    struct gl_counts one = count_build(&panes, lamps, 1), all = count_build(&panes, lamps, LAMPS);
    assert_true(one.draws > 0);
    assert_true(all.draws <= one.draws + 2); /* a pane that the one light does not see */
    assert_true(all.by_function[GL_FUNCTION_NamedBufferSubData] <=
                one.by_function[GL_FUNCTION_NamedBufferSubData] + 2);
    assert_true(all.by_function[GL_FUNCTION_CreateFramebuffers] <= 1);
    assert_true(all.by_function[GL_FUNCTION_GetTextureSubImage] <= 2);
    assert_true(all.by_function[GL_FUNCTION_ClearNamedBufferSubData] <= 2);
    pane_scene_finish(&panes);
}

static int setup(void **state)
{
    (void)state;
    gl_hooks_install(&(struct gl_hooks_desc){.counts = true});
    if (!shadow_rig_open(&rig, 0, 0)) {
        printf("skipped: no GL device\n");
        exit(77);
    }
    return 0;
}

static int teardown(void **state)
{
    (void)state;
    shadow_rig_close(&rig);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(deep_maps_of_all_faces_at_once_are_those_of_faces_apart),
        cmocka_unit_test(depths_of_all_faces_at_once_are_those_of_faces_apart),
        cmocka_unit_test(linked_lists_of_all_faces_at_once_answer_alike),
        cmocka_unit_test(lights_share_draws_uploads_and_framebuffers),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
