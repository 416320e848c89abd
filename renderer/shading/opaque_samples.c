/* SPDX-License-Identifier: MIT */
/* What shaders/shading/shade_pixels.comp.glsl asks for. */
#include "renderer/shading/opaque_samples.h"

#include <epoxy/gl.h>
#include <stdio.h>

#include "renderer/shading/accumulation.h"
#include "renderer/shading/atmosphere_light.h"
#include "renderer/shading/refraction.h"
#include "renderer/window/apart.h"

static void describe_as(const struct window_frame *frame, const struct surface_facts *facts,
                        bool is_apart, char text[SURFACE_DEFINES_BYTES])
{
    const char *compositing = facts->compositing;
    const struct view_screen *screen = &frame->view->screen;
    bool maps_here = screen->has_backdrop && !accumulation_maps(frame);
    bool has_choice = screen->mapping.operator_ != TONE_MAPPING_NEUTRAL;
    bool shows_map = view_has_environment(frame->view) && frame->view->environment_is_background;
    snprintf(text, SURFACE_DEFINES_BYTES, " SAMPLES=%d%s%s%s%s%s%s%s%s%s%s%s",
             frame->targets->samples,
             facts->has_shadow_maps && frame->needs->has_normal_offset ? " HAS_NORMAL_OFFSET" : "",
             is_apart ? " SAMPLES_APART" : "", compositing ? " LAYERS=" : "",
             compositing ? compositing : "",
             compositing && refraction_is_possible(frame) ? " HAS_REFRACTION" : "",
             screen->has_backdrop ? " HAS_BACKDROP" : "", accumulation_defines(frame),
             maps_here && has_choice ? " TONE_HAS_CHOICE" : "",
             shows_map ? " HAS_ENVIRONMENT_BACKGROUND" : "",
             frame->view->wants_deep ? " KEEPS_OPAQUE" : "",
             atmosphere_is_lit(frame) ? " HAS_ATMOSPHERE_LIGHT" : "");
}

static void describe(const struct window_frame *frame, const struct surface_facts *facts,
                     char text[SURFACE_DEFINES_BYTES])
{
    describe_as(frame, facts, false, text);
}

static void describe_apart(const struct window_frame *frame, const struct surface_facts *facts,
                           char text[SURFACE_DEFINES_BYTES])
{
    describe_as(frame, facts, true, text);
}

/* In the picture, or behind what a screen shows of it. */
void opaque_samples_set_background(const struct view *view, const struct gl_program *program)
{
    const struct view_screen *screen = &view->screen;
    const float *b = view->background, none[4] = {0};
    const float background[4] = {b[0] * b[3], b[1] * b[3], b[2] * b[3], b[3]};
    gl_program_set_f4(program, "u_background", screen->has_backdrop ? none : background);
    if (!screen->has_backdrop)
        return;
    float backdrop[4];
    view_backdrop(view, backdrop);
    gl_program_set_f4(program, "u_backdrop", backdrop);
    gl_program_set_f(program, "u_gain", tone_map_gain(&screen->mapping));
    if (screen->mapping.operator_ != TONE_MAPPING_NEUTRAL)
        gl_program_set_u(program, "u_operator", (uint32_t)screen->mapping.operator_);
}

static void bind_picture(const struct window_frame *frame, const struct gl_program *program)
{
    opaque_samples_set_background(frame->view, program);
    if (frame->targets->bent.name)
        refraction_bind(frame);
    accumulation_bind(frame);
    gl_program_set_u(program, "u_round", (uint32_t)frame->round);
    window_set_samples(frame, program);
    window_bind_targets(frame, program);
    if (frame->targets->parts.name)
        glBindImageTexture(1, frame->targets->parts.name, 0, GL_TRUE, 0, GL_READ_WRITE, GL_RGBA32F);
    if (frame->targets->opaque.name)
        glBindImageTexture(3, frame->targets->opaque.name, 0, GL_FALSE, 0, GL_WRITE_ONLY,
                           GL_RGBA32F);
    glBindImageTexture(0, frame->targets->image.name, 0, GL_FALSE, 0, GL_READ_WRITE, GL_RGBA32F);
}

static void bind(const struct window_frame *frame, const struct gl_program *program)
{
    bind_picture(frame, program);
    if (apart_is_possible(frame))
        glBindImageTexture(2, frame->targets->light.name, 0, GL_TRUE, 0, GL_WRITE_ONLY, GL_R32UI);
}

static void bind_apart(const struct window_frame *frame, const struct gl_program *program)
{
    bind_picture(frame, program);
    apart_bind(frame->targets);
}

const struct surface_kind opaque_samples = {
    .pass = "shade.opaque",
    .program = "shade_pixels.comp.glsl",
    .order = SURFACES_IN_ROWS,
    .slice_kind = TIME_SLICE_PIXELS,
    .describe = describe,
    .bind = bind,
};

const struct surface_kind samples_apart = {
    .pass = "shade.apart",
    .program = "shade_pixels.comp.glsl",
    .order = SURFACES_IN_ITEMS,
    .slice_kind = TIME_SLICE_PIXELS,
    .describe = describe_apart,
    .bind = bind_apart,
};

struct surface_set opaque_samples_of(const struct window_frame *frame)
{
    return (struct surface_set){
        .kind = &opaque_samples,
        .count = (uint64_t)frame->window.height,
        .unit_surfaces = (uint64_t)frame->window.width,
        .technique = frame->targets->samples > 1 ? "msaa4" : "",
        .because = "the color output was asked for",
    };
}

struct surface_set samples_apart_of(const struct window_frame *frame, uint32_t first,
                                    uint32_t count, bool is_counted)
{
    struct surface_set set = {
        .kind = &samples_apart,
        .first = first,
        .count = !count && is_counted ? apart_count(frame) : count,
        .unit_surfaces = (uint64_t)frame->targets->samples,
        .technique = "msaa4",
        .because = "samples are lit apart where light differs",
    };
    if (!count && !is_counted) {
        set.groups = &frame->targets->apart;
        set.groups_at_bytes = apart_groups_bytes_at(frame->targets);
    }
    return set;
}
