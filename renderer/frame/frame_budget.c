/* SPDX-License-Identifier: MIT */
/* Shares of the budget, and what goes to keep them. */
#include "renderer/frame/frame_budget.h"

#include "renderer/frame/scene_parts.h"

enum {
    WINDOWS_LEAST = 8, /* of the budget: this part is not for shadow structures */
    PAUSE_SHARE = 4,   /* of what windows could take: this part is for frames that go first */
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

void frame_budget_drop_windows(struct renderer *renderer)
{
    targets_finish(&renderer->targets);
    pixel_lists_finish(&renderer->pixels);
    traced_shadows_free(&renderer->shadow_rays);
    aov_finish(&renderer->aov);
    readback_trim(renderer->readback);
    light_lists_drop(renderer->lists);
    renderer->kept = (struct kept_window){0};
}

/* The renderer whose frame runs, of the two that share scenes and structures. */
static struct renderer *running_of(struct renderer *renderer)
{
    return renderer->is_paused && renderer->other ? renderer->other : renderer;
}

static bool holds_any(const struct renderer *renderer)
{
    return renderer_window_bytes(renderer) > 0 || readback_free_bytes(renderer->readback) > 0 ||
           renderer->feature_edges.size_bytes > 0;
}

/* Not that of a frame that waits. */
static bool drop_rays(struct renderer *renderer)
{
    uint64_t before = raytrace_cache_size_bytes(renderer->traced);
    if (renderer->use.has_rays || !before)
        return false;
    renderer_forget_traced(renderer, NULL);
    return raytrace_cache_size_bytes(renderer->traced) < before;
}

/* Of what no frame holds, the least dear: false where nothing is left but scenes. */
static bool drop_kept(struct renderer *renderer)
{
    struct renderer *other = renderer->is_beside ? NULL : renderer->other;
    bool has_others = other && holds_any(other);
    bool has_own = !renderer->use.has_windows && holds_any(renderer);
    if (!has_others && !has_own)
        return drop_rays(renderer);
    struct renderer *holder = has_others ? other : renderer;
    frame_budget_drop_windows(holder);
    feature_edges_finish(&holder->feature_edges);
    return true;
}

/* With so many bytes more. */
static void keep_within(struct renderer *renderer, uint64_t bytes)
{
    while (renderer_used_bytes(renderer) > less(renderer->budget_bytes, bytes) &&
           drop_kept(renderer))
        continue;
}

void frame_budget_claim(void *context, uint64_t bytes)
{
    keep_within(running_of(context), bytes);
}

/* Nothing goes while a frame is paused: it may show what is the oldest here. */
static bool drop_scene(struct renderer *renderer)
{
    return !renderer->is_beside && renderer->use.scene &&
           renderer_evict_oldest_beside(renderer, renderer->use.scene);
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

/* Of a frame that goes first, though the frame that waits holds all the rest: rays may. */
static uint64_t least_beside(const struct renderer *renderer)
{
    return renderer->is_beside ? renderer->budget_bytes / WINDOWS_LEAST : 0;
}

/* Within a pause, of what the frame that waits does not hold. */
static uint64_t share_of(const struct renderer *renderer, const struct resident_scene *scene)
{
    uint64_t all = renderer->budget_bytes;
    if (!renderer->is_beside)
        return least(renderer->shadow_most_bytes,
                     less(all - all / WINDOWS_LEAST, scene_bytes(scene)));
    uint64_t held =
        less(renderer_used_bytes(renderer),
             shadow_system_size_bytes(renderer->shadows) + renderer_window_bytes(renderer));
    uint64_t share = less(all, held) / 4 * 3, floor = least_beside(renderer);
    return least(renderer->shadow_most_bytes, share > floor ? share : floor);
}

void frame_budget_resume(struct renderer *renderer)
{
    shadow_system_set_budget(renderer->shadows,
                             least(renderer->use.shadow_bytes, renderer->shadow_most_bytes));
}

void frame_budget_share(struct renderer *renderer, const struct resident_scene *scene)
{
    renderer->use.shadow_bytes = share_of(renderer, scene);
}

static bool has_step(const struct frame_run *run, enum plan_step step)
{
    const struct plan *plan = &run->frame_plan->plan;
    bool has = false;
    for (int i = 0; i < plan->pass_count; i++)
        has |= plan->passes[i].step == step;
    return has;
}

/* The most that a frame would like to have for windows: lists as large as their targets. */
static uint64_t wanted_bytes(const struct frame_run *run, uint64_t pixel_bytes)
{
    uint64_t pixels = (uint64_t)run->view->width_px * (uint64_t)run->view->height_px;
    return has_step(run, PLAN_STEP_SURFACES) ? 2 * pixel_bytes * least(pixels, IDEAL_PIXELS) : 0;
}

static uint64_t pixel_bytes_of(const struct frame_run *run)
{
    const struct plan *plan = &run->frame_plan->plan;
    uint64_t outputs = aov_pixel_bytes(run->view),
             bytes = targets_pixel_bytes(plan->target_samples);
    if (plan->requirements[PLAN_NEED_COLOR].is_met)
        bytes += targets_parts_pixel_bytes(plan->target_samples) +
                 readback_window_bytes(1 << 10) / (1 << 10);
    return bytes + outputs + outputs / 2; /* their buffer grows by half */
}

/* That shadow structures will take for certain, beside what they hold. */
static uint64_t shadows_to_come(const struct frame_run *run)
{
    const struct renderer *renderer = run->renderer;
    const struct shadow_needs *needs = &run->frame_plan->shadows;
    int resolution = shadow_resolution(&run->view->quality, gl_context_limits(renderer->context));
    uint64_t bytes = 0;
    for (size_t i = 0; i < needs->light_count; i++)
        bytes += shadow_need_least_bytes(&needs->lights[i], resolution);
    return less(least(bytes, renderer->use.shadow_bytes),
                shadow_system_size_bytes(renderer->shadows));
}

bool frame_budget_holds_all(const struct frame_run *run)
{
    const struct renderer *renderer = run->renderer;
    uint64_t windows = wanted_bytes(run, pixel_bytes_of(run));
    uint64_t to_come = shadows_to_come(run) + less(windows, renderer_window_bytes(renderer));
    return renderer_used_bytes(renderer) + to_come <= renderer->budget_bytes;
}

void frame_budget_begin(const struct frame_run *run)
{
    struct renderer *renderer = run->renderer;
    renderer->use.scene = run->scene;
    renderer->use.has_windows = true; /* they are kept while scenes that nobody shows can go */
    renderer->use.has_rays = has_step(run, PLAN_STEP_RAYS) || has_step(run, PLAN_STEP_TRACE);
    frame_budget_share(renderer, run->scene); /* its textures are there now */
    frame_budget_resume(renderer);
    uint64_t windows = wanted_bytes(run, pixel_bytes_of(run));
    uint64_t to_come = shadows_to_come(run) + less(windows, renderer_window_bytes(renderer));
    while (renderer_used_bytes(renderer) > less(renderer->budget_bytes, to_come) &&
           (drop_kept(renderer) || drop_scene(renderer)))
        continue;
    renderer->use.has_windows = false;
    frame_budget_claim(renderer->is_beside ? renderer->other : renderer, shadows_to_come(run));
}

void frame_budget_end(const struct frame_run *run)
{
    struct renderer *renderer = run->renderer;
    renderer->use.has_windows = false;
    keep_within(renderer, 0);
    renderer->use.has_rays = false;
}

void frame_budget_end_rays(const struct frame_run *run)
{
    struct renderer *renderer = run->renderer;
    renderer->use.has_rays = false;
    keep_within(renderer, 0);
}

/* What a frame may yet ask of its shadow structures: to be built once more, after a pause or batch
 * by batch. */
static uint64_t shadow_bytes(const struct frame_run *run)
{
    const struct renderer *renderer = run->renderer;
    uint64_t now = shadow_system_size_bytes(renderer->shadows);
    uint64_t share = renderer->use.shadow_bytes, peak = 0;
    if (!has_step(run, PLAN_STEP_SHADOWS))
        return now;
    if (renderer->batches.most)
        peak = share;
    else if (renderer->interlude)
        peak = least(shadow_system_peak_bytes(renderer->shadows), share);
    return peak > now ? peak : now;
}

/* What windows leave alone. */
static uint64_t beside_bytes(const struct frame_run *run)
{
    const struct renderer *renderer = run->renderer;
    return renderer_used_bytes(renderer) - renderer_window_bytes(renderer) -
           readback_free_bytes(renderer->readback) - shadow_system_size_bytes(renderer->shadows) +
           shadow_bytes(run);
}

struct window_budget frame_budget_windows(const struct frame_run *run)
{
    struct renderer *renderer = run->renderer;
    struct window_budget budget = {.pixel_bytes = pixel_bytes_of(run)};
    uint64_t room = less(renderer->budget_bytes, wanted_bytes(run, budget.pixel_bytes));
    renderer->use.has_windows = true;
    renderer->use.has_rays = has_step(run, PLAN_STEP_RAYS);
    while (beside_bytes(run) > room && drop_kept(renderer))
        continue;
    bool has_structures = has_step(run, PLAN_STEP_SHADOWS);
    if (beside_bytes(run) > room && !renderer->is_beside && !has_structures)
        shadow_system_set_budget(renderer->shadows, 0); /* none of the structures is this frame's */
    budget.beside_bytes = beside_bytes(run);
    budget.bytes = less(renderer->budget_bytes, budget.beside_bytes);
    if (budget.bytes < least_beside(renderer))
        budget.bytes = least_beside(renderer);
    if (renderer->interlude)
        budget.pause_bytes =
            least(budget.bytes / PAUSE_SHARE, renderer->budget_bytes / WINDOWS_LEAST);
    budget.bytes -= budget.pause_bytes;
    renderer->use.shadow_bytes = shadow_bytes(run);
    frame_budget_resume(renderer);
    return budget;
}

bool window_budget_has_room(const struct window_budget *budget, uint64_t pixels)
{
    return pixels * budget->pixel_bytes <= budget->bytes / 3 * 2;
}

/* For lists of surfaces and of lights, and traced shadows. */
static uint64_t lists_bytes(const struct window_budget *budget, uint64_t pixels)
{
    return less(budget->bytes, pixels * budget->pixel_bytes);
}

/* Takes what a buffer of before holds from the bytes that are left, or is to drop it. */
static bool is_in_the_way(uint64_t size_bytes, uint64_t *bytes)
{
    bool is = size_bytes > *bytes / 4;
    *bytes -= is ? 0 : size_bytes;
    return is;
}

void window_budget_begin(const struct window_budget *budget, const struct frame_run *run,
                         uint64_t pixels)
{
    struct renderer *renderer = run->renderer;
    uint64_t bytes = lists_bytes(budget, pixels), outputs = aov_pixel_bytes(run->view) * pixels;
    uint64_t readback = readback_free_bytes(renderer->readback);
    if (is_in_the_way(less(readback, readback_window_bytes(pixels)), &bytes))
        readback_trim(renderer->readback);
    if (is_in_the_way(less(renderer->aov.words.size_bytes, outputs + outputs / 2), &bytes))
        aov_finish(&renderer->aov);
    if (is_in_the_way(light_lists_size_bytes(renderer->lists), &bytes))
        light_lists_drop(renderer->lists);
    uint64_t traced = traced_shadows_size_bytes(&renderer->shadow_rays);
    if (renderer->use.has_rays)
        bytes /= 2;
    if (renderer->use.has_rays ? traced > bytes : is_in_the_way(traced, &bytes))
        traced_shadows_free(&renderer->shadow_rays);
    if (pixel_lists_size_bytes(&renderer->pixels) > bytes) {
        pixel_lists_finish(&renderer->pixels);
        renderer->kept.layers = (struct content_key){{0}};
    }
    renderer->pixels.most_bytes = bytes ? bytes : 1;
}

bool window_budget_continue(const struct window_budget *budget, const struct frame_run *run,
                            uint64_t pixels)
{
    struct renderer *renderer = run->renderer;
    uint64_t bytes = lists_bytes(budget, pixels);
    uint64_t used =
        light_lists_size_bytes(renderer->lists) + pixel_lists_size_bytes(&renderer->pixels);
    renderer->shadow_rays.most_bytes = used < bytes ? bytes - used : 1;
    return used <= bytes;
}

bool window_budget_refuse(const struct window_budget *budget, const struct frame_run *run,
                          const struct camera_window *window, uint64_t lacked_bytes,
                          struct error *err)
{
    const struct renderer *renderer = run->renderer;
    uint64_t targets = (uint64_t)window->width * (uint64_t)window->height * budget->pixel_bytes;
    return error_set(
        err, ERROR_OVER_BUDGET,
        "the frame needs %llu bytes: %llu of scenes, %llu of shadow structures, %llu of "
        "rays, %llu of targets and %llu of lists for no more than %dx%d pixels, and %llu "
        "for frames that go first; the budget is %llu bytes",
        (unsigned long long)(budget->beside_bytes + targets + lacked_bytes + budget->pause_bytes),
        (unsigned long long)scene_cache_size_bytes(renderer->scenes),
        (unsigned long long)renderer->use.shadow_bytes,
        (unsigned long long)raytrace_cache_size_bytes(renderer->traced),
        (unsigned long long)targets, (unsigned long long)lacked_bytes, window->width,
        window->height, (unsigned long long)budget->pause_bytes,
        (unsigned long long)renderer->budget_bytes);
}
