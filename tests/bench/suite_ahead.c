/* SPDX-License-Identifier: MIT */
/* Suite `ahead`: frames one after the other beside frames of which the next is begun while one is
 * on the device, and how much of a frame is left for that when its last command is given. */
#include <math.h>
#include <stdio.h>

#include "tests/bench/frames.h"
#include "tests/bench/scenes.h"

enum { BURST = 4 /* frames of one sample */ };
enum { IN_TURN, AHEAD, VARIANTS };

/* Frames of one series, two of which are at work. */
struct series_of_frames {
    struct renderer *renderer;
    const struct bench_scene *scene;
    struct frame frames[2];
    struct error problem;
    double left_ms; /* waited for, all frames together */
};

static void collect(void *context)
{
    struct series_of_frames *series = context;
    double begin_ms = wall_now_ms();
    if (!renderer_collect(series->renderer, &series->problem))
        return;
    series->left_ms += wall_now_ms() - begin_ms;
}

/* A little further each time, so that surfaces are drawn anew. */
static struct view view_at(const struct view *view, int frame)
{
    struct view moved = *view;
    moved.camera.eye[0] += 0.2 * sin(0.7 * frame);
    return moved;
}

static bool run_burst(struct series_of_frames *series, const struct view *view, bool is_ahead,
                      int first, struct frame_times *times, struct error *err)
{
    const struct frame_completion arrival = {.context = series, .collect = collect};
    double wall_ms = wall_now_ms(), cpu_ms = cpu_now_ms();
    bool ok = true, is_done = true;
    series->left_ms = 0;
    renderer_set_completion(series->renderer, is_ahead ? &arrival : NULL);
    for (int i = 0; ok && i < BURST; i++) {
        const struct view at = view_at(view, first + i);
        struct frame *frame = &series->frames[i % 2];
        frame_finish(frame);
        ok = is_ahead ? renderer_submit(series->renderer, series->scene->rig.key, &at, frame,
                                        &is_done, err)
                      : renderer_render(series->renderer, series->scene->rig.key, &at, frame, err);
    }
    if (ok && !is_done)
        collect(series);
    renderer_set_completion(series->renderer, NULL);
    *times = (struct frame_times){.wall_ms = (wall_now_ms() - wall_ms) / BURST,
                                  .cpu_ms = (cpu_now_ms() - cpu_ms) / BURST};
    for (int i = 0; i < 2; i++)
        frame_finish(&series->frames[i]);
    if (ok && series->problem.code != ERROR_NONE)
        return error_pass(err, &series->problem);
    return ok;
}

static void tell(struct bench *bench, const struct bench_scene *scene, const char *name,
                 const struct samples *ahead, const struct samples *in_turn)
{
    bench_check(bench, &(struct check){.scene = scene->name,
                                       .subject = "camera moves",
                                       .name = name,
                                       .value = samples_summary(ahead).median /
                                                samples_summary(in_turn).median,
                                       .p = samples_difference_p(ahead, in_turn)});
}

static void tell_all(struct bench *bench, const struct bench_scene *scene,
                     const struct measurement m[VARIANTS], const struct samples *left_ms)
{
    bench_check(bench, &(struct check){.scene = scene->name,
                                       .subject = "camera moves",
                                       .name = "left after the last command, ms",
                                       .value = samples_summary(left_ms).median,
                                       .p = NAN});
    tell(bench, scene, "frame wall, ahead / in turn", &m[AHEAD].wall_ms, &m[IN_TURN].wall_ms);
    tell(bench, scene, "frame cpu, ahead / in turn", &m[AHEAD].cpu_ms, &m[IN_TURN].cpu_ms);
}

static bool run_scene(struct bench *bench, const struct bench_scene *scene, struct error *err)
{
    static const char *const names[] = {"in turn", "next one ahead"};
    struct series_of_frames series = {.renderer = bench_renderer(bench), .scene = scene};
    struct measurement m[VARIANTS] = {0};
    struct samples left_ms = {0};
    int size[2];
    bench_size(bench, 640, 360, size);
    struct view view = bench_scene_view(scene, size);
    view.ignore_scene_lights = false;
    view.quality.shadows = SHADOWS_DEEP;
    bool ok = true;
    for (struct rounds rounds = rounds_begin(bench); ok && rounds_next(&rounds);)
        for (int i = 0; ok && i < VARIANTS; i++) {
            struct frame_times times;
            ok = run_burst(&series, &view, i == AHEAD, BURST * rounds.done, &times, err);
            if (!ok || rounds.is_warming)
                continue;
            measurement_add(&m[i], &times);
            if (i == AHEAD)
                samples_add(&left_ms, series.left_ms / BURST);
        }
    for (int i = 0; ok && i < VARIANTS; i++)
        bench_result(bench, &(struct result){.scene = scene->name,
                                             .subject = "camera moves",
                                             .variant = names[i],
                                             .width = size[0],
                                             .height = size[1],
                                             .measurement = &m[i]});
    if (ok)
        tell_all(bench, scene, m, &left_ms);
    samples_finish(&left_ms);
    for (int i = 0; i < VARIANTS; i++)
        measurement_finish(&m[i]);
    return ok;
}

bool suite_ahead(struct bench *bench, struct error *err)
{
    return bench_scenes_run(bench, run_scene, err);
}
