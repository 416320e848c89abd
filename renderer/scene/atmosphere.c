/* SPDX-License-Identifier: MIT */
/* Closed forms of even haze and of haze that thins out exponentially. */
#include "renderer/scene/atmosphere.h"

#include <math.h>

double atmosphere_extinction(const struct view_atmosphere *air, double height_m)
{
    double above = height_m - air->base_m;
    bool is_thinner = air->falloff_m > 0 && above > 0;
    return air->density_per_m * (is_thinner ? exp(-above / air->falloff_m) : 1);
}

/* The integral of exp(-rate t) over [0, length]; rate >= 0. */
static double integrate_fall(double rate, double length)
{
    if (!isfinite(length))
        return rate > 0 ? 1 / rate : INFINITY;
    return rate * length < 1e-12 ? length : -expm1(-rate * length) / rate;
}

double atmosphere_depth(const struct view_atmosphere *air, double height_m, double climb,
                        double length_m)
{
    double above = height_m - air->base_m;
    if (!(air->density_per_m > 0) || !(length_m > 0))
        return 0;
    if (!(air->falloff_m > 0))
        return air->density_per_m * length_m;
    /* up to where the way crosses the base, and behind that: one of both is even */
    bool begins_below = above <= 0;
    double cross = begins_below == (climb > 0) && climb != 0 ? -above / climb : INFINITY;
    double before = fmin(cross, length_m), behind = before < length_m ? length_m - before : 0;
    double even = begins_below ? before : behind, thin = begins_below ? behind : before;
    if (!(thin > 0))
        return air->density_per_m * even;
    /* from its lower end on, from which it thins out */
    double lowest = begins_below ? 0 : climb < 0 ? fmax(above + climb * thin, 0) : above;
    double relative = exp(-lowest / air->falloff_m);
    double amount =
        relative > 0 ? relative * integrate_fall(fabs(climb) / air->falloff_m, thin) : 0;
    return air->density_per_m * (even + amount);
}

double atmosphere_phase(const struct view_atmosphere *air, double cosine)
{
    double g = air->anisotropy, d = 1 + g * g - 2 * g * cosine;
    return (1 - g * g) / (4 * M_PI * d * sqrt(d));
}
