/* SPDX-License-Identifier: MIT */
/* What light loses to a caster that is alike all over, for techniques that go by triangles and not
 * by texels: grids of triangles and shadow volumes. Pure functions. Thread: any. */
#ifndef VITRAIL_RENDERER_SHADOWS_CASTER_FILTER_H
#define VITRAIL_RENDERER_SHADOWS_CASTER_FILTER_H

#include "renderer/scene/scene_state.h"

/* Whether all crossings of the item by light are alike: it is opaque, or its filter is one for all
 * places and angles. Others have textures, vertex colours, masks, slabs, media, or cast once. */
bool caster_filter_is_even(const struct scene_state *state, const struct state_item *item,
                           enum view_blend_filter blend);

/* What such an item lets through of each channel; an opaque one nothing. */
void caster_filter_of(const struct scene_state *state, const struct state_item *item,
                      enum view_blend_filter blend, double filter[3]);

#endif
