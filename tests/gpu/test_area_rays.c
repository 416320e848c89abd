/* SPDX-License-Identifier: MIT */
/* Masks of `area` are those of rays: for each point and each sample of a light the grid on the
 * device and the ray tracer's own shadow term have the same, bit for bit where casters are opaque,
 * wherever the way between them keeps clear of outlines. */
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_light.h"
#include "renderer/raytrace/rt_scene.h"
#include "shaders/shared/layout.h"
#include "tests/support/area_stage.h"

#include "shaders/shared/records.h"

enum { SAMPLES = 64, POINTS = 1000, PANES = 60 };

/* What the way keeps from every outline, and its ends from every surface. Rays of the device may
 * begin 1e-5 m aside of a point, and f32 misplaces a corner by 5e-7 m here. */
static const double CLEAR_M = 5e-5;

static struct shadow_rig rig;

struct edge {
    double a[3], b[3];
};

struct outlines { /* edges that belong to one triangle alone */
    struct edge *edges;
    size_t count;
};

static bool is_same(const double a[3], const double b[3])
{
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

static size_t count_edges(const struct area_stage *stage, const double a[3], const double b[3])
{
    size_t count = 0;
    for (uint32_t i = 0; i < stage->triangle_count; i++)
        for (int k = 0; k < 3; k++) {
            const double *p = stage->triangles[i].at[k], *q = stage->triangles[i].at[(k + 1) % 3];
            count += (is_same(a, p) && is_same(b, q)) || (is_same(a, q) && is_same(b, p));
        }
    return count;
}

static void find_outlines(const struct area_stage *stage, struct outlines *outlines)
{
    *outlines = (struct outlines){
        .edges = calloc(3 * (size_t)stage->triangle_count + 1, sizeof *outlines->edges)};
    assert_non_null(outlines->edges);
    for (uint32_t i = 0; i < stage->triangle_count; i++)
        for (int k = 0; k < 3; k++) {
            const double *a = stage->triangles[i].at[k], *b = stage->triangles[i].at[(k + 1) % 3];
            if (count_edges(stage, a, b) != 1)
                continue;
            struct edge *edge = &outlines->edges[outlines->count++];
            memcpy(edge->a, a, sizeof edge->a);
            memcpy(edge->b, b, sizeof edge->b);
        }
}

/* Between two segments: of the nearest places of their lines, each moved into its segment in turn
 * (Ericson 2005, "Real-Time Collision Detection", 5.1.9). */
static double distance_between(const double p[3], const double q[3], const struct edge *edge)
{
    double u[3], v[3], r[3], apart[3];
    vec3_sub(q, p, u);
    vec3_sub(edge->b, edge->a, v);
    vec3_sub(p, edge->a, r);
    double uu = vec3_dot(u, u), vv = vec3_dot(v, v), uv = vec3_dot(u, v);
    double ur = vec3_dot(u, r), vr = vec3_dot(v, r), det = uu * vv - uv * uv;
    double s = det > 0 ? fmin(fmax((uv * vr - ur * vv) / det, 0), 1) : 0;
    double t = fmin(fmax((uv * s + vr) / vv, 0), 1);
    s = fmin(fmax((uv * t - ur) / uu, 0), 1);
    for (int k = 0; k < 3; k++)
        apart[k] = r[k] + s * u[k] - t * v[k];
    return vec3_length(apart);
}

/* From the plane of the nearest triangle, over the triangle or not. */
static double distance_from_planes(const struct area_stage *stage, const double point[3])
{
    double least = INFINITY;
    for (uint32_t i = 0; i < stage->triangle_count; i++) {
        double u[3], v[3], n[3], to[3];
        vec3_sub(stage->triangles[i].at[1], stage->triangles[i].at[0], u);
        vec3_sub(stage->triangles[i].at[2], stage->triangles[i].at[0], v);
        vec3_sub(point, stage->triangles[i].at[0], to);
        vec3_cross(u, v, n);
        least = fmin(least, fabs(vec3_dot(n, to)) / vec3_length(n));
    }
    return least;
}

/* ---- both ---- */

struct rays {
    struct rt_scene scene;
    struct rt_lighting lighting;
};

static void rays_init(struct rays *rays, const struct scene_state *state, const struct view *view)
{
    struct error err = {0};
    *rays = (struct rays){.lighting = {0}};
    if (!rt_scene_init(&rays->scene, state, view, &err) ||
        !rt_lighting_init(&rays->lighting, &rays->scene, view, &err))
        fail_msg("%s", err.message);
}

static void rays_finish(struct rays *rays)
{
    assert_false(rays->lighting.has_overflowed);
    rt_lighting_finish(&rays->lighting);
    rt_scene_finish(&rays->scene);
}

/* `at`: on the light, or for parallel light on the way to it. */
static void trace(struct rays *rays, const struct area_stage *stage, const double from[3],
                  const double at[3], double passed[3])
{
    double point[3];
    struct rt_arrival arrival = {.gain = 1};
    vec3_sub(at, from, arrival.direction);
    arrival.distance_m = vec3_length(arrival.direction);
    vec3_normalize(arrival.direction);
    if (stage->light.type == SCENE_LIGHT_DIRECTIONAL)
        arrival.distance_m = INFINITY;
    vec3_sub(from, rays->scene.origin, point);
    rt_transmittance(&rays->lighting, &arrival, point, NULL, passed);
}

struct tally {
    uint64_t open, filtered, blocked, near; /* of ways; `near` ones are not judged */
    double farthest_m;                      /* of a way that differs, from its outline */
};

/* Each surface rounds the logarithm of its filter once, and the result is rounded as it is packed:
 * 3.3e-7 of 60 surfaces, and 2^-19 of the largest channel. */
static bool is_equal(const uint32_t words[2], const double passed[3])
{
    double largest = fmax(passed[0], fmax(passed[1], passed[2]));
    for (int k = 0; k < 3; k++) {
        double is = area_answer_channel(words, k);
        bool is_exact = passed[k] == 0 || passed[k] == 1;
        if (fabs(is - passed[k]) > (is_exact ? 0 : 3.3e-7 * PANES * passed[k] + 0x1p-19 * largest))
            return false;
    }
    return true;
}

static void compare_way(struct rays *rays, const struct area_stage *stage,
                        const struct outlines *outlines, const uint32_t words[2], uint32_t point,
                        uint32_t sample, struct tally *tally)
{
    double at[3], passed[3], clear = INFINITY;
    const double *from = stage->points[point];
    area_stage_sample(stage, point, sample, at);
    area_stage_aim(stage, from, at);
    trace(rays, stage, from, at, passed);
    for (size_t i = 0; i < outlines->count; i++)
        clear = fmin(clear, distance_between(from, at, &outlines->edges[i]));
    bool is_good = is_equal(words, passed);
    if (!is_good)
        tally->farthest_m = fmax(tally->farthest_m, clear);
    if (clear < CLEAR_M) {
        tally->near++;
        return;
    }
    if (!is_good)
        fail_msg("point %u, sample %u, %.3g m from outlines: (%.9g, %.9g, %.9g), not (%.9g, %.9g, "
                 "%.9g)",
                 point, sample, clear, area_answer_channel(words, 0), area_answer_channel(words, 1),
                 area_answer_channel(words, 2), passed[0], passed[1], passed[2]);
    double largest = fmax(passed[0], fmax(passed[1], passed[2]));
    tally->open += largest == 1 && passed[0] + passed[1] + passed[2] == 3;
    tally->blocked += largest == 0;
    tally->filtered += largest > 0 && passed[0] + passed[1] + passed[2] < 3;
}

static struct tally compare(struct area_stage *stage, const struct view *view)
{
    struct rays rays;
    struct outlines outlines;
    struct tally tally = {0};
    struct area_answer answer = area_stage_must_ask(&rig, stage);
    find_outlines(stage, &outlines);
    rays_init(&rays, stage->state, view);
    for (uint32_t p = 0; p < stage->point_count; p++) {
        if (!area_stage_is_before_light(stage, stage->points[p]) ||
            distance_from_planes(stage, stage->points[p]) < CLEAR_M)
            continue;
        for (uint32_t s = 0; s < stage->samples; s++)
            compare_way(&rays, stage, &outlines, answer.filters[p * stage->samples + s], p, s,
                        &tally);
    }
    rays_finish(&rays);
    free(outlines.edges);
    area_answer_finish(&answer);
    return tally;
}

/* ---- scenes ---- */

static const struct view_light lamps[] = {
    {.type = SCENE_LIGHT_RECT, .position = {0.3, 9, -0.2}, .width_m = 1.6, .height_m = 0.9},
    {.type = SCENE_LIGHT_DISK, .position = {-0.4, 8.5, 0.5}, .radius_m = 0.8},
    {.type = SCENE_LIGHT_POINT, .position = {0.2, 9, 0.1}},
    {.type = SCENE_LIGHT_DIRECTIONAL},
    {.type = SCENE_LIGHT_RECT, .position = {0, 4.1, 0}, .width_m = 1, .height_m = 1}, /* within */
};

static struct tally compare_panes(const struct pane_scene *panes, const struct view_light *lamp,
                                  uint64_t seed)
{
    struct error err = {0};
    struct scene_state state;
    struct view_light light = *lamp;
    light.direction[0] = 0.15;
    light.direction[1] = -1;
    light.direction[2] = -0.1;
    light.up[2] = 1;
    light.intensity = 1;
    light.color[0] = light.color[1] = light.color[2] = 1;
    const struct view view = {.lights = &light, .light_count = 1, .ignore_scene_lights = true};
    if (!scene_state_init(&state, &panes->scene, &view, &err))
        fail_msg("%s", err.message);
    bool is_area = state_light_is_area(&state.lights[0]);
    struct area_stage stage = {
        .light = state.lights[0], .samples = is_area ? SAMPLES : 1, .state = &state};
    area_stage_scatter(&stage, is_area ? POINTS : 10 * POINTS, 3, seed);
    for (uint32_t i = 0; i < stage.point_count; i++)
        stage.points[i][1] = 2.5 + stage.points[i][1]; /* from below all to among them */
    struct tally tally = compare(&stage, &view);
    print_message("light %d: %llu ways open, %llu filtered, %llu blocked, %llu near outlines; "
                  "differences at most %.2g m from one\n",
                  (int)light.type, (unsigned long long)tally.open,
                  (unsigned long long)tally.filtered, (unsigned long long)tally.blocked,
                  (unsigned long long)tally.near, tally.farthest_m);
    area_stage_finish(&stage);
    scene_state_finish(&state);
    return tally;
}

/* All ways but few are judged. */
static void expect_most(const struct tally *tally, bool has_filters)
{
    uint64_t judged = tally->open + tally->filtered + tally->blocked;
    assert_true(judged > 2000 && tally->near * 50 < judged);
    assert_true(tally->open > judged / 50 && tally->blocked > judged / 50);
    assert_true(has_filters ? tally->filtered > judged / 20 : tally->filtered == 0);
}

/* Of a metre at most, so that light finds ways between them. */
static void check_panes(const struct view_light *lamp, int count, bool are_opaque, uint64_t seed)
{
    struct pane_scene panes = {.count = 0};
    pane_scene_add_random(&panes, count, seed);
    for (uint32_t i = 0; i < panes.count; i++) {
        struct pane pane = panes.panes[i];
        pane.is_opaque |= are_opaque;
        for (int k = 0; k < 3; k++) {
            pane.u[k] *= 0.3;
            pane.v[k] *= 0.3;
        }
        pane_scene_set(&panes, i, &pane);
    }
    const struct tally tally = compare_panes(&panes, lamp, seed + 100);
    expect_most(&tally, !are_opaque);
    pane_scene_finish(&panes);
}

static void opaque_casters_hide_what_they_hide_from_rays(void **unused)
{
    (void)unused;
    for (size_t i = 0; i < sizeof lamps / sizeof *lamps; i++)
        check_panes(&lamps[i], PANES, true, 3 + i);
}

static void coloured_casters_filter_what_rays_find(void **unused)
{
    (void)unused;
    for (size_t i = 0; i < sizeof lamps / sizeof *lamps; i++)
        check_panes(&lamps[i], PANES, false, 30 + i);
}

int main(void)
{
    if (!shadow_rig_open(&rig, 0, 0))
        return 77;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(opaque_casters_hide_what_they_hide_from_rays),
        cmocka_unit_test(coloured_casters_filter_what_rays_find),
    };
    int failures = cmocka_run_group_tests(tests, NULL, NULL);
    shadow_rig_close(&rig);
    return failures;
}
