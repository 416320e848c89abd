/* SPDX-License-Identifier: MIT */
/* Problem documents: writing them for replies, reading them from replies. */
#include "protocol/problem.h"

#include <stdio.h>
#include <string.h>

#include "protocol/json_read.h"
#include "protocol/json_write.h"
#include "protocol/utf8.h"

#define TYPE_PREFIX "urn:vitrail:problem:"
enum { PROBLEM_BYTES_MAX = 64 << 10 /* many times what we ever write */ };

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

bool problem_from_json(const char *json, size_t length, int http_status, struct error *err)
{
    struct error unreadable = {0};
    char code[64] = "", detail[ERROR_MESSAGE_BYTES] = "", pointer[ERROR_POINTER_BYTES] = "";
    json_t *value = json_load_checked(json, length, PROBLEM_BYTES_MAX, &unreadable);
    struct json_node root = json_root(value, &unreadable);
    struct json_node code_node = json_member(&root, "code");
    struct json_node detail_node = json_member(&root, "detail");
    struct json_node pointer_node = json_member(&root, "pointer");
    bool is_problem = value && code_node.value && json_read_text(&code_node, code, sizeof code) &&
                      json_read_text(&detail_node, detail, sizeof detail) &&
                      json_read_text(&pointer_node, pointer, sizeof pointer);
    json_decref(value);
    if (is_problem)
        return error_set_at(err, error_code_from_name(code), pointer, "%s", detail);

    /* The body need not end in a NUL. */
    size_t shown = length < sizeof detail - 1 ? length : sizeof detail - 1;
    if (shown)
        memcpy(detail, json, shown);
    detail[shown] = '\0';
    detail[utf8_prefix_bytes(detail, 160)] = '\0';
    utf8_sanitize(detail, shown < length);
    return error_set(err, ERROR_INTERNAL, "HTTP status %d%s%s", http_status, *detail ? ": " : "",
                     detail);
}
