/* SPDX-License-Identifier: MIT */
/* Shadows of smooth meshes on themselves: a coarse sphere is lit up to the terminator of the sphere
 * that it stands for, by rays and by shadow maps of any resolution, and others still shadow it. */
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

enum kind { BARE, WITH_PLATE, BENT };

/* A sphere of 16 x 8 faces about the origin; with a plate that shadows where it faces the light;
 * or turned, stretched and mirrored. */
static void open_sphere(struct rig_scene *rig, struct renderer *renderer, enum kind kind)
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
    struct glb_node_desc node = {.mesh = sphere};
    if (kind == BENT) {
        node.scale[0] = -0.5, node.scale[1] = 1.1, node.scale[2] = 0.8;
        glb_node_rotate(&node, (double[]){0.6, 0, 0.8}, 50);
    }
    glb_builder_add_node(builder, &node);
    if (kind == WITH_PLATE) {
        shape_add_box(&shape, (double[]){2.2, 1.25, 0.9}, (double[]){2.6, 1.65, 1.26});
        int plate = shape_give_mesh(&shape, builder, "Plate", clay);
        glb_builder_add_node(builder, &(struct glb_node_desc){.mesh = plate});
    }
    if (!glb_builder_finish(builder, &glb, &size_bytes, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    rig_scene_open(rig, renderer, (const char *[]){"bare", "plate", "bent"}[kind], glb, size_bytes);
    free(glb);
}

static const struct view_light sun = {.type = SCENE_LIGHT_DIRECTIONAL,
                                      .direction = {-0.8, -0.48, -0.36},
                                      .color = {1, 1, 1},
                                      .intensity = 3};

static const struct form {
    const char *name;
    enum shadow_technique shadows;
    bool is_reference;
    int samples, resolution;
} forms[] = {
    {"rays", SHADOWS_RAYTRACED, false, 1, 0},
    {"reference", SHADOWS_RAYTRACED, true, 1, 0},
    {"traced shadows", SHADOWS_RAYTRACED_SHADOWS, false, 1, 0},
    {"area", SHADOWS_AREA, false, 1, 0},
    {"area, samples apart", SHADOWS_AREA, false, 4, 0},
    {"map of 256", SHADOWS_MAP, false, 1, 256},
    {"map of 2048", SHADOWS_MAP, false, 1, 2048},
    {"map of 1024, samples apart", SHADOWS_MAP, false, 4, 1024},
    {"deep of 1024", SHADOWS_DEEP, false, 1, 1024},
    {"linked of 1024", SHADOWS_DEEP_LINKED, false, 1, 1024},
};
enum { FORMS = sizeof forms / sizeof forms[0] };

static struct view look(const struct form *form)
{
    return (struct view){
        .width_px = SIZE,
        .height_px = SIZE,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 0, 5}, .ortho_height = 2 * half_m},
        .lights = &sun,
        .light_count = 1,
        .quality = {.shadows = form->shadows,
                    .samples = form->samples,
                    .shadow_resolution = form->resolution,
                    .reference = form->is_reference}};
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
    open_sphere(&rig, *state, BARE);
    for (int k = 0; k < FORMS; k++) {
        struct view view = look(&forms[k]);
        struct image image = shoot_color(*state, &rig, &view);
        double full = 0;
        int near = 0;
        for (int i = 0; i < SIZE * SIZE; i++)
            full = fmax(full, (double)image_pixel_f32(&image, i % SIZE, i / SIZE)[1]);
        for (int i = 0; i < SIZE * SIZE; i++) {
            int x = i % SIZE, y = i / SIZE;
            double cosine = cosine_at(x, y), lit = (double)image_pixel_f32(&image, x, y)[1] / full;
            if (cosine > -2 && fabs(lit - fmax(cosine, 0)) > 0.06)
                fail_msg("%s, %d,%d: %.3f of the light, expected %.3f", forms[k].name, x, y, lit,
                         fmax(cosine, 0));
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
    open_sphere(&rig, *state, WITH_PLATE);
    for (int k = 0; k < FORMS; k++) {
        struct view view = look(&forms[k]);
        struct image image = shoot_color(*state, &rig, &view);
        int x = (int)((to_light[0] / half_m + 1) / 2 * SIZE);
        int y = (int)((1 - to_light[1] / half_m) / 2 * SIZE);
        assert_true(image_pixel_f32(&image, x, y)[1] < 1e-6f);
        image_finish(&image);
    }
    rig_scene_finish(&rig, *state);
}

/* By a lamp, seen in perspective; all that differs are edges and their texels. */
static void maps_agree_with_rays_on_a_bent_mesh(void **state)
{
    const struct view_light lamp = {.type = SCENE_LIGHT_POINT,
                                    .position = {1.6, 0.96, 0.72},
                                    .color = {1, 1, 1},
                                    .intensity = 8};
    struct rig_scene rig;
    open_sphere(&rig, *state, BENT);
    struct view view = look(&forms[0]);
    view.lights = &lamp;
    view.camera =
        (struct view_camera){.kind = VIEW_CAMERA_LOOK_AT, .eye = {-1, 0.5, 2.5}, .fov_y_deg = 45};
    struct image rays = shoot_color(*state, &rig, &view);
    view.quality.shadows = SHADOWS_MAP;
    view.quality.shadow_resolution = 2048;
    struct image map = shoot_color(*state, &rig, &view);
    double share = image_share_differing(&map, &rays, 0.01, 1);
    print_message("%.3f %% of pixels differ by more than 0.01\n", 100 * share);
    assert_true(share < 0.001);
    image_finish(&map);
    image_finish(&rays);
    rig_scene_finish(&rig, *state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_coarse_sphere_has_the_terminator_of_a_sphere),
        cmocka_unit_test(others_still_shadow_it),
        cmocka_unit_test(maps_agree_with_rays_on_a_bent_mesh),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
