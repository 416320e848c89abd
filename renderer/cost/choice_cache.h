/* SPDX-License-Identifier: MIT */
/* Choices of techniques by their key: a few, because a choice is asked for and then drawn by, and
 * only views at rest ask for one again. A forecast takes longer than a small picture, so that some
 * frames of a view in motion go by one. Thread: any. */
#ifndef VITRAIL_RENDERER_COST_CHOICE_CACHE_H
#define VITRAIL_RENDERER_COST_CHOICE_CACHE_H

#include "renderer/base/content_key.h"
#include "renderer/cost/auto_technique.h"
#include "renderer/cost/workload.h"

enum {
    CHOICE_CACHE_ENTRIES = 8,
    CHOICE_MOVING_FRAMES = 8, /* that go by one forecast: a fifth of a second of motion */
};

struct choice_cache_entry {
    struct content_key key;
    struct auto_choice choice;
    struct light_reach reach; /* that the choice has found; empty once it was taken */
    uint64_t last_use;        /* 0: no entry */
};

struct choice_cache { /* zeroed = empty */
    struct choice_cache_entry entries[CHOICE_CACHE_ENTRIES];
    uint64_t clock;
    struct content_key moving_key;
    struct auto_choice moving;
    int moving_left; /* frames that may still go by it; 0: none is kept */
    struct workload_kept kept;
};

/* The choice under its key, made where it is absent; valid until the next call. NULL with err.
 * `reach` and `kept` of the desc are not used. */
const struct auto_choice *choice_cache_get(struct choice_cache *cache, struct content_key key,
                                           const struct auto_desc *desc, struct error *err);
/* The same for a view in motion, with a key that leaves out what moves: the choice may be that of
 * one of the frames before. */
const struct auto_choice *choice_cache_get_moving(struct choice_cache *cache,
                                                  struct content_key key,
                                                  struct content_key moving_key,
                                                  const struct auto_desc *desc, struct error *err);
/* Takes the lights in view that the choice has found, so that the plan of the same view need not
 * find them again; the caller finishes them. Empty where there is none. */
struct light_reach choice_cache_take_reach(struct choice_cache *cache, struct content_key key);
void choice_cache_clear(struct choice_cache *cache);

#endif
