/* SPDX-License-Identifier: MIT */
/* Which lights can brighten anything that a camera sees: the others need no shadow. CPU only.
 * Thread: any. */
#ifndef VITRAIL_RENDERER_LIGHTS_LIGHT_REACH_H
#define VITRAIL_RENDERER_LIGHTS_LIGHT_REACH_H

#include "renderer/lights/light_bounds.h"

/* Zeroed = empty. Arrays are kept between uses. */
struct light_reach {
    bool *is_in_view; /* per light: its sphere or cone meets the frustum */
    size_t light_count, capacity;
    size_t unseen_count; /* lights that do not */
    struct light_bounds bounds;
};

/* Conservative: a light that reaches a visible point is always in view. */
MUST_CHECK bool light_reach_collect(struct light_reach *reach, const struct state_light *lights,
                                    size_t light_count, const struct camera *camera,
                                    struct error *err);
void light_reach_finish(struct light_reach *reach);

#endif
