/* SPDX-License-Identifier: MIT */
/* Remembers what the worker drew for the last requests with a target (max_error, budget_ms). So a
 * client that has the picture already gets a 304 without another frame. Thread: any. */
#ifndef VITRAIL_SERVER_VIEWS_TARGET_DIGESTS_H
#define VITRAIL_SERVER_VIEWS_TARGET_DIGESTS_H

#include <stdbool.h>

#include "protocol/error.h"
#include "server/base/digest.h"

struct target_digests;

struct target_digests *target_digests_create(struct error *err);
void target_digests_destroy(struct target_digests *digests); /* accepts NULL */

/* target: image_digest of the request with its target and of what is chosen from. drawn: as in
 * render_outcome. */
void target_digests_note(struct target_digests *digests, const char *target, const char *drawn);

/* False if the request was not drawn yet, or so long ago that it is forgotten. */
bool target_digests_find(struct target_digests *digests, const char *target,
                         char drawn[DIGEST_TEXT_BYTES]);

#endif
