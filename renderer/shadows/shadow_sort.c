/* SPDX-License-Identifier: MIT */
/* Sorting the events of every texel, by length class: in registers up to 32 events, by merging runs
 * of 32 beyond. A step is one dispatch over the lists of a class of all lights; classes share the
 * barriers between the steps of merging. */
#include <assert.h>
#include <epoxy/gl.h>
#include <stdio.h>

#include "renderer/gl/buffer_fill.h"
#include "renderer/shadows/shadow_deep_job.h"
#include "renderer/shadows/shadow_parts.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

static const uint32_t NO_LIST = UINT32_MAX; /* of shadow_list.glsl: beyond all texels */

enum {
    LONG_CLASS = 5,   /* from here on lists are longer than a run */
    STAGED_CLASS = 3, /* of 9 to 16 events: more than a graphics device has registers for */
    /* Events of scratch memory: 64 MiB of the 128 that drivers take as one block, and a million
       lists of up to 64 events at once, more than any device has threads in flight. */
    SCRATCH_EVENTS = 4 << 20,
};

struct sort_piece { /* lists of one class that are merged at once */
    int class_;
    uint32_t skip, count; /* lists of the class before them, and theirs */
    uint32_t scratch;     /* where they begin there ... */
    uint32_t room;        /* ... and how many events each of them may have */
};

/* What scratch memory holds at once. */
struct sort_batch {
    struct sort_piece pieces[DEEP_CLASSES];
    int count;
    uint32_t events; /* of scratch memory */
};

struct sort_span { /* slots of one group with equal streams, whose events one storage block takes */
    const struct deep_group *group;
    size_t first, count;
    struct shadow_range events;
    uint32_t first_texel, texels; /* whose lists are sorted; of each light */
    uint32_t flags;
    uint32_t class_, skip; /* what is to be merged next */
};

/* Merges that a list of the class goes through. A single run of its own only goes on from scratch
 * memory to the streams. */
static int levels_of(int class_)
{
    return class_ < LONG_CLASS ? 1 : class_ - LONG_CLASS + 1;
}

/* The first class of lists that go through scratch memory. A run of 32 is sorted by keys and then
 * fetched in order, which is not possible in place. Our own cores have no registers to save: there
 * a list of one run takes half as long again by way of scratch memory. */
static int first_long(bool on_host)
{
    return on_host ? LONG_CLASS : LONG_CLASS - 1;
}

static uint32_t flags_of(const struct deep_job *job, size_t slot)
{
    return job->slots[slot].build->map->flags & (SHADOW_FLAG_RAW | SHADOW_FLAG_MEDIA);
}

/* The light's events exceed a storage block: it is sorted part by part. */
static bool is_divided(const struct deep_job *job, size_t slot)
{
    return shadow_parts_are_needed(job->builder->store, job->slots[slot].build->map, true);
}

/* The slots of the group from `first` on that go into one dispatch; false where there are none. */
static bool find_span(const struct deep_job *job, const struct deep_group *group, size_t first,
                      struct sort_span *span)
{
    size_t end = group->first + group->count;
    *span = (struct sort_span){.group = group, .first = first, .texels = NO_LIST};
    if (first == end)
        return false;
    span->flags = flags_of(job, first);
    span->class_ = (uint32_t)first_long(job->builder->scans_on_host);
    span->count = is_divided(job, first);
    for (size_t i = first; i < end && !is_divided(job, i) && flags_of(job, i) == span->flags; i++) {
        if (!shadow_store_widen(job->builder->store, SHADOW_POOL_EVENTS,
                                &job->slots[i].build->map->events, &span->events))
            break;
        span->count++;
    }
    return true;
}

static uint32_t class_lists(const struct deep_job *job, const struct sort_span *span, int class_)
{
    uint32_t first;
    return deep_group_lists(job, span->group, class_, span->first, span->count, &first);
}

static uint32_t longest_of(const struct deep_job *job, const struct sort_span *span)
{
    uint32_t longest = 0;
    for (size_t i = span->first; i < span->first + span->count; i++)
        if (job->statistics[i].longest > longest)
            longest = job->statistics[i].longest;
    return longest;
}

/* Twice the longest list goes into a storage block, and so here: shadow_deep.c. */
static uint32_t most_scratch(const struct deep_job *job)
{
    int64_t block = job->builder->store->limits->max_storage_block_bytes / DEEP_SCRATCH_BYTES;
    return block < SCRATCH_EVENTS ? (uint32_t)block : SCRATCH_EVENTS;
}

/* As many of the long lists that are left as scratch memory holds; false where none is left. Lists
 * that are merged more than once go to and fro between two halves. */
static bool next_batch(const struct deep_job *job, struct sort_span *span, struct sort_batch *batch)
{
    uint32_t most = most_scratch(job), longest = longest_of(job, span);
    *batch = (struct sort_batch){0};
    for (; span->class_ < DEEP_CLASSES; span->class_++, span->skip = 0) {
        uint32_t left = class_lists(job, span, (int)span->class_) - span->skip;
        uint32_t room = 2u << span->class_ < longest ? 2u << span->class_ : longest;
        uint32_t each = levels_of((int)span->class_) > 1 ? 2 * room : room;
        if (!left || !each)
            continue;
        uint32_t fit = (most - batch->events) / each, count = left < fit ? left : fit;
        if (count)
            batch->pieces[batch->count++] =
                (struct sort_piece){(int)span->class_, span->skip, count, batch->events, room};
        batch->events += count * each;
        span->skip += count;
        if (count < left)
            break;
    }
    return batch->count > 0;
}

/* As much as the largest batch takes. */
static uint64_t scratch_events(const struct deep_job *job)
{
    uint64_t most = 0;
    for (size_t g = 0; g < job->group_count; g++) {
        struct sort_span span;
        for (size_t i = job->groups[g].first; find_span(job, &job->groups[g], i, &span);
             i += span.count) {
            struct sort_batch batch;
            while (next_batch(job, &span, &batch))
                most = batch.events > most ? batch.events : most;
        }
    }
    return most;
}

/* There is none where all lists are short. */
static bool reserve_scratch(struct gl_buffer *buffer, const struct gl_buffer_desc *desc,
                            struct error *err)
{
    return !desc->size_bytes || gl_buffer_reserve(buffer, desc, false, err);
}

static void bind_scratch(const struct gl_buffer *buffer, uint32_t binding)
{
    if (buffer->name)
        gl_buffer_bind_storage(buffer, binding);
}

bool deep_sort_reserve(struct deep_job *job, struct error *err)
{
    struct shadow_builder *builder = job->builder;
    uint64_t lists;
    if (!deep_job_upload(job, err) || !deep_job_lay_out(job, &lists, err))
        return false;
    uint64_t scratch = scratch_events(job);
    struct gl_buffer_desc texels = {.label = "shadow.deep.texels",
                                    .size_bytes = lists * 4,
                                    .is_dynamic = builder->scans_on_host};
    struct gl_buffer_desc events = {.label = "shadow.deep.scratch",
                                    .size_bytes = scratch * DEEP_SCRATCH_BYTES};
    struct gl_buffer_desc objects = {.label = "shadow.deep.scratch.objects",
                                     .size_bytes = builder->store->keeps_objects ? scratch * 4 : 0};
    struct gl_buffer_desc media = {.label = "shadow.deep.scratch.media",
                                   .size_bytes = builder->store->keeps_media ? scratch * 4 : 0};
    uint64_t bytes = texels.size_bytes + events.size_bytes + objects.size_bytes + media.size_bytes;
    if (!shadow_store_check_transient(builder->store, bytes, err))
        return false;
    builder->store->transient_bytes = bytes;
    if (!gl_buffer_reserve(&builder->texels, &texels, false, err) ||
        !reserve_scratch(&builder->scratch, &events, err) ||
        !reserve_scratch(&builder->scratch_objects, &objects, err) ||
        !reserve_scratch(&builder->scratch_media, &media, err))
        return false;
    const struct buffer_fill_desc fill = {.programs = builder->programs,
                                          .limits = builder->store->limits,
                                          .buffer = &builder->texels,
                                          .size_bytes = texels.size_bytes,
                                          .value = NO_LIST};
    return !job->is_guessed || !lists || buffer_fill_u32(&fill, err); /* not all become lists */
}

/* Lists up to a run by their class, runs of longer ones, and their merging. */
static const char sort_file[] = "shadow_sort.comp.glsl", merge_file[] = "shadow_merge.comp.glsl";
static const char *const nets[LONG_CLASS] = {"NET=2", "NET=4", "NET=8", "NET=16", "NET=32"};
static const char staged[] = "NET=16 KEYED";
static const char runs_whole[] = "NET=32 RUNS", runs_by_key[] = "NET=32 RUNS KEYED";
static const char merge_on[] = "SCRATCH", merge_last[] = "SCRATCH LAST";

static const char *runs_of(bool on_host)
{
    return on_host ? runs_whole : runs_by_key;
}

static const char *net_of(int class_, bool on_host)
{
    return on_host || class_ < STAGED_CLASS ? nets[class_] : staged;
}

static struct program_desc program_of(uint32_t map_flags, const char *file, const char *variant,
                                      char defines[64])
{
    snprintf(defines, 64, "%s%s%s", variant, map_flags & SHADOW_FLAG_RAW ? " IDS" : "",
             map_flags & SHADOW_FLAG_MEDIA ? " MEDIA" : "");
    return (struct program_desc){.label = "shadow.deep.sort", .compute = file, .defines = defines};
}

static void list_program(uint32_t map_flags, const char *file, const char *variant,
                         struct program_list *list)
{
    char defines[64];
    const struct program_desc desc = program_of(map_flags, file, variant, defines);
    program_list_add(list, "shadow.deep.sort", &desc, true);
}

void deep_sort_list_programs(uint32_t map_flags, bool on_host, struct program_list *list)
{
    for (int i = 0; i < first_long(on_host); i++)
        list_program(map_flags, sort_file, net_of(i, on_host), list);
    list_program(map_flags, sort_file, runs_of(on_host), list);
    list_program(map_flags, merge_file, merge_last, list);
    list_program(map_flags, merge_file, merge_on, list);
}

/* The program, with uniforms that say which lists it sorts. */
static const struct gl_program *use_program(const struct deep_job *job,
                                            const struct sort_span *span, const char *file,
                                            const char *variant, int class_, struct error *err)
{
    char defines[64];
    const struct deep_group *group = span->group;
    const struct program_desc desc = program_of(span->flags, file, variant, defines);
    const struct gl_program *program = program_cache_get(job->builder->programs, &desc, err);
    if (!program)
        return NULL;
    size_t row = (size_t)class_ * group->count + (span->first - group->first);
    gl_program_use(program);
    gl_program_set_u(program, "u_row", group->table + (uint32_t)row);
    gl_program_set_u(program, "u_lights", (uint32_t)span->count);
    gl_program_set_u(program, "u_first_light", (uint32_t)span->first);
    gl_program_set_u(program, "u_event_window", (uint32_t)span->events.first);
    gl_program_set_u2(program, "u_texels", span->first_texel, span->texels);
    return program;
}

static bool sort_short(const struct deep_job *job, const struct sort_span *span, int class_,
                       struct error *err)
{
    uint32_t lists = class_lists(job, span, class_);
    if (!lists)
        return true;
    const char *net = net_of(class_, job->builder->scans_on_host);
    const struct gl_program *sort = use_program(job, span, sort_file, net, class_, err);
    if (!sort)
        return false;
    gl_program_set_u2(sort, "u_lists", 0, lists);
    deep_dispatch(lists);
    return true;
}

/* Step 0 makes runs, step k merges those of 32 * 2^(k - 1): from one half of scratch memory to the
 * other, at last into the streams. */
static bool merge_piece(const struct deep_job *job, const struct sort_span *span,
                        const struct sort_piece *piece, int step, struct error *err)
{
    int levels = levels_of(piece->class_);
    const char *variant = step == 0        ? runs_of(job->builder->scans_on_host)
                          : step == levels ? merge_last
                                           : merge_on;
    const struct gl_program *program =
        use_program(job, span, step ? merge_file : sort_file, variant, piece->class_, err);
    if (!program)
        return false;
    uint32_t half = piece->count * piece->room, other = (uint32_t)step % 2;
    gl_program_set_u2(program, "u_lists", piece->skip, piece->count);
    gl_program_set_u(program, "u_room", piece->room);
    gl_program_set_u(program, "u_from", piece->scratch + (1 - other) * half);
    gl_program_set_u(program, "u_to", piece->scratch + other * half);
    gl_program_set_u(program, "u_width", step ? (uint32_t)DEEP_RUN << (step - 1) : 0);
    deep_dispatch(piece->count);
    return true;
}

/* All pieces take a step at once; only the steps of a list follow each other. */
static bool sort_batch(const struct deep_job *job, const struct sort_span *span,
                       const struct sort_batch *batch, struct error *err)
{
    for (int step = 0; step <= levels_of(DEEP_CLASSES - 1); step++) {
        bool has_any = false;
        for (int i = 0; i < batch->count; i++) {
            if (levels_of(batch->pieces[i].class_) < step)
                continue;
            has_any = true;
            if (!merge_piece(job, span, &batch->pieces[i], step, err))
                return false;
        }
        if (has_any)
            glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    }
    return true;
}

static void bind_lists(const struct deep_job *job)
{
    const struct shadow_builder *builder = job->builder;
    const struct shadow_store *store = builder->store;
    gl_buffer_bind_storage(&builder->lights, BIND_DEEP_LIGHTS);
    gl_buffer_bind_storage(&builder->table, BIND_DEEP_LISTS);
    bind_scratch(&builder->scratch, BIND_LIST_NODES);
    bind_scratch(&builder->scratch_objects, BIND_STATISTICS);
    bind_scratch(&builder->scratch_media, BIND_SHADOW_SCRATCH_MEDIA);
    draw_arena_bind_materials(job->scene->arena);
    gl_texture_bind(shadow_store_view(store, SHADOW_POOL_HEADS, 0), UNIT_SHADOW_HEADS);
    gl_texture_bind(shadow_store_view(store, SHADOW_POOL_EVENTS, SHADOW_STREAM_EVENT),
                    UNIT_SHADOW_EVENTS);
    if (store->keeps_media)
        gl_texture_bind(shadow_store_view(store, SHADOW_POOL_EVENTS, SHADOW_STREAM_MEDIUM),
                        UNIT_SHADOW_MEDIA);
    if (store->keeps_objects)
        gl_texture_bind(shadow_store_view(store, SHADOW_POOL_EVENTS, SHADOW_STREAM_OBJECT),
                        UNIT_SHADOW_ID);
}

static void bind_streams(const struct deep_job *job, const struct sort_span *span)
{
    static const uint32_t bindings[SHADOW_STREAMS_MAX] = {
        [SHADOW_STREAM_EVENT] = BIND_SHADOW_EVENTS,
        [SHADOW_STREAM_KEYS] = BIND_SHADOW_KEYS,
        [SHADOW_STREAM_OBJECT] = BIND_SHADOW_EVENTS_ID,
        [SHADOW_STREAM_MEDIUM] = BIND_SHADOW_MEDIA,
    };
    const struct shadow_store *store = job->builder->store;
    for (int stream = 0; stream < SHADOW_STREAMS_MAX; stream++)
        if (store->pools[SHADOW_POOL_EVENTS].streams[stream].name)
            shadow_store_bind(store, SHADOW_POOL_EVENTS, stream, &span->events, bindings[stream]);
    deep_group_bind_lists(job, span->group, BIND_SCAN);
}

static bool sort_span(const struct deep_job *job, struct sort_span *span, struct error *err)
{
    struct sort_batch batch;
    bind_streams(job, span);
    for (int c = 0; c < first_long(job->builder->scans_on_host); c++)
        if (!sort_short(job, span, c, err))
            return false;
    while (next_batch(job, span, &batch))
        if (!sort_batch(job, span, &batch, err))
            return false;
    return true;
}

static bool sort_parts(const struct deep_job *job, const struct sort_span *whole, struct error *err)
{
    const struct shadow_store *store = job->builder->store;
    const struct shadow_map *map = job->slots[whole->first].build->map;
    struct shadow_part part = {.texels = 0};
    gpu_timeline_will_wait(job->builder->timeline);
    do {
        struct sort_span span = *whole;
        if (!shadow_part_next(store, map, true, &part, err))
            return false;
        span.first_texel = (uint32_t)part.first_texel;
        span.texels = (uint32_t)part.texels;
        bool is_whole = shadow_store_widen(store, SHADOW_POOL_EVENTS, &part.events, &span.events);
        assert(is_whole);
        if (span.events.count && !sort_span(job, &span, err))
            return false;
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    } while (part.texels);
    return true;
}

bool deep_sort(struct deep_job *job, struct error *err)
{
    bool ok = true;
    deep_job_begin(job, "shadow.deep.sort");
    bind_lists(job);
    for (size_t g = 0; ok && g < job->group_count; g++) {
        struct sort_span span;
        for (size_t i = job->groups[g].first; ok && find_span(job, &job->groups[g], i, &span);
             i += span.count)
            if (is_divided(job, i))
                ok = sort_parts(job, &span, err);
            else if (span.events.count)
                ok = sort_span(job, &span, err);
    }
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);
    gpu_scope_end(job->builder->timeline);
    return ok;
}
