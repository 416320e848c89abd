/* SPDX-License-Identifier: MIT */
/* Lines of a report come in the order of the plan, whenever their times became known. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "renderer/frame_report.h"

static void passes_come_in_the_order_of_the_plan(void **unused)
{
    (void)unused;
    static struct frame_report report;
    const char *const plan[] = {"shadow.depth", "shadow.trace", "gbuffer", "light_list", "shade"};
    static const char *const added[] = {"light_list", "overlay", "shade",
                                        "gbuffer",    "shade",   "shadow.depth"};
    static const char *const because[] = {"lights", "edges", "first", "seen", "second", "casters"};
    static const int expected[] = {5, 3, 0, 2, 4, 1};
    for (int i = 0; i < 5; i++)
        report_order_pass(&report, plan[i]);
    for (int i = 0; i < 6; i++)
        report_add_pass(&report, added[i], because[i], "", i + 1, REPORT_SHADE);
    assert_int_equal(report.pass_count, 6);
    for (int i = 0; i < 6; i++) {
        assert_string_equal(report.passes[i].pass, added[expected[i]]);
        assert_string_equal(report.passes[i].because, because[expected[i]]);
        assert_true(report.passes[i].ms == expected[i] + 1);
    }
}

static void passes_without_a_plan_come_as_they_are_added(void **unused)
{
    (void)unused;
    static struct frame_report report;
    report_add_pass(&report, "shade", "", "", 1, REPORT_SHADE);
    report_add_pass(&report, "gbuffer", "", "", 1, REPORT_SHADE);
    report_add_pass(&report, "shade", "", "", 2, REPORT_SHADE);
    assert_int_equal(report.pass_count, 2);
    assert_string_equal(report.passes[0].pass, "shade");
    assert_true(report.passes[0].ms == 3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(passes_come_in_the_order_of_the_plan),
        cmocka_unit_test(passes_without_a_plan_come_as_they_are_added),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
