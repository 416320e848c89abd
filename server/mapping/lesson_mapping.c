/* SPDX-License-Identifier: MIT */
/* Numbers keep their bits: JSON has all 17 digits of them. */
#include "server/mapping/lesson_mapping.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { TERMS_AT = 3 };

static json_t *case_to_json(const struct learning_case *one)
{
    char view[17];
    snprintf(view, sizeof view, "%016" PRIx64, one->view);
    json_t *made = json_pack("[i,i,s]", (int)one->technique, (int)one->is_left_out, view);
    for (int i = 0; i < FORECAST_TERM_COUNT; i++)
        json_array_append_new(made, json_real(one->terms[i]));
    return made;
}

json_t *lesson_to_json(const struct frame_lesson *lesson)
{
    json_t *cases = json_array();
    json_array_append_new(cases, case_to_json(&lesson->frame));
    for (int i = 0; i < SHADOWS_COUNT; i++)
        if (shadow_technique_is_candidate((enum shadow_technique)i))
            json_array_append_new(cases, case_to_json(&lesson->frames[i]));
    return json_pack("{s:b,s:f,s:o}", "timed", lesson->is_timed, "ms", lesson->alone_ms, "cases",
                     cases);
}

static bool case_from_json(const json_t *json, struct learning_case *one)
{
    json_int_t technique = json_integer_value(json_array_get(json, 0));
    const char *view = json_string_value(json_array_get(json, 2));
    if (json_array_size(json) != TERMS_AT + FORECAST_TERM_COUNT || technique < 0 ||
        technique >= SHADOWS_COUNT || !view)
        return false;
    *one = (struct learning_case){.technique = (enum shadow_technique)technique,
                                  .is_left_out = json_integer_value(json_array_get(json, 1)) == 1,
                                  .view = strtoull(view, NULL, 16)};
    for (int i = 0; i < FORECAST_TERM_COUNT; i++) {
        const json_t *term = json_array_get(json, (size_t)(TERMS_AT + i));
        one->terms[i] = json_number_value(term);
        if (!json_is_number(term) || !(one->terms[i] >= 0))
            return false;
    }
    return true;
}

/* One that `auto` compares. */
static bool candidate_from_json(const json_t *json, struct learning_case *one)
{
    return case_from_json(json, one) && shadow_technique_is_candidate(one->technique);
}

bool lesson_from_json(const json_t *json, struct frame_lesson *lesson)
{
    const json_t *cases = json_object_get(json, "cases");
    *lesson = (struct frame_lesson){
        .is_timed = json_is_true(json_object_get(json, "timed")),
        .alone_ms = json_number_value(json_object_get(json, "ms")),
    };
    bool is_good = candidate_from_json(json_array_get(cases, 0), &lesson->frame);
    for (size_t i = 1; is_good && i < json_array_size(cases); i++) {
        struct learning_case one;
        is_good = candidate_from_json(json_array_get(cases, i), &one);
        if (is_good)
            lesson->frames[one.technique] = one;
    }
    return is_good;
}

json_t *time_lesson_to_json(const struct time_lesson *lesson)
{
    return json_pack("{s:o,s:f,s:f,s:b}", "case", case_to_json(&lesson->frame), "ms",
                     lesson->took_ms, "bytes", lesson->fresh_bytes, "compiled",
                     lesson->has_compiled);
}

bool time_lesson_from_json(const json_t *json, struct time_lesson *lesson)
{
    const json_t *ms = json_object_get(json, "ms"), *bytes = json_object_get(json, "bytes");
    *lesson = (struct time_lesson){
        .took_ms = json_number_value(ms),
        .fresh_bytes = json_number_value(bytes),
        .has_compiled = json_is_true(json_object_get(json, "compiled")),
    };
    return case_from_json(json_object_get(json, "case"), &lesson->frame) && json_is_number(ms) &&
           json_is_number(bytes) && lesson->took_ms > 0 && lesson->fresh_bytes >= 0;
}
