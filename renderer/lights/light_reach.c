/* SPDX-License-Identifier: MIT */
/* Lights against the planes of the camera's frustum. */
#include "renderer/lights/light_reach.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Outside when the whole bound lies behind one side plane; the planes pass through the eye, or lie
 * beside it where the camera is orthographic. */
static bool meets_frustum(const struct light_bound *bound, const struct camera *camera)
{
    const double half[2] = {camera->half_width, camera->half_height};
    for (int axis = 0; axis < 2; axis++) {
        for (int sign = -1; sign <= 1; sign += 2) {
            double inward[3] = {0, 0, 0}, offset = 0;
            inward[axis] = sign;
            if (camera->is_orthographic) {
                offset = half[axis];
            } else {
                double length = hypot(1, half[axis]);
                inward[axis] /= length;
                inward[2] = half[axis] / length;
            }
            if (light_bound_support(bound, inward) + offset < 0)
                return false;
        }
    }
    return true;
}

static bool reserve(struct light_reach *reach, size_t count, struct error *err)
{
    if (count > reach->capacity) {
        bool *grown = realloc(reach->is_in_view, count * sizeof *grown);
        if (!grown)
            return error_set(err, ERROR_NO_MEMORY, "reach of %zu lights", count);
        reach->is_in_view = grown;
        reach->capacity = count;
    }
    reach->light_count = count;
    return true;
}

bool light_reach_collect(struct light_reach *reach, const struct state_light *lights,
                         size_t light_count, const struct camera *camera, struct error *err)
{
    reach->light_count = reach->unseen_count = 0;
    if (!reserve(reach, light_count, err) ||
        !light_bounds_collect(&reach->bounds, lights, light_count, camera, err))
        return false;
    if (light_count)
        memset(reach->is_in_view, 0, light_count * sizeof *reach->is_in_view);
    for (size_t i = 0; i < reach->bounds.global_count; i++)
        reach->is_in_view[reach->bounds.global[i]] = true;
    for (size_t i = 0; i < reach->bounds.count; i++)
        reach->is_in_view[reach->bounds.items[i].light] =
            meets_frustum(&reach->bounds.items[i], camera);
    for (size_t i = 0; i < light_count; i++)
        reach->unseen_count += !reach->is_in_view[i];
    return true;
}

void light_reach_finish(struct light_reach *reach)
{
    free(reach->is_in_view);
    light_bounds_finish(&reach->bounds);
    *reach = (struct light_reach){0};
}
