// SPDX-License-Identifier: MIT
// Points that a light may reach, and the cells that they lie in.
//   PASS=0  the bounds of all points, and each point's first filter
//   PASS=1  how many points each slot has (area_slots.comp.glsl)
//   PASS=2  each point's cell, and the farthest depth in each
// Needs: PASS, AREA_KIND; LIGHT_LIST, without which all points have one and the same light.
#include "shadows/area_grid.glsl"
layout(local_size_x = 64) in;

layout(std430, binding = BIND_TRACED_POINTS) readonly buffer point_buffer {
    shadow_point points[];
};
#if PASS == 1
layout(std430, binding = BIND_AREA_COUNTS) buffer count_buffer { uint counts[]; };
#endif
layout(std430, binding = BIND_AREA_STARTS) readonly buffer start_buffer { area_start starts[]; };
layout(std430, binding = BIND_AREA_PLACES) buffer place_buffer { uvec2 places[]; };
layout(std430, binding = BIND_AREA_TABLE) readonly buffer table_buffer { uvec2 table[]; };
layout(std430, binding = BIND_AREA_LIGHTS) readonly buffer light_buffer { uint light_filters[]; };

uniform uint u_points, u_light;
uniform float u_asides; // rays begin so many offsets aside of their points
uniform uvec2 u_light_chunk;

#ifdef LIGHT_LIST
#include "lights/light_list.glsl"
// Filters of the point before those of the light; AREA_NOWHERE: the light is not in its list.
uint find_light(uint cluster)
{
    light_cursor cursor = light_list_at(cluster);
    light_list_chunk(cursor, u_light_chunk.x, u_light_chunk.y);
    uint before = 0u, light;
    while (light_list_next(cursor, light)) {
        if (light == u_light)
            return before;
        before += light_filters[light];
    }
    return AREA_NOWHERE;
}
#endif

// Atomic where it may change something.
void lower(uint at, uint word)
{
    if (word < cells[at])
        atomicMin(cells[at], word);
}

void main()
{
    uint index = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
                 gl_LocalInvocationIndex;
    if (index >= u_points)
        return;
    uint first = table[index].x;
    bool is_asked = (points[index].flags & SHADOW_POINT_UNLIT) == 0u;
#ifdef LIGHT_LIST
#if PASS == 0
    uint before = is_asked ? find_light(table[index].y) : AREA_NOWHERE;
    first = before == AREA_NOWHERE ? AREA_NOWHERE : table[index].x + before;
#else
    first = places[index].y;
#endif
    is_asked = first != AREA_NOWHERE;
#endif
    area_start start = starts[index];
    uint face;
    vec2 uv;
    float depth;
    bool is_placed = is_asked && area_place(start.origin_offset.xyz, face, uv, depth);
#if PASS == 0
    places[index] = uvec2(AREA_NOWHERE, first);
    if (!is_placed)
        return;
    vec3 normal = vec3(start.normal_x, start.normal_y, start.normal_z);
    vec3 p = area_from(start.origin_offset.xyz);
    vec3 aside = u_asides * start.origin_offset.w *
                 vec3(dot(normal, u_axis_x), dot(normal, u_axis_y), dot(normal, u_axis_z));
#if AREA_KIND == AREA_POINT
    p = area_turn(p, face);
    aside = area_turn(aside, face);
#endif
#if AREA_KIND == AREA_PARALLEL
    vec2 off = abs(aside.xy);
#else
#if AREA_KIND == AREA_POINT
    float least = max(p.z - abs(aside.z), 0.1 * p.z);
#else
    float least = max(p.z - abs(aside.z), 0.0) + u_behind;
#endif
    vec2 off = (abs(aside.xy) + abs(uv) * abs(aside.z)) / least;
#endif
    uint at = face * uint(AREA_FACE_WORDS);
    lower(at, area_ordered(uv.x));
    lower(at + 1u, area_ordered(uv.y));
    lower(at + 2u, ~area_ordered(uv.x));
    lower(at + 3u, ~area_ordered(uv.y));
    lower(at + 4u, ~area_ordered(p.z + abs(aside.z)));
    lower(at + 5u, ~area_ordered(off.x));
    lower(at + 6u, ~area_ordered(off.y));
#else
    if (!is_placed)
        return;
    vec2 low, high, off;
    float farthest;
    bool has_any = area_bounds(face, low, high, farthest, off);
#if PASS == 1
    uvec2 slot = area_slot(uv, low, high);
    atomicAdd(counts[area_slots_at(face, 0u) + slot.x], 1u);
    atomicAdd(counts[area_slots_at(face, 1u) + slot.y], 1u);
#else
    uint cell = area_cell_index(face, area_cell(face, uv, low, high));
    vec3 normal = vec3(start.normal_x, start.normal_y, start.normal_z);
    vec3 aside = vec3(dot(normal, u_axis_x), dot(normal, u_axis_y), dot(normal, u_axis_z));
#if AREA_KIND == AREA_POINT
    aside = area_turn(aside, face);
#endif
    places[index].x = has_any ? cell : AREA_NOWHERE;
    lower(uint(AREA_HEAD_WORDS) + cell,
          ~area_ordered(depth + u_asides * start.origin_offset.w * abs(aside.z)));
#endif
#endif
}
