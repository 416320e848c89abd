/* SPDX-License-Identifier: MIT */
/* Deep images: samples of a pixel, over one another front to back, are the pixel of the picture. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/frame/renderer_internal.h"
#include "tests/support/closed_form_scenes.h"
#include "tests/support/image_checks.h"

enum { WIDTH = 160, HEIGHT = 90, PANES = 1000 };

struct fixture {
    struct renderer *renderer;
    struct rig_scene demo;
};

/* The ball of the demo scene as a body of blue glass. */
static const struct view_material_override body = {
    .material = "Ball glass",
    .has_base_color = true,
    .base_color = {1, 1, 1, 1},
    .has_thickness = true,
    .thickness = 0.1f,
    .has_attenuation = true,
    .attenuation_color = {0.1f, 0.4f, 0.9f},
    .attenuation_distance = 0.1f,
};

static struct view look(void)
{
    return (struct view){.width_px = WIDTH,
                         .height_px = HEIGHT,
                         .wants_deep = true,
                         .quality = {.shadows = SHADOWS_MAP, .refraction = VIEW_REFRACTION_OFF}};
}

/* From where the ball fills the picture. */
static struct view look_at_ball(void)
{
    struct view view = look();
    view.camera = (struct view_camera){.kind = VIEW_CAMERA_LOOK_AT,
                                       .eye = {2.3, 1.6, 3.3},
                                       .target = {1.535, 1.085, 2.511},
                                       .fov_y_deg = 18};
    view.materials = &body;
    view.material_override_count = 1;
    return view;
}

/* What the samples of a pixel come to, in f64, and how far off the rounding of opacities to f32
 * puts it: each scales all light behind. */
static void flatten(const struct deep_image *deep, int x, int y, double color[3], double alpha[3],
                    double off[3])
{
    const struct deep_pixel *pixel = &deep->pixels[y * deep->width_px + x];
    for (int k = 0; k < 3; k++) {
        double light = 0, share = 1;
        off[k] = 0;
        for (uint32_t i = 0; i < pixel->count; i++) {
            const struct deep_sample *s = &deep->samples[pixel->first + i];
            light += share * (double)s->color[k];
            off[k] += 0x1p-23 * (double)s->color[k];
            share *= 1 - (double)s->opacity[k];
        }
        color[k] = light;
        alpha[k] = 1 - share;
    }
}

/* The most samples of a pixel. */
static uint32_t expect_flattened(const struct frame *frame)
{
    const struct image *image = &frame->outputs[VIEW_OUTPUT_COLOR];
    uint32_t most = 0;
    assert_int_equal(frame->deep.width_px, image->width_px);
    assert_int_equal(frame->deep.height_px, image->height_px);
    for (int y = 0; y < image->height_px; y++)
        for (int x = 0; x < image->width_px; x++) {
            const float *p = image_pixel_f32(image, x, y);
            double color[3], alpha[3], off[3];
            flatten(&frame->deep, x, y, color, alpha, off);
            for (int k = 0; k < 3; k++)
                if (!(fabs(color[k] - (double)p[k]) <= off[k] + 1e-6 * fabs((double)p[k])))
                    fail_msg("(%d, %d) channel %d: %.9g, the picture has %.9g", x, y, k, color[k],
                             (double)p[k]);
            assert_true(fabs((alpha[0] + alpha[1] + alpha[2]) / 3 - (double)p[3]) < 1e-6);
            uint32_t count = frame->deep.pixels[y * image->width_px + x].count;
            most = count > most ? count : most;
        }
    return most;
}

/* Sorted, without overlap, and no opacity or light out of range. */
static size_t expect_tidy(const struct deep_image *deep)
{
    size_t volumes = 0;
    for (int i = 0; i < deep->width_px * deep->height_px; i++) {
        float reached = 0;
        for (uint32_t j = 0; j < deep->pixels[i].count; j++) {
            const struct deep_sample *s = &deep->samples[deep->pixels[i].first + j];
            assert_true(s->depth >= reached && s->back >= s->depth);
            reached = s->back;
            volumes += s->back > s->depth;
            for (int k = 0; k < 3; k++)
                assert_true(s->color[k] >= 0 && s->opacity[k] >= 0 && s->opacity[k] <= 1);
        }
    }
    return volumes;
}

static void samples_over_one_another_are_the_picture(void **state)
{
    struct fixture *f = *state;
    struct view view = look();
    struct frame frame;
    view.outputs = 1u << VIEW_OUTPUT_COLOR | 1u << VIEW_OUTPUT_DEPTH | 1u << VIEW_OUTPUT_LAYERS;
    shoot(f->renderer, &f->demo, &view, &frame);
    assert_true(report_has_pass(&frame.report, "deep-image", NULL));
    assert_true(expect_flattened(&frame) > 3);
    assert_int_equal(expect_tidy(&frame.deep), 0); /* there is no medium */
    const struct image *depth = &frame.outputs[VIEW_OUTPUT_DEPTH];
    const uint32_t *layers = frame.outputs[VIEW_OUTPUT_LAYERS].pixels;
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        const struct deep_pixel *pixel = &frame.deep.pixels[i];
        assert_true(pixel->count <= layers[i] + 1);
        if (pixel->count == layers[i] + 1)
            assert_true(frame.deep.samples[pixel->first].depth == ((float *)depth->pixels)[i]);
    }
    frame_finish(&frame);
}

static void media_lie_between_their_surfaces(void **state)
{
    struct fixture *f = *state;
    struct view view = look_at_ball();
    struct frame frame;
    shoot(f->renderer, &f->demo, &view, &frame);
    expect_flattened(&frame);
    assert_true(expect_tidy(&frame.deep) > 1000);
    frame_finish(&frame);
    view.camera.eye[0] = 1.535; /* from inside of it */
    view.camera.eye[1] = 1.085;
    view.camera.eye[2] = 2.511;
    view.camera.target[0] = 0;
    shoot(f->renderer, &f->demo, &view, &frame);
    expect_flattened(&frame);
    expect_tidy(&frame.deep);
    frame_finish(&frame);
}

static void the_background_is_infinitely_far(void **state)
{
    struct fixture *f = *state;
    struct view view = look();
    struct frame frame;
    view.camera = (struct view_camera){
        .kind = VIEW_CAMERA_LOOK_AT, .eye = {0, 40, 0}, .target = {0, 80, 0.1}};
    memcpy(view.background, (float[]){0.5f, 0.25f, 1, 0.5f}, sizeof view.background);
    shoot(f->renderer, &f->demo, &view, &frame);
    assert_int_equal(expect_flattened(&frame), 1);
    assert_true(isinf(frame.deep.samples[0].depth) && frame.deep.samples[0].opacity[1] == 0.5f);
    frame_finish(&frame);
    memset(view.background, 0, sizeof view.background);
    shoot(f->renderer, &f->demo, &view, &frame);
    assert_int_equal(frame.deep.count, 0);
    frame_finish(&frame);
}

/* The samples of a tile are those of the whole there. */
static void a_tile_has_the_samples_of_the_whole(void **state)
{
    struct fixture *f = *state;
    struct view view = look();
    struct frame whole, part;
    shoot(f->renderer, &f->demo, &view, &whole);
    view.tile = (struct view_tile){.x_px = 50, .y_px = 20, .width_px = 40, .height_px = 30};
    shoot(f->renderer, &f->demo, &view, &part);
    assert_int_equal(part.deep.width_px, 40);
    for (int y = 0; y < 30; y++)
        for (int x = 0; x < 40; x++) {
            const struct deep_pixel *a = &whole.deep.pixels[(y + 20) * WIDTH + x + 50];
            const struct deep_pixel *b = &part.deep.pixels[y * 40 + x];
            assert_int_equal(a->count, b->count);
            assert_memory_equal(whole.deep.samples + a->first, part.deep.samples + b->first,
                                a->count * sizeof(struct deep_sample));
        }
    frame_finish(&whole);
    frame_finish(&part);
}

/* Looked down on, panes whose filters leave a third of the light of the floor. */
static void a_thousand_layers_are_as_many_samples(void **state)
{
    struct fixture *f = *state;
    double colors[PANES][4];
    struct closed_form_scene scene;
    struct rig_scene rig;
    struct frame frame;
    for (int i = 0; i < PANES; i++)
        for (int c = 0; c < 4; c++)
            colors[i][c] = c == 3 ? 1 : pow(0.3, (1 + 0.1 * c) / PANES);
    panes_scene_build(&(struct panes_scene_desc){.pane_count = PANES,
                                                 .colors = (const double(*)[4])colors,
                                                 .spacing = 0.01,
                                                 .light = GLB_LIGHT_DIRECTIONAL},
                      &scene);
    rig_scene_open(&rig, f->renderer, "panes", scene.glb, scene.size_bytes);
    const struct view view = {.width_px = 8,
                              .height_px = 8,
                              .wants_deep = true,
                              .camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                         .eye = {0, 14, 0},
                                         .up = {0, 0, -1},
                                         .ortho_height = 0.5},
                              .quality = {.shadows = SHADOWS_DEEP}};
    shoot(f->renderer, &rig, &view, &frame);
    assert_int_equal(expect_flattened(&frame), PANES + 1);
    expect_tidy(&frame.deep);
    frame_finish(&frame);
    rig_scene_finish(&rig, f->renderer);
    closed_form_scene_finish(&scene);
}

static void what_a_deep_image_cannot_hold_is_refused(void **state)
{
    struct fixture *f = *state;
    static const struct {
        struct view_quality quality;
        double haze;
        const char *said;
    } cases[] = {
        {{.shadows = SHADOWS_RAYTRACED, .refraction = VIEW_REFRACTION_OFF}, 0, "ray traced"},
        {{.shadows = SHADOWS_MAP}, 0, "quality.refraction must be off"},
        {{.shadows = SHADOWS_MAP, .refraction = VIEW_REFRACTION_OFF, .samples = 4}, 0, "must be 1"},
        {{.shadows = SHADOWS_MAP, .refraction = VIEW_REFRACTION_OFF}, 0.1, "haze"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct view view = look_at_ball();
        struct frame frame = {0};
        struct error err = {0};
        view.quality = cases[i].quality;
        view.atmosphere.density_per_m = cases[i].haze;
        assert_false(renderer_render(f->renderer, f->demo.key, &view, &frame, &err));
        assert_int_equal(err.code, ERROR_UNSUPPORTED);
        assert_non_null(strstr(err.message, cases[i].said));
        assert_null(frame.deep.pixels);
    }
}

static int setup(void **state)
{
    struct fixture *fixture = calloc(1, sizeof *fixture);
    void *renderer = NULL;
    int result = fixture ? render_rig_setup(&renderer) : -1;
    if (result != 0)
        return result;
    fixture->renderer = renderer;
    rig_demo_open(&fixture->demo, fixture->renderer, "deep", 64);
    *state = fixture;
    return 0;
}

static int teardown(void **state)
{
    struct fixture *fixture = *state;
    void *renderer = fixture->renderer;
    rig_scene_finish(&fixture->demo, fixture->renderer);
    free(fixture);
    return render_rig_teardown(&renderer);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(samples_over_one_another_are_the_picture),
        cmocka_unit_test(media_lie_between_their_surfaces),
        cmocka_unit_test(the_background_is_infinitely_far),
        cmocka_unit_test(a_tile_has_the_samples_of_the_whole),
        cmocka_unit_test(a_thousand_layers_are_as_many_samples),
        cmocka_unit_test(what_a_deep_image_cannot_hold_is_refused),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
