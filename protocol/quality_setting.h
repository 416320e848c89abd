/* SPDX-License-Identifier: MIT */
/* A setting of the technique and of what it has: a row of a trade-off has one, and so has what the
 * server chooses for max_error and budget_ms. Plain data. */
#ifndef VITRAIL_PROTOCOL_QUALITY_SETTING_H
#define VITRAIL_PROTOCOL_QUALITY_SETTING_H

#include "protocol/shadow_technique.h"
#include "protocol/transparency.h"

struct quality_setting {
    enum shadow_technique shadows;
    int shadow_resolution, shadow_taps; /* 0 where the technique has none */
    int samples;
    double shadow_compression; /* of deep lists; 0 = exact */
    int shadow_prefilter;      /* of deep lists; 0 and 1 = none */
    int atmosphere_samples;    /* of haze and density grids; 0 = the default, and where there is
                                  neither */
    enum transparency transparency; /* AUTO: as the request says, or lists */
};

#endif
