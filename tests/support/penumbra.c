/* SPDX-License-Identifier: MIT */
/* Where a profile first reaches one level and last another. */
#include "tests/support/penumbra.h"

#include <math.h>
#include <stdbool.h>

/* Outermost position where the profile, read in the given direction, goes from below `level` to it
 * or above: the first one, or the last one. Negative when there is none. */
static double find_crossing(const struct penumbra_desc *desc, bool is_falling, double level,
                            bool is_last)
{
    double found = -1;
    for (size_t i = 0; i + 1 < desc->count; i++) {
        double a = desc->profile[is_falling ? desc->count - 1 - i : i];
        double b = desc->profile[is_falling ? desc->count - 2 - i : i + 1];
        if (!(a < level) || !(b >= level))
            continue;
        found = (double)i + (level - a) / (b - a);
        if (!is_last)
            break;
    }
    return found;
}

static bool profile_range(const struct penumbra_desc *desc, double *dark, double *lit,
                          struct error *err)
{
    *dark = INFINITY;
    *lit = -INFINITY;
    for (size_t i = 0; i < desc->count; i++) {
        if (!isfinite(desc->profile[i]))
            return error_set(err, ERROR_INVALID_REQUEST, "sample %zu of the profile is not finite",
                             i);
        *dark = fmin(*dark, desc->profile[i]);
        *lit = fmax(*lit, desc->profile[i]);
    }
    if (desc->dark != 0 || desc->lit != 0) {
        *dark = desc->dark;
        *lit = desc->lit;
    }
    if (!(*dark < *lit))
        return error_set(err, ERROR_INVALID_REQUEST, "the profile has no edge: dark %g, lit %g",
                         *dark, *lit);
    return true;
}

bool penumbra_width(const struct penumbra_desc *desc, double *width_samples, struct error *err)
{
    double dark, lit, low = desc->low, high = desc->high;
    if (desc->count < 2)
        return error_set(err, ERROR_INVALID_REQUEST, "a profile of %zu samples has no edge",
                         desc->count);
    if (low == 0 && high == 0) {
        low = 0.1;
        high = 0.9;
    }
    if (!(low > 0 && low < high && high <= 1))
        return error_set(err, ERROR_INVALID_REQUEST, "levels %g and %g of a penumbra", low, high);
    if (!profile_range(desc, &dark, &lit, err))
        return false;
    bool is_falling = desc->profile[0] > desc->profile[desc->count - 1];
    double first = find_crossing(desc, is_falling, dark + low * (lit - dark), false);
    double last = find_crossing(desc, is_falling, dark + high * (lit - dark), true);
    if (first < 0 || last < 0)
        return error_set(err, ERROR_INVALID_REQUEST, "the profile does not cross %g and %g",
                         dark + low * (lit - dark), dark + high * (lit - dark));
    *width_samples = last - first;
    return true;
}
