/* SPDX-License-Identifier: MIT */
/* The budget of the device's memory where nobody says it. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/gl/memory_budget.h"

#define GIB(n) ((uint64_t)(n) << 30)

static void budgets_are_shares_of_what_there_is(void **unused)
{
    (void)unused;
    static const struct {
        struct gl_memory memory;
        uint64_t budget;
        const char *source;
    } rows[] = {
        {{false, GIB(8), GIB(64)}, GIB(6), "card"},
        {{false, GIB(80), GIB(16)}, GIB(60), "card"}, /* memory of its own */
        {{false, GIB(1), GIB(64)}, GIB(3) / 4, "card"},
        {{false, 0, GIB(64)}, GIB(4), "4 GiB"},
        {{false, 0, GIB(6)}, GIB(3), "half of the machine"},
        {{false, 0, 0}, GIB(4), "4 GiB"},
        {{true, 0, GIB(24)}, GIB(4), "4 GiB"},
        {{true, 0, GIB(16)}, GIB(4), "4 GiB"},
        {{true, 0, GIB(8)}, GIB(2), "a quarter of the machine"},
        {{true, GIB(8), GIB(2)}, GIB(1) / 2, "a quarter of the machine"}, /* no card draws */
        {{true, 0, 0}, GIB(4), "4 GiB"},
        {{true, 0, 1 << 20}, 64 << 20, "a quarter of the machine"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const char *source = NULL;
        assert_int_equal(gl_memory_budget(&rows[i].memory, &source), rows[i].budget);
        assert_non_null(strstr(source, rows[i].source));
    }
}

static void this_machine_says_how_much_it_has(void **unused)
{
    (void)unused;
    struct gl_memory memory;
    gl_memory_read(true, &memory);
    assert_true(memory.machine_bytes > 64 << 20);
    assert_int_equal(memory.free_bytes, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(budgets_are_shares_of_what_there_is),
        cmocka_unit_test(this_machine_says_how_much_it_has),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
