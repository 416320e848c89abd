/* SPDX-License-Identifier: MIT */
/* The HTTP server: the only home of libmicrohttpd. Routes see exchanges: one request and its one
 * reply.
 *
 * An exchange is opened when its head is in (`open`), run when its body is in (`run`), and closed
 * when its reply is sent or its client gone (`close`). open may reply at once, which refuses the
 * body. run replies, or calls http_wait and lets another thread reply later. These callbacks run on
 * the server's threads and never block. */
#ifndef VITRAIL_SERVER_HTTP_HTTP_H
#define VITRAIL_SERVER_HTTP_HTTP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

#include "protocol/error.h"
#include "server/base/config.h"
#include "server/base/log.h"

enum http_method {
    HTTP_GET,
    HTTP_HEAD,
    HTTP_POST,
    HTTP_PUT,
    HTTP_PATCH,
    HTTP_DELETE,
    HTTP_OPTIONS,
    HTTP_OTHER,
    HTTP_METHOD_COUNT
};
const char *http_method_name(enum http_method method); /* "OTHER" for the last */

struct http_exchange;

struct http_service {
    void *context;
    void (*open)(void *context, struct http_exchange *exchange);
    void (*run)(void *context, struct http_exchange *exchange);
    void (*close)(void *context, struct http_exchange *exchange);
};

struct http_server;

struct http_server_desc {
    const struct config *config; /* required, borrowed */
    const struct log *log;       /* required, borrowed */
    struct http_service service; /* required */
};

/* Binds and listens. ERROR_IO names the address that could not be bound. */
struct http_server *http_server_create(const struct http_server_desc *desc, struct error *err);

/* From here on callbacks are called, so all that they use must exist. */
MUST_CHECK bool http_server_start(struct http_server *server, struct error *err);
int http_server_port(const struct http_server *server);

/* Stopping, in this order: from quiesce on new connections are closed at once, and those that stand
 * are still served; then the owner completes every waiting exchange, and from there on lets none
 * wait; wait_idle lets replies leave, until the deadline; destroy ends the rest, until when
 * callbacks come. Destroy accepts NULL. */
void http_server_quiesce(struct http_server *server);
/* True: no exchange is open. */
bool http_server_wait_idle(struct http_server *server, int timeout_ms);
void http_server_destroy(struct http_server *server);

struct http_server_totals {
    uint64_t connections, requests_in_flight;
};
struct http_server_totals http_server_get_totals(struct http_server *server);

/* ---- the request; texts live as long as the exchange ---- */
enum http_method http_request_method(const struct http_exchange *exchange);
/* The method as the client wrote it, at most 23 characters of printable ASCII; for people. */
const char *http_request_method_name(const struct http_exchange *exchange);
/* The path, percent-decoded, without the query. */
const char *http_request_path(const struct http_exchange *exchange);
/* A member of the query, or a header; NULL when absent. */
const char *http_request_query(const struct http_exchange *exchange, const char *name);
const char *http_request_header(const struct http_exchange *exchange, const char *name);
/* The query has no members but these (NULL-terminated, at most 63), each once and with a value;
 * ERROR_INVALID_REQUEST names what is wrong. */
MUST_CHECK bool http_request_check_query(const struct http_exchange *exchange,
                                         const char *const *known, struct error *err);
enum { HTTP_ADDRESS_BYTES = 46 };
void http_request_address(const struct http_exchange *exchange,
                          char address[HTTP_ADDRESS_BYTES]); /* "" when it is not known */
/* Whether a page of a listed origin (allow-origin) asks. */
bool http_request_is_shared(const struct http_exchange *exchange);
const char *http_request_id(const struct http_exchange *exchange);

/* Whatever the routes attach; freed by them in close. */
void http_exchange_set_data(struct http_exchange *exchange, void *data);
void *http_exchange_data(const struct http_exchange *exchange);

/* To be called in open by a route that takes a body: write gets it piece by piece and returns
 * false, with err set, to refuse the rest. Over max_bytes the body is refused with ERROR_TOO_LARGE.
 * Without this call a body is ignored. */
struct http_body_sink {
    void *context;
    bool (*write)(void *context, const void *bytes, size_t size_bytes, struct error *err);
    uint64_t max_bytes;
};
void http_request_take_body(struct http_exchange *exchange, const struct http_body_sink *sink);

/* ---- the reply; exactly one per exchange, the first wins ---- */

/* Adds a field before the reply. The thread that an exchange waits for may add fields, too. */
void http_reply_header(struct http_exchange *exchange, const char *name, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
void http_reply_bytes(struct http_exchange *exchange, int status, const char *media_type,
                      const void *bytes, size_t size_bytes); /* copies */
void http_reply_fd(struct http_exchange *exchange, int status, const char *media_type, int fd,
                   uint64_t size_bytes); /* takes the descriptor */
/* Likewise, with the ranges of RFC 9110 14: 206 for one range of bytes, 416 for one that is
 * outside, 200 for all else. tag: the strong entity tag, with its quotes, which is sent, and which
 * If-Range is compared with. */
void http_reply_file(struct http_exchange *exchange, const char *media_type, const char *tag,
                     int fd, uint64_t size_bytes);
void http_reply_empty(struct http_exchange *exchange, int status);
/* Replies with application/problem+json. */
void http_reply_error(struct http_exchange *exchange, const struct error *problem);

/* In run only, before the exchange is shown to another thread: from here on the exchange belongs to
 * that thread until it calls http_resume, after the reply. on_gone: see http_watch_wait. */
void http_wait(struct http_exchange *exchange, void (*on_gone)(void *context, uint64_t ticket),
               void *context, uint64_t ticket);
void http_resume(struct http_exchange *exchange);

/* A reply without an end (200). read fills at most `capacity` bytes and answers how many, 0 when
 * there is nothing to say now (it is asked again after http_stream_wake), -1 at the end; it runs on
 * the server's threads and never blocks. A client that takes nothing for the watch's patience, or
 * leaves, ends the exchange. Until then, that is until the exchange is closed, any thread may wake
 * the stream. NULL for want of memory, with a reply that says so. */
struct http_stream;
struct http_source {
    void *context;
    ssize_t (*read)(void *context, char *bytes, size_t capacity);
};
struct http_stream *http_reply_stream(struct http_exchange *exchange, const char *media_type,
                                      const struct http_source *source);
void http_stream_wake(struct http_stream *stream);

/* Leaves HTTP (101). take is called once the reply was sent, on a server's thread: from then on
 * the socket (non-blocking) is the taker's until http_upgrade_end, and the exchange stays open.
 * extra: bytes that the client has sent already. */
struct http_upgrade;
struct http_taker {
    void *context;
    void (*take)(void *context, int socket, const char *extra, size_t extra_bytes,
                 struct http_upgrade *upgrade);
};
void http_reply_upgrade(struct http_exchange *exchange, const char *protocol,
                        const struct http_taker *taker);
void http_upgrade_end(struct http_upgrade *upgrade); /* from any thread, once */

/* For close and for access logs. */
int http_reply_status(const struct http_exchange *exchange); /* 0 when the client left before */
double http_exchange_seconds(const struct http_exchange *exchange);

#endif
