/* SPDX-License-Identifier: MIT */
/* Making way for urgent frames, and putting back what they replaced. */
#include "renderer/frame/frame_yield.h"

#include <stdlib.h>

#include "renderer/base/wall_clock.h"
#include "renderer/frame/frame_budget.h"
#include "renderer/frame/frame_in_flight.h"
#include "renderer/frame/frame_textures.h"
#include "renderer/frame/light_batches.h"

/* Programs that urgent frames asked for are not this frame's. */
static void count_programs(struct frame_context *context, const struct program_cache_stats *before)
{
    struct program_cache_stats after;
    program_cache_get_stats(context->renderer->programs, &after);
    context->urgent_programs.hits += after.hits - before->hits;
    context->urgent_programs.misses += after.misses - before->misses;
    context->urgent_programs.loaded += after.loaded - before->loaded;
}

/* The report gets the passes so far, and how long urgent frames took. */
static bool make_way(struct frame_context *context, struct frame_report *report, struct error *err)
{
    struct renderer *renderer = context->renderer;
    struct program_cache_stats before;
    double begin_ms = wall_ms();
    gpu_timeline_will_wait(renderer->timeline);
    gpu_timeline_collect(renderer->timeline, report); /* which urgent frames use, too */
    program_cache_get_stats(renderer->programs, &before);
    raytrace_cache_lend(renderer->traced, true);
    renderer->current = &renderer->urgent;
    frame_in_flight_deliver(renderer);
    bool is_wanted = yield_point_run(renderer->yield, err);
    renderer->current = context;
    frame_budget_resume(context);
    raytrace_cache_lend(renderer->traced, false);
    count_programs(context, &before);
    report->paused_ms += wall_ms() - begin_ms;
    return is_wanted;
}

/* Restores what urgent frames replaced of the scene: bound materials, levels of textures, and what
 * Embree's scene refers to. A ray traced picture has restored that itself. */
static bool put_back_scene(const struct frame_run *run, struct error *err)
{
    struct frame_context *context = run->context;
    if (!frame_run_is_rasterised(run))
        return true;
    draw_arena_bind_materials(context->arena);
    if (!frame_textures_resume(run->textures, run, err))
        return false;
    if (frame_run_starts_rays(run) && context->shadow_rays.rays)
        raytrace_shadows_resume(context->shadow_rays.rays);
    return true;
}

/* The shadow structures, and the lights. */
static bool put_back_shadows(const struct frame_run *run, struct error *err)
{
    struct renderer *renderer = run->context->renderer;
    struct frame discarded = {0}; /* the report has all that from the first time */
    struct frame_run again = *run;
    if (!run->frame_plan->plan.requirements[PLAN_NEED_COLOR].is_met)
        return true;
    again.frame = &discarded;
    again.is_again = true;
    bool ok = shadow_system_prepare_none(renderer->shadows, run->state->light_count, err) &&
              (!plan_has_step(&run->frame_plan->plan, PLAN_STEP_SHADOWS) ||
               light_batches_prepare(&again, err)) &&
              frame_run_upload_lights(run, err);
    run->frame->report.paused_ms += discarded.report.paused_ms;
    return ok;
}

static bool should_yield(void *context)
{
    const struct frame_run *run = context;
    const struct yield_point *yield = frame_context_yield(run->context);
    return yield && (frame_in_flight_is_cut(run->context->renderer) || yield_point_is_due(yield));
}

static bool is_unwanted(void *context)
{
    const struct frame_run *run = context;
    return yield_point_is_unwanted(frame_context_yield(run->context));
}

static bool run_urgent_within_shadows(void *context, struct error *err)
{
    const struct frame_run *run = context;
    bool was_pinned = run->scene->is_pinned; /* by a frame that waits for this one */
    run->scene->is_pinned = true;
    bool is_wanted = make_way(run->context, &run->frame->report, err);
    run->scene->is_pinned = was_pinned;
    return is_wanted && put_back_scene(run, err);
}

static bool run_urgent(void *context, struct error *err)
{
    const struct frame_run *run = context;
    if (run->textures->is_inexact) /* its maps are not for others */
        shadow_system_forget(run->context->renderer->shadows,
                             resident_scene_shadow_key(run->scene));
    return run_urgent_within_shadows(context, err) && put_back_shadows(run, err);
}

struct yield_point frame_yield_point(const struct frame_run *run)
{
    return (struct yield_point){.context = (void *)(uintptr_t)run,
                                .should_yield = should_yield,
                                .run_urgent = run_urgent,
                                .is_unwanted = is_unwanted};
}

struct yield_point frame_yield_point_of_shadows(const struct frame_run *run)
{
    struct yield_point point = frame_yield_point(run);
    point.run_urgent = run_urgent_within_shadows;
    return point;
}

const struct yield_point *frame_yield_if_any(const struct frame_run *run,
                                             const struct yield_point *point)
{
    return frame_context_yield(run->context) ? point : NULL;
}

void frame_advance_rays(void *frame_context, double share)
{
    const struct frame_context *context = frame_context;
    frame_context_tell(context, context->span.stage,
                       context->span.first + share * context->span.size);
}
