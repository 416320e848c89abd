/* SPDX-License-Identifier: MIT */
/* Cache keys of what the last window left on the device: G-buffer, per-pixel lists, image. A frame
 * with an equal key does not draw them again. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_WINDOW_CACHE_KEYS_H
#define VITRAIL_RENDERER_FRAME_WINDOW_CACHE_KEYS_H

#include "renderer/base/content_key.h"
#include "renderer/scene/camera.h"

struct window_cache_keys {       /* zeroed = nothing is cached */
    struct content_key surfaces; /* of the G-buffer */
    bool has_normal_offsets;     /* the G-buffer has normal offsets, for lookups of shadow maps */
    struct content_key layers;   /* of the per-pixel lists */
    struct content_key counted;  /* of lists whose sizes are counted, but which are not built */
    struct content_key image;    /* of the whole linear picture, if one window holds it */
};

struct window_cache_desc {
    struct content_key placement; /* required: view_placement_key */
    const struct view *view;      /* required */
    const struct scene_state *state;
    const struct camera *camera;
    const struct camera_window *window;
    int samples; /* per pixel of the targets */
};

/* Sets two keys: `surfaces` covers all that a G-buffer holds, but not the transmission of a
 * material as long as its surface stays opaque; `layers` covers that, too. Lights, environment and
 * background are in neither. The other keys are zero. */
struct window_cache_keys window_cache_keys_of(const struct window_cache_desc *desc);

#endif
