/* SPDX-License-Identifier: MIT */
/* Keys, space and dispatches of kept depths. */
#include "renderer/shading/smoke_depths.h"

#include <epoxy/gl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/matrix.h"
#include "renderer/scene/smoke_lattice.h"
#include "renderer/shading/smoke.h"
#include "renderer/shadows/technique.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

enum {
    DEFINES_BYTES = 64,
    BUDGET_SHARE = 16,
    WRITTEN = 63,           /* points that a work group of 64 writes */
    PIECE = WRITTEN * 1024, /* points between two yield points */
};
static const double REACH_CELLS = 4; /* around the light: nodes off the boxes ask the nearest place
                                      */

uint64_t smoke_depths_most(const struct gl_limits *limits, uint64_t budget_bytes)
{
    uint64_t most = budget_bytes / BUDGET_SHARE;
    uint64_t texels = (uint64_t)limits->max_texture_buffer_texels * SMOKE_DEPTH_BYTES;
    uint64_t block = (uint64_t)limits->max_storage_block_bytes;
    most = texels < most ? texels : most;
    return block < most ? block : most;
}

/* ---- whether ---- */

bool smoke_depths_serve(const struct window_frame *frame)
{
    return !shadow_quality_holds_grids(&frame->view->quality) &&
           smoke_lattice_serves(frame->view, frame->state,
                                frame->depths.is_anywhere ? NULL : frame->camera,
                                frame->depths.most_bytes);
}

void smoke_depths_defines(const struct window_frame *frame, char text[32])
{
    text[0] = 0;
    if (smoke_depths_serve(frame))
        snprintf(text, 32, " SMOKE_DEPTH_CHANNELS=%d", smoke_lattice_of(frame->state).channels);
}

static struct program_desc program_of(const struct scene_state *state, char defines[DEFINES_BYTES])
{
    int used = snprintf(defines, DEFINES_BYTES, "GRID_COUNT=%zu", state->grid_count);
    if (state->shadow_plane_count)
        used += snprintf(defines + used, DEFINES_BYTES - (size_t)used, " GRID_CUTS=%zu",
                         state->shadow_plane_count);
    snprintf(defines + used, DEFINES_BYTES - (size_t)used, " SMOKE_DEPTH_CHANNELS=%d",
             smoke_lattice_of(state).channels);
    return (struct program_desc){
        .label = "smoke.depths", .compute = "smoke_depths.comp.glsl", .defines = defines};
}

static const char pass[] = "smoke.depths";

void smoke_depths_list_program(const struct window_frame *frame, bool is_conditional,
                               struct program_list *list)
{
    char defines[DEFINES_BYTES];
    const struct program_desc desc = program_of(frame->state, defines);
    program_list_add(list, pass, &desc, is_conditional);
}

/* ---- what they are for ---- */

static void add_doubles(struct content_key *key, const double *values, size_t count)
{
    content_key_add(key, values, count * sizeof *values);
}

static struct content_key key_of_grids(const struct window_frame *frame)
{
    const struct scene_state *state = frame->state;
    struct content_key key = content_key_begin();
    content_key_add_word(&key, frame->smoke->key.words[0]);
    content_key_add_word(&key, frame->smoke->key.words[1]);
    content_key_add_word(&key, state->grid_count);
    for (size_t i = 0; i < state->grid_count; i++)
        content_key_add_word(&key, state->grids[i].shadow_hash);
    content_key_add_word(&key, state->shadow_plane_count);
    add_doubles(&key, state->shadow_planes[0], 4 * state->shadow_plane_count);
    return key;
}

static struct content_key key_of_light(struct content_key key, const struct state_light *light)
{
    const double sizes[2] = {(double)light->range, (double)light->outer_cone_rad};
    content_key_add_word(&key, (uint64_t)light->type);
    add_doubles(&key, light->position, 3);
    add_doubles(&key, light->direction, 3);
    add_doubles(&key, sizes, 2);
    return key;
}

/* ---- room ---- */

static void forget(struct smoke_depths *depths)
{
    free(depths->keys);
    depths->keys = NULL;
    depths->light_count = 0;
}

static bool make_room(struct smoke_depths *depths, const struct scene_state *state,
                      struct error *err)
{
    const struct smoke_lattice lattice = smoke_lattice_of(state);
    const struct gl_buffer_desc desc = {.label = "smoke.depths",
                                        .size_bytes = smoke_lattice_bytes(state)};
    if (depths->keys && depths->light_count == state->light_count &&
        depths->points == lattice.points && depths->channels == lattice.channels)
        return true;
    forget(depths);
    if (depths->depths.size_bytes != desc.size_bytes) {
        gl_buffer_finish(&depths->depths);
        if (!gl_buffer_init(&depths->depths, &desc, err))
            return false;
    }
    depths->keys = calloc(state->light_count, sizeof *depths->keys);
    if (!depths->keys)
        return error_set(err, ERROR_NO_MEMORY, "depths of grids for %zu lights",
                         state->light_count);
    depths->light_count = state->light_count;
    depths->points = lattice.points;
    depths->channels = lattice.channels;
    return gl_texture_follow_buffer(&depths->depth_view, "smoke.depths", GL_RG16F, &depths->depths,
                                    err);
}

/* ---- finding them ---- */

/* The world from the middle of the grids: depths know no other eye. */
static struct camera space_of(const struct scene_state *state)
{
    struct camera space = {.right = {1, 0, 0}, .up = {0, 1, 0}, .back = {0, 0, 1}};
    for (int k = 0; k < 3; k++) {
        double low = INFINITY, high = -INFINITY;
        for (size_t i = 0; i < state->grid_count; i++) {
            low = fmin(low, state->grids[i].bounds_min[k]);
            high = fmax(high, state->grids[i].bounds_max[k]);
        }
        space.eye[k] = 0.5 * (low + high);
    }
    return space;
}

/* The longest way through a cell of the lattice [m]. */
static double cell_m(const struct scene_state *state)
{
    double longest = 0;
    for (size_t i = 0; i < state->grid_count; i++) {
        const struct state_grid *grid = &state->grids[i];
        double sum = 0;
        uint32_t steps[3];
        smoke_lattice_steps(grid, steps);
        for (int k = 0; k < 3; k++)
            sum += vec3_length(&grid->world_from_voxel[4 * k]) * grid->values.size[k] / steps[k];
        longest = fmax(longest, sum);
    }
    return longest;
}

static void set_lattice(const struct window_frame *frame, const struct gl_program *program)
{
    const struct scene_state *state = frame->state;
    for (size_t i = 0; i < state->grid_count; i++) {
        uint32_t steps[3];
        char name[48];
        smoke_lattice_steps(&state->grids[i], steps);
        snprintf(name, sizeof name, "u_smoke_steps[%zu]", i);
        gl_program_set_u3(program, name, steps);
    }
    gl_program_set_u(program, "u_smoke_points", (uint32_t)frame->smoke->depths.points);
}

static void set_cuts(const struct scene_state *state, const struct camera *space,
                     const struct gl_program *program)
{
    for (size_t i = 0; i < state->shadow_plane_count; i++) {
        const double *plane = state->shadow_planes[i];
        char name[48];
        snprintf(name, sizeof name, "u_grid_cuts[%zu]", i);
        gl_program_set_f4(program, name,
                          (const float[4]){(float)plane[0], (float)plane[1], (float)plane[2],
                                           (float)(plane[3] + vec3_dot(plane, space->eye))});
    }
    if (state->shadow_plane_count)
        gl_program_set_u(program, "u_grid_light_cuts", 0xffffffffu);
}

static void set_light(const struct state_light *light, const struct camera *space, double reach_m,
                      const struct gl_program *program)
{
    float place[4] = {0, 0, 0, light->type == SCENE_LIGHT_DIRECTIONAL ? 0 : 1}, cone[4];
    for (int k = 0; k < 3; k++) {
        place[k] =
            (float)(place[3] > 0 ? light->position[k] - space->eye[k] : -light->direction[k]);
        cone[k] = (float)light->direction[k];
    }
    cone[3] = light->type == SCENE_LIGHT_SPOT ? cosf(light->outer_cone_rad) : -1;
    gl_program_set_f4(program, "u_light", place);
    gl_program_set_f4(program, "u_cone", cone);
    gl_program_set_f(program, "u_range_m", light->range);
    gl_program_set_f(program, "u_reach_m", (float)reach_m);
}

struct finding { /* of one frame */
    const struct window_frame *frame;
    struct smoke_depths *depths;
    struct camera space;
    double reach_m;
};

static const struct gl_program *begin(const struct finding *finding, struct error *err)
{
    const struct window_frame *frame = finding->frame;
    char defines[DEFINES_BYTES];
    const struct program_desc desc = program_of(frame->state, defines);
    const struct gl_program *program = program_cache_get(frame->programs, &desc, err);
    if (!program)
        return NULL;
    gl_program_use(program);
    gl_texture_bind(&finding->depths->record_view, UNIT_GRID_RECORDS);
    gl_texture_bind(&frame->smoke->brick_view, UNIT_GRID_BRICKS);
    gl_texture_bind(&frame->smoke->value_view, UNIT_GRID_VALUES);
    gl_buffer_bind_storage(&finding->depths->depths, BIND_SMOKE_DEPTHS);
    set_cuts(frame->state, &finding->space, program);
    set_lattice(frame, program);
    gpu_scope_begin(frame->timeline, &(struct gpu_scope_desc){.pass = pass,
                                                              .because = "lights shine through "
                                                                         "density grids",
                                                              .technique = "lattice",
                                                              .stage = REPORT_SHADE});
    return program;
}

static void dispatch(const struct finding *finding, size_t light, uint64_t first, uint64_t end,
                     const struct gl_program *program)
{
    set_light(&finding->frame->state->lights[light], &finding->space, finding->reach_m, program);
    gl_program_set_u(program, "u_slot", (uint32_t)light);
    gl_program_set_u(program, "u_first", (uint32_t)first);
    gl_program_set_u(program, "u_end", (uint32_t)end);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);
    window_dispatch_items((end - first + WRITTEN - 1) / WRITTEN * 64);
}

static bool find_light(const struct finding *finding, size_t light, const struct yield_point *yield,
                       struct error *err)
{
    const struct window_frame *frame = finding->frame;
    uint64_t points = finding->depths->points;
    const struct gl_program *program = begin(finding, err);
    for (uint64_t first = 0; program && first < points; first += PIECE) {
        dispatch(finding, light, first, first + PIECE < points ? first + PIECE : points, program);
        if (!yield_point_is_due(yield))
            continue;
        gpu_scope_end(frame->timeline);
        program = yield_point_run(yield, err) ? begin(finding, err) : NULL;
    }
    if (program)
        gpu_scope_end(frame->timeline);
    return program != NULL;
}

bool smoke_depths_prepare(const struct window_frame *frame, const struct yield_point *yield,
                          struct error *err)
{
    const struct scene_state *state = frame->state;
    struct smoke_depths *depths = &frame->smoke->depths;
    struct finding finding = {.frame = frame,
                              .depths = depths,
                              .space = space_of(state),
                              .reach_m = REACH_CELLS * cell_m(state)};
    struct content_key grids = key_of_grids(frame);
    bool ok = make_room(depths, state, err);
    bool has_records = false;
    for (size_t i = 0; ok && i < state->light_count; i++) {
        struct content_key key = key_of_light(grids, &state->lights[i]);
        if (!state->lights[i].casts_shadow || content_key_equals(depths->keys[i], key))
            continue;
        depths->keys[i] = (struct content_key){{0}};
        ok = (has_records || smoke_upload_records(frame->smoke, state, &finding.space,
                                                  &depths->records, &depths->record_view, err)) &&
             find_light(&finding, i, yield, err);
        has_records = true;
        if (ok)
            depths->keys[i] = key;
    }
    return ok;
}

void smoke_depths_bind(const struct window_frame *frame, const struct gl_program *program)
{
    const struct smoke_depths *depths = &frame->smoke->depths;
    const double *sigma = frame->state->grids[0].sigma;
    double most = fmax(sigma[0], fmax(sigma[1], sigma[2]));
    float unit[3];
    for (int k = 0; k < 3; k++)
        unit[k] = depths->channels == 1 ? (float)(sigma[k] / most) : 1;
    gl_texture_bind(&depths->depth_view, UNIT_SMOKE_DEPTHS);
    gl_program_set_f3(program, "u_smoke_depth_unit", unit);
    set_lattice(frame, program);
}

void smoke_depths_finish(struct smoke_depths *depths)
{
    gl_texture_finish(&depths->record_view);
    gl_texture_finish(&depths->depth_view);
    gl_buffer_finish(&depths->records);
    gl_buffer_finish(&depths->depths);
    forget(depths);
    *depths = (struct smoke_depths){.keys = NULL};
}

uint64_t smoke_depths_size_bytes(const struct smoke_depths *depths)
{
    return depths->records.size_bytes + depths->depths.size_bytes;
}
