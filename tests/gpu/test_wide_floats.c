/* SPDX-License-Identifier: MIT */
/* Claims about the arithmetic of layers on this device: each form is right to what it promises, and
 * the choice among them is the same at every start. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "renderer/gl/context.h"
#include "renderer/gl/wide_floats.h"

enum { SKIPPED = 77 };

static struct gl_context *context;
static struct program_cache *programs;

static bool choose_on(bool is_software, enum wide_floats asked, struct wide_floats_choice *choice,
                      struct error *err)
{
    return wide_floats_choose(&(struct wide_floats_desc){.programs = programs,
                                                         .asked = asked,
                                                         .is_software = is_software},
                              choice, err);
}

static bool choose(enum wide_floats asked, struct wide_floats_choice *choice, struct error *err)
{
    return choose_on(gl_context_limits(context)->is_software, asked, choice, err);
}

static bool is_right(enum wide_floats form)
{
    struct error err = {0};
    struct wide_floats_choice choice;
    if (!choose(form, &choice, &err)) {
        assert_int_equal(ERROR_NO_DEVICE, err.code);
        print_message("%s\n", err.message);
        return false;
    }
    assert_int_equal(form, choice.form);
    assert_true(choice.pairs_over_f64 == 0);
    return true;
}

static void forms_that_need_no_fma_are_right_everywhere(void **unused)
{
    (void)unused;
    assert_true(is_right(WIDE_FLOATS_F64));
    assert_true(is_right(WIDE_FLOATS_PAIRS_SPLIT));
    print_message("fma rounds %s\n", is_right(WIDE_FLOATS_PAIRS) ? "once" : "twice");
}

static void the_choice_is_the_same_at_every_start(void **unused)
{
    (void)unused;
    enum wide_floats first = WIDE_FLOATS_MEASURED;
    for (int i = 0; i < 3; i++) {
        struct error err = {0};
        struct wide_floats_choice choice;
        assert_true(choose(WIDE_FLOATS_MEASURED, &choice, &err));
        print_message("%s: pairs take %.2f times as long as f64\n", wide_floats_name(choice.form),
                      choice.pairs_over_f64);
        assert_true(choice.form != WIDE_FLOATS_MEASURED);
        assert_true(i == 0 || choice.form == first);
        first = choice.form;
    }
}

static void f64_is_taken_where_pairs_take_longer(void **unused)
{
    (void)unused;
    struct error err = {0};
    struct wide_floats_choice choice;
    assert_true(choose_on(false, WIDE_FLOATS_MEASURED, &choice, &err));
    assert_true(choice.pairs_over_f64 > 0);
    assert_int_equal(choice.form == WIDE_FLOATS_F64, choice.pairs_over_f64 > WIDE_FLOATS_F64_GAIN);
}

static void processors_take_f64_and_nothing_is_timed(void **unused)
{
    (void)unused;
    struct error err = {0};
    struct wide_floats_choice choice;
    assert_true(choose_on(true, WIDE_FLOATS_MEASURED, &choice, &err));
    assert_int_equal(choice.form, WIDE_FLOATS_F64);
    assert_true(choice.pairs_over_f64 == 0);
    assert_true(choose_on(true, WIDE_FLOATS_PAIRS_SPLIT, &choice, &err)); /* what is asked for */
    assert_int_equal(choice.form, WIDE_FLOATS_PAIRS_SPLIT);
}

static void every_form_has_a_name_and_its_defines(void **unused)
{
    (void)unused;
    assert_string_equal("f64", wide_floats_name(WIDE_FLOATS_F64));
    assert_string_equal("", wide_floats_defines(WIDE_FLOATS_F64));
    assert_string_equal("pairs", wide_floats_name(WIDE_FLOATS_PAIRS));
    assert_string_equal("WIDE_PAIRS", wide_floats_defines(WIDE_FLOATS_PAIRS));
    assert_string_equal("pairs-split", wide_floats_name(WIDE_FLOATS_PAIRS_SPLIT));
    assert_string_equal("WIDE_PAIRS WIDE_SPLIT", wide_floats_defines(WIDE_FLOATS_PAIRS_SPLIT));
}

int main(void)
{
    struct error err = {0};
    unsetenv("VITRAIL_WIDE_FLOATS"); /* tests/support/test_device.c */
    context = gl_context_create(&(struct gl_context_desc){.is_strict = true}, &err);
    if (!context) {
        fprintf(stderr, "skipped: %s\n", err.message);
        return SKIPPED;
    }
    programs = program_cache_create(NULL, &err);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(forms_that_need_no_fma_are_right_everywhere),
        cmocka_unit_test(the_choice_is_the_same_at_every_start),
        cmocka_unit_test(f64_is_taken_where_pairs_take_longer),
        cmocka_unit_test(processors_take_f64_and_nothing_is_timed),
        cmocka_unit_test(every_form_has_a_name_and_its_defines),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    program_cache_destroy(programs);
    gl_context_destroy(context);
    return failed;
}
