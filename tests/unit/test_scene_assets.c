/* SPDX-License-Identifier: MIT */
/* Scenes made by others: what is supported is imported and agrees with the JSON read independently;
 * what is not is refused or warned of by name. Skipped when the assets are absent. */
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
#include <time.h>

#include "renderer/base/matrix.h"
#include "tests/support/import_support.h"

enum { SKIPPED = 77 };

struct asset {
    const char *path;
    const char *says; /* a warning, or the reason of the refusal; NULL: no warning at all */
    uint32_t lights, cameras;
};

static const struct asset imported[] = {
    {"AlphaBlendModeTest/glTF-Binary/AlphaBlendModeTest.glb", NULL, 0, 0},
    {"AnimatedMorphCube/glTF-Binary/AnimatedMorphCube.glb", NULL, 0, 0},
    {"AnimatedMorphCube/glTF-Quantized/AnimatedMorphCube.gltf", NULL, 0, 0},
    {"AttenuationTest/glTF-Binary/AttenuationTest.glb", NULL, 0, 0},
    {"Box With Spaces/glTF/Box With Spaces.gltf", NULL, 0, 0},
    {"Box/glTF-Binary/Box.glb", NULL, 0, 0},
    {"Box/glTF-Embedded/Box.gltf", NULL, 0, 0},
    {"Box/glTF/Box.gltf", NULL, 0, 0},
    {"BoxAnimated/glTF-Binary/BoxAnimated.glb", NULL, 0, 0},
    {"BoxInterleaved/glTF-Binary/BoxInterleaved.glb", NULL, 0, 0},
    {"BoxVertexColors/glTF-Binary/BoxVertexColors.glb", NULL, 0, 0},
    {"BoxVertexColors/glTF-Embedded/BoxVertexColors.gltf", NULL, 0, 0},
    {"Cameras/glTF/Cameras.gltf", NULL, 0, 2},
    {"CesiumMan/glTF-Binary/CesiumMan.glb", NULL, 0, 0},
    {"ClearCoatTest/glTF-Binary/ClearCoatTest.glb", NULL, 0, 0},
    {"CornellBox/CornellBox.glb", NULL, 0, 0},
    {"Duck/glTF-Binary/Duck.glb", NULL, 0, 1},
    {"Duck/glTF-Quantized/Duck.gltf", NULL, 0, 1},
    {"EmissiveStrengthTest/glTF-Binary/EmissiveStrengthTest.glb", NULL, 0, 0},
    {"GlassVaseFlowers/glTF-Binary/GlassVaseFlowers.glb", NULL, 0, 0},
    {"InterpolationTest/glTF-Binary/InterpolationTest.glb", NULL, 0, 0},
    {"Lights-playcanvas/Lights.glb", NULL, 4, 1},
    {"LightsExampleKhronos/lights.gltf", NULL, 3, 2},
    {"LightsPunctualLamp/glTF/LightsPunctualLamp.gltf", NULL, 5, 0},
    {"MeshPrimitiveModes/glTF-Embedded/MeshPrimitiveModes.gltf", NULL, 0, 0},
    {"MeshPrimitiveModes/glTF/MeshPrimitiveModes.gltf", NULL, 0, 0},
    {"MultiUVTest/glTF-Binary/MultiUVTest.glb", NULL, 0, 1},
    {"MultipleScenes/glTF/MultipleScenes.gltf", NULL, 0, 0},
    {"NegativeScaleTest/glTF-Binary/NegativeScaleTest.glb", NULL, 0, 0},
    {"NormalTangentTest/glTF-Binary/NormalTangentTest.glb", NULL, 0, 0},
    {"OrientationTest/glTF-Binary/OrientationTest.glb", NULL, 0, 0},
    {"RecursiveSkeletons/glTF-Binary/RecursiveSkeletons.glb", NULL, 0, 0},
    {"RevelryJackOLantern/jack-o-lantern.gltf", NULL, 1, 0},
    {"RevelryShadowsDirectional/shadows-directional.gltf", NULL, 1, 1},
    {"RiggedSimple/glTF-Binary/RiggedSimple.glb", NULL, 0, 0},
    {"ShapeCollection/ShapeCollection.glb", NULL, 0, 0},
    {"SheenChair/glTF/SheenChair.gltf", NULL, 0, 0},
    {"SimpleInstancing/glTF-Binary/SimpleInstancing.glb", NULL, 0, 0},
    {"SimpleMorph/glTF-Embedded/SimpleMorph.gltf", NULL, 0, 0},
    {"SimpleMorph/glTF/SimpleMorph.gltf", NULL, 0, 0},
    {"SimpleSkin/glTF-Embedded/SimpleSkin.gltf", NULL, 0, 0},
    {"SimpleSkin/glTF/SimpleSkin.gltf", NULL, 0, 0},
    {"SimpleSparseAccessor/glTF-Embedded/SimpleSparseAccessor.gltf", NULL, 0, 0},
    {"SimpleSparseAccessor/glTF/SimpleSparseAccessor.gltf", NULL, 0, 0},
    {"SparseMorphCube/singleBlendshapeCube_sparse.glb", NULL, 0, 0},
    {"SpecularTest/glTF-Binary/SpecularTest.glb", NULL, 0, 0},
    {"Sponza/glTF/Sponza.gltf", "1 triangle of zero area", 0, 0},
    {"StainedGlassLamp/glTF-JPG-PNG/StainedGlassLamp-transmission.gltf", NULL, 0, 0},
    {"StainedGlassLamp/glTF-JPG-PNG/StainedGlassLamp.gltf", NULL, 0, 0},
    {"TextureLinearInterpolationTest/glTF-Binary/TextureLinearInterpolationTest.glb", NULL, 0, 0},
    {"TextureSettingsTest/glTF-Binary/TextureSettingsTest.glb", NULL, 0, 0},
    {"TextureTransformTest/glTF/TextureTransformTest.gltf", NULL, 0, 0},
    {"ToyCar/glTF/ToyCar.gltf", NULL, 0, 8},
    {"TransmissionRoughnessTest/glTF-Binary/TransmissionRoughnessTest.glb", NULL, 0, 0},
    {"TransmissionTest/glTF-Binary/TransmissionTest.glb", "KHR_xmp is not", 0, 1},
    {"Triangle/glTF-Embedded/Triangle.gltf", NULL, 0, 0},
    {"Triangle/glTF/Triangle.gltf", NULL, 0, 0},
    {"TriangleWithoutIndices/glTF/TriangleWithoutIndices.gltf", NULL, 0, 0},
    {"TwoSidedPlane/glTF/TwoSidedPlane.gltf", NULL, 0, 0},
    {"Unicode\xE2\x9D\xA4\xE2\x99\xBBTest/glTF/Unicode\xE2\x9D\xA4\xE2\x99\xBBTest.gltf", NULL, 0,
     0},
    {"UnlitTest/glTF-Binary/UnlitTest.glb", NULL, 0, 0},
    {"glass-table/glass-table.glb", NULL, 0, 0},
    {"2CylinderEngine/2CylinderEngine.glb", "triangles of zero area", 0, 1},
    {"MetalRoughSpheresNoTextures/glTF-Binary/MetalRoughSpheresNoTextures.glb",
     "196 triangles of zero area", 0, 0},
    {"BoxMeshopt/BoxMeshopt.glb", NULL, 0, 0},
    {"BoxTexturedMeshopt/BoxTextured_meshopt.glb", NULL, 0, 0},
    {"MeshoptPirate/pirate.glb", NULL, 0, 0},
    {"WebpCrate/webp.gltf", NULL, 0, 0},
    {"Box/glTF-Draco/Box.gltf", NULL, 0, 0},
    {"Duck/glTF-Draco/Duck.gltf", NULL, 0, 1},
    {"RiggedSimple/glTF-Draco/RiggedSimple.gltf", NULL, 0, 0},
    {"SponzaDracoNoTextures/sponza_no_textures.optimized.glb", "454 triangles of zero area", 0, 0},
};

static const struct asset refused[] = {
    {"CesiumBalloonKTX2/CesiumBalloonKTX2.glb", "KHR_texture_basisu", 0, 0},
};

static struct imported_scene load(const char *path)
{
    struct imported_scene s;
    struct error err = {0};
    if (!imported_asset_load(&s, path, &err))
        fail_msg("%s: %s", path, err.message);
    return s;
}

/* ---- the document, read by another library ---- */

static json_t *read_document(const char *path)
{
    char whole[1024];
    struct error err = {0};
    size_t size;
    snprintf(whole, sizeof whole, "%s/%s", VITRAIL_ASSET_DIR, path);
    char *bytes = file_read(whole, &size, &err);
    assert_non_null(bytes);
    bool is_glb = memcmp(bytes, "glTF", 4) == 0;
    uint32_t length;
    memcpy(&length, bytes + 12, 4);
    json_t *document = json_loadb(is_glb ? bytes + 20 : bytes, is_glb ? length : size, 0, NULL);
    assert_non_null(document);
    free(bytes);
    return document;
}

static json_int_t integer(const json_t *object, const char *name, json_int_t fallback)
{
    const json_t *value = json_object_get(object, name);
    return value ? json_integer_value(value) : fallback;
}

static uint64_t primitive_triangles(const json_t *document, const json_t *primitive)
{
    json_int_t accessor = integer(primitive, "indices", -1);
    if (accessor < 0)
        accessor = integer(json_object_get(primitive, "attributes"), "POSITION", -1);
    json_t *accessors = json_object_get(document, "accessors");
    uint64_t count = (uint64_t)integer(json_array_get(accessors, (size_t)accessor), "count", 0);
    switch (integer(primitive, "mode", 4)) {
    case 4:
        return count / 3;
    case 5:
    case 6:
        return count < 3 ? 0 : count - 2;
    default:
        return 0;
    }
}

static uint64_t instance_count(const json_t *document, const json_t *node)
{
    const json_t *extension =
        json_object_get(json_object_get(node, "extensions"), "EXT_mesh_gpu_instancing");
    json_int_t accessor = integer(json_object_get(extension, "attributes"), "TRANSLATION", -1);
    json_t *accessors = json_object_get(document, "accessors");
    return (uint64_t)integer(json_array_get(accessors, (size_t)accessor), "count", 1);
}

static uint64_t node_triangles(const json_t *document, json_int_t index)
{
    const json_t *node = json_array_get(json_object_get(document, "nodes"), (size_t)index);
    json_int_t mesh = integer(node, "mesh", -1);
    uint64_t sum = 0;
    size_t i;
    json_t *value;
    const json_t *record =
        mesh < 0 ? NULL : json_array_get(json_object_get(document, "meshes"), (size_t)mesh);
    json_array_foreach(json_object_get(record, "primitives"), i, value) sum +=
        primitive_triangles(document, value);
    sum *= instance_count(document, node);
    json_array_foreach(json_object_get(node, "children"), i, value) sum +=
        node_triangles(document, json_integer_value(value));
    return sum;
}

static uint64_t document_triangles(const json_t *document)
{
    json_t *scenes = json_object_get(document, "scenes"), *value;
    size_t i;
    uint64_t sum = 0;
    const json_t *scene = json_array_get(scenes, (size_t)integer(document, "scene", 0));
    json_array_foreach(json_object_get(scene, "nodes"), i, value) sum +=
        node_triangles(document, json_integer_value(value));
    return sum;
}

static const char *name_of(const json_t *object)
{
    const char *name = json_string_value(json_object_get(object, "name"));
    return name ? name : "";
}

/* Of its own, else its mesh's, which no other node may have and no index ("#3") may look like. */
static const char *name_of_node(const json_t *document, const json_t *node)
{
    json_t *meshes = json_object_get(document, "meshes"), *other;
    const char *name = name_of(node);
    size_t i;
    if (*name || !json_object_get(node, "mesh"))
        return name;
    name = name_of(json_array_get(meshes, (size_t)integer(node, "mesh", 0)));
    json_array_foreach(json_object_get(document, "nodes"), i, other)
    {
        if (!strcmp(name_of(other), name))
            return "";
    }
    return name[0] == '#' ? "" : name;
}

static bool are_names_kept(const struct scene *scene, const json_t *document)
{
    json_t *nodes = json_object_get(document, "nodes");
    for (uint32_t i = 0; i < scene->node_count; i++) {
        const json_t *node = json_array_get(nodes, scene->nodes[i].source_index);
        if (strcmp(name_of_node(document, node), scene->strings + scene->nodes[i].name) != 0)
            return false;
    }
    json_t *materials = json_object_get(document, "materials"), *value;
    size_t i;
    json_array_foreach(materials, i, value)
    {
        if (strcmp(name_of(value), scene->strings + scene->materials[i].name) != 0)
            return false;
    }
    return scene->material_count == json_array_size(materials) + 1;
}

/* ---- tests ---- */

static void supported_assets_are_imported(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof imported / sizeof *imported; i++) {
        const struct asset *asset = &imported[i];
        struct imported_scene s = load(asset->path);
        if (asset->says ? !scene_has_warning(&s.scene, asset->says) : s.scene.warning_count > 0)
            fail_msg("%s: %u warnings, '%s' expected, first is '%s'", asset->path,
                     s.scene.warning_count, asset->says ? asset->says : "none",
                     s.scene.warning_count ? s.scene.strings + s.scene.warnings[0] : "");
        if (s.scene.light_count != asset->lights || s.scene.camera_count != asset->cameras)
            fail_msg("%s: %u lights, %u cameras", asset->path, s.scene.light_count,
                     s.scene.camera_count);
        assert_true(s.scene.primitive_count > 0);
        imported_scene_finish(&s);
    }
}

static void triangles_and_names_agree_with_the_document(void **state)
{
    (void)state;
    size_t compared = 0;
    for (size_t i = 0; i < sizeof imported / sizeof *imported; i++) {
        const char *path = imported[i].path;
        struct imported_scene s = load(path);
        json_t *document = read_document(path);
        uint64_t expected = document_triangles(document), dropped = 0;
        for (uint32_t w = 0; w < s.scene.warning_count; w++) {
            const char *text = s.scene.strings + s.scene.warnings[w];
            if (strstr(text, "of zero area"))
                dropped = strtoull(text, NULL, 10);
        }
        uint64_t triangles = s.scene.header->triangle_count;
        /* instances multiply what was dropped once */
        if (dropped ? triangles + dropped > expected || triangles == 0 : triangles != expected)
            fail_msg("%s: %llu triangles, the document has %llu, %llu were dropped", path,
                     (unsigned long long)triangles, (unsigned long long)expected,
                     (unsigned long long)dropped);
        if (!are_names_kept(&s.scene, document))
            fail_msg("%s: names differ", path);
        compared += dropped == 0;
        json_decref(document);
        imported_scene_finish(&s);
    }
    assert_true(compared > 50);
}

static void assets_that_require_more_are_refused_by_name(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof refused / sizeof *refused; i++) {
        struct imported_scene s;
        struct error err = {0};
        assert_false(imported_asset_load(&s, refused[i].path, &err));
        assert_int_equal(err.code, ERROR_UNSUPPORTED);
        if (!strstr(err.message, refused[i].says))
            fail_msg("%s: %s", refused[i].path, err.message);
    }
}

static void one_model_in_several_packagings_is_one_blob(void **state)
{
    (void)state;
    static const char *const pairs[][2] = {
        {"Box/glTF-Embedded/Box.gltf", "Box/glTF/Box.gltf"},
        {"MeshPrimitiveModes/glTF-Embedded/MeshPrimitiveModes.gltf",
         "MeshPrimitiveModes/glTF/MeshPrimitiveModes.gltf"},
        {"SimpleSparseAccessor/glTF-Embedded/SimpleSparseAccessor.gltf",
         "SimpleSparseAccessor/glTF/SimpleSparseAccessor.gltf"},
        {"SimpleSkin/glTF-Embedded/SimpleSkin.gltf", "SimpleSkin/glTF/SimpleSkin.gltf"},
    };
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
        struct imported_scene a = load(pairs[i][0]), b = load(pairs[i][1]);
        assert_int_equal(a.blob_bytes, b.blob_bytes);
        assert_memory_equal(a.blob, b.blob, a.blob_bytes);
        imported_scene_finish(&a);
        imported_scene_finish(&b);
    }
}

static void quantised_geometry_lies_where_the_plain_one_does(void **state)
{
    (void)state;
    struct imported_scene a = load("Duck/glTF-Binary/Duck.glb");
    struct imported_scene b = load("Duck/glTF-Quantized/Duck.gltf");
    for (int i = 0; i < 3; i++) {
        assert_true(fabs(a.scene.header->bounds_min[i] - b.scene.header->bounds_min[i]) < 1e-3);
        assert_true(fabs(a.scene.header->bounds_max[i] - b.scene.header->bounds_max[i]) < 1e-3);
    }
    imported_scene_finish(&a);
    imported_scene_finish(&b);
}

/* The largest distance from a vertex of one mesh to the nearest of another, m. */
static double farthest_vertex(const struct scene *a, const struct scene *b)
{
    double farthest = 0;
    for (uint32_t i = 0; i < a->primitives[0].vertex_count; i++) {
        double nearest = INFINITY;
        for (uint32_t j = 0; j < b->primitives[0].vertex_count; j++) {
            const float *p = a->positions + 3 * (size_t)i, *q = b->positions + 3 * (size_t)j;
            double x = p[0] - q[0], y = p[1] - q[1], z = p[2] - q[2];
            nearest = fmin(nearest, x * x + y * y + z * z);
        }
        farthest = fmax(farthest, sqrt(nearest));
    }
    return farthest;
}

static void draco_geometry_lies_where_the_plain_one_does(void **state)
{
    (void)state;
    struct imported_scene a = load("Duck/glTF-Binary/Duck.glb");
    struct imported_scene b = load("Duck/glTF-Draco/Duck.gltf");
    double there = farthest_vertex(&a.scene, &b.scene), back = farthest_vertex(&b.scene, &a.scene);
    printf("Duck by Draco: vertices at most %.3f and %.3f away, of a body 165 wide\n", there, back);
    assert_true(there < 0.1 && back < 0.1);
    assert_int_equal(a.scene.header->triangle_count, b.scene.header->triangle_count);
    imported_scene_finish(&a);
    imported_scene_finish(&b);
}

static void negative_scale_keeps_its_determinant(void **state)
{
    (void)state;
    struct imported_scene s = load("NegativeScaleTest/glTF-Binary/NegativeScaleTest.glb");
    int mirrored = 0, plain = 0;
    for (uint32_t i = 0; i < s.scene.node_count; i++) {
        double determinant = mat4_determinant3(s.scene.nodes[i].world_matrix);
        mirrored += determinant < 0;
        plain += determinant > 0;
    }
    assert_true(mirrored >= 3 && plain >= 3);
    imported_scene_finish(&s);
}

static void every_primitive_mode_draws_the_same_square(void **state)
{
    (void)state;
    struct imported_scene s = load("MeshPrimitiveModes/glTF/MeshPrimitiveModes.gltf");
    int kinds[3] = {0};
    for (uint32_t i = 0; i < s.scene.primitive_count; i++)
        kinds[s.scene.primitives[i].topology]++;
    assert_int_equal(kinds[SCENE_POINTS], 1);
    assert_int_equal(kinds[SCENE_LINES], 3);
    assert_int_equal(kinds[SCENE_TRIANGLES], 3);
    imported_scene_finish(&s);
}

static void glass_brings_its_factors(void **state)
{
    (void)state;
    struct imported_scene s =
        load("StainedGlassLamp/glTF-JPG-PNG/StainedGlassLamp-transmission.gltf");
    int glasses = 0;
    for (uint32_t i = 0; i < s.scene.material_count; i++)
        glasses += s.scene.materials[i].transmission > 0;
    assert_true(glasses >= 3);
    imported_scene_finish(&s);
    s = load("AttenuationTest/glTF-Binary/AttenuationTest.glb");
    int attenuating = 0;
    for (uint32_t i = 0; i < s.scene.material_count; i++)
        attenuating += s.scene.materials[i].attenuation_distance > 0;
    assert_true(attenuating >= 5);
    imported_scene_finish(&s);
}

static void lamp_lights_keep_type_colour_and_place(void **state)
{
    (void)state;
    const char *path = "LightsPunctualLamp/glTF/LightsPunctualLamp.gltf";
    struct imported_scene s = load(path);
    json_t *document = read_document(path), *value;
    json_t *lights = json_object_get(
        json_object_get(json_object_get(document, "extensions"), "KHR_lights_punctual"), "lights");
    static const char *const types[] = {"directional", "point", "spot"};
    size_t i;
    json_array_foreach(lights, i, value)
    {
        const struct scene_light *light = &s.scene.lights[i];
        assert_string_equal(types[light->type], json_string_value(json_object_get(value, "type")));
        double intensity = json_number_value(json_object_get(value, "intensity"));
        assert_true(light->intensity == (float)intensity);
    }
    int carried = 0;
    for (uint32_t n = 0; n < s.scene.node_count; n++)
        carried += s.scene.nodes[n].light >= 0;
    assert_int_equal(carried, 5);
    json_decref(document);
    imported_scene_finish(&s);
}

static void sponza_is_decoded_in_seconds(void **state)
{
    (void)state;
    struct timespec a, b;
    clock_gettime(CLOCK_MONOTONIC, &a);
    struct imported_scene s = load("Sponza/glTF/Sponza.gltf");
    clock_gettime(CLOCK_MONOTONIC, &b);
    double seconds = (double)(b.tv_sec - a.tv_sec) + (double)(b.tv_nsec - a.tv_nsec) / 1e9;
    fprintf(stderr, "Sponza: %.2f s from disk to blob, %.1f MB, %llu triangles\n", seconds,
            (double)s.blob_bytes / 1e6, (unsigned long long)s.scene.header->triangle_count);
    assert_int_equal(s.scene.header->triangle_count, 262266);
    assert_true(seconds < 60); /* slack for sanitizers and busy machines */
    imported_scene_finish(&s);
}

int main(void)
{
    if (!assets_are_present())
        return SKIPPED;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(supported_assets_are_imported),
        cmocka_unit_test(triangles_and_names_agree_with_the_document),
        cmocka_unit_test(assets_that_require_more_are_refused_by_name),
        cmocka_unit_test(one_model_in_several_packagings_is_one_blob),
        cmocka_unit_test(quantised_geometry_lies_where_the_plain_one_does),
        cmocka_unit_test(draco_geometry_lies_where_the_plain_one_does),
        cmocka_unit_test(negative_scale_keeps_its_determinant),
        cmocka_unit_test(every_primitive_mode_draws_the_same_square),
        cmocka_unit_test(glass_brings_its_factors),
        cmocka_unit_test(lamp_lights_keep_type_colour_and_place),
        cmocka_unit_test(sponza_is_decoded_in_seconds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
