/* SPDX-License-Identifier: MIT */
/* Claims about filling buffers on the device: every word of the range and no other one becomes the
 * value, wherever it begins, across storage blocks, behind and before what shaders write. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>
#include <epoxy/gl.h>

#include "renderer/gl/buffer_fill.h"

enum { WORDS = 70000, BEFORE = 7, VALUE = 0x12345678 };

static struct gl_context *context;
static struct program_cache *programs;

static bool fill(struct gl_buffer *buffer, const struct gl_limits *limits, uint64_t first,
                 uint64_t count, uint32_t value)
{
    struct error err = {0};
    bool ok = buffer_fill_u32(&(struct buffer_fill_desc){.programs = programs,
                                                         .limits = limits,
                                                         .buffer = buffer,
                                                         .offset_bytes = first * 4,
                                                         .size_bytes = count * 4,
                                                         .value = value},
                              &err);
    if (!ok)
        fail_msg("%s", err.message);
    return ok;
}

static void expect_filled(const struct gl_limits *limits, uint64_t first, uint64_t count)
{
    struct error err = {0};
    struct gl_buffer buffer = {0};
    uint32_t *words = malloc(WORDS * sizeof *words);
    assert_non_null(words);
    assert_true(gl_buffer_init(
        &buffer,
        &(struct gl_buffer_desc){.label = "test.filled", .size_bytes = WORDS * sizeof *words},
        &err));
    fill(&buffer, gl_context_limits(context), 0, WORDS, BEFORE);
    fill(&buffer, limits, first, count, VALUE);
    gl_buffer_read(&buffer, 0, WORDS * sizeof *words, words);
    for (uint64_t i = 0; i < WORDS; i++)
        if (words[i] != (i >= first && i - first < count ? VALUE : BEFORE))
            fail_msg("%llu words from %llu on: word %llu is %u", (unsigned long long)count,
                     (unsigned long long)first, (unsigned long long)i, words[i]);
    gl_buffer_finish(&buffer);
    free(words);
}

static void the_words_of_the_range_and_no_others_are_filled(void **state)
{
    static const uint64_t ranges[][2] = {{0, 1},     {0, WORDS}, {1, 1023},      {63, 1},
                                         {64, 1024}, {65, 5000}, {WORDS - 1, 1}, {100, 0}};
    (void)state;
    for (size_t i = 0; i < sizeof ranges / sizeof *ranges; i++)
        expect_filled(gl_context_limits(context), ranges[i][0], ranges[i][1]);
}

static void ranges_longer_than_a_storage_block_are_filled(void **state)
{
    struct gl_limits limits = *gl_context_limits(context);
    (void)state;
    limits.max_storage_block_bytes = 1 << 16;
    expect_filled(&limits, 0, WORDS);
    expect_filled(&limits, 77, WORDS - 100);
    limits.max_storage_block_bytes = 1000; /* of which three times 256 are bound */
    expect_filled(&limits, 5, 4096);
}

/* What a device takes in one block beyond what it tells is there. */
static void a_block_that_cannot_be_divided_is_filled_to_its_end(void **state)
{
    enum { MIB = 1 << 20 };
    const struct gl_limits *told = gl_context_limits(context);
    uint64_t tells = (uint64_t)told->max_storage_block_bytes, size = tells + 4 * MIB;
    struct error err = {0};
    struct gl_buffer buffer = {0};
    struct gl_limits limits = *told;
    (void)state;
    if (told->max_whole_block_bytes == told->max_storage_block_bytes)
        skip();
    limits.max_storage_block_bytes = told->max_whole_block_bytes;
    if (!gl_buffer_init(&buffer,
                        &(struct gl_buffer_desc){.label = "test.whole", .size_bytes = size}, &err))
        fail_msg("%s", err.message);
    fill(&buffer, &limits, 0, size / 4, 7);
    const uint64_t places[] = {0, tells - 4, tells, size - 4};
    for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
        uint32_t word = 0;
        gl_buffer_read(&buffer, places[i], 4, &word);
        assert_int_equal(word, 7);
    }
    gl_buffer_finish(&buffer);
}

static void later_fills_stand_over_earlier_ones(void **state)
{
    struct error err = {0};
    struct gl_buffer buffer = {0};
    uint32_t word = 0;
    (void)state;
    assert_true(gl_buffer_init(
        &buffer, &(struct gl_buffer_desc){.label = "test.filled", .size_bytes = WORDS * 4}, &err));
    for (uint32_t value = 1; value <= 50; value++)
        fill(&buffer, gl_context_limits(context), 0, WORDS, value);
    gl_buffer_read(&buffer, 4 * (WORDS - 1), 4, &word);
    assert_int_equal(word, 50);
    gl_buffer_finish(&buffer);
}

int main(void)
{
    struct error err = {0};
    context = gl_context_create(&(struct gl_context_desc){.is_strict = true}, &err);
    if (!context) {
        fprintf(stderr, "skipped: %s\n", err.message);
        return 77;
    }
    programs = program_cache_create(NULL, &err);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_words_of_the_range_and_no_others_are_filled),
        cmocka_unit_test(ranges_longer_than_a_storage_block_are_filled),
        cmocka_unit_test(a_block_that_cannot_be_divided_is_filled_to_its_end),
        cmocka_unit_test(later_fills_stand_over_earlier_ones),
    };
    int failed = programs ? cmocka_run_group_tests(tests, NULL, NULL) : 1;
    program_cache_destroy(programs);
    gl_context_destroy(context);
    return failed;
}
