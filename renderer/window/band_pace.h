/* SPDX-License-Identifier: MIT */
/* How much of a pass the device did in a millisecond in frames like this one, so that what it does
 * soon comes in one piece, and the first piece of the rest has the right size. Pure functions.
 * Thread: any. */
#ifndef VITRAIL_RENDERER_WINDOW_BAND_PACE_H
#define VITRAIL_RENDERER_WINDOW_BAND_PACE_H

#include "renderer/base/content_key.h"
#include "renderer/frame_report.h"

enum band_kind { BAND_ENTRIES, BAND_PIXELS, BAND_SHADOWS, BAND_KINDS };

struct band_pace {
    double per_ms[BAND_KINDS]; /* list entries lit, pixels shaded, shadow structures built; 0: not
                                  known */
};

enum { BAND_HISTORY_SLOTS = 8 };

struct band_history { /* zeroed = nothing is known */
    struct band_history_slot {
        struct content_key key;
        struct band_pace pace;
        uint64_t used;
    } slots[BAND_HISTORY_SLOTS];
    uint64_t clock;
};

/* From the times of a frame's passes, where it has some; what it did not do stays as it was. */
void band_history_note(struct band_history *history, struct content_key key, uint64_t pixels,
                       const struct frame_report *report);
struct band_pace band_history_find(const struct band_history *history, struct content_key key);
/* The first piece: what takes BAND_MS, or `unknown`. */
uint64_t band_pace_first(const struct band_pace *pace, enum band_kind kind, uint64_t unknown);

#endif
