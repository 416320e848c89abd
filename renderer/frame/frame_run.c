/* SPDX-License-Identifier: MIT */
/* Runs a plan. Each kind of step is a function; the plan says which steps there are, and what they
 * draw. */
#include "renderer/frame/frame_run.h"

#include <assert.h>
#include <stdlib.h>

#include "renderer/frame/frame_in_flight.h"
#include "renderer/frame/frame_overlay.h"
#include "renderer/frame/frame_yield.h"
#include "renderer/frame/frame_raytrace.h"
#include "renderer/frame/frame_shadows.h"
#include "renderer/frame/frame_textures.h"
#include "renderer/frame/frame_warnings.h"
#include "renderer/frame/light_batches.h"
#include "renderer/frame/window_run.h"

enum {
    WINDOW_SIDE_MAX = 4096,
    WINDOW_PIXELS_MAX = 1 << 21,   /* 300 MB of 4x multisampled targets */
    WINDOW_PIXELS_LEAST = 1 << 10, /* none is made smaller for the budget */
    WINDOWS_MAX = 8192,
};

/* ---- steps of the whole frame ---- */

static bool trace(const struct frame_run *run, struct error *err)
{
    const char *because = run->frame_plan->plan.requirements[PLAN_NEED_TRACED].because;
    uint8_t *levels;
    gpu_timeline_will_wait(run->context->renderer->timeline); /* rays take long */
    if (run->only_builds)
        return frame_raytrace_build(run, because, err);
    bool ok =
        frame_textures_plan_traced(run, &levels, err) && frame_raytrace(run, because, levels, err);
    free(levels);
    return ok;
}

bool frame_run_is_rasterised(const struct frame_run *run)
{
    return frame_run_needs(run, PLAN_NEED_COLOR) || frame_run_needs(run, PLAN_NEED_AUXILIARY);
}

struct traced_shadows *frame_run_rays(const struct frame_run *run)
{
    return frame_run_needs(run, PLAN_NEED_TRACED_SHADOWS) ? &run->context->shadow_rays : NULL;
}

bool frame_run_starts_rays(const struct frame_run *run)
{
    return frame_run_needs(run, PLAN_NEED_TRACED_SHADOWS) ||
           frame_run_needs(run, PLAN_NEED_VISIBILITY);
}

/* Whether the sizes of lists may come with the picture, which is made again where one was guessed
 * too small. On our own processors reading them costs nothing; what reads lists on its way, or
 * draws over the picture, waits for the device anyway. */
bool frame_run_may_guess(const struct frame_run *run)
{
    return !run->only_builds && !gl_context_limits(run->context->renderer->gl)->is_software &&
           !run->context->reads_sizes && frame_run_needs(run, PLAN_NEED_COLOR) &&
           run->frame_plan->plan.rounds == 1 && !frame_run_needs(run, PLAN_NEED_AUXILIARY) &&
           !frame_run_needs(run, PLAN_NEED_DEEP) && !frame_run_needs(run, PLAN_NEED_OVERLAY) &&
           !frame_run_starts_rays(run);
}

/* ---- the walk ---- */

static bool (*const steps[PLAN_STEP_COUNT])(const struct frame_run *run, struct error *err) = {
    [PLAN_STEP_TRACE] = trace,
    [PLAN_STEP_SHADOWS] = light_batches_prepare,
    [PLAN_STEP_RAYS] = frame_shadows_begin,
};

bool frame_run_upload_lights(const struct frame_run *run, struct error *err)
{
    struct frame_context *context = run->context;
    struct renderer *renderer = context->renderer;
    return shade_upload_lights(
        &context->shade,
        &(struct shade_lights_desc){.state = run->state,
                                    .needs = &run->frame_plan->shaders,
                                    .shadows = renderer->shadows,
                                    .traced = frame_run_rays(run),
                                    .has_shadows = run->view->quality.shadows != SHADOWS_NONE,
                                    .camera = run->camera},
        err);
}

static bool walk_frame(const struct frame_run *run, struct error *err)
{
    const struct plan *plan = &run->frame_plan->plan;
    for (int i = 0; i < plan->pass_count; i++) {
        enum plan_step step = plan->passes[i].step;
        if (!plan_begins_step(plan, i) || !steps[step])
            continue;
        frame_in_flight_poll(run->context->renderer);
        if (!steps[step](run, err))
            return false;
    }
    return true;
}

/* Splits a window into halves. halves[1], which is drawn first, is no smaller than the other. */
static void split_window(const struct camera_window *w, struct camera_window halves[2])
{
    halves[0] = halves[1] = *w;
    if (w->height >= w->width) {
        halves[0].height = w->height / 2;
        halves[1].y += halves[0].height;
        halves[1].height -= halves[0].height;
    } else {
        halves[0].width = w->width / 2;
        halves[1].x += halves[0].width;
        halves[1].width -= halves[0].width;
    }
}

/* Counts of lists, heads of traced points and words of outputs have a storage block each. */
static uint64_t most_pixels(const struct frame_run *run)
{
    const struct gl_limits *limits = gl_context_limits(run->context->renderer->gl);
    uint64_t words = 4, outputs = aov_pixel_bytes(run->view);
    uint64_t most = gl_limits_block(limits, words) - TARGETS_APART_HEAD_BYTES / words;
    uint64_t most_written = outputs ? gl_limits_block(limits, outputs) : most;
    most = most < most_written ? most : most_written;
    return most < WINDOW_PIXELS_MAX ? most : WINDOW_PIXELS_MAX;
}

static bool exceeds_device(const struct frame_run *run, const struct camera_window *w)
{
    return w->width > WINDOW_SIDE_MAX || w->height > WINDOW_SIDE_MAX ||
           camera_window_pixels(w) > most_pixels(run);
}

/* Whether the window is too large, judged before anything of it is drawn. */
static bool is_too_large(const struct frame_run *run, const struct camera_window *w,
                         const struct window_budget *budget, bool *is_over_budget)
{
    uint64_t pixels = camera_window_pixels(w);
    *is_over_budget = pixels > WINDOW_PIXELS_LEAST && !window_budget_has_room(budget, pixels);
    return *is_over_budget || exceeds_device(run, w);
}

static bool refuse_window(const struct frame_run *run, const struct window_budget *budget,
                          const struct camera_window *w, uint64_t missing_bytes, struct error *err)
{
    if (missing_bytes)
        return window_budget_refuse(budget, run, w, missing_bytes, err);
    const struct gl_limits *limits = gl_context_limits(run->context->renderer->gl);
    return error_set(err, ERROR_OVER_BUDGET,
                     "more than %llu transparent fragments, or %d shadow rays, in a window of "
                     "%dx%d pixels, for a storage block of %llu bytes",
                     (unsigned long long)pixel_lists_entries_max(limits), TRACED_FILTERS_MAX,
                     w->width, w->height, (unsigned long long)limits->max_storage_block_bytes);
}

/* A stack of windows. */
struct window_stack {
    struct camera_window windows[64]; /* halving from 65536^2 to one pixel takes 32 levels */
    int depth, rendered;
    bool is_for_budget; /* some windows were split for want of memory */
};

static bool split_top(struct window_stack *stack, const struct camera_window *w)
{
    split_window(w, &stack->windows[stack->depth]);
    stack->depth += 2;
    assert(stack->depth < 62);
    return true;
}

/* The pixels of the image that are in the window. */
static double pixels_shown(const struct frame_run *run, const struct camera_window *w)
{
    const struct window_share share = window_share_of(w, run->view);
    return share.width > 0 && share.height > 0 ? (double)share.width * share.height : 0;
}

/* Progress counts a window by its share of the pixels. */
static void begin_window_span(const struct frame_run *run, const struct window_stack *stack,
                              const struct camera_window *w)
{
    const struct view_tile tile = view_tile_of(run->view);
    double all = (double)tile.width_px * tile.height_px;
    double own = pixels_shown(run, w), left = own;
    for (int i = 0; i < stack->depth; i++)
        left += pixels_shown(run, &stack->windows[i]);
    frame_context_begin_span(run->context, (struct progress_span){.stage = FRAME_STAGE_SHADING,
                                                                  .first = 1 - left / all,
                                                                  .size = own / all});
}

/* The last window of the stack is rendered, or split where it is too large for one pass. Those of a
 * tile are those of the whole picture, so that it has the same bits: others are left out. */
static bool run_top(const struct frame_run *run, const struct window_budget *budget,
                    struct window_stack *stack, struct error *err)
{
    struct camera_window w = stack->windows[--stack->depth];
    struct window_result result = {0};
    bool is_over_budget;
    if (pixels_shown(run, &w) <= 0)
        return true;
    if (is_too_large(run, &w, budget, &is_over_budget)) {
        stack->is_for_budget |= is_over_budget;
        return split_top(stack, &w);
    }
    if (camera_window_pixels(&w) * budget->pixel_bytes >= budget->bytes)
        return window_budget_refuse(budget, run, &w, 0, err);
    begin_window_span(run, stack, &w);
    if (!window_run(run, budget, &w, &result, err))
        return false;
    stack->rendered += !result.overflows;
    if (!result.overflows)
        return true;
    stack->is_for_budget |= result.missing_bytes > 0;
    uint64_t least = result.missing_bytes ? WINDOW_PIXELS_LEAST : 1;
    if (camera_window_pixels(&w) <= least || stack->rendered > WINDOWS_MAX)
        return refuse_window(run, budget, &w, result.missing_bytes, err);
    return split_top(stack, &w);
}

static struct camera_window whole_of(const struct view *view)
{
    return camera_window_whole(view->width_px, view->height_px);
}

static bool run_windows(const struct frame_run *run, struct error *err)
{
    const struct view *view = run->view;
    const struct window_budget budget = frame_budget_windows(run);
    struct window_stack stack = {.windows = {whole_of(view)}, .depth = 1};
    struct camera_window part = stack.windows[0]; /* the least, where there are as many as may be */
    part.width = view_tile_of(view).width_px;
    part.height = view_tile_of(view).height_px;
    part.height = (part.height + WINDOWS_MAX - 1) / WINDOWS_MAX;
    if (camera_window_pixels(&part) > WINDOW_PIXELS_LEAST &&
        !window_budget_has_room(&budget, camera_window_pixels(&part)))
        return window_budget_refuse(&budget, run, &part, 0, err);
    while (stack.depth)
        if (!run_top(run, &budget, &stack, err))
            return false;
    if (stack.is_for_budget)
        report_warn(&run->frame->report,
                    "the image was rendered in %d windows, to keep within the GPU budget of %llu "
                    "bytes",
                    stack.rendered, (unsigned long long)run->context->renderer->budget_bytes);
    else if (stack.rendered > 1)
        report_warn(&run->frame->report, "the image was rendered in %d windows", stack.rendered);
    if (stack.rendered == 1 && run->may_keep)
        run->context->cached.image = run->picture;
    return true;
}

/* Sizes of shadow lists that nobody knows are read while their structures are built, and those of
 * layers later on: counted before that, they come with the same wait. Where memory is short, or the
 * picture takes several windows, they have their own. On our own processors nothing waits. */
static bool may_count_ahead(const struct frame_run *run, const struct camera_window *whole)
{
    return !run->only_builds && !gl_context_limits(run->context->renderer->gl)->is_software &&
           !run->context->renderer->redraws_surfaces && frame_run_needs(run, PLAN_NEED_COLOR) &&
           frame_run_needs(run, PLAN_NEED_LAYERS) &&
           plan_has_step(&run->frame_plan->plan, PLAN_STEP_SHADOWS) &&
           !exceeds_device(run, whole) && frame_budget_holds_all(run);
}

static bool count_ahead(const struct frame_run *run, struct error *err)
{
    const struct camera_window whole = whole_of(run->view);
    return !may_count_ahead(run, &whole) || window_run_count(run, &whole, err);
}

static bool prepare_grids(const struct frame_run *run, struct error *err)
{
    struct content_key key = content_key_begin();
    content_key_add_text(&key, run->scene->key);
    return smoke_prepare(&run->context->smoke, key, run->state, run->camera, err);
}

/* Prepares what all steps of a rasterised frame rely on. */
static bool begin_rasterised(const struct frame_run *run, struct error *err)
{
    struct frame_context *context = run->context;
    struct renderer *renderer = context->renderer;
    if (!draw_arena_begin(context->arena, run->state, err))
        return false;
    bool has_color = frame_run_needs(run, PLAN_NEED_COLOR);
    bool are_summed = run->view->outputs & 1u << VIEW_OUTPUT_OPTICAL_DEPTH;
    if ((has_color || are_summed) && !prepare_grids(run, err))
        return false;
    if (!has_color)
        return true;
    return shadow_system_prepare_none(renderer->shadows, run->state->light_count, err);
}

/* Draws overlays over the picture, which must be complete. */
static bool draw_over(const struct frame_run *run, struct error *err)
{
    struct renderer *renderer = run->context->renderer;
    gpu_timeline_will_wait(renderer->timeline);
    return readback_collect(renderer->readback, &run->frame->report, err) &&
           frame_overlay(run, err);
}

static bool is_picture_kept(const struct frame_run *run)
{
    const struct frame_context *context = run->context;
    return run->may_keep && image_cache_has(&context->image_cache, run->picture) &&
           (!context->image_cache.is_on_device ||
            content_key_equals(context->cached.image, run->picture));
}

/* The picture as it is before anything is drawn over it. Where a device has all of it in its own
 * memory it stays there; else it is waited for and copied. */
static bool keep_picture(const struct frame_run *run, struct error *err)
{
    struct frame_context *context = run->context;
    struct renderer *renderer = context->renderer;
    struct image_cache *kept = &context->image_cache;
    if (!run->may_keep || run->textures->is_inexact || run->frame->report.compression.maps)
        return true;
    bool is_on_device =
        frame_run_is_rasterised(run) && !gl_context_limits(renderer->gl)->is_software;
    if (is_on_device && content_key_equals(context->cached.image, run->picture)) {
        image_cache_store_on_device(kept, run->picture, &run->frame->report);
        return true;
    }
    /* of several windows, for the screen */
    if (is_on_device && !frame_run_needs(run, PLAN_NEED_OVERLAY))
        return true;
    gpu_timeline_will_wait(renderer->timeline);
    if (!readback_collect(renderer->readback, &run->frame->report, err))
        return false;
    image_cache_store(kept, run->picture, &run->frame->outputs[VIEW_OUTPUT_COLOR],
                      &run->frame->report);
    return true;
}

/* Reads back the cached picture in the render targets once more. */
static bool send_kept(const struct frame_run *run, struct error *err)
{
    struct renderer *renderer = run->context->renderer;
    const struct camera_window whole = whole_of(run->view);
    const struct window_frame frame = window_frame_of(run, &whole);
    return readback_send(
        renderer->readback,
        &(struct readback_desc){.frame = &frame, .color = &run->frame->outputs[VIEW_OUTPUT_COLOR]},
        err);
}

static bool run_over_kept(const struct frame_run *run, struct error *err)
{
    const struct image_cache *kept = &run->context->image_cache;
    image_cache_report(kept, &run->frame->report);
    if (!kept->is_on_device) {
        image_cache_copy(kept, &run->frame->outputs[VIEW_OUTPUT_COLOR]);
        return !frame_run_needs(run, PLAN_NEED_OVERLAY) || frame_overlay(run, err);
    }
    return send_kept(run, err) && (!frame_run_needs(run, PLAN_NEED_OVERLAY) || draw_over(run, err));
}

static bool run_steps(const struct frame_run *run, struct error *err)
{
    const struct plan *plan = &run->frame_plan->plan;
    run->frame->report.counts.unseen_lights = plan->unseen_lights;
    run->frame->report.has_layers = plan->requirements[PLAN_NEED_LAYERS].is_met;
    run->frame->report.layer_needs = plan->layer_needs;
    if (frame_run_needs(run, PLAN_NEED_COLOR))
        run->frame->report.counts.rounds = (uint64_t)plan->rounds;
    frame_warn(run);
    if (frame_run_is_rasterised(run) && (!begin_rasterised(run, err) || !count_ahead(run, err)))
        return false;
    if (!walk_frame(run, err))
        return false;
    if (run->only_builds)
        return gl_context_check(run->context->renderer->gl, "building structures", err);
    if (frame_run_needs(run, PLAN_NEED_COLOR) && !frame_run_upload_lights(run, err))
        return false;
    return (!frame_run_is_rasterised(run) || run_windows(run, err)) && keep_picture(run, err) &&
           (!frame_run_needs(run, PLAN_NEED_OVERLAY) || draw_over(run, err));
}

/* Makes room for the frame, which may evict the cached picture from the device. */
static bool begin(const struct frame_run *run, bool *is_kept, struct error *err)
{
    *is_kept = is_picture_kept(run);
    if (*is_kept) {
        frame_budget_begin(run);
        *is_kept = is_picture_kept(run);
    }
    if (*is_kept)
        return true;
    if (frame_run_is_rasterised(run) && !frame_textures_begin(run->textures, run, err))
        return false;
    frame_budget_begin(run);
    return true;
}

bool frame_run(const struct frame_run *desc, struct error *err)
{
    struct frame_textures textures = {.key_count = 0};
    struct frame_run own = *desc;
    const struct frame_run *run = &own;
    bool is_kept = false;
    own.textures = &textures;
    bool ok = begin(run, &is_kept, err);
    if (ok && !is_kept && frame_run_needs(run, PLAN_NEED_COLOR) && run->environment->environment) {
        own.environment_maps =
            environment_cache_maps(run->context->renderer, run->environment, err);
        ok = own.environment_maps;
    }
    ok = ok && (is_kept ? run_over_kept(run, err) : run_steps(run, err));
    shadow_system_end_frame(run->context->renderer->shadows, run->shadow_frame);
    frame_textures_end(&textures, run);
    if (frame_run_starts_rays(run))
        frame_shadows_end(run);
    frame_budget_end(run);
    return ok;
}
