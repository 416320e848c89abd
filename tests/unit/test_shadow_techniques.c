/* SPDX-License-Identifier: MIT */
/* The table of shadow techniques: which one takes a light, and what each says of itself. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/gl/context.h"
#include "renderer/shadows/shadow_programs.h"
#include "renderer/shadows/technique.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

static const struct shadow_casters opaque = {.count = 1, .opaque_count = 1};
static const struct shadow_casters glass = {.count = 1, .transparent_count = 1};
static const struct shadow_casters nothing = {.count = 0};

static enum shadow_technique chosen(enum shadow_technique asked,
                                    const struct shadow_casters *casters, bool faithful)
{
    const struct view_quality quality = {.shadows = asked, .faithful = faithful};
    const struct shadow_method *method = shadow_method_choose(casters, &quality);
    return method ? method->id : SHADOWS_NONE;
}

static void every_technique_but_none_has_functions(void **state)
{
    (void)state;
    for (int i = 0; i < SHADOWS_COUNT; i++) {
        const struct shadow_method *method = shadow_method_of((enum shadow_technique)i);
        assert_int_equal(i == SHADOWS_NONE, method == NULL);
        assert_true(!method || (method->wants && method->structure && method->structure->passes));
    }
}

/* Those whose structures are kept for each light; NULL past the last. */
static const struct shadow_method *next_of_lights(int *id)
{
    for (; *id < SHADOWS_COUNT; ++*id) {
        const struct shadow_method *method = shadow_method_of((enum shadow_technique) * id);
        bool is_own = method && (int)method->id == *id;
        if (is_own && method->structure->scope == SHADOW_PER_LIGHT) {
            ++*id;
            return method;
        }
    }
    return NULL;
}

static bool is_listed(const struct shadow_structure *structure)
{
    size_t i = 0;
    while (shadow_structure_at(i) && shadow_structure_at(i) != structure)
        i++;
    return shadow_structure_at(i) != NULL;
}

static void every_structure_is_in_the_table(void **state)
{
    (void)state;
    const struct shadow_method *method;
    assert_true(is_listed(shadow_method_of(SHADOWS_RAYTRACED_SHADOWS)->structure));
    for (int id = 0; (method = next_of_lights(&id));) {
        const struct shadow_structure *structure = method->structure;
        assert_true(is_listed(structure));
        uint64_t parts = structure == &shadow_structure_moments ? 4 : 1;
        assert_int_equal(structure->texel_bytes, structure->has_texels  ? 4 + 16 * parts
                                                 : structure->has_lists ? 8
                                                                        : 4);
        assert_int_equal(structure->filters, structure->has_lists || structure->has_texels);
        assert_non_null(method->reused);
        assert_int_equal(structure->filters, method->lookup != NULL);
        assert_true(!structure->filters ||
                    (structure->build && structure->record && structure->bind && structure->drop));
    }
}

/* Without one the self-test would let a structure pass that no device has drawn. */
static void every_structure_has_a_trial_by_a_technique_of_its_own(void **state)
{
    (void)state;
    const struct shadow_structure *structure;
    for (size_t i = 0; (structure = shadow_structure_at(i)); i++) {
        assert_true(structure->trials && structure->trials->name);
        for (const struct shadow_trial *trial = structure->trials; trial->name; trial++)
            assert_ptr_equal(shadow_method_of(trial->quality.shadows)->structure, structure);
    }
}

static void every_structure_has_a_forecast(void **state)
{
    (void)state;
    const struct shadow_structure *structure;
    const struct workload workload = {.pixels = 1e5,
                                      .covered = 0.5,
                                      .lit = 2,
                                      .triangles = 1e4,
                                      .shadowed_lights = 2,
                                      .map_faces = 2};
    const struct forecast_setting setting = {
        .samples = 1, .shadow_resolution = 512, .shadow_taps = 4, .has_shadows = true};
    const struct device_speed speed = {1, 1, 1, 1, 1};
    const struct forecast_frame frame = {&workload, &setting, &speed};
    for (size_t i = 0; (structure = shadow_structure_at(i)); i++) {
        double terms[FORECAST_TERM_COUNT] = {0};
        structure->forecast(&frame, terms);
        assert_true(forecast_sum_ms(terms) > 0);
        assert_true(!structure->forecast_error || structure->forecast_error(&setting) > 0);
    }
}

static void every_pass_of_a_light_lists_programs(void **state)
{
    (void)state;
    const struct shadow_method *method;
    assert_non_null(shadow_depth_pass.list_programs);
    for (int id = 0; (method = next_of_lights(&id));)
        for (const struct shadow_pass *pass = method->structure->passes; pass->name; pass++)
            assert_true(pass->list_programs && !pass->is_of_windows);
}

static void lights_without_transparent_casters_have_plain_maps(void **state)
{
    (void)state;
    static const enum shadow_technique asked[] = {SHADOWS_AUTO,
                                                  SHADOWS_MAP,
                                                  SHADOWS_DEEP,
                                                  SHADOWS_DEEP_LINKED,
                                                  SHADOWS_TRANSLUCENT,
                                                  SHADOWS_STOCHASTIC,
                                                  SHADOWS_COLORED_STOCHASTIC,
                                                  SHADOWS_COMPOSITED,
                                                  SHADOWS_MOMENTS};
    for (size_t i = 0; i < sizeof asked / sizeof *asked; i++)
        assert_int_equal(chosen(asked[i], &opaque, false), SHADOWS_MAP);
    assert_int_equal(chosen(SHADOWS_DEEP_LINKED, &opaque, true), SHADOWS_DEEP_LINKED);
    assert_int_equal(chosen(SHADOWS_RAYTRACED_SHADOWS, &opaque, false), SHADOWS_RAYTRACED_SHADOWS);
}

static void lights_behind_glass_have_lists(void **state)
{
    (void)state;
    assert_int_equal(chosen(SHADOWS_AUTO, &glass, false), SHADOWS_DEEP);
    assert_int_equal(chosen(SHADOWS_DEEP, &glass, false), SHADOWS_DEEP);
    assert_int_equal(chosen(SHADOWS_DEEP_LINKED, &glass, false), SHADOWS_DEEP_LINKED);
    for (int i = SHADOWS_TRANSLUCENT; i <= SHADOWS_COMPOSITED; i++)
        assert_int_equal(chosen((enum shadow_technique)i, &glass, false), i);
    assert_int_equal(chosen(SHADOWS_MOMENTS, &glass, false), SHADOWS_MOMENTS);
    assert_int_equal(chosen(SHADOWS_RAYTRACED_SHADOWS, &glass, false), SHADOWS_RAYTRACED_SHADOWS);
    assert_int_equal(chosen(SHADOWS_MAP, &glass, false), SHADOWS_NONE); /* it casts none there */
}

static void lights_without_casters_shine_without_a_shadow(void **state)
{
    (void)state;
    for (int i = 0; i < SHADOWS_COUNT; i++)
        assert_int_equal(chosen((enum shadow_technique)i, &nothing, true), SHADOWS_NONE);
}

/* The rows tell what the functions do. */
static void techniques_that_filter_say_so(void **state)
{
    (void)state;
    const struct shadow_method *method;
    for (int id = 0; (method = next_of_lights(&id));) {
        bool filters = method->structure->filters;
        assert_int_equal(shadow_technique_can(method->id, SHADOW_CAN_FILTER), filters);
        assert_true(filters || !shadow_technique_can(method->id, SHADOW_CAN_COLOR));
    }
}

static void queries_name_what_a_map_has(void **state)
{
    (void)state;
    static const struct {
        struct shadow_map map;
        const char *defines;
    } cases[] = {
        {{.method = &shadow_method_map, .frame.shape = SHADOW_CUBE},
         "SHADOW_HAS_MAPS SHADOW_HAS_PERSPECTIVE SHADOW_HAS_CUBES"},
        {{.method = &shadow_method_deep, .frame.shape = SHADOW_ORTHOGRAPHIC, .longest_list = 100},
         "SHADOW_HAS_MAPS SHADOW_HAS_ORTHOGRAPHIC SHADOW_HAS_LONG SHADOW_LISTS=deep:3"},
        {{.method = &shadow_method_deep,
          .flags = SHADOW_FLAG_RAW | SHADOW_FLAG_MEDIA,
          .longest_list = 100},
         "SHADOW_HAS_MAPS SHADOW_HAS_PERSPECTIVE SHADOW_HAS_IDS SHADOW_HAS_MEDIA "
         "SHADOW_LISTS=deep:3"},
        {{.is_faithful = true},
         "SHADOW_HAS_MAPS SHADOW_HAS_PERSPECTIVE SHADOW_FAITHFUL SHADOW_LISTS=linked:4"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct shadow_features features = {.has = {false}};
        char text[SHADOW_DEFINES_BYTES];
        struct shadow_map map = cases[i].map;
        if (map.is_faithful)
            map.method = shadow_method_of(SHADOWS_DEEP_LINKED);
        shadow_features_add(&features, &map);
        shadow_features_write(&features, text);
        assert_string_equal(text, cases[i].defines);
    }
}

/* Geometry programs draw edges or casters in all forms but compute and triangles-one-pass, the
 * tessellator in the one that has its name and in the two that have passes. */
static void silhouettes_are_drawn_by_stages_that_can_read_them(void **state)
{
    (void)state;
    const struct shadow_method *method = shadow_method_of(SHADOWS_SILHOUETTE);
    const struct scene_state empty = {.item_count = 0};
    for (int form = 0; form < VIEW_SILHOUETTE_FORMS; form++)
        for (int i = 0; i < 4; i++) {
            const struct view_quality quality = {.silhouette_form =
                                                     (enum view_silhouette_form)form};
            const struct gl_limits limits = {.max_geometry_blocks = i & 1 ? 8 : 7,
                                             .max_tessellation_blocks = i & 2 ? 8 : 7};
            struct error err = {0};
            bool is_refused = (!(i & 1) && form != VIEW_SILHOUETTE_COMPUTE &&
                               form != VIEW_SILHOUETTE_TRIANGLES_ONE_PASS) ||
                              (!(i & 2) && form > VIEW_SILHOUETTE_GEOMETRY &&
                               form < VIEW_SILHOUETTE_TRIANGLES_GEOMETRY);
            assert_int_equal(method->check(&empty, &quality, &limits, &err), !is_refused);
            assert_true(!is_refused ||
                        (err.code == ERROR_UNSUPPORTED && strstr(err.message, "compute")));
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_technique_but_none_has_functions),
        cmocka_unit_test(every_structure_is_in_the_table),
        cmocka_unit_test(every_structure_has_a_trial_by_a_technique_of_its_own),
        cmocka_unit_test(every_structure_has_a_forecast),
        cmocka_unit_test(every_pass_of_a_light_lists_programs),
        cmocka_unit_test(lights_without_transparent_casters_have_plain_maps),
        cmocka_unit_test(lights_behind_glass_have_lists),
        cmocka_unit_test(lights_without_casters_shine_without_a_shadow),
        cmocka_unit_test(techniques_that_filter_say_so),
        cmocka_unit_test(queries_name_what_a_map_has),
        cmocka_unit_test(silhouettes_are_drawn_by_stages_that_can_read_them),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
