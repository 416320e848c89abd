/* SPDX-License-Identifier: MIT */
/* Composition of shaders: lines that stand for one line per item of a define. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/gl/compose.h"

static void compose(const char *defines, struct composition *composition)
{
    struct error err = {0};
    *composition = (struct composition){0};
    if (!composition_init(composition, "shadow_probe.comp.glsl", "", defines, &err))
        fail_msg("%s", err.message);
}

static size_t count(const char *text, const char *what)
{
    size_t found = 0;
    for (; (text = strstr(text, what)); text++)
        found++;
    return found;
}

static bool has_file(const struct composition *composition, const char *name)
{
    bool has = false;
    for (int i = 0; i < composition->file_count; i++)
        has |= strstr(composition->files[i], name) != NULL;
    return has;
}

static void each_item_of_a_list_has_its_line_and_its_file(void **state)
{
    (void)state;
    struct composition both;
    compose("SHADOW_HAS_MAPS SHADOW_LISTS=deep:3,linked:4 SHADOW_FAITHFUL", &both);
    assert_int_equal(count(both.text, "if (technique == 3u) return shadow_list_deep("), 1);
    assert_int_equal(count(both.text, "if (technique == 4u) return shadow_list_linked("), 1);
    assert_int_equal(count(both.text, "if (technique == 3u) return shadow_run_deep("), 1);
    assert_true(has_file(&both, "shadow_lookup_deep.glsl"));
    assert_true(has_file(&both, "shadow_lookup_linked.glsl"));
    assert_int_equal(count(both.text, "#each"), 0);
    composition_finish(&both);
}

static void a_list_of_one_item_brings_nothing_of_the_others(void **state)
{
    (void)state;
    struct composition linked;
    compose("SHADOW_HAS_MAPS SHADOW_LISTS=linked:4", &linked);
    assert_true(has_file(&linked, "shadow_lookup_linked.glsl"));
    assert_false(has_file(&linked, "shadow_lookup_deep.glsl"));
    assert_int_equal(count(linked.text, "deep("), 0);
    composition_finish(&linked);
}

static void without_a_list_there_is_no_line(void **state)
{
    (void)state;
    struct composition none;
    compose("SHADOW_HAS_MAPS", &none);
    assert_int_equal(count(none.text, "technique =="), 0);
    assert_false(has_file(&none, "shadow_lookup_"));
    composition_finish(&none);
}

static void an_item_without_a_file_is_an_error(void **state)
{
    (void)state;
    struct composition composition = {0};
    struct error err = {0};
    assert_false(composition_init(&composition, "shadow_probe.comp.glsl", "",
                                  "SHADOW_HAS_MAPS SHADOW_LISTS=absent:9", &err));
    assert_non_null(strstr(err.message, "shadow_lookup_absent.glsl"));
    composition_finish(&composition);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_item_of_a_list_has_its_line_and_its_file),
        cmocka_unit_test(a_list_of_one_item_brings_nothing_of_the_others),
        cmocka_unit_test(without_a_list_there_is_no_line),
        cmocka_unit_test(an_item_without_a_file_is_an_error),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
