/* SPDX-License-Identifier: MIT */
/* The member `stream` of a view. Internal to the documents of views. */
#ifndef VITRAIL_PROTOCOL_VIEW_PARTS_H
#define VITRAIL_PROTOCOL_VIEW_PARTS_H

#include "protocol/json_read.h"
#include "protocol/view_document.h"

struct view_stream view_stream_default(void);

/* Changes what the node names; a null takes a member back to its default. */
MUST_CHECK bool view_stream_read(const struct json_node *node, struct view_stream *stream);
json_t *view_stream_to_json(const struct view_stream *stream); /* new reference; NULL: no memory */

#endif
