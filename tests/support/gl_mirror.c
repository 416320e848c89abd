/* SPDX-License-Identifier: MIT */
/* The mirror of GL's bindings and objects. What programs touch is in gl_shape.c. */
#include "tests/support/gl_mirror.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/gl_layers.h"
#include "tests/support/gl_shape.h"

enum { NAMES = 1 << 16 }; /* larger names are not followed */

static struct {
    struct gl_functions next;
    struct gl_mirror state;
    struct gl_object *buffers[NAMES], *textures[NAMES], *newest;
    struct gl_shape *programs[NAMES], *gone;
    struct gl_vertex_streams *arrays[NAMES];
    struct gl_attachments *framebuffers[NAMES];
} mirror;

const struct gl_mirror *gl_mirror_state(void)
{
    return &mirror.state;
}

struct gl_object *gl_mirror_buffer(GLuint name)
{
    return name < NAMES ? mirror.buffers[name] : NULL;
}

struct gl_object *gl_mirror_texture(GLuint name)
{
    return name < NAMES ? mirror.textures[name] : NULL;
}

struct gl_shape *gl_mirror_program(GLuint name)
{
    return name < NAMES ? mirror.programs[name] : NULL;
}

const struct gl_attachments *gl_mirror_framebuffer(GLuint name)
{
    return name < NAMES ? mirror.framebuffers[name] : NULL;
}

static void *make(size_t size)
{
    void *made = calloc(1, size);
    assert(made);
    return made;
}

/* In the place of one that is deleted, whose name is given again. */
static void *make_again(void *old, size_t size)
{
    return old ? memset(old, 0, size) : make(size);
}

/* ---- objects ---- */

static void create_objects(struct gl_object **table, bool is_texture, GLsizei n,
                           const GLuint *names)
{
    for (GLsizei i = 0; i < n; i++) {
        if (names[i] >= NAMES)
            continue;
        struct gl_object *object = make(sizeof *object);
        object->name = names[i];
        object->is_texture = is_texture;
        object->older = mirror.newest;
        mirror.newest = object;
        table[names[i]] = object;
    }
}

static void forget_slots(struct gl_slot *slots, int count, const struct gl_object *object)
{
    for (int i = 0; i < count; i++)
        if (slots[i].object == object)
            slots[i] = (struct gl_slot){0};
}

static void forget(struct gl_object **place, const struct gl_object *object)
{
    if (*place == object)
        *place = NULL;
}

/* Deletion unbinds; a texture of the buffer keeps its memory, which nobody else can reach. */
static void delete_objects(struct gl_object **table, GLsizei n, const GLuint *names)
{
    struct gl_mirror *state = &mirror.state;
    for (GLsizei i = 0; i < n; i++) {
        struct gl_object *object = names[i] < NAMES ? table[names[i]] : NULL;
        if (!object)
            continue;
        forget_slots(state->storage, GL_UNITS, object);
        forget_slots(state->uniforms, GL_UNITS, object);
        forget_slots(state->images, GL_IMAGES, object);
        for (int k = 0; k < GL_UNITS; k++)
            forget(&state->textures[k], object);
        forget(&state->pack, object);
        forget(&state->unpack, object);
        forget(&state->commands, object);
        object->is_gone = true;
        table[names[i]] = NULL;
    }
}

static void GLAPIENTRY on_CreateBuffers(GLsizei n, GLuint *names)
{
    mirror.next.CreateBuffers(n, names);
    create_objects(mirror.buffers, false, n, names);
}

static void GLAPIENTRY on_DeleteBuffers(GLsizei n, const GLuint *names)
{
    delete_objects(mirror.buffers, n, names);
    mirror.next.DeleteBuffers(n, names);
}

static void GLAPIENTRY on_NamedBufferStorage(GLuint buffer, GLsizeiptr size, const void *data,
                                             GLbitfield flags)
{
    struct gl_object *object = gl_mirror_buffer(buffer);
    if (object)
        object->size_bytes = (uint64_t)size;
    mirror.next.NamedBufferStorage(buffer, size, data, flags);
}

static void GLAPIENTRY on_CreateTextures(GLenum target, GLsizei n, GLuint *names)
{
    mirror.next.CreateTextures(target, n, names);
    create_objects(mirror.textures, true, n, names);
}

static void GLAPIENTRY on_DeleteTextures(GLsizei n, const GLuint *names)
{
    delete_objects(mirror.textures, n, names);
    mirror.next.DeleteTextures(n, names);
}

static void show(GLuint texture, GLuint buffer, uint64_t begin, uint64_t size)
{
    struct gl_object *object = gl_mirror_texture(texture);
    if (!object)
        return;
    object->source = gl_mirror_buffer(buffer);
    object->source_begin = begin;
    object->source_end = begin + size;
}

static void GLAPIENTRY on_TextureBuffer(GLuint texture, GLenum format, GLuint buffer)
{
    struct gl_object *source = gl_mirror_buffer(buffer);
    show(texture, buffer, 0, source ? source->size_bytes : 0);
    mirror.next.TextureBuffer(texture, format, buffer);
}

static void GLAPIENTRY on_TextureBufferRange(GLuint texture, GLenum format, GLuint buffer,
                                             GLintptr offset, GLsizeiptr size)
{
    show(texture, buffer, (uint64_t)offset, (uint64_t)size);
    mirror.next.TextureBufferRange(texture, format, buffer, offset, size);
}

static char *label_of(GLenum kind, GLuint name)
{
    if (name >= NAMES)
        return NULL;
    if (kind == GL_BUFFER && mirror.buffers[name])
        return mirror.buffers[name]->label;
    if (kind == GL_TEXTURE && mirror.textures[name])
        return mirror.textures[name]->label;
    if (kind == GL_PROGRAM && mirror.programs[name])
        return mirror.programs[name]->label;
    if (kind == GL_FRAMEBUFFER && mirror.framebuffers[name])
        return mirror.framebuffers[name]->label;
    return NULL;
}

static void GLAPIENTRY on_ObjectLabel(GLenum kind, GLuint name, GLsizei length, const GLchar *label)
{
    char *out = label_of(kind, name);
    if (out)
        snprintf(out, GL_LABEL_BYTES, "%s", label);
    mirror.next.ObjectLabel(kind, name, length, label);
}

/* ---- bindings ---- */

static void bind_slot(GLenum target, GLuint index, GLuint buffer, uint64_t begin, uint64_t size)
{
    struct gl_slot *slots = target == GL_SHADER_STORAGE_BUFFER ? mirror.state.storage
                            : target == GL_UNIFORM_BUFFER      ? mirror.state.uniforms
                                                               : NULL;
    if (slots && index < GL_UNITS)
        slots[index] = (struct gl_slot){
            .object = gl_mirror_buffer(buffer), .begin = begin, .end = begin + size};
}

static void GLAPIENTRY on_BindBufferBase(GLenum target, GLuint index, GLuint buffer)
{
    const struct gl_object *object = gl_mirror_buffer(buffer);
    bind_slot(target, index, buffer, 0, object ? object->size_bytes : 0);
    mirror.next.BindBufferBase(target, index, buffer);
}

static void GLAPIENTRY on_BindBufferRange(GLenum target, GLuint index, GLuint buffer,
                                          GLintptr offset, GLsizeiptr size)
{
    bind_slot(target, index, buffer, (uint64_t)offset, (uint64_t)size);
    mirror.next.BindBufferRange(target, index, buffer, offset, size);
}

static void GLAPIENTRY on_BindBuffer(GLenum target, GLuint buffer)
{
    struct gl_object *object = gl_mirror_buffer(buffer);
    if (target == GL_PIXEL_PACK_BUFFER)
        mirror.state.pack = object;
    if (target == GL_PIXEL_UNPACK_BUFFER)
        mirror.state.unpack = object;
    if (target == GL_DRAW_INDIRECT_BUFFER || target == GL_DISPATCH_INDIRECT_BUFFER)
        mirror.state.commands = object;
    mirror.next.BindBuffer(target, buffer);
}

static void GLAPIENTRY on_BindTextureUnit(GLuint unit, GLuint texture)
{
    if (unit < GL_UNITS)
        mirror.state.textures[unit] = gl_mirror_texture(texture);
    mirror.next.BindTextureUnit(unit, texture);
}

static void GLAPIENTRY on_BindSampler(GLuint unit, GLuint sampler)
{
    if (unit < GL_UNITS)
        mirror.state.samplers[unit] = sampler;
    mirror.next.BindSampler(unit, sampler);
}

/* Units let go of what is deleted (OpenGL 4.5 core profile, 8.2). */
static void GLAPIENTRY on_DeleteSamplers(GLsizei count, const GLuint *names)
{
    for (GLsizei i = 0; i < count; i++)
        for (int unit = 0; unit < GL_UNITS; unit++)
            if (mirror.state.samplers[unit] == names[i])
                mirror.state.samplers[unit] = 0;
    mirror.next.DeleteSamplers(count, names);
}

static void GLAPIENTRY on_BindImageTexture(GLuint unit, GLuint texture, GLint level,
                                           GLboolean layered, GLint layer, GLenum access,
                                           GLenum format)
{
    if (unit < GL_IMAGES)
        mirror.state.images[unit] = (struct gl_slot){.object = gl_mirror_texture(texture),
                                                     .end = 1,
                                                     .level = level,
                                                     .layer = layer,
                                                     .is_layered = layered,
                                                     .access = access,
                                                     .format = format};
    mirror.next.BindImageTexture(unit, texture, level, layered, layer, access, format);
}

static void GLAPIENTRY on_BindVertexArray(GLuint array)
{
    mirror.state.vertex_array = array;
    mirror.next.BindVertexArray(array);
}

static void GLAPIENTRY on_BindFramebuffer(GLenum target, GLuint framebuffer)
{
    if (target != GL_READ_FRAMEBUFFER)
        mirror.state.framebuffer = framebuffer;
    mirror.next.BindFramebuffer(target, framebuffer);
}

/* ---- vertex arrays and framebuffers ---- */

static void GLAPIENTRY on_CreateVertexArrays(GLsizei n, GLuint *names)
{
    mirror.next.CreateVertexArrays(n, names);
    for (GLsizei i = 0; i < n; i++)
        if (names[i] < NAMES)
            mirror.arrays[names[i]] = make_again(mirror.arrays[names[i]], sizeof **mirror.arrays);
}

static void GLAPIENTRY on_VertexArrayVertexBuffer(GLuint array, GLuint index, GLuint buffer,
                                                  GLintptr offset, GLsizei stride)
{
    if (array < NAMES && mirror.arrays[array] && index < GL_STREAMS - 1)
        mirror.arrays[array]->buffers[index] = gl_mirror_buffer(buffer);
    mirror.next.VertexArrayVertexBuffer(array, index, buffer, offset, stride);
}

static void GLAPIENTRY on_VertexArrayElementBuffer(GLuint array, GLuint buffer)
{
    if (array < NAMES && mirror.arrays[array])
        mirror.arrays[array]->buffers[GL_STREAMS - 1] = gl_mirror_buffer(buffer);
    mirror.next.VertexArrayElementBuffer(array, buffer);
}

static void GLAPIENTRY on_CreateFramebuffers(GLsizei n, GLuint *names)
{
    mirror.next.CreateFramebuffers(n, names);
    for (GLsizei i = 0; i < n; i++)
        if (names[i] < NAMES)
            mirror.framebuffers[names[i]] =
                make_again(mirror.framebuffers[names[i]], sizeof **mirror.framebuffers);
}

static void attach(GLuint framebuffer, GLenum attachment, GLuint texture)
{
    struct gl_attachments *attachments =
        framebuffer < NAMES ? mirror.framebuffers[framebuffer] : NULL;
    GLuint index = attachment - GL_COLOR_ATTACHMENT0;
    if (attachments)
        attachments->textures[index < GL_ATTACHMENTS - 1 ? index : GL_ATTACHMENTS - 1] =
            gl_mirror_texture(texture);
}

static void GLAPIENTRY on_NamedFramebufferTexture(GLuint framebuffer, GLenum attachment,
                                                  GLuint texture, GLint level)
{
    attach(framebuffer, attachment, texture);
    mirror.next.NamedFramebufferTexture(framebuffer, attachment, texture, level);
}

static void GLAPIENTRY on_NamedFramebufferTextureLayer(GLuint framebuffer, GLenum attachment,
                                                       GLuint texture, GLint level, GLint layer)
{
    attach(framebuffer, attachment, texture);
    mirror.next.NamedFramebufferTextureLayer(framebuffer, attachment, texture, level, layer);
}

/* ---- programs ---- */

static void GLAPIENTRY on_ShaderSource(GLuint shader, GLsizei count, const GLchar *const *text,
                                       const GLint *length)
{
    gl_shape_set_source(shader, count, text, length);
    mirror.next.ShaderSource(shader, count, text, length);
}

static void GLAPIENTRY on_AttachShader(GLuint program, GLuint shader)
{
    gl_shape_attach(program, shader);
    mirror.next.AttachShader(program, shader);
}

static void replace_program(GLuint name, struct gl_shape *shape)
{
    if (name >= NAMES)
        return;
    struct gl_shape *gone = mirror.programs[name]; /* commands that are held may still use it */
    if (gone) {
        gone->older = mirror.gone;
        mirror.gone = gone;
    }
    mirror.programs[name] = shape;
}

static void GLAPIENTRY on_LinkProgram(GLuint program)
{
    mirror.next.LinkProgram(program);
    replace_program(program, gl_shape_of_linked(&mirror.next, program));
}

static void GLAPIENTRY on_GetProgramBinary(GLuint program, GLsizei size, GLsizei *length,
                                           GLenum *format, void *binary)
{
    GLsizei written = 0;
    mirror.next.GetProgramBinary(program, size, &written, format, binary);
    if (length)
        *length = written;
    if (gl_mirror_program(program))
        gl_shape_keep(gl_mirror_program(program), binary, written);
}

static void GLAPIENTRY on_ProgramBinary(GLuint program, GLenum format, const void *binary,
                                        GLsizei length)
{
    mirror.next.ProgramBinary(program, format, binary, length);
    replace_program(program, gl_shape_of_binary(&mirror.next, program, binary, length));
}

static void GLAPIENTRY on_ProgramUniform1i(GLuint program, GLint location, GLint value)
{
    struct gl_shape *shape = gl_mirror_program(program);
    for (int i = 0; shape && i < shape->resource_count; i++)
        if (location >= 0 && shape->resources[i].location == location)
            shape->resources[i].binding = value;
    mirror.next.ProgramUniform1i(program, location, value);
}

static void GLAPIENTRY on_DeleteProgram(GLuint program)
{
    replace_program(program, NULL);
    mirror.next.DeleteProgram(program);
}

static void GLAPIENTRY on_UseProgram(GLuint program)
{
    mirror.state.program = program;
    mirror.next.UseProgram(program);
}

/* ---- what commands touch ---- */

static void add(struct gl_touches *touches, const struct gl_touch *touch)
{
    assert(touches->count < GL_TOUCHES);
    if (touch->object)
        touches->items[touches->count++] = *touch;
}

static void add_slot(struct gl_touches *touches, const struct gl_resource *resource,
                     const struct gl_slot *slot)
{
    bool is_image = resource->way == GL_WAY_IMAGE;
    add(touches, &(struct gl_touch){
                     .object = slot->object,
                     .way = resource->way,
                     .reads = resource->reads && (!is_image || slot->access != GL_WRITE_ONLY),
                     .writes = resource->writes && (!is_image || slot->access != GL_READ_ONLY),
                     .begin = slot->begin,
                     .end = slot->end,
                 });
}

static void add_texture(struct gl_touches *touches, struct gl_object *texture)
{
    struct gl_touch touch = {.object = texture, .way = GL_WAY_FETCH, .reads = true, .end = 1};
    if (texture && texture->source) {
        touch.object = texture->source;
        touch.view = texture;
        touch.begin = texture->source_begin;
        touch.end = texture->source_end;
    }
    add(touches, &touch);
}

void gl_mirror_add_program(struct gl_touches *touches)
{
    const struct gl_mirror *state = &mirror.state;
    const struct gl_shape *shape = gl_mirror_program(state->program);
    for (int i = 0; shape && i < shape->resource_count; i++) {
        const struct gl_resource *resource = &shape->resources[i];
        for (GLint k = resource->binding; k < resource->binding + resource->count; k++) {
            if (k < 0 || k >= (resource->way == GL_WAY_IMAGE ? (GLint)GL_IMAGES : GL_UNITS))
                continue;
            if (resource->way == GL_WAY_FETCH)
                add_texture(touches, state->textures[k]);
            else
                add_slot(touches, resource,
                         resource->way == GL_WAY_STORAGE   ? &state->storage[k]
                         : resource->way == GL_WAY_UNIFORM ? &state->uniforms[k]
                                                           : &state->images[k]);
        }
    }
}

static void add_whole(struct gl_touches *touches, struct gl_object *object, enum gl_way way,
                      bool writes)
{
    add(touches, &(struct gl_touch){.object = object,
                                    .way = way,
                                    .reads = !writes,
                                    .writes = writes,
                                    .end = object ? object->size_bytes + object->is_texture : 0});
}

void gl_mirror_add_draw(struct gl_touches *touches, bool has_elements, bool has_commands)
{
    const struct gl_mirror *state = &mirror.state;
    const struct gl_attachments *target = gl_mirror_framebuffer(state->framebuffer);
    const struct gl_vertex_streams *streams =
        state->vertex_array < NAMES ? mirror.arrays[state->vertex_array] : NULL;
    for (int i = 0; streams && i < GL_STREAMS - 1; i++)
        add_whole(touches, streams->buffers[i], GL_WAY_ATTRIBUTE, false);
    if (streams && has_elements)
        add_whole(touches, streams->buffers[GL_STREAMS - 1], GL_WAY_ELEMENT, false);
    if (has_commands)
        add_whole(touches, state->commands, GL_WAY_COMMAND, false);
    for (int i = 0; target && i < GL_ATTACHMENTS; i++)
        add_whole(touches, target->textures[i], GL_WAY_TARGET, true);
}

/* ---- installation ---- */

void gl_mirror_install(struct gl_functions *functions)
{
    mirror.next = *functions;
#define HOOK(name) functions->name = on_##name
    HOOK(CreateBuffers);
    HOOK(DeleteBuffers);
    HOOK(NamedBufferStorage);
    HOOK(CreateTextures);
    HOOK(DeleteTextures);
    HOOK(TextureBuffer);
    HOOK(TextureBufferRange);
    HOOK(ObjectLabel);
    HOOK(BindBufferBase);
    HOOK(BindBufferRange);
    HOOK(BindBuffer);
    HOOK(BindTextureUnit);
    HOOK(BindSampler);
    HOOK(DeleteSamplers);
    HOOK(BindImageTexture);
    HOOK(BindVertexArray);
    HOOK(BindFramebuffer);
    HOOK(CreateVertexArrays);
    HOOK(VertexArrayVertexBuffer);
    HOOK(VertexArrayElementBuffer);
    HOOK(CreateFramebuffers);
    HOOK(NamedFramebufferTexture);
    HOOK(NamedFramebufferTextureLayer);
    HOOK(ShaderSource);
    HOOK(AttachShader);
    HOOK(LinkProgram);
    HOOK(GetProgramBinary);
    HOOK(ProgramBinary);
    HOOK(ProgramUniform1i);
    HOOK(DeleteProgram);
    HOOK(UseProgram);
#undef HOOK
}
