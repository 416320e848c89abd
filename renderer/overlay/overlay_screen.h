/* SPDX-License-Identifier: MIT */
/* Projects world geometry to pixels: to view space, through the clip planes and the near plane, to
 * the picture. Computes in f64. Thread: any. */
#ifndef VITRAIL_RENDERER_OVERLAY_OVERLAY_SCREEN_H
#define VITRAIL_RENDERER_OVERLAY_OVERLAY_SCREEN_H

#include <stdbool.h>
#include <stddef.h>

#include "renderer/scene/camera.h"
#include "renderer/scene/polygon_clip.h"
#include "renderer/view.h"

struct overlay_screen {
    const struct camera *camera;          /* borrowed */
    int width_px, height_px;              /* of the picture */
    struct view_tile drawn;               /* of it: what is drawn over */
    double planes[POLYGON_PLANES_MAX][4]; /* of view space: near, then the clip planes; a point with
                                            ax + by + cz + d < 0 is cut away */
    size_t plane_count;
};

void overlay_screen_init(struct overlay_screen *screen, const struct camera *camera,
                         const struct view *view);

/* Finds the continuous pixel coordinates, y down, of a point of view space (camera_to_view). The
 * point must not lie before the near plane. */
void overlay_screen_project(const struct overlay_screen *screen, const double point[3],
                            double pixel[2]);

/* Clips a convex polygon. Returns the number of corners that are left, 0 for none. */
int overlay_screen_clip(const struct overlay_screen *screen, double corners[POLYGON_CORNERS_MAX][3],
                        int count);
/* Clips a segment likewise. Returns false if nothing is left. */
bool overlay_screen_clip_segment(const struct overlay_screen *screen, double ends[2][3]);

/* The width of a pixel at a depth [m]. */
double overlay_screen_pixel_m(const struct overlay_screen *screen, double depth_m);

#endif
