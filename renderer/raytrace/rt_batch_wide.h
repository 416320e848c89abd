/* SPDX-License-Identifier: MIT */
/* Lights surfaces of a batch sixteen at a time where one mesh has so many and is bare
 * (rt_surface_is_bare), and the others one by one. Internal to rt_batch. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_BATCH_WIDE_H
#define VITRAIL_RENDERER_RAYTRACE_RT_BATCH_WIDE_H

#include "renderer/raytrace/rt_batch.h"

/* Evaluates materials of every fragment from the first one on and asks the lights for them; shadow
 * rays wait. The bits are those of rt_lit_begin, called for each. */
void rt_batch_wide_begin(struct rt_batch *batch, uint32_t first);

#endif
