/* SPDX-License-Identifier: MIT */
/* Rounds, result lines and checks: the same for all suites. */
#include "tests/bench/bench.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct renderer *bench_renderer(struct bench *bench)
{
    struct error err = {0};
    if (bench->renderer)
        return bench->renderer;
    bench->renderer =
        renderer_create(&(struct renderer_desc){.hooks.redraws_surfaces = true}, &err);
    if (!bench->renderer) {
        fprintf(stderr, "%s: %s\n", err.code == ERROR_NO_DEVICE ? "skipped" : "vitrail-bench",
                err.message);
        exit(err.code == ERROR_NO_DEVICE ? 77 : 1);
    }
    renderer_get_info(bench->renderer, &bench->info);
    return bench->renderer;
}

bool bench_wants_scene(const struct bench *bench, const char *name)
{
    return !bench->options.scene || !strcmp(bench->options.scene, name);
}

void bench_size(const struct bench *bench, int width, int height, int size[2])
{
    size[0] = bench->options.width ? bench->options.width : width;
    size[1] = bench->options.height ? bench->options.height : height;
}

/* -- rounds -- */

enum { LEAST_ROUNDS = 5 };

struct rounds rounds_begin(const struct bench *bench)
{
    const struct bench_options *o = &bench->options;
    int warm_up = o->warm_up ? o->warm_up : o->is_quick ? 1 : 3;
    int most = o->frames ? o->frames : o->is_quick ? LEAST_ROUNDS : 30;
    return (struct rounds){.done = -warm_up - 1,
                           .least = most < LEAST_ROUNDS ? most : LEAST_ROUNDS,
                           .most = most,
                           .seconds = o->seconds > 0 ? o->seconds
                                      : o->is_quick  ? 2
                                                     : 12};
}

bool rounds_next(struct rounds *rounds)
{
    rounds->done++;
    rounds->is_warming = rounds->done < 0;
    if (rounds->done == 0)
        rounds->begin_ms = wall_now_ms();
    if (rounds->done < rounds->least)
        return true;
    return rounds->done < rounds->most && wall_now_ms() - rounds->begin_ms < rounds->seconds * 1e3;
}

/* -- results -- */

static json_t *json_of_summary(const struct samples *samples)
{
    struct summary s = samples_summary(samples);
    return json_pack("{s:f, s:f, s:f}", "median", s.median, "mad", s.mad, "p95", s.p95);
}

static json_t *json_of_counts(const struct frame_report *report)
{
    return json_pack(
        "{s:I, s:I, s:I, s:I, s:f, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I}",
        "lights", (json_int_t)report->counts.lights, "shadowed_lights",
        (json_int_t)report->counts.shadowed_lights, "events", (json_int_t)report->counts.events,
        "longest_list", (json_int_t)report->counts.longest_list, "mean_list",
        report->counts.mean_list, "lookups", (json_int_t)report->counts.lookups,
        "transparent_fragments", (json_int_t)report->counts.transparent_fragments,
        "light_list_entries", (json_int_t)report->counts.light_list_entries, "triangles",
        (json_int_t)report->counts.triangles, "shadow_maps_built",
        (json_int_t)report->counts.shadow_maps_built, "shadow_maps_reused",
        (json_int_t)report->counts.shadow_maps_reused, "draws", (json_int_t)report->counts.draws,
        "draw_calls", (json_int_t)report->counts.draw_calls, "culled",
        (json_int_t)report->counts.culled, "shadow_draws", (json_int_t)report->counts.shadow_draws,
        "shadow_culled", (json_int_t)report->counts.shadow_culled);
}

static json_t *json_of_result(const struct bench *bench, const struct result *result)
{
    const struct measurement *m = result->measurement;
    json_t *parts = json_array(), *bytes = json_object();
    for (int i = 0; i < m->part_count; i++)
        json_array_append_new(parts, json_pack("{s:s, s:o, s:o}", "part", m->parts[i].name,
                                               "wall_ms", json_of_summary(&m->parts[i].wall_ms),
                                               "cpu_ms", json_of_summary(&m->parts[i].cpu_ms)));
    for (int i = 0; i < m->report.byte_count; i++)
        json_object_set_new(bytes, m->report.bytes[i].structure,
                            json_integer((json_int_t)m->report.bytes[i].bytes));
    return json_pack(
        "{s:s, s:s, s:s, s:s, s:[ii], s:i, s:o, s:o, s:o, s:o, s:o, s:f, s:I}", "suite",
        bench->suite, "scene", result->scene, "subject", result->subject, "variant",
        result->variant, "size_px", result->width, result->height, "frames", (int)m->wall_ms.count,
        "wall_ms", json_of_summary(&m->wall_ms), "cpu_ms", json_of_summary(&m->cpu_ms), "parts",
        parts, "counts", json_of_counts(&m->report), "bytes", bytes, "mean_light_list",
        result->mean_light_list, "structure_bytes", (json_int_t)result->structure_bytes);
}

static void begin_table(struct bench *bench, const char *stage)
{
    const char *name = stage ? stage : "";
    if (bench->table && !strcmp(bench->table, name))
        return;
    bench->table = name;
    printf("\n%-8s%-29s%-25s%4s %23s%9s%9s", "scene", "case", "variant", "n",
           "frame cpu ms (mad,p95)", "wall", "(mad)");
    if (stage)
        printf("%17s%9s", stage, "wall");
    printf("%10s%11s%8s%8s\n", "KiB", "entries", "longest", "mean");
}

static void print_result(struct bench *bench, const struct result *result)
{
    const struct measurement *m = result->measurement;
    struct summary wall = samples_summary(&m->wall_ms), cpu = samples_summary(&m->cpu_ms);
    const struct part_series *stage = result->stage ? measurement_part(m, result->stage) : NULL;
    bool is_of_lights = result->mean_light_list > 0;
    begin_table(bench, result->stage);
    printf("%-8s%-29s%-25s%4zu %9.2f (%5.2f,%6.1f)%9.2f (%6.2f)", result->scene, result->subject,
           result->variant, m->wall_ms.count, cpu.median, cpu.mad, cpu.p95, wall.median, wall.mad);
    if (stage) {
        struct summary c = samples_summary(&stage->cpu_ms), w = samples_summary(&stage->wall_ms);
        printf("%9.2f (%5.2f)%9.2f", c.median, c.mad, w.median);
    } else if (result->stage) {
        printf("%17s%9s", "-", "-");
    }
    printf("%10.0f%11llu%8llu%8.2f\n", (double)result->structure_bytes / 1024,
           (unsigned long long)(is_of_lights ? m->report.counts.light_list_entries
                                             : m->report.counts.events),
           (unsigned long long)(is_of_lights ? 0 : m->report.counts.longest_list),
           is_of_lights ? result->mean_light_list : m->report.counts.mean_list);
    fflush(stdout);
}

void bench_result(struct bench *bench, const struct result *result)
{
    json_array_append_new(bench->results, json_of_result(bench, result));
    if (!bench->options.is_json)
        print_result(bench, result);
    else
        fprintf(stderr, "%s: %s, %s, %s\n", bench->suite, result->scene, result->subject,
                result->variant);
}

static bool is_met(const struct check *check)
{
    return !strcmp(check->relation, "<=") ? check->value <= check->bound
                                          : check->value >= check->bound;
}

void bench_check(struct bench *bench, const struct check *check)
{
    json_t *line = json_pack("{s:s, s:s, s:s, s:s}", "suite", bench->suite, "scene", check->scene,
                             "subject", check->subject, "name", check->name);
    /* JSON knows no NAN: what could not be computed is null */
    json_object_set_new(line, "value",
                        isfinite(check->value) ? json_real(check->value) : json_null());
    json_object_set_new(line, "p", isfinite(check->p) ? json_real(check->p) : json_null());
    if (check->relation) {
        json_object_set_new(line, "target", json_sprintf("%s %g", check->relation, check->bound));
        json_object_set_new(line, "is_met", json_boolean(is_met(check)));
    }
    json_array_append_new(bench->checks, line);
    if (bench->options.is_json)
        return;
    printf("  %-7s %-28s %-46s %8.3f", check->scene, check->subject, check->name, check->value);
    if (isfinite(check->p))
        printf("  p %.2g", check->p);
    if (check->relation)
        printf("  target %s %g: %s", check->relation, check->bound,
               is_met(check) ? "met" : "MISSED");
    printf("\n");
    fflush(stdout);
}

/* -- series -- */

static double growth_at(enum growth growth, double x)
{
    switch (growth) {
    case GROWTH_LOG:
        return log2(2 * x);
    case GROWTH_LINEAR:
        return x;
    case GROWTH_SORT:
        return x * log2(2 * x);
    case GROWTH_SQUARE:
        return x * x;
    case GROWTH_ANY:
        break;
    }
    return NAN;
}

/* The exponent of the points from `first` on. */
static double check_growth(struct bench *bench, const struct series *series, int first)
{
    double expected[SERIES_MAX];
    char name[96];
    size_t count = (size_t)(series->count - first);
    for (int i = 0; i < series->count; i++)
        expected[i] = growth_at(series->growth, series->x[i]);
    snprintf(name, sizeof name, "exponent of %s%s", series->name, first ? ", last half" : "");
    struct check check = {.scene = series->scene,
                          .subject = series->subject,
                          .name = name,
                          .value = fit_exponent(series->x + first, series->y + first, count),
                          .relation = series->growth == GROWTH_ANY ? NULL : "<=",
                          .bound = 1.05 * fit_exponent(series->x + first, expected + first, count),
                          .p = NAN};
    bench_check(bench, &check);
    return check.value;
}

static json_t *json_or_null(double value)
{
    return isfinite(value) ? json_real(value) : json_null();
}

void bench_series(struct bench *bench, const struct series *series)
{
    json_t *points = json_array();
    assert(series->count <= SERIES_MAX);
    for (int i = 0; i < series->count; i++)
        json_array_append_new(
            points,
            json_pack("[f, o]", series->x[i], json_or_null(series->y[i] > 0 ? series->y[i] : NAN)));
    json_t *line = json_pack("{s:s, s:s, s:s, s:s, s:s, s:s, s:o}", "suite", bench->suite, "scene",
                             series->scene, "subject", series->subject, "name", series->name, "of",
                             series->of, "unit", series->unit, "points", points);
    json_array_append_new(bench->series, line);
    if (series->count < 2)
        return;
    json_object_set_new(line, "exponent", json_or_null(check_growth(bench, series, 0)));
    if (series->count >= 5)
        json_object_set_new(line, "exponent_last_half",
                            json_or_null(check_growth(bench, series, series->count / 2)));
}
