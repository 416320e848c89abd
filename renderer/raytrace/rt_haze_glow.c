/* SPDX-License-Identifier: MIT */
/* Which lamps are seen in haze, and the shares of their light that rays find. */
#include "renderer/raytrace/rt_haze_glow.h"

#include <math.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "renderer/scene/atmosphere.h"

/* Columns from a lamp: up to the first one rays find all of its light, from the last one on none.
 */
static const double NEAR = 1.25, FAR = 2.5;

/* Where a lamp is seen, in columns of the image, y up; false: behind the eye, or too far outside
 * for a column of the picture to be near. depth: of the view [m]. */
static bool find_place(const struct rt_haze_grid *grid, const struct state_light *light,
                       double place[2], double *depth)
{
    const struct camera *camera = grid->job->desc->camera;
    const struct view *view = grid->job->desc->view;
    const double half[2] = {camera->half_width, camera->half_height};
    const double size_px[2] = {view->width_px, view->height_px};
    double seen[3], side = grid->size.side_px;
    camera_to_view(camera, light->position, seen);
    *depth = seen[2];
    if (!(seen[2] > 1e-6))
        return false;
    for (int i = 0; i < 2; i++) {
        double across = camera->is_orthographic ? seen[i] : seen[i] / seen[2];
        place[i] = 0.5 * (across / half[i] + 1) * size_px[i] / side;
        if (!(place[i] > -4 && place[i] < size_px[i] / side + 4))
            return false;
    }
    return true;
}

/* How bright a lamp glows in the columns beside it, against others. */
static double find_strength(const struct rt_haze_grid *grid, const struct state_light *light,
                            double depth)
{
    const struct view_atmosphere *air = &grid->job->desc->view->atmosphere;
    const struct camera *camera = grid->job->desc->camera;
    double way[3], sum = 0, apart = camera->is_orthographic ? 1 : depth;
    vec3_sub(light->position, camera->eye, way);
    double length = vec3_length(way);
    double lost = atmosphere_depth(air, camera->eye[1], length > 0 ? way[1] / length : 0, length);
    for (int k = 0; k < 3; k++)
        sum += (double)light->color[k] * (double)air->color[k];
    return sum * atmosphere_extinction(air, light->position[1]) * exp(-lost) / apart;
}

/* The strongest come first; what finds no room among them is left to the columns. */
static void insert(struct rt_haze_grid *grid, const struct rt_haze_glow *glow)
{
    int at = grid->glow_count;
    while (at > 0 && grid->glows[at - 1].strength < glow->strength)
        at--;
    if (at == RT_HAZE_GLOWS_MOST)
        return;
    if (grid->glow_count < RT_HAZE_GLOWS_MOST)
        grid->glow_count++;
    for (int i = grid->glow_count - 1; i > at; i--)
        grid->glows[i] = grid->glows[i - 1];
    grid->glows[at] = *glow;
}

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
    const struct scene_state *state = grid->job->scene->state;
    for (size_t i = 0; i < state->light_count; i++) {
        const struct state_light *light = &state->lights[i];
        struct rt_haze_glow glow = {.light = (uint32_t)i};
        double depth;
        if (light->type == SCENE_LIGHT_DIRECTIONAL || state_light_is_area(light) ||
            !find_place(grid, light, glow.place, &depth))
            continue;
        glow.strength = find_strength(grid, light, depth);
        if (glow.strength > 0)
            insert(grid, &glow);
    }
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
