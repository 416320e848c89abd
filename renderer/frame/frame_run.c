/* SPDX-License-Identifier: MIT */
/* Runs a plan. Each kind of step is a function; the plan says which steps there are, and what they
 * draw. */
#include "renderer/frame/frame_run.h"

#include <assert.h>
#include <epoxy/gl.h>
#include <stdlib.h>

#include "renderer/frame/frame_budget.h"
#include "renderer/frame/frame_in_flight.h"
#include "renderer/frame/frame_overlay.h"
#include "renderer/frame/frame_yield.h"
#include "renderer/frame/frame_raytrace.h"
#include "renderer/frame/frame_shadows.h"
#include "renderer/frame/frame_textures.h"
#include "renderer/frame/frame_warnings.h"
#include "renderer/frame/light_batches.h"

enum {
    WINDOW_SIDE_MAX = 4096,
    WINDOW_PIXELS_MAX = 1 << 21,   /* 300 MB of 4x multisampled targets */
    WINDOW_PIXELS_LEAST = 1 << 10, /* none is made smaller for the budget */
    WINDOWS_MAX = 8192,
};

/* The state that the steps of one window share. */
struct window_run {
    const struct frame_run *run;
    struct window_frame frame;
    const struct window_budget *budget;
    struct window_cache_keys keys; /* of what it will hold */
    bool is_counted;        /* its surfaces stand, and the sizes of its layers are on the device */
    bool overflows;         /* the window holds more than one pass can draw, ... */
    uint64_t missing_bytes; /* ... or more than fits the budget: so many bytes of lists */
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
    return needs(run, PLAN_NEED_COLOR) || needs(run, PLAN_NEED_AUXILIARY);
}

struct traced_shadows *frame_run_rays(const struct frame_run *run)
{
    return needs(run, PLAN_NEED_TRACED_SHADOWS) ? &run->context->shadow_rays : NULL;
}

/* ---- steps of one window ---- */

static struct shade_desc shade_of(const struct window_run *window)
{
    struct frame_context *context = window->run->context;
    struct renderer *renderer = context->renderer;
    return (struct shade_desc){
        .frame = &window->frame,
        .lists = context->lists,
        .shadows = renderer->shadows,
        .layers = &context->layers,
        .traced = frame_run_rays(window->run),
    };
}

static bool draw_surfaces(struct window_run *window, struct error *err)
{
    struct window_cache_keys *kept = &window->run->context->cached;
    struct frame_report *report = window->frame.report;
    if (content_key_equals(kept->surfaces, window->keys.surfaces)) {
        report->counts.gbuffers_reused += !window->is_counted;
        if (!window->is_counted)
            report_add_reused(report, "gbuffer");
        return true;
    }
    *kept = (struct window_cache_keys){0};
    if (!geometry_draw_opaque(&window->frame, &window->run->frame_plan->items, err))
        return false;
    kept->surfaces = window->keys.surfaces;
    kept->has_normal_offsets = window->run->frame_plan->shaders.has_normal_offset;
    report->counts.gbuffers_drawn++;
    return true;
}

/* Whether the sizes of lists may come with the picture, which is made again where one was guessed
 * too small. On our own processors reading them costs nothing; what reads lists on its way, or
 * draws over the picture, waits for the device anyway. */
bool frame_run_may_guess(const struct frame_run *run)
{
    return !run->only_builds && !gl_context_limits(run->context->renderer->gl)->is_software &&
           !run->context->reads_sizes && needs(run, PLAN_NEED_COLOR) &&
           !needs(run, PLAN_NEED_AUXILIARY) && !needs(run, PLAN_NEED_OVERLAY) &&
           !needs(run, PLAN_NEED_TRACED_SHADOWS);
}

/* The key of windows whose lists have about the same size from one frame to the next. */
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
           list_history_find(&window->run->context->list_history, window_key(window), room);
}

static bool build_layers(struct window_run *window, struct error *err)
{
    struct frame_context *context = window->run->context;
    struct frame_report *report = window->frame.report;
    struct list_sizes room;
    if (content_key_equals(context->cached.layers, window->keys.layers)) {
        report->counts.pixel_lists_reused++;
        report_add_reused(report, "transparency");
        if (!context->layers.is_guessed)
            context->layers.method->report(&context->layers, report);
        return true;
    }
    context->cached.layers = context->cached.counted = (struct content_key){{0}};
    bool is_known = find_sizes(window, &room);
    enum layers_outcome outcome =
        context->layers.method->find(&context->layers, &window->frame,
                                     &window->run->frame_plan->items, is_known ? &room : NULL, err);
    window->overflows = outcome == LAYERS_TOO_MANY;
    window->missing_bytes = context->layers.missing_bytes;
    if (outcome != LAYERS_FOUND)
        return window->overflows;
    context->cached.layers = window->keys.layers;
    report->counts.pixel_lists_built++;
    if (!context->layers.is_guessed)
        list_history_note(&context->list_history, window_key(window),
                          (struct list_sizes){.entries = context->layers.entry_count,
                                              .longest = context->layers.longest});
    return true;
}

/* Lists of another window must not be taken for those of one that has none. */
static void begin_window(struct window_run *window)
{
    const struct frame_run *run = window->run;
    struct frame_context *context = run->context;
    struct renderer *renderer = context->renderer;
    window->keys = window_cache_keys_of(&(struct window_cache_desc){
        .placement = run->placement,
        .view = run->view,
        .state = run->state,
        .camera = run->camera,
        .window = &window->frame.window,
        .samples = run->frame_plan->plan.target_samples,
    });
    /* drawn for a frame without maps, the surfaces do not say where those are looked up */
    if (run->frame_plan->shaders.has_normal_offset && !context->cached.has_normal_offsets)
        context->cached = (struct window_cache_keys){0};
    if (layers_change_method(&context->layers, run->frame_plan->plan.transparency))
        context->cached.layers = context->cached.counted = (struct content_key){{0}};
    bool is_kept = needs(run, PLAN_NEED_LAYERS) && !renderer->redraws_surfaces &&
                   (!context->layers.is_guessed || frame_run_may_guess(run)) &&
                   content_key_equals(context->cached.layers, window->keys.layers);
    window->is_counted = needs(run, PLAN_NEED_LAYERS) && context->layers.is_counted &&
                         content_key_equals(context->cached.counted, window->keys.layers) &&
                         content_key_equals(context->cached.surfaces, window->keys.surfaces);
    if (!is_kept && !window->is_counted) {
        layers_clear(&context->layers);
        context->cached.layers = (struct content_key){{0}};
    }
    context->cached.image = (struct content_key){{0}};
    if (renderer->redraws_surfaces)
        context->cached = (struct window_cache_keys){0};
}

static uint64_t pixels_of(const struct camera_window *window)
{
    return (uint64_t)window->width * (uint64_t)window->height;
}

static bool build_lights(struct window_run *window, struct error *err)
{
    const struct window_frame *frame = &window->frame;
    return light_lists_prepare(window->run->context->lists,
                               &(struct light_lists_desc){
                                   .technique = frame->view->quality.light_lists,
                                   .faithful = frame->view->quality.faithful,
                                   .lights = frame->state->lights,
                                   .light_count = frame->state->light_count,
                                   .camera = frame->camera,
                                   .window = &frame->window,
                                   .bounds = &window->run->frame_plan->reach.bounds,
                                   .limits = frame->limits,
                                   .rebuilds = window->run->context->renderer->redraws_surfaces,
                               },
                               frame->report, err);
}

static bool prepare_lights(struct window_run *window, struct error *err)
{
    const struct frame_context *context = window->run->context;
    if (!build_lights(window, err))
        return false;
    window->overflows =
        !window_budget_continue(window->budget, window->run, pixels_of(&window->frame.window));
    if (window->overflows)
        window->missing_bytes =
            light_lists_size_bytes(context->lists) + layers_size_bytes(&context->layers);
    return true;
}

static bool collect_points(struct window_run *window, struct error *err)
{
    const struct frame_context *context = window->run->context;
    if (!frame_shadows_collect(window->run, &window->frame, &window->overflows, err))
        return false;
    if (window->overflows && context->shadow_rays.missing_bytes)
        window->missing_bytes = context->shadow_rays.missing_bytes +
                                light_lists_size_bytes(context->lists) +
                                layers_size_bytes(&context->layers);
    return true;
}

static bool shade(struct window_run *window, struct error *err)
{
    struct shade_desc desc = shade_of(window);
    const struct yield_point yield = frame_yield_point(window->run);
    desc.yield = frame_yield_if_any(window->run, &yield);
    desc.pace = window->run->pace;
    return light_batches_shade(window->run, &desc, err);
}

static bool read_color(struct window_run *window, struct error *err)
{
    struct frame_context *context = window->run->context;
    struct renderer *renderer = context->renderer;
    const struct readback_guess guess = {.lists = pixel_lists_guess_of(&context->layers),
                                         .sizes = &context->layers.lists.statistics,
                                         .history = &context->list_history,
                                         .key = window_key(window)};
    const struct readback_desc desc = {.frame = &window->frame,
                                       .color = &window->run->frame->outputs[VIEW_OUTPUT_COLOR],
                                       .guess = context->layers.is_guessed ? &guess : NULL,
                                       .shadows = renderer->shadows,
                                       .shadow_frame = window->run->shadow_frame};
    return shade_send_color(&context->shade, renderer->readback, &desc, err);
}

static bool read_auxiliary(struct window_run *window, struct error *err)
{
    struct shade_desc desc = shade_of(window);
    return aov_read(&window->run->context->aov, &desc, window->run->frame->outputs, err);
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

bool frame_run_upload_lights(const struct frame_run *run, struct error *err)
{
    struct frame_context *context = run->context;
    struct renderer *renderer = context->renderer;
    return shade_upload_lights(&context->shade,
                               &(struct shade_lights_desc){.state = run->state,
                                                           .needs = &run->frame_plan->shaders,
                                                           .shadows = renderer->shadows,
                                                           .traced = frame_run_rays(run),
                                                           .camera = run->camera},
                               err);
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
        if (!begins_step(plan, i) || !steps[step].of_frame)
            continue;
        frame_in_flight_poll(run->context->renderer);
        if (!steps[step].of_frame(run, err))
            return false;
    }
    return true;
}

/* Yields between two passes if an urgent frame waits. */
static bool yield_if_due(const struct frame_run *run, struct error *err)
{
    const struct yield_point point = frame_yield_point(run);
    return !yield_point_is_due(&point) || yield_point_run(&point, err);
}

static bool walk_window(struct window_run *window, struct error *err)
{
    const struct plan *plan = &window->run->frame_plan->plan;
    for (int i = 0; i < plan->pass_count && !window->overflows; i++) {
        enum plan_step step = plan->passes[i].step;
        if (!begins_step(plan, i) || !steps[step].of_window)
            continue;
        frame_in_flight_poll(window->run->context->renderer);
        if (!yield_if_due(window->run, err) || !steps[step].of_window(window, err))
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
    bool overflows; /* it has more transparent fragments or shadow rays than one pass can draw, */
    uint64_t missing_bytes; /* or, if not 0, than fit the budget: bytes of its lists */
};

static struct window_run window_of(const struct frame_run *run,
                                   const struct camera_window *rectangle)
{
    struct frame_context *context = run->context;
    struct renderer *renderer = context->renderer;
    return (struct window_run){
        .run = run,
        .frame =
            {
                .programs = renderer->programs,
                .timeline = renderer->timeline,
                .limits = gl_context_limits(renderer->gl),
                .view = run->view,
                .state = run->state,
                .gpu = run->scene->gpu,
                .arena = context->arena,
                .camera = run->camera,
                .window = *rectangle,
                .needs = &run->frame_plan->shaders,
                .targets = &context->targets,
                .report = &run->frame->report,
                .environment = run->environment,
                .environment_maps = run->environment_maps,
            },
    };
}

static bool prepare_targets(struct window_run *window, struct error *err)
{
    struct window_frame *frame = &window->frame;
    const struct plan *plan = &window->run->frame_plan->plan;
    const struct targets_desc desc = {
        .width = frame->window.width,
        .height = frame->window.height,
        .samples = plan->target_samples,
        .lobes = plan->lobes,
    };
    if (!targets_prepare(frame->targets, &desc, err))
        return false;
    read_sample_positions(frame->targets, frame->sample_positions);
    begin_window(window);
    return true;
}

static bool run_window(const struct frame_run *run, const struct window_budget *budget,
                       const struct camera_window *rectangle, struct window_result *result,
                       struct error *err)
{
    struct frame_context *context = run->context;
    struct renderer *renderer = context->renderer;
    struct window_run window = window_of(run, rectangle);
    window.budget = budget;
    window_budget_begin(budget, run, pixels_of(rectangle));
    if (!prepare_targets(&window, err) || !walk_window(&window, err))
        return false;
    *result = (struct window_result){window.overflows, window.missing_bytes};
    if (!window.overflows)
        report_raise_bytes(&run->frame->report, "targets", targets_size_bytes(&context->targets));
    return window.overflows || gl_context_check(renderer->gl, "rendering", err);
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
           pixels_of(w) > most_pixels(run);
}

/* Whether the window is too large, judged before anything of it is drawn. */
static bool is_too_large(const struct frame_run *run, const struct camera_window *w,
                         const struct window_budget *budget, bool *is_over_budget)
{
    uint64_t pixels = pixels_of(w);
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
    struct camera_window windows[64]; /* halving from 16384^2 to one pixel takes 28 levels */
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

/* Progress counts a window by its share of the pixels. */
static void begin_window_span(const struct frame_run *run, const struct window_stack *stack,
                              const struct camera_window *w)
{
    double all = (double)run->view->width_px * run->view->height_px;
    double own = (double)pixels_of(w), left = own;
    for (int i = 0; i < stack->depth; i++)
        left += (double)pixels_of(&stack->windows[i]);
    frame_context_begin_span(run->context, (struct progress_span){.stage = FRAME_STAGE_SHADING,
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
    begin_window_span(run, stack, &w);
    if (!run_window(run, budget, &w, &result, err))
        return false;
    stack->rendered += !result.overflows;
    if (!result.overflows)
        return true;
    stack->is_for_budget |= result.missing_bytes > 0;
    uint64_t least = result.missing_bytes ? WINDOW_PIXELS_LEAST : 1;
    if (pixels_of(&w) <= least || stack->rendered > WINDOWS_MAX)
        return refuse_window(run, budget, &w, result.missing_bytes, err);
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
           !run->context->renderer->redraws_surfaces && needs(run, PLAN_NEED_COLOR) &&
           needs(run, PLAN_NEED_LAYERS) &&
           plan_has_step(&run->frame_plan->plan, PLAN_STEP_SHADOWS) &&
           !exceeds_device(run, whole) && frame_budget_holds_all(run);
}

static bool count_ahead(const struct frame_run *run, struct error *err)
{
    struct frame_context *context = run->context;
    const struct camera_window whole = whole_of(run->view);
    struct window_run window = window_of(run, &whole);
    struct list_sizes known;
    if (!may_count_ahead(run, &whole) || find_sizes(&window, &known))
        return true;
    if (!prepare_targets(&window, err))
        return false;
    if (window.is_counted || content_key_equals(context->cached.layers, window.keys.layers))
        return true;
    if (!draw_surfaces(&window, err) ||
        !context->layers.method->count(&context->layers, &window.frame, &run->frame_plan->items,
                                       err))
        return false;
    context->cached.counted = window.keys.layers;
    return true;
}

/* Prepares what all steps of a rasterised frame rely on. */
static bool begin_rasterised(const struct frame_run *run, struct error *err)
{
    struct frame_context *context = run->context;
    struct renderer *renderer = context->renderer;
    if (!draw_arena_begin(context->arena, run->state, err))
        return false;
    frame_warn_of_transparency(run);
    if (!needs(run, PLAN_NEED_COLOR))
        return true;
    frame_warn_of_approximations(run);
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
    if (is_on_device && !needs(run, PLAN_NEED_OVERLAY)) /* of several windows, for the screen */
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
    const struct window_run window = window_of(run, &whole);
    return readback_send(renderer->readback,
                         &(struct readback_desc){.frame = &window.frame,
                                                 .color = &run->frame->outputs[VIEW_OUTPUT_COLOR]},
                         err);
}

static bool run_over_kept(const struct frame_run *run, struct error *err)
{
    const struct image_cache *kept = &run->context->image_cache;
    image_cache_report(kept, &run->frame->report);
    if (!kept->is_on_device) {
        image_cache_copy(kept, &run->frame->outputs[VIEW_OUTPUT_COLOR]);
        return !needs(run, PLAN_NEED_OVERLAY) || frame_overlay(run, err);
    }
    return send_kept(run, err) && (!needs(run, PLAN_NEED_OVERLAY) || draw_over(run, err));
}

static bool run_steps(const struct frame_run *run, struct error *err)
{
    const struct plan *plan = &run->frame_plan->plan;
    run->frame->report.counts.unseen_lights = plan->unseen_lights;
    if (frame_run_is_rasterised(run) && (!begin_rasterised(run, err) || !count_ahead(run, err)))
        return false;
    if (!walk_frame(run, err))
        return false;
    if (run->only_builds)
        return gl_context_check(run->context->renderer->gl, "building structures", err);
    if (needs(run, PLAN_NEED_COLOR) && !frame_run_upload_lights(run, err))
        return false;
    return (!frame_run_is_rasterised(run) || run_windows(run, err)) && keep_picture(run, err) &&
           (!needs(run, PLAN_NEED_OVERLAY) || draw_over(run, err));
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
    if (ok && !is_kept && needs(run, PLAN_NEED_COLOR) && run->environment->environment) {
        own.environment_maps =
            environment_cache_maps(run->context->renderer, run->environment, err);
        ok = own.environment_maps;
    }
    ok = ok && (is_kept ? run_over_kept(run, err) : run_steps(run, err));
    shadow_system_end_frame(run->context->renderer->shadows, run->shadow_frame);
    frame_textures_end(&textures, run);
    if (frame_run_rays(run))
        frame_shadows_end(run);
    frame_budget_end(run);
    return ok;
}
