/* SPDX-License-Identifier: MIT */
/* Layers between the renderer and GL, for tests. libepoxy's entry points are global pointers to
 * functions; the hooks put their own functions there. Thread: GL.
 *
 * The product's calls go down through the layers that are switched on:
 *   gl_counts.c   counts calls, waits and bytes by pass
 *   gl_mirror.c   knows objects, bindings and programs for the layers around it
 *   gl_access.c   follows memory accesses, and names pairs that no barrier orders
 *   gl_order.c    runs dispatches that no barrier separates in another order
 *   gl_hostile.c  is a device with small limits, few extensions, lying timers, a lost context
 *
 * Each layer keeps its state in one static struct of its file: GL itself has one current context
 * per thread and no argument to carry a layer's state in, so these globals mirror those of GL. */
#ifndef VITRAIL_TESTS_SUPPORT_GL_HOOKS_H
#define VITRAIL_TESTS_SUPPORT_GL_HOOKS_H

#include <epoxy/gl.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"
#include "tests/support/gl_table.h" /* made by gl_table.py */

/* All functions that the sources call, without their prefix. */
struct gl_functions {
#define HOOKS_MEMBER(type, name, params, args) type(GLAPIENTRY *name) params;
    GL_TABLE(HOOKS_MEMBER, HOOKS_MEMBER)
#undef HOOKS_MEMBER
};

enum gl_function {
#define HOOKS_INDEX(type, name, params, args) GL_FUNCTION_##name,
    GL_TABLE(HOOKS_INDEX, HOOKS_INDEX)
#undef HOOKS_INDEX
        GL_FUNCTION_COUNT
};

const char *gl_function_name(enum gl_function function); /* "glFinish" */

enum gl_timers { GL_TIMERS_AS_THEY_ARE, GL_TIMERS_TRUE, GL_TIMERS_FALSE };

struct gl_hostility { /* zeroed = the device as it is */
    /* A deleted object's name is the next one's (Mesa; only before the first context). */
    bool reuses_names;
    bool has_small_blocks;    /* GL_MAX_SHADER_STORAGE_BLOCK_SIZE is 1 MiB */
    bool has_small_texels;    /* GL_MAX_TEXTURE_BUFFER_SIZE is 65,536, the least that GL allows */
    bool lacks_post_coverage; /* GL_ARB_post_depth_coverage is absent */
    bool is_not_software;     /* GL_RENDERER names no software rasteriser */
    enum gl_timers timers;
    uint64_t lost_after; /* calls until the context is lost; 0: never */
};

struct gl_hooks_desc { /* zeroed = no layer */
    bool counts, tracks, reorders;
    struct gl_hostility hostility;
    bool prints; /* counts and what was reordered, when the program ends */
};

/* "count", "track", "reorder" and "hostile=..." with names-reused, small-blocks, small-texels,
 * no-post-depth-coverage, not-software, timers-true, timers-false or lost-after=N, separated by
 * commas. */
MUST_CHECK bool gl_hooks_parse(const char *text, struct gl_hooks_desc *desc, struct error *err);

/* Replaces what was installed before. Between contexts: layers know nothing of objects that stand
 * already. Programs that link the hooks do so before main() from the environment's VITRAIL_TEST_GL,
 * so that no test can forget to; a text that cannot be parsed ends the program. */
void gl_hooks_install(const struct gl_hooks_desc *desc);
const struct gl_hooks_desc *gl_hooks_installed(void);

/* A test's own function before one of GL, or before the layers, which `below` keeps; and the end of
 * that. */
#define GL_SPY_BEGIN(name, below, own) \
    (gl_hooks_find(), (below) = epoxy_gl##name, epoxy_gl##name = (own))
#define GL_SPY_END(name, below) (epoxy_gl##name = (below))

/* libepoxy finds a function at its first call, and puts it over whatever stands in its place: from
 * here on all are found. */
void gl_hooks_find(void);

/* A fault of the renderer that a layer found. Each message is printed once; a program with faults
 * that nobody took ends with status 1. */
void gl_fault(const char *format, ...) __attribute__((format(printf, 1, 2)));
/* Their number, distinct ones, since the last call; the first one's message into text. */
int gl_faults_take(char *text, size_t size);

#endif
