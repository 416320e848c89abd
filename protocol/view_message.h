/* SPDX-License-Identifier: MIT */
/* What a client says over the socket of a view, and what it is answered. Thread: any. The manual
 * for clients is docs/reference/views.md. */
#ifndef VITRAIL_PROTOCOL_VIEW_MESSAGE_H
#define VITRAIL_PROTOCOL_VIEW_MESSAGE_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"

enum view_message_kind {
    VIEW_MESSAGE_CAMERA,
    VIEW_MESSAGE_PATCH,
    VIEW_MESSAGE_QUALITY,
    VIEW_MESSAGE_ACK,
    VIEW_MESSAGE_PING
};

enum { VIEW_CREDIT_FIRST = 2, VIEW_CREDIT_MAX = 8 };

/* Zeroed = none; owns its JSON. */
struct view_message {
    enum view_message_kind kind;
    json_t *id;        /* as given, or NULL */
    bool has_seq;      /* CAMERA */
    uint64_t seq;      /* at most 2^53 - 1 */
    uint64_t revision; /* PATCH: the one it is for; 0 = any */
    json_t *patch;     /* CAMERA, PATCH, QUALITY: a merge patch of the view */
    int count;         /* ACK: [1, VIEW_CREDIT_MAX] */
};

/* On failure only the id is set, as far as it could be read. */
MUST_CHECK bool view_message_parse(const char *text, size_t length, struct view_message *message,
                                   struct error *err);
void view_message_finish(struct view_message *message); /* accepts zeroed; zeroes */

#endif
