/* SPDX-License-Identifier: MIT */
/* How large the per-pixel lists of windows were, so that storage for the next ones is reserved
 * without asking the device how large they are. Pure functions. Thread: any. */
#ifndef VITRAIL_RENDERER_TRANSPARENCY_LIST_SIZES_H
#define VITRAIL_RENDERER_TRANSPARENCY_LIST_SIZES_H

#include "renderer/base/content_key.h"

struct list_sizes {
    uint64_t entries; /* of all lists of a window */
    uint64_t longest; /* entries of one list */
};

enum { LIST_HISTORY_SLOTS = 8 }; /* windows of views that take turns; others find nothing */

struct list_history { /* zeroed = nothing is known */
    struct list_history_slot {
        struct content_key key;
        struct list_sizes seen;
        uint64_t used;
    } slots[LIST_HISTORY_SLOTS];
    uint64_t clock;
};

/* Lists of such a window were so large. What was larger before is forgotten by an eighth a time. */
void list_history_note(struct list_history *history, struct content_key key,
                       struct list_sizes sizes);
/* The room that the next ones should have: a quarter more than was seen, and lists of LIST_RUN
 * entries times a power of two. False: nothing is known. */
enum { LIST_RUN = 16 /* RUN of shaders/transparency/lists_sort.comp.glsl */ };
bool list_history_find(struct list_history *history, struct content_key key,
                       struct list_sizes *room);
bool list_sizes_fit(const struct list_sizes *sizes, const struct list_sizes *room);

#endif
