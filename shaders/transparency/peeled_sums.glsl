// SPDX-License-Identifier: MIT
// Of each sample: the light of the layers peeled so far, and what they let through. Wide numbers
// are kept as two f32. Needs: wide.glsl, SAMPLES, SUMS_ACCESS. Provides: sums_load, sums_store.
layout(std430, binding = BIND_PEELED_SUMS) SUMS_ACCESS buffer sum_buffer { vec4 peeled_sums[]; };

uint sums_place(uint pixel, int sample_)
{
    return 3u * (pixel * uint(SAMPLES) + uint(sample_));
}

void sums_load(uint pixel, int sample_, out wide3 light, out wide3 share)
{
    uint k = sums_place(pixel, sample_);
    vec4 a = peeled_sums[k], b = peeled_sums[k + 1u], c = peeled_sums[k + 2u];
    light = wide_join(a.xyz, b.xyz);
    share = wide_join(vec3(a.w, b.w, c.x), c.yzw);
}
