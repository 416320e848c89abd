/* SPDX-License-Identifier: MIT */
/* Levels of the picture without what bends light, and the picture with it. */
#include "renderer/shading/refraction.h"

#include <epoxy/gl.h>
#include <stdio.h>

#include "renderer/shading/accumulation.h"
#include "renderer/shading/opaque_samples.h"

#include "shaders/shared/bindings.h"

enum { DEFINES_BYTES = 128 };

static const char blur_pass[] = "refraction.blur", picture_pass[] = "refraction";
static const char technique[] = "screen-space";
static const struct program_desc levels_program = {.label = "refraction_levels.comp.glsl",
                                                   .compute = "refraction_levels.comp.glsl"};

bool refraction_is_possible(const struct window_frame *frame)
{
    return frame->needs->refracts;
}

static struct program_desc picture_program(const struct window_frame *frame,
                                           char defines[DEFINES_BYTES])
{
    const struct view_screen *screen = &frame->view->screen;
    bool maps_here = screen->has_backdrop && !accumulation_maps(frame);
    bool has_choice = screen->mapping.operator_ != TONE_MAPPING_NEUTRAL;
    snprintf(defines, DEFINES_BYTES, "SAMPLES=%d%s%s%s%s", frame->targets->samples,
             frame->camera->is_orthographic ? " IS_ORTHOGRAPHIC" : "",
             screen->has_backdrop ? " HAS_BACKDROP" : "", accumulation_defines(frame),
             maps_here && has_choice ? " TONE_HAS_CHOICE" : "");
    return (struct program_desc){
        .label = "refraction.comp.glsl", .compute = "refraction.comp.glsl", .defines = defines};
}

void refraction_list_programs(const struct window_frame *frame, struct program_list *list)
{
    char defines[DEFINES_BYTES];
    const struct program_desc picture = picture_program(frame, defines);
    if (!refraction_is_possible(frame))
        return;
    program_list_add(list, blur_pass, &levels_program, true);
    program_list_add(list, picture_pass, &picture, true);
}

bool refraction_prepare(const struct window_frame *frame, struct error *err)
{
    return targets_prepare_refraction(frame->targets, err);
}

void refraction_bind(const struct window_frame *frame)
{
    const struct targets *targets = frame->targets;
    glBindImageTexture(3, targets->bent_parts.name, 0, GL_TRUE, 0, GL_READ_WRITE, GL_RGBA32F);
    glBindImageTexture(4, targets->bent.name, 0, GL_FALSE, 0, GL_READ_WRITE, GL_R32UI);
    glBindImageTexture(5, targets->levels.name, 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA32F);
}

static void bind_levels(const struct targets *targets)
{
    gl_texture_bind(&targets->levels, UNIT_REFRACTION_LEVELS);
    glBindSampler(UNIT_REFRACTION_LEVELS, 0);
}

static bool blur(const struct window_frame *frame, struct error *err)
{
    const struct targets *targets = frame->targets;
    const struct gl_program *program = program_cache_get(frame->programs, &levels_program, err);
    if (!program)
        return false;
    gl_program_use(program);
    bind_levels(targets);
    for (int level = 1; level < targets->levels.levels; level++) {
        int width = targets->width >> level, height = targets->height >> level;
        glMemoryBarrier(GL_SHADER_IMAGE_ACCESS_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);
        glBindImageTexture(0, targets->levels.name, level, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA32F);
        gl_program_set_u(program, "u_level", (uint32_t)level - 1);
        glDispatchCompute((GLuint)((width > 0 ? width : 1) + 7) / 8,
                          (GLuint)((height > 0 ? height : 1) + 7) / 8, 1);
    }
    return true;
}

static bool complete(const struct window_frame *frame, const struct layers *layers,
                     struct error *err)
{
    char defines[DEFINES_BYTES];
    const struct program_desc desc = picture_program(frame, defines);
    const struct gl_program *program = program_cache_get(frame->programs, &desc, err);
    if (!program)
        return false;
    gl_program_use(program);
    window_set_view_ray(frame, program);
    window_bind_targets(frame, program);
    opaque_samples_set_background(frame->view, program);
    layers->method->bind(layers, program);
    draw_arena_bind_materials(frame->arena);
    refraction_bind(frame);
    accumulation_bind(frame);
    bind_levels(frame->targets);
    glBindImageTexture(0, frame->targets->image.name, 0, GL_FALSE, 0, GL_READ_WRITE, GL_RGBA32F);
    glMemoryBarrier(GL_SHADER_IMAGE_ACCESS_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT |
                    GL_SHADER_STORAGE_BARRIER_BIT);
    window_dispatch_pixels(frame);
    return true;
}

static void begin(const struct window_frame *frame, const char *pass, const char *because)
{
    gpu_scope_begin(frame->timeline, &(struct gpu_scope_desc){.pass = pass,
                                                              .because = because,
                                                              .technique = technique,
                                                              .stage = REPORT_SHADE});
}

bool refraction_draw(const struct window_frame *frame, const struct layers *layers,
                     const char *because, struct error *err)
{
    begin(frame, blur_pass, because);
    bool ok = blur(frame, err);
    gpu_scope_end(frame->timeline);
    if (!ok)
        return false;
    begin(frame, picture_pass, because);
    ok = complete(frame, layers, err);
    gpu_scope_end(frame->timeline);
    return ok;
}
