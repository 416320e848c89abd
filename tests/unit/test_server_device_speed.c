/* SPDX-License-Identifier: MIT */
/* The file that keeps a device's speed: server/worker/device_speed. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "server/worker/device_speed.h"

static const struct device_speed known = {0.5, 1.25, 0.75, 2, 3};

static void write_file(const char *path, const char *text)
{
    FILE *file = fopen(path, "we");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
}

static void a_speed_reads_back_for_its_device_alone(void **state)
{
    (void)state;
    char folder[] = "/tmp/vitrail-speed-XXXXXX", path[128], inner[128];
    struct device_speed read;
    struct error err = {0};
    assert_non_null(mkdtemp(folder));
    snprintf(inner, sizeof inner, "%s/cache", folder);
    snprintf(path, sizeof path, "%s/cache/speed.json", folder);
    assert_false(device_speed_load(&read, path, "this"));
    assert_true(device_speed_save(&known, path, "this", &err)); /* makes the folder */
    assert_true(device_speed_load(&read, path, "this"));
    assert_memory_equal(&read, &known, sizeof read);
    assert_false(device_speed_load(&read, path, "another driver"));
    static const char *const damaged[] = {
        "",
        "{",
        "[]",
        "{\"key\":\"this\"}",
        "{\"key\":\"this\",\"frame_ms\":1,\"shade\":0,\"maps\":1,\"trace\":1,\"build\":1}",
        "{\"key\":\"this\",\"frame_ms\":1,\"shade\":1e9,\"maps\":1,\"trace\":1,\"build\":1}",
        "{\"key\":\"this\",\"frame_ms\":1,\"shade\":-1,\"maps\":1,\"trace\":1,\"build\":1}",
        "{\"key\":\"this\",\"frame_ms\":1,\"shade\":\"1\",\"maps\":1,\"trace\":1,\"build\":1}"};
    for (size_t i = 0; i < sizeof damaged / sizeof *damaged; i++) {
        write_file(path, damaged[i]);
        assert_false(device_speed_load(&read, path, "this"));
    }
    unlink(path);
    rmdir(inner);
    write_file(inner, "in the way");
    assert_false(device_speed_save(&known, path, "this", &err));
    assert_non_null(strstr(err.message, path));
    unlink(inner);
    rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_speed_reads_back_for_its_device_alone)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
