/* SPDX-License-Identifier: MIT */
/* Sorting sixteen surfaces by their lists of lights. */
#include "renderer/raytrace/rt_wide_lists.h"

#include <math.h>

static bool is_same_list(const struct rt_light_list *a, const struct rt_light_list *b)
{
    return a->cluster == b->cluster || (a->counts[1] == 0 && b->counts[1] == 0);
}

/* The list of the least pixel and depth, where the largest have the same: all that are between have
 * it, too. */
static bool have_one_list(const struct rt_light_set *light_set, const struct rt_wide_places *places,
                          struct rt_light_list *list)
{
    const double *z = places->view_z;
    int x[2] = {places->x[0], places->x[0]}, y[2] = {places->y[0], places->y[0]};
    double depth[2] = {z[0], z[0]};
    for (int i = 0; i < places->count; i++) {
        x[0] = places->x[i] < x[0] ? places->x[i] : x[0];
        x[1] = places->x[i] > x[1] ? places->x[i] : x[1];
        y[0] = places->y[i] < y[0] ? places->y[i] : y[0];
        y[1] = places->y[i] > y[1] ? places->y[i] : y[1];
        depth[0] = z[i] < depth[0] ? z[i] : depth[0];
        depth[1] = z[i] > depth[1] ? z[i] : depth[1];
        if (!isfinite(z[i]))
            return false;
    }
    *list = rt_light_set_near(light_set, x[0], y[0], depth[0]);
    const struct rt_light_list last = rt_light_set_near(light_set, x[1], y[1], depth[1]);
    return list->cluster == last.cluster;
}

int rt_wide_lists(const struct rt_light_set *light_set, const struct rt_wide_places *places,
                  struct rt_light_list lists[RT_WIDE], uint32_t lanes[RT_WIDE])
{
    struct rt_light_list own[RT_WIDE];
    uint32_t left = (1u << places->count) - 1;
    int count = 0;
    if (have_one_list(light_set, places, &lists[0])) {
        lanes[0] = left;
        return 1;
    }
    for (int i = 0; i < places->count; i++)
        own[i] = rt_light_set_near(light_set, places->x[i], places->y[i], places->view_z[i]);
    for (; left; left &= ~lanes[count++]) {
        lists[count] = own[__builtin_ctz(left)];
        lanes[count] = 0;
        for (int i = 0; i < places->count; i++)
            lanes[count] |= (uint32_t)is_same_list(&lists[count], &own[i]) << i;
        lanes[count] &= left;
    }
    return count;
}
