/* SPDX-License-Identifier: MIT */
/* Two passes over the light of a window: the first finds candidates, the second decides. */
#include "renderer/window/apart.h"

#include <assert.h>
#include <epoxy/gl.h>

#include "shaders/shared/bindings.h"
#include "shaders/shared/contrast.h"

_Static_assert(TARGETS_APART_HEAD_BYTES == 4 * APART_HEAD_WORDS, "heads of lists");

enum { CANDIDATES, FOUND, LISTS, COUNT_BYTES_AT = 12 }; /* the count: in a head */

static const char pass_name[] = "shade.contrast";
static const struct program_desc contrast_program = {.label = "light_contrast.comp.glsl",
                                                     .compute = "light_contrast.comp.glsl"},
                                 apart_program = {.label = "light_apart.comp.glsl",
                                                  .compute = "light_apart.comp.glsl",
                                                  .defines = "SAMPLES=4"};

bool apart_is_possible(const struct window_frame *frame)
{
    return frame->targets->samples > 1 && frame->state->light_count > 0;
}

void apart_list_programs(const struct window_frame *frame, struct program_list *list)
{
    if (!apart_is_possible(frame))
        return;
    program_list_add(list, pass_name, &contrast_program, false);
    program_list_add(list, pass_name, &apart_program, false);
}

static void bind_list(const struct targets *targets, int list, uint32_t binding)
{
    uint64_t bytes = targets_apart_list_bytes(targets);
    gl_buffer_bind_storage_range(&targets->apart, (uint64_t)list * bytes, bytes, binding);
}

uint64_t apart_groups_bytes_at(const struct targets *targets)
{
    return FOUND * targets_apart_list_bytes(targets);
}

uint64_t apart_count_bytes_at(const struct targets *targets)
{
    return apart_groups_bytes_at(targets) + COUNT_BYTES_AT;
}

void apart_bind(const struct targets *targets)
{
    bind_list(targets, FOUND, BIND_APART);
}

static const struct gl_program *use(const struct window_frame *frame,
                                    const struct program_desc *desc, struct error *err)
{
    const struct gl_program *program = program_cache_get(frame->programs, desc, err);
    if (!program)
        return NULL;
    gl_program_use(program);
    window_bind_targets(frame, program);
    gl_texture_bind(&frame->targets->light, UNIT_LIGHT);
    glBindSampler(UNIT_LIGHT, 0);
    return program;
}

/* Its first row is on top, that of the shaders at the bottom. */
static void set_borders(const struct camera_window *w, const struct gl_program *program)
{
    const bool goes_on[4] = {w->x > 0, w->image_width > w->x + w->width,
                             w->image_height > w->y + w->height, w->y > 0};
    uint32_t bits = 0;
    for (int k = 0; k < 4; k++)
        bits |= (uint32_t)goes_on[k] << k;
    gl_program_set_u(program, "u_goes_on", bits);
}

static bool find_candidates(const struct window_frame *frame, struct error *err)
{
    struct targets *targets = frame->targets;
    for (uint64_t list = 0; list < LISTS; list++)
        gl_buffer_clear_u32(&targets->apart, list * targets_apart_list_bytes(targets),
                            COUNT_BYTES_AT + 4, 0);
    const struct gl_program *program = use(frame, &contrast_program, err);
    if (!program)
        return false;
    set_borders(&frame->window, program);
    bind_list(targets, CANDIDATES, BIND_CANDIDATES);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);
    window_dispatch_pixels(frame);
    return true;
}

static bool look_into_candidates(const struct window_frame *frame, struct error *err)
{
    const struct gl_program *program = use(frame, &apart_program, err);
    if (!program)
        return false;
    bind_list(frame->targets, CANDIDATES, BIND_APART);
    bind_list(frame->targets, FOUND, BIND_APART_FOUND);
    gl_program_set_u(program, "u_first", 0);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_COMMAND_BARRIER_BIT);
    glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, frame->targets->apart.name);
    glDispatchComputeIndirect(0);
    glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, 0);
    return true;
}

bool apart_find(const struct window_frame *frame, struct error *err)
{
    assert(frame->targets->width <= 1 << APART_SIDE_BITS &&
           frame->targets->height <= 1 << APART_SIDE_BITS);
    gpu_scope_begin(frame->timeline,
                    &(struct gpu_scope_desc){.pass = pass_name,
                                             .because = "samples are lit apart where light differs",
                                             .technique = "msaa4",
                                             .stage = REPORT_SHADE});
    bool ok = find_candidates(frame, err) && look_into_candidates(frame, err);
    gpu_scope_end(frame->timeline);
    return ok;
}

uint32_t apart_count(const struct window_frame *frame)
{
    uint32_t count = 0; /* a lost context reads nothing */
    gpu_timeline_will_wait(frame->timeline);
    gl_buffer_read(&frame->targets->apart, apart_count_bytes_at(frame->targets), sizeof count,
                   &count);
    return count;
}
