/* SPDX-License-Identifier: MIT */
/* Camera rays through layers, media and surfaces that bend them. */
#include "renderer/raytrace/rt_walk.h"

#include "protocol/quality_defaults.h"
#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_bend.h"
#include "renderer/raytrace/rt_haze.h"
#include "renderer/raytrace/rt_path.h"

enum { ALL_CHANNELS = -1 };

struct walk { /* one ray on its way */
    struct rt_walker *walker;
    struct rt_ray ray;
    double sigma[3];    /* of the media around the point reached */
    double through[3];  /* share of what comes next */
    double radiance[3]; /* so far */
    double distance;    /* of the ray's origin, along its way */
    int channel;        /* that its index belongs to, or ALL_CHANNELS */
    int bends;
    bool has_spread; /* its directions were drawn by a rough surface */
    uint32_t index;  /* of its direction among those */
};

bool rt_walker_init(struct rt_walker *walker, const struct rt_walker_desc *desc, struct error *err)
{
    walker->desc = *desc;
    if (!rt_hits_init(&walker->hits, err) ||
        !rt_lighting_init(&walker->lighting, desc->scene, desc->view, err))
        return false;
    walker->lighting.environment = desc->environment;
    return true;
}

void rt_walker_finish(struct rt_walker *walker)
{
    rt_hits_finish(&walker->hits);
    rt_lighting_finish(&walker->lighting);
}

uint32_t rt_walk_branches(const struct view *view, int samples)
{
    const struct view_quality *quality = &view->quality;
    int least = quality->reference ? REFRACTION_SAMPLES_DEFAULT_REFERENCE
                                   : REFRACTION_SAMPLES_DEFAULT / (samples > 0 ? samples : 1);
    int count = quality->refraction_samples ? quality->refraction_samples : least;
    return count > 1 ? (uint32_t)count : 1;
}

bool rt_walk_bends(const struct rt_scene *scene, const struct rt_hit *hit)
{
    enum state_bend bend = scene->meshes[hit->mesh].bend;
    return bend != STATE_BEND_NONE && !hit->is_opaque &&
           (!hit->is_hidden || (hit->is_left_unseen && bend == STATE_BEND_SOLID));
}

/* ---- a surface ---- */

static const struct rt_footprint *find_footprint(const struct walk *walk, const struct rt_hit *hit,
                                                 struct rt_footprint *footprint)
{
    const struct rt_walker_desc *desc = &walk->walker->desc;
    if (!desc->way || !desc->scene->meshes[hit->mesh].slots)
        return NULL;
    double way[2][3], length = hit->t * vec3_length(walk->ray.direction);
    double scale = desc->is_orthographic ? 1 : walk->distance + length;
    for (int i = 0; i < 6; i++)
        way[i / 3][i % 3] = desc->way[i / 3][i % 3] * scale;
    rt_footprint_find(desc->scene, hit, (const double(*)[3])way, walk->ray.direction, footprint);
    return footprint;
}

static void find_point(const struct walk *walk, const struct rt_hit *hit, double point[3])
{
    for (int k = 0; k < 3; k++)
        point[k] = walk->ray.origin[k] + walk->ray.direction[k] * hit->t;
}

static void find_view(const struct walk *walk, double view[3])
{
    for (int k = 0; k < 3; k++)
        view[k] = -walk->ray.direction[k];
    vec3_normalize(view);
}

/* share: of the surface's light that counts. */
static void add_light(struct walk *walk, const struct rt_hit *hit, const struct rt_surface *surface,
                      const double share[3])
{
    double point[3], view[3], radiance[3];
    find_point(walk, hit, point);
    find_view(walk, view);
    rt_radiance(&walk->walker->lighting, hit, surface, point, view, radiance);
    for (int k = 0; k < 3; k++)
        walk->radiance[k] += share[k] * surface->alpha * radiance[k];
}

/* What the surface lets through where the ray crosses it. The culled back of a body that is no
 * medium refracts, but is not there to filter. */
static void find_filter(const struct walk *walk, const struct rt_hit *hit,
                        const struct rt_surface *surface, double filter[3])
{
    double view[3];
    find_view(walk, view);
    if (!hit->is_left_unseen) {
        rt_surface_view_filter(surface, view, hit->is_front, filter);
        return;
    }
    if (!walk->walker->desc.scene->meshes[hit->mesh].is_medium) {
        filter[0] = filter[1] = filter[2] = 1;
        return;
    }
    rt_surface_light_filter(surface, fabs(vec3_dot(surface->normal, view)), false,
                            VIEW_BLEND_COVERAGE, filter);
    for (int k = 0; k < 3; k++)
        filter[k] *= 1 - surface->alpha * surface->metallic;
}

/* ---- bending ---- */

static void walk_along(struct walk *walk, struct rt_seen *seen);

/* The rays that go on from a surface. */
struct fork {
    struct rt_bend bend;
    const struct rt_hit *hit;
    double point[3], filter[3];
    double distance;
    bool is_lit;
};

/* The same number at each rough surface would draw the same normal relative to the first: within a
 * power of two of them, others in another order. */
static uint32_t shuffle(uint32_t index, uint32_t count, uint32_t seed)
{
    uint32_t mask = 1;
    while (mask < count)
        mask <<= 1;
    return (index * 0x9e3779b1u + (seed ^ seed >> 15)) & (mask - 1);
}

/* One of them: where it goes, and what of its light counts. Returns whether it crosses. */
static bool turn(const struct fork *fork, int channel, uint32_t index, struct walk *walk)
{
    const struct rt_scene *scene = walk->walker->desc.scene;
    double u[2], shift[3];
    uint32_t seed = walk->walker->lighting.seed + 0x85ebca6bu * (uint32_t)(walk->bends + 1);
    if (walk->has_spread)
        index = shuffle(index, walk->walker->desc.branches, seed);
    rt_sequence_point(index, seed, u);
    bool passes =
        rt_bend_ray(&fork->bend, channel < 0 ? 1 : channel, u, walk->ray.direction, shift);
    for (int k = 0; k < 3; k++) {
        walk->ray.origin[k] = fork->point[k] + shift[k];
        walk->through[k] *= passes && !fork->is_lit ? fork->filter[k] : 1;
    }
    walk->ray.t_min = 4 * scene->nudge_m;
    walk->ray.t_max = INFINITY;
    walk->ray.is_bent = walk->ray.culls_back_faces = true;
    walk->ray.skip_mesh = fork->hit->mesh;
    walk->ray.skip_triangle = fork->hit->triangle;
    walk->distance = fork->distance;
    walk->bends++;
    if (passes)
        rt_media_cross(scene, fork->hit, walk->sigma);
    return passes;
}

/* Rays of all channels and directions, each to its end. Returns how much of the light crosses. */
static double walk_branches(const struct walk *from, const struct fork *fork, bool splits,
                            uint32_t directions, struct rt_seen *seen)
{
    struct rt_lighting *lighting = &from->walker->lighting;
    const uint32_t seed = lighting->seed, first = from->has_spread ? from->index : 0;
    const int channels = splits ? RT_BEND_CHANNELS : 1;
    const double share = 1.0 / directions;
    double crossed = 0;
    for (uint32_t i = 0; i < directions; i++)
        for (int c = 0; c < channels; c++) {
            struct walk branch = *from;
            struct rt_seen own;
            if (splits)
                branch.channel = c;
            for (int k = 0; k < 3; k++) {
                branch.through[k] *= !splits || k == c ? share : 0;
                branch.radiance[k] = 0;
            }
            lighting->seed = seed;
            crossed += turn(fork, branch.channel, first + i, &branch) * share / channels;
            if (directions > 1)
                branch.has_spread = true, branch.index = i;
            lighting->seed = seed + (directions > 1 ? 0x9e3779b9u * (i + 1) : 0);
            walk_along(&branch, &own);
            for (int k = 0; k < 3; k++) {
                seen->radiance[k] += own.radiance[k];
                seen->open[k] += own.open[k];
            }
        }
    lighting->seed = seed;
    return crossed;
}

/* The surface's own light, and the way behind it. True: the walk goes on, as one ray. */
static bool meet_bend(struct walk *walk, const struct rt_hit *hit, bool is_lit,
                      struct rt_seen *seen)
{
    const struct rt_walker_desc *desc = &walk->walker->desc;
    struct rt_surface surface;
    struct rt_footprint room;
    struct fork fork = {.hit = hit, .is_lit = is_lit};
    const double before[3] = {walk->through[0], walk->through[1], walk->through[2]};
    rt_surface_evaluate(desc->scene, hit, find_footprint(walk, hit, &room), &surface);
    rt_bend_init(&fork.bend, desc->scene, hit, &surface, walk->ray.direction);
    fork.distance = walk->distance + hit->t * vec3_length(walk->ray.direction);
    find_point(walk, hit, fork.point);
    find_filter(walk, hit, &surface, fork.filter);
    const bool splits = fork.bend.disperses && walk->channel == ALL_CHANNELS;
    const uint32_t directions = fork.bend.alpha > 0 && !walk->has_spread ? desc->branches : 1;
    const bool is_single = !splits && directions == 1;
    struct walk here = *walk;
    double crossed = is_single ? turn(&fork, walk->channel, walk->index, walk)
                               : walk_branches(&here, &fork, splits, directions, seen);
    const double share[3] = {before[0] * crossed, before[1] * crossed, before[2] * crossed};
    if (!is_lit && !hit->is_left_unseen && crossed > 0) {
        add_light(&here, hit, &surface, share);
        memcpy(walk->radiance, here.radiance, sizeof walk->radiance);
    }
    return is_single;
}

/* ---- the way ---- */

/* A surface that bends nothing. True: the ray ends there. */
static bool meet_layer(struct walk *walk, const struct rt_hit *hit)
{
    const struct rt_scene *scene = walk->walker->desc.scene;
    struct rt_footprint room;
    struct rt_surface surface;
    double filter[3];
    bool is_opaque = hit->is_opaque;
    rt_surface_evaluate(scene, hit, find_footprint(walk, hit, &room), &surface);
    if (is_opaque)
        surface.alpha = 1, surface.transmission = 0;
    double view[3], point[3];
    find_view(walk, view);
    if (scene->meshes[hit->mesh].is_ground) {
        find_point(walk, hit, point);
        rt_ground_filter(&walk->walker->lighting, hit, &surface, point, view, filter);
    } else {
        add_light(walk, hit, &surface, walk->through);
        rt_surface_view_filter(&surface, view, hit->is_front, filter);
    }
    if (is_opaque)
        return true;
    for (int k = 0; k < 3; k++)
        walk->through[k] *= filter[k];
    return false;
}

static bool is_bare(const struct walk *walk)
{
    bool is = walk->bends == 0;
    for (int k = 0; k < 3; k++)
        is = is && walk->through[k] == 1 && walk->radiance[k] == 0;
    return is;
}

static void end(const struct walk *walk, bool is_opaque, struct rt_seen *seen)
{
    const struct rt_walker_desc *desc = &walk->walker->desc;
    double behind[4] = {0, 0, 0, 1};
    if (!is_opaque)
        rt_pixel_background(desc->view, desc->environment, walk->ray.direction, behind);
    seen->is_bare = seen->is_bare || (!is_opaque && behind[3] == 0 && is_bare(walk));
    for (int k = 0; k < 3; k++) {
        seen->radiance[k] += walk->radiance[k] + walk->through[k] * behind[k];
        seen->open[k] += walk->through[k] * (1 - behind[3]);
    }
}

/* Media and haze between two numbers of the ray's direction. */
static void pass(struct walk *walk, const double range[2], double from, double to)
{
    struct rt_walker *walker = walk->walker;
    if (view_has_atmosphere(walker->desc.view) || walker->desc.scene->state->grid_count) {
        struct rt_haze_way way = {.ray = &walk->ray, .from = from, .to = to, .range = range};
        memcpy(way.sigma, walk->sigma, sizeof way.sigma);
        rt_haze_pass(&walker->lighting, &way, walk->through, walk->radiance);
    }
    if (isfinite(to))
        rt_media_pass(walk->sigma, &walk->ray, range, from, to, walk->through);
}

static bool is_dark(const struct walk *walk)
{
    return !(walk->through[0] > 0 || walk->through[1] > 0 || walk->through[2] > 0);
}

/* One straight piece of the way. Returns whether another one follows. */
static bool walk_straight(struct walk *walk, struct rt_seen *seen)
{
    struct rt_walker *walker = walk->walker;
    const struct rt_scene *scene = walker->desc.scene;
    double t = walk->bends ? 0 : walker->desc.begin, range[2];
    if (walk->bends && is_dark(walk)) {
        end(walk, true, seen);
        return false;
    }
    rt_scene_collect(scene, &walk->ray, &walker->hits);
    walker->has_overflowed |= walker->hits.has_overflowed;
    rt_scene_kept_range(scene, &walk->ray, range);
    for (size_t i = 0; i < walker->hits.count; i++) {
        const struct rt_hit hit = walker->hits.hits[i]; /* other pieces use the list, too */
        pass(walk, range, t, hit.t);
        if (walk->bends < RT_BENDS_MAX && rt_walk_bends(scene, &hit)) {
            if (meet_bend(walk, &hit, false, seen))
                return true;
            for (int k = 0; k < 3; k++)
                seen->radiance[k] += walk->radiance[k];
            return false;
        }
        rt_media_cross(scene, &hit, walk->sigma);
        t = hit.t;
        if (hit.is_left_unseen && scene->meshes[hit.mesh].is_medium)
            rt_filter_unseen(scene, &hit, NULL, walk->ray.direction, walk->through);
        if (hit.is_hidden || (scene->meshes[hit.mesh].class_ == STATE_MASKED && !hit.is_opaque))
            continue;
        if (meet_layer(walk, &hit)) {
            end(walk, true, seen);
            return false;
        }
    }
    pass(walk, range, t, INFINITY);
    end(walk, false, seen);
    return false;
}

static void walk_along(struct walk *walk, struct rt_seen *seen)
{
    *seen = (struct rt_seen){.is_bare = false};
    while (walk_straight(walk, seen))
        continue;
}

void rt_walk(struct rt_walker *walker, const struct rt_ray *ray, const double sigma[3],
             struct rt_seen *seen)
{
    struct walk walk = {
        .walker = walker, .ray = *ray, .through = {1, 1, 1}, .channel = ALL_CHANNELS};
    memcpy(walk.sigma, sigma, sizeof walk.sigma);
    walk_along(&walk, seen);
}

void rt_walk_on(struct rt_walker *walker, const struct rt_walk_turn *at, struct rt_seen *seen)
{
    struct walk walk = {
        .walker = walker, .through = {1, 1, 1}, .channel = ALL_CHANNELS, .distance = at->distance};
    memcpy(walk.ray.origin, at->origin, sizeof walk.ray.origin);
    memcpy(walk.ray.direction, at->direction, sizeof walk.ray.direction);
    memcpy(walk.sigma, at->sigma, sizeof walk.sigma);
    *seen = (struct rt_seen){.is_bare = false};
    const struct rt_hit hit = *at->hit;
    if (!meet_bend(&walk, &hit, at->is_lit, seen)) {
        for (int k = 0; k < 3; k++)
            seen->radiance[k] += walk.radiance[k];
        return;
    }
    while (walk_straight(&walk, seen))
        continue;
}
