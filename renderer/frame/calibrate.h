/* SPDX-License-Identifier: MIT */
/* Measures how fast a device is at what `auto` chooses by, with frames of a scene of its own. */
#ifndef VITRAIL_RENDERER_FRAME_CALIBRATE_H
#define VITRAIL_RENDERER_FRAME_CALIBRATE_H

#include "renderer/forecast/forecast.h"
#include "renderer/renderer.h"

struct calibration {
    struct device_speed speed;
    double elapsed_ms; /* all that it took, compiling included */
    int rounds;        /* of frames; the fastest of each kind counts */
};

/* The time of a frame when nothing else runs: its wall time. If it was drawn by processors that
 * others used, too, it is its processor time spread over them. */
double calibrate_alone_ms(double wall_ms, double processor_ms, bool is_on_processors);

/* A first round compiles the programs of an opaque scene (which frames of others use, too); further
 * ones are timed until there are three and 0.2 s have passed, or 0.6 s where they are slow. Needs a
 * renderer with no frame under way; leaves nothing behind but compiled programs. Thread: GL. */
MUST_CHECK bool renderer_calibrate(struct renderer *renderer, struct calibration *calibration,
                                   struct error *err);

#endif
