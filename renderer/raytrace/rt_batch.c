/* SPDX-License-Identifier: MIT */
/* Gathering surfaces of pixels, and compositing them. Lighting is in rt_batch_light.c. */
#include "renderer/raytrace/rt_batch.h"

#include <stdlib.h>

#include "protocol/quality_defaults.h"
#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_batch_light.h"
#include "renderer/raytrace/rt_batch_refine.h"
#include "renderer/raytrace/rt_environment.h"
#include "renderer/raytrace/rt_haze.h"
#include "renderer/raytrace/rt_haze_glow.h"
#include "renderer/raytrace/rt_job.h"
#include "renderer/raytrace/rt_path.h"
#include "renderer/raytrace/rt_pixel.h"
#include "renderer/raytrace/rt_whole.h"

enum { BATCH_FRAGMENTS = 4096 }; /* 1.2 MB with all that belongs to them */

static const double SAME_LEAN = 0.99;     /* cosine: 8 degrees */
static const double SAME_PLANE_PX = 0.25; /* what lies farther off is another layer of the mesh */

/* Surfaces beyond a bend are lit ray by ray: a quarter of the directions towards a map is enough
 * for what is seen through glass. */
static bool init_walker(struct rt_batch *batch, struct error *err)
{
    const struct rt_batch_desc *desc = &batch->desc;
    const struct rt_scene *scene = desc->scene;
    uint32_t towards_map = rt_environment_count(desc->environment, &desc->view->quality);
    for (size_t i = 0; i < scene->mesh_count; i++)
        batch->has_bends |= scene->meshes[i].bend != STATE_BEND_NONE;
    if (!batch->has_bends)
        return true;
    batch->beyond = *desc->view;
    batch->beyond.quality.environment_samples = (int)(towards_map + 3) / 4;
    if (!batch->has_grids) /* those take as many points as before the bend */
        batch->beyond.quality.atmosphere_samples =
            (quality_or(desc->view->quality.atmosphere_samples, ATMOSPHERE_SLICES_DEFAULT) + 15) /
            16;
    return rt_walker_init(
        &batch->walker,
        &(struct rt_walker_desc){.scene = scene,
                                 .view = &batch->beyond,
                                 .environment = desc->environment,
                                 .branches = rt_walk_branches(desc->view, desc->samples),
                                 .way = (const double(*)[3])desc->way,
                                 .is_orthographic = desc->camera->is_orthographic},
        err);
}

static bool init_smoke(struct rt_batch *batch, struct error *err)
{
    const struct rt_batch_desc *desc = &batch->desc;
    bool ok = rt_lighting_init(&batch->smoke, desc->scene, desc->view, err);
    batch->smoke.environment = desc->environment;
    return ok;
}

bool rt_batch_init(struct rt_batch *batch, const struct rt_batch_desc *desc, struct error *err)
{
    batch->desc = *desc;
    batch->has_grids = desc->scene->state->grid_count;
    batch->has_air = desc->haze || batch->has_grids;
    batch->light_counts = calloc(2 * rt_batch_light_slots(batch), sizeof *batch->light_counts);
    batch->jobs = malloc(RT_BATCH_JOBS_MAX * sizeof *batch->jobs); /* touched when needed */
    batch->sorted = malloc(RT_BATCH_JOBS_MAX * sizeof *batch->sorted);
    batch->blocks = calloc(1, sizeof *batch->blocks);
    if (!batch->light_counts || !batch->jobs || !batch->sorted || !batch->blocks)
        return error_set(err, ERROR_NO_MEMORY, "%d waiting shadow rays", RT_BATCH_JOBS_MAX);
    return rt_packet_init(&batch->packet, desc->scene, err) && rt_hits_init(&batch->scratch, err) &&
           init_walker(batch, err) && (!batch->has_air || init_smoke(batch, err)) &&
           rt_wholes_create(&batch->wholes, batch, err);
}

void rt_batch_finish(struct rt_batch *batch)
{
    free(batch->fragments);
    free(batch->shadings);
    free(batch->starts);
    free(batch->steps);
    free(batch->air);
    free(batch->sample_ends);
    free(batch->points);
    free(batch->pixels);
    free(batch->jobs);
    free(batch->sorted);
    free(batch->blocks);
    free(batch->light_counts);
    rt_packet_finish(&batch->packet);
    rt_hits_finish(&batch->scratch);
    rt_walker_finish(&batch->walker);
    rt_lighting_finish(&batch->smoke);
    free(batch->bent);
    rt_wholes_destroy(batch->wholes);
    *batch = (struct rt_batch){0};
}

static bool reserve(void **array, size_t *capacity, size_t count, size_t item_bytes)
{
    if (count <= *capacity)
        return true;
    size_t grown = 2 * count + 1024;
    void *moved = realloc(*array, grown * item_bytes);
    if (!moved)
        return false;
    *array = moved;
    *capacity = grown;
    return true;
}

bool rt_batch_reserve_fragments(struct rt_batch *batch, size_t count)
{
    size_t capacities[3] = {batch->fragment_capacity, batch->fragment_capacity,
                            batch->fragment_capacity};
    if (count <= batch->fragment_capacity)
        return true;
    void *fragments = batch->fragments, *shadings = batch->shadings, *starts = batch->starts;
    bool ok = reserve(&fragments, &capacities[0], count, sizeof *batch->fragments) &&
              reserve(&shadings, &capacities[1], count, sizeof *batch->shadings) &&
              reserve(&starts, &capacities[2], count, sizeof *batch->starts);
    batch->fragments = fragments;
    batch->shadings = shadings;
    batch->starts = starts;
    if (ok)
        batch->fragment_capacity = capacities[0];
    return ok;
}

/* Mostly so, and told by few comparisons. */
static bool has_room(const struct rt_batch *batch, size_t hits)
{
    return batch->fragment_count + hits <= batch->fragment_capacity &&
           batch->step_count + hits < batch->step_capacity &&
           batch->sample_count < batch->sample_capacity &&
           batch->pixel_count < batch->pixel_capacity && !batch->has_air && !batch->has_bends;
}

static bool reserve_for(struct rt_batch *batch, const struct rt_sample *sample)
{
    void *steps = batch->steps, *ends = batch->sample_ends, *pixels = batch->pixels;
    void *points = batch->points, *bent = batch->bent, *air = batch->air;
    size_t hits = sample->hits->count, point_capacity = batch->sample_capacity;
    bool ok =
        rt_batch_reserve_fragments(batch, batch->fragment_count + hits) &&
        reserve(&steps, &batch->step_capacity, batch->step_count + hits + 1,
                sizeof *batch->steps) &&
        reserve(&points, &point_capacity, batch->sample_count + 1, sizeof *batch->points) &&
        reserve(&ends, &batch->sample_capacity, batch->sample_count + 1,
                sizeof *batch->sample_ends) &&
        reserve(&pixels, &batch->pixel_capacity, batch->pixel_count + 1, sizeof *batch->pixels) &&
        (!batch->has_air ||
         reserve(&air, &batch->air_capacity, batch->step_count + hits + 1, sizeof *batch->air)) &&
        (!batch->has_bends ||
         reserve(&bent, &batch->bent_capacity, batch->bent_count + 1, sizeof *batch->bent));
    batch->steps = steps;
    batch->air = air;
    batch->points = points;
    batch->bent = bent;
    batch->sample_ends = ends;
    batch->pixels = pixels;
    return ok;
}

bool rt_batch_continues(const struct rt_batch *batch, const double known[3], const double own[3],
                        const double offset[3], double t)
{
    double pixel_m = vec3_length(batch->desc.way[0]);
    if (!batch->desc.camera->is_orthographic)
        pixel_m *= t;
    return vec3_dot(known, own) >= SAME_LEAN &&
           fabs(vec3_dot(known, offset)) <= SAME_PLANE_PX * pixel_m;
}

static bool continues(const struct rt_batch *batch, const struct rt_fragment *fragment,
                      const struct rt_sample *sample, const struct rt_hit *hit)
{
    double known[3], own[3], offset[3], count = fragment->sum.count;
    rt_scene_normal(batch->desc.scene, &fragment->hit, known);
    rt_scene_normal(batch->desc.scene, hit, own);
    for (int k = 0; k < 3; k++)
        offset[k] = sample->ray->origin[k] + sample->ray->direction[k] * hit->t -
                    fragment->sum.point[k] / count;
    return rt_batch_continues(batch, known, own, offset, hit->t);
}

static bool is_same_surface(const struct rt_batch *batch, const struct rt_fragment *fragment,
                            const struct rt_sample *sample, const struct rt_hit *hit,
                            bool is_opaque)
{
    const struct rt_hit *known = &fragment->hit;
    if (known->mesh != hit->mesh || fragment->part != sample->part ||
        fragment->is_opaque != is_opaque || known->is_front != hit->is_front)
        return false;
    return known->triangle == hit->triangle ||
           (is_opaque && continues(batch, fragment, sample, hit));
}

static uint32_t add_texel(struct rt_batch *batch, size_t index, const struct rt_hit *hit)
{
    struct rt_fragment *fragment = &batch->fragments[index];
    if (fragment->texel_count < RT_TEXELS_MAX - 1)
        fragment->texels[fragment->texel_count++] =
            (struct rt_texel){hit->triangle, (float)hit->u, (float)hit->v};
    return (uint32_t)index;
}

/* The pixel's fragment for a hit: one that an earlier sample made, or a new one. guess: where to
 * look first, since samples of a pixel mostly cross the same surfaces in the same order. */
static uint32_t find_fragment(struct rt_batch *batch, const struct rt_sample *sample,
                              const struct rt_hit *hit, bool is_opaque, size_t guess)
{
    guess += batch->pixel_fragments;
    if (guess < batch->fragment_count &&
        is_same_surface(batch, &batch->fragments[guess], sample, hit, is_opaque))
        return add_texel(batch, guess, hit);
    for (size_t i = batch->pixel_fragments; sample->index && i < batch->fragment_count; i++)
        if (is_same_surface(batch, &batch->fragments[i], sample, hit, is_opaque))
            return add_texel(batch, i, hit);
    struct rt_fragment *made = &batch->fragments[batch->fragment_count];
    made->hit = *hit; /* its texels are written before they are read */
    made->x = sample->x;
    made->y = sample->y;
    made->part = sample->part;
    made->is_opaque = is_opaque;
    made->sample_count = made->sum.count = made->texel_count = 0;
    return (uint32_t)batch->fragment_count++;
}

static void find_point(const struct rt_sample *sample, const struct rt_hit *hit,
                       struct rt_point *point)
{
    point->hit = *hit;
    for (int k = 0; k < 3; k++) {
        point->direction[k] = sample->ray->direction[k];
        point->point[k] = sample->ray->origin[k] + sample->ray->direction[k] * hit->t;
    }
}

void rt_fragment_add(struct rt_fragment *fragment, const struct rt_point *point)
{
    fragment->sample_count++;
    if (fragment->hit.triangle != point->hit.triangle)
        return;                   /* its neighbour: barycentric weights mean something else there */
    if (!fragment->sum.count++) { /* the first, as most are */
        fragment->sum.u = point->hit.u;
        fragment->sum.v = point->hit.v;
        memcpy(fragment->sum.point, point->point, sizeof point->point);
        memcpy(fragment->sum.direction, point->direction, sizeof point->direction);
        return;
    }
    fragment->sum.u += point->hit.u;
    fragment->sum.v += point->hit.v;
    for (int k = 0; k < 3; k++) {
        fragment->sum.point[k] += point->point[k];
        fragment->sum.direction[k] += point->direction[k];
    }
}

void rt_batch_footprint(const struct rt_batch *batch, const struct rt_hit *hit, double view_z,
                        const double direction[3], struct rt_footprint *footprint)
{
    double way[2][3], scale = batch->desc.camera->is_orthographic ? 1 : view_z;
    for (int i = 0; i < 6; i++)
        way[i / 3][i % 3] = batch->desc.way[i / 3][i % 3] * scale;
    rt_footprint_find(batch->desc.scene, hit, (const double(*)[3])way, direction, footprint);
}

static void begin_media(struct rt_batch *batch, const struct rt_sample *sample, double sigma[3])
{
    if (batch->desc.camera->is_orthographic)
        rt_media_at(batch->desc.scene, sample->ray->origin, &batch->scratch, sigma);
    else
        memcpy(sigma, batch->desc.eye_sigma, sizeof batch->desc.eye_sigma);
}

static void filter_unseen(const struct rt_batch *batch, const struct rt_hit *hit,
                          const double direction[3], double through[3])
{
    struct rt_footprint footprint;
    rt_batch_footprint(batch, hit, hit->t, direction, &footprint); /* t is depth */
    rt_filter_unseen(batch->desc.scene, hit, &footprint, direction, through);
}

/* What the air has scattered since the last step is that of the one that begins. */
static void take_air(struct rt_batch *batch, size_t step)
{
    for (int k = 0; k < 3 && batch->has_air; k++) {
        batch->air[step][k] = (float)batch->sight.light[k];
        batch->sight.light[k] = 0;
    }
}

/* A surface on the sample's way: its step. */
static void add_step(struct rt_batch *batch, const struct rt_sample *sample, size_t hit,
                     double through[3])
{
    const struct rt_hit *met = &sample->hits->hits[hit];
    take_air(batch, batch->step_count);
    struct rt_step *step = &batch->steps[batch->step_count++];
    step->fragment = find_fragment(batch, sample, met, met->is_opaque, hit);
    struct rt_point other, *point = met->is_opaque ? &batch->points[batch->sample_count] : &other;
    find_point(sample, met, point);
    rt_fragment_add(&batch->fragments[step->fragment], point);
    for (int k = 0; k < 3; k++)
        step->through[k] = (float)through[k], through[k] = 1;
}

/* The ray goes on in other directions. Where it enters, the surface is one of the batch. */
static void add_bend(struct rt_batch *batch, const struct rt_sample *sample, size_t hit,
                     const double sigma[3], double through[3])
{
    const struct rt_hit *met = &sample->hits->hits[hit];
    struct rt_walker *walker = &batch->walker;
    struct rt_walk_turn turn = {.hit = met,
                                .origin = sample->ray->origin,
                                .direction = sample->ray->direction,
                                .is_lit = met->is_front && !met->is_hidden};
    memcpy(turn.sigma, sigma, sizeof turn.sigma);
    if (turn.is_lit)
        add_step(batch, sample, hit, through);
    walker->lighting.seed = rt_job_seed(sample->x, sample->y, sample->index);
    rt_walk_on(walker, &turn, &batch->bent[batch->bent_count++]);
    batch->has_overflowed |= walker->has_overflowed || walker->lighting.has_overflowed;
    batch->points[batch->sample_count].bent = (uint32_t)batch->bent_count;
}

static void begin_air(struct rt_batch *batch, const struct rt_sample *sample)
{
    const double place[2] = {sample->x + sample->place[0], sample->y + sample->place[1]};
    if (batch->desc.haze)
        rt_haze_sight_begin(&batch->sight, batch->desc.haze, sample->ray, place);
    batch->smoke.seed = rt_job_seed(sample->x, sample->y, sample->index);
}

/* Haze between two numbers of the ray's direction, and the media around it. */
static void pass_even(struct rt_batch *batch, const struct rt_haze_way *way, double through[3])
{
    if (batch->desc.haze)
        rt_haze_sight_pass(&batch->sight, way->to, isfinite(way->to) ? way->sigma : NULL, through);
    if (isfinite(way->to) && batch->desc.scene->state->medium_count)
        rt_media_pass(way->sigma, way->ray, way->range, way->from, way->to, through);
}

/* Haze before, inside and behind grids, in steps: in the middle of each the grids dim it. */
static void pass_through_grids(struct rt_batch *batch, const struct rt_haze_way *way,
                               double through[3])
{
    enum { STEPS = 32 };
    const struct rt_grid_lines *grids = &batch->smoke.grids;
    double first = INFINITY, last = way->from, before[3] = {1, 1, 1};
    for (size_t i = 0; i < grids->count; i++) {
        first = fmin(first, grids->lines[i].at[0]);
        last = fmax(last, grids->lines[i].at[grids->lines[i].count - 1]);
    }
    struct rt_haze_way step = *way;
    for (int i = -1; i <= STEPS; i++) {
        double open[3] = {1, 1, 1}, share = (i + 1.) / STEPS;
        step.to = i == STEPS ? way->to : first + share * (last - first);
        rt_grid_lines_pass(grids, i == STEPS ? last : 0.5 * (step.from + step.to), open);
        for (int k = 0; k < 3; k++) {
            through[k] *= before[k] > 0 ? open[k] / before[k] : 0;
            before[k] = open[k];
        }
        pass_even(batch, &step, through);
        step.from = step.to;
    }
}

/* Haze begins at the eye, rays of orthographic cameras only at the near plane. */
static void add_glows(struct rt_batch *batch, const struct rt_haze_way *way,
                      const double through[3])
{
    const struct camera *camera = batch->desc.camera;
    struct rt_haze_way whole = *way;
    if (camera->is_orthographic && whole.from == 0)
        whole.from = -camera->z_near;
    rt_haze_glows_add(&batch->sight, &batch->smoke, &whole, through, batch->sight.light);
}

/* What lies between two numbers of the ray's direction, beside surfaces. */
static void pass_air(struct rt_batch *batch, const struct rt_haze_way *way, double through[3])
{
    if (batch->has_grids)
        rt_haze_add_grids(&batch->smoke, way, through, batch->sight.light);
    if (batch->desc.haze)
        add_glows(batch, way, through);
    if (!batch->has_grids || !batch->smoke.grids.count)
        pass_even(batch, way, through);
    else if (batch->desc.haze)
        pass_through_grids(batch, way, through);
    else {
        rt_grid_lines_pass(&batch->smoke.grids, way->to, through);
        pass_even(batch, way, through);
    }
}

/* Or goes on in other directions, which are seen apart. */
static bool ends_on_surface(const struct rt_batch *batch, const struct rt_hits *hits)
{
    return batch->points[batch->sample_count].bent ||
           (hits->count && hits->hits[hits->count - 1].is_opaque);
}

bool rt_batch_add(struct rt_batch *batch, const struct rt_sample *sample)
{
    const struct rt_scene *scene = batch->desc.scene;
    if (!has_room(batch, sample->hits->count) && !reserve_for(batch, sample))
        return false;
    if (sample->index == 0) {
        batch->pixel_fragments = batch->fragment_count;
        batch->pixels[batch->pixel_count][0] = sample->x;
        batch->pixels[batch->pixel_count++][1] = sample->y;
    }
    batch->has_overflowed |= sample->hits->has_overflowed;
    double through[3] = {1, 1, 1}, range[2];
    struct rt_haze_way way = {.ray = sample->ray, .range = range};
    batch->points[batch->sample_count].bent = 0;
    memcpy(batch->points[batch->sample_count].direction, sample->ray->direction,
           sizeof batch->points->direction);
    const bool has_media = scene->state->medium_count;
    if (has_media || batch->has_air)
        rt_scene_kept_range(scene, sample->ray, range);
    if (has_media)
        begin_media(batch, sample, way.sigma);
    if (batch->has_grids && batch->desc.camera->is_orthographic)
        way.from = -batch->desc.camera->z_near;
    if (batch->has_air)
        begin_air(batch, sample);
    for (size_t i = 0; i < sample->hits->count; i++) {
        const struct rt_hit *hit = &sample->hits->hits[i];
        way.to = hit->t;
        if (has_media || batch->has_air)
            pass_air(batch, &way, through);
        if (batch->has_bends && rt_walk_bends(scene, hit)) {
            add_bend(batch, sample, i, way.sigma, through);
            break;
        }
        if (has_media)
            rt_media_cross(scene, hit, way.sigma);
        way.from = way.to;
        if (hit->is_left_unseen && scene->meshes[hit->mesh].is_medium)
            filter_unseen(batch, hit, sample->ray->direction, through);
        if (!hit->is_hidden && (hit->is_opaque || scene->meshes[hit->mesh].class_ != STATE_MASKED))
            add_step(batch, sample, i, through);
    }
    way.to = INFINITY;
    if (batch->has_air && !ends_on_surface(batch, sample->hits))
        pass_air(batch, &way, through);
    take_air(batch, batch->step_count);
    struct rt_step *last = &batch->steps[batch->step_count++];
    last->fragment = RT_BACKGROUND;
    for (int k = 0; k < 3; k++)
        last->through[k] = (float)through[k];
    batch->sample_ends[batch->sample_count++] = (uint32_t)batch->step_count;
    return true;
}

bool rt_batch_is_full(const struct rt_batch *batch)
{
    return batch->fragment_count >= BATCH_FRAGMENTS;
}

/* What is seen at the end of a way that was bent, behind the layers before. */
static void end_bent(const struct rt_seen *bent, const double layers[3], const double through[3],
                     struct rt_pixel *pixel)
{
    struct rt_seen seen = {.is_bare = false};
    for (int k = 0; k < 3; k++) {
        seen.radiance[k] = layers[k] + through[k] * bent->radiance[k];
        seen.open[k] = through[k] * bent->open[k];
    }
    rt_pixel_end_seen(pixel, &seen);
}

/* Front to back over the ordered layers: docs/explanation/shading.md section 2. */
static void composite(const struct rt_batch *batch, size_t sample, size_t first, size_t end,
                      struct rt_pixel *pixel)
{
    double layers[3] = {0}, through[3] = {1, 1, 1}, behind[4] = {0};
    const struct rt_point *point = &batch->points[sample];
    for (size_t i = first; i < end; i++) {
        const struct rt_step *step = &batch->steps[i];
        for (int k = 0; batch->air && k < 3; k++)
            layers[k] += through[k] * (double)batch->air[i][k];
        for (int k = 0; k < 3; k++)
            through[k] *= (double)step->through[k];
        if (step->fragment == RT_BACKGROUND) {
            rt_pixel_background(batch->desc.view, batch->desc.environment, point->direction,
                                behind);
            break;
        }
        const struct rt_shading *shading = &batch->shadings[step->fragment];
        if (batch->fragments[step->fragment].is_opaque) {
            memcpy(behind, shading->radiance, sizeof shading->radiance);
            behind[3] = 1;
            break;
        }
        rt_pixel_add_layer(shading->radiance, shading->alpha, shading->filter, layers, through);
    }
    if (point->bent)
        end_bent(&batch->bent[point->bent - 1], layers, through, pixel);
    else
        rt_pixel_end_sample(pixel, layers, through, behind);
}

static void write_pixels(const struct rt_batch *batch)
{
    size_t sample = 0, step = 0;
    for (size_t p = 0; p < batch->pixel_count; p++) {
        struct rt_pixel pixel = {.covered = 0};
        for (int s = 0; s < batch->desc.samples; s++) {
            composite(batch, sample, step, batch->sample_ends[sample], &pixel);
            step = batch->sample_ends[sample++];
        }
        int x = batch->pixels[p][0], y = batch->pixels[p][1];
        if (rt_job_has_pixel(batch->desc.job, x, y))
            rt_pixel_write(&pixel, batch->desc.view, batch->desc.samples,
                           rt_job_pixel(batch->desc.job, x, y));
    }
}

void rt_batch_shade(struct rt_batch *batch)
{
    rt_wholes_flush(batch);
    rt_batch_light(batch, 0);
    if (batch->desc.samples > 1 && !rt_batch_refine(batch))
        atomic_store(&batch->desc.job->has_no_memory, true);
    write_pixels(batch);
    rt_wholes_write(batch);
    batch->fragment_count = batch->step_count = batch->sample_count = batch->pixel_count = 0;
    batch->bent_count = 0;
}
