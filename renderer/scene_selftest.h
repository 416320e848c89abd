/* SPDX-License-Identifier: MIT */
/* The second half of the start-up self-test: whole frames of a small scene. Thread: GL. */
#ifndef VITRAIL_RENDERER_SCENE_SELFTEST_H
#define VITRAIL_RENDERER_SCENE_SELFTEST_H

#include "renderer/renderer.h"

/* Renders a floor behind two panes of glass under 10, then 150, then 20 spots, half of them behind
 * a wall, with everything that deep shadows, light lists, pixel lists and shading use, so that what
 * they keep on the device grows and shrinks; and compares each picture with its closed form.
 * ERROR_NO_DEVICE names the lights, the pixel, what was expected and what was found. Leaves what
 * frames leave: for a renderer that serves nobody afterwards. */
MUST_CHECK bool scene_selftest(struct renderer *renderer, struct error *err);

#endif
