/* SPDX-License-Identifier: MIT */
/* What is left of a frame when its commands are given. */
#include "renderer/frame/frame_flight.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/wall_clock.h"
#include "renderer/frame/frame_pause.h"

enum { WAIT_NS = 1000000000 };

/* In tests: every pass that ran is one of the plan. */
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

/* In software what a piece takes is measured as it goes. */
static void note_pace(struct renderer *renderer, const struct frame_ending *ending)
{
    const struct image *color = &ending->frame->outputs[VIEW_OUTPUT_COLOR];
    if (!gl_context_limits(renderer->context)->is_software)
        band_history_note(&renderer->band_history, ending->pace_key,
                          (uint64_t)color->width_px * (uint64_t)color->height_px,
                          &ending->frame->report);
}

/* All but the passes has been reported; a context that was lost is the better reason. */
static bool arrive(struct renderer *renderer, const struct frame_ending *ending, struct error *err)
{
    struct frame_report *report = &ending->frame->report;
    struct error problem = {0};
    bool has_come = readback_collect(renderer->readback, report, &problem);
    bool ok = gl_context_check(renderer->context, "reading back", err) &&
              (has_come || error_pass(err, &problem));
    if (ok && ending->plan && renderer->is_strict)
        check_passes(ending->plan, report);
    kept_picture_arrive(&renderer->kept_picture, ending->picture, ok && !report->has_cut_lists);
    if (ok && !report->is_kept_picture)
        note_pace(renderer, ending);
    report->total_ms = wall_ms() - ending->begin_ms - report->paused_ms;
    if (ok && renderer->lessons)
        frame_lessons_take(renderer->lessons, &ending->lesson, report,
                           gl_context_limits(renderer->context)->is_software);
    if (!ok)
        frame_finish(ending->frame);
    return ok;
}

static bool end_here(struct renderer *renderer, const struct frame_ending *ending,
                     struct error *err)
{
    struct frame_report *report = &ending->frame->report;
    while (!ending->has_failed && !readback_wait(renderer->readback, report, WAIT_NS))
        continue; /* the times of passes are there when the picture is */
    gpu_timeline_collect(renderer->timeline, report);
    if (!ending->has_failed)
        return arrive(renderer, ending, err);
    gl_context_blame(renderer->context, "rendering", err);
    readback_drop(renderer->readback, report);
    frame_finish(ending->frame);
    return false;
}

/* The plan may be gone when the frame arrives, so tests keep a copy of it. */
static void take_off(struct renderer *renderer, const struct frame_ending *ending)
{
    struct frame_flight *flight = &renderer->flight;
    *flight = (struct frame_flight){.frame = ending->frame,
                                    .begin_ms = ending->begin_ms,
                                    .view = ending->view,
                                    .pace_key = ending->pace_key,
                                    .picture = ending->picture,
                                    .lesson = ending->lesson};
    snprintf(flight->scene_key, sizeof flight->scene_key, "%s", ending->scene_key);
    if (renderer->is_strict && (flight->plan = malloc(sizeof *flight->plan)))
        *flight->plan = *ending->plan;
    gpu_timeline_put_aside(renderer->timeline);
}

bool frame_flight_end(struct renderer *renderer, const struct frame_ending *ending, bool *is_done,
                      struct error *err)
{
    const struct frame_report *report = &ending->frame->report;
    bool is_under_way = !ending->has_failed && !readback_wait(renderer->readback, report, 0);
    if (is_under_way)
        gpu_timeline_will_wait(renderer->timeline);
    if (!is_done || !is_under_way || renderer->is_beside || renderer->flight.frame)
        return end_here(renderer, ending, err);
    *is_done = false;
    take_off(renderer, ending);
    return true;
}

/* ---- the door ---- */

void renderer_set_arrival(struct renderer *renderer, const struct frame_arrival *arrival)
{
    renderer->arrival = arrival;
}

bool renderer_wait(struct renderer *renderer, int timeout_ms)
{
    const struct frame *frame = renderer->flight.frame;
    return !frame || renderer->flight.is_cut ||
           readback_wait(renderer->readback, &frame->report, (uint64_t)timeout_ms * 1000000);
}

/* Lists were larger than was guessed: with their sizes read first. */
static bool make_again(struct renderer *renderer, const struct frame_flight *flight,
                       struct error *err)
{
    struct frame *frame = flight->frame;
    struct renderer *maker = renderer->is_paused ? frame_pause_other(renderer, err) : renderer;
    frame_finish(frame);
    if (!maker)
        return false;
    maker->reads_sizes = true;
    bool ok = renderer_render(maker, flight->scene_key, flight->view, frame, err);
    maker->reads_sizes = false;
    if (ok)
        frame->report.total_ms = wall_ms() - flight->begin_ms - frame->report.paused_ms;
    return ok;
}

bool renderer_collect(struct renderer *renderer, struct error *err)
{
    struct frame_flight flight = renderer->flight;
    const struct frame_ending ending = {.frame = flight.frame,
                                        .plan = flight.plan,
                                        .begin_ms = flight.begin_ms,
                                        .pace_key = flight.pace_key,
                                        .picture = flight.picture,
                                        .lesson = flight.lesson};
    assert(flight.frame);
    renderer->flight = (struct frame_flight){.frame = NULL};
    while (!readback_wait(renderer->readback, &flight.frame->report, WAIT_NS))
        continue; /* who asked has a deadline for the process */
    gpu_timeline_collect_aside(renderer->timeline, &flight.frame->report);
    bool ok = arrive(renderer, &ending, err);
    free(flight.plan);
    return ok && (!flight.frame->report.has_cut_lists || make_again(renderer, &flight, err));
}

/* ---- the waiter of later passes ---- */

/* Takes the picture from the device. False: its lists were cut, and it cannot be made again while a
 * frame runs. What else is wrong with it is told when it is collected. */
static bool may_collect(struct renderer *renderer)
{
    struct frame_flight *flight = &renderer->flight;
    struct error problem = {0};
    flight->is_cut = readback_collect(renderer->readback, &flight->frame->report, &problem) &&
                     flight->frame->report.has_cut_lists;
    return !flight->is_cut;
}

static void collect_before(void *context)
{
    struct renderer *renderer = context;
    const struct frame_flight *flight = &renderer->flight;
    if (flight->frame && renderer->arrival && !flight->is_cut && may_collect(renderer))
        renderer->arrival->collect(renderer->arrival->context);
}

bool frame_flight_is_cut(const struct renderer *renderer)
{
    return renderer->flight.is_cut && renderer->arrival;
}

void frame_flight_deliver(struct renderer *renderer)
{
    if (frame_flight_is_cut(renderer))
        renderer->arrival->collect(renderer->arrival->context);
}

static void collect_between(void *context)
{
    struct renderer *renderer = context;
    if (renderer_wait(renderer, 0))
        collect_before(renderer);
}

void frame_flight_init(struct renderer *renderer)
{
    gpu_timeline_set_waiter(renderer->timeline, &(struct gpu_waiter){.context = renderer,
                                                                     .between = collect_between,
                                                                     .before = collect_before});
}

void frame_flight_finish(struct renderer *renderer)
{
    free(renderer->flight.plan);
    renderer->flight = (struct frame_flight){.frame = NULL};
}
