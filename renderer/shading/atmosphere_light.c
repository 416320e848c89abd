/* SPDX-License-Identifier: MIT */
/* The grid of the haze, its passes and uniforms. */
#include "renderer/shading/atmosphere_light.h"

#include <epoxy/gl.h>
#include <stdio.h>

#include "protocol/haze_taps.h"
#include "renderer/base/matrix.h"
#include "renderer/environment/environment.h"
#include "renderer/scene/atmosphere_grid.h"
#include "renderer/shading/light_chunks.h"

#include "shaders/shared/bindings.h"

static const char reach_pass[] = "atmosphere.reach", sum_pass[] = "atmosphere.sum";
static const char technique[] = "froxels", because[] = "lights shine into the atmosphere";

bool atmosphere_is_lit(const struct window_frame *frame)
{
    return view_has_atmosphere(frame->view) && frame->state->light_count > 0;
}

bool atmosphere_is_there(const struct window_frame *frame)
{
    return view_has_atmosphere(frame->view) || frame->state->grid_count > 0;
}

const char *atmosphere_defines(const struct window_frame *frame)
{
    return atmosphere_is_there(frame) ? " HAS_ATMOSPHERE" : "";
}

/* ---- the grid ---- */

static void set_slices(const struct window_frame *frame, const struct gl_program *program)
{
    const struct atmosphere_slices slices =
        atmosphere_slices_of(frame->view, frame->state, frame->camera);
    gl_program_set_f4(
        program, "u_atmosphere_slices",
        (const float[4]){(float)slices.begin_m, (float)slices.length_m, (float)slices.front, 0});
}

static void set_grid(const struct window_frame *frame, const struct gl_program *program)
{
    const struct atmosphere_grid grid = atmosphere_grid_of(frame->view, &frame->window);
    const uint32_t size[3] = {(uint32_t)grid.columns, (uint32_t)grid.rows, (uint32_t)grid.slices};
    gl_program_set_u3(program, "u_atmosphere_grid", size);
    gl_program_set_i2(program, "u_atmosphere_first", grid.first_x, grid.first_y);
    gl_program_set_f(program, "u_atmosphere_side_px", (float)grid.side_px);
    if (view_has_atmosphere(frame->view))
        set_slices(frame, program);
}

/* ---- uniforms ---- */

void atmosphere_find_around(const struct window_frame *frame, float around[3])
{
    const struct scene_state *state = frame->state;
    double map[3] = {0, 0, 0};
    if (view_has_environment(frame->view))
        environment_light_mean(frame->environment, map);
    for (int k = 0; k < 3; k++) {
        double hemisphere = state->has_environment ? 0.5 * (state->sky[k] + state->ground[k]) : 0;
        around[k] = (float)(hemisphere + map[k]);
    }
}

void atmosphere_bind_depth(const struct window_frame *frame, const struct gl_program *program)
{
    const struct view_atmosphere *air = &frame->view->atmosphere;
    double axes[3][3], rate = air->falloff_m > 0 ? 1 / air->falloff_m : 0;
    camera_axes(frame->camera, axes);
    gl_program_set_f4(program, "u_atmosphere",
                      (const float[4]){(float)air->density_per_m, (float)rate,
                                       (float)((frame->camera->eye[1] - air->base_m) * rate),
                                       (float)air->anisotropy});
    gl_program_set_f3(program, "u_atmosphere_up",
                      (const float[3]){(float)axes[0][1], (float)axes[1][1], (float)axes[2][1]});
}

static void set_scattering(const struct window_frame *frame, const struct gl_program *program)
{
    const struct view_atmosphere *air = &frame->view->atmosphere;
    float ambient[3];
    gl_program_set_f3(program, "u_atmosphere_color", air->color);
    atmosphere_find_around(frame, ambient);
    for (int k = 0; k < 3; k++)
        ambient[k] *= air->color[k];
    gl_program_set_f3(program, "u_atmosphere_ambient", ambient);
}

void atmosphere_bind(const struct window_frame *frame, const struct gl_program *program)
{
    atmosphere_bind_depth(frame, program);
    set_scattering(frame, program);
    set_grid(frame, program);
    if (frame->targets->atmosphere_view.name)
        gl_texture_bind(&frame->targets->atmosphere_view, UNIT_ATMOSPHERE_SUMS);
}

/* ---- the passes ---- */

static struct program_desc reach_program(const struct window_frame *frame, char defines[64])
{
    snprintf(defines, 64, "SAMPLES=%d%s", frame->targets->samples,
             frame->camera->is_orthographic ? " IS_ORTHOGRAPHIC" : "");
    return (struct program_desc){.label = "atmosphere_reach.comp.glsl",
                                 .compute = "atmosphere_reach.comp.glsl",
                                 .defines = defines};
}

const struct program_desc atmosphere_sum_program = {.label = "atmosphere_sum.comp.glsl",
                                                    .compute = "atmosphere_sum.comp.glsl"};

void atmosphere_list_programs(const struct window_frame *frame, bool is_traced,
                              struct program_list *list)
{
    char defines[64];
    const struct program_desc reach = reach_program(frame, defines);
    if (!is_traced)
        program_list_add(list, reach_pass, &reach, false);
    program_list_add(list, sum_pass, &atmosphere_sum_program, false);
}

/* Runs a program once per column or corner. */
static bool run(const struct window_frame *frame, const char *pass, const struct program_desc *desc,
                uint64_t count, struct error *err)
{
    const struct gl_program *program = program_cache_get(frame->programs, desc, err);
    if (!program)
        return false;
    gpu_scope_begin(frame->timeline, &(struct gpu_scope_desc){.pass = pass,
                                                              .because = because,
                                                              .technique = technique,
                                                              .stage = REPORT_SHADE});
    gl_program_use(program);
    window_set_view_ray(frame, program);
    window_bind_targets(frame, program);
    set_grid(frame, program);
    gl_buffer_bind_storage(&frame->targets->atmosphere, BIND_ATMOSPHERE);
    gl_buffer_bind_storage(&frame->targets->atmosphere_reach, BIND_ATMOSPHERE_REACH);
    gl_buffer_bind_storage(&frame->targets->atmosphere_sums, BIND_ATMOSPHERE_SUMS);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT |
                    GL_FRAMEBUFFER_BARRIER_BIT);
    window_dispatch_items(count);
    gpu_scope_end(frame->timeline);
    return true;
}

static bool prepare(const struct window_frame *frame, const struct atmosphere_grid *grid,
                    struct error *err)
{
    uint64_t columns = atmosphere_columns(grid);
    uint64_t slices = (uint64_t)grid->slices;
    return targets_prepare_atmosphere(
        frame->targets, columns * slices * ATMOSPHERE_SLICE_BYTES, columns * sizeof(float),
        atmosphere_corners(grid) * slices * ATMOSPHERE_SUM_BYTES, err);
}

bool atmosphere_begin(const struct window_frame *frame, struct error *err)
{
    const struct atmosphere_grid grid = atmosphere_grid_of(frame->view, &frame->window);
    char defines[64];
    const struct program_desc reach = reach_program(frame, defines);
    return prepare(frame, &grid, err) &&
           run(frame, reach_pass, &reach, atmosphere_columns(&grid), err);
}

bool atmosphere_end(const struct window_frame *frame, struct error *err)
{
    const struct atmosphere_grid grid = atmosphere_grid_of(frame->view, &frame->window);
    return run(frame, sum_pass, &atmosphere_sum_program, atmosphere_corners(&grid), err);
}

/* Where the points of a round lie in their quarters of slices: one round has them in the middle. */
static double round_offset(const struct window_frame *frame)
{
    return (frame->round + 0.5) / frame->rounds;
}

bool atmosphere_trace(const struct window_frame *frame, struct traced_shadows *traced,
                      struct error *err)
{
    const struct atmosphere_grid grid = atmosphere_grid_of(frame->view, &frame->window);
    struct raytrace_shadow_haze haze = {.size = &grid, .offset = round_offset(frame)};
    return prepare(frame, &grid, err) && traced_shadows_light_haze(traced, frame, &haze, err) &&
           atmosphere_end(frame, err);
}

void atmosphere_bind_points(const struct window_frame *frame, const struct gl_program *program)
{
    int taps = haze_taps((int)light_taps(frame, false));
    gl_program_set_u(program, "u_shadow_taps", (uint32_t)taps);
    gl_program_set_f(program, "u_taps", (float)taps);
    gl_buffer_bind_storage(&frame->targets->atmosphere, BIND_ATMOSPHERE);
    gl_buffer_bind_storage(&frame->targets->atmosphere_reach, BIND_ATMOSPHERE_REACH);
    gl_program_set_u2(program, "u_size_px", (uint32_t)frame->window.width,
                      (uint32_t)frame->window.height);
    gl_program_set_f(program, "u_atmosphere_offset", (float)round_offset(frame));
}

const struct surface_kind atmosphere_points = {
    .pass = "atmosphere.light",
    .program = "atmosphere_light.comp.glsl",
    .order = SURFACES_IN_ITEMS,
    .slice_kind = TIME_SLICE_LAYERS,
    .bind = atmosphere_bind_points,
};

struct surface_set atmosphere_set(const struct window_frame *frame)
{
    const struct atmosphere_grid grid = atmosphere_grid_of(frame->view, &frame->window);
    return (struct surface_set){
        .kind = &atmosphere_points,
        .count = atmosphere_columns(&grid) * (uint64_t)grid.slices,
        .technique = technique,
        .because = "lights shine into the atmosphere",
    };
}
