/* SPDX-License-Identifier: MIT */
/* Shadow queries at points, by a compute shader. */
#include "tests/support/gl_shadow_probe.h"

#include <epoxy/gl.h>
#include <stdio.h>

#include "renderer/shadows/shadows_internal.h"
#include "shaders/shared/bindings.h"

static const struct gl_program *probe_program(const struct shadow_system *shadows,
                                              struct program_cache *programs,
                                              const struct shadow_probe_desc *desc,
                                              struct error *err)
{
    char defines[320];
    bool has_tolerance = desc->tolerance[0] != 0 || desc->tolerance[1] != 0;
    snprintf(defines, sizeof defines, "%s%s%s", shadow_system_defines(shadows),
             has_tolerance ? " PROBE_TOLERANCE" : "", desc->asks_nothing ? " PROBE_NOTHING" : "");
    return program_cache_get(programs,
                             &(struct program_desc){.label = "shadow.probe",
                                                    .compute = "shadow_probe.comp.glsl",
                                                    .defines = defines},
                             err);
}

bool shadow_probe_run(const struct shadow_system *shadows, struct program_cache *programs,
                      const struct shadow_probe_desc *desc, float (*out)[4], struct error *err)
{
    const uint32_t row = 32768; /* groups */
    const struct shadow_probe_point *points = desc->points;
    const uint32_t count = desc->count;
    const struct gl_program *program = probe_program(shadows, programs, desc, err);
    struct gl_buffer in = {0}, results = {0};
    struct gl_texture view = {0};
    bool ok = program != NULL;
    ok = ok && gl_buffer_init(&in,
                              &(struct gl_buffer_desc){.label = "shadow.probe.points",
                                                       .size_bytes = count * sizeof *points,
                                                       .data = points},
                              err);
    ok = ok && gl_texture_init_buffer(&view, "shadow.probe.points", GL_RGBA32UI, &in, err);
    ok = ok && gl_buffer_init(&results,
                              &(struct gl_buffer_desc){.label = "shadow.probe.results",
                                                       .size_bytes = count * sizeof *out},
                              err);
    if (ok) {
        uint32_t groups = (count + 63) / 64;
        gl_program_use(program);
        shadow_system_bind(shadows, program);
        gl_program_set_u(program, "u_count", count);
        gl_program_set_f4(program, "u_tolerance",
                          (float[4]){desc->tolerance[0], desc->tolerance[1]});
        gl_texture_bind(&view, UNIT_LIGHT_ITEMS);
        gl_buffer_bind_storage(&results, BIND_ENTRY_COLORS);
        for (int i = 0; i < (desc->repeat > 1 ? desc->repeat : 1); i++)
            glDispatchCompute(groups < row ? groups : row, (groups + row - 1) / row, 1);
        gl_buffer_read(&results, 0, count * sizeof *out, out);
    }
    gl_texture_finish(&view);
    gl_buffer_finish(&in);
    gl_buffer_finish(&results);
    return ok;
}

const struct shadow_map *shadow_system_map(const struct shadow_system *shadows, size_t light)
{
    return light < shadows->light_count ? shadows->light_maps[light] : NULL;
}

const struct shadow_store *shadow_system_store(const struct shadow_system *shadows)
{
    return &shadows->store;
}
