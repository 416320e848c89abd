/* SPDX-License-Identifier: MIT */
/* Deep images: what their file begins with, and how many samples they may have. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "protocol/provenance_file.h"
#include "renderer/image/deep_image.h"

static const struct deep_sample pane = {
    .depth = 1, .back = 1, .color = {0.5f, 0, 0}, .opacity = {0.25f, 0.75f, 1}};

static void the_file_is_a_deep_openexr_with_its_provenance(void **state)
{
    (void)state;
    static const unsigned char head[] = {0x76, 0x2f, 0x31, 0x01, 2, 8, 0, 0}; /* non-image */
    struct deep_image deep;
    struct error err = {0};
    void *bytes = NULL;
    size_t size_bytes = 0, length = 0;
    const char *text = NULL;
    assert_true(deep_image_init(&deep, 3, 2, &err));
    assert_true(deep_image_reserve(&deep, 3, &err));
    deep_image_set(&deep, 2, 1, (struct deep_sample[]){pane, pane}, 2);
    deep_image_set(&deep, 0, 0, &pane, 1);
    assert_int_equal(deep.pixels[5].count, 2);
    assert_true(deep_image_encode(&deep, &(struct deep_encode_desc){.provenance = "{\"a\": 1}"},
                                  &bytes, &size_bytes, &err));
    assert_memory_equal(bytes, head, sizeof head);
    assert_true(provenance_find(bytes, size_bytes, &text, &length));
    assert_int_equal(length, 8);
    assert_memory_equal(text, "{\"a\": 1}", length);
    free(bytes);
    deep_image_finish(&deep);
    deep_image_finish(&deep);
}

static void an_image_without_samples_is_a_file(void **state)
{
    (void)state;
    struct deep_image deep;
    struct error err = {0};
    void *bytes = NULL;
    size_t size_bytes = 0;
    assert_true(deep_image_init(&deep, 1, 1, &err));
    assert_true(deep_image_encode(&deep, &(struct deep_encode_desc){0}, &bytes, &size_bytes, &err));
    assert_true(size_bytes > 0);
    free(bytes);
    deep_image_finish(&deep);
}

static void more_samples_than_it_may_have_are_refused(void **state)
{
    (void)state;
    struct deep_image deep;
    struct error err = {0};
    assert_true(deep_image_init(&deep, 4, 4, &err));
    assert_true(deep_image_reserve(&deep, 16, &err));
    deep_image_set(&deep, 0, 0, &pane, 1);
    assert_false(deep_image_reserve(&deep, DEEP_SAMPLES_MAX, &err));
    assert_int_equal(err.code, ERROR_TOO_LARGE);
    assert_non_null(strstr(err.message, "16777216 samples"));
    deep_image_finish(&deep);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_file_is_a_deep_openexr_with_its_provenance),
        cmocka_unit_test(an_image_without_samples_is_a_file),
        cmocka_unit_test(more_samples_than_it_may_have_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
