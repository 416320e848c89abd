/* SPDX-License-Identifier: MIT */
/* protocol/provenance.h: the text, its way into the four kinds of files and back. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <jansson.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/provenance.h"
#include "protocol/provenance_file.h"
#include "renderer/image/image.h"

#define SCENE "1111111111111111111111111111111111111111111111111111111111111111"

static const char text[] = "{\"software\":\"Vitrail 0.1.0\",\"request\":{\"width\":3}}";

static struct render_request parse(const char *members)
{
    struct render_request request;
    struct error err = {0};
    char body[512];
    snprintf(body, sizeof body, "{\"scene\":\"" SCENE "\"%s}", members);
    if (!render_request_parse(body, strlen(body), &request, &err))
        fail_msg("%s", err.message);
    return request;
}

static json_t *load(const char *json)
{
    json_error_t where;
    json_t *value = json_loads(json, 0, &where);
    if (!value)
        fail_msg("%s: %s", where.text, json);
    return value;
}

static char *make(const struct render_request *request, const struct frame_stats *stats,
                  const char *version)
{
    return provenance_make(
        &(struct provenance_desc){.request = request, .stats = stats, .version = version});
}

/* ---- the text ---- */

static void the_request_in_the_text_is_the_request(void **state)
{
    (void)state;
    struct frame_stats stats = {.device = "a <card> & more"};
    struct render_request request =
        parse(",\"overrides\":{\"nodes\":{\"<A & B>\\u00e9\":{\"visible\":false}}},"
              "\"exposure_ev\":0.1,\"format\":\"png\"");
    char *made = make(&request, &stats, "1.2.3");
    char *canonical = render_request_to_json(&request);
    assert_non_null(made);
    assert_null(strpbrk(made, "<>&"));
    for (const char *at = made; *at; at++)
        assert_in_range(*at, ' ', '~');
    json_t *found = load(made), *expected = load(canonical);
    assert_true(json_equal(json_object_get(found, "request"), expected));
    assert_string_equal("Vitrail 1.2.3", json_string_value(json_object_get(found, "software")));
    assert_string_equal("a <card> & more", json_string_value(json_object_get(found, "device")));
    assert_string_equal(SCENE, json_string_value(json_object_get(found, "scene")));
    assert_true(json_is_null(json_object_get(found, "error")));
    json_decref(found);
    json_decref(expected);
    free(made);
    free(canonical);
    render_request_finish(&request);
}

static void the_error_is_told(void **state)
{
    (void)state;
    struct frame_stats stats = {.has_error = true,
                                .error_metric = "rmse",
                                .error_value = 0.25,
                                .error_source = FRAME_ERROR_MEASURED};
    struct render_request request = parse("");
    char *made = make(&request, &stats, "1");
    json_t *found = load(made), *error = json_object_get(found, "error");
    assert_true(json_real_value(json_object_get(error, "value")) == 0.25);
    assert_string_equal("measured", json_string_value(json_object_get(error, "source")));
    json_decref(found);
    free(made);
    render_request_finish(&request);
}

/* Of `count` overrides with names that are longer when they are escaped. */
static struct render_request parse_many(int count)
{
    json_t *body = json_object(), *nodes = json_object();
    for (int i = 0; i < count; i++) {
        char name[32];
        snprintf(name, sizeof name, "<&>%d", i);
        json_object_set_new(nodes, name, json_pack("{s:b}", "visible", 0));
    }
    json_object_set_new(body, "scene", json_string(SCENE));
    json_object_set_new(body, "overrides", json_pack("{s:o}", "nodes", nodes));
    char *dumped = json_dumps(body, JSON_COMPACT);
    struct render_request request;
    struct error err = {0};
    if (!render_request_parse(dumped, strlen(dumped), &request, &err))
        fail_msg("%s", err.message);
    free(dumped);
    json_decref(body);
    return request;
}

static void a_request_that_is_too_long_is_left_out_and_its_length_is_told(void **state)
{
    (void)state;
    const struct frame_stats stats = {0};
    int kept = 0, left_out = 0;
    for (int count = 0; count <= 2000; count += 100) {
        struct render_request request = parse_many(count);
        char *made = make(&request, &stats, "1");
        char *canonical = render_request_to_json(&request);
        char packet[PROVENANCE_PACKET_MAX];
        size_t length;
        assert_true(strlen(made) <= PROVENANCE_TEXT_MAX);
        assert_true(provenance_packet(made, packet, &length));
        assert_true(length < 65502);
        json_t *found = load(made), *of_request = json_object_get(found, "request");
        json_t *bytes = json_object_get(found, "request_bytes");
        if (bytes) {
            left_out++;
            assert_true(json_is_null(of_request));
            assert_int_equal(strlen(canonical), json_integer_value(bytes));
        } else {
            kept++;
            assert_int_equal(0, left_out); /* the shorter ones are kept */
            json_t *expected = load(canonical);
            assert_true(json_equal(of_request, expected));
            json_decref(expected);
        }
        json_decref(found);
        free(made);
        free(canonical);
        render_request_finish(&request);
    }
    assert_true(kept > 1 && left_out > 1);
}

/* ---- files ---- */

struct file {
    void *bytes;
    size_t size;
};

static struct file encode(enum image_format format, const char *provenance)
{
    struct image image;
    struct error err = {0};
    struct file file;
    bool is_float = format == IMAGE_FORMAT_EXR;
    assert_true(image_init(&image, 5, 3, 4, is_float ? IMAGE_F32 : IMAGE_U8, &err));
    for (int i = 0; i < 60; i++)
        if (is_float)
            ((float *)image.pixels)[i] = (float)i;
        else
            ((uint8_t *)image.pixels)[i] = (uint8_t)(4 * i);
    const struct image_encode_desc desc = {
        .format = format, .quality = 100, .description = "a picture", .provenance = provenance};
    if (!image_encode(&image, &desc, &file.bytes, &file.size, &err))
        fail_msg("%s", err.message);
    image_finish(&image);
    return file;
}

static void files_of_each_format_hold_it_beside_the_same_pixels(void **state)
{
    (void)state;
    for (int format = 0; format < IMAGE_FORMAT_COUNT; format++) {
        struct file plain = encode((enum image_format)format, NULL);
        struct file with = encode((enum image_format)format, text);
        const char *found;
        size_t length;
        assert_false(provenance_find(plain.bytes, plain.size, &found, &length));
        assert_true(provenance_find(with.bytes, with.size, &found, &length));
        assert_int_equal(sizeof text - 1, length);
        assert_memory_equal(text, found, length);

        struct image a, b;
        struct error err = {0};
        const struct image_decode_desc desc = {.keep_float = true};
        assert_true(image_decode(plain.bytes, plain.size, &desc, &a, &err));
        assert_true(image_decode(with.bytes, with.size, &desc, &b, &err));
        assert_int_equal(image_size_bytes(&a), image_size_bytes(&b));
        assert_memory_equal(a.pixels, b.pixels, image_size_bytes(&a));
        image_finish(&a);
        image_finish(&b);
        free(plain.bytes);
        free(with.bytes);
    }
}

/* A copy of its own for each length, so that a sanitizer sees a read beyond it. */
static void files_that_are_cut_anywhere_give_all_of_it_or_nothing(void **state)
{
    (void)state;
    for (int format = 0; format < IMAGE_FORMAT_COUNT; format++) {
        struct file file = encode((enum image_format)format, text);
        int whole = 0;
        for (size_t size = 0; size <= file.size; size++) {
            char *cut = malloc(size ? size : 1);
            const char *found;
            size_t length;
            assert_non_null(cut);
            memcpy(cut, file.bytes, size);
            if (provenance_find(cut, size, &found, &length)) {
                whole++;
                assert_int_equal(sizeof text - 1, length);
                assert_true(found >= cut && found + length <= cut + size);
            }
            free(cut);
        }
        assert_true(whole > 0 && (size_t)whole < file.size - sizeof text);
        free(file.bytes);
    }
}

static void other_files_have_none(void **state)
{
    (void)state;
    static const char *const others[] = {"", "P", "GIF89a", "\xff\xd8\xff\xe1\x00\x00", "RIFF"};
    const char *found;
    size_t length;
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        assert_false(provenance_find(others[i], strlen(others[i]), &found, &length));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_request_in_the_text_is_the_request),
        cmocka_unit_test(the_error_is_told),
        cmocka_unit_test(a_request_that_is_too_long_is_left_out_and_its_length_is_told),
        cmocka_unit_test(files_of_each_format_hold_it_beside_the_same_pixels),
        cmocka_unit_test(files_that_are_cut_anywhere_give_all_of_it_or_nothing),
        cmocka_unit_test(other_files_have_none),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
