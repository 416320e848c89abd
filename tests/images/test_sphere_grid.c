/* SPDX-License-Identifier: MIT */
/* The grid of spheres of Lexolights (Peciva) under a light that moves: in each frame shadow
 * volumes, silhouettes and grids of triangles leave the same pixels of the floor dark as the
 * ray-traced reference. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/shapes.h"
#include "tests/support/closed_form_internal.h"
#include "tests/support/image_checks.h"

enum { WIDTH_PX = 128, HEIGHT_PX = 96, FRAMES = 36, SIDE = 6, STACKS = 9 };

static void open_grid(struct renderer *renderer, struct closed_form_scene *scene,
                      struct rig_scene *rig)
{
    struct shape shape = {0};
    struct glb_builder *builder = closed_form_begin(scene, "Spheres", 0);
    int gray = glb_builder_add_material(
        builder, &(struct glb_material_desc){.base_color = {0.5, 0.5, 0.5, 1}, .roughness = 1});
    for (int i = 0; i < SIDE * SIDE; i++)
        shape_add_sphere(&shape,
                         (double[]){(i % SIDE) - 2.5, 0.6 + 0.1 * (i % 7), (i / SIDE) - 2.5}, 0.35,
                         2 * STACKS, STACKS);
    int mesh = shape_give_mesh(&shape, builder, "Spheres", gray);
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Spheres", .mesh = mesh});
    closed_form_quad(builder, "Floor", gray, (double[]){-9, 0, -9}, (double[]){0, 0, 18},
                     (double[]){18, 0, 0});
    closed_form_end(scene, builder);
    rig_scene_open(rig, renderer, "spheres", scene->glb, scene->size_bytes);
}

/* Around the grid, low and high; lamps and suns by turns. */
static struct view_light light_of(int frame)
{
    double turn = 6.283185307179586 * frame / FRAMES, height = 4 + 2 * sin(3 * turn);
    bool is_lamp = frame % 2;
    return (struct view_light){.type = is_lamp ? SCENE_LIGHT_POINT : SCENE_LIGHT_DIRECTIONAL,
                               .position = {3 * cos(turn), height, 3 * sin(turn)},
                               .direction = {-cos(turn), -height / 3, -sin(turn)},
                               .color = {1, 1, 1},
                               .intensity = is_lamp ? 200 : 3};
}

struct shot {
    unsigned char is_floor[WIDTH_PX * HEIGHT_PX], is_dark[WIDTH_PX * HEIGHT_PX];
};

static void shoot_frame(struct renderer *renderer, const struct rig_scene *rig, struct view view,
                        const struct view_quality *quality, struct shot *shot)
{
    struct frame frame;
    view.quality = *quality;
    view.quality.samples = 1;
    shoot(renderer, rig, &view, &frame);
    for (int i = 0; i < WIDTH_PX * HEIGHT_PX; i++) {
        double point[3];
        int x = i % WIDTH_PX, y = i / WIDTH_PX;
        bool is_below = view_meet_plane(&view, x, y, (double[]){0, 1, 0}, 0, point);
        const float *at = image_pixel_f32(&frame.outputs[VIEW_OUTPUT_POSITION], x, y);
        shot->is_floor[i] = is_below && fabsf(at[1]) < 1e-4f;
        shot->is_dark[i] = image_pixel_f32(&frame.outputs[VIEW_OUTPUT_COLOR], x, y)[1] < 1e-6f;
    }
    frame_finish(&frame);
}

struct tally {
    int compared, dark, differing, cracks;
};

/* A crack differs though all pixels around it are alike in the reference. */
static bool is_within(const struct shot *reference, int x, int y)
{
    int at = y * WIDTH_PX + x;
    for (int j = y - 1; j <= y + 1; j++)
        for (int i = x - 1; i <= x + 1; i++) {
            int k = j * WIDTH_PX + i;
            if (i < 0 || j < 0 || i >= WIDTH_PX || j >= HEIGHT_PX)
                continue;
            if (!reference->is_floor[k] || reference->is_dark[k] != reference->is_dark[at])
                return false;
        }
    return true;
}

static void compare(const struct shot *reference, const struct shot *found, struct tally *tally)
{
    for (int i = 0; i < WIDTH_PX * HEIGHT_PX; i++) {
        if (!reference->is_floor[i] || !found->is_floor[i])
            continue;
        tally->compared++;
        tally->dark += reference->is_dark[i];
        if (reference->is_dark[i] == found->is_dark[i])
            continue;
        tally->differing++;
        tally->cracks += is_within(reference, i % WIDTH_PX, i / WIDTH_PX);
    }
}

static void no_frame_of_the_animation_has_a_crack(void **state)
{
    enum { TECHNIQUES = 3 };
    static const enum shadow_technique techniques[TECHNIQUES] = {SHADOWS_VOLUME, SHADOWS_SILHOUETTE,
                                                                 SHADOWS_AREA};
    static struct shot reference, found;
    struct closed_form_scene scene;
    struct rig_scene rig;
    struct tally tallies[TECHNIQUES] = {{0}};
    open_grid(*state, &scene, &rig);
    for (int i = 0; i < FRAMES; i++) {
        struct view_light light = light_of(i);
        struct view view = {.width_px = WIDTH_PX,
                            .height_px = HEIGHT_PX,
                            .outputs = 1u << VIEW_OUTPUT_COLOR | 1u << VIEW_OUTPUT_POSITION,
                            .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                       .eye = {5 + 0.05 * i, 6, 6},
                                       .target = {0, 0, 0},
                                       .fov_y_deg = 50},
                            .lights = &light,
                            .light_count = 1,
                            .ignore_scene_lights = true};
        shoot_frame(*state, &rig, view, &(struct view_quality){.reference = true}, &reference);
        for (int k = 0; k < TECHNIQUES; k++) {
            shoot_frame(*state, &rig, view, &(struct view_quality){.shadows = techniques[k]},
                        &found);
            compare(&reference, &found, &tallies[k]);
        }
    }
    for (int k = 0; k < TECHNIQUES; k++) {
        const struct tally *t = &tallies[k];
        printf("%s: %d pixels, %d of them dark; %d differ, %d of them away from edges\n",
               shadow_technique_name((int)techniques[k]), t->compared, t->dark, t->differing,
               t->cracks);
        assert_true(t->compared > FRAMES * 3000 && t->dark > FRAMES * 500);
        assert_true(t->cracks == 0);
        assert_true(t->differing <= 1e-4 * t->compared);
    }
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(no_frame_of_the_animation_has_a_crack)};
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
