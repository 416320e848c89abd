/* SPDX-License-Identifier: MIT */
/* A dispatch for each face of a light, of a thread for each texel. */
#include "renderer/shadows/shadow_linked_grids.h"

#include <epoxy/gl.h>
#include <stdio.h>

#include "renderer/base/matrix.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

enum { DEFINES_BYTES = 64 };

static struct program_desc program_of(const struct scene_state *state, char defines[DEFINES_BYTES])
{
    int used =
        snprintf(defines, DEFINES_BYTES, "SHADOW_FAITHFUL GRID_COUNT=%zu", state->grid_count);
    if (state->shadow_plane_count)
        snprintf(defines + used, DEFINES_BYTES - (size_t)used, " GRID_CUTS=%zu",
                 state->shadow_plane_count);
    return (struct program_desc){.label = "shadow.linked.grids",
                                 .compute = "shadow_linked_grids.comp.glsl",
                                 .defines = defines};
}

void shadow_linked_list_grids(const struct scene_state *state, struct program_list *list)
{
    char defines[DEFINES_BYTES];
    const struct program_desc desc = program_of(state, defines);
    program_list_add(list, "shadow.linked", &desc, false);
}

/* In the space that the eye sees the grids in. */
static void turn(const struct shadow_scene *scene, const double world[3], double factor,
                 float turned[3])
{
    for (int k = 0; k < 3; k++)
        turned[k] = (float)(factor * vec3_dot(scene->eye_axes[k], world));
}

static void set_cuts(const struct shadow_scene *scene, const struct gl_program *program)
{
    const struct scene_state *state = scene->state;
    for (size_t i = 0; i < state->shadow_plane_count; i++) {
        const double *plane = state->shadow_planes[i];
        float cut[4];
        char name[48];
        turn(scene, plane, 1, cut);
        cut[3] = (float)(plane[3] + vec3_dot(plane, scene->eye));
        snprintf(name, sizeof name, "u_grid_cuts[%zu]", i);
        gl_program_set_f4(program, name, cut);
    }
    if (state->shadow_plane_count)
        gl_program_set_u(program, "u_grid_light_cuts", 0xffffffffu);
}

static void set_light(const struct shadow_build *build, const struct shadow_scene *scene,
                      uint64_t first_node, const struct gl_program *program)
{
    const struct shadow_map *map = build->map;
    const struct shadow_frame *frame = &map->frame;
    double from_eye[3];
    float origin[3];
    vec3_sub(frame->origin, scene->eye, from_eye);
    turn(scene, from_eye, 1, origin);
    bool is_flat = frame->shape == SHADOW_ORTHOGRAPHIC;
    gl_program_set_f3(program, "u_origin", origin);
    gl_program_set_f(program, "u_is_perspective", is_flat ? 0 : 1);
    gl_program_set_f(program, "u_far_m", is_flat ? 0 : (float)frame->range_m);
    gl_program_set_u(program, "u_resolution", (uint32_t)map->resolution);
    gl_program_set_u2(program, "u_room", (uint32_t)(map->nodes.first - first_node),
                      (uint32_t)map->nodes.count);
    gl_program_set_u(program, "u_slot", build->slot);
}

static void set_face(const struct shadow_build *build, const struct shadow_scene *scene,
                     uint32_t face, const struct gl_program *program)
{
    const struct shadow_frame *frame = &build->map->frame;
    double axes[3][3];
    float right[3], up[3], along[3];
    shadow_frame_face_axes(frame, face, axes);
    turn(scene, axes[0], 1 / frame->scale[0], right);
    turn(scene, axes[1], 1 / frame->scale[1], up);
    turn(scene, axes[2], 1, along);
    gl_program_set_f3(program, "u_right", right);
    gl_program_set_f3(program, "u_up", up);
    gl_program_set_f3(program, "u_along", along);
}

bool shadow_linked_add_grids(struct program_cache *programs, const struct shadow_build *build,
                             const struct shadow_scene *scene, uint64_t first_head,
                             uint64_t first_node, struct error *err)
{
    const struct shadow_map *map = build->map;
    const uint32_t row = 32768;
    uint32_t texels = (uint32_t)map->resolution * (uint32_t)map->resolution;
    uint32_t groups = (texels + 63) / 64;
    char defines[DEFINES_BYTES];
    const struct program_desc desc = program_of(scene->state, defines);
    const struct gl_program *program = program_cache_get(programs, &desc, err);
    if (!program)
        return false;
    gl_program_use(program);
    gl_texture_bind(scene->grids.records, UNIT_GRID_RECORDS);
    gl_texture_bind(scene->grids.bricks, UNIT_GRID_BRICKS);
    gl_texture_bind(scene->grids.values, UNIT_GRID_VALUES);
    set_cuts(scene, program);
    set_light(build, scene, first_node, program);
    for (uint32_t face = 0; face < map->frame.face_count; face++) {
        set_face(build, scene, face, program);
        gl_program_set_u(program, "u_first",
                         (uint32_t)(map->heads.first - first_head) + face * texels);
        glDispatchCompute(groups < row ? groups : row, (groups + row - 1) / row, 1);
    }
    return true;
}
