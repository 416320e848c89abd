/* SPDX-License-Identifier: MIT */
/* Shadows through very many, very clear, very dark, coplanar and clear layers: the products that
 * they must be, under every kind of light. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/base/matrix.h"
#include "tests/support/extreme_checks.h"
#include "tests/support/shadow_rig.h"

static struct shadow_rig rig;
static const double up[3] = {0, 1, 0};
static const double no_eye[3] = {0, 0, 0};

enum { LAMPS = SHADOW_RIG_LAMPS };
static const char *const lamp_names[LAMPS] = {"directional", "point", "spot"};

static void prepare(const struct pane_scene *panes, const struct view_quality *quality)
{
    struct error err = {0};
    if (!shadow_rig_prepare(&rig, panes, shadow_rig_lamps, LAMPS, no_eye, quality, &err))
        fail_msg("%s", err.message);
}

static struct pane level_pane(double height, float r, float g, float b)
{
    return (struct pane){
        .center = {0, height, 0}, .u = {3, 0, 0}, .v = {0, 0, -3}, .color = {r, g, b}};
}

static void ask(uint32_t light, const double point[3], const double normal[3], float t[3])
{
    float out[1][4];
    shadow_rig_query(&rig, light, &(double[3]){point[0], point[1], point[2]}, normal, 1, UINT32_MAX,
                     out);
    memcpy(t, out[0], 3 * sizeof *t);
}

/* Error of T relative to the expected one; both zero in f32 is exact. */
static double relative_error(float t, double expected)
{
    if (expected < 1e-38)
        return t <= 1e-38f ? 0 : INFINITY;
    return fabs((double)t - expected) / expected;
}

/* Ten bundles of panes, 0.3 m apart, each 0.2 m thick: what is nearer to a receiver than 2e-5 of
 * its distance from the light, 0.2 mm here, counts as coplanar with it (shadow_query.glsl), so it
 * is between the bundles that is asked. */
static void stack(struct pane_scene *panes, int count, const float color[3])
{
    for (int i = 0; i < count; i++) {
        int bundle = 10 * i / count, rest = 10 * i % count;
        double height = 4 - 0.3 * bundle - 0.2 * rest / count;
        struct pane pane = level_pane(height, color[0], color[1], color[2]);
        pane_scene_add(panes, &pane);
    }
}

/* Between the panes and below them all: A1 of the closed forms. Below f32's range a product is 0,
 * never a number that is not one. */
static void thousands_of_layers_give_their_product(void **state)
{
    (void)state;
    static const float filters[3] = {0.999f, 0.5f, 1 - 1e-7f};
    static const char *const names[3] = {"0.999", "0.5", "1 - 1e-7"};
    for (int n = 1000; n <= 10000; n *= 10) {
        struct pane_scene panes = {0};
        double worst[LAMPS][3] = {{0}};
        stack(&panes, n, filters);
        prepare(&panes, &(struct view_quality){.shadow_resolution = 8});
        assert_int_equal(rig.report.counts.longest_list, n);
        for (uint32_t light = 0; light < LAMPS; light++) {
            for (int part = 0; part <= 10; part++) {
                float t[3];
                int layers = part * n / 10;
                double point[3] = {0.1, 4.05 - 0.3 * part, 0.2};
                ask(light, point, up, t);
                for (int k = 0; k < 3; k++)
                    worst[light][k] =
                        fmax(worst[light][k],
                             relative_error(t[k], pow((double)filters[k], (double)layers)));
            }
        }
        for (uint32_t light = 0; light < LAMPS; light++)
            for (int k = 0; k < 3; k++) {
                char scene[96];
                snprintf(scene, sizeof scene, "%d layers of %s under a %s light", n, names[k],
                         lamp_names[light]);
                extreme_expect(&(struct extreme_row){scene, "deep", "relative error of T", 1e-5},
                               worst[light][k]);
            }
        pane_scene_finish(&panes);
    }
}

/* The linked form keeps 16 bits of a filter: it must give the product of the filters so rounded. */
static void linked_lists_give_the_product_of_their_rounded_filters(void **state)
{
    (void)state;
    enum { LAYERS = 400 }; /* sorted insertion takes a step per layer and layer */
    static const float filters[3] = {0.999f, 0.5f, 1 - 1e-7f};
    struct pane_scene panes = {0};
    double worst = 0;
    stack(&panes, LAYERS, filters);
    prepare(&panes, &(struct view_quality){.shadows = SHADOWS_DEEP_LINKED, .shadow_resolution = 8});
    for (uint32_t light = 0; light < LAMPS; light++) {
        float t[3];
        ask(light, (double[3]){0.1, 0.5, 0.2}, up, t);
        for (int k = 0; k < 3; k++) {
            double stored = round((double)filters[k] * 65535) / 65535;
            worst = fmax(worst, relative_error(t[k], pow(stored, LAYERS)));
        }
    }
    extreme_expect(&(struct extreme_row){"400 layers of 0.999, 0.5 and 1 - 1e-7", "deep-linked",
                                         "relative error of T against its 16-bit filters", 1e-4},
                   worst);
    pane_scene_finish(&panes);
}

/* A black filter stops everything behind it wherever it stands, exactly as an opaque caster does,
 * and nothing in front of it. */
static void total_absorption_stops_light_at_its_own_depth(void **state)
{
    (void)state;
    enum { LAYERS = 9 };
    double worst = 0;
    for (int black = 0; black < LAYERS; black += 4) {
        for (int is_opaque = 0; is_opaque < 2; is_opaque++) {
            struct pane_scene panes = {0};
            for (int i = 0; i < LAYERS; i++) {
                float c = i == black ? 0 : 0.5f;
                struct pane pane = level_pane(4 - 0.3 * i, c, c, i == black ? 0 : 1);
                pane.is_opaque = is_opaque && i == black;
                if (i == black) /* as wide as all below it */
                    pane.u[0] = pane.v[2] = 6;
                pane_scene_add(&panes, &pane);
            }
            prepare(&panes, &(struct view_quality){.shadow_resolution = 32});
            if (is_opaque) /* what lies behind is never stored */
                assert_int_equal(rig.report.counts.longest_list, black);
            for (uint32_t light = 0; light < LAMPS; light++) {
                for (int i = 0; i < LAYERS; i++) {
                    float t[3];
                    ask(light, (double[3]){0.1, 4 - 0.3 * i - 0.15, 0.2}, up, t);
                    worst = fmax(worst, fabs((double)t[0] - (i < black ? exp2(-i - 1) : 0)));
                    worst = fmax(worst, fabs((double)t[2] - (i < black ? 1 : 0)));
                }
            }
            pane_scene_finish(&panes);
        }
    }
    extreme_expect(&(struct extreme_row){"T = 0 first, in the middle, last, black or opaque",
                                         "deep", "error of T", 0},
                   worst);
}

static void clear_layers_make_no_event_and_change_no_bit(void **state)
{
    (void)state;
    for (int is_blended = 0; is_blended < 2; is_blended++) {
        struct pane_scene panes = {0};
        struct error err = {0};
        for (int i = 0; i < 100; i++) {
            struct pane pane = level_pane(4 - 0.03 * i, 1, 1, 1);
            pane.is_blended = is_blended;
            pane_scene_add(&panes, &pane);
            /* alpha 0 under any colour: t = 0, and still nothing is hit */
            panes.materials[i].base_color[3] = is_blended ? 0 : 1;
            for (int k = 0; k < 3; k++)
                panes.materials[i].base_color[k] = is_blended ? 0 : 1;
        }
        if (!shadow_rig_prepare(&rig, &panes, shadow_rig_lamps, LAMPS, no_eye,
                                &(struct view_quality){.shadow_resolution = 64}, &err))
            fail_msg("%s", err.message);
        assert_int_equal(rig.report.counts.events, 0);
        double worst = 0;
        for (uint32_t light = 0; light < LAMPS; light++) {
            float t[3];
            ask(light, (double[3]){0.1, 0.5, 0.2}, up, t);
            for (int k = 0; k < 3; k++)
                worst = fmax(worst, fabs((double)t[k] - 1));
        }
        extreme_expect(
            &(struct extreme_row){is_blended ? "100 layers of alpha 0" : "100 layers of T = 1",
                                  "deep", "error of T", 0},
            worst);
        pane_scene_finish(&panes);
    }
}

static void lean(struct pane *pane, const double n[3], double half)
{
    double helper[3] = {0, 0, 0};
    helper[fabs(n[0]) < 0.5 ? 0 : 1] = half;
    vec3_cross(n, helper, pane->u);
    vec3_normalize(pane->u);
    vec3_cross(n, pane->u, pane->v);
    vec3_normalize(pane->v);
    for (int k = 0; k < 3; k++) {
        pane->u[k] *= half;
        pane->v[k] *= half;
    }
}

struct coplanar_case {
    int copies;
    double n[3]; /* of the panes */
    bool is_reversed;
};

/* All copies count for what is behind them, none for a receiver in their very plane: the rule of
 * ties of docs/explanation/shading.md, strictly nearer. */
static void check_coplanar(const struct coplanar_case *c, double *worst, float first[LAMPS][3])
{
    struct pane_scene panes = {0};
    double expected[3] = {1, 1, 1}, in_plane[3] = {0.03, 3, -0.05}, behind[3];
    uint64_t seed = 5;
    for (int i = 0; i < c->copies; i++) {
        struct pane pane = {.center = {0.03, 3, -0.05}};
        float t = (float)(1 - 0.9 * rig_random(&seed) / c->copies);
        lean(&pane, c->n, 2);
        pane.color[0] = t;
        pane.color[1] = (float)(0.5 + 0.5 * rig_random(&seed));
        pane.color[2] = i % 2 ? 1 : t;
        for (int k = 0; k < 3; k++) {
            expected[k] *= (double)pane.color[k];
            if (i % 3 == 1)
                pane.v[k] = -pane.v[k];
        }
        pane_scene_add(&panes, &pane);
    }
    if (c->is_reversed)
        for (int i = 0; i < c->copies / 2; i++) {
            struct pane a = panes.panes[i], b = panes.panes[c->copies - 1 - i];
            pane_scene_set(&panes, (uint32_t)i, &b);
            pane_scene_set(&panes, (uint32_t)(c->copies - 1 - i), &a);
        }
    prepare(&panes, &(struct view_quality){.shadow_resolution = 64});
    for (int k = 0; k < 3; k++)
        behind[k] = in_plane[k] - 0.2 * c->n[k];
    for (uint32_t light = 0; light < LAMPS; light++) {
        float t[3];
        ask(light, behind, c->n, t);
        for (int k = 0; k < 3; k++)
            *worst = fmax(*worst, fabs((double)t[k] - expected[k]));
        if (c->is_reversed)
            assert_memory_equal(t, first[light], sizeof t); /* whatever order they came in */
        memcpy(first[light], t, sizeof t);
        ask(light, in_plane, c->n, t);
        for (int k = 0; k < 3; k++)
            if (t[k] != 1)
                fail_msg("%d coplanar panes, light %u, channel %d: %.9g in their plane", c->copies,
                         light, k, (double)t[k]);
    }
    pane_scene_finish(&panes);
}

static void coplanar_copies_all_count_and_never_shadow_their_own_plane(void **state)
{
    (void)state;
    static const int copies[] = {2, 3, 10, 33, 100, 1000};
    double worst = 0;
    uint64_t seed = 31;
    for (size_t i = 0; i < sizeof copies / sizeof *copies; i++) {
        for (int tilt = 0; tilt < 2; tilt++) {
            float first[LAMPS][3];
            struct coplanar_case c = {.copies = copies[i], .n = {0, 1, 0}};
            if (tilt) {
                c.n[0] = 0.9 * rig_random(&seed);
                c.n[2] = -0.9 * rig_random(&seed);
                vec3_normalize(c.n);
            }
            check_coplanar(&c, &worst, first);
            c.is_reversed = true;
            check_coplanar(&c, &worst, first);
        }
    }
    extreme_expect(&(struct extreme_row){"2 to 1000 coplanar panes of both windings", "deep",
                                         "error of T behind them", 1e-6},
                   worst);
}

/* A slab of even thickness under light that grazes it: T^(1/cos), A2 of the closed forms. */
static void slabs_follow_their_law_at_grazing_angles(void **state)
{
    (void)state;
    static const double angles[] = {0, 60, 80, 89, 89.9, 89.99, 89.999};
    for (size_t i = 0; i < sizeof angles / sizeof *angles; i++) {
        struct pane_scene panes = {0};
        struct error err = {0};
        double radians = angles[i] * 0.017453292519943295, c = cos(radians), worst = 0;
        const struct view_light sun = {.type = SCENE_LIGHT_DIRECTIONAL,
                                       .direction = {sin(radians), -c, 0},
                                       .color = {1, 1, 1},
                                       .intensity = 1};
        struct pane pane = {.center = {0, 1, 0},
                            .u = {1000, 0, 0},
                            .v = {0, 0, -1000},
                            .pass_through = SCENE_PASS_SLAB};
        for (int k = 0; k < 3; k++) /* optical depths of 0.25, 0.5 and 0.75 along the light */
            pane.color[k] = (float)exp(-0.25 * (k + 1) * c);
        pane_scene_add(&panes, &pane);
        if (!shadow_rig_prepare(&rig, &panes, &sun, 1, no_eye,
                                &(struct view_quality){.shadow_resolution = 64}, &err))
            fail_msg("%s", err.message);
        for (int p = 0; p < 16; p++) {
            float t[3];
            ask(0, (double[3]){10.0 * p, 1 - 50 * c, 7.0 * p}, up, t); /* 50 m behind it */
            for (int k = 0; k < 3; k++)
                worst = fmax(worst, relative_error(t[k], pow((double)pane.color[k], 1 / c)));
        }
        char name[64];
        snprintf(name, sizeof name, "a slab at %g degrees", angles[i]);
        extreme_expect(&(struct extreme_row){name, "deep", "relative error of T", 1e-5}, worst);
        pane_scene_finish(&panes);
    }
}

/* More layers than a list may have: refused with the light and the limit, and the next is served.
 */
static void too_many_layers_are_refused_by_number(void **state)
{
    (void)state;
    struct pane_scene panes = {0};
    struct error err = {0};
    stack(&panes, 60001, (float[3]){0.5f, 0.5f, 0.5f});
    bool is_made = shadow_rig_prepare(&rig, &panes, shadow_rig_lamps, 1, no_eye,
                                      &(struct view_quality){.shadow_resolution = 1}, &err);
    assert_false(is_made);
    assert_int_equal(err.code, ERROR_UNSUPPORTED);
    assert_non_null(strstr(err.message, "light 0"));
    assert_non_null(strstr(err.message, "60000"));
    pane_scene_finish(&panes);
    stack(&panes, 3, (float[3]){0.5f, 0.5f, 0.5f});
    prepare(&panes, &(struct view_quality){.shadow_resolution = 8});
    pane_scene_finish(&panes);
}

int main(void)
{
    if (!shadow_rig_open(&rig, 0, 0))
        return 77;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(thousands_of_layers_give_their_product),
        cmocka_unit_test(linked_lists_give_the_product_of_their_rounded_filters),
        cmocka_unit_test(total_absorption_stops_light_at_its_own_depth),
        cmocka_unit_test(clear_layers_make_no_event_and_change_no_bit),
        cmocka_unit_test(coplanar_copies_all_count_and_never_shadow_their_own_plane),
        cmocka_unit_test(slabs_follow_their_law_at_grazing_angles),
        cmocka_unit_test(too_many_layers_are_refused_by_number),
    };
    int failures = cmocka_run_group_tests(tests, NULL, NULL);
    shadow_rig_close(&rig);
    return failures;
}
