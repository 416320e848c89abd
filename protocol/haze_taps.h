/* SPDX-License-Identifier: MIT */
/* How many texels of a shadow map a point in haze asks of a light. The renderer and the forecast of
 * its times read this. */
#ifndef VITRAIL_PROTOCOL_HAZE_TAPS_H
#define VITRAIL_PROTOCOL_HAZE_TAPS_H

#include "protocol/quality_defaults.h"

/* Where surfaces ask `taps`. Columns and slices smooth what a few texels would, so that one will
 * do, but not of techniques that leave light to chance, nor where a request has more than the
 * default. */
static inline int haze_taps(int taps)
{
    return taps > SHADOW_TAPS_DEFAULT ? taps : 1;
}

#endif
