/* SPDX-License-Identifier: MIT */
/* The closed forms A1 to A12 against the default technique and against the ray-traced reference.
 * A7 and A8 (area lights) are in tests/images/test_raytrace_areas.c, A13 (edge counts) in
 * tests/unit/test_scene_edges.c, what the camera sees through media in
 * tests/images/test_media_view.c. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/raytrace/raytrace.h"
#include "tests/support/accuracy_log.h"
#include "tests/support/closed_form_catalog.h"
#include "tests/support/closed_form_internal.h"
#include "tests/support/image_checks.h"
#include "tests/support/render_support.h"
#include "tests/support/raytrace_probe.h"

enum { SIDE_PX = 24, RESOLUTION = 1024, EVEN_RESOLUTION = 128 };

/* A texel's diagonal on the receivers around here: maps cover the 12 m of the scene, or 90 degrees
 * from 4 m. */
#define REACH_M 0.0166
/* Depths of f32, up to 2.5 m away. */
#define TRACED_REACH_M 2e-6

static const double pi = 3.14159265358979323846;

/* Points of the receiver under the pixels of a small view. */
struct probes {
    double points[SIDE_PX * SIDE_PX][3];
    int x[SIDE_PX * SIDE_PX], y[SIDE_PX * SIDE_PX];
    size_t count;
};

static void place_probes(struct closed_form_case *c, struct probes *probes)
{
    c->view.width_px = c->view.height_px = SIDE_PX;
    probes->count = 0;
    for (int i = 0; i < SIDE_PX * SIDE_PX; i++) {
        int x = i % SIDE_PX, y = i / SIDE_PX;
        double *point = probes->points[probes->count];
        if (!view_meet_plane(&c->view, x, y, c->normal, c->offset, point) || fabs(point[0]) > 2.5 ||
            fabs(point[1]) > 2.5 || fabs(point[2]) > 2.5)
            continue;
        probes->x[probes->count] = x;
        probes->y[probes->count++] = y;
    }
    assert_true(probes->count > SIDE_PX * SIDE_PX / 4);
}

/* How much the answer changes within `reach` metres, which is what sampling it in texels may miss,
 * and what the scene itself leaves open. */
static void answer_spread(const struct closed_form_case *c, const double point[3], double reach_m,
                          double t[3], double spread[3])
{
    closed_form_case_answer(c, point, t, spread);
    double most[3] = {0};
    for (int i = 0; i < 16; i++) {
        double beside[3], other[3], doubt[3], angle = 2 * pi * i / 8;
        double r = i < 8 ? reach_m : 0.5 * reach_m;
        memcpy(beside, point, sizeof beside);
        beside[0] += r * cos(angle);
        beside[c->normal[2] > 0 ? 1 : 2] += r * sin(angle);
        closed_form_case_answer(c, beside, other, doubt);
        for (int k = 0; k < 3; k++)
            most[k] = fmax(most[k], fabs(other[k] - t[k]));
    }
    for (int k = 0; k < 3; k++)
        spread[k] += most[k];
}

/* Worst error of T beyond the spread, over all probes, as a multiple of its tolerance. limits:
 * reach of the spread [m], tolerance relative to T, and absolute. */
struct verdict {
    double worst;
    size_t at;
};

static void judge(const struct closed_form_case *c, const struct probes *probes, size_t index,
                  const double limits[3], const double measured[3], struct verdict *v)
{
    double t[3], spread[3];
    answer_spread(c, probes->points[index], limits[0], t, spread);
    for (int k = 0; k < 3; k++) {
        double error = fabs(measured[k] - t[k]) - spread[k];
        double share = error / (limits[2] + t[k] * limits[1]);
        if (!(share <= v->worst)) {
            v->worst = isfinite(share) ? share : INFINITY;
            v->at = index;
        }
    }
}

/* Logs and says the verdict; true when it is good. */
static bool report(const struct closed_form_case *c, const struct probes *probes,
                   const char *technique, const struct verdict *v, double ms)
{
    const double *p = probes->points[v->at];
    accuracy_log(&(struct accuracy_result){
        .suite = "closed_forms",
        .scene = c->name,
        .technique = technique,
        .metric = "worst error of T over its tolerance",
        .error = v->worst,
        .tolerance = 1,
        .ms = ms,
        .is_pass = v->worst <= 1,
    });
    print_message("%-28s %-10s %4zu probes, worst %.3g of the tolerance at (%g, %g, %g)\n", c->name,
                  technique, probes->count, v->worst, p[0], p[1], p[2]);
    return v->worst <= 1;
}

static bool check_traced(const struct closed_form_case *c, const struct probes *probes)
{
    static double t[SIDE_PX * SIDE_PX][3];
    struct imported_scene imported;
    struct scene_state state;
    struct error err = {0};
    struct scene_file file = {.name = "", .bytes = c->scene.glb, .size_bytes = c->scene.size_bytes};
    struct raytrace_probe_desc desc = {.view = &c->view,
                                       .state = &state,
                                       .points = (const double(*)[3])probes->points,
                                       .point_count = probes->count};
    if (!imported_scene_init(&imported, &file, 1, &err) ||
        !scene_state_init(&state, &imported.scene, &c->view, &err) ||
        !raytrace_probe(&desc, t, &err))
        fail_msg("%s: %s", c->name, err.message);
    struct verdict v = {0};
    for (size_t i = 0; i < probes->count; i++) /* vertices are stored in f32: a micrometre */
        judge(c, probes, i, (double[]){2e-6, 1e-5, 2e-6}, t[i], &v);
    scene_state_finish(&state);
    imported_scene_finish(&imported);
    return report(c, probes, "raytraced", &v, 0);
}

static void the_reference_equals_every_closed_form(void **state)
{
    (void)state;
    int failed = 0;
    for (int i = 0; i < closed_form_case_count(); i++) {
        struct closed_form_case c;
        struct probes probes;
        closed_form_case_init(&c, i);
        place_probes(&c, &probes);
        failed += !check_traced(&c, &probes);
        closed_form_case_finish(&c);
    }
    assert_int_equal(failed, 0);
}

struct rasterised {
    const char *name;
    enum shadow_technique shadows;
    double reach_m;
    double stray; /* of A5, which a reach of texels hides */
};

/* The shadow term alone: the picture with shadows over the picture without. */
static bool check_rasterised(struct renderer *renderer, const struct rasterised *technique,
                             struct closed_form_case *c, const struct probes *probes)
{
    struct rig_scene rig;
    rig_scene_open(&rig, renderer, "closed form", c->scene.glb, c->scene.size_bytes);
    c->view.quality =
        (struct view_quality){.samples = 1,
                              .shadow_taps = 1,
                              .shadow_resolution = c->is_even ? EVEN_RESOLUTION : RESOLUTION,
                              .shadows = SHADOWS_NONE};
    struct image open = shoot_color(renderer, &rig, &c->view);
    c->view.quality.shadows = technique->shadows;
    struct frame frame;
    shoot(renderer, &rig, &c->view, &frame);
    const struct image *shadowed = &frame.outputs[VIEW_OUTPUT_COLOR];
    bool is_grazing = !strcmp(c->id, "A2") && c->scene.light.direction[1] > -0.1;
    double relative = is_grazing ? 1e-3 : 1e-5;
    /* llvmpipe decodes sRGB texels by a polynomial: tests/images/test_pane_laws.c */
    double absolute = !strcmp(c->id, "A9") ? 2.5e-3 : 2e-6;
    /* the camera looks through the bodies, whose clear walls send it a trace of the light, too */
    if (!strcmp(c->id, "A5"))
        absolute = fmax(absolute, technique->stray);
    struct verdict v = {0};
    for (size_t i = 0; i < probes->count; i++) {
        const float *p = image_pixel_f32(shadowed, probes->x[i], probes->y[i]);
        const float *q = image_pixel_f32(&open, probes->x[i], probes->y[i]);
        double t[3];
        assert_true(q[0] > 0 && q[1] > 0 && q[2] > 0);
        for (int k = 0; k < 3; k++)
            t[k] = (double)p[k] / (double)q[k];
        judge(c, probes, i, (double[]){technique->reach_m, relative, absolute}, t, &v);
    }
    double ms = frame.report.total_ms;
    frame_finish(&frame);
    image_finish(&open);
    rig_scene_finish(&rig, renderer);
    return report(c, probes, technique->name, &v, ms);
}

static void check_every_case(struct renderer *renderer, const struct rasterised *technique)
{
    int failed = 0;
    for (int i = 0; i < closed_form_case_count(); i++) {
        struct closed_form_case c;
        struct probes probes;
        closed_form_case_init(&c, i);
        place_probes(&c, &probes);
        failed += !check_rasterised(renderer, technique, &c, &probes);
        closed_form_case_finish(&c);
    }
    assert_int_equal(failed, 0);
}

static void the_default_technique_equals_every_closed_form(void **state)
{
    check_every_case(*state, &(struct rasterised){"deep", SHADOWS_DEEP, REACH_M, 0});
}

static void traced_shadows_equal_every_closed_form(void **state)
{
    check_every_case(*state, &(struct rasterised){"raytraced-shadows", SHADOWS_RAYTRACED_SHADOWS,
                                                  TRACED_REACH_M, 4e-5});
}

/* A3 once more: the logarithm of T against the way from the edge is a straight line, whose slope
 * texels do not change. */
static void the_shadow_of_a_wedge_has_the_slope_of_the_wedge(void **state)
{
    struct closed_form_case c = {0};
    struct rig_scene rig;
    for (int i = 0; strcmp(c.id ? c.id : "", "A3") != 0; i++) {
        closed_form_case_finish(&c);
        closed_form_case_init(&c, i);
    }
    rig_scene_open(&rig, *state, "wedge", c.scene.glb, c.scene.size_bytes);
    c.view.width_px = c.view.height_px = 4 * SIDE_PX;
    c.view.quality = (struct view_quality){.samples = 1, .shadows = SHADOWS_NONE};
    struct image open = shoot_color(*state, &rig, &c.view);
    c.view.quality.shadows = SHADOWS_DEEP;
    struct image dark = shoot_color(*state, &rig, &c.view);
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (int i = 0; i < 16 * SIDE_PX * SIDE_PX; i++) {
        int x = i % (4 * SIDE_PX), y = i / (4 * SIDE_PX);
        double p[3];
        if (!view_meet_plane(&c.view, x, y, c.normal, 0, p) || fabs(p[0]) > 0.8 || fabs(p[2]) > 0.8)
            continue;
        double tau =
            -log((double)*image_pixel_f32(&dark, x, y) / (double)*image_pixel_f32(&open, x, y));
        n++, sx += p[0], sy += tau, sxx += p[0] * p[0], sxy += p[0] * tau;
    }
    double slope = (n * sxy - sx * sy) / (n * sxx - sx * sx), expected = log(2) / 0.25 * 0.25;
    double error = fabs(slope / expected - 1);
    accuracy_log(&(struct accuracy_result){.suite = "closed_forms",
                                           .scene = "A3 wedge",
                                           .technique = "deep",
                                           .metric = "relative error of the slope of log T",
                                           .error = error,
                                           .tolerance = 1e-3,
                                           .is_pass = error <= 1e-3});
    assert_true(error <= 1e-3);
    image_finish(&open);
    image_finish(&dark);
    rig_scene_finish(&rig, *state);
    closed_form_case_finish(&c);
}

/* -- A12 -- */

/* KHR_lights_punctual, as docs/explanation/shading.md section 4: E on the floor y = 0 at p. */
static double illuminance(const struct view_light *light, const double p[3])
{
    if (light->type == SCENE_LIGHT_DIRECTIONAL) {
        double length = sqrt(light->direction[0] * light->direction[0] +
                             light->direction[1] * light->direction[1]);
        return (double)light->intensity * -light->direction[1] / length;
    }
    double l[3], d2 = 0;
    for (int k = 0; k < 3; k++) {
        l[k] = light->position[k] - p[k];
        d2 += l[k] * l[k];
    }
    double d = sqrt(d2), range = (double)light->range, window = 1, cone = 1;
    if (range > 0)
        window = fmax(0, fmin(1, 1 - pow(d / range, 4)));
    if (light->type == SCENE_LIGHT_SPOT) {
        double outer = cos((double)light->outer_cone_deg * pi / 180);
        double inner = cos((double)light->inner_cone_deg * pi / 180);
        cone = fmax(0, fmin(1, (l[1] / d - outer) / (inner - outer)));
    }
    return (double)light->intensity / d2 * window * cone * cone * l[1] / d;
}

static void lights_fall_off_as_their_formula_says(void **state)
{
    static const struct view_light lights[] = {
        {.type = SCENE_LIGHT_POINT,
         .position = {0.2, 1.5, 0.1},
         .color = {1, 1, 1},
         .intensity = 7},
        {.type = SCENE_LIGHT_POINT,
         .position = {0.2, 1.5, 0.1},
         .color = {1, 1, 1},
         .intensity = 7,
         .range = 2},
        {.type = SCENE_LIGHT_SPOT,
         .position = {0.1, 2, 0.2},
         .direction = {0, -1, 0},
         .color = {1, 1, 1},
         .intensity = 50,
         .inner_cone_deg = 10,
         .outer_cone_deg = 40},
        {.type = SCENE_LIGHT_DIRECTIONAL,
         .direction = {0.6, -0.8, 0},
         .color = {1, 1, 1},
         .intensity = 3},
    };
    static const char *const names[] = {"A12 point", "A12 point with range", "A12 spot",
                                        "A12 directional"};
    struct closed_form_scene scene;
    struct rig_scene rig;
    media_scene_build(&(struct media_scene_desc){.has_floor = true}, &scene);
    rig_scene_open(&rig, *state, "floor", scene.glb, scene.size_bytes);
    for (int i = 0; i < 8; i++) {
        const struct view_light *light = &lights[i / 2];
        bool is_traced = i % 2;
        struct view view = {.width_px = 64,
                            .height_px = 64,
                            .lights = light,
                            .light_count = 1,
                            .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 3, 1}},
                            .quality = {.samples = 1,
                                        .reference = is_traced,
                                        .shadows = is_traced ? SHADOWS_RAYTRACED : SHADOWS_DEEP}};
        struct image color = shoot_color(*state, &rig, &view);
        double worst = 0, brightest = 0, tolerance = is_traced ? 1e-6 : 1e-5;
        /* the rasteriser keeps colours in 16 bits between its passes */
        double albedo = is_traced ? scene.albedo : round(scene.albedo * 65535) / 65535;
        for (int p = 0; p < 64 * 64; p++) {
            double at[3];
            assert_true(view_meet_plane(&view, p % 64, p / 64, (double[]){0, 1, 0}, 0, at));
            double e = illuminance(light, at) * albedo / pi;
            double got = (double)*image_pixel_f32(&color, p % 64, p / 64);
            worst = fmax(worst, fabs(got - e));
            brightest = fmax(brightest, e);
        }
        worst /= brightest;
        print_message("%s, %s: worst error %.3g\n", names[i / 2], is_traced ? "raytraced" : "deep",
                      worst);
        accuracy_log(&(struct accuracy_result){.suite = "closed_forms",
                                               .scene = names[i / 2],
                                               .technique = is_traced ? "raytraced" : "deep",
                                               .metric = "error of radiance over the brightest",
                                               .error = worst,
                                               .tolerance = tolerance,
                                               .is_pass = worst <= tolerance});
        assert_true(worst <= tolerance);
        image_finish(&color);
    }
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_reference_equals_every_closed_form),
        cmocka_unit_test(the_default_technique_equals_every_closed_form),
        cmocka_unit_test(traced_shadows_equal_every_closed_form),
        cmocka_unit_test(the_shadow_of_a_wedge_has_the_slope_of_the_wedge),
        cmocka_unit_test(lights_fall_off_as_their_formula_says),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
