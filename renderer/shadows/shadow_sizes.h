/* SPDX-License-Identifier: MIT */
/* How large the lists of lights were, so that storage for the next ones is reserved without asking
 * the device how large they are. Pure functions. Thread: any. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_SIZES_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_SIZES_H

#include <stddef.h>

#include "renderer/base/content_key.h"

enum {
    /* Class c: lists of 2^c + 1 to 2^(c + 1) events; class 0: of 2, and with media of 1. */
    DEEP_CLASSES = 16,
};

struct deep_statistics { /* of one light; words as shadow_scan.comp.glsl writes them */
    uint32_t total, total_high, longest, occupied;
    uint32_t classes[DEEP_CLASSES]; /* texels per class */
};
enum {
    DEEP_FIRST_CLASS_WORD = 4,
    DEEP_STATISTIC_WORDS = sizeof(struct deep_statistics) / 4,
};

uint64_t deep_statistics_total(const struct deep_statistics *statistics);  /* events */
uint32_t deep_statistics_texels(const struct deep_statistics *statistics); /* of all classes */
/* Whether lists of such sizes have this room. */
bool deep_statistics_fit(const struct deep_statistics *sizes, const struct deep_statistics *room);

/* Lights of which so much is known. Beyond that all is forgotten, and found out again: 6 MB. */
enum { SHADOW_HISTORY_MOST = 1 << 16 };

struct shadow_history { /* zeroed = nothing is known */
    struct shadow_history_slot {
        struct content_key key; /* of nothing: free */
        struct deep_statistics seen;
    } * slots;
    size_t count, capacity; /* a power of two */
};

void shadow_history_finish(struct shadow_history *history);
/* Lists of such a light were so large. What was larger before is forgotten by an eighth a time.
 * Without memory nothing is noted. */
void shadow_history_note(struct shadow_history *history, struct content_key key,
                         const struct deep_statistics *sizes);
/* The room that the next ones should have. False: nothing is known. */
bool shadow_history_find(const struct shadow_history *history, struct content_key key,
                         struct deep_statistics *room);

/* Up to this many events a list is searched without keys: shadow_programs.c. */
enum { SHADOW_SHORT_LIST = 15 };
/* Room for the counted events and a quarter more. Lists change between neighbouring classes when a
 * light moves, so each class has room for a quarter of its neighbours', too. None without events.
 * Outside of this module, tests ask it. */
struct deep_statistics deep_statistics_room(const struct deep_statistics *seen);

#endif
