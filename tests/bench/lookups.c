/* SPDX-License-Identifier: MIT */
/* Dispatches the lookups of a window that has just been shaded. */
#include "tests/bench/lookups.h"

#include <epoxy/gl.h>
#include <stdio.h>

#include "shaders/shared/bindings.h"
#include "tests/bench/meter.h"

enum { STATISTICS_WORDS = 128, STATISTICS_LOOKUPS = 64 }; /* shaders/shading/lighting.glsl */

static const struct gl_program *lookup_program(const struct shade_desc *desc, bool is_silent,
                                               struct error *err)
{
    char material_defines[SHADER_NEEDS_TEXT_BYTES], light_defines[SHADER_NEEDS_TEXT_BYTES];
    char defines[512];
    const struct shader_needs *needs = desc->frame->needs;
    shader_needs_material_defines(needs->surface_kinds | needs->layer_kinds, material_defines);
    shader_needs_light_defines(needs, light_defines);
    snprintf(defines, sizeof defines, "HAS_LIGHTS HAS_SHADOWS%s%s%s %s %s",
             is_silent ? " LOOKUPS_LEFT_OUT" : "", material_defines, light_defines,
             light_lists_defines(desc->lists), shadow_system_defines(desc->shadows));
    return program_cache_get(desc->frame->programs,
                             &(struct program_desc){.label = "shadow.lookups",
                                                    .compute = "shadow_lookups.comp.glsl",
                                                    .defines = defines},
                             err);
}

/* statistics: not those of the frame, which are read after it. */
static bool ask(const struct shade *shade, struct gl_buffer *statistics,
                const struct shade_desc *desc, uint64_t count, bool is_silent,
                struct lookup_times *times, struct error *err)
{
    uint32_t words[STATISTICS_WORDS];
    const struct gl_program *program = lookup_program(desc, is_silent, err);
    if (!program)
        return false;
    gl_program_use(program);
    gl_program_set_u(program, "u_count", (uint32_t)count);
    gl_program_set_u(program, "u_width_px", (uint32_t)desc->frame->window.width);
    gl_buffer_clear_u32(statistics, 0, sizeof words, 0);
    gl_buffer_bind_storage(&shade->lights, BIND_LIGHTS);
    gl_buffer_bind_storage(statistics, BIND_STATISTICS);
    light_lists_bind(desc->lists, program);
    shadow_system_bind(desc->shadows, program);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);
    glFinish();
    double wall_ms = wall_now_ms(), cpu_ms = cpu_now_ms();
    window_dispatch_items(count);
    glFinish();
    *(is_silent ? &times->silent_cpu_ms : &times->asked_cpu_ms) += cpu_now_ms() - cpu_ms;
    *(is_silent ? &times->silent_wall_ms : &times->asked_wall_ms) += wall_now_ms() - wall_ms;
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    gl_buffer_read(statistics, 0, sizeof words, words);
    for (int i = STATISTICS_LOOKUPS; i < STATISTICS_WORDS; i++)
        times->lookups += is_silent ? 0 : words[i];
    return true;
}

bool lookups_measure(struct shade *shade, const struct shade_desc *desc, struct lookup_times *times,
                     struct error *err)
{
    struct traced_shadows points = {0};
    struct gl_buffer results = {0}, statistics = {0};
    *times = (struct lookup_times){0};
    if (desc->is_continued || desc->continues || !*shadow_system_defines(desc->shadows))
        return error_set(err, ERROR_INTERNAL, "lookups alone: no frame with all of its shadows");
    enum traced_outcome outcome = traced_shadows_collect(&points, desc->frame, desc->layers, err);
    if (outcome == TRACED_TOO_MANY)
        error_set(err, ERROR_INTERNAL, "lookups alone: too many points");
    bool ok = outcome == TRACED_COLLECTED;
    ok = ok &&
         gl_buffer_init(&results,
                        &(struct gl_buffer_desc){.label = "bench.lookups",
                                                 .size_bytes = points.window.count * 16},
                        err) &&
         gl_buffer_init(&statistics,
                        &(struct gl_buffer_desc){.label = "bench.statistics",
                                                 .size_bytes = STATISTICS_WORDS * 4,
                                                 .is_dynamic = true},
                        err);
    if (ok) {
        gl_buffer_bind_storage(&points.points, BIND_TRACED_POINTS);
        gl_buffer_bind_storage(&results, BIND_ENTRY_COLORS);
        ok = ask(shade, &statistics, desc, points.window.count, true, times, err) &&
             ask(shade, &statistics, desc, points.window.count, false, times, err);
    }
    gl_buffer_finish(&results);
    gl_buffer_finish(&statistics);
    traced_shadows_finish(&points);
    return ok;
}
