/* SPDX-License-Identifier: MIT */
/* The pictures by which Modisett 2023 ("Coloured shadow mapping") shows what techniques of coloured
 * shadows can and cannot, each against the reference: a window's picture on a wall, and the two
 * arrangements of panes that peeling cannot divide into partitions. A technique is wrong where the
 * report shows it, and nowhere else. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/shapes.h"
#include "tests/support/closed_form_scenes.h"
#include "tests/support/image_checks.h"

enum { SIDE_PX = 64, PIXELS = SIDE_PX * SIDE_PX };

struct picture {
    double rgb[PIXELS][3];
};

static void shoot_picture(struct renderer *renderer, const struct rig_scene *scene,
                          const struct view *view, struct picture *picture)
{
    struct image color = shoot_color(renderer, scene, view);
    for (int i = 0; i < PIXELS; i++)
        for (int k = 0; k < 3; k++)
            picture->rgb[i][k] = (double)image_pixel_f32(&color, i % SIDE_PX, i / SIDE_PX)[k];
    image_finish(&color);
}

/* ---- panes that peeling cannot divide ---- */

struct level_pane {
    double x[2], y; /* from x[0] to x[1] at the height y, |z| <= 1 */
    double color[4];
};

#define BLUE               \
    {                      \
        0.2, 0.3, 0.9, 0.5 \
    }
#define RED                \
    {                      \
        0.9, 0.2, 0.1, 0.5 \
    }

/* Of three panes the camera sees one blue pane, the red one and the other blue one, the sun both
 * blue ones first: layers peeled from the light cannot lie over one another in the picture. */
static const struct level_pane between[] = {
    {{-1.6, 0.55}, 2, BLUE}, {{-0.5, 0.5}, 1, RED}, {{0.6, 1.6}, 0, BLUE}};
/* Of two panes the camera sees both beside each other, and the sun one through the other: what is
 * peeled from the camera casts shadows within a layer. */
static const struct level_pane above[] = {{{-0.6, 0.6}, 2, RED}, {{-0.6, 0.6}, 0, BLUE}};

static const struct view_light sun = {
    .type = SCENE_LIGHT_DIRECTIONAL, .direction = {0, -1, 0}, .color = {1, 1, 1}, .intensity = 3};

static struct view view_of(enum shadow_technique shadows, bool is_reference)
{
    return (struct view){.width_px = SIDE_PX,
                         .height_px = SIDE_PX,
                         .outputs = 1u << VIEW_OUTPUT_COLOR,
                         .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                    .eye = {-5, 6.2, 0},
                                    .target = {0, 1, 0},
                                    .fov_y_deg = 30},
                         .lights = &sun,
                         .light_count = 1,
                         .quality = {.shadows = shadows,
                                     .samples = 1,
                                     .shadow_resolution = 1024,
                                     .reference = is_reference}};
}

static void open_panes(struct renderer *renderer, struct rig_scene *scene,
                       const struct level_pane *panes, int count, int left_out)
{
    struct error err = {0};
    void *glb = NULL;
    size_t size_bytes;
    struct glb_builder *builder = glb_builder_create("Panes", &err);
    assert_non_null(builder);
    for (int i = 0; i < count; i++) {
        const struct level_pane *pane = &panes[i];
        struct shape shape = {0};
        int material = glb_builder_add_material(
            builder, &(struct glb_material_desc){.base_color = {pane->color[0], pane->color[1],
                                                                pane->color[2], pane->color[3]},
                                                 .roughness = 1,
                                                 .alpha_mode = GLB_BLEND,
                                                 .is_double_sided = true});
        if (i == left_out)
            continue;
        shape_add_quad(&shape, (double[]){pane->x[0], pane->y, -1}, (double[]){0, 0, 2},
                       (double[]){pane->x[1] - pane->x[0], 0, 0});
        int mesh = shape_give_mesh(&shape, builder, "Pane", material);
        glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Pane", .mesh = mesh});
    }
    assert_true(glb_builder_finish(builder, &glb, &size_bytes, &err));
    glb_builder_destroy(builder);
    rig_scene_open(scene, renderer, left_out < 0 ? "panes" : "panes but one", glb, size_bytes);
    free(glb);
}

static double off_at(const struct picture *a, const struct picture *b, int pixel)
{
    double off = 0;
    for (int k = 0; k < 3; k++)
        off = fmax(off, fabs(a->rgb[pixel][k] - b->rgb[pixel][k]));
    return off;
}

struct wrong {
    int on, off; /* pixels that show the shadowed pane, and others, which are off by 0.01 */
    double mean; /* of the error, on the pane */
    int pane;    /* its pixels */
};

static struct wrong compare(const struct picture *found, const struct picture *truth,
                            const struct picture *without)
{
    struct wrong wrong = {0};
    for (int i = 0; i < PIXELS; i++) {
        bool shows = off_at(truth, without, i) > 1e-4;
        double off = off_at(found, truth, i);
        wrong.pane += shows;
        wrong.on += shows && off > 0.01;
        wrong.off += !shows && off > 0.01;
        wrong.mean += shows ? off : 0;
    }
    wrong.mean /= wrong.pane;
    return wrong;
}

/* The pane `shadowed` is the one that lies in the shadow of another. */
static void check_arrangement(struct renderer *renderer, const struct level_pane *panes, int count,
                              int shadowed)
{
    static const struct {
        enum shadow_technique shadows;
        double mean; /* of the error on the shadowed pane, at most; translucent: at least */
    } cases[] = {{SHADOWS_DEEP, 1e-3},
                 {SHADOWS_COMPOSITED, 1e-3},
                 {SHADOWS_MOMENTS, 5e-3},
                 {SHADOWS_COLORED_STOCHASTIC, 0.02},
                 {SHADOWS_TRANSLUCENT, 0.025}};
    static struct picture truth, without, found;
    struct rig_scene scene;
    struct view view = view_of(SHADOWS_RAYTRACED, true);
    open_panes(renderer, &scene, panes, count, shadowed);
    shoot_picture(renderer, &scene, &view, &without);
    rig_scene_finish(&scene, renderer);
    open_panes(renderer, &scene, panes, count, -1);
    shoot_picture(renderer, &scene, &view, &truth);
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        view = view_of(cases[c].shadows, false);
        shoot_picture(renderer, &scene, &view, &found);
        struct wrong wrong = compare(&found, &truth, &without);
        bool fails = cases[c].shadows == SHADOWS_TRANSLUCENT;
        print_message("%s: %d of %d pixels of the shadowed pane, mean %.5f; %d others\n",
                      shadow_technique_name((int)cases[c].shadows), wrong.on, wrong.pane,
                      wrong.mean, wrong.off);
        assert_true(wrong.pane > 200);
        assert_true(fails ? wrong.mean > cases[c].mean && wrong.on > 0.95 * wrong.pane
                          : wrong.mean < cases[c].mean);
        assert_int_equal(wrong.off, 0);
    }
    rig_scene_finish(&scene, renderer);
}

static void panes_that_light_peels_together_and_the_camera_apart(void **state)
{
    check_arrangement(*state, between, 3, 1);
}

static void panes_that_the_camera_peels_together_and_light_apart(void **state)
{
    check_arrangement(*state, above, 2, 1);
}

/* ---- the picture of a window ---- */

/* Sum of the squares of differences of neighbours: what is left of edges. */
static double gradient_energy(const struct picture *picture)
{
    double sum = 0;
    for (int i = 0; i < PIXELS - SIDE_PX; i++)
        for (int k = 0; k < 3 && i % SIDE_PX < SIDE_PX - 1; k++) {
            double across = picture->rgb[i + 1][k] - picture->rgb[i][k];
            double down = picture->rgb[i + SIDE_PX][k] - picture->rgb[i][k];
            sum += across * across + down * down;
        }
    return sum;
}

static double rmse(const struct picture *a, const struct picture *b)
{
    double sum = 0;
    for (int i = 0; i < PIXELS; i++)
        for (int k = 0; k < 3; k++)
            sum += (a->rgb[i][k] - b->rgb[i][k]) * (a->rgb[i][k] - b->rgb[i][k]);
    return sqrt(sum / (3 * PIXELS));
}

static struct view wall_by(enum shadow_technique shadows, int taps, bool is_reference)
{
    return (struct view){.width_px = SIDE_PX,
                         .height_px = SIDE_PX,
                         .outputs = 1u << VIEW_OUTPUT_COLOR,
                         .camera = {.kind = VIEW_CAMERA_NODE, .node = "Wall"},
                         .quality = {.shadows = shadows,
                                     .samples = 1,
                                     .shadow_taps = taps,
                                     .shadow_resolution = 1024,
                                     .reference = is_reference}};
}

/* Translucent and composited maps have the same picture, as the report says, and that of the
 * reference. What is left to chance is noisy without a wide filter, and smooth with one. */
static void a_windows_picture_keeps_its_edges_but_by_chance(void **state)
{
    static struct picture truth, translucent, composited, chance, smooth;
    struct renderer *renderer = *state;
    struct closed_form_scene window;
    struct rig_scene scene;
    struct view view = wall_by(SHADOWS_RAYTRACED, 0, true);
    projector_scene_build(&(struct projector_scene_desc){.cells = 16}, &window);
    rig_scene_open(&scene, renderer, "window", window.glb, window.size_bytes);
    shoot_picture(renderer, &scene, &view, &truth);
    view = wall_by(SHADOWS_TRANSLUCENT, 4, false);
    shoot_picture(renderer, &scene, &view, &translucent);
    view = wall_by(SHADOWS_COMPOSITED, 4, false);
    shoot_picture(renderer, &scene, &view, &composited);
    view = wall_by(SHADOWS_COLORED_STOCHASTIC, 1, false);
    shoot_picture(renderer, &scene, &view, &chance);
    view = wall_by(SHADOWS_COLORED_STOCHASTIC, 64, false);
    shoot_picture(renderer, &scene, &view, &smooth);
    double all = gradient_energy(&truth), kept = gradient_energy(&translucent) / all;
    double noisy = gradient_energy(&chance) / all, smoothed = gradient_energy(&smooth) / all;
    print_message("energy of edges: translucent %.3f, by chance %.3f with 1 tap, %.3f with 64; "
                  "rmse %.4f, %.4f, %.4f\n",
                  kept, noisy, smoothed, rmse(&translucent, &truth), rmse(&chance, &truth),
                  rmse(&smooth, &truth));
    assert_memory_equal(&translucent, &composited, sizeof translucent);
    assert_true(kept > 0.98 && kept < 1.02 && rmse(&translucent, &truth) < 1e-3);
    assert_true(noisy > 1.2 && smoothed < 0.8);
    rig_scene_finish(&scene, renderer);
    closed_form_scene_finish(&window);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(panes_that_light_peels_together_and_the_camera_apart),
        cmocka_unit_test(panes_that_the_camera_peels_together_and_light_apart),
        cmocka_unit_test(a_windows_picture_keeps_its_edges_but_by_chance),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
