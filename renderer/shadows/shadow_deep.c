/* SPDX-License-Identifier: MIT */
/* Count, scan, scatter, sort: the course of building deep shadow maps. */
#include "renderer/shadows/shadow_deep.h"

#include <epoxy/gl.h>
#include <stdlib.h>

#include "renderer/gl/buffer_fill.h"
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
    gl_buffer_finish(&builder->lights);
    gl_buffer_finish(&builder->table);
    deep_free_transient(builder);
}

/* Before the job, which knows where they are. */
static bool take_heads(struct shadow_builder *builder, struct shadow_build *builds, size_t count,
                       struct error *err)
{
    for (size_t i = 0; i < count; i++) {
        struct shadow_map *map = builds[i].map;
        if (deep_is_built(map) && !shadow_store_take(builder->store, SHADOW_POOL_HEADS,
                                                     shadow_map_texels(map) + 1, &map->heads, err))
            return false;
    }
    return true;
}

/* Programs that count have blocks of events, too, which they leave alone. What an earlier pass left
 * bound there may be another structure's. */
static void cover_events(const struct shadow_store *store, const struct shadow_range *heads)
{
    shadow_store_bind(store, SHADOW_POOL_HEADS, 0, heads, BIND_SHADOW_EVENTS);
    if (store->keeps_objects)
        shadow_store_bind(store, SHADOW_POOL_HEADS, 0, heads, BIND_SHADOW_EVENTS_ID);
    if (store->keeps_media)
        shadow_store_bind(store, SHADOW_POOL_HEADS, 0, heads, BIND_SHADOW_MEDIA);
}

static void bind_spans(const struct shadow_store *store, const struct shadow_range *heads,
                       const struct shadow_range *events)
{
    shadow_store_bind(store, SHADOW_POOL_HEADS, 0, heads, BIND_SHADOW_COUNTS);
    if (!events->count) {
        cover_events(store, heads);
        return;
    }
    shadow_store_bind(store, SHADOW_POOL_EVENTS, SHADOW_STREAM_EVENT, events, BIND_SHADOW_EVENTS);
    if (store->keeps_objects)
        shadow_store_bind(store, SHADOW_POOL_EVENTS, SHADOW_STREAM_OBJECT, events,
                          BIND_SHADOW_EVENTS_ID);
    if (store->keeps_media)
        shadow_store_bind(store, SHADOW_POOL_EVENTS, SHADOW_STREAM_MEDIUM, events,
                          BIND_SHADOW_MEDIA);
}

/* The lights from the first on whose lists a storage block takes together; their number. */
static size_t paint_some(const struct deep_job *job, struct shadow_build **builds, size_t count,
                         enum caster_pass pass, struct error *err)
{
    struct shadow_store *store = job->builder->store;
    struct shadow_range heads = {0}, events = {0};
    size_t some = 0;
    while (some < count &&
           shadow_store_widen(store, SHADOW_POOL_HEADS, &builds[some]->map->heads, &heads) &&
           (pass != CASTER_SCATTER ||
            shadow_store_widen(store, SHADOW_POOL_EVENTS, &builds[some]->map->events, &events)))
        some++;
    bind_spans(store, &heads, &events);
    const struct caster_paint_desc desc = {.pass = pass,
                                           .builds = builds,
                                           .build_count = some,
                                           .scene = job->scene,
                                           .store = store,
                                           .first_head = heads.first,
                                           .first_event = events.first};
    return caster_painter_paint(job->builder->painter, &desc, err) ? some : 0;
}

static bool paint(const struct deep_job *job, enum caster_pass pass, struct error *err)
{
    struct shadow_build **builds = calloc(job->count, sizeof *builds);
    if (!builds)
        return error_set(err, ERROR_NO_MEMORY, "%zu lights", job->count);
    for (size_t i = 0; i < job->count; i++)
        builds[i] = job->slots[i].build;
    bool ok = true;
    for (size_t i = 0, some; ok && i < job->count; i += some) {
        some = paint_some(job, builds + i, job->count - i, pass, err);
        ok = some > 0;
    }
    free(builds);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);
    return ok;
}

static bool clear_heads(const struct deep_job *job, const struct shadow_range *range,
                        struct error *err)
{
    const struct shadow_builder *builder = job->builder;
    struct gl_buffer *heads = &builder->store->pools[SHADOW_POOL_HEADS].streams[0];
    if (builder->scans_on_host) {
        gl_buffer_clear_u32(heads, range->first * 4, range->count * 4, 0);
        return true;
    }
    return buffer_fill_u32(&(struct buffer_fill_desc){.programs = builder->programs,
                                                      .limits = builder->store->limits,
                                                      .buffer = heads,
                                                      .offset_bytes = range->first * 4,
                                                      .size_bytes = range->count * 4},
                           err);
}

static bool count_events(const struct deep_job *job, struct error *err)
{
    bool ok = true;
    deep_job_begin(job, "shadow.deep.count");
    for (size_t i = 0; ok && i < job->count;) { /* those that follow one another at once */
        struct shadow_range range = job->slots[i].build->map->heads;
        while (++i < job->count &&
               job->slots[i].build->map->heads.first == range.first + range.count)
            range.count += job->slots[i].build->map->heads.count;
        ok = clear_heads(job, &range, err);
    }
    ok = ok && paint(job, CASTER_COUNT, err);
    gpu_scope_end(job->builder->timeline);
    return ok;
}

/* What a thread loops over, and what one storage block holds twice, to and fro. */
static bool check_longest(const struct deep_job *job, size_t slot, struct error *err)
{
    int64_t room = job->builder->store->limits->max_storage_block_bytes / (2 * DEEP_SCRATCH_BYTES);
    uint32_t most = room < DEEP_LONGEST ? (uint32_t)room : DEEP_LONGEST;
    return job->statistics[slot].longest <= most ||
           error_set(err, ERROR_UNSUPPORTED,
                     "light %u: a ray crosses %u transparent surfaces, the limit is %u",
                     job->slots[slot].build->light, job->statistics[slot].longest, most);
}

static bool take_events(const struct deep_job *job, struct error *err)
{
    struct shadow_store *store = job->builder->store;
    uint64_t all = 0;
    for (size_t i = 0; i < job->count; i++)
        all += deep_statistics_total(&job->statistics[i]);
    if (!shadow_store_reserve(store, SHADOW_POOL_EVENTS, all, err))
        return false;
    for (size_t i = 0; i < job->count; i++) {
        const struct deep_statistics *s = &job->statistics[i];
        struct shadow_map *map = job->slots[i].build->map;
        uint64_t total = deep_statistics_total(s);
        if (!check_longest(job, i, err))
            return false;
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
    struct deep_job job = {.builder = builder, .scene = scene, .because = because};
    bool ok = take_heads(builder, builds, count, err) && deep_job_init(&job, builds, count, err);
    if (ok && job.count)
        ok = count_events(&job, err) && deep_scan_sum(&job, err) && take_events(&job, err) &&
             deep_sort_reserve(&job, err) && deep_scan_place(&job, err) &&
             scatter_events(&job, err) && deep_sort(&job, err);
    deep_job_finish(&job);
    deep_free_transient(builder);
    return ok;
}
