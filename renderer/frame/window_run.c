/* SPDX-License-Identifier: MIT */
/* Each kind of step of a window is a function. */
#include "renderer/frame/window_run.h"

#include <epoxy/gl.h>

#include "renderer/frame/frame_in_flight.h"
#include "renderer/frame/frame_shadows.h"
#include "renderer/frame/frame_yield.h"
#include "renderer/frame/frame_budget.h"
#include "renderer/frame/light_batches.h"
#include "renderer/base/sample_pattern.h"
#include "renderer/shading/accumulation.h"
#include "renderer/shading/atmosphere_glow.h"
#include "renderer/shading/atmosphere_light.h"
#include "renderer/shading/deep.h"
#include "renderer/shading/refraction.h"

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

/* ---- steps ---- */

static struct shade_desc shade_of(const struct window_run *window)
{
    struct frame_context *context = window->run->context;
    struct renderer *renderer = context->renderer;
    return (struct shade_desc){
        .frame = &window->frame,
        .lists = context->lists,
        .shadows = renderer->shadows,
        .layers = &context->layers,
        .items = &window->run->frame_plan->items,
        .traced = frame_run_rays(window->run),
        .seen = frame_run_needs(window->run, PLAN_NEED_VISIBILITY) ? &context->shadow_rays : NULL,
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
                          (struct list_sizes){.entries = context->layers.layer_count,
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
    bool is_kept = frame_run_needs(run, PLAN_NEED_LAYERS) && !renderer->redraws_surfaces &&
                   (!context->layers.is_guessed || frame_run_may_guess(run)) &&
                   content_key_equals(context->cached.layers, window->keys.layers);
    window->is_counted = frame_run_needs(run, PLAN_NEED_LAYERS) && context->layers.is_counted &&
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

/* Clustered lists stand for all rounds of the colour. Linked ones, which are drawn, are made for
 * each. */
static struct camera_window lights_window(const struct window_frame *frame)
{
    struct camera_window window = frame->window;
    bool is_shifted = window.shift_px[0] != 0 || window.shift_px[1] != 0;
    bool is_wide = /* the columns at its sides lie beyond it */
        atmosphere_is_lit(frame) || smoke_is_lit(frame);
    if ((!is_shifted && !is_wide) || frame->view->quality.light_lists == VIEW_LIGHT_LISTS_LINKED)
        return window;
    window.shift_px[0] = window.shift_px[1] = 0;
    window.reach_px = is_shifted ? sample_pattern_reach(frame->targets->samples, frame->rounds) : 0;
    if (is_wide)
        window.reach_px += 2.0 * atmosphere_side_px(frame->view);
    return window;
}

static bool build_lights(struct window_run *window, struct error *err)
{
    const struct window_frame *frame = &window->frame;
    const struct camera_window lights = lights_window(frame);
    return light_lists_prepare(window->run->context->lists,
                               &(struct light_lists_desc){
                                   .technique = frame->view->quality.light_lists,
                                   .faithful = frame->view->quality.faithful,
                                   .lights = frame->state->lights,
                                   .light_count = frame->state->light_count,
                                   .camera = frame->camera,
                                   .window = &lights,
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
    window->overflows = !window_budget_continue(window->budget, window->run,
                                                camera_window_pixels(&window->frame.window));
    if (window->overflows)
        window->missing_bytes =
            light_lists_size_bytes(context->lists) + layers_size_bytes(&context->layers);
    return true;
}

static bool collect_points(struct window_run *window, struct error *err)
{
    const struct frame_context *context = window->run->context;
    bool is_bounded = frame_run_needs(window->run, PLAN_NEED_LIGHTS); /* prepare_lights has done it
                                                                       */
    uint64_t pixels = camera_window_pixels(&window->frame.window);
    window->overflows = !is_bounded && !window_budget_continue(window->budget, window->run, pixels);
    if (window->overflows) {
        window->missing_bytes = layers_size_bytes(&context->layers);
        return true;
    }
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
    return light_batches_shade(window->run, &desc, err) && atmosphere_glow_add(&desc, err);
}

/* Nothing bends where no layer was found. */
static bool refract_picture(struct window_run *window, struct error *err)
{
    const struct layers *layers = &window->run->context->layers;
    const struct plan *plan = &window->run->frame_plan->plan;
    return !layers->layer_count ||
           refraction_draw(&window->frame, layers, plan->requirements[PLAN_NEED_REFRACTION].because,
                           err);
}

static bool add_round(struct window_run *window, struct error *err)
{
    const struct plan *plan = &window->run->frame_plan->plan;
    return accumulation_add(&window->frame, plan->requirements[PLAN_NEED_ANTIALIASING].because,
                            err);
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

static bool read_deep(struct window_run *window, struct error *err)
{
    const struct shade_desc desc = shade_of(window);
    return deep_read(&desc, &window->run->frame->deep, &window->overflows, err);
}

static bool read_auxiliary(struct window_run *window, struct error *err)
{
    struct shade_desc desc = shade_of(window);
    return aov_read(&window->run->context->aov, &desc, window->run->frame->outputs, err);
}

/* ---- the walk ---- */

/* What a window is walked for. */
enum {
    FOR_ROUND = 1,   /* the colour, in each round of its samples */
    FOR_COLOR = 2,   /* the colour, once */
    FOR_OUTPUTS = 4, /* auxiliary outputs, which take one sample that is not shifted */
    FOR_ALL = FOR_ROUND | FOR_COLOR | FOR_OUTPUTS,
};

static const struct {
    bool (*run)(struct window_run *window, struct error *err);
    unsigned for_;
} steps[PLAN_STEP_COUNT] = {
    [PLAN_STEP_SURFACES] = {.run = draw_surfaces, .for_ = FOR_ROUND | FOR_OUTPUTS},
    [PLAN_STEP_LAYERS] = {.run = build_layers, .for_ = FOR_ROUND | FOR_OUTPUTS},
    [PLAN_STEP_LIGHT_LISTS] = {.run = prepare_lights, .for_ = FOR_ROUND | FOR_OUTPUTS},
    [PLAN_STEP_SHADOW_POINTS] = {.run = collect_points, .for_ = FOR_ROUND},
    [PLAN_STEP_SHADE] = {.run = shade, .for_ = FOR_ROUND},
    [PLAN_STEP_REFRACT] = {.run = refract_picture, .for_ = FOR_ROUND},
    [PLAN_STEP_ACCUMULATE] = {.run = add_round, .for_ = FOR_ROUND},
    [PLAN_STEP_DEEP] = {.run = read_deep, .for_ = FOR_COLOR},
    [PLAN_STEP_READ] = {.run = read_color, .for_ = FOR_COLOR},
    [PLAN_STEP_AUXILIARY] = {.run = read_auxiliary, .for_ = FOR_OUTPUTS},
};

/* Yields between two passes if an urgent frame waits. */
static bool yield_if_due(const struct frame_run *run, struct error *err)
{
    const struct yield_point point = frame_yield_point(run);
    return !yield_point_is_due(&point) || yield_point_run(&point, err);
}

static bool walk_window(struct window_run *window, unsigned for_, struct error *err)
{
    const struct plan *plan = &window->run->frame_plan->plan;
    for (int i = 0; i < plan->pass_count && !window->overflows; i++) {
        enum plan_step step = plan->passes[i].step;
        if (!plan_begins_step(plan, i) || !(steps[step].for_ & for_))
            continue;
        frame_in_flight_poll(window->run->context->renderer);
        if (!yield_if_due(window->run, err) || !steps[step].run(window, err))
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

/* Where the picture lies in the window in that round; round 0 of 1: as it is. */
static void aim(struct window_run *window, int rounds, int round)
{
    struct window_frame *frame = &window->frame;
    frame->round = round;
    frame->window.shift_px[0] = frame->window.shift_px[1] = 0;
    if (rounds > 1)
        sample_pattern_shift(window->run->frame_plan->plan.target_samples, rounds, round,
                             frame->window.shift_px);
}

struct window_frame window_frame_of(const struct frame_run *run,
                                    const struct camera_window *rectangle)
{
    struct frame_context *context = run->context;
    struct renderer *renderer = context->renderer;
    return (struct window_frame){
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
        .smoke = &context->smoke,
        .has_glow = run->frame_plan->plan.has_glow,
        .depths.most_bytes = frame_budget_depths(renderer),
        .rounds = run->frame_plan->plan.rounds,
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
    if (!targets_prepare(frame->targets, &desc, err) ||
        !targets_prepare_sum(frame->targets, accumulation_is_there(frame), accumulation_maps(frame),
                             err) ||
        !targets_prepare_opaque(frame->targets, frame_run_needs(window->run, PLAN_NEED_DEEP),
                                err) ||
        (plan->requirements[PLAN_NEED_LAYERS].is_met && refraction_is_possible(frame) &&
         !refraction_prepare(frame, err)))
        return false;
    read_sample_positions(frame->targets, frame->sample_positions);
    aim(window, frame->rounds, 0);
    begin_window(window);
    return true;
}

/* The rounds of the colour one after the other, then the outputs. The first has begun. */
static bool walk_rounds(struct window_run *window, struct error *err)
{
    struct frame_context *context = window->run->context;
    const struct progress_span whole = context->span;
    int rounds = window->frame.rounds;
    for (int round = 0; round < rounds && !window->overflows; round++) {
        frame_context_begin_span(context,
                                 progress_span_part(whole, (double)round / rounds, 1.0 / rounds));
        if (round > 0) {
            aim(window, rounds, round);
            begin_window(window);
        }
        if (!walk_window(window, FOR_ROUND, err))
            return false;
    }
    if (!walk_window(window, FOR_COLOR, err))
        return false;
    if (!frame_run_needs(window->run, PLAN_NEED_AUXILIARY) || window->overflows)
        return true;
    aim(window, 1, 0);
    begin_window(window);
    return walk_window(window, FOR_OUTPUTS, err);
}

bool window_run(const struct frame_run *run, const struct window_budget *budget,
                const struct camera_window *rectangle, struct window_result *result,
                struct error *err)
{
    struct frame_context *context = run->context;
    struct renderer *renderer = context->renderer;
    struct window_run window = {
        .run = run, .frame = window_frame_of(run, rectangle), .budget = budget};
    window_budget_begin(budget, run, camera_window_pixels(rectangle));
    if (!prepare_targets(&window, err) ||
        !(window.frame.rounds > 1 ? walk_rounds(&window, err) : walk_window(&window, FOR_ALL, err)))
        return false;
    *result = (struct window_result){window.overflows, window.missing_bytes};
    if (!window.overflows)
        report_raise_bytes(&run->frame->report, "targets", targets_size_bytes(&context->targets));
    return window.overflows || gl_context_check(renderer->gl, "rendering", err);
}

bool window_run_count(const struct frame_run *run, const struct camera_window *rectangle,
                      struct error *err)
{
    struct frame_context *context = run->context;
    struct window_run window = {.run = run, .frame = window_frame_of(run, rectangle)};
    struct list_sizes known;
    if (find_sizes(&window, &known))
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
