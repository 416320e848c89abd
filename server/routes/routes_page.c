/* SPDX-License-Identifier: MIT */
/* The viewer: the page at / and its files under /viewer/, all of them part of the program. */
#include <stdio.h>
#include <string.h>

#include "server/base/embedded.h"
#include "server/routes/router.h"

/* Nothing but our own files runs or loads, and no other page may frame this one. blob: and data:
 * are images that the page makes of replies. */
static const char content_security_policy[] =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'; "
    "require-trusted-types-for 'script'";

struct media_type {
    const char *ending, *type;
};
static const struct media_type media_types[] = {
    {".html", "text/html; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".svg", "image/svg+xml"},
};

static const char *media_type_of(const char *name)
{
    const char *ending = strrchr(name, '.');
    for (size_t i = 0; ending && i < sizeof media_types / sizeof media_types[0]; i++)
        if (strcmp(ending, media_types[i].ending) == 0)
            return media_types[i].type;
    return "application/octet-stream";
}

static void reply_file(struct http_exchange *exchange, const struct embedded_file *file)
{
    char tag[sizeof file->digest + 2];
    snprintf(tag, sizeof tag, "\"%s\"", file->digest);
    http_reply_header(exchange, "Content-Security-Policy", "%s", content_security_policy);
    http_reply_header(exchange, "Referrer-Policy", "no-referrer");
    http_reply_header(exchange, "Cross-Origin-Opener-Policy", "same-origin");
    http_reply_header(exchange, "Cross-Origin-Resource-Policy", "same-origin");
    /* Names do not change with their content: ask each time, which the tag makes cheap. */
    http_reply_header(exchange, "Cache-Control", "no-cache");
    if (!reply_if_unchanged(exchange, tag))
        http_reply_bytes(exchange, 200, media_type_of(file->name), file->bytes, file->size_bytes);
}

static void run_file(struct service *service, struct http_exchange *exchange, const char *id)
{
    (void)service;
    const char *name = id[0] ? id : "index.html";
    for (const struct embedded_file *file = embedded_viewer; file->name; file++)
        if (strcmp(file->name, name) == 0) {
            reply_file(exchange, file);
            return;
        }
    struct error problem = {0};
    error_set(&problem, ERROR_NOT_FOUND, "the viewer has no file '%.100s'", name);
    http_reply_error(exchange, &problem);
}

const struct route routes_page[] = {
    {"/", {{HTTP_GET, NULL, run_file}}},
    {"/viewer/{id}", {{HTTP_GET, NULL, run_file}}},
    {0},
};
