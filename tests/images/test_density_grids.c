/* SPDX-License-Identifier: MIT */
/* Smoke in ray traced and in rasterised pictures: density grids against closed forms and fine sums
 * of single scattering, what they let through, how they are cut, and which techniques refuse them.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "renderer/base/matrix.h"
#include "renderer/frame/renderer_internal.h"
#include "tests/support/boxes.h"
#include "tests/support/image_checks.h"

enum { WIDTH = 32, HEIGHT = 18 };

/* The camera stands at 0 and looks along -z; the grid lies in this box. */
static const double low[3] = {-1.2, -0.8, -5}, high[3] = {1.2, 0.8, -3};
static const double wall_z = -8, density = 0.6, g = 0.3;
static const double albedo[3] = {0.9, 0.6, 0.3}, extinction[3] = {1, 1.5, 0.25};

struct stage {
    uint32_t size[3];
    const float *values;
    double wall_glow;
    bool has_wall, is_halved; /* the grid as two, which meet at x = 0 */
};

static void add_grid(struct glb_builder *builder, const struct stage *stage, int half)
{
    struct glb_grid_desc desc = {
        .name = half ? "Right" : "Smoke", .density = density, .anisotropy = g};
    double from = stage->is_halved && half ? 0 : low[0],
           to = stage->is_halved && !half ? 0 : high[0];
    memcpy(desc.size, stage->size, sizeof desc.size);
    desc.values = stage->values;
    for (int k = 0; k < 3; k++) {
        desc.low[k] = k ? low[k] : from;
        desc.high[k] = k ? high[k] : to;
        desc.color[k] = albedo[k];
        desc.extinction[k] = extinction[k];
    }
    int grid = glb_builder_add_grid(builder, &desc);
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = desc.name, .grid = grid});
}

static void open_stage(struct rig_scene *rig, struct renderer *renderer, const struct stage *stage)
{
    const double level = stage->wall_glow / 4;
    const struct glb_material_desc wall = {.name = "Wall",
                                           .base_color = {0, 0, 0, 1},
                                           .roughness = 1,
                                           .metallic = 1,
                                           .emissive = {level, level, level},
                                           .emissive_strength = 4};
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Smoke", &err);
    void *glb;
    size_t size_bytes;
    assert_non_null(builder);
    if (stage->has_wall)
        builder_add_box(builder, &wall, (const double[]){-20, -20, wall_z - 1},
                        (const double[]){20, 20, wall_z});
    for (int half = 0; half <= stage->is_halved; half++)
        add_grid(builder, stage, half);
    if (!glb_builder_finish(builder, &glb, &size_bytes, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    rig_scene_open(rig, renderer, "smoke", glb, size_bytes);
    free(glb);
}

static const struct view_light sun = {.type = SCENE_LIGHT_DIRECTIONAL,
                                      .direction = {0, -1, 0},
                                      .color = {1, 0.8f, 0.5f},
                                      .intensity = 30};
static const struct view_light lamp_outside = {.type = SCENE_LIGHT_POINT,
                                               .position = {0.3, 1.4, -3.5},
                                               .color = {1, 0.6f, 0.3f},
                                               .intensity = 10};
static const struct view_light lamp_inside = {.type = SCENE_LIGHT_POINT,
                                              .position = {0.31, 0.13, -4.1},
                                              .color = {1, 0.6f, 0.3f},
                                              .intensity = 10};

static struct view look(const struct view_light *lights, size_t count)
{
    return (struct view){
        .width_px = WIDTH,
        .height_px = HEIGHT,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .target = {0, 0, -1}, .fov_y_deg = 30},
        .studio = VIEW_STUDIO_OFF,
        .lights = lights,
        .light_count = count,
        .quality = {.samples = 1, .shadows = SHADOWS_RAYTRACED, .reference = true},
    };
}

/* Of maps and lists, without the reference. */
static void rasterise(struct view *view)
{
    view->quality.reference = false;
    view->quality.shadows = SHADOWS_DEEP;
}

static void expect(const struct image *image, int x, int y, int k, double expected,
                   double tolerance, const char *what)
{
    double found = (double)image_pixel_f32(image, x, y)[k];
    if (fabs(found - expected) > tolerance * expected + 1e-9)
        fail_msg("%s at %d, %d: channel %d is %.9g, not %.9g", what, x, y, k, found, expected);
}

/* ---- the definition ---- */

static double value_at(const struct stage *stage, const double p[3])
{
    double from[3], share[3], sum = 0;
    for (int k = 0; k < 3; k++) {
        double at = (p[k] - low[k]) / (high[k] - low[k]) * stage->size[k];
        if (at < 0 || at > stage->size[k])
            return 0;
        from[k] = floor(at - 0.5);
        share[k] = at - 0.5 - from[k];
    }
    for (int corner = 0; corner < 8; corner++) {
        double weight = 1;
        size_t at[3];
        for (int k = 0; k < 3; k++) {
            int up = corner >> k & 1;
            weight *= up ? share[k] : 1 - share[k];
            at[k] = (size_t)fmin(fmax(from[k] + up, 0), stage->size[k] - 1);
        }
        sum += weight *
               (double)
                   stage->values[at[0] + stage->size[0] * (at[1] + (size_t)stage->size[1] * at[2])];
    }
    return sum;
}

/* Where the line is in the box, in metres from p on. */
static bool meet_box(const double p[3], const double way[3], double *from, double *to)
{
    *from = 0;
    *to = INFINITY;
    for (int k = 0; k < 3; k++) {
        double a = (low[k] - p[k]) / way[k], b = (high[k] - p[k]) / way[k];
        if (way[k] == 0)
            continue;
        *from = fmax(*from, fmin(a, b));
        *to = fmin(*to, fmax(a, b));
    }
    return *from < *to;
}

/* The integral of the value over at most `length` metres. */
static double deep(const struct stage *stage, const double p[3], const double way[3], double length)
{
    enum { STEPS = 1000 };
    double from, to, sum = 0;
    if (!meet_box(p, way, &from, &to))
        return 0;
    to = fmin(to, length);
    for (int i = 0; i < STEPS && to > from; i++) {
        double t = from + (i + 0.5) / STEPS * (to - from);
        const double q[3] = {p[0] + t * way[0], p[1] + t * way[1], p[2] + t * way[2]};
        sum += value_at(stage, q) * (to - from) / STEPS;
    }
    return sum;
}

static double phase(double cosine)
{
    double d = 1 + g * g - 2 * g * cosine;
    return (1 - g * g) / (4 * M_PI * d * sqrt(d));
}

/* What the grid scatters from one light towards the eye at 0, by a fine sum. */
static void scattered(const struct stage *stage, const struct view_light *light,
                      const double way[3], double out[3])
{
    enum { STEPS = 3000 };
    const double eye[3] = {0, 0, 0};
    double from, to, before = 0;
    out[0] = out[1] = out[2] = 0;
    if (!meet_box(eye, way, &from, &to))
        return;
    for (int i = 0; i < STEPS; i++) {
        double dt = (to - from) / STEPS, t = from + (i + 0.5) * dt, towards[3], away, gain = 1;
        const double p[3] = {t * way[0], t * way[1], t * way[2]};
        double value = value_at(stage, p);
        if (light->type == SCENE_LIGHT_DIRECTIONAL) {
            for (int k = 0; k < 3; k++)
                towards[k] = -light->direction[k];
            away = INFINITY;
        } else {
            vec3_sub(light->position, p, towards);
            away = vec3_length(towards);
            vec3_normalize(towards);
            gain = 1 / (away * away);
        }
        double shade = deep(stage, p, towards, away);
        for (int k = 0; k < 3; k++) {
            double sigma = density * extinction[k];
            out[k] += dt * sigma * albedo[k] * value * exp(-sigma * (before + 0.5 * dt * value)) *
                      phase(vec3_dot(towards, way)) * gain * exp(-sigma * shade) *
                      (double)light->color[k] * (double)light->intensity;
        }
        before += dt * value;
    }
}

static void way_of(const struct view *view, int x, int y, double way[3])
{
    double origin[3];
    view_ray(view, x, y, origin, way);
    vec3_normalize(way);
}

static const float one[1] = {1};
static const struct stage even = {.size = {1, 1, 1}, .values = one};

static void fill_random(float *values, size_t count)
{
    uint64_t seed = 4711;
    for (size_t i = 0; i < count; i++) {
        seed = seed * 6364136223846793005ull + 1442695040888963407ull;
        values[i] = (float)(seed >> 40) / 16777216.0f * (float)(i % 3);
    }
}

/* ---- what is seen ---- */

static void dim_what_is_behind(void **state, bool is_rasterised)
{
    enum { SPARSE_X = 37, SPARSE_Y = 19, SPARSE_Z = 26 };
    static float values[11 * 7 * 9], sparse[SPARSE_X * SPARSE_Y * SPARSE_Z];
    const struct stage stages[3] = {
        {.size = {1, 1, 1}, .values = one, .has_wall = true, .wall_glow = 2},
        {.size = {11, 7, 9}, .values = values, .has_wall = true, .wall_glow = 2},
        {.size = {SPARSE_X, SPARSE_Y, SPARSE_Z},
         .values = sparse,
         .has_wall = true,
         .wall_glow = 2}};
    fill_random(values, sizeof values / sizeof *values);
    fill_random(sparse, sizeof sparse / sizeof *sparse);
    for (size_t v = 0; v < sizeof sparse / sizeof *sparse; v++) /* most bricks are empty */
        if (v % SPARSE_X < 20 || v / SPARSE_X % SPARSE_Y > 11)
            sparse[v] = 0;
    for (int i = 0; i < 3; i++) {
        struct rig_scene rig;
        open_stage(&rig, *state, &stages[i]);
        struct view view = look(NULL, 0);
        if (is_rasterised)
            rasterise(&view);
        struct image image = shoot_color(*state, &rig, &view);
        for (int y = 1; y < HEIGHT; y += 4)
            for (int x = 0; x < WIDTH; x += 3) {
                const double eye[3] = {0, 0, 0};
                double way[3];
                way_of(&view, x, y, way);
                double all = deep(&stages[i], eye, way, INFINITY);
                for (int k = 0; k < 3; k++)
                    expect(&image, x, y, k, 2 * exp(-density * extinction[k] * all),
                           i               ? 1e-4 /* of the fine sum */
                           : is_rasterised ? 4e-6
                                           : 1e-6,
                           "wall");
            }
        image_finish(&image);
        rig_scene_finish(&rig, *state);
    }
}

static void what_is_behind_is_dimmed_exactly(void **state)
{
    dim_what_is_behind(state, false);
}

static void rasterised_walls_are_dimmed_exactly(void **state)
{
    dim_what_is_behind(state, true);
}

/* A sun from above: what reaches a point, and from there the eye, is a product of exponentials. */
static void expect_even_smoke_under_a_sun(void **state, bool is_rasterised)
{
    struct rig_scene rig;
    open_stage(&rig, *state, &even);
    struct view view = look(&sun, 1);
    if (is_rasterised)
        rasterise(&view);
    struct image image = shoot_color(*state, &rig, &view);
    for (int y = 1; y < HEIGHT; y += 2)
        for (int x = 0; x < WIDTH; x++) {
            const double eye[3] = {0, 0, 0};
            double way[3], from, to;
            way_of(&view, x, y, way);
            bool is_met = meet_box(eye, way, &from, &to);
            for (int k = 0; k < 3; k++) {
                double sigma = density * extinction[k], rate = sigma * (1 - way[1]);
                double first = exp(-sigma * (high[1] - from * way[1]));
                double expected = is_met ? albedo[k] * sigma * phase(way[1]) *
                                               (double)sun.color[k] * (double)sun.intensity *
                                               first * -expm1(-rate * (to - from)) / rate
                                         : 0;
                expect(&image, x, y, k, expected, is_rasterised ? 1.5e-2 : 1e-5, "sun");
            }
        }
    image_finish(&image);
    rig_scene_finish(&rig, *state);
}

static void even_smoke_under_a_sun_is_the_closed_form(void **state)
{
    expect_even_smoke_under_a_sun(state, false);
}

/* Light is looked up between columns, here 0.15 m wide, in whose middles it is found: at the face
 * where smoke begins, which makes it bend, by up to 3 % off at a point, and less along a ray. */
static void rasterised_smoke_under_a_sun_is_the_closed_form(void **state)
{
    expect_even_smoke_under_a_sun(state, true);
}

static void compare_with_sums(void **state, const struct stage *stage, double tolerance)
{
    const struct view_light *const lights[] = {&sun, &lamp_outside, &lamp_inside};
    struct rig_scene rig;
    open_stage(&rig, *state, stage);
    for (int i = 0; i < 3; i++) {
        struct view view = look(lights[i], 1);
        view.quality.atmosphere_samples = 128;
        struct image image = shoot_color(*state, &rig, &view);
        for (int x = 4; x < WIDTH; x += 5) {
            double way[3], expected[3];
            way_of(&view, x, 3 + x / 4, way);
            scattered(stage, lights[i], way, expected);
            for (int k = 0; k < 3; k++)
                expect(&image, x, 3 + x / 4, k, expected[k], tolerance, "light");
        }
        image_finish(&image);
    }
    rig_scene_finish(&rig, *state);
}

static void even_smoke_about_lamps_is_the_fine_sum(void **state)
{
    compare_with_sums(state, &even, 1e-4); /* of the sum, beside a lamp in it */
}

static void smoke_that_varies_is_the_fine_sum(void **state)
{
    static float values[5 * 4 * 6];
    fill_random(values, sizeof values / sizeof *values);
    compare_with_sums(state, &(struct stage){.size = {5, 4, 6}, .values = values}, 2e-3);
}

/* Two halves are the whole, and the eye may be inside. */
static void a_grid_may_be_cut_into_parts(void **state)
{
    struct rig_scene whole, halves;
    const struct view_light lights[2] = {sun, lamp_inside};
    struct view view = look(lights, 2);
    for (int is_inside = 0; is_inside < 2; is_inside++) {
        view.camera.eye[2] = is_inside ? -4 : 0;
        view.camera.target[2] = view.camera.eye[2] - 1;
        view.quality.atmosphere_samples = 128;
        open_stage(&whole, *state, &even);
        struct image expected = shoot_color(*state, &whole, &view);
        rig_scene_finish(&whole, *state);
        struct stage cut = even;
        cut.is_halved = true;
        open_stage(&halves, *state, &cut);
        struct image image = shoot_color(*state, &halves, &view);
        rig_scene_finish(&halves, *state);
        assert_images_close(&image, &expected, 1e-6, 2e-5);
        image_finish(&image);
        image_finish(&expected);
    }
}

static void cut_smoke(void **state, bool is_rasterised)
{
    static const double planes[1][4] = {{-1, 0, 0, 0}}; /* what is right of the middle goes */
    struct rig_scene rig;
    struct stage stage = even;
    stage.has_wall = true;
    stage.wall_glow = 2;
    open_stage(&rig, *state, &stage);
    struct view view = look(NULL, 0);
    view.clip_planes = planes;
    view.clip_plane_count = 1;
    if (is_rasterised)
        rasterise(&view);
    struct image image = shoot_color(*state, &rig, &view);
    const double eye[3] = {0, 0, 0};
    double way[3];
    way_of(&view, WIDTH / 2 - 3, 9, way);
    double all = deep(&stage, eye, way, INFINITY);
    expect(&image, WIDTH / 2 - 3, 9, 0, 2 * exp(-density * all), is_rasterised ? 4e-6 : 1e-6,
           "left");
    expect(&image, WIDTH / 2 + 3, 9, 0, 0, 1e-6, "right"); /* the wall is cut as well */
    image_finish(&image);
    rig_scene_finish(&rig, *state);
}

static void clip_planes_cut_smoke(void **state)
{
    cut_smoke(state, false);
    cut_smoke(state, true);
}

/* A sheet of light on the floor is dimmed by what is above it. */
static void cast_shadow(void **state, bool is_rasterised)
{
    struct rig_scene rig;
    struct stage stage = even;
    static const struct view_material_override white[1] = {{.material = "Wall",
                                                            .has_base_color = true,
                                                            .base_color = {1, 1, 1, 1},
                                                            .has_metallic = true}};
    stage.has_wall = true;
    open_stage(&rig, *state, &stage);
    struct view_light along = sun;
    along.direction[1] = 0;
    along.direction[2] = -1;
    struct view view = look(&along, 1);
    view.camera.eye[0] = 9; /* beside the smoke, on its shadow */
    view.camera.eye[2] = -7;
    view.camera.target[0] = 0;
    view.camera.target[2] = wall_z;
    view.camera.fov_y_deg = 12;
    view.materials = white;
    view.material_override_count = 1;
    if (is_rasterised)
        rasterise(&view);
    struct image image = shoot_color(*state, &rig, &view);
    const double origin[3] = {0, 0, wall_z}, aside[3] = {1.3, 0, wall_z};
    for (int k = 0; k < 3; k++) {
        double shaded = (double)image_at(&image, &view, origin)[k];
        double open = (double)image_at(&image, &view, aside)[k];
        double expected = exp(-density * extinction[k] * (high[2] - low[2]));
        assert_true(fabs(shaded / open - expected) < 0.02 * expected); /* glancing lobes differ */
    }
    image_finish(&image);
    rig_scene_finish(&rig, *state);
}

static void smoke_casts_its_shadow(void **state)
{
    cast_shadow(state, false);
    cast_shadow(state, true);
}

/* A lamp that casts no shadows passes smoke on its way to the wall, and `none` has none. */
static void lights_without_shadows_pass_smoke(void **state)
{
    struct rig_scene rig;
    struct stage stage = even;
    static const struct view_material_override white[1] = {{.material = "Wall",
                                                            .has_base_color = true,
                                                            .base_color = {1, 1, 1, 1},
                                                            .has_metallic = true}};
    const double beside[3] = {1.9, 0.2, wall_z};
    stage.has_wall = true;
    open_stage(&rig, *state, &stage);
    struct view_light lamp = lamp_outside;
    memcpy(lamp.position, (const double[]){0, 0, -2.5}, sizeof lamp.position);
    struct view view = look(&lamp, 1);
    rasterise(&view);
    view.materials = white;
    view.material_override_count = 1;
    float seen[3];
    for (int i = 0; i < 3; i++) {
        view.quality.shadows = i == 1 ? SHADOWS_NONE : SHADOWS_DEEP;
        lamp.casts_no_shadow = i == 2;
        struct image image = shoot_color(*state, &rig, &view);
        seen[i] = image_at(&image, &view, beside)[0];
        image_finish(&image);
    }
    assert_true(seen[0] < 0.9f * seen[1]);
    assert_float_equal(seen[1], seen[2], 1e-6);
    rig_scene_finish(&rig, *state);
}

/* ---- techniques ---- */

static void techniques_draw_smoke_or_refuse_it(void **state)
{
    struct rig_scene rig;
    struct error err = {0};
    open_stage(&rig, *state, &even);
    struct view view = look(&sun, 1);
    view.quality = (struct view_quality){.samples = 1};
    for (int i = 0; i < SHADOWS_COUNT; i++) {
        struct frame frame;
        view.quality.shadows = (enum shadow_technique)i;
        if (i == SHADOWS_AUTO)
            continue;
        bool can = shadow_technique_can((enum shadow_technique)i, SHADOW_CAN_GRIDS);
        err = (struct error){0};
        assert_int_equal(renderer_render(*state, rig.key, &view, &frame, &err), can);
        if (can)
            frame_finish(&frame);
        else if (err.code != ERROR_INVALID_REQUEST || !strstr(err.message, "density grids"))
            fail_msg("%s", err.message);
    }
    struct frame frame;
    view.quality.shadows = SHADOWS_AUTO;
    view.quality.light_lists = VIEW_LIGHT_LISTS_LINKED; /* in which smoke is not lit */
    shoot(*state, &rig, &view, &frame);
    assert_true(report_has_pass(&frame.report, "raytrace.trace", NULL));
    frame_finish(&frame);
    view.quality.shadows = SHADOWS_DEEP;
    err = (struct error){0};
    assert_false(renderer_render(*state, rig.key, &view, &frame, &err));
    assert_int_equal(err.code, ERROR_INVALID_REQUEST);
    assert_non_null(strstr(err.message, "clustered"));
    view.quality.light_lists = VIEW_LIGHT_LISTS_AUTO;
    view.wants_deep = true;
    err = (struct error){0};
    assert_false(renderer_render(*state, rig.key, &view, &frame, &err));
    assert_int_equal(err.code, ERROR_UNSUPPORTED);
    assert_non_null(strstr(err.message, "density grids"));
    rig_scene_finish(&rig, *state);
}

/* The mean error of smoke before a wall, in haze or not. */
static double production_error(void **state, enum shadow_technique shadows, double haze,
                               const char *names[2])
{
    static float values[5 * 4 * 6];
    struct rig_scene rig;
    const struct view_light lights[2] = {sun, lamp_inside};
    fill_random(values, sizeof values / sizeof *values);
    open_stage(
        &rig, *state,
        &(struct stage){.size = {5, 4, 6}, .values = values, .has_wall = true, .wall_glow = 0.5});
    struct view view = look(lights, 2);
    view.width_px = 4 * WIDTH;
    view.height_px = 4 * HEIGHT;
    view.atmosphere = (struct view_atmosphere){.density_per_m = haze, .color = {1, 1, 1}};
    view.quality.samples = 4;
    struct image reference = shoot_color(*state, &rig, &view);
    view.quality.reference = false;
    view.quality.shadows = shadows;
    struct image image = shoot_color(*state, &rig, &view);
    save_picture(&reference, names[0]);
    save_picture(&image, names[1]);
    double error = mean_error(&image, &reference);
    print_message("mean error %.5f of the mean\n", error);
    image_finish(&reference);
    image_finish(&image);
    rig_scene_finish(&rig, *state);
    return error;
}

static void production_agrees_with_the_reference(void **state)
{
    const char *alone[] = {"density_grid_alone_reference", "density_grid_alone_raytraced"};
    const char *hazy[] = {"density_grid_reference", "density_grid_raytraced"};
    assert_true(production_error(state, SHADOWS_RAYTRACED, 0, alone) < 0.003);
    assert_true(production_error(state, SHADOWS_RAYTRACED, 0.05, hazy) < 0.005);
}

static void rasterised_smoke_agrees_with_the_reference(void **state)
{
    const char *alone[] = {"density_grid_alone_reference", "density_grid_alone_deep"};
    const char *hazy[] = {"density_grid_reference", "density_grid_deep"};
    assert_true(production_error(state, SHADOWS_DEEP, 0, alone) < 0.01);
    assert_true(production_error(state, SHADOWS_DEEP, 0.05, hazy) < 0.01);
}

static struct image shoot_furnace(struct renderer *renderer, const struct rig_scene *rig,
                                  const struct view *from, bool is_lit,
                                  const struct view_grid_override *grid)
{
    struct view view = *from;
    view.has_environment = is_lit;
    view.grids = grid;
    view.grid_override_count = 1;
    for (int k = 0; k < 3; k++)
        view.sky[k] = view.ground[k] = 2;
    return shoot_color(renderer, rig, &view);
}

/* In a furnace as much light comes from everywhere. What smoke takes of it along a ray, its albedo
 * gives back, whatever the density and the phase function: a full albedo loses and gains nothing,
 * and of any other the rest is absorbed. */
static void smoke_gains_and_loses_no_light(void **state)
{
    static float values[7 * 5 * 6];
    fill_random(values, sizeof values / sizeof *values);
    const struct stage stage = {
        .size = {7, 5, 6}, .values = values, .has_wall = true, .wall_glow = 2};
    const struct view_grid_override none = {.grid = "Smoke", .has_density = true};
    struct rig_scene rig;
    open_stage(&rig, *state, &stage);
    for (int i = 0; i < 4; i++) {
        const struct view_grid_override grid = {
            .grid = "Smoke", .has_color = i % 2, .color = {1, 1, 1}};
        struct view view = look(NULL, 0);
        if (i / 2)
            rasterise(&view);
        struct image lit = shoot_furnace(*state, &rig, &view, true, &grid);
        struct image clear = shoot_furnace(*state, &rig, &view, true, &none);
        struct image dimmed = shoot_furnace(*state, &rig, &view, false, &grid);
        for (int y = 1; y < HEIGHT; y += 4)
            for (int x = 0; x < WIDTH; x += 3)
                for (int k = 0; k < 3; k++) {
                    double passed = (double)image_pixel_f32(&dimmed, x, y)[k] / 2;
                    double wall = (double)image_pixel_f32(&clear, x, y)[k];
                    double given = 2 * (i % 2 ? 1 : albedo[k]);
                    expect(&lit, x, y, k, passed * wall + given * (1 - passed), 2e-5, "furnace");
                }
        image_finish(&lit);
        image_finish(&clear);
        image_finish(&dimmed);
    }
    rig_scene_finish(&rig, *state);
}

/* Rasterised: tiles have the bits of the whole, and lights in parts the same light. */
static void tiles_and_parts_agree(void **state)
{
    enum { MANY = 8, TILE_X = 41, TILE_Y = 19, TILE_WIDTH = 50, TILE_HEIGHT = 33 };
    static float values[5 * 4 * 6];
    struct renderer *renderer = *state;
    struct rig_scene rig;
    struct view_light many[MANY];
    for (int i = 0; i < MANY; i++) {
        many[i] = i % 2 ? lamp_inside : sun;
        many[i].direction[0] = 0.05 * i;
        many[i].position[0] = 0.1 * i - 0.5;
    }
    fill_random(values, sizeof values / sizeof *values);
    open_stage(
        &rig, renderer,
        &(struct stage){.size = {5, 4, 6}, .values = values, .has_wall = true, .wall_glow = 0.5});
    struct view view = look(many, MANY);
    rasterise(&view);
    view.width_px = 4 * WIDTH;
    view.height_px = 4 * HEIGHT;
    view.quality.samples = 4;
    struct image whole = shoot_color(renderer, &rig, &view);
    struct view tile = view;
    tile.tile = (struct view_tile){TILE_X, TILE_Y, TILE_WIDTH, TILE_HEIGHT};
    struct image part = shoot_color(renderer, &rig, &tile);
    for (int y = 0; y < TILE_HEIGHT; y++)
        assert_memory_equal(image_pixel_f32(&part, 0, y),
                            image_pixel_f32(&whole, TILE_X, TILE_Y + y),
                            (size_t)TILE_WIDTH * 4 * sizeof(float));
    image_finish(&part);
    const uint64_t loop_steps = renderer->frames.shade.loop_steps;
    struct frame frame;
    renderer->frames.shade.loop_steps = 2000;
    shoot(renderer, &rig, &view, &frame);
    renderer->frames.shade.loop_steps = loop_steps;
    assert_int_in_range(frame.report.counts.light_chunks, 2, 100);
    assert_images_close(&frame.outputs[VIEW_OUTPUT_COLOR], &whole, 0.01, 1e-5);
    frame_finish(&frame);
    image_finish(&whole);
    rig_scene_finish(&rig, renderer);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_behind_is_dimmed_exactly),
        cmocka_unit_test(rasterised_walls_are_dimmed_exactly),
        cmocka_unit_test(rasterised_smoke_under_a_sun_is_the_closed_form),
        cmocka_unit_test(even_smoke_under_a_sun_is_the_closed_form),
        cmocka_unit_test(even_smoke_about_lamps_is_the_fine_sum),
        cmocka_unit_test(smoke_that_varies_is_the_fine_sum),
        cmocka_unit_test(a_grid_may_be_cut_into_parts),
        cmocka_unit_test(clip_planes_cut_smoke),
        cmocka_unit_test(smoke_casts_its_shadow),
        cmocka_unit_test(lights_without_shadows_pass_smoke),
        cmocka_unit_test(techniques_draw_smoke_or_refuse_it),
        cmocka_unit_test(production_agrees_with_the_reference),
        cmocka_unit_test(rasterised_smoke_agrees_with_the_reference),
        cmocka_unit_test(smoke_gains_and_loses_no_light),
        cmocka_unit_test(tiles_and_parts_agree),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
