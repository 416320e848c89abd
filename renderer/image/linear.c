/* SPDX-License-Identifier: MIT */
/* The inverse of the sRGB transfer function by table, and multiplication with alpha. */
#include "renderer/image/linear.h"

#include <string.h>

bool image_linear_from_srgb(const struct image *srgb, struct image *linear, struct error *err)
{
    float table[256];
    memset(linear, 0, sizeof *linear);
    if (srgb->component != IMAGE_U8 || srgb->channels != 4 || !srgb->pixels)
        return error_set(err, ERROR_INTERNAL, "linearisation takes an RGBA image of U8");
    if (!image_init(linear, srgb->width_px, srgb->height_px, 4, IMAGE_F32, err))
        return false;
    for (int code = 0; code < 256; code++)
        table[code] = (float)srgb_to_linear(code / 255.0);
    const uint8_t *in = srgb->pixels;
    float *out = linear->pixels;
    size_t count = (size_t)srgb->width_px * (size_t)srgb->height_px;
    for (size_t i = 0; i < count; i++, in += 4, out += 4) {
        float alpha = (float)in[3] / 255;
        for (int c = 0; c < 3; c++)
            out[c] = table[in[c]] * alpha;
        out[3] = alpha;
    }
    return true;
}
