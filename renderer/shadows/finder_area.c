/* SPDX-License-Identifier: MIT */
/* Grids on the device as a finder of shadows: neither points nor filters leave it. */
#include "renderer/shadows/shadow_finder.h"

#include <math.h>
#include <stdlib.h>

#include "renderer/base/wall_clock.h"
#include "renderer/raytrace/rt_emitter.h"
#include "renderer/shadows/area_grid.h"
#include "renderer/shadows/shadow_traced.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

struct area_finder { /* behind traced->own */
    struct area_casters casters;
    struct area_grid grid;

    /* of the frame: */
    struct shadow_finding finding;
    struct raytrace_desc desc;
    uint32_t *light_filters; /* per light of the state; 0: without a shadow */
    uint32_t filters_max;
    double farthest_m, casters_ms;
};

static struct area_finder *own_of(const struct traced_shadows *traced)
{
    return traced->own;
}

/* Of one frame. */
static void end(struct traced_shadows *traced)
{
    struct area_finder *finder = own_of(traced);
    if (!finder)
        return;
    free(finder->light_filters);
    finder->light_filters = NULL;
    finder->finding = (struct shadow_finding){0};
}

static bool begin(struct traced_shadows *traced, const struct shadow_finding *finding,
                  struct error *err)
{
    const struct scene_state *state = finding->desc->state;
    const struct view_quality *quality = &finding->desc->view->quality;
    if (!traced->own)
        traced->own = calloc(1, sizeof(struct area_finder));
    struct area_finder *finder = own_of(traced);
    if (finder)
        finder->light_filters = calloc(state->light_count + 1, sizeof *finder->light_filters);
    if (!finder || !finder->light_filters)
        return error_set(err, ERROR_NO_MEMORY, "shadows of %zu lights", state->light_count);
    finder->finding = *finding;
    finder->desc = *finding->desc;
    traced->has_fixed_points = quality->faithful;
    finder->grid.counts_of_frame = (struct area_counts){0};
    finder->farthest_m = 1.001 * rt_points_farthest(&finder->desc);
    finder->filters_max = 1;
    for (size_t i = 0; i < state->light_count; i++) {
        uint32_t samples = rt_light_sample_count(&state->lights[i], quality);
        finder->light_filters[i] = finding->is_shadowed[i] ? samples : 0;
        if (finder->light_filters[i] > finder->filters_max)
            finder->filters_max = finder->light_filters[i];
    }
    const struct area_casters_desc casters = {.state = state,
                                              .scene_key = finding->scene_key,
                                              .blend = quality->blend_filter,
                                              .limits = finding->limits};
    double begin_ms = wall_ms();
    bool ok = area_casters_prepare(&finder->casters, &casters, err);
    finder->casters_ms = wall_ms() - begin_ms;
    return ok;
}

static uint32_t filters(const struct traced_shadows *traced, size_t light)
{
    return own_of(traced)->light_filters[light];
}

/* As if every list was as long as the longest, of the lights with most filters. */
static uint32_t room(const struct traced_shadows *traced, const struct clusters *clusters,
                     size_t capacity)
{
    uint64_t each = traced->window.count * (uint64_t)own_of(traced)->filters_max;
    uint64_t most = each ? capacity / each : clusters->longest;
    return most < clusters->longest ? (uint32_t)most : clusters->longest;
}

/* Lights of which some list has an entry in the chunk. */
static bool *find_lights(const struct area_finder *finder, const struct shadow_chunk *chunk)
{
    const struct clusters *clusters = light_lists_clusters(chunk->lists);
    const size_t cells =
        (size_t)clusters->columns * (size_t)clusters->rows * (size_t)clusters->slices;
    const uint64_t end = (uint64_t)chunk->first + chunk->count, prefix = clusters->prefix_count;
    bool *is_asked = calloc(finder->desc.state->light_count + 1, sizeof *is_asked);
    if (!is_asked)
        return NULL;
    for (uint64_t i = chunk->first; i < end && i < prefix; i++)
        is_asked[clusters->items[i]] = true;
    for (size_t cell = 0; cell < cells; cell++) {
        const uint32_t *head = clusters->heads + 2 * cell;
        uint64_t first = chunk->first > prefix ? chunk->first - prefix : 0;
        for (uint64_t i = first; i < head[1] && i + prefix < end; i++)
            is_asked[clusters->items[head[0] + i]] = true;
    }
    return is_asked;
}

static struct area_grid_desc grid_desc_of(const struct traced_shadows *traced,
                                          const struct shadow_chunk *chunk)
{
    const struct area_finder *finder = own_of(traced);
    const struct raytrace_shadow_points *window = &traced->window;
    return (struct area_grid_desc){
        .programs = finder->finding.programs,
        .limits = finder->finding.limits,
        .casters = &finder->casters,
        .state = finder->desc.state,
        .camera = finder->desc.camera,
        .image_height_px = finder->desc.view->height_px,
        .farthest_m = finder->farthest_m,
        .points = {.points = &traced->points,
                   .count = (uint32_t)window->count,
                   .layer_count = (uint32_t)window->layer_count,
                   .width = (uint32_t)window->width,
                   .image_x = (uint32_t)window->image_x,
                   .image_y_bottom = (uint32_t)window->image_y_bottom},
        .lists = chunk->lists,
        .first = chunk->first,
        .count = chunk->count,
        .table = &traced->table,
        .filters = &traced->filters,
        .is_faithful = finder->desc.view->quality.faithful,
        .loop_steps = (uint32_t)fmin((double)finder->finding.loop_steps, UINT32_MAX),
    };
}

/* Pairs that one part of a grid may have: a share of what the buffers of windows may take, but all
 * that one cell can need. */
static uint64_t most_pairs(const struct traced_shadows *traced)
{
    enum { SHARE = 32, LEAST = 1 << 16 }; /* in bytes, an eighth */
    uint64_t most = traced->most_bytes ? traced->most_bytes / SHARE : AREA_PAIRS_MAX;
    uint64_t needed = own_of(traced)->casters.triangle_count;
    most = most < AREA_PAIRS_MAX ? most : AREA_PAIRS_MAX;
    needed = needed > LEAST ? needed : LEAST;
    return most > needed ? most : needed;
}

static void begin_scope(struct traced_shadows *traced, const struct shadow_chunk *chunk)
{
    gpu_scope_begin(chunk->frame->timeline,
                    &(struct gpu_scope_desc){
                        .pass = "shadow.area",
                        .because = "triangles are found that block the light of points in view",
                        .technique = traced->technique,
                        .stage = REPORT_SHADOW,
                    });
}

static bool find_light(struct traced_shadows *traced, const struct shadow_chunk *chunk,
                       uint32_t light, struct error *err)
{
    struct area_finder *finder = own_of(traced);
    const struct area_grid_desc desc = grid_desc_of(traced, chunk);
    const struct area_light source = area_light_of(&finder->desc.state->lights[light], light,
                                                   finder->light_filters[light], &finder->casters);
    if (yield_point_is_due(finder->desc.yield) && !yield_point_run(finder->desc.yield, err))
        return false;
    begin_scope(traced, chunk);
    bool ok = area_grid_find(&finder->grid, &desc, &source, err);
    gpu_scope_end(chunk->frame->timeline);
    return ok;
}

static bool find(struct traced_shadows *traced, const struct shadow_chunk *chunk,
                 uint64_t *filter_count, struct error *err)
{
    struct area_finder *finder = own_of(traced);
    if (!traced_shadows_reserve(traced, 1, err))
        return false;
    const struct area_grid_desc desc = grid_desc_of(traced, chunk);
    finder->grid.pairs_max = most_pairs(traced);
    begin_scope(traced, chunk);
    bool ok = area_grid_begin(&finder->grid, &desc, finder->light_filters, filter_count, err) &&
              traced_shadows_reserve(traced, *filter_count ? *filter_count : 1, err);
    gpu_scope_end(chunk->frame->timeline);
    bool *is_asked = ok ? find_lights(finder, chunk) : NULL;
    if (ok && !is_asked)
        return error_set(err, ERROR_NO_MEMORY, "%zu lights", finder->desc.state->light_count);
    for (uint32_t i = 0; ok && i < finder->desc.state->light_count; i++)
        if (is_asked[i] && finder->light_filters[i] && *filter_count)
            ok = find_light(traced, chunk, i, err);
    free(is_asked);
    return ok;
}

static void report(const struct traced_shadows *traced, const struct shadow_report *report)
{
    const struct area_finder *finder = own_of(traced);
    if (!finder) /* it did not begin */
        return;
    if (finder->casters.is_reused)
        report_add_reused(report->report, "shadow.casters");
    else
        report_add_pass(report->report, "shadow.casters", report->because, report->technique,
                        finder->casters_ms, REPORT_SHADOW);
    report_add_bytes(report->report, "shadow.casters", area_casters_size_bytes(&finder->casters));
}

static void list_programs(const struct window_frame *frame, struct program_list *list)
{
    const struct scene_state *state = frame->state;
    struct area_listing listing = {.is_orthographic = frame->camera->is_orthographic,
                                   .has_planes = state->shadow_plane_count > 0,
                                   .is_faithful = frame->view->quality.faithful,
                                   .is_software = frame->limits->is_software};
    for (size_t i = 0; i < state->light_count; i++) {
        const struct state_light *light = &state->lights[i];
        bool is_area = state_light_is_area(light);
        listing.has_kind[light->type == SCENE_LIGHT_DIRECTIONAL ? AREA_PARALLEL
                         : is_area                              ? AREA_RECTANGLE
                                                                : AREA_POINT] = true;
        if (is_area)
            listing.samples = rt_light_sample_count(light, &frame->view->quality);
    }
    area_casters_foretell(state, &listing.has_filters, &listing.has_curves);
    area_grid_list_programs(&listing, "shadow.area", list);
}

static uint64_t size_bytes(const struct traced_shadows *traced)
{
    const struct area_finder *finder = own_of(traced);
    return finder ? area_grid_size_bytes(&finder->grid) : 0;
}

static void free_buffers(struct traced_shadows *traced)
{
    struct area_finder *finder = own_of(traced);
    if (!finder)
        return;
    area_grid_finish(&finder->grid);
}

static void finish(struct traced_shadows *traced)
{
    struct area_finder *finder = own_of(traced);
    if (!finder)
        return;
    end(traced);
    free_buffers(traced);
    area_casters_finish(&finder->casters);
    free(finder);
    traced->own = NULL;
}

const struct shadow_finder shadow_finder_area = {
    .point_bytes = sizeof(struct area_start) + 8,
    .begin = begin,
    .filters = filters,
    .room = room,
    .find = find,
    .report = report,
    .list_programs = list_programs,
    .end = end,
    .size_bytes = size_bytes,
    .free = free_buffers,
    .finish = finish,
};
