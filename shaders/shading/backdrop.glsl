// SPDX-License-Identifier: MIT
// A background that is a colour of the screen, behind a picture that is mapped to one:
// docs/explanation/shading.md, section 6, as tone_map_over of renderer/image/tone_map.c has it.
// Needs: MAPPED_LATER: the picture is one of several, whose mean is mapped (accumulate.comp.glsl).
// Provides: map_over_backdrop, which then keeps what it is given.
#ifdef MAPPED_LATER
layout(rgba32f, binding = 6) writeonly uniform image2D u_behind;

vec4 map_over_backdrop(ivec2 pixel, vec3 radiance, vec4 behind)
{
    imageStore(u_behind, pixel, behind);
    return vec4(radiance, 1.0);
}
#else
#include "image/tone_operators.glsl"
uniform vec4 u_backdrop; // linear, associated alpha
uniform float u_gain;    // of the exposure

vec3 map_radiance(vec3 c)
{
    return min(map_tones(c), vec3(1.0));
}

// radiance: mean over the pixel. behind: the share of the background that is seen through
// something, per channel, likewise; a: the share of samples that something is before.
vec4 map_over_backdrop(ivec2 pixel, vec3 radiance, vec4 behind)
{
    vec3 bare = u_backdrop.rgb * (1.0 - behind.a), own = vec3(0.0);
    float seen = (behind.r + behind.g + behind.b) / 3.0 + 1.0 - behind.a;
    if (behind.a > 0.0) {
        vec3 light = vec3(tame(radiance.r), tame(radiance.g), tame(radiance.b));
        vec3 through = u_backdrop.rgb * behind.rgb / behind.a;
        vec3 lit = min(light * (u_gain / behind.a) + through, vec3(TONE_RADIANCE_MAX));
        own = max(through + (map_radiance(lit) - map_radiance(through)), vec3(0.0)) * behind.a;
    }
    return vec4(bare + own, 1.0 - (1.0 - u_backdrop.a) * seen);
}
#endif
