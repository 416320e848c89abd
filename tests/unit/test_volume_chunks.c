/* SPDX-License-Identifier: MIT */
/* Chunks of the casters of shadow volumes: however little room a storage block has, they have the
 * same triangles, and edges with the same sides together, as one chunk has. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/shadows/volume_chunks.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"

enum { GRID = 12, FAN = 100, APART = 40 };

/* The number of a vertex is its first coordinate, so that chunks tell which it was. */
static void init_vertices(struct volume_casters *casters, size_t count)
{
    casters->vertices = calloc(count, sizeof *casters->vertices);
    casters->vertex_count = count;
    assert_non_null(casters->vertices);
    for (size_t i = 0; i < count; i++)
        casters->vertices[i][0] = (double)i;
}

static void add(struct volume_casters *casters, uint32_t a, uint32_t b, uint32_t c)
{
    uint32_t *triangle = casters->triangles[casters->triangle_count];
    triangle[0] = a;
    triangle[1] = b;
    triangle[2] = c;
    triangle[3] = (uint32_t)casters->triangle_count++ % 7; /* the item */
}

/* A sheet whose vertices are shared, a fan of triangles about one edge, triangles apart. */
static void build(struct volume_casters *casters, uint64_t faces_most)
{
    enum { SHEET = (GRID + 1) * (GRID + 1), TRIANGLES = 2 * GRID * GRID + FAN + APART };
    struct error err = {0};
    *casters = (struct volume_casters){.vertices = NULL};
    init_vertices(casters, SHEET + FAN + 3 * APART);
    casters->triangles = calloc(TRIANGLES, sizeof *casters->triangles);
    assert_non_null(casters->triangles);
    for (uint32_t i = 0; i < GRID * GRID; i++) {
        uint32_t at = i / GRID * (GRID + 1) + i % GRID;
        add(casters, at, at + 1, at + GRID + 1);
        add(casters, at + 1, at + GRID + 1, at + GRID + 2);
    }
    for (uint32_t i = 0; i < FAN; i++)
        add(casters, 0, SHEET - 1, SHEET + i);
    for (uint32_t i = 0; i < APART; i++)
        add(casters, SHEET + FAN + 3 * i, SHEET + FAN + 3 * i + 1, SHEET + FAN + 3 * i + 2);
    assert_true(volume_chunks_find(casters, faces_most, &err));
}

struct side {
    uint32_t low, high, opposite, triangle;
};

static int compare(const void *a, const void *b)
{
    return memcmp(a, b, sizeof(struct side));
}

static uint32_t vertex_of(const struct volume_casters *casters, const struct volume_chunk *chunk,
                          uint32_t local)
{
    assert_true(local < chunk->vertices.count);
    return (uint32_t)casters->vertices[chunk->vertices.first + local][0];
}

/* All sides of all chunks, in an order that does not depend on these. */
static struct side *list_sides(const struct volume_casters *casters)
{
    struct side *sides = calloc(casters->side_count, sizeof *sides);
    size_t count = 0, parts = 0;
    assert_non_null(sides);
    for (size_t c = 0; c < casters->chunk_count; c++) {
        const struct volume_chunk *chunk = &casters->chunks[c];
        for (size_t i = 0; i < chunk->edges.count; i++) {
            const uint32_t *edge = casters->edges[chunk->edges.first + i];
            assert_true(edge[3] > 0 && edge[2] + edge[3] <= chunk->sides.count);
            for (uint32_t k = 0; k < edge[3]; k++) {
                const uint32_t *side = casters->sides[chunk->sides.first + edge[2] + k];
                assert_true(side[1] < chunk->triangles.count);
                sides[count++] = (struct side){
                    vertex_of(casters, chunk, edge[0]), vertex_of(casters, chunk, edge[1]),
                    vertex_of(casters, chunk, side[0]), (uint32_t)chunk->triangles.first + side[1]};
            }
            for (uint32_t k = 1; k * VOLUME_PATCH_QUADS < edge[3]; k++) {
                const uint32_t *part = casters->parts[parts++];
                assert_int_equal(part[0], i);
                assert_int_equal(part[1], k);
            }
        }
        assert_int_equal(parts, chunk->parts.first + chunk->parts.count);
    }
    assert_int_equal(count, casters->side_count);
    assert_int_equal(parts, casters->part_count);
    qsort(sides, count, sizeof *sides, compare);
    return sides;
}

static void check_chunks(const struct volume_casters *casters, uint64_t faces_most)
{
    struct volume_chunk end = {.vertices = {.count = 0}};
    for (size_t c = 0; c < casters->chunk_count; c++) {
        const struct volume_chunk *chunk = &casters->chunks[c];
        assert_true(chunk->edges.count + chunk->triangles.count <= faces_most);
        assert_true(chunk->vertices.count <= chunk->edges.count);
        assert_int_equal(chunk->triangles.first, end.triangles.first);
        assert_int_equal(chunk->edges.first, end.edges.first);
        assert_int_equal(chunk->sides.first, end.sides.first);
        assert_int_equal(chunk->vertices.first, end.vertices.first);
        for (size_t i = 1; i < chunk->vertices.count; i++)
            assert_true(vertex_of(casters, chunk, (uint32_t)i - 1) <
                        vertex_of(casters, chunk, (uint32_t)i));
        end.triangles.first += chunk->triangles.count;
        end.edges.first += chunk->edges.count;
        end.sides.first += chunk->sides.count;
        end.vertices.first += chunk->vertices.count;
    }
    assert_int_equal(end.triangles.first, casters->triangle_count);
    assert_int_equal(end.edges.first, casters->edge_count);
    assert_int_equal(end.vertices.first, casters->vertex_count);
}

static void chunks_have_the_sides_of_the_whole(void **state)
{
    (void)state;
    struct volume_casters whole;
    build(&whole, UINT32_MAX);
    struct side *expected = list_sides(&whole);
    assert_int_equal(whole.chunk_count, 1);
    assert_int_equal(whole.part_count, (FAN - 1) / VOLUME_PATCH_QUADS);
    for (uint64_t most = VOLUME_FACES_LEAST; most < 2000; most = most * 3 / 2) {
        struct volume_casters casters;
        build(&casters, most);
        check_chunks(&casters, most);
        assert_int_equal(casters.triangle_count, whole.triangle_count);
        for (size_t i = 0; i < casters.triangle_count; i++)
            assert_int_equal(casters.triangles[i][3], whole.triangles[i][3]);
        struct side *sides = list_sides(&casters);
        assert_memory_equal(sides, expected, casters.side_count * sizeof *sides);
        printf("%llu faces at most: %zu chunks, %zu edges, %zu vertices\n",
               (unsigned long long)most, casters.chunk_count, casters.edge_count,
               casters.vertex_count);
        assert_true(most > 64 || casters.chunk_count > 10);
        free(sides);
        volume_casters_finish(&casters);
    }
    free(expected);
    volume_casters_finish(&whole);
}

/* Triangles apart have four faces each. */
static void a_chunk_may_be_full_to_the_last_face(void **state)
{
    (void)state;
    for (uint64_t extra = 0; extra < 2; extra++) {
        struct volume_casters casters = {.vertices = NULL};
        struct error err = {0};
        init_vertices(&casters, 3 * APART);
        casters.triangles = calloc(APART, sizeof *casters.triangles);
        assert_non_null(casters.triangles);
        for (uint32_t i = 0; i < APART; i++)
            add(&casters, 3 * i, 3 * i + 1, 3 * i + 2);
        assert_true(volume_chunks_find(&casters, 4 * APART - extra, &err));
        check_chunks(&casters, 4 * APART - extra);
        assert_int_equal(casters.chunk_count, 1 + extra);
        volume_casters_finish(&casters);
    }
}

/* Vertices of what is no more than a line are left out where they alone have no room. */
static void nothing_is_one_chunk(void **state)
{
    (void)state;
    for (uint32_t count = 0; count < 2; count++) {
        struct volume_casters casters = {.vertices = NULL};
        struct error err = {0};
        init_vertices(&casters, 100);
        casters.triangles = calloc(1, sizeof *casters.triangles);
        assert_non_null(casters.triangles);
        if (count)
            add(&casters, 3, 50, 90);
        assert_true(volume_chunks_find(&casters, VOLUME_FACES_LEAST, &err));
        assert_int_equal(casters.chunk_count, 1);
        assert_int_equal(casters.chunks[0].vertices.count, 3 * count);
        assert_int_equal(casters.chunks[0].triangles.count, count);
        volume_casters_finish(&casters);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(chunks_have_the_sides_of_the_whole),
        cmocka_unit_test(a_chunk_may_be_full_to_the_last_face),
        cmocka_unit_test(nothing_is_one_chunk),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
