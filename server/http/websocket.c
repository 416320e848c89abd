/* SPDX-License-Identifier: MIT */
/* One thread that polls all sockets; wslay frames what they say. */
#include "server/http/websocket.h"

#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>
#include <wslay/wslay.h>

#include "server/base/clock.h"

enum {
    QUEUE_MAX = 16,      /* messages; with more nothing is read, and pings get no answer */
    TICK_MS = 500,       /* how late a deadline may be noticed */
    GOODBYE_MS = 1000,   /* for sending a close frame and getting one back */
    LAST_WORDS_MS = 300, /* the same, when the daemon stops */
};

struct websocket {
    struct websocket *next;
    struct websocket_loop *loop;
    int fd;
    struct http_upgrade *upgrade;
    struct websocket_session session;
    wslay_event_context_ptr framing;
    char *extra; /* owned: what came with the handshake */
    size_t extra_bytes, extra_used;
    bool is_broken; /* the connection, or our memory */
    bool is_closing, was_idle;
    bool has_failed; /* the last is said: what is read is thrown away */
    atomic_bool is_poked;
    int64_t heard_ms, pinged_ms, progress_ms, closing_ms;
};

struct websocket_loop {
    struct websocket_desc desc;
    pthread_t thread;
    bool has_thread;
    int wake_fd;
    pthread_mutex_t mutex;   /* guards the two below */
    struct websocket *added; /* not yet seen by the thread */
    bool is_stopping;
    struct websocket *first; /* the thread's own */
    size_t count;
};

static void wake(struct websocket_loop *loop)
{
    eventfd_write(loop->wake_fd, 1);
}

/* ---- what wslay asks for ---- */

/* Reading stops while much waits to be sent, so that a client cannot make us queue without end. */
static bool is_full(const struct websocket *socket)
{
    return wslay_event_get_queued_msg_count(socket->framing) > QUEUE_MAX;
}

static ssize_t receive(wslay_event_context_ptr framing, uint8_t *bytes, size_t capacity, int flags,
                       void *context)
{
    (void)flags;
    struct websocket *socket = context;
    if (is_full(socket)) {
        wslay_event_set_error(framing, WSLAY_ERR_WOULDBLOCK);
        return -1;
    }
    size_t left = socket->extra_bytes - socket->extra_used;
    if (left > 0) {
        size_t count = left < capacity ? left : capacity;
        memcpy(bytes, socket->extra + socket->extra_used, count);
        socket->extra_used += count;
        return (ssize_t)count;
    }
    ssize_t count;
    do
        count = recv(socket->fd, bytes, capacity, 0);
    while (count < 0 && errno == EINTR);
    if (count > 0) {
        socket->heard_ms = now_ms();
        return count;
    }
    bool must_wait = count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK);
    socket->is_broken |= !must_wait;
    wslay_event_set_error(framing, must_wait ? WSLAY_ERR_WOULDBLOCK : WSLAY_ERR_CALLBACK_FAILURE);
    return -1;
}

static ssize_t transmit(wslay_event_context_ptr framing, const uint8_t *bytes, size_t size_bytes,
                        int flags, void *context)
{
    struct websocket *socket = context;
    int more = flags & WSLAY_MSG_MORE ? MSG_MORE : 0;
    ssize_t count;
    do
        count = send(socket->fd, bytes, size_bytes, MSG_NOSIGNAL | more);
    while (count < 0 && errno == EINTR);
    if (count > 0) {
        socket->progress_ms = now_ms();
        return count;
    }
    bool must_wait = count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK);
    socket->is_broken |= !must_wait;
    wslay_event_set_error(framing, must_wait ? WSLAY_ERR_WOULDBLOCK : WSLAY_ERR_CALLBACK_FAILURE);
    return -1;
}

static void received(wslay_event_context_ptr framing, const struct wslay_event_on_msg_recv_arg *arg,
                     void *context)
{
    (void)framing;
    struct websocket *socket = context;
    if (socket->is_closing)
        return;
    if (arg->opcode == WSLAY_TEXT_FRAME)
        socket->session.text(socket->session.context, (const char *)arg->msg, arg->msg_length);
    else if (arg->opcode == WSLAY_BINARY_FRAME)
        websocket_close(socket, WSLAY_CODE_UNSUPPORTED_DATA, "messages are texts");
}

/* ---- for sessions ---- */

static void queue(struct websocket *socket, uint8_t opcode, const void *bytes, size_t size_bytes)
{
    struct wslay_event_msg message = {.opcode = opcode, .msg = bytes, .msg_length = size_bytes};
    if (websocket_is_idle(socket))
        socket->progress_ms = now_ms();
    int status = wslay_event_queue_msg(socket->framing, &message);
    socket->is_broken |= status == WSLAY_ERR_NOMEM;
    socket->was_idle = false;
}

void websocket_send_text(struct websocket *socket, const char *text, size_t length)
{
    queue(socket, WSLAY_TEXT_FRAME, text, length);
}

void websocket_send_binary(struct websocket *socket, const void *bytes, size_t size_bytes)
{
    queue(socket, WSLAY_BINARY_FRAME, bytes, size_bytes);
}

bool websocket_is_idle(const struct websocket *socket)
{
    return !wslay_event_want_write(socket->framing);
}

void websocket_close(struct websocket *socket, int code, const char *reason)
{
    if (socket->is_closing)
        return;
    socket->is_closing = true;
    socket->closing_ms = now_ms();
    if (wslay_event_queue_close(socket->framing, (uint16_t)code, (const uint8_t *)reason,
                                strlen(reason)) != 0)
        socket->is_broken = true;
}

void websocket_poke(struct websocket *socket)
{
    if (!atomic_exchange(&socket->is_poked, true))
        wake(socket->loop);
}

/* ---- one socket; on the loop's thread ---- */

static void socket_destroy(struct websocket *socket)
{
    if (socket->framing)
        wslay_event_context_free(socket->framing);
    socket->session.close(socket->session.context);
    http_upgrade_end(socket->upgrade);
    free(socket->extra);
    free(socket);
}

/* A goodbye has a code of two bytes, or nothing (RFC 6455, 5.5.1); wslay takes half a code for
 * none.
 */
static void frame_begins(wslay_event_context_ptr framing,
                         const struct wslay_event_on_frame_recv_start_arg *arg, void *context)
{
    (void)framing;
    if (arg->opcode == WSLAY_CONNECTION_CLOSE && arg->payload_length == 1)
        websocket_close(context, WSLAY_CODE_PROTOCOL_ERROR, "");
}

static bool socket_begin(struct websocket *socket)
{
    static const struct wslay_event_callbacks callbacks = {.recv_callback = receive,
                                                           .send_callback = transmit,
                                                           .on_frame_recv_start_callback =
                                                               frame_begins,
                                                           .on_msg_recv_callback = received};
    if (wslay_event_context_server_init(&socket->framing, &callbacks, socket) != 0)
        return false;
    wslay_event_config_set_max_recv_msg_length(socket->framing, socket->loop->desc.max_text_bytes);
    socket->heard_ms = socket->pinged_ms = socket->progress_ms = now_ms();
    socket->session.open(socket->session.context, socket);
    return true;
}

static bool wants_read(const struct websocket *socket)
{
    return wslay_event_want_read(socket->framing) && !socket->has_failed && !is_full(socket);
}

static void check_deadlines(struct websocket *socket, int64_t now)
{
    const struct websocket_desc *desc = &socket->loop->desc;
    if (socket->is_closing) {
        socket->is_broken |= now - socket->closing_ms > GOODBYE_MS;
        return;
    }
    if (wslay_event_want_write(socket->framing) && now - socket->progress_ms > desc->progress_ms)
        socket->is_broken = true;
    else if (now - socket->heard_ms > desc->answer_ms)
        websocket_close(socket, WSLAY_CODE_POLICY_VIOLATION, "no answer to pings");
    if (now - socket->pinged_ms > desc->ping_ms && websocket_is_idle(socket)) {
        socket->pinged_ms = now;
        queue(socket, WSLAY_PING, NULL, 0);
    }
}

/* wslay gives up on some malformed frames without a close code: say it in its place, when it is not
 * in the middle of another frame. */
static void fail(struct websocket *socket, bool was_idle)
{
    static const unsigned char close_1002[] = {0x88, 2, 1002 >> 8, 1002 & 0xff};
    if (socket->is_broken || !was_idle ||
        send(socket->fd, close_1002, sizeof close_1002, MSG_NOSIGNAL) != sizeof close_1002) {
        socket->is_broken = true;
        return;
    }
    socket->has_failed = socket->is_closing = true;
    socket->closing_ms = now_ms();
}

/* Reads and drops bytes until the client has closed, too: closing with unread bytes could cost it
 * our close frame. */
static void throw_away(struct websocket *socket)
{
    char ignored[4096];
    ssize_t count = recv(socket->fd, ignored, sizeof ignored, 0);
    socket->is_broken |= count == 0 || (count < 0 && errno != EAGAIN && errno != EINTR);
}

static void socket_turn(struct websocket *socket, short events, int64_t now)
{
    if (socket->has_failed) {
        throw_away(socket);
        check_deadlines(socket, now);
        return;
    }
    bool was_idle = websocket_is_idle(socket);
    bool can_read =
        (events & (POLLIN | POLLHUP | POLLERR)) || socket->extra_used < socket->extra_bytes;
    if (can_read && wants_read(socket) && wslay_event_recv(socket->framing) != 0) {
        fail(socket, was_idle);
        return;
    }
    bool is_idle = websocket_is_idle(socket);
    if ((atomic_exchange(&socket->is_poked, false) || (is_idle && !socket->was_idle)) &&
        !socket->is_closing && !socket->is_broken)
        socket->session.turn(socket->session.context);
    socket->was_idle = is_idle && websocket_is_idle(socket);
    check_deadlines(socket, now);
    if (!socket->is_broken && wslay_event_want_write(socket->framing) &&
        wslay_event_send(socket->framing) != 0)
        socket->is_broken = true;
    if (wslay_event_want_read(socket->framing) || wslay_event_want_write(socket->framing))
        return;
    if (!socket->is_closing)
        socket->closing_ms = now;
    socket->is_closing = true;
    if (wslay_event_get_close_received(socket->framing))
        socket->is_broken = true; /* the closing handshake is done */
    socket->has_failed = true;
}

/* ---- the loop ---- */

static void take_added(struct websocket_loop *loop)
{
    pthread_mutex_lock(&loop->mutex);
    struct websocket *added = loop->added;
    loop->added = NULL;
    pthread_mutex_unlock(&loop->mutex);
    for (struct websocket *next; added; added = next) {
        next = added->next;
        if (!socket_begin(added)) {
            socket_destroy(added);
            continue;
        }
        added->next = loop->first;
        loop->first = added;
        loop->count++;
    }
}

static void remove_broken(struct websocket_loop *loop)
{
    for (struct websocket **at = &loop->first; *at;) {
        struct websocket *socket = *at;
        if (!socket->is_broken) {
            at = &socket->next;
            continue;
        }
        *at = socket->next;
        loop->count--;
        socket_destroy(socket);
    }
}

/* Waits for any socket or a wake, then gives each its turn. False without memory. */
static bool turn_all(struct websocket_loop *loop, int timeout_ms)
{
    struct pollfd *fds = calloc(loop->count + 1, sizeof *fds);
    size_t i = 1;
    if (!fds)
        return false;
    fds[0] = (struct pollfd){.fd = loop->wake_fd, .events = POLLIN};
    for (const struct websocket *socket = loop->first; socket; socket = socket->next, i++)
        fds[i] = (struct pollfd){
            .fd = socket->fd,
            .events = socket->has_failed ? POLLIN
                                         : (short)((wants_read(socket) ? POLLIN : 0) |
                                                   (websocket_is_idle(socket) ? 0 : POLLOUT))};
    eventfd_t ignored;
    if (poll(fds, loop->count + 1, timeout_ms) > 0 && fds[0].revents)
        eventfd_read(loop->wake_fd, &ignored);
    int64_t now = now_ms();
    i = 1;
    for (struct websocket *socket = loop->first; socket; socket = socket->next, i++) {
        bool is_dead = (fds[i].revents & (POLLHUP | POLLERR)) && !(fds[i].revents & POLLIN);
        socket->is_broken |= is_dead;
        if (!socket->is_broken)
            socket_turn(socket, fds[i].revents, now);
    }
    free(fds);
    remove_broken(loop);
    return true;
}

static void say_goodbye(struct websocket_loop *loop)
{
    for (struct websocket *socket = loop->first; socket; socket = socket->next)
        websocket_close(socket, WSLAY_CODE_GOING_AWAY, "the server is stopping");
    int64_t until = now_ms() + LAST_WORDS_MS;
    while (loop->first && now_ms() < until && turn_all(loop, 20))
        continue;
    for (struct websocket *socket = loop->first; socket; socket = socket->next)
        socket->is_broken = true;
    remove_broken(loop);
}

static void *loop_run(void *argument)
{
    struct websocket_loop *loop = argument;
    for (;;) {
        pthread_mutex_lock(&loop->mutex);
        bool is_stopping = loop->is_stopping;
        pthread_mutex_unlock(&loop->mutex);
        take_added(loop);
        if (is_stopping)
            break;
        if (!turn_all(loop, TICK_MS))
            nanosleep(&(struct timespec){.tv_nsec = TICK_MS * 1000000}, NULL);
    }
    say_goodbye(loop);
    return NULL;
}

void websocket_loop_add(struct websocket_loop *loop, int fd, const char *extra, size_t extra_bytes,
                        struct http_upgrade *upgrade, const struct websocket_session *session)
{
    struct websocket *socket = calloc(1, sizeof *socket);
    char *copy = extra_bytes ? malloc(extra_bytes) : NULL;
    bool is_good = socket && (copy || !extra_bytes);
    if (is_good) {
        *socket = (struct websocket){
            .loop = loop, .fd = fd, .upgrade = upgrade, .session = *session, .extra = copy};
        socket->extra_bytes = extra_bytes;
        if (extra_bytes)
            memcpy(copy, extra, extra_bytes);
        pthread_mutex_lock(&loop->mutex);
        is_good = !loop->is_stopping;
        if (is_good) {
            socket->next = loop->added;
            loop->added = socket;
        }
        pthread_mutex_unlock(&loop->mutex);
    }
    if (is_good) {
        wake(loop);
        return;
    }
    free(copy);
    free(socket);
    session->close(session->context);
    http_upgrade_end(upgrade);
}

/* ---- life ---- */

static int or_default(int value, int otherwise)
{
    return value ? value : otherwise;
}

struct websocket_loop *websocket_loop_create(const struct websocket_desc *desc, struct error *err)
{
    struct websocket_loop *loop = calloc(1, sizeof *loop);
    if (!loop) {
        error_set(err, ERROR_NO_MEMORY, "sockets");
        return NULL;
    }
    loop->desc = (struct websocket_desc){.ping_ms = or_default(desc->ping_ms, 20000),
                                         .answer_ms = or_default(desc->answer_ms, 60000),
                                         .progress_ms = or_default(desc->progress_ms, 30000),
                                         .max_text_bytes = desc->max_text_bytes};
    pthread_mutex_init(&loop->mutex, NULL);
    loop->wake_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (loop->wake_fd >= 0)
        loop->has_thread = pthread_create(&loop->thread, NULL, loop_run, loop) == 0;
    if (loop->has_thread)
        return loop;
    error_set(err, ERROR_INTERNAL, "sockets: %s", strerror(errno));
    websocket_loop_destroy(loop);
    return NULL;
}

void websocket_loop_stop(struct websocket_loop *loop)
{
    if (!loop || !loop->has_thread)
        return;
    pthread_mutex_lock(&loop->mutex);
    loop->is_stopping = true;
    pthread_mutex_unlock(&loop->mutex);
    wake(loop);
    pthread_join(loop->thread, NULL);
    loop->has_thread = false;
}

void websocket_loop_destroy(struct websocket_loop *loop)
{
    if (!loop)
        return;
    websocket_loop_stop(loop);
    if (loop->wake_fd >= 0)
        close(loop->wake_fd);
    pthread_mutex_destroy(&loop->mutex);
    free(loop);
}
