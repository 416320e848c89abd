/* SPDX-License-Identifier: MIT */
/* The pictures by which Modisett 2023 ("Coloured shadow mapping") shows what techniques of coloured
 * shadows can and cannot, each against the reference: a window's picture on a wall, the two
 * arrangements of panes that peeling cannot divide into partitions, squares over a vase, and pots
 * behind a plane. A technique is wrong where the report shows it, and nowhere else. */
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

/* ---- squares over a vase, and pots behind a plane ---- */

static const struct view_light slanted_sun = {.type = SCENE_LIGHT_DIRECTIONAL,
                                              .direction = {0.35, -1, 0.2},
                                              .color = {1, 1, 1},
                                              .intensity = 3};

static const double vase_profile[][2] = {{0, 0},      {0.28, 0},  {0.42, 0.2},
                                         {0.36, 0.5}, {0.2, 0.7}, {0.26, 0.85}};
enum { VASE_POINTS = sizeof vase_profile / sizeof *vase_profile };

static void add_part(struct glb_builder *builder, struct shape *shape, const double color[4])
{
    int material = glb_builder_add_material(
        builder, &(struct glb_material_desc){.base_color = {color[0], color[1], color[2], color[3]},
                                             .roughness = 1,
                                             .alpha_mode = color[3] < 1 ? GLB_BLEND : GLB_OPAQUE,
                                             .is_double_sided = true});
    int mesh = shape_give_mesh(shape, builder, "Part", material);
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Part", .mesh = mesh});
}

static void add_vase(struct glb_builder *builder, const double origin[3], const double color[4])
{
    struct shape shape = {0};
    shape_set_place(&shape, origin, NULL, NULL);
    shape_add_lathe(&shape, &(struct shape_lathe_desc){
                                .profile = vase_profile, .count = VASE_POINTS, .slices = 48});
    add_part(builder, &shape, color);
}

static void add_square(struct glb_builder *builder, const double corner[3], const double sides[2],
                       const double color[4])
{
    struct shape shape = {0};
    shape_add_quad(&shape, corner, (double[]){0, 0, sides[1]}, (double[]){sides[0], 0, 0});
    add_part(builder, &shape, color);
}

static const double white[4] = {0.8, 0.8, 0.8, 1}, red[4] = {0.9, 0.15, 0.1, 0.5},
                    green[4] = {0.1, 0.8, 0.2, 0.5}, blue[4] = {0.15, 0.2, 0.9, 0.5},
                    pale[4] = {0.8, 0.8, 0.8, 0.5};

/* An opaque vase under three squares that overlap (the report's figure 2.1.3, with a teapot). */
static void build_squares(struct glb_builder *builder, bool is_whole)
{
    add_square(builder, (double[]){-3, 0, -3}, (double[]){6, 6}, white);
    add_vase(builder, (double[]){0.2, 0.01, 0.1}, white);
    if (!is_whole)
        return;
    add_square(builder, (double[]){-0.9, 1.1, -0.7}, (double[]){1.1, 1.1}, blue);
    add_square(builder, (double[]){-0.4, 1.4, -0.3}, (double[]){1.1, 1.1}, red);
    add_square(builder, (double[]){-0.7, 1.7, -0.1}, (double[]){1.1, 1.1}, green);
}

/* Pots that let light through, two of them behind a green plane (figure 4.2.1.A). */
static void build_pots(struct glb_builder *builder, bool is_whole)
{
    add_square(builder, (double[]){-3, 0, -3}, (double[]){6, 6}, white);
    if (!is_whole)
        return;
    add_vase(builder, (double[]){0, 0.01, -1.1}, red);
    add_vase(builder, (double[]){0, 0.01, 0}, pale);
    add_vase(builder, (double[]){0, 0.01, 1.1}, blue);
    add_square(builder, (double[]){-1.2, 1.3, -1.8}, (double[]){1.6, 2.2}, green);
}

static void open_built(struct renderer *renderer, struct rig_scene *scene, const char *name,
                       void (*build)(struct glb_builder *builder, bool is_whole), bool is_whole)
{
    struct error err = {0};
    void *glb = NULL;
    size_t size_bytes;
    struct glb_builder *builder = glb_builder_create(name, &err);
    assert_non_null(builder);
    build(builder, is_whole);
    assert_true(glb_builder_finish(builder, &glb, &size_bytes, &err));
    glb_builder_destroy(builder);
    rig_scene_open(scene, renderer, is_whole ? name : "opaque parts", glb, size_bytes);
    free(glb);
}

static struct view view_of_vases(enum shadow_technique shadows, bool is_reference)
{
    struct view view = view_of(shadows, is_reference);
    view.camera = (struct view_camera){
        .kind = VIEW_CAMERA_LOOK_AT, .eye = {-4, 3.2, 1}, .target = {0, 0.6, 0}, .fov_y_deg = 40};
    view.lights = &slanted_sun;
    return view;
}

struct expectation {
    enum shadow_technique shadows;
    double opaque, layers; /* mean errors, at most; where the technique fails, at least */
    bool fails_on_opaque, fails_on_layers;
};

/* Mean errors where the camera sees the opaque parts alone, and where layers are before them. */
static void check_built(struct renderer *renderer, const char *name,
                        void (*build)(struct glb_builder *builder, bool is_whole),
                        const struct expectation *cases, size_t count)
{
    static struct picture truth, bare, bare_whole, found;
    struct rig_scene scene;
    struct view plain = view_of_vases(SHADOWS_NONE, false);
    struct view view = view_of_vases(SHADOWS_RAYTRACED, true);
    open_built(renderer, &scene, name, build, false);
    shoot_picture(renderer, &scene, &plain, &bare);
    rig_scene_finish(&scene, renderer);
    open_built(renderer, &scene, name, build, true);
    shoot_picture(renderer, &scene, &plain, &bare_whole);
    shoot_picture(renderer, &scene, &view, &truth);
    for (size_t c = 0; c < count; c++) {
        double sums[2] = {0};
        int pixels[2] = {0};
        view = view_of_vases(cases[c].shadows, false);
        shoot_picture(renderer, &scene, &view, &found);
        for (int i = 0; i < PIXELS; i++) {
            bool is_layered = off_at(&bare, &bare_whole, i) > 1e-4;
            sums[is_layered] += off_at(&found, &truth, i);
            pixels[is_layered]++;
        }
        double opaque = sums[0] / pixels[0], layers = sums[1] / pixels[1];
        print_message("%s, %s: mean error %.5f on %d opaque pixels, %.5f on %d of layers\n", name,
                      shadow_technique_name((int)cases[c].shadows), opaque, pixels[0], layers,
                      pixels[1]);
        assert_true(pixels[0] > 500 && pixels[1] > 500);
        assert_true((opaque > cases[c].opaque) == cases[c].fails_on_opaque);
        assert_true((layers > cases[c].layers) == cases[c].fails_on_layers);
    }
    rig_scene_finish(&scene, renderer);
}

/* What is opaque lies behind all squares, so the sum of all is right there. Only `translucent` dims
 * a square by those below it; maps and grey chance have no colours. */
static void squares_colour_a_vase_in_every_order(void **state)
{
    static const struct expectation cases[] = {
        {SHADOWS_RAYTRACED_SHADOWS, 1e-4, 1e-4, false, false},
        {SHADOWS_DEEP, 5e-4, 1e-3, false, false},
        {SHADOWS_COMPOSITED, 5e-4, 1e-3, false, false},
        {SHADOWS_VOLUME, 1e-4, 7e-4, false, false},
        {SHADOWS_MOMENTS, 5e-4, 7.5e-3, false, false},
        {SHADOWS_COLORED_STOCHASTIC, 8e-3, 0.011, false, false},
        {SHADOWS_TRANSLUCENT, 5e-4, 0.01, false, true},
        {SHADOWS_STOCHASTIC, 7e-3, 0.012, true, true},
        {SHADOWS_MAP, 0.03, 0.07, true, true},
    };
    check_built(*state, "squares", build_squares, cases, sizeof cases / sizeof *cases);
}

/* A pot shadows itself, too: composited maps hold one mesh as a whole, and moments tell no more
 * than two surfaces apart. */
static void pots_behind_a_plane_are_lit_through_it(void **state)
{
    static const struct expectation cases[] = {
        {SHADOWS_RAYTRACED_SHADOWS, 1e-4, 1e-4, false, false},
        {SHADOWS_DEEP, 1e-3, 1e-3, false, false},
        {SHADOWS_VOLUME, 1e-4, 1e-4, false, false},
        {SHADOWS_COLORED_STOCHASTIC, 0.01, 0.01, false, false},
        {SHADOWS_MOMENTS, 1e-3, 8e-3, false, true},
        {SHADOWS_COMPOSITED, 1e-3, 8e-3, false, true},
        {SHADOWS_TRANSLUCENT, 1e-3, 0.015, false, true},
        {SHADOWS_STOCHASTIC, 8e-3, 0.012, true, true},
        {SHADOWS_MAP, 0.04, 0.07, true, true},
    };
    check_built(*state, "pots", build_pots, cases, sizeof cases / sizeof *cases);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(panes_that_light_peels_together_and_the_camera_apart),
        cmocka_unit_test(panes_that_the_camera_peels_together_and_light_apart),
        cmocka_unit_test(a_windows_picture_keeps_its_edges_but_by_chance),
        cmocka_unit_test(squares_colour_a_vase_in_every_order),
        cmocka_unit_test(pots_behind_a_plane_are_lit_through_it),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
