/* SPDX-License-Identifier: MIT */
/* Lobes of materials as JSON. Thread: any. */
#ifndef VITRAIL_PROTOCOL_LOBE_MEMBERS_JSON_H
#define VITRAIL_PROTOCOL_LOBE_MEMBERS_JSON_H

#include "protocol/json_read.h"
#include "protocol/json_write.h"
#include "protocol/lobe_members.h"

/* Those of an object that has them, among others. ERROR_INVALID_REQUEST names the member. */
MUST_CHECK bool lobe_members_read(const struct json_node *object, struct lobe_members *lobes);
void lobe_members_write(const struct lobe_members *lobes, struct json_writer *writer);

#endif
