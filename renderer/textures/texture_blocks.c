/* SPDX-License-Identifier: MIT */
/* The only file that uses stb_dxt, and a decoder of its blocks, which measures their error. */
#include "renderer/textures/texture_blocks.h"

#include <stb_dxt.h>
#include <string.h>

#include "renderer/scene/texture_levels.h"

uint64_t texture_blocks_bytes(uint32_t width_px, uint32_t height_px, uint32_t first, bool has_alpha)
{
    uint64_t bytes = 0;
    for (uint32_t level = first; level < texture_level_count(width_px, height_px); level++)
        bytes += (uint64_t)texture_block_bytes(has_alpha) *
                 texture_blocks_across(texture_level_side(width_px, level)) *
                 texture_blocks_across(texture_level_side(height_px, level));
    return bytes;
}

static void widen(unsigned color, int rgb[3])
{
    int r = (int)(color >> 11), g = (int)(color >> 5 & 63), b = (int)(color & 31);
    rgb[0] = r << 3 | r >> 2;
    rgb[1] = g << 2 | g >> 4;
    rgb[2] = b << 3 | b >> 2;
}

static double color_squares(const uint8_t texels[64], const uint8_t block[8])
{
    int colors[4][3];
    unsigned first = block[0] | (unsigned)block[1] << 8;
    unsigned second = block[2] | (unsigned)block[3] << 8;
    double squares = 0;
    widen(first, colors[0]);
    widen(second, colors[1]);
    for (int c = 0; c < 3; c++) { /* the encoder never asks for three colours and a hole */
        colors[2][c] = (2 * colors[0][c] + colors[1][c] + 1) / 3;
        colors[3][c] = (colors[0][c] + 2 * colors[1][c] + 1) / 3;
    }
    for (int i = 0; i < 16; i++) {
        const int *color = colors[block[4 + i / 4] >> 2 * (i % 4) & 3];
        for (int c = 0; c < 3; c++) {
            int difference = color[c] - texels[4 * i + c];
            squares += (double)difference * difference;
        }
    }
    return squares;
}

/* Two ends and six values between them, or four, 0 and 1; three bits a texel. */
static double alpha_squares(const uint8_t texels[64], const uint8_t block[8])
{
    int values[8] = {block[0], block[1]};
    uint64_t codes = 0;
    double squares = 0;
    for (int i = 0; i < 6; i++)
        codes |= (uint64_t)block[2 + i] << 8 * i;
    int steps = block[0] > block[1] ? 7 : 5;
    for (int i = 1; i < steps; i++)
        values[1 + i] = ((steps - i) * block[0] + i * block[1] + steps / 2) / steps;
    if (steps == 5) {
        values[6] = 0;
        values[7] = 255;
    }
    for (int i = 0; i < 16; i++) {
        int difference = values[codes >> 3 * i & 7] - texels[4 * i + 3];
        squares += (double)difference * difference;
    }
    return squares;
}

static void gather(const uint8_t *rgba, const uint32_t size[2], const uint32_t at[2],
                   bool has_alpha, uint8_t texels[64])
{
    for (uint32_t i = 0; i < 16; i++) {
        uint32_t x = at[0] + i % 4, y = at[1] + i / 4;
        x = x < size[0] ? x : size[0] - 1;
        y = y < size[1] ? y : size[1] - 1;
        memcpy(texels + 4 * (size_t)i, rgba + 4 * ((size_t)y * size[0] + x), 4);
        if (!has_alpha)
            texels[4 * i + 3] = 255;
    }
}

void texture_blocks_encode(const uint8_t *rgba, uint32_t width_px, uint32_t height_px,
                           bool has_alpha, uint8_t *blocks, double *squares)
{
    const uint32_t size[2] = {width_px, height_px};
    for (uint32_t y = 0; y < height_px; y += TEXTURE_BLOCK_SIDE)
        for (uint32_t x = 0; x < width_px; x += TEXTURE_BLOCK_SIDE) {
            uint8_t texels[64];
            gather(rgba, size, (uint32_t[2]){x, y}, has_alpha, texels);
            stb_compress_dxt_block(blocks, texels, has_alpha, STB_DXT_HIGHQUAL);
            if (has_alpha)
                *squares += alpha_squares(texels, blocks);
            *squares += color_squares(texels, has_alpha ? blocks + 8 : blocks);
            blocks += texture_block_bytes(has_alpha);
        }
}
