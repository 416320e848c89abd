/* SPDX-License-Identifier: MIT */
/* Puts a scene blob together: sections that grow, then one block. Thread: any, one writer on one
 * thread. */
#ifndef VITRAIL_RENDERER_SCENE_BLOB_WRITER_H
#define VITRAIL_RENDERER_SCENE_BLOB_WRITER_H

#include <stddef.h>

#include "protocol/error.h"
#include "renderer/scene/scene_blob.h"

struct blob_section {
    void *records;
    uint64_t count, capacity;
};

/* Needs blob_writer_init. The import files read the fields; only blob_writer.c writes them. */
struct blob_writer {
    struct blob_section sections[SCENE_SECTION_COUNT];
    uint64_t size_bytes; /* of all records so far */
    uint64_t max_bytes;
};

MUST_CHECK bool blob_writer_init(struct blob_writer *writer, uint64_t max_bytes, struct error *err);
void blob_writer_finish(struct blob_writer *writer); /* accepts zeroed */

size_t blob_record_bytes(enum scene_section section);

/* Appends zeroed records and returns the first; NULL on failure (ERROR_TOO_LARGE above max_bytes).
 * The pointer is valid until the next append to the same section. */
void *blob_writer_append(struct blob_writer *writer, enum scene_section section, uint64_t count,
                         struct error *err);

/* Appends text to SCENE_STRINGS; *offset is 0 for "". */
MUST_CHECK bool blob_writer_add_text(struct blob_writer *writer, const char *text, uint32_t *offset,
                                     struct error *err);

/* Appends text and its offset to a section of string offsets. */
MUST_CHECK bool blob_writer_add_line(struct blob_writer *writer, enum scene_section section,
                                     const char *text, struct error *err);

/* Room in SCENE_PIXELS, whose bytes are not kept here: *offset is from the start of the section. */
MUST_CHECK bool blob_writer_reserve_pixels(struct blob_writer *writer, uint64_t size_bytes,
                                           uint64_t *offset, struct error *err);

/* Copies header and sections into *blob (malloc'ed, caller frees), emptying the writer as it goes;
 * the pixels, which come last, are zero. only_head: without memory for them; *size_bytes is then
 * smaller than the header's. */
MUST_CHECK bool blob_writer_write(struct blob_writer *writer, const struct scene_header *header,
                                  bool only_head, void **blob, size_t *size_bytes,
                                  struct error *err);

#endif
