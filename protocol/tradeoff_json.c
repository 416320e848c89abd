/* SPDX-License-Identifier: MIT */
/* Trade-offs as JSON, both ways. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/json_read.h"
#include "protocol/json_write.h"
#include "protocol/limits.h"
#include "protocol/tradeoff.h"
#include "protocol/utf8.h"

/* ---- writing ---- */

static double rounded(double number) /* times, to the microsecond */
{
    return round(number * 1000) / 1000;
}

static json_t *integer_or_null(int number)
{
    return number ? json_integer(number) : json_null();
}

static json_t *write_times(const struct tradeoff_times *times)
{
    if (times->count == 0)
        return json_null();
    struct json_writer writer = json_writer_begin();
    json_put_number(&writer, "median", rounded(tradeoff_times_median(times)));
    json_put_number(&writer, "spread", rounded(tradeoff_times_spread(times)));
    json_put_number(&writer, "max", rounded(tradeoff_times_max(times)));
    json_put_numbers(&writer, "runs", times->ms, (size_t)times->count);
    return json_writer_take(&writer);
}

static json_t *write_error(const struct tradeoff_row *row)
{
    struct json_writer writer = json_writer_begin();
    json_put_number(&writer, "rmse", row->rmse);
    json_put_number(&writer, "p999", row->p999);
    json_put_number(&writer, "max", row->max);
    json_put(&writer, "flip", row->flip >= 0 ? json_finite(row->flip) : json_null());
    return json_writer_take(&writer);
}

static json_t *write_image(uint64_t offset, uint64_t bytes)
{
    if (bytes == 0)
        return json_null();
    struct json_writer writer = json_writer_begin();
    json_put_integer(&writer, "offset", offset);
    json_put_integer(&writer, "bytes", bytes);
    return json_writer_take(&writer);
}

static json_t *write_row(const struct tradeoff_row *row)
{
    struct json_writer writer = json_writer_begin();
    json_put_text(&writer, "shadows", shadow_technique_name((int)row->setting.shadows));
    json_put(&writer, "shadow_resolution", integer_or_null(row->setting.shadow_resolution));
    json_put(&writer, "shadow_taps", integer_or_null(row->setting.shadow_taps));
    json_put(&writer, "samples", json_integer(row->setting.samples));
    json_put(&writer, "shadow_compression",
             row->setting.shadow_compression > 0 ? json_real(row->setting.shadow_compression)
                                                 : json_null());
    json_put(
        &writer, "shadow_prefilter",
        integer_or_null(row->setting.shadow_prefilter > 1 ? row->setting.shadow_prefilter : 0));
    json_put(&writer, "atmosphere_samples", integer_or_null(row->setting.atmosphere_samples));
    json_put_text_or_null(&writer, "transparency", tradeoff_method(&row->setting));
    json_put(&writer, "warm_ms", write_times(&row->warm));
    json_put(&writer, "cold_ms", write_times(&row->cold));
    json_put(&writer, "error", write_error(row));
    json_put_integer(&writer, "bytes", row->bytes);
    json_put_bool(&writer, "on_front", row->is_on_front);
    json_put(&writer, "image", write_image(row->image_offset, row->image_bytes));
    return json_writer_take(&writer);
}

static json_t *write_rows(const struct tradeoff *tradeoff)
{
    json_t *rows = json_array();
    bool has_failed = !rows;
    for (int i = 0; i < tradeoff->row_count; i++)
        json_append(rows, write_row(&tradeoff->rows[i]), &has_failed);
    return json_take_unless(rows, has_failed);
}

static json_t *write_skips(const struct tradeoff *tradeoff)
{
    json_t *skips = json_array();
    bool has_failed = !skips;
    for (int i = 0; i < tradeoff->skip_count; i++) {
        struct json_writer writer = json_writer_begin();
        json_put_text(&writer, "what", tradeoff->skips[i].what);
        json_put_text(&writer, "because", tradeoff->skips[i].because);
        json_append(skips, json_writer_take(&writer), &has_failed);
    }
    return json_take_unless(skips, has_failed);
}

static json_t *write_options(const struct tradeoff_options *options)
{
    struct json_writer writer = json_writer_begin();
    json_put(&writer, "time_budget_s", json_integer(options->time_budget_s));
    json_put(&writer, "repeats", json_integer(options->repeats));
    json_put(&writer, "max_settings", json_integer(options->max_settings));
    json_put(&writer, "reference_samples", json_integer(options->reference_samples));
    json_put_bool(&writer, "keep_images", !options->drops_images);
    return json_writer_take(&writer);
}

static json_t *write_reference(const struct tradeoff *tradeoff)
{
    struct json_writer writer = json_writer_begin();
    json_put(&writer, "samples", json_integer(tradeoff->options.reference_samples));
    json_put(&writer, "rows_done", json_integer(tradeoff->reference_rows));
    json_put_number(&writer, "ms", rounded(tradeoff->reference_ms));
    json_put(&writer, "image", write_image(tradeoff->reference_offset, tradeoff->reference_bytes));
    return json_writer_take(&writer);
}

static json_t *write_counts(const struct tradeoff *tradeoff)
{
    struct json_writer writer = json_writer_begin();
    json_put_integer(&writer, "lights", tradeoff->lights);
    json_put_integer(&writer, "shadowed_lights", tradeoff->shadowed_lights);
    json_put_integer(&writer, "triangles", tradeoff->triangles);
    json_put_bool(&writer, "transparent_casters", tradeoff->has_transparent_casters);
    return json_writer_take(&writer);
}

static json_t *write_problem(const struct error *problem)
{
    if (problem->code == ERROR_NONE)
        return json_null();
    struct json_writer writer = json_writer_begin();
    json_put_text(&writer, "code", error_code_name(problem->code));
    json_put_text(&writer, "detail", problem->message);
    return json_writer_take(&writer);
}

static struct json_writer write_head(const struct tradeoff *tradeoff)
{
    struct json_writer writer = json_writer_begin();
    json_put_text(&writer, "id", tradeoff->id);
    json_put_text(&writer, "state", tradeoff_state_name((int)tradeoff->state));
    json_put_text(&writer, "stage", tradeoff_stage_name((int)tradeoff->stage));
    json_put_bool(&writer, "partial", tradeoff->is_partial);
    json_put_number(&writer, "progress", rounded(tradeoff->progress));
    json_put_number(&writer, "elapsed_s", rounded(tradeoff->elapsed_s));
    json_put_text(&writer, "created", tradeoff->created);
    json_put_text(&writer, "scene", tradeoff->scene);
    json_put(&writer, "width", json_integer(tradeoff->width));
    json_put(&writer, "height", json_integer(tradeoff->height));
    json_put_text_or_null(&writer, "device", tradeoff->device);
    json_put(&writer, "problem", write_problem(&tradeoff->problem));
    return writer;
}

json_t *tradeoff_summary_to_json(const struct tradeoff *tradeoff)
{
    struct json_writer writer = write_head(tradeoff);
    json_put(&writer, "setting_count", json_integer(tradeoff->row_count));
    return json_writer_take(&writer);
}

json_t *tradeoff_to_json(const struct tradeoff *tradeoff)
{
    struct json_writer writer = write_head(tradeoff);
    json_put_text(&writer, "view_key", tradeoff->view_key);
    json_put(&writer, "tradeoff", write_options(&tradeoff->options));
    json_put(&writer, "reference", write_reference(tradeoff));
    json_put(&writer, "counts", write_counts(tradeoff));
    json_put(&writer, "settings", write_rows(tradeoff));
    json_put(&writer, "skipped", write_skips(tradeoff));
    json_put(
        &writer, "warnings",
        json_texts(tradeoff->warnings[0], sizeof tradeoff->warnings[0], tradeoff->warning_count));
    json_put(&writer, "request", tradeoff->request ? json_incref(tradeoff->request) : json_null());
    return json_writer_take(&writer);
}

/* ---- reading ---- */

static bool read_times(const struct json_node *node, struct tradeoff_times *times)
{
    if (!node->value)
        return true;
    if (!json_expect_object(node, NULL))
        return false;
    struct json_node runs = json_member(node, "runs");
    size_t count;
    if (!json_expect_array(&runs, TRADEOFF_REPEATS_MAX, &count) || count == 0)
        return json_refuse(&runs, ERROR_INVALID_REQUEST, "no list of runs");
    for (size_t i = 0; i < count; i++) {
        struct json_node run = json_element(&runs, i);
        if (!json_expect_present(&run) || !json_read_number(&run, 0, 1e12, &times->ms[i]))
            return false;
    }
    times->count = (int)count;
    return true;
}

static bool read_image(const struct json_node *node, uint64_t *offset, uint64_t *bytes)
{
    if (!node->value)
        return true;
    if (!json_expect_object(node, NULL))
        return false;
    struct json_node offset_node = json_member(node, "offset");
    struct json_node bytes_node = json_member(node, "bytes");
    return json_read_uint64(&offset_node, offset) && json_read_uint64(&bytes_node, bytes);
}

static bool read_error(const struct json_node *node, struct tradeoff_row *row)
{
    if (!json_expect_present(node) || !json_expect_object(node, NULL))
        return false;
    struct json_node rmse = json_member(node, "rmse"), p999 = json_member(node, "p999");
    struct json_node max = json_member(node, "max"), flip = json_member(node, "flip");
    row->flip = -1;
    return json_expect_present(&rmse) && json_read_number(&rmse, 0, INFINITY, &row->rmse) &&
           json_read_number(&p999, 0, INFINITY, &row->p999) &&
           json_read_number(&max, 0, INFINITY, &row->max) &&
           json_read_number(&flip, 0, 1, &row->flip);
}

static bool read_row(const struct json_node *node, struct tradeoff_row *row)
{
    const struct json_choice names = {.name = shadow_technique_name};
    const struct json_choice methods = {.name = transparency_name};
    if (!json_expect_object(node, NULL))
        return false;
    struct json_node shadows = json_member(node, "shadows");
    struct json_node transparency = json_member(node, "transparency");
    struct json_node resolution = json_member(node, "shadow_resolution");
    struct json_node taps = json_member(node, "shadow_taps");
    struct json_node samples = json_member(node, "samples");
    struct json_node warm = json_member(node, "warm_ms"), cold = json_member(node, "cold_ms");
    struct json_node error = json_member(node, "error"), bytes = json_member(node, "bytes");
    struct json_node front = json_member(node, "on_front"), image = json_member(node, "image");
    struct json_node compression = json_member(node, "shadow_compression");
    struct json_node prefilter = json_member(node, "shadow_prefilter");
    struct json_node atmosphere = json_member(node, "atmosphere_samples");
    int technique = 0, method = TRANSPARENCY_AUTO;
    if (!json_expect_present(&shadows) || !json_read_choice(&shadows, &names, &technique) ||
        !json_read_int(&resolution, 0, LIMIT_SHADOW_RESOLUTION, &row->setting.shadow_resolution) ||
        !json_read_int(&taps, 0, LIMIT_SHADOW_TAPS, &row->setting.shadow_taps) ||
        !json_expect_present(&samples) || !json_read_int(&samples, 1, 256, &row->setting.samples) ||
        !json_read_number(&compression, LIMIT_COMPRESSION_LEAST, LIMIT_COMPRESSION_MOST,
                          &row->setting.shadow_compression) ||
        !json_read_int(&prefilter, 1, LIMIT_PREFILTER, &row->setting.shadow_prefilter) ||
        !json_read_int(&atmosphere, 1, LIMIT_ATMOSPHERE_SAMPLES,
                       &row->setting.atmosphere_samples) ||
        !json_read_choice(&transparency, &methods, &method))
        return false;
    row->setting.shadows = (enum shadow_technique)technique;
    row->setting.transparency = (enum transparency)method;
    return read_times(&warm, &row->warm) && read_times(&cold, &row->cold) &&
           read_error(&error, row) && json_read_uint64(&bytes, &row->bytes) &&
           json_read_bool(&front, &row->is_on_front) &&
           read_image(&image, &row->image_offset, &row->image_bytes);
}

static bool read_rows(const struct json_node *node, struct tradeoff *tradeoff)
{
    size_t count;
    if (!json_expect_array(node, TRADEOFF_ROWS_MAX, &count))
        return false;
    for (size_t i = 0; i < count; i++) {
        struct json_node row = json_element(node, i);
        if (!read_row(&row, &tradeoff->rows[i]))
            return false;
    }
    tradeoff->row_count = (int)count;
    return true;
}

static bool read_texts(const struct json_node *root, struct tradeoff *tradeoff)
{
    struct json_node skips = json_member(root, "skipped");
    struct json_node warnings = json_member(root, "warnings");
    size_t skip_count, warning_count;
    if (!json_expect_array(&skips, TRADEOFF_SKIPS_MAX, &skip_count) ||
        !json_expect_array(&warnings, TRADEOFF_WARNINGS_MAX, &warning_count))
        return false;
    for (size_t i = 0; i < skip_count; i++) {
        struct json_node skip = json_element(&skips, i);
        struct tradeoff_skip *to = &tradeoff->skips[i];
        if (!json_expect_object(&skip, NULL))
            return false;
        struct json_node what = json_member(&skip, "what"), because = json_member(&skip, "because");
        if (!json_read_text(&what, to->what, sizeof to->what) ||
            !json_read_text(&because, to->because, sizeof to->because))
            return false;
    }
    for (size_t i = 0; i < warning_count; i++) {
        struct json_node warning = json_element(&warnings, i);
        if (!json_read_text(&warning, tradeoff->warnings[i], TRADEOFF_TEXT_BYTES))
            return false;
    }
    tradeoff->skip_count = (int)skip_count;
    tradeoff->warning_count = (int)warning_count;
    return true;
}

static bool read_options(const struct json_node *node, struct tradeoff_options *options)
{
    if (!json_expect_present(node) || !json_expect_object(node, NULL))
        return false;
    struct json_node budget = json_member(node, "time_budget_s");
    struct json_node repeats = json_member(node, "repeats");
    struct json_node settings = json_member(node, "max_settings");
    struct json_node samples = json_member(node, "reference_samples");
    struct json_node images = json_member(node, "keep_images");
    bool keeps_images = true;
    if (!json_read_int(&budget, 1, 1 << 20, &options->time_budget_s) ||
        !json_read_int(&repeats, 1, TRADEOFF_REPEATS_MAX, &options->repeats) ||
        !json_read_int(&settings, 1, TRADEOFF_ROWS_MAX, &options->max_settings) ||
        !json_read_int(&samples, 1, 256, &options->reference_samples) ||
        !json_read_bool(&images, &keeps_images))
        return false;
    options->drops_images = !keeps_images;
    return true;
}

static bool read_reference(const struct json_node *node, struct tradeoff *tradeoff)
{
    if (!json_expect_present(node) || !json_expect_object(node, NULL))
        return false;
    struct json_node rows = json_member(node, "rows_done"), ms = json_member(node, "ms");
    struct json_node image = json_member(node, "image");
    return json_read_int(&rows, 0, LIMIT_IMAGE_SIDE_PX, &tradeoff->reference_rows) &&
           json_read_number(&ms, 0, 1e12, &tradeoff->reference_ms) &&
           read_image(&image, &tradeoff->reference_offset, &tradeoff->reference_bytes);
}

static bool read_counts(const struct json_node *node, struct tradeoff *tradeoff)
{
    if (!json_expect_present(node) || !json_expect_object(node, NULL))
        return false;
    struct json_node lights = json_member(node, "lights");
    struct json_node shadowed = json_member(node, "shadowed_lights");
    struct json_node triangles = json_member(node, "triangles");
    struct json_node casters = json_member(node, "transparent_casters");
    return json_read_uint64(&lights, &tradeoff->lights) &&
           json_read_uint64(&shadowed, &tradeoff->shadowed_lights) &&
           json_read_uint64(&triangles, &tradeoff->triangles) &&
           json_read_bool(&casters, &tradeoff->has_transparent_casters);
}

static bool read_problem(const struct json_node *node, struct error *problem)
{
    if (!node->value)
        return true;
    if (!json_expect_object(node, NULL))
        return false;
    struct json_node code = json_member(node, "code"), detail = json_member(node, "detail");
    char name[64] = "", text[ERROR_MESSAGE_BYTES] = "";
    if (!json_read_text(&code, name, sizeof name) || !json_read_text(&detail, text, sizeof text))
        return false;
    error_set(problem, error_code_from_name(name), "%s", text);
    return true;
}

static bool read_state(const struct json_node *root, struct tradeoff *tradeoff)
{
    const struct json_choice states = {.name = tradeoff_state_name};
    const struct json_choice stages = {.name = tradeoff_stage_name};
    struct json_node state = json_member(root, "state"), stage = json_member(root, "stage");
    struct json_node partial = json_member(root, "partial");
    struct json_node progress = json_member(root, "progress");
    struct json_node elapsed = json_member(root, "elapsed_s");
    int state_index = 0, stage_index = 0;
    if (!json_expect_present(&state) || !json_read_choice(&state, &states, &state_index) ||
        !json_read_choice(&stage, &stages, &stage_index) ||
        !json_read_bool(&partial, &tradeoff->is_partial) ||
        !json_read_number(&progress, 0, 1, &tradeoff->progress) ||
        !json_read_number(&elapsed, 0, 1e12, &tradeoff->elapsed_s))
        return false;
    tradeoff->state = (enum tradeoff_state)state_index;
    tradeoff->stage = (enum tradeoff_stage)stage_index;
    return true;
}

/* Lowercase hexadecimal digits, and as many as fill the buffer. */
static bool read_digits(const struct json_node *node, char *digits, size_t size_bytes)
{
    if (!json_expect_present(node) || !json_read_text(node, digits, size_bytes))
        return false;
    return strspn(digits, "0123456789abcdef") == size_bytes - 1 ||
           json_refuse(node, ERROR_INVALID_REQUEST, "%zu lowercase hexadecimal digits are needed",
                       size_bytes - 1);
}

static bool read_head(const struct json_node *root, struct tradeoff *tradeoff)
{
    struct json_node id = json_member(root, "id"), scene = json_member(root, "scene");
    struct json_node view_key = json_member(root, "view_key");
    struct json_node device = json_member(root, "device");
    struct json_node created = json_member(root, "created");
    struct json_node width = json_member(root, "width"), height = json_member(root, "height");
    struct json_node problem = json_member(root, "problem");
    return read_digits(&id, tradeoff->id, sizeof tradeoff->id) &&
           read_digits(&scene, tradeoff->scene, sizeof tradeoff->scene) &&
           read_digits(&view_key, tradeoff->view_key, sizeof tradeoff->view_key) &&
           json_read_text(&device, tradeoff->device, sizeof tradeoff->device) &&
           json_read_text(&created, tradeoff->created, sizeof tradeoff->created) &&
           json_expect_present(&width) && json_expect_present(&height) &&
           json_read_int(&width, 1, LIMIT_IMAGE_SIDE_PX, &tradeoff->width) &&
           json_read_int(&height, 1, LIMIT_IMAGE_SIDE_PX, &tradeoff->height) &&
           read_problem(&problem, &tradeoff->problem);
}

bool tradeoff_from_json(json_t *json, struct tradeoff *tradeoff, struct error *err)
{
    *tradeoff = (struct tradeoff){0};
    struct json_node root = json_root(json, err);
    if (!json_expect_object(&root, NULL))
        return false;
    struct json_node options = json_member(&root, "tradeoff");
    struct json_node reference = json_member(&root, "reference");
    struct json_node counts = json_member(&root, "counts");
    struct json_node settings = json_member(&root, "settings");
    struct json_node request = json_member(&root, "request");
    if (read_head(&root, tradeoff) && read_state(&root, tradeoff) &&
        read_options(&options, &tradeoff->options) && read_reference(&reference, tradeoff) &&
        read_counts(&counts, tradeoff) && read_rows(&settings, tradeoff) &&
        read_texts(&root, tradeoff)) {
        if (json_is_object(request.value))
            tradeoff->request = json_incref(request.value);
        return true;
    }
    tradeoff_finish(tradeoff);
    return false;
}

/* ---- of others, who check nothing ---- */

static int whole_of(const json_t *members, const char *key)
{
    const json_t *number = json_object_get(members, key);
    return json_is_integer(number) && json_integer_value(number) > 0
               ? (int)json_integer_value(number)
               : 0;
}

struct quality_setting tradeoff_setting_from_json(const json_t *members)
{
    const char *shadows = json_string_value(json_object_get(members, "shadows"));
    const char *method = json_string_value(json_object_get(members, "transparency"));
    return (struct quality_setting){
        .shadows = shadows ? shadow_technique_find(shadows) : SHADOWS_COUNT,
        .shadow_resolution = whole_of(members, "shadow_resolution"),
        .shadow_taps = whole_of(members, "shadow_taps"),
        .samples = whole_of(members, "samples"),
        .shadow_compression = json_number_value(json_object_get(members, "shadow_compression")),
        .shadow_prefilter = whole_of(members, "shadow_prefilter"),
        .atmosphere_samples = whole_of(members, "atmosphere_samples"),
        .transparency = method ? transparency_find(method) : TRANSPARENCY_AUTO,
    };
}
