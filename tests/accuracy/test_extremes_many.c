/* SPDX-License-Identifier: MIT */
/* Very many of everything: lights, shadowed lights, objects that leave themselves out, triangles.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#include "glb/shapes.h"
#include "tests/support/extreme_checks.h"
#include "tests/support/extreme_scene.h"
#include "tests/support/image_checks.h"
#include "tests/support/shadow_rig.h"

static double processor_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

/* The scene's point lamp, as `count` lamps that together are as bright and stand at its place. */
static struct view_light *divide_lamp(const struct extreme_scene *scene, size_t count, bool is_dark)
{
    struct view_light *lights = calloc(count + 1, sizeof *lights);
    assert_non_null(lights);
    for (size_t i = 0; i < count; i++) {
        lights[i] = scene->lights[0];
        lights[i].intensity /= (float)count;
        lights[i].casts_no_shadow = is_dark;
    }
    return lights;
}

/* The same place and power, however many: a lost light would be missing in the sum. */
static void no_light_is_lost_from_none_to_65536(void **state)
{
    static const size_t counts[] = {50, 250, 4096, 65536};
    struct extreme_scene scene;
    extreme_scene_open(&scene, *state, "many", &(struct extreme_desc){0});
    struct view view = scene.view;
    view.width_px = 40;
    view.height_px = 30;
    view.quality.samples = 1;
    view.light_count = 0;
    view.ignore_scene_lights = true;
    struct image dark = shoot_color(*state, &scene.rig, &view);
    assert_image_is_sound(&dark, 0); /* no light: black, not default */
    view.light_count = 1;
    view.quality.shadows = SHADOWS_NONE;
    struct image one = shoot_color(*state, &scene.rig, &view);
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        struct view_light *lights = divide_lamp(&scene, counts[i], true);
        char name[64];
        view.lights = lights;
        view.light_count = counts[i];
        double before_ms = processor_ms();
        struct image many = shoot_color(*state, &scene.rig, &view);
        double error = extreme_rmse(&many, &one), tolerance = 1e-6 + 2e-8 * (double)counts[i];
        snprintf(name, sizeof name, "%zu lamps at one place against one", counts[i]);
        print_message("%.0f ms: ", processor_ms() - before_ms);
        extreme_expect(&(struct extreme_row){name, "clustered", "RMSE, relative", tolerance},
                       error);
        image_finish(&many);
        free(lights);
    }
    image_finish(&one);
    image_finish(&dark);
    extreme_scene_finish(&scene, *state);
}

/* A million lamps: a picture, or a refusal with the numbers; then the next frame. */
static void a_million_lights_are_served_or_refused_by_number(void **state)
{
    enum { MILLION = 1000000 };
    struct extreme_scene scene;
    struct frame frame;
    struct error err = {0};
    extreme_scene_open(&scene, *state, "many", &(struct extreme_desc){0});
    struct view_light *lights = divide_lamp(&scene, MILLION, true);
    struct view view = scene.view;
    view.width_px = view.height_px = 2;
    view.lights = lights;
    view.light_count = MILLION;
    if (renderer_render(*state, scene.rig.key, &view, &frame, &err)) {
        assert_image_is_sound(&frame.outputs[VIEW_OUTPUT_COLOR], 1e6);
        frame_finish(&frame);
    } else {
        print_message("refused: %s\n", err.message);
        assert_true(err.code == ERROR_OVER_BUDGET || err.code == ERROR_UNSUPPORTED ||
                    err.code == ERROR_INVALID_REQUEST || err.code == ERROR_TOO_LARGE);
        assert_non_null(strstr(err.message, "1000000"));
    }
    free(lights);
    struct image after = shoot_color(*state, &scene.rig, &scene.view);
    image_finish(&after);
    extreme_scene_finish(&scene, *state);
}

/* 1 to 256 shadowed lamps, spread over a square so that no two share a map: the sum of each one's
 * own picture, memory that is told and grows by equal steps, or a refusal with the budget. */
static void shadowed_lights_add_up_and_tell_their_memory(void **state)
{
    enum { MOST = 256 };
    static const size_t counts[] = {1, 5, 25, 100, MOST};
    struct extreme_scene scene;
    static struct view_light lights[MOST];
    double sum[3] = {0}, before_ms = 0;
    uint64_t before_bytes = 0;
    extreme_scene_open(&scene, *state, "many", &(struct extreme_desc){0});
    struct view view = scene.view;
    view.width_px = 24;
    view.height_px = 18;
    view.quality.samples = 1;
    view.quality.shadow_resolution = 64;
    for (size_t i = 0; i < MOST; i++) {
        lights[i] = scene.lights[0];
        lights[i].position[0] = -1.4 + 0.175 * (double)(i % 16);
        size_t row = i / 16;
        lights[i].position[2] = -1.4 + 0.175 * (double)row;
        lights[i].intensity = 0.1f;
    }
    size_t next = 0;
    for (size_t c = 0; c < sizeof counts / sizeof *counts; c++) {
        struct frame frame;
        double mean[3];
        const double whole[4] = {0, 0, 1, 1};
        for (; next < counts[c]; next++) {
            view.lights = &lights[next];
            view.light_count = 1;
            struct image alone = shoot_color(*state, &scene.rig, &view);
            image_mean(&alone, whole, mean);
            for (int k = 0; k < 3; k++)
                sum[k] += mean[k];
            image_finish(&alone);
        }
        view.lights = lights;
        view.light_count = counts[c];
        view.quality.shadow_resolution = 160 + (int)c; /* nothing to reuse */
        double begin_ms = processor_ms();
        shoot(*state, &scene.rig, &view, &frame);
        double ms = processor_ms() - begin_ms;
        frame_finish(&frame);
        view.quality.shadow_resolution = 64;
        shoot(*state, &scene.rig, &view, &frame);
        uint64_t bytes = report_bytes_of(&frame.report, "shadow.");
        image_mean(&frame.outputs[VIEW_OUTPUT_COLOR], whole, mean);
        double worst = 0;
        for (int k = 0; k < 3; k++)
            worst = fmax(worst, fabs(mean[k] / sum[k] - 1));
        char name[64];
        snprintf(name, sizeof name, "%zu shadowed lamps against each alone", counts[c]);
        print_message("%.0f ms, %llu bytes: ", ms, (unsigned long long)bytes);
        extreme_expect(&(struct extreme_row){name, "deep", "energy, relative", 1e-5}, worst);
        assert_int_equal(frame.report.counts.shadowed_lights, counts[c]);
        assert_true(bytes >= before_bytes && bytes > 0);
        assert_true(c == 0 || counts[c] < 25 || ms > before_ms); /* more lights, more work */
        before_bytes = bytes;
        before_ms = ms;
        frame_finish(&frame);
    }
    extreme_scene_finish(&scene, *state);
}

/* Triangles of random place and direction in a ball over a floor, as `objects` nodes of one mesh
 * each; a fifth of them of glass. */
static void open_soup(struct rig_scene *scene, struct renderer *renderer, size_t triangles,
                      size_t objects)
{
    struct error err = {0};
    struct glb_builder *b = glb_builder_create("Soup", &err);
    size_t each = triangles / objects;
    float *positions = malloc(each * 9 * sizeof *positions);
    uint64_t seed = 1;
    void *bytes;
    size_t size;
    assert_non_null(positions);
    int materials[2];
    for (int i = 0; i < 2; i++)
        materials[i] = glb_builder_add_material(
            b, &(struct glb_material_desc){.base_color = {0.7, 0.5 + 0.4 * i, 0.6, 1},
                                           .transmission = i,
                                           .roughness = 0.6,
                                           .is_double_sided = true});
    double edge = 4 / sqrt((double)triangles); /* half as much area as the ball's shadow */
    for (size_t o = 0; o < objects; o++) {
        for (size_t i = 0; i < each * 9; i += 9) {
            float center[3];
            for (int k = 0; k < 3; k++)
                center[k] = (float)(rig_random(&seed) * 2 - 1 + (k == 1 ? 1.2 : 0));
            for (size_t k = 0; k < 9; k++)
                positions[i + k] = center[k % 3] + (float)(edge * (rig_random(&seed) - 0.5));
        }
        struct glb_primitive_desc primitive = {
            .material = materials[o % 5 == 0], .vertex_count = each * 3, .positions = positions};
        struct glb_node_desc node = {.mesh = glb_builder_add_mesh(b, "Soup", &primitive, 1)};
        glb_builder_add_node(b, &node);
    }
    free(positions);
    struct shape floor = {0};
    shape_add_quad(&floor, (double[]){-3, 0, 3}, (double[]){6, 0, 0}, (double[]){0, 0, -6});
    glb_builder_add_node(
        b, &(struct glb_node_desc){.mesh = shape_give_mesh(&floor, b, "Floor", materials[0])});
    if (!glb_builder_finish(b, &bytes, &size, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(b);
    rig_scene_open(scene, renderer, "soup", bytes, size);
    free(bytes);
}

static void check_soup(struct renderer *renderer, size_t triangles, size_t objects)
{
    struct rig_scene scene;
    char name[96];
    double before_ms = processor_ms();
    open_soup(&scene, renderer, triangles, objects);
    double load_ms = processor_ms() - before_ms;
    const struct view_light lamp = {.type = SCENE_LIGHT_SPOT,
                                    .position = {0.5, 5, 1},
                                    .direction = {-0.1, -1, -0.2},
                                    .color = {1, 1, 1},
                                    .intensity = 30,
                                    .outer_cone_deg = 40};
    struct view view = {
        .width_px = 128,
        .height_px = 96,
        .lights = &lamp,
        .light_count = 1,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 2.5, 5}, .target = {0, 0.8, 0}},
        .quality = {.samples = 1, .shadow_resolution = 256}};
    struct frame frame;
    before_ms = processor_ms();
    shoot(renderer, &scene, &view, &frame);
    double frame_ms = processor_ms() - before_ms;
    assert_image_is_sound(&frame.outputs[VIEW_OUTPUT_COLOR], 1e6);
    assert_true(frame.report.counts.triangles >= triangles);
    view.quality.shadows = SHADOWS_RAYTRACED;
    struct image truth = shoot_color(renderer, &scene, &view);
    double mean[3], expected[3], worst = 0;
    const double whole[4] = {0, 0, 1, 1};
    image_mean(&frame.outputs[VIEW_OUTPUT_COLOR], whole, mean);
    image_mean(&truth, whole, expected);
    for (int k = 0; k < 3; k++)
        worst = fmax(worst, fabs(mean[k] / expected[k] - 1));
    snprintf(name, sizeof name, "%zu triangles in %zu objects against ray tracing", triangles,
             objects);
    print_message("%.0f ms to load, %.0f ms: ", load_ms, frame_ms);
    extreme_expect(&(struct extreme_row){name, "deep", "energy, relative", 0.01}, worst);
    image_finish(&truth);
    frame_finish(&frame);
    rig_scene_finish(&scene, renderer);
}

static void soups_of_triangles_and_crowds_of_objects_are_drawn(void **state)
{
    check_soup(*state, 15600 * 4, 15600);
    check_soup(*state, 1000000, 40);
    if (extreme_is_full())
        check_soup(*state, 12000000, 240);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_light_is_lost_from_none_to_65536),
        cmocka_unit_test(a_million_lights_are_served_or_refused_by_number),
        cmocka_unit_test(shadowed_lights_add_up_and_tell_their_memory),
        cmocka_unit_test(soups_of_triangles_and_crowds_of_objects_are_drawn),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
