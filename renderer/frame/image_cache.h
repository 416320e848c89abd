/* SPDX-License-Identifier: MIT */
/* A cache of one image: the last exact picture of a view at rest, without its overlays. A frame
 * that differs only in overlays draws them over it. In software, and for ray tracing, the cache
 * holds a copy; a GPU leaves the picture in the render targets, and it is read back again. Thread:
 * GL. */
#ifndef VITRAIL_RENDERER_FRAME_IMAGE_CACHE_H
#define VITRAIL_RENDERER_FRAME_IMAGE_CACHE_H

#include "renderer/base/content_key.h"
#include "renderer/frame_report.h"
#include "renderer/image/image.h"

struct image_cache { /* zeroed = none */
    struct content_key key;
    struct image color;         /* F32 RGBA; empty where the device has it */
    bool is_on_device;          /* as long as window_cache_keys.image has its key */
    bool has_come;              /* the frame of the picture on the device was completed */
    struct frame_report report; /* of the frame that made it, without its times */
};

/* Stores a copy, unless the picture is too large or memory runs out. */
void image_cache_store(struct image_cache *cache, struct content_key key, const struct image *color,
                       const struct frame_report *report);
/* Notes that the device holds the picture. It is used once image_cache_confirm has said that its
 * frame was completed without a fault. */
void image_cache_store_on_device(struct image_cache *cache, struct content_key key,
                                 const struct frame_report *report);
void image_cache_confirm(struct image_cache *cache, struct content_key key, bool is_right);
bool image_cache_has(const struct image_cache *cache, struct content_key key);
/* Fills the report of a frame that shows the cached picture. */
void image_cache_report(const struct image_cache *cache, struct frame_report *report);
/* Copies a picture that is not on the device into a color output of its size. */
void image_cache_copy(const struct image_cache *cache, struct image *color);
void image_cache_drop(struct image_cache *cache);

#endif
