// SPDX-License-Identifier: MIT
// The window's linear image as a screen shows it, as renderer/image/tone_map.c makes it: exposure,
// tone mapping, the sRGB code, alpha that is not associated. A thread for four pixels, the
// top row first; what is behind the last pixel is written and means nothing.
#include "shared/bindings.h"
#define TONE_HAS_CHOICE
#include "image/tone_operators.glsl"
layout(local_size_x = 64) in;
layout(rgba32f, binding = 0) uniform readonly image2D u_image;
layout(std430, binding = BIND_SCREEN) writeonly buffer screen_buffer { uint words[]; };
layout(std430, binding = BIND_TONE_BUCKETS) readonly buffer bucket_buffer {
    tone_bucket buckets[];
};
uniform uvec2 u_size_px;
uniform uint u_channels; // 3 or 4
uniform float u_gain; // of the exposure

uint encode_srgb(float x)
{
    uint bucket = floatBitsToUint(x) >> TONE_BUCKET_SHIFT;
    if (x >= 1.0)
        return 255u;
    if (!(x > 0.0) || bucket < TONE_FIRST_BUCKET)
        return 0u;
    tone_bucket b = buckets[bucket - TONE_FIRST_BUCKET];
    return b.code + uint(x >= b.threshold);
}

// Red in the lowest byte.
uint map_pixel(vec4 color)
{
    float alpha = min(tame(color.a), 1.0);
    precise float scale = alpha > 0.0 && alpha < 1.0 ? u_gain / alpha : u_gain;
    precise vec3 c = vec3(tame(color.r), tame(color.g), tame(color.b)) * scale;
    c = alpha > 0.0 ? mix(vec3(TONE_RADIANCE_MAX), c, lessThan(c, vec3(TONE_RADIANCE_MAX)))
                    : vec3(0.0);
    c = map_tones(c);
    precise float scaled_alpha = alpha * 255.0 + 0.5;
    return encode_srgb(c.r) | encode_srgb(c.g) << 8 | encode_srgb(c.b) << 16 |
           uint(scaled_alpha) << 24;
}

void main()
{
    uint thread = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u +
                  gl_LocalInvocationID.x;
    uint count = u_size_px.x * u_size_px.y;
    if (4u * thread >= count)
        return;
    uint pixels[4];
    for (uint i = 0u; i < 4u; i++) {
        uint index = min(4u * thread + i, count - 1u), row = index / u_size_px.x;
        ivec2 at = ivec2(index - row * u_size_px.x, u_size_px.y - 1u - row);
        pixels[i] = map_pixel(imageLoad(u_image, at));
    }
    if (u_channels == 4u) {
        for (uint i = 0u; i < 4u; i++)
            words[4u * thread + i] = pixels[i];
        return;
    }
    words[3u * thread] = pixels[0] & 0xffffffu | pixels[1] << 24;
    words[3u * thread + 1u] = pixels[1] >> 8 & 0xffffu | pixels[2] << 16;
    words[3u * thread + 2u] = pixels[2] >> 16 & 0xffu | pixels[3] << 8;
}
