/* SPDX-License-Identifier: MIT */
/* Capped cuts: what a plane cuts open is closed again, exactly where the ray through a pixel comes
 * into a body; of overlapping bodies one is seen; media keep their way; open sheets have none. */
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

enum { SIDE_PX = 96, BODIES = 5 };

static const double planes[3][4] = {
    {0.3, -0.2, -1, 0.05}, {-1, 0.1, -0.2, 0.3}, {0.1, -1, -0.4, 0.2}};
static const struct view_cut caps[3] = {
    {.has_cap = true},
    {.has_cap = true, .has_cap_color = true, .cap_color = {1, 0.2f, 0.1f}},
    {.has_cap = true}};
static const struct closed_form_light lamp = {.type = GLB_LIGHT_POINT,
                                              .position = {0.5, 3, 4},
                                              .direction = {0, -1, 0},
                                              .color = {1, 1, 1},
                                              .intensity = 60};

static struct view look(const double eye[3], size_t plane_count)
{
    struct view view = {.width_px = SIDE_PX,
                        .height_px = SIDE_PX,
                        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .fov_y_deg = 35},
                        .background = {0.1f, 0.1f, 0.1f, 1},
                        .quality = {.samples = 1, .shadow_resolution = 1024},
                        .outputs = 1u << VIEW_OUTPUT_COLOR | 1u << VIEW_OUTPUT_DEPTH |
                                   1u << VIEW_OUTPUT_NODE,
                        .clip_planes = planes,
                        .clip_plane_count = plane_count,
                        .cuts = caps};
    memcpy(view.camera.eye, eye, sizeof view.camera.eye);
    return view;
}

static void make_bodies(uint64_t seed, bool are_media, struct closed_form_body *bodies)
{
    for (int i = 0; i < BODIES; i++) {
        bodies[i] = (struct closed_form_body){.shape = i % 3 == 1 ? BODY_WEDGE : BODY_BOX};
        for (int k = 0; k < 3; k++) {
            double low = closed_form_random(&seed, -0.7, 0.1);
            bodies[i].low[k] = (double)(float)low;
            bodies[i].high[k] = (double)(float)(low + closed_form_random(&seed, 0.4, 0.9));
            bodies[i].remains[k] = are_media ? (float)closed_form_random(&seed, 0.3, 0.9) : 1;
        }
        bodies[i].distance = are_media ? 0.5f : 0;
        bodies[i].is_mirrored = i == 2;
        for (int k = 0; k < 3 && are_media; k++) /* so that a cap shows */
            bodies[i].filter[k] = k == i % 3 ? 0.5f : 0.9f;
    }
}

static void open_bodies(struct rig_scene *rig, struct renderer *renderer,
                        const struct closed_form_body *bodies, int count)
{
    struct closed_form_scene scene;
    media_scene_build(&(struct media_scene_desc){.bodies = bodies, .count = count, .light = lamp},
                      &scene);
    rig_scene_open(rig, renderer, "caps", scene.glb, scene.size_bytes);
    closed_form_scene_finish(&scene);
}

/* A body that holds the point, or -1. */
static bool is_inside(const struct closed_form_body *body, const double p[3])
{
    for (int k = 0; k < 3; k++)
        if (p[k] <= body->low[k] || p[k] >= body->high[k])
            return false;
    double slope = (body->high[1] - body->low[1]) / (body->high[0] - body->low[0]);
    return body->shape == BODY_BOX || p[1] - body->low[1] < slope * (p[0] - body->low[0]);
}

/* Depth of the first thing that the ray meets within the planes: INFINITY for nothing. *is_cap:
 * it begins inside. */
static double expect_depth(const struct closed_form_body *bodies, const struct view *view, int x,
                           int y, bool *is_cap)
{
    double origin[3], way[3], range[2] = {0, 20}, from[3], to[3];
    view_ray(view, x, y, origin, way);
    for (size_t p = 0; p < view->clip_plane_count; p++) {
        double a = planes[p][3], b = 0;
        for (int k = 0; k < 3; k++) {
            a += planes[p][k] * origin[k];
            b += planes[p][k] * way[k];
        }
        if (b > 0)
            range[0] = fmax(range[0], -a / b);
        else
            range[1] = fmin(range[1], -a / b);
    }
    *is_cap = false;
    if (range[0] >= range[1])
        return INFINITY;
    for (int k = 0; k < 3; k++) {
        from[k] = origin[k] + range[0] * way[k];
        to[k] = origin[k] + range[1] * way[k];
    }
    for (int i = 0; i < BODIES; i++)
        *is_cap |= is_inside(&bodies[i], from);
    if (*is_cap)
        return range[0];
    double at = closed_form_opaque_at(bodies, BODIES, from, to);
    return at < 1 ? range[0] + at * (range[1] - range[0]) : INFINITY;
}

static const double eyes[][3] = {{0.4, 0.9, 4}, {3, 2.5, 2.5}, {-0.5, 3.5, 2}};

static void caps_lie_where_rays_come_into_bodies(void **state)
{
    int all_caps = 0;
    for (uint64_t round = 1; round <= 9; round++) {
        struct closed_form_body bodies[BODIES];
        struct rig_scene rig;
        struct frame frame;
        make_bodies(round * 77, false, bodies);
        open_bodies(&rig, *state, bodies, BODIES);
        struct view view = look(eyes[round % 3], round % 3 + 1);
        shoot(*state, &rig, &view, &frame);
        int wrong = 0, seen = 0;
        for (int y = 0; y < SIDE_PX; y++)
            for (int x = 0; x < SIDE_PX; x++) {
                bool is_cap;
                double expected = expect_depth(bodies, &view, x, y, &is_cap);
                double depth = (double)((const float *)frame.outputs[VIEW_OUTPUT_DEPTH]
                                            .pixels)[y * SIDE_PX + x];
                bool is_same =
                    isinf(expected) ? isinf(depth) : fabs(depth - expected) < 1e-4 * expected;
                wrong += !is_same;
                seen += is_cap;
            }
        char name[32];
        snprintf(name, sizeof name, "caps_%d", (int)round);
        save_picture(&frame.outputs[VIEW_OUTPUT_COLOR], name);
        print_message("round %d: %d pixels of caps, %d pixels differ\n", (int)round, seen, wrong);
        assert_true(wrong <= 12); /* on edges, which rasterisers place on 1/256 pixel */
        all_caps += seen;
        frame_finish(&frame);
        rig_scene_finish(&rig, *state);
    }
    assert_true(all_caps > 2000);
}

/* Rasterised with maps and traced, the pictures are the same, light on caps and their shadows
 * included; with media, too. */
static void every_technique_shows_the_same_caps(void **state)
{
    static const enum shadow_technique techniques[] = {SHADOWS_DEEP, SHADOWS_RAYTRACED,
                                                       SHADOWS_RAYTRACED_SHADOWS};
    for (int are_media = 0; are_media < 2; are_media++) {
        struct closed_form_body bodies[BODIES];
        struct rig_scene rig;
        make_bodies(are_media ? 5 : 154, are_media, bodies);
        if (are_media)
            bodies[3] =
                (struct closed_form_body){.low = {-0.3, -0.4, -0.2}, .high = {0.3, 0.2, 0.3}};
        open_bodies(&rig, *state, bodies, BODIES);
        struct view view = look(eyes[1], 2);
        view.outputs = 1u << VIEW_OUTPUT_COLOR;
        view.quality.reference = true;
        struct image exact = shoot_color(*state, &rig, &view);
        save_picture(&exact, are_media ? "caps_media" : "caps_reference");
        view.quality.reference = false;
        for (int i = 0; i < 3; i++) {
            view.quality.shadows = techniques[i];
            struct image image = shoot_color(*state, &rig, &view);
            double share = image_share_differing(&image, &exact, 0.02, 0.05);
            print_message("media %d, technique %d: %.2f %% differ\n", are_media, i, 100 * share);
            save_picture(&image, "caps_compared");
            assert_true(share < (i ? 0.01 : 0.03));
            image_finish(&image);
        }
        image_finish(&exact);
        rig_scene_finish(&rig, *state);
    }
}

/* The plane's colour is that of an opaque body's cap; the picker says whose it is. */
static void a_cap_has_its_colour_and_its_node(void **state)
{
    static const double front[1][4] = {{0, 0, -1, 0}};
    static const struct view_cut green[1] = {
        {.has_cap = true, .has_cap_color = true, .cap_color = {0, 1, 0}}};
    const struct closed_form_body box = {.low = {-0.5, -0.5, -0.5}, .high = {0.5, 0.5, 0.5}};
    struct rig_scene rig;
    open_bodies(&rig, *state, &box, 1);
    struct view view = look((double[]){0, 0, 4}, 1);
    view.clip_planes = front;
    view.cuts = green;
    struct frame frame;
    shoot(*state, &rig, &view, &frame);
    const float *p = image_at(&frame.outputs[VIEW_OUTPUT_COLOR], &view, (double[]){0.1, 0.1, 0});
    assert_true(p[1] > 0.05f && p[0] < 0.25f * p[1]);
    uint32_t node = image_id_at(&frame.outputs[VIEW_OUTPUT_NODE], &view, (double[]){0.1, 0.1, 0});
    assert_true(node > 0);
    frame_finish(&frame);
    struct pick_result result;
    struct error err = {0};
    assert_true(renderer_pick(*state, rig.key, &view,
                              &(struct pick_desc){.x = SIDE_PX / 2 + 3, .y = SIDE_PX / 2 + 3},
                              &result, &err));
    assert_int_equal(result.layer_count, 1);
    assert_int_equal(result.layers[0].node + 1, node);
    assert_true(fabs(result.layers[0].position[2]) < 1e-6);
    assert_true(result.layers[0].normal[2] > 0.999999);
    pick_result_finish(&result);
    rig_scene_finish(&rig, *state);
}

/* A plane that is there eight times in different lengths, and one that faces it seven times: the
 * heights of a cap above them are nothing but rounding. */
static void planes_that_coincide_are_one_and_facing_ones_leave_nothing(void **state)
{
    const struct closed_form_body ball = {
        .shape = BODY_SPHERE, .low = {-0.6, -0.6, -0.6}, .high = {0.6, 0.6, 0.6}};
    static const struct view_cut all[8] = {{.has_cap = true}, {.has_cap = true}, {.has_cap = true},
                                           {.has_cap = true}, {.has_cap = true}, {.has_cap = true},
                                           {.has_cap = true}, {.has_cap = true}};
    uint64_t seed = 4;
    struct rig_scene rig;
    open_bodies(&rig, *state, &ball, 1);
    for (int round = 0; round < 12; round++) {
        double same[8][4], facing[8][4];
        for (int k = 0; k < 4; k++)
            same[0][k] = closed_form_random(&seed, -0.3, 0.3) - (k == 2);
        for (int p = 1; p < 8; p++) {
            double length = closed_form_random(&seed, 0.1, 9);
            for (int k = 0; k < 4; k++) {
                same[p][k] = length * same[0][k];
                facing[p][k] = -length * same[0][k];
            }
        }
        memcpy(facing[0], same[0], sizeof same[0]);
        struct view view = look(eyes[0], 1);
        struct frame one, eight, none;
        view.clip_planes = same;
        view.cuts = all;
        shoot(*state, &rig, &view, &one);
        view.clip_plane_count = 8;
        shoot(*state, &rig, &view, &eight);
        int differing = 0, seen = 0;
        for (int i = 0; i < SIDE_PX * SIDE_PX; i++) {
            double a = (double)((const float *)one.outputs[VIEW_OUTPUT_DEPTH].pixels)[i];
            double b = (double)((const float *)eight.outputs[VIEW_OUTPUT_DEPTH].pixels)[i];
            differing += isinf(a) ? !isinf(b) : fabs(a - b) > 1e-6 * a;
            seen += !isinf(a);
        }
        assert_true(seen > 200);
        assert_true(differing <= 12); /* of the rim */
        view.clip_planes = facing;
        shoot(*state, &rig, &view, &none); /* caps have no thickness: whatever is left of them */
        frame_finish(&one);
        frame_finish(&eight);
        frame_finish(&none);
    }
    rig_scene_finish(&rig, *state);
}

/* A floor encloses nothing. */
static void open_sheets_have_none_and_a_warning_says_so(void **state)
{
    struct closed_form_scene scene;
    struct rig_scene rig;
    struct frame frame;
    media_scene_build(&(struct media_scene_desc){.has_floor = true, .light = lamp}, &scene);
    rig_scene_open(&rig, *state, "floor", scene.glb, scene.size_bytes);
    struct view view = look((double[]){0, 2, 4}, 2);
    shoot(*state, &rig, &view, &frame);
    bool is_warned = false;
    for (int i = 0; i < frame.report.warning_count; i++)
        is_warned |= strstr(frame.report.warnings[i], "no cap") != NULL;
    assert_true(is_warned);
    frame_finish(&frame);
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(caps_lie_where_rays_come_into_bodies),
        cmocka_unit_test(every_technique_shows_the_same_caps),
        cmocka_unit_test(a_cap_has_its_colour_and_its_node),
        cmocka_unit_test(planes_that_coincide_are_one_and_facing_ones_leave_nothing),
        cmocka_unit_test(open_sheets_have_none_and_a_warning_says_so),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
