/* SPDX-License-Identifier: MIT */
/* Pausing a frame, and the renderer beside it. */
#include "renderer/frame/frame_pause.h"

#include <stdlib.h>

#include "renderer/base/wall_clock.h"
#include "renderer/frame/frame_budget.h"
#include "renderer/frame/frame_flight.h"

static bool is_due(void *context)
{
    const struct frame_pause *pause = context;
    const struct interlude *interlude = pause->renderer->interlude;
    return interlude && interlude->is_due(interlude->context);
}

/* Programs that others asked for are not this frame's. */
static void count_programs(struct renderer *renderer, const struct program_cache_stats *before)
{
    struct program_cache_stats after;
    program_cache_get_stats(renderer->programs, &after);
    renderer->aside.hits += after.hits - before->hits;
    renderer->aside.misses += after.misses - before->misses;
    renderer->aside.loaded += after.loaded - before->loaded;
}

static bool serve(void *context)
{
    const struct frame_pause *pause = context;
    struct renderer *renderer = pause->renderer;
    const struct interlude *interlude = renderer->interlude;
    struct program_cache_stats before;
    double begin_ms = wall_ms();
    gpu_timeline_will_wait(renderer->timeline);
    gpu_timeline_collect(renderer->timeline, pause->report); /* which others use, too */
    program_cache_get_stats(renderer->programs, &before);
    raytrace_cache_lend(renderer->traced, true);
    renderer->is_paused = true;
    frame_flight_deliver(renderer);
    bool is_wanted = interlude->serve(interlude->context);
    renderer->is_paused = false;
    frame_budget_resume(renderer);
    raytrace_cache_lend(renderer->traced, false);
    count_programs(renderer, &before);
    pause->report->paused_ms += wall_ms() - begin_ms;
    return is_wanted;
}

struct interlude frame_pause_interlude(struct frame_pause *pause)
{
    return (struct interlude){.context = pause, .is_due = is_due, .serve = serve};
}

bool frame_pause_ends_rays(void *context, double share)
{
    const struct renderer *renderer = context;
    const struct interlude *interlude = renderer->interlude;
    renderer_tell(renderer, renderer->piece.stage,
                  renderer->piece.first + share * renderer->piece.size);
    return interlude && interlude->is_unwanted && interlude->is_unwanted(interlude->context);
}

struct renderer *frame_pause_other(struct renderer *renderer, struct error *err)
{
    if (!renderer->other)
        renderer->other = renderer_create_beside(renderer, err);
    if (renderer->other)
        renderer->other->automatic = renderer->automatic;
    return renderer->other;
}
