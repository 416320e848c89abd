/* SPDX-License-Identifier: MIT */
/* The GLSL sources, embedded at build time. Names are paths from the repository root:
 * "shaders/gbuffer.frag.glsl". */
#ifndef VITRAIL_SHADERS_SHADER_TABLE_H
#define VITRAIL_SHADERS_SHADER_TABLE_H

#include <stddef.h>

struct shader_file {
    const char *name;
    const char *text; /* NUL-terminated */
    size_t size_bytes;
};

extern const struct shader_file shader_table[]; /* ends with a NULL name */

#endif
