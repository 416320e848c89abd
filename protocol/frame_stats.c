/* SPDX-License-Identifier: MIT */
/* Frame stats as JSON, both ways, and as a Server-Timing header. */
#include "protocol/frame_stats.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/json_read.h"
#include "protocol/json_write.h"
#include "protocol/limits.h"
#include "protocol/utf8.h"

static const char *const timing_names[FRAME_TIMING_COUNT] = {
    [FRAME_TIMING_QUEUE] = "queue",     [FRAME_TIMING_PAUSED] = "paused",
    [FRAME_TIMING_PREPARE] = "prepare", [FRAME_TIMING_OTHER] = "other",
    [FRAME_TIMING_SHADOW] = "shadow",   [FRAME_TIMING_LIGHT_LIST] = "light-list",
    [FRAME_TIMING_SHADE] = "shade",     [FRAME_TIMING_READBACK] = "readback",
    [FRAME_TIMING_ENCODE] = "encode",   [FRAME_TIMING_TOTAL] = "total",
};

const char *frame_timing_name(int timing)
{
    return timing >= 0 && timing < FRAME_TIMING_COUNT ? timing_names[timing] : NULL;
}

static const char *error_source_name(int source)
{
    static const char *const names[] = {"exact", "measured", "estimated"};
    return source >= 0 && source < 3 ? names[source] : NULL;
}

static const char *choice_source_name(int source)
{
    static const char *const names[] = {"measured", "calibrated", "estimated", "configured"};
    return source >= 0 && source < 4 ? names[source] : NULL;
}

/* The whole-number members of counts: one list for both directions. */
struct count_member {
    const char *key;
    size_t offset;
};
#define COUNT(member)                                        \
    {                                                        \
#member, offsetof(struct frame_stats, counts.member) \
    }
static const struct count_member count_members[] = {
    COUNT(lights),
    COUNT(shadowed_lights),
    COUNT(unseen_lights),
    COUNT(light_batches),
    COUNT(light_chunks),
    {"light_slices", offsetof(struct frame_stats, counts.light_chunks)}, /* its earlier name */
    COUNT(rounds),
    COUNT(split_pixels),
    COUNT(draws),
    COUNT(triangles),
    COUNT(draw_calls),
    COUNT(culled),
    COUNT(shadow_draws),
    COUNT(shadow_culled),
    COUNT(events),
    COUNT(longest_list),
    COUNT(lookups),
    COUNT(shadow_rays),
    COUNT(transparent_fragments),
    COUNT(longest_pixel_list),
    COUNT(peeled_layers),
    COUNT(dropped_layers),
    COUNT(light_list_entries),
    COUNT(shadow_maps_built),
    COUNT(shadow_maps_reused),
    COUNT(states_reused),
    COUNT(feature_edges),
    COUNT(outlined_pixels),
    COUNT(gbuffers_drawn),
    COUNT(gbuffers_reused),
    COUNT(light_lists_built),
    COUNT(light_lists_reused),
    COUNT(pixel_lists_built),
    COUNT(pixel_lists_reused),
    COUNT(plans_made),
    COUNT(plans_reused),
    COUNT(programs_built),
    COUNT(programs_reused),
    COUNT(programs_loaded),
};
enum { COUNT_MEMBERS = sizeof count_members / sizeof *count_members };

#define COMPRESSION(member)                                       \
    {                                                             \
#member, offsetof(struct frame_stats, compression.member) \
    }
static const struct count_member compression_members[] = {
    COMPRESSION(maps),       COMPRESSION(events),  COMPRESSION(nodes),     COMPRESSION(exact_bytes),
    COMPRESSION(node_bytes), COMPRESSION(windows), COMPRESSION(prefilter),
};
enum { COMPRESSION_MEMBERS = sizeof compression_members / sizeof *compression_members };

#define TEXTURES(member)                                       \
    {                                                          \
#member, offsetof(struct frame_stats, textures.member) \
    }
static const struct count_member texture_members[] = {
    TEXTURES(budget_bytes),  TEXTURES(resident_bytes),   TEXTURES(wanted_bytes),
    TEXTURES(pending_bytes), TEXTURES(written_bytes),    TEXTURES(coarse_count),
    TEXTURES(level_bias),    TEXTURES(compressed_count), TEXTURES(compressed_bytes),
};
enum { TEXTURE_MEMBERS = sizeof texture_members / sizeof *texture_members };

void frame_stats_warn(struct frame_stats *stats, const char *format, ...)
{
    int last = FRAME_STATS_WARNINGS_MAX - 1;
    if (stats->warning_count > last) {
        snprintf(stats->warnings[last], FRAME_STATS_TEXT_BYTES, "more warnings were dropped");
        return;
    }
    char *text = stats->warnings[stats->warning_count++];
    va_list args;
    va_start(args, format);
    int length = vsnprintf(text, FRAME_STATS_TEXT_BYTES, format, args);
    va_end(args);
    utf8_sanitize(text, length >= FRAME_STATS_TEXT_BYTES);
}

void frame_stats_close(struct frame_stats *stats, double queue_ms, double total_ms)
{
    double *ms = stats->timings_ms;
    double made = ms[FRAME_TIMING_TOTAL] + ms[FRAME_TIMING_PAUSED] + ms[FRAME_TIMING_ENCODE];
    double rest = fmax(total_ms - made, 0);
    /* the word that the frame began may have come late */
    ms[FRAME_TIMING_QUEUE] = fmin(queue_ms, rest);
    ms[FRAME_TIMING_OTHER] = rest - ms[FRAME_TIMING_QUEUE];
    ms[FRAME_TIMING_TOTAL] = fmax(total_ms, made); /* of two clocks */
}

void frame_stats_promise(struct frame_stats *stats, const struct frame_promise *promise)
{
    if (promise->chosen.shadows[0])
        stats->chosen = promise->chosen;
    if (promise->has_error) {
        stats->has_error = true;
        stats->error_value = promise->rmse;
        stats->error_source = promise->source;
        utf8_copy(stats->error_metric, sizeof stats->error_metric, "rmse");
    }
    if (promise->warning[0])
        frame_stats_warn(stats, "%s", promise->warning);
}

/* ---- writing ---- */

/* Times are reported to the microsecond, means to a thousandth: more digits would be noise. */
static double rounded(double number)
{
    return round(number * 1000) / 1000;
}

static json_t *write_plan(const struct frame_stats *stats)
{
    json_t *plan = json_array();
    bool has_failed = !plan;
    for (int i = 0; i < stats->plan_count; i++) {
        const struct frame_stats_pass *pass = &stats->plan[i];
        struct json_writer writer = json_writer_begin();
        json_put_text(&writer, "pass", pass->pass);
        json_put_text(&writer, "because", pass->because);
        json_put_text_or_null(&writer, "technique", pass->technique);
        json_put_number(&writer, "ms", rounded(pass->ms));
        json_append(plan, json_writer_take(&writer), &has_failed);
    }
    return json_take_unless(plan, has_failed);
}

static json_t *write_timings(const struct frame_stats *stats)
{
    struct json_writer writer = json_writer_begin();
    for (int i = 0; i < FRAME_TIMING_COUNT; i++)
        json_put_number(&writer, timing_names[i], rounded(stats->timings_ms[i]));
    return json_writer_take(&writer);
}

static void put_members(struct json_writer *writer, const struct frame_stats *stats,
                        const struct count_member *members, int count)
{
    for (int i = 0; i < count; i++) {
        uint64_t number;
        memcpy(&number, (const char *)stats + members[i].offset, sizeof number);
        json_put_integer(writer, members[i].key, number);
    }
}

static bool read_members(const struct json_node *node, struct frame_stats *stats,
                         const struct count_member *members, int count)
{
    for (int i = 0; i < count; i++) {
        struct json_node member = json_member(node, members[i].key);
        uint64_t number = 0;
        if (!json_read_uint64(&member, &number))
            return false;
        memcpy((char *)stats + members[i].offset, &number, sizeof number);
    }
    return true;
}

static json_t *write_compression(const struct frame_stats *stats)
{
    if (!stats->compression.maps)
        return json_null();
    struct json_writer writer = json_writer_begin();
    put_members(&writer, stats, compression_members, COMPRESSION_MEMBERS);
    json_put_number(&writer, "max_error", stats->compression.max_error);
    return json_writer_take(&writer);
}

static bool read_compression(const struct json_node *node, struct frame_stats *stats)
{
    if (!node->value)
        return true;
    struct json_node error = json_member(node, "max_error");
    return json_expect_object(node, NULL) &&
           read_members(node, stats, compression_members, COMPRESSION_MEMBERS) &&
           json_read_number(&error, 0, 1, &stats->compression.max_error);
}

static json_t *write_textures(const struct frame_stats *stats)
{
    if (!stats->textures.budget_bytes)
        return json_null();
    struct json_writer writer = json_writer_begin();
    put_members(&writer, stats, texture_members, TEXTURE_MEMBERS);
    json_put_number(&writer, "compressed_rmse", stats->textures.compressed_rmse);
    json_put_number(&writer, "upload_ms", rounded(stats->textures.upload_ms));
    return json_writer_take(&writer);
}

static bool read_textures(const struct json_node *node, struct frame_stats *stats)
{
    if (!node->value)
        return true;
    struct json_node upload = json_member(node, "upload_ms");
    struct json_node rmse = json_member(node, "compressed_rmse");
    return json_expect_object(node, NULL) &&
           read_members(node, stats, texture_members, TEXTURE_MEMBERS) &&
           json_read_number(&rmse, 0, 1, &stats->textures.compressed_rmse) &&
           json_read_number(&upload, 0, INFINITY, &stats->textures.upload_ms);
}

static json_t *write_counts(const struct frame_stats *stats)
{
    struct json_writer writer = json_writer_begin();
    put_members(&writer, stats, count_members, COUNT_MEMBERS);
    json_put_number(&writer, "mean_list", rounded(stats->counts.mean_list));
    return json_writer_take(&writer);
}

static json_t *write_bytes(const struct frame_stats *stats)
{
    struct json_writer writer = json_writer_begin();
    for (int i = 0; i < stats->byte_count; i++)
        json_put_integer(&writer, stats->bytes[i].structure, stats->bytes[i].bytes);
    return json_writer_take(&writer);
}

json_t *frame_stats_error_to_json(const struct frame_stats *stats)
{
    if (!stats->has_error)
        return json_null();
    struct json_writer writer = json_writer_begin();
    json_put_text(&writer, "metric", stats->error_metric);
    json_put_number(&writer, "value", stats->error_value);
    json_put_text(&writer, "source", error_source_name((int)stats->error_source));
    return json_writer_take(&writer);
}

static json_t *number_or_null(int number)
{
    return number ? json_integer(number) : json_null();
}

static json_t *write_chosen(const struct frame_stats_chosen *chosen)
{
    if (!chosen->shadows[0])
        return json_null();
    struct json_writer writer = json_writer_begin();
    json_put_text(&writer, "shadows", chosen->shadows);
    json_put(&writer, "shadow_resolution", number_or_null(chosen->shadow_resolution));
    json_put(&writer, "shadow_taps", number_or_null(chosen->shadow_taps));
    json_put(&writer, "shadow_compression",
             chosen->shadow_compression > 0 ? json_real(chosen->shadow_compression) : json_null());
    json_put(&writer, "shadow_prefilter",
             number_or_null(chosen->shadow_prefilter > 1 ? chosen->shadow_prefilter : 0));
    json_put(&writer, "samples", json_integer(chosen->samples));
    json_put(&writer, "atmosphere_samples", number_or_null(chosen->atmosphere_samples));
    json_put_text_or_null(&writer, "transparency", chosen->transparency);
    json_put(&writer, "expected_ms",
             chosen->expected_ms > 0 ? json_real(rounded(chosen->expected_ms)) : json_null());
    json_put(&writer, "took_ms",
             chosen->took_ms > 0 ? json_real(rounded(chosen->took_ms)) : json_null());
    json_put_text_or_null(&writer, "missed", chosen->missed);
    json_put_text(&writer, "source", choice_source_name((int)chosen->source));
    json_put_text(&writer, "because", chosen->because);
    return json_writer_take(&writer);
}

/* `texts` is the first of `count` buffers of `stride` bytes. */
static json_t *write_environment(const struct frame_stats_environment *environment)
{
    if (!environment->image[0])
        return json_null();
    struct json_writer writer = json_writer_begin();
    json_put_text(&writer, "image", environment->image);
    json_put(&writer, "samples",
             environment->samples ? json_integer(environment->samples) : json_null());
    return json_writer_take(&writer);
}

json_t *frame_stats_to_json(const struct frame_stats *stats)
{
    struct json_writer writer = json_writer_begin();
    json_put_text_or_null(&writer, "id", stats->id);
    json_put_text(&writer, "scene", stats->scene);
    json_put_text_or_null(&writer, "view", stats->view);
    json_put_integer(&writer, "revision", stats->revision);
    json_put_text(&writer, "device", stats->device);
    json_put(&writer, "width", json_integer(stats->width));
    json_put(&writer, "height", json_integer(stats->height));
    json_put(&writer, "exposure_ev",
             stats->has_exposure ? json_real(stats->exposure_ev) : json_null());
    json_put(&writer, "environment", write_environment(&stats->environment));
    json_put(&writer, "plan", write_plan(stats));
    json_put(&writer, "timings_ms", write_timings(stats));
    json_put(&writer, "counts", write_counts(stats));
    json_put(&writer, "compression", write_compression(stats));
    json_put(&writer, "textures", write_textures(stats));
    json_put(&writer, "bytes", write_bytes(stats));
    json_put_integer(&writer, "resident_bytes", stats->resident_bytes);
    json_put(&writer, "reused",
             json_texts(stats->reused[0], sizeof stats->reused[0], stats->reused_count));
    json_put(&writer, "error", frame_stats_error_to_json(stats));
    json_put(&writer, "chosen", write_chosen(&stats->chosen));
    json_put(&writer, "warnings",
             json_texts(stats->warnings[0], sizeof stats->warnings[0], stats->warning_count));
    return json_writer_take(&writer);
}

char *frame_stats_to_json_text(const struct frame_stats *stats)
{
    return json_take_dump(frame_stats_to_json(stats), JSON_COMPACT | JSON_REAL_PRECISION(15));
}

/* ---- reading ---- */

/* Absent or null: not known. */
static bool read_ms(const struct json_node *node, double *ms)
{
    *ms = NAN;
    return json_read_number(node, -INFINITY, INFINITY, ms);
}

static bool read_plan(const struct json_node *node, struct frame_stats *stats)
{
    size_t count;
    if (!json_expect_array(node, FRAME_STATS_PASSES_MAX, &count))
        return false;
    for (size_t i = 0; i < count; i++) {
        struct frame_stats_pass *pass = &stats->plan[i];
        struct json_node element = json_element(node, i);
        if (!json_expect_object(&element, NULL))
            return false;
        struct json_node name = json_member(&element, "pass");
        struct json_node because = json_member(&element, "because");
        struct json_node technique = json_member(&element, "technique");
        struct json_node ms = json_member(&element, "ms");
        if (!json_read_text(&name, pass->pass, sizeof pass->pass) ||
            !json_read_text(&because, pass->because, sizeof pass->because) ||
            !json_read_text(&technique, pass->technique, sizeof pass->technique) ||
            !read_ms(&ms, &pass->ms))
            return false;
    }
    stats->plan_count = (int)count;
    return true;
}

static bool read_counts(const struct json_node *node, struct frame_stats *stats)
{
    if (!node->value)
        return true;
    if (!json_expect_object(node, NULL))
        return false;
    if (!read_members(node, stats, count_members, COUNT_MEMBERS))
        return false;
    struct json_node mean = json_member(node, "mean_list");
    return json_read_number(&mean, 0, INFINITY, &stats->counts.mean_list);
}

static bool read_timings(const struct json_node *node, struct frame_stats *stats)
{
    if (!node->value)
        return true;
    if (!json_expect_object(node, NULL))
        return false;
    for (int i = 0; i < FRAME_TIMING_COUNT; i++) {
        struct json_node member = json_member(node, timing_names[i]);
        if (!read_ms(&member, &stats->timings_ms[i]))
            return false;
    }
    return true;
}

static bool read_bytes(const struct json_node *node, struct frame_stats *stats)
{
    if (!node->value)
        return true;
    if (!json_expect_object(node, NULL))
        return false;
    if (json_object_size(node->value) > FRAME_STATS_BYTES_MAX)
        return json_refuse(node, ERROR_TOO_LARGE, "the limit is %d", FRAME_STATS_BYTES_MAX);
    const char *key;
    json_t *value;
    json_object_foreach(node->value, key, value)
    {
        struct frame_stats_bytes *bytes = &stats->bytes[stats->byte_count++];
        struct json_node member = json_member(node, key);
        utf8_copy(bytes->structure, sizeof bytes->structure, key);
        if (!json_read_uint64(&member, &bytes->bytes))
            return false;
    }
    return true;
}

static bool read_error(const struct json_node *node, struct frame_stats *stats)
{
    if (!node->value)
        return true;
    if (!json_expect_object(node, NULL))
        return false;
    struct json_node metric = json_member(node, "metric"), value = json_member(node, "value");
    struct json_node source = json_member(node, "source");
    const struct json_choice sources = {.name = error_source_name};
    int index = 0;
    if (!json_read_text(&metric, stats->error_metric, sizeof stats->error_metric) ||
        !json_read_number(&value, -INFINITY, INFINITY, &stats->error_value) ||
        !json_read_choice(&source, &sources, &index))
        return false;
    stats->error_source = (enum frame_error_source)index;
    stats->has_error = true;
    return true;
}

bool frame_promise_take_error(struct frame_promise *promise, json_t *json, struct error *err)
{
    if (!json || json_is_null(json))
        return true;
    struct frame_stats *stated = calloc(1, sizeof *stated);
    if (!stated)
        return error_set(err, ERROR_NO_MEMORY, "error of a frame");
    const struct json_node node = json_root(json, err);
    bool is_good = read_error(&node, stated);
    if (is_good && stated->has_error && stated->error_source != FRAME_ERROR_EXACT) {
        promise->has_error = true;
        promise->rmse = stated->error_value;
        promise->source = stated->error_source;
    }
    free(stated);
    return is_good;
}

static bool read_chosen(const struct json_node *node, struct frame_stats_chosen *chosen)
{
    if (!node->value)
        return true;
    if (!json_expect_object(node, NULL))
        return false;
    struct json_node shadows = json_member(node, "shadows");
    struct json_node resolution = json_member(node, "shadow_resolution");
    struct json_node taps = json_member(node, "shadow_taps");
    struct json_node samples = json_member(node, "samples");
    struct json_node compression = json_member(node, "shadow_compression");
    struct json_node prefilter = json_member(node, "shadow_prefilter");
    struct json_node atmosphere = json_member(node, "atmosphere_samples");
    struct json_node transparency = json_member(node, "transparency");
    struct json_node ms = json_member(node, "expected_ms");
    struct json_node took = json_member(node, "took_ms"), missed = json_member(node, "missed");
    struct json_node because = json_member(node, "because");
    struct json_node source = json_member(node, "source");
    const struct json_choice sources = {.name = choice_source_name};
    int index = 0;
    if (!json_read_choice(&source, &sources, &index))
        return false;
    chosen->source = (enum frame_choice_source)index;
    return json_read_text(&shadows, chosen->shadows, sizeof chosen->shadows) &&
           json_read_int(&resolution, 0, LIMIT_SHADOW_RESOLUTION, &chosen->shadow_resolution) &&
           json_read_int(&taps, 0, LIMIT_SHADOW_TAPS, &chosen->shadow_taps) &&
           json_read_int(&samples, 1, 256, &chosen->samples) &&
           json_read_number(&compression, 0, 1, &chosen->shadow_compression) &&
           json_read_int(&prefilter, 0, LIMIT_PREFILTER, &chosen->shadow_prefilter) &&
           json_read_int(&atmosphere, 0, LIMIT_ATMOSPHERE_SAMPLES, &chosen->atmosphere_samples) &&
           json_read_text(&transparency, chosen->transparency, sizeof chosen->transparency) &&
           json_read_number(&ms, 0, INFINITY, &chosen->expected_ms) &&
           json_read_number(&took, 0, INFINITY, &chosen->took_ms) &&
           json_read_text(&missed, chosen->missed, sizeof chosen->missed) &&
           json_read_text(&because, chosen->because, sizeof chosen->because);
}

static bool read_texts(const struct json_node *node, char *texts, size_t stride, int max_count,
                       int *count)
{
    size_t found;
    if (!json_expect_array(node, (size_t)max_count, &found))
        return false;
    for (size_t i = 0; i < found; i++) {
        struct json_node element = json_element(node, i);
        if (!json_read_text(&element, texts + i * stride, stride))
            return false;
    }
    *count = (int)found;
    return true;
}

static bool read_lists(const struct json_node *root, struct frame_stats *stats)
{
    struct json_node plan = json_member(root, "plan"), bytes = json_member(root, "bytes");
    struct json_node reused = json_member(root, "reused");
    struct json_node warnings = json_member(root, "warnings");
    return read_plan(&plan, stats) && read_bytes(&bytes, stats) &&
           read_texts(&reused, stats->reused[0], sizeof stats->reused[0], FRAME_STATS_REUSED_MAX,
                      &stats->reused_count) &&
           read_texts(&warnings, stats->warnings[0], sizeof stats->warnings[0],
                      FRAME_STATS_WARNINGS_MAX, &stats->warning_count);
}

static bool read_environment(const struct json_node *node,
                             struct frame_stats_environment *environment)
{
    struct json_node image = json_member(node, "image"), samples = json_member(node, "samples");
    return json_read_text(&image, environment->image, sizeof environment->image) &&
           json_read_int(&samples, 0, LIMIT_ENVIRONMENT_SAMPLES, &environment->samples);
}

static bool read_head(const struct json_node *root, struct frame_stats *stats)
{
    struct json_node id = json_member(root, "id"), scene = json_member(root, "scene");
    struct json_node view = json_member(root, "view"), device = json_member(root, "device");
    struct json_node revision = json_member(root, "revision");
    struct json_node resident = json_member(root, "resident_bytes");
    struct json_node width = json_member(root, "width"), height = json_member(root, "height");
    struct json_node exposure = json_member(root, "exposure_ev");
    struct json_node environment = json_member(root, "environment");
    stats->has_exposure = exposure.value;
    return read_environment(&environment, &stats->environment) &&
           json_read_text(&id, stats->id, sizeof stats->id) &&
           json_read_text(&scene, stats->scene, sizeof stats->scene) &&
           json_read_text(&view, stats->view, sizeof stats->view) &&
           json_read_uint64(&revision, &stats->revision) &&
           json_read_uint64(&resident, &stats->resident_bytes) &&
           json_read_text(&device, stats->device, sizeof stats->device) &&
           json_read_int(&width, 0, LIMIT_IMAGE_SIDE_PX, &stats->width) &&
           json_read_int(&height, 0, LIMIT_IMAGE_SIDE_PX, &stats->height) &&
           json_read_number(&exposure, -64, 64, &stats->exposure_ev);
}

bool frame_stats_from_json(json_t *json, struct frame_stats *stats, struct error *err)
{
    *stats = (struct frame_stats){0};
    struct json_node root = json_root(json, err);
    if (!json_expect_object(&root, NULL))
        return false;
    struct json_node timings = json_member(&root, "timings_ms");
    struct json_node counts = json_member(&root, "counts"), error = json_member(&root, "error");
    struct json_node chosen = json_member(&root, "chosen");
    struct json_node compression = json_member(&root, "compression");
    struct json_node textures = json_member(&root, "textures");
    if (read_head(&root, stats) && read_lists(&root, stats) && read_timings(&timings, stats) &&
        read_counts(&counts, stats) && read_compression(&compression, stats) &&
        read_textures(&textures, stats) && read_error(&error, stats) &&
        read_chosen(&chosen, &stats->chosen))
        return true;
    *stats = (struct frame_stats){0};
    return false;
}

/* ---- header ---- */

int frame_stats_server_timing(const struct frame_stats *stats, char *text, size_t size_bytes)
{
    char value[FRAME_SERVER_TIMING_BYTES];
    int used = 0;
    for (int i = 0; i < FRAME_TIMING_COUNT; i++) {
        double ms = stats->timings_ms[i];
        if (isnan(ms)) /* not known on this device */
            continue;
        ms = isfinite(ms) ? fmin(fmax(ms, 0), 1e12) : 0; /* bounds the text as well */
        used += snprintf(value + used, sizeof value - (size_t)used, "%s%s;dur=%.3f",
                         used ? ", " : "", timing_names[i], ms);
    }
    return snprintf(text, size_bytes, "%s", value);
}
