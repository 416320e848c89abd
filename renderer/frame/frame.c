/* SPDX-License-Identifier: MIT */
/* The public functions of frames: they check the view, make or find its plan, and run it. */
#include <assert.h>
#include <math.h>
#include <stdio.h>

#include "renderer/base/wall_clock.h"
#include "renderer/frame/frame_budget.h"
#include "renderer/frame/frame_in_flight.h"
#include "renderer/frame/frame_yield.h"
#include "renderer/frame/frame_programs.h"
#include "renderer/frame/frame_run.h"
#include "renderer/frame/light_batches.h"
#include "renderer/frame/proofs.h"
#include "renderer/frame/scene_parts.h"
#include "renderer/plan/technique_check.h"
#include "renderer/plan/view_key.h"
#include "renderer/scene/studio.h"
#include "renderer/shadows/technique.h"

/* Checks the quality, but not what its technique can do, which the plan checks. */
static bool check_quality(const struct view_quality *quality, struct error *err)
{
    if (!technique_check_samples(quality, err))
        return false;
    if (quality->area_samples < 0 || quality->area_samples > 4096)
        return error_set(err, ERROR_INVALID_REQUEST, "%d area samples, choose 1 to 4096",
                         quality->area_samples);
    if (quality->environment_samples < 0 || quality->environment_samples > 4096)
        return error_set(err, ERROR_INVALID_REQUEST, "%d environment samples, choose 1 to 4096",
                         quality->environment_samples);
    if (quality->atmosphere_samples < 0 || quality->atmosphere_samples > 4096)
        return error_set(err, ERROR_INVALID_REQUEST, "%d atmosphere samples, choose 1 to 4096",
                         quality->atmosphere_samples);
    if (quality->refraction_samples < 0 || quality->refraction_samples > 4096)
        return error_set(err, ERROR_INVALID_REQUEST, "%d refraction samples, choose 1 to 4096",
                         quality->refraction_samples);
    return true;
}

static bool check_environment(const struct view *view, struct error *err)
{
    double rotation = view->environment_rotation_deg, intensity = view->environment_intensity;
    if (!view_has_environment(view))
        return true;
    if (!(rotation >= -360 && rotation <= 360))
        return error_set(err, ERROR_INVALID_REQUEST,
                         "environment rotation %g is outside [-360, 360] degrees", rotation);
    if (!(intensity >= 0 && intensity <= 1e6))
        return error_set(err, ERROR_INVALID_REQUEST, "environment intensity %g is outside [0, 1e6]",
                         intensity);
    if (view->environment_is_background && view->screen.has_backdrop)
        return error_set(err, ERROR_INVALID_REQUEST,
                         "the background is both the environment and a colour of the screen");
    return true;
}

static bool check_atmosphere(const struct view_atmosphere *atmosphere, struct error *err)
{
    const struct {
        const char *name;
        double value, least, most;
    } numbers[] = {
        {"density", atmosphere->density_per_m, 0, 1e6},
        {"red", atmosphere->color[0], 0, 1},
        {"green", atmosphere->color[1], 0, 1},
        {"blue", atmosphere->color[2], 0, 1},
        {"anisotropy", atmosphere->anisotropy, -0.95, 0.95},
        {"falloff", atmosphere->falloff_m, 0, 1e9},
        {"base", atmosphere->base_m, -1e12, 1e12},
    };
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
        if (!(numbers[i].value >= numbers[i].least && numbers[i].value <= numbers[i].most))
            return error_set(err, ERROR_INVALID_REQUEST,
                             "the %s of the haze, %g, is outside [%g, %g]", numbers[i].name,
                             numbers[i].value, numbers[i].least, numbers[i].most);
    return true;
}

static bool check_tile(const struct view *view, struct error *err)
{
    const struct view_tile *t = &view->tile;
    if (!t->width_px)
        return true;
    if (t->x_px < 0 || t->y_px < 0 || t->width_px < 1 || t->height_px < 1 ||
        t->width_px > VIEW_SIDE_MAX_PX || t->height_px > VIEW_SIDE_MAX_PX ||
        t->width_px > view->width_px - t->x_px || t->height_px > view->height_px - t->y_px)
        return error_set(err, ERROR_INVALID_REQUEST,
                         "a tile of %dx%d at %d, %d of a picture of %dx%d", t->width_px,
                         t->height_px, t->x_px, t->y_px, view->width_px, view->height_px);
    return !view->row_count_px ||
           error_set(err, ERROR_UNSUPPORTED, "single rows need the whole picture, not a tile");
}

static bool check_view(const struct view *view, struct error *err)
{
    int most = view->tile.width_px ? VIEW_PICTURE_MAX_PX : VIEW_SIDE_MAX_PX;
    if (view->width_px < 1 || view->height_px < 1 || view->width_px > most ||
        view->height_px > most)
        return error_set(err, ERROR_INVALID_REQUEST, "image size %dx%d is outside [1, %d]",
                         view->width_px, view->height_px, most);
    if (!check_tile(view, err))
        return false;
    if (view->first_row_px < 0 || view->row_count_px < 0 ||
        view->row_count_px > view->height_px - view->first_row_px)
        return error_set(err, ERROR_INVALID_REQUEST, "%d rows from row %d of an image of %d rows",
                         view->row_count_px, view->first_row_px, view->height_px);
    if ((view->screen.channels || view->screen.has_backdrop) &&
        !isfinite(view->screen.mapping.exposure_ev))
        return error_set(err, ERROR_INVALID_REQUEST, "exposure_ev is not finite");
    if (view->clip_plane_count > VIEW_CLIP_PLANES_MAX)
        return error_set(err, ERROR_INVALID_REQUEST, "%zu clip planes, limit is %d",
                         view->clip_plane_count, VIEW_CLIP_PLANES_MAX);
    return check_environment(view, err) && check_atmosphere(&view->atmosphere, err) &&
           check_quality(&view->quality, err);
}

static bool create_outputs(const struct view *view, struct frame *frame, struct error *err)
{
    const struct view_tile tile = view_tile_of(view);
    if (view->wants_deep && !deep_image_init(&frame->deep, tile.width_px, tile.height_px, err))
        return false;
    for (int i = 0; i < VIEW_OUTPUT_COUNT; i++) {
        int channels;
        enum image_component component;
        aov_shape((enum view_output)i, &channels, &component);
        if (i == VIEW_OUTPUT_COLOR && view->screen.channels) {
            channels = view->screen.channels;
            component = IMAGE_U8;
        }
        if (view->outputs & 1u << i && !image_init(&frame->outputs[i], tile.width_px,
                                                   tile.height_px, channels, component, err))
            return false;
    }
    return true;
}

static void fill_report(const struct plan *plan, const struct resident_scene *scene,
                        const struct view *view, const struct scene_state *state,
                        struct frame_report *report)
{
    if (view_has_environment(view))
        snprintf(report->environment, sizeof report->environment, "%s", view->environment_key);
    report->counts.lights = state->light_count;
    if (plan->requirements[PLAN_NEED_COLOR].is_met ||
        plan->requirements[PLAN_NEED_AUXILIARY].is_met)
        report_add_bytes(report, "scene", scene_gpu_size_bytes(scene->gpu));
    if (state->has_default_lights)
        report_warn(report,
                    "neither the scene nor the request has a light: the studio lights it by "
                    "default");
    if (state->has_idle_animation)
        report_warn(report, "the animation moves and changes nothing that can be seen");
    if (state->open_section_count)
        report_warn(report, "%zu meshes that a clip plane cuts are not closed: they have no cap",
                    state->open_section_count);
    if (state->open_volume_count)
        report_warn(report,
                    "%zu attenuating volumes have no closed surface that faces outward: the "
                    "thickness of their material is used",
                    state->open_volume_count);
}

/* A view of a scene, checked and evaluated: what a plan is made from. */
struct opened_view {
    struct resident_scene *scene;
    struct view view;                /* with its defaults */
    const struct scene_state *state; /* of the context, as the plan */
    struct camera camera;
    struct environment_light environment;
    struct content_key state_key;
    const struct frame_plan *plan;
};

/* The key of frames whose forecasts are wrong alike: of about the same size, by any camera. */
static uint64_t observation_key_of(const struct opened_view *opened)
{
    const struct view *view = &opened->view;
    struct content_key key = content_key_begin();
    int size = ilogb((double)view->width_px * view->height_px) / 2;
    content_key_add_text(&key, opened->scene->key);
    content_key_add_word(&key, opened->state->light_count);
    content_key_add_word(&key, (uint64_t)size);
    content_key_add_word(&key, (uint64_t)view->quality.samples);
    content_key_add_word(&key, (uint64_t)view->quality.shadow_taps);
    if (view_has_environment(view)) /* rays towards it go other ways than those to lights */
        content_key_add_word(&key, (uint64_t)view->quality.environment_samples << 1 |
                                       view->quality.environment_visibility);
    if (view_has_atmosphere(view))
        content_key_add_text(&key, "haze");
    return key.words[0];
}

static struct frame_plan_desc plan_desc_of(const struct frame_context *context,
                                           const struct opened_view *opened)
{
    const struct renderer *renderer = context->renderer;
    uint64_t share_bytes = context->use.shadow_bytes;
    return (struct frame_plan_desc){
        .view = &opened->view,
        .state = opened->state,
        .camera = &opened->camera,
        .limits = gl_context_limits(renderer->gl),
        .shadow_budget_bytes = share_bytes ? share_bytes : 1, /* 0 would be any */
        .depths_bytes = frame_budget_depths(renderer),
    };
}

/* The key of all that the state holds: with the clip planes. */
static struct content_key held_key_of(const struct opened_view *opened)
{
    struct content_key key = opened->state_key, cut = view_cut_key(&opened->view);
    content_key_add(&key, &cut, sizeof cut);
    return key;
}

static struct auto_desc auto_desc_of(const struct frame_context *context,
                                     const struct opened_view *opened)
{
    const struct renderer *renderer = context->renderer;
    const struct frame_plan_desc plan = plan_desc_of(context, opened);
    return (struct auto_desc){
        .view = plan.view,
        .state = plan.state,
        .camera = plan.camera,
        .settings = &renderer->automatic,
        .raster_samples = plan_samples(plan.view, plan.limits),
        .shadow_budget_bytes = plan.shadow_budget_bytes,
        .depths_bytes = plan.depths_bytes,
        .view_key = observation_key_of(opened),
        .state_key = held_key_of(opened),
    };
}

/* The key of what is chosen for the view, by what is known now. */
static struct content_key choice_key_of(const struct frame_context *context,
                                        const struct opened_view *opened)
{
    const struct auto_settings *automatic = &context->renderer->automatic;
    struct content_key key = view_plan_key(opened->state_key, &opened->view);
    content_key_add_word(&key, context->use.shadow_bytes);
    content_key_add_word(&key, automatic->learned_print);
    content_key_add_word(&key, (uint64_t)automatic->timed);
    if (opened->view.quality.may_be_coarse) /* its forecast looks at less */
        content_key_add_text(&key, "coarse");
    return key;
}

/* Of a view in motion: whatever its camera, and what was learned from its last frames. */
static struct content_key moving_key_of(const struct frame_context *context,
                                        const struct opened_view *opened)
{
    struct view still = opened->view;
    still.camera = (struct view_camera){.kind = VIEW_CAMERA_DEFAULT};
    struct content_key key = view_plan_key(opened->state_key, &still);
    content_key_add_word(&key, context->use.shadow_bytes);
    content_key_add_word(&key, (uint64_t)context->renderer->automatic.timed);
    return key;
}

/* Adds what the view's choice decides, and what the plan tells of it. */
static void add_choice(struct content_key *key, const struct auto_choice *choice)
{
    if (!choice)
        return;
    content_key_add_word(key, (uint64_t)choice->technique << 1 | choice->is_open);
    content_key_add_text(key, choice->because);
}

/* Whether the device tone maps the picture. Overlays and comparisons need it linear, and a software
 * rasteriser would only take processor time from the encoder. */
static bool shows_on_device(const struct renderer *renderer, const struct plan *plan)
{
    return !gl_context_limits(renderer->gl)->is_software &&
           plan->requirements[PLAN_NEED_COLOR].is_met &&
           !plan->requirements[PLAN_NEED_OVERLAY].is_met;
}

/* Checks and evaluates the view, and makes no plan. err names what is wrong. */
static bool open_state(struct frame_context *context, const char *scene_key,
                       const struct view *view, struct opened_view *opened, struct error *err)
{
    struct renderer *renderer = context->renderer;
    *opened = (struct opened_view){.view = *view};
    if (!context->is_urgent)
        renderer_publish_observations(renderer);
    opened->scene = renderer_find_scene(renderer, scene_key, view, err);
    if (!opened->scene)
        return false;
    if (!opened->view.outputs)
        opened->view.outputs = 1u << VIEW_OUTPUT_COLOR;
    if (!check_view(&opened->view, err))
        return false;
    studio_apply(&opened->scene->scene, &opened->view);
    if (!environment_cache_open(renderer, &opened->view, &opened->environment, err))
        return false;
    bool is_kept;
    opened->state_key = view_state_key(opened->scene->key, &opened->view);
    opened->state = scene_state_cache_get(&context->state_cache, opened->state_key,
                                          &opened->scene->scene, &opened->view, &is_kept, err);
    context->has_new_state |= !is_kept;
    if (!opened->state || !camera_resolve(&opened->camera, &opened->view, opened->state, err))
        return false;
    frame_budget_share(context, opened->scene);
    return true;
}

/* err names what is wrong. */
static bool open_view(struct frame_context *context, const char *scene_key, const struct view *view,
                      struct opened_view *opened, struct error *err)
{
    if (!open_state(context, scene_key, view, opened, err))
        return false;
    struct content_key key = choice_key_of(context, opened);
    struct light_reach reach = choice_cache_take_reach(&context->choices, key);
    struct frame_plan_desc desc = plan_desc_of(context, opened);
    desc.reach = &reach;
    add_choice(&key, view->choice);
    opened->plan = plan_cache_get(&context->plans, key, &desc, err);
    light_reach_finish(&reach);
    if (opened->plan && !shows_on_device(context->renderer, &opened->plan->plan))
        opened->view.screen.channels = 0;
    return opened->plan;
}

bool renderer_choose(struct renderer *renderer, const char *scene_key, const struct view *view,
                     struct auto_choice *choice, struct error *err)
{
    struct frame_context *context = renderer_next_context(renderer, err);
    struct opened_view opened;
    if (!context || !open_state(context, scene_key, view, &opened, err))
        return false;
    const struct auto_desc desc = auto_desc_of(context, &opened);
    const struct content_key key = choice_key_of(context, &opened);
    const struct auto_choice *chosen =
        view->quality.may_be_coarse
            ? choice_cache_get_moving(&context->choices, key, moving_key_of(context, &opened),
                                      &desc, err)
            : choice_cache_get(&context->choices, key, &desc, err);
    if (chosen)
        *choice = *chosen;
    return chosen;
}

static struct frame_programs_desc programs_of(const struct frame_context *context,
                                              const struct opened_view *opened,
                                              const struct frame_plan *plan)
{
    const struct renderer *renderer = context->renderer;
    return (struct frame_programs_desc){
        .plan = plan,
        .view = &opened->view,
        .state = opened->state,
        .camera = &opened->camera,
        .limits = gl_context_limits(renderer->gl),
        .gpu = opened->scene->gpu,
        .loop_steps = context->shade.loop_steps,
        .depths_bytes = frame_budget_depths(renderer),
        .shadow_ways = shadow_system_ways(renderer->shadows),
        .is_in_batches = light_batches_are_known(context, opened->scene->key, &opened->view,
                                                 opened->state, plan),
    };
}

bool renderer_explain(struct renderer *renderer, const char *scene_key, const struct view *view,
                      struct plan *plan, struct error *err)
{
    struct frame_context *context = renderer_next_context(renderer, err);
    struct opened_view opened;
    if (!context || !open_view(context, scene_key, view, &opened, err))
        return false;
    *plan = opened.plan->plan;
    return true;
}

bool renderer_list_programs(struct renderer *renderer, const char *scene_key,
                            const struct view *view, struct program_list *list, struct error *err)
{
    struct frame_context *context = renderer_next_context(renderer, err);
    struct opened_view opened;
    if (!context || !open_view(context, scene_key, view, &opened, err))
        return false;
    const struct frame_programs_desc desc = programs_of(context, &opened, opened.plan);
    if (!frame_programs_list(&desc, list, err))
        return false;
    snprintf(list->device_defines, sizeof list->device_defines, "%s",
             program_cache_device_defines(renderer->programs));
    for (size_t i = 0; i < list->count; i++) {
        const struct program_desc program = program_list_desc(&list->items[i]);
        list->items[i].place = program_cache_find(renderer->programs, &program);
    }
    return true;
}

/* Has the driver begin with all that a new plan needs for certain, where that costs no time of
 * ours: a frame meets its programs one after the other. */
static void prepare_programs(struct frame_context *context, const struct opened_view *opened)
{
    struct renderer *renderer = context->renderer;
    struct program_list list = {0};
    struct error ignored = {0}; /* passes tell of it */
    const struct frame_programs_desc desc = programs_of(context, opened, opened->plan);
    bool is_good = frame_programs_list(&desc, &list, &ignored);
    for (size_t i = 0; is_good && i < list.count; i++) {
        const struct program_desc program = program_list_desc(&list.items[i]);
        if (!list.items[i].is_conditional)
            program_cache_prepare(renderer->programs, &program);
    }
    program_list_finish(&list);
}

static bool list_all(struct frame_context *context, const struct opened_view *opened,
                     struct program_list *list, struct error *err)
{
    struct frame_plan plan;
    struct frame_plan_desc desc = plan_desc_of(context, opened);
    desc.sees_all = true;
    if (!frame_plan_init(&plan, &desc, err))
        return false;
    const struct frame_programs_desc programs = programs_of(context, opened, &plan);
    bool is_good = frame_programs_list_all(&programs, list, err);
    frame_plan_finish(&plan);
    return is_good;
}

/* Lists the techniques that may draw the view, the likeliest first: from another camera `auto` may
 * choose another one. None if all pictures are traced. */
static size_t list_techniques(const struct renderer *renderer, const struct view *view,
                              const struct plan *plan, enum shadow_technique list[SHADOWS_COUNT])
{
    bool is_open = plan->choice.is_open && renderer->automatic.policy == AUTO_MEASURED;
    bool is_drawn = is_open && !shadow_technique_is_renderer(plan->choice.technique);
    size_t count = 1;
    list[0] = view->quality.shadows;
    if (list[0] != SHADOWS_AUTO)
        return 1;
    if (!is_open && plan->requirements[PLAN_NEED_TRACED].is_met)
        return 0;
    list[0] = is_drawn ? plan->choice.technique : SHADOWS_RASTER_DEFAULT;
    for (int i = 0; i < SHADOWS_COUNT && is_open; i++) {
        enum shadow_technique other = (enum shadow_technique)i;
        if (other != list[0] && shadow_technique_is_candidate(other) &&
            !shadow_technique_is_renderer(other) && plan->choice.ms[other] >= 0)
            list[count++] = other;
    }
    return count;
}

/* Compiles what is listed, until it shall stop. */
static bool compile(struct renderer *renderer, const struct program_list *list,
                    const struct renderer_warm_up_desc *desc, bool *is_complete, struct error *err)
{
    bool is_good = true, has_built = false;
    bool is_parallel = gl_context_limits(renderer->gl)->compiles_in_parallel;
    for (size_t i = 0; is_parallel && i < list->count; i++) {
        const struct program_desc program = program_list_desc(&list->items[i]);
        program_cache_prepare(renderer->programs, &program);
    }
    for (size_t i = 0; is_good && *is_complete && i < list->count; i++) {
        const struct program_desc program = program_list_desc(&list->items[i]);
        if (program_cache_find(renderer->programs, &program) == PROGRAM_IN_MEMORY)
            continue;
        *is_complete = !has_built || !desc->shall_stop(desc->context);
        is_good = !*is_complete || program_cache_get(renderer->programs, &program, err);
        has_built = true;
    }
    if (!is_good)
        gl_context_blame(renderer->gl, "compiling programs", err);
    return is_good;
}

bool renderer_warm_up(struct renderer *renderer, const char *scene_key, const struct view *view,
                      const struct renderer_warm_up_desc *desc, bool *is_complete,
                      struct error *err)
{
    struct frame_context *context = &renderer->frames;
    struct opened_view opened;
    struct program_list list = {0};
    enum shadow_technique techniques[SHADOWS_COUNT];
    struct view drawn = *view;
    struct auto_choice choice;
    assert(!renderer_is_yielding(renderer));
    *is_complete = true;
    if (!renderer_choose(renderer, scene_key, view, &choice, err))
        return false;
    drawn.choice = &choice;
    if (!open_view(context, scene_key, &drawn, &opened, err))
        return false;
    size_t count = list_techniques(renderer, view, &opened.plan->plan, techniques);
    bool is_good = true;
    for (size_t i = 0; is_good && i < 2 * count; i++) { /* with a background, and without */
        drawn.quality.shadows = techniques[i / 2];
        drawn.screen.has_backdrop = i % 2 != view->screen.has_backdrop;
        drawn.environment_is_background =
            view->environment_is_background && !drawn.screen.has_backdrop;
        is_good = open_view(context, scene_key, &drawn, &opened, err) &&
                  list_all(context, &opened, &list, err);
    }
    is_good = is_good && compile(renderer, &list, desc, is_complete, err);
    program_list_finish(&list);
    return is_good;
}

static void report_choice(const struct plan *plan, struct frame_report *report)
{
    const struct auto_choice *choice = &plan->choice;
    if (!choice->is_open)
        return;
    report->chosen.shadows = choice->technique;
    const struct shadow_method *method = shadow_method_of(report->chosen.shadows);
    if (method->id == report->chosen.shadows && !plan->lights_by_technique[method->id] &&
        method->otherwise) /* no light wanted it */
        report->chosen.shadows = method->otherwise->id;
    report->chosen.expected_ms = choice->ms[choice->technique];
    snprintf(report->chosen.because, sizeof report->chosen.because, "%s", choice->because);
}

/* Counts what the program cache has returned since `before`. */
static void count_caches(const struct frame_context *context,
                         const struct program_cache_stats *before, uint64_t plans_made,
                         struct frame_report *report)
{
    struct program_cache_stats after;
    program_cache_get_stats(context->renderer->programs, &after);
    report->counts.programs_built = after.misses - before->misses - context->urgent_programs.misses;
    report->counts.programs_reused = after.hits - before->hits - context->urgent_programs.hits;
    report->counts.programs_loaded =
        after.loaded - before->loaded - context->urgent_programs.loaded;
    report->counts.plans_made = context->plans.misses - plans_made;
    report->counts.plans_reused = 1 - report->counts.plans_made;
}

/* Whether in a rasterised colour each light's shadow is the product of all its filters. Ray tracing
 * reports that itself. */
static bool is_exact(const struct opened_view *opened, const struct frame_report *report)
{
    const struct plan *plan = &opened->plan->plan;
    const struct view_quality *quality = &opened->view.quality;
    const struct shadow_needs *shadows = &opened->plan->shadows;
    if (!plan->requirements[PLAN_NEED_COLOR].is_met || quality->shadows == SHADOWS_NONE)
        return false;
    if (report->compression.maps || view_has_environment(&opened->view) ||
        scene_state_area_lights(opened->state))
        return false;
    for (size_t i = 0; i < shadows->light_count; i++) {
        const struct shadow_need *light = &shadows->lights[i];
        if (light->has_structure && light->casters.transparent_count &&
            !shadow_technique_can(light->method->id, SHADOW_CAN_COLOR))
            return false; /* asked for, and knows no colours */
        if (light->has_structure && light->method->structure->is_exact &&
            !light->method->structure->is_exact(quality))
            return false;
    }
    return true;
}

struct making {
    bool only_builds; /* of struct frame_run */
    bool *is_done;    /* NULL where the frame is to end in the call */
    double begin_ms;  /* wall_ms, and what it was paused before it had to be made again */
};

/* The key of frames whose pixels take about the same time. */
static struct content_key pace_key_of(const struct opened_view *opened)
{
    struct content_key key = content_key_begin();
    struct view_quality quality = opened->view.quality;
    quality.may_be_coarse = quality.expects_reuse = false;
    content_key_add_text(&key, opened->scene->key);
    content_key_add_word(&key, opened->state->light_count);
    content_key_add(&key, &quality, sizeof quality);
    content_key_add_word(&key, view_has_atmosphere(&opened->view));
    return key;
}

/* One of many frames of a view, at rest. */
static bool may_keep_picture(const struct frame_context *context, const struct opened_view *opened,
                             const struct making *making)
{
    const struct view *view = &opened->view;
    return !context->is_urgent && !context->renderer->redraws_surfaces && !making->only_builds &&
           !view->wants_deep && view->quality.expects_reuse && !view->quality.may_be_coarse &&
           view->outputs == 1u << VIEW_OUTPUT_COLOR && !view->row_count_px && !view->tile.width_px;
}

/* The key of the picture. It holds what was learned, which choices follow, but not the budget: that
 * decides only about compressed maps, whose pictures are not cached. */
static struct content_key picture_key_of(const struct renderer *renderer,
                                         const struct opened_view *opened)
{
    struct content_key key =
        view_picture_key(view_state_key(opened->scene->key, &opened->view), &opened->view);
    content_key_add_word(&key, renderer->automatic.learned_print);
    add_choice(&key, opened->view.choice);
    return key;
}

/* *elapsed_ms: of the self-test, where this frame is the first that needs it; no frame of its kind
 * takes that again. */
static bool prove(struct renderer *renderer, const struct opened_view *opened, double *elapsed_ms,
                  struct error *err)
{
    double begin_ms = wall_ms();
    bool is_ours = !renderer->proofs || renderer->is_measuring;
    uint32_t needs = scene_selftest_needs(&opened->plan->plan, &opened->view.quality);
    bool ok = is_ours || proofs_ensure(renderer->proofs, needs, err);
    *elapsed_ms = wall_ms() - begin_ms;
    return ok;
}

static bool make_once(struct frame_context *context, const char *scene_key, const struct view *view,
                      const struct making *making, struct frame *frame, struct error *err)
{
    struct renderer *renderer = context->renderer;
    struct opened_view opened;
    struct program_cache_stats before;
    uint64_t plans_made = context->plans.misses;
    double proof_ms;
    context->urgent_programs = (struct program_cache_stats){0};
    if (!open_view(context, scene_key, view, &opened, err) ||
        !prove(renderer, &opened, &proof_ms, err))
        return false;
    struct frame_observation observation = frame_observation_begin();
    program_cache_get_stats(renderer->programs, &before);
    if (gl_context_limits(renderer->gl)->compiles_in_parallel && context->plans.misses > plans_made)
        prepare_programs(context, &opened);
    for (int i = 0; i < opened.plan->plan.pass_count; i++)
        report_order_pass(&frame->report, opened.plan->plan.passes[i].pass);
    const struct content_key pace_key = pace_key_of(&opened);
    bool may_keep = may_keep_picture(context, &opened, making);
    const struct content_key picture = picture_key_of(renderer, &opened);
    if (may_keep && image_cache_has(&context->image_cache, picture) &&
        !context->image_cache.is_on_device)
        opened.view.screen.channels = 0; /* as it is kept */
    const struct frame_run run = {
        .context = context,
        .scene = opened.scene,
        .frame_plan = opened.plan,
        .view = &opened.view,
        .placement = view_placement_key(opened.scene->key, &opened.view),
        .state = opened.state,
        .camera = &opened.camera,
        .environment = &opened.environment,
        .frame = frame,
        .only_builds = making->only_builds,
        .shadow_frame = shadow_system_number_frame(renderer->shadows),
        .pace = time_slice_history_find(&context->time_slice_history, pace_key),
        .may_keep = may_keep,
        .picture = picture,
    };
    bool ok =
        (making->only_builds || create_outputs(&opened.view, frame, err)) && frame_run(&run, err);
    if (ok)
        fill_report(&opened.plan->plan, opened.scene, &opened.view, opened.state, &frame->report);
    report_choice(&opened.plan->plan, &frame->report);
    frame_observation_of_choice(&observation, &opened.plan->plan.choice);
    count_caches(context, &before, plans_made, &frame->report);
    frame->report.counts.states_reused = !context->has_new_state;
    context->has_new_state = false;
    frame->report.error_is_exact |= is_exact(&opened, &frame->report);
    /* what was expected is not what was done */
    if (frame->report.is_kept_picture || view->tile.width_px) {
        frame->report.chosen.expected_ms = 0;
        observation.is_open = false;
    }
    const struct frame_ending ending = {.frame = frame,
                                        .plan = &opened.plan->plan,
                                        .begin_ms = making->begin_ms + proof_ms,
                                        .scene_key = scene_key,
                                        .view = view,
                                        .pace_key = pace_key,
                                        .picture = run.picture,
                                        .observation = observation,
                                        .has_failed = !ok};
    ok = frame_in_flight_end(context, &ending, making->is_done, err);
    frame_context_end_frame(context);
    /* textures that it brought; not within a frame, whose state and plan would go too */
    if (!context->is_urgent && !frame_in_flight_is_cut(renderer))
        renderer_evict_others(renderer, opened.scene);
    if (ok)
        frame->report.resident_bytes = renderer_used_bytes(renderer);
    return ok;
}

/* Once more where lists were larger than was guessed, with their sizes read first. */
static bool make_frame(struct frame_context *context, const char *scene_key,
                       const struct view *view, const struct making *making, struct frame *frame,
                       struct error *err)
{
    bool reads_sizes = context->reads_sizes;
    bool ok = make_once(context, scene_key, view, making, frame, err);
    bool is_here = ok && (!making->is_done || *making->is_done);
    if (is_here && frame->report.has_cut_lists) {
        struct making again = *making;
        again.begin_ms += frame->report.paused_ms;
        frame_finish(frame);
        context->reads_sizes = true;
        ok = make_once(context, scene_key, view, &again, frame, err);
        context->reads_sizes = reads_sizes;
    }
    if (!context->is_urgent)
        frame_in_flight_deliver(context->renderer);
    return ok;
}

bool renderer_submit(struct renderer *renderer, const char *scene_key, const struct view *view,
                     struct frame *frame, bool *is_done, struct error *err)
{
    *frame = (struct frame){0};
    *is_done = true;
    struct frame_context *context = renderer_next_context(renderer, err);
    const struct making making = {.is_done = is_done, .begin_ms = wall_ms()};
    return context && make_frame(context, scene_key, view, &making, frame, err);
}

bool renderer_render(struct renderer *renderer, const char *scene_key, const struct view *view,
                     struct frame *frame, struct error *err)
{
    *frame = (struct frame){0};
    struct frame_context *context = renderer_next_context(renderer, err);
    const struct making making = {.begin_ms = wall_ms()};
    return context && make_frame(context, scene_key, view, &making, frame, err);
}

bool renderer_build(struct renderer *renderer, const char *scene_key, const struct view *view,
                    struct frame *frame, struct error *err)
{
    assert(!renderer_is_yielding(renderer));
    *frame = (struct frame){0};
    const struct making making = {.only_builds = true, .begin_ms = wall_ms()};
    return make_frame(&renderer->frames, scene_key, view, &making, frame, err);
}
