/* SPDX-License-Identifier: MIT */
/* Any texts over a view's socket: a message is refused with a complete error and the view stays as
 * it was, or it is applied and the view is still one that can be read back and rendered.
 *
 * Input: one message a line. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/render_request.h"
#include "protocol/view_document.h"
#include "protocol/view_message.h"
#include "tests/fuzz/expect.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static struct view_document *make_view(void)
{
    static const char body[] =
        "{\"scene\":\"0000000000000000000000000000000000000000000000000000000000000000\","
        "\"width\":64,\"height\":32,\"camera\":{\"fit\":\"iso\"}}";
    struct error err = {0};
    struct view_document *document = view_document_create(body, sizeof body - 1, &err);
    expect(document != NULL);
    return document;
}

static char *text_of(const struct view_document *document)
{
    json_t *json = view_document_to_json(document);
    char *text = json ? json_dumps(json, JSON_SORT_KEYS | JSON_COMPACT) : NULL;
    json_decref(json);
    expect(text != NULL);
    return text;
}

/* Both pictures of the view are requests, and its bytes are counted. */
static void expect_sound(const struct view_document *document)
{
    char *text = text_of(document);
    expect(view_document_bytes(document) >= strlen(text) / 4);
    free(text);
    for (int moving = 0; moving < 2; moving++) {
        const struct view_frame_desc shot = {
            .format = REQUEST_FORMAT_PNG, .scale = moving ? 0.1 : 1, .is_moving = moving};
        struct render_request request;
        struct error err = {0};
        int width = 0, height = 0;
        char *asked = view_document_frame(document, &shot, &width, &height);
        expect(asked && width >= 1 && height >= 1);
        expect(render_request_parse(asked, strlen(asked), &request, &err));
        render_request_finish(&request);
        free(asked);
    }
}

static void apply(struct view_document *document, const struct view_message *message)
{
    struct error err = {0};
    char *before = text_of(document);
    bool is_good = view_document_patch(
        document,
        &(struct view_patch){.json = message->patch,
                             .replaces_camera = message->kind == VIEW_MESSAGE_CAMERA},
        &err);
    if (is_good) {
        expect(err.code == ERROR_NONE);
        expect_sound(document);
    } else {
        char *after = text_of(document);
        expect_complete(&err);
        expect(strcmp(before, after) == 0);
        free(after);
    }
    free(before);
}

static void hear(struct view_document *document, const char *text, size_t length)
{
    struct view_message message;
    struct error err = {0};
    if (!view_message_parse(text, length, &message, &err)) {
        expect_complete(&err);
    } else if (message.kind == VIEW_MESSAGE_ACK) {
        expect(message.count >= 1 && message.count <= VIEW_CREDIT_MAX);
    } else if (message.kind != VIEW_MESSAGE_PING) {
        expect(message.patch != NULL);
        apply(document, &message);
    }
    view_message_finish(&message);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct view_document *document = make_view();
    const char *at = (const char *)data, *end = at + size;
    while (at < end) {
        const char *line = memchr(at, '\n', (size_t)(end - at));
        size_t length = (size_t)((line ? line : end) - at);
        hear(document, at, length);
        at += length + 1;
    }
    view_document_destroy(document);
    return 0;
}
