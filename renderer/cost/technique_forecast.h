/* SPDX-License-Identifier: MIT */
/* How long a frame by a technique will take, and how far its shadows are off: what `auto` chooses
 * by. A rasterised picture takes what its surfaces do, and what the structure of its shadows adds
 * (renderer/shadows/technique.h). Pure functions. Thread: any. */
#ifndef VITRAIL_RENDERER_COST_TECHNIQUE_FORECAST_H
#define VITRAIL_RENDERER_COST_TECHNIQUE_FORECAST_H

#include "protocol/shadow_technique.h"
#include "renderer/forecast/forecast.h"

/* ms of a frame, in the renderer, by its kinds of work; of those that it has not, 0. */
void technique_forecast_terms(enum shadow_technique technique, const struct forecast_frame *frame,
                              double terms[FORECAST_TERM_COUNT]);
double technique_forecast_ms(enum shadow_technique technique, const struct forecast_frame *frame);

/* As forecast.h has it; 0 where edges alone are off. */
double technique_forecast_error(enum shadow_technique technique,
                                const struct forecast_setting *setting);

#endif
