/* SPDX-License-Identifier: MIT */
/* Antialiasing where the device does not say which samples of a fragment passed the depth test: the
 * shader finds them, and pictures are those of a device that says it. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "tests/support/extreme_checks.h"
#include "tests/support/image_checks.h"

enum { WIDTH_PX = 320, HEIGHT_PX = 180 };

static struct renderer *open_renderer(bool hides_coverage)
{
    return render_rig_create_as(
        &(struct renderer_desc){.is_strict = true, .hooks.hides_coverage = hides_coverage});
}

static struct image take(struct renderer *renderer, const struct rig_scene *scene,
                         const struct view *view)
{
    struct frame frame;
    shoot(renderer, scene, view, &frame);
    assert_false(report_has_warning(&frame.report, "antialias"));
    struct image color = frame.outputs[VIEW_OUTPUT_COLOR];
    frame.outputs[VIEW_OUTPUT_COLOR] = (struct image){0};
    frame_finish(&frame);
    return color;
}

static int count_differing(const struct image *a, const struct image *b)
{
    int count = 0;
    for (int i = 0; i < a->width_px * a->height_px; i++)
        count += memcmp((float *)a->pixels + 4 * i, (float *)b->pixels + 4 * i, 16) != 0;
    return count;
}

static void demo_views_keep_all_but_few_pixels(void **unused)
{
    (void)unused;
    static const double eyes[3][3] = {{3, 2, 4}, {-4, 1.2, 2.5}, {0.5, 3.5, 0.5}};
    struct image found[3], said[3];
    for (int hides = 0; hides < 2; hides++) {
        struct renderer *renderer = open_renderer(hides);
        struct rig_scene demo;
        rig_demo_open(&demo, renderer, "demo", 128);
        for (int i = 0; i < 3; i++) {
            struct view view = {.width_px = WIDTH_PX,
                                .height_px = HEIGHT_PX,
                                .camera.kind = VIEW_CAMERA_LOOK_AT,
                                .quality = {.samples = 4, .shadows = SHADOWS_NONE}};
            memcpy(view.camera.eye, eyes[i], sizeof view.camera.eye);
            (hides ? found : said)[i] = take(renderer, &demo, &view);
        }
        rig_scene_finish(&demo, renderer);
        renderer_destroy(renderer);
    }
    for (int i = 0; i < 3; i++) {
        int differing = count_differing(&found[i], &said[i]);
        double rmse = extreme_rmse(&found[i], &said[i]);
        print_message("view %d: %d pixels differ, RMSE %.2g of the mean\n", i, differing, rmse);
        assert_true(differing < WIDTH_PX * HEIGHT_PX / 1000);
        assert_true(rmse < 1e-3);
        image_finish(&found[i]);
        image_finish(&said[i]);
    }
}

/* Around the origin, sides of 2 m; the first face is at z = 1. */
static int add_box(struct glb_builder *builder, const struct glb_material_desc *material)
{
    static const float corners[24] = {-1, -1, 1,  1, -1, 1,  1, 1, 1,  -1, 1, 1,
                                      -1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1};
    static const uint32_t indices[36] = {0, 1, 2, 0, 2, 3, 5, 4, 7, 5, 7, 6, 4, 0, 3, 4, 3, 7,
                                         1, 5, 6, 1, 6, 2, 3, 2, 6, 3, 6, 7, 4, 5, 1, 4, 1, 0};
    return glb_builder_add_mesh(
        builder, "Box",
        &(struct glb_primitive_desc){.material = glb_builder_add_material(builder, material),
                                     .vertex_count = 8,
                                     .positions = corners,
                                     .indices = indices,
                                     .index_count = 36},
        1);
}

static void add_node(struct glb_builder *builder, int mesh, const double at[3],
                     const double size[3], double turn)
{
    struct glb_node_desc node = {.name = "Box", .mesh = mesh};
    for (int k = 0; k < 3; k++) {
        node.translation[k] = at[k];
        node.scale[k] = size[k];
    }
    node.rotation[0] = 0.6 * sin(turn / 2);
    node.rotation[1] = 0.8 * sin(turn / 2);
    node.rotation[3] = cos(turn / 2);
    glb_builder_add_node(builder, &node);
}

enum { BARS = 12 };

/* Bars and glass through each other at all angles; a bar in glass of its own size; and all of it
 * in a medium, where the eye is, too. */
static void *build_crossings(bool has_media, size_t *size)
{
    struct error err = {0};
    void *glb = NULL;
    struct glb_builder *builder = glb_builder_create("Crossings", &err);
    assert_non_null(builder);
    struct glb_material_desc stone = {.base_color = {0.7, 0.6, 0.5, 1}, .is_unlit = true};
    struct glb_material_desc glass = {.base_color = {0.5, 0.8, 0.7, 1},
                                      .transmission = 1,
                                      .has_ior = true,
                                      .ior = 1,
                                      .is_double_sided = true};
    struct glb_material_desc medium = glass;
    medium.thickness = 1;
    medium.attenuation_distance = 3;
    for (int k = 0; k < 3; k++)
        medium.attenuation_color[k] = 0.3 + 0.2 * k;
    int opaque = add_box(builder, &stone), clear = add_box(builder, &glass);
    int thick = has_media ? add_box(builder, &medium) : clear;
    for (int i = 0; i < BARS; i++) {
        const double at[3] = {0.37 * (i % 4) - 0.6, 0.41 * (i / 4) - 0.4, -0.13 * i};
        const double bar[3] = {0.6, 0.05, 0.3}, pane[3] = {0.5, 0.4, 0.02};
        add_node(builder, opaque, at, bar, 0.7 * i);
        add_node(builder, i % 3 ? clear : thick, at, i % 2 ? pane : bar, i % 2 ? 1.1 * i : 0.7 * i);
    }
    if (has_media)
        add_node(builder, thick, (const double[3]){0, 0, 0}, (const double[3]){4, 3.5, 5}, 0.2);
    assert_true(glb_builder_finish(builder, &glb, size, &err));
    glb_builder_destroy(builder);
    return glb;
}

/* What differs are samples of surfaces on a surface, and of media's, which have no light there. */
static void surfaces_through_each_other_keep_all_but_few_pixels(void **unused)
{
    (void)unused;
    struct view view = {.width_px = WIDTH_PX,
                        .height_px = HEIGHT_PX,
                        .background = {0.9f, 0.8f, 1, 1},
                        .ignore_scene_lights = true,
                        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0.8, 0.6, 2.5}},
                        .quality.samples = 4};
    for (int has_media = 0; has_media < 2; has_media++) {
        struct image images[2];
        size_t size;
        void *glb = build_crossings(has_media, &size);
        for (int hides = 0; hides < 2; hides++) {
            struct renderer *renderer = open_renderer(hides);
            struct rig_scene scene;
            rig_scene_open(&scene, renderer, "crossings", glb, size);
            images[hides] = take(renderer, &scene, &view);
            rig_scene_finish(&scene, renderer);
            renderer_destroy(renderer);
        }
        int differing = count_differing(&images[1], &images[0]);
        double rmse = extreme_rmse(&images[1], &images[0]);
        print_message("media %d: %d pixels differ, RMSE %.2g of the mean\n", has_media, differing,
                      rmse);
        save_picture(&images[0], has_media ? "crossings-media" : "crossings");
        save_picture(&images[1], has_media ? "crossings-media-found" : "crossings-found");
        assert_true(differing < WIDTH_PX * HEIGHT_PX / 1000);
        assert_true(rmse < 1e-3);
        for (int i = 0; i < 2; i++)
            image_finish(&images[i]);
        free(glb);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(demo_views_keep_all_but_few_pixels),
        cmocka_unit_test(surfaces_through_each_other_keep_all_but_few_pixels),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
