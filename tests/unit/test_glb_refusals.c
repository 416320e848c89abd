/* SPDX-License-Identifier: MIT */
/* The GLB builder refuses what it cannot write, by the name of the field. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "glb/glb_builder.h"

static const float triangle[9] = {0, 0, 0, 1, 0, 0, 0, 0.1f, 0};

/* Each adds one thing that must be refused. */
static int add_nan_position(struct glb_builder *builder)
{
    static const float broken[9] = {0, 0, NAN};
    return glb_builder_add_mesh(
        builder, "t", &(struct glb_primitive_desc){.vertex_count = 3, .positions = broken}, 1);
}

static int add_wild_index(struct glb_builder *builder)
{
    static const uint32_t indices[3] = {0, 1, 3};
    return glb_builder_add_mesh(
        builder, "t",
        &(struct glb_primitive_desc){
            .vertex_count = 3, .positions = triangle, .indices = indices, .index_count = 3},
        1);
}

static int add_half_triangle(struct glb_builder *builder)
{
    return glb_builder_add_mesh(
        builder, "t", &(struct glb_primitive_desc){.vertex_count = 2, .positions = triangle}, 1);
}

static int add_empty_mesh(struct glb_builder *builder)
{
    return glb_builder_add_mesh(builder, "t", NULL, 0);
}

static int add_unknown_material(struct glb_builder *builder)
{
    return glb_builder_add_mesh(
        builder, "t",
        &(struct glb_primitive_desc){.material = 1, .vertex_count = 3, .positions = triangle}, 1);
}

static int add_bright_color(struct glb_builder *builder)
{
    return glb_builder_add_material(builder,
                                    &(struct glb_material_desc){.base_color = {1.5, 0, 0, 1}});
}

static int add_unknown_texture(struct glb_builder *builder)
{
    return glb_builder_add_material(builder,
                                    &(struct glb_material_desc){.base_color_texture.texture = 7});
}

static int add_low_ior(struct glb_builder *builder)
{
    return glb_builder_add_material(builder,
                                    &(struct glb_material_desc){.has_ior = true, .ior = 0.5});
}

static int add_infinite_matrix(struct glb_builder *builder)
{
    struct glb_node_desc node = {.has_matrix = true};
    node.matrix[3] = INFINITY;
    return glb_builder_add_node(builder, &node);
}

static int add_orphan(struct glb_builder *builder)
{
    return glb_builder_add_node(builder, &(struct glb_node_desc){.parent = 1});
}

static int add_wide_cone(struct glb_builder *builder)
{
    return glb_builder_add_light(
        builder, &(struct glb_light_desc){.type = GLB_LIGHT_SPOT, .outer_cone_deg = 91});
}

static int add_empty_image(struct glb_builder *builder)
{
    static const uint8_t texel[4];
    return glb_builder_add_image(builder, "i", texel, 0, 1);
}

static int add_broken_name(struct glb_builder *builder)
{
    return glb_builder_add_node(builder, &(struct glb_node_desc){.name = "\xff"});
}

static void bad_input_is_refused_by_name_and_nothing_follows(void **state)
{
    (void)state;
    static const struct {
        int (*add)(struct glb_builder *builder);
        const char *named;
    } cases[] = {
        {add_nan_position, "POSITION of vertex 0"},
        {add_wild_index, "index 2 is 3"},
        {add_half_triangle, "multiple of 3"},
        {add_empty_mesh, "no primitive"},
        {add_unknown_material, "material"},
        {add_bright_color, "base_color is 1.5"},
        {add_unknown_texture, "baseColorTexture"},
        {add_low_ior, "ior is 0.5"},
        {add_infinite_matrix, "node.matrix"},
        {add_orphan, "node.parent is 1"},
        {add_wide_cone, "outer_cone_deg is 91"},
        {add_empty_image, "0 x 1"},
        {add_broken_name, "UTF-8"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct glb_builder *builder = glb_builder_create("Test", NULL);
        assert_non_null(builder);
        struct error err = {0};
        void *bytes = NULL;
        size_t size_bytes = 1;
        assert_int_equal(cases[i].add(builder), 0);
        assert_int_equal(glb_builder_add_node(builder, &(struct glb_node_desc){.name = "n"}), 0);
        assert_false(glb_builder_finish(builder, &bytes, &size_bytes, &err));
        assert_int_equal(err.code, ERROR_INVALID_REQUEST);
        if (!strstr(err.message, cases[i].named))
            fail_msg("case %zu: '%s' does not name '%s'", i, err.message, cases[i].named);
        assert_null(bytes);
        assert_int_equal(size_bytes, 0);
        glb_builder_destroy(builder);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bad_input_is_refused_by_name_and_nothing_follows),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
