/* SPDX-License-Identifier: MIT */
/* Maps or rays, by forecast. */
#include "renderer/cost/auto_technique.h"

#include <math.h>
#include <stdio.h>

#include "renderer/shadows/shadow_compress.h"

enum { RESOLUTION_DEFAULT = 1024, TAPS_DEFAULT = 4, TRACED_SAMPLES_DEFAULT = 4 };

static bool has_areas(const struct scene_state *state)
{
    for (size_t i = 0; i < state->light_count; i++)
        if (state_light_is_area(&state->lights[i]))
            return true;
    return false;
}

static bool is_open(const struct auto_desc *desc)
{
    const struct view_quality *quality = &desc->view->quality;
    bool speaks_of_maps =
        (quality->shadow_resolution && quality->shadow_resolution != RESOLUTION_DEFAULT) ||
        quality->shadow_taps > TAPS_DEFAULT || quality->faithful ||
        shadow_compress_is_asked(quality) || quality->light_lists == VIEW_LIGHT_LISTS_LINKED;
    return desc->view->outputs & 1u << VIEW_OUTPUT_COLOR && !quality->reference &&
           quality->shadows == SHADOWS_AUTO && !speaks_of_maps && !has_areas(desc->state);
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
    frame.view += frame.view && built_share > 0; /* building has lessons of its own */
    return frame;
}

/* What the technique of the last picture takes may be this much longer than what another takes, and
 * than what another is only forecast to take: known times are off by some percent, forecasts by up
 * to 1.6. */
static const double STAYS_KNOWN = 0.95, STAYS_FORECAST = 0.75;

/* Lessons before another technique is timed, and those after which it is known; what that may take,
 * and shall gain, of what the chosen one takes; and by how many of its standard deviations its
 * forecast may be too long. */
enum { TIMING_LESSONS = 2, TIMING_ENOUGH = 3 };
static const double TIMING_MOST = 2, TIMING_GAIN = 0.9, TIMING_DOUBT = 1.75;

/* What was drawn before needs no margin against what is not known of forecasts. */
static void take_known(struct auto_pick *pick)
{
    const struct learning_answer *chosen = &pick->answers[pick->technique];
    for (int i = 0; i < FORECAST_TECHNIQUES && chosen->lessons; i++) {
        const struct learning_answer *other = &pick->answers[i];
        if (other->lessons && other->ms < chosen->ms) {
            pick->technique = (enum forecast_technique)i;
            chosen = other;
        }
    }
}

/* False where the view has not been drawn. */
static bool stay(struct auto_pick *pick)
{
    int shown = 0;
    while (shown < FORECAST_TECHNIQUES && !pick->answers[shown].is_shown)
        shown++;
    if (shown == FORECAST_TECHNIQUES)
        return false;
    pick->technique = (enum forecast_technique)shown;
    for (int i = 0; i < FORECAST_TECHNIQUES; i++) {
        const struct learning_answer *other = &pick->answers[i];
        double most = other->lessons ? STAYS_KNOWN : STAYS_FORECAST;
        if (i != shown && other->ms < most * pick->answers[shown].ms &&
            other->ms < pick->answers[pick->technique].ms)
            pick->technique = (enum forecast_technique)i;
    }
    return true;
}

static void find_runner_up(struct auto_pick *pick)
{
    const struct learning_answer *chosen = &pick->answers[pick->technique];
    double best = TIMING_GAIN * chosen->ms;
    if (chosen->lessons < TIMING_LESSONS)
        return;
    for (int i = 0; i < FORECAST_TECHNIQUES; i++) {
        const struct learning_answer *other = &pick->answers[i];
        double least = other->ms * exp(-TIMING_DOUBT * other->doubt);
        if (other == chosen || other->lessons >= TIMING_ENOUGH || !(least < best) ||
            other->ms > TIMING_MOST * chosen->ms)
            continue;
        best = least;
        pick->runner_up = (enum forecast_technique)i;
        pick->has_runner_up = true;
    }
}

struct auto_pick auto_pick(const struct learning_case frames[FORECAST_TECHNIQUES],
                           const struct learning *learned)
{
    struct auto_pick pick = {.has_runner_up = false};
    for (int i = 0; i < FORECAST_TECHNIQUES; i++) {
        if (learned)
            pick.answers[i] = learning_expect(learned, &frames[i]);
        for (int k = 0; k < FORECAST_TERM_COUNT && !learned; k++)
            pick.answers[i].ms += frames[i].terms[k];
    }
    if (!stay(&pick)) {
        pick.technique =
            forecast_choose(pick.answers[FORECAST_MAPS].ms, pick.answers[FORECAST_RAYS].ms,
                            pick.answers[FORECAST_TRACED_SHADOWS].ms);
        take_known(&pick);
    }
    find_runner_up(&pick);
    return pick;
}

static void explain(struct auto_choice *choice, const struct auto_pick *pick, const char *kept)
{
    uint32_t lessons = pick->answers[pick->technique].lessons;
    char source[64] = "calibrated";
    if (lessons)
        snprintf(source, sizeof source, "calibrated, %u frame%s like it", lessons,
                 lessons == 1 ? "" : "s");
    snprintf(choice->because, sizeof choice->because,
             "auto: forecast %.4g ms ray traced, %.4g ms rasterised, %.4g ms with traced shadows "
             "(%s, %s)",
             choice->traced_ms, choice->raster_ms, choice->traced_shadows_ms, kept, source);
}

static void take(struct auto_choice *choice, const struct auto_settings *settings, const char *kept)
{
    struct auto_pick pick = auto_pick(choice->frames, settings->learned);
    choice->is_timed = settings->timed > 0;
    if (choice->is_timed)
        pick.technique = (enum forecast_technique)(settings->timed - 1);
    choice->raster_ms = pick.answers[FORECAST_MAPS].ms;
    choice->traced_ms = pick.answers[FORECAST_RAYS].ms;
    choice->traced_shadows_ms = pick.answers[FORECAST_TRACED_SHADOWS].ms;
    choice->takes_traced = pick.technique == FORECAST_RAYS;
    choice->takes_traced_shadows = pick.technique == FORECAST_TRACED_SHADOWS;
    explain(choice, &pick, kept);
}

static bool forecast(struct auto_choice *choice, const struct auto_desc *desc, struct error *err)
{
    struct workload workload;
    const struct view_quality *quality = &desc->view->quality;
    struct forecast_setting setting = {
        .samples = desc->raster_samples,
        .shadow_resolution = RESOLUTION_DEFAULT,
        .shadow_taps = quality->shadow_taps ? quality->shadow_taps : TAPS_DEFAULT,
        .has_shadows = true,
    };
    if (!workload_measure(&workload,
                          &(struct workload_desc){.view = desc->view,
                                                  .state = desc->state,
                                                  .camera = desc->camera,
                                                  .reach = desc->reach},
                          err))
        return false;
    bool is_warm = quality->expects_reuse;
    bool can_stay = is_warm && maps_can_stay(desc, &workload, &setting);
    for (int i = 0; i < FORECAST_TECHNIQUES; i++) {
        if (i == FORECAST_RAYS)
            setting.samples = quality->samples ? quality->samples : TRACED_SAMPLES_DEFAULT;
        else
            setting.samples = desc->raster_samples;
        choice->cold[i] = (struct learning_case){.technique = (enum forecast_technique)i,
                                                 .view = desc->view_key & ~UINT64_C(1)};
        forecast_terms(&workload, &setting, &desc->settings->speed, choice->cold[i].technique,
                       choice->cold[i].terms);
        bool is_kept = i == FORECAST_MAPS ? can_stay : is_warm;
        choice->frames[i] = auto_case(&choice->cold[i], is_kept ? 0 : 1);
    }
    take(choice, desc->settings,
         can_stay  ? "shadows kept"
         : is_warm ? "too many maps to keep"
                   : "shadows built");
    return true;
}

bool auto_choose(struct auto_choice *choice, const struct auto_desc *desc, struct error *err)
{
    *choice = (struct auto_choice){0};
    if (!desc->settings || desc->settings->policy == AUTO_RASTER || !is_open(desc))
        return true;
    if (desc->settings->policy == AUTO_RAYTRACED) {
        choice->is_open = choice->takes_traced = true;
        snprintf(choice->because, sizeof choice->because, "auto: the server is set to ray tracing");
        return true;
    }
    if (!device_speed_is_known(&desc->settings->speed))
        return true;
    choice->is_open = true;
    return forecast(choice, desc, err);
}

double auto_choice_ms(const struct auto_choice *choice)
{
    return choice->takes_traced           ? choice->traced_ms
           : choice->takes_traced_shadows ? choice->traced_shadows_ms
                                          : choice->raster_ms;
}

enum forecast_technique auto_choice_technique(const struct auto_choice *choice)
{
    return choice->takes_traced           ? FORECAST_RAYS
           : choice->takes_traced_shadows ? FORECAST_TRACED_SHADOWS
                                          : FORECAST_MAPS;
}

enum shadow_technique auto_choice_shadows(const struct auto_choice *choice)
{
    static const enum shadow_technique techniques[FORECAST_TECHNIQUES] = {
        [FORECAST_MAPS] = SHADOWS_DEEP,
        [FORECAST_RAYS] = SHADOWS_RAYTRACED,
        [FORECAST_TRACED_SHADOWS] = SHADOWS_RAYTRACED_SHADOWS};
    return techniques[auto_choice_technique(choice)];
}
