/* SPDX-License-Identifier: MIT */
/* Each level is made from the one before; a texel is the mean of the area that it covers there. */
#include "renderer/scene/texture_levels.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/image/linear.h"

enum { LINEAR_MAX = 65535 }; /* 20 steps for the darkest step of sRGB */

struct texture_tables {
    uint16_t linear_from_srgb[256];
    uint8_t srgb_from_linear[LINEAR_MAX + 1];
};

uint32_t texture_level_count(uint32_t width_px, uint32_t height_px)
{
    uint32_t levels = 1;
    while (levels < TEXTURE_LEVELS_MAX && (width_px | height_px) >> levels)
        levels++;
    return levels;
}

uint64_t texture_levels_bytes(uint32_t width_px, uint32_t height_px, uint32_t first)
{
    uint64_t bytes = 0;
    for (uint32_t i = first; i < texture_level_count(width_px, height_px); i++)
        bytes += 4ull * texture_level_side(width_px, i) * texture_level_side(height_px, i);
    return bytes;
}

static uint8_t srgb_from_linear(int i)
{
    double linear = (double)i / LINEAR_MAX;
    double s = linear <= 0.0031308 ? linear * 12.92 : 1.055 * pow(linear, 1 / 2.4) - 0.055;
    return (uint8_t)(s * 255 + 0.5);
}

/* The first entry after `from` that is above `shade`: where the curve says, give or take rounding.
 */
static int find_end(int shade, int from)
{
    int end = (int)(srgb_to_linear((shade + 0.5) / 255) * LINEAR_MAX);
    while (end > from && srgb_from_linear(end - 1) > shade)
        end--;
    while (end <= LINEAR_MAX && srgb_from_linear(end) <= shade)
        end++;
    return end;
}

struct texture_tables *texture_tables_create(struct error *err)
{
    struct texture_tables *tables = malloc(sizeof *tables);
    if (!tables) {
        error_set(err, ERROR_NO_MEMORY, "tables of sRGB");
        return NULL;
    }
    for (int i = 0; i < 256; i++)
        tables->linear_from_srgb[i] = (uint16_t)(srgb_to_linear(i / 255.0) * LINEAR_MAX + 0.5);
    for (int shade = 0, begin = 0; shade < 256; shade++) {
        int end = shade < 255 ? find_end(shade, begin) : LINEAR_MAX + 1;
        memset(tables->srgb_from_linear + begin, shade, (size_t)(end - begin));
        begin = end;
    }
    return tables;
}

void texture_tables_destroy(struct texture_tables *tables)
{
    free(tables);
}

struct plane { /* one level */
    const uint8_t *pixels;
    uint32_t width, height;
};

/* Both sides even: four texels each. */
static void halve(const struct plane *from, const struct texture_tables *srgb, uint8_t *to)
{
    size_t row = 4 * (size_t)from->width;
    for (uint32_t y = 0; y < from->height; y += 2) {
        const uint8_t *a = from->pixels + y * row, *b = a + row;
        for (uint32_t x = 0; x < from->width; x += 2, a += 8, b += 8, to += 4) {
            for (int c = 0; c < 3 && srgb; c++) {
                const uint16_t *light = srgb->linear_from_srgb;
                uint32_t sum =
                    (uint32_t)light[a[c]] + light[a[c + 4]] + light[b[c]] + light[b[c + 4]];
                to[c] = srgb->srgb_from_linear[(sum + 2) / 4];
            }
            for (int c = srgb ? 3 : 0; c < 4; c++)
                to[c] = (uint8_t)((a[c] + a[c + 4] + b[c] + b[c + 4] + 2) / 4);
        }
    }
}

/* The texels of a row or column of `size` that texel i of `shrunk` covers, and how much of each, in
 * parts of `size` altogether. */
struct span {
    uint32_t first, count;
    uint64_t weights[3];
};

static struct span find_span(uint32_t i, uint32_t size, uint32_t shrunk)
{
    uint64_t begin = (uint64_t)i * size, end = begin + size;
    struct span span = {.first = (uint32_t)(begin / shrunk)};
    for (uint64_t k = span.first; k * shrunk < end; k++) {
        uint64_t low = k * shrunk > begin ? k * shrunk : begin;
        uint64_t high = (k + 1) * shrunk < end ? (k + 1) * shrunk : end;
        span.weights[span.count++] = high - low;
    }
    return span;
}

static void average(const struct plane *from, const struct texture_tables *srgb,
                    const struct span *columns, const struct span *rows, uint8_t to[4])
{
    uint64_t sums[4] = {0}, whole = (uint64_t)from->width * from->height;
    for (uint32_t j = 0; j < rows->count; j++)
        for (uint32_t i = 0; i < columns->count; i++) {
            size_t at = (size_t)(rows->first + j) * from->width + columns->first + i;
            const uint8_t *texel = from->pixels + 4 * at;
            uint64_t weight = rows->weights[j] * columns->weights[i];
            for (int c = 0; c < 4; c++)
                sums[c] += weight * (srgb && c < 3 ? srgb->linear_from_srgb[texel[c]] : texel[c]);
        }
    for (int c = 0; c < 4; c++) {
        uint64_t mean = (sums[c] + whole / 2) / whole;
        to[c] = srgb && c < 3 ? srgb->srgb_from_linear[mean] : (uint8_t)mean;
    }
}

static void shrink(const struct plane *from, const struct texture_tables *srgb, uint8_t *to)
{
    uint32_t width = texture_level_side(from->width, 1);
    uint32_t height = texture_level_side(from->height, 1);
    for (uint32_t y = 0; y < height; y++) {
        struct span rows = find_span(y, from->height, height);
        for (uint32_t x = 0; x < width; x++, to += 4) {
            struct span columns = find_span(x, from->width, width);
            average(from, srgb, &columns, &rows, to);
        }
    }
}

void texture_levels_build(const struct texture_levels_desc *desc, uint8_t *levels)
{
    const struct texture_tables *srgb = desc->is_srgb ? desc->tables : NULL;
    struct plane from = {desc->pixels, desc->width_px, desc->height_px};
    while (from.width > 1 || from.height > 1) {
        bool is_even = from.width % 2 == 0 && from.height % 2 == 0;
        (is_even ? halve : shrink)(&from, srgb, levels);
        from = (struct plane){levels, texture_level_side(from.width, 1),
                              texture_level_side(from.height, 1)};
        levels += 4ull * from.width * from.height;
    }
}
