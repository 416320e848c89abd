// SPDX-License-Identifier: MIT
// The points of the surfaces among the samples of each pixel, as shade_pixels.comp.glsl shades
// them, where traced shadows are asked for: of all pixels, or of those whose samples are shaded
// apart.
// Needs: those of shadow_points.glsl.
#include "shadows/shadow_points.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
#include "window/gbuffer.glsl"
#include "window/sample_groups.glsl"
layout(std430, binding = BIND_TRACED_HEADS) writeonly buffer head_buffer { uint heads[]; };
layout(std430, binding = BIND_STATISTICS) buffer counter_buffer { uint point_count; };
uniform uint u_first_point; // points of layers come before
uniform uint u_room;        // for points of surfaces

void write_point(uint index, uint pixel, vec3 position, float offset_m, uvec4 s0, uvec4 s1)
{
    surface s = surface_unpack(s0, s1);
    shadow_point p;
    p.position_offset = vec4(position, offset_m);
    p.geo_normal = s0.y;
    p.normal = s0.x;
    p.pixel_roughness = point_place(pixel, s);
    p.flags = point_flags(s, true);
    if (index < u_room)
        points[u_first_point + index] = p;
}

#if SAMPLES > 1
#ifdef SAMPLES_APART
#include "shared/contrast.h"
#include "window/apart.glsl"
#endif
// How far the samples are off the plane through the middle: the way to the outside of a curved
// surface, whose chord the middle lies on.
float group_normal_offset(ivec2 pixel, sample_group g, vec3 position, vec3 normal)
{
    float offset = 0.0;
    for (int j = 0; j < SAMPLES; j++) {
        float z = view_depth(texelFetch(u_depth_map, pixel, j).x);
        vec3 there = view_position(vec2(pixel) + u_sample_positions[j], z);
        if ((g.members & 1u << j) != 0u)
            offset = max(offset, abs(dot(normal, there - position)));
    }
    return offset;
}

void main()
{
#ifdef SAMPLES_APART
    uvec2 at_px;
    uint apart = apart_take(at_px);
    if (apart == 0u)
        return;
#else
    uvec2 at_px = gl_GlobalInvocationID.xy;
    const uint apart = 0u;
    if (any(greaterThanEqual(at_px, u_size_px)))
        return;
#endif
    ivec2 pixel = ivec2(at_px);
    uint count = 0u;
    for (uint remaining = (1u << SAMPLES) - 1u; remaining != 0u;) {
        sample_group g = group_next(pixel, remaining, apart);
        count += g.depth > 0.0 ? 1u : 0u;
        remaining &= ~g.members;
    }
    uint index = uint(pixel.y) * u_size_px.x + uint(pixel.x);
    uint at = count > 0u ? atomicAdd(point_count, count) : 0u;
    heads[index] = at << 3 | count;
    for (uint remaining = (1u << SAMPLES) - 1u; remaining != 0u;) {
        sample_group g = group_next(pixel, remaining, apart);
        remaining &= ~g.members;
        if (g.depth > 0.0) {
            uvec4 s0 = texelFetch(u_surface_0, pixel, g.first);
            vec3 position = view_position(vec2(pixel) + g.middle.xy, view_depth(g.middle.z));
            write_point(at++, index, position,
                        group_normal_offset(pixel, g, position, unpack_unit(s0.y)), s0,
                        texelFetch(u_surface_1, pixel, g.first));
        }
    }
}
#else
void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(gl_GlobalInvocationID.xy, u_size_px)))
        return;
    float depth = texelFetch(u_depth_map, pixel, 0).x;
    uint index = uint(pixel.y) * u_size_px.x + uint(pixel.x);
    uint count = depth > 0.0 ? 1u : 0u;
    uint at = count > 0u ? atomicAdd(point_count, 1u) : 0u;
    heads[index] = at << 3 | count;
    if (count > 0u)
        write_point(at, index,
                    view_position(vec2(pixel) + u_sample_positions[0], view_depth(depth)), 0.0,
                    texelFetch(u_surface_0, pixel, 0), texelFetch(u_surface_1, pixel, 0));
}
#endif
