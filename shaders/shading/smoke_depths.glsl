// SPDX-License-Identifier: MIT
// What density grids let through of lights on their way to a node: by the optical depth of all of
// them at points over their boxes (smoke_depths.comp.glsl), linear between eight of these. A node
// outside of all boxes has that of the place on the nearest one.
// Needs: lights/density_grids.glsl; SMOKE_DEPTH_CHANNELS, 1 or 3.
// Provides: smoke_place_of(vec3 p), smoke_place_lets_through(smoke_place, uint light).
#include "shading/smoke_lattice.glsl"
// A point and the next along x; x fastest, then y, z, grids, channels, lights.
layout(binding = UNIT_SMOKE_DEPTHS) uniform samplerBuffer u_smoke_depths;
uniform vec3 u_smoke_depth_unit; // depth of each colour by one that is kept

struct smoke_place {
    int first, row, layer; // point before it; to the next along y, z
    vec3 share;            // how far it is from there to the next
};

smoke_place smoke_place_of(vec3 p)
{
    smoke_place found = smoke_place(0, 0, 0, vec3(0.0));
    float least = GRID_FAR;
    int first = 0;
    for (uint g = 0u; g < uint(GRID_COUNT); g++) {
        vec4 x = grid_word(g, 0u), y = grid_word(g, 1u), z = grid_word(g, 2u), at = vec4(p, 1.0);
        ivec3 size = ivec3(texelFetch(u_grid_records, int(g * GRID_RECORD_TEXELS + 3u)).xyz);
        ivec3 steps = ivec3(u_smoke_steps[g]);
        vec3 voxel = vec3(dot(x, at), dot(y, at), dot(z, at));
        vec3 off = max(max(-voxel, voxel - vec3(size)), vec3(0.0));
        vec3 per_m2 = vec3(dot(x.xyz, x.xyz), dot(y.xyz, y.xyz), dot(z.xyz, z.xyz));
        float away = dot(off, off / per_m2);
        if (away < least) {
            vec3 place = clamp(voxel / vec3(size), 0.0, 1.0) * vec3(steps);
            ivec3 cell = min(ivec3(place), steps - 1);
            found.row = steps.x + 1;
            found.layer = found.row * (steps.y + 1);
            found.first = first + cell.x + found.row * cell.y + found.layer * cell.z;
            found.share = place - vec3(cell);
            least = away;
        }
        first += smoke_lattice_points(steps);
    }
    return found;
}

vec3 smoke_place_lets_through(smoke_place place, uint light)
{
    vec3 depth = vec3(0.0);
    for (int c = 0; c < SMOKE_DEPTH_CHANNELS; c++) {
        int at = place.first +
                 (int(light) * SMOKE_DEPTH_CHANNELS + c) * int(u_smoke_points);
        vec4 low = vec4(texelFetch(u_smoke_depths, at).xy,
                        texelFetch(u_smoke_depths, at + place.row).xy);
        at += place.layer;
        vec4 high = vec4(texelFetch(u_smoke_depths, at).xy,
                         texelFetch(u_smoke_depths, at + place.row).xy);
        depth[c] = grid_value(low, high, place.share);
    }
#if SMOKE_DEPTH_CHANNELS == 1
    depth = depth.xxx;
#endif
    return exp(-depth * u_smoke_depth_unit);
}
