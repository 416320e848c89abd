/* SPDX-License-Identifier: MIT */
/* scene_import: broken and hostile uploads are refused with a message that names what and where. */
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

struct corner_bin {
    float positions[3][3]; /* view 0 */
    uint16_t indices[4];   /* view 1 */
    float texcoords[3][2]; /* view 2 */
    uint16_t sparse[2];    /* view 3 */
};

static const struct corner_bin bin = {
    .positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
    .indices = {0, 1, 2, 0},
    .texcoords = {{0, 0}, {1, 0}, {0, 1}},
    .sparse = {1, 2},
};

#define ASSET "'asset':{'version':'2.0'}"
#define VIEWS                                                                                   \
    "'buffers':[{'byteLength':72}],'bufferViews':[{'buffer':0,'byteLength':36},"                \
    "{'buffer':0,'byteOffset':36,'byteLength':8},{'buffer':0,'byteOffset':44,'byteLength':24}," \
    "{'buffer':0,'byteOffset':68,'byteLength':4}]"
#define ACCESSORS                                                                 \
    "'accessors':[{'bufferView':0,'componentType':5126,'count':3,'type':'VEC3'}," \
    "{'bufferView':1,'componentType':5123,'count':3,'type':'SCALAR'},"            \
    "{'bufferView':2,'componentType':5126,'count':3,'type':'VEC2'}]"
#define SCENE "'scenes':[{'nodes':[0]}],'nodes':[{'mesh':0}]"
#define MESH "'meshes':[{'name':'M','primitives':[{'attributes':{'POSITION':0},'indices':1}]}]"
#define GOOD "{" ASSET "," VIEWS "," ACCESSORS "," SCENE "," MESH "}"

static enum error_code import_bin(const char *json, const struct corner_bin *data,
                                  struct error *err)
{
    struct imported_scene imported;
    memset(err, 0, sizeof *err);
    bool is_done = imported_scene_make(&imported, json, data, sizeof *data, err);
    assert_int_equal(is_done, err->code == ERROR_NONE);
    imported_scene_finish(&imported);
    return err->code;
}

struct refusal {
    const char *json;
    enum error_code code;
    const char *says; /* part of the message */
};

static void check_refusals(const struct refusal *refusals, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        struct error err;
        import_bin(refusals[i].json, &bin, &err);
        if (err.code != refusals[i].code || !strstr(err.message, refusals[i].says))
            fail_msg("%s\n-> %s: '%s' instead of %s: '...%s...'", refusals[i].json,
                     error_code_name(err.code), err.message, error_code_name(refusals[i].code),
                     refusals[i].says);
    }
}
#define CHECK_REFUSALS(list) check_refusals(list, sizeof(list) / sizeof *(list))

static void the_intact_scene_is_imported(void **state)
{
    (void)state;
    struct error err;
    assert_int_equal(import_bin(GOOD, &bin, &err), ERROR_NONE);
}

static void every_truncation_of_a_glb_is_refused(void **state)
{
    (void)state;
    size_t size;
    uint8_t *glb = glb_make(GOOD, &bin, sizeof bin, &size);
    for (size_t cut = 0; cut < size; cut++) {
        /* Its own block, so that a sanitizer sees overreads. */
        uint8_t *part = malloc(cut ? cut : 1);
        memcpy(part, glb, cut);
        struct scene_file file = {"", part, cut};
        struct imported_scene imported;
        struct error err = {0};
        assert_false(imported_scene_init(&imported, &file, 1, &err));
        assert_int_equal(err.code, ERROR_INVALID_SCENE);
        free(part);
    }
    free(glb);
}

static void flipped_bits_never_crash(void **state)
{
    (void)state;
    size_t size;
    uint8_t *glb = glb_make(GOOD, &bin, sizeof bin, &size);
    for (size_t bit = 0; bit < size * 8; bit++) {
        glb[bit / 8] ^= (uint8_t)(1 << bit % 8);
        struct scene_file file = {"", glb, size};
        struct imported_scene imported;
        struct error err = {0};
        if (imported_scene_init(&imported, &file, 1, &err))
            imported_scene_finish(&imported);
        else
            assert_int_not_equal(err.code, ERROR_INTERNAL);
        glb[bit / 8] ^= (uint8_t)(1 << bit % 8);
    }
    free(glb);
}

#define ACCESSOR_0(members)                       \
    "{" ASSET "," VIEWS ",'accessors':[{" members \
    "},{'bufferView':1,'componentType':5123,'count':3,'type':'SCALAR'}]," SCENE "," MESH "}"

static void accessors_outside_their_bytes_are_refused(void **state)
{
    (void)state;
    const struct refusal refusals[] = {
        {ACCESSOR_0("'bufferView':0,'componentType':5126,'count':4,'type':'VEC3'"),
         ERROR_INVALID_SCENE, "mesh 0 'M', primitive 0: POSITION: accessor 0: 4 elements"},
        {ACCESSOR_0("'bufferView':0,'byteOffset':4,'componentType':5126,'count':3,'type':'VEC3'"),
         ERROR_INVALID_SCENE, "accessor 0: 3 elements from byte 4"},
        {ACCESSOR_0("'bufferView':0,'byteOffset':18446744073709551604,'componentType':5126,"
                    "'count':3,'type':'VEC3'"),
         ERROR_INVALID_SCENE, "accessor 0"},
        {ACCESSOR_0("'bufferView':0,'componentType':5126,'count':4294967295,'type':'VEC3'"),
         ERROR_INVALID_SCENE, "accessor 0"},
        {ACCESSOR_0("'bufferView':0,'componentType':5126,'count':18446744073709551615,"
                    "'type':'VEC3'"),
         ERROR_INVALID_SCENE, "accessor 0: count"},
        {ACCESSOR_0("'bufferView':0,'componentType':5126,'count':0,'type':'VEC3'"),
         ERROR_INVALID_SCENE, "accessor 0: count 0"},
        {ACCESSOR_0("'bufferView':9,'componentType':5126,'count':3,'type':'VEC3'"),
         ERROR_INVALID_SCENE, "no buffer view 9"},
        {ACCESSOR_0("'bufferView':-7,'componentType':5126,'count':4294967295,'type':'VEC3'"),
         ERROR_INVALID_SCENE, "accessors[0].bufferView must be a whole number, not negative"},
        {ACCESSOR_0("'componentType':5126,'count':900000000,'type':'VEC3'"), ERROR_TOO_LARGE,
         "accessor 0: 900000000 elements without a buffer view"},
        {ACCESSOR_0("'bufferView':0,'componentType':5126,'count':3,'type':'VEC2'"),
         ERROR_INVALID_SCENE, "element type that POSITION cannot have"},
        {ACCESSOR_0("'bufferView':0,'componentType':5130,'count':1,'type':'VEC3'"),
         ERROR_INVALID_SCENE, "accessor 0"},
        {ACCESSOR_0("'bufferView':0,'componentType':5126,'count':1,'type':'MAT3'"),
         ERROR_INVALID_SCENE, "accessor 0"},
        {ACCESSOR_0("'bufferView':0,'componentType':5126,'count':2,'type':'VEC3'"),
         ERROR_INVALID_SCENE, "accessor 1: index 2 at 2, there are 2 vertices"},
        {"{" ASSET ",'buffers':[{'byteLength':72}],'bufferViews':[{'buffer':0,'byteOffset':40,"
         "'byteLength':36}],'accessors':[{'bufferView':0,'componentType':5126,'count':3,"
         "'type':'VEC3'}]," SCENE ",'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}]}",
         ERROR_INVALID_SCENE, "buffer view 0: bytes 40 + 36 lie outside buffer 0 of 72"},
        {"{" ASSET ",'buffers':[{'byteLength':72}],'bufferViews':[{'buffer':3,'byteLength':36}],"
         "'accessors':[{'bufferView':0,'componentType':5126,'count':3,'type':'VEC3'}]," SCENE
         ",'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}]}",
         ERROR_INVALID_SCENE, "there is no buffer 3"},
        {"{" ASSET ",'buffers':[{'byteLength':76}]}", ERROR_INVALID_SCENE,
         "buffer 0: byteLength is 76, its data has 72"},
    };
    CHECK_REFUSALS(refusals);
}

#define SPARSE(members) \
    ACCESSOR_0("'bufferView':0,'componentType':5126,'count':3,'type':'VEC3','sparse':{" members "}")

static void sparse_parts_outside_their_accessor_are_refused(void **state)
{
    (void)state;
    const struct refusal refusals[] = {
        {SPARSE("'count':4,'indices':{'bufferView':3,'componentType':5123},"
                "'values':{'bufferView':0}"),
         ERROR_INVALID_SCENE, "accessor 0: 4 sparse elements of 3"},
        {SPARSE("'count':-1,'indices':{'bufferView':3,'componentType':5123},"
                "'values':{'bufferView':0}"),
         ERROR_INVALID_SCENE, "accessors[0].sparse.count must be a whole number, not negative"},
        {SPARSE("'count':3,'indices':{'bufferView':3,'componentType':5123},"
                "'values':{'bufferView':0}"),
         ERROR_INVALID_SCENE, "buffer view 3"},
        {SPARSE("'count':2,'indices':{'bufferView':3,'componentType':5123},"
                "'values':{'bufferView':2,'byteOffset':4}"),
         ERROR_INVALID_SCENE, "buffer view 2"},
        {SPARSE("'count':2,'indices':{'bufferView':3,'componentType':5126},"
                "'values':{'bufferView':0}"),
         ERROR_INVALID_SCENE, "sparse indices of component type 5126"},
        {SPARSE("'count':2,'indices':{'bufferView':1,'componentType':5123,'byteOffset':4},"
                "'values':{'bufferView':0}"),
         ERROR_INVALID_SCENE, "sparse index 0 at 1 is not increasing"},
        {SPARSE("'count':1,'indices':{'bufferView':0,'componentType':5123,'byteOffset':14},"
                "'values':{'bufferView':0}"),
         ERROR_INVALID_SCENE, "sparse index 16256 at 0"},
        {SPARSE("'count':1,'indices':{'bufferView':3,'componentType':5123,'byteOffset':-2},"
                "'values':{'bufferView':0}"),
         ERROR_INVALID_SCENE,
         "accessors[0].sparse.indices.byteOffset must be a whole number, not negative"},
    };
    CHECK_REFUSALS(refusals);
}

static void indices_of_every_kind_are_checked(void **state)
{
    (void)state;
    const struct refusal refusals[] = {
        {"{" ASSET ",'scene':1,'scenes':[{'nodes':[]}]}", ERROR_INVALID_SCENE, "no scene 1"},
        {"{" ASSET ",'scenes':[{'nodes':[5]}]}", ERROR_INVALID_SCENE, "no node 5"},
        {"{" ASSET ",'scenes':[{'nodes':[0]}],'nodes':[{'mesh':2}]}", ERROR_INVALID_SCENE,
         "no mesh 2"},
        {"{" ASSET ",'scenes':[{'nodes':[0]}],'nodes':[{'camera':2,'name':'C'}]}",
         ERROR_INVALID_SCENE, "node 0 'C': there is no camera 2"},
        {"{" ASSET ",'scenes':[{'nodes':[0]}],'nodes':[{'extensions':{'KHR_lights_punctual':"
         "{'light':4}}}]}",
         ERROR_INVALID_SCENE, "no light 4"},
        {"{" ASSET ",'scenes':[{'nodes':[0]}],'nodes':[{'extensions':{'KHR_lights_punctual':"
         "{'light':-1}}}]}",
         ERROR_INVALID_SCENE,
         "nodes[0].extensions.KHR_lights_punctual.light must be a whole number, not negative"},
        {"{" ASSET ",'scenes':[{'nodes':[0]}],'nodes':[{'extensions':{'KHR_lights_punctual':"
         "{'light':-4}}}]}",
         ERROR_INVALID_SCENE, "not negative"},
        {"{" ASSET ",'scenes':[{'nodes':[0]}],'nodes':[{'extensions':{'KHR_lights_punctual':"
         "{'light':'a'}}}]}",
         ERROR_INVALID_SCENE, "must be a whole number"},
        {"{" ASSET ",'skins':[{'joints':[-1]}]}", ERROR_INVALID_SCENE, "skins: "},
        {"{" ASSET ",'skins':[{'joints':0}]}", ERROR_INVALID_SCENE, "skins: "},
        {"{" ASSET "," VIEWS "," ACCESSORS "," SCENE
         ",'meshes':[{'primitives':[{'attributes':{'POSITION':0},'material':1}]}]}",
         ERROR_INVALID_SCENE, "no material 1"},
        {"{" ASSET "," VIEWS "," ACCESSORS "," SCENE
         ",'meshes':[{'primitives':[{'attributes':{'POSITION':7}}]}]}",
         ERROR_INVALID_SCENE, "no accessor 7"},
        {"{" ASSET "," VIEWS "," ACCESSORS "," SCENE
         ",'meshes':[{'primitives':[{'attributes':{'POSITION':0},'indices':7}]}]}",
         ERROR_INVALID_SCENE, "there is no accessor 7"},
        {"{" ASSET "," VIEWS "," ACCESSORS "," SCENE
         ",'meshes':[{'primitives':[{'attributes':{'POSITION':0},'mode':7}]}]}",
         ERROR_INVALID_SCENE, "mode is 7"},
        {"{" ASSET "," VIEWS "," ACCESSORS "," SCENE
         ",'meshes':[{'primitives':[{'attributes':{'POSITION':0},'indices':2}]}]}",
         ERROR_INVALID_SCENE, "element type that indices cannot have"},
        {"{" ASSET ",'materials':[{'emissiveTexture':{'index':3}}]}", ERROR_INVALID_SCENE,
         "material 0 '': emissiveTexture: there is no texture 3"},
        {"{" ASSET ",'textures':[{'source':3}],'materials':[{'emissiveTexture':{'index':0}}]}",
         ERROR_INVALID_SCENE, "no image 3"},
        {"{" ASSET ",'textures':[{'sampler':3}]}", ERROR_INVALID_SCENE, "no sampler 3"},
        {"{" ASSET ",'textures':[{'sampler':0}],'samplers':[{'wrapS':1}]}", ERROR_INVALID_SCENE,
         "sampler 0: unknown wrap 1"},
        {"{" ASSET ",'textures':[{'sampler':0}],'samplers':[{'magFilter':9984}]}",
         ERROR_INVALID_SCENE, "sampler 0: unknown filter 9984"},
    };
    CHECK_REFUSALS(refusals);
}

/* They change no picture; tests/unit/test_scene_deform.c has those that do. */
static void skins_that_nothing_shows_may_be_broken(void **state)
{
    (void)state;
    static const char *const skins[] = {
        "{'joints':[0]}",
        "{}",
        "{'joints':[0,9,8]}",
        "{'joints':[4294967296]}",
        "{'joints':[0],'inverseBindMatrices':7}",
    };
    for (size_t i = 0; i < sizeof skins / sizeof skins[0]; i++) {
        struct imported_scene imported;
        struct error err = {0};
        char json[2000];
        snprintf(json, sizeof json,
                 "{" ASSET "," VIEWS "," ACCESSORS "," MESH
                 ",'scenes':[{'nodes':[0]}],'nodes':[{'mesh':0},{'mesh':0,'skin':0}],'skins':[%s]}",
                 skins[i]);
        if (!imported_scene_make(&imported, json, &bin, sizeof bin, &err))
            fail_msg("%s: %s", skins[i], err.message);
        assert_int_equal(imported.scene.skin_count, 0);
        imported_scene_finish(&imported);
    }
}

/* tinygltf would take the default for each of them. */
static void members_of_a_wrong_type_are_refused_by_name(void **state)
{
    (void)state;
    const struct refusal refusals[] = {
        {"{" ASSET ",'nodes':[{'scale':[1,1,1]},{'scale':['a',1,1]}]}", ERROR_INVALID_SCENE,
         "nodes[1].scale[0] must be a number"},
        {"{" ASSET ",'nodes':[{'scale':[1,1]}]}", ERROR_INVALID_SCENE,
         "nodes[0].scale must be 3 numbers"},
        {"{" ASSET ",'nodes':[{'matrix':1}]}", ERROR_INVALID_SCENE,
         "nodes[0].matrix must be an array"},
        {"{" ASSET ",'nodes':[{'translation':null}]}", ERROR_INVALID_SCENE,
         "nodes[0].translation must be an array"},
        {"{" ASSET ",'nodes':[{'children':[-1]}]}", ERROR_INVALID_SCENE,
         "nodes[0].children[0] must be a whole number, not negative"},
        {"{" ASSET ",'nodes':[{'mesh':1.5}]}", ERROR_INVALID_SCENE,
         "nodes[0].mesh must be a whole number, not negative"},
        {"{" ASSET ",'nodes':[{'name':7}]}", ERROR_INVALID_SCENE, "nodes[0].name must be a string"},
        {"{" ASSET ",'nodes':[7]}", ERROR_INVALID_SCENE, "nodes[0] must be an object"},
        {"{" ASSET ",'nodes':{}}", ERROR_INVALID_SCENE, "nodes must be an array"},
        {"{" ASSET ",'scene':'0'}", ERROR_INVALID_SCENE, "scene must be a whole number"},
        {"{" ASSET ",'scenes':[{'nodes':['0']}]}", ERROR_INVALID_SCENE,
         "scenes[0].nodes[0] must be a whole number, not negative"},
        {"{" ASSET ",'bufferViews':[{'buffer':0,'byteOffset':-4,'byteLength':36}]}",
         ERROR_INVALID_SCENE, "bufferViews[0].byteOffset must be a whole number, not negative"},
        {"{" ASSET ",'accessors':[{'normalized':1}]}", ERROR_INVALID_SCENE,
         "accessors[0].normalized must be true or false"},
        {"{" ASSET ",'materials':[{'doubleSided':'true'}]}", ERROR_INVALID_SCENE,
         "materials[0].doubleSided must be true or false"},
        {"{" ASSET ",'materials':[{'pbrMetallicRoughness':{'baseColorFactor':[1,1,1]}}]}",
         ERROR_INVALID_SCENE,
         "materials[0].pbrMetallicRoughness.baseColorFactor must be 4 numbers"},
        {"{" ASSET ",'materials':[{'pbrMetallicRoughness':{'baseColorTexture':3}}]}",
         ERROR_INVALID_SCENE,
         "materials[0].pbrMetallicRoughness.baseColorTexture must be an object"},
        {"{" ASSET ",'meshes':[{'primitives':[{'attributes':{'POSITION':'0'}}]}]}",
         ERROR_INVALID_SCENE,
         "meshes[0].primitives[0].attributes.POSITION must be a whole number, not negative"},
        {"{" ASSET ",'cameras':[{'type':'perspective','perspective':{'yfov':true}}]}",
         ERROR_INVALID_SCENE, "cameras[0].perspective.yfov must be a number"},
        {"{" ASSET ",'extensionsRequired':[3]}", ERROR_INVALID_SCENE,
         "extensionsRequired[0] must be a string"},
    };
    CHECK_REFUSALS(refusals);
}

static void broken_hierarchies_are_refused(void **state)
{
    (void)state;
    const struct refusal refusals[] = {
        {"{" ASSET ",'nodes':[{'children':[1]},{'children':[0]}],'scenes':[{'nodes':[]}]}",
         ERROR_INVALID_SCENE, "cycle (at node"},
        {"{" ASSET ",'nodes':[{'children':[0]}],'scenes':[{'nodes':[0]}]}", ERROR_INVALID_SCENE,
         "cycle (at node 0)"},
        {"{" ASSET ",'nodes':[{'children':[2]},{'children':[2]},{}]}", ERROR_INVALID_SCENE,
         "node 2 is a child of node 0 and of node 1"},
        {"{" ASSET ",'nodes':[{'children':[1,1]},{}]}", ERROR_INVALID_SCENE,
         "node 1 is a child of node 0 and of node 0"},
        {"{" ASSET ",'nodes':[{'children':[4]}]}", ERROR_INVALID_SCENE, "no node 4"},
        {"{" ASSET ",'nodes':[{},{}],'scenes':[{'nodes':[0,0]}]}", ERROR_INVALID_SCENE,
         "lists node 0 twice"},
        {"{" ASSET ",'nodes':[{'children':[1]},{}],'scenes':[{'nodes':[1]}]}", ERROR_INVALID_SCENE,
         "node 1 is no root"},
    };
    CHECK_REFUSALS(refusals);
}

static void a_hierarchy_too_deep_is_refused(void **state)
{
    (void)state;
    enum { DEPTH = 5000 };
    char *json = malloc(DEPTH * 32 + 200), *at = json;
    at += sprintf(at, "{" ASSET ",'scenes':[{'nodes':[0]}],'nodes':[");
    for (int i = 1; i < DEPTH; i++)
        at += sprintf(at, "{'children':[%d]},", i);
    strcpy(at, "{}]}");
    struct error err;
    assert_int_equal(import_bin(json, &bin, &err), ERROR_TOO_LARGE);
    assert_non_null(strstr(err.message, "deeper than 4096"));
    free(json);
}

static void numbers_that_are_not_finite_are_refused(void **state)
{
    (void)state;
    const struct refusal refusals[] = {
        {"{" ASSET ",'scenes':[{'nodes':[0]}],'nodes':[{'translation':[1e999,0,0]}]}",
         ERROR_INVALID_SCENE, "glTF"},
        {"{" ASSET ",'scenes':[{'nodes':[0]}],'nodes':[{'scale':[1e300,1,1]}]}",
         ERROR_INVALID_SCENE, "node 0 '': its world matrix is not finite"},
        {"{" ASSET ",'scenes':[{'nodes':[0]}],'nodes':[{'rotation':[0,0,0,0]}]}",
         ERROR_INVALID_SCENE, "rotation has no direction"},
        {"{" ASSET ",'scenes':[{'nodes':[0]}],'nodes':[{'matrix':[1,2,3]}]}", ERROR_INVALID_SCENE,
         "nodes[0].matrix must be 16 numbers"},
        {"{" ASSET ",'scenes':[{'nodes':[0]}],'nodes':[{'matrix':[1,0,0,1,0,1,0,0,0,0,1,0,0,0,0,"
         "1]}]}",
         ERROR_INVALID_SCENE, "matrix is not affine"},
        {"{" ASSET "," VIEWS "," ACCESSORS "," MESH ",'scenes':[{'nodes':[0]}],'nodes':[{'mesh':0,"
         "'translation':[1e13,0,0]}]}",
         ERROR_INVALID_SCENE, "limit is 1e+12"},
    };
    CHECK_REFUSALS(refusals);
    const float bad[] = {NAN, INFINITY, -INFINITY};
    for (int i = 0; i < 3; i++) {
        struct corner_bin data = bin;
        struct error err;
        data.positions[1][2] = bad[i];
        assert_int_equal(import_bin(GOOD, &data, &err), ERROR_INVALID_SCENE);
        assert_non_null(strstr(err.message, "accessor 0: element 1 is not finite"));
    }
}

static void material_factors_outside_their_range_are_refused_by_name(void **state)
{
    (void)state;
#define MATERIAL(members) "{" ASSET ",'materials':[{'name':'Pane'," members "}]}"
    const struct refusal refusals[] = {
        {MATERIAL("'pbrMetallicRoughness':{'baseColorFactor':[2,1,1,1]}"), ERROR_INVALID_SCENE,
         "material 0 'Pane': baseColorFactor is 2"},
        {MATERIAL("'pbrMetallicRoughness':{'baseColorFactor':[1,1,1,-0.5]}"), ERROR_INVALID_SCENE,
         "baseColorFactor is -0.5"},
        {MATERIAL("'pbrMetallicRoughness':{'baseColorFactor':[1,1]}"), ERROR_INVALID_SCENE,
         "baseColorFactor"},
        {MATERIAL("'extensions':{'KHR_materials_transmission':{'transmissionFactor':1.5}}"),
         ERROR_INVALID_SCENE, "material 0 'Pane': transmissionFactor is 1.5"},
        {MATERIAL("'extensions':{'KHR_materials_ior':{'ior':0.5}}"), ERROR_INVALID_SCENE,
         "ior is 0.5"},
        {MATERIAL("'extensions':{'KHR_materials_volume':{'attenuationDistance':0}}"),
         ERROR_INVALID_SCENE, "attenuationDistance is 0"},
        {MATERIAL("'extensions':{'KHR_materials_volume':{'attenuationColor':[1,2,1]}}"),
         ERROR_INVALID_SCENE, "attenuationColor is 2"},
        {MATERIAL("'extensions':{'KHR_materials_volume':{'thicknessFactor':-1}}"),
         ERROR_INVALID_SCENE, "thicknessFactor is -1"},
        {MATERIAL("'extensions':{'KHR_materials_specular':{'specularFactor':2}}"),
         ERROR_INVALID_SCENE, "specularFactor is 2"},
        {MATERIAL("'extensions':{'KHR_materials_specular':{'specularColorFactor':[1,-1,1]}}"),
         ERROR_INVALID_SCENE, "specularColorFactor is -1"},
        {MATERIAL("'extensions':{'KHR_materials_clearcoat':{'clearcoatFactor':1e300}}"),
         ERROR_INVALID_SCENE, "clearcoatFactor is 1e+300"},
        {MATERIAL("'extensions':{'KHR_materials_clearcoat':{'clearcoatRoughnessFactor':-1}}"),
         ERROR_INVALID_SCENE, "clearcoatRoughnessFactor is -1"},
        {MATERIAL("'extensions':{'KHR_materials_sheen':{'sheenColorFactor':[1,1]}}"),
         ERROR_INVALID_SCENE,
         "materials[0].extensions.KHR_materials_sheen.sheenColorFactor must be 3 numbers"},
        {MATERIAL("'extensions':{'KHR_materials_sheen':{'sheenRoughnessFactor':3}}"),
         ERROR_INVALID_SCENE, "sheenRoughnessFactor is 3"},
        {MATERIAL("'extensions':{'KHR_materials_iridescence':{'iridescenceFactor':1.5}}"),
         ERROR_INVALID_SCENE, "iridescenceFactor is 1.5"},
        {MATERIAL("'extensions':{'KHR_materials_iridescence':{'iridescenceIor':0.9}}"),
         ERROR_INVALID_SCENE, "iridescenceIor is 0.9"},
        {MATERIAL("'extensions':{'KHR_materials_iridescence':{'iridescenceThicknessMinimum':-1}}"),
         ERROR_INVALID_SCENE, "iridescenceThicknessMinimum is -1"},
        {MATERIAL("'extensions':{'KHR_materials_anisotropy':{'anisotropyStrength':-0.5}}"),
         ERROR_INVALID_SCENE, "anisotropyStrength is -0.5"},
        {MATERIAL("'extensions':{'KHR_materials_dispersion':{'dispersion':-1}}"),
         ERROR_INVALID_SCENE, "dispersion is -1"},
        {MATERIAL("'extensions':{'KHR_materials_diffuse_transmission':{"
                  "'diffuseTransmissionFactor':2}}"),
         ERROR_INVALID_SCENE, "diffuseTransmissionFactor is 2"},
        {MATERIAL("'extensions':{'KHR_materials_diffuse_transmission':{"
                  "'diffuseTransmissionColorFactor':[0,0,-1]}}"),
         ERROR_INVALID_SCENE, "diffuseTransmissionColorFactor is -1"},
        {MATERIAL("'alphaMode':'GLOW'"), ERROR_INVALID_SCENE, "alphaMode is 'GLOW'"},
        {MATERIAL("'emissiveFactor':[-1,0,0]"), ERROR_INVALID_SCENE, "emissiveFactor is -1"},
        {MATERIAL("'extras':{'vitrail':{'pass_through':{'model':'fog'}}}"), ERROR_INVALID_SCENE,
         "pass_through.model is 'fog'"},
        {MATERIAL("'extras':{'vitrail':{'pass_through':{}}}"), ERROR_NONE, ""},
    };
    CHECK_REFUSALS(refusals);
}

static void lights_and_cameras_out_of_range_are_refused(void **state)
{
    (void)state;
#define LIGHT(members) \
    "{" ASSET ",'extensions':{'KHR_lights_punctual':{'lights':[{'name':'L'," members "}]}}}"
    const struct refusal refusals[] = {
        {LIGHT("'type':'laser'"), ERROR_INVALID_SCENE, "light 0 'L': type is 'laser'"},
        {LIGHT("'type':'point','intensity':-1"), ERROR_INVALID_SCENE, "intensity is -1"},
        {LIGHT("'type':'point','range':-1"), ERROR_INVALID_SCENE, "range is -1"},
        {LIGHT("'type':'point','color':[1,1]"), ERROR_INVALID_SCENE,
         "extensions.KHR_lights_punctual.lights[0].color must be 3 numbers"},
        {LIGHT("'type':'spot','spot':{'outerConeAngle':3}"), ERROR_INVALID_SCENE,
         "outerConeAngle is 3"},
        {LIGHT("'type':'spot','spot':{'innerConeAngle':1,'outerConeAngle':0.5}"),
         ERROR_INVALID_SCENE, "wider than outerConeAngle"},
        {"{" ASSET ",'cameras':[{'type':'perspective','perspective':{'yfov':4,'znear':1}}]}",
         ERROR_INVALID_SCENE, "yfov is 4"},
        {"{" ASSET ",'cameras':[{'type':'perspective','perspective':{'yfov':1,'znear':0}}]}",
         ERROR_INVALID_SCENE, "znear is 0"},
        {"{" ASSET ",'cameras':[{'type':'perspective','perspective':{'yfov':1,'znear':2,"
         "'zfar':1}}]}",
         ERROR_INVALID_SCENE, "zfar 1 is not beyond znear 2"},
        {"{" ASSET ",'cameras':[{'type':'orthographic','orthographic':{'xmag':0,'ymag':1,'znear':0,"
         "'zfar':1}}]}",
         ERROR_INVALID_SCENE, "xmag is 0"},
    };
    CHECK_REFUSALS(refusals);
}

static void uris_never_lead_out_of_the_upload(void **state)
{
    (void)state;
#define URI(uri) "{" ASSET ",'buffers':[{'byteLength':1,'uri':'" uri "'}]}"
    const struct refusal refusals[] = {
        {URI("../secret.bin"), ERROR_INVALID_SCENE, "'../secret.bin' leads out of the upload"},
        {URI("a/../../secret.bin"), ERROR_INVALID_SCENE, "leads out of the upload"},
        {URI("%2e%2E/secret.bin"), ERROR_INVALID_SCENE, "'%2e%2E/secret.bin' leads out"},
        {URI("/etc/passwd"), ERROR_INVALID_SCENE, "'/etc/passwd' is an absolute path"},
        {URI("%2Fetc/passwd"), ERROR_INVALID_SCENE, "is an absolute path"},
        {URI("file:///etc/passwd"), ERROR_INVALID_SCENE, "'file:///etc/passwd' has a scheme"},
        {URI("http://127.0.0.1/x.bin"), ERROR_INVALID_SCENE, "has a scheme"},
        {URI("etc/passwd"), ERROR_INVALID_SCENE, "'etc/passwd' is not among the uploaded files"},
        {URI("a%zz"), ERROR_INVALID_SCENE, "badly escaped"},
        {URI("a%00.bin"), ERROR_INVALID_SCENE, "badly escaped"},
        {URI("a%"), ERROR_INVALID_SCENE, "badly escaped"},
        {URI("$(touch x)`id`"), ERROR_INVALID_SCENE, "is not among the uploaded files"},
        {URI("data:text/html,hello"), ERROR_INVALID_SCENE, "is not base64"},
        {URI("data:application/octet-stream;base64,AA!A"), ERROR_INVALID_SCENE, "is not base64"},
        {URI("data:;base64,"), ERROR_INVALID_SCENE, "byteLength is 1, its data has 0"},
        {URI("data:;base64,AA=="), ERROR_NONE, ""},
        {"{" ASSET ",'images':[{'uri':'../x.png'}],'textures':[{'source':0}],'materials':["
         "{'emissiveTexture':{'index':0}}]}",
         ERROR_INVALID_SCENE, "image 0 '../x.png': URI '../x.png' leads out"},
    };
    CHECK_REFUSALS(refusals);
}

#define IMAGE(uri)                                              \
    "{" ASSET ",'images':[{'name':'I','uri':'data:;base64," uri \
    "'}],'textures':[{'source':0}],'materials':[{'emissiveTexture':{'index':0}}]}"

static void broken_images_are_refused_by_name(void **state)
{
    (void)state;
    const struct refusal refusals[] = {
        {IMAGE(""), ERROR_INVALID_SCENE, "image 0 'I': the image is empty"},
        {IMAGE("AAAA"), ERROR_INVALID_SCENE, "image 0 'I': not an image"},
        {IMAGE("q0tUWCAyMLsNChoK"), ERROR_UNSUPPORTED, "image 0 'I': KTX2 images are not read"},
        {IMAGE("R0lGODlhAQABAAAAACw="), ERROR_UNSUPPORTED, "GIF images are not read"},
        {IMAGE("iVBORw0KGgo="), ERROR_INVALID_SCENE, "the PNG file is broken or cut off"},
        {IMAGE("/9j/4AAQSkZJRgAB"), ERROR_INVALID_SCENE, "the JPEG file is broken"},
        /* 60000 x 60000 pixels in 70 bytes: refused before anything is decoded */
        {IMAGE("iVBORw0KGgoAAAANSUhEUgAA6mAAAOpgCAYAAACA0nVCAAAACUlEQVR4nDMAAAAxADF/"
               "mEFyAAAAAElFTkSuQmCC"),
         ERROR_TOO_LARGE, "the image is 60000 x 60000, limit is 67108864 pixels"},
        /* 8000 x 8000 pixels of which 25 are there */
        {IMAGE("iVBORw0KGgoAAAANSUhEUgAAH0AAAB9ACAYAAAAG8a30AAAADElEQVR4nDMwoD0AALNxEsG7mMmHAAAAAEl"
               "FTkSuQmCC"),
         ERROR_INVALID_SCENE, "image 0 'I': png"},
        {"{" ASSET ",'images':[{'name':'I'}],'textures':[{'source':0}],'materials':["
         "{'emissiveTexture':{'index':0}}]}",
         ERROR_INVALID_SCENE, "image 0 'I': neither uri nor bufferView"},
        {"{" ASSET ",'images':[{'bufferView':5}],'textures':[{'source':0}],'materials':["
         "{'emissiveTexture':{'index':0}}]}",
         ERROR_INVALID_SCENE, "no buffer view 5"},
    };
    CHECK_REFUSALS(refusals);
}

static void required_extensions_that_are_not_known_are_named(void **state)
{
    (void)state;
    const struct refusal refusals[] = {
        {"{" ASSET ",'extensionsUsed':['ACME_glow'],'extensionsRequired':['ACME_glow']}",
         ERROR_UNSUPPORTED, "requires the extension ACME_glow"},
        {"{" ASSET ",'extensionsRequired':['KHR_materials_ior','KHR_materials_sheets'],"
         "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'indices':99}]}]}",
         ERROR_UNSUPPORTED, "KHR_materials_sheets"},
        {"{" ASSET ",'extensionsRequired':['KHR_materials_ior','KHR_texture_transform']}",
         ERROR_NONE, ""},
        {"{'asset':{'version':'1.0'}}", ERROR_UNSUPPORTED, "asset.version is '1.0'"},
        {"{'asset':{'version':'2.0','minVersion':'2.9'}}", ERROR_UNSUPPORTED, "minVersion"},
    };
    CHECK_REFUSALS(refusals);
}

static void malformed_json_is_refused(void **state)
{
    (void)state;
    const struct refusal refusals[] = {
        {"", ERROR_INVALID_SCENE, "glTF JSON, byte 0: an object is expected"},
        {"[]", ERROR_INVALID_SCENE, "an object is expected"},
        {"{", ERROR_INVALID_SCENE, "a string is expected"},
        {"{}", ERROR_INVALID_SCENE, "asset"},
        {"{" ASSET "} x", ERROR_INVALID_SCENE, "something follows the document"},
        {"{" ASSET ",'extras':{]}", ERROR_INVALID_SCENE, "brackets do not match"},
        {"{" ASSET ",'nodes':[{'mesh' 3}]}", ERROR_INVALID_SCENE, "glTF"},
        {"{" ASSET ",'nodes':[tru]}", ERROR_INVALID_SCENE, "glTF"},
        {"{" ASSET ",'buffers':[{'byteLength':1.5}]}", ERROR_INVALID_SCENE, "a whole number"},
        {"{" ASSET ",'buffers':[{'byteLength':-1}]}", ERROR_INVALID_SCENE, "a whole number"},
        {"{" ASSET ",'buffers':[{'byteLength':99999999999999999999999}]}", ERROR_INVALID_SCENE,
         "number too large"},
        {"{" ASSET ",'buffers':[],'buffers':[{}],'buffers':[{}]}", ERROR_INVALID_SCENE, "twice"},
        {"{" ASSET ",'buff\\u0065rs':[{}]}", ERROR_INVALID_SCENE, "a top-level key has an escape"},
        {"{" ASSET ",'images':[{'uri':'a\\ud800b'}]}", ERROR_INVALID_SCENE, "bad escape"},
        {"{" ASSET ",'images':[{'uri':'a\\u0000b'}]}", ERROR_INVALID_SCENE, "bad escape"},
        {"{" ASSET ",'images':[{'uri':'a\\qb'}]}", ERROR_INVALID_SCENE, "bad escape"},
        {"{" ASSET ",'images':[{'uri':'a\nb'}]}", ERROR_INVALID_SCENE, "control character"},
        {"{" ASSET ",'images':[{'uri':'a", ERROR_INVALID_SCENE, "a string does not end"},
        {"{" ASSET ",'images':[3]}", ERROR_INVALID_SCENE, "an object is expected"},
        {"{" ASSET ",'images':[{'name':'\xC0\xAF'}]}", ERROR_INVALID_SCENE, "not UTF-8"},
    };
    CHECK_REFUSALS(refusals);
}

static void json_too_deep_or_too_long_is_refused(void **state)
{
    (void)state;
    enum { DEPTH = 100000 };
    char *json = malloc(2 * DEPTH + 100);
    strcpy(json, "{" ASSET ",'extras':");
    size_t at = strlen(json);
    memset(json + at, '[', DEPTH);
    memset(json + at + DEPTH, ']', DEPTH);
    strcpy(json + at + 2 * DEPTH, "}");
    struct error err;
    assert_int_equal(import_bin(json, &bin, &err), ERROR_INVALID_SCENE);
    assert_non_null(strstr(err.message, "nested too deeply"));
    free(json);
    enum { VALUES = 9 << 20 };
    json = malloc(2 * VALUES + 100);
    strcpy(json, "{" ASSET ",'extras':[");
    at = strlen(json);
    for (size_t i = 0; i < VALUES; i++)
        memcpy(json + at + 2 * i, "0,", 2);
    strcpy(json + at + 2 * VALUES, "0]}");
    assert_int_equal(import_bin(json, &bin, &err), ERROR_TOO_LARGE);
    free(json);
}

static void a_scene_above_its_budget_is_refused(void **state)
{
    (void)state;
    size_t size;
    void *glb = glb_make(GOOD, &bin, sizeof bin, &size), *blob;
    struct scene_file file = {"", glb, size};
    struct scene_import_desc desc = {.files = &file, .file_count = 1, .max_blob_bytes = 500};
    struct error err = {0};
    assert_false(scene_import(&desc, &blob, &size, &err));
    assert_int_equal(err.code, ERROR_TOO_LARGE);
    assert_null(blob);
    free(glb);
}

static void uploads_without_one_root_are_refused(void **state)
{
    (void)state;
    struct scene_file files[] = {{"a.gltf", "{}", 2}, {"b.glb", "{}", 2}, {"c.txt", "x", 1}};
    struct imported_scene imported;
    struct error err = {0};
    assert_false(imported_scene_init(&imported, files, 3, &err));
    assert_non_null(strstr(err.message, "both 'a.gltf' and 'b.glb'"));
    memset(&err, 0, sizeof err);
    assert_false(imported_scene_init(&imported, files + 2, 1, &err));
    memset(&err, 0, sizeof err);
    assert_false(imported_scene_init(&imported, files, 0, &err));
    assert_non_null(strstr(err.message, "no file was uploaded"));
    memset(&err, 0, sizeof err);
    struct scene_file texts[] = {{"c.txt", "x", 1}, {"d.txt", "y", 1}};
    assert_false(imported_scene_init(&imported, texts, 2, &err));
    assert_non_null(strstr(err.message, "no .gltf or .glb file among the 2"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_intact_scene_is_imported),
        cmocka_unit_test(every_truncation_of_a_glb_is_refused),
        cmocka_unit_test(flipped_bits_never_crash),
        cmocka_unit_test(accessors_outside_their_bytes_are_refused),
        cmocka_unit_test(sparse_parts_outside_their_accessor_are_refused),
        cmocka_unit_test(indices_of_every_kind_are_checked),
        cmocka_unit_test(skins_that_nothing_shows_may_be_broken),
        cmocka_unit_test(members_of_a_wrong_type_are_refused_by_name),
        cmocka_unit_test(broken_hierarchies_are_refused),
        cmocka_unit_test(a_hierarchy_too_deep_is_refused),
        cmocka_unit_test(numbers_that_are_not_finite_are_refused),
        cmocka_unit_test(material_factors_outside_their_range_are_refused_by_name),
        cmocka_unit_test(lights_and_cameras_out_of_range_are_refused),
        cmocka_unit_test(uris_never_lead_out_of_the_upload),
        cmocka_unit_test(broken_images_are_refused_by_name),
        cmocka_unit_test(required_extensions_that_are_not_known_are_named),
        cmocka_unit_test(malformed_json_is_refused),
        cmocka_unit_test(json_too_deep_or_too_long_is_refused),
        cmocka_unit_test(a_scene_above_its_budget_is_refused),
        cmocka_unit_test(uploads_without_one_root_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
