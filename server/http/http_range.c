/* SPDX-License-Identifier: MIT */
/* A server may pass over a range that it cannot read or does not want to serve: it sends all. */
#include "server/http/http_range.h"

#include <stdbool.h>
#include <string.h>
#include <strings.h>

/* Reads digits; numbers beyond 2^63 are 2^63, which no file has. False: there are none. */
static bool read_number(const char **at, uint64_t *number)
{
    const char *begin = *at;
    *number = 0;
    for (; **at >= '0' && **at <= '9'; (*at)++)
        *number =
            *number < UINT64_MAX / 20 ? 10 * *number + (uint64_t)(**at - '0') : UINT64_MAX / 2;
    return *at > begin;
}

enum http_range_kind http_range_parse(const char *value, uint64_t size_bytes,
                                      struct http_range *range)
{
    uint64_t first = 0, last = 0;
    if (!value || strncasecmp(value, "bytes=", 6) != 0)
        return HTTP_RANGE_ALL;
    const char *at = value + 6;
    bool has_first = read_number(&at, &first);
    if (*at != '-')
        return HTTP_RANGE_ALL;
    at++;
    bool has_last = read_number(&at, &last);
    if (*at || (!has_first && !has_last) || (has_first && has_last && last < first))
        return HTTP_RANGE_ALL;
    if (!has_first) { /* so many of the last ones */
        first = last < size_bytes ? size_bytes - last : 0;
        has_last = last == 0;
        last = 0;
    }
    if (first >= size_bytes || (has_last && last < first))
        return HTTP_RANGE_OUTSIDE;
    uint64_t end = has_last && last < size_bytes ? last + 1 : size_bytes;
    *range = (struct http_range){.first = first, .count = end - first};
    return HTTP_RANGE_PART;
}
