/* SPDX-License-Identifier: MIT */
/* Sums of the parts that a technique has. */
#include "renderer/cost/technique_forecast.h"

#include "renderer/shadows/technique.h"

/* NULL: without shadows, or of a technique that rasterises nothing. */
static const struct shadow_structure *structure_of(enum shadow_technique technique)
{
    const struct shadow_method *method = shadow_method_of(technique);
    return method && !shadow_technique_is_renderer(technique) ? method->structure : NULL;
}

void technique_forecast_terms(enum shadow_technique technique, const struct forecast_frame *frame,
                              double terms[FORECAST_TERM_COUNT])
{
    const struct shadow_structure *structure = structure_of(technique);
    for (int i = 0; i < FORECAST_TERM_COUNT; i++)
        terms[i] = 0;
    if (shadow_technique_is_renderer(technique))
        forecast_add_rays(frame, terms);
    else
        forecast_add_surfaces(frame, terms);
    /* rays that find the shadows of a window take lists */
    if (!shadow_technique_is_renderer(technique) &&
        (!structure || structure->scope == SHADOW_PER_LIGHT))
        forecast_add_peels(frame, terms);
    if (structure && frame->setting->has_shadows)
        structure->forecast(frame, terms);
}

double technique_forecast_ms(enum shadow_technique technique, const struct forecast_frame *frame)
{
    double terms[FORECAST_TERM_COUNT];
    technique_forecast_terms(technique, frame, terms);
    return forecast_sum_ms(terms);
}

double technique_forecast_error(enum shadow_technique technique,
                                const struct forecast_setting *setting)
{
    const struct shadow_structure *structure = structure_of(technique);
    return structure && structure->forecast_error ? structure->forecast_error(setting) : 0;
}
