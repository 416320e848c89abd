/* SPDX-License-Identifier: MIT */
/* Count, scan, scatter, sort: the course of building deep shadow maps. */
#include "renderer/shadows/shadow_deep.h"

#include <epoxy/gl.h>
#include <stdlib.h>

#include "renderer/shadows/shadow_deep_job.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

void deep_free_transient(struct shadow_builder *builder)
{
    builder->store->transient_bytes = 0;
    gl_buffer_finish(&builder->texels);
    gl_buffer_finish(&builder->scratch);
    gl_buffer_finish(&builder->scratch_objects);
    gl_buffer_finish(&builder->scratch_media);
}

void shadow_builder_finish(struct shadow_builder *builder)
{
    gl_buffer_finish(&builder->sums);
    gl_buffer_finish(&builder->statistics);
    deep_free_transient(builder);
}

bool deep_job_has(const struct deep_job *job, size_t build)
{
    const struct shadow_map *map = job->builds[build].map;
    return map->kind == SHADOW_DEEP && !(map->flags & SHADOW_FLAG_NODES);
}

uint32_t deep_job_shortest(const struct deep_job *job, size_t build)
{
    return job->builds[build].map->flags & SHADOW_FLAG_MEDIA ? 1 : 2;
}

void deep_job_begin(const struct deep_job *job, const char *pass)
{
    gpu_scope_begin(job->builder->timeline, &(struct gpu_scope_desc){.pass = pass,
                                                                     .because = job->because,
                                                                     .technique = "deep",
                                                                     .stage = REPORT_SHADOW});
}

uint32_t deep_statistics_texels(const struct deep_statistics *statistics)
{
    uint32_t texels = 0;
    for (int c = 0; c < DEEP_CLASSES; c++)
        texels += statistics->classes[c];
    return texels;
}

void deep_dispatch(uint32_t threads)
{
    const uint32_t row = 32768; /* below the 65,535 groups that every device has per dimension */
    uint32_t groups = (threads + 63) / 64;
    if (groups)
        glDispatchCompute(groups < row ? groups : row, (groups + row - 1) / row, 1);
}

static bool take_heads(const struct deep_job *job, bool *has_any, struct error *err)
{
    for (size_t i = 0; i < job->count; i++) {
        struct shadow_map *map = job->builds[i].map;
        if (!deep_job_has(job, i))
            continue;
        *has_any = true;
        if (!shadow_store_take(job->builder->store, SHADOW_POOL_HEADS, shadow_map_texels(map) + 1,
                               &map->heads, err))
            return false;
    }
    return true;
}

static bool paint(const struct deep_job *job, enum caster_pass pass, struct error *err)
{
    struct shadow_store *store = job->builder->store;
    struct shadow_pool *events = &store->pools[SHADOW_POOL_EVENTS];
    gl_buffer_bind_storage(&store->pools[SHADOW_POOL_HEADS].streams[0], BIND_SHADOW_COUNTS);
    if (pass == CASTER_SCATTER) {
        gl_buffer_bind_storage(&events->streams[SHADOW_STREAM_EVENT], BIND_SHADOW_EVENTS);
        if (store->keeps_objects)
            gl_buffer_bind_storage(&events->streams[SHADOW_STREAM_OBJECT], BIND_SHADOW_EVENTS_ID);
        if (store->keeps_media)
            gl_buffer_bind_storage(&events->streams[SHADOW_STREAM_MEDIUM], BIND_SHADOW_MEDIA);
    }
    for (size_t i = 0; i < job->count; i++) {
        struct caster_paint_desc desc = {
            .pass = pass, .build = &job->builds[i], .scene = job->scene, .store = store};
        if (deep_job_has(job, i) && !caster_painter_paint(job->builder->painter, &desc, err))
            return false;
    }
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);
    return true;
}

static bool count_events(const struct deep_job *job, struct error *err)
{
    struct gl_buffer *heads = &job->builder->store->pools[SHADOW_POOL_HEADS].streams[0];
    deep_job_begin(job, "shadow.deep.count");
    for (size_t i = 0; i < job->count; i++) {
        const struct shadow_range *range = &job->builds[i].map->heads;
        if (deep_job_has(job, i))
            gl_buffer_clear_u32(heads, range->first * 4, range->count * 4, 0);
    }
    bool ok = paint(job, CASTER_COUNT, err);
    gpu_scope_end(job->builder->timeline);
    return ok;
}

static uint64_t total_events(const struct deep_statistics *statistics)
{
    return statistics->total | (uint64_t)statistics->total_high << 32;
}

static bool take_events(const struct deep_job *job, struct error *err)
{
    struct shadow_store *store = job->builder->store;
    uint64_t all = 0;
    for (size_t i = 0; i < job->count; i++)
        all += deep_job_has(job, i) ? total_events(&job->statistics[i]) : 0;
    if (!shadow_store_reserve(store, SHADOW_POOL_EVENTS, all, err))
        return false;
    for (size_t i = 0; i < job->count; i++) {
        const struct deep_statistics *s = &job->statistics[i];
        struct shadow_map *map = job->builds[i].map;
        uint64_t total = total_events(s);
        if (!deep_job_has(job, i))
            continue;
        if (s->longest > DEEP_LONGEST)
            return error_set(err, ERROR_UNSUPPORTED,
                             "light %u: a ray crosses %u transparent surfaces, the limit is %d",
                             job->builds[i].light, s->longest, DEEP_LONGEST);
        if ((map->flags & SHADOW_FLAG_RAW) && !shadow_store_keep(store, SHADOW_STREAM_OBJECT, err))
            return false;
        if ((map->flags & SHADOW_FLAG_MEDIA) &&
            !shadow_store_keep(store, SHADOW_STREAM_MEDIUM, err))
            return false;
        if (!shadow_store_take(store, SHADOW_POOL_EVENTS, total, &map->events, err))
            return false;
        map->event_count = total;
        map->longest_list = s->longest;
        map->occupied_texels = s->occupied;
    }
    return true;
}

static bool scatter_events(const struct deep_job *job, struct error *err)
{
    deep_job_begin(job, "shadow.deep.scatter");
    bool ok = paint(job, CASTER_SCATTER, err);
    gpu_scope_end(job->builder->timeline);
    return ok;
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
    bool ok = count_events(&job, err) && deep_scan_sum(&job, err) && take_events(&job, err) &&
              deep_sort_reserve(&job, err) && deep_scan_place(&job, err) &&
              scatter_events(&job, err) && deep_sort(&job, err);
    deep_scan_finish(&job);
    deep_free_transient(builder);
    free(job.statistics);
    return ok;
}
