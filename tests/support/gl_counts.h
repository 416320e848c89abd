/* SPDX-License-Identifier: MIT */
/* What the renderer asks of GL: calls, waits for the device, bytes up and down, processor time, in
 * all and by pass (the debug group that is open). Thread: GL. */
#ifndef VITRAIL_TESTS_SUPPORT_GL_COUNTS_H
#define VITRAIL_TESTS_SUPPORT_GL_COUNTS_H

#include "tests/support/gl_hooks.h"

/* Each comes to rest until the device has done what it waits for. What is known to be done already,
 * because a fence behind it has passed, costs no wait and is not counted; nor are further waits
 * before the device is given anything new. */
enum gl_wait {
    GL_WAIT_FINISH,       /* glFinish */
    GL_WAIT_FENCE,        /* glClientWaitSync with a timeout, once it has passed */
    GL_WAIT_BUFFER_READ,  /* glGetNamedBufferSubData of what the device wrote */
    GL_WAIT_MAP,          /* likewise mapped */
    GL_WAIT_TEXTURE_READ, /* glGetTextureSubImage without a pack buffer */
    GL_WAIT_QUERY,        /* the result of a query */
    GL_WAIT_COUNT
};

struct gl_counts {
    uint64_t calls;
    uint64_t by_function[GL_FUNCTION_COUNT];
    uint64_t draws, dispatches;
    uint64_t waits[GL_WAIT_COUNT];
    /* Of them, those behind which the device has nothing to do until it is given more. */
    uint64_t stalls;
    uint64_t syncs; /* glGetError, glCheckFramebufferStatus, link and compile status: a driver that
                       works in a thread of its own is waited for, the device is not */
    uint64_t bytes_up, bytes_down;
    /* Of the calling thread within GL: a driver's own threads are not in it. */
    uint64_t processor_ns;
};

/* Since the counts were installed. */
void gl_counts_get(struct gl_counts *counts);
struct gl_counts gl_counts_between(const struct gl_counts *before, const struct gl_counts *after);
uint64_t gl_counts_waits(const struct gl_counts *counts); /* of all kinds */
/* To stderr: the totals, and functions by how often they were called, most first. */
void gl_counts_show(const char *title, const struct gl_counts *counts, int functions);

#endif
