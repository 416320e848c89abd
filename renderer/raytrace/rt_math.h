/* SPDX-License-Identifier: MIT */
/* The larger and the smaller of two numbers, as one instruction. fmax and fmin of C are function
 * calls, because the processor's instructions treat NaN differently. Here the result is the second
 * number if the first one is NaN, and NaN if the second one is. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_MATH_H
#define VITRAIL_RENDERER_RAYTRACE_RT_MATH_H

static inline double rt_max(double a, double b)
{
    return a > b ? a : b;
}

static inline double rt_min(double a, double b)
{
    return a < b ? a : b;
}

static inline float rt_max_f32(float a, float b)
{
    return a > b ? a : b;
}

static inline float rt_min_f32(float a, float b)
{
    return a < b ? a : b;
}

#endif
