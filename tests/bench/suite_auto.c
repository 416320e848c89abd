/* SPDX-License-Identifier: MIT */
/* Suite `auto`: how much longer than the fastest technique `shadows: auto` takes, at first and
 * after ten frames, on generated scenes under a moving camera. With --json the counts and times of
 * all, which tests/data/auto_timings*.json keep for the unit tests. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/cost/workload.h"
#include "renderer/frame/calibrate.h"
#include "renderer/shadows/technique.h"
#include "tests/bench/frames.h"
#include "tests/support/auto_replay.h"
#include "tests/support/generated_scene.h"

enum { SPECIAL = 7, SEEDS = 40, SEEDS_QUICK = 2, SEED_OF_FIT = 1000, SEEDS_OF_FIT = 24 };

/* --scene fit: other seeds, which the costs of renderer/forecast/forecast.c were fitted to. */
static bool is_of_fit(const struct bench_options *options)
{
    return options->scene && strcmp(options->scene, "fit") == 0;
}

/* The first cases are those that auto once got wrong. */
static bool make_scene(struct generated_scene *scene, int index,
                       const struct bench_options *options, struct error *err)
{
    static const size_t spots[] = {50, 100, 250};
    uint64_t first = is_of_fit(options) ? SEED_OF_FIT : 1;
    if (options->is_quick || is_of_fit(options))
        return generated_scene_make(scene, (uint64_t)index + first, err);
    if (index < 6)
        return generated_scene_make_boxes(scene, spots[index % 3], index < 3 ? 1 : 4, err);
    if (index == 6)
        return generated_scene_make_colonnade(scene, err);
    return generated_scene_make(scene, (uint64_t)(index - SPECIAL) + 1, err);
}

static bool count_work(const struct rig_scene *rig, const struct view *view,
                       struct workload *workload, struct error *err)
{
    struct scene_state state = {0};
    struct camera camera;
    bool ok = scene_state_init(&state, &rig->imported.scene, view, err) &&
              camera_resolve(&camera, view, &state, err) &&
              workload_measure(
                  workload,
                  &(struct workload_desc){.view = view, .state = &state, .camera = &camera}, err);
    scene_state_finish(&state);
    return ok;
}

/* Shadows stand; the camera moves a little. The first frame compiles and builds, the second may
 * still have to. */
static bool time_technique(struct bench *bench, const struct rig_scene *rig,
                           const struct view *from, enum shadow_technique technique,
                           struct replay_case *one, struct error *err)
{
    struct view view = *from;
    bool is_ours = bench->info.is_software || technique == SHADOWS_RAYTRACED;
    view.quality.shadows = technique;
    for (int frame = -2; frame < REPLAY_FRAMES; frame++) {
        struct frame_times times;
        view.camera.eye[1] += 0.01;
        struct frame_report report;
        if (!frame_measure(bench_renderer(bench), rig, &view, false, &times, &report, err))
            return false;
        if (technique == SHADOWS_RASTER_DEFAULT)
            one->maps_stay = !report.counts.shadow_maps_built;
        if (frame >= 0)
            one->ms[technique][frame] = calibrate_alone_ms(times.wall_ms, times.cpu_ms, is_ours);
    }
    return true;
}

/* Of candidates; others are compared where their forecasts gain much. */
static bool is_of_any_scene(enum shadow_technique technique)
{
    return shadow_technique_is_candidate(technique) && !shadow_method_of(technique)->fits;
}

static bool run_case(struct bench *bench, int index, struct replay_case *one, struct error *err)
{
    struct generated_scene *scene = calloc(1, sizeof *scene);
    struct rig_scene rig = {0};
    struct renderer *renderer = bench_renderer(bench);
    char key[32];
    snprintf(key, sizeof key, "generated-%d", index);
    bool ok = scene ? make_scene(scene, index, &bench->options, err)
                    : error_set(err, ERROR_NO_MEMORY, "scene");
    ok = ok && rig_scene_from_glb(&rig, renderer, key, scene->glb, scene->glb_bytes, err) &&
         count_work(&rig, &scene->view, &one->workload, err);
    if (ok) {
        snprintf(one->name, sizeof one->name, "%d: %s", index, scene->name);
        one->samples = scene->view.quality.samples;
    }
    for (int i = 0; ok && i < SHADOWS_COUNT; i++)
        ok = !is_of_any_scene((enum shadow_technique)i) ||
             time_technique(bench, &rig, &scene->view, (enum shadow_technique)i, one, err);
    rig_scene_finish(&rig, renderer);
    if (scene)
        generated_scene_finish(scene);
    free(scene);
    return ok;
}

struct tally {
    int cases, first_good, first_bad, later_good;
};

static void tell(struct bench *bench, const struct replay_case *one,
                 const struct replay_result *result, struct tally *tally)
{
    static const char *const names[SHADOWS_COUNT] = {
        [SHADOWS_RASTER_DEFAULT] = "maps",
        [SHADOWS_RAYTRACED] = "rays",
        [SHADOWS_RAYTRACED_SHADOWS] = "traced shadows",
    };
    tally->cases++;
    tally->first_good += result->first <= 1.25;
    tally->first_bad += result->first > 2;
    tally->later_good += result->later <= 1.1;
    fprintf(bench->options.is_json ? stderr : stdout,
            "  %-46.46s %8.1f %8.1f %8.1f  %-14s %5.2f  %-14s %5.2f\n", one->name,
            one->ms[SHADOWS_RASTER_DEFAULT][0], one->ms[SHADOWS_RAYTRACED][0],
            one->ms[SHADOWS_RAYTRACED_SHADOWS][0], names[result->first_technique], result->first,
            names[result->later_technique], result->later);
}

static void check(struct bench *bench, const char *name, double value, const char *relation,
                  double bound)
{
    bench_check(bench, &(struct check){.scene = "generated",
                                       .subject = "auto",
                                       .name = name,
                                       .value = value,
                                       .relation = bench->options.is_quick ? NULL : relation,
                                       .bound = bound,
                                       .p = NAN});
}

bool suite_auto(struct bench *bench, struct error *err)
{
    struct calibration calibration;
    struct tally tally = {.cases = 0};
    struct replay *replay = calloc(1, sizeof *replay);
    struct learning *learned = malloc(sizeof *learned);
    bool ok = replay && learned ? renderer_calibrate(bench_renderer(bench), &calibration, err)
                                : error_set(err, ERROR_NO_MEMORY, "suite auto");
    int cases = bench->options.is_quick      ? SEEDS_QUICK
                : is_of_fit(&bench->options) ? SEEDS_OF_FIT
                                             : SPECIAL + SEEDS;
    json_t *recorded = json_array();
    for (int i = 0; ok && i < cases; i++) {
        struct replay_case *one = &replay->cases[i];
        replay->speed = calibration.speed;
        ok = run_case(bench, i, one, err);
        if (!ok)
            break;
        learning_init(learned);
        const struct replay_result result = replay_run(replay, one, learned, NULL);
        tell(bench, one, &result, &tally);
        json_array_append_new(recorded, replay_case_to_json(one));
    }
    if (ok || json_array_size(recorded))
        json_array_append_new(bench->results,
                              json_pack("{s:s,s:o,s:O}", "suite", bench->suite, "speed",
                                        replay_speed_to_json(&replay->speed), "cases", recorded));
    json_decref(recorded);
    if (ok && tally.cases) {
        double all = tally.cases;
        check(bench, "first choice within 1.25 of the fastest", tally.first_good / all, ">=", 0.9);
        check(bench, "first choice beyond 2", tally.first_bad / all, "<=", 0);
        check(bench, "after ten frames within 1.1", tally.later_good / all, ">=", 0.95);
    }
    free(learned);
    free(replay);
    return ok;
}
