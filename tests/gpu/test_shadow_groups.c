/* SPDX-License-Identifier: MIT */
/* Deep maps of many lights are built together, as many as a storage block of the device takes: each
 * has the words that it has when it is built alone. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/shadows/shadows_internal.h"
#include "tests/support/shadow_rig.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

enum { LIGHTS = 12, SIDE = 48 };

static struct shadow_rig rig;
static struct gl_limits limits;
static const double no_eye[3];

static void use_system(int64_t block_bytes, bool scans_on_device, bool is_frugal)
{
    struct error err = {0};
    limits = *gl_context_limits(rig.context);
    if (block_bytes)
        limits.max_storage_block_bytes = block_bytes;
    shadow_system_destroy(rig.systems[0]);
    rig.systems[0] = rig.shadows =
        shadow_system_create(&(struct shadow_system_desc){.programs = rig.programs,
                                                          .timeline = rig.timeline,
                                                          .limits = &limits,
                                                          .scans_on_device = scans_on_device},
                             &err);
    assert_non_null(rig.shadows);
    rig.shadows->is_frugal = is_frugal; /* one structure at a time */
}

/* Stacks of very different heights; only some lights see those whose lists have more streams. */
static void add_panes(struct pane_scene *panes, bool has_media, bool has_objects)
{
    static const int heights[] = {3, 20, 45, 300};
    uint64_t seed = 7;
    for (int corner = 0; corner < 4; corner++) {
        for (int i = 0; i < heights[corner]; i++) {
            double half = 0.2 + 0.8 * rig_random(&seed);
            struct pane pane = {
                .center = {corner & 1 ? 2 : -2, i % 3 == 0 ? 2 : 1 + 3 * rig_random(&seed),
                           corner & 2 ? 2 : -2},
                .u = {half, 0, 0},
                .v = {0, 0, -half},
                .color = {(float)rig_random(&seed), (float)rig_random(&seed), 0.5f},
                .cast_once = has_objects && corner == 1,
            };
            if (has_media && corner == 2 && i % 2) {
                pane.shape = PANE_BOX;
                pane.w[1] = 0.1;
                for (int k = 0; k < 3; k++)
                    pane.sigma[k] = 0.3f + 0.1f * (float)(i % 4);
            }
            pane_scene_add(panes, &pane);
        }
    }
}

/* Spots onto one stack each, and some onto all. */
static void add_lights(struct view_light lights[LIGHTS])
{
    for (int i = 0; i < LIGHTS; i++)
        lights[i] = (struct view_light){
            .type = SCENE_LIGHT_SPOT,
            .position = {i % 3 == 2 ? 0
                         : i & 1    ? 2
                                    : -2,
                         9 + 0.1 * i,
                         i % 3 == 2 ? 0
                         : i & 2    ? 2
                                    : -2},
            .direction = {0.001 * i, -1, 0.001},
            .color = {1, 1, 1},
            .intensity = 1,
            .outer_cone_deg = i % 3 == 2 ? 30 : 5,
        };
}

static size_t read_stream(enum shadow_pool_kind kind, int stream, uint32_t words_each,
                          const struct shadow_range *range, uint32_t *words)
{
    const struct gl_buffer *buffer = &shadow_system_store(rig.shadows)->pools[kind].streams[stream];
    size_t count = words_each * range->count;
    if (words)
        gl_buffer_read(buffer, 4ull * words_each * range->first, 4 * count, words);
    return count;
}

/* Heads, events, and what streams the map asked for; their number where words is NULL. */
static size_t read_map(const struct shadow_map *map, uint32_t *words)
{
    size_t count = read_stream(SHADOW_POOL_HEADS, 0, 1, &map->heads, words);
    count += read_stream(SHADOW_POOL_EVENTS, SHADOW_STREAM_EVENT, 4, &map->events,
                         words ? words + count : NULL);
    if (map->flags & SHADOW_FLAG_RAW)
        count += read_stream(SHADOW_POOL_EVENTS, SHADOW_STREAM_OBJECT, 1, &map->events,
                             words ? words + count : NULL);
    if (map->flags & SHADOW_FLAG_MEDIA)
        count += read_stream(SHADOW_POOL_EVENTS, SHADOW_STREAM_MEDIUM, 4, &map->events,
                             words ? words + count : NULL);
    return count;
}

struct maps {
    uint32_t *words[LIGHTS];
    size_t counts[LIGHTS];
    uint32_t kinds; /* bit per combination of flags that some map has */
};

static struct maps build(const struct pane_scene *panes)
{
    struct error err = {0};
    struct view_light lights[LIGHTS];
    struct maps maps = {.kinds = 0};
    add_lights(lights);
    if (!shadow_rig_prepare(&rig, panes, lights, LIGHTS, no_eye,
                            &(struct view_quality){.shadow_resolution = SIDE}, &err))
        fail_msg("%s", err.message);
    for (uint32_t i = 0; i < LIGHTS; i++) {
        const struct shadow_map *map = shadow_system_map(rig.shadows, i);
        assert_non_null(map);
        maps.kinds |= 1u << (map->flags & 3);
        maps.counts[i] = read_map(map, NULL);
        maps.words[i] = calloc(maps.counts[i], sizeof **maps.words);
        assert_non_null(maps.words[i]);
        read_map(map, maps.words[i]);
    }
    return maps;
}

static void maps_finish(struct maps *maps)
{
    for (int i = 0; i < LIGHTS; i++)
        free(maps->words[i]);
}

static void expect_same(const char *what, const struct maps *maps, const struct maps *alone)
{
    for (int i = 0; i < LIGHTS; i++) {
        if (maps->counts[i] != alone->counts[i])
            fail_msg("%s: light %d has %zu words, alone %zu", what, i, maps->counts[i],
                     alone->counts[i]);
        for (size_t k = 0; k < maps->counts[i]; k++)
            if (maps->words[i][k] != alone->words[i][k])
                fail_msg("%s: word %zu of light %d is %08x, alone %08x", what, k, i,
                         maps->words[i][k], alone->words[i][k]);
    }
}

static void compare(bool has_media, bool has_objects)
{
    struct pane_scene panes = {0};
    add_panes(&panes, has_media, has_objects);
    use_system(0, false, true);
    struct maps alone = build(&panes);
    print_message("flags %x\n", alone.kinds);
    for (int scan = 0; scan < 2; scan++) {
        static const int64_t blocks[] = {0, 1 << 20, 256 << 10};
        for (int i = 0; i < 3; i++) {
            char what[64];
            snprintf(what, sizeof what, "scanned %s, blocks of %lld bytes",
                     scan ? "by shader" : "in C", (long long)blocks[i]);
            use_system(blocks[i], scan == 1, false);
            struct maps maps = build(&panes);
            expect_same(what, &maps, &alone);
            maps_finish(&maps);
        }
    }
    maps_finish(&alone);
    pane_scene_finish(&panes);
}

static void lights_built_together_have_the_words_of_each_alone(void **state)
{
    (void)state;
    compare(false, false);
}

static void lights_with_more_streams_are_built_beside_others(void **state)
{
    (void)state;
    compare(true, true);
}

int main(void)
{
    if (!shadow_rig_open(&rig, 0, 0))
        return 77;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lights_built_together_have_the_words_of_each_alone),
        cmocka_unit_test(lights_with_more_streams_are_built_beside_others),
    };
    int failures = cmocka_run_group_tests(tests, NULL, NULL);
    shadow_rig_close(&rig);
    return failures;
}
