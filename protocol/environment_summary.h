/* SPDX-License-Identifier: MIT */
/* What an environment map holds, as GET /v1/environments/{id} tells it. Thread: any. */
#ifndef VITRAIL_PROTOCOL_ENVIRONMENT_SUMMARY_H
#define VITRAIL_PROTOCOL_ENVIRONMENT_SUMMARY_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/error.h"
#include "protocol/scene_summary.h"

/* Zeroed = empty; environment_summary_finish frees everything. */
struct environment_summary {
    char id[65];
    char *name;                           /* owned; as uploaded, NULL = none */
    uint64_t width, height;               /* texels that are kept */
    uint64_t source_width, source_height; /* of the image that was uploaded */
    double mean_radiance[3];              /* over all directions [nt] */
    double peak_radiance;                 /* the greatest channel of a texel of the image [nt] */
    uint64_t upload_bytes, decoded_bytes;
    struct name_list warnings;
    int64_t created_unix_s; /* written as RFC 3339, UTC */
};

void environment_summary_finish(struct environment_summary *summary); /* accepts zeroed; zeroes */

/* A new reference, or malloc'ed text; NULL only when memory runs out. */
MUST_CHECK json_t *environment_summary_to_json(const struct environment_summary *summary);
MUST_CHECK char *environment_summary_to_json_text(const struct environment_summary *summary);

/* Reads what environment_summary_to_json writes; unknown members are passed over. On failure the
 * summary is zeroed. */
MUST_CHECK bool environment_summary_from_json_text(const char *json, size_t length,
                                                   struct environment_summary *summary,
                                                   struct error *err);

#endif
