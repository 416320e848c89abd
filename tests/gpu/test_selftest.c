/* SPDX-License-Identifier: MIT */
/* Claims about the start-up self-test on this device: it passes, decides about timers, and costs
 * little. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <time.h>

#include <cmocka.h>

#include "renderer/gl/selftest.h"

enum { SKIPPED = 77 };

static struct gl_context *context;
static double first_ms;

static double wall_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

static double run_selftest(void)
{
    struct error err = {0};
    struct program_cache *programs = program_cache_create(NULL, &err);
    assert_non_null(programs);
    double begin_ms = wall_ms();
    bool ok = gl_selftest(context, programs, &err);
    double ms = wall_ms() - begin_ms;
    assert_string_equal(err.message, "");
    assert_true(ok);
    program_cache_destroy(programs);
    return ms;
}

static void this_device_passes(void **unused)
{
    (void)unused;
    first_ms = run_selftest();
    print_message("self-test: %.0f ms on %s\n", first_ms, gl_context_limits(context)->renderer);
}

static void it_passes_again_and_within_the_budget_of_a_start(void **unused)
{
    (void)unused;
    double again_ms = run_selftest();
    print_message("self-test, shaders compiled before: %.0f ms\n", again_ms);
    assert_true(again_ms < 1000);
}

static void software_timers_are_not_believed(void **unused)
{
    (void)unused;
    const struct gl_limits *limits = gl_context_limits(context);
    print_message("timer queries are %s\n", limits->has_true_timers ? "true" : "not believed");
    if (!limits->is_software)
        skip();
    assert_false(limits->has_true_timers);
}

static void a_thread_has_one_context(void **unused)
{
    (void)unused;
    struct error err = {0};
    assert_null(gl_context_create(&(struct gl_context_desc){.is_strict = true}, &err));
    assert_int_equal(ERROR_INTERNAL, err.code);
    err = (struct error){0};
    assert_true(gl_context_check(context, "going on", &err)); /* the first is as it was */
    run_selftest();
    gl_context_destroy(context);
    context = gl_context_create(&(struct gl_context_desc){.is_strict = true}, &err);
    assert_non_null(context);
    run_selftest();
}

int main(void)
{
    struct error err = {0};
    context = gl_context_create(&(struct gl_context_desc){.is_strict = true}, &err);
    if (!context) {
        fprintf(stderr, "skipped: %s\n", err.message);
        return SKIPPED;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(this_device_passes),
        cmocka_unit_test(it_passes_again_and_within_the_budget_of_a_start),
        cmocka_unit_test(software_timers_are_not_believed),
        cmocka_unit_test(a_thread_has_one_context),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    gl_context_destroy(context);
    return failed;
}
