/* SPDX-License-Identifier: MIT */
/* Any bytes after the handshake of a WebSocket: the session hears whole messages of UTF-8 within
 * the limit, what the client gets are well-formed frames, and the connection ends.
 *
 * Input: a byte that says how much of the rest came with the handshake, and what the client sends.
 * This file takes the place of the HTTP library, whose only part is to close the connection. */
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "protocol/utf8.h"
#include "server/http/websocket.h"
#include "tests/fuzz/expect.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { TEXT_BYTES_MAX = 4096, HEARD_BYTES_MAX = 1 << 20, END_MS = 8000 };

struct http_upgrade {
    int fd;
};

/* One connection. Everything but `socket` is used on the loop's thread. */
struct session {
    struct websocket *socket;
    struct http_upgrade upgrade;
    int turns;
};

void http_upgrade_end(struct http_upgrade *upgrade)
{
    close(upgrade->fd); /* the client sees the end */
    free(upgrade);
}

static void opened(void *context, struct websocket *socket)
{
    struct session *session = context;
    session->socket = socket;
    websocket_poke(socket);
}

static void heard(void *context, const char *text, size_t length)
{
    struct session *session = context;
    char *copy = calloc(length + 1, 1);
    expect(length <= TEXT_BYTES_MAX && copy);
    if (length > 0) /* text is NULL otherwise */
        memcpy(copy, text, length);
    for (size_t at = 0, bytes; at < length; at += bytes) {
        bytes = copy[at] ? utf8_sequence_bytes(copy + at) : 1; /* U+0000 is a character, too */
        expect(bytes > 0 && at + bytes <= length);
    }
    if (length > 0 && text[0] == 'q')
        websocket_close(session->socket, 1000, "as you wish");
    else if (length > 0 && text[0] == 'b')
        websocket_send_binary(session->socket, text, length);
    else
        websocket_send_text(session->socket, text, length);
    free(copy);
}

static void turn(void *context)
{
    struct session *session = context;
    expect(++session->turns < 1 << 20);
}

static void closed(void *context)
{
    free(context);
}

/* What the server says are whole frames: not masked, not in pieces, of known kinds. The last may be
 * cut: the client has ended the connection, which the server may notice in the middle of it. */
static void expect_frames(const uint8_t *bytes, size_t size)
{
    for (size_t at = 0; at < size;) {
        if (size - at < 2)
            return;
        unsigned first = bytes[at], length = bytes[at + 1];
        size_t head = length == 127 ? 10 : length == 126 ? 4 : 2, payload = length;
        unsigned opcode = first & 15;
        expect((first & 0xf0) == 0x80 && length < 128);
        expect(opcode == 1 || opcode == 2 || (opcode >= 8 && opcode <= 10 && length < 126));
        if (size - at < head)
            return;
        if (head > 2) {
            payload = 0;
            for (size_t i = 2; i < head; i++)
                payload = payload << 8 | bytes[at + i];
        }
        expect(payload <= TEXT_BYTES_MAX);
        at += head + payload;
    }
}

/* Sends all and says so, while reading to the end. */
static size_t converse(int peer, const uint8_t *bytes, size_t size, uint8_t *answer)
{
    size_t sent = 0, received = 0;
    bool has_ended = size == 0;
    if (has_ended)
        shutdown(peer, SHUT_WR);
    for (;;) {
        struct pollfd fd = {.fd = peer, .events = (short)(POLLIN | (has_ended ? 0 : POLLOUT))};
        expect(poll(&fd, 1, END_MS) > 0);
        if (!has_ended && fd.revents & (POLLOUT | POLLERR)) {
            ssize_t count = send(peer, bytes + sent, size - sent, MSG_NOSIGNAL);
            sent += count > 0 ? (size_t)count : 0;
            has_ended = sent == size || (count < 0 && errno != EAGAIN);
            if (has_ended)
                shutdown(peer, SHUT_WR);
        }
        if (!(fd.revents & (POLLIN | POLLHUP)))
            continue;
        expect(received < HEARD_BYTES_MAX);
        ssize_t count = recv(peer, answer + received, HEARD_BYTES_MAX - received, 0);
        if (count == 0 || (count < 0 && errno == ECONNRESET))
            return received;
        expect(count > 0 || errno == EAGAIN);
        received += count > 0 ? (size_t)count : 0;
    }
}

/* Lives as long as the process: a thread for each input would be most of the work. */
static struct websocket_loop *get_loop(void)
{
    static struct websocket_loop *loop;
    struct error err = {0};
    if (!loop)
        loop =
            websocket_loop_create(&(struct websocket_desc){.max_text_bytes = TEXT_BYTES_MAX}, &err);
    expect(loop != NULL);
    return loop;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    int fds[2];
    struct session *session = calloc(1, sizeof *session);
    struct http_upgrade *upgrade = calloc(1, sizeof *upgrade);
    uint8_t *answer = malloc(HEARD_BYTES_MAX);
    size_t rest = size > 0 ? size - 1 : 0, extra = rest > 0 ? data[0] % (rest + 1) : 0;
    expect(session && upgrade && answer);
    expect(socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, fds) == 0);
    upgrade->fd = fds[1];
    websocket_loop_add(
        get_loop(), fds[1], (const char *)data + 1, extra, upgrade,
        &(struct websocket_session){
            .context = session, .open = opened, .text = heard, .turn = turn, .close = closed});
    size_t received = converse(fds[0], data + 1 + extra, rest - extra, answer);
    expect_frames(answer, received);
    close(fds[0]);
    free(answer);
    return 0;
}
