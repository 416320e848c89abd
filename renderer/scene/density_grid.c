/* SPDX-License-Identifier: MIT */
/* Trilinear interpolation in bricks, and stepping through their cells. */
#include "renderer/scene/density_grid.h"

#include <math.h>
#include <string.h>

uint64_t scene_grid_brick_count(const struct scene_grid *grid)
{
    uint64_t count = 1;
    for (int k = 0; k < 3; k++)
        count *= (grid->size[k] + SCENE_BRICK_SIDE - 1) / SCENE_BRICK_SIDE;
    return count;
}

struct density_grid density_grid_of(const struct scene *scene, const struct scene_grid *grid)
{
    const struct scene *from = scene_of_grid(scene, grid);
    struct density_grid out = {.bricks = from->grid_bricks + grid->first_brick,
                               .values = from->grid_values};
    for (int k = 0; k < 3; k++) {
        out.size[k] = grid->size[k];
        out.bricks_along[k] = (grid->size[k] + SCENE_BRICK_SIDE - 1) / SCENE_BRICK_SIDE;
    }
    return out;
}

static uint32_t clamped(int64_t at, uint32_t count)
{
    return at < 0 ? 0 : at >= (int64_t)count ? count - 1 : (uint32_t)at;
}

static const struct scene_grid_brick *brick_at(const struct density_grid *grid, uint32_t x,
                                               uint32_t y, uint32_t z)
{
    return &grid->bricks[x +
                         grid->bricks_along[0] * ((size_t)y + (size_t)grid->bricks_along[1] * z)];
}

float density_grid_voxel(const struct density_grid *grid, int64_t x, int64_t y, int64_t z)
{
    enum { SIDE = SCENE_BRICK_SIDE };
    uint32_t i = clamped(x, grid->size[0]), j = clamped(y, grid->size[1]),
             k = clamped(z, grid->size[2]);
    const struct scene_grid_brick *brick = brick_at(grid, i / SIDE, j / SIDE, k / SIDE);
    if (!brick->values)
        return 0;
    uint32_t inside = i % SIDE + SIDE * (j % SIDE + SIDE * (k % SIDE));
    return grid->values[brick->values - 1][inside];
}

/* The values around the cell between eight centres that begins at the voxel; x runs fastest. */
static void load_corners(const struct density_grid *grid, const int64_t cell[3], double corners[8])
{
    enum { SIDE = SCENE_BRICK_SIDE };
    uint32_t at[3];
    bool is_in_brick = true;
    for (int k = 0; k < 3; k++) {
        at[k] = (uint32_t)cell[k];
        is_in_brick = is_in_brick && cell[k] >= 0 && cell[k] + 1 < (int64_t)grid->size[k] &&
                      at[k] % SIDE + 1 < SIDE;
    }
    if (!is_in_brick) {
        for (int i = 0; i < 8; i++)
            corners[i] = (double)density_grid_voxel(grid, cell[0] + (i & 1), cell[1] + (i >> 1 & 1),
                                                    cell[2] + (i >> 2));
        return;
    }
    const struct scene_grid_brick *brick = brick_at(grid, at[0] / SIDE, at[1] / SIDE, at[2] / SIDE);
    if (!brick->values) {
        memset(corners, 0, 8 * sizeof *corners);
        return;
    }
    const float *values = grid->values[brick->values - 1] +
                          (at[0] % SIDE + SIDE * (at[1] % SIDE + SIDE * (at[2] % SIDE)));
    for (int i = 0; i < 4; i++) {
        const float *pair = values + SIDE * ((i & 1) + SIDE * (i >> 1));
        corners[2 * i] = (double)pair[0];
        corners[2 * i + 1] = (double)pair[1];
    }
}

/* `share` of the way across the cell. */
static double interpolate(const double corners[8], const double share[3])
{
    double along[4], across[2];
    for (int i = 0; i < 4; i++)
        along[i] = corners[2 * i] + share[0] * (corners[2 * i + 1] - corners[2 * i]);
    for (int i = 0; i < 2; i++)
        across[i] = along[2 * i] + share[1] * (along[2 * i + 1] - along[2 * i]);
    return across[0] + share[2] * (across[1] - across[0]);
}

/* The cell of a point, whether in the box or not. */
static void find_cell(const double point[3], int64_t cell[3], double share[3])
{
    for (int k = 0; k < 3; k++) {
        double below = floor(point[k] - 0.5);
        cell[k] = (int64_t)below;
        share[k] = point[k] - 0.5 - below;
    }
}

double density_grid_at(const struct density_grid *grid, const double point[3])
{
    int64_t cell[3];
    double share[3], corners[8];
    for (int k = 0; k < 3; k++)
        if (!(point[k] >= 0 && point[k] <= grid->size[k]))
            return 0;
    find_cell(point, cell, share);
    load_corners(grid, cell, corners);
    return interpolate(corners, share);
}

bool density_walk_begin(struct density_walk *walk, const struct density_grid *grid,
                        const double from[3], const double steps[3], double t_min, double t_max)
{
    *walk = (struct density_walk){.grid = grid, .t = t_min, .end = t_max};
    for (int k = 0; k < 3; k++) {
        double step = walk->step[k] = steps[k];
        walk->from[k] = from[k];
        if (step == 0) {
            if (!(from[k] >= 0 && from[k] <= grid->size[k]))
                return false;
            continue;
        }
        double a = -from[k] / step, b = (grid->size[k] - from[k]) / step;
        walk->t = fmax(walk->t, fmin(a, b));
        walk->end = fmin(walk->end, fmax(a, b));
    }
    return walk->t < walk->end && isfinite(walk->end - walk->t);
}

/* The largest value around the cells that begin in a brick: those of the next bricks count. */
static double bound_around(const struct density_grid *grid, const int64_t brick[3])
{
    float bound = 0;
    for (int i = 0; i < 8; i++) {
        uint32_t at[3];
        for (int k = 0; k < 3; k++)
            at[k] = clamped(brick[k] + (i >> k & 1), grid->bricks_along[k]);
        const struct scene_grid_brick *b = brick_at(grid, at[0], at[1], at[2]);
        bound = b->values ? fmaxf(bound, b->largest) : bound;
    }
    return (double)bound;
}

/* Where the way leaves the cells [low, high) of an axis, which begin at centres. */
static double leave(const struct density_walk *walk, int axis, int64_t low, int64_t high)
{
    double step = walk->step[axis];
    if (step == 0)
        return INFINITY;
    return ((double)(step > 0 ? high : low) + 0.5 - walk->from[axis]) / step;
}

bool density_walk_next(struct density_walk *walk, struct density_piece *piece)
{
    enum { SIDE = SCENE_BRICK_SIDE };
    if (!(walk->t < walk->end))
        return false;
    int64_t cell[3], brick[3];
    for (int k = 0; k < 3; k++) {
        double at = walk->from[k] + walk->t * walk->step[k] - 0.5;
        double below = floor(at), nearest = nearbyint(at);
        /* a plane that was reached but for rounding was crossed */
        if (walk->step[k] != 0 && fabs(at - nearest) < 1e-9)
            below = walk->step[k] > 0 ? nearest : nearest - 1;
        cell[k] = (int64_t)below;
        brick[k] = cell[k] < 0 ? -1 : cell[k] / SIDE;
    }
    if (!walk->has_brick || memcmp(brick, walk->brick, sizeof brick) != 0) {
        walk->bound = bound_around(walk->grid, brick);
        memcpy(walk->brick, brick, sizeof brick);
        walk->has_brick = true;
    }
    piece->bound = walk->bound;
    double to = walk->end;
    for (int k = 0; k < 3; k++) {
        int64_t low = cell[k], high = low + 1;
        if (piece->bound == 0) {
            low = brick[k] < 0 ? -1 : brick[k] * SIDE;
            high = brick[k] < 0 ? 0 : low + SIDE;
        }
        to = fmin(to, leave(walk, k, low, high));
    }
    /* rounding may hold it where it is: it goes on */
    to = fmin(fmax(to, nextafter(walk->t, INFINITY)), walk->end);
    piece->from = walk->t;
    piece->to = walk->t = to;
    return true;
}

double density_walk_integrate(const struct density_walk *walk, double from, double to)
{
    /* Gauss and Legendre's rule of two points is exact for degree 3 */
    const double off = 0.5 / sqrt(3.0);
    double sum = 0;
    int64_t cell[3];
    double share[3], middle[3], corners[8];
    for (int k = 0; k < 3; k++)
        middle[k] = walk->from[k] + 0.5 * (from + to) * walk->step[k];
    find_cell(middle, cell, share);
    load_corners(walk->grid, cell, corners);
    for (int i = -1; i <= 1; i += 2) {
        double t = 0.5 * (from + to) + i * off * (to - from);
        for (int k = 0; k < 3; k++)
            share[k] = walk->from[k] + t * walk->step[k] - 0.5 - (double)cell[k];
        sum += interpolate(corners, share);
    }
    return 0.5 * (to - from) * sum;
}
