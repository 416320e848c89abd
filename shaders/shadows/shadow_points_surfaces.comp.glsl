// SPDX-License-Identifier: MIT
// The points of the surfaces of a set, an invocation each, where traced shadows are asked for.
// Opaque samples have shadow_points_pixels.comp.glsl, because an invocation finds all surfaces of
// its pixel. Needs: those of shadow_points.glsl; POINTS, the source of the set
// (renderer/window/surface_set.h), which provides
//   uint surface_point(uint i, out shadow_point p): the point of the i-th surface, and its place
//   among the points: the number that surface_load has for the surface (SURFACES of
//   shading/shade_surfaces.comp.glsl),
// and may use what stands before its inclusion.
#include "shadows/shadow_points.glsl"
layout(local_size_x = 64) in;
uniform uint u_surfaces;

// In the middle of the samples that the triangle covers: at the pixel's middle its plane may be
// beside it, and behind its neighbours.
vec3 point_position(surface s, vec2 pixel, uint coverage, float depth)
{
    vec2 sum = vec2(0.0);
    for (int j = 0; j < SAMPLES; j++)
        if ((coverage & 1u << j) != 0u)
            sum += u_sample_positions[j] - 0.5;
    vec2 offset = sum / float(max(bitCount(coverage & ((1u << SAMPLES) - 1u)), 1));
    float view_z = view_depth(depth);
    vec3 middle = view_position(pixel + 0.5, view_z);
    vec3 aside = view_position(pixel + 0.5 + offset, view_z);
    vec3 view = view_direction(aside);
    float across = dot(s.geo_normal, view); // along the view onto the plane
    if (abs(across) < 1e-3)
        return middle;
    float way = dot(s.geo_normal, middle - aside) / across;
    return aside + clamp(way, -0.5 * view_z, 0.5 * view_z) * view;
}

#each POINTS #include "$1"

void main()
{
    uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
             gl_LocalInvocationID.x;
    if (i >= u_surfaces)
        return;
    shadow_point p;
    uint place = surface_point(i, p);
    points[place] = p;
}
