/* SPDX-License-Identifier: MIT */
/* Exact lists of a window, their nodes counted, and once all are counted, written. */
#include "renderer/shadows/shadow_compress.h"

#include <epoxy/gl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "renderer/shadows/shadow_deep_job.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

#define TOGETHER 1e-6f /* shadow_compress.comp.glsl: relative to the distances involved */

struct compress_job {
    struct shadow_builder *builder;
    struct shadow_store *store; /* that the nodes go to */
    struct shadow_store work;   /* exact lists of a window */
    struct shadow_build *build; /* of the nodes */
    struct shadow_map fine;     /* of the window, at the resolution of its rays */
    const struct shadow_scene *scene;
    const char *because;
    bool is_writing; /* else counting */
};

bool shadow_compress_is_asked(const struct view_quality *quality)
{
    return quality->shadow_compression > 0 || quality->shadow_prefilter > 1;
}

void shadow_compress_choose(struct shadow_map *map, const struct shadow_casters *casters,
                            const struct view_quality *quality, double allowed)
{
    double error = quality->shadow_compression;
    int prefilter = quality->shadow_prefilter > 1 ? quality->shadow_prefilter : 1;
    if (error <= 0)
        error = allowed;
    if (error <= 0 && prefilter > 1)
        error = SHADOW_COMPRESSION_LEAST;
    if (casters->has_exclusions || error <= 0)
        return;
    map->flags = SHADOW_FLAG_NODES;
    map->has_media = casters->has_media;
    map->compression = error;
    map->prefilter = prefilter;
}

/* Bytes that an event of the exact lists takes. */
static uint64_t event_bytes(const struct shadow_map *map)
{
    return SHADOW_EVENT_BYTES + (map->has_media ? SHADOW_MEDIUM_BYTES : 0);
}

uint32_t shadow_compress_fine_flags(const struct shadow_map *map)
{
    return map->has_media ? SHADOW_FLAG_MEDIA : 0;
}

void shadow_compress_report(const struct shadow_map *map, struct report_compression *c)
{
    c->maps++;
    c->events += map->exact_events;
    c->nodes += map->event_count;
    c->exact_bytes += map->exact_events * event_bytes(map);
    c->node_bytes += map->event_count * SHADOW_NODE_BYTES;
    c->windows += map->built_windows;
    c->prefilter = (uint64_t)map->prefilter;
    c->max_error = fmax(c->max_error, map->compression);
}

static int rays_per_side(const struct compress_job *job)
{
    return job->build->map->prefilter;
}

/* Every ray meets the opaque depth of its texel's middle, as a query does. */
static bool copy_opaque(struct compress_job *job, struct error *err)
{
    const struct shadow_window *window = &job->fine.window;
    int side = job->build->map->resolution, k = rays_per_side(job);
    uint32_t layers = window->row_count ? 1 : job->fine.frame.face_count;
    bool ok = true;
    for (uint32_t i = 0; ok && i < layers; i++) {
        const struct gl_framebuffer *from =
            shadow_store_face(job->store, job->build->target_layer + window->face + i, false, err);
        const struct gl_framebuffer *to =
            from ? shadow_store_face(&job->work, i, false, err) : NULL;
        ok = to != NULL;
        glDisable(GL_SCISSOR_TEST);
        glDepthMask(GL_TRUE);
        if (ok)
            glBlitNamedFramebuffer(from->name, to->name, 0, 0, side, side, 0, 0, k * side, k * side,
                                   GL_DEPTH_BUFFER_BIT, GL_NEAREST);
    }
    return ok;
}

/* Whole faces, of which a window draws its rows. */
static bool reserve_target(struct compress_job *job, struct error *err)
{
    uint64_t layers = job->fine.window.row_count ? 1 : job->fine.frame.face_count;
    struct gl_texture *target = &job->work.target;
    if (target->name && (uint64_t)target->layers > layers)
        shadow_store_drop_target(&job->work);
    return shadow_store_reserve_target(&job->work, job->fine.resolution, layers, err);
}

/* A thread's loops are bounded (llvmpipe: 65,535 iterations), and take one per event of a texel. */
static bool check_longest(const struct compress_job *job, struct error *err)
{
    int k = rays_per_side(job);
    uint64_t most = (uint64_t)(job->build->map->has_media ? DEEP_LONGEST / 2 : DEEP_LONGEST) /
                    (uint64_t)(k * k);
    if (job->fine.longest_list <= most)
        return true;
    return error_set(err, ERROR_UNSUPPORTED,
                     "light %u: a ray crosses %llu transparent surfaces, the limit with these "
                     "quality.shadow_compression and shadow_prefilter is %llu",
                     job->build->light, (unsigned long long)job->fine.longest_list,
                     (unsigned long long)most);
}

static void release_window(struct compress_job *job)
{
    struct error ignored = {0}; /* what cannot be freed is lost until the store is cleared */
    (void)!(shadow_store_free(&job->work, SHADOW_POOL_DEPTHS, &job->fine.depths, &ignored) &&
            shadow_store_free(&job->work, SHADOW_POOL_HEADS, &job->fine.heads, &ignored) &&
            shadow_store_free(&job->work, SHADOW_POOL_EVENTS, &job->fine.events, &ignored));
}

/* The exact lists of the window, in job->work. On failure nothing of them is left. */
static bool build_exact(struct compress_job *job, struct shadow_window window, struct error *err)
{
    const struct shadow_map *map = job->build->map;
    int k = rays_per_side(job);
    job->fine = *map;
    job->fine.depths = job->fine.heads = job->fine.events = (struct shadow_range){0};
    job->fine.flags = shadow_compress_fine_flags(map);
    job->fine.resolution = map->resolution * k;
    job->fine.window =
        (struct shadow_window){window.face, window.first_row * k, window.row_count * k};
    struct shadow_build fine = *job->build;
    fine.map = &job->fine;
    fine.target_layer = 0;
    uint64_t used = shadow_store_size_bytes(job->store);
    job->work.budget_bytes = job->store->budget_bytes > used ? job->store->budget_bytes - used : 0;
    deep_job_begin(&(struct deep_job){.builder = job->builder, .because = job->because},
                   "shadow.deep.compress");
    bool ok = reserve_target(job, err) && copy_opaque(job, err);
    gpu_scope_end(job->builder->timeline);
    struct shadow_guesses *guesses = job->builder->guesses;
    job->builder->store = &job->work;
    job->builder->guesses = NULL; /* what is done next depends on the sizes */
    ok = ok && shadow_deep_build(job->builder, &fine, 1, job->scene, job->because, err) &&
         check_longest(job, err);
    job->builder->store = job->store;
    job->builder->guesses = guesses;
    if (!ok)
        shadow_store_clear(&job->work);
    return ok;
}

static struct program_desc program_of(const struct shadow_map *map, bool is_writing,
                                      char defines[48])
{
    snprintf(defines, 48, "SUBTEXELS=%d%s%s", map->prefilter, map->has_media ? " MEDIA" : "",
             is_writing ? " WRITE" : "");
    return (struct program_desc){.label = "shadow.deep.compress",
                                 .compute = "shadow_compress.comp.glsl",
                                 .defines = defines};
}

void shadow_compress_list_programs(const struct shadow_map *map, struct program_list *list)
{
    for (int is_writing = 0; is_writing < 2; is_writing++) {
        char defines[48];
        const struct program_desc desc = program_of(map, is_writing, defines);
        program_list_add(list, "shadow.deep.compress", &desc, false);
    }
}

/* The light's own parts of the pools. *first: of its counts, or, once these are placed, heads. */
static void bind_nodes(const struct compress_job *job, uint64_t *first, struct shadow_range *nodes)
{
    const struct shadow_map *map = job->build->map;
    enum shadow_pool_kind kind = job->is_writing ? SHADOW_POOL_HEADS : SHADOW_POOL_DEPTHS;
    const struct shadow_range *range = job->is_writing ? &map->heads : &map->depths;
    struct shadow_range span = {0};
    *nodes = (struct shadow_range){0};
    (void)shadow_store_widen(job->store, kind, range, &span);
    shadow_store_bind(job->store, kind, 0, &span, BIND_SHADOW_COUNTS);
    *first = range->first - span.first;
    if (!job->is_writing || !map->events.count)
        return;
    (void)shadow_store_widen(job->store, SHADOW_POOL_EVENTS, &map->events, nodes);
    shadow_store_bind(job->store, SHADOW_POOL_EVENTS, SHADOW_STREAM_EVENT, nodes,
                      BIND_SHADOW_EVENTS);
}

/* The nodes of a light are written at once. */
static bool check_nodes(const struct compress_job *job, struct error *err)
{
    const struct shadow_map *map = job->build->map;
    uint32_t light = job->build->light;
    return shadow_store_check_whole_block(job->store, SHADOW_POOL_HEADS, map->heads.count, light,
                                          err) &&
           shadow_store_check_whole_block(job->store, SHADOW_POOL_EVENTS, map->events.count, light,
                                          err);
}

static const struct gl_program *use_program(const struct compress_job *job, struct error *err)
{
    const struct shadow_map *map = job->build->map;
    struct shadow_range nodes;
    uint64_t first_count;
    char defines[48];
    const struct program_desc desc = program_of(map, job->is_writing, defines);
    if (!check_nodes(job, err))
        return NULL;
    const struct gl_program *program = program_cache_get(job->builder->programs, &desc, err);
    if (!program)
        return NULL;
    const struct shadow_window *window = &job->fine.window;
    uint64_t side = (uint64_t)map->resolution,
             row = (uint64_t)window->first_row / (uint64_t)map->prefilter;
    uint64_t first = window->row_count ? (window->face * side + row) * side : 0;
    float sigma[4] = {(float)map->sigma[0], (float)map->sigma[1], (float)map->sigma[2], 0};
    /* an eighth of the error goes to the chords of exponentials */
    float error = (float)map->compression, chord = map->has_media ? error / 8 : 0;
    gl_program_use(program);
    bind_nodes(job, &first_count, &nodes);
    gl_program_set_u(program, "u_first_count", (uint32_t)(first_count + first));
    gl_program_set_u(
        program, "u_texels",
        (uint32_t)(shadow_map_texels(&job->fine) / (uint64_t)(map->prefilter * map->prefilter)));
    gl_program_set_u(program, "u_resolution", (uint32_t)map->resolution);
    gl_program_set_u(program, "u_source_head", (uint32_t)job->fine.heads.first);
    gl_program_set_u(program, "u_source_base", (uint32_t)job->fine.events.first);
    gl_program_set_u(program, "u_event_base", (uint32_t)(map->events.first - nodes.first));
    gl_program_set_f4(program, "u_sigma", sigma);
    bool is_flat = map->frame.shape == SHADOW_ORTHOGRAPHIC, is_mean = map->prefilter > 1;
    gl_program_set_f4(program, "u_together",
                      (float[4]){is_mean && !is_flat ? TOGETHER : 0,
                                 is_mean && is_flat ? TOGETHER * (float)map->frame.depth_m : 0});
    gl_program_set_f(program, "u_epsilon", error - chord);
    gl_program_set_f(program, "u_chord", chord);
    return program;
}

/* Counts or writes the nodes of the window whose exact lists stand. */
static bool fit_nodes(struct compress_job *job, struct error *err)
{
    deep_job_begin(&(struct deep_job){.builder = job->builder, .because = job->because},
                   "shadow.deep.compress");
    bool ok = use_program(job, err) != NULL;
    if (ok) {
        gl_texture_bind(shadow_store_view(&job->work, SHADOW_POOL_HEADS, 0), UNIT_SHADOW_HEADS);
        gl_texture_bind(shadow_store_view(&job->work, SHADOW_POOL_EVENTS, SHADOW_STREAM_EVENT),
                        UNIT_SHADOW_EVENTS);
        if (job->build->map->has_media)
            gl_texture_bind(shadow_store_view(&job->work, SHADOW_POOL_EVENTS, SHADOW_STREAM_MEDIUM),
                            UNIT_SHADOW_MEDIA);
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);
        int k = rays_per_side(job);
        deep_dispatch((uint32_t)(shadow_map_texels(&job->fine) / (uint64_t)(k * k)));
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT |
                        GL_BUFFER_UPDATE_BARRIER_BIT);
    }
    gpu_scope_end(job->builder->timeline);
    return ok;
}

/* One window, and where it is too large its halves. keep: the exact lists stay. */
static bool do_window(struct compress_job *job, struct shadow_window window, bool keep,
                      struct error *err)
{
    struct error failure = {0};
    if (build_exact(job, window, &failure)) {
        if (!job->is_writing) {
            job->build->map->exact_events += job->fine.event_count;
            job->build->map->built_windows++;
        }
        bool ok = fit_nodes(job, err);
        if (!keep || window.row_count)
            release_window(job);
        return ok;
    }
    const struct shadow_map *map = job->build->map;
    int rows = window.row_count;
    if (failure.code != ERROR_OVER_BUDGET || rows == 1)
        return error_pass(err, &failure);
    if (!rows && map->frame.face_count > 1) {
        for (uint32_t face = 0; face < map->frame.face_count; face++)
            if (!do_window(job, (struct shadow_window){face, 0, map->resolution}, false, err))
                return false;
        return true;
    }
    int all = rows ? rows : map->resolution, half = all / 2;
    if (half == 0)
        return error_pass(err, &failure);
    return do_window(job, (struct shadow_window){window.face, window.first_row, half}, false,
                     err) &&
           do_window(job, (struct shadow_window){window.face, window.first_row + half, all - half},
                     false, err);
}

/* From the counts of nodes to their heads: the scan of exact lists does it, too. */
static bool place_nodes(struct compress_job *job, struct error *err)
{
    struct shadow_map *map = job->build->map, plain = *map;
    struct shadow_build build = *job->build;
    plain.flags = 0;
    build.map = &plain;
    struct deep_job scan = {.builder = job->builder,
                            .scene = job->scene,
                            .because = job->because,
                            .has_no_lists = true};
    bool ok = deep_job_init(&scan, &build, 1, err) && deep_scan_sum(&scan, err);
    if (ok) {
        map->event_count = deep_statistics_total(&scan.statistics[0]);
        map->longest_list = scan.statistics[0].longest;
        map->occupied_texels = scan.statistics[0].occupied;
    }
    ok = ok && deep_sort_reserve(&scan, err) && deep_scan_place(&scan, err);
    deep_job_finish(&scan);
    deep_free_transient(job->builder);
    return ok;
}

/* Room for the nodes beside the exact lists; where there is not enough, in place of them. */
static bool take_nodes(struct compress_job *job, struct error *err)
{
    struct shadow_store *store = job->store;
    struct shadow_map *map = job->build->map;
    struct error failure = {0};
    store->transient_bytes = shadow_store_size_bytes(&job->work);
    bool ok =
        shadow_store_take(store, SHADOW_POOL_EVENTS, map->event_count, &map->events, &failure);
    store->transient_bytes = 0;
    if (ok || failure.code != ERROR_OVER_BUDGET || !shadow_store_size_bytes(&job->work))
        return ok || error_pass(err, &failure);
    shadow_store_clear(&job->work);
    job->fine.heads.count = 0;
    return shadow_store_take(store, SHADOW_POOL_EVENTS, map->event_count, &map->events, err);
}

static bool compress_light(struct compress_job *job, struct error *err)
{
    struct shadow_store *store = job->store;
    struct shadow_map *map = job->build->map;
    int most = store->limits->max_texture_size, k = rays_per_side(job);
    if (map->resolution > most / k)
        return error_set(err, ERROR_UNSUPPORTED,
                         "quality.shadow_prefilter %d of %d texels needs maps of %d, this device "
                         "has %d",
                         k, map->resolution, map->resolution * k, most);
    if (!shadow_store_take(store, SHADOW_POOL_HEADS, shadow_map_texels(map) + 1, &map->heads, err))
        return false;
    job->is_writing = false;
    job->fine = (struct shadow_map){0};
    if (!do_window(job, (struct shadow_window){0}, true, err) || !place_nodes(job, err) ||
        !take_nodes(job, err))
        return false;
    job->is_writing = true;
    bool stands = map->built_windows == 1 && job->fine.heads.count;
    bool ok = stands ? fit_nodes(job, err) : do_window(job, (struct shadow_window){0}, false, err);
    if (stands)
        release_window(job);
    return ok;
}

bool shadow_compress_build(struct shadow_builder *builder, struct shadow_build *builds,
                           size_t count, const struct shadow_scene *scene, const char *because,
                           struct error *err)
{
    struct compress_job job = {.builder = builder,
                               .store = builder->store,
                               .work = {.limits = builder->store->limits},
                               .scene = scene,
                               .because = because};
    bool ok = true;
    for (size_t i = 0; ok && i < count; i++) {
        job.build = &builds[i];
        if (builds[i].map->flags & SHADOW_FLAG_NODES)
            ok = compress_light(&job, err);
    }
    shadow_store_clear(&job.work);
    return ok;
}
