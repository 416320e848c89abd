/* SPDX-License-Identifier: MIT */
/* Shadows of given points: tiles of a window on all cores, the lights of each point's cluster. */
#include <assert.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "renderer/base/wall_clock.h"
#include "renderer/raytrace/raytrace_shadows.h"
#include "renderer/raytrace/rt_emitter.h"
#include "renderer/raytrace/rt_job.h"
#include "renderer/raytrace/rt_shadow_rays.h"
#include "renderer/raytrace/rt_terminator.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

enum { TILE_PX = 16 };

/* What rasterised positions are off by: of their distance from the eye, as shadow_query.glsl has
 * it; and of a pixel's width, on surfaces that lean, since rasterisers snap vertices to 1/256 of a
 * pixel in both directions. */
static const double EYE_ROUNDING = 5e-7, SNAPPING = 1 / 256.0;

struct raytrace_shadows {
    struct raytrace_desc desc;
    struct rt_scene own, *scene;
    struct rt_light_set light_set;
    uint32_t *filters; /* of each light at a point: one, or those of an area light's points; 0: it
                          is not shadowed */
    uint32_t filters_max;
    double farthest_m; /* from the eye: no surface is farther */
};

struct shared { /* by the threads of one slice */
    const struct raytrace_shadows *shadows;
    const struct raytrace_shadow_points *points;
    struct raytrace_shadow_slice *slice;
    atomic_size_t *filter_count;
    int columns;
};

struct worker {
    struct rt_job *job;
    const struct shared *shared;
    struct rt_shadow_rays rays;
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

/* oct32 of shaders/base/pack.glsl. */
static void unpack_unit(uint32_t word, float out[3])
{
    float x = fmaxf((float)(int16_t)(word & 0xffff) / 32767, -1);
    float y = fmaxf((float)(int16_t)(word >> 16) / 32767, -1);
    float z = 1 - fabsf(x) - fabsf(y);
    if (z < 0) {
        float wrapped = (1 - fabsf(y)) * (x >= 0 ? 1.0f : -1.0f);
        y = (1 - fabsf(x)) * (y >= 0 ? 1.0f : -1.0f);
        x = wrapped;
    }
    float inverse = 1 / sqrtf(x * x + y * y + z * z);
    out[0] = x * inverse;
    out[1] = y * inverse;
    out[2] = z * inverse;
}

/* Of a shadow_point: view space looks along -z. */
static double view_depth(const struct shadow_point *point)
{
    return -(double)point->position_offset.v[2];
}

/* A position or direction of view space, along the world's axes. */
static void turn_to_world(const struct camera *camera, const float v[3], double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = camera->right[k] * (double)v[0] + camera->up[k] * (double)v[1] +
                 camera->back[k] * (double)v[2];
}

static const double SAME_NORMAL = 1 - 1e-6; /* cosine: what 16 bits a coordinate leave */

static void unpack_normal(const struct camera *camera, uint32_t word, float out[3])
{
    float unit[3];
    double world[3];
    unpack_unit(word, unit);
    turn_to_world(camera, unit, world);
    for (int k = 0; k < 3; k++)
        out[k] = (float)world[k];
}

static uint32_t find_cluster(const struct raytrace_shadow_points *points,
                             const struct clusters *clusters, const struct shadow_point *point)
{
    uint32_t width = (uint32_t)points->width;
    return (uint32_t)clusters_find(clusters, (int)(point->pixel % width),
                                   (int)(point->pixel / width), (float)view_depth(point));
}

static double farthest_from_eye(const struct raytrace_desc *desc)
{
    const struct scene_state *state = desc->state;
    double offset[3];
    if (!(state->bounds_min[0] <= state->bounds_max[0]))
        return 0;
    for (int k = 0; k < 3; k++)
        offset[k] = fmax(fabs(state->bounds_min[k] - desc->camera->eye[k]),
                         fabs(state->bounds_max[k] - desc->camera->eye[k]));
    return vec3_length(offset);
}

/* Where a pane is seen edge on, the middle of a pixel that it covers in part may show the pane's
 * plane far behind the scene, or behind its horizon. */
static void keep_in_scene(const struct raytrace_shadows *shadows, double from_eye[3])
{
    double distance = vec3_length(from_eye);
    for (int k = 0; k < 3 && !(distance <= shadows->farthest_m); k++)
        from_eye[k] *= shadows->farthest_m / distance;
}

struct point_light { /* a point, and what all its rays share */
    struct rt_shadow_job job;
    float normal[3]; /* for shading */
    double footprint_m;
    uint32_t seed; /* of the points on area lights */
    bool transmits;
};

static uint32_t seed_of(const struct raytrace_shadow_points *points,
                        const struct shadow_point *point)
{
    uint32_t width = (uint32_t)points->width;
    return rt_job_seed(points->image_x + (int)(point->pixel % width),
                       points->image_y_bottom - (int)(point->pixel / width), 0);
}

/* Where the shading normal is not the triangle's: a short ray finds the triangle again, of which
 * the rasteriser tells no more, and the point goes where rt_terminator.h has it. */
static void leave_smooth_surface(const struct rt_scene *scene, struct rt_hits *hits,
                                 struct point_light *p)
{
    struct rt_ray ray = {.skip_mesh = UINT32_MAX, .skip_triangle = UINT32_MAX};
    struct rt_smooth_start start;
    double way = 4 * (double)p->job.offset_m, cosine = 0, at[3];
    for (int k = 0; k < 3; k++) {
        cosine += (double)p->job.normal[k] * (double)p->normal[k];
        ray.origin[k] = p->job.point[k] + way * (double)p->job.normal[k];
        ray.direction[k] = -(double)p->job.normal[k];
    }
    if (cosine > SAME_NORMAL)
        return;
    ray.t_max = 2 * way;
    rt_scene_collect(scene, &ray, hits);
    const struct rt_hit *hit = hits->count ? &hits->hits[hits->count - 1] : NULL;
    if (!hit || !hit->is_opaque)
        return;
    for (int k = 0; k < 3; k++)
        at[k] = ray.origin[k] + ray.direction[k] * hit->t;
    if (!rt_terminator_find(scene, hit, at, &start))
        return;
    p->job.skip_mesh = hit->mesh;
    p->job.skip_triangle = hit->triangle;
    for (int k = 0; k < 3; k++) {
        p->job.point[k] = at[k] + start.offset[k];
        p->job.normal[k] = (float)start.normal[k];
    }
}

static void begin_point(const struct raytrace_shadows *shadows, struct rt_hits *scratch,
                        const struct raytrace_shadow_points *points, size_t index,
                        struct point_light *p)
{
    const struct shadow_point *point = &points->points[index];
    const struct camera *camera = shadows->desc.camera;
    const struct rt_scene *scene = shadows->scene;
    double pixel = 2 * camera->half_height / shadows->desc.view->height_px, square = 0;
    double along[3], from_eye[3]; /* along: from the eye, not unit */
    unpack_normal(camera, point->geo_normal, p->job.normal);
    unpack_normal(camera, point->normal, p->normal);
    turn_to_world(camera, point->position_offset.v, from_eye);
    keep_in_scene(shadows, from_eye);
    p->footprint_m = camera->is_orthographic ? pixel : pixel * -vec3_dot(from_eye, camera->back);
    p->transmits = point->flags & SHADOW_POINT_TRANSMITS;
    p->job.excluded_node = point->flags >> SHADOW_POINT_EXCLUDED_NODE;
    p->seed = seed_of(points, point);
    for (int k = 0; k < 3; k++) {
        p->job.point[k] = camera->eye[k] + from_eye[k] - scene->origin[k];
        square += from_eye[k] * from_eye[k];
        along[k] = camera->is_orthographic ? camera->back[k] : from_eye[k];
    }
    double curved = fmin((double)point->position_offset.v[3], p->footprint_m);
    vec3_normalize(along);
    double facing = 0;
    for (int k = 0; k < 3; k++)
        facing += along[k] * (double)p->job.normal[k];
    double leaning = sqrt(fmax(1 - facing * facing, 0));
    p->job.offset_m = (float)(scene->nudge_m + EYE_ROUNDING * sqrt(square) +
                              SNAPPING * p->footprint_m * leaning + curved);
    p->job.skip_mesh = p->job.skip_triangle = UINT32_MAX;
    if (index >= points->entry_count)
        leave_smooth_surface(scene, scratch, p);
}

/* Where the light is, seen from the point: of an area light, its index-th point. False when none of
 * it arrives there. */
static bool face_light(const struct raytrace_shadows *shadows, struct point_light *p,
                       uint32_t index)
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
static bool faces_away(const struct point_light *p)
{
    double along = 0;
    for (int k = 0; k < 3; k++)
        along += (double)p->normal[k] * (double)p->job.direction[k];
    return !p->transmits && along < -1e-3 - p->footprint_m / (double)p->job.distance_m;
}

static void ask_light(struct worker *worker, struct point_light *p)
{
    const struct raytrace_shadows *shadows = worker->shared->shadows;
    for (uint32_t i = 0; i < shadows->filters[p->job.light]; i++, p->job.filter++) {
        if (face_light(shadows, p, i) && !faces_away(p))
            rt_shadow_rays_add(&worker->rays, &p->job);
        else /* nothing comes from there, or so little that its shadow does not matter */
            rt_shadow_pack((const double[3]){1, 1, 1},
                           worker->shared->slice->filters[p->job.filter]);
    }
}

static void ask_lights(struct worker *worker, size_t index)
{
    const struct shared *shared = worker->shared;
    const struct raytrace_shadow_slice *slice = shared->slice;
    struct light_run run =
        cut_list(slice->clusters, slice->table[index][1], slice->first, slice->count);
    struct point_light p;
    begin_point(shared->shadows, &worker->rays.scratch, shared->points, index, &p);
    p.job.filter = slice->table[index][0];
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

/* A pixel's points are two runs: of list entries, of surfaces. */
struct pixel_points {
    size_t first[2], count[2];
};

static struct pixel_points points_of_pixel(const struct raytrace_shadow_points *points,
                                           size_t pixel)
{
    struct pixel_points found = {.first = {0, points->entry_count + (points->heads[pixel] >> 3)},
                                 .count = {0, points->heads[pixel] & 7}};
    if (points->entry_ends) {
        found.first[0] = pixel ? points->entry_ends[pixel - 1] : 0;
        found.count[0] = points->entry_ends[pixel] - found.first[0];
    }
    return found;
}

/* Calls `visit` for each point of the tile that light is asked for. */
static void visit_tile(struct worker *worker, int tile,
                       void (*visit)(struct worker *worker, size_t index))
{
    const struct raytrace_shadow_points *points = worker->shared->points;
    int x0 = tile % worker->shared->columns * TILE_PX,
        y0 = tile / worker->shared->columns * TILE_PX;
    for (int y = y0; y < y0 + TILE_PX && y < points->height; y++) {
        if (rt_job_is_cancelled(worker->job))
            return;
        for (int x = x0; x < x0 + TILE_PX && x < points->width; x++) {
            size_t pixel = (size_t)y * (size_t)points->width + (size_t)x;
            struct pixel_points found = points_of_pixel(points, pixel);
            for (int i = 0; i < 2; i++)
                for (size_t k = 0; k < found.count[i]; k++)
                    if (!(points->points[found.first[i] + k].flags & SHADOW_POINT_UNLIT))
                        visit(worker, found.first[i] + k);
        }
    }
}

static void place_point(struct worker *worker, size_t index)
{
    const struct shared *shared = worker->shared;
    uint32_t *row = shared->slice->table[index];
    row[1] = find_cluster(shared->points, shared->slice->clusters, &shared->points->points[index]);
    struct light_run run =
        cut_list(shared->slice->clusters, row[1], shared->slice->first, shared->slice->count);
    row[0] = (uint32_t)atomic_fetch_add(shared->filter_count, count_filters(shared->shadows, &run));
}

static void run_tiles(void *argument)
{
    struct worker *worker = argument;
    struct rt_job *job = worker->job;
    for (int tile = rt_job_next(job, false); tile >= 0; tile = rt_job_next(job, true)) {
        visit_tile(worker, tile, place_point);
        assert(atomic_load(worker->shared->filter_count) <= worker->shared->slice->capacity);
        visit_tile(worker, tile, ask_lights);
    }
    rt_shadow_rays_flush(&worker->rays);
    atomic_fetch_add(&job->shadow_rays, worker->rays.ray_count);
    if (worker->rays.has_overflowed)
        atomic_store(&job->has_overflowed, true);
}

static bool worker_init(void *argument, struct rt_job *job, struct error *err)
{
    struct worker *worker = argument;
    const struct shared *shared = job->shared;
    const struct raytrace_shadows *shadows = shared->shadows;
    worker->job = job;
    worker->shared = shared;
    worker->rays.filters = shared->slice->filters;
    return rt_shadow_rays_init(&worker->rays, shadows->scene, &shadows->light_set,
                               shadows->desc.view->quality.blend_filter, err);
}

static void worker_finish(void *argument)
{
    rt_shadow_rays_finish(&((struct worker *)argument)->rays);
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
                            struct raytrace_shadow_slice *slice, struct raytrace_stats *stats,
                            struct error *err)
{
    static const struct rt_form form = {.worker_bytes = sizeof(struct worker),
                                        .init = worker_init,
                                        .run = run_tiles,
                                        .finish = worker_finish};
    double begin_ms = wall_ms();
    atomic_size_t filter_count = 0;
    struct shared shared = {.shadows = shadows,
                            .points = points,
                            .slice = slice,
                            .filter_count = &filter_count,
                            .columns = (points->width + TILE_PX - 1) / TILE_PX};
    struct rt_job job = {.desc = &shadows->desc,
                         .scene = shadows->scene,
                         .shared = &shared,
                         .unit_count = shared.columns * ((points->height + TILE_PX - 1) / TILE_PX)};
    if (!rt_job_run(&job, &form, err))
        return false;
    slice->filter_count = atomic_load(&filter_count);
    stats->trace_ms += wall_ms() - begin_ms - job.paused_ms;
    stats->shadow_rays += atomic_load(&job.shadow_rays);
    if (atomic_load(&job.is_cancelled))
        return error_set(err, ERROR_TIMEOUT, "tracing shadows was cancelled");
    if (atomic_load(&job.has_overflowed))
        return error_set(err, ERROR_OVER_BUDGET, "a ray meets more than %d surfaces", RT_HITS_MAX);
    return true;
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
    shadows->farthest_m = 1.001 * farthest_from_eye(desc);
    shadows->filters_max = 1;
    for (size_t i = 0; i < lights; i++) {
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
