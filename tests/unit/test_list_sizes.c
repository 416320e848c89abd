/* SPDX-License-Identifier: MIT */
/* What is known of lists that were: room for more than was seen, soon for more where they grow,
 * slowly for less where they shrink, for each window its own. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "renderer/transparency/list_sizes.h"

static struct content_key key_of(uint64_t window)
{
    struct content_key key = content_key_begin();
    content_key_add_word(&key, window);
    return key;
}

static struct list_sizes room_of(struct list_history *history, uint64_t window)
{
    struct list_sizes room = {.entries = UINT64_MAX};
    assert_true(list_history_find(history, key_of(window), &room));
    return room;
}

static void nothing_is_known_of_a_window_that_was_not(void **state)
{
    struct list_history history = {.clock = 0};
    struct list_sizes room;
    (void)state;
    assert_false(list_history_find(&history, key_of(1), &room));
    list_history_note(&history, key_of(2), (struct list_sizes){.entries = 5, .longest = 1});
    assert_false(list_history_find(&history, key_of(1), &room));
    assert_true(list_history_find(&history, key_of(2), &room));
}

static void room_is_a_quarter_more_and_lists_end_at_powers_of_two(void **state)
{
    static const uint64_t longest[][2] = {{1, 16},  {12, 16},   {13, 16},   {14, 32},
                                          {40, 64}, {100, 128}, {103, 128}, {104, 256}};
    (void)state;
    for (size_t i = 0; i < sizeof longest / sizeof longest[0]; i++) {
        struct list_history history = {.clock = 0};
        list_history_note(&history, key_of(1),
                          (struct list_sizes){.entries = 100000, .longest = longest[i][0]});
        struct list_sizes room = room_of(&history, 1);
        assert_true(room.entries >= 125000 && room.entries < 130000);
        assert_int_equal(longest[i][1], room.longest);
    }
}

static void no_entries_ask_for_no_room(void **state)
{
    struct list_history history = {.clock = 0};
    const struct list_sizes one = {.entries = 1, .longest = 1}, none = {.entries = 0};
    (void)state;
    list_history_note(&history, key_of(1), none);
    struct list_sizes room = room_of(&history, 1);
    assert_int_equal(0, room.entries);
    assert_true(list_sizes_fit(&none, &room));
    assert_false(list_sizes_fit(&one, &room));
}

static void growth_is_taken_up_at_once_and_shrinking_slowly(void **state)
{
    struct list_history history = {.clock = 0};
    (void)state;
    list_history_note(&history, key_of(1), (struct list_sizes){.entries = 10, .longest = 2});
    list_history_note(&history, key_of(1), (struct list_sizes){.entries = 80000, .longest = 80});
    assert_true(room_of(&history, 1).entries >= 100000);
    list_history_note(&history, key_of(1), (struct list_sizes){.entries = 10, .longest = 2});
    assert_true(room_of(&history, 1).entries >= 80000);
    for (int i = 0; i < 100; i++)
        list_history_note(&history, key_of(1), (struct list_sizes){.entries = 10, .longest = 2});
    assert_true(room_of(&history, 1).entries < 2000);
    assert_int_equal(16, room_of(&history, 1).longest);
    for (int i = 0; i < 20; i++)
        list_history_note(&history, key_of(1), (struct list_sizes){.entries = 0});
    assert_int_equal(0, room_of(&history, 1).entries);
}

static void windows_that_take_turns_are_kept_apart(void **state)
{
    struct list_history history = {.clock = 0};
    struct list_sizes room;
    (void)state;
    for (uint64_t i = 0; i < LIST_HISTORY_SLOTS; i++)
        list_history_note(&history, key_of(i),
                          (struct list_sizes){.entries = 10000 * (i + 1), .longest = 1});
    for (uint64_t i = 0; i < LIST_HISTORY_SLOTS; i++)
        assert_true(room_of(&history, i).entries / 12500 == i + 1);
    room_of(&history, 0);
    list_history_note(&history, key_of(99), (struct list_sizes){.entries = 1, .longest = 1});
    assert_false(list_history_find(&history, key_of(1), &room)); /* asked for longest ago */
    assert_true(list_history_find(&history, key_of(0), &room));
}

static void a_list_or_an_entry_too_many_does_not_fit(void **state)
{
    const struct list_sizes room = {.entries = 100, .longest = 16};
    (void)state;
    assert_true(list_sizes_fit(&(struct list_sizes){.entries = 100, .longest = 16}, &room));
    assert_false(list_sizes_fit(&(struct list_sizes){.entries = 101, .longest = 16}, &room));
    assert_false(list_sizes_fit(&(struct list_sizes){.entries = 100, .longest = 17}, &room));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_is_known_of_a_window_that_was_not),
        cmocka_unit_test(room_is_a_quarter_more_and_lists_end_at_powers_of_two),
        cmocka_unit_test(no_entries_ask_for_no_room),
        cmocka_unit_test(growth_is_taken_up_at_once_and_shrinking_slowly),
        cmocka_unit_test(windows_that_take_turns_are_kept_apart),
        cmocka_unit_test(a_list_or_an_entry_too_many_does_not_fit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
