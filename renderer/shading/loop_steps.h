/* SPDX-License-Identifier: MIT */
/* How many steps the loops of one shader invocation take at most, and so how many lights one
 * dispatch may walk. llvmpipe up to 22.3 ends all loops of an invocation after 65,535 steps
 * together, without a word, and what they had not reached is missing in the image; other devices
 * have watchdogs. docs/reference/limits.md lists every loop and what bounds it. Pure
 * functions. Thread: any. */
#ifndef VITRAIL_RENDERER_SHADING_LOOP_STEPS_H
#define VITRAIL_RENDERER_SHADING_LOOP_STEPS_H

#include <stdbool.h>
#include <stdint.h>

enum {
    LOOP_STEPS_MAX = 60000, /* what an invocation may take where loops end after 65,535; the rest is
                               room for loops of a few steps that nobody counts */
    LOOP_STEPS_WATCHDOG = 1 << 18, /* where nothing ends loops: at 0.3 us for a step that waits for
                                      memory, an invocation takes 80 ms; watchdogs wait seconds */
};

/* What an invocation may take on a device that ends loops after so many steps; 0: that does not,
 * as far as LOOP_STEPS_WATCHDOG. */
uint32_t loop_steps_most(uint32_t end);

/* What the lights of a point ask of its invocation. */
struct loop_lights {
    uint64_t shadowed;     /* lights whose shadow is looked up, at most */
    uint64_t longest_list; /* events of a texel of their structures */
    uint32_t taps;         /* texels of one look; 0: the shadow is there already, traced */
    uint32_t points;       /* that are taken of an area light; 0 and 1: no light is taken so */
    bool has_area_form;    /* some lights are integrated over, along their outlines */
    bool walks_lists;      /* event by event, not by halves: linked lists, and lists that leave out
                              the object that asks */
    /* Lit one after the other, at most: as many as a pixel has samples; at least 1. */
    uint32_t surfaces;
    uint64_t grid_steps; /* on the way to a light through all density grids */
    uint64_t besides;    /* steps of the invocation's other loops */
};

/* Steps of an invocation whose surfaces have `count` lights each, at most. */
uint64_t loop_steps_of_lights(const struct loop_lights *lights, uint64_t count);

/* The most lights with which an invocation stays within the steps; 0: not even one fits. */
uint64_t loop_steps_room(const struct loop_lights *lights, uint64_t steps);

/* Steps of compositing a pixel's list; is_walked_twice: for what surrounds the eye, too. */
uint64_t loop_steps_of_layers(uint64_t longest, bool is_walked_twice);

#endif
