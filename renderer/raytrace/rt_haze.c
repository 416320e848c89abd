/* SPDX-License-Identifier: MIT */
/* Quadrature of single scattering along rays. */
#include "renderer/raytrace/rt_haze.h"

#include <math.h>

#include "protocol/quality_defaults.h"
#include "renderer/base/matrix.h"
#include "renderer/environment/environment.h"
#include "renderer/raytrace/rt_lamp_span.h"
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

static double along_ray(const struct stretch *s, double at_m)
{
    return s->way->from + at_m / s->unit_m;
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
    lighting->grids.count = 0;
    if (lighting->scene->state->grid_count)
        rt_grid_lines_find(&lighting->grids, lighting->scene, way->ray, way->range, way->from,
                           way->to);
}

/* What scatters: the haze, or one of the grids. */
struct scatterer {
    const struct rt_grid_line *line; /* NULL: the haze */
};

/* What it scatters per metre there [1/m]. */
static void find_scattering(const struct stretch *s, const struct scatterer *by, double at_m,
                            double out[3])
{
    const struct view_atmosphere *air = &s->lighting->view->atmosphere;
    double haze = by->line ? 0 : atmosphere_extinction(air, s->height_m + at_m * s->direction[1]);
    double value = by->line ? rt_grid_line_value(by->line, along_ray(s, at_m)) : 0;
    for (int k = 0; k < 3; k++)
        out[k] = by->line ? value * by->line->grid->sigma[k] * (double)by->line->grid->color[k]
                          : haze * (double)air->color[k];
}

static double phase_of(const struct stretch *s, const struct scatterer *by, double cosine)
{
    return by->line ? state_grid_phase(by->line->grid, cosine)
                    : atmosphere_phase(&s->lighting->view->atmosphere, cosine);
}

/* What reaches the beginning of the stretch from a point of it. */
static void find_seen(const struct stretch *s, double at_m, double seen[3])
{
    seen[0] = seen[1] = seen[2] = exp(-depth_to(s, at_m));
    rt_grid_lines_pass(&s->lighting->grids, along_ray(s, at_m), seen);
    rt_media_pass(s->way->sigma, s->way->ray, s->way->range, s->way->from, along_ray(s, at_m),
                  seen);
}

/* What one point adds, `weight` metres of the way. */
static void add_point(const struct stretch *s, const struct scatterer *by,
                      const struct state_light *light, const struct rt_light_sample *sample,
                      double at_m, double weight, double radiance[3])
{
    struct rt_lighting *lighting = s->lighting;
    const struct view *view = lighting->view;
    double point[3], transmittance[3] = {1, 1, 1}, seen[3], scattering[3];
    struct rt_arrival arrival;
    for (int k = 0; k < 3; k++)
        point[k] = s->origin[k] + at_m * s->direction[k];
    rt_light_arrive(light, sample, lighting->scene->origin, point, &arrival);
    double gain = weight * arrival.gain * sample->count *
                  phase_of(s, by, vec3_dot(arrival.direction, s->direction)) *
                  rt_haze_arrives(lighting->scene, view, &arrival, point);
    find_scattering(s, by, at_m, scattering);
    find_seen(s, at_m, seen);
    if (!(gain * (scattering[0] + scattering[1] + scattering[2]) * (seen[0] + seen[1] + seen[2]) >
          0))
        return;
    if (light->casts_shadow && view->quality.shadows != SHADOWS_NONE)
        rt_transmittance(lighting, &arrival, point, NULL, transmittance);
    for (int k = 0; k < 3; k++)
        radiance[k] += s->share[k] * seen[k] * transmittance[k] * gain * scattering[k] *
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

/* How a lamp sees the stretch: the angles of the ends of what it lights, from the perpendicular on.
 * The whole rule goes to that: the cone of a spot is often a small part of the way. */
struct lamp_view {
    double nearest_m, apart_m; /* where it is nearest, and how far away there */
    double first, last;        /* not above first: it lights nothing */
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
    const struct rt_span lit = rt_lamp_span(s->lighting->scene, light, s->origin, s->direction);
    double to_m = fmin(lit.to, s->length_m);
    v.first = atan((lit.from - v.nearest_m) / v.apart_m);
    v.last = isfinite(to_m) ? atan((to_m - v.nearest_m) / v.apart_m) : M_PI_2;
    return v;
}

static struct place place_lamp(const struct stretch *s, const struct lamp_view *v, double x)
{
    double tangent = tan(v->first + x * (v->last - v->first));
    double at_m = fmax(v->nearest_m + v->apart_m * tangent, 0);
    return (struct place){fmin(at_m, s->length_m),
                          (v->last - v->first) * v->apart_m * (1 + tangent * tangent)};
}

/* Points along a grid: one half by what the grid hides of what is behind it, the other by the angle
 * at which a lamp sees the way; all by the first without a lamp. */
struct grid_measure {
    const struct rt_grid_line *line;
    const struct lamp_view *lamp; /* NULL: none */
    double sigma;                 /* the mean of its channels */
    double hidden, angle;         /* on the whole way */
    double first;                 /* the angle where the grid begins */
};

static double angle_at(const struct stretch *s, const struct lamp_view *lamp, double at)
{
    double at_m = (at - s->way->from) * s->unit_m;
    return atan((at_m - lamp->nearest_m) / lamp->apart_m);
}

static void measure_begin(struct grid_measure *m, const struct stretch *s,
                          const struct rt_grid_line *line, const struct lamp_view *lamp)
{
    size_t last = line->count - 1;
    *m = (struct grid_measure){.line = line, .lamp = lamp};
    for (int k = 0; k < 3; k++)
        m->sigma += line->grid->sigma[k] / 3;
    m->hidden = -expm1(-m->sigma * line->deep[last]);
    if (lamp) {
        m->first = angle_at(s, lamp, line->at[0]);
        m->angle = angle_at(s, lamp, line->at[last]) - m->first;
    }
    if (!(m->angle > 0))
        m->lamp = NULL;
}

/* The share of the points that lie before a place; lost: what the grid hides up to there. */
static double measure_share(const struct grid_measure *m, const struct stretch *s, double at,
                            double lost)
{
    double share = lost / m->hidden;
    return m->lamp ? 0.5 * (share + (angle_at(s, m->lamp, at) - m->first) / m->angle) : share;
}

/* Its derivative, per metre. */
static double measure_rate(const struct grid_measure *m, const struct stretch *s, double at,
                           double lost)
{
    double rate = m->sigma * rt_grid_line_value(m->line, at) * (1 - lost) / m->hidden;
    if (!m->lamp)
        return rate;
    double off = ((at - s->way->from) * s->unit_m - m->lamp->nearest_m) / m->lamp->apart_m;
    return 0.5 * (rate + 1 / (m->lamp->apart_m * (1 + off * off) * m->angle));
}

/* By bisection of the pieces, then Newton's method within one, which never leaves it. */
static struct place place_in_grid(const struct grid_measure *m, const struct stretch *s, double x)
{
    const struct rt_grid_line *line = m->line;
    const struct rt_grid_lines *lines = &s->lighting->grids;
    size_t low = 0, high = line->count - 1;
    while (high - low > 1) {
        size_t middle = (low + high) / 2;
        double lost = -expm1(-m->sigma * line->deep[middle]);
        bool is_before = measure_share(m, s, line->at[middle], lost) <= x;
        *(is_before ? &low : &high) = middle;
    }
    double from = line->at[low], to = line->at[high], at = 0.5 * (from + to), rate = 0;
    const double tolerance = s->lighting->view->quality.reference ? 1e-12 : 1e-6;
    for (int i = 0; i < 24; i++) {
        double lost = -expm1(-m->sigma * rt_grid_line_deep(lines, line, at));
        double off = measure_share(m, s, at, lost) - x;
        rate = measure_rate(m, s, at, lost);
        *(off > 0 ? &to : &from) = at;
        double next = rate > 0 ? at - off / (rate * s->unit_m) : at;
        next = next > from && next < to ? next : 0.5 * (from + to);
        bool is_there = fabs(off) < tolerance;
        if (is_there)
            break;
        at = next;
    }
    return (struct place){(at - s->way->from) * s->unit_m, rate > 0 ? 1 / rate : INFINITY};
}

static double offset_of(uint32_t seed)
{
    uint32_t x = seed * 0x9e3779b9u;
    return ((x ^ x >> 15) * 0x85ebca6bu + 0.5) * 0x1p-32;
}

/* The points of the rule in panels, whose borders are shifted: `index` of them, each a place in
 * [0, 1] with its weight. */
struct rule_point {
    double x, weight;
};

static int rule_panels(const struct rt_lighting *lighting)
{
    const struct view_quality *quality = &lighting->view->quality;
    bool is_quick = !quality->reference && lighting->scene->state->grid_count > 0;
    int points = is_quick ? quality_grid_points(quality->atmosphere_samples, quality->samples)
                          : quality_or(quality->atmosphere_samples, ATMOSPHERE_SLICES_DEFAULT);
    return (points + RULE_POINTS - 1) / RULE_POINTS;
}

static struct rule_point rule_at(int panels, double offset, int index)
{
    int panel = index / RULE_POINTS, i = index % RULE_POINTS;
    double low = panel ? (panel - 1 + offset) / panels : 0;
    double high = panel < panels ? (panel + offset) / panels : 1;
    return (struct rule_point){low + (high - low) * rule_places[i], rule_weights[i] * (high - low)};
}

/* Whether the light has any range on a grid's part of the stretch. */
static bool reaches_line(const struct stretch *s, const struct rt_grid_line *line,
                         const struct state_light *light, const struct lamp_view *seen)
{
    if (light->type == SCENE_LIGHT_DIRECTIONAL || state_light_is_area(light) || !(light->range > 0))
        return true;
    double first = (line->at[0] - s->way->from) * s->unit_m - seen->nearest_m;
    double last = (line->at[line->count - 1] - s->way->from) * s->unit_m - seen->nearest_m;
    double along = first > 0 ? first : last < 0 ? last : 0;
    return hypot(along, seen->apart_m) < (double)light->range;
}

static void add_light(const struct stretch *s, const struct scatterer *by, size_t index,
                      double radiance[3])
{
    const struct view_quality *quality = &s->lighting->view->quality;
    const struct state_light *light = &s->lighting->scene->state->lights[index];
    bool is_directional = light->type == SCENE_LIGHT_DIRECTIONAL;
    int panels = rule_panels(s->lighting);
    double offset = offset_of(s->lighting->seed + (uint32_t)index);
    const struct lamp_view seen =
        is_directional ? (struct lamp_view){.apart_m = NEAREST} : view_from_lamp(s, light);
    struct rt_light_sample sample = {.count = rt_light_sample_count(light, quality),
                                     .seed = s->lighting->seed + (uint32_t)index};
    struct grid_measure measure;
    if (by->line ? !reaches_line(s, by->line, light, &seen)
                 : !is_directional && !(seen.last > seen.first))
        return;
    if (by->line)
        measure_begin(&measure, s, by->line, is_directional ? NULL : &seen);
    for (int i = 0; i < (panels + 1) * RULE_POINTS; i++) {
        struct rule_point at = rule_at(panels, offset, i);
        struct place place = by->line         ? place_in_grid(&measure, s, at.x)
                             : is_directional ? place_directional(s, at.x)
                                              : place_lamp(s, &seen, at.x);
        sample.index = (uint32_t)i % sample.count;
        if (isfinite(place.at_m) && isfinite(place.per_unit))
            add_point(s, by, light, &sample, place.at_m, place.per_unit * at.weight, radiance);
    }
}

/* Of the hemisphere and the map, as from all around. */
void rt_haze_around(const struct rt_scene *scene, const struct environment_light *environment,
                    double around[3])
{
    const struct scene_state *state = scene->state;
    around[0] = around[1] = around[2] = 0;
    if (environment && environment->environment)
        environment_light_mean(environment, around);
    for (int k = 0; k < 3 && state->has_environment; k++)
        around[k] += 0.5 * ((double)state->sky[k] + (double)state->ground[k]);
}

/* What light from all around adds, by the rule: among grids there is no closed form. */
static void add_around(const struct stretch *s, const struct scatterer *by, const double around[3],
                       double radiance[3])
{
    int panels = rule_panels(s->lighting);
    double offset = offset_of(s->lighting->seed), scattering[3], seen[3];
    struct grid_measure measure;
    if (!(around[0] + around[1] + around[2] > 0))
        return;
    if (by->line)
        measure_begin(&measure, s, by->line, NULL);
    for (int i = 0; i < (panels + 1) * RULE_POINTS; i++) {
        struct rule_point at = rule_at(panels, offset, i);
        struct place place =
            by->line ? place_in_grid(&measure, s, at.x) : place_directional(s, at.x);
        if (!isfinite(place.at_m) || !isfinite(place.per_unit))
            continue;
        find_scattering(s, by, place.at_m, scattering);
        find_seen(s, place.at_m, seen);
        for (int k = 0; k < 3; k++)
            radiance[k] +=
                s->share[k] * seen[k] * around[k] * scattering[k] * place.per_unit * at.weight;
    }
}

static void add_scatterer(const struct stretch *s, const struct scatterer *by,
                          const double around[3], double radiance[3])
{
    const struct rt_lighting *lighting = s->lighting;
    for (size_t i = 0; i < lighting->scene->state->light_count; i++)
        add_light(s, by, i, radiance);
    if (by->line || lighting->grids.count) {
        add_around(s, by, around, radiance);
        return;
    }
    double lost = -expm1(-depth_to(s, s->length_m));
    for (int k = 0; k < 3; k++)
        radiance[k] += s->share[k] * around[k] * (double)lighting->view->atmosphere.color[k] * lost;
}

void rt_haze_pass(struct rt_lighting *lighting, const struct rt_haze_way *way, double share[3],
                  double radiance[3])
{
    bool has_haze = view_has_atmosphere(lighting->view);
    struct stretch s;
    double around[3];
    if (!(has_haze || lighting->scene->state->grid_count) || !(way->to > way->from))
        return;
    begin(&s, lighting, way, share);
    rt_haze_around(lighting->scene, lighting->environment, around);
    if (has_haze)
        add_scatterer(&s, &(struct scatterer){.line = NULL}, around, radiance);
    for (size_t i = 0; i < lighting->grids.count; i++)
        add_scatterer(&s, &(struct scatterer){.line = &lighting->grids.lines[i]}, around, radiance);
    double depth = depth_to(&s, s.length_m);
    for (int k = 0; k < 3; k++)
        share[k] *= exp(-depth);
    rt_grid_lines_pass(&lighting->grids, way->to, share);
}

void rt_haze_add_grids(struct rt_lighting *lighting, const struct rt_haze_way *way,
                       const double share[3], double radiance[3])
{
    struct stretch s;
    double around[3];
    lighting->grids.count = 0;
    if (!(way->to > way->from))
        return;
    begin(&s, lighting, way, share);
    if (lighting->grids.count)
        rt_haze_around(lighting->scene, lighting->environment, around);
    for (size_t i = 0; i < lighting->grids.count; i++)
        add_scatterer(&s, &(struct scatterer){.line = &lighting->grids.lines[i]}, around, radiance);
}

void rt_haze_add_lamp(struct rt_lighting *lighting, const struct rt_haze_way *way,
                      const double share[3], size_t light, double radiance[3])
{
    const struct state_light *lamp = &lighting->scene->state->lights[light];
    const struct rt_light_sample sample = {.count = 1};
    struct stretch s;
    if (!(way->to > way->from))
        return;
    begin(&s, lighting, way, share);
    const struct lamp_view seen = view_from_lamp(&s, lamp);
    if (!(seen.last > seen.first))
        return;
    double offset = offset_of(lighting->seed + (uint32_t)light);
    int panels = quality_or(lighting->view->quality.samples, SAMPLES_DEFAULT) >= 4 ? 0 : 1;
    for (int i = 0; i < (panels + 1) * RULE_POINTS; i++) {
        struct rule_point at = rule_at(panels, offset, i);
        struct place place = place_lamp(&s, &seen, at.x);
        if (isfinite(place.at_m) && isfinite(place.per_unit))
            add_point(&s, &(struct scatterer){.line = NULL}, lamp, &sample, place.at_m,
                      place.per_unit * at.weight, radiance);
    }
}
