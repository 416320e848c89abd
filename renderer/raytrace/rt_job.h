/* SPDX-License-Identifier: MIT */
/* Divides one picture into units of work (rows or tiles), which threads take one by one. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_JOB_H
#define VITRAIL_RENDERER_RAYTRACE_RT_JOB_H

#include <stdatomic.h>

#include "renderer/raytrace/raytrace.h"
#include "renderer/raytrace/rt_scene.h"

struct rt_job {
    const struct raytrace_desc *desc;
    struct rt_scene *scene;
    struct image *image; /* of the tile of the view */
    struct view_tile tile;
    const void *shared; /* what the form's threads share; rt_production.c */
    int unit_count;
    atomic_int next_unit, units_done;
    atomic_bool is_cancelled, has_overflowed, has_no_memory;
    atomic_bool yields; /* threads end after the units that they work on */
    double paused_ms, haze_ms;
    atomic_uint_fast64_t camera_rays, shadow_rays;
    atomic_uint_fast64_t surfaces, lights_listed, lights_reaching;
};

/* The next unit to work on, or -1: all are taken, or the job is cancelled or yields. Reports the
 * one before as done. Thread: any. */
int rt_job_next(struct rt_job *job, bool has_done_one);

/* Whether the rest is wanted no more: asks, within a unit, so that one of many rays ends soon.
 * Thread: any. */
bool rt_job_is_cancelled(struct rt_job *job);

/* How a form of the ray tracer works. A worker is one thread's memory, zeroed before init. */
struct rt_form {
    size_t worker_bytes;
    bool (*init)(void *worker, struct rt_job *job, struct error *err);
    void (*run)(void *worker); /* until rt_job_next says -1 */
    void (*finish)(void *worker);
};

/* The ground truth: one ray at a time, f64, every light (rt_reference.c). unit: a row. */
extern const struct rt_form rt_reference_form;
/* The fast one: packets of rays, light clusters (rt_production.c). unit: a tile. */
bool rt_production_render(struct rt_job *job, struct error *err);

/* Runs the job on desc's threads, and urgent frames in between: workers are then made anew, so they
 * hand in all that they have when they run out of units. Threads that cannot be started leave their
 * units to the others; the calling one always works. */
MUST_CHECK bool rt_job_run(struct rt_job *job, const struct rt_form *form, struct error *err);

/* The scene that fits the state: that of desc's cache, rebuilt where the geometry is another, or
 * without a cache `own`, which the caller finishes. */
MUST_CHECK bool rt_job_take_scene(const struct raytrace_desc *desc, struct rt_scene *own,
                                  struct rt_scene **scene, bool *is_reused, struct error *err);

static inline bool rt_job_has_pixel(const struct rt_job *job, int x, int y)
{
    const struct view_tile *tile = &job->tile;
    return x >= tile->x_px && y >= tile->y_px && x < tile->x_px + tile->width_px &&
           y < tile->y_px + tile->height_px;
}

/* Where the image has a pixel of the picture; it is in the tile. */
static inline float *rt_job_pixel(const struct rt_job *job, int x, int y)
{
    size_t row = (size_t)(y - job->tile.y_px), column = (size_t)(x - job->tile.x_px);
    return (float *)job->image->pixels + 4 * (row * (size_t)job->tile.width_px + column);
}

/* Camera ray through continuous pixel coordinates of the picture, y down. */
void rt_job_camera_ray(const struct rt_job *job, double x, double y, struct rt_ray *ray);

/* Such rays side by side, with the same bits. Numbers beyond count are no matter. */
enum { RT_CAMERA_RAYS = 16 };
struct rt_camera_places {
    double x[RT_CAMERA_RAYS], y[RT_CAMERA_RAYS];
};
void rt_job_camera_rays(const struct rt_job *job, const struct rt_camera_places *places, int count,
                        struct rt_ray *rays);

/* Only their directions, of a perspective camera: all else they have alike is that of
 * rt_job_camera_ray. */
void rt_job_camera_ways(const struct rt_job *job, const struct rt_camera_places *places,
                        double ways[3][RT_CAMERA_RAYS]);

/* Seed of the sequences on area lights: different for neighbouring pixels and samples, the same in
 * every run. */
static inline uint32_t rt_job_seed(int x, int y, int sample)
{
    return ((uint32_t)x * 73856093u ^ (uint32_t)y * 19349663u ^ (uint32_t)sample * 83492791u) + 1;
}

#endif
