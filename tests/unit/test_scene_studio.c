/* SPDX-License-Identifier: MIT */
/* Which views the studio lights: those that have no light from elsewhere, and those that ask. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/scene/studio.h"

static struct scene_node lamp = {.light = 0}, plain = {.light = -1};

static const struct scene dark = {.nodes = &plain, .node_count = 1};
static const struct scene lit = {.nodes = &lamp, .node_count = 1};

static void any_light_keeps_the_studio_off(void **state)
{
    (void)state;
    const struct view_light light = {.type = SCENE_LIGHT_POINT};
    assert_int_equal(studio_of(&dark, &(struct view){.width_px = 1}), VIEW_STUDIO_BY_DEFAULT);
    const struct view others[] = {
        {.lights = &light, .light_count = 1}, {.has_environment = true},
        {.environment_key = "map"},           {.ignore_scene_lights = true}, /* dark on purpose */
        {.studio = VIEW_STUDIO_OFF},
    };
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        assert_int_equal(studio_of(&dark, &others[i]), VIEW_STUDIO_OFF);
    assert_int_equal(studio_of(&lit, &(struct view){.width_px = 1}), VIEW_STUDIO_OFF);
}

static void a_switch_lights_it_anywhere(void **state)
{
    (void)state;
    struct view view = {.studio = VIEW_STUDIO_ON, .ignore_scene_lights = true};
    assert_int_equal(studio_of(&dark, &view), VIEW_STUDIO_ON);
    assert_int_equal(studio_of(&lit, &view), VIEW_STUDIO_ON);
}

/* Once more changes nothing: a view is opened from one that was. */
static void it_puts_its_map_where_the_view_has_none(void **state)
{
    (void)state;
    struct view view = {.environment_rotation_deg = 30};
    studio_apply(&dark, &view);
    for (int i = 0; i < 2; i++) {
        assert_int_equal(view.studio, VIEW_STUDIO_BY_DEFAULT);
        assert_string_equal(view.environment_key, VIEW_STUDIO_KEY);
        assert_true(view.environment_rotation_deg == 0 && view.environment_intensity > 0);
        studio_apply(&dark, &view);
    }
    struct view other = {
        .studio = VIEW_STUDIO_ON, .environment_key = "map", .environment_intensity = 3};
    studio_apply(&dark, &other);
    assert_string_equal(other.environment_key, "map");
    assert_true(other.environment_intensity == 3);
    struct view off = {.studio = VIEW_STUDIO_OFF};
    studio_apply(&dark, &off);
    assert_null(off.environment_key);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(any_light_keeps_the_studio_off),
        cmocka_unit_test(a_switch_lights_it_anywhere),
        cmocka_unit_test(it_puts_its_map_where_the_view_has_none),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
