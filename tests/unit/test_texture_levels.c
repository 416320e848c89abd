/* SPDX-License-Identifier: MIT */
/* Levels of detail are means over areas, of light where the image is sRGB; and a blob whose pixels
 * were written as they came is the one that was made in memory. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "glb/glb_builder.h"
#include "renderer/scene/texture_levels.h"
#include "tests/support/import_support.h"

static struct texture_tables *tables_make(void)
{
    struct error err = {0};
    struct texture_tables *tables = texture_tables_create(&err);
    assert_non_null(tables);
    return tables;
}

static uint8_t *build(const struct texture_tables *tables, const uint8_t *pixels, uint32_t width,
                      uint32_t height, bool is_srgb)
{
    uint8_t *levels = malloc(texture_levels_bytes(width, height, 1) + 1);
    assert_non_null(levels);
    texture_levels_build(&(struct texture_levels_desc){.tables = tables,
                                                       .pixels = pixels,
                                                       .width_px = width,
                                                       .height_px = height,
                                                       .is_srgb = is_srgb},
                         levels);
    return levels;
}

static void sides_are_halved_and_rounded_down_to_one(void **state)
{
    (void)state;
    assert_int_equal(texture_level_count(1, 1), 1);
    assert_int_equal(texture_level_count(5, 3), 3);
    assert_int_equal(texture_level_count(16384, 1), 15);
    assert_int_equal(texture_level_side(5, 1), 2);
    assert_int_equal(texture_level_side(5, 9), 1);
    assert_int_equal(texture_levels_bytes(5, 3, 0), 4 * (15 + 2 + 1));
    assert_int_equal(texture_levels_bytes(5, 3, 2), 4);
    assert_int_equal(texture_levels_bytes(5, 3, 3), 0);
}

static double light_of(double s)
{
    return s <= 0.04045 ? s / 12.92 : pow((s + 0.055) / 1.055, 2.4);
}

static double srgb_of(double light)
{
    return light <= 0.0031308 ? light * 12.92 : 1.055 * pow(light, 1 / 2.4) - 0.055;
}

static double overlap(uint32_t texel, uint32_t size, uint32_t of, uint32_t shrunk)
{
    double ratio = (double)size / shrunk;
    double low = fmax(texel, of * ratio), high = fmin(texel + 1.0, (of + 1) * ratio);
    return fmax(0, high - low) / ratio;
}

/* One texel of the level below `from`, in f64. */
static double mean_of(const uint8_t *from, uint32_t width, uint32_t height, uint32_t x, uint32_t y,
                      int channel, bool is_srgb)
{
    uint32_t w = texture_level_side(width, 1), h = texture_level_side(height, 1);
    double sum = 0;
    for (uint32_t j = 0; j < height; j++)
        for (uint32_t i = 0; i < width; i++) {
            double value = from[4 * (j * width + i) + (uint32_t)channel] / 255.0;
            bool is_light = is_srgb && channel < 3;
            sum += overlap(i, width, x, w) * overlap(j, height, y, h) *
                   (is_light ? light_of(value) : value);
        }
    return 255 * (is_srgb && channel < 3 ? srgb_of(sum) : sum);
}

static void check_levels(const struct texture_tables *tables, uint32_t width, uint32_t height,
                         bool is_srgb)
{
    uint8_t *pixels = malloc(4ull * width * height);
    assert_non_null(pixels);
    uint32_t random = 12345 + width * 7919 + height;
    for (uint32_t i = 0; i < 4 * width * height; i++)
        pixels[i] = (uint8_t)((random = random * 1664525 + 1013904223) >> 24);
    uint8_t *levels = build(tables, pixels, width, height, is_srgb);
    const uint8_t *from = pixels, *to = levels;
    for (uint32_t level = 1; level < texture_level_count(width, height); level++) {
        uint32_t w = texture_level_side(width, level - 1),
                 h = texture_level_side(height, level - 1);
        uint32_t x_count = texture_level_side(w, 1), y_count = texture_level_side(h, 1);
        for (uint32_t y = 0; y < y_count; y++)
            for (uint32_t x = 0; x < x_count; x++)
                for (int c = 0; c < 4; c++) {
                    double expected = mean_of(from, w, h, x, y, c, is_srgb);
                    double found = to[4 * (y * x_count + x) + (uint32_t)c];
                    if (fabs(found - expected) > 0.5 + 0.03) /* rounded once, through a table */
                        fail_msg("%ux%u level %u at %u,%u: %g, not %g", width, height, level, x, y,
                                 found, expected);
                }
        from = to;
        to += 4ull * x_count * y_count;
    }
    assert_ptr_equal(to, levels + texture_levels_bytes(width, height, 1));
    free(levels);
    free(pixels);
}

static void texels_are_means_of_the_area_that_they_cover(void **state)
{
    (void)state;
    static const uint32_t sizes[][2] = {{2, 2},  {16, 16}, {3, 3}, {5, 4},  {7, 1},
                                        {1, 13}, {6, 10},  {9, 7}, {31, 2}, {2, 31}};
    struct texture_tables *tables = tables_make();
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
        for (int is_srgb = 0; is_srgb < 2; is_srgb++)
            check_levels(tables, sizes[i][0], sizes[i][1], is_srgb);
    texture_tables_destroy(tables);
}

static void a_uniform_image_stays_as_it_is(void **state)
{
    (void)state;
    struct texture_tables *tables = tables_make();
    for (int value = 0; value < 256; value++)
        for (int is_srgb = 0; is_srgb < 2; is_srgb++) {
            uint8_t pixels[4 * 6 * 5];
            memset(pixels, value, sizeof pixels);
            uint8_t *levels = build(tables, pixels, 6, 5, is_srgb);
            for (size_t i = 0; i < texture_levels_bytes(6, 5, 1); i++)
                assert_int_equal(levels[i], value);
            free(levels);
        }
    texture_tables_destroy(tables);
}

static void black_and_white_average_to_half_the_light(void **state)
{
    (void)state;
    struct texture_tables *tables = tables_make();
    const uint8_t pixels[8] = {0, 0, 0, 0, 255, 255, 255, 255};
    uint8_t *light = build(tables, pixels, 2, 1, true), *plain = build(tables, pixels, 2, 1, false);
    assert_int_equal(light[0], 188); /* 1.055 * 0.5^(1/2.4) - 0.055 = 0.7354 */
    assert_int_equal(light[3], 128);
    assert_int_equal(plain[0], 128);
    free(light);
    free(plain);
    texture_tables_destroy(tables);
}

/* ---- blobs ---- */

/* Two images, one sampled as sRGB and linear; sides that are no powers of two. */
static void *make_scene(size_t *size)
{
    struct error err = {0};
    struct glb_builder *b = glb_builder_create("textures", &err);
    assert_non_null(b);
    uint8_t pixels[4 * 12 * 7];
    for (size_t i = 0; i < sizeof pixels; i++)
        pixels[i] = (uint8_t)(i * 37 % 251 + 4);
    int image = glb_builder_add_image(b, "both", pixels, 12, 7);
    int other = glb_builder_add_image(b, "light", pixels + 8, 3, 5);
    int texture = glb_builder_add_texture(b, &(struct glb_texture_desc){.image = image});
    int second = glb_builder_add_texture(b, &(struct glb_texture_desc){.image = other});
    int material = glb_builder_add_material(
        b, &(struct glb_material_desc){.base_color_texture = {.texture = texture},
                                       .emissive = {1, 1, 1},
                                       .normal_texture = {.texture = texture},
                                       .emissive_texture = {.texture = second}});
    static const float positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    static const float texcoords[] = {0, 0, 1, 0, 0, 1};
    int mesh = glb_builder_add_mesh(b, "triangle",
                                    &(struct glb_primitive_desc){.material = material,
                                                                 .vertex_count = 3,
                                                                 .positions = positions,
                                                                 .texcoords = texcoords},
                                    1);
    glb_builder_add_node(b, &(struct glb_node_desc){.mesh = mesh});
    void *glb = NULL;
    if (!glb_builder_finish(b, &glb, size, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(b);
    return glb;
}

static void levels_are_there_as_materials_sample_them(void **state)
{
    (void)state;
    struct error err = {0};
    size_t size;
    void *glb = make_scene(&size);
    struct imported_scene s;
    assert_true(imported_scene_init(&s, &(struct scene_file){"", glb, size}, 1, &err));
    assert_int_equal(s.scene.image_count, 2);
    const struct scene_image *both = &s.scene.images[0], *light = &s.scene.images[1];
    assert_int_equal(s.scene.pixel_bytes, texture_levels_bytes(12, 7, 0) +
                                              texture_levels_bytes(12, 7, 1) +
                                              texture_levels_bytes(3, 5, 0));
    assert_true(both->levels_offset_bytes[0] && both->levels_offset_bytes[1]);
    assert_true(!light->levels_offset_bytes[0] && light->levels_offset_bytes[1]);
    struct texture_tables *tables = tables_make();
    for (int is_srgb = 0; is_srgb < 2; is_srgb++) {
        uint8_t *levels = build(tables, s.scene.pixels + both->offset_bytes, 12, 7, is_srgb);
        assert_memory_equal(levels, s.scene.pixels + both->levels_offset_bytes[is_srgb],
                            texture_levels_bytes(12, 7, 1));
        free(levels);
    }
    texture_tables_destroy(tables);
    uint32_t least = 255;
    for (int i = 0; i < 12 * 7; i++)
        least = s.scene.pixels[both->offset_bytes + 4 * (uint64_t)i + 3] < least
                    ? s.scene.pixels[both->offset_bytes + 4 * (uint64_t)i + 3]
                    : least;
    assert_int_equal(both->least_alpha, least);
    imported_scene_finish(&s);
    free(glb);
}

struct sink {
    uint8_t *bytes;
    size_t size;
    atomic_int calls_left; /* then writing fails */
};

static bool sink_write(void *context, uint64_t offset, const void *bytes, size_t size,
                       struct error *err)
{
    struct sink *sink = context;
    if (atomic_fetch_sub(&sink->calls_left, 1) <= 0)
        return error_set(err, ERROR_IO, "the disk is full");
    assert_true(offset + size <= sink->size);
    memcpy(sink->bytes + offset, bytes, size);
    return true;
}

static void pixels_written_as_they_come_make_the_same_blob(void **state)
{
    (void)state;
    struct error err = {0};
    size_t size, head_bytes;
    void *glb = make_scene(&size), *head;
    struct scene_file file = {"", glb, size};
    struct imported_scene s;
    assert_true(imported_scene_init(&s, &file, 1, &err));
    struct sink sink = {calloc(1, s.blob_bytes), s.blob_bytes, 100};
    const struct scene_import_desc desc = {
        .files = &file, .file_count = 1, .write = sink_write, .context = &sink};
    assert_true(scene_import(&desc, &head, &head_bytes, &err));
    assert_true(head_bytes < s.blob_bytes);
    struct scene scene;
    assert_true(scene_open_head(&scene, head, head_bytes, &err));
    assert_null(scene.pixels);
    assert_int_equal(scene.pixel_bytes, s.scene.pixel_bytes);
    assert_false(scene_open(&scene, head, head_bytes, &err));
    memcpy(sink.bytes, head, head_bytes);
    assert_memory_equal(sink.bytes, s.blob, s.blob_bytes);
    free(head);
    atomic_store(&sink.calls_left, 2);
    err = (struct error){0};
    assert_false(scene_import(&desc, &head, &head_bytes, &err));
    assert_null(head);
    assert_int_equal(err.code, ERROR_IO);
    free(sink.bytes);
    imported_scene_finish(&s);
    free(glb);
}

static void an_image_without_its_levels_is_refused(void **state)
{
    (void)state;
    struct error err = {0};
    size_t size;
    void *glb = make_scene(&size);
    struct imported_scene s;
    struct scene scene;
    assert_true(imported_scene_init(&s, &(struct scene_file){"", glb, size}, 1, &err));
    struct scene_image *image = (struct scene_image *)(uintptr_t)s.scene.images;
    const struct scene_image intact = *image;
    for (int i = 0; i < 4; i++) {
        *image = intact;
        if (i == 0)
            image->levels_offset_bytes[1] = 0;
        else if (i == 1)
            image->levels_offset_bytes[0] = s.scene.pixel_bytes;
        else if (i == 2)
            image->least_alpha = 256;
        assert_int_equal(scene_open(&scene, s.blob, s.blob_bytes, &err), i == 3);
    }
    imported_scene_finish(&s);
    free(glb);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sides_are_halved_and_rounded_down_to_one),
        cmocka_unit_test(texels_are_means_of_the_area_that_they_cover),
        cmocka_unit_test(a_uniform_image_stays_as_it_is),
        cmocka_unit_test(black_and_white_average_to_half_the_light),
        cmocka_unit_test(levels_are_there_as_materials_sample_them),
        cmocka_unit_test(pixels_written_as_they_come_make_the_same_blob),
        cmocka_unit_test(an_image_without_its_levels_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
