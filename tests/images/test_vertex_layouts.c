/* SPDX-License-Identifier: MIT */
/* Meshes that bring different attributes lie in one scene as they lie alone: with other types, in
 * another order and beside streams that they lack, they give the same bits. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "tests/support/image_checks.h"

/* Panes of 2 m: whole numbers; parts of 256 beside others; more vertices than 16 bits count. */
enum kind { BARE, UV, SECOND_UV, COLORS, UV_AND_COLORS, FINE, KINDS };

static const enum kind all[] = {BARE, UV, SECOND_UV, COLORS, UV_AND_COLORS, FINE};

static int add_material(struct glb_builder *builder, enum kind kind)
{
    const uint8_t rgba[4 * 4] = {255, 40, 0, 255, 30, 220, 0, 128, 0, 60, 250, 255, 90, 90, 90, 60};
    struct glb_material_desc material = {.name = "Material", .is_double_sided = true};
    if (kind == UV_AND_COLORS)
        material.alpha_mode = GLB_BLEND;
    if (kind != BARE && kind != COLORS) {
        int image = glb_builder_add_image(builder, "Squares", rgba, 2, 2);
        material.base_color_texture.texture =
            glb_builder_add_texture(builder, &(struct glb_texture_desc){.image = image});
        material.base_color_texture.texcoord = kind == SECOND_UV;
    }
    return glb_builder_add_material(builder, &material);
}

/* A grid of side x side vertices; texture coordinates are not whole from the third on. */
static int add_pane(struct glb_builder *builder, enum kind kind)
{
    const uint32_t side = kind == FINE ? 257 : 2;
    const size_t count = (size_t)side * side, corners = (size_t)(side - 1) * (side - 1) * 6;
    float *streams[4];
    static const size_t widths[] = {3, 2, 2, 4};
    for (int s = 0; s < 4; s++) {
        streams[s] = calloc(count, widths[s] * sizeof(float));
        assert_non_null(streams[s]);
    }
    uint32_t *indices = calloc(corners, sizeof *indices), *index = indices;
    assert_non_null(indices);
    for (uint32_t v = 0; v < count; v++) {
        uint32_t x = v % side, y = v / side;
        float u[2] = {(float)x / (float)(side - 1), (float)y / (float)(side - 1)};
        for (int k = 0; k < 2; k++) {
            streams[0][3 * v + (size_t)k] = 2 * u[k] - 1;
            streams[1][2 * v + (size_t)k] = kind == UV_AND_COLORS ? u[k] * 0.7f : u[k] * 2;
            streams[2][2 * v + (size_t)k] = u[1 - k] * 1.3f;
        }
        for (int k = 0; k < 4; k++)
            streams[3][4 * v + (size_t)k] = (float)((v * 83 + (uint32_t)k * 31) % 256) / 255;
        if (x + 1 < side && y + 1 < side)
            for (int k = 0; k < 6; k++)
                *index++ = (uint32_t[]){v, v + 1, v + side, v + side, v + 1, v + side + 1}[k];
    }
    int mesh = glb_builder_add_mesh(
        builder, "Pane",
        &(struct glb_primitive_desc){
            .material = add_material(builder, kind),
            .vertex_count = count,
            .positions = streams[0],
            .texcoords = kind == BARE || kind == COLORS ? NULL : streams[1],
            .texcoords_1 = kind == SECOND_UV ? streams[2] : NULL,
            .colors = kind == COLORS || kind == UV_AND_COLORS ? streams[3] : NULL,
            .indices = indices,
            .index_count = corners},
        1);
    for (int s = 0; s < 4; s++)
        free(streams[s]);
    free(indices);
    return mesh;
}

/* Panes of these kinds, all at one place. */
static void open_panes(struct rig_scene *rig, struct renderer *renderer, const char *key,
                       const enum kind *kinds, int count)
{
    struct error err = {0};
    void *glb = NULL;
    size_t size = 0;
    struct glb_builder *builder = glb_builder_create("panes", &err);
    assert_non_null(builder);
    for (int i = 0; i < count; i++) {
        char name[16];
        snprintf(name, sizeof name, "pane-%d", (int)kinds[i]);
        glb_builder_add_node(
            builder, &(struct glb_node_desc){.name = name, .mesh = add_pane(builder, kinds[i])});
    }
    if (!glb_builder_finish(builder, &glb, &size, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    rig_scene_open(rig, renderer, key, glb, size);
    free(glb);
}

/* Lit from behind too, so that what light passes through is in the picture. */
static struct image picture_of(struct renderer *renderer, const struct rig_scene *rig,
                               enum kind shown, int hidden_count)
{
    static const struct view_light light = {.type = SCENE_LIGHT_POINT,
                                            .position = {0.4, 0.3, 2},
                                            .color = {1, 0.9, 0.8},
                                            .intensity = 40};
    char names[KINDS][16];
    struct view_node_override hidden[KINDS] = {0};
    size_t count = 0;
    for (int k = 0; k < KINDS && hidden_count; k++) {
        snprintf(names[k], sizeof names[k], "pane-%d", k);
        if (k != (int)shown)
            hidden[count++] = (struct view_node_override){.node = names[k], .has_visible = true};
    }
    struct view view = {.width_px = 96,
                        .height_px = 96,
                        .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                   .eye = {0.7, -0.5, 2.6},
                                   .target = {0, 0, 0},
                                   .fov_y_deg = 50},
                        .lights = &light,
                        .light_count = 1,
                        .nodes = hidden,
                        .node_override_count = count,
                        .quality = {.shadows = SHADOWS_DEEP, .shadow_resolution = 64}};
    struct image picture = shoot_color(renderer, rig, &view);
    assert_image_is_sound(&picture, 1e6);
    return picture;
}

static void meshes_look_among_others_as_they_do_alone(void **state)
{
    struct rig_scene together;
    open_panes(&together, *state, "together", all, KINDS);
    for (int k = 0; k < KINDS; k++) {
        struct rig_scene alone;
        open_panes(&alone, *state, "alone", &all[k], 1);
        struct image a = picture_of(*state, &alone, all[k], 0);
        struct image b = picture_of(*state, &together, all[k], KINDS - 1);
        assert_same_bits(&a, &b);
        double mean[3];
        image_mean(&a, (double[]){0.3, 0.3, 0.7, 0.7}, mean);
        assert_true(mean[0] + mean[1] + mean[2] > 0.05); /* it is seen at all */
        image_finish(&a);
        image_finish(&b);
        rig_scene_finish(&alone, *state);
    }
    rig_scene_finish(&together, *state);
}

/* Meshes with and without texture coordinates that nobody samples share a call. */
static void attributes_that_are_not_read_divide_no_call(void **state)
{
    enum { OBJECTS = 6 };
    struct error err = {0};
    struct rig_scene rig;
    void *glb = NULL;
    size_t size = 0;
    static const float corners[] = {0, 0, 0, 0.8f, 0, 0, 0, 0.8f, 0}, uvs[] = {0, 0, 1, 0, 0, 1};
    struct glb_builder *builder = glb_builder_create("row", &err);
    assert_non_null(builder);
    int material = glb_builder_add_material(builder, &(struct glb_material_desc){.name = "Plain"});
    for (int i = 0; i < OBJECTS; i++) {
        int mesh =
            glb_builder_add_mesh(builder, "Triangle",
                                 &(struct glb_primitive_desc){.material = material,
                                                              .vertex_count = 3,
                                                              .positions = corners,
                                                              .texcoords = i % 2 ? uvs : NULL},
                                 1);
        glb_builder_add_node(builder, &(struct glb_node_desc){
                                          .mesh = mesh, .translation = {i - OBJECTS / 2.0, 0, 0}});
    }
    if (!glb_builder_finish(builder, &glb, &size, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    rig_scene_open(&rig, *state, "row", glb, size);
    free(glb);
    struct view view = {.width_px = 64,
                        .height_px = 64,
                        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 0, 9}, .fov_y_deg = 45}};
    struct frame frame;
    shoot(*state, &rig, &view, &frame);
    assert_int_equal(frame.report.counts.draws, OBJECTS);
    assert_int_equal(frame.report.counts.draw_calls, 1);
    frame_finish(&frame);
    rig_scene_finish(&rig, *state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(meshes_look_among_others_as_they_do_alone),
        cmocka_unit_test(attributes_that_are_not_read_divide_no_call),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
