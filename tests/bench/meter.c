/* SPDX-License-Identifier: MIT */
/* The meter, and the wrapped entry points that feed it. */
#include "tests/bench/meter.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "renderer/gl/scope.h"
#include "renderer/lights/light_lists.h"
#include "renderer/shadows/shadows.h"
#include "tests/bench/lookups.h"

/* The frame being measured. A wrapped function has no room for an argument, so this is the one
 * place of the program with state of its own; it belongs to the GL thread. */
static _Thread_local struct {
    struct frame_times times;
    double wall_ms, cpu_ms;           /* at the frame's begin */
    double pass_wall_ms, pass_cpu_ms; /* at the pass's begin */
    char pass[REPORT_NAME_BYTES];
    double aside_wall_ms, aside_cpu_ms; /* within the frame, but not of it */
    bool rebuilds_shadows, asks_lookups;
} meter;

static double now_ms(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

double wall_now_ms(void)
{
    return now_ms(CLOCK_MONOTONIC);
}

double cpu_now_ms(void)
{
    return now_ms(CLOCK_PROCESS_CPUTIME_ID);
}

static struct part *find_part(struct frame_times *times, const char *name)
{
    for (int i = 0; i < times->part_count; i++)
        if (!strcmp(times->parts[i].name, name))
            return &times->parts[i];
    if (times->part_count == PARTS_MAX)
        return &times->parts[PARTS_MAX - 1];
    struct part *part = &times->parts[times->part_count++];
    snprintf(part->name, sizeof part->name, "%s", name);
    return part;
}

static void add_part(struct frame_times *times, const char *name, double wall_ms, double cpu_ms)
{
    struct part *part = find_part(times, name);
    part->wall_ms += wall_ms;
    part->cpu_ms += cpu_ms;
}

void meter_begin(bool rebuilds_shadows)
{
    memset(&meter, 0, sizeof meter);
    meter.rebuilds_shadows = rebuilds_shadows;
    meter.wall_ms = wall_now_ms();
    meter.cpu_ms = cpu_now_ms();
}

void meter_ask_lookups(void)
{
    meter.asks_lookups = true;
}

static bool is_stage(const char *name)
{
    return name[0] == '=';
}

void meter_end(struct frame_times *times)
{
    *times = meter.times;
    times->cpu_ms = cpu_now_ms() - meter.cpu_ms - meter.aside_cpu_ms;
    times->wall_ms = wall_now_ms() - meter.wall_ms - meter.aside_wall_ms;
}

void frame_times_take_report(struct frame_times *times, const struct frame_report *report)
{
    for (int i = 0; i < times->part_count; i++)
        if (!is_stage(times->parts[i].name))
            times->parts[i].wall_ms = 0;
    double wall_ms = 0, cpu_ms = 0;
    for (int i = 0; i < report->pass_count; i++) {
        struct part *part = find_part(times, report->passes[i].pass);
        part->wall_ms += isnan(report->passes[i].ms) ? 0 : report->passes[i].ms;
        if (!strcmp(part->name, "light_list")) /* a part of it is no scope */
            part->cpu_ms = find_part(times, PART_LIGHT_LIST)->cpu_ms;
    }
    for (int i = 0; i < times->part_count; i++) {
        wall_ms += is_stage(times->parts[i].name) ? 0 : times->parts[i].wall_ms;
        cpu_ms += is_stage(times->parts[i].name) ? 0 : times->parts[i].cpu_ms;
    }
    add_part(times, PART_OTHER, fmax(times->wall_ms - wall_ms, 0), fmax(times->cpu_ms - cpu_ms, 0));
}

/* -- wrapped -- */

void __real_gpu_scope_begin(struct gpu_timeline *timeline, const struct gpu_scope_desc *desc);
void __real_gpu_scope_end(struct gpu_timeline *timeline);
bool __real_shadow_system_prepare(struct shadow_system *shadows,
                                  const struct shadow_prepare_desc *desc,
                                  struct frame_report *report, struct error *err);
bool __real_light_lists_prepare(struct light_lists *lists, const struct light_lists_desc *desc,
                                struct frame_report *report, struct error *err);
void __wrap_gpu_scope_begin(struct gpu_timeline *timeline, const struct gpu_scope_desc *desc);
void __wrap_gpu_scope_end(struct gpu_timeline *timeline);
bool __wrap_shadow_system_prepare(struct shadow_system *shadows,
                                  const struct shadow_prepare_desc *desc,
                                  struct frame_report *report, struct error *err);
bool __wrap_light_lists_prepare(struct light_lists *lists, const struct light_lists_desc *desc,
                                struct frame_report *report, struct error *err);
bool __real_shade_window(struct shade *shade, const struct shade_desc *desc, struct error *err);
bool __wrap_shade_window(struct shade *shade, const struct shade_desc *desc, struct error *err);

void __wrap_gpu_scope_begin(struct gpu_timeline *timeline, const struct gpu_scope_desc *desc)
{
    __real_gpu_scope_begin(timeline, desc);
    snprintf(meter.pass, sizeof meter.pass, "%s", desc->pass);
    meter.pass_wall_ms = wall_now_ms();
    meter.pass_cpu_ms = cpu_now_ms();
}

void __wrap_gpu_scope_end(struct gpu_timeline *timeline)
{
    __real_gpu_scope_end(timeline);
    add_part(&meter.times, meter.pass, wall_now_ms() - meter.pass_wall_ms,
             cpu_now_ms() - meter.pass_cpu_ms);
}

bool __wrap_shadow_system_prepare(struct shadow_system *shadows,
                                  const struct shadow_prepare_desc *desc,
                                  struct frame_report *report, struct error *err)
{
    if (meter.rebuilds_shadows)
        shadow_system_forget(shadows, desc->scene_key);
    double wall_ms = wall_now_ms(), cpu_ms = cpu_now_ms();
    bool ok = __real_shadow_system_prepare(shadows, desc, report, err);
    add_part(&meter.times, PART_SHADOW, wall_now_ms() - wall_ms, cpu_now_ms() - cpu_ms);
    return ok;
}

bool __wrap_light_lists_prepare(struct light_lists *lists, const struct light_lists_desc *desc,
                                struct frame_report *report, struct error *err)
{
    double wall_ms = wall_now_ms(), cpu_ms = cpu_now_ms();
    bool ok = __real_light_lists_prepare(lists, desc, report, err);
    add_part(&meter.times, PART_LIGHT_LIST, wall_now_ms() - wall_ms, cpu_now_ms() - cpu_ms);
    return ok;
}

bool __wrap_shade_window(struct shade *shade, const struct shade_desc *desc, struct error *err)
{
    if (!__real_shade_window(shade, desc, err))
        return false;
    if (!meter.asks_lookups)
        return true;
    struct lookup_times lookups;
    struct frame_times frame = meter.times; /* its passes, without those of what follows */
    double wall_ms = wall_now_ms(), cpu_ms = cpu_now_ms();
    bool ok = lookups_measure(shade, desc, &lookups, err);
    meter.times = frame;
    meter.aside_wall_ms += wall_now_ms() - wall_ms;
    meter.aside_cpu_ms += cpu_now_ms() - cpu_ms;
    if (ok) {
        add_part(&meter.times, PART_LOOKUPS, lookups.asked_wall_ms - lookups.silent_wall_ms,
                 lookups.asked_cpu_ms - lookups.silent_cpu_ms);
        meter.times.lookups += lookups.lookups;
    }
    return ok;
}

/* -- many frames -- */

static struct part_series *find_series(struct measurement *measurement, const char *name)
{
    for (int i = 0; i < measurement->part_count; i++)
        if (!strcmp(measurement->parts[i].name, name))
            return &measurement->parts[i];
    if (measurement->part_count == PARTS_MAX)
        return NULL;
    struct part_series *series = &measurement->parts[measurement->part_count++];
    snprintf(series->name, sizeof series->name, "%s", name);
    return series;
}

void measurement_add(struct measurement *measurement, const struct frame_times *times)
{
    samples_add(&measurement->wall_ms, times->wall_ms);
    samples_add(&measurement->cpu_ms, times->cpu_ms);
    measurement->lookups = times->lookups;
    for (int i = 0; i < times->part_count; i++) {
        struct part_series *series = find_series(measurement, times->parts[i].name);
        if (!series)
            continue;
        samples_add(&series->wall_ms, times->parts[i].wall_ms);
        samples_add(&series->cpu_ms, times->parts[i].cpu_ms);
    }
}

void measurement_finish(struct measurement *measurement)
{
    samples_finish(&measurement->wall_ms);
    samples_finish(&measurement->cpu_ms);
    for (int i = 0; i < measurement->part_count; i++) {
        samples_finish(&measurement->parts[i].wall_ms);
        samples_finish(&measurement->parts[i].cpu_ms);
    }
    *measurement = (struct measurement){0};
}

const struct part_series *measurement_part(const struct measurement *measurement, const char *name)
{
    for (int i = 0; i < measurement->part_count; i++)
        if (!strcmp(measurement->parts[i].name, name))
            return &measurement->parts[i];
    return NULL;
}
