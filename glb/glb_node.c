/* SPDX-License-Identifier: MIT */
/* Lights, cameras and nodes of the GLB builder. */
#include "glb/glb_internal.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

static double radians(double degrees)
{
    return degrees * (pi / 180);
}

int glb_builder_add_light(struct glb_builder *builder, const struct glb_light_desc *desc)
{
    static const char *const types[] = {"point", "spot", "directional"};
    static const double white[3] = {1, 1, 1};
    const double *c = desc->color;
    double outer_deg = desc->outer_cone_deg != 0 ? desc->outer_cone_deg : 45;
    if (builder->failure.code != ERROR_NONE)
        return 0;
    if (!glb_check_range(builder, desc->intensity, 0, FLT_MAX, "light.intensity") ||
        !glb_check_range(builder, desc->range, 0, FLT_MAX, "light.range") ||
        !glb_check_range(builder, outer_deg, 0, 90, "light.outer_cone_deg") ||
        !glb_check_range(builder, desc->inner_cone_deg, 0, outer_deg, "light.inner_cone_deg"))
        return error_wrap(&builder->failure, "light '%s'", desc->name ? desc->name : "");
    json_t *light = glb_object(builder);
    glb_put_name(builder, light, desc->name);
    glb_put(builder, light, "type", json_string(types[desc->type]));
    glb_put(
        builder, light, "color",
        glb_numbers(builder, c[0] == 0 && c[1] == 0 && c[2] == 0 ? white : c, 3, "light.color"));
    glb_put(builder, light, "intensity", glb_number(builder, desc->intensity, "light.intensity"));
    if (desc->range > 0)
        glb_put(builder, light, "range", glb_number(builder, desc->range, "light.range"));
    if (desc->type == GLB_LIGHT_SPOT) {
        json_t *spot = glb_object(builder);
        glb_put(builder, spot, "innerConeAngle",
                glb_number(builder, radians(desc->inner_cone_deg), "inner"));
        glb_put(builder, spot, "outerConeAngle", glb_number(builder, radians(outer_deg), "outer"));
        glb_put(builder, light, "spot", spot);
    }
    glb_use_extension(builder, "KHR_lights_punctual");
    return glb_append(builder, GLB_KIND_LIGHT, light);
}

static json_t *perspective(struct glb_builder *builder, const struct glb_camera_desc *desc,
                           double z_near)
{
    json_t *body = glb_object(builder);
    double fov_y_deg = desc->fov_y_deg != 0 ? desc->fov_y_deg : 45;
    glb_check_range(builder, fov_y_deg, 1e-3, 179, "camera.fov_y_deg");
    glb_put(builder, body, "yfov", glb_number(builder, radians(fov_y_deg), "camera.fov_y_deg"));
    if (desc->aspect > 0)
        glb_put(builder, body, "aspectRatio", glb_number(builder, desc->aspect, "camera.aspect"));
    glb_put(builder, body, "znear", glb_number(builder, z_near, "camera.z_near"));
    if (desc->z_far > 0)
        glb_put(builder, body, "zfar", glb_number(builder, desc->z_far, "camera.z_far"));
    return body;
}

static json_t *orthographic(struct glb_builder *builder, const struct glb_camera_desc *desc,
                            double z_near)
{
    json_t *body = glb_object(builder);
    glb_check_range(builder, desc->x_mag, FLT_MIN, FLT_MAX, "camera.x_mag");
    glb_check_range(builder, desc->y_mag, FLT_MIN, FLT_MAX, "camera.y_mag");
    glb_put(builder, body, "xmag", glb_number(builder, desc->x_mag, "camera.x_mag"));
    glb_put(builder, body, "ymag", glb_number(builder, desc->y_mag, "camera.y_mag"));
    glb_put(builder, body, "znear", glb_number(builder, z_near, "camera.z_near"));
    glb_put(builder, body, "zfar",
            glb_number(builder, desc->z_far > 0 ? desc->z_far : 1000, "camera.z_far"));
    return body;
}

int glb_builder_add_camera(struct glb_builder *builder, const struct glb_camera_desc *desc)
{
    double z_near = desc->z_near != 0 ? desc->z_near : 0.05;
    if (builder->failure.code != ERROR_NONE)
        return 0;
    if (!glb_check_range(builder, z_near, FLT_MIN, FLT_MAX, "camera.z_near") ||
        (desc->z_far != 0 &&
         !glb_check_range(builder, desc->z_far, z_near, FLT_MAX, "camera.z_far")))
        return 0;
    json_t *camera = glb_object(builder);
    glb_put_name(builder, camera, desc->name);
    const char *type = desc->is_orthographic ? "orthographic" : "perspective";
    glb_put(builder, camera, "type", json_string(type));
    glb_put(builder, camera, type,
            desc->is_orthographic ? orthographic(builder, desc, z_near)
                                  : perspective(builder, desc, z_near));
    return glb_append(builder, GLB_KIND_CAMERA, camera);
}

static bool is_zero(const double *values, int count)
{
    for (int i = 0; i < count; i++)
        if (values[i] != 0)
            return false;
    return true;
}

static void put_transform(struct glb_builder *builder, json_t *node,
                          const struct glb_node_desc *desc)
{
    if (desc->has_matrix) {
        glb_put(builder, node, "matrix", glb_numbers(builder, desc->matrix, 16, "node.matrix"));
        return;
    }
    if (!is_zero(desc->translation, 3))
        glb_put(builder, node, "translation",
                glb_numbers(builder, desc->translation, 3, "node.translation"));
    if (!is_zero(desc->rotation, 4))
        glb_put(builder, node, "rotation",
                glb_numbers(builder, desc->rotation, 4, "node.rotation"));
    if (!is_zero(desc->scale, 3))
        glb_put(builder, node, "scale", glb_numbers(builder, desc->scale, 3, "node.scale"));
}

/* A node is a root, or a child of a node that came before it: no cycle can be built. */
static void attach(struct glb_builder *builder, int id, int parent)
{
    json_t *list = builder->roots;
    if (parent) {
        json_t *node = json_array_get(builder->arrays[GLB_KIND_NODE], (size_t)parent - 1);
        list = json_object_get(node, "children");
        if (!list) {
            list = json_array();
            glb_put(builder, node, "children", list);
        }
    }
    if (json_array_append_new(list, json_integer(id - 1)) != 0)
        glb_fail_memory(builder);
}

static void put_extensions(struct glb_builder *builder, json_t *node,
                           const struct glb_node_desc *desc)
{
    if (!desc->light && !desc->grid)
        return;
    json_t *extensions = glb_object(builder);
    if (desc->light)
        glb_put(builder, extensions, "KHR_lights_punctual",
                json_pack("{si}", "light", desc->light - 1));
    if (desc->grid)
        glb_put(builder, extensions, "VITRAIL_density_grids",
                json_pack("{si}", "grid", desc->grid - 1));
    glb_put(builder, node, "extensions", extensions);
}

int glb_builder_add_node(struct glb_builder *builder, const struct glb_node_desc *desc)
{
    if (builder->failure.code != ERROR_NONE)
        return 0;
    if (!glb_check_id(builder, GLB_KIND_NODE, desc->parent, "node.parent") ||
        !glb_check_id(builder, GLB_KIND_MESH, desc->mesh, "node.mesh") ||
        !glb_check_id(builder, GLB_KIND_LIGHT, desc->light, "node.light") ||
        !glb_check_id(builder, GLB_KIND_CAMERA, desc->camera, "node.camera") ||
        !glb_check_id(builder, GLB_KIND_GRID, desc->grid, "node.grid"))
        return error_wrap(&builder->failure, "node '%s'", desc->name ? desc->name : "");
    json_t *node = glb_object(builder);
    glb_put_name(builder, node, desc->name);
    put_transform(builder, node, desc);
    if (desc->mesh)
        glb_put(builder, node, "mesh", json_integer(desc->mesh - 1));
    if (desc->camera)
        glb_put(builder, node, "camera", json_integer(desc->camera - 1));
    put_extensions(builder, node, desc);
    int id = glb_append(builder, GLB_KIND_NODE, node);
    if (id)
        attach(builder, id, desc->parent);
    return id;
}

static void normalize(double v[3])
{
    double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    assert(length > 0);
    for (int i = 0; i < 3; i++)
        v[i] /= length;
}

static void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

void glb_node_look_at(struct glb_node_desc *node, const double eye[3], const double target[3])
{
    double z[3] = {eye[0] - target[0], eye[1] - target[1], eye[2] - target[2]}, x[3], y[3];
    normalize(z);
    /* Straight up or down has no horizon: take -Z of the world as up. */
    double up[3] = {0, fabs(z[1]) < 0.999999, fabs(z[1]) < 0.999999 ? 0 : -1};
    cross(up, z, x);
    normalize(x);
    cross(z, x, y);
    double matrix[16] = {x[0], x[1], x[2], 0, y[0],   y[1],   y[2],   0,
                         z[0], z[1], z[2], 0, eye[0], eye[1], eye[2], 1};
    node->has_matrix = true;
    memcpy(node->matrix, matrix, sizeof matrix);
}

void glb_node_rotate(struct glb_node_desc *node, const double axis[3], double angle_deg)
{
    double half = radians(angle_deg) / 2, s = sin(half);
    node->rotation[0] = axis[0] * s;
    node->rotation[1] = axis[1] * s;
    node->rotation[2] = axis[2] * s;
    node->rotation[3] = cos(half);
}
