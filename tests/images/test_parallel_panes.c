/* SPDX-License-Identifier: MIT */
/* Parallel panes: the floor, probes between the panes and the panes themselves receive exactly the
 * product of the filters above them, under every light and through both forms of list. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/image/tone_map.h"
#include "tests/support/closed_form_scenes.h"
#include "tests/support/image_checks.h"

enum { COUNTS = 7, PANES_MAX = 64, PROBE_PX = 4 };

static const int counts[COUNTS] = {1, 2, 3, 8, 16, 32, 64};
static const enum glb_light_type lights[] = {GLB_LIGHT_SPOT, GLB_LIGHT_POINT,
                                             GLB_LIGHT_DIRECTIONAL};

/* How a technique stores a filter, and how far its product may then be from the exact one. */
enum law { LAW_EXACT, LAW_UNORM16, LAW_UNORM8 };
static const struct technique {
    const char *name;
    struct view_quality quality;
    enum law law;
} techniques[] = {
    {"deep", {.shadows = SHADOWS_DEEP}, LAW_EXACT},
    {"deep-linked", {.shadows = SHADOWS_DEEP_LINKED}, LAW_UNORM16},
    {"deep-linked faithful", {.shadows = SHADOWS_DEEP_LINKED, .faithful = true}, LAW_UNORM8},
};

/* Filters from dark to clear, all different, the product of n of them still visible: their optical
 * depths add up to about that of eight. */
static void choose_colors(int count, double (*colors)[4])
{
    for (int k = 0; k < count; k++) {
        for (int c = 0; c < 3; c++) {
            double t = 0.31 + 0.69 * ((k * 37 + c * 23 + 11) % 64) / 63.0;
            colors[k][c] = pow(t, fmin(1, 8.0 / count));
        }
        colors[k][3] = 1;
    }
}

/* Product of the first k filters as the technique stores them, with the relative error that this
 * may add: half a step of unorm16 per filter. */
static double product_of(const struct closed_form_scene *scene, int k, int channel, enum law law,
                         double *slack)
{
    double product = 1;
    *slack = 1e-5; /* sums of optical depth in f32 */
    for (int i = 0; i < k; i++) {
        double filter[3];
        closed_form_filter(&scene->panes[i], filter);
        double t = filter[channel];
        if (law == LAW_UNORM8)
            t = round(t * 255) / 255;
        if (law == LAW_UNORM16)
            *slack += 0.5 / 65535 / t;
        product *= t;
    }
    return product;
}

static void assert_filtered(const struct image *lit, const struct image *open,
                            const struct closed_form_scene *scene, int k,
                            const struct technique *technique, const char *where)
{
    for (int y = 0; y < lit->height_px; y++)
        for (int x = 0; x < lit->width_px; x++)
            for (int c = 0; c < 3; c++) {
                double slack, t = product_of(scene, k, c, technique->law, &slack);
                double expected = t * image_pixel_f32(open, x, y)[c];
                double value = image_pixel_f32(lit, x, y)[c];
                if (!(expected > 0 && fabs(value - expected) <= slack * expected))
                    fail_msg("%s, %d panes, light %d, %s: pixel %d,%d channel %d is %.8g, %.8g "
                             "through %d filters",
                             technique->name, scene->pane_count, (int)scene->light.type, where, x,
                             y, c, value, expected, k);
            }
}

/* Below all panes, onto the floor under their middle. */
static struct view floor_view(void)
{
    return (struct view){
        .width_px = 24,
        .height_px = 24,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 0.4, 0.5}, .fov_y_deg = 20},
        .quality.samples = 1,
    };
}

static struct view probe_view(const struct panes_scene_desc *desc, int k)
{
    double p[3];
    panes_scene_probe(desc, k, p);
    return (struct view){
        .width_px = PROBE_PX,
        .height_px = PROBE_PX,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                   .eye = {p[0], p[1] + 0.01, p[2]},
                   .target = {p[0], p[1], p[2]},
                   .up = {0, 0, -1},
                   .fov_y_deg = 45},
        .quality.samples = 1,
    };
}

static void check_view(struct renderer *renderer, const struct rig_scene *rig,
                       const struct closed_form_scene *scene, const struct view *where, int k,
                       const char *name)
{
    struct view view = *where;
    view.quality.shadows = SHADOWS_NONE;
    struct image open = shoot_color(renderer, rig, &view);
    for (size_t i = 0; i < sizeof techniques / sizeof *techniques; i++) {
        view.quality = techniques[i].quality;
        view.quality.samples = 1;
        struct image lit = shoot_color(renderer, rig, &view);
        assert_filtered(&lit, &open, scene, k, &techniques[i], name);
        image_finish(&lit);
    }
    image_finish(&open);
}

static void check_panes(struct renderer *renderer, int count, enum glb_light_type light)
{
    double colors[PANES_MAX][4];
    struct closed_form_scene scene;
    struct rig_scene rig;
    choose_colors(count, colors);
    const struct panes_scene_desc desc = {.pane_count = count,
                                          .colors = (const double(*)[4])colors,
                                          .light = light,
                                          .has_probes = true};
    panes_scene_build(&desc, &scene);
    rig_scene_open(&rig, renderer, "panes", scene.glb, scene.size_bytes);
    struct view view = floor_view();
    check_view(renderer, &rig, &scene, &view, count, "floor");
    for (int k = 0; k <= count; k++) {
        char name[32];
        snprintf(name, sizeof name, "probe %d", k);
        view = probe_view(&desc, k);
        check_view(renderer, &rig, &scene, &view, k, name);
    }
    rig_scene_finish(&rig, renderer);
    closed_form_scene_finish(&scene);
}

static void floor_and_probes_receive_the_product_above(void **state)
{
    for (size_t l = 0; l < sizeof lights / sizeof *lights; l++)
        for (int i = 0; i < COUNTS; i++)
            check_panes(*state, counts[i], lights[l]);
}

/* The radiance that the floor must have, by hand. */
static void expected_image(const struct closed_form_scene *scene, const struct view *view,
                           struct image *image)
{
    struct error err = {0};
    static const double up[3] = {0, 1, 0};
    assert_true(image_init(image, view->width_px, view->height_px, 4, IMAGE_F32, &err));
    float *p = image->pixels;
    for (int y = 0; y < view->height_px; y++) {
        for (int x = 0; x < view->width_px; x++, p += 4) {
            double point[3], radiance[3];
            assert_true(view_meet_plane(view, x, y, up, 0, point));
            closed_form_radiance(scene, point, up, radiance);
            for (int c = 0; c < 3; c++)
                p[c] = (float)radiance[c];
            p[3] = 1;
        }
    }
}

static void assert_png_within_one(const struct image *a, const struct image *b)
{
    struct error err = {0};
    const struct tone_map_desc none = {.operator_ = TONE_MAPPING_NONE};
    struct image ldr[2] = {0}, decoded[2] = {0};
    for (int i = 0; i < 2; i++) {
        void *bytes;
        size_t size;
        assert_true(tone_map(i ? b : a, &none, &ldr[i], &err));
        assert_true(image_encode(&ldr[i], &(struct image_encode_desc){.format = IMAGE_FORMAT_PNG},
                                 &bytes, &size, &err));
        assert_true(image_decode(bytes, size, &(struct image_decode_desc){0}, &decoded[i], &err));
        free(bytes);
        image_finish(&ldr[i]);
    }
    const uint8_t *p = decoded[0].pixels, *q = decoded[1].pixels;
    for (size_t i = 0; i < image_size_bytes(&decoded[0]); i++)
        assert_int_in_range(p[i] - q[i] + 1, 0, 2);
    image_finish(&decoded[0]);
    image_finish(&decoded[1]);
}

static void floor_has_the_radiance_computed_by_hand(void **state)
{
    double colors[PANES_MAX][4];
    for (size_t l = 0; l < sizeof lights / sizeof *lights; l++) {
        for (int i = 0; i < COUNTS; i++) {
            struct closed_form_scene scene;
            struct rig_scene rig;
            struct image expected;
            struct view view = floor_view();
            choose_colors(counts[i], colors);
            panes_scene_build(&(struct panes_scene_desc){.pane_count = counts[i],
                                                         .colors = (const double(*)[4])colors,
                                                         .light = lights[l]},
                              &scene);
            rig_scene_open(&rig, *state, "by hand", scene.glb, scene.size_bytes);
            struct image color = shoot_color(*state, &rig, &view);
            expected_image(&scene, &view, &expected);
            assert_images_close(&color, &expected, 1e-9, 1e-3);
            assert_png_within_one(&color, &expected);
            image_finish(&expected);
            image_finish(&color);
            rig_scene_finish(&rig, *state);
            closed_form_scene_finish(&scene);
        }
    }
}

/* From above the stack: each BLEND pane shows its own colour lit through the panes over it. */
static void composite_by_hand(const struct closed_form_scene *scene, const struct view *view, int x,
                              int y, double pixel[3])
{
    static const double up[3] = {0, 1, 0};
    double through = 1;
    pixel[0] = pixel[1] = pixel[2] = 0;
    for (int k = 0; k <= scene->pane_count; k++) {
        bool is_floor = k == scene->pane_count;
        const struct closed_form_pane *pane = &scene->panes[is_floor ? 0 : k];
        double point[3], radiance[3];
        assert_true(view_meet_plane(view, x, y, up, is_floor ? 0 : pane->corner[1], point));
        closed_form_radiance(scene, point, up, radiance);
        double alpha = is_floor ? 1 : pane->color[3];
        for (int c = 0; c < 3; c++)
            pixel[c] +=
                through * alpha * radiance[c] * (is_floor ? 1 : pane->color[c] / scene->albedo);
        through *= 1 - alpha;
    }
}

static void each_pane_is_lit_through_the_panes_above_it(void **state)
{
    static const double colors[5][4] = {{0.9, 0.4, 0.2, 0.3},
                                        {0.2, 0.8, 0.5, 0.5},
                                        {0.3, 0.3, 0.9, 0.2},
                                        {0.9, 0.9, 0.1, 0.4},
                                        {0.6, 0.1, 0.7, 0.35}};
    for (size_t l = 0; l < sizeof lights / sizeof *lights; l++) {
        struct closed_form_scene scene;
        struct rig_scene rig;
        panes_scene_build(
            &(struct panes_scene_desc){
                .pane_count = 5, .colors = colors, .is_blend = true, .light = lights[l]},
            &scene);
        rig_scene_open(&rig, *state, "layers", scene.glb, scene.size_bytes);
        struct view view = {.width_px = 16,
                            .height_px = 16,
                            .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                       .eye = {0.05, 2, 0.1},
                                       .fov_y_deg = 20,
                                       .up = {0, 0, -1}},
                            .quality.samples = 1};
        struct image color = shoot_color(*state, &rig, &view);
        for (int y = 0; y < 16; y++)
            for (int x = 0; x < 16; x++) {
                double expected[3];
                composite_by_hand(&scene, &view, x, y, expected);
                for (int c = 0; c < 3; c++) {
                    double value = image_pixel_f32(&color, x, y)[c];
                    if (!(fabs(value - expected[c]) <= 1e-3 * expected[c]))
                        fail_msg("light %zu pixel %d,%d channel %d is %.8g, expected %.8g", l, x, y,
                                 c, value, expected[c]);
                }
            }
        image_finish(&color);
        rig_scene_finish(&rig, *state);
        closed_form_scene_finish(&scene);
    }
}

static void clear_passes_all_and_black_nothing(void **state)
{
    static const double colors[3][4] = {{1, 0, 1, 1}, {1, 1, 0.5, 1}, {1, 0.7, 1, 1}};
    struct closed_form_scene scene;
    struct rig_scene rig;
    panes_scene_build(&(struct panes_scene_desc){.pane_count = 3, .colors = colors}, &scene);
    rig_scene_open(&rig, *state, "extremes", scene.glb, scene.size_bytes);
    for (size_t i = 0; i < sizeof techniques / sizeof *techniques; i++) {
        struct view view = floor_view();
        view.quality = techniques[i].quality;
        struct image lit = shoot_color(*state, &rig, &view);
        view.quality.shadows = SHADOWS_NONE;
        struct image open = shoot_color(*state, &rig, &view);
        for (int y = 0; y < lit.height_px; y++)
            for (int x = 0; x < lit.width_px; x++) {
                const float *p = image_pixel_f32(&lit, x, y), *q = image_pixel_f32(&open, x, y);
                assert_true(p[0] == q[0]);
                assert_true(p[1] == 0);
                assert_true(fabsf(p[2] - 0.5f * q[2]) <= 0.003f * q[2]); /* 128 of 255 faithful */
            }
        image_finish(&lit);
        image_finish(&open);
    }
    rig_scene_finish(&rig, *state);
    closed_form_scene_finish(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(floor_and_probes_receive_the_product_above),
        cmocka_unit_test(floor_has_the_radiance_computed_by_hand),
        cmocka_unit_test(each_pane_is_lit_through_the_panes_above_it),
        cmocka_unit_test(clear_passes_all_and_black_nothing),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
