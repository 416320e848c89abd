/* SPDX-License-Identifier: MIT */
/* Four samples of the rasteriser: where light differs within a surface, its samples are shaded
 * apart, so that edges of shadows and highlights are antialiased, and nothing else is. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/shapes.h"
#include "tests/support/image_checks.h"

enum { WIDTH = 96, HEIGHT = 72, TEXTURE = 64 };

struct floor_desc {
    enum shadow_technique shadows; /* not auto */
    bool is_textured, has_caster;
    bool is_mirrored; /* the lamp, to the other side: its highlight is in view */
    double roughness; /* 0: matt */
};

static int add_material(struct glb_builder *builder, const struct floor_desc *desc)
{
    struct glb_material_desc material = {.base_color = {0.7, 0.65, 0.6, 1},
                                         .roughness = desc->roughness > 0 ? desc->roughness : 1};
    uint8_t pixels[TEXTURE][TEXTURE][4];
    for (int y = 0; y < TEXTURE; y++)
        for (int x = 0; x < TEXTURE; x++)
            for (int k = 0; k < 4; k++)
                pixels[y][x][k] = k == 3 || (x / 8 + y / 8) % 2 ? 255 : 90;
    if (desc->is_textured) {
        int image = glb_builder_add_image(builder, "Checks", &pixels[0][0][0], TEXTURE, TEXTURE);
        material.base_color_texture.texture =
            glb_builder_add_texture(builder, &(struct glb_texture_desc){.image = image});
    }
    return glb_builder_add_material(builder, &material);
}

/* A floor under a spot and, above the eye, a plate whose edge crosses the light. */
static void open_floor(struct rig_scene *rig, struct renderer *renderer,
                       const struct floor_desc *desc)
{
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Floor", &err);
    struct shape shape = {0};
    int material = add_material(builder, desc);
    shape_add_grid(&shape, (double[]){-9, 0, 9}, (double[]){18, 0, 0}, (double[]){0, 0, -18}, 20,
                   20);
    glb_builder_add_node(builder, &(struct glb_node_desc){
                                      .mesh = shape_give_mesh(&shape, builder, "Floor", material)});
    if (desc->has_caster) {
        shape_add_box(&shape, (double[]){1.67, 5, -4}, (double[]){6, 5.05, 5});
        int plate = shape_give_mesh(&shape, builder, "Plate", material);
        glb_builder_add_node(builder, &(struct glb_node_desc){.mesh = plate});
    }
    struct glb_node_desc lamp = {
        .light = glb_builder_add_light(builder, &(struct glb_light_desc){.type = GLB_LIGHT_SPOT,
                                                                         .intensity = 90,
                                                                         .outer_cone_deg = 20})};
    double side = desc->is_mirrored ? -1 : 1;
    glb_node_look_at(&lamp, (double[]){3 * side, 9, 2 * side}, (double[]){0, 0, 0});
    glb_builder_add_node(builder, &lamp);
    size_t size_bytes;
    void *glb;
    if (!glb_builder_finish(builder, &glb, &size_bytes, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    rig_scene_open(rig, renderer, "floor", glb, size_bytes);
    free(glb);
}

static struct view floor_view(void)
{
    return (struct view){.width_px = WIDTH,
                         .height_px = HEIGHT,
                         .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                    .eye = {1.5, 3, 1},
                                    .target = {0, 0, 0},
                                    .fov_y_deg = 40},
                         .quality = {.shadows = SHADOWS_DEEP, .shadow_resolution = 2048}};
}

/* Of what a screen shows: cut at 1, so that no highlight outweighs a picture. */
static double rmse(const struct image *image, const struct image *reference)
{
    double sum = 0;
    int count = image->width_px * image->height_px;
    for (int i = 0; i < count; i++) {
        const float *a = image_pixel_f32(image, i % image->width_px, i / image->width_px);
        const float *b = image_pixel_f32(reference, i % image->width_px, i / image->width_px);
        for (int k = 0; k < 3; k++) {
            double off = fmin((double)a[k], 1) - fmin((double)b[k], 1);
            sum += off * off;
        }
    }
    return sqrt(sum / (3.0 * count));
}

struct measure {
    double error;
    uint64_t split;
};

static struct measure measure(struct renderer *renderer, const struct rig_scene *rig,
                              struct view view, int samples, const struct image *reference)
{
    struct frame frame;
    view.quality.samples = samples;
    shoot(renderer, rig, &view, &frame);
    struct measure m = {rmse(&frame.outputs[VIEW_OUTPUT_COLOR], reference),
                        frame.report.counts.split_pixels};
    frame_finish(&frame);
    return m;
}

/* With 1 and 4 samples against 256. */
static void measure_both(struct renderer *renderer, const struct rig_scene *rig,
                         const struct view *view, const char *what, struct measure m[2])
{
    struct view exact = *view;
    exact.quality = (struct view_quality){.reference = true, .samples = 256};
    struct image reference = shoot_color(renderer, rig, &exact);
    for (int i = 0; i < 2; i++)
        m[i] = measure(renderer, rig, *view, i ? 4 : 1, &reference);
    image_finish(&reference);
    print_message("%s: RMSE %.5f with 1 sample, %.5f with 4, %llu pixels split\n", what, m[0].error,
                  m[1].error, (unsigned long long)m[1].split);
    assert_int_equal(m[0].split, 0);
}

static void measure_floor(struct renderer *renderer, const struct floor_desc *desc,
                          const char *what, struct measure m[2])
{
    struct rig_scene rig;
    struct view view = floor_view();
    view.quality.shadows = desc->shadows;
    if (desc->shadows == SHADOWS_RAYTRACED_SHADOWS)
        view.quality.shadow_resolution = 0;
    open_floor(&rig, renderer, desc);
    measure_both(renderer, &rig, &view, what, m);
    rig_scene_finish(&rig, renderer);
}

static void an_edge_of_a_shadow_is_antialiased(void **state)
{
    static const struct {
        enum shadow_technique shadows;
        const char *name;
    } techniques[] = {{SHADOWS_MAP, "map"},
                      {SHADOWS_DEEP, "deep"},
                      {SHADOWS_DEEP_LINKED, "deep-linked"},
                      {SHADOWS_RAYTRACED_SHADOWS, "raytraced-shadows"}};
    for (size_t i = 0; i < sizeof techniques / sizeof *techniques; i++) {
        struct measure m[2];
        measure_floor(*state,
                      &(struct floor_desc){.shadows = techniques[i].shadows, .has_caster = true},
                      techniques[i].name, m);
        assert_true(m[1].error < 0.6 * m[0].error);
        assert_in_range(m[1].split, 1, WIDTH * HEIGHT / 10);
    }
}

/* Colours of textures are no contrast: pixels are those of the same shadow without one. */
static void a_shadow_on_a_texture_is_antialiased_and_the_texture_costs_nothing(void **state)
{
    struct measure plain[2], textured[2];
    measure_floor(*state, &(struct floor_desc){.shadows = SHADOWS_DEEP, .has_caster = true},
                  "shadow", plain);
    measure_floor(
        *state,
        &(struct floor_desc){.shadows = SHADOWS_DEEP, .has_caster = true, .is_textured = true},
        "shadow on a texture", textured);
    assert_true(textured[1].error < 0.8 * textured[0].error);
    assert_in_range(textured[1].split, plain[1].split * 9 / 10, plain[1].split * 11 / 10);
}

static void even_light_splits_no_pixel(void **state)
{
    for (int is_textured = 0; is_textured < 2; is_textured++) {
        struct measure m[2];
        measure_floor(*state,
                      &(struct floor_desc){.shadows = SHADOWS_DEEP, .is_textured = is_textured},
                      is_textured ? "texture" : "plain", m);
        assert_int_equal(m[1].split, 0);
    }
}

static void a_highlight_is_antialiased(void **state)
{
    struct measure m[2];
    measure_floor(
        *state,
        &(struct floor_desc){.shadows = SHADOWS_DEEP, .is_mirrored = true, .roughness = 0.1},
        "highlight", m);
    assert_true(m[1].error < 0.8 * m[0].error);
    assert_in_range(m[1].split, 1, WIDTH * HEIGHT / 4);
}

static void a_scene_of_all_kinds_is_antialiased(void **state)
{
    struct rig_scene rig;
    struct measure m[2];
    struct view view = floor_view();
    memcpy(view.camera.eye, (double[]){3, 4.5, 3}, sizeof view.camera.eye);
    memcpy(view.camera.target, (double[]){0, 1.5, 0}, sizeof view.camera.target);
    view.quality.shadow_resolution = 0;
    rig_demo_open_fine(&rig, *state, "demo", 64);
    measure_both(*state, &rig, &view, "demo", m);
    assert_true(m[1].split > 0 && m[1].error < 0.6 * m[0].error);
    rig_scene_finish(&rig, *state);
}

static uint64_t shoot_split(struct renderer *renderer, const struct rig_scene *rig,
                            const struct view *view, uint64_t *split)
{
    struct frame frame;
    shoot(renderer, rig, view, &frame);
    uint64_t hash = image_hash(&frame.outputs[VIEW_OUTPUT_COLOR]);
    *split = frame.report.counts.split_pixels;
    frame_finish(&frame);
    return hash;
}

/* Lists are not emptied between frames, but for their counts. */
static void pixels_of_an_earlier_frame_are_not_split_again(void **state)
{
    struct rig_scene rig;
    uint64_t hashes[2], few[2], many;
    struct view far_view = floor_view(), near_view = far_view;
    far_view.quality.samples = near_view.quality.samples = 4;
    far_view.quality.shadows = near_view.quality.shadows = SHADOWS_MAP;
    for (int k = 0; k < 3; k++)
        far_view.camera.eye[k] *= 2;
    open_floor(&rig, *state, &(struct floor_desc){.shadows = SHADOWS_MAP, .has_caster = true});
    hashes[0] = shoot_split(*state, &rig, &far_view, &few[0]);
    (void)shoot_split(*state, &rig, &near_view, &many);
    hashes[1] = shoot_split(*state, &rig, &far_view, &few[1]);
    print_message("%d pixels, then %d\n", (int)many, (int)few[1]);
    assert_true(few[0] % 64 > 0 && many > few[0] + 63 - (few[0] + 63) % 64); /* in its last group */
    assert_true(few[0] == few[1] && hashes[0] == hashes[1]);
    rig_scene_finish(&rig, *state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_edge_of_a_shadow_is_antialiased),
        cmocka_unit_test(a_shadow_on_a_texture_is_antialiased_and_the_texture_costs_nothing),
        cmocka_unit_test(even_light_splits_no_pixel),
        cmocka_unit_test(a_highlight_is_antialiased),
        cmocka_unit_test(a_scene_of_all_kinds_is_antialiased),
        cmocka_unit_test(pixels_of_an_earlier_frame_are_not_split_again),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
