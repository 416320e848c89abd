/* SPDX-License-Identifier: MIT */
/* Reading the parts of a render request: other scenes that hang on nodes. */
#include <stdlib.h>
#include <string.h>

#include "protocol/limits.h"
#include "protocol/request_parts.h"

static bool read_part_name(const struct json_node *node, struct request_part *part)
{
    size_t length = strlen(node->key);
    if (length < 1 || length > LIMIT_PART_NAME_BYTES || strchr(node->key, '/') ||
        node->key[0] == '#')
        return json_refuse(node, ERROR_INVALID_REQUEST,
                           "but its name must have 1 to %d bytes, no '/', and no '#' in front",
                           LIMIT_PART_NAME_BYTES);
    return (part->name = strdup(node->key)) ||
           error_set(node->err, ERROR_NO_MEMORY, "part '%.40s'", node->key);
}

static bool read_part(const struct json_node *node, struct request_part *part)
{
    static const char *const known[] = {"scene", "parent", "matrix", "visible", NULL};
    const char *parent_name = NULL;
    bool is_visible = true;
    if (!json_expect_object(node, known))
        return false;
    struct json_node scene = json_member(node, "scene"), parent = json_member(node, "parent");
    struct json_node matrix = json_member(node, "matrix"), visible = json_member(node, "visible");
    for (int i = 0; i < 16; i++)
        part->matrix[i] = i % 5 == 0;
    if (!request_read_scene(&scene, part->scene) || !json_read_name(&parent, &parent_name) ||
        !request_read_matrix(&matrix, part->matrix) || !json_read_bool(&visible, &is_visible))
        return false;
    part->is_hidden = !is_visible;
    if (parent_name && !(part->parent = strdup(parent_name)))
        return error_set(node->err, ERROR_NO_MEMORY, "parent of a part");
    return true;
}

static int compare_parts(const void *a, const void *b)
{
    const struct request_part *left = a, *right = b;
    return strcmp(left->name, right->name);
}

/* Every scene is an open file on its way to the worker. */
static bool check_scenes(const struct json_node *node, const struct render_request *request)
{
    struct request_resources resources;
    return render_request_resources(request, &resources) ||
           json_refuse(node, ERROR_TOO_LARGE, "with more than %d different scenes",
                       LIMIT_PART_SCENES);
}

bool request_read_parts(const struct json_node *node, struct render_request *request)
{
    if (!node->value)
        return true;
    if (!json_expect_object(node, NULL))
        return false;
    size_t count = json_object_size(node->value);
    if (count > LIMIT_PARTS)
        return json_refuse(node, ERROR_TOO_LARGE, "the limit is %d", LIMIT_PARTS);
    request->parts = calloc(count + 1, sizeof *request->parts);
    if (!request->parts)
        return error_set(node->err, ERROR_NO_MEMORY, "%zu parts", count);

    const char *key;
    json_t *value;
    json_object_foreach(node->value, key, value)
    {
        struct json_node member = json_member(node, key);
        if (member.value && (!read_part_name(&member, &request->parts[request->part_count++]) ||
                             !read_part(&member, &request->parts[request->part_count - 1])))
            return false;
    }
    qsort(request->parts, request->part_count, sizeof *request->parts, compare_parts);
    return check_scenes(node, request);
}

bool request_resources_add_scene(struct request_resources *resources, const char *id)
{
    for (int i = 0; i < resources->scene_count; i++)
        if (strcmp(resources->scenes[i], id) == 0)
            return true;
    if (resources->scene_count == LIMIT_PART_SCENES)
        return false;
    memcpy(resources->scenes[resources->scene_count++], id, strnlen(id, 64) + 1);
    return true;
}

bool request_environment_is_uploaded(const char *image)
{
    return *image && strcmp(image, REQUEST_ENVIRONMENT_STUDIO) != 0;
}

bool render_request_resources(const struct render_request *request,
                              struct request_resources *resources)
{
    *resources = (struct request_resources){.scene_count = 0};
    memcpy(resources->environment, request->environment.image, sizeof resources->environment);
    bool has_room = true;
    for (size_t i = 0; i < request->part_count; i++)
        has_room = has_room && request_resources_add_scene(resources, request->parts[i].scene);
    return has_room;
}
