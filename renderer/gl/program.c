/* SPDX-License-Identifier: MIT */
/* The program cache: keys, binaries and uniforms. Composition is in compose.c, compilation in
 * program_build.c. */
#include "renderer/gl/program.h"

#include <assert.h>
#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/wall_clock.h"
#include "renderer/gl/program_build.h"
#include "renderer/gl/program_source.h"
#include "renderer/gl/program_uniforms.h"

struct cached_program {
    struct gl_program program; /* name 0: it is being built */
    struct program_build build;
    char *key; /* owned */
};

struct program_cache {
    struct cached_program **entries; /* pointers, so that programs keep their address */
    size_t count, capacity;
    char *dump_dir;
    char device_defines[DEVICE_DEFINES_BYTES];
    struct program_store *store; /* borrowed; NULL: programs are compiled once a start */
    struct program_binary_hooks hooks;
    struct program_cache_stats stats;
};

/* A debugging aid: its failure must not fail the frame. */
static void dump_source(const struct program_cache *cache, const struct program_source *source)
{
    for (int i = 0; i < PROGRAM_STAGES; i++) {
        char path[512], name[PROGRAM_FILE_NAME_BYTES];
        if (!source->files[i])
            continue;
        program_source_file_name(source, i, name);
        snprintf(path, sizeof path, "%s/%s", cache->dump_dir, name);
        FILE *out = fopen(path, "w");
        if (!out)
            return;
        fputs(source->stages[i].text, out);
        fclose(out);
    }
}

/* ---- binaries ---- */

static bool has_format(uint32_t format)
{
    GLint formats[64] = {0}, count = 0;
    glGetIntegerv(GL_NUM_PROGRAM_BINARY_FORMATS, &count);
    if (count <= 0 || count > 64)
        return false;
    glGetIntegerv(GL_PROGRAM_BINARY_FORMATS, formats);
    for (int i = 0; i < count; i++)
        if ((uint32_t)formats[i] == format)
            return true;
    return false;
}

static bool get_binary(void *context, uint32_t program, struct program_binary *binary)
{
    (void)context;
    GLint size = 0;
    GLsizei written = 0;
    GLenum format = 0;
    glGetProgramiv(program, GL_PROGRAM_BINARY_LENGTH, &size);
    if (size <= 0 || size > PROGRAM_BINARY_BYTES_MAX || !(binary->bytes = malloc((size_t)size)))
        return false;
    glGetProgramBinary(program, size, &written, &format, binary->bytes);
    binary->format = format;
    binary->size_bytes = written > 0 ? (size_t)written : 0;
    return binary->size_bytes > 0;
}

/* A format that the driver does not name is an error of GL; bytes that it does not like are not. */
static bool load_binary(void *context, uint32_t program, const struct program_binary *binary)
{
    (void)context;
    GLint linked = 0;
    if (!has_format(binary->format))
        return false;
    glProgramBinary(program, binary->format, binary->bytes, (GLsizei)binary->size_bytes);
    glGetProgramiv(program, GL_LINK_STATUS, &linked);
    return linked;
}

void program_cache_set_store(struct program_cache *cache, struct program_store *store,
                             const struct program_binary_hooks *hooks)
{
    cache->store = store;
    cache->hooks =
        hooks ? *hooks : (struct program_binary_hooks){.get = get_binary, .load = load_binary};
}

/* 0: it must be compiled. */
static GLuint load_program(const struct program_cache *cache, const struct program_source *source)
{
    struct program_binary binary;
    if (!cache->store || !program_store_read(cache->store, source->key, &binary))
        return 0;
    GLuint program = glCreateProgram();
    bool is_good = cache->hooks.load(cache->hooks.context, program, &binary);
    program_binary_finish(&binary);
    if (is_good) {
        program_store_confirm(cache->store, source->key);
        return program;
    }
    program_store_drop(cache->store, source->key);
    glDeleteProgram(program);
    return 0;
}

static void keep_program(const struct program_cache *cache, const struct program_source *source,
                         GLuint program)
{
    struct program_binary binary = {0};
    if (cache->store && cache->hooks.get(cache->hooks.context, program, &binary))
        program_store_write(cache->store, source->key, &binary);
    program_binary_finish(&binary);
}

static uint32_t read_attributes(GLuint program)
{
    const GLenum property = GL_LOCATION;
    uint32_t attributes = 0;
    GLint count = 0;
    glGetProgramInterfaceiv(program, GL_PROGRAM_INPUT, GL_ACTIVE_RESOURCES, &count);
    for (GLint i = 0; i < count; i++) {
        GLint location = -1; /* of what the shader did not declare itself */
        glGetProgramResourceiv(program, GL_PROGRAM_INPUT, (GLuint)i, 1, &property, 1, NULL,
                               &location);
        if (location >= 0 && location < 32)
            attributes |= 1u << location;
    }
    return attributes;
}

static void destroy_entry(struct cached_program *entry)
{
    if (!entry)
        return;
    program_build_finish(&entry->build);
    glDeleteProgram(entry->program.name); /* 0 is ignored */
    program_uniforms_destroy(entry->program.uniforms);
    free(entry->key);
    free(entry);
}

/* ---- the cache ---- */

struct program_cache *program_cache_create(const char *dump_dir, struct error *err)
{
    struct program_cache *cache = calloc(1, sizeof *cache);
    if (cache && dump_dir)
        cache->dump_dir = strdup(dump_dir);
    if (!cache || (dump_dir && !cache->dump_dir)) {
        error_set(err, ERROR_NO_MEMORY, "program cache");
        program_cache_destroy(cache);
        return NULL;
    }
    return cache;
}

void program_cache_destroy(struct program_cache *cache)
{
    if (!cache)
        return;
    for (size_t i = 0; i < cache->count; i++)
        destroy_entry(cache->entries[i]);
    free(cache->entries);
    free(cache->dump_dir);
    free(cache);
}

void program_cache_set_device_defines(struct program_cache *cache, const char *defines)
{
    int length = snprintf(cache->device_defines, sizeof cache->device_defines, "%s", defines);
    assert(length < (int)sizeof cache->device_defines);
}

const char *program_cache_device_defines(const struct program_cache *cache)
{
    return cache->device_defines;
}

static char *make_key(const struct program_desc *desc)
{
    const char *const parts[] = {desc->vertex,   desc->tessellation[0], desc->tessellation[1],
                                 desc->geometry, desc->fragment,        desc->compute,
                                 desc->defines};
    size_t length = 0;
    char *key = NULL;
    FILE *out = open_memstream(&key, &length);
    for (size_t i = 0; out && i < sizeof parts / sizeof *parts; i++)
        fprintf(out, "%s|", parts[i] ? parts[i] : "");
    if (out && fclose(out) == 0)
        return key;
    free(key);
    return NULL;
}

static bool reserve_entry(struct program_cache *cache)
{
    if (cache->count < cache->capacity)
        return true;
    size_t capacity = cache->capacity ? 2 * cache->capacity : 32;
    void *grown = realloc(cache->entries, capacity * sizeof *cache->entries);
    if (!grown)
        return false;
    cache->entries = grown;
    cache->capacity = capacity;
    return true;
}

/* Sets up the entry of a linked program. */
static bool set_up(struct cached_program *entry, GLuint name, const struct program_desc *desc,
                   struct error *err)
{
    entry->program.name = name;
    glObjectLabel(GL_PROGRAM, name, -1, desc->label);
    if (desc->vertex)
        entry->program.attributes = read_attributes(name);
    entry->program.uniforms = program_uniforms_create(name, err);
    return entry->program.uniforms != NULL;
}

/* The program is loaded from the store, or begun. Takes the key. */
static bool begin_program(struct program_cache *cache, const struct program_desc *desc,
                          struct cached_program *entry, struct error *err)
{
    double begin_ms = wall_ms();
    struct program_source source;
    if (!program_source_init(&source, desc, cache->device_defines, err))
        return false;
    if (cache->dump_dir)
        dump_source(cache, &source);
    GLuint loaded = load_program(cache, &source);
    if (!loaded) {
        program_build_begin(&entry->build, &source, cache->store != NULL);
        return true;
    }
    program_source_finish(&source);
    cache->stats.loaded++;
    cache->stats.load_ms += wall_ms() - begin_ms;
    return set_up(entry, loaded, desc, err);
}

/* NULL with err: nothing is kept. */
static struct cached_program *begin_entry(struct program_cache *cache,
                                          const struct program_desc *desc, struct error *err)
{
    struct cached_program *entry = calloc(1, sizeof *entry);
    if (!entry || !reserve_entry(cache) || !(entry->key = make_key(desc))) {
        error_set(err, ERROR_NO_MEMORY, "program '%s'", desc->label);
    } else if (begin_program(cache, desc, entry, err)) {
        cache->entries[cache->count++] = entry;
        return entry;
    }
    destroy_entry(entry);
    return NULL;
}

static bool end_program(struct program_cache *cache, const struct program_desc *desc,
                        struct cached_program *entry, struct error *err)
{
    double begin_ms = wall_ms();
    GLuint name = program_build_end(&entry->build, desc, err);
    if (!name)
        return false;
    keep_program(cache, &entry->build.source, name);
    cache->stats.misses++;
    cache->stats.compile_ms += entry->build.spent_ms + wall_ms() - begin_ms;
    program_build_finish(&entry->build);
    return set_up(entry, name, desc, err);
}

/* One that fails is tried anew when it is asked for again. */
static const struct gl_program *end_entry(struct program_cache *cache,
                                          const struct program_desc *desc,
                                          struct cached_program *entry, struct error *err)
{
    size_t at = 0;
    if (entry->program.name || end_program(cache, desc, entry, err))
        return &entry->program;
    while (cache->entries[at] != entry)
        at++;
    cache->entries[at] = cache->entries[--cache->count];
    destroy_entry(entry);
    return NULL;
}

static struct cached_program *find_entry(const struct program_cache *cache, const char *key)
{
    for (size_t i = 0; i < cache->count; i++)
        if (!strcmp(cache->entries[i]->key, key))
            return cache->entries[i];
    return NULL;
}

/* NULL where it is absent, or where there is no memory to tell. */
static struct cached_program *find_program(const struct program_cache *cache,
                                           const struct program_desc *desc)
{
    assert(desc->label);
    assert(desc->compute ? !desc->vertex && !desc->fragment : desc->vertex != NULL);
    assert(!desc->tessellation[0] == !desc->tessellation[1]);
    char *key = make_key(desc);
    struct cached_program *entry = key ? find_entry(cache, key) : NULL;
    free(key);
    return entry;
}

const struct gl_program *program_cache_get(struct program_cache *cache,
                                           const struct program_desc *desc, struct error *err)
{
    struct cached_program *entry = find_program(cache, desc);
    if (entry && entry->program.name) {
        cache->stats.hits++;
        return &entry->program;
    }
    if (!entry)
        entry = begin_entry(cache, desc, err);
    return entry ? end_entry(cache, desc, entry, err) : NULL;
}

void program_cache_prepare(struct program_cache *cache, const struct program_desc *desc)
{
    struct error ignored = {0}; /* program_cache_get tells */
    if (!find_program(cache, desc))
        (void)begin_entry(cache, desc, &ignored);
}

enum program_place program_cache_find(const struct program_cache *cache,
                                      const struct program_desc *desc)
{
    struct error ignored = {0};
    struct program_source source;
    const struct cached_program *entry = find_program(cache, desc);
    if (entry && entry->program.name)
        return PROGRAM_IN_MEMORY;
    if (!cache->store || !program_source_init(&source, desc, cache->device_defines, &ignored))
        return PROGRAM_ABSENT;
    bool is_kept = program_store_has(cache->store, source.key);
    program_source_finish(&source);
    return is_kept ? PROGRAM_ON_DISK : PROGRAM_ABSENT;
}

void program_cache_get_stats(const struct program_cache *cache, struct program_cache_stats *stats)
{
    *stats = cache->stats;
}

void gl_program_use(const struct gl_program *program)
{
    glUseProgram(program->name);
}

/* -1: nothing is to be sent. */
static GLint change(const struct gl_program *program, const char *name, const void *value,
                    uint32_t words)
{
    return program_uniforms_change(program->uniforms, name, value, words);
}

void gl_program_set_u(const struct gl_program *program, const char *name, uint32_t value)
{
    GLint location = change(program, name, &value, 1);
    if (location >= 0)
        glProgramUniform1ui(program->name, location, value);
}

void gl_program_set_u2(const struct gl_program *program, const char *name, uint32_t x, uint32_t y)
{
    GLint location = change(program, name, (const uint32_t[2]){x, y}, 2);
    if (location >= 0)
        glProgramUniform2ui(program->name, location, x, y);
}

void gl_program_set_u3(const struct gl_program *program, const char *name, const uint32_t value[3])
{
    GLint location = change(program, name, value, 3);
    if (location >= 0)
        glProgramUniform3uiv(program->name, location, 1, value);
}

void gl_program_set_i2(const struct gl_program *program, const char *name, int32_t x, int32_t y)
{
    GLint location = change(program, name, (const int32_t[2]){x, y}, 2);
    if (location >= 0)
        glProgramUniform2i(program->name, location, x, y);
}

void gl_program_set_f(const struct gl_program *program, const char *name, float value)
{
    GLint location = change(program, name, &value, 1);
    if (location >= 0)
        glProgramUniform1f(program->name, location, value);
}

void gl_program_set_f2(const struct gl_program *program, const char *name, const float value[2])
{
    GLint location = change(program, name, value, 2);
    if (location >= 0)
        glProgramUniform2fv(program->name, location, 1, value);
}

void gl_program_set_f3(const struct gl_program *program, const char *name, const float value[3])
{
    GLint location = change(program, name, value, 3);
    if (location >= 0)
        glProgramUniform3fv(program->name, location, 1, value);
}

void gl_program_set_f4(const struct gl_program *program, const char *name, const float value[4])
{
    GLint location = change(program, name, value, 4);
    if (location >= 0)
        glProgramUniform4fv(program->name, location, 1, value);
}
