/* SPDX-License-Identifier: MIT */
/* Requirements of a frame, from its scene, view and quality, and the passes in their order. */
#include "renderer/plan/frame_plan.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "protocol/quality_defaults.h"
#include "renderer/base/sample_pattern.h"
#include "renderer/plan/traced.h"
#include "renderer/raytrace/rt_emitter.h"
#include "renderer/shadows/shadow_compress.h"
#include "renderer/shadows/shadows.h"
#include "renderer/shadows/technique.h"
#include "renderer/transparency/method.h"
#include "renderer/scene/atmosphere_grid.h"
#include "renderer/scene/haze_glow.h"
#include "renderer/scene/grid_texels.h"
#include "renderer/scene/smoke_lattice.h"
#include "renderer/scene/smoke_nodes.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

static bool can_multisample(const struct gl_limits *limits)
{
    return limits->max_samples >= SAMPLES_PER_ROUND &&
           limits->max_integer_samples >= SAMPLES_PER_ROUND;
}

int plan_samples(const struct view *view, const struct gl_limits *limits)
{
    int least = can_multisample(limits) && !view->wants_deep ? SAMPLES_DEFAULT : 1;
    return view->outputs & 1u << VIEW_OUTPUT_COLOR ? quality_or(view->quality.samples, least) : 1;
}

__attribute__((format(printf, 4, 5))) static void set_need(struct plan *plan, enum plan_need need,
                                                           bool is_met, const char *format, ...)
{
    struct plan_requirement *r = &plan->requirements[need];
    va_list arguments;
    r->need = need;
    r->is_met = is_met;
    va_start(arguments, format);
    vsnprintf(r->because, sizeof r->because, format, arguments);
    va_end(arguments);
}

static bool needs(const struct plan *plan, enum plan_need need)
{
    return plan->requirements[need].is_met;
}

bool plan_has_step(const struct plan *plan, enum plan_step step)
{
    for (int i = 0; i < plan->pass_count; i++)
        if (plan->passes[i].step == step)
            return true;
    return false;
}

bool plan_accumulates(const struct plan *plan, const struct view *view)
{
    return plan->rounds > 1 || (plan->has_glow && view->screen.has_backdrop);
}

bool plan_begins_step(const struct plan *plan, int pass)
{
    return pass == 0 || plan->passes[pass].step != plan->passes[pass - 1].step;
}

size_t plan_shadowed_lights(const struct plan *plan)
{
    size_t count = 0;
    for (int i = 0; i < SHADOWS_COUNT; i++)
        count += plan->lights_by_technique[i];
    return count;
}

/* Passes of one step must be added one after the other. */
static void add_pass(struct plan *plan, enum plan_need need, enum plan_step step, const char *pass,
                     const char *technique, uint64_t bytes)
{
    if (!needs(plan, need))
        return;
    assert(plan->pass_count < PLAN_PASSES_MAX);
    assert(!plan->pass_count || plan->passes[plan->pass_count - 1].step <= step);
    struct plan_pass *line = &plan->passes[plan->pass_count++];
    *line = (struct plan_pass){.need = need, .step = step, .bytes = bytes};
    snprintf(line->pass, sizeof line->pass, "%s", pass);
    snprintf(line->technique, sizeof line->technique, "%s", technique);
}

/* ---- requirements ---- */

static void require_overlay(struct plan *plan, const struct view *view)
{
    size_t nodes = view->highlight.node_count;
    bool has_color = view->outputs & 1u << VIEW_OUTPUT_COLOR;
    bool is_asked = nodes > 0 || view->edges.is_drawn;
    set_need(plan, PLAN_NEED_OVERLAY, has_color && is_asked, "%s",
             !is_asked              ? "neither edges nor a highlight were asked for"
             : !has_color           ? "no color output was asked for"
             : !nodes               ? "edges were asked for"
             : view->edges.is_drawn ? "edges and a highlight were asked for"
                                    : "a highlight was asked for");
}

static void require_outputs(struct plan *plan, const struct frame_plan_desc *desc)
{
    uint32_t color = 1u << VIEW_OUTPUT_COLOR, outputs = desc->view->outputs;
    int auxiliary = __builtin_popcount(outputs & ~color);
    char because[REPORT_TEXT_BYTES];
    bool is_traced = plan_is_raytraced(desc->view, desc->state, &plan->choice, because);
    set_need(plan, PLAN_NEED_COLOR, outputs & color && !is_traced, "%s",
             is_traced         ? "the color output is ray traced"
             : outputs & color ? "the color output was asked for"
                               : "no color output was asked for");
    set_need(plan, PLAN_NEED_TRACED, is_traced, "%s",
             is_traced              ? because
             : plan->choice.is_open ? plan->choice.because
                                    : "the rasteriser can draw every light that there is");
    set_need(plan, PLAN_NEED_AUXILIARY, auxiliary > 0, "%d auxiliary output%s asked for", auxiliary,
             auxiliary == 1 ? " was" : "s were");
    set_need(plan, PLAN_NEED_DEEP, desc->view->wants_deep && outputs & color, "%s",
             desc->view->wants_deep ? "a deep image was asked for" : "no deep image was asked for");
    require_overlay(plan, desc->view);
}

/* A frame of which nothing is drawn: why its drawables and shadows are not counted. */
static const char *why_not_drawn(const struct plan *plan)
{
    return needs(plan, PLAN_NEED_TRACED) ? "not counted: rays find surfaces, layers and shadows"
                                         : "not counted: no output needs them";
}

/* Whether some drawable of the scene bends decides the programs, so that a camera that moves
 * compiles nothing; what is in view, the passes. */
static void require_refraction(struct frame_plan *made, const struct frame_plan_desc *desc)
{
    struct plan *plan = &made->plan;
    const struct geometry_items *items = &made->items;
    const bool is_off = desc->view->quality.refraction == VIEW_REFRACTION_OFF;
    const struct state_item *all = desc->state->items;
    for (size_t i = 0; i < items->transparent_count; i++)
        plan->bending_items += all[items->transparent[i]].bend != STATE_BEND_NONE;
    for (size_t i = 0; i < items->medium_count; i++)
        plan->bending_items += all[items->media[i]].bend != STATE_BEND_NONE;
    for (size_t i = 0; i < desc->state->item_count && !is_off; i++)
        made->shaders.refracts |= all[i].bend != STATE_BEND_NONE;
    set_need(plan, PLAN_NEED_REFRACTION,
             needs(plan, PLAN_NEED_COLOR) && !is_off && plan->bending_items > 0,
             is_off ? "quality.refraction is off, %zu of %zu transparent drawables would bend"
                    : "%zu of %zu transparent drawables in view refract or scatter",
             plan->bending_items, plan->transparent_items);
}

static bool require_geometry(struct frame_plan *made, const struct frame_plan_desc *desc,
                             struct error *err)
{
    struct plan *plan = &made->plan;
    const struct geometry_items *items = &made->items;
    struct window_frame frame = {.state = desc->state, .camera = desc->camera};
    bool is_drawn = needs(plan, PLAN_NEED_COLOR) || needs(plan, PLAN_NEED_AUXILIARY);
    if (is_drawn &&
        !(desc->sees_all ? geometry_take_all : geometry_cull)(&frame, &made->items, err))
        return false;
    for (size_t i = 0; i < desc->state->item_count; i++)
        plan->has_layers |= desc->state->items[i].class_ == STATE_TRANSPARENT;
    plan->opaque_items = items->opaque_count;
    plan->transparent_items = items->transparent_count + items->medium_count;
    set_need(plan, PLAN_NEED_SURFACES, is_drawn, "%zu of %zu drawables are opaque and in view",
             plan->opaque_items, desc->state->item_count);
    set_need(plan, PLAN_NEED_LAYERS, plan->transparent_items > 0,
             "%zu of %zu drawables are transparent and in view", plan->transparent_items,
             desc->state->item_count);
    if (!is_drawn) /* and so none was counted */
        for (int need = PLAN_NEED_SURFACES; need <= PLAN_NEED_LAYERS; need++)
            set_need(plan, (enum plan_need)need, false, "%s", why_not_drawn(plan));
    require_refraction(made, desc);
    bool has_choice = needs(plan, PLAN_NEED_COLOR);
    plan->samples = plan_samples(desc->view, desc->limits);
    plan->target_samples = 1; /* auxiliary outputs take one */
    if (has_choice && plan->samples >= SAMPLES_PER_ROUND && can_multisample(desc->limits))
        plan->target_samples = SAMPLES_PER_ROUND;
    plan->rounds = has_choice ? plan->samples / plan->target_samples : 1;
    set_need(plan, PLAN_NEED_ANTIALIASING, has_choice && plan->samples > 1,
             plan->rounds > 1 ? "%d sample%s per pixel, in %d rounds" : "%d sample%s per pixel",
             plan->samples, plan->samples == 1 ? "" : "s", plan->rounds);
    return true;
}

/* Counts the lights of one kind of shadow, for a sentence of the plan. */
struct shadow_census {
    size_t lights, casters;
};

/* What the technique of a light does to its transparent casters, and not as they would. */
static void count_lacks(struct plan *plan, const struct shadow_need *light, bool is_hazy)
{
    enum shadow_technique id = light->method->id;
    const struct shadow_casters *casters = &light->casters;
    if (!casters->transparent_count)
        return;
    plan->gray_lights += !shadow_technique_can(id, SHADOW_CAN_COLOR);
    plan->layered_lights += casters->has_layers && !shadow_technique_can(id, SHADOW_CAN_LAYERS);
    plan->bodied_lights += (is_hazy ? casters->has_layers : casters->has_bodies) &&
                           shadow_technique_can(id, SHADOW_CAN_LAYERS) &&
                           !shadow_technique_can(id, SHADOW_CAN_INSIDE);
    plan->excluding_lights +=
        casters->has_exclusions && !shadow_technique_can(id, SHADOW_CAN_SELF_SHADOW);
}

static void count_light(struct plan *plan, const struct shadow_need *light,
                        const struct frame_plan_desc *desc, struct shadow_census census[2])
{
    bool filters = light->has_structure && light->method->structure->filters;
    if (light->method)
        plan->lights_by_technique[light->method->id]++;
    if (light->is_traced) {
        plan->traced_lights++;
        plan->window_shadows = light->method;
        return;
    }
    plan->unfiltered_lights += light->casters.transparent_count > 0 && !filters;
    if (!light->has_structure) {
        plan->unshadowed_lights++;
        return;
    }
    uint64_t resolution = (uint64_t)shadow_resolution(&desc->view->quality, desc->limits);
    plan->shadow_texels += (uint64_t)light->frame.face_count * resolution * resolution;
    census[0].lights += light->casters.opaque_count > 0;
    census[0].casters += light->casters.opaque_count;
    if (filters)
        count_lacks(plan, light, view_has_atmosphere(desc->view) || desc->state->grid_count > 0);
    census[1].lights += filters;
    census[1].casters += filters ? light->casters.transparent_count : 0;
}

/* Shading takes points of area lights where rays find the shadow of each, else the whole. */
static void require_areas(struct shader_needs *shaders, const struct frame_plan_desc *desc)
{
    const struct view_quality *quality = &desc->view->quality;
    for (size_t i = 0; i < desc->state->light_count; i++) {
        if (!state_light_is_area(&desc->state->lights[i]))
            continue;
        shaders->has_area_form = !shadow_is_per_window(quality->shadows) ||
                                 !shadow_technique_can(quality->shadows, SHADOW_CAN_AREA_LIGHTS);
        shaders->area_samples =
            shaders->has_area_form ? 0 : rt_light_sample_count(&desc->state->lights[i], quality);
        return;
    }
}

static bool has_maps(const struct view_quality *quality)
{
    const struct shadow_method *method = shadow_method_of(quality->shadows);
    return method && method->structure->scope == SHADOW_PER_LIGHT;
}

static bool require_lights(struct frame_plan *made, const struct frame_plan_desc *desc,
                           struct error *err)
{
    struct plan *plan = &made->plan;
    struct shadow_census census[2] = {{0}};
    bool is_lit = needs(plan, PLAN_NEED_COLOR);
    bool is_listed = is_lit || desc->view->outputs & 1u << VIEW_OUTPUT_LIGHTS;
    size_t lights = desc->state->light_count;
    int resolution = shadow_resolution(&desc->view->quality, desc->limits);
    if (!is_listed)
        light_reach_finish(&made->reach); /* whoever chose may have found it */
    if (is_listed && !made->reach.is_in_view && !desc->sees_all &&
        !light_reach_collect(&made->reach, desc->state, desc->camera, err))
        return false;
    if (is_lit &&
        !shadow_needs_init(&made->shadows,
                           &(struct shadow_needs_desc){
                               .state = desc->state,
                               .quality = &desc->view->quality,
                               .is_in_view = desc->sees_all ? NULL : made->reach.is_in_view,
                               .resolution = resolution,
                           },
                           err))
        return false;
    for (size_t i = 0; i < made->shadows.light_count; i++)
        if (!made->shadows.lights[i].is_unseen)
            count_light(plan, &made->shadows.lights[i], desc, census);
    for (size_t i = 0;
         i < made->shadows.light_count && shadow_compress_is_asked(&desc->view->quality); i++)
        plan->compressed_lights += shadow_need_may_compress(&made->shadows.lights[i]);
    require_areas(&made->shaders, desc);
    plan->lobes = shader_needs_lobes(made->shaders.surface_kinds);
    made->shaders.has_normal_offset =
        made->shaders.has_smooth && is_lit && has_maps(&desc->view->quality);
    plan->unseen_lights = made->reach.unseen_count;
    plan->least_batches =
        shadow_needs_least_batches(&made->shadows, resolution, desc->shadow_budget_bytes);
    set_need(plan, PLAN_NEED_LIGHTS, is_listed && lights > 0,
             is_listed ? "%zu light%s, %zu of them out of view" : "%zu light%s, in no list", lights,
             lights == 1 ? "" : "s", plan->unseen_lights);
    set_need(plan, PLAN_NEED_OPAQUE_SHADOWS, census[0].lights + census[1].lights > 0,
             "%zu of %zu lights have opaque casters in reach, %zu in all", census[0].lights, lights,
             census[0].casters);
    set_need(plan, PLAN_NEED_FILTERED_SHADOWS, census[1].lights > 0,
             "%zu of %zu lights have transparent casters in reach, %zu in all", census[1].lights,
             lights, census[1].casters);
    if (plan->unfiltered_lights)
        set_need(plan, PLAN_NEED_FILTERED_SHADOWS, census[1].lights > 0,
                 "quality.shadows is %s: transparent casters in reach of %zu of %zu lights cast no "
                 "shadow",
                 shadow_technique_name((int)desc->view->quality.shadows), plan->unfiltered_lights,
                 lights);
    set_need(plan, PLAN_NEED_TRACED_SHADOWS, plan->traced_lights > 0,
             "%zu of %zu lights have casters in reach of their rays", plan->traced_lights, lights);
    if (!is_lit && needs(plan, PLAN_NEED_TRACED))
        for (int need = PLAN_NEED_OPAQUE_SHADOWS; need <= PLAN_NEED_TRACED_SHADOWS; need++)
            set_need(plan, (enum plan_need)need, false, "%s", why_not_drawn(plan));
    if (desc->view->quality.shadows == SHADOWS_NONE)
        for (int need = PLAN_NEED_OPAQUE_SHADOWS; need <= PLAN_NEED_FILTERED_SHADOWS; need++)
            set_need(plan, (enum plan_need)need, false, "quality.shadows is none");
    return true;
}

/* Rays towards a map, where something may be in its way. */
static void require_visibility(struct frame_plan *made, const struct frame_plan_desc *desc)
{
    struct plan *plan = &made->plan;
    const struct view *view = desc->view;
    const struct view_quality *quality = &view->quality;
    bool has_map = view_has_environment(view) && view->environment_intensity > 0;
    bool is_asked = quality->environment_visibility == VIEW_VISIBILITY_RAYS;
    size_t casters = desc->state->item_count;
    bool is_met = needs(plan, PLAN_NEED_COLOR) && has_map && is_asked && casters > 0;
    set_need(plan, PLAN_NEED_VISIBILITY, is_met, "%s",
             !needs(plan, PLAN_NEED_COLOR) ? "no color is rasterised"
             : !has_map                    ? "no environment map shines"
             : !is_asked ? "quality.environment_visibility is none: its light passes everything"
             : !casters  ? "nothing is there"
                         : "rays find what is in the way of the environment's light");
    uint32_t kinds = made->shaders.surface_kinds | made->shaders.layer_kinds;
    made->shaders.visibility_lobes = !is_met                        ? 0
                                     : kinds & MATERIAL_TRANSLUCENT ? VISIBILITY_BEHIND + 1
                                                                    : VISIBILITY_MIRRORED + 1;
}

static void require_atmosphere(struct plan *plan, const struct frame_plan_desc *desc)
{
    const size_t lights = desc->state->light_count;
    bool is_drawn = needs(plan, PLAN_NEED_COLOR), is_there = view_has_atmosphere(desc->view);
    set_need(plan, PLAN_NEED_ATMOSPHERE, is_drawn && is_there && lights > 0, "%s",
             !is_drawn   ? "no color is rasterised"
             : !is_there ? "there is no atmosphere"
             : !lights   ? "no light shines into the atmosphere"
                         : "lights shine into the atmosphere");
}

static bool is_lamp(const struct state_light *light)
{
    return light->type != SCENE_LIGHT_DIRECTIONAL && !state_light_is_area(light);
}

/* Rays find the light of lamps by themselves, and smoke has its own. */
static void find_glow(struct plan *plan, const struct frame_plan_desc *desc)
{
    const struct scene_state *state = desc->state;
    struct haze_glow glows[HAZE_GLOWS_MOST];
    bool may_glow = needs(plan, PLAN_NEED_ATMOSPHERE) && !needs(plan, PLAN_NEED_TRACED_SHADOWS) &&
                    !state->grid_count;
    for (size_t i = 0; may_glow && desc->sees_all && i < state->light_count; i++)
        plan->has_glow |= is_lamp(&state->lights[i]);
    if (may_glow && !desc->sees_all)
        plan->has_glow = haze_glows_find(desc->view, state, desc->camera,
                                         atmosphere_side_px(desc->view), glows) > 0;
}

static bool require_smoke(struct plan *plan, const struct frame_plan_desc *desc, struct error *err)
{
    const size_t lights = desc->state->light_count, grids = desc->state->grid_count;
    bool is_drawn = needs(plan, PLAN_NEED_COLOR);
    set_need(plan, PLAN_NEED_SMOKE, is_drawn && grids && lights > 0, "%s",
             !is_drawn ? "no color is rasterised"
             : !grids  ? "there are no density grids"
             : !lights ? "no light shines into density grids"
                       : "lights shine into density grids");
    bool are_summed = desc->view->outputs & 1u << VIEW_OUTPUT_OPTICAL_DEPTH;
    const char *excess = is_drawn || are_summed ? grid_texels_excess(desc->state) : NULL;
    return !excess ||
           error_set(err, ERROR_UNSUPPORTED, "%s, and %s", excess,
                     is_drawn ? "rasterised pictures have no more: shadows must be raytraced"
                              : "the output optical_depth has no more");
}

/* The technique of a light whose filters it knows, and whose media it does not. */
static enum shadow_technique find_thick_media(const struct shadow_needs *shadows)
{
    enum shadow_technique found = SHADOWS_AUTO;
    for (size_t i = 0; i < shadows->light_count; i++) {
        const struct shadow_need *light = &shadows->lights[i];
        if (light->has_structure && light->casters.has_media &&
            shadow_technique_can(light->method->id, SHADOW_CAN_FILTER) &&
            !shadow_technique_can(light->method->id, SHADOW_CAN_MEDIA))
            found = light->method->id;
    }
    return found;
}

static bool check_device(const struct plan *plan, const struct frame_plan_desc *desc,
                         struct error *err)
{
    for (int id = 0; id < SHADOWS_COUNT; id++) {
        const struct shadow_method *method = shadow_method_of((enum shadow_technique)id);
        if (plan->lights_by_technique[id] && method->check &&
            !method->check(desc->state, &desc->view->quality, desc->limits, err))
            return false;
    }
    return true;
}

/* Of the lights whose shadows are found for each window. */
static const char *find_fall_back(const struct plan *plan, const struct frame_plan_desc *desc)
{
    const struct shadow_method *method = plan->window_shadows;
    return method && method->fall_back ? method->fall_back(desc->state, &desc->view->quality)
                                       : NULL;
}

static bool check_technique(struct frame_plan *made, const struct frame_plan_desc *desc,
                            struct error *err)
{
    struct plan *plan = &made->plan;
    return technique_check(
        &(struct technique_demand){
            .quality = &desc->view->quality,
            .is_rasterised = needs(plan, PLAN_NEED_COLOR),
            .lights = desc->state->light_count,
            .area_lights = scene_state_area_lights(desc->state),
            .unfiltered_lights = plan->unfiltered_lights,
            .gray_lights = plan->gray_lights,
            .layered_lights = plan->layered_lights,
            .bodied_lights = plan->bodied_lights,
            .excluding_lights = plan->excluding_lights,
            .is_hazy = needs(plan, PLAN_NEED_ATMOSPHERE) ||
                       (needs(plan, PLAN_NEED_TRACED) && view_has_atmosphere(desc->view)),
            .has_grids = desc->state->grid_count > 0 &&
                         (needs(plan, PLAN_NEED_COLOR) || needs(plan, PLAN_NEED_TRACED)),
            .window_lights = plan->traced_lights,
            .thick_media = find_thick_media(&made->shadows),
            .unfit_casters = needs(plan, PLAN_NEED_COLOR) ? plan->unfit_casters : 0,
            .asked = plan->unfit_technique,
            .fall_back = find_fall_back(plan, desc)},
        &plan->lacks, err);
}

/* A deep image has the lists of the rasteriser, of which each pixel has one. */
static bool check_deep(const struct frame_plan *made, const struct frame_plan_desc *desc,
                       struct error *err)
{
    const struct plan *plan = &made->plan;
    if (!needs(plan, PLAN_NEED_DEEP))
        return true;
    if (needs(plan, PLAN_NEED_TRACED))
        return error_set(err, ERROR_UNSUPPORTED,
                         "deep images are rasterised, and this picture is ray traced: name a "
                         "technique of shadows that is not, such as deep");
    if (made->shaders.refracts)
        return error_set(err, ERROR_UNSUPPORTED,
                         "drawables refract or scatter what is behind them, and a deep image is "
                         "seen straight: quality.refraction must be off");
    if (view_has_atmosphere(desc->view))
        return error_set(err, ERROR_UNSUPPORTED, "deep images have no haze: leave atmosphere out");
    if (desc->state->grid_count)
        return error_set(err, ERROR_UNSUPPORTED,
                         "deep images have no density grids: hide the nodes that show them");
    if (plan->samples != 1)
        return error_set(err, ERROR_UNSUPPORTED,
                         "deep images have one sample per pixel, not %d: quality.samples must be 1",
                         plan->samples);
    return true;
}

/* ---- passes ---- */

static void add_shadow_pass(struct plan *plan, enum plan_need need, enum plan_step step,
                            const struct shadow_method *method, const struct shadow_pass *pass)
{
    int before = plan->pass_count;
    add_pass(plan, need, step, pass->name, shadow_technique_name((int)method->id), 0);
    if (plan->pass_count > before)
        plan->passes[before].is_conditional = pass->is_conditional;
}

static void plan_shadows(struct plan *plan)
{
    /* the depth is drawn for every structure, even where nothing opaque casts or none reads it */
    enum plan_need depth = needs(plan, PLAN_NEED_OPAQUE_SHADOWS) ? PLAN_NEED_OPAQUE_SHADOWS
                                                                 : PLAN_NEED_FILTERED_SHADOWS;
    add_pass(plan, depth, PLAN_STEP_SHADOWS, shadow_depth_pass.name,
             shadow_technique_name((int)shadow_depth_pass.technique), plan->shadow_texels * 4);
    for (int id = 0; id < SHADOWS_COUNT; id++) {
        const struct shadow_method *method = shadow_method_of((enum shadow_technique)id);
        if (!plan->lights_by_technique[id] || method->structure->scope != SHADOW_PER_LIGHT)
            continue;
        for (const struct shadow_pass *pass = method->structure->passes; pass->name; pass++)
            if (!pass->is_of_nodes || plan->compressed_lights)
                add_shadow_pass(plan, PLAN_NEED_FILTERED_SHADOWS, PLAN_STEP_SHADOWS, method, pass);
    }
}

static bool has_pass(const struct plan *plan, const char *name)
{
    for (int i = 0; i < plan->pass_count; i++)
        if (!strcmp(plan->passes[i].pass, name))
            return true;
    return false;
}

/* The passes of rays to the environment, which share some with traced shadows. */
static void plan_visibility(struct plan *plan, enum plan_step step)
{
    static const char *const names[] = {"raytrace.build", "shadow.points", "environment.trace"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if ((i > 0) == (step == PLAN_STEP_SHADOW_POINTS) && !has_pass(plan, names[i]))
            add_pass(plan, PLAN_NEED_VISIBILITY, step, names[i], PLAN_RAYS, 0);
}

/* The passes of a technique that looks at windows: before them, or with each. */
static void plan_rays(struct plan *plan, enum plan_step step)
{
    const struct shadow_method *method = plan->window_shadows;
    for (const struct shadow_pass *pass = method ? method->structure->passes : NULL;
         pass && pass->name; pass++)
        if (pass->is_of_windows == (step == PLAN_STEP_SHADOW_POINTS))
            add_shadow_pass(plan, PLAN_NEED_TRACED_SHADOWS, step, method, pass);
    plan_visibility(plan, step);
}

static uint64_t targets_bytes(const struct plan *plan, const struct view *view,
                              const struct scene_state *state)
{
    uint64_t pixels = (uint64_t)view->width_px * (uint64_t)view->height_px;
    uint64_t refraction = needs(plan, PLAN_NEED_REFRACTION) ? TARGETS_REFRACTION_PIXEL_BYTES : 0;
    uint64_t sums =
        plan_accumulates(plan, view) ? targets_sum_pixel_bytes(view->screen.has_backdrop) : 0;
    uint64_t haze = needs(plan, PLAN_NEED_ATMOSPHERE) ? atmosphere_pixel_bytes(view) : 0;
    uint64_t smoke = needs(plan, PLAN_NEED_SMOKE) ? smoke_pixel_bytes(view, state) : 0;
    return pixels * (targets_pixel_bytes(plan->target_samples, plan->lobes) + refraction + sums +
                     haze + smoke);
}

/* Adds a pass that runs only if a count, which only drawing can tell, is not 0. */
static void add_layer_pass(struct plan *plan, enum plan_step step,
                           const struct transparency_pass *pass)
{
    if (!needs(plan, PLAN_NEED_LAYERS))
        return;
    const char *technique = transparency_name((int)plan->transparency->id);
    add_pass(plan, PLAN_NEED_LAYERS, step, pass->name, technique, 0);
    plan->passes[plan->pass_count - 1].is_conditional = pass->is_conditional;
}

static void plan_layers(struct plan *plan, enum plan_step step)
{
    for (const struct transparency_pass *pass = plan->transparency->passes; pass->name; pass++)
        if (pass->is_of_light == (step == PLAN_STEP_SHADE))
            add_layer_pass(plan, step, pass);
}

/* The method for what the frame asks of its surfaces: one that can all where the one that the
 * request names cannot. */
static void choose_transparency(struct plan *plan, const struct frame_plan *made,
                                const struct frame_plan_desc *desc)
{
    const struct view *view = desc->view;
    if (made->items.medium_count)
        plan->layer_needs |= TRANSPARENCY_CAN_MEDIA;
    if (needs(plan, PLAN_NEED_TRACED_SHADOWS) || needs(plan, PLAN_NEED_VISIBILITY))
        plan->layer_needs |= TRANSPARENCY_CAN_TRACED_SHADOWS;
    if (needs(plan, PLAN_NEED_AUXILIARY))
        plan->layer_needs |= TRANSPARENCY_CAN_OUTPUTS;
    if (needs(plan, PLAN_NEED_REFRACTION))
        plan->layer_needs |= TRANSPARENCY_CAN_REFRACTION;
    if (view_has_atmosphere(view) || desc->state->grid_count) /* without light they dim, too */
        plan->layer_needs |= TRANSPARENCY_CAN_HAZE;
    if (needs(plan, PLAN_NEED_DEEP))
        plan->layer_needs |= TRANSPARENCY_CAN_DEEP;
    if (desc->state->ground_plane.is_there)
        plan->layer_needs |= TRANSPARENCY_CAN_GROUND;
    plan->transparency = transparency_method_of(view->quality.transparency);
    plan->transparency_lacks =
        needs(plan, PLAN_NEED_LAYERS)
            ? transparency_method_lacks(plan->transparency, plan->layer_needs)
            : 0;
    if (plan->transparency_lacks)
        plan->transparency = transparency_method_of(TRANSPARENCY_AUTO);
}

/* Adds the passes of renderer/window/apart.h. */
static void plan_apart(struct plan *plan)
{
    if (!needs(plan, PLAN_NEED_LIGHTS) || plan->target_samples == 1)
        return;
    add_pass(plan, PLAN_NEED_ANTIALIASING, PLAN_STEP_SHADE, "shade.contrast", "msaa4", 0);
    add_pass(plan, PLAN_NEED_ANTIALIASING, PLAN_STEP_SHADE, "shade.apart", "msaa4", 0);
    plan->passes[plan->pass_count - 1].is_conditional = true; /* only where light differs */
}

/* Light of haze is found by the device, or by the rays that find shadows. */
static void plan_atmosphere(struct plan *plan)
{
    static const char technique[] = "froxels";
    const struct shadow_method *method = plan->window_shadows;
    if (method && needs(plan, PLAN_NEED_TRACED_SHADOWS)) {
        add_pass(plan, PLAN_NEED_ATMOSPHERE, PLAN_STEP_SHADE, "atmosphere.trace",
                 shadow_technique_name((int)method->id), 0);
    } else {
        add_pass(plan, PLAN_NEED_ATMOSPHERE, PLAN_STEP_SHADE, "atmosphere.reach", technique, 0);
        add_pass(plan, PLAN_NEED_ATMOSPHERE, PLAN_STEP_SHADE, "atmosphere.light", technique, 0);
    }
    add_pass(plan, PLAN_NEED_ATMOSPHERE, PLAN_STEP_SHADE, "atmosphere.sum", technique, 0);
    for (int i = 0; i < 2 && plan->has_glow; i++)
        add_pass(plan, PLAN_NEED_ATMOSPHERE, PLAN_STEP_SHADE,
                 i ? "atmosphere.glow-sum" : "atmosphere.glow", "ways", 0);
}

static void plan_smoke(struct plan *plan, const struct frame_plan_desc *desc)
{
    if (!shadow_quality_holds_grids(&desc->view->quality) &&
        smoke_lattice_serves(desc->view, desc->state, desc->camera, desc->depths_bytes))
        add_pass(plan, PLAN_NEED_SMOKE, PLAN_STEP_SHADE, "smoke.depths", "lattice",
                 smoke_lattice_bytes(desc->state));
    add_pass(plan, PLAN_NEED_SMOKE, PLAN_STEP_SHADE, "smoke.light", "froxels", 0);
}

static void plan_passes(struct plan *plan, const struct frame_plan_desc *desc)
{
    const struct view_quality *quality = &desc->view->quality;
    bool is_linked = quality->light_lists == VIEW_LIGHT_LISTS_LINKED;
    const char *lists = is_linked ? "linked" : "clustered";
    if (is_linked && quality->faithful)
        lists = "linked-faithful";
    const char *form = quality->reference ? "reference" : "raytraced";
    add_pass(plan, PLAN_NEED_TRACED, PLAN_STEP_TRACE, "raytrace.build", form, 0);
    if (view_has_atmosphere(desc->view) && !quality->reference)
        add_pass(plan, PLAN_NEED_TRACED, PLAN_STEP_TRACE, "raytrace.haze", form, 0);
    add_pass(plan, PLAN_NEED_TRACED, PLAN_STEP_TRACE, "raytrace.trace", form, 0);
    plan_shadows(plan);
    plan_rays(plan, PLAN_STEP_RAYS);
    add_pass(plan, PLAN_NEED_SURFACES, PLAN_STEP_SURFACES, "gbuffer", "",
             targets_bytes(plan, desc->view, desc->state));
    plan_layers(plan, PLAN_STEP_LAYERS);
    add_pass(plan, PLAN_NEED_LIGHTS, PLAN_STEP_LIGHT_LISTS, "light_list", lists, 0);
    plan_rays(plan, PLAN_STEP_SHADOW_POINTS);
    if (needs(plan, PLAN_NEED_COLOR))
        plan_layers(plan, PLAN_STEP_SHADE);
    plan_atmosphere(plan);
    plan_smoke(plan, desc);
    add_pass(plan, PLAN_NEED_COLOR, PLAN_STEP_SHADE, "shade.opaque",
             plan->target_samples > 1 ? "msaa4" : "", 0);
    plan_apart(plan);
    if (plan->has_glow)
        add_pass(plan, PLAN_NEED_ATMOSPHERE, PLAN_STEP_SHADE, "atmosphere.glow-add", "ways", 0);
    for (int i = 0; i < 2; i++)
        add_pass(plan, PLAN_NEED_REFRACTION, PLAN_STEP_REFRACT,
                 i ? "refraction" : "refraction.blur", "screen-space", 0);
    if (plan->rounds > 1)
        add_pass(plan, PLAN_NEED_ANTIALIASING, PLAN_STEP_ACCUMULATE, "accumulate", "", 0);
    else if (plan_accumulates(plan, desc->view)) /* the glow is added before */
        add_pass(plan, PLAN_NEED_ATMOSPHERE, PLAN_STEP_ACCUMULATE, "accumulate", "", 0);
    add_pass(plan, PLAN_NEED_DEEP, PLAN_STEP_DEEP, "deep-image", "", 0);
    add_pass(plan, PLAN_NEED_COLOR, PLAN_STEP_READ, "readback", "", 0);
    add_pass(plan, PLAN_NEED_AUXILIARY, PLAN_STEP_AUXILIARY, "aov", "", 0);
    if (desc->view->edges.is_drawn)
        add_pass(plan, PLAN_NEED_OVERLAY, PLAN_STEP_OVERLAY, "overlay.edges", "", 0);
    if (desc->view->highlight.node_count)
        add_pass(plan, PLAN_NEED_OVERLAY, PLAN_STEP_OVERLAY, "overlay.highlight", "", 0);
}

/* The technique that answers for a frame with casters that its own cannot answer for. */
static void replace_unfit(struct plan *plan, const struct scene_state *state,
                          struct view_quality *quality)
{
    const struct shadow_method *method = shadow_method_of(quality->shadows);
    plan->unfit_casters = shadow_method_count_unfit(method, state, quality);
    if (!plan->unfit_casters)
        return;
    plan->unfit_technique = quality->shadows;
    quality->shadows = method->instead->id;
}

bool frame_plan_init(struct frame_plan *plan, const struct frame_plan_desc *desc, struct error *err)
{
    struct view view = *desc->view;
    struct frame_plan_desc chosen = *desc;
    *plan = (struct frame_plan){.shaders = shader_needs_of(desc->state)};
    if (desc->reach) {
        plan->reach = *desc->reach;
        *desc->reach = (struct light_reach){0};
    }
    if (view.choice && view.quality.shadows == SHADOWS_AUTO)
        plan->plan.choice = *view.choice;
    require_outputs(&plan->plan, desc);
    chosen.view = &view;
    if (plan->plan.choice.is_open && !shadow_technique_is_renderer(plan->plan.choice.technique))
        view.quality.shadows = plan->plan.choice.technique;
    replace_unfit(&plan->plan, desc->state, &view.quality);
    require_atmosphere(&plan->plan, &chosen);
    if (!require_smoke(&plan->plan, &chosen, err) || !require_geometry(plan, &chosen, err) ||
        !require_lights(plan, &chosen, err) || !check_technique(plan, &chosen, err) ||
        !check_device(&plan->plan, &chosen, err) || !check_deep(plan, &chosen, err))
        goto fail;
    require_visibility(plan, &chosen);
    find_glow(&plan->plan, &chosen);
    choose_transparency(&plan->plan, plan, &chosen);
    plan_passes(&plan->plan, &chosen);
    return true;

fail:
    frame_plan_finish(plan);
    return false;
}

void frame_plan_finish(struct frame_plan *plan)
{
    geometry_items_finish(&plan->items);
    light_reach_finish(&plan->reach);
    shadow_needs_finish(&plan->shadows);
    *plan = (struct frame_plan){0};
}
