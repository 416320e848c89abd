/* SPDX-License-Identifier: MIT */
/* Shadow volumes in half floats, as published by Kim, Kim and Turk: light that is multiplied does
 * not return to what it was where a way enters and leaves many volumes (their figure 4), sums of
 * logarithms do to what half floats can tell, and integers to the last bit. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/base/matrix.h"
#include "tests/support/closed_form_internal.h"
#include "tests/support/image_checks.h"
#include "tests/support/shadow_rig.h"

enum { WIDTH_PX = 96, HEIGHT_PX = 48, SLATS = 16 };

/* Slats side by side over a floor, along x, each `gap` m from the next. The eye looks along them
 * from below: its ways go through their volumes, one after the other. */
static const double slat_height = 1, slat_width = 0.2, gap = 0.4, first_x = 3.7, half_z = 3;
static const double filter[3] = {0.2, 0.5, 0.85};
static const double down[3] = {0.1, -1, 0.07};

/* corner: 0 and 1 where ways enter, 2 and 3 where they leave; 4: the middle. */
static void put_corner(float at[3], int slat, int corner)
{
    double across = corner == 4 ? 0.5 : corner / 2;
    at[0] = (float)(first_x - gap * slat - slat_width * across);
    at[1] = (float)slat_height;
    at[2] = (float)(corner == 4 ? 0 : corner & 1 ? half_z : -half_z);
}

/* Edges are drawn in the order of their vertices: of all slats the quarter comes first at which
 * ways enter. */
static void add_slats(struct glb_builder *builder)
{
    static const int quarters[4][3] = {{0, 1, 4}, {1, 3, 4}, {3, 2, 4}, {2, 0, 4}};
    float positions[4 * SLATS][3][3];
    for (int i = 0; i < 4 * SLATS; i++)
        for (int k = 0; k < 3; k++)
            put_corner(positions[i][k], i % SLATS, quarters[i / SLATS][k]);
    struct glb_material_desc material = {.name = "Slat",
                                         .base_color = {0, 0, 0, 1},
                                         .transmission = 1,
                                         .has_ior = true,
                                         .ior = 1,
                                         .is_double_sided = true};
    for (int k = 0; k < 3; k++)
        material.base_color[k] = filter[k];
    const struct glb_primitive_desc primitive = {.material =
                                                     glb_builder_add_material(builder, &material),
                                                 .vertex_count = 12 * (size_t)SLATS,
                                                 .positions = positions[0][0]};
    struct glb_node_desc node = {.name = "Slats",
                                 .mesh = glb_builder_add_mesh(builder, "Slats", &primitive, 1)};
    glb_builder_add_node(builder, &node);
}

/* Slats above a point of the floor, and how many volumes its way has left; -1: at an edge. */
static int slats_above(const double point[3], int *left)
{
    const double hair = 0.004;
    double x = point[0] - down[0] * slat_height, z = point[2] - down[2] * slat_height;
    *left = 0;
    if (fabs(z) > half_z - 0.1)
        return -1;
    for (int i = 0; i < SLATS; i++) {
        double high = first_x - gap * i, low = high - slat_width;
        if (fabs(x - high) < hair || fabs(x - low) < hair)
            return -1;
        if (x < high && x > low)
            return 1;
        *left += x < low;
    }
    return 0;
}

/* How far off the closed form pixels are: at most where ways have left four volumes or fewer, and
 * where they have left more; and how many of the latter are off by a hundredth. */
struct errors {
    double few, many;
    int points, off;
};

static struct errors errors_of(const struct image *open, const struct image *dark,
                               const struct view *view)
{
    struct errors errors = {0};
    for (int i = 0; i < WIDTH_PX * HEIGHT_PX; i++) {
        double point[3], worst = 0;
        int left, x = i % WIDTH_PX, y = i / WIDTH_PX;
        const float *before = image_pixel_f32(open, x, y), *after = image_pixel_f32(dark, x, y);
        if (!view_meet_plane(view, x, y, (double[]){0, 1, 0}, 0, point) || fabs(point[0]) > 3.9)
            continue;
        int above = slats_above(point, &left);
        if (above < 0 || before[0] < 1e-2f)
            continue;
        for (int k = 0; k < 3; k++)
            worst = fmax(worst, fabs((double)(after[k] / before[k]) - (above ? filter[k] : 1)));
        errors.points++;
        if (left <= 4)
            errors.few = fmax(errors.few, worst);
        else
            errors.many = fmax(errors.many, worst);
        errors.off += left > 4 && worst > 0.01;
    }
    return errors;
}

static struct errors shoot_slats(struct renderer *renderer, const struct rig_scene *rig,
                                 struct view view, struct view_quality quality)
{
    view.quality.shadows = SHADOWS_NONE;
    struct image open = shoot_color(renderer, rig, &view);
    struct frame frame;
    view.quality = quality;
    view.quality.samples = 1;
    shoot(renderer, rig, &view, &frame);
    assert_true(report_has_pass(&frame.report, "shadow.volumes", "volume"));
    const struct image *dark = &frame.outputs[VIEW_OUTPUT_COLOR];
    struct errors errors = errors_of(&open, dark, &view);
    save_picture(dark, !quality.faithful                           ? "slats_integers"
                       : quality.volume_map == VIEW_VOLUME_FACTORS ? "slats_factors"
                                                                   : "slats_logarithms");
    printf("%s: off by %.2g at most behind few, %.2g behind many, %d of %d by 0.01\n",
           !quality.faithful                           ? "integers"
           : quality.volume_map == VIEW_VOLUME_FACTORS ? "factors"
                                                       : "logarithms",
           errors.few, errors.many, errors.off, errors.points);
    frame_finish(&frame);
    image_finish(&open);
    return errors;
}

static void light_that_is_multiplied_in_half_floats_does_not_return(void **state)
{
    struct closed_form_scene scene;
    struct rig_scene rig;
    struct glb_builder *builder = closed_form_begin(&scene, "Slats", 0);
    closed_form_floor(&scene, builder, 4);
    add_slats(builder);
    closed_form_end(&scene, builder);
    rig_scene_open(&rig, *state, "slats", scene.glb, scene.size_bytes);
    struct view_light light = {.type = SCENE_LIGHT_DIRECTIONAL, .intensity = 3, .color = {1, 1, 1}};
    memcpy(light.direction, down, sizeof light.direction);
    struct view view = {.width_px = WIDTH_PX,
                        .height_px = HEIGHT_PX,
                        .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                   .eye = {5, 0.6, 0.1},
                                   .target = {1, 0, 0},
                                   .fov_y_deg = 30},
                        .lights = &light,
                        .light_count = 1,
                        .ignore_scene_lights = true,
                        .quality = {.samples = 1}};
    const struct view_quality exact = {.shadows = SHADOWS_VOLUME},
                              logarithms = {.shadows = SHADOWS_VOLUME, .faithful = true},
                              factors = {.shadows = SHADOWS_VOLUME,
                                         .faithful = true,
                                         .volume_map = VIEW_VOLUME_FACTORS};
    struct errors a = shoot_slats(*state, &rig, view, exact);
    struct errors b = shoot_slats(*state, &rig, view, logarithms);
    struct errors c = shoot_slats(*state, &rig, view, factors);
    assert_true(a.points > 2000 && b.points == a.points && c.points == a.points);
    assert_true(fmax(a.few, a.many) < 2e-5);
    assert_true(fmax(b.few, b.many) < 0.05 && b.few < 0.01 && b.many > 1e-4);
    assert_true(c.few < 0.01 && c.many > 0.9 && c.off > c.points / 8);
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(light_that_is_multiplied_in_half_floats_does_not_return),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
