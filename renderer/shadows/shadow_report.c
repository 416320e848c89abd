/* SPDX-License-Identifier: MIT */
/* What the shadow system tells of a frame. */
#include <math.h>

#include "renderer/shadows/shadows_internal.h"
#include "renderer/shadows/technique.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

static bool is_built_now(const struct shadow_system *shadows, const struct shadow_map *map)
{
    if (shadows->progress && map->progress == shadows->progress->number)
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
                                        "shadow.linked.nodes", "shadow.texels"};
    for (size_t i = 0; i < shadows->map_count; i++) {
        const struct shadow_map *map = shadows->maps[i];
        const uint64_t bytes[] = {4 * map->depths.count, 4 * map->heads.count,
                                  map->guess ? 0 : event_bytes(map->flags) * map->events.count,
                                  16 * map->nodes.count, 16 * map->texels.count};
        for (int kind = 0; kind < SHADOW_POOL_COUNT; kind++)
            if (map->last_frame == shadows->frame && bytes[kind])
                report_add_bytes(report, names[kind], bytes[kind]);
    }
}

void shadow_report_sizes(uint32_t map_flags, const struct deep_statistics *sizes,
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

void shadow_report_fill(const struct shadow_system *shadows, struct frame_report *report)
{
    bool is_reused[SHADOWS_COUNT] = {false};
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
        if (is_built_now(shadows, map))
            continue;
        report->counts.shadow_maps_reused++;
        if (!is_reused[map->method->id])
            report_add_reused(report, map->method->reused);
        is_reused[map->method->id] = true;
    }
    const struct shadow_map *const *maps = (const struct shadow_map *const *)shadows->light_maps;
    const struct shadow_structure *structure;
    for (size_t i = 0; (structure = shadow_structure_at(i)); i++)
        if (structure->report)
            structure->report(maps, shadows->light_count, report);
    report->counts.shadow_maps_built += shadows->build_count;
    report->counts.mean_list = occupied ? (double)report->counts.events / (double)occupied : 0;
    report_bytes(shadows, report);
}

void shadow_system_warn(struct frame_report *report)
{
    const struct shadow_structure *structure;
    for (size_t i = 0; (structure = shadow_structure_at(i)); i++)
        if (structure->warn)
            structure->warn(report);
}
