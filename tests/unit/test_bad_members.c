/* SPDX-License-Identifier: MIT */
/* scene_import: a table of the members of all extensions that are read, and for each the values
 * that it cannot have: of a wrong type, out of range, not finite, of a wrong length, absent where
 * it is needed. Each is refused by its name and place, and what the table calls good is taken. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "renderer/import/extensions.h"
#include "tests/support/import_support.h"

/* Of an extension in the document. */
enum place {
    MATERIAL,
    TEXTURE_INFO,
    TEXTURE,
    PRIMITIVE,
    NODE,
    VIEW,
    DOCUMENT,
    EXTRAS, /* of the material: ours */
    PLACE_COUNT
};

enum kind { NUMBER, VECTOR, INDEX, BOOLEAN, TEXT, TEXTURE_REF, OBJECT };

struct member {
    enum place place;
    const char *extension, *name;
    enum kind kind;
    const char *good;      /* a value that is taken */
    double least, most;    /* NUMBER, VECTOR; infinite: none */
    const char *around[2]; /* of the extension: what stands before and after the member */
    bool is_needed;
    bool is_only_checked; /* what is good would need data that is not there */
};

#define NONE INFINITY
#define LIGHT                                                           \
    {                                                                   \
        "'lights':[{'type':'spot','spot':{'outerConeAngle':1.5},", "}]" \
    }
#define SPOT                                       \
    {                                              \
        "'lights':[{'type':'spot','spot':{", "}}]" \
    }

#define FACTOR(extension, name, good, least, most)                                            \
    {                                                                                         \
        MATERIAL, "KHR_materials_" extension, name, NUMBER, good, least, most, {NULL}, false, \
            false                                                                             \
    }
#define COLOR(extension, name, good, most)                                                      \
    {                                                                                           \
        MATERIAL, "KHR_materials_" extension, name, VECTOR, good, 0, most, {NULL}, false, false \
    }
#define TEXTURE_OF(extension, name)                                                           \
    {                                                                                         \
        MATERIAL, "KHR_materials_" extension, name, TEXTURE_REF, "{'index':0}", 0, 0, {NULL}, \
            false, false                                                                      \
    }

static const struct member members[] = {
    FACTOR("anisotropy", "anisotropyStrength", "0.5", 0, 1),
    FACTOR("anisotropy", "anisotropyRotation", "-9", -NONE, NONE),
    TEXTURE_OF("anisotropy", "anisotropyTexture"),
    FACTOR("clearcoat", "clearcoatFactor", "0.5", 0, 1),
    TEXTURE_OF("clearcoat", "clearcoatTexture"),
    FACTOR("clearcoat", "clearcoatRoughnessFactor", "0.5", 0, 1),
    TEXTURE_OF("clearcoat", "clearcoatRoughnessTexture"),
    TEXTURE_OF("clearcoat", "clearcoatNormalTexture"),
    {MATERIAL,
     "KHR_materials_clearcoat",
     "scale",
     NUMBER,
     "-1",
     -NONE,
     NONE,
     {"'clearcoatNormalTexture':{'index':0,", "}"},
     0,
     0},
    FACTOR("diffuse_transmission", "diffuseTransmissionFactor", "1", 0, 1),
    TEXTURE_OF("diffuse_transmission", "diffuseTransmissionTexture"),
    COLOR("diffuse_transmission", "diffuseTransmissionColorFactor", "[0,1,0.5]", 1),
    TEXTURE_OF("diffuse_transmission", "diffuseTransmissionColorTexture"),
    FACTOR("dispersion", "dispersion", "20", 0, NONE),
    FACTOR("emissive_strength", "emissiveStrength", "1e6", 0, NONE),
    FACTOR("ior", "ior", "0", 1, 100),
    FACTOR("iridescence", "iridescenceFactor", "1", 0, 1),
    TEXTURE_OF("iridescence", "iridescenceTexture"),
    FACTOR("iridescence", "iridescenceIor", "1", 1, 100),
    FACTOR("iridescence", "iridescenceThicknessMinimum", "0", 0, 1e6),
    FACTOR("iridescence", "iridescenceThicknessMaximum", "0", 0, 1e6),
    TEXTURE_OF("iridescence", "iridescenceThicknessTexture"),
    COLOR("sheen", "sheenColorFactor", "[1,0,0]", 1),
    TEXTURE_OF("sheen", "sheenColorTexture"),
    FACTOR("sheen", "sheenRoughnessFactor", "0", 0, 1),
    TEXTURE_OF("sheen", "sheenRoughnessTexture"),
    FACTOR("specular", "specularFactor", "0", 0, 1),
    TEXTURE_OF("specular", "specularTexture"),
    COLOR("specular", "specularColorFactor", "[2,1,1]", NONE),
    TEXTURE_OF("specular", "specularColorTexture"),
    FACTOR("transmission", "transmissionFactor", "1", 0, 1),
    TEXTURE_OF("transmission", "transmissionTexture"),
    {MATERIAL, "KHR_materials_unlit", NULL, OBJECT, "{}", 0, 0, {0}, 0, 0},
    FACTOR("volume", "thicknessFactor", "1", 0, NONE),
    TEXTURE_OF("volume", "thicknessTexture"),
    FACTOR("volume", "attenuationDistance", "1e300", 0, NAN),
    COLOR("volume", "attenuationColor", "[0,1,1]", 1),
    {TEXTURE_INFO, "KHR_texture_transform", "offset", VECTOR, "[-1,3]", -NONE, NONE, {0}, 0, 0},
    {TEXTURE_INFO, "KHR_texture_transform", "scale", VECTOR, "[-1,3]", -NONE, NONE, {0}, 0, 0},
    {TEXTURE_INFO, "KHR_texture_transform", "rotation", NUMBER, "-7", -NONE, NONE, {0}, 0, 0},
    {TEXTURE_INFO, "KHR_texture_transform", "texCoord", INDEX, "0", 0, NONE, {0}, 0, 0},
    {TEXTURE, "EXT_texture_webp", "source", INDEX, "0", 0, 0, {0}, 0, 0},
    {TEXTURE, "KHR_texture_basisu", "source", INDEX, "0", 0, NONE, {0}, 0, 0},
    {NODE, "KHR_node_visibility", "visible", BOOLEAN, "false", 0, 0, {0}, 0, 0},
    {NODE, "KHR_lights_punctual", "light", INDEX, "0", 0, 0, {0}, 1, 1},
    {NODE, "VITRAIL_density_grids", "grid", INDEX, "0", 0, 0, {0}, 1, 1},
    {NODE, "EXT_mesh_gpu_instancing", "attributes", OBJECT, "{'TRANSLATION':0}", 0, 0, {0}, 1, 0},
    {NODE,
     "EXT_mesh_gpu_instancing",
     "TRANSLATION",
     INDEX,
     "0",
     0,
     0,
     {"'attributes':{", "}"},
     0,
     0},
    {DOCUMENT, "KHR_lights_punctual", "type", TEXT, "'point'", 0, 0, {"'lights':[{", "}]"}, 1, 0},
    {DOCUMENT, "KHR_lights_punctual", "color", VECTOR, "[0,1,0]", 0, NONE, LIGHT, 0, 0},
    {DOCUMENT, "KHR_lights_punctual", "intensity", NUMBER, "0", 0, NONE, LIGHT, 0, 0},
    {DOCUMENT, "KHR_lights_punctual", "range", NUMBER, "1e300", 0, NAN, LIGHT, 0, 0},
    {DOCUMENT, "KHR_lights_punctual", "innerConeAngle", NUMBER, "0", 0, M_PI_2, SPOT, 0, 0},
    {DOCUMENT, "KHR_lights_punctual", "outerConeAngle", NUMBER, "1.5", 0, M_PI_2, SPOT, 0, 0},
    {DOCUMENT, "KHR_lights_punctual", "lights", OBJECT, "[]", 0, 0, {0}, 0, 0},
    {DOCUMENT, "KHR_materials_variants", "name", TEXT, "'v'", 0, 0, {"'variants':[{", "}]"}, 1, 0},
    {PRIMITIVE,
     "KHR_materials_variants",
     "material",
     INDEX,
     "0",
     0,
     0,
     {"'mappings':[{'variants':[],", "}]"},
     1,
     0},
    {PRIMITIVE,
     "KHR_materials_variants",
     "variants",
     OBJECT,
     "[]",
     0,
     0,
     {"'mappings':[{'material':0,", "}]"},
     1,
     0},
    {PRIMITIVE,
     "KHR_draco_mesh_compression",
     "bufferView",
     INDEX,
     "0",
     0,
     0,
     {"'attributes':{'POSITION':0},", ""},
     1,
     1},
    {PRIMITIVE,
     "KHR_draco_mesh_compression",
     "attributes",
     OBJECT,
     "{'POSITION':0}",
     0,
     0,
     {"'bufferView':0,", ""},
     1,
     1},
    {PRIMITIVE,
     "KHR_draco_mesh_compression",
     "POSITION",
     INDEX,
     "0",
     0,
     NONE,
     {"'bufferView':0,'attributes':{", "}"},
     0,
     1},
    {VIEW,
     "EXT_meshopt_compression",
     "buffer",
     INDEX,
     "0",
     0,
     0,
     {"'byteLength':9,'byteStride':12,"
      "'count':3,'mode':'ATTRIBUTES',",
      ""},
     1,
     1},
    {VIEW,
     "EXT_meshopt_compression",
     "byteOffset",
     INDEX,
     "0",
     0,
     0,
     {"'buffer':0,'byteLength':9,'byteStride':12,"
      "'count':3,'mode':'ATTRIBUTES',",
      ""},
     0,
     1},
    {VIEW,
     "EXT_meshopt_compression",
     "byteLength",
     INDEX,
     "9",
     0,
     0,
     {"'buffer':0,'byteStride':12,'count':3,'mode':'ATTRIBUTES',", ""},
     1,
     1},
    {VIEW,
     "EXT_meshopt_compression",
     "byteStride",
     INDEX,
     "12",
     0,
     0,
     {"'buffer':0,'byteLength':9,'count':3,'mode':'ATTRIBUTES',", ""},
     1,
     1},
    {VIEW,
     "EXT_meshopt_compression",
     "count",
     INDEX,
     "3",
     0,
     0,
     {"'buffer':0,'byteLength':9,'byteStride':12,'mode':'ATTRIBUTES',", ""},
     1,
     1},
    {VIEW,
     "KHR_meshopt_compression",
     "mode",
     TEXT,
     "'ATTRIBUTES'",
     0,
     0,
     {"'buffer':0,'byteLength':9,'byteStride':12,'count':3,", ""},
     1,
     1},
    {VIEW,
     "KHR_meshopt_compression",
     "filter",
     TEXT,
     "'NONE'",
     0,
     0,
     {"'buffer':0,'byteLength':9,'byteStride':12,"
      "'count':3,'mode':'ATTRIBUTES',",
      ""},
     0,
     1},
    {EXTRAS,
     "vitrail",
     "edge_color",
     VECTOR,
     "[0,0,1]",
     0,
     1,
     {"'pass_through':{'model':'edge',", "}"},
     0,
     0},
    {EXTRAS,
     "vitrail",
     "edge_exponent",
     NUMBER,
     "2",
     0,
     1000,
     {"'pass_through':{'model':'edge',", "}"},
     0,
     0},
    {EXTRAS, "vitrail", "model", TEXT, "'slab'", 0, 0, {"'pass_through':{", "}"}, 0, 0},
};

static const float corners[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};

/* A white pixel. */
#define PNG                                                                \
    "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAA" \
    "AACklEQVR42mP4DwABAQEAHLCMmQAAAABJRU5ErkJggg=="

static void write_document(char *out, size_t size, const struct member *m, const char *value)
{
    char object[1000], parts[PLACE_COUNT][1200] = {""};
    const char *before = m->around[0] ? m->around[0] : "", *after = m->around[1];
    if (!m->name)
        snprintf(object, sizeof object, "%s", value);
    else if (!value) /* absent, and so is the comma before or behind it */
        snprintf(object, sizeof object, "{%s'x':0%s}", before, after ? after : "");
    else
        snprintf(object, sizeof object, "{%s'%s':%s%s}", before, m->name, value,
                 after ? after : "");
    snprintf(parts[m->place], sizeof parts[0],
             m->place == EXTRAS ? ",'extras':{'%s':%s}" : ",'extensions':{'%s':%s}", m->extension,
             object);
    snprintf(out, size,
             "{'asset':{'version':'2.0'},'buffers':[{'byteLength':36}],'bufferViews':[{'buffer':0,"
             "'byteLength':36%s}],'accessors':[{'bufferView':0,'componentType':5126,'count':3,"
             "'type':'VEC3'}],'images':[{'uri':'" PNG "'}],'textures':[{'source':0%s}],"
             "'materials':[{'name':'Pane','pbrMetallicRoughness':{'baseColorTexture':{'index':0%s}}"
             "%s%s}],'meshes':[{'name':'Corner','primitives':[{'attributes':{'POSITION':0},"
             "'material':0%s}]}],'nodes':[{'mesh':0%s}],'scenes':[{'nodes':[0]}]%s}",
             parts[VIEW], parts[TEXTURE], parts[TEXTURE_INFO], parts[MATERIAL], parts[EXTRAS],
             parts[PRIMITIVE], parts[NODE], parts[DOCUMENT]);
}

/* Imports the document with this value; err says how it went. */
static void import(const struct member *m, const char *value, struct error *err)
{
    char json[12000];
    struct imported_scene s;
    memset(err, 0, sizeof *err);
    write_document(json, sizeof json, m, value);
    if (imported_scene_make(&s, json, corners, sizeof corners, err))
        imported_scene_finish(&s);
}

static size_t refused; /* so many values were tried */

/* The message tells what was wrong, and where: by the path in the document or by the element. */
static void check_refused(const struct member *m, const char *value)
{
    static const char *const elements[PLACE_COUNT] = {[MATERIAL] = "material 0 'Pane'",
                                                      [TEXTURE_INFO] = "material 0 'Pane'",
                                                      [TEXTURE] = "texture 0",
                                                      [PRIMITIVE] = "mesh 0 'Corner', primitive 0",
                                                      [NODE] = "node 0",
                                                      [VIEW] = "buffer view 0",
                                                      [DOCUMENT] = "light 0",
                                                      [EXTRAS] = "material 0 'Pane'"};
    struct error err;
    const char *name = m->name ? m->name : m->extension;
    import(m, value, &err);
    if (err.code != ERROR_INVALID_SCENE)
        fail_msg("%s, %s = %s: %s '%s'", m->extension, name, value ? value : "absent",
                 error_code_name(err.code), err.message);
    bool has_path = strstr(err.message, m->extension) && strstr(err.message, "[0]");
    bool has_element = strstr(err.message, elements[m->place]) != NULL;
    bool is_ours = m->place == DOCUMENT && strstr(err.message, m->extension);
    if (!(has_path || has_element || is_ours))
        fail_msg("%s, %s = %s: no place in '%s'", m->extension, name, value ? value : "absent",
                 err.message);
    bool has_name = strstr(err.message, name) != NULL;
    bool is_reference = m->kind == INDEX && (strstr(err.message, "there is no") ||
                                             strstr(err.message, "lie outside buffer") ||
                                             strstr(err.message, "2000000000 elements"));
    if (!has_name && !is_reference)
        fail_msg("%s, %s = %s: no name in '%s'", m->extension, name, value ? value : "absent",
                 err.message);
    refused++;
}

static void check_number(const struct member *m, double number)
{
    char value[64];
    if (m->kind == NUMBER)
        snprintf(value, sizeof value, "%.9g", number);
    else if (strchr(m->good, ',') == strrchr(m->good, ','))
        snprintf(value, sizeof value, "[0,%.9g]", number);
    else
        snprintf(value, sizeof value, "[0,0,%.9g]", number);
    check_refused(m, value);
}

static void check_range(const struct member *m)
{
    check_number(m, isinf(m->least) ? -1e300 : m->least - 0.01);
    if (!isnan(m->most))
        check_number(m, isinf(m->most) ? 1e300 : m->most * 1.01 + 0.01);
}

static void check_all(const struct member *m, const char *const *values)
{
    for (; *values; values++)
        check_refused(m, *values);
}

static void check_kind(const struct member *m)
{
    static const char *const numbers[] = {"'1'", "true",     "null",  "[1]",    "{}",
                                          "NaN", "Infinity", "1e999", "-1e999", NULL};
    static const char *const vectors[] = {"1",          "null",        "{}",        "[]",
                                          "[1]",        "['1',1,1]",   "[1,1,1,1]", "[1,NaN,1]",
                                          "[1,null,1]", "[1,1e999,1]", NULL};
    static const char *const indices[] = {
        "-1", "1.5", "'0'", "null", "true", "[0]", "{}", "4294967296", "99999999999999999999",
        NULL};
    static const char *const booleans[] = {"1", "0", "'true'", "null", "[]", NULL};
    static const char *const texts[] = {"1", "true", "null", "['a']", "{}", NULL};
    static const char *const references[] = {
        "0",
        "null",
        "[]",
        "'0'",
        "{}",
        "{'index':9}",
        "{'index':-1}",
        "{'index':0.5}",
        "{'index':4294967296}",
        "{'index':0,'texCoord':-1}",
        "{'index':0,'texCoord':'a'}",
        "{'index':0,'extensions':{'KHR_texture_transform':3}}",
        "{'index':0,'extensions':{'KHR_texture_transform':{'offset':[1]}}}",
        "{'index':0,'extensions':{'KHR_texture_transform':{'scale':[1e300,1]}}}",
        NULL};
    static const char *const objects[] = {"0", "null", "true", "'a'", NULL};
    switch (m->kind) {
    case NUMBER:
        check_all(m, numbers);
        check_range(m);
        break;
    case VECTOR:
        check_all(m, vectors);
        check_range(m);
        break;
    case INDEX:
        check_all(m, indices);
        if (m->most == 0) /* an index of something that has one element */
            check_refused(m, "2000000000");
        break;
    case BOOLEAN:
        check_all(m, booleans);
        break;
    case TEXT:
        check_all(m, texts);
        if (strcmp(m->name, "name") != 0) /* a name may be any, these have a few words */
            check_refused(m, "'never'");
        break;
    case TEXTURE_REF:
        check_all(m, references);
        break;
    case OBJECT:
        check_all(m, objects);
        if (m->name && strcmp(m->name, "attributes") == 0)
            check_refused(m, "{'POSITION':'a'}");
        break;
    }
}

static void values_that_no_member_can_have_are_refused_by_name_and_place(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof members / sizeof *members; i++) {
        check_kind(&members[i]);
        if (members[i].is_needed)
            check_refused(&members[i], NULL);
    }
    print_message("%zu values\n", refused);
    assert_true(refused > 500);
}

/* Else a document that is refused on other grounds would prove nothing. */
static void values_that_a_member_can_have_are_taken(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof members / sizeof *members; i++) {
        struct error err;
        import(&members[i], members[i].good, &err);
        if (!members[i].is_only_checked && err.code != ERROR_NONE)
            fail_msg("%s, %s = %s: '%s'", members[i].extension,
                     members[i].name ? members[i].name : "", members[i].good, err.message);
    }
}

/* The table would miss one that is added. */
static void the_table_has_every_extension(void **state)
{
    (void)state;
    for (const char *const *name = scene_import_passed_extensions(); *name; name++) {
        bool is_there = strcmp(*name, "KHR_mesh_quantization") == 0 || /* has no members */
                        strcmp(*name, "KHR_animation_pointer") == 0;   /* in an animation */
        for (size_t i = 0; i < sizeof members / sizeof *members; i++)
            is_there |= strcmp(*name, members[i].extension) == 0;
        if (!is_there)
            fail_msg("%s", *name);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_that_a_member_can_have_are_taken),
        cmocka_unit_test(the_table_has_every_extension),
        cmocka_unit_test(values_that_no_member_can_have_are_refused_by_name_and_place),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
