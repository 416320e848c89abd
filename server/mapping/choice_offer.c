/* SPDX-License-Identifier: MIT */
/* A row is an array: the technique's name, resolution, taps, samples, compression, prefilter, time,
 * the error, or null where that is not known, atmosphere samples, and transparency. */
#include "server/mapping/choice_offer.h"

#include <math.h>

static json_t *row_to_json(const struct choice_row *row)
{
    const struct quality_setting *setting = &row->setting;
    return json_pack("[s,i,i,i,f,i,f,o,i,i]", shadow_technique_name((int)setting->shadows),
                     setting->shadow_resolution, setting->shadow_taps, setting->samples,
                     setting->shadow_compression, setting->shadow_prefilter, row->ms,
                     isfinite(row->error) ? json_real(row->error) : json_null(),
                     setting->atmosphere_samples, (int)setting->transparency);
}

static json_t *rows_to_json(const struct choice_rows *rows)
{
    json_t *list = json_array();
    for (size_t i = 0; i < rows->count; i++)
        if (json_array_append_new(list, row_to_json(&rows->rows[i])) != 0) {
            json_decref(list);
            return NULL;
        }
    return list;
}

json_t *choice_offer_to_json(const struct choice_offer *offer)
{
    return json_pack("{s:o,s:o,s:I,s:I,s:b}", "view", rows_to_json(&offer->view), "scene",
                     rows_to_json(&offer->scene), "triangles", (json_int_t)offer->triangles,
                     "scene_lights", (json_int_t)offer->scene_lights, "has_grids",
                     offer->has_grids);
}

static bool row_from_json(json_t *json, struct choice_row *row)
{
    struct quality_setting *setting = &row->setting;
    const char *shadows;
    json_t *error;
    int transparency;
    if (json_unpack(json, "[s,i,i,i,F,i,F,o,i,i]", &shadows, &setting->shadow_resolution,
                    &setting->shadow_taps, &setting->samples, &setting->shadow_compression,
                    &setting->shadow_prefilter, &row->ms, &error, &setting->atmosphere_samples,
                    &transparency) != 0)
        return false;
    setting->transparency = (enum transparency)transparency;
    setting->shadows = shadow_technique_find(shadows);
    row->error = json_is_number(error) ? json_number_value(error) : INFINITY;
    row->bytes = 0;
    return setting->shadows != SHADOWS_COUNT && transparency_name(transparency);
}

static bool rows_from_json(const json_t *list, struct choice_rows *rows)
{
    rows->count = json_array_size(list);
    bool is_good = rows->count <= CHOICE_ROWS_MAX;
    for (size_t i = 0; is_good && i < rows->count; i++)
        is_good = row_from_json(json_array_get(list, i), &rows->rows[i]);
    return is_good;
}

bool choice_offer_from_json(const json_t *json, struct choice_offer *offer, struct error *err)
{
    *offer = (struct choice_offer){
        .triangles = (uint64_t)json_integer_value(json_object_get(json, "triangles")),
        .scene_lights = (uint64_t)json_integer_value(json_object_get(json, "scene_lights")),
        .has_grids = json_is_true(json_object_get(json, "has_grids"))};
    return (rows_from_json(json_object_get(json, "view"), &offer->view) &&
            rows_from_json(json_object_get(json, "scene"), &offer->scene)) ||
           error_set(err, ERROR_INTERNAL, "worker: a malformed offer of settings");
}
