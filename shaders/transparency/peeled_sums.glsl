// SPDX-License-Identifier: MIT
// Of each sample: the light of the layers peeled so far, and what they let through; DUAL: then the
// same of those that are peeled from behind. Wide numbers are kept as two f32. Needs: wide.glsl,
// SAMPLES, SUMS_ACCESS. Provides: sums_load, of all layers; sums_load_side, of those at a place.
layout(std430, binding = BIND_PEELED_SUMS) SUMS_ACCESS buffer sum_buffer { vec4 peeled_sums[]; };
#define SIDE_VECTORS 3u
#ifdef DUAL
#define SUMS_VECTORS 6u // of a sample
#else
#define SUMS_VECTORS 3u
#endif

uint sums_place(uint pixel, int sample_)
{
    return SUMS_VECTORS * (pixel * uint(SAMPLES) + uint(sample_));
}

void sums_load_side(uint place, out wide3 light, out wide3 share)
{
    vec4 a = peeled_sums[place], b = peeled_sums[place + 1u], c = peeled_sums[place + 2u];
    light = wide_join(a.xyz, b.xyz);
    share = wide_join(vec3(a.w, b.w, c.x), c.yzw);
}

void sums_load(uint pixel, int sample_, out wide3 light, out wide3 share)
{
    uint place = sums_place(pixel, sample_);
    sums_load_side(place, light, share);
#ifdef DUAL
    wide3 back_light, back_share;
    sums_load_side(place + SIDE_VECTORS, back_light, back_share);
    light = light_add(light, share, wide_high(back_light));
    light = light_add(light, share, wide_low(back_light));
    share = share_join(share, back_share);
#endif
}
