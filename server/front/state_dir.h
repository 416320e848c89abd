/* SPDX-License-Identifier: MIT */
/* The state directory: its lock, and files in the making. Thread: any.
 *
 * STATE/lock          held while a daemon uses the directory
 * STATE/scenes/       server/front/resource_store.h
 * STATE/environments/ likewise
 * STATE/tmp/          uploads and drafts; emptied at start
 * STATE/cache/        shaders that the worker's driver has compiled
 * Nothing is ever written elsewhere. */
#ifndef VITRAIL_SERVER_FRONT_STATE_DIR_H
#define VITRAIL_SERVER_FRONT_STATE_DIR_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

#include "protocol/error.h"

struct state_dir;

/* Creates the directories (mode 0700), takes the lock and empties tmp. ERROR_CONFLICT where another
 * daemon has the lock, ERROR_IO. */
struct state_dir *state_dir_create(const char *path, struct error *err);
void state_dir_destroy(struct state_dir *state); /* accepts NULL; files stay */

/* Opens a directory of it, made where there is none; -1 on failure. The caller closes it. */
MUST_CHECK int state_dir_open(struct state_dir *state, const char *name, struct error *err);

/* STATE/tmp, borrowed. */
int state_dir_tmp_fd(const struct state_dir *state);
/* A name that nothing in STATE/tmp has: "PREFIX-NUMBER". */
void state_dir_make_name(struct state_dir *state, const char *prefix, char *name,
                         size_t size_bytes);
/* An unnamed file in STATE/tmp, open for reading and writing; -1 on failure. */
MUST_CHECK int state_dir_open_spool(struct state_dir *state, struct error *err);
/* Writes a new file in STATE/tmp, which is on the disk when this returns. what: "the outline of a
 * scene"; json NULL: for want of memory. */
MUST_CHECK bool state_dir_write_json(struct state_dir *state, const char *path, const char *what,
                                     const json_t *json, struct error *err);

/* Calls visit for every entry but "." and ".."; entries may be removed meanwhile. */
MUST_CHECK bool state_dir_for_each(int fd, void (*visit)(void *context, const char *name),
                                   void *context, struct error *err);
/* Removes a directory of files, or a file. */
void state_dir_remove(int parent_fd, const char *name);

#endif
