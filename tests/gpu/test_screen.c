/* SPDX-License-Identifier: MIT */
/* The picture as a screen shows it, made on the device: that of the processor, over all radiances,
 * operators and exposures, in pictures of any size, and only where it was asked for. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <epoxy/gl.h>

#include "renderer/shading/screen.h"
#include "tests/support/image_checks.h"

enum { SIDE_PX = 512, WIDE_PX = 4203 /* more than a window's side, and not in fours */ };

static const struct tone_map_desc mappings[] = {
    {.operator_ = TONE_MAPPING_NEUTRAL, .exposure_ev = 0},
    {.operator_ = TONE_MAPPING_NONE, .exposure_ev = 0},
    {.operator_ = TONE_MAPPING_NEUTRAL, .exposure_ev = 2.7f},
    {.operator_ = TONE_MAPPING_NEUTRAL, .exposure_ev = -3.1f},
    {.operator_ = TONE_MAPPING_NEUTRAL, .exposure_ev = 300},
    {.operator_ = TONE_MAPPING_NONE, .exposure_ev = -300},
    {.operator_ = TONE_MAPPING_NONE, .exposure_ev = 40.5f},
    {.operator_ = TONE_MAPPING_AGX, .exposure_ev = 0},
    {.operator_ = TONE_MAPPING_AGX, .exposure_ev = 3.3f},
    {.operator_ = TONE_MAPPING_ACES, .exposure_ev = 0},
    {.operator_ = TONE_MAPPING_ACES, .exposure_ev = -1.7f},
    {.operator_ = TONE_MAPPING_ACES, .exposure_ev = 300},
};
enum { MAPPINGS = sizeof mappings / sizeof mappings[0] };

/* Divisions of a device may be off by 2.5 ulp (OpenGL 4.5, GLSL 4.50 section 4.7.1), so a code may
 * be the one beside it where a radiance lies on a threshold: one of 1e4 values. */
static void expect_same_codes(const uint8_t *device, const struct image *shown, int channels)
{
    const uint8_t *processor = shown->pixels;
    size_t pixels = (size_t)shown->width_px * (size_t)shown->height_px, off = 0;
    for (size_t i = 0; i < pixels; i++)
        for (int c = 0; c < channels; c++) {
            int difference =
                abs(device[i * (size_t)channels + (size_t)c] - processor[4 * i + (size_t)c]);
            if (difference > 1)
                fail_msg("pixel %zu, channel %d: %d on the device, %d on the processor", i, c,
                         device[i * (size_t)channels + (size_t)c], processor[4 * i + (size_t)c]);
            off += (size_t)difference;
        }
    if (off > pixels * (size_t)channels / 10000)
        fail_msg("%zu of %zu values are one off", off, pixels * (size_t)channels);
}

/* ---- the shader alone ---- */

/* What is drawn into, without a renderer. */
struct bench {
    struct gl_context *context;
    struct program_cache *programs;
    struct gl_texture image;
    struct image linear; /* the same, its first row on top */
};

static float from_bits(uint32_t bits)
{
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* Denormal numbers are zero on most devices, and far below the first code. */
static float any_float(uint32_t *seed)
{
    static const uint32_t edges[] = {
        0,           0x80000000u, 0x3f800000u, 0x3f7fffffu, 0x3f800001u, 0x7f7fffffu, 0x7f800000u,
        0xff800000u, 0x7fc00000u, 0xffc00001u, 0x7149f2cau, 0x00800000u, 0x3da3d70au, 0x3f428f5cu};
    *seed = *seed * 1664525u + 1013904223u;
    uint32_t random = *seed >> 8;
    if (random % 11 == 0)
        return from_bits(edges[random / 11 % (sizeof edges / sizeof edges[0])]);
    uint32_t exponent = random % 3 ? 110 + random / 3 % 24 : 1 + random / 3 % 254;
    *seed = *seed * 1664525u + 1013904223u;
    return from_bits(exponent << 23 | *seed >> 9);
}

static void fill(struct image *linear)
{
    float *pixels = linear->pixels;
    uint32_t seed = 1;
    for (size_t i = 0; i < (size_t)SIDE_PX * SIDE_PX; i++) {
        float *p = pixels + 4 * i;
        float grey = any_float(&seed);
        for (int c = 0; c < 3; c++)
            p[c] = i % 3 ? any_float(&seed) : grey * (1 + 0.1f * (float)c);
        p[3] = i % 5 < 2 ? 1 : i % 5 == 2 ? (float)(i % 257) / 256 : any_float(&seed);
    }
}

static void bench_begin(struct bench *bench)
{
    struct error err = {0};
    *bench = (struct bench){
        .context = gl_context_create(&(struct gl_context_desc){.is_strict = true}, &err)};
    if (!bench->context) {
        fprintf(stderr, "skipped: %s\n", err.message);
        exit(77);
    }
    bench->programs = program_cache_create(NULL, &err);
    assert_non_null(bench->programs);
    assert_true(image_init(&bench->linear, SIDE_PX, SIDE_PX, 4, IMAGE_F32, &err));
    fill(&bench->linear);
    assert_true(gl_texture_init(
        &bench->image,
        &(struct gl_texture_desc){
            .label = "test.image", .format = GL_RGBA32F, .width = SIDE_PX, .height = SIDE_PX},
        &err));
    for (int y = 0; y < SIDE_PX; y++)
        glTextureSubImage2D(bench->image.name, 0, 0, SIDE_PX - 1 - y, SIDE_PX, 1, GL_RGBA, GL_FLOAT,
                            (const float *)bench->linear.pixels + (size_t)y * SIDE_PX * 4);
}

static void bench_end(struct bench *bench)
{
    image_finish(&bench->linear);
    gl_texture_finish(&bench->image);
    program_cache_destroy(bench->programs);
    gl_context_destroy(bench->context);
}

/* The mapping of a window of the upper left part of the image. */
static void map_on_device(const struct bench *bench, const struct tone_map_desc *mapping,
                          int channels, uint8_t *out)
{
    struct error err = {0};
    struct screen screen = {.words = {0}};
    struct targets targets = {.image = bench->image};
    const struct view view = {.screen = {.channels = channels, .mapping = *mapping}};
    const struct window_frame frame = {
        .programs = bench->programs,
        .view = &view,
        .window = {0, 0, SIDE_PX, SIDE_PX, SIDE_PX, SIDE_PX},
        .targets = &targets,
    };
    uint64_t bytes = screen_bytes(&frame.window, channels);
    assert_int_equal((uint64_t)SIDE_PX * SIDE_PX * (uint64_t)channels, bytes);
    if (!screen_draw(&screen, &frame, channels, &err))
        fail_msg("%s", err.message);
    gl_buffer_read(&screen.words, 0, bytes, out);
    assert_true(gl_context_check(bench->context, "tone mapping", &err));
    screen_finish(&screen);
}

static void all_radiances_have_the_codes_of_the_processor(void **state)
{
    struct bench bench;
    struct error err = {0};
    uint8_t *out = malloc((size_t)SIDE_PX * SIDE_PX * 4);
    (void)state;
    assert_non_null(out);
    bench_begin(&bench);
    for (int i = 0; i < MAPPINGS; i++) {
        struct image shown;
        assert_true(tone_map(&bench.linear, &mappings[i], &shown, &err));
        for (int channels = 3; channels <= 4; channels++) {
            map_on_device(&bench, &mappings[i], channels, out);
            expect_same_codes(out, &shown, channels);
        }
        image_finish(&shown);
    }
    bench_end(&bench);
    free(out);
}

/* ---- frames ---- */

static struct view demo_view(int width_px, int height_px)
{
    return (struct view){
        .width_px = width_px,
        .height_px = height_px,
        .camera = {.kind = VIEW_CAMERA_LOOK_AT, .eye = {3, 4.5, 3}, .target = {0, 1.5, 0}},
        .background = {0.2f, 0.4f, 0.6f, 0.5f},
        .quality = {.shadow_resolution = 64, .samples = 4}};
}

static struct renderer *begin(struct rig_scene *demo, bool poses)
{
    struct renderer *renderer = render_rig_create_as(
        &(struct renderer_desc){.is_strict = true, .hooks.poses_as_hardware = poses});
    rig_demo_open(demo, renderer, "demo", 64);
    return renderer;
}

/* Draws the view both ways. */
static void expect_same_picture(struct renderer *renderer, const struct rig_scene *demo,
                                struct view view, const struct view_screen *screen)
{
    struct error err = {0};
    struct frame linear, shown;
    struct image expected;
    shoot(renderer, demo, &view, &linear);
    view.screen = *screen;
    shoot(renderer, demo, &view, &shown);
    const struct image *image = &shown.outputs[VIEW_OUTPUT_COLOR];
    assert_int_equal(IMAGE_U8, image->component);
    assert_int_equal(screen->channels, image->channels);
    assert_int_equal(view.width_px, image->width_px);
    assert_int_equal(view.height_px, image->height_px);
    assert_true(tone_map(&linear.outputs[VIEW_OUTPUT_COLOR], &screen->mapping, &expected, &err));
    expect_same_codes(image->pixels, &expected, screen->channels);
    assert_int_equal(linear.report.counts.lookups, shown.report.counts.lookups);
    assert_true(report_bytes_of(&shown.report, "readback") * 3 <
                report_bytes_of(&linear.report, "readback"));
    image_finish(&expected);
    frame_finish(&linear);
    frame_finish(&shown);
}

static void pictures_of_any_size_are_those_of_the_processor(void **state)
{
    static const int sizes[][2] = {{97, 61}, {64, 64}, {WIDE_PX, 9}, {5, WIDE_PX}};
    struct rig_scene demo;
    struct renderer *renderer = begin(&demo, true);
    (void)state;
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++)
        for (int channels = 3; channels <= 4; channels++) {
            const struct view_screen screen = {.channels = channels,
                                               .mapping = mappings[i % MAPPINGS]};
            expect_same_picture(renderer, &demo, demo_view(sizes[i][0], sizes[i][1]), &screen);
        }
    rig_scene_finish(&demo, renderer);
    renderer_destroy(renderer);
}

static enum image_component component_of(struct renderer *renderer, const struct rig_scene *demo,
                                         const struct view *view)
{
    struct frame frame;
    shoot(renderer, demo, view, &frame);
    enum image_component component = frame.outputs[VIEW_OUTPUT_COLOR].component;
    frame_finish(&frame);
    return component;
}

/* Rays, and what is drawn over the picture, are on the processor. */
static void what_is_not_ready_on_the_device_stays_linear(void **state)
{
    struct rig_scene demo;
    struct renderer *renderer = begin(&demo, true);
    struct view view = demo_view(64, 48);
    (void)state;
    view.screen = (struct view_screen){.channels = 4};
    assert_int_equal(IMAGE_U8, component_of(renderer, &demo, &view));
    view.edges.is_drawn = true;
    view.edges.width_px = 1;
    assert_int_equal(IMAGE_F32, component_of(renderer, &demo, &view));
    view.edges.is_drawn = false;
    view.quality.shadows = SHADOWS_RAYTRACED;
    assert_int_equal(IMAGE_F32, component_of(renderer, &demo, &view));
    rig_scene_finish(&demo, renderer);
    renderer_destroy(renderer);
}

static void a_software_rasteriser_leaves_it_to_the_encoder(void **state)
{
    struct rig_scene demo;
    struct renderer *renderer = begin(&demo, false);
    struct renderer_info info;
    struct view view = demo_view(64, 48);
    (void)state;
    view.screen = (struct view_screen){.channels = 4};
    renderer_get_info(renderer, &info);
    assert_int_equal(info.is_software ? IMAGE_F32 : IMAGE_U8, component_of(renderer, &demo, &view));
    rig_scene_finish(&demo, renderer);
    renderer_destroy(renderer);
}

static void an_exposure_that_is_no_number_is_refused(void **state)
{
    struct rig_scene demo;
    struct renderer *renderer = begin(&demo, true);
    struct view view = demo_view(64, 48);
    struct frame frame;
    struct error err = {0};
    (void)state;
    view.screen = (struct view_screen){.channels = 4, .mapping = {.exposure_ev = from_bits(~0u)}};
    assert_false(renderer_render(renderer, demo.key, &view, &frame, &err));
    assert_int_equal(ERROR_INVALID_REQUEST, err.code);
    rig_scene_finish(&demo, renderer);
    renderer_destroy(renderer);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_radiances_have_the_codes_of_the_processor),
        cmocka_unit_test(pictures_of_any_size_are_those_of_the_processor),
        cmocka_unit_test(what_is_not_ready_on_the_device_stays_linear),
        cmocka_unit_test(a_software_rasteriser_leaves_it_to_the_encoder),
        cmocka_unit_test(an_exposure_that_is_no_number_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
