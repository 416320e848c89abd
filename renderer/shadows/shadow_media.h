/* SPDX-License-Identifier: MIT */
/* Finds the media that a light stands in. Thread: any. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_MEDIA_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_MEDIA_H

#include "renderer/shadows/shadow_map.h"

/* map->sigma: the summed extinction [1/m] at the light's own place, where the lists of its texels
 * begin, of the frame and the planes of the map. Each
 * medium among the casters counts as often as its surface winds around the light, by the sum of the
 * solid angles of its triangles (van Oosterom and Strackee 1983, "The solid angle of a plane
 * triangle", eq. 8), in f64. Zero for maps without media and for directional lights, whose lists
 * begin outside of everything, and where planes cut the light away: then map->around lists the
 * media instead. Were there more than it holds, sigma would stand, and attenuate from the light on.
 */
void shadow_media_at(const struct scene_state *state, const struct shadow_casters *casters,
                     struct shadow_map *map);

#endif
