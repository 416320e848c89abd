/* SPDX-License-Identifier: MIT */
/* Traced shadows of a rasterised frame. */
#include "renderer/frame/frame_shadows.h"

#include <stdlib.h>

#include "renderer/frame/frame_budget.h"
#include "renderer/frame/frame_yield.h"
#include "renderer/frame/frame_raytrace.h"
#include "renderer/shadows/technique.h"

/* For the report: of what looks at the points of windows. */
static const char *technique_of(const struct frame_run *run)
{
    const struct shadow_method *method = run->frame_plan->plan.window_shadows;
    return method ? shadow_technique_name((int)method->id) : PLAN_RAYS;
}

bool frame_shadows_begin(const struct frame_run *run, struct error *err)
{
    struct frame_context *context = run->context;
    struct renderer *renderer = context->renderer;
    const struct shadow_needs *needs = &run->frame_plan->shadows;
    struct traced_shadows *traced = &context->shadow_rays;
    traced->yield = frame_yield_point(run);
    struct raytrace_desc desc = {.view = run->view,
                                 .state = run->state,
                                 .camera = run->camera,
                                 .environment = run->environment,
                                 .cache = renderer->traced,
                                 .advance = frame_advance_rays,
                                 .advance_context = run->context,
                                 .yield = frame_yield_if_any(run, &traced->yield)};
    bool *is_shadowed = calloc(needs->light_count + 1, sizeof *is_shadowed);
    if (!is_shadowed)
        return error_set(err, ERROR_NO_MEMORY, "%zu lights", needs->light_count);
    for (size_t i = 0; i < needs->light_count; i++)
        is_shadowed[i] = frame_run_rays(run) && needs->lights[i].is_traced;
    frame_drop_other_traced(run->context, run->scene->key);
    const struct traced_desc begun = {
        .finder = shadow_finder_of(run->frame_plan->plan.window_shadows),
        .technique = technique_of(run),
        .finding = {.desc = &desc,
                    .is_shadowed = is_shadowed,
                    .needs = needs,
                    .programs = renderer->programs,
                    .limits = gl_context_limits(renderer->gl),
                    .scene_key = run->scene->key,
                    .loop_steps = context->shade.loop_steps},
        .visibility_lobes = run->frame_plan->shaders.visibility_lobes,
    };
    bool ok = traced_shadows_begin(traced, &begun, err);
    free(is_shadowed);
    return ok;
}

bool frame_shadows_collect(const struct frame_run *run, const struct window_frame *frame,
                           bool *overflows, struct error *err)
{
    struct frame_context *context = run->context;
    struct traced_shadows *traced = &context->shadow_rays;
    const struct clusters *clusters = light_lists_clusters(context->lists);
    enum traced_outcome outcome = traced_shadows_collect(traced, frame, &context->layers, err);
    if (outcome == TRACED_COLLECTED && frame_run_rays(run) && clusters->longest &&
        !traced_shadows_room(traced, clusters))
        outcome = TRACED_TOO_MANY;
    *overflows = outcome == TRACED_TOO_MANY;
    uint64_t *fragments = &frame->report->counts.transparent_fragments;
    if (*overflows && *fragments >= context->layers.layer_count)
        *fragments -= context->layers.layer_count; /* they come again with the window's halves */
    return outcome == TRACED_TOO_MANY ||
           (outcome == TRACED_COLLECTED &&
            (!traced->visibility_lobes || traced_shadows_see(traced, err)));
}

/* Whether the frame's rays went through a scene of their own. */
static void report_build(const struct frame_run *run, const struct traced_shadows *traced,
                         const char *because)
{
    struct frame_report *report = &run->frame->report;
    if (!traced->rays)
        return;
    if (traced->stats.is_scene_reused)
        report_add_reused(report, "raytrace.build");
    else
        report_add_pass(report, "raytrace.build", because,
                        traced->finder && !traced->finder->reads_points ? PLAN_RAYS
                                                                        : technique_of(run),
                        traced->stats.build_ms, REPORT_SHADOW);
    report_add_bytes(report, "raytrace", traced->stats.scene_bytes);
}

static void report_rays(const struct frame_run *run, const struct traced_shadows *traced)
{
    const struct plan *plan = &run->frame_plan->plan;
    const struct shadow_method *method = plan->window_shadows;
    const char *technique = technique_of(run);
    const struct plan_requirement *seen = &plan->requirements[PLAN_NEED_VISIBILITY];
    const char *because =
        plan->requirements[method ? PLAN_NEED_TRACED_SHADOWS : seen->need].because;
    struct frame_report *report = &run->frame->report;
    report_build(run, traced, because);
    traced_shadows_report(traced, &(struct shadow_report){report, because, technique});
    if (traced->stats.haze_ms > 0)
        report_add_pass(report, "atmosphere.trace", "lights shine into the atmosphere", technique,
                        traced->stats.haze_ms, REPORT_SHADE);
    if (seen->is_met)
        report_add_pass(report, "environment.trace", seen->because, PLAN_RAYS, traced->stats.see_ms,
                        REPORT_SHADOW);
    report_add_bytes(report, "shadow.traced", traced->window_bytes);
    if (method)
        report->counts.shadowed_lights = plan->traced_lights;
    report->counts.shadow_rays += traced->stats.shadow_rays;
}

void frame_shadows_end(const struct frame_run *run)
{
    struct frame_context *context = run->context;
    struct traced_shadows *traced = &context->shadow_rays;
    if (traced->rays || traced->finder)
        report_rays(run, traced);
    traced_shadows_end(traced);
    frame_budget_end_rays(run);
}
