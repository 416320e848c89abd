/* SPDX-License-Identifier: MIT */
/* Density grids in linked lists as published (Lindbeck 2015): an element of each list for a grid,
 * and what his figures 3.7 to 3.9 show. Each artefact is a number that `faithful` has, and that the
 * default, which has the law of Beer and Lambert, has not. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "renderer/base/matrix.h"
#include "tests/support/boxes.h"
#include "tests/support/image_checks.h"

enum { WIDTH = 48, HEIGHT = 27, PLATES = 3 };

/* The camera stands at 0 and looks along -z; even smoke lies in this box, which scatters nothing,
 * unless the stage says so. */
static const double low[3] = {-1.5, -0.8, -5}, high[3] = {1.5, 0.8, -3}, wall_z = -6;
static const double density = 0.6, extinction[3] = {1, 1.5, 0.25};
/* Plates stand in it, at these parts of its depth; light and sight come from the front. */
static const double plate_part[PLATES] = {0.25, 0.5, 0.75};
static const double plate_x[PLATES] = {-0.6, 0, 0.6};

struct stage {
    bool has_smoke, has_plates, has_wall, scatters;
    float glow; /* of plates and wall */
    int copies; /* of the smoke, which share its density; 0 means 1 */
};

static double plate_z(int plate)
{
    return high[2] - plate_part[plate] * (high[2] - low[2]);
}

static void add_smoke(struct glb_builder *builder, bool scatters, int copies)
{
    static const float one[1] = {1};
    struct glb_grid_desc desc = {.name = "Smoke",
                                 .size = {1, 1, 1},
                                 .values = one,
                                 .density = density / copies,
                                 .is_black = !scatters};
    for (int k = 0; k < 3; k++) {
        desc.low[k] = low[k];
        desc.high[k] = high[k];
        desc.extinction[k] = extinction[k];
    }
    int grid = glb_builder_add_grid(builder, &desc);
    for (int i = 0; i < copies; i++)
        glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Smoke", .grid = grid});
}

static void open_stage(struct rig_scene *rig, struct renderer *renderer, const struct stage *stage)
{
    const float level = stage->glow, base = level > 0 ? 0 : 0.8f;
    const struct glb_material_desc dull = {.name = "Dull",
                                           .base_color = {base, base, base, 1},
                                           .roughness = 1,
                                           .emissive = {level, level, level}};
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Smoke", &err);
    void *glb;
    size_t size_bytes;
    assert_non_null(builder);
    if (stage->has_wall)
        builder_add_box(builder, &dull, (const double[]){-20, -20, wall_z - 1},
                        (const double[]){20, 20, wall_z});
    for (int i = 0; stage->has_plates && i < PLATES; i++)
        builder_add_box(builder, &dull, (const double[]){plate_x[i] - 0.2, -0.2, plate_z(i) - 0.02},
                        (const double[]){plate_x[i] + 0.2, 0.2, plate_z(i)});
    if (stage->has_smoke)
        add_smoke(builder, stage->scatters, stage->copies ? stage->copies : 1);
    if (!glb_builder_finish(builder, &glb, &size_bytes, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    rig_scene_open(rig, renderer, "smoke", glb, size_bytes);
    free(glb);
}

static struct view look(const struct view_light *light, bool is_faithful)
{
    return (struct view){
        .width_px = WIDTH,
        .height_px = HEIGHT,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .target = {0, 0, -1}, .fov_y_deg = 30},
        .studio = VIEW_STUDIO_OFF,
        .lights = light,
        .light_count = light ? 1 : 0,
        .quality = {.samples = 1, .shadows = SHADOWS_DEEP_LINKED, .faithful = is_faithful},
    };
}

/* The picture with smoke, and without. */
static void shoot_pair(struct renderer *renderer, const struct stage *stage,
                       const struct view *view, struct image pair[2])
{
    for (int i = 0; i < 2; i++) {
        struct rig_scene rig;
        struct stage own = *stage;
        own.has_smoke = i == 0;
        open_stage(&rig, renderer, &own);
        pair[i] = shoot_color(renderer, &rig, view);
        rig_scene_finish(&rig, renderer);
    }
}

static void finish_pair(struct image pair[2])
{
    image_finish(&pair[0]);
    image_finish(&pair[1]);
}

/* What smoke leaves of the pixel's light. */
static double left_at(const struct image pair[2], const struct view *view, const double at[3],
                      int k)
{
    double open = (double)image_at(&pair[1], view, at)[k];
    assert_true(open > 0.01);
    return (double)image_at(&pair[0], view, at)[k] / open;
}

static void expect_left(const struct image pair[2], const struct view *view, const double at[3],
                        int k, double expected, double tolerance, const char *what)
{
    double left = left_at(pair, view, at, k);
    if (fabs(left - expected) > tolerance)
        fail_msg("%s at %g %g %g: channel %d is left %.6f, not %.6f", what, at[0], at[1], at[2], k,
                 left, expected);
}

static double let_through(int k, double length_m)
{
    return exp(-density * extinction[k] * length_m);
}

/* An element holds eight bits of what all of the smoke lets through; before its end the light falls
 * in a straight line. */
static double published(int k, double length_m, double part)
{
    double all = round(255 * let_through(k, length_m)) / 255;
    return 1 + (all - 1) * fmin(part, 1);
}

/* On the ray from the eye to the point, within the box. */
static double seen_m(const double at[3])
{
    double along = fmin((high[2] - fmax(at[2], low[2])) / -at[2], 1);
    return along * vec3_length(at);
}

static const struct view_light sun = {
    .type = SCENE_LIGHT_DIRECTIONAL, .direction = {0, 0, -1}, .color = {1, 1, 1}, .intensity = 3};

/* The law of the one element: at the end of the smoke it is right but for its bits, and inside it
 * is the straight line. The source's plates would hide the smoke before them (figure 3.7). */
static void light_falls_in_a_line_as_published(void **state)
{
    const double depth = high[2] - low[2], behind[3] = {0.95, 0.6, wall_z};
    for (int is_faithful = 0; is_faithful < 2; is_faithful++) {
        struct image pair[2];
        struct view view = look(&sun, is_faithful);
        shoot_pair(*state, &(struct stage){.has_plates = true, .has_wall = true}, &view, pair);
        for (int k = 0; k < 3; k++) {
            for (int i = 0; i < PLATES; i++) {
                const double at[3] = {plate_x[i], 0, plate_z(i)};
                double part = plate_part[i];
                double exact = let_through(k, part * depth) * let_through(k, seen_m(at));
                expect_left(pair, &view, at, k, is_faithful ? published(k, depth, part) : exact,
                            is_faithful ? 1e-4 : 1e-3, "plate");
            }
            double lit = is_faithful ? published(k, depth, 1) : let_through(k, depth);
            expect_left(pair, &view, behind, k, lit * let_through(k, seen_m(behind)), 1e-3, "wall");
        }
        finish_pair(pair);
    }
}

/* Figure 3.7: smoke is not drawn in pixels where something stands in its box, whose back faces are
 * hidden there. */
static void what_stands_in_smoke_hides_it_as_published(void **state)
{
    const double behind[3] = {0.95, 0.6, wall_z};
    for (int is_faithful = 0; is_faithful < 2; is_faithful++) {
        struct image pair[2];
        struct view view = look(NULL, is_faithful);
        const struct stage stage = {.has_plates = true, .has_wall = true, .glow = 0.5f};
        shoot_pair(*state, &stage, &view, pair);
        for (int k = 0; k < 3; k++) {
            for (int i = 0; i < PLATES; i++) {
                const double at[3] = {plate_x[i], 0, plate_z(i)};
                expect_left(pair, &view, at, k, is_faithful ? 1 : let_through(k, seen_m(at)), 1e-3,
                            "plate");
            }
            expect_left(pair, &view, behind, k, let_through(k, seen_m(behind)), 1e-3, "wall");
        }
        finish_pair(pair);
    }
}

/* Figure 3.9: a lamp in smoke whose frustum ends before the back face of the box has no element
 * there, so that the smoke before it shadows nothing. With a longer reach it has. */
static void lamps_in_smoke_need_its_back_face_as_published(void **state)
{
    const double at[3] = {plate_x[1], 0, plate_z(1)}, lamp_z = -3.3;
    const double reaches[2] = {1.6, 4}, to_back = lamp_z - low[2], to_plate = lamp_z - at[2];
    for (int i = 0; i < 4; i++) {
        bool is_faithful = i % 2;
        struct image pair[2];
        const struct view_light lamp = {.type = SCENE_LIGHT_POINT,
                                        .position = {0, 0, lamp_z},
                                        .color = {1, 1, 1},
                                        .intensity = 3,
                                        .range = (float)reaches[i / 2]};
        struct view view = look(&lamp, is_faithful);
        shoot_pair(*state, &(struct stage){.has_plates = true}, &view, pair);
        for (int k = 0; k < 3; k++) {
            double exact = let_through(k, to_plate) * let_through(k, seen_m(at));
            double held = reaches[i / 2] < to_back ? 1 : published(k, to_back, to_plate / to_back);
            expect_left(pair, &view, at, k, is_faithful ? held : exact, 2e-3, "plate");
        }
        finish_pair(pair);
    }
}

/* Pixels of a wall that only its own shadow darkens, as a share of all. */
static double striped_share(struct renderer *renderer, double from_normal_deg, bool is_faithful)
{
    struct rig_scene rig;
    struct view_light slanted = sun;
    double angle = from_normal_deg * M_PI / 180;
    slanted.direction[0] = sin(angle);
    slanted.direction[2] = -cos(angle);
    struct view view = look(&slanted, is_faithful);
    view.width_px = 768;
    view.height_px = 8;
    view.camera.fov_y_deg = 0.45;
    view.quality.shadow_resolution = 256;
    view.quality.shadow_taps = 1;
    open_stage(&rig, renderer, &(struct stage){.has_wall = true});
    struct image image = shoot_color(renderer, &rig, &view);
    int dark = 0;
    for (int y = 0; y < view.height_px; y++)
        for (int x = 0; x < view.width_px; x++)
            dark += image_pixel_f32(&image, x, y)[0] == 0;
    image_finish(&image);
    rig_scene_finish(&rig, renderer);
    return (double)dark / (view.width_px * view.height_px);
}

/* Figure 3.8: a point up to half a texel off its centre lies up to tan / 2 texel widths deeper than
 * the surface is there; the published offset of one such width leaves stripes beyond tan = 2. */
static void grazed_surfaces_shadow_themselves_as_published(void **state)
{
    static const double angles[3] = {60, 75, 82};
    for (int i = 0; i < 3; i++) {
        double expected = fmax(0.5 - 1 / tan(angles[i] * M_PI / 180), 0);
        double share = striped_share(*state, angles[i], true);
        if (fabs(share - expected) > (expected > 0 ? 0.03 : 0))
            fail_msg("at %g degrees %.4f of the wall are dark, not %.4f", angles[i], share,
                     expected);
        assert_true(striped_share(*state, angles[i], false) == 0);
    }
}

/* What a plane leaves of smoke is the element's range. */
static void planes_shorten_the_element(void **state)
{
    static const double planes[1][4] = {{0, 0, -1, -4}}; /* the front half goes */
    const double at[3] = {plate_x[2], 0, plate_z(2)}, left_m = -4 - low[2];
    struct image pair[2];
    struct view view = look(&sun, true);
    view.clip_planes = planes;
    view.clip_plane_count = 1;
    shoot_pair(*state, &(struct stage){.has_plates = true}, &view, pair);
    for (int k = 0; k < 3; k++)
        expect_left(pair, &view, at, k, published(k, left_m, (-4 - at[2]) / left_m), 1e-4, "plate");
    finish_pair(pair);
}

/* The light of the middle plate, through the smoke's list. */
static double plate_light(struct renderer *renderer, const struct rig_scene *rig,
                          const struct view *view, bool reuses)
{
    const double at[3] = {plate_x[1], 0, plate_z(1)};
    struct frame frame;
    shoot(renderer, rig, view, &frame);
    double light = (double)image_at(&frame.outputs[VIEW_OUTPUT_COLOR], view, at)[0];
    assert_true(report_has_reused(&frame.report, "shadow.deep-linked") == reuses);
    frame_finish(&frame);
    return light;
}

/* Lists stand while the camera moves, though grids are read in its space, and are made anew for
 * smoke of another density. */
static void lists_with_smoke_stand_until_it_changes(void **state)
{
    const double depth = high[2] - low[2];
    struct view_grid_override thicker = {
        .grid = "Smoke", .has_density = true, .density = 2 * density};
    struct rig_scene rig;
    struct view view = look(&sun, true);
    open_stage(&rig, *state, &(struct stage){.has_smoke = true, .has_plates = true});
    double first = plate_light(*state, &rig, &view, false);
    view.camera.eye[1] = 0.3;
    double again = plate_light(*state, &rig, &view, true);
    view.grids = &thicker;
    view.grid_override_count = 1;
    double thick = plate_light(*state, &rig, &view, false);
    view.camera.eye[1] = 0;
    double thick_again = plate_light(*state, &rig, &view, true);
    double expected = (1 + round(255 * let_through(0, 2 * depth)) / 255) / 2;
    assert_true(fabs(thick_again / first - expected / published(0, depth, 0.5)) < 1e-4);
    assert_true(fabs(thick / again - thick_again / first) < 1e-4);
    rig_scene_finish(&rig, *state);
}

/* Smoke in its own shadow, without any other caster: halfway through its box the light that it
 * scatters has the straight line, too. Of many grids each has its element and its line; lists are
 * made again where that is more than there was room for. */
static void expect_own_shadow(struct renderer *renderer, int copies)
{
    struct image images[2];
    struct view_light above = sun;
    above.direction[1] = -1;
    above.direction[2] = 0;
    for (int is_faithful = 0; is_faithful < 2; is_faithful++) {
        struct rig_scene rig;
        struct view view = look(&above, is_faithful);
        open_stage(&rig, renderer,
                   &(struct stage){.has_smoke = true, .scatters = true, .copies = copies});
        images[is_faithful] = shoot_color(renderer, &rig, &view);
        rig_scene_finish(&rig, renderer);
    }
    const double height = high[1] - low[1];
    for (int k = 0; k < 3; k++) {
        double found = (double)image_pixel_f32(&images[1], WIDTH / 2, HEIGHT / 2)[k] /
                       (double)image_pixel_f32(&images[0], WIDTH / 2, HEIGHT / 2)[k];
        double each = round(255 * let_through(k, height / copies)) / 255;
        double expected = pow((1 + each) / 2, copies) / let_through(k, 0.5 * height);
        if (fabs(found - expected) > 0.01 * expected)
            fail_msg("%d grids: channel %d: %.5f times the light, not %.5f", copies, k, found,
                     expected);
    }
    image_finish(&images[0]);
    image_finish(&images[1]);
}

static void smoke_shadows_itself_in_a_line_as_published(void **state)
{
    expect_own_shadow(*state, 1);
    expect_own_shadow(*state, 8);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(light_falls_in_a_line_as_published),
        cmocka_unit_test(what_stands_in_smoke_hides_it_as_published),
        cmocka_unit_test(lamps_in_smoke_need_its_back_face_as_published),
        cmocka_unit_test(grazed_surfaces_shadow_themselves_as_published),
        cmocka_unit_test(planes_shorten_the_element),
        cmocka_unit_test(lists_with_smoke_stand_until_it_changes),
        cmocka_unit_test(smoke_shadows_itself_in_a_line_as_published),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
