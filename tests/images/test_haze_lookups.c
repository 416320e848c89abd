/* SPDX-License-Identifier: MIT */
/* How many texels of shadow maps are asked for in haze. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "tests/support/boxes.h"
#include "tests/support/image_checks.h"

static void open_scene(struct rig_scene *rig, struct renderer *renderer)
{
    static const struct glb_material_desc dull = {.name = "Dull", .base_color = {1, 1, 1, 1}};
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Block", &err);
    assert_non_null(builder);
    builder_add_box(builder, &dull, (const double[]){-9, -9, -9}, (const double[]){9, 9, -8});
    builder_add_box(builder, &dull, (const double[]){0, 0, -4}, (const double[]){1, 1, -3});
    assert_true(rig_scene_from_builder(rig, renderer, "block", builder, &err));
}

static uint64_t count_lookups(struct renderer *renderer, const struct rig_scene *rig, int taps,
                              double density_per_m)
{
    const struct view_light sun = {.type = SCENE_LIGHT_DIRECTIONAL,
                                   .direction = {-1, -1, -1},
                                   .color = {1, 1, 1},
                                   .intensity = 3};
    const struct view view = {
        .width_px = 80,
        .height_px = 45,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .target = {0, 0, -1}, .fov_y_deg = 45},
        .studio = VIEW_STUDIO_OFF,
        .lights = &sun,
        .light_count = 1,
        .quality = {.samples = 1, .shadows = SHADOWS_DEEP, .shadow_taps = taps},
        .atmosphere = {.density_per_m = density_per_m, .color = {1, 1, 1}}};
    struct error err = {0};
    struct frame frame;
    assert_true(renderer_render(renderer, rig->key, &view, &frame, &err));
    uint64_t lookups = frame.report.counts.lookups;
    frame_finish(&frame);
    return lookups;
}

/* Columns and slices smooth what four texels would; more of them are asked for where a request has
 * more than the default. */
static void points_in_haze_ask_one_texel(void **state)
{
    static const int taps[] = {1, 4, 16};
    struct rig_scene rig;
    uint64_t in_haze[3], of_surfaces[3];
    open_scene(&rig, *state);
    for (int i = 0; i < 3; i++) {
        of_surfaces[i] = count_lookups(*state, &rig, taps[i], 0);
        in_haze[i] = count_lookups(*state, &rig, taps[i], 0.1) - of_surfaces[i];
    }
    assert_int_not_equal(in_haze[0], 0);
    assert_int_equal(in_haze[1], in_haze[0]);
    assert_int_equal(in_haze[2], 16 * in_haze[0]);
    assert_int_equal(of_surfaces[1], 4 * of_surfaces[0]);
    rig_scene_finish(&rig, *state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(points_in_haze_ask_one_texel),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
