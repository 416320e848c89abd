/* SPDX-License-Identifier: MIT */
/* Reading the overrides of nodes and materials of a render request. */
#include <stdlib.h>
#include <string.h>

#include "protocol/limits.h"
#include "protocol/lobe_members_json.h"
#include "protocol/request_parts.h"

/* The member's name is that of a node or material. Returns an owned copy, or NULL with err set. */
static char *copy_name(const struct json_node *node)
{
    size_t length = strlen(node->key);
    if (length < 1 || length > LIMIT_NAME_BYTES) {
        json_refuse(node, ERROR_INVALID_REQUEST, "but its name must have 1 to %d bytes",
                    LIMIT_NAME_BYTES);
        return NULL;
    }
    char *name = strdup(node->key);
    if (!name)
        error_set(node->err, ERROR_NO_MEMORY, "override of '%.40s'", node->key);
    return name;
}

static bool expect_few_members(const struct json_node *node)
{
    if (!json_expect_object(node, NULL))
        return false;
    if (json_object_size(node->value) > LIMIT_REQUEST_OVERRIDES)
        return json_refuse(node, ERROR_TOO_LARGE, "the limit is %d", LIMIT_REQUEST_OVERRIDES);
    return true;
}

/* ---- nodes ---- */

static bool read_node(const struct json_node *node, struct request_node_override *override)
{
    static const char *const known[] = {"visible", "matrix", NULL};
    if (!json_expect_object(node, known))
        return false;
    struct json_node visible = json_member(node, "visible"), matrix = json_member(node, "matrix");
    override->has_visible = visible.value;
    override->has_matrix = matrix.value;
    return json_read_bool(&visible, &override->visible) &&
           request_read_matrix(&matrix, override->matrix);
}

static int compare_nodes(const void *a, const void *b)
{
    const struct request_node_override *left = a, *right = b;
    return strcmp(left->node, right->node);
}

static bool read_nodes(const struct json_node *node, struct render_request *request)
{
    if (!node->value)
        return true;
    if (!expect_few_members(node))
        return false;
    size_t count = json_object_size(node->value);
    request->nodes = calloc(count + 1, sizeof *request->nodes);
    if (!request->nodes)
        return error_set(node->err, ERROR_NO_MEMORY, "%zu node overrides", count);

    const char *key;
    json_t *value;
    json_object_foreach(node->value, key, value)
    {
        struct json_node member = json_member(node, key);
        struct request_node_override *override = &request->nodes[request->node_count];
        if (!member.value)
            continue;
        if (!(override->node = copy_name(&member)))
            return false;
        request->node_count++;
        if (!read_node(&member, override))
            return false;
    }
    qsort(request->nodes, request->node_count, sizeof *request->nodes, compare_nodes);
    return true;
}

/* ---- materials ---- */

/* Reads one number and says whether it was there. */
static bool read_optional(const struct json_node *node, const char *key, double max, bool *has,
                          double *out)
{
    struct json_node member = json_member(node, key);
    *has = member.value;
    return json_read_number(&member, 0, max, out);
}

static bool read_optional_color(const struct json_node *node, const char *key, size_t channels,
                                double max, bool *has, double *out)
{
    struct json_node member = json_member(node, key);
    *has = member.value;
    return json_read_numbers(&member, channels, 0, max, out);
}

static bool read_ior(const struct json_node *node, struct request_material_override *override)
{
    struct json_node ior = json_member(node, "ior");
    if (!read_optional(node, "ior", 100, &override->has_ior, &override->ior))
        return false;
    if (override->has_ior && override->ior != 0 && override->ior < 1)
        return json_refuse(&ior, ERROR_INVALID_REQUEST,
                           "must be 0 (total reflection) or from 1 to 100");
    return true;
}

/* The colour is what remains after the distance: one says nothing without the other. */
static bool read_attenuation(const struct json_node *node,
                             struct request_material_override *override)
{
    struct json_node color = json_member(node, "attenuation_color");
    struct json_node distance = json_member(node, "attenuation_distance");
    override->has_attenuation = color.value || distance.value;
    if (!override->has_attenuation)
        return true;
    if (!color.value || !distance.value)
        return json_refuse(color.value ? &distance : &color, ERROR_INVALID_REQUEST,
                           "but attenuation_color and attenuation_distance go together");
    return json_read_numbers(&color, 3, 0, 1, override->attenuation_color) &&
           json_read_number(&distance, 1e-9, LIMIT_COORDINATE, &override->attenuation_distance);
}

static bool read_pass_through(const struct json_node *node,
                              struct request_material_override *override)
{
    static const char *const known[] = {"model", "edge_color", "edge_exponent", NULL};
    override->has_pass_through = node->value;
    if (!node->value)
        return true;
    if (!json_expect_object(node, known))
        return false;
    struct json_node model = json_member(node, "model");
    struct json_node color = json_member(node, "edge_color");
    struct json_node exponent = json_member(node, "edge_exponent");
    const struct json_choice models = {.name = request_pass_through_name};
    int index = 0;
    if (!json_expect_present(&model) || !json_read_choice(&model, &models, &index))
        return false;
    override->pass_through = (enum request_pass_through)index;
    const struct json_node *extra = color.value ? &color : &exponent;
    if (override->pass_through != REQUEST_PASS_EDGE && extra->value)
        return json_refuse(extra, ERROR_INVALID_REQUEST, "but only the model 'edge' has one");
    for (int i = 0; i < 3; i++)
        override->edge_color[i] = 1;
    override->edge_exponent = 1;
    return json_read_numbers(&color, 3, 0, 1, override->edge_color) &&
           json_read_number(&exponent, 0.01, 1000, &override->edge_exponent);
}

static bool read_material(const struct json_node *node, struct request_material_override *override)
{
    static const char *const known[] = {"base_color",
                                        "metallic",
                                        "roughness",
                                        "emissive",
                                        "transmission",
                                        "ior",
                                        "thickness",
                                        "attenuation_color",
                                        "attenuation_distance",
                                        "alpha_mode",
                                        "pass_through",
                                        "self_shadow",
                                        "cast_once",
                                        "specular",
                                        "specular_color",
                                        "clearcoat",
                                        "clearcoat_roughness",
                                        "sheen_color",
                                        "sheen_roughness",
                                        "iridescence",
                                        "iridescence_ior",
                                        "iridescence_thickness_nm",
                                        "anisotropy",
                                        "anisotropy_rotation_deg",
                                        "diffuse_transmission",
                                        "diffuse_transmission_color",
                                        "dispersion",
                                        NULL};
    struct request_material_override *o = override;
    if (!json_expect_object(node, known) ||
        !read_optional_color(node, "base_color", 4, 1, &o->has_base_color, o->base_color) ||
        !read_optional(node, "metallic", 1, &o->has_metallic, &o->metallic) ||
        !read_optional(node, "roughness", 1, &o->has_roughness, &o->roughness) ||
        !read_optional_color(node, "emissive", 3, LIMIT_INTENSITY, &o->has_emissive, o->emissive) ||
        !read_optional(node, "transmission", 1, &o->has_transmission, &o->transmission) ||
        !read_ior(node, o) ||
        !read_optional(node, "thickness", LIMIT_COORDINATE, &o->has_thickness, &o->thickness) ||
        !read_attenuation(node, o) || !lobe_members_read(node, &o->lobes))
        return false;

    struct json_node alpha_mode = json_member(node, "alpha_mode");
    struct json_node pass_through = json_member(node, "pass_through");
    struct json_node self_shadow = json_member(node, "self_shadow");
    struct json_node cast_once = json_member(node, "cast_once");
    const struct json_choice modes = {.name = request_alpha_mode_name};
    int mode = 0;
    if (!json_read_choice(&alpha_mode, &modes, &mode) || !read_pass_through(&pass_through, o))
        return false;
    o->alpha_mode = (enum request_alpha_mode)mode;
    o->has_alpha_mode = alpha_mode.value;
    o->has_self_shadow = self_shadow.value;
    o->has_cast_once = cast_once.value;
    return json_read_bool(&self_shadow, &o->self_shadow) &&
           json_read_bool(&cast_once, &o->cast_once);
}

static int compare_materials(const void *a, const void *b)
{
    const struct request_material_override *left = a, *right = b;
    return strcmp(left->material, right->material);
}

static bool read_materials(const struct json_node *node, struct render_request *request)
{
    if (!node->value)
        return true;
    if (!expect_few_members(node))
        return false;
    size_t count = json_object_size(node->value);
    request->materials = calloc(count + 1, sizeof *request->materials);
    if (!request->materials)
        return error_set(node->err, ERROR_NO_MEMORY, "%zu material overrides", count);

    const char *key;
    json_t *value;
    json_object_foreach(node->value, key, value)
    {
        struct json_node member = json_member(node, key);
        struct request_material_override *override = &request->materials[request->material_count];
        if (!member.value)
            continue;
        if (!(override->material = copy_name(&member)))
            return false;
        request->material_count++;
        if (!read_material(&member, override))
            return false;
    }
    qsort(request->materials, request->material_count, sizeof *request->materials,
          compare_materials);
    return true;
}

bool request_read_overrides(const struct json_node *node, struct render_request *request)
{
    static const char *const known[] = {"nodes", "materials", NULL};
    if (!node->value)
        return true;
    if (!json_expect_object(node, known))
        return false;
    struct json_node nodes = json_member(node, "nodes");
    struct json_node materials = json_member(node, "materials");
    return read_nodes(&nodes, request) && read_materials(&materials, request);
}
