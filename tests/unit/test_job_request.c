/* SPDX-License-Identifier: MIT */
/* Lists of frames, requests of jobs, and ranges of files. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "protocol/job_request.h"
#include "server/http/http_range.h"

#define SCENE "\"scene\":\"0123456789012345678901234567890123456789012345678901234567890123\""

static struct frame_list parse_frames(const char *text)
{
    struct frame_list list;
    struct error err = {0};
    if (!frame_list_parse(text, 1000, &list, &err))
        fail_msg("'%s': %s", text, err.message);
    return list;
}

static void frames_are_those_that_are_listed_in_their_order(void **state)
{
    static const int expected[] = {7, 1, 2, 3, 120, 122, 124, 0};
    struct frame_list list = parse_frames("7, 1-3 ,120-125x2,0");
    (void)state;
    assert_int_equal(list.count, 8);
    assert_memory_equal(list.numbers, expected, sizeof expected);
    frame_list_finish(&list);
    list = parse_frames("99999999-99999999x99999999");
    assert_int_equal(list.count, 1);
    frame_list_finish(&list);
}

static void lists_that_are_none_name_what_is_wrong(void **state)
{
    static const struct {
        const char *text, *words;
        enum error_code code;
    } bad[] = {
        {"", "no frame", ERROR_INVALID_REQUEST},
        {" ", "no frame", ERROR_INVALID_REQUEST},
        {"1,", "''", ERROR_INVALID_REQUEST},
        {",1", "no frame", ERROR_INVALID_REQUEST},
        {"1 2", "no comma", ERROR_INVALID_REQUEST},
        {"-1", "'-1'", ERROR_INVALID_REQUEST},
        {"1-", "'1-'", ERROR_INVALID_REQUEST},
        {"1-2x", "'1-2x'", ERROR_INVALID_REQUEST},
        {"1-2x0", "'1-2x0'", ERROR_INVALID_REQUEST},
        {"1x2", "'1x2'", ERROR_INVALID_REQUEST},
        {"1.5", "'1.5'", ERROR_INVALID_REQUEST},
        {"100000000", "no frame", ERROR_INVALID_REQUEST},
        {"1-99999999999999999999", "no frame", ERROR_INVALID_REQUEST},
        {"5-4", "ends before", ERROR_INVALID_REQUEST},
        {"3,1-5", "frame 3 is listed twice", ERROR_INVALID_REQUEST},
        {"1-1001", "more than 1000", ERROR_TOO_LARGE},
        {"0-99999999,0-99999999", "more than 1000", ERROR_TOO_LARGE},
    };
    (void)state;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct frame_list list;
        struct error err = {0};
        assert_false(frame_list_parse(bad[i].text, 1000, &list, &err));
        assert_null(list.numbers);
        assert_int_equal(err.code, bad[i].code);
        if (!strstr(err.message, bad[i].words))
            fail_msg("'%s': '%s' does not say '%s'", bad[i].text, err.message, bad[i].words);
    }
    char text[FRAME_LIST_TEXT_BYTES + 1];
    memset(text, '1', sizeof text);
    text[FRAME_LIST_TEXT_BYTES] = '\0';
    struct frame_list list;
    struct error err = {0};
    assert_false(frame_list_parse(text, 1000, &list, &err));
    assert_int_equal(err.code, ERROR_TOO_LARGE);
}

static struct job_request parse(const char *json)
{
    struct job_request request;
    struct error err = {0};
    if (!job_request_parse(json, strlen(json), &request, &err))
        fail_msg("%s: %s", json, err.message);
    return request;
}

static void a_request_written_and_read_is_the_same(void **state)
{
    static const char *const texts[] = {
        "{" SCENE "}",
        "{" SCENE ",\"frames\":\"1-10x3\",\"frame_rate\":23.976,\"name\":\"Shot \\u00fc\","
        "\"view\":{\"width\":7,\"animation\":{\"time_s\":2}},\"priority\":0,\"attempts\":10,"
        "\"frame_timeout_s\":5,\"paused\":true,\"directory\":\"a/b\",\"turntable\":{\"turns\":-1},"
        "\"outputs\":[\"depth\",{\"file\":\"b.%d.exr\",\"outputs\":[\"normal\",\"color\"]},"
        "{\"name\":\"c\",\"format\":\"jpeg\",\"quality_percent\":3}]}",
        "{" SCENE ",\"outputs\":[{\"file\":\"b.%d.exr\",\"format\":\"exr-deep\"}]}",
        "{" SCENE ",\"view\":{\"width\":65536,\"height\":30000},\"tiles\":2048}",
        "{" SCENE ",\"frames\":\"1-10\",\"camera_path\":{\"interpolation\":\"linear\",\"keys\":["
        "{\"time_s\":0.1,\"eye\":[0,0.3,4],\"target\":[0,0,0],\"up\":[0,3,0.7],\"ortho_height\":2},"
        "{\"time_s\":0.7,\"eye\":[3,1,4],\"target\":[0,0,0],\"ortho_height\":1}],"
        "\"closed\":{\"time_s\":1.1}}}",
    };
    (void)state;
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        struct job_request request = parse(texts[i]);
        json_t *first = job_request_to_json(&request);
        char *text = json_dumps(first, JSON_COMPACT | JSON_REAL_PRECISION(17));
        struct job_request again = parse(text);
        json_t *second = job_request_to_json(&again);
        assert_true(json_equal(first, second));
        assert_int_equal(again.output_count, request.output_count);
        assert_int_equal(again.frames.count, request.frames.count);
        json_decref(first);
        json_decref(second);
        free(text);
        job_request_finish(&request);
        job_request_finish(&again);
    }
}

static void one_frame_is_a_still_and_a_list_is_animated(void **state)
{
    struct job_request request = parse("{" SCENE "}");
    (void)state;
    assert_true(request.is_still);
    assert_int_equal(request.frames.count, 1);
    assert_int_equal(request.attempts, 3);
    job_request_finish(&request);
    request = parse("{" SCENE ",\"frames\":5}");
    assert_false(request.is_still);
    assert_int_equal(request.frames.numbers[0], 5);
    job_request_finish(&request);
}

static void jobs_to_wait_for_are_ids_that_are_named_once(void **state)
{
    static const char id[] = "0123456789abcdef";
    struct job_request request = parse("{" SCENE ",\"after\":[\"0123456789abcdef\"],"
                                       "\"after_failure\":\"wait\"}");
    (void)state;
    assert_int_equal(request.after_count, 1);
    assert_string_equal(request.after[0], id);
    assert_int_equal(request.after_failure, JOB_AFTER_FAILURE_WAIT);
    json_t *written = job_request_to_json(&request);
    assert_string_equal(json_string_value(json_array_get(json_object_get(written, "after"), 0)),
                        id);
    json_decref(written);
    job_request_finish(&request);
    request = parse("{" SCENE ",\"after\":[]}");
    assert_int_equal(request.after_count, 0);
    job_request_finish(&request);
}

static void files_are_named_by_pattern_and_never_alike(void **state)
{
    struct error err = {0};
    char name[JOB_FILE_BYTES];
    struct job_request request =
        parse("{" SCENE ",\"outputs\":[{\"name\":\"a\",\"format\":\"png\"},"
              "{\"name\":\"b\",\"file\":\"shot_%d_x.exr\"}]}");
    (void)state;
    assert_true(job_request_name_files(&request, &err));
    job_file_name(&request.outputs[0], 7, name);
    assert_string_equal(name, "a.0007.png");
    job_file_name(&request.outputs[0], 12345, name);
    assert_string_equal(name, "a.12345.png");
    job_file_name(&request.outputs[1], 7, name);
    assert_string_equal(name, "shot_7_x.exr");
    job_request_finish(&request);
    request = parse("{" SCENE ",\"outputs\":[{\"name\":\"a\",\"format\":\"png\"},"
                    "{\"name\":\"b\",\"file\":\"a.%d.png\"}]}");
    assert_false(job_request_name_files(&request, &err));
    assert_string_equal(err.pointer, "/outputs/1");
    job_request_finish(&request);
}

static void ranges_are_cut_to_the_file_or_outside_of_it(void **state)
{
    static const struct {
        const char *value;
        enum http_range_kind kind;
        uint64_t first, count;
    } cases[] = {
        {NULL, HTTP_RANGE_ALL, 0, 0},
        {"bytes=0-0", HTTP_RANGE_PART, 0, 1},
        {"Bytes=99-", HTTP_RANGE_PART, 99, 1},
        {"bytes=10-19", HTTP_RANGE_PART, 10, 10},
        {"bytes=10-1000", HTTP_RANGE_PART, 10, 90},
        {"bytes=10-99999999999999999999999", HTTP_RANGE_PART, 10, 90},
        {"bytes=-30", HTTP_RANGE_PART, 70, 30},
        {"bytes=-1000", HTTP_RANGE_PART, 0, 100},
        {"bytes=-0", HTTP_RANGE_OUTSIDE, 0, 0},
        {"bytes=100-", HTTP_RANGE_OUTSIDE, 0, 0},
        {"bytes=99999999999999999999999-", HTTP_RANGE_OUTSIDE, 0, 0},
        {"bytes=20-10", HTTP_RANGE_ALL, 0, 0},
        {"bytes=0-1,3-4", HTTP_RANGE_ALL, 0, 0},
        {"bytes=-", HTTP_RANGE_ALL, 0, 0},
        {"bytes=", HTTP_RANGE_ALL, 0, 0},
        {"bytes=a-b", HTTP_RANGE_ALL, 0, 0},
        {"pages=0-1", HTTP_RANGE_ALL, 0, 0},
    };
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct http_range range = {0};
        if (http_range_parse(cases[i].value, 100, &range) != cases[i].kind ||
            range.first != cases[i].first || range.count != cases[i].count)
            fail_msg("%s", cases[i].value ? cases[i].value : "none");
    }
    struct http_range range = {0};
    assert_int_equal(http_range_parse("bytes=0-", 0, &range), HTTP_RANGE_OUTSIDE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frames_are_those_that_are_listed_in_their_order),
        cmocka_unit_test(lists_that_are_none_name_what_is_wrong),
        cmocka_unit_test(a_request_written_and_read_is_the_same),
        cmocka_unit_test(one_frame_is_a_still_and_a_list_is_animated),
        cmocka_unit_test(jobs_to_wait_for_are_ids_that_are_named_once),
        cmocka_unit_test(files_are_named_by_pattern_and_never_alike),
        cmocka_unit_test(ranges_are_cut_to_the_file_or_outside_of_it),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
