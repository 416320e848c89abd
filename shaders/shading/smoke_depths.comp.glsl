// SPDX-License-Identifier: MIT
// The optical depth of all density grids between a light and points over their boxes, which nodes
// of every picture look up as long as grids and light stand (smoke_depths.glsl). Space and light do
// not know of a camera: directions are those of the world.
// Needs: GRID_COUNT; GRID_CUTS; SMOKE_DEPTH_CHANNELS.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"
#include "lights/density_grids.glsl"
#include "shading/smoke_lattice.glsl"
// Each thread has a point, and all but the last of a group write: it and the next.
layout(local_size_x = 64) in;
layout(std430, binding = BIND_SMOKE_DEPTHS) writeonly buffer depth_buffer { uint depths[]; };

uniform vec4 u_light;         // w 1: where it is; 0: the direction to it
uniform vec4 u_cone;          // axis; w: cosine of its half angle, -1: there is none
uniform float u_range_m;      // 0: unbounded
uniform float u_reach_m;      // around where light arrives: points there are asked for, too
uniform uint u_first, u_end; // points
uniform uint u_slot;         // of the light

const float DEPTH_MOST = 64.0; // optical: nothing is left behind far less

shared float group_depths[64][SMOKE_DEPTH_CHANNELS];

// Whether no light arrives at the point, nor in the cells around it.
bool is_dark(vec3 p)
{
    vec3 from = p - u_light.xyz;
    float along = dot(from, u_cone.xyz), aside = length(from - along * u_cone.xyz);
    float sine = sqrt(max(1.0 - u_cone.w * u_cone.w, 0.0));
    bool is_outside = u_cone.w > -1.0 && aside * u_cone.w - along * sine > u_reach_m;
    bool is_far = u_range_m > 0.0 && length(from) > u_range_m + u_reach_m;
    return u_light.w != 0.0 && (is_outside || is_far);
}

vec3 depth_at(int point)
{
    uint g = 0u;
    ivec3 size, steps;
    for (; g < uint(GRID_COUNT); g++) {
        size = ivec3(texelFetch(u_grid_records, int(g * GRID_RECORD_TEXELS + 3u)).xyz);
        steps = ivec3(u_smoke_steps[g]);
        int count = smoke_lattice_points(steps);
        if (point < count)
            break;
        point -= count;
    }
    ivec3 sides = steps + 1;
    vec3 at = vec3(point % sides.x, point / sides.x % sides.y, point / (sides.x * sides.y));
    vec4 x = grid_word(g, 0u), y = grid_word(g, 1u), z = grid_word(g, 2u);
    mat3 voxel_from_world = transpose(mat3(x.xyz, y.xyz, z.xyz));
    vec3 voxel = at * vec3(size) / vec3(steps) - vec3(x.w, y.w, z.w);
    vec3 p = inverse(voxel_from_world) * voxel;
    if (is_dark(p))
        return vec3(0.0);
    if (u_light.w == 0.0)
        return grids_depth(p, u_light.xyz, GRID_FAR);
    vec3 to_light = u_light.xyz - p;
    float away = length(to_light);
    return grids_depth(p, to_light / max(away, 1e-20), away);
}

void main()
{
    uint own = gl_LocalInvocationID.x;
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    uint point = u_first + group * 63u + own;
    vec3 depth = point < u_smoke_points ? depth_at(int(point)) : vec3(0.0);
#if SMOKE_DEPTH_CHANNELS == 1
    depth = vec3(max(depth.r, max(depth.g, depth.b)));
#endif
    for (int c = 0; c < SMOKE_DEPTH_CHANNELS; c++)
        group_depths[own][c] = min(depth[c], DEPTH_MOST);
    barrier();
    if (own == 63u || point >= u_end)
        return;
    for (int c = 0; c < SMOKE_DEPTH_CHANNELS; c++)
        depths[(u_slot * uint(SMOKE_DEPTH_CHANNELS) + uint(c)) * u_smoke_points + point] =
            packHalf2x16(vec2(group_depths[own][c], group_depths[own + 1u][c]));
}
