/* SPDX-License-Identifier: MIT */
/* Hashing of what decides a shadow structure. */
#include "renderer/shadows/shadow_key.h"

#include <string.h>

#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

static const struct shadow_key START = {{0x243f6a8885a308d3ull, 0x13198a2e03707344ull}}; /* digits
                                                                                            of pi */

/* The finaliser of MurmurHash3 (Appleby, public domain) on two lanes of different seed. */
static uint64_t scramble(uint64_t x)
{
    x = (x ^ x >> 33) * 0xff51afd7ed558ccdull;
    x = (x ^ x >> 33) * 0xc4ceb9fe1a85ec53ull;
    return x ^ x >> 33;
}

static void add(struct shadow_key *key, uint64_t word)
{
    key->words[0] = scramble(key->words[0] ^ word);
    key->words[1] = scramble(key->words[1] + 0x9e3779b97f4a7c15ull * (word + 1));
}

static void add_doubles(struct shadow_key *key, const double *values, int count)
{
    for (int i = 0; i < count; i++) {
        uint64_t bits;
        memcpy(&bits, &values[i], sizeof bits);
        add(key, bits);
    }
}

struct shadow_key shadow_key_of_text(const char *text)
{
    struct shadow_key key = START;
    for (; *text; text++)
        add(&key, (unsigned char)*text);
    return key;
}

struct shadow_key shadow_key_of_map(const struct shadow_map *map,
                                    const struct shadow_casters *casters,
                                    const struct scene_state *state, uint32_t blend_filter)
{
    const struct shadow_frame *frame = &map->frame;
    struct shadow_key key = START;
    add(&key, map->scene.words[0]);
    add(&key, map->scene.words[1]);
    add(&key, map->kind | (uint64_t)map->flags << 8 | (uint64_t)map->is_faithful << 16 |
                  (uint64_t)map->resolution << 32);
    add(&key, frame->shape | (uint64_t)blend_filter << 32);
    add_doubles(&key, frame->origin, 3);
    add_doubles(&key, frame->axis[0], 9);
    add_doubles(&key, frame->scale, 2);
    add_doubles(&key, (double[]){frame->near_m, frame->depth_m, frame->range_m, frame->cone_rad},
                4);
    add_doubles(&key, frame->cone, 3);
    if (map->flags & SHADOW_FLAG_NODES) {
        add_doubles(&key, &map->compression, 1);
        add(&key, (uint64_t)map->prefilter << 1 | map->has_media);
    }
    for (size_t i = 0; i < casters->count; i++) {
        const struct state_item *item = &state->items[casters->items[i]];
        if (map->kind == SHADOW_MAP && item->class_ == STATE_TRANSPARENT)
            continue; /* a plain map does not show it */
        add(&key, item->shadow_hash);
        add(&key, casters->faces[i] | (uint64_t)item->class_ << 32);
    }
    return key;
}
