/* SPDX-License-Identifier: MIT */
/* Bricks of density grids with the voxels around their cells. */
#include "renderer/scene/grid_texels.h"

#include <stdlib.h>

#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

static void find_along(const uint32_t size[3], uint32_t along[3])
{
    for (int k = 0; k < 3; k++)
        along[k] = size[k] > 1 ? (size[k] - 1 + 7) / 8 : 1;
}

static uint64_t count_bricks(const uint32_t size[3])
{
    uint32_t along[3];
    find_along(size, along);
    return (uint64_t)along[0] * along[1] * along[2];
}

static void place_brick(const uint32_t along[3], uint64_t index, uint32_t at[3])
{
    at[0] = (uint32_t)(index % along[0]);
    at[1] = (uint32_t)(index / along[0] % along[1]);
    at[2] = (uint32_t)(index / along[0] / along[1]);
}

/* Whether some of the bricks that a brick's voxels are stored in has values. */
static bool may_be_filled(const struct density_grid *grid, const uint32_t at[3])
{
    for (int i = 0; i < 8; i++) {
        uint32_t b[3];
        for (int k = 0; k < 3; k++) {
            b[k] = at[k] + (i >> k & 1);
            b[k] = b[k] < grid->bricks_along[k] ? b[k] : grid->bricks_along[k] - 1;
        }
        size_t index = b[0] + grid->bricks_along[0] * (b[1] + (size_t)grid->bricks_along[1] * b[2]);
        if (grid->bricks[index].values)
            return true;
    }
    return false;
}

static uint64_t count_filled(const struct density_grid *grid)
{
    uint32_t along[3], at[3];
    uint64_t count = 0, bricks = count_bricks(grid->size);
    find_along(grid->size, along);
    for (uint64_t i = 0; i < bricks; i++) {
        place_brick(along, i, at);
        count += may_be_filled(grid, at);
    }
    return count;
}

/* The bricks of all grids of a scene that may have a value other than 0. */
static uint64_t count_all(const struct scene *scene)
{
    uint64_t count = 0;
    for (uint32_t i = 0; i < scene->grid_count; i++) {
        const struct density_grid grid = density_grid_of(scene, &scene->grids[i]);
        count += count_filled(&grid);
    }
    return count;
}

/* Only grids whose bricks are too many where all have values are looked into: this is asked for
 * each frame. */
static bool has_too_many_bricks(const struct scene *scene)
{
    uint64_t bricks = 0;
    for (uint32_t i = 0; i < scene->grid_count; i++)
        bricks += count_bricks(scene->grids[i].size);
    return bricks > GRID_BRICKS_MAX && count_all(scene) > GRID_BRICKS_MAX;
}

const char *grid_texels_excess(const struct scene_state *state)
{
    uint64_t sides = 0;
    for (size_t i = 0; i < state->grid_count; i++)
        for (int k = 0; k < 3; k++)
            sides += state->grids[i].values.size[k];
    if (state->grid_count > GRIDS_MAX)
        return "more than 8 density grids are seen";
    if (sides > GRID_SIDES_MAX)
        return "the sides of density grids that are seen are more than 4,096 voxels together";
    if (state->grid_count && has_too_many_bricks(state->scene))
        return "density grids have more than 131,072 bricks of 512 voxels with values";
    return NULL;
}

/* Whether any value is not 0. */
static bool fill_brick(const struct density_grid *grid, const uint32_t at[3], float (*pairs)[2])
{
    bool is_filled = false;
    for (int i = 0; i < GRID_BRICK_PAIRS; i++) {
        int64_t x = 8 * (int64_t)at[0] + i % 8, y = 8 * (int64_t)at[1] + i / 8 % 9,
                z = 8 * (int64_t)at[2] + i / 72;
        pairs[i][0] = density_grid_voxel(grid, x, y, z);
        pairs[i][1] = density_grid_voxel(grid, x + 1, y, z);
        is_filled = is_filled || pairs[i][0] != 0 || pairs[i][1] != 0;
    }
    return is_filled;
}

static void fill_grid(struct grid_texels *texels, const struct density_grid *grid)
{
    uint32_t along[3], at[3];
    uint64_t bricks = count_bricks(grid->size);
    find_along(grid->size, along);
    for (uint64_t i = 0; i < bricks; i++) {
        place_brick(along, i, at);
        bool is_filled =
            may_be_filled(grid, at) && fill_brick(grid, at, texels->pairs[texels->filled_count]);
        texels->filled_count += is_filled;
        texels->bricks[texels->brick_count++] = is_filled ? (uint32_t)texels->filled_count : 0;
    }
}

bool grid_texels_init(struct grid_texels *texels, const struct scene *scene, struct error *err)
{
    uint64_t filled = count_all(scene), bricks = 0;
    *texels = (struct grid_texels){.brick_count = 0};
    for (uint32_t i = 0; i < scene->grid_count; i++)
        bricks += count_bricks(scene->grids[i].size);
    texels->first_brick = calloc(scene->grid_count + 1, sizeof *texels->first_brick);
    texels->bricks = calloc(bricks + 1, sizeof *texels->bricks);
    texels->pairs = calloc(filled + 1, sizeof *texels->pairs);
    if (!texels->first_brick || !texels->bricks || !texels->pairs) {
        grid_texels_finish(texels);
        return error_set(err, ERROR_NO_MEMORY, "%llu bricks of density grids",
                         (unsigned long long)filled);
    }
    for (uint32_t i = 0; i < scene->grid_count; i++) {
        const struct density_grid grid = density_grid_of(scene, &scene->grids[i]);
        texels->first_brick[i] = (uint32_t)texels->brick_count;
        fill_grid(texels, &grid);
    }
    return true;
}

void grid_texels_finish(struct grid_texels *texels)
{
    free(texels->first_brick);
    free(texels->bricks);
    free(texels->pairs);
    *texels = (struct grid_texels){.brick_count = 0};
}
