// SPDX-License-Identifier: MIT
// How far each column of the haze's grid is seen: the farthest depth in the pixels that look it up.
// Needs: SAMPLES, IS_ORTHOGRAPHIC.
#include "shared/bindings.h"
#include "window/view_ray.glsl"
#include "window/gbuffer.glsl"
#include "shading/atmosphere_slices.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = BIND_ATMOSPHERE_REACH) writeonly buffer reach_buffer { float reaches[]; };
uniform uvec2 u_size_px;

void main()
{
    uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
             gl_LocalInvocationID.x;
    if (i >= u_atmosphere_grid.x * u_atmosphere_grid.y)
        return;
    vec2 middle = atmosphere_pixel(uvec2(i % u_atmosphere_grid.x, i / u_atmosphere_grid.x));
    float reach = 1.5 * u_atmosphere_side_px;
    ivec2 low = max(ivec2(floor(middle - reach)), ivec2(0));
    ivec2 high = min(ivec2(ceil(middle + reach)), ivec2(u_size_px) - 1);
    float farthest = 1.0; // stored: 0 is infinitely far
    for (int y = low.y; y <= high.y; y++)
        for (int x = low.x; x <= high.x; x++)
            for (int k = 0; k < SAMPLES; k++)
                farthest = min(farthest, texelFetch(u_depth_map, ivec2(x, y), k).x);
    reaches[i] = farthest > 0.0 ? view_depth(farthest) : 2.0 * ATMOSPHERE_FAR;
}
