/* SPDX-License-Identifier: MIT */
/* Pairs of commands that touch the same buffer without a barrier, and may, with the reason.
 * Thread: any. */
#ifndef VITRAIL_TESTS_SUPPORT_GL_ACCESS_ALLOWED_H
#define VITRAIL_TESTS_SUPPORT_GL_ACCESS_ALLOWED_H

#include <stdbool.h>

struct gl_pair {
    const char *first, *second; /* "label (defines)" of programs, or the name of a GL function */
    const char *object;         /* label of the buffer or texture */
    bool first_writes, second_writes;
};

bool gl_access_is_allowed(const struct gl_pair *pair);

#endif
