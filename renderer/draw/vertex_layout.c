/* SPDX-License-Identifier: MIT */
/* The order of the vertices, the types of their streams, and the copying into both. */
#include "renderer/draw/vertex_layout.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

_Static_assert((int)SCENE_PRIMITIVE_HAS_TANGENTS == 1 << (VERTEX_TANGENT - VERTEX_TANGENT) &&
                   (int)SCENE_PRIMITIVE_HAS_TEXCOORDS_0 ==
                       1 << (VERTEX_TEXCOORD_0 - VERTEX_TANGENT) &&
                   (int)SCENE_PRIMITIVE_HAS_TEXCOORDS_1 ==
                       1 << (VERTEX_TEXCOORD_1 - VERTEX_TANGENT) &&
                   (int)SCENE_PRIMITIVE_HAS_COLORS == 1 << (VERTEX_COLOR - VERTEX_TANGENT),
               "sets of streams are flags of primitives");

enum {
    SHORT_VERTICES_MAX = 65536, /* of a primitive whose indices take 16 bits */
    OPTIONAL_COUNT = 4,
    SETS = VERTEX_OPTIONALS + 1
};

static const uint32_t components_of[VERTEX_STREAM_COUNT] = {3, 3, 4, 2, 2, 4};

struct vertex_run {
    uint32_t source, count; /* vertices of the scene */
    uint32_t target;        /* the first one's place on the device */
    uint32_t set;           /* optional streams that some of its primitives have */
};

static const float *stream_of(const struct scene *scene, enum vertex_stream stream)
{
    const float *const streams[] = {scene->positions,   scene->normals,     scene->tangents,
                                    scene->texcoords_0, scene->texcoords_1, scene->colors};
    return streams[stream];
}

/* Optional streams of the primitive that the scene has. */
static uint32_t set_of(const struct scene *scene, const struct scene_primitive *primitive)
{
    uint32_t set = primitive->flags & VERTEX_OPTIONALS;
    for (int k = 0; k < OPTIONAL_COUNT; k++)
        if (!stream_of(scene, (enum vertex_stream)(VERTEX_TANGENT + k)))
            set &= ~(1u << k);
    return set;
}

/* ---- runs ---- */

static int compare_sources(const void *a, const void *b)
{
    const struct vertex_run *x = a, *y = b;
    if (x->source != y->source)
        return x->source < y->source ? -1 : 1;
    return (x->count < y->count) - (x->count > y->count);
}

/* Primitives that share vertices share a run, and so do neighbours with the same streams: no vertex
 * is stored twice. */
static bool list_runs(struct vertex_layout *layout, struct error *err)
{
    const struct scene *scene = layout->scene;
    struct vertex_run *runs = calloc((size_t)scene->primitive_count + 1, sizeof *runs);
    uint32_t count = 0, merged = 0;
    layout->runs = runs;
    if (!runs)
        return error_set(err, ERROR_NO_MEMORY, "vertices of %u primitives", scene->primitive_count);
    for (uint32_t i = 0; i < scene->primitive_count; i++) {
        const struct scene_primitive *p = &scene->primitives[i];
        if (p->vertex_count)
            runs[count++] = (struct vertex_run){
                .source = p->first_vertex, .count = p->vertex_count, .set = set_of(scene, p)};
    }
    qsort(runs, count, sizeof *runs, compare_sources);
    for (uint32_t i = 0; i < count; i++) {
        struct vertex_run run = runs[i], *last = merged ? &runs[merged - 1] : NULL;
        uint64_t end = last ? (uint64_t)last->source + last->count : 0;
        if (last && (run.source < end || (run.source == end && run.set == last->set))) {
            uint64_t run_end = (uint64_t)run.source + run.count;
            last->count = (uint32_t)((run_end > end ? run_end : end) - last->source);
            last->set |= run.set;
        } else {
            runs[merged++] = run;
        }
    }
    layout->run_count = merged;
    return true;
}

/* ---- order ---- */

/* The place of a set in the order in which `priority` names the streams: those with the first one
 * before all others, and so on. */
static uint32_t rank_of(uint32_t set, const uint8_t priority[OPTIONAL_COUNT])
{
    uint32_t rank = 0;
    for (int k = 0; k < OPTIONAL_COUNT; k++)
        rank = 2 * rank + !(set >> priority[k] & 1);
    return rank;
}

/* Floats of all optional streams where sets come in that order. */
static uint64_t floats_of(const uint64_t vertices[SETS], const uint8_t priority[OPTIONAL_COUNT])
{
    uint64_t ends[OPTIONAL_COUNT] = {0}, by_rank[SETS] = {0}, place = 0, floats = 0;
    uint32_t sets[SETS];
    for (uint32_t set = 0; set < SETS; set++) {
        sets[rank_of(set, priority)] = set;
        by_rank[rank_of(set, priority)] = vertices[set];
    }
    for (int rank = 0; rank < SETS; rank++) {
        place += by_rank[rank];
        for (int k = 0; k < OPTIONAL_COUNT; k++)
            if (by_rank[rank] && sets[rank] >> k & 1)
                ends[k] = place;
    }
    for (int k = 0; k < OPTIONAL_COUNT; k++)
        floats += ends[k] * components_of[VERTEX_TANGENT + k];
    return floats;
}

/* The best of all orders by streams. */
static void choose_priority(const uint64_t vertices[SETS], uint8_t best[OPTIONAL_COUNT])
{
    uint64_t least = UINT64_MAX;
    for (int i = 0; i < OPTIONAL_COUNT * OPTIONAL_COUNT * OPTIONAL_COUNT; i++) {
        int a = i % OPTIONAL_COUNT, b = i / OPTIONAL_COUNT % OPTIONAL_COUNT;
        int c = i / (OPTIONAL_COUNT * OPTIONAL_COUNT);
        const uint8_t priority[] = {(uint8_t)a, (uint8_t)b, (uint8_t)c, (uint8_t)(6 - a - b - c)};
        uint64_t floats = a == b || a == c || b == c ? UINT64_MAX : floats_of(vertices, priority);
        if (floats < least)
            memcpy(best, priority, sizeof priority);
        least = floats < least ? floats : least;
    }
}

static void place_runs(struct vertex_layout *layout)
{
    uint64_t vertices[SETS] = {0}, starts[SETS] = {0}, place = 0;
    uint8_t priority[OPTIONAL_COUNT] = {0, 1, 2, 3};
    for (uint32_t i = 0; i < layout->run_count; i++)
        vertices[layout->runs[i].set] += layout->runs[i].count;
    choose_priority(vertices, priority);
    for (uint32_t rank = 0; rank < SETS; rank++)
        for (uint32_t set = 0; set < SETS; set++)
            if (rank_of(set, priority) == rank) {
                starts[set] = place;
                place += vertices[set];
            }
    for (uint32_t i = 0; i < layout->run_count; i++) {
        struct vertex_run *run = &layout->runs[i];
        run->target = (uint32_t)starts[run->set];
        starts[run->set] += run->count;
        for (int s = 0; s < VERTEX_STREAM_COUNT; s++)
            if (s < VERTEX_TANGENT || run->set >> (s - VERTEX_TANGENT) & 1) {
                uint64_t end = (uint64_t)run->target + run->count;
                struct vertex_format *format = &layout->formats[s];
                format->count = end > format->count ? end : format->count;
            }
        layout->optionals |= run->set;
    }
}

static const struct vertex_run *run_with(const struct vertex_layout *layout, uint32_t vertex)
{
    uint32_t low = 0, high = layout->run_count;
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if (layout->runs[middle].source <= vertex)
            low = middle;
        else
            high = middle;
    }
    return &layout->runs[low];
}

static bool is_short(const struct scene_primitive *primitive)
{
    return primitive->vertex_count <= SHORT_VERTICES_MAX;
}

static bool place_primitives(struct vertex_layout *layout, struct error *err)
{
    const struct scene *scene = layout->scene;
    layout->ranges = calloc((size_t)scene->primitive_count + 1, sizeof *layout->ranges);
    if (!layout->ranges)
        return error_set(err, ERROR_NO_MEMORY, "places of %u primitives", scene->primitive_count);
    for (uint32_t i = 0; i < scene->primitive_count; i++) {
        const struct scene_primitive *p = &scene->primitives[i];
        struct vertex_range *range = &layout->ranges[i];
        range->has_short_indices = is_short(p);
        if (p->vertex_count) {
            const struct vertex_run *run = run_with(layout, p->first_vertex);
            range->first_vertex = run->target + (p->first_vertex - run->source);
        }
        uint64_t *count = is_short(p) ? &layout->short_count : &layout->long_count;
        range->first_index = (uint32_t)*count;
        *count += p->index_count;
    }
    layout->short_count += layout->short_count % 2;
    for (uint32_t i = 0; i < scene->primitive_count; i++)
        if (!layout->ranges[i].has_short_indices)
            layout->ranges[i].first_index += (uint32_t)(layout->short_count / 2);
    return layout->short_count / 2 + layout->long_count <= UINT32_MAX &&
                   layout->short_count <= UINT32_MAX
               ? true
               : error_set(err, ERROR_TOO_LARGE, "the primitives share too many indices");
}

/* ---- types ---- */

struct candidate {
    enum vertex_type type;
    bool is_normalized;
    uint32_t bytes;
    float least, greatest;
};

/* The candidates, from the narrowest on. */
static const struct candidate candidates[] = {
    {VERTEX_U8, false, 1, 0, 255},
    {VERTEX_I8, false, 1, -128, 127},
    {VERTEX_U8, true, 1, 0, 1},
    {VERTEX_U16, false, 2, 0, 65535},
    {VERTEX_I16, false, 2, -32768, 32767},
    {VERTEX_U16, true, 2, 0, 1},
};
enum { CANDIDATES = sizeof candidates / sizeof *candidates };

static float greatest_number(const struct candidate *candidate)
{
    return candidate->bytes == 1 ? 255.0f : 65535.0f;
}

/* Normalised numbers are read as glTF 2.0 has them, 3.6.2.2: c / 255, c / 65535. */
static bool has_value(const struct candidate *candidate, float value)
{
    if (!(value >= candidate->least && value <= candidate->greatest))
        return false;
    if (!candidate->is_normalized)
        return value == truncf(value);
    float whole = greatest_number(candidate);
    return rintf(value * whole) / whole == value;
}

/* Devices may read normalised numbers with an error in the last bit: that moves no texel, but a
 * vertex between two places. */
static bool may_take(const struct candidate *candidate, enum vertex_stream stream)
{
    return !candidate->is_normalized || stream >= VERTEX_TEXCOORD_0;
}

/* Bit set of the candidates that have all these values, of those in `open`. */
static uint32_t narrow(uint32_t open, const float *values, uint64_t count)
{
    for (uint64_t i = 0; i < count && open; i++)
        for (int c = 0; c < CANDIDATES; c++)
            if (open >> c & 1 && !has_value(&candidates[c], values[i]))
                open &= ~(1u << c);
    return open;
}

static void choose_format(struct vertex_layout *layout, enum vertex_stream stream)
{
    struct vertex_format *format = &layout->formats[stream];
    const float *values = stream_of(layout->scene, stream);
    uint32_t open = 0, n = components_of[stream];
    format->components = n;
    format->stride_bytes = n * (uint32_t)sizeof(float);
    for (int c = 0; c < CANDIDATES; c++)
        open |= (uint32_t)may_take(&candidates[c], stream) << c;
    for (uint32_t i = 0; i < layout->run_count && open; i++) {
        const struct vertex_run *run = &layout->runs[i];
        if (run->target < format->count)
            open = narrow(open, values + (size_t)n * run->source, (uint64_t)n * run->count);
    }
    for (int c = 0; c < CANDIDATES && format->count; c++)
        if (open >> c & 1) {
            format->type = candidates[c].type;
            format->is_normalized = candidates[c].is_normalized;
            format->stride_bytes = (n * candidates[c].bytes + 3) / 4 * 4;
            return;
        }
}

/* ---- the whole ---- */

bool vertex_layout_init(struct vertex_layout *layout, const struct scene *scene, struct error *err)
{
    *layout = (struct vertex_layout){.scene = scene};
    if (!list_runs(layout, err))
        goto fail;
    place_runs(layout);
    if (!place_primitives(layout, err))
        goto fail;
    for (int s = 0; s < VERTEX_STREAM_COUNT; s++)
        choose_format(layout, (enum vertex_stream)s);
    return true;

fail:
    vertex_layout_finish(layout);
    return false;
}

void vertex_layout_finish(struct vertex_layout *layout)
{
    free(layout->runs);
    free(layout->ranges);
    *layout = (struct vertex_layout){0};
}

uint64_t vertex_layout_stream_bytes(const struct vertex_layout *layout, enum vertex_stream stream)
{
    return layout->formats[stream].count * layout->formats[stream].stride_bytes;
}

uint64_t vertex_layout_index_bytes(const struct vertex_layout *layout)
{
    return layout->short_count * sizeof(uint16_t) + layout->long_count * sizeof(uint32_t);
}

const void *vertex_layout_borrow(const struct vertex_layout *layout, enum vertex_stream stream)
{
    bool is_same = layout->formats[stream].type == VERTEX_F32;
    for (uint32_t i = 0; i < layout->run_count && is_same; i++)
        is_same = layout->runs[i].target >= layout->formats[stream].count ||
                  layout->runs[i].source == layout->runs[i].target;
    return is_same ? stream_of(layout->scene, stream) : NULL;
}

/* `whole`: what 1 becomes. */
static void write_number(enum vertex_type type, float value, float whole, unsigned char *out)
{
    int32_t number = (int32_t)rintf(value * whole);
    uint16_t bits = (uint16_t)number; /* of the negative ones: two's complement */
    if (type == VERTEX_U8 || type == VERTEX_I8)
        *out = (unsigned char)number;
    else
        memcpy(out, &bits, sizeof bits);
}

void vertex_layout_write(const struct vertex_layout *layout, enum vertex_stream stream, void *out)
{
    const struct vertex_format *format = &layout->formats[stream];
    const float *values = stream_of(layout->scene, stream);
    bool is_byte = format->type == VERTEX_U8 || format->type == VERTEX_I8;
    float whole = format->is_normalized ? (is_byte ? 255.0f : 65535.0f) : 1;
    size_t n = format->components, stride = format->stride_bytes, width = is_byte ? 1 : 2;
    for (uint32_t i = 0; i < layout->run_count; i++) {
        const struct vertex_run *run = &layout->runs[i];
        const float *from = values + n * run->source;
        unsigned char *to = (unsigned char *)out + stride * run->target;
        if (run->target >= format->count)
            continue;
        if (format->type == VERTEX_F32) {
            memcpy(to, from, stride * run->count);
            continue;
        }
        for (size_t v = 0; v < run->count; v++, from += n, to += stride) {
            memset(to, 0, stride);
            for (size_t k = 0; k < n; k++)
                write_number(format->type, from[k], whole, to + k * width);
        }
    }
}

void vertex_layout_write_indices(const struct vertex_layout *layout, void *out)
{
    const struct scene *scene = layout->scene;
    uint16_t *shorts = out;
    uint32_t *longs = (uint32_t *)out; /* counted from the start, as the ranges do */
    if (layout->short_count)
        shorts[layout->short_count - 1] = 0; /* where one was added */
    for (uint32_t i = 0; i < scene->primitive_count; i++) {
        const struct scene_primitive *p = &scene->primitives[i];
        const uint32_t *from = scene->indices + p->first_index;
        size_t first = layout->ranges[i].first_index;
        if (!layout->ranges[i].has_short_indices)
            memcpy(longs + first, from, (size_t)p->index_count * sizeof *from);
        for (uint32_t k = 0; layout->ranges[i].has_short_indices && k < p->index_count; k++)
            shorts[first + k] = (uint16_t)from[k];
    }
}
