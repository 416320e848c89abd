/* SPDX-License-Identifier: MIT */
/* /v1/views/{id}/socket: a view over WebSocket. What a session does is on the thread of the
 * sockets. */
#include <arpa/inet.h>
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "protocol/view_message.h"
#include "server/routes/router.h"
#include "server/views/live.h"

enum { SEQS = 32 /* cameras whose frames may still come; older ones count as shown */ };

/* A camera of this client, and the revision that it made. */
struct seen_camera {
    uint64_t seq, revision;
};

/* Owned by the exchange until the socket is taken, then by the loop. */
struct view_socket {
    struct service *service;
    struct watcher *watcher;
    _Atomic(struct websocket *) socket; /* NULL until it is open */
    char view[VIEW_ID_BYTES];
    int credit;
    bool has_said_hello;
    uint64_t revision;                /* the last that was sent */
    struct seen_camera cameras[SEQS]; /* a ring */
    size_t camera_count;
};

static void view_socket_destroy(struct view_socket *session)
{
    if (!session)
        return;
    watcher_destroy(session->watcher);
    free(session);
}

/* With the lock of the views held. */
static void wake(void *context)
{
    struct view_socket *session = context;
    struct websocket *socket = atomic_load(&session->socket);
    if (socket)
        websocket_poke(socket);
}

/* ---- down ---- */

/* Takes the reference. */
static void say(struct view_socket *session, json_t *message)
{
    char *text = message ? json_dumps(message, JSON_COMPACT) : NULL;
    if (text)
        websocket_send_text(atomic_load(&session->socket), text, strlen(text));
    free(text);
    json_decref(message);
}

static json_t *id_of(const struct view_message *message)
{
    return message && message->id ? json_incref(message->id) : json_null();
}

static void say_error(struct view_socket *session, const struct view_message *message,
                      const struct error *problem, uint64_t revision)
{
    say(session,
        json_pack("{s:s,s:o,s:s,s:s,s:s*,s:I}", "type", "error", "id", id_of(message), "code",
                  error_code_name(problem->code), "detail", problem->message, "pointer",
                  problem->pointer[0] ? problem->pointer : NULL, "revision", (json_int_t)revision));
}

/* The newest camera of this client that a revision shows, or null. */
static json_t *shown_seq(const struct view_socket *session, uint64_t revision)
{
    size_t oldest = session->camera_count > SEQS ? session->camera_count - SEQS : 0;
    for (size_t i = session->camera_count; i > oldest; i--) {
        const struct seen_camera *camera = &session->cameras[(i - 1) % SEQS];
        if (camera->revision <= revision)
            return json_integer((json_int_t)camera->seq);
    }
    return json_null();
}

/* To the microsecond, as in the frame's stats. */
static json_t *rounded_ms(double ms)
{
    return json_real(round(1000 * ms) / 1000);
}

/* 4 bytes with the length of the header, the header, the image. */
static void send_frame(struct view_socket *session, const struct live_frame *frame)
{
    const struct view_image *image = frame->image;
    json_t *header = json_pack(
        "{s:s,s:I,s:o,s:b,s:b,s:f,s:i,s:i,s:s,s:s,s:I,s:{s:o,s:o,s:o}}", "type", "frame",
        "revision", (json_int_t)frame->revision, "seq", shown_seq(session, frame->revision),
        "exact", frame->is_exact, "refined", frame->is_refined, "scale", frame->scale, "width",
        image->width_px, "height", image->height_px, "format",
        image_format_media_type(image->format), "frame", image->frame, "bytes",
        (json_int_t)image->size_bytes, "timings_ms", "queue", rounded_ms(image->queue_ms), "render",
        rounded_ms(image->cost_ms), "total", rounded_ms(image->total_ms));
    const size_t flags = JSON_COMPACT | JSON_REAL_PRECISION(15);
    size_t length = header ? json_dumpb(header, NULL, 0, flags) : 0;
    size_t size_bytes = 4 + length + image->size_bytes;
    char *message = length ? malloc(size_bytes) : NULL;
    if (message) {
        uint32_t length_be = htonl((uint32_t)length);
        memcpy(message, &length_be, 4);
        json_dumpb(header, message + 4, length, flags);
        memcpy(message + 4 + length, image->bytes, image->size_bytes);
        websocket_send_binary(atomic_load(&session->socket), message, size_bytes);
        session->credit--;
    }
    free(message);
    json_decref(header);
}

/* Sends what is new, as far as the client has room for it. */
static void turn(void *context)
{
    struct view_socket *session = context;
    struct websocket *socket = atomic_load(&session->socket);
    struct watcher_news news;
    watcher_look(session->watcher, session->credit > 0 && websocket_is_idle(socket), &news);
    if (!session->has_said_hello)
        say(session, json_pack("{s:s,s:s,s:I,s:i}", "type", "hello", "view", session->view,
                               "revision", (json_int_t)news.revision, "credit", session->credit));
    else if (news.has_revision)
        say(session,
            json_pack("{s:s,s:I}", "type", "changed", "revision", (json_int_t)news.revision));
    session->has_said_hello = true;
    session->revision = news.revision;
    if (news.has_progress) {
        json_t *message = job_progress_to_json(&news.progress);
        json_object_set_new(message, "type", json_string("progress"));
        say(session, message);
    }
    if (news.has_problem)
        say_error(session, NULL, &news.problem, news.revision);
    if (news.has_frame) {
        send_frame(session, &news.frame);
        view_image_release(news.frame.image);
    }
    if (news.is_gone)
        websocket_close(socket, 1001, "view gone");
}

/* ---- up ---- */

static void apply(struct view_socket *session, struct view_message *message)
{
    struct error problem = {0};
    uint64_t revision = 0;
    bool is_camera = message->kind == VIEW_MESSAGE_CAMERA;
    json_t *summary =
        views_patch(session->service->views, session->view,
                    &(struct view_patch){.json = message->patch, .replaces_camera = is_camera},
                    &(struct view_condition){.revision = message->revision}, &revision, &problem);
    json_decref(summary);
    if (!summary)
        say_error(session, message, &problem, revision);
    else if (!is_camera)
        say(session, json_pack("{s:s,s:o,s:I}", "type", "patched", "id", id_of(message), "revision",
                               (json_int_t)revision));
    else if (message->has_seq)
        session->cameras[session->camera_count++ % SEQS] =
            (struct seen_camera){message->seq, revision};
}

static void hear(void *context, const char *text, size_t length)
{
    struct view_socket *session = context;
    struct error problem = {0};
    struct view_message message;
    if (!view_message_parse(text, length, &message, &problem)) {
        say_error(session, &message, &problem, session->revision);
        view_message_finish(&message);
        return;
    }
    switch (message.kind) {
    case VIEW_MESSAGE_CAMERA:
    case VIEW_MESSAGE_PATCH:
    case VIEW_MESSAGE_QUALITY:
        apply(session, &message);
        break;
    case VIEW_MESSAGE_ACK:
        session->credit += message.count;
        if (session->credit > VIEW_CREDIT_MAX)
            session->credit = VIEW_CREDIT_MAX;
        websocket_poke(atomic_load(&session->socket));
        break;
    case VIEW_MESSAGE_PING:
        say(session, json_pack("{s:s,s:o}", "type", "pong", "id", id_of(&message)));
        break;
    }
    view_message_finish(&message);
}

static void opened(void *context, struct websocket *socket)
{
    struct view_socket *session = context;
    atomic_store(&session->socket, socket);
    websocket_poke(socket);
}

static void closed(void *context)
{
    view_socket_destroy(context);
}

/* ---- the handshake ---- */

/* The data of the exchange, which owns the session until that is taken. */
struct socket_get {
    struct view_socket *session;
};

static void socket_get_destroy(void *data)
{
    struct socket_get *get = data;
    view_socket_destroy(get->session);
    free(get);
}

static void take(void *context, int fd, const char *extra, size_t extra_bytes,
                 struct http_upgrade *upgrade)
{
    struct socket_get *get = context;
    struct view_socket *session = get->session;
    get->session = NULL;
    websocket_loop_add(
        session->service->sockets, fd, extra, extra_bytes, upgrade,
        &(struct websocket_session){
            .context = session, .open = opened, .text = hear, .turn = turn, .close = closed});
}

static bool has_token(const char *list, const char *token)
{
    size_t length = strlen(token);
    for (const char *at = list; at && *at; at += strcspn(at, ",")) {
        at += strspn(at, ", \t");
        size_t found = strcspn(at, ", \t");
        if (found == length && strncasecmp(at, token, length) == 0)
            return true;
    }
    return false;
}

static bool check_handshake(struct http_exchange *exchange, char accept[WEBSOCKET_ACCEPT_BYTES],
                            struct error *err)
{
    const char *version = http_request_header(exchange, "Sec-WebSocket-Version");
    const char *key = http_request_header(exchange, "Sec-WebSocket-Key");
    if (!has_token(http_request_header(exchange, "Upgrade"), "websocket") ||
        !has_token(http_request_header(exchange, "Connection"), "upgrade"))
        return error_set(err, ERROR_INVALID_REQUEST,
                         "this route speaks WebSocket: Upgrade: websocket is needed");
    if (http_request_method(exchange) != HTTP_GET)
        return error_set(err, ERROR_INVALID_REQUEST, "a WebSocket begins with GET");
    if (!version || strcmp(version, "13") != 0) {
        http_reply_header(exchange, "Sec-WebSocket-Version", "13");
        return error_set(err, ERROR_INVALID_REQUEST, "Sec-WebSocket-Version '%.16s' is not 13",
                         version ? version : "");
    }
    return websocket_accept(key, accept) ||
           error_set(err, ERROR_INVALID_REQUEST,
                     "Sec-WebSocket-Key '%.40s' is not 16 bytes in base64", key ? key : "");
}

static struct socket_get *prepare(struct service *service, struct http_exchange *exchange,
                                  const char *id, struct error *err)
{
    struct socket_get *get = calloc(1, sizeof *get);
    struct view_socket *session = get ? calloc(1, sizeof *session) : NULL;
    if (!session) {
        free(get);
        error_set(err, ERROR_NO_MEMORY, "socket");
        return NULL;
    }
    get->session = session;
    route_attach(exchange, get, socket_get_destroy);
    session->service = service;
    session->credit = VIEW_CREDIT_FIRST;
    memcpy(session->view, id, strnlen(id, sizeof session->view - 1));
    session->watcher =
        watcher_create(service->views,
                       &(struct watcher_desc){.view = id, .context = session, .notify = wake}, err);
    return session->watcher ? get : NULL;
}

static void run_socket(struct service *service, struct http_exchange *exchange, const char *id)
{
    struct error problem = {0};
    char accept[WEBSOCKET_ACCEPT_BYTES];
    struct socket_get *get = check_handshake(exchange, accept, &problem)
                                 ? prepare(service, exchange, id, &problem)
                                 : NULL;
    if (!get) {
        http_reply_error(exchange, &problem);
        return;
    }
    http_reply_header(exchange, "Sec-WebSocket-Accept", "%s", accept);
    http_reply_upgrade(exchange, "websocket", &(struct http_taker){.context = get, .take = take});
}

const struct route routes_view_socket[] = {
    {"/v1/views/{id}/socket", {{HTTP_GET, NULL, run_socket}}},
    {0},
};
