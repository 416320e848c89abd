/* SPDX-License-Identifier: MIT */
/* What shading reads of the frame's shadow structures. */
#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/matrix.h"
#include "renderer/shadows/shadows_internal.h"
#include "renderer/shadows/technique.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

/* Rows of eye_from_world. */
static void get_eye_axes(const struct shadow_prepare_desc *desc, double axes[3][3])
{
    memcpy(axes, desc->eye_axes, sizeof desc->eye_axes);
    if (vec3_length(axes[0]) > 0)
        return;
    memset(axes, 0, sizeof desc->eye_axes);
    for (int k = 0; k < 3; k++)
        axes[k][k] = 1;
}

static void fill_record(const struct shadow_system *shadows, const struct shadow_map *map,
                        const struct shadow_prepare_desc *desc, struct shadow_record *record)
{
    const struct shadow_frame *frame = &map->frame;
    bool is_flat = frame->shape == SHADOW_ORTHOGRAPHIC;
    bool has_nodes = shadow_method_of_kind(map->kind)->has_nodes;
    double texel_width = 2 / (frame->scale[0] * map->resolution);
    *record = (struct shadow_record){
        .kind_shape_flags_resolution =
            map->kind | frame->shape << 4 | map->flags << 8 | (uint32_t)shadows->resolution << 16,
        .depth_base = (uint32_t)map->depths.first,
        .head_base = (uint32_t)map->heads.first,
        .event_base = (uint32_t)(has_nodes ? map->nodes.first : map->events.first),
        .projection = {{(float)frame->scale[0], (float)(is_flat ? frame->scale[1] : texel_width),
                        (float)(is_flat ? frame->depth_m : frame->near_m), map->keys_per_m}},
    };
    for (int k = 0; k < 3; k++)
        record->sigma.v[k] = (float)map->sigma[k];
    vec4 *axes[3] = {&record->axis_x, &record->axis_y, &record->axis_z};
    double from_eye[3], eye_axes[3][3];
    vec3_sub(desc->eye, frame->origin, from_eye);
    get_eye_axes(desc, eye_axes);
    for (int k = 0; k < 3; k++) {
        for (int c = 0; c < 3; c++)
            axes[k]->v[c] = (float)vec3_dot(frame->axis[k], eye_axes[c]);
        axes[k]->v[3] = (float)vec3_dot(frame->axis[k], from_eye);
    }
}

static void set_defines(struct shadow_system *shadows)
{
    struct shadow_features features = {{false}};
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

void shadow_system_bind(const struct shadow_system *shadows, const struct gl_program *program)
{
    static const struct {
        enum shadow_pool_kind kind;
        int stream;
        uint32_t unit;
    } views[] = {
        {SHADOW_POOL_DEPTHS, 0, UNIT_SHADOW_DEPTH},
        {SHADOW_POOL_HEADS, 0, UNIT_SHADOW_HEADS},
        {SHADOW_POOL_EVENTS, SHADOW_STREAM_EVENT, UNIT_SHADOW_EVENTS},
        {SHADOW_POOL_EVENTS, SHADOW_STREAM_KEYS, UNIT_SHADOW_KEYS},
        {SHADOW_POOL_EVENTS, SHADOW_STREAM_OBJECT, UNIT_SHADOW_ID},
        {SHADOW_POOL_EVENTS, SHADOW_STREAM_MEDIUM, UNIT_SHADOW_MEDIA},
        {SHADOW_POOL_NODES, 0, UNIT_SHADOW_NODES},
    };
    if (!shadows->defines[0])
        return;
    for (size_t i = 0; i < sizeof views / sizeof *views; i++)
        gl_texture_bind(shadow_store_view(&shadows->store, views[i].kind, views[i].stream),
                        views[i].unit);
    gl_texture_bind(&shadows->record_view, UNIT_SHADOW_RECORDS);
    gl_buffer_bind_storage(&shadows->records, BIND_SHADOWS);
    gl_program_set_u(program, "u_shadow_taps", (uint32_t)shadows->taps);
}
