/* SPDX-License-Identifier: MIT */
/* Sorted objects: exact where objects do not overlap in depth, whatever their number, their order
 * in the file and the samples; and its known limits: of panes that go through one another one lies
 * wholly over the other, and an object that covers itself has the order of its indices. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "tests/support/image_checks.h"
#include "tests/support/pane_stack.h"

enum { SIDE_PX = 16, MANY_PANES = 40 };

static const struct pane crossing[2] = {
    {.color = {1, 0.25, 0}, .alpha = 0.6},
    {.color = {0, 0.25, 1}, .alpha = 0.4},
};

static void parallel_panes_are_exact_in_any_order(void **state)
{
    struct pane panes[MANY_PANES], near_to_far[MANY_PANES];
    for (int i = 0; i < MANY_PANES; i++) {
        int place = i * 27 % MANY_PANES;
        panes[i] = (struct pane){.z = 5 - 0.3 * place,
                                 .color = {place % 2, place % 3 / 2.0, place % 5 / 4.0},
                                 .alpha = 0.05 + 0.1 * (place % 4)};
        near_to_far[place] = panes[i];
    }
    for (int samples = 1; samples <= 4; samples += 3) {
        struct frame frame;
        const struct pane_shot shot = {
            .transparency = TRANSPARENCY_SORTED, .side_px = SIDE_PX, .samples = samples};
        pane_stack_render(*state, panes, MANY_PANES, &shot, &frame);
        if (samples == 1) /* else also where two triangles share a pixel */
            assert_int_equal(frame.report.counts.longest_pixel_list, MANY_PANES);
        assert_true(report_has_warning(&frame.report, "transparency sorted blends objects"));
        for (int i = 0; i < SIDE_PX * SIDE_PX; i++)
            for (int c = 0; c < 3; c++) {
                double seen = (double)image_pixel_f32(&frame.outputs[VIEW_OUTPUT_COLOR],
                                                      i % SIDE_PX, i / SIDE_PX)[c];
                assert_true(fabs(seen - pane_stack_exact(near_to_far, MANY_PANES, c)) < 1e-4);
            }
        frame_finish(&frame);
    }
}

/* ---- objects that share depths ---- */

struct quad {
    const float (*corners)[3]; /* four */
    const struct pane *pane;
};

static void add_quads(struct glb_builder *b, const struct quad *quads, int count, double z)
{
    static const float normals[8][3] = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1},
                                        {0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
    static const uint32_t indices[12] = {0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7};
    float positions[8][3], colors[8][4];
    const struct glb_material_desc material = {.name = "pane",
                                               .is_double_sided = true,
                                               .is_unlit = true,
                                               .alpha_mode = GLB_BLEND,
                                               .base_color = {1, 1, 1, 1}};
    for (int i = 0; i < 4 * count; i++) {
        const struct pane *pane = quads[i / 4].pane;
        memcpy(positions[i], quads[i / 4].corners[i % 4], sizeof positions[i]);
        for (int c = 0; c < 4; c++)
            colors[i][c] = (float)(c < 3 ? pane->color[c] : pane->alpha);
    }
    const struct glb_primitive_desc primitive = {.material = glb_builder_add_material(b, &material),
                                                 .vertex_count = (size_t)count * 4,
                                                 .positions = positions[0],
                                                 .normals = normals[0],
                                                 .colors = colors[0],
                                                 .indices = indices,
                                                 .index_count = (size_t)count * 6};
    const struct glb_node_desc node = {.mesh = glb_builder_add_mesh(b, "quads", &primitive, 1),
                                       .translation = {0, 0, z}};
    glb_builder_add_node(b, &node);
}

static struct image shoot_built(struct renderer *renderer, struct glb_builder *b,
                                enum transparency transparency, struct view_tile tile)
{
    struct rig_scene scene;
    struct error err = {0};
    void *glb;
    size_t size;
    const struct view view = {
        .width_px = SIDE_PX,
        .height_px = SIDE_PX,
        .tile = tile,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 0, 9}, .ortho_height = 2},
        .ignore_scene_lights = true,
        .studio = VIEW_STUDIO_OFF,
        .outputs = 1u << VIEW_OUTPUT_COLOR,
        .quality = {.transparency = transparency, .samples = 1}};
    assert_true(glb_builder_finish(b, &glb, &size, &err));
    glb_builder_destroy(b);
    rig_scene_open(&scene, renderer, "objects", glb, size);
    free(glb);
    struct image color = shoot_color(renderer, &scene, &view);
    rig_scene_finish(&scene, renderer);
    return color;
}

static const float rising[4][3] = {{-1, -1, -1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, -1}};
static const float falling[4][3] = {{-1, -1, 1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, 1}};

/* Panes through one another, the second one a little nearer in the middle. */
static struct image shoot_crossing(struct renderer *renderer, enum transparency transparency,
                                   struct view_tile tile)
{
    struct error err = {0};
    struct glb_builder *b = glb_builder_create("crossing", &err);
    const struct quad quads[2] = {{rising, &crossing[0]}, {falling, &crossing[1]}};
    add_quads(b, &quads[0], 1, 0);
    add_quads(b, &quads[1], 1, 0.01);
    return shoot_built(renderer, b, transparency, tile);
}

static double over(const struct pane *near, const struct pane *far, int channel)
{
    return pane_light(near, channel) + pane_filter(near, channel) * pane_light(far, channel);
}

static void of_panes_through_one_another_one_lies_wholly_over_the_other(void **state)
{
    struct image sorted = shoot_crossing(*state, TRANSPARENCY_SORTED, (struct view_tile){0});
    struct image exact = shoot_crossing(*state, TRANSPARENCY_LISTS, (struct view_tile){0});
    for (int x = 0; x < SIDE_PX; x++)
        for (int c = 0; c < 3; c += 2) {
            bool is_first_nearer = x >= SIDE_PX / 2;
            double told = over(&crossing[1], &crossing[0], c);
            double right = is_first_nearer ? over(&crossing[0], &crossing[1], c) : told;
            assert_true(fabs((double)image_pixel_f32(&sorted, x, 8)[c] - told) < 1e-4);
            assert_true(fabs((double)image_pixel_f32(&exact, x, 8)[c] - right) < 1e-4);
            assert_true(!is_first_nearer || fabs(right - told) > 0.1);
        }
    image_finish(&sorted);
    image_finish(&exact);
}

/* Two quads of one object: the one that comes last lies over the other, be it nearer or not. */
static void an_object_that_covers_itself_has_the_order_of_its_indices(void **state)
{
    static const float near[4][3] = {{-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}};
    static const float far[4][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}};
    const struct quad of_near = {near, &crossing[0]}, of_far = {far, &crossing[1]};
    for (int is_near_first = 0; is_near_first < 2; is_near_first++) {
        struct error err = {0};
        struct glb_builder *b = glb_builder_create("self", &err);
        const struct quad quads[2] = {is_near_first ? of_near : of_far,
                                      is_near_first ? of_far : of_near};
        add_quads(b, quads, 2, 0);
        struct image color = shoot_built(*state, b, TRANSPARENCY_SORTED, (struct view_tile){0});
        for (int c = 0; c < 3; c++)
            assert_true(fabs((double)image_pixel_f32(&color, 8, 8)[c] -
                             over(quads[1].pane, quads[0].pane, c)) < 1e-4);
        image_finish(&color);
    }
}

static void tiles_have_the_bits_of_the_whole(void **state)
{
    static const struct view_tile tile = {3, 5, 11, 9};
    struct image whole = shoot_crossing(*state, TRANSPARENCY_SORTED, (struct view_tile){0});
    struct image part = shoot_crossing(*state, TRANSPARENCY_SORTED, tile);
    for (int y = 0; y < tile.height_px; y++)
        assert_memory_equal(image_pixel_f32(&part, 0, y),
                            image_pixel_f32(&whole, tile.x_px, tile.y_px + y),
                            (size_t)tile.width_px * 4 * sizeof(float));
    image_finish(&whole);
    image_finish(&part);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(parallel_panes_are_exact_in_any_order),
        cmocka_unit_test(of_panes_through_one_another_one_lies_wholly_over_the_other),
        cmocka_unit_test(an_object_that_covers_itself_has_the_order_of_its_indices),
        cmocka_unit_test(tiles_have_the_bits_of_the_whole),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
