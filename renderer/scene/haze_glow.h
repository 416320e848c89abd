/* SPDX-License-Identifier: MIT */
/* Lamps that are seen in haze. What haze scatters beside a lamp grows like one over the distance of
 * the ray from it, which columns of a grid cannot hold: pixels near these lamps have their light
 * along their own ray (renderer/shading/atmosphere_glow.h, renderer/raytrace/rt_haze_glow.h). Pure
 * functions. Thread: any. */
#ifndef VITRAIL_RENDERER_SCENE_HAZE_GLOW_H
#define VITRAIL_RENDERER_SCENE_HAZE_GLOW_H

#include "renderer/scene/camera.h"

enum { HAZE_GLOWS_MOST = 16 }; /* each costs its rays at some hundred pixels */

struct haze_glow {
    uint32_t light;  /* of the state */
    double place[2]; /* where it is seen, in columns of the image, y up */
    double strength; /* how bright it glows in the columns beside it, against others; > 0 */
};

/* The lamps with a place and no area that glow most in the whole picture, so that tiles agree, the
 * strongest first: their number. side_px: of a column. */
int haze_glows_find(const struct view *view, const struct scene_state *state,
                    const struct camera *camera, int side_px,
                    struct haze_glow glows[HAZE_GLOWS_MOST]);

#endif
