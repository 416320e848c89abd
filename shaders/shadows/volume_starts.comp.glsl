// SPDX-License-Identifier: MIT
// Where the ways to the points end for one light: off the surface on the light's side, as rays
// leave it (renderer/raytrace/rt_shadow_points.c), and which of the point's filters is the light's.
// Needs: those of volume_points.glsl; IS_ORTHOGRAPHIC.
#include "shadows/volume_points.glsl"
#include "base/pack.glsl"
layout(std430, binding = BIND_TRACED_POINTS) readonly buffer point_buffer {
    shadow_point points[];
};
layout(std430, binding = BIND_VOLUME_STARTS) writeonly buffer start_buffer { vec4 starts[]; };
layout(std430, binding = BIND_VOLUME_SUMS) writeonly buffer sum_buffer { int sums[]; };
layout(std430, binding = BIND_VOLUME_LIGHTS) readonly buffer light_buffer { uint is_shadowed[]; };
layout(std430, binding = BIND_STATISTICS) buffer counter_buffer { uint counters[]; };
layout(std430, binding = BIND_VOLUME_TILES) buffer tile_buffer { uint tiles[]; };
uniform uint u_index; // of the light
uniform float u_eye;  // of volume.glsl
#include "shadows/volume_window.glsl"
uniform uint u_width_px;
uniform vec4 u_light;
uniform vec4 u_cone;   // of a spot: its axis, and the cosine from which on light goes; else -2
uniform float u_range; // [m]; 0: without end
uniform vec3 u_offsets; // [m]: of the scene; of the distance; a pixel's width, there or at 1 m

// 1 + the place of the light among those of the chunk with a shadow; 0: it does not get there.
uint place_of(uint cluster)
{
    light_cursor cursor = light_list_at(cluster);
    light_list_chunk(cursor, u_light_chunk.x, u_light_chunk.y);
    uint light, place = 1u;
    while (light_list_next(cursor, light)) {
        if (light == u_index)
            return place;
        place += is_shadowed[light];
    }
    return 0u;
}

// A hair wider than what shades: what has no light needs no shadow.
bool is_in_light(vec3 at)
{
    vec3 way = at - u_light.xyz;
    float far = length(way);
    return u_light.w == 0.0 || ((u_range == 0.0 || far <= 1.0001 * u_range) &&
                                dot(way, u_cone.xyz) >= (u_cone.w - 1e-4) * far);
}

vec3 leave(shadow_point p)
{
    vec3 at = p.position_offset.xyz, normal = unpack_unit(p.geo_normal);
    vec3 to_light = normalize(u_light.xyz - at * u_light.w);
#ifdef IS_ORTHOGRAPHIC
    float pixel = u_offsets.z;
    vec3 view = vec3(0.0, 0.0, 1.0);
#else
    float pixel = u_offsets.z * -at.z;
    vec3 view = normalize(at);
#endif
    float facing = dot(view, normal);
    float offset = u_offsets.x + u_offsets.y * length(at) +
                   pixel / 256.0 * sqrt(max(1.0 - facing * facing, 0.0)) +
                   min(p.position_offset.w, pixel);
    float cosine = dot(normal, to_light);
    float way = offset / max(abs(cosine), 1.0 / 20.0);
    float rest = offset - way * abs(cosine);
    return at + to_light * way + normal * (cosine < 0.0 ? -rest : rest);
}

void main()
{
    uint i;
    if (!volume_point(i))
        return;
    shadow_point p = points[i];
    bool is_asked = (p.flags & SHADOW_POINT_UNLIT) == 0u && is_in_light(p.position_offset.xyz);
    uint place = is_asked ? place_of(table[i].y) : 0u;
    vec4 start = vec4(leave(p), 1.0);
    starts[i] = vec4(start.xyz, float(place));
    for (uint k = 0u; k < 6u; k++)
        sums[6u * i + k] = 0;
    if (place == 0u)
        return;
    uint index = p.pixel_roughness & ((1u << SHADOW_POINT_PIXEL_BITS) - 1u);
    uvec2 pixel = uvec2(index % u_width_px, index / u_width_px);
    for (uint k = 0u; k < 2u; k++) {
        atomicMax(counters[VOLUME_FIRST_PIXEL + k], ~pixel[k]);
        atomicMax(counters[VOLUME_END_PIXEL + k], pixel[k] + 1u);
    }
    vec2 aside = abs(pixel_of(start) - (vec2(pixel) + 0.5));
    float border = height_of(start) > 0.0 ? min(max(aside.x, aside.y), 1e6) : 1e6;
    atomicMax(counters[VOLUME_BORDER], floatBitsToUint(border));
    uvec2 tile = pixel / VOLUME_TILE_PX;
    uint tiles_x = (u_width_px + VOLUME_TILE_PX - 1u) / VOLUME_TILE_PX;
    atomicMax(tiles[tile.y * tiles_x + tile.x], volume_order(depth_of(start)));
}
