/* SPDX-License-Identifier: MIT */
/* Fuzz target: whatever a client writes into its head fields, they are judged without harm.
 *
 * Input: lines "Name: value"; Accept and If-None-Match are negotiated, the others are checked. */
#include <assert.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "server/http/http_rules.h"
#include "server/http/negotiate.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void negotiate(const char *value)
{
    struct error err = {0};
    enum image_format format = IMAGE_FORMAT_COUNT;
    for (unsigned allowed = 1; allowed < 1u << IMAGE_FORMAT_COUNT; allowed++) {
        err = (struct error){0};
        bool is_good = negotiate_format(value, allowed, &format, &err);
        assert(is_good == (err.code == ERROR_NONE));
        assert(!is_good || (allowed & 1u << format));
    }
    negotiate_tag_matches(value, "\"0123\"");
    negotiate_is_type(value, "multipart/form-data");
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const struct http_policy policy = {true, "127.0.0.1", "a.example, b.example",
                                       "https://a.example"};
    struct http_head head = {.is_change = size & 1, .is_http_1_0 = size & 2};
    struct error err = {0};
    char *text = malloc(size + 1), *at = text;
    assert(text);
    memcpy(text, data, size);
    text[size] = '\0';
    for (char *line; (line = strsep(&at, "\n"));) {
        char *value = strchr(line, ':');
        if (!value)
            continue;
        *value++ = '\0';
        value += strspn(value, " ");
        http_head_add(&head, line, value);
        negotiate(value);
    }
    if (http_head_check(&head, &policy, &err)) {
        assert(head.length_count + head.encoding_count <= 1 && head.host_count <= 1);
        uint64_t bytes = http_head_body_bytes(&head);
        assert(head.encoding_count ? bytes == UINT64_MAX : bytes < 1000000000000000000u);
    } else {
        assert((err.code == ERROR_INVALID_REQUEST || err.code == ERROR_UNSUPPORTED_MEDIA_TYPE) &&
               err.message[0]);
    }
    free(text);
    return 0;
}
