/* SPDX-License-Identifier: MIT */
/* Count, scan, scatter, sort: the passes of a deep shadow map. */
#include "renderer/shadows/shadow_deep.h"

#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>

#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

enum {
    CLASS_COUNT = 6,     /* lists of 2, 3..4, 5..8, 9..16, 17..32 and more events */
    LONG_CLASS = CLASS_COUNT - 1,
    STATISTIC_WORDS = 12, /* of one light, and of one chunk: shadow_scan.comp.glsl */
    LONGEST_LIST = 60000, /* llvmpipe ends all loops of a thread after 65,535 iterations; merging needs one per event */
    RUN = 32,
};

struct light_statistics { /* STATISTIC_WORDS words */
    uint32_t total, total_high, longest, occupied;
    uint32_t classes[CLASS_COUNT];
    uint32_t pad[2];
};
_Static_assert(sizeof(struct light_statistics) == STATISTIC_WORDS * 4, "as the shader writes it");

struct deep_job {
    struct shadow_builder *builder;
    struct shadow_build *builds;
    size_t count;
    const struct shadow_scene *scene;
    const char *because;
    struct light_statistics *statistics; /* per build */
    uint32_t chunks;                     /* of the largest light: each has room for as many sums */
};

void shadow_builder_finish(struct shadow_builder *builder)
{
    gl_buffer_finish(&builder->sums);
    gl_buffer_finish(&builder->statistics);
    gl_buffer_finish(&builder->texels);
    gl_buffer_finish(&builder->scratch);
}

static void begin(const struct deep_job *job, const char *pass)
{
    gpu_scope_begin(job->builder->timeline, &(struct gpu_scope_desc){.pass = pass,
                                                                     .because = job->because,
                                                                     .technique = "deep",
                                                                     .stage = REPORT_SHADOW});
}

static bool is_deep(const struct shadow_build *build)
{
    return build->map->kind == SHADOW_DEEP;
}

/* Chunks of about the square root of the texels balance the two levels of the scan. */
static uint32_t chunk_size(uint64_t texels)
{
    uint32_t chunk = 64;
    while ((uint64_t)chunk * chunk < texels)
        chunk *= 2;
    return chunk;
}

static uint32_t chunk_count(uint64_t texels)
{
    uint32_t chunk = chunk_size(texels);
    return (uint32_t)((texels + chunk - 1) / chunk);
}

static void dispatch(uint32_t threads)
{
    const uint32_t row = 32768; /* below the 65,535 groups that every device has per dimension */
    uint32_t groups = (threads + 63) / 64;
    if (groups)
        glDispatchCompute(groups < row ? groups : row, (groups + row - 1) / row, 1);
}

static bool paint(const struct deep_job *job, enum caster_pass pass, struct error *err)
{
    struct shadow_store *store = job->builder->store;
    struct shadow_pool *events = &store->pools[SHADOW_POOL_EVENTS];
    gl_buffer_bind_storage(&store->pools[SHADOW_POOL_HEADS].streams[0], BIND_SHADOW_COUNTS);
    if (pass == CASTER_SCATTER) {
        gl_buffer_bind_storage(&events->streams[SHADOW_STREAM_Z], BIND_SHADOW_EVENTS_Z);
        gl_buffer_bind_storage(&events->streams[SHADOW_STREAM_T], BIND_SHADOW_EVENTS_T);
        if (store->has_objects)
            gl_buffer_bind_storage(&events->streams[SHADOW_STREAM_ID], BIND_SHADOW_EVENTS_ID);
    }
    for (size_t i = 0; i < job->count; i++) {
        struct caster_paint_desc desc = {
            .pass = pass, .build = &job->builds[i], .scene = job->scene, .store = store};
        if (is_deep(desc.build) && !caster_painter_paint(job->builder->painter, &desc, err))
            return false;
    }
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);
    return true;
}

static bool count_events(const struct deep_job *job, struct error *err)
{
    struct gl_buffer *heads = &job->builder->store->pools[SHADOW_POOL_HEADS].streams[0];
    begin(job, "shadow.deep.count");
    for (size_t i = 0; i < job->count; i++) {
        const struct shadow_range *range = &job->builds[i].map->heads;
        if (is_deep(&job->builds[i]))
            gl_buffer_clear_u32(heads, range->first * 4, range->count * 4, 0);
    }
    bool ok = paint(job, CASTER_COUNT, err);
    gpu_scope_end(job->builder->timeline);
    return ok;
}

static const struct gl_program *scan_program(const struct deep_job *job, int pass, struct error *err)
{
    static const char *const defines[] = {"PASS=0", "PASS=1", "PASS=2"};
    return program_cache_get(job->builder->programs,
                             &(struct program_desc){.label = "shadow.deep.scan",
                                                    .compute = "shadow_scan.comp.glsl",
                                                    .defines = defines[pass]},
                             err);
}

static void use_scan_program(const struct deep_job *job, const struct gl_program *program, size_t i)
{
    const struct shadow_map *map = job->builds[i].map;
    uint64_t texels = shadow_map_texels(map);
    gl_program_use(program);
    gl_program_set_u(program, "u_first", (uint32_t)map->heads.first + 1);
    gl_program_set_u(program, "u_count", (uint32_t)texels);
    gl_program_set_u(program, "u_chunk", chunk_size(texels));
    gl_program_set_u(program, "u_chunks", chunk_count(texels));
    gl_program_set_u(program, "u_chunk_first", job->chunks * (uint32_t)i);
    gl_program_set_u(program, "u_slot", (uint32_t)i);
}

static void bind_scan(const struct deep_job *job)
{
    struct shadow_builder *builder = job->builder;
    gl_buffer_bind_storage(&builder->store->pools[SHADOW_POOL_HEADS].streams[0], BIND_SHADOW_COUNTS);
    gl_buffer_bind_storage(&builder->sums, BIND_SCAN);
    gl_buffer_bind_storage(&builder->statistics, BIND_STATISTICS);
}

static bool reserve_scan(struct deep_job *job, struct error *err)
{
    for (size_t i = 0; i < job->count; i++)
        if (is_deep(&job->builds[i]) && chunk_count(shadow_map_texels(job->builds[i].map)) > job->chunks)
            job->chunks = chunk_count(shadow_map_texels(job->builds[i].map));
    struct gl_buffer_desc sums = {.label = "shadow.deep.sums",
                                  .size_bytes = (uint64_t)job->chunks * job->count * STATISTIC_WORDS * 4};
    struct gl_buffer_desc statistics = {.label = "shadow.deep.statistics",
                                        .size_bytes = job->count * sizeof(struct light_statistics)};
    return gl_buffer_reserve(&job->builder->sums, &sums, false, err) &&
           gl_buffer_reserve(&job->builder->statistics, &statistics, false, err);
}

/* Totals per light; the one readback of a build. */
static bool sum_counts(struct deep_job *job, struct error *err)
{
    const struct gl_program *sum = scan_program(job, 0, err), *blocks = scan_program(job, 1, err);
    if (!sum || !blocks || !reserve_scan(job, err))
        return false;
    begin(job, "shadow.deep.scan");
    for (size_t i = 0; i < job->count; i++) {
        const struct shadow_map *map = job->builds[i].map;
        if (!is_deep(&job->builds[i]))
            continue;
        bind_scan(job);
        use_scan_program(job, sum, i);
        dispatch(chunk_count(shadow_map_texels(map)));
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
        use_scan_program(job, blocks, i);
        dispatch(1);
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    }
    gl_buffer_read(&job->builder->statistics, 0, job->count * sizeof *job->statistics, job->statistics);
    gpu_scope_end(job->builder->timeline);
    return true;
}

static bool take_events(const struct deep_job *job, struct error *err)
{
    struct shadow_store *store = job->builder->store;
    for (size_t i = 0; i < job->count; i++) {
        const struct light_statistics *s = &job->statistics[i];
        struct shadow_map *map = job->builds[i].map;
        uint64_t total = s->total | (uint64_t)s->total_high << 32;
        if (!is_deep(&job->builds[i]))
            continue;
        if (s->longest > LONGEST_LIST)
            return error_set(err, ERROR_UNSUPPORTED,
                             "light %u: a ray crosses %u transparent surfaces, the limit is %d",
                             job->builds[i].light, s->longest, LONGEST_LIST);
        if ((map->flags & SHADOW_FLAG_RAW) && !shadow_store_keep_objects(store, err))
            return false;
        if (!shadow_store_take(store, SHADOW_POOL_EVENTS, total, &map->events, err))
            return false;
        map->event_count = total;
        map->longest_list = s->longest;
        map->occupied_texels = s->occupied;
    }
    return true;
}

static uint64_t list_length(const struct light_statistics *s)
{
    uint64_t length = 0;
    for (int c = 0; c < CLASS_COUNT; c++)
        length += s->classes[c];
    return length;
}

/* The class lists of all lights lie one after another; the scratch memory is that of the largest light. */
static bool reserve_sort(const struct deep_job *job, struct error *err)
{
    uint64_t texels = 0, scratch = 0;
    for (size_t i = 0; i < job->count; i++) {
        if (!is_deep(&job->builds[i]))
            continue;
        texels += list_length(&job->statistics[i]);
        if (job->statistics[i].classes[LONG_CLASS] && job->statistics[i].total > scratch)
            scratch = job->statistics[i].total;
    }
    struct gl_buffer_desc lists = {.label = "shadow.deep.texels", .size_bytes = texels * 4};
    struct gl_buffer_desc words = {.label = "shadow.deep.scratch", .size_bytes = scratch * 20};
    if (!shadow_store_check_transient(job->builder->store, lists.size_bytes + words.size_bytes, err))
        return false;
    job->builder->store->transient_bytes = lists.size_bytes + words.size_bytes;
    return gl_buffer_reserve(&job->builder->texels, &lists, false, err) &&
           gl_buffer_reserve(&job->builder->scratch, &words, false, err);
}

static bool place_lists(const struct deep_job *job, struct error *err)
{
    const struct gl_program *apply = scan_program(job, 2, err);
    if (!apply)
        return false;
    begin(job, "shadow.deep.scan");
    bind_scan(job);
    gl_buffer_bind_storage(&job->builder->texels, BIND_LIST_NODES);
    uint32_t list = 0;
    for (size_t i = 0; i < job->count; i++) {
        const struct shadow_map *map = job->builds[i].map;
        if (!is_deep(&job->builds[i]))
            continue;
        use_scan_program(job, apply, i);
        gl_program_set_u(apply, "u_list", list);
        uint32_t first = 0;
        for (int c = 0; c < CLASS_COUNT; c++) {
            char name[32];
            snprintf(name, sizeof name, "u_class_first[%d]", c);
            gl_program_set_u(apply, name, first);
            first += job->statistics[i].classes[c];
        }
        dispatch(chunk_count(shadow_map_texels(map)));
        list += first;
    }
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);
    gpu_scope_end(job->builder->timeline);
    return true;
}

static bool scatter_events(const struct deep_job *job, struct error *err)
{
    begin(job, "shadow.deep.scatter");
    bool ok = paint(job, CASTER_SCATTER, err);
    gpu_scope_end(job->builder->timeline);
    return ok;
}

static const struct gl_program *sort_program(const struct deep_job *job, const struct shadow_map *map,
                                             const char *file, const char *net, struct error *err)
{
    char defines[48];
    snprintf(defines, sizeof defines, "%s%s", net, map->flags & SHADOW_FLAG_RAW ? " IDS" : "");
    return program_cache_get(job->builder->programs,
                             &(struct program_desc){
                                 .label = "shadow.deep.sort", .compute = file, .defines = defines},
                             err);
}

static void use_sort_program(const struct gl_program *program, const struct shadow_map *map,
                             uint32_t list_first, uint32_t list_count)
{
    gl_program_use(program);
    gl_program_set_u(program, "u_first_head", (uint32_t)map->heads.first);
    gl_program_set_u(program, "u_event_base", (uint32_t)map->events.first);
    gl_program_set_u(program, "u_list_first", list_first);
    gl_program_set_u(program, "u_list_count", list_count);
}

static bool sort_class(const struct deep_job *job, const struct shadow_map *map, int class_,
                       uint32_t list_first, uint32_t list_count, struct error *err)
{
    static const char *const nets[CLASS_COUNT] = {"NET=2",  "NET=4",  "NET=8",
                                                  "NET=16", "NET=32", "NET=32 RUNS"};
    const struct gl_program *program = sort_program(job, map, "shadow_sort.comp.glsl", nets[class_], err);
    if (!program)
        return false;
    use_sort_program(program, map, list_first, list_count);
    dispatch(list_count);
    if (class_ != LONG_CLASS)
        return true;
    const struct gl_program *merge = sort_program(job, map, "shadow_merge.comp.glsl", "", err);
    if (!merge)
        return false;
    use_sort_program(merge, map, list_first, list_count);
    for (uint32_t level = 0; (uint64_t)RUN << level < map->longest_list; level++) {
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
        gl_program_set_u(merge, "u_level", level);
        dispatch(list_count);
    }
    return true;
}

static void bind_sort(const struct deep_job *job)
{
    struct shadow_store *store = job->builder->store;
    struct shadow_pool *events = &store->pools[SHADOW_POOL_EVENTS];
    gl_buffer_bind_storage(&events->streams[SHADOW_STREAM_Z], BIND_SHADOW_EVENTS_Z);
    gl_buffer_bind_storage(&events->streams[SHADOW_STREAM_T], BIND_SHADOW_EVENTS_T);
    gl_buffer_bind_storage(&job->builder->texels, BIND_SCAN);
    gl_buffer_bind_storage(&job->builder->scratch, BIND_LIST_NODES);
    gl_texture_bind(shadow_store_view(store, SHADOW_POOL_HEADS, 0), UNIT_SHADOW_HEADS);
    gl_texture_bind(shadow_store_view(store, SHADOW_POOL_EVENTS, SHADOW_STREAM_Z), UNIT_SHADOW_Z);
    gl_texture_bind(shadow_store_view(store, SHADOW_POOL_EVENTS, SHADOW_STREAM_T), UNIT_SHADOW_T);
    if (store->has_objects) {
        gl_buffer_bind_storage(&events->streams[SHADOW_STREAM_ID], BIND_SHADOW_EVENTS_ID);
        gl_texture_bind(shadow_store_view(store, SHADOW_POOL_EVENTS, SHADOW_STREAM_ID), UNIT_SHADOW_ID);
    }
}

static bool sort_events(const struct deep_job *job, struct error *err)
{
    begin(job, "shadow.deep.sort");
    bind_sort(job);
    bool ok = true;
    uint32_t list = 0;
    for (size_t i = 0; ok && i < job->count; i++) {
        for (int c = 0; ok && is_deep(&job->builds[i]) && c < CLASS_COUNT; c++) {
            uint32_t length = job->statistics[i].classes[c];
            if (length)
                ok = sort_class(job, job->builds[i].map, c, list, length, err);
            list += length;
        }
    }
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);
    gpu_scope_end(job->builder->timeline);
    return ok;
}

static void free_transient(struct shadow_builder *builder)
{
    builder->store->transient_bytes = 0;
    gl_buffer_finish(&builder->texels);
    gl_buffer_finish(&builder->scratch);
}

static bool take_heads(const struct deep_job *job, bool *has_any, struct error *err)
{
    for (size_t i = 0; i < job->count; i++) {
        struct shadow_map *map = job->builds[i].map;
        if (!is_deep(&job->builds[i]))
            continue;
        *has_any = true;
        if (!shadow_store_take(job->builder->store, SHADOW_POOL_HEADS, shadow_map_texels(map) + 1, &map->heads, err))
            return false;
    }
    return true;
}

bool shadow_deep_build(struct shadow_builder *builder, struct shadow_build *builds, size_t count,
                       const struct shadow_scene *scene, const char *because, struct error *err)
{
    struct deep_job job = {
        .builder = builder, .builds = builds, .count = count, .scene = scene, .because = because};
    bool has_any = false;
    if (!take_heads(&job, &has_any, err))
        return false;
    if (!has_any)
        return true;
    job.statistics = calloc(count, sizeof *job.statistics);
    if (!job.statistics)
        return error_set(err, ERROR_NO_MEMORY, "statistics of %zu lights", count);
    bool ok = count_events(&job, err) && sum_counts(&job, err) && take_events(&job, err) &&
              reserve_sort(&job, err) && place_lists(&job, err) && scatter_events(&job, err) &&
              sort_events(&job, err);
    free_transient(builder);
    free(job.statistics);
    return ok;
}
