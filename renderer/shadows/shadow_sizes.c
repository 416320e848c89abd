/* SPDX-License-Identifier: MIT */
/* A table of lights by their keys: open addressing, linear probing. */
#include "renderer/shadows/shadow_sizes.h"

#include <stdlib.h>

enum {
    EVENTS_MORE = 1 << 8, /* so that few events may become some more: 5 KiB per light ... */
    LISTS_MORE = 1 << 8,  /* ... and few lists, of each class as many fewer as they are longer */
    SLOTS_FIRST = 64,
};

uint64_t deep_statistics_total(const struct deep_statistics *statistics)
{
    return statistics->total | (uint64_t)statistics->total_high << 32;
}

uint32_t deep_statistics_texels(const struct deep_statistics *statistics)
{
    uint32_t texels = 0;
    for (int c = 0; c < DEEP_CLASSES; c++)
        texels += statistics->classes[c];
    return texels;
}

bool deep_statistics_fit(const struct deep_statistics *sizes, const struct deep_statistics *room)
{
    bool fit = deep_statistics_total(sizes) <= deep_statistics_total(room) &&
               sizes->longest <= room->longest;
    for (int c = 0; c < DEEP_CLASSES; c++)
        fit = fit && sizes->classes[c] <= room->classes[c];
    return fit;
}

static uint32_t at_most(uint64_t value)
{
    return value < UINT32_MAX ? (uint32_t)value : UINT32_MAX;
}

/* A list that is as long as those that need no keys has no room to grow, so that guesses choose the
 * programs of what was seen. */
static uint32_t longest_room(uint32_t seen)
{
    uint64_t room = (uint64_t)seen + seen / 4 + 2;
    return seen <= SHADOW_SHORT_LIST && room > SHADOW_SHORT_LIST ? SHADOW_SHORT_LIST
                                                                 : at_most(room);
}

struct deep_statistics deep_statistics_room(const struct deep_statistics *seen)
{
    struct deep_statistics room = {0};
    uint64_t total = deep_statistics_total(seen), all = total + total / 4 + EVENTS_MORE;
    if (!total)
        return room;
    room.total = (uint32_t)all;
    room.total_high = (uint32_t)(all >> 32);
    room.longest = longest_room(seen->longest);
    uint32_t texels = deep_statistics_texels(seen);
    for (int c = 0; c < DEEP_CLASSES; c++) {
        uint64_t near = seen->classes[c];
        near += c ? seen->classes[c - 1] : seen->occupied > texels ? seen->occupied - texels : 0;
        near += c + 1 < DEEP_CLASSES ? seen->classes[c + 1] : 0;
        if (c == 0 || 1u << c < room.longest)
            room.classes[c] = at_most(seen->classes[c] + near / 4 + (LISTS_MORE >> c) + 1);
    }
    return room;
}

void shadow_history_finish(struct shadow_history *history)
{
    free(history->slots);
    *history = (struct shadow_history){0};
}

/* The light's slot, or the one that it would take. */
static struct shadow_history_slot *find(const struct shadow_history *history,
                                        struct content_key key)
{
    size_t at = (size_t)key.words[0] & (history->capacity - 1);
    while (content_key_is_set(history->slots[at].key) &&
           !content_key_equals(history->slots[at].key, key))
        at = (at + 1) & (history->capacity - 1);
    return &history->slots[at];
}

/* So that a quarter stays free, and searches are short. */
static bool has_place(struct shadow_history *history)
{
    if (history->count < history->capacity / 4 * 3)
        return true;
    struct shadow_history grown = {.capacity =
                                       history->capacity ? 2 * history->capacity : SLOTS_FIRST};
    bool forgets = grown.capacity > SHADOW_HISTORY_MOST;
    if (forgets)
        grown.capacity = SLOTS_FIRST;
    grown.slots = calloc(grown.capacity, sizeof *grown.slots);
    if (!grown.slots)
        return false;
    for (size_t i = 0; !forgets && i < history->capacity; i++)
        if (content_key_is_set(history->slots[i].key))
            *find(&grown, history->slots[i].key) = history->slots[i];
    grown.count = forgets ? 0 : history->count;
    free(history->slots);
    *history = grown;
    return true;
}

static uint32_t forget_slowly(uint32_t seen, uint32_t now)
{
    uint32_t least = seen - seen / 8 - (seen % 8 > 0);
    return now > least ? now : least;
}

static void forget_slowly_all(struct deep_statistics *seen, const struct deep_statistics *now)
{
    uint64_t total = deep_statistics_total(seen), least = total - (total + 7) / 8;
    total = deep_statistics_total(now) > least ? deep_statistics_total(now) : least;
    seen->total = (uint32_t)total;
    seen->total_high = (uint32_t)(total >> 32);
    seen->longest = forget_slowly(seen->longest, now->longest);
    seen->occupied = forget_slowly(seen->occupied, now->occupied);
    for (int c = 0; c < DEEP_CLASSES; c++)
        seen->classes[c] = forget_slowly(seen->classes[c], now->classes[c]);
}

void shadow_history_note(struct shadow_history *history, struct content_key key,
                         const struct deep_statistics *sizes)
{
    struct shadow_history_slot *slot = history->capacity ? find(history, key) : NULL;
    if (slot && content_key_is_set(slot->key)) {
        forget_slowly_all(&slot->seen, sizes);
        return;
    }
    if (!has_place(history))
        return;
    *find(history, key) = (struct shadow_history_slot){.key = key, .seen = *sizes};
    history->count++;
}

bool shadow_history_find(const struct shadow_history *history, struct content_key key,
                         struct deep_statistics *room)
{
    const struct shadow_history_slot *slot = history->capacity ? find(history, key) : NULL;
    if (!slot || !content_key_is_set(slot->key))
        return false;
    *room = deep_statistics_room(&slot->seen);
    return true;
}
