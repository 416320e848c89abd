/* SPDX-License-Identifier: MIT */
/* Where the samples of a pixel are. Up to 4 are the device's: the pixel's centre, or the standard
 * pattern of GL and Vulkan. More come in rounds of these: the window is drawn several times, each
 * time shifted by a part of a pixel, and the picture is the mean (Haeberli and Akeley 1990, "The
 * Accumulation Buffer: Hardware Support for High-Quality Rendering", section 3). Pure. Thread: any.
 *
 * The four shifts are the corners of a square, turned as the standard pattern is. They and the two
 * were found by search: of those that leave every sample within its pixel (2/256 from its border,
 * as a device snaps vertices to 1/256), they err least where half planes in all directions and in
 * directions near the axes cover pixels. 4, 8 and 16 samples are then off by 0.091, 0.067 and 0.049
 * of a pixel (RMS), Direct3D's standard 16 by 0.044 (tests/unit/test_sample_pattern.c).
 */
#ifndef VITRAIL_RENDERER_BASE_SAMPLE_PATTERN_H
#define VITRAIL_RENDERER_BASE_SAMPLE_PATTERN_H

#include <stdbool.h>

enum { SAMPLES_PER_ROUND = 4 }; /* of a device that has as many for each pixel */

/* Whether there is a pattern: of 1, 4, 8 and 16 (SAMPLES_RASTER_MAX). */
bool sample_pattern_has(int samples);

/* The place of a sample in the pixel, [0, 1], y up. index: below `samples`; those of a round are
 * neighbours. */
void sample_pattern_place(int samples, int index, double place[2]);

/* By how many pixels the picture is shifted, right and up, in a round of so many rounds. Of the
 * device's samples per pixel, which are 1 or SAMPLES_PER_ROUND, each then shows what is at its
 * place less the shift. */
void sample_pattern_shift(int device_samples, int rounds, int round, double shift_px[2]);

/* The most that a picture is shifted by along an axis [px]. */
double sample_pattern_reach(int device_samples, int rounds);

#endif
