/* SPDX-License-Identifier: MIT */
/* The program cache: compilation, linking, keys and uniforms. Composition is in compose.c. */
#include "renderer/gl/program.h"

#include <assert.h>
#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/gl/program_source.h"
#include "renderer/gl/program_uniforms.h"
#include "renderer/wall_clock.h"

struct cached_program {
    struct gl_program program;
    char *key;
};

struct program_cache {
    struct cached_program **entries; /* pointers, so that programs keep their address */
    size_t count, capacity;
    char *dump_dir;
    struct program_store *store; /* borrowed; NULL: programs are compiled once a start */
    struct program_binary_door door;
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

static void report_log(const struct composition *composition, const struct program_desc *desc,
                       GLuint shader, struct error *err)
{
    char log[2048] = "", translated[4096] = "";
    glGetShaderInfoLog(shader, sizeof log, NULL, log);
    composition_translate_log(composition, log, translated, sizeof translated);
    fprintf(stderr, "<3>shader '%s' [%s]:\n%s", desc->label, desc->defines ? desc->defines : "",
            translated);
    error_set(err, ERROR_INTERNAL, "shader '%s' does not compile: %.200s", desc->label, translated);
}

static GLuint compile_stage(const struct composition *composition, const struct program_desc *desc,
                            GLenum kind, struct error *err)
{
    GLuint shader = glCreateShader(kind);
    const GLchar *text = composition->text;
    GLint ok = 0;
    glShaderSource(shader, 1, &text, NULL);
    glCompileShader(shader);
    glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
    if (ok)
        return shader;
    report_log(composition, desc, shader, err);
    glDeleteShader(shader);
    return 0;
}

static bool attach_stages(const struct program_source *source, const struct program_desc *desc,
                          GLuint program, struct error *err)
{
    static const GLenum kinds[PROGRAM_STAGES] = {GL_VERTEX_SHADER, GL_FRAGMENT_SHADER,
                                                 GL_COMPUTE_SHADER};
    for (int i = 0; i < PROGRAM_STAGES; i++) {
        if (!source->files[i])
            continue;
        GLuint shader = compile_stage(&source->stages[i], desc, kinds[i], err);
        if (!shader)
            return false;
        glAttachShader(program, shader);
        glDeleteShader(shader); /* lives on as long as the program */
    }
    return true;
}

static GLuint link_program(const struct program_source *source, const struct program_desc *desc,
                           bool is_kept, struct error *err)
{
    GLuint program = glCreateProgram();
    if (!attach_stages(source, desc, program, err))
        goto fail;
    GLint linked = 0;
    if (is_kept)
        glProgramParameteri(program, GL_PROGRAM_BINARY_RETRIEVABLE_HINT, GL_TRUE);
    glLinkProgram(program);
    glGetProgramiv(program, GL_LINK_STATUS, &linked);
    if (!linked) {
        char log[1024] = "";
        glGetProgramInfoLog(program, sizeof log, NULL, log);
        error_set(err, ERROR_INTERNAL, "program '%s' does not link: %.200s", desc->label, log);
        goto fail;
    }
    return program;

fail:
    glDeleteProgram(program);
    return 0;
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
                             const struct program_binary_door *door)
{
    cache->store = store;
    cache->door =
        door ? *door : (struct program_binary_door){.get = get_binary, .load = load_binary};
}

/* 0: it must be compiled. */
static GLuint load_program(const struct program_cache *cache, const struct program_source *source)
{
    struct program_binary binary;
    if (!cache->store || !program_store_read(cache->store, source->key, &binary))
        return 0;
    GLuint program = glCreateProgram();
    bool is_good = cache->door.load(cache->door.context, program, &binary);
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
    if (cache->store && cache->door.get(cache->door.context, program, &binary))
        program_store_write(cache->store, source->key, &binary);
    program_binary_finish(&binary);
}

static GLuint make_program(struct program_cache *cache, const struct program_desc *desc,
                           struct error *err)
{
    double begin_ms = wall_ms();
    struct program_source source;
    if (!program_source_init(&source, desc, err))
        return 0;
    if (cache->dump_dir)
        dump_source(cache, &source);
    GLuint program = load_program(cache, &source);
    if (program) {
        cache->stats.loaded++;
        cache->stats.load_ms += wall_ms() - begin_ms;
    } else if ((program = link_program(&source, desc, cache->store != NULL, err))) {
        keep_program(cache, &source, program);
        cache->stats.misses++;
        cache->stats.compile_ms += wall_ms() - begin_ms;
    }
    program_source_finish(&source);
    if (program)
        glObjectLabel(GL_PROGRAM, program, -1, desc->label);
    return program;
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
    for (size_t i = 0; i < cache->count; i++) {
        glDeleteProgram(cache->entries[i]->program.name);
        program_uniforms_destroy(cache->entries[i]->program.uniforms);
        free(cache->entries[i]->key);
        free(cache->entries[i]);
    }
    free(cache->entries);
    free(cache->dump_dir);
    free(cache);
}

static char *make_key(const struct program_desc *desc)
{
    char *key = NULL;
    if (asprintf(&key, "%s|%s|%s|%s", desc->vertex ? desc->vertex : "",
                 desc->fragment ? desc->fragment : "", desc->compute ? desc->compute : "",
                 desc->defines ? desc->defines : "") < 0)
        return NULL;
    return key;
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

static const struct gl_program *build_program(struct program_cache *cache,
                                              const struct program_desc *desc, char *key,
                                              struct error *err)
{
    struct cached_program *entry = calloc(1, sizeof *entry);
    if (!entry || !reserve_entry(cache)) {
        error_set(err, ERROR_NO_MEMORY, "program '%s'", desc->label);
        goto fail;
    }
    entry->key = key;
    entry->program.name = make_program(cache, desc, err);
    if (!entry->program.name)
        goto fail;
    entry->program.uniforms = program_uniforms_create(entry->program.name, err);
    if (!entry->program.uniforms) {
        glDeleteProgram(entry->program.name);
        goto fail;
    }
    if (desc->vertex)
        entry->program.attributes = read_attributes(entry->program.name);
    cache->entries[cache->count++] = entry;
    return &entry->program;

fail:
    free(entry);
    return NULL;
}

static const struct cached_program *find_entry(const struct program_cache *cache, const char *key)
{
    for (size_t i = 0; i < cache->count; i++)
        if (!strcmp(cache->entries[i]->key, key))
            return cache->entries[i];
    return NULL;
}

const struct gl_program *program_cache_get(struct program_cache *cache,
                                           const struct program_desc *desc, struct error *err)
{
    assert(desc->label);
    assert(desc->compute ? !desc->vertex && !desc->fragment : desc->vertex != NULL);
    char *key = make_key(desc);
    if (!key) {
        error_set(err, ERROR_NO_MEMORY, "key of program '%s'", desc->label);
        return NULL;
    }
    const struct cached_program *entry = find_entry(cache, key);
    if (entry) {
        free(key);
        cache->stats.hits++;
        return &entry->program;
    }
    const struct gl_program *program = build_program(cache, desc, key, err);
    if (!program)
        free(key);
    return program;
}

enum program_place program_cache_find(const struct program_cache *cache,
                                      const struct program_desc *desc)
{
    char *key = make_key(desc);
    struct error ignored = {0};
    struct program_source source;
    bool is_there = key && find_entry(cache, key);
    free(key);
    if (is_there)
        return PROGRAM_IN_MEMORY;
    if (!cache->store || !program_source_init(&source, desc, &ignored))
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

void gl_program_set_i(const struct gl_program *program, const char *name, int value)
{
    GLint location = change(program, name, &value, 1);
    if (location >= 0)
        glProgramUniform1i(program->name, location, value);
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
