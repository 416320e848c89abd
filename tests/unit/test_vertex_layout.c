/* SPDX-License-Identifier: MIT */
/* Vertices as a device has them: every number is there, in no more bytes than it takes. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/draw/vertex_layout.h"

enum { PRIMITIVES = 12, VERTICES = 160, INDICES_EACH = 30 };

/* A scene that a blob may hold: ranges overlap, have gaps between them, and any streams. */
struct soup {
    struct scene scene;
    struct scene_primitive primitives[PRIMITIVES];
    uint32_t indices[PRIMITIVES * INDICES_EACH];
    float streams[VERTEX_STREAM_COUNT][VERTICES * 4];
};

static const uint32_t widths[VERTEX_STREAM_COUNT] = {3, 3, 4, 2, 2, 4};

static uint32_t pick(uint64_t *seed, uint32_t below)
{
    *seed = *seed * 6364136223846793005ull + 1442695040888963407ull;
    return (uint32_t)(*seed >> 33) % below;
}

/* Numbers of one kind: bytes, signed or not, of 16 bits, parts of 255 or 65,535, any. */
static float number_of(int kind, uint64_t *seed)
{
    switch (kind) {
    case 0:
        return (float)pick(seed, 256);
    case 1:
        return (float)pick(seed, 256) - 128;
    case 2:
        return (float)pick(seed, 256) / 255;
    case 3:
        return (float)pick(seed, 65536);
    case 4:
        return (float)pick(seed, 65536) - 32768;
    case 5:
        return (float)pick(seed, 65536) / 65535;
    default:
        return (float)pick(seed, 1 << 24) / 12345;
    }
}

static void bind_streams(struct soup *soup, uint32_t optionals)
{
    soup->scene.positions = soup->streams[VERTEX_POSITION];
    soup->scene.normals = soup->streams[VERTEX_NORMAL];
    soup->scene.tangents = optionals & 1 ? soup->streams[VERTEX_TANGENT] : NULL;
    soup->scene.texcoords_0 = optionals & 2 ? soup->streams[VERTEX_TEXCOORD_0] : NULL;
    soup->scene.texcoords_1 = optionals & 4 ? soup->streams[VERTEX_TEXCOORD_1] : NULL;
    soup->scene.colors = optionals & 8 ? soup->streams[VERTEX_COLOR] : NULL;
}

static void make_soup(struct soup *soup, uint64_t seed)
{
    *soup = (struct soup){.scene = {.primitives = soup->primitives,
                                    .primitive_count = PRIMITIVES,
                                    .indices = soup->indices,
                                    .index_count = PRIMITIVES * INDICES_EACH,
                                    .vertex_count = VERTICES}};
    bind_streams(soup, pick(&seed, 16));
    for (int s = 0; s < VERTEX_STREAM_COUNT; s++) {
        int kind = (int)pick(&seed, 7);
        for (int i = 0; i < VERTICES * 4; i++)
            soup->streams[s][i] = number_of(kind, &seed);
    }
    for (uint32_t i = 0; i < PRIMITIVES; i++) {
        struct scene_primitive *p = &soup->primitives[i];
        p->first_vertex = pick(&seed, VERTICES - 1);
        p->vertex_count =
            1 + pick(&seed, VERTICES - p->first_vertex < 20 ? VERTICES - p->first_vertex : 20);
        p->first_index = i * INDICES_EACH;
        p->index_count = pick(&seed, INDICES_EACH + 1);
        p->flags = SCENE_PRIMITIVE_HAS_NORMALS | pick(&seed, 16);
        for (uint32_t k = 0; k < p->index_count; k++)
            soup->indices[p->first_index + k] = pick(&seed, p->vertex_count);
    }
}

/* What a device makes of a number (OpenGL 4.5 core profile, 2.3.5). */
static float read_number(const struct vertex_format *format, const unsigned char *at, uint32_t k)
{
    int8_t i8;
    int16_t i16;
    uint16_t u16;
    float f32;
    memcpy(&i16, at + 2 * (size_t)k, format->type >= VERTEX_U16 ? 2 : 0);
    memcpy(&u16, at + 2 * (size_t)k, format->type >= VERTEX_U16 ? 2 : 0);
    memcpy(&i8, at + k, 1);
    switch (format->type) {
    case VERTEX_U8:
        return format->is_normalized ? (float)at[k] / 255 : (float)at[k];
    case VERTEX_I8:
        return (float)i8;
    case VERTEX_U16:
        return format->is_normalized ? (float)u16 / 65535 : (float)u16;
    case VERTEX_I16:
        return (float)i16;
    default:
        memcpy(&f32, at + 4 * (size_t)k, 4);
        return f32;
    }
}

static void check_stream(const struct vertex_layout *layout, enum vertex_stream stream,
                         const float *values)
{
    const struct vertex_format *format = &layout->formats[stream];
    const struct scene *scene = layout->scene;
    uint64_t bytes = vertex_layout_stream_bytes(layout, stream);
    const void *lent = vertex_layout_borrow(layout, stream);
    unsigned char *made = malloc(bytes + 1);
    assert_non_null(made);
    memset(made, 0xab, bytes + 1);
    vertex_layout_write(layout, stream, made);
    assert_int_equal(made[bytes], 0xab);
    if (lent)
        assert_memory_equal(lent, made, bytes);
    for (uint32_t i = 0; i < scene->primitive_count; i++) {
        const struct scene_primitive *p = &scene->primitives[i];
        bool has = stream < VERTEX_TANGENT || p->flags >> (stream - VERTEX_TANGENT) & 1;
        for (uint32_t v = 0; v < p->vertex_count && has && values; v++) {
            uint64_t at = (uint64_t)layout->ranges[i].first_vertex + v;
            assert_true(at < format->count);
            for (uint32_t k = 0; k < widths[stream]; k++)
                assert_true(read_number(format, made + at * format->stride_bytes, k) ==
                            values[(size_t)widths[stream] * (p->first_vertex + v) + k]);
        }
    }
    free(made);
}

static void check_indices(const struct vertex_layout *layout)
{
    uint64_t bytes = vertex_layout_index_bytes(layout);
    const struct scene *scene = layout->scene;
    unsigned char *made = malloc(bytes + 1);
    assert_non_null(made);
    made[bytes] = 0xab;
    vertex_layout_write_indices(layout, made);
    assert_int_equal(made[bytes], 0xab);
    for (uint32_t i = 0; i < scene->primitive_count; i++) {
        const struct scene_primitive *p = &scene->primitives[i];
        const struct vertex_range *range = &layout->ranges[i];
        for (uint64_t k = range->first_index, n = 0; n < p->index_count; k++, n++) {
            uint32_t index = range->has_short_indices ? ((uint16_t *)(void *)made)[k]
                                                      : ((uint32_t *)(void *)made)[k];
            assert_int_equal(index, scene->indices[p->first_index + n]);
        }
    }
    free(made);
}

static void any_scene_has_all_its_numbers(void **state)
{
    (void)state;
    static struct soup soup;
    for (uint64_t seed = 1; seed <= 2000; seed++) {
        struct vertex_layout layout;
        struct error err = {0};
        make_soup(&soup, seed);
        assert_true(vertex_layout_init(&layout, &soup.scene, &err));
        for (int s = 0; s < VERTEX_STREAM_COUNT; s++) {
            bool has = s < VERTEX_TANGENT || layout.optionals >> (s - VERTEX_TANGENT) & 1;
            assert_int_equal(has, layout.formats[s].count > 0);
            assert_true(layout.formats[s].count <= VERTICES);
            assert_int_equal(layout.formats[s].stride_bytes % 4, 0);
            if (has)
                check_stream(&layout, (enum vertex_stream)s, soup.streams[s]);
        }
        check_indices(&layout);
        vertex_layout_finish(&layout);
    }
}

static void streams_take_the_narrowest_type_that_has_their_values(void **state)
{
    (void)state;
    static const struct {
        float values[2];
        enum vertex_stream stream;
        enum vertex_type type;
        bool is_normalized;
        uint32_t stride_bytes;
    } rows[] = {
        {{0, 255}, VERTEX_POSITION, VERTEX_U8, false, 4},
        {{-128, 127}, VERTEX_POSITION, VERTEX_I8, false, 4},
        {{-1, 128}, VERTEX_POSITION, VERTEX_I16, false, 8},
        {{0, 65535}, VERTEX_POSITION, VERTEX_U16, false, 8},
        {{-1, 32768}, VERTEX_POSITION, VERTEX_F32, false, 12},
        {{0, 65536}, VERTEX_POSITION, VERTEX_F32, false, 12},
        {{0, 0.5f}, VERTEX_POSITION, VERTEX_F32, false, 12},
        {{1, 7 / 65535.0f}, VERTEX_POSITION, VERTEX_F32, false, 12}, /* may be read inexactly */
        {{-1, 1}, VERTEX_NORMAL, VERTEX_I8, false, 4},
        {{0, 7 / 255.0f}, VERTEX_COLOR, VERTEX_U8, true, 4},
        {{1, 7 / 65535.0f}, VERTEX_COLOR, VERTEX_U16, true, 8},
        {{0.25f, 1}, VERTEX_COLOR, VERTEX_F32, false, 16},
        {{1, 7 / 65535.0f}, VERTEX_TEXCOORD_0, VERTEX_U16, true, 4},
        {{1024, 8}, VERTEX_TEXCOORD_0, VERTEX_U16, false, 4},
        {{-1024, 8}, VERTEX_TEXCOORD_0, VERTEX_I16, false, 4},
    };
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        float streams[VERTEX_STREAM_COUNT][4] = {{0}};
        const uint32_t index = 0;
        const struct scene_primitive p = {
            .index_count = 1, .vertex_count = 1, .flags = VERTEX_OPTIONALS};
        const struct scene scene = {.primitives = &p,
                                    .primitive_count = 1,
                                    .indices = &index,
                                    .index_count = 1,
                                    .vertex_count = 1,
                                    .positions = streams[0],
                                    .normals = streams[1],
                                    .tangents = streams[2],
                                    .texcoords_0 = streams[3],
                                    .texcoords_1 = streams[4],
                                    .colors = streams[5]};
        struct vertex_layout layout;
        struct error err = {0};
        memcpy(streams[rows[r].stream], rows[r].values, sizeof rows[r].values);
        assert_true(vertex_layout_init(&layout, &scene, &err));
        const struct vertex_format *format = &layout.formats[rows[r].stream];
        assert_int_equal(format->type, rows[r].type);
        assert_int_equal(format->is_normalized, rows[r].is_normalized);
        assert_int_equal(format->stride_bytes, rows[r].stride_bytes);
        vertex_layout_finish(&layout);
    }
}

/* Ten vertices each of: all streams, texture coordinates, colours beside them, nothing, and again
 * texture coordinates. */
static void streams_end_with_the_last_vertex_that_has_them(void **state)
{
    (void)state;
    static const uint32_t sets[] = {0, 2, 15, 10, 2};
    static struct soup soup;
    struct vertex_layout layout;
    struct error err = {0};
    make_soup(&soup, 1);
    bind_streams(&soup, VERTEX_OPTIONALS);
    soup.scene.primitive_count = 5;
    for (uint32_t i = 0; i < 5; i++)
        soup.primitives[i] =
            (struct scene_primitive){.first_vertex = 10 * i, .vertex_count = 10, .flags = sets[i]};
    assert_true(vertex_layout_init(&layout, &soup.scene, &err));
    static const uint64_t expected[VERTEX_STREAM_COUNT] = {50, 50, 10, 40, 10, 20};
    for (int s = 0; s < VERTEX_STREAM_COUNT; s++)
        assert_int_equal(layout.formats[s].count, expected[s]);
    assert_int_equal(layout.ranges[2].first_vertex, 0);
    assert_int_equal(layout.ranges[3].first_vertex, 10);
    assert_int_equal(layout.ranges[0].first_vertex, 40);
    vertex_layout_finish(&layout);
}

static void indices_take_16_bits_up_to_65536_vertices(void **state)
{
    (void)state;
    enum { MANY = 65537 };
    const uint32_t indices[] = {0, 65535, 7, 65536, 65536, 0, 3};
    const struct scene_primitive primitives[] = {
        {.first_index = 0, .index_count = 3, .vertex_count = 65536},
        {.first_index = 3, .index_count = 3, .vertex_count = MANY},
        {.first_index = 6, .index_count = 1, .vertex_count = 4},
    };
    float *zeros = calloc(MANY, 3 * sizeof *zeros);
    assert_non_null(zeros);
    const struct scene scene = {.primitives = primitives,
                                .primitive_count = 3,
                                .indices = indices,
                                .index_count = 7,
                                .vertex_count = MANY,
                                .positions = zeros,
                                .normals = zeros};
    struct vertex_layout layout;
    struct error err = {0};
    assert_true(vertex_layout_init(&layout, &scene, &err));
    assert_true(layout.ranges[0].has_short_indices && layout.ranges[2].has_short_indices);
    assert_false(layout.ranges[1].has_short_indices);
    assert_int_equal(layout.ranges[1].first_index, 2); /* behind four of 16 bits */
    assert_int_equal(vertex_layout_index_bytes(&layout), 4 * 2 + 3 * 4);
    check_indices(&layout);
    vertex_layout_finish(&layout);
    free(zeros);
}

static void without_vertices_there_is_nothing(void **state)
{
    (void)state;
    const struct scene scene = {0};
    struct vertex_layout layout;
    struct error err = {0};
    assert_true(vertex_layout_init(&layout, &scene, &err));
    for (int s = 0; s < VERTEX_STREAM_COUNT; s++)
        assert_int_equal(vertex_layout_stream_bytes(&layout, (enum vertex_stream)s), 0);
    assert_int_equal(vertex_layout_index_bytes(&layout), 0);
    vertex_layout_finish(&layout);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(any_scene_has_all_its_numbers),
        cmocka_unit_test(streams_take_the_narrowest_type_that_has_their_values),
        cmocka_unit_test(streams_end_with_the_last_vertex_that_has_them),
        cmocka_unit_test(indices_take_16_bits_up_to_65536_vertices),
        cmocka_unit_test(without_vertices_there_is_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
