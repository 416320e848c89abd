/* SPDX-License-Identifier: MIT */
/* Shadows of smooth meshes on themselves: a coarse sphere is lit up to the terminator of the sphere
 * that it stands for, in both forms of the ray tracer, and others still shadow it. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/shapes.h"
#include "tests/support/image_checks.h"

enum { SIZE = 96 };

static const double half_m = 1.1;
static const double to_light[3] = {0.8, 0.48, 0.36}; /* unit */

/* A sphere of 16 x 8 faces about the origin; a plate that shadows where it faces the light. */
static void open_sphere(struct rig_scene *rig, struct renderer *renderer, bool has_plate)
{
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Sphere", &err);
    struct shape shape = {0};
    size_t size_bytes;
    void *glb;
    int clay = glb_builder_add_material(
        builder, &(struct glb_material_desc){.base_color = {0.8, 0.8, 0.8, 1}, .roughness = 1});
    shape_add_sphere(&shape, (double[]){0, 0, 0}, 1, 16, 8);
    int sphere = shape_give_mesh(&shape, builder, "Sphere", clay);
    glb_builder_add_node(builder, &(struct glb_node_desc){.mesh = sphere});
    if (has_plate) {
        shape_add_box(&shape, (double[]){2.2, 1.25, 0.9}, (double[]){2.6, 1.65, 1.26});
        int plate = shape_give_mesh(&shape, builder, "Plate", clay);
        glb_builder_add_node(builder, &(struct glb_node_desc){.mesh = plate});
    }
    if (!glb_builder_finish(builder, &glb, &size_bytes, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    rig_scene_open(rig, renderer, has_plate ? "plate" : "sphere", glb, size_bytes);
    free(glb);
}

static const struct view_light sun = {.type = SCENE_LIGHT_DIRECTIONAL,
                                      .direction = {-0.8, -0.48, -0.36},
                                      .color = {1, 1, 1},
                                      .intensity = 3};

static struct view look(bool is_reference)
{
    return (struct view){
        .width_px = SIZE,
        .height_px = SIZE,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 0, 5}, .ortho_height = 2 * half_m},
        .lights = &sun,
        .light_count = 1,
        .quality = {.shadows = VIEW_SHADOWS_RAYTRACED, .samples = 1, .reference = is_reference}};
}

/* Cosine between the light and the normal of the sphere in a pixel; -2 outside. */
static double cosine_at(int x, int y)
{
    double p[3] = {(2 * (x + 0.5) / SIZE - 1) * half_m, (1 - 2 * (y + 0.5) / SIZE) * half_m, 0};
    double rest = 1 - p[0] * p[0] - p[1] * p[1];
    p[2] = sqrt(fmax(rest, 0));
    return rest > 0.1 ? p[0] * to_light[0] + p[1] * to_light[1] + p[2] * to_light[2] : -2;
}

/* Lambert's term of the sphere, up to what the interpolated normals of so few faces are off. */
static void a_coarse_sphere_has_the_terminator_of_a_sphere(void **state)
{
    struct rig_scene rig;
    open_sphere(&rig, *state, false);
    for (int is_reference = 0; is_reference < 2; is_reference++) {
        struct view view = look(is_reference);
        struct image image = shoot_color(*state, &rig, &view);
        double full = 0;
        int near = 0;
        for (int i = 0; i < SIZE * SIZE; i++)
            full = fmax(full, (double)image_pixel_f32(&image, i % SIZE, i / SIZE)[1]);
        for (int i = 0; i < SIZE * SIZE; i++) {
            int x = i % SIZE, y = i / SIZE;
            double cosine = cosine_at(x, y), lit = (double)image_pixel_f32(&image, x, y)[1] / full;
            if (cosine > -2 && fabs(lit - fmax(cosine, 0)) > 0.06)
                fail_msg("%d,%d: %.3f of the light, expected %.3f", x, y, lit, fmax(cosine, 0));
            near += cosine > 0.02 && cosine < 0.3;
        }
        assert_true(near > SIZE * SIZE / 40);
        image_finish(&image);
    }
    rig_scene_finish(&rig, *state);
}

static void others_still_shadow_it(void **state)
{
    struct rig_scene rig;
    open_sphere(&rig, *state, true);
    for (int is_reference = 0; is_reference < 2; is_reference++) {
        struct view view = look(is_reference);
        struct image image = shoot_color(*state, &rig, &view);
        int x = (int)((to_light[0] / half_m + 1) / 2 * SIZE);
        int y = (int)((1 - to_light[1] / half_m) / 2 * SIZE);
        assert_true(image_pixel_f32(&image, x, y)[1] < 1e-6f);
        image_finish(&image);
    }
    rig_scene_finish(&rig, *state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_coarse_sphere_has_the_terminator_of_a_sphere),
        cmocka_unit_test(others_still_shadow_it),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
