/* SPDX-License-Identifier: MIT */
/* Picks in the words of docs/reference/views.md. */
#include "server/worker/pick.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/limits.h"
#include "server/base/ipc.h"
#include "server/mapping/questions.h"
#include "server/mapping/view_mapping.h"

enum { PATH_MAX_NODES = 256 /* deeper ones are cut at the root's end */ };

/* ---- JSON; each a new reference, NULL without memory ---- */

/* The part of a composed scene whose things of a kind begin at or before index: its first index is
 * what first says. */
static const struct scene_part *part_of(const struct scene *scene, uint32_t index,
                                        uint32_t (*first)(const struct scene_part *part))
{
    uint32_t part = 0;
    while (part + 1 < scene->part_count && first(&scene->parts[part + 1]) <= index)
        part++;
    return scene->part_count ? &scene->parts[part] : NULL;
}

static uint32_t first_node(const struct scene_part *part)
{
    return part->first_node;
}

static uint32_t first_material(const struct scene_part *part)
{
    return part->first_material;
}

/* The name by which requests refer to it: its own, or "#12", or "PART/#3". */
static json_t *name_or_index(const struct scene *scene, uint32_t name, uint32_t index,
                             uint32_t (*first)(const struct scene_part *part))
{
    char number[LIMIT_PART_NAME_BYTES + 16];
    const struct scene_part *part = part_of(scene, index, first);
    if (part && part->name)
        snprintf(number, sizeof number, "%s/#%u", part->name, index - first(part));
    else
        snprintf(number, sizeof number, "#%u", index);
    const char *text = scene->strings + name;
    json_t *json = json_string(*text ? text : number);
    return json ? json : json_string(number);
}

static json_t *node_json(const struct scene *scene, uint32_t node)
{
    uint32_t chain[PATH_MAX_NODES];
    size_t depth = 0;
    for (int32_t at = (int32_t)node; at >= 0 && depth < PATH_MAX_NODES;
         at = scene->nodes[at].parent)
        chain[depth++] = (uint32_t)at;
    json_t *path = json_array();
    while (depth > 0) {
        uint32_t at = chain[--depth];
        json_array_append_new(path, name_or_index(scene, scene->nodes[at].name, at, first_node));
    }
    return json_pack("{s:o,s:I,s:o}", "name",
                     name_or_index(scene, scene->nodes[node].name, node, first_node), "index",
                     (json_int_t)node, "path", path);
}

/* The last material of a blob is the glTF default, which no file names. */
static bool is_default(const struct scene *scene, uint32_t material)
{
    const struct scene_part *part = part_of(scene, material, first_material);
    return part ? material - part->first_material + 1 == part->scene->material_count
                : material + 1 >= scene->material_count;
}

static json_t *material_json(const struct scene *scene, uint32_t material)
{
    if (is_default(scene, material))
        return json_null();
    return json_pack(
        "{s:o,s:I}", "name",
        name_or_index(scene, scene->materials[material].name, material, first_material), "index",
        (json_int_t)material);
}

static json_t *hit_json(const struct scene *scene, const struct raytrace_layer *layer)
{
    const double *p = layer->position, *n = layer->normal;
    return json_pack("{s:o,s:o,s:[f,f,f],s:[f,f,f],s:f,s:b,s:b}", "node",
                     node_json(scene, layer->node), "material",
                     material_json(scene, layer->material), "position", p[0], p[1], p[2], "normal",
                     n[0], n[1], n[2], "depth", layer->depth, "front", layer->is_front,
                     "transparent", layer->is_transparent);
}

static json_t *hits_json(const struct scene *scene, const struct pick_result *result)
{
    json_t *hits = json_array();
    for (size_t i = 0; i < result->layer_count; i++)
        json_array_append_new(hits, hit_json(scene, &result->layers[i]));
    return json_pack("{s:o}", "hits", hits);
}

static json_t *nodes_json(const struct scene *scene, const struct pick_result *result)
{
    json_t *nodes = json_array();
    for (size_t i = 0; i < result->node_count; i++)
        json_array_append_new(nodes, json_pack("{s:o,s:I}", "node",
                                               node_json(scene, result->nodes[i].node), "pixels",
                                               (json_int_t)result->nodes[i].pixels));
    return json_pack("{s:o}", "nodes", nodes);
}

static json_t *result_json(const struct scene *scene, const struct pick_desc *desc,
                           const struct pick_result *result)
{
    if (desc->width > 0)
        return nodes_json(scene, result);
    if (desc->is_through)
        return hits_json(scene, result);
    return json_pack("{s:o}", "hit",
                     result->layer_count ? hit_json(scene, &result->layers[0]) : json_null());
}

json_t *pick_step(const struct pick_step_desc *desc, int *file_fd, struct error *err)
{
    struct view view;
    struct view_storage storage = {0};
    struct pick_desc pick;
    struct pick_result result = {0};
    char *text = NULL;
    pick_read_step(desc->step, &pick);
    if (!view_from_request(desc->request, &storage, &view, err))
        return NULL;
    const struct scene *scene = NULL;
    if (renderer_pick(desc->renderer, desc->request->scene, &view, &pick, &result, err) &&
        (scene = renderer_get_scene(desc->renderer, desc->request->scene, &view, err))) {
        json_t *json = result_json(scene, &pick, &result);
        text = json ? json_dumps(json, JSON_COMPACT | JSON_REAL_PRECISION(17)) : NULL;
        json_decref(json);
        if (!text)
            error_set(err, ERROR_NO_MEMORY, "answer of a pick");
    }
    pick_result_finish(&result);
    view_storage_finish(&storage);
    if (text)
        *file_fd = ipc_memfd_create("vitrail-pick", text, strlen(text), err);
    free(text);
    return *file_fd >= 0 ? json_object() : NULL;
}
