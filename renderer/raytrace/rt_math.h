/* SPDX-License-Identifier: MIT */
/* Largest and smallest of two numbers without a call: those of C are functions where the
 * processor's own instructions treat NaN otherwise. Here a NaN gives way only as the first one. */
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
