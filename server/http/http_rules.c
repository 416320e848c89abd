/* SPDX-License-Identifier: MIT */
/* Rules for heads of requests. libmicrohttpd 0.9.75 takes the first of two Content-Length fields
 * and lets Transfer-Encoding win over it, which is how requests are smuggled past a proxy; here
 * both are refused. */
#include "server/http/http_rules.h"

#include <arpa/inet.h>
#include <ctype.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* RFC 9110, section 5.6.2. The library takes "Content-Length :", " Name" and an empty name for
 * fields of their own; a proxy before us may take the first for a length. */
static bool is_token(const char *name)
{
    static const char marks[] = "!#$%&'*+-.^_`|~";
    for (const char *at = name; *at; at++)
        if (!isalnum((unsigned char)*at) && !strchr(marks, *at))
            return false;
    return name[0] != '\0';
}

void http_head_add(struct http_head *head, const char *name, const char *value)
{
    const char *text = value ? value : "";
    head->field_count++;
    head->has_bad_name |= !is_token(name);
    for (const char *at = text; *at; at++)
        if (((unsigned char)*at < 0x20 && *at != '\t') || *at == 0x7f)
            head->has_bad_field = true;
    if (strcasecmp(name, "Host") == 0) {
        head->host_count++;
        head->host = text;
    } else if (strcasecmp(name, "Content-Length") == 0) {
        head->length_count++;
        head->length = text;
    } else if (strcasecmp(name, "Transfer-Encoding") == 0) {
        head->encoding_count++;
        head->encoding = text;
    } else if (strcasecmp(name, "Content-Encoding") == 0) {
        head->has_coded_body |= *text && strcasecmp(text, "identity") != 0;
    } else if (strcasecmp(name, "Upgrade") == 0) {
        head->is_change = true;
    } else if (strcasecmp(name, "Origin") == 0) {
        head->origin = text;
    } else if (strcasecmp(name, "Sec-Fetch-Site") == 0) {
        head->fetch_site = text;
    }
}

static bool check_framing(const struct http_head *head, struct error *err)
{
    if (head->has_odd_line)
        return error_set(err, ERROR_INVALID_REQUEST,
                         "a line of the head does not end in CRLF, continues the one before it, "
                         "has no name, or holds a zero byte");
    if (head->has_bad_name)
        return error_set(err, ERROR_INVALID_REQUEST,
                         "the name of a header field is empty, or holds a blank or another "
                         "character that names have not");
    if (head->has_bad_field)
        return error_set(err, ERROR_INVALID_REQUEST, "a header field holds control characters");
    if (head->host_count > 1)
        return error_set(err, ERROR_INVALID_REQUEST, "the request has %d Host headers",
                         head->host_count);
    if (head->host_count == 0 && !head->is_http_1_0)
        return error_set(err, ERROR_INVALID_REQUEST, "the request has no Host header");
    if (head->length_count > 1)
        return error_set(err, ERROR_INVALID_REQUEST, "the request has %d Content-Length headers",
                         head->length_count);
    if (head->encoding_count > 1)
        return error_set(err, ERROR_INVALID_REQUEST, "the request has %d Transfer-Encoding headers",
                         head->encoding_count);
    if (head->length_count && head->encoding_count)
        return error_set(err, ERROR_INVALID_REQUEST,
                         "the request has both Content-Length and Transfer-Encoding");
    if (head->encoding && (head->is_http_1_0 || strcasecmp(head->encoding, "chunked") != 0))
        return error_set(err, ERROR_INVALID_REQUEST,
                         "Transfer-Encoding '%.40s' is not understood, only chunked",
                         head->encoding);
    if (head->has_coded_body)
        return error_set(err, ERROR_UNSUPPORTED_MEDIA_TYPE,
                         "bodies are taken as they are, without any Content-Encoding");
    size_t digits = head->length ? strspn(head->length, "0123456789") : 1;
    if (digits == 0 || digits > 18 || (head->length && head->length[digits]))
        return error_set(err, ERROR_INVALID_REQUEST, "Content-Length '%.40s' is not a length",
                         head->length);
    return true;
}

/* The name in HOST, HOST:PORT or [HOST]:PORT, without a trailing dot. False when it is none of
 * these. */
static bool split_host(const char *host, char *name, size_t capacity)
{
    bool is_bracketed = host[0] == '[';
    const char *from = host + is_bracketed;
    size_t length = is_bracketed ? strcspn(from, "]") : strcspn(from, ":");
    const char *rest = from + length;
    if (is_bracketed && *rest++ != ']')
        return false;
    if (*rest == ':')
        rest += 1 + strspn(rest + 1, "0123456789");
    if (*rest || length == 0 || length >= capacity)
        return false;
    memcpy(name, from, length);
    name[length] = '\0';
    if (name[length - 1] == '.')
        name[length - 1] = '\0';
    return true;
}

static bool is_loopback_name(const char *name)
{
    if (strcasecmp(name, "localhost") == 0 || strcmp(name, "::1") == 0)
        return true;
    struct in_addr address;
    return inet_pton(AF_INET, name, &address) == 1 && ntohl(address.s_addr) >> 24 == 127;
}

static bool is_listed(const char *name, const char *list)
{
    size_t length = strlen(name);
    for (const char *at = list; at && *at;) {
        at += strspn(at, ", \t");
        size_t entry = strcspn(at, ", \t");
        if (entry == length && length > 0 && strncasecmp(at, name, length) == 0)
            return true;
        at += entry;
    }
    return false;
}

/* A page on another site that was rebound to our address sends its own name in Host. */
static bool check_host(const struct http_head *head, const struct http_policy *policy,
                       struct error *err)
{
    char name[256];
    if (!head->host)
        return true;
    if (!split_host(head->host, name, sizeof name))
        return error_set(err, ERROR_INVALID_REQUEST, "Host '%.80s' is not a host", head->host);
    if (!policy->is_loopback || is_loopback_name(name) ||
        strcasecmp(name, policy->listen_host) == 0 || is_listed(name, policy->allow_host))
        return true;
    return error_set(err, ERROR_INVALID_REQUEST,
                     "Host '%.80s' is not a name of this server, which listens on loopback "
                     "(allow-host adds names)",
                     head->host);
}

bool http_head_is_shared(const struct http_head *head, const struct http_policy *policy)
{
    return head->origin && is_listed(head->origin, policy->allow_origin);
}

/* Forms and simple fetches of foreign pages need no preflight, so they are recognised by what
 * browsers always send. */
static bool check_origin(const struct http_head *head, const struct http_policy *policy,
                         struct error *err)
{
    if (!head->is_change || http_head_is_shared(head, policy))
        return true;
    if (head->fetch_site && strcasecmp(head->fetch_site, "cross-site") == 0)
        return error_set(err, ERROR_INVALID_REQUEST,
                         "a page of another site may not change anything here");
    if (!head->origin || !head->host)
        return true;
    const char *authority = strstr(head->origin, "://");
    if (authority && strcasecmp(authority + 3, head->host) == 0)
        return true;
    return error_set(err, ERROR_INVALID_REQUEST,
                     "a page of '%.80s' may not change anything here "
                     "(allow-origin adds origins)",
                     head->origin);
}

bool http_head_check(const struct http_head *head, const struct http_policy *policy,
                     struct error *err)
{
    return check_framing(head, err) && check_host(head, policy, err) &&
           check_origin(head, policy, err);
}

uint64_t http_head_body_bytes(const struct http_head *head)
{
    if (head->encoding)
        return UINT64_MAX;
    return head->length ? strtoull(head->length, NULL, 10) : 0;
}
