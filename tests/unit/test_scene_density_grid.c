/* SPDX-License-Identifier: MIT */
/* Density grids: what an import keeps of them, their values between voxels, and integrals along
 * lines against fine sums and closed forms. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/glb_builder.h"
#include "renderer/import/procedural_grid.h"
#include "renderer/scene/scene_state.h"
#include "tests/support/import_support.h"

static double random_next(uint64_t *state)
{
    *state = *state * 6364136223846793005ull + 1442695040888963407ull;
    return (double)(*state >> 33) / 2147483648.0;
}

static struct imported_scene make(const struct glb_grid_desc *desc, const double matrix[16])
{
    struct imported_scene imported;
    struct error err = {0};
    struct scene_file file = {.name = ""};
    void *glb;
    struct glb_builder *builder = glb_builder_create("Smoke", &err);
    struct glb_node_desc node = {.name = "Node", .grid = glb_builder_add_grid(builder, desc)};
    if (matrix) {
        node.has_matrix = true;
        memcpy(node.matrix, matrix, sizeof node.matrix);
    }
    glb_builder_add_node(builder, &node);
    if (!glb_builder_finish(builder, &glb, &file.size_bytes, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    file.bytes = glb;
    if (!imported_scene_init(&imported, &file, 1, &err))
        fail_msg("%s", err.message);
    free(glb);
    return imported;
}

/* Random values, with whole empty stretches. */
static float *make_values(const uint32_t size[3], uint64_t seed)
{
    size_t count = (size_t)size[0] * size[1] * size[2];
    float *values = calloc(count, sizeof *values);
    assert_non_null(values);
    for (size_t i = 0; i < count; i++) {
        size_t x = i % size[0], z = i / size[0] / size[1];
        double value = random_next(&seed);
        values[i] = (x / 11 + z / 13) % 2 ? 0 : (float)value;
    }
    return values;
}

/* Straight from the definition. */
static double value_of(const float *values, const uint32_t size[3], const double p[3])
{
    double sum = 0, low[3], share[3];
    for (int k = 0; k < 3; k++) {
        if (p[k] < 0 || p[k] > size[k])
            return 0;
        low[k] = floor(p[k] - 0.5);
        share[k] = p[k] - 0.5 - low[k];
    }
    for (int corner = 0; corner < 8; corner++) {
        double weight = 1;
        size_t at[3];
        for (int k = 0; k < 3; k++) {
            int up = corner >> k & 1;
            weight *= up ? share[k] : 1 - share[k];
            at[k] = (size_t)fmin(fmax(low[k] + up, 0), size[k] - 1);
        }
        sum += weight * (double)values[at[0] + size[0] * (at[1] + (size_t)size[1] * at[2])];
    }
    return sum;
}

static double integrate(const struct density_grid *grid, const double from[3], const double to[3],
                        size_t *pieces)
{
    const double step[3] = {to[0] - from[0], to[1] - from[1], to[2] - from[2]};
    struct density_walk walk;
    struct density_piece piece;
    double sum = 0, last = 0;
    *pieces = 0;
    if (!density_walk_begin(&walk, grid, from, step, 0, 1))
        return 0;
    last = walk.t;
    while (density_walk_next(&walk, &piece)) {
        assert_true(piece.from == last && piece.to > piece.from);
        last = piece.to;
        ++*pieces;
        if (piece.bound > 0)
            sum += density_walk_integrate(&walk, piece.from, piece.to);
    }
    assert_true(last == walk.end);
    return sum;
}

static void values_are_those_of_the_definition(void **state)
{
    (void)state;
    const uint32_t size[3] = {27, 9, 40};
    float *values = make_values(size, 7);
    struct imported_scene s = make(
        &(struct glb_grid_desc){
            .name = "Smoke", .size = {27, 9, 40}, .values = values, .high = {1, 1, 1}},
        NULL);
    struct density_grid grid = density_grid_of(&s.scene, &s.scene.grids[0]);
    uint64_t seed = 3;
    assert_int_equal(s.scene.grid_count, 1);
    assert_int_equal(s.scene.grid_brick_count, 4 * 2 * 5);
    assert_in_range(s.scene.grid_value_count, 1, 4 * 2 * 5 - 1); /* empty ones are not kept */
    for (int i = 0; i < 20000; i++) {
        double p[3];
        for (int k = 0; k < 3; k++)
            p[k] = (1.2 * random_next(&seed) - 0.1) * size[k];
        assert_true(fabs(density_grid_at(&grid, p) - value_of(values, size, p)) < 1e-12);
    }
    imported_scene_finish(&s);
    free(values);
}

static void integrals_are_those_of_fine_sums(void **state)
{
    (void)state;
    enum { STEPS = 200000, LINES = 60 };
    const uint32_t size[3] = {27, 9, 40};
    float *values = make_values(size, 11);
    struct imported_scene s = make(
        &(struct glb_grid_desc){.size = {27, 9, 40}, .values = values, .high = {1, 1, 1}}, NULL);
    struct density_grid grid = density_grid_of(&s.scene, &s.scene.grids[0]);
    uint64_t seed = 5;
    for (int i = 0; i < LINES; i++) {
        double from[3], to[3], p[3], sum = 0;
        size_t pieces;
        for (int k = 0; k < 3; k++) {
            from[k] = (2 * random_next(&seed) - 0.5) * size[k];
            to[k] = (2 * random_next(&seed) - 0.5) * size[k];
            if (i % 4 == k) /* along planes, also those through centres */
                from[k] = to[k] = floor(2 * random_next(&seed) * 4) * 0.5 + 0.5;
        }
        for (int n = 0; n < STEPS; n++) {
            for (int k = 0; k < 3; k++)
                p[k] = from[k] + (n + 0.5) / STEPS * (to[k] - from[k]);
            sum += value_of(values, size, p) / STEPS;
        }
        double found = integrate(&grid, from, to, &pieces);
        if (fabs(found - sum) > 2e-5 + 1e-5 * sum)
            fail_msg("line %d: %.9g, fine sum %.9g", i, found, sum);
        assert_in_range(pieces, 0, size[0] + size[1] + size[2] + 8);
    }
    imported_scene_finish(&s);
    free(values);
}

/* From far away and along an edge of voxels nothing is lost or counted twice, and an empty stretch
 * is crossed in few pieces. */
static void far_and_empty_ways_are_exact(void **state)
{
    (void)state;
    float values[64] = {0};
    size_t pieces;
    for (int i = 60; i < 64; i++)
        values[i] = (float)(i - 59);
    struct imported_scene s = make(
        &(struct glb_grid_desc){.size = {64, 1, 1}, .values = values, .high = {1, 1, 1}}, NULL);
    struct density_grid grid = density_grid_of(&s.scene, &s.scene.grids[0]);
    /* trapezoids from 59.5 on: 0 1 2 3 4, and half a voxel of 4 */
    const double expected = 0.5 + 1.5 + 2.5 + 3.5 + 2;
    for (int i = 0; i <= 12; i++) {
        double away = pow(10, i), found;
        found =
            integrate(&grid, (double[]){-away, 0.5, 0.5}, (double[]){64 + away, 0.5, 0.5}, &pieces);
        assert_true(fabs(found * (64 + 2 * away) - expected) <
                    1e-15 * (64 + 2 * away) * 40 + 1e-12);
        found = integrate(&grid, (double[]){64 + away, 0, 1}, (double[]){-away, 0, 1}, &pieces);
        assert_true(fabs(found * (64 + 2 * away) - expected) <
                    1e-15 * (64 + 2 * away) * 40 + 1e-12);
    }
    integrate(&grid, (double[]){-1, 0.5, 0.5}, (double[]){65, 0.5, 0.5}, &pieces);
    assert_in_range(pieces, 1, 8 + 9 + 8);
    assert_true(integrate(&grid, (double[]){-1, 1.01, 0.5}, (double[]){65, 1.01, 0.5}, &pieces) ==
                0);
    imported_scene_finish(&s);
}

static void a_state_places_grids(void **state)
{
    (void)state;
    const float values[2] = {1, 3};
    const struct glb_grid_desc desc = {.name = "Smoke",
                                       .size = {2, 1, 1},
                                       .values = values,
                                       .low = {-1, 0, 2},
                                       .high = {1, 1, 3},
                                       .density = 0.5,
                                       .color = {0.2, 0.4, 1},
                                       .extinction = {1, 2, 0},
                                       .anisotropy = -0.25};
    /* x to y, y to -x, z three times as long; moved */
    const double matrix[16] = {0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 3, 0, 10, 20, 30, 1};
    const double flat[16] = {1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    struct imported_scene s = make(&desc, matrix), collapsed = make(&desc, flat);
    struct view view = {.width_px = 1, .height_px = 1, .camera = {.node = "none"}};
    struct scene_state scene_state;
    struct error err = {0};
    assert_true(scene_state_init(&scene_state, &s.scene, &view, &err));
    assert_int_equal(scene_state.grid_count, 1);
    const struct state_grid *grid = &scene_state.grids[0];
    const double expected[] = {9, 19, 36, 10, 21, 39};
    for (int k = 0; k < 3; k++) {
        assert_true(fabs(grid->bounds_min[k] - expected[k]) < 1e-12);
        assert_true(fabs(grid->bounds_max[k] - expected[3 + k]) < 1e-12);
        assert_true(fabs(scene_state.bounds_min[k] - expected[k]) < 1e-12);
        assert_true(fabs(s.scene.header->bounds_max[k] - expected[3 + k]) < 1e-12);
        assert_true(grid->sigma[k] == 0.5 * desc.extinction[k]);
        assert_true(grid->color[k] == (float)desc.color[k]);
    }
    double voxel[3] = {1.5, 0.25, 0.75}, world[3], back[3];
    for (int row = 0; row < 3; row++) {
        world[row] = grid->world_from_voxel[12 + row];
        for (int k = 0; k < 3; k++)
            world[row] += grid->world_from_voxel[4 * k + row] * voxel[k];
    }
    for (int row = 0; row < 3; row++) {
        back[row] = grid->voxel_from_world[12 + row];
        for (int k = 0; k < 3; k++)
            back[row] += grid->voxel_from_world[4 * k + row] * world[k];
        assert_true(fabs(back[row] - voxel[row]) < 1e-12);
    }
    assert_true(grid->largest == 3);
    scene_state_finish(&scene_state);
    assert_true(scene_state_init(&scene_state, &collapsed.scene, &view, &err));
    assert_int_equal(scene_state.grid_count, 0); /* there is no volume for it to be in */
    scene_state_finish(&scene_state);
    imported_scene_finish(&s);
    imported_scene_finish(&collapsed);
}

static void a_view_overrides_the_factors_of_grids(void **state)
{
    (void)state;
    const float values[1] = {2};
    const struct glb_grid_desc desc = {.name = "Smoke",
                                       .size = {1, 1, 1},
                                       .values = values,
                                       .high = {1, 1, 1},
                                       .density = 0.5,
                                       .color = {0.2, 0.4, 1},
                                       .extinction = {1, 2, 0}};
    struct imported_scene s = make(&desc, NULL);
    struct view_grid_override override = {.grid = "Smoke", .has_density = true, .density = 4};
    struct view view = {
        .width_px = 1, .height_px = 1, .grids = &override, .grid_override_count = 1};
    struct scene_state scene_state;
    struct error err = {0};
    assert_true(scene_state_init(&scene_state, &s.scene, &view, &err));
    assert_true(scene_state.grids[0].sigma[1] == 8 && scene_state.grids[0].sigma[2] == 0);
    assert_true(scene_state.grids[0].color[0] == 0.2f); /* the others are the file's */
    uint64_t shadow = scene_state.grids[0].shadow_hash;
    scene_state_finish(&scene_state);
    override = (struct view_grid_override){.grid = "#0",
                                           .has_extinction = true,
                                           .extinction = {0, 0, 3},
                                           .has_color = true,
                                           .color = {1, 0, 0.5f},
                                           .has_anisotropy = true,
                                           .anisotropy = -0.5f};
    assert_true(scene_state_init(&scene_state, &s.scene, &view, &err));
    assert_true(scene_state.grids[0].sigma[0] == 0 && scene_state.grids[0].sigma[2] == 1.5);
    assert_true(scene_state.grids[0].color[2] == 0.5f && scene_state.grids[0].anisotropy == -0.5f);
    assert_true(scene_state.grids[0].shadow_hash != shadow);
    scene_state_finish(&scene_state);
    override = (struct view_grid_override){.grid = "Smoke", .has_density = true, .density = 0};
    assert_true(scene_state_init(&scene_state, &s.scene, &view, &err));
    assert_int_equal(scene_state.grid_count, 0);
    scene_state_finish(&scene_state);
    override.grid = "Fog";
    assert_false(scene_state_init(&scene_state, &s.scene, &view, &err));
    assert_int_equal(err.code, ERROR_NOT_FOUND);
    assert_string_equal(err.pointer, "/overrides/grids");
    assert_non_null(strstr(err.message, "'Fog'"));
    scene_state_finish(&scene_state);
    imported_scene_finish(&s);
}

/* ---- refusals ---- */

static const char document[] =
    "{'asset':{'version':'2.0'},'scene':0,'scenes':[{'nodes':[0]}],"
    "'extensionsUsed':['VITRAIL_density_grids'],"
    "'nodes':[{'extensions':{'VITRAIL_density_grids':{'grid':%d}}}],"
    "'buffers':[{'byteLength':32}],'bufferViews':[{'buffer':0,'byteLength':32}],"
    "'accessors':[{'bufferView':0,'componentType':5126,'count':%d,'type':'SCALAR'}],"
    "'extensions':{'VITRAIL_density_grids':{'grids':[{'name':'Smoke',%s}]}}}";
static const char box[] = "'min':[0,0,0],'max':[1,1,1]";

static bool import(int grid, int count, const char *members, const float values[8],
                   struct imported_scene *imported, struct error *err)
{
    char json[2000];
    *err = (struct error){0};
    snprintf(json, sizeof json, document, grid, count, members);
    return imported_scene_make(imported, json, values, 8 * sizeof *values, err);
}

static void hostile_grids_are_refused_by_name(void **state)
{
    (void)state;
    static const float good[8] = {0, 1, 2, 3, 4, 5, 6, 7}, not_a_number[8] = {0, NAN},
                       endless[8] = {INFINITY}, large[8] = {0, 2e12f};
    static const struct {
        const char *members, *what;
        const float *values;
        int grid, count;
    } cases[] = {
        {"'size':[2,2,2],'values':0,'min':[0,0,0],'max':[1,1,1]", "no density grid 1", good, 1, 8},
        {"'size':[2,2,2],'values':0,'min':[0,0,0],'max':[1,0,1]", "not above min", good, 0, 8},
        {"'size':[2,2,2],'values':0,'min':[0,0,0]", "max", good, 0, 8},
        {"'size':[2,2,0],'values':0,'min':[0,0,0],'max':[1,1,1]", "0 voxels", good, 0, 8},
        {"'size':[2,2],'values':0,'min':[0,0,0],'max':[1,1,1]", "3 numbers", good, 0, 8},
        {"'size':[8192,8192,8192],'values':0,'min':[0,0,0],'max':[1,1,1]", "the limit is", good, 0,
         8},
        {"'size':[1290,1290,1290],'values':0,'min':[0,0,0],'max':[1,1,1]", "the limit is", good, 0,
         8},
        {"'size':[9000,1,1],'values':0,'min':[0,0,0],'max':[1,1,1]", "9000", good, 0, 8},
        {"'size':[2,2,2],'values':1,'min':[0,0,0],'max':[1,1,1]", "accessor", good, 0, 8},
        {"'size':[2,2,2],'min':[0,0,0],'max':[1,1,1]", "either values or", good, 0, 8},
        {"'size':[2,2,2],'values':0,'procedure':{'type':'fog'},'min':[0,0,0],'max':[1,1,1]",
         "either values or", good, 0, 8},
        {"'size':[2,2,2],'procedure':{'type':'mist'},'min':[0,0,0],'max':[1,1,1]", "'mist'", good,
         0, 8},
        {"'size':[2,2,2],'procedure':{'seed':1},'min':[0,0,0],'max':[1,1,1]", "type", good, 0, 8},
        {"'size':[2,2,2],'procedure':{'type':'fog','detail':9},'min':[0,0,0],'max':[1,1,1]",
         "detail", good, 0, 8},
        {"'size':[512,512,512],'procedure':{'type':'fog'},'min':[0,0,0],'max':[1,1,1]", "the limit",
         good, 0, 8},
        {"'size':[2,2,1],'values':0,'min':[0,0,0],'max':[1,1,1]", "8 elements", good, 0, 8},
        {"'size':[2,2,2],'values':0,'min':[0,0,0],'max':[1,1,1]", "element 1", not_a_number, 0, 8},
        {"'size':[2,2,2],'values':0,'min':[0,0,0],'max':[1,1,1]", "element 0", endless, 0, 8},
        {"'size':[2,2,2],'values':0,'min':[0,0,0],'max':[1,1,1]", "the limit is", large, 0, 8},
        {"'size':[2,2,2],'values':0,'min':[0,0,0],'max':[1,1,1],'density':-1", "density", good, 0,
         8},
        {"'size':[2,2,2],'values':0,'min':[0,0,0],'max':[1,1,1],'color':[0,2,0]", "color", good, 0,
         8},
        {"'size':[2,2,2],'values':0,'min':[0,0,0],'max':[1,1,1],'anisotropy':1", "anisotropy", good,
         0, 8},
        {"'size':[2,2,2],'values':0,'min':[0,0,0],'max':[1,1,1],'extinction':[1,1]", "extinction",
         good, 0, 8},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct imported_scene imported;
        struct error err;
        if (import(cases[i].grid, cases[i].count, cases[i].members, cases[i].values, &imported,
                   &err))
            fail_msg("%s was taken", cases[i].members);
        if (!strstr(err.message, cases[i].what))
            fail_msg("%s: '%s' does not say '%s'", cases[i].members, err.message, cases[i].what);
    }
}

static void negative_values_are_taken_as_nothing(void **state)
{
    (void)state;
    static const float values[8] = {-1, 2, -0.5f};
    struct imported_scene imported;
    struct error err;
    char members[200];
    snprintf(members, sizeof members, "'size':[2,2,2],'values':0,%s", box);
    if (!import(0, 8, members, values, &imported, &err))
        fail_msg("%s", err.message);
    assert_true(scene_has_warning(&imported.scene, "2 values of density grids below 0"));
    struct density_grid grid = density_grid_of(&imported.scene, &imported.scene.grids[0]);
    assert_true(density_grid_at(&grid, (double[]){0, 0, 0}) == 0);
    assert_true(density_grid_at(&grid, (double[]){2, 0, 0}) == 2);
    imported_scene_finish(&imported);
}

/* The same seed gives the same, another one something else, and no shape is cut off by its box but
 * where it stands on the floor. */
static void procedures_are_repeated_by_their_seeds(void **state)
{
    (void)state;
    const uint32_t size[3] = {24, 40, 24};
    static float first[24 * 40 * 24], again[24 * 40 * 24], other[24 * 40 * 24];
    for (int shape = 0; shape < PROCEDURAL_SHAPES; shape++) {
        struct procedural_grid grid = {
            .shape = (enum procedural_shape)shape, .seed = 7, .octaves = 4};
        procedural_grid_fill(&grid, size, first);
        procedural_grid_fill(&grid, size, again);
        grid.seed++;
        procedural_grid_fill(&grid, size, other);
        assert_memory_equal(first, again, sizeof first);
        assert_memory_not_equal(first, other, sizeof first);
        double sum = 0, largest = 0, top = 0;
        for (size_t i = 0; i < 24 * 40 * 24; i++) {
            assert_true(first[i] >= 0 && first[i] <= 1);
            sum += (double)first[i];
            largest = fmax(largest, (double)first[i]);
            top = i / 24 % 40 == 39 ? fmax(top, (double)first[i]) : top;
        }
        assert_true(sum / (24 * 40 * 24) > 0.01 && sum / (24 * 40 * 24) < 0.7);
        assert_true(largest > 0.3);
        assert_true(top < 0.12);
    }
}

/* The worker trusts no blob: each damaged record is named. */
static void damaged_blobs_are_refused(void **state)
{
    (void)state;
    const float values[8] = {1, 2, 3, 4, 5, 6, 7, 8};
    struct imported_scene s =
        make(&(struct glb_grid_desc){.size = {2, 2, 2}, .values = values, .high = {1, 1, 1}}, NULL);
    struct scene_header *header = s.blob;
    struct scene_grid *grid =
        (struct scene_grid *)((char *)s.blob + header->sections[SCENE_GRIDS].offset);
    struct scene_grid_brick *brick =
        (struct scene_grid_brick *)((char *)s.blob + header->sections[SCENE_GRID_BRICKS].offset);
    float *first = (float *)((char *)s.blob + header->sections[SCENE_GRID_VALUES].offset);
    const struct scene_grid good = *grid;
    const struct scene_grid_brick good_brick = *brick;
    struct scene scene;
    struct error err = {0};
    for (int i = 0; i < 8; i++) {
        *grid = good;
        *brick = good_brick;
        *first = 1;
        switch (i) {
        case 1:
            grid->size[0] = 0;
            break;
        case 2:
            grid->size[2] = 9;
            break;
        case 3:
            grid->first_brick = 1;
            break;
        case 4:
            grid->anisotropy = 1;
            break;
        case 5:
            brick->values = 2;
            break;
        case 6:
            *first = 9;
            break;
        case 7:
            *first = NAN;
            break;
        }
        if (scene_open(&scene, s.blob, s.blob_bytes, &err) != (i == 0))
            fail_msg("case %d", i);
    }
    imported_scene_finish(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_are_those_of_the_definition),
        cmocka_unit_test(integrals_are_those_of_fine_sums),
        cmocka_unit_test(far_and_empty_ways_are_exact),
        cmocka_unit_test(a_state_places_grids),
        cmocka_unit_test(a_view_overrides_the_factors_of_grids),
        cmocka_unit_test(hostile_grids_are_refused_by_name),
        cmocka_unit_test(negative_values_are_taken_as_nothing),
        cmocka_unit_test(procedures_are_repeated_by_their_seeds),
        cmocka_unit_test(damaged_blobs_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
