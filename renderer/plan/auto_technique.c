/* SPDX-License-Identifier: MIT */
/* Maps or rays, by forecast. */
#include "renderer/plan/auto_technique.h"

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
           quality->shadows == VIEW_SHADOWS_AUTO && !speaks_of_maps && !has_areas(desc->state);
}

/* Maps that do not all fit the budget are made in batches, anew for every frame. */
static bool maps_can_stay(const struct auto_desc *desc, const struct workload *workload,
                          const struct forecast_setting *setting)
{
    return desc->shadow_budget_bytes == 0 ||
           forecast_maps_bytes(workload, setting) <= (double)desc->shadow_budget_bytes;
}

static bool forecast(struct auto_choice *choice, const struct auto_desc *desc, struct error *err)
{
    struct workload workload;
    const struct view_quality *quality = &desc->view->quality;
    const struct device_speed *speed = &desc->settings->speed;
    struct forecast_setting setting = {
        .samples = desc->raster_samples,
        .shadow_resolution = RESOLUTION_DEFAULT,
        .shadow_taps = quality->shadow_taps ? quality->shadow_taps : TAPS_DEFAULT,
        .has_shadows = true,
        .is_warm = quality->expects_reuse,
    };
    if (!workload_measure(&workload,
                          &(struct workload_desc){.view = desc->view,
                                                  .state = desc->state,
                                                  .camera = desc->camera,
                                                  .reach = desc->reach},
                          err))
        return false;
    struct forecast_setting maps = setting;
    maps.is_warm = setting.is_warm && maps_can_stay(desc, &workload, &setting);
    choice->raster_ms = forecast_raster_ms(&workload, &maps, speed);
    choice->traced_shadows_ms = forecast_traced_shadows_ms(&workload, &setting, speed);
    setting.samples = quality->samples ? quality->samples : TRACED_SAMPLES_DEFAULT;
    choice->traced_ms = forecast_traced_ms(&workload, &setting, speed);
    enum forecast_technique technique =
        forecast_choose(choice->raster_ms, choice->traced_ms, choice->traced_shadows_ms);
    choice->takes_traced = technique == FORECAST_RAYS;
    choice->takes_traced_shadows = technique == FORECAST_TRACED_SHADOWS;
    snprintf(choice->because, sizeof choice->because,
             "auto: forecast %.4g ms ray traced, %.4g ms rasterised, %.4g ms with traced shadows "
             "(%s, calibrated)",
             choice->traced_ms, choice->raster_ms, choice->traced_shadows_ms,
             maps.is_warm      ? "shadows kept"
             : setting.is_warm ? "too many maps to keep"
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
