// SPDX-License-Identifier: MIT
// The light that the haze in a slice of a column scatters towards the eye, through the haze before
// it: of each listed light at one point, through its shadow.
// Needs: those of lighting.glsl, IS_ORTHOGRAPHIC; LIGHT_LIST_CLUSTERED.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"
#include "window/view_ray.glsl"
#include "shading/atmosphere.glsl"
#include "shading/atmosphere_slices.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = BIND_LIGHTS) readonly buffer light_buffer { light_record lights[]; };
layout(std430, binding = BIND_ATMOSPHERE) buffer atmosphere_buffer { float slices[]; };
layout(std430, binding = BIND_ATMOSPHERE_REACH) readonly buffer reach_buffer { float reaches[]; };
#include "lights/light_list.glsl"
#include "lights/light_arriving.glsl"
#ifdef HAS_GRIDS
#include "lights/density_grids.glsl"
#include "lights/light_through_grids.glsl"
#endif
#include "shading/lit_points.glsl"
// Its points: slices of columns.
uniform float u_atmosphere_offset; // of the points of this round in their quarters, (0, 1)

#include "shading/atmosphere_scatter.glsl"

// A light without a place counts by what the stretch scatters of all that passes it.
vec3 place_directional(stretch s, float begin, float end, float offset, out float share)
{
    vec3 from = s.origin + begin * s.way;
    float depth = atmosphere_depth(from, s.origin + end * s.way);
    share = exp(-to_eye(s, begin)) * atmosphere_loss(depth);
    // as many of the points lie before it as light is scattered there, were the haze even
    float at = depth < 0.02 ? offset : -log(1.0 - offset * atmosphere_loss(depth)) / depth;
    return from + at * min(end - begin, 1e6) * s.way;
}

// Of a light, between two points of the stretch.
vec3 scattered_light(uint index, stretch s, float begin, float end)
{
    light_record r = lights[index];
    float offset = light_offset(s, index), share;
    vec3 p;
    if (light_is(r, LIGHT_DIRECTIONAL))
        p = place_directional(s, begin, end, offset, share);
    else
        p = place_lamp(r, s, begin, end, offset, share);
    return scattered_at(r, p, s.way, share);
}

// The cursor from an entry on, in the chunk.
light_cursor narrow(light_cursor c, uint first)
{
    uint end = c.end;
#ifdef HAS_LIGHT_CHUNK
    first = max(first, u_light_chunk.x);
    end = min(end, u_light_chunk.x + u_light_chunk.y);
#endif
    c.at = first;
    c.end = max(end, first);
    return c;
}

// Lights that are everywhere light the slice as a whole, the others where their clusters are. In
// one loop: llvmpipe does not jump over the body of one without a round.
vec3 scattered(stretch s, uvec2 pixel, float near, float far)
{
    vec3 sum = vec3(0.0);
    float whole = (far - near) * s.per_m;
    uint first = light_slice(near), last = light_slice(far);
    for (uint k = first; k <= last; k++) {
        float begin = k == first ? 0.0 : (light_slice_border(k) - near) * s.per_m;
        float end = k == last ? whole : (light_slice_border(k + 1u) - near) * s.per_m;
        light_cursor c = narrow(light_list_in(pixel, k), k == first ? 0u : u_light_prefix);
        bool is_everywhere = c.at < u_light_prefix;
        uint index;
        while (light_list_next(c, index)) {
            sum += scattered_light(index, s, is_everywhere ? 0.0 : begin,
                                   is_everywhere ? whole : end);
            is_everywhere = c.at < u_light_prefix;
        }
    }
    return sum;
}

void main()
{
    uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
             gl_LocalInvocationID.x + u_first;
    if (i >= u_end)
        return;
    uint columns = u_atmosphere_grid.x * u_atmosphere_grid.y;
    uint column = i % columns, slice = i / columns;
    float near = atmosphere_border(slice), far = atmosphere_border(slice + 1u);
    vec3 sum = vec3(0.0);
    if (near < reaches[column]) {
        uvec2 place = uvec2(column % u_atmosphere_grid.x, column / u_atmosphere_grid.x);
        vec2 at = atmosphere_pixel(place);
        stretch s = stretch_of(u_atmosphere_first + ivec2(place), slice, at, near);
        uvec2 pixel = uvec2(clamp(ivec2(floor(at)), ivec2(0), ivec2(u_size_px) - 1));
        sum = scattered(s, pixel, near, far);
    }
    for (uint k = 0u; k < 3u; k++)
        slices[3u * i + k] = IS_FIRST_PART ? sum[k] : slices[3u * i + k] + sum[k];
#ifdef HAS_SHADOWS
    if (light_lookups > 0u)
        atomicAdd(statistics[STATISTICS_LOOKUPS + (column & 63u)], light_lookups * uint(u_taps));
#endif
}
