/* SPDX-License-Identifier: MIT */
/* Watches over open connections, beside libmicrohttpd: deadlines of heads, a least rate of bodies
 * and replies, and clients that leave while they are made to wait. Thread: any; owns one thread.
 *
 * libmicrohttpd 0.9.75 has an idle timeout only, which a byte now and then resets, and does not
 * look at suspended connections at all. */
#ifndef VITRAIL_SERVER_HTTP_HTTP_WATCH_H
#define VITRAIL_SERVER_HTTP_HTTP_WATCH_H

#include <stdint.h>

#include "protocol/error.h"

struct http_watch_desc {
    int head_ms;     /* from connecting to the end of the first head; 0 means 10,000 */
    int idle_ms;     /* from one reply to the end of the next head; 0 means 60,000 */
    int patience_ms; /* a body or reply may take this long whatever its size; 0 means 30,000 */
    int least_bytes_per_s; /* beyond that; 0 means 16,384 */
};

struct http_watch;
struct http_watched; /* one connection */

struct http_watch *http_watch_create(const struct http_watch_desc *desc, struct error *err);
void http_watch_destroy(struct http_watch *watch); /* accepts NULL; without connections left */

/* NULL if memory runs out. The descriptor stays the caller's and must be open until the removal. */
struct http_watched *http_watch_add(struct http_watch *watch, int fd);
void http_watch_remove(struct http_watch *watch, struct http_watched *watched); /* accepts NULL */

/* Note what the connection does now. All accept a NULL connection. */
void http_watch_expect_head(struct http_watch *watch, struct http_watched *watched);
void http_watch_expect_body(struct http_watch *watch, struct http_watched *watched);
void http_watch_count_body(struct http_watch *watch, struct http_watched *watched, uint64_t bytes);
void http_watch_expect_reply(struct http_watch *watch, struct http_watched *watched,
                             uint64_t bytes);

/* While the connection waits, on_gone(context, ticket) is called once, on the watch's thread, if
 * the client leaves. It may come late: a ticket that means nothing any more must do no harm. */
void http_watch_wait(struct http_watch *watch, struct http_watched *watched,
                     void (*on_gone)(void *context, uint64_t ticket), void *context,
                     uint64_t ticket);

#endif
