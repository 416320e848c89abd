/* SPDX-License-Identifier: MIT */
/* UTF-8 in fixed buffers: texts from anywhere are made safe to put into JSON. Thread: any. */
#ifndef VITRAIL_PROTOCOL_UTF8_H
#define VITRAIL_PROTOCOL_UTF8_H

#include <stdbool.h>
#include <stddef.h>

/* Bytes of the well-formed sequence at text (Unicode 15, table 3-7); 0 at the NUL or when it is
 * malformed. */
size_t utf8_sequence_bytes(const char *text);

/* Length of the longest prefix of at most max_bytes that cuts no sequence in two. */
size_t utf8_prefix_bytes(const char *text, size_t max_bytes);

/* In place: control characters and malformed bytes become '?'. was_cut: the text was truncated, so
 * that an unfinished sequence at its end is dropped instead. */
void utf8_sanitize(char *text, bool was_cut);

/* Copies into a buffer of size_bytes > 0, cut at a sequence boundary, sanitized, NUL-terminated. */
void utf8_copy(char *buffer, size_t size_bytes, const char *text);

#endif
