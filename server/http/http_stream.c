/* SPDX-License-Identifier: MIT */
/* Replies without an end, which sleep while there is nothing to say, and connections that leave
 * HTTP for another protocol. */
#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdlib.h>
#include <sys/socket.h>

#include "server/http/http_internal.h"

enum {
    BLOCK_BYTES = 32 << 10,
    SEND_BUFFER_BYTES = 128 << 10, /* more would hold frames that are old when they arrive */
};

struct http_stream {
    struct http_stream *previous, *next; /* of the server's list */
    struct http_exchange *exchange;
    struct http_source source;
    uint64_t id;
    bool is_asleep, has_news, is_gone; /* under the server's streams_mutex */
};

/* ---- streams ---- */

/* Under the mutex. */
static void wake_stream(struct http_stream *stream)
{
    stream->has_news = true;
    if (!stream->is_asleep)
        return;
    stream->is_asleep = false;
    MHD_resume_connection(stream->exchange->connection);
}

/* On the watch's thread, perhaps after the stream is gone. */
static void client_left(void *context, uint64_t id)
{
    struct http_server *server = context;
    pthread_mutex_lock(&server->streams_mutex);
    for (struct http_stream *stream = server->streams; stream; stream = stream->next)
        if (stream->id == id) {
            stream->is_gone = true;
            wake_stream(stream);
        }
    pthread_mutex_unlock(&server->streams_mutex);
}

/* Sleeps unless there is news. Suspends before anybody can resume. */
static bool fall_asleep(struct http_stream *stream)
{
    struct http_server *server = stream->exchange->server;
    pthread_mutex_lock(&server->streams_mutex);
    bool must_sleep = !stream->has_news && !stream->is_gone;
    if (must_sleep) {
        http_watch_wait(server->watch, stream->exchange->watched, client_left, server, stream->id);
        stream->is_asleep = true;
        MHD_suspend_connection(stream->exchange->connection);
    }
    pthread_mutex_unlock(&server->streams_mutex);
    return must_sleep;
}

static ssize_t read_block(void *context, uint64_t position, char *bytes, size_t capacity)
{
    (void)position;
    struct http_stream *stream = context;
    struct http_server *server = stream->exchange->server;
    for (;;) {
        pthread_mutex_lock(&server->streams_mutex);
        bool is_gone = stream->is_gone;
        stream->has_news = false;
        pthread_mutex_unlock(&server->streams_mutex);
        if (is_gone)
            return MHD_CONTENT_READER_END_WITH_ERROR;
        ssize_t count = stream->source.read(stream->source.context, bytes, capacity);
        if (count < 0)
            return MHD_CONTENT_READER_END_OF_STREAM;
        if (count > 0) { /* and it must leave within the watch's patience */
            http_watch_expect_reply(server->watch, stream->exchange->watched, 0);
            return count;
        }
        if (fall_asleep(stream))
            return 0;
    }
}

static void set_option(struct http_exchange *exchange, int level, int name, int value)
{
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(exchange->connection, MHD_CONNECTION_INFO_CONNECTION_FD);
    if (info) /* a kernel that refuses costs freshness only */
        (void)setsockopt(info->connect_fd, level, name, &value, sizeof value);
}

struct http_stream *http_reply_stream(struct http_exchange *exchange, const char *media_type,
                                      const struct http_source *source)
{
    struct http_server *server = exchange->server;
    struct http_stream *stream = calloc(1, sizeof *stream);
    if (!stream) {
        http_reply_error(exchange, &(struct error){ERROR_NO_MEMORY, "stream", ""});
        return NULL;
    }
    *stream = (struct http_stream){.exchange = exchange, .source = *source};
    set_option(exchange, SOL_SOCKET, SO_SNDBUF, SEND_BUFFER_BYTES);
    pthread_mutex_lock(&server->streams_mutex);
    stream->id = ++server->next_stream;
    stream->next = server->streams;
    if (stream->next)
        stream->next->previous = stream;
    server->streams = stream;
    pthread_mutex_unlock(&server->streams_mutex);
    exchange->stream = stream;
    http_set_response(
        exchange, 200, media_type,
        MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, BLOCK_BYTES, read_block, stream, NULL),
        0);
    return stream;
}

void http_stream_wake(struct http_stream *stream)
{
    struct http_server *server = stream->exchange->server;
    pthread_mutex_lock(&server->streams_mutex);
    wake_stream(stream);
    pthread_mutex_unlock(&server->streams_mutex);
}

void http_stream_finish(struct http_exchange *exchange)
{
    struct http_stream *stream = exchange->stream;
    struct http_server *server = exchange->server;
    if (!stream)
        return;
    pthread_mutex_lock(&server->streams_mutex);
    if (stream->previous)
        stream->previous->next = stream->next;
    else
        server->streams = stream->next;
    if (stream->next)
        stream->next->previous = stream->previous;
    pthread_mutex_unlock(&server->streams_mutex);
    exchange->stream = NULL;
    free(stream);
}

/* ---- other protocols ---- */

struct http_upgrade {
    struct http_exchange *exchange;
    struct http_taker taker;
    struct MHD_UpgradeResponseHandle *handle;
};

static void taken(void *context, struct MHD_Connection *connection, void *state, const char *extra,
                  size_t extra_bytes, MHD_socket socket, struct MHD_UpgradeResponseHandle *handle)
{
    (void)connection, (void)state;
    struct http_upgrade *upgrade = context;
    struct http_exchange *exchange = upgrade->exchange;
    /* Now, because the library has used it for its reply. Without it what is said after a frame
     * waits until the client's delayed acknowledgement of that, 40 ms. */
    set_option(exchange, IPPROTO_TCP, TCP_NODELAY, 1);
    upgrade->handle = handle;
    http_watch_wait(exchange->server->watch, exchange->watched, NULL, NULL, 0);
    upgrade->taker.take(upgrade->taker.context, socket, extra, extra_bytes, upgrade);
}

void http_reply_upgrade(struct http_exchange *exchange, const char *protocol,
                        const struct http_taker *taker)
{
    struct http_upgrade *upgrade = calloc(1, sizeof *upgrade);
    struct MHD_Response *response =
        upgrade ? MHD_create_response_for_upgrade(taken, upgrade) : NULL;
    if (!response) {
        free(upgrade);
        http_reply_error(exchange, &(struct error){ERROR_NO_MEMORY, "connection", ""});
        return;
    }
    *upgrade = (struct http_upgrade){.exchange = exchange, .taker = *taker};
    exchange->upgrade = upgrade;
    set_option(exchange, SOL_SOCKET, SO_SNDBUF, SEND_BUFFER_BYTES);
    http_reply_header(exchange, "Upgrade", "%s", protocol);
    http_set_response(exchange, MHD_HTTP_SWITCHING_PROTOCOLS, NULL, response, 0);
}

void http_upgrade_end(struct http_upgrade *upgrade)
{
    MHD_upgrade_action(upgrade->handle, MHD_UPGRADE_ACTION_CLOSE);
}

void http_upgrade_finish(struct http_exchange *exchange)
{
    free(exchange->upgrade);
    exchange->upgrade = NULL;
}

/* ---- who asks ---- */

void http_request_address(const struct http_exchange *exchange, char address[HTTP_ADDRESS_BYTES])
{
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(exchange->connection, MHD_CONNECTION_INFO_CLIENT_ADDRESS);
    const struct sockaddr *from = info ? info->client_addr : NULL;
    address[0] = '\0';
    if (from && from->sa_family == AF_INET)
        inet_ntop(AF_INET, &((const struct sockaddr_in *)(const void *)from)->sin_addr, address,
                  HTTP_ADDRESS_BYTES);
    else if (from && from->sa_family == AF_INET6)
        inet_ntop(AF_INET6, &((const struct sockaddr_in6 *)(const void *)from)->sin6_addr, address,
                  HTTP_ADDRESS_BYTES);
}
