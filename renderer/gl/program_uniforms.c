/* SPDX-License-Identifier: MIT */
/* A table of uniforms by name, with open addressing. */
#include "renderer/gl/program_uniforms.h"

#include <assert.h>
#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NAME_BYTES = 48 }; /* with the index of an array's element; the longest in shaders/ has 21 */

struct uniform { /* name "": free */
    char name[NAME_BYTES];
    GLint location;
    uint32_t words; /* of value; 0: not set so far, so that it has what its shader says */
    uint32_t value[PROGRAM_UNIFORM_WORDS];
};

struct program_uniforms {
    size_t count, slots; /* slots: a power of two, more than half of them free */
    struct uniform *table;
};

/* FNV-1a: Fowler, Noll and Vo 1991. */
static uint32_t hash(const char *name)
{
    uint32_t value = 2166136261u;
    for (; *name; name++)
        value = (value ^ (unsigned char)*name) * 16777619u;
    return value;
}

/* The slot of the name, or a free one for it. */
static struct uniform *slot_of(const struct program_uniforms *uniforms, const char *name)
{
    size_t at = hash(name) & (uniforms->slots - 1);
    while (uniforms->table[at].name[0] && strcmp(uniforms->table[at].name, name) != 0)
        at = (at + 1) & (uniforms->slots - 1);
    return &uniforms->table[at];
}

static bool grow(struct program_uniforms *uniforms)
{
    struct program_uniforms grown = {.slots = uniforms->slots ? 2 * uniforms->slots : 32};
    grown.table = calloc(grown.slots, sizeof *grown.table);
    if (!grown.table)
        return false;
    for (size_t i = 0; i < uniforms->slots; i++)
        if (uniforms->table[i].name[0])
            *slot_of(&grown, uniforms->table[i].name) = uniforms->table[i];
    free(uniforms->table);
    grown.count = uniforms->count;
    *uniforms = grown;
    return true;
}

static bool add(struct program_uniforms *uniforms, GLuint program, const char *name)
{
    GLint location = glGetUniformLocation(program, name);
    if (location < 0) /* of a block */
        return true;
    if (2 * (uniforms->count + 1) > uniforms->slots && !grow(uniforms))
        return false;
    struct uniform *uniform = slot_of(uniforms, name);
    assert(strlen(name) < NAME_BYTES);
    memcpy(uniform->name, name, strlen(name) + 1);
    uniform->location = location;
    uniforms->count++;
    return true;
}

/* Adds each element of an array under its own name; the driver names only the first. */
static bool add_active(struct program_uniforms *uniforms, GLuint program, GLuint index)
{
    char name[NAME_BYTES] = "", element[NAME_BYTES + 16];
    GLint size = 0;
    GLenum type = 0;
    glGetActiveUniform(program, index, sizeof name, NULL, &size, &type, name);
    char *bracket = strchr(name, '[');
    if (!name[0] || !bracket)
        return !name[0] || add(uniforms, program, name);
    *bracket = 0;
    for (GLint i = 0; i < size; i++) {
        snprintf(element, sizeof element, "%s[%d]", name, i);
        if (!add(uniforms, program, element))
            return false;
    }
    return true;
}

struct program_uniforms *program_uniforms_create(uint32_t program, struct error *err)
{
    GLint count = 0;
    struct program_uniforms *uniforms = calloc(1, sizeof *uniforms);
    bool ok = uniforms && grow(uniforms);
    glGetProgramiv(program, GL_ACTIVE_UNIFORMS, &count);
    for (GLint i = 0; ok && i < count; i++)
        ok = add_active(uniforms, program, (GLuint)i);
    if (ok)
        return uniforms;
    program_uniforms_destroy(uniforms);
    error_set(err, ERROR_NO_MEMORY, "%d uniforms", count);
    return NULL;
}

void program_uniforms_destroy(struct program_uniforms *uniforms)
{
    if (uniforms)
        free(uniforms->table);
    free(uniforms);
}

int32_t program_uniforms_change(struct program_uniforms *uniforms, const char *name,
                                const void *value, uint32_t words)
{
    struct uniform *uniform = slot_of(uniforms, name);
    assert(words <= PROGRAM_UNIFORM_WORDS);
    if (!uniform->name[0] ||
        (uniform->words == words && !memcmp(uniform->value, value, words * sizeof(uint32_t))))
        return -1;
    memcpy(uniform->value, value, words * sizeof(uint32_t));
    uniform->words = words;
    return uniform->location;
}
