/* SPDX-License-Identifier: MIT */
/* Finds where the fields of a head lie in the buffer that was received. */
#include "server/http/http_lines.h"

#include <string.h>

enum { CRLF_BYTES = 2 };

bool http_lines_can_judge(const char *library_version)
{
    return strncmp(library_version, "0.9.", 4) == 0;
}

void http_lines_init(struct http_lines *lines, const char *version)
{
    *lines = (struct http_lines){.next = version + strlen(version) + CRLF_BYTES};
}

void http_lines_add(struct http_lines *lines, const char *name, const char *value)
{
    if (name != lines->next || value <= name + strlen(name))
        lines->is_broken = true;
    if (!lines->is_broken)
        lines->next = value + strlen(value) + CRLF_BYTES;
}

bool http_lines_are_plain(const struct http_lines *lines, const char *method, size_t size_bytes)
{
    return !lines->is_broken && lines->next + CRLF_BYTES == method + size_bytes;
}
