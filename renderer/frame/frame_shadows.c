/* SPDX-License-Identifier: MIT */
/* Traced shadows of a rasterised frame. */
#include "renderer/frame/frame_shadows.h"

#include <stdlib.h>

#include "renderer/frame/frame_budget.h"
#include "renderer/frame/frame_pause.h"
#include "renderer/frame/frame_raytrace.h"

static bool is_pause_due(void *run)
{
    return frame_run_is_pause_due(run);
}

/* Rays only learn that they are to end: why is told where they began. */
static bool serve_pause(void *context)
{
    const struct frame_run *run = context;
    return frame_run_pause(run, true, &run->renderer->shadow_rays.failure);
}

bool frame_shadows_begin(const struct frame_run *run, struct error *err)
{
    struct renderer *renderer = run->renderer;
    const struct shadow_needs *needs = &run->frame_plan->shadows;
    struct traced_shadows *traced = &renderer->shadow_rays;
    traced->pause = (struct interlude){
        .context = (void *)(uintptr_t)run, .is_due = is_pause_due, .serve = serve_pause};
    struct raytrace_desc desc = {.view = run->view,
                                 .state = run->state,
                                 .camera = run->camera,
                                 .cache = renderer->traced,
                                 .progress = frame_pause_ends_rays,
                                 .context = renderer,
                                 .interlude = renderer->interlude ? &traced->pause : NULL};
    bool *is_shadowed = calloc(needs->light_count + 1, sizeof *is_shadowed);
    if (!is_shadowed)
        return error_set(err, ERROR_NO_MEMORY, "%zu lights", needs->light_count);
    for (size_t i = 0; i < needs->light_count; i++)
        is_shadowed[i] = needs->lights[i].is_traced;
    frame_claim_traced(renderer, run->scene->key);
    bool ok = traced_shadows_begin(traced, &desc, is_shadowed, err);
    free(is_shadowed);
    return ok;
}

bool frame_shadows_collect(const struct frame_run *run, const struct window_frame *frame,
                           bool *must_split, struct error *err)
{
    struct renderer *renderer = run->renderer;
    struct traced_shadows *traced = &renderer->shadow_rays;
    const struct clusters *clusters = light_lists_clusters(renderer->lists);
    enum traced_outcome outcome = traced_shadows_collect(traced, frame, &renderer->pixels, err);
    if (outcome == TRACED_COLLECTED && clusters->longest && !traced_shadows_room(traced, clusters))
        outcome = TRACED_TOO_MANY;
    *must_split = outcome == TRACED_TOO_MANY;
    uint64_t *fragments = &frame->report->counts.transparent_fragments;
    if (*must_split && *fragments >= renderer->pixels.entry_count)
        *fragments -= renderer->pixels.entry_count; /* they come again with the window's halves */
    return outcome != TRACED_FAILED;
}

static void report_rays(const struct frame_run *run, const struct traced_shadows *traced)
{
    static const char technique[] = "raytraced-shadows";
    const struct plan *plan = &run->frame_plan->plan;
    const char *because = plan->requirements[PLAN_NEED_TRACED_SHADOWS].because;
    struct frame_report *report = &run->frame->report;
    if (traced->stats.is_scene_reused)
        report_add_reused(report, "raytrace.build");
    else
        report_add_pass(report, "raytrace.build", because, technique, traced->stats.build_ms,
                        REPORT_SHADOW);
    report_add_pass(report, "shadow.trace", because, technique, traced->stats.trace_ms,
                    REPORT_SHADOW);
    report_add_bytes(report, "raytrace", traced->stats.scene_bytes);
    report_add_bytes(report, "shadow.traced", traced->window_bytes);
    report->counts.shadowed_lights = plan->traced_lights;
    report->counts.shadow_rays += traced->stats.shadow_rays;
}

void frame_shadows_end(const struct frame_run *run)
{
    struct renderer *renderer = run->renderer;
    struct traced_shadows *traced = &renderer->shadow_rays;
    if (traced->rays)
        report_rays(run, traced);
    traced_shadows_end(traced);
    frame_budget_end_rays(run);
}
