/* SPDX-License-Identifier: MIT */
/* The second half of the self-test: whole frames of a small scene, by the structures that frames
 * may use. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_SCENE_SELFTEST_H
#define VITRAIL_RENDERER_FRAME_SCENE_SELFTEST_H

#include "renderer/plan/plan.h"
#include "renderer/renderer.h"

/* Trials are bits of a set: those of every structure (struct shadow_trial), of linked light lists
 * and of one sample per pixel. The first is that of SHADOWS_RASTER_DEFAULT, of which most pictures
 * are made. */
enum { SELFTEST_START = 1 };
uint32_t scene_selftest_all(void);

/* Renders a floor behind two panes of glass under 10, then 150, then 20 spots, half of them behind
 * a wall, once in each trial that is wanted, so that what it keeps on the device grows and
 * shrinks; light lists, pixel lists and shading are tested by each. Two more sheets end within the
 * picture, for the samples of pixels. Compares each picture with its closed form. ERROR_NO_DEVICE
 * names the structure, the lights, the pixel, what was expected and what was found. Leaves what
 * frames leave: for a renderer that serves nobody afterwards. */
MUST_CHECK bool scene_selftest(struct renderer *renderer, uint32_t wanted, struct error *err);

/* The trials of what a frame with this plan has. */
uint32_t scene_selftest_needs(const struct plan *plan, const struct view_quality *quality);

#endif
