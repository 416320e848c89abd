/* SPDX-License-Identifier: MIT */
/* From counts to offsets. Where the device is our own cores a loop in C is several times faster
 * than a shader; both ways give the same words (tests/gpu/test_shadow_scan.c). */
#include <assert.h>
#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/shadows/shadow_deep_job.h"
#include "shaders/shared/bindings.h"

enum { REDUCE, SCAN, ADD, PASSES }; /* PASS of shadow_scan.comp.glsl */

static struct gl_buffer *heads_of(const struct deep_job *job)
{
    return &job->builder->store->pools[SHADOW_POOL_HEADS].streams[0];
}

/* Those of depths, which are not there yet while lists are built. */
static struct gl_buffer *counts_of(const struct deep_job *job)
{
    return &job->builder->store->pools[SHADOW_POOL_DEPTHS].streams[0];
}

static struct program_desc program_of(int pass)
{
    static const char *const defines[PASSES] = {"PASS=0", "PASS=1", "PASS=2"};
    return (struct program_desc){
        .label = "shadow.deep.scan", .compute = "shadow_scan.comp.glsl", .defines = defines[pass]};
}

void deep_scan_list_programs(struct program_list *list)
{
    for (int pass = 0; pass < PASSES; pass++) {
        const struct program_desc desc = program_of(pass);
        program_list_add(list, "shadow.deep.scan", &desc, false);
    }
}

/* In records that begin anew where the ring does. */
static void bind_statistics(const struct deep_job *job, const struct gl_program *program, int pass)
{
    const struct shadow_builder *builder = job->builder;
    bool is_kept = job->is_guessed;
    gl_buffer_bind_storage(is_kept ? &builder->guesses->records : &builder->statistics,
                           BIND_STATISTICS);
    if (pass == REDUCE)
        return;
    uint64_t capacity = is_kept ? builder->guesses->capacity : 1ull << 32;
    gl_program_set_u(program, "u_record", is_kept ? (uint32_t)job->first_guess : 0);
    gl_program_set_u(program, "u_record_mask", (uint32_t)(capacity - 1));
}

static const struct gl_program *use_scan(const struct deep_job *job, int pass, struct error *err)
{
    const struct shadow_builder *builder = job->builder;
    const struct program_desc desc = program_of(pass);
    const struct gl_program *program = program_cache_get(builder->programs, &desc, err);
    if (!program)
        return NULL;
    gl_program_use(program);
    gl_program_set_u(program, "u_tiles", job->tiles);
    gl_program_set_u(program, "u_lights", (uint32_t)job->count);
    gl_buffer_bind_storage(&builder->sums, BIND_SCAN);
    bind_statistics(job, program, pass);
    gl_buffer_bind_storage(&builder->lights, BIND_DEEP_LIGHTS);
    return program;
}

static uint32_t tiles_end(const struct deep_job *job, size_t slot)
{
    return slot < job->count ? job->slots[slot].first_tile : job->tiles;
}

/* Tiles of a group whose counts, and whose heads, are bound at once. */
struct scan_piece {
    uint32_t first, count; /* of the group's tiles */
    struct shadow_range counts, heads;
};

/* All of the group's, but for a single light that exceeds a storage block. */
static struct scan_piece piece_of(const struct deep_job *job, const struct deep_group *group,
                                  uint32_t first, uint32_t tiles)
{
    const struct shadow_store *store = job->builder->store;
    const struct shadow_map *map = job->slots[group->first].build->map;
    uint64_t most = shadow_store_block(store, SHADOW_POOL_HEADS) - 1,
             at = (uint64_t)first * DEEP_TILE;
    if (group->count > 1 || map->depths.count <= most)
        return (struct scan_piece){0, tiles, group->counts, group->heads};
    struct scan_piece piece = {first, (uint32_t)(most / DEEP_TILE), {0}, {0}};
    if (piece.count > tiles - first)
        piece.count = tiles - first;
    uint64_t left = map->depths.count - at, texels = (uint64_t)piece.count * DEEP_TILE;
    texels = texels < left ? texels : left;
    const struct shadow_range counts = {map->depths.first + at, texels};
    const struct shadow_range heads = {map->heads.first + at, texels + 1};
    bool is_whole = shadow_store_widen(store, SHADOW_POOL_DEPTHS, &counts, &piece.counts) &&
                    shadow_store_widen(store, SHADOW_POOL_HEADS, &heads, &piece.heads);
    assert(is_whole);
    return piece;
}

static void dispatch_piece(const struct deep_job *job, const struct gl_program *program,
                           const struct deep_group *group, const struct scan_piece *piece, int pass)
{
    const struct shadow_store *store = job->builder->store;
    gl_program_set_u(program, "u_first_tile", tiles_end(job, group->first) + piece->first);
    gl_program_set_u(program, "u_groups", piece->count);
    gl_program_set_u(program, "u_window", (uint32_t)piece->counts.first);
    shadow_store_bind(store, SHADOW_POOL_DEPTHS, 0, &piece->counts, BIND_SHADOW_COUNTS);
    if (pass == ADD) {
        gl_program_set_u(program, "u_head_window", (uint32_t)piece->heads.first);
        shadow_store_bind(store, SHADOW_POOL_HEADS, 0, &piece->heads, BIND_SHADOW_HEADS);
    }
    deep_dispatch_groups(piece->count, 1);
}

/* A group of threads per tile of each light. */
static void dispatch_tiles(const struct deep_job *job, const struct gl_program *program, int pass)
{
    for (size_t g = 0; g < job->group_count; g++) {
        const struct deep_group *group = &job->groups[g];
        uint32_t tiles = tiles_end(job, group->first + group->count) - tiles_end(job, group->first);
        gl_program_set_u(program, "u_lights", (uint32_t)group->count);
        gl_program_set_u(program, "u_first_light", (uint32_t)group->first);
        if (pass == ADD) {
            gl_program_set_u(program, "u_table", group->table);
            deep_group_bind_lists(job, group, BIND_LIST_NODES);
        }
        for (uint32_t first = 0; first < tiles;) {
            struct scan_piece piece = piece_of(job, group, first, tiles);
            dispatch_piece(job, program, group, &piece, pass);
            first += piece.count;
        }
    }
}

static bool reserve_sums(struct deep_job *job, struct error *err)
{
    struct gl_buffer_desc sums = {.label = "shadow.deep.sums",
                                  .size_bytes = 4ull * DEEP_STATISTIC_WORDS * job->tiles};
    struct gl_buffer_desc statistics = {.label = "shadow.deep.statistics",
                                        .size_bytes = job->count * sizeof *job->statistics};
    return gl_buffer_reserve(&job->builder->sums, &sums, false, err) &&
           gl_buffer_reserve(&job->builder->statistics, &statistics, false, err);
}

static bool sum_on_device(struct deep_job *job, struct error *err)
{
    if (!reserve_sums(job, err) || !deep_job_upload(job, err))
        return false;
    const struct gl_program *reduce = use_scan(job, REDUCE, err);
    if (!reduce)
        return false;
    dispatch_tiles(job, reduce, REDUCE);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    if (!use_scan(job, SCAN, err))
        return false;
    deep_dispatch_groups(job->count,
                         job->has_no_lists ? DEEP_FIRST_CLASS_WORD : DEEP_STATISTIC_WORDS);
    if (job->is_guessed)
        return true;
    gpu_timeline_will_wait(job->builder->timeline);
    gl_buffer_read(&job->builder->statistics, 0, job->count * sizeof *job->statistics,
                   job->statistics);
    for (size_t i = 0; job->has_no_lists && i < job->count; i++)
        memset(job->statistics[i].classes, 0, sizeof job->statistics[i].classes);
    return true;
}

static bool place_on_device(struct deep_job *job, struct error *err)
{
    const struct gl_program *add = use_scan(job, ADD, err);
    if (!add)
        return false;
    gl_buffer_bind_storage(&job->builder->table, BIND_DEEP_LISTS);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    dispatch_tiles(job, add, ADD);
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

/* From counts to the ends of lists. */
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
        running += n;
        counts[i] = running;
        if (n >= shortest)
            texels[place[length_class(n)]++] = (uint32_t)i;
    }
}

/* Reads the counts of a light once, and writes its heads at once: they are relative to its first
 * event. heads: room for them. */
static bool scan_on_host(struct deep_job *job, size_t index, uint32_t *heads, struct error *err)
{
    struct deep_slot *slot = &job->slots[index];
    const struct shadow_map *map = slot->build->map;
    struct deep_statistics *s = &job->statistics[index];
    uint64_t count = shadow_map_texels(map);
    uint32_t *counts = heads + 1;
    gl_buffer_read(counts_of(job), map->depths.first * 4, count * 4, counts);
    uint32_t shortest = deep_job_shortest(job, index);
    sum_counts(counts, count, shortest, s);
    slot->texels = malloc(deep_statistics_texels(s) * sizeof *slot->texels + 1);
    if (!slot->texels)
        return error_set(err, ERROR_NO_MEMORY, "scan of a shadow map");
    place_counts(counts, count, shortest, s, slot->texels);
    heads[0] = 0;
    gl_buffer_write(heads_of(job), map->heads.first * 4, (count + 1) * 4, heads);
    return true;
}

static bool sum_on_host(struct deep_job *job, struct error *err)
{
    uint64_t largest = 0;
    for (size_t i = 0; i < job->count; i++)
        if (shadow_map_texels(job->slots[i].build->map) > largest)
            largest = shadow_map_texels(job->slots[i].build->map);
    uint32_t *heads = malloc((largest + 1) * sizeof *heads);
    bool ok = heads != NULL;
    if (!ok)
        error_set(err, ERROR_NO_MEMORY, "scan of %llu texels", (unsigned long long)largest);
    for (size_t i = 0; ok && i < job->count; i++)
        ok = scan_on_host(job, i, heads, err);
    free(heads);
    return ok;
}

static void place_on_host(struct deep_job *job)
{
    for (size_t g = 0; g < job->group_count; g++) {
        const struct deep_group *group = &job->groups[g];
        for (size_t i = group->first; i < group->first + group->count; i++) {
            const uint32_t *texels = job->slots[i].texels;
            for (int c = 0; c < DEEP_CLASSES; c++) {
                uint32_t first, count = deep_group_lists(job, group, c, i, 1, &first);
                gl_buffer_write(&job->builder->texels, (group->lists_first + first) * 4,
                                4ull * count, texels);
                texels += count;
            }
        }
    }
}

bool deep_scan_sum(struct deep_job *job, struct error *err)
{
    deep_job_begin(job, "shadow.deep.scan");
    bool ok = job->builder->scans_on_host ? sum_on_host(job, err) : sum_on_device(job, err);
    if (!ok || !job->is_guessed) /* else its second half follows at once */
        gpu_scope_end(job->builder->timeline);
    return ok;
}

bool deep_scan_place(struct deep_job *job, struct error *err)
{
    bool ok = true;
    if (!job->is_guessed)
        deep_job_begin(job, "shadow.deep.scan");
    if (job->builder->scans_on_host)
        place_on_host(job);
    else
        ok = place_on_device(job, err);
    gpu_scope_end(job->builder->timeline);
    return ok;
}
