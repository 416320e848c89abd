/* SPDX-License-Identifier: MIT */
/* JSON of recorded times, and ten frames of each. */
#include "tests/support/auto_replay.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "renderer/cost/technique_forecast.h"

/* The candidates of `auto`; NULL: no times of the technique were recorded. */
static const char *const technique_names[SHADOWS_COUNT] = {
    [SHADOWS_RASTER_DEFAULT] = "maps",
    [SHADOWS_RAYTRACED] = "rays",
    [SHADOWS_RAYTRACED_SHADOWS] = "traced_shadows",
};

static const struct {
    const char *name;
    size_t offset;
} counts[] = {
    {"pixels", offsetof(struct workload, pixels)},
    {"covered", offsetof(struct workload, covered)},
    {"layers", offsetof(struct workload, layers)},
    {"lit", offsetof(struct workload, lit)},
    {"listed", offsetof(struct workload, listed)},
    {"textures", offsetof(struct workload, textures)},
    {"triangles", offsetof(struct workload, triangles)},
    {"triangles_in_view", offsetof(struct workload, triangles_in_view)},
    {"map_faces", offsetof(struct workload, map_faces)},
    {"deep_faces", offsetof(struct workload, deep_faces)},
    {"map_triangles", offsetof(struct workload, map_triangles)},
    {"deep_triangles", offsetof(struct workload, deep_triangles)},
    {"deep_share", offsetof(struct workload, deep_share)},
};
enum { COUNTS = sizeof counts / sizeof counts[0] };

json_t *replay_speed_to_json(const struct device_speed *speed)
{
    return json_pack("{s:f,s:f,s:f,s:f,s:f}", "frame_ms", speed->frame_ms, "shade", speed->shade,
                     "maps", speed->maps, "trace", speed->trace, "build", speed->build);
}

json_t *replay_case_to_json(const struct replay_case *one)
{
    json_t *workload = json_object(), *json = json_object();
    for (int i = 0; i < COUNTS; i++) {
        double value;
        memcpy(&value, (const char *)&one->workload + counts[i].offset, sizeof value);
        json_object_set_new(workload, counts[i].name, json_real(value));
    }
    json_object_set_new(workload, "shadowed_lights",
                        json_integer((json_int_t)one->workload.shadowed_lights));
    json_object_set_new(json, "name", json_string(one->name));
    json_object_set_new(json, "samples", json_integer(one->samples));
    json_object_set_new(json, "maps_stay", json_boolean(one->maps_stay));
    json_object_set_new(json, "workload", workload);
    for (int i = 0; i < SHADOWS_COUNT; i++) {
        json_t *ms = technique_names[i] ? json_array() : NULL;
        for (int k = 0; ms && k < REPLAY_FRAMES; k++)
            json_array_append_new(ms, json_real(one->ms[i][k]));
        if (ms)
            json_object_set_new(json, technique_names[i], ms);
    }
    return json;
}

static bool read_case(struct replay_case *one, const json_t *json)
{
    const json_t *workload = json_object_get(json, "workload");
    const char *name = json_string_value(json_object_get(json, "name"));
    snprintf(one->name, sizeof one->name, "%s", name ? name : "");
    one->samples = (int)json_integer_value(json_object_get(json, "samples"));
    one->maps_stay = json_is_true(json_object_get(json, "maps_stay"));
    for (int i = 0; i < COUNTS; i++) {
        double value = json_number_value(json_object_get(workload, counts[i].name));
        memcpy((char *)&one->workload + counts[i].offset, &value, sizeof value);
    }
    one->workload.shadowed_lights =
        (size_t)json_integer_value(json_object_get(workload, "shadowed_lights"));
    bool is_good = one->samples > 0 && one->workload.pixels > 0;
    for (int i = 0; i < SHADOWS_COUNT; i++)
        for (size_t k = 0; technique_names[i] && k < REPLAY_FRAMES; k++) {
            const json_t *times = json_object_get(json, technique_names[i]);
            one->ms[i][k] = json_number_value(json_array_get(times, k));
            is_good = is_good && one->ms[i][k] > 0;
        }
    return is_good;
}

bool replay_from_json(struct replay *replay, const json_t *json, struct error *err)
{
    const json_t *speed = json_object_get(json, "speed"), *one;
    size_t i;
    *replay =
        (struct replay){.speed = {.frame_ms = json_number_value(json_object_get(speed, "frame_ms")),
                                  .shade = json_number_value(json_object_get(speed, "shade")),
                                  .maps = json_number_value(json_object_get(speed, "maps")),
                                  .trace = json_number_value(json_object_get(speed, "trace")),
                                  .build = json_number_value(json_object_get(speed, "build"))}};
    if (!device_speed_is_known(&replay->speed))
        return error_set(err, ERROR_INVALID_REQUEST, "recorded times without the device's speed");
    json_array_foreach(json_object_get(json, "cases"), i, one)
    {
        if (i >= REPLAY_CASES_MAX || !read_case(&replay->cases[i], one))
            return error_set(err, ERROR_INVALID_REQUEST, "recorded case %zu", i);
        replay->count++;
    }
    return true;
}

/* ---- running ---- */

static double median(const double ms[REPLAY_FRAMES])
{
    double sorted[REPLAY_FRAMES];
    for (int i = 0; i < REPLAY_FRAMES; i++) {
        int at = i;
        for (; at > 0 && sorted[at - 1] > ms[i]; at--)
            sorted[at] = sorted[at - 1];
        sorted[at] = ms[i];
    }
    return (sorted[(REPLAY_FRAMES - 1) / 2] + sorted[REPLAY_FRAMES / 2]) / 2;
}

static double times_the_best(const struct replay_case *one, enum shadow_technique technique)
{
    double best = INFINITY;
    for (int i = 0; i < SHADOWS_COUNT; i++)
        best = technique_names[i] ? fmin(best, median(one->ms[i])) : best;
    return median(one->ms[technique]) / best;
}

static void make_frames(const struct replay *replay, const struct replay_case *one,
                        struct learning_case frames[SHADOWS_COUNT])
{
    struct forecast_setting setting = {
        .samples = one->samples, .shadow_resolution = 1024, .shadow_taps = 4, .has_shadows = true};
    uint64_t view = 0xcbf29ce484222325u; /* FNV-1a of the name */
    for (const char *c = one->name; *c; c++)
        view = (view ^ (uint8_t)*c) * 0x100000001b3u;
    for (int i = 0; i < SHADOWS_COUNT; i++) {
        frames[i] = (struct learning_case){.technique = (enum shadow_technique)i, .view = view};
        setting.is_warm = i != SHADOWS_RASTER_DEFAULT || one->maps_stay;
        if (!technique_names[i]) { /* no times of it: never the fastest */
            frames[i].terms[FORECAST_TERM_FRAME] = 1e9;
            continue;
        }
        technique_forecast_terms(frames[i].technique,
                                 &(struct forecast_frame){&one->workload, &setting, &replay->speed},
                                 frames[i].terms);
    }
}

/* As renderer/frame/runner_up.c between two pictures. */
static void time_runner_up(const struct replay_case *one,
                           const struct learning_case frames[SHADOWS_COUNT], double slower,
                           bool was_timed[SHADOWS_COUNT], struct learning *learned)
{
    const struct auto_pick pick = auto_pick(frames, learned);
    if (!pick.has_runner_up || was_timed[pick.runner_up])
        return;
    was_timed[pick.runner_up] = true;
    for (int i = 0; i < REPLAY_TIMED; i++)
        learning_teach(learned, &frames[pick.runner_up], slower * one->ms[pick.runner_up][i]);
}

struct replay_result replay_run(const struct replay *replay, const struct replay_case *one,
                                struct learning *learned, const struct replay_trouble *trouble)
{
    struct learning_case frames[SHADOWS_COUNT];
    struct replay_result result = {.first = 0};
    int drawn[SHADOWS_COUNT] = {0};
    bool was_timed[SHADOWS_COUNT] = {false};
    double slower = trouble && trouble->slower > 0 ? trouble->slower : 1;
    make_frames(replay, one, frames);
    for (int frame = 0; frame <= REPLAY_LATER; frame++) {
        struct auto_pick pick = auto_pick(frames, learned);
        double ms = slower * one->ms[pick.technique][drawn[pick.technique]++ % REPLAY_FRAMES];
        if (frame == 0) {
            result.first = times_the_best(one, pick.technique);
            result.first_technique = pick.technique;
        }
        result.later = times_the_best(one, pick.technique);
        result.later_technique = pick.technique;
        double told = pick.answers[pick.technique].ms / (slower * median(one->ms[pick.technique]));
        result.later_off = exp(fabs(log(told)));
        if (trouble && trouble->outlier_at == frame + 1)
            ms *= 10;
        learning_teach(learned, &frames[pick.technique], ms);
        learning_show(learned, &frames[pick.technique]);
        if (!(trouble && trouble->is_busy))
            time_runner_up(one, frames, slower, was_timed, learned);
    }
    return result;
}
