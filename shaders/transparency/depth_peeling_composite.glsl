// SPDX-License-Identifier: MIT
// The layers of a pixel as peeled_add.comp.glsl has composited them, one after the other.
// Not with HAS_MEDIA, HAS_REFRACTION, HAS_ATMOSPHERE: the row lacks them.
// Needs: SAMPLES, WALKS, u_size_px, wide.glsl.
#define SUMS_ACCESS readonly
#include "transparency/peeled_sums.glsl"

struct pixel_layers {
    uint pixel;
};

pixel_layers layers_begin(ivec2 pixel)
{
    return pixel_layers(uint(pixel.y) * u_size_px.x + uint(pixel.x));
}

void layers_composite(ivec2 pixel, int first_sample, pixel_layers layers,
                      out vec3 radiance[WALKS], out vec3 through[WALKS])
{
    for (int i = 0; i < WALKS; i++) {
        wide3 light, share;
        sums_load(layers.pixel, first_sample + i, light, share);
        radiance[i] = wide_round(light);
        through[i] = share_round(share);
    }
}
