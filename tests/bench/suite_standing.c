/* SPDX-License-Identifier: MIT */
/* Suite `standing`: what shadows that stand cost a frame whose camera moves, beside the frame
 * without them and their lookups alone. */
#include <math.h>
#include <stdio.h>

#include "tests/bench/frames.h"
#include "tests/bench/scenes.h"

enum { FEW = 25, MANY = 250 };
enum { OFF, RESTING, MOVING, VARIANTS };

static double part_cpu(const struct frame_variant *variant, const char *part)
{
    const struct part_series *series = measurement_part(&variant->measurement, part);
    return series ? samples_summary(&series->cpu_ms).median : NAN;
}

struct standing {
    struct bench *bench;
    const char *scene, *subject;
    const struct frame_variant *variants;
};

static void tell(const struct standing *standing, const char *name, double value, double bound)
{
    bench_check(standing->bench, &(struct check){.scene = standing->scene,
                                                 .subject = standing->subject,
                                                 .name = name,
                                                 .value = value,
                                                 .relation = bound > 0 ? "<=" : NULL,
                                                 .bound = bound,
                                                 .p = NAN});
}

static void tell_all(const struct standing *standing)
{
    const struct measurement *m = &standing->variants[MOVING].measurement;
    const double off = samples_summary(&standing->variants[OFF].measurement.cpu_ms).median;
    const double resting = samples_summary(&standing->variants[RESTING].measurement.cpu_ms).median;
    const double moving = samples_summary(&m->cpu_ms).median;
    const double lookups = part_cpu(&standing->variants[MOVING], PART_LOOKUPS);
    const double asked = (double)m->report.counts.lookups, taps = 4; /* each counts as its taps */
    tell(standing, "frame cpu camera moves / at rest", moving / resting, 1.3);
    tell(standing, "cpu but for shading, moves / off",
         1 + part_cpu(&standing->variants[MOVING], PART_SHADOW) / off, 1.3);
    tell(standing, "frame cpu moves / (off + lookups alone)", moving / (off + lookups), 1.3);
    tell(standing, "lookups alone / those of the frame", (double)m->lookups * taps / asked, 0);
    tell(standing, "a lookup alone, ns", lookups * 1e6 / (double)m->lookups, 0);
    tell(standing, "frame cpu deep / off", moving / off, 0);
}

/* Nothing is built, so the frame costs what it costs with a camera at rest. The forgetting of a
 * rebuilding variant would drop the maps: none here. */
bool standing_run(struct bench *bench, const struct bench_scene *scene, int count,
                  struct error *err)
{
    struct view_light spots[MANY];
    struct frame_variant variants[VARIANTS];
    static const char *const names[] = {"off, camera moves", "deep, at rest", "deep, camera moves"};
    char subject[32];
    int size[2];
    bench_size(bench, 1024, 768, size);
    bench_scene_spots(scene, spots, count);
    snprintf(subject, sizeof subject, "%d spots, 512^2", count);
    for (int i = 0; i < VARIANTS; i++) {
        variants[i] = (struct frame_variant){.name = names[i],
                                             .view = bench_scene_view(scene, size),
                                             .asks_lookups = i == MOVING,
                                             .moves_camera = i != RESTING};
        struct view *view = &variants[i].view;
        view->lights = spots;
        view->light_count = (size_t)count;
        view->quality.shadows = i == OFF ? SHADOWS_NONE : SHADOWS_DEEP;
        view->quality.shadow_resolution = 512;
    }
    bool ok = frames_run(bench, &scene->rig, variants, VARIANTS, err);
    if (ok && variants[MOVING].measurement.report.counts.shadow_maps_built)
        ok = error_set(err, ERROR_INTERNAL, "a camera that moves has shadows built");
    for (int i = 0; ok && i < VARIANTS; i++)
        bench_result(bench, &(struct result){.scene = scene->name,
                                             .subject = subject,
                                             .variant = variants[i].name,
                                             .width = size[0],
                                             .height = size[1],
                                             .stage = PART_LOOKUPS,
                                             .measurement = &variants[i].measurement});
    if (ok)
        tell_all(&(struct standing){bench, scene->name, subject, variants});
    frames_finish(variants, VARIANTS);
    return ok;
}

static bool run_scene(struct bench *bench, const struct bench_scene *scene, struct error *err)
{
    return standing_run(bench, scene, FEW, err) &&
           (bench->options.is_quick || standing_run(bench, scene, MANY, err));
}

bool suite_standing(struct bench *bench, struct error *err)
{
    return bench_scenes_run(bench, run_scene, err);
}
