/* SPDX-License-Identifier: MIT */
/* What the server says: problems, frame stats, scene summaries and capabilities, and reading them.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <jansson.h>

#include "protocol/capabilities.h"
#include "protocol/frame_stats.h"
#include "protocol/problem.h"
#include "protocol/render_request.h"
#include "protocol/scene_summary.h"

#define ID "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef"

/* Takes the text. */
static json_t *load(char *text)
{
    assert_non_null(text);
    json_t *json = json_loads(text, JSON_REJECT_DUPLICATES, NULL);
    free(text);
    assert_non_null(json);
    return json;
}

static const char *string_of(const json_t *json, const char *key)
{
    return json_string_value(json_object_get(json, key));
}

/* ---- problems ---- */

static void problem_has_the_members_of_rfc_9457_and_ours(void **state)
{
    (void)state;
    struct error err = {0};
    (void)error_set_at(&err, ERROR_TOO_LARGE, "/lights", "9 \"lights\"");
    json_t *json = load(problem_to_json(&err, "r-17"));
    assert_string_equal(json_string_value(json_object_get(json, "type")),
                        "urn:vitrail:problem:too_large");
    assert_string_equal(json_string_value(json_object_get(json, "title")),
                        error_code_title(ERROR_TOO_LARGE));
    assert_int_equal(json_integer_value(json_object_get(json, "status")), 413);
    assert_string_equal(json_string_value(json_object_get(json, "code")), "too_large");
    assert_string_equal(json_string_value(json_object_get(json, "detail")), "9 \"lights\"");
    assert_string_equal(json_string_value(json_object_get(json, "pointer")), "/lights");
    assert_string_equal(json_string_value(json_object_get(json, "request_id")), "r-17");
    json_decref(json);
}

static void problem_leaves_out_what_is_not_known(void **state)
{
    (void)state;
    struct error err = {0};
    (void)error_set(&err, ERROR_INTERNAL, "x");
    json_t *json = load(problem_to_json(&err, NULL));
    assert_int_equal(json_object_size(json), 5);
    json_decref(json);
}

static void every_problem_reads_back(void **state)
{
    (void)state;
    for (int code = ERROR_INVALID_REQUEST; code < ERROR_CODE_COUNT; code++) {
        struct error err = {0};
        (void)error_set_at(&err, (enum error_code)code, "/a~1b", "caf\xC3\xA9 %d", code);
        json_t *json = load(problem_to_json(&err, NULL));
        assert_int_equal(error_code_from_name(string_of(json, "code")), code);
        assert_string_equal(string_of(json, "detail"), err.message);
        assert_string_equal(string_of(json, "pointer"), err.pointer);
        json_decref(json);
    }
}

/* ---- frame stats ---- */

/* As the front takes them from a message of the worker. */
static bool read_stats(const char *text, struct frame_stats *stats, struct error *err)
{
    json_t *json = json_loads(text, JSON_REJECT_DUPLICATES, NULL);
    *stats = (struct frame_stats){0};
    bool is_read = frame_stats_from_json(json, stats, err);
    json_decref(json);
    return is_read;
}

static void fill_stats(struct frame_stats *stats)
{
    *stats = (struct frame_stats){.scene = ID, .device = "llvmpipe", .width = 640, .height = 360};
    strcpy(stats->id, "f-1");
    stats->plan_count = FRAME_STATS_PASSES_MAX;
    for (int i = 0; i < FRAME_STATS_PASSES_MAX; i++) {
        snprintf(stats->plan[i].pass, sizeof stats->plan[i].pass, "shadow.%d", i);
        strcpy(stats->plan[i].because, "2 lights have transparent casters");
        strcpy(stats->plan[i].technique, i ? "deep" : "");
        stats->plan[i].ms = i * 0.125;
    }
    for (int i = 0; i < FRAME_TIMING_COUNT; i++)
        stats->timings_ms[i] = 1.5 * i;
    stats->counts.lights = 12;
    stats->counts.events = UINT64_C(1) << 40;
    stats->counts.longest_list = 64;
    stats->counts.mean_list = 3.25;
    stats->counts.shadow_maps_reused = 7;
    stats->compression = (struct report_compression){.maps = 2,
                                                     .events = 900,
                                                     .nodes = 300,
                                                     .exact_bytes = 15300,
                                                     .node_bytes = 5100,
                                                     .windows = 3,
                                                     .prefilter = 4,
                                                     .max_error = 0.02};
    stats->textures = (struct report_textures){.budget_bytes = 1000,
                                               .resident_bytes = 900,
                                               .wanted_bytes = 1200,
                                               .pending_bytes = 70,
                                               .written_bytes = 50,
                                               .coarse_count = 4,
                                               .level_bias = 2,
                                               .compressed_count = 3,
                                               .compressed_bytes = 300,
                                               .compressed_rmse = 0.015625,
                                               .upload_ms = 1.5};
    stats->byte_count = 2;
    strcpy(stats->bytes[0].structure, "shadow.deep");
    stats->bytes[0].bytes = UINT64_C(5) << 32;
    strcpy(stats->bytes[1].structure, "scene");
    stats->bytes[1].bytes = 17;
    stats->resident_bytes = UINT64_C(6) << 32;
    stats->has_exposure = true;
    stats->exposure_ev = -1.515625;
    stats->environment = (struct frame_stats_environment){.image = "studio", .samples = 16};
    stats->reused_count = 1;
    strcpy(stats->reused[0], "scene");
    stats->has_error = true;
    stats->error_source = FRAME_ERROR_MEASURED;
    stats->error_value = 0.0625;
    strcpy(stats->error_metric, "transmittance");
    frame_stats_warn(stats, "no light: %s", "default lighting");
}

static void stats_read_back_as_they_were(void **state)
{
    (void)state;
    struct frame_stats stats, read;
    struct error err = {0};
    fill_stats(&stats);
    char *text = frame_stats_to_json_text(&stats);
    assert_non_null(text);
    memset(&read, 0xA5, sizeof read);
    if (!read_stats(text, &read, &err))
        fail_msg("%s at '%s'", err.message, err.pointer);
    char *again = frame_stats_to_json_text(&read);
    assert_string_equal(text, again);
    assert_int_equal(read.counts.events, UINT64_C(1) << 40);
    assert_int_equal(read.compression.nodes, 300);
    assert_true(read.compression.max_error == 0.02);
    assert_memory_equal(&read.textures, &stats.textures, sizeof read.textures);
    assert_int_equal(read.bytes[0].bytes, UINT64_C(5) << 32);
    assert_int_equal(read.resident_bytes, UINT64_C(6) << 32);
    assert_true(read.has_exposure && read.exposure_ev == -1.515625);
    assert_string_equal(read.environment.image, "studio");
    assert_int_equal(read.environment.samples, 16);
    assert_int_equal(read.plan_count, FRAME_STATS_PASSES_MAX);
    assert_string_equal(read.plan[63].pass, "shadow.63");
    assert_true(read.timings_ms[FRAME_TIMING_TOTAL] == 13.5);
    assert_true(read.counts.mean_list == 3.25);
    assert_true(read.has_error && read.error_value == 0.0625);
    assert_int_equal(read.error_source, FRAME_ERROR_MEASURED);
    assert_string_equal(read.warnings[0], "no light: default lighting");
    free(text);
    free(again);
}

static void stats_have_the_documented_members(void **state)
{
    (void)state;
    static const char *const members[] = {
        "scene",    "view",       "revision",       "device",      "width",      "height",
        "plan",     "timings_ms", "counts",         "bytes",       "reused",     "error",
        "warnings", "id",         "resident_bytes", "exposure_ev", "environment"};
    struct frame_stats stats = {0};
    json_t *json = frame_stats_to_json(&stats);
    for (size_t i = 0; i < sizeof members / sizeof *members; i++)
        assert_non_null(json_object_get(json, members[i]));
    assert_true(json_is_null(json_object_get(json, "view")));
    assert_true(json_is_null(json_object_get(json, "error")));
    assert_true(json_is_null(json_object_get(json, "exposure_ev")));
    assert_true(json_is_null(json_object_get(json, "environment")));
    assert_non_null(json_object_get(json_object_get(json, "timings_ms"), "light-list"));
    assert_non_null(json_object_get(json_object_get(json, "counts"), "longest_list"));
    json_decref(json);
}

static void stats_never_write_what_json_cannot_hold(void **state)
{
    (void)state;
    struct frame_stats stats = {.plan_count = 1};
    stats.timings_ms[FRAME_TIMING_SHADE] = NAN;
    stats.plan[0].ms = INFINITY;
    stats.counts.lookups = UINT64_MAX;
    strcpy(stats.device, "bad \xFF byte");
    json_t *json = load(frame_stats_to_json_text(&stats));
    assert_string_equal(json_string_value(json_object_get(json, "device")), "bad ? byte");
    assert_true(json_is_null(json_object_get(json_object_get(json, "timings_ms"), "shade")));
    json_decref(json);
}

static void stats_of_a_newer_server_are_read(void **state)
{
    (void)state;
    static const char text[] = "{\"scene\":\"" ID "\",\"new\":{\"a\":[1]},\"counts\":{\"new\":1}}";
    struct frame_stats stats;
    struct error err = {0};
    assert_true(read_stats(text, &stats, &err));
    assert_string_equal(stats.scene, ID);
}

static void broken_stats_are_refused_with_a_pointer(void **state)
{
    (void)state;
    static const char *const bodies[][2] = {
        {"[]", ""},
        {"{\"plan\":{}}", "/plan"},
        {"{\"plan\":[7]}", "/plan/0"},
        {"{\"plan\":[{\"ms\":\"1\"}]}", "/plan/0/ms"},
        {"{\"timings_ms\":{\"shade\":[]}}", "/timings_ms/shade"},
        {"{\"counts\":{\"lights\":-1}}", "/counts/lights"},
        {"{\"bytes\":{\"a\":1.5}}", "/bytes/a"},
        {"{\"width\":1e9}", "/width"},
        {"{\"error\":{\"source\":\"guessed\"}}", "/error/source"},
        {"{\"warnings\":[1]}", "/warnings/0"},
    };
    for (size_t i = 0; i < sizeof bodies / sizeof *bodies; i++) {
        struct frame_stats stats;
        struct error err = {0};
        assert_false(read_stats(bodies[i][0], &stats, &err));
        assert_string_equal(err.pointer, bodies[i][1]);
        assert_int_equal(stats.plan_count + stats.warning_count + stats.byte_count, 0);
    }
}

static void longer_lists_than_ours_are_refused(void **state)
{
    (void)state;
    char text[4096] = "{\"reused\":[\"a\"";
    for (int i = 0; i < FRAME_STATS_REUSED_MAX; i++)
        strcat(text, ",\"a\"");
    strcat(text, "]}");
    struct frame_stats stats;
    struct error err = {0};
    assert_false(read_stats(text, &stats, &err));
    assert_int_equal(err.code, ERROR_TOO_LARGE);
}

static void dropped_warnings_are_reported(void **state)
{
    (void)state;
    struct frame_stats stats = {0};
    for (int i = 0; i < FRAME_STATS_WARNINGS_MAX; i++)
        frame_stats_warn(&stats, "warning %d", i);
    assert_int_equal(stats.warning_count, FRAME_STATS_WARNINGS_MAX);
    assert_string_equal(stats.warnings[FRAME_STATS_WARNINGS_MAX - 1], "warning 39");
    frame_stats_warn(&stats, "one more");
    assert_int_equal(stats.warning_count, FRAME_STATS_WARNINGS_MAX);
    assert_non_null(strstr(stats.warnings[FRAME_STATS_WARNINGS_MAX - 1], "dropped"));
}

static void stages_of_a_reply_are_its_total(void **state)
{
    (void)state;
    static const double queued_ms[] = {0, 3, 5, 9}; /* the last cannot be: it waited 5 at most */
    for (size_t q = 0; q < sizeof queued_ms / sizeof *queued_ms; q++) {
        struct frame_stats stats = {0};
        double sum = 0;
        stats.timings_ms[FRAME_TIMING_PREPARE] = 2;
        stats.timings_ms[FRAME_TIMING_SHADE] = 8;
        stats.timings_ms[FRAME_TIMING_TOTAL] = 10;
        stats.timings_ms[FRAME_TIMING_PAUSED] = 4;
        stats.timings_ms[FRAME_TIMING_ENCODE] = 1;
        frame_stats_close(&stats, queued_ms[q], 20);
        assert_true(stats.timings_ms[FRAME_TIMING_QUEUE] == fmin(queued_ms[q], 5));
        assert_true(stats.timings_ms[FRAME_TIMING_TOTAL] == 20);
        for (int i = 0; i < FRAME_TIMING_TOTAL; i++)
            sum += stats.timings_ms[i];
        assert_true(sum == 20);
    }
}

static void times_that_a_device_does_not_tell_are_absent(void **state)
{
    (void)state;
    struct frame_stats stats = {.plan_count = 2}, back;
    struct error err = {0};
    for (int i = 0; i < 2; i++)
        strcpy(stats.plan[i].pass, i ? "gbuffer" : "raytrace.build");
    stats.plan[0].ms = 3;
    stats.plan[1].ms = stats.timings_ms[FRAME_TIMING_SHADE] = NAN;
    stats.timings_ms[FRAME_TIMING_PREPARE] = stats.timings_ms[FRAME_TIMING_QUEUE] = NAN;
    char *json = frame_stats_to_json_text(&stats), text[FRAME_SERVER_TIMING_BYTES];
    assert_non_null(strstr(json, "\"shade\":null"));
    if (!read_stats(json, &back, &err))
        fail_msg("%s", err.message);
    assert_true(back.plan[0].ms == 3 && isnan(back.plan[1].ms));
    assert_true(isnan(back.timings_ms[FRAME_TIMING_SHADE]));
    free(json);
    frame_stats_server_timing(&back, text, sizeof text);
    assert_null(strstr(text, "shade"));
    assert_int_equal(strncmp(text, "paused;dur", 10), 0);
}

static void server_timing_lists_every_stage(void **state)
{
    (void)state;
    struct frame_stats stats = {0};
    stats.timings_ms[FRAME_TIMING_QUEUE] = 0.1;
    stats.timings_ms[FRAME_TIMING_TOTAL] = 12.3456;
    stats.timings_ms[FRAME_TIMING_SHADE] = NAN;
    stats.timings_ms[FRAME_TIMING_SHADOW] = -1;
    char text[FRAME_SERVER_TIMING_BYTES];
    int length = frame_stats_server_timing(&stats, text, sizeof text);
    assert_int_equal(length, strlen(text));
    assert_string_equal(text,
                        "queue;dur=0.100, paused;dur=0.000, prepare;dur=0.000, shadow;dur=0.000, "
                        "light-list;dur=0.000, readback;dur=0.000, "
                        "encode;dur=0.000, other;dur=0.000, total;dur=12.346");
}

static void server_timing_always_fits_and_always_ends(void **state)
{
    (void)state;
    struct frame_stats stats = {0};
    for (int i = 0; i < FRAME_TIMING_COUNT; i++)
        stats.timings_ms[i] = 1e300;
    char text[FRAME_SERVER_TIMING_BYTES];
    assert_true(frame_stats_server_timing(&stats, text, sizeof text) < (int)sizeof text);
    assert_true(frame_stats_server_timing(&stats, text, 8) > 8);
    assert_int_equal(strlen(text), 7);
}

/* ---- scene summaries ---- */

static void fill_summary(struct scene_summary *summary)
{
    struct error err = {0};
    *summary = (struct scene_summary){.id = ID,
                                      .triangles = UINT64_C(1) << 33,
                                      .vertices = 5,
                                      .nodes = 3,
                                      .meshes = 1,
                                      .primitives = 2,
                                      .textures = 4,
                                      .images = 6,
                                      .material_count = 5000,
                                      .light_count = 1,
                                      .camera_count = 1,
                                      .animation_count = 2,
                                      .has_bounds = true,
                                      .bounds_min = {-1e7, 0.1, 0},
                                      .bounds_max = {1e7 + 0.125, 2, 3},
                                      .upload_bytes = 77,
                                      .decoded_bytes = UINT64_C(1) << 34,
                                      .source = {.format = SCENE_FORMAT_STL,
                                                 .unit_m = 0.0254,
                                                 .up = 'z',
                                                 .unit_by = SCENE_WORD_REQUEST,
                                                 .up_by = SCENE_WORD_FILE},
                                      .created_unix_s = 1767225600};
    summary->name = strdup("chapel.glb");
    for (int i = 0; i < 9; i++) {
        char name[32];
        snprintf(name, sizeof name, "Glass %d \xC3\xA9", i);
        assert_true(name_list_add(&summary->materials, name, &err));
    }
    assert_true(name_list_add(&summary->node_names, "", &err));
    assert_true(scene_summary_add_file_scene(summary, "Day", false, &err));
    assert_true(scene_summary_add_file_scene(summary, "Night", true, &err));
    assert_true(name_list_add(&summary->extensions_used, "KHR_lights_punctual", &err));
    assert_true(name_list_add(&summary->extensions_ignored, "KHR_materials_sheen", &err));
    assert_true(name_list_add(&summary->warnings, "sheen is ignored", &err));
    assert_true(scene_summary_add_light(summary, "Sun", "directional", &err));
    assert_true(scene_summary_add_camera(summary, "Cam", "orthographic", &err));
    assert_true(scene_summary_add_animation(summary, "Walk", 1.25, &err));
    struct outline_node *node = scene_outline_add_node(&summary->outline, "Pane", &err);
    assert_non_null(node);
    node->parent = -1;
    node->material_count = 2;
    node->materials[1] = 1;
    node->has_bounds = true;
    node->bounds[5] = 0.1;
    node->matrix[12] = -1e-3;
    struct outline_node *rest = scene_outline_add_node(&summary->outline, "At rest", &err);
    assert_non_null(rest);
    rest->is_hidden = true;
    struct outline_material *glass = scene_outline_add_material(&summary->outline, "Glass", &err);
    assert_non_null(glass);
    glass->base_color[0] = 0.3;
    glass->alpha_mode = 2;
    struct outline_grid *smoke = scene_outline_add_grid(&summary->outline, "Smoke", &err);
    assert_non_null(smoke);
    smoke->density = 2.5;
    smoke->color[1] = 0.25;
    struct outline_light *sun = scene_outline_add_light(&summary->outline, "Sun", &err);
    assert_non_null(sun);
    sun->intensity = 3.5;
    sun->up[1] = 1;
    assert_non_null(scene_outline_add_light(&summary->outline, "Without up", &err));
    struct outline_camera *camera = scene_outline_add_camera(&summary->outline, "Cam", &err);
    assert_non_null(camera);
    camera->ortho_height = 2;
    camera->aspect = 1.5;
}

static void summaries_read_back_as_they_were(void **state)
{
    (void)state;
    struct scene_summary summary, read;
    struct error err = {0};
    fill_summary(&summary);
    char *text = scene_summary_to_json_text(&summary);
    assert_non_null(text);
    if (!scene_summary_from_json_text(text, strlen(text), &read, &err))
        fail_msg("%s at '%s'", err.message, err.pointer);
    char *again = scene_summary_to_json_text(&read);
    assert_string_equal(again, text);
    assert_int_equal(read.materials.count, 9);
    assert_string_equal(read.materials.names[8], "Glass 8 \xC3\xA9");
    assert_true(read.bounds_max[0] == 1e7 + 0.125);
    assert_string_equal(read.lights[0].type, "directional");
    assert_true(read.outline.nodes[0].matrix[12] == -1e-3);
    assert_true(read.outline.nodes[1].matrix[15] == 1);
    assert_true(!read.outline.nodes[0].is_hidden && read.outline.nodes[1].is_hidden);
    assert_true(read.outline.lights[0].up[1] == 1);
    assert_true(read.outline.cameras[0].aspect == 1.5);
    assert_int_equal(read.outline.grid_count, 1);
    assert_true(read.outline.grids[0].density == 2.5 && read.outline.grids[0].color[1] == 0.25);
    assert_true(read.outline.lights[1].up[1] == 0);
    assert_null(strstr(strstr(text, "At rest"), "\"matrix\":[1")); /* cameras come with zeros */
    assert_null(strstr(strstr(text, "Without up"), "\"up\""));
    assert_non_null(strstr(text, "\"unit\":\"in\""));
    assert_int_equal(read.source.format, SCENE_FORMAT_STL);
    assert_true(read.source.unit_m == 0.0254 && read.source.up == 'z');
    assert_int_equal(read.source.unit_by, SCENE_WORD_REQUEST);
    assert_int_equal(read.source.up_by, SCENE_WORD_FILE);
    assert_int_equal(read.file_scene, 1);
    assert_string_equal(read.file_scenes.names[1], "Night");
    assert_int_equal(read.created_unix_s, 1767225600);
    assert_non_null(strstr(text, "\"created\":\"2026-01-01T00:00:00Z\""));
    free(text);
    free(again);
    scene_summary_finish(&summary);
    scene_summary_finish(&read);
}

static void empty_summary_has_null_bounds_and_empty_lists(void **state)
{
    (void)state;
    struct scene_summary summary = {0};
    json_t *json = scene_summary_to_json(&summary);
    assert_true(json_is_null(json_object_get(json, "bounds")));
    assert_true(json_is_null(json_object_get(json, "name")));
    assert_int_equal(json_array_size(json_object_get(json, "materials")), 0);
    json_decref(json);
    char *text = scene_summary_to_json_text(&summary);
    assert_non_null(text);
    struct scene_summary read;
    struct error err = {0};
    assert_true(scene_summary_from_json_text(text, strlen(text), &read, &err));
    assert_false(read.has_bounds);
    free(text);
    scene_summary_finish(&read);
}

static void broken_summaries_are_refused_and_leave_nothing(void **state)
{
    (void)state;
    static const char *const bodies[][2] = {
        {"{\"materials\":[\"a\",\"b\",3]}", "/materials/2"},
        {"{\"lights\":[{\"name\":\"a\",\"type\":\"point\"},{\"name\":\"b\"}]}", "/lights/1/type"},
        {"{\"lights\":[{\"name\":\"a\",\"type\":\"laser\"}]}", ""},
        {"{\"name\":\"a\",\"bounds\":{\"min\":[0,0,0]}}", "/bounds/max"},
        {"{\"bounds\":7}", "/bounds"},
        {"{\"created\":\"yesterday\"}", "/created"},
        {"{\"triangles\":-3}", "/triangles"},
        {"{\"outline\":[]}", "/outline"},
        {"{\"outline\":{\"nodes\":[{\"name\":3}]}}", "/outline/nodes/0/name"},
        {"{\"outline\":{\"nodes\":[{\"name\":\"a\"},{\"name\":\"b\",\"parent\":-2}]}}",
         "/outline/nodes/1/parent"},
        {"{\"outline\":{\"nodes\":[{\"name\":\"a\",\"bounds\":[0,1]}]}}",
         "/outline/nodes/0/bounds"},
        {"{\"outline\":{\"materials\":[{\"name\":\"a\",\"alpha_mode\":\"wet\"}]}}",
         "/outline/materials/0/alpha_mode"},
        {"{\"outline\":{\"lights\":[{\"name\":\"a\",\"intensity\":\"b\"}]}}",
         "/outline/lights/0/intensity"},
        {"{\"outline\":{\"cameras\":[{\"name\":\"a\",\"matrix\":[1]}]}}",
         "/outline/cameras/0/matrix"},
    };
    for (size_t i = 0; i < sizeof bodies / sizeof *bodies; i++) {
        struct scene_summary summary;
        struct error err = {0};
        assert_false(
            scene_summary_from_json_text(bodies[i][0], strlen(bodies[i][0]), &summary, &err));
        assert_int_equal(err.code, ERROR_INVALID_REQUEST);
        assert_string_equal(err.pointer, bodies[i][1]);
        assert_null(summary.materials.names);
        assert_null(summary.lights);
        assert_null(summary.name);
        assert_null(summary.outline.nodes);
    }
}

/* ---- capabilities ---- */

/* Copied as bytes, so that what lies between the members is zero as in what is read. */
static void fill_device(struct device_capabilities *device)
{
    static const struct device_capabilities filled = {
        .vendor = "Mesa",
        .renderer = "llvmpipe",
        .version = "4.5",
        .driver = "surfaceless",
        .device_count = 1,
        .devices = {"EGL device 1: passed over: it crashed", "EGL device 2: taken"},
        .passed_over = 1 << 0,
        .max_texture_size = 16384,
        .max_samples = 4,
        .vector_bits = 256,
        .max_storage_block_bytes = UINT64_C(1) << 31,
        .gpu_budget_bytes = UINT64_C(4) << 30,
        .gpu_used_bytes = 12345,
        .upload_bytes_per_ms = 7000000,
        .compresses_textures = true,
        .has_post_depth_coverage = true,
        .has_program_binaries = true,
        .wide_floats = "pairs",
        .pairs_over_f64 = 0.75,
        .automatic = {.policy = "measured",
                      .note = "measured at this start in 9 ms",
                      .is_measured = true,
                      .frame_ms = 0.25,
                      .shade = 1.5,
                      .maps = 2,
                      .trace = 0.75,
                      .build = 3,
                      .pixel_ns = 58,
                      .lookup_ns = 400.5,
                      .texel_ns = 2,
                      .event_ns = 28,
                      .camera_ray_ns = 300,
                      .shadow_ray_ns = 234,
                      .triangle_ns = 281},
        .blocks = {.policy = "auto",
                   .note = "measured at an earlier start",
                   .from_levels = 5,
                   .is_measured = true,
                   .whole_ns = 0.5,
                   .bc1_ns = 0.25,
                   .bc3_ns = 0.375,
                   .encode_bytes_per_ms = 150000}};
    memcpy(device, &filled, sizeof filled);
}

static void device_reads_back_as_it_was(void **state)
{
    (void)state;
    struct device_capabilities device, read;
    struct error err = {0};
    fill_device(&device);
    json_t *json = device_capabilities_to_json(&device);
    assert_true(device_capabilities_from_json(json, &read, &err));
    assert_memory_equal(&read, &device, sizeof read);
    json_decref(json);

    static const struct device_auto raster = {.policy = "raster", .is_pending = true};
    static const struct device_blocks off = {.policy = "off"};
    memcpy(&device.automatic, &raster, sizeof raster);
    memcpy(&device.blocks, &off, sizeof off);
    json = device_capabilities_to_json(&device);
    assert_true(device_capabilities_from_json(json, &read, &err));
    assert_memory_equal(&read, &device, sizeof read);
    json_decref(json);

    json = json_pack("{s:s}", "max_samples", "many");
    assert_false(device_capabilities_from_json(json, &read, &err));
    assert_string_equal(err.pointer, "/max_samples");
    json_decref(json);
}

/* What capabilities name is what the parser takes: nothing is promised that is refused. */
static void every_technique_named_is_accepted_by_the_parser(void **state)
{
    (void)state;
    static const char *const extensions[] = {"KHR_lights_punctual", NULL};
    struct device_capabilities device;
    fill_device(&device);
    json_t *json = capabilities_to_json(
        &(struct capabilities){.version = "1", .device = &device, .extensions = extensions});
    json_t *techniques = json_object_get(json, "techniques"), *list;
    const char *key;
    int accepted = 0;
    json_object_foreach(techniques, key, list)
    {
        for (size_t i = 0; json_is_array(list) && i < json_array_size(list); i++) {
            char body[256];
            json_t *technique = json_array_get(list, i);
            assert_true(json_string_length(json_object_get(technique, "does")) > 0);
            snprintf(body, sizeof body, "{\"scene\":\"" ID "\",\"quality\":{\"%s\":\"%s\"}}", key,
                     json_string_value(json_object_get(technique, "name")));
            struct render_request request;
            struct error err = {0};
            if (!render_request_parse(body, strlen(body), &request, &err))
                fail_msg("%s: %s", body, err.message);
            render_request_finish(&request);
            accepted++;
        }
    }
    assert_int_equal(accepted, SHADOWS_COUNT + TRANSPARENCIES_COUNT + 20);
    assert_int_equal(json_array_size(json_object_get(json, "formats")), 5);
    assert_int_equal(json_array_size(json_object_get(json, "scene_formats")),
                     1 + 8 * VITRAIL_WITH_ASSIMP + 2 * VITRAIL_WITH_OPENCASCADE +
                         scene_format_describe(SCENE_FORMAT_OPENVDB)->is_built);
    assert_int_equal(json_array_size(json_object_get(json, "overlays")), 2);
    json_t *parameters = json_object_get(json_object_get(json, "techniques"), "parameters");
    json_t *samples = json_object_get(parameters, "samples");
    assert_int_equal(json_integer_value(json_object_get(samples, "max")), 256);
    assert_int_equal(json_array_size(json_object_get(samples, "allowed")), 6);
    assert_int_equal(json_array_size(json_object_get(json, "outputs")), REQUEST_OUTPUT_COUNT);
    assert_int_equal(json_array_size(json_object_get(json, "extensions")), 1);
    json_decref(json);
}

static void capabilities_without_a_device_say_null(void **state)
{
    (void)state;
    json_t *json = capabilities_to_json(&(struct capabilities){.version = "1"});
    assert_true(json_is_null(json_object_get(json, "device")));
    json_decref(json);
}

/* ---- allocations that fail, in turn ---- */

/* jansson's allocator has no user pointer, so the countdown of this one test is a global. */
static long allocations_left = -1;

static void *failing_malloc(size_t size)
{
    if (allocations_left == 0)
        return NULL;
    if (allocations_left > 0)
        allocations_left--;
    return malloc(size);
}

static char *text_of_capabilities(const struct capabilities *capabilities)
{
    json_t *json = capabilities_to_json(capabilities);
    char *text = json ? json_dumps(json, JSON_COMPACT) : NULL;
    json_decref(json);
    return text;
}

static void writers_return_null_when_memory_runs_out(void **state)
{
    (void)state;
    struct frame_stats stats;
    struct scene_summary summary;
    struct device_capabilities device;
    fill_stats(&stats);
    fill_summary(&summary);
    fill_device(&device);
    const struct capabilities capabilities = {.version = "1", .device = &device};
    json_set_alloc_funcs(failing_malloc, free);
    for (int writer = 0; writer < 3; writer++) {
        char *text = NULL;
        long failures = 0;
        for (; !text; failures++) {
            allocations_left = failures;
            text = writer == 0   ? frame_stats_to_json_text(&stats)
                   : writer == 1 ? scene_summary_to_json_text(&summary)
                                 : text_of_capabilities(&capabilities);
            allocations_left = -1;
        }
        assert_true(failures > 50);
        free(text);
    }
    json_set_alloc_funcs(malloc, free);
    scene_summary_finish(&summary);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(problem_has_the_members_of_rfc_9457_and_ours),
        cmocka_unit_test(problem_leaves_out_what_is_not_known),
        cmocka_unit_test(every_problem_reads_back),
        cmocka_unit_test(stats_read_back_as_they_were),
        cmocka_unit_test(stats_have_the_documented_members),
        cmocka_unit_test(stats_never_write_what_json_cannot_hold),
        cmocka_unit_test(stats_of_a_newer_server_are_read),
        cmocka_unit_test(broken_stats_are_refused_with_a_pointer),
        cmocka_unit_test(longer_lists_than_ours_are_refused),
        cmocka_unit_test(dropped_warnings_are_reported),
        cmocka_unit_test(stages_of_a_reply_are_its_total),
        cmocka_unit_test(times_that_a_device_does_not_tell_are_absent),
        cmocka_unit_test(server_timing_lists_every_stage),
        cmocka_unit_test(server_timing_always_fits_and_always_ends),
        cmocka_unit_test(summaries_read_back_as_they_were),
        cmocka_unit_test(empty_summary_has_null_bounds_and_empty_lists),
        cmocka_unit_test(broken_summaries_are_refused_and_leave_nothing),
        cmocka_unit_test(device_reads_back_as_it_was),
        cmocka_unit_test(every_technique_named_is_accepted_by_the_parser),
        cmocka_unit_test(capabilities_without_a_device_say_null),
        cmocka_unit_test(writers_return_null_when_memory_runs_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
