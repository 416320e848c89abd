/* SPDX-License-Identifier: MIT */
/* The demo scene: it has what it promises, it is the same every time, and the importer takes it. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "glb/demo_scene.h"
#include "tests/support/glb_reader.h"
#include "tests/support/import_support.h"

struct built {
    void *glb;
    size_t size_bytes;
};

static struct built build(const struct demo_scene_desc *desc)
{
    struct built built;
    struct error err = {0};
    if (!demo_scene_build(desc, &built.glb, &built.size_bytes, &err))
        fail_msg("%s", err.message);
    return built;
}

static struct glb_file read_back(const struct built *built)
{
    struct glb_file file;
    char why[160] = "";
    if (!glb_file_init(&file, built->glb, built->size_bytes, why) ||
        !glb_file_references_hold(&file, why))
        fail_msg("%s", why);
    return file;
}

/* The desc of most tests: small textures are fast. */
static const struct demo_scene_desc small = {.texture_size_px = 64};

static void it_has_the_lights_cameras_and_glass_it_promises(void **state)
{
    (void)state;
    struct built built = build(&small);
    struct glb_file file = read_back(&built);
    size_t transmissive = 0, blended = 0;
    for (size_t i = 0; i < glb_file_count(&file, "materials"); i++) {
        const json_t *material = glb_file_element(&file, "materials", i);
        const json_t *mode = glb_member(material, "alphaMode");
        transmissive += glb_member(material, "extensions.KHR_materials_transmission") != NULL;
        blended += mode && strcmp(json_string_value(mode), "BLEND") == 0;
    }
    assert_true(glb_file_count(&file, "lights") >= 12);
    assert_int_equal(glb_file_count(&file, "cameras"), 2);
    assert_string_equal(json_string_value(glb_member(file.root, "cameras.0.name")), "Nave");
    assert_true(transmissive >= 3);
    assert_true(blended >= 3);
    glb_file_finish(&file);
    free(built.glb);
}

static void it_can_leave_the_curtains_out(void **state)
{
    (void)state;
    struct built built =
        build(&(struct demo_scene_desc){.texture_size_px = 64, .has_no_curtains = true});
    struct glb_file file = read_back(&built);
    for (size_t i = 0; i < glb_file_count(&file, "materials"); i++)
        assert_null(glb_member(glb_file_element(&file, "materials", i), "alphaMode"));
    glb_file_finish(&file);
    free(built.glb);
}

static void the_light_factor_scales_every_light(void **state)
{
    (void)state;
    struct built one = build(&small);
    struct built two = build(&(struct demo_scene_desc){.texture_size_px = 64, .light_factor = 2});
    struct glb_file file_one = read_back(&one), file_two = read_back(&two);
    for (size_t i = 0; i < glb_file_count(&file_one, "lights"); i++) {
        const json_t *a = glb_member(glb_file_element(&file_one, "lights", i), "intensity");
        const json_t *b = glb_member(glb_file_element(&file_two, "lights", i), "intensity");
        assert_true(json_number_value(a) > 0);
        assert_true(json_number_value(b) == 2 * json_number_value(a));
    }
    glb_file_finish(&file_one);
    glb_file_finish(&file_two);
    free(one.glb);
    free(two.glb);
}

static void a_coarse_one_has_the_same_nodes_of_fewer_triangles(void **state)
{
    (void)state;
    struct built fine = build(&small);
    struct built coarse = build(&(struct demo_scene_desc){.texture_size_px = 64, .coarseness = 4});
    struct glb_file a = read_back(&fine), b = read_back(&coarse);
    assert_int_equal(glb_file_count(&a, "nodes"), glb_file_count(&b, "nodes"));
    for (size_t i = 0; i < glb_file_count(&a, "nodes"); i++)
        assert_true(json_equal(glb_file_element(&a, "nodes", i), glb_file_element(&b, "nodes", i)));
    assert_true(coarse.size_bytes < fine.size_bytes / 3);
    glb_file_finish(&a);
    glb_file_finish(&b);
    free(fine.glb);
    free(coarse.glb);
}

static void the_same_desc_gives_the_same_bytes(void **state)
{
    (void)state;
    struct built a = build(&small), b = build(&small);
    assert_int_equal(a.size_bytes, b.size_bytes);
    assert_memory_equal(a.glb, b.glb, a.size_bytes);
    free(a.glb);
    free(b.glb);
}

static void descs_out_of_range_are_refused_by_field(void **state)
{
    (void)state;
    static const struct {
        struct demo_scene_desc desc;
        const char *field;
    } cases[] = {{{.texture_size_px = 63}, "texture_size_px is 63"},
                 {{.texture_size_px = 4097}, "texture_size_px is 4097"},
                 {{.texture_size_px = -1}, "texture_size_px is -1"},
                 {{.light_factor = -1}, "light_factor is -1"},
                 {{.coarseness = 5}, "coarseness is 5"},
                 {{.coarseness = -1}, "coarseness is -1"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        void *glb = &glb;
        size_t size_bytes = 1;
        struct error err = {0};
        assert_false(demo_scene_build(&cases[i].desc, &glb, &size_bytes, &err));
        assert_int_equal(err.code, ERROR_INVALID_REQUEST);
        assert_non_null(strstr(err.message, cases[i].field));
        assert_null(glb);
    }
}

static void the_importer_takes_it_whole_and_without_a_warning(void **state)
{
    (void)state;
    struct built built = build(&(struct demo_scene_desc){0});
    struct scene_file upload = {.name = "", .bytes = built.glb, .size_bytes = built.size_bytes};
    struct imported_scene imported = {0};
    struct error err = {0};
    if (!imported_scene_init(&imported, &upload, 1, &err))
        fail_msg("%s", err.message);
    const struct scene *scene = &imported.scene;
    assert_int_equal(scene->warning_count, 0);
    assert_int_equal(scene->extension_ignored_count, 0);
    assert_int_equal(scene->light_count, 12);
    assert_true(scene->header->triangle_count > 60000);
    assert_true(scene->header->triangle_count < 150000);
    assert_true(built.size_bytes < 6u << 20);
    int32_t nave = scene_find_node(scene, "Nave");
    assert_true(nave >= 0 && nave == scene->header->default_camera_node);
    assert_true(scene_find_node(scene, "Vessel") >= 0);
    int32_t glass = scene_find_material(scene, "Vessel glass");
    assert_true(glass >= 0);
    assert_int_equal(scene->materials[glass].pass_through, SCENE_PASS_SLAB);
    imported_scene_finish(&imported);
    free(built.glb);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_has_the_lights_cameras_and_glass_it_promises),
        cmocka_unit_test(it_can_leave_the_curtains_out),
        cmocka_unit_test(the_light_factor_scales_every_light),
        cmocka_unit_test(a_coarse_one_has_the_same_nodes_of_fewer_triangles),
        cmocka_unit_test(the_same_desc_gives_the_same_bytes),
        cmocka_unit_test(descs_out_of_range_are_refused_by_field),
        cmocka_unit_test(the_importer_takes_it_whole_and_without_a_warning),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
