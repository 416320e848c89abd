// SPDX-License-Identifier: MIT
// Lines against a triangle, as planes through the point that they begin at and an edge, with one
// sign for both triangles of an edge: it goes by the edge's corners in a fixed order. A line that
// runs through an edge or a corner of a closed surface thus meets one triangle there, no more and
// no less.
// Provides: area_edges, area_edges_of(triangle, from)
layout(std430, binding = BIND_AREA_CORNERS) readonly buffer corner_buffer { uvec4 corners[]; };
layout(std430, binding = BIND_AREA_OWNERS) readonly buffer owner_buffer { uint owners[]; };
layout(std430, binding = BIND_AREA_CASTERS) readonly buffer caster_buffer {
    area_caster casters[];
};

struct area_edges { // edge k is opposite corner k; relative to where the lines begin
    vec3 corner[3];
    vec3 normal[3]; // of the plane through the edge
    vec3 way[3];    // along the edge, in its fixed order
    uint turned[3]; // 1: that is not the order of the triangle
};

bool area_before(vec3 a, vec3 b)
{
    return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
}

// From corner i to corner j of the triangle. No loops: each step of one counts
// (renderer/shading/loop_steps.h).
void area_put_edge(inout area_edges edges, const uint k, const uint i, const uint j, vec3 at_i,
                   vec3 at_j)
{
    bool is_turned = area_before(at_j, at_i);
    vec3 a = is_turned ? edges.corner[j] : edges.corner[i];
    vec3 b = is_turned ? edges.corner[i] : edges.corner[j];
    precise vec3 normal = vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z,
                               a.x * b.y - a.y * b.x);
    edges.turned[k] = is_turned ? 1u : 0u;
    edges.normal[k] = normal;
    edges.way[k] = b - a;
}

area_edges area_edges_of(uint triangle, vec3 from)
{
    area_edges edges;
    vec3 a = uintBitsToFloat(corners[3u * triangle].xyz);
    vec3 b = uintBitsToFloat(corners[3u * triangle + 1u].xyz);
    vec3 c = uintBitsToFloat(corners[3u * triangle + 2u].xyz);
    edges.corner[0] = a - from;
    edges.corner[1] = b - from;
    edges.corner[2] = c - from;
    area_put_edge(edges, 0u, 1u, 2u, b, c);
    area_put_edge(edges, 1u, 2u, 0u, c, a);
    area_put_edge(edges, 2u, 0u, 1u, a, b);
    return edges;
}
