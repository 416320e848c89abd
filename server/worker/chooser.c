/* SPDX-License-Identifier: MIT */
/* Chooses what a request leaves open, and learns from its frame: for max_error and budget_ms; for
 * `shadows: auto` where the times of this very view were measured; and where they were not, by
 * forecasts of the evaluated scene (renderer/cost/auto_technique.h). */
#include "server/worker/chooser.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/limits.h"
#include "protocol/quality_defaults.h"
#include "protocol/utf8.h"
#include "renderer/base/processors.h"
#include "renderer/cost/workload.h"
#include "server/base/build_id.h"
#include "server/base/processor.h"
#include "server/mapping/choice_offer.h"
#include "server/mapping/view_mapping.h"

enum { KEY_BYTES = 1024, ERROR_TEXT_BYTES = 64 };

/* The sources of rows, the best first, each followed by its rows of more samples. */
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
    struct choice_row rows[CHOICE_ROWS_MAX];
    /* of the rows before what was learned; 0: of none that was there */
    double base_ms[CHOICE_ROWS_MAX];
    size_t count;
};

struct choosing {
    const struct chooser_desc *desc;
    struct choice_offer offer;
    struct candidates candidates;
    struct quality_target target;
};

/* ---- rows ---- */

static void estimate(struct choosing *choosing, const struct render_request *request)
{
    const struct chooser_desc *desc = choosing->desc;
    struct candidates *candidates = &choosing->candidates;
    struct choice_frame frame = {
        .width_px = request->width,
        .height_px = request->height,
        .lights = request->light_count,
        .triangles = choosing->offer.triangles,
        .peeled_sides = workload_peeled_sides(request->quality.transparency),
        .is_warm = desc->is_warm,
        .shadow_bytes = (double)desc->info->budget_bytes / 2, /* renderer/frame/renderer.c */
        .has_grids = choosing->offer.has_grids,
        .has_haze = request->atmosphere.density > 0,
        .speed = desc->automatic->speed,
    };
    if (!request->ignore_scene_lights)
        frame.lights += choosing->offer.scene_lights;
    candidates->count = choice_estimate(&frame, &choosing->target, candidates->rows);
    /* forecasts are of a machine that nobody else uses */
    double crowding = processor_crowding();
    for (size_t i = 0; i < candidates->count; i++)
        if (desc->info->is_software ||
            shadow_technique_is_renderer(candidates->rows[i].setting.shadows))
            candidates->rows[i].ms *= crowding;
}

static struct time_estimator_frame time_estimator_of(const struct render_request *request,
                                                     const struct choice_row *row,
                                                     enum source source, bool is_warm,
                                                     double base_ms)
{
    return (struct time_estimator_frame){.scene = request->scene,
                                         .setting = row->setting,
                                         .is_warm = is_warm,
                                         .base_ms = base_ms,
                                         .is_measured = source == SOURCE_VIEW,
                                         .is_hazy = request->atmosphere.density > 0,
                                         .bytes = row->bytes};
}

static void find_rows(struct choosing *choosing, const struct render_request *request,
                      enum source source)
{
    struct candidates *candidates = &choosing->candidates;
    const struct choice_rows *measured =
        source == SOURCE_VIEW ? &choosing->offer.view : &choosing->offer.scene;
    *candidates = (struct candidates){.count = measured->count};
    if (source == SOURCE_MODEL)
        estimate(choosing, request);
    else
        memcpy(candidates->rows, measured->rows, sizeof candidates->rows);
    for (size_t i = 0; i < candidates->count; i++) { /* what can be promised of the next frame */
        struct choice_row *row = &candidates->rows[i];
        const struct time_estimator_frame frame =
            time_estimator_of(request, row, source, choosing->desc->is_warm, row->ms);
        candidates->base_ms[i] = row->ms;
        row->ms = time_estimator_expect(choosing->desc->estimator, &frame);
    }
}

/* A measured row that keeps what was asked for; else, or for the most accurate within a time, also
 * ray tracing with more samples than were measured. */
static bool choose_row(struct candidates *candidates, const struct quality_target *target,
                       enum source *source, struct choice *choice)
{
    size_t measured = candidates->count;
    bool is_found = choice_make(candidates->rows, measured, target, choice);
    bool is_kept = is_found && choice->keeps_error && choice->keeps_budget;
    if (*source == SOURCE_MODEL || (is_kept && target->max_error > 0))
        return is_found;
    candidates->count = choice_add_traced(candidates->rows, measured, CHOICE_ROWS_MAX);
    is_found = choice_make(candidates->rows, candidates->count, target, choice);
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

/* Errors that were measured for another view leave out that of this one's haze. */
static void tell_error(const struct choice_row *row, enum source source, unsigned needs,
                       char error[ERROR_TEXT_BYTES])
{
    bool is_of_another = source == SOURCE_SCENE || source == SOURCE_SCENE_SCALED;
    bool leaves_out = needs & SHADOW_CAN_ATMOSPHERE && is_of_another;
    snprintf(error, ERROR_TEXT_BYTES, "an unknown error");
    if (isfinite(row->error))
        snprintf(error, ERROR_TEXT_BYTES, "RMSE %.3g%s", row->error,
                 leaves_out ? " without that of the haze" : "");
}

static void explain(const struct quality_target *target, const struct choice *choice,
                    enum source source, bool is_warm, struct frame_promise *promise)
{
    char error[ERROR_TEXT_BYTES];
    const struct choice_row *row = choice->row;
    tell_error(row, source, target->needs, error);
    const char *what = target->max_error <= 0   ? "the most accurate within budget_ms"
                       : target->budget_ms <= 0 ? "the fastest within max_error"
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
            target->max_error, target->budget_ms, error, row->ms);
    else if (!choice->keeps_error)
        snprintf(promise->warning, sizeof promise->warning,
                 "max_error %.6g is not kept: the nearest setting%s has %s", target->max_error,
                 target->budget_ms > 0 ? " within budget_ms" : "", error);
    else if (!choice->keeps_budget)
        snprintf(promise->warning, sizeof promise->warning,
                 "budget_ms %.6g is not kept: the fastest setting%s takes %.4g ms",
                 target->budget_ms, target->max_error > 0 ? " within max_error" : "", row->ms);
}

static void promise_from(const struct quality_target *target, const struct choice *choice,
                         enum source source, bool is_warm, struct frame_promise *promise)
{
    const struct quality_setting *setting = &choice->row->setting;
    utf8_copy(promise->chosen.shadows, sizeof promise->chosen.shadows,
              shadow_technique_name((int)setting->shadows));
    promise->chosen.shadow_resolution = setting->shadow_resolution;
    promise->chosen.shadow_taps = setting->shadow_taps;
    promise->chosen.shadow_compression = setting->shadow_compression;
    promise->chosen.shadow_prefilter = setting->shadow_prefilter;
    promise->chosen.samples = setting->samples;
    promise->chosen.atmosphere_samples = setting->atmosphere_samples;
    const char *method = tradeoff_method(setting);
    utf8_copy(promise->chosen.transparency, sizeof promise->chosen.transparency,
              method ? method : "");
    promise->chosen.expected_ms = choice->row->ms;
    promise->budget_ms = target->budget_ms;
    promise->chosen.source = source == SOURCE_VIEW    ? FRAME_CHOICE_MEASURED
                             : source == SOURCE_MODEL ? FRAME_CHOICE_CALIBRATED
                                                      : FRAME_CHOICE_ESTIMATED;
    promise->has_error = isfinite(choice->row->error);
    promise->rmse = promise->has_error ? choice->row->error : 0;
    promise->source = source == SOURCE_VIEW ? FRAME_ERROR_MEASURED : FRAME_ERROR_ESTIMATED;
    explain(target, choice, source, is_warm, promise);
}

/* ---- auto without a target ---- */

static const double SAME_ERROR = 1.1; /* a tenth more is seen by nobody */

static bool has_default_lists(const struct quality_setting *setting)
{
    return setting->shadow_compression <= 0 && setting->shadow_prefilter <= 1;
}

/* Rows of one technique may differ in it: they were measured in haze or smoke. */
static bool varies_media(const struct choice_rows *measured)
{
    for (size_t i = 0; i < measured->count; i++)
        if (measured->rows[i].setting.atmosphere_samples)
            return true;
    return false;
}

/* A sweep has plain maps where nothing transparent casts, and deep ones before plain ones
 * elsewhere: the first row is what frames of the candidate are. */
static const struct choice_row *find_row(const struct choice_rows *measured,
                                         const struct request_quality *quality,
                                         enum shadow_technique candidate)
{
    int samples = quality_or(quality->samples, SAMPLES_DEFAULT);
    bool has_media = varies_media(measured);
    for (size_t i = 0; i < measured->count; i++) {
        const struct quality_setting *setting = &measured->rows[i].setting;
        bool has_maps = shadow_technique_has(setting->shadows, SHADOW_HAS_MAP);
        if (setting->samples == samples && choice_candidate_of(setting->shadows) == candidate &&
            (!has_maps || (setting->shadow_resolution == quality->shadow_resolution &&
                           setting->shadow_taps == quality->shadow_taps)) &&
            has_default_lists(setting) && setting->transparency == TRANSPARENCY_AUTO &&
            (!has_media || setting->atmosphere_samples == quality->atmosphere_samples))
            return &measured->rows[i];
    }
    return NULL;
}

/* The row for other rows: where it is the faster and, to a tenth, as good as maps. */
static bool beats(const struct choice_row *row, const struct choice_row *best,
                  const struct choice_row *maps)
{
    return row && row->ms < best->ms && row->error <= SAME_ERROR * maps->error;
}

/* Whether the technique is ours to choose by times: renderer/cost/auto_technique.h. */
static bool is_open(const struct chooser_desc *desc, const struct request_quality *quality)
{
    struct view_quality asked;
    view_quality_from_request(quality, &asked);
    return desc->automatic->policy == AUTO_MEASURED &&
           device_speed_is_known(&desc->automatic->speed) && auto_quality_is_open(&asked);
}

/* The fastest candidate, where the whole renderers and the rasteriser's default, at least, were
 * measured for exactly this view; else forecasts decide. */
static void choose_measured(const struct choosing *choosing, struct request_quality *quality,
                            struct frame_promise *promise)
{
    const struct choice_rows *measured = &choosing->offer.view;
    const struct choice_row *maps = find_row(measured, quality, SHADOWS_RASTER_DEFAULT);
    struct choice choice = {maps, true, true};
    double ms[SHADOWS_COUNT];
    char times[AUTO_TIMES_BYTES];
    bool is_warm = choosing->desc->is_warm;
    if (!maps || !is_open(choosing->desc, quality))
        return;
    for (int i = 0; i < SHADOWS_COUNT; i++) {
        enum shadow_technique shadows = (enum shadow_technique)i;
        const struct choice_row *row =
            shadow_technique_is_candidate(shadows) ? find_row(measured, quality, shadows) : NULL;
        ms[i] = row ? row->ms : -1;
        if (!row && shadow_technique_is_candidate(shadows) && shadow_technique_is_renderer(shadows))
            return;
        if (beats(row, choice.row, maps))
            choice.row = row;
    }
    promise_from(&(struct quality_target){0}, &choice, SOURCE_VIEW, is_warm, promise);
    auto_times_text(ms, times);
    snprintf(promise->chosen.because, sizeof promise->chosen.because,
             "auto: %s (%s, measured for this view)", times,
             is_warm ? "shadows kept" : "shadows built");
    quality->shadows = choice.row->setting.shadows;
}

/* ---- a target ---- */

static struct quality_target target_of(const struct render_request *request)
{
    const struct request_quality *quality = &request->quality;
    return (struct quality_target){
        .max_error = quality->max_error,
        .budget_ms = quality->budget_ms,
        .shadows = quality->shadows,
        .shadow_resolution = quality->says_shadow_resolution ? quality->shadow_resolution : 0,
        .shadow_taps = quality->says_shadow_taps ? quality->shadow_taps : 0,
        .samples = quality->samples,
        .shadow_compression = quality->shadow_compression,
        .shadow_prefilter = quality->shadow_prefilter > 1 ? quality->shadow_prefilter : 0,
        .transparency = quality->transparency,
        .needs = render_request_needs(request),
    };
}

static void choose_for_target(struct choosing *choosing, struct render_request *request,
                              struct frame_promise *promise)
{
    const struct candidates *candidates = &choosing->candidates;
    bool is_warm = choosing->desc->is_warm;
    struct choice choice = {0};
    choosing->target = target_of(request);
    choosing->target.needs |= choosing->offer.has_grids ? SHADOW_CAN_GRIDS : 0u;
    if (choosing->target.needs & (SHADOW_CAN_ATMOSPHERE | SHADOW_CAN_GRIDS))
        choosing->target.atmosphere_samples = request->quality.atmosphere_samples;
    for (int source = SOURCE_VIEW; !choice.row && source < SOURCE_COUNT; source++) {
        find_rows(choosing, request, (enum source)source);
        enum source found = (enum source)source;
        if (!choose_row(&choosing->candidates, &choosing->target, &found, &choice))
            continue;
        promise_from(&choosing->target, &choice, found, is_warm, promise);
        promise->base_ms = candidates->base_ms[choice.row - candidates->rows];
        promise->bytes = choice.row->bytes;
        promise->is_warm = is_warm;
        promise->is_measured = source == SOURCE_VIEW;
        promise->is_hazy = request->atmosphere.density > 0;
        request_quality_set(&request->quality, &choice.row->setting);
    }
}

bool chooser_choose(const struct chooser_desc *desc, struct render_request *request,
                    struct frame_promise *promise, struct error *err)
{
    struct request_quality *quality = &request->quality;
    bool asks = request_quality_asks(quality);
    *promise = (struct frame_promise){0};
    if (asks && quality->reference) {
        utf8_copy(promise->warning, sizeof promise->warning,
                  "quality.reference leaves nothing to choose: max_error and budget_ms were not "
                  "used");
        quality->max_error = quality->budget_ms = 0;
        return true;
    }
    if (!desc->offer)
        return true;
    struct choosing *choosing = calloc(1, sizeof *choosing);
    if (!choosing)
        return error_set(err, ERROR_NO_MEMORY, "choice");
    choosing->desc = desc;
    bool is_good = choice_offer_from_json(desc->offer, &choosing->offer, err);
    if (is_good && asks)
        choose_for_target(choosing, request, promise);
    else if (is_good)
        choose_measured(choosing, quality, promise);
    free(choosing);
    return is_good;
}

bool chooser_choose_technique(struct renderer *renderer, const char *scene, struct view *view,
                              struct auto_choice *choice, struct error *err)
{
    if (view->quality.shadows != SHADOWS_AUTO)
        return true;
    if (!renderer_choose(renderer, scene, view, choice, err))
        return false;
    view->choice = choice;
    return true;
}

bool chooser_digest(const struct render_request *request, const struct frame_promise *promise,
                    char digest[DIGEST_TEXT_BYTES], struct error *err)
{
    char *canonical = render_request_to_json(request), *text = canonical;
    bool tells_error = promise->has_error && !request->omits_provenance;
    if (canonical && tells_error &&
        asprintf(&text, "%s %.17g %d", canonical, promise->rmse, (int)promise->source) < 0)
        text = NULL;
    bool is_good = text ? digest_of(text, strlen(text), digest, err)
                        : error_set(err, ERROR_NO_MEMORY, "request");
    if (text != canonical)
        free(text);
    free(canonical);
    return is_good;
}

/* ---- learning ---- */

struct time_estimator *chooser_open_estimator(const struct renderer_info *info, const char *path,
                                              struct error *err)
{
    char key[KEY_BYTES], build[BUILD_ID_BYTES];
    struct time_estimator *estimator = time_estimator_create(err);
    build_id_get(build);
    snprintf(key, sizeof key, "%s, %s, %d processors, %s", info->renderer, info->version,
             processors_usable(), build);
    if (estimator && path)
        time_estimator_keep(estimator, path, key);
    return estimator;
}

/* Only what lies over its picture was drawn: what was expected and taken is of something else. */
static bool is_over_kept(const struct frame_stats *stats)
{
    for (int i = 0; i < stats->reused_count; i++)
        if (strcmp(stats->reused[i], "picture") == 0)
            return true;
    return false;
}

void chooser_judge(struct time_estimator *estimator, const struct frame_promise *promise,
                   struct frame_stats *stats)
{
    const struct frame_stats_chosen *chosen = &stats->chosen;
    frame_stats_promise(stats, promise);
    if (is_over_kept(stats)) {
        stats->chosen.expected_ms = 0;
        return;
    }
    frame_stats_judge(stats, promise->budget_ms);
    enum shadow_technique shadows = shadow_technique_find(chosen->shadows);
    if (shadows == SHADOWS_COUNT)
        return;
    const struct time_estimator_frame frame = {
        .scene = stats->scene,
        .setting = {.shadows = shadows,
                    .shadow_resolution = chosen->shadow_resolution,
                    .shadow_taps = chosen->shadow_taps,
                    .samples = chosen->samples,
                    .shadow_compression = chosen->shadow_compression,
                    .shadow_prefilter = chosen->shadow_prefilter,
                    .atmosphere_samples = chosen->atmosphere_samples,
                    .transparency = transparency_find(chosen->transparency)},
        .is_warm = promise->is_warm,
        .base_ms = promise->base_ms,
        .is_measured = promise->is_measured,
        .is_hazy = promise->is_hazy,
        .bytes = promise->bytes,
    };
    time_estimator_note(estimator, &frame, chosen->took_ms,
                        stats->counts.programs_built || stats->counts.programs_loaded);
}
