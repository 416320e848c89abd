/* SPDX-License-Identifier: MIT */
/* Shadows of given points: tiles of a window on all cores, the lights of each point's cluster. */
#include <assert.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "renderer/base/wall_clock.h"
#include "renderer/raytrace/raytrace_shadows.h"
#include "renderer/raytrace/rt_emitter.h"
#include "renderer/raytrace/rt_shadow_points.h"

struct shared { /* by the threads of one chunk */
    const struct raytrace_shadows *shadows;
    const struct raytrace_shadow_points *points;
    struct raytrace_shadow_chunk *chunk;
    atomic_size_t *filter_count;
};

struct worker {
    struct rt_point_worker base; /* first */
    const struct shared *shared;
};

/* Some entries of a list that is the prefix of the clusters and one cluster's own entries. */
struct light_run {
    const uint32_t *items[2];
    uint32_t counts[2];
};

static struct light_run cut_list(const struct clusters *clusters, uint32_t cluster, uint32_t first,
                                 uint32_t count)
{
    const uint32_t *head = clusters->heads + 2 * (size_t)cluster;
    const uint32_t lengths[2] = {(uint32_t)clusters->prefix_count, head[1]};
    struct light_run run = {.items = {clusters->items, clusters->items + head[0]}};
    for (int i = 0; i < 2; i++) {
        uint32_t skipped = first < lengths[i] ? first : lengths[i];
        uint32_t kept = lengths[i] - skipped;
        run.items[i] += skipped;
        run.counts[i] = kept < count ? kept : count;
        first -= skipped;
        count -= run.counts[i];
    }
    return run;
}

/* Of a shadow_point: view space looks along -z. */
static double view_depth(const struct shadow_point *point)
{
    return -(double)point->position_offset.v[2];
}

static uint32_t find_cluster(const struct raytrace_shadow_points *points,
                             const struct clusters *clusters, const struct shadow_point *point)
{
    uint32_t width = (uint32_t)points->width, pixel = rt_point_pixel(point);
    return (uint32_t)clusters_find(clusters, (int)(pixel % width), (int)(pixel / width),
                                   (float)view_depth(point));
}

/* Where the light is, seen from the point: of an area light, its index-th point. False when none of
 * it arrives there. */
static bool face_light(const struct raytrace_shadows *shadows, struct rt_point *p, uint32_t index)
{
    const struct state_light *light = &shadows->desc.state->lights[p->job.light];
    if (state_light_is_area(light)) {
        struct rt_arrival arrival;
        struct rt_light_sample sample = {.index = index,
                                         .count = shadows->filters[p->job.light],
                                         .seed = p->seed + p->job.light};
        rt_light_arrive(light, &sample, shadows->scene->origin, p->job.point, &arrival);
        for (int k = 0; k < 3; k++)
            p->job.direction[k] = (float)arrival.direction[k];
        p->job.distance_m = (float)arrival.distance_m;
        return arrival.gain > 0;
    }
    const float at[3] = {(float)p->job.point[0], (float)p->job.point[1], (float)p->job.point[2]};
    return rt_light_set_arrive(&shadows->light_set, p->job.light, at, p->job.direction,
                               &p->job.distance_m) > 0;
}

/* Whether the surface certainly sends nothing of the light to the viewer. The shader asks at the
 * pixel's middle, so that a light nearby stands elsewhere there by as much as a pixel. */
static bool faces_away(const struct rt_point *p)
{
    double along = 0;
    for (int k = 0; k < 3; k++)
        along += (double)p->normal[k] * (double)p->job.direction[k];
    return !p->transmits && along < -1e-3 - p->footprint_m / (double)p->job.distance_m;
}

static void ask_light(struct worker *worker, struct rt_point *p)
{
    const struct raytrace_shadows *shadows = worker->shared->shadows;
    for (uint32_t i = 0; i < shadows->filters[p->job.light]; i++, p->job.filter++) {
        if (face_light(shadows, p, i) && !faces_away(p))
            rt_shadow_rays_add(&worker->base.rays, &p->job);
        else /* nothing comes from there, or so little that its shadow does not matter */
            rt_shadow_pack((const double[3]){1, 1, 1},
                           worker->shared->chunk->filters[p->job.filter]);
    }
}

static void ask_lights(void *context, size_t index)
{
    struct worker *worker = context;
    const struct shared *shared = worker->shared;
    const struct raytrace_shadow_chunk *chunk = shared->chunk;
    struct light_run run =
        cut_list(chunk->clusters, chunk->table[index][1], chunk->first, chunk->count);
    struct rt_point p;
    rt_point_begin(&p, shared->shadows, &worker->base.rays.scratch, shared->points, index);
    p.job.filter = chunk->table[index][0];
    for (int i = 0; i < 2; i++) {
        for (uint32_t k = 0; k < run.counts[i]; k++) {
            p.job.light = run.items[i][k];
            ask_light(worker, &p);
        }
    }
}

static size_t count_filters(const struct raytrace_shadows *shadows, const struct light_run *run)
{
    size_t count = 0;
    for (int i = 0; i < 2; i++)
        for (uint32_t k = 0; k < run->counts[i]; k++)
            count += shadows->filters[run->items[i][k]];
    return count;
}

static void place_point(void *context, size_t index)
{
    struct worker *worker = context;
    const struct shared *shared = worker->shared;
    uint32_t *row = shared->chunk->table[index];
    row[1] = find_cluster(shared->points, shared->chunk->clusters, &shared->points->points[index]);
    struct light_run run =
        cut_list(shared->chunk->clusters, row[1], shared->chunk->first, shared->chunk->count);
    row[0] = (uint32_t)atomic_fetch_add(shared->filter_count, count_filters(shared->shadows, &run));
}

static void run_tiles(void *argument)
{
    struct worker *worker = argument;
    struct rt_job *job = worker->base.job;
    const struct raytrace_shadow_points *points = worker->shared->points;
    for (int tile = rt_job_next(job, false); tile >= 0; tile = rt_job_next(job, true)) {
        rt_points_visit_tile(points, tile, job, place_point, worker);
        assert(atomic_load(worker->shared->filter_count) <= worker->shared->chunk->capacity);
        rt_points_visit_tile(points, tile, job, ask_lights, worker);
    }
    rt_shadow_rays_flush(&worker->base.rays);
    rt_point_worker_end(&worker->base);
}

static bool worker_init(void *argument, struct rt_job *job, struct error *err)
{
    struct worker *worker = argument;
    worker->shared = job->shared;
    worker->base.rays.filters = worker->shared->chunk->filters;
    return rt_point_worker_init(&worker->base, worker->shared->shadows, job, err);
}

void raytrace_shadows_resume(struct raytrace_shadows *shadows)
{
    bool is_same = rt_scene_rebind(shadows->scene, shadows->desc.state, shadows->desc.view);
    assert(is_same);
}

uint32_t raytrace_shadows_filters(const struct raytrace_shadows *shadows, uint32_t light)
{
    return shadows->filters[light];
}

uint64_t raytrace_shadows_most_filters(const struct raytrace_shadows *shadows, uint32_t light_count)
{
    return (uint64_t)light_count * shadows->filters_max;
}

/* Whether the filters of all lights have room: by their number in each cluster, where most lights
 * have fewer than the one with most. */
static bool all_have_room(const struct raytrace_shadows *shadows,
                          const struct raytrace_shadow_points *points,
                          const struct clusters *clusters, size_t capacity)
{
    size_t cluster_count =
        (size_t)clusters->columns * (size_t)clusters->rows * (size_t)clusters->slices;
    size_t *counts = calloc(cluster_count, sizeof *counts); /* and one; 0: not known */
    size_t used = 0;
    for (size_t i = 0; counts && i < points->count && used <= capacity; i++) {
        uint32_t cluster = find_cluster(points, clusters, &points->points[i]);
        if (!counts[cluster]) {
            struct light_run run = cut_list(clusters, cluster, 0, UINT32_MAX);
            counts[cluster] = count_filters(shadows, &run) + 1;
        }
        used += counts[cluster] - 1;
    }
    free(counts);
    return counts && used <= capacity;
}

uint32_t raytrace_shadows_room(const struct raytrace_shadows *shadows,
                               const struct raytrace_shadow_points *points,
                               const struct clusters *clusters, size_t capacity)
{
    const uint32_t longest = clusters->longest;
    size_t per_light = shadows->filters_max;
    if (points->count * longest <= capacity / per_light ||
        (per_light > 1 && all_have_room(shadows, points, clusters, capacity)))
        return longest;                                         /* all that there are */
    size_t *lists = calloc((size_t)longest + 1, sizeof *lists); /* by length */
    size_t reaching = points->count, filters = 0;               /* lists that are longer */
    uint32_t room = 0;
    if (!lists) /* any bound will do */
        return (uint32_t)(capacity / per_light / points->count);
    for (size_t i = 0; i < points->count; i++) {
        uint32_t cluster = find_cluster(points, clusters, &points->points[i]);
        lists[clusters->prefix_count + clusters->heads[2 * (size_t)cluster + 1]]++;
    }
    for (; room < longest; room++) {
        reaching -= lists[room];
        filters += reaching * per_light;
        if (filters > capacity)
            break;
    }
    free(lists);
    return room;
}

bool raytrace_shadows_trace(struct raytrace_shadows *shadows,
                            const struct raytrace_shadow_points *points,
                            struct raytrace_shadow_chunk *chunk, struct raytrace_stats *stats,
                            struct error *err)
{
    static const struct rt_form form = {.worker_bytes = sizeof(struct worker),
                                        .init = worker_init,
                                        .run = run_tiles,
                                        .finish = rt_point_worker_finish};
    atomic_size_t filter_count = 0;
    struct shared shared = {
        .shadows = shadows, .points = points, .chunk = chunk, .filter_count = &filter_count};
    const struct rt_points_run run = {
        .shadows = shadows, .points = points, .shared = &shared, .subject = "shadows"};
    bool is_traced = rt_points_run(&run, &form, &stats->trace_ms, stats, err);
    chunk->filter_count = atomic_load(&filter_count);
    return is_traced;
}

struct raytrace_shadows *raytrace_shadows_create(const struct raytrace_desc *desc,
                                                 const bool *is_shadowed,
                                                 struct raytrace_stats *stats, struct error *err)
{
    struct raytrace_shadows *shadows = calloc(1, sizeof *shadows);
    size_t lights = desc->state->light_count;
    double begin_ms = wall_ms();
    *stats = (struct raytrace_stats){0};
    if (shadows)
        shadows->filters = calloc(lights + 1, sizeof *shadows->filters);
    if (!shadows || !shadows->filters) {
        error_set(err, ERROR_NO_MEMORY, "traced shadows of %zu lights", lights);
        goto fail;
    }
    shadows->desc = *desc;
    shadows->desc.asks_all_lights = true; /* the points bring their clusters */
    if (!rt_job_take_scene(desc, &shadows->own, &shadows->scene, &stats->is_scene_reused, err) ||
        !rt_light_set_init(&shadows->light_set, shadows->scene, &shadows->desc, err))
        goto fail;
    shadows->farthest_m = 1.001 * rt_points_farthest(desc);
    shadows->filters_max = 1;
    for (size_t i = 0; i < lights; i++) {
        shadows->light_set.records[i].casts_shadow = is_shadowed[i]; /* into haze */
        shadows->filters[i] = is_shadowed[i] ? shadows->light_set.records[i].samples : 0;
        if (shadows->filters[i] > shadows->filters_max)
            shadows->filters_max = shadows->filters[i];
    }
    stats->build_ms = wall_ms() - begin_ms;
    stats->scene_bytes = rt_scene_size_bytes(shadows->scene);
    return shadows;

fail:
    raytrace_shadows_destroy(shadows);
    return NULL;
}

void raytrace_shadows_destroy(struct raytrace_shadows *shadows)
{
    if (!shadows)
        return;
    rt_light_set_finish(&shadows->light_set);
    rt_scene_finish(&shadows->own);
    free(shadows->filters);
    free(shadows);
}
