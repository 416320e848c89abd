/* SPDX-License-Identifier: MIT */
/* Plans by their key: few, because only views at rest ask for one again. */
#include "renderer/plan/frame_plan.h"

static const uint64_t most_bytes = 64ull << 20; /* of all entries but the one in use */

static void drop(struct plan_cache_entry *entry)
{
    frame_plan_finish(&entry->plan);
    *entry = (struct plan_cache_entry){0};
}

static struct plan_cache_entry *oldest_entry(struct plan_cache *cache)
{
    struct plan_cache_entry *oldest = &cache->entries[0];
    for (int i = 1; i < PLAN_CACHE_ENTRIES; i++)
        if (cache->entries[i].last_use < oldest->last_use)
            oldest = &cache->entries[i];
    return oldest;
}

static uint64_t frame_plan_size_bytes(const struct frame_plan *plan)
{
    const struct geometry_items *items = &plan->items;
    uint64_t drawables = items->opaque_count + items->transparent_count + items->medium_count;
    return drawables * sizeof *items->opaque + shadow_needs_size_bytes(&plan->shadows);
}

/* Large scenes with many lights make large plans. */
static void trim(struct plan_cache *cache, const struct plan_cache_entry *keep)
{
    for (;;) {
        uint64_t total = 0;
        struct plan_cache_entry *oldest = NULL;
        for (int i = 0; i < PLAN_CACHE_ENTRIES; i++) {
            struct plan_cache_entry *entry = &cache->entries[i];
            if (entry == keep || !entry->size_bytes)
                continue;
            total += entry->size_bytes;
            if (!oldest || entry->last_use < oldest->last_use)
                oldest = entry;
        }
        if (!oldest || total <= most_bytes)
            return;
        drop(oldest);
    }
}

const struct frame_plan *plan_cache_get(struct plan_cache *cache, struct content_key key,
                                        const struct frame_plan_desc *desc, struct error *err)
{
    for (int i = 0; i < PLAN_CACHE_ENTRIES; i++) {
        struct plan_cache_entry *entry = &cache->entries[i];
        if (entry->last_use && content_key_equals(entry->key, key)) {
            entry->last_use = ++cache->clock;
            cache->hits++;
            return &entry->plan;
        }
    }
    struct plan_cache_entry *entry = oldest_entry(cache);
    drop(entry);
    if (!frame_plan_init(&entry->plan, desc, err))
        return NULL;
    entry->key = key;
    entry->last_use = ++cache->clock;
    entry->size_bytes = sizeof *entry + frame_plan_size_bytes(&entry->plan);
    cache->misses++;
    trim(cache, entry);
    return &entry->plan;
}

void plan_cache_clear(struct plan_cache *cache)
{
    for (int i = 0; i < PLAN_CACHE_ENTRIES; i++)
        drop(&cache->entries[i]);
}
