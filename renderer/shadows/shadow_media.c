/* SPDX-License-Identifier: MIT */
/* Winding numbers of media around a point. */
#include "renderer/shadows/shadow_media.h"

#include <math.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

/* tan of half the solid angle is numerator / denominator; positive where the point sees the
 * triangle's back, as from inside of an outward surface. */
static double half_solid_angle(const double a[3], const double b[3], const double c[3])
{
    double la = vec3_length(a), lb = vec3_length(b), lc = vec3_length(c), normal[3];
    vec3_cross(b, c, normal);
    return atan2(vec3_dot(a, normal),
                 la * lb * lc + vec3_dot(a, b) * lc + vec3_dot(a, c) * lb + vec3_dot(b, c) * la);
}

static double winding_number(const struct scene_state *state, const struct state_item *item,
                             const double point[3])
{
    const double TWO_PI = 6.283185307179586;
    const struct state_geometry geometry = state_geometry_of(state, item);
    double sum = 0;
    for (uint32_t i = 0; i + 2 < geometry.primitive->index_count; i += 3) {
        double corner[3][3];
        for (int c = 0; c < 3; c++) {
            double world[3];
            state_geometry_corner(&geometry, i + (size_t)c, world);
            vec3_sub(world, point, corner[c]);
        }
        sum += half_solid_angle(corner[0], corner[1], corner[2]);
    }
    return round((item->is_mirrored ? -sum : sum) / TWO_PI);
}

static bool may_contain(const struct state_item *item, const double point[3])
{
    for (int k = 0; k < 3; k++)
        if (point[k] < item->bounds_min[k] || point[k] > item->bounds_max[k])
            return false;
    return true;
}

static bool is_cut_away(const struct shadow_map *map)
{
    for (uint32_t i = 0; i < map->plane_count; i++)
        if (vec3_dot(map->planes[i], map->frame.origin) + map->planes[i][3] < 0)
            return true;
    return false;
}

/* As often as the item winds around the light. False: there is no room. */
static bool add_around(struct shadow_map *map, uint32_t item, double times)
{
    for (long n = labs(lround(times)); n > 0; n--) {
        if (map->around_count == SHADOW_AROUND_MAX)
            return false;
        map->around[map->around_count++] = (struct shadow_around){item, times > 0};
    }
    return true;
}

void shadow_media_at(const struct scene_state *state, const struct shadow_casters *casters,
                     struct shadow_map *map)
{
    bool begins_at_cut = is_cut_away(map);
    map->around_count = 0;
    for (int k = 0; k < 3; k++)
        map->sigma[k] = 0;
    if (map->frame.shape == SHADOW_ORTHOGRAPHIC ||
        !(map->flags & SHADOW_FLAG_MEDIA || map->has_media))
        return;
    for (size_t i = 0; i < casters->count; i++) {
        const struct state_item *item = &state->items[casters->items[i]];
        if (!item->is_medium || !may_contain(item, map->frame.origin))
            continue;
        double times = winding_number(state, item, map->frame.origin);
        begins_at_cut = begins_at_cut && add_around(map, casters->items[i], times);
        /* the words of the material record, which the events add and subtract */
        for (int k = 0; k < 3; k++)
            map->sigma[k] += times * (double)(float)state->materials[item->material].sigma[k];
    }
    if (!begins_at_cut)
        map->around_count = 0;
    else
        for (int k = 0; k < 3; k++)
            map->sigma[k] = 0;
}
