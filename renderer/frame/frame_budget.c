/* SPDX-License-Identifier: MIT */
/* Computes the shares of the budget, and evicts what exceeds them. */
#include "renderer/frame/frame_budget.h"

#include "renderer/frame/scene_parts.h"
#include "renderer/shading/deep.h"
#include "renderer/scene/atmosphere_grid.h"
#include "renderer/shading/atmosphere_glow.h"
#include "renderer/scene/smoke_lattice.h"
#include "renderer/scene/smoke_nodes.h"
#include "renderer/shadows/technique.h"

enum {
    WINDOWS_LEAST = 8, /* of the budget: this part is not for shadow structures */
    PAUSE_SHARE = 4,   /* of what windows could take: this part is for urgent frames */
    IDEAL_PIXELS = 1 << 21,
};

static uint64_t less(uint64_t from, uint64_t bytes)
{
    return from > bytes ? from - bytes : 0;
}

static uint64_t least(uint64_t a, uint64_t b)
{
    return a < b ? a : b;
}

/* ---- what goes ---- */

/* Frees what the context holds of its last window. Not while a window is drawn. */
static void drop_windows(struct frame_context *context)
{
    targets_finish(&context->targets);
    layers_finish(&context->layers);
    traced_shadows_free(&context->shadow_rays);
    aov_finish(&context->aov);
    readback_trim(context->renderer->readback);
    light_lists_drop(context->lists);
    context->cached = (struct window_cache_keys){0};
}

static bool holds_any(const struct frame_context *context)
{
    return frame_context_size_bytes(context) > 0 ||
           readback_free_bytes(context->renderer->readback) > 0;
}

/* Evicts the structure of rays, unless the frame that has yielded uses it. */
static bool drop_rays(struct frame_context *context)
{
    struct renderer *renderer = context->renderer;
    uint64_t before = raytrace_cache_size_bytes(renderer->traced);
    if (context->use.has_rays || !before)
        return false;
    renderer_forget_traced(renderer, NULL);
    return raytrace_cache_size_bytes(renderer->traced) < before;
}

/* Evicts what is cheapest to build again and in no use. False if nothing is left but scenes. */
static bool drop_kept(struct frame_context *context)
{
    struct frame_context *urgent = &context->renderer->urgent;
    bool has_urgent = urgent != context && urgent->renderer && holds_any(urgent);
    bool has_own = !context->use.has_windows && holds_any(context);
    if (environment_cache_drop_oldest(context->renderer))
        return true;
    if (!has_urgent && !has_own)
        return drop_rays(context);
    struct frame_context *holder = has_urgent ? urgent : context;
    drop_windows(holder);
    feature_edges_finish(&holder->feature_edges);
    return true;
}

/* Evicts caches until so many bytes more fit the budget. */
static void keep_within(struct frame_context *context, uint64_t bytes)
{
    const struct renderer *renderer = context->renderer;
    while (renderer_used_bytes(renderer) > less(renderer->budget_bytes, bytes) &&
           drop_kept(context))
        continue;
}

void frame_budget_reserve(void *context, uint64_t bytes)
{
    struct renderer *renderer = context;
    keep_within(renderer_context(renderer), bytes);
}

/* Evicts the oldest scene, but not for an urgent frame: the frame that has yielded may show it. */
static bool drop_scene(struct frame_context *context)
{
    return !context->is_urgent && context->use.scene &&
           renderer_evict_oldest_other(context->renderer, context->use.scene);
}

/* ---- shares ---- */

static uint64_t scene_bytes(const struct resident_scene *scene)
{
    uint64_t bytes = scene->source_count ? 0 : scene_gpu_size_bytes(scene->gpu);
    for (size_t i = 0; i < scene->source_count; i++) {
        bool is_first = true; /* a scene may be several parts */
        for (size_t k = 0; k < i; k++)
            is_first = is_first && scene->sources[k] != scene->sources[i];
        bytes += is_first ? scene_gpu_size_bytes(scene->sources[i]->gpu) : 0;
    }
    return bytes;
}

/* The least share of an urgent frame, even if the frame that has yielded holds all the rest, as
 * rays may. */
static uint64_t least_of_urgent(const struct frame_context *context)
{
    return context->is_urgent ? context->renderer->budget_bytes / WINDOWS_LEAST : 0;
}

/* An urgent frame has a share of the memory that the frame that has yielded does not hold. */
static uint64_t share_of(const struct frame_context *context, const struct resident_scene *scene)
{
    const struct renderer *renderer = context->renderer;
    uint64_t all = renderer->budget_bytes;
    if (!context->is_urgent)
        return least(renderer->shadow_most_bytes,
                     less(all - all / WINDOWS_LEAST, scene_bytes(scene)));
    uint64_t held =
        less(renderer_used_bytes(renderer),
             shadow_system_size_bytes(renderer->shadows) + frame_context_window_bytes(context));
    uint64_t share = less(all, held) / 4 * 3, floor = least_of_urgent(context);
    return least(renderer->shadow_most_bytes, share > floor ? share : floor);
}

void frame_budget_resume(struct frame_context *context)
{
    const struct renderer *renderer = context->renderer;
    shadow_system_set_budget(renderer->shadows,
                             least(context->use.shadow_bytes, renderer->shadow_most_bytes));
}

void frame_budget_share(struct frame_context *context, const struct resident_scene *scene)
{
    context->use.shadow_bytes = share_of(context, scene);
}

/* The most memory that is of use to a frame's windows: lists as large as their targets. */
static uint64_t wanted_bytes(const struct frame_run *run, uint64_t pixel_bytes)
{
    uint64_t pixels = (uint64_t)run->view->width_px * (uint64_t)run->view->height_px;
    uint64_t glow = run->frame_plan->plan.has_glow ? atmosphere_glow_bytes(run->view) : 0;
    return plan_has_step(&run->frame_plan->plan, PLAN_STEP_SURFACES)
               ? 2 * pixel_bytes * least(pixels, IDEAL_PIXELS) + glow
               : 0;
}

static uint64_t pixel_bytes_of(const struct frame_run *run)
{
    const struct plan *plan = &run->frame_plan->plan;
    uint64_t outputs = aov_pixel_bytes(run->view),
             bytes =
                 targets_pixel_bytes(plan->target_samples, plan->lobes) +
                 (plan->requirements[PLAN_NEED_REFRACTION].is_met ? TARGETS_REFRACTION_PIXEL_BYTES
                                                                  : 0);
    bytes += atmosphere_pixel_bytes(run->view) + smoke_pixel_bytes(run->view, run->state);
    if (plan_accumulates(plan, run->view))
        bytes += targets_sum_pixel_bytes(run->view->screen.has_backdrop);
    if (plan->requirements[PLAN_NEED_COLOR].is_met)
        bytes += targets_parts_pixel_bytes(plan->target_samples) +
                 readback_window_bytes(1 << 10) / (1 << 10);
    if (plan->requirements[PLAN_NEED_DEEP].is_met)
        bytes += DEEP_PIXEL_BYTES;
    return bytes + outputs + outputs / 2; /* their buffer grows by half */
}

/* The memory that shadow structures will certainly take beyond what they hold. */
static uint64_t shadows_to_come(const struct frame_run *run)
{
    const struct frame_context *context = run->context;
    const struct renderer *renderer = context->renderer;
    const struct shadow_needs *needs = &run->frame_plan->shadows;
    int resolution = shadow_resolution(&run->view->quality, gl_context_limits(renderer->gl));
    uint64_t bytes = 0;
    for (size_t i = 0; i < needs->light_count; i++)
        bytes += shadow_need_least_bytes(&needs->lights[i], resolution);
    return less(least(bytes, context->use.shadow_bytes),
                shadow_system_size_bytes(renderer->shadows));
}

uint64_t frame_budget_depths(const struct renderer *renderer)
{
    return smoke_depths_most(gl_context_limits(renderer->gl), renderer->budget_bytes);
}

/* Likewise kept depths of density grids. */
static uint64_t depths_to_come(const struct frame_run *run)
{
    const struct frame_context *context = run->context;
    uint64_t most = frame_budget_depths(context->renderer);
    return frame_run_needs(run, PLAN_NEED_SMOKE) &&
                   !shadow_quality_holds_grids(&run->view->quality) &&
                   smoke_lattice_serves(run->view, run->state, run->camera, most)
               ? less(smoke_lattice_bytes(run->state),
                      smoke_depths_size_bytes(&context->smoke.depths))
               : 0;
}

bool frame_budget_holds_all(const struct frame_run *run)
{
    const struct frame_context *context = run->context;
    const struct renderer *renderer = context->renderer;
    uint64_t windows = wanted_bytes(run, pixel_bytes_of(run));
    uint64_t to_come = shadows_to_come(run) + depths_to_come(run) +
                       less(windows, frame_context_window_bytes(context));
    return renderer_used_bytes(renderer) + to_come <= renderer->budget_bytes;
}

void frame_budget_begin(const struct frame_run *run)
{
    struct frame_context *context = run->context;
    struct renderer *renderer = context->renderer;
    context->use.scene = run->scene;
    context->use.environment = run->environment->environment;
    context->use.has_windows = true; /* scenes that nobody shows are evicted first */
    context->use.has_rays = plan_has_step(&run->frame_plan->plan, PLAN_STEP_RAYS) ||
                            plan_has_step(&run->frame_plan->plan, PLAN_STEP_TRACE);
    frame_budget_share(context, run->scene); /* its textures are resident now */
    frame_budget_resume(context);
    uint64_t windows = wanted_bytes(run, pixel_bytes_of(run));
    uint64_t to_come = shadows_to_come(run) + depths_to_come(run) +
                       less(windows, frame_context_window_bytes(context));
    while (renderer_used_bytes(renderer) > less(renderer->budget_bytes, to_come) &&
           (drop_kept(context) || drop_scene(context)))
        continue;
    context->use.has_windows = false;
    keep_within(context, shadows_to_come(run) + depths_to_come(run));
}

void frame_budget_end(const struct frame_run *run)
{
    struct frame_context *context = run->context;
    context->use.has_windows = false;
    keep_within(context, 0);
    context->use.environment = NULL;
    context->use.has_rays = false;
}

void frame_budget_end_rays(const struct frame_run *run)
{
    struct frame_context *context = run->context;
    context->use.has_rays = false;
    keep_within(context, 0);
}

/* The memory that a frame may still need for shadow structures, which may be built again after a
 * pause, or in batches. */
static uint64_t shadow_bytes(const struct frame_run *run)
{
    const struct frame_context *context = run->context;
    const struct renderer *renderer = context->renderer;
    uint64_t now = shadow_system_size_bytes(renderer->shadows);
    uint64_t share = context->use.shadow_bytes, peak = 0;
    if (!plan_has_step(&run->frame_plan->plan, PLAN_STEP_SHADOWS))
        return now;
    if (context->batches.most)
        peak = share;
    else if (frame_context_yield(context))
        peak = least(shadow_system_peak_bytes(renderer->shadows), share);
    return peak > now ? peak : now;
}

/* The memory that windows may not use. */
static uint64_t other_bytes(const struct frame_run *run)
{
    const struct frame_context *context = run->context;
    const struct renderer *renderer = context->renderer;
    return renderer_used_bytes(renderer) - frame_context_window_bytes(context) -
           readback_free_bytes(renderer->readback) - shadow_system_size_bytes(renderer->shadows) +
           shadow_bytes(run) + depths_to_come(run);
}

struct window_budget frame_budget_windows(const struct frame_run *run)
{
    struct frame_context *context = run->context;
    struct renderer *renderer = context->renderer;
    struct window_budget budget = {.pixel_bytes = pixel_bytes_of(run)};
    uint64_t room = less(renderer->budget_bytes, wanted_bytes(run, budget.pixel_bytes));
    context->use.has_windows = true;
    context->use.has_rays = plan_has_step(&run->frame_plan->plan, PLAN_STEP_RAYS);
    while (other_bytes(run) > room && drop_kept(context))
        continue;
    bool has_structures = plan_has_step(&run->frame_plan->plan, PLAN_STEP_SHADOWS);
    if (other_bytes(run) > room && !context->is_urgent && !has_structures)
        shadow_system_set_budget(renderer->shadows, 0); /* none of the structures is this frame's */
    budget.other_bytes = other_bytes(run);
    budget.bytes = less(renderer->budget_bytes, budget.other_bytes);
    if (budget.bytes < least_of_urgent(context))
        budget.bytes = least_of_urgent(context);
    if (frame_context_yield(context))
        budget.pause_bytes =
            least(budget.bytes / PAUSE_SHARE, renderer->budget_bytes / WINDOWS_LEAST);
    budget.bytes -= budget.pause_bytes;
    context->use.shadow_bytes = shadow_bytes(run);
    frame_budget_resume(context);
    return budget;
}

bool window_budget_has_room(const struct window_budget *budget, uint64_t pixels)
{
    return pixels * budget->pixel_bytes <= budget->bytes / 3 * 2;
}

/* What is left for lists of surfaces and of lights, and for traced shadows. */
static uint64_t lists_bytes(const struct window_budget *budget, uint64_t pixels)
{
    return less(budget->bytes, pixels * budget->pixel_bytes);
}

/* Subtracts a buffer of an earlier window from the bytes that are left. True: it does not fit, and
 * has to be freed. */
static bool is_in_the_way(uint64_t size_bytes, uint64_t *bytes)
{
    bool is = size_bytes > *bytes / 4;
    *bytes -= is ? 0 : size_bytes;
    return is;
}

void window_budget_begin(const struct window_budget *budget, const struct frame_run *run,
                         uint64_t pixels)
{
    struct frame_context *context = run->context;
    struct renderer *renderer = context->renderer;
    uint64_t bytes = lists_bytes(budget, pixels), outputs = aov_pixel_bytes(run->view) * pixels;
    uint64_t readback = readback_free_bytes(renderer->readback);
    if (is_in_the_way(less(readback, readback_window_bytes(pixels)), &bytes))
        readback_trim(renderer->readback);
    if (is_in_the_way(less(context->aov.words.size_bytes, outputs + outputs / 2), &bytes))
        aov_finish(&context->aov);
    if (is_in_the_way(light_lists_size_bytes(context->lists), &bytes))
        light_lists_drop(context->lists);
    uint64_t traced = traced_shadows_size_bytes(&context->shadow_rays);
    if (context->use.has_rays)
        bytes /= 2;
    if (context->use.has_rays ? traced > bytes : is_in_the_way(traced, &bytes))
        traced_shadows_free(&context->shadow_rays);
    if (layers_size_bytes(&context->layers) > bytes) {
        layers_finish(&context->layers);
        context->cached.layers = (struct content_key){{0}};
    }
    layers_set_budget(&context->layers, bytes);
}

bool window_budget_continue(const struct window_budget *budget, const struct frame_run *run,
                            uint64_t pixels)
{
    struct frame_context *context = run->context;
    uint64_t bytes = lists_bytes(budget, pixels);
    uint64_t used = light_lists_size_bytes(context->lists) + layers_size_bytes(&context->layers);
    traced_shadows_set_budget(&context->shadow_rays, less(bytes, used));
    return used <= bytes;
}

bool window_budget_refuse(const struct window_budget *budget, const struct frame_run *run,
                          const struct camera_window *window, uint64_t missing_bytes,
                          struct error *err)
{
    const struct frame_context *context = run->context;
    const struct renderer *renderer = context->renderer;
    uint64_t targets = (uint64_t)window->width * (uint64_t)window->height * budget->pixel_bytes;
    return error_set(
        err, ERROR_OVER_BUDGET,
        "the frame needs %llu bytes: %llu of scenes, %llu of shadow structures, %llu of "
        "rays, %llu of targets and %llu of lists for no more than %dx%d pixels, and %llu "
        "for frames that go first; the budget is %llu bytes",
        (unsigned long long)(budget->other_bytes + targets + missing_bytes + budget->pause_bytes),
        (unsigned long long)scene_cache_size_bytes(&renderer->scenes),
        (unsigned long long)context->use.shadow_bytes,
        (unsigned long long)raytrace_cache_size_bytes(renderer->traced),
        (unsigned long long)targets, (unsigned long long)missing_bytes, window->width,
        window->height, (unsigned long long)budget->pause_bytes,
        (unsigned long long)renderer->budget_bytes);
}
