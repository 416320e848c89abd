/* SPDX-License-Identifier: MIT */
/* Colour scales by linear interpolation between a few sRGB points. */
#include "renderer/accuracy/difference_map.h"

#include <math.h>
#include <string.h>

enum { POINTS_MAX = 9 };

struct color_scale {
    int count;
    uint8_t points[POINTS_MAX][3];
};

/* Nine points of "magma" by Smith and van der Walt (2015, dedicated to the public domain):
 * lightness grows evenly, also for the colour-blind and in grey print. */
static const struct color_scale magma = {9,
                                         {{0, 0, 4},
                                          {28, 16, 68},
                                          {79, 18, 123},
                                          {129, 37, 129},
                                          {181, 54, 122},
                                          {229, 80, 100},
                                          {251, 135, 97},
                                          {254, 194, 135},
                                          {252, 253, 191}}};

/* Blue, white, red; both halves get darker towards their ends. */
static const struct color_scale diverging = {
    5, {{10, 50, 110}, {80, 150, 205}, {250, 250, 250}, {220, 95, 75}, {110, 0, 30}}};

static const uint8_t not_finite[3] = {0, 255, 0};

/* position in [0, 1]. */
static void color_at(const struct color_scale *scale, double position, uint8_t rgb[3])
{
    double place = fmin(fmax(position, 0), 1) * (scale->count - 1);
    int index = (int)place < scale->count - 1 ? (int)place : scale->count - 2;
    double t = place - index;
    for (int c = 0; c < 3; c++)
        rgb[c] =
            (uint8_t)lrint((1 - t) * scale->points[index][c] + t * scale->points[index + 1][c]);
}

/* The value to colour; NAN when a pixel is not finite. */
static double difference_at(const struct difference_map_desc *desc, size_t pixel, int channels)
{
    if (desc->kind == DIFFERENCE_MAP_FLIP)
        return (double)((const float *)desc->flip->pixels)[pixel];
    size_t at = pixel * (size_t)desc->image->channels;
    const float *a = (const float *)desc->image->pixels + at;
    const float *b = (const float *)desc->reference->pixels + at;
    double largest = 0, total = 0;
    for (int c = 0; c < channels; c++) {
        if (!isfinite(a[c]) || !isfinite(b[c]))
            return NAN;
        double d = (double)a[c] - (double)b[c];
        largest = fmax(largest, fabs(d));
        total += d / channels;
    }
    return desc->kind == DIFFERENCE_MAP_ABSOLUTE ? largest : total;
}

static double find_scale(const struct difference_map_desc *desc, size_t count, int channels)
{
    double largest = 0;
    if (desc->scale > 0 || desc->kind == DIFFERENCE_MAP_FLIP)
        return desc->scale > 0 ? desc->scale : 1;
    for (size_t i = 0; i < count; i++)
        largest = fmax(largest, fabs(difference_at(desc, i, channels))); /* fmax skips NAN */
    return largest > 0 ? largest : 1;
}

static bool check_desc(const struct difference_map_desc *desc, struct error *err)
{
    if (desc->scale != 0 && !(desc->scale > 0 && isfinite(desc->scale)))
        return error_set(err, ERROR_INVALID_REQUEST, "a colour scale up to %g", desc->scale);
    if (desc->kind != DIFFERENCE_MAP_FLIP) {
        if (!image_pair_check(desc->image, desc->reference, err))
            return false;
        if (desc->channels < 0 || desc->channels > desc->image->channels)
            return error_set(err, ERROR_INVALID_REQUEST, "%d channels of %d", desc->channels,
                             desc->image->channels);
        return true;
    }
    if (!desc->flip || !desc->flip->pixels || desc->flip->component != IMAGE_F32 ||
        desc->flip->channels != 1)
        return error_set(err, ERROR_INVALID_REQUEST, "there is no map of FLIP to draw");
    return true;
}

bool difference_map_draw(const struct difference_map_desc *desc, struct image *picture,
                         double *scale, struct error *err)
{
    memset(picture, 0, sizeof *picture);
    if (!check_desc(desc, err))
        return false;
    const struct image *shape = desc->kind == DIFFERENCE_MAP_FLIP ? desc->flip : desc->image;
    if (!image_init(picture, shape->width_px, shape->height_px, 3, IMAGE_U8, err))
        return false;
    int channels = desc->channels ? desc->channels : shape->channels;
    size_t count = (size_t)shape->width_px * (size_t)shape->height_px;
    *scale = find_scale(desc, count, channels);
    uint8_t *rgb = picture->pixels;
    for (size_t i = 0; i < count; i++, rgb += 3) {
        double difference = difference_at(desc, i, channels);
        if (isnan(difference))
            memcpy(rgb, not_finite, 3);
        else if (desc->kind == DIFFERENCE_MAP_SIGNED)
            color_at(&diverging, 0.5 + 0.5 * difference / *scale, rgb);
        else
            color_at(&magma, difference / *scale, rgb);
    }
    return true;
}
