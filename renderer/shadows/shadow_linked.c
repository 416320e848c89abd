/* SPDX-License-Identifier: MIT */
/* Linked shadow lists: one pass per light, a pool that is grown and filled anew when it was too
 * small, and a walk over the finished lists for the report. */
#include <epoxy/gl.h>
#include <stdlib.h>

#include "renderer/gl/buffer_fill.h"
#include "renderer/shadows/shadow_deep.h"
#include "renderer/shadows/shadow_linked_grids.h"
#include "renderer/shadows/technique.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

enum {
    /* An element dropped for want of room may hide that another is needed, so counts can rise; one
     * attempt may find that there is no lock. */
    ATTEMPTS = 7
};

struct link_statistics {
    uint32_t elements, failures;
}; /* as shadow_linked.frag.glsl writes it */
struct walk_statistics {
    uint32_t elements, longest, occupied, unsorted;
}; /* shadow_linked_walk.comp.glsl */

struct linked_job {
    struct shadow_builder *builder;
    struct shadow_build *builds;
    size_t count;
    const struct shadow_scene *scene;
    const char *because;
    struct link_statistics *statistics; /* per build */
};

static void begin(const struct linked_job *job, const char *pass)
{
    gpu_scope_begin(job->builder->timeline, &(struct gpu_scope_desc){.pass = pass,
                                                                     .because = job->because,
                                                                     .technique = "deep-linked",
                                                                     .stage = REPORT_SHADOW});
}

static bool is_linked(const struct shadow_map *map)
{
    return map->method->structure == &shadow_structure_linked;
}

static bool is_pending(const struct shadow_build *build)
{
    return is_linked(build->map) && !build->is_done;
}

/* The elements of a light are in one storage block. */
static uint64_t at_most(const struct shadow_store *store, uint64_t elements)
{
    uint64_t most = shadow_store_whole_block(store, SHADOW_POOL_NODES);
    return elements < most ? elements : most;
}

static bool check_block(const struct shadow_store *store, const struct shadow_build *build,
                        uint64_t elements, struct error *err)
{
    return shadow_store_check_whole_block(store, SHADOW_POOL_HEADS, shadow_map_texels(build->map),
                                          build->light, err) &&
           shadow_store_check_whole_block(store, SHADOW_POOL_NODES, elements, build->light, err);
}

/* What the light had before, and an eighth; else so many a texel as hold whole scenes, which as
 * published have their opaque casters among them. */
static uint64_t first_guess(const struct shadow_builder *builder, const struct shadow_map *map)
{
    if (builder->first_elements)
        return builder->first_elements;
    uint64_t guess = map->expected_nodes ? map->expected_nodes + map->expected_nodes / 8
                                         : (map->is_faithful ? 3 : 1) * shadow_map_texels(map);
    return at_most(builder->store, guess);
}

/* Less where the guess has no room: what is missing is known once the lists are filled. */
static bool take_guess(struct shadow_store *store, uint64_t elements, struct shadow_map *map,
                       struct error *err)
{
    const uint64_t least = 4096;
    struct error failure = {0};
    bool ok = false;
    do {
        failure = (struct error){0};
        ok = shadow_store_take(store, SHADOW_POOL_NODES, elements, &map->nodes, &failure);
        elements /= 4;
    } while (!ok && failure.code == ERROR_OVER_BUDGET && elements >= least);
    return ok || error_pass(err, &failure);
}

static bool take_memory(const struct linked_job *job, struct error *err)
{
    struct shadow_builder *builder = job->builder;
    for (size_t i = 0; i < job->count; i++) {
        struct shadow_map *map = job->builds[i].map;
        if (!is_pending(&job->builds[i]))
            continue;
        uint64_t texels = shadow_map_texels(map);
        uint64_t elements = first_guess(builder, map);
        if (!check_block(builder->store, &job->builds[i], 0, err) ||
            !shadow_store_take(builder->store, SHADOW_POOL_HEADS, texels, &map->heads, err) ||
            !take_guess(builder->store, elements, map, err))
            return false;
    }
    struct gl_buffer_desc statistics = {.label = "shadow.linked.statistics",
                                        .size_bytes = job->count * sizeof(struct walk_statistics)};
    return gl_buffer_reserve(&builder->statistics, &statistics, false, err);
}

/* What a storage block takes of the lights from the first on; their number, at least one. */
static size_t bind_lists(const struct linked_job *job, struct shadow_build *const *builds,
                         size_t count, struct shadow_range *heads, struct shadow_range *nodes)
{
    const struct shadow_store *store = job->builder->store;
    size_t some = 0;
    *heads = *nodes = (struct shadow_range){0};
    while (some < count &&
           shadow_store_widen(store, SHADOW_POOL_HEADS, &builds[some]->map->heads, heads) &&
           shadow_store_widen(store, SHADOW_POOL_NODES, &builds[some]->map->nodes, nodes))
        some++;
    shadow_store_bind(store, SHADOW_POOL_HEADS, 0, heads, BIND_SHADOW_COUNTS);
    if (nodes->count)
        shadow_store_bind(store, SHADOW_POOL_NODES, 0, nodes, BIND_LIST_NODES);
    gl_buffer_bind_storage(&job->builder->statistics, BIND_STATISTICS);
    return some;
}

/* Lights that are painted with the same program, from the first on. */
static size_t count_alike(struct shadow_build *const *builds, size_t count)
{
    size_t some = 1;
    while (some < count && !builds[some]->map->lock_failures == !builds[0]->map->lock_failures)
        some++;
    return some;
}

/* The density grids of those lights that hold them, whose lists are bound. */
static bool add_grids(const struct linked_job *job, struct shadow_build *const *builds,
                      size_t count, const struct shadow_range *heads,
                      const struct shadow_range *nodes, struct error *err)
{
    bool ok = true, is_waited_for = false;
    for (size_t i = 0; ok && i < count; i++) {
        if (!builds[i]->map->holds_grids)
            continue;
        if (!is_waited_for)
            glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
        is_waited_for = true;
        ok = shadow_linked_add_grids(job->builder->programs, builds[i], job->scene, heads->first,
                                     nodes->first, err);
    }
    return ok;
}

/* Lights whose lists a storage block takes together, at a time. */
static bool paint_lists(const struct linked_job *job, struct shadow_build *const *builds,
                        size_t count, struct error *err)
{
    bool ok = true;
    for (size_t i = 0, some; ok && i < count; i += some) {
        struct shadow_range heads, nodes;
        some = bind_lists(job, builds + i, count_alike(builds + i, count - i), &heads, &nodes);
        const struct caster_paint_desc desc = {
            /* one technique in a frame */
            .pass = builds[i]->map->is_faithful ? CASTER_LINK_FAITHFUL : CASTER_LINK,
            .is_unlocked = builds[i]->map->lock_failures > 0,
            .builds = builds + i,
            .build_count = some,
            .scene = job->scene,
            .store = job->builder->store,
            .first_count = heads.first,
            .first_event = nodes.first};
        ok = caster_painter_paint(job->builder->painter, &desc, err) &&
             add_grids(job, builds + i, some, &heads, &nodes, err);
    }
    return ok;
}

static bool empty_heads(const struct linked_job *job, const struct shadow_range *heads,
                        struct error *err)
{
    const uint32_t list_end = 0xffffffffu;
    const struct shadow_builder *builder = job->builder;
    struct shadow_store *store = builder->store;
    return buffer_fill_u32(
        &(struct buffer_fill_desc){.programs = builder->programs,
                                   .limits = store->limits,
                                   .buffer = &store->pools[SHADOW_POOL_HEADS].streams[0],
                                   .offset_bytes = heads->first * 4,
                                   .size_bytes = heads->count * 4,
                                   .value = list_end,
                                   .by_gl = builder->scans_on_host},
        err);
}

/* Those that follow one another at once. */
static bool empty_lists(const struct linked_job *job, struct shadow_build *const *builds,
                        size_t count, struct error *err)
{
    bool ok = true;
    for (size_t i = 0; ok && i < count;) {
        struct shadow_range range = builds[i]->map->heads;
        while (++i < count && builds[i]->map->heads.first == range.first + range.count)
            range.count += builds[i]->map->heads.count;
        ok = empty_heads(job, &range, err);
    }
    return ok;
}

static bool fill_lists(const struct linked_job *job, struct error *err)
{
    struct shadow_builder *builder = job->builder;
    struct shadow_build **pending = calloc(job->count, sizeof *pending);
    size_t pending_count = 0;
    if (!pending)
        return error_set(err, ERROR_NO_MEMORY, "%zu lights", job->count);
    begin(job, "shadow.linked");
    gl_buffer_clear_u32(&builder->statistics, 0, job->count * sizeof *job->statistics, 0);
    for (size_t i = 0; i < job->count; i++) {
        if (!is_pending(&job->builds[i]))
            continue;
        job->builds[i].slot = (uint32_t)i;
        job->builds[i].lock_tries =
            builder->refused_locks >> (job->builds[i].light & 63) & 1 ? 0 : LOCK_TRIES;
        pending[pending_count++] = &job->builds[i];
    }
    bool ok = empty_lists(job, pending, pending_count, err) &&
              paint_lists(job, pending, pending_count, err);
    free(pending);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);
    gpu_timeline_will_wait(builder->timeline);
    gl_buffer_read(&builder->statistics, 0, job->count * sizeof *job->statistics, job->statistics);
    gpu_scope_end(builder->timeline);
    return ok;
}

/* Without locks, elements fail only where the device ends loops early. */
static bool note_failures(struct shadow_build *build, uint32_t failures, struct error *err)
{
    struct shadow_map *map = build->map;
    if (!map->is_faithful || map->lock_failures)
        return error_set(err, ERROR_OVER_BUDGET,
                         "light %u: %u elements lie deeper in their linked lists than this device "
                         "walks in one loop",
                         build->light, failures);
    map->lock_failures = failures;
    return true;
}

/* Gives unused room back, or makes the room that was missing. Where an element found no lock, its
 * light alone is made again, without locks. */
static bool fit_memory(const struct linked_job *job, bool *is_done, struct error *err)
{
    struct shadow_store *store = job->builder->store;
    *is_done = true;
    for (size_t i = 0; i < job->count; i++) {
        struct shadow_build *build = &job->builds[i];
        struct shadow_map *map = build->map;
        uint64_t elements = job->statistics[i].elements;
        if (!is_pending(build))
            continue;
        if (job->statistics[i].failures) {
            if (!note_failures(build, job->statistics[i].failures, err))
                return false;
            *is_done = false;
            continue;
        }
        if (elements > map->nodes.count) {
            *is_done = false;
            if (!check_block(store, build, elements, err) ||
                !shadow_store_free(store, SHADOW_POOL_NODES, &map->nodes, err) ||
                !shadow_store_take(store, SHADOW_POOL_NODES,
                                   at_most(store, elements + elements / 8), &map->nodes, err))
                return false;
            continue;
        }
        struct shadow_range rest = {map->nodes.first + elements, map->nodes.count - elements};
        map->nodes.count = elements;
        build->is_done = true;
        if (!shadow_store_free(store, SHADOW_POOL_NODES, &rest, err))
            return false;
    }
    return true;
}

static struct program_desc walk_program(bool is_faithful)
{
    return (struct program_desc){.label = "shadow.linked.walk",
                                 .compute = "shadow_linked_walk.comp.glsl",
                                 .defines = is_faithful ? "SHADOW_FAITHFUL" : NULL};
}

void shadow_linked_list_programs(bool is_faithful, struct program_list *list)
{
    const struct program_desc desc = walk_program(is_faithful);
    program_list_add(list, "shadow.linked.walk", &desc, false);
}

static bool walk_lists(const struct linked_job *job, struct walk_statistics *walks,
                       struct error *err)
{
    struct shadow_builder *builder = job->builder;
    const struct gl_program *walk[2] = {NULL, NULL};
    struct gl_buffer_desc statistics = {.label = "shadow.linked.statistics",
                                        .size_bytes = job->count * sizeof *walks};
    if (!gl_buffer_reserve(&builder->statistics, &statistics, false, err))
        return false;
    for (size_t i = 0; i < job->count; i++) {
        bool is_faithful = job->builds[i].map->is_faithful;
        const struct program_desc desc = walk_program(is_faithful);
        if (!is_linked(job->builds[i].map) || walk[is_faithful])
            continue;
        walk[is_faithful] = program_cache_get(builder->programs, &desc, err);
        if (!walk[is_faithful])
            return false;
    }
    begin(job, "shadow.linked.walk");
    gl_buffer_clear_u32(&builder->statistics, 0, job->count * sizeof *walks, 0);
    for (size_t i = 0; i < job->count; i++) {
        const struct shadow_map *map = job->builds[i].map;
        if (!is_linked(map))
            continue;
        const struct gl_program *program = walk[map->is_faithful];
        const uint32_t row = 32768;
        struct shadow_build *build = &job->builds[i];
        struct shadow_range heads, nodes;
        (void)bind_lists(job, &build, 1, &heads, &nodes);
        uint32_t groups = (uint32_t)((shadow_map_texels(map) + 63) / 64);
        gl_program_use(program);
        gl_program_set_u(program, "u_first", (uint32_t)(map->heads.first - heads.first));
        gl_program_set_u(program, "u_count", (uint32_t)map->heads.count);
        gl_program_set_u(program, "u_node_base", (uint32_t)(map->nodes.first - nodes.first));
        gl_program_set_u(program, "u_slot", (uint32_t)i);
        glDispatchCompute(groups < row ? groups : row, (groups + row - 1) / row, 1);
    }
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    gpu_timeline_will_wait(builder->timeline);
    gl_buffer_read(&builder->statistics, 0, job->count * sizeof *walks, walks);
    gpu_scope_end(builder->timeline);
    return true;
}

static bool note_lists(const struct linked_job *job, struct error *err)
{
    struct walk_statistics *walks = calloc(job->count, sizeof *walks);
    if (!walks)
        return error_set(err, ERROR_NO_MEMORY, "statistics of %zu lights", job->count);
    bool ok = walk_lists(job, walks, err);
    for (size_t i = 0; ok && i < job->count; i++) {
        struct shadow_map *map = job->builds[i].map;
        if (!is_linked(map))
            continue;
        if (walks[i].unsorted)
            ok = error_set(err, ERROR_INTERNAL,
                           "light %u: %u linked lists are out of order or locked",
                           job->builds[i].light, walks[i].unsorted);
        map->event_count = walks[i].elements;
        map->longest_list = walks[i].longest;
        map->occupied_texels = walks[i].occupied;
    }
    free(walks);
    return ok;
}

/* Builds whose guessed room is taken at once: the rest of it is given back before the next ones
 * take theirs. At least one. */
static size_t group_size(const struct shadow_builder *builder, const struct shadow_build *builds,
                         size_t count)
{
    const uint64_t most = 4u << 20; /* elements: 64 MiB */
    uint64_t elements = 0;
    size_t size = 0;
    for (; size < count; size++) {
        elements += is_pending(&builds[size]) ? first_guess(builder, builds[size].map) : 0;
        if (size && elements > most)
            break;
    }
    return size;
}

static bool build_group(const struct linked_job *job, struct error *err)
{
    bool is_done = false;
    bool ok = take_memory(job, err);
    for (int attempt = 0; ok && !is_done && attempt < ATTEMPTS; attempt++)
        ok = fill_lists(job, err) && fit_memory(job, &is_done, err);
    if (ok && !is_done)
        ok = error_set(err, ERROR_INTERNAL, "linked shadow lists outgrew their pool %d times",
                       ATTEMPTS);
    return ok;
}

bool shadow_linked_build(struct shadow_builder *builder, struct shadow_build *builds, size_t count,
                         const struct shadow_scene *scene, const char *because, struct error *err)
{
    struct linked_job job = {
        .builder = builder, .builds = builds, .count = count, .scene = scene, .because = because};
    bool is_done = true;
    for (size_t i = 0; i < count; i++)
        is_done = is_done && !is_pending(&builds[i]);
    if (is_done)
        return true;
    job.statistics = calloc(count, sizeof *job.statistics);
    if (!job.statistics)
        return error_set(err, ERROR_NO_MEMORY, "statistics of %zu lights", count);
    bool ok = true;
    for (size_t first = 0; ok && first < count; first += job.count) {
        job.builds = &builds[first];
        job.count = group_size(builder, job.builds, count - first);
        ok = build_group(&job, err);
    }
    job.builds = builds;
    job.count = count;
    ok = ok && note_lists(&job, err);
    free(job.statistics);
    return ok;
}
