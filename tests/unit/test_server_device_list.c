/* SPDX-License-Identifier: MIT */
/* Devices of --device: server/base/device_list. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "server/base/device_list.h"

static const struct device_list_limits limits = {3, 128};

static void entries_are_counted_and_read(void **state)
{
    (void)state;
    char device[64];
    assert_int_equal(1, device_list_count(""));
    assert_int_equal(3, device_list_count("1,software,65:00.0"));
    device_list_get("1,software,65:00.0", 1, device, sizeof device);
    assert_string_equal("software", device);
    device_list_get("1,software,65:00.0", 2, device, sizeof device);
    assert_string_equal("65:00.0", device);
}

static void what_is_wrong_is_named(void **state)
{
    (void)state;
    static const struct {
        const char *list, *part;
    } table[] = {
        {"1,2,3,4", "more than 3 devices"},
        {"1,,2", "device 2 of '1,,2' is empty"},
        {"1,x", "device 2 of '1,x'"},
        {"x", "device"},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        struct error err = {0};
        assert_false(device_list_check(table[i].list, &limits, &err));
        assert_int_equal(ERROR_INVALID_REQUEST, err.code);
        assert_non_null(strstr(err.message, table[i].part));
    }
    struct error err = {0};
    assert_true(device_list_check("1,software,65:00.0", &limits, &err));
}

static void make_node(const char *folder, const char *name)
{
    char path[128];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "we");
    assert_non_null(file);
    fclose(file);
}

static void remove_node(const char *folder, const char *name)
{
    char path[128];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    assert_int_equal(0, unlink(path));
}

static void render_nodes_are_listed_by_number(void **state)
{
    (void)state;
    static const char *const names[] = {"renderD1000", "renderD129", "renderD128",
                                        "card0",       "renderDx",   "renderD"};
    enum { COUNT = sizeof names / sizeof *names };
    char folder[] = "/tmp/vitrail-nodes-XXXXXX", list[128], wanted[128];
    struct error err = {0};
    assert_non_null(mkdtemp(folder));
    assert_false(device_list_of_nodes(folder, &limits, list, &err));
    assert_int_equal(ERROR_INVALID_REQUEST, err.code);
    assert_non_null(strstr(err.message, "no render node in"));
    for (int i = 0; i < COUNT; i++)
        make_node(folder, names[i]);
    err = (struct error){0};
    assert_true(device_list_of_nodes(folder, &limits, list, &err));
    snprintf(wanted, sizeof wanted, "%s/renderD128,%s/renderD129,%s/renderD1000", folder, folder,
             folder);
    assert_string_equal(wanted, list);

    /* Too many, or too long, is an error, and nothing is written behind the list's end. */
    err = (struct error){0};
    assert_false(device_list_of_nodes(folder, &(struct device_list_limits){2, 128}, list, &err));
    assert_non_null(strstr(err.message, "more than 2 render nodes"));
    memset(list, 'x', sizeof list);
    assert_false(device_list_of_nodes(folder, &(struct device_list_limits){3, 40}, list, &err));
    for (size_t i = 40; i < sizeof list; i++)
        assert_int_equal('x', list[i]);
    for (int i = 0; i < COUNT; i++)
        remove_node(folder, names[i]);
    assert_int_equal(0, rmdir(folder));
    assert_false(device_list_of_nodes(folder, &limits, list, &err));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(entries_are_counted_and_read),
        cmocka_unit_test(what_is_wrong_is_named),
        cmocka_unit_test(render_nodes_are_listed_by_number),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
