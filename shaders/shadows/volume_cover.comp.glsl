// SPDX-License-Identifier: MIT
// Crosses the ways from the eye to all points of a span of tiles with a face: a group for each
// span, an invocation for each pixel of a tile; IS_SMALL: to those of a few pixels, an invocation
// for each face. Along a way two coordinates are left of each point of space; a face is crossed
// where its corners lie about the middle of these. The signs are exact for the rounded coordinates,
// which are those of one vertex in whatever face it is, so that neighbouring faces share their
// borders without a gap. Needs: those of volume.glsl; IS_SMALL.
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
uniform uint u_spans;   // or faces of a few pixels
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

// The sign of the cross product; 0: f32 leaves it open.
int turn(corner a, corner b)
{
    precise float x = a.at.x * b.at.y;
    precise float y = a.at.y * b.at.x;
    return x > y ? 1 : x < y ? -1 : 0;
}

// Likewise, never 0 but where two corners are one: where both lie on one line with the way, as if
// the way ran a hair beside it, to the same side for all.
int exact_turn(corner a, corner b)
{
    int found = exact_sign_of_difference(a.at.x, b.at.y, a.at.y, b.at.x);
    if (found == 0)
        found = exact_sign_of_difference(b.h, a.at.y, a.h, b.at.y);
    if (found == 0)
        found = exact_sign_of_difference(a.h, b.at.x, b.h, a.at.x);
    return found;
}

float cross_of(corner a, corner b)
{
    return a.at.x * b.at.y - a.at.y * b.at.x;
}

struct looked_at {
    vec4 corners[3];
    bool is_side;
    volume_face face;
};

// 1: the way crosses the face; 0: it does not; -1: that is left open, which it never is if exact.
int crossing(looked_at at, vec3 start, bool is_exact)
{
#ifdef IS_ORTHOGRAPHIC
    vec2 slope = start.xy;
    int wanted = at.face.side * int(u_eye);
#else
    vec2 slope = start.xy / start.z;
    int wanted = at.face.side;
#endif
    corner p = corner_of(at.corners[0], slope), q = corner_of(at.corners[1], slope);
    corner r = corner_of(at.corners[2], slope);
    ivec3 turns = is_exact ? ivec3(exact_turn(q, r), exact_turn(r, p), exact_turn(p, q))
                           : ivec3(turn(q, r), turn(r, p), turn(p, q));
    turns *= ivec3(wanted, wanted, at.is_side ? -wanted : wanted);
    // the crossing, homogeneous, as the way's two ends make it up: the share of the eye
    vec3 share = float(wanted) * vec3(cross_of(q, r), cross_of(r, p), cross_of(p, q));
    float z = dot(share, vec3(p.z, q.z, r.z)), w = dot(share, vec3(p.w, q.w, r.w));
#ifdef IS_ORTHOGRAPHIC
    bool is_before = u_eye * (z - w * start.z) > 0.0;
#else
    bool is_before = z - w * start.z > 0.0;
#endif
    int least = min(turns.x, min(turns.y, turns.z));
    return least < 0 || !is_before ? 0 : least > 0 ? 1 : is_exact ? 0 : -1;
}

void add_to(uint point, volume_face face)
{
    for (uint c = 0u; c < 3u; c++) {
        if (face.log2[c] != 0)
            atomicAdd(sums[6u * point + c], face.side * face.log2[c]);
        if (face.stops[c] != 0)
            atomicAdd(sums[6u * point + 3u + c], face.side * face.stops[c]);
    }
}

// Crosses what the invocation looks at with the points of a pixel. Open ones are left out; or, if
// exact, those alone are taken.
void cross_points(looked_at at, uvec2 pixel_at, bool is_exact, inout bool is_open)
{
    if (any(greaterThanEqual(pixel_at, u_size_px)))
        return;
    uint pixel = pixel_at.y * u_size_px.x + pixel_at.x;
    uint head = heads[pixel];
    uint layer = u_layers > 0u && pixel > 0u ? layer_ends[pixel - 1u] : 0u;
    uint layers = u_layers > 0u ? layer_ends[pixel] - layer : 0u;
    for (uint k = 0u; k < layers + (head & 7u); k++) {
        uint point = k < layers ? layer + k : u_layers + (head >> 3) + k - layers;
        vec4 start = starts[point];
        if (start.w == 0.0)
            continue;
        int found = crossing(at, start.xyz, false);
        is_open = is_open || found < 0;
        if (is_exact)
            found = found < 0 ? crossing(at, start.xyz, true) : 0;
        if (found > 0)
            add_to(point, at.face);
    }
}

void main()
{
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
#ifdef IS_SMALL
    uint i = group * 64u + gl_LocalInvocationIndex;
#else
    uint i = group;
#endif
    if (i >= u_spans)
        return;
    uvec2 span = spans[i];
    bool is_side = span.x < u_edges;
    volume_face face = faces[span.x];
    uvec3 v = is_side ? uvec3(edges[face.edge].xy, 0u) : triangles[span.x - u_edges].xyz;
    vec4 third = is_side ? u_light : volume_vertex(v.z);
    looked_at at = looked_at(vec4[](volume_vertex(v.x), volume_vertex(v.y), third), is_side, face);
#ifdef IS_SMALL
    uvec2 first = uvec2(span.y, span.y >> 12) & 4095u;
    uint width = span.y >> 24 & 15u, count = width * (span.y >> 28);
#define PIXEL(k) (first + uvec2((k) % width, (k) / width))
#else
    uint row = span.y >> 20, tile = span.y >> 10 & 1023u, count = (span.y & 1023u) - tile;
#define PIXEL(k) (uvec2(tile + (k), row) * VOLUME_TILE_PX + gl_LocalInvocationID.xy)
#endif
    bool is_open = false;
    for (uint k = 0u; k < count; k++)
        cross_points(at, PIXEL(k), false, is_open);
    uint again = is_open ? count : 0u; // few, and what is exact takes long
    for (uint k = 0u; k < again; k++)
        cross_points(at, PIXEL(k), true, is_open);
}
