/* SPDX-License-Identifier: MIT */
/* The loss of the context, by the number of calls. The rest of the hostile device is switched on by
 * gl_hooks_install, which must have been given a hostility for these to have an effect. Thread: GL.
 */
#ifndef VITRAIL_TESTS_SUPPORT_GL_HOSTILE_H
#define VITRAIL_TESTS_SUPPORT_GL_HOSTILE_H

#include <stdbool.h>
#include <stdint.h>

/* From here on so many calls of GL come through, and no more: what follows does nothing, leaves
 * what it was to write as it is, and returns 0, as OpenGL 4.5, 2.3.2 has it. 0: never; the context
 * is whole (again), which is for the time between two renderers. */
void gl_hostile_lose_after(uint64_t calls);
bool gl_hostile_is_lost(void);
uint64_t gl_hostile_calls(void); /* of GL, since the hooks were installed */

/* Whether time stamps come back from the device of the current context. Where it executes nothing,
 * radeonsi tells of stamps that were never written; iris waits for them, for ever. */
bool gl_stamps_are_answered(void);

#endif
