/* SPDX-License-Identifier: MIT */
/* The frustum of a window of the camera's image, as planes in f64. CPU only. Thread: any. */
#ifndef VITRAIL_RENDERER_SCENE_FRUSTUM_H
#define VITRAIL_RENDERER_SCENE_FRUSTUM_H

#include "renderer/scene/camera.h"

/* Bounds of drawables grow by this share of their distance from the eye and of their radius, far
 * more than f32 positions are rounded. */
#define FRUSTUM_MARGIN 1e-4

struct frustum {
    double eye[3];
    double planes[5][4]; /* unit normal that looks inward, and offset [m]; relative to the eye */
    int plane_count;     /* left, right, bottom, top; perspective: also what lies behind the eye */
};

/* A window without an image (zeroed) stands for the whole image. Near and far planes are left out:
 * a medium is drawn up to the eye, too. */
void frustum_init(struct frustum *frustum, const struct camera *camera,
                  const struct camera_window *window);

/* Whether the item's bounding sphere and box both meet the frustum. Conservative: grown by what f32
 * positions are off, and by a pixel or two, so that nothing that is drawn is ever outside. */
bool frustum_meets(const struct frustum *frustum, const struct state_item *item);

#endif
