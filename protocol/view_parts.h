/* SPDX-License-Identifier: MIT */
/* What a view's document is made of: the member `stream`, and patches of its lights by their
 * index. Internal to the documents of views. */
#ifndef VITRAIL_PROTOCOL_VIEW_PARTS_H
#define VITRAIL_PROTOCOL_VIEW_PARTS_H

#include "protocol/json_read.h"
#include "protocol/view_document.h"

struct view_stream view_stream_default(void);

/* Changes what the node names; a null takes a member back to its default. */
MUST_CHECK bool view_stream_read(const struct json_node *node, struct view_stream *stream);
json_t *view_stream_to_json(const struct view_stream *stream); /* new reference; NULL: no memory */

/* What target becomes under a merge patch (RFC 7396), but that a null stays: the parser of requests
 * reads it as absent, and knows whether there is such a member at all. A new reference, NULL
 * without memory. target may be NULL. */
MUST_CHECK json_t *view_merge(const json_t *target, json_t *patch);

/* A patch of the lights by index: an object whose members are called "0", "1" ... as the lights
 * stand before it. Each is merged into its light, or, where it says a `type`, takes its place; null
 * takes one out, after all else; those behind the last are new. */

/* The lights that it changes or adds, as they would become, in the order in which it names them. A
 * new reference; NULL: refused. */
MUST_CHECK json_t *view_lights_touched(const json_t *lights, const struct json_node *patch);

/* The error is of the array that view_lights_touched made: points it into the patch instead. */
void view_lights_point(const json_t *patch, struct error *err);

/* Puts them into the array of all, and takes out what goes. canonical: the touched ones. */
void view_lights_install(json_t *lights, const json_t *canonical, json_t *patch);

#endif
