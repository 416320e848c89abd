/* SPDX-License-Identifier: MIT */
/* Composition of one shader stage from the sources in shaders/: defines, includes, #line marks.
 * No GL. */
#ifndef VITRAIL_RENDERER_GL_COMPOSE_H
#define VITRAIL_RENDERER_GL_COMPOSE_H

#include <stddef.h>

#include "protocol/error.h"

enum { COMPOSITION_FILES_MAX = 64 }; /* distinct files in one stage */

struct composition {
    char *text; /* owned, NUL-terminated GLSL */
    size_t length, capacity;
    const char *files[COMPOSITION_FILES_MAX]; /* by source number of #line */
    int file_count;
    const char *defines; /* borrowed, of composition_init alone */
};

/* A line "#each LIST TEXT" stands for as many lines as the define LIST has items, which commas
 * separate: the text with $1 to $9 replaced by the fields of the item, which colons separate. The
 * text may be an include. Without the define there is no line.
 *
 * file: its name, which is unique without the folder below shaders/. defines: space-separated NAME
 * or NAME=VALUE, after those of the device; NULL: none. Each file is included at most once. */
MUST_CHECK bool composition_init(struct composition *composition, const char *file,
                                 const char *device_defines, const char *defines,
                                 struct error *err);
void composition_finish(struct composition *composition);

/* "2:17(5): error" becomes "gbuffer.frag.glsl:17(5): error". Truncates to size. */
void composition_translate_log(const struct composition *composition, const char *log, char *out,
                               size_t size);

#endif
