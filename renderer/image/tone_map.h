/* SPDX-License-Identifier: MIT */
/* From linear HDR radiance to display-referred 8-bit sRGB. Thread: any. */
#ifndef VITRAIL_RENDERER_IMAGE_TONE_MAP_H
#define VITRAIL_RENDERER_IMAGE_TONE_MAP_H

#include "renderer/image/image.h"

enum tone_mapping {
    /* Khronos PBR Neutral (2024): keeps hue and saturation below 0.8, compresses above. */
    TONE_MAPPING_NEUTRAL,
    TONE_MAPPING_NONE, /* clamp to [0,1] */
    TONE_MAPPING_AGX,  /* Sobotka's AgX (2022), in Wrensch's form (2023): compresses 16.5 stops,
                          bright colours turn white slowly */
    TONE_MAPPING_ACES, /* Hill's fit (2016) of the ACES transforms: filmic contrast, a toe */
};

struct tone_map_desc {
    enum tone_mapping operator_;
    float exposure_ev; /* stops; radiance is multiplied by 2^exposure_ev first */
};

/* hdr: F32 RGBA, linear Rec.709, associated alpha. ldr: becomes U8 RGBA, sRGB, unassociated alpha.
 * Non-finite input becomes 0; nothing outside [0,255] is written. */
MUST_CHECK bool tone_map(const struct image *hdr, const struct tone_map_desc *desc,
                         struct image *ldr, struct error *err);

/* A pixel in front of a colour of the screen (docs/explanation/shading.md, section 6). */
struct tone_map_over {
    float radiance[3]; /* mean over the pixel, without the background */
    float behind[3];   /* share of the background that is seen through something, per channel */
    float covered;     /* share of the pixel that something is before */
};
/* backdrop: linear, associated alpha. out: likewise, to be encoded as TONE_MAPPING_NONE. */
void tone_map_over(const struct tone_map_desc *desc, const float backdrop[4],
                   const struct tone_map_over *pixel, float out[4]);
/* A radiance as a screen shows it, linear, at most 1. */
void tone_map_color(const struct tone_map_desc *desc, float color[3]);

/* For the same on the device (shaders/image/tone_map.comp.glsl): the factor of radiance, and the
 * codes of sRGB, TONE_BUCKETS of shaders/shared/tone_curve.h. */
float tone_map_gain(const struct tone_map_desc *desc);
struct tone_bucket;
void tone_map_fill_buckets(struct tone_bucket *buckets);

#endif
