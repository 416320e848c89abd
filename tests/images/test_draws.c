/* SPDX-License-Identifier: MIT */
/* Objects that share a draw call, or are left out of one, change no pixel: each is in its own place
 * with its own material, and what is culled is what nobody sees. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/shapes.h"
#include "tests/support/image_checks.h"

enum { SIDE = 8, OBJECTS = SIDE * SIDE, KINDS = 5 };

/* Objects of a kind share mesh and material; kinds differ in program, textures or culling. */
struct kind {
    int mesh;
    bool is_mirrored;
};

static int add_texture(struct glb_builder *builder, uint8_t green)
{
    const uint8_t rgba[4] = {255, green, 0, 255};
    int image = glb_builder_add_image(builder, "Dot", rgba, 1, 1);
    return glb_builder_add_texture(builder,
                                   &(struct glb_texture_desc){.name = "Dot", .image = image});
}

static void add_kinds(struct glb_builder *builder, int kind_count, struct kind kinds[KINDS])
{
    for (int i = 0; i < kind_count; i++) {
        struct shape shape = {0};
        struct glb_material_desc material = {.name = "Material", .is_unlit = i == 4};
        for (int c = 0; c < 4; c++)
            material.base_color[c] = c == 3 ? 1 : 0.2 + 0.1 * i + 0.15 * c;
        if (i == 1 || i == 2)
            material.base_color_texture.texture = add_texture(builder, (uint8_t)(60 * i));
        material.is_double_sided = i == 3;
        if (i % 2)
            shape_add_sphere(&shape, (double[]){0, 0, 0}, 0.3, 8, 6);
        else
            shape_add_box(&shape, (double[]){-0.3, -0.3, -0.3}, (double[]){0.3, 0.3, 0.3});
        kinds[i].mesh =
            shape_give_mesh(&shape, builder, "Part", glb_builder_add_material(builder, &material));
        kinds[i].is_mirrored = i == 0;
    }
}

static void object_place(int object, double place[3])
{
    place[0] = object % SIDE - 0.5 * (SIDE - 1);
    place[1] = object / SIDE - 0.5 * (SIDE - 1);
    place[2] = 0.1 * (object * 5 % 7);
}

/* A wall of objects in the plane z = 0, their kinds mixed. */
static void open_wall(struct rig_scene *rig, struct renderer *renderer, int kind_count)
{
    struct error err = {0};
    struct kind kinds[KINDS];
    void *glb = NULL;
    size_t size = 0;
    struct glb_builder *builder = glb_builder_create("wall", &err);
    assert_non_null(builder);
    add_kinds(builder, kind_count, kinds);
    for (int i = 0; i < OBJECTS; i++) {
        char name[16];
        const struct kind *kind = &kinds[i * 7 / 3 % kind_count];
        snprintf(name, sizeof name, "object-%d", i);
        struct glb_node_desc node = {
            .name = name, .mesh = kind->mesh, .scale = {kind->is_mirrored && i % 2 ? -1 : 1, 1, 1}};
        object_place(i, node.translation);
        glb_builder_add_node(builder, &node);
    }
    assert_true(glb_builder_finish(builder, &glb, &size, &err));
    glb_builder_destroy(builder);
    rig_scene_open(rig, renderer, kind_count == 1 ? "wall-1" : "wall", glb, size);
    free(glb);
}

static struct view wall_view(double distance)
{
    return (struct view){.width_px = 160,
                         .height_px = 160,
                         .outputs = 1u << VIEW_OUTPUT_COLOR | 1u << VIEW_OUTPUT_NODE |
                                    1u << VIEW_OUTPUT_MATERIAL,
                         .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                    .eye = {0, 0, distance},
                                    .target = {0, 0, 0},
                                    .fov_y_deg = 45},
                         .quality = {.shadow_resolution = 64}};
}

static void check_places(struct renderer *renderer, const struct rig_scene *rig, int kind_count,
                         struct frame_report *report)
{
    struct view view = wall_view(12);
    struct frame frame;
    shoot(renderer, rig, &view, &frame);
    for (int i = 0; i < OBJECTS; i++) {
        char name[16];
        double place[3];
        snprintf(name, sizeof name, "object-%d", i);
        object_place(i, place);
        const struct image *nodes = &frame.outputs[VIEW_OUTPUT_NODE];
        assert_int_equal(image_id_at(nodes, &view, place), scene_node_id(rig, name));
        assert_int_equal(image_id_at(&frame.outputs[VIEW_OUTPUT_MATERIAL], &view, place),
                         i * 7 / 3 % kind_count + 1);
    }
    *report = frame.report;
    frame_finish(&frame);
}

static void each_object_of_a_shared_call_is_in_its_place(void **state)
{
    struct rig_scene rig;
    struct frame_report report;
    open_wall(&rig, *state, KINDS);
    check_places(*state, &rig, KINDS, &report);
    assert_int_equal(report.counts.draws, OBJECTS);
    assert_int_in_range(report.counts.draw_calls, 2, OBJECTS - 1);
    assert_int_equal(report.counts.culled, 0);
    rig_scene_finish(&rig, *state);
}

/* An image so large that it is rendered in two windows, each of which draws its own half. */
static void windows_draw_what_they_see(void **state)
{
    struct rig_scene rig;
    struct view view = wall_view(12);
    struct frame frame;
    open_wall(&rig, *state, KINDS);
    view.outputs = 1u << VIEW_OUTPUT_NODE;
    view.width_px = 2200;
    view.height_px = 1000;
    shoot(*state, &rig, &view, &frame);
    for (int i = 0; i < OBJECTS; i++) {
        char name[16];
        double place[3];
        snprintf(name, sizeof name, "object-%d", i);
        object_place(i, place);
        assert_int_equal(image_id_at(&frame.outputs[VIEW_OUTPUT_NODE], &view, place),
                         scene_node_id(&rig, name));
    }
    assert_int_equal(frame.report.warning_count > 0, 1); /* of the windows */
    assert_int_in_range(frame.report.counts.draws, OBJECTS, OBJECTS * 3 / 2);
    frame_finish(&frame);
    rig_scene_finish(&rig, *state);
}

static void equal_objects_are_one_call(void **state)
{
    struct rig_scene rig;
    struct frame_report report;
    struct view_node_override straight[OBJECTS];
    static char names[OBJECTS][16];
    open_wall(&rig, *state, 1);
    check_places(*state, &rig, 1, &report);
    assert_int_in_range(report.counts.draw_calls, 2, OBJECTS); /* every other one is mirrored */
    for (int i = 0; i < OBJECTS; i++) {
        double *m = straight[i].matrix;
        straight[i] = (struct view_node_override){.node = names[i], .has_matrix = true};
        snprintf(names[i], sizeof names[i], "object-%d", i);
        m[0] = m[5] = m[10] = m[15] = 1;
        object_place(i, m + 12);
    }
    struct view view = wall_view(12);
    struct frame frame;
    view.nodes = straight;
    view.node_override_count = OBJECTS;
    shoot(*state, &rig, &view, &frame);
    assert_int_equal(frame.report.counts.draws, OBJECTS);
    assert_int_equal(frame.report.counts.draw_calls, 1);
    frame_finish(&frame);
    rig_scene_finish(&rig, *state);
}

/* Hides what the node output does not show, and finds the same pixels. The outermost objects stay:
 * the near plane depends on the size of the scene. */
static void what_is_culled_is_what_nobody_sees(void **state)
{
    struct rig_scene rig;
    struct view view = wall_view(4);
    struct frame all, seen;
    struct view_node_override hidden[OBJECTS] = {0};
    static char names[OBJECTS][16];
    open_wall(&rig, *state, KINDS);
    view.quality.shadows = SHADOWS_NONE;
    shoot(*state, &rig, &view, &all);
    assert_int_in_range(all.report.counts.culled, OBJECTS / 2, OBJECTS - 1);
    assert_int_equal(all.report.counts.culled + all.report.counts.draws, OBJECTS);
    view.nodes = hidden;
    for (int i = 0; i < OBJECTS; i++) {
        snprintf(names[i], sizeof names[i], "object-%d", i);
        bool is_outermost = i % SIDE % (SIDE - 1) == 0 || i / SIDE % (SIDE - 1) == 0;
        if (is_outermost ||
            image_count_id(&all.outputs[VIEW_OUTPUT_NODE], scene_node_id(&rig, names[i])))
            continue;
        hidden[view.node_override_count++] =
            (struct view_node_override){.node = names[i], .has_visible = true};
    }
    assert_int_in_range(view.node_override_count, SIDE, OBJECTS);
    shoot(*state, &rig, &view, &seen);
    assert_same_bits(&all.outputs[VIEW_OUTPUT_COLOR], &seen.outputs[VIEW_OUTPUT_COLOR]);
    assert_same_bits(&all.outputs[VIEW_OUTPUT_NODE], &seen.outputs[VIEW_OUTPUT_NODE]);
    frame_finish(&all);
    frame_finish(&seen);
    rig_scene_finish(&rig, *state);
}

/* A lamp of short range before one corner: the casters beyond it change no shadow. */
static void casters_that_a_face_does_not_see_are_not_drawn(void **state)
{
    struct rig_scene rig;
    struct view view = wall_view(12);
    struct view_light lamp = {.type = SCENE_LIGHT_POINT,
                              .position = {-3, -3, 1.5},
                              .color = {1, 1, 1},
                              .intensity = 20,
                              .range = 2.5f};
    struct view_node_override far = {.node = "object-63", .has_visible = true};
    struct frame all, near;
    open_wall(&rig, *state, KINDS);
    view.lights = &lamp;
    view.light_count = 1;
    shoot(*state, &rig, &view, &all);
    assert_int_equal(all.report.counts.shadow_maps_built, 1);
    assert_int_in_range(all.report.counts.shadow_draws, 4, OBJECTS);
    assert_int_equal(all.report.counts.shadow_draws + all.report.counts.shadow_culled, 6 * OBJECTS);
    view.nodes = &far;
    view.node_override_count = 1;
    shoot(*state, &rig, &view, &near);
    assert_int_equal(near.report.counts.shadow_maps_built, 0); /* it did not reach the light */
    frame_finish(&all);
    frame_finish(&near);
    rig_scene_finish(&rig, *state);
}

/* Two lamps of short range before opposite corners, and an object before one of them moves. */
static void a_moved_object_rebuilds_the_lights_that_it_reaches_only(void **state)
{
    struct rig_scene rig;
    struct view view = wall_view(12);
    struct view_light lamps[2] = {{.type = SCENE_LIGHT_POINT,
                                   .position = {-3, -3, 1.5},
                                   .color = {1, 1, 1},
                                   .intensity = 20,
                                   .range = 2.5f}};
    struct view_node_override moved = {.node = "object-9", .has_matrix = true};
    struct frame frame;
    lamps[1] = lamps[0];
    lamps[1].position[0] = lamps[1].position[1] = 3;
    moved.matrix[0] = moved.matrix[5] = moved.matrix[10] = moved.matrix[15] = 1;
    object_place(9, moved.matrix + 12);
    moved.matrix[12] += 0.1;
    open_wall(&rig, *state, KINDS);
    view.lights = lamps;
    view.light_count = 2;
    shoot(*state, &rig, &view, &frame);
    assert_int_equal(frame.report.counts.shadow_maps_built, 2);
    frame_finish(&frame);
    view.nodes = &moved;
    view.node_override_count = 1;
    shoot(*state, &rig, &view, &frame);
    assert_int_equal(frame.report.counts.shadow_maps_built, 1);
    assert_int_equal(frame.report.counts.shadow_maps_reused, 1);
    frame_finish(&frame);
    rig_scene_finish(&rig, *state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_object_of_a_shared_call_is_in_its_place),
        cmocka_unit_test(windows_draw_what_they_see),
        cmocka_unit_test(equal_objects_are_one_call),
        cmocka_unit_test(what_is_culled_is_what_nobody_sees),
        cmocka_unit_test(casters_that_a_face_does_not_see_are_not_drawn),
        cmocka_unit_test(a_moved_object_rebuilds_the_lights_that_it_reaches_only),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
