/* SPDX-License-Identifier: MIT */
/* Density grids of a scene blob: sizes, bricks and values. */
#include "renderer/scene/grid_check.h"

#include "renderer/scene/blob_check.h"
#include "renderer/scene/density_grid.h"

static bool is_in(float value, float low, float high)
{
    return value >= low && value <= high;
}

static bool is_grid(const struct scene_grid *grid, uint64_t string_bytes)
{
    uint64_t voxels = 1;
    for (int k = 0; k < 3; k++) {
        if (grid->size[k] < 1 || grid->size[k] > SCENE_GRID_SIDE_MAX ||
            !is_in(grid->bounds_min[k], -1e30f, 1e30f) ||
            !is_in(grid->bounds_max[k], -1e30f, 1e30f) ||
            !(grid->bounds_max[k] > grid->bounds_min[k]) ||
            !is_in(grid->extinction[k], 0, SCENE_GRID_VALUE_MAX) || !is_in(grid->color[k], 0, 1))
            return false;
        voxels *= grid->size[k];
    }
    return voxels <= SCENE_GRID_VOXELS_MAX && grid->part == 0 && grid->name < string_bytes &&
           is_in(grid->density, 0, SCENE_GRID_VALUE_MAX) &&
           is_in(grid->largest, 0, SCENE_GRID_VALUE_MAX) && grid->anisotropy > -1 &&
           grid->anisotropy < 1;
}

static bool check_brick(const struct scene *scene, const struct scene_grid_brick *brick,
                        float largest)
{
    if (brick->values > scene->grid_value_count || !is_in(brick->largest, 0, largest))
        return false;
    const float *values = brick->values ? scene->grid_values[brick->values - 1] : NULL;
    for (int i = 0; values && i < SCENE_BRICK_VALUES; i++)
        if (!is_in(values[i], 0, brick->largest))
            return false;
    return true;
}

bool scene_check_grids(const struct scene *scene, uint64_t string_bytes, struct error *err)
{
    uint64_t bricks = 0;
    for (uint32_t i = 0; i < scene->grid_count; i++) {
        const struct scene_grid *grid = &scene->grids[i];
        if (!is_grid(grid, string_bytes) || grid->first_brick != bricks ||
            scene_grid_brick_count(grid) > scene->grid_brick_count - bricks)
            return blob_refuse(err, "density grid", i);
        uint64_t count = scene_grid_brick_count(grid);
        for (uint64_t b = bricks; b < bricks + count; b++)
            if (!check_brick(scene, &scene->grid_bricks[b], grid->largest))
                return blob_refuse(err, "brick", b);
        bricks += count;
    }
    return true;
}
