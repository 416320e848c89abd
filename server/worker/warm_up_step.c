/* SPDX-License-Identifier: MIT */
/* The pictures that are asked for first, drawn small; then their programs. */
#include "server/worker/warm_up_step.h"

#include <stdlib.h>
#include <string.h>

#include "server/mapping/questions.h"
#include "server/mapping/view_mapping.h"
#include "server/worker/chooser.h"

enum {
    /* Small pictures have the shape of the default size, and so the same lights and casters. */
    SMALL_WIDTH = 64,
    SMALL_HEIGHT = 36,
};

/* The first requests for a scene: a render, and a view at rest and in motion. Pictures in motion
 * have one sample per pixel (protocol/view_document.h). */
static const struct view_quality cases[] = {
    {.expects_reuse = false},
    {.expects_reuse = true},
    {.expects_reuse = true, .samples = 1, .shadow_taps = 1},
};

/* The counts of the answer. */
struct warm_up_done {
    uint64_t pictures, shadow_maps_built, ray_structures_built;
};

struct warming {
    const struct warm_up_step_desc *desc;
    const struct view *view;         /* of the default size */
    bool is_small[SHADOWS_COUNT][2]; /* drawn, by whether in motion */
    bool is_built[SHADOWS_COUNT];
    struct warm_up_done done;
    const char *left; /* NULL: nothing, so far */
};

/* Whoever comes goes before what nobody asked for: the picture ends. */
static bool gives_way(void *desc, struct error *err)
{
    (void)desc;
    (void)err;
    return false;
}

static bool is_due(void *desc)
{
    const struct warm_up_step_desc *step = desc;
    return step->shall_stop(step->context);
}

static void count(const struct frame_report *report, struct warm_up_done *done)
{
    done->shadow_maps_built += report->counts.shadow_maps_built;
    for (int i = 0; i < report->pass_count; i++)
        done->ray_structures_built += strcmp(report->passes[i].pass, "raytrace.build") == 0;
}

/* Draws the view, or only builds what pictures like it keep. */
static bool make(struct warming *warming, const struct view *view, bool draws, struct error *err)
{
    const struct warm_up_step_desc *desc = warming->desc;
    const struct yield_point yield = {
        .context = (void *)(uintptr_t)desc, .should_yield = is_due, .run_urgent = gives_way};
    struct frame frame = {0};
    const char *scene = desc->request->scene;
    renderer_set_yield_point(desc->renderer, &yield);
    bool is_good = draws ? renderer_render(desc->renderer, scene, view, &frame, err)
                         : renderer_build(desc->renderer, scene, view, &frame, err);
    renderer_set_yield_point(desc->renderer, NULL);
    count(&frame.report, &warming->done);
    warming->done.pictures += is_good && draws;
    frame_finish(&frame);
    return is_good;
}

/* The technique of the picture: of a rasterised one that of any light, if it is a candidate of
 * `auto`. */
static enum shadow_technique technique_of(const struct plan *plan)
{
    enum shadow_technique technique = SHADOWS_RASTER_DEFAULT;
    if (plan->requirements[PLAN_NEED_TRACED].is_met)
        return SHADOWS_RAYTRACED;
    for (int i = 0; i < SHADOWS_COUNT; i++)
        if (plan->lights_by_technique[i] && shadow_technique_is_candidate((enum shadow_technique)i))
            technique = (enum shadow_technique)i;
    return technique;
}

/* Finds the technique that `auto` takes for the view. */
static bool choose(const struct warming *warming, const struct view *view,
                   enum shadow_technique *technique, struct error *err)
{
    const struct warm_up_step_desc *desc = warming->desc;
    const char *scene = desc->request->scene;
    struct auto_choice choice;
    struct view chosen = *view;
    struct plan *plan = calloc(1, sizeof *plan);
    if (!plan)
        return error_set(err, ERROR_NO_MEMORY, "plan");
    bool is_good = chooser_choose_technique(desc->renderer, scene, &chosen, &choice, err) &&
                   renderer_explain(desc->renderer, scene, &chosen, plan, err);
    *technique = technique_of(plan);
    free(plan);
    return is_good;
}

/* Draws one use case as a small picture, by the technique that its full size would have. */
static bool prepare_case(struct warming *warming, const struct view_quality *use_case, bool draws,
                         struct error *err)
{
    struct view view = *warming->view;
    enum shadow_technique technique = SHADOWS_RASTER_DEFAULT;
    bool is_in_motion = use_case->samples == 1;
    view.quality.expects_reuse = use_case->expects_reuse;
    view.quality.samples = use_case->samples;
    view.quality.shadow_taps = use_case->shadow_taps;
    if (!choose(warming, &view, &technique, err))
        return false;
    bool *is_done = draws && !shadow_technique_is_renderer(technique)
                        ? &warming->is_small[technique][is_in_motion]
                        : &warming->is_built[technique];
    if (*is_done)
        return true;
    view.width_px = SMALL_WIDTH;
    view.height_px = SMALL_HEIGHT;
    view.quality.shadows = technique;
    *is_done = make(warming, &view, draws, err);
    return *is_done;
}

static bool compile(struct warming *warming, bool is_in_motion, struct error *err)
{
    const struct warm_up_step_desc *desc = warming->desc;
    const struct renderer_warm_up_desc programs = {.shall_stop = desc->shall_stop,
                                                   .context = desc->context};
    struct view view = *warming->view;
    bool is_complete;
    if (is_in_motion)
        view.quality.samples = view.quality.shadow_taps = 1;
    if (!renderer_warm_up(desc->renderer, desc->request->scene, &view, &programs, &is_complete,
                          err))
        return false;
    warming->left = is_complete ? NULL : "programs";
    return true;
}

static bool warm_up(struct warming *warming, struct error *err)
{
    const char *what = warm_up_asked(warming->desc->question);
    const int count = sizeof cases / sizeof cases[0];
    bool draws = strcmp(what, "all") == 0;
    for (int i = 0; i < count && strcmp(what, "programs") != 0; i++) {
        struct error problem = {0};
        warming->left = i > 0 && is_due((void *)(uintptr_t)warming->desc) ? what : NULL;
        if (warming->left)
            return true;
        if (prepare_case(warming, &cases[i], draws, &problem))
            continue;
        if (problem.code != ERROR_OVERLOADED) /* it gave way */
            return error_pass(err, &problem);
        warming->left = what;
        return true;
    }
    for (int in_motion = 0; in_motion < 2 && !warming->left; in_motion++)
        if (!compile(warming, in_motion, err))
            return false;
    return true;
}

/* Compiled so far, or taken from the program folder. */
static uint64_t programs_made(const struct renderer *renderer)
{
    struct renderer_info info;
    renderer_get_info(renderer, &info);
    return info.programs_built + info.programs_loaded;
}

json_t *warm_up_step(const struct warm_up_step_desc *desc, struct error *err)
{
    struct view view;
    struct view_storage storage = {0};
    struct warming warming = {.desc = desc, .view = &view};
    uint64_t before = programs_made(desc->renderer);
    bool is_good = view_from_request(desc->request, &storage, &view, err);
    if (is_good)
        view.screen = view_screen_from_request(desc->request, IMAGE_FORMAT_PNG);
    is_good = is_good && warm_up(&warming, err);
    view_storage_finish(&storage);
    if (!is_good)
        return NULL;
    json_t *answer = json_pack("{s:s*,s:I,s:I,s:I,s:I}", "left", warming.left, "pictures",
                               (json_int_t)warming.done.pictures, "shadow_maps_built",
                               (json_int_t)warming.done.shadow_maps_built, "ray_structures_built",
                               (json_int_t)warming.done.ray_structures_built, "programs_built",
                               (json_int_t)(programs_made(desc->renderer) - before));
    if (!answer)
        error_set(err, ERROR_NO_MEMORY, "warm-up");
    return answer;
}
