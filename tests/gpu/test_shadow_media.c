/* SPDX-License-Identifier: MIT */
/* Homogeneous media in deep shadow maps: slabs, balls, overlaps, lights and receivers inside,
 * against closed forms (Beer-Lambert) and against the model in f64. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/base/matrix.h"
#include "tests/support/shadow_rig.h"

static struct shadow_rig rig;
static const double no_eye[3] = {0, 0, 0}, up[3] = {0, 1, 0};
static const struct view_light sun = {
    .type = SCENE_LIGHT_DIRECTIONAL, .direction = {0, -1, 0}, .color = {1, 1, 1}, .intensity = 1};
static const struct view_light lamp = {
    .type = SCENE_LIGHT_POINT, .position = {0, 4, 0}, .color = {1, 1, 1}, .intensity = 1};

static void prepare(const struct pane_scene *panes, const struct view_light *light, int taps)
{
    struct error err = {0};
    const struct view_quality quality = {.shadow_resolution = 128, .shadow_taps = taps};
    shadow_system_forget(rig.shadows, "panes");
    if (!shadow_rig_prepare(&rig, panes, light, 1, no_eye, &quality, &err))
        fail_msg("%s", err.message);
}

static void query(const double point[3], const double normal[3], float t[4])
{
    double points[1][3] = {{point[0], point[1], point[2]}};
    float out[1][4];
    shadow_rig_query(&rig, 0, (const double(*)[3])points, normal, 1, UINT32_MAX, out);
    memcpy(t, out[0], sizeof out[0]);
}

/* Clear interfaces. */
static struct pane box(double x, double y, double z, double half_x, double half_y, double half_z,
                       float r, float g, float b)
{
    return (struct pane){.shape = PANE_BOX,
                         .center = {x, y, z},
                         .u = {half_x, 0, 0},
                         .v = {0, half_y, 0},
                         .w = {0, 0, half_z},
                         .color = {1, 1, 1},
                         .sigma = {r, g, b}};
}

/* Light through so many metres of the pane's medium, in red. */
static double through(uint32_t index, double metres)
{
    return exp(-rig.state.materials[index].sigma[0] * metres);
}

static void expect(const char *what, const double point[3], double red)
{
    float t[4];
    query(point, up, t);
    if (fabs((double)t[0] - red) > 1e-5 * fmax(red, 0.1))
        fail_msg("%s at %g %g %g: %.8f instead of %.8f", what, point[0], point[1], point[2],
                 (double)t[0], red);
}

/* A2: exp(-sigma d / cos a), and inside after the way so far. */
static void slab_takes_beer_lambert_along_the_ray(void **state)
{
    (void)state;
    for (int degrees = 0; degrees <= 75; degrees += 15) {
        double a = degrees / 57.29577951308232;
        struct view_light light = sun;
        light.direction[0] = sin(a);
        light.direction[1] = -cos(a);
        struct pane_scene panes = {0};
        struct pane slab = box(0, 1, 0, 40, 0.25, 40, 1.3f, 0.4f, 0.1f);
        pane_scene_add(&panes, &slab);
        struct pane floor = {.center = {0, -1, 0}, .u = {40, 0, 0}, .v = {0, 0, -40}};
        floor.is_opaque = true;
        pane_scene_add(&panes, &floor);
        prepare(&panes, &light, 1);
        expect("below", (double[]){0.3, -1, 0.2}, through(0, 0.5 / cos(a)));
        expect("inside", (double[]){0.3, 1.1, 0.2}, through(0, 0.15 / cos(a)));
        expect("at its bottom", (double[]){0.3, 0.75, 0.2}, through(0, 0.5 / cos(a)));
        expect("at its top", (double[]){0.3, 1.25, 0.2}, 1);
        expect("above", (double[]){0.3, 2, 0.2}, 1);
        pane_scene_finish(&panes);
    }
}

/* A4: exp(-2 sigma sqrt(R^2 - b^2)), but for facets that stay 8e-6 of the radius inside. */
static void ball_takes_the_chord(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    struct pane ball = box(0, 1, 0, 0.5, 0.5, 0.5, 0.2f, 0.4f, 0.1f);
    ball.shape = PANE_BALL;
    pane_scene_add(&panes, &ball);
    struct error err = {0};
    const struct view_quality quality = {.shadow_resolution = 500, .shadow_taps = 1};
    if (!shadow_rig_prepare(&rig, &panes, &sun, 1, no_eye, &quality, &err))
        fail_msg("%s", err.message);
    double worst = 0;
    for (int i = -40; i <= 40; i++) {
        double point[3] = {0.01 * i, 0, 0.1}, expected[3];
        float t[4];
        query(point, up, t);
        if (!shadow_rig_model(&rig, 0, point, up, expected))
            continue;
        worst = fmax(worst, fabs((double)t[0] - expected[0]));
        double b2 = point[0] * point[0] + point[2] * point[2];
        assert_true(fabs(expected[0] - exp(-0.4 * sqrt(0.25 - b2))) < 1e-3); /* half a texel off */
    }
    print_message("ball: largest error %.2g\n", worst);
    assert_true(worst < 1e-5);
    pane_scene_finish(&panes);
}

/* A5: extinctions add where media overlap, nest and touch. */
static void overlapping_nested_and_touching_media_add_up(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    const struct pane boxes[] = {
        box(0, 2, 0, 2, 0.5, 2, 0.7f, 0, 0),      /* 1.5 to 2.5 */
        box(0, 1.5, 0, 2, 0.25, 2, 0.9f, 0, 0),   /* 1.25 to 1.75: overlaps */
        box(0, 2.25, 0, 1, 0.125, 1, 1.1f, 0, 0), /* 2.125 to 2.375: nested */
        box(0, 1, 0, 2, 0.25, 2, 0.3f, 0, 0),     /* 0.75 to 1.25: touches the second */
        box(0, 1, 0, 2, 0.25, 2, 0.2f, 0, 0),     /* the same place twice */
    };
    for (int i = 0; i < 5; i++)
        pane_scene_add(&panes, &boxes[i]);
    for (int scan = 0; scan < 2; scan++) {
        rig.shadows = rig.systems[scan];
        prepare(&panes, &sun, 4);
        double all =
            through(0, 1) * through(1, 0.5) * through(2, 0.25) * through(3, 0.5) * through(4, 0.5);
        expect("below all", (double[]){0.1, 0, 0.1}, all);
        expect("in the third", (double[]){0.1, 2.25, 0.1}, through(0, 0.25) * through(2, 0.125));
        expect("in two", (double[]){0.1, 1.6, 0.1},
               through(0, 0.9) * through(2, 0.25) * through(1, 0.15));
        expect("where two touch", (double[]){0.1, 1.25, 0.1},
               through(0, 1) * through(1, 0.5) * through(2, 0.25));
        expect("beside the nested one", (double[]){1.5, 0, 0.1},
               through(0, 1) * through(1, 0.5) * through(3, 0.5) * through(4, 0.5));
        expect("beside all", (double[]){3, 0, 0.1}, 1);
    }
    rig.shadows = rig.systems[0];
    pane_scene_finish(&panes);
}

/* The lamp inside of two media, an opaque pane before they end, and a mirrored one below. */
static void light_may_stand_inside_media(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    struct pane sea = box(0, 3, 0, 9, 3, 9, 0.2f, 0.3f, 0.1f);
    struct pane cloud = box(0, 4, 0, 1, 1, 1, 0.5f, 0.2f, 0.1f);
    struct pane mirrored = box(0, 1.5, 0, -1, 0.5, 1, 0.4f, 0.2f, 0.1f);
    pane_scene_add(&panes, &sea);
    pane_scene_add(&panes, &cloud);
    pane_scene_add(&panes, &mirrored);
    struct pane table = {.center = {3, 2, 0}, .u = {0.5, 0, 0}, .v = {0, 0, -0.5}};
    table.is_opaque = true;
    pane_scene_add(&panes, &table);
    prepare(&panes, &lamp, 1);
    /* Of a texel's ray. */
    const double tangent = 1.0 / 128, slant = sqrt(1 + 2 * tangent * tangent);
    static const struct {
        double metres, sea, cloud, mirrored;
    } depths[] = {
        {0.5, 0.5, 0.5, 0}, {1.5, 1.5, 1, 0}, {2.5, 2.5, 1, 0.5}, {3.5, 3.5, 1, 1}, {5, 4, 1, 1}};
    for (int i = 0; i < 5; i++) {
        double z = depths[i].metres;
        expect("below the lamp", (double[]){z * tangent, 4 - z, z * tangent},
               through(0, depths[i].sea * slant) * through(1, depths[i].cloud * slant) *
                   through(2, depths[i].mirrored * slant));
    }
    expect("behind the table", (double[]){4.4, 1, 0}, 0);
    float t[4];
    query((double[]){2.95, 2, 0.05}, up, t); /* on it: its list holds the cloud's end only */
    double metres = sqrt(2.95 * 2.95 + 4 + 0.0025);
    double expected = through(0, metres) * through(1, metres / 2.95);
    assert_true(fabs((double)t[0] - expected) < 5e-3); /* of a texel's ray instead of the point's */
    assert_true(rig.report.warning_count == 0);
    pane_scene_finish(&panes);
}

/* A material without self shadow asks for the light as if its object were not there, with all else
 * as it is; and objects that cast once keep their ends as media. */
static void objects_left_out_contain_nothing(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    struct pane outer = box(0, 2, 0, 2, 0.5, 2, 0.7f, 0, 0);
    struct pane inner = box(0, 2, 0, 1, 0.25, 1, 0.9f, 0, 0);
    inner.no_self_shadow = true;
    inner.color[0] = 0.5f;
    outer.cast_once = true;
    outer.color[0] = 0.8f;
    pane_scene_add(&panes, &outer);
    pane_scene_add(&panes, &inner);
    prepare(&panes, &sun, 1);
    float t[2][4];
    double point[1][3] = {{0.1, 0, 0.1}};
    shadow_rig_query(&rig, 0, (const double(*)[3])point, up, 1, UINT32_MAX, &t[0]);
    shadow_rig_query(&rig, 0, (const double(*)[3])point, up, 1, 1, &t[1]);
    double outside = 0.64 * through(0, 1);
    assert_true(fabs((double)t[0][0] - 0.25 * through(1, 0.5) * outside) < 1e-5);
    assert_true(fabs((double)t[1][0] - outside) < 1e-5);
    pane_scene_finish(&panes);
}

/* Thirty-five slabs inside each other: longer than what a sort holds in registers. */
static void long_lists_of_media_are_merged(void **state)
{
    (void)state;
    enum { SLABS = 35 };
    struct pane_scene panes = {0};
    for (int i = 0; i < SLABS; i++) {
        int shuffled = (i * 13 + 5) % SLABS;
        struct pane slab = box(0, 2, 0, 2, 0.02 * (shuffled + 1), 2, 0.06f, 0, 0);
        pane_scene_add(&panes, &slab);
    }
    prepare(&panes, &sun, 1);
    assert_int_equal(rig.report.counts.longest_list, 2 * SLABS);
    double metres = 0.04 * SLABS * (SLABS + 1) / 2;
    expect("below", (double[]){0.1, 0, 0.1}, through(0, metres));
    expect("in the middle", (double[]){0.1, 2, 0.1}, through(0, metres / 2));
    pane_scene_finish(&panes);
}

/* That a frame warns of it is a test of images_media_view. */
static void linked_lists_keep_the_thickness_rule(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    struct pane slab = box(0, 1, 0, 2, 0.25, 2, 1.3f, 0, 0);
    struct error err = {0};
    const struct view_quality quality = {.shadows = SHADOWS_DEEP_LINKED, .shadow_resolution = 64};
    pane_scene_add(&panes, &slab);
    for (int again = 0; again < 2; again++) { /* built, and reused */
        if (!shadow_rig_prepare(&rig, &panes, &sun, 1, no_eye, &quality, &err))
            fail_msg("%s", err.message);
        float t[4];
        query((double[]){0.1, 0, 0.1}, up, t);
        assert_true(fabs((double)t[0] - through(0, 1)) < 1e-4); /* a thickness of 1 m */
    }
    pane_scene_finish(&panes);
}

static double symmetric(uint64_t *seed)
{
    return 2 * rig_random(seed) - 1;
}

static struct pane random_box(uint64_t *seed)
{
    struct pane pane = {.shape = PANE_BOX};
    bool is_clear = rig_random(seed) < 0.5;
    for (int k = 0; k < 3; k++) {
        pane.center[k] = 2 * symmetric(seed);
        pane.u[k] = symmetric(seed);
        pane.v[k] = symmetric(seed);
        pane.w[k] = symmetric(seed);
        pane.sigma[k] = 0.3f * (float)rig_random(seed);
        pane.color[k] = is_clear ? 1 : 0.5f + 0.5f * (float)rig_random(seed);
    }
    return pane;
}

static double volume_of(const struct pane *pane)
{
    double cross[3];
    vec3_cross(pane->v, pane->w, cross);
    return fabs(vec3_dot(pane->u, cross));
}

/* Skewed and mirrored boxes among panes and opaque ones, lists of all lengths; receivers and often
 * the light inside. */
static void random_media_agree_with_the_model(void **state)
{
    (void)state;
    enum { POINTS = 300 };
    uint64_t seed = 5;
    int compared = 0;
    double worst = 0;
    for (int round = 0; round < 24; round++) {
        struct pane_scene panes = {0};
        int count = round % 8 == 7 ? 60 : 3 + round;
        for (int i = 0; i < count; i++) {
            struct pane pane = random_box(&seed);
            if (volume_of(&pane) < 0.05)
                continue;
            if (i % 5 == 4) {
                pane.shape = PANE_FLAT;
                vec3_cross(pane.u, pane.w, pane.v);
            }
            pane.is_opaque = i % 10 == 4;
            pane_scene_add(&panes, &pane);
        }
        struct view_light light = round % 3 ? lamp : sun;
        light.position[1] = round % 2 ? 4 : 0.5;
        rig.shadows = rig.systems[round % 2];
        prepare(&panes, &light, round % 4 ? 1 : 4);
        double points[POINTS][3];
        float t[POINTS][4];
        for (int i = 0; i < POINTS; i++)
            for (int k = 0; k < 3; k++)
                points[i][k] = 2 * symmetric(&seed);
        shadow_rig_query(&rig, 0, (const double(*)[3])points, up, POINTS, UINT32_MAX, t);
        for (int i = 0; i < POINTS; i++) {
            double expected[3];
            if (!shadow_rig_model(&rig, 0, points[i], up, expected))
                continue;
            compared++;
            for (int k = 0; k < 3; k++) {
                double error = fabs((double)t[i][k] - expected[k]);
                worst = fmax(worst, error);
                if (error > 1e-5)
                    fail_msg("round %d, point %d: %.8f instead of %.8f", round, i, (double)t[i][k],
                             expected[k]);
            }
        }
        pane_scene_finish(&panes);
    }
    rig.shadows = rig.systems[0];
    print_message("%d points, largest error %.2g\n", compared, worst);
    assert_true(compared > 2000);
}

int main(void)
{
    if (!shadow_rig_open(&rig, 0, 0))
        return 77;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(slab_takes_beer_lambert_along_the_ray),
        cmocka_unit_test(ball_takes_the_chord),
        cmocka_unit_test(overlapping_nested_and_touching_media_add_up),
        cmocka_unit_test(light_may_stand_inside_media),
        cmocka_unit_test(objects_left_out_contain_nothing),
        cmocka_unit_test(long_lists_of_media_are_merged),
        cmocka_unit_test(linked_lists_keep_the_thickness_rule),
        cmocka_unit_test(random_media_agree_with_the_model),
    };
    int failures = cmocka_run_group_tests(tests, NULL, NULL);
    shadow_rig_close(&rig);
    return failures;
}
