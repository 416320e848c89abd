/* SPDX-License-Identifier: MIT */
/* Colours of FLIP: from linear Rec.709 to the opponent space that eyes filter in, how far two
 * filtered colours are apart, and the tone curve of HDR-FLIP. Thread: any. */
#ifndef VITRAIL_RENDERER_ACCURACY_FLIP_COLOR_H
#define VITRAIL_RENDERER_ACCURACY_FLIP_COLOR_H

/* Constants, computed once per measurement. */
struct flip_color {
    float rgb_from_xyz[9]; /* row by row; xyz relative to white */
    float largest;         /* HyAB distance of pure green and pure blue, to the power q_c */
};

void flip_color_init(struct flip_color *color);

/* Linear Rec.709 to Y C_x C_z, Andersson 2020, equation 2 (CIELab without its cube root). */
void flip_opponent_from_linear(const float rgb[3], float opponent[3]);

/* Perceived distance of two filtered opponent colours in [0, 1], Andersson 2020, section 4.1. */
float flip_color_distance(const struct flip_color *color, const float a[3], const float b[3]);

/* Rec.709 luminance. */
float flip_luminance(const float rgb[3]);

/* Narkowicz 2016, "ACES Filmic Tone Mapping Curve", without its pre-exposure of 0.6, as HDR-FLIP
 * uses it; result in [0, 1]. x: any double >= 0 below 1e150. */
double flip_tone_curve(double x);
/* Radiance that the curve maps to 0.85: HDR-FLIP, section 3.1, bounds its exposures by it. */
double flip_tone_curve_knee(void);

#endif
