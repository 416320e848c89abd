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
#ifdef HAS_SHADOWS
#include "shadows/shadow_query.glsl"
layout(std430, binding = BIND_STATISTICS) buffer statistics_buffer { uint statistics[]; };
#define STATISTICS_LOOKUPS 64u // as in lighting.glsl
uniform float u_taps;
#endif
uniform uint u_first; // slice of a column, of the dispatch
uniform uint u_end;
uniform uvec2 u_size_px;
uniform float u_atmosphere_offset; // of the points of this round in their quarters, (0, 1)
#ifdef HAS_LIGHT_PARTS
uniform uvec2 u_light_part; // not 0: it is the first; it is the last
#define IS_FIRST_PART (u_light_part.x != 0u)
#else
#define IS_FIRST_PART true
#endif
#ifdef HAS_LIGHT_CHUNK
uniform uvec2 u_light_chunk;
#endif

const float PI = 3.14159265358979;
const float NEAREST = 1e-6; // [m] from a lamp to the ray

// Part of the ray in a slice: metres from where the slice begins.
struct stretch {
    vec3 origin, way;  // view space; unit
    float eye_depth;   // optical, from where the ray begins to the origin
    float offset;      // of the column's point in it, (0, 1)
    float turn;        // by which the columns exchange their quarters, any number
};

uint light_lookups = 0u;

// Henyey and Greenstein 1941. cosine: between the light's way on and that to the eye.
float phase(float cosine)
{
    float g = u_atmosphere.w, d = 1.0 + g * g - 2.0 * g * cosine;
    return (1.0 - g * g) / (4.0 * PI * d * sqrt(d));
}

// What a light scatters from one point, by the share of the haze there that counts.
vec3 scattered_at(light_record r, vec3 p, vec3 way, float share)
{
    vec3 l;
    vec3 arriving = light_arriving(r, p, l) * share;
    if (max(arriving.r, max(arriving.g, arriving.b)) <= 0.0)
        return vec3(0.0);
    arriving *= phase(dot(l, way)); // -l goes on, -way goes to the eye
#ifdef HAS_SHADOWS
    if (r.shadow != NO_SHADOW) {
        arriving *= shadow_transmittance(r.shadow, p, vec3(0.0), vec2(0.0), NO_OBJECT);
        light_lookups++;
    }
#endif
#ifdef HAS_GRIDS
    if (max(arriving.r, max(arriving.g, arriving.b)) > 0.0)
        arriving *= light_through_grids(r, p);
#endif
    return arriving;
}

float to_eye(stretch s, float t)
{
    return s.eye_depth + atmosphere_depth(s.origin, s.origin + t * s.way);
}

// A light without a place counts by what the stretch scatters of all that passes it.
vec3 scattered_directional(light_record r, stretch s, float begin, float end, float offset)
{
    vec3 from = s.origin + begin * s.way;
    float depth = atmosphere_depth(from, s.origin + end * s.way);
    float lost = exp(-to_eye(s, begin)) * atmosphere_loss(depth);
    // as many of the points lie before it as light is scattered there, were the haze even
    float at = depth < 0.02 ? offset : -log(1.0 - offset * atmosphere_loss(depth)) / depth;
    return scattered_at(r, from + at * min(end - begin, 1e6) * s.way, s.way, lost);
}

// How wide the view is at a lamp, over its width at depth 1.
float column_scale(vec3 position)
{
#ifdef IS_ORTHOGRAPHIC
    return 1.0;
#else
    return abs(position.z);
#endif
}

// Columns at and beside a spot have what its cone passes in the mean all around it, since the ray
// in their middle meets the thin end of the cone or misses it. Up to the first number of columns
// from the spot this counts alone, from the second on the ray. Chosen: the sum over columns,
// wherever in one the spot is, is then nearest to the integral.
const float CONE_NEAR = 0.4, CONE_FAR = 1.2;
const int CONE_SIDES = 16; // of the half circle

// Around a spot, at a point `at` metres behind what is nearest to it and `apart` metres beside it.
float light_cone_around(light_record r, vec3 way, float at, float apart)
{
    float along = dot(r.direction_cone.xyz, way), scale = inversesqrt(at * at + apart * apart);
    float across = apart * scale * sqrt(max(1.0 - along * along, 0.0)), sum = 0.0;
    for (int i = 0; i < CONE_SIDES; i++)
        sum += light_cone(r, along * at * scale +
                                 across * cos(PI * (float(i) + 0.5) / float(CONE_SIDES)));
    return sum / float(CONE_SIDES);
}

// The spot without its cone, what that passes in the column's share, and a point in its light.
void open_cone(inout light_record r, vec3 way, float at, float apart, float near, inout vec3 p,
               inout float share)
{
    float own = light_cone(r, dot(r.direction_cone.xyz, normalize(p - r.position_range.xyz)));
    share *= mix(own, light_cone_around(r, way, at, apart), near);
    if (own == 0.0) { // where the shadow map has nothing
        vec3 aside = r.direction_cone.xyz - dot(r.direction_cone.xyz, way) * way;
        aside *= apart * inversesqrt(max(dot(aside, aside), 1e-37));
        p = r.position_range.xyz + at * way + aside;
    }
    r.direction_cone.w = 0.0;
    r.spot_offset = 1.0;
}

// No point of a ray is in the cone whose angle from what is nearest to the spot differs from that
// of the cone's axis by more than the cone is wide. first, last: of the ray, from what is nearest
// on.
void cut_to_cone(light_record r, vec3 way, float apart, inout float first, inout float last)
{
    float along = dot(r.direction_cone.xyz, way), across = sqrt(max(1.0 - along * along, 0.0));
    float cosine = clamp(-r.spot_offset / r.direction_cone.w, 0.0, 1.0);
    float sine = sqrt(1.0 - cosine * cosine);
    float low = across * cosine + along * sine, high = across * cosine - along * sine;
    if (low > 0.0)
        first = max(first, apart * (along * cosine - across * sine) / low);
    if (high > 0.0)
        last = min(last, apart * (along * cosine + across * sine) / high);
}

// The point of a lamp is drawn by its distance: Kulla and Fajardo 2012, "Importance Sampling
// Techniques for Path Tracing in Participating Media", section 4.1, by sums of angles, so that
// those of far points keep their digits.
vec3 scattered_lamp(light_record r, stretch s, float begin, float end, float offset)
{
    vec3 to_light = r.position_range.xyz - s.origin;
    float nearest = dot(to_light, s.way);
    // around a lamp itself 1 / distance has the mean over the column: 4 / width
    float width = u_atmosphere_side_px * u_window.z * column_scale(r.position_range.xyz);
    float own = length(to_light - nearest * s.way), apart = max(own, max(0.25 * width, NEAREST));
    float first = begin - nearest, last = end - nearest;
    if (light_is(r, LIGHT_SPOT))
        cut_to_cone(r, s.way, apart, first, last);
    if (!(last > first))
        return vec3(0.0);
    float angle = atan(apart * (last - first), apart * apart + first * last);
    float c = cos(offset * angle), sine = sin(offset * angle);
    float at = apart * (first * c + apart * sine) / (apart * c - first * sine);
    float t = nearest + clamp(at, first, last);
    vec3 p = s.origin + t * s.way;
    float share = atmosphere_extinction(p) * exp(-to_eye(s, t)) * angle / apart;
    float near = clamp((CONE_FAR * width - own) / ((CONE_FAR - CONE_NEAR) * width), 0.0, 1.0);
    if (light_is(r, LIGHT_SPOT) && near > 0.0)
        open_cone(r, s.way, t - nearest, apart, near, p, share);
    vec3 d = p - r.position_range.xyz;
    return scattered_at(r, p, s.way, share * dot(d, d));
}

// Of a part of a list, between two points.
vec3 scattered_list(light_cursor cursor, stretch s, float begin, float end)
{
    vec3 sum = vec3(0.0);
    uint index;
    while (light_list_next(cursor, index)) {
        light_record r = lights[index];
        float turn = floor(4.0 * fract(s.turn + float(index) * 0.7548776662));
        float offset = fract(s.offset + 0.25 * turn);
        if (light_is(r, LIGHT_DIRECTIONAL))
            sum += scattered_directional(r, s, begin, end, offset);
        else
            sum += scattered_lamp(r, s, begin, end, offset);
    }
    return sum;
}

// The cursor's entries of the lights that are everywhere, or of the others, in the chunk.
light_cursor narrow(light_cursor c, uint first, uint end)
{
#ifdef HAS_LIGHT_CHUNK
    first = max(first, u_light_chunk.x);
    end = min(end, u_light_chunk.x + u_light_chunk.y);
#endif
    c.at = first;
    c.end = max(min(end, c.end), first);
    return c;
}

// Lights that are everywhere light the slice as a whole, the others where their clusters are.
vec3 scattered(stretch s, uvec2 pixel, float near, float far, float per_m)
{
    light_cursor all = light_list_first(pixel, near);
    vec3 sum = scattered_list(narrow(all, 0u, u_light_prefix), s, 0.0, (far - near) * per_m);
    uint first = light_slice(near), last = light_slice(far);
    for (uint k = first; k <= last; k++) {
        float begin = k == first ? near : light_slice_border(k);
        float end = k == last ? far : light_slice_border(k + 1u);
        light_cursor own = light_list_in(pixel, k);
        sum += scattered_list(narrow(own, u_light_prefix, own.end), s, (begin - near) * per_m,
                              (end - near) * per_m);
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
        stretch s;
        s.origin = view_position(at, near);
        s.way = view_position(at, near + 1.0) - s.origin;
        float per_m = length(s.way);
        s.way /= per_m;
        s.eye_depth = atmosphere_depth(view_position(at, 0.0), s.origin);
        // the four columns around a corner have the four quarters of a slice
        uvec2 parity = uvec2(u_atmosphere_first + ivec2(place)) & 1u;
        float quarter = 0.5 * float(parity.x) + 0.25 * float(parity.x ^ parity.y);
        s.offset = quarter + 0.25 * u_atmosphere_offset;
        s.turn = float(slice) * 0.6180339887;
        uvec2 pixel = uvec2(clamp(ivec2(floor(at)), ivec2(0), ivec2(u_size_px) - 1));
        sum = scattered(s, pixel, near, far, per_m);
    }
    for (uint k = 0u; k < 3u; k++)
        slices[3u * i + k] = IS_FIRST_PART ? sum[k] : slices[3u * i + k] + sum[k];
#ifdef HAS_SHADOWS
    if (light_lookups > 0u)
        atomicAdd(statistics[STATISTICS_LOOKUPS + (column & 63u)], light_lookups * uint(u_taps));
#endif
}
