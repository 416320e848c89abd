/* SPDX-License-Identifier: MIT */
/* Every technique is held to its row: what it cannot is refused, or warned of. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/plan/technique_check.h"

static bool check(enum shadow_technique shadows, const struct technique_demand *demand,
                  struct technique_lacks *lacks, struct error *err)
{
    struct view_quality quality = *demand->quality;
    struct technique_demand asked = *demand;
    quality.shadows = shadows;
    asked.quality = &quality;
    asked.lights = 3;
    *err = (struct error){0};
    return technique_check(&asked, lacks, err);
}

static void a_demand_that_the_row_meets_passes_silently(void **state)
{
    (void)state;
    const struct view_quality quality = {.samples = 4};
    for (int i = 0; i < SHADOWS_COUNT; i++) {
        struct technique_lacks lacks;
        struct error err;
        assert_true(check((enum shadow_technique)i, &(struct technique_demand){.quality = &quality},
                          &lacks, &err));
        assert_int_equal(lacks.count, 0);
    }
}

/* The quality, or the demand, asks for this one thing. */
static void expect_refusals(const struct technique_demand *demand, unsigned can)
{
    for (int i = 0; i < SHADOWS_COUNT; i++) {
        struct technique_lacks lacks;
        struct error err;
        bool is_met = shadow_technique_can((enum shadow_technique)i, can);
        assert_int_equal(check((enum shadow_technique)i, demand, &lacks, &err), is_met);
        assert_true(is_met || err.code == ERROR_INVALID_REQUEST);
    }
}

static void expect_warnings(const struct technique_demand *demand, unsigned can, const char *text)
{
    for (int i = 0; i < SHADOWS_COUNT; i++) {
        struct technique_lacks lacks;
        struct error err;
        bool is_met = shadow_technique_can((enum shadow_technique)i, can);
        assert_true(check((enum shadow_technique)i, demand, &lacks, &err));
        assert_int_equal(lacks.count, !is_met);
        assert_true(is_met || strstr(lacks.texts[0], text));
    }
}

static void references_samples_and_linked_lists_are_refused_by_the_row(void **state)
{
    (void)state;
    const struct view_quality reference = {.reference = true}, samples = {.samples = 64},
                              linked = {.light_lists = VIEW_LIGHT_LISTS_LINKED};
    expect_refusals(&(struct technique_demand){.quality = &reference}, SHADOW_CAN_REFERENCE);
    expect_refusals(&(struct technique_demand){.quality = &samples}, SHADOW_CAN_MANY_SAMPLES);
    expect_refusals(&(struct technique_demand){.quality = &linked, .window_lights = 2},
                    SHADOW_CAN_LINKED_LISTS);
}

static void area_lights_and_colors_are_warned_of_by_the_row(void **state)
{
    (void)state;
    const struct view_quality quality = {.samples = 1};
    expect_warnings(
        &(struct technique_demand){.quality = &quality, .is_rasterised = true, .area_lights = 2},
        SHADOW_CAN_AREA_LIGHTS, "2 area lights have a hard shadow, from the centre");
    expect_warnings(&(struct technique_demand){.quality = &quality, .unfiltered_lights = 2},
                    SHADOW_CAN_FILTER, "unchanged, of 2 of 3 lights");
}

static void what_becomes_of_light_in_glass_is_warned_of_by_the_row(void **state)
{
    (void)state;
    const struct view_quality quality = {.samples = 1};
    expect_warnings(&(struct technique_demand){.quality = &quality, .gray_lights = 2},
                    SHADOW_CAN_COLOR, "without colouring it, of 2 of 3 lights");
    expect_warnings(&(struct technique_demand){.quality = &quality, .layered_lights = 2},
                    SHADOW_CAN_LAYERS, "the light behind the last, of 2 of 3 lights");
    expect_warnings(&(struct technique_demand){.quality = &quality, .bodied_lights = 2},
                    SHADOW_CAN_INSIDE,
                    "no shadow on itself, and haze behind the first gets the "
                    "light behind the last, of 2 of 3 lights; deep tells");
    expect_warnings(&(struct technique_demand){.quality = &quality, .excluding_lights = 2},
                    SHADOW_CAN_SELF_SHADOW, "of 2 of 3 lights; deep leaves them out");
}

static void thick_media_are_warned_of(void **state)
{
    (void)state;
    const struct view_quality quality = {.shadows = SHADOWS_DEEP_LINKED};
    struct technique_lacks lacks;
    struct error err;
    assert_true(
        check(SHADOWS_DEEP_LINKED,
              &(struct technique_demand){.quality = &quality, .thick_media = SHADOWS_DEEP_LINKED},
              &lacks, &err));
    assert_int_equal(lacks.count, 1);
    assert_non_null(strstr(lacks.texts[0], "deep-linked has no room for media"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_demand_that_the_row_meets_passes_silently),
        cmocka_unit_test(references_samples_and_linked_lists_are_refused_by_the_row),
        cmocka_unit_test(area_lights_and_colors_are_warned_of_by_the_row),
        cmocka_unit_test(what_becomes_of_light_in_glass_is_warned_of_by_the_row),
        cmocka_unit_test(thick_media_are_warned_of),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
