/* SPDX-License-Identifier: MIT */
/* Vertices and indices of a scene on the GPU, and the arrays that programs read them through. */
#include <epoxy/gl.h>
#include <stdlib.h>

#include "renderer/draw/scene_gpu_internal.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

/* Buffers are bound by each submission. */
void scene_gpu_format_instances(uint32_t vao)
{
    glEnableVertexArrayAttrib(vao, ATTRIBUTE_INSTANCE);
    glVertexArrayAttribIFormat(vao, ATTRIBUTE_INSTANCE, 2, GL_UNSIGNED_INT, 0);
    glVertexArrayAttribBinding(vao, ATTRIBUTE_INSTANCE, BINDING_INSTANCES);
    glVertexArrayBindingDivisor(vao, BINDING_INSTANCES, 1);
}

void scene_gpu_format_records(uint32_t vao)
{
    enum { WORDS = sizeof(struct draw_record) / 16 };
    for (GLuint i = 0; i < WORDS; i++) {
        GLuint attribute = ATTRIBUTE_DRAW + i;
        glEnableVertexArrayAttrib(vao, attribute);
        if (16 * i == offsetof(struct draw_record, material))
            glVertexArrayAttribIFormat(vao, attribute, 4, GL_UNSIGNED_INT, 16 * i);
        else
            glVertexArrayAttribFormat(vao, attribute, 4, GL_FLOAT, GL_FALSE, 16 * i);
        glVertexArrayAttribBinding(vao, attribute, BINDING_RECORDS);
    }
    glVertexArrayBindingDivisor(vao, BINDING_RECORDS, 1);
    scene_gpu_format_instances(vao);
}

static bool upload(struct scene_geometry *geometry, struct gl_buffer *buffer,
                   const struct gl_buffer_desc *desc, struct error *err)
{
    geometry->size_bytes += desc->size_bytes;
    return gl_buffer_init(buffer, desc, err);
}

static bool upload_stream(struct scene_geometry *geometry, enum vertex_stream stream,
                          struct error *err)
{
    static const char *const labels[] = {"scene.positions",   "scene.normals",     "scene.tangents",
                                         "scene.texcoords_0", "scene.texcoords_1", "scene.colors"};
    struct gl_buffer_desc desc = {.label = labels[stream]};
    void *made = NULL;
    desc.size_bytes = vertex_layout_stream_bytes(&geometry->layout, stream);
    if (!desc.size_bytes)
        return true;
    desc.data = vertex_layout_borrow(&geometry->layout, stream);
    if (!desc.data) {
        made = malloc(desc.size_bytes);
        if (!made)
            return error_set(err, ERROR_NO_MEMORY, "vertices of %llu bytes",
                             (unsigned long long)desc.size_bytes);
        vertex_layout_write(&geometry->layout, stream, made);
        desc.data = made;
    }
    bool ok = upload(geometry, &geometry->streams[stream], &desc, err);
    free(made);
    return ok;
}

static bool upload_indices(struct scene_geometry *geometry, struct error *err)
{
    struct gl_buffer_desc desc = {.label = "scene.indices"};
    desc.size_bytes = vertex_layout_index_bytes(&geometry->layout);
    if (!desc.size_bytes)
        return true;
    void *indices = malloc(desc.size_bytes);
    if (!indices)
        return error_set(err, ERROR_NO_MEMORY, "indices of %llu bytes",
                         (unsigned long long)desc.size_bytes);
    vertex_layout_write_indices(&geometry->layout, indices);
    desc.data = indices;
    bool ok = upload(geometry, &geometry->indices, &desc, err);
    free(indices);
    return ok;
}

/* Sets the format of a stream in an array, whose binding has its number. */
static void set_format(const struct scene_geometry *geometry, GLuint vao, enum vertex_stream stream)
{
    static const GLenum types[] = {[VERTEX_F32] = GL_FLOAT,
                                   [VERTEX_U8] = GL_UNSIGNED_BYTE,
                                   [VERTEX_I8] = GL_BYTE,
                                   [VERTEX_U16] = GL_UNSIGNED_SHORT,
                                   [VERTEX_I16] = GL_SHORT};
    const struct vertex_format *format = &geometry->layout.formats[stream];
    glEnableVertexArrayAttrib(vao, stream);
    glVertexArrayAttribFormat(vao, stream, (GLint)format->components, types[format->type],
                              format->is_normalized, 0);
    glVertexArrayAttribBinding(vao, stream, stream);
}

static void add_stream(struct scene_geometry *geometry, GLuint vao, enum vertex_stream stream)
{
    if (!geometry->streams[stream].name)
        return;
    set_format(geometry, vao, stream);
    glVertexArrayVertexBuffer(vao, stream, geometry->streams[stream].name, 0,
                              (GLsizei)geometry->layout.formats[stream].stride_bytes);
}

static void create_array(struct scene_geometry *geometry, uint32_t set)
{
    gl_vertex_array_init(&geometry->arrays[set], "scene");
    GLuint vao = geometry->arrays[set].name;
    for (int s = 0; s < VERTEX_STREAM_COUNT; s++)
        if (s < VERTEX_TANGENT || set >> (s - VERTEX_TANGENT) & 1)
            add_stream(geometry, vao, (enum vertex_stream)s);
    glVertexArrayElementBuffer(vao, geometry->indices.name);
    scene_gpu_format_records(vao);
}

/* Of primitives in a pose. deform_gpu_bind attaches the buffers. */
static void create_deformed_array(struct scene_geometry *geometry, uint32_t set)
{
    gl_vertex_array_init(&geometry->deformed[set], "scene.deformed");
    GLuint vao = geometry->deformed[set].name;
    for (uint32_t s = 0; s < VERTEX_STREAM_COUNT; s++) {
        if (s >= VERTEX_TANGENT && !(set >> (s - VERTEX_TANGENT) & 1))
            continue;
        if (s > VERTEX_TANGENT) {
            set_format(geometry, vao, (enum vertex_stream)s);
            continue;
        }
        glEnableVertexArrayAttrib(vao, s);
        glVertexArrayAttribFormat(vao, s, s == VERTEX_TANGENT ? 4 : 3, GL_FLOAT, GL_FALSE, 0);
        glVertexArrayAttribBinding(vao, s, s);
    }
    glVertexArrayElementBuffer(vao, geometry->indices.name);
    scene_gpu_format_records(vao);
}

bool scene_geometry_init(struct scene_geometry *geometry, const struct scene *scene,
                         struct error *err)
{
    static const float absent[VERTEX_STREAM_COUNT][4] = {
        [VERTEX_NORMAL] = {0, 0, 1}, [VERTEX_COLOR] = {1, 1, 1, 1}};
    if (!vertex_layout_init(&geometry->layout, scene, err))
        return false;
    for (int s = 0; s < VERTEX_STREAM_COUNT; s++) {
        glVertexAttrib4fv((GLuint)s, absent[s]);
        if (!upload_stream(geometry, (enum vertex_stream)s, err))
            return false;
    }
    if (!upload_indices(geometry, err))
        return false;
    for (uint32_t set = 0; set <= VERTEX_OPTIONALS; set++)
        if (!(set & ~geometry->layout.optionals)) {
            create_array(geometry, set);
            if (scene->deformed_node_count)
                create_deformed_array(geometry, set);
        }
    return true;
}

void scene_geometry_finish(struct scene_geometry *geometry)
{
    for (int s = 0; s < VERTEX_STREAM_COUNT; s++)
        gl_buffer_finish(&geometry->streams[s]);
    gl_buffer_finish(&geometry->indices);
    for (uint32_t set = 0; set <= VERTEX_OPTIONALS; set++) {
        gl_vertex_array_finish(&geometry->arrays[set]);
        gl_vertex_array_finish(&geometry->deformed[set]);
    }
    vertex_layout_finish(&geometry->layout);
    *geometry = (struct scene_geometry){.size_bytes = 0};
}
