/* SPDX-License-Identifier: MIT */
/* Sums of units of work by their costs. */
#include "renderer/forecast/forecast.h"

#include <math.h>

#include "protocol/haze_taps.h"
#include "protocol/quality_defaults.h"

static const double MS = 1e-6; /* per ns */

/* AMD EPYC, 2 cores, Mesa 22.3.6 llvmpipe: docs/explanation/cost-model.md. */
const struct device_costs forecast_costs = {
    .pixel = 113,
    .msaa_pixel = 114,
    .msaa_covered = 194,
    .area_light = 120,
    .light = 46,
    .look = 130,
    .tap = 38,
    .walk = 11,
    .layer = 640,
    .msaa_layer = 1073,
    .peel_ms = 0.6,
    .peeled_pixel = 100,
    .peeled_triangle = 400,
    .peeled_side = 70,
    .msaa_peeled_side = 140,
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
    .layer_texel = 2,
    .ray = 16.3,
    .hit_level = 7.6,
    .more_ray = 33,
    .more_hit_level = 3.3,
    .traced_triangle = 30,
    .msaa_traced_triangle = 88,
    .shadow_ray = 83,
    .traced_walk = 0.64,
    .area_ray_level = 10.8,
    .layer_area_light = 203,
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
    .point_area_level = 16.4,
    .layer_area_ray = 240,
    .area_triangle = 1370,
    .area_point = 260,
    .area_asked = 4.25,
    .area_ray = 1.75,
    .built_triangle = 281,
    .volume_point = 72,
    .volume_triangle = 465,
    .msaa_volume_triangle = 518,
    .volume_pixel = 83,
    .msaa_volume_pixel = 87,
    .haze_slice = 110,
    .haze_ray = 11,
    .grid_point = 527,
    .grid_cell = 41.5,
    .smoke_node = 620,
    .smoke_light = 155,
    .smoke_cell = 5.2,
};

bool device_speed_is_known(const struct device_speed *speed)
{
    return speed->shade > 0 && speed->maps > 0 && speed->trace > 0 && speed->build > 0;
}

double forecast_sum_ms(const double terms[FORECAST_TERM_COUNT])
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

/* Mean lights that shine on one, an area as one. */
static double count_lit(const struct workload *w)
{
    return w->lit - w->area_rays + w->lit_areas;
}

/* How many times a rasterised picture is drawn for its samples: renderer/base/sample_pattern.h. */
static double count_rounds(const struct forecast_setting *setting)
{
    return setting->samples > 4 ? setting->samples / 4.0 : 1;
}

/* On the machine of the fit, as all that follow. */
static void add_shading(const struct workload *w, const struct forecast_setting *setting,
                        double terms[FORECAST_TERM_COUNT])
{
    const struct device_costs *c = &forecast_costs;
    double more = setting->samples > 1 ? 1 : 0, rounds = count_rounds(setting);
    double pixels = rounds * w->pixels;
    double layers = pixels * w->layers, covered = pixels * w->covered;
    double surfaces = rounds * count_surfaces(w);
    terms[FORECAST_TERM_PIXELS] +=
        MS * (pixels * (c->pixel + more * c->msaa_pixel) + covered * more * c->msaa_covered);
    terms[FORECAST_TERM_LIGHTS] +=
        MS * surfaces * ((w->lit - w->area_rays) * c->light + w->lit_areas * c->area_light);
    terms[FORECAST_TERM_WALKS] += MS * surfaces * w->listed * c->walk;
    terms[FORECAST_TERM_LAYERS] += MS * layers * (c->layer + more * c->msaa_layer);
    terms[FORECAST_TERM_TEXTURES] +=
        MS * surfaces * w->textures * (c->texture + more * c->msaa_texture);
    terms[FORECAST_TERM_TRIANGLES] +=
        MS * rounds * w->triangles_in_view * (c->triangle + more * c->msaa_triangle);
}

/* A slice of haze is lit as a surface is. */
static void add_haze(const struct workload *w, const struct forecast_setting *setting,
                     double terms[FORECAST_TERM_COUNT])
{
    const struct device_costs *c = &forecast_costs;
    terms[FORECAST_TERM_HAZE] += MS * count_rounds(setting) * w->haze_slices *
                                 (c->haze_slice + w->listed * c->walk + w->haze_lit * c->light);
}

static void add_haze_rays(const struct workload *w, double rounds,
                          double terms[FORECAST_TERM_COUNT])
{
    double levels = log2(2 + w->triangles);
    terms[FORECAST_TERM_HAZE_RAYS] +=
        MS * rounds * w->haze_slices * w->haze_lit * levels * forecast_costs.haze_ray;
}

/* Likewise of density grids. Each pixel follows its ray once, whatever its samples in a round. */
static void add_smoke(const struct workload *w, const struct forecast_setting *setting,
                      double terms[FORECAST_TERM_COUNT])
{
    const struct device_costs *c = &forecast_costs;
    double cells = w->pixels * w->grid_cells;
    if (setting->has_shadows)
        cells += w->grid_node_cells + count_surfaces(w) * w->grid_shadow_cells;
    double points = setting->has_shadows && !setting->is_warm ? w->grid_point_cells : 0;
    terms[FORECAST_TERM_GRIDS] +=
        MS * (points * c->smoke_cell +
              count_rounds(setting) * (cells * c->smoke_cell + w->grid_nodes * c->smoke_node +
                                       w->grid_node_lights * c->smoke_light));
}

/* surfaces: that are shaded. The points of a ray are those of one more panel of four than asked for
 * (renderer/raytrace/rt_haze.c). */
static void add_grids(const struct workload *w, const struct forecast_setting *setting,
                      double surfaces, double terms[FORECAST_TERM_COUNT])
{
    const struct device_costs *c = &forecast_costs;
    double rays = w->pixels * setting->samples, cells = w->grid_cells;
    double points = 4 + 4 * ceil(quality_grid_points(w->grid_samples, setting->samples) / 4.0);
    if (setting->has_shadows) {
        cells += points * w->grid_lit_cells;
        terms[FORECAST_TERM_GRIDS] += MS * surfaces * w->grid_shadow_cells * c->grid_cell;
    }
    terms[FORECAST_TERM_GRIDS] +=
        MS * rays * (points * w->grid_lights * c->grid_point + cells * c->grid_cell);
}

static void add_looks(const struct workload *w, const struct forecast_setting *setting,
                      double terms[FORECAST_TERM_COUNT])
{
    const struct device_costs *c = &forecast_costs;
    if (!setting->has_shadows || !w->shadowed_lights)
        return;
    double looks = c->look + c->tap * setting->shadow_taps;
    double in_haze = c->look + c->tap * haze_taps(setting->shadow_taps);
    terms[FORECAST_TERM_LOOKS] +=
        MS * count_rounds(setting) * count_surfaces(w) * count_lit(w) * looks;
    terms[FORECAST_TERM_HAZE] +=
        MS * count_rounds(setting) * w->haze_slices * w->haze_lit * in_haze;
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
    double asked = setting->has_shadows ? w->lit + w->directions : 0; /* at each surface */
    double areas = setting->has_shadows ? w->area_rays : 0;           /* of these */
    terms[FORECAST_TERM_FRAME] += c->traced_frame_ms;
    terms[FORECAST_TERM_RAYS] += MS * w->pixels * (c->ray + w->covered * levels * c->hit_level);
    terms[FORECAST_TERM_MORE_RAYS] +=
        MS * (rays - w->pixels) * (c->more_ray + w->covered * levels * c->more_hit_level);
    terms[FORECAST_TERM_TRACED_TRIANGLES] +=
        MS * w->triangles_in_view * (c->traced_triangle + more * c->msaa_traced_triangle);
    terms[FORECAST_TERM_LAYER_RAYS] +=
        MS * (rays * w->layers * c->layer_ray +
              layers * ((asked - areas) * c->layer_light + areas * c->layer_area_light));
    terms[FORECAST_TERM_SHADOW_RAYS] +=
        MS * surfaces * ((asked - areas) * c->shadow_ray + areas * levels * c->area_ray_level);
    terms[FORECAST_TERM_TRACED_WALKS] += MS * surfaces * w->listed * c->traced_walk;
    terms[FORECAST_TERM_TRACED_TEXTURES] += MS * surfaces * w->textures * c->traced_texture;
    add_haze_rays(w, 1, terms);
    add_grids(w, setting, surfaces, terms);
}

static void add_point_rays(const struct workload *w, const struct forecast_setting *setting,
                           double terms[FORECAST_TERM_COUNT])
{
    const struct device_costs *c = &forecast_costs;
    double pixels = count_rounds(setting) * w->pixels;
    double layers = pixels * w->layers, surfaces = count_rounds(setting) * count_surfaces(w);
    double more = setting->samples > 1 ? 1 : 0, levels = log2(2 + w->triangles);
    if (!setting->has_shadows || !w->shadowed_lights)
        return;
    terms[FORECAST_TERM_POINTS] +=
        MS * (pixels * (c->point_pixel + more * c->msaa_point_pixel) + surfaces * c->point);
    double areas = w->area_rays, others = w->lit - areas;
    terms[FORECAST_TERM_POINT_RAYS] +=
        MS * (surfaces * levels * (others * c->point_level + areas * c->point_area_level) +
              layers * (others * c->layer_point_ray + areas * c->layer_area_ray));
    terms[FORECAST_TERM_POINT_WALKS] += MS * surfaces * w->listed * c->point_walk;
    add_haze_rays(w, count_rounds(setting), terms);
}

double forecast_shade_ms(const struct workload *workload, const struct forecast_setting *setting)
{
    double terms[FORECAST_TERM_COUNT] = {0};
    add_shading(workload, setting, terms);
    add_looks(workload, setting, terms);
    return forecast_sum_ms(terms);
}

double forecast_maps_ms(const struct workload *workload, const struct forecast_setting *setting)
{
    double terms[FORECAST_TERM_COUNT] = {0};
    add_maps(workload, setting, terms);
    return forecast_sum_ms(terms);
}

double forecast_trace_ms(const struct workload *workload, const struct forecast_setting *setting)
{
    double terms[FORECAST_TERM_COUNT] = {0};
    add_rays(workload, setting, terms);
    return forecast_sum_ms(terms);
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

/* ---- on the device ---- */

/* terms: of one kind of work, whose speed of the device that is. */
static void spread(const double terms[FORECAST_TERM_COUNT], double speed,
                   double total[FORECAST_TERM_COUNT])
{
    for (int i = 0; i < FORECAST_TERM_COUNT; i++)
        total[i] += speed * terms[i];
}

static void add_build(const struct forecast_frame *frame, double terms[FORECAST_TERM_COUNT])
{
    if (!frame->setting->is_warm)
        terms[FORECAST_TERM_BUILD] += frame->speed->build * forecast_build_ms(frame->workload);
}

void forecast_add_surfaces(const struct forecast_frame *frame, double terms[FORECAST_TERM_COUNT])
{
    double some[FORECAST_TERM_COUNT] = {0};
    terms[FORECAST_TERM_FRAME] += frame->speed->frame_ms + count_rounds(frame->setting) *
                                                               frame->speed->shade *
                                                               forecast_costs.drawn_frame_ms;
    add_shading(frame->workload, frame->setting, some);
    add_haze(frame->workload, frame->setting, some);
    add_smoke(frame->workload, frame->setting, some);
    spread(some, frame->speed->shade, terms);
}

void forecast_add_peels(const struct forecast_frame *frame, double terms[FORECAST_TERM_COUNT])
{
    const struct device_costs *c = &forecast_costs;
    const struct workload *w = frame->workload;
    double some[FORECAST_TERM_COUNT] = {0}, more = frame->setting->samples > 1 ? 1 : 0;
    some[FORECAST_TERM_PEELS] =
        count_rounds(frame->setting) *
        (w->peels * c->peel_ms +
         MS * (w->pixels * (w->peeled_sides * (c->peeled_side + more * c->msaa_peeled_side) +
                            w->peeled_pixels * c->peeled_pixel) +
               w->peels * w->peeled_triangles * c->peeled_triangle));
    spread(some, frame->speed->shade, terms);
}

void forecast_add_maps(const struct forecast_frame *frame, double terms[FORECAST_TERM_COUNT])
{
    double looks[FORECAST_TERM_COUNT] = {0}, maps[FORECAST_TERM_COUNT] = {0};
    add_looks(frame->workload, frame->setting, looks);
    spread(looks, frame->speed->shade, terms);
    if (!frame->setting->is_warm)
        add_maps(frame->workload, frame->setting, maps);
    spread(maps, frame->speed->maps, terms);
}

void forecast_add_points(const struct forecast_frame *frame, double terms[FORECAST_TERM_COUNT])
{
    double some[FORECAST_TERM_COUNT] = {0};
    add_point_rays(frame->workload, frame->setting, some);
    spread(some, frame->speed->trace, terms);
    if (frame->workload->shadowed_lights)
        add_build(frame, terms);
}

void forecast_add_layered_maps(const struct forecast_frame *frame,
                               double terms[FORECAST_TERM_COUNT])
{
    const struct workload *w = frame->workload;
    double looks[FORECAST_TERM_COUNT] = {0}, maps[FORECAST_TERM_COUNT] = {0};
    double side = frame->setting->shadow_resolution;
    double texels = w->deep_faces * fmax(w->deep_layers, 1) * side * side;
    add_looks(w, frame->setting, looks);
    spread(looks, frame->speed->shade, terms);
    if (!frame->setting->is_warm)
        add_maps(w, frame->setting, maps);
    if (maps[FORECAST_TERM_DEEP] > 0)
        maps[FORECAST_TERM_DEEP] = MS * (texels * forecast_costs.layer_texel +
                                         w->deep_triangles * forecast_costs.deep_caster);
    spread(maps, frame->speed->maps, terms);
}

void forecast_add_area(const struct forecast_frame *frame, double terms[FORECAST_TERM_COUNT])
{
    const struct device_costs *c = &forecast_costs;
    const struct workload *w = frame->workload;
    double some[FORECAST_TERM_COUNT] = {0}, rounds = count_rounds(frame->setting);
    double surfaces = rounds * count_surfaces(w), lights = (double)w->shadowed_lights;
    double more = frame->setting->samples > 1 ? 1 : 0;
    if (frame->setting->has_shadows && w->shadowed_lights) {
        some[FORECAST_TERM_POINTS] =
            MS * (rounds * w->pixels * (c->point_pixel + more * c->msaa_point_pixel) +
                  lights * surfaces * c->area_point);
        some[FORECAST_TERM_POINT_RAYS] = MS * surfaces *
                                         (count_lit(w) * c->area_asked + w->lit * c->area_ray) *
                                         sqrt(w->triangles);
        some[FORECAST_TERM_POINTS] += MS * rounds * lights * w->triangles * c->area_triangle;
    }
    spread(some, frame->speed->shade, terms);
}

void forecast_add_volumes(const struct forecast_frame *frame, double terms[FORECAST_TERM_COUNT])
{
    const struct workload *w = frame->workload;
    const struct forecast_setting *setting = frame->setting;
    const struct device_costs *c = &forecast_costs;
    double some[FORECAST_TERM_COUNT] = {0}, rounds = count_rounds(setting);
    double more = setting->samples > 1 ? 1 : 0, surfaces = rounds * count_surfaces(w);
    if (!setting->has_shadows || !w->shadowed_lights)
        return;
    some[FORECAST_TERM_POINTS] +=
        MS * rounds * w->pixels * (c->point_pixel + more * c->msaa_point_pixel);
    some[FORECAST_TERM_POINTS] +=
        MS * (double)w->shadowed_lights *
        (surfaces * c->volume_point +
         rounds * w->triangles * (c->volume_triangle + more * c->msaa_volume_triangle));
    some[FORECAST_TERM_POINT_WALKS] += MS * rounds * w->face_pixels * (1 + w->layers) *
                                       (c->volume_pixel + more * c->msaa_volume_pixel);
    spread(some, frame->speed->maps, terms);
}

void forecast_add_rays(const struct forecast_frame *frame, double terms[FORECAST_TERM_COUNT])
{
    double some[FORECAST_TERM_COUNT] = {0};
    add_rays(frame->workload, frame->setting, some);
    spread(some, frame->speed->trace, terms);
    add_build(frame, terms);
}

/* ---- errors ---- */

static const double TEXEL_ERROR = 0.15; /* of a map with one texel and tap */

double forecast_maps_error(const struct forecast_setting *setting)
{
    return TEXEL_ERROR * sqrt(sqrt((double)setting->shadow_taps) / setting->shadow_resolution);
}

/* Of the light between more than two surfaces that filter it: docs/reference/accuracy.md. */
static const double MOMENTS_ERROR = 0.042;

double forecast_moments_error(const struct forecast_setting *setting)
{
    return hypot(forecast_maps_error(setting), MOMENTS_ERROR);
}
