/* SPDX-License-Identifier: MIT */
/* What one pane does to light: the three readings of BLEND, a picture projected through it, the
 * laws of its angle; and three overlapping panes, whose order must not matter to a bit. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/closed_form_scenes.h"
#include "tests/support/image_checks.h"

static const double pi = 3.14159265358979323846;
static const double up[3] = {0, 1, 0};

struct opened {
    struct closed_form_scene scene;
    struct rig_scene rig;
    struct renderer *renderer;
};

static void open_scene(struct opened *opened, struct renderer *renderer)
{
    opened->renderer = renderer;
    rig_scene_open(&opened->rig, renderer, "law", opened->scene.glb, opened->scene.size_bytes);
}

static void close_scene(struct opened *opened)
{
    rig_scene_finish(&opened->rig, opened->renderer);
    closed_form_scene_finish(&opened->scene);
}

/* Color with and without shadows: their ratio is the transmittance. */
struct pair {
    struct image lit, open;
};

static struct pair shoot_pair(const struct opened *opened, struct view view)
{
    struct pair pair = {.lit = shoot_color(opened->renderer, &opened->rig, &view)};
    view.quality.shadows = SHADOWS_NONE;
    pair.open = shoot_color(opened->renderer, &opened->rig, &view);
    return pair;
}

static void pair_finish(struct pair *pair)
{
    image_finish(&pair->lit);
    image_finish(&pair->open);
}

/* The tolerance is absolute. */
static void assert_transmittance(const struct pair *pair, int x, int y, const double expected[3],
                                 double tolerance, const char *what)
{
    const float *lit = image_pixel_f32(&pair->lit, x, y),
                *open = image_pixel_f32(&pair->open, x, y);
    for (int c = 0; c < 3; c++) {
        double t = (double)lit[c] / open[c];
        if (!(fabs(t - expected[c]) <= tolerance))
            fail_msg("%s: pixel %d,%d channel %d passes %.8g, expected %.8g", what, x, y, c, t,
                     expected[c]);
    }
}

/* -- BLEND -- */

static double blended(enum view_blend_filter filter, double alpha, double color)
{
    switch (filter) {
    case VIEW_BLEND_COVERAGE:
        return 1 - alpha;
    case VIEW_BLEND_KIM:
        return (1 - alpha) * color;
    case VIEW_BLEND_MODISETT:
        return (1 - alpha) * color / 2;
    default:
        return (1 - alpha) * (1 - alpha * (1 - color));
    }
}

static void blend_passes_what_its_filter_says(void **state)
{
    static const double colors[3][4] = {
        {0.9, 0.5, 0.2, 0.3}, {0.3, 0.8, 0.6, 0.5}, {0.7, 0.6, 1, 0.15}};
    struct opened opened;
    panes_scene_build(
        &(struct panes_scene_desc){.pane_count = 3, .colors = colors, .is_blend = true},
        &opened.scene);
    open_scene(&opened, *state);
    for (int f = VIEW_BLEND_TINT; f <= VIEW_BLEND_MODISETT; f++) {
        for (int technique = 0; technique < 2; technique++) {
            struct view view = {
                .width_px = 16,
                .height_px = 16,
                .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 0.4, 0.5}, .fov_y_deg = 20},
                .quality = {.blend_filter = (enum view_blend_filter)f,
                            .shadows = technique ? SHADOWS_DEEP_LINKED : SHADOWS_DEEP}};
            double expected[3] = {1, 1, 1};
            for (int i = 0; i < 9; i++)
                expected[i % 3] *=
                    blended((enum view_blend_filter)f, colors[i / 3][3], colors[i / 3][i % 3]);
            struct pair pair = shoot_pair(&opened, view);
            for (int i = 0; i < 256; i++)
                assert_transmittance(&pair, i % 16, i / 16, expected, 3e-4, "blend");
            pair_finish(&pair);
        }
    }
    close_scene(&opened);
}

/* As published, the modified colours are blended over each other from the light on, by alpha; by
 * default they are multiplied, in any order. */
static void modified_translucent_shadows_are_blended_by_alpha(void **state)
{
    static const double colors[3][4] = {
        {0.9, 0.5, 0.2, 0.3}, {0.3, 0.8, 0.6, 0.5}, {0.7, 0.6, 1, 0.15}};
    double over[3] = {1, 1, 1}, product[3] = {1, 1, 1};
    struct opened opened;
    panes_scene_build(
        &(struct panes_scene_desc){.pane_count = 3, .colors = colors, .is_blend = true},
        &opened.scene);
    open_scene(&opened, *state);
    for (int i = 0; i < 9; i++) { /* the first pane is the nearest to the light */
        double alpha = colors[i / 3][3];
        double filter = blended(VIEW_BLEND_MODISETT, alpha, colors[i / 3][i % 3]);
        over[i % 3] = alpha * filter + (1 - alpha) * over[i % 3];
        product[i % 3] *= filter;
    }
    for (int is_faithful = 0; is_faithful < 2; is_faithful++) {
        struct view view = {
            .width_px = 16,
            .height_px = 16,
            .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 0.4, 0.5}, .fov_y_deg = 20},
            .quality = {.blend_filter = VIEW_BLEND_MODISETT,
                        .faithful = is_faithful,
                        .shadows = SHADOWS_TRANSLUCENT}};
        struct pair pair = shoot_pair(&opened, view);
        for (int i = 0; i < 256; i++)
            assert_transmittance(&pair, i % 16, i / 16, is_faithful ? over : product, 3e-4,
                                 is_faithful ? "blended" : "multiplied");
        pair_finish(&pair);
    }
    close_scene(&opened);
}

/* -- Texture projector -- */

static void project_picture(void **state, const struct projector_scene_desc *desc,
                            enum shadow_technique shadows)
{
    static const double facing[3] = {0, 0, 1};
    struct opened opened;
    projector_scene_build(desc, &opened.scene);
    open_scene(&opened, *state);
    struct view view = {.width_px = 192,
                        .height_px = 192,
                        .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                   .eye = {0, 0, 0.9},
                                   .fov_y_deg = 2 * atan(1.2 / 0.9) * 180 / pi},
                        .quality.shadows = shadows,
                        .quality.samples = 1};
    struct pair pair = shoot_pair(&opened, view);
    int compared = 0;
    for (int i = 0; i < 192 * 192; i++) {
        double p[3], expected[3];
        assert_true(view_meet_plane(&view, i % 192, i / 192, facing, 0, p));
        /* A texel of the map of 1024 is 4 mm wide on the wall, two are averaged. */
        if (projector_scene_transmittance(desc, p[0], p[1], expected) < 0.012)
            continue;
        /* llvmpipe decodes sRGB by the polynomial 0.3012 x^3 + 0.6935 x^2 + 0.003 x + 0.0023, up to
         * 1.2e-3 off and 7.8e-4 for these colours: a third of a step of 8 bits. */
        assert_transmittance(&pair, i % 192, i / 192, expected, 9e-4, "projector");
        compared++;
    }
    assert_true(compared > 192 * 192 / 2);
    pair_finish(&pair);
    close_scene(&opened);
}

static void a_picture_is_projected_colour_by_colour(void **state)
{
    for (int shadows = SHADOWS_DEEP; shadows <= SHADOWS_DEEP_LINKED; shadows++) {
        project_picture(state, &(struct projector_scene_desc){0}, (enum shadow_technique)shadows);
        project_picture(state, &(struct projector_scene_desc){.cells = 12, .is_bars = true},
                        (enum shadow_technique)shadows);
    }
}

/* -- Angle -- */

static struct view tilted_view(void)
{
    return (struct view){.width_px = 64,
                         .height_px = 64,
                         .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 0.45, 0.3}},
                         .quality.samples = 1};
}

static void check_tilt(struct renderer *renderer, const struct tilted_scene_desc *desc)
{
    struct opened opened;
    double expected[3];
    tilted_scene_build(desc, &opened.scene);
    tilted_scene_transmittance(desc, expected);
    open_scene(&opened, renderer);
    for (int technique = 0; technique < 2; technique++) {
        struct view view = tilted_view();
        view.quality.shadows = technique ? SHADOWS_DEEP_LINKED : SHADOWS_DEEP;
        struct pair pair = shoot_pair(&opened, view);
        int compared = 0;
        for (int i = 0; i < 64 * 64; i++) {
            double p[3];
            /* Well inside the shadow: the map's texels are at most 2 cm wide. */
            if (!view_meet_plane(&view, i % 64, i / 64, up, 0, p) || fabs(p[0]) > 0.9 ||
                fabs(p[2]) > cos(desc->tilt_deg * pi / 180) - 0.06)
                continue;
            assert_transmittance(&pair, i % 64, i / 64, expected, technique ? 1.1e-3 : 2e-4,
                                 "tilt");
            compared++;
        }
        assert_true(compared > 500);
        pair_finish(&pair);
    }
    close_scene(&opened);
}

static void tilted_panes_follow_the_law_of_their_angle(void **state)
{
    static const double tilts[] = {0, 20, 45, 60, 75, 80};
    for (int law = GLB_PASS_CONSTANT; law <= GLB_PASS_EDGE; law++)
        for (size_t i = 0; i < sizeof tilts / sizeof *tilts; i++)
            check_tilt(*state,
                       &(struct tilted_scene_desc){.tilt_deg = tilts[i],
                                                   .color = {0.9, 0.6, 0.35},
                                                   .pass_through = (enum glb_pass_through)law,
                                                   .edge_color = {0.2, 0.7, 1},
                                                   .edge_exponent = 2});
}

/* A point light meets each point of the slab at another angle. */
static void slab_darkens_towards_grazing_light(void **state)
{
    static const double color[3] = {0.9, 0.6, 0.35}, lamp[3] = {0.4, 2.6, -0.3};
    const struct tilted_scene_desc desc = {
        .tilt_deg = 35, .color = {0.9, 0.6, 0.35}, .pass_through = GLB_PASS_SLAB};
    const double normal[3] = {0, cos(desc.tilt_deg * pi / 180), sin(desc.tilt_deg * pi / 180)};
    const struct view_light light = {.type = SCENE_LIGHT_POINT,
                                     .position = {lamp[0], lamp[1], lamp[2]},
                                     .color = {1, 1, 1},
                                     .intensity = 50};
    struct opened opened;
    tilted_scene_build(&desc, &opened.scene);
    open_scene(&opened, *state);
    struct view view = tilted_view();
    view.lights = &light;
    view.light_count = 1;
    view.ignore_scene_lights = true;
    struct pair pair = shoot_pair(&opened, view);
    for (int i = 0; i < 64 * 64; i++) {
        double p[3], expected[3];
        if (!view_meet_plane(&view, i % 64, i / 64, up, 0, p) || fabs(p[0]) > 0.3 ||
            fabs(p[2]) > 0.2)
            continue;
        double way[3] = {lamp[0] - p[0], lamp[1] - p[1], lamp[2] - p[2]};
        double length = sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2]);
        double cosine = fabs(way[1] * normal[1] + way[2] * normal[2]) / length;
        for (int c = 0; c < 3; c++)
            expected[c] = pow(color[c], 1 / cosine);
        assert_transmittance(&pair, i % 64, i / 64, expected, 3e-3, "slab"); /* within a texel */
    }
    pair_finish(&pair);
    close_scene(&opened);
}

/* -- Order -- */

static void check_overlap(const struct closed_form_scene *scene, const struct view *view,
                          const struct image *color)
{
    int seen[8] = {0};
    for (int i = 0; i < color->width_px * color->height_px; i++) {
        double p[3], radiance[3], transmittance[3];
        int x = i % color->width_px, y = i / color->width_px, which = 0;
        assert_true(view_meet_plane(view, x, y, up, 0, p));
        if (closed_form_transmittance(scene, p, transmittance) < 0.025)
            continue; /* three texels of the map */
        closed_form_radiance(scene, p, up, radiance);
        for (int k = 0; k < 3; k++) {
            const struct closed_form_pane *pane = &scene->panes[k];
            bool is_under = p[0] > pane->corner[0] && p[0] < pane->corner[0] + 1 &&
                            p[2] < pane->corner[2] && p[2] > pane->corner[2] - 1;
            which |= is_under << k;
        }
        seen[which]++;
        for (int c = 0; c < 3; c++)
            if (!(fabs((double)image_pixel_f32(color, x, y)[c] - radiance[c]) <=
                  2e-3 * radiance[c]))
                fail_msg("pixel %d,%d under panes %x: channel %d is %.8g, expected %.8g", x, y,
                         which, c, (double)image_pixel_f32(color, x, y)[c], radiance[c]);
    }
    for (int which = 0; which < 8; which++)
        assert_true(seen[which] > 20);
}

static void order_of_overlapping_panes_does_not_change_a_bit(void **state)
{
    static const int orders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2},
                                     {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    for (int blend = 0; blend < 2; blend++) {
        struct image first = {0};
        for (int i = 0; i < 36; i++) {
            struct overlap_scene_desc desc = {.is_blend = blend};
            struct opened opened;
            memcpy(desc.height_order, orders[i / 6], sizeof desc.height_order);
            memcpy(desc.file_order, orders[i % 6], sizeof desc.file_order);
            overlap_scene_build(&desc, &opened.scene);
            open_scene(&opened, *state);
            struct view view = {.width_px = 96,
                                .height_px = 96,
                                .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                           .eye = {0, 0.8, 0},
                                           .up = {0, 0, -1},
                                           .fov_y_deg = 2 * atan(1 / 0.8) * 180 / pi},
                                .quality = {.shadow_resolution = 512, .samples = 1}};
            struct image color = shoot_color(*state, &opened.rig, &view);
            if (i == 0) {
                check_overlap(&opened.scene, &view, &color);
                first = color;
            } else {
                assert_same_bits(&first, &color);
                image_finish(&color);
            }
            close_scene(&opened);
        }
        image_finish(&first);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(blend_passes_what_its_filter_says),
        cmocka_unit_test(modified_translucent_shadows_are_blended_by_alpha),
        cmocka_unit_test(a_picture_is_projected_colour_by_colour),
        cmocka_unit_test(tilted_panes_follow_the_law_of_their_angle),
        cmocka_unit_test(slab_darkens_towards_grazing_light),
        cmocka_unit_test(order_of_overlapping_panes_does_not_change_a_bit),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
