/* SPDX-License-Identifier: MIT */
/* What is known of the lists of lights that were: room for more than was seen, of lists of any
 * length that these may grow to, soon for more and slowly for less, for as many lights as there
 * are. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "renderer/shadows/shadow_sizes.h"

static struct content_key key_of(uint64_t light)
{
    struct content_key key = content_key_begin();
    content_key_add_word(&key, light);
    return key;
}

static struct deep_statistics room_of(const struct shadow_history *history, uint64_t light)
{
    struct deep_statistics room;
    assert_true(shadow_history_find(history, key_of(light), &room));
    return room;
}

static const struct deep_statistics many = {
    .total = 100000, .longest = 40, .occupied = 20000, .classes = {8000, 4000, 0, 0, 20, 1}};

static void nothing_is_known_of_a_light_that_was_not(void **state)
{
    struct shadow_history history = {.count = 0};
    struct deep_statistics room;
    (void)state;
    assert_false(shadow_history_find(&history, key_of(1), &room));
    shadow_history_note(&history, key_of(2), &many);
    assert_false(shadow_history_find(&history, key_of(1), &room));
    assert_true(shadow_history_find(&history, key_of(2), &room));
    shadow_history_finish(&history);
}

static void room_is_a_quarter_more_of_all_that_was_seen(void **state)
{
    struct deep_statistics room = deep_statistics_room(&many);
    (void)state;
    assert_true(deep_statistics_fit(&many, &room));
    assert_in_range(room.total, 125000, 126000);
    assert_in_range(room.longest, 50, 52);
    for (int c = 0; c < DEEP_CLASSES; c++)
        if (1u << c < room.longest)
            assert_true(room.classes[c] > many.classes[c] + many.classes[c] / 4);
        else
            assert_int_equal(0, room.classes[c]);
}

static void lists_may_wander_to_the_classes_beside_theirs(void **state)
{
    const struct deep_statistics seen = {
        .total = 40000, .longest = 4, .occupied = 20000, .classes = {0, 10000}};
    struct deep_statistics next = seen, room = deep_statistics_room(&seen);
    (void)state;
    next.classes[0] = next.classes[1] / 4;
    assert_true(deep_statistics_fit(&next, &room)); /* and texels of one event */
    next.classes[0] += 10000 / 4;
    assert_true(deep_statistics_fit(&next, &room));
    next.classes[0] = 10000;
    assert_false(deep_statistics_fit(&next, &room));
}

static void lists_that_need_no_keys_have_room_for_none_that_do(void **state)
{
    (void)state;
    for (uint32_t longest = 1; longest <= 2 * SHADOW_SHORT_LIST; longest++) {
        const struct deep_statistics seen = {.total = longest, .longest = longest};
        uint32_t room = deep_statistics_room(&seen).longest;
        assert_true(room >= longest);
        assert_true(room > SHADOW_SHORT_LIST || longest <= SHADOW_SHORT_LIST);
        assert_true(room <= SHADOW_SHORT_LIST || longest > SHADOW_SHORT_LIST);
    }
}

static void no_events_ask_for_no_room(void **state)
{
    const struct deep_statistics none = {.total = 0}, one = {.total = 1, .longest = 1};
    const struct deep_statistics room = deep_statistics_room(&none);
    (void)state;
    assert_true(deep_statistics_fit(&none, &room));
    assert_false(deep_statistics_fit(&one, &room));
}

static void anything_too_many_does_not_fit(void **state)
{
    (void)state;
    for (size_t word = 0; word < DEEP_STATISTIC_WORDS; word++) {
        union {
            struct deep_statistics sizes;
            uint32_t words[DEEP_STATISTIC_WORDS];
        } more = {.sizes = many};
        more.words[word]++;
        bool is_told_alone = word == offsetof(struct deep_statistics, occupied) / 4;
        assert_true(deep_statistics_fit(&more.sizes, &many) == is_told_alone);
    }
}

static void growth_is_taken_up_at_once_and_shrinking_slowly(void **state)
{
    static const struct deep_statistics few = {.total = 10, .longest = 2, .occupied = 5};
    struct shadow_history history = {.count = 0};
    (void)state;
    shadow_history_note(&history, key_of(1), &few);
    shadow_history_note(&history, key_of(1), &many);
    assert_true(room_of(&history, 1).total >= 125000);
    shadow_history_note(&history, key_of(1), &few);
    struct deep_statistics room = room_of(&history, 1);
    assert_in_range(room.total, 100000, 125000);
    assert_true(room.classes[0] > many.classes[0]);
    for (int i = 0; i < 100; i++)
        shadow_history_note(&history, key_of(1), &few);
    assert_true(room_of(&history, 1).total < 300);
    for (int i = 0; i < 20; i++)
        shadow_history_note(&history, key_of(1), &(struct deep_statistics){.total = 0});
    assert_int_equal(0, room_of(&history, 1).total);
    shadow_history_finish(&history);
}

static void totals_beyond_32_bits_stay_what_they_are(void **state)
{
    const struct deep_statistics huge = {
        .total = UINT32_MAX, .total_high = 3, .longest = UINT32_MAX, .occupied = UINT32_MAX};
    struct shadow_history history = {.count = 0};
    (void)state;
    for (int i = 0; i < 2; i++) {
        shadow_history_note(&history, key_of(1), &huge);
        struct deep_statistics room = room_of(&history, 1);
        assert_int_equal(5, room.total_high);
        assert_int_equal(UINT32_MAX, room.longest);
        assert_true(deep_statistics_fit(&huge, &room));
    }
    shadow_history_finish(&history);
}

static void any_number_of_lights_is_known_and_beyond_the_most_all_are_forgotten(void **state)
{
    enum { LIGHTS = SHADOW_HISTORY_MOST / 4 * 3 };
    struct shadow_history history = {.count = 0};
    struct deep_statistics room;
    (void)state;
    for (uint32_t i = 0; i < LIGHTS; i++)
        shadow_history_note(&history, key_of(i),
                            &(struct deep_statistics){.total = 1000 * (i + 1)});
    for (uint32_t i = 0; i < LIGHTS; i++)
        assert_in_range(room_of(&history, i).total, 1250 * (i + 1), 1250 * (i + 1) + 300);
    assert_int_equal(SHADOW_HISTORY_MOST, history.capacity);
    shadow_history_note(&history, key_of(LIGHTS), &many);
    assert_int_equal(1, history.count);
    assert_false(shadow_history_find(&history, key_of(0), &room));
    assert_true(shadow_history_find(&history, key_of(LIGHTS), &room));
    shadow_history_finish(&history);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_is_known_of_a_light_that_was_not),
        cmocka_unit_test(room_is_a_quarter_more_of_all_that_was_seen),
        cmocka_unit_test(lists_may_wander_to_the_classes_beside_theirs),
        cmocka_unit_test(lists_that_need_no_keys_have_room_for_none_that_do),
        cmocka_unit_test(no_events_ask_for_no_room),
        cmocka_unit_test(anything_too_many_does_not_fit),
        cmocka_unit_test(growth_is_taken_up_at_once_and_shrinking_slowly),
        cmocka_unit_test(totals_beyond_32_bits_stay_what_they_are),
        cmocka_unit_test(any_number_of_lights_is_known_and_beyond_the_most_all_are_forgotten),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
