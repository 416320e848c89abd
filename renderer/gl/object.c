/* SPDX-License-Identifier: MIT */
/* Buffers, textures, framebuffers, vertex arrays and samplers: creation, labels and destruction of
 * GL names. */
#include "renderer/gl/object.h"

#include <assert.h>
#include <epoxy/gl.h>
#include <string.h>

static void set_label(GLenum kind, GLuint name, const char *label)
{
    assert(label && *label);
    glObjectLabel(kind, name, -1, label);
}

enum { CHECKED_BYTES = 1 << 20 }; /* what scenes and views make large is larger, or soon grows */

/* Asking for errors waits for threads of the driver: small storages leave it to gl_context_check.
 * Another error than the one looked for is not lost either. */
static bool check_memory(const char *label, uint64_t size_bytes, struct error *err)
{
    GLenum problem = size_bytes < CHECKED_BYTES ? GL_NO_ERROR : glGetError();
    if (problem == GL_NO_ERROR)
        return true;
    if (problem == GL_OUT_OF_MEMORY)
        return error_set(err, ERROR_NO_MEMORY, "the device has no %llu bytes for '%s'",
                         (unsigned long long)size_bytes, label);
    return error_set(err, problem == GL_CONTEXT_LOST ? ERROR_NO_DEVICE : ERROR_INTERNAL,
                     "GL error 0x%x until '%s' was made", problem, label);
}

/* A little more than was asked for: llvmpipe compiles a program anew where a buffer that it samples
 * becomes one whose size is a power of two, or has no bit in 8 to 15 (which it reads as a level of
 * a texture), and anew where it is none any more. No storage below 1 MiB that is made to be filled
 * is either. */
static uint64_t storage_bytes(uint64_t size_bytes)
{
    bool is_power = !(size_bytes & (size_bytes - 1)), has_bits = size_bytes & 0xff00;
    if (size_bytes + 256 >= CHECKED_BYTES)
        return size_bytes; /* blocks of a device may have no room for more */
    return !has_bits ? size_bytes + 256 : is_power ? size_bytes + 16 : size_bytes;
}

bool gl_buffer_init(struct gl_buffer *buffer, const struct gl_buffer_desc *desc, struct error *err)
{
    assert(!buffer->name);
    uint64_t size = desc->size_bytes ? desc->size_bytes : 16;
    GLbitfield flags = (desc->is_dynamic || desc->is_uploaded ? GL_DYNAMIC_STORAGE_BIT : 0u) |
                       (desc->is_mappable ? GL_MAP_READ_BIT | GL_CLIENT_STORAGE_BIT : 0u);
    glCreateBuffers(1, &buffer->name);
    set_label(GL_BUFFER, buffer->name, desc->label);
    const void *data = desc->size_bytes ? desc->data : NULL;
    glNamedBufferStorage(buffer->name, (GLsizeiptr)(data ? size : storage_bytes(size)), data,
                         flags);
    buffer->size_bytes = size;
    buffer->is_uploaded = desc->is_uploaded;
    buffer->storage++;
    if (!check_memory(desc->label, size, err)) {
        gl_buffer_finish(buffer);
        return false;
    }
    return true;
}

void gl_buffer_finish(struct gl_buffer *buffer)
{
    if (buffer->name)
        glDeleteBuffers(1, &buffer->name);
    *buffer = (struct gl_buffer){.storage = buffer->storage};
}

uint64_t gl_buffer_reserved_bytes(const struct gl_buffer *buffer, uint64_t bytes)
{
    uint64_t half_again = buffer->size_bytes + buffer->size_bytes / 2;
    if (buffer->name && buffer->size_bytes >= bytes)
        return buffer->size_bytes;
    return buffer->name && bytes < half_again ? (half_again + 255) & ~255ull : bytes;
}

bool gl_buffer_reserve(struct gl_buffer *buffer, const struct gl_buffer_desc *desc, bool keep,
                       struct error *err)
{
    if (buffer->name && buffer->size_bytes >= desc->size_bytes)
        return true;
    struct gl_buffer_desc grown = *desc;
    grown.size_bytes = gl_buffer_reserved_bytes(buffer, desc->size_bytes);
    grown.data = NULL;
    if (!keep)
        gl_buffer_finish(buffer);
    struct gl_buffer fresh = {.storage = buffer->storage};
    if (!gl_buffer_init(&fresh, &grown, err))
        return false;
    if (buffer->name)
        gl_buffer_copy(buffer, 0, &fresh, 0, buffer->size_bytes);
    gl_buffer_finish(buffer);
    *buffer = fresh;
    return true;
}

/* Before GL itself reads or writes a buffer. */
static void await_shaders(const struct gl_buffer *buffer)
{
    if (!buffer->is_uploaded)
        glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
}

void gl_buffer_write(struct gl_buffer *buffer, uint64_t offset_bytes, uint64_t size_bytes,
                     const void *data)
{
    assert(offset_bytes + size_bytes <= buffer->size_bytes);
    if (!size_bytes)
        return;
    await_shaders(buffer);
    glNamedBufferSubData(buffer->name, (GLintptr)offset_bytes, (GLsizeiptr)size_bytes, data);
}

void gl_buffer_read(const struct gl_buffer *buffer, uint64_t offset_bytes, uint64_t size_bytes,
                    void *data)
{
    assert(offset_bytes + size_bytes <= buffer->size_bytes);
    if (!size_bytes)
        return;
    await_shaders(buffer);
    glGetNamedBufferSubData(buffer->name, (GLintptr)offset_bytes, (GLsizeiptr)size_bytes, data);
}

void gl_buffer_clear_u32(struct gl_buffer *buffer, uint64_t offset_bytes, uint64_t size_bytes,
                         uint32_t value)
{
    assert(offset_bytes + size_bytes <= buffer->size_bytes && size_bytes % 4 == 0);
    if (!size_bytes)
        return;
    /* shaders that write there again wait for those of the frame before, which may still read */
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
    glClearNamedBufferSubData(buffer->name, GL_R32UI, (GLintptr)offset_bytes,
                              (GLsizeiptr)size_bytes, GL_RED_INTEGER, GL_UNSIGNED_INT, &value);
}

void gl_buffer_copy(const struct gl_buffer *from, uint64_t from_bytes, struct gl_buffer *to,
                    uint64_t to_bytes, uint64_t size_bytes)
{
    assert(from_bytes + size_bytes <= from->size_bytes && to_bytes + size_bytes <= to->size_bytes);
    if (!size_bytes)
        return;
    await_shaders(from->is_uploaded ? to : from);
    glCopyNamedBufferSubData(from->name, to->name, (GLintptr)from_bytes, (GLintptr)to_bytes,
                             (GLsizeiptr)size_bytes);
}

void gl_buffer_bind_storage(const struct gl_buffer *buffer, uint32_t binding)
{
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, buffer->name);
}

void gl_buffer_bind_storage_range(const struct gl_buffer *buffer, uint64_t offset_bytes,
                                  uint64_t size_bytes, uint32_t binding)
{
    assert(offset_bytes < buffer->size_bytes && offset_bytes % GL_BUFFER_ALIGNMENT == 0);
    uint64_t most = buffer->size_bytes - offset_bytes;
    glBindBufferRange(GL_SHADER_STORAGE_BUFFER, binding, buffer->name, (GLintptr)offset_bytes,
                      (GLsizeiptr)(size_bytes && size_bytes < most ? size_bytes : most));
}

void gl_buffer_bind_uniform(const struct gl_buffer *buffer, uint64_t offset_bytes,
                            uint64_t size_bytes, uint32_t binding)
{
    assert(offset_bytes + size_bytes <= buffer->size_bytes);
    assert(offset_bytes % GL_BUFFER_ALIGNMENT == 0);
    glBindBufferRange(GL_UNIFORM_BUFFER, binding, buffer->name, (GLintptr)offset_bytes,
                      (GLsizeiptr)size_bytes);
}

const void *gl_buffer_map(const struct gl_buffer *buffer, uint64_t size_bytes)
{
    assert(size_bytes <= buffer->size_bytes);
    return glMapNamedBufferRange(buffer->name, 0, (GLsizeiptr)size_bytes, GL_MAP_READ_BIT);
}

bool gl_buffer_unmap(const struct gl_buffer *buffer)
{
    return glUnmapNamedBuffer(buffer->name);
}

void gl_fence_set(struct gl_fence *fence)
{
    assert(!fence->sync);
    fence->sync = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
    glFlush();
}

bool gl_fence_wait(const struct gl_fence *fence, uint64_t timeout_ns)
{
    return !fence->sync || glClientWaitSync(fence->sync, 0, timeout_ns) != GL_TIMEOUT_EXPIRED;
}

void gl_fence_finish(struct gl_fence *fence)
{
    if (fence->sync)
        glDeleteSync(fence->sync);
    *fence = (struct gl_fence){0};
}

static uint64_t format_texel_bytes(GLenum format)
{
    switch (format) {
    case GL_RGBA32F:
    case GL_RGBA32UI:
        return 16;
    case GL_RGB32F:
        return 12;
    case GL_RG32UI:
    case GL_RG32F:
    case GL_RGBA16F:
        return 8;
    case GL_STENCIL_INDEX8:
        return 1;
    default:
        return 4;
    }
}

static void allocate_texture(const struct gl_texture *texture)
{
    GLsizei w = texture->width, h = texture->height;
    switch (texture->target) {
    case GL_TEXTURE_2D_MULTISAMPLE:
        glTextureStorage2DMultisample(texture->name, texture->samples, texture->format, w, h,
                                      GL_TRUE);
        break;
    case GL_TEXTURE_2D_ARRAY:
        glTextureStorage3D(texture->name, texture->levels, texture->format, w, h, texture->layers);
        break;
    default:
        glTextureStorage2D(texture->name, texture->levels, texture->format, w, h);
        break;
    }
}

bool gl_texture_init(struct gl_texture *texture, const struct gl_texture_desc *desc,
                     struct error *err)
{
    assert(!texture->name && desc->width > 0 && desc->height > 0);
    *texture = (struct gl_texture){
        .format = desc->format,
        .width = desc->width,
        .height = desc->height,
        .layers = desc->layers,
        .levels = desc->levels ? desc->levels : 1,
        .samples = desc->samples,
        .target = desc->samples  ? GL_TEXTURE_2D_MULTISAMPLE
                  : desc->layers ? GL_TEXTURE_2D_ARRAY
                                 : GL_TEXTURE_2D,
    };
    texture->size_bytes = format_texel_bytes(desc->format) * (uint64_t)desc->width *
                          (uint64_t)desc->height * (uint64_t)(desc->layers ? desc->layers : 1) *
                          (uint64_t)(desc->samples ? desc->samples : 1);
    if (texture->levels > 1)
        texture->size_bytes += texture->size_bytes / 3;
    glCreateTextures(texture->target, 1, &texture->name);
    set_label(GL_TEXTURE, texture->name, desc->label);
    allocate_texture(texture);
    if (!desc->samples) {
        glTextureParameteri(texture->name, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
        glTextureParameteri(texture->name, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    }
    if (!check_memory(desc->label, texture->size_bytes, err)) {
        gl_texture_finish(texture);
        return false;
    }
    return true;
}

bool gl_texture_init_buffer(struct gl_texture *texture, const char *label, uint32_t format,
                            const struct gl_buffer *buffer, struct error *err)
{
    assert(!texture->name);
    GLint max_texels = 0;
    glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &max_texels);
    uint64_t texel_bytes = format_texel_bytes(format), texels = buffer->size_bytes / texel_bytes;
    if (texels > (uint64_t)max_texels)
        return error_set(err, ERROR_OVER_BUDGET, "'%s' has %llu texels, the device reads %d", label,
                         (unsigned long long)texels, max_texels);
    *texture = (struct gl_texture){
        .target = GL_TEXTURE_BUFFER, .format = format, .storage = buffer->storage};
    glCreateTextures(GL_TEXTURE_BUFFER, 1, &texture->name);
    set_label(GL_TEXTURE, texture->name, label);
    /* what storage_bytes adds is shown, too, where the device reads so many */
    if (buffer->size_bytes + 256 <= (uint64_t)max_texels * texel_bytes)
        glTextureBuffer(texture->name, format, buffer->name);
    else
        glTextureBufferRange(texture->name, format, buffer->name, 0,
                             (GLsizeiptr)(texels * texel_bytes));
    return true;
}

bool gl_texture_follow_buffer(struct gl_texture *view, const char *label, uint32_t format,
                              const struct gl_buffer *buffer, struct error *err)
{
    assert(!view->name || view->format == format);
    if (view->name && view->storage == buffer->storage)
        return true;
    gl_texture_finish(view);
    return gl_texture_init_buffer(view, label, format, buffer, err);
}

void gl_texture_finish(struct gl_texture *texture)
{
    if (texture->name)
        glDeleteTextures(1, &texture->name);
    *texture = (struct gl_texture){0};
}

void gl_texture_bind(const struct gl_texture *texture, uint32_t unit)
{
    glBindTextureUnit(unit, texture->name);
}

static void attach(GLuint name, GLenum attachment, const struct gl_texture *texture,
                   const struct gl_framebuffer_desc *desc)
{
    if (texture->layers > 0 && !desc->is_layered)
        glNamedFramebufferTextureLayer(name, attachment, texture->name, 0, desc->layer);
    else
        glNamedFramebufferTexture(name, attachment, texture->name, 0);
}

static void set_empty_size(GLuint name, const struct gl_framebuffer_desc *desc)
{
    glNamedFramebufferParameteri(name, GL_FRAMEBUFFER_DEFAULT_WIDTH, desc->width);
    glNamedFramebufferParameteri(name, GL_FRAMEBUFFER_DEFAULT_HEIGHT, desc->height);
    glNamedFramebufferParameteri(name, GL_FRAMEBUFFER_DEFAULT_SAMPLES, desc->samples);
    glNamedFramebufferParameteri(name, GL_FRAMEBUFFER_DEFAULT_FIXED_SAMPLE_LOCATIONS, 1);
}

bool gl_framebuffer_init(struct gl_framebuffer *framebuffer, const struct gl_framebuffer_desc *desc,
                         struct error *err)
{
    assert(!framebuffer->name);
    glCreateFramebuffers(1, &framebuffer->name);
    GLuint name = framebuffer->name;
    set_label(GL_FRAMEBUFFER, name, desc->label);
    enum { COLORS_MAX = sizeof desc->colors / sizeof *desc->colors };
    GLenum draw_buffers[COLORS_MAX];
    int colors = 0;
    for (; colors < COLORS_MAX && desc->colors[colors]; colors++) {
        draw_buffers[colors] = GL_COLOR_ATTACHMENT0 + (GLenum)colors;
        attach(name, draw_buffers[colors], desc->colors[colors], desc);
    }
    if (colors)
        glNamedFramebufferDrawBuffers(name, colors, draw_buffers);
    else
        glNamedFramebufferDrawBuffer(name, GL_NONE);
    if (desc->depth)
        attach(name, GL_DEPTH_ATTACHMENT, desc->depth, desc);
    if (desc->stencil)
        attach(name, GL_STENCIL_ATTACHMENT, desc->stencil, desc);
    if (!colors && !desc->depth && !desc->stencil)
        set_empty_size(name, desc);
    GLenum status = glCheckNamedFramebufferStatus(name, GL_FRAMEBUFFER);
    if (status != GL_FRAMEBUFFER_COMPLETE) {
        gl_framebuffer_finish(framebuffer);
        return error_set(err, ERROR_INTERNAL, "framebuffer '%s' is incomplete (0x%x)", desc->label,
                         status);
    }
    return true;
}

void gl_framebuffer_finish(struct gl_framebuffer *framebuffer)
{
    if (framebuffer->name)
        glDeleteFramebuffers(1, &framebuffer->name);
    *framebuffer = (struct gl_framebuffer){0};
}

void gl_framebuffer_apply_clears(void)
{
    glFlush();
}

void gl_disable_fragment_stages(void)
{
    static const GLenum stages[] = {GL_BLEND,
                                    GL_SCISSOR_TEST,
                                    GL_STENCIL_TEST,
                                    GL_POLYGON_OFFSET_FILL,
                                    GL_DEPTH_CLAMP,
                                    GL_SAMPLE_ALPHA_TO_COVERAGE,
                                    GL_RASTERIZER_DISCARD};
    for (size_t i = 0; i < sizeof stages / sizeof *stages; i++)
        glDisable(stages[i]);
}

void gl_vertex_array_init(struct gl_vertex_array *array, const char *label)
{
    assert(!array->name);
    glCreateVertexArrays(1, &array->name);
    set_label(GL_VERTEX_ARRAY, array->name, label);
}

void gl_vertex_array_finish(struct gl_vertex_array *array)
{
    if (array->name)
        glDeleteVertexArrays(1, &array->name);
    *array = (struct gl_vertex_array){0};
}

void gl_sampler_init(struct gl_sampler *sampler, const struct gl_sampler_desc *desc)
{
    assert(!sampler->name);
    glCreateSamplers(1, &sampler->name);
    set_label(GL_SAMPLER, sampler->name, desc->label);
    glSamplerParameteri(sampler->name, GL_TEXTURE_MAG_FILTER, (GLint)desc->mag_filter);
    glSamplerParameteri(sampler->name, GL_TEXTURE_MIN_FILTER, (GLint)desc->min_filter);
    glSamplerParameteri(sampler->name, GL_TEXTURE_WRAP_S, (GLint)desc->wrap_s);
    glSamplerParameteri(sampler->name, GL_TEXTURE_WRAP_T, (GLint)desc->wrap_t);
}

void gl_sampler_finish(struct gl_sampler *sampler)
{
    if (sampler->name)
        glDeleteSamplers(1, &sampler->name);
    *sampler = (struct gl_sampler){0};
}
