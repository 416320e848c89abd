/* SPDX-License-Identifier: MIT */
/* What the last window left on the device, and what decided it: a frame whose surfaces or layers
 * are decided by the same is spared drawing them again. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_KEPT_WINDOW_H
#define VITRAIL_RENDERER_FRAME_KEPT_WINDOW_H

#include "renderer/base/content_key.h"
#include "renderer/scene/camera.h"

struct kept_window {             /* zeroed = nothing is kept */
    struct content_key surfaces; /* of the G-buffer */
    bool has_lifts;              /* it says where shadow maps are looked up; none asks for less */
    struct content_key layers;   /* of the per-pixel lists */
    struct content_key counted;  /* of those that are counted, and not built */
    struct content_key image;    /* of the whole linear picture, where one window holds it */
};

struct kept_window_desc {
    struct content_key placement; /* required: view_placement_key */
    const struct view *view;      /* required */
    const struct scene_state *state;
    const struct camera *camera;
    const struct camera_window *window;
    int samples; /* per pixel of the targets */
};

/* surfaces: of all that a G-buffer holds. A material's transmission and what follows from it are
 * not in there as long as the surface stays opaque; layers: of these, too. Lights, environment and
 * background are in neither. The others are zero. */
struct kept_window kept_window_keys(const struct kept_window_desc *desc);

#endif
