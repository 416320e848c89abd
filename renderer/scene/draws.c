/* SPDX-License-Identifier: MIT */
/* Submission of drawables: consecutive items of one state become one indirect multi-draw, and
 * consecutive ones of one primitive become its instances. The order of the items is kept. */
#include <assert.h>
#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/scene/scene_gpu_internal.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

enum { COMMANDS_KEPT = 1 << 20 }; /* 20 MiB before the buffer is written from its start again */

/* All that must be equal between the items of one call. */
struct draw_state {
    const struct gl_program *program;
    GLenum mode;
    int64_t textures; /* class of the material's textures, or -1 where none is sampled */
    GLenum index_type;
    bool culls_back, is_mirrored;
    GLuint vertices; /* the array */
};

struct draw_batch { /* commands of one state, in order */
    struct draw_state state;
    uint32_t material; /* one of those with the state's textures */
    uint32_t first, count;
};

static void bind_textures(const struct draw_desc *desc, uint32_t material)
{
    const struct scene_material *m = &desc->state->materials[material].base;
    for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++)
        if (m->textures[slot].texture >= 0)
            scene_gpu_bind_texture(
                desc->gpu, &(struct texture_binding){.slot = slot,
                                                     .texture = m->textures[slot].texture,
                                                     .unit = UNIT_MATERIAL_0 + (uint32_t)slot,
                                                     .pass = desc->texture_pass});
}

/* How the item is drawn, from which vertices and indices. */
static bool describe_item(const struct draw_desc *desc, size_t index, struct draw_state *state,
                          struct draw_command *command, struct error *err)
{
    static const GLenum modes[] = {GL_POINTS, GL_LINES, GL_TRIANGLES};
    const struct state_item *item = &desc->state->items[desc->items[index]];
    const struct scene_material *m = &desc->state->materials[item->material].base;
    const struct scene_primitive *p = state_geometry_of(desc->state, item).primitive;
    const struct scene_geometry *from = &scene_gpu_of_part(desc->gpu, p->part)->geometry;
    const struct scene *scene = desc->state->scene;
    uint32_t first = scene->part_count ? scene->parts[p->part].first_primitive : 0;
    bool samples = false;
    const struct gl_program *program = desc->program_for(desc->context, item, &samples, err);
    if (!program)
        return false;
    struct vertex_range range = {.first_vertex = p->first_vertex, .first_index = p->first_index};
    GLuint vertices = desc->arena->caps.array.name;
    if (!item->cap) {
        range = from->layout.ranges[item->primitive - first];
        vertices = from->arrays[scene_geometry_array(from, program->attributes, p->flags)].name;
    }
    *state = (struct draw_state){
        .program = program,
        .mode = modes[p->topology],
        .textures = samples ? (int64_t)desc->gpu->texture_classes[item->material] : -1,
        .index_type = range.has_short_indices ? GL_UNSIGNED_SHORT : GL_UNSIGNED_INT,
        .culls_back =
            desc->cull_back_faces && !(m->flags & SCENE_MATERIAL_DOUBLE_SIDED) && !item->is_medium,
        .is_mirrored = item->is_mirrored,
        .vertices = vertices,
    };
    *command = (struct draw_command){.index_count = p->index_count,
                                     .instance_count = 1,
                                     .first_index = range.first_index,
                                     .base_vertex = (int32_t)range.first_vertex,
                                     .base_instance = desc->records[index]};
    return true;
}

static bool is_same_state(const struct draw_state *a, const struct draw_state *b)
{
    return a->program == b->program && a->mode == b->mode && a->textures == b->textures &&
           a->culls_back == b->culls_back && a->is_mirrored == b->is_mirrored &&
           a->index_type == b->index_type && a->vertices == b->vertices;
}

static bool reserve_lists(struct draw_arena *arena, size_t count, struct error *err)
{
    if (count <= arena->command_capacity)
        return true;
    void *commands = realloc(arena->command_list, count * sizeof *arena->command_list);
    if (commands)
        arena->command_list = commands;
    void *batches = commands ? realloc(arena->batches, count * sizeof *arena->batches) : NULL;
    if (!batches)
        return error_set(err, ERROR_NO_MEMORY, "%zu draws", count);
    arena->batches = batches;
    arena->command_capacity = count;
    return true;
}

/* Whether the command draws the same primitive, for the records before this one's. */
static bool continues(const struct draw_command *command, const struct draw_command *next)
{
    return command->first_index == next->first_index && command->index_count == next->index_count &&
           command->base_vertex == next->base_vertex &&
           command->base_instance + command->instance_count == next->base_instance;
}

/* Fills the arena's lists from the items. */
static bool list_commands(const struct draw_desc *desc, uint32_t *batch_count,
                          uint32_t *command_count, struct error *err)
{
    struct draw_arena *arena = desc->arena;
    *batch_count = *command_count = 0;
    for (size_t i = 0; i < desc->item_count; i++) {
        struct draw_command command;
        struct draw_state state;
        if (!describe_item(desc, i, &state, &command, err))
            return false;
        struct draw_batch *batch = *batch_count ? &arena->batches[*batch_count - 1] : NULL;
        if (!batch || !is_same_state(&batch->state, &state)) {
            batch = &arena->batches[(*batch_count)++];
            *batch = (struct draw_batch){.state = state,
                                         .material = desc->state->items[desc->items[i]].material,
                                         .first = *command_count};
        }
        if (batch->count && continues(&arena->command_list[*command_count - 1], &command)) {
            arena->command_list[*command_count - 1].instance_count++;
            continue;
        }
        arena->command_list[(*command_count)++] = command;
        batch->count++;
    }
    return true;
}

static bool upload_commands(struct draw_arena *arena, uint32_t count, struct error *err)
{
    uint64_t size = sizeof *arena->command_list;
    if (arena->command_used + count > COMMANDS_KEPT) /* those before have been submitted */
        arena->command_used = 0;
    if (!gl_buffer_reserve(
            &arena->commands,
            &(struct gl_buffer_desc){.label = "frame.draws.commands",
                                     .size_bytes = (arena->command_used + count) * size,
                                     .is_uploaded = true},
            true, err))
        return false;
    gl_buffer_write(&arena->commands, arena->command_used * size, count * size,
                    arena->command_list);
    glBindBuffer(GL_DRAW_INDIRECT_BUFFER, arena->commands.name);
    return true;
}

static void draw_batch(const struct draw_desc *desc, const struct draw_batch *batch)
{
    const struct draw_state *state = &batch->state;
    if (state->textures >= 0)
        bind_textures(desc, batch->material);
    (state->culls_back ? glEnable : glDisable)(GL_CULL_FACE);
    glFrontFace(state->is_mirrored ? GL_CW : GL_CCW);
    const char *first = (const char *)NULL + (desc->arena->command_used + batch->first) *
                                                 sizeof *desc->arena->command_list;
    glMultiDrawElementsIndirect(state->mode, state->index_type, first, (GLsizei)batch->count, 0);
}

static void count_items(const struct draw_desc *desc, uint32_t calls, struct draw_counts *counts)
{
    counts->draws += desc->item_count;
    counts->calls += calls;
    for (size_t i = 0; i < desc->item_count; i++) {
        const struct scene_primitive *p =
            state_geometry_of(desc->state, &desc->state->items[desc->items[i]]).primitive;
        counts->triangles += p->topology == SCENE_TRIANGLES ? p->index_count / 3 : 0;
    }
}

/* A scene's array would keep the buffer alive when the arena has outgrown it. */
static void let_records_go(GLuint vertices)
{
    glVertexArrayVertexBuffer(vertices, ATTRIBUTE_DRAW, 0, 0, sizeof(struct draw_record));
}

/* *bound: the array that is bound, 0 for none. */
static void bind_vertices(const struct draw_desc *desc, GLuint wanted, GLuint *bound)
{
    if (wanted == *bound)
        return;
    if (*bound)
        let_records_go(*bound);
    *bound = wanted;
    glBindVertexArray(wanted);
    glVertexArrayVertexBuffer(wanted, ATTRIBUTE_DRAW, desc->arena->draws.name, 0,
                              sizeof(struct draw_record));
}

bool draws_submit(const struct draw_desc *desc, struct draw_counts *counts, struct error *err)
{
    struct draw_arena *arena = desc->arena;
    uint32_t batch_count, command_count;
    if (!desc->item_count)
        return true;
    if (!reserve_lists(arena, desc->item_count, err) ||
        !list_commands(desc, &batch_count, &command_count, err) ||
        !upload_commands(arena, command_count, err))
        return false;
    draw_arena_bind_materials(arena);
    const struct gl_program *bound = NULL;
    GLuint vertices = 0;
    for (uint32_t i = 0; i < batch_count; i++) {
        if (arena->batches[i].state.program != bound)
            gl_program_use(arena->batches[i].state.program);
        bound = arena->batches[i].state.program;
        bind_vertices(desc, arena->batches[i].state.vertices, &vertices);
        draw_batch(desc, &arena->batches[i]);
    }
    glDisable(GL_CULL_FACE);
    glFrontFace(GL_CCW);
    let_records_go(vertices);
    arena->command_used += command_count;
    if (counts)
        count_items(desc, batch_count, counts);
    return true;
}
