/* SPDX-License-Identifier: MIT */
/* Which device is opened, by lists that no machine needs to have. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/base/device_choice.h"

/* As EGL lists them, the surfaceless platform last. */
static const struct gl_device_list workstation = {
    .items = {{.number = 1, .is_software = true},
              {.number = 2, .node = "/dev/dri/renderD128", .pci = "0000:00:02.0"},
              {.number = 3, .node = "/dev/dri/renderD129", .pci = "0000:65:00.0"},
              {.number = 0}},
    .count = 4};
static const struct gl_device_list laptop = {
    .items = {{.number = 1, .is_software = true}, {.number = 0}}, .count = 2};

static void assert_order(const struct gl_device_list *list, const char *asked, const int *expected,
                         int expected_count)
{
    struct gl_device_selector selector;
    struct error err = {0};
    int order[GL_DEVICES_MAX];
    assert_true(gl_device_parse(asked, &selector, &err));
    assert_int_equal(gl_device_order(list, &selector, order), expected_count);
    for (int i = 0; i < expected_count; i++)
        assert_int_equal(order[i], expected[i]);
}
#define ASSERT_ORDER(list, asked, ...)                    \
    assert_order(list, asked, (const int[]){__VA_ARGS__}, \
                 (int)(sizeof(const int[]){__VA_ARGS__} / sizeof(int)))

static void hardware_is_first_and_software_last(void **unused)
{
    (void)unused;
    ASSERT_ORDER(&workstation, "", 1, 2, 3, 0);
    ASSERT_ORDER(&workstation, "0", 1, 2, 3, 0);
    ASSERT_ORDER(&workstation, NULL, 1, 2, 3, 0);
    ASSERT_ORDER(&laptop, "0", 1, 0);
}

static void a_device_has_four_names(void **unused)
{
    (void)unused;
    ASSERT_ORDER(&workstation, "3", 2);
    ASSERT_ORDER(&workstation, "/dev/dri/renderD129", 2);
    ASSERT_ORDER(&workstation, "0000:65:00.0", 2);
    ASSERT_ORDER(&workstation, "65:00.0", 2);
    ASSERT_ORDER(&workstation, "software", 0);
    ASSERT_ORDER(&laptop, "software", 1, 0);
    assert_order(&workstation, "4", NULL, 0);
    assert_order(&workstation, "/dev/dri/card0", NULL, 0);
    assert_order(&workstation, "0001:65:00.0", NULL, 0);
}

static void addresses_are_read_whole_and_in_either_case(void **unused)
{
    (void)unused;
    struct gl_device_selector selector;
    struct error err = {0};
    assert_true(gl_device_parse("0000:C1:00.7", &selector, &err));
    assert_int_equal(selector.ask, GL_DEVICE_PCI);
    assert_string_equal(selector.name, "0000:c1:00.7");
    assert_true(gl_device_parse("c1:1f.0", &selector, &err));
    assert_string_equal(selector.name, "0000:c1:1f.0");
}

static void other_names_are_refused_with_those_that_there_are(void **unused)
{
    (void)unused;
    static const char *const wrong[] = {
        "x",
        "-1",
        "100",
        "1x",
        "65:00.8",
        "65:00",
        "65-00.0",
        "00:65:00.0",
        "0000:65:00.0 ",
        "g5:00.0",
        "/dev/dri/",
        "/dev/nvidia0",
        "Software",
        " ",
        "0000:65:00.00",
        "/dev/dri/a-name-that-is-much-longer-than-any-node-of-a-device-could-ever-be"};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        struct gl_device_selector selector;
        struct error err = {0};
        if (gl_device_parse(wrong[i], &selector, &err))
            fail_msg("'%s' was taken", wrong[i]);
        assert_int_equal(err.code, ERROR_INVALID_REQUEST);
        assert_non_null(strstr(err.message, "/dev/dri/renderD128"));
    }
}

static void devices_are_told_by_name_and_fate(void **unused)
{
    (void)unused;
    char text[GL_DEVICE_TEXT_BYTES];
    struct gl_device device = workstation.items[2];
    gl_device_describe(&device, text);
    assert_string_equal(text, "EGL device 3, /dev/dri/renderD129, 0000:65:00.0: not tried");
    strcpy(device.reason, "no OpenGL 4.5 core context");
    gl_device_describe(&device, text);
    assert_non_null(strstr(text, "0000:65:00.0: passed over: no OpenGL 4.5 core context"));
    device.is_taken = true;
    gl_device_describe(&device, text);
    assert_non_null(strstr(text, "0000:65:00.0: taken"));
    gl_device_list_names(&workstation, text);
    assert_string_equal(text, "1 (software), 2 (/dev/dri/renderD128, 0000:00:02.0), "
                              "3 (/dev/dri/renderD129, 0000:65:00.0)");
    gl_device_list_names(&(struct gl_device_list){0}, text);
    assert_string_equal(text, "none");
}

static void software_beside_hardware_is_warned_of(void **unused)
{
    (void)unused;
    const struct gl_device_selector any = {0}, software = {.ask = GL_DEVICE_SOFTWARE};
    char text[GL_DEVICE_TEXT_BYTES];
    struct gl_device_list list = workstation;
    strcpy(list.items[1].reason, "/dev/dri/renderD128: Permission denied");
    gl_device_warning(&list, &any, true, text);
    assert_non_null(strstr(text, "EGL device 2"));
    assert_non_null(strstr(text, "Permission denied"));
    gl_device_warning(&list, &any, false, text); /* hardware draws */
    assert_string_equal(text, "");
    gl_device_warning(&list, &software, true, text); /* as it was asked to */
    assert_string_equal(text, "");
    gl_device_warning(&laptop, &any, true, text); /* there is nothing else */
    assert_string_equal(text, "");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hardware_is_first_and_software_last),
        cmocka_unit_test(a_device_has_four_names),
        cmocka_unit_test(addresses_are_read_whole_and_in_either_case),
        cmocka_unit_test(other_names_are_refused_with_those_that_there_are),
        cmocka_unit_test(devices_are_told_by_name_and_fate),
        cmocka_unit_test(software_beside_hardware_is_warned_of),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
