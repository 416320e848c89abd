/* SPDX-License-Identifier: MIT */
/* How much of an environment map's light reaches given points: rays along directions that are drawn
 * by the map and by the lobes of the surface, each weighed by the light that it brings. The
 * quotient of the sums with and without what is in the way is the transmittance of a lobe: exactly
 * 1 where nothing is, 0 where all is opaque. */
#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_environment.h"
#include "renderer/raytrace/rt_math.h"
#include "renderer/raytrace/rt_shadow_points.h"

static const double pi = 3.14159265358979323846, min_alpha = 1e-3;

struct shared { /* by the threads of one window */
    const struct raytrace_shadows *shadows;
    const struct raytrace_shadow_points *points;
    uint32_t (*filters)[2]; /* out */
    uint32_t lobe_count;    /* of a point */
};

/* What arrives over a lobe, without and with what is in its way. */
struct lobe_sums {
    double all[3], passed[3];
};

struct worker {
    struct rt_point_worker base; /* first */
    const struct shared *shared;
    /* rays that wait, all of one point */
    struct rt_shadow_job jobs[RT_LANES];
    double weights[RT_LANES][VISIBILITY_LOBES][3];
    size_t count;
    struct lobe_sums sums[VISIBILITY_LOBES];
};

static void flush(struct worker *worker)
{
    double passed[RT_LANES][3];
    rt_shadow_rays_trace(&worker->base.rays, worker->jobs, worker->count, passed);
    for (size_t i = 0; i < worker->count; i++)
        for (int lobe = 0; lobe < VISIBILITY_LOBES; lobe++)
            for (int k = 0; k < 3; k++) {
                worker->sums[lobe].all[k] += worker->weights[i][lobe][k];
                worker->sums[lobe].passed[k] += worker->weights[i][lobe][k] * passed[i][k];
            }
    worker->count = 0;
}

static void add_ray(struct worker *worker, const struct rt_point *p, const double l[3],
                    const double arriving[3], const double shares[VISIBILITY_LOBES])
{
    size_t at = worker->count++;
    struct rt_shadow_job *job = &worker->jobs[at];
    *job = p->job;
    job->distance_m = INFINITY;
    for (int k = 0; k < 3; k++) {
        job->direction[k] = (float)l[k];
        for (int lobe = 0; lobe < VISIBILITY_LOBES; lobe++)
            worker->weights[at][lobe][k] = shares[lobe] * arriving[k];
    }
    if (worker->count == RT_LANES)
        flush(worker);
}

/* A white surface: its diffuse lobe and, where it mirrors, its lobe of GGX. */
static void reflector_init(struct rt_reflector *r, const struct rt_point *p, double side,
                           bool mirrors)
{
    double alpha = rt_max(p->roughness * p->roughness, min_alpha);
    *r = (struct rt_reflector){.alpha_square = alpha * alpha};
    for (int k = 0; k < 3; k++) {
        r->normal[k] = side * (double)p->normal[k];
        r->view[k] = p->view[k];
        r->diffuse[k] = 1 / pi;
        r->specular[k] = mirrors;
    }
    r->n_dot_v = rt_max(vec3_dot(r->normal, r->view), 1e-4);
}

/* side: 1: the viewer's; -1: light from behind. */
static void add_side(struct worker *worker, const struct rt_point *p, double side)
{
    const struct raytrace_desc *desc = &worker->shared->shadows->desc;
    uint32_t count = rt_environment_count(desc->environment, &desc->view->quality);
    struct rt_environment_sampler sampler;
    struct rt_reflector reflector;
    reflector_init(&reflector, p, side, side > 0);
    rt_environment_begin(&sampler, desc->environment, &reflector, count, p->seed);
    for (uint32_t i = 0; i < count; i++) {
        double l[3], arriving[3], shares[VISIBILITY_LOBES] = {0};
        if (!rt_environment_draw(&sampler, i, l, arriving))
            continue;
        double diffused = vec3_dot(reflector.normal, l);
        if (side > 0) {
            shares[VISIBILITY_DIFFUSE] = diffused;
            shares[VISIBILITY_MIRRORED] = rt_environment_mirrored(&sampler, l);
        } else {
            shares[VISIBILITY_BEHIND] = diffused;
        }
        add_ray(worker, p, l, arriving, shares);
    }
}

/* A channel without light says nothing of itself: the others stand for it. False: none says any. */
static bool find_transmittance(const struct lobe_sums *sums, double t[3])
{
    double all = sums->all[0] + sums->all[1] + sums->all[2];
    double passed = sums->passed[0] + sums->passed[1] + sums->passed[2];
    for (int k = 0; k < 3; k++)
        t[k] = sums->all[k] > 0 ? rt_min(sums->passed[k] / sums->all[k], 1) : passed / all;
    return all > 0;
}

static void see(void *context, size_t index)
{
    struct worker *worker = context;
    const struct shared *shared = worker->shared;
    struct rt_point p;
    double t[3], diffuse[3] = {1, 1, 1};
    rt_point_begin(&p, shared->shadows, &worker->base.rays.scratch, shared->points, index);
    memset(worker->sums, 0, sizeof worker->sums);
    add_side(worker, &p, 1);
    if (shared->lobe_count > VISIBILITY_BEHIND && p.transmits)
        add_side(worker, &p, -1);
    flush(worker);
    uint32_t(*out)[2] = shared->filters + index * shared->lobe_count;
    if (find_transmittance(&worker->sums[VISIBILITY_DIFFUSE], t))
        memcpy(diffuse, t, sizeof diffuse);
    for (uint32_t lobe = 0; lobe < shared->lobe_count; lobe++) {
        bool is_known = find_transmittance(&worker->sums[lobe], t);
        rt_shadow_pack(is_known ? t : diffuse, out[lobe]);
    }
}

static void run_tiles(void *argument)
{
    struct worker *worker = argument;
    struct rt_job *job = worker->base.job;
    for (int tile = rt_job_next(job, false); tile >= 0; tile = rt_job_next(job, true))
        rt_points_visit_tile(worker->shared->points, tile, job, see, worker);
    rt_point_worker_end(&worker->base);
}

static bool worker_init(void *argument, struct rt_job *job, struct error *err)
{
    struct worker *worker = argument;
    worker->shared = job->shared;
    return rt_point_worker_init(&worker->base, worker->shared->shadows, job, err);
}

bool raytrace_shadows_see(struct raytrace_shadows *shadows,
                          const struct raytrace_shadow_points *points, uint32_t lobe_count,
                          uint32_t (*filters)[2], struct raytrace_stats *stats, struct error *err)
{
    static const struct rt_form form = {.worker_bytes = sizeof(struct worker),
                                        .init = worker_init,
                                        .run = run_tiles,
                                        .finish = rt_point_worker_finish};
    struct shared shared = {
        .shadows = shadows, .points = points, .filters = filters, .lobe_count = lobe_count};
    const struct rt_points_run run = {.shadows = shadows,
                                      .points = points,
                                      .shared = &shared,
                                      .subject = "the light of the environment"};
    return rt_points_run(&run, &form, &stats->see_ms, stats, err);
}
