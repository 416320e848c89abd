/* SPDX-License-Identifier: MIT */
/* A background behind the tone-mapped picture: its own codes where nothing is before it, filtered
 * by glass, covered by what is opaque, in every technique: section 6 of
 * docs/explanation/shading.md. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "glb/shapes.h"
#include "tests/support/image_checks.h"

enum { SIZE = 64 };

static const double card_color[3] = {0.2, 0.5, 0.8}, pane_color[3] = {0.9, 0.5, 0.25},
                    veil_color[3] = {0.6, 0.9, 0.3};
static const double veil_alpha = 0.5;

/* Middles of what the picture shows, in pixels. */
static const int bare_at[2] = {48, 16}, card_at[2] = {16, 16}, pane_at[2] = {16, 48},
                 veil_at[2] = {48, 48};

static void add_square(struct glb_builder *builder, double x, double y,
                       const struct glb_material_desc *material)
{
    struct shape shape = {0};
    double half = 0.303; /* edges run through pixels */
    shape_add_quad(&shape, (double[]){x - half, y - half, 0}, (double[]){2 * half, 0, 0},
                   (double[]){0, 2 * half, 0});
    int mesh = shape_give_mesh(&shape, builder, material->name,
                               glb_builder_add_material(builder, material));
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = material->name, .mesh = mesh});
}

/* In front of nothing: an unlit card, a pane that reflects nothing, an unlit veil. */
static void open_squares(struct rig_scene *rig, struct renderer *renderer)
{
    struct error err = {0};
    struct glb_builder *builder = glb_builder_create("Squares", &err);
    const double *c = card_color, *p = pane_color, *v = veil_color;
    void *glb;
    size_t size_bytes;
    assert_non_null(builder);
    add_square(builder, -0.5, 0.5,
               &(struct glb_material_desc){
                   .name = "Card", .base_color = {c[0], c[1], c[2], 1}, .is_unlit = true});
    add_square(builder, -0.5, -0.5,
               &(struct glb_material_desc){.name = "Pane",
                                           .base_color = {p[0], p[1], p[2], 1},
                                           .is_double_sided = true,
                                           .transmission = 1,
                                           .has_ior = true,
                                           .ior = 1});
    add_square(builder, 0.5, -0.5,
               &(struct glb_material_desc){.name = "Veil",
                                           .base_color = {v[0], v[1], v[2], veil_alpha},
                                           .alpha_mode = GLB_BLEND,
                                           .is_unlit = true});
    if (!glb_builder_finish(builder, &glb, &size_bytes, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    rig_scene_open(rig, renderer, "squares", glb, size_bytes);
    free(glb);
}

/* A hemisphere of radiance 0 takes the place of default lights. */
static struct view look(enum shadow_technique shadows, int samples)
{
    return (struct view){
        .width_px = SIZE,
        .height_px = SIZE,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 0, 3}, .ortho_height = 2},
        .has_environment = true,
        .background = {0.25f, 0.5f, 0.75f, 1},
        .screen = {.has_backdrop = true, .mapping = {.exposure_ev = 1}},
        .quality = {.shadows = shadows, .samples = samples},
    };
}

/* Khronos PBR Neutral, in f64. */
static void neutral(const double in[3], double out[3])
{
    const double start = 0.76, d = 1 - start;
    double low = fmin(in[0], fmin(in[1], in[2])), high = fmax(in[0], fmax(in[1], in[2]));
    double offset = low < 0.08 ? low - 6.25 * low * low : 0.04, peak = high - offset;
    double new_peak = 1 - d * d / (peak + d - start);
    double white = 1 - 1 / (0.15 * (peak - new_peak) + 1);
    for (int k = 0; k < 3; k++) {
        out[k] = in[k] - offset;
        if (peak >= start)
            out[k] = out[k] * new_peak / peak * (1 - white) + new_peak * white;
    }
}

static void expect(const struct image *image, const int at[2], const double color[3], double alpha)
{
    const float *pixel = image_pixel_f32(image, at[0], at[1]);
    for (int k = 0; k < 3; k++)
        if (!(fabs((double)pixel[k] - color[k]) <= 3e-5)) /* surfaces keep 16 bits a channel */
            fail_msg("pixel %d,%d channel %d is %.8g, expected %.8g", at[0], at[1], k, pixel[k],
                     color[k]);
    assert_true(fabs((double)pixel[3] - alpha) <= 1e-6);
}

/* The colours that section 6 gives, of light at 2^1. */
static void expect_closed_forms(const struct image *image, const struct view *view)
{
    double bare[3], card[3], pane[3], veil[3], before[3], after[3];
    for (int k = 0; k < 3; k++) {
        bare[k] = (double)view->background[k];
        card[k] = 2 * card_color[k];
        pane[k] = pane_color[k] * bare[k];
        before[k] = (1 - veil_alpha) * bare[k];
        after[k] = before[k] + 2 * veil_alpha * veil_color[k];
        veil[k] = before[k];
    }
    neutral(card, card);
    neutral(before, before);
    neutral(after, after);
    for (int k = 0; k < 3; k++)
        veil[k] += after[k] - before[k];
    expect(image, bare_at, bare, 1);
    expect(image, card_at, card, 1);
    expect(image, pane_at, pane, 1);
    expect(image, veil_at, veil, 1);
}

static const struct {
    enum shadow_technique shadows;
    int samples;
    bool is_reference;
} forms[] = {
    {SHADOWS_DEEP, 1, false},      {SHADOWS_DEEP, 4, false},
    {SHADOWS_DEEP, 8, false},      {SHADOWS_DEEP, 16, false},
    {SHADOWS_MAP, 4, false},       {SHADOWS_RAYTRACED_SHADOWS, 4, false},
    {SHADOWS_RAYTRACED, 4, false}, {SHADOWS_RAYTRACED, 16, false},
    {SHADOWS_RAYTRACED, 4, true},  {SHADOWS_RAYTRACED_SHADOWS, 16, false},
};
enum { FORMS = sizeof forms / sizeof forms[0] };

static struct view look_by(int form)
{
    struct view view = look(forms[form].shadows, forms[form].samples);
    view.quality.reference = forms[form].is_reference;
    return view;
}

static void every_technique_meets_the_closed_forms(void **state)
{
    struct renderer *renderer = *state;
    struct rig_scene rig;
    open_squares(&rig, renderer);
    for (int form = 0; form < FORMS; form++) {
        struct view view = look_by(form);
        struct image image = shoot_color(renderer, &rig, &view);
        expect_closed_forms(&image, &view);
        image_finish(&image);
    }
    rig_scene_finish(&rig, renderer);
}

/* An edge of what is opaque is as in the picture without a background, laid over it. */
static void edges_cover_by_their_share_of_the_pixel(void **state)
{
    struct renderer *renderer = *state;
    struct rig_scene rig;
    open_squares(&rig, renderer);
    for (int form = 0; form < FORMS; form++) {
        struct view view = look_by(form);
        struct image over = shoot_color(renderer, &rig, &view);
        view.screen.has_backdrop = false;
        view.background[3] = 0;
        struct image own = shoot_color(renderer, &rig, &view);
        int edges = 0;
        for (int i = 0; i < SIZE * SIZE / 4; i++) { /* the quarter with the card */
            int at[2] = {i % (SIZE / 2), i / (SIZE / 2)};
            const float *light = image_pixel_f32(&own, at[0], at[1]);
            double alpha = (double)light[3], color[3] = {0};
            for (int k = 0; k < 3 && alpha > 0; k++)
                color[k] = 2 * (double)light[k] / alpha;
            neutral(color, color);
            for (int k = 0; k < 3; k++)
                color[k] = alpha * color[k] + (1 - alpha) * (double)look(0, 0).background[k];
            expect(&over, at, color, 1);
            edges += alpha > 0 && alpha < 1;
        }
        assert_true(edges >= SIZE || view.quality.samples == 1);
        image_finish(&over);
        image_finish(&own);
    }
    rig_scene_finish(&rig, renderer);
}

/* Of the passes and of the rays, over a background. */
static void every_operator_is_the_same_by_all_techniques(void **state)
{
    static const enum tone_mapping operators[] = {TONE_MAPPING_AGX, TONE_MAPPING_ACES};
    const int *const at[] = {bare_at, card_at, pane_at, veil_at};
    struct renderer *renderer = *state;
    struct rig_scene rig;
    open_squares(&rig, renderer);
    for (int i = 0; i < 2; i++) {
        struct image images[FORMS];
        const struct tone_map_desc mapping = {.operator_ = operators[i], .exposure_ev = 1};
        float card[3];
        for (int form = 0; form < FORMS; form++) {
            struct view view = look_by(form);
            view.screen.mapping = mapping;
            images[form] = shoot_color(renderer, &rig, &view);
        }
        for (int form = 0; form < FORMS; form++)
            for (int place = 0; place < 4; place++) {
                const float *pixel = image_pixel_f32(&images[0], at[place][0], at[place][1]);
                const double color[3] = {(double)pixel[0], (double)pixel[1], (double)pixel[2]};
                expect(&images[form], at[place], color, 1);
            }
        for (int k = 0; k < 3; k++)
            card[k] = (float)card_color[k];
        tone_map_color(&mapping, card);
        const double expected[3] = {(double)card[0], (double)card[1], (double)card[2]};
        expect(&images[0], card_at, expected, 1);
        for (int form = 0; form < FORMS; form++)
            image_finish(&images[form]);
    }
    rig_scene_finish(&rig, renderer);
}

/* Of bare pixels, whatever the exposure and the operator. */
static void the_background_has_its_own_codes(void **state)
{
    static const uint8_t codes[][3] = {{255, 255, 255}, {0x1d, 0x1e, 0x22}, {1, 128, 254}};
    struct renderer *renderer = *state;
    struct rig_scene rig;
    open_squares(&rig, renderer);
    for (int i = 0; i < 3 * FORMS; i++) {
        struct view view = look_by(i / 3);
        struct image shown;
        struct error err = {0};
        const uint8_t *code = codes[i % 3];
        view.screen.mapping = (struct tone_map_desc){
            .operator_ = i % 2 ? TONE_MAPPING_NONE : TONE_MAPPING_NEUTRAL, .exposure_ev = -3};
        for (int k = 0; k < 3; k++) { /* IEC 61966-2-1 */
            double s = code[k] / 255.0;
            view.background[k] = (float)(s <= 0.04045 ? s / 12.92 : pow((s + 0.055) / 1.055, 2.4));
        }
        struct image image = shoot_color(renderer, &rig, &view);
        const struct tone_map_desc encoding = view_screen_code(&view.screen);
        assert_true(tone_map(&image, &encoding, &shown, &err));
        const uint8_t *pixel = (const uint8_t *)shown.pixels + 4 * (bare_at[1] * SIZE + bare_at[0]);
        assert_memory_equal(pixel, code, 3);
        assert_int_equal(pixel[3], 255);
        image_finish(&image);
        image_finish(&shown);
    }
    rig_scene_finish(&rig, renderer);
}

/* The device encodes what the processor would. */
static void a_device_shows_the_same_codes(void **unused)
{
    (void)unused;
    struct renderer *renderer = render_rig_create_as(
        &(struct renderer_desc){.is_strict = true, .hooks.poses_as_hardware = true});
    struct rig_scene rig;
    struct error err = {0};
    struct frame frame;
    struct image expected;
    open_squares(&rig, renderer);
    for (int samples = 4; samples <= 16; samples *= 4) {
        struct view view = look(SHADOWS_DEEP, samples);
        view.background[3] = 0.5f;
        struct image linear = shoot_color(renderer, &rig, &view);
        const struct tone_map_desc encoding = view_screen_code(&view.screen);
        assert_true(tone_map(&linear, &encoding, &expected, &err));
        view.screen.channels = 4;
        shoot(renderer, &rig, &view, &frame);
        assert_int_equal(frame.outputs[VIEW_OUTPUT_COLOR].component, IMAGE_U8);
        assert_same_bits(&frame.outputs[VIEW_OUTPUT_COLOR], &expected);
        frame_finish(&frame);
        image_finish(&linear);
        image_finish(&expected);
    }
    rig_scene_finish(&rig, renderer);
    renderer_destroy(renderer);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_technique_meets_the_closed_forms),
        cmocka_unit_test(edges_cover_by_their_share_of_the_pixel),
        cmocka_unit_test(every_operator_is_the_same_by_all_techniques),
        cmocka_unit_test(the_background_has_its_own_codes),
    };
    const struct CMUnitTest alone[] = {cmocka_unit_test(a_device_shows_the_same_codes)};
    int failed = cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
    return failed ? failed : cmocka_run_group_tests(alone, NULL, NULL);
}
