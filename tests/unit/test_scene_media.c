/* SPDX-License-Identifier: MIT */
/* Which drawables are media, what attenuates inside them, and what a request changes of it. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "glb/shapes.h"
#include "renderer/scene/scene_state.h"
#include "tests/support/import_support.h"

static const struct glb_material_desc syrup = {.name = "Syrup",
                                               .transmission = 1,
                                               .thickness = 1,
                                               .attenuation_distance = 2,
                                               .attenuation_color = {0.5, 0.25, 1}};

/* One node of one primitive. scale: of the node, NULL = 1. */
static struct imported_scene make(struct shape *shape, const struct glb_material_desc *material,
                                  const double *scale)
{
    struct imported_scene imported;
    struct error err = {0};
    struct scene_file file = {.name = ""};
    void *glb;
    struct glb_builder *builder = glb_builder_create("Media", &err);
    int id = glb_builder_add_material(builder, material);
    struct glb_node_desc node = {.name = "Body",
                                 .mesh = shape_give_mesh(shape, builder, "Body", id)};
    if (scale)
        memcpy(node.scale, scale, sizeof node.scale);
    glb_builder_add_node(builder, &node);
    if (!glb_builder_finish(builder, &glb, &file.size_bytes, &err))
        fail_msg("%s", err.message);
    glb_builder_destroy(builder);
    file.bytes = glb;
    if (!imported_scene_init(&imported, &file, 1, &err))
        fail_msg("%s", err.message);
    free(glb);
    return imported;
}

static struct imported_scene make_box(const struct glb_material_desc *material, const double *scale)
{
    struct shape box = {0};
    shape_add_box(&box, (double[]){0, 0, 0}, (double[]){1, 1, 1});
    return make(&box, material, scale);
}

static struct scene_state state_of(const struct imported_scene *s,
                                   const struct view_material_override *override)
{
    struct scene_state state;
    struct error err = {0};
    struct view view = {.width_px = 1,
                        .height_px = 1,
                        .materials = override,
                        .material_override_count = override ? 1 : 0};
    if (!scene_state_init(&state, &s->scene, &view, &err))
        fail_msg("%s", err.message);
    assert_int_equal(state.item_count, 1);
    assert_int_equal(state.medium_count, state.items[0].is_medium);
    return state;
}

static bool is_medium(const struct imported_scene *s, const struct view_material_override *override)
{
    struct scene_state state = state_of(s, override);
    bool answer = state.items[0].is_medium;
    scene_state_finish(&state);
    return answer;
}

static void closed_boxes_and_spheres_are_media(void **state)
{
    (void)state;
    struct shape ball = {0};
    shape_add_sphere(&ball, (double[]){3, 4, 5}, 2, 32, 16);
    struct imported_scene scenes[] = {make_box(&syrup, NULL), make(&ball, &syrup, NULL)};
    for (int i = 0; i < 2; i++) {
        struct scene_state s = state_of(&scenes[i], NULL);
        assert_true(s.items[0].is_medium);
        assert_int_equal(s.items[0].class_, STATE_TRANSPARENT);
        assert_int_equal(s.open_volume_count, 0);
        assert_false(scene_has_warning(&scenes[i].scene, "closed surface"));
        assert_true(fabs(s.materials[0].sigma[0] - log(2) / 2) < 1e-15);
        assert_true(fabs(s.materials[0].sigma[1] - log(4) / 2) < 1e-15);
        assert_true(s.materials[0].sigma[2] == 0);
        scene_state_finish(&s);
        imported_scene_finish(&scenes[i]);
    }
}

/* A box with `corners` fewer corners at its end, or with its last triangle turned over. */
static struct imported_scene make_faulty(size_t corners, bool is_flipped)
{
    struct shape box = {0};
    shape_add_box(&box, (double[]){0, 0, 0}, (double[]){1, 1, 1});
    box.index_count -= corners;
    if (is_flipped) {
        uint32_t kept = box.indices[box.index_count - 1];
        box.indices[box.index_count - 1] = box.indices[box.index_count - 2];
        box.indices[box.index_count - 2] = kept;
    }
    return make(&box, &syrup, NULL);
}

static void open_and_inconsistent_boxes_keep_the_thickness_and_say_so(void **state)
{
    (void)state;
    struct imported_scene scenes[] = {make_faulty(6, false), make_faulty(3, false),
                                      make_faulty(0, true)};
    for (int i = 0; i < 3; i++) {
        struct scene_state s = state_of(&scenes[i], NULL);
        assert_false(s.items[0].is_medium);
        assert_int_equal(s.open_volume_count, 1);
        assert_true(scene_has_warning(&scenes[i].scene, "1 primitive with an attenuating volume"));
        scene_state_finish(&s);
        imported_scene_finish(&scenes[i]);
    }
}

static void a_mirrored_or_stretched_node_is_a_medium_of_the_same_extinction(void **state)
{
    (void)state;
    static const double scales[][3] = {{-1, 1, 1}, {-1, -2, 3}, {-2, -3, -0.5}, {10, 10, 10}};
    for (size_t i = 0; i < 4; i++) {
        struct imported_scene scene = make_box(&syrup, scales[i]);
        struct scene_state s = state_of(&scene, NULL);
        assert_true(s.items[0].is_medium);
        assert_int_equal(s.items[0].is_mirrored, scales[i][0] * scales[i][1] * scales[i][2] < 0);
        assert_true(fabs(s.materials[0].sigma[0] - log(2) / 2) < 1e-15);
        scene_state_finish(&s);
        imported_scene_finish(&scene);
    }
}

static void what_does_not_attenuate_is_no_medium(void **state)
{
    (void)state;
    struct glb_material_desc materials[] = {syrup, syrup, syrup, syrup};
    materials[0].transmission = 0;
    materials[1].thickness = 0;
    materials[2].attenuation_distance = 0;
    memcpy(materials[3].attenuation_color, (double[]){1, 1, 1}, sizeof syrup.attenuation_color);
    for (int i = 0; i < 4; i++) {
        struct imported_scene scene = make_box(&materials[i], NULL);
        struct scene_state s = state_of(&scene, NULL);
        assert_false(s.items[0].is_medium);
        assert_int_equal(s.open_volume_count, 0);
        scene_state_finish(&s);
        imported_scene_finish(&scene);
    }
}

static void overrides_make_and_unmake_media(void **state)
{
    (void)state;
    struct glb_material_desc plain = {.name = "Syrup"};
    struct imported_scene clear = make_box(&plain, NULL), full = make_box(&syrup, NULL);
    struct view_material_override all = {.material = "Syrup",
                                         .has_transmission = true,
                                         .transmission = 0.5f,
                                         .has_thickness = true,
                                         .thickness = 0.1f,
                                         .has_attenuation = true,
                                         .attenuation_color = {1, 0.5f, 1},
                                         .attenuation_distance = 1};
    assert_false(is_medium(&clear, NULL));
    assert_true(is_medium(&clear, &all));
    struct view_material_override less = all;
    less.has_transmission = false;
    assert_false(is_medium(&clear, &less));
    less = all;
    less.thickness = 0;
    assert_false(is_medium(&full, &less));
    less = all;
    less.attenuation_color[1] = 1;
    assert_false(is_medium(&full, &less));
    less = (struct view_material_override){.material = "Syrup", .has_transmission = true};
    assert_false(is_medium(&full, &less));
    imported_scene_finish(&clear);
    imported_scene_finish(&full);
}

static uint64_t hash_of(const struct imported_scene *scene,
                        const struct view_material_override *override)
{
    struct scene_state s = state_of(scene, override);
    uint64_t hash = s.items[0].shadow_hash;
    scene_state_finish(&s);
    return hash;
}

static void the_shadow_hash_follows_the_medium(void **state)
{
    (void)state;
    struct imported_scene closed = make_box(&syrup, NULL), open = make_faulty(6, false);
    struct view_material_override denser = {.material = "Syrup",
                                            .has_attenuation = true,
                                            .attenuation_color = {0.5f, 0.25f, 1},
                                            .attenuation_distance = 1};
    struct view_material_override thin = {.material = "Syrup", .has_thickness = true};
    uint64_t base = hash_of(&closed, NULL);
    assert_true(base == hash_of(&closed, NULL));
    assert_true(base != hash_of(&closed, &denser));
    assert_true(base != hash_of(&closed, &thin));
    assert_true(base != hash_of(&open, NULL));
    imported_scene_finish(&closed);
    imported_scene_finish(&open);
}

/* A channel of zero is black, and finite. */
static void the_blackest_medium_is_finite(void **state)
{
    (void)state;
    struct imported_scene scene = make_box(&syrup, NULL);
    struct view_material_override black = {.material = "Syrup",
                                           .has_attenuation = true,
                                           .attenuation_color = {0, 1e-38f, 1},
                                           .attenuation_distance = 1e-9f};
    struct scene_state s = state_of(&scene, &black);
    const double *sigma = s.materials[0].sigma;
    assert_true(isfinite(sigma[0]) && isfinite((float)sigma[0]));
    assert_true(sigma[0] == sigma[1] && fabs(sigma[0] - 69.07755278982137e9) < 1e4);
    assert_true(exp(-sigma[0] * 1e-9) < 1.1e-30);
    scene_state_finish(&s);
    imported_scene_finish(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(closed_boxes_and_spheres_are_media),
        cmocka_unit_test(open_and_inconsistent_boxes_keep_the_thickness_and_say_so),
        cmocka_unit_test(a_mirrored_or_stretched_node_is_a_medium_of_the_same_extinction),
        cmocka_unit_test(what_does_not_attenuate_is_no_medium),
        cmocka_unit_test(overrides_make_and_unmake_media),
        cmocka_unit_test(the_shadow_hash_follows_the_medium),
        cmocka_unit_test(the_blackest_medium_is_finite),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
