// SPDX-License-Identifier: MIT
// Around lamps in view in the haze: their light in the slices of columns, as
// atmosphere_light.comp.glsl has it among that of all, and along the ways of pixels.
// Needs: those of lighting.glsl, IS_ORTHOGRAPHIC, SAMPLES; LIGHT_LIST_CLUSTERED.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"
#include "window/view_ray.glsl"
#include "window/gbuffer.glsl"
#include "shading/atmosphere.glsl"
#include "shading/atmosphere_slices.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = BIND_LIGHTS) readonly buffer light_buffer { light_record lights[]; };
layout(std430, binding = BIND_ATMOSPHERE) buffer atmosphere_buffer { float slices[]; };
layout(std430, binding = BIND_ATMOSPHERE_REACH) readonly buffer reach_buffer { float reaches[]; };
#define GLOW_ACCESS
#include "shading/atmosphere_glow_store.glsl"
#include "lights/light_list.glsl"
#include "lights/light_arriving.glsl"
#include "shading/lit_points.glsl"
// Its points: slices of columns, and behind all of them pixels.
uniform float u_atmosphere_offset; // as in atmosphere_light.comp.glsl
uniform vec4 u_glow_grid;          // of the window: first column, columns
#define HAS_WAYS
#include "shading/atmosphere_scatter.glsl"

struct glow_item {
    uint lamp;
    uvec2 place;     // way: of the square
    stretch s;
    float near, far; // view depths
    uvec2 pixel;     // whose clusters these are
};

// The slices whose depths end behind their columns are dark.
bool take_slice(uint i, out glow_item item)
{
    uint columns = u_atmosphere_grid.x * u_atmosphere_grid.y, slice = i / columns;
    uvec2 place = uvec2(i % u_atmosphere_grid.x, i % columns / u_atmosphere_grid.x);
    item.lamp = place.y / u_glow.x;
    item.place = uvec2(place.x, place.y % u_glow.x);
    ivec2 column = glow_first(item.lamp) + ivec2(item.place);
    ivec2 own = column - ivec2(u_glow_grid.xy), count = ivec2(u_glow_grid.zw);
    vec2 at = (vec2(column) + 0.5) * u_atmosphere_side_px - vec2(u_window_first);
    item.near = atmosphere_border(slice);
    item.far = atmosphere_border(slice + 1u);
    item.s = stretch_of(column, slice, at, item.near);
    item.pixel = uvec2(clamp(ivec2(floor(at)), ivec2(0), ivec2(u_size_px) - 1));
    if (any(lessThan(own, ivec2(0))) || any(greaterThanEqual(own, count)))
        return false;
    return item.near < reaches[own.y * count.x + own.x];
}

// The way of a pixel's middle, to its farthest sample.
bool take_way(uint i, out glow_item item)
{
    uint side = glow_side_px();
    item.lamp = i / (side * side);
    item.place = uvec2(i % side, i % (side * side) / side);
    ivec2 pixel = glow_pixel(item.lamp, item.place);
    if (any(lessThan(pixel, ivec2(0))) || any(greaterThanEqual(pixel, ivec2(u_size_px))))
        return false;
    float farthest = 1.0;
    for (int k = 0; k < SAMPLES; k++)
        farthest = min(farthest, texelFetch(u_depth_map, pixel, k).x);
    item.near = 0.0;
    item.far = farthest > 0.0 ? min(view_depth(farthest), ATMOSPHERE_FAR) : ATMOSPHERE_FAR;
    item.s = stretch_at(vec2(pixel) + 0.5, 0.0);
    item.pixel = uvec2(pixel);
    return true;
}

vec3 lamp_scattered(light_record r, stretch s, float begin, float end, float offset)
{
    float share;
    vec3 p = place_lamp(r, s, begin, end, offset, share);
    return scattered_at(r, p, s.way, share);
}

bool is_listed(light_cursor c, uint index)
{
    uint other;
    bool is_there = false;
    while (!is_there && light_list_next(c, other))
        is_there = other == index;
    return is_there;
}

bool is_in_prefix(uint index)
{
    return is_listed(light_cursor(0u, u_light_prefix, 0u), index);
}

bool is_in_cluster(uvec2 pixel, uint k, uint index)
{
    light_cursor c = light_list_in(pixel, k);
    c.at = u_light_prefix;
    return is_listed(c, index);
}

// What of the way is in the range of the lamp, in metres from its beginning.
void cut_to_range(light_record r, stretch s, inout float begin, inout float end)
{
    vec3 to_light = r.position_range.xyz - s.origin;
    float nearest = dot(to_light, s.way), range = r.position_range.w;
    vec3 aside = to_light - nearest * s.way;
    if (range > 0.0) {
        float half_way = sqrt(max(range * range - dot(aside, aside), 0.0));
        begin = max(begin, nearest - half_way);
        end = min(end, nearest + half_way);
    }
}

void store(uint at, float value) { glow[at] = IS_FIRST_PART ? value : glow[at] + value; }

void store_sight(glow_item item, lamp_sight e)
{
    glow[glow_at(item.lamp, item.place, 0u)] = e.first;
    glow[glow_at(item.lamp, item.place, 1u)] = e.last;
    glow[glow_at(item.lamp, item.place, 2u)] = e.nearest;
    glow[glow_at(item.lamp, item.place, 3u)] = e.apart;
}

void main()
{
    uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
             gl_LocalInvocationID.x + u_first;
    if (i >= u_end)
        return;
#ifdef HAS_LIGHT_CHUNK
    if (u_light_chunk.x != 0u) // all of them are at hand with the first chunk
        return;
#endif
    uint slice_count = u_atmosphere_grid.x * u_atmosphere_grid.y * u_atmosphere_grid.z;
    is_way = i >= slice_count;
    glow_item item;
    bool is_lit = is_way ? take_way(i - slice_count, item) : take_slice(i, item);
    uint index = uint(u_glow_lamps[item.lamp].z);
    light_record r = lights[index];
    bool is_everywhere = !is_way && is_in_prefix(index);
    // a way in its parts, a slice in those of the lists where the lamp is
    uint first = is_way || is_everywhere ? 0u : light_slice(item.near);
    uint last = is_way ? GLOW_PARTS - 1u : is_everywhere ? 0u : light_slice(item.far);
    float begin = 0.0, end = (item.far - item.near) * item.s.per_m, share = 1.0;
    float offset = light_offset(item.s, index);
    if (is_way) {
        cut_to_range(r, item.s, begin, end);
        share = 1.0 / float(GLOW_PARTS);
        if (is_lit)
            store_sight(item, sight_of(r, item.s, begin, end));
    }
    vec3 sum = vec3(0.0);
    for (uint k = first; k <= last && is_lit; k++) {
        float from = begin, to = end;
        bool is_there = true;
        if (is_way) {
            offset = (float(k) + 0.5) * share;
        } else if (!is_everywhere) {
            from = k == first ? 0.0 : (light_slice_border(k) - item.near) * item.s.per_m;
            to = k == last ? end : (light_slice_border(k + 1u) - item.near) * item.s.per_m;
            is_there = is_in_cluster(item.pixel, k, index);
        }
        if (is_there)
            sum += share * lamp_scattered(r, item.s, from, to, offset);
        if (is_way)
            for (uint c = 0u; c < 3u; c++)
                store(glow_at(item.lamp, item.place, 4u + 3u * k + c), sum[c]);
    }
    if (!is_way)
        for (uint c = 0u; c < 3u; c++)
            slices[3u * i + c] = IS_FIRST_PART ? sum[c] : slices[3u * i + c] + sum[c];
#ifdef HAS_SHADOWS
    if (light_lookups > 0u)
        atomicAdd(statistics[STATISTICS_LOOKUPS + (i & 63u)], light_lookups * uint(u_taps));
#endif
}
