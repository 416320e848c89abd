/* SPDX-License-Identifier: MIT */
/* The lights of a frame, and which sets of surfaces are lit with them in which order. */
#include "renderer/shading/shade.h"

#include <math.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "renderer/shading/atmosphere_glow.h"
#include "renderer/shading/atmosphere_light.h"
#include "renderer/shading/lighting.h"
#include "renderer/shading/opaque_samples.h"
#include "renderer/shading/smoke.h"
#include "renderer/window/apart.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

enum {
    STATISTICS_WORDS = 128,
    STATISTICS_LOOKUPS = STATISTICS_WORDS - READBACK_LOOKUP_WORDS,
    STATISTICS_COUNTS = STATISTICS_WORDS - READBACK_COUNT_WORDS,
};

static void fill_light(const struct state_light *light, uint32_t shadow,
                       const struct camera *camera, struct light_record *r)
{
    double offset[3], axes[3][3];
    vec3_sub(light->position, camera->eye, offset);
    camera_axes(camera, axes);
    *r = (struct light_record){.shadow = shadow, .dims_in_grids = light->casts_shadow};
    for (int k = 0; k < 3; k++) {
        r->position_range.v[k] = (float)vec3_dot(axes[k], offset);
        r->color.v[k] = light->color[k] * (state_light_is_area(light) ? (float)light->area_m2 : 1);
        r->direction_cone.v[k] = (float)vec3_dot(axes[k], light->direction);
    }
    r->position_range.v[3] = light->range;
    r->type = light->type == SCENE_LIGHT_DIRECTIONAL ? LIGHT_DIRECTIONAL
              : light->type == SCENE_LIGHT_POINT     ? LIGHT_POINT
              : state_light_is_area(light)           ? LIGHT_AREA
                                                     : LIGHT_SPOT;
    /* KHR_lights_punctual, "Inner and Outer Cone Angles" */
    float outer = cosf(light->outer_cone_rad), inner = cosf(light->inner_cone_rad);
    float scale = 1 / fmaxf(inner - outer, 1e-3f);
    r->direction_cone.v[3] = scale;
    r->spot_offset = -outer * scale;
}

bool shade_upload_lights(struct shade *shade, const struct shade_lights_desc *desc,
                         struct error *err)
{
    const struct scene_state *state = desc->state;
    struct light_record *records = calloc(state->light_count + 1, sizeof *records);
    if (!records)
        return error_set(err, ERROR_NO_MEMORY, "%zu lights", state->light_count);
    for (size_t i = 0; i < state->light_count; i++) {
        uint32_t shadow = desc->traced ? traced_shadows_record(desc->traced, i)
                                       : shadow_system_record(desc->shadows, i);
        fill_light(&state->lights[i], shadow, desc->camera, &records[i]);
        if (!desc->has_shadows || (!desc->traced && shadow_system_holds_grids(desc->shadows, i)))
            records[i].dims_in_grids = 0;
        if (desc->is_left_out && desc->is_left_out[i])
            records[i].color = (vec4){{0, 0, 0, 0}};
    }
    uint64_t bytes = state->light_count * sizeof *records;
    bool ok =
        gl_buffer_reserve(&shade->lights,
                          &(struct gl_buffer_desc){
                              .label = "frame.lights", .size_bytes = bytes, .is_uploaded = true},
                          false, err) &&
        gl_buffer_reserve(&shade->statistics,
                          &(struct gl_buffer_desc){.label = "frame.statistics",
                                                   .size_bytes = STATISTICS_WORDS * 4,
                                                   .is_dynamic = true},
                          false, err) &&
        (!shader_needs_areas(desc->needs) ||
         light_areas_upload(&shade->areas, state, desc->camera, desc->needs->has_area_form, err));
    if (ok)
        gl_buffer_write(&shade->lights, 0, bytes, records);
    free(records);
    return ok;
}

struct shade_facts shade_facts_of(const struct shade_desc *desc)
{
    const struct layers *layers = desc->layers;
    return (struct shade_facts){
        .method = layers->method,
        .shadows = desc->traced ? SHADE_TRACED_SHADOWS : shadow_system_defines(desc->shadows),
        .lists = light_lists_defines(desc->lists),
        .is_traced = desc->traced,
        .has_layers = layers->layer_count > 0,
        .has_media = layers->has_media,
        .may_surround = layers->may_surround,
    };
}

static void list_smoke(const struct window_frame *frame, const struct shade_facts *facts,
                       const struct light_chunk *chunk, bool is_conditional,
                       struct program_list *list)
{
    struct window_frame without = *frame;
    without.depths.most_bytes = 0;
    if (smoke_depths_serve(frame)) {
        is_conditional |= frame->depths.is_anywhere; /* from elsewhere nodes may look nothing up */
        smoke_depths_list_program(frame, is_conditional, list);
        lighting_list_program(frame, facts, chunk, &smoke_nodes, is_conditional, list);
        if (!frame->depths.is_anywhere)
            return;
    }
    lighting_list_program(&without, facts, chunk, &smoke_nodes, is_conditional, list);
}

void shade_list_programs(const struct window_frame *frame, const struct shade_facts *facts,
                         enum light_parts parts, bool is_conditional, struct program_list *list)
{
    const struct light_chunk chunk = {.is_whole = parts != LIGHTS_IN_CHUNKS,
                                      .is_first = true,
                                      .is_last = parts == LIGHTS_AT_ONCE};
    if (facts->has_layers)
        lighting_list_program(frame, facts, &chunk, facts->method->surfaces, is_conditional, list);
    if (atmosphere_is_lit(frame)) {
        if (!facts->is_traced)
            lighting_list_program(frame, facts, &chunk, &atmosphere_points, is_conditional, list);
        atmosphere_list_programs(frame, facts->is_traced, list);
    }
    if (frame->has_glow) {
        lighting_list_program(frame, facts, &chunk, &atmosphere_glow_ways, true, list);
        atmosphere_glow_list_programs(frame, facts, list);
    }
    if (smoke_is_lit(frame))
        list_smoke(frame, facts, &chunk, is_conditional, list);
    lighting_list_program(frame, facts, &chunk, &opaque_samples, is_conditional, list);
    if (apart_is_possible(frame))
        lighting_list_program(frame, facts, &chunk, &samples_apart, true, list);
}

/* A batch of lights: its sums would not be distinguished from those of the others. What follows
 * finds 0. */
static void take_lookups(struct shade *shade, const struct shade_desc *desc)
{
    uint32_t words[READBACK_LOOKUP_WORDS] = {0}; /* a lost context reads nothing */
    gpu_timeline_will_wait(desc->frame->timeline);
    gl_buffer_read(&shade->statistics, STATISTICS_LOOKUPS * 4, sizeof words, words);
    gl_buffer_clear_u32(&shade->statistics, 0, STATISTICS_WORDS * 4, 0);
    for (int i = 0; i < READBACK_LOOKUP_WORDS; i++)
        desc->frame->report->counts.lookups += words[i];
}

/* ---- which sets, and in which order ---- */

/* The chunks that the lists of a window are walked in. */
struct chunk_walk {
    struct lighting *lighting;
    uint32_t count;
};

static void begin_chunks(struct lighting *lighting)
{
    lighting->chunk.first = 0;
    lighting->chunk.is_first = !lighting->desc->is_continued;
}

static void next_chunk(struct lighting *lighting)
{
    lighting->chunk.first += lighting->chunk.count;
    lighting->chunk.is_first = false;
}

static void set_last(struct lighting *lighting, bool is_last)
{
    lighting->chunk.is_last = is_last && !lighting->desc->continues;
}

/* Lights one set with all chunks of a struct chunk_walk, one after the other. */
static bool light_set(void *context, const struct surface_set *set, struct error *err)
{
    const struct chunk_walk *walk = context;
    struct lighting *lighting = walk->lighting;
    begin_chunks(lighting);
    for (uint32_t i = 0; i < walk->count; i++, next_chunk(lighting)) {
        set_last(lighting, i + 1 == walk->count);
        if (!lighting_run(lighting, set, err))
            return false;
    }
    return true;
}

/* Lights one set with the chunk at hand. */
static bool light_chunk_of_set(void *context, const struct surface_set *set, struct error *err)
{
    return lighting_run(context, set, err);
}

/* Pixels of the list of those whose samples are lit apart. */
struct apart_piece {
    uint32_t first, count; /* as samples_apart_of takes them */
};

/* On our own processors the length of the list is read where others may go first, so that it comes
 * in pieces; other devices would be waited for. */
static struct surface_set apart_set(const struct shade_desc *desc, const struct apart_piece *piece)
{
    bool is_counted = desc->yield && desc->frame->limits->is_software;
    return samples_apart_of(desc->frame, piece->first, piece->count, is_counted);
}

/* Lights the haze around lamps in view once more, by itself and along the ways of pixels. */
static bool light_glow(const struct shade_desc *desc, const struct surface_lighter *lighter,
                       struct error *err)
{
    if (!atmosphere_glow_is_there(desc->frame))
        return true;
    const struct surface_set set = atmosphere_glow_set(desc->frame);
    return atmosphere_glow_begin(desc->frame, err) && lighter->light(lighter->context, &set, err) &&
           (desc->continues || atmosphere_glow_end(desc->frame, err));
}

/* Lights the haze, whose light is looked up where the layers are composited; rays have done so. */
static bool light_atmosphere(const struct shade_desc *desc, const struct surface_lighter *lighter,
                             struct error *err)
{
    if (!atmosphere_is_lit(desc->frame) || desc->traced)
        return true;
    if (!atmosphere_begin(desc->frame, err))
        return false;
    const struct surface_set set = atmosphere_set(desc->frame);
    return lighter->light(lighter->context, &set, err) &&
           (desc->continues || atmosphere_end(desc->frame, err)) && light_glow(desc, lighter, err);
}

/* Likewise density grids, which no technique has that traces shadows. */
static bool light_smoke(const struct shade_desc *desc, const struct surface_lighter *lighter,
                        struct error *err)
{
    if (!smoke_is_lit(desc->frame))
        return true;
    const struct surface_set set = smoke_set(desc->frame);
    return smoke_begin(desc->frame, desc->yield, err) &&
           lighter->light(lighter->context, &set, err);
}

/* Lights transparent surfaces, then haze and grids, then opaque samples, whose program composites
 * all. */
static bool light_all(const struct shade_desc *desc, const struct surface_lighter *lighter,
                      struct error *err)
{
    const struct surface_set opaque = opaque_samples_of(desc->frame);
    return desc->layers->method->light(desc->layers, desc->frame, desc->items, lighter, err) &&
           light_atmosphere(desc, lighter, err) && light_smoke(desc, lighter, err) &&
           lighter->light(lighter->context, &opaque, err);
}

/* Lights the window, or that piece of it, with filters that rays find for one chunk of the lights
 * at a time. */
static bool light_traced(struct lighting *lighting, uint32_t chunk_count,
                         const struct apart_piece *piece, struct error *err)
{
    const struct shade_desc *desc = lighting->desc;
    const struct surface_lighter lighter = {
        .context = lighting, .is_continued = desc->is_continued, .light = light_chunk_of_set};
    if (!piece && atmosphere_is_lit(desc->frame) &&
        !atmosphere_trace(desc->frame, desc->traced, err))
        return false;
    begin_chunks(lighting);
    for (uint32_t i = 0; i < chunk_count; i++, next_chunk(lighting)) {
        set_last(lighting, i + 1 == chunk_count);
        lighting_tell(lighting, 0);
        const struct shadow_chunk chunk = {.frame = desc->frame,
                                           .lists = desc->lists,
                                           .first = lighting->chunk.first,
                                           .count = lighting->chunk.count};
        if (!traced_shadows_find(desc->traced, &chunk, err))
            return false;
        lighting->part++;
        if (piece) {
            const struct surface_set set = apart_set(desc, piece);
            if (!lighting_run(lighting, &set, err))
                return false;
        } else if (!light_all(desc, &lighter, err)) {
            return false;
        }
    }
    return true;
}

/* Lights all sets of the window, or samples apart, with all chunks. piece: NULL: all sets. */
static bool light_chunks(struct lighting *lighting, uint32_t chunk_count,
                         const struct apart_piece *piece, struct error *err)
{
    struct chunk_walk walk = {.lighting = lighting, .count = chunk_count};
    const struct surface_lighter lighter = {
        .context = &walk, .is_continued = lighting->desc->is_continued, .light = light_set};
    if (lighting->desc->traced)
        return light_traced(lighting, chunk_count, piece, err);
    if (!piece)
        return light_all(lighting->desc, &lighter, err);
    const struct surface_set set = apart_set(lighting->desc, piece);
    return light_set(&walk, &set, err);
}

/* ---- samples apart ---- */

/* Points of `*count` pixels, or of fewer: as many as have room for a light at once. */
static bool collect_piece(const struct shade_desc *desc, struct apart_piece *piece,
                          struct error *err)
{
    const struct clusters *clusters = light_lists_clusters(desc->lists);
    for (;;) {
        if (!traced_shadows_collect_apart(desc->traced, desc->frame, piece->first, piece->count,
                                          err))
            return false;
        if (piece->count <= 64 || !clusters->longest || traced_shadows_room(desc->traced, clusters))
            return true;
        piece->count = (piece->count / 2 + 63) / 64 * 64;
    }
}

/* With traced shadows of their own: no more pixels at a time than what the points of the window had
 * room for. */
static bool light_apart_traced(struct shade *shade, const struct shade_desc *desc,
                               struct error *err)
{
    struct lighting lighting = {.shade = shade, .desc = desc, .parts = 1};
    uint32_t end = apart_count(desc->frame), chunk_count;
    uint32_t room = traced_shadows_apart_room(desc->traced, desc->frame->targets->samples);
    struct apart_piece piece = {.first = 0};
    for (; piece.first < end; piece.first += piece.count) {
        piece.count = end - piece.first < room ? end - piece.first : room;
        if (!collect_piece(desc, &piece, err) ||
            (desc->seen && !traced_shadows_see(desc->seen, err)) ||
            !light_chunks_choose(desc, shade->loop_steps, &lighting.chunk, &chunk_count, err) ||
            (chunk_count > 1 && !targets_prepare_parts(desc->frame->targets, err)) ||
            !light_chunks(&lighting, chunk_count, &piece, err))
            return false;
    }
    return true;
}

/* Where all lights are in the picture: which samples are lit apart, and these where all lights are
 * at hand. */
static bool light_differing(struct lighting *lighting, uint32_t chunk_count, struct error *err)
{
    const struct shade_desc *desc = lighting->desc;
    const struct apart_piece all = {.first = 0};
    struct shade_desc apart = *desc;
    lighting->shade->has_apart = true;
    if (!apart_find(desc->frame, err))
        return false;
    if (desc->traced) { /* however many pieces these are */
        apart.advance = NULL;
        return light_apart_traced(lighting->shade, &apart, err);
    }
    return desc->is_continued || light_chunks(lighting, chunk_count, &all, err);
}

/* ---- the window ---- */

static bool prepare_targets(const struct shade_desc *desc, bool is_in_parts, bool may_differ,
                            struct error *err)
{
    struct targets *targets = desc->frame->targets;
    if (!is_in_parts)
        gl_texture_finish(&targets->parts);
    else if (!targets_prepare_parts(targets, err))
        return false;
    return !may_differ || targets_prepare_apart(targets, err);
}

bool shade_window(struct shade *shade, const struct shade_desc *desc, struct error *err)
{
    bool may_differ = apart_is_possible(desc->frame) && !desc->is_apart;
    bool is_batch = desc->is_continued || desc->continues;
    const struct apart_piece all = {.first = 0};
    struct lighting lighting = {.shade = shade, .desc = desc};
    uint32_t chunk_count;
    if (!light_chunks_choose(desc, shade->loop_steps, &lighting.chunk, &chunk_count, err) ||
        !prepare_targets(desc, chunk_count > 1 || is_batch, may_differ, err))
        return false;
    if (desc->frame->round == 0) /* the others add to what it counts */
        gl_buffer_clear_u32(&shade->statistics, 0, STATISTICS_WORDS * 4, 0);
    desc->frame->report->counts.light_chunks += desc->is_apart ? 0 : chunk_count;
    int sets = desc->is_apart
                   ? 1
                   : 1 + (desc->traced != NULL) + desc->layers->method->count_sets(desc->layers) +
                         (!desc->traced && atmosphere_is_lit(desc->frame)) +
                         atmosphere_glow_is_there(desc->frame) + smoke_is_lit(desc->frame) +
                         (may_differ && !desc->traced && !is_batch);
    lighting.parts = (int)chunk_count * sets;
    shade->has_apart = desc->is_apart;
    if (!light_chunks(&lighting, chunk_count, desc->is_apart ? &all : NULL, err) ||
        (may_differ && !desc->continues && !light_differing(&lighting, chunk_count, err)))
        return false;
    if (is_batch)
        take_lookups(shade, desc);
    return true;
}

bool shade_send_color(struct shade *shade, struct readback *readback,
                      const struct readback_desc *desc, struct error *err)
{
    struct readback_desc whole = *desc;
    if (shade->has_apart)
        gl_buffer_copy(&desc->frame->targets->apart, apart_count_bytes_at(desc->frame->targets),
                       &shade->statistics, STATISTICS_COUNTS * 4, 4);
    whole.counts = &shade->statistics;
    whole.counts_offset_bytes = STATISTICS_COUNTS * 4;
    return readback_send(readback, &whole, err);
}

void shade_finish(struct shade *shade)
{
    gl_buffer_finish(&shade->lights);
    gl_buffer_finish(&shade->statistics);
    light_areas_finish(&shade->areas);
}
