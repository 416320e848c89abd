/* SPDX-License-Identifier: MIT */
/* Lights where they should not be: inside casters, on the planes of triangles, a millimetre above a
 * floor, grazing it, infinitely far away. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "glb/shapes.h"
#include "tests/support/extreme_checks.h"
#include "tests/support/image_checks.h"

enum { SIDE_PX = 96 };
static const double degree = 0.017453292519943295;

static const struct technique {
    const char *name;
    enum shadow_technique shadows;
} techniques[] = {
    {"deep", SHADOWS_DEEP},
    {"deep-linked", SHADOWS_DEEP_LINKED},
    {"raytraced", SHADOWS_RAYTRACED},
};
enum { TECHNIQUES = sizeof techniques / sizeof *techniques };

/* A white floor of 8 m, and one shape of an opaque or glass material over it. */
static void open_floor(struct rig_scene *scene, struct renderer *renderer, struct shape *over,
                       double transmission)
{
    struct error err = {0};
    struct glb_builder *b = glb_builder_create("Lights", &err);
    struct shape floor = {0};
    void *bytes;
    size_t size;
    shape_add_quad(&floor, (double[]){-4, 0, 4}, (double[]){8, 0, 0}, (double[]){0, 0, -8});
    struct glb_material_desc white = {
        .base_color = {0.8, 0.8, 0.8, 1}, .roughness = 1, .is_double_sided = true};
    struct glb_material_desc caster = {.base_color = {0.5, 0.25, 1, 1},
                                       .transmission = transmission,
                                       .roughness = 1,
                                       .is_double_sided = true};
    int floor_mesh = shape_give_mesh(&floor, b, "Floor", glb_builder_add_material(b, &white));
    glb_builder_add_node(b, &(struct glb_node_desc){.name = "Floor", .mesh = floor_mesh});
    if (over) {
        int mesh = shape_give_mesh(over, b, "Over", glb_builder_add_material(b, &caster));
        glb_builder_add_node(b, &(struct glb_node_desc){.name = "Over", .mesh = mesh});
    }
    if (!glb_builder_finish(b, &bytes, &size, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(b);
    rig_scene_open(scene, renderer, "lights", bytes, size);
    free(bytes);
}

/* The floor from above, over |x|, |z| < 1.6, nothing else. */
static struct view floor_view(const struct view_light *light)
{
    return (struct view){
        .width_px = SIDE_PX,
        .height_px = SIDE_PX,
        .lights = light,
        .light_count = 1,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                   .eye = {0, 4, 0},
                   .up = {0, 0, -1},
                   .fov_y_deg = 43.6},
        /* the pane is rough, and what blurs behind it is no matter of lights */
        .quality = {.samples = 1, .shadow_resolution = 512, .refraction = VIEW_REFRACTION_OFF}};
}

struct comparison { /* pixels whose ratio to the unshadowed picture is not the expected one */
    double share, worst;
};

static struct comparison compare_with_open(struct renderer *renderer, const struct rig_scene *scene,
                                           const struct view *view, enum shadow_technique shadows,
                                           const double expected[3])
{
    struct view shadowed = *view;
    shadowed.quality.shadows = SHADOWS_NONE;
    struct image open = shoot_color(renderer, scene, &shadowed);
    shadowed.quality.shadows = shadows;
    struct image lit = shoot_color(renderer, scene, &shadowed);
    assert_image_is_sound(&lit, 1e30);
    struct comparison result = {0};
    long compared = 0, differing = 0;
    for (int y = 0; y < SIDE_PX; y++) {
        for (int x = 0; x < SIDE_PX; x++) {
            const float *p = image_pixel_f32(&lit, x, y), *q = image_pixel_f32(&open, x, y);
            double error = 0;
            for (int k = 0; k < 3; k++)
                if (q[k] > 0)
                    error = fmax(error, fabs((double)p[k] / (double)q[k] - expected[k]));
            compared += q[0] > 0;
            differing += error > 1e-3; /* two renderers' shading of one point is nearer than that */
            result.worst = fmax(result.worst, error);
        }
    }
    assert_true(compared > SIDE_PX * SIDE_PX / 3);
    result.share = (double)differing / (double)compared;
    image_finish(&lit);
    image_finish(&open);
    return result;
}

static const struct view_light bulb = {
    .type = SCENE_LIGHT_POINT, .color = {1, 1, 1}, .intensity = 10};
static const double all[3] = {1, 1, 1};

/* The camera looks through the box, too, but the ratio of two pictures of it does not. */
static void a_light_inside_a_caster_shines_through_each_wall_once(void **state)
{
    for (int is_glass = 0; is_glass < 2; is_glass++) {
        static const double glass[3] = {0.5, 0.25, 1}, none[3] = {0, 0, 0};
        struct rig_scene scene;
        struct shape box = {0};
        struct view_light light = bulb;
        light.position[0] = 2.5;
        light.position[1] = 1.1;
        light.position[2] = 0.3;
        shape_add_box(&box, (double[]){2.2, 0.9, 0}, (double[]){2.9, 1.4, 0.8});
        open_floor(&scene, *state, &box, is_glass);
        struct view view = floor_view(&light);
        for (int t = 0; t < TECHNIQUES; t++) {
            struct comparison c = compare_with_open(*state, &scene, &view, techniques[t].shadows,
                                                    is_glass ? glass : none);
            extreme_expect(&(struct extreme_row){is_glass ? "a light inside a box of glass"
                                                          : "a light inside an opaque box",
                                                 techniques[t].name, "share of pixels off by 1e-3",
                                                 0},
                           c.share);
        }
        rig_scene_finish(&scene, *state);
    }
}

/* A wall through the light casts nothing but the line where it stands. */
static void a_light_on_the_plane_of_a_wall_passes_on_both_sides(void **state)
{
    for (int is_glass = 0; is_glass < 2; is_glass++) {
        for (int is_inside = 0; is_inside < 2; is_inside++) {
            struct rig_scene scene;
            struct shape wall = {0};
            struct view_light light = bulb;
            light.position[1] = is_inside ? 0.8 : 2;
            shape_add_quad(&wall, (double[]){0, 0.5, 1}, (double[]){0, 0, -2}, (double[]){0, 1, 0});
            open_floor(&scene, *state, &wall, is_glass);
            struct view view = floor_view(&light);
            for (int t = 0; t < TECHNIQUES; t++) {
                struct comparison c =
                    compare_with_open(*state, &scene, &view, techniques[t].shadows, all);
                char name[64];
                snprintf(name, sizeof name, "a light on the plane of %s wall, %s it",
                         is_glass ? "a glass" : "an opaque", is_inside ? "touching" : "above");
                extreme_expect(&(struct extreme_row){name, techniques[t].name,
                                                     "share of pixels off by 1e-3", 0.011},
                               c.share); /* a column of 96: the line itself */
            }
            rig_scene_finish(&scene, *state);
        }
    }
}

/* A millimetre over the floor, and farther out at 89.9 degrees and more: the floor never shadows
 * itself. */
static void light_that_grazes_a_floor_leaves_no_acne(void **state)
{
    static const double angles[] = {89, 89.9, 89.99, 89.999};
    struct rig_scene scene;
    open_floor(&scene, *state, NULL, 0);
    for (int t = 0; t < TECHNIQUES; t++) {
        struct view_light light = bulb;
        light.position[1] = 1e-3;
        struct view view = floor_view(&light);
        struct comparison c = compare_with_open(*state, &scene, &view, techniques[t].shadows, all);
        extreme_expect(&(struct extreme_row){"a light 1 mm over a floor", techniques[t].name,
                                             "share of pixels off by 1e-3", 0},
                       c.share);
        for (size_t i = 0; i < sizeof angles / sizeof *angles; i++) {
            char name[64];
            struct view_light sun = {
                .type = SCENE_LIGHT_DIRECTIONAL,
                .direction = {sin(angles[i] * degree), -cos(angles[i] * degree), 0.1},
                .color = {1, 1, 1},
                .intensity = 1000};
            view = floor_view(&sun);
            c = compare_with_open(*state, &scene, &view, techniques[t].shadows, all);
            snprintf(name, sizeof name, "a sun at %g degrees on a floor", angles[i]);
            extreme_expect(
                &(struct extreme_row){name, techniques[t].name, "share of pixels off by 1e-3", 0},
                c.share);
        }
    }
    rig_scene_finish(&scene, *state);
}

static struct view_light star_at(double distance)
{
    const double l[3] = {-0.3, 0.93, 0.2};
    struct view_light star = {.type = SCENE_LIGHT_POINT, .color = {1, 1, 1}};
    double squared = 0;
    for (int k = 0; k < 3; k++) {
        star.position[k] = l[k] * distance;
        star.direction[k] = -l[k];
        squared += star.position[k] * star.position[k];
    }
    star.intensity = (float)squared; /* 1 lx on the floor's middle */
    return star;
}

/* A point light so far away that its rays are parallel is the directional light that it is then;
 * on the way there it keeps its resolution for what casts. */
static void a_light_at_infinity_is_a_directional_one(void **state)
{
    static const struct {
        double distance, tolerance; /* to the directional light: 4 m / distance, and its edges */
    } steps[] = {{1e2, 0.05}, {1e4, 5e-4}, {1e6, 1e-5}, {1e9, 1e-5}};
    struct rig_scene scene;
    struct shape pane = {0};
    shape_add_quad(&pane, (double[]){-0.7, 1, 0.8}, (double[]){1.3, 0.2, 0},
                   (double[]){0, 0.3, -1.4});
    open_floor(&scene, *state, &pane, 1);
    for (int t = 0; t < TECHNIQUES; t++) {
        struct view_light light = star_at(1);
        light.type = SCENE_LIGHT_DIRECTIONAL;
        light.intensity = 1;
        struct view view = floor_view(&light);
        view.quality.shadows = techniques[t].shadows;
        struct image sun = shoot_color(*state, &scene, &view);
        for (size_t i = 0; i < sizeof steps / sizeof *steps; i++) {
            char name[64];
            light = star_at(steps[i].distance);
            struct image star = shoot_color(*state, &scene, &view);
            snprintf(name, sizeof name, "a lamp %g m away against a sun", steps[i].distance);
            extreme_expect(&(struct extreme_row){name, techniques[t].name, "RMSE, relative",
                                                 steps[i].tolerance},
                           extreme_rmse(&star, &sun));
            view.quality.shadows = SHADOWS_RAYTRACED;
            struct image truth = shoot_color(*state, &scene, &view);
            view.quality.shadows = techniques[t].shadows;
            snprintf(name, sizeof name, "a lamp %g m away against ray tracing", steps[i].distance);
            extreme_expect(&(struct extreme_row){name, techniques[t].name, "RMSE, relative", 0.02},
                           extreme_rmse(&star, &truth));
            image_finish(&truth);
            image_finish(&star);
        }
        image_finish(&sun);
    }
    rig_scene_finish(&scene, *state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_light_inside_a_caster_shines_through_each_wall_once),
        cmocka_unit_test(a_light_on_the_plane_of_a_wall_passes_on_both_sides),
        cmocka_unit_test(light_that_grazes_a_floor_leaves_no_acne),
        cmocka_unit_test(a_light_at_infinity_is_a_directional_one),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
