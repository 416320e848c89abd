/* SPDX-License-Identifier: MIT */
/* Files that are part of the program; made by cmake/embed_text.cmake. */
#ifndef VITRAIL_SERVER_EMBEDDED_H
#define VITRAIL_SERVER_EMBEDDED_H

#include <stddef.h>

extern const unsigned char embedded_openapi_json[];
extern const size_t embedded_openapi_json_bytes;

#endif
