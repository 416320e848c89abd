/* SPDX-License-Identifier: MIT */
/* One frame: state, camera, shadows, then windows of the image one by one. */
#include <assert.h>
#include <epoxy/gl.h>
#include <stdlib.h>

#include "renderer/frame_raytrace.h"
#include "renderer/plan/plan.h"
#include "renderer/wall_clock.h"

enum {
    WINDOW_SIDE_MAX = 4096,
    WINDOW_PIXELS_MAX = 1 << 21, /* 300 MB of 4x multisampled targets */
    WINDOWS_MAX = 8192,
};

static bool check_quality(const struct view_quality *quality, struct error *err)
{
    int samples = quality->samples;
    bool is_traced = quality->reference || quality->shadows == VIEW_SHADOWS_RAYTRACED;
    if (quality->reference && quality->shadows != VIEW_SHADOWS_AUTO &&
        quality->shadows != VIEW_SHADOWS_RAYTRACED)
        return error_set(err, ERROR_INVALID_REQUEST,
                         "the reference is ray traced: shadows must be auto or raytraced");
    if (samples != 0 && samples != 1 && samples != 4 &&
        !(is_traced && (samples == 16 || samples == 64 || samples == 256)))
        return error_set(err, ERROR_INVALID_REQUEST, "%d samples per pixel, choose 1 or 4",
                         samples);
    if (quality->area_samples < 0 || quality->area_samples > 4096)
        return error_set(err, ERROR_INVALID_REQUEST, "%d area samples, choose 1 to 4096",
                         quality->area_samples);
    return true;
}

static bool check_view(const struct view *view, struct error *err)
{
    if (view->width_px < 1 || view->height_px < 1 || view->width_px > 16384 ||
        view->height_px > 16384)
        return error_set(err, ERROR_INVALID_REQUEST, "image size %dx%d is outside [1, 16384]",
                         view->width_px, view->height_px);
    if (view->first_row_px < 0 || view->row_count_px < 0 ||
        view->row_count_px > view->height_px - view->first_row_px)
        return error_set(err, ERROR_INVALID_REQUEST, "%d rows from row %d of an image of %d rows",
                         view->row_count_px, view->first_row_px, view->height_px);
    if (view->clip_plane_count > 8)
        return error_set(err, ERROR_INVALID_REQUEST, "%zu clip planes, limit is 8",
                         view->clip_plane_count);
    return check_quality(&view->quality, err);
}

static int choose_samples(const struct renderer *renderer, const struct view *view,
                          struct frame_report *report)
{
    int samples = plan_samples(view, gl_context_limits(renderer->context));
    if (samples == 1 && view->quality.samples == 4 && view->outputs & 1u << VIEW_OUTPUT_COLOR)
        report_warn(report, "the device cannot antialias transparent lists: 1 sample per pixel");
    return samples;
}

static bool create_outputs(const struct view *view, struct frame *frame, struct error *err)
{
    static const struct {
        int channels;
        enum image_component component;
    } shapes[] = {
        [VIEW_OUTPUT_COLOR] = {4, IMAGE_F32},  [VIEW_OUTPUT_DEPTH] = {1, IMAGE_F32},
        [VIEW_OUTPUT_NORMAL] = {3, IMAGE_F32}, [VIEW_OUTPUT_ALBEDO] = {3, IMAGE_F32},
        [VIEW_OUTPUT_NODE] = {1, IMAGE_U32},   [VIEW_OUTPUT_MATERIAL] = {1, IMAGE_U32},
    };
    for (int i = 0; i < VIEW_OUTPUT_COUNT; i++)
        if (view->outputs & 1u << i &&
            !image_init(&frame->outputs[i], view->width_px, view->height_px, shapes[i].channels,
                        shapes[i].component, err))
            return false;
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

struct frame_pass {
    struct renderer *renderer;
    struct window_frame window; /* without the window itself */
    int samples;
    struct image *outputs;
};

static bool prepare_lights(struct renderer *renderer, const struct window_frame *frame,
                           struct error *err)
{
    if (!frame->state->light_count)
        return true;
    return light_lists_prepare(renderer->lists,
                               &(struct light_lists_desc){
                                   .technique = frame->view->quality.light_lists,
                                   .faithful = frame->view->quality.faithful,
                                   .lights = frame->state->lights,
                                   .light_count = frame->state->light_count,
                                   .camera = frame->camera,
                                   .window = &frame->window,
                               },
                               frame->report, err);
}

static bool shade_and_read(struct frame_pass *pass, const struct window_frame *frame,
                           struct error *err)
{
    struct renderer *renderer = pass->renderer;
    struct shade_desc desc = {
        .frame = frame,
        .lists = renderer->lists,
        .shadows = renderer->shadows,
        .pixels = &renderer->pixels,
    };
    uint32_t color_bit = 1u << VIEW_OUTPUT_COLOR;
    if (frame->view->outputs & color_bit &&
        (!prepare_lights(renderer, frame, err) || !shade_window(&renderer->shade, &desc, err) ||
         !shade_read_color(frame, &pass->outputs[VIEW_OUTPUT_COLOR], err)))
        return false;
    if (frame->view->outputs & ~color_bit &&
        !shade_read_aovs(&renderer->shade, &desc, pass->outputs, err))
        return false;
    return gl_context_check(renderer->context, "rendering", err);
}

/* Sets *must_split when the window has more transparent fragments than one pass can hold. */
static bool render_window(struct frame_pass *pass, const struct camera_window *window,
                          bool *must_split, struct error *err)
{
    struct renderer *renderer = pass->renderer;
    struct window_frame frame = pass->window;
    struct geometry_items items = {0};
    frame.window = *window;
    if (!targets_prepare(&renderer->targets, window->width, window->height, pass->samples, err))
        return false;
    read_sample_positions(&renderer->targets, frame.sample_positions);
    bool ok = geometry_cull(&frame, &items, err) && geometry_draw_opaque(&frame, &items, err);
    enum pixel_lists_outcome outcome = PIXEL_LISTS_FAILED;
    if (ok)
        outcome = pixel_lists_build(&renderer->pixels, &frame, &items, err);
    geometry_items_finish(&items);
    *must_split = outcome == PIXEL_LISTS_TOO_MANY;
    if (outcome == PIXEL_LISTS_BUILT)
        return shade_and_read(pass, &frame, err);
    return *must_split;
}

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

/* A stack of windows: each is rendered, or split where it is too large for one pass. */
static bool render_windows(struct frame_pass *pass, struct error *err)
{
    const struct view *view = pass->window.view;
    struct camera_window stack[64]; /* halving from 16384^2 to one pixel takes 28 levels */
    int depth = 1, rendered = 0;
    stack[0] = (struct camera_window){
        0, 0, view->width_px, view->height_px, view->width_px, view->height_px};
    while (depth) {
        struct camera_window w = stack[--depth];
        bool must_split = w.width > WINDOW_SIDE_MAX || w.height > WINDOW_SIDE_MAX ||
                          w.width * w.height > WINDOW_PIXELS_MAX;
        if (!must_split && !render_window(pass, &w, &must_split, err))
            return false;
        if (!must_split) {
            rendered++;
            continue;
        }
        if (w.width * w.height == 1 || rendered > WINDOWS_MAX)
            return error_set(err, ERROR_OVER_BUDGET,
                             "more than %d transparent fragments in a window of %dx%d pixels",
                             PIXEL_LISTS_ENTRIES_MAX, w.width, w.height);
        split_window(&w, &stack[depth]);
        depth += 2;
        assert(depth < 62);
    }
    if (rendered > 1)
        report_warn(pass->window.report, "the image was rendered in %d windows", rendered);
    return true;
}

static void fill_report(const struct renderer *renderer, const struct resident_scene *scene,
                        const struct scene_state *state, struct frame_report *report)
{
    report->counts.lights = state->light_count;
    report_add_bytes(report, "scene", scene_gpu_size_bytes(scene->gpu));
    report_add_bytes(report, "targets", targets_size_bytes(&renderer->targets));
    report_add_bytes(report, "pixel_lists", pixel_lists_size_bytes(&renderer->pixels));
    report_add_bytes(report, "shadows", shadow_system_size_bytes(renderer->shadows));
    if (state->has_default_lights)
        report_warn(report,
                    "neither the scene nor the request has a light: default lighting is used");
    if (state->open_volume_count)
        report_warn(report,
                    "%zu attenuating volumes have no closed surface that faces outward: the "
                    "thickness of their material is used",
                    state->open_volume_count);
}

/* The rasterised outputs of the view: its windows, after the shadows that its color needs. */
static bool render_rasterised(struct renderer *renderer, struct resident_scene *scene,
                              const struct view *view, const struct scene_state *state,
                              const struct camera *camera, struct frame *frame, struct error *err)
{
    if (!draw_arena_begin(renderer->arena, state, err))
        return false;
    bool wants_color = view->outputs & 1u << VIEW_OUTPUT_COLOR;
    if (wants_color)
        frame_warn_of_areas(state, &frame->report);
    if (wants_color && view->clip_plane_count)
        report_warn(&frame->report,
                    "clip planes cut the view; shadow maps still hold the whole scene");
    if (wants_color &&
        !light_reach_collect(&renderer->reach, state->lights, state->light_count, camera, err))
        return false;
    if (wants_color)
        frame->report.counts.unseen_lights = renderer->reach.unseen_count;
    struct shadow_prepare_desc shadow_desc = {
        .scene_key = scene->key,
        .gpu = scene->gpu,
        .state = state,
        .arena = renderer->arena,
        .eye = {camera->eye[0], camera->eye[1], camera->eye[2]},
        .quality = &view->quality,
        .is_in_view = renderer->reach.is_in_view,
    };
    if (wants_color &&
        (!shadow_system_prepare(renderer->shadows, &shadow_desc, &frame->report, err) ||
         !shade_upload_lights(&renderer->shade, state, renderer->shadows, camera->eye, err)))
        return false;
    struct frame_pass pass = {
        .renderer = renderer,
        .samples = choose_samples(renderer, view, &frame->report),
        .outputs = frame->outputs,
        .window =
            {
                .programs = renderer->programs,
                .timeline = renderer->timeline,
                .limits = gl_context_limits(renderer->context),
                .view = view,
                .state = state,
                .gpu = scene->gpu,
                .arena = renderer->arena,
                .camera = camera,
                .targets = &renderer->targets,
                .report = &frame->report,
            },
    };
    if (!render_windows(&pass, err))
        return false;
    return true;
}

static bool render_state(struct renderer *renderer, struct resident_scene *scene,
                         const struct view *view, const struct scene_state *state,
                         struct frame *frame, struct error *err)
{
    struct camera camera;
    struct view rasterised = *view;
    if (!camera_resolve(&camera, view, state, err) || !create_outputs(view, frame, err))
        return false;
    char because[REPORT_TEXT_BYTES];
    if (frame_is_raytraced(view, state, because)) {
        if (!frame_raytrace(renderer, scene->key, view, state, &camera, because, frame, err))
            return false;
        rasterised.outputs &= ~(1u << VIEW_OUTPUT_COLOR);
    }
    if (rasterised.outputs &&
        !render_rasterised(renderer, scene, &rasterised, state, &camera, frame, err))
        return false;
    fill_report(renderer, scene, state, &frame->report);
    return true;
}

/* The scene under its key and the view with its defaults; err names what is wrong. */
static struct resident_scene *open_view(struct renderer *renderer, const char *scene_key,
                                        const struct view *view, struct view *checked,
                                        struct scene_state *state, struct error *err)
{
    struct resident_scene *scene = scene_cache_find(&renderer->scenes, scene_key);
    if (!scene) {
        error_set(err, ERROR_NOT_FOUND, "scene '%s' is not on the GPU", scene_key);
        return NULL;
    }
    *checked = *view;
    if (!checked->outputs)
        checked->outputs = 1u << VIEW_OUTPUT_COLOR;
    return check_view(checked, err) && scene_state_init(state, &scene->scene, checked, err) ? scene
                                                                                            : NULL;
}

bool renderer_explain(struct renderer *renderer, const char *scene_key, const struct view *view,
                      struct plan *plan, struct error *err)
{
    struct view checked;
    struct scene_state state;
    struct camera camera;
    if (!open_view(renderer, scene_key, view, &checked, &state, err))
        return false;
    bool ok = camera_resolve(&camera, &checked, &state, err) &&
              plan_make(plan,
                        &(struct plan_desc){.view = &checked,
                                            .state = &state,
                                            .camera = &camera,
                                            .limits = gl_context_limits(renderer->context)},
                        err);
    scene_state_finish(&state);
    return ok;
}

bool renderer_render(struct renderer *renderer, const char *scene_key, const struct view *view,
                     struct frame *frame, struct error *err)
{
    double begin_ms = wall_ms();
    *frame = (struct frame){0};
    struct view checked;
    struct scene_state state;
    struct resident_scene *scene = open_view(renderer, scene_key, view, &checked, &state, err);
    if (!scene)
        return false;
    struct program_cache_stats before, after;
    program_cache_get_stats(renderer->programs, &before);
    bool ok = render_state(renderer, scene, &checked, &state, frame, err);
    program_cache_get_stats(renderer->programs, &after);
    frame->report.counts.programs_built = after.misses - before.misses;
    frame->report.counts.programs_reused = after.hits - before.hits;
    gpu_timeline_collect(renderer->timeline, &frame->report);
    scene_state_finish(&state);
    frame->report.total_ms = wall_ms() - begin_ms;
    if (!ok)
        frame_finish(frame);
    return ok;
}
