/* SPDX-License-Identifier: MIT */
/* Sizes of the haze's grid. */
#include "renderer/window/atmosphere_grid.h"

#include <math.h>

#include "protocol/quality_defaults.h"

enum {
    SLICES_LEAST = 16,
    SLICES_MOST = 256,
    ROWS = 90, /* of columns, at least, with the default of slices */
    SIDE_MOST_PX = 32,
};

static int asked(const struct view *view)
{
    return quality_or(view->quality.atmosphere_samples, ATMOSPHERE_SLICES_DEFAULT);
}

static int slices_of(const struct view *view)
{
    int slices = asked(view);
    return 1 + (slices < SLICES_LEAST ? SLICES_LEAST : slices > SLICES_MOST ? SLICES_MOST : slices);
}

int atmosphere_side_px(const struct view *view)
{
    double finer = sqrt((double)asked(view) / ATMOSPHERE_SLICES_DEFAULT);
    double most = (double)view->height_px / ROWS / finer;
    int side = 1;
    while (2 * side <= most && side < SIDE_MOST_PX)
        side *= 2;
    return side;
}

/* The columns around the corners between which pixels from `first` on lie. */
static int find_columns(int first, int count, int side, int *first_column)
{
    int low = first / side, high = (first + count - 1) / side + 1; /* corners */
    *first_column = low - 1;
    return high - low + 2;
}

struct atmosphere_grid atmosphere_grid_of(const struct view *view,
                                          const struct camera_window *window)
{
    struct atmosphere_grid grid = {.slices = slices_of(view), .side_px = atmosphere_side_px(view)};
    int bottom = window->image_height - window->y - window->height;
    grid.columns = find_columns(window->x, window->width, grid.side_px, &grid.first_x);
    grid.rows = find_columns(bottom, window->height, grid.side_px, &grid.first_y);
    return grid;
}

uint64_t atmosphere_columns(const struct atmosphere_grid *grid)
{
    return (uint64_t)grid->columns * (uint64_t)grid->rows;
}

uint64_t atmosphere_corners(const struct atmosphere_grid *grid)
{
    return (uint64_t)(grid->columns - 1) * (uint64_t)(grid->rows - 1);
}

uint64_t atmosphere_pixel_bytes(const struct view *view)
{
    uint64_t side = (uint64_t)atmosphere_side_px(view);
    uint64_t column = (uint64_t)slices_of(view) * 2 * ATMOSPHERE_SLICE_BYTES;
    return view_has_atmosphere(view) ? column / (side * side) + 1 : 0;
}
