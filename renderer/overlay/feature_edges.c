/* SPDX-License-Identifier: MIT */
/* Keeps an edge table for each primitive. */
#include "renderer/overlay/feature_edges.h"

#include <stdlib.h>

static bool take_scene(struct feature_edges *edges, const struct scene *scene, struct error *err)
{
    if (edges->scene == scene)
        return true;
    feature_edges_finish(edges);
    edges->tables = calloc((size_t)scene->primitive_count + 1, sizeof *edges->tables);
    if (!edges->tables)
        return error_set(err, ERROR_NO_MEMORY, "edges of %u meshes", scene->primitive_count);
    edges->scene = scene;
    edges->table_count = scene->primitive_count;
    return true;
}

const struct edge_table *feature_edges_of(struct feature_edges *edges, const struct scene *scene,
                                          uint32_t primitive, struct error *err)
{
    if (!take_scene(edges, scene, err))
        return NULL;
    struct edge_table *table = &edges->tables[primitive];
    if (table->records)
        return table;
    const struct scene_primitive *p = &scene->primitives[primitive];
    const struct scene *from = scene_of_primitive(scene, p);
    const struct edge_mesh mesh = {
        .positions = from->positions + 3 * (size_t)p->first_vertex,
        .vertex_count = p->vertex_count,
        .indices = from->indices + p->first_index,
        .index_count = p->index_count,
        .wants_faces = true,
    };
    if (!edge_table_init(table, &mesh, err))
        return NULL;
    edges->size_bytes += p->index_count * (sizeof *table->records + sizeof *table->faces);
    return table;
}

void feature_edges_finish(struct feature_edges *edges)
{
    for (uint32_t i = 0; i < edges->table_count; i++)
        edge_table_finish(&edges->tables[i]);
    free(edges->tables);
    *edges = (struct feature_edges){0};
}
