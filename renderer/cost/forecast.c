/* SPDX-License-Identifier: MIT */
/* Sums of units of work by their costs. */
#include "renderer/cost/forecast.h"

#include <math.h>

static const double MS = 1e-6; /* per ns */

/* AMD EPYC, 2 cores, Mesa 22.3.6 llvmpipe: docs/tradeoffs.md, "The models". */
const struct device_costs forecast_costs = {
    .pixel = 113,
    .msaa_pixel = 114,
    .msaa_covered = 194,
    .light = 46,
    .look = 130,
    .tap = 38,
    .walk = 11,
    .layer = 640,
    .msaa_layer = 1073,
    .texture = 270,
    .msaa_texture = 326,
    .triangle = 302,
    .msaa_triangle = 397,
    .drawn_frame_ms = 1.9,
    .face_ms = 0.4,
    .texel = 1.9,
    .caster = 222,
    .deep_texel = 13.4,
    .deep_caster = 490,
    .event = 28,
    .ray = 16.3,
    .hit_level = 7.6,
    .more_ray = 33,
    .more_hit_level = 3.3,
    .traced_triangle = 30,
    .msaa_traced_triangle = 88,
    .shadow_ray = 83,
    .traced_walk = 0.64,
    .layer_ray = 189,
    .layer_light = 337,
    .traced_texture = 129,
    .traced_frame_ms = 3.9,
    .point_pixel = 40,
    .msaa_point_pixel = 90,
    .point = 58,
    .point_level = 8.8,
    .layer_point_ray = 1310,
    .point_walk = 60,
    .built_triangle = 281,
};

bool device_speed_is_known(const struct device_speed *speed)
{
    return speed->shade > 0 && speed->maps > 0 && speed->trace > 0 && speed->build > 0;
}

static double sum(const double terms[FORECAST_TERM_COUNT])
{
    double ms = 0;
    for (int i = 0; i < FORECAST_TERM_COUNT; i++)
        ms += terms[i];
    return ms;
}

/* Surfaces that are shaded, those of layers among them. */
static double count_surfaces(const struct workload *w)
{
    return w->pixels * (w->layers + w->covered);
}

/* On the machine of the fit, as all that follow. */
static void add_shading(const struct workload *w, const struct forecast_setting *setting,
                        double terms[FORECAST_TERM_COUNT])
{
    const struct device_costs *c = &forecast_costs;
    double more = setting->samples > 1 ? 1 : 0;
    double layers = w->pixels * w->layers, covered = w->pixels * w->covered;
    double surfaces = count_surfaces(w);
    double looks =
        setting->has_shadows && w->shadowed_lights ? c->look + c->tap * setting->shadow_taps : 0;
    terms[FORECAST_TERM_PIXELS] +=
        MS * (w->pixels * (c->pixel + more * c->msaa_pixel) + covered * more * c->msaa_covered);
    terms[FORECAST_TERM_LIGHTS] += MS * surfaces * w->lit * c->light;
    terms[FORECAST_TERM_WALKS] += MS * surfaces * w->listed * c->walk;
    terms[FORECAST_TERM_LOOKS] += MS * surfaces * w->lit * looks;
    terms[FORECAST_TERM_LAYERS] += MS * layers * (c->layer + more * c->msaa_layer);
    terms[FORECAST_TERM_TEXTURES] +=
        MS * surfaces * w->textures * (c->texture + more * c->msaa_texture);
    terms[FORECAST_TERM_TRIANGLES] +=
        MS * w->triangles_in_view * (c->triangle + more * c->msaa_triangle);
}

static void add_maps(const struct workload *w, const struct forecast_setting *setting,
                     double terms[FORECAST_TERM_COUNT])
{
    const struct device_costs *c = &forecast_costs;
    double side = setting->shadow_resolution, texels = w->map_faces * side * side;
    double deep_texels = w->deep_faces * side * side;
    if (!setting->has_shadows)
        return;
    terms[FORECAST_TERM_MAPS] +=
        w->map_faces * c->face_ms + MS * (texels * c->texel + w->map_triangles * c->caster);
    terms[FORECAST_TERM_DEEP] += MS * (deep_texels * (c->deep_texel + w->deep_share * c->event) +
                                       w->deep_triangles * c->deep_caster);
}

/* What rays shade of opaque surfaces at 4 samples over what is seen of them at one: shadow rays of
 * the demo, an engine and fins under spots were 1.9, 1.6 and 1.7 times as many with those that
 * samples have to themselves (renderer/raytrace/rt_batch_refine.h), which go beside fewer others;
 * fitted to the generated views. */
static const double SPLIT = 2.4;

static void add_rays(const struct workload *w, const struct forecast_setting *setting,
                     double terms[FORECAST_TERM_COUNT])
{
    const struct device_costs *c = &forecast_costs;
    double levels = log2(2 + w->triangles), rays = w->pixels * setting->samples;
    double more = setting->samples > 1 ? 1 : 0, split = setting->samples > 1 ? SPLIT : 1;
    double layers = w->pixels * w->layers, surfaces = layers + w->pixels * w->covered * split;
    double asked = setting->has_shadows ? w->lit : 0; /* lights, at each surface */
    terms[FORECAST_TERM_FRAME] += c->traced_frame_ms;
    terms[FORECAST_TERM_RAYS] += MS * w->pixels * (c->ray + w->covered * levels * c->hit_level);
    terms[FORECAST_TERM_MORE_RAYS] +=
        MS * (rays - w->pixels) * (c->more_ray + w->covered * levels * c->more_hit_level);
    terms[FORECAST_TERM_TRACED_TRIANGLES] +=
        MS * w->triangles_in_view * (c->traced_triangle + more * c->msaa_traced_triangle);
    terms[FORECAST_TERM_LAYER_RAYS] +=
        MS * (rays * w->layers * c->layer_ray + layers * asked * c->layer_light);
    terms[FORECAST_TERM_SHADOW_RAYS] += MS * surfaces * asked * c->shadow_ray;
    terms[FORECAST_TERM_TRACED_WALKS] += MS * surfaces * w->listed * c->traced_walk;
    terms[FORECAST_TERM_TRACED_TEXTURES] += MS * surfaces * w->textures * c->traced_texture;
}

static void add_point_rays(const struct workload *w, const struct forecast_setting *setting,
                           double terms[FORECAST_TERM_COUNT])
{
    const struct device_costs *c = &forecast_costs;
    double layers = w->pixels * w->layers, surfaces = count_surfaces(w);
    double more = setting->samples > 1 ? 1 : 0, levels = log2(2 + w->triangles);
    if (!setting->has_shadows || !w->shadowed_lights)
        return;
    terms[FORECAST_TERM_POINTS] +=
        MS * (w->pixels * (c->point_pixel + more * c->msaa_point_pixel) + surfaces * c->point);
    terms[FORECAST_TERM_POINT_RAYS] +=
        MS * (surfaces * w->lit * levels * c->point_level + layers * w->lit * c->layer_point_ray);
    terms[FORECAST_TERM_POINT_WALKS] += MS * surfaces * w->listed * c->point_walk;
}

double forecast_shade_ms(const struct workload *workload, const struct forecast_setting *setting)
{
    double terms[FORECAST_TERM_COUNT] = {0};
    add_shading(workload, setting, terms);
    return sum(terms);
}

double forecast_maps_ms(const struct workload *workload, const struct forecast_setting *setting)
{
    double terms[FORECAST_TERM_COUNT] = {0};
    add_maps(workload, setting, terms);
    return sum(terms);
}

double forecast_trace_ms(const struct workload *workload, const struct forecast_setting *setting)
{
    double terms[FORECAST_TERM_COUNT] = {0};
    add_rays(workload, setting, terms);
    return sum(terms);
}

double forecast_point_rays_ms(const struct workload *workload,
                              const struct forecast_setting *setting)
{
    double terms[FORECAST_TERM_COUNT] = {0};
    add_point_rays(workload, setting, terms);
    return sum(terms);
}

double forecast_maps_bytes(const struct workload *w, const struct forecast_setting *setting)
{
    const double depth = 4, head = 4, event = 18; /* renderer/shadows/shadow_deep.h */
    double side = setting->shadow_resolution, texels = side * side;
    if (!setting->has_shadows)
        return 0;
    return texels * (w->map_faces * depth + w->deep_faces * (head + w->deep_share * event));
}

double forecast_build_ms(const struct workload *w)
{
    return MS * w->triangles * forecast_costs.built_triangle;
}

/* terms: of one kind of work, whose speed of the device that is. */
static void spread(double terms[FORECAST_TERM_COUNT], double speed,
                   double total[FORECAST_TERM_COUNT])
{
    for (int i = 0; i < FORECAST_TERM_COUNT; i++) {
        total[i] += speed * terms[i];
        terms[i] = 0;
    }
}

void forecast_terms(const struct workload *workload, const struct forecast_setting *setting,
                    const struct device_speed *speed, enum forecast_technique technique,
                    double terms[FORECAST_TERM_COUNT])
{
    double some[FORECAST_TERM_COUNT] = {0};
    struct forecast_setting surfaces = *setting;
    bool is_rasterised = technique != FORECAST_RAYS, has_maps = technique == FORECAST_MAPS;
    for (int i = 0; i < FORECAST_TERM_COUNT; i++)
        terms[i] = 0;
    surfaces.has_shadows = setting->has_shadows && has_maps;
    if (is_rasterised) {
        terms[FORECAST_TERM_FRAME] = speed->frame_ms + speed->shade * forecast_costs.drawn_frame_ms;
        add_shading(workload, &surfaces, some);
        spread(some, speed->shade, terms);
    }
    if (has_maps && !setting->is_warm)
        add_maps(workload, setting, some);
    spread(some, speed->maps, terms);
    if (technique == FORECAST_RAYS)
        add_rays(workload, setting, some);
    if (technique == FORECAST_TRACED_SHADOWS)
        add_point_rays(workload, setting, some);
    spread(some, speed->trace, terms);
    if (!has_maps && !setting->is_warm && (!is_rasterised || workload->shadowed_lights))
        terms[FORECAST_TERM_BUILD] = speed->build * forecast_build_ms(workload);
}

static double forecast(const struct workload *workload, const struct forecast_setting *setting,
                       const struct device_speed *speed, enum forecast_technique technique)
{
    double terms[FORECAST_TERM_COUNT];
    forecast_terms(workload, setting, speed, technique, terms);
    return sum(terms);
}

double forecast_raster_ms(const struct workload *workload, const struct forecast_setting *setting,
                          const struct device_speed *speed)
{
    return forecast(workload, setting, speed, FORECAST_MAPS);
}

double forecast_traced_ms(const struct workload *workload, const struct forecast_setting *setting,
                          const struct device_speed *speed)
{
    return forecast(workload, setting, speed, FORECAST_RAYS);
}

double forecast_traced_shadows_ms(const struct workload *workload,
                                  const struct forecast_setting *setting,
                                  const struct device_speed *speed)
{
    return forecast(workload, setting, speed, FORECAST_TRACED_SHADOWS);
}

/* Forecasts are within a factor of 1.5 of each other's error, so a gain below a tenth is none. */
static const double GAIN_LEAST = 0.9;

enum forecast_technique forecast_choose(double maps_ms, double rays_ms, double traced_shadows_ms)
{
    double least_ms = fmin(rays_ms, traced_shadows_ms);
    if (!(least_ms < GAIN_LEAST * maps_ms))
        return FORECAST_MAPS;
    return rays_ms <= traced_shadows_ms ? FORECAST_RAYS : FORECAST_TRACED_SHADOWS;
}
