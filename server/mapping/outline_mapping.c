/* SPDX-License-Identifier: MIT */
/* Makes the outline of a decoded scene, which viewers list and edit. */
#include "server/mapping/outline_mapping.h"

#include <math.h>
#include <string.h>

#include "protocol/limits.h"
#include "protocol/utf8.h"
#include "renderer/scene/material_lobes.h"

static const double deg_per_rad = 57.295779513082320877;

/* Longer names are cut: no request could say them. */
static const char *cut_name(const struct scene *scene, uint32_t offset, char cut[])
{
    const char *text = scene->strings + offset;
    size_t length = utf8_prefix_bytes(text, LIMIT_NAME_BYTES);
    memcpy(cut, text, length);
    cut[length] = '\0';
    return cut;
}

static void widen(double *to, const float *from, int count)
{
    for (int i = 0; i < count; i++)
        to[i] = (double)from[i];
}

/* ---- nodes ---- */

/* Adds the corners of a model-space box, as the node places them in the world. */
static void grow_bounds(struct outline_node *node, const double world[16],
                        const struct scene_primitive *primitive)
{
    for (int corner = 0; corner < 8; corner++) {
        double p[3];
        for (int axis = 0; axis < 3; axis++)
            p[axis] = (double)(corner >> axis & 1 ? primitive->bounds_max[axis]
                                                  : primitive->bounds_min[axis]);
        for (int row = 0; row < 3; row++) {
            double x =
                world[row] * p[0] + world[4 + row] * p[1] + world[8 + row] * p[2] + world[12 + row];
            if (!node->has_bounds || x < node->bounds[row])
                node->bounds[row] = x;
            if (!node->has_bounds || x > node->bounds[3 + row])
                node->bounds[3 + row] = x;
        }
        node->has_bounds = true;
    }
}

static void add_node_material(struct outline_node *node, uint32_t material, uint32_t material_count)
{
    if (material + 1 >= material_count) /* the last is the default of glTF, which has no name */
        return;
    for (int i = 0; i < node->material_count; i++)
        if (node->materials[i] == (int)material)
            return;
    if (node->material_count < SCENE_OUTLINE_NODE_MATERIALS_MAX)
        node->materials[node->material_count++] = (int)material;
}

static bool add_nodes(const struct scene *scene, struct scene_outline *outline, struct error *err)
{
    char cut[LIMIT_NAME_BYTES + 1];
    size_t name_bytes = 0;
    uint32_t hidden = 0;
    for (uint32_t i = 0; i < scene->node_count && i < SCENE_OUTLINE_NODES_MAX; i++) {
        const struct scene_node *from = &scene->nodes[i];
        name_bytes += strlen(cut_name(scene, from->name, cut));
        if (name_bytes > SCENE_OUTLINE_NAMES_BYTES)
            break;
        struct outline_node *to = scene_outline_add_node(outline, cut, err);
        if (!to)
            return false;
        to->parent = from->parent; /* parents come before their children: it is in the list */
        memcpy(to->matrix, from->local_matrix, sizeof to->matrix);
        to->is_hidden = hidden < scene->hidden_node_count && scene->hidden_nodes[hidden] == i;
        hidden += to->is_hidden;
        const struct scene_mesh *mesh = from->mesh >= 0 ? &scene->meshes[from->mesh] : NULL;
        for (uint32_t p = 0; mesh && p < mesh->primitive_count; p++) {
            const struct scene_primitive *primitive = &scene->primitives[mesh->first_primitive + p];
            grow_bounds(to, from->world_matrix, primitive);
            add_node_material(to, primitive->material, scene->material_count);
        }
    }
    return true;
}

/* ---- materials ---- */

static bool add_materials(const struct scene *scene, struct scene_outline *outline,
                          struct error *err)
{
    char cut[LIMIT_NAME_BYTES + 1];
    for (uint32_t i = 0; i + 1 < scene->material_count && i < SCENE_OUTLINE_ITEMS_MAX; i++) {
        const struct scene_material *from = &scene->materials[i];
        struct outline_material *to =
            scene_outline_add_material(outline, cut_name(scene, from->name, cut), err);
        if (!to)
            return false;
        widen(to->base_color, from->base_color, 4);
        widen(to->emissive, from->emissive, 3);
        widen(to->attenuation_color, from->attenuation_color, 3);
        to->metallic = (double)from->metallic;
        to->roughness = (double)from->roughness;
        to->transmission = (double)from->transmission;
        to->ior = (double)from->ior;
        to->thickness = (double)from->thickness;
        to->attenuation_distance = (double)from->attenuation_distance;
        to->lobes = material_lobes_get(from);
        to->alpha_mode = (int)from->alpha_mode; /* same order, asserted in view_mapping.c */
    }
    return true;
}

/* ---- density grids ---- */

static bool add_grids(const struct scene *scene, struct scene_outline *outline, struct error *err)
{
    char cut[LIMIT_NAME_BYTES + 1];
    for (uint32_t i = 0; i < scene->grid_count && i < SCENE_OUTLINE_ITEMS_MAX; i++) {
        const struct scene_grid *from = &scene->grids[i];
        struct outline_grid *to =
            scene_outline_add_grid(outline, cut_name(scene, from->name, cut), err);
        if (!to)
            return false;
        to->density = (double)from->density;
        to->anisotropy = (double)from->anisotropy;
        widen(to->extinction, from->extinction, 3);
        widen(to->color, from->color, 3);
    }
    return true;
}

/* ---- lights and cameras: once per node that carries one ---- */

/* A column of a matrix, scaled to length 1; zero when it has none. */
static void unit_column(const double matrix[16], int column, double scale, double out[3])
{
    const double *c = &matrix[4 * column];
    double length = sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]);
    for (int i = 0; i < 3; i++)
        out[i] = length > 0 ? scale * c[i] / length : 0;
}

static bool add_light(const struct scene *scene, uint32_t index, struct scene_outline *outline,
                      struct error *err)
{
    char cut[LIMIT_NAME_BYTES + 1];
    const struct scene_node *node = &scene->nodes[index];
    const struct scene_light *from = &scene->lights[node->light];
    struct outline_light *to =
        scene_outline_add_light(outline, cut_name(scene, node->name, cut), err);
    if (!to)
        return false;
    to->node = (int)index;
    to->type = (int)from->type; /* same order, asserted in view_mapping.c */
    memcpy(to->position, &node->world_matrix[12], sizeof to->position);
    unit_column(node->world_matrix, 2, -1, to->direction);
    unit_column(node->world_matrix, 1, 1, to->up);
    widen(to->color, from->color, 3);
    to->intensity = (double)from->intensity;
    to->range = (double)from->range;
    to->inner_cone_deg = deg_per_rad * (double)from->inner_cone_rad;
    to->outer_cone_deg = deg_per_rad * (double)from->outer_cone_rad;
    return true;
}

static bool add_camera(const struct scene *scene, uint32_t index, struct scene_outline *outline,
                       struct error *err)
{
    char cut[LIMIT_NAME_BYTES + 1];
    const struct scene_node *node = &scene->nodes[index];
    const struct scene_camera *from = &scene->cameras[node->camera];
    struct outline_camera *to =
        scene_outline_add_camera(outline, cut_name(scene, node->name, cut), err);
    if (!to)
        return false;
    to->node = (int)index;
    for (int column = 0; column < 3; column++)
        unit_column(node->world_matrix, column, 1, &to->matrix[4 * column]);
    memcpy(&to->matrix[12], &node->world_matrix[12], 3 * sizeof(double));
    to->matrix[15] = 1;
    if (from->is_orthographic) {
        to->ortho_height = 2 * (double)from->y_mag;
        to->aspect = (double)from->x_mag / (double)from->y_mag;
    } else {
        to->fov_y_deg = deg_per_rad * (double)from->y_fov_rad;
        to->aspect = (double)from->aspect;
    }
    return true;
}

bool scene_outline_from_scene(const struct scene *scene, struct scene_outline *outline,
                              struct error *err)
{
    if (!add_nodes(scene, outline, err) || !add_materials(scene, outline, err) ||
        !add_grids(scene, outline, err))
        return false;
    for (uint32_t i = 0; i < scene->node_count; i++) {
        const struct scene_node *node = &scene->nodes[i];
        if (node->light >= 0 && outline->light_count < SCENE_OUTLINE_ITEMS_MAX &&
            !add_light(scene, i, outline, err))
            return false;
        if (node->camera >= 0 && outline->camera_count < SCENE_OUTLINE_ITEMS_MAX &&
            !add_camera(scene, i, outline, err))
            return false;
    }
    return true;
}
