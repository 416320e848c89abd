/* SPDX-License-Identifier: MIT */
/* Skins and morph targets against their closed forms, and what is refused of them. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/scene/compose.h"
#include "renderer/scene/scene_state.h"
#include "tests/support/deformed_scene.h"
#include "tests/support/import_support.h"

enum { JSON_BYTES = 8192 };

static bool import_bar(struct imported_scene *s, const struct bar *bar, const char *rest,
                       struct error *err)
{
    char json[2 * JSON_BYTES];
    bar_write_head(json, JSON_BYTES);
    size_t length = strlen(json);
    int more = snprintf(json + length, sizeof json - length, "%s}", rest);
    assert_true(more > 0 && (size_t)more < sizeof json - length);
    return imported_scene_make(s, json, bar, sizeof *bar, err);
}

/* A scene evaluated at a time; below 0: at none. */
struct posed {
    struct imported_scene imported;
    struct scene_state state;
};

static void evaluate(struct posed *posed, double time_s)
{
    struct error err = {0};
    struct view view = {.width_px = 1, .height_px = 1};
    view.is_animated = time_s >= 0;
    view.animation_time_s = fmax(time_s, 0);
    if (!scene_state_init(&posed->state, &posed->imported.scene, &view, &err))
        fail_msg("%s", err.message);
}

static void pose(struct posed *posed, const struct bar *bar, const char *rest, double time_s)
{
    struct error err = {0};
    if (!import_bar(&posed->imported, bar, rest, &err))
        fail_msg("%s", err.message);
    evaluate(posed, time_s);
}

static void posed_finish(struct posed *posed)
{
    scene_state_finish(&posed->state);
    imported_scene_finish(&posed->imported);
}

static void assert_close(const double *found, const double *expected, double tolerance)
{
    for (int k = 0; k < 3; k++)
        if (!(fabs(found[k] - expected[k]) <= tolerance))
            fail_msg("(%.9g, %.9g, %.9g) is not (%.9g, %.9g, %.9g)", found[0], found[1], found[2],
                     expected[0], expected[1], expected[2]);
}

static bool is_same(const float a[3], const float b[3])
{
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/* The world position and normal of a vertex of an item; the bar's order of vertices is that of
 * their first use, which is not the file's: it is found by its place at rest. */
static void find_vertex(const struct posed *posed, size_t index, const float at_rest[3],
                        const float normal_at_rest[3], double position[3], double normal[3])
{
    const struct state_item *item = &posed->state.items[index];
    const struct scene *scene = &posed->imported.scene;
    const struct scene_primitive *p = &scene->primitives[item->primitive];
    const struct state_geometry geometry = state_geometry_of(&posed->state, item);
    assert_int_equal(geometry.primitive->vertex_count, p->vertex_count);
    memset(position, 0, 3 * sizeof *position);
    memset(normal, 0, 3 * sizeof *normal);
    for (uint32_t v = 0; v < p->vertex_count; v++) {
        const float *q = scene->positions + 3 * (size_t)(p->first_vertex + v);
        const float *n = scene->normals + 3 * (size_t)(p->first_vertex + v);
        const float *out = geometry.normals + 3 * (size_t)(geometry.primitive->first_vertex + v);
        if (!is_same(q, at_rest) || !is_same(n, normal_at_rest))
            continue;
        state_geometry_point(&geometry, v, position);
        for (int k = 0; k < 3; k++)
            normal[k] = (double)out[k];
        return;
    }
    fail_msg("there is no such vertex");
}

/* Where linear blending takes a vertex of the bar when joint 1 is turned about Z: by its cosine and
 * sine. */
static void bent(const float p[3], const float n[3], double c, double s, double position[3],
                 double normal[3])
{
    double w = 0.5 * (double)p[1], x = (double)p[0], y = (double)p[1] - 1;
    position[0] = (1 - w) * x + w * (c * x - s * y);
    position[1] = (1 - w) * (double)p[1] + w * (1 + s * x + c * y);
    position[2] = (double)p[2];
    /* the blended matrix is a rotation times a scale, about Z; along Z it does nothing */
    double cosine = 1 - w + w * c, sine = w * s, length = sqrt(cosine * cosine + sine * sine);
    normal[0] = (cosine * (double)n[0] - sine * (double)n[1]) / length;
    normal[1] = (sine * (double)n[0] + cosine * (double)n[1]) / length;
    normal[2] = (double)n[2];
    double size = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    for (int k = 0; k < 3; k++)
        normal[k] /= size;
}

static void assert_bent(const struct posed *posed, const struct bar *bar, double angle,
                        double tolerance)
{
    for (int v = 0; v < BAR_VERTICES; v++) {
        double position[3], normal[3], expected[3], turned[3];
        find_vertex(posed, 0, bar->positions[v], bar->normals[v], position, normal);
        bent(bar->positions[v], bar->normals[v], cos(angle), sin(angle), expected, turned);
        assert_close(position, expected, tolerance);
        assert_close(normal, turned, tolerance);
    }
}

static const char skinned[] = BAR_NODES "," BAR_MESH "," BAR_SKIN;

static void a_bar_is_bent_as_its_joints_stand_and_its_own_node_moves_nothing(void **state)
{
    (void)state;
    struct bar bar;
    struct posed posed;
    bar_fill(&bar);
    pose(&posed, &bar, skinned, -1);
    assert_int_equal(posed.state.item_count, 1);
    assert_int_equal(posed.state.items[0].deformed, 1);
    assert_false(posed.state.items[0].is_mirrored);
    assert_true(fabsf(posed.state.items[0].length_scale - 1) < 1e-6f);
    assert_bent(&posed, &bar, M_PI / 2, 1e-6);
    /* the upper ring is at x = -1, and goes from y = 0.75 to 1.25 */
    const double low[3] = {-1, 0, -0.25}, high[3] = {0.25, 1.25, 0.25};
    assert_close(posed.state.bounds_min, low, 1e-6);
    assert_close(posed.state.bounds_max, high, 1e-6);
    assert_close(posed.imported.scene.header->bounds_min, low, 1e-6);
    assert_close(posed.imported.scene.header->bounds_max, high, 1e-6);
    assert_int_equal(posed.imported.scene.warning_count, 0);
    posed_finish(&posed);
}

#define TURNING                                                                         \
    ",'animations':[{'channels':[{'sampler':0,'target':{'node':2,'path':'rotation'}}]," \
    "'samplers':[{'input':6,'output':7}]}]"

static void animated_joints_bend_the_bar(void **state)
{
    (void)state;
    struct bar bar;
    struct posed posed;
    char json[JSON_BYTES];
    snprintf(json, sizeof json, "%s%s", skinned, TURNING);
    bar_fill(&bar);
    for (int step = 0; step <= 4; step++) {
        pose(&posed, &bar, json, 0.25 * step);
        assert_false(posed.state.has_idle_animation);
        assert_bent(&posed, &bar, M_PI / 2 * 0.25 * step, 1e-6);
        posed_finish(&posed);
    }
}

static void times_give_the_same_bits_and_the_same_pose_the_same_key(void **state)
{
    (void)state;
    struct bar bar;
    struct posed first, other;
    char json[JSON_BYTES];
    snprintf(json, sizeof json, "%s%s", skinned, TURNING);
    bar_fill(&bar);
    pose(&first, &bar, json, 0.5);
    other = first;
    evaluate(&other, 1.5); /* the same pose on the way back */
    size_t bytes = first.state.deforms.vertex_count * sizeof(float[3]);
    assert_int_equal(first.state.items[0].shadow_hash, other.state.items[0].shadow_hash);
    assert_memory_equal(first.state.deforms.positions, other.state.deforms.positions, bytes);
    assert_true(first.state.deforms.serial != other.state.deforms.serial);
    scene_state_finish(&other.state);
    evaluate(&other, 0.75);
    assert_true(first.state.items[0].shadow_hash != other.state.items[0].shadow_hash);
    scene_state_finish(&other.state);
    posed_finish(&first);
}

/* Joint 1 is stretched along X by 2: a normal of (1, 1, 0) turns to (1, 2, 0), as the inverse
 * transpose says. */
static void normals_follow_the_inverse_transpose(void **state)
{
    (void)state;
    struct bar bar;
    struct posed posed;
    double position[3], normal[3];
    bar_fill(&bar);
    int v = 8 * BAR_RINGS + 4; /* of the upper end */
    const float slanted[3] = {0.70710678f, 0.70710678f, 0};
    memcpy(bar.normals[v], slanted, sizeof slanted);
    pose(&posed, &bar,
         "'scenes':[{'nodes':[0,1]}],'nodes':[{'mesh':0,'skin':0},{'children':[2]},{"
         "'translation':[0,1,0],'scale':[2,1,1]}]," BAR_MESH "," BAR_SKIN,
         -1);
    const float *stored = posed.imported.scene.normals; /* made a unit vector anew */
    for (uint32_t i = 0; i < posed.imported.scene.vertex_count; i++)
        if (fabsf(stored[3 * i] - stored[3 * i + 1]) < 1e-6f && stored[3 * i] > 0)
            memcpy(bar.normals[v], stored + 3 * i, sizeof slanted);
    find_vertex(&posed, 0, bar.positions[v], bar.normals[v], position, normal);
    assert_close(normal, (const double[]){1 / sqrt(5), 2 / sqrt(5), 0}, 1e-6);
    assert_close(position,
                 (const double[]){2 * (double)bar.positions[v][0], 2, (double)bar.positions[v][2]},
                 1e-6);
    posed_finish(&posed);
}

static void mirrored_joints_turn_the_winding(void **state)
{
    (void)state;
    struct bar bar;
    struct posed posed;
    bar_fill(&bar);
    pose(&posed, &bar,
         "'scenes':[{'nodes':[0,1]}],'nodes':[{'mesh':0,'skin':0,'scale':[-1,1,1]},{'children':[2],"
         "'scale':[-2,2,2]},{'translation':[0,1,0]}]," BAR_MESH "," BAR_SKIN,
         -1);
    assert_true(posed.state.items[0].is_mirrored);
    assert_true(fabsf(posed.state.items[0].length_scale - 2) < 1e-6f);
    posed_finish(&posed);
}

static void weights_are_made_to_add_up_to_one(void **state)
{
    (void)state;
    struct bar bar;
    struct posed posed;
    bar_fill(&bar);
    pose(&posed, &bar,
         BAR_NODES "," BAR_SKIN ",'meshes':[{'primitives':[{'attributes':{'POSITION':0,'NORMAL':1,"
                   "'JOINTS_0':2,'WEIGHTS_0':11},'indices':4}]}]",
         -1);
    assert_bent(&posed, &bar, M_PI / 2, 1e-6); /* bytes whose sums are 200 and 50 of 255 */
    posed_finish(&posed);
}

static void a_vertex_without_weights_follows_the_first_joint(void **state)
{
    (void)state;
    struct bar bar;
    struct posed posed;
    double position[3], normal[3];
    bar_fill(&bar);
    int v = 8 * BAR_RINGS + 4;
    memset(bar.weights[v], 0, sizeof bar.weights[v]);
    bar.joints[v][0] = 99; /* means nothing without a weight */
    pose(&posed, &bar, skinned, -1);
    assert_true(scene_has_warning(&posed.imported.scene, "1 vertex without a joint weight"));
    find_vertex(&posed, 0, bar.positions[v], bar.normals[v], position, normal);
    assert_close(position,
                 (const double[]){(double)bar.positions[v][0], 2, (double)bar.positions[v][2]},
                 1e-6);
    posed_finish(&posed);
}

static void a_second_set_of_joints_counts_like_the_first(void **state)
{
    (void)state;
    struct bar bar;
    struct posed posed;
    bar_fill(&bar);
    for (int v = 0; v < BAR_VERTICES; v++)
        for (int k = 0; k < 4; k++)
            bar.weights[v][k] *= 3; /* as a share of two equal sets */
    pose(&posed, &bar,
         BAR_NODES "," BAR_SKIN ",'meshes':[{'primitives':[{'attributes':{" BAR_ATTRIBUTES
                   ",'JOINTS_1':2,'WEIGHTS_1':3},'indices':4}]}]",
         -1);
    assert_bent(&posed, &bar, M_PI / 2, 1e-6);
    posed_finish(&posed);
}

/* ---- morph targets ---- */

#define MORPHED_MESH                                                                      \
    "'meshes':[{'weights':[0.5,0],'primitives':[{'attributes':{'POSITION':0,'NORMAL':1}," \
    "'indices':4,'targets':[{'POSITION':8},{'NORMAL':9}]}]}]"

static void targets_are_added_by_their_weights(void **state)
{
    (void)state;
    struct bar bar;
    struct posed posed;
    bar_fill(&bar);
    pose(&posed, &bar,
         "'scenes':[{'nodes':[0,1]}],'nodes':[{'mesh':0},{'mesh':0,'weights':[0,2],"
         "'translation':[5,0,0]}]," MORPHED_MESH,
         -1);
    assert_int_equal(posed.state.item_count, 2);
    assert_int_equal(posed.state.items[1].deformed, 2); /* vertices of its own */
    for (int v = 0; v < BAR_VERTICES; v++) {
        const float *p = bar.positions[v], *n = bar.normals[v];
        double position[3], normal[3];
        find_vertex(&posed, 0, p, n, position, normal);
        assert_close(position, (const double[]){1.5 * (double)p[0], (double)p[1], (double)p[2]},
                     1e-6);
        assert_close(normal, (const double[]){(double)n[0], (double)n[1], (double)n[2]}, 1e-6);
        find_vertex(&posed, 1, p, n, position, normal);
        assert_close(position, (const double[]){5 + (double)p[0], (double)p[1], (double)p[2]},
                     1e-6);
        double z = (double)n[2] + 1, length = sqrt((double)(n[0] * n[0] + n[1] * n[1]) + z * z);
        if (length > 0) /* a normal that vanishes stays as it came out */
            assert_close(normal,
                         (const double[]){(double)n[0] / length, (double)n[1] / length, z / length},
                         1e-6);
    }
    assert_close(posed.state.items[0].bounds_max, (const double[]){0.375, 2, 0.25}, 1e-6);
    posed_finish(&posed);
}

static void morphed_vertices_are_skinned_after(void **state)
{
    (void)state;
    struct bar bar;
    struct posed posed;
    double position[3], normal[3];
    bar_fill(&bar);
    pose(&posed, &bar,
         BAR_NODES "," BAR_SKIN
                   ",'meshes':[{'weights':[1],'primitives':[{'attributes':{" BAR_ATTRIBUTES
                   "},'indices':4,'targets':[{'POSITION':8}]}]}]",
         -1);
    int v = 8 * BAR_RINGS + 4;
    find_vertex(&posed, 0, bar.positions[v], bar.normals[v], position, normal);
    assert_close(
        position,
        (const double[]){-1, 1 + 2 * (double)bar.positions[v][0], (double)bar.positions[v][2]},
        1e-6);
    posed_finish(&posed);
}

static const struct weights_case {
    const char *interpolation;
    int count; /* of outputs */
    double time_s, expected[2];
} weights_cases[] = {
    {"STEP", 6, 0.9, {1, 10}},
    {"STEP", 6, 1, {2, 20}},
    {"LINEAR", 6, 0.25, {1.25, 12.5}},
    {"LINEAR", 6, 9, {4, 40}},
    /* p(1/2) = (p0 + p1) / 2 + (m0 - m1) / 8 by the Hermite basis */
    {"CUBICSPLINE", 18, 0.5, {1.5 + (8 - 16) / 8.0, 15 + (80 - 160) / 8.0}},
};

static void weights_are_animated_by_all_interpolations(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof weights_cases / sizeof *weights_cases; i++) {
        const struct weights_case *c = &weights_cases[i];
        struct bar bar;
        struct posed posed;
        char json[JSON_BYTES];
        bar_fill(&bar);
        for (int key = 0; key < 3; key++)
            for (int k = 0; k < 2; k++) {
                float value = (float)(1 << key) * (k ? 10 : 1);
                if (c->count == 6) {
                    bar.amounts[2 * key + k] = value;
                    continue;
                }
                bar.amounts[6 * key + k] = 8 * value;     /* in-tangents */
                bar.amounts[6 * key + 2 + k] = value;     /* values */
                bar.amounts[6 * key + 4 + k] = 8 * value; /* out-tangents */
            }
        snprintf(json, sizeof json,
                 "'scenes':[{'nodes':[0]}],'nodes':[{'mesh':0}]," MORPHED_MESH
                 ",'animations':[{'channels':[{'sampler':0,'target':{'node':0,'path':'weights'}}],"
                 "'samplers':[{'input':6,'output':%d,'interpolation':'%s'}]}]",
                 c->count == 6 ? 10 : 12, c->interpolation);
        pose(&posed, &bar, json, c->time_s);
        assert_false(posed.state.has_idle_animation);
        assert_int_equal(posed.imported.scene.deformed_nodes[0].weight_count, 2);
        for (int k = 0; k < 2; k++)
            if (!(fabs((double)posed.state.deforms.weights[k] - c->expected[k]) < 1e-5))
                fail_msg("%s at %g: weight %d is %g, not %g", c->interpolation, c->time_s, k,
                         (double)posed.state.deforms.weights[k], c->expected[k]);
        posed_finish(&posed);
    }
}

/* Without normals each triangle is flat, in the pose that it is in. */
static void flat_triangles_are_flat_in_every_pose(void **state)
{
    (void)state;
    struct bar bar;
    struct posed posed;
    bar_fill(&bar);
    pose(&posed, &bar,
         BAR_NODES "," BAR_SKIN ",'meshes':[{'primitives':[{'attributes':{'POSITION':0,"
                   "'JOINTS_0':2,'WEIGHTS_0':3},'indices':4}]}]",
         -1);
    const struct state_geometry g = state_geometry_of(&posed.state, &posed.state.items[0]);
    assert_int_equal(g.primitive->vertex_count, BAR_INDICES);
    for (uint32_t i = 0; i < g.primitive->index_count; i += 3) {
        double p[3][3], a[3], b[3], n[3], length;
        for (uint32_t k = 0; k < 3; k++)
            state_geometry_corner(&g, i + k, p[k]);
        for (int k = 0; k < 3; k++) {
            a[k] = p[1][k] - p[0][k];
            b[k] = p[2][k] - p[0][k];
        }
        for (int k = 0; k < 3; k++)
            n[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
        length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (uint32_t k = 0; k < 3; k++) {
            uint32_t v = g.primitive->first_vertex + g.indices[g.primitive->first_index + i + k];
            const float *found = g.normals + 3 * (size_t)v;
            assert_close((const double[]){found[0], found[1], found[2]},
                         (const double[]){n[0] / length, n[1] / length, n[2] / length}, 1e-5);
        }
    }
    posed_finish(&posed);
}

/* ---- several of one ---- */

static void parts_are_posed_where_they_hang(void **state)
{
    (void)state;
    struct bar bar;
    struct posed base, part;
    struct error err = {0};
    char json[JSON_BYTES];
    bar_fill(&bar);
    pose(&base, &bar, skinned, -1);
    snprintf(json, sizeof json, "%s%s", skinned, TURNING);
    pose(&part, &bar, json, -1);
    const struct compose_part twin = {.name = "t", .scene = &part.imported.scene, .identity = 1};
    struct composed_scene *composed = scene_compose(
        &(struct compose_desc){.base = &base.imported.scene, .parts = &twin, .part_count = 1},
        &err);
    assert_non_null(composed);
    const struct view_part placed = {.name = "t",
                                     .matrix = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 10, 0, 0, 1}};
    const struct view view = {.width_px = 1,
                              .height_px = 1,
                              .parts = &placed,
                              .part_count = 1,
                              .is_animated = true,
                              .animation_time_s = 0};
    struct scene_state both;
    assert_true(scene_state_init(&both, composed_scene_get(composed), &view, &err));
    assert_int_equal(both.item_count, 2);
    /* the base has no animation and stays bent, the part stands upright at 0 s */
    assert_close(both.items[0].bounds_min, (const double[]){-1, 0, -0.25}, 1e-6);
    assert_close(both.items[1].bounds_min, (const double[]){9.75, 0, -0.25}, 1e-6);
    assert_close(both.items[1].bounds_max, (const double[]){10.25, 2, 0.25}, 1e-6);
    assert_true(both.items[0].shadow_hash == base.state.items[0].shadow_hash);
    const struct state_geometry geometry = state_geometry_of(&both, &both.items[1]);
    assert_int_equal(geometry.primitive->part, 1);
    assert_ptr_equal(geometry.indices, part.imported.scene.indices);
    scene_state_finish(&both);
    composed_scene_destroy(composed);
    posed_finish(&base);
    posed_finish(&part);
}

static void instances_share_their_animated_weights(void **state)
{
    (void)state;
    struct bar bar;
    struct posed posed;
    bar_fill(&bar);
    bar.amounts[0] = bar.amounts[2] = bar.amounts[4] = 1;
    pose(&posed, &bar,
         "'extensionsUsed':['EXT_mesh_gpu_instancing'],'scenes':[{'nodes':[0]}],'nodes':[{'mesh':0,"
         "'extensions':{'EXT_mesh_gpu_instancing':{'attributes':{'TRANSLATION':0}}}}]," MORPHED_MESH
         ",'animations':[{'channels':[{'sampler':0,'target':{'node':0,'path':'weights'}}],"
         "'samplers':[{'input':6,'output':10}]}]",
         0);
    assert_int_equal(posed.state.item_count, BAR_VERTICES);
    for (size_t i = 0; i < posed.state.item_count; i++) {
        double width = posed.state.items[i].bounds_max[0] - posed.state.items[i].bounds_min[0];
        assert_true(fabs(width - 1) < 1e-6); /* twice that of the bar */
    }
    posed_finish(&posed);
}

/* ---- what is not there, and what is refused ---- */

static void scenes_without_poses_carry_none_of_it(void **state)
{
    (void)state;
    struct bar bar;
    struct posed posed;
    bar_fill(&bar);
    /* joints of a mesh that no skinned node shows are not read */
    pose(&posed, &bar, "'scenes':[{'nodes':[0]}],'nodes':[{'mesh':0}]," BAR_MESH, -1);
    const struct scene *scene = &posed.imported.scene;
    for (int section = SCENE_SKINS; section <= SCENE_TARGET_WEIGHTS; section++)
        assert_int_equal(scene->header->sections[section].count, 0);
    assert_null(posed.state.deforms.weights);
    assert_int_equal(posed.state.deforms.serial, 0);
    assert_int_equal(posed.state.items[0].deformed, 0);
    posed_finish(&posed);
}

static void closed_surfaces_stay_closed_where_their_seams_move_alike(void **state)
{
    (void)state;
    struct bar bar;
    struct posed posed;
    bar_fill(&bar);
    pose(&posed, &bar, skinned, -1);
    assert_true(posed.imported.scene.primitives[0].flags & SCENE_PRIMITIVE_IS_CLOSED);
    posed_finish(&posed);
    bar.weights[8][0] = 0.4f; /* one of two vertices at a corner of the middle ring */
    bar.weights[8][1] = 0.6f;
    pose(&posed, &bar, skinned, -1);
    assert_false(posed.imported.scene.primitives[0].flags & SCENE_PRIMITIVE_IS_CLOSED);
    posed_finish(&posed);
}

static const struct refusal {
    const char *rest, *says;
} refusals[] = {
    {BAR_NODES "," BAR_MESH, "node 0 'Bar': there is no skin 0"},
    {BAR_NODES "," BAR_MESH ",'skins':[{}]", "node 0 'Bar': skin 0: it has no joints"},
    {BAR_NODES "," BAR_MESH ",'skins':[{'joints':[1,9]}]",
     "skin 0: it has the joint 9, but there is no such node"},
    {BAR_NODES "," BAR_MESH ",'skins':[{'joints':[1,2,1]}]", "it has the joint 1 twice"},
    {BAR_NODES "," BAR_MESH ",'skins':[{'joints':[-1]}]", "skins: "},
    {"'scenes':[{'nodes':[0]}],'nodes':[{'mesh':0,'skin':0},{}]," BAR_MESH
     ",'skins':[{'joints':[0,1]}]",
     "its joint 1 is node 1, which is not in the scene"},
    {BAR_NODES "," BAR_MESH ",'skins':[{'joints':[1,2],'skeleton':7}]", "the skeleton 7"},
    {BAR_NODES "," BAR_MESH ",'skins':[{'joints':[1,2,0],'inverseBindMatrices':5}]",
     "it has 3 joints, but inverse bind matrices for 2"},
    {BAR_NODES "," BAR_MESH ",'skins':[{'joints':[1,2],'inverseBindMatrices':0}]",
     "inverseBindMatrices: accessor 0: its elements are no 4 x 4 matrices"},
    {BAR_NODES "," BAR_MESH ",'skins':[{'joints':[1,2],'inverseBindMatrices':77}]",
     "inverseBindMatrices: there is no accessor 77"},
    {BAR_NODES "," BAR_MESH ",'skins':[{'joints':[1]}]",
     "node 0 'Bar': its mesh names the joint 1, its skin has 1"},
    {BAR_NODES "," BAR_SKIN ",'meshes':[{'primitives':[{'attributes':{'POSITION':0,'JOINTS_0':2},"
               "'indices':4}]}]",
     "mesh 0 '', primitive 0: it has JOINTS_0 without WEIGHTS_0"},
    {BAR_NODES "," BAR_SKIN ",'meshes':[{'primitives':[{'attributes':{'POSITION':0,'JOINTS_1':2,"
               "'WEIGHTS_1':3},'indices':4}]}]",
     "it has JOINTS_1 without JOINTS_0"},
    {BAR_NODES "," BAR_SKIN ",'meshes':[{'primitives':[{'attributes':{'POSITION':0,'JOINTS_0':3,"
               "'WEIGHTS_0':3},'indices':4}]}]",
     "accessor 3 has an element type that JOINTS_0 cannot have"},
    {BAR_NODES "," BAR_SKIN ",'meshes':[{'primitives':[{'attributes':{'POSITION':0,'JOINTS_0':2,"
               "'WEIGHTS_0':0},'indices':4}]}]",
     "accessor 0 has an element type that WEIGHTS_0 cannot have"},
    {BAR_NODES "," BAR_SKIN ",'meshes':[{'primitives':[{'attributes':{" BAR_ATTRIBUTES
               "},'indices':4,'targets':[{}]},{'attributes':{" BAR_ATTRIBUTES "},'indices':4}]}]",
     "mesh 0 '': primitive 1 has 0 morph targets, primitive 0 has 1"},
    {BAR_NODES "," BAR_SKIN
               ",'meshes':[{'weights':[1,2],'primitives':[{'attributes':{" BAR_ATTRIBUTES
               "},'indices':4,'targets':[{'POSITION':8}]}]}]",
     "mesh 0 '': 2 weights for 1 morph targets"},
    {"'scenes':[{'nodes':[0]}],'nodes':[{'mesh':0,'weights':[1]}]," MORPHED_MESH,
     "node 0 '': 1 weights for 2 morph targets"},
    {BAR_NODES "," BAR_SKIN ",'meshes':[{'primitives':[{'attributes':{" BAR_ATTRIBUTES
               "},'indices':4,'targets':[{'POSITION':7}]}]}]",
     "morph target 0: accessor 7 has an element type that POSITION of a morph target"},
    {BAR_NODES "," BAR_SKIN ",'meshes':[{'primitives':[{'attributes':{" BAR_ATTRIBUTES
               "},'indices':4,'targets':[{'NORMAL':0},{'POSITION':99}]}]}]",
     "morph target 1: POSITION: there is no accessor 99"},
    {"'scenes':[{'nodes':[0]}],'nodes':[{'mesh':0}]," MORPHED_MESH
     ",'animations':[{'channels':[{'sampler':0,'target':{'node':0,'path':'weights'}}],"
     "'samplers':[{'input':6,'output':6}]}]",
     "3 values for 3 times and 2 morph targets"},
    {"'scenes':[{'nodes':[0]}],'nodes':[{'mesh':0}]," MORPHED_MESH
     ",'animations':[{'channels':[{'sampler':0,'target':{'node':0,'path':'weights'}}],"
     "'samplers':[{'input':6,'output':0}]}]",
     "its values have 3 components, not 1"},
    {"'scenes':[{'nodes':[0]}],'nodes':[{'mesh':0}]," MORPHED_MESH
     ",'animations':[{'channels':[{'sampler':0,'target':{'node':4,'path':'weights'}}],"
     "'samplers':[{'input':6,'output':10}]}]",
     "there is no node 4"},
};

static void what_is_wrong_is_refused_by_name(void **state)
{
    (void)state;
    struct bar bar;
    bar_fill(&bar);
    for (size_t i = 0; i < sizeof refusals / sizeof *refusals; i++) {
        struct imported_scene s;
        struct error err = {0};
        if (import_bar(&s, &bar, refusals[i].rest, &err))
            fail_msg("was taken, not refused as '%s'", refusals[i].says);
        assert_int_equal(err.code, ERROR_INVALID_SCENE);
        if (!strstr(err.message, refusals[i].says))
            fail_msg("'%s' does not say '%s'", err.message, refusals[i].says);
    }
}

static void wrong_numbers_are_refused(void **state)
{
    (void)state;
    struct imported_scene s;
    struct bar bar;
    struct error err = {0};
    bar_fill(&bar);
    bar.weights[3][1] = -0.5f;
    assert_false(import_bar(&s, &bar, skinned, &err));
    assert_non_null(strstr(err.message, "vertex 3 has the joint weight -0.5"));
    bar_fill(&bar);
    bar.joints[9][1] = 2;
    memset(&err, 0, sizeof err);
    assert_false(import_bar(&s, &bar, skinned, &err));
    assert_non_null(strstr(err.message, "its mesh names the joint 2, its skin has 2"));
    bar_fill(&bar);
    bar.matrices[1][3] = 1;
    memset(&err, 0, sizeof err);
    assert_false(import_bar(&s, &bar, skinned, &err));
    assert_non_null(strstr(err.message, "inverse bind matrix 1 is not affine"));
    bar_fill(&bar);
    bar.matrices[0][0] = 3e38f;
    bar.matrices[0][12] = 3e38f;
    memset(&err, 0, sizeof err);
    assert_false(import_bar(&s, &bar, skinned, &err));
    assert_int_equal(err.code, ERROR_INVALID_SCENE);
}

static void too_many_targets_are_refused(void **state)
{
    (void)state;
    struct imported_scene s;
    struct bar bar;
    struct error err = {0};
    char *json = malloc(64 << 10), *at = json;
    bar_write_head(json, 64 << 10);
    at += strlen(json);
    at += sprintf(at, "'scenes':[{'nodes':[0]}],'nodes':[{'mesh':0}],'meshes':[{'primitives':[{"
                      "'attributes':{'POSITION':0},'targets':[{}");
    for (int i = 0; i < SCENE_TARGETS_MAX; i++)
        at += sprintf(at, ",{}");
    sprintf(at, "]}]}]}");
    bar_fill(&bar);
    assert_false(imported_scene_make(&s, json, &bar, sizeof bar, &err));
    assert_int_equal(err.code, ERROR_TOO_LARGE);
    assert_non_null(strstr(err.message, "1025 morph targets, limit is 1024"));
    free(json);
}

/* Any word of the blob, and what is evaluated of it. */
static void a_blob_that_was_tampered_with_is_refused_or_harmless(void **state)
{
    (void)state;
    static const uint32_t values[] = {0, 1, 3, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x7F7FFFFF};
    struct bar bar;
    struct imported_scene s;
    struct error err = {0};
    size_t accepted = 0, refused = 0;
    bar_fill(&bar);
    assert_true(import_bar(&s, &bar,
                           BAR_NODES "," BAR_SKIN ",'meshes':[{'weights':[1],'primitives':[{"
                                     "'attributes':{" BAR_ATTRIBUTES
                                     "},'indices':4,'targets':[{'POSITION':8}]}]}]",
                           &err));
    size_t begin = s.scene.header->sections[SCENE_SKINS].offset;
    for (size_t at = begin; at + 4 <= s.blob_bytes; at += 4)
        for (size_t v = 0; v < sizeof values / sizeof *values; v++) {
            char *copy = malloc(s.blob_bytes);
            struct scene scene;
            struct scene_state evaluated;
            memcpy(copy, s.blob, s.blob_bytes);
            memcpy(copy + at, &values[v], sizeof *values);
            memset(&err, 0, sizeof err);
            bool is_open = scene_open(&scene, copy, s.blob_bytes, &err);
            accepted += is_open;
            refused += !is_open;
            if (is_open && scene_state_init(&evaluated, &scene,
                                            &(struct view){.width_px = 1, .height_px = 1}, &err))
                scene_state_finish(&evaluated);
            free(copy);
        }
    assert_true(accepted > 1000 && refused > 1000);
    imported_scene_finish(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_bar_is_bent_as_its_joints_stand_and_its_own_node_moves_nothing),
        cmocka_unit_test(animated_joints_bend_the_bar),
        cmocka_unit_test(times_give_the_same_bits_and_the_same_pose_the_same_key),
        cmocka_unit_test(normals_follow_the_inverse_transpose),
        cmocka_unit_test(mirrored_joints_turn_the_winding),
        cmocka_unit_test(weights_are_made_to_add_up_to_one),
        cmocka_unit_test(a_vertex_without_weights_follows_the_first_joint),
        cmocka_unit_test(a_second_set_of_joints_counts_like_the_first),
        cmocka_unit_test(targets_are_added_by_their_weights),
        cmocka_unit_test(morphed_vertices_are_skinned_after),
        cmocka_unit_test(weights_are_animated_by_all_interpolations),
        cmocka_unit_test(flat_triangles_are_flat_in_every_pose),
        cmocka_unit_test(parts_are_posed_where_they_hang),
        cmocka_unit_test(instances_share_their_animated_weights),
        cmocka_unit_test(scenes_without_poses_carry_none_of_it),
        cmocka_unit_test(closed_surfaces_stay_closed_where_their_seams_move_alike),
        cmocka_unit_test(what_is_wrong_is_refused_by_name),
        cmocka_unit_test(wrong_numbers_are_refused),
        cmocka_unit_test(too_many_targets_are_refused),
        cmocka_unit_test(a_blob_that_was_tampered_with_is_refused_or_harmless),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
