/* SPDX-License-Identifier: MIT */
/* Faces of shadow volumes that the device draws: into pictures of half floats, as Kim, Kim and Turk
 * have it; or into nothing, so that their fragments count what they cross. Thread: GL. */
#ifndef VITRAIL_RENDERER_SHADOWS_VOLUME_DRAWING_H
#define VITRAIL_RENDERER_SHADOWS_VOLUME_DRAWING_H

#include "renderer/shadows/volumes.h"

enum { VOLUME_DRAWN_BYTES = 16 }; /* of a pixel */

/* Whether faces are drawn in this form. */
bool volume_form_is_drawn(enum volume_form form);
/* Room for the pictures of a window; none has changed where it has this size already. */
MUST_CHECK bool volume_drawing_reserve(struct volume_drawing *drawing, int width, int height,
                                       struct error *err);
/* Makes the pictures such that no way has gained anything. */
void volume_drawing_clear(const struct volume_drawing *drawing, enum volume_form form);
/* Draws the first faces with the program in use, whose buffers are bound, onto the pictures. */
void volume_drawing_draw(const struct volume_drawing *drawing, enum volume_form form,
                         uint64_t faces);
/* Draws into a window without pictures from now on, or with a stencil alone. */
MUST_CHECK bool volume_drawing_begin_counts(struct volume_drawing *drawing, int width, int height,
                                            bool has_stencil, struct error *err);
/* Clears the stencil, which then counts faces by these operations of GL. */
void volume_drawing_begin_stencil(const struct volume_drawing *drawing, uint32_t of_front,
                                  uint32_t of_back);
/* Draws so many points, or patches of one, with the program in use. */
void volume_drawing_add_counts(bool is_tessellated, uint64_t patches);
void volume_drawing_end_counts(void); /* of the stencil, too */
/* Binds the pictures to be read. */
void volume_drawing_bind(const struct volume_drawing *drawing);
uint64_t volume_drawing_size_bytes(const struct volume_drawing *drawing);
void volume_drawing_finish(struct volume_drawing *drawing);

#endif
