/* SPDX-License-Identifier: MIT */
/* The grid over a window in which the light of haze is found (renderer/shading/atmosphere_light.h,
 * renderer/raytrace/rt_haze_grid.h): square columns of pixels, which lie fast in the image so that
 * windows and tiles of it agree, cut into slices by depth. Pure functions. Thread: any. */
#ifndef VITRAIL_RENDERER_SCENE_ATMOSPHERE_GRID_H
#define VITRAIL_RENDERER_SCENE_ATMOSPHERE_GRID_H

#include "renderer/scene/camera.h"

enum {
    ATMOSPHERE_SLICE_BYTES = 3 * sizeof(float), /* of a column */
    ATMOSPHERE_SUM_BYTES = 4 * sizeof(float),   /* of a corner, on the device */
};

/* Light is found along the middles of columns, and looked up between their corners, each of which
 * has the mean of the four columns around it. */
struct atmosphere_grid {
    int columns, rows;
    int slices;           /* by quality.atmosphere_samples; the last one has no end */
    int first_x, first_y; /* of the image: its first column, y up */
    int side_px;
};

/* A power of two that grows with the image, so that images of all sizes have about as many columns;
 * the more slices, the narrower they are. */
int atmosphere_side_px(const struct view *view);
struct atmosphere_grid atmosphere_grid_of(const struct view *view,
                                          const struct camera_window *window);
/* The same with columns of another side. */
struct atmosphere_grid atmosphere_grid_of_side(const struct view *view,
                                               const struct camera_window *window, int side_px);
uint64_t atmosphere_columns(const struct atmosphere_grid *grid);
uint64_t atmosphere_corners(const struct atmosphere_grid *grid); /* with four columns around */
/* What a grid takes for a pixel; 0 without haze. */
uint64_t atmosphere_pixel_bytes(const struct view *view);

/* Where the slices lie, in depths of the view [m]: up to where the scene begins a share of them are
 * alike, and over the depth of the scene the others grow. Of the whole view, so that tiles agree.
 */
struct atmosphere_slices {
    double begin_m, length_m; /* of the scene */
    double front;             /* the share before it */
};
struct atmosphere_slices atmosphere_slices_of(const struct view *view,
                                              const struct scene_state *state,
                                              const struct camera *camera);
/* As in shaders/shading/atmosphere_slices.glsl: where slice k of `count` begins, and the slice at a
 * depth. */
#define ATMOSPHERE_FAR 1e15 /* [m]: where the last slice ends */
double atmosphere_border(const struct atmosphere_slices *slices, int count, int k);
int atmosphere_slice(const struct atmosphere_slices *slices, int count, double view_z);

#endif
