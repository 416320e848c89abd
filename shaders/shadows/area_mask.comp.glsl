// SPDX-License-Identifier: MIT
// What is left of an area light at each point, as area_find.comp.glsl, of opaque casters alone and
// by a table (renderer/shadows/area_table.h): a triangle hides the points of the light that lie on
// one side of all three edges, and a table has those for each line on the light, or for one next to
// it. All points of the light go at once, which are the same at every pixel.
// Needs: VECTORS, of 128 points each: 1 or 2.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"
#include "shadows/area_triangle.glsl"
layout(local_size_x = 64) in;

layout(std430, binding = BIND_AREA_STARTS) readonly buffer start_buffer { area_start starts[]; };
layout(std430, binding = BIND_AREA_PLACES) readonly buffer place_buffer { uvec2 places[]; };
layout(std430, binding = BIND_AREA_FIRSTS) readonly buffer first_buffer { uint firsts[]; };
layout(std430, binding = BIND_AREA_PAIRS) readonly buffer pair_buffer { uint pairs[]; };
layout(std430, binding = BIND_AREA_MASKS) readonly buffer mask_buffer { uvec4 masks[]; };
layout(std430, binding = BIND_AREA_FILTERS) writeonly buffer filter_buffer { uvec2 filters[]; };

uniform uint u_points, u_samples;
uniform uvec2 u_cells;
uniform vec3 u_center, u_facing, u_half_u, u_half_v;
uniform float u_nudge_m;
uniform uvec2 u_all; // the filter of light that nothing takes from

const float EPSILON = 2e-5; // as area_find.comp.glsl

struct point_mask {
    uvec4 at[VECTORS];
};

vec3 to_center = vec3(0.0);

// Points of the light where dot(normal, way) >= height.
point_mask half_plane(vec3 normal, float height)
{
    float a = dot(normal, u_half_u), b = dot(normal, u_half_v);
    float along = height - dot(normal, to_center), size = sqrt(a * a + b * b);
    float share = size > 0.0 ? 0.5 + 0.5 / float(AREA_TABLE_REACH) * along / size
                             : along > 0.0 ? 1.0 : 0.0;
    float turn = size > 0.0 ? atan(b, a) * (0.5 / 3.14159265) + 1.0 : 0.0;
    const float side = float(AREA_TABLE_SIDE);
    uint row = uint(floor(turn * side + 0.5)) % uint(AREA_TABLE_SIDE);
    uint column = uint(floor(clamp(share, 0.0, 1.0) * (side - 1.0) + 0.5));
    uint first = (row * uint(AREA_TABLE_SIDE) + column) * uint(VECTORS);
    point_mask mask;
    mask.at[0] = masks[first];
#if VECTORS > 1
    mask.at[1] = masks[first + 1u];
#endif
    return mask;
}

// Leaves what the triangle does not hide.
void block(inout point_mask open, area_edges edges, float nearest, float farthest)
{
    vec3 normal = (edges.turned[0] != 0u ? -edges.normal[0] : edges.normal[0]) +
                  (edges.turned[1] != 0u ? -edges.normal[1] : edges.normal[1]) +
                  (edges.turned[2] != 0u ? -edges.normal[2] : edges.normal[2]);
    float height = dot(normal, edges.corner[0]);
    normal = height < 0.0 ? -normal : normal;
    height = abs(height);
    point_mask a = half_plane(edges.normal[0], 0.0);
    point_mask b = half_plane(edges.normal[1], 0.0);
    point_mask c = half_plane(edges.normal[2], 0.0);
    // its plane is met at height / dot(normal, way) of the way
    point_mask before = half_plane(normal, height / farthest);
    point_mask behind = half_plane(normal, height / nearest);
    for (uint i = 0u; i < uint(VECTORS); i++) {
        uvec4 x = a.at[i] ^ (0u - edges.turned[0]), y = b.at[i] ^ (0u - edges.turned[1]);
        uvec4 z = c.at[i] ^ (0u - edges.turned[2]);
        uvec4 hit = ((x & y & z) | ~(x | y | z)) & before.at[i] & ~behind.at[i];
        open.at[i] &= height > 0.0 ? ~hit : uvec4(0xffffffffu);
    }
}

bool is_open(point_mask open)
{
#if VECTORS > 1
    return (open.at[0] | open.at[1]) != uvec4(0u);
#else
    return open.at[0] != uvec4(0u);
#endif
}

point_mask all_points()
{
    point_mask all;
    for (uint i = 0u; i < uint(VECTORS); i++)
        for (uint k = 0u; k < 4u; k++) {
            int count = clamp(int(u_samples) - int(128u * i + 32u * k), 0, 32);
            all.at[i][k] = count == 32 ? 0xffffffffu : (1u << uint(count)) - 1u;
        }
    return all;
}

void main()
{
    uint index = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
                 gl_LocalInvocationIndex;
    if (index >= u_points)
        return;
    uvec2 place = places[index];
    uint relative = place.x - u_cells.x;
    bool is_placed = place.x != AREA_NOWHERE;
    if (place.y == AREA_NOWHERE || (is_placed ? relative >= u_cells.y : u_cells.x != 0u))
        return;
    area_start start = starts[index];
    vec3 from = start.origin_offset.xyz;
    to_center = u_center - from;
    float far = length(to_center), offset = start.origin_offset.w;
    vec3 normal = vec3(start.normal_x, start.normal_y, start.normal_z);
    float cosine = abs(dot(normal, to_center)) / max(far, 1e-30);
    float nearest = offset / max(cosine, 0.05) / max(far, 1e-30) + EPSILON;
    float farthest = 1.0 - 8.0 * u_nudge_m / max(far, 1e-30);
    point_mask open = all_points();
    bool is_before = dot(u_facing, to_center) < 0.0;
    uint first = is_placed && is_before ? firsts[place.x] - firsts[u_cells.x] : 0u;
    uint count = is_placed && is_before ? firsts[place.x + 1u] - firsts[place.x] : 0u;
    for (uint i = 0u; i < count && is_open(open); i++) {
        uint triangle = pairs[first + i];
        if (triangle != start.skip)
            block(open, area_edges_of(triangle, from), nearest, farthest);
    }
    for (uint i = 0u; i < u_samples; i++) {
        uint word = open.at[i / 128u][i / 32u % 4u];
        filters[place.y + i] = (word >> (i % 32u) & 1u) != 0u ? u_all : uvec2(0u);
    }
}
