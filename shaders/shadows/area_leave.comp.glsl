// SPDX-License-Identifier: MIT
// Where the shading normal is not the triangle's, the point's own triangle is found again among
// those of its cell, as the eye sees it, and its rays begin on the curved surface that the vertices
// describe: renderer/raytrace/rt_terminator.h.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"
#include "base/pack.glsl"
#include "shadows/area_triangle.glsl"
layout(local_size_x = 64) in;

layout(std430, binding = BIND_TRACED_POINTS) readonly buffer point_buffer {
    shadow_point points[];
};
layout(std430, binding = BIND_AREA_STARTS) buffer start_buffer { area_start starts[]; };
layout(std430, binding = BIND_AREA_PLACES) readonly buffer place_buffer { uvec2 places[]; };
layout(std430, binding = BIND_AREA_FIRSTS) readonly buffer first_buffer { uint firsts[]; };
layout(std430, binding = BIND_AREA_PAIRS) readonly buffer pair_buffer { uint pairs[]; };

uniform uint u_points, u_first_point; // those before are of layers, whose rays begin where they are
uniform uvec2 u_cells;

const float SAME_NORMAL = 1.0 - 1e-6; // cosine: what 16 bits a coordinate leave

struct own_hit {
    uint triangle;
    float t;
    vec3 weights;
};

void ask(uint triangle, vec3 from, vec3 direction, inout own_hit hit)
{
    if ((casters[owners[triangle]].flags & AREA_CASTER_OPAQUE) == 0u)
        return;
    area_edges edges = area_edges_of(triangle, from);
    precise vec3 e = vec3(dot(direction, edges.normal[0]), dot(direction, edges.normal[1]),
                          dot(direction, edges.normal[2]));
    uvec3 turned = uvec3(edges.turned[0], edges.turned[1], edges.turned[2]);
    uvec3 side = uvec3(greaterThanEqual(e, vec3(0.0))) ^ turned;
    vec3 weights = mix(e, -e, notEqual(turned, uvec3(0u)));
    uint sides = side.x + side.y + side.z;
    float total = weights.x + weights.y + weights.z;
    if ((sides != 0u && sides != 3u) || total == 0.0)
        return;
    weights /= total;
    float t = dot(direction, edges.corner[0] * weights.x + edges.corner[1] * weights.y +
                                 edges.corner[2] * weights.z);
    bool is_nearer = t < hit.t || (t == hit.t && triangle < hit.triangle);
    if (t > 0.0 && is_nearer)
        hit = own_hit(triangle, t, weights);
}

// Towards the planes of the vertices' normals.
void leave(uint index, vec3 at, vec3 direction, own_hit hit)
{
    uint word = corners[3u * hit.triangle].w;
    if (word == AREA_FLAT)
        return;
    vec3 corner[3], offset = vec3(0.0), normal = vec3(0.0);
    for (uint k = 0u; k < 3u; k++)
        corner[k] = uintBitsToFloat(corners[3u * hit.triangle + k].xyz);
    float side = dot(cross(corner[1] - corner[0], corner[2] - corner[0]), direction) < 0.0 ? 1.0
                                                                                         : -1.0;
    for (uint k = 0u; k < 3u; k++) {
        vec3 n = side * unpack_unit(corners[3u * hit.triangle + k].w);
        offset -= hit.weights[k] * min(dot(at - corner[k], n), 0.0) * n;
        normal += hit.weights[k] * n;
    }
    normal = normalize(normal);
    starts[index].origin_offset.xyz = at + offset;
    starts[index].normal_x = normal.x;
    starts[index].normal_y = normal.y;
    starts[index].normal_z = normal.z;
    starts[index].skip = hit.triangle;
}

void main()
{
    uint index = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
                 gl_LocalInvocationIndex;
    if (index >= u_points || index < u_first_point)
        return;
    uint cell = places[index].x, relative = cell - u_cells.x;
    shadow_point p = points[index];
    bool is_curved = dot(unpack_unit(p.geo_normal), unpack_unit(p.normal)) <= SAME_NORMAL;
    if ((p.flags & SHADOW_POINT_UNLIT) != 0u || !is_curved || cell == AREA_NOWHERE ||
        relative >= u_cells.y)
        return;
    area_start start = starts[index];
    vec3 normal = vec3(start.normal_x, start.normal_y, start.normal_z);
    float way = 4.0 * start.origin_offset.w;
    vec3 from = start.origin_offset.xyz + way * normal;
    own_hit hit = own_hit(AREA_NOWHERE, 2.0 * way, vec3(0.0));
    uint first = firsts[cell] - firsts[u_cells.x], count = firsts[cell + 1u] - firsts[cell];
    for (uint i = 0u; i < count; i++)
        ask(pairs[first + i], from, -normal, hit);
    if (hit.triangle != AREA_NOWHERE)
        leave(index, from - normal * hit.t, -normal, hit);
}
