/* SPDX-License-Identifier: MIT */
/* The grid: how far its columns are seen, their sums, and what rays look up. */
#include "renderer/raytrace/rt_haze_grid.h"

#include <math.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_haze.h"
#include "renderer/raytrace/rt_haze_glow.h"
#include "renderer/raytrace/rt_haze_lights.h"
#include "renderer/raytrace/rt_packet.h"
#include "renderer/scene/atmosphere.h"

static const double GRID_BYTES_MOST = 256e6; /* of the whole picture; columns are wider beyond */
static const double OPEN_LEAST = 1e-25;      /* nothing behind such haze is seen */

/* ---- how far columns are seen ---- */

struct looker { /* one thread's */
    struct rt_job *job;
    struct rt_haze_grid *grid;
    struct rt_packet packet;
    uint64_t rays;
};

/* Where a ray of this job begins, in depths of the view. */
static double first_depth(const struct rt_job *job)
{
    const struct camera *camera = job->desc->camera;
    return camera->is_orthographic ? camera->z_near : 0;
}

static float look_along(struct looker *looker, int column, int row)
{
    enum { SIDE = 4 };
    const struct atmosphere_grid *size = &looker->grid->size;
    struct rt_packet *packet = &looker->packet;
    double farthest = 0;
    packet->count = SIDE * SIDE;
    for (int i = 0; i < packet->count; i++) {
        int across = i % SIDE, up = i / SIDE;
        double x = (size->first_x + column + (across + 0.5) / SIDE) * size->side_px;
        double y = (size->first_y + row + (up + 0.5) / SIDE) * size->side_px;
        rt_job_camera_ray(looker->job, x, looker->job->desc->view->height_px - y, &packet->rays[i]);
    }
    rt_packet_collect(packet);
    for (int i = 0; i < packet->count; i++) {
        const struct rt_hits *hits = &packet->hits[i];
        const struct rt_hit *last = hits->count ? &hits->hits[hits->count - 1] : NULL;
        farthest = fmax(farthest, last && last->is_opaque ? last->t + first_depth(looker->job)
                                                          : 2 * ATMOSPHERE_FAR);
    }
    looker->rays += (uint64_t)packet->count;
    return (float)farthest;
}

static void look_along_rows(void *worker)
{
    struct looker *looker = worker;
    struct rt_job *job = looker->job;
    const struct atmosphere_grid *size = &looker->grid->size;
    for (int row = rt_job_next(job, false); row >= 0; row = rt_job_next(job, true))
        for (int column = 0; column < size->columns; column++)
            looker->grid->reaches[row * size->columns + column] = look_along(looker, column, row);
    atomic_fetch_add(&job->camera_rays, looker->rays);
}

static bool looker_init(void *worker, struct rt_job *job, struct error *err)
{
    struct looker *looker = worker;
    looker->job = job;
    looker->grid = ((const struct rt_haze_making *)job->shared)->grid;
    return rt_packet_init(&looker->packet, job->scene, err);
}

static void looker_finish(void *worker)
{
    rt_packet_finish(&((struct looker *)worker)->packet);
}

static const struct rt_form reach_form = {.worker_bytes = sizeof(struct looker),
                                          .init = looker_init,
                                          .run = look_along_rows,
                                          .finish = looker_finish};

/* ---- sums ---- */

/* The points of the four columns lie in the four quarters of a slice. */
static void sum_corner(const float *lights, const int columns[2], int slices, const int corner[2],
                       float *sums)
{
    const size_t across = (size_t)columns[0], up = (size_t)columns[1];
    const size_t x = (size_t)corner[0], y = (size_t)corner[1];
    float sum[3] = {0, 0, 0};
    for (size_t slice = 0; slice < (size_t)slices; slice++) {
        const float *at = lights + 3 * ((slice * up + y) * across + x);
        const float *above = at + 3 * across;
        size_t to = 3 * ((slice * (up - 1) + y) * (across - 1) + x);
        for (size_t k = 0; k < 3; k++) {
            sum[k] += 0.25f * (at[k] + at[k + 3] + above[k] + above[k + 3]);
            sums[to + k] = sum[k];
        }
    }
}

void rt_haze_sum_up(const float *lights, const int columns[2], int slices, float *sums)
{
    for (int y = 0; y + 1 < columns[1]; y++)
        for (int x = 0; x + 1 < columns[0]; x++)
            sum_corner(lights, columns, slices, (const int[]){x, y}, sums);
}

static bool sum_up(struct rt_haze_grid *grid, struct error *err)
{
    size_t corners = (size_t)atmosphere_corners(&grid->size);
    grid->sums = calloc(corners * (size_t)grid->size.slices, ATMOSPHERE_SLICE_BYTES);
    if (!grid->sums)
        return error_set(err, ERROR_NO_MEMORY, "haze in %zu columns", corners);
    rt_haze_sum_up(grid->lights, (const int[]){grid->size.columns, grid->size.rows},
                   grid->size.slices, grid->sums);
    rt_haze_glows_sum_up(grid);
    free(grid->lights);
    grid->lights = NULL;
    return true;
}

/* ---- the grid ---- */

/* One step of the work, by the threads of the job. */
static bool run_step(struct rt_job *job, const struct rt_haze_making *making,
                     const struct rt_form *form, int units, struct error *err)
{
    struct raytrace_desc desc = *job->desc;
    struct rt_job step = {
        .desc = &desc, .scene = job->scene, .shared = making, .unit_count = units};
    desc.advance = NULL; /* which tells of pixels */
    bool ok = rt_job_run(&step, form, err);
    job->paused_ms += step.paused_ms;
    atomic_fetch_add(&job->camera_rays, atomic_load(&step.camera_rays));
    atomic_fetch_add(&job->shadow_rays, atomic_load(&step.shadow_rays));
    if (atomic_load(&step.is_cancelled))
        atomic_store(&job->is_cancelled, true);
    if (atomic_load(&step.has_overflowed))
        atomic_store(&job->has_overflowed, true);
    return ok;
}

/* By the whole picture, so that tiles agree. */
static int choose_side_px(const struct view *view)
{
    struct camera_window whole = camera_window_whole(view->width_px, view->height_px);
    struct atmosphere_grid grid = atmosphere_grid_of(view, &whole);
    double bytes = (double)atmosphere_columns(&grid) * grid.slices * 2 * ATMOSPHERE_SLICE_BYTES;
    int side = grid.side_px;
    while (bytes > GRID_BYTES_MOST) {
        bytes /= 4;
        side *= 2;
    }
    return side;
}

bool rt_haze_grid_place(struct rt_haze_grid *grid, const struct rt_job *job,
                        const struct atmosphere_grid *size, struct error *err)
{
    const struct raytrace_desc *desc = job->desc;
    grid->job = job;
    grid->size = *size;
    grid->slices = atmosphere_slices_of(desc->view, desc->state, desc->camera);
    size_t columns = (size_t)atmosphere_columns(size), slices = (size_t)size->slices;
    grid->borders = calloc(slices + 1, sizeof *grid->borders);
    grid->reaches = calloc(columns, sizeof *grid->reaches);
    grid->lights = calloc(columns * slices, ATMOSPHERE_SLICE_BYTES);
    if (!grid->borders || !grid->reaches || !grid->lights)
        return error_set(err, ERROR_NO_MEMORY, "haze in %zu columns", columns);
    for (int k = 0; k <= size->slices; k++)
        grid->borders[k] = atmosphere_border(&grid->slices, size->slices, k);
    return true;
}

bool rt_haze_grid_light(struct rt_haze_grid *grid, struct rt_job *job,
                        const struct rt_light_set *light_set, struct error *err)
{
    const struct rt_haze_making making = {.grid = grid, .light_set = light_set};
    return run_step(job, &making, &reach_form, grid->size.rows, err) &&
           run_step(job, &making, &rt_haze_lights_form, rt_haze_blocks(grid), err);
}

bool rt_haze_grid_init(struct rt_haze_grid *grid, struct rt_job *job,
                       const struct rt_light_set *light_set, struct error *err)
{
    const struct view *view = job->desc->view;
    struct camera_window window = camera_window_whole(view->width_px, view->height_px);
    double around[3];
    window.x = job->tile.x_px;
    window.y = job->tile.y_px;
    window.width = job->tile.width_px;
    window.height = job->tile.height_px;
    const struct atmosphere_grid size =
        atmosphere_grid_of_side(view, &window, choose_side_px(view));
    grid->offset = 0.5;
    if (!rt_haze_grid_place(grid, job, &size, err))
        return false;
    if (!rt_haze_glows_find(grid, err))
        return false;
    rt_haze_around(job->scene, job->desc->environment, around);
    for (int k = 0; k < 3; k++)
        grid->around[k] = (float)around[k];
    return job->scene->state->light_count == 0 ||
           (rt_haze_grid_light(grid, job, light_set, err) && sum_up(grid, err));
}

void rt_haze_grid_finish(struct rt_haze_grid *grid)
{
    free(grid->borders);
    free(grid->reaches);
    free(grid->lights);
    free(grid->sums);
    rt_haze_glows_finish(grid);
    *grid = (struct rt_haze_grid){0};
}

double rt_haze_column(const struct rt_haze_grid *grid, int column, int row, double origin[3],
                      double way[3])
{
    const struct atmosphere_grid *size = &grid->size;
    struct rt_ray ray;
    rt_job_camera_ray(
        grid->job, (size->first_x + column + 0.5) * size->side_px,
        grid->job->desc->view->height_px - (size->first_y + row + 0.5) * size->side_px, &ray);
    double per_m = vec3_length(ray.direction);
    for (int k = 0; k < 3; k++) {
        way[k] = ray.direction[k] / per_m;
        origin[k] = ray.origin[k] - first_depth(grid->job) * ray.direction[k];
    }
    return per_m;
}

/* ---- looking through it ---- */

/* How far a depth is in its slice, 0 to 1: of the last slice, as what it lets through falls. */
static double part_of_slice(const struct rt_haze_sight *sight, int slice, double z)
{
    const struct rt_haze_grid *grid = sight->grid;
    const struct view_atmosphere *air = &grid->job->desc->view->atmosphere;
    double near = grid->borders[slice], far = grid->borders[slice + 1];
    if (slice < grid->size.slices - 1)
        return (z - near) / (far - near);
    double climb = sight->ray->direction[1] / sight->unit_m;
    double height = sight->origin_m + climb * near * sight->unit_m;
    double all = atmosphere_depth(air, height, climb, (far - near) * sight->unit_m);
    double own = atmosphere_depth(air, height, climb, (z - near) * sight->unit_m);
    return all > 0 ? expm1(-own) / expm1(-all) : 0;
}

void rt_haze_sums_find(const struct rt_haze_sums *sums, const struct rt_haze_sight *sight, double z,
                       double out[3])
{
    const struct rt_haze_grid *grid = sight->grid;
    const int *corners = sums->corners;
    int low[2];
    double f[2];
    for (int i = 0; i < 2; i++) {
        double place = fmax(sight->place[i] / grid->size.side_px - (sums->first[i] + 1), 0);
        low[i] = place < corners[i] - 1 ? (int)place : corners[i] - 1;
        f[i] = fmin(place - low[i], 1);
    }
    int slice = atmosphere_slice(&grid->slices, grid->size.slices, z);
    double part = fmin(fmax(part_of_slice(sight, slice, z), 0), 1);
    out[0] = out[1] = out[2] = 0;
    for (int corner = 0; corner < 4; corner++) {
        int side[2] = {corner & 1, corner >> 1}, own[2];
        for (int i = 0; i < 2; i++)
            own[i] = low[i] + side[i] < corners[i] ? low[i] + side[i] : corners[i] - 1;
        double weight = (side[0] ? f[0] : 1 - f[0]) * (side[1] ? f[1] : 1 - f[1]);
        size_t layer = (size_t)corners[0] * (size_t)corners[1];
        size_t at = (size_t)slice * layer + (size_t)own[1] * (size_t)corners[0] + (size_t)own[0];
        for (size_t k = 0; k < 3; k++) {
            double end = (double)sums->sums[3 * at + k];
            double begin = slice ? (double)sums->sums[3 * (at - layer) + k] : 0;
            out[k] += weight * (begin + part * (end - begin));
        }
    }
}

static void find_scattered(const struct rt_haze_sight *sight, double z, double out[3])
{
    const struct rt_haze_grid *grid = sight->grid;
    const struct atmosphere_grid *size = &grid->size;
    const struct rt_haze_sums sums = {
        grid->sums, {size->columns - 1, size->rows - 1}, {size->first_x, size->first_y}};
    out[0] = out[1] = out[2] = 0;
    if (!grid->sums)
        return;
    rt_haze_sums_find(&sums, sight, z, out);
    rt_haze_glows_leave(sight, z, out);
}

void rt_haze_sight_begin(struct rt_haze_sight *sight, const struct rt_haze_grid *grid,
                         const struct rt_ray *ray, const double place[2])
{
    const struct rt_job *job = grid->job;
    *sight = (struct rt_haze_sight){.grid = grid,
                                    .ray = ray,
                                    .place = {place[0], job->desc->view->height_px - place[1]},
                                    .unit_m = vec3_length(ray->direction),
                                    .open = 1};
    sight->origin_m = ray->origin[1] - first_depth(job) * ray->direction[1] + job->scene->origin[1];
}

/* Of light that comes evenly from a way of this optical depth, what passes: the mean. */
static double mean_passing(double depth)
{
    return depth > 1e-6 ? -expm1(-depth) / depth : 1;
}

void rt_haze_sight_pass(struct rt_haze_sight *sight, double t, const double *sigma, double share[3])
{
    const struct rt_haze_grid *grid = sight->grid;
    const struct view_atmosphere *air = &grid->job->desc->view->atmosphere;
    double z = fmin(t + first_depth(grid->job), ATMOSPHERE_FAR), scattered[3];
    if (!(z > sight->z))
        return;
    double climb = sight->ray->direction[1] / sight->unit_m,
           length = (z - sight->z) * sight->unit_m;
    double height = sight->origin_m + climb * sight->z * sight->unit_m;
    double depth = atmosphere_depth(air, height, climb, length), left = exp(-depth);
    find_scattered(sight, z, scattered);
    for (int k = 0; k < 3; k++) {
        double lost = (double)grid->around[k] * -expm1(-depth);
        if (sight->open > OPEN_LEAST)
            lost += fmax(scattered[k] - sight->scattered[k], 0) / sight->open;
        double passing = sigma ? mean_passing(fmax(sigma[k], 0) * length) : 1;
        sight->light[k] += share[k] * passing * (double)air->color[k] * lost;
        sight->scattered[k] = scattered[k];
        share[k] *= left;
    }
    sight->open *= left;
    sight->z = z;
}
