/* SPDX-License-Identifier: MIT */
/* Whether the lines of a head are those that a proxy before us reads. libmicrohttpd before 1.0 ends
 * a line at a bare line feed, too, cuts a value at a zero byte, takes a field without a name for
 * the end of the head, and appends a continuation line to the name of the field above it (before
 * 0.9.77). None of it can be seen in the fields that it gives. But it replaces line ends by zeros
 * where the head lies in its buffer, and gives pointers into that: each field must begin two bytes
 * behind the one before.
 * Thread: any. */
#ifndef VITRAIL_SERVER_HTTP_HTTP_LINES_H
#define VITRAIL_SERVER_HTTP_HTTP_LINES_H

#include <stdbool.h>
#include <stddef.h>

struct http_lines {
    const char *next; /* where the next line begins, if all is well; borrowed, never read */
    bool is_broken;
};

/* Whether the library of this version leaves heads as they came. */
bool http_lines_can_judge(const char *library_version);

/* version: the last word of the request's line. */
void http_lines_init(struct http_lines *lines, const char *version);

/* Adds a field; to be called in the order of the head. */
void http_lines_add(struct http_lines *lines, const char *name, const char *value);

/* Whether every line ended in CRLF, and held one field and no zero byte; after the last field. The
 * head has size_bytes from `method` on, with the empty line that ends it. */
bool http_lines_are_plain(const struct http_lines *lines, const char *method, size_t size_bytes);

#endif
