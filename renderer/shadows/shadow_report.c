/* SPDX-License-Identifier: MIT */
/* What the shadow system tells of a frame. */
#include <math.h>

#include "renderer/shadows/shadow_compress.h"
#include "renderer/shadows/shadows_internal.h"
#include "renderer/shadows/technique.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

static bool is_built_now(const struct shadow_system *shadows, const struct shadow_map *map,
                         const struct shadow_progress *progress)
{
    if (progress && map->progress == progress->number)
        return true;
    for (size_t i = 0; i < shadows->build_count; i++)
        if (shadows->builds[i].map == map)
            return true;
    return false;
}

static uint64_t event_bytes(uint32_t map_flags)
{
    return SHADOW_EVENT_BYTES + (map_flags & SHADOW_FLAG_RAW ? sizeof(uint32_t) : 0) +
           (map_flags & SHADOW_FLAG_MEDIA ? SHADOW_MEDIUM_BYTES : 0);
}

/* Of the maps that this frame looks up, however much more the pools hold. */
static void report_bytes(const struct shadow_system *shadows, struct frame_report *report)
{
    static const char *const names[] = {"shadow.depth", "shadow.heads", "shadow.deep.events",
                                        "shadow.linked.nodes"};
    for (size_t i = 0; i < shadows->map_count; i++) {
        const struct shadow_map *map = shadows->maps[i];
        const uint64_t bytes[] = {4 * map->depths.count, 4 * map->heads.count,
                                  map->guess ? 0 : event_bytes(map->flags) * map->events.count,
                                  16 * map->nodes.count};
        for (int kind = 0; kind < SHADOW_POOL_COUNT; kind++)
            if (map->last_frame == shadows->frame && bytes[kind])
                report_add_bytes(report, names[kind], bytes[kind]);
    }
}

void shadow_report_told(uint32_t map_flags, const struct deep_statistics *sizes,
                        struct frame_report *report)
{
    uint64_t total = deep_statistics_total(sizes);
    double mean = report->counts.mean_list;
    double lists = mean > 0 ? round((double)report->counts.events / mean) : 0;
    lists += sizes->occupied;
    report->counts.events += total;
    report->counts.mean_list = lists > 0 ? (double)report->counts.events / lists : 0;
    if (sizes->longest > report->counts.longest_list)
        report->counts.longest_list = sizes->longest;
    if (total)
        report_add_bytes(report, "shadow.deep.events", event_bytes(map_flags) * total);
}

void shadow_report_casters(const struct shadow_system *shadows, const struct scene_state *state,
                           struct frame_report *report)
{
    for (size_t i = 0; i < shadows->build_count; i++)
        shadow_casters_count(&shadows->builds[i].casters, shadows->builds[i].map->frame.face_count,
                             state, &report->counts.shadow_draws, &report->counts.shadow_culled);
}

static void report_nodes(const struct shadow_system *shadows, struct frame_report *report)
{
    struct report_compression *c = &report->compression;
    for (size_t i = 0; i < shadows->light_count; i++) {
        const struct shadow_map *map = shadows->light_maps[i];
        if (!map || !(map->flags & SHADOW_FLAG_NODES))
            continue;
        shadow_compress_report(map, c);
    }
    if (shadows->kept_exact)
        report_warn(report,
                    "%zu of %zu lights with deep lists meet a material without self shadow, or one "
                    "that casts once: they keep exact lists, neither compressed nor prefiltered",
                    shadows->kept_exact, shadows->kept_exact + (size_t)c->maps);
}

static void report_locks(const struct shadow_system *shadows, struct frame_report *report)
{
    size_t lights = 0;
    unsigned long long failures = 0;
    for (size_t i = 0; i < shadows->light_count; i++) {
        const struct shadow_map *map = shadows->light_maps[i];
        lights += map && map->lock_failures;
        failures += map ? map->lock_failures : 0;
    }
    if (lights)
        report_warn(report,
                    "deep-linked: %llu elements of %zu lights found no lock; the lists of these "
                    "lights were made again without locks, with the same shadows",
                    failures, lights);
}

void shadow_report_fill(const struct shadow_system *shadows, const struct shadow_progress *progress,
                        struct frame_report *report)
{
    bool is_reused[SHADOW_KINDS] = {false};
    uint64_t occupied = 0;
    for (size_t i = 0; i < shadows->light_count; i++) {
        const struct shadow_map *map = shadows->light_maps[i];
        if (!map)
            continue;
        report->counts.shadowed_lights++;
        if (!map->guess) {
            report->counts.events += map->event_count;
            occupied += map->occupied_texels;
            if (map->longest_list > report->counts.longest_list)
                report->counts.longest_list = map->longest_list;
        }
        if (is_built_now(shadows, map, progress))
            continue;
        report->counts.shadow_maps_reused++;
        if (!is_reused[map->kind])
            report_add_reused(report, shadow_method_of_kind(map->kind)->reused);
        is_reused[map->kind] = true;
    }
    report_nodes(shadows, report);
    report_locks(shadows, report);
    if (shadows->has_cut_lamp)
        report_warn(report,
                    "a lamp stands in more than %d media, in a part that is cut away: its maps "
                    "attenuate from the lamp on; traced shadows do from the cut on",
                    SHADOW_AROUND_MAX);
    if (shadows->thick_media != SHADOWS_NONE)
        report_warn(report,
                    "%s has no room for media: closed volumes keep the thickness of "
                    "their material; 'deep' follows the light inside",
                    shadow_technique_name((int)shadows->thick_media));
    report->counts.shadow_maps_built += shadows->build_count;
    report->counts.mean_list = occupied ? (double)report->counts.events / (double)occupied : 0;
    report_bytes(shadows, report);
}
