/* SPDX-License-Identifier: MIT */
/* The structures that the files of the HTTP server share. Only http*.c include it. */
#ifndef VITRAIL_SERVER_HTTP_HTTP_INTERNAL_H
#define VITRAIL_SERVER_HTTP_HTTP_INTERNAL_H

#include <microhttpd.h>
#include <pthread.h>
#include <stdatomic.h>
#include <time.h>

#include "server/http/http.h"
#include "server/http/http_rules.h"
#include "server/http/http_watch.h"

enum { REQUEST_ID_BYTES = 65, HEADER_BYTES = 1024 };

struct http_server {
    const struct config *config;
    const struct log *log;
    struct http_service service;
    struct http_policy policy;
    struct MHD_Daemon *daemon;
    struct http_watch *watch;
    int listen_fd; /* the library's, once it has started */
    int port;
    atomic_bool is_quiesced;
    atomic_uint_least64_t connections, in_flight, waiting, next_request;
    uint64_t request_salt;
    pthread_mutex_t streams_mutex; /* guards the list and each stream's flags */
    struct http_stream *streams;
    uint64_t next_stream;
};

enum exchange_state {
    EXCHANGE_OPENED,  /* head is in */
    EXCHANGE_BODY,    /* body goes to the sink */
    EXCHANGE_SWALLOW, /* body is ignored */
    EXCHANGE_WAITING, /* suspended; another thread owns the exchange */
    EXCHANGE_SENDING, /* the reply is libmicrohttpd's */
};

struct header {
    char name[48];
    char value[HEADER_BYTES];
};

struct http_exchange {
    struct http_server *server;
    struct MHD_Connection *connection;
    struct http_watched *watched;
    enum http_method method;
    char method_name[24]; /* as the client wrote it, cut to fit; printable ASCII */
    char *path;
    char id[REQUEST_ID_BYTES];
    uint64_t announced_bytes, body_bytes;
    struct http_body_sink sink;
    bool has_sink, must_close;
    char *origin; /* of a page that may read the reply; owned, NULL: none */
    struct error body_error;
    enum exchange_state state;
    void *data;
    struct header *headers; /* HEADERS_MAX of them, on demand */
    size_t header_count;
    struct MHD_Response *response;
    struct http_stream *stream;   /* of a reply without an end; owned */
    struct http_upgrade *upgrade; /* to another protocol; owned */
    uint64_t reply_bytes;
    int status;
    struct timespec started;
};

/* Takes the response of an exchange that has none yet, and adds the common fields. NULL, for want
 * of memory: the connection ends without a reply. */
void http_set_response(struct http_exchange *exchange, int status, const char *media_type,
                       struct MHD_Response *response, uint64_t size_bytes);

/* The exchange is over: its stream is read no more, its other protocol spoken no more. Both accept
 * an exchange without one. */
void http_stream_finish(struct http_exchange *exchange);
void http_upgrade_finish(struct http_exchange *exchange);

#endif
