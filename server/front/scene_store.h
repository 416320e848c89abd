/* SPDX-License-Identifier: MIT */
/* Scenes on disk: one directory per content address under STATE/scenes, published by rename.
 * Thread: any.
 *
 * STATE/lock                    held while a daemon uses the directory
 * STATE/scenes/ID/blob          the decoded scene (renderer/scene/scene_blob.h)
 * STATE/scenes/ID/summary.json  what GET /v1/scenes/ID answers, and the version of the blob
 * STATE/scenes/ID/outline.json  what GET /v1/scenes/ID/outline answers
 * STATE/scenes/ID/used          empty; its time is when the scene last followed another one in
 *                               giving images
 * STATE/tmp/                    uploads and drafts; emptied at start
 * STATE/cache/                  shaders that the worker's driver has compiled
 * Nothing is ever written elsewhere. */
#ifndef VITRAIL_SERVER_FRONT_SCENE_STORE_H
#define VITRAIL_SERVER_FRONT_SCENE_STORE_H

#include <jansson.h>
#include <stdbool.h>
#include <stdint.h>

#include "protocol/error.h"
#include "protocol/scene_summary.h"
#include "server/base/digest.h"
#include "server/base/log.h"

enum { SCENES_STORED_MAX = 65536 /* their list still fits one reply */ };

struct scene_store;

/* Creates the directories (mode 0700), takes the lock and reads what is there; scenes of another
 * blob version or half written ones are removed with a warning. */
struct scene_store *scene_store_create(const char *state_dir, const struct log *log,
                                       struct error *err);
void scene_store_destroy(struct scene_store *store); /* accepts NULL; files stay */

/* An unnamed file in STATE/tmp, open for reading and writing; -1 on failure. */
MUST_CHECK int scene_store_open_spool(struct scene_store *store, struct error *err);

/* A scene in the making. Zeroed = none. */
struct scene_draft {
    char name[48];
    int blob_fd; /* open for reading and writing, owned by the draft */
};
MUST_CHECK bool scene_draft_begin(struct scene_store *store, struct scene_draft *draft,
                                  struct error *err);

/* Publishes the draft under summary->id, durably. *is_new is false when that id was there already
 * (and is kept). */
MUST_CHECK bool scene_draft_commit(struct scene_store *store, struct scene_draft *draft,
                                   const struct scene_summary *summary, bool *is_new,
                                   struct error *err);
/* Accepts zeroed and committed drafts. */
void scene_draft_discard(struct scene_store *store, struct scene_draft *draft);

bool scene_store_has(struct scene_store *store, const char *id);

/* All below answer ERROR_NOT_FOUND for an unknown id. */
MUST_CHECK int scene_store_open_blob(struct scene_store *store, const char *id,
                                     struct error *err); /* read-only */
MUST_CHECK json_t *scene_store_get_summary(struct scene_store *store, const char *id,
                                           struct error *err);
/* Likewise, what GET /v1/scenes/ID/outline answers. */
MUST_CHECK json_t *scene_store_get_outline(struct scene_store *store, const char *id,
                                           struct error *err);
/* Sets what the scene is called, NULL: nothing; durable. `name` has passed scene_name_check(). */
MUST_CHECK bool scene_store_rename(struct scene_store *store, const char *id, const char *name,
                                   struct error *err);
MUST_CHECK bool scene_store_remove(struct scene_store *store, const char *id, struct error *err);

/* An array of {id, name, triangles, *_count, bytes, created}, oldest first. NULL: no memory. */
MUST_CHECK json_t *scene_store_list(struct scene_store *store);

/* The scene gave an image just now. A failure to write that down has no consequence. */
void scene_store_note_use(struct scene_store *store, const char *id);

/* Scenes that gave images, the last used first; returns how many, at most `most`. */
size_t scene_store_recent(struct scene_store *store, char (*ids)[DIGEST_TEXT_BYTES], size_t most);

struct scene_store_totals {
    uint64_t scenes, decoded_bytes;
};
struct scene_store_totals scene_store_get_totals(struct scene_store *store);

#endif
