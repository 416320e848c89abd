/* SPDX-License-Identifier: MIT */
/* The demo scene: a chapel with stained-glass windows, made by the project itself. Thread: any. */
#ifndef VITRAIL_GLB_DEMO_SCENE_H
#define VITRAIL_GLB_DEMO_SCENE_H

#include <stddef.h>

#include "protocol/error.h"

struct demo_scene_desc {
    int texture_size_px;  /* side of the rose window's texture; 0 means 1024; [64, 4096] */
    double light_factor;  /* on every light and on the sky; 0 means 1 */
    bool has_no_curtains; /* leaves out the BLEND cloth */
    int coarseness; /* round and folded things have so many times fewer sides; 0 means 1; [1, 4] */
};

/* Writes a GLB to *glb (malloc'ed, caller frees). The same desc gives the same bytes on one
 * machine.
 *
 * World: +Y up, metres. The nave runs along z from the rose window at z = -10 to the door at
 * z = 10, x in [-5, 5], the floor at y = 0. Cameras: nodes "Nave" (first) and "Vessel". Lights:
 * 12, all KHR_lights_punctual. Lit surfaces have a radiance of about 0.1 to 1. */
MUST_CHECK bool demo_scene_build(const struct demo_scene_desc *desc, void **glb, size_t *size_bytes,
                                 struct error *err);

#endif
