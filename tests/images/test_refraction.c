/* SPDX-License-Identifier: MIT */
/* Rasterised pictures of glass that bends light beside those of the reference (section 8 of
 * docs/explanation/shading.md): a slab shifts by Snell's offset, rough walls blur alike, and what
 * needs no refraction keeps its bits. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "glb/shapes.h"
#include "tests/support/image_checks.h"

static const double pi = 3.14159265358979323846;

enum { SIZE = 192 };

static const double WIDE = 4; /* m, that a picture shows */

static const struct view_light dim = {.type = SCENE_LIGHT_DIRECTIONAL,
                                      .direction = {0, 0, 1},
                                      .color = {1, 1, 1},
                                      .intensity = 1e-9f};

static void give(struct shape *shape, struct glb_builder *builder, const char *name,
                 const struct glb_material_desc *material)
{
    int mesh = shape_give_mesh(shape, builder, name, glb_builder_add_material(builder, material));
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = name, .mesh = mesh});
}

/* A pane before a wall that is white from x = 0 on to the right, and black to the left. */
static void open_pane(struct rig_scene *rig, struct renderer *renderer,
                      const struct glb_material_desc *glass, double turn, double wall_z)
{
    static const struct glb_material_desc white = {
        .name = "White", .is_unlit = true, .is_double_sided = true};
    static const struct glb_material_desc black = {
        .name = "Black", .is_unlit = true, .is_double_sided = true, .base_color = {0, 0, 0, 1}};
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Pane", &err);
    struct shape shape = {0};
    void *glb;
    size_t size_bytes;
    assert_non_null(builder);
    shape_set_place(&shape, (double[]){0, 0, 0}, (double[]){cos(turn), 0, sin(turn)},
                    (double[]){0, 1, 0});
    shape_add_quad(&shape, (double[]){-1.5, -1.5, 0}, (double[]){3, 0, 0}, (double[]){0, 3, 0});
    give(&shape, builder, "Pane", glass);
    shape_add_quad(&shape, (double[]){0, -9, wall_z}, (double[]){9, 0, 0}, (double[]){0, 18, 0});
    give(&shape, builder, "Right", &white);
    shape_add_quad(&shape, (double[]){-9, -9, wall_z}, (double[]){9, 0, 0}, (double[]){0, 18, 0});
    give(&shape, builder, "Left", &black);
    if (!glb_builder_finish(builder, &glb, &size_bytes, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    rig_scene_open(rig, renderer, "pane", glb, size_bytes);
    free(glb);
}

static struct view look(void)
{
    return (struct view){
        .width_px = SIZE,
        .height_px = SIZE,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 0, 6}, .fov_y_deg = 40},
        .lights = &dim,
        .light_count = 1,
        .quality = {.shadows = SHADOWS_DEEP, .samples = 1},
    };
}

static struct image trace(struct renderer *renderer, const struct rig_scene *rig, struct view view)
{
    view.quality.shadows = SHADOWS_RAYTRACED;
    view.quality.reference = true;
    return shoot_color(renderer, rig, &view);
}

static void keep(const struct image *drawn, const struct image *traced, const char *name)
{
    char text[80];
    snprintf(text, sizeof text, "refraction_%s_drawn", name);
    save_picture(drawn, text);
    snprintf(text, sizeof text, "refraction_%s_traced", name);
    save_picture(traced, text);
}

/* A rough pane blurs the edge as the reference does, within 2 % of the mean at roughness 0.15 and 8
 * % at 0.6. */
static void rough_panes_blur_as_the_reference(void **state)
{
    struct renderer *renderer = *state;
    for (int i = 0; i < 4; i++) {
        const struct glb_material_desc glass = {.name = "Rough",
                                                .is_double_sided = true,
                                                .transmission = 1,
                                                .roughness = 0.15 + 0.15 * i};
        struct rig_scene rig;
        struct view view = look();
        open_pane(&rig, renderer, &glass, 0.2, -2);
        struct image drawn = shoot_color(renderer, &rig, &view);
        struct image traced = trace(renderer, &rig, view);
        char name[16];
        snprintf(name, sizeof name, "rough_%d", i);
        keep(&drawn, &traced, name);
        double off = mean_error(&drawn, &traced);
        print_message("roughness %.2f: mean error %.4f\n", glass.roughness, off);
        assert_image_is_sound(&drawn, 10);
        assert_true(off <= 0.02 + 0.02 * i);
        image_finish(&drawn);
        view.quality.refraction = VIEW_REFRACTION_OFF;
        drawn = shoot_color(renderer, &rig, &view);
        assert_true(mean_error(&drawn, &traced) > 2 * off); /* straight through is far off */
        image_finish(&drawn);
        image_finish(&traced);
        rig_scene_finish(&rig, renderer);
    }
}

static double find_edge(const struct image *image)
{
    const float *row = (const float *)image->pixels + 4 * (size_t)(SIZE / 2) * SIZE;
    for (int x = SIZE / 4; x + 1 < SIZE; x++)
        if ((row[4 * x + 1] < 0.4f) != (row[4 * x + 5] < 0.4f))
            return x + 1.0;
    fail_msg("there is no edge");
    return 0;
}

/* By parallel rays, whose shift in the picture is that of the closed form. */
static void an_open_slab_shifts_by_the_offset_of_snell(void **state)
{
    struct renderer *renderer = *state;
    for (int i = 1; i <= 5; i++) {
        const double turn = i * 0.2, ior = 1.6, inside = asin(sin(turn) / ior);
        const double offset = 0.4 * sin(turn - inside) / cos(inside);
        const struct glb_material_desc glass = {.name = "Slab",
                                                .transmission = 1,
                                                .thickness = 0.4,
                                                .has_ior = true,
                                                .ior = ior,
                                                .is_double_sided = true};
        struct rig_scene rig;
        struct view view = look();
        view.camera.ortho_height = WIDE;
        open_pane(&rig, renderer, &glass, turn, -2);
        struct image drawn = shoot_color(renderer, &rig, &view);
        struct image traced = trace(renderer, &rig, view);
        double edge = fabs(find_edge(&drawn) / SIZE - 0.5) * WIDE;
        double truth = fabs(find_edge(&traced) / SIZE - 0.5) * WIDE;
        print_message("turned by %.1f: %.4f m, traced %.4f, expected %.4f\n", turn, edge, truth,
                      offset);
        assert_true(fabs(edge - offset) <= 1.01 * WIDE / SIZE);
        assert_true(fabs(truth - offset) <= 1.01 * WIDE / SIZE);
        image_finish(&drawn);
        image_finish(&traced);
        rig_scene_finish(&rig, renderer);
    }
}

/* Neither a thickness nor a roughness: with refraction, and off, with media and without. */
static void smooth_walls_keep_their_bits(void **state)
{
    struct renderer *renderer = *state;
    const struct glb_material_desc glass = {.name = "Clear",
                                            .is_double_sided = true,
                                            .transmission = 0.9,
                                            .base_color = {0.9, 0.6, 0.3, 1},
                                            .roughness = 0.06};
    struct rig_scene rig;
    struct view view = look();
    struct frame frame;
    open_pane(&rig, renderer, &glass, pi / 5, -2);
    shoot(renderer, &rig, &view, &frame);
    view.quality.refraction = VIEW_REFRACTION_OFF;
    struct image off = shoot_color(renderer, &rig, &view);
    assert_same_bits(&frame.outputs[VIEW_OUTPUT_COLOR], &off);
    assert_false(report_has_pass(&frame.report, "refraction", NULL));
    assert_false(report_has_warning(&frame.report, "refract"));
    image_finish(&off);
    frame_finish(&frame);
    rig_scene_finish(&rig, renderer);
}

/* Alpha below the cutoff is a hole, and any above it makes the glass whole. */
static void a_mask_of_glass_has_holes(void **state)
{
    struct renderer *renderer = *state;
    for (int form = 0; form < 6; form++) {
        const bool is_hole = form % 2;
        const struct glb_material_desc glass = {.name = "Mask",
                                                .is_double_sided = true,
                                                .transmission = 1,
                                                .alpha_mode = GLB_MASK,
                                                .base_color = {0.2, 0.9, 0.3, is_hole ? 0.3 : 0.7}};
        struct rig_scene rig;
        struct view view = look();
        open_pane(&rig, renderer, &glass, 0, -2);
        view.quality.shadows = form < 2 ? SHADOWS_DEEP : SHADOWS_RAYTRACED;
        view.quality.reference = form >= 4;
        struct image image = shoot_color(renderer, &rig, &view);
        const float *white = image_pixel_f32(&image, SIZE / 2 + 8, SIZE / 2);
        if (is_hole)
            assert_true(white[0] == 1 && white[1] == 1 && white[2] == 1);
        else /* of the light that is not mirrored, 4 % */
            assert_true(fabs((double)white[0] - 0.96 * 0.2) < 1e-3 &&
                        fabs((double)white[1] - 0.96 * 0.9) < 1e-3);
        image_finish(&image);
        rig_scene_finish(&rig, renderer);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rough_panes_blur_as_the_reference),
        cmocka_unit_test(an_open_slab_shifts_by_the_offset_of_snell),
        cmocka_unit_test(smooth_walls_keep_their_bits),
        cmocka_unit_test(a_mask_of_glass_has_holes),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
