// SPDX-License-Identifier: MIT
// The light of the haze from the eye to the end of each slice, at the corners of columns: the mean
// of the four around, whose points lie in the four quarters of a slice.
#include "shared/bindings.h"
layout(local_size_x = 64) in;
layout(std430, binding = BIND_ATMOSPHERE) readonly buffer atmosphere_buffer { float slices[]; };
layout(std430, binding = BIND_ATMOSPHERE_SUMS) writeonly buffer sum_buffer { vec4 sums[]; };
uniform uvec3 u_atmosphere_grid; // columns, rows of them, slices

vec3 slice_light(uint at) { return vec3(slices[at], slices[at + 1u], slices[at + 2u]); }

void main()
{
    uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
             gl_LocalInvocationID.x;
    uvec2 columns = u_atmosphere_grid.xy, corners = columns - 1u;
    if (i >= corners.x * corners.y)
        return;
    uint column = i / corners.x * columns.x + i % corners.x;
    vec3 sum = vec3(0.0);
    for (uint k = 0u; k < u_atmosphere_grid.z; k++) {
        uint at = 3u * (k * columns.x * columns.y + column), above = at + 3u * columns.x;
        sum += 0.25 * (slice_light(at) + slice_light(at + 3u) + slice_light(above) +
                       slice_light(above + 3u));
        sums[k * corners.x * corners.y + i] = vec4(sum, 0.0);
    }
}
