/* SPDX-License-Identifier: MIT */
/* Pictures of views as requests. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "protocol/render_request.h"
#include "protocol/view_document.h"

#define SCENE "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef"

/* The quality of a view's picture. */
static struct request_quality quality_of(const char *quality, bool is_moving)
{
    char text[512];
    struct error err = {0};
    struct render_request request;
    snprintf(text, sizeof text, "{\"scene\":\"" SCENE "\",\"quality\":%s}", quality);
    struct view_document *document = view_document_create(text, strlen(text), &err);
    assert_non_null(document);
    char *shot = view_document_frame(
        document, &(struct view_frame_desc){.format = REQUEST_FORMAT_PNG, .is_moving = is_moving},
        NULL, NULL);
    assert_non_null(shot);
    assert_true(render_request_parse(shot, strlen(shot), &request, &err));
    struct request_quality found = request.quality;
    render_request_finish(&request);
    free(shot);
    view_document_destroy(document);
    return found;
}

static void pictures_in_motion_have_one_sample_and_are_not_ray_traced(void **state)
{
    (void)state;
    static const struct {
        const char *quality;
        enum shadow_technique at_rest, in_motion;
        bool is_reference;
    } table[] = {
        {"{}", SHADOWS_AUTO, SHADOWS_AUTO, false},
        {"{\"shadows\":\"map\"}", SHADOWS_MAP, SHADOWS_MAP, false},
        {"{\"shadows\":\"raytraced\"}", SHADOWS_RAYTRACED, SHADOWS_AUTO, false},
        {"{\"reference\":true}", SHADOWS_AUTO, SHADOWS_AUTO, true},
        {"{\"reference\":true,\"shadows\":\"raytraced\",\"samples\":64}", SHADOWS_RAYTRACED,
         SHADOWS_AUTO, true},
        {"{\"shadows\":\"raytraced-shadows\"}", SHADOWS_RAYTRACED_SHADOWS,
         SHADOWS_RAYTRACED_SHADOWS, false},
    };
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++) {
        struct request_quality at_rest = quality_of(table[i].quality, false),
                               in_motion = quality_of(table[i].quality, true);
        assert_int_equal(at_rest.shadows, table[i].at_rest);
        assert_int_equal(at_rest.reference, table[i].is_reference);
        assert_int_equal(in_motion.shadows, table[i].in_motion);
        assert_false(in_motion.reference);
        assert_int_equal(in_motion.samples, 1);
        assert_int_equal(in_motion.shadow_taps, 1);
    }
}

/* Nodes of light in haze and in smoke are as many in small pictures: motion has fewer slices. */
static void pictures_in_motion_find_haze_in_few_slices(void **state)
{
    (void)state;
    assert_int_equal(quality_of("{}", false).atmosphere_samples, 0);
    assert_int_equal(quality_of("{}", true).atmosphere_samples, 16);
    assert_int_equal(quality_of("{\"atmosphere_samples\":256}", false).atmosphere_samples, 256);
    assert_int_equal(quality_of("{\"atmosphere_samples\":256}", true).atmosphere_samples, 16);
    assert_int_equal(quality_of("{\"atmosphere_samples\":9}", true).atmosphere_samples, 9);
}

static struct view_document *document_of(const char *members)
{
    char text[512];
    struct error err = {0};
    snprintf(text, sizeof text, "{\"scene\":\"" SCENE "\",%s}", members);
    struct view_document *document = view_document_create(text, strlen(text), &err);
    assert_non_null(document);
    return document;
}

/* With the samples that `stream` wants, where these are more, and nothing else. */
static void pictures_at_rest_are_refined_to_more_samples(void **state)
{
    (void)state;
    static const struct {
        const char *members;
        bool is_refined;
    } table[] = {
        {"\"quality\":{}", false},
        {"\"stream\":{\"rest_samples\":16}", true},
        {"\"stream\":{\"rest_samples\":4}", false},
        {"\"stream\":{\"rest_samples\":4},\"quality\":{\"samples\":1}", true},
        {"\"stream\":{\"rest_samples\":8},\"quality\":{\"shadows\":\"raytraced\"}", true},
        {"\"stream\":{\"rest_samples\":16},\"quality\":{\"samples\":16}", false},
        {"\"stream\":{\"rest_samples\":16},\"quality\":{\"reference\":true}", false},
        {"\"stream\":{\"rest_samples\":16},\"quality\":{\"max_error\":0.1}", false},
    };
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++) {
        struct view_document *document = document_of(table[i].members);
        const int wanted = view_document_stream(document)->rest_samples;
        struct view_frame_desc frame = {.format = REQUEST_FORMAT_PNG, .is_refined = true};
        struct render_request request;
        struct error err = {0};
        assert_int_equal(view_document_refines(document), table[i].is_refined);
        char *refined = view_document_frame(document, &frame, NULL, NULL);
        frame.is_refined = false;
        char *exact = view_document_frame(document, &frame, NULL, NULL);
        if (table[i].is_refined) {
            assert_true(render_request_parse(refined, strlen(refined), &request, &err));
            assert_int_equal(request.quality.samples, wanted);
            assert_string_not_equal(refined, exact);
            render_request_finish(&request);
        }
        free(refined);
        free(exact);
        view_document_destroy(document);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pictures_in_motion_have_one_sample_and_are_not_ray_traced),
        cmocka_unit_test(pictures_in_motion_find_haze_in_few_slices),
        cmocka_unit_test(pictures_at_rest_are_refined_to_more_samples),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
