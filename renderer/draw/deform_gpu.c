/* SPDX-License-Identifier: MIT */
/* Vertices in a pose on the device. An item keeps its place in the buffers as long as those before
 * it are the same, and goes up when its pose is another. */
#include <epoxy/gl.h>
#include <stdlib.h>

#include "renderer/draw/scene_gpu_internal.h"

enum { STREAMS = 3 };
static const GLsizei strides[STREAMS] = {12, 12, 16};

void deform_gpu_finish(struct deform_gpu *gpu)
{
    for (int s = 0; s < STREAMS; s++)
        gl_buffer_finish(&gpu->streams[s]);
    free(gpu->ranges);
    *gpu = (struct deform_gpu){.ranges = NULL};
}

/* Room for all vertices; what was there is gone where a buffer had to grow. */
static bool reserve(struct deform_gpu *gpu, const struct state_deforms *deforms, struct error *err)
{
    static const char *const labels[STREAMS] = {"deformed.positions", "deformed.normals",
                                                "deformed.tangents"};
    for (int s = 0; s < STREAMS; s++) {
        struct gl_buffer *stream = &gpu->streams[s];
        uint32_t storage = stream->storage;
        struct gl_buffer_desc desc = {.label = labels[s],
                                      .size_bytes =
                                          (uint64_t)deforms->vertex_count * (uint64_t)strides[s],
                                      .is_uploaded = true};
        if (s == VERTEX_TANGENT && !deforms->tangents)
            continue;
        if (!gl_buffer_reserve(stream, &desc, false, err))
            return false;
        if (stream->storage != storage)
            gpu->count = 0;
    }
    struct deform_range *ranges = realloc(gpu->ranges, (deforms->count + 1) * sizeof *ranges);
    if (!ranges)
        return error_set(err, ERROR_NO_MEMORY, "%zu drawables that deform", deforms->count);
    gpu->ranges = ranges;
    return true;
}

static bool is_there(const struct deform_gpu *gpu, size_t index, const struct deform_range *range)
{
    const struct deform_range *old = &gpu->ranges[index];
    return index < gpu->count && content_key_equals(old->pose, range->pose) &&
           old->scene_serial == range->scene_serial && old->primitive == range->primitive &&
           old->first_vertex == range->first_vertex && old->vertex_count == range->vertex_count;
}

static void upload(struct deform_gpu *gpu, const struct state_deforms *deforms,
                   const struct scene_primitive *p)
{
    const float *const arrays[STREAMS] = {deforms->positions, deforms->normals, deforms->tangents};
    for (int s = 0; s < STREAMS; s++) {
        uint64_t stride = (uint64_t)strides[s], offset = p->first_vertex * stride;
        if (s == VERTEX_TANGENT && !(p->flags & SCENE_PRIMITIVE_HAS_TANGENTS))
            continue;
        gl_buffer_write(&gpu->streams[s], offset, p->vertex_count * stride,
                        (const char *)arrays[s] + offset);
    }
}

bool deform_gpu_upload(struct deform_gpu *gpu, const struct state_deforms *deforms,
                       struct error *err)
{
    if (gpu->serial == deforms->serial || !deforms->count)
        return true;
    gpu->serial = 0; /* until all is there */
    if (!reserve(gpu, deforms, err))
        return false;
    for (size_t i = 0; i < deforms->count; i++) {
        const struct state_deformed *item = &deforms->items[i];
        const struct deform_range range = {.pose = item->pose,
                                           .scene_serial = item->scene_serial,
                                           .primitive = item->index,
                                           .first_vertex = item->primitive.first_vertex,
                                           .vertex_count = item->primitive.vertex_count};
        if (!is_there(gpu, i, &range))
            upload(gpu, deforms, &item->primitive);
        gpu->ranges[i] = range;
    }
    gpu->count = deforms->count;
    gpu->serial = deforms->serial;
    return true;
}

uint32_t deform_gpu_array(const struct scene_geometry *geometry, uint32_t flags)
{
    return geometry->deformed[geometry->layout.optionals & flags & VERTEX_OPTIONALS].name;
}

void deform_gpu_bind(const struct deform_gpu *gpu, const struct scene_geometry *geometry,
                     uint32_t array, uint32_t first_posed, uint32_t first_at_rest)
{
    GLuint buffers[VERTEX_STREAM_COUNT];
    GLintptr offsets[VERTEX_STREAM_COUNT];
    GLsizei sizes[VERTEX_STREAM_COUNT];
    if (!gpu) {
        glVertexArrayVertexBuffers(array, 0, VERTEX_STREAM_COUNT, NULL, NULL, NULL);
        return;
    }
    for (int s = 0; s < VERTEX_STREAM_COUNT; s++) {
        bool is_posed = s < STREAMS;
        buffers[s] = is_posed ? gpu->streams[s].name : geometry->streams[s].name;
        sizes[s] = is_posed ? strides[s] : (GLsizei)geometry->layout.formats[s].stride_bytes;
        offsets[s] = (GLintptr)(is_posed ? first_posed : first_at_rest) * sizes[s];
        if (!buffers[s])
            offsets[s] = sizes[s] = 0;
    }
    glVertexArrayVertexBuffers(array, 0, VERTEX_STREAM_COUNT, buffers, offsets, sizes);
}
