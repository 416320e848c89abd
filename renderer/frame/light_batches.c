/* SPDX-License-Identifier: MIT */
/* Chooses batches of lights, and runs them. */
#include "renderer/frame/light_batches.h"

#include <stdlib.h>
#include <string.h>

#include "renderer/frame/frame_yield.h"
#include "renderer/window/apart.h"

/* The key of frames in which batches of the same size fit. */
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

static void tell_shadows(const void *context, double share)
{
    const struct frame_run *run = context;
    frame_context_tell(run->context, FRAME_STAGE_SHADOWS, share);
}

/* Each batch replaces the one before, so the sizes of its structures are read. */
static bool prepare_shadows(const struct frame_run *run, const bool *is_left_out,
                            struct frame_report *report, struct error *err)
{
    bool may_guess = !is_left_out && frame_run_may_guess(run);
    const struct yield_point yield = frame_yield_point_of_shadows(run);
    struct shadow_prepare_desc desc = {
        .scene_key = resident_scene_shadow_key(run->scene),
        .gpu = run->scene->gpu,
        .state = run->state,
        .arena = run->context->arena,
        .grids = {.records = &run->context->smoke.record_view,
                  .bricks = &run->context->smoke.brick_view,
                  .values = &run->context->smoke.value_view},
        .quality = &run->view->quality,
        .needs = &run->frame_plan->shadows,
        .is_left_out = is_left_out,
        .yield = frame_yield_if_any(run, &yield),
        .first_count = time_slice_pace_first(&run->pace, TIME_SLICE_SHADOWS, 0),
        .frame = may_guess ? run->shadow_frame : 0,
        .is_again = run->is_again,
        .advance = is_left_out || run->is_again ? NULL : tell_shadows,
        .advance_context = run,
    };
    memcpy(desc.eye, run->camera->eye, sizeof desc.eye);
    camera_axes(run->camera, desc.eye_axes);
    return shadow_system_prepare(run->context->renderer->shadows, &desc, report, err);
}

bool light_batches_prepare(const struct frame_run *run, struct error *err)
{
    struct light_batches *batches = &run->context->batches;
    const struct shadow_needs *needs = &run->frame_plan->shadows;
    struct content_key key = key_of_run(run);
    struct error failure = {0};
    size_t structures = 0;
    uint64_t share_bytes = run->context->use.shadow_bytes;
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
    return shadow_system_prepare_none(run->context->renderer->shadows, run->state->light_count,
                                      err);
}

struct batch {
    const uint32_t *order; /* of all lights, as the light lists have them */
    bool *is_left_out;     /* per light of the state */
    size_t light_count;
    size_t first, end;          /* in that order */
    size_t structures;          /* that it needs */
    struct progress_span whole; /* all batches of the window */
};

/* The part of the frame whose progress a call of shade_window reports. */
struct shade_part {
    struct frame_context *context;
    struct progress_span span;
};

static void advance(const void *context, double first, double size)
{
    const struct shade_part *part = context;
    frame_context_begin_span(part->context, progress_span_part(part->span, first, size));
}

/* Chooses as many lights from `first` on as may have their structures at once; at least one. */
static void choose_end(struct batch *batch, const struct frame_run *run)
{
    uint64_t bytes = 0, budget_bytes = shadow_system_budget_bytes(run->context->renderer->shadows);
    int resolution =
        shadow_resolution(&run->view->quality, gl_context_limits(run->context->renderer->gl));
    batch->structures = 0;
    for (batch->end = batch->first; batch->end < batch->light_count; batch->end++) {
        const struct shadow_need *need = &run->frame_plan->shadows.lights[batch->order[batch->end]];
        if (!need->has_structure)
            continue;
        bytes += shadow_need_least_bytes(need, resolution);
        if (batch->structures &&
            (batch->structures == run->context->batches.most || bytes > budget_bytes))
            break;
        batch->structures++;
    }
    memset(batch->is_left_out, true, batch->light_count);
    for (size_t i = batch->first; i < batch->end; i++)
        batch->is_left_out[batch->order[i]] = false;
}

/* Adds the structures of a batch to the frame's report. Those of the first window stand for all
 * windows; what was built counts for each. */
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
    report_add_partitions(report, &part->partitions);
}

/* Builds the structures of the lights from batch->first on, of fewer lights until they fit. */
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
        run->context->batches.most = batch->structures / 2;
    }
}

static bool upload_lights(const struct batch *batch, const struct frame_run *run, struct error *err)
{
    struct frame_context *context = run->context;
    struct renderer *renderer = context->renderer;
    return shade_upload_lights(
        &context->shade,
        &(struct shade_lights_desc){.state = run->state,
                                    .needs = &run->frame_plan->shaders,
                                    .shadows = renderer->shadows,
                                    .has_shadows = run->view->quality.shadows != SHADOWS_NONE,
                                    .camera = run->camera,
                                    .is_left_out = batch->is_left_out},
        err);
}

/* Yield points of shading. Urgent frames may evict the structures of the lights meanwhile. */
struct lights_yield {
    const struct frame_run *run;
    const struct yield_point *outer;
    const struct batch *batch; /* NULL: all lights at once */
    bool *must_restart;        /* set if they no longer fit, so that fewer lights are taken */
};

static bool should_yield(void *context)
{
    const struct lights_yield *lights = context;
    return yield_point_is_due(lights->outer);
}

static bool run_urgent_in_batch(void *context, struct error *err)
{
    const struct lights_yield *lights = context;
    const struct batch *batch = lights->batch;
    struct frame_report discarded = {0}; /* the report has counted these the first time */
    struct error failure = {0};
    if (!yield_point_run(lights->outer, err))
        return false;
    if (prepare_shadows(lights->run, batch->is_left_out, &discarded, &failure))
        return upload_lights(batch, lights->run, err);
    *lights->must_restart = failure.code == ERROR_OVER_BUDGET && batch->structures >= 2;
    if (*lights->must_restart)
        lights->run->context->batches.most = batch->structures / 2;
    return error_pass(err, &failure);
}

/* Restores the counts of a window to those before its first batch, but not the structures built. */
static void restore_report(struct frame_report *report, const struct frame_report *before)
{
    uint64_t built = report->counts.shadow_maps_built;
    report->counts = before->counts;
    report->counts.shadow_maps_built = built;
    report->byte_count = before->byte_count;
    report->reused_count = before->reused_count;
    report->warning_count = before->warning_count;
    report->partitions = before->partitions;
}

/* Lights the window with the lights from batch->first on. Must_restart: with fewer structures at
 * once than the batches before it, or its own beginning; from the first light on, then, so that
 * sums are those of later frames, to the bit. */
static bool run_batch(struct batch *batch, const struct frame_run *run,
                      const struct shade_desc *desc, bool is_first_window, bool *must_restart,
                      struct error *err)
{
    struct frame_context *context = run->context;
    struct frame_report *report = &run->frame->report, part;
    struct error failure = {0};
    struct shade_desc place = *desc;
    size_t most = context->batches.most;
    struct lights_yield in_batch = {
        .run = run, .outer = desc->yield, .batch = batch, .must_restart = must_restart};
    const struct yield_point yield = {
        .context = &in_batch, .should_yield = should_yield, .run_urgent = run_urgent_in_batch};
    const double lights = (double)batch->light_count, first = (double)batch->first / lights;
    struct shade_part made = {context, progress_span_part(batch->whole, first, 0)};
    *must_restart = false;
    frame_context_begin_span(context, made.span);
    if (!prepare_batch(batch, run, &part, err))
        return false;
    made.span = progress_span_part(batch->whole, first, (double)batch->end / lights - first);
    *must_restart = batch->first > 0 && context->batches.most < most;
    if (*must_restart) {
        report->counts.shadow_maps_built += part.counts.shadow_maps_built;
        return true;
    }
    add_report(&part, is_first_window, report);
    place.is_continued = batch->first > 0;
    place.continues = batch->end < batch->light_count;
    place.yield = desc->yield ? &yield : NULL;
    place.advance = advance;
    place.advance_context = &made;
    return (upload_lights(batch, run, &failure) &&
            shade_window(&context->shade, &place, &failure)) ||
           *must_restart || error_pass(err, &failure);
}

static bool run_batches(struct batch *batch, const struct frame_run *run,
                        const struct shade_desc *desc, struct error *err)
{
    struct frame_report *report = &run->frame->report;
    bool is_first_window = report->counts.light_batches == 0, must_restart = false;
    const struct frame_report before = *report;
    uint64_t count = 0;
    batch->whole = run->context->span;
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
        shadow_system_warn(report);
        report_warn(report,
                    "the shadows of %llu lights exceed their budget of %llu bytes together: made "
                    "and used in %llu batches",
                    (unsigned long long)report->counts.shadowed_lights,
                    (unsigned long long)shadow_system_budget_bytes(run->context->renderer->shadows),
                    (unsigned long long)count);
    }
    return true;
}

/* Samples that are shaded apart need all structures again: which they are all lights tell. */
static bool run_all(struct batch *batch, const struct frame_run *run, const struct shade_desc *desc,
                    struct error *err)
{
    struct frame_context *context = run->context;
    const struct progress_span whole = context->span;
    struct shade_desc apart = *desc;
    if (!apart_is_possible(desc->frame))
        return run_batches(batch, run, desc, err);
    frame_context_begin_span(context, progress_span_part(whole, 0, 0.6));
    if (!run_batches(batch, run, desc, err))
        return false;
    frame_context_begin_span(context, progress_span_part(whole, 0.6, 0.4));
    apart.is_apart = true;
    return !apart_count(desc->frame) || run_batches(batch, run, &apart, err);
}

static bool needs_batches(const struct frame_run *run)
{
    const struct light_batches *batches = &run->context->batches;
    return batches->most && run->frame_plan->plan.least_batches &&
           content_key_equals(batches->key, key_of_run(run));
}

/* Runs urgent frames while all lights are lit at once. If their structures do not fit any more
 * afterwards, the lights come in batches. */
static bool run_urgent_in_whole(void *context, struct error *err)
{
    const struct lights_yield *lights = context;
    if (!yield_point_run(lights->outer, err))
        return false;
    *lights->must_restart = needs_batches(lights->run);
    return !*lights->must_restart ||
           error_set(err, ERROR_OVER_BUDGET, "shadow structures no longer fit together");
}

/* Must_batch: the window is to be lit once more, in batches. */
static bool shade_whole(const struct frame_run *run, const struct shade_desc *desc,
                        bool *must_batch, struct error *err)
{
    struct shade_desc place = *desc;
    struct error failure = {0};
    struct lights_yield in_whole = {.run = run, .outer = desc->yield, .must_restart = must_batch};
    const struct yield_point yield = {
        .context = &in_whole, .should_yield = should_yield, .run_urgent = run_urgent_in_whole};
    uint64_t *chunks = &run->frame->report.counts.light_chunks, chunks_before = *chunks;
    const struct shade_part made = {run->context, run->context->span};
    place.yield = desc->yield ? &yield : NULL;
    place.advance = advance;
    place.advance_context = &made;
    *must_batch = false;
    bool ok = shade_window(&run->context->shade, &place, &failure);
    run->context->span = made.span;
    if (*must_batch)
        *chunks = chunks_before; /* the window is shaded again */
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
    shadow_system_untell_sizes(run->context->renderer->shadows, run->shadow_frame);
    size_t count = run->state->light_count;
    uint32_t *order = calloc(count + 1, sizeof *order);
    bool *is_left_out = calloc(count + 1, sizeof *is_left_out);
    struct batch batch = {.order = order, .is_left_out = is_left_out, .light_count = count};
    bool ok = order && is_left_out;
    if (!ok)
        error_set(err, ERROR_NO_MEMORY, "batches of %zu lights", count);
    else
        light_lists_order(run->context->lists, count, order);
    ok = ok && run_all(&batch, run, desc, err);
    free(order);
    free(is_left_out);
    return ok;
}

bool light_batches_are_known(const struct frame_context *context, const char *scene_key,
                             const struct view *view, const struct scene_state *state,
                             const struct frame_plan *plan)
{
    size_t structures = 0;
    for (size_t i = 0; i < plan->shadows.light_count; i++)
        structures += plan->shadows.lights[i].has_structure;
    return context->batches.most && structures > context->batches.most &&
           content_key_equals(context->batches.key, key_of(scene_key, view, state));
}
