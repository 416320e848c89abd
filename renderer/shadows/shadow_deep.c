/* SPDX-License-Identifier: MIT */
/* Count, scan, scatter, sort: the course of building deep shadow maps. */
#include "renderer/shadows/shadow_deep.h"

#include <assert.h>
#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/gl/buffer_fill.h"
#include "renderer/shadows/shadow_deep_job.h"
#include "renderer/shadows/shadow_key.h"
#include "renderer/shadows/shadow_parts.h"
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

/* Before the job, which knows where they are. Rays of a compressed map are no map of their own, and
 * have no depths: their counts need room. */
static bool take_heads(struct shadow_builder *builder, struct shadow_build *builds, size_t count,
                       struct error *err)
{
    for (size_t i = 0; i < count; i++) {
        struct shadow_map *map = builds[i].map;
        if (!deep_is_built(map))
            continue;
        if (!shadow_store_take(builder->store, SHADOW_POOL_HEADS, shadow_map_texels(map) + 1,
                               &map->heads, err))
            return false;
        if (!map->depths.count && !shadow_store_take(builder->store, SHADOW_POOL_DEPTHS,
                                                     shadow_map_texels(map), &map->depths, err))
            return false;
    }
    return true;
}

/* Programs that count have blocks of events, too, which they leave alone. What an earlier pass left
 * bound there may be another structure's. */
static void cover_events(const struct shadow_store *store, const struct shadow_range *counts)
{
    shadow_store_bind(store, SHADOW_POOL_DEPTHS, 0, counts, BIND_SHADOW_EVENTS);
    if (store->keeps_objects)
        shadow_store_bind(store, SHADOW_POOL_DEPTHS, 0, counts, BIND_SHADOW_EVENTS_ID);
    if (store->keeps_media)
        shadow_store_bind(store, SHADOW_POOL_DEPTHS, 0, counts, BIND_SHADOW_MEDIA);
}

static void bind_spans(const struct shadow_store *store, const struct shadow_range *counts,
                       const struct shadow_range *events)
{
    shadow_store_bind(store, SHADOW_POOL_DEPTHS, 0, counts, BIND_SHADOW_COUNTS);
    if (!events->count) {
        cover_events(store, counts);
        return;
    }
    gl_texture_bind(shadow_store_view(store, SHADOW_POOL_HEADS, 0), UNIT_SHADOW_HEADS);
    shadow_store_bind(store, SHADOW_POOL_EVENTS, SHADOW_STREAM_EVENT, events, BIND_SHADOW_EVENTS);
    if (store->keeps_objects)
        shadow_store_bind(store, SHADOW_POOL_EVENTS, SHADOW_STREAM_OBJECT, events,
                          BIND_SHADOW_EVENTS_ID);
    if (store->keeps_media)
        shadow_store_bind(store, SHADOW_POOL_EVENTS, SHADOW_STREAM_MEDIUM, events,
                          BIND_SHADOW_MEDIA);
}

static bool paint_part(const struct deep_job *job, const struct shadow_build *whole,
                       const struct shadow_part *part, enum caster_pass pass, struct error *err)
{
    struct shadow_store *store = job->builder->store;
    struct shadow_map map = shadow_part_map(whole->map, part);
    struct shadow_build build = *whole, *only = &build;
    struct shadow_range counts = {0}, events = {0};
    build.map = &map;
    build.target_layer += whole->map->window.row_count ? 0 : part->window.face;
    if (pass == CASTER_SCATTER && !part->events.count)
        return true;
    bool is_whole = shadow_store_widen(store, SHADOW_POOL_DEPTHS, &map.depths, &counts) &&
                    shadow_store_widen(store, SHADOW_POOL_EVENTS, &part->events, &events);
    assert(is_whole);
    bind_spans(store, &counts, &events);
    const struct caster_paint_desc desc = {.pass = pass,
                                           .builds = &only,
                                           .build_count = 1,
                                           .scene = job->scene,
                                           .store = store,
                                           .first_count = counts.first,
                                           .first_event = events.first};
    return caster_painter_paint(job->builder->painter, &desc, err);
}

/* A light that no storage block takes as a whole. */
static bool paint_parts(const struct deep_job *job, const struct shadow_build *build,
                        enum caster_pass pass, struct error *err)
{
    const struct shadow_store *store = job->builder->store;
    struct shadow_part part = {.texels = 0};
    if (pass == CASTER_SCATTER)
        gpu_timeline_will_wait(job->builder->timeline);
    do {
        if (!shadow_part_next(store, build->map, pass == CASTER_SCATTER, &part, err) ||
            (part.texels && !paint_part(job, build, &part, pass, err)))
            return false;
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    } while (part.texels);
    return true;
}

/* The lights from the first on whose lists a storage block takes together; their number. */
static size_t paint_some(const struct deep_job *job, struct shadow_build **builds, size_t count,
                         enum caster_pass pass, struct error *err)
{
    struct shadow_store *store = job->builder->store;
    struct shadow_range counts = {0}, events = {0};
    bool is_second = pass == CASTER_SCATTER;
    size_t some = 0;
    if (shadow_parts_are_needed(store, builds[0]->map, is_second))
        return paint_parts(job, builds[0], pass, err) ? 1 : 0;
    while (some < count && !shadow_parts_are_needed(store, builds[some]->map, is_second) &&
           shadow_store_widen(store, SHADOW_POOL_DEPTHS, &builds[some]->map->depths, &counts) &&
           (!is_second ||
            shadow_store_widen(store, SHADOW_POOL_EVENTS, &builds[some]->map->events, &events)))
        some++;
    bind_spans(store, &counts, &events);
    const struct caster_paint_desc desc = {.pass = pass,
                                           .builds = builds,
                                           .build_count = some,
                                           .scene = job->scene,
                                           .store = store,
                                           .first_count = counts.first,
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

static bool clear_counts(const struct deep_job *job, const struct shadow_range *range,
                         struct error *err)
{
    const struct shadow_builder *builder = job->builder;
    struct gl_buffer *counts = &builder->store->pools[SHADOW_POOL_DEPTHS].streams[0];
    return buffer_fill_u32(&(struct buffer_fill_desc){.programs = builder->programs,
                                                      .limits = builder->store->limits,
                                                      .buffer = counts,
                                                      .offset_bytes = range->first * 4,
                                                      .size_bytes = range->count * 4,
                                                      .by_gl = builder->scans_on_host},
                           err);
}

static bool count_events(const struct deep_job *job, struct error *err)
{
    bool ok = true;
    deep_job_begin(job, "shadow.deep.count");
    for (size_t i = 0; ok && i < job->count;) { /* those that follow one another at once */
        struct shadow_range range = job->slots[i].build->map->depths;
        while (++i < job->count &&
               job->slots[i].build->map->depths.first == range.first + range.count)
            range.count += job->slots[i].build->map->depths.count;
        ok = clear_counts(job, &range, err);
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

static bool reserve_events(const struct deep_job *job, struct error *err)
{
    uint64_t *counts = malloc((job->count + 1) * sizeof *counts);
    if (!counts)
        return error_set(err, ERROR_NO_MEMORY, "%zu shadow maps", job->count);
    for (size_t i = 0; i < job->count; i++)
        counts[i] = deep_statistics_total(&job->statistics[i]);
    bool ok =
        shadow_store_reserve(job->builder->store, SHADOW_POOL_EVENTS, counts, job->count, err);
    free(counts);
    return ok;
}

/* Room for the events that were counted, or guessed, and what is needed to sort them. */
static bool take_events(const struct deep_job *job, struct error *err)
{
    struct shadow_store *store = job->builder->store;
    if (!reserve_events(job, err))
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
        map->guess = job->is_guessed ? job->first_guess + i : 0;
    }
    return true;
}

/* In the history: of the light as it was before it moved. */
static struct content_key history_key(const struct shadow_map *map)
{
    struct content_key key = map->scene;
    content_key_add_word(&key, map->light);
    content_key_add_word(&key, map->flags);
    content_key_add_word(&key, shadow_map_texels(map));
    return key;
}

/* Whether so much is known of all lights, and they are not as many or as large as to crowd out what
 * stands. job->statistics becomes their room. */
static bool find_rooms(struct deep_job *job)
{
    const struct shadow_guesses *guesses = job->builder->guesses;
    const struct shadow_store *store = job->builder->store;
    uint64_t all = 0, block = shadow_store_block(store, SHADOW_POOL_EVENTS);
    for (size_t i = 0; i < job->count; i++) {
        struct deep_statistics *room = &job->statistics[i];
        struct error ignored = {0};
        uint64_t total;
        if (!shadow_history_find(&guesses->history, history_key(job->slots[i].build->map), room))
            return false;
        total = deep_statistics_total(room);
        all += total;
        if (total > block || !check_longest(job, i, &ignored) ||
            shadow_parts_are_needed(store, job->slots[i].build->map, false))
            return false;
    }
    return all * (SHADOW_EVENT_BYTES + SHADOW_MEDIUM_BYTES) < store->budget_bytes / 2;
}

static void forget_rooms(struct deep_job *job)
{
    struct shadow_store *store = job->builder->store;
    struct error ignored = {0}; /* what cannot be freed is lost until the store is cleared */
    for (size_t i = 0; i < job->count; i++) {
        struct shadow_map *map = job->slots[i].build->map;
        (void)!shadow_store_free(store, SHADOW_POOL_EVENTS, &map->events, &ignored);
        map->guess = 0;
    }
    deep_free_transient(job->builder);
    memset(job->statistics, 0, job->count * sizeof *job->statistics);
    job->is_guessed = false;
}

/* Room for lists by what is known of them. Where nothing is, or memory is short, sizes are read. */
static void guess(struct deep_job *job)
{
    struct shadow_guesses *guesses = job->builder->guesses;
    struct error ignored = {0};
    if (!guesses || !job->builder->may_guess || job->builder->scans_on_host || !find_rooms(job) ||
        !shadow_guesses_open(guesses, job->count, &job->first_guess, &ignored)) {
        memset(job->statistics, 0, job->count * sizeof *job->statistics);
        return;
    }
    for (size_t i = 0; i < job->count; i++)
        *shadow_guesses_find(guesses, job->first_guess + i) =
            (struct shadow_guess){.key = history_key(job->slots[i].build->map),
                                  .room = job->statistics[i],
                                  .flags = job->slots[i].build->map->flags,
                                  .state = SHADOW_GUESS_OPEN};
    job->is_guessed = true;
    if (!take_events(job, &ignored) || !deep_sort_reserve(job, &ignored))
        forget_rooms(job);
}

/* Sizes that were read are those that the next ones are guessed from. */
static void note_sizes(const struct deep_job *job)
{
    for (size_t i = 0; job->builder->guesses && !job->is_guessed && i < job->count; i++)
        shadow_history_note(&job->builder->guesses->history, history_key(job->slots[i].build->map),
                            &job->statistics[i]);
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
    if (ok && job.count) {
        ok = count_events(&job, err);
        if (ok)
            guess(&job);
        ok = ok && deep_scan_sum(&job, err);
        if (ok && !job.is_guessed)
            ok = take_events(&job, err) && deep_sort_reserve(&job, err);
        ok = ok && deep_scan_place(&job, err) && scatter_events(&job, err) && deep_sort(&job, err);
        if (ok)
            note_sizes(&job);
    }
    deep_job_finish(&job);
    deep_free_transient(builder);
    return ok;
}
