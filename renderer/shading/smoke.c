/* SPDX-License-Identifier: MIT */
/* Values of density grids on the device, and the columns in which their light is found. */
#include "renderer/shading/smoke.h"

#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/matrix.h"
#include "renderer/scene/atmosphere_grid.h"
#include "renderer/scene/grid_texels.h"
#include "renderer/scene/smoke_nodes.h"
#include "renderer/shading/atmosphere_light.h"
#include "renderer/shadows/technique.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

/* ---- values ---- */

static bool upload(struct gl_buffer *buffer, const char *label, uint64_t bytes, const void *data,
                   struct error *err)
{
    const struct gl_buffer_desc desc = {.label = label, .size_bytes = bytes, .data = data};
    gl_buffer_finish(buffer);
    return gl_buffer_init(buffer, &desc, err);
}

static bool upload_values(struct smoke *smoke, const struct scene *scene, struct error *err)
{
    struct grid_texels texels;
    if (!grid_texels_init(&texels, scene, err))
        return false;
    bool ok =
        upload(&smoke->bricks, "smoke.bricks", texels.brick_count * sizeof *texels.bricks,
               texels.bricks, err) &&
        upload(&smoke->values, "smoke.values", texels.filled_count * sizeof *texels.pairs,
               texels.pairs, err) &&
        gl_texture_follow_buffer(&smoke->brick_view, "smoke.bricks", GL_R32UI, &smoke->bricks,
                                 err) &&
        gl_texture_follow_buffer(&smoke->value_view, "smoke.values", GL_RG32F, &smoke->values, err);
    free(smoke->first_brick);
    smoke->first_brick = texels.first_brick;
    texels.first_brick = NULL;
    grid_texels_finish(&texels);
    return ok;
}

/* ---- records ---- */

static void fill_row(const double voxel_from_world[16], int i, const struct camera *camera,
                     vec4 *row)
{
    const double *m = voxel_from_world;
    double axes[3][3], offset = m[12 + i];
    camera_axes(camera, axes);
    for (int k = 0; k < 3; k++) {
        double sum = 0;
        for (int j = 0; j < 3; j++)
            sum += m[4 * j + i] * axes[k][j];
        row->v[k] = (float)sum;
        offset += m[4 * k + i] * camera->eye[k];
    }
    row->v[3] = (float)offset;
}

static void fill_record(const struct smoke *smoke, const struct state_grid *grid,
                        const struct camera *camera, struct grid_record *r)
{
    *r = (struct grid_record){.row_0 = {{0}}};
    fill_row(grid->voxel_from_world, 0, camera, &r->row_0);
    fill_row(grid->voxel_from_world, 1, camera, &r->row_1);
    fill_row(grid->voxel_from_world, 2, camera, &r->row_2);
    double dark = state_grid_dark_m(grid);
    for (int k = 0; k < 3; k++) {
        r->size_brick.v[k] = grid->values.size[k];
        r->sigma_dark.v[k] = (float)grid->sigma[k];
        r->color_anisotropy.v[k] = grid->color[k];
    }
    r->size_brick.v[3] = smoke->first_brick[grid->index];
    r->sigma_dark.v[3] = dark < 1e30 ? (float)dark : 1e30f;
    r->color_anisotropy.v[3] = grid->anisotropy;
}

bool smoke_upload_records(const struct smoke *smoke, const struct scene_state *state,
                          const struct camera *camera, struct gl_buffer *records,
                          struct gl_texture *view, struct error *err)
{
    struct grid_record *written = calloc(state->grid_count, sizeof *written);
    uint64_t bytes = state->grid_count * sizeof *written;
    if (!written)
        return error_set(err, ERROR_NO_MEMORY, "%zu density grids", state->grid_count);
    for (size_t i = 0; i < state->grid_count; i++)
        fill_record(smoke, &state->grids[i], camera, &written[i]);
    bool ok =
        gl_buffer_reserve(records,
                          &(struct gl_buffer_desc){
                              .label = "smoke.records", .size_bytes = bytes, .is_uploaded = true},
                          false, err) &&
        gl_texture_follow_buffer(view, "smoke.records", GL_RGBA32UI, records, err);
    if (ok)
        gl_buffer_write(records, 0, bytes, written);
    free(written);
    return ok;
}

bool smoke_prepare(struct smoke *smoke, struct content_key key, const struct scene_state *state,
                   const struct camera *camera, struct error *err)
{
    if (!state->grid_count)
        return true;
    if (!smoke->first_brick || !content_key_equals(smoke->key, key)) {
        smoke->key = (struct content_key){{0}};
        if (!upload_values(smoke, state->scene, err))
            return false;
        smoke->key = key;
    }
    return smoke_upload_records(smoke, state, camera, &smoke->records, &smoke->record_view, err);
}

void smoke_finish(struct smoke *smoke)
{
    gl_texture_finish(&smoke->brick_view);
    gl_texture_finish(&smoke->value_view);
    gl_texture_finish(&smoke->record_view);
    gl_buffer_finish(&smoke->bricks);
    gl_buffer_finish(&smoke->values);
    gl_buffer_finish(&smoke->records);
    smoke_depths_finish(&smoke->depths);
    free(smoke->first_brick);
    *smoke = (struct smoke){.first_brick = NULL};
}

uint64_t smoke_size_bytes(const struct smoke *smoke)
{
    return smoke->bricks.size_bytes + smoke->values.size_bytes + smoke->records.size_bytes +
           smoke_depths_size_bytes(&smoke->depths);
}

/* ---- what programs need ---- */

bool smoke_is_lit(const struct window_frame *frame)
{
    return frame->state->grid_count > 0 && frame->state->light_count > 0;
}

void smoke_defines(const struct window_frame *frame, char text[SMOKE_DEFINES_BYTES])
{
    size_t planes = frame->view->clip_plane_count;
    text[0] = 0;
    if (!frame->state->grid_count)
        return;
    int used =
        snprintf(text, SMOKE_DEFINES_BYTES, " HAS_GRIDS GRID_COUNT=%zu", frame->state->grid_count);
    if (planes)
        used += snprintf(text + used, SMOKE_DEFINES_BYTES - (size_t)used, " GRID_CUTS=%zu", planes);
    if (shadow_quality_holds_grids(&frame->view->quality))
        snprintf(text + used, SMOKE_DEFINES_BYTES - (size_t)used, " HAS_GRID_BOXES");
}

uint64_t smoke_loop_steps(const struct scene_state *state)
{
    uint64_t steps = 0;
    for (size_t i = 0; i < state->grid_count; i++)
        for (int k = 0; k < 3; k++) /* the way crosses each plane once, and begins between two */
            steps += state->grids[i].values.size[k] + 2;
    return steps;
}

static void set_nodes(const struct window_frame *frame, const struct gl_program *program)
{
    const struct smoke_nodes nodes = smoke_nodes_of(frame->view, frame->state, frame->camera);
    gl_program_set_f4(program, "u_smoke_nodes",
                      (const float[4]){(float)nodes.first_m, (float)nodes.length_m,
                                       (float)nodes.growth, (float)nodes.cells});
}

static void set_cuts(const struct window_frame *frame, const struct gl_program *program)
{
    const struct view *view = frame->view;
    uint32_t of_light = 0;
    double axes[3][3];
    camera_axes(frame->camera, axes);
    for (size_t i = 0; i < view->clip_plane_count; i++) {
        const double *plane = view->clip_planes[i];
        char name[48];
        snprintf(name, sizeof name, "u_grid_cuts[%zu]", i);
        gl_program_set_f4(
            program, name,
            (const float[4]){(float)vec3_dot(axes[0], plane), (float)vec3_dot(axes[1], plane),
                             (float)vec3_dot(axes[2], plane),
                             (float)(plane[3] + vec3_dot(plane, frame->camera->eye))});
        if (!view->cuts || !view->cuts[i].spares_shadows)
            of_light |= 1u << i;
    }
    gl_program_set_u(program, "u_grid_light_cuts", of_light);
}

void smoke_bind_values(const struct window_frame *frame, const struct gl_program *program)
{
    const struct smoke *smoke = frame->smoke;
    gl_texture_bind(&smoke->record_view, UNIT_GRID_RECORDS);
    gl_texture_bind(&smoke->brick_view, UNIT_GRID_BRICKS);
    gl_texture_bind(&smoke->value_view, UNIT_GRID_VALUES);
    set_cuts(frame, program);
}

void smoke_bind(const struct window_frame *frame, const struct gl_program *program)
{
    float ambient[3];
    smoke_bind_values(frame, program);
    if (frame->targets->smoke_view.name)
        gl_texture_bind(&frame->targets->smoke_view, UNIT_SMOKE_LIGHT);
    set_nodes(frame, program);
    atmosphere_find_around(frame, ambient);
    gl_program_set_f3(program, "u_smoke_ambient", ambient);
}

/* ---- the light in them ---- */

static uint64_t count_nodes(const struct atmosphere_grid *grid)
{
    return atmosphere_columns(grid) * (uint64_t)grid->slices;
}

bool smoke_begin(const struct window_frame *frame, const struct yield_point *yield,
                 struct error *err)
{
    const struct atmosphere_grid grid = atmosphere_grid_of(frame->view, &frame->window);
    return targets_prepare_smoke(frame->targets, count_nodes(&grid) * SMOKE_NODE_BYTES, err) &&
           (!smoke_depths_serve(frame) || smoke_depths_prepare(frame, yield, err));
}

static void bind_nodes(const struct window_frame *frame, const struct gl_program *program)
{
    gl_buffer_bind_storage(&frame->targets->smoke, BIND_SMOKE_LIGHT);
    gl_program_set_u2(program, "u_size_px", (uint32_t)frame->window.width,
                      (uint32_t)frame->window.height);
    if (smoke_depths_serve(frame))
        smoke_depths_bind(frame, program);
}

static void describe_nodes(const struct window_frame *frame, const struct surface_facts *facts,
                           char text[SURFACE_DEFINES_BYTES])
{
    (void)facts;
    smoke_depths_defines(frame, text);
}

const struct surface_kind smoke_nodes = {
    .pass = "smoke.light",
    .program = "smoke_light.comp.glsl",
    .order = SURFACES_IN_ITEMS,
    .slice_kind = TIME_SLICE_LAYERS,
    .describe = describe_nodes,
    .bind = bind_nodes,
};

struct surface_set smoke_set(const struct window_frame *frame)
{
    const struct atmosphere_grid grid = atmosphere_grid_of(frame->view, &frame->window);
    return (struct surface_set){
        .kind = &smoke_nodes,
        .count = count_nodes(&grid),
        .technique = "froxels",
        .because = "lights shine into density grids",
    };
}
