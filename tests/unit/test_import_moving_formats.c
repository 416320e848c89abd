/* SPDX-License-Identifier: MIT */
/* Animations, skins and morph targets of COLLADA, FBX and 3DS, against closed forms, and what is
 * refused of them: on files written out here. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/scene/scene_state.h"
#include "tests/support/import_support.h"

static const double PI = 3.14159265358979323846;
static const double INCH_M = 0.0254;

static bool import_bytes(struct imported_scene *s, enum scene_format format, const void *bytes,
                         size_t size_bytes, const struct scene_import_desc *more, struct error *err)
{
    const struct scene_file file = {"", bytes, size_bytes};
    struct scene_import_desc desc = more ? *more : (struct scene_import_desc){0};
    *s = (struct imported_scene){0};
    desc.files = &file;
    desc.file_count = 1;
    desc.format = format;
    return scene_import(&desc, &s->blob, &s->blob_bytes, err) &&
           scene_open(&s->scene, s->blob, s->blob_bytes, err);
}

static struct imported_scene make(enum scene_format format, const char *text)
{
    struct imported_scene s;
    struct error err = {0};
    if (!import_bytes(&s, format, text, strlen(text), NULL, &err))
        fail_msg("%s", err.message);
    return s;
}

/* The text with the first occurrence of a part replaced; to be freed. */
static char *with(const char *text, const char *part, const char *other)
{
    const char *at = strstr(text, part);
    if (!at)
        fail_msg("there is no %s", part);
    char *out = malloc(strlen(text) + strlen(other) + 1);
    assert_non_null(out);
    sprintf(out, "%.*s%s%s", (int)(at - text), text, other, at + strlen(part));
    return out;
}

static void expect_refusal(enum scene_format format, char *text, const char *part)
{
    struct imported_scene s;
    struct error err = {0};
    if (import_bytes(&s, format, text, strlen(text), NULL, &err))
        fail_msg("it is taken, not refused for: %s", part);
    assert_int_equal(err.code, ERROR_INVALID_SCENE);
    if (!strstr(err.message, part))
        fail_msg("'%s' does not say '%s'", err.message, part);
    imported_scene_finish(&s);
    free(text);
}

/* Whether some vertex of the item lies there at that time (below 0: at rest), in metres. */
static bool has_vertex(const struct imported_scene *s, double time_s, const double at[3],
                       double *nearest)
{
    struct error err = {0};
    struct scene_state state;
    struct view view = {.width_px = 1, .height_px = 1, .is_animated = time_s >= 0};
    view.animation_time_s = fmax(time_s, 0);
    if (!scene_state_init(&state, &s->scene, &view, &err))
        fail_msg("%s", err.message);
    *nearest = INFINITY;
    for (size_t i = 0; i < state.item_count; i++) {
        const struct state_geometry geometry = state_geometry_of(&state, &state.items[i]);
        for (uint32_t v = 0; v < geometry.primitive->vertex_count; v++) {
            double world[3];
            state_geometry_point(&geometry, v, world);
            *nearest = fmin(*nearest, sqrt(pow(world[0] - at[0], 2) + pow(world[1] - at[1], 2) +
                                           pow(world[2] - at[2], 2)));
        }
    }
    scene_state_finish(&state);
    return *nearest <= 2e-6;
}

static void expect_vertex(const struct imported_scene *s, double time_s, double x, double y,
                          double z)
{
    double nearest;
    if (!has_vertex(s, time_s, (const double[3]){x, y, z}, &nearest))
        fail_msg("at %g s no vertex is at (%.9g, %.9g, %.9g): the nearest is %.3g m off", time_s, x,
                 y, z, nearest);
}

/* ---- COLLADA ---- */

#define FLOATS_OF(id, count, stride, numbers)                                                   \
    "<source id='" id "'><float_array id='" id "a' count='" count "'>" numbers "</float_array>" \
    "<technique_common><accessor source='#" id "a' count='" count "' stride='1'>"               \
    "<param name='X' type='float'/></accessor></technique_common></source>"
#define PLACES_OF(id, count, numbers)                                                   \
    "<source id='" id "'><float_array id='" id "a' count='" count "'>" numbers          \
    "</float_array><technique_common><accessor source='#" id "a' count='3' stride='3'>" \
    "<param name='X' type='float'/><param name='Y' type='float'/>"                      \
    "<param name='Z' type='float'/></accessor></technique_common></source>"
#define TRIANGLE_OF(id, numbers)                                                                \
    "<geometry id='" id "' name='" id                                                           \
    "'><mesh>" PLACES_OF(id "p", "9", numbers) "<vertices id='" id                              \
                                               "v'><input semantic='POSITION' source='#" id     \
                                               "p'/></vertices><triangles count='1'>"           \
                                               "<input semantic='VERTEX' source='#" id          \
                                               "v' offset='0'/><p>0 1 2</p></triangles></mesh>" \
                                               "</geometry>"
#define TURN(target, times, angles)                                                       \
    "<animation id='T'>" FLOATS_OF("Tt", "3", "1", times) FLOATS_OF(                      \
        "Tv", "3", "1", angles) "<sampler id='Ts'><input semantic='INPUT' source='#Tt'/>" \
                                "<input semantic='OUTPUT' source='#Tv'/></sampler>"       \
                                "<channel source='#Ts' target='" target "'/></animation>"
#define COLLADA_HEAD                                                                      \
    "<?xml version='1.0'?><COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' " \
    "version='1.4.1'><asset><unit name='inch' meter='0.0254'/><up_axis>Z_UP</up_axis></asset>"

/* Inches, Z up. A triangle with corners at z = 0, 1 and 2 on the Z axis (the middle one at x = 1),
 * which follow joint A, both in half, and joint B. B, at z = 1, turns about X by 0, 30 and 90
 * degrees at 0.5, 1 and 2 s. Node N moves along X by 0, 1 and 4 at 0, 0.25 and 3 s. */
static const char collada[] =
    COLLADA_HEAD "<library_geometries>" TRIANGLE_OF("G", "0 0 0 1 0 1 0 0 2") TRIANGLE_OF(
        "H",
        "0 0 5 1 0 5 0 0 6") "</library_geometries>"
                             "<library_controllers><controller id='K'><skin source='#G'>"
                             "<bind_shape_matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 "
                             "1</bind_shape_matrix>"
                             "<source id='Kj'><Name_array id='Kja' count='2'>A "
                             "B</Name_array><technique_common>"
                             "<accessor source='#Kja' count='2' stride='1'><param name='JOINT' "
                             "type='name'/></accessor>"
                             "</technique_common></source>"
                             "<source id='Km'><float_array id='Kma' count='32'>1 0 0 0 0 1 0 0 0 0 "
                             "1 0 0 0 0 1 "
                             "1 0 0 0 0 1 0 0 0 0 1 -1 0 0 0 1</float_array><technique_common>"
                             "<accessor source='#Kma' count='2' stride='16'><param "
                             "name='TRANSFORM' type='float4x4'/>"
                             "</accessor></technique_common></source>" FLOATS_OF(
                                 "Kw", "2", "1",
                                 "1 0.5") "<joints><input semantic='JOINT' source='#Kj'/>"
                                          "<input semantic='INV_BIND_MATRIX' "
                                          "source='#Km'/></joints>"
                                          "<vertex_weights count='3'><input semantic='JOINT' "
                                          "source='#Kj' offset='0'/>"
                                          "<input semantic='WEIGHT' source='#Kw' "
                                          "offset='1'/><vcount>1 2 1</vcount>"
                                          "<v>0 0 0 1 1 1 1 "
                                          "0</v></vertex_weights></skin></controller></"
                                          "library_controllers>"
                                          "<library_animations>" TURN(
                                              "B/turn.ANGLE", "0.5 1 2",
                                              "0 30 90") "<animation id='M'>" FLOATS_OF("Mt", "3",
                                                                                        "1",
                                                                                        "0 0.25 3")
                                              FLOATS_OF(
                                                  "Mv", "3", "1",
                                                  "0 1 4") "<sampler id='Ms'><input "
                                                           "semantic='INPUT' source='#Mt'/>"
                                                           "<input semantic='OUTPUT' "
                                                           "source='#Mv'/></sampler>"
                                                           "<channel source='#Ms' "
                                                           "target='N/move.X'/></animation></"
                                                           "library_animations>"
                                                           "<library_visual_scenes><visual_scene "
                                                           "id='S'>"
                                                           "<node id='A' name='A' sid='A' "
                                                           "type='JOINT'><node id='B' name='B' "
                                                           "sid='B' type='JOINT'>"
                                                           "<translate sid='place'>0 0 "
                                                           "1</translate><rotate sid='turn'>1 0 0 "
                                                           "0</rotate></node></node>"
                                                           "<node id='F' "
                                                           "name='F'><instance_controller "
                                                           "url='#K'><skeleton>#A</skeleton>"
                                                           "</instance_controller></node><node "
                                                           "id='N' name='N'><translate "
                                                           "sid='move'>0 0 0</translate>"
                                                           "<instance_geometry "
                                                           "url='#H'/></node></visual_scene></"
                                                           "library_visual_scenes>"
                                                           "<scene><instance_visual_scene "
                                                           "url='#S'/></scene></COLLADA>";

/* Places of the file in inches with Z up. */
static void expect_inches(const struct imported_scene *s, double time_s, double x, double y,
                          double z)
{
    expect_vertex(s, time_s, x * INCH_M, z * INCH_M, -y * INCH_M);
}

static void expect_bar(const struct imported_scene *s, double time_s, double degrees)
{
    double angle = degrees * PI / 180, c = cos(angle), sine = sin(angle);
    expect_inches(s, time_s, 0, 0, 0);
    expect_inches(s, time_s, 1, 0, 1); /* on the axis of the turn's joint */
    expect_inches(s, time_s, 0, -sine, 1 + c);
}

static void collada_skins_and_animations_move(void **state)
{
    (void)state;
    struct imported_scene s = make(SCENE_FORMAT_COLLADA, collada);
    static const double angles[][2] = {{-1, 0}, {0, 0},    {0.5, 0}, {0.75, 15},
                                       {1, 30}, {1.5, 60}, {2, 90},  {2.75, 90}};
    for (size_t i = 0; i < sizeof angles / sizeof *angles; i++)
        expect_bar(&s, angles[i][0], angles[i][1]);
    assert_int_equal(s.scene.animation_count, 1); /* one course of time */
    assert_true(fabsf(s.scene.animations[0].duration_s - 3) < 1e-5f);
    expect_inches(&s, 0.125, 0.5, 0, 5);
    expect_inches(&s, 1.625, 2.5 + 1, 0, 5); /* half of the way from 1 to 4 */
    assert_false(scene_has_warning(&s.scene, "left out"));
    imported_scene_finish(&s);
}

static void weights_of_bones_are_shares(void **state)
{
    (void)state;
    char *text = with(collada, ">1 0.5<", ">4 2<");
    struct imported_scene s = make(SCENE_FORMAT_COLLADA, text);
    expect_bar(&s, 1, 30);
    imported_scene_finish(&s);
    free(text);
}

/* A controller that morphs H by G, and what moves its weights and, in a way that assimp takes for N
 * itself, others. */
static void collada_morphs_are_left_out(void **state)
{
    (void)state;
    static const char controller[] =
        "<library_controllers><controller id='N-morph'><morph source='#H' method='NORMALIZED'>"
        "<source id='Q'><IDREF_array id='Qa' count='1'>G</IDREF_array><technique_common>"
        "<accessor source='#Qa' count='1' stride='1'><param name='MORPH_TARGET' type='IDREF'/>"
        "</accessor></technique_common></source>" FLOATS_OF(
            "N-morph-weights", "1", "1",
            "1") "<targets><input semantic='MORPH_TARGET' source='#Q'/>"
                 "<input semantic='MORPH_WEIGHT' "
                 "source='#N-morph-weights'/></targets></morph></controller>";
    static const char *const targets[] = {"N-morph-weights(0)", "N/morph-weights(0)", "N"};
    for (size_t i = 0; i < sizeof targets / sizeof *targets; i++) {
        char animation[1000];
        snprintf(
            animation, sizeof animation,
            "<library_animations><animation id='W'>" FLOATS_OF("Wt", "2", "1", "0 2")
                FLOATS_OF("Wv", "2", "1",
                          "0 1") "<sampler id='Ws'><input semantic='INPUT' "
                                 "source='#Wt'/><input semantic='OUTPUT' source='#Wv'/></sampler>"
                                 "<channel source='#Ws' target='%s'/></animation>",
            targets[i]);
        char *shown = with(collada, "<instance_geometry url='#H'/>",
                           "<instance_controller url='#N-morph'></instance_controller>");
        char *morphed = with(shown, "<library_controllers>", controller);
        char *text = with(morphed, "<library_animations>", animation);
        struct imported_scene s = make(SCENE_FORMAT_COLLADA, text);
        assert_true(scene_has_warning(&s.scene, "morph targets are left out, of controllers: 1"));
        assert_true(scene_has_warning(&s.scene, targets[i]));
        expect_bar(&s, 1, 30);
        expect_inches(&s, 0, 0, 0, 5);
        expect_inches(&s, 1.625, 2.5 + 1, 0, 5);
        imported_scene_finish(&s);
        free(text);
        free(morphed);
        free(shown);
    }
}

/* ---- FBX ---- */

/* "moving.fbx", whose head says what is in it; to be freed. */
static char *fbx(void)
{
    struct error err = {0};
    size_t size_bytes;
    char *bytes = file_read(VITRAIL_SOURCE_DIR "/tests/unit/moving.fbx", &size_bytes, &err);
    if (!bytes)
        fail_msg("%s", err.message);
    char *text = realloc(bytes, size_bytes + 1);
    assert_non_null(text);
    text[size_bytes] = '\0';
    return text;
}

static char *fbx_with(const char *part, const char *other)
{
    char *text = fbx(), *out = with(text, part, other);
    free(text);
    return out;
}

static void expect_fbx_moves(char *text)
{
    struct imported_scene s = make(SCENE_FORMAT_FBX, text);
    static const double angles[][2] = {{-1, 0}, {0.25, 0}, {0.75, 15},
                                       {1, 30}, {1.5, 60}, {2.5, 90}};
    for (size_t i = 0; i < sizeof angles / sizeof *angles; i++)
        expect_bar(&s, angles[i][0], angles[i][1]);
    assert_int_equal(s.scene.animation_count, 1);
    assert_int_equal(scene_find_animation(&s.scene, "Walk"), 0);
    static const struct {
        double time_s, x, is_long, is_wide; /* along X, and weights of the targets */
    } cases[] = {{-1, 0, 0, 0},
                 {0, 0, 0, 0.5},
                 {0.125, 0.5, 0.0625, 0.4375},
                 {1.625, 2.5, 0.8125, 0},
                 {3, 4, 1, 0}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        double x = cases[i].x;
        expect_inches(&s, cases[i].time_s, x, 0, 5);
        expect_inches(&s, cases[i].time_s, x + 1 + 2 * cases[i].is_wide, 0, 5);
        expect_inches(&s, cases[i].time_s, x, 0, 6 + 4 * cases[i].is_long);
    }
    assert_true(scene_has_warning(&s.scene, "assimp does not tell the weights"));
    imported_scene_finish(&s);
    free(text);
}

/* Targets are sorted by name: 'Zlong' lies behind 'Wide', 'Long' before it. */
static void fbx_skins_targets_and_animations_move(void **state)
{
    (void)state;
    expect_fbx_moves(fbx());
    expect_fbx_moves(fbx_with("SubDeformer::Long", "SubDeformer::Zlong"));
}

static void weights_below_zero_become_zero(void **state)
{
    (void)state;
    char *text = fbx_with("a: 0.5,1", "a: 0.5,-1");
    struct imported_scene s = make(SCENE_FORMAT_FBX, text);
    assert_true(scene_has_warning(&s.scene, "negative become 0: 1"));
    imported_scene_finish(&s);
    free(text);
}

static char *fbx_replace(const char *const (*pairs)[2], size_t count)
{
    char *text = fbx();
    for (size_t i = 0; i < count; i++) {
        char *out = with(text, pairs[i][0], pairs[i][1]);
        free(text);
        text = out;
    }
    return text;
}

/* Two triangles of one plane that touch: one hangs on A, one on B, which turns. */
static void vertices_that_move_apart_are_not_joined(void **state)
{
    (void)state;
    static const char *const pairs[][2] = {
        {"Vertices: *9", "Vertices: *18"},
        {"a: 0,0,0,1,0,1,0,0,2", "a: 0,0,0,1,0,1,0,0,2,0,0,2,1,0,1,1,0,3"},
        {"PolygonVertexIndex: *3", "PolygonVertexIndex: *6"},
        {"a: 0,1,-3", "a: 0,1,-3,3,4,-6"},
        {"Indexes: *2", "Indexes: *3"},
        {"a: 0,1\n", "a: 0,1,2\n"},
        {"Weights: *2", "Weights: *3"},
        {"a: 1,0.5", "a: 1,1,1"},
        {"Indexes: *2", "Indexes: *3"},
        {"a: 1,2\n", "a: 3,4,5\n"},
        {"Weights: *2", "Weights: *3"},
        {"a: 0.5,1\n", "a: 1,1,1\n"},
    };
    char *text = fbx_replace(pairs, sizeof pairs / sizeof *pairs);
    struct imported_scene s = make(SCENE_FORMAT_FBX, text);
    expect_inches(&s, 2, 0, 0, 2);
    expect_inches(&s, 2, 0, -1, 1);
    expect_inches(&s, 2, 1, -2, 1);
    imported_scene_finish(&s);
    free(text);
}

#define IDENTITY "1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1"

/* A triangle of FBX's default units (1 cm) whose corners follow joints 0 to count - 1, at x = their
 * number, by weights of their number and 1. To be freed. */
static char *fbx_of_bones(int count)
{
    size_t size = 1000 + 1000 * (size_t)count;
    char *text = malloc(size);
    assert_non_null(text);
    int at = snprintf(
        text, size,
        "; FBX 7.3.0 project file\nFBXHeaderExtension:  {\nFBXHeaderVersion: 1003\n"
        "FBXVersion: 7300\n}\nGlobalSettings:  {\nVersion: 1000\nProperties70:  {\n"
        "P: \"UnitScaleFactor\", \"double\", \"Number\", \"\",100\n}\n}\nObjects:  {\n"
        "Geometry: 1, \"Geometry::G\", \"Mesh\" {\nVertices: *9 {\na: 0,0,0,0,1,0,0,0,1\n}\n"
        "PolygonVertexIndex: *3 {\na: 0,1,-3\n}\n}\nModel: 2, \"Model::F\", \"Mesh\" {\n}\n"
        "Deformer: 3, \"Deformer::\", \"Skin\" {\n}\n");
    for (int i = 0; i < count; i++)
        at += snprintf(
            text + at, size - (size_t)at,
            "Model: %d, \"Model::J%d\", \"LimbNode\" {\nProperties70:  {\n"
            "P: \"Lcl Translation\", \"Lcl Translation\", \"\", \"A\",%d,0,0\n}\n}\n"
            "Deformer: %d, \"SubDeformer::J%d\", \"Cluster\" {\nIndexes: *3 {\na: 0,1,2\n}\n"
            "Weights: *3 {\na: %d,%d,%d\n}\nTransform: *16 {\na: " IDENTITY "\n}\n"
            "TransformLink: *16 {\na: " IDENTITY "\n}\n}\n",
            10000 + i, i, i, 20000 + i, i, i + 1, i + 1, i + 1);
    at += snprintf(text + at, size - (size_t)at,
                   "}\nConnections:  {\nC: \"OO\",1,2\nC: \"OO\",2,0\nC: \"OO\",3,1\n");
    for (int i = 0; i < count; i++)
        at += snprintf(text + at, size - (size_t)at,
                       "C: \"OO\",%d,0\nC: \"OO\",%d,3\nC: \"OO\",%d,%d\n", 10000 + i, 20000 + i,
                       10000 + i, 20000 + i);
    at += snprintf(text + at, size - (size_t)at, "}\n");
    assert_true((size_t)at < size);
    return text;
}

static void vertices_follow_their_strongest_bones(void **state)
{
    (void)state;
    static const int counts[] = {3, 8, 9, 2000};
    for (size_t c = 0; c < sizeof counts / sizeof *counts; c++) {
        char *text = fbx_of_bones(counts[c]);
        struct imported_scene s = make(SCENE_FORMAT_FBX, text);
        double sum = 0, x = 0;
        for (int i = counts[c] > 8 ? counts[c] - 8 : 0; i < counts[c]; i++) {
            sum += i + 1;
            x += (double)i * (i + 1);
        }
        double nearest;
        has_vertex(&s, -1, (const double[3]){x / sum, 1, 0}, &nearest);
        assert_true(nearest <= 1e-6 * fmax(x / sum, 1));
        assert_true(scene_has_warning(&s.scene, "8 strongest bones") == (counts[c] > 8));
        imported_scene_finish(&s);
        free(text);
    }
}

/* ---- 3DS ---- */

static unsigned char *put(unsigned char *at, const void *bytes, size_t size_bytes)
{
    memcpy(at, bytes, size_bytes);
    return at + size_bytes;
}

/* A chunk: 16 bits of kind, 32 of length with this head. Returns its begin. */
static unsigned char *begin_chunk(unsigned char **at, uint16_t kind)
{
    unsigned char *begin = *at;
    *at = put(*at, &kind, sizeof kind) + 4;
    return begin;
}
static void end_chunk(const unsigned char *at, unsigned char *begin)
{
    uint32_t length = (uint32_t)(at - begin);
    memcpy(begin + 2, &length, sizeof length);
}

/* The triangle (0, 0, 0), (1, 0, 0), (0, 0, 2). */
static unsigned char *put_part(unsigned char *at)
{
    unsigned char *editor = begin_chunk(&at, 0x3D3D), *object = begin_chunk(&at, 0x4000);
    at = put(at, "Part", 5);
    unsigned char *mesh = begin_chunk(&at, 0x4100), *places = begin_chunk(&at, 0x4110);
    at = put(at, &(uint16_t){3}, 2);
    at = put(at, (const float[9]){0, 0, 0, 1, 0, 0, 0, 0, 2}, 36);
    end_chunk(at, places);
    unsigned char *faces = begin_chunk(&at, 0x4120);
    at = put(at, &(uint16_t){1}, 2);
    at = put(at, (const uint16_t[4]){0, 1, 2, 0}, 8);
    end_chunk(at, faces);
    end_chunk(at, mesh);
    end_chunk(at, object);
    end_chunk(at, editor);
    return at;
}

/* With keys at frames 0 and 30: x of the second. */
static size_t write_3ds(unsigned char *out, float x)
{
    unsigned char *at = out, *main = begin_chunk(&at, 0x4D4D);
    at = put_part(at);
    unsigned char *keys = begin_chunk(&at, 0xB000), *node = begin_chunk(&at, 0xB002);
    unsigned char *head = begin_chunk(&at, 0xB010);
    at = put(at, "Part", 5);
    at = put(at, (const uint16_t[3]){0, 0, 0xFFFF}, 6);
    end_chunk(at, head);
    unsigned char *track = begin_chunk(&at, 0xB020);
    at = put(at, (const uint16_t[5]){0}, 10);
    at = put(at, &(uint32_t){2}, 4);
    for (uint32_t key = 0; key < 2; key++) {
        at = put(at, &(uint32_t){30 * key}, 4);
        at = put(at, &(uint16_t){0}, 2);
        at = put(at, (const float[3]){key ? x : 0, 0, 0}, 12);
    }
    end_chunk(at, track);
    end_chunk(at, node);
    end_chunk(at, keys);
    end_chunk(at, main);
    return (size_t)(at - out);
}

static void nodes_of_3ds_move_by_thirty_frames_a_second(void **state)
{
    (void)state;
    unsigned char bytes[400];
    struct imported_scene s;
    struct error err = {0};
    const struct scene_import_desc inches = {.unit_m = INCH_M};
    if (!import_bytes(&s, SCENE_FORMAT_3DS, bytes, write_3ds(bytes, 3), &inches, &err))
        fail_msg("%s", err.message);
    assert_int_equal(s.scene.animation_count, 1);
    expect_inches(&s, 0.5, 1.5, 0, 2);
    expect_inches(&s, 0.5, 2.5, 0, 0);
    expect_inches(&s, 1, 3, 0, 2);
    imported_scene_finish(&s);
    assert_false(import_bytes(&s, SCENE_FORMAT_3DS, bytes, write_3ds(bytes, NAN), &inches, &err));
    assert_non_null(strstr(err.message, "the translation of key 1 of 'Part' is not finite"));
}

static void broken_movement_is_refused_by_name(void **state)
{
    (void)state;
    const enum scene_format format = SCENE_FORMAT_COLLADA;
    expect_refusal(format, with(collada, ">A B<", ">A Q<"), "'Q', which is one of its bones");
    expect_refusal(format, with(collada, "0.5 1 2", "0.5 1 nan"), "the times 'Tt'");
    expect_refusal(format, with(collada, "0 30 90", "0 nan 90"), "'B'");
    expect_refusal(format, with(collada, "0 1 4", "0 1e39 4"), "'N'");
    expect_refusal(format, with(collada, "0 0 1 -1", "0 0 1 nan"), "offset matrix of bone 'B'");
    expect_refusal(format, with(collada, "count='3' stride='1'", "count='2' stride='1'"), "count");
    expect_refusal(SCENE_FORMAT_FBX, fbx_with("a: 0.5,1", "a: 0.5,nan"), "bone 'B'");
    expect_refusal(SCENE_FORMAT_FBX, fbx_with("a: 0,0,4", "a: 0,nan,4"), "morph target 'Long");
    expect_refusal(SCENE_FORMAT_FBX, fbx_with("a: 0,100", "a: 0,nan"), "'N'");
    expect_refusal(SCENE_FORMAT_FBX, fbx_with("a: 0,1,4", "a: 0,inf,4"), "'N'");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(collada_skins_and_animations_move),
        cmocka_unit_test(collada_morphs_are_left_out),
        cmocka_unit_test(weights_of_bones_are_shares),
        cmocka_unit_test(fbx_skins_targets_and_animations_move),
        cmocka_unit_test(weights_below_zero_become_zero),
        cmocka_unit_test(vertices_that_move_apart_are_not_joined),
        cmocka_unit_test(vertices_follow_their_strongest_bones),
        cmocka_unit_test(nodes_of_3ds_move_by_thirty_frames_a_second),
        cmocka_unit_test(broken_movement_is_refused_by_name),
    };
    if (!VITRAIL_WITH_ASSIMP)
        return 77; /* skipped: nothing reads them */
    return cmocka_run_group_tests(tests, NULL, NULL);
}
