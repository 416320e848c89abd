/* SPDX-License-Identifier: MIT */
/* A window cut into square tiles, as planes in view space, and which tiles a light can touch. Rows
 * count upwards (GL's y up: row 0 at the bottom of the window). CPU only. Thread: any. */
#ifndef VITRAIL_RENDERER_LIGHTS_TILE_GRID_H
#define VITRAIL_RENDERER_LIGHTS_TILE_GRID_H

#include "renderer/lights/light_bounds.h"

/* Signed distance of (s, z) to a tile border, positive towards higher tiles: along * s - depth * z
 * - offset. */
struct tile_plane {
    double along, depth, offset;
};

struct tile_grid {
    int columns, rows, tile_px; /* the last column and row may reach past the window */
    bool is_orthographic;
    double x_first, y_first; /* lower left corner: tangents, or metres when orthographic */
    double x_step, y_step;   /* per tile */
    double spread;           /* half the diagonal of a tile */
    /* Borders, columns + 1 and rows + 1: as tiles above them have them, and as those below them.
     * They differ where the window's reach is not 0. */
    struct tile_plane *x_low, *x_high, *y_low, *y_high;
};

struct tile_rect {
    int x0, y0, x1, y1;
}; /* tiles, inclusive */

/* Zeroed = empty; init releases what was there. */
MUST_CHECK bool tile_grid_init(struct tile_grid *grid, const struct camera *camera,
                               const struct camera_window *window, int tile_px, struct error *err);
void tile_grid_finish(struct tile_grid *grid);

/* Tiles that the bound may touch; false when none. */
bool tile_grid_cover(const struct tile_grid *grid, const struct light_bound *bound,
                     struct tile_rect *rect);

struct view_ball {
    double center[3], radius_m;
};

/* The part of the ball between two neighbouring borders fits into a smaller ball; false when there
 * is none. (Persson 2013, "Practical clustered shading".) axis: 0 for columns, 1 for rows. */
bool tile_grid_clip(const struct tile_grid *grid, int axis, int tile, struct view_ball *ball);

/* The line through a tile's middle, widened to hold all of the tile. */
struct view_ray tile_grid_ray(const struct tile_grid *grid, int column, int row);

#endif
