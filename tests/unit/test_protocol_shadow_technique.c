/* SPDX-License-Identifier: MIT */
/* The rows of the shadow techniques, and what is made of them. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "protocol/shadow_technique.h"

static void every_row_has_a_name_of_its_own_and_a_sentence(void **state)
{
    (void)state;
    for (int i = 0; i < SHADOWS_COUNT; i++) {
        const struct shadow_technique_row *row = &shadow_technique_rows[i];
        assert_string_equal(row->name, shadow_technique_name(i));
        assert_true(strlen(row->sentence) > 20);
        for (int k = 0; k < i; k++)
            assert_string_not_equal(row->name, shadow_technique_name(k));
    }
}

static void numbers_beyond_the_rows_have_no_name(void **state)
{
    (void)state;
    assert_null(shadow_technique_name(-1));
    assert_null(shadow_technique_name(SHADOWS_COUNT));
    assert_false(shadow_technique_can((enum shadow_technique)SHADOWS_COUNT, 0));
}

static void names_are_found(void **state)
{
    (void)state;
    for (int i = 0; i < SHADOWS_COUNT; i++)
        assert_int_equal(shadow_technique_find(shadow_technique_name(i)), i);
    assert_int_equal(shadow_technique_find("deeper"), SHADOWS_COUNT);
    assert_int_equal(shadow_technique_find(""), SHADOWS_COUNT);
}

/* What `auto` takes where nothing gains can be told, and is the nearest of all. */
static void auto_has_candidates_and_a_default(void **state)
{
    (void)state;
    int candidates = 0;
    assert_true(shadow_technique_is_candidate(SHADOWS_RASTER_DEFAULT));
    assert_false(shadow_technique_is_renderer(SHADOWS_RASTER_DEFAULT));
    assert_false(shadow_technique_is_candidate(SHADOWS_AUTO));
    assert_false(shadow_technique_is_candidate(SHADOWS_COUNT));
    for (int i = 0; i < SHADOWS_COUNT; i++) {
        const struct shadow_technique_row *row = &shadow_technique_rows[i];
        bool is_nearest = i == SHADOWS_AUTO || i == SHADOWS_RASTER_DEFAULT;
        assert_int_equal(row->distance == 0, is_nearest);
        candidates += shadow_technique_is_candidate((enum shadow_technique)i);
        for (int k = 0; k < i && row->candidate; k++)
            assert_true(!shadow_technique_rows[k].candidate ||
                        strcmp(row->candidate, shadow_technique_rows[k].candidate) != 0);
    }
    assert_true(candidates >= 2);
}

static void each_bit_of_a_row_has_a_name(void **state)
{
    (void)state;
    unsigned can = 0, parameters = 0;
    for (int i = 0; i < SHADOWS_COUNT; i++) {
        can |= shadow_technique_rows[i].can;
        parameters |= shadow_technique_rows[i].parameters;
    }
    for (int bit = 0; bit < 32; bit++) {
        assert_int_equal(shadow_can_name(bit) != NULL, (can >> bit & 1) != 0);
        assert_int_equal(shadow_parameter_name(bit) != NULL, (parameters >> bit & 1) != 0);
    }
}

static void techniques_are_known_by_what_they_can_and_have(void **state)
{
    (void)state;
    char text[SHADOW_TECHNIQUES_TEXT_BYTES];
    shadow_techniques_text(SHADOW_CAN_REFERENCE, 0, text);
    assert_string_equal(text, "auto or raytraced");
    shadow_techniques_text(0, SHADOW_HAS_MAP, text);
    assert_int_equal(0, strncmp(text, "auto, map, deep", 15));
    assert_null(strstr(text, "raytraced"));
    for (int i = 0; i < SHADOWS_COUNT; i++)
        if (shadow_technique_has((enum shadow_technique)i, SHADOW_HAS_MAP))
            assert_non_null(strstr(text, shadow_technique_name(i)));
    assert_non_null(strstr(text, " or "));
    shadow_techniques_text(SHADOW_CAN_MANY_SAMPLES, 0, text);
    assert_string_equal(text, "raytraced");
    shadow_techniques_text(0, 0, text); /* all, and they fit */
    assert_non_null(strstr(text, shadow_technique_name(SHADOWS_COUNT - 1)));
    assert_true(strlen(text) + 1 < SHADOW_TECHNIQUES_TEXT_BYTES);
}

static void noisy_techniques_take_more_taps_where_nothing_is_said(void **state)
{
    (void)state;
    assert_int_equal(shadow_technique_taps(SHADOWS_DEEP, 0), 4);
    assert_int_equal(shadow_technique_taps(SHADOWS_STOCHASTIC, 0), 64);
    assert_int_equal(shadow_technique_taps(SHADOWS_COLORED_STOCHASTIC, 0), 64);
    assert_int_equal(shadow_technique_taps(SHADOWS_COLORED_STOCHASTIC, 9), 9);
}

static void families_follow_from_the_rows(void **state)
{
    (void)state;
    static const enum shadow_family families[] = {
        [SHADOWS_AUTO] = SHADOW_FAMILY_MAPS,
        [SHADOWS_NONE] = SHADOW_FAMILY_NONE,
        [SHADOWS_MAP] = SHADOW_FAMILY_MAPS,
        [SHADOWS_DEEP] = SHADOW_FAMILY_MAPS,
        [SHADOWS_DEEP_LINKED] = SHADOW_FAMILY_MAPS,
        [SHADOWS_TRANSLUCENT] = SHADOW_FAMILY_MAPS,
        [SHADOWS_STOCHASTIC] = SHADOW_FAMILY_MAPS,
        [SHADOWS_COLORED_STOCHASTIC] = SHADOW_FAMILY_MAPS,
        [SHADOWS_COMPOSITED] = SHADOW_FAMILY_MAPS,
        [SHADOWS_MOMENTS] = SHADOW_FAMILY_MAPS,
        [SHADOWS_RAYTRACED] = SHADOW_FAMILY_RAYS,
        [SHADOWS_RAYTRACED_SHADOWS] = SHADOW_FAMILY_POINTS,
        [SHADOWS_AREA] = SHADOW_FAMILY_POINTS,
        [SHADOWS_VOLUME] = SHADOW_FAMILY_POINTS,
        [SHADOWS_SILHOUETTE] = SHADOW_FAMILY_POINTS,
    };
    for (size_t i = 0; i < sizeof families / sizeof *families; i++)
        assert_int_equal(shadow_technique_family((enum shadow_technique)i), families[i]);
}

static void help_texts_name_them_all(void **state)
{
    (void)state;
    assert_int_equal(0, strncmp(SHADOW_TECHNIQUE_NAMES, "auto, none, map, ", 17));
    assert_non_null(strstr(SHADOW_TECHNIQUE_NAMES, shadow_technique_name(SHADOWS_COUNT - 1)));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_row_has_a_name_of_its_own_and_a_sentence),
        cmocka_unit_test(numbers_beyond_the_rows_have_no_name),
        cmocka_unit_test(names_are_found),
        cmocka_unit_test(auto_has_candidates_and_a_default),
        cmocka_unit_test(each_bit_of_a_row_has_a_name),
        cmocka_unit_test(techniques_are_known_by_what_they_can_and_have),
        cmocka_unit_test(noisy_techniques_take_more_taps_where_nothing_is_said),
        cmocka_unit_test(families_follow_from_the_rows),
        cmocka_unit_test(help_texts_name_them_all),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
