// SPDX-License-Identifier: MIT
// The faces of shadow volumes, an invocation each: what a way from the eye that crosses the face
// gains or loses, and the tiles of the window that it may be seen in, as spans of tiles. Nothing of
// edges whose triangles cancel. Needs: those of volume.glsl.
#include "shadows/volume.glsl"
layout(local_size_x = 64) in;
#include "shadows/volume_faces.glsl"
layout(std430, binding = BIND_VOLUME_FACES) writeonly buffer face_buffer { volume_face faces[]; };
layout(std430, binding = BIND_VOLUME_SPANS) writeonly buffer span_buffer { uvec2 spans[]; };
layout(std430, binding = BIND_STATISTICS) buffer counter_buffer { uint counters[]; };
layout(std430, binding = BIND_VOLUME_SIDES) readonly buffer side_buffer { uvec2 sides[]; };
uniform uvec2 u_faces;       // the first of them, and the end
uniform uint u_room;         // for spans
uniform uint u_span_tiles;   // the longest span
uniform vec4 u_window;       // view-plane x, y = xy + zw * (pixel of the image + sub-pixel offset)
uniform uvec2 u_window_first;

// ---- what it counts ----

// Of `count` triangles from the first side on, or of one, which is the face itself.
volume_face count_of(bool is_side, uvec4 of)
{
    volume_face f = volume_face(ivec3(0), 0, ivec3(0), 0);
    uint end = is_side ? of.z + of.w : 1u;
    for (uint i = is_side ? of.z : 0u; i < end; i++) {
        uvec2 side = is_side ? sides[i] : of.zw;
        uint o = side.x;
        bool is_between = is_side && o > of.x && o < of.y;
        uvec3 sorted = o < of.x     ? uvec3(o, of.xy)
                       : is_between ? uvec3(of.x, o, of.y)
                                    : uvec3(of.xy, o);
        if (!volume_is_reached(side.y))
            continue;
        int light = volume_side_of_light(sorted);
        if (light == 0)
            continue;
        volume_loss loss = volume_loss_of(side.y);
        int sign = is_between ? -light : light;
        f.log2 += sign * loss.log2;
        f.stops += sign * loss.stops;
    }
    return f;
}

// ---- where it is seen ----

const float BORDER = 2.0; // pixels: positions are rounded

float height_of(vec4 a)
{
#ifdef IS_ORTHOGRAPHIC
    return a.w;
#else
    return -a.z;
#endif
}

// The outline before the eye: five segments at the most, where it is cut there.
vec4 begins[5], ends[5];
bool is_there[5];

void find_outline(vec4 a, vec4 b, vec4 c, vec4 d, float least)
{
    vec4 cuts[2];
    int cut_count = 0;
    for (int i = 0; i < 4; i++) {
        vec4 p = i == 0 ? a : i == 1 ? b : i == 2 ? c : d;
        vec4 q = i == 0 ? b : i == 1 ? c : i == 2 ? d : a;
        float x = height_of(p) - least, y = height_of(q) - least;
        is_there[i] = x >= 0.0 || y >= 0.0;
        begins[i] = p;
        ends[i] = q;
        if ((x >= 0.0) != (y >= 0.0)) {
            vec4 between = mix(p, q, x / (x - y));
            if (x < 0.0)
                begins[i] = between;
            else
                ends[i] = between;
            if (cut_count == 0)
                cuts[0] = between;
            else
                cuts[1] = between;
            cut_count++;
        }
    }
    is_there[4] = cut_count > 1;
    begins[4] = cuts[0];
    ends[4] = cuts[1];
}

vec2 pixel_of(vec4 a)
{
    return (a.xy / height_of(a) - u_window.xy) / u_window.zw - vec2(u_window_first);
}

// How far a point is above a row of pixels, times its height.
float above_row(float row, vec4 a)
{
    float edge = u_window.y + u_window.w * (float(u_window_first.y) + row);
    return a.y - edge * height_of(a);
}

// Of a way from x to y what is not negative.
void cut(inout vec2 t, float x, float y)
{
    if (x < 0.0)
        t.x = y < 0.0 ? 2.0 : max(t.x, x / (x - y));
    else if (y < 0.0)
        t.y = min(t.y, x / (x - y));
}

// Its columns within rows, of its outline cut there.
vec2 columns_within(vec2 rows)
{
    vec2 found = vec2(1e9, -1e9);
    for (int i = 0; i < 5; i++) {
        vec2 t = vec2(0.0, 1.0);
        cut(t, above_row(rows.x, begins[i]), above_row(rows.x, ends[i]));
        cut(t, -above_row(rows.y, begins[i]), -above_row(rows.y, ends[i]));
        if (!is_there[i] || t.x > t.y)
            continue;
        vec2 x = vec2(pixel_of(mix(begins[i], ends[i], t.x)).x,
                      pixel_of(mix(begins[i], ends[i], t.y)).x);
        found = vec2(min(found.x, min(x.x, x.y)), max(found.y, max(x.x, x.y)));
    }
    return found;
}

vec2 all_rows()
{
    vec2 found = vec2(1e9, -1e9);
    for (int i = 0; i < 5; i++) {
        vec2 y = vec2(pixel_of(begins[i]).y, pixel_of(ends[i]).y);
        if (is_there[i])
            found = vec2(min(found.x, min(y.x, y.y)), max(found.y, max(y.x, y.y)));
    }
    return found;
}

void add_spans(uint face, uint row, uint first, uint end)
{
    uint pieces = (end - first + u_span_tiles - 1u) / u_span_tiles;
    uint at = atomicAdd(counters[0], pieces);
    for (uint i = 0u; i < pieces && at + i < u_room; i++) {
        uint begin = first + i * u_span_tiles;
        spans[at + i] = uvec2(face, volume_span(row, begin, min(end, begin + u_span_tiles)));
    }
}

// Only where points are that the light gets to.
void find_spans(uint face)
{
    uvec2 first = ~uvec2(counters[VOLUME_FIRST_PIXEL], counters[VOLUME_FIRST_PIXEL + 1u]);
    uvec2 end = uvec2(counters[VOLUME_END_PIXEL], counters[VOLUME_END_PIXEL + 1u]);
    if (any(greaterThanEqual(first, end)))
        return;
    vec2 first_tile = vec2(first / VOLUME_TILE_PX);
    vec2 end_tile = vec2((end + VOLUME_TILE_PX - 1u) / VOLUME_TILE_PX);
    const float side = float(VOLUME_TILE_PX);
    vec2 rows = (all_rows() + vec2(-BORDER, BORDER)) / side;
    rows = clamp(rows, first_tile.yy, end_tile.yy);
    for (uint row = uint(rows.x); row < uint(ceil(rows.y)); row++) {
        vec2 columns = columns_within(side * vec2(row, row + 1u) + vec2(-BORDER, BORDER));
        columns = clamp((columns + vec2(-BORDER, BORDER)) / side, first_tile.xx, end_tile.xx);
        uint column = uint(columns.x), column_end = uint(ceil(columns.y));
        if (column < column_end)
            add_spans(face, row, column, column_end);
    }
}

// From the vertex away from the light, at infinity.
vec4 away(vec4 a)
{
    return vec4(a.xyz * u_light.w - u_light.xyz, 0.0);
}

float size_of(vec4 a)
{
    return max(abs(a.x), max(abs(a.y), abs(a.z)));
}

void main()
{
    uint i = u_faces.x + (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
             gl_LocalInvocationID.x;
    if (i >= u_faces.y)
        return;
    bool is_side = i < u_edges;
    uvec4 of = is_side ? edges[i] : triangles[i - u_edges];
    volume_face f = count_of(is_side, of);
    bool counts = f.log2 != ivec3(0) || f.stops != ivec3(0);
    vec4 a = volume_vertex(of.x), b = volume_vertex(of.y);
    vec4 c = is_side ? u_light : volume_vertex(of.z);
    if (counts) {
        f.side = volume_side_of_eye(a, b, c);
        f.log2 *= f.side;
        f.stops *= f.side;
    }
    faces[i] = f;
    if (f.side == 0)
        return;
#ifdef IS_ORTHOGRAPHIC
    const float least = 1e-6; // of vertices at infinity
#else
    float least = 1e-5 * max(size_of(a), size_of(b));
#endif
    find_outline(a, b, is_side ? away(b) : c, is_side ? away(a) : c, least);
    find_spans(i);
}
