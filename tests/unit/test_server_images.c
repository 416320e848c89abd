/* SPDX-License-Identifier: MIT */
/* Outputs as images: which formats hold which outputs, and what is in them. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/mapping/format_mapping.h"
#include "server/worker/frame_image.h"

/* A frame of 2 by 1 pixels with every output. */
static void make_frame(struct frame *frame)
{
    static const int channels[VIEW_OUTPUT_COUNT] = {4, 1, 3, 3, 1, 1, 3, 3, 1, 1, 3};
    struct error err = {0};
    memset(frame, 0, sizeof *frame);
    for (int i = 0; i < VIEW_OUTPUT_COUNT; i++) {
        bool is_id = i == VIEW_OUTPUT_NODE || i == VIEW_OUTPUT_MATERIAL ||
                     i == VIEW_OUTPUT_LIGHTS || i == VIEW_OUTPUT_LAYERS;
        assert_true(
            image_init(&frame->outputs[i], 2, 1, channels[i], is_id ? IMAGE_U32 : IMAGE_F32, &err));
        for (int k = 0; k < 2 * channels[i]; k++)
            if (is_id)
                ((uint32_t *)frame->outputs[i].pixels)[k] = (uint32_t)(k ? 65535 : 0);
            else
                ((float *)frame->outputs[i].pixels)[k] = 0.25f * (float)(k + 1);
    }
    ((float *)frame->outputs[VIEW_OUTPUT_DEPTH].pixels)[1] = INFINITY;
    ((float *)frame->outputs[VIEW_OUTPUT_OPTICAL_DEPTH].pixels)[3] = INFINITY;
    ((float *)frame->outputs[VIEW_OUTPUT_OPTICAL_DEPTH].pixels)[4] = 0;
    memset(frame->outputs[VIEW_OUTPUT_NORMAL].pixels, 0, 3 * sizeof(float));
}

static void finish_frame(struct frame *frame)
{
    for (int i = 0; i < VIEW_OUTPUT_COUNT; i++)
        image_finish(&frame->outputs[i]);
}

static void make_image(struct image *image, uint32_t outputs, enum image_format format)
{
    struct frame frame;
    struct error err = {0};
    struct render_request request;
    render_request_init_defaults(&request);
    request.outputs = outputs;
    make_frame(&frame);
    *image = (struct image){0};
    if (!frame_image_init(image, &frame, &request, format, &err))
        fail_msg("%s", err.message);
    finish_frame(&frame);
    render_request_finish(&request);
}

/* Whose alpha is not that of tone mapping. */
static void a_picture_that_was_mapped_on_the_device_is_taken_as_it_is(void **state)
{
    (void)state;
    for (int channels = 3; channels <= 4; channels++) {
        struct frame frame = {.outputs[VIEW_OUTPUT_COLOR] = {0}};
        struct image image, *color = &frame.outputs[VIEW_OUTPUT_COLOR];
        struct render_request request;
        struct error err = {0};
        render_request_init_defaults(&request);
        request.outputs = 1u << VIEW_OUTPUT_COLOR;
        request.exposure_ev = 3;
        assert_true(image_init(color, 2, 1, channels, IMAGE_U8, &err));
        for (int i = 0; i < 2 * channels; i++)
            ((uint8_t *)color->pixels)[i] = (uint8_t)(10 * i);
        const void *pixels = color->pixels;
        assert_true(frame_image_init(&image, &frame, &request, IMAGE_FORMAT_JPEG, &err));
        assert_ptr_equal(pixels, image.pixels);
        assert_int_equal(channels, image.channels);
        assert_null(color->pixels);
        image_finish(&image);
        render_request_finish(&request);
    }
}

static void several_outputs_share_one_exr_with_named_channels(void **state)
{
    (void)state;
    static const char *const names[] = {"R",
                                        "G",
                                        "B",
                                        "A",
                                        "Z",
                                        "normal.X",
                                        "normal.Y",
                                        "normal.Z",
                                        "albedo.R",
                                        "albedo.G",
                                        "albedo.B",
                                        "node.id",
                                        "material.id",
                                        "position.X",
                                        "position.Y",
                                        "position.Z",
                                        "transmittance.R",
                                        "transmittance.G",
                                        "transmittance.B",
                                        "lights.count",
                                        "layers.count",
                                        "optical_depth.R",
                                        "optical_depth.G",
                                        "optical_depth.B"};
    struct image image;
    make_image(&image, (1u << VIEW_OUTPUT_COUNT) - 1, IMAGE_FORMAT_EXR);
    assert_int_equal(24, image.channels);
    assert_int_equal(IMAGE_F32, image.component);
    for (int i = 0; i < 24; i++)
        assert_string_equal(names[i], image.channel_names[i]);
    const float *second = (const float *)image.pixels + 24;
    assert_true(second[0] == 1.25f && second[3] == 2.f && isinf(second[4]));
    assert_true(second[11] == 65535.f && second[12] == 65535.f);
    image_finish(&image);
}

static void ids_want_a_lossless_format_and_keep_every_bit(void **state)
{
    (void)state;
    struct image image;
    assert_int_equal(1u << IMAGE_FORMAT_PNG | 1u << IMAGE_FORMAT_EXR,
                     frame_image_formats(1u << VIEW_OUTPUT_NODE));
    assert_int_equal(1u << IMAGE_FORMAT_EXR, frame_image_formats(3));
    assert_int_equal(15, frame_image_formats(1u << VIEW_OUTPUT_NORMAL));
    assert_int_equal(1u << IMAGE_FORMAT_EXR, frame_image_formats(1u << VIEW_OUTPUT_POSITION));
    make_image(&image, 1u << VIEW_OUTPUT_MATERIAL, IMAGE_FORMAT_PNG);
    assert_int_equal(IMAGE_U16, image.component);
    assert_int_equal(65535, ((uint16_t *)image.pixels)[1]);
    image_finish(&image);
    make_image(&image, 1u << VIEW_OUTPUT_NODE, IMAGE_FORMAT_EXR);
    assert_int_equal(IMAGE_U32, image.component);
    image_finish(&image);
}

static void an_id_that_png_cannot_hold_is_refused(void **state)
{
    (void)state;
    struct frame frame;
    struct image image = {0};
    struct error err = {0};
    struct render_request request;
    render_request_init_defaults(&request);
    request.outputs = 1u << VIEW_OUTPUT_NODE;
    make_frame(&frame);
    ((uint32_t *)frame.outputs[VIEW_OUTPUT_NODE].pixels)[0] = 65536;
    assert_false(frame_image_init(&image, &frame, &request, IMAGE_FORMAT_PNG, &err));
    assert_int_equal(ERROR_UNSUPPORTED, err.code);
    finish_frame(&frame);
    render_request_finish(&request);
}

static void depth_and_normals_are_shown_in_range(void **state)
{
    (void)state;
    struct image image;
    make_image(&image, 1u << VIEW_OUTPUT_DEPTH, IMAGE_FORMAT_PNG);
    assert_int_equal(65535, ((uint16_t *)image.pixels)[0]);
    assert_int_equal(0, ((uint16_t *)image.pixels)[1]);
    image_finish(&image);
    make_image(&image, 1u << VIEW_OUTPUT_DEPTH, IMAGE_FORMAT_JPEG);
    assert_memory_equal("\xff\xff\xff\0\0\0", image.pixels, 6);
    image_finish(&image);
    make_image(&image, 1u << VIEW_OUTPUT_NORMAL, IMAGE_FORMAT_PNG);
    assert_memory_equal("\0\0\0\xff\xff\xff", image.pixels, 6);
    image_finish(&image);
    make_image(&image, 1u << VIEW_OUTPUT_ALBEDO, IMAGE_FORMAT_WEBP);
    assert_int_equal(4, image.channels);
    assert_int_equal(255, ((uint8_t *)image.pixels)[3]);
    image_finish(&image);
}

/* In sRGB: where nothing is in the way it is black, and where all is lost white. */
static void an_optical_depth_is_shown_as_what_it_takes_away(void **state)
{
    (void)state;
    struct image image;
    make_image(&image, 1u << VIEW_OUTPUT_OPTICAL_DEPTH, IMAGE_FORMAT_PNG);
    const uint8_t *shown = image.pixels;
    assert_int_equal(4, image.channels);
    for (int k = 0; k < 3; k++) {
        double lost = 1 - exp(-0.25 * (k + 1));
        double code = 255 * (1.055 * pow(lost, 1 / 2.4) - 0.055);
        assert_true(fabs(shown[k] - code) <= 1);
    }
    assert_int_equal(255, shown[4]);
    assert_int_equal(0, shown[5]);
    image_finish(&image);
}

static void every_output_encodes_in_every_format_that_holds_it(void **state)
{
    (void)state;
    for (uint32_t outputs = 1; outputs < 1u << VIEW_OUTPUT_COUNT; outputs++)
        for (int format = 0; format < IMAGE_FORMAT_COUNT; format++) {
            if (!(frame_image_formats(outputs) & 1u << format))
                continue;
            struct image image;
            struct error err = {0};
            void *bytes = NULL;
            size_t size_bytes;
            make_image(&image, outputs, (enum image_format)format);
            if (!image_encode(&image,
                              &(struct image_encode_desc){.format = (enum image_format)format},
                              &bytes, &size_bytes, &err))
                fail_msg("outputs %x in %s: %s", outputs,
                         image_format_name((enum image_format)format), err.message);
            free(bytes);
            image_finish(&image);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_picture_that_was_mapped_on_the_device_is_taken_as_it_is),
        cmocka_unit_test(several_outputs_share_one_exr_with_named_channels),
        cmocka_unit_test(ids_want_a_lossless_format_and_keep_every_bit),
        cmocka_unit_test(an_id_that_png_cannot_hold_is_refused),
        cmocka_unit_test(depth_and_normals_are_shown_in_range),
        cmocka_unit_test(an_optical_depth_is_shown_as_what_it_takes_away),
        cmocka_unit_test(every_output_encodes_in_every_format_that_holds_it),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
