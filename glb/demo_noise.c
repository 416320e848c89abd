/* SPDX-License-Identifier: MIT */
/* Deterministic noise and colour arithmetic for drawn textures. */
#include "glb/demo_noise.h"

#include <math.h>

/* Integer hash "lowbias32" by C. Wellons, 2018: every output bit depends on every input bit. */
static uint32_t scramble(uint32_t x)
{
    x ^= x >> 16;
    x *= 0x7feb352dU;
    x ^= x >> 15;
    x *= 0x846ca68bU;
    x ^= x >> 16;
    return x;
}

double demo_hash(int x, int y, int seed)
{
    uint32_t h = scramble((uint32_t)x + scramble((uint32_t)y + scramble((uint32_t)seed)));
    return h / 4294967296.0;
}

double demo_smooth_step(double low, double high, double x)
{
    double t = fmin(1, fmax(0, (x - low) / (high - low)));
    return t * t * (3 - 2 * t);
}

double demo_noise(double x, double y, int period, int seed)
{
    int i = (int)floor(x), j = (int)floor(y);
    double s = demo_smooth_step(0, 1, x - i), t = demo_smooth_step(0, 1, y - j);
    int i0 = i % period, i1 = (i + 1) % period, j0 = j % period, j1 = (j + 1) % period;
    double low = demo_hash(i0, j0, seed) * (1 - s) + demo_hash(i1, j0, seed) * s;
    double high = demo_hash(i0, j1, seed) * (1 - s) + demo_hash(i1, j1, seed) * s;
    return low * (1 - t) + high * t;
}

uint8_t demo_srgb8(double linear)
{
    double x = fmin(1, fmax(0, linear));
    double code = x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - 0.055;
    return (uint8_t)lround(255 * code);
}
