/* SPDX-License-Identifier: MIT */
/* Reading the lights of a render request. */
#include <stdlib.h>

#include "protocol/limits.h"
#include "protocol/request_parts.h"

/* A member that this type of light does not have would be silently ignored: refuse it. */
static bool refuse_members(const struct json_node *node, const char *const *names, const char *type)
{
    for (; *names; names++) {
        struct json_node member = json_member(node, *names);
        if (member.value)
            return json_refuse(&member, ERROR_INVALID_REQUEST, "but a %s light has none", type);
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

/* Where the light is and where it shines, as far as its type has that. */
static bool read_placement(const struct json_node *node, struct request_light *light)
{
    static const char *const not_directional[] = {"position", "range", "inner_cone_deg",
                                                  "outer_cone_deg", NULL};
    static const char *const not_point[] = {"direction", "inner_cone_deg", "outer_cone_deg", NULL};
    struct json_node position = json_member(node, "position");
    struct json_node direction = json_member(node, "direction");
    struct json_node range = json_member(node, "range");

    if (light->type == REQUEST_LIGHT_DIRECTIONAL) {
        if (!refuse_members(node, not_directional, "directional"))
            return false;
    } else if (!json_expect_present(&position)) {
        return false;
    }
    if (light->type == REQUEST_LIGHT_POINT) {
        if (!refuse_members(node, not_point, "point"))
            return false;
    } else if (!json_expect_present(&direction)) {
        return false;
    }
    if (light->type == REQUEST_LIGHT_SPOT && !read_cone(node, light))
        return false;
    return json_read_numbers(&position, 3, -LIMIT_COORDINATE, LIMIT_COORDINATE, light->position) &&
           request_read_direction(&direction, light->direction) &&
           json_read_number(&range, 0, LIMIT_COORDINATE, &light->range);
}

static bool read_light(const struct json_node *node, struct request_light *light)
{
    static const char *const known[] = {
        "type",           "position",       "direction", "color",  "intensity",
        "inner_cone_deg", "outer_cone_deg", "range",     "shadow", NULL};
    static const char *const planned[] = {"rect", "disk", NULL};
    const struct json_choice types = {.name = request_light_type_name, .planned = planned};

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
