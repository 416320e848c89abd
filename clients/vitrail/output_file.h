/* SPDX-License-Identifier: MIT */
/* A result that appears whole or not at all: written beside its place, synced, then renamed into
 * it. */
#ifndef VITRAIL_CLIENTS_VITRAIL_OUTPUT_FILE_H
#define VITRAIL_CLIENTS_VITRAIL_OUTPUT_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "clients/vitrail/failure.h"

/* Zeroed = closed. "-" is stdout; a device or a pipe is written directly, since a rename would
 * replace it. */
struct output_file {
    FILE *stream;
    char *path;      /* as given; for messages */
    char *place;     /* where the file will be, symbolic links followed; NULL: written directly */
    char *temporary; /* in the folder of `place`; NULL: written directly */
    uint64_t size_bytes;
};

/* Creates the temporary file, so that an unwritable folder is known before any work is done. */
bool output_file_open(struct output_file *file, const char *path, struct failure *failure);

bool output_file_write(struct output_file *file, const void *bytes, size_t size_bytes,
                       struct failure *failure);

/* Syncs and renames; the file is closed afterwards. On failure the place is as it was. */
bool output_file_commit(struct output_file *file, struct failure *failure);

/* Removes the temporary file of one that was not committed, and frees. Accepts zeroed and committed
 * files. */
void output_file_finish(struct output_file *file);

#endif
