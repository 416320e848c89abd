/* SPDX-License-Identifier: MIT */
/* The GLSL sources, embedded at build time. Names are paths from the repository root:
 * "shaders/window/gbuffer.frag.glsl". */
#ifndef VITRAIL_SHADERS_SHADER_TABLE_H
#define VITRAIL_SHADERS_SHADER_TABLE_H

#include <stddef.h>

struct shader_file {
    const char *name;
    const char *text; /* NUL-terminated */
    size_t size_bytes;
};

extern const struct shader_file shader_table[]; /* ends with a NULL name */

/* The file of that name, which is unique without its folder and may have it; NULL: there is none.
 */
const struct shader_file *shader_table_find(const struct shader_file *table, const char *name);
/* In shader_table. Programs of tests have shaders besides (tests/support/test_device.c). */
const struct shader_file *shader_find(const char *name);

#endif
