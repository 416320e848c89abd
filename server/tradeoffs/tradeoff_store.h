/* SPDX-License-Identifier: MIT */
/* Trade-offs on disk, beside the scenes that they measure. Thread: any, one at a time per id.
 *
 * STATE/tradeoffs/ID.json    a digest of what follows it, and the document; replaced by rename
 * STATE/tradeoffs/ID.images  the pictures that its rows point into
 * STATE/tradeoffs/NAME.corrupt  files that could not be read, kept for who wants to know why */
#ifndef VITRAIL_SERVER_TRADEOFFS_TRADEOFF_STORE_H
#define VITRAIL_SERVER_TRADEOFFS_TRADEOFF_STORE_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol/error.h"
#include "protocol/tradeoff.h"
#include "server/base/log.h"

struct tradeoff_store;

/* Creates the directory (mode 0700). The state directory exists and is ours. */
struct tradeoff_store *tradeoff_store_create(const char *state_dir, const struct log *log,
                                             struct error *err);
void tradeoff_store_destroy(struct tradeoff_store *store); /* accepts NULL; files stay */

/* Calls visit for every good file, in no order; visit copies what it wants and takes the request's
 * reference by setting it to NULL. Others are renamed to NAME.corrupt with a warning; half-written
 * files and pictures without a document are removed. */
MUST_CHECK bool tradeoff_store_load(struct tradeoff_store *store,
                                    void (*visit)(void *context, struct tradeoff *tradeoff),
                                    void *context, struct error *err);

/* Durable when it returns; a crash leaves the old file or the new one. */
MUST_CHECK bool tradeoff_store_save(struct tradeoff_store *store, const struct tradeoff *tradeoff,
                                    struct error *err);
void tradeoff_store_remove(struct tradeoff_store *store, const char *id); /* no-op when absent */

/* Appends the content of a memory file to the pictures; tells where it is. */
MUST_CHECK bool tradeoff_store_add_image(struct tradeoff_store *store, const char *id, int image_fd,
                                         uint64_t *offset, uint64_t *bytes, struct error *err);
/* The pictures for reading; -1 when there are none. */
int tradeoff_store_open_images(struct tradeoff_store *store, const char *id);

#endif
