/* SPDX-License-Identifier: MIT */
/* The pool of textures from within: its budget while textures change their form, what frames in
 * motion read, what a frame at rest leaves of their uploads, and how the pace is learnt. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>
#include <epoxy/gl.h>

#include "renderer/gl/context.h"
#include "renderer/textures/texture_store_internal.h"
#include "tests/support/gl_hooks.h"

enum { IMAGES = 16, SIDE = 512, BUDGET = 4 << 20, SKIPPED = 77, KEYS = 2 * IMAGES };

static struct gl_context *context;

/* ---- a scene of so many opaque colours ---- */

struct rig {
    struct scene scene;
    struct scene_image images[IMAGES];
    struct scene_texture textures[IMAGES];
    struct scene_material materials[IMAGES];
    uint8_t *pixels;
    struct texture_pool *pool;
    struct texture_store *store;
};

static void add_image(struct rig *rig, int index, uint32_t width, uint32_t height)
{
    uint64_t own = texture_levels_bytes(width, height, 0), at = own * (uint64_t)index;
    rig->images[index] = (struct scene_image){
        .width_px = width,
        .height_px = height,
        .offset_bytes = at,
        .levels_offset_bytes = {0, at + own - texture_levels_bytes(width, height, 1)},
        .least_alpha = 255};
    rig->textures[index] = (struct scene_texture){.image = index,
                                                  .mag_filter = GL_LINEAR,
                                                  .min_filter = GL_LINEAR_MIPMAP_LINEAR,
                                                  .wrap_s = GL_REPEAT,
                                                  .wrap_t = GL_REPEAT};
    for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++)
        rig->materials[index].textures[slot].texture = slot ? -1 : index;
}

static void open_rig(struct rig *rig, uint32_t width, uint32_t height, bool compresses)
{
    struct error err = {0};
    uint64_t bytes = IMAGES * texture_levels_bytes(width, height, 0);
    uint32_t seed = 1;
    *rig = (struct rig){.pixels = malloc(bytes)};
    assert_non_null(rig->pixels);
    for (uint64_t i = 0; i < bytes; i++)
        rig->pixels[i] = (uint8_t)((seed = seed * 1664525 + 1013904223) >> 24);
    for (int i = 0; i < IMAGES; i++)
        add_image(rig, i, width, height);
    rig->scene = (struct scene){.images = rig->images,
                                .image_count = IMAGES,
                                .textures = rig->textures,
                                .texture_count = IMAGES,
                                .materials = rig->materials,
                                .material_count = IMAGES,
                                .pixels = rig->pixels,
                                .pixel_bytes = bytes};
    rig->pool =
        texture_pool_create(&(struct texture_pool_desc){.budget_bytes = BUDGET,
                                                        .upload_ms = 1000,
                                                        .compresses_from = compresses ? 1 : 0,
                                                        .waits = true},
                            &err);
    assert_non_null(rig->pool);
    rig->store = texture_store_create(rig->pool, &rig->scene, &err);
    assert_non_null(rig->store);
}

static void close_rig(struct rig *rig)
{
    texture_store_destroy(rig->store);
    texture_pool_destroy(rig->pool);
    free(rig->pixels);
}

/* Of images [first, end) this level; of others none. */
static struct report_textures prepare(struct rig *rig, int first, int end, uint8_t level,
                                      bool may_be_coarse)
{
    struct error err = {0};
    struct report_textures report;
    uint8_t levels[KEYS];
    memset(levels, TEXTURE_UNNEEDED, sizeof levels);
    for (int i = first; i < end; i++)
        levels[texture_key((uint32_t)i, true)] = level;
    const struct texture_demand demand = {.store = rig->store, .levels = levels};
    const struct texture_request request = {
        .demands = &demand, .count = 1, .may_be_coarse = may_be_coarse};
    if (!texture_pool_prepare(rig->pool, &request, &report, &err))
        fail_msg("%s", err.message);
    assert_true(report.resident_bytes <= BUDGET);
    return report;
}

/* One image whole, as far as it has been read: the thread that reads it gets its turn. */
static struct report_textures prepare_in_motion(struct rig *rig, int image)
{
    usleep(100);
    return prepare(rig, image, image + 1, 0, true);
}

static struct stored_texture *texture_of(const struct rig *rig, int image)
{
    return &rig->store->textures[texture_key((uint32_t)image, true)];
}

static void skip_without_blocks(void)
{
    if (!texture_device_packs())
        skip();
}

/* ---- what is promised ---- */

static void textures_that_change_form_keep_the_budget(void **state)
{
    (void)state;
    skip_without_blocks();
    struct rig rig;
    open_rig(&rig, SIDE, SIDE, true);
    uint64_t blocks = texture_blocks_bytes(SIDE, SIDE, 0, false);
    struct report_textures report = prepare(&rig, IMAGES - 2, IMAGES, 0, false);
    assert_int_equal(report.compressed_count, 0);
    assert_true(report.resident_bytes > BUDGET / 2);
    report = prepare(&rig, 0, IMAGES, 0, false);
    assert_int_equal(report.compressed_count, IMAGES);
    assert_true(rig.pool->most_bytes <= BUDGET);
    report = prepare(&rig, 0, 2, 0, false);
    assert_int_equal(report.compressed_count, 0);
    assert_true(rig.pool->most_bytes <= BUDGET + blocks); /* the self that is replaced */
    close_rig(&rig);
}

/* Colours were compressed; a moving frame takes them back whole. What it writes the reader has
 * read. */
static void frames_in_motion_read_no_level_that_blocks_stand_for(void **state)
{
    (void)state;
    skip_without_blocks();
    struct rig rig;
    open_rig(&rig, SIDE, SIDE, true);
    prepare(&rig, 0, IMAGES, 0, false);
    struct stored_texture *t = texture_of(&rig, 0);
    assert_true(t->full.is_packed);
    for (int i = 0; i < 10000 && t->full.is_packed; i++) {
        prepare_in_motion(&rig, 0);
        if (rig.pool->incoming.of == t || !t->full.is_packed)
            break;
    }
    for (uint32_t level = 0; level < t->floor.top; level++)
        assert_true(texture_reader_ask(rig.pool->reader, texture_level_pixels(t, level),
                                       4ull * texture_level_side(SIDE, level) *
                                           texture_level_side(SIDE, level)));
    close_rig(&rig);
}

/* What the device makes of the blocks, less what the image holds: mean square of 1. */
static double mean_square_of(const struct rig *rig, const struct stored_texture *t)
{
    static uint8_t texels[4 * SIDE * SIDE];
    const uint8_t *from = rig->pixels + rig->images[t->key / 2].offset_bytes;
    uint32_t channels = t->has_alpha ? 4 : 3;
    double squares = 0;
    glGetTextureImage(t->full.texture.name, 0, GL_RGBA, GL_UNSIGNED_BYTE, sizeof texels, texels);
    for (size_t i = 0; i < (size_t)SIDE * SIDE; i++)
        for (uint32_t c = 0; c < channels; c++) {
            double difference = ((double)texels[4 * i + c] - from[4 * i + c]) / 255;
            squares += difference * difference;
        }
    return squares / (channels * (double)SIDE * SIDE);
}

/* Opaque and with alpha in turn: each in its blocks, with the error that is told. */
static void images_with_alpha_take_blocks_with_alpha(void **state)
{
    (void)state;
    skip_without_blocks();
    struct rig rig;
    open_rig(&rig, SIDE, SIDE, true);
    for (int i = 0; i < IMAGES; i++)
        texture_of(&rig, i)->has_alpha = i % 2;
    struct report_textures report = prepare(&rig, 0, IMAGES, 0, false);
    assert_int_equal(report.compressed_count, IMAGES);
    assert_int_equal(report.level_bias, 1); /* for want of 0.06 MiB, of some */
    for (int i = 0; i < IMAGES; i++) {
        const struct stored_texture *t = texture_of(&rig, i);
        assert_int_equal(t->full.texture.size_bytes,
                         texture_blocks_bytes(SIDE, SIDE, t->full.top, i % 2));
        if (t->full.top)
            continue;
        double found = mean_square_of(&rig, t);
        assert_true(t->full.mean_square > 0.01 && found > 0.98 * t->full.mean_square &&
                    found < 1.02 * t->full.mean_square);
    }
    close_rig(&rig);
}

/* Compressed from two levels on: where one level fewer would take twice the budget. */
static void colours_are_compressed_from_so_many_levels_on(void **state)
{
    (void)state;
    skip_without_blocks();
    struct rig rig;
    open_rig(&rig, SIDE, SIDE, true);
    texture_pool_set_compression(rig.pool, 2);
    struct report_textures report = prepare(&rig, 0, IMAGES, 0, false);
    assert_int_equal(report.level_bias, 2); /* of some: 5.3 MiB with one level withheld */
    assert_int_equal(report.compressed_count, 0);
    rig.pool->budget_bytes = BUDGET / 2;
    report = prepare(&rig, 0, IMAGES, 0, false);
    assert_int_equal(report.level_bias, 1);
    assert_int_equal(report.compressed_count, IMAGES);
    rig.pool->budget_bytes = BUDGET;
    report = prepare(&rig, 0, IMAGES, 0, true); /* goes on so */
    assert_int_equal(report.compressed_count, IMAGES);
    report = prepare(&rig, 0, IMAGES, 0, false);
    assert_int_equal(report.compressed_count, 0);
    rig.pool->budget_bytes = BUDGET / 2;
    for (uint32_t from = 0; from <= 3; from += 3) {
        texture_pool_set_compression(rig.pool, from);
        assert_int_equal(texture_pool_compresses(rig.pool), from > 0);
        report = prepare(&rig, 0, IMAGES, 0, false);
        assert_int_equal(report.compressed_count, 0);
        assert_int_equal(report.level_bias, 2);
    }
    close_rig(&rig);
}

/* What rays read is of the levels that the rasteriser would have, and counts as these do. */
static void a_plan_counts_what_is_budgeted(void **state)
{
    (void)state;
    skip_without_blocks();
    struct rig rig;
    struct error err = {0};
    struct report_textures report;
    open_rig(&rig, SIDE, SIDE, true);
    const struct texture_demand demand = {.store = rig.store};
    const struct texture_request request = {.demands = &demand, .count = 1};
    assert_true(texture_pool_plan(rig.pool, &request, &report, &err));
    assert_int_equal(report.resident_bytes, IMAGES * texture_blocks_bytes(SIDE, SIDE, 0, false));
    assert_int_equal(report.wanted_bytes, IMAGES * texture_levels_bytes(SIDE, SIDE, 0));
    assert_int_equal(report.coarse_count + report.level_bias, 0);
    close_rig(&rig);
}

/* Pictures that rays make plan levels, and upload none. */
static void levels_that_fit_count_at_once_and_come_with_the_first_frame_that_samples(void **state)
{
    (void)state;
    enum { SMALL = 200 };
    struct rig rig;
    struct error err = {0};
    struct report_textures report;
    open_rig(&rig, SMALL, SMALL, false);
    uint64_t bytes = IMAGES * texture_levels_bytes(SMALL, SMALL, 0);
    const struct texture_demand demand = {.store = rig.store};
    const struct texture_request request = {.demands = &demand, .count = 1, .may_be_coarse = true};
    assert_true(bytes <= BUDGET && 2 * bytes > BUDGET);
    assert_int_equal(texture_store_resident_bytes(rig.store), bytes);
    assert_true(texture_pool_plan(rig.pool, &request, &report, &err));
    for (int i = 0; i < IMAGES; i++)
        assert_int_equal(texture_of(&rig, i)->full.texture.name, 0);
    for (int again = 0; again < 2; again++) {
        assert_true(texture_pool_prepare(rig.pool, &request, &report, &err));
        assert_int_equal(report.written_bytes, again ? 0 : bytes);
        assert_int_equal(report.resident_bytes, bytes);
        assert_int_equal(report.coarse_count + report.pending_bytes, 0);
        for (uint32_t i = 0; i < IMAGES; i++)
            assert_non_null(texture_store_use(rig.store, texture_key(i, true), 0));
    }
    close_rig(&rig);
}

/* As textures do that are there. */
static void levels_that_nobody_sampled_give_way_to_another_scene(void **state)
{
    (void)state;
    enum { SMALL = 200 };
    struct rig rig;
    struct error err = {0};
    struct report_textures report;
    open_rig(&rig, SMALL, SMALL, false);
    uint64_t bytes = texture_store_resident_bytes(rig.store);
    struct texture_store *other = texture_store_create(rig.pool, &rig.scene, &err);
    assert_non_null(other);
    assert_int_equal(texture_store_resident_bytes(other), bytes);
    assert_true(texture_store_resident_bytes(rig.store) + bytes <= BUDGET);
    const struct texture_demand demand = {.store = rig.store};
    const struct texture_request request = {.demands = &demand, .count = 1};
    assert_true(texture_pool_prepare(rig.pool, &request, &report, &err)); /* and comes back */
    assert_int_equal(report.coarse_count, 0);
    assert_int_equal(texture_store_resident_bytes(rig.store), bytes);
    assert_true(report.resident_bytes <= BUDGET && rig.pool->most_bytes <= BUDGET);
    for (uint32_t i = 0; i < IMAGES; i++)
        assert_non_null(texture_store_use(rig.store, texture_key(i, true), 0));
    texture_store_destroy(other);
    close_rig(&rig);
}

/* Rows of 10,000 px: a call writes one of them, less than a chunk and more than the limit. */
static void a_low_pace_is_learnt_anew_from_wide_rows(void **state)
{
    (void)state;
    enum { WIDE = 10000, LOW = 20000 };
    struct rig rig;
    open_rig(&rig, WIDE, 64, false);
    prepare(&rig, 0, 1, 3, false);
    rig.pool->upload_ms = 1;
    rig.pool->pace = (struct texture_pace){.bytes_per_ms = LOW, .chunk_bytes = 64 << 10};
    double most = LOW;
    for (int i = 0; i < 4000 && most <= LOW; i++) {
        prepare_in_motion(&rig, 0);
        if (rig.pool->pace.bytes_per_ms > most)
            most = rig.pool->pace.bytes_per_ms;
    }
    assert_true(most > LOW);
    close_rig(&rig);
}

static struct {
    PFNGLFINISHPROC finish;
    int count;
} waits;

static void GLAPIENTRY finish_and_count(void)
{
    waits.count++;
    waits.finish();
}

/* And so do not learn how long the device was busy. */
static void frames_wait_for_their_uploads_where_they_are_told_to(void **state)
{
    (void)state;
    for (int told = 0; told < 2; told++) {
        struct rig rig;
        open_rig(&rig, SIDE, SIDE, false);
        rig.pool->waits = told;
        const struct texture_pace before = rig.pool->pace;
        uint64_t written = 0;
        waits.count = 0;
        GL_SPY_BEGIN(Finish, waits.finish, finish_and_count);
        for (int i = 0; i < 10000 && written < texture_levels_bytes(SIDE, SIDE, 0) / 2; i++)
            written += prepare_in_motion(&rig, 0).written_bytes;
        written += prepare(&rig, 1, 2, 0, false).written_bytes;
        GL_SPY_END(Finish, waits.finish);
        assert_true(written > texture_levels_bytes(SIDE, SIDE, 0));
        if (told)
            assert_true(waits.count > 1 && rig.pool->pace.bytes_per_ms != before.bytes_per_ms);
        else
            assert_true(waits.count == 0 && rig.pool->pace.bytes_per_ms == before.bytes_per_ms);
        close_rig(&rig);
    }
}

/* In motion until something is on its way. */
static void begin_incoming(struct rig *rig, int image)
{
    rig->pool->upload_bytes = 1 << 20;
    rig->pool->pace.chunk_bytes = 64 << 10;
    for (int i = 0; i < 10000 && rig->pool->incoming.of != texture_of(rig, image); i++)
        prepare_in_motion(rig, image);
    assert_ptr_equal(rig->pool->incoming.of, texture_of(rig, image));
}

/* Frames of 4 ms on a device that takes 256 kB a ms, and of a sudden a sixteenth of it. */
static void a_frame_that_took_too_long_halves_the_next_calls(void **state)
{
    (void)state;
    struct texture_pace pace = {.bytes_per_ms = 256e3};
    texture_note_pace(&pace, 4, 1000000, 3.9);
    uint64_t chunk = pace.chunk_bytes, slow = 0;
    assert_int_in_range(chunk, 256000, 260000);
    for (double ms = 64; ms > 4.1; slow++) {
        double before = pace.bytes_per_ms;
        ms = 4 * before / 16e3;
        texture_note_pace(&pace, 4, (uint64_t)(4 * before), ms);
        if (ms > 8)
            assert_true(pace.bytes_per_ms < 0.51 * before);
        assert_true(slow < 8);
    }
    texture_note_pace(&pace, 4, 64000, 0.25); /* fast again: not all at once */
    assert_true(pace.bytes_per_ms > 60e3 && pace.bytes_per_ms < 100e3);
}

static void a_frame_at_rest_leaves_the_uploads_of_one_in_motion(void **state)
{
    (void)state;
    struct rig rig;
    open_rig(&rig, SIDE, SIDE, false);
    prepare(&rig, 1, 2, 0, false);
    begin_incoming(&rig, 0);
    uint32_t level = rig.pool->incoming.level, row = rig.pool->incoming.row;
    prepare(&rig, 1, 2, 0, false); /* all of it is there */
    prepare(&rig, 2, 3, 2, false); /* a little comes */
    assert_ptr_equal(rig.pool->incoming.of, texture_of(&rig, 0));
    assert_int_equal(rig.pool->incoming.level, level);
    assert_int_equal(rig.pool->incoming.row, row);
    struct report_textures report = prepare(&rig, 0, 1, 0, false); /* the rest of it */
    assert_null(rig.pool->incoming.of);
    assert_int_equal(texture_of(&rig, 0)->full.top, 0);
    assert_true(report.written_bytes > 0);
    assert_true(report.written_bytes < texture_levels_bytes(SIDE, SIDE, 0));
    close_rig(&rig);
}

/* Those give way where there is no room for both. */
static void uploads_of_a_frame_in_motion_give_way_to_the_budget(void **state)
{
    (void)state;
    struct rig rig;
    open_rig(&rig, SIDE, SIDE, false);
    begin_incoming(&rig, 0);
    struct report_textures report = prepare(&rig, 1, 4, 1, false);
    assert_int_equal(report.level_bias, 0);
    report = prepare(&rig, 2, 5, 0, false);
    assert_int_equal(report.coarse_count, 1); /* 4.2 MB do not fit */
    assert_true(rig.pool->most_bytes <= BUDGET + texture_levels_bytes(SIDE, SIDE, 0));
    assert_null(rig.pool->incoming.of);
    close_rig(&rig);
}

int main(void)
{
    struct error err = {0};
    context = gl_context_create(&(struct gl_context_desc){.is_strict = true}, &err);
    if (!context)
        return SKIPPED;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(textures_that_change_form_keep_the_budget),
        cmocka_unit_test(frames_in_motion_read_no_level_that_blocks_stand_for),
        cmocka_unit_test(images_with_alpha_take_blocks_with_alpha),
        cmocka_unit_test(colours_are_compressed_from_so_many_levels_on),
        cmocka_unit_test(a_plan_counts_what_is_budgeted),
        cmocka_unit_test(levels_that_fit_count_at_once_and_come_with_the_first_frame_that_samples),
        cmocka_unit_test(levels_that_nobody_sampled_give_way_to_another_scene),
        cmocka_unit_test(frames_wait_for_their_uploads_where_they_are_told_to),
        cmocka_unit_test(a_low_pace_is_learnt_anew_from_wide_rows),
        cmocka_unit_test(a_frame_that_took_too_long_halves_the_next_calls),
        cmocka_unit_test(a_frame_at_rest_leaves_the_uploads_of_one_in_motion),
        cmocka_unit_test(uploads_of_a_frame_in_motion_give_way_to_the_budget),
    };
    int failures = cmocka_run_group_tests(tests, NULL, NULL);
    gl_context_destroy(context);
    return failures;
}
