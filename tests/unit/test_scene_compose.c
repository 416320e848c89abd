/* SPDX-License-Identifier: MIT */
/* Composed scenes: what stays, what follows where, how it is called, and what is refused. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdlib.h>
#include <string.h>

#include "renderer/scene/compose.h"
#include "renderer/scene/scene_state.h"
#include "tests/support/import_support.h"

static const float corners[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};

#define DOCUMENT                                                                            \
    "{'asset':{'version':'2.0'},'buffers':[{'byteLength':36}],'bufferViews':[{'buffer':0,"  \
    "'byteLength':36}],'accessors':[{'bufferView':0,'componentType':5126,'count':3,'type':" \
    "'VEC3'}],'scenes':[{'nodes':[0]}],'nodes':[{'name':'Root','children':[1,2]},{'name':"  \
    "'Leaf','mesh':0,'translation':[0,0,1]},{}],'meshes':[{'primitives':[{'attributes':{"   \
    "'POSITION':0},'material':0}]}],'materials':[{'name':'Red'}]}"

static struct imported_scene make(void)
{
    struct imported_scene s;
    struct error err = {0};
    if (!imported_scene_make(&s, DOCUMENT, corners, sizeof corners, &err))
        fail_msg("%s", err.message);
    return s;
}

static struct composed_scene *compose(const struct imported_scene *s,
                                      const struct compose_part *parts, size_t count,
                                      struct error *err)
{
    return scene_compose(
        &(struct compose_desc){.base = &s->scene, .parts = parts, .part_count = count}, err);
}

static void the_base_stays_and_parts_follow_by_their_names(void **state)
{
    (void)state;
    struct imported_scene s = make();
    struct error err = {0};
    const struct compose_part parts[] = {
        {.name = "a", .scene = &s.scene, .parent = "b/Leaf", .identity = 1},
        {.name = "b", .scene = &s.scene, .parent = "Leaf", .identity = 1},
    };
    struct composed_scene *composed = compose(&s, parts, 2, &err);
    assert_non_null(composed);
    const struct scene *scene = composed_scene_get(composed);
    assert_int_equal(scene->node_count, 3 + 2 * 4);
    assert_int_equal(scene->material_count, 3 * s.scene.material_count);
    for (uint32_t i = 0; i < s.scene.node_count; i++) {
        assert_int_equal(scene->nodes[i].parent, s.scene.nodes[i].parent);
        assert_string_equal(scene->strings + scene->nodes[i].name,
                            s.scene.strings + s.scene.nodes[i].name);
    }
    assert_int_equal(scene_find_node(scene, "b"), 3); /* before a, which hangs on it */
    assert_int_equal(scene->nodes[3].parent, scene_find_node(scene, "Leaf"));
    assert_int_equal(scene_find_node(scene, "b/Leaf"), 5);
    assert_int_equal(scene_find_node(scene, "a"), 7);
    assert_int_equal(scene->nodes[7].parent, 5);
    assert_int_equal(scene_find_node(scene, "a/#2"), 10);
    assert_int_equal(scene_find_node(scene, "a/#3"), -1);
    assert_int_equal(scene_find_node(scene, "c/#0"), -1);
    assert_int_equal(scene_find_material(scene, "b/Red"), 2);
    assert_int_equal(scene_find_material(scene, "a/#0"), 4);
    const struct scene_primitive *last = &scene->primitives[2];
    assert_int_equal(last->part, 2);
    assert_ptr_equal(scene_of_primitive(scene, last)->positions, s.scene.positions);
    composed_scene_destroy(composed);
    imported_scene_finish(&s);
}

/* Where everything has a name, nothing is left over for that of the part itself. */
static void long_names_of_parts_have_room(void **state)
{
    (void)state;
    struct imported_scene s = make();
    struct error err = {0};
    char name[201];
    memset(name, 'n', sizeof name - 1);
    name[sizeof name - 1] = '\0';
    struct scene named = s.scene;
    struct scene_node nodes[3];
    struct scene_material materials[2];
    assert_int_equal(named.node_count, 3);
    assert_int_equal(named.material_count, 2);
    memcpy(nodes, named.nodes, sizeof nodes);
    memcpy(materials, named.materials, sizeof materials);
    nodes[2].name = nodes[0].name;
    materials[1].name = materials[0].name;
    named.nodes = nodes;
    named.materials = materials;
    const struct compose_part part = {.name = name, .scene = &named, .identity = 1};
    struct composed_scene *composed = compose(&s, &part, 1, &err);
    assert_non_null(composed);
    const struct scene *scene = composed_scene_get(composed);
    assert_string_equal(scene->parts[1].name, name);
    const char *last = scene->strings + scene->materials[3].name;
    assert_memory_equal(last, name, sizeof name - 1);
    assert_string_equal(last + sizeof name - 1, "/Red");
    composed_scene_destroy(composed);
    imported_scene_finish(&s);
}

static void only_what_a_part_covers_changes_its_shadow_hash(void **state)
{
    (void)state;
    struct imported_scene s = make();
    struct error err = {0};
    struct compose_part part = {.name = "a", .scene = &s.scene, .identity = 1};
    const struct view_part placed = {.name = "a",
                                     .matrix = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1}};
    struct view plain = {.width_px = 1, .height_px = 1}, with = plain;
    with.parts = &placed;
    with.part_count = 1;
    struct scene_state alone, first, second;
    struct composed_scene *one = compose(&s, &part, 1, &err);
    part.identity = 2; /* another scene, as far as anyone can tell */
    struct composed_scene *other = compose(&s, &part, 1, &err);
    assert_true(scene_state_init(&alone, &s.scene, &plain, &err));
    assert_true(scene_state_init(&first, composed_scene_get(one), &with, &err));
    assert_true(scene_state_init(&second, composed_scene_get(other), &with, &err));
    assert_int_equal(first.item_count, 2);
    assert_true(first.items[0].shadow_hash == alone.items[0].shadow_hash);
    assert_true(first.items[1].shadow_hash != second.items[1].shadow_hash);
    assert_true(first.items[1].bounds_min[0] == 5 && first.items[1].bounds_min[2] == 1);
    scene_state_finish(&alone);
    scene_state_finish(&first);
    scene_state_finish(&second);
    composed_scene_destroy(one);
    composed_scene_destroy(other);
    imported_scene_finish(&s);
}

static void a_node_that_matrices_put_too_far_away_is_named(void **state)
{
    (void)state;
    struct imported_scene s = make();
    struct view_node_override nodes[] = {
        {.node = "Root",
         .has_matrix = true,
         .matrix = {1e7, 0, 0, 0, 0, 1e7, 0, 0, 0, 0, 1e7, 0, 0, 0, 0, 1}},
        {.node = "Leaf",
         .has_matrix = true,
         .matrix = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 9e4, 0, 1}},
    };
    const struct view view = {
        .width_px = 1, .height_px = 1, .nodes = nodes, .node_override_count = 2};
    struct scene_state evaluated;
    struct error err = {0};
    assert_true(scene_state_init(&evaluated, &s.scene, &view, &err)); /* at 9e11 m */
    assert_true(evaluated.items[0].bounds_min[1] == 9e11);
    scene_state_finish(&evaluated);
    nodes[1].matrix[13] = 1.1e5;
    assert_false(scene_state_init(&evaluated, &s.scene, &view, &err));
    assert_int_equal(err.code, ERROR_INVALID_REQUEST);
    assert_non_null(strstr(err.message, "'Leaf'"));
    assert_non_null(strstr(err.message, "1e+12 m"));
    imported_scene_finish(&s);
}

static void assert_refused(const struct imported_scene *s, const struct compose_part *parts,
                           size_t count, enum error_code code, const char *word)
{
    struct error err = {0};
    assert_null(compose(s, parts, count, &err));
    assert_int_equal(err.code, code);
    if (!strstr(err.message, word))
        fail_msg("'%s' does not say '%s'", err.message, word);
}

static void what_cannot_be_composed_is_named(void **state)
{
    (void)state;
    struct imported_scene s = make();
    struct scene many = s.scene;
    struct scene_header header = *s.scene.header;
    header.triangle_count = COMPOSE_TRIANGLES_MAX;
    many.header = &header;
    const struct compose_part nowhere = {.name = "a", .scene = &s.scene, .parent = "Roof"};
    const struct compose_part self = {.name = "a", .scene = &s.scene, .parent = "a"};
    const struct compose_part twin = {.name = "Leaf", .scene = &s.scene};
    const struct compose_part heavy = {.name = "a", .scene = &many};
    const struct compose_part ring[] = {{.name = "a", .scene = &s.scene, .parent = "b"},
                                        {.name = "b", .scene = &s.scene, .parent = "a"}};
    assert_refused(&s, &nowhere, 1, ERROR_NOT_FOUND, "Roof");
    assert_refused(&s, &self, 1, ERROR_NOT_FOUND, "'a'");
    assert_refused(&s, ring, 2, ERROR_NOT_FOUND, "'b'");
    assert_refused(&s, &twin, 1, ERROR_INVALID_REQUEST, "Leaf");
    assert_refused(&s, &heavy, 1, ERROR_TOO_LARGE, "triangles");
    imported_scene_finish(&s);
}

/* A renderer that ends frees its scenes before what it kept of them. Sanitizers tell. */
static void what_was_evaluated_may_outlive_its_scene(void **state)
{
    (void)state;
    struct imported_scene s = make();
    struct error err = {0};
    struct scene *scene = malloc(sizeof *scene);
    assert_non_null(scene);
    *scene = s.scene;
    struct scene_state evaluated;
    const struct view view = {.width_px = 8, .height_px = 8};
    assert_true(scene_state_init(&evaluated, scene, &view, &err));
    memset(scene, 0xff, sizeof *scene);
    free(scene);
    imported_scene_finish(&s);
    scene_state_finish(&evaluated);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_base_stays_and_parts_follow_by_their_names),
        cmocka_unit_test(long_names_of_parts_have_room),
        cmocka_unit_test(only_what_a_part_covers_changes_its_shadow_hash),
        cmocka_unit_test(a_node_that_matrices_put_too_far_away_is_named),
        cmocka_unit_test(what_cannot_be_composed_is_named),
        cmocka_unit_test(what_was_evaluated_may_outlive_its_scene),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
