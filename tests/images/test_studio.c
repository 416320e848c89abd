/* SPDX-License-Identifier: MIT */
/* Studio lighting on a white floor under a block: its irradiance is that of the map and of the key,
 * in every technique, and the key's shadow is where the light is taken away. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "renderer/scene/studio.h"
#include "tests/support/boxes.h"
#include "tests/support/image_checks.h"

enum { SIZE = 64 };

static void add(struct glb_builder *builder, const char *name, const double low[3],
                const double high[3])
{
    const struct glb_material_desc white = {
        .name = name, .base_color = {1, 1, 1, 1}, .roughness = 1, .has_ior = true, .ior = 1};
    builder_add_box(builder, &white, low, high);
}

/* The top of the floor is y = 0; a small block hangs over its middle. */
static void open_floor(struct rig_scene *rig, struct renderer *renderer, bool has_lamp)
{
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Floor", &err);
    void *glb;
    size_t size_bytes;
    assert_non_null(builder);
    add(builder, "Floor", (const double[]){-4, -0.5, -4}, (const double[]){4, 0, 4});
    add(builder, "Block", (const double[]){-0.2, 1, -0.2}, (const double[]){0.2, 1.4, 0.2});
    if (has_lamp) {
        const struct glb_light_desc lamp = {
            .type = GLB_LIGHT_POINT, .color = {1, 1, 1}, .intensity = 2};
        struct glb_node_desc node = {.name = "Lamp",
                                     .translation = {2, 2, 2},
                                     .light = glb_builder_add_light(builder, &lamp)};
        glb_builder_add_node(builder, &node);
    }
    if (!glb_builder_finish(builder, &glb, &size_bytes, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    rig_scene_open(rig, renderer, has_lamp ? "lamp" : "floor", glb, size_bytes);
    free(glb);
}

/* From above and before, past the block. */
static struct view look(enum shadow_technique shadows)
{
    return (struct view){
        .width_px = SIZE,
        .height_px = SIZE,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                   .eye = {0, 8, 0},
                   .up = {0, 0, -1},
                   .ortho_height = 4},
        .quality = {.samples = 1, .shadows = shadows},
    };
}

/* Of a floor under the map of radiance 1, over pi: summed over the upper half of its texels. */
static double under_the_map(void)
{
    struct environment *studio = environment_create_studio(NULL);
    struct environment_map map = environment_radiance_map(studio);
    double sum = 0;
    for (int y = 0; y < map.height / 2; y++)
        for (int x = 0; x < map.width; x++) {
            double theta = M_PI * (y + 0.5) / map.height;
            double texel_sr = 2 * M_PI / map.width * M_PI / map.height * sin(theta);
            size_t at = 3 * ((size_t)y * (size_t)map.width + (size_t)x);
            sum += cos(theta) * texel_sr * (double)map.pixels[at];
        }
    environment_destroy(studio);
    return sum / M_PI;
}

/* What a white floor sends that gets the studio's map, and the key or its shadow. */
static double floor_radiance(bool is_lit)
{
    struct view view = {.width_px = 1};
    const struct scene dark = {.node_count = 0};
    studio_apply(&dark, &view);
    const struct view_light key = studio_key_light();
    const double *d = key.direction;
    double cosine = -d[1] / sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    return view.environment_intensity * under_the_map() +
           (is_lit ? (double)key.intensity * cosine / M_PI : 0);
}

/* The mean of the pixels around a place of the floor: rays towards the map are drawn. */
static double at(const struct image *image, double x, double z, int around)
{
    int column = (int)((x / 4 + 0.5) * SIZE), row = (int)((z / 4 + 0.5) * SIZE);
    const float *pixels = image->pixels;
    double sum = 0;
    int count = 0;
    for (int j = -around; j <= around; j++)
        for (int i = -around; i <= around; i++, count++)
            sum += (double)pixels[4 * ((size_t)(row + j) * SIZE + (size_t)(column + i))];
    return sum / count;
}

/* Rays find the block in the way of some of the map: most of all in its shadow. */
static void the_floor_has_the_light_of_map_and_key(void **state)
{
    static const struct {
        enum shadow_technique shadows;
        bool reference;
        double tolerance, hidden; /* shares */
    } ways[] = {
        {SHADOWS_MAP, false, 0.015, 0},
        {SHADOWS_DEEP, false, 0.015, 0},
        {SHADOWS_RAYTRACED_SHADOWS, false, 0.015, 0},
        {SHADOWS_RAYTRACED, false, 0.04, 0.15},
        {SHADOWS_RAYTRACED, true, 0.02, 0.15},
    };
    struct renderer *renderer = *state;
    struct rig_scene rig;
    open_floor(&rig, renderer, false);
    const struct view_light key = studio_key_light();
    /* the block's middle is 1.2 m above the floor */
    double x = -key.direction[0] / key.direction[1] * 1.2;
    double z = -key.direction[2] / key.direction[1] * 1.2;
    assert_true(x > 0 && z < 0); /* the light comes from the left and before */
    for (size_t i = 0; i < sizeof ways / sizeof *ways; i++) {
        struct view view = look(ways[i].shadows);
        view.quality.reference = ways[i].reference;
        struct frame frame;
        shoot(renderer, &rig, &view, &frame);
        const struct image *image = &frame.outputs[VIEW_OUTPUT_COLOR];
        double lit = at(image, -1.3, 1.3, 8), dark = at(image, x, z, 1);
        print_message("lit %.4f of %.4f, in the shadow %.4f of %.4f\n", lit, floor_radiance(true),
                      dark, floor_radiance(false));
        double expected = floor_radiance(true), shadow = floor_radiance(false);
        assert_true(fabs(lit - expected) <= ways[i].tolerance * expected);
        assert_true(dark <= (1 + ways[i].tolerance) * shadow);
        assert_true(dark >= (1 - ways[i].tolerance - ways[i].hidden) * shadow);
        assert_string_equal(frame.report.environment, VIEW_STUDIO_KEY);
        assert_int_equal(frame.report.counts.lights, 1);
        assert_int_equal(frame.report.warning_count, 1);
        assert_non_null(strstr(frame.report.warnings[0], "the studio lights it by default"));
        frame_finish(&frame);
    }
    rig_scene_finish(&rig, renderer);
}

/* The same bits come of a request that says all of it. */
static void the_default_is_what_a_request_can_say(void **state)
{
    struct renderer *renderer = *state;
    struct rig_scene rig;
    open_floor(&rig, renderer, false);
    struct view view = look(SHADOWS_MAP), said = view;
    const struct view_light key = studio_key_light();
    struct image by_default = shoot_color(renderer, &rig, &view);
    studio_apply(&(const struct scene){.node_count = 0}, &said);
    said.studio = VIEW_STUDIO_OFF;
    said.lights = &key;
    said.light_count = 1;
    struct image by_request = shoot_color(renderer, &rig, &said);
    assert_memory_equal(by_default.pixels, by_request.pixels, image_size_bytes(&by_default));
    view.studio = VIEW_STUDIO_OFF;
    struct image dark = shoot_color(renderer, &rig, &view);
    assert_true(at(&dark, -1.3, 1.3, 8) == 0);
    image_finish(&by_default);
    image_finish(&by_request);
    image_finish(&dark);
    rig_scene_finish(&rig, renderer);
}

/* Beside a lamp of the scene it is off, and where it is switched on its light adds up. */
static void a_switch_adds_it_to_a_lamp(void **state)
{
    struct renderer *renderer = *state;
    struct rig_scene rig;
    open_floor(&rig, renderer, true);
    struct view view = look(SHADOWS_MAP);
    struct frame frame;
    shoot(renderer, &rig, &view, &frame);
    double lamp = at(&frame.outputs[VIEW_OUTPUT_COLOR], -1.3, 1.3, 8);
    assert_true(lamp > 0);
    assert_int_equal(frame.report.warning_count, 0);
    assert_string_equal(frame.report.environment, "");
    frame_finish(&frame);
    view.studio = VIEW_STUDIO_ON;
    shoot(renderer, &rig, &view, &frame);
    double both = at(&frame.outputs[VIEW_OUTPUT_COLOR], -1.3, 1.3, 8);
    assert_true(fabs(both - lamp - floor_radiance(true)) <= 0.01 * both);
    assert_int_equal(frame.report.warning_count, 0); /* it was asked for */
    assert_int_equal(frame.report.counts.lights, 2);
    frame_finish(&frame);
    rig_scene_finish(&rig, renderer);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_floor_has_the_light_of_map_and_key),
        cmocka_unit_test(the_default_is_what_a_request_can_say),
        cmocka_unit_test(a_switch_adds_it_to_a_lamp),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
