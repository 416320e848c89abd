/* SPDX-License-Identifier: MIT */
/* A queue of the messages to the worker. A thread of its own reads them, so that the GL thread sees
 * in the middle of a frame that an urgent message waits, or that the frame is cancelled. */
#ifndef VITRAIL_SERVER_WORKER_INBOX_H
#define VITRAIL_SERVER_WORKER_INBOX_H

#include <stdint.h>

#include "server/base/ipc.h"

struct inbox;

/* Reads the socket, which it borrows, until it ends. NULL with err. */
struct inbox *inbox_create(int socket, struct error *err);
void inbox_destroy(struct inbox *inbox); /* shuts the socket down; accepts NULL */

/* The next message, which the caller finishes; waits for it. False at the end. Thread: GL. */
MUST_CHECK bool inbox_take(struct inbox *inbox, struct ipc_message *message);

/* The first urgent message that `may_take` accepts; false when there is none. Thread: GL. */
MUST_CHECK bool inbox_take_urgent(struct inbox *inbox,
                                  bool (*may_take)(void *context, const json_t *message),
                                  void *context, struct ipc_message *message);

/* Thread: any, for the two below. How many urgent messages wait, and how many ever came. */
int inbox_urgent_count(const struct inbox *inbox);
unsigned inbox_urgent_arrivals(const struct inbox *inbox);

/* Whether anything waits. Thread: any. */
bool inbox_has_messages(struct inbox *inbox);

/* Waits so long until something does, or the stream has ended; false: nothing does. Thread: GL. */
bool inbox_wait(struct inbox *inbox, int timeout_ms);

/* From now on inbox_is_cancelled speaks of this task, also where it was cancelled before. 0: of
 * none. Thread: GL. */
void inbox_set_current(struct inbox *inbox, uint64_t id);
bool inbox_is_cancelled(const struct inbox *inbox); /* Thread: any */

#endif
