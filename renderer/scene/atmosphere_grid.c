/* SPDX-License-Identifier: MIT */
/* Sizes of the haze's grid. */
#include "renderer/scene/atmosphere_grid.h"

#include <math.h>

#include "protocol/quality_defaults.h"

enum {
    SLICES_LEAST = 16,
    SLICES_MOST = 256,
    ROWS = 90, /* of columns, at least, with the default of slices */
    SIDE_MOST_PX = 32,
};

static const double FRONT = 0.25;      /* share of the slices before the scene, where it is far */
static const double OPAQUE_DEPTH = 14; /* optical: nothing behind it is seen */
static const double SLICE_GROWTH = 8;  /* how much thicker the last finite slice is */

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

struct atmosphere_grid atmosphere_grid_of_side(const struct view *view,
                                               const struct camera_window *window, int side_px)
{
    struct atmosphere_grid grid = {.slices = slices_of(view), .side_px = side_px};
    int bottom = window->image_height - window->y - window->height;
    grid.columns = find_columns(window->x, window->width, side_px, &grid.first_x);
    grid.rows = find_columns(bottom, window->height, side_px, &grid.first_y);
    return grid;
}

struct atmosphere_grid atmosphere_grid_of(const struct view *view,
                                          const struct camera_window *window)
{
    return atmosphere_grid_of_side(view, window, atmosphere_side_px(view));
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
    uint64_t column = (uint64_t)slices_of(view) * (ATMOSPHERE_SLICE_BYTES + ATMOSPHERE_SUM_BYTES);
    return view_has_atmosphere(view) ? column / (side * side) + 1 : 0;
}

/* Depths of the scene's box. */
static void find_depths(const struct scene_state *state, const struct camera *camera,
                        double *nearest, double *farthest)
{
    *nearest = INFINITY;
    *farthest = 0;
    for (int corner = 0; corner < 8; corner++) {
        double world[3], view[3];
        for (int k = 0; k < 3; k++)
            world[k] = corner >> k & 1 ? state->bounds_max[k] : state->bounds_min[k];
        camera_to_view(camera, world, view);
        *nearest = fmin(*nearest, view[2]);
        *farthest = fmax(*farthest, view[2]);
    }
    *nearest = isfinite(*nearest) ? fmax(*nearest, 0) : 0;
    if (!(*farthest > 1e-6) || !isfinite(*farthest))
        *farthest = 1;
}

struct atmosphere_slices atmosphere_slices_of(const struct view *view,
                                              const struct scene_state *state,
                                              const struct camera *camera)
{
    const struct view_atmosphere *air = &view->atmosphere;
    double nearest, farthest, front;
    find_depths(state, camera, &nearest, &farthest);
    if (!(air->falloff_m > 0)) { /* even: nothing is seen through so much of it */
        farthest = fmin(farthest, OPAQUE_DEPTH / air->density_per_m);
        nearest = fmin(nearest, farthest / 2);
    }
    front = nearest > 0.1 * farthest ? FRONT : 0;
    if (front == 0)
        nearest = 0;
    return (struct atmosphere_slices){nearest, fmax(farthest - nearest, 1e-6), front};
}

double atmosphere_border(const struct atmosphere_slices *slices, int count, int k)
{
    if (k >= count)
        return ATMOSPHERE_FAR;
    double at = (double)k / (count - 1), u = (at - slices->front) / (1 - slices->front);
    if (u < 0)
        return slices->begin_m * at / slices->front;
    return slices->begin_m + slices->length_m * (pow(SLICE_GROWTH, u) - 1) / (SLICE_GROWTH - 1);
}

int atmosphere_slice(const struct atmosphere_slices *slices, int count, double view_z)
{
    double z = fmax(view_z, 0), behind = z - slices->begin_m;
    double grown = 1 + fmax(behind, 0) / slices->length_m * (SLICE_GROWTH - 1);
    double at = behind < 0 ? slices->front * z / slices->begin_m
                           : slices->front + (1 - slices->front) * log(grown) / log(SLICE_GROWTH);
    return (int)fmin(fmax(at, 0) * (count - 1), count - 1);
}
