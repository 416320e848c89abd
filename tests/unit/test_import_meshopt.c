/* SPDX-License-Identifier: MIT */
/* Compressed buffer views (EXT_ and KHR_meshopt_compression): what is encoded here comes back, and
 * what lies about itself is refused by the name of its view. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <meshoptimizer.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/import/meshopt_stream.h"
#include "tests/support/import_support.h"

enum { SIDE = 12, VERTICES = SIDE * SIDE, INDICES = (SIDE - 1) * (SIDE - 1) * 6 };
enum { STREAM_MAX = 1 << 14 };

/* A bent sheet of SIDE x SIDE vertices, and its streams. */
struct sheet {
    float positions[VERTICES][3];
    unsigned indices[INDICES];
    uint8_t bin[2 * STREAM_MAX];
    size_t vertex_bytes, index_at, index_bytes, bin_bytes;
};

static void sheet_make(struct sheet *sheet, const char *mode)
{
    memset(sheet, 0, sizeof *sheet);
    for (int v = 0; v < VERTICES; v++) {
        int column = v % SIDE, row = v / SIDE;
        sheet->positions[v][0] = (float)column;
        sheet->positions[v][1] = (float)row;
        sheet->positions[v][2] = sinf((float)v);
    }
    unsigned *to = sheet->indices;
    for (unsigned y = 0; y + 1 < SIDE; y++)
        for (unsigned x = 0; x + 1 < SIDE; x++) {
            unsigned a = y * SIDE + x,
                     corners[6] = {a, a + 1, a + SIDE, a + SIDE, a + 1, a + SIDE + 1};
            memcpy(to, corners, sizeof corners);
            to += 6;
        }
    meshopt_encodeIndexVersion(1);
    sheet->vertex_bytes = meshopt_encodeVertexBuffer(sheet->bin, STREAM_MAX, sheet->positions,
                                                     VERTICES, sizeof sheet->positions[0]);
    sheet->index_at = (sheet->vertex_bytes + 3) / 4 * 4;
    uint8_t *at = sheet->bin + sheet->index_at;
    sheet->index_bytes = strcmp(mode, "TRIANGLES") == 0
                             ? meshopt_encodeIndexBuffer(at, STREAM_MAX, sheet->indices, INDICES)
                             : meshopt_encodeIndexSequence(at, STREAM_MAX, sheet->indices, INDICES);
    assert_true(sheet->vertex_bytes > 0 && sheet->index_bytes > 0);
    sheet->bin_bytes = (sheet->index_at + sheet->index_bytes + 3) / 4 * 4;
}

struct members { /* of the two compressed views; zeroed: the true ones */
    const char *extension, *mode;
    const char *vertices; /* replaces the extension's members of the vertices' view */
    const char *indices;
    const char *view; /* members of the vertices' view itself */
};

static bool import(const struct sheet *sheet, struct members members, struct imported_scene *s,
                   struct error *err)
{
    char json[4096], vertices[256], indices[256];
    const char *extension = members.extension ? members.extension : "EXT_meshopt_compression";
    snprintf(vertices, sizeof vertices,
             "'buffer':0,'byteLength':%zu,'byteStride':12,'count':%d,'mode':'ATTRIBUTES'",
             sheet->vertex_bytes, VERTICES);
    snprintf(indices, sizeof indices,
             "'buffer':0,'byteOffset':%zu,'byteLength':%zu,'byteStride':4,'count':%d,'mode':'%s'",
             sheet->index_at, sheet->index_bytes, INDICES,
             members.mode ? members.mode : "TRIANGLES");
    snprintf(json, sizeof json,
             "{'asset':{'version':'2.0'},'extensionsUsed':['%s'],'extensionsRequired':['%s'],"
             "'buffers':[{'byteLength':%zu},{'byteLength':9999,'extensions':{'%s':"
             "{'fallback':true}}}],'bufferViews':[{'buffer':1,%s,'extensions':{'%s':{%s}}},"
             "{'buffer':1,'byteOffset':1728,'byteLength':%d,'extensions':{'%s':{%s}}}],"
             "'accessors':[{'bufferView':0,'componentType':5126,'count':%d,'type':'VEC3'},"
             "{'bufferView':1,'componentType':5125,'count':%d,'type':'SCALAR'}],"
             "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'indices':1}]}],"
             "'nodes':[{'mesh':0}],'scenes':[{'nodes':[0]}]}",
             extension, extension, sheet->bin_bytes, extension,
             members.view ? members.view : "'byteLength':1728,'byteStride':12", extension,
             members.vertices ? members.vertices : vertices, 4 * INDICES, extension,
             members.indices ? members.indices : indices, VERTICES, INDICES);
    return imported_scene_make(s, json, sheet->bin, sheet->bin_bytes, err);
}

static bool is_at(const float *a, const float *b)
{
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

static void assert_is_sheet(const struct sheet *sheet, const struct scene *scene)
{
    const struct scene_primitive *p = &scene->primitives[0];
    assert_int_equal(scene->warning_count, 0);
    assert_int_equal(p->index_count, INDICES);
    for (uint32_t i = 0; i < INDICES; i += 3)
        for (uint32_t k = 0; k < 3; k++) { /* the codec may begin a triangle at another corner */
            const float *at = scene->positions + 3 * (size_t)scene->indices[i + k];
            bool is_found = false;
            for (uint32_t j = 0; j < 3; j++)
                is_found |= is_at(at, sheet->positions[sheet->indices[i + j]]);
            assert_true(is_found);
        }
}

static void every_mode_brings_back_what_was_encoded(void **state)
{
    (void)state;
    static const char *const modes[] = {"TRIANGLES", "INDICES"};
    static const char *const extensions[] = {"EXT_meshopt_compression", "KHR_meshopt_compression"};
    struct sheet *sheet = malloc(sizeof *sheet);
    assert_non_null(sheet);
    for (int i = 0; i < 4; i++) {
        struct imported_scene s;
        struct error err = {0};
        sheet_make(sheet, modes[i / 2]);
        if (!import(sheet, (struct members){.extension = extensions[i % 2], .mode = modes[i / 2]},
                    &s, &err))
            fail_msg("%s", err.message);
        assert_is_sheet(sheet, &s.scene);
        imported_scene_finish(&s);
    }
    free(sheet);
}

struct refusal {
    struct members members;
    enum error_code code;
    const char *says;
};

static void streams_that_lie_are_refused_by_their_view(void **state)
{
    (void)state;
#define VERTEX_VIEW "'buffer':0,'byteStride':12,'mode':'ATTRIBUTES',"
    static const struct refusal refusals[] = {
        {{.vertices = VERTEX_VIEW "'byteLength':40,'count':144"},
         ERROR_INVALID_SCENE,
         "the 40 bytes are no stream of ATTRIBUTES with 144 elements of 12 bytes"},
        {{.vertices = VERTEX_VIEW "'byteLength':2147483647,'count':144"},
         ERROR_INVALID_SCENE,
         "lie outside buffer 0"},
        {{.vertices = VERTEX_VIEW "'byteLength':100,'count':2147483647"},
         ERROR_INVALID_SCENE,
         "2147483647 elements of 12 bytes cannot be in 100 bytes"},
        {{.vertices = VERTEX_VIEW "'byteLength':100,'count':0"}, ERROR_INVALID_SCENE, "count is 0"},
        {{.vertices = VERTEX_VIEW "'byteLength':100,'count':3"},
         ERROR_INVALID_SCENE,
         "make 36 bytes, the view has 1728"},
        {{.vertices = "'buffer':7,'byteStride':12,'mode':'ATTRIBUTES','byteLength':9,'count':9"},
         ERROR_INVALID_SCENE,
         "there is no buffer 7"},
        {{.vertices = "'buffer':1,'byteStride':12,'mode':'ATTRIBUTES','byteLength':9,'count':9"},
         ERROR_INVALID_SCENE,
         "buffer 1 has no data"},
        {{.vertices = "'buffer':0,'byteStride':16,'mode':'ATTRIBUTES','byteLength':9,'count':9"},
         ERROR_INVALID_SCENE,
         "byteStride is 16, that of the view is 12"},
        {{.vertices = "'buffer':0,'byteStride':260,'mode':'ATTRIBUTES','byteLength':9,'count':9",
          .view = "'byteLength':1728"},
         ERROR_INVALID_SCENE,
         "byteStride is 260, not a multiple of 4 in [4, 256]"},
        {{.vertices = VERTEX_VIEW "'filter':'QUATERNION','byteLength':9,'count':9"},
         ERROR_INVALID_SCENE,
         "byteStride 12 is none of the filter QUATERNION"},
        {{.vertices = VERTEX_VIEW "'filter':'BLUR','byteLength':9,'count':9"},
         ERROR_INVALID_SCENE,
         "filter is 'BLUR', which is unknown"},
        {{.vertices = "'buffer':0,'byteStride':12,'mode':'LINES','byteLength':9,'count':9"},
         ERROR_INVALID_SCENE,
         "mode is 'LINES'"},
    };
    static const struct refusal index_refusals[] = {
        {{.indices = "'buffer':0,'byteStride':4,'mode':'TRIANGLES','byteLength':9,'count':10"},
         ERROR_INVALID_SCENE,
         "count is 10"},
        {{.indices = "'buffer':0,'byteStride':8,'mode':'TRIANGLES','byteLength':9,'count':9"},
         ERROR_INVALID_SCENE,
         "byteStride is 8, that of TRIANGLES must be 2 or 4"},
        {{.indices = "'buffer':0,'byteStride':4,'mode':'INDICES','filter':'EXPONENTIAL',"
                     "'byteLength':9,'count':9"},
         ERROR_INVALID_SCENE,
         "filter EXPONENTIAL goes with the mode ATTRIBUTES only"},
        {{.mode = "INDICES"}, ERROR_INVALID_SCENE, "are no stream of INDICES"},
    };
    struct sheet *sheet = malloc(sizeof *sheet);
    assert_non_null(sheet);
    sheet_make(sheet, "TRIANGLES");
    size_t count = sizeof refusals / sizeof *refusals;
    for (size_t i = 0; i < count + sizeof index_refusals / sizeof *index_refusals; i++) {
        const struct refusal *refusal = i < count ? &refusals[i] : &index_refusals[i - count];
        struct imported_scene s;
        struct error err = {0};
        assert_false(import(sheet, refusal->members, &s, &err));
        if (err.code != refusal->code || !strstr(err.message, refusal->says) ||
            !strstr(err.message, i < count ? "buffer view 0" : "buffer view 1"))
            fail_msg("%zu: code %d, '%s'", i, (int)err.code, err.message);
    }
    free(sheet);
}

static void a_version_to_come_is_unsupported(void **state)
{
    (void)state;
    struct sheet *sheet = malloc(sizeof *sheet);
    assert_non_null(sheet);
    struct imported_scene s;
    struct error err = {0};
    sheet_make(sheet, "TRIANGLES");
    sheet->bin[0] = 0xaf;
    assert_false(import(sheet, (struct members){0}, &s, &err));
    assert_int_equal(err.code, ERROR_UNSUPPORTED);
    assert_non_null(strstr(err.message, "version 15 of ATTRIBUTES"));
    free(sheet);
}

static void streams_cut_anywhere_are_refused(void **state)
{
    (void)state;
    struct sheet *sheet = malloc(sizeof *sheet);
    assert_non_null(sheet);
    sheet_make(sheet, "TRIANGLES");
    struct gltf_meshopt from = {"", 0, 0, 0, 12, VERTICES, "ATTRIBUTES", "NONE"};
    for (size_t size = 1; size < sheet->vertex_bytes; size++) {
        /* Exactly as long: ASan looks. */
        uint8_t *copy = malloc(size), out[sizeof sheet->positions];
        struct meshopt_stream stream = {.bytes = copy, .size_bytes = size};
        struct error err = {0};
        assert_non_null(copy);
        memcpy(copy, sheet->bin, size);
        assert_false(meshopt_stream_init(&stream, &from, &err) &&
                     meshopt_stream_decode(&stream, out, &err));
        assert_int_equal(err.code, ERROR_INVALID_SCENE);
        free(copy);
    }
    free(sheet);
}

/* Encodes elements, and decodes them with the filter. */
static void through_filter(const char *filter, const void *encoded, int count, int stride,
                           void *out)
{
    uint8_t bytes[1024];
    struct gltf_meshopt from = {"", 0, 0, 0, stride, count, "ATTRIBUTES", filter};
    struct meshopt_stream stream = {.bytes = bytes};
    struct error err = {0};
    stream.size_bytes =
        meshopt_encodeVertexBuffer(bytes, sizeof bytes, encoded, (size_t)count, (size_t)stride);
    if (!meshopt_stream_init(&stream, &from, &err) || !meshopt_stream_decode(&stream, out, &err))
        fail_msg("%s", err.message);
}

static void filters_bring_back_directions_rotations_and_floats(void **state)
{
    (void)state;
    enum { COUNT = 5 };
    float directions[COUNT][4], floats[COUNT][3], decoded_floats[COUNT][3];
    int8_t octahedral[COUNT][4], normals[COUNT][4];
    int16_t quaternions[COUNT][4], rotations[COUNT][4];
    uint32_t exponential[COUNT][3];
    for (int i = 0; i < COUNT; i++) {
        float a = (float)i, d[4] = {cosf(a) * 0.6f, sinf(a) * 0.6f, 0.8f, 0};
        memcpy(directions[i], d, sizeof d);
        for (int k = 0; k < 3; k++)
            floats[i][k] = d[k] * 1000;
    }
    meshopt_encodeFilterOct(octahedral, COUNT, 4, 8, &directions[0][0]);
    meshopt_encodeFilterQuat(quaternions, COUNT, 8, 16, &directions[0][0]);
    meshopt_encodeFilterExp(exponential, COUNT, 12, 20, &floats[0][0]
#if MESHOPTIMIZER_VERSION >= 190
                            ,
                            meshopt_EncodeExpSeparate
#endif
    );
    through_filter("OCTAHEDRAL", octahedral, COUNT, 4, normals);
    through_filter("QUATERNION", quaternions, COUNT, 8, rotations);
    through_filter("EXPONENTIAL", exponential, COUNT, 12, decoded_floats);
    for (int i = 0; i < COUNT; i++)
        for (int k = 0; k < 3; k++) {
            assert_true(fabsf((float)normals[i][k] / 127 - directions[i][k]) < 0.02f);
            assert_true(fabsf((float)rotations[i][k] / 32767 - directions[i][k]) < 1e-3f);
            assert_true(fabsf(decoded_floats[i][k] - floats[i][k]) < 0.01f);
        }
}

static void decoded_bytes_count_against_the_limit(void **state)
{
    (void)state;
    struct sheet *sheet = malloc(sizeof *sheet);
    assert_non_null(sheet);
    sheet_make(sheet, "TRIANGLES");
    struct error err = {0};
    size_t size, stream = sheet->vertex_bytes;
    char json[1024];
    snprintf(json, sizeof json,
             "{'asset':{'version':'2.0'},'buffers':[{'byteLength':%zu}],'bufferViews':[{'buffer':0,"
             "'byteLength':1728,'extensions':{'EXT_meshopt_compression':{'buffer':0,"
             "'byteLength':%zu,'byteStride':12,'count':144,'mode':'ATTRIBUTES'}}}],'accessors':["
             "{'bufferView':0,'componentType':5126,'count':144,'type':'VEC3'}],"
             "'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}],'nodes':[{'mesh':0}]}",
             sheet->bin_bytes, stream);
    void *blob, *glb = glb_make(json, sheet->bin, sheet->bin_bytes, &size);
    struct scene_file file = {"", glb, size};
    assert_false(scene_import(
        &(struct scene_import_desc){.files = &file, .file_count = 1, .max_blob_bytes = 1700}, &blob,
        &size, &err));
    assert_int_equal(err.code, ERROR_TOO_LARGE);
    assert_non_null(strstr(err.message, "buffer view 0"));
    free(glb);
    free(sheet);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_mode_brings_back_what_was_encoded),
        cmocka_unit_test(streams_that_lie_are_refused_by_their_view),
        cmocka_unit_test(a_version_to_come_is_unsupported),
        cmocka_unit_test(streams_cut_anywhere_are_refused),
        cmocka_unit_test(filters_bring_back_directions_rotations_and_floats),
        cmocka_unit_test(decoded_bytes_count_against_the_limit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
