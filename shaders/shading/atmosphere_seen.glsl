// SPDX-License-Identifier: MIT
// What the camera sees of the haze and of density grids: the light that they scatter from the eye
// to a depth, and what they let through. Needs: HAS_ATMOSPHERE_LIGHT where lamps light the haze,
// window/view_ray.glsl, shading/atmosphere.glsl; where HAS_GRIDS, those of smoke_seen.glsl.
// Provides: atmosphere_begin(vec2 at, float depth) for a pixel, with the depth of the opaque
// surface there (0: none), then
// atmosphere_seen atmosphere_look(vec2 at, float view_z), with grids best from near to far.
#include "shading/atmosphere_slices.glsl"
uniform vec3 u_atmosphere_color;   // share of the extinction that scatters
uniform vec3 u_atmosphere_ambient; // what it scatters of the light from all around [nt]
#ifdef HAS_ATMOSPHERE_LIGHT
layout(binding = UNIT_ATMOSPHERE_SUMS) uniform samplerBuffer u_atmosphere_sums;

vec3 atmosphere_ends(uint slice, uvec2 corner, uvec2 corners)
{
    uint at = (slice * corners.y + corner.y) * corners.x + corner.x;
    return texelFetch(u_atmosphere_sums, int(at)).rgb;
}

// Between four corners, and between the ends of a slice: of the last one, as what it
// lets through falls.
vec3 atmosphere_scattered(vec2 at, float view_z)
{
    vec2 place = (at + vec2(u_window_first)) / u_atmosphere_side_px -
                 vec2(u_atmosphere_first + 1);
    uvec2 low = uvec2(max(place, 0.0)), corners = u_atmosphere_grid.xy - 1u;
    vec2 f = clamp(place - vec2(low), 0.0, 1.0);
    uint slice = atmosphere_slice(view_z), last = u_atmosphere_grid.z - 1u;
    float near = atmosphere_border(slice), part;
    if (slice < last) {
        part = (view_z - near) / (atmosphere_border(slice + 1u) - near);
    } else {
        vec3 begin = view_position(at, near);
        float all = atmosphere_depth(begin, view_position(at, ATMOSPHERE_FAR));
        part = atmosphere_loss(atmosphere_depth(begin, view_position(at, view_z))) /
               max(atmosphere_loss(all), 1e-30);
    }
    part = clamp(part, 0.0, 1.0);
    vec3 sum = vec3(0.0);
    for (uint k = 0u; k < 4u; k++) {
        uvec2 side = uvec2(k & 1u, k >> 1u), own = min(low + side, corners - 1u);
        vec3 before = slice > 0u ? atmosphere_ends(slice - 1u, own, corners) : vec3(0.0);
        float weight = (side.x == 1u ? f.x : 1.0 - f.x) * (side.y == 1u ? f.y : 1.0 - f.y);
        sum += weight * mix(before, atmosphere_ends(slice, own, corners), part);
    }
    return u_atmosphere_color * sum;
}
#endif

#ifdef HAS_GRIDS
#define air_share vec3
float air_mean(vec3 share) { return (share.r + share.g + share.b) / 3.0; }
#else
#define air_share float
float air_mean(float share) { return share; }
#endif
struct atmosphere_seen {
    vec3 light;        // from the eye to the depth [nt]
    air_share through; // of what is there
};

// Of the haze alone.
atmosphere_seen haze_look(vec2 at, float view_z)
{
    float z = min(view_z, ATMOSPHERE_FAR);
    float depth = atmosphere_depth(view_position(at, 0.0), view_position(at, z));
    atmosphere_seen seen = atmosphere_seen(u_atmosphere_ambient * atmosphere_loss(depth),
                                           air_share(exp(-depth)));
#ifdef HAS_ATMOSPHERE_LIGHT
    seen.light += atmosphere_scattered(at, z);
#endif
    return seen;
}

#ifdef HAS_GRIDS
#include "shading/smoke_seen.glsl"
void atmosphere_begin(vec2 at, float depth) { smoke_begin(at, depth); }

atmosphere_seen atmosphere_look(vec2 at, float view_z)
{
    float z = min(view_z, ATMOSPHERE_FAR);
    smoke_follow(z);
    float haze = atmosphere_transmittance(view_position(at, 0.0), view_position(at, z));
    return atmosphere_seen(smoke_light, smoke_through * haze);
}
#else
void atmosphere_begin(vec2 at, float depth) {}
atmosphere_seen atmosphere_look(vec2 at, float view_z) { return haze_look(at, view_z); }
#endif

// At the depths of samples (0: nothing is there). Without grids, those between the nearest and the
// farthest are taken between both.
#if defined SAMPLES
float atmosphere_view_z(float depth) { return depth > 0.0 ? view_depth(depth) : ATMOSPHERE_FAR; }

#ifdef HAS_GRIDS
void atmosphere_look_at(vec2 at, float depth[WALKS], out atmosphere_seen seen[WALKS])
{
    for (int i = 0; i < WALKS; i++)
        if (i > 0 && depth[i] == depth[i - 1])
            seen[i] = seen[i - 1];
        else
            seen[i] = atmosphere_look(at, atmosphere_view_z(depth[i]));
}
#else
void atmosphere_look_at(vec2 at, float depth[WALKS], out atmosphere_seen seen[WALKS])
{
    float near = depth[0], far = depth[0];
    for (int i = 1; i < WALKS; i++) {
        near = max(near, depth[i]);
        far = min(far, depth[i]);
    }
    atmosphere_seen first = atmosphere_look(at, atmosphere_view_z(near)), last = first;
    if (far < near)
        last = atmosphere_look(at, atmosphere_view_z(far));
    vec3 start = view_position(at, 0.0);
    for (int i = 0; i < WALKS; i++) {
        float through = first.through, part = 0.0;
        if (depth[i] < near) {
            vec3 p = view_position(at, atmosphere_view_z(depth[i]));
            through = atmosphere_transmittance(start, p);
            part = depth[i] == far ? 1.0
                                   : (first.through - through) /
                                         max(first.through - last.through, 1e-30);
        }
        seen[i] = atmosphere_seen(mix(first.light, last.light, clamp(part, 0.0, 1.0)), through);
    }
}
#endif
#endif
