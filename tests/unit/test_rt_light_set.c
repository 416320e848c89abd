/* SPDX-License-Identifier: MIT */
/* Lights looked at together: none that arrives is left out, and few that do not are let through. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/base/matrix.h"
#include "renderer/raytrace/raytrace.h"
#include "renderer/raytrace/rt_light_set.h"
#include "renderer/raytrace/rt_scene.h"
#include "tests/support/light_scene.h"

enum { LIGHTS = 3 * RT_BLOCK_LIGHTS + 5, POINTS = 4000 };

static void random_direction(uint64_t *seed, double out[3])
{
    do
        for (int k = 0; k < 3; k++)
            out[k] = random_uniform(seed, -1, 1);
    while (!vec3_normalize(out));
}

/* Of every type in turn, ranges and cones of every width, some of them wider than a half space. */
static void place_lights(struct state_light lights[LIGHTS])
{
    static const enum scene_light_type types[] = {SCENE_LIGHT_SPOT, SCENE_LIGHT_POINT,
                                                  SCENE_LIGHT_SPOT, SCENE_LIGHT_DIRECTIONAL};
    uint64_t seed = 11;
    for (int i = 0; i < LIGHTS; i++) {
        lights[i] = (struct state_light){.type = types[i % 4], .color = {1, 1, 1}};
        lights[i].range = i % 5 ? (float)random_uniform(&seed, 1, 6) : 0;
        lights[i].outer_cone_rad = (float)random_uniform(&seed, 0.1, 3);
        lights[i].inner_cone_rad = 0.5f * lights[i].outer_cone_rad;
        random_direction(&seed, lights[i].direction);
        for (int k = 0; k < 3; k++)
            lights[i].position[k] = random_uniform(&seed, -4, 4);
    }
}

struct tally {
    int arriving, facing, found, reaching;
};

static void look_at_all(const struct rt_light_set *light_set, const float point[3],
                        const float normal[3], struct tally *tally)
{
    struct rt_light_list list = rt_light_set_near(light_set, 0, 0, 1);
    assert_int_equal(list.count, LIGHTS);
    for (size_t first = 0; first < list.count; first += RT_BLOCK_LIGHTS) {
        uint32_t found[RT_BLOCK_LIGHTS];
        size_t reaching, at = 0;
        const struct rt_light_block *block = rt_light_set_block(light_set, NULL, &list, first);
        size_t count = rt_light_block_look(block, point, normal, found, &reaching);
        for (uint32_t i = (uint32_t)first; i < first + block->count; i++) {
            float l[3], distance;
            bool is_found = at < count && found[at] == i; /* they are in order */
            at += is_found;
            if (!(rt_light_set_arrive(light_set, i, point, l, &distance) > 0))
                continue;
            bool is_facing = normal[0] * l[0] + normal[1] * l[1] + normal[2] * l[2] >= 0;
            tally->arriving++;
            tally->facing += is_facing;
            assert_true(is_found || !is_facing);
        }
        assert_int_equal(at, count);
        tally->found += (int)count;
        tally->reaching += (int)reaching;
    }
}

static void no_light_that_arrives_is_left_out(void **unused)
{
    (void)unused;
    struct state_light lights[LIGHTS];
    place_lights(lights);
    struct scene_state state = {.lights = lights, .light_count = LIGHTS};
    struct rt_scene scene = {.state = &state, .origin = {0.25, -0.5, 0.125}};
    struct view view = {.width_px = 8, .height_px = 8};
    struct raytrace_desc desc = {.view = &view, .state = &state, .asks_all_lights = true};
    struct rt_light_set light_set = {0};
    struct tally sided = {0}, any_side = {0};
    struct error err = {0};
    uint64_t seed = 5;
    assert_true(rt_light_set_init(&light_set, &scene, &desc, &err));
    for (int i = 0; i < POINTS; i++) {
        double direction[3];
        random_direction(&seed, direction);
        float point[3], normal[3];
        for (int k = 0; k < 3; k++) {
            point[k] = (float)random_uniform(&seed, -5, 5);
            normal[k] = (float)direction[k];
        }
        look_at_all(&light_set, point, normal, &sided);
        look_at_all(&light_set, point, (const float[3]){0}, &any_side);
    }
    /* what is let through in vain is a matter of rounding */
    assert_int_in_range(sided.found, sided.facing, sided.facing + sided.facing / 1000);
    assert_int_in_range(any_side.found, any_side.arriving,
                        any_side.arriving + any_side.arriving / 1000);
    assert_int_equal(sided.reaching, any_side.found);
    assert_true(sided.facing > 10000 && sided.arriving > sided.facing + 10000);
    rt_light_set_finish(&light_set);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(no_light_that_arrives_is_left_out)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
