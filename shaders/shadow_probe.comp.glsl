// SPDX-License-Identifier: MIT
// Shadow queries at points in a buffer: renderer/shadows/shadow_probe.h.
#include "shadow_query.glsl"

layout(local_size_x = 64) in;

struct probe_point {
    vec4 p; // w: bits of the object
    vec4 n; // w: bits of the shadow
};
layout(std430, binding = BIND_FRAGMENT_KEYS) readonly buffer point_buffer { probe_point points[]; };
layout(std430, binding = BIND_FRAGMENT_COLORS) writeonly buffer result_buffer { vec4 results[]; };
uniform uint u_count;

void main()
{
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    uint i = group * 64u + gl_LocalInvocationID.x;
    if (i >= u_count)
        return;
    probe_point q = points[i];
    uint shadow = floatBitsToUint(q.n.w), object = floatBitsToUint(q.p.w);
    results[i] = vec4(shadow_transmittance(shadow, q.p.xyz, q.n.xyz, object), 1.0);
}
