/* SPDX-License-Identifier: MIT */
/* Which device is passed over after a worker died: by what it told before, and how it ended. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/front/device_trials.h"
#include "server/mapping/device_messages.h"

static const struct gl_device card = {
    .number = 1, .node = "/dev/dri/renderD128", .pci = "0000:65:00.0"};
static const struct gl_device other = {.number = 2, .node = "/dev/dri/renderD129"};
static const char segv[] = "signal 11 (Segmentation fault)";

static void begin(struct device_trials *trials, const struct gl_device *device,
                  enum gl_device_step step)
{
    json_t *message = device_trials_message(device, step);
    assert_non_null(message);
    device_trials_begin(trials, message);
    json_decref(message);
}

static void a_crash_while_no_device_is_tried_blames_none(void **state)
{
    struct device_trials trials = {0};
    (void)state;
    assert_null(device_trials_end(&trials, segv, false));
    begin(&trials, &card, GL_DEVICE_OPENING);
    device_trials_succeed(&trials); /* it serves */
    assert_null(device_trials_end(&trials, segv, false));
    begin(&trials, &card, GL_DEVICE_TESTING);
    device_trials_abandon(&trials); /* it said what fails */
    assert_null(device_trials_end(&trials, "exit status 1", false));
    assert_int_equal(device_trials_passed_over(&trials), 0);
}

static void the_second_crash_in_a_row_passes_the_device_over(void **state)
{
    struct device_trials trials = {0};
    (void)state;
    begin(&trials, &card, GL_DEVICE_OPENING);
    begin(&trials, &card, GL_DEVICE_TESTING);
    const struct gl_device *device = device_trials_end(&trials, segv, false);
    assert_non_null(device);
    assert_true(gl_device_is_same(device, &card));
    assert_string_equal(device->reason, "");
    assert_int_equal(device_trials_passed_over(&trials), 0);
    begin(&trials, &card, GL_DEVICE_OPENING);
    begin(&trials, &card, GL_DEVICE_TESTING);
    device = device_trials_end(&trials, segv, false);
    assert_non_null(device);
    assert_string_equal(device->reason, "its driver crashed twice in the self-test: signal 11 "
                                        "(Segmentation fault)");
    assert_int_equal(device_trials_passed_over(&trials), 1);
}

static void crashes_of_another_device_or_before_it_served_do_not_count(void **state)
{
    struct device_trials trials = {0};
    (void)state;
    begin(&trials, &card, GL_DEVICE_OPENING);
    assert_string_equal(device_trials_end(&trials, segv, false)->reason, "");
    begin(&trials, &other, GL_DEVICE_OPENING);
    assert_string_equal(device_trials_end(&trials, segv, false)->reason, "");
    begin(&trials, &card, GL_DEVICE_MEASURING);
    device_trials_succeed(&trials);
    begin(&trials, &card, GL_DEVICE_OPENING);
    assert_string_equal(device_trials_end(&trials, segv, false)->reason, "");
    assert_int_equal(device_trials_passed_over(&trials), 0);
    begin(&trials, &other, GL_DEVICE_OPENING);
    assert_string_equal(device_trials_end(&trials, "exit status 3", false)->reason,
                        "its driver crashed twice when it was opened: exit status 3");
}

static void one_hang_passes_the_device_over(void **state)
{
    struct device_trials trials = {0};
    (void)state;
    begin(&trials, &card, GL_DEVICE_MEASURING);
    assert_string_equal(
        device_trials_end(&trials, "a missed deadline of 90 s", true)->reason,
        "its driver did not come back when its speed was measured: a missed deadline of 90 s");
}

static void the_next_worker_is_told_which_and_why(void **state)
{
    struct device_trials trials = {0};
    struct gl_device_list told = {.count = 7};
    (void)state;
    begin(&trials, &other, GL_DEVICE_OPENING);
    (void)device_trials_end(&trials, segv, false);
    begin(&trials, &card, GL_DEVICE_TESTING);
    const struct gl_device *device = device_trials_end(&trials, "late", true);
    json_t *json = device_reasons_to_json(&trials.devices);
    device_reasons_from_json(json, &told);
    assert_int_equal(told.count, 1); /* the other one is to be tried */
    assert_true(gl_device_is_same(&told.items[0], &card));
    assert_string_equal(told.items[0].reason, device->reason);
    json_decref(json);
    device_reasons_from_json(NULL, &told);
    assert_int_equal(told.count, 0);
}

static void a_message_that_cannot_be_read_blames_none(void **state)
{
    struct device_trials trials = {0};
    json_t *message = json_pack("{s:s}", "step", "dancing");
    (void)state;
    begin(&trials, &card, GL_DEVICE_OPENING);
    device_trials_begin(&trials, message);
    assert_null(device_trials_end(&trials, segv, true));
    json_decref(message);
}

static void more_devices_than_there_are_blame_none(void **state)
{
    struct device_trials trials = {0};
    (void)state;
    for (int i = 0; i < GL_DEVICES_MAX + 1; i++) {
        const struct gl_device device = {.number = i};
        begin(&trials, &device, GL_DEVICE_OPENING);
        assert_true((device_trials_end(&trials, segv, true) != NULL) == (i < GL_DEVICES_MAX));
    }
    assert_int_equal(device_trials_passed_over(&trials), GL_DEVICES_MAX);
}

static void the_end_lists_each_device_with_its_reason(void **state)
{
    struct gl_device_list list = {{card, other}, 2};
    (void)state;
    strcpy(list.items[0].reason, "it crashed");
    strcpy(list.items[1].reason, "it hung");
    json_t *lines = device_lines_to_json(&list);
    char *text = device_lines_join(lines);
    assert_string_equal(text, "EGL device 1, /dev/dri/renderD128, 0000:65:00.0: passed over: it "
                              "crashed; EGL device 2, /dev/dri/renderD129: passed over: it hung");
    free(text);
    json_decref(lines);
    text = device_lines_join(NULL);
    assert_string_equal(text, "");
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_crash_while_no_device_is_tried_blames_none),
        cmocka_unit_test(the_second_crash_in_a_row_passes_the_device_over),
        cmocka_unit_test(crashes_of_another_device_or_before_it_served_do_not_count),
        cmocka_unit_test(one_hang_passes_the_device_over),
        cmocka_unit_test(the_next_worker_is_told_which_and_why),
        cmocka_unit_test(a_message_that_cannot_be_read_blames_none),
        cmocka_unit_test(more_devices_than_there_are_blame_none),
        cmocka_unit_test(the_end_lists_each_device_with_its_reason),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
