/* SPDX-License-Identifier: MIT */
/* Andersson 2020: contrast sensitivity as Gaussians (section 4.1.1, table 1, after Johnson and
 * Fairchild 2003), features as derivatives of a Gaussian (section 4.2). */
#include "renderer/accuracy/flip_kernels.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* g(x) = a sqrt(pi / b) exp(-pi^2 x^2 / b), x in degrees. */
struct sensitivity {
    double a, b;
};

static const struct sensitivity sensitivities[] = {
    [FLIP_ACHROMATIC] = {1, 0.0047},
    [FLIP_RED_GREEN] = {1, 0.0053},
    [FLIP_BLUE_YELLOW_1] = {34.1, 0.04},
    [FLIP_BLUE_YELLOW_2] = {13.5, 0.025},
};

#define WIDEST_B 0.04       /* of the table: all of these filters have its radius */
#define FEATURE_WIDTH 0.082 /* degrees: two standard deviations of the feature filters */

static bool allocate(struct flip_kernels *kernels, enum flip_kernel first, enum flip_kernel last,
                     double sigma_px, struct error *err)
{
    int radius = (int)ceil(3 * sigma_px);
    for (int i = (int)first; i <= (int)last; i++) {
        kernels->radius[i] = radius;
        kernels->weights[i] = calloc(2 * (size_t)radius + 1, sizeof(float));
        if (!kernels->weights[i])
            return error_set(err, ERROR_NO_MEMORY, "filters of FLIP");
    }
    if (radius > kernels->largest_radius)
        kernels->largest_radius = radius;
    return true;
}

static double gaussian_of(const struct sensitivity *s, double degrees)
{
    return sqrt(M_PI / s->b) * exp(-M_PI * M_PI * degrees * degrees / s->b);
}

/* Fills one kernel so that its weights add up to `sum`. */
static void fill_sensitivity(struct flip_kernels *kernels, enum flip_kernel kernel, double ppd,
                             double sum)
{
    int radius = kernels->radius[kernel];
    double total = 0;
    for (int i = -radius; i <= radius; i++)
        total += gaussian_of(&sensitivities[kernel], i / ppd);
    for (int i = -radius; i <= radius; i++)
        kernels->weights[kernel][i + radius] =
            (float)(sum * gaussian_of(&sensitivities[kernel], i / ppd) / total);
}

/* a g(x, y) of both terms, normalised together: each term's square root goes to its two passes. */
static void fill_blue_yellow(struct flip_kernels *kernels, double ppd)
{
    double volume[2];
    for (int k = 0; k < 2; k++) {
        const struct sensitivity *s = &sensitivities[FLIP_BLUE_YELLOW_1 + k];
        int radius = kernels->radius[FLIP_BLUE_YELLOW_1 + k];
        double line = 0; /* of exp alone, once for each of the two directions */
        for (int i = -radius; i <= radius; i++)
            line += gaussian_of(s, i / ppd) / sqrt(M_PI / s->b);
        volume[k] = s->a * sqrt(M_PI / s->b) * line * line;
    }
    for (int k = 0; k < 2; k++)
        fill_sensitivity(kernels, (enum flip_kernel)(FLIP_BLUE_YELLOW_1 + k), ppd,
                         sqrt(volume[k] / (volume[0] + volume[1])));
}

static void normalise_signed(float *weights, int count)
{
    double positive = 0, negative = 0;
    for (int i = 0; i < count; i++) {
        if (weights[i] > 0)
            positive += (double)weights[i];
        else
            negative -= (double)weights[i];
    }
    for (int i = 0; i < count; i++) {
        double sum = weights[i] > 0 ? positive : negative;
        weights[i] = sum > 0 ? (float)((double)weights[i] / sum) : 0;
    }
}

static void fill_features(struct flip_kernels *kernels, double sigma)
{
    int radius = kernels->radius[FLIP_SMOOTH], count = 2 * radius + 1;
    float *smooth = kernels->weights[FLIP_SMOOTH];
    for (int i = 0; i < count; i++) {
        double x = i - radius, g = exp(-x * x / (2 * sigma * sigma));
        smooth[i] = (float)g;
        kernels->weights[FLIP_EDGE][i] = (float)(-x * g);
        kernels->weights[FLIP_POINT][i] = (float)((x * x / (sigma * sigma) - 1) * g);
    }
    normalise_signed(smooth, count);
    normalise_signed(kernels->weights[FLIP_EDGE], count);
    normalise_signed(kernels->weights[FLIP_POINT], count);
}

bool flip_kernels_init(struct flip_kernels *kernels, double pixels_per_degree, struct error *err)
{
    double sigma_sensitivity = sqrt(WIDEST_B / (2 * M_PI * M_PI)) * pixels_per_degree;
    double sigma_feature = 0.5 * FEATURE_WIDTH * pixels_per_degree;
    memset(kernels, 0, sizeof *kernels);
    if (!allocate(kernels, FLIP_ACHROMATIC, FLIP_BLUE_YELLOW_2, sigma_sensitivity, err) ||
        !allocate(kernels, FLIP_SMOOTH, FLIP_POINT, sigma_feature, err)) {
        flip_kernels_finish(kernels);
        return false;
    }
    fill_sensitivity(kernels, FLIP_ACHROMATIC, pixels_per_degree, 1);
    fill_sensitivity(kernels, FLIP_RED_GREEN, pixels_per_degree, 1);
    fill_blue_yellow(kernels, pixels_per_degree);
    fill_features(kernels, sigma_feature);
    return true;
}

void flip_kernels_finish(struct flip_kernels *kernels)
{
    for (int i = 0; i < FLIP_KERNEL_COUNT; i++)
        free(kernels->weights[i]);
    memset(kernels, 0, sizeof *kernels);
}
