/* SPDX-License-Identifier: MIT */
/* Trade-offs on the wire: requests and what they refuse, documents both ways, fronts, statistics.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "protocol/tradeoff.h"

#define SCENE "\"scene\":\"aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa\""
#define BODY(more) "{" SCENE more "}"

static void a_scene_alone_is_measured_with_every_default(void **state)
{
    (void)state;
    struct tradeoff_request request;
    struct error err = {0};
    const char *body = BODY("");
    assert_true(tradeoff_request_parse(body, strlen(body), &request, &err));
    assert_int_equal(request.render.width, 1280);
    assert_int_equal(request.options.time_budget_s, 480);
    assert_int_equal(request.options.repeats, 3);
    assert_int_equal(request.options.max_settings, 32);
    assert_int_equal(request.options.reference_samples, 16);
    assert_false(request.options.drops_images);
    assert_false(request.render.quality.says_shadow_resolution);
    tradeoff_request_finish(&request);
}

static void options_and_what_is_held_fixed_arrive(void **state)
{
    (void)state;
    struct tradeoff_request request;
    struct error err = {0};
    const char *body =
        BODY(",\"width\":64,\"quality\":{\"shadow_taps\":4,\"shadows\":\"deep\"},\"tradeoff\":"
             "{\"time_budget_s\":3600,\"repeats\":20,\"max_settings\":128,"
             "\"reference_samples\":256,\"keep_images\":false}");
    assert_true(tradeoff_request_parse(body, strlen(body), &request, &err));
    assert_int_equal(request.render.width, 64);
    assert_int_equal(request.options.time_budget_s, 3600);
    assert_int_equal(request.options.repeats, TRADEOFF_REPEATS_MAX);
    assert_int_equal(request.options.max_settings, 128);
    assert_int_equal(request.options.reference_samples, 256);
    assert_true(request.options.drops_images);
    assert_true(request.render.quality.says_shadow_taps);
    assert_false(request.render.quality.says_shadow_resolution);
    tradeoff_request_finish(&request);
}

static void what_cannot_be_measured_is_refused_where_it_stands(void **state)
{
    (void)state;
    static const struct {
        const char *body, *pointer;
    } bad[] = {
        {BODY(",\"quality\":{\"max_error\":0.1}"), "/quality/max_error"},
        {BODY(",\"quality\":{\"budget_ms\":10}"), "/quality/budget_ms"},
        {BODY(",\"quality\":{\"reference\":true}"), "/quality/reference"},
        {BODY(",\"output\":\"depth\""), "/output"},
        {BODY(",\"outputs\":[\"color\",\"depth\"]"), "/outputs"},
        {BODY(",\"format\":\"png\""), "/format"},
        {BODY(",\"tradeoff\":{\"time_budget_s\":0}"), "/tradeoff/time_budget_s"},
        {BODY(",\"tradeoff\":{\"time_budget_s\":3601}"), "/tradeoff/time_budget_s"},
        {BODY(",\"tradeoff\":{\"time_budget_s\":1e999}"), ""},
        {BODY(",\"tradeoff\":{\"repeats\":21}"), "/tradeoff/repeats"},
        {BODY(",\"tradeoff\":{\"repeats\":2.5}"), "/tradeoff/repeats"},
        {BODY(",\"tradeoff\":{\"max_settings\":129}"), "/tradeoff/max_settings"},
        {BODY(",\"tradeoff\":{\"reference_samples\":17}"), "/tradeoff/reference_samples"},
        {BODY(",\"tradeoff\":{\"reference_samples\":-16}"), "/tradeoff/reference_samples"},
        {BODY(",\"tradeoff\":{\"keep_images\":1}"), "/tradeoff/keep_images"},
        {BODY(",\"tradeoff\":{\"speed\":1}"), "/tradeoff/speed"},
        {BODY(",\"tradeoff\":[]"), "/tradeoff"},
        {BODY(",\"tradeof\":{}"), "/tradeof"},
        {BODY(",\"quality\":{\"shadows\":\"raytraced\",\"samples\":16}"), "/quality/samples"},
        {"[]", ""},
        {"", ""},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct tradeoff_request request;
        struct error err = {0};
        assert_false(tradeoff_request_parse(bad[i].body, strlen(bad[i].body), &request, &err));
        assert_int_equal(error_code_http_status(err.code), 400);
        assert_string_equal(err.pointer, bad[i].pointer);
    }
}

/* ---- documents ---- */

static void add_row(struct tradeoff *tradeoff, double ms, double rmse)
{
    struct tradeoff_row *row = &tradeoff->rows[tradeoff->row_count++];
    *row = (struct tradeoff_row){.setting = {.shadows = SHADOWS_DEEP,
                                             .shadow_resolution = 512,
                                             .shadow_taps = 4,
                                             .samples = 4},
                                 .rmse = rmse,
                                 .p999 = 2 * rmse,
                                 .max = 3 * rmse,
                                 .flip = -1,
                                 .bytes = 1234};
    for (int i = 0; ms > 0 && i < 3; i++)
        row->warm.ms[row->warm.count++] = row->cold.ms[row->cold.count++] = ms + i - 1;
}

static struct tradeoff *make_document(void)
{
    struct tradeoff *tradeoff = calloc(1, sizeof *tradeoff);
    assert_non_null(tradeoff);
    memset(tradeoff->id, 'a', sizeof tradeoff->id - 1);
    memset(tradeoff->scene, 'b', sizeof tradeoff->scene - 1);
    memset(tradeoff->view_key, 'c', sizeof tradeoff->view_key - 1);
    strcpy(tradeoff->device, "a device, <1>");
    strcpy(tradeoff->created, "2026-01-01T00:00:00Z");
    tradeoff->width = 64;
    tradeoff->height = 48;
    tradeoff->state = TRADEOFF_FAILED;
    tradeoff->stage = TRADEOFF_STAGE_ENDED;
    tradeoff->is_partial = true;
    tradeoff->options = (struct tradeoff_options){300, 3, 32, 16, true};
    tradeoff->progress = 0.5;
    tradeoff->lights = 7;
    error_set(&tradeoff->problem, ERROR_TIMEOUT, "too slow");
    add_row(tradeoff, 20, 0.1);
    add_row(tradeoff, 10, 0.2);
    add_row(tradeoff, 30, 0.15);
    tradeoff->rows[2].setting.atmosphere_samples = 16;
    add_row(tradeoff, 0, 0.01);
    tradeoff_skip(tradeoff, "map", "%d reasons", 2);
    tradeoff_warn(tradeoff, "careful");
    tradeoff_mark_front(tradeoff);
    return tradeoff;
}

static void destroy(struct tradeoff *tradeoff)
{
    tradeoff_finish(tradeoff);
    free(tradeoff);
}

static void a_document_reads_back_as_itself(void **state)
{
    (void)state;
    struct tradeoff *first = make_document(), *second = calloc(1, sizeof *second);
    struct error err = {0};
    json_t *json = tradeoff_to_json(first);
    assert_non_null(second);
    assert_true(tradeoff_from_json(json, second, &err));
    json_t *again = tradeoff_to_json(second);
    assert_true(json_equal(json, again));
    assert_int_equal(second->row_count, 4);
    assert_int_equal(second->rows[1].setting.atmosphere_samples, 0);
    assert_int_equal(second->rows[2].setting.atmosphere_samples, 16);
    assert_int_equal(second->problem.code, ERROR_TIMEOUT);
    json_decref(json);
    json_decref(again);
    destroy(first);
    destroy(second);
}

/* Each change to a good document makes one that the server cannot have written. */
static void damaged_documents_are_refused(void **state)
{
    (void)state;
    static const char *const damage[][2] = {
        {"id", "\"xyz\""},
        {"scene", "null"},
        {"view_key", "\"short\""},
        {"state", "\"asleep\""},
        {"stage", "7"},
        {"width", "0"},
        {"width", "99999"},
        {"progress", "2"},
        {"settings", "{}"},
        {"settings", "[{}]"},
        {"settings", "[1]"},
        {"skipped", "[1]"},
        {"reference", "null"},
        {"tradeoff", "{\"repeats\": 99}"},
        {"counts", "{\"lights\":-1}"},
        {"warnings", "[[]]"},
        {"problem", "\"bad\""},
    };
    struct tradeoff *document = make_document(), *read = calloc(1, sizeof *read);
    assert_non_null(read);
    for (size_t i = 0; i < sizeof damage / sizeof damage[0]; i++) {
        struct error err = {0};
        json_t *json = tradeoff_to_json(document);
        json_object_set_new(json, damage[i][0], json_loads(damage[i][1], JSON_DECODE_ANY, NULL));
        assert_false(tradeoff_from_json(json, read, &err));
        assert_true(err.code != ERROR_NONE);
        assert_int_equal(read->row_count, 0);
        json_decref(json);
    }
    destroy(document);
    destroy(read);
}

static void the_front_is_what_nothing_beats_in_both(void **state)
{
    (void)state;
    struct tradeoff *document = make_document();
    assert_true(document->rows[0].is_on_front);
    assert_true(document->rows[1].is_on_front);
    assert_false(document->rows[2].is_on_front); /* the first is faster and better */
    assert_false(document->rows[3].is_on_front); /* not timed */
    document->rows[1] = document->rows[0];
    tradeoff_mark_front(document);
    assert_true(document->rows[0].is_on_front && !document->rows[1].is_on_front);
    destroy(document);
}

static void medians_and_spreads_are_those_of_the_runs(void **state)
{
    (void)state;
    const struct tradeoff_times odd = {{5, 1, 100}, 3}, even = {{4, 1, 2, 3}, 4}, none = {{0}, 0};
    assert_true(tradeoff_times_median(&odd) == 5 && tradeoff_times_spread(&odd) == 4);
    assert_true(tradeoff_times_median(&even) == 2.5 && tradeoff_times_spread(&even) == 1);
    assert_true(tradeoff_times_max(&odd) == 100);
    assert_true(tradeoff_times_median(&none) == 0 && tradeoff_times_spread(&none) == 0);
}

static void csv_has_a_line_per_setting_and_a_cell_per_name(void **state)
{
    (void)state;
    struct tradeoff *document = make_document();
    char *csv = tradeoff_to_csv(document), *rest = csv, *line;
    int lines = 0;
    while ((line = strsep(&rest, "\n")) && *line) {
        int commas = 0;
        for (const char *c = line; *c; c++)
            commas += *c == ',';
        assert_int_equal(commas, 21);
        lines++;
    }
    assert_int_equal(lines, 5);
    free(csv);
    destroy(document);
}

static void labels_tell_media_where_they_are_not_the_default(void **state)
{
    (void)state;
    char label[TRADEOFF_LABEL_BYTES];
    struct quality_setting setting = {
        .shadows = SHADOWS_DEEP, .shadow_resolution = 512, .shadow_taps = 4, .samples = 1};
    tradeoff_setting_label(&setting, label);
    assert_string_equal(label, "deep 512, 4 taps, 1 sample");
    setting.atmosphere_samples = 16;
    tradeoff_setting_label(&setting, label);
    assert_string_equal(label, "deep 512, 4 taps, 1 sample, media 16");
    setting.transparency = TRANSPARENCY_SORTED;
    tradeoff_setting_label(&setting, label);
    assert_string_equal(label, "deep 512, 4 taps, sorted, 1 sample, media 16");
    setting =
        (struct quality_setting){SHADOWS_COLORED_STOCHASTIC,     16384, 256, 16, 0.0001, 4, 4096,
                                 TRANSPARENCY_DUAL_DEPTH_PEELING};
    tradeoff_setting_label(&setting, label);
    assert_string_equal(label, "colored-stochastic 16384, 256 taps, k 4, e 0.0001, "
                               "dual-depth-peeling, 16 samples, media 4096");
}

static void lists_stop_at_their_caps(void **state)
{
    (void)state;
    struct tradeoff *document = make_document();
    for (int i = 0; i < 1000; i++) {
        tradeoff_skip(document, "what", "because %d", i);
        tradeoff_warn(document, "warning %d", i);
    }
    assert_int_equal(document->skip_count, TRADEOFF_SKIPS_MAX);
    assert_int_equal(document->warning_count, TRADEOFF_WARNINGS_MAX);
    destroy(document);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_scene_alone_is_measured_with_every_default),
        cmocka_unit_test(options_and_what_is_held_fixed_arrive),
        cmocka_unit_test(what_cannot_be_measured_is_refused_where_it_stands),
        cmocka_unit_test(a_document_reads_back_as_itself),
        cmocka_unit_test(damaged_documents_are_refused),
        cmocka_unit_test(the_front_is_what_nothing_beats_in_both),
        cmocka_unit_test(medians_and_spreads_are_those_of_the_runs),
        cmocka_unit_test(csv_has_a_line_per_setting_and_a_cell_per_name),
        cmocka_unit_test(labels_tell_media_where_they_are_not_the_default),
        cmocka_unit_test(lists_stop_at_their_caps),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
