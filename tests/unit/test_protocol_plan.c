/* SPDX-License-Identifier: MIT */
/* Plans as JSON, text and drawings: nothing is lost, and hostile names stay text. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <jansson.h>

#include "server/mapping/plan_mapping.h"

static struct plan_document two_passes(void)
{
    struct plan plan = {.samples = 4,
                        .pass_count = 2,
                        .lights_by_technique[SHADOWS_DEEP] = 3,
                        .shadow_texels = 4096,
                        .least_batches = 2};
    struct render_request request = {.width = 64, .height = 32, .scene = "abc"};
    struct plan_document document;
    for (int i = 0; i < PLAN_NEED_COUNT; i++) {
        plan.requirements[i].need = (enum plan_need)i;
        strcpy(plan.requirements[i].because, "no reason");
    }
    plan.requirements[PLAN_NEED_FILTERED_SHADOWS].is_met = true;
    strcpy(plan.requirements[PLAN_NEED_FILTERED_SHADOWS].because, "<b>\"glass\" & \\ more</b>");
    plan.passes[0] = (struct plan_pass){.pass = "shadow.deep.count",
                                        .technique = "deep",
                                        .need = PLAN_NEED_FILTERED_SHADOWS,
                                        .bytes = 3 << 20};
    plan.passes[1] = (struct plan_pass){.pass = "shadow.deep.sort",
                                        .technique = "deep",
                                        .need = PLAN_NEED_FILTERED_SHADOWS,
                                        .is_conditional = true};
    plan_document_from_plan(&request, &plan, "some <device>", &document);
    struct frame_report report = {.warning_count = 0};
    report_warn(&report, "light passes %d casters unchanged", 3);
    plan_document_put_warnings(&report, &document);
    return document;
}

static char *write(const struct plan_document *document, enum plan_format format)
{
    size_t length = 0;
    char *text = plan_document_write(document, format, &length);
    assert_non_null(text);
    assert_int_equal(strlen(text), length);
    return text;
}

static void json_holds_every_requirement_and_pass(void **state)
{
    (void)state;
    struct plan_document document = two_passes();
    char *text = write(&document, PLAN_FORMAT_JSON);
    json_t *json = json_loads(text, JSON_REJECT_DUPLICATES, NULL);
    assert_non_null(json);
    const json_t *passes = json_object_get(json, "passes");
    assert_int_equal(json_array_size(passes), 2);
    assert_int_equal(json_array_size(json_object_get(json, "requirements")), PLAN_NEED_COUNT);
    const json_t *first = json_array_get(passes, 0), *second = json_array_get(passes, 1);
    assert_string_equal(json_string_value(json_object_get(first, "requirement")),
                        "filtered-shadows");
    assert_string_equal(json_string_value(json_object_get(first, "because")),
                        "<b>\"glass\" & \\ more</b>");
    assert_int_equal(json_integer_value(json_object_get(first, "bytes")), 3 << 20);
    assert_true(json_is_null(json_object_get(second, "bytes")));
    assert_true(json_is_true(json_object_get(second, "is_conditional")));
    const json_t *warnings = json_object_get(json, "warnings");
    assert_int_equal(json_array_size(warnings), 1);
    assert_string_equal(json_string_value(json_array_get(warnings, 0)),
                        "light passes 3 casters unchanged");
    const json_t *counts = json_object_get(json, "counts");
    assert_int_equal(json_integer_value(json_object_get(counts, "deep_lights")), 3);
    const json_t *lights = json_object_get(json, "lights_by_technique");
    assert_int_equal(json_object_size(lights), 1);
    assert_int_equal(json_integer_value(json_object_get(lights, "deep")), 3);
    assert_int_equal(json_integer_value(json_object_get(counts, "shadow_texels")), 4096);
    assert_int_equal(json_integer_value(json_object_get(counts, "light_batches")), 2);
    json_decref(json);
    free(text);
}

static void text_parts_what_is_required_from_what_is_not(void **state)
{
    (void)state;
    struct plan_document document = two_passes();
    char *text = write(&document, PLAN_FORMAT_TEXT);
    const char *met = strstr(text, "filtered-shadows"), *unmet = strstr(text, "Not required:");
    assert_non_null(met);
    assert_non_null(unmet);
    assert_true(met < unmet);
    assert_true(strstr(text, "layers") > unmet);
    assert_non_null(strstr(text, "3.0 MiB"));
    assert_non_null(strstr(text, "in at least 2 batches"));
    assert_non_null(strstr(text, "\nWarnings:\n  light passes 3 casters unchanged\n"));
    free(text);
}

/* What stands between quotes of DOT, and between tags of XML, has no bare quote or bracket. */
static void drawings_escape_what_names_may_hold(void **state)
{
    (void)state;
    struct plan_document document = two_passes();
    char *dot = write(&document, PLAN_FORMAT_DOT), *svg = write(&document, PLAN_FORMAT_SVG);
    assert_non_null(strstr(dot, "<b>\\\"glass\\\" & \\\\ more</b>"));
    assert_non_null(strstr(svg, "&lt;b>&quot;glass&quot; &amp; \\ more&lt;/b>"));
    assert_null(strstr(svg, "<b>"));
    assert_non_null(strstr(svg, "some &lt;device>"));
    free(dot);
    free(svg);
}

static void long_reasons_are_cut_between_characters(void **state)
{
    (void)state;
    struct plan_document document = two_passes();
    char *because = document.requirements[0].because;
    for (size_t i = 0; i + 3 < sizeof document.requirements[0].because; i += 2)
        memcpy(because + i, "\xc3\xa9", 3);
    char *svg = write(&document, PLAN_FORMAT_SVG);
    const char *ellipsis = strstr(svg, "\xe2\x80\xa6");
    assert_non_null(ellipsis);
    assert_int_equal((unsigned char)ellipsis[-1], 0xa9);
    free(svg);
}

/* Two passes, three programs, two of them the same. */
static void programs_stand_with_their_passes_in_every_form(void **state)
{
    (void)state;
    static const struct plan_document_program programs[] = {
        {.pass = 0,
         .id = "00112233445566aa",
         .files = {"shadow_caster.vert.glsl", "shadow_deep.frag.glsl"},
         .defines = "TEXTURES=1  CERTAIN",
         .place = PLAN_DOCUMENT_IN_MEMORY},
        {.pass = 1, .id = "00112233445566aa", .files = {"shadow_caster.vert.glsl"}},
        {.pass = 1, .id = "ffeeddccbbaa9988", .files = {"sort.comp.glsl"}, .is_conditional = true},
    };
    struct plan_document document = two_passes();
    document.programs = programs;
    document.program_count = 3;
    char *text = write(&document, PLAN_FORMAT_TEXT);
    assert_non_null(strstr(text, "Programs: 2 in all, 1 to compile, 1 in memory"));
    assert_non_null(strstr(text, "shadow_caster.vert + shadow_deep.frag"));
    assert_non_null(strstr(text, "to compile  if needed"));
    free(text);
    text = write(&document, PLAN_FORMAT_JSON);
    json_t *json = json_loads(text, JSON_REJECT_DUPLICATES, NULL);
    const json_t *passes = json_object_get(json, "passes");
    const json_t *first = json_object_get(json_array_get(passes, 0), "programs");
    const json_t *second = json_object_get(json_array_get(passes, 1), "programs");
    assert_int_equal(json_array_size(first), 1);
    assert_int_equal(json_array_size(second), 2);
    const json_t *program = json_array_get(first, 0),
                 *defines = json_object_get(program, "defines");
    assert_int_equal(json_array_size(defines), 2);
    assert_string_equal(json_string_value(json_array_get(defines, 1)), "CERTAIN");
    assert_int_equal(json_array_size(json_object_get(program, "files")), 2);
    assert_string_equal(json_string_value(json_object_get(program, "place")), "memory");
    program = json_array_get(second, 1);
    assert_string_equal(json_string_value(json_object_get(program, "id")), "ffeeddccbbaa9988");
    assert_true(json_is_true(json_object_get(program, "is_conditional")));
    const json_t *counts = json_object_get(json, "counts");
    assert_int_equal(json_integer_value(json_object_get(counts, "programs")), 2);
    assert_int_equal(json_integer_value(json_object_get(counts, "programs_in_memory")), 1);
    json_decref(json);
    free(text);
    char *dot = write(&document, PLAN_FORMAT_DOT), *svg = write(&document, PLAN_FORMAT_SVG);
    assert_non_null(strstr(dot, "2 programs, 2 to compile"));
    assert_non_null(strstr(dot, "\\nffeeddccbbaa9988 sort.comp, to compile\""));
    assert_non_null(strstr(svg, ">1 program, 1 in memory<title>"));
    assert_non_null(strstr(svg, "\nffeeddccbbaa9988 sort.comp, to compile</title>"));
    free(dot);
    free(svg);
}

static void formats_have_names_and_media_types(void **state)
{
    (void)state;
    for (int i = 0; i <= PLAN_FORMAT_GLSL; i++) {
        assert_non_null(plan_format_name(i));
        assert_non_null(plan_format_media_type(i));
    }
    assert_null(plan_format_name(PLAN_FORMAT_GLSL + 1));
    assert_null(plan_format_media_type(-1));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(json_holds_every_requirement_and_pass),
        cmocka_unit_test(text_parts_what_is_required_from_what_is_not),
        cmocka_unit_test(drawings_escape_what_names_may_hold),
        cmocka_unit_test(long_reasons_are_cut_between_characters),
        cmocka_unit_test(programs_stand_with_their_passes_in_every_form),
        cmocka_unit_test(formats_have_names_and_media_types),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
