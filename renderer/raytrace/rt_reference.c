/* SPDX-License-Identifier: MIT */
/* The ground truth: rays one by one in f64, every light, pixels on a regular grid. */
#include <stdlib.h>

#include "renderer/raytrace/rt_job.h"
#include "renderer/raytrace/rt_path.h"
#include "renderer/raytrace/rt_walk.h"

struct tracer { /* one thread's share */
    struct rt_job *job;
    struct rt_walker walker;
    double eye_sigma[3]; /* rt_media_at where camera rays begin */
};

static void trace_ray(struct tracer *tracer, const struct rt_ray *ray, struct rt_pixel *pixel)
{
    struct rt_seen seen;
    if (tracer->job->desc->camera->is_orthographic)
        rt_media_at(tracer->job->scene, ray->origin, &tracer->walker.hits, tracer->eye_sigma);
    rt_walk(&tracer->walker, ray, tracer->eye_sigma, &seen);
    rt_pixel_end_seen(pixel, &seen);
}

static void trace_pixel(struct tracer *tracer, int x, int y)
{
    struct rt_job *job = tracer->job;
    int side = job->desc->samples ? (int)lround(sqrt(job->desc->samples)) : 1;
    struct rt_pixel pixel = {.covered = 0};
    for (int s = 0; s < side * side; s++) {
        struct rt_ray ray;
        int column = s % side, row = s / side;
        tracer->walker.lighting.seed = rt_job_seed(x, y, s);
        rt_job_camera_ray(job, x + (column + 0.5) / side, y + (row + 0.5) / side, &ray);
        trace_ray(tracer, &ray, &pixel);
    }
    rt_pixel_write(&pixel, job->desc->view, side * side, rt_job_pixel(job, x, y));
    atomic_fetch_add(&job->camera_rays, (uint64_t)(side * side));
}

static void trace_rows(void *worker)
{
    struct tracer *tracer = worker;
    struct rt_job *job = tracer->job;
    const struct view_tile *tile = &job->tile;
    int first = job->desc->view->first_row_px + tile->y_px; /* one of them is 0 */
    for (int y = rt_job_next(job, false); y >= 0; y = rt_job_next(job, true))
        for (int x = 0; x < tile->width_px && !rt_job_is_cancelled(job); x++)
            trace_pixel(tracer, tile->x_px + x, first + y);
    atomic_fetch_add(&job->shadow_rays, tracer->walker.lighting.shadow_rays);
    if (tracer->walker.has_overflowed || tracer->walker.lighting.has_overflowed)
        atomic_store(&job->has_overflowed, true);
}

static bool tracer_init(void *worker, struct rt_job *job, struct error *err)
{
    struct tracer *tracer = worker;
    const struct camera *camera = job->desc->camera;
    const struct rt_walker_desc desc = {.scene = job->scene,
                                        .view = job->desc->view,
                                        .environment = job->desc->environment,
                                        .begin = camera->is_orthographic ? -camera->z_near : 0,
                                        .branches = rt_walk_branches(job->desc->view, 1)};
    tracer->job = job;
    if (!rt_walker_init(&tracer->walker, &desc, err))
        return false;
    struct rt_ray ray;
    rt_job_camera_ray(job, 0, 0, &ray);
    rt_media_at(job->scene, ray.origin, &tracer->walker.hits, tracer->eye_sigma);
    return true;
}

static void tracer_finish(void *worker)
{
    rt_walker_finish(&((struct tracer *)worker)->walker);
}

const struct rt_form rt_reference_form = {
    .worker_bytes = sizeof(struct tracer),
    .init = tracer_init,
    .run = trace_rows,
    .finish = tracer_finish,
};
