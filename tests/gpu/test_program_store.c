/* SPDX-License-Identifier: MIT */
/* Programs from one start to the next: taken from files where the driver gives and takes them, with
 * the same results; compiled where it does not, or where a file lies. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/gl/selftest.h"
#include "tests/support/image_checks.h"

enum { SKIPPED = 77, PROOF = 2 /* programs of the self-test, which come from no file */ };

static struct gl_context *context;
static char folder[] = "/tmp/vitrail-programs-XXXXXX";

/* What a driver does, as the cache sees it. */
struct pretended_driver {
    uint64_t gets, loads;
    bool gives, takes;
};

static bool pretend_get(void *opaque, uint32_t program, struct program_binary *binary)
{
    struct pretended_driver *driver = opaque;
    driver->gets++;
    if (!driver->gives)
        return false;
    *binary = (struct program_binary){.format = 7, .bytes = malloc(4), .size_bytes = 4};
    assert_non_null(binary->bytes);
    memcpy(binary->bytes, &program, 4);
    return true;
}

static bool pretend_load(void *opaque, uint32_t program, const struct program_binary *binary)
{
    struct pretended_driver *driver = opaque;
    (void)program;
    assert_int_equal(binary->format, 7);
    assert_int_equal(binary->size_bytes, 4);
    driver->loads++;
    return driver->takes;
}

static struct program_store *open_store(const char *driver)
{
    struct error err = {0};
    struct program_store *store = program_store_open(
        &(struct program_store_desc){.folder = folder, .driver = driver, .budget_bytes = 64 << 20},
        &err);
    if (!store)
        fail_msg("%s", err.message);
    return store;
}

static const struct program_desc scan = {
    .label = "test.scan", .compute = "lists_scan.comp.glsl", .defines = "PASS=0"};

/* One start of a cache over the store: gets the program twice. */
static struct program_cache_stats start(struct program_store *store,
                                        const struct program_binary_hooks *hooks,
                                        enum program_place place)
{
    struct error err = {0};
    struct program_cache *cache = program_cache_create(NULL, &err);
    struct program_cache_stats stats;
    assert_non_null(cache);
    program_cache_set_store(cache, store, hooks);
    assert_int_equal(program_cache_find(cache, &scan), place);
    assert_non_null(program_cache_get(cache, &scan, &err));
    assert_int_equal(program_cache_find(cache, &scan), PROGRAM_IN_MEMORY);
    assert_non_null(program_cache_get(cache, &scan, &err));
    program_cache_get_stats(cache, &stats);
    assert_int_equal(stats.hits, 1);
    program_cache_destroy(cache);
    return stats;
}

static void a_driver_that_takes_them_back_compiles_once(void **state)
{
    (void)state;
    struct pretended_driver driver = {.gives = true, .takes = true};
    const struct program_binary_hooks hooks = {&driver, pretend_get, pretend_load};
    struct program_store *store = open_store("takes them");
    struct program_cache_stats stats = start(store, &hooks, PROGRAM_ABSENT);
    assert_int_equal(stats.misses, 1);
    assert_int_equal(stats.loaded, 0);
    for (int i = 0; i < 3; i++) {
        stats = start(store, &hooks, PROGRAM_ON_DISK);
        assert_int_equal(stats.misses, 0);
        assert_int_equal(stats.loaded, 1);
    }
    assert_int_equal(driver.gets, 1);
    assert_int_equal(driver.loads, 3);
    program_store_close(store);
}

static void a_driver_that_refuses_them_compiles_and_gives_anew(void **state)
{
    (void)state;
    struct pretended_driver driver = {.gives = true};
    const struct program_binary_hooks hooks = {&driver, pretend_get, pretend_load};
    struct program_store *store = open_store("refuses them");
    start(store, &hooks, PROGRAM_ABSENT);
    for (int i = 0; i < 2; i++) {
        struct program_cache_stats stats = start(store, &hooks, PROGRAM_ON_DISK);
        assert_int_equal(stats.misses, 1);
        assert_int_equal(stats.loaded, 0);
    }
    assert_int_equal(driver.gets, 3);
    struct program_store_totals totals;
    program_store_get_totals(store, &totals);
    assert_int_equal(totals.dropped, 2);
    assert_int_equal(totals.written, 3);
    program_store_close(store);
}

static void a_driver_that_gives_none_compiles_each_time(void **state)
{
    (void)state;
    struct pretended_driver driver = {.takes = true};
    const struct program_binary_hooks hooks = {&driver, pretend_get, pretend_load};
    struct program_store *store = open_store("gives none");
    for (int i = 0; i < 2; i++)
        assert_int_equal(start(store, &hooks, PROGRAM_ABSENT).misses, 1);
    assert_int_equal(driver.loads, 0);
    program_store_close(store);
}

/* Bytes with good sums that no driver wrote: GL must say no, and nothing else happens. */
static void this_driver_refuses_what_is_not_its_own(void **state)
{
    (void)state;
    if (!gl_context_limits(context)->program_formats)
        skip();
    struct pretended_driver driver = {.gives = true};
    const struct program_binary_hooks hooks = {&driver, pretend_get, pretend_load};
    struct program_store *store = open_store("forged");
    start(store, &hooks, PROGRAM_ABSENT); /* format 7, four bytes */
    struct program_cache_stats stats = start(store, NULL, PROGRAM_ON_DISK);
    assert_int_equal(stats.misses, 1);
    stats = start(store, NULL, PROGRAM_ON_DISK); /* now there is a good one */
    assert_int_equal(stats.loaded, 1);
    program_store_close(store);
}

/* ---- whole renderers ---- */

static struct renderer *create_renderer(void)
{
    struct error err = {0};
    char own[64];
    snprintf(own, sizeof own, "%s/drawn", folder);
    struct renderer *renderer =
        renderer_create(&(struct renderer_desc){.is_strict = true, .program_folder = own}, &err);
    if (!renderer)
        fail_msg("%s", err.message);
    return renderer;
}

struct picture {
    struct renderer_info info; /* after it */
    uint64_t hash, built, loaded;
};

static struct picture take_picture(void)
{
    struct renderer *renderer = create_renderer();
    struct rig_scene scene = {0};
    struct frame frame;
    struct picture picture;
    const struct view view = {.width_px = 64,
                              .height_px = 48,
                              .camera = {.kind = VIEW_CAMERA_FIT},
                              .outputs = 1u << VIEW_OUTPUT_COLOR | 1u << VIEW_OUTPUT_LIGHTS,
                              .quality = {.shadow_resolution = 64, .shadows = SHADOWS_DEEP}};
    rig_demo_open(&scene, renderer, "demo", 64);
    shoot(renderer, &scene, &view, &frame);
    picture.hash = image_hash(&frame.outputs[VIEW_OUTPUT_COLOR]) ^
                   image_hash(&frame.outputs[VIEW_OUTPUT_LIGHTS]);
    picture.built = frame.report.counts.programs_built;
    picture.loaded = frame.report.counts.programs_loaded;
    renderer_get_info(renderer, &picture.info);
    frame_finish(&frame);
    rig_scene_finish(&scene, renderer);
    renderer_destroy(renderer);
    return picture;
}

static void a_second_start_compiles_nothing_and_draws_the_same(void **state)
{
    (void)state;
    struct error err = {0};
    if (!gl_context_limits(context)->program_formats)
        skip();
    gl_context_destroy(context); /* a thread has one */
    struct picture first = take_picture(), second = take_picture();
    assert_true(first.built > 3); /* beside those of the self-test */
    assert_int_equal(first.loaded, 0);
    assert_int_equal(first.info.programs_kept, first.info.programs_built - PROOF);
    assert_true(first.info.programs_kept_bytes > 0);
    assert_int_equal(second.built, 0);
    assert_int_equal(second.loaded, first.built);
    assert_int_equal(second.info.programs_built, PROOF);
    assert_int_equal(second.info.programs_kept, first.info.programs_kept);
    assert_int_equal(second.hash, first.hash);
    print_message("%d programs, %.1f MB\n", (int)first.info.programs_kept,
                  1e-6 * (double)first.info.programs_kept_bytes);
    context = gl_context_create(&(struct gl_context_desc){.is_strict = true}, &err);
    assert_non_null(context);
}

static int create_folder(void **state)
{
    (void)state;
    return !mkdtemp(folder);
}

static int remove_folder(void **state)
{
    char command[128];
    (void)state;
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    return system(command); /* NOLINT(cert-env33-c): a folder of our own */
}

int main(void)
{
    struct error err = {0};
    context = gl_context_create(&(struct gl_context_desc){.is_strict = true}, &err);
    if (!context) {
        fprintf(stderr, "skipped: %s\n", err.message);
        return SKIPPED;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_driver_that_takes_them_back_compiles_once),
        cmocka_unit_test(a_driver_that_refuses_them_compiles_and_gives_anew),
        cmocka_unit_test(a_driver_that_gives_none_compiles_each_time),
        cmocka_unit_test(this_driver_refuses_what_is_not_its_own),
        cmocka_unit_test(a_second_start_compiles_nothing_and_draws_the_same),
    };
    int failed = cmocka_run_group_tests(tests, create_folder, remove_folder);
    gl_context_destroy(context);
    return failed;
}
