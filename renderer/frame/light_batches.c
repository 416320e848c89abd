/* SPDX-License-Identifier: MIT */
/* Choosing batches of lights, and running them. */
#include "renderer/frame/light_batches.h"

#include <stdlib.h>
#include <string.h>

#include "renderer/window/apart.h"

/* What must be the same for batches of one frame to fit in the next. */
static struct content_key key_of(const char *scene_key, const struct view *view,
                                 const struct scene_state *state)
{
    const struct view_quality *quality = &view->quality;
    struct content_key key = content_key_begin();
    content_key_add_text(&key, scene_key);
    content_key_add(&key, &state->light_count, sizeof state->light_count);
    content_key_add(&key, &quality->shadow_resolution, sizeof quality->shadow_resolution);
    content_key_add(&key, &quality->shadows, sizeof quality->shadows);
    return key;
}

static struct content_key key_of_run(const struct frame_run *run)
{
    return key_of(run->scene->key, run->view, run->state);
}

static bool is_due(const void *run)
{
    return frame_run_is_pause_due(run);
}

static void tell_shadows(const void *context, double share)
{
    const struct frame_run *run = context;
    renderer_tell(run->renderer, FRAME_STAGE_SHADOWS, share);
}

/* In several calls where others go first in between. Batches take each other's place, so that their
 * sizes are read. */
static bool prepare_shadows(const struct frame_run *run, const bool *is_left_out,
                            struct frame_report *report, struct error *err)
{
    bool may_guess = !is_left_out && frame_run_may_guess(run);
    struct shadow_progress progress = {
        .context = run,
        .is_due = is_due,
        .first_count = band_pace_first(&run->pace, BAND_SHADOWS, 0),
    };
    struct shadow_prepare_desc desc = {
        .scene_key = resident_scene_shadow_key(run->scene),
        .gpu = run->scene->gpu,
        .state = run->state,
        .arena = run->renderer->arena,
        .quality = &run->view->quality,
        .needs = &run->frame_plan->shadows,
        .is_left_out = is_left_out,
        .progress = run->renderer->interlude ? &progress : NULL,
        .frame = may_guess ? run->shadow_frame : 0,
        .is_again = run->is_again,
        .advance = is_left_out || run->is_again ? NULL : tell_shadows,
        .advance_context = run,
    };
    memcpy(desc.eye, run->camera->eye, sizeof desc.eye);
    camera_axes(run->camera, desc.eye_axes);
    do
        if (!shadow_system_prepare(run->renderer->shadows, &desc, report, err))
            return false;
    while (progress.is_interrupted && frame_run_pause(run, false, err));
    return !progress.is_interrupted;
}

bool light_batches_prepare(const struct frame_run *run, struct error *err)
{
    struct light_batches *batches = &run->renderer->batches;
    const struct shadow_needs *needs = &run->frame_plan->shadows;
    struct content_key key = key_of_run(run);
    struct error failure = {0};
    size_t structures = 0;
    uint64_t share_bytes = run->renderer->use.shadow_bytes;
    if (!content_key_equals(batches->key, key) || share_bytes > batches->share_bytes)
        *batches = (struct light_batches){.key = key};
    batches->share_bytes = share_bytes;
    if (batches->most)
        return true;
    if (prepare_shadows(run, NULL, &run->frame->report, &failure)) {
        run->frame->report.counts.light_batches = 1;
        return true;
    }
    for (size_t i = 0; i < needs->light_count; i++)
        structures += needs->lights[i].has_structure;
    if (failure.code != ERROR_OVER_BUDGET || structures < 2)
        return error_pass(err, &failure);
    batches->most = structures / 2;
    return shadow_system_prepare_none(run->renderer->shadows, run->state->light_count, err);
}

struct batch {
    const uint32_t *order; /* of all lights, as the light lists have them */
    bool *is_left_out;     /* per light of the state */
    size_t light_count;
    size_t first, end;        /* in that order */
    size_t structures;        /* that it needs */
    struct frame_piece whole; /* all batches of the window */
};

/* Of what shade_window was asked for. */
struct shade_part {
    struct renderer *renderer;
    struct frame_piece piece;
};

static void advance(const void *context, double first, double size)
{
    const struct shade_part *part = context;
    renderer_begin_piece(part->renderer, frame_piece_part(part->piece, first, size));
}

/* As many lights from `first` on as may have their structures at once; at least one. */
static void choose_end(struct batch *batch, const struct frame_run *run)
{
    uint64_t bytes = 0, budget_bytes = shadow_system_budget_bytes(run->renderer->shadows);
    int resolution =
        shadow_resolution(&run->view->quality, gl_context_limits(run->renderer->context));
    batch->structures = 0;
    for (batch->end = batch->first; batch->end < batch->light_count; batch->end++) {
        const struct shadow_need *need = &run->frame_plan->shadows.lights[batch->order[batch->end]];
        if (!need->has_structure)
            continue;
        bytes += shadow_need_least_bytes(need, resolution);
        if (batch->structures &&
            (batch->structures == run->renderer->batches.most || bytes > budget_bytes))
            break;
        batch->structures++;
    }
    memset(batch->is_left_out, true, batch->light_count);
    for (size_t i = batch->first; i < batch->end; i++)
        batch->is_left_out[batch->order[i]] = false;
}

/* Into the frame's report: what the structures of a batch are. Those of the first window stand for
 * all; what was built counts for each. */
static void add_report(const struct frame_report *part, bool is_first_window,
                       struct frame_report *report)
{
    report->counts.shadow_maps_built += part->counts.shadow_maps_built;
    report->counts.shadow_draws += part->counts.shadow_draws;
    report->counts.shadow_culled += part->counts.shadow_culled;
    report->counts.shadow_maps_reused += part->counts.shadow_maps_reused;
    if (!is_first_window)
        return;
    double lists =
        report->counts.mean_list > 0 ? (double)report->counts.events / report->counts.mean_list : 0;
    lists += part->counts.mean_list > 0 ? (double)part->counts.events / part->counts.mean_list : 0;
    report->counts.shadowed_lights += part->counts.shadowed_lights;
    report->counts.events += part->counts.events;
    report->counts.mean_list = lists > 0 ? (double)report->counts.events / lists : 0;
    if (part->counts.longest_list > report->counts.longest_list)
        report->counts.longest_list = part->counts.longest_list;
    for (int i = 0; i < part->byte_count; i++)
        report_raise_bytes(report, part->bytes[i].structure, part->bytes[i].bytes);
    for (int i = 0; i < part->reused_count; i++)
        report_add_reused(report, part->reused[i]);
    for (int i = 0; i < part->warning_count; i++)
        report_warn(report, "%s", part->warnings[i]);
}

/* Makes the structures of the lights from batch->first on, fewer at a time until they fit. */
static bool prepare_batch(struct batch *batch, const struct frame_run *run,
                          struct frame_report *part, struct error *err)
{
    for (;;) {
        struct error failure = {0};
        *part = (struct frame_report){0};
        choose_end(batch, run);
        if (prepare_shadows(run, batch->is_left_out, part, &failure))
            return true;
        if (failure.code != ERROR_OVER_BUDGET || batch->structures < 2)
            return error_pass(err, &failure);
        run->renderer->batches.most = batch->structures / 2;
    }
}

static bool upload_lights(const struct batch *batch, const struct frame_run *run, struct error *err)
{
    struct renderer *renderer = run->renderer;
    return shade_upload_lights(&renderer->shade,
                               &(struct shade_lights_desc){.state = run->state,
                                                           .needs = &run->frame_plan->shaders,
                                                           .shadows = renderer->shadows,
                                                           .camera = run->camera,
                                                           .is_left_out = batch->is_left_out},
                               err);
}

/* A pause while lights shine, whose structures others may have driven out. */
struct lights_pause {
    const struct frame_run *run;
    const struct shade_pause *outer;
    const struct batch *batch; /* NULL: all lights at once */
    bool *must_restart;        /* set where they no longer fit: with fewer of them */
};

static bool is_pause_due(const void *context)
{
    const struct lights_pause *pause = context;
    return pause->outer->is_due(pause->outer->context);
}

static bool serve_pause(const void *context, struct error *err)
{
    const struct lights_pause *pause = context;
    const struct batch *batch = pause->batch;
    struct frame_report unseen = {0}; /* the report has all that from the first time */
    struct error failure = {0};
    if (!pause->outer->serve(pause->outer->context, err))
        return false;
    if (prepare_shadows(pause->run, batch->is_left_out, &unseen, &failure))
        return upload_lights(batch, pause->run, err);
    *pause->must_restart = failure.code == ERROR_OVER_BUDGET && batch->structures >= 2;
    if (*pause->must_restart)
        pause->run->renderer->batches.most = batch->structures / 2;
    return error_pass(err, &failure);
}

/* What a window counted, as it was before its first batch; but what was built was built. */
static void restore_report(struct frame_report *report, const struct frame_report *before)
{
    uint64_t built = report->counts.shadow_maps_built;
    report->counts = before->counts;
    report->counts.shadow_maps_built = built;
    report->byte_count = before->byte_count;
    report->reused_count = before->reused_count;
    report->warning_count = before->warning_count;
}

/* Lights the window with the lights from batch->first on. Must_restart: with fewer structures at
 * once than the batches before it, or its own beginning; from the first light on, then, so that
 * sums are those of later frames, to the bit. */
static bool run_batch(struct batch *batch, const struct frame_run *run,
                      const struct shade_desc *desc, bool is_first_window, bool *must_restart,
                      struct error *err)
{
    struct renderer *renderer = run->renderer;
    struct frame_report *report = &run->frame->report, part;
    struct error failure = {0};
    struct shade_desc place = *desc;
    size_t most = renderer->batches.most;
    const struct lights_pause in_batch = {
        .run = run, .outer = desc->pause, .batch = batch, .must_restart = must_restart};
    const struct shade_pause pause = {
        .context = &in_batch, .is_due = is_pause_due, .serve = serve_pause};
    const double lights = (double)batch->light_count, first = (double)batch->first / lights;
    struct shade_part made = {renderer, frame_piece_part(batch->whole, first, 0)};
    *must_restart = false;
    renderer_begin_piece(renderer, made.piece);
    if (!prepare_batch(batch, run, &part, err))
        return false;
    made.piece = frame_piece_part(batch->whole, first, (double)batch->end / lights - first);
    *must_restart = batch->first > 0 && renderer->batches.most < most;
    if (*must_restart) {
        report->counts.shadow_maps_built += part.counts.shadow_maps_built;
        return true;
    }
    add_report(&part, is_first_window, report);
    place.is_continued = batch->first > 0;
    place.continues = batch->end < batch->light_count;
    place.pause = desc->pause ? &pause : NULL;
    place.advance = advance;
    place.advance_context = &made;
    return (upload_lights(batch, run, &failure) &&
            shade_window(&renderer->shade, &place, &failure)) ||
           *must_restart || error_pass(err, &failure);
}

static bool run_batches(struct batch *batch, const struct frame_run *run,
                        const struct shade_desc *desc, struct error *err)
{
    struct frame_report *report = &run->frame->report;
    bool is_first_window = report->counts.light_batches == 0, must_restart = false;
    const struct frame_report before = *report;
    uint64_t count = 0;
    batch->whole = run->renderer->piece;
    for (batch->first = 0; batch->first < batch->light_count; batch->first = batch->end) {
        if (!run_batch(batch, run, desc, is_first_window, &must_restart, err))
            return false;
        count++;
        if (must_restart) {
            restore_report(report, &before);
            batch->end = 0;
            count = 0;
        }
    }
    if (is_first_window) {
        report->counts.light_batches = count;
        report_warn(report,
                    "the shadows of %llu lights exceed their budget of %llu bytes together: made "
                    "and used in %llu batches",
                    (unsigned long long)report->counts.shadowed_lights,
                    (unsigned long long)shadow_system_budget_bytes(run->renderer->shadows),
                    (unsigned long long)count);
    }
    return true;
}

/* Samples that are shaded apart need all structures again: which they are all lights tell. */
static bool run_all(struct batch *batch, const struct frame_run *run, const struct shade_desc *desc,
                    struct error *err)
{
    struct renderer *renderer = run->renderer;
    const struct frame_piece whole = renderer->piece;
    struct shade_desc apart = *desc;
    if (!apart_is_possible(desc->frame))
        return run_batches(batch, run, desc, err);
    renderer_begin_piece(renderer, frame_piece_part(whole, 0, 0.6));
    if (!run_batches(batch, run, desc, err))
        return false;
    renderer_begin_piece(renderer, frame_piece_part(whole, 0.6, 0.4));
    apart.is_apart = true;
    return !apart_count(desc->frame) || run_batches(batch, run, &apart, err);
}

static bool needs_batches(const struct frame_run *run)
{
    const struct light_batches *batches = &run->renderer->batches;
    return batches->most && run->frame_plan->plan.least_batches &&
           content_key_equals(batches->key, key_of_run(run));
}

/* All lights at once: where there is no room for them together any more, they come in batches. */
static bool serve_whole_pause(const void *context, struct error *err)
{
    const struct lights_pause *pause = context;
    if (!pause->outer->serve(pause->outer->context, err))
        return false;
    *pause->must_restart = needs_batches(pause->run);
    return !*pause->must_restart ||
           error_set(err, ERROR_OVER_BUDGET, "shadow structures no longer fit together");
}

/* Must_batch: the window is to be lit once more, in batches. */
static bool shade_whole(const struct frame_run *run, const struct shade_desc *desc,
                        bool *must_batch, struct error *err)
{
    struct shade_desc place = *desc;
    struct error failure = {0};
    const struct lights_pause in_whole = {
        .run = run, .outer = desc->pause, .must_restart = must_batch};
    const struct shade_pause pause = {
        .context = &in_whole, .is_due = is_pause_due, .serve = serve_whole_pause};
    uint64_t *slices = &run->frame->report.counts.light_slices, slices_before = *slices;
    const struct shade_part made = {run->renderer, run->renderer->piece};
    place.pause = desc->pause ? &pause : NULL;
    place.advance = advance;
    place.advance_context = &made;
    *must_batch = false;
    bool ok = shade_window(&run->renderer->shade, &place, &failure);
    run->renderer->piece = made.piece;
    if (*must_batch)
        *slices = slices_before; /* they come again */
    return ok || *must_batch || error_pass(err, &failure);
}

/* The structures of all lights stood at first: batches count them again. */
static void forget_whole(struct frame_report *report)
{
    if (report->counts.light_batches != 1)
        return;
    report->counts.light_batches = report->counts.shadowed_lights = 0;
    report->counts.events = report->counts.longest_list = 0;
    report->counts.mean_list = 0;
}

bool light_batches_shade(const struct frame_run *run, const struct shade_desc *desc,
                         struct error *err)
{
    bool must_batch = needs_batches(run);
    if (!must_batch && !shade_whole(run, desc, &must_batch, err))
        return false;
    if (!must_batch)
        return true;
    forget_whole(&run->frame->report);
    shadow_system_untell_sizes(run->renderer->shadows, run->shadow_frame);
    size_t count = run->state->light_count;
    uint32_t *order = calloc(count + 1, sizeof *order);
    bool *is_left_out = calloc(count + 1, sizeof *is_left_out);
    struct batch batch = {.order = order, .is_left_out = is_left_out, .light_count = count};
    bool ok = order && is_left_out;
    if (!ok)
        error_set(err, ERROR_NO_MEMORY, "batches of %zu lights", count);
    else
        light_lists_order(run->renderer->lists, count, order);
    ok = ok && run_all(&batch, run, desc, err);
    free(order);
    free(is_left_out);
    return ok;
}

bool light_batches_are_known(const struct renderer *renderer, const char *scene_key,
                             const struct view *view, const struct scene_state *state,
                             const struct frame_plan *plan)
{
    size_t structures = 0;
    for (size_t i = 0; i < plan->shadows.light_count; i++)
        structures += plan->shadows.lights[i].has_structure;
    return renderer->batches.most && structures > renderer->batches.most &&
           content_key_equals(renderer->batches.key, key_of(scene_key, view, state));
}
