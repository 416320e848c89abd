/* SPDX-License-Identifier: MIT */
/* The access tracker: two commands that touch the same bytes, one of them writing from a shader,
 * need a glMemoryBarrier between them, with the bit that names how the second one comes to the
 * memory (OpenGL 4.5, 7.13.2). What glFinish orders by the way is not believed: it is called to
 * measure, where timers lie, and not elsewhere. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/gl_access_allowed.h"
#include "tests/support/gl_layers.h"
#include "tests/support/gl_mirror.h"

struct gl_access {
    const struct gl_shape *program; /* of a shader's access, which alone are kept */
    enum gl_way way;
    bool is_write;
    uint64_t begin, end;
    uint64_t time;
};

static struct {
    struct gl_functions next;
    uint64_t time;                   /* commands so far */
    uint64_t barriers[GL_WAY_COUNT]; /* time of the last one of each kind */
} tracker;

/* What a barrier's bit is called, and how a command that lacks it comes to the memory. */
static const struct {
    GLbitfield bit;
    const char *name, *how;
} ways[GL_WAY_COUNT] = {
    [GL_WAY_STORAGE] = {GL_SHADER_STORAGE_BARRIER_BIT, "SHADER_STORAGE", "in a storage block"},
    [GL_WAY_FETCH] = {GL_TEXTURE_FETCH_BARRIER_BIT, "TEXTURE_FETCH", "as a texture"},
    [GL_WAY_IMAGE] = {GL_SHADER_IMAGE_ACCESS_BARRIER_BIT, "SHADER_IMAGE_ACCESS", "as an image"},
    [GL_WAY_UNIFORM] = {GL_UNIFORM_BARRIER_BIT, "UNIFORM", "in a uniform block"},
    [GL_WAY_ATTRIBUTE] = {GL_VERTEX_ATTRIB_ARRAY_BARRIER_BIT, "VERTEX_ATTRIB_ARRAY",
                          "as vertex attributes"},
    [GL_WAY_ELEMENT] = {GL_ELEMENT_ARRAY_BARRIER_BIT, "ELEMENT_ARRAY", "as vertex indices"},
    [GL_WAY_COMMAND] = {GL_COMMAND_BARRIER_BIT, "COMMAND", "as draw commands"},
    [GL_WAY_BUFFER] = {GL_BUFFER_UPDATE_BARRIER_BIT, "BUFFER_UPDATE", "as a buffer"},
    [GL_WAY_PIXEL] = {GL_PIXEL_BUFFER_BARRIER_BIT, "PIXEL_BUFFER", "as a pixel buffer"},
    [GL_WAY_TEXTURE] = {GL_TEXTURE_UPDATE_BARRIER_BIT, "TEXTURE_UPDATE", "as a texture's texels"},
    [GL_WAY_TARGET] = {GL_FRAMEBUFFER_BARRIER_BIT, "FRAMEBUFFER", "as a framebuffer"},
};

/* ---- one access after another ---- */

static bool is_of_shaders(enum gl_way way)
{
    return way == GL_WAY_STORAGE || way == GL_WAY_IMAGE;
}

static void describe(char *out, size_t size, const struct gl_shape *program, const char *command)
{
    if (!program)
        snprintf(out, size, "%s", command);
    else if (program->variant[0])
        snprintf(out, size, "%s (%s)", program->label, program->variant);
    else
        snprintf(out, size, "%s", program->label);
}

static void report(const struct gl_access *before, const struct gl_touch *touch, bool is_write,
                   const struct gl_shape *program, const char *command)
{
    char first[640], second[640];
    const struct gl_object *object = touch->object;
    describe(first, sizeof first, before->program, "");
    describe(second, sizeof second, program, command);
    if (gl_access_is_allowed(&(struct gl_pair){.first = first,
                                               .second = second,
                                               .object = object->label,
                                               .first_writes = before->is_write,
                                               .second_writes = is_write}))
        return;
    gl_fault("%s: %s %s '%s' %s, then %s %s it %s: %s_BARRIER_BIT is missing in between",
             !before->is_write ? "write after read"
             : is_write        ? "write after write"
                               : "read after write",
             first, before->is_write ? "writes" : "reads", object->label, ways[before->way].how,
             second, is_write ? "writes" : "reads", ways[touch->way].how, ways[touch->way].name);
}

static void check(const struct gl_touch *touch, bool is_write, const struct gl_shape *program,
                  const char *command)
{
    const struct gl_object *object = touch->object;
    for (int i = 0; i < object->access_count; i++) {
        const struct gl_access *before = &object->accesses[i];
        bool is_apart = before->end <= touch->begin || touch->end <= before->begin;
        bool is_harmless = !before->is_write && !(is_write && is_of_shaders(touch->way));
        if (!is_apart && !is_harmless && tracker.barriers[touch->way] <= before->time)
            report(before, touch, is_write, program, command);
    }
}

static void keep(const struct gl_touch *touch, bool is_write, const struct gl_shape *program)
{
    struct gl_object *object = touch->object;
    const struct gl_access fresh = {program,      touch->way, is_write,
                                    touch->begin, touch->end, tracker.time};
    for (int i = 0; i < object->access_count; i++) {
        struct gl_access *old = &object->accesses[i];
        if (old->program == program && old->way == touch->way && old->is_write == is_write &&
            old->begin == touch->begin && old->end == touch->end) {
            *old = fresh;
            return;
        }
    }
    if (object->access_count == object->access_capacity) {
        object->access_capacity = object->access_capacity ? 2 * object->access_capacity : 8;
        object->accesses =
            realloc(object->accesses, (size_t)object->access_capacity * sizeof fresh);
        if (!object->accesses)
            abort();
    }
    object->accesses[object->access_count++] = fresh;
}

/* A draw's or dispatch's. Its own accesses are one another's business. */
static void follow(const struct gl_touches *touches)
{
    const struct gl_shape *program = gl_mirror_program(gl_mirror_state()->program);
    if (!program)
        return;
    for (int i = 0; i < touches->count; i++) {
        const struct gl_touch *touch = &touches->items[i];
        if (touch->view && touch->object->is_gone)
            gl_fault("'%s' reads '%s', which shows the buffer '%s' that was deleted",
                     program->label, touch->view->label, touch->object->label);
        if (touch->reads)
            check(touch, false, program, NULL);
        if (touch->writes)
            check(touch, true, program, NULL);
    }
    tracker.time++;
    for (int i = 0; i < touches->count; i++) {
        const struct gl_touch *touch = &touches->items[i];
        if (touch->reads)
            keep(touch, false, program);
        if (touch->writes && is_of_shaders(touch->way))
            keep(touch, true, program);
    }
}

/* What GL writes itself replaces what shaders did there before. */
static void forget(struct gl_object *object, uint64_t begin, uint64_t end)
{
    int kept = 0;
    for (int i = 0; i < object->access_count; i++)
        if (object->accesses[i].begin < begin || object->accesses[i].end > end)
            object->accesses[kept++] = object->accesses[i];
    object->access_count = kept;
}

/* A command of GL, which orders itself among its kind. */
static void transfer(struct gl_object *object, enum gl_way way, bool is_write, uint64_t begin,
                     uint64_t size, const char *command)
{
    if (!object)
        return;
    const struct gl_touch touch = {
        .object = object, .way = way, .begin = begin, .end = begin + size};
    check(&touch, is_write, NULL, command);
    if (is_write)
        forget(object, begin, begin + size);
}

static void touch_texture(GLuint texture, enum gl_way way, bool is_write, const char *command)
{
    struct gl_object *object = gl_mirror_texture(texture);
    const struct gl_touch touch = {.object = object, .way = way, .end = 1};
    if (object)
        check(&touch, is_write, NULL, command); /* of a part, perhaps: nothing is forgotten */
}

/* ---- commands ---- */

static void follow_dispatch(void)
{
    struct gl_touches touches = {.count = 0};
    gl_mirror_add_program(&touches);
    follow(&touches);
}

static void follow_draw(bool has_elements, bool has_commands)
{
    struct gl_touches touches = {.count = 0};
    gl_mirror_add_program(&touches);
    gl_mirror_add_draw(&touches, has_elements, has_commands);
    follow(&touches);
}

static void GLAPIENTRY on_DispatchCompute(GLuint x, GLuint y, GLuint z)
{
    follow_dispatch();
    tracker.next.DispatchCompute(x, y, z);
}

static void GLAPIENTRY on_DispatchComputeIndirect(GLintptr indirect)
{
    const struct gl_object *commands = gl_mirror_state()->commands;
    if (commands)
        transfer(gl_mirror_buffer(commands->name), GL_WAY_COMMAND, false, (uint64_t)indirect, 12,
                 "glDispatchComputeIndirect");
    follow_dispatch();
    tracker.next.DispatchComputeIndirect(indirect);
}

static void GLAPIENTRY on_DrawArrays(GLenum mode, GLint first, GLsizei n)
{
    follow_draw(false, false);
    tracker.next.DrawArrays(mode, first, n);
}

static void GLAPIENTRY on_DrawArraysInstanced(GLenum mode, GLint first, GLsizei n,
                                              GLsizei instances)
{
    follow_draw(false, false);
    tracker.next.DrawArraysInstanced(mode, first, n, instances);
}

static void GLAPIENTRY on_DrawArraysInstancedBaseInstance(GLenum mode, GLint first, GLsizei n,
                                                          GLsizei instances, GLuint base)
{
    follow_draw(false, false);
    tracker.next.DrawArraysInstancedBaseInstance(mode, first, n, instances, base);
}

static void GLAPIENTRY on_MultiDrawElementsIndirect(GLenum mode, GLenum type, const void *indirect,
                                                    GLsizei n, GLsizei stride)
{
    follow_draw(true, true);
    tracker.next.MultiDrawElementsIndirect(mode, type, indirect, n, stride);
}

static void GLAPIENTRY on_MemoryBarrier(GLbitfield bits)
{
    tracker.time++;
    for (int way = 0; way < GL_WAY_COUNT; way++)
        if (bits & ways[way].bit)
            tracker.barriers[way] = tracker.time;
    tracker.next.MemoryBarrier(bits);
}

static void GLAPIENTRY on_NamedBufferSubData(GLuint buffer, GLintptr offset, GLsizeiptr size,
                                             const void *data)
{
    transfer(gl_mirror_buffer(buffer), GL_WAY_BUFFER, true, (uint64_t)offset, (uint64_t)size,
             "glNamedBufferSubData");
    tracker.next.NamedBufferSubData(buffer, offset, size, data);
}

static void GLAPIENTRY on_ClearNamedBufferSubData(GLuint buffer, GLenum internal, GLintptr offset,
                                                  GLsizeiptr size, GLenum format, GLenum type,
                                                  const void *data)
{
    transfer(gl_mirror_buffer(buffer), GL_WAY_BUFFER, true, (uint64_t)offset, (uint64_t)size,
             "glClearNamedBufferSubData");
    tracker.next.ClearNamedBufferSubData(buffer, internal, offset, size, format, type, data);
}

static void GLAPIENTRY on_CopyNamedBufferSubData(GLuint from, GLuint to, GLintptr from_offset,
                                                 GLintptr to_offset, GLsizeiptr size)
{
    transfer(gl_mirror_buffer(from), GL_WAY_BUFFER, false, (uint64_t)from_offset, (uint64_t)size,
             "glCopyNamedBufferSubData");
    transfer(gl_mirror_buffer(to), GL_WAY_BUFFER, true, (uint64_t)to_offset, (uint64_t)size,
             "glCopyNamedBufferSubData");
    tracker.next.CopyNamedBufferSubData(from, to, from_offset, to_offset, size);
}

static void GLAPIENTRY on_GetNamedBufferSubData(GLuint buffer, GLintptr offset, GLsizeiptr size,
                                                void *data)
{
    transfer(gl_mirror_buffer(buffer), GL_WAY_BUFFER, false, (uint64_t)offset, (uint64_t)size,
             "glGetNamedBufferSubData");
    tracker.next.GetNamedBufferSubData(buffer, offset, size, data);
}

static void *GLAPIENTRY on_MapNamedBufferRange(GLuint buffer, GLintptr offset, GLsizeiptr size,
                                               GLbitfield access)
{
    transfer(gl_mirror_buffer(buffer), GL_WAY_BUFFER, (access & GL_MAP_WRITE_BIT) != 0,
             (uint64_t)offset, (uint64_t)size, "glMapNamedBufferRange");
    return tracker.next.MapNamedBufferRange(buffer, offset, size, access);
}

static void GLAPIENTRY on_GetTextureSubImage(GLuint texture, GLint level, GLint x, GLint y, GLint z,
                                             GLsizei width, GLsizei height, GLsizei depth,
                                             GLenum format, GLenum type, GLsizei size, void *pixels)
{
    struct gl_object *pack = gl_mirror_state()->pack;
    touch_texture(texture, GL_WAY_TEXTURE, false, "glGetTextureSubImage");
    transfer(pack, GL_WAY_PIXEL, true, (uint64_t)(uintptr_t)pixels, (uint64_t)size,
             "glGetTextureSubImage");
    tracker.next.GetTextureSubImage(texture, level, x, y, z, width, height, depth, format, type,
                                    size, pixels);
}

static void GLAPIENTRY on_TextureSubImage2D(GLuint texture, GLint level, GLint x, GLint y,
                                            GLsizei width, GLsizei height, GLenum format,
                                            GLenum type, const void *pixels)
{
    touch_texture(texture, GL_WAY_TEXTURE, true, "glTextureSubImage2D");
    tracker.next.TextureSubImage2D(texture, level, x, y, width, height, format, type, pixels);
}

static void GLAPIENTRY on_CopyImageSubData(GLuint from, GLenum from_target, GLint from_level,
                                           GLint from_x, GLint from_y, GLint from_z, GLuint to,
                                           GLenum to_target, GLint to_level, GLint to_x, GLint to_y,
                                           GLint to_z, GLsizei width, GLsizei height, GLsizei depth)
{
    touch_texture(from, GL_WAY_TEXTURE, false, "glCopyImageSubData");
    touch_texture(to, GL_WAY_TEXTURE, true, "glCopyImageSubData");
    tracker.next.CopyImageSubData(from, from_target, from_level, from_x, from_y, from_z, to,
                                  to_target, to_level, to_x, to_y, to_z, width, height, depth);
}

static void GLAPIENTRY on_ClearTexSubImage(GLuint texture, GLint level, GLint x, GLint y, GLint z,
                                           GLsizei width, GLsizei height, GLsizei depth,
                                           GLenum format, GLenum type, const void *value)
{
    touch_texture(texture, GL_WAY_TEXTURE, true, "glClearTexSubImage");
    tracker.next.ClearTexSubImage(texture, level, x, y, z, width, height, depth, format, type,
                                  value);
}

static void touch_targets(GLuint framebuffer, bool is_write, const char *command)
{
    const struct gl_attachments *target = gl_mirror_framebuffer(framebuffer);
    for (int i = 0; target && i < GL_ATTACHMENTS; i++)
        if (target->textures[i])
            touch_texture(target->textures[i]->name, GL_WAY_TARGET, is_write, command);
}

static void GLAPIENTRY on_ClearNamedFramebufferfv(GLuint framebuffer, GLenum buffer, GLint index,
                                                  const GLfloat *value)
{
    touch_targets(framebuffer, true, "glClearNamedFramebufferfv");
    tracker.next.ClearNamedFramebufferfv(framebuffer, buffer, index, value);
}

static void GLAPIENTRY on_ClearNamedFramebufferuiv(GLuint framebuffer, GLenum buffer, GLint index,
                                                   const GLuint *value)
{
    touch_targets(framebuffer, true, "glClearNamedFramebufferuiv");
    tracker.next.ClearNamedFramebufferuiv(framebuffer, buffer, index, value);
}

/* ---- what is not followed ---- */

/* Functions that touch no memory that shaders write, by the beginnings of their names; textures
 * that are compressed are written by their uploads alone. */
static bool touches_nothing(const char *function)
{
    static const char *const beginnings[] = {
        "glActive",
        "glAttach",
        "glBegin",
        "glBind",
        "glBlend",
        "glBlit",
        "glCheck",
        "glClientWait",
        "glClipControl",
        "glColorMask",
        "glCompile",
        "glCompressed",
        "glCreate",
        "glCull",
        "glDebug",
        "glDelete",
        "glDepth",
        "glDetach",
        "glDisable",
        "glEnable",
        "glEnd",
        "glFence",
        "glFinish",
        "glFlush",
        "glFrontFace",
        "glGetActive",
        "glGetError",
        "glGetGraphics",
        "glGetInteger",
        "glGetMultisample",
        "glGetNamedBufferParameter",
        "glGetObjectLabel",
        "glGetProgram",
        "glGetQuery",
        "glGetShader",
        "glGetString",
        "glGetSync",
        "glGetTextureLevel",
        "glGetUniform",
        "glInvalidate",
        "glIsEnabled",
        "glLink",
        "glMaxShader",
        "glNamedFramebuffer",
        "glNamedBufferStorage",
        "glObject",
        "glPixel",
        "glPoint",
        "glPolygon",
        "glPop",
        "glProgram",
        "glPush",
        "glQuery",
        "glSampler",
        "glScissor",
        "glShader",
        "glTextureBarrier",
        "glTextureBuffer",
        "glTextureParameter",
        "glTextureStorage",
        "glUnmap",
        "glUse",
        "glValidate",
        "glVertex",
        "glViewport",
        "glGenerate",
        "glGetTextureImage",
        "glLineWidth",
        "glStencil",
        "glLogic",
    };
    for (size_t i = 0; i < sizeof beginnings / sizeof *beginnings; i++)
        if (!strncmp(function, beginnings[i], strlen(beginnings[i])))
            return true;
    return false;
}

#define UNKNOWN_VOID(type, name, params, args)                                                  \
    static void GLAPIENTRY unknown_##name params                                                \
    {                                                                                           \
        gl_fault("gl%s touches memory in a way that tests/support/gl_access.c does not follow", \
                 #name);                                                                        \
        tracker.next.name args;                                                                 \
    }
#define UNKNOWN_VALUE(type, name, params, args)                                                 \
    static type GLAPIENTRY unknown_##name params                                                \
    {                                                                                           \
        gl_fault("gl%s touches memory in a way that tests/support/gl_access.c does not follow", \
                 #name);                                                                        \
        return tracker.next.name args;                                                          \
    }
GL_TABLE(UNKNOWN_VOID, UNKNOWN_VALUE)

/* ---- installation ---- */

void gl_access_install(struct gl_functions *functions)
{
    memset(&tracker, 0, sizeof tracker);
    tracker.next = *functions;
    tracker.time = 1;
#define FOLLOWED(type, name, params, args) \
    if (!touches_nothing("gl" #name))      \
        functions->name = unknown_##name;
    GL_TABLE(FOLLOWED, FOLLOWED)
#undef FOLLOWED
#define HOOK(name) functions->name = on_##name
    HOOK(DispatchCompute);
    HOOK(DispatchComputeIndirect);
    HOOK(DrawArrays);
    HOOK(DrawArraysInstanced);
    HOOK(DrawArraysInstancedBaseInstance);
    HOOK(MultiDrawElementsIndirect);
    HOOK(MemoryBarrier);
    HOOK(NamedBufferSubData);
    HOOK(ClearNamedBufferSubData);
    HOOK(CopyNamedBufferSubData);
    HOOK(GetNamedBufferSubData);
    HOOK(MapNamedBufferRange);
    HOOK(GetTextureSubImage);
    HOOK(TextureSubImage2D);
    HOOK(CopyImageSubData);
    HOOK(ClearTexSubImage);
    HOOK(ClearNamedFramebufferfv);
    HOOK(ClearNamedFramebufferuiv);
#undef HOOK
}
