/* SPDX-License-Identifier: MIT */
/* EXT_mesh_gpu_instancing: instances are nodes that share a mesh, and lists that do not agree are
 * refused by the node. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "tests/support/import_support.h"

static const struct {
    float positions[3][3];    /* accessor 0 */
    float translations[3][3]; /* accessor 1 */
    int16_t rotations[3][4];  /* accessor 2: none, a half turn about Y, a quarter turn about Z */
    float scales[3][3];       /* accessor 3 */
    float still[3][4];        /* accessor 4: rotations of no length */
    float far[3][3];          /* accessor 5: no numbers */
} bin = {
    .positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
    .translations = {{0, 0, 0}, {10, 0, 0}, {0, 20, 0}},
    .rotations = {{0, 0, 0, 32767}, {0, 32767, 0, 0}, {0, 0, 23170, 23170}},
    .scales = {{1, 1, 1}, {2, 2, 2}, {3, 1, 1}},
    .far = {{0, 0, 0}, {INFINITY, 0, 0}, {0, 0, 0}},
};

/* Node 0 'Tree' carries the extension with the attributes; node 1 is its child, node 2 its parent.
 */
static bool import(const char *attributes, const char *child, struct imported_scene *s,
                   struct error *err)
{
    char json[2048];
    snprintf(
        json, sizeof json,
        "{'asset':{'version':'2.0'},'extensionsUsed':['EXT_mesh_gpu_instancing'],"
        "'extensionsRequired':['EXT_mesh_gpu_instancing'],'buffers':[{'byteLength':%zu}],"
        "'bufferViews':[{'buffer':0,'byteLength':%zu}],'accessors':["
        "{'bufferView':0,'componentType':5126,'count':3,'type':'VEC3'},"
        "{'bufferView':0,'byteOffset':%zu,'componentType':5126,'count':3,'type':'VEC3'},"
        "{'bufferView':0,'byteOffset':%zu,'componentType':5122,'count':3,'type':'VEC4',"
        "'normalized':true},"
        "{'bufferView':0,'byteOffset':%zu,'componentType':5126,'count':3,'type':'VEC3'},"
        "{'bufferView':0,'byteOffset':%zu,'componentType':5126,'count':3,'type':'VEC4'},"
        "{'bufferView':0,'byteOffset':%zu,'componentType':5126,'count':3,'type':'VEC3'},"
        "{'bufferView':0,'componentType':5126,'count':2,'type':'VEC3'},"
        "{'componentType':5126,'count':2000000,'type':'VEC3'},"
        "{'bufferView':0,'componentType':5126,'count':4000000000,'type':'VEC3'}],"
        "'meshes':[{'name':'Leaf','primitives':[{'attributes':{'POSITION':0}}]}],'nodes':["
        "{'name':'Tree','mesh':0,'children':[1],'extensions':{'EXT_mesh_gpu_instancing':{%s}}},"
        "{'name':'%s'},{'name':'Wood','translation':[0,0,5],'children':[0]}],"
        "'scenes':[{'nodes':[2]}]}",
        sizeof bin, sizeof bin, offsetof(typeof(bin), translations),
        offsetof(typeof(bin), rotations), offsetof(typeof(bin), scales),
        offsetof(typeof(bin), still), offsetof(typeof(bin), far), attributes, child);
    return imported_scene_make(s, json, &bin, sizeof bin, err);
}

#define ALL "'attributes':{'TRANSLATION':1,'ROTATION':2,'SCALE':3,'_ID':0}"

static const char *name_of(const struct scene *scene, uint32_t node)
{
    return scene->strings + scene->nodes[node].name;
}

static void instances_are_nodes_that_share_a_mesh(void **state)
{
    (void)state;
    struct imported_scene s;
    struct error err = {0};
    if (!import(ALL, "Nest", &s, &err))
        fail_msg("%s", err.message);
    static const char *const names[] = {"Wood", "Tree", "Nest", "Tree #0", "Tree #1", "Tree #2"};
    assert_int_equal(s.scene.node_count, 6);
    assert_int_equal(s.scene.mesh_count, 1);
    assert_int_equal(s.scene.vertex_count, 3);
    assert_int_equal(s.scene.warning_count, 0);
    assert_int_equal(s.scene.header->triangle_count, 3);
    for (uint32_t i = 0; i < 6; i++) {
        assert_string_equal(name_of(&s.scene, i), names[i]);
        assert_int_equal(s.scene.nodes[i].mesh, i < 3 ? -1 : 0);
        if (i >= 3)
            assert_int_equal(s.scene.nodes[i].parent, 1);
    }
    /* where the corner (1, 0, 0) comes to lie */
    static const double corners[3][3] = {{1, 0, 5}, {8, 0, 5}, {0, 23, 5}};
    for (int i = 0; i < 3; i++) {
        const double *m = s.scene.nodes[3 + i].world_matrix;
        for (int k = 0; k < 3; k++)
            assert_true(fabs(m[k] + m[12 + k] - corners[i][k]) < 1e-3);
    }
    assert_true(fabs(s.scene.header->bounds_max[1] - 23) < 1e-3);
    imported_scene_finish(&s);
}

static void a_name_that_another_node_has_is_left_to_it(void **state)
{
    (void)state;
    struct imported_scene s;
    struct error err = {0};
    assert_true(import(ALL, "Tree #1", &s, &err));
    assert_int_equal(scene_find_node(&s.scene, "Tree #1"), 2);
    assert_string_equal(name_of(&s.scene, 4), "");
    assert_int_equal(scene_find_node(&s.scene, "Tree #2"), 5);
    imported_scene_finish(&s);
}

static void a_node_without_lists_shows_its_mesh(void **state)
{
    (void)state;
    struct imported_scene s;
    struct error err = {0};
    assert_true(import("'attributes':{'_ID':0}", "Nest", &s, &err));
    assert_int_equal(s.scene.node_count, 3);
    assert_int_equal(s.scene.nodes[1].mesh, 0);
    imported_scene_finish(&s);
}

static void a_node_with_a_skin_is_shown_once_and_that_is_reported(void **state)
{
    (void)state;
    struct imported_scene s;
    struct error err = {0};
    if (!imported_scene_make(
            &s,
            "{'asset':{'version':'2.0'},'buffers':[{'byteLength':36}],'bufferViews':["
            "{'buffer':0,'byteLength':36}],'accessors':[{'bufferView':0,'componentType':5126,"
            "'count':3,'type':'VEC3'}],'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}],"
            "'skins':[{'joints':[1]}],'nodes':[{'mesh':0,'skin':0,'extensions':{"
            "'EXT_mesh_gpu_instancing':{'attributes':{'TRANSLATION':0}}}},{'name':'Joint'}]}",
            &bin, 36, &err))
        fail_msg("%s", err.message);
    assert_int_equal(s.scene.node_count, 2);
    assert_int_equal(s.scene.nodes[0].mesh, 0);
    assert_true(scene_has_warning(&s.scene, "1 node with a skin and instances"));
    imported_scene_finish(&s);
}

static void lists_that_do_not_agree_are_refused_by_the_node(void **state)
{
    (void)state;
    static const struct {
        const char *attributes;
        enum error_code code;
        const char *says;
    } refusals[] = {
        {"'TRANSLATION':1,'SCALE':6", ERROR_INVALID_SCENE,
         "SCALE of its instances has 2 elements, TRANSLATION has 3"},
        {"'TRANSLATION':99", ERROR_INVALID_SCENE, "there is no accessor 99"},
        {"'TRANSLATION':2", ERROR_INVALID_SCENE,
         "TRANSLATION of its instances: accessor 2 has an element type"},
        {"'ROTATION':1", ERROR_INVALID_SCENE, "accessor 1 has an element type"},
        {"'ROTATION':4", ERROR_INVALID_SCENE, "ROTATION of its instance 0 has no direction"},
        {"'TRANSLATION':5", ERROR_INVALID_SCENE, "accessor 5: element 1 is not finite"},
        {"'TRANSLATION':8", ERROR_INVALID_SCENE, "do not fit buffer view 0"},
        {"'TRANSLATION':7", ERROR_TOO_LARGE,
         "with its 2000000 instances there are 2000000, limit is 1048576"},
    };
    for (size_t i = 0; i < sizeof refusals / sizeof *refusals; i++) {
        char attributes[256];
        struct imported_scene s;
        struct error err = {0};
        snprintf(attributes, sizeof attributes, "'attributes':{%s}", refusals[i].attributes);
        assert_false(import(attributes, "Nest", &s, &err));
        if (err.code != refusals[i].code || !strstr(err.message, refusals[i].says) ||
            !strstr(err.message, "node 0 'Tree'"))
            fail_msg("%zu: code %d, '%s'", i, (int)err.code, err.message);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(instances_are_nodes_that_share_a_mesh),
        cmocka_unit_test(a_name_that_another_node_has_is_left_to_it),
        cmocka_unit_test(a_node_without_lists_shows_its_mesh),
        cmocka_unit_test(a_node_with_a_skin_is_shown_once_and_that_is_reported),
        cmocka_unit_test(lists_that_do_not_agree_are_refused_by_the_node),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
