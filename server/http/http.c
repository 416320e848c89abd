/* SPDX-License-Identifier: MIT */
/* libmicrohttpd: epoll threads, exchanges suspended while others work for them, and its measured
 * traps avoided. */
#include "server/http/http.h"

#include <arpa/inet.h>
#include <assert.h>
#include <ctype.h>
#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <unistd.h>

#include "protocol/problem.h"
#include "protocol/utf8.h"
#include "server/http/http_internal.h"
#include "server/http/http_lines.h"
#include "server/http/http_range.h"

enum {
    THREADS = 2, /* they parse and copy; rendering and decoding happen elsewhere */
    CONNECTION_MEMORY_BYTES = 64 << 10, /* heads are limited to this; bodies come in pieces of it */
    CONNECTION_IDLE_S = 90,             /* our own watch is stricter; this is the net below it */
    BACKLOG = 512,
    /* A refused body up to this is read, so that the client reads the reply. */
    SWALLOW_BYTES = 64 << 20,
    HEADERS_MAX = 16,
};

/* Before 0.9.77 the library's strict reading answers an absent Host itself, twice and without a
 * problem document; http_rules.c judges Host in any case. Later libraries refuse bare line feeds,
 * folded fields and blanks before a colon where they are strict. */
#if MHD_VERSION < 0x00097700
enum { STRICTNESS = 0 };
#else
enum { STRICTNESS = 1 };
#endif

static const char *const method_names[HTTP_METHOD_COUNT] = {"GET",   "HEAD",   "POST",    "PUT",
                                                            "PATCH", "DELETE", "OPTIONS", "OTHER"};

const char *http_method_name(enum http_method method)
{
    return method_names[method];
}

/* ---- the request ---- */

enum http_method http_request_method(const struct http_exchange *exchange)
{
    return exchange->method;
}

const char *http_request_method_name(const struct http_exchange *exchange)
{
    return exchange->method_name;
}

const char *http_request_path(const struct http_exchange *exchange)
{
    return exchange->path;
}

const char *http_request_query(const struct http_exchange *exchange, const char *name)
{
    return MHD_lookup_connection_value(exchange->connection, MHD_GET_ARGUMENT_KIND, name);
}

struct query_check {
    const char *const *known;
    uint64_t seen; /* one bit per known name */
    struct error *err;
};

static enum MHD_Result visit_query(void *context, enum MHD_ValueKind kind, const char *name,
                                   size_t name_bytes, const char *value, size_t value_bytes)
{
    (void)kind, (void)name_bytes;
    struct query_check *check = context;
    size_t i = 0;
    while (check->known[i] && strcmp(check->known[i], name) != 0)
        i++;
    const char *why = !check->known[i]               ? "which is no member of this route's"
                      : check->seen & 1ull << i      ? "for the second time"
                      : !value                       ? "without a value"
                      : strlen(value) != value_bytes ? "with a zero byte in its value"
                                                     : NULL;
    check->seen |= 1ull << i;
    if (!why)
        return MHD_YES;
    error_set(check->err, ERROR_INVALID_REQUEST, "the query has '%.40s', %s", name, why);
    return MHD_NO;
}

bool http_request_check_query(const struct http_exchange *exchange, const char *const *known,
                              struct error *err)
{
    struct query_check check = {.known = known, .err = err};
    MHD_get_connection_values_n(exchange->connection, MHD_GET_ARGUMENT_KIND, visit_query, &check);
    return err->code == ERROR_NONE;
}

const char *http_request_header(const struct http_exchange *exchange, const char *name)
{
    return MHD_lookup_connection_value(exchange->connection, MHD_HEADER_KIND, name);
}

const char *http_request_id(const struct http_exchange *exchange)
{
    return exchange->id;
}

void http_exchange_set_data(struct http_exchange *exchange, void *data)
{
    exchange->data = data;
}

void *http_exchange_data(const struct http_exchange *exchange)
{
    return exchange->data;
}

void http_request_take_body(struct http_exchange *exchange, const struct http_body_sink *sink)
{
    assert(exchange->state == EXCHANGE_OPENED);
    exchange->sink = *sink;
    exchange->has_sink = true;
}

int http_reply_status(const struct http_exchange *exchange)
{
    return exchange->state == EXCHANGE_SENDING ? exchange->status : 0;
}

double http_exchange_seconds(const struct http_exchange *exchange)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)(now.tv_sec - exchange->started.tv_sec) +
           1e-9 * (double)(now.tv_nsec - exchange->started.tv_nsec);
}

/* ---- the reply ---- */

void http_reply_header(struct http_exchange *exchange, const char *name, const char *format, ...)
{
    if (!exchange->headers)
        exchange->headers = calloc(HEADERS_MAX, sizeof *exchange->headers);
    if (!exchange->headers || exchange->header_count == HEADERS_MAX || exchange->response)
        return;
    struct header *header = &exchange->headers[exchange->header_count++];
    snprintf(header->name, sizeof header->name, "%s", name);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(header->value, sizeof header->value, format, arguments);
    va_end(arguments);
    for (char *at = header->value; *at; at++) /* libmicrohttpd would drop the field */
        if ((unsigned char)*at < 0x20 || *at == 0x7f)
            *at = ' ';
}

static bool has_header(const struct http_exchange *exchange, const char *name)
{
    for (size_t i = 0; i < exchange->header_count; i++)
        if (strcasecmp(exchange->headers[i].name, name) == 0)
            return true;
    return false;
}

/* Cross-origin resource sharing (WHATWG Fetch, section 3.2): the page behind the request may read
 * the reply, and those of its fields that clients use. */
static void share_response(const struct http_exchange *exchange, struct MHD_Response *response)
{
    MHD_add_response_header(response, "Access-Control-Allow-Origin", exchange->origin);
    MHD_add_response_header(
        response, "Access-Control-Expose-Headers",
        "Allow, ETag, Link, Location, Retry-After, Server-Timing, X-Request-Id");
    MHD_add_response_header(response, "Vary", "Origin");
}

bool http_request_is_shared(const struct http_exchange *exchange)
{
    return exchange->origin != NULL;
}

void http_set_response(struct http_exchange *exchange, int status, const char *media_type,
                       struct MHD_Response *response, uint64_t size_bytes)
{
    if (exchange->response) {
        MHD_destroy_response(response);
        return;
    }
    if (!response)
        return;
    exchange->response = response;
    exchange->status = status;
    exchange->reply_bytes = size_bytes;
    for (size_t i = 0; i < exchange->header_count; i++)
        MHD_add_response_header(response, exchange->headers[i].name, exchange->headers[i].value);
    if (media_type)
        MHD_add_response_header(response, "Content-Type", media_type);
    if (!has_header(exchange, "Cache-Control"))
        MHD_add_response_header(response, "Cache-Control", "no-store");
    if (exchange->origin)
        share_response(exchange, response);
    MHD_add_response_header(response, "X-Request-Id", exchange->id);
    MHD_add_response_header(response, "X-Content-Type-Options", "nosniff");
}

void http_reply_bytes(struct http_exchange *exchange, int status, const char *media_type,
                      const void *bytes, size_t size_bytes)
{
    static char none[1];
    void *copy = size_bytes ? malloc(size_bytes) : none;
    if (!copy)
        return;
    if (size_bytes)
        memcpy(copy, bytes, size_bytes);
    struct MHD_Response *response = MHD_create_response_from_buffer(
        size_bytes, copy, size_bytes ? MHD_RESPMEM_MUST_FREE : MHD_RESPMEM_PERSISTENT);
    if (!response && size_bytes)
        free(copy);
    http_set_response(exchange, status, media_type, response, size_bytes);
}

void http_reply_empty(struct http_exchange *exchange, int status)
{
    http_reply_bytes(exchange, status, NULL, NULL, 0);
}

void http_reply_fd(struct http_exchange *exchange, int status, const char *media_type, int fd,
                   uint64_t size_bytes)
{
    struct MHD_Response *response = MHD_create_response_from_fd64(size_bytes, fd);
    if (!response)
        close(fd);
    http_set_response(exchange, status, media_type, response, size_bytes);
}

void http_reply_file(struct http_exchange *exchange, const char *media_type, const char *tag,
                     int fd, uint64_t size_bytes)
{
    struct http_range range;
    const char *value = http_request_header(exchange, "Range");
    const char *condition = http_request_header(exchange, "If-Range");
    if (condition && strcmp(condition, tag) != 0)
        value = NULL;
    http_reply_header(exchange, "Accept-Ranges", "bytes");
    http_reply_header(exchange, "ETag", "%s", tag);
    switch (http_range_parse(value, size_bytes, &range)) {
    case HTTP_RANGE_ALL:
        http_reply_fd(exchange, 200, media_type, fd, size_bytes);
        return;
    case HTTP_RANGE_OUTSIDE:
        close(fd);
        http_reply_header(exchange, "Content-Range", "bytes */%llu",
                          (unsigned long long)size_bytes);
        struct error problem = {0};
        error_set(&problem, ERROR_RANGE, "Range: '%.80s' is outside of %llu bytes", value,
                  (unsigned long long)size_bytes);
        http_reply_error(exchange, &problem);
        return;
    case HTTP_RANGE_PART:
        break;
    }
    http_reply_header(
        exchange, "Content-Range", "bytes %llu-%llu/%llu", (unsigned long long)range.first,
        (unsigned long long)(range.first + range.count - 1), (unsigned long long)size_bytes);
    struct MHD_Response *response =
        MHD_create_response_from_fd_at_offset64(range.count, fd, range.first);
    if (!response)
        close(fd);
    http_set_response(exchange, 206, media_type, response, range.count);
}

void http_reply_error(struct http_exchange *exchange, const struct error *problem)
{
    struct error unsaid = {ERROR_INTERNAL, "a failure without a reason", ""};
    if (problem->code == ERROR_NONE)
        problem = &unsaid;
    int status = error_code_http_status(problem->code);
    if (status >= 500)
        log_write(exchange->server->log, status == 503 ? LOG_WARNING : LOG_ERROR,
                  "%s %s %s: %s: %s", exchange->id, exchange->method_name, exchange->path,
                  error_code_name(problem->code), problem->message);
    if ((status == 429 || status == 503) && !has_header(exchange, "Retry-After"))
        http_reply_header(exchange, "Retry-After", status == 429 ? "30" : "2");
    char *text = problem_to_json(problem, exchange->id);
    http_reply_bytes(exchange, status, PROBLEM_MEDIA_TYPE, text ? text : "{}",
                     text ? strlen(text) : 2);
    free(text);
}

/* Hands the reply to libmicrohttpd; always on its own thread, inside the access handler. */
static enum MHD_Result send_reply(struct http_exchange *exchange)
{
    if (!exchange->response)
        return MHD_NO;
    if (exchange->must_close)
        MHD_add_response_header(exchange->response, "Connection", "close");
    exchange->state = EXCHANGE_SENDING;
    http_watch_expect_reply(exchange->server->watch, exchange->watched, exchange->reply_bytes);
    return MHD_queue_response(exchange->connection, (unsigned)exchange->status, exchange->response);
}

/* ---- waiting ---- */

void http_wait(struct http_exchange *exchange, void (*on_gone)(void *context, uint64_t ticket),
               void *context, uint64_t ticket)
{
    exchange->state = EXCHANGE_WAITING;
    atomic_fetch_add(&exchange->server->waiting, 1);
    MHD_suspend_connection(exchange->connection);
    http_watch_wait(exchange->server->watch, exchange->watched, on_gone, context, ticket);
}

void http_resume(struct http_exchange *exchange)
{
    atomic_fetch_sub(&exchange->server->waiting, 1);
    MHD_resume_connection(exchange->connection); /* the exchange may be gone when this returns */
}

/* ---- the access handler ---- */

static enum http_method method_from_name(const char *name)
{
    for (int i = 0; i < HTTP_OTHER; i++)
        if (strcmp(name, method_names[i]) == 0)
            return (enum http_method)i;
    return HTTP_OTHER;
}

/* A client's own id is kept if it is harmless in logs and headers; otherwise one is made. */
static void choose_request_id(struct http_exchange *exchange)
{
    const char *given = http_request_header(exchange, "X-Request-Id");
    size_t length = given ? strlen(given) : 0;
    bool is_good = length > 0 && length < REQUEST_ID_BYTES;
    for (size_t i = 0; is_good && i < length; i++)
        is_good = isalnum((unsigned char)given[i]) || strchr("._-", given[i]);
    if (is_good) {
        memcpy(exchange->id, given, length + 1);
        return;
    }
    uint64_t number = atomic_fetch_add(&exchange->server->next_request, 1);
    /* Steele, Lea, Flood 2014, "Fast splittable pseudorandom number generators": SplitMix64's
     * finalizer spreads it. */
    uint64_t mixed = exchange->server->request_salt + number * 0x9e3779b97f4a7c15u;
    mixed = (mixed ^ (mixed >> 30)) * 0xbf58476d1ce4e5b9u;
    mixed = (mixed ^ (mixed >> 27)) * 0x94d049bb133111ebu;
    snprintf(exchange->id, sizeof exchange->id, "%016llx",
             (unsigned long long)(mixed ^ (mixed >> 31)));
}

struct head_visit {
    struct http_head *head;
    struct http_lines lines;
};

static enum MHD_Result visit_header(void *context, enum MHD_ValueKind kind, const char *name,
                                    const char *value)
{
    (void)kind;
    struct head_visit *visit = context;
    http_head_add(visit->head, name, value);
    http_lines_add(&visit->lines, name, value ? value : "");
    return MHD_YES;
}

/* method and version lie in the library's buffer, in which the head came. */
static void read_head(struct http_exchange *exchange, const char *method, const char *version,
                      struct http_head *head)
{
    struct head_visit visit = {.head = head};
    *head = (struct http_head){.is_http_1_0 = strcmp(version, "HTTP/1.0") == 0,
                               .is_change = exchange->method >= HTTP_POST &&
                                            exchange->method <= HTTP_DELETE};
    http_lines_init(&visit.lines, version);
    MHD_get_connection_values(exchange->connection, MHD_HEADER_KIND, visit_header, &visit);
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(exchange->connection, MHD_CONNECTION_INFO_REQUEST_HEADER_SIZE);
    head->has_odd_line = http_lines_can_judge(MHD_get_version()) &&
                         !(info && http_lines_are_plain(&visit.lines, method, info->header_size));
}

static void *connection_context(struct MHD_Connection *connection)
{
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
    return info ? info->socket_context : NULL;
}

static struct http_exchange *exchange_create(struct http_server *server,
                                             struct MHD_Connection *connection, const char *path,
                                             const char *method)
{
    struct http_exchange *exchange = calloc(1, sizeof *exchange);
    if (exchange)
        exchange->path = strdup(path);
    if (!exchange || !exchange->path) {
        free(exchange);
        return NULL;
    }
    clock_gettime(CLOCK_MONOTONIC, &exchange->started);
    exchange->server = server;
    exchange->connection = connection;
    exchange->watched = connection_context(connection);
    exchange->method = method_from_name(method);
    snprintf(exchange->method_name, sizeof exchange->method_name, "%s", method);
    for (char *at = exchange->method_name; *at; at++)
        if (*at < '!' || *at > '~')
            *at = '?';
    choose_request_id(exchange);
    atomic_fetch_add(&server->in_flight, 1);
    return exchange;
}

/* The head is in. A refusal is sent now; only when the body is small is it read first, since a
 * client that is still sending may never see a reply on a connection that closes under it. */
static enum MHD_Result begin_exchange(struct http_exchange *exchange, const char *method,
                                      const char *version)
{
    struct http_server *server = exchange->server;
    struct http_head head;
    struct error problem = {0};
    read_head(exchange, method, version, &head);
    if (!http_head_check(&head, &server->policy, &problem)) {
        exchange->must_close = true;
        http_reply_error(exchange, &problem);
        return send_reply(exchange);
    }
    if (http_head_is_shared(&head, &server->policy))
        exchange->origin = strdup(head.origin); /* without memory the page reads nothing */
    exchange->announced_bytes = http_head_body_bytes(&head);
    http_watch_expect_body(server->watch, exchange->watched);
    server->service.open(server->service.context, exchange);
    if (!exchange->response && exchange->has_sink && exchange->announced_bytes != UINT64_MAX &&
        exchange->announced_bytes > exchange->sink.max_bytes) {
        error_set(&problem, ERROR_TOO_LARGE, "the body has %llu bytes, limit is %llu",
                  (unsigned long long)exchange->announced_bytes,
                  (unsigned long long)exchange->sink.max_bytes);
        http_reply_error(exchange, &problem);
    }
    bool has_expect = http_request_header(exchange, "Expect") != NULL;
    if (exchange->response && exchange->announced_bytes > 0 &&
        (has_expect || exchange->announced_bytes > SWALLOW_BYTES)) {
        exchange->must_close = true;
        return send_reply(exchange);
    }
    exchange->state = exchange->has_sink && !exchange->response ? EXCHANGE_BODY : EXCHANGE_SWALLOW;
    return MHD_YES;
}

/* A piece of the body. What is refused in its middle must still be read to its end (libmicrohttpd
 * takes replies before or after a body only), but not without end. */
static enum MHD_Result take_body(struct http_exchange *exchange, const char *bytes,
                                 size_t size_bytes)
{
    exchange->body_bytes += size_bytes;
    http_watch_count_body(exchange->server->watch, exchange->watched, size_bytes);
    if (exchange->state == EXCHANGE_BODY) {
        if (exchange->body_bytes > exchange->sink.max_bytes)
            error_set(&exchange->body_error, ERROR_TOO_LARGE,
                      "the body is longer than the limit of %llu bytes",
                      (unsigned long long)exchange->sink.max_bytes);
        else if (!exchange->sink.write(exchange->sink.context, bytes, size_bytes,
                                       &exchange->body_error))
            assert(exchange->body_error.code != ERROR_NONE);
        if (exchange->body_error.code != ERROR_NONE)
            exchange->state = EXCHANGE_SWALLOW;
    }
    uint64_t most = (exchange->has_sink ? exchange->sink.max_bytes : 0) + SWALLOW_BYTES;
    return exchange->state == EXCHANGE_SWALLOW && exchange->body_bytes > most ? MHD_NO : MHD_YES;
}

static enum MHD_Result handle(void *context, struct MHD_Connection *connection, const char *path,
                              const char *method, const char *version, const char *bytes,
                              size_t *size_bytes, void **state)
{
    struct http_server *server = context;
    struct http_exchange *exchange = *state;
    if (!exchange) {
        exchange = *state = exchange_create(server, connection, path, method);
        return exchange ? begin_exchange(exchange, method, version) : MHD_NO;
    }
    if (*size_bytes > 0) {
        size_t size = *size_bytes;
        *size_bytes = 0;
        return take_body(exchange, bytes, size);
    }
    if (exchange->body_error.code != ERROR_NONE)
        http_reply_error(exchange, &exchange->body_error);
    if (!exchange->response && exchange->state != EXCHANGE_WAITING) {
        http_watch_expect_reply(server->watch, exchange->watched, 0); /* the body is whole */
        server->service.run(server->service.context, exchange);
        if (exchange->state == EXCHANGE_WAITING)
            return MHD_YES; /* no longer ours: even its response may be set by now */
    }
    return send_reply(exchange);
}

static void completed(void *context, struct MHD_Connection *connection, void **state,
                      enum MHD_RequestTerminationCode how)
{
    (void)connection, (void)how;
    struct http_server *server = context;
    struct http_exchange *exchange = *state;
    if (!exchange)
        return;
    server->service.close(server->service.context, exchange);
    http_watch_expect_head(server->watch, exchange->watched);
    http_stream_finish(exchange);
    http_upgrade_finish(exchange);
    if (exchange->response)
        MHD_destroy_response(exchange->response);
    free(exchange->headers);
    free(exchange->path);
    free(exchange->origin);
    free(exchange);
    *state = NULL;
    atomic_fetch_sub(&server->in_flight, 1);
}

/* MHD_quiesce_daemon is not called: it takes the listening socket out of each thread's epoll while
 * that thread may do the same, and the library aborts the process where one of the two finds the
 * socket gone (0.9.75 to 1.0.1). */
static enum MHD_Result may_connect(void *context, const struct sockaddr *address, socklen_t length)
{
    struct http_server *server = context;
    (void)address, (void)length;
    return atomic_load(&server->is_quiesced) ? MHD_NO : MHD_YES;
}

static void connection_changed(void *context, struct MHD_Connection *connection,
                               void **socket_context, enum MHD_ConnectionNotificationCode what)
{
    struct http_server *server = context;
    if (what == MHD_CONNECTION_NOTIFY_STARTED) {
        const union MHD_ConnectionInfo *info =
            MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD);
        *socket_context = info ? http_watch_add(server->watch, info->connect_fd) : NULL;
        atomic_fetch_add(&server->connections, 1);
    } else {
        http_watch_remove(server->watch, *socket_context);
        *socket_context = NULL;
        atomic_fetch_sub(&server->connections, 1);
    }
}

static void log_library(void *context, const char *format, va_list arguments)
{
    const struct http_server *server = context;
    char line[512];
    vsnprintf(line, sizeof line, format, arguments);
    line[strcspn(line, "\n")] = '\0';
    log_write(server->log, LOG_DEBUG, "libmicrohttpd: %s", line);
}

/* ---- life ---- */

static bool listen_on(struct http_server *server, const struct config *config, struct error *err)
{
    const struct sockaddr *address = (const struct sockaddr *)&config->address;
    socklen_t length =
        address->sa_family == AF_INET6 ? sizeof(struct sockaddr_in6) : sizeof(struct sockaddr_in);
    server->listen_fd = socket(address->sa_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    int yes = 1;
    if (server->listen_fd < 0 ||
        setsockopt(server->listen_fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) != 0 ||
        bind(server->listen_fd, address, length) != 0 || listen(server->listen_fd, BACKLOG) != 0)
        return error_set(err, ERROR_IO, "listen on %s: %s", config->listen, strerror(errno));
    union {
        struct sockaddr any;
        struct sockaddr_in v4;
        struct sockaddr_in6 v6;
    } bound = {.v6 = {0}};
    length = sizeof bound;
    if (getsockname(server->listen_fd, &bound.any, &length) != 0)
        return error_set(err, ERROR_IO, "listen on %s: %s", config->listen, strerror(errno));
    server->port = ntohs(bound.any.sa_family == AF_INET6 ? bound.v6.sin6_port : bound.v4.sin_port);
    return true;
}

bool http_server_start(struct http_server *server, struct error *err)
{
    const struct config *config = server->config;
    /* An array, because in a variadic list one conditional option too many ends it unnoticed. */
    struct MHD_OptionItem options[] = {
        {MHD_OPTION_CONNECTION_LIMIT, config->connections, NULL},
        {MHD_OPTION_CONNECTION_TIMEOUT, CONNECTION_IDLE_S, NULL},
        {MHD_OPTION_CONNECTION_MEMORY_LIMIT, CONNECTION_MEMORY_BYTES, NULL},
        {MHD_OPTION_THREAD_POOL_SIZE, THREADS, NULL},
        {MHD_OPTION_STRICT_FOR_CLIENT, STRICTNESS, NULL},
        {MHD_OPTION_LISTEN_SOCKET, server->listen_fd, NULL},
        {MHD_OPTION_NOTIFY_COMPLETED, (intptr_t)completed, server},
        {MHD_OPTION_NOTIFY_CONNECTION, (intptr_t)connection_changed, server},
        {MHD_OPTION_END, 0, NULL},
    };
    server->daemon =
        MHD_start_daemon(MHD_USE_EPOLL_INTERNAL_THREAD | MHD_ALLOW_SUSPEND_RESUME |
                             MHD_ALLOW_UPGRADE | MHD_USE_ERROR_LOG | MHD_USE_ITC,
                         0, may_connect, server, handle, server, MHD_OPTION_EXTERNAL_LOGGER,
                         log_library, server, MHD_OPTION_ARRAY, options, MHD_OPTION_END);
    return server->daemon ||
           error_set(err, ERROR_IO, "the HTTP server does not start on %s", config->listen);
}

struct http_server *http_server_create(const struct http_server_desc *desc, struct error *err)
{
    struct http_server *server = calloc(1, sizeof *server);
    if (!server) {
        error_set(err, ERROR_NO_MEMORY, "HTTP server");
        return NULL;
    }
    pthread_mutex_init(&server->streams_mutex, NULL);
    server->config = desc->config;
    server->log = desc->log;
    server->service = desc->service;
    server->policy = (struct http_policy){.is_loopback = desc->config->is_loopback,
                                          .listen_host = desc->config->listen_host,
                                          .allow_host = desc->config->allow_host,
                                          .allow_origin = desc->config->allow_origin};
    server->listen_fd = -1;
    server->watch = http_watch_create(&(struct http_watch_desc){0}, err);
    if (!server->watch)
        goto fail;
    if (getrandom(&server->request_salt, sizeof server->request_salt, 0) !=
        sizeof server->request_salt) {
        error_set(err, ERROR_INTERNAL, "getrandom: %s", strerror(errno));
        goto fail;
    }
    if (!listen_on(server, desc->config, err))
        goto fail;
    return server;

fail:
    http_server_destroy(server);
    return NULL;
}

int http_server_port(const struct http_server *server)
{
    return server->port;
}

void http_server_quiesce(struct http_server *server)
{
    atomic_store(&server->is_quiesced, true);
}

bool http_server_wait_idle(struct http_server *server, int timeout_ms)
{
    for (int waited = 0; atomic_load(&server->in_flight) > 0 && waited < timeout_ms; waited += 5)
        nanosleep(&(struct timespec){.tv_nsec = 5000000}, NULL);
    return atomic_load(&server->in_flight) == 0;
}

void http_server_destroy(struct http_server *server)
{
    if (!server)
        return;
    /* MHD_stop_daemon aborts the process while a connection is suspended: whoever lets exchanges
     * wait completes them first, and those that come later at once. One of these may be between
     * http_wait and http_resume now, on a thread that ends before the next line does. */
    if (server->daemon)
        MHD_stop_daemon(server->daemon);
    else if (server->listen_fd >= 0)
        close(server->listen_fd);
    assert(atomic_load(&server->waiting) == 0);
    http_watch_destroy(server->watch);
    pthread_mutex_destroy(&server->streams_mutex);
    free(server);
}

struct http_server_totals http_server_get_totals(struct http_server *server)
{
    return (struct http_server_totals){atomic_load(&server->connections),
                                       atomic_load(&server->in_flight)};
}
