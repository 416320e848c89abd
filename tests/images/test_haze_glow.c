/* SPDX-License-Identifier: MIT */
/* Lamps in view in rasterised haze, pixel by pixel, against integrals over the pixel. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "glb/shapes.h"
#include "renderer/base/matrix.h"
#include "renderer/image/tone_map.h"
#include "renderer/scene/atmosphere.h"
#include "tests/support/boxes.h"
#include "tests/support/image_checks.h"

enum { WIDTH = 160, HEIGHT = 90 };

static const double wall_z = -8; /* the camera stands at 0 and looks along -z */
static const double pane_z = -3;
static const double stain[3] = {0.9, 0.4, 0.1};

/* A black wall that fills the view, and before it a stained sheet over the left half. */
static void open_stage(struct rig_scene *rig, struct renderer *renderer, bool has_pane)
{
    const struct glb_material_desc wall = {
        .name = "Wall", .base_color = {0, 0, 0, 1}, .roughness = 1, .metallic = 1};
    const struct glb_material_desc pane = {.name = "Pane",
                                           .base_color = {stain[0], stain[1], stain[2], 1},
                                           .roughness = 1,
                                           .transmission = 1,
                                           .is_double_sided = true,
                                           .has_ior = true,
                                           .ior = 1};
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Glow", &err);
    assert_non_null(builder);
    builder_add_box(builder, &wall, (const double[]){-20, -20, wall_z - 1},
                    (const double[]){20, 20, wall_z});
    if (has_pane) {
        struct shape sheet = {0};
        shape_add_quad(&sheet, (const double[]){-10, -10, pane_z}, (const double[]){10, 0, 0},
                       (const double[]){0, 20, 0});
        int mesh =
            shape_give_mesh(&sheet, builder, "Pane", glb_builder_add_material(builder, &pane));
        glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Pane", .mesh = mesh});
    }
    assert_true(rig_scene_from_builder(rig, renderer, "glow", builder, &err));
}

static const struct view_light lamp = {.type = SCENE_LIGHT_POINT,
                                       .position = {0.7, 0.4, -2.5},
                                       .color = {1, 0.6f, 0.3f},
                                       .intensity = 10};

static struct view look(const struct view_light *light)
{
    return (struct view){
        .width_px = WIDTH,
        .height_px = HEIGHT,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .target = {0, 0, -1}, .fov_y_deg = 50},
        .lights = light,
        .light_count = 1,
        .atmosphere = {.density_per_m = 0.15, .color = {0.9f, 0.7f, 0.5f}, .anisotropy = 0.4},
        .quality = {.samples = 1, .shadows = SHADOWS_DEEP},
    };
}

static void expect(const struct image *image, int x, int y, int k, double expected,
                   double tolerance)
{
    double found = (double)image_pixel_f32(image, x, y)[k];
    if (!(fabs(found - expected) <= tolerance * (expected + 1e-3)))
        fail_msg("pixel (%d, %d), channel %d: %.6f instead of %.6f", x, y, k, found, expected);
}

/* Of the view's light, on a ray of the pixel up to a length, by steps of the angle at which the
 * lamp sees it. The haze is even. */
static double scattered(const struct view *view, const double way[3], double end, int k)
{
    enum { STEPS = 192 };
    const struct view_atmosphere *air = &view->atmosphere;
    const struct view_light *light = view->lights;
    const double nearest = vec3_dot(way, light->position);
    const double range = light->range > 0 ? (double)light->range : 1e9;
    const double apart = sqrt(vec3_dot(light->position, light->position) - nearest * nearest);
    const double first = atan(-nearest / apart), last = atan((end - nearest) / apart);
    double sum = 0;
    for (int i = 0; i < STEPS; i++) {
        double angle = first + (last - first) * (i + 0.5) / STEPS;
        double t = nearest + apart * tan(angle), away = apart / cos(angle);
        sum += atmosphere_phase(air, -sin(angle)) * fmax(1 - pow(away / range, 4), 0) *
               exp(-air->density_per_m * (t + away));
    }
    return sum * (last - first) / STEPS / apart * air->density_per_m * (double)air->color[k] *
           (double)light->color[k] * (double)light->intensity;
}

/* The mean over a pixel before the wall, and through the pane where it is there. */
static double find_glow(const struct view *view, int x, int y, int k, bool has_pane)
{
    enum { PARTS = 64 };
    struct view fine = *view;
    double sum = 0;
    fine.width_px *= PARTS;
    fine.height_px *= PARTS;
    for (int i = 0; i < PARTS * PARTS; i++) {
        double origin[3], way[3];
        view_ray(&fine, PARTS * x + i % PARTS, PARTS * y + i / PARTS, origin, way);
        double length = vec3_length(way);
        for (int j = 0; j < 3; j++)
            way[j] /= length;
        double end = wall_z / way[2], pane = pane_z / way[2];
        if (has_pane)
            sum += (1 - stain[k]) * scattered(view, way, pane, k);
        sum += (has_pane ? stain[k] : 1) * scattered(view, way, end, k);
    }
    return sum / (PARTS * PARTS);
}

/* Compares the pixels around a lamp with a picture of the same without what the haze scatters. */
static void expect_glow(const struct view *view, const struct image *image,
                        const struct image *bare, bool has_pane, double reach_px)
{
    const double *p = view->lights->position, scale = 0.5 * HEIGHT / tan(25 * M_PI / 180) / -p[2];
    const double px[2] = {0.5 * WIDTH + scale * p[0], 0.5 * HEIGHT - scale * p[1]};
    int count = 0;
    for (int at = 0; at < 9 * 9; at++) {
        int x = (int)px[0] - 4 + at % 9, y = (int)px[1] - 4 + at / 9;
        if (hypot(x + 0.5 - px[0], y + 0.5 - px[1]) > reach_px)
            continue;
        for (int k = 0; k < 3; k += 2)
            expect(image, x, y, k,
                   (double)image_pixel_f32(bare, x, y)[k] + find_glow(view, x, y, k, has_pane),
                   0.015);
        count++;
    }
    assert_true(count >= 9);
}

/* Columns are one pixel wide, or two with few slices. Clusters list lamps with a range, and those
 * that reach everywhere are beside them. */
static void pixels_around_a_lamp_have_its_glow(void **state)
{
    static const struct {
        int slices, samples;
        float range;
        bool has_pane;
    } cases[] = {{64, 1, 0, false}, {16, 4, 4, false}, {64, 4, 60, false}, {64, 4, 0, true}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct rig_scene rig;
        struct view_light own = lamp;
        own.range = cases[i].range;
        own.casts_no_shadow = i % 2;
        if (cases[i].has_pane)
            own.position[0] = -1.1, own.position[2] = -4.3;
        open_stage(&rig, *state, cases[i].has_pane);
        struct view view = look(&own), dark;
        view.quality.atmosphere_samples = cases[i].slices;
        view.quality.samples = cases[i].samples;
        dark = view;
        memset(dark.atmosphere.color, 0, sizeof dark.atmosphere.color);
        struct image image = shoot_color(*state, &rig, &view);
        struct image bare = shoot_color(*state, &rig, &dark); /* the pane is lit, too */
        expect_glow(&view, &image, &bare, cases[i].has_pane, cases[i].slices == 16 ? 4 : 2);
        image_finish(&bare);
        image_finish(&image);
        rig_scene_finish(&rig, *state);
    }
}

/* A picture over a backdrop is mapped when that light is in it: the wall covers all of it. */
static void the_glow_is_mapped_with_the_picture(void **state)
{
    struct rig_scene rig;
    struct view view = look(&lamp);
    open_stage(&rig, *state, false);
    view.quality.samples = 4;
    struct image linear = shoot_color(*state, &rig, &view);
    view.background[1] = view.background[3] = 1;
    view.screen.has_backdrop = true;
    view.screen.mapping = (struct tone_map_desc){.exposure_ev = 1};
    struct image mapped = shoot_color(*state, &rig, &view);
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        const float *seen = image_pixel_f32(&linear, i % WIDTH, i / WIDTH);
        float color[3] = {seen[0], seen[1], seen[2]};
        tone_map_color(&view.screen.mapping, color);
        for (int k = 0; k < 3; k++)
            expect(&mapped, i % WIDTH, i / WIDTH, k, (double)color[k], 1e-4);
    }
    image_finish(&linear);
    image_finish(&mapped);
    rig_scene_finish(&rig, *state);
}

static void lamps_out_of_view_cost_nothing(void **state)
{
    const struct view_light sun = {.type = SCENE_LIGHT_DIRECTIONAL,
                                   .direction = {0, -1, 0},
                                   .color = {1, 1, 1},
                                   .intensity = 3};
    struct view_light behind = lamp;
    const struct view_light *lights[] = {&lamp, &behind, &sun};
    struct rig_scene rig;
    behind.position[2] = 2.5;
    open_stage(&rig, *state, false);
    for (int i = 0; i < 3; i++) {
        struct view view = look(lights[i]);
        struct frame frame;
        shoot(*state, &rig, &view, &frame);
        assert_true(report_has_pass(&frame.report, "atmosphere.light", "froxels"));
        assert_true(report_has_pass(&frame.report, "atmosphere.glow", "ways") == (i == 0));
        assert_true(report_has_pass(&frame.report, "atmosphere.glow-add", "ways") == (i == 0));
        frame_finish(&frame);
    }
    rig_scene_finish(&rig, *state);
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(pixels_around_a_lamp_have_its_glow),
        cmocka_unit_test(the_glow_is_mapped_with_the_picture),
        cmocka_unit_test(lamps_out_of_view_cost_nothing),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
