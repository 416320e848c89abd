/* SPDX-License-Identifier: MIT */
/* Shader fragments that are joined into one text: which files, and what defines choose among them.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/gl/compose.h"

static const char pixels[] = "shade_pixels.comp.glsl";
static const char compositing[] = "\nvoid layers_composite(";

static void a_define_with_a_file_includes_it(void **state)
{
    (void)state;
    struct error err = {0};
    struct composition with = {0}, without = {0};
    assert_true(
        composition_init(&with, pixels, NULL, "SAMPLES=1 LAYERS=lists_composite.glsl X=2", &err));
    assert_non_null(strstr(with.text, compositing));
    assert_null(strstr(with.text, "#each"));
    assert_true(composition_init(&without, pixels, NULL, "SAMPLES=1 LAYERS2=absent.glsl", &err));
    assert_null(strstr(without.text, compositing));
    assert_null(strstr(without.text, "#each"));
    composition_finish(&with);
    composition_finish(&without);
}

static void lines_keep_their_numbers_whatever_a_define_includes(void **state)
{
    (void)state;
    struct error err = {0};
    struct composition texts[2] = {{0}};
    long lines[2];
    for (int i = 0; i < 2; i++) {
        assert_true(composition_init(&texts[i], pixels, NULL,
                                     i ? "LAYERS=lists_composite.glsl" : NULL, &err));
        char *at = strstr(texts[i].text, "\nvec4 composite(ivec2 pixel)"), *mark = texts[i].text;
        assert_non_null(at);
        at[1] = 0;
        for (char *m = texts[i].text; (m = strstr(m, "#line ")); m++)
            mark = m;
        lines[i] = strtol(mark + 6, NULL, 10);
        for (char *c = strchr(mark, '\n') + 1; *c; c++)
            lines[i] += *c == '\n';
        composition_finish(&texts[i]);
    }
    assert_int_equal(lines[0], lines[1]);
}

static void a_define_with_an_absent_file_is_refused_by_its_name(void **state)
{
    (void)state;
    struct error err = {0};
    struct composition text = {0};
    assert_false(composition_init(&text, pixels, NULL, "LAYERS=absent.glsl", &err));
    assert_non_null(strstr(err.message, "absent.glsl"));
    composition_finish(&text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_define_with_a_file_includes_it),
        cmocka_unit_test(lines_keep_their_numbers_whatever_a_define_includes),
        cmocka_unit_test(a_define_with_an_absent_file_is_refused_by_its_name),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
