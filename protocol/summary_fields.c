/* SPDX-License-Identifier: MIT */
/* Lists of names, sizes and times as JSON, both ways. */
#include "protocol/summary_fields.h"

#include <time.h>

#include "protocol/json_write.h"

json_t *summary_write_names(const struct name_list *list)
{
    json_t *array = json_array();
    bool has_failed = !array;
    for (size_t i = 0; i < list->count; i++)
        json_append(array, json_text(list->names[i]), &has_failed);
    return json_take_unless(array, has_failed);
}

json_t *summary_write_bytes(uint64_t upload, uint64_t decoded)
{
    struct json_writer writer = json_writer_begin();
    json_put_integer(&writer, "upload", upload);
    json_put_integer(&writer, "decoded", decoded);
    return json_writer_take(&writer);
}

bool summary_read_string(const struct json_node *node, const char **text)
{
    if (!json_is_string(node->value))
        return json_refuse(node, ERROR_INVALID_REQUEST, "must be a string");
    *text = json_string_value(node->value);
    return true;
}

bool summary_read_names(const struct json_node *node, struct name_list *list)
{
    size_t count;
    if (!json_expect_array(node, SCENE_SUMMARY_NAMES_MAX, &count))
        return false;
    for (size_t i = 0; i < count; i++) {
        struct json_node element = json_element(node, i);
        const char *name = "";
        if (!summary_read_string(&element, &name) || !name_list_add(list, name, node->err))
            return false;
    }
    return true;
}

bool summary_read_created(const struct json_node *node, int64_t *unix_s)
{
    if (!node->value)
        return true;
    const char *text = "";
    struct tm utc = {0};
    if (!summary_read_string(node, &text))
        return false;
    const char *end = strptime(text, "%Y-%m-%dT%H:%M:%SZ", &utc);
    if (!end || *end)
        return json_refuse(node, ERROR_INVALID_REQUEST, "must be like 2026-01-31T12:00:00Z");
    *unix_s = timegm(&utc);
    return true;
}
