/* SPDX-License-Identifier: MIT */
/* The GLB builder: what it writes reads back, to the bit, and is the same every time. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <png.h>

#include "glb/glb_builder.h"
#include "tests/support/glb_reader.h"

static const float triangle[9] = {0, 0, 0, 1, 0, 0, 0, 0.1f, 0};

/* Finishes the builder and reads the result back; the caller frees *bytes. */
static struct glb_file finish(struct glb_builder *builder, void **bytes, size_t *size_bytes)
{
    struct error err = {0};
    struct glb_file file;
    char why[160] = "";
    if (!glb_builder_finish(builder, bytes, size_bytes, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    if (!glb_file_init(&file, *bytes, *size_bytes, why) || !glb_file_references_hold(&file, why))
        fail_msg("%s", why);
    return file;
}

static struct glb_builder *create(void)
{
    struct glb_builder *builder = glb_builder_create("Test", NULL);
    assert_non_null(builder);
    return builder;
}

static double number_at(const json_t *object, const char *path)
{
    const json_t *value = glb_member(object, path);
    assert_true(json_is_number(value));
    return json_number_value(value);
}

static void an_empty_scene_is_a_valid_container(void **state)
{
    (void)state;
    void *bytes;
    size_t size_bytes;
    struct glb_file file = finish(create(), &bytes, &size_bytes);
    assert_string_equal(json_string_value(glb_member(file.root, "asset.version")), "2.0");
    assert_string_equal(json_string_value(glb_member(file.root, "scenes.0.name")), "Test");
    assert_null(file.binary);
    glb_file_finish(&file);
    free(bytes);
}

static void node_numbers_survive_to_the_bit(void **state)
{
    (void)state;
    static const double values[] = {0.1,    1.0 / 3, -0.0, 1e7 + 1e-3,           6.02214076e23,
                                    5e-324, -2.5,    1e15, 123456789012345678.0, 1 + 0x1p-52,
                                    M_PI,   1e-300};
    struct glb_builder *builder = create();
    struct glb_node_desc node = {.name = "n", .has_matrix = true};
    for (int i = 0; i < 16; i++)
        node.matrix[i] = values[i % 12];
    assert_int_equal(glb_builder_add_node(builder, &node), 1);
    void *bytes;
    size_t size_bytes;
    struct glb_file file = finish(builder, &bytes, &size_bytes);
    const json_t *matrix = glb_member(file.root, "nodes.0.matrix");
    for (size_t i = 0; i < 16; i++) {
        double back = json_number_value(json_array_get(matrix, i));
        assert_memory_equal(&back, &node.matrix[i], sizeof back);
    }
    glb_file_finish(&file);
    free(bytes);
}

static void every_material_factor_is_written(void **state)
{
    (void)state;
    struct glb_builder *builder = create();
    static const uint8_t texel[4] = {1, 2, 3, 4};
    int image = glb_builder_add_image(builder, "i", texel, 1, 1);
    int texture = glb_builder_add_texture(builder, &(struct glb_texture_desc){.image = image});
    struct glb_texture_ref with = {.texture = texture};
    glb_builder_add_material(
        builder, &(struct glb_material_desc){.name = "m",
                                             .base_color = {0.1, 0.2, 0.3, 0.4},
                                             .metallic = 0.5,
                                             .roughness = 0.6,
                                             .emissive = {0.7, 0.8, 0.9},
                                             .emissive_strength = 11,
                                             .alpha_mode = GLB_MASK,
                                             .alpha_cutoff = 0.25,
                                             .is_double_sided = true,
                                             .is_unlit = true,
                                             .transmission = 0.95,
                                             .has_ior = true,
                                             .ior = 1.33,
                                             .thickness = 0.02,
                                             .attenuation_distance = 0.3,
                                             .attenuation_color = {0.15, 0.25, 0.35},
                                             .normal_scale = 2,
                                             .occlusion_strength = 0.5,
                                             .base_color_texture = {.texture = texture,
                                                                    .texcoord = 1,
                                                                    .has_transform = true,
                                                                    .offset = {0.5, 0.25},
                                                                    .rotation_rad = 0.75,
                                                                    .scale = {3, 4}},
                                             .metallic_roughness_texture = with,
                                             .normal_texture = with,
                                             .occlusion_texture = with,
                                             .emissive_texture = with,
                                             .transmission_texture = with,
                                             .thickness_texture = with,
                                             .pass_through = GLB_PASS_EDGE,
                                             .edge_color = {0.3, 0.2, 0.1},
                                             .edge_exponent = 1.5});
    void *bytes;
    size_t size_bytes;
    struct glb_file file = finish(builder, &bytes, &size_bytes);
    static const struct {
        const char *path;
        double value;
    } expected[] = {
        {"pbrMetallicRoughness.baseColorFactor.3", 0.4},
        {"pbrMetallicRoughness.metallicFactor", 0.5},
        {"pbrMetallicRoughness.roughnessFactor", 0.6},
        {"pbrMetallicRoughness.baseColorTexture.texCoord", 1},
        {"pbrMetallicRoughness.baseColorTexture.extensions.KHR_texture_transform.scale.1", 4},
        {"pbrMetallicRoughness.baseColorTexture.extensions.KHR_texture_transform.rotation", 0.75},
        {"pbrMetallicRoughness.metallicRoughnessTexture.index", 0},
        {"normalTexture.scale", 2},
        {"occlusionTexture.strength", 0.5},
        {"emissiveTexture.index", 0},
        {"emissiveFactor.2", 0.9},
        {"extensions.KHR_materials_emissive_strength.emissiveStrength", 11},
        {"alphaCutoff", 0.25},
        {"extensions.KHR_materials_transmission.transmissionFactor", 0.95},
        {"extensions.KHR_materials_transmission.transmissionTexture.index", 0},
        {"extensions.KHR_materials_ior.ior", 1.33},
        {"extensions.KHR_materials_volume.thicknessFactor", 0.02},
        {"extensions.KHR_materials_volume.thicknessTexture.index", 0},
        {"extensions.KHR_materials_volume.attenuationDistance", 0.3},
        {"extensions.KHR_materials_volume.attenuationColor.1", 0.25},
        {"extras.vitrail.pass_through.edge_color.0", 0.3},
        {"extras.vitrail.pass_through.edge_exponent", 1.5},
    };
    const json_t *material = glb_file_element(&file, "materials", 0);
    for (size_t i = 0; i < sizeof expected / sizeof *expected; i++)
        assert_true(number_at(material, expected[i].path) == expected[i].value);
    assert_true(json_is_true(glb_member(material, "doubleSided")));
    assert_non_null(glb_member(material, "extensions.KHR_materials_unlit"));
    assert_string_equal(json_string_value(glb_member(material, "alphaMode")), "MASK");
    assert_string_equal(
        json_string_value(glb_member(material, "extras.vitrail.pass_through.model")), "edge");
    assert_int_equal(json_array_size(glb_member(file.root, "extensionsUsed")), 6);
    glb_file_finish(&file);
    free(bytes);
}

static void an_image_keeps_its_pixels(void **state)
{
    (void)state;
    uint8_t rgba[5 * 3 * 4], back[5 * 3 * 4];
    for (size_t i = 0; i < sizeof rgba; i++)
        rgba[i] = (uint8_t)(i * 37);
    struct glb_builder *builder = create();
    assert_int_equal(glb_builder_add_image(builder, "i", rgba, 5, 3), 1);
    void *bytes;
    size_t size_bytes;
    struct glb_file file = finish(builder, &bytes, &size_bytes);
    const json_t *view = glb_file_element(&file, "bufferViews", 0);
    png_image png = {.version = PNG_IMAGE_VERSION};
    size_t offset = (size_t)number_at(view, "byteOffset");
    assert_true(png_image_begin_read_from_memory(&png, file.binary + offset,
                                                 (size_t)number_at(view, "byteLength")));
    assert_int_equal(png.width, 5);
    assert_int_equal(png.height, 3);
    png.format = PNG_FORMAT_RGBA;
    assert_true(png_image_finish_read(&png, NULL, back, 0, NULL));
    assert_memory_equal(back, rgba, sizeof rgba);
    glb_file_finish(&file);
    free(bytes);
}

static void a_mesh_keeps_its_vertices_and_states_its_bounds(void **state)
{
    (void)state;
    static const uint32_t indices[3] = {2, 0, 1};
    static const float colors[12] = {1, 0, 0, 1, 0, 1, 0, 1, 0, 0, 1, 0.5f};
    struct glb_builder *builder = create();
    struct glb_primitive_desc primitives[2] = {
        {.vertex_count = 3,
         .positions = triangle,
         .colors = colors,
         .indices = indices,
         .index_count = 3},
        {.topology = GLB_POINTS, .vertex_count = 3, .positions = triangle}};
    int mesh = glb_builder_add_mesh(builder, "t", primitives, 2);
    int parent = glb_builder_add_node(builder, &(struct glb_node_desc){.name = "p", .mesh = mesh});
    glb_builder_add_node(builder, &(struct glb_node_desc){.name = "c", .parent = parent});
    void *bytes;
    size_t size_bytes;
    struct glb_file file = finish(builder, &bytes, &size_bytes);
    const json_t *positions = glb_file_element(&file, "accessors", 0);
    assert_true(number_at(positions, "max.1") == (double)0.1f);
    assert_true(number_at(positions, "min.1") == 0);
    assert_memory_equal(file.binary, triangle, sizeof triangle);
    assert_memory_equal(file.binary + sizeof triangle, colors, sizeof colors);
    assert_int_equal(file.binary[sizeof triangle + sizeof colors], 2);
    assert_true(number_at(file.root, "meshes.0.primitives.1.mode") == 0);
    assert_true(number_at(file.root, "nodes.0.children.0") == 1);
    assert_int_equal(json_array_size(glb_member(file.root, "scenes.0.nodes")), 1);
    glb_file_finish(&file);
    free(bytes);
}

static void indices_above_16_bits_are_written_whole(void **state)
{
    (void)state;
    enum { COUNT = 70000 };
    float *positions = calloc(COUNT, 3 * sizeof *positions);
    static const uint32_t indices[3] = {0, 65536, COUNT - 1};
    assert_non_null(positions);
    struct glb_builder *builder = create();
    glb_builder_add_mesh(
        builder, "big",
        &(struct glb_primitive_desc){
            .vertex_count = COUNT, .positions = positions, .indices = indices, .index_count = 3},
        1);
    void *bytes;
    size_t size_bytes;
    struct glb_file file = finish(builder, &bytes, &size_bytes);
    assert_memory_equal(file.binary + COUNT * 12, indices, sizeof indices);
    glb_file_finish(&file);
    free(bytes);
    free(positions);
}

static void lights_and_cameras_keep_their_numbers(void **state)
{
    (void)state;
    struct glb_builder *builder = create();
    int spot = glb_builder_add_light(builder, &(struct glb_light_desc){.type = GLB_LIGHT_SPOT,
                                                                       .color = {1, 0.5, 0.25},
                                                                       .intensity = 12.5,
                                                                       .range = 3,
                                                                       .inner_cone_deg = 10,
                                                                       .outer_cone_deg = 20});
    int camera = glb_builder_add_camera(
        builder, &(struct glb_camera_desc){.is_orthographic = true, .x_mag = 2, .y_mag = 3});
    struct glb_node_desc node = {.light = spot, .camera = camera};
    glb_node_look_at(&node, (double[]){1, 2, 3}, (double[]){1, -8, 3}); /* straight down */
    glb_builder_add_node(builder, &node);
    void *bytes;
    size_t size_bytes;
    struct glb_file file = finish(builder, &bytes, &size_bytes);
    const json_t *light = glb_file_element(&file, "lights", 0);
    assert_true(number_at(light, "spot.outerConeAngle") == 20 * (M_PI / 180));
    assert_true(number_at(light, "range") == 3);
    assert_true(number_at(light, "color.2") == 0.25);
    assert_true(number_at(file.root, "cameras.0.orthographic.ymag") == 3);
    assert_true(number_at(file.root, "nodes.0.matrix.9") == 1);  /* +Z of the node is world +Y */
    assert_true(number_at(file.root, "nodes.0.matrix.6") == -1); /* +Y of the node is world -Z */
    assert_true(number_at(file.root, "nodes.0.matrix.0") == 1);  /* +X of the node is world +X */
    assert_true(number_at(file.root, "nodes.0.matrix.13") == 2);
    glb_file_finish(&file);
    free(bytes);
}

static void fill(struct glb_builder *builder)
{
    static const uint8_t pixels[2 * 2 * 4] = {9, 8, 7, 255, 6, 5, 4, 255, 3, 2, 1, 255};
    int image = glb_builder_add_image(builder, "i", pixels, 2, 2);
    int texture = glb_builder_add_texture(builder, &(struct glb_texture_desc){.image = image});
    int material = glb_builder_add_material(
        builder,
        &(struct glb_material_desc){.transmission = 1, .base_color_texture.texture = texture});
    int mesh =
        glb_builder_add_mesh(builder, "t",
                             &(struct glb_primitive_desc){
                                 .material = material, .vertex_count = 3, .positions = triangle},
                             1);
    glb_builder_add_node(builder,
                         &(struct glb_node_desc){.mesh = mesh, .translation = {0.1, 0, 0}});
}

static void equal_calls_give_equal_bytes(void **state)
{
    (void)state;
    void *bytes[2];
    size_t size_bytes[2];
    for (int i = 0; i < 2; i++) {
        struct glb_builder *builder = create();
        fill(builder);
        struct glb_file file = finish(builder, &bytes[i], &size_bytes[i]);
        glb_file_finish(&file);
    }
    assert_int_equal(size_bytes[0], size_bytes[1]);
    assert_memory_equal(bytes[0], bytes[1], size_bytes[0]);
    free(bytes[0]);
    free(bytes[1]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_empty_scene_is_a_valid_container),
        cmocka_unit_test(node_numbers_survive_to_the_bit),
        cmocka_unit_test(every_material_factor_is_written),
        cmocka_unit_test(an_image_keeps_its_pixels),
        cmocka_unit_test(a_mesh_keeps_its_vertices_and_states_its_bounds),
        cmocka_unit_test(indices_above_16_bits_are_written_whole),
        cmocka_unit_test(lights_and_cameras_keep_their_numbers),
        cmocka_unit_test(equal_calls_give_equal_bytes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
