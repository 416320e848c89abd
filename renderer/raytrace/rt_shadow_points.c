/* SPDX-License-Identifier: MIT */
/* Points of rasterised surfaces, as rays need them: in the world, off the surface. */
#include "renderer/raytrace/rt_shadow_points.h"

#include "renderer/base/matrix.h"
#include "renderer/base/wall_clock.h"
#include "renderer/raytrace/rt_terminator.h"

/* What rasterised positions are off by: of their distance from the eye, as shadow_query.glsl has
 * it; and of a pixel's width, on surfaces that lean, since rasterisers snap vertices to 1/256 of a
 * pixel in both directions. */
static const double EYE_ROUNDING = 5e-7, SNAPPING = 1 / 256.0;

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

double rt_points_farthest(const struct raytrace_desc *desc)
{
    const struct scene_state *state = desc->state;
    double offset[3];
    if (!(state->bounds_min[0] <= state->bounds_max[0]))
        return 0;
    for (int k = 0; k < 3; k++)
        offset[k] = fmax(fabs(state->bounds_min[k] - desc->camera->eye[k]),
                         fabs(state->bounds_max[k] - desc->camera->eye[k]));
    if (!state->ground_plane.is_there)
        return vec3_length(offset);
    double to_ground[3];
    vec3_sub(state->ground_plane.center, desc->camera->eye, to_ground);
    return fmax(vec3_length(offset), vec3_length(to_ground) + 2 * state->ground_plane.reach_m);
}

/* Where a pane is seen edge on, the middle of a pixel that it covers in part may show the pane's
 * plane far behind the scene, or behind its horizon. */
static void keep_in_scene(const struct raytrace_shadows *shadows, double from_eye[3])
{
    double distance = vec3_length(from_eye);
    for (int k = 0; k < 3 && !(distance <= shadows->farthest_m); k++)
        from_eye[k] *= shadows->farthest_m / distance;
}

static uint32_t seed_of(const struct raytrace_shadow_points *points,
                        const struct shadow_point *point)
{
    uint32_t width = (uint32_t)points->width, pixel = rt_point_pixel(point);
    return rt_job_seed(points->image_x + (int)(pixel % width),
                       points->image_y_bottom - (int)(pixel / width), 0);
}

/* Where the shading normal is not the triangle's: a short ray finds the triangle again, of which
 * the rasteriser tells no more, and the point goes where rt_terminator.h has it. */
static void leave_smooth_surface(const struct rt_scene *scene, struct rt_hits *hits,
                                 struct rt_point *p)
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

void rt_point_begin(struct rt_point *p, const struct raytrace_shadows *shadows,
                    struct rt_hits *scratch, const struct raytrace_shadow_points *points,
                    size_t index)
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
    for (int k = 0; k < 3; k++)
        p->view[k] = camera->is_orthographic ? along[k] : -along[k];
    p->roughness = (point->pixel_roughness >> SHADOW_POINT_PIXEL_BITS) / 255.0;
    double leaning = sqrt(fmax(1 - facing * facing, 0));
    p->job.offset_m = (float)(scene->nudge_m + EYE_ROUNDING * sqrt(square) +
                              SNAPPING * p->footprint_m * leaning + curved);
    p->job.skip_mesh = p->job.skip_triangle = UINT32_MAX;
    if (index >= points->layer_count)
        leave_smooth_surface(scene, scratch, p);
}

/* A pixel's points are two runs: of layers, of opaque surfaces. */
struct pixel_points {
    size_t first[2], count[2];
};

static struct pixel_points points_of_pixel(const struct raytrace_shadow_points *points,
                                           size_t pixel)
{
    struct pixel_points found = {.first = {0, points->layer_count + (points->heads[pixel] >> 3)},
                                 .count = {0, points->heads[pixel] & 7}};
    if (points->layer_ends) {
        found.first[0] = pixel ? points->layer_ends[pixel - 1] : 0;
        found.count[0] = points->layer_ends[pixel] - found.first[0];
    }
    return found;
}

/* Of tiles. */
static int columns_of(const struct raytrace_shadow_points *points)
{
    return (points->width + RT_POINTS_TILE_PX - 1) / RT_POINTS_TILE_PX;
}

static int count_tiles(const struct raytrace_shadow_points *points)
{
    int rows = (points->height + RT_POINTS_TILE_PX - 1) / RT_POINTS_TILE_PX;
    return columns_of(points) * rows;
}

static void visit_pixel(const struct raytrace_shadow_points *points, size_t pixel,
                        void (*visit)(void *context, size_t index), void *context)
{
    struct pixel_points found = points_of_pixel(points, pixel);
    for (int i = 0; i < 2; i++)
        for (size_t k = 0; k < found.count[i]; k++)
            if (!(points->points[found.first[i] + k].flags & SHADOW_POINT_UNLIT))
                visit(context, found.first[i] + k);
}

void rt_points_visit_tile(const struct raytrace_shadow_points *points, int tile, struct rt_job *job,
                          void (*visit)(void *context, size_t index), void *context)
{
    int columns = columns_of(points);
    int x0 = tile % columns * RT_POINTS_TILE_PX, y0 = tile / columns * RT_POINTS_TILE_PX;
    for (int y = y0; y < y0 + RT_POINTS_TILE_PX && y < points->height; y++) {
        if (rt_job_is_cancelled(job))
            return;
        for (int x = x0; x < x0 + RT_POINTS_TILE_PX && x < points->width; x++)
            visit_pixel(points, (size_t)y * (size_t)points->width + (size_t)x, visit, context);
    }
}

bool rt_point_worker_init(struct rt_point_worker *worker, const struct raytrace_shadows *shadows,
                          struct rt_job *job, struct error *err)
{
    worker->job = job;
    return rt_shadow_rays_init(&worker->rays, shadows->scene, &shadows->light_set,
                               shadows->desc.view->quality.blend_filter, err);
}

void rt_point_worker_end(const struct rt_point_worker *worker)
{
    atomic_fetch_add(&worker->job->shadow_rays, worker->rays.ray_count);
    if (worker->rays.has_overflowed)
        atomic_store(&worker->job->has_overflowed, true);
}

void rt_point_worker_finish(void *worker)
{
    rt_shadow_rays_finish(&((struct rt_point_worker *)worker)->rays);
}

bool rt_points_run(const struct rt_points_run *run, const struct rt_form *form, double *took_ms,
                   struct raytrace_stats *stats, struct error *err)
{
    double begin_ms = wall_ms();
    struct rt_job job = {.desc = &run->shadows->desc,
                         .scene = run->shadows->scene,
                         .shared = run->shared,
                         .unit_count = count_tiles(run->points)};
    if (!rt_job_run(&job, form, err))
        return false;
    *took_ms += wall_ms() - begin_ms - job.paused_ms;
    stats->shadow_rays += atomic_load(&job.shadow_rays);
    if (atomic_load(&job.is_cancelled))
        return error_set(err, ERROR_TIMEOUT, "tracing %s was cancelled", run->subject);
    if (atomic_load(&job.has_overflowed))
        return error_set(err, ERROR_OVER_BUDGET, "a ray meets more than %d surfaces", RT_HITS_MAX);
    return true;
}
