/* SPDX-License-Identifier: MIT */
/* Sums of units of work by their costs. */
#include "renderer/plan/forecast.h"

#include <math.h>

static const double MS = 1e-6; /* per ns */

/* AMD EPYC, 2 cores, Mesa 22.3.6 llvmpipe: docs/tradeoffs.md, "The models". */
const struct device_costs forecast_costs = {
    .pixel = 58,
    .msaa_pixel = 79,
    .msaa_covered = 202,
    .light = 49,
    .look = 174,
    .tap = 51,
    .layer = 640,
    .msaa_layer = 1073,
    .texture = 270,
    .msaa_texture = 326,
    .triangle = 152,
    .msaa_triangle = 249,
    .face_ms = 0.4,
    .texel = 1.9,
    .caster = 222,
    .deep_texel = 13.4,
    .deep_caster = 490,
    .event = 28,
    .ray = 16,
    .hit_level = 14.3,
    .shadow_ray = 117,
    .layer_ray = 237,
    .layer_light = 455,
    .traced_texture = 129,
    .traced_frame_ms = 1.0,
    .point_pixel = 43,
    .msaa_point_pixel = 85,
    .point = 79,
    .point_level = 3.3,
    .layer_point_ray = 1310,
    .built_triangle = 281,
};

bool device_speed_is_known(const struct device_speed *speed)
{
    return speed->shade > 0 && speed->maps > 0 && speed->trace > 0 && speed->build > 0;
}

double forecast_shade_ms(const struct workload *w, const struct forecast_setting *setting)
{
    const struct device_costs *c = &forecast_costs;
    double more = setting->samples > 1 ? 1 : 0;
    double layers = w->pixels * w->layers, covered = w->pixels * w->covered;
    double surfaces = layers + covered;
    double looks =
        setting->has_shadows && w->shadowed_lights ? c->look + c->tap * setting->shadow_taps : 0;
    return MS *
           (w->pixels * (c->pixel + more * c->msaa_pixel) + covered * more * c->msaa_covered +
            surfaces * w->lit * (c->light + looks) + layers * (c->layer + more * c->msaa_layer) +
            surfaces * w->textures * (c->texture + more * c->msaa_texture) +
            w->triangles_in_view * (c->triangle + more * c->msaa_triangle));
}

double forecast_maps_ms(const struct workload *w, const struct forecast_setting *setting)
{
    const struct device_costs *c = &forecast_costs;
    double side = setting->shadow_resolution, texels = w->map_faces * side * side;
    double deep_texels = w->deep_faces * side * side;
    if (!setting->has_shadows)
        return 0;
    return w->map_faces * c->face_ms +
           MS * (texels * c->texel + w->map_triangles * c->caster +
                 deep_texels * (c->deep_texel + w->deep_share * c->event) +
                 w->deep_triangles * c->deep_caster);
}

double forecast_maps_bytes(const struct workload *w, const struct forecast_setting *setting)
{
    const double depth = 4, head = 4, event = 18; /* renderer/shadows/shadow_deep.h */
    double side = setting->shadow_resolution, texels = side * side;
    if (!setting->has_shadows)
        return 0;
    return texels * (w->map_faces * depth + w->deep_faces * (head + w->deep_share * event));
}

double forecast_trace_ms(const struct workload *w, const struct forecast_setting *setting)
{
    const struct device_costs *c = &forecast_costs;
    double levels = log2(2 + w->triangles), rays = w->pixels * setting->samples;
    double layers = w->pixels * w->layers, surfaces = layers + w->pixels * w->covered;
    double asked = setting->has_shadows ? w->lit : 0; /* lights, at each surface */
    return c->traced_frame_ms +
           MS * (rays * (c->ray + w->covered * levels * c->hit_level + w->layers * c->layer_ray) +
                 surfaces * asked * c->shadow_ray + layers * asked * c->layer_light +
                 surfaces * w->textures * c->traced_texture);
}

double forecast_point_rays_ms(const struct workload *w, const struct forecast_setting *setting)
{
    const struct device_costs *c = &forecast_costs;
    double layers = w->pixels * w->layers, surfaces = layers + w->pixels * w->covered;
    double more = setting->samples > 1 ? 1 : 0, levels = log2(2 + w->triangles);
    if (!setting->has_shadows || !w->shadowed_lights)
        return 0;
    return MS *
           (w->pixels * (c->point_pixel + more * c->msaa_point_pixel) + surfaces * c->point +
            surfaces * w->lit * levels * c->point_level + layers * w->lit * c->layer_point_ray);
}

double forecast_build_ms(const struct workload *w)
{
    return MS * w->triangles * forecast_costs.built_triangle;
}

double forecast_raster_ms(const struct workload *workload, const struct forecast_setting *setting,
                          const struct device_speed *speed)
{
    return speed->frame_ms + speed->shade * forecast_shade_ms(workload, setting) +
           (setting->is_warm ? 0 : speed->maps * forecast_maps_ms(workload, setting));
}

double forecast_traced_ms(const struct workload *workload, const struct forecast_setting *setting,
                          const struct device_speed *speed)
{
    return speed->trace * forecast_trace_ms(workload, setting) +
           (setting->is_warm ? 0 : speed->build * forecast_build_ms(workload));
}

double forecast_traced_shadows_ms(const struct workload *workload,
                                  const struct forecast_setting *setting,
                                  const struct device_speed *speed)
{
    struct forecast_setting bare = *setting;
    bare.has_shadows = false;
    double build_ms = setting->is_warm || !workload->shadowed_lights
                          ? 0
                          : speed->build * forecast_build_ms(workload);
    return speed->frame_ms + speed->shade * forecast_shade_ms(workload, &bare) +
           speed->trace * forecast_point_rays_ms(workload, setting) + build_ms;
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
