/* SPDX-License-Identifier: MIT */
/* From counts to offsets. Where the device is our own cores a loop in C is several times faster
 * than a shader; both ways give the same words (tests/gpu/test_shadow_determinism.c). */
#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>

#include "renderer/shadows/shadow_deep_job.h"
#include "shaders/shared/bindings.h"

static struct gl_buffer *heads_of(const struct deep_job *job)
{
    return &job->builder->store->pools[SHADOW_POOL_HEADS].streams[0];
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

static struct program_desc program_of(int pass)
{
    static const char *const defines[] = {"PASS=0", "PASS=1", "PASS=2"};
    return (struct program_desc){
        .label = "shadow.deep.scan", .compute = "shadow_scan.comp.glsl", .defines = defines[pass]};
}

void deep_scan_list_programs(struct program_list *list)
{
    for (int pass = 0; pass < 3; pass++) {
        const struct program_desc desc = program_of(pass);
        program_list_add(list, "shadow.deep.scan", &desc, false);
    }
}

static const struct gl_program *use_scan(const struct deep_job *job, int pass, size_t build,
                                         struct error *err)
{
    const struct program_desc desc = program_of(pass);
    const struct gl_program *program = program_cache_get(job->builder->programs, &desc, err);
    const struct shadow_map *map = job->builds[build].map;
    uint64_t texels = shadow_map_texels(map);
    if (!program)
        return NULL;
    gl_program_use(program);
    gl_program_set_u(program, "u_first", (uint32_t)map->heads.first + 1);
    gl_program_set_u(program, "u_count", (uint32_t)texels);
    gl_program_set_u(program, "u_chunk", chunk_size(texels));
    gl_program_set_u(program, "u_chunks", chunk_count(texels));
    gl_program_set_u(program, "u_chunk_first", job->chunks * (uint32_t)build);
    gl_program_set_u(program, "u_slot", (uint32_t)build);
    gl_program_set_u(program, "u_shortest", deep_job_shortest(job, build));
    gl_buffer_bind_storage(heads_of(job), BIND_SHADOW_COUNTS);
    gl_buffer_bind_storage(&job->builder->sums, BIND_SCAN);
    gl_buffer_bind_storage(&job->builder->statistics, BIND_STATISTICS);
    gl_buffer_bind_storage(&job->builder->texels, BIND_LIST_NODES);
    return program;
}

static bool reserve_sums(struct deep_job *job, struct error *err)
{
    for (size_t i = 0; i < job->count; i++) {
        uint32_t chunks = chunk_count(shadow_map_texels(job->builds[i].map));
        if (deep_job_has(job, i) && chunks > job->chunks)
            job->chunks = chunks;
    }
    struct gl_buffer_desc sums = {.label = "shadow.deep.sums",
                                  .size_bytes =
                                      4ull * job->chunks * job->count * DEEP_STATISTIC_WORDS};
    struct gl_buffer_desc statistics = {.label = "shadow.deep.statistics",
                                        .size_bytes = job->count * sizeof *job->statistics};
    return gl_buffer_reserve(&job->builder->sums, &sums, false, err) &&
           gl_buffer_reserve(&job->builder->statistics, &statistics, false, err);
}

static bool sum_on_device(struct deep_job *job, struct error *err)
{
    if (!reserve_sums(job, err))
        return false;
    for (size_t i = 0; i < job->count; i++) {
        if (!deep_job_has(job, i))
            continue;
        if (!use_scan(job, 0, i, err))
            return false;
        deep_dispatch(chunk_count(shadow_map_texels(job->builds[i].map)));
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
        if (!use_scan(job, 1, i, err))
            return false;
        deep_dispatch(DEEP_STATISTIC_WORDS);
    }
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    gpu_timeline_will_wait(job->builder->timeline);
    gl_buffer_read(&job->builder->statistics, 0, job->count * sizeof *job->statistics,
                   job->statistics);
    return true;
}

static bool place_on_device(struct deep_job *job, struct error *err)
{
    uint32_t list = 0;
    for (size_t i = 0; i < job->count; i++) {
        if (!deep_job_has(job, i))
            continue;
        const struct gl_program *program = use_scan(job, 2, i, err);
        if (!program)
            return false;
        gl_program_set_u(program, "u_list", list);
        uint32_t first = 0;
        for (int c = 0; c < DEEP_CLASSES; c++) {
            char name[32];
            snprintf(name, sizeof name, "u_class_first[%d]", c);
            gl_program_set_u(program, name, first);
            first += job->statistics[i].classes[c];
        }
        deep_dispatch(chunk_count(shadow_map_texels(job->builds[i].map)));
        list += first;
    }
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);
    return true;
}

static int length_class(uint32_t n)
{
    if (n <= 2)
        return 0;
    int class_ = 31 - __builtin_clz(n - 1);
    return class_ < DEEP_CLASSES - 1 ? class_ : DEEP_CLASSES - 1;
}

static void sum_counts(const uint32_t *counts, uint64_t count, uint32_t shortest,
                       struct deep_statistics *s)
{
    uint64_t total = 0;
    for (uint64_t i = 0; i < count; i++) {
        uint32_t n = counts[i];
        if (!n)
            continue;
        total += n;
        s->occupied++;
        if (n > s->longest)
            s->longest = n;
        if (n >= shortest)
            s->classes[length_class(n)]++;
    }
    s->total = (uint32_t)total;
    s->total_high = (uint32_t)(total >> 32);
}

static void place_counts(uint32_t *counts, uint64_t count, uint32_t shortest,
                         const struct deep_statistics *s, uint32_t *texels)
{
    uint32_t place[DEEP_CLASSES], first = 0, running = 0;
    for (int c = 0; c < DEEP_CLASSES; c++) {
        place[c] = first;
        first += s->classes[c];
    }
    for (uint64_t i = 0; i < count; i++) {
        uint32_t n = counts[i];
        counts[i] = running;
        running += n;
        if (n >= shortest)
            texels[place[length_class(n)]++] = (uint32_t)i;
    }
}

/* Reads the counts of a light once, and writes its offsets at once: they are relative to its first
 * event. */
static bool scan_on_host(struct deep_job *job, size_t build, uint32_t *counts, struct error *err)
{
    const struct shadow_map *map = job->builds[build].map;
    struct deep_statistics *s = &job->statistics[build];
    uint64_t count = shadow_map_texels(map), offset_bytes = (map->heads.first + 1) * 4;
    gl_buffer_read(heads_of(job), offset_bytes, count * 4, counts);
    uint32_t shortest = deep_job_shortest(job, build);
    sum_counts(counts, count, shortest, s);
    job->texels[build] = malloc(deep_statistics_texels(s) * sizeof *job->texels[build] + 1);
    if (!job->texels[build])
        return error_set(err, ERROR_NO_MEMORY, "scan of a shadow map");
    place_counts(counts, count, shortest, s, job->texels[build]);
    gl_buffer_write(heads_of(job), offset_bytes, count * 4, counts);
    return true;
}

static bool sum_on_host(struct deep_job *job, struct error *err)
{
    uint64_t largest = 0;
    for (size_t i = 0; i < job->count; i++)
        if (deep_job_has(job, i) && shadow_map_texels(job->builds[i].map) > largest)
            largest = shadow_map_texels(job->builds[i].map);
    uint32_t *counts = malloc(largest * sizeof *counts);
    job->texels = calloc(job->count, sizeof *job->texels);
    bool ok = counts && job->texels;
    if (!ok)
        error_set(err, ERROR_NO_MEMORY, "scan of %llu texels", (unsigned long long)largest);
    for (size_t i = 0; ok && i < job->count; i++)
        if (deep_job_has(job, i))
            ok = scan_on_host(job, i, counts, err);
    free(counts);
    return ok;
}

static void place_on_host(struct deep_job *job)
{
    uint64_t offset_bytes = 0;
    for (size_t i = 0; i < job->count; i++) {
        if (!deep_job_has(job, i))
            continue;
        uint64_t bytes = 4ull * deep_statistics_texels(&job->statistics[i]);
        gl_buffer_write(&job->builder->texels, offset_bytes, bytes, job->texels[i]);
        offset_bytes += bytes;
    }
}

bool deep_scan_sum(struct deep_job *job, struct error *err)
{
    deep_job_begin(job, "shadow.deep.scan");
    bool ok = job->builder->scans_on_host ? sum_on_host(job, err) : sum_on_device(job, err);
    gpu_scope_end(job->builder->timeline);
    return ok;
}

bool deep_scan_place(struct deep_job *job, struct error *err)
{
    bool ok = true;
    deep_job_begin(job, "shadow.deep.scan");
    if (job->builder->scans_on_host)
        place_on_host(job);
    else
        ok = place_on_device(job, err);
    gpu_scope_end(job->builder->timeline);
    return ok;
}

void deep_scan_finish(struct deep_job *job)
{
    for (size_t i = 0; job->texels && i < job->count; i++)
        free(job->texels[i]);
    free(job->texels);
    job->texels = NULL;
}
