/* SPDX-License-Identifier: MIT */
/* Texture lookups of rays. */
#include "renderer/raytrace/rt_texture.h"

#include <math.h>
#include <string.h>

#include "renderer/image/linear.h"
#include "renderer/raytrace/rt_math.h"

/* Numbers of glTF. */
enum {
    FILTER_NEAREST = 9728,
    FILTER_LINEAR = 9729,
    NEAREST_MIPMAP_NEAREST = 9984,
    LINEAR_MIPMAP_NEAREST = 9985,
    NEAREST_MIPMAP_LINEAR = 9986,
    WRAP_CLAMP = 33071,
    WRAP_MIRROR = 33648,
};

void rt_images_find(const struct scene *scene, struct rt_image *images)
{
    for (uint32_t i = 0; i < scene->image_count; i++) {
        const struct scene_image *from = &scene->images[i];
        const uint8_t *first = scene_image_pixels(scene, from);
        images[i] =
            (struct rt_image){.width_px = from->width_px,
                              .height_px = from->height_px,
                              .level_count = texture_level_count(from->width_px, from->height_px)};
        for (int kind = 0; kind < 2; kind++) {
            const uint8_t *level = first - from->offset_bytes + from->levels_offset_bytes[kind];
            images[i].levels[kind][0] = first;
            for (uint32_t k = 1; from->levels_offset_bytes[kind] && k < images[i].level_count;
                 k++) {
                images[i].levels[kind][k] = level;
                level += 4ull * texture_level_side(from->width_px, k) *
                         texture_level_side(from->height_px, k);
            }
        }
    }
}

void rt_images_withhold(struct rt_image *images, size_t count, const uint8_t *levels)
{
    for (size_t i = 0; i < count; i++)
        for (int kind = 0; kind < 2; kind++) {
            uint8_t level = levels ? levels[2 * i + (size_t)kind] : 0;
            bool is_there = level < images[i].level_count && images[i].levels[kind][level];
            images[i].finest[kind] = is_there ? level : 0;
        }
}

void rt_texel_tables_fill(struct rt_texel_tables *tables)
{
    for (int i = 0; i < 256; i++) {
        tables->linear_from_srgb[i] = srgb_to_linear(i / 255.0);
        tables->linear_from_unorm[i] = i / 255.0;
    }
}

static int64_t wrap_texel(int64_t i, int64_t size, uint32_t mode)
{
    if (i >= 0 && i < size)
        return i;
    if (mode == WRAP_CLAMP)
        return i < 0 ? 0 : size - 1;
    if (mode == WRAP_MIRROR) {
        int64_t k = ((i % (2 * size)) + 2 * size) % (2 * size);
        return k < size ? k : 2 * size - 1 - k;
    }
    if (!(size & (size - 1)))
        return i & (size - 1); /* a power of two, as most are: no division */
    return ((i % size) + size) % size;
}

/* A texture coordinate in texels, as the two texels around it and the second one's weight; nearest:
 * both are the one it lies in. */
struct texel_pair {
    size_t at[2];
    double weight;
};

static struct texel_pair find_texels(double x, int64_t size, uint32_t wrap, bool is_nearest)
{
    double from = is_nearest ? x : x - 0.5;
    int64_t low = (int64_t)from;
    low -= from < (double)low; /* floor, without a call */
    struct texel_pair pair = {.weight = is_nearest ? 0 : from - (double)low};
    pair.at[0] = (size_t)wrap_texel(low, size, wrap);
    pair.at[1] = is_nearest ? pair.at[0] : (size_t)wrap_texel(low + 1, size, wrap);
    return pair;
}

static void find_square(const struct rt_texture_lookup *lookup, uint32_t level, bool is_nearest,
                        struct rt_texel_square *square)
{
    const struct rt_image *image = lookup->image;
    const uint8_t *texels = image->levels[lookup->is_srgb][level];
    uint32_t width = texture_level_side(image->width_px, level);
    uint32_t height = texture_level_side(image->height_px, level);
    struct texel_pair x =
        find_texels(lookup->at[0] * width, width, lookup->texture->wrap_s, is_nearest);
    struct texel_pair y =
        find_texels(lookup->at[1] * height, height, lookup->texture->wrap_t, is_nearest);
    square->count = is_nearest ? 1 : 4;
    square->x = x.at[0];
    square->y = y.at[0];
    square->is_whole = is_nearest || (x.at[1] == x.at[0] + 1 && y.at[1] == y.at[0] + 1);
    for (int i = 0; i < square->count; i++) {
        square->texels[i] = texels + 4 * (y.at[i >> 1] * width + x.at[i & 1]);
        square->weights[i] = (i & 1 ? x.weight : 1 - x.weight) * (i & 2 ? y.weight : 1 - y.weight);
    }
}

void rt_texture_find_finest(const struct rt_texture_lookup *lookup, struct rt_texel_square *square)
{
    find_square(lookup, 0, lookup->texture->mag_filter == FILTER_NEAREST, square);
}

/* One level, or two neighbours and the second one's weight. */
struct level_pair {
    uint32_t level;
    double weight;
    bool is_nearest; /* of texels */
};

/* Eq. 8.4: the binary logarithm of the longer side of the pixel in texels of level 0, or 0 where it
 * is shorter than one. */
static double level_of_detail(const struct rt_texture_lookup *lookup)
{
    double longest = 0;
    for (int step = 0; step < 2; step++) {
        double u = lookup->per_pixel[step][0] * lookup->image->width_px;
        double v = lookup->per_pixel[step][1] * lookup->image->height_px;
        longest = rt_max(longest, u * u + v * v);
    }
    return longest > 1 ? 0.5 * (double)log2f((float)longest) : 0; /* all the same: magnified */
}

bool rt_texture_has_levels(const struct scene_texture *texture)
{
    return texture->min_filter >= NEAREST_MIPMAP_NEAREST;
}

/* 8.14.3 and 8.15: which filter, and which levels, counted from the finest that may be chosen. */
static struct level_pair choose_levels(const struct rt_texture_lookup *lookup)
{
    uint32_t mag = lookup->texture->mag_filter, min = lookup->texture->min_filter;
    bool is_late =
        mag == FILTER_LINEAR && (min == NEAREST_MIPMAP_NEAREST || min == NEAREST_MIPMAP_LINEAR);
    uint32_t base = lookup->is_finest ? 0 : lookup->image->finest[lookup->is_srgb];
    double lambda = lookup->is_finest ? 0 : level_of_detail(lookup) - base;
    if (lambda <= (is_late ? 0.5 : 0))
        return (struct level_pair){.level = base, .is_nearest = mag == FILTER_NEAREST};
    bool is_nearest =
        min == FILTER_NEAREST || min == NEAREST_MIPMAP_NEAREST || min == NEAREST_MIPMAP_LINEAR;
    uint32_t last = lookup->image->level_count - 1 - base;
    if (!rt_texture_has_levels(lookup->texture))
        return (struct level_pair){.level = base, .is_nearest = is_nearest};
    if (lambda >= last)
        return (struct level_pair){.level = base + last, .is_nearest = is_nearest};
    if (min == NEAREST_MIPMAP_NEAREST || min == LINEAR_MIPMAP_NEAREST)
        return (struct level_pair){.level =
                                       base + (lambda <= 0.5 ? 0 : (uint32_t)ceil(lambda - 0.5)),
                                   .is_nearest = is_nearest};
    uint32_t level = (uint32_t)lambda;
    return (struct level_pair){base + level, lambda - level, is_nearest};
}

static void prefetch(const struct rt_texel_square *square)
{
    __builtin_prefetch(square->texels[0]);
    if (square->count > 1)
        __builtin_prefetch(square->texels[2]); /* the row below */
}

void rt_texture_find(const struct rt_texture_lookup *lookup, struct rt_texel_sum *sum)
{
    struct level_pair pair = choose_levels(lookup);
    sum->is_srgb = lookup->is_srgb;
    sum->weights[0] = 1 - pair.weight;
    sum->weights[1] = pair.weight > 0 ? pair.weight : 0;
    find_square(lookup, pair.level, pair.is_nearest, &sum->squares[0]);
    prefetch(&sum->squares[0]);
    if (pair.weight <= 0)
        return;
    find_square(lookup, pair.level + 1, pair.is_nearest, &sum->squares[1]);
    prefetch(&sum->squares[1]);
}

void rt_texture_add_up(const struct rt_texel_sum *sum, const struct rt_texel_tables *tables,
                       double out[4])
{
    const double *linear = sum->is_srgb ? tables->linear_from_srgb : tables->linear_from_unorm;
    const double *unorm = tables->linear_from_unorm;
    double total[4] = {0}; /* in registers: out may be of the tables */
    for (int k = 0; k < 2 && sum->weights[k] > 0; k++) {
        const struct rt_texel_square *square = &sum->squares[k];
        for (int i = 0; i < square->count; i++) {
            const uint8_t *texel = square->texels[i];
            double w = sum->weights[k] * square->weights[i];
            total[0] += w * linear[texel[0]];
            total[1] += w * linear[texel[1]];
            total[2] += w * linear[texel[2]];
            total[3] += w * unorm[texel[3]];
        }
    }
    memcpy(out, total, sizeof total);
}
