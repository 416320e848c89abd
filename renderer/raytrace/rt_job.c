/* SPDX-License-Identifier: MIT */
/* Threads of one picture, and its camera rays. */
#include "renderer/raytrace/rt_job.h"

#include <assert.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>

#include "renderer/base/processor_forms.h"
#include "renderer/base/processors.h"
#include "renderer/base/wall_clock.h"

enum { THREADS_MAX = 256 };

bool rt_job_is_cancelled(struct rt_job *job)
{
    const struct raytrace_desc *desc = job->desc;
    double share = (double)atomic_load(&job->units_done) / job->unit_count;
    if (desc->advance && !atomic_load(&job->is_cancelled))
        desc->advance(desc->advance_context, share);
    if (yield_point_is_unwanted(desc->yield))
        atomic_store(&job->is_cancelled, true);
    return atomic_load(&job->is_cancelled);
}

int rt_job_next(struct rt_job *job, bool has_done_one)
{
    if (has_done_one) {
        atomic_fetch_add(&job->units_done, 1);
        rt_job_is_cancelled(job);
    }
    if (has_done_one && atomic_load(&job->next_unit) < job->unit_count &&
        yield_point_is_due(job->desc->yield))
        atomic_store(&job->yields, true);
    if (atomic_load(&job->is_cancelled) || atomic_load(&job->has_no_memory) ||
        atomic_load(&job->yields))
        return -1;
    int unit = atomic_fetch_add(&job->next_unit, 1);
    return unit < job->unit_count ? unit : -1;
}

static int choose_threads(const struct rt_job *job)
{
    int threads = job->desc->threads ? job->desc->threads : processors_usable();
    threads = threads > job->unit_count ? job->unit_count : threads;
    return threads < 1 ? 1 : threads > THREADS_MAX ? THREADS_MAX : threads;
}

struct thread {
    const struct rt_form *form;
    void *worker;
};

static void *run_thread(void *argument)
{
    const struct thread *thread = argument;
    thread->form->run(thread->worker);
    return NULL;
}

static bool run_threads(struct rt_job *job, const struct rt_form *form, struct error *err)
{
    int count = choose_threads(job), ready = 0, started = 0;
    char *workers = calloc((size_t)count, form->worker_bytes);
    struct thread shares[THREADS_MAX];
    pthread_t threads[THREADS_MAX];
    bool ok = workers != NULL;
    if (!ok)
        error_set(err, ERROR_NO_MEMORY, "%d ray tracing threads", count);
    for (; ok && ready < count; ready++) {
        shares[ready] = (struct thread){form, workers + (size_t)ready * form->worker_bytes};
        ok = form->init(shares[ready].worker, job, err);
    }
    for (int i = 1; ok && i < count; i++)
        if (pthread_create(&threads[started], NULL, run_thread, &shares[i]) == 0)
            started++;
    if (ok)
        form->run(shares[0].worker);
    for (int i = 0; i < started; i++)
        pthread_join(threads[i], NULL);
    for (int i = 0; i < ready; i++)
        form->finish(shares[i].worker);
    free(workers);
    return ok;
}

/* Urgent frames may have taken the scene over to their states and views: back with it. */
static bool run_urgent(struct rt_job *job, struct error *err)
{
    const struct raytrace_desc *desc = job->desc;
    double begin_ms = wall_ms();
    bool is_wanted = yield_point_run(desc->yield, err);
    bool is_same = rt_scene_rebind(job->scene, desc->state, desc->view);
    assert(is_same);
    rt_scene_withhold(job->scene, desc->texture_levels);
    job->paused_ms += wall_ms() - begin_ms;
    return is_wanted;
}

bool rt_job_run(struct rt_job *job, const struct rt_form *form, struct error *err)
{
    bool ok;
    while ((ok = run_threads(job, form, err)) && atomic_exchange(&job->yields, false) &&
           (ok = run_urgent(job, err)))
        continue;
    return ok;
}

void rt_job_camera_ray(const struct rt_job *job, double x, double y, struct rt_ray *ray)
{
    const struct camera *camera = job->desc->camera;
    double px = (2 * x / job->desc->view->width_px - 1) * camera->half_width;
    double py = (1 - 2 * y / job->desc->view->height_px) * camera->half_height;
    ray->culls_back_faces = true; /* one by one: zeroing all of it first takes longer */
    ray->is_bent = ray->only_media = false;
    ray->skip_mesh = ray->skip_triangle = UINT32_MAX;
    ray->excluded_node = 0;
    ray->t_min = 0;
    ray->t_max = INFINITY;
    for (int k = 0; k < 3; k++) {
        double aside = camera->right[k] * px + camera->up[k] * py;
        double eye = camera->eye[k] - job->scene->origin[k];
        bool is_flat = camera->is_orthographic;
        ray->origin[k] = is_flat ? eye + aside - camera->back[k] * camera->z_near : eye;
        ray->direction[k] = is_flat ? -camera->back[k] : aside - camera->back[k];
    }
    if (camera->is_orthographic)
        ray->t_max = camera->z_far - camera->z_near;
    else
        ray->t_min = camera->z_near; /* direction has unit depth */
}

PROCESSOR_FORMS static void find_ways(const struct camera *camera, const int size[2],
                                      const struct rt_camera_places *places,
                                      double ways[3][RT_CAMERA_RAYS])
{
    const struct camera own = *camera;
    const int width = size[0], height = size[1];
    for (int i = 0; i < RT_CAMERA_RAYS; i++) {
        double px = (2 * places->x[i] / width - 1) * own.half_width;
        double py = (1 - 2 * places->y[i] / height) * own.half_height;
        for (int k = 0; k < 3; k++)
            ways[k][i] = own.right[k] * px + own.up[k] * py - own.back[k];
    }
}

void rt_job_camera_ways(const struct rt_job *job, const struct rt_camera_places *places,
                        double ways[3][RT_CAMERA_RAYS])
{
    find_ways(job->desc->camera,
              (const int[2]){job->desc->view->width_px, job->desc->view->height_px}, places, ways);
}

void rt_job_camera_rays(const struct rt_job *job, const struct rt_camera_places *places, int count,
                        struct rt_ray *rays)
{
    const struct camera *camera = job->desc->camera;
    _Alignas(64) double ways[3][RT_CAMERA_RAYS];
    struct rt_ray first;
    if (camera->is_orthographic) {
        for (int i = 0; i < count; i++)
            rt_job_camera_ray(job, places->x[i], places->y[i], &rays[i]);
        return;
    }
    rt_job_camera_ray(job, places->x[0], places->y[0], &first);
    rt_job_camera_ways(job, places, ways);
    for (int i = 0; i < count; i++) {
        rays[i] = first;
        for (int k = 0; k < 3; k++)
            rays[i].direction[k] = ways[k][i];
    }
}
