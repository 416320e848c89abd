/* SPDX-License-Identifier: MIT */
/* Winding numbers of media around a point. */
#include "renderer/shadows/shadow_media.h"

#include <math.h>

#include "renderer/scene/matrix.h"
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

void shadow_media_at(const struct scene_state *state, const struct shadow_casters *casters,
                     const struct shadow_frame *frame, double sigma[3])
{
    for (int k = 0; k < 3; k++)
        sigma[k] = 0;
    if (frame->shape == SHADOW_ORTHOGRAPHIC)
        return;
    for (size_t i = 0; i < casters->count; i++) {
        const struct state_item *item = &state->items[casters->items[i]];
        if (!item->is_medium || !may_contain(item, frame->origin))
            continue;
        double times = winding_number(state, item, frame->origin);
        /* the words of the material record, which the events add and subtract */
        for (int k = 0; k < 3; k++)
            sigma[k] += times * (double)(float)state->materials[item->material].sigma[k];
    }
}
