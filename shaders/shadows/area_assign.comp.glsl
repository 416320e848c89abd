// SPDX-License-Identifier: MIT
// Triangles to cells: those in which a triangle may block the light of some point. What it blocks
// lies between its projection and that of its extrusion, away from every point of the light, to the
// farthest point of the cells; both are bounded by a rectangle, which is widened by what rounding
// and the starts of rays may be off by.
//   PASS=0  counts the triangles of each cell
//   PASS=1  puts them in their places
// Needs: PASS, AREA_KIND.
#include "shadows/area_grid.glsl"
layout(local_size_x = 64) in;

layout(std430, binding = BIND_AREA_CORNERS) readonly buffer corner_buffer { uvec4 corners[]; };
layout(std430, binding = BIND_AREA_COUNTS) buffer count_buffer { uint counts[]; };
#if PASS == 1
layout(std430, binding = BIND_AREA_FIRSTS) readonly buffer first_buffer { uint firsts[]; };
layout(std430, binding = BIND_AREA_PAIRS) writeonly buffer pair_buffer { uint pairs[]; };
#endif

uniform uint u_triangles;
uniform uvec2 u_cells; // those that are filled: first, count; pairs begin with the first one's
uniform float u_error; // what the light's points are off by [m]

const float ROUNDING = 1e-6; // of a length in f32, after a rotation

struct area_outline { // of a triangle
    vec3 at[3];
    vec2 low, high; // of x and y
    float error;    // of each coordinate
};

struct area_box { // of what it blocks, and its nearest depth
    vec2 low, high;
    float nearest;
};

// Nearest and farthest projection of one coordinate, in [error, error] about x, at z.
vec2 spread(float x, float z, float error)
{
    float near = max(z - error, 0.0) + u_behind, far = max(z + error, 0.0) + u_behind;
    float low = x - error, high = x + error;
    return vec2(low / (low > 0.0 ? far : near), high / (high > 0.0 ? near : far));
}

const float UNBOUNDED = 1e30;

void add_corner(inout area_box box, area_outline outline, vec3 p, float farthest)
{
    float e = outline.error, z = p.z - e;
    box.nearest = min(box.nearest, z);
#if AREA_KIND == AREA_PARALLEL
    box.low = min(box.low, p.xy - e);
    box.high = max(box.high, p.xy + e);
#elif AREA_KIND == AREA_POINT
    vec2 u = spread(p.x, p.z, e), v = spread(p.y, p.z, e);
    box.low = z > 0.0 ? min(box.low, vec2(u.x, v.x)) : vec2(-UNBOUNDED);
    box.high = z > 0.0 ? max(box.high, vec2(u.y, v.y)) : vec2(UNBOUNDED);
#else
    // where the triangle meets the light's plane, if it does, is somewhere between its corners
    vec2 low = z > 0.0 ? p.xy : outline.low, high = z > 0.0 ? p.xy : outline.high;
    box.low = min(box.low, vec2(spread(low.x, p.z, e).x, spread(low.y, p.z, e).x));
    box.high = max(box.high, vec2(spread(high.x, p.z, e).y, spread(high.y, p.z, e).y));
    // extruded from the light's corners: L + (B - L) * ratio; a corner behind all points is not
    float ratio = z > 0.0 ? min(farthest / z, UNBOUNDED) : UNBOUNDED;
    if (ratio <= 1.0)
        return;
    float plane = farthest + u_behind;
    box.low = min(box.low, ((low - e - u_half) * ratio + u_half) / plane);
    box.high = max(box.high, ((high + e + u_half) * ratio - u_half) / plane);
#endif
}

// The rectangle that holds the projection of all that the triangle blocks up to a depth. A triangle
// that surrounds the light, or a part of it, is taken to block whatever is in sight.
area_box find_box(area_outline outline, float farthest, vec2 off)
{
    area_box box = area_box(vec2(UNBOUNDED), vec2(-UNBOUNDED), UNBOUNDED);
    add_corner(box, outline, outline.at[0], farthest);
    add_corner(box, outline, outline.at[1], farthest);
    add_corner(box, outline, outline.at[2], farthest);
#if AREA_KIND == AREA_POINT
    if (box.nearest <= 0.0) {
        box.low = vec2(-UNBOUNDED);
        box.high = vec2(UNBOUNDED);
    }
#endif
    box.low = clamp(box.low, -UNBOUNDED, UNBOUNDED) - off;
    box.high = clamp(box.high, -UNBOUNDED, UNBOUNDED) + off;
    return box;
}

// How far a point's projection may be from where its rays begin: by the starts, and by rounding.
vec2 find_off(vec2 low, vec2 high, float farthest, vec2 aside)
{
    vec2 most = max(abs(low), abs(high));
#if AREA_KIND == AREA_RECTANGLE
    float reach = most.x + most.y + farthest / (farthest + u_behind);
    return aside + (4.0 * ROUNDING * reach + 2.0 * u_error / u_behind) * (1.0 + most);
#elif AREA_KIND == AREA_POINT
    return aside + 10.0 * ROUNDING;
#else
    return aside + u_error + 4.0 * ROUNDING * (most.x + most.y);
#endif
}

// First and last cell; false: the rectangle is beside all of them.
bool find_cells(uint face, area_box box, vec2 low, vec2 high, out ivec2 first, out ivec2 last)
{
    first = area_cell(face, clamp(box.low, low, high), low, high);
    last = area_cell(face, clamp(box.high, low, high), low, high);
    return all(lessThanEqual(box.low, high)) && all(greaterThanEqual(box.high, low));
}

// Ordered and inverted, as it is stored: the greater the word, the nearer.
uint depth_in(uint face, ivec2 cell)
{
    return cells[uint(AREA_HEAD_WORDS) + area_cell_index(face, cell)];
}

void put(uint cell, uint triangle)
{
#if PASS == 0
    atomicAdd(counts[cell], 1u);
#else
    uint relative = cell - u_cells.x;
    if (relative < u_cells.y)
        pairs[firsts[cell] - firsts[u_cells.x] + atomicAdd(counts[cell], 0xffffffffu) - 1u] =
            triangle;
#endif
}

#if AREA_KIND == AREA_POINT
vec4 heights_over(vec3 p, vec2 low, vec2 high)
{
    return vec4(p.xy - low * p.z, high * p.z - p.xy);
}

// Whether some of it may be in the pyramid over the rectangle that all points of the face lie in.
bool is_in_sight(area_outline outline, vec2 low, vec2 high)
{
    vec2 most = max(abs(low), abs(high));
    float wide = 2.0 * outline.error * (1.0 + max(most.x, most.y));
    vec4 greatest = max(max(heights_over(outline.at[0], low, high),
                            heights_over(outline.at[1], low, high)),
                        heights_over(outline.at[2], low, high));
    return all(greaterThanEqual(greatest, vec4(-wide)));
}
#endif

void assign(area_outline outline, uint face, uint triangle)
{
    vec2 low, high, aside;
    float farthest;
    ivec2 first, last;
    if (!area_bounds(face, low, high, farthest, aside))
        return;
    vec2 off = find_off(low, high, farthest, aside);
#if AREA_KIND == AREA_POINT
    outline.at[0] = area_turn(outline.at[0], face);
    outline.at[1] = area_turn(outline.at[1], face);
    outline.at[2] = area_turn(outline.at[2], face);
    if (!is_in_sight(outline, low - off, high + off))
        return;
#elif AREA_KIND == AREA_RECTANGLE
    if (max(outline.at[0].z, max(outline.at[1].z, outline.at[2].z)) < -outline.error)
        return;
#endif
    area_box box = find_box(outline, farthest, off);
    if (box.nearest > farthest || !find_cells(face, box, low, high, first, last))
        return;
#if AREA_KIND == AREA_RECTANGLE
    // no farther than the points of these cells: the extrusion correction
    uint far = 0xffffffffu;
    for (int y = first.y; y <= last.y; y++)
        for (int x = first.x; x <= last.x; x++)
            far = min(far, depth_in(face, ivec2(x, y)));
    if (far == 0xffffffffu || box.nearest > area_unordered(~far))
        return;
    box = find_box(outline, area_unordered(~far), off);
    if (!find_cells(face, box, low, high, first, last))
        return;
#endif
    uint near = ~area_ordered(box.nearest);
    for (int y = first.y; y <= last.y; y++)
        for (int x = first.x; x <= last.x; x++)
            if (depth_in(face, ivec2(x, y)) <= near)
                put(area_cell_index(face, ivec2(x, y)), triangle);
}

void main()
{
    uint triangle = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
                    gl_LocalInvocationIndex;
    if (triangle >= u_triangles)
        return;
    area_outline outline;
    float size = 0.0;
    for (uint i = 0u; i < 3u; i++) {
        vec3 position = uintBitsToFloat(corners[3u * triangle + i].xyz);
        outline.at[i] = area_from(position);
#if AREA_KIND == AREA_PARALLEL
        size = max(size, length(position) + length(u_center));
#else
        size = max(size, length(outline.at[i]));
#endif
    }
    outline.low = min(outline.at[0].xy, min(outline.at[1].xy, outline.at[2].xy));
    outline.high = max(outline.at[0].xy, max(outline.at[1].xy, outline.at[2].xy));
    outline.error = u_error + ROUNDING * (size + u_half.x + u_half.y);
    for (uint face = 0u; face < FACES; face++)
        assign(outline, face, triangle);
}
