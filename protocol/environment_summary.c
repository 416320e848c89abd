/* SPDX-License-Identifier: MIT */
/* Summaries of environment maps as JSON, both ways. */
#include "protocol/environment_summary.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/json_write.h"
#include "protocol/summary_fields.h"

enum { SUMMARY_JSON_BYTES_MAX = 1 << 20 };

void environment_summary_finish(struct environment_summary *summary)
{
    free(summary->name);
    name_list_finish(&summary->warnings);
    *summary = (struct environment_summary){0};
}

static json_t *write_size(uint64_t width, uint64_t height)
{
    struct json_writer writer = json_writer_begin();
    json_put_integer(&writer, "width", width);
    json_put_integer(&writer, "height", height);
    return json_writer_take(&writer);
}

json_t *environment_summary_to_json(const struct environment_summary *summary)
{
    struct json_writer writer = json_writer_begin();
    json_put_text(&writer, "id", summary->id);
    json_put_text_or_null(&writer, "name", summary->name);
    json_put_integer(&writer, "width", summary->width);
    json_put_integer(&writer, "height", summary->height);
    json_put(&writer, "source", write_size(summary->source_width, summary->source_height));
    json_put_numbers(&writer, "mean_radiance", summary->mean_radiance, 3);
    json_put_number(&writer, "peak_radiance", summary->peak_radiance);
    json_put(&writer, "bytes", summary_write_bytes(summary->upload_bytes, summary->decoded_bytes));
    json_put(&writer, "warnings", summary_write_names(&summary->warnings));
    json_put(&writer, "created", json_time(summary->created_unix_s));
    return json_writer_take(&writer);
}

char *environment_summary_to_json_text(const struct environment_summary *summary)
{
    return json_take_dump(environment_summary_to_json(summary),
                          JSON_COMPACT | JSON_REAL_PRECISION(17));
}

static bool read_size(const struct json_node *node, uint64_t *width, uint64_t *height)
{
    struct json_node first = json_member(node, "width"), second = json_member(node, "height");
    return json_read_uint64(&first, width) && json_read_uint64(&second, height);
}

static bool read_summary(const struct json_node *root, struct environment_summary *summary)
{
    if (!json_expect_object(root, NULL))
        return false;
    struct json_node id = json_member(root, "id"), name = json_member(root, "name");
    struct json_node source = json_member(root, "source"), bytes = json_member(root, "bytes");
    struct json_node mean = json_member(root, "mean_radiance");
    struct json_node peak = json_member(root, "peak_radiance");
    struct json_node upload = json_member(&bytes, "upload");
    struct json_node decoded = json_member(&bytes, "decoded");
    struct json_node warnings = json_member(root, "warnings");
    struct json_node created = json_member(root, "created");
    const char *text = NULL;
    if (name.value && !summary_read_string(&name, &text))
        return false;
    if (text && !(summary->name = strdup(text)))
        return error_set(root->err, ERROR_NO_MEMORY, "name of an environment map");
    return json_read_text(&id, summary->id, sizeof summary->id) &&
           read_size(root, &summary->width, &summary->height) &&
           read_size(&source, &summary->source_width, &summary->source_height) &&
           json_read_numbers(&mean, 3, 0, DBL_MAX, summary->mean_radiance) &&
           json_read_number(&peak, 0, DBL_MAX, &summary->peak_radiance) &&
           json_read_uint64(&upload, &summary->upload_bytes) &&
           json_read_uint64(&decoded, &summary->decoded_bytes) &&
           summary_read_names(&warnings, &summary->warnings) &&
           summary_read_created(&created, &summary->created_unix_s);
}

bool environment_summary_from_json_text(const char *json, size_t length,
                                        struct environment_summary *summary, struct error *err)
{
    *summary = (struct environment_summary){0};
    json_t *value = json_load_checked(json, length, SUMMARY_JSON_BYTES_MAX, err);
    struct json_node root = json_root(value, err);
    bool is_read = value && read_summary(&root, summary);
    json_decref(value);
    if (!is_read)
        environment_summary_finish(summary);
    return is_read;
}
