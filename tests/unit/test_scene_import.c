/* SPDX-License-Identifier: MIT */
/* scene_import: what becomes of valid glTF, feature by feature, on scenes written out here. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/image/image.h"
#include "tests/support/import_support.h"

/* The BIN chunk of most tests: a quad in the plane z = 0. */
struct quad {
    float positions[4][3]; /* view 0, accessor 0 */
    uint16_t indices[8];   /* view 1, accessor 1 (6 of them) */
    float texcoords[4][2]; /* view 2, accessor 2 */
    int8_t normals[4][4];  /* view 3, accessor 3: normalised bytes, stride 4 */
    uint8_t colors[4][4];  /* view 4, accessor 4: RGB in normalised bytes, stride 4 */
    uint16_t sparse[2];    /* view 5 */
    float replaced[1][3];  /* view 6 */
};

static const struct quad quad = {
    .positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}},
    .indices = {0, 1, 2, 2, 1, 3},
    .texcoords = {{0, 1}, {1, 1}, {0, 0}, {1, 0}},
    .normals = {{0, 0, 127}, {0, 0, 127}, {0, 127, 0}, {0, 0, 0}},
    .colors = {{255, 0, 51}, {0, 0, 0}, {0, 0, 0}, {255, 255, 255}},
    .sparse = {3, 0},
    .replaced = {{5, 6, 7}},
};

#define BUFFERS                                                                                    \
    "'asset':{'version':'2.0'},'buffers':[{'byteLength':144}],'bufferViews':["                     \
    "{'buffer':0,'byteOffset':0,'byteLength':48},{'buffer':0,'byteOffset':48,'byteLength':16},"    \
    "{'buffer':0,'byteOffset':64,'byteLength':32},"                                                \
    "{'buffer':0,'byteOffset':96,'byteLength':16,'byteStride':4},"                                 \
    "{'buffer':0,'byteOffset':112,'byteLength':16,'byteStride':4},"                                \
    "{'buffer':0,'byteOffset':128,'byteLength':4},{'buffer':0,'byteOffset':132,'byteLength':12}]," \
    "'accessors':[{'bufferView':0,'componentType':5126,'count':4,'type':'VEC3'},"                  \
    "{'bufferView':1,'componentType':5123,'count':6,'type':'SCALAR'},"                             \
    "{'bufferView':2,'componentType':5126,'count':4,'type':'VEC2'},"                               \
    "{'bufferView':3,'componentType':5120,'count':4,'type':'VEC3','normalized':true},"             \
    "{'bufferView':4,'componentType':5121,'count':4,'type':'VEC3','normalized':true},"             \
    "{'bufferView':0,'componentType':5126,'count':4,'type':'VEC3','sparse':{'count':1,"            \
    "'indices':{'bufferView':5,'componentType':5123},'values':{'bufferView':6}}}]"

#define ONE_NODE "'scene':0,'scenes':[{'nodes':[0]}],'nodes':[{'mesh':0,'name':'N'}]"

static struct imported_scene make(const char *json)
{
    struct imported_scene imported;
    struct error err = {0};
    if (!imported_scene_make(&imported, json, &quad, sizeof quad, &err))
        fail_msg("%s", err.message);
    return imported;
}

/* Imports one primitive with the given members. */
static struct imported_scene make_primitive(const char *members)
{
    char json[4096];
    snprintf(json, sizeof json, "{" BUFFERS "," ONE_NODE ",'meshes':[{'primitives':[{%s}]}]}",
             members);
    return make(json);
}

static void flat_normals_are_made_where_the_file_has_none(void **state)
{
    (void)state;
    struct imported_scene s = make_primitive("'attributes':{'POSITION':0},'indices':1");
    const struct scene_primitive *p = &s.scene.primitives[0];
    assert_int_equal(p->topology, SCENE_TRIANGLES);
    assert_int_equal(p->index_count, 6);
    assert_int_equal(p->vertex_count, 6);
    assert_int_equal(p->flags, SCENE_PRIMITIVE_HAS_NORMALS);
    for (int i = 0; i < 6; i++) {
        assert_true(s.scene.normals[3 * i] == 0 && s.scene.normals[3 * i + 1] == 0);
        assert_true(s.scene.normals[3 * i + 2] == 1);
    }
    assert_null(s.scene.colors);
    assert_int_equal(s.scene.header->triangle_count, 2);
    assert_int_equal(p->material, s.scene.material_count - 1);
    imported_scene_finish(&s);
}

static void normalised_strided_attributes_are_decoded(void **state)
{
    (void)state;
    struct imported_scene s = make_primitive(
        "'attributes':{'POSITION':0,'NORMAL':3,'TEXCOORD_0':2,'COLOR_0':4},'indices':1");
    const struct scene_primitive *p = &s.scene.primitives[0];
    assert_int_equal(p->vertex_count, 4);
    assert_true(s.scene.normals[2] == 1);
    assert_true(s.scene.normals[7] == 1);
    assert_true(s.scene.colors[0] == 1 && s.scene.colors[1] == 0 && s.scene.colors[3] == 1);
    assert_true(fabsf(s.scene.colors[2] - 0.2f) < 1e-6f);
    assert_memory_equal(s.scene.texcoords_0, quad.texcoords, sizeof quad.texcoords);
    /* vertex 3 brought a normal of zero length: it takes that of its triangle */
    assert_true(s.scene.normals[9] == 0 && s.scene.normals[11] == 1);
    assert_true(scene_has_warning(&s.scene, "1 normal of zero length"));
    imported_scene_finish(&s);
}

static void triangles_of_several_normals_are_smooth(void **state)
{
    (void)state;
    struct imported_scene s = make_primitive("'attributes':{'POSITION':0,'NORMAL':3},'indices':1");
    assert_true(s.scene.primitives[0].flags & SCENE_PRIMITIVE_IS_SMOOTH);
    imported_scene_finish(&s);
}

static void sparse_accessors_replace_elements(void **state)
{
    (void)state;
    struct imported_scene s = make_primitive("'attributes':{'POSITION':5},'mode':0");
    assert_int_equal(s.scene.primitives[0].topology, SCENE_POINTS);
    assert_memory_equal(s.scene.positions, quad.positions, 36);
    assert_memory_equal(s.scene.positions + 9, quad.replaced, 12);
    assert_true(s.scene.primitives[0].bounds_max[2] == 7);
    imported_scene_finish(&s);
}

static void vertices_that_no_index_uses_are_left_out(void **state)
{
    (void)state;
    struct imported_scene s = make_primitive("'attributes':{'POSITION':0},'indices':1,'mode':1");
    assert_int_equal(s.scene.primitives[0].topology, SCENE_LINES);
    assert_int_equal(s.scene.primitives[0].index_count, 6);
    assert_int_equal(s.scene.primitives[0].vertex_count, 4);
    assert_false(s.scene.primitives[0].flags & SCENE_PRIMITIVE_HAS_NORMALS);
    assert_true(s.scene.normals[0] == 0 && s.scene.normals[2] == 0);
    imported_scene_finish(&s);
}

/* Modes without indices over vertices 0 1 2 3. */
static void check_mode(int mode, uint32_t topology, const uint32_t *expected, uint32_t count)
{
    char members[64];
    snprintf(members, sizeof members, "'attributes':{'POSITION':0,'NORMAL':3},'mode':%d", mode);
    struct imported_scene s = make_primitive(members);
    const struct scene_primitive *p = &s.scene.primitives[0];
    assert_int_equal(p->topology, topology);
    assert_int_equal(p->index_count, count);
    for (uint32_t i = 0; i < count; i++) /* vertices may be renumbered: compare where they are */
        assert_memory_equal(&s.scene.positions[3 * s.scene.indices[i]], quad.positions[expected[i]],
                            12);
    imported_scene_finish(&s);
}

static void every_mode_unrolls_with_the_winding_of_the_specification(void **state)
{
    (void)state;
    check_mode(0, SCENE_POINTS, (uint32_t[]){0, 1, 2, 3}, 4);
    check_mode(1, SCENE_LINES, (uint32_t[]){0, 1, 2, 3}, 4);
    check_mode(2, SCENE_LINES, (uint32_t[]){0, 1, 1, 2, 2, 3, 3, 0}, 8);
    check_mode(3, SCENE_LINES, (uint32_t[]){0, 1, 1, 2, 2, 3}, 6);
    check_mode(4, SCENE_TRIANGLES, (uint32_t[]){0, 1, 2}, 3);
    check_mode(5, SCENE_TRIANGLES, (uint32_t[]){0, 1, 2, 1, 3, 2}, 6);
    check_mode(6, SCENE_TRIANGLES, (uint32_t[]){1, 2, 0, 2, 3, 0}, 6);
}

static void degenerate_triangles_are_left_out_and_counted(void **state)
{
    (void)state;
    struct quad q = quad;
    memcpy(q.indices, (uint16_t[8]){0, 1, 1, 2, 1, 3}, sizeof q.indices);
    struct imported_scene s;
    struct error err = {0};
    const char *json = "{" BUFFERS "," ONE_NODE
                       ",'meshes':[{'primitives':[{'attributes':{'POSITION':0},'indices':1}]}]}";
    assert_true(imported_scene_make(&s, json, &q, sizeof q, &err));
    assert_int_equal(s.scene.header->triangle_count, 1);
    assert_true(scene_has_warning(&s.scene, "1 triangle of zero area"));
    imported_scene_finish(&s);
    memcpy(q.indices, (uint16_t[8]){0, 1, 1, 2, 2, 3}, sizeof q.indices);
    assert_true(imported_scene_make(&s, json, &q, sizeof q, &err));
    assert_int_equal(s.scene.primitive_count, 0);
    assert_int_equal(s.scene.header->triangle_count, 0);
    assert_true(s.scene.header->bounds_min[0] > s.scene.header->bounds_max[0]);
    imported_scene_finish(&s);
}

static void world_matrices_compose_in_f64(void **state)
{
    (void)state;
    struct imported_scene s =
        make("{" BUFFERS ",'scene':0,'scenes':[{'nodes':[1]}],'nodes':[{'mesh':0,'name':'leaf',"
             "'translation':[0.001,0,0]},{'name':'root','children':[0,2],'translation':[1e7,0,0],"
             "'rotation':[0,0,0.7071067811865476,0.7071067811865476],'scale':[2,2,-2]},{'matrix':"
             "[1,0,0,0,0,1,0,0,0,0,1,0,3,4,5,1]}],'meshes':[{'primitives':[{'attributes':"
             "{'POSITION':0}}]}]}");
    assert_int_equal(s.scene.node_count, 3);
    int32_t leaf = scene_find_node(&s.scene, "leaf"), root = scene_find_node(&s.scene, "root");
    assert_int_equal(root, 0);
    assert_int_equal(s.scene.nodes[leaf].parent, root);
    assert_int_equal(s.scene.nodes[leaf].source_index, 0);
    const double *world = s.scene.nodes[leaf].world_matrix;
    assert_true(fabs(world[12] - 1e7) < 1e-8 && fabs(world[13] - 0.002) < 1e-12);
    assert_true(fabs(world[1] - 2) < 1e-12 && fabs(world[4] + 2) < 1e-12 && world[10] == -2);
    assert_true(s.scene.nodes[2].local_matrix[14] == 5);
    assert_int_equal(scene_find_node(&s.scene, "#2"), 2);
    assert_int_equal(scene_find_node(&s.scene, "#3"), -1);
    assert_int_equal(scene_find_node(&s.scene, "none"), -1);
    assert_true(fabs(s.scene.header->bounds_min[0] - (1e7 - 2)) < 1e-8);
    imported_scene_finish(&s);
}

static void only_the_default_scene_is_imported(void **state)
{
    (void)state;
    struct imported_scene s =
        make("{" BUFFERS ",'scene':1,'scenes':[{'nodes':[0]},{'nodes':[1]}],'nodes':[{'mesh':0},"
             "{'mesh':1,'name':'shown'}],'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]},"
             "{'name':'M','primitives':[{'attributes':{'POSITION':0}}]}]}");
    assert_int_equal(s.scene.node_count, 1);
    assert_int_equal(s.scene.mesh_count, 1);
    assert_string_equal(s.scene.strings + s.scene.nodes[0].name, "shown");
    assert_string_equal(s.scene.strings + s.scene.meshes[0].name, "M");
    imported_scene_finish(&s);
}

static void instances_count_each_time(void **state)
{
    (void)state;
    struct imported_scene s =
        make("{" BUFFERS ",'scenes':[{'nodes':[0,1]}],'nodes':[{'mesh':0},{'mesh':0,'translation':"
             "[0,0,9]}],'meshes':[{'primitives':[{'attributes':{'POSITION':0},'indices':1}]}]}");
    assert_int_equal(s.scene.mesh_count, 1);
    assert_int_equal(s.scene.header->triangle_count, 4);
    assert_true(s.scene.header->bounds_max[2] == 9);
    imported_scene_finish(&s);
}

#define MATERIAL(members) "{'asset':{'version':'2.0'},'materials':[{'name':'Glass'," members "}]}"

static void materials_carry_their_extensions(void **state)
{
    (void)state;
    struct imported_scene s = make(
        MATERIAL("'pbrMetallicRoughness':{'baseColorFactor':[0.1,0.2,0.3,0.4],'metallicFactor':0.5,"
                 "'roughnessFactor':0.25},'emissiveFactor':[1,0.5,0],'alphaMode':'MASK',"
                 "'alphaCutoff':0.75,'doubleSided':true,'extensions':{"
                 "'KHR_materials_emissive_strength':{'emissiveStrength':4},"
                 "'KHR_materials_transmission':{'transmissionFactor':0.9},"
                 "'KHR_materials_ior':{'ior':1.33},'KHR_materials_unlit':{},"
                 "'KHR_materials_volume':{'thicknessFactor':0.5,'attenuationDistance':2,"
                 "'attenuationColor':[0.9,0.8,0.7]}},'extras':{'vitrail':{'pass_through':{"
                 "'model':'edge','edge_color':[1,0,0],'edge_exponent':3}}}"));
    int32_t index = scene_find_material(&s.scene, "Glass");
    assert_int_equal(index, 0);
    assert_int_equal(s.scene.material_count, 2);
    const struct scene_material *m = &s.scene.materials[index];
    assert_true(m->base_color[0] == 0.1f && m->base_color[3] == 0.4f);
    assert_true(m->metallic == 0.5f && m->roughness == 0.25f);
    assert_true(m->emissive[0] == 4 && m->emissive[1] == 2 && m->emissive[2] == 0);
    assert_int_equal(m->alpha_mode, SCENE_MASK);
    assert_true(m->alpha_cutoff == 0.75f);
    assert_int_equal(m->flags, SCENE_MATERIAL_DOUBLE_SIDED | SCENE_MATERIAL_UNLIT);
    assert_true(m->transmission == 0.9f && m->ior == 1.33f && m->thickness == 0.5f);
    assert_true(m->attenuation_distance == 2 && m->attenuation_color[2] == 0.7f);
    assert_int_equal(m->pass_through, SCENE_PASS_EDGE);
    assert_true(m->edge_color[1] == 0 && m->edge_exponent == 3);
    assert_int_equal(m->textures[SCENE_TEXTURE_BASE_COLOR].texture, -1);
    const struct scene_material *fallback = &s.scene.materials[1];
    assert_true(fallback->base_color[3] == 1 && fallback->metallic == 1 && fallback->ior == 1.5f);
    assert_true(fallback->attenuation_distance == 0);
    imported_scene_finish(&s);
}

static void materials_carry_their_lobes(void **state)
{
    (void)state;
    struct imported_scene s = make(
        MATERIAL("'extensions':{"
                 "'KHR_materials_specular':{'specularFactor':0.5,'specularColorFactor':[1,2,0.25]},"
                 "'KHR_materials_clearcoat':{'clearcoatFactor':0.75,"
                 "'clearcoatRoughnessFactor':0.125},"
                 "'KHR_materials_sheen':{'sheenColorFactor':[1,0.5,0],"
                 "'sheenRoughnessFactor':0.25},"
                 "'KHR_materials_iridescence':{'iridescenceFactor':0.5,'iridescenceIor':1.5,"
                 "'iridescenceThicknessMaximum':650},"
                 "'KHR_materials_anisotropy':{'anisotropyStrength':0.5,'anisotropyRotation':-9},"
                 "'KHR_materials_diffuse_transmission':{'diffuseTransmissionFactor':0.5,"
                 "'diffuseTransmissionColorFactor':[1,0.5,0]},"
                 "'KHR_materials_dispersion':{'dispersion':0}}"));
    const struct scene_material *m = &s.scene.materials[0], *plain = &s.scene.materials[1];
    assert_int_equal(m->flags, SCENE_MATERIAL_SPECULAR);
    assert_true(m->specular == 0.5f && m->specular_color[1] == 2 && m->specular_color[2] == 0.25f);
    assert_true(m->clearcoat == 0.75f && m->clearcoat_roughness == 0.125f);
    assert_true(m->sheen_color[1] == 0.5f && m->sheen_roughness == 0.25f);
    assert_true(m->iridescence == 0.5f && m->film_ior == 1.5f);
    assert_true(m->film_nm[0] == 100 && m->film_nm[1] == 650 && plain->iridescence == 0);
    assert_true(m->anisotropy == 0.5f && m->anisotropy_rad == -9 && plain->anisotropy == 0);
    assert_true(m->diffuse_transmission == 0.5f && m->diffuse_transmission_color[1] == 0.5f);
    assert_true(plain->diffuse_transmission == 0);
    assert_true(plain->flags == 0 && plain->clearcoat == 0 && plain->sheen_color[0] == 0);
    assert_int_equal(s.scene.warning_count, 0);
    imported_scene_finish(&s);
    s = make(MATERIAL("'extensions':{'KHR_materials_dispersion':{'dispersion':0.5}}"));
    assert_int_equal(s.scene.warning_count, 0);
    assert_true(s.scene.materials[0].dispersion == 0.5f);
    imported_scene_finish(&s);
    s = make(MATERIAL("'extensions':{'KHR_materials_specular':{}}"));
    assert_true(s.scene.materials[0].specular == 1 && s.scene.materials[0].specular_color[2] == 1);
    imported_scene_finish(&s);
}

static void lights_and_cameras_are_carried_by_nodes(void **state)
{
    (void)state;
    struct imported_scene s = make(
        "{'asset':{'version':'2.0'},'extensionsUsed':['KHR_lights_punctual'],'extensions':{"
        "'KHR_lights_punctual':{'lights':[{'type':'directional','intensity':3},{'type':'spot',"
        "'name':'Lamp','color':[1,0.5,0],'intensity':40,'range':10,'spot':{'innerConeAngle':0.1,"
        "'outerConeAngle':0.5}},{'type':'point'}]}},'cameras':[{'type':'perspective','perspective':"
        "{'yfov':0.8,'znear':0.1}},{'type':'orthographic','name':'Plan','orthographic':{'xmag':2,"
        "'ymag':1,'znear':0,'zfar':100}}],'scenes':[{'nodes':[0,1]}],'nodes':[{'extensions':{"
        "'KHR_lights_punctual':{'light':1}}},{'camera':1}]}");
    assert_int_equal(s.scene.light_count, 3);
    assert_int_equal(s.scene.nodes[0].light, 1);
    assert_int_equal(s.scene.nodes[1].camera, 1);
    assert_int_equal(s.scene.header->default_camera_node, 1);
    const struct scene_light *lamp = &s.scene.lights[1];
    assert_int_equal(lamp->type, SCENE_LIGHT_SPOT);
    assert_true(lamp->color[1] == 0.5f && lamp->intensity == 40 && lamp->range == 10);
    assert_true(lamp->inner_cone_rad == 0.1f && lamp->outer_cone_rad == 0.5f);
    assert_true(s.scene.lights[2].intensity == 1 && s.scene.lights[2].range == 0);
    assert_true(s.scene.cameras[0].y_fov_rad == 0.8f && s.scene.cameras[0].z_far == 0);
    assert_true(s.scene.cameras[1].is_orthographic && s.scene.cameras[1].x_mag == 2);
    assert_string_equal(s.scene.strings + s.scene.cameras[1].name, "Plan");
    assert_true(s.scene.header->bounds_min[0] > s.scene.header->bounds_max[0]);
    imported_scene_finish(&s);
}

/* A 2 x 1 PNG: red opaque, green half transparent. */
static void *make_png(size_t *size)
{
    uint8_t pixels[8] = {255, 0, 0, 255, 0, 255, 0, 128};
    struct image image = {2, 1, 4, IMAGE_U8, pixels, {""}};
    struct error err = {0};
    void *bytes;
    assert_true(image_encode(&image, &(struct image_encode_desc){.format = IMAGE_FORMAT_PNG},
                             &bytes, size, &err));
    return bytes;
}

static bool import_with_png(struct imported_scene *s, const char *json, const char *file_name,
                            struct error *err)
{
    size_t png_bytes;
    void *png = make_png(&png_bytes);
    char *text = strdup(json);
    for (char *at = text; *at; at++)
        if (*at == '\'')
            *at = '"';
    struct scene_file files[] = {{"scenes/a.gltf", text, strlen(text)},
                                 {file_name, png, png_bytes}};
    bool is_done = imported_scene_init(s, files, 2, err);
    free(text);
    free(png);
    return is_done;
}

#define TEXTURED(uri)                                                                           \
    "{'asset':{'version':'2.0'},'images':[{'name':'I','uri':'" uri "'},{'uri':'missing.png'}]," \
    "'samplers':[{'magFilter':9728,'wrapS':33071}],'textures':[{'source':0,'sampler':0},"       \
    "{'source':0},{'source':1}],'materials':[{'pbrMetallicRoughness':{'baseColorTexture':{"     \
    "'index':0,'extensions':{'KHR_texture_transform':{'offset':[0.5,0.25],'scale':[2,4],"       \
    "'texCoord':1}}},'metallicRoughnessTexture':{'index':1}}}]}"

static void images_are_decoded_once_and_only_when_used(void **state)
{
    (void)state;
    struct imported_scene s;
    struct error err = {0};
    assert_true(import_with_png(&s, TEXTURED("../tex/my%20%C3%A9t\\u00e9+.png"),
                                "./tex//my \xC3\xA9t\xC3\xA9+.png", &err));
    assert_int_equal(s.scene.texture_count, 3);
    assert_int_equal(s.scene.image_count, 1);
    assert_int_equal(s.scene.textures[0].image, 0);
    assert_int_equal(s.scene.textures[1].image, 0);
    assert_int_equal(s.scene.textures[2].image, -1);
    assert_int_equal(s.scene.textures[0].mag_filter, 9728);
    assert_int_equal(s.scene.textures[0].wrap_s, 33071);
    assert_int_equal(s.scene.textures[1].min_filter, 9987);
    assert_int_equal(s.scene.images[0].width_px, 2);
    assert_memory_equal(s.scene.pixels, ((uint8_t[]){255, 0, 0, 255, 0, 255, 0, 128}), 8);
    const struct scene_texture_ref *ref = &s.scene.materials[0].textures[SCENE_TEXTURE_BASE_COLOR];
    assert_int_equal(ref->texcoord, 1);
    assert_memory_equal(ref->uv_transform, ((float[6]){2, 0, 0.5f, 0, 4, 0.25f}), 24);
    imported_scene_finish(&s);
}

static void a_texture_rotation_turns_the_image_clockwise(void **state)
{
    (void)state;
    struct imported_scene s;
    struct error err = {0};
    assert_true(import_with_png(
        &s,
        "{'asset':{'version':'2.0'},'images':[{'uri':'i.png'}],'textures':[{'source':0}],"
        "'materials':[{'emissiveTexture':{'index':0,'extensions':{'KHR_texture_transform':{"
        "'rotation':1.5707963267948966}}}}]}",
        "scenes/i.png", &err));
    const float *m = s.scene.materials[0].textures[SCENE_TEXTURE_EMISSIVE].uv_transform;
    /* v points down: the texel seen at the top right is then that of the bottom right before */
    float u = m[0] * 1 + m[1] * 0 + m[2], v = m[3] * 1 + m[4] * 0 + m[5];
    assert_true(fabsf(u) < 1e-6f && fabsf(v + 1) < 1e-6f);
    imported_scene_finish(&s);
}

static void unknown_optional_extensions_are_listed_and_ignored(void **state)
{
    (void)state;
    struct imported_scene s =
        make("{'asset':{'version':'2.0'},'extensionsUsed':['KHR_materials_ior','ACME_glow']}");
    assert_int_equal(s.scene.extension_used_count, 2);
    assert_int_equal(s.scene.extension_ignored_count, 1);
    assert_string_equal(s.scene.strings + s.scene.extensions_ignored[0], "ACME_glow");
    assert_true(scene_has_warning(&s.scene, "ACME_glow"));
    imported_scene_finish(&s);
}

static void equal_uploads_give_equal_blobs(void **state)
{
    (void)state;
    const char *members = "'attributes':{'POSITION':0,'TEXCOORD_0':2,'COLOR_0':4},'indices':1";
    struct imported_scene a = make_primitive(members), b = make_primitive(members);
    assert_int_equal(a.blob_bytes, b.blob_bytes);
    assert_memory_equal(a.blob, b.blob, a.blob_bytes);
    imported_scene_finish(&a);
    imported_scene_finish(&b);
}

static void an_empty_document_is_an_empty_scene(void **state)
{
    (void)state;
    struct imported_scene s = make("{'asset':{'version':'2.0'}}");
    assert_int_equal(s.scene.node_count, 0);
    assert_int_equal(s.scene.material_count, 1);
    assert_null(s.scene.positions);
    imported_scene_finish(&s);
}

static void a_node_without_a_name_is_called_as_its_mesh(void **state)
{
    (void)state;
    const char *primitives = "'primitives':[{'attributes':{'POSITION':0},'indices':1}]";
    char json[4096];
    snprintf(json, sizeof json,
             "{" BUFFERS ",'scene':0,'scenes':[{'nodes':[0,1,2,3,4,5]}],'nodes':[{'mesh':0},"
             "{'mesh':1},{'mesh':1,'name':'own'},{'mesh':2},{'name':'wheel'},{'mesh':3}],"
             "'meshes':[{'name':'piston',%s},{'name':'wheel',%s},{'name':'#1',%s},{%s}]}",
             primitives, primitives, primitives, primitives);
    struct imported_scene s = make(json);
    /* "wheel" stays the name of the one node that has it; "#1" stays an index. */
    const char *const expected[] = {"piston", "", "own", "", "wheel", ""};
    for (int i = 0; i < 6; i++)
        assert_string_equal(s.scene.strings + s.scene.nodes[i].name, expected[i]);
    assert_int_equal(scene_find_node(&s.scene, "piston"), 0);
    assert_int_equal(scene_find_node(&s.scene, "wheel"), 4);
    assert_int_equal(scene_find_node(&s.scene, "#1"), 1);
    imported_scene_finish(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_node_without_a_name_is_called_as_its_mesh),
        cmocka_unit_test(flat_normals_are_made_where_the_file_has_none),
        cmocka_unit_test(normalised_strided_attributes_are_decoded),
        cmocka_unit_test(triangles_of_several_normals_are_smooth),
        cmocka_unit_test(sparse_accessors_replace_elements),
        cmocka_unit_test(vertices_that_no_index_uses_are_left_out),
        cmocka_unit_test(every_mode_unrolls_with_the_winding_of_the_specification),
        cmocka_unit_test(degenerate_triangles_are_left_out_and_counted),
        cmocka_unit_test(world_matrices_compose_in_f64),
        cmocka_unit_test(only_the_default_scene_is_imported),
        cmocka_unit_test(instances_count_each_time),
        cmocka_unit_test(materials_carry_their_extensions),
        cmocka_unit_test(materials_carry_their_lobes),
        cmocka_unit_test(lights_and_cameras_are_carried_by_nodes),
        cmocka_unit_test(images_are_decoded_once_and_only_when_used),
        cmocka_unit_test(a_texture_rotation_turns_the_image_clockwise),
        cmocka_unit_test(unknown_optional_extensions_are_listed_and_ignored),
        cmocka_unit_test(equal_uploads_give_equal_blobs),
        cmocka_unit_test(an_empty_document_is_an_empty_scene),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
