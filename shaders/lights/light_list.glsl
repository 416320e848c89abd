// SPDX-License-Identifier: MIT
// Provides: which lights may reach a point in view (renderer/lights/light_lists.h).
//   light_cursor c = light_list_first(pixel, view_z);
//   uint light;
//   while (light_list_next(c, light)) ... with LIGHT_LIST_HAS_GAPS (linked), not of LIGHT_NONE
//   uint lights = light_list_count(c);
// and, clustered only, light_list_chunk(c, first, count) to walk a part of the list.
// pixel: window coordinates, row 0 at the bottom; view_z: distance along the view direction [m].
// The global prefix (directional and unbounded lights) comes first. LIGHT_LIST chooses the
// technique; light_lists_bind sets the rest.
#include "shared/bindings.h"

#define LIGHT_LIST_CLUSTERED 1
#define LIGHT_LIST_LINKED 2

layout(binding = UNIT_LIGHT_HEADS) uniform usamplerBuffer u_light_heads;
layout(binding = UNIT_LIGHT_ITEMS) uniform usamplerBuffer u_light_items;
uniform uint u_light_prefix;  // entries of the global prefix
uniform uint u_light_columns; // tiles per row
uniform uint u_light_shift;   // log2 of the tile's side in pixels

#if LIGHT_LIST == LIGHT_LIST_LINKED
#include "lights/light_list_linked.glsl"
#else
#include "lights/light_list_clustered.glsl"
#endif
