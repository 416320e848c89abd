/* SPDX-License-Identifier: MIT */
/* Errors on the wire: application/problem+json (RFC 9457) to and from struct error. Thread: any. */
#ifndef VITRAIL_PROTOCOL_PROBLEM_H
#define VITRAIL_PROTOCOL_PROBLEM_H

#include <stddef.h>

#include "protocol/error.h"

#define PROBLEM_MEDIA_TYPE "application/problem+json"

/* {"type","title","status","code","detail","pointer"?,"request_id"?}; request_id may be NULL.
 * malloc'ed, caller frees; NULL only when memory runs out. */
MUST_CHECK char *problem_to_json(const struct error *err, const char *request_id);

#endif
