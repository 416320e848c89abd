// SPDX-License-Identifier: MIT
// Writes down which lights the current light lists name for given points: what tests compare with
// brute force.
#include "lights/light_list.glsl"

layout(local_size_x = 64) in;
// points: pixel, depth bits; lists: count, then lights
layout(std430, binding = BIND_STATISTICS) readonly buffer probe_points { uvec4 points[]; };
layout(std430, binding = BIND_LIST_NODES) writeonly buffer probe_lists { uint lists[]; };
uniform uint u_point_count, u_stride;

void main()
{
    uint i = gl_GlobalInvocationID.x;
    if (i >= u_point_count)
        return;
    uint count = 0u, light;
    light_cursor c = light_list_first(points[i].xy, uintBitsToFloat(points[i].z));
    while (count + 1u < u_stride && light_list_next(c, light)) {
#ifdef LIGHT_LIST_HAS_GAPS
        if (light == LIGHT_NONE)
            continue;
#endif
        count++;
        lists[i * u_stride + count] = light;
    }
    lists[i * u_stride] = count;
}
