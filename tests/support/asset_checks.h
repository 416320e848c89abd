/* SPDX-License-Identifier: MIT */
/* What must hold in a picture of any scene, whatever it shows. Thread: the GL thread. */
#ifndef VITRAIL_TESTS_SUPPORT_ASSET_CHECKS_H
#define VITRAIL_TESTS_SUPPORT_ASSET_CHECKS_H

#include "tests/support/image_checks.h"

/* A perspective LOOK_AT view of 480 x 270 with every output. */
struct view asset_view(const double eye[3], const double target[3], double fov_y_deg);
/* From this direction (towards the eye), as near as the bounds of the scene allow. */
struct view asset_view_from(const struct rig_scene *scene, const double direction[3],
                            double fov_y_deg);
/* Renders it, checks that the values are sound, and saves the picture under this name. */
void asset_shoot(struct renderer *renderer, const struct rig_scene *scene, const struct view *view,
                 const char *picture, struct frame *frame);

/* At half the size, under a point and a spot light placed around the scene by its bounds:
 * light adds up and scales, the deep map agrees with the plain one where nothing is transparent and
 * with the linked lists within what 16 bits of filter allow, and both light lists give the same. */
void asset_check_invariants(struct renderer *renderer, const struct rig_scene *scene,
                            const struct view *view);

#endif
