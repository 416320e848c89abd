/* SPDX-License-Identifier: MIT */
/* Outlines of scenes as JSON, both ways. */
#include "protocol/scene_outline.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/json_read.h"
#include "protocol/json_write.h"
#include "protocol/lobe_members_json.h"
#include "protocol/render_request.h"

/* ---- lists ---- */

/* The next element, zeroed but for its name, which is every element's first member. */
static void *list_add(void **items, size_t *count, size_t max_count, size_t size_bytes,
                      const char *name, struct error *err)
{
    if (*count >= max_count) {
        error_set(err, ERROR_TOO_LARGE, "an outline holds at most %zu of this kind", max_count);
        return NULL;
    }
    char *copy = strdup(name);
    if (copy && (*count & (*count - 1)) == 0) { /* capacities are powers of two */
        void *grown = reallocarray(*items, *count ? 2 * *count : 1, size_bytes);
        if (grown)
            *items = grown;
        else {
            free(copy);
            copy = NULL;
        }
    }
    if (!copy) {
        error_set(err, ERROR_NO_MEMORY, "outline of a scene");
        return NULL;
    }
    char *item = (char *)*items + (*count)++ * size_bytes;
    memset(item, 0, size_bytes);
    memcpy(item, &copy, sizeof copy);
    return item;
}

struct outline_node *scene_outline_add_node(struct scene_outline *outline, const char *name,
                                            struct error *err)
{
    void *items = outline->nodes;
    struct outline_node *added = list_add(&items, &outline->node_count, SCENE_OUTLINE_NODES_MAX,
                                          sizeof *outline->nodes, name, err);
    outline->nodes = items;
    for (int i = 0; added && i < 16; i += 5)
        added->matrix[i] = 1;
    return added;
}

struct outline_material *scene_outline_add_material(struct scene_outline *outline, const char *name,
                                                    struct error *err)
{
    void *items = outline->materials;
    void *added = list_add(&items, &outline->material_count, SCENE_OUTLINE_ITEMS_MAX,
                           sizeof *outline->materials, name, err);
    outline->materials = items;
    return added;
}

struct outline_grid *scene_outline_add_grid(struct scene_outline *outline, const char *name,
                                            struct error *err)
{
    void *items = outline->grids;
    void *added = list_add(&items, &outline->grid_count, SCENE_OUTLINE_ITEMS_MAX,
                           sizeof *outline->grids, name, err);
    outline->grids = items;
    return added;
}

struct outline_light *scene_outline_add_light(struct scene_outline *outline, const char *name,
                                              struct error *err)
{
    void *items = outline->lights;
    void *added = list_add(&items, &outline->light_count, SCENE_OUTLINE_ITEMS_MAX,
                           sizeof *outline->lights, name, err);
    outline->lights = items;
    return added;
}

struct outline_camera *scene_outline_add_camera(struct scene_outline *outline, const char *name,
                                                struct error *err)
{
    void *items = outline->cameras;
    void *added = list_add(&items, &outline->camera_count, SCENE_OUTLINE_ITEMS_MAX,
                           sizeof *outline->cameras, name, err);
    outline->cameras = items;
    return added;
}

void scene_outline_finish(struct scene_outline *outline)
{
    for (size_t i = 0; i < outline->node_count; i++)
        free(outline->nodes[i].name);
    for (size_t i = 0; i < outline->material_count; i++)
        free(outline->materials[i].name);
    for (size_t i = 0; i < outline->grid_count; i++)
        free(outline->grids[i].name);
    for (size_t i = 0; i < outline->light_count; i++)
        free(outline->lights[i].name);
    for (size_t i = 0; i < outline->camera_count; i++)
        free(outline->cameras[i].name);
    free(outline->nodes);
    free(outline->materials);
    free(outline->grids);
    free(outline->lights);
    free(outline->cameras);
    *outline = (struct scene_outline){0};
}

/* ---- members that are plain numbers: one list for both directions ---- */

struct number_member {
    const char *key;
    size_t offset;
    int count;             /* 1: a number, else an array of so many */
    bool is_left_out_at_0; /* where all of it is 0, it is not written */
};
static const struct number_member material_numbers[] = {
    {"base_color", offsetof(struct outline_material, base_color), 4, false},
    {"metallic", offsetof(struct outline_material, metallic), 1, false},
    {"roughness", offsetof(struct outline_material, roughness), 1, false},
    {"emissive", offsetof(struct outline_material, emissive), 3, false},
    {"transmission", offsetof(struct outline_material, transmission), 1, false},
    {"ior", offsetof(struct outline_material, ior), 1, false},
    {"thickness", offsetof(struct outline_material, thickness), 1, false},
    {"attenuation_color", offsetof(struct outline_material, attenuation_color), 3, false},
    {"attenuation_distance", offsetof(struct outline_material, attenuation_distance), 1, true},
    {0},
};
static const struct number_member grid_numbers[] = {
    {"density", offsetof(struct outline_grid, density), 1, false},
    {"extinction", offsetof(struct outline_grid, extinction), 3, false},
    {"color", offsetof(struct outline_grid, color), 3, false},
    {"anisotropy", offsetof(struct outline_grid, anisotropy), 1, false},
    {0},
};
static const struct number_member light_numbers[] = {
    {"position", offsetof(struct outline_light, position), 3, false},
    {"direction", offsetof(struct outline_light, direction), 3, false},
    {"up", offsetof(struct outline_light, up), 3, true},
    {"color", offsetof(struct outline_light, color), 3, false},
    {"intensity", offsetof(struct outline_light, intensity), 1, false},
    {"range", offsetof(struct outline_light, range), 1, false},
    {"inner_cone_deg", offsetof(struct outline_light, inner_cone_deg), 1, false},
    {"outer_cone_deg", offsetof(struct outline_light, outer_cone_deg), 1, false},
    {0},
};
static const struct number_member camera_numbers[] = {
    {"matrix", offsetof(struct outline_camera, matrix), 16, false},
    {"fov_y_deg", offsetof(struct outline_camera, fov_y_deg), 1, true},
    {"ortho_height", offsetof(struct outline_camera, ortho_height), 1, true},
    {"aspect", offsetof(struct outline_camera, aspect), 1, true},
    {0},
};

static void put_members(struct json_writer *writer, const struct number_member *members,
                        const void *item)
{
    for (; members->key; members++) {
        double numbers[16];
        memcpy(numbers, (const char *)item + members->offset,
               (size_t)members->count * sizeof *numbers);
        bool is_zero = true;
        for (int i = 0; i < members->count; i++)
            is_zero = is_zero && numbers[i] == 0;
        if (is_zero && members->is_left_out_at_0)
            continue;
        if (members->count > 1)
            json_put_numbers(writer, members->key, numbers, (size_t)members->count);
        else
            json_put_number(writer, members->key, numbers[0]);
    }
}

static bool read_members(const struct json_node *node, const struct number_member *members,
                         void *item)
{
    for (; members->key; members++) {
        struct json_node member = json_member(node, members->key);
        double numbers[16] = {0};
        bool is_read = members->count > 1 ? json_read_numbers(&member, (size_t)members->count,
                                                              -DBL_MAX, DBL_MAX, numbers)
                                          : json_read_number(&member, -DBL_MAX, DBL_MAX, numbers);
        if (!is_read)
            return false;
        memcpy((char *)item + members->offset, numbers, (size_t)members->count * sizeof *numbers);
    }
    return true;
}

/* ---- writing ---- */

static bool is_identity(const double matrix[16])
{
    for (int i = 0; i < 16; i++)
        if (matrix[i] != (i % 5 == 0 ? 1 : 0))
            return false;
    return true;
}

static json_t *write_node(const struct outline_node *node)
{
    struct json_writer writer = json_writer_begin();
    json_t *materials = json_array();
    bool has_failed = !materials;
    for (int i = 0; i < node->material_count; i++)
        json_append(materials, json_integer(node->materials[i]), &has_failed);
    json_put_text(&writer, "name", node->name);
    json_put(&writer, "parent", node->parent < 0 ? json_null() : json_integer(node->parent));
    json_put(&writer, "materials", json_take_unless(materials, has_failed));
    json_put(&writer, "bounds", node->has_bounds ? json_numbers(node->bounds, 6) : json_null());
    if (!is_identity(node->matrix))
        json_put_numbers(&writer, "matrix", node->matrix, 16);
    if (node->is_hidden)
        json_put_bool(&writer, "visible", false);
    return json_writer_take(&writer);
}

static json_t *write_material(const struct outline_material *material)
{
    struct json_writer writer = json_writer_begin();
    json_put_text(&writer, "name", material->name);
    put_members(&writer, material_numbers, material);
    json_put_text(&writer, "alpha_mode", request_alpha_mode_name(material->alpha_mode));
    lobe_members_write(&material->lobes, &writer);
    return json_writer_take(&writer);
}

static json_t *write_grid(const struct outline_grid *grid)
{
    struct json_writer writer = json_writer_begin();
    json_put_text(&writer, "name", grid->name);
    put_members(&writer, grid_numbers, grid);
    return json_writer_take(&writer);
}

static json_t *write_light(const struct outline_light *light)
{
    struct json_writer writer = json_writer_begin();
    json_put_text(&writer, "name", light->name);
    json_put_integer(&writer, "node", (uint64_t)light->node);
    json_put_text(&writer, "type", request_light_type_name(light->type));
    put_members(&writer, light_numbers, light);
    return json_writer_take(&writer);
}

static json_t *write_camera(const struct outline_camera *camera)
{
    struct json_writer writer = json_writer_begin();
    json_put_text(&writer, "name", camera->name);
    json_put_integer(&writer, "node", (uint64_t)camera->node);
    put_members(&writer, camera_numbers, camera);
    return json_writer_take(&writer);
}

json_t *scene_outline_to_json(const struct scene_outline *outline)
{
    json_t *nodes = json_array(), *materials = json_array();
    json_t *lights = json_array(), *cameras = json_array(), *grids = json_array();
    bool has_failed = false; /* a missing array fails in json_put below */
    for (size_t i = 0; nodes && i < outline->node_count; i++)
        json_append(nodes, write_node(&outline->nodes[i]), &has_failed);
    for (size_t i = 0; materials && i < outline->material_count; i++)
        json_append(materials, write_material(&outline->materials[i]), &has_failed);
    for (size_t i = 0; grids && i < outline->grid_count; i++)
        json_append(grids, write_grid(&outline->grids[i]), &has_failed);
    for (size_t i = 0; lights && i < outline->light_count; i++)
        json_append(lights, write_light(&outline->lights[i]), &has_failed);
    for (size_t i = 0; cameras && i < outline->camera_count; i++)
        json_append(cameras, write_camera(&outline->cameras[i]), &has_failed);
    struct json_writer writer = json_writer_begin();
    json_put(&writer, "nodes", nodes);
    json_put(&writer, "materials", materials);
    json_put(&writer, "grids", grids);
    json_put(&writer, "lights", lights);
    json_put(&writer, "cameras", cameras);
    return json_take_unless(json_writer_take(&writer), has_failed);
}

/* ---- reading ---- */

static bool read_index(const struct json_node *node, int *index)
{
    *index = -1;
    return json_read_int(node, 0, INT32_MAX, index);
}

static bool read_node(const struct json_node *node, const char *name, struct scene_outline *outline)
{
    struct outline_node *added = scene_outline_add_node(outline, name, node->err);
    struct json_node parent = json_member(node, "parent");
    struct json_node materials = json_member(node, "materials");
    struct json_node bounds = json_member(node, "bounds");
    struct json_node matrix = json_member(node, "matrix"), visible = json_member(node, "visible");
    bool is_visible = true;
    size_t count;
    if (!added || !read_index(&parent, &added->parent) ||
        !json_expect_array(&materials, SCENE_OUTLINE_NODE_MATERIALS_MAX, &count))
        return false;
    for (size_t i = 0; i < count; i++) {
        struct json_node material = json_element(&materials, i);
        if (!read_index(&material, &added->materials[i]))
            return false;
    }
    added->material_count = (int)count;
    added->has_bounds = bounds.value;
    if (!json_read_bool(&visible, &is_visible))
        return false;
    added->is_hidden = !is_visible;
    return json_read_numbers(&bounds, 6, -DBL_MAX, DBL_MAX, added->bounds) &&
           json_read_numbers(&matrix, 16, -DBL_MAX, DBL_MAX, added->matrix);
}

static bool read_material(const struct json_node *node, const char *name,
                          struct scene_outline *outline)
{
    struct outline_material *added = scene_outline_add_material(outline, name, node->err);
    struct json_node mode = json_member(node, "alpha_mode");
    return added && read_members(node, material_numbers, added) &&
           lobe_members_read(node, &added->lobes) &&
           json_read_choice(&mode, &(struct json_choice){.name = request_alpha_mode_name},
                            &added->alpha_mode);
}

static bool read_grid(const struct json_node *node, const char *name, struct scene_outline *outline)
{
    struct outline_grid *added = scene_outline_add_grid(outline, name, node->err);
    return added && read_members(node, grid_numbers, added);
}

static bool read_light(const struct json_node *node, const char *name,
                       struct scene_outline *outline)
{
    struct outline_light *added = scene_outline_add_light(outline, name, node->err);
    struct json_node of_node = json_member(node, "node"), type = json_member(node, "type");
    return added && read_index(&of_node, &added->node) &&
           read_members(node, light_numbers, added) &&
           json_read_choice(&type, &(struct json_choice){.name = request_light_type_name},
                            &added->type);
}

static bool read_camera(const struct json_node *node, const char *name,
                        struct scene_outline *outline)
{
    struct outline_camera *added = scene_outline_add_camera(outline, name, node->err);
    struct json_node of_node = json_member(node, "node");
    return added && read_index(&of_node, &added->node) && read_members(node, camera_numbers, added);
}

static bool read_list(const struct json_node *outline_node, const char *key, size_t max_count,
                      bool (*read)(const struct json_node *, const char *name,
                                   struct scene_outline *),
                      struct scene_outline *outline)
{
    struct json_node list = json_member(outline_node, key);
    size_t count;
    if (!json_expect_array(&list, max_count, &count))
        return false;
    for (size_t i = 0; i < count; i++) {
        struct json_node element = json_element(&list, i);
        struct json_node name = json_member(&element, "name");
        if (!json_expect_object(&element, NULL))
            return false;
        if (!json_is_string(name.value))
            return json_refuse(&name, ERROR_INVALID_REQUEST, "must be a string");
        if (!read(&element, json_string_value(name.value), outline))
            return false;
    }
    return true;
}

bool scene_outline_read(const struct json_node *node, struct scene_outline *outline)
{
    if (!node->value)
        return true;
    return json_expect_object(node, NULL) &&
           read_list(node, "nodes", SCENE_OUTLINE_NODES_MAX, read_node, outline) &&
           read_list(node, "materials", SCENE_OUTLINE_ITEMS_MAX, read_material, outline) &&
           read_list(node, "grids", SCENE_OUTLINE_ITEMS_MAX, read_grid, outline) &&
           read_list(node, "lights", SCENE_OUTLINE_ITEMS_MAX, read_light, outline) &&
           read_list(node, "cameras", SCENE_OUTLINE_ITEMS_MAX, read_camera, outline);
}
