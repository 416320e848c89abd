/* SPDX-License-Identifier: MIT */
/* When the samples of a pixel are shaded apart: where the light of a surface differs from that of
 * the same surface in a neighbouring pixel by more than a contrast, for rays and for the rasteriser
 * (Whitted 1980, "An Improved Illumination Model for Shaded Display"; contrast after Mitchell 1987,
 * "Generating Antialiased Images at Low Sampling Densities", section 3). One text for C and GLSL.
 */
#ifndef VITRAIL_SHADERS_SHARED_CONTRAST_H
#define VITRAIL_SHADERS_SHARED_CONTRAST_H

/* Of light, |a - b| / (a + b). Measured with rays on an engine, fins with shadows and the demo at 4
 * samples: 0.05 takes 10 to 20 % more rays than 0.2 for 1 to 4 % less error, 0.35 up to a quarter
 * fewer for 1 to 10 % more. */
#define CONTRAST_LEAST 0.2
/* Radiance over base colour is light; a black texture has none to tell. */
#define CONTRAST_BASE_LEAST 1e-3
/* Light of the rasteriser is a word of logarithms, ten bits a channel
 * (shaders/window/light_word.glsl): so many steps are the ratio (1 + CONTRAST_LEAST) / (1 -
 * CONTRAST_LEAST), 40 octaves in all. */
#define CONTRAST_STEPS 15
#define CONTRAST_DARKEST 1e-6           /* light; below, all is one darkness */
#define CONTRAST_CHANNEL_LEAST 0.015625 /* of the brightest channel; below, colours are not */

/* An entry of the list of pixels to be shaded so: x, y, the samples, and whether a neighbour is in
 * another window, so that the samples themselves have to tell. */
#define APART_SIDE_BITS 12
#define APART_UNKNOWN 16u
/* Words before the pixels of a list: groups of its reader's dispatch in three, the number of
 * pixels, and room up to where a binding may begin. */
#define APART_HEAD_WORDS 64

#endif
