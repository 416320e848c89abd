/* SPDX-License-Identifier: MIT */
/* Maps of radiance: their making, and looking into them. */
#include "renderer/environment/environment_internal.h"

#include <math.h>
#include <stdlib.h>

static const double pi = 3.14159265358979323846;

bool environment_texels_init(struct environment_texels *texels, int width, int height,
                             struct error *err)
{
    size_t count = (size_t)width * (size_t)height;
    *texels = (struct environment_texels){
        .pixels = calloc(3 * count, sizeof *texels->pixels), .width = width, .height = height};
    return texels->pixels ||
           error_set(err, ERROR_NO_MEMORY, "environment of %d x %d texels", width, height);
}

static bool check_desc(const struct environment_desc *desc, struct error *err)
{
    if (desc->width < 2 || desc->width > ENVIRONMENT_WIDTH_MAX || desc->height < 1 ||
        desc->height > ENVIRONMENT_HEIGHT_MAX)
        return error_set(err, ERROR_INVALID_REQUEST,
                         "an environment has 2 to %d columns and 1 to %d rows, this one %d x %d",
                         ENVIRONMENT_WIDTH_MAX, ENVIRONMENT_HEIGHT_MAX, desc->width, desc->height);
    size_t count = 3 * (size_t)desc->width * (size_t)desc->height;
    for (size_t i = 0; i < count; i++)
        if (!(desc->pixels[i] <= ENVIRONMENT_RADIANCE_MAX) || isinf(desc->pixels[i])) {
            size_t texel = i / 3, width = (size_t)desc->width;
            return error_set(err, ERROR_INVALID_REQUEST,
                             "environment: channel %zu of the texel in column %zu of row %zu is "
                             "%g; a radiance is a number of at most %g nt",
                             i % 3, texel % width, texel / width, (double)desc->pixels[i],
                             (double)ENVIRONMENT_RADIANCE_MAX);
        }
    return true;
}

/* A convolution with Lambert's lobe keeps it, so that the small map has it. */
void environment_find_mean(struct environment *environment)
{
    const struct environment_texels *map = &environment->diffuse;
    double *mean = environment->mean, weights = 0;
    mean[0] = mean[1] = mean[2] = 0;
    for (int y = 0; y < map->height; y++) {
        const double weight = sin(pi * (y + 0.5) / map->height);
        weights += weight * map->width;
        for (int i = 0; i < 3 * map->width; i++)
            mean[i % 3] += weight * (double)map->pixels[(size_t)y * 3 * (size_t)map->width + i];
    }
    for (int k = 0; k < 3; k++)
        mean[k] /= weights;
}

struct environment *environment_create(const struct environment_desc *desc, struct error *err)
{
    if (!check_desc(desc, err))
        return NULL;
    struct environment *environment = calloc(1, sizeof *environment);
    if (!environment) {
        error_set(err, ERROR_NO_MEMORY, "environment");
        return NULL;
    }
    if (!environment_texels_init(&environment->radiance, desc->width, desc->height, err))
        goto fail;
    for (size_t i = 0; i < 3 * (size_t)desc->width * (size_t)desc->height; i++)
        environment->radiance.pixels[i] = desc->pixels[i] > 0 ? desc->pixels[i] : 0;
    if (!environment_make_tables(environment, err) || !environment_prefilter(environment, err))
        goto fail;
    environment_find_mean(environment);
    return environment;

fail:
    environment_destroy(environment);
    return NULL;
}

void environment_destroy(struct environment *environment)
{
    if (!environment)
        return;
    if (!environment->is_borrowed) {
        free(environment->radiance.pixels);
        free(environment->diffuse.pixels);
        for (int i = 0; i < ENVIRONMENT_LEVELS; i++)
            free(environment->specular[i].pixels);
        free(environment->rows);
        free(environment->columns);
    }
    free(environment->guides);
    free(environment);
}

void environment_coordinates(const double direction[3], double *u, double *v)
{
    double y = fmin(fmax(direction[1], -1), 1);
    *u = 0.5 + atan2(direction[0], -direction[2]) / (2 * pi);
    *v = acos(y) / pi;
}

void environment_direction(double u, double v, double direction[3])
{
    double phi = (u - 0.5) * 2 * pi, theta = v * pi;
    direction[0] = sin(theta) * sin(phi);
    direction[1] = cos(theta);
    direction[2] = -sin(theta) * cos(phi);
}

void environment_texels_look(const struct environment_texels *texels, double u, double v,
                             double out[3])
{
    double x = u * texels->width - 0.5, y = v * texels->height - 0.5;
    double x0 = floor(x), y0 = floor(y), fx = x - x0, fy = y - y0;
    int columns[2], rows[2];
    for (int i = 0; i < 2; i++) {
        int column = ((int)x0 + i) % texels->width, row = (int)y0 + i;
        columns[i] = column < 0 ? column + texels->width : column;
        rows[i] = row < 0 ? 0 : row >= texels->height ? texels->height - 1 : row;
    }
    out[0] = out[1] = out[2] = 0;
    for (int i = 0; i < 4; i++) {
        const float *texel = texels->pixels + 3 * ((size_t)rows[i / 2] * (size_t)texels->width +
                                                   (size_t)columns[i % 2]);
        double weight = (i % 2 ? fx : 1 - fx) * (i / 2 ? fy : 1 - fy);
        for (int k = 0; k < 3; k++)
            out[k] += weight * (double)texel[k];
    }
}

static struct environment_map map_of(const struct environment_texels *texels)
{
    return (struct environment_map){texels->pixels, texels->width, texels->height};
}

struct environment_map environment_radiance_map(const struct environment *environment)
{
    return map_of(&environment->radiance);
}

struct environment_map environment_diffuse_map(const struct environment *environment)
{
    return map_of(&environment->diffuse);
}

struct environment_map environment_specular_map(const struct environment *environment, int level)
{
    return map_of(&environment->specular[level]);
}
