// SPDX-License-Identifier: MIT
// Density grids in linked shadow lists as published (Lindbeck 2015, 2.2.1 and 3.1): one element of
// a list for all of a grid, from where the light enters its box, with the length of the way inside
// as the element's range. The source draws the back faces of the box from the light, finds the
// entry by the ray, and sums the density up between both. So there is no element where the light's
// frustum ends before the back face (its figure 3.9). Here a thread finds the faces of all boxes on
// the ray of its texel, so that it needs no lock; all other casters are in the lists.
// Needs: GRID_COUNT; GRID_CUTS, SHADOW_FAITHFUL.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"
#include "lights/density_grids.glsl"
#include "shadows/shadow_element.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = BIND_SHADOW_COUNTS) buffer head_buffer { uint heads[]; };
layout(std430, binding = BIND_LIST_NODES) buffer node_buffer { uvec4 nodes[]; };
layout(std430, binding = BIND_STATISTICS) buffer statistics_buffer { uint statistics[]; };

uniform uint u_first;      // head of the face
uniform uint u_resolution; // of the face
uniform uvec2 u_room;      // first element of the light, how many it may have
uniform uint u_slot;       // (elements, failures) of the light
// The face in view space: the light, or the middle of its near side, and its axes, x and y as long
// as the half of the face is wide: 1 m before the light, or along its parallel rays.
uniform vec3 u_origin, u_right, u_up, u_along;
uniform float u_is_perspective; // 1, else 0
uniform float u_far_m;          // along the axis: end of the frustum; 0: none

const uint NOBODY = 0xffu; // of the eight bits that name an object

void insert(uint texel, uvec4 element)
{
    uint previous = ELEMENT_END, next = heads[texel];
    while (next != ELEMENT_END) {
        uvec4 before = nodes[u_room.x + next];
        if (uintBitsToFloat(before.x) >= uintBitsToFloat(element.x))
            break;
        if (element_color(before) == vec3(0.0))
            return; // no light gets here
        previous = next;
        next = before.w;
    }
    uint place = atomicAdd(statistics[u_slot * 2u], 1u);
    if (place >= u_room.y)
        return; // counted: the light is made again with more room
    element.w = element_color(element) == vec3(0.0) ? ELEMENT_END : next;
    nodes[u_room.x + place] = element;
    if (previous == ELEMENT_END)
        heads[texel] = place;
    else
        nodes[u_room.x + previous].w = place;
}

void main()
{
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    uint texel = group * 64u + gl_LocalInvocationID.x;
    if (texel >= u_resolution * u_resolution)
        return;
    vec2 at = vec2(texel % u_resolution, texel / u_resolution) + 0.5;
    vec2 ndc = at * (2.0 / float(u_resolution)) - 1.0;
    vec3 across = ndc.x * u_right + ndc.y * u_up;
    vec3 from = u_origin + (1.0 - u_is_perspective) * across;
    vec3 way = u_along + u_is_perspective * across;
    float per_axis = length(way); // metres along the ray per metre along the axis
    way /= per_axis;
    vec2 range = grid_kept(from, way, vec2(0.0, GRID_FAR), GRID_CUTS_OF_LIGHT);
    for (uint g = 0u; g < uint(GRID_COUNT); g++) {
        grid_way w = grid_meet(g, from, way, range);
        bool is_drawn = u_far_m == 0.0 || w.end <= u_far_m * per_axis;
        if (!(w.begin < w.end) || !is_drawn)
            continue;
        vec4 sigma = grid_word(g, 4u);
        vec3 t = exp(-sigma.rgb * grid_sum(w, sigma.w));
        if (t == vec3(1.0))
            continue;
        uvec4 element = element_make(w.begin, t, NOBODY, ELEMENT_END);
        element.y = floatBitsToUint(w.end - w.begin);
        insert(u_first + texel, element);
    }
}
