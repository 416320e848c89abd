/* SPDX-License-Identifier: MIT */
/* Rays on the processor as a finder of shadows: points to the CPU, filters to the GPU. */
#include "renderer/shadows/shadow_finder.h"

#include <stdlib.h>

#include "renderer/shadows/shadow_traced.h"

static bool begin(struct traced_shadows *traced, const struct shadow_finding *finding,
                  struct error *err)
{
    traced->rays =
        raytrace_shadows_create(finding->desc, finding->is_shadowed, &traced->stats, err);
    return traced->rays;
}

static uint32_t filters(const struct traced_shadows *traced, size_t light)
{
    return raytrace_shadows_filters(traced->rays, (uint32_t)light);
}

static uint32_t room(const struct traced_shadows *traced, const struct clusters *clusters,
                     size_t capacity)
{
    return raytrace_shadows_room(traced->rays, &traced->window, clusters, capacity);
}

/* Pages of it that nothing is written to cost nothing. */
static bool reserve_filters(struct traced_shadows *traced, uint64_t count, struct error *err)
{
    size_t most = traced_shadows_most_filters(traced), capacity = count < most ? count : most;
    void **array = &traced->arrays[TRACED_FILTERS];
    if (capacity <= traced->filter_capacity)
        return true;
    free(*array);
    *array = malloc(capacity * 2 * sizeof(uint32_t));
    traced->filter_capacity = *array ? capacity : 0;
    return traced->filter_capacity || error_set(err, ERROR_NO_MEMORY, "%zu shadow rays", capacity);
}

static bool find(struct traced_shadows *traced, const struct shadow_chunk *chunk,
                 uint64_t *filter_count, struct error *err)
{
    uint64_t points = traced->window.count;
    uint64_t most = points * raytrace_shadows_most_filters(traced->rays, chunk->count) + 1;
    if (!reserve_filters(traced, most, err))
        return false;
    struct raytrace_shadow_chunk traced_chunk = {.clusters = light_lists_clusters(chunk->lists),
                                                 .first = chunk->first,
                                                 .count = chunk->count,
                                                 .table = traced->arrays[TRACED_TABLE],
                                                 .filters = traced->arrays[TRACED_FILTERS],
                                                 .capacity = traced->filter_capacity};
    if (!raytrace_shadows_trace(traced->rays, &traced->window, &traced_chunk, &traced->stats,
                                err) ||
        !traced_shadows_reserve(traced, traced_chunk.filter_count, err))
        return false;
    gl_buffer_write(&traced->table, 0, points * 8, traced_chunk.table);
    gl_buffer_write(&traced->filters, 0, traced_chunk.filter_count * 8, traced_chunk.filters);
    *filter_count = traced_chunk.filter_count;
    return true;
}

static void report(const struct traced_shadows *traced, const struct shadow_report *report)
{
    report_add_pass(report->report, "shadow.trace", report->because, report->technique,
                    traced->stats.trace_ms, REPORT_SHADOW);
}

const struct shadow_finder shadow_finder_rays = {
    .reads_points = true,
    .begin = begin,
    .filters = filters,
    .room = room,
    .find = find,
    .report = report,
};
