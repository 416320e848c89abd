/* SPDX-License-Identifier: MIT */
/* Images of radiance: header, pixels, checks, and averages over boxes. */
#include "renderer/environment/environment_import.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/environment/environment.h"
#include "renderer/image/image.h"
#include "renderer/image/image_header.h"

static const double pi = 3.14159265358979323846;

/* The readers of images speak of scenes. */
static bool pass_on(const struct error *problem, struct error *err)
{
    enum error_code code =
        problem->code == ERROR_INVALID_SCENE ? ERROR_INVALID_ENVIRONMENT : problem->code;
    return error_set(err, code, "%s", problem->message);
}

static bool check_header(const void *bytes, size_t size_bytes, struct error *err)
{
    struct image_header header;
    struct error problem = {0};
    if (!image_header_read(&header, bytes, size_bytes, &problem))
        return pass_on(&problem, err);
    if (header.kind != IMAGE_KIND_HDR && header.kind != IMAGE_KIND_EXR)
        return error_set(err, ERROR_INVALID_ENVIRONMENT,
                         "an environment map is Radiance HDR or OpenEXR, this file is neither");
    if (header.width_px > ENVIRONMENT_WIDTH_MAX || header.height_px > ENVIRONMENT_HEIGHT_MAX)
        return error_set(err, ERROR_TOO_LARGE, "the map has %u x %u texels, the limit is %d x %d",
                         header.width_px, header.height_px, ENVIRONMENT_WIDTH_MAX,
                         ENVIRONMENT_HEIGHT_MAX);
    return header.width_px >= 2 || error_set(err, ERROR_INVALID_ENVIRONMENT,
                                             "the map has one column, at least 2 are "
                                             "needed");
}

static int find_channel(const struct image *image, const char *name)
{
    for (int i = 0; i < image->channels; i++)
        if (strcmp(image->channel_names[i], name) == 0)
            return i;
    return -1;
}

/* R, G and B, or Y three times. */
static bool choose_channels(const struct image *image, int channels[3], struct error *err)
{
    static const char *const names[3] = {"R", "G", "B"};
    for (int i = 0; i < 3; i++)
        channels[i] = find_channel(image, names[i]);
    if (channels[0] < 0 && channels[1] < 0 && channels[2] < 0)
        channels[0] = channels[1] = channels[2] = find_channel(image, "Y");
    return (image->component == IMAGE_F32 && channels[0] >= 0 && channels[1] >= 0 &&
            channels[2] >= 0) ||
           error_set(err, ERROR_UNSUPPORTED,
                     "the map needs the channels R, G and B, or Y, in floating point; its first of "
                     "%d is '%.31s'",
                     image->channels, image->channel_names[0]);
}

static float *texel_of(const struct image *image, int x, int y)
{
    size_t index = (size_t)y * (size_t)image->width_px + (size_t)x;
    return (float *)image->pixels + index * (size_t)image->channels;
}

/* Checks a texel; what is below 0 becomes 0. */
static bool check_texel(const struct image *image, const int channels[3], int x, int y,
                        struct environment_import *import, struct error *err)
{
    float *texel = texel_of(image, x, y);
    bool is_negative = false;
    for (int i = 0; i < 3; i++) {
        float *value = &texel[channels[i]];
        if (!(*value <= ENVIRONMENT_RADIANCE_MAX) || isinf(*value))
            return error_set(err, ERROR_INVALID_ENVIRONMENT,
                             "channel %.31s of the texel in column %d of row %d is %g; a radiance "
                             "is a number of at most %g nt",
                             image->channel_names[channels[i]], x, y, (double)*value,
                             (double)ENVIRONMENT_RADIANCE_MAX);
        is_negative |= *value < 0;
        *value = fmaxf(*value, 0);
        import->peak = fmax(import->peak, (double)*value);
    }
    import->negative_texels += is_negative;
    return true;
}

/* How much of all directions lies between two rows' bounds, given from the top. */
static double band(double top, double bottom, int rows)
{
    return 0.5 * (cos(pi * top / rows) - cos(pi * bottom / rows));
}

/* Adds the averages of a row's columns: each output has as many of them, whole ones or parts. */
static void add_row(const struct image *image, const int channels[3], int y, double weight,
                    double *out, int out_width)
{
    int in_width = image->width_px;
    double step = (double)in_width / out_width;
    for (int x = 0; x < out_width; x++) {
        double begin = x * step, end = x + 1 == out_width ? in_width : (x + 1) * step;
        for (int at = (int)begin; at < in_width && at < end; at++) {
            double part = weight * (fmin(end, at + 1.0) - fmax(begin, at)) / step;
            const float *texel = texel_of(image, at, y);
            for (int i = 0; i < 3; i++)
                out[3 * x + i] += part * (double)texel[channels[i]];
        }
    }
}

/* One row of the result from the rows of the image that it covers. */
static void make_row(const struct image *image, const int channels[3], int y, double *sums,
                     struct environment_import *import)
{
    int rows = image->height_px, width = import->width;
    double begin = (double)y * rows / import->height, end = (double)(y + 1) * rows / import->height;
    double whole = band(begin, end, rows);
    memset(sums, 0, 3 * sizeof *sums * (size_t)width);
    for (int at = (int)begin; at < rows && at < end; at++)
        add_row(image, channels, at, band(fmax(begin, at), fmin(end, at + 1.0), rows) / whole, sums,
                width);
    float *out = import->pixels + 3 * (size_t)y * (size_t)width;
    for (int x = 0; x < 3 * width; x++) {
        out[x] = (float)sums[x];
        import->mean[x % 3] += whole * sums[x] / width;
    }
}

static bool make_pixels(const struct image *image, struct environment_import *import,
                        struct error *err)
{
    int channels[3], width = image->width_px, height = image->height_px;
    if (!choose_channels(image, channels, err))
        return false;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
            if (!check_texel(image, channels, x, y, import, err))
                return false;
    import->source_width = width;
    import->source_height = height;
    import->width = width < ENVIRONMENT_KEPT_WIDTH ? width     : ENVIRONMENT_KEPT_WIDTH;
    import->height = height < ENVIRONMENT_KEPT_HEIGHT ? height : ENVIRONMENT_KEPT_HEIGHT;
    import->pixels =
        calloc(3 * (size_t)import->width * (size_t)import->height, sizeof *import->pixels);
    double *sums = calloc(3 * (size_t)import->width, sizeof *sums);
    bool has_room = import->pixels && sums;
    for (int y = 0; has_room && y < import->height; y++)
        make_row(image, channels, y, sums, import);
    free(sums);
    return has_room || error_set(err, ERROR_NO_MEMORY, "map of %d x %d texels", width, height);
}

bool environment_import(const void *bytes, size_t size_bytes, struct environment_import *import,
                        struct error *err)
{
    struct image image = {0};
    struct error problem = {0};
    *import = (struct environment_import){0};
    if (!check_header(bytes, size_bytes, err))
        return false;
    if (!image_decode(bytes, size_bytes, &(struct image_decode_desc){.keep_float = true}, &image,
                      &problem))
        return pass_on(&problem, err);
    bool is_good = make_pixels(&image, import, err);
    image_finish(&image);
    if (!is_good)
        environment_import_finish(import);
    return is_good;
}

void environment_import_finish(struct environment_import *import)
{
    free(import->pixels);
    *import = (struct environment_import){0};
}
