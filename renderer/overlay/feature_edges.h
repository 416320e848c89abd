/* SPDX-License-Identifier: MIT */
/* The edges of a scene's meshes, with the triangles on either side. They are computed when they are
 * first requested, and kept while the scene is the same. Thread: one. */
#ifndef VITRAIL_RENDERER_OVERLAY_FEATURE_EDGES_H
#define VITRAIL_RENDERER_OVERLAY_FEATURE_EDGES_H

#include "renderer/scene/edge_table.h"
#include "renderer/scene/scene.h"

struct feature_edges { /* zeroed = none */
    const struct scene *scene;
    struct edge_table *tables; /* owned; per primitive, zeroed until it is asked for */
    uint32_t table_count;
    uint64_t size_bytes;
};

/* The edges of a primitive of triangles, with their faces; NULL with err. Edges of another scene
 * are freed. */
const struct edge_table *feature_edges_of(struct feature_edges *edges, const struct scene *scene,
                                          uint32_t primitive, struct error *err);
void feature_edges_finish(struct feature_edges *edges);

#endif
