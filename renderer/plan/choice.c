/* SPDX-License-Identifier: MIT */
/* Choosing a setting: one pass over the rows with an order, and the models for no rows. */
#include "renderer/plan/choice.h"

#include <math.h>

bool choice_row_fits(const struct choice_row *row, const struct choice_wish *wish)
{
    const struct choice_setting *setting = &row->setting;
    if (wish->shadows != VIEW_SHADOWS_AUTO && wish->shadows != setting->shadows)
        return false;
    if (wish->samples && wish->samples != setting->samples)
        return false;
    if (setting->shadow_resolution == 0)
        return true;
    bool has_lists = setting->shadows == VIEW_SHADOWS_DEEP;
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

bool choice_make(const struct choice_row *rows, size_t count, const struct choice_wish *wish,
                 struct choice *choice)
{
    struct rank best = {.class_ = -1};
    *choice = (struct choice){0};
    for (size_t i = 0; i < count; i++) {
        if (!choice_row_fits(&rows[i], wish))
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

/* Set by measurements of the demo scene; see choice.h. */
static const double CAMERA_CONTRAST = 0.06; /* RMSE of one sample per pixel */
static const double SHADOW_CONTRAST = 0.35; /* RMSE of a map with one texel */
static const double FRAME_MS = 6;           /* of an empty frame */
static const double NS_PER_SAMPLE = 300;    /* a pixel's sample without lights */
static const double NS_PER_LOOKUP = 60;     /* a pixel, a light, a tap */
static const double NS_PER_TEXEL = 150;     /* of a shadow map, built and sorted */
static const double NS_PER_TRIANGLE = 120;  /* drawn once for the view and once per light */
static const double NS_PER_RAY = 300;       /* per level of the triangles' tree */
static const double SHADE_LIGHTS_MAX = 8;   /* of all lights, those that reach one pixel */

static double camera_error(int samples)
{
    return CAMERA_CONTRAST / sqrt((double)samples);
}

static struct choice_row estimate_map(const struct choice_frame *frame,
                                      const struct choice_setting *setting)
{
    double texels = (double)setting->shadow_resolution * setting->shadow_resolution;
    double lights = (double)frame->lights, reaching = fmin(lights, SHADE_LIGHTS_MAX);
    double shadow =
        SHADOW_CONTRAST * sqrt(sqrt((double)setting->shadow_taps) / setting->shadow_resolution);
    double ns =
        frame->pixels *
            (NS_PER_SAMPLE * setting->samples + NS_PER_LOOKUP * reaching * setting->shadow_taps) +
        lights * NS_PER_TEXEL * texels + (1 + lights) * NS_PER_TRIANGLE * (double)frame->triangles;
    return (struct choice_row){
        .setting = *setting,
        .ms = FRAME_MS + 1e-6 * ns,
        .error = hypot(camera_error(setting->samples), frame->lights ? shadow : 0),
    };
}

static struct choice_row estimate_traced(const struct choice_frame *frame, int samples)
{
    double depth = log2(2 + (double)frame->triangles);
    double rays = frame->pixels * samples * (1 + (double)frame->lights);
    return (struct choice_row){
        .setting = {.shadows = VIEW_SHADOWS_RAYTRACED, .samples = samples},
        .ms = FRAME_MS + 1e-6 * (rays * NS_PER_RAY * depth / 10 +
                                 NS_PER_TRIANGLE * 10 * (double)frame->triangles),
        .error = camera_error(samples),
    };
}

/* The rasteriser's surfaces, and a ray to each light. */
static struct choice_row estimate_traced_shadows(const struct choice_frame *frame, int samples)
{
    double depth = log2(2 + (double)frame->triangles);
    double lights = fmin((double)frame->lights, SHADE_LIGHTS_MAX);
    double ns = frame->pixels * (NS_PER_SAMPLE * samples + lights * NS_PER_RAY * depth / 10) +
                NS_PER_TRIANGLE * 11 * (double)frame->triangles;
    return (struct choice_row){
        .setting = {.shadows = VIEW_SHADOWS_RAYTRACED_SHADOWS, .samples = samples},
        .ms = FRAME_MS + 1e-6 * ns,
        .error = camera_error(samples),
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
    int resolution_count = rungs(wish->shadow_resolution, all_resolutions, 5, resolutions);
    int taps_count = rungs(wish->shadow_taps, all_taps, 4, taps);
    int samples_count = rungs(wish->samples, all_samples, 2, samples);
    size_t count = 0;
    for (int s = 0; s < samples_count; s++)
        for (int r = 0; r < resolution_count; r++)
            for (int t = 0; t < taps_count; t++)
                rows[count++] = estimate_map(
                    frame, &(struct choice_setting){.shadows = wish->shadows,
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
        rows[s] = (struct choice_row){
            .setting = {.shadows = VIEW_SHADOWS_NONE, .samples = samples[s]},
            .ms = FRAME_MS + 1e-6 * (frame->pixels * NS_PER_SAMPLE * samples[s] +
                                     NS_PER_TRIANGLE * (double)frame->triangles),
            .error = INFINITY,
        };
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
    static const int all_samples[] = {1, 4, 16};
    int samples[3];
    size_t count = 0;
    if (wish->shadows == VIEW_SHADOWS_NONE)
        return estimate_bare(frame, wish, rows);
    if (wish->shadows == VIEW_SHADOWS_RAYTRACED_SHADOWS)
        return estimate_rays(frame, wish, rows);
    if (wish->shadows != VIEW_SHADOWS_RAYTRACED)
        count = estimate_maps(frame, wish, rows);
    if (wish->shadows != VIEW_SHADOWS_RAYTRACED && wish->shadows != VIEW_SHADOWS_AUTO)
        return count;
    int traced = rungs(wish->samples, all_samples, 3, samples);
    for (int s = 0; s < traced; s++)
        rows[count++] = estimate_traced(frame, samples[s]);
    return count;
}

struct choice_row choice_scale(const struct choice_row *row, double pixels_there,
                               double pixels_here)
{
    struct choice_row scaled = *row;
    scaled.ms *= pixels_there > 0 ? fmax(pixels_here / pixels_there, 0) : 1;
    return scaled;
}
