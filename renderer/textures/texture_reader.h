/* SPDX-License-Identifier: MIT */
/* Brings pixels of a mapped scene into memory on a thread of its own, so that the GL thread does
 * not wait for the disk. Thread: GL; reading is on the reader's. */
#ifndef VITRAIL_RENDERER_TEXTURES_TEXTURE_READER_H
#define VITRAIL_RENDERER_TEXTURES_TEXTURE_READER_H

#include <stdbool.h>
#include <stddef.h>

#include "protocol/error.h"

struct texture_reader;

/* ERROR_INTERNAL when no thread can be started. */
struct texture_reader *texture_reader_create(struct error *err);
void texture_reader_destroy(struct texture_reader *reader); /* waits for the range being read */

/* Forgets what was asked for, and waits for the range being read; NULL: nothing to do. */
void texture_reader_drain(struct texture_reader *reader);

/* True when the range has been read since it was last asked for; else it is queued, while there is
 * room, and false. The memory must stay mapped until the reader is drained or destroyed. */
bool texture_reader_ask(struct texture_reader *reader, const void *bytes, size_t size_bytes);

#endif
