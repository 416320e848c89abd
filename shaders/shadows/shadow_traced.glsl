// SPDX-License-Identifier: MIT
// Shadows that rays have found on the CPU (renderer/shadows/shadow_traced.h): each point brings the
// filters of the lights of its cluster that cast shadows, in the order of their list.
// Provides, where HAS_TRACED_SHADOWS:
//   traced_begin(point)    before the lights of a point are walked
//   traced_cluster()       its cluster as the CPU found it, for light_list_at
//   traced_transmittance() of the light at hand
//   traced_step(shadow, n) after each light, and after each point of an area: past n filters
#ifdef HAS_TRACED_SHADOWS
layout(binding = UNIT_TRACED_POINTS) uniform usamplerBuffer u_traced_points;
layout(binding = UNIT_TRACED_FILTERS) uniform usamplerBuffer u_traced_filters;
uvec2 traced_at; // next filter; cluster

void traced_begin(uint point)
{
    traced_at = texelFetch(u_traced_points, int(point)).xy;
}

uint traced_cluster()
{
    return traced_at.y;
}

void traced_step(uint shadow, uint n)
{
    traced_at.x += shadow == NO_SHADOW ? 0u : n;
}

vec3 traced_transmittance()
{
    return traced_filter(texelFetch(u_traced_filters, int(traced_at.x)).xy);
}
#endif
