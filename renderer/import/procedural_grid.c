/* SPDX-License-Identifier: MIT */
/* Noise, and what the shapes make of it. Places are in units of the longest side of the grid, from
 * the middle of its floor on. */
#include "renderer/import/procedural_grid.h"

#include <math.h>
#include <stddef.h>

const char *procedural_shape_name(int shape)
{
    static const char *const names[PROCEDURAL_SHAPES] = {"smoke", "fog", "cloud"};
    return shape >= 0 && shape < PROCEDURAL_SHAPES ? names[shape] : NULL;
}

static double hash(int32_t x, int32_t y, int32_t z, uint32_t seed)
{
    uint32_t h = seed * 0x9e3779b9u ^ (uint32_t)x * 0x85ebca6bu;
    h = (h ^ h >> 15) * 0x2c1b3c6du ^ (uint32_t)y * 0xc2b2ae35u;
    h = (h ^ h >> 12) * 0x297a2d39u ^ (uint32_t)z * 0x27d4eb2fu;
    h = (h ^ h >> 15) * 0x85ebca6bu;
    return (h ^ h >> 13) * 0x1p-32;
}

static double smooth(double t)
{
    return t * t * t * (t * (6 * t - 15) + 10);
}

/* [0, 1], one period per unit. */
static double noise(const double p[3], uint32_t seed)
{
    int32_t cell[3];
    double share[3], sum = 0;
    for (int k = 0; k < 3; k++) {
        double below = floor(p[k]);
        cell[k] = (int32_t)below;
        share[k] = smooth(p[k] - below);
    }
    for (int i = 0; i < 8; i++) {
        double weight = 1;
        for (int k = 0; k < 3; k++)
            weight *= i >> k & 1 ? share[k] : 1 - share[k];
        sum += weight * hash(cell[0] + (i & 1), cell[1] + (i >> 1 & 1), cell[2] + (i >> 2), seed);
    }
    return sum;
}

/* [0, 1]: octaves of twice the frequency and half the strength. */
static double octaves(const struct procedural_grid *grid, const double p[3], double frequency,
                      uint32_t salt)
{
    double sum = 0, all = 0, strength = 1;
    for (int i = 0; i < grid->octaves; i++, frequency *= 2, strength *= 0.5) {
        const double q[3] = {p[0] * frequency, p[1] * frequency, p[2] * frequency};
        sum += strength * noise(q, grid->seed + salt + (uint32_t)i * 101u);
        all += strength;
    }
    return sum / all;
}

static double clamp(double x)
{
    return fmin(fmax(x, 0), 1);
}

/* The column's middle wanders; what is in it is pulled about, which makes it curl. */
static double smoke(const struct procedural_grid *grid, const double p[3], const double half[3])
{
    double height = p[1] / half[1] / 2, width = fmin(half[0], half[2]), pulled[3];
    for (int k = 0; k < 3; k++)
        pulled[k] = p[k] + 0.12 * (octaves(grid, p, 5, 1000u * (uint32_t)(k + 1)) - 0.5) -
                    (k == 1 ? 0.3 : 0);
    double turn = 5 * height + 6.28 * hash(0, 0, 0, grid->seed);
    double sway = 0.25 * width * height;
    double away = hypot(pulled[0] - sway * sin(turn), pulled[2] - sway * cos(1.3 * turn));
    double radius = width * (0.18 + 0.6 * height);
    double body = clamp(1.2 * (1 - away / radius));
    double detail = clamp(3.2 * (octaves(grid, pulled, 9, 0) - 0.36));
    return body * detail * clamp(12 * height) * clamp(2 * (1 - height)) / (0.6 + 1.6 * height);
}

static double fog(const struct procedural_grid *grid, const double p[3], const double half[3])
{
    const double flat[3] = {p[0], 0.35 * p[1], p[2]};
    double height = p[1] / half[1] / 2;
    double top = 0.25 + 0.6 * octaves(grid, flat, 4, 0);
    return clamp(3 * (1 - height / top)) * (0.45 + 0.55 * octaves(grid, p, 8, 77)) *
           clamp(8 * (1 - height));
}

static double cloud(const struct procedural_grid *grid, const double p[3], const double half[3])
{
    double height = p[1] / half[1] / 2, around = 0;
    const double off[3] = {p[0] / half[0], (height - 0.35) / 0.6, p[2] / half[2]};
    for (int k = 0; k < 3; k++)
        around += off[k] * off[k];
    double heap = 1 - sqrt(around) + 1.5 * (octaves(grid, p, 5, 0) - 0.55);
    return clamp(5 * heap) * clamp(12 * (height - 0.12)) * clamp(10 * (1 - sqrt(around)) + 1);
}

void procedural_grid_fill(const struct procedural_grid *grid, const uint32_t size[3], float *values)
{
    static double (*const shapes[PROCEDURAL_SHAPES])(const struct procedural_grid *, const double *,
                                                     const double *) = {smoke, fog, cloud};
    double longest = fmax(size[0], fmax(size[1], size[2]));
    const double half[3] = {0.5 * size[0] / longest, 0.5 * size[1] / longest,
                            0.5 * size[2] / longest};
    for (uint32_t z = 0; z < size[2]; z++)
        for (uint32_t y = 0; y < size[1]; y++)
            for (uint32_t x = 0; x < size[0]; x++) {
                const double p[3] = {(x + 0.5) / longest - half[0], (y + 0.5) / longest,
                                     (z + 0.5) / longest - half[2]};
                *values++ = (float)clamp(shapes[grid->shape](grid, p, half));
            }
}
