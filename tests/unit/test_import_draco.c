/* SPDX-License-Identifier: MIT */
/* KHR_draco_mesh_compression: what Draco's encoder wrote comes back, and streams that do not agree
 * with their accessors are refused by the primitive. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/import/draco_shim.h"
#include "tests/support/draco_encoder_shim.h"
#include "tests/support/import_support.h"

enum { SIDE = 9, POINTS = SIDE * SIDE, TRIANGLES = (SIDE - 1) * (SIDE - 1) * 2 };

/* A bowl. */
struct bowl {
    float positions[POINTS][3], normals[POINTS][3];
    uint32_t indices[3 * TRIANGLES];
    void *stream; /* owned */
    size_t stream_bytes;
};

static struct bowl bowl_make(bool is_sequential, int position_bits)
{
    struct bowl bowl = {.stream = NULL};
    uint32_t *to = bowl.indices;
    for (int i = 0; i < POINTS; i++) {
        int column = i % SIDE - 4, row = i / SIDE - 4;
        float x = (float)column, y = (float)row;
        float length = sqrtf(x * x / 25 + y * y / 25 + 1);
        float position[3] = {x, y, (x * x + y * y) / 10};
        float normal[3] = {-x / 5 / length, -y / 5 / length, 1 / length};
        memcpy(bowl.positions[i], position, sizeof position);
        memcpy(bowl.normals[i], normal, sizeof normal);
    }
    for (uint32_t y = 0; y + 1 < SIDE; y++)
        for (uint32_t x = 0; x + 1 < SIDE; x++) {
            uint32_t a = y * SIDE + x;
            uint32_t corners[6] = {a, a + 1, a + SIDE, a + SIDE, a + 1, a + SIDE + 1};
            memcpy(to, corners, sizeof corners);
            to += 6;
        }
    bowl.stream = draco_encode(&(struct draco_encoder_desc){.points = POINTS,
                                                            .triangles = TRIANGLES,
                                                            .indices = bowl.indices,
                                                            .positions = bowl.positions[0],
                                                            .normals = bowl.normals[0],
                                                            .position_bits = position_bits,
                                                            .is_sequential = is_sequential},
                               &bowl.stream_bytes);
    assert_non_null(bowl.stream);
    return bowl;
}

struct members {                  /* of the primitive; zeroed: the true ones */
    int points, indices, normals; /* counts of the accessors */
    int normal_component;         /* component type of the accessor of NORMAL */
    const char *normal_type;
    const char *extension; /* what KHR_draco_mesh_compression says */
    const char *mode;
    bool has_no_indices;
};

static bool import(const struct bowl *bowl, struct members m, struct imported_scene *s,
                   struct error *err)
{
    char json[2048];
    snprintf(json, sizeof json,
             "{'asset':{'version':'2.0'},'extensionsUsed':['KHR_draco_mesh_compression'],"
             "'extensionsRequired':['KHR_draco_mesh_compression'],'buffers':[{'byteLength':%zu}],"
             "'bufferViews':[{'buffer':0,'byteLength':%zu}],'accessors':["
             "{'componentType':5126,'count':%d,'type':'VEC3'},"
             "{'componentType':5123,'count':%d,'type':'SCALAR'},"
             "{'componentType':%d,'count':%d,'type':'%s','normalized':true}],"
             "'meshes':[{'name':'Bowl','primitives':[{'attributes':{'POSITION':0,'NORMAL':2}%s,"
             "'mode':%s,'extensions':{'KHR_draco_mesh_compression':{%s}}}]}],'nodes':[{'mesh':0}],"
             "'scenes':[{'nodes':[0]}]}",
             bowl->stream_bytes, bowl->stream_bytes, m.points ? m.points : POINTS,
             m.indices ? m.indices : 3 * TRIANGLES, m.normal_component ? m.normal_component : 5126,
             m.normals ? m.normals : POINTS, m.normal_type ? m.normal_type : "VEC3",
             m.has_no_indices ? "" : ",'indices':1", m.mode ? m.mode : "4",
             m.extension ? m.extension : "'bufferView':0,'attributes':{'POSITION':0,'NORMAL':1}");
    return imported_scene_make(s, json, bowl->stream, bowl->stream_bytes, err);
}

/* The largest distance of a vertex from its place on the bowl, and likewise of its normal. */
static void measure(const struct bowl *bowl, const struct scene *scene, double *away, double *bent)
{
    *away = *bent = 0;
    assert_int_equal(scene->primitives[0].index_count, 3 * TRIANGLES);
    assert_int_equal(scene->primitives[0].vertex_count, POINTS);
    assert_int_equal(scene->warning_count, 0);
    for (uint32_t v = 0; v < POINTS; v++) {
        const float *p = scene->positions + 3 * (size_t)v, *n = scene->normals + 3 * (size_t)v;
        long i = lroundf(p[1] + 4) * SIDE + lroundf(p[0] + 4);
        assert_true(i >= 0 && i < POINTS);
        for (int k = 0; k < 3; k++) {
            *away = fmax(*away, fabsf(p[k] - bowl->positions[i][k]));
            *bent = fmax(*bent, fabsf(n[k] - bowl->normals[i][k]));
        }
    }
}

static void both_methods_bring_back_what_was_encoded(void **state)
{
    (void)state;
    for (int i = 0; i < 4; i++) {
        struct bowl bowl = bowl_make(i % 2, i / 2 ? 12 : 0);
        struct imported_scene s;
        struct error err = {0};
        double away, bent;
        if (!import(&bowl, (struct members){.has_no_indices = i == 3}, &s, &err))
            fail_msg("%d: %s", i, err.message);
        measure(&bowl, &s.scene, &away, &bent);
        assert_true(away <= (i / 2 ? 8.0 / 4095 : 0)); /* a step of 12 bits over 8 m */
        assert_true(bent < 1e-6);
        imported_scene_finish(&s);
        free(bowl.stream);
    }
}

/* Draco knows triangles alone: a strip comes as those that it was cut into, and its length before
 * says nothing of how many they are. */
static void strips_bring_back_their_triangles(void **state)
{
    (void)state;
    struct bowl bowl = bowl_make(true, 0);
    for (int indices = 0; indices < 200; indices += 137) {
        struct imported_scene s;
        struct error err = {0};
        double away, bent;
        if (!import(&bowl, (struct members){.mode = "5", .indices = indices}, &s, &err))
            fail_msg("%s", err.message);
        assert_int_equal(s.scene.primitives[0].topology, SCENE_TRIANGLES);
        measure(&bowl, &s.scene, &away, &bent);
        assert_true(away == 0 && bent < 1e-6);
        imported_scene_finish(&s);
    }
    free(bowl.stream);
}

struct refusal {
    struct members members;
    const char *says;
    enum error_code code; /* 0: ERROR_INVALID_SCENE */
};

static void streams_that_do_not_agree_are_refused_by_their_primitive(void **state)
{
    (void)state;
    static const struct refusal refusals[] = {
        {{.points = 80}, "has 81 points, POSITION has 80", 0},
        {{.points = 2000000000}, "has 81 points, POSITION has 2000000000", 0},
        {{.indices = 381}, "has 128 triangles, its indices make 127", 0},
        {{.indices = 383}, "accessor 1 of its indices does not count triangles", 0},
        {{.normals = 7}, "NORMAL: accessor 2 has 7 elements, POSITION has 81", 0},
        {{.normal_type = "VEC2"}, "has 3 components, its accessor 2", 0},
        {{.normal_type = "MAT3"}, "there is no vector in accessor 2", 0},
        {{.normal_component = 5124}, "cannot be had in component type 5124", 0},
        {{.extension = "'bufferView':0,'attributes':{'POSITION':0,'NORMAL':9}"},
         "has no attribute 9",
         0},
        {{.extension = "'bufferView':4,'attributes':{'POSITION':0}"},
         "there is no buffer view 4",
         0},
        {{.mode = "1"}, "its mode is 1", 0},
        {{.mode = "6"}, "its mode is 6", 0},
        {{.mode = "5", .indices = 2}, "accessor 1 of its indices does not count triangles", 0},
    };
    struct bowl bowl = bowl_make(true, 0);
    for (size_t i = 0; i < sizeof refusals / sizeof *refusals; i++) {
        struct imported_scene s;
        struct error err = {0};
        assert_false(import(&bowl, refusals[i].members, &s, &err));
        enum error_code code = refusals[i].code ? refusals[i].code : ERROR_INVALID_SCENE;
        if (err.code != code || !strstr(err.message, refusals[i].says) ||
            !strstr(err.message, "mesh 0 'Bowl', primitive 0"))
            fail_msg("%zu: code %d, '%s'", i, (int)err.code, err.message);
    }
    free(bowl.stream);
}

static bool decode(const uint8_t *bytes, size_t size, uint64_t max_bytes, struct error *err)
{
    struct draco_mesh *mesh = draco_mesh_create(&(struct draco_desc){.bytes = bytes,
                                                                     .size_bytes = size,
                                                                     .points = POINTS,
                                                                     .triangles = TRIANGLES,
                                                                     .max_bytes = max_bytes},
                                                err);
    draco_mesh_destroy(mesh);
    return mesh;
}

static void streams_cut_anywhere_are_refused(void **state)
{
    (void)state;
    for (int method = 0; method < 2; method++) {
        struct bowl bowl = bowl_make(method, 11);
        for (size_t size = 0; size < bowl.stream_bytes; size++) {
            uint8_t *copy = malloc(size + 1); /* short: ASan looks */
            struct error err = {0};
            assert_non_null(copy);
            memcpy(copy, bowl.stream, size);
            /* a few bytes of padding at the end may be missing unnoticed */
            if (decode(copy, size, 1 << 20, &err) ? size + 8 < bowl.stream_bytes
                                                  : err.code != ERROR_INVALID_SCENE)
                fail_msg("%zu of %zu: %s", size, bowl.stream_bytes, err.message);
            free(copy);
        }
        free(bowl.stream);
    }
}

static void other_streams_are_refused(void **state)
{
    (void)state;
    struct bowl bowl = bowl_make(false, 11);
    uint8_t *bytes = bowl.stream;
    struct error large = {0}, version = {0}, cloud = {0};
    assert_false(decode(bytes, bowl.stream_bytes, 10000, &large));
    assert_int_equal(large.code, ERROR_TOO_LARGE);
    bytes[6] = 1; /* the minor version */
    assert_false(decode(bytes, bowl.stream_bytes, 1 << 20, &version));
    assert_int_equal(version.code, ERROR_UNSUPPORTED);
    assert_non_null(strstr(version.message, "version 2.1, only 2.2"));
    bytes[6] = 2;
    bytes[7] = 0; /* of points instead of triangles */
    assert_false(decode(bytes, bowl.stream_bytes, 1 << 20, &cloud));
    assert_non_null(strstr(cloud.message, "no stream of a mesh"));
    free(bowl.stream);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(both_methods_bring_back_what_was_encoded),
        cmocka_unit_test(strips_bring_back_their_triangles),
        cmocka_unit_test(streams_that_do_not_agree_are_refused_by_their_primitive),
        cmocka_unit_test(streams_cut_anywhere_are_refused),
        cmocka_unit_test(other_streams_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
