/* SPDX-License-Identifier: MIT */
/* Edges are found by sorting. Triangles of a chunk follow one another; where their edges have no
 * room, half as many are tried. In a chunk vertices keep their order, so that what a face's corners
 * make up has the same bits in all chunks. */
#include "renderer/shadows/volume_chunks.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "shaders/shared/bindings.h"

struct half_edge {
    uint32_t low, high, opposite, triangle;
};

struct cutting {
    struct volume_casters *casters;
    struct half_edge *halves; /* of a chunk */
    size_t chunk_capacity;
    /* of several chunks: */
    double (*vertices)[3]; /* one chunk's after the other's */
    size_t vertex_count, vertex_capacity;
    uint32_t *locals; /* of each vertex; 0: not in the chunk */
};

static int compare(const void *a, const void *b)
{
    const struct half_edge *x = a, *y = b;
    if (x->low != y->low)
        return x->low < y->low ? -1 : 1;
    if (x->high != y->high)
        return x->high < y->high ? -1 : 1;
    if (x->opposite != y->opposite)
        return x->opposite < y->opposite ? -1 : 1;
    return x->triangle < y->triangle ? -1 : x->triangle > y->triangle;
}

/* Of the chunk's triangles, behind those of chunks before. */
static void find_edges(struct cutting *cutting, struct volume_chunk *chunk)
{
    struct volume_casters *casters = cutting->casters;
    const size_t first = chunk->triangles.first, count = 3 * chunk->triangles.count;
    struct half_edge *halves = cutting->halves;
    for (size_t i = 0; i < chunk->triangles.count; i++) {
        const uint32_t *t = casters->triangles[first + i];
        halves[3 * i] = (struct half_edge){t[0], t[1], t[2], (uint32_t)i};
        halves[3 * i + 1] = (struct half_edge){t[0], t[2], t[1], (uint32_t)i};
        halves[3 * i + 2] = (struct half_edge){t[1], t[2], t[0], (uint32_t)i};
    }
    qsort(halves, count, sizeof *halves, compare);
    chunk->edges = (struct volume_range){.first = casters->edge_count};
    chunk->sides = (struct volume_range){3 * first, count};
    uint32_t(*edges)[4] = casters->edges + chunk->edges.first;
    for (size_t i = 0; i < count; i++) {
        const struct half_edge *half = &halves[i];
        if (!i || half->low != half[-1].low || half->high != half[-1].high) {
            uint32_t *edge = edges[chunk->edges.count++];
            edge[0] = half->low;
            edge[1] = half->high;
            edge[2] = (uint32_t)i;
            edge[3] = 0;
        }
        edges[chunk->edges.count - 1][3]++;
        casters->sides[3 * first + i][0] = half->opposite;
        casters->sides[3 * first + i][1] = half->triangle;
    }
}

/* ---- the vertices of one of several chunks ---- */

/* The least and the greatest of its vertices. */
static void find_span(const struct volume_casters *casters, const struct volume_chunk *chunk,
                      size_t span[2])
{
    span[0] = SIZE_MAX;
    span[1] = 0;
    for (size_t i = 0; i < chunk->triangles.count; i++) {
        const uint32_t *t = casters->triangles[chunk->triangles.first + i];
        span[0] = t[0] < span[0] ? t[0] : span[0];
        span[1] = t[2] > span[1] ? t[2] : span[1];
    }
}

static bool reserve_vertices(struct cutting *cutting, size_t more, struct error *err)
{
    size_t wanted = cutting->vertex_count + more;
    if (wanted <= cutting->vertex_capacity)
        return true;
    wanted += wanted / 2;
    void *grown = realloc(cutting->vertices, wanted * sizeof *cutting->vertices);
    if (!grown)
        return error_set(err, ERROR_NO_MEMORY, "%zu vertices of shadow volumes", wanted);
    cutting->vertices = grown;
    cutting->vertex_capacity = wanted;
    return true;
}

static bool place_vertices(struct cutting *cutting, struct volume_chunk *chunk, struct error *err)
{
    const struct volume_casters *casters = cutting->casters;
    uint32_t *locals = cutting->locals;
    size_t span[2], most = 3 * chunk->triangles.count;
    find_span(casters, chunk, span);
    if (!reserve_vertices(cutting, most, err))
        return false;
    for (size_t i = 0; i < chunk->triangles.count; i++)
        for (int k = 0; k < 3; k++)
            locals[casters->triangles[chunk->triangles.first + i][k]] = 1;
    chunk->vertices = (struct volume_range){.first = cutting->vertex_count};
    for (size_t i = span[0]; i <= span[1]; i++) {
        if (!locals[i])
            continue;
        memcpy(cutting->vertices[cutting->vertex_count++], casters->vertices[i],
               sizeof *cutting->vertices);
        locals[i] = (uint32_t)++chunk->vertices.count;
    }
    for (size_t i = 0; i < chunk->triangles.count; i++)
        for (int k = 0; k < 3; k++) {
            uint32_t *vertex = &casters->triangles[chunk->triangles.first + i][k];
            *vertex = locals[*vertex] - 1;
        }
    for (size_t i = 0; i < chunk->edges.count; i++)
        for (int k = 0; k < 2; k++) {
            uint32_t *vertex = &casters->edges[chunk->edges.first + i][k];
            *vertex = locals[*vertex] - 1;
        }
    for (size_t i = 0; i < chunk->sides.count; i++) {
        uint32_t *vertex = &casters->sides[chunk->sides.first + i][0];
        *vertex = locals[*vertex] - 1;
    }
    memset(locals + span[0], 0, (span[1] - span[0] + 1) * sizeof *locals);
    return true;
}

/* ---- chunks ---- */

static bool add_chunk(struct cutting *cutting, const struct volume_chunk *chunk, struct error *err)
{
    struct volume_casters *casters = cutting->casters;
    if (casters->chunk_count == cutting->chunk_capacity) {
        size_t wanted = 2 * cutting->chunk_capacity + 1;
        void *grown = realloc(casters->chunks, wanted * sizeof *casters->chunks);
        if (!grown)
            return error_set(err, ERROR_NO_MEMORY, "%zu chunks of shadow volumes", wanted);
        casters->chunks = grown;
        cutting->chunk_capacity = wanted;
    }
    casters->chunks[casters->chunk_count++] = *chunk;
    casters->edge_count += chunk->edges.count;
    return true;
}

/* Whether so many triangles may have room: a closed body has three edges for two triangles. Where
 * edges have more triangles than two it is cut without need. */
static bool may_fit(size_t triangles, uint64_t faces_most)
{
    return triangles + triangles + triangles / 2 <= faces_most || triangles < 2;
}

static bool cut(struct cutting *cutting, uint64_t faces_most, struct error *err)
{
    struct volume_casters *casters = cutting->casters;
    const size_t count = casters->triangle_count;
    size_t taken = count;
    for (size_t first = 0; first < count || !casters->chunk_count;) {
        struct volume_chunk chunk = {
            .vertices = {.count = count ? casters->vertex_count : 0},
            .triangles = {first, count - first < taken ? count - first : taken}};
        bool is_whole = chunk.triangles.count == count;
        bool fits = may_fit(chunk.triangles.count, faces_most);
        if (fits) {
            find_edges(cutting, &chunk);
            fits = chunk.edges.count + chunk.triangles.count <= faces_most &&
                   (!is_whole || chunk.vertices.count <= 2 * faces_most);
        }
        if (!fits && chunk.triangles.count > 1) {
            taken = (chunk.triangles.count + 1) / 2;
            continue;
        }
        if (!(is_whole && fits) && !place_vertices(cutting, &chunk, err))
            return false;
        if (!add_chunk(cutting, &chunk, err))
            return false;
        first += chunk.triangles.count;
    }
    return true;
}

static void take_vertices(struct cutting *cutting)
{
    struct volume_casters *casters = cutting->casters;
    if (!cutting->vertices)
        return;
    free(casters->vertices);
    casters->vertices = cutting->vertices;
    casters->vertex_count = cutting->vertex_count;
    cutting->vertices = NULL;
}

/* ---- parts ---- */

static uint32_t parts_of(const uint32_t edge[4])
{
    return (edge[3] - 1) / VOLUME_PATCH_QUADS;
}

static bool find_parts(struct volume_casters *casters, struct error *err)
{
    size_t count = 0;
    for (size_t i = 0; i < casters->edge_count; i++)
        count += parts_of(casters->edges[i]);
    casters->parts = malloc((count + 1) * sizeof *casters->parts);
    if (!casters->parts)
        return error_set(err, ERROR_NO_MEMORY, "%zu parts of edges", count);
    for (size_t c = 0; c < casters->chunk_count; c++) {
        struct volume_chunk *chunk = &casters->chunks[c];
        chunk->parts.first = casters->part_count;
        for (size_t i = 0; i < chunk->edges.count; i++)
            for (uint32_t k = 1; k <= parts_of(casters->edges[chunk->edges.first + i]); k++) {
                uint32_t *part = casters->parts[casters->part_count++];
                part[0] = (uint32_t)i;
                part[1] = k;
            }
        chunk->parts.count = casters->part_count - chunk->parts.first;
    }
    return true;
}

bool volume_chunks_find(struct volume_casters *casters, uint64_t faces_most, struct error *err)
{
    const size_t count = 3 * casters->triangle_count;
    struct cutting cutting = {.casters = casters};
    assert(faces_most >= VOLUME_FACES_LEAST);
    cutting.halves = malloc((count + 1) * sizeof *cutting.halves);
    cutting.locals = calloc(casters->vertex_count + 1, sizeof *cutting.locals);
    casters->sides = malloc((count + 1) * sizeof *casters->sides);
    casters->edges = calloc(count + 1, sizeof *casters->edges);
    bool ok = cutting.halves && cutting.locals && casters->sides && casters->edges;
    if (!ok)
        error_set(err, ERROR_NO_MEMORY, "%zu edges of shadow volumes", count);
    casters->side_count = count;
    ok = ok && cut(&cutting, faces_most, err);
    take_vertices(&cutting);
    free(cutting.halves);
    free(cutting.locals);
    free(cutting.vertices);
    return ok && find_parts(casters, err);
}
