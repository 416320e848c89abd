/* SPDX-License-Identifier: MIT */
/* The second half of the self-test: whole frames of a small scene, by the structures that frames
 * may use. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_SCENE_SELFTEST_H
#define VITRAIL_RENDERER_FRAME_SCENE_SELFTEST_H

#include "renderer/plan/plan.h"
#include "renderer/renderer.h"

enum selftest_structure { /* a set of bits; each is tested on its own */
                          SELFTEST_DEEP = 1 << 0,
                          SELFTEST_MAP = 1 << 1,
                          SELFTEST_LINKED = 1 << 2,
                          SELFTEST_FAITHFUL = 1 << 3, /* deep-linked, as published */
                          SELFTEST_TRACED_SHADOWS = 1 << 4,
                          SELFTEST_LINKED_LIGHTS = 1 << 5,
                          SELFTEST_ONE_SAMPLE = 1 << 6, /* per pixel; all others take four */
                          SELFTEST_ALL = (1 << 7) - 1,
                          SELFTEST_START = SELFTEST_DEEP, /* what most pictures are made of */
};

/* Renders a floor behind two panes of glass under 10, then 150, then 20 spots, half of them behind
 * a wall, once by each structure that is wanted, so that what it keeps on the device grows and
 * shrinks; light lists, pixel lists and shading are tested by each. Two more sheets end within the
 * picture, for the samples of pixels. Compares each picture with its closed form. ERROR_NO_DEVICE
 * names the structure, the lights, the pixel, what was expected and what was found. Leaves what
 * frames leave: for a renderer that serves nobody afterwards. */
MUST_CHECK bool scene_selftest(struct renderer *renderer, uint32_t wanted, struct error *err);

/* The structures of a frame with this plan: a set of enum selftest_structure. */
uint32_t scene_selftest_needs(const struct plan *plan, const struct view_quality *quality);

#endif
