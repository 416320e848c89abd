/* SPDX-License-Identifier: MIT */
/* Suite `layers`: the shadow system alone, building and asking maps of 1 to 64 layers in the
 * default and the linked forms, against the targets of the project.
 *
 * Scenes, under one spot light: `panes`, D level panes over the whole map; `quads`, 4 D tilted
 * quads of a quarter of the map each, anywhere in it, and 8 opaque ones of 3 %. In random order.
 * Lookups: one point per pixel of the picture's size on a floor below all layers, and on a slope
 * that passes through them. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/bench/bench.h"
#include "tests/support/shadow_rig.h"

enum { FORMS = 3, REPEATS = 2 };

static const struct {
    const char *name;
    enum shadow_technique shadows;
    bool faithful;
} forms[FORMS] = {{"deep", SHADOWS_DEEP, false},
                  {"deep-linked", SHADOWS_DEEP_LINKED, false},
                  {"linked-faithful", SHADOWS_DEEP_LINKED, true}};

static const double LAMP_Y = 10, LOWEST = 1, HIGHEST = 8;
static const struct view_light lamp = {.type = SCENE_LIGHT_SPOT,
                                       .position = {0, 10, 0},
                                       .direction = {0, -1, 0},
                                       .color = {1, 1, 1},
                                       .intensity = 1,
                                       .outer_cone_deg = 30};

struct layer_case {
    const char *scene; /* "panes" or "quads" */
    int layers, resolution;
    bool is_scaling; /* fewer lookups, and without the targets, which are of other sizes */
    char subject[32];
    double build_ms[FORMS], lookup_ns[FORMS]; /* out; a lookup without what asks it */
    struct shadow_rig rig;
    struct pane_scene panes;
};

/* An insertion into a linked list walks it: time that grows with the square of the layers. */
enum { LINKED_SCALE_MAX = 256 };

static bool leaves_out(const struct layer_case *c, int form)
{
    return c->is_scaling && c->layers > LINKED_SCALE_MAX && form > 0 && form < FORMS;
}

/* -- scenes -- */

static void add_pane(struct pane_scene *panes, uint64_t *seed, double y, double share, double tilt,
                     bool is_opaque)
{
    double half = (LAMP_Y - y) * tan(M_PI / 6); /* of the map at this height */
    double turn = tilt > 0 ? 2 * M_PI * rig_random(seed) : 0;
    double side = share < 1 ? half * sqrt(share) : 1.2 * half;
    double room = share < 1 ? half - side : 0;
    double lean = tilt * (2 * rig_random(seed) - 1);
    struct pane pane = {
        .center = {room * (2 * rig_random(seed) - 1), y, room * (2 * rig_random(seed) - 1)},
        .u = {side * cos(turn) * cos(lean), side * sin(lean), side * sin(turn) * cos(lean)},
        .v = {side * sin(turn), 0, -side * cos(turn)},
        .is_opaque = is_opaque};
    for (int k = 0; k < 3; k++)
        pane.color[k] = (float)(0.2 + 0.75 * rig_random(seed));
    pane_scene_add(panes, &pane);
}

static void build_scene(struct layer_case *c)
{
    uint64_t seed = 7 + (uint64_t)c->layers;
    if (!strcmp(c->scene, "panes")) {
        for (int i = 0; i < c->layers; i++) /* every height once, in shuffled order */
            add_pane(&c->panes, &seed,
                     LOWEST + (HIGHEST - LOWEST) * ((i * 37 + 5) % c->layers + 0.5) / c->layers, 1,
                     0, false);
        return;
    }
    for (int i = 0; i < 4 * c->layers; i++)
        add_pane(&c->panes, &seed, LOWEST + (HIGHEST - LOWEST) * rig_random(&seed), 0.25, 0.35,
                 false);
    for (int i = 0; i < 8; i++)
        add_pane(&c->panes, &seed, LOWEST + (HIGHEST - LOWEST) * rig_random(&seed), 0.03, 0.35,
                 true);
}

static struct view_quality quality_of(const struct layer_case *c, int form, int taps)
{
    return (struct view_quality){.shadows = forms[form].shadows,
                                 .faithful = forms[form].faithful,
                                 .shadow_resolution = c->resolution,
                                 .shadow_taps = taps};
}

/* -- building -- */

/* Standing structures are kept unless `rebuilds`. */
static bool prepare(struct layer_case *c, const struct view_quality *quality, bool rebuilds,
                    struct frame_times *times, struct error *err)
{
    struct shadow_rig *rig = &c->rig;
    struct shadow_prepare_desc desc = {.scene_key = "panes",
                                       .gpu = rig->gpu,
                                       .state = &rig->state,
                                       .arena = rig->arena,
                                       .quality = quality};
    memcpy(desc.eye, rig->eye, sizeof desc.eye);
    rig->report = (struct frame_report){0};
    meter_begin(rebuilds);
    bool ok = shadow_system_prepare(rig->shadows, &desc, &rig->report, err);
    gpu_timeline_collect(rig->timeline, &rig->report);
    meter_end(times);
    frame_times_take_report(times, &rig->report);
    return gl_context_check(rig->context, "building shadows", err) && ok;
}

static struct summary part_cpu(const struct measurement *m, const char *part)
{
    static const struct samples none;
    const struct part_series *series = measurement_part(m, part);
    return samples_summary(series ? &series->cpu_ms : &none);
}

/* The walk over finished linked lists only counts them for the report. */
static double build_cpu(const struct measurement *m)
{
    double walk = part_cpu(m, "shadow.linked.walk").median;
    return part_cpu(m, PART_SHADOW).median - (isfinite(walk) ? walk : 0);
}

static bool measure_builds(struct bench *bench, struct layer_case *c, struct error *err)
{
    struct measurement m[FORMS] = {0};
    bool ok = true;
    for (struct rounds rounds = rounds_begin(bench); ok && rounds_next(&rounds);) {
        for (int i = 0; ok && i < FORMS; i++) {
            if (leaves_out(c, i))
                continue;
            struct view_quality quality = quality_of(c, i, 1);
            struct frame_times times;
            ok = prepare(c, &quality, true, &times, err);
            if (ok && !rounds.is_warming)
                measurement_add(&m[i], &times);
            m[i].report = c->rig.report;
        }
    }
    uint64_t texels = (uint64_t)c->resolution * (uint64_t)c->resolution;
    for (int i = 0; ok && i < FORMS && !leaves_out(c, i); i++)
        bench_result(bench, &(struct result){
                                .scene = c->scene,
                                .subject = c->subject,
                                .variant = forms[i].name,
                                .width = c->resolution,
                                .height = c->resolution,
                                .stage = PART_SHADOW,
                                .structure_bytes = m[i].report.counts.events * (i ? 16 : 18) +
                                                   texels * (forms[i].faithful ? 4 : 8),
                                .measurement = &m[i],
                            });
    for (int i = 1; ok && i < FORMS && !leaves_out(c, i); i++) {
        char name[96];
        snprintf(name, sizeof name, "build cpu deep / %s (no walk)", forms[i].name);
        bench_check(bench, &(struct check){.scene = c->scene,
                                           .subject = c->subject,
                                           .name = name,
                                           .value = build_cpu(&m[0]) / build_cpu(&m[i]),
                                           .relation = c->is_scaling ? NULL : "<=",
                                           .bound = c->layers == 1 ? 1.2 : 1,
                                           .p = NAN});
    }
    for (int i = 0; i < FORMS; i++) {
        c->build_ms[i] = build_cpu(&m[i]);
        measurement_finish(&m[i]);
    }
    return ok;
}

/* -- looking up -- */

struct lookup {
    const char *place; /* "floor" or "slope" */
    int taps, width, height;
    struct shadow_probe_point *points;
    float (*answers)[4];
};

static void place_points(struct lookup *lookup)
{
    bool is_slope = !strcmp(lookup->place, "slope");
    for (int y = 0; y < lookup->height; y++) {
        for (int x = 0; x < lookup->width; x++) {
            struct shadow_probe_point *p = &lookup->points[y * lookup->width + x];
            double s = (x + 0.5) / lookup->width, t = (y + 0.5) / lookup->height;
            double height = is_slope ? HIGHEST * (1 - t) : 0;
            double half = 0.8 * (LAMP_Y - height) * tan(M_PI / 6);
            *p = (struct shadow_probe_point){
                .p = {(float)(half * (2 * s - 1)), (float)height, (float)(half * (2 * t - 1))},
                .object = UINT32_MAX,
                .n = {0, 1, 0}};
        }
    }
}

/* Time of one dispatch: of 1 + REPEATS less that of 1, which carries transfers and waiting. */
static bool measure_lookup(struct layer_case *c, struct lookup *lookup, bool asks_nothing,
                           struct frame_times *times, struct error *err)
{
    double wall[2], cpu[2];
    uint32_t count = (uint32_t)(lookup->width * lookup->height);
    for (uint32_t i = 0; i < count; i++)
        lookup->points[i].shadow = shadow_system_record(c->rig.shadows, 0);
    for (int k = 0; k < 2; k++) {
        wall[k] = wall_now_ms();
        cpu[k] = cpu_now_ms();
        struct shadow_probe_desc desc = {.points = lookup->points,
                                         .count = count,
                                         .repeat = k ? 1 + REPEATS : 1,
                                         .asks_nothing = asks_nothing};
        if (!shadow_probe_run(c->rig.shadows, c->rig.programs, &desc, lookup->answers, err))
            return false;
        wall[k] = wall_now_ms() - wall[k];
        cpu[k] = cpu_now_ms() - cpu[k];
    }
    *times = (struct frame_times){.wall_ms = (wall[1] - wall[0]) / REPEATS,
                                  .cpu_ms = (cpu[1] - cpu[0]) / REPEATS};
    return gl_context_check(c->rig.context, "asking for shadows", err);
}

static void report_lookups(struct bench *bench, const struct layer_case *c,
                           const struct lookup *lookup, const struct measurement m[FORMS + 1])
{
    double harness = samples_summary(&m[FORMS].cpu_ms).median;
    char subject[64], name[96];
    snprintf(subject, sizeof subject, "%s %s x%d", c->subject, lookup->place, lookup->taps);
    for (int i = 0; i <= FORMS; i++) {
        if (leaves_out(c, i))
            continue;
        bench_result(bench, &(struct result){.scene = c->scene,
                                             .subject = subject,
                                             .variant = i < FORMS ? forms[i].name : "no query",
                                             .width = lookup->width,
                                             .height = lookup->height,
                                             .measurement = &m[i]});
    }
    for (int i = 1; i < FORMS && !leaves_out(c, i); i++) {
        snprintf(name, sizeof name, "lookup cpu %s / deep", forms[i].name);
        double target = c->is_scaling ? 0 : c->layers == 16 ? 1.8 : c->layers == 64 ? 3.5 : 0;
        bench_check(bench, &(struct check){.scene = c->scene,
                                           .subject = subject,
                                           .name = name,
                                           .value = samples_summary(&m[i].cpu_ms).median /
                                                    samples_summary(&m[0].cpu_ms).median,
                                           .relation = target > 0 ? ">=" : NULL,
                                           .bound = target,
                                           .p = samples_difference_p(&m[i].cpu_ms, &m[0].cpu_ms)});
        snprintf(name, sizeof name, "net lookup cpu %s / deep", forms[i].name);
        bench_check(bench,
                    &(struct check){.scene = c->scene,
                                    .subject = subject,
                                    .name = name,
                                    .value = (samples_summary(&m[i].cpu_ms).median - harness) /
                                             (samples_summary(&m[0].cpu_ms).median - harness),
                                    .p = NAN});
    }
}

static bool measure_lookups(struct bench *bench, struct layer_case *c, struct lookup *lookup,
                            struct error *err)
{
    struct measurement m[FORMS + 1] = {0}; /* the last one asks nothing */
    bool ok = true;
    place_points(lookup);
    for (struct rounds rounds = rounds_begin(bench); ok && rounds_next(&rounds);) {
        for (int i = 0; ok && i <= FORMS; i++) {
            if (leaves_out(c, i))
                continue;
            struct view_quality quality = quality_of(c, i % FORMS, lookup->taps);
            struct frame_times times;
            ok = prepare(c, &quality, false, &times, err);
            m[i].report = c->rig.report;
            ok = ok && measure_lookup(c, lookup, i == FORMS, &times, err);
            if (ok && !rounds.is_warming)
                measurement_add(&m[i], &times);
        }
    }
    if (ok)
        report_lookups(bench, c, lookup, m);
    double harness = samples_summary(&m[FORMS].cpu_ms).median;
    for (int i = 0; i < FORMS; i++)
        c->lookup_ns[i] = (samples_summary(&m[i].cpu_ms).median - harness) * 1e6 /
                          (lookup->width * lookup->height);
    for (int i = 0; i <= FORMS; i++)
        measurement_finish(&m[i]);
    return ok;
}

static bool measure_all_lookups(struct bench *bench, struct layer_case *c, struct error *err)
{
    int size[2];
    bench_size(bench, c->is_scaling ? 640 : 1280, c->is_scaling ? 360 : 720, size);
    size_t count = (size_t)size[0] * (size_t)size[1];
    struct lookup lookup = {.width = size[0], .height = size[1]};
    lookup.points = malloc(count * sizeof *lookup.points);
    lookup.answers = malloc(count * sizeof *lookup.answers);
    bool ok = lookup.points && lookup.answers;
    if (!ok)
        error_set(err, ERROR_NO_MEMORY, "%zu points", count);
    for (int i = 0; ok && i < (c->is_scaling ? 1 : 4); i++) {
        lookup.place = i / 2 ? "slope" : "floor";
        lookup.taps = i % 2 ? 4 : 1;
        ok = measure_lookups(bench, c, &lookup, err);
    }
    free(lookup.points);
    free(lookup.answers);
    return ok;
}

/* -- the suite -- */

/* The linked form gets room for all its elements at once, so that it never fills its lists twice.
 */
static bool run_case(struct bench *bench, struct layer_case *c, struct error *err)
{
    uint64_t texels = (uint64_t)c->resolution * (uint64_t)c->resolution;
    struct view_quality quality = quality_of(c, 0, 1);
    if (!shadow_rig_open(&c->rig, 6ull << 30, texels * (uint64_t)(c->layers + 2)))
        exit(77);
    const struct gl_limits *limits = gl_context_limits(c->rig.context);
    snprintf(bench->info.renderer, sizeof bench->info.renderer, "%s", limits->renderer);
    snprintf(bench->info.version, sizeof bench->info.version, "%s", limits->version);
    bench->info.has_true_timers = limits->has_true_timers;
    build_scene(c);
    bool ok = shadow_rig_prepare(&c->rig, &c->panes, &lamp, 1, (double[]){0, 0, 0}, &quality, err);
    ok = ok && measure_builds(bench, c, err) && measure_all_lookups(bench, c, err);
    shadow_rig_close(&c->rig);
    pane_scene_finish(&c->panes);
    return ok;
}

bool suite_layers(struct bench *bench, struct error *err)
{
    static const char *const scenes[] = {"panes", "quads"};
    for (int s = 0; s < 2; s++) {
        for (int layers = 1; layers <= (bench->options.is_quick ? 4 : 64); layers *= 4) {
            struct layer_case c = {.scene = scenes[s],
                                   .layers = layers,
                                   .resolution = bench->options.is_quick ? 128 : 512};
            snprintf(c.subject, sizeof c.subject, "%d layer%s %d^2", layers, layers == 1 ? "" : "s",
                     c.resolution);
            if (bench_wants_scene(bench, c.scene) && !run_case(bench, &c, err))
                return error_wrap(err, "%s, %d layers", c.scene, layers);
        }
    }
    return true;
}

/* -- scaling -- */

static void report_growth(struct bench *bench, const char *scene, bool is_lookup,
                          const double numbers[], double values[FORMS][SERIES_MAX], int count)
{
    bool is_quads = !strcmp(scene, "quads");
    for (int i = 0; i < FORMS; i++) {
        char name[64];
        int kept = count;
        while (kept > 0 && !isfinite(values[i][kept - 1])) /* left out */
            kept--;
        snprintf(name, sizeof name, "%s cpu, %s", is_lookup ? "lookup" : "build", forms[i].name);
        bench_series(bench, &(struct series){.scene = scene,
                                             .subject = is_lookup ? "lookup" : "build",
                                             .name = name,
                                             .of = is_quads ? "quads" : "layers",
                                             .unit = is_lookup ? "ns a lookup" : "ms",
                                             .x = numbers,
                                             .y = values[i],
                                             .count = kept,
                                             /* lists are walked in the linked forms */
                                             .growth = i           ? GROWTH_ANY
                                                       : is_lookup ? GROWTH_LOG
                                                                   : GROWTH_SORT});
    }
}

/* 1 to 1000 layers of panes, 4 to 2000 quads. Small maps: lists of a thousand events are long, not
 * many. */
static bool scale_scene(struct bench *bench, const char *scene, struct error *err)
{
    static const int steps[] = {1, 4, 16, 64, 256, 1000};
    bool is_quads = !strcmp(scene, "quads");
    double numbers[SERIES_MAX], build[FORMS][SERIES_MAX], lookup[FORMS][SERIES_MAX];
    int count = bench->options.is_quick ? 3 : 6;
    for (int k = 0; k < count; k++) {
        struct layer_case c = {.scene = scene,
                               .layers = is_quads && steps[k] > 500 ? 500 : steps[k],
                               .resolution = bench->options.is_quick ? 64 : 128,
                               .is_scaling = true};
        numbers[k] = is_quads ? 4 * c.layers : c.layers;
        snprintf(c.subject, sizeof c.subject, "%g %s %d^2", numbers[k], scene, c.resolution);
        if (!run_case(bench, &c, err))
            return error_wrap(err, "%s", c.subject);
        for (int i = 0; i < FORMS; i++) {
            build[i][k] = c.build_ms[i];
            lookup[i][k] = c.lookup_ns[i];
        }
    }
    report_growth(bench, scene, false, numbers, build, count);
    report_growth(bench, scene, true, numbers, lookup, count);
    return true;
}

bool scale_layers(struct bench *bench, struct error *err)
{
    return (!bench_wants_scene(bench, "panes") || scale_scene(bench, "panes", err)) &&
           (!bench_wants_scene(bench, "quads") || scale_scene(bench, "quads", err));
}
