/* SPDX-License-Identifier: MIT */
/* Meshes of the GLB builder: accessors, buffer views and primitives. */
#include "glb/glb_internal.h"

#include <math.h>
#include <stdlib.h>

enum {
    GL_COMPONENT_USHORT = 5123,
    GL_COMPONENT_UINT = 5125,
    GL_COMPONENT_FLOAT = 5126,
    GL_TARGET_VERTICES = 34962,
    GL_TARGET_INDICES = 34963,
};

json_t *glb_accessor(struct glb_builder *builder, int view, int component, size_t count,
                     const char *type)
{
    json_t *object = glb_object(builder);
    glb_put(builder, object, "bufferView", json_integer(view - 1));
    glb_put(builder, object, "componentType", json_integer(component));
    glb_put(builder, object, "count", json_integer((json_int_t)count));
    glb_put(builder, object, "type", json_string(type));
    return object;
}

/* Positions must say their bounds (glTF 2.0, 3.7.2.1). */
static void put_bounds(struct glb_builder *builder, json_t *object, const float *positions,
                       size_t count)
{
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < count; i++)
        for (int axis = 0; axis < 3; axis++) {
            low[axis] = fmin(low[axis], positions[3 * i + (size_t)axis]);
            high[axis] = fmax(high[axis], positions[3 * i + (size_t)axis]);
        }
    glb_put(builder, object, "min", glb_numbers(builder, low, 3, "positions"));
    glb_put(builder, object, "max", glb_numbers(builder, high, 3, "positions"));
}

static void put_attribute(struct glb_builder *builder, json_t *attributes, const char *semantic,
                          const float *values, size_t count, int components)
{
    static const char *const types[] = {NULL, "SCALAR", "VEC2", "VEC3", "VEC4"};
    if (!values)
        return;
    for (size_t i = 0; i < count * (size_t)components; i++)
        if (!isfinite(values[i])) {
            error_set(&builder->failure, ERROR_INVALID_REQUEST, "%s of vertex %zu is not finite",
                      semantic, i / (size_t)components);
            return;
        }
    size_t size_bytes = count * (size_t)components * sizeof *values;
    int view = glb_add_view(builder, values, size_bytes, GL_TARGET_VERTICES);
    json_t *object = glb_accessor(builder, view, GL_COMPONENT_FLOAT, count, types[components]);
    if (components == 3 && semantic[0] == 'P')
        put_bounds(builder, object, values, count);
    int id = glb_append(builder, GLB_KIND_ACCESSOR, object);
    glb_put(builder, attributes, semantic, json_integer(id - 1));
}

/* 16-bit where they fit: 65535 itself is the restart index and not allowed. */
static void put_indices(struct glb_builder *builder, json_t *primitive,
                        const struct glb_primitive_desc *desc)
{
    for (size_t i = 0; i < desc->index_count; i++)
        if (desc->indices[i] >= desc->vertex_count) {
            error_set(&builder->failure, ERROR_INVALID_REQUEST,
                      "index %zu is %u, there are %zu vertices", i, desc->indices[i],
                      desc->vertex_count);
            return;
        }
    bool is_short = desc->vertex_count <= UINT16_MAX;
    uint16_t *narrow = is_short ? calloc(desc->index_count, sizeof *narrow) : NULL;
    if (is_short && !narrow) {
        glb_fail_memory(builder);
        return;
    }
    for (size_t i = 0; is_short && i < desc->index_count; i++)
        narrow[i] = (uint16_t)desc->indices[i];
    const void *bytes = is_short ? (const void *)narrow : desc->indices;
    size_t size_bytes = desc->index_count * (is_short ? sizeof *narrow : sizeof *desc->indices);
    int view = glb_add_view(builder, bytes, size_bytes, GL_TARGET_INDICES);
    free(narrow);
    int component = is_short ? GL_COMPONENT_USHORT : GL_COMPONENT_UINT;
    int id = glb_append(builder, GLB_KIND_ACCESSOR,
                        glb_accessor(builder, view, component, desc->index_count, "SCALAR"));
    glb_put(builder, primitive, "indices", json_integer(id - 1));
}

static bool check_primitive(struct glb_builder *builder, const struct glb_primitive_desc *desc)
{
    static const size_t vertices_each[] = {[GLB_TRIANGLES] = 3, [GLB_LINES] = 2, [GLB_POINTS] = 1};
    size_t corners = desc->indices ? desc->index_count : desc->vertex_count;
    if (!desc->positions || desc->vertex_count == 0 || desc->vertex_count > INT32_MAX)
        return error_set(&builder->failure, ERROR_INVALID_REQUEST,
                         "positions and vertex_count are required, vertex_count at most %d",
                         INT32_MAX);
    if (corners == 0 || corners > INT32_MAX || corners % vertices_each[desc->topology] != 0)
        return error_set(&builder->failure, ERROR_INVALID_REQUEST,
                         "%zu corners, must be a multiple of %zu", corners,
                         vertices_each[desc->topology]);
    return glb_check_id(builder, GLB_KIND_MATERIAL, desc->material, "primitive.material");
}

static json_t *primitive(struct glb_builder *builder, const struct glb_primitive_desc *desc)
{
    static const int modes[] = {[GLB_TRIANGLES] = 4, [GLB_LINES] = 1, [GLB_POINTS] = 0};
    json_t *object = glb_object(builder), *attributes = glb_object(builder);
    put_attribute(builder, attributes, "POSITION", desc->positions, desc->vertex_count, 3);
    put_attribute(builder, attributes, "NORMAL", desc->normals, desc->vertex_count, 3);
    put_attribute(builder, attributes, "TEXCOORD_0", desc->texcoords, desc->vertex_count, 2);
    put_attribute(builder, attributes, "TEXCOORD_1", desc->texcoords_1, desc->vertex_count, 2);
    put_attribute(builder, attributes, "COLOR_0", desc->colors, desc->vertex_count, 4);
    glb_put(builder, object, "attributes", attributes);
    if (desc->indices)
        put_indices(builder, object, desc);
    if (desc->material)
        glb_put(builder, object, "material", json_integer(desc->material - 1));
    if (desc->topology != GLB_TRIANGLES)
        glb_put(builder, object, "mode", json_integer(modes[desc->topology]));
    return object;
}

int glb_builder_add_mesh(struct glb_builder *builder, const char *name,
                         const struct glb_primitive_desc *primitives, size_t primitive_count)
{
    if (builder->failure.code != ERROR_NONE)
        return 0;
    if (primitive_count == 0)
        return error_set(&builder->failure, ERROR_INVALID_REQUEST, "mesh '%s' has no primitive",
                         name ? name : "");
    json_t *mesh = glb_object(builder), *array = json_array();
    glb_put_name(builder, mesh, name);
    for (size_t i = 0; i < primitive_count && builder->failure.code == ERROR_NONE; i++)
        if (!check_primitive(builder, &primitives[i]) ||
            json_array_append_new(array, primitive(builder, &primitives[i])) != 0)
            glb_fail_memory(builder);
    glb_put(builder, mesh, "primitives", array);
    if (builder->failure.code != ERROR_NONE)
        error_wrap(&builder->failure, "mesh '%s'", name ? name : "");
    return glb_append(builder, GLB_KIND_MESH, mesh);
}
