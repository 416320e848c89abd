// SPDX-License-Identifier: MIT
// Whether ways from the eye cross a face of a shadow volume, and what they gain there. Along a way
// two coordinates are left of each point of space; a face is crossed where its corners lie about
// the middle of these. The signs are exact for the rounded coordinates, which are those of one
// vertex in whatever face it is, so that neighbouring faces share their borders without a gap.
// Needs: volume.glsl and volume_faces.glsl before it.
#include "shadows/volume_way.glsl"
#include "shadows/volume_pixel.glsl"
layout(std430, binding = BIND_VOLUME_STARTS) readonly buffer start_buffer { vec4 starts[]; };
layout(std430, binding = BIND_VOLUME_SUMS) buffer sum_buffer { int sums[]; };

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

struct looked_at {
    vec4 corners[3];
    bool is_side;
    volume_face face;
};

// 1: the way crosses the face; 0: it does not; -1: that is left open, which it never is if exact.
int crossing(looked_at at, vec3 start, bool is_exact)
{
    vec2 slope = way_slope(start);
    int wanted = way_sign(at.face.side);
    corner p = corner_of(at.corners[0], slope), q = corner_of(at.corners[1], slope);
    corner r = corner_of(at.corners[2], slope);
    ivec3 turns = is_exact ? ivec3(exact_turn(q, r), exact_turn(r, p), exact_turn(p, q))
                           : ivec3(turn(q, r), turn(r, p), turn(p, q));
    turns *= ivec3(wanted, wanted, at.is_side ? -wanted : wanted);
    vec3 share = float(wanted) * vec3(cross_of(q, r), cross_of(r, p), cross_of(p, q));
    bool is_before = is_before_end(share, p, q, r, start.z);
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

// Crosses what is looked at with the points of a pixel. Open ones are left out; or, if exact, those
// alone are taken.
void cross_points(looked_at at, uint pixel, bool is_exact, inout bool is_open)
{
    pixel_points points = points_of(pixel);
    for (uint k = 0u; k < points.count; k++) {
        uint point = point_at(points, k);
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
