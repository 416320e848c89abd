/* SPDX-License-Identifier: MIT */
/* Adaptive supersampling by contrast with the neighbours (shaders/shared/contrast.h). Edges of
 * shadows and highlights run from one pixel to the next, so a pixel whose neighbours are in the
 * same light is not looked into. */
#include "renderer/raytrace/rt_batch_refine.h"

#include <float.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_batch_light.h"
#include "shaders/shared/contrast.h"

enum {
    GRID_PX = 16, /* a tile's side: rt_production.c */
    NEIGHBOURS = 4,
};

struct grid { /* the batch's pixels, all of one tile, by their places in it */
    uint32_t pixel[GRID_PX][GRID_PX]; /* number, and one; 0: none */
    uint32_t *firsts;                 /* of each pixel's fragments, and the end of the last one's */
};

/* Fragments lie in the order of their pixels. */
static bool grid_init(struct grid *grid, const struct rt_batch *batch)
{
    *grid = (struct grid){.firsts = calloc(batch->pixel_count + 1, sizeof *grid->firsts)};
    uint32_t fragment = 0;
    for (size_t p = 0; grid->firsts && p < batch->pixel_count; p++) {
        const int *at = batch->pixels[p];
        grid->pixel[at[1] % GRID_PX][at[0] % GRID_PX] = (uint32_t)p + 1;
        grid->firsts[p] = fragment;
        while (fragment < batch->fragment_count && batch->fragments[fragment].x == at[0] &&
               batch->fragments[fragment].y == at[1])
            fragment++;
        grid->firsts[p + 1] = fragment;
    }
    return grid->firsts;
}

static double contrast(const struct rt_shading *a, const struct rt_shading *b)
{
    double most = 0;
    for (int k = 0; k < 3; k++) {
        double x = a->radiance[k] / ((double)a->base[k] + CONTRAST_BASE_LEAST);
        double y = b->radiance[k] / ((double)b->base[k] + CONTRAST_BASE_LEAST);
        most = rt_max(most, fabs(x - y) / (x + y + DBL_MIN));
    }
    return most;
}

/* Between the fragment and those of its mesh in another pixel that look most like it; 0 where there
 * are none. */
static double contrast_with(const struct rt_batch *batch, const struct grid *grid,
                            uint32_t fragment, uint32_t pixel)
{
    const struct rt_fragment *own = &batch->fragments[fragment];
    double least = INFINITY;
    for (uint32_t i = grid->firsts[pixel]; i < grid->firsts[pixel + 1]; i++) {
        const struct rt_fragment *other = &batch->fragments[i];
        if (i != fragment && other->is_opaque && other->hit.mesh == own->hit.mesh &&
            other->hit.is_front == own->hit.is_front)
            least = rt_min(least, contrast(&batch->shadings[fragment], &batch->shadings[i]));
    }
    return isfinite(least) ? least : 0;
}

static bool must_refine(const struct rt_batch *batch, const struct grid *grid, uint32_t fragment)
{
    static const int ways[NEIGHBOURS][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
    const struct rt_fragment *own = &batch->fragments[fragment];
    if (!own->is_opaque || own->sample_count < 2)
        return false;
    for (int i = 0; i < NEIGHBOURS; i++) {
        int x = own->x % GRID_PX + ways[i][0], y = own->y % GRID_PX + ways[i][1];
        uint32_t pixel = x >= 0 && y >= 0 && x < GRID_PX && y < GRID_PX ? grid->pixel[y][x] : 0;
        if (pixel && contrast_with(batch, grid, fragment, pixel - 1) > CONTRAST_LEAST)
            return true;
    }
    return false;
}

/* Gives each sample that ends on the fragment one of its own. */
static bool split(struct rt_batch *batch, uint32_t fragment, size_t first_sample)
{
    if (!rt_batch_reserve_fragments(batch, batch->fragment_count + (size_t)batch->desc.samples))
        return false;
    for (size_t s = first_sample; s < first_sample + (size_t)batch->desc.samples; s++) {
        uint32_t begin = s ? batch->sample_ends[s - 1] : 0, end = batch->sample_ends[s];
        struct rt_step *step = &batch->steps[end - 2]; /* before the background */
        if (end - begin < 2 || step->fragment != fragment)
            continue;
        const struct rt_fragment *shared = &batch->fragments[fragment];
        struct rt_fragment *own = &batch->fragments[batch->fragment_count];
        *own = (struct rt_fragment){.hit = batch->points[s].hit,
                                    .x = shared->x,
                                    .y = shared->y,
                                    .part = shared->part,
                                    .is_opaque = true};
        rt_fragment_add(own, &batch->points[s]);
        step->fragment = (uint32_t)batch->fragment_count++;
    }
    return true;
}

bool rt_batch_refine(struct rt_batch *batch)
{
    struct grid grid;
    uint32_t lit = (uint32_t)batch->fragment_count;
    if (batch->is_cancelled)
        return true;
    bool ok = grid_init(&grid, batch);
    for (size_t p = 0; ok && p < batch->pixel_count; p++)
        for (uint32_t i = grid.firsts[p]; ok && i < grid.firsts[p + 1]; i++)
            if (must_refine(batch, &grid, i))
                ok = split(batch, i, p * (size_t)batch->desc.samples);
    free(grid.firsts);
    if (ok)
        rt_batch_light(batch, lit);
    return ok;
}
