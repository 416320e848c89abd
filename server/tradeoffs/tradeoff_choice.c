/* SPDX-License-Identifier: MIT */
/* Choosing what a request leaves open: from rows measured for its view, for other views of its
 * scene, or from the models. */
#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/limits.h"
#include "protocol/utf8.h"
#include "renderer/cost/choice.h"
#include "server/base/processor.h"
#include "server/front/experience.h"
#include "server/mapping/auto_mapping.h"
#include "server/tradeoffs/tradeoffs_internal.h"

enum { ROWS_MAX = TRADEOFF_ROWS_MAX };
static_assert((int)ROWS_MAX >= (int)CHOICE_ESTIMATES_MAX, "estimates do not fit");

/* Where rows come from, the best first; and those of more samples than were measured there. */
enum source {
    SOURCE_VIEW,
    SOURCE_SCENE,
    SOURCE_MODEL,
    SOURCE_COUNT,
    SOURCE_VIEW_SCALED = SOURCE_COUNT,
    SOURCE_SCENE_SCALED,
    SOURCE_TEXT_COUNT,
};

struct candidates {
    struct choice_row rows[ROWS_MAX];
    double base_ms[ROWS_MAX]; /* of the rows before what was learned; 0: of none that was there */
    size_t count;
};

static void add_rows(struct candidates *candidates, const struct tradeoff *document, bool is_warm)
{
    for (int i = 0; i < document->row_count; i++) {
        const struct tradeoff_row *row = &document->rows[i];
        const struct tradeoff_times *times = is_warm ? &row->warm : &row->cold;
        if (times->count > 0)
            candidates->rows[candidates->count++] = (struct choice_row){
                .setting = {(enum shadow_technique)row->setting.shadows,
                            row->setting.shadow_resolution, row->setting.shadow_taps,
                            row->setting.samples, row->setting.shadow_compression,
                            row->setting.shadow_prefilter},
                .ms = tradeoff_times_max(times),
                .error = row->rmse,
            };
    }
}

static bool has_times(const struct tradeoff *document)
{
    for (int i = 0; i < document->row_count; i++)
        if (document->rows[i].warm.count > 0)
            return true;
    return false;
}

/* The newest measurement of the view (key not NULL), or of the scene with the nearest size. */
static void find_measured(struct tradeoffs *tradeoffs, const struct render_request *request,
                          const char *key, bool is_warm, struct candidates *candidates)
{
    char device[TRADEOFF_DEVICE_BYTES];
    const struct tradeoff *best = NULL;
    double pixels = (double)request->width * request->height, best_ratio = INFINITY;
    if (!tradeoffs_device_name(tradeoffs, device))
        return;
    pthread_mutex_lock(&tradeoffs->mutex);
    for (int i = tradeoffs->count; i-- > 0;) {
        const struct tradeoff *document = &tradeoffs->entries[i]->document;
        double ratio = fabs(log(pixels / ((double)document->width * document->height)));
        if (strcmp(document->scene, request->scene) != 0 || strcmp(document->device, device) != 0 ||
            !has_times(document) || (key && strcmp(document->view_key, key) != 0) ||
            ratio >= best_ratio)
            continue;
        best = document;
        best_ratio = ratio;
    }
    if (best)
        add_rows(candidates, best, is_warm);
    for (size_t i = 0; best && i < candidates->count; i++)
        candidates->rows[i] =
            choice_scale(&candidates->rows[i], (double)best->width * best->height, pixels);
    pthread_mutex_unlock(&tradeoffs->mutex);
}

static void estimate(struct tradeoffs *tradeoffs, const struct render_request *request,
                     const struct choice_wish *wish, bool is_warm, struct candidates *candidates)
{
    struct device_capabilities device;
    bool is_software = false;
    struct choice_frame frame = {.pixels = (double)request->width * request->height,
                                 .lights = request->light_count,
                                 .is_warm = is_warm};
    if (supervisor_get_device(tradeoffs->desc.supervisor, &device)) {
        struct auto_settings settings;
        device_auto_to_settings(&device.automatic, &settings);
        frame.speed = settings.speed;
        is_software = device.is_software;
        frame.shadow_bytes = (double)device.gpu_budget_bytes / 2; /* renderer/frame/renderer.c */
    }
    json_t *summary = scene_store_get_summary(tradeoffs->desc.scenes, request->scene, NULL);
    frame.triangles = (uint64_t)json_integer_value(json_object_get(summary, "triangles"));
    if (!request->ignore_scene_lights)
        frame.lights += (uint64_t)json_integer_value(json_object_get(summary, "light_count"));
    json_decref(summary);
    candidates->count = choice_estimate(&frame, wish, candidates->rows);
    /* forecasts are of a machine that nobody else uses */
    double crowding = processor_crowding();
    for (size_t i = 0; i < candidates->count; i++)
        if (is_software || candidates->rows[i].setting.shadows == SHADOWS_RAYTRACED)
            candidates->rows[i].ms *= crowding;
}

static struct experience_frame experience_of(const struct render_request *request,
                                             const struct choice_row *row, enum source source,
                                             bool is_warm, double base_ms)
{
    return (struct experience_frame){.scene = request->scene,
                                     .setting = row->setting,
                                     .is_warm = is_warm,
                                     .base_ms = base_ms,
                                     .is_measured = source == SOURCE_VIEW,
                                     .bytes = row->bytes};
}

/* From the times of rows to those that can be promised of the next frame. */
static void apply_experience(struct tradeoffs *tradeoffs, const struct render_request *request,
                             enum source source, bool is_warm, struct candidates *candidates)
{
    struct experience *experience = supervisor_experience(tradeoffs->desc.supervisor);
    for (size_t i = 0; i < ROWS_MAX; i++)
        candidates->base_ms[i] = i < candidates->count ? candidates->rows[i].ms : 0;
    for (size_t i = 0; i < candidates->count; i++) {
        const struct experience_frame frame =
            experience_of(request, &candidates->rows[i], source, is_warm, candidates->base_ms[i]);
        candidates->rows[i].ms = experience_expect(experience, &frame);
    }
}

static void find_rows(struct tradeoffs *tradeoffs, const struct render_request *request,
                      const struct choice_wish *wish, enum source source, const char *key,
                      bool is_warm, struct candidates *candidates)
{
    candidates->count = 0;
    if (source == SOURCE_MODEL)
        estimate(tradeoffs, request, wish, is_warm, candidates);
    else
        find_measured(tradeoffs, request, source == SOURCE_VIEW ? key : NULL, is_warm, candidates);
    apply_experience(tradeoffs, request, source, is_warm, candidates);
}

/* A measured row that keeps what was asked for; else, or for the most accurate within a time, also
 * ray tracing with more samples than were measured. */
static bool choose_row(struct candidates *candidates, const struct choice_wish *wish,
                       enum source *source, struct choice *choice)
{
    size_t measured = candidates->count;
    bool is_found = choice_make(candidates->rows, measured, wish, choice);
    bool is_kept = is_found && choice->keeps_error && choice->keeps_budget;
    if (*source == SOURCE_MODEL || (is_kept && wish->max_error > 0))
        return is_found;
    candidates->count = choice_add_traced(candidates->rows, measured, ROWS_MAX);
    is_found = choice_make(candidates->rows, candidates->count, wish, choice);
    if (is_found && choice->row >= candidates->rows + measured)
        *source = *source == SOURCE_VIEW ? SOURCE_VIEW_SCALED : SOURCE_SCENE_SCALED;
    return is_found;
}

/* ---- telling ---- */

static const char *const source_texts[SOURCE_TEXT_COUNT] = {
    [SOURCE_VIEW] = "measured for this view",
    [SOURCE_SCENE] = "measured for another view of this scene",
    [SOURCE_VIEW_SCALED] = "scaled from fewer samples measured for this view",
    [SOURCE_SCENE_SCALED] = "scaled from fewer samples measured for another view of this scene",
    [SOURCE_MODEL] = "forecast from counts: nothing is measured here",
};

static void explain(const struct choice_wish *wish, const struct choice *choice, enum source source,
                    bool is_warm, struct frame_promise *promise)
{
    char error[48] = "an unknown error";
    const struct choice_row *row = choice->row;
    if (isfinite(row->error))
        snprintf(error, sizeof error, "RMSE %.3g", row->error);
    const char *what = wish->max_error <= 0   ? "the most accurate within budget_ms"
                       : wish->budget_ms <= 0 ? "the fastest within max_error"
                                              : "the fastest within max_error and budget_ms";
    if (!choice->keeps_error || !choice->keeps_budget)
        what = "the nearest there is";
    snprintf(promise->chosen.because, sizeof promise->chosen.because, "%s: %s, %.4g ms %s, %s",
             what, error, row->ms, is_warm ? "warm" : "cold", source_texts[source]);
    if (!choice->keeps_error && !choice->keeps_budget)
        snprintf(
            promise->warning, sizeof promise->warning,
            "neither max_error %.6g nor budget_ms %.6g is kept: the nearest setting has %s and "
            "takes %.4g ms",
            wish->max_error, wish->budget_ms, error, row->ms);
    else if (!choice->keeps_error)
        snprintf(promise->warning, sizeof promise->warning,
                 "max_error %.6g is not kept: the nearest setting%s has %s", wish->max_error,
                 wish->budget_ms > 0 ? " within budget_ms" : "", error);
    else if (!choice->keeps_budget)
        snprintf(promise->warning, sizeof promise->warning,
                 "budget_ms %.6g is not kept: the fastest setting%s takes %.4g ms", wish->budget_ms,
                 wish->max_error > 0 ? " within max_error" : "", row->ms);
}

static void promise_from(const struct choice_wish *wish, const struct choice *choice,
                         enum source source, bool is_warm, struct frame_promise *promise)
{
    const struct choice_setting *setting = &choice->row->setting;
    utf8_copy(promise->chosen.shadows, sizeof promise->chosen.shadows,
              shadow_technique_name((int)setting->shadows));
    promise->chosen.shadow_resolution = setting->shadow_resolution;
    promise->chosen.shadow_taps = setting->shadow_taps;
    promise->chosen.shadow_compression = setting->shadow_compression;
    promise->chosen.shadow_prefilter = setting->shadow_prefilter;
    promise->chosen.samples = setting->samples;
    promise->chosen.expected_ms = choice->row->ms;
    promise->budget_ms = wish->budget_ms;
    promise->chosen.source = source == SOURCE_VIEW    ? FRAME_CHOICE_MEASURED
                             : source == SOURCE_MODEL ? FRAME_CHOICE_CALIBRATED
                                                      : FRAME_CHOICE_ESTIMATED;
    promise->has_error = isfinite(choice->row->error);
    promise->rmse = promise->has_error ? choice->row->error : 0;
    promise->source = source == SOURCE_VIEW ? FRAME_ERROR_MEASURED : FRAME_ERROR_ESTIMATED;
    explain(wish, choice, source, is_warm, promise);
}

/* ---- the whole ---- */

/* Where exact lists exceed the budget, the error that was asked for is allowed to them, too. */
static void apply_lists(struct request_quality *quality, const struct choice_setting *setting)
{
    bool has_lists = setting->shadows == SHADOWS_AUTO || setting->shadows == SHADOWS_DEEP;
    double error = quality->max_error > 0 ? quality->max_error : quality->shadow_fallback;
    if (setting->shadow_compression > 0 || !has_lists)
        quality->shadow_compression = setting->shadow_compression;
    if (setting->shadow_prefilter > 1 || !has_lists)
        quality->shadow_prefilter = setting->shadow_prefilter > 1 ? setting->shadow_prefilter : 1;
    if (!has_lists)
        quality->shadow_fallback = 0;
    else if (quality->shadow_fallback <= 0 && error >= LIMIT_COMPRESSION_LEAST)
        quality->shadow_fallback = fmin(error, LIMIT_COMPRESSION_MOST);
}

static void apply(struct request_quality *quality, const struct choice_setting *setting)
{
    apply_lists(quality, setting);
    quality->shadows = setting->shadows;
    if (setting->shadow_resolution) {
        quality->shadow_resolution = setting->shadow_resolution;
        quality->shadow_taps = setting->shadow_taps;
    }
    quality->samples = setting->samples;
    quality->max_error = quality->budget_ms = 0;
    quality->says_shadow_resolution = quality->says_shadow_taps = false;
}

/* ---- auto without a wish ---- */

enum {
    MAP_TEXELS = 1024,
    MAP_TAPS_MAX = 4
};                                    /* more is said of maps: renderer/cost/auto_technique.h */
static const double SAME_ERROR = 1.1; /* a tenth more is seen by nobody */

static const struct choice_row *find_row(const struct candidates *candidates,
                                         const struct request_quality *quality,
                                         enum shadow_technique shadows)
{
    int samples = quality->samples ? quality->samples : 4;
    for (size_t i = 0; i < candidates->count; i++) {
        const struct choice_setting *setting = &candidates->rows[i].setting;
        bool is_map = (setting->shadows == SHADOWS_DEEP || setting->shadows == SHADOWS_MAP) &&
                      setting->shadow_resolution == quality->shadow_resolution &&
                      setting->shadow_taps == quality->shadow_taps &&
                      setting->shadow_compression <= 0 && setting->shadow_prefilter <= 1;
        if (setting->samples == samples &&
            (shadows == SHADOWS_MAP ? is_map : setting->shadows == shadows))
            return &candidates->rows[i];
    }
    return NULL;
}

/* The row for other rows: where it is the faster and, to a tenth, as good as maps. */
static bool beats(const struct choice_row *row, const struct choice_row *best,
                  const struct choice_row *maps)
{
    return row && row->ms < best->ms && row->error <= SAME_ERROR * maps->error;
}

/* The fastest of maps, rays and maps' surfaces with rays for shadows, where the first two, at
 * least, were measured for exactly this view; else the worker forecasts. Maps of a ladder come as
 * deep where anything transparent casts, before plain ones. */
static bool choose_measured(struct tradeoffs *tradeoffs, struct render_request *request,
                            bool is_warm, struct frame_promise *promise, struct error *err)
{
    struct request_quality *quality = &request->quality;
    struct device_capabilities device;
    char key[65];
    if (quality->shadows != SHADOWS_AUTO || quality->reference || quality->faithful ||
        quality->light_lists == REQUEST_LIGHT_LISTS_LINKED || quality->shadow_compression > 0 ||
        quality->shadow_prefilter > 1 || quality->shadow_resolution != MAP_TEXELS ||
        quality->shadow_taps > MAP_TAPS_MAX ||
        !supervisor_get_device(tradeoffs->desc.supervisor, &device) ||
        !device.automatic.is_measured)
        return true;
    struct candidates *candidates = calloc(1, sizeof *candidates);
    if (!candidates)
        return error_set(err, ERROR_NO_MEMORY, "choice");
    bool is_good = tradeoff_view_key(request, key, err);
    if (is_good)
        find_measured(tradeoffs, request, key, is_warm, candidates);
    const struct choice_row *maps = find_row(candidates, quality, SHADOWS_MAP);
    const struct choice_row *rays = find_row(candidates, quality, SHADOWS_RAYTRACED);
    const struct choice_row *both = find_row(candidates, quality, SHADOWS_RAYTRACED_SHADOWS);
    if (maps && rays) {
        const struct choice_row *best = beats(rays, maps, maps) ? rays : maps;
        struct choice choice = {beats(both, best, maps) ? both : best, true, true};
        char ms_of_both[48] = "";
        if (both)
            snprintf(ms_of_both, sizeof ms_of_both, ", %.4g ms with traced shadows", both->ms);
        promise_from(&(struct choice_wish){0}, &choice, SOURCE_VIEW, is_warm, promise);
        snprintf(promise->chosen.because, sizeof promise->chosen.because,
                 "auto: %.4g ms ray traced, %.4g ms rasterised%s (%s, measured for this view)",
                 rays->ms, maps->ms, ms_of_both, is_warm ? "shadows kept" : "shadows built");
        quality->shadows = (enum shadow_technique)choice.row->setting.shadows;
    }
    free(candidates);
    return is_good;
}

bool tradeoffs_choose(struct tradeoffs *tradeoffs, struct render_request *request, bool is_warm,
                      struct frame_promise *promise, struct error *err)
{
    struct request_quality *quality = &request->quality;
    char key[65];
    *promise = (struct frame_promise){0};
    if (!request_quality_asks(quality))
        return choose_measured(tradeoffs, request, is_warm, promise, err);
    if (quality->reference) {
        utf8_copy(promise->warning, sizeof promise->warning,
                  "quality.reference leaves nothing to choose: max_error and budget_ms were not "
                  "used");
        quality->max_error = quality->budget_ms = 0;
        return true;
    }
    struct choice_wish wish = {
        .max_error = quality->max_error,
        .budget_ms = quality->budget_ms,
        .shadows = quality->shadows,
        .shadow_resolution = quality->says_shadow_resolution ? quality->shadow_resolution : 0,
        .shadow_taps = quality->says_shadow_taps ? quality->shadow_taps : 0,
        .samples = quality->samples,
        .shadow_compression = quality->shadow_compression,
        .shadow_prefilter = quality->shadow_prefilter > 1 ? quality->shadow_prefilter : 0,
        .has_linked_lists = quality->light_lists == REQUEST_LIGHT_LISTS_LINKED,
    };
    struct candidates *candidates = calloc(1, sizeof *candidates);
    bool is_good = candidates ? tradeoff_view_key(request, key, err)
                              : error_set(err, ERROR_NO_MEMORY, "choice");
    struct choice choice = {0};
    for (int source = SOURCE_VIEW; is_good && !choice.row && source < SOURCE_COUNT; source++) {
        find_rows(tradeoffs, request, &wish, (enum source)source, key, is_warm, candidates);
        enum source found = (enum source)source;
        if (choose_row(candidates, &wish, &found, &choice)) {
            promise_from(&wish, &choice, found, is_warm, promise);
            promise->base_ms = candidates->base_ms[choice.row - candidates->rows];
            promise->bytes = choice.row->bytes;
            promise->is_warm = is_warm;
            promise->is_measured = source == SOURCE_VIEW;
            apply(quality, &choice.row->setting);
        }
    }
    free(candidates);
    return is_good;
}
