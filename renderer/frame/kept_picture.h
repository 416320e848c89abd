/* SPDX-License-Identifier: MIT */
/* The last exact picture of a view at rest, as it was before anything was drawn over it: a frame
 * that differs in its overlays alone draws them over it. On our own processors, and where rays made
 * it, that is a copy; other devices leave the picture in the targets of the renderer, and send it
 * once more. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_KEPT_PICTURE_H
#define VITRAIL_RENDERER_FRAME_KEPT_PICTURE_H

#include "renderer/base/content_key.h"
#include "renderer/frame_report.h"
#include "renderer/image/image.h"

struct kept_picture { /* zeroed = none */
    struct content_key key;
    struct image color;         /* F32 RGBA; empty where the device has it */
    bool is_on_device;          /* kept_window.image tells whether it still is */
    bool has_come;              /* of that on the device: its frame did, and was right */
    struct frame_report report; /* of the frame that made it, but for what it took */
};

/* A picture that cannot be kept, for its size or want of memory, is not. */
void kept_picture_note(struct kept_picture *kept, struct content_key key, const struct image *color,
                       const struct frame_report *report);
/* The device has it, and shows it once kept_picture_arrive says that its frame was right. */
void kept_picture_note_on_device(struct kept_picture *kept, struct content_key key,
                                 const struct frame_report *report);
void kept_picture_arrive(struct kept_picture *kept, struct content_key key, bool is_right);
bool kept_picture_is(const struct kept_picture *kept, struct content_key key);
/* What a frame that shows it has to tell. */
void kept_picture_report(const struct kept_picture *kept, struct frame_report *report);
/* Into a color output of its size; of one that is not on the device. */
void kept_picture_copy(const struct kept_picture *kept, struct image *color);
void kept_picture_drop(struct kept_picture *kept);

#endif
