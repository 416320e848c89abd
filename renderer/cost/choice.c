/* SPDX-License-Identifier: MIT */
/* Choosing a setting: one pass over the rows with an order, and the models for no rows. */
#include "renderer/cost/choice.h"

#include <math.h>

bool choice_row_fits(const struct choice_row *row, const struct choice_wish *wish)
{
    const struct choice_setting *setting = &row->setting;
    if (wish->shadows != SHADOWS_AUTO && wish->shadows != setting->shadows)
        return false;
    if (wish->samples && wish->samples != setting->samples)
        return false;
    if (wish->has_linked_lists && setting->shadows == SHADOWS_RAYTRACED_SHADOWS)
        return false;
    if (setting->shadow_resolution == 0)
        return true;
    bool has_lists = setting->shadows == SHADOWS_DEEP;
    if (has_lists &&
        ((wish->shadow_compression > 0 &&
          wish->shadow_compression != setting->shadow_compression) ||
         (wish->shadow_prefilter && wish->shadow_prefilter != setting->shadow_prefilter)))
        return false;
    return (!wish->shadow_resolution || wish->shadow_resolution == setting->shadow_resolution) &&
           (!wish->shadow_taps || wish->shadow_taps == setting->shadow_taps);
}

/* How well a row serves: a higher class wins; within a class the lower first number, then the lower
 * second. */
struct rank {
    int class_;
    double first, second;
};

static bool keeps_error(const struct choice_row *row, const struct choice_wish *wish)
{
    return wish->max_error <= 0 || row->error <= wish->max_error;
}

static bool keeps_budget(const struct choice_row *row, const struct choice_wish *wish)
{
    return wish->budget_ms <= 0 || row->ms <= wish->budget_ms;
}

static struct rank rank_row(const struct choice_row *row, const struct choice_wish *wish)
{
    bool is_true = keeps_error(row, wish), is_quick = keeps_budget(row, wish);
    if (wish->max_error > 0 && is_true && is_quick)
        return (struct rank){3, row->ms, row->error};
    if (is_quick && wish->budget_ms > 0) /* alone, or with an error that nothing keeps in time */
        return (struct rank){2, row->error, row->ms};
    if (wish->budget_ms <= 0) /* an error that nothing keeps: the nearest is the smallest */
        return (struct rank){1, row->error, row->ms};
    if (wish->max_error > 0 && is_true)
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
                           const struct choice_wish *wish, const struct choice_row *bare)
{
    if (wish->budget_ms <= 0 || wish->shadows == SHADOWS_NONE || !is_bare(bare) ||
        (wish->max_error > 0 && keeps_error(bare, wish)))
        return false;
    for (size_t i = 0; i < count; i++)
        if (!is_bare(&rows[i]) && choice_row_fits(&rows[i], wish) &&
            rows[i].ms <= LATE_MOST * wish->budget_ms && rows[i].error <= WORTH * bare->error &&
            isfinite(rows[i].error))
            return true;
    return false;
}

bool choice_make(const struct choice_row *rows, size_t count, const struct choice_wish *wish,
                 struct choice *choice)
{
    struct rank best = {.class_ = -1};
    *choice = (struct choice){0};
    for (size_t i = 0; i < count; i++) {
        if (!choice_row_fits(&rows[i], wish) || drops_too_much(rows, count, wish, &rows[i]))
            continue;
        struct rank rank = rank_row(&rows[i], wish);
        if (choice->row && !is_before(&rank, &best))
            continue;
        best = rank;
        choice->row = &rows[i];
    }
    if (!choice->row)
        return false;
    choice->keeps_error = keeps_error(choice->row, wish);
    choice->keeps_budget = keeps_budget(choice->row, wish);
    return true;
}

/* ---- models ---- */

/* RMSE where the image's side, the root of its pixels, is 480: docs/tradeoffs.md, "The models". */
static const double SIDE_PX = 480;
static const double RASTER_ERROR[2] = {0.036, 0.0215}; /* 1 and 4 samples per pixel */
enum { TRACED_RUNGS = 5 };
static const int TRACED_SAMPLES[TRACED_RUNGS] = {1, 4, 16, 64, 256};
static const double TRACED_ERROR[TRACED_RUNGS] = {0.036, 0.0155, 0.0075, 0.004, 0.0022};
static const double TEXEL_ERROR = 0.15; /* of a map with one texel and tap */

/* Costs were fitted to frames of 1 and 4 samples. With more, four of five scenes take at most this
 * many times what the sum says for a scene as in the mean: glass and edges are not counted. */
static const double TRACED_CAUTION = 4;

static double traced_error(int samples)
{
    int rung = 0;
    while (rung + 1 < TRACED_RUNGS && TRACED_SAMPLES[rung + 1] <= samples)
        rung++;
    return TRACED_ERROR[rung];
}

/* What the counts do not tell, as in the mean of the shared scenes. */
static struct workload guess_work(const struct choice_frame *frame)
{
    double lights = (double)frame->lights, triangles = (double)frame->triangles;
    return (struct workload){
        .pixels = frame->pixels,
        .covered = 0.3,
        .layers = 0.1,
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
 * 52 bytes for a pixel of one sample, 200 for one of four). */
static double raster_bytes(const struct choice_frame *frame, const struct workload *workload,
                           const struct forecast_setting *setting)
{
    double maps = forecast_maps_bytes(workload, setting);
    double most = frame->shadow_bytes > 0 ? frame->shadow_bytes : maps;
    return fmin(maps, most) + frame->pixels * (setting->samples > 1 ? 200 : 52);
}

static struct choice_row estimate(const struct choice_frame *frame,
                                  const struct choice_setting *setting)
{
    const struct device_speed *speed = speed_of(frame);
    bool is_traced = setting->shadows == SHADOWS_RAYTRACED;
    bool has_shadows = setting->shadows != SHADOWS_NONE;
    struct workload workload = guess_work(frame);
    struct forecast_setting cost = {
        .samples = setting->samples,
        .shadow_resolution = setting->shadow_resolution,
        .shadow_taps = setting->shadow_taps,
        .has_shadows = has_shadows,
    };
    cost.is_warm = frame->is_warm && can_stay(frame, &workload, &cost);
    double camera = is_traced ? traced_error(setting->samples) : RASTER_ERROR[setting->samples > 1];
    double shadow =
        setting->shadow_resolution && frame->lights
            ? TEXEL_ERROR * sqrt(sqrt((double)setting->shadow_taps) / setting->shadow_resolution)
            : 0;
    double side = sqrt(fmax(frame->pixels, 1));
    double ms = (is_traced ? forecast_traced_ms : forecast_raster_ms)(&workload, &cost, speed);
    return (struct choice_row){
        .setting = *setting,
        .ms = setting->samples > 4 ? TRACED_CAUTION * ms : ms,
        .error = !has_shadows ? INFINITY : hypot(camera, shadow) * sqrt(SIDE_PX / side),
        .bytes = is_traced ? 0 : raster_bytes(frame, &workload, &cost),
    };
}

/* The rasteriser's surfaces, and a ray to each light. */
static struct choice_row estimate_traced_shadows(const struct choice_frame *frame, int samples)
{
    struct workload workload = guess_work(frame);
    const struct forecast_setting cost = {
        .samples = samples, .has_shadows = true, .is_warm = frame->is_warm};
    const struct forecast_setting window = {.samples = samples};
    return (struct choice_row){
        .setting = {.shadows = SHADOWS_RAYTRACED_SHADOWS, .samples = samples},
        .ms = forecast_traced_shadows_ms(&workload, &cost, speed_of(frame)),
        .error = RASTER_ERROR[samples > 1] * sqrt(SIDE_PX / sqrt(fmax(frame->pixels, 1))),
        .bytes = raster_bytes(frame, &workload, &window),
    };
}

/* The rungs of one parameter: what was said alone, else the ladder's. */
static int rungs(int said, const int *ladder, int count, int out[])
{
    for (int i = 0; i < (said ? 1 : count); i++)
        out[i] = said ? said : ladder[i];
    return said ? 1 : count;
}

static size_t estimate_maps(const struct choice_frame *frame, const struct choice_wish *wish,
                            struct choice_row *rows)
{
    static const int all_resolutions[] = {256, 512, 1024, 2048, 4096}, all_taps[] = {1, 4, 9, 16};
    static const int all_samples[] = {1, 4};
    int resolutions[5], taps[4], samples[2];
    enum shadow_technique shadows = wish->shadows == SHADOWS_AUTO ? SHADOWS_DEEP : wish->shadows;
    int resolution_count = rungs(wish->shadow_resolution, all_resolutions, 5, resolutions);
    int taps_count = rungs(wish->shadow_taps, all_taps, 4, taps);
    int samples_count = rungs(wish->samples, all_samples, 2, samples);
    size_t count = 0;
    for (int s = 0; s < samples_count; s++)
        for (int r = 0; r < resolution_count; r++)
            for (int t = 0; t < taps_count; t++)
                rows[count++] =
                    estimate(frame, &(struct choice_setting){.shadows = shadows,
                                                             .shadow_resolution = resolutions[r],
                                                             .shadow_taps = taps[t],
                                                             .samples = samples[s]});
    return count;
}

static size_t estimate_bare(const struct choice_frame *frame, const struct choice_wish *wish,
                            struct choice_row *rows)
{
    static const int all_samples[] = {1, 4};
    int samples[2];
    int count = rungs(wish->samples, all_samples, 2, samples);
    for (int s = 0; s < count; s++)
        rows[s] = estimate(
            frame, &(struct choice_setting){.shadows = SHADOWS_NONE, .samples = samples[s]});
    return (size_t)count;
}

static size_t estimate_rays(const struct choice_frame *frame, const struct choice_wish *wish,
                            struct choice_row *rows)
{
    static const int all_samples[] = {1, 4};
    int samples[2];
    int count = rungs(wish->samples, all_samples, 2, samples);
    for (int s = 0; s < count; s++)
        rows[s] = estimate_traced_shadows(frame, samples[s]);
    return (size_t)count;
}

size_t choice_estimate(const struct choice_frame *frame, const struct choice_wish *wish,
                       struct choice_row rows[CHOICE_ESTIMATES_MAX])
{
    int samples[TRACED_RUNGS];
    size_t count = 0;
    if (wish->shadows == SHADOWS_NONE)
        return estimate_bare(frame, wish, rows);
    if (wish->shadows == SHADOWS_RAYTRACED_SHADOWS)
        return estimate_rays(frame, wish, rows);
    if (wish->shadows != SHADOWS_RAYTRACED)
        count = estimate_maps(frame, wish, rows);
    if (wish->shadows != SHADOWS_RAYTRACED && wish->shadows != SHADOWS_AUTO)
        return count;
    if (wish->shadows == SHADOWS_AUTO && !wish->has_linked_lists)
        count += estimate_rays(frame, wish, rows + count);
    int traced = rungs(wish->samples, TRACED_SAMPLES, TRACED_RUNGS, samples);
    for (int s = 0; s < traced; s++)
        rows[count++] = estimate(
            frame, &(struct choice_setting){.shadows = SHADOWS_RAYTRACED, .samples = samples[s]});
    return count;
}

size_t choice_add_traced(struct choice_row *rows, size_t count, size_t capacity)
{
    struct choice_row best = {.setting = {.samples = 0}};
    for (size_t i = 0; i < count; i++)
        if (rows[i].setting.shadows == SHADOWS_RAYTRACED &&
            rows[i].setting.samples > best.setting.samples)
            best = rows[i];
    for (int i = 0; best.setting.samples && i < TRACED_RUNGS && count < capacity; i++) {
        int samples = TRACED_SAMPLES[i];
        if (samples <= best.setting.samples)
            continue;
        rows[count++] = (struct choice_row){
            .setting = {.shadows = SHADOWS_RAYTRACED, .samples = samples},
            .ms = best.ms * samples / best.setting.samples,
            .error = best.error * traced_error(samples) / traced_error(best.setting.samples),
        };
    }
    return count;
}

struct choice_row choice_scale(const struct choice_row *row, double pixels_there,
                               double pixels_here)
{
    struct choice_row scaled = *row;
    scaled.ms *= pixels_there > 0 ? fmax(pixels_here / pixels_there, 0) : 1;
    return scaled;
}
