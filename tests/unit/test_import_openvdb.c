/* SPDX-License-Identifier: MIT */
/* OpenVDB files as glTF, on files that the library itself wrote (tests/support/vdb_files): values,
 * boxes and transforms, what is left out, and what is refused in which words. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "renderer/import/converter.h"
#include "tests/support/import_support.h"

enum { GLB_JSON_AT = 20, GLB_LENGTH_AT = 12, CHUNK_HEADER_BYTES = 8 };

static char folder[] = "/tmp/vitrail-vdb-XXXXXX";

struct converted {
    struct conversion conversion;
    json_t *json;
    const float *values;
    void *file;
};

static void *read_vdb(const char *name, size_t *size_bytes)
{
    char path[200];
    struct error err = {0};
    snprintf(path, sizeof path, "%s/%s.vdb", folder, name);
    void *bytes = file_read(path, size_bytes, &err);
    if (!bytes)
        fail_msg("%s", err.message);
    return bytes;
}

static bool convert_bytes(struct conversion *conversion, const void *bytes, size_t size_bytes,
                          double unit_m, char up, const char *scene, struct error *err)
{
    const struct scene_file file = {"smoke.vdb", bytes, size_bytes};
    return conversion_init(conversion,
                           &(struct scene_import_desc){.files = &file,
                                                       .file_count = 1,
                                                       .format = SCENE_FORMAT_OPENVDB,
                                                       .unit_m = unit_m,
                                                       .up = up,
                                                       .scene = scene},
                           err);
}

static struct converted make_scene(const char *name, double unit_m, char up, const char *scene)
{
    struct converted out = {0};
    struct error err = {0};
    size_t size_bytes;
    uint32_t json_bytes;
    out.file = read_vdb(name, &size_bytes);
    if (!convert_bytes(&out.conversion, out.file, size_bytes, unit_m, up, scene, &err))
        fail_msg("%s: %s", name, err.message);
    const char *glb = out.conversion.files[0].bytes;
    memcpy(&json_bytes, glb + GLB_LENGTH_AT, sizeof json_bytes);
    out.json = json_loadb(glb + GLB_JSON_AT, json_bytes, 0, NULL);
    assert_non_null(out.json);
    out.values = (const float *)(glb + GLB_JSON_AT + json_bytes + CHUNK_HEADER_BYTES);
    return out;
}

static struct converted make(const char *name, double unit_m, char up)
{
    return make_scene(name, unit_m, up, NULL);
}

static void finish(struct converted *out)
{
    json_decref(out->json);
    conversion_finish(&out->conversion);
    free(out->file);
}

static json_t *grid_of(const struct converted *out)
{
    json_t *extension =
        json_object_get(json_object_get(out->json, "extensions"), "VITRAIL_density_grids");
    json_t *grids = json_object_get(extension, "grids");
    assert_int_equal(json_array_size(grids), 1);
    return json_array_get(grids, 0);
}

static void expect_numbers(json_t *array, const double *wanted, size_t count)
{
    assert_int_equal(json_array_size(array), count);
    for (size_t i = 0; i < count; i++)
        if (!(fabs(json_number_value(json_array_get(array, i)) - wanted[i]) <= 1e-12))
            fail_msg("number %zu is %g, not %g", i, json_number_value(json_array_get(array, i)),
                     wanted[i]);
}

static void expect_box(const struct converted *out, const double min[3], const double max[3])
{
    expect_numbers(json_object_get(grid_of(out), "min"), min, 3);
    expect_numbers(json_object_get(grid_of(out), "max"), max, 3);
}

/* Voxels [-3, -1, 2] to [8, 5, 5]: those of the block and a border of zeros. */
static void expect_block(const struct converted *out)
{
    static const double size[3] = {12, 7, 4};
    expect_numbers(json_object_get(grid_of(out), "size"), size, 3);
    for (int z = 2, at = 0; z <= 5; z++)
        for (int y = -1; y <= 5; y++)
            for (int x = -3; x <= 8; x++, at++) {
                bool is_active = x >= -2 && x <= 7 && y >= 0 && y <= 4 && z >= 3 && z <= 4;
                double wanted = is_active ? (1 + x + 2 * y + 4 * z) / 64.0 : 0;
                if ((double)out->values[at] != wanted)
                    fail_msg("(%d, %d, %d) is %g, not %g", x, y, z, (double)out->values[at],
                             wanted);
            }
}

static void each_kind_of_number_and_compression_gives_the_same_values(void **state)
{
    (void)state;
    static const char *const names[] = {"block", "double", "half", "plain", "blosc"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        struct converted out = make(names[i], 1, 'y');
        expect_block(&out);
        expect_box(&out, (double[]){-3.5, -1.5, 1.5}, (double[]){8.5, 5.5, 5.5});
        assert_string_equal(json_string_value(json_object_get(grid_of(&out), "name")), "density");
        assert_string_equal(out.conversion.output.warnings, "");
        assert_null(
            json_object_get(json_array_get(json_object_get(out.json, "nodes"), 0), "matrix"));
        finish(&out);
    }
}

static void a_tile_fills_its_voxels(void **state)
{
    (void)state;
    struct converted out = make("tile", 1, 'y');
    expect_numbers(json_object_get(grid_of(&out), "size"), (double[]){10, 10, 10}, 3);
    expect_box(&out, (double[]){6.5, 14.5, 22.5}, (double[]){16.5, 24.5, 32.5});
    for (int at = 0; at < 1000; at++) {
        int x = at % 10, y = at / 10 % 10, z = at / 100;
        bool is_inside = x % 9 && y % 9 && z % 9;
        assert_true((double)out.values[at] == (is_inside ? 0.25 : 0));
    }
    finish(&out);
}

static void a_voxel_at_the_end_of_all_indices_is_read(void **state)
{
    (void)state;
    struct converted out = make("edge", 1, 'y');
    expect_numbers(json_object_get(grid_of(&out), "size"), (double[]){3, 3, 3}, 3);
    for (int at = 0; at < 27; at++)
        assert_true((double)out.values[at] == (at == 13 ? 1 : 0));
    finish(&out);
}

static void a_transform_becomes_the_box_or_the_matrix_of_the_node(void **state)
{
    (void)state;
    struct converted out = make("scaled", 1, 'y');
    expect_block(&out);
    expect_box(&out, (double[]){8.25, 19.625, 33}, (double[]){14.25, 21.375, 41});
    finish(&out);
    out = make("turned", 1, 'y');
    expect_block(&out);
    expect_box(&out, (double[]){-3.5, -1.5, 1.5}, (double[]){8.5, 5.5, 5.5});
    json_t *node = json_array_get(json_object_get(out.json, "nodes"), 0);
    expect_numbers(json_object_get(node, "matrix"),
                   (double[]){0, 0.5, 0, 0, -0.5, 0, 0, 0, 0, 0, 0.5, 0, 1, 2, 3, 1}, 16);
    finish(&out);
}

static void unit_and_axis_are_a_node_above_and_keep_the_optical_depth(void **state)
{
    (void)state;
    struct converted out = make("block", 0.01, 'z');
    json_t *nodes = json_object_get(out.json, "nodes");
    assert_int_equal(json_array_size(nodes), 2);
    expect_numbers(json_object_get(json_array_get(nodes, 1), "matrix"),
                   (double[]){0.01, 0, 0, 0, 0, 0, -0.01, 0, 0, 0.01, 0, 0, 0, 0, 0, 1}, 16);
    assert_true(fabs(json_number_value(json_object_get(grid_of(&out), "density")) - 100) < 1e-9);
    assert_true(out.conversion.output.origin.unit_by == SCENE_WORD_REQUEST);
    finish(&out);
    out = make("block", 0, 0);
    assert_non_null(strstr(out.conversion.output.warnings, "metres are assumed (?unit=)"));
    assert_true(out.conversion.output.origin.up == 'y');
    finish(&out);
}

static void one_density_is_read_and_the_others_are_named(void **state)
{
    (void)state;
    struct converted out = make("several", 1, 'y');
    expect_block(&out);
    assert_string_equal(out.conversion.output.warnings,
                        "grid 'velocity' is left out: it is of type vec3s, not a scalar density\n"
                        "grid 'surface' is left out: it is a level set, not a density\n"
                        "grid 'count' is left out: it is of type int32, not a scalar density\n"
                        "grid 'flame' is left out: one is read, and ?scene=flame reads it\n");
    finish(&out);
    out = make("fire", 1, 'y');
    assert_string_equal(json_string_value(json_object_get(grid_of(&out), "name")), "flame");
    finish(&out);
    out = make("everywhere", 1, 'y');
    assert_non_null(strstr(out.conversion.output.warnings,
                           "the density 0.5 wherever nothing is active: taken as 0"));
    finish(&out);
}

/* Which of the scenes has a node; each is called as its grid. */
static void expect_scenes(const struct converted *out, const char *const names[2], int shown)
{
    json_t *scenes = json_object_get(out->json, "scenes");
    assert_int_equal(json_array_size(scenes), 2);
    assert_int_equal(json_integer_value(json_object_get(out->json, "scene")), shown);
    for (size_t i = 0; i < 2; i++) {
        json_t *scene = json_array_get(scenes, i);
        assert_string_equal(json_string_value(json_object_get(scene, "name")), names[i]);
        assert_int_equal(json_array_size(json_object_get(scene, "nodes")), (int)i == shown);
    }
    assert_string_equal(json_string_value(json_object_get(grid_of(out), "name")), names[shown]);
}

static void a_grid_is_chosen_by_its_name_or_place(void **state)
{
    (void)state;
    static const char *const names[2] = {"flame", "density"};
    static const struct {
        const char *scene;
        int shown;
    } cases[] = {{NULL, 1},  {"flame", 0}, {"density", 1}, {"#0", 0},     {"#1", 1},
                 {"#00", 0}, {"#2", 1},    {"#0x0", 1},    {"surface", 1}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct converted out = make_scene("several", 1, 'y', cases[i].scene);
        expect_scenes(&out, names, cases[i].shown); /* the importer refuses what no grid is called
                                                     */
        assert_non_null(strstr(out.conversion.output.warnings,
                               cases[i].shown ? "?scene=flame" : "?scene=density"));
        finish(&out);
    }
}

static void refused(const void *bytes, size_t size_bytes, const char *words)
{
    struct conversion conversion;
    struct error err = {0};
    if (convert_bytes(&conversion, bytes, size_bytes, 1, 'y', NULL, &err))
        fail_msg("taken, not refused: %s", words);
    conversion_finish(&conversion);
    if (err.code != ERROR_INVALID_SCENE || !strstr(err.message, words))
        fail_msg("%s, not %s", err.message, words);
}

static void bad_grids_are_refused_by_name(void **state)
{
    (void)state;
    static const struct {
        const char *name, *words;
    } cases[] = {
        {"none", "it holds no grid"},
        {"surfaces", "no grid of densities: grid 'surface' is left out: it is a level set"},
        {"empty", "grid 'density' has no active voxel"},
        {"frustum", "grid 'density' has a frustum for its transform"},
        {"far", "grid 'density' is 9005 x 7 x 7 voxels, the limits are 8192 along an axis and"},
        {"large", "grid 'density' is 1505 x 1503 x 1500 voxels"},
        {"limits", "grid 'density' is 2147483652 x 2147483654 x 7 voxels"},
        {"nan", "voxel (1, 2, 3) of grid 'density' is not finite"},
        {"wide", "voxel (0, 1, 4) of grid 'density' is not finite"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        size_t size_bytes;
        void *bytes = read_vdb(cases[i].name, &size_bytes);
        refused(bytes, size_bytes, cases[i].words);
        free(bytes);
    }
    refused("solid", 5, "it does not begin as an OpenVDB file does");
    refused("", 0, "it does not begin as an OpenVDB file does");
}

static void a_file_that_is_cut_anywhere_is_refused(void **state)
{
    (void)state;
    size_t size_bytes;
    char *bytes = read_vdb("half", &size_bytes);
    for (size_t at = 4; at < size_bytes; at += at < 1000 ? 7 : 97) {
        void *cut = malloc(at); /* so that a read behind its end is seen */
        assert_non_null(cut);
        memcpy(cut, bytes, at);
        refused(cut, at, "");
        free(cut);
    }
    free(bytes);
}

static int write_files(void **state)
{
    (void)state;
    char command[400];
    if (!mkdtemp(folder))
        return -1;
    snprintf(command, sizeof command, "%s/bin/vdb_files %s", VITRAIL_BINARY_DIR, folder);
    int status = system(command); /* NOLINT(cert-env33-c) */
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static int remove_files(void **state)
{
    (void)state;
    char command[400];
    snprintf(command, sizeof command, "rm -r %s", folder);
    return system(command); /* NOLINT(cert-env33-c) */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_kind_of_number_and_compression_gives_the_same_values),
        cmocka_unit_test(a_tile_fills_its_voxels),
        cmocka_unit_test(a_voxel_at_the_end_of_all_indices_is_read),
        cmocka_unit_test(a_transform_becomes_the_box_or_the_matrix_of_the_node),
        cmocka_unit_test(unit_and_axis_are_a_node_above_and_keep_the_optical_depth),
        cmocka_unit_test(one_density_is_read_and_the_others_are_named),
        cmocka_unit_test(a_grid_is_chosen_by_its_name_or_place),
        cmocka_unit_test(bad_grids_are_refused_by_name),
        cmocka_unit_test(a_file_that_is_cut_anywhere_is_refused),
    };
    if (!scene_format_describe(SCENE_FORMAT_OPENVDB)->is_built) {
        fputs("this build has no OpenVDB\n", stderr);
        return 77;
    }
    return cmocka_run_group_tests(tests, write_files, remove_files);
}
