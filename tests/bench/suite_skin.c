/* SPDX-License-Identifier: MIT */
/* Suite `skin`: skinned vertices per second, and what one skinned figure that moves costs a frame
 * of a scene that otherwise stands. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "renderer/scene/scene_state.h"
#include "tests/bench/frames.h"
#include "tests/bench/skinned_figure.h"

enum { PARTS = 400 };
enum { STANDS, MOVES, VARIANTS };

static const double FRAME_S = 0.04;

/* One lamp reaches the figure, the other one boxes alone. */
static const struct view_light lamps[] = {
    {.type = SCENE_LIGHT_SPOT,
     .position = {1.5, 4, 2},
     .direction = {-0.33, -0.83, -0.44},
     .color = {1, 1, 1},
     .intensity = 200,
     .outer_cone_deg = 40,
     .range = 9},
    {.type = SCENE_LIGHT_SPOT,
     .position = {3.2, 0.6, -2},
     .direction = {0, -1, 0},
     .color = {1, 0.8, 0.6},
     .intensity = 10,
     .outer_cone_deg = 50,
     .range = 1},
};

static struct view figure_view(const int size[2], enum shadow_technique shadows)
{
    return (struct view){.width_px = size[0],
                         .height_px = size[1],
                         .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                    .eye = {0, 2.5, 6},
                                    .target = {0, 0.8, 0},
                                    .fov_y_deg = 45},
                         .lights = lamps,
                         .light_count = sizeof lamps / sizeof *lamps,
                         .is_animated = true,
                         .quality = {.shadows = shadows, .samples = 4, .shadow_resolution = 512}};
}

static bool open_figure(struct bench *bench, int rings, int parts, struct rig_scene *rig,
                        struct error *err)
{
    size_t size;
    void *glb = skinned_figure_build(&(struct skinned_figure_desc){rings, parts}, &size);
    bool ok = rig_scene_from_glb(rig, bench_renderer(bench), "figure", glb, size, err);
    free(glb);
    return ok;
}

/* The state of a scene that is nothing but the figure, once for each pose. */
static bool run_vertices(struct bench *bench, struct error *err)
{
    struct rig_scene rig = {0};
    struct measurement measurement = {0};
    const int rings = bench->options.is_quick ? 200 : 4000, size[2] = {64, 64};
    bool ok = open_figure(bench, rings, 0, &rig, err);
    for (struct rounds rounds = rounds_begin(bench); ok && rounds_next(&rounds);) {
        struct scene_state state;
        struct frame_times times;
        struct view view = figure_view(size, SHADOWS_NONE);
        view.animation_time_s = FRAME_S * (rounds.done + 1);
        meter_begin(false);
        ok = scene_state_init(&state, &rig.imported.scene, &view, err);
        meter_end(&times);
        scene_state_finish(&state);
        if (ok && !rounds.is_warming)
            measurement_add(&measurement, &times);
    }
    if (ok)
        bench_check(bench, &(struct check){.scene = "figure",
                                           .subject = "pose alone",
                                           .name = "million skinned vertices/s",
                                           .value = rings * FIGURE_SIDES / 1e3 /
                                                    samples_summary(&measurement.cpu_ms).median,
                                           .p = NAN});
    measurement_finish(&measurement);
    rig_scene_finish(&rig, bench_renderer(bench));
    return ok;
}

static void state_cost(struct bench *bench, const char *subject,
                       const struct frame_variant *variants)
{
    const struct measurement *stands = &variants[STANDS].measurement;
    const struct measurement *moves = &variants[MOVES].measurement;
    struct check check = {.scene = "figure",
                          .subject = subject,
                          .name = "cpu ms, one figure moves - stands",
                          .value = samples_summary(&moves->cpu_ms).median -
                                   samples_summary(&stands->cpu_ms).median,
                          .p = samples_difference_p(&moves->cpu_ms, &stands->cpu_ms)};
    bench_check(bench, &check);
    check = (struct check){.scene = "figure",
                           .subject = subject,
                           .name = "shadows built for it",
                           .value = (double)moves->report.counts.shadow_maps_built,
                           .relation = "<=",
                           .bound = 1, /* of two lamps */
                           .p = NAN};
    bench_check(bench, &check);
}

static bool run_frames(struct bench *bench, const struct rig_scene *rig, const char *subject,
                       enum shadow_technique shadows, const int size[2], struct error *err)
{
    struct frame_variant variants[VARIANTS] = {
        [STANDS] = {.name = "stands", .view = figure_view(size, shadows), .moves_camera = true},
        [MOVES] = {.name = "moves",
                   .view = figure_view(size, shadows),
                   .moves_camera = true,
                   .frame_s = FRAME_S},
    };
    /* each by itself: in turns the standing one would find the pose of the other */
    bool ok = true;
    for (int i = 0; ok && i < VARIANTS; i++)
        ok = frames_run(bench, rig, &variants[i], 1, err);
    if (ok) {
        frames_tell(bench, "figure", subject, variants, VARIANTS);
        state_cost(bench, subject, variants);
    }
    frames_finish(variants, VARIANTS);
    return ok;
}

bool suite_skin(struct bench *bench, struct error *err)
{
    struct rig_scene rig = {0};
    int size[2];
    bench_size(bench, 640, 360, size);
    bool ok = run_vertices(bench, err) &&
              open_figure(bench, bench->options.is_quick ? 20 : 200, PARTS, &rig, err) &&
              run_frames(bench, &rig, "deep", SHADOWS_DEEP, size, err) &&
              run_frames(bench, &rig, "ray traced", SHADOWS_RAYTRACED, size, err);
    rig_scene_finish(&rig, bench_renderer(bench));
    return ok;
}
