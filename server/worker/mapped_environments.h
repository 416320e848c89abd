/* SPDX-License-Identifier: MIT */
/* The worker's environment maps: made from their blobs and attached to the renderer, which lets the
 * least recently used go. Thread: GL. */
#ifndef VITRAIL_SERVER_WORKER_MAPPED_ENVIRONMENTS_H
#define VITRAIL_SERVER_WORKER_MAPPED_ENVIRONMENTS_H

#include "protocol/error.h"
#include "renderer/renderer.h"

struct mapped_environments;

struct mapped_environments *mapped_environments_create(struct renderer *renderer,
                                                       struct error *err);
/* Before the renderer; accepts NULL. */
void mapped_environments_destroy(struct mapped_environments *environments);

/* Makes the map ready. key: an id, whose blob is read if the map is not there yet, or the name of
 * one that is built into the renderer, then there is nothing to do. */
MUST_CHECK bool mapped_environments_attach(struct mapped_environments *environments,
                                           const char *key, int blob_fd, struct error *err);
/* Whether attaching it again would be free. */
bool mapped_environments_has(const struct mapped_environments *environments, const char *key);
/* Does nothing where it is absent. */
void mapped_environments_forget(struct mapped_environments *environments, const char *key);
/* Frees maps that the renderer let go. Not while a frame is paused, which may show one of them. */
void mapped_environments_sweep(struct mapped_environments *environments);

#endif
