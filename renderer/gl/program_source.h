/* SPDX-License-Identifier: MIT */
/* The composed source of a program, stage by stage, and the name that follows from it. No GL.
 * Thread: any. */
#ifndef VITRAIL_RENDERER_GL_PROGRAM_SOURCE_H
#define VITRAIL_RENDERER_GL_PROGRAM_SOURCE_H

#include "renderer/base/content_key.h"
#include "renderer/gl/compose.h"
#include "renderer/gl/program.h"

enum {
    PROGRAM_STAGES = 6,    /* in the order of struct program_desc */
    PROGRAM_ID_BYTES = 17, /* 16 hex digits */
};

struct program_source {                /* zeroed = empty */
    const char *files[PROGRAM_STAGES]; /* borrowed from the description; NULL: no such stage */
    struct composition stages[PROGRAM_STAGES];
    struct content_key key;    /* of the text of all stages */
    char id[PROGRAM_ID_BYTES]; /* its first half: equal for equal text, on every machine */
};

/* device_defines: as of program_cache_set_device_defines. On failure it is empty. */
MUST_CHECK bool program_source_init(struct program_source *source, const struct program_desc *desc,
                                    const char *device_defines, struct error *err);
void program_source_finish(struct program_source *source);

/* "ID-FILE", the name of a stage's source where sources are saved. */
enum { PROGRAM_FILE_NAME_BYTES = 96 };
void program_source_file_name(const struct program_source *source, int stage,
                              char name[PROGRAM_FILE_NAME_BYTES]);

#endif
