/* SPDX-License-Identifier: MIT */
/* The output of optical depth against closed forms: haze, density grids, bodies and all of them
 * together, to a wall and without an end. tests/images/test_media_view.c has bodies alone. */
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

enum { WIDTH = 48, HEIGHT = 27 };
static const uint32_t only_depth = 1u << VIEW_OUTPUT_OPTICAL_DEPTH;

/* The camera stands at 0 and looks along -z: past a body and through a grid to a wall. */
static const double grid_low[3] = {-1.2, -0.8, -5}, grid_high[3] = {1.2, 0.8, -3};
static const double body_low[3] = {-0.7, -0.5, -2}, body_high[3] = {0.9, 0.4, -1.5};
static const double wall_z = -8, grid_density = 0.6;
static const double grid_extinction[3] = {1, 1.5, 0.25}, glass[3] = {0.9, 0.4, 0.1};
static const double glass_m = 0.5; /* after which that much is left */

struct stage {
    bool has_wall, has_body, has_pane;
    int grids; /* one over the other */
};

enum { RAMP = 9 };

/* Its value grows by 1 for each voxel towards the eye, and is the same across. */
static void add_ramp(struct glb_builder *builder)
{
    float values[RAMP];
    for (int i = 0; i < RAMP; i++)
        values[i] = (float)i;
    struct glb_grid_desc desc = {
        .name = "Ramp", .size = {1, 1, RAMP}, .values = values, .density = grid_density};
    memcpy(desc.low, grid_low, sizeof desc.low);
    memcpy(desc.high, grid_high, sizeof desc.high);
    memcpy(desc.extinction, grid_extinction, sizeof desc.extinction);
    int grid = glb_builder_add_grid(builder, &desc);
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Ramp", .grid = grid});
}

static void add_body(struct glb_builder *builder)
{
    const struct glb_material_desc body = {.name = "Body",
                                           .roughness = 0.5,
                                           .transmission = 1,
                                           .has_ior = true,
                                           .ior = 1,
                                           .thickness = 1,
                                           .attenuation_distance = glass_m,
                                           .attenuation_color = {glass[0], glass[1], glass[2]}};
    builder_add_box(builder, &body, body_low, body_high);
}

static void open_stage(struct rig_scene *rig, struct renderer *renderer, const struct stage *stage)
{
    const struct glb_material_desc wall = {.name = "Wall", .roughness = 1};
    const struct glb_material_desc pane = {.name = "Pane",
                                           .base_color = {0.5, 0.5, 0.5, 1},
                                           .transmission = 1,
                                           .has_ior = true,
                                           .ior = 1};
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Optical depth", &err);
    void *glb;
    size_t size_bytes;
    assert_non_null(builder);
    if (stage->has_wall)
        builder_add_box(builder, &wall, (const double[]){-20, -20, wall_z - 1},
                        (const double[]){20, 20, wall_z});
    if (stage->has_pane)
        builder_add_box(builder, &pane, (const double[]){-20, -20, -1.1},
                        (const double[]){20, 20, -1});
    if (stage->has_body)
        add_body(builder);
    for (int i = 0; i < stage->grids; i++)
        add_ramp(builder);
    if (!glb_builder_finish(builder, &glb, &size_bytes, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    rig_scene_open(rig, renderer, "optical depth", glb, size_bytes);
    free(glb);
}

static struct view look(void)
{
    return (struct view){
        .width_px = WIDTH,
        .height_px = HEIGHT,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .target = {0, 0, -1}, .fov_y_deg = 40},
        .outputs = only_depth,
        .ignore_scene_lights = true,
        .quality.samples = 1,
    };
}

/* ---- closed forms ---- */

/* Where the ray is in the box, in metres. */
static bool meet_box(const double low[3], const double high[3], const double p[3],
                     const double way[3], double range[2])
{
    for (int k = 0; k < 3; k++) {
        double a = (low[k] - p[k]) / way[k], b = (high[k] - p[k]) / way[k];
        if (way[k] == 0)
            continue;
        range[0] = fmax(range[0], fmin(a, b));
        range[1] = fmin(range[1], fmax(a, b));
    }
    return range[0] < range[1];
}

/* The integral of the ramp over z, from its far face on: even in the outer half voxels. */
static double ramp_up_to(double z)
{
    double voxel = (grid_high[2] - grid_low[2]) / RAMP, last = RAMP - 1;
    double at = (z - grid_low[2]) / voxel - 0.5;
    double linear = fmin(fmax(at, 0), last), beyond = fmax(at - last, 0);
    return voxel * (0.5 * linear * linear + last * beyond);
}

static double depth_of_grid(const double p[3], const double way[3], double end, int k)
{
    double range[2] = {0, end};
    if (!meet_box(grid_low, grid_high, p, way, range))
        return 0;
    double near = p[2] + range[0] * way[2], far = p[2] + range[1] * way[2];
    return grid_density * grid_extinction[k] * (ramp_up_to(near) - ramp_up_to(far)) / -way[2];
}

static double depth_of_body(const double p[3], const double way[3], int k)
{
    double range[2] = {0, INFINITY};
    if (!meet_box(body_low, body_high, p, way, range))
        return 0;
    return -log(glass[k]) / glass_m * (range[1] - range[0]);
}

/* The antiderivative of the haze's density over the height. */
static double haze_column(const struct view_atmosphere *air, double y)
{
    double above = y - air->base_m;
    return above < 0 ? above : -air->falloff_m * expm1(-above / air->falloff_m);
}

static double depth_of_haze(const struct view_atmosphere *air, const double p[3],
                            const double way[3], double end)
{
    if (!(air->falloff_m > 0))
        return air->density_per_m > 0 ? air->density_per_m * end : 0;
    if (isinf(end) && way[1] <= 0)
        return INFINITY;
    if (way[1] == 0)
        return air->density_per_m * end * exp(-fmax(p[1] - air->base_m, 0) / air->falloff_m);
    double rise =
        haze_column(air, isinf(end) ? INFINITY : p[1] + end * way[1]) - haze_column(air, p[1]);
    return air->density_per_m * rise / way[1];
}

/* At every pixel. In f32 a ray enters a grid of up to 7.2 1/m within 5e-7 m, which matters where it
 * leaves soon. */
static void expect_depths(const struct image *found, const struct view *view,
                          const struct stage *stage, double relative)
{
    int finite = 0;
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            double eye[3], way[3];
            view_ray(view, x, y, eye, way);
            vec3_normalize(way);
            double end = stage->has_wall ? (wall_z - eye[2]) / way[2] : INFINITY;
            double haze = depth_of_haze(&view->atmosphere, eye, way, end);
            for (int k = 0; k < 3; k++) {
                double expected = haze + stage->grids * depth_of_grid(eye, way, end, k) +
                                  (stage->has_body ? depth_of_body(eye, way, k) : 0);
                double is = (double)image_pixel_f32(found, x, y)[k];
                finite += isfinite(is);
                if (is != expected &&
                    !(fabs(is - expected) <= relative * expected + 1e-6 + 5e-6 * stage->grids))
                    fail_msg("channel %d of %d, %d is %.9g, not %.9g", k, x, y, is, expected);
            }
        }
    assert_true(finite > WIDTH * HEIGHT);
}

static void check(void **state, const struct view *view, const struct stage *stage, double relative)
{
    struct rig_scene rig;
    struct frame frame;
    open_stage(&rig, *state, stage);
    shoot(*state, &rig, view, &frame);
    expect_depths(&frame.outputs[VIEW_OUTPUT_OPTICAL_DEPTH], view, stage, relative);
    frame_finish(&frame);
    rig_scene_finish(&rig, *state);
}

/* ---- the tests ---- */

static void haze_is_as_deep_as_its_closed_form(void **state)
{
    static const struct view_atmosphere airs[] = {
        {.density_per_m = 0.15},
        {.density_per_m = 0.4, .base_m = -0.6, .falloff_m = 0.9}, /* the eye is above the base */
        {.density_per_m = 0.4, .base_m = 0.7, .falloff_m = 2.5},  /* and below it */
        {.density_per_m = 40, .base_m = -9, .falloff_m = 1},      /* and nine falloffs above it */
    };
    for (size_t i = 0; i < sizeof airs / sizeof *airs; i++)
        for (int has_wall = 0; has_wall < 2; has_wall++) {
            struct view view = look();
            view.atmosphere = airs[i];
            if (!has_wall && !(airs[i].falloff_m > 0))
                continue; /* infinite everywhere */
            check(state, &view, &(struct stage){.has_wall = has_wall}, 1e-5);
        }
}

static void even_haze_without_an_end_is_infinitely_deep(void **state)
{
    struct rig_scene rig;
    struct frame frame;
    struct view view = look();
    view.atmosphere.density_per_m = 1e-6;
    open_stage(&rig, *state, &(struct stage){.has_body = true});
    shoot(*state, &rig, &view, &frame);
    const float *depth = frame.outputs[VIEW_OUTPUT_OPTICAL_DEPTH].pixels;
    for (int i = 0; i < 3 * WIDTH * HEIGHT; i++)
        assert_true(isinf(depth[i]) && depth[i] > 0);
    frame_finish(&frame);
    rig_scene_finish(&rig, *state);
}

static void a_linear_ramp_is_as_deep_as_its_closed_form(void **state)
{
    struct view view = look();
    check(state, &view, &(struct stage){.grids = 1, .has_wall = true}, 4e-6);
    check(state, &view, &(struct stage){.grids = 3}, 4e-6);
    view.camera.eye[0] = 0.3; /* inside */
    view.camera.eye[2] = -4.2;
    view.camera.target[2] = -5;
    check(state, &view, &(struct stage){.grids = 1, .has_wall = true}, 4e-6);
}

static void depths_of_haze_grids_and_bodies_add_up_and_filters_are_none(void **state)
{
    struct view view = look();
    view.atmosphere =
        (struct view_atmosphere){.density_per_m = 0.4, .base_m = -0.6, .falloff_m = 0.9};
    for (int has_pane = 0; has_pane < 2; has_pane++)
        check(state, &view,
              &(struct stage){.grids = 1, .has_wall = true, .has_body = true, .has_pane = has_pane},
              2e-5);
}

/* Its logarithm is what the reference shows of a glowing wall, which is dimmed by nothing else. */
static void the_reference_is_dimmed_by_the_optical_depth(void **state)
{
    const struct stage stage = {.grids = 1, .has_wall = true, .has_body = true};
    const struct view_material_override glow[] = {
        {.material = "Wall", .has_emissive = true, .emissive = {1, 1, 1}}};
    struct rig_scene rig;
    struct frame frame;
    struct view view = look();
    view.atmosphere = (struct view_atmosphere){.density_per_m = 0.1};
    view.studio = VIEW_STUDIO_OFF;
    view.materials = glow;
    view.material_override_count = 1;
    view.outputs |= 1u << VIEW_OUTPUT_COLOR;
    view.quality.shadows = SHADOWS_RAYTRACED;
    view.quality.reference = true;
    open_stage(&rig, *state, &stage);
    shoot(*state, &rig, &view, &frame);
    int compared = 0;
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            const float *tau = image_pixel_f32(&frame.outputs[VIEW_OUTPUT_OPTICAL_DEPTH], x, y);
            const float *seen = image_pixel_f32(&frame.outputs[VIEW_OUTPUT_COLOR], x, y);
            for (int k = 0; k < 3; k++, compared++)
                if (fabs((double)seen[k] - exp(-(double)tau[k])) > 2e-5)
                    fail_msg("channel %d of %d, %d: %.9g is seen, the depth is %.9g", k, x, y,
                             (double)seen[k], (double)tau[k]);
        }
    assert_int_equal(compared, 3 * WIDTH * HEIGHT);
    frame_finish(&frame);
    rig_scene_finish(&rig, *state);
}

/* A plane through the grid takes away what lies behind it, and nothing of the haze. */
static void clip_planes_cut_grids_and_no_haze(void **state)
{
    const double cut_z = -4.1, planes[1][4] = {{0, 0, 1, -cut_z}};
    struct rig_scene rig;
    struct frame frame;
    struct view view = look();
    view.atmosphere = (struct view_atmosphere){.density_per_m = 0.2, .falloff_m = 1};
    view.clip_planes = planes;
    view.clip_plane_count = 1;
    open_stage(&rig, *state, &(struct stage){.grids = 1});
    shoot(*state, &rig, &view, &frame);
    for (int y = 0; y < HEIGHT / 2; y++) /* those that climb, where the haze ends */
        for (int x = 0; x < WIDTH; x++) {
            double eye[3], way[3];
            view_ray(&view, x, y, eye, way);
            vec3_normalize(way);
            for (int k = 0; k < 3; k++) {
                double expected = depth_of_haze(&view.atmosphere, eye, way, INFINITY) +
                                  depth_of_grid(eye, way, cut_z / way[2], k);
                double is =
                    (double)image_pixel_f32(&frame.outputs[VIEW_OUTPUT_OPTICAL_DEPTH], x, y)[k];
                assert_true(fabs(is - expected) <= 1e-5 * expected);
            }
        }
    frame_finish(&frame);
    rig_scene_finish(&rig, *state);
}

/* Also where rays draw the picture, which have no such bound. */
static void more_grids_than_a_device_sums_are_refused_by_name(void **state)
{
    struct rig_scene rig;
    open_stage(&rig, *state, &(struct stage){.grids = 9});
    for (int has_color = 0; has_color < 2; has_color++) {
        struct view view = look();
        struct frame frame;
        struct error err = {0};
        view.outputs |= has_color ? 1u << VIEW_OUTPUT_COLOR : 0;
        view.quality.shadows = SHADOWS_RAYTRACED;
        assert_false(renderer_render(*state, rig.key, &view, &frame, &err));
        assert_int_equal(err.code, ERROR_UNSUPPORTED);
        assert_string_equal(err.message, "more than 8 density grids are seen, and the output "
                                         "optical_depth has no more");
    }
    rig_scene_finish(&rig, *state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(haze_is_as_deep_as_its_closed_form),
        cmocka_unit_test(even_haze_without_an_end_is_infinitely_deep),
        cmocka_unit_test(a_linear_ramp_is_as_deep_as_its_closed_form),
        cmocka_unit_test(depths_of_haze_grids_and_bodies_add_up_and_filters_are_none),
        cmocka_unit_test(the_reference_is_dimmed_by_the_optical_depth),
        cmocka_unit_test(clip_planes_cut_grids_and_no_haze),
        cmocka_unit_test(more_grids_than_a_device_sums_are_refused_by_name),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
