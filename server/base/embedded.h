/* SPDX-License-Identifier: MIT */
/* Files that cmake/embed_text.cmake and cmake/embed_files.cmake embed in the program. */
#ifndef VITRAIL_SERVER_BASE_EMBEDDED_H
#define VITRAIL_SERVER_BASE_EMBEDDED_H

#include <stddef.h>

extern const unsigned char embedded_openapi_json[];
extern const size_t embedded_openapi_json_bytes;

struct embedded_file {
    const char *name; /* relative to clients/viewer; NULL ends the table */
    const char *bytes;
    size_t size_bytes;
    char digest[65]; /* SHA-256 of the bytes, in hexadecimal */
};
extern const struct embedded_file embedded_viewer[];

#endif
