/* SPDX-License-Identifier: MIT */
/* Reading the overrides of nodes, materials and density grids of a render request. */
#include <assert.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/limits.h"
#include "protocol/lobe_members_json.h"
#include "protocol/request_parts.h"

/* The member's name is that of a node, material or density grid. Returns an owned copy, or NULL
 * with err set. */
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

/* The overrides of one kind: an array of structs whose first member is the name, an owned
 * string. */
struct override_kind {
    size_t size;
    const char *of; /* for errors: "nodes" */
    bool (*read)(const struct json_node *node, void *override);
};

struct override_list {
    void *overrides; /* owned */
    size_t count;
};

static int compare_names(const void *a, const void *b)
{
    return strcmp(*(char *const *)a, *(char *const *)b);
}

/* Reads an object of overrides, sorted by name. The list is to be freed after an error, too. */
static bool read_overrides(const struct json_node *node, const struct override_kind *kind,
                           struct override_list *list)
{
    if (!node->value)
        return true;
    if (!json_expect_object(node, NULL))
        return false;
    size_t count = json_object_size(node->value);
    if (count > LIMIT_REQUEST_OVERRIDES)
        return json_refuse(node, ERROR_TOO_LARGE, "the limit is %d", LIMIT_REQUEST_OVERRIDES);
    list->overrides = calloc(count + 1, kind->size);
    if (!list->overrides)
        return error_set(node->err, ERROR_NO_MEMORY, "%zu overrides of %s", count, kind->of);

    const char *key;
    json_t *value;
    json_object_foreach(node->value, key, value)
    {
        struct json_node member = json_member(node, key);
        void *one = (char *)list->overrides + list->count * kind->size;
        if (!member.value)
            continue;
        char *name = copy_name(&member);
        if (!name)
            return false;
        *(char **)one = name;
        list->count++;
        if (!kind->read(&member, one))
            return false;
    }
    qsort(list->overrides, list->count, kind->size, compare_names);
    return true;
}

/* ---- nodes ---- */

static bool read_node(const struct json_node *node, void *out)
{
    struct request_node_override *override = out;
    static const char *const known[] = {"visible", "matrix", NULL};
    if (!json_expect_object(node, known))
        return false;
    struct json_node visible = json_member(node, "visible"), matrix = json_member(node, "matrix");
    override->has_visible = visible.value;
    override->has_matrix = matrix.value;
    return json_read_bool(&visible, &override->visible) &&
           request_read_matrix(&matrix, override->matrix);
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

static bool read_material(const struct json_node *node, void *out)
{
    struct request_material_override *o = out;
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

/* ---- density grids ---- */

static bool read_grid(const struct json_node *node, void *out)
{
    struct request_grid_override *o = out;
    static const char *const known[] = {"density", "extinction", "color", "anisotropy", NULL};
    if (!json_expect_object(node, known))
        return false;
    struct json_node anisotropy = json_member(node, "anisotropy");
    o->has_anisotropy = anisotropy.value;
    return read_optional(node, "density", LIMIT_GRID_FACTOR, &o->has_density, &o->density) &&
           read_optional_color(node, "extinction", 3, LIMIT_GRID_FACTOR, &o->has_extinction,
                               o->extinction) &&
           read_optional_color(node, "color", 3, 1, &o->has_color, o->color) &&
           json_read_number(&anisotropy, -LIMIT_GRID_ANISOTROPY, LIMIT_GRID_ANISOTROPY,
                            &o->anisotropy);
}

static_assert(offsetof(struct request_node_override, node) == 0 &&
                  offsetof(struct request_material_override, material) == 0 &&
                  offsetof(struct request_grid_override, grid) == 0,
              "an override begins with its name");

bool request_read_overrides(const struct json_node *node, struct render_request *request)
{
    static const char *const known[] = {"nodes", "materials", "grids", NULL};
    static const struct override_kind node_kind = {sizeof *request->nodes, "nodes", read_node};
    static const struct override_kind material_kind = {sizeof *request->materials, "materials",
                                                       read_material};
    static const struct override_kind grid_kind = {sizeof *request->grids, "density grids",
                                                   read_grid};
    if (!node->value)
        return true;
    if (!json_expect_object(node, known))
        return false;
    struct json_node nodes = json_member(node, "nodes");
    struct json_node materials = json_member(node, "materials");
    struct json_node grids = json_member(node, "grids");
    struct override_list of_nodes = {0}, of_materials = {0}, of_grids = {0};
    bool is_good = read_overrides(&nodes, &node_kind, &of_nodes) &&
                   read_overrides(&materials, &material_kind, &of_materials) &&
                   read_overrides(&grids, &grid_kind, &of_grids);
    request->nodes = of_nodes.overrides;
    request->node_count = of_nodes.count;
    request->materials = of_materials.overrides;
    request->material_count = of_materials.count;
    request->grids = of_grids.overrides;
    request->grid_count = of_grids.count;
    return is_good;
}
