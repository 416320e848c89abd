/* SPDX-License-Identifier: MIT */
/* Animations against their closed forms: what the keys say, what lies between them, and what is
 * refused. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "renderer/scene/animation.h"
#include "renderer/scene/scene_state.h"
#include "tests/support/import_support.h"

/* The times 1, 2 and 4 s, then the values of each test. */
enum { TIMES = 3, NUMBERS = 64 };

/* Node 0 is the parent of node 1, which the channel moves; node 2 has a lamp and hangs on node 1.
 */
#define DOCUMENT                                                                                 \
    "{'asset':{'version':'2.0'},'buffers':[{'byteLength':256}],'bufferViews':[{'buffer':0,"      \
    "'byteLength':12},{'buffer':0,'byteOffset':12,'byteLength':244}],'accessors':["              \
    "{'bufferView':0,'componentType':5126,'count':3,'type':'SCALAR'},"                           \
    "{'bufferView':1,'componentType':5126,'count':%d,'type':'%s'}],'scenes':[{'nodes':[0]}],"    \
    "'nodes':[{'name':'Root','children':[1],'translation':[10,0,0]},{'name':'Arm','children':"   \
    "[2],'translation':[1,2,3],'scale':[2,2,2]},{'name':'Lamp','translation':[0,0,1],"           \
    "'extensions':{'KHR_lights_punctual':{'light':0}}}],'extensionsUsed':["                      \
    "'KHR_lights_punctual'],'extensions':{'KHR_lights_punctual':{'lights':[{'type':'point'}]}}," \
    "'animations':[{'name':'Move','channels':[{'sampler':0,'target':{'node':%d,'path':'%s'}}],"  \
    "'samplers':[{'input':%d,'output':1,'interpolation':'%s'}]}]}"

struct motion {
    const char *type, *path, *interpolation;
    int node, input, value_count;
    float second_s; /* time of the second key; 0 means 2 */
    float values[NUMBERS - TIMES];
};

static bool import_motion(struct imported_scene *s, const struct motion *m, struct error *err)
{
    char json[2048];
    float numbers[NUMBERS] = {1, 2, 4};
    if (m->second_s != 0)
        numbers[1] = m->second_s;
    memcpy(numbers + TIMES, m->values, sizeof m->values);
    snprintf(json, sizeof json, DOCUMENT, m->value_count, m->type, m->node, m->path, m->input,
             m->interpolation);
    return imported_scene_make(s, json, numbers, sizeof numbers, err);
}

static struct imported_scene make(const struct motion *m)
{
    struct imported_scene s;
    struct error err = {0};
    if (!import_motion(&s, m, &err))
        fail_msg("%s", err.message);
    return s;
}

static struct scene_pose pose_at(const struct imported_scene *s, double time_s)
{
    assert_int_equal(s->scene.pose_count, 1);
    struct scene_pose pose = s->scene.poses[0];
    animation_evaluate(&s->scene, 0, time_s, &pose, NULL);
    return pose;
}

static void assert_near(const double *found, const double *expected, int count)
{
    for (int i = 0; i < count; i++)
        if (!(fabs(found[i] - expected[i]) < 1e-7)) /* keys are f32 */
            fail_msg("number %d is %.12g, not %.12g", i, found[i], expected[i]);
}

static const struct motion moving = {.type = "VEC3",
                                     .path = "translation",
                                     .interpolation = "LINEAR",
                                     .node = 1,
                                     .value_count = 3,
                                     .values = {0, 0, 0, 4, 0, 0, 4, 8, 0}};

static void linear_keys_are_joined_by_lines_and_held_at_both_ends(void **state)
{
    (void)state;
    static const struct {
        double time_s, expected[3];
    } rows[] = {{0, {0, 0, 0}},   {1, {0, 0, 0}}, {1.25, {1, 0, 0}}, {2, {4, 0, 0}},
                {2.5, {4, 2, 0}}, {4, {4, 8, 0}}, {1e9, {4, 8, 0}}};
    struct imported_scene s = make(&moving);
    assert_string_equal(s.scene.strings + s.scene.animations[0].name, "Move");
    assert_true(s.scene.animations[0].duration_s == 4);
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct scene_pose pose = pose_at(&s, rows[i].time_s);
        assert_near(pose.translation, rows[i].expected, 3);
        assert_near(pose.scale, (const double[]){2, 2, 2}, 3); /* which nothing moves */
    }
    imported_scene_finish(&s);
}

static void steps_jump_at_their_keys(void **state)
{
    (void)state;
    struct motion m = moving;
    m.interpolation = "STEP";
    m.path = "scale";
    struct imported_scene s = make(&m);
    assert_near(pose_at(&s, 1.999999).scale, (const double[]){0, 0, 0}, 3);
    assert_near(pose_at(&s, 2).scale, (const double[]){4, 0, 0}, 3);
    assert_near(pose_at(&s, 3.999999).scale, (const double[]){4, 0, 0}, 3);
    assert_near(pose_at(&s, 4).scale, (const double[]){4, 8, 0}, 3);
    imported_scene_finish(&s);
}

/* Quarter turns about Z: from 0 to 90 degrees, then on to 180, which is said by the negated
 * quaternion. */
static void rotations_turn_at_constant_speed_along_the_shorter_arc(void **state)
{
    (void)state;
    const float h = 0.70710678f;
    const struct motion m = {.type = "VEC4",
                             .path = "rotation",
                             .interpolation = "LINEAR",
                             .node = 1,
                             .value_count = 3,
                             .values = {0, 0, 0, 1, 0, 0, h, h, 0, 0, -1, 0}};
    struct imported_scene s = make(&m);
    for (int i = 0; i <= 12; i++) {
        double time_s = 1 + 0.25 * i;
        double degrees = time_s <= 2 ? 90 * (time_s - 1) : 90 + 45 * (time_s - 2);
        double half = degrees * M_PI / 360;
        struct scene_pose pose = pose_at(&s, time_s);
        double sign =
            pose.rotation[3] < 0 || (pose.rotation[3] < 1e-7 && pose.rotation[2] < 0) ? -1 : 1;
        for (int k = 0; k < 4; k++)
            pose.rotation[k] *= sign;
        assert_near(pose.rotation, (const double[]){0, 0, sin(half), cos(half)}, 4);
    }
    imported_scene_finish(&s);
}

/* A cubic is its own Hermite spline: x = t^3, y = t^2, z = 1 with their derivatives as tangents. */
static void cubic_splines_reproduce_a_cubic(void **state)
{
    (void)state;
    struct motion m = {.type = "VEC3",
                       .path = "translation",
                       .interpolation = "CUBICSPLINE",
                       .node = 1,
                       .value_count = 9};
    const float times[TIMES] = {1, 2, 4};
    for (int k = 0; k < TIMES; k++) {
        float t = times[k], *key = m.values + 9 * (size_t)k;
        key[0] = key[6] = 3 * t * t;
        key[1] = key[7] = 2 * t;
        key[3] = t * t * t;
        key[4] = t * t;
        key[5] = 1;
    }
    struct imported_scene s = make(&m);
    for (int i = 0; i <= 24; i++) {
        double t = 1 + i * 0.125;
        assert_near(pose_at(&s, t).translation, (const double[]){t * t * t, t * t, 1}, 3);
    }
    assert_near(pose_at(&s, 9).translation, (const double[]){64, 16, 1}, 3);
    imported_scene_finish(&s);
}

static void what_hangs_on_a_moved_node_moves_with_it(void **state)
{
    (void)state;
    struct imported_scene s = make(&moving);
    struct view view = {.width_px = 1, .height_px = 1};
    struct scene_state at_rest, moved, overridden;
    struct error err = {0};
    assert_true(scene_state_init(&at_rest, &s.scene, &view, &err));
    assert_near(at_rest.lights[0].position, (const double[]){11, 2, 5}, 3);
    view.is_animated = true;
    view.animation_time_s = 2.5;
    assert_true(scene_state_init(&moved, &s.scene, &view, &err));
    assert_near(moved.lights[0].position, (const double[]){14, 2, 2}, 3);
    view.animation = "#0";
    const struct view_node_override pinned = {
        .node = "Arm",
        .has_matrix = true,
        .matrix = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 7, 1}};
    view.nodes = &pinned;
    view.node_override_count = 1;
    assert_true(scene_state_init(&overridden, &s.scene, &view, &err));
    assert_near(overridden.lights[0].position, (const double[]){10, 0, 8}, 3);
    view.animation = "Fly";
    struct scene_state none;
    assert_false(scene_state_init(&none, &s.scene, &view, &err));
    assert_int_equal(err.code, ERROR_NOT_FOUND);
    assert_non_null(strstr(err.message, "Fly"));
    scene_state_finish(&at_rest);
    scene_state_finish(&moved);
    scene_state_finish(&overridden);
    imported_scene_finish(&s);
}

static bool is_idle(const struct motion *m)
{
    struct imported_scene s = make(m);
    struct view view = {.width_px = 1, .height_px = 1};
    struct scene_state evaluated;
    struct error err = {0};
    view.is_animated = true;
    if (!scene_state_init(&evaluated, &s.scene, &view, &err))
        fail_msg("%s", err.message);
    bool idle = evaluated.has_idle_animation;
    scene_state_finish(&evaluated);
    imported_scene_finish(&s);
    return idle;
}

static void animations_that_move_nothing_visible_are_known(void **state)
{
    (void)state;
    struct motion m = moving;
    assert_false(is_idle(&m)); /* a lamp hangs on the arm */
    m.path = "pointer";
    assert_true(is_idle(&m));
}

static void assert_refused(const struct motion *m, const char *reason)
{
    struct imported_scene s;
    struct error err = {0};
    assert_false(import_motion(&s, m, &err));
    assert_int_equal(err.code, ERROR_INVALID_SCENE);
    if (!strstr(err.message, reason))
        fail_msg("'%s' does not say '%s'", err.message, reason);
}

static void keys_that_do_not_fit_are_refused(void **state)
{
    (void)state;
    struct motion m = moving;
    m.node = 7;
    assert_refused(&m, "no node 7");
    m = moving, m.path = "rotation";
    assert_refused(&m, "3 components, not 4");
    m = moving, m.value_count = 4;
    assert_refused(&m, "4 values for 3 times");
    m = moving, m.interpolation = "CUBICSPLINE";
    assert_refused(&m, "3 values for 3 times");
    m = moving, m.interpolation = "BEZIER";
    assert_refused(&m, "not STEP, LINEAR or CUBICSPLINE");
    m = moving, m.input = 1;
    assert_refused(&m, "no float scalars");
    m = moving, m.input = 9;
    assert_refused(&m, "no accessor 9");
    m = moving, m.input = -1;
    assert_refused(&m, "a whole number, not negative, is expected");
    m = moving, m.node = -1;
    assert_refused(&m, "a whole number, not negative, is expected");
    m = moving, m.type = "VEC2";
    assert_refused(&m, "its values have 2 components, not 3");
    m = moving, m.second_s = 5;
    assert_refused(&m, "negative or not ascending at key 2");
    m = moving, m.second_s = -1;
    assert_refused(&m, "negative or not ascending at key 1");
    m = moving, m.second_s = NAN;
    assert_refused(&m, "channel 0: accessor 0: element 1 is not finite");
    m = moving, m.values[4] = INFINITY;
    assert_refused(&m, "channel 0: accessor 1: element 1 is not finite");
    m = moving, m.path = "rotation", m.type = "VEC4";
    assert_refused(&m, "animation 0: channel 0: its rotation 2 has no direction");
    m.values[3] = 0;
    assert_refused(&m, "its rotation 0 has no direction");
}

static void channels_that_move_no_node_are_reported(void **state)
{
    (void)state;
    struct motion m = moving;
    m.path = "pointer";
    struct imported_scene s = make(&m);
    assert_int_equal(s.scene.pose_count, 0);
    assert_int_equal(s.scene.animation_count, 1);
    assert_true(s.scene.animations[0].duration_s == 0);
    assert_true(scene_has_warning(&s.scene, "1 animation channel not evaluated"));
    imported_scene_finish(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(linear_keys_are_joined_by_lines_and_held_at_both_ends),
        cmocka_unit_test(steps_jump_at_their_keys),
        cmocka_unit_test(rotations_turn_at_constant_speed_along_the_shorter_arc),
        cmocka_unit_test(cubic_splines_reproduce_a_cubic),
        cmocka_unit_test(what_hangs_on_a_moved_node_moves_with_it),
        cmocka_unit_test(animations_that_move_nothing_visible_are_known),
        cmocka_unit_test(keys_that_do_not_fit_are_refused),
        cmocka_unit_test(channels_that_move_no_node_are_reported),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
