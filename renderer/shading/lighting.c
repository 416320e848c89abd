/* SPDX-License-Identifier: MIT */
/* Programs, uniforms and dispatches of lighting. */
#include "renderer/shading/lighting.h"

#include <epoxy/gl.h>
#include <math.h>
#include <stdio.h>

#include "renderer/base/matrix.h"
#include "renderer/shading/atmosphere_light.h"
#include "renderer/shading/environment_maps.h"
#include "renderer/shading/smoke.h"
#include "renderer/window/time_slice_clock.h"

#include "shaders/shared/bindings.h"

enum { DEFINES_BYTES = 800 };

/* ---- programs ---- */

void lighting_media_defines(const struct window_frame *frame, const struct shade_facts *facts,
                            char text[MEDIA_DEFINES_BYTES])
{
    size_t planes = frame->view->clip_plane_count;
    int used = snprintf(text, MEDIA_DEFINES_BYTES, "%s%s", facts->has_media ? " HAS_MEDIA" : "",
                        facts->may_surround ? " MEDIA_SURROUND" : "");
    if (facts->has_media && planes)
        snprintf(text + used, MEDIA_DEFINES_BYTES - (size_t)used, " CUT_PLANES=%zu", planes);
}

/* The source that composites the transparent surfaces in view. */
static const char *compositing_of(const struct window_frame *frame, const struct shade_facts *facts)
{
    const struct transparency_method *method = facts->method;
    if (!facts->has_layers)
        return NULL;
    return frame->view->quality.faithful && method->compositing_published
               ? method->compositing_published
               : method->compositing;
}

/* Requirements of the program, in canonical order. */
static void describe(const struct window_frame *frame, const struct shade_facts *facts,
                     const struct light_chunk *chunk, const struct surface_kind *kind,
                     char text[DEFINES_BYTES])
{
    bool has_lights = frame->state->light_count > 0;
    bool has_shadows = has_lights && facts->shadows && *facts->shadows;
    const struct surface_facts own = {
        .has_shadow_maps = has_shadows && !facts->is_traced,
        .compositing = compositing_of(frame, facts),
    };
    char own_defines[SURFACE_DEFINES_BYTES] = "", media_defines[MEDIA_DEFINES_BYTES] = "",
         seen_defines[64] = "", grid_defines[SMOKE_DEFINES_BYTES];
    char material_defines[SHADER_NEEDS_TEXT_BYTES], light_defines[SHADER_NEEDS_TEXT_BYTES] = "";
    const struct shader_needs *needs = frame->needs;
    shader_needs_material_defines(kind->are_transparent ? needs->layer_kinds : needs->surface_kinds,
                                  material_defines);
    if (has_lights)
        shader_needs_light_defines(needs, light_defines);
    if (kind->describe)
        kind->describe(frame, &own, own_defines);
    if (facts->has_layers)
        lighting_media_defines(frame, facts, media_defines);
    if (needs->visibility_lobes)
        snprintf(seen_defines, sizeof seen_defines,
                 " HAS_ENVIRONMENT_VISIBILITY VISIBILITY_COUNT=%u", needs->visibility_lobes);
    smoke_defines(frame, grid_defines);
    snprintf(text, DEFINES_BYTES, "%s%s%s%s%s%s%s%s%s%s%s%s%s%s%s %s %s",
             has_lights ? "HAS_LIGHTS" : "", own.has_shadow_maps ? " HAS_SHADOWS" : "",
             frame->state->has_environment ? " HAS_ENVIRONMENT" : "",
             view_has_environment(frame->view) ? " HAS_ENVIRONMENT_MAP" : "", seen_defines,
             atmosphere_defines(frame), grid_defines,
             frame->camera->is_orthographic ? " IS_ORTHOGRAPHIC" : "",
             kind->source ? " SURFACES=" : "", kind->source ? kind->source : "", own_defines,
             media_defines, material_defines, light_defines,
             chunk->is_first && chunk->is_last ? ""
             : chunk->is_whole                 ? " HAS_LIGHT_PARTS"
                                               : " HAS_LIGHT_PARTS HAS_LIGHT_CHUNK",
             has_lights ? facts->lists : "", has_shadows ? facts->shadows : "");
}

static struct program_desc program_of(const struct surface_kind *kind, const char *defines)
{
    return (struct program_desc){
        .label = kind->program, .compute = kind->program, .defines = defines};
}

void lighting_list_program(const struct window_frame *frame, const struct shade_facts *facts,
                           const struct light_chunk *chunk, const struct surface_kind *kind,
                           bool is_conditional, struct program_list *list)
{
    char defines[DEFINES_BYTES];
    describe(frame, facts, chunk, kind, defines);
    const struct program_desc desc = program_of(kind, defines);
    program_list_add(list, kind->pass, &desc, is_conditional);
}

static const struct gl_program *get_program(const struct lighting *lighting,
                                            const struct surface_kind *kind, struct error *err)
{
    const struct window_frame *frame = lighting->desc->frame;
    char defines[DEFINES_BYTES];
    const struct shade_facts facts = shade_facts_of(lighting->desc);
    describe(frame, &facts, &lighting->chunk, kind, defines);
    const struct program_desc desc = program_of(kind, defines);
    return program_cache_get(frame->programs, &desc, err);
}

static void set_ground(const struct window_frame *frame, const struct gl_program *program)
{
    const struct state_ground_plane *ground = &frame->state->ground_plane;
    double from_eye[3], axes[3][3];
    float view[3];
    vec3_sub(ground->center, frame->camera->eye, from_eye);
    camera_axes(frame->camera, axes);
    for (int k = 0; k < 3; k++)
        view[k] = (float)vec3_dot(axes[k], from_eye);
    gl_program_set_f3(program, "u_ground_center", view);
    const float range[2] = {(float)ground->whole_m, (float)ground->reach_m};
    gl_program_set_f2(program, "u_ground_range", range);
}

/* What programs of all kinds read. */
static void bind(const struct lighting *lighting, const struct gl_program *program)
{
    const struct shade_desc *desc = lighting->desc;
    const struct window_frame *frame = desc->frame;
    const struct light_chunk *chunk = &lighting->chunk;
    window_set_view_ray(frame, program);
    window_set_clip_planes(frame, 1, program);
    bool has_map = view_has_environment(frame->view);
    if (frame->state->has_environment || has_map)
        window_set_world_axes(frame, program);
    if (has_map)
        environment_maps_bind(frame->environment_maps, frame->environment, program);
    if (atmosphere_is_there(frame))
        atmosphere_bind(frame, program);
    if (frame->state->grid_count)
        smoke_bind(frame, program);
    if (frame->needs->visibility_lobes)
        traced_shadows_bind_visibility(desc->seen, program);
    gl_program_set_f3(program, "u_sky", frame->state->sky);
    gl_program_set_f3(program, "u_ground", frame->state->ground);
    if (frame->state->ground_plane.is_there)
        set_ground(frame, program);
    gl_program_set_f(program, "u_taps", (float)light_taps(frame, desc->traced));
    gl_program_set_u2(program, "u_light_chunk", chunk->first, chunk->count);
    gl_program_set_u2(program, "u_light_part", chunk->is_first, chunk->is_last);
    gl_buffer_bind_storage(&lighting->shade->lights, BIND_LIGHTS);
    gl_buffer_bind_storage(&lighting->shade->statistics, BIND_STATISTICS);
    if (frame->state->light_count) {
        light_lists_bind(desc->lists, program);
        if (shader_needs_areas(frame->needs))
            light_areas_bind(&lighting->shade->areas, frame, program);
        if (desc->traced)
            traced_shadows_bind(desc->traced, program);
        else if (frame->needs->area_samples <= 1) /* else there are no maps, and units are shared */
            shadow_system_bind(desc->shadows, program);
    }
    desc->layers->method->bind(desc->layers, program);
}

/* ---- the pass ---- */

static const struct gl_program *begin(const struct lighting *lighting,
                                      const struct surface_set *set, struct error *err)
{
    const struct window_frame *frame = lighting->desc->frame;
    const struct gl_program *program = get_program(lighting, set->kind, err);
    if (!program)
        return NULL;
    gl_program_use(program);
    bind(lighting, program);
    set->kind->bind(frame, program);
    gpu_scope_begin(frame->timeline, &(struct gpu_scope_desc){.pass = set->kind->pass,
                                                              .because = set->because,
                                                              .technique = set->technique,
                                                              .stage = REPORT_SHADE});
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT |
                    GL_TEXTURE_FETCH_BARRIER_BIT | GL_FRAMEBUFFER_BARRIER_BIT |
                    (set->groups ? GL_COMMAND_BARRIER_BIT : 0));
    return program;
}

static void dispatch(const struct window_frame *frame, const struct surface_set *set,
                     const struct time_slices *slices, const struct gl_program *program)
{
    uint64_t first = set->first + slices->first, end = first + slices->count;
    gl_program_set_u(program, "u_first", (uint32_t)first);
    gl_program_set_u(program, "u_end", set->groups ? UINT32_MAX : (uint32_t)end);
    if (set->groups) {
        glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, set->groups->name);
        glDispatchComputeIndirect((GLintptr)set->groups_at_bytes);
        glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, 0);
    } else if (set->kind->order == SURFACES_IN_ROWS) {
        window_dispatch_rows(frame, (int)slices->count);
    } else {
        window_dispatch_items(slices->count);
    }
}

/* Where urgent frames may go first they would wait for all that the device was given. A set whose
 * size the device alone knows is one piece. */
static struct time_slices pieces_of(const struct lighting *lighting, const struct surface_set *set,
                                    bool may_yield)
{
    enum time_slice_kind kind = set->kind->slice_kind;
    uint64_t each = set->unit_surfaces ? set->unit_surfaces : 1;
    uint64_t surfaces =
        time_slice_pace_first(&lighting->desc->pace, kind, lighting->shade->first_slice);
    uint64_t first = may_yield ? (surfaces + each - 1) / each : 0;
    return time_slices_begin(set->groups ? 1 : set->count, first,
                             set->kind->order == SURFACES_IN_ROWS ? 8 : 64);
}

void lighting_tell(const struct lighting *lighting, double done)
{
    const struct shade_desc *desc = lighting->desc;
    double share = fmin((lighting->part + done) / lighting->parts, 1);
    if (desc->advance)
        desc->advance(desc->advance_context, share, fmin((1 - done) / lighting->parts, 1 - share));
}

static bool run_pass(const struct lighting *lighting, const struct surface_set *set,
                     struct error *err)
{
    const struct window_frame *frame = lighting->desc->frame;
    const struct yield_point *yield = set->groups ? NULL : lighting->desc->yield;
    struct time_slices slices = pieces_of(lighting, set, yield != NULL);
    struct time_slice_clock clock = {.timeline = frame->timeline,
                                     .is_software = frame->limits->is_software};
    const struct gl_program *program = begin(lighting, set, err);
    lighting_tell(lighting, 0);
    while (program && time_slices_next(&slices)) {
        time_slice_clock_begin(&clock);
        dispatch(frame, set, &slices, program);
        if (!yield || time_slices_is_last(&slices))
            break;
        time_slice_clock_end(&clock, &slices);
        lighting_tell(lighting, (double)(slices.first + slices.count) / (double)set->count);
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
        if (!yield_point_is_due(yield))
            continue;
        gpu_scope_end(frame->timeline);
        program = yield_point_run(yield, err) ? begin(lighting, set, err) : NULL;
    }
    time_slice_clock_finish(&clock);
    if (program)
        gpu_scope_end(frame->timeline);
    return program != NULL;
}

bool lighting_run(struct lighting *lighting, const struct surface_set *set, struct error *err)
{
    bool is_empty = !set->count && !set->groups;
    bool is_lit = is_empty || run_pass(lighting, set, err);
    lighting->part++;
    return is_lit;
}
