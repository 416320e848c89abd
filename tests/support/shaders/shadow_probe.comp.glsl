// SPDX-License-Identifier: MIT
// Shadow queries at points in a buffer: tests/support/gl_shadow_probe.h.
#include "shadows/shadow_query.glsl"

layout(local_size_x = 64) in;

// Two texels per point: position and object; normal and shadow.
layout(binding = UNIT_LIGHT_ITEMS) uniform usamplerBuffer u_points;
layout(std430, binding = BIND_ENTRY_COLORS) writeonly buffer result_buffer { vec4 results[]; };
uniform uint u_count;
#ifdef PROBE_TOLERANCE
uniform vec4 u_tolerance; // x, y: for opaque casters, for lists
#else
const vec4 u_tolerance = vec4(0.0);
#endif

void main()
{
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    uint i = group * 64u + gl_LocalInvocationID.x;
    if (i >= u_count)
        return;
    uvec4 p = texelFetch(u_points, int(2u * i)), n = texelFetch(u_points, int(2u * i + 1u));
    vec3 at = uintBitsToFloat(p.xyz), normal = uintBitsToFloat(n.xyz);
#ifdef PROBE_NOTHING // what reading the points and storing the answers takes
    vec3 t = at + normal + vec3(n.w, p.w, 0.0);
#else
    vec3 t = shadow_transmittance(n.w, at, normal, u_tolerance.xy, p.w);
#endif
    results[i] = vec4(t, 1.0);
}
