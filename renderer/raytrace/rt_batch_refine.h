/* SPDX-License-Identifier: MIT */
/* Shading per sample where light differs within a pixel. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_BATCH_REFINE_H
#define VITRAIL_RENDERER_RAYTRACE_RT_BATCH_REFINE_H

#include "renderer/raytrace/rt_batch.h"

/* Of a batch that is lit: opaque surfaces that several samples of a pixel share are shaded at each
 * of them where the pixel's neighbours show the surface in another light. False: no memory. */
MUST_CHECK bool rt_batch_refine(struct rt_batch *batch);

#endif
