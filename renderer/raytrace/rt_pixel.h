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

static inline bool rt_pixel_are_all(const double values[3], double value)
{
    return values[0] == value && values[1] == value && values[2] == value;
}

/* A transparent layer before those that follow. layers, through: as of rt_pixel_end_sample, from
 * zero and one on. */
static inline void rt_pixel_add_layer(const double radiance[3], double alpha,
                                      const double filter[3], double layers[3], double through[3])
{
    for (int k = 0; k < 3; k++) {
        layers[k] += through[k] * alpha * radiance[k];
        through[k] *= filter[k];
    }
}

/* Ends a sample: its layers have added `layers`, and `through` is how much of `behind` is seen. */
static inline void rt_pixel_end_sample(struct rt_pixel *pixel, const double layers[3],
                                       const double through[3], const double behind[4])
{
    for (int k = 0; k < 3; k++)
        pixel->color[k] += layers[k] + through[k] * behind[k];
    pixel->color[3] += 1 - (1 - behind[3]) * (through[0] + through[1] + through[2]) / 3;
    if (behind[3] == 0 && rt_pixel_are_all(through, 1) && rt_pixel_are_all(layers, 0))
        return;
    for (int k = 0; k < 3; k++)
        pixel->behind[k] += through[k] * (1 - behind[3]);
    pixel->covered += 1;
}

/* The same for one that was followed to its end. */
void rt_pixel_end_seen(struct rt_pixel *pixel, const struct rt_seen *seen);

/* Of a view with a backdrop. */
void rt_pixel_write_over(const struct rt_pixel *pixel, const struct view *view, int samples,
                         float out[4]);

static inline void rt_pixel_write(const struct rt_pixel *pixel, const struct view *view,
                                  int samples, float out[4])
{
    if (view->screen.has_backdrop) {
        const struct rt_pixel copy = *pixel; /* so that the pixel itself may be in registers */
        rt_pixel_write_over(&copy, view, samples, out);
        return;
    }
    for (int k = 0; k < 4; k++)
        out[k] = (float)(pixel->color[k] / samples);
}

#endif
