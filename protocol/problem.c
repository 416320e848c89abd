/* SPDX-License-Identifier: MIT */
/* Problem documents for replies. */
#include "protocol/problem.h"

#include <stdio.h>

#include "protocol/json_write.h"

#define TYPE_PREFIX "urn:vitrail:problem:"

char *problem_to_json(const struct error *err, const char *request_id)
{
    char type[96];
    snprintf(type, sizeof type, TYPE_PREFIX "%s", error_code_name(err->code));
    struct json_writer writer = json_writer_begin();
    json_put_text(&writer, "type", type);
    json_put_text(&writer, "title", error_code_title(err->code));
    json_put(&writer, "status", json_integer(error_code_http_status(err->code)));
    json_put_text(&writer, "code", error_code_name(err->code));
    json_put_text(&writer, "detail", err->message);
    if (err->pointer[0])
        json_put_text(&writer, "pointer", err->pointer);
    if (request_id)
        json_put_text(&writer, "request_id", request_id);
    return json_take_dump(json_writer_take(&writer), JSON_COMPACT);
}
