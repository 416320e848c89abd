/* SPDX-License-Identifier: MIT */
/* A camera that goes round a scene and sees all of it. Thread: any. */
#ifndef VITRAIL_PROTOCOL_TURNTABLE_H
#define VITRAIL_PROTOCOL_TURNTABLE_H

#include <jansson.h>
#include <stdbool.h>

#define TURNTABLE_FOV_Y_DEG 45.0
#define TURNTABLE_ELEVATION_DEG 20.0 /* where nothing else is said */

struct turntable {
    double center[3], distance_m; /* of the scene's bounds, in its world */
};

/* summary: of the scene (GET /v1/scenes/{id}); width_px, height_px: of the picture, since narrow
 * ones need more distance. False: the scene has no bounds. */
bool turntable_init(struct turntable *table, const json_t *summary, double width_px,
                    double height_px);

/* turns: of the circle, from the front, counter-clockwise from above. */
void turntable_eye(const struct turntable *table, double elevation_deg, double turns,
                   double eye[3]);

#endif
