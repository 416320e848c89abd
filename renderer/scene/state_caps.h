/* SPDX-License-Identifier: MIT */
/* Drawables of a state that the scene does not have: meshes of their own, behind its own
 * drawables. Thread: any. */
#ifndef VITRAIL_RENDERER_SCENE_STATE_CAPS_H
#define VITRAIL_RENDERER_SCENE_STATE_CAPS_H

#include "renderer/scene/scene_state.h"

/* Room for one more, of so many points. */
MUST_CHECK bool state_caps_reserve(struct scene_state *state, size_t points, struct error *err);

/* One without vertices, which are relative to origin (world). */
struct state_cap state_caps_begin(const struct scene_state *state, const double origin[3]);
/* Three make a triangle. */
void state_caps_add_vertex(struct state_caps *caps, struct state_cap *cap, const double local[3],
                           const double normal[3]);
/* The drawable, whose node, primitive, class, material and kind are the caller's; shadow_hash: of
 * all that decides its shadow but its place. */
void state_caps_add_item(struct scene_state *state, struct state_cap *cap, struct state_item item);

void state_caps_finish(struct state_caps *caps);

#endif
