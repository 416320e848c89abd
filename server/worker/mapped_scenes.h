/* SPDX-License-Identifier: MIT */
/* The worker's scenes: blobs mapped once, opened once, attached to the renderer, least recently
 * used ones let go above a budget. Thread: GL. */
#ifndef VITRAIL_SERVER_WORKER_MAPPED_SCENES_H
#define VITRAIL_SERVER_WORKER_MAPPED_SCENES_H

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

/* Makes scenes ready to render, all at once: none of them is let go for another. */
struct mapped_scenes_desc { /* all required, borrowed */
    const char *const *keys;
    const int *blob_fds; /* by key; mapped if the scene is not there yet */
    size_t count;
};
MUST_CHECK bool mapped_scenes_attach(struct mapped_scenes *scenes,
                                     const struct mapped_scenes_desc *desc, struct error *err);
/* Whether attaching it again would be free. */
bool mapped_scenes_has(const struct mapped_scenes *scenes, const char *key);
void mapped_scenes_forget(struct mapped_scenes *scenes, const char *key); /* no-op when absent */

struct mapped_scenes_totals mapped_scenes_get_totals(const struct mapped_scenes *scenes);

#endif
