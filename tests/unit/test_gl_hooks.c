/* SPDX-License-Identifier: MIT */
/* Claims about the texts that switch on the layers between a test and GL. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/gl_hooks.h"

static void each_name_switches_on_its_layer(void **state)
{
    struct gl_hooks_desc desc;
    struct error err = {0};
    (void)state;
    assert_true(gl_hooks_parse("", &desc, &err));
    assert_false(desc.counts);
    assert_true(gl_hooks_parse("count", &desc, &err));
    assert_true(desc.counts && desc.prints && !desc.tracks && !desc.reorders);
    assert_true(
        gl_hooks_parse("track,reorder,hostile=names-reused,hostile=small-blocks", &desc, &err));
    assert_true(desc.tracks && desc.reorders && !desc.counts);
    assert_true(desc.hostility.reuses_names && desc.hostility.has_small_blocks);
    assert_false(desc.hostility.has_small_texels || desc.hostility.is_not_software);
    assert_true(gl_hooks_parse("hostile=small-texels,hostile=no-post-depth-coverage,"
                               "hostile=not-software,hostile=lost-after=77",
                               &desc, &err));
    assert_true(desc.hostility.has_small_texels && desc.hostility.lacks_post_coverage);
    assert_true(desc.hostility.is_not_software && desc.hostility.lost_after == 77);
    assert_int_equal(desc.hostility.timers, GL_TIMERS_AS_THEY_ARE);
    assert_true(gl_hooks_parse("hostile=timers-true", &desc, &err));
    assert_int_equal(desc.hostility.timers, GL_TIMERS_TRUE);
    assert_true(gl_hooks_parse("hostile=timers-false", &desc, &err));
    assert_int_equal(desc.hostility.timers, GL_TIMERS_FALSE);
}

static void what_is_no_layer_is_refused_by_its_name(void **state)
{
    static const char *const texts[] = {"counts",  "count,Track",          "hostile=",
                                        "count=1", "hostile=lost-after=x", "hostile=lost-after=0"};
    (void)state;
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        struct gl_hooks_desc desc;
        struct error err = {0};
        const char *last = strrchr(texts[i], ',');
        assert_false(gl_hooks_parse(texts[i], &desc, &err));
        assert_non_null(strstr(err.message, last ? last + 1 : texts[i]));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_name_switches_on_its_layer),
        cmocka_unit_test(what_is_no_layer_is_refused_by_its_name),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
