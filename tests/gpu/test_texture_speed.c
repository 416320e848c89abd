/* SPDX-License-Identifier: MIT */
/* What samples of compressed textures take: measured within its bound, and judged by the numbers.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/frame/texture_speed.h"
#include "tests/support/image_checks.h"

static void samples_are_measured(void **state)
{
    struct renderer *renderer = *state;
    struct texture_speed speed;
    struct error err = {0};
    double elapsed_ms = 0;
    for (int i = 0; i < 4; i++) { /* the second compiles nothing */
        if (!texture_speed_measure(renderer, &speed, &elapsed_ms, &err))
            fail_msg("%s", err.message);
        print_message("whole %.2f ns, BC1 %.2f, BC3 %.2f, encoding %.0f MB/s; %.1f ms\n",
                      speed.whole_ns, speed.bc1_ns, speed.bc3_ns, speed.encode_bytes_per_ms / 1e3,
                      elapsed_ms);
    }
    if (!renderer_samples_blocks(renderer)) {
        assert_false(texture_speed_is_known(&speed));
        skip();
    }
    assert_true(texture_speed_is_known(&speed));
    assert_true(speed.whole_ns < 1e5 && speed.bc1_ns < 1e5 && speed.bc3_ns < 1e5);
    assert_true(speed.bc1_ns > 0 && speed.bc3_ns > 0);
    assert_true(speed.encode_bytes_per_ms > 1e3 && speed.encode_bytes_per_ms < 1e8);
    assert_true(elapsed_ms > 0 && elapsed_ms < 1000);
}

static void what_is_slower_or_slow_to_make_gains_nothing(void **state)
{
    (void)state;
    assert_false(texture_speed_gains(&(struct texture_speed){0}));
    assert_true(texture_speed_gains(&(struct texture_speed){1, 1, 1, 1e5}));
    assert_true(texture_speed_gains(&(struct texture_speed){1, 1.09, 0.5, 22e3}));
    assert_false(texture_speed_gains(&(struct texture_speed){1, 1.4, 1, 1e5}));
    assert_false(texture_speed_gains(&(struct texture_speed){1, 1, 1.4, 1e5}));
    assert_false(texture_speed_gains(&(struct texture_speed){1, 1, 1, 21e3}));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(samples_are_measured),
        cmocka_unit_test(what_is_slower_or_slow_to_make_gains_nothing),
    };
    return cmocka_run_group_tests(tests, render_rig_setup, render_rig_teardown);
}
