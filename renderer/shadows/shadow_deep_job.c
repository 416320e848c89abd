/* SPDX-License-Identifier: MIT */
/* Slots, groups and tables of the deep shadow maps being built. */
#include "renderer/shadows/shadow_deep_job.h"

#include <epoxy/gl.h>
#include <stdlib.h>

#include "renderer/shadows/technique.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

enum { LISTS_GRAIN = GL_BUFFER_ALIGNMENT / 4 }; /* words that the lists of a group start at */

bool deep_is_built(const struct shadow_map *map)
{
    return map->method->structure == &shadow_structure_deep && !(map->flags & SHADOW_FLAG_NODES);
}

static void add_slots(struct deep_job *job, struct shadow_build *builds, size_t count,
                      uint32_t flags)
{
    for (size_t i = 0; i < count; i++) {
        const struct shadow_map *map = builds[i].map;
        if (!deep_is_built(map) || (map->flags & (SHADOW_FLAG_RAW | SHADOW_FLAG_MEDIA)) != flags)
            continue;
        job->slots[job->count++] = (struct deep_slot){&builds[i], job->tiles, NULL};
        job->tiles += (uint32_t)((shadow_map_texels(map) + DEEP_TILE - 1) / DEEP_TILE);
    }
}

/* False, and the group stays as it was, where a storage block ends. */
static bool widen(const struct shadow_store *store, const struct shadow_map *map,
                  struct deep_group *group)
{
    struct shadow_range heads = group->heads, counts = group->counts;
    bool is_one = shadow_store_widen(store, SHADOW_POOL_HEADS, &map->heads, &heads) &&
                  shadow_store_widen(store, SHADOW_POOL_DEPTHS, &map->depths, &counts);
    if (!is_one)
        return false;
    group->heads = heads;
    group->counts = counts;
    return true;
}

static void find_groups(struct deep_job *job)
{
    const struct shadow_store *store = job->builder->store;
    struct deep_group *group = NULL;
    for (size_t i = 0; i < job->count; i++) {
        const struct shadow_map *map = job->slots[i].build->map;
        if (!group || !widen(store, map, group)) {
            group = &job->groups[job->group_count++];
            *group = (struct deep_group){
                .first = i, .table = (uint32_t)(DEEP_CLASSES * i + job->group_count - 1)};
            (void)widen(store, map, group);
        }
        group->count++;
    }
}

bool deep_job_init(struct deep_job *job, struct shadow_build *builds, size_t count,
                   struct error *err)
{
    job->slots = calloc(count + 1, sizeof *job->slots);
    job->statistics = calloc(count + 1, sizeof *job->statistics);
    job->groups = calloc(count + 1, sizeof *job->groups);
    job->table = calloc((DEEP_CLASSES + 1) * (count + 1), sizeof *job->table);
    if (!job->slots || !job->statistics || !job->groups || !job->table)
        return error_set(err, ERROR_NO_MEMORY, "building %zu shadow maps", count);
    const uint32_t flags[] = {0, SHADOW_FLAG_RAW, SHADOW_FLAG_MEDIA,
                              SHADOW_FLAG_RAW | SHADOW_FLAG_MEDIA};
    for (size_t i = 0; i < sizeof flags / sizeof *flags; i++)
        add_slots(job, builds, count, flags[i]);
    find_groups(job);
    return true;
}

void deep_job_finish(struct deep_job *job)
{
    for (size_t i = 0; i < job->count; i++)
        free(job->slots[i].texels);
    free(job->slots);
    free(job->statistics);
    free(job->groups);
    free(job->table);
    job->slots = NULL;
    job->statistics = NULL;
    job->groups = NULL;
    job->table = NULL;
    job->count = job->group_count = 0;
}

uint32_t deep_job_shortest(const struct deep_job *job, size_t slot)
{
    if (job->has_no_lists)
        return UINT32_MAX;
    return job->slots[slot].build->map->flags & SHADOW_FLAG_MEDIA ? 1 : 2;
}

void deep_job_begin(const struct deep_job *job, const char *pass)
{
    const struct shadow_method *method = job->count ? job->slots[0].build->map->method : NULL;
    const char *name = shadow_technique_name((int)(method ? method : &shadow_method_deep)->id);
    gpu_scope_begin(job->builder->timeline, &(struct gpu_scope_desc){.pass = pass,
                                                                     .because = job->because,
                                                                     .technique = name,
                                                                     .stage = REPORT_SHADOW});
}

static struct deep_light light_of(const struct deep_job *job, size_t slot)
{
    const struct shadow_map *map = job->slots[slot].build->map;
    struct deep_light light = {
        .first_count = (uint32_t)map->depths.first,
        .texels = (uint32_t)shadow_map_texels(map),
        .first_tile = job->slots[slot].first_tile,
        .shortest = deep_job_shortest(job, slot),
        .event_base = (uint32_t)map->events.first,
        .keys_per_m = map->keys_per_m,
        .first_head = (uint32_t)map->heads.first,
        .event_room = job->statistics[slot].total,
        .longest_room = job->statistics[slot].longest,
    };
    for (int k = 0; k < 3; k++) {
        light.sigma_high.v[k] = (float)map->sigma[k];
        light.sigma_low.v[k] = (float)(map->sigma[k] - (double)light.sigma_high.v[k]);
    }
    return light;
}

bool deep_job_upload(const struct deep_job *job, struct error *err)
{
    struct gl_buffer *buffer = &job->builder->lights;
    struct deep_light *lights = malloc(job->count * sizeof *lights + 1);
    struct gl_buffer_desc desc = {.label = "shadow.deep.lights",
                                  .size_bytes = job->count * sizeof *lights,
                                  .is_dynamic = true};
    bool ok = lights != NULL;
    if (!ok)
        error_set(err, ERROR_NO_MEMORY, "records of %zu lights", job->count);
    for (size_t i = 0; ok && i < job->count; i++)
        lights[i] = light_of(job, i);
    ok = ok && gl_buffer_reserve(buffer, &desc, false, err);
    if (ok)
        gl_buffer_write(buffer, 0, desc.size_bytes, lights);
    free(lights);
    return ok;
}

/* A group of several lights has fewer than a block has counts. */
static bool refuse_lists(const struct deep_job *job, const struct deep_group *group, uint32_t lists,
                         struct error *err)
{
    return error_set(err, ERROR_OVER_BUDGET,
                     "light %u has %u lists of events, this device sorts %llu at once: lower "
                     "quality.shadow_resolution",
                     job->slots[group->first].build->light, lists,
                     (unsigned long long)gl_limits_whole_block(job->builder->store->limits, 4));
}

bool deep_job_lay_out(struct deep_job *job, uint64_t *lists, struct error *err)
{
    uint64_t words = DEEP_CLASSES * job->count + job->group_count;
    *lists = 0;
    for (size_t g = 0; g < job->group_count; g++) {
        struct deep_group *group = &job->groups[g];
        uint32_t *row = job->table + group->table, running = 0;
        for (int c = 0; c < DEEP_CLASSES; c++) {
            for (size_t i = 0; i < group->count; i++) {
                *row++ = running;
                running += job->statistics[group->first + i].classes[c];
            }
        }
        *row = running;
        if ((uint64_t)running > gl_limits_whole_block(job->builder->store->limits, 4))
            return refuse_lists(job, group, running, err);
        group->lists_first = *lists;
        *lists += (running + LISTS_GRAIN - 1) / LISTS_GRAIN * LISTS_GRAIN;
    }
    struct gl_buffer_desc desc = {
        .label = "shadow.deep.table", .size_bytes = words * 4, .is_dynamic = true};
    if (!gl_buffer_reserve(&job->builder->table, &desc, false, err))
        return false;
    gl_buffer_write(&job->builder->table, 0, words * 4, job->table);
    return true;
}

uint32_t deep_group_lists(const struct deep_job *job, const struct deep_group *group, int class_,
                          size_t slot, size_t slots, uint32_t *first)
{
    const uint32_t *row =
        job->table + group->table + (size_t)class_ * group->count + (slot - group->first);
    *first = row[0];
    return row[slots] - row[0];
}

void deep_group_bind_lists(const struct deep_job *job, const struct deep_group *group,
                           uint32_t binding)
{
    const uint32_t *row = job->table + group->table;
    uint64_t lists = row[DEEP_CLASSES * group->count];
    if (lists)
        gl_buffer_bind_storage_range(&job->builder->texels, group->lists_first * 4, lists * 4,
                                     binding);
}

void deep_dispatch_groups(uint64_t groups, uint32_t slices)
{
    const uint64_t row = 32768; /* below the 65,535 groups that every device has per dimension */
    if (groups)
        glDispatchCompute((GLuint)(groups < row ? groups : row), (GLuint)((groups + row - 1) / row),
                          slices);
}

void deep_dispatch(uint32_t threads)
{
    deep_dispatch_groups(((uint64_t)threads + 63) / 64, 1);
}
