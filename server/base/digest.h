/* SPDX-License-Identifier: MIT */
/* SHA-256 as lowercase hexadecimal digits, fed in pieces. Thread: any, one digest on one thread at
 * a time. */
#ifndef VITRAIL_SERVER_BASE_DIGEST_H
#define VITRAIL_SERVER_BASE_DIGEST_H

#include <stdbool.h>
#include <stddef.h>

#include "protocol/error.h"

enum { DIGEST_TEXT_BYTES = 65 };

struct digest;

struct digest *digest_create(struct error *err);
void digest_destroy(struct digest *digest); /* accepts NULL */
void digest_write(struct digest *digest, const void *bytes, size_t size_bytes);
/* Also makes the digest ready for the next content. */
void digest_end(struct digest *digest, char text[DIGEST_TEXT_BYTES]);

/* Of bytes that are there as a whole. */
MUST_CHECK bool digest_of(const void *bytes, size_t size_bytes, char text[DIGEST_TEXT_BYTES],
                          struct error *err);

bool digest_is_text(const char *text); /* 64 lowercase hexadecimal digits and nothing else */

#endif
