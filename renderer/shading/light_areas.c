/* SPDX-License-Identifier: MIT */
/* Areas of lights in a buffer texture, and the lobes that they are seen through in another. */
#include "renderer/shading/light_areas.h"

#include <epoxy/gl.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "renderer/shading/area_lobes.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

/* Once for all frames. */
static bool upload_lobes(struct light_areas *areas, struct error *err)
{
    static const char label[] = "area.lobes";
    const struct gl_buffer_desc desc = {
        .label = label, .size_bytes = AREA_LOBES_BYTES, .data = area_lobes};
    if (areas->lobes.name)
        return true;
    return gl_buffer_init(&areas->lobes, &desc, err) &&
           gl_texture_init_buffer(&areas->lobe_view, label, GL_RGBA32F, &areas->lobes, err);
}

bool light_areas_upload(struct light_areas *areas, const struct scene_state *state,
                        const struct camera *camera, bool has_form, struct error *err)
{
    static const char label[] = "frame.areas";
    double axes[3][3];
    camera_axes(camera, axes);
    uint64_t bytes = state->light_count * sizeof(struct area_record);
    struct area_record *records = calloc(state->light_count + 1, sizeof *records);
    if (!records)
        return error_set(err, ERROR_NO_MEMORY, "areas of %zu lights", state->light_count);
    for (size_t i = 0; i < state->light_count; i++) {
        const struct state_light *light = &state->lights[i];
        if (!state_light_is_area(light))
            continue;
        for (int k = 0; k < 3; k++) {
            records[i].half_u.v[k] = (float)vec3_dot(axes[k], light->half_u);
            records[i].half_v.v[k] = (float)vec3_dot(axes[k], light->half_v);
        }
        records[i].half_u.v[3] = light->type == SCENE_LIGHT_DISK;
        records[i].half_v.v[3] = (float)(1 / light->area_m2);
    }
    bool ok = (!has_form || upload_lobes(areas, err)) &&
              gl_buffer_reserve(&areas->records,
                                &(struct gl_buffer_desc){
                                    .label = label, .size_bytes = bytes, .is_uploaded = true},
                                false, err) &&
              gl_texture_follow_buffer(&areas->view, label, GL_RGBA32F, &areas->records, err);
    if (ok)
        gl_buffer_write(&areas->records, 0, bytes, records);
    free(records);
    return ok;
}

void light_areas_bind(const struct light_areas *areas, const struct window_frame *frame,
                      const struct gl_program *program)
{
    const struct camera_window *w = &frame->window;
    gl_texture_bind(&areas->view, UNIT_LIGHT_AREAS);
    if (frame->needs->has_area_form) {
        gl_texture_bind(&areas->lobe_view, UNIT_AREA_LOBES);
        return;
    }
    gl_program_set_u(program, "u_area_fixed", 0); /* but where shadows are as published */
    gl_program_set_u(program, "u_area_samples", frame->needs->area_samples);
    gl_program_set_u2(program, "u_area_origin", (uint32_t)w->x, (uint32_t)(w->y + w->height - 1));
}

void light_areas_finish(struct light_areas *areas)
{
    gl_texture_finish(&areas->lobe_view);
    gl_buffer_finish(&areas->lobes);
    gl_texture_finish(&areas->view);
    gl_buffer_finish(&areas->records);
}
