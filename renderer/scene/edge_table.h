/* SPDX-License-Identifier: MIT */
/* The edges of a triangle mesh with the integer count of its triangles on either side: what tells a
 * closed surface, which bounds a medium, from an open one. Exact. Thread: any.
 *
 * Vertices of equal position are one vertex (-0 equals 0), so that seams of texture coordinates or
 * normals do not count as borders. Each triangle (a, b, c) crosses its edges a-b, b-c and c-a once
 * in that direction. Where crossings of both directions cancel on every edge, each point of space
 * lies a whole number of times inside, whatever else the mesh does: several shells, nested shells,
 * shells that touch or cut each other. A T-junction leaves edges that cancel nothing. */
#ifndef VITRAIL_RENDERER_SCENE_EDGE_TABLE_H
#define VITRAIL_RENDERER_SCENE_EDGE_TABLE_H

#include <stdint.h>

#include "protocol/error.h"

struct edge_mesh {
    const float *positions; /* 3 per vertex, finite */
    uint32_t vertex_count;
    const uint32_t *indices; /* triangles; each below vertex_count */
    uint32_t index_count;    /* a multiple of 3 */
    bool wants_faces;        /* of the table */
};

struct edge_record {
    uint32_t low, high;   /* the lowest vertex number of each end's position; low < high */
    int32_t signed_count; /* crossings from low to high less those from high to low */
    uint32_t uses;        /* crossings of both directions */
};

/* Zeroed = empty. The order of the records is that of the edges' first use. */
struct edge_table {
    struct edge_record *records; /* owned */
    uint32_t (*faces)[2];        /* owned; per record: triangles of the first two crossings,
                                    UINT32_MAX for none; NULL where they were not wanted */
    uint32_t count;
};

/* Edges of zero length (both ends at one position) are left out. ERROR_NO_MEMORY. */
MUST_CHECK bool edge_table_init(struct edge_table *table, const struct edge_mesh *mesh,
                                struct error *err);
void edge_table_finish(struct edge_table *table);

/* Whether the signed count of every edge is zero, and the surface encloses more space with its
 * counter-clockwise side out than in. An empty mesh is not closed. Most open meshes are recognised
 * in one pass without memory; the table decides, but for meshes of more than EDGE_MESH_EXACT_MAX
 * corners: there a 64-bit checksum of the edges does, and the chance of taking an open mesh for a
 * closed one is 2^-64. ERROR_NO_MEMORY. */
enum { EDGE_MESH_EXACT_MAX = 3 << 20 /* the table takes 72 MB */ };
MUST_CHECK bool edge_mesh_is_closed(const struct edge_mesh *mesh, bool *is_closed,
                                    struct error *err);

#endif
