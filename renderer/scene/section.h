/* SPDX-License-Identifier: MIT */
/* Capped cuts: where a clip plane cuts a closed mesh open, a flat surface that closes it again, as
 * triangles of its own. CPU, f64. Thread: any. */
#ifndef VITRAIL_RENDERER_SCENE_SECTION_H
#define VITRAIL_RENDERER_SCENE_SECTION_H

#include "renderer/scene/scene_state.h"

/* Appends to state->items, materials and caps those of the planes of the view that ask for caps,
 * and counts what is open. Of overlapping opaque bodies the first has the cap where both are, and
 * none lies over a transparent body's. */
MUST_CHECK bool section_add(struct scene_state *state, const struct view *view, struct error *err);
/* Takes all caps away, and the ground; the state may be cut anew. */
void section_drop(struct scene_state *state);

/* An outline in the plane, in metres. Zeroed = empty. */
struct section_outline {
    double (*points)[2]; /* owned; loops one after the other, the body on their left */
    uint32_t *ends;      /* owned; of each loop */
    uint32_t point_count, loop_count, point_capacity, loop_capacity;
};
void section_outline_finish(struct section_outline *outline);

/* The union of what the loops enclose more often to the left than to the right, less that of
 * `without`, by the tessellator of the OpenGL utility library: its borders as loops, or triangles
 * (three points each, in `triangles->points`). */
MUST_CHECK bool section_resolve(const struct section_outline *outline,
                                const struct section_outline *const *without, size_t without_count,
                                bool as_triangles, struct section_outline *resolved,
                                struct error *err);

/* Adds a loop's next point; ends it. */
MUST_CHECK bool section_outline_add(struct section_outline *outline, const double point[2]);
MUST_CHECK bool section_outline_end(struct section_outline *outline);

#endif
