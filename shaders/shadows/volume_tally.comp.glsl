// SPDX-License-Identifier: MIT
// Adds what a stencil has counted to the sums of points, of one point of each pixel and of one
// group. A stencil that wraps has the number of casters but for multiples of 256, of which no group
// has more; one that stays at its most has counted no further.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"
layout(local_size_x = 64) in;
layout(std430, binding = BIND_VOLUME_SUMS) buffer sum_buffer { int sums[]; };
layout(std430, binding = BIND_STATISTICS) buffer counter_buffer { uint counters[]; };
#include "shadows/volume_pixel.glsl"
layout(binding = UNIT_VOLUME_STENCIL) uniform usampler2D u_stencil;
uniform uvec2 u_size_px;
uniform uint u_turn, u_slot;
uniform uint u_way; // 0: it wraps; 1: what ways gain was counted; 2: what they lose

void main()
{
    uint index = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
                 gl_LocalInvocationIndex;
    if (index >= u_size_px.x * u_size_px.y)
        return;
    pixel_points points = points_of(index);
    if (u_slot >= points.count)
        return;
    uint counted = texelFetch(u_stencil, ivec2(index % u_size_px.x, index / u_size_px.x), 0).r;
    uint at = 6u * point_at(points, u_slot) + u_turn, of_eye = counters[VOLUME_OF_EYE + u_turn];
    if (u_way == 0u)
        sums[at] += int((counted + of_eye) & VOLUME_STENCIL_MOST) - int(of_eye);
    else {
        sums[at] += u_way == 1u ? int(counted) : -int(counted);
        if (counted == VOLUME_STENCIL_MOST)
            counters[VOLUME_OVERFLOW] = 1u;
    }
}
