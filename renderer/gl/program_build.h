/* SPDX-License-Identifier: MIT */
/* A program that is being built. Compiling and linking are requested at once, and their results are
 * asked for later, so that a driver with threads builds many programs in parallel. Thread: GL. */
#ifndef VITRAIL_RENDERER_GL_PROGRAM_BUILD_H
#define VITRAIL_RENDERER_GL_PROGRAM_BUILD_H

#include "renderer/gl/program.h"
#include "renderer/gl/program_source.h"

struct program_build { /* zeroed = none */
    struct program_source source;
    uint32_t program, shaders[PROGRAM_STAGES];
    double spent_ms; /* in program_build_begin */
};

/* Takes the source. is_kept: its binary will be asked for. Nothing is waited for. */
void program_build_begin(struct program_build *build, struct program_source *source, bool is_kept);
/* Waits for the driver: the linked program, which is the caller's; 0 with err, which names file and
 * line. The source stays until program_build_finish. */
MUST_CHECK uint32_t program_build_end(struct program_build *build, const struct program_desc *desc,
                                      struct error *err);
void program_build_finish(struct program_build *build);

#endif
