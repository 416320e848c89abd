/* SPDX-License-Identifier: MIT */
/* The shares of the light of lamps in haze that rays find. */
#include "renderer/raytrace/rt_haze_glow.h"

#include <math.h>
#include <stdlib.h>

/* Columns from a lamp: up to the first one rays find all of its light, from the last one on none.
 */
static const double NEAR = 1.25, FAR = 2.5;

static bool make_room(struct rt_haze_grid *grid, struct rt_haze_glow *glow, struct error *err)
{
    enum { SIDE = RT_HAZE_GLOW_SIDE };
    size_t slices = (size_t)grid->size.slices;
    glow->first_x = (int)floor(glow->place[0]) - (int)FAR - 1;
    glow->first_y = (int)floor(glow->place[1]) - (int)FAR - 1;
    glow->lights = calloc(slices * SIDE * SIDE, ATMOSPHERE_SLICE_BYTES);
    glow->sums = calloc(slices * (SIDE - 1) * (SIDE - 1), ATMOSPHERE_SLICE_BYTES);
    return (glow->lights && glow->sums) ||
           error_set(err, ERROR_NO_MEMORY, "haze around %d lamps", grid->glow_count);
}

bool rt_haze_glows_find(struct rt_haze_grid *grid, struct error *err)
{
    struct haze_glow glows[HAZE_GLOWS_MOST];
    const struct rt_job *job = grid->job;
    grid->glow_count = haze_glows_find(job->desc->view, job->scene->state, job->desc->camera,
                                       grid->size.side_px, glows);
    for (int i = 0; i < grid->glow_count; i++)
        grid->glows[i] = (struct rt_haze_glow){.light = glows[i].light,
                                               .place = {glows[i].place[0], glows[i].place[1]}};
    for (int i = 0; i < grid->glow_count; i++)
        if (!make_room(grid, &grid->glows[i], err))
            return false;
    return true;
}

void rt_haze_glows_finish(struct rt_haze_grid *grid)
{
    for (int i = 0; i < grid->glow_count; i++) {
        free(grid->glows[i].lights);
        free(grid->glows[i].sums);
    }
    grid->glow_count = 0;
}

void rt_haze_glows_take(struct rt_haze_grid *grid, uint32_t light, size_t slice,
                        const float added[3])
{
    const size_t columns = (size_t)grid->size.columns, rows = (size_t)grid->size.rows;
    const int column = (int)(slice % columns) + grid->size.first_x;
    const int row = (int)(slice / columns % rows) + grid->size.first_y;
    for (int i = 0; i < grid->glow_count; i++) {
        const struct rt_haze_glow *glow = &grid->glows[i];
        int x = column - glow->first_x, y = row - glow->first_y;
        if (glow->light != light || x < 0 || y < 0 || x >= RT_HAZE_GLOW_SIDE ||
            y >= RT_HAZE_GLOW_SIDE)
            continue;
        size_t layer = slice / (columns * rows) * RT_HAZE_GLOW_SIDE * RT_HAZE_GLOW_SIDE;
        for (int k = 0; k < 3; k++)
            glow->lights[3 * (layer + (size_t)(y * RT_HAZE_GLOW_SIDE + x)) + (size_t)k] += added[k];
    }
}

void rt_haze_glows_sum_up(struct rt_haze_grid *grid)
{
    const int columns[2] = {RT_HAZE_GLOW_SIDE, RT_HAZE_GLOW_SIDE};
    for (int i = 0; i < grid->glow_count; i++)
        rt_haze_sum_up(grid->glows[i].lights, columns, grid->size.slices, grid->glows[i].sums);
}

/* The share of a lamp's light that the sight's ray finds by itself. */
static double find_share(const struct rt_haze_sight *sight, const struct rt_haze_glow *glow)
{
    double side = sight->grid->size.side_px;
    double away =
        hypot(sight->place[0] / side - glow->place[0], sight->place[1] / side - glow->place[1]);
    double x = fmin(fmax((FAR - away) / (FAR - NEAR), 0), 1);
    return x * x * (3 - 2 * x);
}

void rt_haze_glows_leave(const struct rt_haze_sight *sight, double z, double scattered[3])
{
    for (int i = 0; i < sight->grid->glow_count; i++) {
        const struct rt_haze_glow *glow = &sight->grid->glows[i];
        const struct rt_haze_sums sums = {glow->sums,
                                          {RT_HAZE_GLOW_SIDE - 1, RT_HAZE_GLOW_SIDE - 1},
                                          {glow->first_x, glow->first_y}};
        double share = find_share(sight, glow), own[3];
        if (!(share > 0))
            continue;
        rt_haze_sums_find(&sums, sight, z, own);
        for (int k = 0; k < 3; k++)
            scattered[k] -= share * own[k];
    }
}

void rt_haze_glows_add(const struct rt_haze_sight *sight, struct rt_lighting *lighting,
                       const struct rt_haze_way *way, const double share[3], double radiance[3])
{
    for (int i = 0; i < sight->grid->glow_count; i++) {
        const struct rt_haze_glow *glow = &sight->grid->glows[i];
        double part = find_share(sight, glow);
        const double seen[3] = {share[0] * part, share[1] * part, share[2] * part};
        if (part > 0)
            rt_haze_add_lamp(lighting, way, seen, glow->light, radiance);
    }
}
