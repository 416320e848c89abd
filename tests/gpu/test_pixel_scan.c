/* SPDX-License-Identifier: MIT */
/* The scan of per-pixel counts and the merging of lists, in either form, give what a loop in C
 * gives. */
#include <epoxy/gl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/gl/object.h"
#include "shaders/shared/bindings.h"
#include "tests/support/shadow_rig.h"

static struct shadow_rig rig;

static const struct gl_program *use(const char *file, int pass)
{
    struct error err = {0};
    char defines[16];
    snprintf(defines, sizeof defines, "PASS=%d", pass);
    const struct program_desc desc = {.label = "test", .compute = file, .defines = defines};
    const struct gl_program *program = program_cache_get(rig.programs, &desc, &err);
    if (!program)
        fail_msg("%s", err.message);
    gl_program_use(program);
    return program;
}

static struct gl_buffer make(const char *label, uint64_t words, const void *data, uint32_t binding)
{
    struct error err = {0};
    struct gl_buffer buffer = {0};
    const struct gl_buffer_desc desc = {.label = label, .size_bytes = words * 4, .data = data};
    assert_true(gl_buffer_init(&buffer, &desc, &err));
    gl_buffer_bind_storage(&buffer, binding);
    return buffer;
}

static uint32_t add_saturated(uint32_t a, uint32_t b)
{
    return a + b < a ? UINT32_MAX : a + b;
}

static void scan(const uint32_t *counts, uint32_t count, bool has_tiles, uint32_t *words,
                 uint32_t totals[2])
{
    uint32_t chunk = has_tiles ? 2048 : 256, chunks = (count + chunk - 1) / chunk;
    struct gl_buffer pixels = make("test.counts", count, counts, BIND_PIXEL_LEFT),
                     ends = make("test.ends", count, NULL, BIND_PIXEL_COUNTS),
                     sums = make("test.sums", 2ull * chunks, NULL, BIND_SCAN),
                     statistics = make("test.statistics", 2, NULL, BIND_STATISTICS);
    for (int pass = 0; pass < 3; pass++) {
        const struct gl_program *program =
            use(has_tiles ? "lists_scan.comp.glsl" : "lists_scan_chunks.comp.glsl", pass);
        gl_program_set_u(program, "u_count", count);
        gl_program_set_u(program, has_tiles ? "u_tiles" : "u_chunks", chunks);
        if (!has_tiles)
            gl_program_set_u(program, "u_chunk", chunk);
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
        glDispatchCompute(pass == 1 ? 1 : has_tiles ? chunks : (chunks + 63) / 64, 1, 1);
    }
    gl_buffer_read(&ends, 0, 4ull * count, words);
    gl_buffer_read(&statistics, 0, 8, totals);
    gl_buffer_finish(&pixels);
    gl_buffer_finish(&ends);
    gl_buffer_finish(&sums);
    gl_buffer_finish(&statistics);
}

static void compare_scans(const uint32_t *counts, uint32_t count)
{
    uint32_t *words = calloc(count, sizeof *words);
    assert_non_null(words);
    for (int form = 0; form < 2; form++) {
        uint32_t totals[2], sum = 0, longest = 0;
        scan(counts, count, form == 1, words, totals);
        for (uint32_t i = 0; i < count && sum < UINT32_MAX; i++) {
            sum = add_saturated(sum, counts[i]);
            if (words[i] != sum)
                fail_msg("form %d, count %u of %u: %u, not %u", form, i, count, words[i], sum);
            longest = counts[i] > longest ? counts[i] : longest;
        }
        assert_int_equal(totals[0], sum);
        if (sum < UINT32_MAX)
            assert_int_equal(totals[1], longest);
    }
    free(words);
}

static void counts_become_ends_as_by_a_loop(void **state)
{
    (void)state;
    static const uint32_t sizes[] = {1, 255, 256, 257, 2047, 2048, 2049, 65537, 700001};
    uint64_t seed = 1;
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
        uint32_t *counts = calloc(sizes[s], sizeof *counts);
        assert_non_null(counts);
        compare_scans(counts, sizes[s]);
        for (uint32_t i = 0; i < sizes[s]; i++)
            counts[i] = (uint32_t)(rig_random(&seed) * (i % 97 ? 4 : 3000));
        compare_scans(counts, sizes[s]);
        free(counts);
    }
}

static void absurd_totals_are_seen_as_too_large(void **state)
{
    (void)state;
    enum { COUNT = 5000 };
    uint32_t *counts = calloc(COUNT, sizeof *counts);
    assert_non_null(counts);
    for (int i = 0; i < COUNT; i++)
        counts[i] = i < 100 ? 3 : 1u << 30;
    compare_scans(counts, COUNT);
    free(counts);
}

struct key {
    uint32_t depth, tie, entry, coverage;
};

/* Nearest first: reversed depth; then as lists_sort.comp.glsl, and those of the first run first. */
static int compare_keys(const void *a, const void *b)
{
    const struct key *x = a, *y = b;
    if (x->depth != y->depth)
        return x->depth > y->depth ? -1 : 1;
    if (x->tie != y->tie)
        return x->tie < y->tie ? -1 : 1;
    if (x->coverage != y->coverage)
        return x->coverage < y->coverage ? -1 : 1;
    return x->entry < y->entry ? -1 : x->entry > y->entry;
}

/* Merges by ranks (pass 1) or by a thread each (pass 2) and compares with a stable sort. */
static void compare_merging(const struct key *keys, const uint32_t (*pixels)[4],
                            const uint32_t *ends, uint32_t pixel_count, uint32_t longest, int pass)
{
    uint32_t entries = ends[pixel_count - 1];
    struct gl_buffer counts = make("test.ends", pixel_count, ends, BIND_PIXEL_COUNTS),
                     halves = make("test.keys", 8ull * entries, keys, BIND_ENTRY_KEYS),
                     surfaces = make("test.surfaces", 4ull * entries, pixels, BIND_ENTRY_SURFACE_2);
    uint32_t from = 0;
    for (uint32_t run = 0; run < longest; run = run ? 2 * run : 16) {
        const struct gl_program *program = use("lists_sort.comp.glsl", run ? pass : 0);
        gl_program_set_u(program, "u_entries", entries);
        gl_program_set_u(program, "u_pixels", pixel_count);
        gl_program_set_u(program, "u_run", run);
        gl_program_set_u(program, "u_from", from);
        gl_program_set_u(program, "u_to", from ? 0 : entries);
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
        glDispatchCompute((entries + 63) / 64, 1, 1);
        from = run ? from ? 0 : entries : from;
    }
    struct key *sorted = calloc(entries, sizeof *sorted), *expected = calloc(entries, sizeof *keys);
    assert_true(sorted && expected);
    memcpy(expected, keys, entries * sizeof *keys);
    for (uint32_t begin = 0, pixel = 0; begin < entries; begin = ends[pixel++])
        qsort(expected + begin, ends[pixel] - begin, sizeof *keys, compare_keys);
    gl_buffer_read(&halves, 16ull * from, 16ull * entries, sorted);
    for (uint32_t i = 0; i < entries; i++)
        if (memcmp(&sorted[i], &expected[i], sizeof *sorted) != 0)
            fail_msg("pass %d: place %u has entry %u, not %u", pass, i, sorted[i].entry,
                     expected[i].entry);
    free(sorted);
    free(expected);
    gl_buffer_finish(&counts);
    gl_buffer_finish(&halves);
    gl_buffer_finish(&surfaces);
}

static void merged_lists_are_sorted_and_stable(void **state)
{
    (void)state;
    static const uint32_t lengths[] = {1, 16, 17, 32, 33, 5, 100, 1000, 48, 2, 4097};
    enum { PIXELS = sizeof lengths / sizeof *lengths };
    uint32_t ends[6000] = {0}, entries = 0;
    static struct key keys[2 * 6000];
    static uint32_t pixels[6000][4];
    uint64_t seed = 9;
    for (uint32_t pixel = 0; pixel < PIXELS; pixel++) {
        for (uint32_t i = 0; i < lengths[pixel]; i++, entries++) {
            keys[entries] =
                (struct key){(uint32_t)(rig_random(&seed) * 40), (uint32_t)(rig_random(&seed) * 3),
                             entries, (uint32_t)(rig_random(&seed) * 2)};
            pixels[entries][2] = pixel;
        }
        ends[pixel] = entries;
    }
    for (int pass = 1; pass <= 2; pass++)
        compare_merging(keys, (const uint32_t(*)[4])pixels, ends, PIXELS, 4097, pass);
}

int main(void)
{
    if (!shadow_rig_open(&rig, 0, 0))
        return 77;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(counts_become_ends_as_by_a_loop),
        cmocka_unit_test(absurd_totals_are_seen_as_too_large),
        cmocka_unit_test(merged_lists_are_sorted_and_stable),
    };
    int failures = cmocka_run_group_tests(tests, NULL, NULL);
    shadow_rig_close(&rig);
    return failures;
}
