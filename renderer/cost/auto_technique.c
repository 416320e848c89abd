/* SPDX-License-Identifier: MIT */
/* Maps or rays, by forecast. Candidates are those of the rows (protocol/shadow_technique.h). */
#include "renderer/cost/auto_technique.h"

#include <math.h>
#include <stdio.h>

#include "protocol/quality_defaults.h"
#include "renderer/cost/technique_forecast.h"
#include "renderer/cost/workload.h"
#include "renderer/scene/grid_texels.h"
#include "renderer/shadows/shadow_compress.h"
#include "renderer/shadows/technique.h"

static bool is_candidate(int technique)
{
    return shadow_technique_is_candidate((enum shadow_technique)technique);
}

/* In the place of the time of a technique that cannot draw the view. */
static const double LEFT_OUT_MS = -1;

static bool is_compared(int technique, double ms)
{
    return is_candidate(technique) && ms >= 0;
}

bool auto_quality_is_open(const struct view_quality *quality)
{
    bool speaks_of_maps =
        (quality->shadow_resolution && quality->shadow_resolution != SHADOW_RESOLUTION_DEFAULT) ||
        quality->shadow_taps > SHADOW_TAPS_DEFAULT || quality->faithful ||
        shadow_compress_is_asked(quality) || quality->light_lists == VIEW_LIGHT_LISTS_LINKED;
    return quality->shadows == SHADOWS_AUTO && !quality->reference && !speaks_of_maps;
}

static bool is_open(const struct auto_desc *desc)
{
    return desc->view->outputs & 1u << VIEW_OUTPUT_COLOR &&
           auto_quality_is_open(&desc->view->quality);
}

static const struct shadow_structure *structure_of(enum shadow_technique technique)
{
    return shadow_method_of(technique)->structure;
}

/* What soft shadows cost rays beside rasterised surfaces has not been measured, so that those of
 * whole pictures stand for both. */
static bool is_for_areas(enum shadow_technique technique)
{
    return shadow_technique_is_renderer(technique) || structure_of(technique)->least_gain > 0;
}

/* By its rows, and where all of its casters are such that it can follow them. */
static bool can_draw(const struct auto_desc *desc, enum shadow_technique technique,
                     const struct workload *workload)
{
    const struct shadow_method *method = shadow_method_of(technique);
    const struct view_quality *quality = &desc->view->quality;
    bool has_areas = scene_state_area_lights(desc->state);
    unsigned can = (view_has_atmosphere(desc->view) ? SHADOW_CAN_ATMOSPHERE : 0u) |
                   (desc->state->grid_count ? SHADOW_CAN_GRIDS : 0u) |
                   (has_areas ? SHADOW_CAN_AREA_LIGHTS : 0u);
    double sure = method->structure->sure_triangles;
    return shadow_technique_can(technique, can) && (!has_areas || is_for_areas(technique)) &&
           (sure <= 0 || workload->triangles <= sure) &&
           !shadow_method_count_unfit(method, desc->state, quality) &&
           !(method->fall_back && method->fall_back(desc->state, quality));
}

/* Leaves out techniques whose forecasts gain too little for how far they may be off, and of two
 * that have the same the first. */
static void leave_out_uncertain(struct learning_case frames[SHADOWS_COUNT])
{
    double least = INFINITY;
    for (int i = 0; i < SHADOWS_COUNT; i++)
        if (is_candidate(i) && !frames[i].is_left_out &&
            structure_of((enum shadow_technique)i)->least_gain <= 0)
            least = fmin(least, forecast_sum_ms(frames[i].terms));
    const struct shadow_structure *last = NULL;
    for (int i = SHADOWS_COUNT - 1; i >= 0; i--) {
        const struct shadow_structure *structure =
            is_candidate(i) ? structure_of((enum shadow_technique)i) : NULL;
        if (!structure || structure->least_gain <= 0 || frames[i].is_left_out)
            continue;
        frames[i].is_left_out = forecast_sum_ms(frames[i].terms) > structure->least_gain * least ||
                                (last && last->forecast == structure->forecast);
        last = structure;
    }
}

/* Maps that do not all fit the budget are made in batches, anew for every frame. */
static bool maps_can_stay(const struct auto_desc *desc, const struct workload *workload,
                          const struct forecast_setting *setting)
{
    return desc->shadow_budget_bytes == 0 ||
           forecast_maps_bytes(workload, setting) <= (double)desc->shadow_budget_bytes;
}

struct learning_case auto_case(const struct learning_case *cold, double built_share)
{
    struct learning_case frame = *cold;
    frame.terms[FORECAST_TERM_MAPS] *= built_share;
    frame.terms[FORECAST_TERM_DEEP] *= built_share;
    frame.terms[FORECAST_TERM_BUILD] *= built_share;
    frame.view += frame.view && built_share > 0; /* building has observations of its own */
    return frame;
}

/* What the technique of the last picture takes may be this much longer than what another takes, and
 * than what another is only forecast to take: known times are off by some percent, forecasts by up
 * to 1.6. */
static const double STAYS_KNOWN = 0.95, STAYS_FORECAST = 0.75;

/* Observations before another technique is timed, and those after which it is known; what that may
 * take, and shall gain, of what the chosen one takes; and by how many of its standard deviations
 * its forecast may be too long. */
enum { TIMING_OBSERVATIONS = 2, TIMING_ENOUGH = 3 };
static const double TIMING_MOST = 2, TIMING_GAIN = 0.9, TIMING_DOUBT = 1.75;

/* What was drawn before needs no margin against what is not known of forecasts. */
static void take_known(struct auto_pick *pick)
{
    const struct learning_answer *chosen = &pick->answers[pick->technique];
    for (int i = 0; i < SHADOWS_COUNT && chosen->observations; i++) {
        const struct learning_answer *other = &pick->answers[i];
        if (is_compared(i, other->ms) && other->observations && other->ms < chosen->ms) {
            pick->technique = (enum shadow_technique)i;
            chosen = other;
        }
    }
}

/* False where the view has not been drawn. */
static bool stay(struct auto_pick *pick)
{
    int shown = 0;
    while (shown < SHADOWS_COUNT && !pick->answers[shown].is_shown)
        shown++;
    if (shown == SHADOWS_COUNT)
        return false;
    pick->technique = (enum shadow_technique)shown;
    for (int i = 0; i < SHADOWS_COUNT; i++) {
        const struct learning_answer *other = &pick->answers[i];
        double most = other->observations ? STAYS_KNOWN : STAYS_FORECAST;
        if (is_compared(i, other->ms) && i != shown && other->ms < most * pick->answers[shown].ms &&
            other->ms < pick->answers[pick->technique].ms)
            pick->technique = (enum shadow_technique)i;
    }
    return true;
}

static void find_runner_up(struct auto_pick *pick)
{
    const struct learning_answer *chosen = &pick->answers[pick->technique];
    double best = TIMING_GAIN * chosen->ms;
    if (chosen->observations < TIMING_OBSERVATIONS)
        return;
    for (int i = 0; i < SHADOWS_COUNT; i++) {
        const struct learning_answer *other = &pick->answers[i];
        double least = other->ms * exp(-TIMING_DOUBT * other->doubt);
        if (!is_compared(i, other->ms) || other == chosen || other->observations >= TIMING_ENOUGH ||
            !(least < best) || other->ms > TIMING_MOST * chosen->ms)
            continue;
        best = least;
        pick->runner_up = (enum shadow_technique)i;
        pick->has_runner_up = true;
    }
}

/* Forecasts are within a factor of 1.5 of each other's error, so a gain below a tenth is none. */
static const double GAIN_LEAST = 0.9;

enum shadow_technique auto_fastest(const double ms[SHADOWS_COUNT])
{
    int fastest = SHADOWS_COUNT;
    for (int i = 0; i < SHADOWS_COUNT; i++)
        if (is_compared(i, ms[i]) && i != SHADOWS_RASTER_DEFAULT &&
            (fastest == SHADOWS_COUNT || ms[i] < ms[fastest]))
            fastest = i;
    bool gains = fastest < SHADOWS_COUNT &&
                 (!is_compared(SHADOWS_RASTER_DEFAULT, ms[SHADOWS_RASTER_DEFAULT]) ||
                  ms[fastest] < GAIN_LEAST * ms[SHADOWS_RASTER_DEFAULT]);
    return gains ? (enum shadow_technique)fastest : SHADOWS_RASTER_DEFAULT;
}

struct auto_pick auto_pick(const struct learning_case frames[SHADOWS_COUNT],
                           const struct learning *learned)
{
    struct auto_pick pick = {.has_runner_up = false};
    double ms[SHADOWS_COUNT];
    for (int i = 0; i < SHADOWS_COUNT; i++) {
        if (frames[i].is_left_out)
            pick.answers[i].ms = LEFT_OUT_MS;
        else if (learned && is_candidate(i))
            pick.answers[i] = learning_expect(learned, &frames[i]);
        else if (is_candidate(i))
            pick.answers[i].ms = forecast_sum_ms(frames[i].terms);
        ms[i] = pick.answers[i].ms;
    }
    if (!stay(&pick)) {
        pick.technique = auto_fastest(ms);
        take_known(&pick);
    }
    find_runner_up(&pick);
    return pick;
}

/* Whole renderers first, then what they are compared with. */
void auto_times_text(const double ms[SHADOWS_COUNT], char text[AUTO_TIMES_BYTES])
{
    size_t used = 0;
    text[0] = 0;
    for (int rasterises = 0; rasterises < 2; rasterises++)
        for (int i = 0; i < SHADOWS_COUNT && used < AUTO_TIMES_BYTES; i++)
            if (is_compared(i, ms[i]) &&
                shadow_technique_is_renderer((enum shadow_technique)i) != rasterises)
                used +=
                    (size_t)snprintf(text + used, AUTO_TIMES_BYTES - used, "%s%.4g ms %s",
                                     used ? ", " : "", ms[i], shadow_technique_rows[i].candidate);
}

static void explain(struct auto_choice *choice, const struct auto_pick *pick, const char *kept)
{
    uint32_t observations = pick->answers[pick->technique].observations;
    char source[64] = "calibrated", times[AUTO_TIMES_BYTES];
    if (observations)
        snprintf(source, sizeof source, "calibrated, %u frame%s like it", observations,
                 observations == 1 ? "" : "s");
    auto_times_text(choice->ms, times);
    snprintf(choice->because, sizeof choice->because, "auto: forecast %s (%s, %s)", times, kept,
             source);
}

static void take(struct auto_choice *choice, const struct auto_settings *settings, const char *kept)
{
    struct auto_pick pick = auto_pick(choice->frames, settings->learned);
    choice->is_timed = settings->timed != SHADOWS_AUTO;
    if (choice->is_timed)
        pick.technique = settings->timed;
    for (int i = 0; i < SHADOWS_COUNT; i++)
        choice->ms[i] = pick.answers[i].ms;
    choice->technique = pick.technique;
    explain(choice, &pick, kept);
}

static bool forecast(struct auto_choice *choice, const struct auto_desc *desc, struct error *err)
{
    struct workload workload;
    const struct view_quality *quality = &desc->view->quality;
    struct forecast_setting setting = {
        .shadow_taps = quality_or(quality->shadow_taps, SHADOW_TAPS_DEFAULT),
        .has_shadows = true,
    };
    if (!workload_measure(&workload,
                          &(struct workload_desc){.view = desc->view,
                                                  .state = desc->state,
                                                  .camera = desc->camera,
                                                  .depths_bytes = desc->depths_bytes,
                                                  .reach = desc->reach,
                                                  .kept = desc->kept,
                                                  .state_key = desc->state_key},
                          err))
        return false;
    bool is_warm = quality->expects_reuse, all_stay = true;
    for (int i = 0; i < SHADOWS_COUNT; i++) {
        enum shadow_technique technique = (enum shadow_technique)i;
        bool has_maps = shadow_technique_has(technique, SHADOW_HAS_RESOLUTION);
        if (!is_candidate(i))
            continue;
        setting.samples = shadow_technique_is_renderer(technique)
                              ? quality_or(quality->samples, SAMPLES_DEFAULT)
                              : desc->raster_samples;
        setting.shadow_resolution = has_maps ? SHADOW_RESOLUTION_DEFAULT : 0;
        choice->cold[i] = (struct learning_case){
            .technique = technique,
            .view = desc->view_key & ~UINT64_C(1),
            .is_left_out = !can_draw(desc, technique, &workload),
        };
        technique_forecast_terms(
            technique, &(struct forecast_frame){&workload, &setting, &desc->settings->speed},
            choice->cold[i].terms);
        bool can_stay = maps_can_stay(desc, &workload, &setting);
        choice->frames[i] = auto_case(&choice->cold[i], is_warm && can_stay ? 0 : 1);
        all_stay = all_stay && can_stay;
    }
    leave_out_uncertain(choice->frames);
    for (int i = 0; i < SHADOWS_COUNT; i++)
        choice->cold[i].is_left_out = choice->frames[i].is_left_out;
    take(choice, desc->settings,
         !is_warm   ? "shadows built"
         : all_stay ? "shadows kept"
                    : "too many maps to keep");
    return true;
}

/* Whatever else the request says of maps: density grids that rasterised pictures cannot have. */
static bool needs_rays(const struct auto_desc *desc)
{
    const struct scene_state *state = desc->state;
    return state->grid_count > 0 && desc->view->quality.shadows == SHADOWS_AUTO &&
           desc->view->outputs & 1u << VIEW_OUTPUT_COLOR &&
           (desc->view->quality.light_lists == VIEW_LIGHT_LISTS_LINKED ||
            grid_texels_excess(state));
}

bool auto_choose(struct auto_choice *choice, const struct auto_desc *desc, struct error *err)
{
    *choice = (struct auto_choice){0};
    if (needs_rays(desc)) {
        choice->is_open = true;
        choice->technique = SHADOWS_RAYTRACED;
        snprintf(choice->because, sizeof choice->because,
                 "auto: the scene has density grids that rays alone draw");
        return true;
    }
    if (!desc->settings || desc->settings->policy == AUTO_RASTER || !is_open(desc))
        return true;
    bool has_areas = scene_state_area_lights(desc->state);
    if (desc->settings->policy == AUTO_RAYTRACED && !has_areas) {
        choice->is_open = true;
        choice->technique = SHADOWS_RAYTRACED;
        snprintf(choice->because, sizeof choice->because, "auto: the server is set to ray tracing");
        return true;
    }
    if (desc->settings->policy == AUTO_RAYTRACED || !device_speed_is_known(&desc->settings->speed))
        return true;
    choice->is_open = true;
    if (!forecast(choice, desc, err))
        return false;
    /* whole pictures by rays need no choice where a light has an area */
    if (has_areas && shadow_technique_is_renderer(choice->technique))
        *choice = (struct auto_choice){0};
    return true;
}
