/* SPDX-License-Identifier: MIT */
/* Times the technique that `auto` would take second, for nobody to see. */
#include "renderer/frame/renderer_internal.h"

/* Frames of one timing: the first may compile and build, and then teaches nothing, or of building
 * alone. */
enum { FRAMES_MOST = 4, OBSERVATIONS_ENOUGH = 3 };

static bool shall_stop(void *context)
{
    const struct runner_up_desc *desc = context;
    return desc->shall_stop(desc->context);
}

static bool run_urgent(void *context, struct error *err)
{
    (void)context;
    (void)err;
    return false; /* nothing goes before it: it ends */
}

/* Finds the candidates of `auto`, by what is known now. */
static bool find(struct renderer *renderer, const char *scene_key, const struct view *view,
                 struct learning_case *frame)
{
    struct auto_choice choice;
    struct error ignored = {0}; /* reported to whoever asks for the picture */
    if (renderer_is_yielding(renderer) || renderer->automatic.policy != AUTO_MEASURED ||
        !renderer_choose(renderer, scene_key, view, &choice, &ignored) || !choice.is_open)
        return false;
    const struct auto_pick pick =
        auto_pick(choice.frames, frame_observations_live(renderer->observations));
    *frame = choice.frames[pick.runner_up];
    return pick.has_runner_up;
}

static bool was_timed(struct timed_views *timed, const struct learning_case *frame)
{
    const struct timed_view one = {frame->view, frame->technique};
    for (int i = 0; i < TIMED_VIEWS_MAX; i++)
        if (timed->views[i].view == one.view && timed->views[i].technique == one.technique)
            return true;
    timed->views[timed->next] = one;
    timed->next = (timed->next + 1) % TIMED_VIEWS_MAX;
    return false;
}

/* True where nothing stopped it. */
static bool draw(struct renderer *renderer, const char *scene_key, const struct view *view,
                 const struct learning_case *runner_up)
{
    bool ok = true;
    struct auto_choice choice;
    struct view drawn = *view;
    drawn.choice = &choice;
    for (int i = 0; ok && i < FRAMES_MOST; i++) {
        struct frame frame;
        struct error ignored = {0};
        if (learning_expect(frame_observations_live(renderer->observations), runner_up)
                .observations >= OBSERVATIONS_ENOUGH)
            break;
        ok = renderer_choose(renderer, scene_key, view, &choice, &ignored) &&
             renderer_render(renderer, scene_key, &drawn, &frame, &ignored);
        if (ok)
            frame_finish(&frame);
    }
    return ok;
}

enum runner_up_outcome renderer_time_runner_up(struct renderer *renderer, const char *scene_key,
                                               const struct view *view,
                                               const struct runner_up_desc *desc)
{
    struct runner_up_desc own = *desc;
    const struct yield_point stop = {.context = &own,
                                     .should_yield = shall_stop,
                                     .run_urgent = run_urgent,
                                     .is_unwanted = shall_stop};
    const struct yield_point *yield = renderer->yield;
    bool redraws_surfaces = renderer->redraws_surfaces;
    struct learning_case runner_up;
    if (!find(renderer, scene_key, view, &runner_up) || was_timed(&renderer->timed, &runner_up))
        return RUNNER_UP_NONE;
    renderer->yield = &stop;
    renderer->redraws_surfaces = true; /* kept ones would take no time */
    renderer->automatic.timed = runner_up.technique;
    bool is_whole = draw(renderer, scene_key, view, &runner_up);
    renderer->automatic.timed = SHADOWS_AUTO;
    renderer->redraws_surfaces = redraws_surfaces;
    renderer->yield = yield;
    renderer_publish_observations(renderer);
    return is_whole ? RUNNER_UP_TIMED : RUNNER_UP_STOPPED;
}
