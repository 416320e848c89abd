/* SPDX-License-Identifier: MIT */
/* The ground truth: rays one by one in f64, every light, pixels on a regular grid. */
#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_job.h"
#include "renderer/raytrace/rt_light.h"
#include "renderer/raytrace/rt_path.h"
#include "renderer/raytrace/rt_pixel.h"

struct tracer { /* one thread's share */
    struct rt_job *job;
    struct rt_lighting lighting;
    struct rt_hits hits;
    double eye_sigma[3]; /* rt_media_at where camera rays begin */
};

/* Front to back over the ordered layers: docs/explanation/shading.md section 2. */
static void trace_ray(struct tracer *tracer, const struct rt_ray *ray, struct rt_pixel *pixel)
{
    const struct rt_job *job = tracer->job;
    double layers[3] = {0}, through[3] = {1, 1, 1}, behind[4];
    rt_pixel_background(job->desc->view, job->desc->environment, ray->direction, behind);
    if (job->desc->camera->is_orthographic)
        rt_media_at(job->scene, ray->origin, &tracer->hits, tracer->eye_sigma);
    rt_scene_collect(job->scene, ray, &tracer->hits);
    tracer->lighting.has_overflowed |= tracer->hits.has_overflowed;
    double view[3] = {-ray->direction[0], -ray->direction[1], -ray->direction[2]};
    vec3_normalize(view);
    double t = 0, sigma[3], range[2];
    rt_scene_kept_range(job->scene, ray, range);
    memcpy(sigma, tracer->eye_sigma, sizeof sigma);
    for (size_t i = 0; i < tracer->hits.count; i++) {
        const struct rt_hit *hit = &tracer->hits.hits[i];
        rt_media_pass(sigma, ray, range, t, hit->t, through);
        rt_media_cross(job->scene, hit, sigma);
        t = hit->t;
        if (hit->is_left_unseen)
            rt_filter_unseen(job->scene, hit, NULL, view, through);
        if (hit->is_hidden)
            continue;
        enum state_class class_ = job->scene->meshes[hit->mesh].item->class_;
        bool is_opaque = hit->is_opaque;
        if (class_ == STATE_MASKED && !is_opaque)
            continue;
        struct rt_surface surface;
        double radiance[3], filter[3], point[3];
        rt_surface_evaluate(job->scene, hit, NULL, &surface);
        for (int k = 0; k < 3; k++)
            point[k] = ray->origin[k] + ray->direction[k] * hit->t;
        if (is_opaque)
            surface.alpha = 1, surface.transmission = 0;
        rt_radiance(&tracer->lighting, hit, &surface, point, view, radiance);
        if (is_opaque) {
            for (int k = 0; k < 3; k++)
                behind[k] = radiance[k];
            behind[3] = 1;
            break;
        }
        rt_surface_view_filter(&surface, view, hit->is_front, filter);
        for (int k = 0; k < 3; k++) {
            layers[k] += through[k] * surface.alpha * radiance[k];
            through[k] *= filter[k];
        }
    }
    rt_pixel_end_sample(pixel, layers, through, behind);
}

static void trace_pixel(struct tracer *tracer, int x, int y)
{
    struct rt_job *job = tracer->job;
    int side = job->desc->samples_per_side ? job->desc->samples_per_side : 1;
    struct rt_pixel pixel = {.covered = 0};
    for (int s = 0; s < side * side; s++) {
        struct rt_ray ray;
        int column = s % side, row = s / side;
        tracer->lighting.seed = rt_job_seed(x, y, s);
        rt_job_camera_ray(job, x + (column + 0.5) / side, y + (row + 0.5) / side, &ray);
        trace_ray(tracer, &ray, &pixel);
    }
    float *out =
        (float *)job->image->pixels + 4 * ((size_t)y * (size_t)job->image->width_px + (size_t)x);
    rt_pixel_write(&pixel, job->desc->view, side * side, out);
    atomic_fetch_add(&job->camera_rays, (uint64_t)(side * side));
}

static void trace_rows(void *worker)
{
    struct tracer *tracer = worker;
    struct rt_job *job = tracer->job;
    int first = job->desc->view->first_row_px;
    for (int y = rt_job_next(job, false); y >= 0; y = rt_job_next(job, true))
        for (int x = 0; x < job->image->width_px && !rt_job_is_cancelled(job); x++)
            trace_pixel(tracer, x, first + y);
    atomic_fetch_add(&job->shadow_rays, tracer->lighting.shadow_rays);
    if (tracer->lighting.has_overflowed)
        atomic_store(&job->has_overflowed, true);
}

static bool tracer_init(void *worker, struct rt_job *job, struct error *err)
{
    struct tracer *tracer = worker;
    tracer->job = job;
    if (!rt_hits_init(&tracer->hits, err) ||
        !rt_lighting_init(&tracer->lighting, job->scene, job->desc->view, err))
        return false;
    tracer->lighting.environment = job->desc->environment;
    struct rt_ray ray;
    rt_job_camera_ray(job, 0, 0, &ray);
    rt_media_at(job->scene, ray.origin, &tracer->hits, tracer->eye_sigma);
    return true;
}

static void tracer_finish(void *worker)
{
    struct tracer *tracer = worker;
    rt_hits_finish(&tracer->hits);
    rt_lighting_finish(&tracer->lighting);
}

const struct rt_form rt_reference_form = {
    .worker_bytes = sizeof(struct tracer),
    .init = tracer_init,
    .run = trace_rows,
    .finish = tracer_finish,
};
