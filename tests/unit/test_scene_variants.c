/* SPDX-License-Identifier: MIT */
/* Variants of materials: what a file says of them, and what a view makes of it. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/scene/compose.h"
#include "renderer/scene/scene_state.h"
#include "tests/support/import_support.h"

/* A mesh of two triangles: the first is Plain, Red by day and Glass by night; the second is Plain.
 */
#define DOCUMENT(variants, mappings)                                                           \
    "{'asset':{'version':'2.0'},'buffers':[{'byteLength':36}],'bufferViews':[{'buffer':0,"     \
    "'byteLength':36}],'accessors':[{'bufferView':0,'componentType':5126,'count':3,'type':"    \
    "'VEC3','min':[0,0,0],'max':[1,1,0]}],'nodes':[{'mesh':0}],'scenes':[{'nodes':[0]}],"      \
    "'materials':[{'name':'Plain'},{'name':'Red'},{'name':'Glass','alphaMode':'BLEND',"        \
    "'pbrMetallicRoughness':{'baseColorFactor':[1,1,1,0.5]}}],'extensionsUsed':["              \
    "'KHR_materials_variants'],'extensionsRequired':['KHR_materials_variants'],'extensions':{" \
    "'KHR_materials_variants':{'variants':" variants "}},'meshes':[{'primitives':[{"           \
    "'attributes':{'POSITION':0},'material':0,'extensions':{'KHR_materials_variants':{"        \
    "'mappings':" mappings "}}},{'attributes':{'POSITION':0},'material':0}]}]}"
#define DAYS "[{'name':'Day'},{'name':'Night'},{'name':'Dusk'}]"
#define MAPPED "[{'material':1,'variants':[0]},{'material':2,'variants':[1]}]"

static const float triangle[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};

static bool import(struct imported_scene *s, const char *json, struct error *err)
{
    return imported_scene_make(s, json, triangle, sizeof triangle, err);
}

static void open_days(struct imported_scene *s)
{
    struct error err = {0};
    if (!import(s, DOCUMENT(DAYS, MAPPED), &err))
        fail_msg("%s", err.message);
}

static struct scene_state state_of(const struct scene *scene, const char *variant)
{
    struct scene_state state;
    struct error err = {0};
    const struct view_part part = {.name = "lid",
                                   .matrix = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
    const struct view view = {.width_px = 8,
                              .height_px = 8,
                              .parts = &part,
                              .part_count = scene->part_count ? 1 : 0,
                              .variant = variant};
    if (!scene_state_init(&state, scene, &view, &err))
        fail_msg("%s", err.message);
    return state;
}

static void a_variant_gives_primitives_its_materials_and_no_others(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        uint32_t first;
        enum state_class class_;
    } cases[] = {{NULL, 0, STATE_OPAQUE},
                 {"Day", 1, STATE_OPAQUE},
                 {"Night", 2, STATE_TRANSPARENT},
                 {"Dusk", 0, STATE_OPAQUE},
                 {"#1", 2, STATE_TRANSPARENT}};
    struct imported_scene s;
    open_days(&s);
    assert_int_equal(s.scene.variant_count, 3);
    assert_string_equal(s.scene.strings + s.scene.variants[1], "Night");
    assert_int_equal(s.scene.extension_ignored_count, 0);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct scene_state of = state_of(&s.scene, cases[i].name);
        assert_int_equal(of.item_count, 2);
        assert_int_equal(of.items[0].material, cases[i].first);
        assert_int_equal(of.items[0].class_, cases[i].class_);
        assert_int_equal(of.items[1].material, 0);
        scene_state_finish(&of);
    }
    imported_scene_finish(&s);
}

static void the_shadow_of_an_opaque_caster_stays_the_same(void **state)
{
    (void)state;
    struct imported_scene s;
    open_days(&s);
    struct scene_state plain = state_of(&s.scene, NULL), day = state_of(&s.scene, "Day");
    struct scene_state night = state_of(&s.scene, "Night");
    assert_true(plain.items[0].shadow_hash == day.items[0].shadow_hash);
    assert_true(plain.items[0].shadow_hash != night.items[0].shadow_hash);
    assert_true(plain.items[1].shadow_hash == night.items[1].shadow_hash);
    scene_state_finish(&plain);
    scene_state_finish(&day);
    scene_state_finish(&night);
    imported_scene_finish(&s);
}

static void expect_unknown(const struct scene *scene, const char *name, const char *says)
{
    struct scene_state state;
    struct error err = {0};
    const struct view view = {.width_px = 8, .height_px = 8, .variant = name};
    assert_false(scene_state_init(&state, scene, &view, &err));
    assert_int_equal(err.code, ERROR_NOT_FOUND);
    assert_string_equal(err.pointer, "/variant");
    if (!strstr(err.message, says))
        fail_msg("%s", err.message);
}

static void an_unknown_variant_is_refused_with_those_that_there_are(void **state)
{
    (void)state;
    struct imported_scene s, none;
    struct error err = {0};
    open_days(&s);
    expect_unknown(&s.scene, "Dawn", "no variant 'Dawn', but 'Day', 'Night', 'Dusk'");
    expect_unknown(&s.scene, "#3", "no variant '#3', but 'Day'");
    imported_scene_finish(&s);
    assert_true(import(&none, DOCUMENT("[]", "[]"), &err));
    expect_unknown(&none.scene, "Day", "no variant 'Day': it has none");
    imported_scene_finish(&none);
}

static void parts_show_their_variant_of_that_name(void **state)
{
    (void)state;
    struct imported_scene s, other;
    struct error err = {0};
    open_days(&s);
    if (!import(&other, DOCUMENT("[{'name':'Rain'},{'name':'Night'}]", MAPPED), &err))
        fail_msg("%s", err.message);
    const struct compose_part part = {.name = "lid", .scene = &other.scene, .identity = 1};
    struct composed_scene *composed = scene_compose(
        &(struct compose_desc){.base = &s.scene, .parts = &part, .part_count = 1}, &err);
    if (!composed)
        fail_msg("%s", err.message);
    const struct scene *whole = composed_scene_get(composed);
    const uint32_t shift = whole->parts[1].first_material;
    const struct {
        const char *name;
        uint32_t base, part;
    } cases[] = {{"Night", 2, shift + 2}, {"Rain", 0, shift + 1}, {"#0", 1, shift}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct scene_state of = state_of(whole, cases[i].name);
        assert_int_equal(of.item_count, 4);
        for (size_t k = 0; k < 4; k++) {
            uint32_t primitive = of.items[k].primitive;
            uint32_t expected = primitive == 0                                 ? cases[i].base
                                : primitive == whole->parts[1].first_primitive ? cases[i].part
                                : primitive == 1                               ? 0
                                                                               : shift;
            assert_int_equal(of.items[k].material, expected);
        }
        scene_state_finish(&of);
    }
    composed_scene_destroy(composed);
    imported_scene_finish(&other);
    imported_scene_finish(&s);
}

static void malformed_mappings_are_refused_by_number(void **state)
{
    (void)state;
    static const struct {
        const char *json, *says;
    } cases[] = {
        {DOCUMENT(DAYS, "[{'material':9,'variants':[0]}]"), "there is no material 9"},
        {DOCUMENT(DAYS, "[{'material':1,'variants':[3]}]"), "there is no variant 3"},
        {DOCUMENT(DAYS, "[{'material':1,'variants':[0]},{'material':2,'variants':[0]}]"),
         "variant 0 has two materials"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct imported_scene s;
        struct error err = {0};
        assert_false(import(&s, cases[i].json, &err));
        assert_int_equal(err.code, ERROR_INVALID_SCENE);
        if (!strstr(err.message, cases[i].says) || !strstr(err.message, "mesh 0"))
            fail_msg("%zu: %s", i, err.message);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_variant_gives_primitives_its_materials_and_no_others),
        cmocka_unit_test(the_shadow_of_an_opaque_caster_stays_the_same),
        cmocka_unit_test(an_unknown_variant_is_refused_with_those_that_there_are),
        cmocka_unit_test(parts_show_their_variant_of_that_name),
        cmocka_unit_test(malformed_mappings_are_refused_by_number),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
