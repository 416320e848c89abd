/* SPDX-License-Identifier: MIT */
/* A plane under the scene that shows nothing but the shadows on it: what lies behind is multiplied
 * by the share of light that arrives (docs/explanation/shading.md, section 9). It is a drawable of
 * the state, above which and from above alone it is seen. Thread: any. */
#ifndef VITRAIL_RENDERER_SCENE_GROUND_PLANE_H
#define VITRAIL_RENDERER_SCENE_GROUND_PLANE_H

#include "renderer/scene/scene_state.h"

/* Where the view has one, and the scene something that throws shadows on it. */
MUST_CHECK bool ground_plane_add(struct scene_state *state, const struct view *view,
                                 struct error *err);

/* What is let through of what lies behind: of the light that would arrive without casters, the
 * share that does; 1 where none would. distance_m: of the place from the plane's centre. */
void ground_plane_filter(const struct scene_state *state, double distance_m,
                         const double arriving[3], const double unshadowed[3], double filter[3]);

#endif
