/* SPDX-License-Identifier: MIT */
/* The color output without the GPU. */
#include "renderer/frame/frame_raytrace.h"

#include <stdio.h>
#include <string.h>

#include "protocol/quality_defaults.h"
#include "renderer/frame/frame_budget.h"
#include "renderer/frame/frame_yield.h"
#include "renderer/plan/traced.h"

/* Lights towards which shadow rays go. */
static size_t count_casting(const struct view *view, const struct scene_state *state)
{
    size_t count = 0;
    for (size_t i = 0; i < state->light_count; i++)
        count += state->lights[i].casts_shadow;
    return view->quality.shadows == SHADOWS_NONE ? 0 : count;
}

static const char *form_of(const struct view *view)
{
    return view->quality.reference ? "reference" : "raytraced";
}

static void report_build(const struct raytrace_stats *stats, const char *form, const char *because,
                         struct frame_report *report)
{
    if (stats->is_scene_reused)
        report_add_reused(report, "raytrace.build");
    else
        report_add_pass(report, "raytrace.build", because, form, stats->build_ms, REPORT_SHADOW);
}

static void report_trace(const struct raytrace_stats *stats, const struct view *view,
                         const struct scene_state *state, const char *because,
                         struct frame_report *report)
{
    const char *form = form_of(view);
    report_build(stats, form, because, report);
    if (stats->haze_ms > 0)
        report_add_pass(report, "raytrace.haze", "lights shine into the atmosphere", form,
                        stats->haze_ms, REPORT_SHADE);
    report_add_pass(report, "raytrace.trace", because, form, stats->trace_ms, REPORT_SHADE);
    report_add_bytes(report, "raytrace", stats->scene_bytes);
    report->counts.shadowed_lights = count_casting(view, state);
    report->counts.lookups += stats->shadow_rays;
    report->counts.shadow_rays += stats->shadow_rays;
    report->error_is_exact = scene_state_area_lights(state) == 0 && !view_has_environment(view);
}

void frame_drop_other_traced(struct frame_context *context, const char *scene_key)
{
    if (strcmp(context->traced_key, scene_key) != 0)
        renderer_forget_traced(context->renderer, NULL);
    snprintf(context->traced_key, sizeof context->traced_key, "%s", scene_key);
}

bool frame_raytrace(const struct frame_run *run, const char *because, const uint8_t *texture_levels,
                    struct error *err)
{
    struct renderer *renderer = run->context->renderer;
    const struct view *view = run->view;
    struct frame *frame = run->frame;
    struct raytrace_stats stats;
    const struct yield_point yield = frame_yield_point(run);
    struct raytrace_desc desc = {
        .view = view,
        .state = run->state,
        .camera = run->camera,
        .environment = run->environment,
        .texture_levels = texture_levels,
        .samples = quality_or(view->quality.samples, SAMPLES_DEFAULT),
        .cache = renderer->traced,
        .advance = frame_advance_rays,
        .advance_context = run->context,
        .yield = frame_yield_if_any(run, &yield),
    };
    frame_drop_other_traced(run->context, run->scene->key);
    image_finish(&frame->outputs[VIEW_OUTPUT_COLOR]);
    frame_context_begin_span(run->context, (struct progress_span){FRAME_STAGE_RAYS, 0, 1});
    bool ok = raytrace_render(&desc, &frame->outputs[VIEW_OUTPUT_COLOR], &stats, err);
    if (ok)
        report_trace(&stats, view, run->state, because, &frame->report);
    frame_budget_end_rays(run);
    return ok;
}

bool frame_raytrace_build(const struct frame_run *run, const char *because, struct error *err)
{
    struct renderer *renderer = run->context->renderer;
    struct raytrace_stats stats;
    const struct raytrace_desc desc = {
        .view = run->view, .state = run->state, .camera = run->camera, .cache = renderer->traced};
    frame_drop_other_traced(run->context, run->scene->key);
    if (!raytrace_build(&desc, &stats, err))
        return false;
    report_build(&stats, form_of(run->view), because, &run->frame->report);
    frame_budget_end_rays(run);
    return true;
}
