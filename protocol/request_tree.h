/* SPDX-License-Identifier: MIT */
/* A render request as a tree of JSON, for those who hold, change or compare it so. New references;
 * NULL: no memory. Thread: any. */
#ifndef VITRAIL_PROTOCOL_REQUEST_TREE_H
#define VITRAIL_PROTOCOL_REQUEST_TREE_H

#include <jansson.h>

#include "protocol/render_request.h"

/* The canonical members, in the order of render_request_to_json. */
MUST_CHECK json_t *request_to_tree(const struct render_request *request);
MUST_CHECK json_t *request_quality_to_tree(const struct request_quality *quality);

/* A text that is equal for two requests, or views, where a trade-off of one measures the other:
 * what it varies, and what its reference does not depend on, is left at one value. members:
 * canonical, borrowed; quality: theirs. malloc'ed; NULL: no memory. */
MUST_CHECK char *request_reference_text(json_t *members, const struct request_quality *quality);
/* Likewise of a struct render_request, in the form of a callback. */
MUST_CHECK char *request_reference_text_of(const void *request);

#endif
