/* SPDX-License-Identifier: MIT */
/* What the summaries of scenes and of environment maps have in common. Used by protocol/ only.
 * Thread: any. */
#ifndef VITRAIL_PROTOCOL_SUMMARY_FIELDS_H
#define VITRAIL_PROTOCOL_SUMMARY_FIELDS_H

#include <jansson.h>

#include "protocol/json_read.h"
#include "protocol/scene_summary.h"

json_t *summary_write_names(const struct name_list *list);
json_t *summary_write_bytes(uint64_t upload, uint64_t decoded);

MUST_CHECK bool summary_read_string(const struct json_node *node, const char **text);
MUST_CHECK bool summary_read_names(const struct json_node *node, struct name_list *list);
/* A node that is absent leaves *unix_s as it is. */
MUST_CHECK bool summary_read_created(const struct json_node *node, int64_t *unix_s);

#endif
