/* SPDX-License-Identifier: MIT */
/* The reports of the newest frames, for /v1/frames/{id}. Thread: any. */
#ifndef VITRAIL_SERVER_FRONT_FRAMES_H
#define VITRAIL_SERVER_FRONT_FRAMES_H

#include <stddef.h>

#include "protocol/error.h"

enum { FRAME_ID_BYTES = 17 };

struct frames;

/* Keeps the newest `capacity` reports. */
struct frames *frames_create(size_t capacity, struct error *err);
void frames_destroy(struct frames *frames); /* accepts NULL */

/* The id is 64 random bits in hexadecimal. */
MUST_CHECK bool frames_make_id(char id[FRAME_ID_BYTES], struct error *err);

void frames_add(struct frames *frames, const char *id, char *json); /* takes json; NULL is none */
/* A malloc'ed copy; NULL with ERROR_NOT_FOUND. */
char *frames_get(struct frames *frames, const char *id, struct error *err);
size_t frames_count(struct frames *frames);

#endif
