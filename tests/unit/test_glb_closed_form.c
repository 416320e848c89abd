/* SPDX-License-Identifier: MIT */
/* The closed-form scenes agree with arithmetic done by hand, and with their own geometry. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/closed_form_scenes.h"
#include "tests/support/glb_reader.h"

static void assert_readable(const struct closed_form_scene *scene, size_t cameras)
{
    struct glb_file file;
    char why[160] = "";
    if (!glb_file_init(&file, scene->glb, scene->size_bytes, why) ||
        !glb_file_references_hold(&file, why))
        fail_msg("%s", why);
    assert_int_equal(glb_file_count(&file, "cameras"), cameras);
    glb_file_finish(&file);
}

static void assert_close(double value, double expected)
{
    if (!(fabs(value - expected) <= 1e-12 * fmax(1, fabs(expected))))
        fail_msg("%.17g is not %.17g", value, expected);
}

static void probe_k_lies_under_exactly_k_panes(void **state)
{
    (void)state;
    static const enum glb_light_type lights[] = {GLB_LIGHT_SPOT, GLB_LIGHT_POINT,
                                                 GLB_LIGHT_DIRECTIONAL};
    double colors[64][4];
    for (int k = 0; k < 64; k++)
        for (int i = 0; i < 4; i++)
            colors[k][i] = 0.5 + 0.5 * fabs(sin(1 + 3 * k + i));
    for (size_t l = 0; l < 3; l++)
        for (int n = 0; n <= 64; n = n ? 4 * n : 1) {
            struct panes_scene_desc desc = {
                .pane_count = n, .colors = colors, .light = lights[l], .has_probes = true};
            struct closed_form_scene scene;
            panes_scene_build(&desc, &scene);
            assert_readable(&scene, (size_t)n + 2);
            for (int k = 0; k <= n; k++) {
                double p[3], t[3], product = 1;
                panes_scene_probe(&desc, k, p);
                assert_true(closed_form_transmittance(&scene, p, t) > 0.2 || n == 0);
                for (int j = 0; j < k; j++)
                    product *= colors[j][1];
                assert_close(t[1], product);
            }
            closed_form_scene_finish(&scene);
        }
}

/* Light reaches every probe past the tiles of all others, for the tightest ring allowed. */
static void no_probe_stands_in_the_light_of_another(void **state)
{
    (void)state;
    struct panes_scene_desc desc = {.pane_count = 128};
    double top_light_y = 1 + 127 * 0.1 + 4;
    for (int k = 0; k <= 128; k++)
        for (int j = 0; j < k; j++) {
            double p[3], q[3];
            panes_scene_probe(&desc, k, p);
            panes_scene_probe(&desc, j, q); /* j is higher */
            double s = (top_light_y - q[1]) / (top_light_y - p[1]);
            double dx = fabs(s * p[0] - q[0]), dz = fabs(s * p[2] - q[2]);
            assert_true(fmax(dx, dz) > 0.01 * s);
        }
}

static void blend_panes_follow_the_tint_rule(void **state)
{
    (void)state;
    static const double color[1][4] = {{1, 0.5, 0, 0.25}};
    struct closed_form_scene scene;
    double t[3];
    panes_scene_build(
        &(struct panes_scene_desc){.pane_count = 1, .colors = color, .is_blend = true}, &scene);
    closed_form_transmittance(&scene, (double[]){0, 0, 0}, t);
    assert_close(t[0], 0.75);
    assert_close(t[1], 0.75 * 0.875);
    assert_close(t[2], 0.75 * 0.75);
    closed_form_scene_finish(&scene);
}

static void radiance_is_albedo_over_pi_times_cosine_over_square(void **state)
{
    (void)state;
    struct closed_form_scene scene;
    double r[3];
    panes_scene_build(&(struct panes_scene_desc){.light = GLB_LIGHT_POINT, .intensity = 7}, &scene);
    closed_form_unshadowed(&scene, (double[]){3, 1, 0}, (double[]){0, 1, 0}, r); /* 4 up, 3 aside */
    assert_close(r[0], 0.5 / M_PI * 7 * 0.8 / 25);
    closed_form_radiance(&scene, (double[]){3, 1, 0}, (double[]){0, 1, 0}, r);
    assert_close(r[0], 0.5 / M_PI * 7 * 0.8 / 25);
    closed_form_scene_finish(&scene);
    panes_scene_build(&(struct panes_scene_desc){.light = GLB_LIGHT_DIRECTIONAL}, &scene);
    closed_form_unshadowed(&scene, (double[]){3, 1, 0}, (double[]){0.6, 0.8, 0}, r);
    assert_close(r[2], 0.5 / M_PI * 4 * 0.8);
    closed_form_scene_finish(&scene);
}

static void the_panes_overlap_alike_in_any_order(void **state)
{
    (void)state;
    static const int orders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2},
                                     {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    static const double colors[3][3] = {{0.9, 0.1, 0.05}, {0.15, 0.8, 0.1}, {0.05, 0.2, 0.95}};
    for (size_t i = 0; i < 6; i++) {
        struct overlap_scene_desc desc = {0};
        struct closed_form_scene scene;
        double t[3];
        memcpy(desc.height_order, orders[i], sizeof desc.height_order);
        memcpy(desc.file_order, orders[5 - i], sizeof desc.file_order);
        overlap_scene_build(&desc, &scene);
        assert_readable(&scene, 1);
        assert_true(closed_form_transmittance(&scene, (double[]){0, 0, 0}, t) > 0.1);
        for (int c = 0; c < 3; c++)
            assert_close(t[c], colors[0][c] * colors[1][c] * colors[2][c]);
        closed_form_transmittance(&scene, (double[]){0, 0, 0.75}, t); /* red alone */
        assert_close(t[0], 0.9);
        closed_form_transmittance(&scene, (double[]){0, 0, -0.9}, t); /* beside all */
        assert_close(t[2], 1);
        closed_form_scene_finish(&scene);
    }
}

/* Independent of the closed form: samples the pane densely and projects it to the floor. */
static void random_panes_shade_where_their_own_points_project(void **state)
{
    (void)state;
    struct closed_form_scene scene;
    random_panes_scene_build(
        &(struct random_panes_scene_desc){.pane_count = 40, .seed = 5, .light = GLB_LIGHT_SPOT},
        &scene);
    assert_readable(&scene, 1);
    struct closed_form_scene one = scene;
    one.pane_count = 1;
    for (int k = 0; k < scene.pane_count; k++) {
        one.panes = &scene.panes[k];
        double filter[3], t[3];
        closed_form_filter(one.panes, filter);
        for (int i = 0; i < 25; i++) {
            double s = -0.375 + 0.4375 * (i / 5), v = -0.375 + 0.4375 * (i % 5), p[3];
            bool is_inside = s > 0 && s < 1 && v > 0 && v < 1;
            for (int c = 0; c < 3; c++)
                p[c] = one.panes->corner[c] + s * one.panes->u[c] + v * one.panes->v[c];
            double scale = scene.light.position[1] / (scene.light.position[1] - p[1]);
            if (p[1] < 0.01)
                continue;
            double floor[3] = {0};
            for (int c = 0; c < 3; c += 2)
                floor[c] = scene.light.position[c] + scale * (p[c] - scene.light.position[c]);
            assert_true(closed_form_transmittance(&one, floor, t) > 0);
            assert_close(t[0], is_inside ? filter[0] : 1);
        }
    }
    closed_form_scene_finish(&scene);
}

static void random_scenes_depend_on_their_seed_alone(void **state)
{
    (void)state;
    struct closed_form_scene a, b, c;
    random_panes_scene_build(&(struct random_panes_scene_desc){.pane_count = 9, .seed = 1}, &a);
    random_panes_scene_build(&(struct random_panes_scene_desc){.pane_count = 9, .seed = 1}, &b);
    random_panes_scene_build(&(struct random_panes_scene_desc){.pane_count = 9, .seed = 2}, &c);
    assert_int_equal(a.size_bytes, b.size_bytes);
    assert_memory_equal(a.glb, b.glb, a.size_bytes);
    assert_true(a.size_bytes != c.size_bytes || memcmp(a.glb, c.glb, a.size_bytes) != 0);
    closed_form_scene_finish(&a);
    closed_form_scene_finish(&b);
    closed_form_scene_finish(&c);
}

static void the_projector_doubles_its_picture(void **state)
{
    (void)state;
    static const struct projector_scene_desc checker = {.cells = 4}, bars = {.is_bars = true};
    struct closed_form_scene scene;
    double t[3];
    projector_scene_build(&checker, &scene);
    assert_readable(&scene, 1);
    closed_form_scene_finish(&scene);
    /* Cells are 0.25 m on the pane, 0.5 m on the wall; the upper left one is even. */
    assert_close(projector_scene_transmittance(&checker, -0.75, 0.75, t), 0.25);
    assert_close(t[0], 1);
    assert_close(t[2], pow((16 / 255.0 + 0.055) / 1.055, 2.4));
    assert_close(projector_scene_transmittance(&checker, -0.3, 0.75, t), 0.2);
    assert_close(t[2], 1);
    projector_scene_transmittance(&checker, -0.3, 0.3, t);
    assert_close(t[0], 1);
    assert_close(projector_scene_transmittance(&bars, -0.3, 0.499, t), 0.2);
    assert_close(t[2], 1);
    assert_close(projector_scene_transmittance(&bars, 1.1, 0, t), 0.1);
    assert_close(t[0] * t[1] * t[2], 1);
}

static void the_tilted_pane_filters_by_its_path(void **state)
{
    (void)state;
    struct tilted_scene_desc desc = {
        .tilt_deg = 60, .color = {0.25, 0.5, 1}, .edge_color = {0, 0.5, 1}, .edge_exponent = 2};
    struct closed_form_scene scene;
    double t[3];
    for (int model = GLB_PASS_CONSTANT; model <= GLB_PASS_EDGE; model++) {
        desc.pass_through = (enum glb_pass_through)model;
        tilted_scene_build(&desc, &scene);
        assert_readable(&scene, 1);
        closed_form_scene_finish(&scene);
    }
    desc.pass_through = GLB_PASS_SLAB;
    tilted_scene_transmittance(&desc, t);
    assert_close(t[0], 0.0625); /* twice the path at 60 degrees */
    assert_close(t[1], 0.25);
    desc.pass_through = GLB_PASS_EDGE;
    tilted_scene_transmittance(&desc, t);
    assert_close(t[0], 0.25 * 0.25);
    assert_close(t[1], 0.75 * 0.25 + 0.25 * 0.5);
    assert_close(t[2], 1);
}

static void the_room_has_the_lights_and_spheres_asked_for(void **state)
{
    (void)state;
    struct closed_form_scene scene;
    struct glb_file file;
    char why[160];
    room_scene_build(&(struct room_scene_desc){.light_count = 25, .seed = 3, .glass_spheres = 10},
                     &scene);
    assert_readable(&scene, 1);
    assert_true(glb_file_init(&file, scene.glb, scene.size_bytes, why));
    assert_int_equal(glb_file_count(&file, "lights"), 25);
    size_t spheres = 0, glass = 0;
    for (size_t i = 0; i < glb_file_count(&file, "meshes"); i++)
        spheres +=
            strcmp(json_string_value(glb_member(glb_file_element(&file, "meshes", i), "name")),
                   "Sphere") == 0;
    for (size_t i = 0; i < glb_file_count(&file, "materials"); i++)
        glass += glb_member(glb_file_element(&file, "materials", i),
                            "extensions.KHR_materials_transmission") != NULL;
    assert_int_equal(spheres, 40);
    assert_int_equal(glass, 10);
    for (size_t i = 0; i < 25; i++) {
        const json_t *light = glb_file_element(&file, "lights", i);
        double range = json_number_value(glb_member(light, "range"));
        assert_true(i % 2 ? range >= 3 && range <= 6 : range >= 1 && range <= 2.5);
    }
    glb_file_finish(&file);
    closed_form_scene_finish(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(probe_k_lies_under_exactly_k_panes),
        cmocka_unit_test(no_probe_stands_in_the_light_of_another),
        cmocka_unit_test(blend_panes_follow_the_tint_rule),
        cmocka_unit_test(radiance_is_albedo_over_pi_times_cosine_over_square),
        cmocka_unit_test(the_panes_overlap_alike_in_any_order),
        cmocka_unit_test(random_panes_shade_where_their_own_points_project),
        cmocka_unit_test(random_scenes_depend_on_their_seed_alone),
        cmocka_unit_test(the_projector_doubles_its_picture),
        cmocka_unit_test(the_tilted_pane_filters_by_its_path),
        cmocka_unit_test(the_room_has_the_lights_and_spheres_asked_for),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
