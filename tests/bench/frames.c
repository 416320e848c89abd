/* SPDX-License-Identifier: MIT */
/* Interleaved rounds of whole frames. */
#include "tests/bench/frames.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static void save(const struct bench *bench, const struct image *color,
                 const struct frame_variant *variant, const struct rig_scene *scene)
{
    char name[160];
    snprintf(name, sizeof name, "bench-%s-%.40s-%s", bench->suite, scene->key, variant->name);
    for (char *c = name; *c; c++)
        if (*c == '/' || *c == ' ' || *c == ',')
            *c = '-';
    if (bench->options.saves_pictures)
        save_picture(color, name);
}

static bool measure(struct renderer *renderer, const struct rig_scene *scene,
                    const struct view *view, struct frame_times *times, struct frame *frame,
                    struct error *err)
{
    bool ok = renderer_render(renderer, scene->key, view, frame, err);
    meter_end(times);
    if (ok)
        frame_times_take_report(times, &frame->report);
    return ok;
}

bool frame_measure(struct renderer *renderer, const struct rig_scene *scene,
                   const struct view *view, bool rebuilds_shadows, struct frame_times *times,
                   struct frame_report *report, struct error *err)
{
    struct frame frame;
    meter_begin(rebuilds_shadows);
    bool ok = measure(renderer, scene, view, times, &frame, err);
    if (ok && report)
        *report = frame.report;
    frame_finish(&frame);
    return ok;
}

static bool run_one(struct bench *bench, const struct rig_scene *scene,
                    struct frame_variant *variant, const struct rounds *rounds, struct error *err)
{
    struct frame frame;
    struct frame_times times;
    struct view view = variant->view;
    struct view_node_override moved;
    if (variant->moves_camera)
        view.camera.eye[0] += 0.2 * sin(0.7 * rounds->done);
    view.animation_time_s += variant->frame_s * rounds->done;
    if (variant->moved) {
        moved = *variant->moved;
        moved.matrix[12] += 1e-3 * rounds->done;
        view.nodes = &moved;
        view.node_override_count = 1;
    }
    struct renderer *renderer = bench_renderer(bench);
    meter_begin(variant->rebuilds_shadows);
    if (variant->asks_lookups)
        meter_ask_lookups();
    if (!measure(renderer, scene, &view, &times, &frame, err))
        return error_wrap(err, "%s", variant->name);
    if (!rounds->is_warming)
        measurement_add(&variant->measurement, &times);
    variant->measurement.report = frame.report;
    if (rounds->done == 0)
        save(bench, &frame.outputs[VIEW_OUTPUT_COLOR], variant, scene);
    frame_finish(&frame);
    return true;
}

bool frames_run(struct bench *bench, const struct rig_scene *scene, struct frame_variant *variants,
                size_t count, struct error *err)
{
    for (struct rounds rounds = rounds_begin(bench); rounds_next(&rounds);)
        for (size_t i = 0; i < count; i++)
            if (!run_one(bench, scene, &variants[i], &rounds, err))
                return false;
    return true;
}

void frames_print_split(const struct bench *bench, const struct frame_variant *variant)
{
    const struct measurement *m = &variant->measurement;
    if (bench->options.is_json)
        return;
    printf("\n  %s: split by pass, cpu ms and wall ms, medians\n", variant->name);
    for (int i = 0; i < m->part_count; i++)
        printf("    %-28s%10.2f%10.2f\n", m->parts[i].name,
               samples_summary(&m->parts[i].cpu_ms).median,
               samples_summary(&m->parts[i].wall_ms).median);
    printf("    %-28s%10.2f%10.2f\n", "frame", samples_summary(&m->cpu_ms).median,
           samples_summary(&m->wall_ms).median);
}

void frames_tell(struct bench *bench, const char *scene, const char *subject,
                 const struct frame_variant *variants, int count)
{
    for (int i = 0; i < count; i++)
        bench_result(bench, &(struct result){.scene = scene,
                                             .subject = subject,
                                             .variant = variants[i].name,
                                             .width = variants[i].view.width_px,
                                             .height = variants[i].view.height_px,
                                             .measurement = &variants[i].measurement});
}

void frames_finish(struct frame_variant *variants, size_t count)
{
    for (size_t i = 0; i < count; i++)
        measurement_finish(&variants[i].measurement);
}
