/* SPDX-License-Identifier: MIT */
/* Choices by their key; the one that was not asked for longest makes room. */
#include "renderer/cost/choice_cache.h"

static struct choice_cache_entry *find(struct choice_cache *cache, struct content_key key)
{
    for (int i = 0; i < CHOICE_CACHE_ENTRIES; i++)
        if (cache->entries[i].last_use && content_key_equals(cache->entries[i].key, key))
            return &cache->entries[i];
    return NULL;
}

static void drop(struct choice_cache_entry *entry)
{
    light_reach_finish(&entry->reach);
    *entry = (struct choice_cache_entry){.last_use = 0};
}

static struct choice_cache_entry *oldest_entry(struct choice_cache *cache)
{
    struct choice_cache_entry *oldest = &cache->entries[0];
    for (int i = 1; i < CHOICE_CACHE_ENTRIES; i++)
        if (cache->entries[i].last_use < oldest->last_use)
            oldest = &cache->entries[i];
    return oldest;
}

const struct auto_choice *choice_cache_get(struct choice_cache *cache, struct content_key key,
                                           const struct auto_desc *desc, struct error *err)
{
    struct choice_cache_entry *entry = find(cache, key);
    if (!entry) {
        entry = oldest_entry(cache);
        drop(entry);
        struct auto_desc own = *desc;
        own.reach = &entry->reach;
        own.kept = &cache->kept;
        if (!auto_choose(&entry->choice, &own, err)) {
            drop(entry);
            return NULL;
        }
        entry->key = key;
    }
    entry->last_use = ++cache->clock;
    return &entry->choice;
}

const struct auto_choice *choice_cache_get_moving(struct choice_cache *cache,
                                                  struct content_key key,
                                                  struct content_key moving_key,
                                                  const struct auto_desc *desc, struct error *err)
{
    bool is_kept = cache->moving_left && content_key_equals(cache->moving_key, moving_key);
    if (is_kept && !find(cache, key)) {
        cache->moving_left--;
        return &cache->moving;
    }
    const struct auto_choice *made = choice_cache_get(cache, key, desc, err);
    if (!made)
        return NULL;
    cache->moving = *made;
    cache->moving_key = moving_key;
    cache->moving_left = CHOICE_MOVING_FRAMES - 1;
    return made;
}

struct light_reach choice_cache_take_reach(struct choice_cache *cache, struct content_key key)
{
    struct choice_cache_entry *entry = find(cache, key);
    struct light_reach taken = {0};
    if (entry) {
        taken = entry->reach;
        entry->reach = (struct light_reach){0};
    }
    return taken;
}

void choice_cache_clear(struct choice_cache *cache)
{
    for (int i = 0; i < CHOICE_CACHE_ENTRIES; i++)
        drop(&cache->entries[i]);
    workload_kept_finish(&cache->kept);
    cache->moving_left = 0;
}
