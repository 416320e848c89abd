/* SPDX-License-Identifier: MIT */
/* Where in a picture rays may meet anything: the boxes of the scene's items, seen by the camera.
 * Rays of blocks outside of them all are not traced. Thread: made by one, then read by any. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_SILHOUETTE_H
#define VITRAIL_RENDERER_RAYTRACE_RT_SILHOUETTE_H

#include "renderer/raytrace/rt_job.h"

enum { RT_SILHOUETTE_PX = 4 }; /* a block's side */

struct rt_silhouette {
    int x_px, y_px; /* of the first block's first pixel in the picture */
    int columns, rows;
    uint32_t *boxes; /* owned; of each block, the number of boxes that it may see; its rows and
                        columns are one more */
};

/* columns, rows: of blocks, from the pixel at x_px, y_px on. */
MUST_CHECK bool rt_silhouette_init(struct rt_silhouette *silhouette, const struct rt_job *job,
                                   const struct view_tile *blocks, struct error *err);
void rt_silhouette_finish(struct rt_silhouette *silhouette); /* accepts zeroed */

/* Whether no ray through the pixel of the picture, y down, meets anything. The pixel is in one of
 * the blocks. */
static inline bool rt_silhouette_is_clear(const struct rt_silhouette *silhouette, int x, int y)
{
    int column = (x - silhouette->x_px) / RT_SILHOUETTE_PX;
    int row = (y - silhouette->y_px) / RT_SILHOUETTE_PX;
    return !silhouette->boxes[row * (silhouette->columns + 1) + column];
}

#endif
