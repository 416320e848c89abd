/* SPDX-License-Identifier: MIT */
/* Deterministic noise and colour arithmetic for drawn textures. Thread: any. */
#ifndef VITRAIL_GLB_DEMO_NOISE_H
#define VITRAIL_GLB_DEMO_NOISE_H

#include <stdint.h>

/* A number in [0,1) that depends on all three. */
double demo_hash(int x, int y, int seed);
/* Smooth value noise in [0,1), one cell per unit; repeats every period cells. */
double demo_noise(double x, double y, int period, int seed);
/* 0 below low, 1 above high, a cubic between. */
double demo_smooth_step(double low, double high, double x);
/* Linear [0,1] to an 8-bit sRGB code (IEC 61966-2-1). */
uint8_t demo_srgb8(double linear);

#endif
