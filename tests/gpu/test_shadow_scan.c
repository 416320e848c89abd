/* SPDX-License-Identifier: MIT */
/* From counts to offsets and lists of texels: what shaders make of counts is what a loop in C makes
 * of them, word by word. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/shadows/shadow_deep_job.h"
#include "renderer/shadows/technique.h"
#include "shaders/shared/layout.h"
#include "tests/support/shadow_rig.h"

#include "shaders/shared/records.h"

static struct shadow_rig rig;

struct scan { /* of lights with windows of one row each, so that any number of texels is one */
    struct gl_limits limits;
    struct shadow_store store;
    struct shadow_builder builder;
    struct shadow_map *maps;
    struct shadow_build *builds;
    size_t count;
    bool has_no_lists;
    struct deep_job job;
};

struct words { /* what a scan leaves */
    struct deep_statistics *statistics;
    uint32_t *heads, *table, *texels;
    size_t head_count, table_count, texel_count;
};

static void must(bool ok, const struct error *err)
{
    if (!ok)
        fail_msg("%s", err->message);
}

static void begin(struct scan *scan, const uint32_t *texels, size_t count, int64_t block_bytes)
{
    struct error err = {0};
    *scan = (struct scan){.limits = *gl_context_limits(rig.context), .count = count};
    scan->limits.is_software = true; /* heads are written by the test on every device */
    if (block_bytes)
        scan->limits.max_storage_block_bytes = block_bytes;
    scan->store = (struct shadow_store){.limits = &scan->limits, .budget_bytes = 2ull << 30};
    scan->builder = (struct shadow_builder){
        .programs = rig.programs, .timeline = rig.timeline, .store = &scan->store};
    scan->maps = calloc(count, sizeof *scan->maps);
    scan->builds = calloc(count, sizeof *scan->builds);
    assert_true(scan->maps && scan->builds);
    for (size_t i = 0; i < count; i++) {
        scan->maps[i] = (struct shadow_map){.method = &shadow_method_deep,
                                            .flags = i % 3 == 2 ? SHADOW_FLAG_MEDIA : 0,
                                            .resolution = (int)texels[i],
                                            .window = {.row_count = 1}};
        scan->builds[i].map = &scan->maps[i];
        must(shadow_store_take(&scan->store, SHADOW_POOL_HEADS, texels[i] + 1, &scan->maps[i].heads,
                               &err) &&
                 shadow_store_take(&scan->store, SHADOW_POOL_DEPTHS, texels[i],
                                   &scan->maps[i].depths, &err),
             &err);
    }
}

static void finish(struct scan *scan)
{
    shadow_builder_finish(&scan->builder);
    shadow_store_clear(&scan->store);
    free(scan->maps);
    free(scan->builds);
}

static struct gl_buffer *heads_of(struct scan *scan)
{
    return &scan->store.pools[SHADOW_POOL_HEADS].streams[0];
}

/* Buffers of depths are not written by the processor: by way of another one. */
static void write_counts(struct scan *scan, const struct shadow_range *range,
                         const uint32_t *counts)
{
    struct error err = {0};
    struct gl_buffer staging = {0};
    must(gl_buffer_init(&staging,
                        &(struct gl_buffer_desc){
                            .label = "counts", .size_bytes = range->count * 4, .data = counts},
                        &err),
         &err);
    gl_buffer_copy(&staging, 0, &scan->store.pools[SHADOW_POOL_DEPTHS].streams[0], range->first * 4,
                   range->count * 4);
    gl_buffer_finish(&staging);
}

static uint32_t *read_words(const struct gl_buffer *buffer, size_t count)
{
    uint32_t *words = calloc(count + 1, sizeof *words);
    assert_non_null(words);
    gl_buffer_read(buffer, 0, count * 4, words);
    return words;
}

static struct words run(struct scan *scan, const uint32_t *counts, size_t words, bool on_host)
{
    struct error err = {0};
    struct words result = {.head_count = words};
    struct deep_job *job = &scan->job;
    *job = (struct deep_job){
        .builder = &scan->builder, .because = "a test asks", .has_no_lists = scan->has_no_lists};
    scan->builder.scans_on_host = on_host;
    for (size_t i = 0; i < scan->count; i++) {
        const struct shadow_map *map = &scan->maps[i];
        write_counts(scan, &map->depths, counts + map->heads.first + 1);
    }
    must(deep_job_init(job, scan->builds, scan->count, &err) && deep_scan_sum(job, &err) &&
             deep_sort_reserve(job, &err) && deep_scan_place(job, &err),
         &err);
    for (size_t g = 0; g < job->group_count; g++) {
        const struct deep_group *group = &job->groups[g];
        result.texel_count =
            group->lists_first + job->table[group->table + DEEP_CLASSES * group->count];
    }
    result.table_count = DEEP_CLASSES * job->count + job->group_count;
    result.heads = read_words(heads_of(scan), words);
    result.table = read_words(&scan->builder.table, result.table_count);
    result.texels = read_words(&scan->builder.texels, result.texel_count);
    result.statistics = job->statistics;
    job->statistics = NULL;
    deep_job_finish(job);
    deep_free_transient(&scan->builder);
    return result;
}

static void words_finish(struct words *words)
{
    free(words->statistics);
    free(words->heads);
    free(words->table);
    free(words->texels);
}

static void expect_same(const char *what, const uint32_t *device, const uint32_t *host,
                        size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (device[i] != host[i])
            fail_msg("word %zu of %zu of %s: %u, in C %u", i, count, what, device[i], host[i]);
}

/* Between the lists of groups nothing is written: storage blocks begin at multiples of a grain. */
static void expect_same_lists(const struct words *device, const struct words *host,
                              const struct deep_group *groups, size_t group_count)
{
    for (size_t g = 0; g < group_count; g++) {
        uint32_t count = host->table[groups[g].table + DEEP_CLASSES * groups[g].count];
        expect_same("lists of texels", device->texels + groups[g].lists_first,
                    host->texels + groups[g].lists_first, count);
    }
}

static void compare(struct scan *scan, const uint32_t *counts, size_t *groups)
{
    size_t words = 0;

    for (size_t i = 0; i < scan->count; i++)
        if (scan->maps[i].heads.first + scan->maps[i].heads.count > words)
            words = scan->maps[i].heads.first + scan->maps[i].heads.count;
    struct words host = run(scan, counts, words, true);
    struct error err = {0};
    struct deep_job job = {.builder = &scan->builder, .has_no_lists = scan->has_no_lists};
    must(deep_job_init(&job, scan->builds, scan->count, &err), &err);
    job.statistics = memcpy(job.statistics, host.statistics, scan->count * sizeof *job.statistics);
    uint64_t lists;
    must(deep_job_lay_out(&job, &lists, &err), &err);
    struct words device = run(scan, counts, words, false);
    bool has_room = true; /* else the light's lists are empty: nothing has room for so many */
    for (size_t i = 0; i < scan->count; i++)
        if (host.statistics[i].total_high) {
            memset(host.heads + scan->maps[i].heads.first, 0, scan->maps[i].heads.count * 4);
            has_room = false;
        }
    expect_same("statistics", (uint32_t *)device.statistics, (uint32_t *)host.statistics,
                scan->count * DEEP_STATISTIC_WORDS);
    expect_same("the table", device.table, host.table, host.table_count);
    expect_same("heads", device.heads, host.heads, words);
    if (has_room)
        expect_same_lists(&device, &host, job.groups, job.group_count);
    if (groups)
        *groups = job.group_count;
    deep_job_finish(&job);
    words_finish(&host);
    words_finish(&device);
}

/* Mostly short lists, as scenes have them; now and then one of any length. */
static uint32_t *make_counts(const struct scan *scan, double occupied, uint64_t *seed)
{
    size_t words = 0;
    for (size_t i = 0; i < scan->count; i++)
        words += scan->maps[i].heads.count;
    uint32_t *counts = calloc(words + 1, sizeof *counts);
    assert_non_null(counts);
    for (size_t i = 0; i < scan->count; i++) {
        const struct shadow_range *heads = &scan->maps[i].heads;
        for (uint64_t k = 1; k < heads->count; k++) {
            double length = 1 + 4 * rig_random(seed);
            if (rig_random(seed) < 0.1)
                length = rig_random(seed) * (double)(2u << (int)(16 * rig_random(seed)));
            if (rig_random(seed) < occupied)
                counts[heads->first + k] = (uint32_t)length;
        }
    }
    return counts;
}

static void shaders_scan_as_the_loop_in_c(void **state)
{
    (void)state;
    static const uint32_t sizes[] = {1,    2,    7,    8,    255,  256,   257,   2047,
                                     2048, 2049, 4095, 4096, 4097, 20000, 65537, 150000};
    enum { SIZES = sizeof sizes / sizeof *sizes };
    uint64_t seed = 5;
    for (int round = 0; round < 4; round++) {
        for (size_t lights = 1; lights <= SIZES; lights += round ? SIZES - 1 : 5) {
            struct scan scan;
            uint32_t texels[SIZES];
            for (size_t i = 0; i < lights; i++) /* as they are, and in another order */
                texels[i] = sizes[round ? (5 * i + (size_t)round) % SIZES : lights - 1 - i];
            begin(&scan, texels, lights, 0);
            uint32_t *counts = make_counts(&scan, (double[]){0.7, 1, 0.02, 0.3}[round], &seed);
            compare(&scan, counts, NULL);
            free(counts);
            finish(&scan);
        }
    }
}

static void lights_without_events_have_no_lists(void **state)
{
    (void)state;
    static const uint32_t texels[] = {300, 5000, 2048, 1};
    struct scan scan;
    begin(&scan, texels, 4, 0);
    uint32_t *counts = calloc(8000, sizeof *counts);
    compare(&scan, counts, NULL);
    /* One texel of all has a list: the last of its tile. */
    counts[scan.maps[2].heads.first + 2048] = 7;
    compare(&scan, counts, NULL);
    free(counts);
    finish(&scan);
}

static void totals_beyond_32_bits_are_reported_and_leave_empty_lists(void **state)
{
    (void)state;
    static const uint32_t texels[] = {9000, 10};
    struct scan scan;
    begin(&scan, texels, 2, 0);
    uint32_t *counts = calloc(9100, sizeof *counts);
    for (int i = 0; i < 9000; i++)
        counts[scan.maps[0].heads.first + 1 + (uint64_t)i] = 2000000u + (uint32_t)i;
    compare(&scan, counts, NULL);
    free(counts);
    finish(&scan);
}

/* 32,900 groups are more than a row of a dispatch has. Lists would take llvmpipe five times as
 * long.
 */
static void groups_beyond_a_row_of_a_dispatch_are_scanned(void **state)
{
    (void)state;
    enum { LIGHTS = 32900 };
    uint32_t *texels = calloc(LIGHTS, sizeof *texels);
    uint64_t seed = 11;
    struct scan scan;
    for (int i = 0; i < LIGHTS; i++)
        texels[i] = 1 + (uint32_t)i % 3;
    begin(&scan, texels, LIGHTS, 0);
    scan.has_no_lists = true;
    uint32_t *counts = make_counts(&scan, 0.6, &seed);
    compare(&scan, counts, NULL);
    free(counts);
    free(texels);
    finish(&scan);
}

static void small_storage_blocks_make_groups_of_lights(void **state)
{
    (void)state;
    uint32_t texels[40];
    uint64_t seed = 3;
    struct scan scan;
    size_t groups;
    for (int i = 0; i < 40; i++)
        texels[i] = 100 + 97 * (uint32_t)i;
    begin(&scan, texels, 40, 64 << 10);
    uint32_t *counts = make_counts(&scan, 0.5, &seed);
    compare(&scan, counts, &groups);
    scan.has_no_lists = true;
    compare(&scan, counts, &groups);
    print_message("%zu groups\n", groups);
    assert_true(groups > 4 && groups < 40);
    free(counts);
    finish(&scan);
}

int main(void)
{
    if (!shadow_rig_open(&rig, 0, 0))
        return 77;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shaders_scan_as_the_loop_in_c),
        cmocka_unit_test(lights_without_events_have_no_lists),
        cmocka_unit_test(totals_beyond_32_bits_are_reported_and_leave_empty_lists),
        cmocka_unit_test(groups_beyond_a_row_of_a_dispatch_are_scanned),
        cmocka_unit_test(small_storage_blocks_make_groups_of_lights),
    };
    int failures = cmocka_run_group_tests(tests, NULL, NULL);
    shadow_rig_close(&rig);
    return failures;
}
