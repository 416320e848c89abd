/* SPDX-License-Identifier: MIT */
/* The text of an image's provenance. */
#include "protocol/provenance.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/json_write.h"
#include "protocol/limits.h"
#include "protocol/picture_tiles.h"
#include "protocol/provenance_file.h"
#include "protocol/request_tree.h"

/* The dump with each '<', '>' and '&' written as JSON's \u00xx: within texts is the only place that
 * has one. Takes `text`. */
static char *escape_markup(char *text)
{
    size_t found = 0;
    for (const char *at = text; at && (at = strpbrk(at, "<>&")); at++)
        found++;
    if (found == 0)
        return text;
    char *escaped = malloc(strlen(text) + 5 * found + 1), *to = escaped;
    for (const char *at = text; escaped && *at; at++)
        if (strchr("<>&", *at))
            to += sprintf(to, "\\u%04x", (unsigned)(unsigned char)*at);
        else
            *to++ = *at;
    if (escaped)
        *to = '\0';
    free(text);
    return escaped;
}

/* Takes the reference. */
static char *dump_tree(json_t *tree)
{
    return escape_markup(
        json_take_dump(tree, JSON_COMPACT | JSON_ENSURE_ASCII | JSON_REAL_PRECISION(17)));
}

static char *dump(const struct provenance_desc *desc, json_t *of_request, size_t left_out_bytes)
{
    struct json_writer writer = json_writer_begin();
    char software[64];
    snprintf(software, sizeof software, "Vitrail %s", desc->version);
    json_put_text(&writer, "software", software);
    json_put_text(&writer, "device", desc->stats->device);
    json_put_text(&writer, "scene", desc->request->scene);
    json_put(&writer, "request", of_request);
    if (left_out_bytes > 0)
        json_put_integer(&writer, "request_bytes", left_out_bytes);
    json_put(&writer, "error", frame_stats_error_to_json(desc->stats));
    return dump_tree(json_writer_take(&writer));
}

char *provenance_make(const struct provenance_desc *desc)
{
    json_t *tree = request_to_tree(desc->request);
    if (tree && desc->asked_quality)
        json_object_set(tree, "quality", desc->asked_quality);
    size_t bytes = tree ? json_dumpb(tree, NULL, 0, JSON_COMPACT | JSON_REAL_PRECISION(17)) : 0;
    bool may_fit = bytes <= PROVENANCE_TEXT_MAX;
    char *text = tree && may_fit ? dump(desc, json_incref(tree), 0) : NULL;
    if (tree && (!may_fit || (text && strlen(text) > PROVENANCE_TEXT_MAX))) {
        free(text);
        text = dump(desc, json_null(), bytes);
    }
    json_decref(tree);
    return text;
}

/* A size by which the picture is cut as it was: the upper left tile is never larger than others,
 * and smaller by one pixel at most (protocol/picture_tiles.h). */
static json_int_t side_of_tiles(const json_t *request, const char *side)
{
    const json_t *tile = json_object_get(request, "tile");
    json_int_t length = json_integer_value(json_object_get(tile, side)) + 1;
    length = length < LIMIT_IMAGE_SIDE_PX ? length : LIMIT_IMAGE_SIDE_PX;
    return length > LIMIT_TILE_SIDE_LEAST_PX ? length : LIMIT_TILE_SIDE_LEAST_PX;
}

static void put_tiles(json_t *tree, const json_t *request)
{
    if (picture_needs_tiles(json_integer_value(json_object_get(request, "width")),
                            json_integer_value(json_object_get(request, "height"))))
        json_object_set_new(tree, "tiles",
                            json_pack("{s:I,s:I}", "width", side_of_tiles(request, "width"),
                                      "height", side_of_tiles(request, "height")));
}

char *provenance_of_picture(const char *text, size_t length, const char *format,
                            int quality_percent)
{
    json_t *tree = json_loadb(text, length, 0, NULL);
    json_t *request = json_object_get(tree, "request");
    if (json_is_object(request)) {
        put_tiles(tree, request);
        json_object_del(request, "tile");
        json_object_set_new(request, "format", json_string(format));
        json_object_set_new(request, "quality_percent",
                            quality_percent ? json_integer(quality_percent) : json_null());
    }
    return tree ? dump_tree(tree) : NULL;
}
