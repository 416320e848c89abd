/* SPDX-License-Identifier: MIT */
/* What the ray tracer shows behind glass that bends light, against closed forms: a slab shifts, a
 * ball inverts, a prism reflects totally or spreads colours, and a furnace gains nothing (section 8
 * of docs/explanation/shading.md). */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "glb/shapes.h"
#include "tests/support/image_checks.h"

static const double pi = 3.14159265358979323846;

enum { WIDTH = 400, HEIGHT = 8 };

static const double WIDE = 4; /* m, that a picture shows */

static void end_scene(struct glb_builder *builder, struct rig_scene *rig, struct renderer *renderer,
                      const char *key)
{
    struct error err = {0};
    void *glb;
    size_t size_bytes;
    if (!glb_builder_finish(builder, &glb, &size_bytes, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    rig_scene_open(rig, renderer, key, glb, size_bytes);
    free(glb);
}

static void give(struct shape *shape, struct glb_builder *builder, const char *name, int material)
{
    int mesh = shape_give_mesh(shape, builder, name, material);
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = name, .mesh = mesh});
}

static struct glb_material_desc glass_of(double ior)
{
    return (struct glb_material_desc){
        .name = "Glass", .transmission = 1, .has_ior = true, .ior = ior, .thickness = 1};
}

/* A white wall across the view from x = edge on to the right. */
static void add_wall(struct glb_builder *builder, double edge, double z)
{
    struct shape shape = {0};
    const struct glb_material_desc white = {
        .name = "White", .is_unlit = true, .is_double_sided = true};
    shape_add_quad(&shape, (double[]){edge, -9, z}, (double[]){20, 0, 0}, (double[]){0, 18, 0});
    give(&shape, builder, "Wall", glb_builder_add_material(builder, &white));
}

/* Next to none: what is behind the glass decides. */
static const struct view_light dim = {.type = SCENE_LIGHT_DIRECTIONAL,
                                      .direction = {0, 0, 1},
                                      .color = {1, 1, 1},
                                      .intensity = 1e-9f};

/* Parallel rays along -Z, WIDE metres of them. */
static struct view look(bool is_reference)
{
    return (struct view){
        .width_px = WIDTH,
        .height_px = HEIGHT,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                   .eye = {0, 0, 5},
                   .ortho_height = WIDE * HEIGHT / WIDTH},
        .lights = &dim,
        .light_count = 1,
        .quality = {.shadows = SHADOWS_RAYTRACED, .samples = 1, .reference = is_reference},
    };
}

/* Where, in metres, the middle row crosses half of its brightest value between two places. */
static double find_edge(const struct image *image, int channel, double from, double to)
{
    const float *row = (const float *)image->pixels + 4 * (size_t)(HEIGHT / 2) * WIDTH;
    float brightest = 0;
    int first = (int)((from / WIDE + 0.5) * WIDTH), end = (int)((to / WIDE + 0.5) * WIDTH);
    for (int x = first; x < end; x++)
        brightest = fmaxf(brightest, row[4 * x + channel]);
    for (int x = first; x + 1 < end; x++)
        if ((row[4 * x + channel] < brightest / 2) != (row[4 * x + 4 + channel] < brightest / 2))
            return ((x + 1.0) / WIDTH - 0.5) * WIDE;
    fail_msg("there is no edge from %g to %g", from, to);
    return 0;
}

/* ---- a slab ---- */

/* A box of glass 0.5 m thick, turned about Y. */
static void open_slab(struct rig_scene *rig, struct renderer *renderer, double turn, double ior,
                      double dispersion)
{
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Slab", &err);
    struct shape shape = {0};
    struct glb_material_desc glass = glass_of(ior);
    glass.dispersion = dispersion;
    assert_non_null(builder);
    shape_set_place(&shape, (double[]){0, 0, 0}, (double[]){cos(turn), 0, sin(turn)},
                    (double[]){0, 1, 0});
    shape_add_box(&shape, (double[]){-8, -8, -0.25}, (double[]){8, 8, 0.25});
    give(&shape, builder, "Slab", glb_builder_add_material(builder, &glass));
    add_wall(builder, 0, -20);
    end_scene(builder, rig, renderer, "slab");
}

static double slab_offset(double turn, double ior)
{
    double inside = asin(sin(turn) / ior);
    return 0.5 * sin(turn - inside) / cos(inside);
}

static void a_slab_shifts_what_is_behind_by_the_offset_of_snell(void **state)
{
    struct renderer *renderer = *state;
    for (int i = 0; i < 6; i++) {
        const double turn = (10 + 20 * (i / 2)) * pi / 180, ior = i % 2 ? 1.9 : 1.33;
        const double offset = slab_offset(turn, ior);
        struct rig_scene rig;
        open_slab(&rig, renderer, turn, ior, 0);
        for (int form = 0; form < 2; form++) {
            struct view view = look(form);
            struct image image = shoot_color(renderer, &rig, &view);
            double edge = fabs(find_edge(&image, 1, -1, 1));
            print_message("turned by %.0f degrees, index %.2f: %.4f m, expected %.4f\n",
                          turn * 180 / pi, ior, edge, offset);
            assert_true(fabs(edge - offset) <= WIDE / WIDTH);
            image_finish(&image);
            view.quality.refraction = VIEW_REFRACTION_OFF;
            image = shoot_color(renderer, &rig, &view);
            assert_true(fabs(find_edge(&image, 1, -1, 1)) <= WIDE / WIDTH);
            image_finish(&image);
        }
        rig_scene_finish(&rig, renderer);
    }
}

/* KHR_materials_dispersion: the index of red is lower, and that of blue higher, by
 * (ior - 1) * 0.025 * dispersion. */
static void colours_part_by_their_indices(void **state)
{
    struct renderer *renderer = *state;
    const double turn = pi / 3, ior = 1.5, half = 0.5 * 0.025 * 8;
    struct rig_scene rig;
    open_slab(&rig, renderer, turn, ior, 8);
    for (int form = 0; form < 2; form++) {
        struct view view = look(form);
        struct image image = shoot_color(renderer, &rig, &view);
        for (int k = 0; k < 3; k++) {
            double expected = slab_offset(turn, ior + (k - 1) * half);
            double edge = fabs(find_edge(&image, k, -1, 1));
            print_message("channel %d: %.4f m, expected %.4f\n", k, edge, expected);
            assert_true(fabs(edge - expected) <= WIDE / WIDTH);
        }
        image_finish(&image);
    }
    rig_scene_finish(&rig, renderer);
}

/* ---- a ball ---- */

static void open_ball(struct rig_scene *rig, struct renderer *renderer,
                      const struct glb_material_desc *glass, double edge)
{
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Ball", &err);
    struct shape shape = {0};
    assert_non_null(builder);
    shape_add_sphere(&shape, (double[]){0, 0, 0}, 1, 512, 256);
    give(&shape, builder, "Ball", glb_builder_add_material(builder, glass));
    if (edge < 10)
        add_wall(builder, edge, -3);
    end_scene(builder, rig, renderer, "ball");
}

/* Where a ray that meets a unit ball at height b meets the plane z = -3. */
static double through_ball(double b, double ior)
{
    double in = asin(b), inside = asin(b / ior), deviation = 2 * (in - inside);
    double turned = in + (pi - 2 * inside); /* of the exit about the centre, from +Z */
    double x = sin(turned), z = cos(turned);
    return x - tan(deviation) * (z + 3);
}

static void a_ball_inverts_as_its_closed_form(void **state)
{
    struct renderer *renderer = *state;
    static const double iors[] = {1.2, 1.5, 1.8}, edges[] = {-0.7, 0.4, 1.1};
    for (int i = 0; i < 9; i++) {
        const double ior = iors[i / 3], edge = edges[i % 3];
        const struct glb_material_desc glass = glass_of(ior);
        double low = -0.97, high = 0.97; /* the place falls with the height from end to end */
        for (int step = 0; step < 60; step++) {
            double middle = 0.5 * (low + high),
                   at = copysign(1, middle) * through_ball(fabs(middle), ior);
            *(at > edge ? &low : &high) = middle;
        }
        struct rig_scene rig;
        open_ball(&rig, renderer, &glass, edge);
        for (int form = 0; form < 2; form++) {
            struct view view = look(form);
            struct image image = shoot_color(renderer, &rig, &view);
            double found = find_edge(&image, 1, -0.95, 0.95);
            print_message("index %.1f, edge at %.1f: seen at %.4f, expected %.4f\n", ior, edge,
                          found, low);
            assert_true(fabs(found - low) <= WIDE / WIDTH);
            image_finish(&image);
        }
        rig_scene_finish(&rig, renderer);
    }
}

/* ---- a furnace ---- */

static void attach_white(struct renderer *renderer, struct environment **map)
{
    float pixels[3 * 16 * 8];
    struct error err = {0};
    for (size_t i = 0; i < sizeof pixels / sizeof *pixels; i++)
        pixels[i] = 1;
    *map = environment_create(&(struct environment_desc){pixels, 16, 8}, &err);
    assert_non_null(*map);
    const struct renderer_environment_desc desc = {.key = "white", .environment = *map};
    assert_true(renderer_attach_environment(renderer, &desc, &err));
}

/* White all around: a ball of clear glass returns all of it where the interface reflects what it
 * does not let through, within what GGX loses to scattering between facets. */
static void a_ball_in_a_furnace_gains_nothing(void **state)
{
    struct renderer *renderer = *state;
    struct environment *map;
    attach_white(renderer, &map);
    for (int i = 0; i < 12; i++) {
        struct glb_material_desc glass = glass_of(i % 3 ? 1.5 : 1.1);
        struct rig_scene rig;
        glass.roughness = 0.25 * (i / 3);
        glass.thickness = i % 3 == 2 ? 0 : 1;
        open_ball(&rig, renderer, &glass, 20);
        struct view view = {
            .width_px = 12,
            .height_px = 12,
            .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 0, 5}, .fov_y_deg = 22},
            .environment_key = "white",
            .environment_intensity = 1,
            .environment_is_background = true,
            .quality = {.shadows = SHADOWS_RAYTRACED, .samples = 1, .environment_samples = 512}};
        double means[2], most = 0, least = 1;
        for (int form = 0; form < 2; form++) {
            double mean[3];
            view.quality.reference = form;
            struct image image = shoot_color(renderer, &rig, &view);
            image_mean(&image, (double[]){0.15, 0.15, 0.85, 0.85}, mean);
            means[form] = mean[1];
            for (int p = 0; p < 144; p++) {
                most = fmax(most, (double)((const float *)image.pixels)[4 * p + 1]);
                least = fmin(least, (double)((const float *)image.pixels)[4 * p + 1]);
            }
            image_finish(&image);
        }
        print_message("index %.1f, roughness %.2f, %s: %.4f and %.4f, from %.3f to %.3f\n",
                      glass.ior, glass.roughness, glass.thickness > 0 ? "solid" : "thin", means[0],
                      means[1], least, most);
        assert_true(most <= 1.02);
        assert_true(least >= 0.8 && means[0] >= 0.93 && fabs(means[0] - means[1]) < 0.02);
        rig_scene_finish(&rig, renderer);
    }
    renderer_detach_environment(renderer, "white");
    environment_destroy(map);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_slab_shifts_what_is_behind_by_the_offset_of_snell),
        cmocka_unit_test(a_ball_inverts_as_its_closed_form),
        cmocka_unit_test(colours_part_by_their_indices),
        cmocka_unit_test(a_ball_in_a_furnace_gains_nothing),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
