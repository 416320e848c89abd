/* SPDX-License-Identifier: MIT */
/* Adaptive supersampling by contrast with the neighbours (shaders/shared/contrast.h). Edges of
 * shadows and highlights run from one pixel to the next, so a pixel whose neighbours are in the
 * same light is not looked into. */
#include "renderer/raytrace/rt_batch_refine.h"

#include <float.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_batch_light.h"
#include "renderer/raytrace/rt_whole.h"
#include "shaders/shared/contrast.h"

enum {
    GRID_PX = 16, /* a tile's side: rt_production.c */
    NEIGHBOURS = 4,
};

struct grid { /* the batch's pixels, all of one tile, by their places in it */
    uint32_t pixel[GRID_PX][GRID_PX]; /* number, and one; 0: none, or whole */
    uint32_t whole[GRID_PX][GRID_PX]; /* likewise of those that one surface fills */
    uint32_t *firsts;                 /* of each pixel's fragments, and the end of the last one's */
};

/* A surface in one pixel. */
struct look {
    int x, y;
    uint32_t mesh;
    bool is_front;
    const double *radiance;
    const float *base;
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
    for (size_t i = 0; batch->wholes && i < batch->wholes->count; i++) {
        const struct rt_whole_pixel *pixel = &batch->wholes->pixels[i];
        grid->whole[pixel->y % GRID_PX][pixel->x % GRID_PX] = pixel->is_open ? 0 : (uint32_t)i + 1;
    }
    return grid->firsts;
}

static struct look look_of_fragment(const struct rt_batch *batch, uint32_t fragment)
{
    const struct rt_fragment *own = &batch->fragments[fragment];
    const struct rt_shading *shading = &batch->shadings[fragment];
    return (struct look){own->x,       own->y, own->hit.mesh, own->hit.is_front, shading->radiance,
                         shading->base};
}

static struct look look_of_whole(const struct rt_whole_pixel *pixel)
{
    static const float base[3] = {1, 1, 1}; /* plain meshes have no textures */
    return (struct look){pixel->x, pixel->y, pixel->mesh, pixel->is_front, pixel->radiance, base};
}

static double contrast(const struct look *a, const struct look *b)
{
    double most = 0;
    for (int k = 0; k < 3; k++) {
        double x = a->radiance[k] / ((double)a->base[k] + CONTRAST_BASE_LEAST);
        double y = b->radiance[k] / ((double)b->base[k] + CONTRAST_BASE_LEAST);
        most = rt_max(most, fabs(x - y) / (x + y + DBL_MIN));
    }
    return most;
}

/* Whether contrast() is certainly not above CONTRAST_LEAST, told without a division, of surfaces
 * that have one base. */
static bool is_clearly_even(const double a[3], const double b[3])
{
    bool is_even = true;
    for (int k = 0; k < 3; k++)
        is_even &= fabs(a[k] - b[k]) <= CONTRAST_LEAST * (1 - 1e-9) * (a[k] + b[k]);
    return is_even;
}

static bool are_alike(const struct look *a, const struct look *b)
{
    return a->mesh == b->mesh && a->is_front == b->is_front;
}

/* Between the surface and those of its mesh in another pixel that look most like it; 0 where there
 * are none. */
static double contrast_with(const struct rt_batch *batch, const struct grid *grid,
                            const struct look *own, uint32_t pixel)
{
    double least = INFINITY;
    for (uint32_t i = grid->firsts[pixel]; i < grid->firsts[pixel + 1]; i++) {
        const struct look other = look_of_fragment(batch, i);
        if (batch->fragments[i].is_opaque && are_alike(own, &other))
            least = rt_min(least, contrast(own, &other));
    }
    return isfinite(least) ? least : 0;
}

/* Brings the place of a neighbour in the tile. False: it is outside. */
static bool find_neighbour(int x, int y, int number, int at[2])
{
    static const int ways[NEIGHBOURS][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
    at[0] = x % GRID_PX + ways[number][0];
    at[1] = y % GRID_PX + ways[number][1];
    return at[0] >= 0 && at[1] >= 0 && at[0] < GRID_PX && at[1] < GRID_PX;
}

/* Whether all neighbours are whole, and clearly even with it where they show its mesh: most are. */
static bool is_amid_even_ones(const struct rt_batch *batch, const struct grid *grid,
                              const struct rt_whole_pixel *own)
{
    for (int i = 0, at[2]; i < NEIGHBOURS; i++) {
        if (!find_neighbour(own->x, own->y, i, at))
            continue;
        if (grid->pixel[at[1]][at[0]])
            return false;
        const uint32_t whole = grid->whole[at[1]][at[0]];
        if (!whole)
            continue;
        const struct rt_whole_pixel *other = &batch->wholes->pixels[whole - 1];
        if (other->mesh == own->mesh && other->is_front == own->is_front &&
            !is_clearly_even(own->radiance, other->radiance))
            return false;
    }
    return true;
}

static bool must_refine(const struct rt_batch *batch, const struct grid *grid,
                        const struct look *own)
{
    for (int i = 0, at[2]; i < NEIGHBOURS; i++) {
        if (!find_neighbour(own->x, own->y, i, at))
            continue;
        const uint32_t pixel = grid->pixel[at[1]][at[0]], whole = grid->whole[at[1]][at[0]];
        if (pixel && contrast_with(batch, grid, own, pixel - 1) > CONTRAST_LEAST)
            return true;
        if (!whole)
            continue;
        const struct look other = look_of_whole(&batch->wholes->pixels[whole - 1]);
        if (are_alike(own, &other) && contrast(own, &other) > CONTRAST_LEAST)
            return true;
    }
    return false;
}

static bool must_refine_fragment(const struct rt_batch *batch, const struct grid *grid,
                                 uint32_t fragment)
{
    const struct rt_fragment *own = &batch->fragments[fragment];
    const struct look look = look_of_fragment(batch, fragment);
    return own->is_opaque && own->sample_count >= 2 && must_refine(batch, grid, &look);
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
            if (must_refine_fragment(batch, &grid, i))
                ok = split(batch, i, p * (size_t)batch->desc.samples);
    for (size_t i = 0; ok && batch->wholes && i < batch->wholes->count; i++) {
        struct rt_whole_pixel *pixel = &batch->wholes->pixels[i];
        const struct look own = look_of_whole(pixel);
        if (pixel->is_open)
            continue;
        if (!is_amid_even_ones(batch, &grid, pixel) && must_refine(batch, &grid, &own))
            ok = rt_wholes_split(batch, pixel);
    }
    free(grid.firsts);
    if (ok)
        rt_batch_light(batch, lit);
    return ok;
}
