/* SPDX-License-Identifier: MIT */
/* Pieces of a pass: all of it once, and none much longer than it should be. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "renderer/window/time_slices.h"

/* Walks a pass whose unit takes ms_per_unit, and ten times that from `dear` on. Returns the pieces.
 */
static int walk(uint64_t total, uint64_t first_count, uint64_t granule, double ms_per_unit,
                uint64_t dear, double *longest_ms)
{
    struct time_slices slices = time_slices_begin(total, first_count, granule);
    uint64_t done = 0;
    int pieces = 0;
    for (*longest_ms = 0; time_slices_next(&slices); pieces++) {
        assert_true(slices.first == done && slices.count > 0 && slices.first % granule == 0);
        done += slices.count;
        assert_int_equal(time_slices_is_last(&slices), done == total);
        double ms = (double)slices.count * ms_per_unit * (slices.first >= dear ? 10 : 1);
        time_slices_learn(&slices, slices.count, ms);
        *longest_ms = ms > *longest_ms ? ms : *longest_ms;
        assert_true(pieces < 1000000);
    }
    assert_true(done == total);
    return pieces;
}

static void pieces_cover_a_pass_once(void **state)
{
    (void)state;
    double longest_ms;
    for (uint64_t total = 1; total < 3000; total += 7)
        for (uint64_t granule = 1; granule <= 64; granule *= 8)
            walk(total, 40, granule, 0.1 * (double)(total % 13), total / 2, &longest_ms);
    assert_int_equal(walk(0, 40, 8, 1, 0, &longest_ms), 0);
}

static void without_a_first_size_there_is_one_piece(void **state)
{
    (void)state;
    double longest_ms;
    assert_int_equal(walk(1 << 20, 0, 64, 1, 0, &longest_ms), 1);
}

static void pieces_are_as_long_as_others_may_wait(void **state)
{
    (void)state;
    double longest_ms;
    /* one second, evenly: 40 pieces but for the first ones and the last */
    int pieces = walk(1000000, 1000, 8, 0.001, UINT64_MAX, &longest_ms);
    assert_int_in_range(pieces, 38, 45);
    assert_true(longest_ms <= 1.6 * TIME_SLICE_MS);
    /* what gets ten times as dear is too long once */
    walk(1000000, 1000, 8, 0.001, 500000, &longest_ms);
    assert_true(longest_ms <= 10 * 1.6 * TIME_SLICE_MS);
    /* a quick pass has few pieces */
    assert_int_in_range(walk(1 << 21, TIME_SLICE_FIRST, 8, 1e-6, UINT64_MAX, &longest_ms), 1, 5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pieces_cover_a_pass_once),
        cmocka_unit_test(without_a_first_size_there_is_one_piece),
        cmocka_unit_test(pieces_are_as_long_as_others_may_wait),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
