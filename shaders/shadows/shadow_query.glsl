// SPDX-License-Identifier: MIT
// How much of a light arrives at a point, by shadow maps of every technique; the programs
// compile what the frame has:
//   SHADOW_HAS_MAPS    there is any structure (absent: everything is lit)
//   SHADOW_HAS_ORTHOGRAPHIC, SHADOW_HAS_PERSPECTIVE, SHADOW_HAS_CUBES (perspective, too)   shapes
//   SHADOW_LISTS       the techniques that filter light: shadow_lists.glsl
//   SHADOW_HAS_MEDIA   some lists attenuate light from where it starts
// Provides: vec3 shadow_transmittance(uint shadow, vec3 p, vec3 n, vec2 tolerance, uint object)
//   shadow  index of the light's record or NO_SHADOW
//   p, n    point in view space [m] and geometric normal there (either side)
//   tolerance  [0, 1]: its share that applies to opaque casters (x) and to lists (y)
//   object  node whose own events are left out (no self shadow), else NO_OBJECT
// A fragment shader that calls it must have left its helper lanes behind: `if (gl_HelperInvocation)
// return;`. Loop iterations per call: taps * (4 log2(longest list) + 10); of lists that are walked
// taps * (longest list + 10).
//
// No bias. Each tap intersects the ray through its texel's centre with the receiver's plane (Dou et
// al. 2014, "Adaptive depth bias for shadow maps", in its exact planar form) and compares there,
// where the casters were sampled: strictly, up to a relative rounding error. Depths of surfaces
// parallel to the receiver are thus compared at equal offsets. What the plane cannot know are the
// neighbouring triangles of the receiver's own surface, which rise above it within a texel in
// concave creases and on curved meshes and would shadow it falsely. With a tolerance
// of 1 a caster must be nearer by TOLERANCE_TEXELS texel widths. Shading asks for it of opaque
// casters always, and of lists where the receiver is curved, because flat panes may lie closer
// together than a texel is wide.
// SHADOW_FAITHFUL: opaque elements of lists are compared with the receiver's own depth less a
// constant offset, as published, so that what the light grazes shadows itself in stripes.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"
#include "base/wide.glsl"

#define NO_OBJECT 0xffffffffu

#ifndef SHADOW_HAS_MAPS
vec3 shadow_transmittance(uint shadow, vec3 p, vec3 n, vec2 tolerance, uint object)
{
    return vec3(1.0);
}
#else
#include "shadows/shadow_lists.glsl"

// struct shadow_record, SHADOW_RECORD_TEXELS each
layout(binding = UNIT_SHADOW_RECORDS) uniform usamplerBuffer u_shadow_records;
layout(binding = UNIT_SHADOW_DEPTH) uniform samplerBuffer u_shadow_depth;
uniform uint u_shadow_taps; // 1, 4, 9, 16 or 64

// Rounding of positions, planes and interpolated depths, relative to the distances involved. On
// llvmpipe a fortieth of it keeps surfaces from shadowing themselves when their points are exact
// (tests/gpu/test_shadow_query.c); the rest is room for packed normals and other devices.
const float SHADOW_ROUNDING = 2e-5;
const float EYE_ROUNDING = 5e-7; // of p, relative to its distance from the eye
// The plane is followed so far away from the light, 88 degrees of slope; towards it, without end:
// what the plane rises above cannot shadow it there.
const float STEEPEST_TEXELS = 100.0;
const float TOLERANCE_TEXELS = 1.5;            // texel widths
const float STEEPEST = 50.0;     // rounding along a plane grows with its slope, up to here
// Rasterisers snap vertices to 1/256 of a texel, which tilts a caster's plane: its depth is off by
// half of that, and a quarter for the other end, times its slope.
const float SNAPPING = 0.75 / 256.0;

#ifdef SHADOW_FAITHFUL
// The source has a small offset that depends on the scene and leaves its size open (Lindbeck 2015,
// 1.1): surfaces that the light meets up to 63 degrees from their normal are free of stripes.
const float OFFSET_TEXELS = 1.0;
#endif

struct shadow_view {
    vec4 projection;
    uint technique, shape, flags, resolution, depth_base, head_base, event_base;
    vec3 sigma;
};

struct shadow_receiver { // in the light's axes
    vec3 p, n;
    float n_length;
    float rounding_m;    // of p along its normal
    vec2 tolerance;      // share that applies to opaque casters, to lists
};

uvec4 shadow_record_texel(uint shadow, int i)
{
    return texelFetch(u_shadow_records, int(shadow) * SHADOW_RECORD_TEXELS + i);
}

shadow_view shadow_view_read(uint shadow)
{
    uvec4 a = shadow_record_texel(shadow, 4);
#ifdef SHADOW_HAS_MEDIA
    vec3 sigma = uintBitsToFloat(shadow_record_texel(shadow, 5).xyz);
#else
    const vec3 sigma = vec3(0.0);
#endif
    return shadow_view(uintBitsToFloat(shadow_record_texel(shadow, 3)), a.x & 15u, a.x >> 4 & 15u,
                       a.x >> 8 & 255u, a.x >> 16, a.y, a.z, a.w, sigma);
}

shadow_receiver shadow_receiver_read(uint shadow, vec3 p, vec3 n)
{
    vec4 x = uintBitsToFloat(shadow_record_texel(shadow, 0));
    vec4 y = uintBitsToFloat(shadow_record_texel(shadow, 1));
    vec4 z = uintBitsToFloat(shadow_record_texel(shadow, 2));
    return shadow_receiver(vec3(dot(x.xyz, p) + x.w, dot(y.xyz, p) + y.w, dot(z.xyz, p) + z.w),
                           vec3(dot(x.xyz, n), dot(y.xyz, n), dot(z.xyz, n)),
                           length(n), EYE_ROUNDING * length(p), vec2(0.0));
}

uint shadow_texel_index(shadow_view view, uint face, ivec2 at)
{
    return (face * view.resolution + uint(at.y)) * view.resolution + uint(at.x);
}

// Texel widths by which a neighbouring triangle may rise above the receiver's plane, for the slope
// at which the light meets it.
float shadow_tolerance(float steepness)
{
    return TOLERANCE_TEXELS * (0.5 + 0.5 * min(steepness, 4.0));
}

float shadow_opaque(shadow_view view, uint texel)
{
    return texelFetch(u_shadow_depth, int(view.depth_base + texel)).r;
}

// What a texel says before its list is looked at.
struct shadow_tap {
    float depth, reach; // the receiver's depth as lists have it: with tolerance, and without
    shadow_run run;
    bool is_dark;       // behind an opaque caster
    bool has_list;      // that may filter the light
};

shadow_tap shadow_tap_read(shadow_view view, uint texel, float depth, float reach, bool is_dark)
{
    shadow_tap tap;
    tap.depth = depth;
    tap.reach = reach;
    tap.is_dark = is_dark;
    tap.has_list = shadow_run_read(view.technique, view.flags, view.head_base + texel,
                                   view.event_base, tap.run) && !is_dark;
    return tap;
}

#ifdef SHADOW_HAS_CUBES
// Faces +X -X +Y -Y +Z -Z; face axes (x, y, z) = (v[k+1], -s v[k+2], s v[k]) for axis k and sign s:
// never mirrored.
uint shadow_cube_face(vec3 v)
{
    vec3 a = abs(v);
    uint k = a.x >= a.y && a.x >= a.z ? 0u : (a.y >= a.z ? 1u : 2u);
    float along = k == 0u ? v.x : (k == 1u ? v.y : v.z);
    return 2u * k + (along < 0.0 ? 1u : 0u);
}

vec3 shadow_face_from_light(uint face, vec3 v)
{
    float s = (face & 1u) == 0u ? 1.0 : -1.0;
    uint k = face >> 1u;
    vec3 r = k == 0u ? v.yzx : (k == 1u ? v.zxy : v.xyz);
    return vec3(r.x, -s * r.y, s * r.z);
}

vec3 shadow_light_from_face(uint face, vec3 f)
{
    float s = (face & 1u) == 0u ? 1.0 : -1.0;
    uint k = face >> 1u;
    vec3 r = vec3(f.x, -s * f.y, s * f.z);
    return k == 0u ? r.zxy : (k == 1u ? r.yzx : r);
}

// at may lie outside of its face: the texel of the neighbouring face in that direction is taken
// then.
void shadow_cross_seam(float size, inout uint face, inout ivec2 at)
{
    vec3 v = shadow_light_from_face(face, vec3((vec2(at) + 0.5) * (2.0 / size) - 1.0, 1.0));
    face = shadow_cube_face(v);
    v = shadow_face_from_light(face, v);
    at = ivec2(floor((v.xy / v.z * 0.5 + 0.5) * size));
}
#endif

#ifdef SHADOW_HAS_PERSPECTIVE
shadow_tap shadow_tap_perspective(shadow_view view, shadow_receiver r, uint face, ivec2 at)
{
    float size = float(view.resolution);
    vec3 p = r.p, n = r.n;
#ifdef SHADOW_HAS_CUBES
    if (view.shape == SHADOW_CUBE) {
        shadow_cross_seam(size, face, at);
        p = shadow_face_from_light(face, p);
        n = shadow_face_from_light(face, n);
    }
#endif
    at = clamp(at, ivec2(0), ivec2(view.resolution - 1u));
    float texel = view.projection.y; // its width at distance 1
    vec3 ray = vec3((vec2(at) + 0.5 - 0.5 * size) * texel, 1.0);
    float reach = dot(n, p), slope = dot(n, ray), ray_length = length(ray);
    float texel_m = texel * abs(p.z), per_slope = 1.0 / max(abs(slope), 1e-6), z = p.z;
    if (reach * slope > 0.0)
        z = min(abs(reach) * per_slope, p.z + STEEPEST_TEXELS * texel_m);
    float reach_m = z * ray_length, steepness = min(r.n_length * per_slope, STEEPEST);
    z -= SHADOW_ROUNDING * z * min(steepness * ray_length, STEEPEST) + r.rounding_m * steepness;
    z -= SNAPPING * texel_m * (abs(n.x) + abs(n.y)) * per_slope;
    vec2 tolerance_m = r.tolerance * (shadow_tolerance(steepness * ray_length) * texel_m);
    float z_opaque = tolerance_m.x > 0.0 ? min(z, p.z) - tolerance_m.x : z;
    uint index = shadow_texel_index(view, face, at);
    bool is_dark = z_opaque * shadow_opaque(view, index) > view.projection.z; // of near / z
    z -= tolerance_m.y;
#ifdef SHADOW_FAITHFUL
    reach_m = length(p) - OFFSET_TEXELS * texel_m;
#endif
    return shadow_tap_read(view, index, z * ray_length, reach_m, is_dark);
}
#endif

#ifdef SHADOW_HAS_ORTHOGRAPHIC
shadow_tap shadow_tap_orthographic(shadow_view view, shadow_receiver r, ivec2 at)
{
    float range = view.projection.z;
    at = clamp(at, ivec2(0), ivec2(view.resolution - 1u));
    float size = float(view.resolution);
    vec2 texels_m = 2.0 / (size * view.projection.xy);
    vec2 center = (vec2(at) + 0.5 - 0.5 * size) * texels_m;
    float toward = -dot(r.n.xy, center - r.p.xy), slope = r.n.z;
    float texel_m = max(texels_m.x, texels_m.y), z = r.p.z;
    if (slope != 0.0)
        z += min(toward / slope, STEEPEST_TEXELS * texel_m);
    float reach_m = z, per_slope = 1.0 / max(abs(slope), 1e-6);
    float steepness = min(r.n_length * per_slope, STEEPEST);
    z -= (SHADOW_ROUNDING * range + r.rounding_m) * steepness;
    z -= SNAPPING * dot(texels_m, abs(r.n.xy)) * per_slope;
    vec2 tolerance_m = r.tolerance * (shadow_tolerance(steepness) * texel_m);
    float z_opaque = tolerance_m.x > 0.0 ? min(z, r.p.z) - tolerance_m.x : z;
    uint texel = shadow_texel_index(view, 0u, at);
    float nearest = shadow_opaque(view, texel); // 1 at the near side, 0 where nothing is
    bool is_dark = nearest > 0.0 && z_opaque > (1.0 - nearest) * range;
    z -= tolerance_m.y;
#ifdef SHADOW_FAITHFUL
    reach_m = r.p.z - OFFSET_TEXELS * min(texels_m.x, texels_m.y);
#endif
    return shadow_tap_read(view, texel, z, reach_m, is_dark);
}
#endif

// Where the point falls on the map: (x, y) in [-1, 1] and the face. False behind a spot, or where
// no caster can be.
bool shadow_locate(shadow_view view, vec3 p, out vec2 ndc, out uint face)
{
    face = 0u;
#ifdef SHADOW_HAS_ORTHOGRAPHIC
    ndc = p.xy * view.projection.xy;
    if (view.shape == SHADOW_ORTHOGRAPHIC)
        return all(lessThanEqual(abs(ndc), vec2(1.0)));
#endif
#ifdef SHADOW_HAS_PERSPECTIVE
#ifdef SHADOW_HAS_CUBES
    if (view.shape == SHADOW_CUBE) {
        face = shadow_cube_face(p);
        p = shadow_face_from_light(face, p);
    }
#endif
    ndc = p.xy * (view.projection.x / p.z); // x = 1 of a cube
    if (view.shape == SHADOW_ONE_FACE && any(greaterThan(abs(ndc), vec2(1.0))))
        return false; // outside of a spot's cone, or of the casters of a light far away
#endif
    return p.z > 0.0;
}

shadow_tap shadow_tap_at(shadow_view view, shadow_receiver r, uint face, ivec2 at)
{
#ifndef SHADOW_HAS_PERSPECTIVE
    return shadow_tap_orthographic(view, r, at);
#else
#ifdef SHADOW_HAS_ORTHOGRAPHIC
    if (view.shape == SHADOW_ORTHOGRAPHIC)
        return shadow_tap_orthographic(view, r, at);
#endif
    return shadow_tap_perspective(view, r, face, at);
#endif
}

vec3 shadow_transmittance(uint shadow, vec3 p, vec3 n, vec2 tolerance, uint object)
{
    if (shadow == NO_SHADOW)
        return vec3(1.0);
    shadow_view view = shadow_view_read(shadow);
    shadow_receiver r = shadow_receiver_read(shadow, p, n);
    r.tolerance = tolerance;
    vec2 ndc;
    uint face;
    if (!shadow_locate(view, r.p, ndc, face))
        return vec3(1.0);

    // A tent over side * side texels.
    int side = u_shadow_taps >= 64u ? 8 : u_shadow_taps >= 16u ? 4
             : u_shadow_taps >= 9u ? 3 : u_shadow_taps >= 4u ? 2 : 1;
    vec2 c = clamp((ndc * 0.5 + 0.5) * float(view.resolution), vec2(0.0), vec2(view.resolution));
    vec2 first = floor(c - 0.5 * float(side - 1));
    vec3 sum = vec3(0.0);
    float weights = 0.0, weight = 0.0;
    // Taps in the dark or without a list are dealt with on the way to the next one that has a list:
    // a group of lanes searches as often as the lane with most lists, mostly not once per tap. On
    // llvmpipe only a loop's end is a jump: one tested first runs its body once more with all lanes
    // off, and what leaves one tested last must be assigned under a condition of the lane.
    int x = 0, y = 0;
    do {
        shadow_tap tap;
        bool has_list = false;
        do {
            if (y < side) {
                vec2 at = first + vec2(x, y);
                vec2 w = max(0.5 * float(side) - abs(at + 0.5 - c), vec2(1e-7));
                weight = side == 1 ? 1.0 : w.x * w.y;
                tap = shadow_tap_at(view, r, face, ivec2(at));
                weights += weight;
                sum += tap.is_dark || tap.has_list ? 0.0 : weight;
                has_list = tap.has_list;
                x++;
                y += x == side ? 1 : 0;
                x = x == side ? 0 : x;
            }
        } while (!has_list && y < side);
        if (has_list)
            sum += weight * shadow_list(view.technique, tap.run,
                                        shadow_look(view.flags, view.event_base, tap.depth,
                                                    tap.reach, view.sigma, view.projection.w,
                                                    object));
    } while (y < side);
    return sum * (1.0 / weights);
}
#endif
