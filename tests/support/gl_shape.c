/* SPDX-License-Identifier: MIT */
/* Programs' resources and the qualifiers of their declarations. */
#include "tests/support/gl_shape.h"

#include <assert.h>
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NAMES = 1 << 16, STAGES = 3, BINARIES = 1024 };

struct kept {
    uint64_t hash;
    const struct gl_shape *shape;
};

static struct {
    char *sources[NAMES];           /* by shader */
    char *attached[NAMES][STAGES];  /* by program: copies */
    struct kept binaries[BINARIES]; /* a ring */
    unsigned kept;
} shapes;

void gl_shape_set_source(GLuint shader, GLsizei count, const GLchar *const *text,
                         const GLint *length)
{
    if (shader >= NAMES || count != 1 || length)
        return; /* the program cache gives one text that ends with NUL */
    free(shapes.sources[shader]);
    shapes.sources[shader] = strdup(text[0]);
}

void gl_shape_attach(GLuint program, GLuint shader)
{
    if (program >= NAMES || shader >= NAMES || !shapes.sources[shader])
        return;
    for (int i = 0; i < STAGES; i++) {
        if (shapes.attached[program][i])
            continue;
        shapes.attached[program][i] = strdup(shapes.sources[shader]);
        return;
    }
}

/* ---- the source ---- */

static bool is_word_at(const char *text, const char *at, size_t length)
{
    return (at == text || (!isalnum((unsigned char)at[-1]) && at[-1] != '_')) &&
           !isalnum((unsigned char)at[length]) && at[length] != '_';
}

static bool has_word(const char *begin, const char *end, const char *word)
{
    size_t length = strlen(word);
    for (const char *at = begin; (at = strstr(at, word)) && at < end; at += length)
        if (is_word_at(begin, at, length))
            return true;
    return false;
}

/* A declaration is where the name's line has the word `buffer` or `uniform` before it. */
static void narrow(const char *text, struct gl_resource *resource, bool *is_declared)
{
    size_t length = strlen(resource->name);
    for (const char *at = text; (at = strstr(at, resource->name)); at += length) {
        const char *line = at;
        while (line > text && line[-1] != '\n')
            line--;
        if (!is_word_at(text, at, length) ||
            (!has_word(line, at, "buffer") && !has_word(line, at, "uniform")))
            continue;
        if (!*is_declared)
            resource->reads = resource->writes = false;
        *is_declared = true;
        resource->reads |= !has_word(line, at, "writeonly");
        resource->writes |= !has_word(line, at, "readonly");
    }
}

static void read_qualifiers(struct gl_shape *shape, char *const texts[STAGES])
{
    for (int i = 0; i < shape->resource_count; i++) {
        struct gl_resource *resource = &shape->resources[i];
        bool is_declared = false;
        if (resource->way != GL_WAY_STORAGE && resource->way != GL_WAY_IMAGE)
            continue;
        for (int s = 0; s < STAGES; s++)
            if (texts[s])
                narrow(texts[s], resource, &is_declared);
    }
}

/* The defines are between #version and the first #line. */
static void read_variant(struct gl_shape *shape, const char *text)
{
    const char *end = text ? strstr(text, "#line") : NULL;
    size_t length = 0;
    for (const char *at = text; end && (at = strstr(at, "#define ")) && at < end;) {
        at += strlen("#define ");
        int size = (int)strcspn(at, "\n");
        if (length + (size_t)size + 2 > sizeof shape->variant)
            return;
        length += (size_t)sprintf(shape->variant + length, "%s%.*s", length ? ", " : "", size, at);
    }
}

/* ---- introspection ---- */

static bool is_image(GLint type)
{
    return type >= GL_IMAGE_1D && type <= GL_UNSIGNED_INT_IMAGE_2D_MULTISAMPLE_ARRAY;
}

static bool is_sampler(GLint type)
{
    return (type >= GL_SAMPLER_1D && type <= GL_SAMPLER_2D_RECT_SHADOW) ||
           (type >= GL_SAMPLER_1D_ARRAY && type <= GL_SAMPLER_CUBE_SHADOW) ||
           (type >= GL_INT_SAMPLER_1D && type <= GL_UNSIGNED_INT_SAMPLER_BUFFER) ||
           (type >= GL_SAMPLER_CUBE_MAP_ARRAY && type <= GL_UNSIGNED_INT_SAMPLER_CUBE_MAP_ARRAY) ||
           (type >= GL_SAMPLER_2D_MULTISAMPLE &&
            type <= GL_UNSIGNED_INT_SAMPLER_2D_MULTISAMPLE_ARRAY);
}

static struct gl_resource *add(struct gl_shape *shape, enum gl_way way)
{
    assert(shape->resource_count < GL_RESOURCES);
    struct gl_resource *resource = &shape->resources[shape->resource_count++];
    *resource = (struct gl_resource){.way = way, .location = -1, .count = 1, .reads = true};
    return resource;
}

static void read_name(const struct gl_functions *gl, GLenum interface, GLuint program, GLint index,
                      char name[GL_LABEL_BYTES])
{
    gl->GetProgramResourceName(program, interface, (GLuint)index, GL_LABEL_BYTES, NULL, name);
    name[strcspn(name, "[")] = 0;
}

static void read_blocks(const struct gl_functions *gl, struct gl_shape *shape, GLenum interface,
                        enum gl_way way)
{
    const GLenum property = GL_BUFFER_BINDING;
    GLint count = 0;
    gl->GetProgramInterfaceiv(shape->name, interface, GL_ACTIVE_RESOURCES, &count);
    for (GLint i = 0; i < count; i++) {
        struct gl_resource *resource = add(shape, way);
        resource->writes = way == GL_WAY_STORAGE;
        read_name(gl, interface, shape->name, i, resource->name);
        gl->GetProgramResourceiv(shape->name, interface, (GLuint)i, 1, &property, 1, NULL,
                                 &resource->binding);
    }
}

static void read_samplers(const struct gl_functions *gl, struct gl_shape *shape)
{
    static const GLenum properties[] = {GL_TYPE, GL_LOCATION, GL_ARRAY_SIZE};
    GLint count = 0;
    gl->GetProgramInterfaceiv(shape->name, GL_UNIFORM, GL_ACTIVE_RESOURCES, &count);
    for (GLint i = 0; i < count; i++) {
        GLint values[3] = {0};
        gl->GetProgramResourceiv(shape->name, GL_UNIFORM, (GLuint)i, 3, properties, 3, NULL,
                                 values);
        if (!is_image(values[0]) && !is_sampler(values[0]))
            continue;
        struct gl_resource *resource =
            add(shape, is_image(values[0]) ? GL_WAY_IMAGE : GL_WAY_FETCH);
        resource->writes = is_image(values[0]);
        resource->location = values[1];
        resource->count = values[2] > 0 ? values[2] : 1;
        read_name(gl, GL_UNIFORM, shape->name, i, resource->name);
        gl->GetUniformiv(shape->name, values[1], &resource->binding);
    }
}

static struct gl_shape *introspect(const struct gl_functions *gl, GLuint program)
{
    struct gl_shape *shape = calloc(1, sizeof *shape);
    assert(shape);
    GLint linked = 0;
    shape->name = program;
    gl->GetProgramiv(program, GL_LINK_STATUS, &linked);
    if (!linked)
        return shape;
    read_blocks(gl, shape, GL_SHADER_STORAGE_BLOCK, GL_WAY_STORAGE);
    read_blocks(gl, shape, GL_UNIFORM_BLOCK, GL_WAY_UNIFORM);
    read_samplers(gl, shape);
    return shape;
}

struct gl_shape *gl_shape_of_linked(const struct gl_functions *gl, GLuint program)
{
    struct gl_shape *shape = introspect(gl, program);
    if (program >= NAMES)
        return shape;
    char **texts = shapes.attached[program];
    read_qualifiers(shape, texts);
    read_variant(shape, texts[0]);
    for (int i = 0; i < STAGES; i++) {
        free(texts[i]);
        texts[i] = NULL;
    }
    return shape;
}

/* ---- binaries ---- */

/* Fowler, Noll, Vo 1991: FNV-1a of 64 bits. */
static uint64_t hash_of(const void *bytes, GLsizei length)
{
    uint64_t hash = 14695981039346656037ull;
    for (GLsizei i = 0; i < length; i++)
        hash = (hash ^ ((const unsigned char *)bytes)[i]) * 1099511628211ull;
    return hash;
}

void gl_shape_keep(const struct gl_shape *shape, const void *binary, GLsizei length)
{
    shapes.binaries[shapes.kept++ % BINARIES] = (struct kept){hash_of(binary, length), shape};
}

struct gl_shape *gl_shape_of_binary(const struct gl_functions *gl, GLuint program,
                                    const void *binary, GLsizei length)
{
    struct gl_shape *shape = introspect(gl, program);
    uint64_t hash = hash_of(binary, length);
    for (int i = 0; i < BINARIES; i++) {
        const struct gl_shape *kept = shapes.binaries[i].shape;
        if (!kept || shapes.binaries[i].hash != hash)
            continue;
        memcpy(shape->variant, kept->variant, sizeof shape->variant);
        memcpy(shape->resources, kept->resources, sizeof shape->resources);
        shape->resource_count = kept->resource_count;
    }
    return shape;
}
