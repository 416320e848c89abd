/* SPDX-License-Identifier: MIT */
/* Shadow volumes as a finder of shadows: Kim, Kim and Turk, "Real Time Shadow of Transparent
 * Casters Using Shadow Volume", for every point of a window; and with whole multiplicities of
 * silhouettes, Lexolights, Peciva (docs/explanation/shading.md, "Silhouettes"). What light loses to
 * the casters of a point is a sum of integers: what it loses on its way to the eye, and what the
 * way from the eye to the point gains where it crosses faces of the casters' volumes.
 * shaders/shadows/volume.glsl has the geometry. */
#include "renderer/shadows/shadow_finder.h"

#include <assert.h>
#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "renderer/shadows/shadow_traced.h"
#include "renderer/shadows/volume_drawing.h"
#include "renderer/shadows/volume_programs.h"
#include "renderer/shadows/volumes.h"
#include "renderer/transparency/method.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

enum {
    START_BYTES = 16,
    SUM_BYTES = 24,
    SPAN_BYTES = 8,
    SPAN_TILES_LEAST = 8,
    SPAN_TILES_MOST = 64,
    LOOP_STEPS = 60000, /* of an invocation: fewer than any device allows */
    SAMPLES_MOST = 4,   /* of a pixel of the window */
    COUNTER_BYTES = 4 * VOLUME_COUNTERS,
    SPANS_FIRST = 1 << 14,
    TILE_BYTES = 4,
};

static bool begin(struct traced_shadows *traced, const struct shadow_finding *finding,
                  struct error *err)
{
    struct volumes *volumes = traced->own;
    if (!volumes)
        volumes = traced->own = calloc(1, sizeof *volumes);
    if (!volumes)
        return error_set(err, ERROR_NO_MEMORY, "shadow volumes");
    volumes->form =
        volume_form_of(traced->finder == &shadow_finder_silhouette, finding->desc->view);
    volumes->drawn_by = finding->desc->view->quality.silhouette_form;
    return volumes_begin(volumes, finding, err);
}

static void end(struct traced_shadows *traced)
{
    struct volumes *volumes = traced->own;
    if (!volumes)
        return;
    free(volumes->is_shadowed);
    volumes->is_shadowed = NULL;
}

static uint64_t size_bytes(const struct traced_shadows *traced)
{
    const struct volumes *volumes = traced->own;
    uint64_t bytes = 0;
    for (int i = 0; volumes && i < VOLUME_BUFFERS; i++)
        bytes += volumes->buffers[i].size_bytes;
    return bytes + (volumes ? volume_drawing_size_bytes(&volumes->drawing) : 0);
}

static uint32_t filters(const struct traced_shadows *traced, size_t light)
{
    const struct volumes *volumes = traced->own;
    return volumes->is_shadowed[light];
}

static uint32_t room(const struct traced_shadows *traced, const struct clusters *clusters,
                     size_t capacity)
{
    uint64_t points = traced->window.count ? traced->window.count : 1;
    uint64_t most = capacity / points;
    return most < clusters->longest ? (uint32_t)most : clusters->longest;
}

static void list_programs(const struct window_frame *frame, struct program_list *list)
{
    volume_programs_list(frame, false, list);
}

static void list_counting_programs(const struct window_frame *frame, struct program_list *list)
{
    volume_programs_list(frame, true, list);
}

/* ---- a light ---- */

struct light_pass {
    struct traced_shadows *traced;
    struct volumes *volumes;
    const struct shadow_chunk *chunk;
    uint32_t light;
    float at[4]; /* view space, homogeneous */
    float eye;   /* u_eye of volume.glsl */
    uint32_t stride;
    uint32_t first_group; /* of those that are counted */
    const struct volume_chunk *casters;
    size_t casters_at;   /* which of the chunks */
    uint32_t edges;      /* of the silhouette */
    uint32_t turn, slot; /* of a stencil: the group, and the point of each pixel */
};

static const struct gl_program *use(const struct light_pass *pass, enum volume_program program,
                                    struct error *err)
{
    const struct window_frame *frame = pass->chunk->frame;
    enum volume_form form = pass->volumes->form;
    if (form == VOLUME_COUNTS && !pass->volumes->group_count)
        form = VOLUME_SUMS;
    return volume_program_use(frame, form, program, err);
}

/* No more than a storage block takes: what grew may have more than is asked for. */
static void bind_block(const struct light_pass *pass, enum volume_buffer buffer, uint32_t binding)
{
    gl_buffer_bind_storage_range(&pass->volumes->buffers[buffer], 0,
                                 gl_limits_block(pass->chunk->frame->limits, 1), binding);
}

static void bind_geometry(const struct light_pass *pass, const struct gl_program *program)
{
    static const struct {
        enum volume_buffer buffer;
        uint32_t binding;
    } bound[] = {{BUFFER_WEIGHTS, BIND_VOLUME_WEIGHTS}, {BUFFER_FACES, BIND_VOLUME_FACES},
                 {BUFFER_SPANS, BIND_VOLUME_SPANS},     {BUFFER_STARTS, BIND_VOLUME_STARTS},
                 {BUFFER_SMALL, BIND_VOLUME_SMALL},     {BUFFER_TILES, BIND_VOLUME_TILES},
                 {BUFFER_REACH, BIND_VOLUME_REACH},     {BUFFER_SUMS, BIND_VOLUME_SUMS},
                 {BUFFER_COUNTERS, BIND_STATISTICS}};
    for (size_t i = 0; i < sizeof bound / sizeof *bound; i++)
        bind_block(pass, bound[i].buffer, bound[i].binding);
    volumes_bind_chunk(pass->volumes, pass->casters_at);
    gl_program_set_f4(program, "u_light", pass->at);
    gl_program_set_f(program, "u_eye", pass->eye);
    gl_program_set_u(program, "u_reach", pass->light * volumes_reach_words(pass->volumes->state));
    gl_program_set_u(program, "u_edges", pass->edges);
    gl_program_set_u(program, "u_first_group", pass->first_group);
}

static void bind_points(const struct light_pass *pass, const struct gl_program *program)
{
    struct traced_shadows *traced = pass->traced;
    gl_buffer_bind_storage(&traced->points, BIND_TRACED_POINTS);
    gl_buffer_bind_storage(&traced->table, BIND_VOLUME_TABLE);
    gl_buffer_bind_storage(&traced->filters, BIND_VOLUME_FILTERS);
    bind_block(pass, BUFFER_LIGHTS, BIND_VOLUME_LIGHTS);
    bind_block(pass, BUFFER_STARTS, BIND_VOLUME_STARTS);
    bind_block(pass, BUFFER_SUMS, BIND_VOLUME_SUMS);
    bind_block(pass, BUFFER_COUNTERS, BIND_STATISTICS);
    bind_block(pass, BUFFER_TILES, BIND_VOLUME_TILES);
    bind_block(pass, BUFFER_GROUPS, BIND_VOLUME_GROUPS);
    light_lists_bind(pass->chunk->lists, program);
    gl_program_set_u(program, "u_points", (uint32_t)traced->window.count);
    gl_program_set_u2(program, "u_light_chunk", pass->chunk->first, pass->chunk->count);
}

static uint32_t tiles_x(const struct window_frame *frame)
{
    return (uint32_t)(frame->window.width + (int)VOLUME_TILE_PX - 1) / (int)VOLUME_TILE_PX;
}

static uint64_t window_tiles(const struct window_frame *frame)
{
    return (uint64_t)tiles_x(frame) *
           (uint32_t)((frame->window.height + (int)VOLUME_TILE_PX - 1) / (int)VOLUME_TILE_PX);
}

static void dispatch_points(const struct light_pass *pass)
{
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    window_dispatch_items(pass->traced->window.count);
}

static bool place_points(const struct light_pass *pass, struct error *err)
{
    const struct gl_program *program = use(pass, PROGRAM_PLACE, err);
    if (!program)
        return false;
    bind_points(pass, program);
    gl_program_set_u(program, "u_width_px", (uint32_t)pass->chunk->frame->window.width);
    gl_program_set_u(program, "u_stride", pass->stride);
    dispatch_points(pass);
    return true;
}

static bool start_points(const struct light_pass *pass, struct error *err)
{
    const struct gl_program *program = use(pass, PROGRAM_STARTS_OF_LIGHT, err);
    const struct window_frame *frame = pass->chunk->frame;
    if (!program)
        return false;
    gl_buffer_clear_u32(&pass->volumes->buffers[BUFFER_TILES], 0, window_tiles(frame) * TILE_BYTES,
                        0);
    float cone[4], range_m;
    volumes_light_reach(pass->volumes, pass->light, cone, &range_m);
    bind_points(pass, program);
    window_set_view_ray(frame, program);
    gl_program_set_u(program, "u_index", pass->light);
    gl_program_set_f4(program, "u_cone", cone);
    gl_program_set_f(program, "u_range", range_m);
    gl_program_set_u(program, "u_width_px", (uint32_t)frame->window.width);
    gl_program_set_f4(program, "u_light", pass->at);
    gl_program_set_f(program, "u_eye", pass->eye);
    gl_program_set_f3(
        program, "u_offsets",
        (const float[3]){(float)pass->volumes->nudge_m, 5e-7f,
                         (float)(2 * frame->camera->half_height / frame->view->height_px)});
    dispatch_points(pass);
    return true;
}

static void take_chunk(struct light_pass *pass, size_t chunk)
{
    pass->casters_at = chunk;
    pass->casters = &pass->volumes->casters.chunks[chunk];
    pass->edges = 0; /* a lost context reads nothing */
}

/* On which side of all triangles the light is, and what it loses on its way to the eye. */
static bool find_signs(struct light_pass *pass, struct error *err)
{
    const struct gl_program *program = use(pass, PROGRAM_SIGNS_OF_LIGHT, err);
    if (!program)
        return false;
    gl_buffer_clear_u32(&pass->volumes->buffers[BUFFER_COUNTERS], 0, COUNTER_BYTES, 0);
    for (size_t i = 0; i < pass->volumes->casters.chunk_count; i++) {
        take_chunk(pass, i);
        bind_geometry(pass, program);
        gl_program_set_u(program, "u_triangles", (uint32_t)pass->casters->triangles.count);
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
        window_dispatch_items(pass->casters->triangles.count);
    }
    return true;
}

/* The silhouette of a chunk of the casters; where faces are drawn, all its edges. */
static bool find_edges(struct light_pass *pass, struct error *err)
{
    struct gl_buffer *counters = &pass->volumes->buffers[BUFFER_COUNTERS];
    const struct gl_program *program = use(pass, PROGRAM_EDGES_OF_LIGHT, err);
    if (!program)
        return false;
    if (pass->casters_at > 0)
        gl_buffer_clear_u32(counters, 4 * VOLUME_EDGES, 4, 0);
    bind_geometry(pass, program);
    gl_program_set_u(program, "u_edge_count", (uint32_t)pass->casters->edges.count);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    window_dispatch_items(pass->casters->edges.count);
    if (volume_form_is_drawn(pass->volumes->form)) {
        pass->edges = (uint32_t)pass->casters->edges.count;
        return true;
    }
    gpu_timeline_will_wait(pass->chunk->frame->timeline);
    gl_buffer_read(counters, 4 * VOLUME_EDGES, 4, &pass->edges);
    return true;
}

static uint32_t span_tiles(const struct traced_shadows *traced)
{
    uint64_t tiles = LOOP_STEPS / (traced->longest_layers + SAMPLES_MOST);
    return tiles < SPAN_TILES_LEAST  ? SPAN_TILES_LEAST
           : tiles > SPAN_TILES_MOST ? SPAN_TILES_MOST
                                     : (uint32_t)tiles;
}

/* What faces cover: spans of tiles, of which those that have no room are left out, and few pixels.
 */
struct covered {
    uint32_t spans, small;
};

static bool find_spans(const struct light_pass *pass, uint64_t first, uint64_t end,
                       struct covered *found, struct error *err)
{
    const struct window_frame *frame = pass->chunk->frame;
    struct volumes *volumes = pass->volumes;
    struct gl_buffer *counters = &volumes->buffers[BUFFER_COUNTERS];
    const struct gl_program *program = use(pass, PROGRAM_FACES_OF_LIGHT, err);
    if (!program)
        return false;
    gl_buffer_clear_u32(counters, 0, 4, 0);
    gl_buffer_clear_u32(counters, 4 * VOLUME_SMALL, 4, 0);
    bind_geometry(pass, program);
    window_set_view_ray(frame, program);
    gl_program_set_u2(program, "u_faces", (uint32_t)first, (uint32_t)end);
    gl_program_set_u(program, "u_room", (uint32_t)volumes->span_room);
    gl_program_set_u(program, "u_span_tiles", span_tiles(pass->traced));
    gl_program_set_u(program, "u_tiles_x", tiles_x(frame));
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    window_dispatch_items(end - first);
    gpu_timeline_will_wait(frame->timeline);
    uint32_t words[VOLUME_COUNTERS] = {0}; /* a lost context reads nothing */
    gl_buffer_read(counters, 0, sizeof words, words);
    *found = (struct covered){.spans = words[0], .small = words[VOLUME_SMALL]};
    return true;
}

static bool reserve_spans(struct volumes *volumes, uint64_t spans, struct error *err)
{
    if (spans <= volumes->span_room)
        return true;
    if (!volumes_reserve(volumes, BUFFER_SPANS, spans * SPAN_BYTES, err))
        return false;
    volumes->span_room = volumes->buffers[BUFFER_SPANS].size_bytes / SPAN_BYTES;
    return true;
}

static void bind_pixels(const struct light_pass *pass, const struct gl_program *program)
{
    const struct traced_shadows *traced = pass->traced;
    const struct window_frame *frame = pass->chunk->frame;
    gl_buffer_bind_storage(&traced->heads, BIND_TRACED_HEADS);
    gl_buffer_bind_storage(traced->layer_ends ? traced->layer_ends : &traced->heads,
                           BIND_VOLUME_ENDS);
    gl_program_set_u2(program, "u_size_px", (uint32_t)frame->window.width,
                      (uint32_t)frame->window.height);
    gl_program_set_u(program, "u_layers", (uint32_t)traced->window.layer_count);
}

/* program: PROGRAM_COVER, whose groups take a span each, or PROGRAM_COVER_SMALL, whose invocations
 * take a face. */
static bool cover(const struct light_pass *pass, enum volume_program which, uint32_t count,
                  struct error *err)
{
    const struct gl_program *program = use(pass, which, err);
    if (!program)
        return false;
    bind_geometry(pass, program);
    if (which == PROGRAM_COVER_SMALL)
        bind_block(pass, BUFFER_SMALL, BIND_VOLUME_SPANS);
    bind_pixels(pass, program);
    gl_program_set_u(program, "u_spans", count);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    window_dispatch_items(which == PROGRAM_COVER ? (uint64_t)count * 64 : count);
    return true;
}

/* Faces by the dozen thousands, fewer at once where their spans have no room in a storage block. */
static bool cross_faces(const struct light_pass *pass, struct error *err)
{
    struct volumes *volumes = pass->volumes;
    uint64_t most = gl_limits_block(pass->chunk->frame->limits, SPAN_BYTES);
    uint64_t count = pass->edges + pass->casters->triangles.count, taken = count;
    for (uint64_t first = 0; first < count;) {
        uint64_t end = first + taken < count ? first + taken : count;
        struct covered found;
        if (!find_spans(pass, first, end, &found, err))
            return false;
        if (found.spans > most && end - first > 1) {
            taken = (end - first) / 2;
            continue;
        }
        if (found.spans > volumes->span_room) {
            if (!reserve_spans(volumes, found.spans, err) ||
                !find_spans(pass, first, end, &found, err))
                return false;
        }
        if (found.spans > volumes->most_spans)
            volumes->most_spans = found.spans;
        if ((found.spans && !cover(pass, PROGRAM_COVER, found.spans, err)) ||
            (found.small && !cover(pass, PROGRAM_COVER_SMALL, found.small, err)))
            return false;
        first = end;
    }
    return true;
}

/* All faces of a chunk into pictures of half floats. */
static bool draw_faces(const struct light_pass *pass, struct error *err)
{
    struct volumes *volumes = pass->volumes;
    uint64_t faces = pass->edges + pass->casters->triangles.count;
    const struct gl_program *program = use(pass, PROGRAM_FACES_OF_LIGHT, err);
    if (!program)
        return false;
    bind_geometry(pass, program);
    gl_program_set_u2(program, "u_faces", 0, (uint32_t)faces);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    window_dispatch_items(faces);
    program = use(pass, PROGRAM_DRAW, err);
    if (!program)
        return false;
    bind_geometry(pass, program);
    bind_pixels(pass, program);
    window_set_view_ray(pass->chunk->frame, program);
    volume_drawing_draw(&volumes->drawing, volumes->form, faces);
    return true;
}

static bool begin_pictures(const struct light_pass *pass, struct error *err)
{
    const struct window_frame *frame = pass->chunk->frame;
    struct volumes *volumes = pass->volumes;
    uint64_t pixels = (uint64_t)frame->window.width * (uint32_t)frame->window.height;
    if (!volume_drawing_reserve(&volumes->drawing, frame->window.width, frame->window.height, err))
        return false;
    volume_drawing_clear(&volumes->drawing, volumes->form);
    volumes->most_drawn = pixels > volumes->most_drawn ? pixels : volumes->most_drawn;
    return true;
}

static bool draw_quads(const struct light_pass *pass, enum volume_program which, struct error *err)
{
    const struct volume_chunk *casters = pass->casters;
    const struct gl_program *program = use(pass, which, err);
    if (!program)
        return false;
    bind_geometry(pass, program);
    bind_pixels(pass, program);
    gl_program_set_u(program, "u_edge_count", (uint32_t)casters->edges.count);
    gl_program_set_u(program, "u_turn", pass->turn);
    gl_program_set_u(program, "u_slot", pass->slot);
    window_set_view_ray(pass->chunk->frame, program);
    volume_drawing_add_counts(volume_program_is_tessellated(which),
                              volume_program_is_of_edges(which)
                                  ? casters->edges.count + casters->parts.count
                                  : casters->triangles.count);
    return true;
}

static bool draw_all_quads(struct light_pass *pass, struct error *err)
{
    const enum volume_program *programs = volume_programs_drawing(pass->volumes->drawn_by);
    for (size_t i = 0; i < pass->volumes->casters.chunk_count; i++) {
        take_chunk(pass, i);
        if (!draw_quads(pass, programs[0], err) ||
            (programs[1] != VOLUME_PROGRAMS && !draw_quads(pass, programs[1], err)))
            return false;
    }
    return true;
}

/* All faces, by the stages that the form has. */
static bool draw_counts(struct light_pass *pass, struct error *err)
{
    struct volumes *volumes = pass->volumes;
    const struct window_frame *frame = pass->chunk->frame;
    if (!volume_drawing_begin_counts(&volumes->drawing, frame->window.width, frame->window.height,
                                     false, err))
        return false;
    bool ok = draw_all_quads(pass, err);
    volume_drawing_end_counts();
    return ok;
}

/* way: u_way of volume_tally.comp.glsl. */
static bool add_stencil(const struct light_pass *pass, uint32_t way, struct error *err)
{
    const struct volumes *volumes = pass->volumes;
    const struct window_frame *frame = pass->chunk->frame;
    const struct gl_program *program = use(pass, PROGRAM_TALLY, err);
    if (!program)
        return false;
    bind_pixels(pass, program);
    bind_block(pass, BUFFER_SUMS, BIND_VOLUME_SUMS);
    bind_block(pass, BUFFER_COUNTERS, BIND_STATISTICS);
    gl_texture_bind(&volumes->drawing.stencil, UNIT_VOLUME_STENCIL);
    gl_program_set_u(program, "u_turn", pass->turn);
    gl_program_set_u(program, "u_slot", pass->slot);
    gl_program_set_u(program, "u_way", way);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);
    window_dispatch_items((uint64_t)frame->window.width * (uint32_t)frame->window.height);
    return true;
}

/* One group of casters and one point of each pixel at a time. A group of so few triangles that the
 * stencil can count them all goes at once, up at front faces and down at back faces. Of a larger
 * one both are counted for themselves, as far as the stencil can. */
static bool draw_stencil_of(struct light_pass *pass, struct error *err)
{
    static const GLenum ways[][2] = {
        {GL_INCR_WRAP, GL_DECR_WRAP}, {GL_INCR, GL_KEEP}, {GL_KEEP, GL_INCR}};
    struct volumes *volumes = pass->volumes;
    const struct window_frame *frame = pass->chunk->frame;
    uint64_t triangles = volumes->group_triangles[pass->first_group + pass->turn];
    bool is_small = triangles <= VOLUME_STENCIL_MOST;
    for (uint32_t i = is_small ? 0 : 1; i < (is_small ? 1 : 3); i++) {
        if (!volume_drawing_begin_counts(&volumes->drawing, frame->window.width,
                                         frame->window.height, true, err))
            return false;
        volume_drawing_begin_stencil(&volumes->drawing, ways[i][0], ways[i][1]);
        bool ok = draw_all_quads(pass, err);
        volume_drawing_end_counts();
        if (!ok || !add_stencil(pass, i, err))
            return false;
    }
    return true;
}

static bool draw_stencil(struct light_pass *pass, struct error *err)
{
    const struct volumes *volumes = pass->volumes;
    uint32_t groups = (uint32_t)volumes->group_count - pass->first_group, has_overflowed = 0;
    uint32_t samples = pass->chunk->frame->view->quality.samples == 1 ? 1 : SAMPLES_MOST;
    uint32_t slots = (uint32_t)pass->traced->longest_layers + samples;
    for (pass->turn = 0; pass->turn < groups && pass->turn < VOLUME_BATCH; pass->turn++)
        for (pass->slot = 0; pass->slot < slots; pass->slot++)
            if (!draw_stencil_of(pass, err))
                return false;
    gpu_timeline_will_wait(pass->chunk->frame->timeline);
    gl_buffer_read(&volumes->buffers[BUFFER_COUNTERS], 4 * VOLUME_OVERFLOW, 4, &has_overflowed);
    return !has_overflowed ||
           error_set(err, ERROR_UNSUPPORTED,
                     "a way crosses %u faces of casters of one filter or more, and a stencil "
                     "counts no further: silhouette_form must not be stencil",
                     VOLUME_STENCIL_MOST);
}

static bool cross(struct light_pass *pass, struct error *err)
{
    const struct volumes *volumes = pass->volumes;
    bool is_drawn = volume_form_is_drawn(volumes->form);
    if (volumes_draw_counts(volumes))
        return volumes->drawn_by == VIEW_SILHOUETTE_STENCIL ? draw_stencil(pass, err)
                                                            : draw_counts(pass, err);
    if (is_drawn && !begin_pictures(pass, err))
        return false;
    for (size_t i = 0; i < volumes->casters.chunk_count; i++) {
        take_chunk(pass, i);
        if (!find_edges(pass, err) || !(is_drawn ? draw_faces(pass, err) : cross_faces(pass, err)))
            return false;
    }
    return true;
}

static bool write_filters(const struct light_pass *pass, struct error *err)
{
    const struct gl_program *program = use(pass, PROGRAM_FILTERS, err);
    if (!program)
        return false;
    bind_points(pass, program);
    gl_program_set_u(program, "u_first_group", pass->first_group);
    if (volume_form_is_drawn(pass->volumes->form)) {
        volume_drawing_bind(&pass->volumes->drawing);
        gl_program_set_u(program, "u_width_px", (uint32_t)pass->chunk->frame->window.width);
        gl_program_set_u(program, "u_layers", (uint32_t)pass->traced->window.layer_count);
    }
    dispatch_points(pass);
    return true;
}

static bool find_light(struct light_pass *pass, struct error *err)
{
    volumes_place_light(pass->volumes, pass->light, pass->at, &pass->eye);
    pass->first_group = 0;
    do {
        if (!find_signs(pass, err) || !start_points(pass, err) || !cross(pass, err) ||
            !write_filters(pass, err))
            return false;
        pass->first_group += VOLUME_BATCH;
    } while (pass->first_group < pass->volumes->group_count);
    return true;
}

static bool find_lights(struct light_pass *pass, struct error *err)
{
    const struct volumes *volumes = pass->volumes;
    if (!place_points(pass, err))
        return false;
    for (size_t i = 0; i < volumes->state->light_count; i++) {
        pass->light = (uint32_t)i;
        if (volumes->is_shadowed[i] && !find_light(pass, err))
            return false;
    }
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
    return true;
}

/* Faces that are listed at once, before ways cross them. */
static uint64_t listed_faces(const struct volumes *volumes)
{
    return volumes_draw_counts(volumes) ? 0 : volumes->most_faces;
}

static bool find(struct traced_shadows *traced, const struct shadow_chunk *chunk,
                 uint64_t *filter_count, struct error *err)
{
    struct volumes *volumes = traced->own;
    const struct clusters *clusters = light_lists_clusters(chunk->lists);
    struct light_pass pass = {.traced = traced, .volumes = volumes, .chunk = chunk};
    uint64_t points = traced->window.count;
    uint64_t faces = listed_faces(volumes), tiles = window_tiles(chunk->frame);
    volumes->most_tiles = tiles > volumes->most_tiles ? tiles : volumes->most_tiles;
    pass.stride = chunk->count < clusters->longest ? chunk->count : clusters->longest;
    *filter_count = points * pass.stride;
    if (!traced_shadows_reserve(traced, *filter_count, err) ||
        !volumes_reserve(volumes, BUFFER_STARTS, points * START_BYTES, err) ||
        !volumes_reserve(volumes, BUFFER_SUMS, points * SUM_BYTES, err) ||
        !volumes_reserve(volumes, BUFFER_FACES, faces * VOLUME_FACE_BYTES, err) ||
        !volumes_reserve(volumes, BUFFER_SIGNS, volumes_triangle_bytes(volumes, VOLUME_SIGN_BYTES),
                         err) ||
        !volumes_reserve(volumes, BUFFER_SMALL, faces * SPAN_BYTES, err) ||
        !volumes_reserve(volumes, BUFFER_TILES, tiles * TILE_BYTES, err) ||
        !volumes_reserve(volumes, BUFFER_COUNTERS, COUNTER_BYTES, err) ||
        !reserve_spans(volumes, SPANS_FIRST, err))
        return false;
    gpu_scope_begin(chunk->frame->timeline,
                    &(struct gpu_scope_desc){.pass = "shadow.volumes",
                                             .because = "ways from the eye cross faces of volumes",
                                             .technique = traced->technique,
                                             .stage = REPORT_SHADOW});
    bool ok = !points || find_lights(&pass, err);
    gpu_scope_end(chunk->frame->timeline);
    return ok;
}

/* Beside the points, whatever frames before took. */
static uint64_t frame_bytes(const struct volumes *volumes)
{
    const struct volume_casters *casters = &volumes->casters;
    const struct scene_state *state = volumes->state;
    return casters->vertex_count * 4 * sizeof(float) +
           listed_faces(volumes) * (VOLUME_FACE_BYTES + SPAN_BYTES) +
           casters->edge_count * sizeof *casters->edges +
           casters->triangle_count * (sizeof *casters->triangles + VOLUME_SIGN_BYTES) +
           casters->side_count * sizeof *casters->sides +
           casters->part_count * sizeof *casters->parts +
           state->item_count * sizeof(struct volume_weight) +
           state->light_count * sizeof(uint32_t) * (1 + (uint64_t)volumes_reach_words(state)) +
           (volumes->group_count + VOLUME_BATCH) * 4 * sizeof(float) +
           volumes->most_tiles * TILE_BYTES + volumes->most_spans * SPAN_BYTES +
           volumes->most_drawn * VOLUME_DRAWN_BYTES + COUNTER_BYTES;
}

static void report(const struct traced_shadows *traced, const struct shadow_report *report)
{
    const struct volumes *volumes = traced->own;
    if (volumes->is_kept)
        report_add_reused(report->report, "shadow.edges");
    else
        report_add_pass(report->report, "shadow.edges", report->because, report->technique,
                        volumes->build_ms, REPORT_SHADOW);
    report_add_bytes(report->report, "shadow.volumes", frame_bytes(volumes));
}

static void free_buffers(struct traced_shadows *traced)
{
    struct volumes *volumes = traced->own;
    bool is_in_frame = volumes && volumes->is_shadowed; /* whose windows need the casters */
    for (int i = is_in_frame ? BUFFER_FACES : BUFFER_VERTICES; volumes && i < VOLUME_BUFFERS; i++)
        gl_buffer_finish(&volumes->buffers[i]);
    if (!volumes)
        return;
    volume_drawing_finish(&volumes->drawing);
    volumes->is_uploaded &= is_in_frame;
    volumes->span_room = 0;
}

static void finish(struct traced_shadows *traced)
{
    struct volumes *volumes = traced->own;
    if (!volumes)
        return;
    end(traced);
    free_buffers(traced);
    volume_casters_finish(&volumes->casters);
    free(volumes);
    traced->own = NULL;
}

#define FUNCTIONS                                                                               \
    .point_bytes = START_BYTES + SUM_BYTES, .begin = begin, .filters = filters, .room = room,   \
    .find = find, .report = report, .end = end, .size_bytes = size_bytes, .free = free_buffers, \
    .finish = finish

const struct shadow_finder shadow_finder_volume = {
    FUNCTIONS,
    .list_programs = list_programs,
};

/* Casters are counted by their filters. */
const struct shadow_finder shadow_finder_silhouette = {
    FUNCTIONS,
    .list_programs = list_counting_programs,
};
