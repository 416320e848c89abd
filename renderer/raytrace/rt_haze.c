/* SPDX-License-Identifier: MIT */
/* Quadrature of single scattering along rays. */
#include "renderer/raytrace/rt_haze.h"

#include <math.h>

#include "protocol/quality_defaults.h"
#include "renderer/base/matrix.h"
#include "renderer/environment/environment.h"
#include "renderer/raytrace/rt_path.h"
#include "renderer/scene/atmosphere.h"

enum { RULE_POINTS = 4 };
/* Of the interval [0, 1]. */
static const double rule_places[RULE_POINTS] = {0.06943184420297371, 0.33000947820757187,
                                                0.66999052179242813, 0.93056815579702629};
static const double rule_weights[RULE_POINTS] = {0.17392742256872693, 0.32607257743127307,
                                                 0.32607257743127307, 0.17392742256872693};
static const double NEAREST = 1e-9; /* [m] from a lamp to a ray */

double rt_haze_arrives(const struct rt_scene *scene, const struct view *view,
                       const struct rt_arrival *arrival, const double point[3])
{
    if (!view_has_atmosphere(view) || !isfinite(arrival->distance_m))
        return 1;
    return exp(-atmosphere_depth(&view->atmosphere, point[1] + scene->origin[1],
                                 arrival->direction[1], arrival->distance_m));
}

/* The stretch in metres from where it begins. */
struct stretch {
    struct rt_lighting *lighting;
    const struct rt_haze_way *way;
    const double *share;
    double origin[3], direction[3]; /* unit; origin relative to rt_scene.origin */
    double length_m, unit_m;        /* of the ray's direction */
    double height_m;                /* of the origin, in the world */
    double fall;                    /* extinction by which points of directional lights lie */
};

static double depth_to(const struct stretch *s, double at_m)
{
    return atmosphere_depth(&s->lighting->view->atmosphere, s->height_m, s->direction[1], at_m);
}

static void begin(struct stretch *s, struct rt_lighting *lighting, const struct rt_haze_way *way,
                  const double share[3])
{
    const struct view_atmosphere *air = &lighting->view->atmosphere;
    *s = (struct stretch){.lighting = lighting, .way = way, .share = share};
    s->unit_m = vec3_length(way->ray->direction);
    s->length_m = (way->to - way->from) * s->unit_m;
    for (int k = 0; k < 3; k++) {
        s->direction[k] = way->ray->direction[k] / s->unit_m;
        s->origin[k] = way->ray->origin[k] + way->from * way->ray->direction[k];
    }
    s->height_m = s->origin[1] + lighting->scene->origin[1];
    double mean = isfinite(s->length_m) ? depth_to(s, s->length_m) / s->length_m
                                        : atmosphere_extinction(air, s->height_m);
    s->fall = fmax(mean, 1e-3 * air->density_per_m);
}

/* What one point adds, `weight` metres of the way. */
static void add_point(const struct stretch *s, const struct state_light *light,
                      const struct rt_light_sample *sample, double at_m, double weight,
                      double radiance[3])
{
    struct rt_lighting *lighting = s->lighting;
    const struct view *view = lighting->view;
    const struct view_atmosphere *air = &view->atmosphere;
    double point[3], transmittance[3] = {1, 1, 1}, seen[3] = {1, 1, 1};
    struct rt_arrival arrival;
    for (int k = 0; k < 3; k++)
        point[k] = s->origin[k] + at_m * s->direction[k];
    rt_light_arrive(light, sample, lighting->scene->origin, point, &arrival);
    double gain = weight * arrival.gain * sample->count *
                  atmosphere_extinction(air, s->height_m + at_m * s->direction[1]) *
                  exp(-depth_to(s, at_m)) *
                  atmosphere_phase(air, vec3_dot(arrival.direction, s->direction)) *
                  rt_haze_arrives(lighting->scene, view, &arrival, point);
    if (!(gain > 0))
        return;
    if (light->casts_shadow && view->quality.shadows != SHADOWS_NONE)
        rt_transmittance(lighting, &arrival, point, NULL, transmittance);
    rt_media_pass(s->way->sigma, s->way->ray, s->way->range, s->way->from,
                  s->way->from + at_m / s->unit_m, seen);
    for (int k = 0; k < 3; k++)
        radiance[k] += s->share[k] * seen[k] * transmittance[k] * gain * (double)air->color[k] *
                       (double)light->color[k];
}

/* The point at x in [0, 1] of the way, and metres of the way per unit of x there. */
struct place {
    double at_m, per_unit;
};

static struct place place_directional(const struct stretch *s, double x)
{
    double all = isfinite(s->length_m) ? -expm1(-s->fall * s->length_m) : 1;
    return (struct place){-log1p(-x * all) / s->fall, all / (s->fall * (1 - x * all))};
}

/* How a lamp sees the stretch: the angles of its ends, from the perpendicular on. */
struct lamp_view {
    double nearest_m, apart_m; /* where it is nearest, and how far away there */
    double first, last;
};

static struct lamp_view view_from_lamp(const struct stretch *s, const struct state_light *light)
{
    struct lamp_view v;
    double to_light[3], off[3];
    for (int k = 0; k < 3; k++)
        to_light[k] = light->position[k] - s->lighting->scene->origin[k] - s->origin[k];
    v.nearest_m = vec3_dot(to_light, s->direction);
    for (int k = 0; k < 3; k++)
        off[k] = to_light[k] - v.nearest_m * s->direction[k];
    v.apart_m = fmax(vec3_length(off), NEAREST);
    v.first = atan(-v.nearest_m / v.apart_m);
    v.last = isfinite(s->length_m) ? atan((s->length_m - v.nearest_m) / v.apart_m) : M_PI_2;
    return v;
}

static struct place place_lamp(const struct stretch *s, const struct lamp_view *v, double x)
{
    double tangent = tan(v->first + x * (v->last - v->first));
    double at_m = fmax(v->nearest_m + v->apart_m * tangent, 0);
    return (struct place){fmin(at_m, s->length_m),
                          (v->last - v->first) * v->apart_m * (1 + tangent * tangent)};
}

static double offset_of(uint32_t seed)
{
    uint32_t x = seed * 0x9e3779b9u;
    return ((x ^ x >> 15) * 0x85ebca6bu + 0.5) * 0x1p-32;
}

static void add_light(const struct stretch *s, size_t index, double radiance[3])
{
    const struct view_quality *quality = &s->lighting->view->quality;
    const struct state_light *light = &s->lighting->scene->state->lights[index];
    bool is_directional = light->type == SCENE_LIGHT_DIRECTIONAL;
    int points = quality_or(quality->atmosphere_samples, ATMOSPHERE_SLICES_DEFAULT);
    int panels = (points + RULE_POINTS - 1) / RULE_POINTS;
    double offset = offset_of(s->lighting->seed + (uint32_t)index);
    const struct lamp_view seen =
        is_directional ? (struct lamp_view){.apart_m = NEAREST} : view_from_lamp(s, light);
    struct rt_light_sample sample = {.count = rt_light_sample_count(light, quality),
                                     .seed = s->lighting->seed + (uint32_t)index};
    for (int panel = 0; panel <= panels; panel++) {
        double low = panel ? (panel - 1 + offset) / panels : 0;
        double high = panel < panels ? (panel + offset) / panels : 1;
        for (int i = 0; i < RULE_POINTS; i++) {
            double x = low + (high - low) * rule_places[i];
            struct place place = is_directional ? place_directional(s, x) : place_lamp(s, &seen, x);
            sample.index = (uint32_t)(panel * RULE_POINTS + i) % sample.count;
            if (isfinite(place.at_m) && isfinite(place.per_unit))
                add_point(s, light, &sample, place.at_m,
                          place.per_unit * rule_weights[i] * (high - low), radiance);
        }
    }
}

/* Of the hemisphere and the map, as from all around. */
static void find_around(const struct rt_lighting *lighting, double around[3])
{
    const struct scene_state *state = lighting->scene->state;
    around[0] = around[1] = around[2] = 0;
    if (lighting->environment && lighting->environment->environment)
        environment_light_mean(lighting->environment, around);
    for (int k = 0; k < 3 && state->has_environment; k++)
        around[k] += 0.5 * ((double)state->sky[k] + (double)state->ground[k]);
}

void rt_haze_pass(struct rt_lighting *lighting, const struct rt_haze_way *way, double share[3],
                  double radiance[3])
{
    struct stretch s;
    double around[3];
    if (!view_has_atmosphere(lighting->view) || !(way->to > way->from))
        return;
    begin(&s, lighting, way, share);
    for (size_t i = 0; i < lighting->scene->state->light_count; i++)
        add_light(&s, i, radiance);
    double depth = depth_to(&s, s.length_m), lost = -expm1(-depth);
    find_around(lighting, around);
    for (int k = 0; k < 3; k++) {
        radiance[k] += share[k] * around[k] * (double)lighting->view->atmosphere.color[k] * lost;
        share[k] *= exp(-depth);
    }
}
