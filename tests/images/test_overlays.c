/* SPDX-License-Identifier: MIT */
/* Outlines of selected nodes and feature edges over pictures: which pixels they cover and how much,
 * against distances to projected edges; hidden parts; cut parts; the same over traced pictures. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/closed_form_internal.h"
#include "tests/support/closed_form_media.h"
#include "tests/support/image_checks.h"

enum { WIDTH_PX = 160, HEIGHT_PX = 120 };

static const struct closed_form_light sun = {
    .type = GLB_LIGHT_DIRECTIONAL, .direction = {0, -1, 0}, .color = {1, 1, 1}, .intensity = 3};
/* A box, one behind it, and a ball. */
static const struct closed_form_body bodies[] = {
    {.low = {-0.5, -0.5, -0.5}, .high = {0.5, 0.5, 0.5}},
    {.low = {0.2, -0.25, -2}, .high = {1.2, 0.25, -1}},
    {.shape = BODY_SPHERE, .low = {-2.3, -0.6, -0.6}, .high = {-1.1, 0.6, 0.6}},
};

static void open_bodies(struct rig_scene *rig, struct renderer *renderer,
                        const struct closed_form_body *list, int count)
{
    struct closed_form_scene scene;
    media_scene_build(&(struct media_scene_desc){.bodies = list, .count = count, .light = sun},
                      &scene);
    rig_scene_open(rig, renderer, "overlays", scene.glb, scene.size_bytes);
    closed_form_scene_finish(&scene);
}

static struct view look(const double eye[3], double ortho_height)
{
    struct view view = {
        .width_px = WIDTH_PX,
        .height_px = HEIGHT_PX,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .fov_y_deg = 50, .ortho_height = ortho_height},
        .background = {0.2f, 0.2f, 0.2f, 1},
        .quality = {.samples = 4, .shadows = SHADOWS_NONE},
    };
    memcpy(view.camera.eye, eye, sizeof view.camera.eye);
    return view;
}

static const float bright[3] = {0, 1000, 0};

/* How opaque the overlay is at each pixel, by the colour with and without it. */
static double *alphas(struct renderer *renderer, const struct rig_scene *rig,
                      const struct view *view, const char *name)
{
    struct view bare = *view;
    bare.highlight = (struct view_highlight){0};
    bare.edges = (struct view_edges){0};
    struct image with = shoot_color(renderer, rig, view);
    struct image without = shoot_color(renderer, rig, &bare);
    double *alpha = calloc(WIDTH_PX * HEIGHT_PX, sizeof *alpha);
    assert_non_null(alpha);
    for (int i = 0; i < WIDTH_PX * HEIGHT_PX; i++) {
        double a = (double)((const float *)with.pixels)[4 * i + 1];
        double b = (double)((const float *)without.pixels)[4 * i + 1];
        alpha[i] = (a - b) / (1000 - b);
    }
    save_picture(&with, name);
    image_finish(&with);
    image_finish(&without);
    return alpha;
}

static double distance_to_segment(const double p[2], const double a[2], const double b[2])
{
    double way[2] = {b[0] - a[0], b[1] - a[1]};
    double t =
        ((p[0] - a[0]) * way[0] + (p[1] - a[1]) * way[1]) / (way[0] * way[0] + way[1] * way[1]);
    t = fmax(0, fmin(1, t));
    return hypot(p[0] - a[0] - t * way[0], p[1] - a[1] - t * way[1]);
}

/* -- outlines -- */

/* Of the node of a body, by its index in the file. */
static char body_name[16];
static const char *const selected[] = {body_name};

static void select_body(const struct rig_scene *rig, int body)
{
    const struct scene *scene = &rig->imported.scene;
    for (uint32_t i = 0; i < scene->node_count; i++)
        if (scene->nodes[i].mesh >= 0 && body-- == 0)
            snprintf(body_name, sizeof body_name, "#%u", i);
}

static struct view_highlight outline(float width_px)
{
    struct view_highlight highlight = {
        .nodes = selected, .node_count = 1, .width_px = width_px, .hidden = 0.25f};
    memcpy(highlight.color, bright, sizeof bright);
    return highlight;
}

/* The box seen straight from the front is a square. */
static void an_outline_has_its_width_around_a_square(void **state)
{
    struct rig_scene rig;
    open_bodies(&rig, *state, bodies, 1);
    struct view view = look((double[]){0.013, 0.021, 5}, 3);
    select_body(&rig, 0);
    view.camera.target[0] = 0.013;
    view.camera.target[1] = 0.021;
    for (int width = 1; width <= 6; width += 2) {
        view.highlight = outline((float)width);
        double *alpha = alphas(*state, &rig, &view, "overlay_square");
        double corners[2][2], worst = 0, sum = 0;
        assert_true(view_project(&view, (double[]){-0.5, 0.5, 0}, corners[0]));
        assert_true(view_project(&view, (double[]){0.5, -0.5, 0}, corners[1]));
        for (int y = 0; y < HEIGHT_PX; y++)
            for (int x = 0; x < WIDTH_PX; x++) {
                double dx = fmax(corners[0][0] - x - 0.5, x + 0.5 - corners[1][0]);
                double dy = fmax(corners[0][1] - y - 0.5, y + 0.5 - corners[1][1]);
                double distance = dx > 0 && dy > 0 ? hypot(dx, dy) : fmax(dx, dy);
                double expected =
                    fmax(0, fmin(1, width + 0.5 - distance)) * fmax(0, fmin(1, distance + 0.5));
                bool is_corner = dx > -1.5 && dy > -1.5; /* coverage does not tell its place */
                if (!is_corner)
                    worst = fmax(worst, fabs(alpha[y * WIDTH_PX + x] - expected));
                sum += alpha[y * WIDTH_PX + x];
            }
        double side = corners[1][0] - corners[0][0];
        double area = 4 * side * width + M_PI * width * width;
        print_message("width %d: worst %.3f, area %.1f of %.1f\n", width, worst, sum, area);
        assert_true(worst < 0.13); /* along an axis four samples tell a quarter of a pixel */
        assert_true(fabs(sum - area) < 0.02 * area);
        free(alpha);
    }
    rig_scene_finish(&rig, *state);
}

static double largest(const double *alpha, const double low[2], const double high[2])
{
    double most = 0;
    for (int y = (int)low[1]; y <= (int)high[1]; y++)
        for (int x = (int)low[0]; x <= (int)high[0]; x++)
            most = fmax(most, alpha[y * WIDTH_PX + x]);
    return most;
}

/* The box behind is hidden to x = 0.5 where the front one is. */
static void what_is_hidden_is_dimmed(void **state)
{
    struct rig_scene rig;
    open_bodies(&rig, *state, bodies, 3);
    struct view view = look((double[]){0, 0, 5}, 3);
    select_body(&rig, 1);
    view.highlight = outline(2);
    for (int is_traced = 0; is_traced < 2; is_traced++) {
        view.quality.shadows = is_traced ? SHADOWS_RAYTRACED : SHADOWS_NONE;
        double *alpha = alphas(*state, &rig, &view, "overlay_hidden"), at[2];
        assert_true(view_project(&view, (double[]){0.2, 0, 0}, at));
        double hidden =
            largest(alpha, (double[]){at[0] - 3, at[1] - 5}, (double[]){at[0] + 1, at[1] + 5});
        assert_true(view_project(&view, (double[]){1.2, 0, 0}, at));
        double seen =
            largest(alpha, (double[]){at[0] - 1, at[1] - 5}, (double[]){at[0] + 3, at[1] + 5});
        print_message("hidden %.3f, seen %.3f\n", hidden, seen);
        assert_true(fabs(hidden - 0.25) < 1e-3 && fabs(seen - 1) < 1e-3);
        free(alpha);
    }
    rig_scene_finish(&rig, *state);
}

static void unknown_nodes_are_refused(void **state)
{
    struct rig_scene rig;
    struct frame frame;
    struct error err = {0};
    open_bodies(&rig, *state, bodies, 1);
    struct view view = look((double[]){0, 0, 5}, 3);
    snprintf(body_name, sizeof body_name, "Nobody");
    view.highlight = outline(2);
    assert_false(renderer_render(*state, rig.key, &view, &frame, &err));
    assert_int_equal(err.code, ERROR_NOT_FOUND);
    assert_non_null(strstr(err.message, "Nobody"));
    rig_scene_finish(&rig, *state);
}

/* -- edges -- */

static struct view_edges lines(float width_px)
{
    struct view_edges edges = {.is_drawn = true, .crease_deg = 30, .width_px = width_px};
    memcpy(edges.color, bright, sizeof bright);
    return edges;
}

/* Edge e of the unit box runs along axis e / 4; whether one of its two faces looks to the eye. */
static bool box_edge(int e, const double eye[3], double ends[2][3])
{
    int axis = e / 4;
    bool is_seen = false;
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 3; k++)
            ends[i][k] = k == axis ? i - 0.5 : (e >> ((k - axis + 3) % 3 - 1) & 1) - 0.5;
    for (int k = 0; k < 3; k++)
        is_seen |= k != axis && eye[k] * ends[0][k] > 0 && fabs(eye[k]) > 0.5;
    return is_seen;
}

static double expected_lines(const struct view *view, const double p[2], bool of_hidden)
{
    double most = 0;
    for (int e = 0; e < 12; e++) {
        double ends[2][3], pixel[2][2];
        if (box_edge(e, view->camera.eye, ends) == of_hidden)
            continue;
        for (int i = 0; i < 2; i++)
            assert_true(view_project(view, ends[i], pixel[i]));
        double reach = 0.5 * (double)view->edges.width_px + 0.5;
        double a = fmax(0, fmin(1, reach - distance_to_segment(p, pixel[0], pixel[1])));
        most = fmax(most, a * fmin(1, (double)view->edges.width_px));
    }
    return most;
}

/* All creases of a box, nine of them seen, from any side. */
static void edges_of_a_box_are_drawn_where_they_are(void **state)
{
    static const double eyes[][3] = {{2.1, 1.3, 3.2}, {-3, 0.9, 1.7}, {1.1, -2.6, 2}};
    struct rig_scene rig;
    open_bodies(&rig, *state, bodies, 1);
    for (int i = 0; i < 6; i++) {
        struct view view = look(eyes[i % 3], i < 3 ? 0 : 2.5);
        view.edges = lines(i % 2 ? 1 : 2.5f);
        view.edges.hidden = i % 3 == 1 ? 0.5f : 0;
        double *alpha = alphas(*state, &rig, &view, "overlay_box");
        double worst = 0;
        int differing = 0, drawn = 0;
        for (int y = 0; y < HEIGHT_PX; y++)
            for (int x = 0; x < WIDTH_PX; x++) {
                double p[2] = {x + 0.5, y + 0.5};
                double seen = expected_lines(&view, p, false);
                double hidden = (double)view.edges.hidden * expected_lines(&view, p, true);
                double expected = 1 - (1 - seen) * (1 - hidden);
                double error = fabs(alpha[y * WIDTH_PX + x] - expected);
                differing += error > 0.01;
                drawn += expected > 0;
                worst = fmax(worst, error);
            }
        print_message("view %d: %d pixels, %d differ, worst %.3f\n", i, drawn, differing, worst);
        assert_true(drawn > 300 && differing <= 12); /* where a hidden edge meets a seen one */
        free(alpha);
    }
    rig_scene_finish(&rig, *state);
}

static int count_drawn(const double *alpha)
{
    int count = 0;
    for (int i = 0; i < WIDTH_PX * HEIGHT_PX; i++)
        count += alpha[i] > 0.01;
    return count;
}

/* Facets of 2.8 degrees are no creases: a ball has its outline alone. */
static void a_ball_has_an_outline_and_no_creases(void **state)
{
    struct closed_form_body ball = {
        .shape = BODY_SPHERE, .low = {-0.6, -0.6, -0.6}, .high = {0.6, 0.6, 0.6}};
    struct rig_scene rig;
    open_bodies(&rig, *state, &ball, 1);
    struct view view = look((double[]){0.7, 0.4, 5}, 2);
    view.edges = lines(2);
    double *alpha = alphas(*state, &rig, &view, "overlay_ball"), sum = 0;
    double radius = 0.6 / 2 * HEIGHT_PX, farthest = 0;
    for (int y = 0; y < HEIGHT_PX; y++)
        for (int x = 0; x < WIDTH_PX; x++) {
            double a = alpha[y * WIDTH_PX + x];
            double from = hypot(x + 0.5 - 0.5 * WIDTH_PX, y + 0.5 - 0.5 * HEIGHT_PX);
            farthest = a > 0.01 ? fmax(farthest, fabs(from - radius)) : farthest;
            sum += a;
        }
    double area = 2 * M_PI * radius * 2;
    print_message("ring: %.1f of %.1f, at most %.2f px off\n", sum, area, farthest);
    assert_true(fabs(sum - area) < 0.06 * area && farthest < 2.6);
    free(alpha);
    view.edges.omits_silhouettes = true;
    alpha = alphas(*state, &rig, &view, "overlay_ball_bare");
    assert_int_equal(count_drawn(alpha), 0);
    free(alpha);
    view.edges.crease_deg = 1; /* now all its facets are creases */
    alpha = alphas(*state, &rig, &view, "overlay_ball_facets");
    print_message("facets: %d pixels\n", count_drawn(alpha));
    assert_true(count_drawn(alpha) > 3000);
    free(alpha);
    rig_scene_finish(&rig, *state);
}

/* What a plane takes away has no edges, and an open sheet has its border. */
static void edges_end_at_clip_planes_and_sheets_have_borders(void **state)
{
    static const double half[1][4] = {{1, 0, 0, 0}};
    struct rig_scene rig;
    open_bodies(&rig, *state, bodies, 1);
    struct view view = look((double[]){2.1, 1.3, 3.2}, 2.5);
    view.edges = lines(1);
    view.clip_planes = half;
    view.clip_plane_count = 1;
    double *alpha = alphas(*state, &rig, &view, "overlay_cut"), at[2];
    assert_true(view_project(&view, (double[]){-0.25, -0.5, 0.5}, at));
    assert_true(largest(alpha, (double[]){at[0] - 2, at[1] - 2}, (double[]){at[0] + 2, at[1] + 2}) <
                0.01);
    assert_true(view_project(&view, (double[]){0.25, -0.5, 0.5}, at));
    assert_true(largest(alpha, (double[]){at[0] - 2, at[1] - 2}, (double[]){at[0] + 2, at[1] + 2}) >
                0.5);
    free(alpha);
    rig_scene_finish(&rig, *state);
    struct closed_form_scene scene;
    media_scene_build(
        &(struct media_scene_desc){
            .bodies = bodies, .has_floor = true, .floor_half = 0.7, .light = sun},
        &scene);
    rig_scene_open(&rig, *state, "sheet", scene.glb, scene.size_bytes);
    closed_form_scene_finish(&scene);
    view = look((double[]){0, 4, 0.01}, 2);
    view.edges = lines(1);
    alpha = alphas(*state, &rig, &view, "overlay_sheet");
    int drawn = count_drawn(alpha);
    double side = 1.4 / 2 * HEIGHT_PX;
    assert_true(drawn > 4 * side && drawn < 8.5 * side);
    free(alpha);
    view.edges.omits_borders = true;
    alpha = alphas(*state, &rig, &view, "overlay_sheet_bare");
    assert_int_equal(count_drawn(alpha), 0);
    free(alpha);
    rig_scene_finish(&rig, *state);
}

/* The overlay comes from the geometry, not from how the picture is made; without one, no pass. */
static void traced_pictures_get_the_same_overlay(void **state)
{
    struct rig_scene rig;
    open_bodies(&rig, *state, bodies, 3);
    struct view view = look((double[]){2.1, 1.3, 3.2}, 0);
    view.edges = lines(1.5f);
    view.edges.hidden = 0.3f;
    select_body(&rig, 0);
    view.highlight = outline(3);
    double *raster = alphas(*state, &rig, &view, "overlay_raster");
    view.quality.shadows = SHADOWS_RAYTRACED;
    double *traced = alphas(*state, &rig, &view, "overlay_traced"), worst = 0;
    for (int i = 0; i < WIDTH_PX * HEIGHT_PX; i++)
        worst = fmax(worst, fabs(raster[i] - traced[i]));
    print_message("raster and traced: worst %.2g\n", worst);
    assert_true(worst < 1e-6);
    free(raster);
    free(traced);
    struct frame frame;
    shoot(*state, &rig, &view, &frame);
    assert_true(report_has_pass(&frame.report, "overlay.edges", NULL));
    assert_true(frame.report.counts.feature_edges > 20 &&
                frame.report.counts.outlined_pixels > 100);
    frame_finish(&frame);
    view.edges = (struct view_edges){0};
    view.highlight = (struct view_highlight){0};
    shoot(*state, &rig, &view, &frame);
    assert_false(report_has_pass(&frame.report, "overlay", NULL));
    frame_finish(&frame);
    rig_scene_finish(&rig, *state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_outline_has_its_width_around_a_square),
        cmocka_unit_test(what_is_hidden_is_dimmed),
        cmocka_unit_test(unknown_nodes_are_refused),
        cmocka_unit_test(edges_of_a_box_are_drawn_where_they_are),
        cmocka_unit_test(a_ball_has_an_outline_and_no_creases),
        cmocka_unit_test(edges_end_at_clip_planes_and_sheets_have_borders),
        cmocka_unit_test(traced_pictures_get_the_same_overlay),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
