/* SPDX-License-Identifier: MIT */
/* The last exact picture of a view at rest, as it was before anything was drawn over it: a frame
 * that differs in its overlays alone draws them over a copy. On our own processors only: others
 * have the picture in their own memory, and shade it sooner than it would come back. Thread: GL. */
#ifndef VITRAIL_RENDERER_KEPT_PICTURE_H
#define VITRAIL_RENDERER_KEPT_PICTURE_H

#include "renderer/frame_report.h"
#include "renderer/image/image.h"
#include "renderer/plan/content_key.h"

struct kept_picture { /* zeroed = none */
    struct content_key key;
    struct image color;         /* F32 RGBA */
    struct frame_report report; /* of the frame that made it, but for what it took */
};

/* A picture that cannot be kept, for its size or want of memory, is not. */
void kept_picture_note(struct kept_picture *kept, struct content_key key, const struct image *color,
                       const struct frame_report *report);
bool kept_picture_is(const struct kept_picture *kept, struct content_key key);
/* Into a color output of its size, and what a frame that shows it has to tell. */
void kept_picture_show(const struct kept_picture *kept, struct image *color,
                       struct frame_report *report);
void kept_picture_drop(struct kept_picture *kept);

#endif
