/* SPDX-License-Identifier: MIT */
/* The quality of a picture whose request says nothing of it. The parser, the renderer, the sweep
 * of trade-offs, estimates and help texts read these. */
#ifndef VITRAIL_PROTOCOL_QUALITY_DEFAULTS_H
#define VITRAIL_PROTOCOL_QUALITY_DEFAULTS_H

#include <stdbool.h>

/* Macros, so that QUALITY_DEFAULT_TEXT can put the number into a help text. */
#define SHADOW_RESOLUTION_DEFAULT 1024 /* texels per side of a map or of a face */
#define SHADOW_TAPS_DEFAULT 4
#define SHADOW_TAPS_DEFAULT_NOISY 64       /* of techniques that leave light to chance */
#define SAMPLES_DEFAULT 4                  /* per pixel */
#define AREA_SAMPLES_DEFAULT 16            /* per area light and point */
#define AREA_SAMPLES_DEFAULT_REFERENCE 256 /* likewise, with `reference` */
#define ENVIRONMENT_SAMPLES_DEFAULT 16     /* towards an environment map, per ray traced point */
#define ENVIRONMENT_SAMPLES_DEFAULT_REFERENCE 256 /* likewise, with `reference` */
#define ATMOSPHERE_SLICES_DEFAULT 64              /* of haze, on the way of a rasterised pixel; */
#define ATMOSPHERE_SLICES_FEWER 16                /* trade-offs and models have these beside it */
#define ATMOSPHERE_SLICES_MORE 256
#define GRID_POINTS_DEFAULT 16 /* in a density grid, per light and sample, without `reference`, */
#define GRID_POINTS_MANY 8     /* where a pixel has 4 samples or more */
#define SAMPLES_RASTER_MAX 16  /* per pixel, of the rasteriser */
#define REFRACTION_SAMPLES_DEFAULT 16 /* behind a rough surface, of all samples of a pixel */
#define REFRACTION_SAMPLES_DEFAULT_REFERENCE 64 /* of each sample, with `reference` */

#define QUALITY_DEFAULT_QUOTED(number) #number
#define QUALITY_DEFAULT_TEXT(number) QUALITY_DEFAULT_QUOTED(number)

/* What was said, or the default where nothing was: 0. */
static inline int quality_or(int said, int otherwise)
{
    return said > 0 ? said : otherwise;
}

/* Points on a ray in a density grid for each light; both as requested, 0: nothing was said. */
static inline int quality_grid_points(int atmosphere_samples, int samples)
{
    bool has_many = quality_or(samples, SAMPLES_DEFAULT) >= 4;
    return quality_or(atmosphere_samples, has_many ? GRID_POINTS_MANY : GRID_POINTS_DEFAULT);
}

#endif
