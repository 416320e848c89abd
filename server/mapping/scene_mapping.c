/* SPDX-License-Identifier: MIT */
/* Makes the summary of a decoded scene: counts, names, lights and cameras. */
#include "server/mapping/scene_mapping.h"

#include <string.h>

#include "protocol/limits.h"
#include "protocol/render_request.h"
#include "protocol/utf8.h"
#include "server/mapping/outline_mapping.h"

/* Longer texts are cut: no request could say such a name, and the summary stays bounded. */
static const char *cut_text(const struct scene *scene, uint32_t offset, char cut[])
{
    const char *text = scene->strings + offset;
    size_t length = utf8_prefix_bytes(text, LIMIT_NAME_BYTES);
    if (!text[length])
        return text;
    memcpy(cut, text, length);
    cut[length] = '\0';
    return cut;
}

static bool add_text(const struct scene *scene, uint32_t offset, struct name_list *list,
                     struct error *err)
{
    char cut[LIMIT_NAME_BYTES + 1];
    return name_list_add(list, cut_text(scene, offset, cut), err);
}

static bool add_texts(const struct scene *scene, const uint32_t *offsets, uint32_t count,
                      struct name_list *list, struct error *err)
{
    for (uint32_t i = 0; i < count && i < SCENE_SUMMARY_NAMES_MAX; i++)
        if (!add_text(scene, offsets[i], list, err))
            return false;
    return true;
}

static const char *light_type(uint32_t type)
{
    return request_light_type_name((int)type); /* same order, asserted in view_mapping.c */
}

static bool add_names(const struct scene *scene, struct scene_summary *summary, struct error *err)
{
    for (uint32_t i = 0; i < summary->material_count && i < SCENE_SUMMARY_NAMES_MAX; i++)
        if (!add_text(scene, scene->materials[i].name, &summary->materials, err))
            return false;
    for (uint32_t i = 0; i < scene->node_count && i < SCENE_SUMMARY_NAMES_MAX; i++)
        if (!add_text(scene, scene->nodes[i].name, &summary->node_names, err))
            return false;
    for (uint32_t i = 0; i < scene->grid_count && i < SCENE_SUMMARY_NAMES_MAX; i++)
        if (!add_text(scene, scene->grids[i].name, &summary->grids, err))
            return false;
    for (uint32_t i = 0; i < scene->animation_count && i < SCENE_SUMMARY_NAMES_MAX; i++) {
        char cut[LIMIT_NAME_BYTES + 1];
        const struct scene_animation *animation = &scene->animations[i];
        if (!scene_summary_add_animation(summary, cut_text(scene, animation->name, cut),
                                         (double)animation->duration_s, err))
            return false;
    }
    return add_texts(scene, scene->extensions_used, scene->extension_used_count,
                     &summary->extensions_used, err) &&
           add_texts(scene, scene->extensions_ignored, scene->extension_ignored_count,
                     &summary->extensions_ignored, err) &&
           add_texts(scene, scene->warnings, scene->warning_count, &summary->warnings, err) &&
           add_texts(scene, scene->variants, scene->variant_count, &summary->variants, err);
}

/* Lights and cameras are listed as they stand in the scene: once per node that carries one, under
 * the name by which a request can say it. */
static bool add_items(const struct scene *scene, struct scene_summary *summary, struct error *err)
{
    for (uint32_t i = 0; i < scene->node_count; i++) {
        const struct scene_node *node = &scene->nodes[i];
        char cut[LIMIT_NAME_BYTES + 1];
        const char *name = cut_text(scene, node->name, cut);
        if (node->light >= 0 && summary->light_count++ < SCENE_SUMMARY_NAMES_MAX &&
            !scene_summary_add_light(summary, name, light_type(scene->lights[node->light].type),
                                     err))
            return false;
        if (node->camera < 0)
            continue;
        bool is_ortho = scene->cameras[node->camera].is_orthographic;
        if (summary->camera_count++ < SCENE_SUMMARY_NAMES_MAX &&
            !scene_summary_add_camera(summary, name, is_ortho ? "orthographic" : "perspective",
                                      err))
            return false;
    }
    return true;
}

bool scene_summary_from_scene(const struct scene *scene, struct scene_summary *summary,
                              struct error *err)
{
    const struct scene_header *header = scene->header;
    summary->triangles = header->triangle_count;
    summary->vertices = scene->vertex_count;
    summary->nodes = scene->node_count;
    summary->meshes = scene->mesh_count;
    summary->primitives = scene->primitive_count;
    summary->textures = scene->texture_count;
    summary->images = scene->image_count;
    summary->animation_count = scene->animation_count;
    summary->variant_count = scene->variant_count;
    summary->grid_count = scene->grid_count;
    summary->material_count = scene->material_count - 1; /* the last is the default of glTF */
    summary->has_bounds = header->bounds_min[0] <= header->bounds_max[0];
    memcpy(summary->bounds_min, header->bounds_min, sizeof summary->bounds_min);
    memcpy(summary->bounds_max, header->bounds_max, sizeof summary->bounds_max);
    summary->decoded_bytes = header->size_bytes;
    if (add_names(scene, summary, err) && add_items(scene, summary, err) &&
        scene_outline_from_scene(scene, &summary->outline, err))
        return true;
    scene_summary_finish(summary);
    return false;
}
