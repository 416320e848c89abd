// SPDX-License-Identifier: MIT
// What is left of the light of an environment map, over the lobes of each point that rays started
// from (renderer/shadows/shadow_traced.h). Needs: traced_filter; VISIBILITY_COUNT, the lobes of a
// point. Provides visibility_begin(point) before a surface is lit, visibility_of(lobe).
layout(std430, binding = BIND_VISIBILITY) readonly buffer visibility_buffer { uvec2 seen[]; };
uint seen_at; // first word pair of the point

void visibility_begin(uint point) { seen_at = point * uint(VISIBILITY_COUNT); }

vec3 visibility_of(uint lobe) { return traced_filter(seen[seen_at + lobe]); }
