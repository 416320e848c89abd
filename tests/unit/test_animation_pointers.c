/* SPDX-License-Identifier: MIT */
/* KHR_node_visibility and KHR_animation_pointer: what a file hides, and what pointers change. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "renderer/scene/animated_members.h"
#include "renderer/scene/animation.h"
#include "renderer/scene/compose.h"
#include "renderer/scene/scene_state.h"
#include "tests/support/import_support.h"

enum { NUMBERS = 64, TIMES = 2, POSITIONS = 9 };

/* Node 0 holds node 1, a triangle ten metres away, and node 2, the same one; node 3 is a lamp. The
 * times are 0 and 2 s. */
#define DOCUMENT                                                                                 \
    "{'asset':{'version':'2.0'},'buffers':[{'byteLength':256}],'bufferViews':[{'buffer':0,"      \
    "'byteLength':36},{'buffer':0,'byteOffset':36,'byteLength':8},{'buffer':0,'byteOffset':44,"  \
    "'byteLength':212}],'accessors':[{'bufferView':0,'componentType':5126,'count':3,'type':"     \
    "'VEC3','min':[0,0,0],'max':[1,1,0]},{'bufferView':1,'componentType':5126,'count':2,'type':" \
    "'SCALAR'},{'bufferView':2,'componentType':%d,'count':%d,'type':'%s'}],'scenes':[{'nodes':"  \
    "[0,3]}],'nodes':[{'children':[1,2]},{'name':'Far','mesh':0,'translation':[10,0,0],"         \
    "'extensions':{'KHR_node_visibility':{'visible':%s}}},{'name':'Near','mesh':0},{'name':"     \
    "'Lamp','extensions':{'KHR_lights_punctual':{'light':0}}}],'meshes':[{'primitives':[{"       \
    "'attributes':{'POSITION':0},'material':1}]}],'materials':[{},{'emissiveFactor':"            \
    "[0.5,0.25,1],'extensions':{'KHR_materials_emissive_strength':{'emissiveStrength':4}}},"     \
    "{'normalTexture':{'index':0,'extensions':{'KHR_texture_transform':{'offset':[0.5,0.25],"    \
    "'rotation':1.5707963267948966,'scale':[-2,3]}}}}],'textures':[{}],'cameras':[{'type':"      \
    "'perspective','perspective':{'yfov':0.8,'znear':0.1}},{'type':'orthographic',"              \
    "'orthographic':{'xmag':1,'ymag':1,'znear':0,'zfar':10}}],"                                  \
    "'extensionsUsed':['KHR_node_visibility','KHR_animation_pointer','KHR_lights_punctual',"     \
    "'KHR_materials_emissive_strength'],'extensionsRequired':['KHR_node_visibility',"            \
    "'KHR_animation_pointer'],'extensions':{'KHR_lights_punctual':{'lights':[{'type':'spot',"    \
    "'spot':{'innerConeAngle':0.5,'outerConeAngle':0.6}}]}},'animations':[{'name':'Change',"     \
    "'channels':[{'sampler':0,'target':{'path':'pointer','extensions':{'KHR_animation_pointer':" \
    "{'pointer':'%s'}}}}],'samplers':[{'input':1,'output':2,'interpolation':'%s'}]}]}"

struct change {
    const char *pointer, *type, *interpolation, *visible;
    int value_count;
    float values[NUMBERS - TIMES - POSITIONS];
    bool has_bytes; /* the values are those of bytes */
};

static bool import_change(struct imported_scene *s, const struct change *c, struct error *err)
{
    char json[3072];
    float numbers[NUMBERS] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 2};
    uint8_t *bytes = (uint8_t *)(numbers + POSITIONS + TIMES);
    if (c->has_bytes)
        for (int i = 0; i < c->value_count; i++)
            bytes[i] = (uint8_t)c->values[i];
    else
        memcpy(bytes, c->values, sizeof c->values);
    snprintf(json, sizeof json, DOCUMENT, c->has_bytes ? 5121 : 5126, c->value_count, c->type,
             c->visible ? c->visible : "true", c->pointer,
             c->interpolation ? c->interpolation : "LINEAR");
    return imported_scene_make(s, json, numbers, sizeof numbers, err);
}

static struct imported_scene make(const struct change *c)
{
    struct imported_scene s;
    struct error err = {0};
    if (!import_change(&s, c, &err))
        fail_msg("%s: %s", c->pointer, err.message);
    return s;
}

/* time_s < 0: at rest. */
static struct scene_state state_at(const struct scene *scene, double time_s)
{
    struct scene_state state;
    struct error err = {0};
    const struct view view = {.is_animated = time_s >= 0, .animation_time_s = fmax(time_s, 0)};
    if (!scene_state_init(&state, scene, &view, &err))
        fail_msg("%s", err.message);
    return state;
}

static const struct change shown_later = {.pointer =
                                              "/nodes/1/extensions/KHR_node_visibility/visible",
                                          .type = "SCALAR",
                                          .interpolation = "STEP",
                                          .visible = "false",
                                          .value_count = 2,
                                          .values = {0, 1},
                                          .has_bytes = true};

static void a_hidden_node_is_not_shown_until_a_view_or_an_animation_shows_it(void **state)
{
    (void)state;
    struct imported_scene s = make(&shown_later);
    assert_true(s.scene.header->bounds_max[0] == 1);
    static const struct {
        double time_s, right;
        size_t items;
    } rows[] = {{-1, 1, 1}, {0, 1, 1}, {1.99, 1, 1}, {2, 11, 2}, {100, 11, 2}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct scene_state at = state_at(&s.scene, rows[i].time_s);
        assert_int_equal(at.item_count, rows[i].items);
        assert_true(at.bounds_max[0] == rows[i].right);
        assert_false(at.has_idle_animation);
        scene_state_finish(&at);
    }
    struct scene_state shown;
    struct error err = {0};
    const struct view_node_override show = {.node = "Far", .has_visible = true, .visible = true};
    const struct view view = {.nodes = &show, .node_override_count = 1};
    assert_true(scene_state_init(&shown, &s.scene, &view, &err));
    assert_int_equal(shown.item_count, 2);
    scene_state_finish(&shown);
    imported_scene_finish(&s);
}

static void what_is_under_a_hidden_node_is_hidden(void **state)
{
    (void)state;
    struct change c = shown_later;
    c.pointer = "/nodes/0/extensions/KHR_node_visibility/visible";
    struct imported_scene s = make(&c);
    struct scene_state at = state_at(&s.scene, 0);
    assert_int_equal(at.item_count, 0);
    scene_state_finish(&at);
    imported_scene_finish(&s);
}

static void a_pointer_at_a_transform_is_a_channel_like_any_other(void **state)
{
    (void)state;
    const struct change c = {.pointer = "/nodes/2/translation",
                             .type = "VEC3",
                             .value_count = 2,
                             .values = {0, 0, 0, 4, 0, 0}};
    struct imported_scene s = make(&c);
    struct scene_state at = state_at(&s.scene, 0.5);
    assert_true(at.world[2][12] == 1);
    scene_state_finish(&at);
    imported_scene_finish(&s);
}

struct member_row {
    struct change change;
    size_t offset; /* into the material or light */
    enum animated_owner owner;
    int count;
    float at_rest[6], halfway[6]; /* at 1 s */
};

static const struct member_row member_rows[] = {
    {{"/materials/1/pbrMetallicRoughness/baseColorFactor",
      "VEC4",
      NULL,
      NULL,
      2,
      {1, 1, 1, 1, 0, 0.5f, 1, 0},
      false},
     offsetof(struct scene_material, base_color),
     ANIMATED_MATERIAL,
     4,
     {1, 1, 1, 1},
     {0.5f, 0.75f, 1, 0.5f}},
    {{"/materials/1/pbrMetallicRoughness/roughnessFactor", "SCALAR", NULL, NULL, 2, {0, 1}, false},
     offsetof(struct scene_material, roughness),
     ANIMATED_MATERIAL,
     1,
     {1},
     {0.5f}},
    /* of the product of 0.5, 0.25, 1 and 4 */
    {{"/materials/1/emissiveFactor", "VEC3", NULL, NULL, 2, {0, 0, 0, 1, 1, 0.5f}, false},
     offsetof(struct scene_material, emissive),
     ANIMATED_MATERIAL,
     3,
     {2, 1, 4},
     {2, 2, 1}},
    {{"/materials/1/extensions/KHR_materials_emissive_strength/emissiveStrength",
      "SCALAR",
      NULL,
      NULL,
      2,
      {0, 8},
      false},
     offsetof(struct scene_material, emissive),
     ANIMATED_MATERIAL,
     3,
     {2, 1, 4},
     {2, 1, 4}},
    {{"/materials/1/extensions/KHR_materials_transmission/transmissionFactor",
      "SCALAR",
      NULL,
      NULL,
      2,
      {0, 1},
      false},
     offsetof(struct scene_material, transmission),
     ANIMATED_MATERIAL,
     1,
     {0},
     {0.5f}},
    {{"/materials/1/normalTexture/extensions/KHR_texture_transform/offset",
      "VEC2",
      NULL,
      NULL,
      2,
      {0, 0, 2, 4},
      false},
     offsetof(struct scene_material, textures[SCENE_TEXTURE_NORMAL].uv_transform[2]),
     ANIMATED_MATERIAL,
     1,
     {0},
     {1}},
    {{"/materials/1/normalTexture/extensions/KHR_texture_transform/offset",
      "VEC2",
      NULL,
      NULL,
      2,
      {0, 0, 2, 4},
      false},
     offsetof(struct scene_material, textures[SCENE_TEXTURE_NORMAL].uv_transform[5]),
     ANIMATED_MATERIAL,
     1,
     {0},
     {2}},
    {{"/extensions/KHR_lights_punctual/lights/0/intensity",
      "SCALAR",
      NULL,
      NULL,
      2,
      {0, 10},
      false},
     offsetof(struct scene_light, intensity),
     ANIMATED_LIGHT,
     1,
     {1},
     {5}},
    /* never wider than the outer cone, at 0.6 */
    {{"/extensions/KHR_lights_punctual/lights/0/spot/innerConeAngle",
      "SCALAR",
      NULL,
      NULL,
      2,
      {0, 1.5f},
      false},
     offsetof(struct scene_light, inner_cone_rad),
     ANIMATED_LIGHT,
     1,
     {0.5f},
     {0.6f}},
    /* sin and cos of a quarter of a turn, by the scale 1 at rest */
    {{"/materials/1/normalTexture/extensions/KHR_texture_transform/rotation",
      "SCALAR",
      NULL,
      NULL,
      2,
      {0, 3.14159265f},
      false},
     offsetof(struct scene_material, textures[SCENE_TEXTURE_NORMAL].uv_transform),
     ANIMATED_MATERIAL,
     6,
     {1, 0, 0, 0, 1, 0},
     {0, 1, 0, -1, 0, 0}},
    {{"/materials/1/emissiveTexture/extensions/KHR_texture_transform/scale",
      "VEC2",
      NULL,
      NULL,
      2,
      {-1, 2, -3, 8},
      false},
     offsetof(struct scene_material, textures[SCENE_TEXTURE_EMISSIVE].uv_transform),
     ANIMATED_MATERIAL,
     6,
     {1, 0, 0, 0, 1, 0},
     {-2, 0, 0, 0, 5, 0}},
    /* turned at rest by a quarter of a turn, which stays */
    {{"/materials/2/normalTexture/extensions/KHR_texture_transform/scale",
      "VEC2",
      NULL,
      NULL,
      2,
      {-1, 2, -3, 8},
      false},
     offsetof(struct scene_material, textures[SCENE_TEXTURE_NORMAL].uv_transform),
     ANIMATED_MATERIAL,
     6,
     {0, 3, 0.5f, 2, 0, 0.25f},
     {0, 5, 0.5f, 2, 0, 0.25f}},
    {{"/materials/2/normalTexture/extensions/KHR_texture_transform/rotation",
      "SCALAR",
      NULL,
      NULL,
      2,
      {-1, 1},
      false},
     offsetof(struct scene_material, textures[SCENE_TEXTURE_NORMAL].uv_transform),
     ANIMATED_MATERIAL,
     6,
     {0, 3, 0.5f, 2, 0, 0.25f},
     {-2, 0, 0.5f, 0, 3, 0.25f}},
    {{"/cameras/0/perspective/yfov", "SCALAR", NULL, NULL, 2, {0.5f, 1}, false},
     offsetof(struct scene_camera, y_fov_rad),
     ANIMATED_CAMERA,
     1,
     {0.8f},
     {0.75f}},
    {{"/cameras/1/orthographic/ymag", "SCALAR", NULL, NULL, 2, {2, 4}, false},
     offsetof(struct scene_camera, y_mag),
     ANIMATED_CAMERA,
     1,
     {1},
     {3}},
};

/* The first record but of materials, of which the row says which; of cameras the second one where
 * the pointer says so. */
static const char *record_of(const struct member_row *row, const struct scene *scene,
                             const struct scene_state *at)
{
    const struct scene_light *lights = at->file_lights ? at->file_lights : scene->lights;
    const struct scene_camera *cameras = at->cameras ? at->cameras : scene->cameras;
    int index = row->change.pointer[strcspn(row->change.pointer, "0123456789")] - '0';
    switch (row->owner) {
    case ANIMATED_MATERIAL:
        return (const char *)&at->materials[index].base;
    case ANIMATED_LIGHT:
        return (const char *)&lights[index];
    default:
        return (const char *)&cameras[index];
    }
}

static void members_change_as_their_pointers_say(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof member_rows / sizeof *member_rows; i++) {
        const struct member_row *row = &member_rows[i];
        struct imported_scene s = make(&row->change);
        for (int moment = 0; moment < 2; moment++) {
            struct scene_state at = state_at(&s.scene, moment ? 1 : -1);
            const char *record = record_of(row, &s.scene, &at);
            const float *expected = moment ? row->halfway : row->at_rest;
            for (int k = 0; k < row->count; k++) {
                float found;
                memcpy(&found, record + row->offset + (size_t)k * sizeof found, sizeof found);
                if (!(fabsf(found - expected[k]) < 1e-6f))
                    fail_msg("%s, number %d is %g, not %g", row->change.pointer, k, (double)found,
                             (double)expected[k]);
            }
            scene_state_finish(&at);
        }
        imported_scene_finish(&s);
    }
}

static void a_material_of_a_part_changes_alone(void **state)
{
    (void)state;
    const struct change c = {.pointer = "/materials/1/pbrMetallicRoughness/roughnessFactor",
                             .type = "SCALAR",
                             .value_count = 2,
                             .values = {0, 1}};
    struct change other = c;
    other.pointer = "/materials/0/alphaCutoff";
    struct imported_scene base = make(&other), lid = make(&c);
    struct error err = {0};
    struct scene_state state_of_both;
    struct composed_scene *both = scene_compose(
        &(struct compose_desc){
            .base = &base.scene,
            .parts = &(struct compose_part){.name = "lid", .scene = &lid.scene, .identity = 1},
            .part_count = 1},
        &err);
    assert_non_null(both);
    const struct view_part part = {.name = "lid",
                                   .matrix = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
    const struct view view = {
        .parts = &part, .part_count = 1, .is_animated = true, .animation_time_s = 1};
    assert_true(scene_state_init(&state_of_both, composed_scene_get(both), &view, &err));
    uint32_t first = composed_scene_get(both)->parts[1].first_material;
    assert_true(state_of_both.materials[1].base.roughness == 1);
    assert_true(state_of_both.materials[first + 1].base.roughness == 0.5f);
    assert_true(state_of_both.materials[0].base.alpha_cutoff == 0.5f);
    scene_state_finish(&state_of_both);
    composed_scene_destroy(both);
    imported_scene_finish(&base);
    imported_scene_finish(&lid);
}

static void assert_refused(const struct change *c, const char *reason)
{
    struct imported_scene s;
    struct error err = {0};
    if (import_change(&s, c, &err))
        fail_msg("%s was taken", c->pointer);
    assert_int_equal(err.code, ERROR_INVALID_SCENE);
    if (!strstr(err.message, reason))
        fail_msg("'%s' does not say '%s'", err.message, reason);
}

static void what_does_not_fit_is_refused(void **state)
{
    (void)state;
    struct change c = shown_later;
    c.visible = "'no'";
    assert_refused(&c, "nodes[1].extensions.KHR_node_visibility.visible must be true or false");
    c = shown_later;
    c.interpolation = "LINEAR";
    assert_refused(&c, "STEP");
    c.pointer = "/nodes/9/translation";
    assert_refused(&c, "there is no node 9");
    c.pointer = "/materials/3/emissiveFactor";
    assert_refused(&c, "there is no material 3");
    c.pointer = "/cameras/2/perspective/yfov";
    assert_refused(&c, "there is no camera 2");
    c.pointer = "/extensions/KHR_lights_punctual/lights/7000000000/color";
    assert_refused(&c, "there is no light 2147483647");
    c = (struct change){.pointer = "/materials/0/pbrMetallicRoughness/roughnessFactor",
                        .type = "SCALAR",
                        .value_count = 2,
                        .values = {0, 1.5f}};
    assert_refused(&c, "value 1 is 1.5, not in [0, 1]");
    c.pointer = "/cameras/0/perspective/yfov";
    c.values[0] = 4;
    assert_refused(&c, "value 0 is 4, not in [1e-30, 3.14159]");
    c.pointer = "/materials/0/pbrMetallicRoughness/roughnessFactor";
    c.type = "VEC3";
    assert_refused(&c, "3 components, not 1");
    c.type = "SCALAR";
    c.value_count = 3;
    assert_refused(&c, "3 values for 2 times");
}

static void pointers_that_nothing_follows_are_told(void **state)
{
    (void)state;
    static const char *const pointers[] = {
        "",
        "/",
        "/cameras/0/orthographic/ymag",
        "/cameras/0/perspective/glow",
        "/materials/0/pbrMetallicRoughness/glow",
        "/nodes/x/translation",
        "/nodes/1",
        "/materials/0/extensions/KHR_materials_specular/specularFactor"};
    for (size_t i = 0; i < sizeof pointers / sizeof *pointers; i++) {
        const struct change c = {
            .pointer = pointers[i], .type = "SCALAR", .value_count = 2, .values = {0, 1}};
        struct imported_scene s = make(&c);
        assert_int_equal(s.scene.channel_count, 0);
        int told = 0;
        for (uint32_t w = 0; w < s.scene.warning_count; w++)
            told += strstr(s.scene.strings + s.scene.warnings[w], "1 animation channel") != NULL;
        assert_int_equal(told, 1);
        imported_scene_finish(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_hidden_node_is_not_shown_until_a_view_or_an_animation_shows_it),
        cmocka_unit_test(what_is_under_a_hidden_node_is_hidden),
        cmocka_unit_test(a_pointer_at_a_transform_is_a_channel_like_any_other),
        cmocka_unit_test(members_change_as_their_pointers_say),
        cmocka_unit_test(a_material_of_a_part_changes_alone),
        cmocka_unit_test(what_does_not_fit_is_refused),
        cmocka_unit_test(pointers_that_nothing_follows_are_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
