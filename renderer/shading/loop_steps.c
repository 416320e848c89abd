/* SPDX-License-Identifier: MIT */
/* Steps of the loops of shaders/shading/lighting.glsl, shadow_query.glsl, shadow_lookup_*.glsl and
 * shade_pixels.comp.glsl. A loop takes one more than its rounds, for the test that ends it, and one
 * where no lane enters it. Measured before lights were chosen by the 32, which takes fewer (two of
 * a light and one of 32), with n lights at one point, by the n from which on light is missing
 * (llvmpipe 22.3): 3.02 a light without shadow, 12.1 with four surfaces; with a shadow 12.8
 * and 3.3 to 4.8 a tap, behind all events of a list of 3 to 300; walked, 14 and 4.2 a tap and one
 * for each event. tests/gpu/test_loop_steps.c holds the bounds below against the device. */
#include "renderer/shading/loop_steps.h"

enum {
    STEPS_PER_LIGHT = 4,
    STEPS_PER_LOOK = 16,
    STEPS_PER_AREA = 2,   /* and one for each of its points */
    STEPS_PER_FORM = 96,  /* five lobes at most, of the 17 sides of a disk above the horizon */
    STEPS_PER_ANSWER = 2, /* of a ray */
    /* The tap, and the ends of the loops of every kind of structure, entered or not. */
    STEPS_PER_TAP = 10,
};

uint32_t loop_steps_most(uint32_t end)
{
    enum { LLVMPIPE_END = 65535 };
    uint64_t share = (uint64_t)end * LOOP_STEPS_MAX / LLVMPIPE_END;
    return end ? (uint32_t)share : (uint32_t)LOOP_STEPS_WATCHDOG;
}

static uint64_t halvings(uint64_t count)
{
    uint64_t steps = 0;
    while (count >> steps)
        steps++;
    return steps;
}

/* By halves in the keys, eight of which are read at once; by leaps and then halves in the events
 * of one key. */
static uint64_t steps_of_search(uint64_t longest)
{
    return halvings(longest / 8) + 2 * halvings(longest);
}

static uint64_t steps_of_light(const struct loop_lights *lights)
{
    uint64_t points = lights->points > 1 ? lights->points + STEPS_PER_AREA : 0;
    return STEPS_PER_LIGHT + points + (lights->has_area_form ? STEPS_PER_FORM : 0) +
           lights->grid_steps;
}

/* Points of areas are looked up in the loop over them. */
static uint64_t steps_of_look(const struct loop_lights *lights)
{
    uint64_t longest = lights->longest_list;
    uint64_t search = lights->walks_lists ? longest : steps_of_search(longest);
    return lights->taps ? STEPS_PER_LOOK + lights->taps * (STEPS_PER_TAP + search)
                        : STEPS_PER_ANSWER;
}

uint64_t loop_steps_of_lights(const struct loop_lights *lights, uint64_t count)
{
    uint64_t looks = count < lights->shadowed ? count : lights->shadowed;
    return lights->besides +
           lights->surfaces * (count * steps_of_light(lights) + looks * steps_of_look(lights));
}

uint64_t loop_steps_room(const struct loop_lights *lights, uint64_t steps)
{
    if (steps < lights->besides)
        return 0;
    uint64_t room = (steps - lights->besides) / lights->surfaces, look = steps_of_look(lights);
    uint64_t light = steps_of_light(lights), with_looks = room / (light + look);
    if (with_looks < lights->shadowed)
        return with_looks;
    return (room - lights->shadowed * look) / light;
}

uint64_t loop_steps_of_layers(uint64_t longest, bool is_walked_twice)
{
    return is_walked_twice ? 2 * longest : longest;
}
