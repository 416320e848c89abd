/* SPDX-License-Identifier: MIT */
/* A small table of kinds of frames, from which the least recently used one is evicted. */
#include "renderer/window/time_slice_pace.h"

#include <math.h>
#include <string.h>

#include "renderer/window/time_slices.h"

static double pass_ms(const struct frame_report *report, const char *pass)
{
    double ms = 0;
    for (int i = 0; i < report->pass_count; i++)
        if (strcmp(report->passes[i].pass, pass) == 0)
            ms += report->passes[i].ms;
    return ms;
}

static void note(double *per_ms, uint64_t count, double ms)
{
    if (count && ms > 0)
        *per_ms = (double)count / ms;
}

static int find(const struct time_slice_history *history, struct content_key key)
{
    for (int i = 0; i < TIME_SLICE_HISTORY_SLOTS; i++)
        if (content_key_equals(history->slots[i].key, key))
            return i;
    return -1;
}

static int oldest(const struct time_slice_history *history)
{
    int found = 0;
    for (int i = 1; i < TIME_SLICE_HISTORY_SLOTS; i++)
        if (history->slots[i].used < history->slots[found].used)
            found = i;
    return found;
}

void time_slice_history_note(struct time_slice_history *history, struct content_key key,
                             uint64_t pixels, const struct frame_report *report)
{
    int index = find(history, key);
    if (index < 0) {
        index = oldest(history);
        history->slots[index] = (struct time_slice_history_slot){.key = key};
    }
    struct time_slice_history_slot *slot = &history->slots[index];
    double *per_ms = slot->pace.per_ms;
    slot->used = ++history->clock;
    note(&per_ms[TIME_SLICE_LAYERS], report->counts.transparent_fragments,
         pass_ms(report, "shade.transparent"));
    note(&per_ms[TIME_SLICE_PIXELS], pixels, pass_ms(report, "shade.opaque"));
    note(&per_ms[TIME_SLICE_SHADOWS], report->counts.shadow_maps_built,
         report->stage_ms[REPORT_SHADOW]);
}

struct time_slice_pace time_slice_history_find(const struct time_slice_history *history,
                                               struct content_key key)
{
    int index = find(history, key);
    return index < 0 ? (struct time_slice_pace){{0}} : history->slots[index].pace;
}

uint64_t time_slice_pace_first(const struct time_slice_pace *pace, enum time_slice_kind kind,
                               uint64_t unknown)
{
    double first = pace->per_ms[kind] * TIME_SLICE_MS;
    return first > 0 ? (uint64_t)fmin(fmax(first, 1), 1e15) : unknown;
}
