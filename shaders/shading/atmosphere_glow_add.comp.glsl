// SPDX-License-Identifier: MIT
// Around a lamp in view in the haze: puts its light along the ways of pixels into the picture, in
// the place of what its columns have. Layers take of the difference what they take of the haze.
// Needs: SAMPLES, IS_ORTHOGRAPHIC, HAS_ATMOSPHERE, HAS_ATMOSPHERE_LIGHT; LAYERS, the source of the
// transparency method, where there are layers, with HAS_REFRACTION and those of media.glsl: all as
// shade_pixels.comp.glsl has them.
#include "shared/layout.h"
#include "shared/bindings.h"
#include "shared/records.h"
#include "base/wide.glsl"
#include "material/material.glsl"
#include "draw/surface.glsl"
#include "window/view_ray.glsl"
#include "shading/atmosphere.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
#include "window/gbuffer.glsl"
layout(rgba32f, binding = 0) uniform image2D u_image;
#ifdef HAS_REFRACTION
layout(rgba32f, binding = 5) uniform image2D u_unbent; // the picture without what bends
#endif
uniform uvec2 u_size_px;
uniform vec2 u_sample_positions[SAMPLES];
uniform uint u_glow_lamp;
uniform vec2 u_glow_place; // where the lamp is seen, in columns of the image
#ifdef SAMPLES_IN_TURN
#define WALKS 1
#else
#define WALKS SAMPLES
#endif
#include "shading/atmosphere_seen.glsl"
#define GLOW_ACCESS readonly
#include "shading/atmosphere_glow_store.glsl"

// Columns from the lamp: up to the first one the pixel's own way counts alone, from the last one on
// not at all. Chosen: where the columns have its light within a percent.
const float GLOW_NEAR = 2.0, GLOW_FAR = 4.0;

uvec2 glow_place = uvec2(0u); // of the pixel, in the square

float glow_word(uint k) { return glow[glow_at(u_glow_lamp, glow_place, k)]; }

// Up to the end of a part: of 0, nothing.
vec3 glow_up_to(uint part)
{
    if (part == 0u)
        return vec3(0.0);
    uint k = 4u + 3u * (part - 1u);
    return vec3(glow_word(k), glow_word(k + 1u), glow_word(k + 2u));
}

// The light along the own way up to a view depth.
vec3 glow_own(vec2 at, float view_z)
{
    float first = glow_word(0u), last = glow_word(1u), apart = glow_word(3u);
    if (!(last > first))
        return vec3(0.0);
    float t = distance(view_position(at, view_z), view_position(at, 0.0)) - glow_word(2u);
    float to = clamp(t, first, last);
    float part = atan(apart * (to - first), apart * apart + first * to) /
                 atan(apart * (last - first), apart * apart + first * last);
    part = clamp(part, 0.0, 1.0) * float(GLOW_PARTS);
    uint low = min(uint(part), GLOW_PARTS - 1u);
    return u_atmosphere_color * mix(glow_up_to(low), glow_up_to(low + 1u), part - float(low));
}

// As atmosphere_look and atmosphere_look_at, of what is missing.
atmosphere_seen glow_look(vec2 at, float view_z)
{
    float z = min(view_z, ATMOSPHERE_FAR);
    atmosphere_seen seen = atmosphere_look(at, z);
    return atmosphere_seen(glow_own(at, z) - seen.light, seen.through);
}

void glow_look_at(vec2 at, float depth[WALKS], out atmosphere_seen seen[WALKS])
{
    atmosphere_look_at(at, depth, seen);
    for (int i = 0; i < WALKS; i++)
        seen[i].light = glow_own(at, min(atmosphere_view_z(depth[i]), ATMOSPHERE_FAR)) -
                        seen[i].light;
}

#ifdef LAYERS
#define atmosphere_look glow_look
#define atmosphere_look_at glow_look_at
#define AIR_ALONE
#each LAYERS #include "$1"
#endif

void add(ivec2 pixel, float share)
{
    vec3 sum = vec3(0.0);
#ifdef HAS_REFRACTION
    vec3 unbent = vec3(0.0);
#endif
#ifdef LAYERS
    pixel_layers layers = layers_begin(pixel);
#endif
    for (int sample_ = 0; sample_ < SAMPLES; sample_ += WALKS) {
#ifdef LAYERS
        vec3 radiance[WALKS], through[WALKS];
        layers_composite(pixel, sample_, layers, radiance, through);
        for (int i = 0; i < WALKS; i++) {
            sum += radiance[i];
#ifdef HAS_REFRACTION
            unbent += bent_layers[i].radiance;
#endif
        }
#else
        float depth[WALKS];
        atmosphere_seen air[WALKS];
        for (int i = 0; i < WALKS; i++)
            depth[i] = texelFetch(u_depth_map, pixel, sample_ + i).x;
        glow_look_at(vec2(pixel) + 0.5, depth, air);
        for (int i = 0; i < WALKS; i++)
            sum += air[i].light;
#endif
    }
    vec4 seen = imageLoad(u_image, pixel);
    vec3 light = max(seen.rgb + share / float(SAMPLES) * sum, 0.0);
    imageStore(u_image, pixel, vec4(mix(min(light, 3e38), seen.rgb, isnan(light)), seen.a));
#ifdef HAS_REFRACTION
    seen = imageLoad(u_unbent, pixel);
    light = max(seen.rgb + share / float(SAMPLES) * unbent, 0.0);
    imageStore(u_unbent, pixel, vec4(mix(min(light, 3e38), seen.rgb, isnan(light)), seen.a));
#endif
}

void main()
{
    glow_place = gl_GlobalInvocationID.xy;
    ivec2 pixel = glow_pixel(u_glow_lamp, glow_place);
    uint side = glow_side_px();
    if (any(greaterThanEqual(glow_place, uvec2(side))) || any(lessThan(pixel, ivec2(0))) ||
        any(greaterThanEqual(pixel, ivec2(u_size_px))))
        return;
    vec2 column = (vec2(pixel + ivec2(u_window_first)) + 0.5) / u_atmosphere_side_px;
    float away = distance(column, u_glow_place);
    float share = 1.0 - smoothstep(GLOW_NEAR, GLOW_FAR, away);
    if (share > 0.0)
        add(pixel, share);
}
