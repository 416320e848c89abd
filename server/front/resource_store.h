/* SPDX-License-Identifier: MIT */
/* What clients upload, by its content address on disk: one directory each, published by rename.
 * Thread: any.
 *
 * STATE/FOLDER/ID/blob          what decoding left
 * STATE/FOLDER/ID/summary.json  what GET /v1/FOLDER/ID answers, and the version of the blob
 * STATE/FOLDER/ID/outline.json  of a scene: what GET /v1/scenes/ID/outline answers
 * STATE/FOLDER/ID/used          of a scene: empty; its time is when the scene last followed another
 *                               one in giving images */
#ifndef VITRAIL_SERVER_FRONT_RESOURCE_STORE_H
#define VITRAIL_SERVER_FRONT_RESOURCE_STORE_H

#include <jansson.h>
#include <stdbool.h>
#include <stdint.h>

#include "protocol/error.h"
#include "server/base/digest.h"
#include "server/base/log.h"
#include "server/front/resource_kind.h"
#include "server/front/state_dir.h"

enum { RESOURCES_STORED_MAX = 65536 /* of a kind; their list still fits one reply */ };

struct resource_store;

struct resource_store_desc { /* all required; borrowed */
    struct state_dir *state;
    const struct log *log;
    enum resource_kind kind;
};
/* Reads what is there; what has another blob version or is half written is removed with a warning.
 */
struct resource_store *resource_store_create(const struct resource_store_desc *desc,
                                             struct error *err);
void resource_store_destroy(struct resource_store *store); /* accepts NULL; files stay */

/* One in the making. Zeroed = none. */
struct resource_draft {
    char name[48];
    int blob_fd; /* open for reading and writing, owned by the draft */
};
MUST_CHECK bool resource_draft_begin(struct resource_store *store, struct resource_draft *draft,
                                     struct error *err);

/* Publishes the draft under the "id" of its summary, durably; takes "outline" out of the summary.
 * *is_new is false when that id was there already (and is kept). */
MUST_CHECK bool resource_draft_commit(struct resource_store *store, struct resource_draft *draft,
                                      json_t *summary, bool *is_new, struct error *err);
/* Accepts zeroed and committed drafts. */
void resource_draft_discard(struct resource_store *store, struct resource_draft *draft);

bool resource_store_has(struct resource_store *store, const char *id);

/* All below answer ERROR_NOT_FOUND for an unknown id. */
MUST_CHECK int resource_store_open_blob(struct resource_store *store, const char *id,
                                        struct error *err); /* read-only */
MUST_CHECK json_t *resource_store_get_summary(struct resource_store *store, const char *id,
                                              struct error *err);
/* Likewise, what GET /v1/scenes/ID/outline answers; scenes only. */
MUST_CHECK json_t *resource_store_get_outline(struct resource_store *store, const char *id,
                                              struct error *err);
/* Sets what it is called, NULL: nothing; durable. `name` has passed scene_name_check(). */
MUST_CHECK bool resource_store_rename(struct resource_store *store, const char *id,
                                      const char *name, struct error *err);
MUST_CHECK bool resource_store_remove(struct resource_store *store, const char *id,
                                      struct error *err);

/* An array of objects with the members of the kind's list, oldest first. NULL: no memory. */
MUST_CHECK json_t *resource_store_list(struct resource_store *store);

/* It gave an image just now. A failure to write that down has no consequence. */
void resource_store_note_use(struct resource_store *store, const char *id);

/* Those that gave images, the last used first; returns how many, at most `most`. */
size_t resource_store_recent(struct resource_store *store, char (*ids)[DIGEST_TEXT_BYTES],
                             size_t most);

struct resource_store_totals {
    uint64_t count, decoded_bytes;
};
struct resource_store_totals resource_store_get_totals(struct resource_store *store);

#endif
