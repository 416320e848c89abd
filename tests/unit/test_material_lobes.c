/* SPDX-License-Identifier: MIT */
/* Lobes of materials in requests: read, written, refused, and given to a material of the scene. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/render_request.h"
#include "renderer/scene/material_lobes.h"

static bool parse(struct render_request *request, const char *member, struct error *err)
{
    char json[512];
    int length =
        snprintf(json, sizeof json,
                 "{\"scene\":\"%064d\",\"overrides\":{\"materials\":{\"Paint\":{%s}}}}", 0, member);
    return render_request_parse(json, (size_t)length, request, err);
}

static void each_member_is_read_and_written_alone(void **state)
{
    (void)state;
    for (int i = 0; i < LOBE_MEMBER_COUNT; i++) {
        const struct lobe_member_kind *kind = lobe_member_kind(i);
        struct render_request request, again;
        struct error err = {0};
        char member[128];
        double expected = fmin(1, kind->most);
        snprintf(member, sizeof member, kind->count == 1 ? "\"%s\":%g" : "\"%s\":[%g,1,1]",
                 kind->name, expected);
        if (!parse(&request, member, &err))
            fail_msg("%s: %s", member, err.message);
        const struct lobe_members *lobes = &request.materials[0].lobes;
        assert_int_equal(lobes->said, 1u << i);
        assert_true(lobes->values[i][0] == expected);
        char *text = render_request_to_json(&request);
        assert_non_null(text);
        assert_true(render_request_parse(text, strlen(text), &again, &err));
        assert_memory_equal(&again.materials[0].lobes, lobes, sizeof *lobes);
        free(text);
        render_request_finish(&request);
        render_request_finish(&again);
    }
}

static void numbers_out_of_range_are_refused_by_name(void **state)
{
    (void)state;
    for (int i = 0; i < LOBE_MEMBER_COUNT; i++)
        for (int end = 0; end < 2; end++) {
            const struct lobe_member_kind *kind = lobe_member_kind(i);
            struct render_request request;
            struct error err = {0};
            char member[128], pointer[128];
            double number = end ? kind->most * 1.5 : kind->least - 0.5;
            snprintf(member, sizeof member, kind->count == 1 ? "\"%s\":%g" : "\"%s\":[%g,1,1]",
                     kind->name, number);
            snprintf(pointer, sizeof pointer, "/overrides/materials/Paint/%s", kind->name);
            assert_false(parse(&request, member, &err));
            assert_int_equal(err.code, ERROR_INVALID_REQUEST);
            assert_memory_equal(err.pointer, pointer, strlen(pointer));
        }
}

static void a_material_gets_what_is_said_and_keeps_the_rest(void **state)
{
    (void)state;
    struct scene_material material = {.film_ior = 1.3f, .film_nm = {100, 400}, .clearcoat = 0.25f};
    assert_int_equal(material_lobes_get(&material).said,
                     1u << LOBE_CLEARCOAT | 1u << LOBE_CLEARCOAT_ROUGHNESS);
    struct lobe_members lobes = {.said = 0};
    for (int i = 0; i < LOBE_MEMBER_COUNT; i++) {
        lobes.said |= 1u << i;
        for (int k = 0; k < lobe_member_kind(i)->count; k++)
            lobes.values[i][k] = i == LOBE_ANISOTROPY_ROTATION ? 180 : 0.5 + 0.125 * k;
    }
    const struct scene_material before = material;
    material_lobes_set(&material, &(struct lobe_members){.said = 0});
    assert_memory_equal(&material, &before, sizeof material);
    material_lobes_set(&material, &lobes);
    assert_true(material.flags & SCENE_MATERIAL_SPECULAR);
    assert_true(material.specular_color[2] == 0.75f && material.sheen_color[1] == 0.625f);
    assert_true(material.film_nm[0] == 100 && material.film_nm[1] == 0.5f);
    assert_true(fabsf(material.anisotropy_rad - (float)M_PI) < 1e-6f);
    struct lobe_members found = material_lobes_get(&material);
    assert_int_equal(found.said, lobes.said);
    for (int i = 0; i < LOBE_MEMBER_COUNT; i++)
        for (int k = 0; k < lobe_member_kind(i)->count; k++)
            assert_true(fabs(found.values[i][k] - lobes.values[i][k]) < 1e-4);
}

static void a_color_alone_leaves_specular_reflection_whole(void **state)
{
    (void)state;
    struct scene_material material = {.flags = 0};
    struct lobe_members lobes = {.said = 1u << LOBE_SPECULAR_COLOR,
                                 .values[LOBE_SPECULAR_COLOR] = {1, 0.5, 0}};
    material_lobes_set(&material, &lobes);
    assert_true(material.flags & SCENE_MATERIAL_SPECULAR);
    assert_true(material.specular == 1 && material.specular_color[1] == 0.5f);
    material.specular = 0.75f; /* a second time it is there already */
    material_lobes_set(&material, &lobes);
    assert_true(material.specular == 0.75f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_member_is_read_and_written_alone),
        cmocka_unit_test(numbers_out_of_range_are_refused_by_name),
        cmocka_unit_test(a_material_gets_what_is_said_and_keeps_the_rest),
        cmocka_unit_test(a_color_alone_leaves_specular_reflection_whole),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
