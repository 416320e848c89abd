/* SPDX-License-Identifier: MIT */
/* Linked programs as a driver gives them, kept in files from one start to the next: one file for
 * each program and driver, written whole or not at all, the least recently used first out. A file
 * that is damaged, cut short or of something else is no program, and is removed. No GL. Thread:
 * one. */
#ifndef VITRAIL_RENDERER_GL_PROGRAM_STORE_H
#define VITRAIL_RENDERER_GL_PROGRAM_STORE_H

#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"
#include "renderer/base/content_key.h"

enum { PROGRAM_BINARY_BYTES_MAX = 32 << 20 }; /* of one program */

struct program_store;

struct program_store_desc {
    const char *folder; /* required; made where it is absent, for its owner alone. Files of others
                           in it are left alone, but for the room that they take */
    const char *driver; /* required; names all that a binary depends on but its source */
    uint64_t budget_bytes; /* of all files, of this driver and others */
};

/* NULL with ERROR_IO when the folder cannot be used. */
struct program_store *program_store_open(const struct program_store_desc *desc, struct error *err);
void program_store_close(struct program_store *store); /* accepts NULL */

struct program_binary {
    uint32_t format; /* the driver's name for it */
    void *bytes;     /* owned */
    size_t size_bytes;
};
void program_binary_finish(struct program_binary *binary);

/* source: the key of what the program was composed of. */
bool program_store_has(const struct program_store *store, struct content_key source);
/* False: there is none. Else the file is set aside until program_store_confirm puts it back, or
 * program_store_drop removes it: one that ends the process is not tried again. */
MUST_CHECK bool program_store_read(struct program_store *store, struct content_key source,
                                   struct program_binary *binary);
void program_store_confirm(struct program_store *store, struct content_key source);
/* Stores a program. If that fails, the program is compiled again next time. */
void program_store_write(struct program_store *store, struct content_key source,
                         const struct program_binary *binary);
void program_store_drop(struct program_store *store, struct content_key source);

struct program_store_totals {
    uint64_t files, bytes;     /* there now */
    uint64_t confirmed;        /* since it was opened: read, and taken by the driver */
    uint64_t refused, dropped; /* damaged; read, but not taken */
    uint64_t written, evicted;
};
void program_store_get_totals(const struct program_store *store,
                              struct program_store_totals *totals);

#endif
