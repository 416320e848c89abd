// SPDX-License-Identifier: MIT
// What programs share that find the light at points of haze and of smoke: shadows, which points a
// dispatch has, and which lights it is for.
// Needs: those of lighting.glsl.
#ifdef HAS_SHADOWS
#include "shadows/shadow_query.glsl"
layout(std430, binding = BIND_STATISTICS) buffer statistics_buffer { uint statistics[]; };
#define STATISTICS_LOOKUPS 64u // as in lighting.glsl
uniform float u_taps;
#endif
uniform uint u_first, u_end; // of the dispatch
uniform uvec2 u_size_px;
#ifdef HAS_LIGHT_PARTS
uniform uvec2 u_light_part; // not 0: it is the first; it is the last
#define IS_FIRST_PART (u_light_part.x != 0u)
#else
#define IS_FIRST_PART true
#endif
#ifdef HAS_LIGHT_CHUNK
uniform uvec2 u_light_chunk;
#endif
