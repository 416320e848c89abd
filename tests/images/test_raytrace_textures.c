/* SPDX-License-Identifier: MIT */
/* Textures of ray-traced pictures: the levels of detail are those of the rasteriser, and with more
 * samples the picture nears the reference, which reads the finest level alone. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "tests/support/image_checks.h"

enum { TEXTURE = 512 };

/* Squares of 16 px with noise of 1 px: every level looks different. */
static int add_texture(struct glb_builder *b, enum glb_filter filter)
{
    uint8_t *pixels = malloc(4ull * TEXTURE * TEXTURE);
    uint32_t seed = 1;
    assert_non_null(pixels);
    for (int i = 0; i < TEXTURE * TEXTURE; i++) {
        int x = i % TEXTURE, y = i / TEXTURE;
        uint8_t *p = pixels + (ptrdiff_t)4 * i;
        seed = seed * 1664525 + 1013904223;
        p[0] = (uint8_t)(((x / 16 + y / 16) & 1 ? 200 : 30) + (seed >> 27));
        p[1] = (uint8_t)(seed >> 24);
        p[2] = (uint8_t)(x / 2);
        p[3] = 255;
    }
    int image = glb_builder_add_image(b, "floor", pixels, TEXTURE, TEXTURE);
    free(pixels);
    return glb_builder_add_texture(b, &(struct glb_texture_desc){.image = image, .filter = filter});
}

/* A floor of 40 m x 80 m, its texture 2 m a side, and 4 m above it a pane of dim glass. */
static void open_floor(struct rig_scene *rig, struct renderer *renderer, enum glb_filter filter,
                       bool has_pane)
{
    static const float positions[] = {-20, 0, 20, 20, 0, 20, 20, 0, -60, -20, 0, -60};
    static const float normals[] = {0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0};
    static const float texcoords[] = {0, 40, 20, 40, 20, 0, 0, 0};
    static const uint32_t indices[] = {0, 1, 2, 0, 2, 3};
    struct error err = {0};
    struct glb_builder *b = glb_builder_create("floor", &err);
    assert_non_null(b);
    for (int i = 0; i < 1 + has_pane; i++) {
        int texture = add_texture(b, filter);
        int material = glb_builder_add_material(
            b, &(struct glb_material_desc){.roughness = 1,
                                           .base_color = {1, 1, 1, i ? 0.5 : 1},
                                           .alpha_mode = i ? GLB_BLEND : GLB_OPAQUE,
                                           .is_double_sided = true,
                                           .base_color_texture = {.texture = texture}});
        struct glb_primitive_desc primitive = {.material = material,
                                               .vertex_count = 4,
                                               .positions = positions,
                                               .normals = normals,
                                               .texcoords = texcoords,
                                               .indices = indices,
                                               .index_count = 6};
        int mesh = glb_builder_add_mesh(b, "floor", &primitive, 1);
        glb_builder_add_node(b,
                             &(struct glb_node_desc){.mesh = mesh, .translation = {0, 0.8 * i, 0}});
    }
    void *glb;
    size_t size;
    if (!glb_builder_finish(b, &glb, &size, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(b);
    rig_scene_open(rig, renderer, "floor", glb, size);
    free(glb);
}

static const struct view_light sun = {.type = SCENE_LIGHT_DIRECTIONAL,
                                      .direction = {-0.3, -1, -0.2},
                                      .color = {1, 1, 1},
                                      .intensity = 3,
                                      .casts_no_shadow = true};

/* Grazing, straight along the texture's axes or turned to them, or from above. */
static struct view look(int place)
{
    static const double places[][6] = {
        {0.3, 1.5, 5, 0.3, 0.6, 0}, {0.3, 1.5, 5, 4, 0.6, 0}, {1, 30, 0, 3, 0, -6}};
    const double *p = places[place];
    return (struct view){.width_px = 192,
                         .height_px = 144,
                         .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                    .eye = {p[0], p[1], p[2]},
                                    .target = {p[3], p[4], p[5]}},
                         .lights = &sun,
                         .light_count = 1};
}

/* Mean of |d| over the reference's mean. */
static double compare_with_raster(struct renderer *renderer, const struct rig_scene *rig,
                                  struct view *view, const char *name)
{
    view->quality.shadows = SHADOWS_NONE;
    struct image raster = shoot_color(renderer, rig, view);
    view->quality.shadows = SHADOWS_RAYTRACED;
    struct image traced = shoot_color(renderer, rig, view);
    double error = mean_error(&traced, &raster);
    printf("%s, %d samples: MAE / mean %.4f\n", name, view->quality.samples, error);
    save_picture(&traced, name);
    image_finish(&raster);
    image_finish(&traced);
    return error;
}

/* What is left is the rasteriser's own: llvmpipe takes the longer of the footprint's extents along
 * u and v, which OpenGL allows, and blends levels in steps. At the finest level it would be 0.4. */
static void levels_are_those_of_the_rasteriser(void **state)
{
    static const char *const names[] = {"floor_along", "floor_turned", "floor_above"};
    for (int has_pane = 0; has_pane < 2; has_pane++) {
        struct rig_scene rig;
        open_floor(&rig, *state, GLB_FILTER_TRILINEAR, has_pane);
        for (int place = 0; place < 3; place++)
            for (int samples = 1; samples <= 4; samples += 3) {
                struct view view = look(place);
                view.quality.samples = samples;
                assert_true(compare_with_raster(*state, &rig, &view, names[place]) < 0.01);
            }
        struct view flat = look(2);
        flat.quality.samples = 1;
        flat.camera.ortho_height = 20;
        assert_true(compare_with_raster(*state, &rig, &flat, "floor_parallel") < 0.01);
        rig_scene_finish(&rig, *state);
    }
}

/* Each step up has a footprint of half the side, and four times the samples. */
static void more_samples_near_the_reference(void **state)
{
    struct rig_scene rig;
    struct view view = look(1);
    double errors[4];
    view.width_px = 96;
    view.height_px = 72;
    open_floor(&rig, *state, GLB_FILTER_TRILINEAR, false);
    view.quality = (struct view_quality){.reference = true, .samples = 256};
    struct image reference = shoot_color(*state, &rig, &view);
    for (int i = 0; i < 4; i++) {
        view.quality = (struct view_quality){.shadows = SHADOWS_RAYTRACED, .samples = 4 << 2 * i};
        struct image traced = shoot_color(*state, &rig, &view);
        errors[i] = mean_error(&traced, &reference);
        printf("%d samples: MAE / mean %.4f\n", view.quality.samples, errors[i]);
        assert_true(i == 0 || errors[i] < 0.7 * errors[i - 1]);
        image_finish(&traced);
    }
    assert_true(errors[3] < 0.025);
    image_finish(&reference);
    rig_scene_finish(&rig, *state);
}

/* The mean of the samples' texels instead. */
static void samplers_without_levels_are_averaged(void **state)
{
    struct rig_scene rig;
    struct view view = look(0);
    open_floor(&rig, *state, GLB_FILTER_LINEAR, false);
    view.width_px = 96;
    view.height_px = 72;
    view.quality = (struct view_quality){.reference = true, .samples = 64};
    struct image reference = shoot_color(*state, &rig, &view);
    view.quality = (struct view_quality){.shadows = SHADOWS_RAYTRACED, .samples = 1};
    struct image one = shoot_color(*state, &rig, &view);
    view.quality.samples = 4;
    struct image four = shoot_color(*state, &rig, &view);
    double errors[2] = {mean_error(&one, &reference), mean_error(&four, &reference)};
    printf("no levels: MAE / mean %.3f with 1 sample, %.3f with 4\n", errors[0], errors[1]);
    assert_true(errors[1] < 0.6 * errors[0]);
    image_finish(&one);
    image_finish(&four);
    image_finish(&reference);
    rig_scene_finish(&rig, *state);
}

/* With textures of glass, masks and normals, and the same shadows by rays. */
static void a_textured_scene_looks_the_same_traced_and_drawn(void **state)
{
    struct rig_scene rig;
    rig_demo_open(&rig, *state, "demo", 256);
    struct view view = {.width_px = 192, .height_px = 144, .quality = {.samples = 1}};
    view.quality.shadows = SHADOWS_RAYTRACED_SHADOWS;
    struct image drawn = shoot_color(*state, &rig, &view);
    view.quality.shadows = SHADOWS_RAYTRACED;
    struct image traced = shoot_color(*state, &rig, &view);
    double error = mean_error(&traced, &drawn);
    printf("demo: MAE / mean %.4f\n", error);
    assert_true(error < 0.02);
    image_finish(&drawn);
    image_finish(&traced);
    rig_scene_finish(&rig, *state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(levels_are_those_of_the_rasteriser),
        cmocka_unit_test(a_textured_scene_looks_the_same_traced_and_drawn),
        cmocka_unit_test(more_samples_near_the_reference),
        cmocka_unit_test(samplers_without_levels_are_averaged),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
