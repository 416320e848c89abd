/* SPDX-License-Identifier: MIT */
/* Reading the lights of a render request. */
#include <stdlib.h>

#include "protocol/limits.h"
#include "protocol/request_parts.h"

#define TYPE(name) (1u << REQUEST_LIGHT_##name)
#define AREAS (TYPE(RECT) | TYPE(DISK))

/* Which types of light have a member, and which cannot be without it. */
static const struct {
    const char *name;
    unsigned types, required;
} members[] = {
    {"position", TYPE(POINT) | TYPE(SPOT) | AREAS, TYPE(POINT) | TYPE(SPOT) | AREAS},
    {"direction", TYPE(DIRECTIONAL) | TYPE(SPOT) | AREAS, TYPE(DIRECTIONAL) | TYPE(SPOT) | AREAS},
    {"range", TYPE(POINT) | TYPE(SPOT), 0},
    {"inner_cone_deg", TYPE(SPOT), 0},
    {"outer_cone_deg", TYPE(SPOT), 0},
    {"width", TYPE(RECT), TYPE(RECT)},
    {"height", TYPE(RECT), TYPE(RECT)},
    {"up", TYPE(RECT) | TYPE(SPOT) | TYPE(DIRECTIONAL), 0},
    {"radius", TYPE(DISK), TYPE(DISK)},
};

/* A member that this type of light does not have would be silently ignored: refuse it. */
static bool check_members(const struct json_node *node, enum request_light_type type)
{
    for (size_t i = 0; i < sizeof members / sizeof *members; i++) {
        struct json_node member = json_member(node, members[i].name);
        if (member.value && !(members[i].types & 1u << type))
            return json_refuse(&member, ERROR_INVALID_REQUEST, "but a %s light has none",
                               request_light_type_name((int)type));
        if (members[i].required & 1u << type && !json_expect_present(&member))
            return false;
    }
    return true;
}

static bool read_cone(const struct json_node *node, struct request_light *light)
{
    struct json_node inner = json_member(node, "inner_cone_deg");
    struct json_node outer = json_member(node, "outer_cone_deg");
    light->outer_cone_deg = 45;
    if (!json_read_number(&outer, 0.001, 90, &light->outer_cone_deg) ||
        !json_read_number(&inner, 0, 90, &light->inner_cone_deg))
        return false;
    if (light->inner_cone_deg > light->outer_cone_deg)
        return json_refuse(&inner, ERROR_INVALID_REQUEST,
                           "must not be more than outer_cone_deg, which is %.9g",
                           light->outer_cone_deg);
    return true;
}

/* The size of an area light, and how a light is turned about its direction. */
static bool read_area(const struct json_node *node, struct request_light *light)
{
    struct json_node width = json_member(node, "width"), height = json_member(node, "height");
    struct json_node radius = json_member(node, "radius"), up = json_member(node, "up");
    if (!json_read_number(&width, LIMIT_LIGHT_SIZE_MIN, LIMIT_LIGHT_SIZE_MAX, &light->width) ||
        !json_read_number(&height, LIMIT_LIGHT_SIZE_MIN, LIMIT_LIGHT_SIZE_MAX, &light->height) ||
        !json_read_number(&radius, LIMIT_LIGHT_SIZE_MIN, LIMIT_LIGHT_SIZE_MAX, &light->radius) ||
        !request_read_direction(&up, light->up))
        return false;
    if (up.value && !request_are_independent(light->direction, light->up))
        return json_refuse(&up, ERROR_INVALID_REQUEST,
                           "parallel to the direction; give an up across it");
    return true;
}

/* Where the light is and where it shines, as far as its type has that. */
static bool read_placement(const struct json_node *node, struct request_light *light)
{
    struct json_node position = json_member(node, "position");
    struct json_node direction = json_member(node, "direction");
    struct json_node range = json_member(node, "range");

    if (!check_members(node, light->type))
        return false;
    if (light->type == REQUEST_LIGHT_SPOT && !read_cone(node, light))
        return false;
    return json_read_numbers(&position, 3, -LIMIT_COORDINATE, LIMIT_COORDINATE, light->position) &&
           request_read_direction(&direction, light->direction) &&
           json_read_number(&range, 0, LIMIT_COORDINATE, &light->range) && read_area(node, light);
}

static bool read_light(const struct json_node *node, struct request_light *light)
{
    static const char *const known[] = {
        "type",  "position", "direction", "color",  "intensity", "inner_cone_deg", "outer_cone_deg",
        "range", "shadow",   "width",     "height", "up",        "radius",         NULL};
    const struct json_choice types = {.name = request_light_type_name};

    *light = (struct request_light){.color = {1, 1, 1}, .intensity = 1};
    if (!json_expect_object(node, known))
        return false;
    struct json_node type = json_member(node, "type"), color = json_member(node, "color");
    struct json_node intensity = json_member(node, "intensity");
    struct json_node shadow = json_member(node, "shadow");
    int type_index = 0;
    bool casts_shadow = true;
    if (!json_expect_present(&type) || !json_read_choice(&type, &types, &type_index))
        return false;
    light->type = (enum request_light_type)type_index;
    if (!read_placement(node, light) || !json_read_numbers(&color, 3, 0, 1, light->color) ||
        !json_read_number(&intensity, 0, LIMIT_INTENSITY, &light->intensity) ||
        !json_read_bool(&shadow, &casts_shadow))
        return false;
    light->casts_no_shadow = !casts_shadow;
    return true;
}

bool request_read_lights(const struct json_node *node, struct render_request *request)
{
    size_t count;
    if (!json_expect_array(node, LIMIT_REQUEST_LIGHTS, &count))
        return false;
    if (count == 0)
        return true;
    request->lights = calloc(count, sizeof *request->lights);
    if (!request->lights)
        return error_set(node->err, ERROR_NO_MEMORY, "%zu lights", count);
    request->light_count = count;
    for (size_t i = 0; i < count; i++) {
        struct json_node element = json_element(node, i);
        if (!read_light(&element, &request->lights[i]))
            return false;
    }
    return true;
}
