/* SPDX-License-Identifier: MIT */
/* Choosing a setting: one pass over the rows with an order, and the models for no rows. */
#include "renderer/cost/choice.h"

#include <assert.h>
#include <math.h>

#include "protocol/quality_defaults.h"
#include "renderer/cost/technique_forecast.h"
#include "renderer/scene/atmosphere_grid.h"
#include "renderer/shadows/technique.h"

bool choice_row_fits(const struct choice_row *row, const struct quality_target *target)
{
    const struct quality_setting *setting = &row->setting;
    if (target->shadows != SHADOWS_AUTO && target->shadows != setting->shadows)
        return false;
    if (target->samples && target->samples != setting->samples)
        return false;
    if (!shadow_technique_can(setting->shadows, target->needs))
        return false;
    if (target->atmosphere_samples && target->atmosphere_samples != setting->atmosphere_samples)
        return false;
    if (target->transparency != TRANSPARENCY_AUTO && setting->transparency != TRANSPARENCY_AUTO &&
        target->transparency != setting->transparency)
        return false;
    if (setting->shadow_resolution == 0)
        return true;
    bool has_lists = shadow_technique_has(setting->shadows, SHADOW_HAS_COMPRESSION);
    if (has_lists &&
        ((target->shadow_compression > 0 &&
          target->shadow_compression != setting->shadow_compression) ||
         (target->shadow_prefilter && target->shadow_prefilter != setting->shadow_prefilter)))
        return false;
    return (!target->shadow_resolution ||
            target->shadow_resolution == setting->shadow_resolution) &&
           (!target->shadow_taps || target->shadow_taps == setting->shadow_taps);
}

/* How well a row serves: a higher class wins; within a class the lower first number, then the lower
 * second. */
struct rank {
    int class_;
    double first, second;
};

static bool keeps_error(const struct choice_row *row, const struct quality_target *target)
{
    return target->max_error <= 0 || row->error <= target->max_error;
}

static bool keeps_budget(const struct choice_row *row, const struct quality_target *target)
{
    return target->budget_ms <= 0 || row->ms <= target->budget_ms;
}

static struct rank rank_row(const struct choice_row *row, const struct quality_target *target)
{
    bool is_true = keeps_error(row, target), is_quick = keeps_budget(row, target);
    if (target->max_error > 0 && is_true && is_quick)
        return (struct rank){3, row->ms, row->error};
    if (is_quick && target->budget_ms > 0) /* alone, or with an error that nothing keeps in time */
        return (struct rank){2, row->error, row->ms};
    if (target->budget_ms <= 0) /* an error that nothing keeps: the nearest is the smallest */
        return (struct rank){1, row->error, row->ms};
    if (target->max_error > 0 && is_true)
        return (struct rank){1, row->ms, row->error};
    return (struct rank){0, row->ms, row->error};
}

static bool is_before(const struct rank *a, const struct rank *b)
{
    if (a->class_ != b->class_)
        return a->class_ > b->class_;
    return a->first < b->first || (a->first == b->first && a->second < b->second);
}

/* How much later a picture with shadows may come than was asked for, and how much better it must
 * be, before all of its shadows are dropped for the time. */
static const double LATE_MOST = 1.5, WORTH = 0.5;

static bool is_bare(const struct choice_row *row)
{
    return row->setting.shadows == SHADOWS_NONE;
}

/* Whether dropping all shadows would keep the budget, and is not worth it. Who names an error has
 * said what it is worth. */
static bool drops_too_much(const struct choice_row *rows, size_t count,
                           const struct quality_target *target, const struct choice_row *bare)
{
    if (target->budget_ms <= 0 || target->shadows == SHADOWS_NONE || !is_bare(bare) ||
        (target->max_error > 0 && keeps_error(bare, target)))
        return false;
    for (size_t i = 0; i < count; i++)
        if (!is_bare(&rows[i]) && choice_row_fits(&rows[i], target) &&
            rows[i].ms <= LATE_MOST * target->budget_ms && rows[i].error <= WORTH * bare->error &&
            isfinite(rows[i].error))
            return true;
    return false;
}

bool choice_make(const struct choice_row *rows, size_t count, const struct quality_target *target,
                 struct choice *choice)
{
    struct rank best = {.class_ = -1};
    *choice = (struct choice){0};
    for (size_t i = 0; i < count; i++) {
        if (!choice_row_fits(&rows[i], target) || drops_too_much(rows, count, target, &rows[i]))
            continue;
        struct rank rank = rank_row(&rows[i], target);
        if (choice->row && !is_before(&rank, &best))
            continue;
        best = rank;
        choice->row = &rows[i];
    }
    if (!choice->row)
        return false;
    choice->keeps_error = keeps_error(choice->row, target);
    choice->keeps_budget = keeps_budget(choice->row, target);
    return true;
}

/* ---- models ---- */

/* RMSE where the image's side, the root of its pixels, is 480: docs/explanation/cost-model.md. */
static const double SIDE_PX = 480;
enum { RASTER_SETTINGS = 4, RASTER_OPEN = 2 /* the others are taken only where they are said */ };
static const int RASTER_SAMPLES[RASTER_SETTINGS] = {1, 4, 8, 16};
static const double RASTER_ERROR[RASTER_SETTINGS] = {0.036, 0.0215, 0.0213, 0.021};
enum { TRACED_SETTINGS = 5 };
static const int TRACED_SAMPLES[TRACED_SETTINGS] = {1, 4, 16, 64, 256};
static const double TRACED_ERROR[TRACED_SETTINGS] = {0.036, 0.0155, 0.0075, 0.004, 0.0022};

/* At most the whole error of eight generated scenes in haze of 0.1 per metre, of 120 x 90 pixels.
 * It lies around lamps, whose glow rays find by themselves, and hardly depends on the samples. */
enum { HAZE_SETTINGS = 3 };
static const int HAZE_SLICES[HAZE_SETTINGS] = {ATMOSPHERE_SLICES_FEWER, ATMOSPHERE_SLICES_DEFAULT,
                                               ATMOSPHERE_SLICES_MORE};
static const double HAZE_RASTER_ERROR[HAZE_SETTINGS] = {0.057, 0.039, 0.03};
static const double HAZE_TRACED_ERROR[HAZE_SETTINGS] = {0.031, 0.0245, 0.023};

/* Costs were fitted to frames of 1 and 4 samples. With more, four of five scenes take at most this
 * many times what the sum says for a scene as in the mean: glass and edges are not counted. */
static const double TRACED_CAUTION = 4;

/* That of the most samples of the table that are no more than these. */
static double find_error(const int *samples, const double *errors, int count, int wanted)
{
    int i = 0;
    while (i + 1 < count && samples[i + 1] <= wanted)
        i++;
    return errors[i];
}

static double haze_error(const struct quality_setting *setting)
{
    bool is_traced = shadow_technique_is_renderer(setting->shadows);
    return find_error(HAZE_SLICES, is_traced ? HAZE_TRACED_ERROR : HAZE_RASTER_ERROR, HAZE_SETTINGS,
                      quality_or(setting->atmosphere_samples, ATMOSPHERE_SLICES_DEFAULT));
}

static double traced_error(int samples)
{
    return find_error(TRACED_SAMPLES, TRACED_ERROR, TRACED_SETTINGS, samples);
}

static double raster_error(int samples)
{
    return find_error(RASTER_SAMPLES, RASTER_ERROR, RASTER_SETTINGS, samples);
}

static double count_pixels(const struct choice_frame *frame)
{
    return (double)frame->width_px * frame->height_px;
}

/* Slices of all columns of the grid over the picture in which haze and smoke find their light. */
static double count_slices(const struct choice_frame *frame, int atmosphere_samples)
{
    const struct view view = {.width_px = frame->width_px,
                              .height_px = frame->height_px,
                              .quality.atmosphere_samples = atmosphere_samples};
    const struct camera_window whole = camera_window_whole(view.width_px, view.height_px);
    const struct atmosphere_grid grid = atmosphere_grid_of(&view, &whole);
    return (double)atmosphere_columns(&grid) * grid.slices;
}

/* What the counts do not tell, as in the mean of the shared scenes. */
static struct workload guess_work(const struct choice_frame *frame,
                                  const struct quality_setting *setting)
{
    double lights = (double)frame->lights, triangles = (double)frame->triangles;
    double pixels = count_pixels(frame), slices = count_slices(frame, setting->atmosphere_samples);
    const double smoke = frame->has_grids; /* three of four generated scenes have less of it */
    const double nodes = 0.38 * pixels * smoke * slices / count_slices(frame, 0);
    /* Half of the generated scenes with glass have more layers before one another. */
    double sides = frame->has_haze || frame->has_grids ? 0 : frame->peeled_sides;
    double peels = sides > 0 ? 4 / sides : 0;
    return (struct workload){
        .pixels = pixels,
        .covered = 0.3,
        .layers = 0.1,
        .peeled_sides = sides,
        .peels = peels,
        .peeled_pixels = 0.1 * peels,
        .peeled_triangles = 0.2 * triangles,
        .lit = fmin(0.8 * lights, 3),
        .listed = lights, /* as those without a range are */
        .textures = 1.5,
        .triangles = triangles,
        .triangles_in_view = triangles,
        .lights = frame->lights,
        .shadowed_lights = frame->lights,
        .deep_lights = frame->lights / 2,
        .map_faces = 2 * lights, /* points have six, spots and suns one */
        .deep_faces = lights,
        .map_triangles = 1.5 * lights * triangles,
        .deep_triangles = 0.2 * lights * triangles,
        .deep_share = 0.3,
        .deep_layers = 6, /* half of the generated scenes with panes have more */
        .haze_slices = frame->has_haze ? 0.7 * slices : 0, /* the others are behind what is seen */
        .haze_lit = 0.5 * lights,                          /* many are spots */
        .grid_cells = 10 * smoke,
        .grid_lights = 0.24 * lights * smoke,
        .grid_lit_cells = 2 * lights * smoke,
        .grid_nodes = nodes,
        .grid_node_lights = 0.75 * lights * nodes,
        .grid_node_cells = 13 * lights * nodes,
        .grid_shadow_cells = 18 * fmin(0.8 * lights, 3) * smoke,
        .grid_samples = setting->atmosphere_samples,
    };
}

static const struct device_speed *speed_of(const struct choice_frame *frame)
{
    static const struct device_speed typical = {0.5, 1, 1, 1, 1};
    return device_speed_is_known(&frame->speed) ? &frame->speed : &typical;
}

/* Shadow maps that fit their budget stay from frame to frame. */
static bool can_stay(const struct choice_frame *frame, const struct workload *workload,
                     const struct forecast_setting *setting)
{
    return frame->shadow_bytes <= 0 || !setting->shadow_resolution ||
           forecast_maps_bytes(workload, setting) <= frame->shadow_bytes;
}

/* Of the rasteriser: what fits the budget of the maps, and its targets (renderer/window/targets.c:
 * 52 bytes for a pixel of one sample, 200 for one of four, 48 for sums of several rounds). */
static double raster_bytes(const struct choice_frame *frame, const struct workload *workload,
                           const struct forecast_setting *setting)
{
    double maps = forecast_maps_bytes(workload, setting);
    double most = frame->shadow_bytes > 0 ? frame->shadow_bytes : maps;
    double pixel_bytes = setting->samples > 4 ? 248 : setting->samples > 1 ? 200 : 52;
    return fmin(maps, most) + count_pixels(frame) * pixel_bytes;
}

static struct choice_row estimate(const struct choice_frame *frame,
                                  const struct quality_setting *setting)
{
    bool is_renderer = shadow_technique_is_renderer(setting->shadows);
    bool has_shadows = setting->shadows != SHADOWS_NONE;
    struct workload workload = guess_work(frame, setting);
    struct forecast_setting cost = {
        .samples = setting->samples,
        .shadow_resolution = setting->shadow_resolution,
        .shadow_taps = setting->shadow_taps,
        .has_shadows = has_shadows,
    };
    cost.is_warm = frame->is_warm && can_stay(frame, &workload, &cost);
    double camera = is_renderer ? traced_error(setting->samples) : raster_error(setting->samples);
    double shadow = frame->lights ? technique_forecast_error(setting->shadows, &cost) : 0;
    double haze = frame->has_haze ? haze_error(setting) : 0;
    double side = sqrt(fmax(count_pixels(frame), 1));
    double ms = technique_forecast_ms(setting->shadows,
                                      &(struct forecast_frame){&workload, &cost, speed_of(frame)});
    return (struct choice_row){
        .setting = *setting,
        .ms = is_renderer && setting->samples > 4 ? TRACED_CAUTION * ms : ms,
        .error =
            !has_shadows ? INFINITY : hypot(hypot(camera, shadow) * sqrt(SIDE_PX / side), haze),
        .bytes = is_renderer ? 0 : raster_bytes(frame, &workload, &cost),
    };
}

/* The values of one parameter: the requested one alone, else those of the sweep. */
static int values_of(int said, const int *swept, int count, int out[])
{
    for (int i = 0; i < (said ? 1 : count); i++)
        out[i] = said ? said : swept[i];
    return said ? 1 : count;
}

enum { MEDIA_SETTINGS = 3, TECHNIQUE_ROWS_MAX = 40 * MEDIA_SETTINGS };
/* The default, fewer and more, as a trade-off measures them in haze. */
static const int MEDIA_SAMPLES[MEDIA_SETTINGS] = {0, ATMOSPHERE_SLICES_FEWER,
                                                  ATMOSPHERE_SLICES_MORE};

/* Maps that have several layers have no room for many texels in each: of a point light, whose
 * casters are divided into twenty, those of the default fit a device that reads 2^27. */
static int count_resolutions(enum shadow_technique shadows)
{
    const struct shadow_method *method = shadow_method_of(shadows);
    return method && method->structure->divide ? 3 : 5;
}

/* Adds rows for all values of the parameters that the technique has. */
static size_t estimate_technique(const struct choice_frame *frame,
                                 const struct quality_target *target, enum shadow_technique shadows,
                                 struct choice_row *rows)
{
    static const int all_resolutions[] = {256, 512, 1024, 2048, 4096}, all_taps[] = {1, 4, 9, 16};
    static const int none[] = {0};
    bool is_renderer = shadow_technique_is_renderer(shadows);
    bool has_maps = shadow_technique_has(shadows, SHADOW_HAS_MAP);
    int resolutions[5], taps[4], samples[TRACED_SETTINGS], media[MEDIA_SETTINGS];
    int media_count = values_of(target->atmosphere_samples, MEDIA_SAMPLES,
                                frame->has_haze ? MEDIA_SETTINGS : 1, media);
    int samples_count = is_renderer
                            ? values_of(target->samples, TRACED_SAMPLES, TRACED_SETTINGS, samples)
                            : values_of(target->samples, RASTER_SAMPLES, RASTER_OPEN, samples);
    int resolution_count = has_maps ? values_of(target->shadow_resolution, all_resolutions,
                                                count_resolutions(shadows), resolutions)
                                    : values_of(0, none, 1, resolutions);
    int taps_count =
        has_maps ? values_of(target->shadow_taps, all_taps, 4, taps) : values_of(0, none, 1, taps);
    size_t count = 0;
    for (int m = 0; m < media_count; m++)
        for (int s = 0; s < samples_count; s++)
            for (int r = 0; r < resolution_count; r++)
                for (int t = 0; t < taps_count; t++)
                    rows[count++] = estimate(
                        frame, &(struct quality_setting){.shadows = shadows,
                                                         .shadow_resolution = resolutions[r],
                                                         .shadow_taps = taps[t],
                                                         .samples = samples[s],
                                                         .atmosphere_samples = media[m]});
    return count;
}

/* Of techniques that not all casters fit none is promised before the scene is looked at. */
static bool is_estimated(const struct quality_target *target, enum shadow_technique shadows)
{
    bool is_open = target->shadows == SHADOWS_AUTO;
    return is_open ? shadow_technique_is_candidate(shadows) && !shadow_method_of(shadows)->fits &&
                         shadow_technique_can(shadows, target->needs)
                   : target->shadows == shadows;
}

/* Whole renderers last: of equals the first counts. */
size_t choice_estimate(const struct choice_frame *frame, const struct quality_target *target,
                       struct choice_row rows[CHOICE_ESTIMATES_MAX])
{
    size_t count = 0;
    for (int is_renderer = 0; is_renderer < 2; is_renderer++)
        for (int i = 0; i < SHADOWS_COUNT; i++) {
            enum shadow_technique shadows = (enum shadow_technique)i;
            if (!is_estimated(target, shadows) ||
                shadow_technique_is_renderer(shadows) != is_renderer)
                continue;
            assert(count + TECHNIQUE_ROWS_MAX <= CHOICE_ESTIMATES_MAX);
            count += estimate_technique(frame, target, shadows, rows + count);
        }
    return count;
}

size_t choice_add_traced(struct choice_row *rows, size_t count, size_t capacity)
{
    struct choice_row best = {.setting = {.samples = 0}};
    for (size_t i = 0; i < count; i++)
        if (shadow_technique_is_renderer(rows[i].setting.shadows) &&
            rows[i].setting.samples > best.setting.samples)
            best = rows[i];
    for (int i = 0; best.setting.samples && i < TRACED_SETTINGS && count < capacity; i++) {
        int samples = TRACED_SAMPLES[i];
        if (samples <= best.setting.samples)
            continue;
        rows[count++] = (struct choice_row){
            .setting = {.shadows = best.setting.shadows,
                        .samples = samples,
                        .atmosphere_samples = best.setting.atmosphere_samples},
            .ms = best.ms * samples / best.setting.samples,
            .error = best.error * traced_error(samples) / traced_error(best.setting.samples),
        };
    }
    return count;
}

enum shadow_technique choice_candidate_of(enum shadow_technique drawn)
{
    for (int i = 0; i < SHADOWS_COUNT; i++) {
        const struct shadow_method *method = shadow_method_of((enum shadow_technique)i);
        bool is_candidate = shadow_technique_is_candidate((enum shadow_technique)i) && method &&
                            (int)method->id == i;
        if (is_candidate && method->otherwise && method->otherwise->id == drawn)
            return method->id;
    }
    return drawn;
}

struct choice_row choice_scale(const struct choice_row *row, double pixels_there,
                               double pixels_here)
{
    struct choice_row scaled = *row;
    scaled.ms *= pixels_there > 0 ? fmax(pixels_here / pixels_there, 0) : 1;
    return scaled;
}
