/* SPDX-License-Identifier: MIT */
/* Which lights can brighten anything that a camera sees: the others need no shadow. CPU only.
 * Thread: any. */
#ifndef VITRAIL_RENDERER_LIGHTS_LIGHT_REACH_H
#define VITRAIL_RENDERER_LIGHTS_LIGHT_REACH_H

#include "renderer/lights/light_bounds.h"
#include "renderer/scene/scene_state.h"

/* Zeroed = empty. Arrays are kept between uses. */
struct light_reach {
    bool *is_in_view; /* per light: its sphere or cone meets the frustum, and a drawable there */
    size_t light_count, capacity;
    size_t unseen_count; /* lights that do not */
    struct light_bounds bounds;
    struct light_reach_box { /* relative to the eye, in the world's axes */
        double low[3], high[3];
    } * boxes; /* of drawables in view; neighbours in the scene share one where there are many */
    size_t box_count, box_capacity;
};

/* Conservative: a light that reaches a point of a visible drawable is always in view. */
MUST_CHECK bool light_reach_collect(struct light_reach *reach, const struct scene_state *state,
                                    const struct camera *camera, struct error *err);
void light_reach_finish(struct light_reach *reach);

#endif
