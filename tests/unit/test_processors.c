/* SPDX-License-Identifier: MIT */
/* How many threads keep the machine busy. */
#include <sched.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

#include "renderer/base/processors.h"

static void a_thread_counts_the_processors_that_may_run_it(void **unused)
{
    (void)unused;
    cpu_set_t all, one;
    int first = 0;
    unsetenv(PROCESSORS_VARIABLE);
    assert_int_equal(0, sched_getaffinity(0, sizeof all, &all));
    while (!CPU_ISSET(first, &all))
        first++;
    assert_int_equal(CPU_COUNT(&all), processors_usable());
    CPU_ZERO(&one);
    CPU_SET(first, &one);
    assert_int_equal(0, sched_setaffinity(0, sizeof one, &one));
    assert_int_equal(1, processors_usable());
    assert_int_equal(1, processors_share(2));
    assert_int_equal(0, sched_setaffinity(0, sizeof all, &all));
    assert_int_equal(CPU_COUNT(&all), processors_usable());
}

static void the_variable_sets_the_share_of_the_process(void **unused)
{
    (void)unused;
    setenv(PROCESSORS_VARIABLE, "6", 1);
    assert_int_equal(6, processors_usable());
    assert_int_equal(2, processors_share(3));
    setenv(PROCESSORS_VARIABLE, "0", 1);
    assert_int_equal(1, processors_usable());
    unsetenv(PROCESSORS_VARIABLE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_thread_counts_the_processors_that_may_run_it),
        cmocka_unit_test(the_variable_sets_the_share_of_the_process),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
