/* SPDX-License-Identifier: MIT */
/* The file that keeps what `auto` has learned: server/mapping/observations_file. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>
#include <jansson.h>

#include "server/mapping/lesson_mapping.h"
#include "server/mapping/observations_file.h"

static struct learning *make_learned(void)
{
    struct learning *learned = malloc(sizeof *learned);
    assert_non_null(learned);
    learning_init(learned);
    static const enum shadow_technique techniques[] = {SHADOWS_RASTER_DEFAULT, SHADOWS_RAYTRACED,
                                                       SHADOWS_RAYTRACED_SHADOWS};
    for (uint64_t i = 0; i < 12; i++)
        learning_teach(learned,
                       &(struct learning_case){.terms = {1, 2, 3, [FORECAST_TERM_WALKS] = 5.5},
                                               .technique = techniques[i % 3],
                                               .view = 2 * (i % 5)},
                       7.25 + (double)i);
    learning_show(learned, &(struct learning_case){.technique = SHADOWS_RAYTRACED, .view = 2});
    return learned;
}

static char path[64];

static int make_path(void **state)
{
    (void)state;
    snprintf(path, sizeof path, "/tmp/vitrail-observations-%d.json", (int)getpid());
    return 0;
}

static int remove_path(void **state)
{
    (void)state;
    unlink(path);
    return 0;
}

static void observations_read_back_for_their_device_alone(void **state)
{
    (void)state;
    struct learning *learned = make_learned(), *read = malloc(sizeof *read);
    struct error err = {0};
    assert_non_null(read);
    assert_false(observations_file_load(read, path, "this"));
    assert_true(observations_file_save(learned, path, "this", &err));
    assert_true(observations_file_load(read, path, "this"));
    for (uint64_t view = 0; view < 10; view += 2) {
        const struct learning_case frame = {
            .terms = {4, 5, 6}, .technique = SHADOWS_RAYTRACED, .view = view};
        const struct learning_answer a = learning_expect(learned, &frame);
        const struct learning_answer b = learning_expect(read, &frame);
        assert_true(a.ms == b.ms && a.doubt == b.doubt && a.observations == b.observations);
        assert_int_equal(a.is_shown, view == 2);
        assert_int_equal(b.is_shown, view == 2);
    }
    assert_int_equal(read->clock, learned->clock);
    assert_false(observations_file_load(read, path, "another driver"));
    assert_int_equal(read->clock, 0); /* nothing is learned then */
    assert_false(observations_file_save(learned, "/tmp/no-such-folder-here/x", "this", &err));
    assert_non_null(strstr(err.message, "no-such-folder-here"));
    free(learned);
    free(read);
}

static void write_text(const char *text, size_t size)
{
    FILE *file = fopen(path, "we");
    assert_non_null(file);
    fwrite(text, 1, size, file);
    fclose(file);
}

static void a_file_that_was_cut_anywhere_teaches_nothing(void **state)
{
    (void)state;
    struct learning *learned = make_learned(), *read = malloc(sizeof *read);
    struct error err = {0};
    assert_non_null(read);
    assert_true(observations_file_save(learned, path, "this", &err));
    json_t *json = json_load_file(path, 0, NULL);
    char *text = json_dumps(json, JSON_COMPACT);
    assert_non_null(text);
    size_t size = strlen(text);
    for (size_t cut = 0; cut < size; cut += 1 + size / 97) {
        write_text(text, cut);
        assert_false(observations_file_load(read, path, "this"));
        assert_true(learning_is_sound(read) && read->clock == 0);
    }
    free(text);
    json_decref(json);
    free(learned);
    free(read);
}

/* The file with one member replaced. */
static void assert_refused(const json_t *good, const char *member, const char *text)
{
    struct learning *read = malloc(sizeof *read);
    json_t *bad = json_deep_copy(good), *value = json_loads(text, JSON_DECODE_ANY, NULL);
    assert_non_null(read);
    assert_non_null(value);
    assert_int_equal(json_object_set_new(bad, member, value), 0);
    assert_int_equal(json_dump_file(bad, path, 0), 0);
    if (observations_file_load(read, path, "this"))
        fail_msg("%s: %s was taken", member, text);
    assert_true(learning_is_sound(read) && read->clock == 0);
    json_decref(bad);
    free(read);
}

static void what_observations_cannot_make_is_refused(void **state)
{
    (void)state;
    struct learning *learned = make_learned();
    struct error err = {0};
    assert_true(observations_file_save(learned, path, "this", &err));
    json_t *good = json_load_file(path, 0, NULL);
    assert_non_null(good);
    static const char *const bad[][2] = {
        {"observations", "0"},
        {"observations", "-3"},
        {"observations", "1"}, /* less than its views have */
        {"observations", "\"9\""},
        {"factor", "[]"},
        {"factor", "[1,2,3]"},
        {"factor", "{}"},
        {"run", "[0,0,99,0,0,0]"},
        {"run", "[0,7,0,0,0,0]"},
        {"run", "[0,0,5000000000,0,0,0]"},
        {"doubt", "[]"},
        {"doubt", "7"},
        {"views", "7"},
        {"views", "[[]]"},
        {"views", "[[\"0123456789abcdef\",1e9,1,1,0]]"},
        {"views", "[[\"0123456789abcdef\",\"1\",1,1,0]]"},
        {"views", "[[\"0123456789abcdef\",1,-1,1,0]]"},
        {"views", "[[\"0123456789abcdef\",1,1,1,77777]]"},
        {"views", "[[\"0123456789abcdeg\",1,1,1,0]]"},
        {"views", "[[\"0000000000000000\",1,1,1,0]]"},
        {"views", "[[\"\",1,1,1,0]]"},
        {"views", "[[7,1,1,1,0]]"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        assert_refused(good, bad[i][0], bad[i][1]);
    json_t *factor = json_deep_copy(json_object_get(good, "factor"));
    json_array_set_new(factor, 2, json_real(1e300));
    char *text = json_dumps(factor, 0);
    assert_refused(good, "factor", text);
    free(text);
    json_decref(factor);
    json_decref(good);
    free(learned);
}

static void no_more_than_a_file_of_ours_is_read(void **state)
{
    (void)state;
    struct learning *read = malloc(sizeof *read);
    char *large = malloc(3 << 20);
    assert_non_null(read);
    assert_non_null(large);
    memset(large, ' ', 3 << 20);
    write_text(large, 3 << 20);
    assert_false(observations_file_load(read, path, "this"));
    assert_false(observations_file_load(read, "/tmp", "this")); /* a folder */
    free(large);
    free(read);
}

/* On its way from worker to worker. */
static void a_lesson_keeps_its_bits_and_bad_ones_are_none(void **state)
{
    (void)state;
    struct frame_lesson lesson = {.is_timed = true, .alone_ms = 1 / 3.}, read;
    for (int i = 0; i < SHADOWS_COUNT; i++)
        if (shadow_technique_is_candidate((enum shadow_technique)i))
            lesson.frames[i] = (struct learning_case){.terms = {i / 7., 1e-9},
                                                      .technique = (enum shadow_technique)i,
                                                      .is_left_out = i % 2,
                                                      .view = UINT64_MAX - (uint64_t)i};
    lesson.frame = lesson.frames[SHADOWS_RAYTRACED];
    json_t *written = lesson_to_json(&lesson);
    char *text = json_dumps(written, JSON_COMPACT);
    json_t *json = json_loads(text, 0, NULL);
    assert_true(lesson_from_json(json, &read));
    assert_true(read.alone_ms == lesson.alone_ms && read.is_timed);
    struct learning one, other;
    learning_init(&one);
    learning_init(&other);
    for (int i = 0; i < SHADOWS_COUNT; i++) {
        learning_teach(&one, &lesson.frames[i], 5);
        learning_teach(&other, &read.frames[i], 5);
    }
    learning_teach(&one, &lesson.frame, lesson.alone_ms);
    learning_teach(&other, &read.frame, read.alone_ms);
    assert_memory_equal(&one, &other, sizeof one);
    json_array_set_new(json_array_get(json_object_get(json, "cases"), 1), 3, json_real(-1));
    assert_false(lesson_from_json(json, &read));
    assert_false(lesson_from_json(NULL, &read));
    json_decref(json);
    json_decref(written);
    free(text);
}

static void a_lesson_of_a_time_keeps_its_bits_and_bad_ones_are_none(void **state)
{
    (void)state;
    const struct time_lesson lesson = {
        .frame = {.terms = {1 / 3., 0}, .technique = SHADOWS_NONE, .view = UINT64_MAX - 5},
        .took_ms = 1 / 7.,
        .fresh_bytes = 4e8,
        .has_compiled = true};
    struct time_lesson read;
    json_t *written = time_lesson_to_json(&lesson);
    char *text = json_dumps(written, JSON_COMPACT);
    json_t *json = json_loads(text, 0, NULL);
    assert_true(time_lesson_from_json(json, &read));
    assert_true(read.took_ms == lesson.took_ms && read.fresh_bytes == lesson.fresh_bytes);
    assert_true(read.has_compiled && read.frame.technique == lesson.frame.technique);
    assert_true(read.frame.view == lesson.frame.view);
    assert_memory_equal(read.frame.terms, lesson.frame.terms, sizeof read.frame.terms);
    json_object_set_new(json, "bytes", json_real(-1));
    assert_false(time_lesson_from_json(json, &read));
    json_object_del(written, "ms");
    assert_false(time_lesson_from_json(written, &read));
    assert_false(time_lesson_from_json(NULL, &read));
    json_decref(json);
    json_decref(written);
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(observations_read_back_for_their_device_alone),
        cmocka_unit_test(a_file_that_was_cut_anywhere_teaches_nothing),
        cmocka_unit_test(what_observations_cannot_make_is_refused),
        cmocka_unit_test(no_more_than_a_file_of_ours_is_read),
        cmocka_unit_test(a_lesson_keeps_its_bits_and_bad_ones_are_none),
        cmocka_unit_test(a_lesson_of_a_time_keeps_its_bits_and_bad_ones_are_none),
    };
    return cmocka_run_group_tests(tests, make_path, remove_path);
}
