/* SPDX-License-Identifier: MIT */
/* Sums of samples, in front of a background of either kind. */
#include "renderer/raytrace/rt_pixel.h"

#include <string.h>

#include "renderer/base/matrix.h"

void rt_pixel_background(const struct view *view, const struct environment_light *environment,
                         const double direction[3], double behind[4])
{
    const float *b = view->background;
    memset(behind, 0, 4 * sizeof *behind);
    if (environment && environment->is_background) {
        double unit[3] = {direction[0], direction[1], direction[2]};
        vec3_normalize(unit);
        environment_light_radiance(environment, unit, behind);
        behind[3] = 1;
        return;
    }
    if (view->screen.has_backdrop)
        return;
    for (int k = 0; k < 3; k++)
        behind[k] = (double)b[k] * (double)b[3];
    behind[3] = (double)b[3];
}

void rt_pixel_end_seen(struct rt_pixel *pixel, const struct rt_seen *seen)
{
    for (int k = 0; k < 3; k++) {
        pixel->color[k] += seen->radiance[k];
        pixel->behind[k] += seen->is_bare ? 0 : seen->open[k];
    }
    pixel->color[3] += 1 - (seen->open[0] + seen->open[1] + seen->open[2]) / 3;
    pixel->covered += !seen->is_bare;
}

void rt_pixel_write_over(const struct rt_pixel *pixel, const struct view *view, int samples,
                         float out[4])
{
    float backdrop[4];
    struct tone_map_over over = {.covered = (float)(pixel->covered / samples)};
    view_backdrop(view, backdrop);
    for (int k = 0; k < 3; k++) {
        over.radiance[k] = (float)(pixel->color[k] / samples);
        over.behind[k] = (float)(pixel->behind[k] / samples);
    }
    tone_map_over(&view->screen.mapping, backdrop, &over, out);
}
