/* SPDX-License-Identifier: MIT */
/* Work that goes before the rest of a frame: a long frame stops where nothing of it is half done,
 * other frames are made, and it goes on as if nothing had been. */
#ifndef VITRAIL_RENDERER_BASE_INTERLUDE_H
#define VITRAIL_RENDERER_BASE_INTERLUDE_H

#include <stdbool.h>

struct interlude {
    void *context;
    bool (*is_due)(void *context); /* required; any thread, often: shall the frame stop? */
    bool (*serve)(void *context);  /* required; on the frame's thread, while nothing else of the
                                      frame runs; false: the frame is not wanted any more */
    bool (*is_unwanted)(void *context); /* any thread, often, also of what cannot stop for others:
                                           true ends rays within a tile; NULL: asked by `serve`
                                           alone */
};

#endif
