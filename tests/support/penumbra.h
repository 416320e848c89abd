/* SPDX-License-Identifier: MIT */
/* The width of a penumbra along a line. */
#ifndef VITRAIL_TESTS_SUPPORT_PENUMBRA_H
#define VITRAIL_TESTS_SUPPORT_PENUMBRA_H

#include <stddef.h>

#include "protocol/error.h"

struct penumbra_desc {
    const double *profile; /* required; samples at equal distances across one edge */
    size_t count;          /* from 2 */
    double dark, lit;      /* both 0: smallest and largest sample */
    double low, high;      /* shares of the way from dark to lit; both 0: 0.1 and 0.9 */
};

/* Distance in samples between the outermost places where the profile, interpolated linearly,
 * crosses the two levels: noise rather widens a penumbra than narrows it. Falling profiles are read
 * backwards. ERROR_INVALID_REQUEST when it does not reach both levels, is not finite, or the levels
 * are not 0 < low < high <= 1. */
MUST_CHECK bool penumbra_width(const struct penumbra_desc *desc, double *width_samples,
                               struct error *err);

#endif
