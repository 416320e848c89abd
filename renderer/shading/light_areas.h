/* SPDX-License-Identifier: MIT */
/* Where the areas of lights lie, for shading programs that take points on them
 * (shaders/lights/light_area.glsl) or integrate over them (shaders/lights/area_form.glsl).
 * Thread: GL. */
#ifndef VITRAIL_RENDERER_SHADING_LIGHT_AREAS_H
#define VITRAIL_RENDERER_SHADING_LIGHT_AREAS_H

#include "renderer/window/window.h"

struct light_areas {          /* zeroed = empty */
    struct gl_buffer records; /* area_record[], by light */
    struct gl_texture view;
    struct gl_buffer lobes; /* area_lobe_record[]; empty until a frame has the form */
    struct gl_texture lobe_view;
};

/* Once per frame whose shader_needs take area samples, or has_area_form: its lights in the
 * camera's view space. */
MUST_CHECK bool light_areas_upload(struct light_areas *areas, const struct scene_state *state,
                                   const struct camera *camera, bool has_form, struct error *err);
/* For programs with HAS_AREA_SAMPLES or HAS_AREA_FORM. */
void light_areas_bind(const struct light_areas *areas, const struct window_frame *frame,
                      const struct gl_program *program);
void light_areas_finish(struct light_areas *areas);

#endif
