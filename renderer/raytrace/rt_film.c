/* SPDX-License-Identifier: MIT */
/* Thin films: the twin of shaders/material/film.glsl. */
#include "renderer/raytrace/rt_film.h"

#include <math.h>
#include <stdbool.h>

#include "renderer/raytrace/rt_math.h"
#include "shaders/shared/thin_film.h"

static const double pi = 3.14159265358979323846;

static double schlick_weight(double cosine)
{
    double c = rt_min(rt_max(1 - cosine, 0), 1), c2 = c * c;
    return c2 * c2 * c;
}

static double schlick(double f0, double cosine)
{
    return f0 + (1 - f0) * schlick_weight(cosine);
}

static double peak(double height, double middle, double variance, double p, double shift)
{
    return height * sqrt(2 * pi * variance) * cos(middle * p + shift) * exp(-variance * p * p) /
           FILM_WHITE;
}

/* What the eye sees of a cosine whose argument grows with the wave number: way [m], turned by
 * `shift` [rad]; linear Rec.709 of luminance 1 without either. */
static void seen(double way, const double shift[3], double rgb[3])
{
    static const double rgb_from_xyz[3][3] = {{3.2404542, -1.5371385, -0.4985314},
                                              {-0.9692660, 1.8760108, 0.0415560},
                                              {0.0556434, -0.2040259, 1.0572252}};
    double p = 2 * pi * way;
    double xyz[3] = {peak(FILM_HEIGHT_X, FILM_MIDDLE_X, FILM_VARIANCE_X, p, shift[0]) +
                         peak(FILM_HEIGHT_X2, FILM_MIDDLE_X2, FILM_VARIANCE_X2, p, shift[0]),
                     peak(FILM_HEIGHT_Y, FILM_MIDDLE_Y, FILM_VARIANCE_Y, p, shift[1]),
                     peak(FILM_HEIGHT_Z, FILM_MIDDLE_Z, FILM_VARIANCE_Z, p, shift[2])};
    for (int k = 0; k < 3; k++)
        rgb[k] =
            rgb_from_xyz[k][0] * xyz[0] + rgb_from_xyz[k][1] * xyz[1] + rgb_from_xyz[k][2] * xyz[2];
}

/* What is reflected by both sides of the film together, and by the base alone, per channel. */
struct airy {
    double way;             /* to and fro inside [m] */
    double shift[3];        /* of the same: phi_21 + phi_23 */
    double sum[3], term[3]; /* of the series so far, and its next coefficient */
    double step[3];
};

static void airy_begin(struct airy *a, const double f0[3], double ior, double thickness_nm,
                       double cosine)
{
    const double n = ior;
    double inside = sqrt(rt_max(1 - (1 - cosine * cosine) / (n * n), 0));
    double first_f0 = (n - 1) / (n + 1), first = schlick(first_f0 * first_f0, cosine);
    double passed = 1 - first;
    a->way = 2e-9 * n * thickness_nm * inside;
    for (int k = 0; k < 3; k++) {
        double root = sqrt(rt_min(rt_max(f0[k], 0), 0.9999));
        double base_ior = (1 + root) / (1 - root), second_f0 = (base_ior - n) / (base_ior + n);
        double second = schlick(second_f0 * second_f0, inside);
        double both = rt_min(first * second, 0.9999);
        double whole = passed * passed * second / (1 - both);
        a->shift[k] = pi + (base_ior < n ? pi : 0);
        a->sum[k] = first + whole;
        a->term[k] = whole - passed;
        a->step[k] = sqrt(both);
    }
}

void rt_film_fresnel(const double f0[3], double ior, double thickness_nm, double cosine,
                     double out[3])
{
    struct airy a;
    airy_begin(&a, f0, ior, thickness_nm, cosine);
    for (int m = 1; m <= 2; m++) {
        double shift[3], rgb[3];
        for (int k = 0; k < 3; k++)
            shift[k] = m * a.shift[k];
        seen(m * a.way, shift, rgb);
        for (int k = 0; k < 3; k++) {
            a.term[k] *= a.step[k];
            a.sum[k] += a.term[k] * 2 * rgb[k];
        }
    }
    double t = rt_min(thickness_nm / FILM_LEAST_NM, 1), fade = t * t * (3 - 2 * t);
    for (int k = 0; k < 3; k++) {
        double bare = schlick(f0[k], cosine);
        out[k] = rt_min(rt_max(bare + (a.sum[k] - bare) * fade, 0), 1);
    }
}

void rt_film_f0(const double f0[3], double ior, double thickness_nm, double cosine, double out[3])
{
    double w = schlick_weight(cosine);
    rt_film_fresnel(f0, ior, thickness_nm, cosine, out);
    for (int k = 0; k < 3; k++)
        out[k] = rt_min(rt_max(out[k] - w, 0) / rt_max(1 - w, 1e-4), 1);
}
