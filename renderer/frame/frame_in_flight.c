/* SPDX-License-Identifier: MIT */
/* What remains to be done for a frame after its last command. */
#include "renderer/frame/frame_in_flight.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/wall_clock.h"
#include "renderer/frame/frame_yield.h"

enum { WAIT_NS = 1000000000 };

/* Checks, in tests, that the plan has every pass that ran. */
static void check_passes(const struct plan *plan, const struct frame_report *report)
{
    for (int i = 0; i < report->pass_count; i++) {
        const struct report_pass *ran = &report->passes[i];
        int k = 0;
        while (k < plan->pass_count && (strcmp(plan->passes[k].pass, ran->pass) != 0 ||
                                        strcmp(plan->passes[k].technique, ran->technique) != 0))
            k++;
        if (k == plan->pass_count)
            fprintf(stderr, "pass '%s' (%s) is not in the plan\n", ran->pass, ran->technique);
        assert(k < plan->pass_count);
    }
}

/* Learns the pace of the device's passes. In software each time slice is measured as it ends. */
static void note_pace(struct frame_context *context, const struct frame_ending *ending)
{
    const struct image *color = &ending->frame->outputs[VIEW_OUTPUT_COLOR];
    if (!gl_context_limits(context->renderer->gl)->is_software)
        time_slice_history_note(&context->time_slice_history, ending->pace_key,
                                (uint64_t)color->width_px * (uint64_t)color->height_px,
                                &ending->frame->report);
}

/* Completes the frame, whose report lacks only its passes. If the context was lost, that is the
 * reason to report. */
static bool complete(struct frame_context *context, const struct frame_ending *ending,
                     struct error *err)
{
    const struct renderer *renderer = context->renderer;
    struct frame_report *report = &ending->frame->report;
    struct error problem = {0};
    bool has_come = readback_collect(renderer->readback, report, &problem);
    bool ok = gl_context_check(renderer->gl, "reading back", err) &&
              (has_come || error_pass(err, &problem));
    if (ok && ending->plan && renderer->is_strict)
        check_passes(ending->plan, report);
    image_cache_confirm(&context->image_cache, ending->picture, ok && !report->has_cut_lists);
    if (ok && !report->is_kept_picture)
        note_pace(context, ending);
    report->total_ms = wall_ms() - ending->begin_ms - report->paused_ms;
    if (ok && !context->is_urgent)
        frame_observations_take(renderer->observations, &ending->observation, report,
                                gl_context_limits(renderer->gl)->is_software);
    if (!ok)
        frame_finish(ending->frame);
    return ok;
}

static bool end_here(struct frame_context *context, const struct frame_ending *ending,
                     struct error *err)
{
    const struct renderer *renderer = context->renderer;
    struct frame_report *report = &ending->frame->report;
    while (!ending->has_failed && !readback_wait(renderer->readback, report, WAIT_NS))
        continue; /* the times of passes are known when the picture is */
    gpu_timeline_collect(renderer->timeline, report);
    if (!ending->has_failed)
        return complete(context, ending, err);
    gl_context_blame(renderer->gl, "rendering", err);
    readback_drop(renderer->readback, report);
    frame_finish(ending->frame);
    return false;
}

/* Remembers the frame until it is collected. The plan may be gone by then, so tests keep a copy. */
static void keep_in_flight(struct renderer *renderer, const struct frame_ending *ending)
{
    struct frame_in_flight *in_flight = &renderer->in_flight;
    *in_flight = (struct frame_in_flight){.frame = ending->frame,
                                          .begin_ms = ending->begin_ms,
                                          .view = ending->view,
                                          .pace_key = ending->pace_key,
                                          .picture = ending->picture,
                                          .observation = ending->observation};
    snprintf(in_flight->scene_key, sizeof in_flight->scene_key, "%s", ending->scene_key);
    if (renderer->is_strict && (in_flight->plan = malloc(sizeof *in_flight->plan)))
        *in_flight->plan = *ending->plan;
    gpu_timeline_put_aside(renderer->timeline);
}

bool frame_in_flight_end(struct frame_context *context, const struct frame_ending *ending,
                         bool *is_done, struct error *err)
{
    struct renderer *renderer = context->renderer;
    const struct frame_report *report = &ending->frame->report;
    bool is_under_way = !ending->has_failed && !readback_wait(renderer->readback, report, 0);
    if (is_under_way)
        gpu_timeline_will_wait(renderer->timeline);
    if (!is_done || !is_under_way || context->is_urgent || renderer->in_flight.frame)
        return end_here(context, ending, err);
    *is_done = false;
    keep_in_flight(renderer, ending);
    return true;
}

/* ---- public functions ---- */

void renderer_set_completion(struct renderer *renderer, const struct frame_completion *completion)
{
    renderer->completion = completion;
}

bool renderer_wait(struct renderer *renderer, int timeout_ms)
{
    const struct frame *frame = renderer->in_flight.frame;
    return !frame || renderer->in_flight.is_cut ||
           readback_wait(renderer->readback, &frame->report, (uint64_t)timeout_ms * 1000000);
}

/* Draws a frame again whose lists were larger than guessed; its sizes are read first now. */
static bool make_again(struct renderer *renderer, const struct frame_in_flight *in_flight,
                       struct error *err)
{
    struct frame *frame = in_flight->frame;
    struct frame_context *context = renderer_next_context(renderer, err);
    frame_finish(frame);
    if (!context)
        return false;
    context->reads_sizes = true;
    bool ok = renderer_render(renderer, in_flight->scene_key, in_flight->view, frame, err);
    context->reads_sizes = false;
    if (ok)
        frame->report.total_ms = wall_ms() - in_flight->begin_ms - frame->report.paused_ms;
    return ok;
}

bool renderer_collect(struct renderer *renderer, struct error *err)
{
    struct frame_in_flight in_flight = renderer->in_flight;
    const struct frame_ending ending = {.frame = in_flight.frame,
                                        .plan = in_flight.plan,
                                        .begin_ms = in_flight.begin_ms,
                                        .pace_key = in_flight.pace_key,
                                        .picture = in_flight.picture,
                                        .observation = in_flight.observation};
    assert(in_flight.frame);
    renderer->in_flight = (struct frame_in_flight){.frame = NULL};
    while (!readback_wait(renderer->readback, &in_flight.frame->report, WAIT_NS))
        continue; /* the caller has a deadline for the process */
    gpu_timeline_collect_aside(renderer->timeline, &in_flight.frame->report);
    bool ok = complete(&renderer->frames, &ending, err);
    free(in_flight.plan);
    return ok && (!in_flight.frame->report.has_cut_lists || make_again(renderer, &in_flight, err));
}

/* ---- while a later frame is made ---- */

/* Reads the picture back. False: its lists were cut, and it cannot be drawn again while a frame
 * runs. Any other fault is reported when the frame is collected. */
static bool may_collect(struct renderer *renderer)
{
    struct frame_in_flight *in_flight = &renderer->in_flight;
    struct error problem = {0};
    in_flight->is_cut = readback_collect(renderer->readback, &in_flight->frame->report, &problem) &&
                        in_flight->frame->report.has_cut_lists;
    return !in_flight->is_cut;
}

static void collect_before_wait(void *context)
{
    struct renderer *renderer = context;
    const struct frame_in_flight *in_flight = &renderer->in_flight;
    if (in_flight->frame && renderer->completion && !in_flight->is_cut && may_collect(renderer))
        renderer->completion->collect(renderer->completion->context);
}

bool frame_in_flight_is_cut(const struct renderer *renderer)
{
    return renderer->in_flight.is_cut && renderer->completion;
}

void frame_in_flight_deliver(struct renderer *renderer)
{
    if (frame_in_flight_is_cut(renderer))
        renderer->completion->collect(renderer->completion->context);
}

void frame_in_flight_poll(struct renderer *renderer)
{
    if (renderer_wait(renderer, 0))
        collect_before_wait(renderer);
}

void frame_in_flight_init(struct renderer *renderer)
{
    gpu_timeline_set_wait_callback(
        renderer->timeline,
        &(struct gpu_wait_callback){.context = renderer, .before_wait = collect_before_wait});
}

void frame_in_flight_finish(struct renderer *renderer)
{
    free(renderer->in_flight.plan);
    renderer->in_flight = (struct frame_in_flight){.frame = NULL};
}
