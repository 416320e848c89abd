/* SPDX-License-Identifier: MIT */
/* Pictures of many layers are the same in whatever numbers the layers are added up, and whether the
 * samples of a pixel walk them together or in turn. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/closed_form_media.h"
#include "tests/support/image_checks.h"

enum { PICTURES = 4 };

struct album {
    struct image color[PICTURES], through[PICTURES];
};

/* Media that overlap, within coloured surfaces, with the eye in one of them. */
static const struct closed_form_body bodies[] = {
    {.shape = BODY_BOX,
     .low = {-1, 0, -1},
     .high = {1, 1.5, 1},
     .remains = {0.5f, 0.7f, 0.9f},
     .distance = 1,
     .filter = {0.9f, 0.6f, 0.8f}},
    {.shape = BODY_SPHERE,
     .low = {-0.5, 0.2, -0.8},
     .high = {0.6, 1.3, 0.3},
     .remains = {0.9f, 0.4f, 0.6f},
     .distance = 0.5f,
     .filter = {0.7f, 0.9f, 1}},
    {.shape = BODY_BOX,
     .low = {-0.2, 0.1, -0.3},
     .high = {1.7, 0.9, 1.9},
     .remains = {0.8f, 0.8f, 0.3f},
     .distance = 0.7f,
     .filter = {1, 0.8f, 0.7f}},
    {.shape = BODY_BOX, .low = {-3, -0.5, -3}, .high = {3, 0, 3}, .remains = {1, 1, 1}},
};

static void take(struct renderer *renderer, const struct rig_scene *scene, struct view view,
                 struct album *album, int index)
{
    struct frame frame;
    view.width_px = 120;
    view.height_px = 90;
    view.outputs = 1u << VIEW_OUTPUT_COLOR | 1u << VIEW_OUTPUT_TRANSMITTANCE;
    shoot(renderer, scene, &view, &frame);
    album->color[index] = frame.outputs[VIEW_OUTPUT_COLOR];
    album->through[index] = frame.outputs[VIEW_OUTPUT_TRANSMITTANCE];
    frame.outputs[VIEW_OUTPUT_COLOR] = frame.outputs[VIEW_OUTPUT_TRANSMITTANCE] = (struct image){0};
    frame_finish(&frame);
}

static struct album take_all(const struct renderer_desc *desc)
{
    struct album album;
    struct rig_scene demo, media;
    struct closed_form_scene built;
    const struct media_scene_desc media_desc = {.bodies = bodies, .count = 4};
    const struct view_light sun = {.type = SCENE_LIGHT_DIRECTIONAL,
                                   .direction = {0.3, -1, -0.2},
                                   .color = {1, 1, 1},
                                   .intensity = 2};
    struct view inside = {.camera = {.kind = VIEW_CAMERA_LOOK_AT,
                                     .eye = {1.5, 0.6, 1.7},
                                     .target = {-0.2, 0.4, -0.2},
                                     .fov_y_deg = 60},
                          .background = {0.2f, 0.3f, 0.4f, 0.5f},
                          .ignore_scene_lights = true,
                          .lights = &sun,
                          .light_count = 1};
    struct renderer *renderer = render_rig_create_as(desc);
    rig_demo_open(&demo, renderer, "demo", 128);
    struct view nave = {.quality = {.samples = 4, .shadows = SHADOWS_NONE}};
    take(renderer, &demo, nave, &album, 0);
    nave.quality.samples = 1;
    take(renderer, &demo, nave, &album, 1);
    media_scene_build(&media_desc, &built);
    rig_scene_open(&media, renderer, "media", built.glb, built.size_bytes);
    inside.quality.samples = 4;
    take(renderer, &media, inside, &album, 2);
    inside.quality.samples = 1;
    take(renderer, &media, inside, &album, 3);
    closed_form_scene_finish(&built);
    rig_scene_finish(&media, renderer);
    rig_scene_finish(&demo, renderer);
    renderer_destroy(renderer);
    return album;
}

static void album_finish(struct album *album)
{
    for (int i = 0; i < PICTURES; i++) {
        image_finish(&album->color[i]);
        image_finish(&album->through[i]);
    }
}

/* Bits, or where they differ what one step of f32 makes of an optical depth of eight: exp is asked
 * for e^-tau, and takes tau log2(e). */
static void compare(const struct album *a, const struct album *b, bool has_same_bits)
{
    const double relative = 4e-6;
    for (int i = 0; i < PICTURES; i++) {
        if (has_same_bits) {
            assert_same_bits(&a->color[i], &b->color[i]);
            assert_same_bits(&a->through[i], &b->through[i]);
        } else {
            assert_images_close(&a->color[i], &b->color[i], 1e-4, relative);
            assert_images_close(&a->through[i], &b->through[i], 1e-4, relative);
        }
    }
}

static struct album together[WIDE_FLOATS_COUNT], in_turn[WIDE_FLOATS_COUNT];
static const enum wide_floats forms[] = {WIDE_FLOATS_F64, WIDE_FLOATS_PAIRS_SPLIT};

static int take_albums(void **unused)
{
    (void)unused;
    for (int i = 0; i < 2; i++) {
        struct renderer_desc desc = {.is_strict = true, .hooks.wide_floats = forms[i]};
        together[forms[i]] = take_all(&desc);
        desc.hooks.poses_as_hardware = true;
        in_turn[forms[i]] = take_all(&desc);
    }
    return 0;
}

static int finish_albums(void **unused)
{
    (void)unused;
    for (int i = 0; i < 2; i++) {
        album_finish(&together[forms[i]]);
        album_finish(&in_turn[forms[i]]);
    }
    return 0;
}

static void samples_in_turn_give_the_bits_of_samples_together(void **unused)
{
    (void)unused;
    for (int i = 0; i < 2; i++)
        compare(&together[forms[i]], &in_turn[forms[i]], true);
}

static void pairs_give_the_picture_of_f64(void **unused)
{
    (void)unused;
    const struct album *f64 = &together[WIDE_FLOATS_F64];
    double mean[3];
    image_mean(&f64->through[2], (double[]){0, 0, 1, 1}, mean);
    assert_true(mean[0] > 0.01 && mean[0] < 0.9); /* layers are there */
    compare(f64, &together[WIDE_FLOATS_PAIRS_SPLIT], false);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(samples_in_turn_give_the_bits_of_samples_together),
        cmocka_unit_test(pairs_give_the_picture_of_f64),
    };
    return cmocka_run_group_tests(tests, take_albums, finish_albums);
}
