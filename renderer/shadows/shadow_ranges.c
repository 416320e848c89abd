/* SPDX-License-Identifier: MIT */
/* The free list of a pool. */
#include "renderer/shadows/shadow_ranges.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

void shadow_ranges_finish(struct shadow_ranges *ranges)
{
    free(ranges->free);
    *ranges = (struct shadow_ranges){0};
}

static void remove_free(struct shadow_ranges *ranges, size_t index)
{
    ranges->free_count--;
    memmove(ranges->free + index, ranges->free + index + 1,
            (ranges->free_count - index) * sizeof *ranges->free);
}

bool shadow_ranges_take(struct shadow_ranges *ranges, uint64_t count, struct shadow_range *taken)
{
    if (count == 0) {
        *taken = (struct shadow_range){0};
        return true;
    }
    for (size_t i = 0; i < ranges->free_count; i++) {
        struct shadow_range *range = &ranges->free[i];
        if (range->count < count)
            continue;
        *taken = (struct shadow_range){range->first, count};
        range->first += count;
        range->count -= count;
        if (range->count == 0)
            remove_free(ranges, i);
        return true;
    }
    return false;
}

static bool insert_free(struct shadow_ranges *ranges, size_t index, struct shadow_range range,
                        struct error *err)
{
    if (ranges->free_count == ranges->free_capacity) {
        size_t capacity = ranges->free_capacity ? 2 * ranges->free_capacity : 16;
        void *grown = realloc(ranges->free, capacity * sizeof *ranges->free);
        if (!grown)
            return error_set(err, ERROR_NO_MEMORY, "%zu free ranges", capacity);
        ranges->free = grown;
        ranges->free_capacity = capacity;
    }
    memmove(ranges->free + index + 1, ranges->free + index,
            (ranges->free_count - index) * sizeof *ranges->free);
    ranges->free[index] = range;
    ranges->free_count++;
    return true;
}

bool shadow_ranges_free(struct shadow_ranges *ranges, struct shadow_range *range, struct error *err)
{
    struct shadow_range given = *range;
    if (given.count == 0)
        return true;
    assert(given.first + given.count <= ranges->capacity);
    size_t next = 0;
    while (next < ranges->free_count && ranges->free[next].first < given.first)
        next++;
    struct shadow_range *before = next > 0 ? &ranges->free[next - 1] : NULL;
    struct shadow_range *after = next < ranges->free_count ? &ranges->free[next] : NULL;
    bool joins_before = before && before->first + before->count == given.first;
    bool joins_after = after && given.first + given.count == after->first;
    assert(!before || before->first + before->count <= given.first);
    assert(!after || given.first + given.count <= after->first);
    if (joins_before) {
        before->count += given.count + (joins_after ? after->count : 0);
        if (joins_after)
            remove_free(ranges, next);
    } else if (joins_after) {
        after->first = given.first;
        after->count += given.count;
    } else if (!insert_free(ranges, next, given, err)) {
        return false;
    }
    *range = (struct shadow_range){0};
    return true;
}

uint64_t shadow_ranges_capacity_for(const struct shadow_ranges *ranges, uint64_t count)
{
    uint64_t tail = 0;
    for (size_t i = 0; i < ranges->free_count; i++) {
        const struct shadow_range *range = &ranges->free[i];
        if (range->count >= count)
            return ranges->capacity;
        if (range->first + range->count == ranges->capacity)
            tail = range->count;
    }
    return ranges->capacity - tail + count;
}

bool shadow_ranges_is_empty(const struct shadow_ranges *ranges)
{
    return ranges->capacity == 0 ||
           (ranges->free_count == 1 && ranges->free[0].count == ranges->capacity);
}

void shadow_ranges_trim(struct shadow_ranges *ranges)
{
    struct shadow_range *last = ranges->free_count ? &ranges->free[ranges->free_count - 1] : NULL;
    if (!last || last->first + last->count != ranges->capacity)
        return;
    ranges->capacity = last->first;
    ranges->free_count--;
}

bool shadow_ranges_grow(struct shadow_ranges *ranges, uint64_t capacity, struct error *err)
{
    assert(capacity >= ranges->capacity);
    struct shadow_range added = {ranges->capacity, capacity - ranges->capacity};
    ranges->capacity = capacity;
    return shadow_ranges_free(ranges, &added, err);
}

bool shadow_ranges_capacity_for_all(const struct shadow_ranges *ranges, const uint64_t *counts,
                                    size_t count, uint64_t *capacity, struct error *err)
{
    size_t bytes = (ranges->free_count + 1) * sizeof *ranges->free;
    struct shadow_ranges trial = {.free = malloc(bytes),
                                  .free_count = ranges->free_count,
                                  .free_capacity = ranges->free_count + 1,
                                  .capacity = ranges->capacity};
    struct shadow_range taken;
    bool ok = trial.free || error_set(err, ERROR_NO_MEMORY, "%zu bytes of free ranges", bytes);
    if (ok && ranges->free_count)
        memcpy(trial.free, ranges->free, ranges->free_count * sizeof *ranges->free);
    for (size_t i = 0; ok && i < count; i++) {
        uint64_t need = shadow_ranges_capacity_for(&trial, counts[i]);
        ok = counts[i] == 0 || need == trial.capacity || shadow_ranges_grow(&trial, need, err);
        ok = ok && shadow_ranges_take(&trial, counts[i], &taken);
    }
    *capacity = trial.capacity;
    shadow_ranges_finish(&trial);
    return ok;
}
