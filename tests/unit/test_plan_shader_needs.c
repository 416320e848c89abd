/* SPDX-License-Identifier: MIT */
/* Masks of what a scene's shaders must be able to do: nothing is missing, nothing is for nobody. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/draw/shader_needs.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

/* A state of up to four drawables, each with a mesh and a material of its own, and four lights. */
struct small_state {
    struct scene scene;
    struct scene_primitive primitives[4];
    double world[1][16];
    struct scene_state state;
    struct state_item items[4];
    struct state_material materials[4];
    struct state_light lights[4];
};

static struct small_state *small_state_create(size_t items, size_t lights)
{
    struct small_state *small = calloc(1, sizeof *small);
    assert_non_null(small);
    small->scene.primitives = small->primitives;
    small->state = (struct scene_state){.scene = &small->scene,
                                        .world = small->world,
                                        .items = small->items,
                                        .item_count = items,
                                        .materials = small->materials,
                                        .lights = small->lights,
                                        .light_count = lights};
    for (uint32_t i = 0; i < 4; i++)
        small->items[i].material = small->items[i].primitive = i;
    return small;
}

static void a_plain_scene_needs_nothing(void **state)
{
    (void)state;
    char text[SHADER_NEEDS_TEXT_BYTES];
    struct small_state *small = small_state_create(2, 0);
    struct shader_needs needs = shader_needs_of(&small->state);
    assert_int_equal(needs.surface_kinds, 0);
    assert_int_equal(needs.layer_kinds, 0);
    assert_false(needs.has_smooth);
    shader_needs_material_defines(needs.surface_kinds, text);
    assert_string_equal(text, " MATERIAL_KINDS=0u");
    shader_needs_light_defines(&needs, text);
    assert_string_equal(text, "");
    free(small);
}

static void kinds_are_told_apart_by_pass(void **state)
{
    (void)state;
    struct small_state *small = small_state_create(4, 0);
    small->materials[0].base.flags = SCENE_MATERIAL_UNLIT;
    small->materials[1].base.metallic = 0.5f;
    small->items[2].class_ = STATE_TRANSPARENT;
    small->materials[2].base.transmission = 1;
    small->materials[2].base.pass_through = SCENE_PASS_EDGE;
    small->items[3].is_medium = true;
    small->materials[3].base.alpha_mode = SCENE_BLEND;
    small->materials[3].no_self_shadow = true;
    struct shader_needs needs = shader_needs_of(&small->state);
    assert_int_equal(needs.surface_kinds, MATERIAL_UNLIT | MATERIAL_KIND_METAL);
    assert_int_equal(needs.layer_kinds, MATERIAL_TRANSMISSION | MATERIAL_PASS_EDGE |
                                            MATERIAL_BLEND | MATERIAL_NO_SELF_SHADOW);
    free(small);
}

static void smooth_meshes_count_where_they_are_opaque(void **state)
{
    (void)state;
    struct small_state *small = small_state_create(3, 0);
    small->primitives[1].flags = small->primitives[2].flags = SCENE_PRIMITIVE_IS_SMOOTH;
    small->items[1].class_ = STATE_TRANSPARENT;
    small->items[2].is_medium = true;
    assert_false(shader_needs_of(&small->state).has_smooth);
    small->primitives[0].flags = SCENE_PRIMITIVE_IS_SMOOTH;
    small->items[0].class_ = STATE_MASKED;
    assert_true(shader_needs_of(&small->state).has_smooth);
    free(small);
}

static void every_kind_of_light_counts(void **state)
{
    (void)state;
    static const struct {
        enum scene_light_type type;
        uint32_t kind;
    } kinds[] = {{SCENE_LIGHT_DIRECTIONAL, LIGHT_DIRECTIONAL},
                 {SCENE_LIGHT_POINT, LIGHT_POINT},
                 {SCENE_LIGHT_SPOT, LIGHT_SPOT},
                 {SCENE_LIGHT_RECT, LIGHT_AREA}};
    struct small_state *small = small_state_create(0, 1);
    for (size_t i = 0; i < 4; i++) {
        char text[SHADER_NEEDS_TEXT_BYTES], expected[64];
        small->lights[0].type = kinds[i].type;
        struct shader_needs needs = shader_needs_of(&small->state);
        assert_int_equal(needs.light_kinds, 1u << kinds[i].kind);
        assert_false(needs.has_ranges);
        shader_needs_light_defines(&needs, text);
        snprintf(expected, sizeof expected, " LIGHT_KINDS=%uu", 1u << kinds[i].kind);
        assert_string_equal(text, expected);
    }
    small->state.light_count = 2;
    small->lights[1] = (struct state_light){.type = SCENE_LIGHT_POINT, .range = 3};
    struct shader_needs needs = shader_needs_of(&small->state);
    assert_int_equal(needs.light_kinds, 1u << LIGHT_AREA | 1u << LIGHT_POINT);
    assert_true(needs.has_ranges);
    free(small);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_plain_scene_needs_nothing),
        cmocka_unit_test(kinds_are_told_apart_by_pass),
        cmocka_unit_test(smooth_meshes_count_where_they_are_opaque),
        cmocka_unit_test(every_kind_of_light_counts),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
