/* SPDX-License-Identifier: MIT */
/* The auxiliary outputs that are measures: positions, transmittances, and lengths of lists. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/image_checks.h"

enum { WIDTH = 96, HEIGHT = 54, PIXELS = WIDTH * HEIGHT, NODES_MAX = 256 };

struct demo {
    struct renderer *renderer;
    struct rig_scene rig;
    struct view_node_override hidden[NODES_MAX]; /* every node that shows something opaque */
    char names[NODES_MAX][16];
    size_t hidden_count;
};

static struct view nave_view(uint32_t outputs)
{
    return (struct view){
        .width_px = WIDTH,
        .height_px = HEIGHT,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 2, 4}, .target = {0, 2.5, -2}},
        .outputs = outputs,
        .quality.samples = 1,
    };
}

static void every_position_is_where_its_pixel_looks(void **state)
{
    const struct demo *demo = *state;
    struct view view = nave_view(1u << VIEW_OUTPUT_POSITION | 1u << VIEW_OUTPUT_DEPTH);
    struct frame frame;
    int differing = 0, hits = 0;
    shoot(demo->renderer, &demo->rig, &view, &frame);
    const float *depths = frame.outputs[VIEW_OUTPUT_DEPTH].pixels;
    for (int i = 0; i < PIXELS; i++) {
        const float *p =
            image_pixel_f32(&frame.outputs[VIEW_OUTPUT_POSITION], i % WIDTH, i / WIDTH);
        if (!isfinite(depths[i])) {
            assert_true(isinf(p[0]) && isinf(p[1]) && isinf(p[2]));
            continue;
        }
        const double world[3] = {(double)p[0], (double)p[1], (double)p[2]};
        double pixel[2];
        hits++;
        assert_true(view_project(&view, world, pixel));
        assert_true(fabs(pixel[0] - (i % WIDTH + 0.5)) < 1e-3);
        assert_true(fabs(pixel[1] - (i / WIDTH + 0.5)) < 1e-3);
        struct pick_result picked;
        assert_true(renderer_pick(demo->renderer, demo->rig.key, &view,
                                  &(struct pick_desc){.x = i % WIDTH + 0.5, .y = i / WIDTH + 0.5},
                                  &picked, NULL));
        double away = 0;
        for (int k = 0; k < 3 && picked.layer_count; k++)
            away = fmax(away, fabs(picked.layers[0].position[k] - world[k]));
        differing += !picked.layer_count || away > 1e-4 * (double)depths[i];
        pick_result_finish(&picked);
    }
    print_message("%d of %d positions differ from the picked ones\n", differing, hits);
    assert_true(hits > PIXELS / 2);
    assert_true(differing < PIXELS / 200); /* at edges f32 and f64 choose different neighbours */
    frame_finish(&frame);
}

/* What a background of 1 adds to a picture is what the layers before it let through: filters,
 * their Fresnel terms, textures and angles. */
static void the_transmittance_is_the_share_of_the_background(void **state)
{
    struct demo *demo = *state;
    uint32_t outputs = 1u << VIEW_OUTPUT_COLOR | 1u << VIEW_OUTPUT_TRANSMITTANCE;
    struct view view = nave_view(outputs);
    struct frame light, dark;
    int filtered = 0;
    view.nodes = demo->hidden;
    view.node_override_count = demo->hidden_count;
    view.background[3] = 1;
    shoot(demo->renderer, &demo->rig, &view, &dark);
    for (int k = 0; k < 3; k++)
        view.background[k] = 1;
    shoot(demo->renderer, &demo->rig, &view, &light);
    assert_same_bits(&light.outputs[VIEW_OUTPUT_TRANSMITTANCE],
                     &dark.outputs[VIEW_OUTPUT_TRANSMITTANCE]);
    for (int i = 0; i < PIXELS; i++) {
        int x = i % WIDTH, y = i / WIDTH;
        const float *with = image_pixel_f32(&light.outputs[VIEW_OUTPUT_COLOR], x, y);
        const float *without = image_pixel_f32(&dark.outputs[VIEW_OUTPUT_COLOR], x, y);
        const float *t = image_pixel_f32(&light.outputs[VIEW_OUTPUT_TRANSMITTANCE], x, y);
        filtered += t[0] < 1;
        for (int k = 0; k < 3; k++)
            assert_true(fabsf(with[k] - without[k] - t[k]) <= 1e-6f * fmaxf(1, with[k]));
    }
    assert_true(filtered > PIXELS / 20 && filtered < PIXELS);
    frame_finish(&light);
    frame_finish(&dark);
}

static void layers_count_what_a_ray_meets(void **state)
{
    const struct demo *demo = *state;
    struct view view = nave_view(1u << VIEW_OUTPUT_LAYERS);
    struct frame frame;
    int differing = 0, layered = 0;
    shoot(demo->renderer, &demo->rig, &view, &frame);
    const uint32_t *layers = frame.outputs[VIEW_OUTPUT_LAYERS].pixels;
    for (int i = 0; i < PIXELS; i++) {
        struct pick_result met;
        uint32_t transparent = 0;
        assert_true(renderer_pick(
            demo->renderer, demo->rig.key, &view,
            &(struct pick_desc){.x = i % WIDTH + 0.5, .y = i / WIDTH + 0.5, .is_through = true},
            &met, NULL));
        for (size_t k = 0; k < met.layer_count; k++)
            transparent += met.layers[k].is_transparent;
        differing += transparent != layers[i];
        layered += layers[i] > 0;
        pick_result_finish(&met);
    }
    print_message("%d of %d pixels differ, %d have layers\n", differing, PIXELS, layered);
    assert_true(layered > 100 && differing < PIXELS / 100);
    frame_finish(&frame);
}

/* Directional lights are in every list, a spot that ends before the wall in some. */
static void lights_count_the_list_of_either_form(void **state)
{
    const struct demo *demo = *state;
    const struct view_light lights[] = {
        {.type = SCENE_LIGHT_DIRECTIONAL,
         .direction = {0, -1, 0},
         .color = {1, 1, 1},
         .intensity = 1},
        {.type = SCENE_LIGHT_DIRECTIONAL,
         .direction = {1, -1, 0},
         .color = {1, 1, 1},
         .intensity = 1},
        {.type = SCENE_LIGHT_POINT,
         .position = {0, 1, 0},
         .color = {1, 1, 1},
         .intensity = 1,
         .range = 0.5f},
    };
    struct view view =
        nave_view(1u << VIEW_OUTPUT_LIGHTS | 1u << VIEW_OUTPUT_DEPTH | 1u << VIEW_OUTPUT_POSITION);
    view.lights = lights;
    view.light_count = 3;
    view.ignore_scene_lights = true;
    for (int form = VIEW_LIGHT_LISTS_CLUSTERED; form <= VIEW_LIGHT_LISTS_LINKED; form++) {
        struct frame frame;
        int with_point = 0;
        view.quality.light_lists = form;
        shoot(demo->renderer, &demo->rig, &view, &frame);
        const uint32_t *counts = frame.outputs[VIEW_OUTPUT_LIGHTS].pixels;
        const float *depths = frame.outputs[VIEW_OUTPUT_DEPTH].pixels;
        for (int i = 0; i < PIXELS; i++) {
            const float *p =
                image_pixel_f32(&frame.outputs[VIEW_OUTPUT_POSITION], i % WIDTH, i / WIDTH);
            float y = p[1] - 1, square = p[0] * p[0] + y * y + p[2] * p[2];
            if (!isfinite(depths[i])) {
                assert_int_equal(counts[i], 0);
                continue;
            }
            assert_int_in_range(counts[i], 2, 3);
            if (square < 0.25f)
                assert_int_equal(counts[i], 3); /* no light is missed */
            with_point += counts[i] == 3;
        }
        assert_true(with_point < PIXELS / 2);
        frame_finish(&frame);
    }
}

static void hide_what_is_opaque(struct demo *demo)
{
    const struct scene *scene = &demo->rig.imported.scene;
    for (uint32_t i = 0; i < scene->node_count; i++) {
        if (scene->nodes[i].mesh < 0)
            continue;
        const struct scene_mesh *mesh = &scene->meshes[scene->nodes[i].mesh];
        bool is_opaque = false;
        for (uint32_t p = 0; p < mesh->primitive_count; p++) {
            uint32_t material = scene->primitives[mesh->first_primitive + p].material;
            is_opaque |= scene->materials[material].alpha_mode != SCENE_BLEND &&
                         scene->materials[material].transmission == 0;
        }
        if (!is_opaque)
            continue;
        assert_true(demo->hidden_count < NODES_MAX);
        char *name = demo->names[demo->hidden_count];
        snprintf(name, sizeof demo->names[0], "#%u", i);
        demo->hidden[demo->hidden_count++] =
            (struct view_node_override){.node = name, .has_visible = true};
    }
    assert_true(demo->hidden_count > 0);
}

static int setup(void **state)
{
    struct demo *demo = calloc(1, sizeof *demo);
    assert_non_null(demo);
    demo->renderer = render_rig_create();
    rig_demo_open(&demo->rig, demo->renderer, "outputs", 64);
    hide_what_is_opaque(demo);
    *state = demo;
    return 0;
}

static int teardown(void **state)
{
    struct demo *demo = *state;
    rig_scene_finish(&demo->rig, demo->renderer);
    renderer_destroy(demo->renderer);
    free(demo);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_position_is_where_its_pixel_looks),
        cmocka_unit_test(the_transmittance_is_the_share_of_the_background),
        cmocka_unit_test(layers_count_what_a_ray_meets),
        cmocka_unit_test(lights_count_the_list_of_either_form),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
