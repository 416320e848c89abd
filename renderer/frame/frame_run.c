/* SPDX-License-Identifier: MIT */
/* Walking a plan. A step is a function; which steps there are, and what they draw, the plan says.
 */
#include "renderer/frame/frame_run.h"

#include <assert.h>
#include <epoxy/gl.h>
#include <stdlib.h>

#include "renderer/frame/frame_budget.h"
#include "renderer/frame/frame_flight.h"
#include "renderer/frame/frame_overlay.h"
#include "renderer/frame/frame_pause.h"
#include "renderer/frame/frame_raytrace.h"
#include "renderer/frame/frame_shadows.h"
#include "renderer/frame/frame_textures.h"
#include "renderer/frame/light_batches.h"

enum {
    WINDOW_SIDE_MAX = 4096,
    WINDOW_PIXELS_MAX = 1 << 21,   /* 300 MB of 4x multisampled targets */
    WINDOW_PIXELS_LEAST = 1 << 10, /* none is made smaller for the budget */
    WINDOWS_MAX = 8192,
};

/* What the steps of one window share. */
struct window_run {
    const struct frame_run *run;
    struct window_frame frame;
    const struct window_budget *budget;
    struct kept_window keys; /* of what it will hold */
    bool is_counted;         /* its surfaces stand, and the sizes of its layers are on the device */
    bool must_split;         /* it holds more than one pass can, ... */
    uint64_t lacked_bytes;   /* ... or than the budget has room for: so many bytes of lists */
};

static bool needs(const struct frame_run *run, enum plan_need need)
{
    return run->frame_plan->plan.requirements[need].is_met;
}

/* ---- steps of the whole frame ---- */

static bool trace(const struct frame_run *run, struct error *err)
{
    const char *because = run->frame_plan->plan.requirements[PLAN_NEED_TRACED].because;
    uint8_t *levels;
    gpu_timeline_will_wait(run->renderer->timeline); /* rays take long */
    if (run->only_builds)
        return frame_raytrace_build(run, because, err);
    bool ok =
        frame_textures_plan_traced(run, &levels, err) && frame_raytrace(run, because, levels, err);
    free(levels);
    return ok;
}

/* Of this frame; NULL where shadows are in structures. */
static struct traced_shadows *rays_of(const struct frame_run *run)
{
    return needs(run, PLAN_NEED_TRACED_SHADOWS) ? &run->renderer->shadow_rays : NULL;
}

/* ---- steps of one window ---- */

static struct shade_desc shade_of(const struct window_run *window)
{
    struct renderer *renderer = window->run->renderer;
    return (struct shade_desc){
        .frame = &window->frame,
        .lists = renderer->lists,
        .shadows = renderer->shadows,
        .pixels = &renderer->pixels,
        .traced = rays_of(window->run),
    };
}

static bool draw_surfaces(struct window_run *window, struct error *err)
{
    struct kept_window *kept = &window->run->renderer->kept;
    struct frame_report *report = window->frame.report;
    if (content_key_equals(kept->surfaces, window->keys.surfaces)) {
        report->counts.gbuffers_reused += !window->is_counted;
        if (!window->is_counted)
            report_add_reused(report, "gbuffer");
        return true;
    }
    *kept = (struct kept_window){0};
    if (!geometry_draw_opaque(&window->frame, &window->run->frame_plan->items, err))
        return false;
    kept->surfaces = window->keys.surfaces;
    kept->has_lifts = window->run->frame_plan->shaders.lifts;
    report->counts.gbuffers_drawn++;
    return true;
}

/* Whether the sizes of lists may come with the picture, which is made again where one was guessed
 * too small. On our own processors reading them costs nothing; what reads lists on its way, or
 * draws over the picture, waits for the device anyway. */
bool frame_run_may_guess(const struct frame_run *run)
{
    return !run->only_builds && !gl_context_limits(run->renderer->context)->is_software &&
           !run->renderer->reads_sizes && needs(run, PLAN_NEED_COLOR) &&
           !needs(run, PLAN_NEED_AUXILIARY) && !needs(run, PLAN_NEED_OVERLAY) &&
           !needs(run, PLAN_NEED_TRACED_SHADOWS);
}

/* Windows whose lists are about as large from one frame to the next. */
static struct content_key window_key(const struct window_run *window)
{
    struct content_key key = content_key_begin();
    content_key_add_text(&key, window->run->scene->key);
    content_key_add(&key, &window->frame.window, sizeof window->frame.window);
    content_key_add_word(&key, (uint64_t)window->run->frame_plan->plan.target_samples);
    return key;
}

static bool find_sizes(const struct window_run *window, struct list_sizes *room)
{
    return frame_run_may_guess(window->run) &&
           list_history_find(&window->run->renderer->list_history, window_key(window), room);
}

static bool build_layers(struct window_run *window, struct error *err)
{
    struct renderer *renderer = window->run->renderer;
    struct frame_report *report = window->frame.report;
    struct list_sizes room;
    if (content_key_equals(renderer->kept.layers, window->keys.layers)) {
        report->counts.pixel_lists_reused++;
        report_add_reused(report, "transparency");
        if (!renderer->pixels.is_guessed)
            pixel_lists_report(&renderer->pixels, report);
        return true;
    }
    renderer->kept.layers = renderer->kept.counted = (struct content_key){{0}};
    bool is_known = find_sizes(window, &room);
    enum pixel_lists_outcome outcome =
        pixel_lists_build(&renderer->pixels, &window->frame, &window->run->frame_plan->items,
                          is_known ? &room : NULL, err);
    window->must_split = outcome == PIXEL_LISTS_TOO_MANY;
    window->lacked_bytes = renderer->pixels.lacked_bytes;
    if (outcome != PIXEL_LISTS_BUILT)
        return window->must_split;
    renderer->kept.layers = window->keys.layers;
    report->counts.pixel_lists_built++;
    if (!renderer->pixels.is_guessed)
        list_history_note(&renderer->list_history, window_key(window),
                          (struct list_sizes){.entries = renderer->pixels.entry_count,
                                              .longest = renderer->pixels.longest});
    return true;
}

/* Lists of another window must not be taken for those of one that has none. */
static void begin_window(struct window_run *window)
{
    const struct frame_run *run = window->run;
    struct renderer *renderer = run->renderer;
    window->keys = kept_window_keys(&(struct kept_window_desc){
        .placement = run->placement,
        .view = run->view,
        .state = run->state,
        .camera = run->camera,
        .window = &window->frame.window,
        .samples = run->frame_plan->plan.target_samples,
    });
    /* drawn for a frame without maps, the surfaces do not say where those are looked up */
    if (run->frame_plan->shaders.lifts && !renderer->kept.has_lifts)
        renderer->kept = (struct kept_window){0};
    bool is_kept = needs(run, PLAN_NEED_LAYERS) && !renderer->redraws_surfaces &&
                   (!renderer->pixels.is_guessed || frame_run_may_guess(run)) &&
                   content_key_equals(renderer->kept.layers, window->keys.layers);
    window->is_counted = needs(run, PLAN_NEED_LAYERS) && renderer->pixels.is_counted &&
                         content_key_equals(renderer->kept.counted, window->keys.layers) &&
                         content_key_equals(renderer->kept.surfaces, window->keys.surfaces);
    if (!is_kept && !window->is_counted) {
        pixel_lists_clear(&renderer->pixels);
        renderer->kept.layers = (struct content_key){{0}};
    }
    renderer->kept.image = (struct content_key){{0}};
    if (renderer->redraws_surfaces)
        renderer->kept = (struct kept_window){0};
}

static uint64_t pixels_of(const struct camera_window *window)
{
    return (uint64_t)window->width * (uint64_t)window->height;
}

static bool build_lights(struct window_run *window, struct error *err)
{
    const struct window_frame *frame = &window->frame;
    return light_lists_prepare(window->run->renderer->lists,
                               &(struct light_lists_desc){
                                   .technique = frame->view->quality.light_lists,
                                   .faithful = frame->view->quality.faithful,
                                   .lights = frame->state->lights,
                                   .light_count = frame->state->light_count,
                                   .camera = frame->camera,
                                   .window = &frame->window,
                                   .bounds = &window->run->frame_plan->reach.bounds,
                                   .limits = frame->limits,
                                   .rebuilds = window->run->renderer->redraws_surfaces,
                               },
                               frame->report, err);
}

static bool prepare_lights(struct window_run *window, struct error *err)
{
    const struct renderer *renderer = window->run->renderer;
    if (!build_lights(window, err))
        return false;
    window->must_split =
        !window_budget_continue(window->budget, window->run, pixels_of(&window->frame.window));
    if (window->must_split)
        window->lacked_bytes =
            light_lists_size_bytes(renderer->lists) + pixel_lists_size_bytes(&renderer->pixels);
    return true;
}

static bool collect_points(struct window_run *window, struct error *err)
{
    const struct renderer *renderer = window->run->renderer;
    if (!frame_shadows_collect(window->run, &window->frame, &window->must_split, err))
        return false;
    if (window->must_split && renderer->shadow_rays.lacked_bytes)
        window->lacked_bytes = renderer->shadow_rays.lacked_bytes +
                               light_lists_size_bytes(renderer->lists) +
                               pixel_lists_size_bytes(&renderer->pixels);
    return true;
}

static bool is_pause_due(const void *run)
{
    return frame_run_is_pause_due(run);
}

static bool serve_pause(const void *run, struct error *err)
{
    return frame_run_pause(run, true, err);
}

static bool shade(struct window_run *window, struct error *err)
{
    struct shade_desc desc = shade_of(window);
    const struct shade_pause pause = {
        .context = window->run, .is_due = is_pause_due, .serve = serve_pause};
    desc.pause = window->run->renderer->interlude ? &pause : NULL;
    desc.pace = window->run->pace;
    return light_batches_shade(window->run, &desc, err);
}

static bool read_color(struct window_run *window, struct error *err)
{
    struct renderer *renderer = window->run->renderer;
    const struct readback_guess guess = {.lists = pixel_lists_guess_of(&renderer->pixels),
                                         .sizes = &renderer->pixels.statistics,
                                         .history = &renderer->list_history,
                                         .key = window_key(window)};
    const struct readback_desc desc = {.frame = &window->frame,
                                       .color = &window->run->frame->outputs[VIEW_OUTPUT_COLOR],
                                       .guess = renderer->pixels.is_guessed ? &guess : NULL,
                                       .shadows = renderer->shadows,
                                       .shadow_frame = window->run->shadow_frame};
    return shade_send_color(&renderer->shade, renderer->readback, &desc, err);
}

static bool read_auxiliary(struct window_run *window, struct error *err)
{
    struct shade_desc desc = shade_of(window);
    return aov_read(&window->run->renderer->aov, &desc, window->run->frame->outputs, err);
}

/* ---- the walk ---- */

static const struct {
    bool (*of_frame)(const struct frame_run *run, struct error *err);
    bool (*of_window)(struct window_run *window, struct error *err);
} steps[PLAN_STEP_COUNT] = {
    [PLAN_STEP_TRACE] = {.of_frame = trace},
    [PLAN_STEP_SHADOWS] = {.of_frame = light_batches_prepare},
    [PLAN_STEP_RAYS] = {.of_frame = frame_shadows_begin},
    [PLAN_STEP_SURFACES] = {.of_window = draw_surfaces},
    [PLAN_STEP_LAYERS] = {.of_window = build_layers},
    [PLAN_STEP_LIGHT_LISTS] = {.of_window = prepare_lights},
    [PLAN_STEP_SHADOW_POINTS] = {.of_window = collect_points},
    [PLAN_STEP_SHADE] = {.of_window = shade},
    [PLAN_STEP_READ] = {.of_window = read_color},
    [PLAN_STEP_AUXILIARY] = {.of_window = read_auxiliary},
};

static bool upload_lights(const struct frame_run *run, struct error *err)
{
    struct renderer *renderer = run->renderer;
    return shade_upload_lights(&renderer->shade,
                               &(struct shade_lights_desc){.state = run->state,
                                                           .needs = &run->frame_plan->shaders,
                                                           .shadows = renderer->shadows,
                                                           .traced = rays_of(run),
                                                           .camera = run->camera},
                               err);
}

static bool has_step(const struct frame_run *run, enum plan_step step)
{
    const struct plan *plan = &run->frame_plan->plan;
    bool has = false;
    for (int i = 0; i < plan->pass_count; i++)
        has |= plan->passes[i].step == step;
    return has;
}

/* Passes of one step are neighbours: the step begins where the one before it was another. */
static bool begins_step(const struct plan *plan, int pass)
{
    return pass == 0 || plan->passes[pass].step != plan->passes[pass - 1].step;
}

static bool walk_frame(const struct frame_run *run, struct error *err)
{
    const struct plan *plan = &run->frame_plan->plan;
    for (int i = 0; i < plan->pass_count; i++) {
        enum plan_step step = plan->passes[i].step;
        if (begins_step(plan, i) && steps[step].of_frame && !steps[step].of_frame(run, err))
            return false;
    }
    return true;
}

/* What other frames replaced of the scene: the materials that are bound, levels of textures, and
 * what Embree's scene refers to. */
static bool put_back_scene(const struct frame_run *run, struct error *err)
{
    struct renderer *renderer = run->renderer;
    draw_arena_bind_materials(renderer->arena);
    if (!frame_textures_resume(renderer->textures, run, err))
        return false;
    if (rays_of(run) && renderer->shadow_rays.rays)
        raytrace_shadows_resume(renderer->shadow_rays.rays);
    return true;
}

/* The shadow structures, and the lights. */
static bool put_back_shadows(const struct frame_run *run, struct error *err)
{
    struct renderer *renderer = run->renderer;
    struct frame unseen = {0}; /* the report has all that from the first time */
    struct frame_run again = *run;
    if (!needs(run, PLAN_NEED_COLOR))
        return true;
    again.frame = &unseen;
    again.is_again = true;
    bool ok = shadow_system_prepare_none(renderer->shadows, run->state->light_count, err) &&
              (!has_step(run, PLAN_STEP_SHADOWS) || light_batches_prepare(&again, err)) &&
              upload_lights(run, err);
    run->frame->report.paused_ms += unseen.report.paused_ms;
    return ok;
}

bool frame_run_is_pause_due(const struct frame_run *run)
{
    const struct interlude *interlude = run->renderer->interlude;
    return interlude &&
           (frame_flight_is_cut(run->renderer) || interlude->is_due(interlude->context));
}

bool frame_run_pause(const struct frame_run *run, bool has_shadows, struct error *err)
{
    struct frame_pause pause = {.renderer = run->renderer, .report = &run->frame->report};
    const struct interlude interlude = frame_pause_interlude(&pause);
    const struct frame_textures *textures = run->renderer->textures;
    if (has_shadows && textures && textures->is_inexact) /* its maps are not for others */
        shadow_system_forget(run->renderer->shadows, resident_scene_shadow_key(run->scene));
    bool was_pinned = run->scene->is_pinned; /* by a frame that waits for this one */
    run->scene->is_pinned = true;
    bool is_wanted = interlude.serve(interlude.context);
    run->scene->is_pinned = was_pinned;
    if (!is_wanted)
        return error_set(err, ERROR_OVERLOADED, "the frame is not wanted any more");
    return put_back_scene(run, err) && (!has_shadows || put_back_shadows(run, err));
}

/* Lets other frames go first where they are due. */
static bool pause_frame(const struct frame_run *run, struct error *err)
{
    return !frame_run_is_pause_due(run) || frame_run_pause(run, true, err);
}

static bool walk_window(struct window_run *window, struct error *err)
{
    const struct plan *plan = &window->run->frame_plan->plan;
    for (int i = 0; i < plan->pass_count && !window->must_split; i++) {
        enum plan_step step = plan->passes[i].step;
        if (begins_step(plan, i) && steps[step].of_window &&
            (!pause_frame(window->run, err) || !steps[step].of_window(window, err)))
            return false;
    }
    return true;
}

static void read_sample_positions(const struct targets *targets, float positions[4][2])
{
    for (int i = 0; i < 4; i++)
        positions[i][0] = positions[i][1] = 0.5f;
    if (targets->samples < 2)
        return;
    glBindFramebuffer(GL_FRAMEBUFFER, targets->gbuffer.name);
    for (GLuint i = 0; i < 4; i++)
        glGetMultisamplefv(GL_SAMPLE_POSITION, i, positions[i]);
}

/* How a window ended. */
struct window_result {
    bool must_split;       /* more transparent fragments, or shadow rays, than one pass can hold, */
    uint64_t lacked_bytes; /* or, not 0, than the budget has room for: bytes of its lists */
};

static struct window_run window_of(const struct frame_run *run,
                                   const struct camera_window *rectangle)
{
    struct renderer *renderer = run->renderer;
    return (struct window_run){
        .run = run,
        .frame =
            {
                .programs = renderer->programs,
                .timeline = renderer->timeline,
                .limits = gl_context_limits(renderer->context),
                .view = run->view,
                .state = run->state,
                .gpu = run->scene->gpu,
                .arena = renderer->arena,
                .camera = run->camera,
                .window = *rectangle,
                .needs = &run->frame_plan->shaders,
                .targets = &renderer->targets,
                .report = &run->frame->report,
            },
    };
}

static bool prepare_targets(struct window_run *window, struct error *err)
{
    struct window_frame *frame = &window->frame;
    if (!targets_prepare(frame->targets, frame->window.width, frame->window.height,
                         window->run->frame_plan->plan.target_samples, err))
        return false;
    read_sample_positions(frame->targets, frame->sample_positions);
    begin_window(window);
    return true;
}

static bool run_window(const struct frame_run *run, const struct window_budget *budget,
                       const struct camera_window *rectangle, struct window_result *result,
                       struct error *err)
{
    struct renderer *renderer = run->renderer;
    struct window_run window = window_of(run, rectangle);
    window.budget = budget;
    window_budget_begin(budget, run, pixels_of(rectangle));
    if (!prepare_targets(&window, err) || !walk_window(&window, err))
        return false;
    *result = (struct window_result){window.must_split, window.lacked_bytes};
    if (!window.must_split)
        report_raise_bytes(&run->frame->report, "targets", targets_size_bytes(&renderer->targets));
    return window.must_split || gl_context_check(renderer->context, "rendering", err);
}

/* Halves, the one that is begun with, halves[1], no smaller than the other. */
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
    const struct gl_limits *limits = gl_context_limits(run->renderer->context);
    uint64_t words = 4, outputs = aov_pixel_bytes(run->view);
    uint64_t most = gl_limits_block(limits, words) - TARGETS_APART_HEAD_BYTES / words;
    uint64_t most_written = outputs ? gl_limits_block(limits, outputs) : most;
    most = most < most_written ? most : most_written;
    return most < WINDOW_PIXELS_MAX ? most : WINDOW_PIXELS_MAX;
}

static bool exceeds_device(const struct frame_run *run, const struct camera_window *w)
{
    return w->width > WINDOW_SIDE_MAX || w->height > WINDOW_SIDE_MAX ||
           pixels_of(w) > most_pixels(run);
}

/* Before anything of it is drawn. */
static bool is_too_large(const struct frame_run *run, const struct camera_window *w,
                         const struct window_budget *budget, bool *is_over_budget)
{
    uint64_t pixels = pixels_of(w);
    *is_over_budget = pixels > WINDOW_PIXELS_LEAST && !window_budget_has_room(budget, pixels);
    return *is_over_budget || exceeds_device(run, w);
}

static bool refuse_window(const struct frame_run *run, const struct window_budget *budget,
                          const struct camera_window *w, uint64_t lacked_bytes, struct error *err)
{
    if (lacked_bytes)
        return window_budget_refuse(budget, run, w, lacked_bytes, err);
    const struct gl_limits *limits = gl_context_limits(run->renderer->context);
    return error_set(err, ERROR_OVER_BUDGET,
                     "more than %llu transparent fragments, or %d shadow rays, in a window of "
                     "%dx%d pixels, for a storage block of %llu bytes",
                     (unsigned long long)pixel_lists_entries_max(limits), TRACED_FILTERS_MAX,
                     w->width, w->height, (unsigned long long)limits->max_storage_block_bytes);
}

/* A stack of windows. */
struct window_stack {
    struct camera_window windows[64]; /* halving from 16384^2 to one pixel takes 28 levels */
    int depth, rendered;
    bool is_for_budget; /* some are halves for want of memory */
};

static bool split_top(struct window_stack *stack, const struct camera_window *w)
{
    split_window(w, &stack->windows[stack->depth]);
    stack->depth += 2;
    assert(stack->depth < 62);
    return true;
}

/* Its share of the pixels. */
static void begin_window_piece(const struct frame_run *run, const struct window_stack *stack,
                               const struct camera_window *w)
{
    double all = (double)run->view->width_px * run->view->height_px;
    double own = (double)pixels_of(w), left = own;
    for (int i = 0; i < stack->depth; i++)
        left += (double)pixels_of(&stack->windows[i]);
    renderer_begin_piece(run->renderer, (struct frame_piece){.stage = FRAME_STAGE_SHADING,
                                                             .first = 1 - left / all,
                                                             .size = own / all});
}

/* The last window of the stack is rendered, or split where it is too large for one pass. */
static bool run_top(const struct frame_run *run, const struct window_budget *budget,
                    struct window_stack *stack, struct error *err)
{
    struct camera_window w = stack->windows[--stack->depth];
    struct window_result result = {0};
    bool is_over_budget;
    if (is_too_large(run, &w, budget, &is_over_budget)) {
        stack->is_for_budget |= is_over_budget;
        return split_top(stack, &w);
    }
    if (pixels_of(&w) * budget->pixel_bytes >= budget->bytes)
        return window_budget_refuse(budget, run, &w, 0, err);
    begin_window_piece(run, stack, &w);
    if (!run_window(run, budget, &w, &result, err))
        return false;
    stack->rendered += !result.must_split;
    if (!result.must_split)
        return true;
    stack->is_for_budget |= result.lacked_bytes > 0;
    uint64_t least = result.lacked_bytes ? WINDOW_PIXELS_LEAST : 1;
    if (pixels_of(&w) <= least || stack->rendered > WINDOWS_MAX)
        return refuse_window(run, budget, &w, result.lacked_bytes, err);
    return split_top(stack, &w);
}

static struct camera_window whole_of(const struct view *view)
{
    return (struct camera_window){
        0, 0, view->width_px, view->height_px, view->width_px, view->height_px};
}

static bool run_windows(const struct frame_run *run, struct error *err)
{
    const struct view *view = run->view;
    const struct window_budget budget = frame_budget_windows(run);
    struct window_stack stack = {.windows = {whole_of(view)}, .depth = 1};
    struct camera_window part = stack.windows[0]; /* the least, where there are as many as may be */
    part.height = (part.height + WINDOWS_MAX - 1) / WINDOWS_MAX;
    if (pixels_of(&part) > WINDOW_PIXELS_LEAST &&
        !window_budget_has_room(&budget, pixels_of(&part)))
        return window_budget_refuse(&budget, run, &part, 0, err);
    while (stack.depth)
        if (!run_top(run, &budget, &stack, err))
            return false;
    if (stack.is_for_budget)
        report_warn(&run->frame->report,
                    "the image was rendered in %d windows, to keep within the GPU budget of %llu "
                    "bytes",
                    stack.rendered, (unsigned long long)run->renderer->budget_bytes);
    else if (stack.rendered > 1)
        report_warn(&run->frame->report, "the image was rendered in %d windows", stack.rendered);
    if (stack.rendered == 1 && run->may_keep)
        run->renderer->kept.image = run->picture;
    return true;
}

/* Sizes of shadow lists that nobody knows are read while their structures are built, and those of
 * layers later on: counted before that, they come with the same wait. Where memory is short, or the
 * picture takes several windows, they have their own. On our own processors nothing waits. */
static bool may_count_ahead(const struct frame_run *run, const struct camera_window *whole)
{
    return !run->only_builds && !gl_context_limits(run->renderer->context)->is_software &&
           !run->renderer->redraws_surfaces && needs(run, PLAN_NEED_COLOR) &&
           needs(run, PLAN_NEED_LAYERS) && has_step(run, PLAN_STEP_SHADOWS) &&
           !exceeds_device(run, whole) && frame_budget_holds_all(run);
}

static bool count_ahead(const struct frame_run *run, struct error *err)
{
    struct renderer *renderer = run->renderer;
    const struct camera_window whole = whole_of(run->view);
    struct window_run window = window_of(run, &whole);
    struct list_sizes known;
    if (!may_count_ahead(run, &whole) || find_sizes(&window, &known))
        return true;
    if (!prepare_targets(&window, err))
        return false;
    if (window.is_counted || content_key_equals(renderer->kept.layers, window.keys.layers))
        return true;
    if (!draw_surfaces(&window, err) ||
        !pixel_lists_count(&renderer->pixels, &window.frame, &run->frame_plan->items, err))
        return false;
    renderer->kept.counted = window.keys.layers;
    return true;
}

static void warn_of_approximations(const struct frame_run *run)
{
    struct frame_report *report = &run->frame->report;
    if (!run->frame_plan->shaders.area_samples)
        frame_warn_of_areas(run->state, report);
    if (run->frame_plan->plan.samples == 1 && run->view->quality.samples == 4)
        report_warn(report, "the device cannot antialias transparent lists: 1 sample per pixel");
    if (run->frame_plan->plan.unfiltered_lights)
        report_warn(report,
                    "shadows %s: light passes transparent casters unchanged, of %zu of %zu lights; "
                    "deep filters it",
                    shadow_technique_name((int)run->view->quality.shadows),
                    run->frame_plan->plan.unfiltered_lights, run->state->light_count);
}

/* What steps rely on, whichever there are. */
static bool begin_rasterised(const struct frame_run *run, struct error *err)
{
    struct renderer *renderer = run->renderer;
    if (!draw_arena_begin(renderer->arena, run->state, err))
        return false;
    if (!needs(run, PLAN_NEED_COLOR))
        return true;
    warn_of_approximations(run);
    return shadow_system_prepare_none(renderer->shadows, run->state->light_count, err);
}

static bool is_rasterised(const struct frame_run *run)
{
    return needs(run, PLAN_NEED_COLOR) || needs(run, PLAN_NEED_AUXILIARY);
}

/* Over the picture, which must be there. */
static bool draw_over(const struct frame_run *run, struct error *err)
{
    struct renderer *renderer = run->renderer;
    gpu_timeline_will_wait(renderer->timeline);
    return readback_collect(renderer->readback, &run->frame->report, err) &&
           frame_overlay(run, err);
}

static bool is_picture_kept(const struct frame_run *run)
{
    const struct renderer *renderer = run->renderer;
    return run->may_keep && kept_picture_is(&renderer->kept_picture, run->picture) &&
           (!renderer->kept_picture.is_on_device ||
            content_key_equals(renderer->kept.image, run->picture));
}

/* The picture as it is before anything is drawn over it. Where a device has all of it in its own
 * memory it stays there; else it is waited for and copied. */
static bool keep_picture(const struct frame_run *run, struct error *err)
{
    struct renderer *renderer = run->renderer;
    struct kept_picture *kept = &renderer->kept_picture;
    if (!run->may_keep || (renderer->textures && renderer->textures->is_inexact) ||
        run->frame->report.compression.maps)
        return true;
    bool is_on_device = is_rasterised(run) && !gl_context_limits(renderer->context)->is_software;
    if (is_on_device && content_key_equals(renderer->kept.image, run->picture)) {
        kept_picture_note_on_device(kept, run->picture, &run->frame->report);
        return true;
    }
    if (is_on_device && !needs(run, PLAN_NEED_OVERLAY)) /* of several windows, for the screen */
        return true;
    gpu_timeline_will_wait(renderer->timeline);
    if (!readback_collect(renderer->readback, &run->frame->report, err))
        return false;
    kept_picture_note(kept, run->picture, &run->frame->outputs[VIEW_OUTPUT_COLOR],
                      &run->frame->report);
    return true;
}

/* The picture in the targets, which is on its way again. */
static bool send_kept(const struct frame_run *run, struct error *err)
{
    struct renderer *renderer = run->renderer;
    const struct camera_window whole = whole_of(run->view);
    const struct window_run window = window_of(run, &whole);
    return readback_send(renderer->readback,
                         &(struct readback_desc){.frame = &window.frame,
                                                 .color = &run->frame->outputs[VIEW_OUTPUT_COLOR]},
                         err);
}

static bool run_over_kept(const struct frame_run *run, struct error *err)
{
    const struct kept_picture *kept = &run->renderer->kept_picture;
    kept_picture_report(kept, &run->frame->report);
    if (!kept->is_on_device) {
        kept_picture_copy(kept, &run->frame->outputs[VIEW_OUTPUT_COLOR]);
        return !needs(run, PLAN_NEED_OVERLAY) || frame_overlay(run, err);
    }
    return send_kept(run, err) && (!needs(run, PLAN_NEED_OVERLAY) || draw_over(run, err));
}

static bool run_steps(const struct frame_run *run, struct error *err)
{
    const struct plan *plan = &run->frame_plan->plan;
    run->frame->report.counts.unseen_lights = plan->unseen_lights;
    if (is_rasterised(run) && (!begin_rasterised(run, err) || !count_ahead(run, err)))
        return false;
    if (!walk_frame(run, err))
        return false;
    if (run->only_builds)
        return gl_context_check(run->renderer->context, "building structures", err);
    if (needs(run, PLAN_NEED_COLOR) && !upload_lights(run, err))
        return false;
    return (!is_rasterised(run) || run_windows(run, err)) && keep_picture(run, err) &&
           (!needs(run, PLAN_NEED_OVERLAY) || draw_over(run, err));
}

/* What the frame may hold; making room for it may cost the picture that the device keeps. */
static bool begin(const struct frame_run *run, struct frame_textures *textures, bool *is_kept,
                  struct error *err)
{
    *is_kept = is_picture_kept(run);
    if (*is_kept) {
        frame_budget_begin(run);
        *is_kept = is_picture_kept(run);
    }
    if (*is_kept)
        return true;
    if (is_rasterised(run) && !frame_textures_begin(textures, run, err))
        return false;
    frame_budget_begin(run);
    return true;
}

bool frame_run(const struct frame_run *run, struct error *err)
{
    struct frame_textures textures = {.key_count = 0};
    bool is_kept = false;
    run->renderer->textures = &textures;
    bool ok = begin(run, &textures, &is_kept, err);
    ok = ok && (is_kept ? run_over_kept(run, err) : run_steps(run, err));
    shadow_system_end_frame(run->renderer->shadows, run->shadow_frame);
    frame_textures_end(&textures, run);
    run->renderer->textures = NULL;
    if (rays_of(run))
        frame_shadows_end(run);
    frame_budget_end(run);
    return ok;
}
