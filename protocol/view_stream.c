/* SPDX-License-Identifier: MIT */
/* Reading and writing how a view's moving pictures are made. */
#include "protocol/json_write.h"
#include "protocol/view_parts.h"

struct view_stream view_stream_default(void)
{
    return (struct view_stream){
        .budget_ms = 50,
        .min_scale = 0.25,
        .format = REQUEST_FORMAT_JPEG,
        .quality_percent = 80,
        .rest_format = REQUEST_FORMAT_PNG,
        .rest_ms = 200,
    };
}

/* A member that is null, which json_member cannot tell from one that is absent. */
static bool is_taken_back(const struct json_node *node, const char *key)
{
    return json_is_null(json_object_get(node->value, key));
}

static void take_back(const struct json_node *node, struct view_stream *stream)
{
    struct view_stream normal = view_stream_default();
    if (is_taken_back(node, "budget_ms"))
        stream->budget_ms = normal.budget_ms;
    if (is_taken_back(node, "min_scale"))
        stream->min_scale = normal.min_scale;
    if (is_taken_back(node, "format"))
        stream->format = normal.format;
    if (is_taken_back(node, "quality_percent"))
        stream->quality_percent = normal.quality_percent;
    if (is_taken_back(node, "rest_format"))
        stream->rest_format = normal.rest_format;
    if (is_taken_back(node, "rest_ms"))
        stream->rest_ms = normal.rest_ms;
    if (is_taken_back(node, "rest_samples"))
        stream->rest_samples = normal.rest_samples;
}

bool view_stream_read(const struct json_node *node, struct view_stream *stream)
{
    static const char *const known[] = {"budget_ms",       "min_scale",   "format",
                                        "quality_percent", "rest_format", "rest_ms",
                                        "rest_samples",    NULL};
    const struct json_choice formats = {.name = request_format_name, .first = REQUEST_FORMAT_PNG};
    if (!node->value)
        return true;
    if (!json_expect_object(node, known))
        return false;
    take_back(node, stream);
    struct json_node budget = json_member(node, "budget_ms");
    struct json_node scale = json_member(node, "min_scale");
    struct json_node format = json_member(node, "format");
    struct json_node quality = json_member(node, "quality_percent");
    struct json_node rest_format = json_member(node, "rest_format");
    struct json_node rest_ms = json_member(node, "rest_ms");
    struct json_node rest_samples = json_member(node, "rest_samples");
    int moving = (int)stream->format, rest = (int)stream->rest_format;
    if (!json_read_number(&budget, 1, 10000, &stream->budget_ms) ||
        !json_read_number(&scale, 0.1, 1, &stream->min_scale) ||
        !json_read_choice(&format, &formats, &moving) ||
        !json_read_int(&quality, 1, 100, &stream->quality_percent) ||
        !json_read_choice(&rest_format, &formats, &rest) ||
        !json_read_int(&rest_ms, 0, 10000, &stream->rest_ms) ||
        !json_read_int(&rest_samples, 4, 16, &stream->rest_samples))
        return false;
    int samples = stream->rest_samples;
    if (samples != 0 && samples != 4 && samples != 8 && samples != 16)
        return json_refuse(&rest_samples, ERROR_INVALID_REQUEST, "must be 4, 8 or 16");
    stream->format = (enum request_format)moving;
    stream->rest_format = (enum request_format)rest;
    if (stream->format >= REQUEST_FORMAT_EXR)
        return json_refuse(&format, ERROR_INVALID_REQUEST, "must be one of: jpeg, webp, png");
    if (stream->rest_format != REQUEST_FORMAT_PNG && stream->rest_format != REQUEST_FORMAT_WEBP)
        return json_refuse(&rest_format, ERROR_INVALID_REQUEST, "must be one of: png, webp");
    return true;
}

json_t *view_stream_to_json(const struct view_stream *stream)
{
    struct json_writer writer = json_writer_begin();
    json_put_number(&writer, "budget_ms", stream->budget_ms);
    json_put_number(&writer, "min_scale", stream->min_scale);
    json_put_text(&writer, "format", request_format_name((int)stream->format));
    json_put(&writer, "quality_percent", json_integer(stream->quality_percent));
    json_put_text(&writer, "rest_format", request_format_name((int)stream->rest_format));
    json_put(&writer, "rest_ms", json_integer(stream->rest_ms));
    json_put(&writer, "rest_samples",
             stream->rest_samples ? json_integer(stream->rest_samples) : json_null());
    return json_writer_take(&writer);
}
