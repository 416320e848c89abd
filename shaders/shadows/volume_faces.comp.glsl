// SPDX-License-Identifier: MIT
// The faces of shadow volumes, an invocation each: on which side the eye is, and the part of the
// window that the face may be seen in before points: a few pixels, or spans of tiles. Needs: those
// of volume.glsl; IS_DRAWN: the side alone.
#include "shadows/volume.glsl"
layout(local_size_x = 64) in;
#include "shadows/volume_faces.glsl"
#include "shadows/volume_counts.glsl"
#include "shadows/volume_window.glsl"
layout(std430, binding = BIND_VOLUME_FACES) buffer face_buffer { volume_face faces[]; };
layout(std430, binding = BIND_VOLUME_SPANS) writeonly buffer span_buffer { uvec2 spans[]; };
layout(std430, binding = BIND_STATISTICS) buffer counter_buffer { uint counters[]; };
layout(std430, binding = BIND_VOLUME_SMALL) writeonly buffer small_buffer { uvec2 small[]; };
layout(std430, binding = BIND_VOLUME_TILES) readonly buffer tile_buffer { uint tiles[]; };
uniform uvec2 u_faces;       // the first of them, and the end
uniform uint u_room;         // for spans
uniform uint u_span_tiles;   // the longest span
uniform uint u_tiles_x;      // of a row

// ---- where it is seen ----

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

// Its columns within rows, of its outline cut there, and how far ways have come there at least.
vec2 columns_within(vec2 rows, out float nearest)
{
    vec2 found = vec2(1e9, -1e9);
    nearest = 1e30;
    for (int i = 0; i < 5; i++) {
        vec2 t = vec2(0.0, 1.0);
        cut(t, above_row(rows.x, begins[i]), above_row(rows.x, ends[i]));
        cut(t, -above_row(rows.y, begins[i]), -above_row(rows.y, ends[i]));
        if (!is_there[i] || t.x > t.y)
            continue;
        vec4 a = mix(begins[i], ends[i], t.x), b = mix(begins[i], ends[i], t.y);
        nearest = min(nearest, min(depth_of(a), depth_of(b)));
        vec2 x = vec2(pixel_of(a).x, pixel_of(b).x);
        found = vec2(min(found.x, min(x.x, x.y)), max(found.y, max(x.x, x.y)));
    }
    return found;
}

// Its pixels along an axis.
vec2 extent(int axis)
{
    vec2 found = vec2(1e9, -1e9);
    for (int i = 0; i < 5; i++) {
        vec2 x = vec2(pixel_of(begins[i])[axis], pixel_of(ends[i])[axis]);
        if (is_there[i])
            found = vec2(min(found.x, min(x.x, x.y)), max(found.y, max(x.x, x.y)));
    }
    return found;
}

// How far ways have come at least where they cross it.
float nearest_depth()
{
    float found = 1e30;
    for (int i = 0; i < 5; i++)
        if (is_there[i])
            found = min(found, min(depth_of(begins[i]), depth_of(ends[i])));
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

// The tiles of a row with points that the light gets to, some of them behind the face.
void find_row(uint face, uint row, uvec2 columns, uint least)
{
    uint begin = columns.x;
    for (uint column = columns.x; column <= columns.y; column++) {
        if (column < columns.y && tiles[row * u_tiles_x + column] > least)
            continue;
        if (begin < column)
            add_spans(face, row, begin, column);
        begin = column + 1u;
    }
}

// One that covers few pixels.
void add_small(uint face, uvec2 begin, uvec2 size, uint least)
{
    bool is_behind = true;
    for (uint i = 0u; i < 9u; i++) { // tiles: three at most for 15 pixels
        uvec2 at = begin + min(uvec2(i % 3u, i / 3u) * VOLUME_TILE_PX, size - 1u);
        uvec2 tile = at / VOLUME_TILE_PX;
        is_behind = is_behind && tiles[tile.y * u_tiles_x + tile.x] <= least;
    }
    if (!is_behind)
        small[atomicAdd(counters[VOLUME_SMALL], 1u)] = uvec2(face, volume_small_box(begin, size));
}

// A depth that nothing before the face has, where ways cross it at `nearest`: that is rounded.
uint order_before(float nearest, float size)
{
    return volume_order(nearest - 1e-4 * (abs(nearest) + size));
}

void find_spans(uint face, float size)
{
    uvec2 first = ~uvec2(counters[VOLUME_FIRST_PIXEL], counters[VOLUME_FIRST_PIXEL + 1u]);
    uvec2 end = uvec2(counters[VOLUME_END_PIXEL], counters[VOLUME_END_PIXEL + 1u]);
    if (any(greaterThanEqual(first, end)))
        return;
    // positions are rounded: a hundredth of a pixel is ten times what that makes in 4096
    float border = uintBitsToFloat(counters[VOLUME_BORDER]) + 0.01;
    vec2 x = extent(0) + vec2(-border, border), y = extent(1) + vec2(-border, border);
    vec2 low = max(ceil(vec2(x.x, y.x) - 0.5), vec2(first));
    vec2 high = min(floor(vec2(x.y, y.y) + 0.5), vec2(end)); // past the last
    if (any(greaterThanEqual(low, high)))
        return;
    uvec2 begin = uvec2(low), extent_px = uvec2(high) - begin;
    if (max(extent_px.x, extent_px.y) <= VOLUME_SMALL_SIDE_PX &&
        extent_px.x * extent_px.y <= VOLUME_SMALL_PIXELS) {
        add_small(face, begin, extent_px, order_before(nearest_depth(), size));
        return;
    }
    const float side = float(VOLUME_TILE_PX);
    vec2 all = vec2(floor(low.x / side), ceil(high.x / side));
    uint row_end = (uint(high.y) + VOLUME_TILE_PX - 1u) / VOLUME_TILE_PX;
    for (uint row = begin.y / VOLUME_TILE_PX; row < row_end; row++) {
        float nearest;
        vec2 columns = columns_within(side * vec2(row, row + 1u) + vec2(-border, border), nearest);
        columns = clamp((columns + vec2(-border, border)) / side, all.xx, all.yy);
        find_row(face, row, uvec2(columns.x, ceil(columns.y)), order_before(nearest, size));
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
    volume_face f = is_side ? faces[i] : volume_cap(i - u_edges, 1);
#ifdef IS_DRAWN
    faces[i] = f; // of side 0
#endif
    if (f.log2 == ivec3(0) && f.stops == ivec3(0))
        return;
    uvec3 of = is_side ? uvec3(edges[f.edge].xy, 0u) : triangles[i - u_edges].xyz;
    vec4 a = volume_vertex(of.x), b = volume_vertex(of.y);
    vec4 c = is_side ? u_light : volume_vertex(of.z);
    f.side = volume_side_of_eye(a, b, c);
    faces[i] = f;
#ifndef IS_DRAWN
    if (f.side == 0)
        return;
    float size = max(size_of(a), size_of(b));
#ifdef IS_ORTHOGRAPHIC
    const float least = 1e-6; // of vertices at infinity
#else
    float least = 1e-5 * size;
#endif
    find_outline(a, b, is_side ? away(b) : c, is_side ? away(a) : c, least);
    find_spans(i, is_side ? size : max(size, size_of(c)));
#endif
}
