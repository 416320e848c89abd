/* SPDX-License-Identifier: MIT */
/* Shadow volumes as a finder of shadows: Kim, Kim and Turk, "Real Time Shadow of Transparent
 * Casters Using Shadow Volume", for every point of a window. What light loses to the casters of a
 * point is a sum of integers: what it loses on its way to the eye, and what the way from the eye to
 * the point gains where it crosses faces of the casters' volumes. shaders/shadows/volume.glsl has
 * the geometry. */
#include "renderer/shadows/shadow_finder.h"

#include <assert.h>
#include <epoxy/gl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "renderer/base/wall_clock.h"
#include "renderer/shadows/shadow_traced.h"
#include "renderer/shadows/volume_casters.h"
#include "renderer/transparency/method.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

enum {
    START_BYTES = 16,
    SUM_BYTES = 24,
    FACE_BYTES = 32,
    SPAN_BYTES = 8,
    SPAN_TILES_LEAST = 8,
    SPAN_TILES_MOST = 64,
    LOOP_STEPS = 60000, /* of an invocation: fewer than any device allows */
    SAMPLES_MOST = 4,   /* of a pixel of the window */
    COUNTER_BYTES = 4 * VOLUME_COUNTERS,
    SPANS_FIRST = 1 << 14,
    DEFINES_BYTES = 64,
};

enum {
    VERTICES,
    EDGES,
    SIDES,
    TRIANGLES,
    WEIGHTS,
    REACH,
    LIGHTS,
    FACES,
    SPANS,
    STARTS,
    SUMS,
    COUNTERS,
    BUFFERS
};

static const char *const labels[BUFFERS] = {
    "shadow.volume.vertices",  "shadow.volume.edges", "shadow.volume.sides",
    "shadow.volume.triangles", "shadow.volume.items", "shadow.volume.reach",
    "shadow.volume.lights",    "shadow.volume.faces", "shadow.volume.spans",
    "shadow.volume.starts",    "shadow.volume.sums",  "shadow.volume.counters"};

struct volumes {
    struct volume_casters casters; /* kept while their key is the same */
    struct gl_buffer buffers[BUFFERS];
    bool is_uploaded; /* edges, sides and triangles are those of the casters */
    uint64_t span_room;

    /* of the frame */
    const struct scene_state *state;
    const struct camera *camera;
    bool *is_shadowed;   /* owned */
    bool is_kept;        /* the casters stood already */
    uint64_t most_spans; /* of a pass */
    double build_ms;
    double nudge_m;
};

static bool reserve(struct volumes *volumes, int buffer, uint64_t bytes, bool is_uploaded,
                    struct error *err)
{
    return gl_buffer_reserve(&volumes->buffers[buffer],
                             &(struct gl_buffer_desc){.label = labels[buffer],
                                                      .size_bytes = bytes,
                                                      .is_uploaded = is_uploaded,
                                                      .is_dynamic = !is_uploaded},
                             false, err);
}

static bool upload(struct volumes *volumes, int buffer, const void *data, uint64_t bytes,
                   struct error *err)
{
    if (!reserve(volumes, buffer, bytes, true, err))
        return false;
    if (bytes)
        gl_buffer_write(&volumes->buffers[buffer], 0, bytes, data);
    return true;
}

/* ---- the casters ---- */

static bool check_room(const struct volume_casters *casters, const struct gl_limits *limits,
                       struct error *err)
{
    uint64_t most = gl_limits_block(limits, FACE_BYTES);
    uint64_t faces = casters->edge_count + casters->triangle_count;
    return faces <= most ||
           error_set(err, ERROR_OVER_BUDGET,
                     "shadow volumes of %llu edges and triangles, and a storage block of %llu "
                     "bytes has room for %llu",
                     (unsigned long long)faces, (unsigned long long)limits->max_storage_block_bytes,
                     (unsigned long long)most);
}

static bool take_casters(struct volumes *volumes, const struct shadow_finding *finding,
                         struct error *err)
{
    const struct content_key key = volume_casters_key(volumes->state, finding->scene_key);
    struct volume_casters *casters = &volumes->casters;
    volumes->is_kept = content_key_equals(key, casters->key);
    if (volumes->is_kept)
        return true;
    volumes->is_uploaded = false;
    volume_casters_finish(casters);
    if (!volume_casters_init(casters, volumes->state, err) ||
        !check_room(casters, finding->limits, err))
        return false;
    casters->key = key;
    return true;
}

static bool upload_casters(struct volumes *volumes, struct error *err)
{
    const struct volume_casters *casters = &volumes->casters;
    volumes->is_uploaded =
        volumes->is_uploaded || (upload(volumes, EDGES, casters->edges,
                                        casters->edge_count * sizeof *casters->edges, err) &&
                                 upload(volumes, SIDES, casters->sides,
                                        casters->side_count * sizeof *casters->sides, err) &&
                                 upload(volumes, TRIANGLES, casters->triangles,
                                        casters->triangle_count * sizeof *casters->triangles, err));
    return volumes->is_uploaded;
}

/* In view space, where the eye is the origin: what f32 rounds off is seen under a small angle. */
static bool upload_vertices(struct volumes *volumes, struct error *err)
{
    const struct volume_casters *casters = &volumes->casters;
    float(*placed)[4] = malloc((casters->vertex_count + 1) * sizeof *placed);
    double axes[3][3], offset[3];
    if (!placed)
        return error_set(err, ERROR_NO_MEMORY, "%zu vertices of shadow volumes",
                         casters->vertex_count);
    camera_axes(volumes->camera, axes);
    for (size_t i = 0; i < casters->vertex_count; i++) {
        vec3_sub(casters->vertices[i], volumes->camera->eye, offset);
        for (int k = 0; k < 3; k++)
            placed[i][k] = (float)vec3_dot(axes[k], offset);
        placed[i][3] = 1;
    }
    bool ok = upload(volumes, VERTICES, placed, casters->vertex_count * sizeof *placed, err);
    free(placed);
    return ok;
}

static bool upload_weights(struct volumes *volumes, enum view_blend_filter blend, struct error *err)
{
    const struct scene_state *state = volumes->state;
    struct volume_weight *weights = calloc(state->item_count + 1, sizeof *weights);
    if (!weights)
        return error_set(err, ERROR_NO_MEMORY, "%zu casters", state->item_count);
    for (size_t i = 0; i < state->item_count; i++)
        if (state->items[i].casts_shadow)
            weights[i] = volume_weight_of(state, &state->items[i], blend);
    bool ok = upload(volumes, WEIGHTS, weights, state->item_count * sizeof *weights, err);
    free(weights);
    return ok;
}

/* Words of a light. */
static uint32_t reach_words(const struct scene_state *state)
{
    return (uint32_t)(state->item_count + 31) / 32;
}

static bool upload_reach(struct volumes *volumes, const struct shadow_needs *needs,
                         struct error *err)
{
    size_t each = reach_words(volumes->state), count = needs->light_count * each;
    uint32_t *words = calloc(count + 1, sizeof *words);
    if (!words)
        return error_set(err, ERROR_NO_MEMORY, "casters of %zu lights", needs->light_count);
    for (size_t i = 0; i < needs->light_count; i++) {
        const struct shadow_casters *casters = &needs->lights[i].casters;
        for (size_t k = 0; k < casters->count; k++)
            words[i * each + casters->items[k] / 32] |= 1u << casters->items[k] % 32;
    }
    bool ok = upload(volumes, REACH, words, count * sizeof *words, err);
    free(words);
    return ok;
}

static bool upload_lights(struct volumes *volumes, const bool *is_shadowed, struct error *err)
{
    size_t count = volumes->state->light_count;
    uint32_t *words = calloc(count + 1, sizeof *words);
    volumes->is_shadowed = calloc(count + 1, sizeof *volumes->is_shadowed);
    bool ok = words && volumes->is_shadowed;
    if (!ok)
        error_set(err, ERROR_NO_MEMORY, "%zu lights", count);
    for (size_t i = 0; ok && i < count; i++)
        words[i] = volumes->is_shadowed[i] = is_shadowed[i];
    ok = ok && upload(volumes, LIGHTS, words, count * sizeof *words, err);
    free(words);
    return ok;
}

/* As rays have it (renderer/raytrace/rt_scene.c). */
static double find_nudge(const struct scene_state *state)
{
    double diagonal[3] = {0};
    if (state->bounds_min[0] <= state->bounds_max[0])
        vec3_sub(state->bounds_max, state->bounds_min, diagonal);
    return 1e-6 * 0.5 * vec3_length(diagonal);
}

static bool begin(struct traced_shadows *traced, const struct shadow_finding *finding,
                  struct error *err)
{
    struct volumes *volumes = traced->own;
    double begin_ms = wall_ms();
    if (!volumes)
        volumes = traced->own = calloc(1, sizeof *volumes);
    if (!volumes)
        return error_set(err, ERROR_NO_MEMORY, "shadow volumes");
    volumes->state = finding->desc->state;
    volumes->camera = finding->desc->camera;
    volumes->nudge_m = find_nudge(volumes->state);
    volumes->most_spans = 0;
    bool ok = take_casters(volumes, finding, err) && upload_casters(volumes, err) &&
              upload_vertices(volumes, err) &&
              upload_weights(volumes, finding->desc->view->quality.blend_filter, err) &&
              upload_reach(volumes, finding->needs, err) &&
              upload_lights(volumes, finding->is_shadowed, err);
    volumes->build_ms = wall_ms() - begin_ms;
    return ok;
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
    for (int i = 0; volumes && i < BUFFERS; i++)
        bytes += volumes->buffers[i].size_bytes;
    return bytes;
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

/* ---- programs ---- */

enum program { PLACE, EYE, STARTS_OF_LIGHT, FACES_OF_LIGHT, COVER, FILTERS, PROGRAMS };

static struct program_desc program_of(bool is_orthographic, enum program program,
                                      char defines[DEFINES_BYTES])
{
    static const struct {
        const char *file;
        bool walks_lists;
    } programs[PROGRAMS] = {
        [PLACE] = {"volume_place.comp.glsl", true},
        [EYE] = {"volume_eye.comp.glsl", false},
        [STARTS_OF_LIGHT] = {"volume_starts.comp.glsl", true},
        [FACES_OF_LIGHT] = {"volume_faces.comp.glsl", false},
        [COVER] = {"volume_cover.comp.glsl", false},
        [FILTERS] = {"volume_filters.comp.glsl", true},
    };
    const char *lists = light_lists_technique_defines(VIEW_LIGHT_LISTS_CLUSTERED);
    bool is_flat = is_orthographic && program != PLACE && program != FILTERS;
    snprintf(defines, DEFINES_BYTES, "%s%s%s", programs[program].walks_lists ? lists : "",
             programs[program].walks_lists && is_flat ? " " : "", is_flat ? "IS_ORTHOGRAPHIC" : "");
    return (struct program_desc){.label = programs[program].file,
                                 .compute = programs[program].file,
                                 .defines = defines[0] ? defines : NULL};
}

static void list_programs(const struct window_frame *frame, struct program_list *list)
{
    for (int i = 0; i < PROGRAMS; i++) {
        char defines[DEFINES_BYTES];
        const struct program_desc desc =
            program_of(frame->camera->is_orthographic, (enum program)i, defines);
        program_list_add(list, "shadow.volumes", &desc, true);
    }
}

static const struct gl_program *use(const struct shadow_chunk *chunk, enum program program,
                                    struct error *err)
{
    char defines[DEFINES_BYTES];
    const struct program_desc desc =
        program_of(chunk->frame->camera->is_orthographic, program, defines);
    const struct gl_program *found = program_cache_get(chunk->frame->programs, &desc, err);
    if (found)
        gl_program_use(found);
    return found;
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
};

static void place_light(struct light_pass *pass)
{
    const struct state_light *light = &pass->volumes->state->lights[pass->light];
    const struct camera *camera = pass->volumes->camera;
    double axes[3][3], offset[3];
    bool is_far = light->type == SCENE_LIGHT_DIRECTIONAL;
    camera_axes(camera, axes);
    vec3_sub(light->position, camera->eye, offset);
    for (int k = 0; k < 3; k++)
        pass->at[k] =
            (float)(is_far ? -vec3_dot(axes[k], light->direction) : vec3_dot(axes[k], offset));
    pass->at[3] = !is_far;
    /* so that no volume of a light at infinity is there */
    pass->eye = is_far && pass->at[2] < 0 ? -1 : 1;
}

static void bind_geometry(const struct light_pass *pass, const struct gl_program *program)
{
    static const struct {
        int buffer;
        uint32_t binding;
    } bound[] = {{VERTICES, BIND_VOLUME_VERTICES}, {EDGES, BIND_VOLUME_EDGES},
                 {SIDES, BIND_VOLUME_SIDES},       {TRIANGLES, BIND_VOLUME_TRIANGLES},
                 {WEIGHTS, BIND_VOLUME_WEIGHTS},   {FACES, BIND_VOLUME_FACES},
                 {SPANS, BIND_VOLUME_SPANS},       {STARTS, BIND_VOLUME_STARTS},
                 {REACH, BIND_VOLUME_REACH},       {SUMS, BIND_VOLUME_SUMS},
                 {COUNTERS, BIND_STATISTICS}};
    for (size_t i = 0; i < sizeof bound / sizeof *bound; i++)
        gl_buffer_bind_storage(&pass->volumes->buffers[bound[i].buffer], bound[i].binding);
    gl_program_set_f4(program, "u_light", pass->at);
    gl_program_set_f(program, "u_eye", pass->eye);
    gl_program_set_u(program, "u_reach", pass->light * reach_words(pass->volumes->state));
    gl_program_set_u(program, "u_edges", (uint32_t)pass->volumes->casters.edge_count);
}

static void bind_points(const struct light_pass *pass, const struct gl_program *program)
{
    struct traced_shadows *traced = pass->traced;
    const struct volumes *volumes = pass->volumes;
    gl_buffer_bind_storage(&traced->points, BIND_TRACED_POINTS);
    gl_buffer_bind_storage(&traced->table, BIND_VOLUME_TABLE);
    gl_buffer_bind_storage(&traced->filters, BIND_VOLUME_FILTERS);
    gl_buffer_bind_storage(&volumes->buffers[LIGHTS], BIND_VOLUME_LIGHTS);
    gl_buffer_bind_storage(&volumes->buffers[STARTS], BIND_VOLUME_STARTS);
    gl_buffer_bind_storage(&volumes->buffers[SUMS], BIND_VOLUME_SUMS);
    gl_buffer_bind_storage(&volumes->buffers[COUNTERS], BIND_STATISTICS);
    light_lists_bind(pass->chunk->lists, program);
    gl_program_set_u(program, "u_points", (uint32_t)traced->window.count);
    gl_program_set_u2(program, "u_light_chunk", pass->chunk->first, pass->chunk->count);
}

static void dispatch_points(const struct light_pass *pass)
{
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    window_dispatch_items(pass->traced->window.count);
}

static bool place_points(const struct light_pass *pass, struct error *err)
{
    const struct gl_program *program = use(pass->chunk, PLACE, err);
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
    const struct gl_program *program = use(pass->chunk, STARTS_OF_LIGHT, err);
    const struct window_frame *frame = pass->chunk->frame;
    if (!program)
        return false;
    bind_points(pass, program);
    gl_program_set_u(program, "u_index", pass->light);
    gl_program_set_u(program, "u_width_px", (uint32_t)frame->window.width);
    gl_program_set_f4(program, "u_light", pass->at);
    gl_program_set_f3(
        program, "u_offsets",
        (const float[3]){(float)pass->volumes->nudge_m, 5e-7f,
                         (float)(2 * frame->camera->half_height / frame->view->height_px)});
    dispatch_points(pass);
    return true;
}

static bool sum_eye(const struct light_pass *pass, struct error *err)
{
    const struct gl_program *program = use(pass->chunk, EYE, err);
    if (!program)
        return false;
    gl_buffer_clear_u32(&pass->volumes->buffers[COUNTERS], 0, COUNTER_BYTES, 0);
    bind_geometry(pass, program);
    gl_program_set_u(program, "u_triangles", (uint32_t)pass->volumes->casters.triangle_count);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    window_dispatch_items(pass->volumes->casters.triangle_count);
    return true;
}

static uint32_t span_tiles(const struct traced_shadows *traced)
{
    uint64_t tiles = LOOP_STEPS / (traced->longest_layers + SAMPLES_MOST);
    return tiles < SPAN_TILES_LEAST  ? SPAN_TILES_LEAST
           : tiles > SPAN_TILES_MOST ? SPAN_TILES_MOST
                                     : (uint32_t)tiles;
}

/* Finds the spans of some faces, and their number: those that have no room are left out. */
static bool find_spans(const struct light_pass *pass, uint64_t first, uint64_t end, uint32_t *found,
                       struct error *err)
{
    const struct window_frame *frame = pass->chunk->frame;
    struct volumes *volumes = pass->volumes;
    const struct gl_program *program = use(pass->chunk, FACES_OF_LIGHT, err);
    if (!program)
        return false;
    gl_buffer_clear_u32(&volumes->buffers[COUNTERS], 0, 4, 0);
    bind_geometry(pass, program);
    window_set_view_ray(frame, program);
    gl_program_set_u2(program, "u_faces", (uint32_t)first, (uint32_t)end);
    gl_program_set_u(program, "u_room", (uint32_t)volumes->span_room);
    gl_program_set_u(program, "u_span_tiles", span_tiles(pass->traced));
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    window_dispatch_items(end - first);
    gpu_timeline_will_wait(frame->timeline);
    *found = 0; /* a lost context reads nothing */
    gl_buffer_read(&volumes->buffers[COUNTERS], 0, 4, found);
    return true;
}

static bool reserve_spans(struct volumes *volumes, uint64_t spans, struct error *err)
{
    if (spans <= volumes->span_room)
        return true;
    if (!reserve(volumes, SPANS, spans * SPAN_BYTES, false, err))
        return false;
    volumes->span_room = volumes->buffers[SPANS].size_bytes / SPAN_BYTES;
    return true;
}

static bool cover(const struct light_pass *pass, uint32_t spans, struct error *err)
{
    const struct window_frame *frame = pass->chunk->frame;
    const struct traced_shadows *traced = pass->traced;
    const struct gl_program *program = use(pass->chunk, COVER, err);
    if (!program)
        return false;
    bind_geometry(pass, program);
    gl_buffer_bind_storage(&traced->heads, BIND_TRACED_HEADS);
    gl_buffer_bind_storage(traced->layer_ends ? traced->layer_ends : &traced->heads,
                           BIND_VOLUME_ENDS);
    gl_program_set_u2(program, "u_size_px", (uint32_t)frame->window.width,
                      (uint32_t)frame->window.height);
    gl_program_set_u(program, "u_spans", spans);
    gl_program_set_u(program, "u_layers", (uint32_t)traced->window.layer_count);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    window_dispatch_items((uint64_t)spans * 64);
    return true;
}

/* Faces by the dozen thousands, fewer at once where their spans have no room in a storage block. */
static bool cross_faces(const struct light_pass *pass, struct error *err)
{
    struct volumes *volumes = pass->volumes;
    uint64_t most = gl_limits_block(pass->chunk->frame->limits, SPAN_BYTES);
    uint64_t count = volumes->casters.edge_count + volumes->casters.triangle_count, taken = count;
    for (uint64_t first = 0; first < count;) {
        uint64_t end = first + taken < count ? first + taken : count;
        uint32_t spans;
        if (!find_spans(pass, first, end, &spans, err))
            return false;
        if (spans > most && end - first > 1) {
            taken = (end - first) / 2;
            continue;
        }
        if (spans > volumes->span_room) {
            if (!reserve_spans(volumes, spans, err) || !find_spans(pass, first, end, &spans, err))
                return false;
        }
        if (spans > volumes->most_spans)
            volumes->most_spans = spans;
        if (spans && !cover(pass, spans, err))
            return false;
        first = end;
    }
    return true;
}

static bool write_filters(const struct light_pass *pass, struct error *err)
{
    const struct gl_program *program = use(pass->chunk, FILTERS, err);
    if (!program)
        return false;
    bind_points(pass, program);
    dispatch_points(pass);
    return true;
}

static bool find_light(struct light_pass *pass, struct error *err)
{
    place_light(pass);
    return sum_eye(pass, err) && start_points(pass, err) && cross_faces(pass, err) &&
           write_filters(pass, err);
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

static bool find(struct traced_shadows *traced, const struct shadow_chunk *chunk,
                 uint64_t *filter_count, struct error *err)
{
    struct volumes *volumes = traced->own;
    const struct clusters *clusters = light_lists_clusters(chunk->lists);
    struct light_pass pass = {.traced = traced, .volumes = volumes, .chunk = chunk};
    uint64_t points = traced->window.count;
    uint64_t faces = volumes->casters.edge_count + volumes->casters.triangle_count;
    pass.stride = chunk->count < clusters->longest ? chunk->count : clusters->longest;
    *filter_count = points * pass.stride;
    if (!traced_shadows_reserve(traced, *filter_count, err) ||
        !reserve(volumes, STARTS, points * START_BYTES, false, err) ||
        !reserve(volumes, SUMS, points * SUM_BYTES, false, err) ||
        !reserve(volumes, FACES, faces * FACE_BYTES, false, err) ||
        !reserve(volumes, COUNTERS, COUNTER_BYTES, false, err) ||
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
           casters->edge_count * (sizeof *casters->edges + FACE_BYTES) +
           casters->triangle_count * (sizeof *casters->triangles + FACE_BYTES) +
           casters->side_count * sizeof *casters->sides +
           state->item_count * sizeof(struct volume_weight) +
           state->light_count * sizeof(uint32_t) * (1 + (uint64_t)reach_words(state)) +
           volumes->most_spans * SPAN_BYTES + COUNTER_BYTES;
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
    for (int i = is_in_frame ? FACES : VERTICES; volumes && i < BUFFERS; i++)
        gl_buffer_finish(&volumes->buffers[i]);
    if (!volumes)
        return;
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

const struct shadow_finder shadow_finder_volume = {
    .point_bytes = START_BYTES + SUM_BYTES,
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
