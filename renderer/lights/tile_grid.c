/* SPDX-License-Identifier: MIT */
/* Tile borders as planes, and conservative tile ranges of lights. */
#include "renderer/lights/tile_grid.h"

#include <math.h>
#include <stdlib.h>

static struct tile_plane *make_planes(double first, double step, int tiles, bool is_orthographic)
{
    struct tile_plane *planes = calloc((size_t)tiles + 1, sizeof *planes);
    for (int i = 0; planes && i <= tiles; i++) {
        double border = first + step * i;
        double length = sqrt(1 + border * border);
        planes[i] = is_orthographic ? (struct tile_plane){1, 0, border}
                                    : (struct tile_plane){1 / length, border / length, 0};
    }
    return planes;
}

bool tile_grid_init(struct tile_grid *grid, const struct camera *camera,
                    const struct camera_window *window, int tile_px, struct error *err)
{
    tile_grid_finish(grid);
    int bottom = window->image_height - window->y - window->height;
    double x_px = 2 * camera->half_width / window->image_width;
    double y_px = 2 * camera->half_height / window->image_height;
    grid->columns = (window->width + tile_px - 1) / tile_px;
    grid->rows = (window->height + tile_px - 1) / tile_px;
    grid->tile_px = tile_px;
    double x_reach = window->reach_px * x_px, y_reach = window->reach_px * y_px;
    bool is_flat = grid->is_orthographic = camera->is_orthographic;
    grid->x_first = (window->x - window->shift_px[0]) * x_px - camera->half_width;
    grid->y_first = (bottom - window->shift_px[1]) * y_px - camera->half_height;
    grid->x_step = tile_px * x_px;
    grid->y_step = tile_px * y_px;
    grid->spread = 0.5 * hypot(grid->x_step + 2 * x_reach, grid->y_step + 2 * y_reach);
    grid->x_low = make_planes(grid->x_first - x_reach, grid->x_step, grid->columns, is_flat);
    grid->x_high = make_planes(grid->x_first + x_reach, grid->x_step, grid->columns, is_flat);
    grid->y_low = make_planes(grid->y_first - y_reach, grid->y_step, grid->rows, is_flat);
    grid->y_high = make_planes(grid->y_first + y_reach, grid->y_step, grid->rows, is_flat);
    if (grid->x_low && grid->x_high && grid->y_low && grid->y_high)
        return true;
    tile_grid_finish(grid);
    return error_set(err, ERROR_NO_MEMORY, "tiles of %dx%d px", window->width, window->height);
}

void tile_grid_finish(struct tile_grid *grid)
{
    free(grid->x_low);
    free(grid->x_high);
    free(grid->y_low);
    free(grid->y_high);
    *grid = (struct tile_grid){0};
}

/* Does the bound reach the higher (side +1) or lower (-1) side of the border? */
static bool reaches(const struct light_bound *bound, const struct tile_plane *plane, int axis,
                    int side)
{
    double unit[3] = {0, 0, -side * plane->depth};
    unit[axis] = side * plane->along;
    return light_bound_support(bound, unit) - side * plane->offset >= 0;
}

/* As the border turns about the eye, "reaches beyond" reads true, false, true at most (the last
 * part touches the border's plane behind the eye), so halving finds its only change from true to
 * false, or errs to the far end. */
static bool cover_axis(const struct light_bound *bound, const struct tile_plane *low,
                       const struct tile_plane *high, int axis, int tiles, int *first, int *last)
{
    if (!reaches(bound, &low[0], axis, 1) || !reaches(bound, &high[tiles], axis, -1))
        return false;
    int in = 0, out = tiles;
    while (out - in > 1) {
        int middle = (in + out) / 2;
        *(reaches(bound, &low[middle], axis, 1) ? &in : &out) = middle;
    }
    *last = in;
    in = tiles, out = 0;
    while (in - out > 1) {
        int middle = (in + out) / 2;
        *(reaches(bound, &high[middle], axis, -1) ? &in : &out) = middle;
    }
    *first = in - 1;
    return *first <= *last;
}

bool tile_grid_cover(const struct tile_grid *grid, const struct light_bound *bound,
                     struct tile_rect *rect)
{
    return cover_axis(bound, grid->x_low, grid->x_high, 0, grid->columns, &rect->x0, &rect->x1) &&
           cover_axis(bound, grid->y_low, grid->y_high, 1, grid->rows, &rect->y0, &rect->y1);
}

static double distance_to(const struct tile_plane *plane, int axis, const double point[3])
{
    return plane->along * point[axis] - plane->depth * point[2] - plane->offset;
}

/* The cap beyond a plane lies in the ball around the plane's disc. */
static bool clip_to(struct view_ball *ball, const struct tile_plane *plane, int axis,
                    double distance)
{
    double rest = ball->radius_m * ball->radius_m - distance * distance;
    if (rest < 0)
        return false;
    ball->center[axis] -= distance * plane->along;
    ball->center[2] += distance * plane->depth;
    ball->radius_m = sqrt(rest);
    return true;
}

bool tile_grid_clip(const struct tile_grid *grid, int axis, int tile, struct view_ball *ball)
{
    const struct tile_plane *below = &(axis ? grid->y_low : grid->x_low)[tile];
    const struct tile_plane *above = &(axis ? grid->y_high : grid->x_high)[tile + 1];
    double low = distance_to(below, axis, ball->center);
    if (low < 0)
        return clip_to(ball, below, axis, low);
    double high = distance_to(above, axis, ball->center);
    return high <= 0 || clip_to(ball, above, axis, high);
}

struct view_ray tile_grid_ray(const struct tile_grid *grid, int column, int row)
{
    double x = grid->x_first + (column + 0.5) * grid->x_step;
    double y = grid->y_first + (row + 0.5) * grid->y_step;
    if (grid->is_orthographic)
        return (struct view_ray){.origin = {x, y}, .spread_m = grid->spread};
    return (struct view_ray){.slope = {x, y}, .spread_per_m = grid->spread};
}
