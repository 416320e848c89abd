/* SPDX-License-Identifier: MIT */
/* The quality of a picture whose request says nothing of it. The parser, the renderer, the sweep
 * of trade-offs, estimates and help texts read these. */
#ifndef VITRAIL_PROTOCOL_QUALITY_DEFAULTS_H
#define VITRAIL_PROTOCOL_QUALITY_DEFAULTS_H

/* Macros, so that QUALITY_DEFAULT_TEXT can put the number into a help text. */
#define SHADOW_RESOLUTION_DEFAULT 1024 /* texels per side of a map or of a face */
#define SHADOW_TAPS_DEFAULT 4
#define SAMPLES_DEFAULT 4                  /* per pixel */
#define AREA_SAMPLES_DEFAULT 16            /* per area light and point */
#define AREA_SAMPLES_DEFAULT_REFERENCE 256 /* likewise, with `reference` */
#define ENVIRONMENT_SAMPLES_DEFAULT 16     /* towards an environment map, per ray traced point */
#define ENVIRONMENT_SAMPLES_DEFAULT_REFERENCE 256 /* likewise, with `reference` */
#define ATMOSPHERE_SLICES_DEFAULT 64              /* of haze, on the way of a rasterised pixel */
#define SAMPLES_RASTER_MAX 16                     /* per pixel, of the rasteriser */
#define REFRACTION_SAMPLES_DEFAULT 16 /* behind a rough surface, of all samples of a pixel */
#define REFRACTION_SAMPLES_DEFAULT_REFERENCE 64 /* of each sample, with `reference` */

#define QUALITY_DEFAULT_QUOTED(number) #number
#define QUALITY_DEFAULT_TEXT(number) QUALITY_DEFAULT_QUOTED(number)

/* What was said, or the default where nothing was: 0. */
static inline int quality_or(int said, int otherwise)
{
    return said > 0 ? said : otherwise;
}

#endif
