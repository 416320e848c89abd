/* SPDX-License-Identifier: MIT */
/* Camera rays of the ground truth, spread over threads by rows. */
#include "renderer/raytrace/raytrace.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <unistd.h>

#include "renderer/raytrace/rt_light.h"
#include "renderer/scene/matrix.h"
#include "renderer/wall_clock.h"

enum { THREADS_MAX = 256 };

struct trace_job {
    const struct raytrace_desc *desc;
    const struct rt_scene *scene;
    struct image *image;
    atomic_int next_row, rows_done;
    atomic_bool is_cancelled, has_overflowed, has_failed;
    atomic_uint_fast64_t camera_rays, shadow_rays;
};

struct tracer { /* one thread's share */
    struct trace_job *job;
    struct rt_lighting lighting;
    struct rt_hits hits;
};

/* x, y: continuous pixel coordinates, y down. */
static void camera_ray(const struct trace_job *job, double x, double y, struct rt_ray *ray)
{
    const struct camera *camera = job->desc->camera;
    double px = (2 * x / job->image->width_px - 1) * camera->half_width;
    double py = (1 - 2 * y / job->image->height_px) * camera->half_height;
    *ray = (struct rt_ray){.culls_back_faces = true,
                           .skip_mesh = UINT32_MAX,
                           .skip_triangle = UINT32_MAX,
                           .t_max = INFINITY};
    for (int k = 0; k < 3; k++) {
        double aside = camera->right[k] * px + camera->up[k] * py;
        double eye = camera->eye[k] - job->scene->origin[k];
        bool is_flat = camera->is_orthographic;
        ray->origin[k] = is_flat ? eye + aside - camera->back[k] * camera->z_near : eye;
        ray->direction[k] = is_flat ? -camera->back[k] : aside - camera->back[k];
    }
    if (!camera->is_orthographic) {
        ray->t_min = camera->z_near; /* direction has unit depth */
        return;
    }
    ray->t_max = camera->z_far - camera->z_near;
}

/* Front to back over the ordered layers: docs/shading.md section 2. */
static void trace_ray(struct tracer *tracer, const struct rt_ray *ray, double color[4])
{
    const struct trace_job *job = tracer->job;
    const float *b = job->desc->view->background;
    double through[3] = {1, 1, 1}, behind[4];
    for (int k = 0; k < 3; k++)
        behind[k] = (double)b[k] * (double)b[3];
    behind[3] = (double)b[3];
    color[0] = color[1] = color[2] = 0;
    rt_scene_collect(job->scene, ray, &tracer->hits);
    tracer->lighting.has_overflowed |= tracer->hits.has_overflowed;
    double view[3] = {-ray->direction[0], -ray->direction[1], -ray->direction[2]};
    vec3_normalize(view);
    for (size_t i = 0; i < tracer->hits.count; i++) {
        const struct rt_hit *hit = &tracer->hits.hits[i];
        enum state_class class_ = job->scene->meshes[hit->mesh].item->class_;
        bool is_opaque = rt_scene_is_opaque(job->scene, hit);
        if (class_ == STATE_MASKED && !is_opaque)
            continue;
        struct rt_surface surface;
        double radiance[3], filter[3], point[3];
        rt_surface_evaluate(job->scene, hit, &surface);
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
        rt_surface_view_filter(&surface, fabs(vec3_dot(surface.normal, view)), hit->is_front,
                               filter);
        for (int k = 0; k < 3; k++) {
            color[k] += through[k] * surface.alpha * radiance[k];
            through[k] *= filter[k];
        }
    }
    for (int k = 0; k < 3; k++)
        color[k] += through[k] * behind[k];
    color[3] = 1 - (1 - behind[3]) * (through[0] + through[1] + through[2]) / 3;
}

/* Different for neighbouring pixels and samples, the same in every run. */
static uint32_t hash_sample(int x, int y, int s)
{
    return ((uint32_t)x * 73856093u ^ (uint32_t)y * 19349663u ^ (uint32_t)s * 83492791u) + 1;
}

static void trace_pixel(struct tracer *tracer, int x, int y)
{
    struct trace_job *job = tracer->job;
    int side = job->desc->samples_per_side ? job->desc->samples_per_side : 1;
    double sum[4] = {0};
    for (int s = 0; s < side * side; s++) {
        struct rt_ray ray;
        double color[4];
        int column = s % side, row = s / side;
        tracer->lighting.seed = hash_sample(x, y, s);
        camera_ray(job, x + (column + 0.5) / side, y + (row + 0.5) / side, &ray);
        trace_ray(tracer, &ray, color);
        for (int k = 0; k < 4; k++)
            sum[k] += color[k];
    }
    float *out =
        (float *)job->image->pixels + 4 * ((size_t)y * (size_t)job->image->width_px + (size_t)x);
    for (int k = 0; k < 4; k++)
        out[k] = (float)(sum[k] / (side * side));
    atomic_fetch_add(&job->camera_rays, (uint64_t)(side * side));
}

static void *trace_rows(void *argument)
{
    struct tracer *tracer = argument;
    struct trace_job *job = tracer->job;
    int height = job->image->height_px;
    for (int y; (y = atomic_fetch_add(&job->next_row, 1)) < height;) {
        for (int x = 0; x < job->image->width_px; x++)
            trace_pixel(tracer, x, y);
        int done = atomic_fetch_add(&job->rows_done, 1) + 1;
        if (job->desc->progress && job->desc->progress(job->desc->context, (double)done / height))
            atomic_store(&job->is_cancelled, true);
        if (atomic_load(&job->is_cancelled))
            break;
    }
    atomic_fetch_add(&job->shadow_rays, tracer->lighting.shadow_rays);
    if (tracer->lighting.has_overflowed)
        atomic_store(&job->has_overflowed, true);
    return NULL;
}

static bool tracer_init(struct tracer *tracer, struct trace_job *job, struct error *err)
{
    tracer->job = job;
    tracer->hits.hits = calloc(RT_HITS_MAX, sizeof *tracer->hits.hits);
    if (!tracer->hits.hits)
        return error_set(err, ERROR_NO_MEMORY, "hits of a camera ray");
    return rt_lighting_init(&tracer->lighting, job->scene, job->desc->view, err);
}

static void tracer_finish(struct tracer *tracer)
{
    free(tracer->hits.hits);
    rt_lighting_finish(&tracer->lighting);
}

static int choose_threads(const struct raytrace_desc *desc)
{
    long cores = sysconf(_SC_NPROCESSORS_ONLN);
    int threads = desc->threads ? desc->threads : (int)(cores > 0 ? cores : 1);
    return threads < 1 ? 1 : threads > THREADS_MAX ? THREADS_MAX : threads;
}

/* Threads that cannot be started leave their rows to the others; the calling thread always works.
 */
static bool run_threads(struct trace_job *job, struct error *err)
{
    int count = choose_threads(job->desc), ready = 0, started = 0;
    struct tracer *tracers = calloc((size_t)count, sizeof *tracers);
    pthread_t threads[THREADS_MAX];
    bool ok = tracers != NULL;
    if (!ok)
        error_set(err, ERROR_NO_MEMORY, "%d ray tracing threads", count);
    for (; ok && ready < count; ready++)
        ok = tracer_init(&tracers[ready], job, err);
    for (int i = 1; ok && i < count; i++)
        if (pthread_create(&threads[started], NULL, trace_rows, &tracers[i]) == 0)
            started++;
    if (ok && ready)
        trace_rows(&tracers[0]);
    for (int i = 0; i < started; i++)
        pthread_join(threads[i], NULL);
    for (int i = 0; i < ready; i++)
        tracer_finish(&tracers[i]);
    free(tracers);
    return ok;
}

bool raytrace_render(const struct raytrace_desc *desc, struct image *image,
                     struct raytrace_stats *stats, struct error *err)
{
    struct rt_scene scene;
    double begin_ms = wall_ms();
    *image = (struct image){0};
    if (!rt_scene_init(&scene, desc->state, desc->view, err))
        return false;
    double built_ms = wall_ms();
    struct trace_job job = {.desc = desc, .scene = &scene, .image = image};
    bool ok = image_init(image, desc->view->width_px, desc->view->height_px, 4, IMAGE_F32, err) &&
              run_threads(&job, err);
    if (ok && atomic_load(&job.is_cancelled))
        ok = error_set(err, ERROR_TIMEOUT, "ray tracing was cancelled");
    if (ok && atomic_load(&job.has_overflowed))
        ok = error_set(err, ERROR_OVER_BUDGET, "a ray meets more than %d surfaces", RT_HITS_MAX);
    rt_scene_finish(&scene);
    if (!ok)
        image_finish(image);
    if (stats)
        *stats = (struct raytrace_stats){
            .build_ms = built_ms - begin_ms,
            .trace_ms = wall_ms() - built_ms,
            .camera_rays = atomic_load(&job.camera_rays),
            .shadow_rays = atomic_load(&job.shadow_rays),
        };
    return ok;
}

/* Mean over the light's area. */
static void probe_light(struct rt_lighting *lighting, const struct state_light *light,
                        const double point[3], double out[3])
{
    struct rt_light_sample sample = {
        .count = rt_light_sample_count(light, &lighting->view->quality), .seed = lighting->seed};
    out[0] = out[1] = out[2] = light->casts_shadow ? 0 : 1;
    for (; light->casts_shadow && sample.index < sample.count; sample.index++) {
        struct rt_arrival arrival;
        double t[3];
        rt_light_arrive(light, &sample, lighting->scene->origin, point, &arrival);
        rt_transmittance(lighting, &arrival, point, NULL, t);
        for (int k = 0; k < 3; k++)
            out[k] += t[k] / sample.count;
    }
}

bool raytrace_probe(const struct raytrace_probe_desc *desc, double (*out)[3], struct error *err)
{
    struct rt_scene scene;
    struct rt_lighting lighting = {0};
    if (!rt_scene_init(&scene, desc->state, desc->view, err))
        return false;
    bool ok = rt_lighting_init(&lighting, &scene, desc->view, err);
    for (size_t i = 0; ok && i < desc->state->light_count; i++) {
        for (size_t p = 0; p < desc->point_count; p++) {
            double point[3];
            vec3_sub(desc->points[p], scene.origin, point);
            lighting.seed = (uint32_t)p;
            probe_light(&lighting, &desc->state->lights[i], point, out[i * desc->point_count + p]);
        }
    }
    if (ok && lighting.has_overflowed)
        ok = error_set(err, ERROR_OVER_BUDGET, "a ray meets more than %d surfaces", RT_HITS_MAX);
    rt_lighting_finish(&lighting);
    rt_scene_finish(&scene);
    return ok;
}
