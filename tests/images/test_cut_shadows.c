/* SPDX-License-Identifier: MIT */
/* Clip planes let light in: what they cut away casts no shadow and attenuates nothing, in every
 * technique, as the clipped segments of closed forms say; planes that spare shadows change none;
 * and a plane that moves rebuilds what it reaches. */
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

enum { SIDE_PX = 64 };

static const struct closed_form_light lamp = {.type = GLB_LIGHT_POINT,
                                              .position = {0.3, 4, -0.2},
                                              .direction = {0, -1, 0},
                                              .color = {1, 1, 1},
                                              .intensity = 100};
/* In both media, in a part that the first plane cuts away. */
static const struct closed_form_light buried = {.type = GLB_LIGHT_POINT,
                                                .position = {0.05, 1.6, -0.1},
                                                .direction = {0, -1, 0},
                                                .color = {1, 1, 1},
                                                .intensity = 100};
static const struct closed_form_light sun = {
    .type = GLB_LIGHT_DIRECTIONAL, .direction = {0, -1, 0}, .color = {1, 1, 1}, .intensity = 4};

/* Two media that overlap, a filter that bounds none, and something opaque between them. */
static const struct closed_form_body bodies[] = {
    {.low = {-0.7, 0.75, -0.6},
     .high = {0.4, 1.75, 0.6},
     .remains = {0.5f, 0.25f, 0.75f},
     .distance = 0.5f,
     .filter = {0.9f, 0.8f, 1}},
    {.low = {-0.3, 1.25, -0.4},
     .high = {0.75, 2.25, 0.5},
     .remains = {0.7f, 0.9f, 0.4f},
     .distance = 0.5f},
    {.low = {-0.5, 2.5, -0.5},
     .high = {0.125, 2.625, 0.25},
     .remains = {1, 1, 1},
     .distance = 1,
     .filter = {1, 0.5f, 0.25f}},
    {.low = {0.25, 0.875, -0.5}, .high = {0.5, 2.875, -0.25}},
};
enum { BODIES = sizeof bodies / sizeof *bodies, OPAQUE = BODIES - 1 };

/* All keep the floor, and the camera just above it. */
static const double planes[3][4] = {
    {0.25, -1, 0.125, 1.5}, {-1, -0.25, 0, 0.6}, {0.125, -0.5, 1, 0.75}};

static struct view look_down(size_t plane_count)
{
    return (struct view){
        .width_px = SIDE_PX,
        .height_px = SIDE_PX,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                   .eye = {0, 0.5, 0},
                   .target = {0, 0, 0},
                   .up = {0, 0, -1},
                   .fov_y_deg = 100},
        .quality = {.samples = 1, .shadow_resolution = 512, .shadow_taps = 1},
        .clip_planes = planes,
        .clip_plane_count = plane_count,
    };
}

/* From the light to the point, along what the planes leave of the way. */
static void expect_light(const struct closed_form_light *light, const double point[3],
                         size_t plane_count, double t[3])
{
    double from[3], range[2] = {0, 1}, begin[3], end[3];
    for (int k = 0; k < 3; k++)
        from[k] = light->type == GLB_LIGHT_POINT ? light->position[k]
                                                 : point[k] - 10 * light->direction[k];
    for (size_t p = 0; p < plane_count; p++) {
        double a = planes[p][3], b = 0;
        for (int k = 0; k < 3; k++) {
            a += planes[p][k] * from[k];
            b += planes[p][k] * (point[k] - from[k]);
        }
        if (b > 0)
            range[0] = fmax(range[0], -a / b);
        else if (b < 0)
            range[1] = fmin(range[1], -a / b);
    }
    for (int k = 0; k < 3; k++) {
        begin[k] = from[k] + fmin(range[0], 1) * (point[k] - from[k]);
        end[k] = from[k] + fmax(range[0], range[1]) * (point[k] - from[k]);
    }
    closed_form_through(bodies, BODIES, begin, end, t);
}

/* How much the closed form says within `reach` metres of the point: nothing is compared where that
 * is an edge. */
static double bend_near(const struct closed_form_light *light, const double point[3], double reach,
                        size_t plane_count)
{
    double here[3], most = 0;
    expect_light(light, point, plane_count, here);
    for (int i = 0; i < 8; i++) {
        double beside[3] = {point[0] + reach * cos(i * 0.785398), point[1],
                            point[2] + reach * sin(i * 0.785398)};
        double t[3];
        expect_light(light, beside, plane_count, t);
        for (int k = 0; k < 3; k++)
            most = fmax(most, fabs(t[k] - here[k]));
    }
    return most;
}

struct comparison {
    double worst; /* error of a transmittance */
    int compared;
};

static struct comparison compare(const struct image *shadowed, const struct image *bare,
                                 const struct view *view, const struct closed_form_light *light,
                                 size_t plane_count)
{
    struct comparison result = {0};
    const double normal[3] = {0, 1, 0};
    for (int y = 0; y < SIDE_PX; y++)
        for (int x = 0; x < SIDE_PX; x++) {
            double point[3], t[3];
            if (!view_meet_plane(view, x, y, normal, 0, point))
                continue;
            double bend = bend_near(light, point, 0.012, plane_count);
            if (bend > 0.02)
                continue;
            expect_light(light, point, plane_count, t);
            const float *p = image_pixel_f32(shadowed, x, y), *q = image_pixel_f32(bare, x, y);
            for (int k = 0; k < 3; k++)
                result.worst = fmax(result.worst, fabs((double)p[k] / (double)q[k] - t[k]) - bend);
            result.compared++;
        }
    return result;
}

static const struct {
    const char *name;
    struct view_quality quality;
    double error; /* of traced pictures: that the one without shadows is rasterised */
} techniques[] = {
    {"deep", {.shadows = SHADOWS_DEEP}, 1e-3},
    {"compressed", {.shadows = SHADOWS_DEEP, .shadow_compression = 0.01}, 0.011},
    {"prefiltered", {.shadows = SHADOWS_DEEP, .shadow_prefilter = 2}, 3e-3},
    {"raytraced", {.shadows = SHADOWS_RAYTRACED}, 1e-4},
    {"raytraced-shadows", {.shadows = SHADOWS_RAYTRACED_SHADOWS}, 1e-4},
    {"reference", {.reference = true}, 3e-5},
};

static void open_bodies(struct rig_scene *rig, struct renderer *renderer,
                        const struct closed_form_light *light, const struct closed_form_body *list,
                        int count)
{
    struct closed_form_scene scene;
    media_scene_build(
        &(struct media_scene_desc){.bodies = list,
                                   .count = count,
                                   .has_floor = light,
                                   .light = light ? *light : (struct closed_form_light){0}},
        &scene);
    rig_scene_open(rig, renderer, "cut", scene.glb, scene.size_bytes);
    closed_form_scene_finish(&scene);
}

static void set_technique(struct view *view, const struct view_quality *quality)
{
    int resolution = view->quality.shadow_resolution;
    view->quality = *quality;
    view->quality.samples = 1;
    view->quality.shadow_taps = 1;
    view->quality.shadow_resolution = resolution;
}

static struct image shoot_bare(struct renderer *renderer, const struct rig_scene *rig,
                               struct view view)
{
    view.quality = (struct view_quality){.shadows = SHADOWS_NONE, .samples = 1};
    return shoot_color(renderer, rig, &view);
}

/* What takes the lists of a light at once takes them from one storage block, and a device that is
 * no software says how large that may be: such a light is refused there in so many words. */
static bool is_refused(struct renderer *renderer, const struct rig_scene *rig,
                       const struct view *view)
{
    const struct view_quality *quality = &view->quality;
    struct renderer_info info;
    struct error err = {0};
    struct frame frame;
    renderer_get_info(renderer, &info);
    if (info.is_software || (quality->shadow_compression == 0 && quality->shadow_prefilter == 0))
        return false;
    if (renderer_render(renderer, rig->key, view, &frame, &err)) {
        frame_finish(&frame);
        return false;
    }
    assert_int_equal(err.code, ERROR_OVER_BUDGET);
    assert_non_null(strstr(err.message, "in one storage block, this device has"));
    return true;
}

static void light_comes_in_where_planes_cut(void **state)
{
    const struct closed_form_light *lights[] = {&lamp, &sun, &buried};
    for (int l = 0; l < 3; l++) {
        struct rig_scene rig;
        open_bodies(&rig, *state, lights[l], bodies, BODIES);
        for (size_t count = 0; count <= 3; count++) {
            struct view view = look_down(count);
            struct image bare = shoot_bare(*state, &rig, view);
            for (size_t i = 0; i < sizeof techniques / sizeof *techniques; i++) {
                set_technique(&view, &techniques[i].quality);
                if (is_refused(*state, &rig, &view)) {
                    view = look_down(count);
                    continue;
                }
                struct image image = shoot_color(*state, &rig, &view);
                struct comparison c = compare(&image, &bare, &view, lights[l], count);
                print_message("%s, light %d, %zu planes: worst %.2g of %d pixels\n",
                              techniques[i].name, l, count, c.worst, c.compared);
                if (count == 2)
                    save_picture(&image, techniques[i].name);
                assert_true(c.compared > SIDE_PX * SIDE_PX / 2);
                assert_true(c.worst <= techniques[i].error);
                image_finish(&image);
                view = look_down(count);
            }
            image_finish(&bare);
        }
        rig_scene_finish(&rig, *state);
    }
}

/* Plain maps and the linked lists know no media: something opaque, and a filter. */
static void maps_and_linked_lists_are_cut(void **state)
{
    struct rig_scene rig;
    open_bodies(&rig, *state, &lamp, bodies + 2, 2);
    for (int i = 0; i < 3; i++) {
        struct view view = look_down(1);
        view.quality.shadows = i ? SHADOWS_DEEP_LINKED : SHADOWS_MAP;
        view.quality.faithful = i == 2;
        struct image cut = shoot_color(*state, &rig, &view);
        struct view traced = look_down(1);
        traced.quality = (struct view_quality){.reference = true, .samples = 1};
        struct image exact = shoot_color(*state, &rig, &traced);
        int differing = 0, shadowed = 0;
        struct image bare = shoot_bare(*state, &rig, look_down(1));
        for (int p = 0; p < SIDE_PX * SIDE_PX; p++) {
            const float *a = image_pixel_f32(&cut, p % SIDE_PX, p / SIDE_PX);
            const float *b = image_pixel_f32(&exact, p % SIDE_PX, p / SIDE_PX);
            const float *c = image_pixel_f32(&bare, p % SIDE_PX, p / SIDE_PX);
            int channel = i ? 2 : 0; /* the filter leaves red alone, and maps know none */
            shadowed += b[channel] < 0.9f * c[channel];
            differing += fabsf(a[channel] - b[channel]) > 5e-3f * c[channel];
        }
        print_message("%d: %d pixels differ, %d are in shadow\n", i, differing, shadowed);
        assert_true(shadowed > 100 && differing < SIDE_PX);
        image_finish(&cut);
        image_finish(&exact);
        image_finish(&bare);
    }
    rig_scene_finish(&rig, *state);
}

/* Planes that spare shadows cut the picture only: the floor is lit as without them. */
static void planes_may_spare_shadows(void **state)
{
    static const struct view_cut spare[3] = {
        {.spares_shadows = true}, {.spares_shadows = true}, {.spares_shadows = true}};
    struct rig_scene rig;
    open_bodies(&rig, *state, &lamp, bodies, BODIES);
    for (size_t i = 0; i < sizeof techniques / sizeof *techniques; i++) {
        struct view view = look_down(3);
        set_technique(&view, &techniques[i].quality);
        view.cuts = spare;
        struct image spared = shoot_color(*state, &rig, &view);
        view.cuts = NULL;
        struct image cut = shoot_color(*state, &rig, &view);
        view.clip_plane_count = 0;
        struct image whole = shoot_color(*state, &rig, &view);
        assert_same_bits(&spared, &whole);
        assert_true(image_hash(&cut) != image_hash(&whole));
        image_finish(&spared);
        image_finish(&cut);
        image_finish(&whole);
    }
    rig_scene_finish(&rig, *state);
}

/* Two lamps of short range, each with a body of its own: a plane through one leaves the shadow of
 * the other, and one that reaches neither leaves both. */
static void a_plane_rebuilds_only_what_it_reaches(void **state)
{
    static const struct closed_form_body two[] = {
        {.low = {-2.5, 1, -0.5}, .high = {-1.5, 1.5, 0.5}},
        {.low = {1.5, 1, -0.5}, .high = {2.5, 1.5, 0.5}}};
    static const struct view_light lamps[] = {{.type = SCENE_LIGHT_POINT,
                                               .position = {-2, 2, 0},
                                               .color = {1, 1, 1},
                                               .intensity = 10,
                                               .range = 2.5f},
                                              {.type = SCENE_LIGHT_POINT,
                                               .position = {2, 2, 0},
                                               .color = {1, 1, 1},
                                               .intensity = 10,
                                               .range = 2.5f}};
    struct rig_scene rig;
    open_bodies(&rig, *state, NULL, two, 2);
    double plane[1][4] = {{-1, 0, 0, 5}};
    struct view view = look_down(0);
    view.lights = lamps;
    view.light_count = 2;
    view.ignore_scene_lights = true;
    view.quality.shadows = SHADOWS_MAP;
    view.quality.shadow_resolution = 256;
    view.camera.eye[1] = 6;
    view.clip_planes = (const double(*)[4])plane;
    static const struct {
        double offset;
        uint64_t built;
    } steps[] = {{5, 2}, {4.5, 0}, {2, 1}, {1.9, 1}, {0, 0}, {-2, 1}, {-1.9, 1}, {-3.5, 0}};
    view.clip_plane_count = 1;
    for (size_t i = 0; i < sizeof steps / sizeof *steps; i++) {
        struct frame frame;
        plane[0][3] = steps[i].offset;
        shoot(*state, &rig, &view, &frame);
        print_message("plane at %g: %llu built, %llu kept\n", steps[i].offset,
                      (unsigned long long)frame.report.counts.shadow_maps_built,
                      (unsigned long long)frame.report.counts.shadow_maps_reused);
        assert_int_equal(frame.report.counts.shadow_maps_built, steps[i].built);
        frame_finish(&frame);
    }
    rig_scene_finish(&rig, *state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(light_comes_in_where_planes_cut),
        cmocka_unit_test(maps_and_linked_lists_are_cut),
        cmocka_unit_test(planes_may_spare_shadows),
        cmocka_unit_test(a_plane_rebuilds_only_what_it_reaches),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
