/* SPDX-License-Identifier: MIT */
/* WebSockets (RFC 6455) over connections that left HTTP; the only home of wslay. Owns one thread,
 * on which all sessions run: they must not wait.
 *
 * A client that sends what it may not gets a close code that says so, and is left: 1002 malformed
 * frames, 1003 binary, 1007 not UTF-8, 1009 too long, 1008 no answer to pings. One that reads
 * nothing is left without words. What may queue for one client is bounded, and while its queue is
 * long nothing is read from it. */
#ifndef VITRAIL_SERVER_HTTP_WEBSOCKET_H
#define VITRAIL_SERVER_HTTP_WEBSOCKET_H

#include <stdbool.h>
#include <stddef.h>

#include "server/http/http.h"

struct websocket;

/* The callbacks of a session, all on the thread of the loop. */
struct websocket_session {
    void *context; /* required, the session's own */
    void (*open)(void *context, struct websocket *socket);
    void (*text)(void *context, const char *text, size_t length); /* one message, UTF-8 */
    void (*turn)(void *context);  /* after a poke, and whenever the queue has become empty */
    void (*close)(void *context); /* last: the socket is gone, frees the session */
};

struct websocket_loop;

struct websocket_desc {
    int ping_ms;           /* 0 means 20,000 */
    int answer_ms;         /* a client must answer within; 0 means 60,000 */
    int progress_ms;       /* a client must take some byte within; 0 means 30,000 */
    size_t max_text_bytes; /* required */
};
struct websocket_loop *websocket_loop_create(const struct websocket_desc *desc, struct error *err);
/* Ends all sessions, with close code 1001 where it can still be sent; later ones are closed at
 * once. Both accept NULL; destroy when none can be added any more. */
void websocket_loop_stop(struct websocket_loop *loop);
void websocket_loop_destroy(struct websocket_loop *loop);

/* Takes the upgraded connection. The session begins on the loop's thread, or is closed at once if
 * memory runs out. Thread: any. */
void websocket_loop_add(struct websocket_loop *loop, int fd, const char *extra, size_t extra_bytes,
                        struct http_upgrade *upgrade, const struct websocket_session *session);

/* Both copy. Without memory the connection ends. */
void websocket_send_text(struct websocket *socket, const char *text, size_t length);
void websocket_send_binary(struct websocket *socket, const void *bytes, size_t size_bytes);
bool websocket_is_idle(const struct websocket *socket); /* nothing waits to be sent */
/* reason: at most 123 bytes. */
void websocket_close(struct websocket *socket, int code, const char *reason);

void websocket_poke(struct websocket *socket); /* from any thread, while the session lives */

/* The handshake's answer to Sec-WebSocket-Key (RFC 6455, 4.2.2); false when the key is none. */
enum { WEBSOCKET_ACCEPT_BYTES = 29 };
MUST_CHECK bool websocket_accept(const char *key, char accept[WEBSOCKET_ACCEPT_BYTES]);

#endif
