/* SPDX-License-Identifier: MIT */
/* scene_import of COLLADA, FBX, 3DS and Open Inventor, which tell units, axes and places: on files
 * written out here. 3MF, whose files are archives, is tested over HTTP. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/import_support.h"

static struct scene_origin told;

static bool take_origin(void *context, const struct scene_origin *origin, struct error *err)
{
    (void)context, (void)err;
    told = *origin;
    return true;
}

static bool import_bytes(struct imported_scene *s, enum scene_format format, const void *bytes,
                         size_t size_bytes, const struct scene_import_desc *more, struct error *err)
{
    const struct scene_file file = {"", bytes, size_bytes};
    struct scene_import_desc desc = more ? *more : (struct scene_import_desc){0};
    *s = (struct imported_scene){0};
    desc.files = &file;
    desc.file_count = 1;
    desc.format = format;
    desc.tell_origin = take_origin;
    return scene_import(&desc, &s->blob, &s->blob_bytes, err) &&
           scene_open(&s->scene, s->blob, s->blob_bytes, err);
}

static struct imported_scene make(enum scene_format format, const void *bytes, size_t size_bytes,
                                  const struct scene_import_desc *more)
{
    struct imported_scene s;
    struct error err = {0};
    if (!import_bytes(&s, format, bytes, size_bytes, more, &err))
        fail_msg("%s", err.message);
    return s;
}

static void expect_bounds(const struct imported_scene *s, const double *low, const double *high)
{
    for (int i = 0; i < 3; i++)
        if (!(fabs(s->scene.header->bounds_min[i] - low[i]) <= 1e-6) ||
            !(fabs(s->scene.header->bounds_max[i] - high[i]) <= 1e-6))
            fail_msg("axis %d: %.9g to %.9g, not %.9g to %.9g", i, s->scene.header->bounds_min[i],
                     s->scene.header->bounds_max[i], low[i], high[i]);
}

/* The place of the node that carries the first light or camera, in metres. */
static void expect_place(const struct imported_scene *s, bool is_light, const double *place)
{
    for (uint32_t i = 0; i < s->scene.node_count; i++) {
        const struct scene_node *node = &s->scene.nodes[i];
        if ((is_light ? node->light : node->camera) != 0)
            continue;
        for (int k = 0; k < 3; k++)
            assert_true(fabs((double)node->world_matrix[12 + k] - place[k]) <= 1e-5);
        return;
    }
    fail_msg("no node carries it");
}

/* A triangle of width 1 and height 2 (along z), a light at (0, 0, 10) and a camera at (3, 0, 0) in
 * inches with +Z up; what passes the material is (0.2, 0.5, 0.3). */
static const char collada[] =
    "<?xml version=\"1.0\"?><COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" "
    "version=\"1.4.1\"><asset><unit name=\"inch\" meter=\"0.0254\"/><up_axis>Z_UP</up_axis></asset>"
    "<library_cameras><camera id=\"C\"><optics><technique_common><perspective><xfov>90</xfov>"
    "<aspect_ratio>2</aspect_ratio><znear>1</znear><zfar>100</zfar></perspective>"
    "</technique_common></optics></camera></library_cameras>"
    "<library_lights><light id=\"L\"><technique_common><point><color>0.5 1 0</color>"
    "<quadratic_attenuation>4</quadratic_attenuation></point></technique_common></light>"
    "</library_lights><library_effects><effect id=\"E\"><profile_COMMON><technique "
    "sid=\"t\"><phong>"
    "<diffuse><color>0.9 0.9 0.9 1</color></diffuse>"
    "<transparent opaque=\"RGB_ZERO\"><color>0.2 0.5 0.3 1</color></transparent>"
    "<transparency><float>1</float></transparency></phong></technique></profile_COMMON></effect>"
    "</library_effects><library_materials><material id=\"M\" name=\"Pane\">"
    "<instance_effect url=\"#E\"/></material></library_materials><library_geometries>"
    "<geometry id=\"G\"><mesh><source id=\"P\"><float_array id=\"A\" count=\"9\">0 0 0 1 0 0 0 0 2"
    "</float_array><technique_common><accessor source=\"#A\" count=\"3\" stride=\"3\">"
    "<param name=\"X\" type=\"float\"/><param name=\"Y\" type=\"float\"/>"
    "<param name=\"Z\" type=\"float\"/></accessor></technique_common></source><vertices id=\"V\">"
    "<input semantic=\"POSITION\" source=\"#P\"/></vertices><triangles count=\"1\" material=\"m\">"
    "<input semantic=\"VERTEX\" source=\"#V\" offset=\"0\"/><p>0 1 2</p></triangles></mesh>"
    "</geometry></library_geometries><library_visual_scenes><visual_scene id=\"S\">"
    "<node id=\"N\" name=\"N\"><instance_geometry url=\"#G\"><bind_material><technique_common>"
    "<instance_material symbol=\"m\" target=\"#M\"/></technique_common></bind_material>"
    "</instance_geometry></node><node id=\"Lamp\" name=\"Lamp\"><translate>0 0 10</translate>"
    "<instance_light url=\"#L\"/></node><node id=\"Eye\" name=\"Eye\"><translate>3 0 0</translate>"
    "<instance_camera url=\"#C\"/></node></visual_scene></library_visual_scenes><scene>"
    "<instance_visual_scene url=\"#S\"/></scene></COLLADA>";

static void collada_tells_its_unit_and_axis(void **state)
{
    (void)state;
    struct imported_scene s = make(SCENE_FORMAT_COLLADA, collada, strlen(collada), NULL);
    expect_bounds(&s, (double[]){0, 0, 0}, (double[]){0.0254, 2 * 0.0254, 0});
    assert_true(fabs(told.unit_m - 0.0254) < 1e-9 && told.up == 'z');
    assert_int_equal(told.unit_by, SCENE_WORD_FILE);
    assert_int_equal(told.up_by, SCENE_WORD_FILE);
    expect_place(&s, true, (double[]){0, 10 * 0.0254, 0});
    expect_place(&s, false, (double[]){3 * 0.0254, 0, 0});
    imported_scene_finish(&s);
    s = make(SCENE_FORMAT_COLLADA, collada, strlen(collada),
             &(struct scene_import_desc){.unit_m = 1, .up = 'y'});
    expect_bounds(&s, (double[]){0, 0, 0}, (double[]){1, 0, 2});
    assert_int_equal(told.unit_by, SCENE_WORD_REQUEST);
    imported_scene_finish(&s);
}

static void collada_filters_light_and_has_lights_and_cameras(void **state)
{
    (void)state;
    struct imported_scene s = make(SCENE_FORMAT_COLLADA, collada, strlen(collada), NULL);
    const struct scene_material *m = &s.scene.materials[0];
    const float filter[3] = {0.2f, 0.5f, 0.3f};
    for (int i = 0; i < 3; i++)
        assert_true(fabsf(m->base_color[i] - filter[i]) < 1e-4f);
    assert_true(m->transmission == 1);
    assert_int_equal(s.scene.camera_count, 1);
    assert_int_equal(s.scene.light_count, 1);
    const struct scene_light *light = &s.scene.lights[0];
    assert_int_equal(light->type, SCENE_LIGHT_POINT);
    /* brightness 1 / (4 d^2), d in inches, and pi for a white surface that is as bright */
    double wanted = 3.14159265358979 * 0.0254 * 0.0254 / 4;
    assert_true(fabs((double)light->intensity - wanted) < 1e-6 * wanted);
    assert_true(light->color[0] == 0.5f && light->color[1] == 1 && light->color[2] == 0);
    const struct scene_camera *camera = &s.scene.cameras[0];
    if (scene_has_warning(&s.scene, "camera 'Eye': assimp does not tell its field of view")) {
        assert_float_equal(camera->y_fov_rad, 3.14159265f / 4, 1e-5f);
    } else { /* where assimp reads cameras */
        assert_float_equal(camera->y_fov_rad, 2 * atanf(0.5f), 1e-5f);
        assert_float_equal(camera->z_near, 0.0254f, 1e-6f);
    }
    imported_scene_finish(&s);
}

#define FBX_HEAD                                                                       \
    "; FBX 7.3.0 project file\nFBXHeaderExtension:  {\n\tFBXHeaderVersion: 1003\n"     \
    "\tFBXVersion: 7300\n}\nGlobalSettings:  {\n\tVersion: 1000\n\tProperties70:  {\n" \
    "\t\tP: \"UpAxis\", \"int\", \"Integer\", \"\",2\n"                                \
    "\t\tP: \"UnitScaleFactor\", \"double\", \"Number\", \"\",2.54\n\t}\n}\n"
static const char fbx[] =
    FBX_HEAD "Objects:  {\n\tGeometry: 11, \"Geometry::G\", \"Mesh\" {\n"
             "\t\tVertices: *9 {\n\t\t\ta: 0,0,0,1,0,0,0,0,2\n\t\t}\n"
             "\t\tPolygonVertexIndex: *3 {\n\t\t\ta: 0,1,-3\n\t\t}\n\t}\n"
             "\tModel: 12, \"Model::N\", \"Mesh\" {\n\t\tVersion: 232\n\t}\n}\n"
             "Connections:  {\n\tC: \"OO\",12,0\n\tC: \"OO\",11,12\n}\n";

static void fbx_tells_its_unit_and_axis(void **state)
{
    (void)state;
    struct imported_scene s = make(SCENE_FORMAT_FBX, fbx, strlen(fbx), NULL);
    expect_bounds(&s, (double[]){0, 0, 0}, (double[]){0.0254, 2 * 0.0254, 0});
    assert_true(fabs(told.unit_m - 0.0254) < 1e-8 && told.up == 'z');
    assert_string_equal(scene_unit_name(told.unit_m), "in");
    assert_int_equal(told.unit_by, SCENE_WORD_FILE);
    imported_scene_finish(&s);
    s = make(SCENE_FORMAT_FBX, fbx, strlen(fbx), &(struct scene_import_desc){.unit_m = 0.01});
    expect_bounds(&s, (double[]){0, 0, 0}, (double[]){0.01, 0.02, 0});
    assert_int_equal(told.up_by, SCENE_WORD_FILE);
    imported_scene_finish(&s);
}

/* A chunk of 3DS: 16 bits of kind, 32 of length with this head. Returns its begin. */
static size_t begin_chunk(unsigned char *out, size_t *size, uint16_t kind)
{
    memcpy(out + *size, &kind, sizeof kind);
    *size += 6;
    return *size - 6;
}
static void end_chunk(unsigned char *out, const size_t *size, size_t begin)
{
    uint32_t length = (uint32_t)(*size - begin);
    memcpy(out + begin + 2, &length, sizeof length);
}
static void put(unsigned char *out, size_t *size, const void *bytes, size_t size_bytes)
{
    memcpy(out + *size, bytes, size_bytes);
    *size += size_bytes;
}

/* A triangle of width 1 and height 2 (along z). */
static size_t write_3ds(unsigned char *out, uint16_t corner)
{
    size_t size = 0, main = begin_chunk(out, &size, 0x4D4D);
    size_t editor = begin_chunk(out, &size, 0x3D3D), object = begin_chunk(out, &size, 0x4000);
    put(out, &size, "Part", 5);
    size_t mesh = begin_chunk(out, &size, 0x4100), places = begin_chunk(out, &size, 0x4110);
    put(out, &size, &(uint16_t){3}, 2);
    put(out, &size, (const float[9]){0, 0, 0, 1, 0, 0, 0, 0, 2}, 36);
    end_chunk(out, &size, places);
    size_t faces = begin_chunk(out, &size, 0x4120);
    put(out, &size, &(uint16_t){1}, 2);
    put(out, &size, (const uint16_t[4]){0, 1, corner, 0}, 8);
    end_chunk(out, &size, faces);
    end_chunk(out, &size, mesh);
    end_chunk(out, &size, object);
    end_chunk(out, &size, editor);
    end_chunk(out, &size, main);
    return size;
}

static void scenes_of_3ds_stand_upright(void **state)
{
    (void)state;
    unsigned char bytes[400];
    struct imported_scene s = make(SCENE_FORMAT_3DS, bytes, write_3ds(bytes, 2),
                                   &(struct scene_import_desc){.unit_m = 0.01});
    expect_bounds(&s, (double[]){0, 0, 0}, (double[]){0.01, 0.02, 0});
    assert_true(told.up == 'z');
    assert_int_equal(told.up_by, SCENE_WORD_DEFAULT);
    imported_scene_finish(&s);
    s = make(SCENE_FORMAT_3DS, bytes, write_3ds(bytes, 2), &(struct scene_import_desc){.up = 'y'});
    expect_bounds(&s, (double[]){0, 0, 0}, (double[]){1, 0, 2});
    assert_true(scene_has_warning(&s.scene, "3DS does not tell the unit"));
    imported_scene_finish(&s);
}

#define IV "#Inventor V2.0 ascii\n"

static void inventor_nodes_have_the_state_before_them(void **state)
{
    (void)state;
    static const char text[] =
        IV "Separator { Material { diffuseColor 0.9 0.1 0.2 transparency 0.75 }\n"
           "DEF Move Translation { translation 10 0 0 }\n"
           "Separator { Units { units INCHES } Scale { scaleFactor 2 1 1 }\n"
           "Coordinate3 { point [ 0 0 0, 1 0 0, 0 1 0 ] } # a comment\n"
           "DEF Part IndexedFaceSet { coordIndex [ 0, 1, 2, -1 ] } }\n"
           "USE Move Switch { whichChild 1 Sphere { } DEF Box Cube { width 1 height 2 depth 4 } }\n"
           "Switch { Cone { } } }\n";
    struct imported_scene s = make(SCENE_FORMAT_INVENTOR, text, strlen(text), NULL);
    /* the triangle from (10, 0, 0) to (10 + 2 in, 1 in, 0), the box around (20, 0, 0) */
    expect_bounds(&s, (double[]){10, -1, -2}, (double[]){20.5, 1, 2});
    assert_int_equal(s.scene.header->triangle_count, 1 + 12);
    const struct scene_material *m = &s.scene.materials[0];
    const float wanted[4] = {0.9f, 0.1f, 0.2f, 0.25f};
    for (int i = 0; i < 4; i++)
        assert_float_equal(m->base_color[i], wanted[i], 1e-6f);
    assert_int_equal(m->alpha_mode, SCENE_BLEND);
    assert_int_equal(told.unit_by, SCENE_WORD_FILE);
    imported_scene_finish(&s);
}

static void inventor_bodies_face_outward(void **state)
{
    (void)state;
    static const char *const shapes[] = {"Cube { }", "Sphere { radius 2 }", "Cylinder { height 6 }",
                                         "Cone { bottomRadius 3 }"};
    static const double half[][3] = {{1, 1, 1}, {2, 2, 2}, {1, 3, 1}, {3, 1, 3}};
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        char text[200];
        snprintf(text, sizeof text, IV "Material { transparency 0.5 } %s\n", shapes[i]);
        struct imported_scene s = make(SCENE_FORMAT_INVENTOR, text, strlen(text), NULL);
        expect_bounds(&s, (double[]){-half[i][0], -half[i][1], -half[i][2]}, half[i]);
        /* closed, and seen from outside: else the surface would be double-sided */
        assert_false(s.scene.materials[0].flags & SCENE_MATERIAL_DOUBLE_SIDED);
        imported_scene_finish(&s);
    }
}

static void inventor_turns_and_places(void **state)
{
    (void)state;
    static const char text[] =
        IV "PointLight { location 1 2 3 intensity 0.5 }\n"
           "PerspectiveCamera { position 0 0 9 heightAngle 0.5 }\n"
           "Transform { translation 0 0 1 rotation 0 0 1 1.57079633 }\n"
           "MatrixTransform { matrix 1 0 0 0  0 1 0 0  0 0 1 0  5 0 0 1 }\n"
           "Coordinate3 { point [ 0 0 0, 1 0 0, 0 2 0 ] } ShapeHints { vertexOrdering CLOCKWISE }\n"
           "FaceSet { numVertices 3 } Texture2 { filename \"a.png\" }\n";
    struct imported_scene s = make(SCENE_FORMAT_INVENTOR, text, strlen(text), NULL);
    expect_bounds(&s, (double[]){-2, 5, 1}, (double[]){0, 6, 1}); /* x became y */
    assert_float_equal(s.scene.normals[2], -1, 1e-6f); /* of the node, which is turned about z */
    expect_place(&s, true, (double[]){1, 2, 3});
    expect_place(&s, false, (double[]){0, 0, 9});
    assert_float_equal(s.scene.cameras[0].y_fov_rad, 0.5f, 1e-6f);
    assert_true(scene_has_warning(&s.scene, "nodes of type Texture2 are left out"));
    imported_scene_finish(&s);
}

static void broken_files_are_refused_by_name(void **state)
{
    (void)state;
    static const char downward[] = "P: \"UpAxisSign\", \"int\", \"Integer\", \"\",-1\n\t}\n}\n";
    char turned[sizeof fbx + sizeof downward];
    const char *after = strstr(fbx, "2.54\n") + 5;
    snprintf(turned, sizeof turned, "%.*s%s%s", (int)(after - fbx), fbx, downward, after + 5);
    unsigned char bytes[400];
    size_t size = write_3ds(bytes, 2);
    const struct {
        enum scene_format format;
        const void *bytes;
        size_t size_bytes;
        const char *message;
    } cases[] = {
        {SCENE_FORMAT_COLLADA, collada, sizeof collada / 2, "COLLADA: "},
        {SCENE_FORMAT_COLLADA, "<COLLADA/>", 10, "COLLADA: "},
        {SCENE_FORMAT_FBX, fbx, sizeof fbx / 2, "FBX: "},
        {SCENE_FORMAT_FBX, FBX_HEAD, strlen(FBX_HEAD), "FBX: "},
        {SCENE_FORMAT_FBX, turned, strlen(turned), "only +X, +Y and +Z are read"},
        {SCENE_FORMAT_3DS, bytes, 20, "3DS: "},
        {SCENE_FORMAT_3DS, "3DS", 3, "3DS: "},
#define IV_CASE(text, message) {SCENE_FORMAT_INVENTOR, IV text, strlen(IV text), message}
        {SCENE_FORMAT_INVENTOR, "#Inventor V2.1 binary", 21, "is not '#Inventor V2.0 ascii'"},
        IV_CASE("Separator {\n", "line 3: the file ends within a node"),
        IV_CASE("Separator { }\n", "no shape that is read"),
        IV_CASE("\nUSE A\n", "line 3: USE of 'A'"),
        IV_CASE("DEF A Separator { USE A }\n", "USE of 'A'"),
        IV_CASE("Cube { width nan }\n", "width of a node Cube has the value 'nan'"),
        IV_CASE("Cube { width [ 1 \n", "ends within a node"),
        IV_CASE("Coordinate3 { point [ 0 0 0 ] } IndexedFaceSet { coordIndex [ 0 1 2 -1 ] }\n",
                "names vertex 1 of 1"),
        IV_CASE("FaceSet { numVertices 4 }\n", "takes 4 vertices of 0"),
        {SCENE_FORMAT_3MF, "PK\3\4 is no archive", 18, "3MF: "},
    };
    assert_int_equal(size, write_3ds(bytes, 2));
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct imported_scene s;
        struct error err = {0};
        assert_false(
            import_bytes(&s, cases[i].format, cases[i].bytes, cases[i].size_bytes, NULL, &err));
        if (err.code != ERROR_INVALID_SCENE || !strstr(err.message, cases[i].message))
            fail_msg("case %zu: %d '%s'", i, err.code, err.message);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(collada_tells_its_unit_and_axis),
        cmocka_unit_test(collada_filters_light_and_has_lights_and_cameras),
        cmocka_unit_test(fbx_tells_its_unit_and_axis),
        cmocka_unit_test(scenes_of_3ds_stand_upright),
        cmocka_unit_test(inventor_nodes_have_the_state_before_them),
        cmocka_unit_test(inventor_bodies_face_outward),
        cmocka_unit_test(inventor_turns_and_places),
        cmocka_unit_test(broken_files_are_refused_by_name),
    };
    if (!VITRAIL_WITH_ASSIMP)
        return 77; /* skipped: nothing reads them */
    return cmocka_run_group_tests(tests, NULL, NULL);
}
