// SPDX-License-Identifier: MIT
// The grid before a light in which points meet the triangles that may block it: Wang, Zhou, Ke and
// Popescu 2014, "GEARS: A General and Efficient Algorithm for Rendering Shadows", section 3.1.
// Points are projected from a centre on the light's axis, behind it, or from the light itself where
// it is a point. docs/explanation/area-shadows.md says what is bounded, and how.
// Needs: AREA_KIND. Provides, for positions relative to the scene's origin:
//   area_place(position, face, uv, depth)  where a point is projected; false: nothing arrives
//   area_bounds(face, low, high, farthest, aside)  of all points of a face; false: it has none
//   area_slot(uv, low, high)  of both axes of a face
//   area_cell(face, uv, low, high), area_cell_index  a cell's place among those of the face
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"

layout(std430, binding = BIND_AREA_CELLS) buffer cell_buffer { uint cells[]; };
uniform vec3 u_center;                     // of the light; of parallel light any place
uniform vec3 u_axis_x, u_axis_y, u_axis_z; // unit; z along the light
uniform vec2 u_half;                       // of the area, along x and y
uniform float u_behind;                    // how far the projection's centre is behind it

#if AREA_KIND == AREA_POINT
const uint FACES = 6u;
const int SIDE = AREA_FACE_SIDE;
#else
const uint FACES = 1u;
const int SIDE = AREA_SIDE;
#endif

// Floats as integers of the same order.
uint area_ordered(float f)
{
    uint bits = floatBitsToUint(f);
    return bits ^ ((bits & 0x80000000u) != 0u ? 0xffffffffu : 0x80000000u);
}

float area_unordered(uint word)
{
    return uintBitsToFloat(word ^ ((word & 0x80000000u) != 0u ? 0x80000000u : 0xffffffffu));
}

// In the light's frame.
vec3 area_from(vec3 position)
{
    vec3 p = position - u_center;
    return vec3(dot(p, u_axis_x), dot(p, u_axis_y), dot(p, u_axis_z));
}

// As a face around a point sees it, z into the face.
vec3 area_turn(vec3 p, uint face)
{
    vec3 turned = face < 2u ? p.yzx : face < 4u ? p.zxy : p;
    return (face & 1u) != 0u ? vec3(turned.xy, -turned.z) : turned;
}

uint area_face_of(vec3 p)
{
    vec3 size = abs(p);
    if (size.x >= size.y && size.x >= size.z)
        return p.x < 0.0 ? 1u : 0u;
    if (size.y >= size.z)
        return p.y < 0.0 ? 3u : 2u;
    return p.z < 0.0 ? 5u : 4u;
}

// Of a position in the frame of the face.
vec2 area_project(vec3 p)
{
#if AREA_KIND == AREA_RECTANGLE
    return p.xy / (p.z + u_behind);
#elif AREA_KIND == AREA_POINT
    return p.xy / p.z;
#else
    return p.xy;
#endif
}

bool area_place(vec3 position, out uint face, out vec2 uv, out float depth)
{
    vec3 p = area_from(position);
    face = 0u;
    uv = vec2(0.0);
    depth = 0.0;
#if AREA_KIND == AREA_POINT
    face = area_face_of(p);
    p = area_turn(p, face);
#endif
#if AREA_KIND != AREA_PARALLEL
    if (!(p.z > 0.0))
        return false;
#endif
    uv = area_project(p);
    depth = p.z;
    return true;
}

// Words of a face: least and (inverted) largest u and v, (inverted) farthest depth, (inverted) how
// far aside of their points rays begin, in u and v.
bool area_bounds(uint face, out vec2 low, out vec2 high, out float farthest, out vec2 aside)
{
    uint at = face * uint(AREA_FACE_WORDS);
    low = vec2(area_unordered(cells[at]), area_unordered(cells[at + 1u]));
    high = vec2(area_unordered(~cells[at + 2u]), area_unordered(~cells[at + 3u]));
    farthest = area_unordered(~cells[at + 4u]);
    aside = vec2(area_unordered(~cells[at + 5u]), area_unordered(~cells[at + 6u]));
    return cells[at] != 0xffffffffu;
}

uvec2 area_slot(vec2 uv, vec2 low, vec2 high)
{
    vec2 size = high - low;
    vec2 share = vec2(size.x > 0.0 ? (uv.x - low.x) / size.x : 0.0,
                      size.y > 0.0 ? (uv.y - low.y) / size.y : 0.0);
    return uvec2(clamp(ivec2(floor(share * float(AREA_SLOTS))), ivec2(0), ivec2(AREA_SLOTS - 1)));
}

// The first slot of an axis of a face.
uint area_slots_at(uint face, uint axis)
{
    return (2u * face + axis) * uint(AREA_SLOTS);
}

// Once slots have their cells.
ivec2 area_cell(uint face, vec2 uv, vec2 low, vec2 high)
{
    uvec2 at = uvec2(AREA_BOUND_WORDS) + area_slot(uv, low, high);
    return ivec2(cells[at.x + area_slots_at(face, 0u)], cells[at.y + area_slots_at(face, 1u)]);
}

uint area_cell_index(uint face, ivec2 cell)
{
    return (face * uint(SIDE) + uint(cell.y)) * uint(SIDE) + uint(cell.x);
}
