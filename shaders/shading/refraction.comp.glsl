// SPDX-License-Identifier: MIT
// Puts behind surfaces that bend light what is seen through them, looked up in the picture without
// them: docs/explanation/shading.md, section 8. The composition of each pixel's layers
// (shade_pixels.comp.glsl) has left what is before it, and what they let through.
// Needs: SAMPLES, IS_ORTHOGRAPHIC; HAS_BACKDROP, MAPPED_LATER and TONE_HAS_CHOICE as
// shade_pixels.comp.glsl.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"
#include "material/material.glsl"
#include "draw/surface.glsl"
#include "window/view_ray.glsl"
#ifdef HAS_BACKDROP
#include "shading/backdrop.glsl"
#endif
layout(local_size_x = 8, local_size_y = 8) in;
#include "window/gbuffer.glsl"
layout(std430, binding = BIND_ENTRY_SURFACE_0) readonly buffer s0_buffer { uvec4 surfaces_0[]; };
layout(std430, binding = BIND_ENTRY_SURFACE_1) readonly buffer s1_buffer { uvec4 surfaces_1[]; };
layout(std430, binding = BIND_ENTRY_SURFACE_2) readonly buffer s2_buffer { uvec4 surfaces_2[]; };
layout(rgba32f, binding = 0) uniform image2D u_image;
layout(rgba32f, binding = 3) readonly uniform image2DArray u_bent_parts;
layout(r32ui, binding = 4) readonly uniform uimage2D u_bent;
layout(binding = UNIT_REFRACTION_LEVELS) uniform sampler2D u_levels;
uniform uvec2 u_size_px;

const float PI = 3.14159265358979;
const int TAPS = 16;
const float FAR = 1e6; // times its depth: what is behind everything

struct bend {
    vec3 position, way; // view space [m]; unit, from the eye
    vec3 normal;        // unit, on the viewer's side
    float ior, half_spread, alpha, thickness;
    bool is_solid;
    float depth;        // stored
};

float depth_at(ivec2 pixel)
{
    return texelFetch(u_depth_map, pixel, 0).x;
}

bend load_bend(ivec2 pixel, uint entry)
{
    bend b;
    uvec4 s1 = surfaces_1[entry], s2 = surfaces_2[entry];
    surface s = surface_unpack(surfaces_0[entry], s1);
    material_record r = materials[s.material];
    b.depth = uintBitsToFloat(s2.w);
    b.position = view_position(vec2(pixel) + 0.5, view_depth(b.depth));
    b.way = -view_direction(b.position);
    b.normal = dot(s.normal, b.way) < 0.0 ? s.normal : s.geo_normal;
    b.ior = r.attenuation.w;
    b.half_spread = r.edge_color.w;
    float roughness = s.roughness * clamp(2.0 * b.ior - 2.0, 0.0, 1.0);
    b.alpha = roughness >= BEND_ROUGHNESS_LEAST ? roughness * roughness : 0.0;
    bool is_medium = (r.flags & MATERIAL_MEDIUM) != 0u;
    b.thickness = is_medium ? r.transmission_f0_thickness.z : uintBitsToFloat(s2.y);
    b.is_solid = (r.flags & MATERIAL_SOLID) != 0u;
    if (!s.is_front)
        b.thickness = 0.0;
    return b;
}

vec2 pixel_of(vec3 p)
{
#ifdef IS_ORTHOGRAPHIC
    vec2 plane = p.xy;
#else
    vec2 plane = p.xy / max(-p.z, 1e-30);
#endif
    return (plane - u_window.xy) / u_window.zw - vec2(u_window_first);
}

// Where the ray meets the plane of that depth.
vec3 reach(vec3 from, vec3 way, float view_z)
{
    float facing = max(-way.z, 0.05);
    return from + way * (max(view_z + from.z, 0.0) / facing);
}

// Of the ray from the surface on: where it leaves glass.
vec3 leave(bend b, float ior)
{
    if (b.thickness <= 0.0 || ior <= 1.0)
        return b.position;
    vec3 inside = refract(b.way, b.normal, 1.0 / ior);
    float c = max(-dot(inside, b.normal), 1e-3);
    // the chord of a ball of that diameter; the way through a slab
    return b.position + inside * b.thickness * (b.is_solid ? c : 1.0 / c);
}

// Seen behind a slab: straight on from there; behind a solid: at the pixel where it leaves.
vec2 bent_pixel(bend b, float ior, float behind)
{
    vec3 out_ = leave(b, ior);
    if (b.is_solid)
        return pixel_of(out_);
    vec3 shift = out_ - b.position;
    shift -= b.way * dot(shift, b.way);
    return pixel_of(reach(b.position + shift, b.way, behind));
}

// Visible normals: Heitz 2018, "Sampling the GGX Distribution of Visible Normals", appendix A.
vec3 visible_normal(vec3 v, float alpha, vec2 u)
{
    vec3 s = normalize(vec3(alpha * v.xy, v.z));
    float across = dot(s.xy, s.xy);
    vec3 t1 = across > 0.0 ? vec3(-s.y, s.x, 0.0) * inversesqrt(across) : vec3(1.0, 0.0, 0.0);
    vec3 t2 = cross(s, t1);
    float radius = sqrt(u.x), phi = 2.0 * PI * u.y, half_ = 0.5 * (1.0 + s.z);
    float p1 = radius * cos(phi), p2 = radius * sin(phi);
    p2 = mix(sqrt(max(1.0 - p1 * p1, 0.0)), p2, half_);
    vec3 h = p1 * t1 + p2 * t2 + sqrt(max(1.0 - p1 * p1 - p2 * p2, 0.0)) * s;
    return normalize(vec3(alpha * h.xy, max(h.z, 0.0)));
}

// The lobe of a thin wall, on the far side. What a solid spreads at both of its sides is as wide as
// that of a wall of this alpha: (n - 1) of the tilt at each, where a mirror has twice of one.
vec3 scattered(bend b, vec3 x, vec3 y, float alpha, vec2 u)
{
    vec3 v = vec3(dot(-b.way, x), dot(-b.way, y), max(dot(-b.way, b.normal), 1e-4));
    v = normalize(v);
    vec3 h = visible_normal(v, alpha, u);
    vec3 l = 2.0 * dot(v, h) * h - v;
    l.z = -abs(l.z);
    return x * l.x + y * l.y + b.normal * l.z;
}

float lobe_alpha(bend b)
{
    return b.is_solid ? b.alpha * min(0.70710678 * (b.ior - 1.0), 1.0) : b.alpha;
}

vec4 look_up(vec2 pixel, float level, bend b, ivec2 own)
{
    vec2 at = clamp(pixel, vec2(0.5), vec2(u_size_px) - 0.5);
    // what is before the glass is not behind it
    if (depth_at(ivec2(at)) > b.depth)
        at = vec2(own) + 0.5;
    return textureLod(u_levels, at / vec2(u_size_px), level);
}

// behind: view depth of what is there.
vec4 look_through(bend b, float ior, float behind, ivec2 own)
{
    vec2 centre = bent_pixel(b, ior, behind);
    if (b.alpha == 0.0)
        return look_up(centre, 0.0, b, own);
    vec3 x = normalize(abs(b.normal.x) < 0.7 ? cross(b.normal, vec3(1.0, 0.0, 0.0))
                                             : cross(b.normal, vec3(0.0, 1.0, 0.0)));
    vec3 y = cross(b.normal, x);
    float alpha = lobe_alpha(b);
    vec2 straight = pixel_of(reach(b.position, b.way, behind));
    vec3 side = normalize(b.way + 2.0 * alpha * normalize(x - b.way * dot(x, b.way) + 1e-6));
    float radius = length(pixel_of(reach(b.position, side, behind)) - straight);
    float level = max(log2(max(radius, 1e-3) * sqrt(PI / float(TAPS))), 0.0);
    vec4 sum = vec4(0.0);
    for (int i = 0; i < TAPS; i++) {
        vec2 u = fract(0.5 + float(i) * vec2(0.7548776662, 0.5698402910)); // Roberts 2018, R2
        vec3 way = scattered(b, x, y, alpha, u);
        vec2 off = pixel_of(reach(b.position, way, behind)) - straight;
        sum += look_up(centre + off, level, b, own);
    }
    return sum / float(TAPS);
}

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(gl_GlobalInvocationID.xy, u_size_px)))
        return;
    uint word = imageLoad(u_bent, pixel).x;
    if (word == 0u)
        return;
    bend b = load_bend(pixel, word - 1u);
    float depth = depth_at(pixel);
#ifdef IS_ORTHOGRAPHIC
    float behind = depth > 0.0 ? view_depth(depth) : u_depth.y;
#else
    float behind = depth > 0.0 ? view_depth(depth) : FAR * view_depth(b.depth);
#endif
    vec4 seen = look_through(b, b.ior, behind, pixel);
    if (b.half_spread > 0.0) {
        vec4 red = look_through(b, max(b.ior - b.half_spread, 1.0), behind, pixel);
        vec4 blue = look_through(b, b.ior + b.half_spread, behind, pixel);
        seen = vec4(red.r, seen.g, blue.b, (red.a + seen.a + blue.a) / 3.0);
    }
    vec4 share = imageLoad(u_bent_parts, ivec3(pixel, 0));
    vec4 image = imageLoad(u_image, pixel);
    vec3 radiance = max(image.rgb + share.rgb * seen.rgb, 0.0); // haze before glass is taken off
    vec3 open = share.rgb * (1.0 - seen.a);
#ifdef HAS_BACKDROP
    vec4 bare = imageLoad(u_bent_parts, ivec3(pixel, 1));
    vec4 result = map_over_backdrop(pixel, radiance, bare + vec4(open, share.a));
#else
    vec4 result = vec4(radiance, image.a + share.a - (open.r + open.g + open.b) / 3.0);
#endif
    result = mix(result, vec4(0.0), isnan(result));
    imageStore(u_image, pixel, clamp(result, vec4(-3e38), vec4(3e38)));
}
