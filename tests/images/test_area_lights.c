/* SPDX-License-Identifier: MIT */
/* Rectangles and disks that light from their whole area in rasterised pictures (section 4 of
 * docs/explanation/shading.md): closed forms of what is diffuse, and the reference, which takes
 * points, for lobes of all kinds. Lights, views and materials come from seeds. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "glb/shapes.h"
#include "renderer/base/matrix.h"
#include "tests/support/area_lobe_fit.h"
#include "tests/support/image_checks.h"

enum { SIZE = 32, FLOOR_SIDE = 64 };

/* A floor of 40 m, or a ball of radius 1 about the origin. */
static void open_shape(struct rig_scene *rig, struct renderer *renderer, bool is_ball,
                       const struct glb_material_desc *material)
{
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Area", &err);
    struct shape shape = {0};
    void *glb;
    size_t size_bytes;
    assert_non_null(builder);
    if (is_ball)
        shape_add_sphere(&shape, (double[]){0, 0, 0}, 1, 96, 48);
    else
        shape_add_quad(&shape, (double[]){-20, 0, 20}, (double[]){40, 0, 0}, (double[]){0, 0, -40});
    int mesh =
        shape_give_mesh(&shape, builder, "Shape", glb_builder_add_material(builder, material));
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Shape", .mesh = mesh});
    if (!glb_builder_finish(builder, &glb, &size_bytes, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    rig_scene_open(rig, renderer, "area", glb, size_bytes);
    free(glb);
}

/* ---- closed forms ---- */

static const struct glb_material_desc chalk = {
    .base_color = {1, 1, 1, 1}, .roughness = 1, .has_ior = true, .ior = 1};

static struct view look_down(const struct view_light *light)
{
    return (struct view){
        .width_px = FLOOR_SIDE,
        .height_px = FLOOR_SIDE,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                   .eye = {0, 6, 0},
                   .target = {0, 0, 0},
                   .up = {0, 0, -1},
                   .fov_y_deg = 60},
        .lights = light,
        .light_count = 1,
        .quality = {.samples = 1, .shadows = SHADOWS_NONE},
    };
}

/* Form factor of a polygon or disk for a floor's point, by the midpoint rule over its area, in
 * cells that are smaller the nearer they are. */
static double cell_form(const double corner[3], const double u[3], const double v[3],
                        const double at[3], const double direction[3], bool is_disk, int level,
                        const double place[2], double side)
{
    double middle[3], d[3];
    for (int k = 0; k < 3; k++) {
        middle[k] = corner[k] + (place[0] + side / 2) * u[k] + (place[1] + side / 2) * v[k];
        d[k] = middle[k] - at[k];
    }
    double size = side * fmax(vec3_length(u), vec3_length(v)), away = vec3_length(d);
    double x = 2 * (place[0] + side / 2) - 1, y = 2 * (place[1] + side / 2) - 1, r = hypot(x, y);
    bool is_rim = is_disk && fabs(r - 1) < 1.5 * side, is_out = is_disk && r > 1 && !is_rim;
    if (is_out)
        return 0;
    if ((size > 0.05 * away || (is_rim && level < 9) || level < 3) && level < 12) {
        double sum = 0;
        for (int i = 0; i < 4; i++) {
            double part[2] = {place[0] + (i % 2) * side / 2, place[1] + (i / 2) * side / 2};
            sum += cell_form(corner, u, v, at, direction, is_disk, level + 1, part, side / 2);
        }
        return sum;
    }
    if (is_disk && r > 1)
        return 0;
    double area = side * side * vec3_length(u) * vec3_length(v);
    double cosine = -vec3_dot(d, direction) / away, rise = d[1] / away;
    return cosine > 0 && rise > 0 ? area * cosine * rise / (M_PI * away * away) : 0;
}

static double form_of(const struct view_light *light, const double at[3])
{
    double direction[3], up[3], side[3], corner[3];
    memcpy(direction, light->direction, sizeof direction);
    vec3_normalize(direction);
    vec3_cross(direction, light->up, side);
    vec3_normalize(side);
    vec3_cross(side, direction, up);
    bool is_disk = light->type == SCENE_LIGHT_DISK;
    double width = is_disk ? 2 * light->radius_m : light->width_m;
    double height = is_disk ? 2 * light->radius_m : light->height_m;
    for (int k = 0; k < 3; k++) {
        side[k] *= width;
        up[k] *= height;
        corner[k] = light->position[k] - side[k] / 2 - up[k] / 2;
    }
    return cell_form(corner, side, up, at, direction, is_disk, 0, (double[]){0, 0}, 1);
}

/* Of chalk, in the whole picture: the greatest error over the greatest value. */
static double floor_error(struct renderer *renderer, const struct rig_scene *rig,
                          const struct view_light *light, int step)
{
    struct view view = look_down(light);
    struct image drawn = shoot_color(renderer, rig, &view);
    double worst = 0, brightest = 0;
    assert_image_is_sound(&drawn, 1e6);
    for (int y = 0; y < FLOOR_SIDE; y += step) {
        for (int x = 0; x < FLOOR_SIDE; x += step) {
            double at[3];
            assert_true(view_meet_plane(&view, x, y, (double[]){0, 1, 0}, 0, at));
            double expected = (double)light->intensity * form_of(light, at);
            double off = fabs((double)image_pixel_f32(&drawn, x, y)[0] - expected);
            worst = fmax(worst, off);
            brightest = fmax(brightest, expected);
        }
    }
    image_finish(&drawn);
    return brightest > 0 ? worst / brightest : worst;
}

static void chalk_takes_lamberts_form_of_rectangles_and_disks(void **state)
{
    static const struct view_light lights[] = {
        {.position = {0, 1.5, 0}, .direction = {0, -1, 0}, .width_m = 2, .height_m = 2},
        {.position = {0.7, 2, -0.4}, .direction = {0.5, -1, 0.2}, .width_m = 3, .height_m = 0.4},
        /* upright, half of it below the floor */
        {.position = {-1.5, 0.2, 0.5}, .direction = {1, 0, 0.3}, .width_m = 1.5, .height_m = 2},
        {.position = {1, 0.05, 1}, .direction = {-0.2, -1, 0}, .width_m = 1, .height_m = 1},
        {.position = {0.3, 1, 0.2}, .direction = {0.1, -1, 0}, .width_m = 1e-3, .height_m = 1e-3},
        {.position = {0, 5, 0}, .direction = {0, -1, 0.4}, .width_m = 0.02, .height_m = 12},
    };
    struct rig_scene rig;
    open_shape(&rig, *state, false, &chalk);
    for (int i = 0; i < (int)(sizeof lights / sizeof *lights); i++) {
        for (int is_disk = 0; is_disk < 2; is_disk++) {
            struct view_light light = lights[i];
            light.type = is_disk ? SCENE_LIGHT_DISK : SCENE_LIGHT_RECT;
            light.intensity = 3;
            light.radius_m = 0.5 * fmin(light.width_m, light.height_m);
            memcpy(light.up, (double[]){0.1, 0.2, 1}, sizeof light.up);
            for (int k = 0; k < 3; k++)
                light.color[k] = 1;
            double worst = floor_error(*state, &rig, &light, 5);
            print_message("%s %d: %.2e\n", is_disk ? "disk" : "rectangle", i, worst);
            assert_true(worst < 1e-3);
        }
    }
    rig_scene_finish(&rig, *state);
}

/* The parallel disk on its axis, R^2 / (R^2 + d^2), and a light that is everywhere above. */
static void textbook_forms_hold(void **state)
{
    struct rig_scene rig;
    open_shape(&rig, *state, false, &chalk);
    for (int i = 0; i < 8; i++) {
        double radius = pow(10, i - 4);
        struct view_light light = {.type = SCENE_LIGHT_DISK,
                                   .position = {0, 1, 0},
                                   .direction = {0, -1, 0},
                                   .color = {1, 1, 1},
                                   .intensity = 2,
                                   .radius_m = radius};
        struct view view = look_down(&light);
        view.width_px = view.height_px = 1;
        struct image drawn = shoot_color(*state, &rig, &view);
        double expected = 2 * radius * radius / (radius * radius + 1);
        double of_disk = (double)image_pixel_f32(&drawn, 0, 0)[0] / expected - 1;
        image_finish(&drawn);
        light.type = SCENE_LIGHT_RECT;
        light.width_m = light.height_m = 2 * radius;
        drawn = shoot_color(*state, &rig, &view);
        /* Howell, "A Catalog of Radiation Heat Transfer Configuration Factors", B-4, four times */
        double a = radius / sqrt(1 + radius * radius);
        double of_square =
            (double)image_pixel_f32(&drawn, 0, 0)[0] / (2 * 4 / M_PI * a * atan(a)) - 1;
        image_finish(&drawn);
        print_message("radius %g: disk %.1e, square %.1e\n", radius, of_disk, of_square);
        assert_true(fabs(of_disk) < 1e-4 && fabs(of_square) < 1e-4);
    }
    rig_scene_finish(&rig, *state);
}

/* ---- beside the reference ---- */

static uint64_t next(uint64_t *seed)
{
    *seed = *seed * 6364136223846793005ull + 1442695040888963407ull;
    return *seed >> 33;
}

static double between(uint64_t *seed, double low, double high)
{
    return low + (high - low) * (double)next(seed) / 2147483648.0;
}

/* One to six metres away, from a tenth of a metre to four metres wide. */
static void draw_light(uint64_t *seed, struct view_light *light)
{
    double away = between(seed, 1.6, 5), azimuth = between(seed, 0, 2 * M_PI);
    double rise = between(seed, -0.2, 1), across = sqrt(1 - rise * rise);
    *light = (struct view_light){.type = next(seed) % 2 ? SCENE_LIGHT_DISK : SCENE_LIGHT_RECT,
                                 .color = {1, 1, 1},
                                 .intensity = 5,
                                 .casts_no_shadow = true,
                                 .width_m = 0.1 * pow(40, between(seed, 0, 1)),
                                 .height_m = 0.1 * pow(40, between(seed, 0, 1)),
                                 .radius_m = 0.1 * pow(20, between(seed, 0, 1))};
    const double place[3] = {away * across * cos(azimuth), away * rise,
                             away * across * sin(azimuth)};
    for (int k = 0; k < 3; k++) {
        light->position[k] = place[k];
        light->direction[k] = -place[k] / away + between(seed, -0.5, 0.5);
        light->up[k] = between(seed, -1, 1);
    }
}

static struct view look_at(uint64_t *seed, bool is_ball, const struct view_light *light)
{
    double azimuth = between(seed, 0, 2 * M_PI), rise = between(seed, is_ball ? -0.2 : 0.35, 0.9);
    double away = is_ball ? 5 : 6, across = sqrt(1 - rise * rise);
    return (struct view){
        .width_px = SIZE,
        .height_px = SIZE,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                   .eye = {away * across * cos(azimuth), away * rise, away * across * sin(azimuth)},
                   .fov_y_deg = 26},
        .lights = light,
        .light_count = 1};
}

/* Mean absolute error over the mean, of one view. */
static double view_error(struct renderer *renderer, const struct rig_scene *rig, struct view view,
                         const char *name)
{
    view.quality = (struct view_quality){.samples = 1, .shadows = SHADOWS_DEEP};
    struct image drawn = shoot_color(renderer, rig, &view);
    view.quality = (struct view_quality){.samples = 1,
                                         .shadows = SHADOWS_RAYTRACED,
                                         .reference = true,
                                         .refraction = VIEW_REFRACTION_OFF,
                                         .area_samples = 4096};
    struct image traced = shoot_color(renderer, rig, &view);
    double off = mean_error(&drawn, &traced), mean[3];
    image_mean(&traced, (double[]){0, 0, 1, 1}, mean);
    assert_image_is_sound(&drawn, 1e4);
    if (name) {
        char text[96];
        snprintf(text, sizeof text, "area_%s_drawn", name);
        save_picture(&drawn, text);
        snprintf(text, sizeof text, "area_%s_traced", name);
        save_picture(&traced, text);
    }
    image_finish(&drawn);
    image_finish(&traced);
    /* of a hundredth of the light's radiance where there is less: what is nearly black */
    return mean[1] > 0 ? off * fmin(1, mean[1] / (0.01 * (double)view.lights->intensity)) : 0;
}

struct compared {
    const char *name;
    double most_mean, most; /* of the views' errors */
    struct glb_material_desc material;
};

static void compare(struct renderer *renderer, const struct compared *rows, int count, int views)
{
    uint64_t seed = 2026;
    for (int i = 0; i < count; i++) {
        double sum = 0, worst = 0;
        for (int shape = 0; shape < 2; shape++) {
            struct rig_scene rig;
            open_shape(&rig, renderer, shape == 0, &rows[i].material);
            for (int k = 0; k < views; k++) {
                struct view_light light;
                draw_light(&seed, &light);
                const struct view view = look_at(&seed, shape == 0, &light);
                double off = view_error(renderer, &rig, view, k || shape ? NULL : rows[i].name);
                sum += off / (2 * views);
                worst = fmax(worst, off);
            }
            rig_scene_finish(&rig, renderer);
        }
        print_message("%-24s mean %.4f, worst %.4f\n", rows[i].name, sum, worst);
        assert_true(sum < rows[i].most_mean && worst < rows[i].most);
    }
}

/* The reference takes 4096 points, and errs by a few thousandths where a light touches the floor.
 */
static const struct compared plain[] = {
    {"chalk",
     1e-3,
     5e-3,
     {.base_color = {0.8, 0.5, 0.2, 1}, .roughness = 1, .has_ior = true, .ior = 1}},
    {"plastic 0.3", 0.01, 0.04, {.base_color = {0.6, 0.1, 0.1, 1}, .roughness = 0.3}},
    {"plastic 0.6", 0.003, 0.01, {.base_color = {0.6, 0.1, 0.1, 1}, .roughness = 0.6}},
    {"plastic 1", 0.004, 0.01, {.base_color = {0.6, 0.1, 0.1, 1}, .roughness = 1}},
    {"metal 0.35",
     0.04,
     0.09,
     {.base_color = {0.9, 0.7, 0.3, 1}, .metallic = 1, .roughness = 0.35}},
    {"metal 0.5", 0.04, 0.12, {.base_color = {0.9, 0.7, 0.3, 1}, .metallic = 1, .roughness = 0.5}},
    {"metal 0.7", 0.03, 0.08, {.base_color = {0.9, 0.7, 0.3, 1}, .metallic = 1, .roughness = 0.7}},
    {"metal 1", 0.02, 0.05, {.base_color = {0.9, 0.7, 0.3, 1}, .metallic = 1, .roughness = 1}},
};

static const struct compared lobes[] = {
    {"lacquer",
     0.01,
     0.03,
     {.base_color = {0.1, 0.1, 0.6, 1},
      .roughness = 0.7,
      .clearcoat = 1,
      .clearcoat_roughness = 0.2}},
    {"velvet",
     0.03,
     0.1,
     {.base_color = {0.1, 0.02, 0.1, 1},
      .roughness = 0.9,
      .sheen_color = {0.9, 0.4, 0.6},
      .sheen_roughness = 0.4}},
    {"tinted",
     0.02,
     0.06,
     {.base_color = {0.4, 0.4, 0.4, 1},
      .roughness = 0.4,
      .has_specular = true,
      .specular = 1,
      .specular_color = {4, 1, 0.2}}},
    {"film",
     0.03,
     0.08,
     {.base_color = {0.9, 0.7, 0.3, 1},
      .metallic = 1,
      .roughness = 0.4,
      .iridescence = 1,
      .iridescence_ior = 1.8,
      .film_most_nm = 250}},
    {"grain",
     0.2,
     0.5,
     {.base_color = {0.8, 0.8, 0.8, 1}, .metallic = 1, .roughness = 0.4, .anisotropy = 0.6}},
    {"leaf",
     0.01,
     0.04,
     {.base_color = {0.2, 0.5, 0.1, 1},
      .roughness = 0.7,
      .is_double_sided = true,
      .diffuse_transmission = 0.5,
      .diffuse_transmission_color = {0.5, 0.9, 0.1}}},
    {"glass",
     0.01,
     0.03,
     {.base_color = {0.7, 0.9, 0.8, 1},
      .roughness = 0.3,
      .is_double_sided = true,
      .transmission = 0.8}},
    {"curtain",
     0.01,
     0.03,
     {.base_color = {0.2, 0.6, 0.3, 0.5},
      .alpha_mode = GLB_BLEND,
      .roughness = 0.6,
      .is_double_sided = true}},
};

static void plain_materials_are_near_the_reference(void **state)
{
    compare(*state, plain, sizeof plain / sizeof *plain, 2);
}

static void other_lobes_are_near_the_reference(void **state)
{
    compare(*state, lobes, sizeof lobes / sizeof *lobes, 2);
}

/* ---- beside sums over the lobe ---- */

struct floor_probe {
    const struct view_light *light;
    double direction[3], side[3], up[3]; /* of it: unit, and over half its size */
    double alpha, base;
};

static bool is_on_light(const struct floor_probe *probe, const double at[3], const double l[3])
{
    double offset[3], facing = vec3_dot(l, probe->direction);
    vec3_sub(probe->light->position, at, offset);
    double way = vec3_dot(offset, probe->direction) / facing;
    if (facing >= 0 || way <= 0)
        return false;
    for (int k = 0; k < 3; k++)
        offset[k] = l[k] * way - offset[k];
    double x = vec3_dot(offset, probe->side), y = vec3_dot(offset, probe->up);
    return probe->light->type == SCENE_LIGHT_DISK ? x * x + y * y < 1 : fabs(x) < 1 && fabs(y) < 1;
}

/* Light that a metal floor sends to the eye, by directions of its lobe. */
static double floor_sent(const struct floor_probe *probe, const double at[3], const double eye[3])
{
    enum { SIDE = 160 };
    double view[3], along[3], across[3], sum = 0;
    vec3_sub(eye, at, view);
    vec3_normalize(view);
    const double v[3] = {hypot(view[0], view[2]), 0, view[1]};
    const double x[3] = {view[0] / v[0], 0, view[2] / v[0]}, n[3] = {0, 1, 0};
    memcpy(along, x, sizeof along);
    vec3_cross(n, along, across);
    for (int i = 0; i < SIDE * SIDE; i++) {
        double u[2] = {(i % SIDE + 0.5) / SIDE, (i / SIDE + 0.5) / SIDE}, local[3], l[3], weight;
        double sent = area_lobe_sample(probe->alpha, v, u, local, &weight);
        for (int k = 0; k < 3; k++)
            l[k] = local[0] * along[k] + local[1] * across[k] + local[2] * n[k];
        if (sent > 0 && is_on_light(probe, at, l))
            sum += sent * (probe->base + (1 - probe->base) * weight);
    }
    return (double)probe->light->intensity * sum / (SIDE * SIDE);
}

static struct floor_probe probe_of(const struct view_light *light, double roughness, double base)
{
    struct floor_probe probe = {.light = light, .alpha = roughness * roughness, .base = base};
    bool is_disk = light->type == SCENE_LIGHT_DISK;
    memcpy(probe.direction, light->direction, sizeof probe.direction);
    vec3_normalize(probe.direction);
    vec3_cross(probe.direction, light->up, probe.side);
    vec3_normalize(probe.side);
    vec3_cross(probe.side, probe.direction, probe.up);
    for (int k = 0; k < 3; k++) {
        probe.side[k] /= is_disk ? light->radius_m : light->width_m / 2;
        probe.up[k] /= is_disk ? light->radius_m : light->height_m / 2;
    }
    return probe;
}

/* Mean error over the mean, as view_error has it. */
static double probe_error(struct renderer *renderer, const struct rig_scene *rig,
                          const struct view *view, double roughness)
{
    const struct floor_probe probe = probe_of(view->lights, roughness, (double)0.9f);
    struct image drawn = shoot_color(renderer, rig, view);
    double sum = 0, off = 0;
    int count = 0;
    for (int y = 2; y < SIZE; y += 4) {
        for (int x = 2; x < SIZE; x += 4, count++) {
            double at[3];
            assert_true(view_meet_plane(view, x, y, (double[]){0, 1, 0}, 0, at));
            double sent = floor_sent(&probe, at, view->camera.eye);
            sum += sent;
            off += fabs((double)image_pixel_f32(&drawn, x, y)[0] - sent);
        }
    }
    image_finish(&drawn);
    return off / fmax(sum, count * 0.01 * (double)view->lights->intensity);
}

/* Seen at up to 82 degrees from the normal. Lobes between mirror and chalk are farthest off. */
static void metal_floors_send_what_their_lobes_do(void **state)
{
    static const struct {
        double roughness, most_mean, most;
    } rows[] = {{0.05, 0.006, 0.03}, {0.1, 0.01, 0.03},  {0.2, 0.03, 0.08}, {0.35, 0.03, 0.09},
                {0.5, 0.06, 0.15},   {0.7, 0.025, 0.06}, {1, 0.015, 0.03}};
    enum { VIEWS = 8 };
    uint64_t seed = 417;
    for (int i = 0; i < (int)(sizeof rows / sizeof *rows); i++) {
        double sum = 0, worst = 0;
        const struct glb_material_desc metal = {
            .base_color = {0.9, 0.7, 0.3, 1}, .metallic = 1, .roughness = rows[i].roughness};
        struct rig_scene rig;
        open_shape(&rig, *state, false, &metal);
        for (int k = 0; k < VIEWS; k++) {
            struct view_light light;
            draw_light(&seed, &light);
            struct view view = look_at(&seed, false, &light);
            view.quality = (struct view_quality){.samples = 1, .shadows = SHADOWS_NONE};
            /* the light about where the middle of the floor mirrors it */
            double eye[3], away = between(&seed, 0.5, 2);
            memcpy(eye, view.camera.eye, sizeof eye);
            for (int c = 0; c < 3; c++) {
                light.position[c] =
                    (c == 1 ? 1 : -1) * eye[c] / 6 * 2 * away + between(&seed, -0.3, 0.3);
                light.direction[c] = -light.position[c] + between(&seed, -0.5, 0.5);
            }
            double off = probe_error(*state, &rig, &view, rows[i].roughness);
            sum += off / VIEWS;
            worst = fmax(worst, off);
        }
        rig_scene_finish(&rig, *state);
        print_message("roughness %.2f: mean %.4f, worst %.4f\n", rows[i].roughness, sum, worst);
        assert_true(sum < rows[i].most_mean && worst < rows[i].most);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(textbook_forms_hold),
        cmocka_unit_test(chalk_takes_lamberts_form_of_rectangles_and_disks),
        cmocka_unit_test(plain_materials_are_near_the_reference),
        cmocka_unit_test(metal_floors_send_what_their_lobes_do),
        cmocka_unit_test(other_lobes_are_near_the_reference),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
