/* SPDX-License-Identifier: MIT */
/* Joining the tables of scenes. Sizes are known first; then each scene is copied behind those
 * before it, with its indices shifted. */
#include "renderer/scene/compose.h"

#include <stdlib.h>
#include <string.h>

#include "renderer/base/matrix.h"

struct composed_scene {
    struct scene scene; /* points into the tables below */
    struct scene_part *parts;
    struct scene_node *nodes;
    struct scene_mesh *meshes;
    struct scene_primitive *primitives;
    struct scene_material *materials;
    struct scene_texture *textures;
    struct scene_image *images;
    struct scene_light *lights;
    struct scene_camera *cameras;
    struct scene_grid *grids;
    char *strings;
    uint64_t string_bytes, string_capacity;
};

const struct scene *composed_scene_get(const struct composed_scene *composed)
{
    return &composed->scene;
}

void composed_scene_destroy(struct composed_scene *composed)
{
    if (!composed)
        return;
    free(composed->parts);
    free(composed->nodes);
    free(composed->meshes);
    free(composed->primitives);
    free(composed->materials);
    free(composed->textures);
    free(composed->images);
    free(composed->lights);
    free(composed->cameras);
    free(composed->grids);
    free(composed->strings);
    free(composed);
}

/* ---- sizes ---- */

struct totals {
    uint64_t nodes, meshes, primitives, materials, textures, images, lights, cameras, grids;
    uint64_t triangles, string_bytes;
};

static void add_totals(struct totals *t, const struct scene *scene, size_t prefix_bytes)
{
    t->nodes += scene->node_count;
    t->meshes += scene->mesh_count;
    t->primitives += scene->primitive_count;
    t->materials += scene->material_count;
    t->textures += scene->texture_count;
    t->images += scene->image_count;
    t->lights += scene->light_count;
    t->cameras += scene->camera_count;
    t->grids += scene->grid_count;
    t->triangles += scene->header->triangle_count;
    /* the base's texts as they are; of a part its own name, and each name behind that */
    t->string_bytes += prefix_bytes ? prefix_bytes : scene->header->sections[SCENE_STRINGS].count;
    for (uint32_t i = 0; prefix_bytes && i < scene->node_count; i++)
        t->string_bytes += strlen(scene->strings + scene->nodes[i].name) + prefix_bytes;
    for (uint32_t i = 0; prefix_bytes && i < scene->material_count; i++)
        t->string_bytes += strlen(scene->strings + scene->materials[i].name) + prefix_bytes;
    for (uint32_t i = 0; prefix_bytes && i < scene->grid_count; i++)
        t->string_bytes += strlen(scene->strings + scene->grids[i].name) + prefix_bytes;
}

static bool find_totals(const struct compose_desc *desc, struct totals *t, struct error *err)
{
    *t = (struct totals){.nodes = desc->part_count};
    add_totals(t, desc->base, 0);
    for (size_t i = 0; i < desc->part_count; i++)
        add_totals(t, desc->parts[i].scene, strlen(desc->parts[i].name) + 2);
    if (t->triangles > COMPOSE_TRIANGLES_MAX)
        return error_set(err, ERROR_TOO_LARGE,
                         "with its parts the scene has %llu triangles, the limit is %llu",
                         (unsigned long long)t->triangles, COMPOSE_TRIANGLES_MAX);
    if (t->nodes > COMPOSE_NODES_MAX)
        return error_set(err, ERROR_TOO_LARGE,
                         "with its parts the scene has %llu nodes, the limit is %d",
                         (unsigned long long)t->nodes, COMPOSE_NODES_MAX);
    if (t->primitives > INT32_MAX || t->materials > INT32_MAX || t->textures > INT32_MAX ||
        t->images > INT32_MAX || t->string_bytes > UINT32_MAX)
        return error_set(err, ERROR_TOO_LARGE, "the scene and its parts are too many together");
    return true;
}

static bool reserve(struct composed_scene *c, const struct compose_desc *desc,
                    const struct totals *t, struct error *err)
{
    c->parts = calloc(desc->part_count + 1, sizeof *c->parts);
    c->nodes = calloc(t->nodes + 1, sizeof *c->nodes);
    c->meshes = calloc(t->meshes + 1, sizeof *c->meshes);
    c->primitives = calloc(t->primitives + 1, sizeof *c->primitives);
    c->materials = calloc(t->materials + 1, sizeof *c->materials);
    c->textures = calloc(t->textures + 1, sizeof *c->textures);
    c->images = calloc(t->images + 1, sizeof *c->images);
    c->lights = calloc(t->lights + 1, sizeof *c->lights);
    c->cameras = calloc(t->cameras + 1, sizeof *c->cameras);
    c->grids = calloc(t->grids + 1, sizeof *c->grids);
    c->string_capacity = t->string_bytes + 1;
    c->strings = calloc(1, c->string_capacity);
    return (c->parts && c->nodes && c->meshes && c->primitives && c->materials && c->textures &&
            c->images && c->lights && c->cameras && c->grids && c->strings) ||
           error_set(err, ERROR_NO_MEMORY, "a scene and its parts, %llu nodes",
                     (unsigned long long)t->nodes);
}

/* ---- copying ---- */

/* PART/NAME, or nothing for what has no name. part NULL: the name itself. */
static uint32_t add_name(struct composed_scene *c, const char *part, const char *name)
{
    uint64_t at = c->string_bytes, bytes = 0;
    if (!*name)
        return 0;
    if (part) {
        bytes = strlen(part);
        memcpy(c->strings + at, part, bytes);
        c->strings[at + bytes++] = '/';
    }
    memcpy(c->strings + at + bytes, name, strlen(name) + 1);
    c->string_bytes += bytes + strlen(name) + 1;
    return (uint32_t)at;
}

static int32_t shifted(int32_t index, uint32_t by)
{
    return index < 0 ? index : index + (int32_t)by;
}

static void copy_nodes(struct composed_scene *c, const struct scene *from, const char *name,
                       int32_t root)
{
    struct scene *to = &c->scene;
    for (uint32_t i = 0; i < from->node_count; i++) {
        struct scene_node *node = &c->nodes[to->node_count + i];
        *node = from->nodes[i];
        node->parent = node->parent < 0 ? root : shifted(node->parent, to->node_count);
        node->mesh = shifted(node->mesh, to->mesh_count);
        node->camera = shifted(node->camera, to->camera_count);
        node->light = shifted(node->light, to->light_count);
        node->grid = shifted(node->grid, to->grid_count);
        if (name)
            node->name = add_name(c, name, from->strings + node->name);
    }
}

static void copy_meshes(struct composed_scene *c, const struct scene *from, uint32_t part)
{
    struct scene *to = &c->scene;
    for (uint32_t i = 0; i < from->mesh_count; i++) {
        struct scene_mesh *mesh = &c->meshes[to->mesh_count + i];
        *mesh = from->meshes[i];
        mesh->first_primitive += to->primitive_count;
        mesh->name = part ? 0 : mesh->name;
    }
    for (uint32_t i = 0; i < from->primitive_count; i++) {
        struct scene_primitive *primitive = &c->primitives[to->primitive_count + i];
        *primitive = from->primitives[i];
        primitive->material += to->material_count;
        primitive->part = part;
    }
}

static void copy_materials(struct composed_scene *c, const struct scene *from, const char *name,
                           uint32_t part)
{
    struct scene *to = &c->scene;
    for (uint32_t i = 0; i < from->material_count; i++) {
        struct scene_material *material = &c->materials[to->material_count + i];
        *material = from->materials[i];
        if (name)
            material->name = add_name(c, name, from->strings + material->name);
        for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++)
            material->textures[slot].texture =
                shifted(material->textures[slot].texture, to->texture_count);
    }
    for (uint32_t i = 0; i < from->texture_count; i++) {
        struct scene_texture *texture = &c->textures[to->texture_count + i];
        *texture = from->textures[i];
        texture->image = shifted(texture->image, to->image_count);
        texture->name = part ? 0 : texture->name;
    }
    for (uint32_t i = 0; i < from->image_count; i++) {
        struct scene_image *image = &c->images[to->image_count + i];
        *image = from->images[i];
        image->part = part;
        image->name = part ? 0 : image->name;
    }
}

static void copy_lights_and_cameras(struct composed_scene *c, const struct scene *from,
                                    uint32_t part)
{
    struct scene *to = &c->scene;
    for (uint32_t i = 0; i < from->light_count; i++) {
        c->lights[to->light_count + i] = from->lights[i];
        if (part)
            c->lights[to->light_count + i].name = 0;
    }
    for (uint32_t i = 0; i < from->camera_count; i++) {
        c->cameras[to->camera_count + i] = from->cameras[i];
        if (part)
            c->cameras[to->camera_count + i].name = 0;
    }
}

static void copy_grids(struct composed_scene *c, const struct scene *from, const char *name,
                       uint32_t part)
{
    for (uint32_t i = 0; i < from->grid_count; i++) {
        struct scene_grid *grid = &c->grids[c->scene.grid_count + i];
        *grid = from->grids[i];
        grid->part = part;
        if (name)
            grid->name = add_name(c, name, from->strings + grid->name);
    }
}

/* Appends a scene to those that are there; name NULL: the base. */
static void append(struct composed_scene *c, const struct scene *from, const char *name,
                   int32_t root)
{
    struct scene *to = &c->scene;
    uint32_t part = to->part_count;
    struct scene_part *record = &c->parts[to->part_count++];
    record->scene = from;
    record->first_node = to->node_count;
    record->first_primitive = to->primitive_count;
    record->first_material = to->material_count;
    record->first_texture = to->texture_count;
    record->first_image = to->image_count;
    record->first_grid = to->grid_count;
    copy_nodes(c, from, name, root);
    copy_meshes(c, from, part);
    copy_materials(c, from, name, part);
    copy_lights_and_cameras(c, from, part);
    copy_grids(c, from, name, part);
    to->node_count += from->node_count;
    to->mesh_count += from->mesh_count;
    to->primitive_count += from->primitive_count;
    to->material_count += from->material_count;
    to->texture_count += from->texture_count;
    to->image_count += from->image_count;
    to->light_count += from->light_count;
    to->camera_count += from->camera_count;
    to->grid_count += from->grid_count;
}

static void begin(struct composed_scene *c, const struct scene *base)
{
    c->scene = *base;
    c->scene.nodes = c->nodes;
    c->scene.meshes = c->meshes;
    c->scene.primitives = c->primitives;
    c->scene.materials = c->materials;
    c->scene.textures = c->textures;
    c->scene.images = c->images;
    c->scene.lights = c->lights;
    c->scene.cameras = c->cameras;
    c->scene.grids = c->grids;
    c->scene.strings = c->strings;
    c->scene.parts = c->parts;
    c->scene.node_count = c->scene.mesh_count = c->scene.primitive_count = 0;
    c->scene.material_count = c->scene.texture_count = c->scene.image_count = 0;
    c->scene.light_count = c->scene.camera_count = c->scene.part_count = c->scene.grid_count = 0;
    c->string_bytes = base->header->sections[SCENE_STRINGS].count;
    memcpy(c->strings, base->strings, c->string_bytes);
    append(c, base, NULL, -1);
}

/* ---- parts ---- */

static bool add_part(struct composed_scene *c, const struct compose_part *part, uint32_t index,
                     int32_t parent, struct error *err)
{
    uint32_t root = c->scene.node_count;
    int32_t twin = scene_find_node(&c->scene, part->name);
    if (twin >= 0)
        return error_set(err, ERROR_INVALID_REQUEST,
                         "part '%.200s' has the name of a node of the scene", part->name);
    struct scene_node *node = &c->nodes[c->scene.node_count++];
    *node = (struct scene_node){
        .parent = parent, .mesh = -1, .camera = -1, .light = -1, .source_index = root, .grid = -1};
    mat4_identity(node->local_matrix);
    mat4_identity(node->world_matrix);
    node->name = add_name(c, NULL, part->name);
    append(c, part->scene, part->name, (int32_t)root);
    struct scene_part *record = &c->parts[c->scene.part_count - 1];
    record->name = c->strings + node->name;
    record->identity = part->identity;
    record->source_index = index;
    return true;
}

static bool refuse_rest(const struct compose_desc *desc, const bool *is_added, bool is_deep,
                        struct error *err)
{
    for (size_t i = 0; i < desc->part_count; i++) {
        const struct compose_part *part = &desc->parts[i];
        if (is_added[i])
            continue;
        if (is_deep)
            return error_set(err, ERROR_TOO_LARGE, "part '%.200s' is deeper than %d parts",
                             part->name, COMPOSE_DEPTH_MAX);
        return error_set(err, ERROR_NOT_FOUND,
                         "part '%.200s': there is no node '%.200s' outside of it for its parent",
                         part->name, part->parent);
    }
    return true;
}

/* Level by level: those whose parent is there, in their order, then those that hang on them. */
static bool add_parts(struct composed_scene *c, const struct compose_desc *desc, struct error *err)
{
    bool *is_added = calloc(desc->part_count, sizeof *is_added);
    bool is_good = is_added || error_set(err, ERROR_NO_MEMORY, "parts");
    bool has_grown = true;
    int depth = 0;
    for (; is_good && has_grown && depth < COMPOSE_DEPTH_MAX; depth++) {
        const struct scene there = c->scene; /* before this level */
        has_grown = false;
        for (size_t i = 0; is_good && i < desc->part_count; i++) {
            const struct compose_part *part = &desc->parts[i];
            if (is_added[i])
                continue;
            int32_t parent = part->parent ? scene_find_node(&there, part->parent) : -1;
            if (part->parent && parent < 0)
                continue;
            is_good = add_part(c, part, (uint32_t)i, parent, err);
            is_added[i] = has_grown = true;
        }
    }
    is_good = is_good && refuse_rest(desc, is_added, has_grown, err);
    free(is_added);
    return is_good;
}

struct composed_scene *scene_compose(const struct compose_desc *desc, struct error *err)
{
    struct totals totals;
    struct composed_scene *c = calloc(1, sizeof *c);
    if (!c) {
        error_set(err, ERROR_NO_MEMORY, "scene with parts");
        return NULL;
    }
    if (find_totals(desc, &totals, err) && reserve(c, desc, &totals, err)) {
        begin(c, desc->base);
        if (add_parts(c, desc, err))
            return c;
    }
    composed_scene_destroy(c);
    return NULL;
}
