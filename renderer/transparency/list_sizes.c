/* SPDX-License-Identifier: MIT */
/* A small table of windows; the one used longest ago makes way. */
#include "renderer/transparency/list_sizes.h"

enum { ENTRIES_MORE = 1 << 10 }; /* so that few entries may become some more */

static struct list_history_slot *find(struct list_history *history, struct content_key key)
{
    for (int i = 0; i < LIST_HISTORY_SLOTS; i++)
        if (content_key_equals(history->slots[i].key, key))
            return &history->slots[i];
    return NULL;
}

static struct list_history_slot *oldest(struct list_history *history)
{
    struct list_history_slot *found = &history->slots[0];
    for (int i = 1; i < LIST_HISTORY_SLOTS; i++)
        if (history->slots[i].used < found->used)
            found = &history->slots[i];
    return found;
}

static uint64_t forget_slowly(uint64_t seen, uint64_t now)
{
    uint64_t least = seen - (seen + 7) / 8;
    return now > least ? now : least;
}

void list_history_note(struct list_history *history, struct content_key key,
                       struct list_sizes sizes)
{
    struct list_history_slot *slot = find(history, key);
    if (!slot) {
        slot = oldest(history);
        *slot = (struct list_history_slot){.key = key};
    }
    slot->seen.entries = forget_slowly(slot->seen.entries, sizes.entries);
    slot->seen.longest = forget_slowly(slot->seen.longest, sizes.longest);
    slot->used = ++history->clock;
}

bool list_history_find(struct list_history *history, struct content_key key,
                       struct list_sizes *room)
{
    struct list_history_slot *slot = find(history, key);
    if (!slot)
        return false;
    const struct list_sizes *seen = &slot->seen;
    slot->used = ++history->clock;
    *room = (struct list_sizes){.entries = 0};
    if (!seen->entries)
        return true;
    room->entries = seen->entries + seen->entries / 4 + ENTRIES_MORE;
    room->longest = LIST_RUN;
    while (room->longest < seen->longest + seen->longest / 4)
        room->longest *= 2;
    return true;
}

bool list_sizes_fit(const struct list_sizes *sizes, const struct list_sizes *room)
{
    return sizes->entries <= room->entries && sizes->longest <= room->longest;
}
