/* SPDX-License-Identifier: MIT */
/* What a camera sees through media, pixel by pixel, against closed forms in f64 (A2 to A5). */
#include <assert.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/closed_form_catalog.h"
#include "tests/support/closed_form_internal.h"
#include "tests/support/image_checks.h"
#include "tests/support/render_support.h"

static const double pi = 3.14159265358979323846;

static struct view look(const double eye[3], const double target[3], double ortho_height,
                        double fov_y_deg)
{
    struct view view = {
        .width_px = 48,
        .height_px = 40,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                   .ortho_height = ortho_height,
                   .fov_y_deg = fov_y_deg},
        .ignore_scene_lights = true,
        .background = {1, 1, 1, 1},
        .quality = {.samples = 1},
        .outputs = 1u << VIEW_OUTPUT_COLOR | 1u << VIEW_OUTPUT_TRANSMITTANCE |
                   1u << VIEW_OUTPUT_OPTICAL_DEPTH,
    };
    memcpy(view.camera.eye, eye, sizeof view.camera.eye);
    memcpy(view.camera.target, target, sizeof view.camera.target);
    return view;
}

static struct frame render(struct renderer *renderer, const struct media_scene_desc *desc,
                           const struct view *view)
{
    struct closed_form_scene built;
    struct rig_scene scene;
    struct frame frame = {0};
    struct error err = {0};
    media_scene_build(desc, &built);
    if (!rig_scene_from_glb(&scene, renderer, "media", built.glb, built.size_bytes, &err) ||
        !renderer_render(renderer, scene.key, view, &frame, &err))
        fail_msg("%s", err.message);
    rig_scene_finish(&scene, renderer);
    closed_form_scene_finish(&built);
    return frame;
}

struct expectation {
    const struct closed_form_body *bodies; /* media first, then glowing ones */
    int count;
    double relative;           /* tolerance of the transmittance */
    int glowing_count;         /* of count */
    const double (*planes)[4]; /* clip planes; cut the media and the glowing bodies */
    size_t plane_count;
};

/* Light from infinity or from the first glowing surface, along what the planes leave of the ray. */
static void expect_segment(const struct expectation *e, const double from[3], const double to[3],
                           double t[3])
{
    double range[2] = {0, 1}, begin[3], end[3];
    for (size_t p = 0; p < e->plane_count; p++) {
        double a = e->planes[p][3], b = 0;
        for (int k = 0; k < 3; k++) {
            a += e->planes[p][k] * from[k];
            b += e->planes[p][k] * (to[k] - from[k]);
        }
        if (b > 0)
            range[0] = fmax(range[0], -a / b);
        else
            range[1] = fmin(range[1], -a / b);
    }
    range[1] = fmax(range[0], range[1]);
    for (int k = 0; k < 3; k++) {
        begin[k] = from[k] + range[0] * (to[k] - from[k]);
        end[k] = from[k] + range[1] * (to[k] - from[k]);
    }
    int media = e->count - e->glowing_count;
    double at = closed_form_opaque_at(e->bodies + media, e->glowing_count, begin, end);
    for (int k = 0; k < 3; k++)
        end[k] = begin[k] + at * (end[k] - begin[k]);
    closed_form_through(e->bodies, media, begin, end, t);
}

/* The ray through the middle of a pixel: where it begins, and a point far away. */
static void pixel_ray(const struct view *view, int x, int y, double from[3], double to[3])
{
    double way[3];
    view_ray(view, x, y, from, way);
    for (int k = 0; k < 3; k++)
        to[k] = from[k] + 1e4 * way[k];
}

/* The closed form beside a pixel's middle, (u, v) in pixels. */
static void through_beside(const struct view *view, const struct expectation *e, const int at[2],
                           const double offset[2], double t[3])
{
    double from[3][3], to[3][3];
    for (int i = 0; i < 3; i++)
        pixel_ray(view, at[0] + (i == 1), at[1] + (i == 2), from[i], to[i]);
    for (int k = 0; k < 3; k++) {
        from[0][k] += offset[0] * (from[1][k] - from[0][k]) + offset[1] * (from[2][k] - from[0][k]);
        to[0][k] += offset[0] * (to[1][k] - to[0][k]) + offset[1] * (to[2][k] - to[0][k]);
    }
    expect_segment(e, from[0], to[0], t);
}

/* Adds the closed form at a sample, and how far it bends within the grid of 1/256 pixel on which
 * rasterisers place vertices: so near to an edge a sample may show either face. One per cent
 * more, because what is beside the edge has a slope of its own. */
static void add_sample(const struct view *view, const struct expectation *e, const int at[2],
                       const double sample[2], double t[3], double bend[3])
{
    static const double ways[4][2] = {{1, 0}, {0, 1}, {1, 1}, {1, -1}};
    double here[3], most[3] = {0};
    through_beside(view, e, at, sample, here);
    for (int i = 0; i < 4; i++) {
        double u = ways[i][0] / 256, v = ways[i][1] / 256, ahead[3], back[3];
        through_beside(view, e, at, (double[]){sample[0] + u, sample[1] + v}, ahead);
        through_beside(view, e, at, (double[]){sample[0] - u, sample[1] - v}, back);
        for (int k = 0; k < 3; k++)
            most[k] = fmax(most[k], 1.01 * fabs(ahead[k] + back[k] - 2 * here[k]));
    }
    for (int k = 0; k < 3; k++) {
        t[k] += here[k];
        bend[k] += most[k];
    }
}

/* Mean over the samples: the pixel's middle, or the standard four (Direct3D 11.3 functional
 * specification, 3.5.6.3) in rows from the bottom. */
static void expect_through(const struct view *view, const struct expectation *e, const int at[2],
                           double t[3], double bend[3])
{
    static const double four[4][2] = {
        {-0.125, 0.375}, {0.375, 0.125}, {-0.375, -0.125}, {0.125, -0.375}};
    static const double middle[2] = {0, 0};
    int samples = view->quality.samples;
    memset(t, 0, 3 * sizeof *t);
    memset(bend, 0, 3 * sizeof *bend);
    for (int i = 0; i < samples; i++)
        add_sample(view, e, at, samples == 1 ? middle : four[i], t, bend);
    for (int k = 0; k < 3; k++) {
        t[k] /= samples;
        bend[k] /= samples;
    }
}

/* In front of a background of 1, without reflections, the picture is the transmittance, and the
 * optical depth its logarithm, but for filters, which it does not count. */
static void expect_output(const struct frame *frame, const struct expectation *e, const char *name)
{
    bool has_filters = false;
    for (int i = 0; i < e->count; i++)
        has_filters = has_filters || e->bodies[i].filter[0] > 0;
    const struct image *color = &frame->outputs[VIEW_OUTPUT_COLOR];
    const float *t = frame->outputs[VIEW_OUTPUT_TRANSMITTANCE].pixels;
    const float *tau = frame->outputs[VIEW_OUTPUT_OPTICAL_DEPTH].pixels;
    for (int i = 0; i < color->width_px * color->height_px; i++)
        for (int k = 0; k < 3; k++) {
            double shown = (double)((const float *)color->pixels)[4 * i + k];
            double told = (double)t[3 * i + k];
            if (!(fabs(shown - told) <= 1e-6 * shown))
                fail_msg("%s: transmittance %.9g of pixel %d shows as %.9g", name, told, i, shown);
            double deep = (double)tau[3 * i + k], over = deep + log(told);
            if (!((has_filters ? over : fabs(over)) <= 1e-6 * (1 + deep)))
                fail_msg("%s: optical depth %.9g of pixel %d, transmittance %.9g", name, deep, i,
                         told);
        }
}

/* Every pixel, against the closed form up to infinity or the first opaque body. */
static void expect_pixels(const struct frame *frame, const struct view *view,
                          const struct expectation *e, const char *name)
{
    const struct image *color = &frame->outputs[VIEW_OUTPUT_COLOR];
    double worst = 0;
    for (int y = 0; y < view->height_px; y++) {
        for (int x = 0; x < view->width_px; x++) {
            double expected[3], bend[3];
            expect_through(view, e, (int[]){x, y}, expected, bend);
            const float *p = image_pixel_f32(color, x, y);
            for (int k = 0; k < 3; k++) {
                double error = fmax(0, fabs((double)p[k] - expected[k]) - bend[k]);
                error /= expected[k] + 1e-9;
                worst = fmax(worst, error);
                if (!(error <= e->relative))
                    fail_msg("%s: pixel (%d, %d) channel %d is %.9g, not %.9g", name, x, y, k,
                             (double)p[k], expected[k]);
            }
        }
    }
    print_message("%s: worst relative error %.3g, allowed %.3g\n", name, worst, e->relative);
    if (view->quality.samples == 1 && !e->glowing_count)
        expect_output(frame, e, name);
}

static void compare(struct renderer *renderer, const struct closed_form_body *bodies, int count,
                    const struct view *view, double relative, const char *name)
{
    struct media_scene_desc desc = {.bodies = bodies, .count = count};
    struct frame frame = render(renderer, &desc, view);
    save_picture(&frame.outputs[VIEW_OUTPUT_COLOR], name);
    expect_pixels(&frame, view,
                  &(struct expectation){.bodies = bodies, .count = count, .relative = relative},
                  name);
    frame_finish(&frame);
}

/* A2: exp(-sigma d / cos a). The steeper, the thinner the slab, so that the ray stays inside. */
static void a_slab_attenuates_by_its_thickness_over_the_cosine(void **state)
{
    static const double angles_deg[] = {0, 30, 60, 80, 89, 89.9};
    for (size_t i = 0; i < sizeof angles_deg / sizeof *angles_deg; i++) {
        double a = angles_deg[i] * pi / 180, s = sin(a), c = cos(a);
        double thickness_m = i < 4 ? 0x1p-6 : 0x1p-10;
        const struct closed_form_body slab = {.low = {-1, 0, -1},
                                              .high = {1, thickness_m, 1},
                                              .remains = {0.5f, 0.25f, 0.75f},
                                              .distance = 0.125f};
        struct view view =
            look((double[]){-1.5 * s, 1.5 * c, 0.1}, (double[]){0, 0, 0.1}, 0.004, 0);
        char name[40];
        snprintf(name, sizeof name, "media_slab_%g", angles_deg[i]);
        if (i == 0)
            view.camera.up[2] = -1;
        compare(*state, &slab, 1, &view, i < 4 ? 1e-5 : 1e-3, name);
        double from[3], to[3], expected[3];
        pixel_ray(&view, 24, 20, from, to);
        closed_form_through(&slab, 1, from, to, expected);
        double beer = exp(-log(2) / 0.125 * thickness_m / c); /* the law itself */
        assert_true(fabs(expected[0] - beer) < 1e-6 * beer);
    }
}

/* A3: the logarithm of what is left falls in a straight line with the way from the edge. */
static void a_wedge_attenuates_in_proportion_to_the_way_from_its_edge(void **state)
{
    const struct closed_form_body wedge = {.shape = BODY_WEDGE,
                                           .low = {0, 0, -0.5},
                                           .high = {1, 0.25, 0.5},
                                           .remains = {0.5f, 0.25f, 0.0625f},
                                           .distance = 0.25f};
    struct view view = look((double[]){0.5, 2, 0}, (double[]){0.5, 0, 0}, 0.8, 0);
    view.camera.up[2] = -1;
    struct media_scene_desc desc = {.bodies = &wedge, .count = 1};
    struct frame frame = render(*state, &desc, &view);
    expect_pixels(&frame, &view,
                  &(struct expectation){.bodies = &wedge, .count = 1, .relative = 1e-5},
                  "media_wedge");
    const struct image *color = &frame.outputs[VIEW_OUTPUT_COLOR];
    double step_m = 0.8 / view.height_px, slope = 4 * log(2) * 0.25;
    for (int x = 8; x < 40; x++) {
        double here = (double)*image_pixel_f32(color, x, 20);
        double next = (double)*image_pixel_f32(color, x + 1, 20);
        assert_true(fabs(log(here / next) / step_m - slope) < 1e-4 * slope);
    }
    frame_finish(&frame);
}

/* A4: exp(-2 sigma sqrt(R^2 - b^2)). 128 x 64 facets lie at most (1 - cos(pi/128)) R inside. */
static void a_sphere_attenuates_along_its_chord(void **state)
{
    const struct closed_form_body ball = {.shape = BODY_SPHERE,
                                          .low = {-0.5, 0, -0.5},
                                          .high = {0.5, 1, 0.5},
                                          .remains = {0.5f, 0.25f, 0.125f},
                                          .distance = 0.5f};
    struct view view = look((double[]){0, 0.5, 3}, (double[]){0, 0.5, 0}, 0.9, 0);
    struct media_scene_desc desc = {.bodies = &ball, .count = 1};
    struct frame frame = render(*state, &desc, &view);
    save_picture(&frame.outputs[VIEW_OUTPUT_COLOR], "media_sphere");
    const double inside_m = 0.5 * (1 - cos(pi / 128));
    for (int y = 0; y < view.height_px; y++) {
        for (int x = 0; x < view.width_px; x++) {
            double from[3], to[3];
            pixel_ray(&view, x, y, from, to);
            double b2 = from[0] * from[0] + (from[1] - 0.5) * (from[1] - 0.5), radius = 0.5;
            double longest = 2 * sqrt(fmax(0, radius * radius - b2));
            radius -= 2 * inside_m; /* a facet is flat both ways */
            double shortest = 2 * sqrt(fmax(0, radius * radius - b2));
            const float *p = image_pixel_f32(&frame.outputs[VIEW_OUTPUT_COLOR], x, y);
            for (int k = 0; k < 3; k++) {
                double sigma = (k + 1) * log(2) / 0.5, t = (double)p[k];
                assert_true(t >= exp(-sigma * longest) * (1 - 1e-5));
                assert_true(t <= exp(-sigma * shortest) * (1 + 1e-5));
            }
        }
    }
    frame_finish(&frame);
}

/* A5 and all that: boxes and wedges at random, overlapping, nested, sharing faces, mirrored, with
 * coloured surfaces in some; the camera anywhere, inside of several of them too. */
enum { BODIES = RANDOM_BODIES };

static struct view random_view(uint64_t seed, bool is_near)
{
    bool is_flat = seed % 4 == 1;
    double eye[3], target[3];
    for (int k = 0; k < 3; k++) {
        eye[k] = closed_form_random(&seed, -0.6, 0.6) * (is_near ? 1 : 6);
        target[k] = closed_form_random(&seed, -0.3, 0.3);
    }
    return look(eye, target, is_flat ? 1.5 : 0, 70);
}

static void random_views_of_random_media_are_exact(void **state)
{
    for (uint64_t round = 1; round <= 12; round++) {
        struct closed_form_body bodies[BODIES];
        uint64_t seed = round;
        closed_form_random_bodies(&seed, round % 2, bodies);
        struct view view = random_view(round, round % 3);
        char name[40];
        snprintf(name, sizeof name, "media_random_%d", (int)round);
        compare(*state, bodies, BODIES, &view, 1e-5, name);
    }
}

/* The bodies with two glowing ones among them, through the clip planes of the view. */
static void compare_with_glowing(struct renderer *renderer, uint64_t round, struct view *view,
                                 const char *name)
{
    struct closed_form_body bodies[BODIES + 2];
    uint64_t seed = round;
    closed_form_random_bodies(&seed, round % 2, bodies);
    for (int i = BODIES; i < BODIES + 2; i++) {
        bodies[i] = (struct closed_form_body){.glows = true};
        for (int k = 0; k < 3; k++) {
            bodies[i].low[k] = (double)(float)closed_form_random(&seed, -0.6, 0.4);
            bodies[i].high[k] = bodies[i].low[k] + 0.25;
        }
    }
    struct media_scene_desc desc = {.bodies = bodies, .count = BODIES + 2};
    struct frame frame = render(renderer, &desc, view);
    save_picture(&frame.outputs[VIEW_OUTPUT_COLOR], name);
    struct expectation e = {.bodies = bodies,
                            .count = BODIES + 2,
                            .glowing_count = 2,
                            .relative = 1e-5,
                            .planes = view->clip_planes,
                            .plane_count = view->clip_plane_count};
    expect_pixels(&frame, view, &e, name);
    frame_finish(&frame);
}

static void an_opaque_surface_inside_a_medium_shows_through_what_is_before_it(void **state)
{
    for (uint64_t round = 1; round <= 10; round++) {
        struct view view = random_view(round + 100, round % 2);
        char name[40];
        snprintf(name, sizeof name, "media_opaque_%d", (int)round);
        compare_with_glowing(*state, round, &view, name);
    }
}

/* The inside of a body is a medium: a cut shows it from the plane on. */
static void a_clip_plane_cuts_through_media(void **state)
{
    static const double planes[3][4] = {
        {0.3, -0.2, 1, 0.05}, {-1, 0.1, 0.2, 0.3}, {0.1, 1, 0.4, 0.2}};
    for (uint64_t round = 1; round <= 12; round++) {
        struct view view = random_view(round + 200, round % 2);
        view.clip_planes = planes;
        view.clip_plane_count = round % 3 + 1;
        char name[40];
        snprintf(name, sizeof name, "media_cut_%d", (int)round);
        compare_with_glowing(*state, round, &view, name);
    }
}

/* Each sample has its own way through the media, whatever the slope of their surfaces. */
static void antialiased_views_average_the_ways_of_their_samples(void **state)
{
    const struct closed_form_body sheet[] = {
        {.low = {-1, 0, -1},
         .high = {1, 0.015625, 1},
         .remains = {0.5f, 0.8f, 0.9f},
         .distance = 0.0625f},
        {.low = {-2, -1, -2}, .high = {2, 0, 2}, .glows = true}};
    struct view view = look((double[]){-1.5, 0.03, 0.1}, (double[]){0, 0, 0.1}, 0, 3);
    view.quality.samples = 4;
    struct media_scene_desc desc = {.bodies = sheet, .count = 2};
    struct frame frame = render(*state, &desc, &view);
    struct expectation e = {.bodies = sheet, .count = 2, .glowing_count = 1, .relative = 1e-3};
    expect_pixels(&frame, &view, &e, "media_antialiased");
    frame_finish(&frame);
    for (uint64_t round = 1; round <= 4; round++) {
        char name[40];
        view = random_view(round + 300, round % 2);
        view.quality.samples = 4;
        snprintf(name, sizeof name, "media_antialiased_%d", (int)round);
        compare_with_glowing(*state, round, &view, name);
    }
}

/* The ray tracer shares no code with the lists: the same picture, lit surfaces and glowing bodies
 * included, but where a pixel's middle is within rounding of an edge. */
static void the_reference_sees_the_same(void **state)
{
    for (uint64_t round = 1; round <= 6; round++) {
        struct closed_form_body bodies[BODIES + 1];
        uint64_t seed = round;
        closed_form_random_bodies(&seed, true, bodies);
        bodies[BODIES] = (struct closed_form_body){
            .low = {-0.25, -0.3, -0.2}, .high = {0.1, 0.2, 0.3}, .glows = true};
        struct media_scene_desc desc = {.bodies = bodies, .count = BODIES + 1};
        struct view view = random_view(round + 400, round % 2);
        struct view_light sun = {.type = SCENE_LIGHT_DIRECTIONAL,
                                 .direction = {0.3, -1, -0.2},
                                 .color = {1, 1, 1},
                                 .intensity = 2,
                                 .casts_no_shadow = true};
        view.lights = &sun;
        view.light_count = 1;
        struct frame lists = render(*state, &desc, &view);
        view.quality.shadows = SHADOWS_RAYTRACED;
        view.quality.reference = round > 3; /* else the production form, in packets */
        struct frame traced = render(*state, &desc, &view);
        int apart = 0;
        assert(lists.outputs[VIEW_OUTPUT_COLOR].pixels && traced.outputs[VIEW_OUTPUT_COLOR].pixels);
        for (int i = 0; i < view.width_px * view.height_px; i++) {
            const float *p = (const float *)lists.outputs[VIEW_OUTPUT_COLOR].pixels + 4 * i;
            const float *q = (const float *)traced.outputs[VIEW_OUTPUT_COLOR].pixels + 4 * i;
            bool is_apart = false;
            for (int k = 0; k < 4; k++)
                is_apart |= !(fabs((double)(p[k] - q[k])) <= 5e-5 * (1 + (double)q[k]));
            apart += is_apart;
        }
        print_message("round %d: %d pixels differ\n", (int)round, apart);
        assert_true(apart <= view.width_px * view.height_px / 200);
        frame_finish(&lists);
        frame_finish(&traced);
    }
}

/* The linked form keeps the thickness rule, and says so: with a new plan, and with a kept one. */
static void linked_lists_warn_that_they_know_no_media(void **state)
{
    const struct closed_form_body slab = {.low = {-1, 0, -1},
                                          .high = {1, 0.25, 1},
                                          .remains = {0.5f, 0.25f, 0.75f},
                                          .distance = 0.125f};
    const struct media_scene_desc desc = {.bodies = &slab, .count = 1};
    const struct view_light sun = {.type = SCENE_LIGHT_DIRECTIONAL,
                                   .direction = {0.1, -1, 0.1},
                                   .color = {1, 1, 1},
                                   .intensity = 1};
    struct view view = look((double[]){0, 3, 3}, (double[]){0, 0, 0}, 3, 0);
    view.lights = &sun;
    view.light_count = 1;
    for (int round = 0; round < 4; round++) {
        bool is_linked = round < 2;
        view.quality.shadows = is_linked ? SHADOWS_DEEP_LINKED : SHADOWS_DEEP;
        struct frame frame = render(*state, &desc, &view);
        assert_int_equal(frame.report.warning_count, is_linked);
        if (is_linked)
            assert_non_null(strstr(frame.report.warnings[0], "deep-linked has no room for media"));
        frame_finish(&frame);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_slab_attenuates_by_its_thickness_over_the_cosine),
        cmocka_unit_test(a_wedge_attenuates_in_proportion_to_the_way_from_its_edge),
        cmocka_unit_test(a_sphere_attenuates_along_its_chord),
        cmocka_unit_test(random_views_of_random_media_are_exact),
        cmocka_unit_test(an_opaque_surface_inside_a_medium_shows_through_what_is_before_it),
        cmocka_unit_test(a_clip_plane_cuts_through_media),
        cmocka_unit_test(antialiased_views_average_the_ways_of_their_samples),
        cmocka_unit_test(the_reference_sees_the_same),
        cmocka_unit_test(linked_lists_warn_that_they_know_no_media),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
