/* SPDX-License-Identifier: MIT */
/* The one pass that lights surfaces: any set of them (renderer/window/surface_set.h), with a chunk
 * of the lights, in time slices between which urgent frames may run. Thread: GL. */
#ifndef VITRAIL_RENDERER_SHADING_LIGHTING_H
#define VITRAIL_RENDERER_SHADING_LIGHTING_H

#include "renderer/shading/shade.h"

/* What sets are lit with now. */
struct lighting {
    struct shade *shade;           /* required */
    const struct shade_desc *desc; /* required */
    struct light_chunk chunk;
    /* Of the work: those that are done, and how many there are about; for desc->advance. */
    int part, parts;
};

/* Lights the set by a program of its kind. Then a part of the work is done. */
MUST_CHECK bool lighting_run(struct lighting *lighting, const struct surface_set *set,
                             struct error *err);
/* Tells desc->advance that of the next part so much is done. */
void lighting_tell(const struct lighting *lighting, double done);

/* #define items of shaders/material/media.glsl in programs that composite layers, each behind a
 * space. Thread: any. */
enum { MEDIA_DEFINES_BYTES = 64 };
void lighting_media_defines(const struct window_frame *frame, const struct shade_facts *facts,
                            char text[MEDIA_DEFINES_BYTES]);

/* The program that lights such sets with such a chunk. Thread: any. */
void lighting_list_program(const struct window_frame *frame, const struct shade_facts *facts,
                           const struct light_chunk *chunk, const struct surface_kind *kind,
                           bool is_conditional, struct program_list *list);

#endif
