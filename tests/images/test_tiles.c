/* SPDX-License-Identifier: MIT */
/* Tiles of a picture have the bits that the whole has there: all outputs, every way of shadows, by
 * cameras with and without perspective; and of pictures larger than any device draws at once, each
 * pixel of a tile is on the ray of the whole. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/image_checks.h"

static const struct view_tile tiles[] = {
    {0, 0, 31, 17}, {31, 0, 65, 17}, {5, 9, 1, 1}, {17, 17, 60, 47}, {95, 63, 1, 1}};

/* Each view of 96x64 pixels. */
static struct view small_view(enum shadow_technique shadows)
{
    return (struct view){.width_px = 96,
                         .height_px = 64,
                         .quality = {.shadows = shadows, .shadow_resolution = 64, .samples = 4}};
}

static size_t pixel_bytes(const struct image *image)
{
    return image_size_bytes(image) / (size_t)image->width_px / (size_t)image->height_px;
}

/* Every output of the tile against that part of the whole. */
static void assert_is_cut_from(const struct frame *tile, const struct view_tile *at,
                               const struct frame *whole)
{
    for (int output = 0; output < VIEW_OUTPUT_COUNT; output++) {
        const struct image *a = &tile->outputs[output], *b = &whole->outputs[output];
        assert_int_equal(!a->pixels, !b->pixels);
        if (!a->pixels)
            continue;
        size_t bytes = pixel_bytes(b), row = (size_t)at->width_px * bytes;
        assert_int_equal(a->width_px, at->width_px);
        assert_int_equal(a->height_px, at->height_px);
        assert_int_equal(pixel_bytes(a), bytes);
        for (int y = 0; y < at->height_px; y++) {
            const char *in_a = (const char *)a->pixels + (size_t)y * row;
            const char *in_b =
                (const char *)b->pixels +
                ((size_t)(at->y_px + y) * (size_t)b->width_px + (size_t)at->x_px) * bytes;
            if (memcmp(in_a, in_b, row) != 0)
                fail_msg("output %d, row %d of the tile at %d, %d", output, y, at->x_px, at->y_px);
        }
    }
}

static void compare(struct renderer *renderer, const struct rig_scene *scene,
                    const struct view *view, const struct view_tile *at, size_t count)
{
    struct frame whole, part;
    shoot(renderer, scene, view, &whole);
    for (size_t i = 0; i < count; i++) {
        struct view own = *view;
        own.tile = at[i];
        shoot(renderer, scene, &own, &part);
        assert_is_cut_from(&part, &at[i], &whole);
        frame_finish(&part);
    }
    frame_finish(&whole);
}

static void tiles_have_the_bits_of_the_whole(void **state)
{
    static const enum shadow_technique shadows[] = {SHADOWS_DEEP, SHADOWS_MAP, SHADOWS_RAYTRACED,
                                                    SHADOWS_RAYTRACED_SHADOWS};
    static const struct view_camera cameras[] = {
        {.kind = VIEW_CAMERA_DEFAULT},
        {.kind = VIEW_CAMERA_FIT, .fit = VIEW_FIT_THREE_QUARTER},
        {.kind = VIEW_CAMERA_FIT, .fit = VIEW_FIT_TOP, .is_orthographic = true},
        {.kind = VIEW_CAMERA_LOOK_AT, .eye = {3, 2, 4}, .target = {0, 1, 0}, .ortho_height = 2},
    };
    struct rig_scene scene;
    rig_demo_open(&scene, *state, "demo", 128);
    for (size_t s = 0; s < sizeof shadows / sizeof *shadows; s++)
        for (size_t c = 0; c < sizeof cameras / sizeof *cameras; c++) {
            struct view view = small_view(shadows[s]);
            view.camera = cameras[c];
            compare(*state, &scene, &view, tiles, sizeof tiles / sizeof *tiles);
        }
    rig_scene_finish(&scene, *state);
}

static void other_outputs_reference_and_rounds_have_them_too(void **state)
{
    struct rig_scene scene;
    rig_demo_open(&scene, *state, "demo", 128);
    struct view view = small_view(SHADOWS_DEEP);
    view.outputs = (1u << VIEW_OUTPUT_COUNT) - 1;
    compare(*state, &scene, &view, tiles, sizeof tiles / sizeof *tiles);
    view.outputs = 0;
    view.quality.samples = 16;
    compare(*state, &scene, &view, &tiles[3], 1);
    view = small_view(SHADOWS_RAYTRACED);
    view.quality.samples = 1;
    view.quality.reference = true;
    view.width_px = 48;
    view.height_px = 32;
    compare(*state, &scene, &view, tiles, 1);
    rig_scene_finish(&scene, *state);
}

/* Lines and outlines over the seams of tiles, in pictures by rasters and by rays. */
static void overlays_have_them_too(void **state)
{
    static const struct view_tile through[] = {{34, 16, 9, 32}, {0, 20, 23, 24}, {43, 46, 4, 2}};
    static const char *const nodes[] = {"Vessel", "Altar", "Crimson curtain"};
    struct rig_scene scene;
    rig_demo_open(&scene, *state, "demo", 128);
    for (int traced = 0; traced < 2; traced++) {
        struct view view = small_view(traced ? SHADOWS_RAYTRACED : SHADOWS_MAP);
        view.edges = (struct view_edges){
            .is_drawn = true, .crease_deg = 30, .width_px = 2.5f, .color = {1}, .hidden = 0.4f};
        view.highlight = (struct view_highlight){
            .nodes = nodes, .node_count = 3, .width_px = 4.5f, .color = {0, 1}, .hidden = 0.3f};
        compare(*state, &scene, &view, through, sizeof through / sizeof *through);
    }
    rig_scene_finish(&scene, *state);
}

/* Wider than a window is: the tile over the seam is drawn from both. */
static void tiles_over_seams_of_windows_have_them_too(void **state)
{
    static const struct view_tile over[] = {{2080, 10, 60, 20}, {4100, 0, 100, 40}};
    struct rig_scene scene;
    rig_demo_open(&scene, *state, "demo", 128);
    struct view view = small_view(SHADOWS_DEEP);
    view.width_px = 4200;
    view.height_px = 40;
    view.quality.samples = 1;
    view.outputs = 1u << VIEW_OUTPUT_COLOR | 1u << VIEW_OUTPUT_DEPTH;
    compare(*state, &scene, &view, over, 2);
    rig_scene_finish(&scene, *state);
}

/* Positions that a tile of a huge picture shows lie on the rays of the whole. */
static void pixels_of_huge_pictures_are_on_their_rays(void **state)
{
    static const struct view_tile at[] = {{30000, 20000, 40, 30}, {40000, 33000, 40, 30}};
    struct rig_scene scene;
    rig_demo_open(&scene, *state, "demo", 128);
    for (int flat = 0; flat < 2; flat++)
        for (size_t i = 0; i < sizeof at / sizeof *at; i++) {
            struct view view = small_view(SHADOWS_MAP);
            view.width_px = 65536;
            view.height_px = 40000;
            view.quality.samples = 1;
            view.outputs = 1u << VIEW_OUTPUT_POSITION;
            view.tile = at[i];
            view.camera = (struct view_camera){.kind = VIEW_CAMERA_LOOK_AT,
                                               .eye = {0, 6, 0.01},
                                               .target = {0, 0, 0},
                                               .up = {0, 0, -1},
                                               .ortho_height = flat ? 3 : 0};
            struct frame frame;
            shoot(*state, &scene, &view, &frame);
            const struct image *positions = &frame.outputs[VIEW_OUTPUT_POSITION];
            size_t found = 0;
            for (int y = 0; y < 30; y++)
                for (int x = 0; x < 40; x++) {
                    const float *p = image_pixel_f32(positions, x, y);
                    const double world[3] = {p[0], p[1], p[2]};
                    double pixel[2];
                    if (!isfinite(p[0]) || !view_project(&view, world, pixel))
                        continue;
                    found++;
                    assert_true(fabs(pixel[0] - (at[i].x_px + x + 0.5)) < 0.1);
                    assert_true(fabs(pixel[1] - (at[i].y_px + y + 0.5)) < 0.1);
                }
            assert_true(found > 100);
            frame_finish(&frame);
        }
    rig_scene_finish(&scene, *state);
}

/* The exposure that is metered is that of the whole, so that tiles match. */
static void bad_tiles_are_refused(void **state)
{
    static const struct view_tile bad[] = {
        {-1, 0, 8, 8}, {0, 0, 8, 0}, {90, 0, 8, 8}, {0, 60, 8, 8}, {0, 0, 97, 64}};
    struct rig_scene scene;
    rig_demo_open(&scene, *state, "demo", 128);
    struct view view = small_view(SHADOWS_MAP);
    struct frame frame;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct error err = {0};
        view.tile = bad[i];
        assert_false(renderer_render(*state, scene.key, &view, &frame, &err));
        assert_int_equal(err.code, ERROR_INVALID_REQUEST);
        frame_finish(&frame);
    }
    struct error err = {0};
    view.tile = tiles[0];
    view.row_count_px = 1;
    assert_false(renderer_render(*state, scene.key, &view, &frame, &err));
    assert_int_equal(err.code, ERROR_UNSUPPORTED);
    frame_finish(&frame);
    rig_scene_finish(&scene, *state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tiles_have_the_bits_of_the_whole),
        cmocka_unit_test(other_outputs_reference_and_rounds_have_them_too),
        cmocka_unit_test(overlays_have_them_too),
        cmocka_unit_test(tiles_over_seams_of_windows_have_them_too),
        cmocka_unit_test(pixels_of_huge_pictures_are_on_their_rays),
        cmocka_unit_test(bad_tiles_are_refused),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
