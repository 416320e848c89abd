/* SPDX-License-Identifier: MIT */
/* Steps of loops against what an invocation may take. */
#include "renderer/shading/light_chunks.h"

#include "protocol/quality_defaults.h"
#include "renderer/lights/clusters.h"
#include "renderer/shading/atmosphere_light.h"
#include "renderer/shading/shade.h"
#include "renderer/shading/smoke.h"
#include "renderer/shadows/technique.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

uint32_t light_taps(const struct window_frame *frame, bool is_traced)
{
    const struct view_quality *quality = &frame->view->quality;
    return is_traced ? 1 : (uint32_t)shadow_technique_taps(quality->shadows, quality->shadow_taps);
}

static uint64_t count_shadowed(const struct shade_desc *desc)
{
    uint64_t count = desc->traced ? desc->frame->state->light_count : 0;
    for (size_t i = 0; !desc->traced && i < desc->frame->state->light_count; i++)
        count += shadow_system_record(desc->shadows, i) != NO_SHADOW;
    return count;
}

bool samples_take_turns(const struct gl_limits *limits)
{
    return !limits->is_software;
}

static uint64_t steps_of_layers(const struct window_frame *frame, uint64_t longest,
                                bool is_walked_twice)
{
    uint64_t walks = samples_take_turns(frame->limits) ? (uint64_t)frame->targets->samples : 1;
    return walks * loop_steps_of_layers(longest, is_walked_twice);
}

/* Without what only drawing tells. */
static struct loop_lights loops_before(const struct window_frame *frame, bool is_traced)
{
    const struct shadow_method *method = shadow_method_of(frame->view->quality.shadows);
    struct loop_lights loops = {
        .taps = is_traced ? 0 : light_taps(frame, false),
        .points = (uint32_t)frame->needs->area_samples,
        .has_area_form = frame->needs->has_area_form,
        .walks_lists = method && method->structure->is_walked,
        .surfaces = (uint32_t)frame->targets->samples,
        .grid_steps = smoke_loop_steps(frame->state),
    };
    /* the ray of a pixel, and anew for samples at edges */
    loops.besides = (1 + (uint64_t)frame->targets->samples) * loops.grid_steps;
    if (atmosphere_is_lit(frame) && loops.surfaces < CLUSTER_SLICES)
        loops.surfaces = CLUSTER_SLICES; /* a slice of haze may lie in all of them */
    for (uint32_t i = 0; i < frame->state->scene->material_count; i++)
        loops.walks_lists |= frame->state->materials[i].no_self_shadow;
    return loops;
}

static struct loop_lights loops_of(const struct shade_desc *desc)
{
    const struct layers *layers = desc->layers;
    struct loop_lights loops = loops_before(desc->frame, desc->traced);
    loops.shadowed = count_shadowed(desc);
    uint64_t longest = shadow_system_longest_list(desc->shadows);
    loops.longest_list = desc->frame->report->counts.longest_list;
    if (loops.longest_list < longest)
        loops.longest_list = longest;
    loops.besides += steps_of_layers(desc->frame, layers->longest,
                                     layers->may_surround || layers->method->walks_twice);
    return loops;
}

/* They have no end, so that every list has them. */
static size_t count_everywhere(const struct scene_state *state)
{
    size_t count = 0;
    for (size_t i = 0; i < state->light_count; i++)
        count += state->lights[i].type == SCENE_LIGHT_DIRECTIONAL || !(state->lights[i].range > 0);
    return count;
}

/* Whether rays to all lights from all points may be more than one upload holds. */
static bool may_exceed_rays(const struct light_parts_desc *desc)
{
    const struct window_frame *frame = desc->frame;
    uint64_t points = (uint64_t)frame->view->width_px * (uint64_t)frame->view->height_px *
                      (uint64_t)frame->targets->samples;
    uint64_t each = frame->needs->area_samples > 1 ? (uint64_t)frame->needs->area_samples : 1;
    uint64_t most = traced_shadows_points_max(frame->limits);
    if (desc->has_layers || points > most)
        points = most;
    return frame->state->light_count * each > TRACED_FILTERS_MAX / points;
}

int light_parts_list(const struct light_parts_desc *desc, bool may[LIGHT_PARTS])
{
    enum { LONG = 4096 };
    const struct window_frame *frame = desc->frame;
    struct loop_lights least = loops_before(frame, desc->is_traced), most = least;
    bool can = frame->view->quality.light_lists != VIEW_LIGHT_LISTS_LINKED;
    most.shadowed = desc->shadowed_count;
    most.longest_list = LONG;
    most.besides += desc->has_layers ? steps_of_layers(frame, LONG, false) : 0;
    bool must = can && count_everywhere(frame->state) > loop_steps_room(&least, desc->loop_steps);
    bool may_chunk =
        must || (can && (frame->state->light_count > loop_steps_room(&most, desc->loop_steps) ||
                         (desc->is_traced && may_exceed_rays(desc))));
    may[LIGHTS_AT_ONCE] = !must && !desc->is_in_batches;
    may[LIGHTS_IN_BATCHES] = !must && desc->is_in_batches;
    may[LIGHTS_IN_CHUNKS] = may_chunk;
    return !must + may_chunk;
}

bool light_chunks_choose(const struct shade_desc *desc, uint64_t loop_steps,
                         struct light_chunk *chunk, uint32_t *chunk_count, struct error *err)
{
    uint32_t longest = desc->frame->state->light_count ? light_lists_longest(desc->lists) : 0;
    const struct loop_lights loops = loops_of(desc);
    uint64_t per_chunk = loop_steps_room(&loops, loop_steps);
    if (desc->traced && longest) {
        uint32_t room = traced_shadows_room(desc->traced, light_lists_clusters(desc->lists));
        per_chunk = per_chunk < room ? per_chunk : room;
    }
    *chunk_count = 1;
    *chunk = (struct light_chunk){.count = longest, .is_whole = true};
    if (loops.besides > loop_steps)
        return error_set(err, ERROR_OVER_BUDGET,
                         "%llu transparent layers and the density grids at one pixel take %llu "
                         "loop steps, limit is %llu: ask for fewer quality.samples",
                         (unsigned long long)desc->layers->longest,
                         (unsigned long long)loops.besides, (unsigned long long)loop_steps);
    if (longest <= per_chunk)
        return true;
    if (!per_chunk || desc->frame->view->quality.light_lists == VIEW_LIGHT_LISTS_LINKED)
        return error_set(
            err, ERROR_OVER_BUDGET,
            "%u lights at one point take %llu loop steps, limit is %llu: ask for fewer "
            "quality.samples, shadow_taps or area_samples",
            longest, (unsigned long long)loop_steps_of_lights(&loops, longest),
            (unsigned long long)loop_steps);
    *chunk = (struct light_chunk){.count = (uint32_t)per_chunk};
    *chunk_count = (longest + chunk->count - 1) / chunk->count;
    return true;
}
