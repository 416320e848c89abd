/* SPDX-License-Identifier: MIT */
/* What shading reads of the frame's shadow structures. */
#include <assert.h>
#include <assert.h>
#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/matrix.h"
#include "renderer/shadows/shadows_internal.h"
#include "renderer/shadows/technique.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

void shadow_eye_axes(const struct shadow_prepare_desc *desc, double axes[3][3])
{
    memcpy(axes, desc->eye_axes, sizeof desc->eye_axes);
    if (vec3_length(axes[0]) > 0)
        return;
    memset(axes, 0, sizeof desc->eye_axes);
    for (int k = 0; k < 3; k++)
        axes[k][k] = 1;
}

static_assert(SHADOWS_COUNT <= 16, "the number of a technique has 4 bits of a record");

static void fill_record(const struct shadow_system *shadows, const struct shadow_map *map,
                        const struct shadow_prepare_desc *desc, struct shadow_record *record)
{
    const struct shadow_frame *frame = &map->frame;
    bool is_flat = frame->shape == SHADOW_ORTHOGRAPHIC;
    const struct shadow_structure *structure = map->method->structure;
    double texel_width = 2 / (frame->scale[0] * map->resolution);
    *record = (struct shadow_record){
        .technique_shape_flags_resolution = (uint32_t)map->method->id | frame->shape << 4 |
                                            map->flags << 8 | (uint32_t)shadows->resolution << 16,
        .depth_base = (uint32_t)map->depths.first,
        .head_base = (uint32_t)map->heads.first,
        .projection = {{(float)frame->scale[0], (float)(is_flat ? frame->scale[1] : texel_width),
                        (float)(is_flat ? frame->depth_m : frame->near_m)}},
    };
    if (structure->record)
        structure->record(map, record);
    vec4 *axes[3] = {&record->axis_x, &record->axis_y, &record->axis_z};
    double from_eye[3], eye_axes[3][3];
    vec3_sub(desc->eye, frame->origin, from_eye);
    shadow_eye_axes(desc, eye_axes);
    for (int k = 0; k < 3; k++) {
        for (int c = 0; c < 3; c++)
            axes[k]->v[c] = (float)vec3_dot(frame->axis[k], eye_axes[c]);
        axes[k]->v[3] = (float)vec3_dot(frame->axis[k], from_eye);
    }
}

static void set_defines(struct shadow_system *shadows)
{
    struct shadow_features features = {.has = {false}};
    for (size_t i = 0; i < shadows->light_count; i++)
        if (shadows->light_maps[i])
            shadow_features_add(&features, shadows->light_maps[i]);
    shadow_features_write(&features, shadows->defines);
}

bool shadow_records_upload(struct shadow_system *shadows, const struct shadow_prepare_desc *desc,
                           struct error *err)
{
    struct shadow_record *records = calloc(shadows->light_count + 1, sizeof *records);
    if (!records)
        return error_set(err, ERROR_NO_MEMORY, "%zu shadow records", shadows->light_count);
    uint32_t count = 0;
    for (size_t i = 0; i < shadows->light_count; i++) {
        if (!shadows->light_maps[i])
            continue;
        fill_record(shadows, shadows->light_maps[i], desc, &records[count]);
        shadows->light_records[i] = count++;
    }
    bool ok =
        gl_buffer_reserve(&shadows->records,
                          &(struct gl_buffer_desc){.label = "shadow.records",
                                                   .size_bytes = (count + 1) * sizeof *records,
                                                   .is_uploaded = true},
                          false, err) &&
        gl_texture_follow_buffer(&shadows->record_view, "shadow.records", GL_RGBA32UI,
                                 &shadows->records, err);
    if (ok)
        gl_buffer_write(&shadows->records, 0, count * sizeof *records, records);
    free(records);
    if (!ok)
        return false;
    gl_buffer_bind_storage(&shadows->records, BIND_SHADOWS);
    set_defines(shadows);
    return true;
}

static bool is_in_use(const struct shadow_system *shadows, const struct shadow_structure *structure)
{
    for (size_t i = 0; i < shadows->light_count; i++)
        if (shadows->light_maps[i] && shadows->light_maps[i]->method->structure == structure)
            return true;
    return false;
}

void shadow_system_bind(const struct shadow_system *shadows, const struct gl_program *program)
{
    if (!shadows->defines[0])
        return;
    gl_texture_bind(shadow_store_view(&shadows->store, SHADOW_POOL_DEPTHS, 0), UNIT_SHADOW_DEPTH);
    const struct shadow_structure *structure;
    for (size_t i = 0; (structure = shadow_structure_at(i)); i++)
        if (structure->bind && is_in_use(shadows, structure))
            structure->bind(&shadows->store);
    gl_texture_bind(&shadows->record_view, UNIT_SHADOW_RECORDS);
    gl_buffer_bind_storage(&shadows->records, BIND_SHADOWS);
    gl_program_set_u(program, "u_shadow_taps", (uint32_t)shadows->taps);
}
