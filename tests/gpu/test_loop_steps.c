/* SPDX-License-Identifier: MIT */
/* No light is lost to the limit of loop steps: what shading asks of one shader invocation stays
 * below it, and where it is let go beyond, light is missing. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "renderer/gl/loop_probe.h"
#include "renderer/shading/loop_steps.h"
#include "tests/support/render_support.h"

enum {
    SIDE_PX = 9, /* odd: four floors meet in the middle of the middle pixel */
    MIDDLE = SIDE_PX * SIDE_PX / 2,
    DEVICE_STEPS = 65535,
    NO_LIMIT = 1 << 30,
    LAYERS_MOST = 20000, /* PIXEL_LISTS_LONGEST_MAX */
};

static const double filter = 0.9999; /* of a layer */

struct stack { /* of glass: triangles over all floors, or closed bodies */
    int count;
    double low, high; /* m */
    bool is_bodies;
    double half;    /* m; 0 means 9 */
    bool surrounds; /* the first body is around the eye and the floors */
};

static void add_floors(struct glb_builder *builder)
{
    static const double corners[4][2] = {{-3, -3}, {0, -3}, {-3, 0}, {0, 0}};
    static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    static const float normals[12] = {0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0};
    int material = glb_builder_add_material(
        builder, &(struct glb_material_desc){
                     .base_color = {0.5, 0.5, 0.5, 1}, .roughness = 1, .has_ior = true, .ior = 1});
    for (int i = 0; i < 4; i++) { /* at four heights: samples of different ones are lit apart */
        float x = (float)corners[i][0], z = (float)corners[i][1], y = -0.1f * (float)i;
        const float positions[12] = {x, y, z + 3, x + 3, y, z + 3, x + 3, y, z, x, y, z};
        int mesh = glb_builder_add_mesh(builder, "Floor",
                                        &(struct glb_primitive_desc){.material = material,
                                                                     .vertex_count = 4,
                                                                     .positions = positions,
                                                                     .normals = normals,
                                                                     .indices = indices,
                                                                     .index_count = 6},
                                        1);
        glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Floor", .mesh = mesh});
    }
}

/* A layer is a triangle, a body the prism between two of them. */
static void add_stack(struct glb_builder *builder, const struct stack *stack)
{
    static const uint32_t prism[24] = {0, 1, 2, 3, 5, 4, 0, 3, 1, 1, 3, 4,
                                       1, 4, 2, 2, 4, 5, 2, 5, 0, 0, 5, 3};
    size_t per_item = stack->is_bodies ? 6 : 3, items = (size_t)stack->count;
    size_t per_item_indices = stack->is_bodies ? 24 : 3, triangles = items * per_item / 3;
    float *positions = calloc(items * per_item * 3, sizeof *positions);
    uint32_t *indices = calloc(items * per_item_indices, sizeof *indices);
    assert_non_null(positions);
    assert_non_null(indices);
    for (size_t i = 0; i < triangles; i++) { /* from above */
        float y = (float)(stack->high - (stack->high - stack->low) * (double)i / (double)triangles);
        float half = stack->half > 0 ? (float)stack->half : 9;
        if (stack->surrounds && i < 2) {
            y = i ? -1 : 3;
            half = 6;
        }
        const float corners[9] = {-half, y, half, 2 * half, y, half, -half, y, -2 * half};
        memcpy(positions + 9 * i, corners, sizeof corners);
    }
    for (size_t i = 0; i < items * per_item_indices; i++)
        indices[i] = (uint32_t)(i / per_item_indices * per_item) + prism[i % per_item_indices];
    struct glb_material_desc glass = {.name = "Glass",
                                      .base_color = {filter, filter, filter, 1},
                                      .transmission = 1,
                                      .has_ior = true,
                                      .ior = 1,
                                      .is_double_sided = true};
    if (stack->is_bodies) {
        glass.thickness = 1;
        glass.attenuation_distance = 1000;
        for (int k = 0; k < 3; k++)
            glass.attenuation_color[k] = 0.9;
    }
    int mesh = glb_builder_add_mesh(
        builder, "Stack",
        &(struct glb_primitive_desc){.material = glb_builder_add_material(builder, &glass),
                                     .vertex_count = items * per_item,
                                     .positions = positions,
                                     .indices = indices,
                                     .index_count = items * per_item_indices},
        1);
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = "Stack", .mesh = mesh});
    free(positions);
    free(indices);
}

/* A scene on one renderer, under a name of its own. */
static void open_scene(struct rig_scene *scene, struct renderer *renderer,
                       const struct stack *stack)
{
    static int number;
    char key[32];
    struct error err = {0};
    void *glb = NULL;
    size_t size = 0;
    struct glb_builder *builder = glb_builder_create("Steps", &err);
    assert_non_null(builder);
    add_floors(builder);
    if (stack->count)
        add_stack(builder, stack);
    snprintf(key, sizeof key, "steps %d", number++);
    if (!glb_builder_finish(builder, &glb, &size, &err) ||
        !rig_scene_from_glb(scene, renderer, key, glb, size, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    free(glb);
}

struct shot {
    size_t lights; /* equal ones at one place, which give as much together as one */
    bool is_shadowed;
    bool leaves_out; /* the glass casts no shadow on itself: lists are walked */
    int samples, taps;
    enum view_light_lists lists;
    enum view_output output; /* of whose middle pixel the first channel is told */
};

static bool try_shot(struct renderer *renderer, const struct rig_scene *scene,
                     const struct shot *shot, struct frame *frame, struct error *err)
{
    struct view_light *lights = calloc(shot->lights + 1, sizeof *lights);
    assert_non_null(lights);
    for (size_t i = 0; i < shot->lights; i++)
        lights[i] = (struct view_light){.type = SCENE_LIGHT_SPOT,
                                        .position = {0.3, 20, 0.2},
                                        .direction = {0, -1, 0},
                                        .color = {1, 1, 1},
                                        .intensity = 1000.0f / (float)shot->lights,
                                        .inner_cone_deg = 24,
                                        .outer_cone_deg = 25,
                                        .casts_no_shadow = !shot->is_shadowed};
    const struct view_material_override glass = {.material = "Glass", .has_self_shadow = true};
    struct view view = {
        .width_px = SIDE_PX,
        .height_px = SIDE_PX,
        .outputs = 1u << shot->output,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 1, 0}, .up = {0, 0, -1}},
        .lights = lights,
        .light_count = shot->lights,
        .ignore_scene_lights = true,
        .materials = &glass,
        .material_override_count = shot->leaves_out,
        .quality = {.shadows = SHADOWS_DEEP,
                    .samples = shot->samples,
                    .shadow_taps = shot->taps,
                    .shadow_resolution = 8,
                    .light_lists = shot->lists},
    };
    bool is_made = renderer_render(renderer, scene->key, &view, frame, err);
    free(lights);
    return is_made;
}

static float shoot(struct renderer *renderer, const struct rig_scene *scene,
                   const struct shot *shot, struct frame_report *report)
{
    struct frame frame;
    struct error err = {0};
    if (!try_shot(renderer, scene, shot, &frame, &err))
        fail_msg("%zu lights: %s", shot->lights, err.message);
    struct image *image = &frame.outputs[shot->output];
    float value = image->component == IMAGE_U32
                      ? (float)((uint32_t *)image->pixels)[MIDDLE]
                      : image_pixel_f32(image, SIDE_PX / 2, SIDE_PX / 2)[0];
    if (report)
        *report = frame.report;
    frame_finish(&frame);
    return value;
}

static float one_light(struct renderer *renderer, const struct rig_scene *scene, struct shot shot)
{
    shot.lights = 1;
    return shoot(renderer, scene, &shot, NULL);
}

static const struct steps_case {
    const char *name;
    struct stack stack;
    struct shot shot;
} cases[] = {
    {"4096 unshadowed, 4 surfaces", {0}, {4096, false, false, 4, 1, 0, 0}},
    {"14000 unshadowed, linked", {0}, {14000, false, false, 1, 1, VIEW_LIGHT_LISTS_LINKED, 0}},
    {"4096 through 16 layers, 4 taps",
     {16, 3, 10, false, 0, false},
     {4096, true, false, 4, 4, 0, 0}},
    {"4096 through 16 layers, walked",
     {16, 3, 10, false, 0, false},
     {4096, true, true, 4, 4, 0, 0}},
    {"1000 through 100 layers, 9 taps",
     {100, 3, 10, false, 0, false},
     {1000, true, false, 4, 9, 0, 0}},
    {"1000 through 100 layers, walked",
     {100, 3, 10, false, 0, false},
     {1000, true, true, 1, 9, 0, 0}},
    {"100 through 1000 layers, walked",
     {1000, 3, 10, false, 0, false},
     {100, true, true, 4, 4, 0, 0}},
    {"2000 through 100 bodies", {100, 3, 10, true, 0, false}, {2000, true, false, 4, 4, 0, 0}},
    {"500 through 100 bodies, walked", {100, 3, 10, true, 0, false}, {500, true, true, 4, 4, 0, 0}},
};
enum { CASES = sizeof cases / sizeof *cases };

/* Of many lights as of one: within what adding so many numbers loses. */
static bool is_equal(float many, float one, size_t lights)
{
    return one > 0.01f && fabsf(many - one) <= (1e-4f + 2e-8f * (float)lights) * one;
}

static void check_cases(struct renderer *renderer)
{
    for (int i = 0; i < CASES; i++) {
        struct rig_scene scene;
        struct frame_report report;
        open_scene(&scene, renderer, &cases[i].stack);
        float one = one_light(renderer, &scene, cases[i].shot);
        float many = shoot(renderer, &scene, &cases[i].shot, &report);
        if (!is_equal(many, one, cases[i].shot.lights))
            fail_msg("%s: %.7g, one light %.7g", cases[i].name, (double)many, (double)one);
        print_message("%s: longest list %llu, in %llu pieces, off by %.1e\n", cases[i].name,
                      (unsigned long long)report.counts.longest_list,
                      (unsigned long long)report.counts.light_chunks, fabs(many / one - 1.0));
        rig_scene_finish(&scene, renderer);
    }
}

static void lights_taps_and_lists_together_lose_nothing(void **state)
{
    check_cases(*state);
}

/* So the bounds are bounds, and do not live by what is left between them and the limit. */
static void steps_are_counted_high_enough_for_every_step_of_the_device(void **state)
{
    check_cases(*state);
}

/* What the pieces are for; on devices that end no loop there is nothing to see. */
static void one_dispatch_for_all_would_lose_light(void **state)
{
    struct renderer *renderer = *state;
    struct renderer_info info;
    renderer_get_info(renderer, &info);
    if (!info.loop_end)
        skip();
    for (int i = 0; i < CASES; i++) {
        struct rig_scene scene;
        struct frame_report report;
        struct shot shot = cases[i].shot;
        shot.lights *= shot.is_shadowed ? 1 : 4;
        if (shot.lists == VIEW_LIGHT_LISTS_LINKED)
            continue;
        open_scene(&scene, renderer, &cases[i].stack);
        float one = one_light(renderer, &scene, shot);
        float many = shoot(renderer, &scene, &shot, &report);
        assert_int_equal(report.counts.light_chunks, 1);
        print_message("%s: %.3f of the light\n", cases[i].name, (double)(many / one));
        if (is_equal(many, one, shot.lights))
            fail_msg("%s: %.7g of %.7g in one dispatch", cases[i].name, (double)many, (double)one);
        rig_scene_finish(&scene, renderer);
    }
}

/* Asked once more, with fewer and more steps than those after which loops were found to end. */
static void the_end_of_loops_is_found_where_it_is(void **state)
{
    struct renderer_info info;
    struct error err = {0};
    struct program_cache *programs = program_cache_create(NULL, &err);
    uint32_t end = 1;
    renderer_get_info(*state, &info);
    print_message("%s: loops end after %u steps\n", info.renderer, info.loop_end);
    assert_non_null(programs);
    uint32_t whole = info.loop_end ? info.loop_end : LOOP_STEPS_WATCHDOG;
    assert_true(loop_probe_run(programs, whole, &end, &err));
    assert_int_equal(end, 0);
    assert_true(loop_probe_run(programs, 2 * whole, &end, &err));
    if (info.loop_end)
        assert_int_equal(end, info.loop_end);
    assert_true(loop_steps_most(info.loop_end) <= whole);
    program_cache_destroy(programs);
}

/* Of the picture's middle: what passes all layers, and the floor behind them. Its own light is what
 * the floors send without any layer. */
static void check_layers(struct renderer *renderer, const struct stack *stack, int samples,
                         double expected)
{
    struct rig_scene scene;
    struct frame_report report;
    struct shot shot = {100, false, false, samples, 1, VIEW_LIGHT_LISTS_CLUSTERED, 0};
    open_scene(&scene, renderer, &(struct stack){0});
    double open = (double)shoot(renderer, &scene, &shot, NULL);
    rig_scene_finish(&scene, renderer);
    open_scene(&scene, renderer, stack);
    double floor = (double)shoot(renderer, &scene, &shot, &report);
    assert_true(report.counts.longest_pixel_list + 100 >= LAYERS_MOST);
    shot.output = VIEW_OUTPUT_TRANSMITTANCE;
    double through = (double)shoot(renderer, &scene, &shot, NULL);
    rig_scene_finish(&scene, renderer);
    print_message("%llu layers, %d samples: through %.6f, expected %.6f, floor %.6f of that\n",
                  (unsigned long long)report.counts.longest_pixel_list, samples, through, expected,
                  floor / open / expected);
    assert_float_equal(through, expected, 1e-4 * expected);
    assert_float_equal(floor, expected * open, 1e-4 * expected * open);
}

/* With lights, and without any, where nothing else is counted. */
static void expect_refusals(struct renderer *renderer, const struct stack *stack)
{
    struct rig_scene scene;
    open_scene(&scene, renderer, stack);
    for (size_t lights = 0; lights <= 100; lights += 100) {
        struct frame frame;
        struct error err = {0};
        const struct shot shot = {lights, false, false, 4, 1, VIEW_LIGHT_LISTS_CLUSTERED, 0};
        if (try_shot(renderer, &scene, &shot, &frame, &err))
            fail_msg("%zu lights are not refused", lights);
        assert_int_equal(err.code, ERROR_OVER_BUDGET);
        if (!strstr(err.message, "loop steps, limit is 60000: ask for fewer quality.samples"))
            fail_msg("%zu lights: %s", lights, err.message);
    }
    rig_scene_finish(&scene, renderer);
}

/* Devices that are not our own processors walk a list once for each sample; one of these that ends
 * loops, too, is made by tests alone. */
static bool has_no_room_for_four_walks(struct renderer *renderer)
{
    struct renderer_info info;
    renderer_get_info(renderer, &info);
    return !info.is_software && info.loop_end;
}

static void the_longest_lists_of_a_pixel_are_whole(void **state)
{
    /* inside of the picture: one that is clipped may have an edge in the middle; and sides of
     * bodies come to some pixels' lists */
    static const int layers = LAYERS_MOST - 20;
    static const struct stack stacks[] = {{layers, 0.1, 0.4, false, 0.1, false},
                                          {layers / 2, 0.1, 0.4, true, 0.1, false},
                                          {layers / 2, 0.1, 0.4, true, 0.1, true}};
    for (int samples = 1; samples <= 4; samples += 3)
        for (int i = 0; i < 3; i++) {
            if (samples > 1 && has_no_room_for_four_walks(*state)) {
                expect_refusals(*state, &stacks[i]);
                continue;
            }
            double way = i == 0 ? 0 : i == 1 ? 0.15 : 1.15; /* m inside of bodies */
            check_layers(*state, &stacks[i], samples,
                         pow((double)(float)filter, i == 2 ? layers - 2 : layers) *
                             pow(0.9, way / 1000));
        }
}

static void outputs_count_all_lights(void **state)
{
    struct renderer *renderer = *state;
    struct rig_scene scene;
    struct shot shot = {65536, false, false, 1, 1, VIEW_LIGHT_LISTS_CLUSTERED, VIEW_OUTPUT_LIGHTS};
    open_scene(&scene, renderer, &(struct stack){0});
    assert_int_equal((int)shoot(renderer, &scene, &shot, NULL), 65536);
    rig_scene_finish(&scene, renderer);
}

static int set_up(void **state, uint32_t loop_steps)
{
    struct error err = {0};
    *state = renderer_create(
        &(struct renderer_desc){.is_strict = true, .hooks.loop_steps = loop_steps}, &err);
    if (!*state)
        fail_msg("%s", err.message);
    return 0;
}

/* Takes every step that llvmpipe gives. */
static int set_up_to_the_end(void **state)
{
    return set_up(state, DEVICE_STEPS);
}

/* Walks everything at once. */
static int set_up_unlimited(void **state)
{
    return set_up(state, NO_LIMIT);
}

int main(void)
{
    /* The first skips where there is no device. */
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(lights_taps_and_lists_together_lose_nothing,
                                        render_rig_setup, render_rig_teardown),
        cmocka_unit_test_setup_teardown(steps_are_counted_high_enough_for_every_step_of_the_device,
                                        set_up_to_the_end, render_rig_teardown),
        cmocka_unit_test_setup_teardown(one_dispatch_for_all_would_lose_light, set_up_unlimited,
                                        render_rig_teardown),
        cmocka_unit_test_setup_teardown(the_end_of_loops_is_found_where_it_is, render_rig_setup,
                                        render_rig_teardown),
        cmocka_unit_test_setup_teardown(the_longest_lists_of_a_pixel_are_whole, render_rig_setup,
                                        render_rig_teardown),
        cmocka_unit_test_setup_teardown(outputs_count_all_lights, render_rig_setup,
                                        render_rig_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
