/* SPDX-License-Identifier: MIT */
/* Light of a batch's surfaces. Internal to rt_batch. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_BATCH_LIGHT_H
#define VITRAIL_RENDERER_RAYTRACE_RT_BATCH_LIGHT_H

#include "renderer/raytrace/rt_batch.h"

enum { RT_BATCH_JOBS_MAX = 32768 }; /* shadow rays that wait: 1.3 MB */

/* Evaluates materials and fills radiance and filter of every fragment from the first one on. */
void rt_batch_light(struct rt_batch *batch, uint32_t first);

/* Lights that shadow rays wait for: those of the state, and last the environment. */
static inline size_t rt_batch_light_slots(const struct rt_batch *batch)
{
    return batch->desc.scene->state->light_count + 1;
}

#endif
