/* SPDX-License-Identifier: MIT */
/* The Range header (RFC 9110 14.2). Thread: any. */
#ifndef VITRAIL_SERVER_HTTP_HTTP_RANGE_H
#define VITRAIL_SERVER_HTTP_HTTP_RANGE_H

#include <stdint.h>

enum http_range_kind {
    HTTP_RANGE_ALL,     /* no header, one that this server passes over, or several ranges */
    HTTP_RANGE_PART,    /* one range, cut to the file */
    HTTP_RANGE_OUTSIDE, /* nothing of it is in the file */
};
struct http_range {
    uint64_t first, count; /* count is not 0 */
};

/* value: of the header, NULL: absent. Sets range for HTTP_RANGE_PART. */
enum http_range_kind http_range_parse(const char *value, uint64_t size_bytes,
                                      struct http_range *range);

#endif
