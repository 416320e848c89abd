/* SPDX-License-Identifier: MIT */
/* A test double behind renderer/renderer.h: paints gradients without GL, and fails where a node of
 * the scene tells it to.
 *
 * Names of nodes and what they do: "fake:crash" ends the process with SIGSEGV, "fake:hang" never
 * returns, "fake:error" fails the render, "fake:lost" loses the context, "fake:slow=N" takes N
 * milliseconds, "fake:device=N" as many more on the device, beside the processor, after which
 * "fake:error-on-device", "fake:lost-on-device" and "fake:hang-on-device" do as those above.
 * "fake:crash-at=T" ends it where the view's time is T seconds, to the second.
 * "fake:tradeoff" gives each setting an error and a time, and with it
 * "fake:layers" puts transparent surfaces in view, which "sorted" draws in half the time, and
 * worse, "fake:crash-at-2048" crashes on shadow maps of that size. Device 64 does not exist, device
 * 62 is of another kind. The importer is the real one, but for files that hold
 * "fake:decoder-crash", "fake:decoder-hang", "fake:decoder-open", "fake:decoder-exec",
 * "fake:decoder-socket" or "fake:decoder-memory". */
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "protocol/quality_defaults.h"
#include "renderer/base/wall_clock.h"
#include "renderer/frame/calibrate.h"
#include "renderer/frame/frame_lesson.h"
#include "renderer/frame/texture_speed.h"
#include "renderer/import/import.h"
#include "renderer/renderer.h"

enum { SCENES_MAX = 8, ENVIRONMENTS_MAX = 2 };

/* EGL numbers: no such device, software beside hardware, and a device of another kind. */
static const char device_missing[] = "64", device_software[] = "63", device_other[] = "62";

struct fake_scene {
    char key[65];
    struct scene scene;
    void (*release)(void *context);
    void *context;
    bool has_structures; /* for "fake:tradeoff": rendered since they were dropped */
};

struct renderer {
    uint64_t budget_bytes;
    bool is_beside_hardware, is_other;
    struct fake_scene scenes[SCENES_MAX]; /* oldest first */
    int scene_count;
    struct renderer_environment_desc environments[ENVIRONMENTS_MAX]; /* oldest first */
    char environment_keys[ENVIRONMENTS_MAX][65];
    int environment_count;
    const struct yield_point *yield;
    const struct frame_progress *progress;
    const struct frame_completion *completion;
    bool is_paused;
    double device_free_ms; /* when the device has done all that it was given */
    struct {
        struct frame *frame; /* NULL: none */
        double end_ms;
        bool has_error, is_lost, hangs;
    } in_flight;
};

struct renderer *renderer_create(const struct renderer_desc *desc, struct error *err)
{
    if (desc->device && !strcmp(desc->device, device_missing)) {
        error_set(err, ERROR_NO_DEVICE, "fake: there is no device %s", desc->device);
        return NULL;
    }
    struct renderer *renderer = calloc(1, sizeof *renderer);
    if (!renderer)
        error_set(err, ERROR_NO_MEMORY, "fake renderer");
    else
        renderer->budget_bytes = desc->gpu_budget_bytes;
    if (renderer)
        renderer->is_beside_hardware = desc->device && !strcmp(desc->device, device_software);
    if (renderer)
        renderer->is_other = desc->device && !strcmp(desc->device, device_other);
    return renderer;
}

static void remove_scene(struct renderer *renderer, int index)
{
    struct fake_scene removed = renderer->scenes[index];
    renderer->scene_count--;
    memmove(&renderer->scenes[index], &renderer->scenes[index + 1],
            (size_t)(renderer->scene_count - index) * sizeof removed);
    if (removed.release)
        removed.release(removed.context);
}

static void remove_environment(struct renderer *renderer, int index)
{
    struct renderer_environment_desc removed = renderer->environments[index];
    size_t left = (size_t)(--renderer->environment_count - index);
    memmove(&renderer->environments[index], &renderer->environments[index + 1],
            left * sizeof removed);
    memmove(renderer->environment_keys[index], renderer->environment_keys[index + 1],
            left * sizeof *renderer->environment_keys);
    if (removed.release)
        removed.release(removed.context);
}

void renderer_destroy(struct renderer *renderer)
{
    while (renderer && renderer->scene_count > 0)
        remove_scene(renderer, 0);
    while (renderer && renderer->environment_count > 0)
        remove_environment(renderer, 0);
    free(renderer);
}

void renderer_set_auto(struct renderer *renderer, const struct auto_settings *settings)
{
    (void)renderer;
    (void)settings;
}

void renderer_set_learned(struct renderer *renderer, const struct learning *learned)
{
    (void)renderer;
    (void)learned;
}

/* Nothing is learned from its frames. */
bool renderer_take_lesson(struct renderer *renderer, struct frame_lesson *lesson)
{
    (void)renderer;
    (void)lesson;
    return false;
}

void renderer_learn(struct renderer *renderer, const struct frame_lesson *lesson)
{
    (void)renderer;
    (void)lesson;
}

const struct learning *renderer_get_learned(const struct renderer *renderer, uint64_t *print)
{
    (void)renderer;
    *print = 0;
    return NULL;
}

void renderer_set_texture_compression(struct renderer *renderer, uint32_t from_levels)
{
    (void)renderer;
    (void)from_levels;
}

bool renderer_samples_blocks(const struct renderer *renderer)
{
    (void)renderer;
    return true;
}

/* A device that gains. */
bool texture_speed_measure(struct renderer *renderer, struct texture_speed *speed,
                           double *elapsed_ms, struct error *err)
{
    (void)renderer;
    (void)err;
    *speed = (struct texture_speed){1, 0.5, 0.75, 1e5};
    *elapsed_ms = 0;
    return true;
}

bool texture_speed_is_known(const struct texture_speed *speed)
{
    return speed->whole_ns > 0;
}

bool texture_speed_gains(const struct texture_speed *speed)
{
    return speed->bc1_ns < speed->whole_ns;
}

/* An exposure for each shape of image. */
bool renderer_meter(struct renderer *renderer, const char *scene_key, const struct view *view,
                    struct exposure_reading *reading, struct error *err)
{
    (void)renderer;
    (void)scene_key;
    (void)err;
    *reading =
        (struct exposure_reading){.ev = (float)view->width_px / (float)view->height_px, .ms = 0.5};
    return true;
}

bool renderer_calibrate(struct renderer *renderer, struct calibration *calibration,
                        struct error *err)
{
    (void)renderer;
    *calibration = (struct calibration){.rounds = 0};
    return error_set(err, ERROR_UNSUPPORTED, "fake: cannot be measured");
}

void renderer_set_progress(struct renderer *renderer, const struct frame_progress *progress)
{
    renderer->progress = progress;
}

void renderer_set_yield_point(struct renderer *renderer, const struct yield_point *yield)
{
    renderer->yield = yield;
}

void renderer_get_info(const struct renderer *renderer, struct renderer_info *info)
{
    *info = (struct renderer_info){.vendor = "Vitrail",
                                   .wide_floats = {.form = WIDE_FLOATS_F64},
                                   .renderer = "fake",
                                   .version = "1",
                                   .driver = "none",
                                   .device_count = 1,
                                   .max_texture_size = 16384,
                                   .max_samples = 1,
                                   .max_storage_block_bytes = 1 << 30,
                                   .budget_bytes = renderer->budget_bytes,
                                   .used_bytes = (uint64_t)renderer->scene_count << 20,
                                   .devices = {"EGL device 1: taken"}};
    if (renderer->is_other)
        snprintf(info->renderer, sizeof info->renderer, "another fake");
    if (renderer->is_beside_hardware)
        snprintf(info->warning, sizeof info->warning, "software renders, though there is hardware");
}

static int find_scene(const struct renderer *renderer, const char *key)
{
    for (int i = 0; i < renderer->scene_count; i++)
        if (strcmp(renderer->scenes[i].key, key) == 0)
            return i;
    return -1;
}

bool renderer_attach_scene(struct renderer *renderer, const struct renderer_scene_desc *desc,
                           struct error *err)
{
    (void)err;
    if (find_scene(renderer, desc->key) >= 0)
        return true;
    if (renderer->scene_count == SCENES_MAX)
        remove_scene(renderer, 0);
    struct fake_scene *added = &renderer->scenes[renderer->scene_count++];
    *added = (struct fake_scene){
        .scene = *desc->scene, .release = desc->release, .context = desc->context};
    snprintf(added->key, sizeof added->key, "%s", desc->key);
    return true;
}

bool renderer_has_scene(const struct renderer *renderer, const char *key)
{
    return find_scene(renderer, key) >= 0;
}

void renderer_detach_scene(struct renderer *renderer, const char *key)
{
    int index = find_scene(renderer, key);
    if (index >= 0)
        remove_scene(renderer, index);
}

static int find_environment(const struct renderer *renderer, const char *key)
{
    for (int i = 0; i < renderer->environment_count; i++)
        if (strcmp(renderer->environment_keys[i], key) == 0)
            return i;
    return -1;
}

bool renderer_attach_environment(struct renderer *renderer,
                                 const struct renderer_environment_desc *desc, struct error *err)
{
    (void)err;
    if (find_environment(renderer, desc->key) >= 0)
        return true;
    if (renderer->environment_count == ENVIRONMENTS_MAX)
        remove_environment(renderer, 0);
    int index = renderer->environment_count++;
    renderer->environments[index] = *desc;
    snprintf(renderer->environment_keys[index], sizeof *renderer->environment_keys, "%s",
             desc->key);
    return true;
}

bool renderer_has_environment(const struct renderer *renderer, const char *key)
{
    return find_environment(renderer, key) >= 0;
}

void renderer_detach_environment(struct renderer *renderer, const char *key)
{
    int index = find_environment(renderer, key);
    if (index >= 0)
        remove_environment(renderer, index);
}

void frame_finish(struct frame *frame)
{
    for (int i = 0; i < VIEW_OUTPUT_COUNT; i++)
        image_finish(&frame->outputs[i]);
    deep_image_finish(&frame->deep);
    *frame = (struct frame){0};
}

enum runner_up_outcome renderer_time_runner_up(struct renderer *renderer, const char *scene_key,
                                               const struct view *view,
                                               const struct runner_up_desc *desc)
{
    (void)renderer, (void)scene_key, (void)view, (void)desc;
    return RUNNER_UP_NONE;
}

void renderer_trim(struct renderer *renderer)
{
    (void)renderer;
}

void renderer_drop_structures(struct renderer *renderer, const char *key)
{
    int index = find_scene(renderer, key);
    if (index >= 0)
        renderer->scenes[index].has_structures = false;
}

static void sleep_ms(long ms)
{
    nanosleep(&(struct timespec){ms / 1000, ms % 1000 * 1000000}, NULL);
}

/* As the real one where a pass begins, or with `waits` where the device is waited for. */
static void let_arrive(struct renderer *renderer, bool waits)
{
    if (renderer->in_flight.frame && renderer->completion && (waits || renderer_wait(renderer, 0)))
        renderer->completion->collect(renderer->completion->context);
}

static void raise_crash(void)
{
    signal(SIGSEGV, SIG_DFL);
    raise(SIGSEGV);
}

/* In pieces, between which others may go first. */
static bool sleep_with_yield_points(struct renderer *renderer, long ms, struct frame *frame,
                                    struct error *err)
{
    const struct yield_point *yield = renderer->is_paused ? NULL : renderer->yield;
    bool is_wanted = true;
    for (long slept = 0; slept < ms && is_wanted; slept++) {
        sleep_ms(1);
        if (renderer->progress && !renderer->is_paused)
            renderer->progress->tell(renderer->progress->context, FRAME_STAGE_SHADING,
                                     (double)(slept + 1) / (double)ms);
        let_arrive(renderer, false);
        if (!yield_point_is_due(yield))
            continue;
        let_arrive(renderer, true);
        renderer->is_paused = true;
        is_wanted = yield_point_run(yield, err);
        renderer->is_paused = false;
        frame->report.paused_ms += 1; /* as it says of everything */
    }
    return is_wanted;
}

/* Does what a node's name asks for. */
static bool obey(struct renderer *renderer, const char *name, const struct view *view,
                 struct frame *frame, struct error *err)
{
    if (strncmp(name, "fake:crash-at=", 14) == 0 && view->is_animated &&
        lround(view->animation_time_s) == strtol(name + 14, NULL, 10))
        raise_crash();
    if (strcmp(name, "fake:crash") == 0)
        raise_crash();
    while (strcmp(name, "fake:hang") == 0)
        sleep_ms(1000);
    if (strncmp(name, "fake:slow=", 10) == 0)
        return sleep_with_yield_points(renderer, strtol(name + 10, NULL, 10), frame, err);
    if (strcmp(name, "fake:lost") == 0)
        return error_set(err, ERROR_NO_DEVICE, "fake: the context is lost");
    if (strcmp(name, "fake:error") == 0)
        return error_set(err, ERROR_INTERNAL, "fake: GL error 0x0502");
    return true;
}

/* What haze adds, and takes: slices, in haze alone. */
static double fake_slices(const struct view *view)
{
    return view_has_atmosphere(view)
               ? quality_or(view->quality.atmosphere_samples, ATMOSPHERE_SLICES_DEFAULT)
               : 0;
}

/* How far the image of "fake:tradeoff" is off: less with resolution, taps and samples. */
static double fake_error_of_surfaces(const struct view_quality *quality)
{
    if (quality->shadows == SHADOWS_RAYTRACED)
        return quality->samples == 1 ? 0.02 : quality->samples == 4 ? 0.01 : 0;
    if (quality->shadows == SHADOWS_NONE)
        return 0.5;
    if (quality->shadows == SHADOWS_RAYTRACED_SHADOWS)
        return quality->samples == 1 ? 0.03 : 0.015;
    bool is_map = quality->shadows == SHADOWS_MAP;
    return 16. / quality->shadow_resolution + 0.01 / quality->shadow_taps +
           (quality->samples == 1 ? 0.02 : 0) + (is_map ? 0.1 : 0);
}

static double fake_error(const struct view *view)
{
    double slices = fake_slices(view);
    if (view->quality.reference)
        return 0;
    bool is_sorted = view->quality.transparency == TRANSPARENCY_SORTED;
    return fake_error_of_surfaces(&view->quality) + (is_sorted ? 0.015 : 0) +
           (slices > 0 ? 0.64 / slices : 0);
}

/* A time that goes the other way. Nothing waits for it. */
static double fake_ms_of_surfaces(const struct view_quality *quality, bool is_cold)
{
    if (quality->shadows == SHADOWS_RAYTRACED)
        return 100. * quality->samples;
    if (quality->shadows == SHADOWS_NONE)
        return 2;
    if (quality->shadows == SHADOWS_RAYTRACED_SHADOWS)
        return 500;
    double map = quality->shadow_resolution / 64.;
    return 4 + 2. * quality->shadow_taps + 3. * quality->samples + (is_cold ? map : 0);
}

static double fake_ms(const struct view *view, bool is_cold)
{
    if (view->quality.reference)
        return 5;
    double share = view->quality.transparency == TRANSPARENCY_SORTED ? 0.5 : 1;
    return share * fake_ms_of_surfaces(&view->quality, is_cold) + fake_slices(view) / 4;
}

/* "fake:tradeoff": two lights and a transparent caster. */
static void weigh(struct fake_scene *scene, const struct view *view, struct frame *frame)
{
    const struct view_quality *quality = &view->quality;
    struct image *color = &frame->outputs[VIEW_OUTPUT_COLOR];
    if (scene_find_node(&scene->scene, "fake:crash-at-2048") >= 0 &&
        quality->shadow_resolution == 2048)
        raise_crash();
    size_t count = color->pixels ? (size_t)color->width_px * (size_t)color->height_px * 4 : 0;
    for (size_t i = 0; i < count; i++)
        if (i % 4 != 3)
            ((float *)color->pixels)[i] += (float)fake_error(view);
    frame->report.counts.lights = frame->report.counts.shadowed_lights = 2;
    frame->report.counts.triangles = !scene->has_structures; /* kept surfaces are not drawn */
    frame->report.has_layers = scene_find_node(&scene->scene, "fake:layers") >= 0;
    frame->report.layer_needs = frame->report.has_layers ? TRANSPARENCY_CAN_GROUND : 0;
    frame->report.counts.events = quality->shadows == SHADOWS_DEEP ? 7 : 0;
    report_add_bytes(&frame->report, "shadows",
                     (uint64_t)quality->shadow_resolution * (uint64_t)quality->shadow_resolution);
    frame->report.error_is_exact = quality->shadows == SHADOWS_RAYTRACED;
    frame->report.total_ms = fake_ms(view, !scene->has_structures);
    scene->has_structures = true;
}

static bool obey_nodes(struct renderer *renderer, const struct scene *scene,
                       const struct view *view, struct frame *frame, struct error *err)
{
    for (uint32_t i = 0; i < scene->node_count; i++)
        if (!obey(renderer, scene->strings + scene->nodes[i].name, view, frame, err))
            return false;
    return true;
}

static bool paint(struct image *image, enum view_output output, const struct view *view,
                  struct error *err)
{
    static const int channels[VIEW_OUTPUT_COUNT] = {4, 1, 3, 3, 1, 1, 3, 3, 1, 1, 3};
    bool is_id = output == VIEW_OUTPUT_NODE || output == VIEW_OUTPUT_MATERIAL ||
                 output == VIEW_OUTPUT_LIGHTS || output == VIEW_OUTPUT_LAYERS;
    const struct view_tile tile = view_tile_of(view);
    if (!image_init(image, tile.width_px, tile.height_px, channels[output],
                    is_id ? IMAGE_U32 : IMAGE_F32, err))
        return false;
    size_t at = 0;
    for (int y = tile.y_px; y < tile.y_px + tile.height_px; y++)
        for (int x = tile.x_px; x < tile.x_px + tile.width_px; x++)
            for (int c = 0; c < image->channels; c++, at++) {
                float gradient =
                    (float)(c == 0 ? x : y) / (float)(view->width_px + view->height_px);
                if (c == 2 && view->is_animated) /* each second has its blue */
                    gradient = (float)(0.5 + 0.5 * sin(view->animation_time_s));
                if (is_id)
                    ((uint32_t *)image->pixels)[at] = (uint32_t)(x % 3);
                else
                    ((float *)image->pixels)[at] = c == 3 ? 1.f
                                                   : output == VIEW_OUTPUT_DEPTH && x == 0
                                                       ? INFINITY
                                                       : gradient;
            }
    return true;
}

/* One sample of each pixel, as the color output has it. */
static bool paint_deep(struct frame *frame, struct error *err)
{
    const struct image *color = &frame->outputs[VIEW_OUTPUT_COLOR];
    struct deep_image *deep = &frame->deep;
    if (!deep_image_init(deep, color->width_px, color->height_px, err) ||
        !deep_image_reserve(deep, (size_t)color->width_px * (size_t)color->height_px, err))
        return false;
    const float *p = color->pixels;
    for (int y = 0; y < color->height_px; y++)
        for (int x = 0; x < color->width_px; x++, p += 4)
            deep_image_set(deep, x, y,
                           &(struct deep_sample){.depth = 1,
                                                 .back = 1,
                                                 .color = {p[0], p[1], p[2]},
                                                 .opacity = {p[3], p[3], p[3]}},
                           1);
    return true;
}

/* All that the processor does. */
static bool make(struct renderer *renderer, const char *scene_key, const struct view *view,
                 struct frame *frame, struct error *err)
{
    *frame = (struct frame){0};
    int index = find_scene(renderer, scene_key);
    if (index < 0)
        return error_set(err, ERROR_INTERNAL, "fake: scene '%s' is not attached", scene_key);
    const struct scene *scene = &renderer->scenes[index].scene;
    if (view->camera.kind == VIEW_CAMERA_NODE && scene_find_node(scene, view->camera.node) < 0)
        return error_set_at(err, ERROR_NOT_FOUND, "/camera/node", "the scene has no node '%s'",
                            view->camera.node);
    if (view_has_environment(view) && strcmp(view->environment_key, VIEW_STUDIO_KEY) != 0 &&
        find_environment(renderer, view->environment_key) < 0)
        return error_set(err, ERROR_INTERNAL, "fake: environment '%s' is not attached",
                         view->environment_key);
    if (!obey_nodes(renderer, scene, view, frame, err))
        return false;
    uint32_t outputs = view->outputs ? view->outputs : 1u << VIEW_OUTPUT_COLOR;
    for (int i = 0; i < VIEW_OUTPUT_COUNT; i++)
        if (outputs & 1u << i && !paint(&frame->outputs[i], (enum view_output)i, view, err)) {
            frame_finish(frame);
            return false;
        }
    if (view->wants_deep && !paint_deep(frame, err)) {
        frame_finish(frame);
        return false;
    }
    if (view_has_environment(view))
        snprintf(frame->report.environment, sizeof frame->report.environment, "%s",
                 view->environment_key);
    report_add_pass(&frame->report, "fake.paint", "a test asked for it", "", 0.5, REPORT_SHADE);
    frame->report.total_ms = 1;
    frame->report.error_is_exact = true;
    if (scene_find_node(scene, "fake:tradeoff") >= 0)
        weigh(&renderer->scenes[index], view, frame);
    return true;
}

/* Milliseconds on the device; 0: none. */
static double device_ms(const struct scene *scene)
{
    static const char name[] = "fake:device=";
    for (uint32_t i = 0; i < scene->node_count; i++) {
        const char *text = scene->strings + scene->nodes[i].name;
        if (strncmp(text, name, sizeof name - 1) == 0)
            return strtod(text + sizeof name - 1, NULL);
    }
    return 0;
}

/* The device takes one frame after the other. */
static void take_off(struct renderer *renderer, const struct scene *scene, double ms,
                     struct frame *frame)
{
    double now_ms = wall_ms();
    renderer->device_free_ms = fmax(renderer->device_free_ms, now_ms) + ms;
    renderer->in_flight.frame = frame;
    renderer->in_flight.end_ms = renderer->device_free_ms;
    renderer->in_flight.has_error = scene_find_node(scene, "fake:error-on-device") >= 0;
    renderer->in_flight.is_lost = scene_find_node(scene, "fake:lost-on-device") >= 0;
    renderer->in_flight.hangs = scene_find_node(scene, "fake:hang-on-device") >= 0;
}

bool renderer_submit(struct renderer *renderer, const char *scene_key, const struct view *view,
                     struct frame *frame, bool *is_done, struct error *err)
{
    *is_done = true;
    if (!make(renderer, scene_key, view, frame, err))
        return false;
    const struct scene *scene = &renderer->scenes[find_scene(renderer, scene_key)].scene;
    double ms = device_ms(scene);
    if (ms <= 0)
        return true;
    if (renderer->is_paused) { /* as the real one: no frames in flight within pauses */
        sleep_ms((long)ms);
        return true;
    }
    let_arrive(renderer, true);
    take_off(renderer, scene, ms, frame);
    *is_done = false;
    return true;
}

bool renderer_wait(struct renderer *renderer, int timeout_ms)
{
    double until_ms = wall_ms() + timeout_ms;
    if (!renderer->in_flight.frame)
        return true;
    while (wall_ms() < until_ms && wall_ms() < renderer->in_flight.end_ms)
        nanosleep(&(struct timespec){0, 100000}, NULL);
    return wall_ms() >= renderer->in_flight.end_ms;
}

bool renderer_collect(struct renderer *renderer, struct error *err)
{
    struct frame *frame = renderer->in_flight.frame;
    while (!renderer_wait(renderer, 1000) || renderer->in_flight.hangs)
        continue;
    renderer->in_flight.frame = NULL;
    if (!renderer->in_flight.has_error && !renderer->in_flight.is_lost)
        return true;
    frame_finish(frame);
    return error_set(err, renderer->in_flight.is_lost ? ERROR_NO_DEVICE : ERROR_INTERNAL,
                     "fake: failed on the device");
}

void renderer_set_completion(struct renderer *renderer, const struct frame_completion *completion)
{
    renderer->completion = completion;
}

bool renderer_render(struct renderer *renderer, const char *scene_key, const struct view *view,
                     struct frame *frame, struct error *err)
{
    bool is_done;
    return renderer_submit(renderer, scene_key, view, frame, &is_done, err) &&
           (is_done || renderer_collect(renderer, err));
}

bool renderer_choose(struct renderer *renderer, const char *scene_key, const struct view *view,
                     struct auto_choice *choice, struct error *err)
{
    (void)view;
    *choice = (struct auto_choice){.is_open = false};
    return find_scene(renderer, scene_key) >= 0 ||
           error_set(err, ERROR_INTERNAL, "fake: scene '%s' is not attached", scene_key);
}

bool renderer_explain(struct renderer *renderer, const char *scene_key, const struct view *view,
                      struct plan *plan, struct error *err)
{
    (void)view;
    if (find_scene(renderer, scene_key) < 0)
        return error_set(err, ERROR_INTERNAL, "fake: scene '%s' is not attached", scene_key);
    *plan = (struct plan){.samples = 1, .pass_count = 1};
    plan->passes[0] = (struct plan_pass){.pass = "fake.paint", .need = PLAN_NEED_COLOR};
    plan->requirements[PLAN_NEED_COLOR].is_met = true;
    return true;
}

bool renderer_build(struct renderer *renderer, const char *scene_key, const struct view *view,
                    struct frame *frame, struct error *err)
{
    return renderer_render(renderer, scene_key, view, frame, err);
}

bool renderer_warm_up(struct renderer *renderer, const char *scene_key, const struct view *view,
                      const struct renderer_warm_up_desc *desc, bool *is_complete,
                      struct error *err)
{
    (void)renderer;
    (void)scene_key;
    (void)view;
    (void)desc;
    (void)err;
    *is_complete = true;
    return true;
}

bool renderer_list_programs(struct renderer *renderer, const char *scene_key,
                            const struct view *view, struct program_list *list, struct error *err)
{
    (void)renderer;
    (void)scene_key;
    (void)view;
    (void)list;
    (void)err;
    return true;
}

const struct scene *renderer_get_scene(struct renderer *renderer, const char *scene_key,
                                       const struct view *view, struct error *err)
{
    (void)view;
    (void)err;
    return &renderer->scenes[find_scene(renderer, scene_key)].scene;
}

/* The first node fills the left half of every image, behind a transparent layer of itself. */
bool renderer_pick(struct renderer *renderer, const char *scene_key, const struct view *view,
                   const struct pick_desc *desc, struct pick_result *result, struct error *err)
{
    *result = (struct pick_result){0};
    const struct scene *scene = &renderer->scenes[find_scene(renderer, scene_key)].scene;
    struct frame unseen = {0};
    if (!obey_nodes(renderer, scene, view, &unseen, err))
        return false;
    bool is_there = desc->x < view->width_px / 2;
    size_t layers = !is_there || desc->width ? 0 : desc->is_through ? 2 : 1;
    result->layers = calloc(2, sizeof *result->layers);
    result->nodes = calloc(1, sizeof *result->nodes);
    if (!result->layers || !result->nodes)
        return error_set(err, ERROR_NO_MEMORY, "fake: pick");
    for (size_t i = 0; i < layers; i++)
        result->layers[i] = (struct raytrace_layer){
            .normal = {0, 0, 1}, .depth = 1.0 + (double)i, .is_transparent = i == 0};
    result->layer_count = layers;
    if (is_there && desc->width)
        result->nodes[result->node_count++] =
            (struct pick_node){0, (uint64_t)desc->width * (uint64_t)desc->height};
    return true;
}

void pick_result_finish(struct pick_result *result)
{
    free(result->layers);
    free(result->nodes);
    *result = (struct pick_result){0};
}

/* ---- the importer's faults (linked with --wrap=scene_import) ---- */

bool __real_scene_import(const struct scene_import_desc *desc, void **blob, size_t *size_bytes,
                         struct error *err);
bool __wrap_scene_import(const struct scene_import_desc *desc, void **blob, size_t *size_bytes,
                         struct error *err);

static bool asks_for(const struct scene_import_desc *desc, const char *fault)
{
    for (size_t i = 0; i < desc->file_count; i++)
        if (memmem(desc->files[i].bytes, desc->files[i].size_bytes, fault, strlen(fault)))
            return true;
    return false;
}

bool __wrap_scene_import(const struct scene_import_desc *desc, void **blob, size_t *size_bytes,
                         struct error *err)
{
    if (asks_for(desc, "fake:decoder-crash"))
        abort();
    while (asks_for(desc, "fake:decoder-hang"))
        sleep_ms(1000);
    if (asks_for(desc, "fake:decoder-open")) {
        int fd = open("/etc/passwd", O_RDONLY | O_CLOEXEC);
        return error_set(err, ERROR_INVALID_SCENE, "fake: open answered %d, %s", fd,
                         strerror(errno));
    }
    if (asks_for(desc, "fake:decoder-exec"))
        execl("/bin/true", "true", (char *)NULL);
    if (asks_for(desc, "fake:decoder-socket"))
        return error_set(err, ERROR_INVALID_SCENE, "fake: socket answered %d",
                         socket(AF_INET, SOCK_STREAM, 0));
    for (size_t taken = 0; asks_for(desc, "fake:decoder-memory"); taken += 1 << 24) {
        void *volatile memory = malloc(1 << 24); /* compilers leave out what nobody looks at */
        if (!memory)
            return error_set(err, ERROR_NO_MEMORY, "fake: no more after %zu MiB", taken >> 20);
    }
    return __real_scene_import(desc, blob, size_bytes, err);
}
