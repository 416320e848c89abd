/* SPDX-License-Identifier: MIT */
/* Composes GLSL programs from the sources in shaders/ and keeps them by their full key. Thread:
 * GL. */
#ifndef VITRAIL_RENDERER_GL_PROGRAM_H
#define VITRAIL_RENDERER_GL_PROGRAM_H

#include <stdint.h>

#include "protocol/error.h"
#include "renderer/gl/program_store.h"

struct program_cache;

struct program_cache *program_cache_create(const char *dump_dir /* optional */, struct error *err);
void program_cache_destroy(struct program_cache *cache);

struct program_desc {
    const char *label; /* required; names the program in debug output */
    /* File names in shaders/, e.g. "gbuffer.vert.glsl"; either vertex (+ tessellation, geometry,
     * fragment) ... */
    const char *vertex;
    const char *tessellation[2]; /* control, evaluation: both, or none */
    const char *geometry;
    const char *fragment;
    const char *compute; /* ... or compute */
    /* Space-separated NAME or NAME=VALUE items that become #define lines, in this order; NULL means
     * none. Callers keep the order canonical: the text is the key. */
    const char *defines;
};

struct gl_program {
    uint32_t name;
    uint32_t attributes;               /* bits by location: those that the vertex shader reads */
    struct program_uniforms *uniforms; /* owned by the cache; setters change it */
};

enum { DEVICE_DEFINES_BYTES = 64 };
/* Sets #define items that all programs of this device get besides their own, from now on. Programs
 * that exist already stay as they are. At first there are none. */
void program_cache_set_device_defines(struct program_cache *cache, const char *defines);
const char *program_cache_device_defines(const struct program_cache *cache);

/* The linked program, built on first use. `#include "file.glsl"` (once per program) takes files of
 * shaders/; logs name file:line. The pointer lives as long as the cache. */
const struct gl_program *program_cache_get(struct program_cache *cache,
                                           const struct program_desc *desc, struct error *err);

/* Begins what program_cache_get will be asked for, and waits for nothing: where the driver compiles
 * on threads of its own, many programs are built at a time. program_cache_get reports failures.
 */
void program_cache_prepare(struct program_cache *cache, const struct program_desc *desc);

/* Whether a program stands already; nothing is compiled or loaded. */
enum program_place { PROGRAM_ABSENT, PROGRAM_IN_MEMORY, PROGRAM_ON_DISK };
enum program_place program_cache_find(const struct program_cache *cache,
                                      const struct program_desc *desc);

/* Hooks through which linked programs are read from the device and loaded: GL's, but in tests. */
struct program_binary_hooks {
    void *context;
    /* Bytes of the linked program into *binary, which is empty; false: the driver gives none. */
    bool (*get)(void *context, uint32_t program, struct program_binary *binary);
    /* False: the driver does not take them; the program is then as good as new. */
    bool (*load)(void *context, uint32_t program, const struct program_binary *binary);
};

/* From now on a program that is not in memory is loaded from the store if it is there, and is
 * stored after it was compiled. Borrowed; hooks NULL: GL's, which work if the context has
 * program_formats. */
void program_cache_set_store(struct program_cache *cache, struct program_store *store,
                             const struct program_binary_hooks *hooks);

struct program_cache_stats {
    uint64_t hits, misses, loaded; /* found in memory, compiled, taken from the store */
    double compile_ms, load_ms;
};
void program_cache_get_stats(const struct program_cache *cache, struct program_cache_stats *stats);

/* glUseProgram; and one uniform by name, of arrays one element ("u_sigma[1]"). A name that the
 * linker removed is ignored; a value that was set before is not sent again. */
void gl_program_use(const struct gl_program *program);
void gl_program_set_u(const struct gl_program *program, const char *name, uint32_t value);
void gl_program_set_u2(const struct gl_program *program, const char *name, uint32_t x, uint32_t y);
void gl_program_set_u3(const struct gl_program *program, const char *name, const uint32_t value[3]);
void gl_program_set_i2(const struct gl_program *program, const char *name, int32_t x, int32_t y);
void gl_program_set_f(const struct gl_program *program, const char *name, float value);
void gl_program_set_f2(const struct gl_program *program, const char *name, const float value[2]);
void gl_program_set_f3(const struct gl_program *program, const char *name, const float value[3]);
void gl_program_set_f4(const struct gl_program *program, const char *name, const float value[4]);

#endif
