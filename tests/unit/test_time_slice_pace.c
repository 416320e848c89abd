/* SPDX-License-Identifier: MIT */
/* What a device did in a millisecond in frames before: the first piece of a pass takes as long as
 * others may wait, for each kind of frame by its own times. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "renderer/window/time_slice_pace.h"
#include "renderer/window/time_slices.h"

enum { PIXELS = 100000 };

static struct content_key key_of(uint64_t kind)
{
    struct content_key key = content_key_begin();
    content_key_add_word(&key, kind);
    return key;
}

/* A frame that lit 5000 entries in 2 ms, all pixels in 10 and built 6 structures in 3. */
static struct frame_report report_of(double factor)
{
    struct frame_report report = {.pass_count = 0};
    report_add_pass(&report, "shadow.deep.sort", "", "", 1 * factor, REPORT_SHADOW);
    report_add_pass(&report, "shadow.depth", "", "", 2 * factor, REPORT_SHADOW);
    report_add_pass(&report, "shade.transparent", "", "", 2 * factor, REPORT_SHADE);
    report_add_pass(&report, "shade.opaque", "one", "", 4 * factor, REPORT_SHADE);
    report_add_pass(&report, "shade.opaque", "two", "", 6 * factor, REPORT_SHADE);
    report.counts.transparent_fragments = 5000;
    report.counts.shadow_maps_built = 6;
    return report;
}

static void an_unknown_device_begins_as_it_is_told(void **state)
{
    const struct time_slice_history history = {.clock = 0};
    (void)state;
    const struct time_slice_pace pace = time_slice_history_find(&history, key_of(1));
    for (int i = 0; i < TIME_SLICE_KINDS; i++)
        assert_int_equal(77, time_slice_pace_first(&pace, (enum time_slice_kind)i, 77));
}

static void the_first_piece_takes_as_long_as_others_may_wait(void **state)
{
    struct time_slice_history history = {.clock = 0};
    const struct frame_report report = report_of(1);
    (void)state;
    time_slice_history_note(&history, key_of(1), PIXELS, &report);
    const struct time_slice_pace pace = time_slice_history_find(&history, key_of(1));
    assert_int_equal(2500 * TIME_SLICE_MS, time_slice_pace_first(&pace, TIME_SLICE_LAYERS, 77));
    assert_int_equal(PIXELS / 10 * TIME_SLICE_MS,
                     time_slice_pace_first(&pace, TIME_SLICE_PIXELS, 77));
    assert_int_equal(2 * TIME_SLICE_MS, time_slice_pace_first(&pace, TIME_SLICE_SHADOWS, 77));
    const struct frame_report slow = report_of(1e9);
    time_slice_history_note(&history, key_of(1), PIXELS, &slow);
    const struct time_slice_pace slowly = time_slice_history_find(&history, key_of(1));
    assert_int_equal(1, time_slice_pace_first(&slowly, TIME_SLICE_PIXELS, 77)); /* never none */
}

static void what_a_frame_did_not_do_stays_as_it_was(void **state)
{
    struct time_slice_history history = {.clock = 0};
    const struct frame_report report = report_of(1);
    struct frame_report warm = {.pass_count = 0};
    (void)state;
    time_slice_history_note(&history, key_of(1), PIXELS, &report);
    report_add_pass(&warm, "shade.opaque", "", "", 0, REPORT_SHADE); /* a device without times */
    time_slice_history_note(&history, key_of(1), PIXELS, &warm);
    const struct time_slice_pace pace = time_slice_history_find(&history, key_of(1));
    assert_int_equal(2 * TIME_SLICE_MS, time_slice_pace_first(&pace, TIME_SLICE_SHADOWS, 77));
    assert_int_equal(PIXELS / 10 * TIME_SLICE_MS,
                     time_slice_pace_first(&pace, TIME_SLICE_PIXELS, 77));
}

static void frames_of_another_kind_have_their_own_times(void **state)
{
    struct time_slice_history history = {.clock = 0};
    (void)state;
    for (uint64_t kind = 0; kind <= TIME_SLICE_HISTORY_SLOTS; kind++) {
        const struct frame_report report = report_of((double)(kind + 1));
        time_slice_history_note(&history, key_of(kind), PIXELS, &report);
    }
    const struct time_slice_pace gone = time_slice_history_find(&history, key_of(0));
    assert_int_equal(77, time_slice_pace_first(&gone, TIME_SLICE_PIXELS, 77));
    const struct time_slice_pace third = time_slice_history_find(&history, key_of(3));
    assert_int_equal(PIXELS / 40 * TIME_SLICE_MS,
                     time_slice_pace_first(&third, TIME_SLICE_PIXELS, 77));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_unknown_device_begins_as_it_is_told),
        cmocka_unit_test(the_first_piece_takes_as_long_as_others_may_wait),
        cmocka_unit_test(what_a_frame_did_not_do_stays_as_it_was),
        cmocka_unit_test(frames_of_another_kind_have_their_own_times),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
