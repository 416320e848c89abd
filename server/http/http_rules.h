/* SPDX-License-Identifier: MIT */
/* Checks a request's head before any route sees it: the framing must read the same way for every
 * proxy, the Host must be ours, and no foreign page may have sent it. Thread: any; no state. */
#ifndef VITRAIL_SERVER_HTTP_HTTP_RULES_H
#define VITRAIL_SERVER_HTTP_HTTP_RULES_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol/error.h"

/* Collected from the header fields; texts are borrowed from the request, NULL where absent. */
struct http_head {
    int host_count, length_count, encoding_count, field_count;
    const char *host, *length, *encoding, *origin, *fetch_site;
    bool has_odd_line;  /* one that ends in a bare line feed, continues a field, or holds a zero */
    bool has_bad_name;  /* one that is no token of RFC 9110 */
    bool has_bad_field; /* a control character in a value */
    bool has_coded_body;
    bool is_http_1_0;
    bool is_change; /* the method changes state: POST, PUT, PATCH, DELETE; or the protocol changes,
                       to one in which pages may change state */
};

void http_head_add(struct http_head *head, const char *name, const char *value);

struct http_policy {
    bool is_loopback; /* Host must be localhost, a loopback address, or one of: */
    const char *listen_host;
    const char *allow_host;   /* comma-separated */
    const char *allow_origin; /* comma-separated origins whose pages may do all that ours may */
};

/* ERROR_INVALID_REQUEST names the broken rule; the connection must be closed after the reply. */
MUST_CHECK bool http_head_check(const struct http_head *head, const struct http_policy *policy,
                                struct error *err);

/* Whether the request comes from a page of an origin that the policy lists, so that its replies may
 * be read there. */
bool http_head_is_shared(const struct http_head *head, const struct http_policy *policy);

/* Bytes of the body: 0 without one, UINT64_MAX when chunked. Call after a successful check. */
uint64_t http_head_body_bytes(const struct http_head *head);

#endif
