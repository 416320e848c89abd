// SPDX-License-Identifier: MIT
// Crosses the ways from the eye to all points of a span of tiles with a face: a group for each
// span, an invocation for each pixel of a tile. Along a way two coordinates are left of each point
// of space; a face is crossed where its corners lie about the middle of these. The signs are exact
// for the rounded coordinates, which are those of one vertex in whatever face it is, so that
// neighbouring faces share their borders without a gap. Needs: those of volume.glsl.
#include "shadows/volume.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
#include "shadows/volume_faces.glsl"
layout(std430, binding = BIND_VOLUME_FACES) readonly buffer face_buffer { volume_face faces[]; };
layout(std430, binding = BIND_VOLUME_SPANS) readonly buffer span_buffer { uvec2 spans[]; };
layout(std430, binding = BIND_VOLUME_STARTS) readonly buffer start_buffer { vec4 starts[]; };
layout(std430, binding = BIND_VOLUME_SUMS) buffer sum_buffer { int sums[]; };
layout(std430, binding = BIND_TRACED_HEADS) readonly buffer head_buffer { uint heads[]; };
layout(std430, binding = BIND_VOLUME_ENDS) readonly buffer end_buffer { uint layer_ends[]; };
uniform uvec2 u_size_px;
uniform uint u_spans;
uniform uint u_layers; // points of layers, which come first; 0: there are no ends

struct corner {
    vec2 at;   // beside the way
    float h;   // how far `at` moves as the way moves
    float z, w;
};

float height_of(vec4 x)
{
#ifdef IS_ORTHOGRAPHIC
    return x.w;
#else
    return x.z;
#endif
}

corner corner_of(vec4 x, vec2 slope)
{
    corner c;
    c.h = height_of(x);
    precise vec2 shift = c.h * slope;
    precise vec2 at = x.xy - shift;
    c.at = at;
    c.z = x.z;
    c.w = x.w;
    return c;
}

int sign_of_difference(double a, double b)
{
    return a > b ? 1 : a < b ? -1 : 0;
}

// The sign of the cross product; where both lie on one line with the way, as if the way ran a hair
// beside it, to the same side for all.
int turn(corner a, corner b)
{
    precise float x = a.at.x * b.at.y;
    precise float y = a.at.y * b.at.x;
    if (x != y)
        return x > y ? 1 : -1;
    int found = sign_of_difference(double(a.at.x) * double(b.at.y),
                                   double(a.at.y) * double(b.at.x));
    if (found == 0)
        found = sign_of_difference(double(b.h) * double(a.at.y), double(a.h) * double(b.at.y));
    if (found == 0)
        found = sign_of_difference(double(a.h) * double(b.at.x), double(b.h) * double(a.at.x));
    return found;
}

float cross_of(corner a, corner b)
{
    return a.at.x * b.at.y - a.at.y * b.at.x;
}

bool is_crossed(vec4 a, vec4 b, vec4 c, bool is_side, int side, vec3 start)
{
#ifdef IS_ORTHOGRAPHIC
    vec2 slope = start.xy;
    int wanted = side * int(u_eye);
#else
    vec2 slope = start.xy / start.z;
    int wanted = side;
#endif
    corner p = corner_of(a, slope), q = corner_of(b, slope), r = corner_of(c, slope);
    if (turn(q, r) != wanted || turn(r, p) != wanted || turn(p, q) != (is_side ? -wanted : wanted))
        return false;
    // the crossing, homogeneous, as the way's two ends make it up: the share of the eye
    vec3 share = float(wanted) * vec3(cross_of(q, r), cross_of(r, p), cross_of(p, q));
    float z = dot(share, vec3(p.z, q.z, r.z)), w = dot(share, vec3(p.w, q.w, r.w));
#ifdef IS_ORTHOGRAPHIC
    return u_eye * (z - w * start.z) > 0.0;
#else
    return z - w * start.z > 0.0;
#endif
}

void main()
{
    uint i = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (i >= u_spans)
        return;
    uvec2 span = spans[i];
    volume_face f = faces[span.x];
    bool is_side = span.x < u_edges;
    uvec3 v = is_side ? uvec3(edges[span.x].xy, 0u) : triangles[span.x - u_edges].xyz;
    vec4 p = volume_vertex(v.x), q = volume_vertex(v.y), r = is_side ? u_light : volume_vertex(v.z);
    uint row = span.y >> 20, tile = span.y >> 10 & 1023u, end = span.y & 1023u;
    for (; tile < end; tile++) {
        uvec2 at = uvec2(tile, row) * VOLUME_TILE_PX + gl_LocalInvocationID.xy;
        if (any(greaterThanEqual(at, u_size_px)))
            continue;
        uint pixel = at.y * u_size_px.x + at.x;
        uint head = heads[pixel];
        uint layer = u_layers > 0u && pixel > 0u ? layer_ends[pixel - 1u] : 0u;
        uint layers = u_layers > 0u ? layer_ends[pixel] - layer : 0u;
        for (uint k = 0u; k < layers + (head & 7u); k++) {
            uint point = k < layers ? layer + k : u_layers + (head >> 3) + k - layers;
            vec4 start = starts[point];
            if (start.w == 0.0 || !is_crossed(p, q, r, is_side, f.side, start.xyz))
                continue;
            for (uint c = 0u; c < 3u; c++) {
                if (f.log2[c] != 0)
                    atomicAdd(sums[6u * point + c], f.log2[c]);
                if (f.stops[c] != 0)
                    atomicAdd(sums[6u * point + 3u + c], f.stops[c]);
            }
        }
    }
}
