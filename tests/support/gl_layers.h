/* SPDX-License-Identifier: MIT */
/* What the layers of gl_hooks.h and their installer tell each other. Each _install takes the
 * functions below it and replaces some of them by its own. Thread: GL. */
#ifndef VITRAIL_TESTS_SUPPORT_GL_LAYERS_H
#define VITRAIL_TESTS_SUPPORT_GL_LAYERS_H

#include "tests/support/gl_hooks.h"

void gl_hostile_install(struct gl_functions *functions, const struct gl_hostility *hostility);
void gl_order_install(struct gl_functions *functions);
void gl_access_install(struct gl_functions *functions);
void gl_mirror_install(struct gl_functions *functions);
void gl_counts_install(struct gl_functions *functions);

void gl_order_print(void);
void gl_counts_print(void);

#endif
