/* SPDX-License-Identifier: MIT */
/* A dispatch behind each round. */
#include "renderer/shading/accumulation.h"

#include <epoxy/gl.h>

#include "renderer/shading/opaque_samples.h"

enum { UNIT_BEHIND = 6 }; /* image unit of u_behind in the programs that write it */

static const char pass[] = "accumulate";

bool accumulation_maps(const struct window_frame *frame)
{
    return (frame->rounds > 1 || frame->has_glow) && frame->view->screen.has_backdrop;
}

bool accumulation_is_there(const struct window_frame *frame)
{
    return frame->rounds > 1 || accumulation_maps(frame);
}

const char *accumulation_defines(const struct window_frame *frame)
{
    return accumulation_maps(frame) ? " MAPPED_LATER" : "";
}

void accumulation_bind(const struct window_frame *frame)
{
    if (accumulation_maps(frame))
        glBindImageTexture(UNIT_BEHIND, frame->targets->behind.name, 0, GL_FALSE, 0, GL_READ_WRITE,
                           GL_RGBA32F);
}

static struct program_desc program_of(const struct window_frame *frame)
{
    const struct view_screen *screen = &frame->view->screen;
    bool has_choice = screen->mapping.operator_ != TONE_MAPPING_NEUTRAL;
    return (struct program_desc){
        .label = "accumulate.comp.glsl",
        .compute = "accumulate.comp.glsl",
        .defines = !screen->has_backdrop ? ""
                   : has_choice          ? "HAS_BACKDROP TONE_HAS_CHOICE"
                                         : "HAS_BACKDROP",
    };
}

void accumulation_list_programs(const struct window_frame *frame, struct program_list *list)
{
    const struct program_desc desc = program_of(frame);
    if (accumulation_is_there(frame))
        program_list_add(list, pass, &desc, false);
}

static void bind(const struct window_frame *frame)
{
    const struct targets *targets = frame->targets;
    glBindImageTexture(0, targets->image.name, 0, GL_FALSE, 0, GL_READ_WRITE, GL_RGBA32F);
    glBindImageTexture(1, targets->sum.name, 0, GL_FALSE, 0, GL_READ_WRITE, GL_RGBA32F);
    if (!accumulation_maps(frame))
        return;
    glBindImageTexture(2, targets->behind.name, 0, GL_FALSE, 0, GL_READ_ONLY, GL_RGBA32F);
    glBindImageTexture(3, targets->behind_sum.name, 0, GL_FALSE, 0, GL_READ_WRITE, GL_RGBA32F);
}

bool accumulation_add(const struct window_frame *frame, const char *because, struct error *err)
{
    const struct program_desc desc = program_of(frame);
    const struct gl_program *program = program_cache_get(frame->programs, &desc, err);
    if (!program)
        return false;
    gpu_scope_begin(frame->timeline, &(struct gpu_scope_desc){
                                         .pass = pass, .because = because, .stage = REPORT_SHADE});
    gl_program_use(program);
    gl_program_set_u2(program, "u_size_px", (uint32_t)frame->window.width,
                      (uint32_t)frame->window.height);
    gl_program_set_f(program, "u_share", 1 / (float)frame->rounds);
    gl_program_set_u(program, "u_is_first", frame->round == 0);
    gl_program_set_u(program, "u_is_last", frame->round + 1 == frame->rounds);
    opaque_samples_set_background(frame->view, program);
    bind(frame);
    glMemoryBarrier(GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
    window_dispatch_pixels(frame);
    gpu_scope_end(frame->timeline);
    return true;
}
