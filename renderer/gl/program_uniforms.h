/* SPDX-License-Identifier: MIT */
/* Uniforms of one linked program by name: locations are asked for once, and a value that the
 * program has already is not sent again. Thread: GL. */
#ifndef VITRAIL_RENDERER_GL_PROGRAM_UNIFORMS_H
#define VITRAIL_RENDERER_GL_PROGRAM_UNIFORMS_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol/error.h"

struct program_uniforms;

/* Takes over the uniforms of a linked program: nobody else sets them from now on. */
struct program_uniforms *program_uniforms_create(uint32_t program, struct error *err);
void program_uniforms_destroy(struct program_uniforms *uniforms);

enum { PROGRAM_UNIFORM_WORDS = 4 }; /* of the largest type that is set: vec4 */

/* The location of `name` where the program is to be sent `value`, 4 bytes for each of `words`; -1
 * where it has that value, or no such uniform. The value counts as sent. */
int32_t program_uniforms_change(struct program_uniforms *uniforms, const char *name,
                                const void *value, uint32_t words);

#endif
