/* SPDX-License-Identifier: MIT */
/* How much of a pass the device did in a millisecond in frames like this one. So a quick pass comes
 * in one slice, and the first slice of a long one has the right size. Pure functions. Thread: any.
 */
#ifndef VITRAIL_RENDERER_WINDOW_TIME_SLICE_PACE_H
#define VITRAIL_RENDERER_WINDOW_TIME_SLICE_PACE_H

#include "renderer/base/content_key.h"
#include "renderer/frame_report.h"

enum time_slice_kind { TIME_SLICE_LAYERS, TIME_SLICE_PIXELS, TIME_SLICE_SHADOWS, TIME_SLICE_KINDS };

struct time_slice_pace {
    /* Layers lit, pixels shaded, shadow structures built; 0: not known. */
    double per_ms[TIME_SLICE_KINDS];
};

enum { TIME_SLICE_HISTORY_SLOTS = 8 };

struct time_slice_history { /* zeroed = nothing is known */
    struct time_slice_history_slot {
        struct content_key key;
        struct time_slice_pace pace;
        uint64_t used;
    } slots[TIME_SLICE_HISTORY_SLOTS];
    uint64_t clock;
};

/* Learns from the times of a frame's passes. The pace of a pass that it did not run stays. */
void time_slice_history_note(struct time_slice_history *history, struct content_key key,
                             uint64_t pixels, const struct frame_report *report);
struct time_slice_pace time_slice_history_find(const struct time_slice_history *history,
                                               struct content_key key);
/* The units of the first slice: as many as take TIME_SLICE_MS, or `unknown`. */
uint64_t time_slice_pace_first(const struct time_slice_pace *pace, enum time_slice_kind kind,
                               uint64_t unknown);

#endif
