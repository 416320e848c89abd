/* SPDX-License-Identifier: MIT */
/* Maps of light by their keys, the least recently used first out. Thread: GL. */
#ifndef VITRAIL_RENDERER_FRAME_ENVIRONMENT_CACHE_H
#define VITRAIL_RENDERER_FRAME_ENVIRONMENT_CACHE_H

#include "renderer/renderer.h"
#include "renderer/shading/environment_maps.h"

enum { ENVIRONMENT_KEY_BYTES = 65 };

struct resident_environment { /* environment NULL: free */
    char key[ENVIRONMENT_KEY_BYTES];
    const struct environment *environment;
    void (*release)(void *context);
    void *context;
    uint64_t last_use;
    struct environment_maps maps; /* of those that were rasterised with */
};

struct environment_cache { /* zeroed: empty */
    struct resident_environment entries[RENDERER_ENVIRONMENTS_MAX];
    struct environment *studio; /* owned; NULL: no view had it yet */
    uint64_t clock;
};

void environment_cache_finish(struct environment_cache *cache); /* releases all */

/* The light of the view's map; its environment is NULL where the view names none. ERROR_NOT_FOUND:
 * there is none with its key, and it is not the studio's. Marks it as used. */
MUST_CHECK bool environment_cache_open(struct renderer *renderer, const struct view *view,
                                       struct environment_light *light, struct error *err);

/* What it is on the device, for that light of it; brought where it is not there yet. NULL with err.
 */
const struct environment_maps *environment_cache_maps(struct renderer *renderer,
                                                      const struct environment_light *light,
                                                      struct error *err);
uint64_t environment_cache_size_bytes(const struct environment_cache *cache); /* on the device */
/* Takes the least recently used map off the device that no frame shows, to be brought again when
 * one does. False: there is none. */
bool environment_cache_drop_oldest(struct renderer *renderer);

#endif
