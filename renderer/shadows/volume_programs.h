/* SPDX-License-Identifier: MIT */
/* The programs of shadow volumes: which of them a form needs, and with which words of the shaders.
 * Thread: any, but where it says GL. */
#ifndef VITRAIL_RENDERER_SHADOWS_VOLUME_PROGRAMS_H
#define VITRAIL_RENDERER_SHADOWS_VOLUME_PROGRAMS_H

#include "renderer/shadows/volumes.h"

enum volume_program {
    PROGRAM_PLACE,
    PROGRAM_SIGNS_OF_LIGHT,
    PROGRAM_EDGES_OF_LIGHT,
    PROGRAM_STARTS_OF_LIGHT,
    PROGRAM_FACES_OF_LIGHT,
    PROGRAM_COVER,
    PROGRAM_COVER_SMALL,
    PROGRAM_DRAW, /* takes the place of both, where faces are drawn */
    PROGRAM_FILTERS,
    /* likewise, of counts: what draws by geometry programs, and by the tessellator */
    PROGRAM_QUADS_OF_EDGES,
    PROGRAM_QUADS_OF_CAPS,
    PROGRAM_QUADS_OF_ALL, /* sides of triangles, with these */
    PROGRAM_PATCHES_OF_EDGES,
    PROGRAM_PATCHES_OF_SIDES, /* of triangles, */
    PROGRAM_PATCHES_OF_ALL,   /* with these */
    PROGRAM_STENCIL_OF_EDGES,
    PROGRAM_STENCIL_OF_CAPS,
    PROGRAM_TALLY, /* with these two */
    VOLUME_PROGRAMS
};

enum volume_form volume_form_of(bool is_silhouette, const struct view *view);

/* Whether the tessellator makes the quads of a program; else a geometry program does. */
bool volume_program_is_tessellated(enum volume_program program);
/* Whether it draws sides behind edges, some of which have several parts; else triangles. */
bool volume_program_is_of_edges(enum volume_program program);

/* What draws the faces of counts, two programs: sides, and then casters. VOLUME_PROGRAMS:
 * nothing. */
const enum volume_program *volume_programs_drawing(enum view_silhouette_form drawn_by);

/* Uses a program; form: VOLUME_COUNTS where casters are counted by groups, indeed. NULL: it could
 * not be built. Thread: GL. */
const struct gl_program *volume_program_use(const struct window_frame *frame, enum volume_form form,
                                            enum volume_program program, struct error *err);

/* Those that the view's frames need. */
void volume_programs_list(const struct window_frame *frame, bool is_silhouette,
                          struct program_list *list);

#endif
