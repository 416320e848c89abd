/* SPDX-License-Identifier: MIT */
/* Suite `raytrace`: the ray tracer's loop against the kernel alone on the same rays, light clusters
 * against asking every light, threads, and whole frames against deep shadow maps. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_job.h"
#include "renderer/raytrace/rt_packet.h"
#include "tests/bench/frames.h"
#include "tests/bench/scenes.h"

enum { SPOTS = 250 };

/* A scene evaluated for one view. */
struct traced {
    struct view view;
    struct scene_state state;
    struct camera camera;
};

static bool traced_init(struct traced *traced, const struct bench_scene *scene,
                        const struct view *view, struct error *err)
{
    *traced = (struct traced){.view = *view};
    traced->view.quality.shadows = SHADOWS_RAYTRACED;
    return scene_state_init(&traced->state, &scene->rig.imported.scene, &traced->view, err) &&
           camera_resolve(&traced->camera, &traced->view, &traced->state, err);
}

/* -- rays -- */

/* The kernel alone gets the same rays and geometry, and no filter: it stops at the first surface.
 */
struct kernel {
    struct rt_scene scene;
    struct rt_packet packet;
};

static bool kernel_init(struct kernel *kernel, const struct traced *traced, bool is_bare,
                        struct error *err)
{
    if (!rt_scene_init(&kernel->scene, &traced->state, &traced->view, err) ||
        !rt_packet_init(&kernel->packet, &kernel->scene, err))
        return false;
    for (unsigned i = 0; is_bare && i < kernel->scene.mesh_count; i++) {
        RTCGeometry geometry = rtcGetGeometry(kernel->scene.scene, i);
        rtcSetGeometryIntersectFilterFunction(geometry, NULL);
        rtcSetGeometryOccludedFilterFunction(geometry, NULL);
        rtcCommitGeometry(geometry);
    }
    rtcCommitScene(kernel->scene.scene);
    return true;
}

static void kernel_finish(struct kernel *kernel)
{
    rt_packet_finish(&kernel->packet);
    rt_scene_finish(&kernel->scene);
}

/* Member by member, as Embree lays out packets of n rays. */
static void set_lane(float *rays, unsigned n, unsigned lane, const struct rt_ray *from)
{
    const uint32_t mask = UINT32_MAX;
    for (unsigned k = 0; k < 3; k++) {
        rays[(RT_RAY_ORIGIN + k) * n + lane] = (float)from->origin[k];
        rays[(RT_RAY_DIRECTION + k) * n + lane] = (float)from->direction[k];
    }
    rays[RT_RAY_TNEAR * n + lane] = (float)from->t_min;
    rays[RT_RAY_TFAR * n + lane] = (float)from->t_max;
    memcpy(&rays[RT_RAY_MASK * n + lane], &mask, sizeof mask);
}

static void ask_kernel(struct kernel *kernel, const struct rt_ray *rays, bool is_shadow)
{
    struct embree_context context;
    union {
        _Alignas(64) struct RTCRayHit16 sixteen;
        struct RTCRayHit8 eight;
        float floats[(RT_RAY_MEMBERS + RT_HIT_MEMBERS) * 16];
        uint32_t words[(RT_RAY_MEMBERS + RT_HIT_MEMBERS) * 16];
    } query = {0};
    _Alignas(64) int valid[RT_LANES];
    const unsigned n = kernel->scene.lanes == 16 ? 16 : 8;
    embree_context_init(&context);
    context.is_coherent = true;
    memcpy(kernel->packet.rays, rays, sizeof kernel->packet.rays); /* as ask_ours must */
    for (unsigned first = 0; first < RT_LANES; first += n) {
        for (unsigned i = 0; i < n; i++) {
            valid[i] = -1;
            set_lane(query.floats, n, i, &kernel->packet.rays[first + i]);
            query.words[(RT_RAY_MEMBERS + RT_HIT_MESH) * n + i] = RTC_INVALID_GEOMETRY_ID;
        }
        if (is_shadow && n == 16)
            embree_occluded16(valid, kernel->scene.scene, &context, &query.sixteen.ray);
        else if (is_shadow)
            embree_occluded8(valid, kernel->scene.scene, &context, &query.eight.ray);
        else if (n == 16)
            embree_intersect16(valid, kernel->scene.scene, &context, &query.sixteen);
        else
            embree_intersect8(valid, kernel->scene.scene, &context, &query.eight);
    }
}

static void ask_ours(struct kernel *kernel, const struct rt_ray *rays, bool is_shadow)
{
    memcpy(kernel->packet.rays, rays, sizeof kernel->packet.rays);
    kernel->packet.count = RT_LANES;
    if (is_shadow)
        rt_packet_occlude(&kernel->packet);
    else
        rt_packet_collect(&kernel->packet);
}

/* Camera rays of blocks of 4 x 4 pixels, then a ray from each one's last surface to a light. */
static size_t make_rays(struct kernel *ours, const struct traced *traced, struct rt_ray *camera,
                        struct rt_ray *shadow)
{
    struct image image = {.width_px = traced->view.width_px, .height_px = traced->view.height_px};
    struct raytrace_desc desc = {.view = &traced->view, .camera = &traced->camera};
    struct rt_job job = {.desc = &desc, .scene = &ours->scene, .image = &image};
    const struct state_light *light = &traced->state.lights[0];
    size_t count = 0;
    for (int y = 0; y + 3 < image.height_px; y += 4) {
        for (int x = 0; x + 3 < image.width_px; x += 4) {
            for (int i = 0; i < RT_LANES; i++)
                rt_job_camera_ray(&job, x + i % 4 + 0.5, y + i / 4 + 0.5, &camera[count + i]);
            ask_ours(ours, camera + count, false);
            for (int i = 0; i < RT_LANES; i++) {
                const struct rt_hits *hits = &ours->packet.hits[i];
                const struct rt_hit *hit = hits->count ? &hits->hits[hits->count - 1] : NULL;
                struct rt_ray *ray = &shadow[count + i], *from = &camera[count + i];
                *ray = (struct rt_ray){.skip_mesh = UINT32_MAX, .skip_triangle = UINT32_MAX};
                for (int k = 0; k < 3; k++) {
                    ray->origin[k] = from->origin[k];
                    if (hit)
                        ray->origin[k] += from->direction[k] * hit->t * (1 - 1e-4);
                    ray->direction[k] = light->position[k] - ours->scene.origin[k] - ray->origin[k];
                }
                ray->t_max = vec3_length(ray->direction);
                vec3_normalize(ray->direction);
                ray->t_min = ours->scene.epsilon * ray->t_max;
            }
            count += RT_LANES;
        }
    }
    return count;
}

static double time_rays(struct kernel *kernel, const struct rt_ray *rays, size_t count,
                        bool is_shadow, bool is_bare)
{
    double begin = cpu_now_ms();
    for (size_t i = 0; i < count; i += RT_LANES) {
        if (is_bare)
            ask_kernel(kernel, rays + i, is_shadow);
        else
            ask_ours(kernel, rays + i, is_shadow);
    }
    return cpu_now_ms() - begin;
}

static void report_rays(struct bench *bench, const struct bench_scene *scene, const char *subject,
                        size_t count, struct samples ms[2])
{
    struct check check = {.scene = scene->name, .subject = subject, .p = NAN};
    check.name = "million rays/s, ours, one core";
    check.value = (double)count / samples_summary(&ms[0]).median / 1e3;
    bench_check(bench, &check);
    check.name = "million rays/s, the kernel alone";
    check.value = (double)count / samples_summary(&ms[1]).median / 1e3;
    bench_check(bench, &check);
    check.name = "cpu ours / kernel alone";
    check.value = samples_summary(&ms[0]).median / samples_summary(&ms[1]).median;
    check.relation = "<=";
    check.bound = 2;
    check.p = samples_difference_p(&ms[0], &ms[1]);
    bench_check(bench, &check);
}

static bool run_rays(struct bench *bench, const struct bench_scene *scene, struct error *err)
{
    struct kernel kernels[2] = {0};
    struct samples ms[2][2] = {0}; /* [shadow][bare] */
    struct traced traced = {0};
    int size[2];
    bench_size(bench, 640, 360, size);
    struct view view = bench_scene_view(scene, size);
    view.lights = &scene->spot;
    view.light_count = 1;
    size_t most = (size_t)size[0] * (size_t)size[1], count = 0;
    struct rt_ray *rays[2] = {calloc(most, sizeof **rays), calloc(most, sizeof **rays)};
    bool ok = (rays[0] && rays[1]) || error_set(err, ERROR_NO_MEMORY, "%zu rays", most);
    ok = ok && traced_init(&traced, scene, &view, err) &&
         kernel_init(&kernels[0], &traced, false, err) &&
         kernel_init(&kernels[1], &traced, true, err);
    if (ok && kernels[0].scene.lanes > 1) {
        count = make_rays(&kernels[0], &traced, rays[0], rays[1]);
        for (struct rounds rounds = rounds_begin(bench); rounds_next(&rounds);)
            for (int i = 0; i < 4; i++) {
                double took =
                    time_rays(&kernels[i % 2], rays[i / 2], count, i / 2 == 1, i % 2 == 1);
                if (!rounds.is_warming)
                    samples_add(&ms[i / 2][i % 2], took);
            }
        report_rays(bench, scene, "camera rays, all layers", count, ms[0]);
        report_rays(bench, scene, "shadow rays to a spot", count, ms[1]);
    }
    for (int i = 0; i < 4; i++)
        samples_finish(&ms[i / 2][i % 2]);
    for (int i = 0; i < 2; i++) {
        kernel_finish(&kernels[i]);
        free(rays[i]);
    }
    scene_state_finish(&traced.state);
    return ok;
}

/* -- lights and threads -- */

static bool time_render(const struct traced *traced, struct raytrace_cache *cache, bool asks_all,
                        int threads, double *cpu_ms, double *wall_ms, struct raytrace_stats *stats,
                        struct error *err)
{
    struct image image;
    struct raytrace_desc desc = {.view = &traced->view,
                                 .state = &traced->state,
                                 .camera = &traced->camera,
                                 .samples = 1,
                                 .cache = cache,
                                 .asks_all_lights = asks_all,
                                 .threads = threads};
    double cpu = cpu_now_ms(), wall = wall_now_ms();
    if (!raytrace_render(&desc, &image, stats, err))
        return false;
    *cpu_ms = cpu_now_ms() - cpu;
    *wall_ms = wall_now_ms() - wall;
    image_finish(&image);
    return true;
}

enum { RENDERS = 3 }; /* clusters on one thread, all lights on one thread, clusters on all cores */

static void report_renders(struct bench *bench, const struct bench_scene *scene,
                           struct samples cpu[RENDERS], struct samples wall[RENDERS],
                           const struct raytrace_stats *stats)
{
    double cores = (double)sysconf(_SC_NPROCESSORS_ONLN);
    struct check check = {.scene = scene->name, .subject = "250 shadowed spots", .p = NAN};
    check.name = "cpu ms, production";
    check.value = samples_summary(&cpu[0]).median;
    bench_check(bench, &check);
    check.name = "million shadow rays";
    check.value = (double)stats->shadow_rays / 1e6;
    bench_check(bench, &check);
    check.name = "lights listed for a surface";
    check.value = (double)stats->lights_listed / (double)stats->surfaces;
    bench_check(bench, &check);
    check.name = "lights that reach a surface";
    check.value = (double)stats->lights_reaching / (double)stats->surfaces;
    bench_check(bench, &check);
    check.name = "shadow rays from a surface";
    check.value = (double)stats->shadow_rays / (double)stats->surfaces;
    bench_check(bench, &check);
    check.name = "wall one thread / all cores";
    check.value = samples_summary(&wall[0]).median / samples_summary(&wall[2]).median;
    bench_check(bench, &check);
    check.name = "cores";
    check.value = cores;
    bench_check(bench, &check);
    check.name = "cpu all cores / one thread";
    check.value = samples_summary(&cpu[2]).median / samples_summary(&cpu[0]).median;
    bench_check(bench, &check);
    check.name = "cpu all lights / clusters";
    check.value = samples_summary(&cpu[1]).median / samples_summary(&cpu[0]).median;
    check.relation = ">=";
    check.bound = 3;
    check.p = samples_difference_p(&cpu[1], &cpu[0]);
    bench_check(bench, &check);
}

static bool run_lights(struct bench *bench, const struct bench_scene *scene, struct error *err)
{
    static struct view_light lights[BENCH_LIGHTS_MAX];
    struct samples cpu[RENDERS] = {0}, wall[RENDERS] = {0};
    struct traced traced = {0};
    struct raytrace_stats stats = {0}; /* of the last: clusters */
    int size[2];
    bench_size(bench, 1024, 768, size);
    struct view view = bench_scene_view(scene, size);
    view.lights = lights;
    view.light_count = SPOTS;
    bench_scene_cones(scene, lights, SPOTS);
    for (int i = 0; i < SPOTS; i++)
        lights[i].casts_no_shadow = false;
    struct raytrace_cache *cache = raytrace_cache_create(err);
    bool ok = cache && traced_init(&traced, scene, &view, err);
    for (struct rounds rounds = rounds_begin(bench); ok && rounds_next(&rounds);)
        for (int i = 0; ok && i < RENDERS; i++) {
            double cpu_ms = 0, wall_ms = 0;
            ok =
                time_render(&traced, cache, i == 1, i == 2 ? 0 : 1, &cpu_ms, &wall_ms, &stats, err);
            if (!rounds.is_warming && ok) {
                samples_add(&cpu[i], cpu_ms);
                samples_add(&wall[i], wall_ms);
            }
        }
    if (ok)
        report_renders(bench, scene, cpu, wall, &stats);
    for (int i = 0; i < RENDERS; i++) {
        samples_finish(&cpu[i]);
        samples_finish(&wall[i]);
    }
    raytrace_cache_destroy(cache);
    scene_state_finish(&traced.state);
    return ok;
}

/* -- frames -- */

static bool run_frames(struct bench *bench, const struct bench_scene *scene, int spots,
                       struct error *err)
{
    static struct view_light lights[BENCH_LIGHTS_MAX];
    enum { VARIANTS = 4 };
    struct frame_variant v[VARIANTS] = {{.name = "raytraced"},
                                        {.name = "deep, still"},
                                        {.name = "deep, lights move", .rebuilds_shadows = true},
                                        {.name = "raytraced-shadows"}};
    static const enum shadow_technique shadows[VARIANTS] = {
        SHADOWS_RAYTRACED, SHADOWS_DEEP, SHADOWS_DEEP, SHADOWS_RAYTRACED_SHADOWS};
    char subject[48];
    int size[2];
    bench_size(bench, 640, 360, size);
    snprintf(subject, sizeof subject, "%d shadowed spots", spots);
    bench_scene_spots(scene, lights, spots);
    for (int i = 0; i < VARIANTS; i++) {
        v[i].view = bench_scene_view(scene, size);
        v[i].view.lights = lights;
        v[i].view.light_count = (size_t)spots;
        v[i].view.quality.shadows = shadows[i];
        v[i].view.quality.samples = 4;
        v[i].view.quality.shadow_resolution = 1024;
    }
    bool ok = frames_run(bench, &scene->rig, v, VARIANTS, err);
    if (ok)
        frames_tell(bench, scene->name, subject, v, VARIANTS);
    for (int i = 1; ok && i < VARIANTS; i++) {
        char name[64];
        snprintf(name, sizeof name, "frame cpu raytraced / %s", v[i].name);
        bench_check(bench,
                    &(struct check){.scene = scene->name,
                                    .subject = subject,
                                    .name = name,
                                    .value = samples_summary(&v[0].measurement.cpu_ms).median /
                                             samples_summary(&v[i].measurement.cpu_ms).median,
                                    .p = samples_difference_p(&v[0].measurement.cpu_ms,
                                                              &v[i].measurement.cpu_ms)});
    }
    frames_finish(v, VARIANTS);
    return ok;
}

static bool run_scene(struct bench *bench, const struct bench_scene *scene, struct error *err)
{
    return run_rays(bench, scene, err) && run_lights(bench, scene, err) &&
           run_frames(bench, scene, 1, err) &&
           (bench->options.is_quick || run_frames(bench, scene, 12, err));
}

bool suite_raytrace(struct bench *bench, struct error *err)
{
    return bench_scenes_run(bench, run_scene, err);
}
