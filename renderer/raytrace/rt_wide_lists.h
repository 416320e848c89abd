/* SPDX-License-Identifier: MIT */
/* Which lights sixteen surfaces ask, and which of them have one list: neighbours mostly do. Thread:
 * any. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_WIDE_LISTS_H
#define VITRAIL_RENDERER_RAYTRACE_RT_WIDE_LISTS_H

#include "renderer/raytrace/rt_wide.h"

struct rt_wide_places { /* of the picture, y down */
    int count, x[RT_WIDE], y[RT_WIDE];
    const double *view_z; /* metres along the view direction */
};

/* Returns how many different lists there are; lanes: out, 1 << lane of the surfaces of each. */
int rt_wide_lists(const struct rt_light_set *light_set, const struct rt_wide_places *places,
                  struct rt_light_list lists[RT_WIDE], uint32_t lanes[RT_WIDE]);

/* 1 << lane where it is so. */
static inline uint32_t rt_wide_lanes(const uint32_t is_so[RT_WIDE])
{
    uint32_t lanes = 0;
    for (int i = 0; i < RT_WIDE; i++)
        lanes |= is_so[i] << i;
    return lanes;
}

#endif
