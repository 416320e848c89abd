/* SPDX-License-Identifier: MIT */
/* The table of shadow techniques: which one takes a light, and what each says of itself. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "renderer/shadows/shadow_programs.h"
#include "renderer/shadows/technique.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

static const struct shadow_casters opaque = {.count = 1, .opaque_count = 1};
static const struct shadow_casters glass = {.count = 1, .transparent_count = 1};
static const struct shadow_casters nothing = {.count = 0};

static enum shadow_technique chosen(enum shadow_technique asked,
                                    const struct shadow_casters *casters, bool faithful)
{
    const struct view_quality quality = {.shadows = asked, .faithful = faithful};
    const struct shadow_method *method = shadow_method_choose(casters, &quality);
    return method ? method->id : SHADOWS_NONE;
}

static void every_technique_but_none_has_functions(void **state)
{
    (void)state;
    for (int i = 0; i < SHADOWS_COUNT; i++) {
        const struct shadow_method *method = shadow_method_of((enum shadow_technique)i);
        assert_int_equal(i == SHADOWS_NONE, method == NULL);
        assert_true(!method || (method->wants && method->passes));
    }
}

static void a_kind_leads_to_the_technique_that_has_it(void **state)
{
    (void)state;
    for (uint32_t kind = 0; kind < SHADOW_KINDS; kind++) {
        const struct shadow_method *method = shadow_method_of_kind(kind);
        assert_int_equal(method->kind, kind);
        assert_int_equal(method->scope, SHADOW_PER_LIGHT);
        assert_true(method == shadow_method_of(method->id));
        assert_int_equal(method->texel_bytes, method->has_lists ? 8 : 4);
    }
}

static void every_pass_of_a_light_lists_programs(void **state)
{
    (void)state;
    assert_non_null(shadow_depth_pass.list_programs);
    for (uint32_t kind = 0; kind < SHADOW_KINDS; kind++)
        for (const struct shadow_pass *pass = shadow_method_of_kind(kind)->passes; pass->name;
             pass++)
            assert_true(pass->list_programs && !pass->is_of_windows);
}

static void lights_without_transparent_casters_have_plain_maps(void **state)
{
    (void)state;
    static const enum shadow_technique asked[] = {SHADOWS_AUTO, SHADOWS_MAP, SHADOWS_DEEP,
                                                  SHADOWS_DEEP_LINKED};
    for (size_t i = 0; i < sizeof asked / sizeof *asked; i++)
        assert_int_equal(chosen(asked[i], &opaque, false), SHADOWS_MAP);
    assert_int_equal(chosen(SHADOWS_DEEP_LINKED, &opaque, true), SHADOWS_DEEP_LINKED);
    assert_int_equal(chosen(SHADOWS_RAYTRACED_SHADOWS, &opaque, false), SHADOWS_RAYTRACED_SHADOWS);
}

static void lights_behind_glass_have_lists(void **state)
{
    (void)state;
    assert_int_equal(chosen(SHADOWS_AUTO, &glass, false), SHADOWS_DEEP);
    assert_int_equal(chosen(SHADOWS_DEEP, &glass, false), SHADOWS_DEEP);
    assert_int_equal(chosen(SHADOWS_DEEP_LINKED, &glass, false), SHADOWS_DEEP_LINKED);
    assert_int_equal(chosen(SHADOWS_RAYTRACED_SHADOWS, &glass, false), SHADOWS_RAYTRACED_SHADOWS);
    assert_int_equal(chosen(SHADOWS_MAP, &glass, false), SHADOWS_NONE); /* it casts none there */
}

static void lights_without_casters_shine_without_a_shadow(void **state)
{
    (void)state;
    for (int i = 0; i < SHADOWS_COUNT; i++)
        assert_int_equal(chosen((enum shadow_technique)i, &nothing, true), SHADOWS_NONE);
}

/* The rows tell what the functions do: a caster that filters light needs a technique with colours.
 */
static void techniques_with_lists_can_color(void **state)
{
    (void)state;
    for (uint32_t kind = 0; kind < SHADOW_KINDS; kind++) {
        const struct shadow_method *method = shadow_method_of_kind(kind);
        assert_int_equal(shadow_technique_can(method->id, SHADOW_CAN_COLOR), method->has_lists);
    }
}

static void queries_name_what_a_map_has(void **state)
{
    (void)state;
    static const struct {
        struct shadow_map map;
        const char *defines;
    } cases[] = {
        {{.kind = SHADOW_MAP, .frame.shape = SHADOW_CUBE},
         "SHADOW_HAS_MAPS SHADOW_HAS_PERSPECTIVE SHADOW_HAS_CUBES"},
        {{.kind = SHADOW_DEEP, .frame.shape = SHADOW_ORTHOGRAPHIC, .longest_list = 100},
         "SHADOW_HAS_MAPS SHADOW_HAS_ORTHOGRAPHIC SHADOW_HAS_DEEP SHADOW_HAS_LONG"},
        {{.kind = SHADOW_DEEP, .flags = SHADOW_FLAG_RAW | SHADOW_FLAG_MEDIA, .longest_list = 100},
         "SHADOW_HAS_MAPS SHADOW_HAS_PERSPECTIVE SHADOW_HAS_DEEP SHADOW_HAS_IDS SHADOW_HAS_MEDIA"},
        {{.kind = SHADOW_LINKED, .is_faithful = true},
         "SHADOW_HAS_MAPS SHADOW_HAS_PERSPECTIVE SHADOW_HAS_LINKED SHADOW_FAITHFUL"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct shadow_features features = {{false}};
        char text[SHADOW_DEFINES_BYTES];
        shadow_features_add(&features, &cases[i].map);
        shadow_features_write(&features, text);
        assert_string_equal(text, cases[i].defines);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_technique_but_none_has_functions),
        cmocka_unit_test(a_kind_leads_to_the_technique_that_has_it),
        cmocka_unit_test(every_pass_of_a_light_lists_programs),
        cmocka_unit_test(lights_without_transparent_casters_have_plain_maps),
        cmocka_unit_test(lights_behind_glass_have_lists),
        cmocka_unit_test(lights_without_casters_shine_without_a_shadow),
        cmocka_unit_test(techniques_with_lists_can_color),
        cmocka_unit_test(queries_name_what_a_map_has),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
