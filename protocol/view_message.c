/* SPDX-License-Identifier: MIT */
/* Reading the messages of a view's socket. */
#include "protocol/view_message.h"

#include <string.h>

#include "protocol/json_read.h"
#include "protocol/limits.h"

static const uint64_t SEQ_MAX = (1ull << 53) - 1; /* what JavaScript counts to */

static const char *kind_name(int kind)
{
    static const char *const names[] = {"camera", "patch", "quality", "ack", "ping"};
    return kind >= 0 && kind < 5 ? names[kind] : NULL;
}

static bool read_patch_of(struct view_message *message, const char *member, json_t *value,
                          struct error *err)
{
    message->patch = json_pack("{s:O}", member, value);
    return message->patch || error_set(err, ERROR_NO_MEMORY, "message");
}

static bool read_camera(const struct json_node *root, struct view_message *message)
{
    static const char *const known[] = {"type", "id", "seq", "camera", NULL};
    struct json_node seq = json_member(root, "seq"), camera = json_member(root, "camera");
    if (!json_expect_object(root, known) || !json_expect_present(&camera) ||
        !json_expect_object(&camera, NULL) || !json_read_uint64(&seq, &message->seq))
        return false;
    if (message->seq > SEQ_MAX)
        return json_refuse(&seq, ERROR_INVALID_REQUEST, "must be less than 2^53");
    message->has_seq = seq.value;
    return read_patch_of(message, "camera", camera.value, root->err);
}

static bool read_patch(const struct json_node *root, struct view_message *message)
{
    static const char *const known[] = {"type", "id", "revision", "patch", NULL};
    struct json_node revision = json_member(root, "revision"), patch = json_member(root, "patch");
    if (!json_expect_object(root, known) || !json_expect_present(&patch) ||
        !json_expect_object(&patch, NULL) || !json_read_uint64(&revision, &message->revision))
        return false;
    message->patch = json_incref(patch.value);
    return true;
}

/* All members but the type and the id are those of `stream`. */
static bool read_quality(const struct json_node *root, struct view_message *message)
{
    json_t *stream = json_copy(root->value);
    json_object_del(stream, "type");
    json_object_del(stream, "id");
    bool is_good = stream ? read_patch_of(message, "stream", stream, root->err)
                          : error_set(root->err, ERROR_NO_MEMORY, "message");
    json_decref(stream);
    return is_good;
}

static bool read_ack(const struct json_node *root, struct view_message *message)
{
    static const char *const known[] = {"type", "id", "count", NULL};
    struct json_node count = json_member(root, "count");
    message->count = 1;
    return json_expect_object(root, known) &&
           json_read_int(&count, 1, VIEW_CREDIT_MAX, &message->count);
}

static bool read_message(const struct json_node *root, struct view_message *message)
{
    static const char *const known[] = {"type", "id", NULL};
    const struct json_choice kinds = {.name = kind_name};
    if (!json_expect_object(root, NULL))
        return false;
    struct json_node type = json_member(root, "type"), id = json_member(root, "id");
    int kind = 0;
    if (id.value && !json_is_number(id.value) && !json_is_string(id.value))
        return json_refuse(&id, ERROR_INVALID_REQUEST, "must be a number or a string");
    message->id = json_incref(id.value);
    if (!json_expect_present(&type) || !json_read_choice(&type, &kinds, &kind))
        return false;
    message->kind = (enum view_message_kind)kind;
    switch (message->kind) {
    case VIEW_MESSAGE_CAMERA:
        return read_camera(root, message);
    case VIEW_MESSAGE_PATCH:
        return read_patch(root, message);
    case VIEW_MESSAGE_QUALITY:
        return read_quality(root, message);
    case VIEW_MESSAGE_ACK:
        return read_ack(root, message);
    case VIEW_MESSAGE_PING:
        break;
    }
    return json_expect_object(root, known);
}

bool view_message_parse(const char *text, size_t length, struct view_message *message,
                        struct error *err)
{
    *message = (struct view_message){0};
    json_t *json = json_load_checked(text, length, LIMIT_SOCKET_MESSAGE_BYTES, err);
    if (!json)
        return false;
    struct json_node root = json_root(json, err);
    bool is_good = read_message(&root, message);
    json_decref(json);
    return is_good;
}

void view_message_finish(struct view_message *message)
{
    json_decref(message->id);
    json_decref(message->patch);
    *message = (struct view_message){0};
}
