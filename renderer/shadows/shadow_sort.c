/* SPDX-License-Identifier: MIT */
/* Sorting the events of every texel, by length class: in registers up to 32 events, by merging runs
 * of 32 beyond. */
#include <epoxy/gl.h>
#include <stdio.h>

#include "renderer/shadows/shadow_deep_job.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

enum {
    LONG_CLASS = 5,     /* from here on lists are longer than a run */
    SCRATCH_BYTES = 16, /* per event; 4 more for its object, and for its medium */
};

/* The scratch memory is that of the largest light. */
bool deep_sort_reserve(struct deep_job *job, struct error *err)
{
    struct shadow_builder *builder = job->builder;
    uint64_t texels = 0, scratch = 0;
    for (size_t i = 0; i < job->count; i++) {
        const struct deep_statistics *s = &job->statistics[i];
        if (!deep_job_has(job, i))
            continue;
        texels += deep_statistics_texels(s);
        if (s->longest > DEEP_RUN && s->total > scratch)
            scratch = s->total;
    }
    struct gl_buffer_desc lists = {.label = "shadow.deep.texels",
                                   .size_bytes = texels * 4,
                                   .is_dynamic = builder->scans_on_host};
    struct gl_buffer_desc events = {.label = "shadow.deep.scratch",
                                    .size_bytes = scratch * SCRATCH_BYTES};
    struct gl_buffer_desc objects = {.label = "shadow.deep.scratch.objects",
                                     .size_bytes = builder->store->keeps_objects ? scratch * 4 : 0};
    struct gl_buffer_desc media = {.label = "shadow.deep.scratch.media",
                                   .size_bytes = builder->store->keeps_media ? scratch * 4 : 0};
    uint64_t bytes = lists.size_bytes + events.size_bytes + objects.size_bytes + media.size_bytes;
    if (!shadow_store_check_transient(builder->store, bytes, err))
        return false;
    builder->store->transient_bytes = bytes;
    return gl_buffer_reserve(&builder->texels, &lists, false, err) &&
           gl_buffer_reserve(&builder->scratch, &events, false, err) &&
           gl_buffer_reserve(&builder->scratch_objects, &objects, false, err) &&
           gl_buffer_reserve(&builder->scratch_media, &media, false, err);
}

struct class_job { /* one length class of one light */
    const struct shadow_map *map;
    uint32_t list_first, list_count; /* in builder->texels */
};

/* Lists up to a run by their class, runs of longer ones, and their merging: to and fro. */
static const char sort_file[] = "shadow_sort.comp.glsl", merge_file[] = "shadow_merge.comp.glsl";
static const char *const nets[LONG_CLASS] = {"NET=2", "NET=4", "NET=8", "NET=16", "NET=32"};
static const char runs_to_scratch[] = "NET=32 RUNS SCRATCH", runs_in_place[] = "NET=32 RUNS";
static const char merge_last[] = "SCRATCH FROM_SCRATCH LAST",
                  merge_from_scratch[] = "SCRATCH FROM_SCRATCH", merge_to_scratch[] = "SCRATCH";

static struct program_desc program_of(uint32_t map_flags, const char *file, const char *variant,
                                      char defines[64])
{
    snprintf(defines, 64, "%s%s%s", variant, map_flags & SHADOW_FLAG_RAW ? " IDS" : "",
             map_flags & SHADOW_FLAG_MEDIA ? " MEDIA" : "");
    return (struct program_desc){.label = "shadow.deep.sort", .compute = file, .defines = defines};
}

void deep_sort_list_programs(uint32_t map_flags, struct program_list *list)
{
    const char *const runs[] = {runs_to_scratch, runs_in_place};
    const char *const merges[] = {merge_last, merge_from_scratch, merge_to_scratch};
    char defines[64];
    struct program_desc desc;
    for (int i = 0; i < LONG_CLASS + 2; i++) {
        const char *variant = i < LONG_CLASS ? nets[i] : runs[i - LONG_CLASS];
        desc = program_of(map_flags, sort_file, variant, defines);
        program_list_add(list, "shadow.deep.sort", &desc, true);
    }
    for (int i = 0; i < 3; i++) {
        desc = program_of(map_flags, merge_file, merges[i], defines);
        program_list_add(list, "shadow.deep.sort", &desc, true);
    }
}

static const struct gl_program *use_program(const struct deep_job *job,
                                            const struct class_job *lists, const char *file,
                                            const char *variant, struct error *err)
{
    char defines[64];
    const struct shadow_map *map = lists->map;
    const struct program_desc desc = program_of(map->flags, file, variant, defines);
    const struct gl_program *program = program_cache_get(job->builder->programs, &desc, err);
    if (!program)
        return NULL;
    gl_program_use(program);
    gl_program_set_u(program, "u_first_head", (uint32_t)map->heads.first);
    gl_program_set_u(program, "u_event_base", (uint32_t)map->events.first);
    gl_program_set_u(program, "u_list_first", lists->list_first);
    gl_program_set_u(program, "u_list_count", lists->list_count);
    gl_program_set_f(program, "u_keys_per_m", map->keys_per_m);
    float sigma[2][4] = {{0}};
    for (int k = 0; k < 3; k++) {
        sigma[0][k] = (float)map->sigma[k];
        sigma[1][k] = (float)(map->sigma[k] - (double)sigma[0][k]);
    }
    gl_program_set_f4(program, "u_sigma[0]", sigma[0]);
    gl_program_set_f4(program, "u_sigma[1]", sigma[1]);
    return program;
}

static bool sort_short(const struct deep_job *job, const struct class_job *lists, int class_,
                       struct error *err)
{
    if (!use_program(job, lists, sort_file, nets[class_], err))
        return false;
    deep_dispatch(lists->list_count);
    return true;
}

/* Runs of 32, then one merge per level, to and fro, so that the last one ends in the streams. */
static bool sort_long(const struct deep_job *job, const struct class_job *lists, int class_,
                      struct error *err)
{
    int levels = class_ - LONG_CLASS + 1;
    bool in_scratch = levels % 2 != 0;
    if (!use_program(job, lists, sort_file, in_scratch ? runs_to_scratch : runs_in_place, err))
        return false;
    deep_dispatch(lists->list_count);
    for (int level = 0; level < levels; level++) {
        const char *variant = level + 1 == levels ? merge_last
                              : in_scratch        ? merge_from_scratch
                                                  : merge_to_scratch;
        const struct gl_program *merge = use_program(job, lists, merge_file, variant, err);
        if (!merge)
            return false;
        gl_program_set_u(merge, "u_width", (uint32_t)DEEP_RUN << level);
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);
        deep_dispatch(lists->list_count);
        in_scratch = !in_scratch;
    }
    return true;
}

static void bind_streams(const struct deep_job *job)
{
    struct shadow_builder *builder = job->builder;
    struct shadow_store *store = builder->store;
    struct shadow_pool *events = &store->pools[SHADOW_POOL_EVENTS];
    gl_buffer_bind_storage(&events->streams[SHADOW_STREAM_EVENT], BIND_SHADOW_EVENTS);
    gl_buffer_bind_storage(&events->streams[SHADOW_STREAM_KEYS], BIND_SHADOW_KEYS);
    gl_buffer_bind_storage(&builder->texels, BIND_SCAN);
    gl_buffer_bind_storage(&builder->scratch, BIND_LIST_NODES);
    gl_buffer_bind_storage(&builder->scratch_objects, BIND_STATISTICS);
    gl_buffer_bind_storage(&builder->scratch_media, BIND_SHADOW_SCRATCH_MEDIA);
    draw_arena_bind_materials(job->scene->arena);
    gl_texture_bind(shadow_store_view(store, SHADOW_POOL_HEADS, 0), UNIT_SHADOW_HEADS);
    gl_texture_bind(shadow_store_view(store, SHADOW_POOL_EVENTS, SHADOW_STREAM_EVENT),
                    UNIT_SHADOW_EVENTS);
    if (store->keeps_media) {
        gl_buffer_bind_storage(&events->streams[SHADOW_STREAM_MEDIUM], BIND_SHADOW_MEDIA);
        gl_texture_bind(shadow_store_view(store, SHADOW_POOL_EVENTS, SHADOW_STREAM_MEDIUM),
                        UNIT_SHADOW_MEDIA);
    }
    if (store->keeps_objects) {
        gl_buffer_bind_storage(&events->streams[SHADOW_STREAM_OBJECT], BIND_SHADOW_EVENTS_ID);
        gl_texture_bind(shadow_store_view(store, SHADOW_POOL_EVENTS, SHADOW_STREAM_OBJECT),
                        UNIT_SHADOW_ID);
    }
}

bool deep_sort(struct deep_job *job, struct error *err)
{
    bool ok = true;
    uint32_t list = 0;
    deep_job_begin(job, "shadow.deep.sort");
    bind_streams(job);
    for (size_t i = 0; ok && i < job->count; i++) {
        for (int c = 0; ok && deep_job_has(job, i) && c < DEEP_CLASSES; c++) {
            struct class_job lists = {job->builds[i].map, list, job->statistics[i].classes[c]};
            if (lists.list_count)
                ok = c < LONG_CLASS ? sort_short(job, &lists, c, err)
                                    : sort_long(job, &lists, c, err);
            list += lists.list_count;
        }
    }
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);
    gpu_scope_end(job->builder->timeline);
    return ok;
}
