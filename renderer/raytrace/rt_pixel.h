/* SPDX-License-Identifier: MIT */
/* Adds up the samples of a pixel: radiance, and share of the background. Thread: any. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_PIXEL_H
#define VITRAIL_RENDERER_RAYTRACE_RT_PIXEL_H

#include "renderer/environment/environment.h"
#include "renderer/view.h"

struct rt_pixel { /* zeroed before the first sample */
    double color[4];
    double behind[3], covered; /* sums of struct tone_map_over's */
};

/* What one ray sees. */
struct rt_seen {
    double radiance[3]; /* of all that is there, and of the background behind it */
    double open[3];     /* the share of it that is nothing at all */
    bool is_bare;       /* nothing is there */
};

/* What a sample ends at where nothing opaque is; alpha 1: something is. environment: may be NULL;
 * direction: of the ray, of any length. */
void rt_pixel_background(const struct view *view, const struct environment_light *environment,
                         const double direction[3], double behind[4]);

/* Ends a sample: its layers have added `layers`, and `through` is how much of `behind` is seen. */
void rt_pixel_end_sample(struct rt_pixel *pixel, const double layers[3], const double through[3],
                         const double behind[4]);

/* The same for one that was followed to its end. */
void rt_pixel_end_seen(struct rt_pixel *pixel, const struct rt_seen *seen);

void rt_pixel_write(const struct rt_pixel *pixel, const struct view *view, int samples,
                    float out[4]);

#endif
