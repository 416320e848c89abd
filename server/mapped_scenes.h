/* SPDX-License-Identifier: MIT */
/* The worker's scenes: blobs mapped once, opened once, attached to the renderer, least recently
 * used ones let go above a budget. Thread: GL. */
#ifndef VITRAIL_SERVER_MAPPED_SCENES_H
#define VITRAIL_SERVER_MAPPED_SCENES_H

#include <stdint.h>

#include "protocol/error.h"
#include "renderer/renderer.h"
#include "renderer/scene/scene.h"

struct mapped_scenes;

struct mapped_scenes_totals {
    uint64_t bytes, scenes, hits, misses, evictions;
};

struct mapped_scenes *mapped_scenes_create(struct renderer *renderer, uint64_t budget_bytes,
                                           struct error *err);
void mapped_scenes_destroy(struct mapped_scenes *scenes); /* before the renderer; accepts NULL */

/* Makes the scene `key` ready to render. blob_fd is mapped if the scene is not there yet; it stays
 * the caller's. */
MUST_CHECK bool mapped_scenes_attach(struct mapped_scenes *scenes, const char *key, int blob_fd,
                                     struct error *err);
const struct scene *mapped_scenes_newest(const struct mapped_scenes *scenes); /* the last one made
                                                                                 ready; or NULL */
/* Whether attaching it again would be free. */
bool mapped_scenes_has(const struct mapped_scenes *scenes, const char *key);
void mapped_scenes_forget(struct mapped_scenes *scenes, const char *key); /* no-op when absent */

struct mapped_scenes_totals mapped_scenes_get_totals(const struct mapped_scenes *scenes);

#endif
