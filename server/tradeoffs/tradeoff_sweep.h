/* SPDX-License-Identifier: MIT */
/* The parameter sweep of a trade-off: which settings are measured, those near the default first.
 * Pure. Thread: any. */
#ifndef VITRAIL_SERVER_TRADEOFFS_TRADEOFF_SWEEP_H
#define VITRAIL_SERVER_TRADEOFFS_TRADEOFF_SWEEP_H

#include "protocol/tradeoff.h"

struct sweep_desc {
    const struct request_quality *fixed; /* required; what it says is not varied */
    bool has_shadows;                    /* a light casts one on something */
    bool has_transparent_casters;
    bool has_lights; /* any that shines in the view: without, haze and grids have none to find */
    unsigned needs;  /* enum shadow_can: what else the request asks of a technique */
    bool has_layers; /* transparent surfaces are in the picture */
    unsigned layer_needs;  /* enum transparency_can: what is asked of how they are drawn */
    int max_samples;       /* of the rasteriser at once, 1 or 4 */
    int reference_samples; /* 16, 64 or 256 */
    int max_settings;
};

/* Fills settings and returns their number; what cannot differ, what cannot be and what is too much
 * goes to the skips of `tradeoff`. Order: by how many steps a setting is away from the default one,
 * so that any number of them spans the whole range. */
int tradeoff_sweep(const struct sweep_desc *desc,
                   struct quality_setting settings[TRADEOFF_ROWS_MAX], struct tradeoff *tradeoff);

#endif
