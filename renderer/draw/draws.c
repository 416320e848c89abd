/* SPDX-License-Identifier: MIT */
/* Submission of drawables: consecutive items of one state become one indirect multi-draw, and
 * consecutive ones of one primitive become its instances. The order of the items is kept, but where
 * they are drawn for several faces at once. */
#include <assert.h>
#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/draw/scene_gpu_internal.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

enum {
    COMMANDS_KEPT_BYTES = 20 << 20, /* before the buffer is written from its start again */
    INSTANCES_KEPT_BYTES = 8 << 20,
};

/* All that must be equal between the items of one call. */
struct draw_state {
    const struct gl_program *program;
    GLenum mode;
    int64_t textures;    /* class of the material's textures, or -1 where none is sampled */
    size_t texture_pass; /* one of those that sample the same levels */
    GLenum index_type;
    bool culls_back, is_mirrored;
    GLuint vertices;   /* the array */
    uint32_t deformed; /* 1 + the item whose vertices in a pose are drawn; 0: none */
};

struct draw_batch { /* commands of one state, in order */
    struct draw_state state;
    uint32_t material; /* one of those with the state's textures */
    uint32_t first, count;
};

struct draw_entry { /* one item of the list in the making */
    uint32_t index; /* of the desc's arrays */
    uint32_t batch; /* of the arena: its state */
    struct draw_command command;
};

static void bind_textures(const struct draw_desc *desc, const struct draw_batch *batch)
{
    const struct scene_material *m = &desc->state->materials[batch->material].base;
    for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++)
        if (m->textures[slot].texture >= 0)
            scene_gpu_bind_texture(
                desc->gpu, &(struct texture_binding){.slot = slot,
                                                     .texture = m->textures[slot].texture,
                                                     .unit = UNIT_MATERIAL_0 + (uint32_t)slot,
                                                     .pass = batch->state.texture_pass});
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
    struct draw_choice choice = {0};
    if (!desc->choose(desc->context, index, &choice, err))
        return false;
    struct vertex_range range = {.first_vertex = p->first_vertex, .first_index = p->first_index};
    GLuint vertices = desc->arena->caps.array.name;
    if (!item->cap) {
        range = from->layout.ranges[item->primitive - first];
        vertices =
            from->arrays[scene_geometry_array(from, choice.program->attributes, p->flags)].name;
    }
    if (item->deformed) { /* its array is bound from the first vertex on */
        range.first_vertex = 0;
        vertices = deform_gpu_array(from, p->flags);
    }
    *state = (struct draw_state){
        .program = choice.program,
        .mode = modes[p->topology],
        .textures =
            choice.samples_textures ? (int64_t)desc->gpu->texture_classes[item->material] : -1,
        .texture_pass = choice.samples_textures ? choice.texture_pass : 0,
        .index_type = range.has_short_indices ? GL_UNSIGNED_SHORT : GL_UNSIGNED_INT,
        .culls_back =
            desc->cull_back_faces && !(m->flags & SCENE_MATERIAL_DOUBLE_SIDED) && !item->is_medium,
        .is_mirrored = item->is_mirrored,
        .vertices = vertices,
        .deformed = item->deformed ? desc->items[index] + 1 : 0,
    };
    *command = (struct draw_command){.index_count = p->index_count,
                                     .instance_count = 1,
                                     .first_index = range.first_index,
                                     .base_vertex = (int32_t)range.first_vertex,
                                     .base_instance = desc->records[index]};
    return true;
}

static bool is_same_state(const struct draw_desc *desc, const struct draw_batch *batch,
                          const struct draw_state *b)
{
    const struct draw_state *a = &batch->state;
    return a->program == b->program && a->mode == b->mode && a->textures == b->textures &&
           a->culls_back == b->culls_back && a->is_mirrored == b->is_mirrored &&
           a->index_type == b->index_type && a->vertices == b->vertices &&
           a->deformed == b->deformed &&
           (a->texture_pass == b->texture_pass ||
            scene_gpu_samples_alike(desc->gpu, &desc->state->materials[batch->material].base,
                                    a->texture_pass, b->texture_pass));
}

/* Room for so many elements more; at least doubles, so that a list grows in linear time. */
static bool reserve(void **array, size_t *capacity, size_t count, size_t element, struct error *err)
{
    if (count <= *capacity)
        return true;
    size_t wanted = count < 2 * *capacity ? 2 * *capacity : count;
    void *grown = realloc(*array, wanted * element);
    if (!grown)
        return error_set(err, ERROR_NO_MEMORY, "%zu draws", wanted);
    *array = grown;
    *capacity = wanted;
    return true;
}

static bool reserve_lists(struct draw_arena *arena, size_t count, bool has_faces, struct error *err)
{
    void *commands = arena->command_list, *entries = arena->entries,
         *instances = arena->instance_list;
    bool ok = reserve(&commands, &arena->command_capacity, arena->command_count + count,
                      sizeof *arena->command_list, err);
    arena->command_list = commands;
    ok = ok && reserve(&entries, &arena->entry_capacity, has_faces ? 2 * count : count,
                       sizeof *arena->entries, err);
    arena->entries = entries;
    if (ok && has_faces)
        ok = reserve(&instances, &arena->instance_capacity, arena->instance_count + count,
                     sizeof *arena->instance_list, err);
    arena->instance_list = instances;
    return ok;
}

static bool add_batch(struct draw_arena *arena, const struct draw_state *state, uint32_t material,
                      struct error *err)
{
    void *batches = arena->batches;
    bool ok = reserve(&batches, &arena->batch_capacity, arena->batch_count + 1,
                      sizeof *arena->batches, err);
    arena->batches = batches;
    if (ok)
        arena->batches[arena->batch_count++] =
            (struct draw_batch){.state = *state, .material = material};
    return ok;
}

/* The last batch of the list, where its state is this one; with faces any of the list's. */
static bool find_batch(const struct draw_desc *desc, size_t list_first,
                       const struct draw_state *state, uint32_t material, uint32_t *batch,
                       struct error *err)
{
    struct draw_arena *arena = desc->arena;
    for (size_t i = arena->batch_count; i-- > list_first;) {
        if (is_same_state(desc, &arena->batches[i], state)) {
            *batch = (uint32_t)i;
            return true;
        }
        if (!desc->faces)
            break;
    }
    *batch = (uint32_t)arena->batch_count;
    return add_batch(arena, state, material, err);
}

/* Fills the arena's entries from the items. */
static bool list_entries(const struct draw_desc *desc, size_t list_first, struct error *err)
{
    struct draw_arena *arena = desc->arena;
    for (size_t i = 0; i < desc->item_count; i++) {
        struct draw_entry *entry = &arena->entries[i];
        struct draw_state state;
        entry->index = (uint32_t)i;
        if (!describe_item(desc, i, &state, &entry->command, err) ||
            !find_batch(desc, list_first, &state, desc->state->items[desc->items[i]].material,
                        &entry->batch, err))
            return false;
        arena->batches[entry->batch].count++;
    }
    return true;
}

/* Sorts entries by batch, and keeps the order within one. */
static const struct draw_entry *sort_entries(const struct draw_desc *desc, size_t list_first)
{
    struct draw_arena *arena = desc->arena;
    struct draw_entry *sorted = arena->entries + desc->item_count;
    uint32_t first = 0;
    for (size_t i = list_first; i < arena->batch_count; i++) {
        arena->batches[i].first = first;
        first += arena->batches[i].count;
    }
    for (size_t i = 0; i < desc->item_count; i++)
        sorted[arena->batches[arena->entries[i].batch].first++] = arena->entries[i];
    return sorted;
}

/* Whether the command draws the same primitive, for the records before this one's. */
static bool continues(const struct draw_command *command, const struct draw_command *next)
{
    return command->first_index == next->first_index && command->index_count == next->index_count &&
           command->base_vertex == next->base_vertex &&
           command->base_instance + command->instance_count == next->base_instance;
}

bool draws_add_instance(struct draw_arena *arena, uint32_t record, uint32_t face, uint32_t *number,
                        struct error *err)
{
    void *instances = arena->instance_list;
    bool ok = reserve(&instances, &arena->instance_capacity, arena->instance_count + 1,
                      sizeof *arena->instance_list, err);
    arena->instance_list = instances;
    if (!ok)
        return false;
    *number = (uint32_t)arena->instance_count;
    arena->instance_list[arena->instance_count++] = (struct draw_instance){record, face};
    return true;
}

static void list_commands(const struct draw_desc *desc, const struct draw_entry *entries)
{
    struct draw_arena *arena = desc->arena;
    for (size_t i = 0; i < desc->item_count; i++) {
        struct draw_command command = entries[i].command;
        struct draw_batch *batch = &arena->batches[entries[i].batch];
        if (!i || entries[i].batch != entries[i - 1].batch) {
            batch->first = (uint32_t)arena->command_count;
            batch->count = 0;
        }
        if (desc->faces) {
            uint32_t at = entries[i].index;
            command.base_instance = (uint32_t)arena->instance_count;
            arena->instance_list[arena->instance_count++] =
                (struct draw_instance){desc->records[at], desc->faces[at]};
        }
        if (batch->count && continues(&arena->command_list[arena->command_count - 1], &command)) {
            arena->command_list[arena->command_count - 1].instance_count++;
            continue;
        }
        arena->command_list[arena->command_count++] = command;
        batch->count++;
    }
}

void draws_begin(struct draw_arena *arena)
{
    arena->command_count = arena->batch_count = arena->instance_count = 0;
    arena->bound = (struct draw_bound){.program = NULL};
    glDisable(GL_CULL_FACE);
    glFrontFace(GL_CCW);
}

bool draws_add(const struct draw_desc *desc, struct draw_range *range, struct error *err)
{
    struct draw_arena *arena = desc->arena;
    size_t first = arena->batch_count;
    *range = (struct draw_range){.first = (uint32_t)first};
    if (!desc->item_count)
        return true;
    if (!reserve_lists(arena, desc->item_count, desc->faces != NULL, err) ||
        !list_entries(desc, first, err))
        return false;
    list_commands(desc, desc->faces ? sort_entries(desc, first) : arena->entries);
    range->count = (uint32_t)(arena->batch_count - first);
    return true;
}

bool draws_upload(struct draw_arena *arena, struct error *err)
{
    static const struct gl_stream_desc commands = {.label = "frame.draws.commands",
                                                   .kept_bytes = COMMANDS_KEPT_BYTES};
    static const struct gl_stream_desc instances = {.label = "frame.draws.instances",
                                                    .kept_bytes = INSTANCES_KEPT_BYTES};
    if (arena->command_count && !gl_stream_write(&arena->commands, &commands, arena->command_list,
                                                 arena->command_count * sizeof *arena->command_list,
                                                 &arena->commands_offset, err))
        return false;
    if (arena->instance_count &&
        !gl_stream_write(&arena->instances, &instances, arena->instance_list,
                         arena->instance_count * sizeof *arena->instance_list,
                         &arena->instances_offset, err))
        return false;
    if (arena->command_count)
        glBindBuffer(GL_DRAW_INDIRECT_BUFFER, arena->commands.buffer.name);
    if (arena->instance_count && arena->used)
        gl_buffer_bind_storage_range(&arena->draws, 0, arena->used * sizeof(struct draw_record),
                                     BIND_DRAWS);
    draw_arena_bind_materials(arena);
    return true;
}

static void set_faces(struct draw_bound *bound, const struct draw_state *state)
{
    if (state->culls_back != bound->culls_back)
        (state->culls_back ? glEnable : glDisable)(GL_CULL_FACE);
    if (state->is_mirrored != bound->is_mirrored)
        glFrontFace(state->is_mirrored ? GL_CW : GL_CCW);
    bound->culls_back = state->culls_back;
    bound->is_mirrored = state->is_mirrored;
}

static void draw_batch(const struct draw_desc *desc, const struct draw_batch *batch)
{
    const struct draw_arena *arena = desc->arena;
    const struct draw_state *state = &batch->state;
    if (state->textures >= 0)
        bind_textures(desc, batch);
    const void *first = (const void *)(uintptr_t)(arena->commands_offset +
                                                  batch->first * sizeof *arena->command_list);
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

/* A scene's array would keep the buffers alive when the arena has outgrown them. */
static void let_buffers_go(const struct draw_bound *bound)
{
    if (bound->vertices)
        glVertexArrayVertexBuffers(bound->vertices, BINDING_RECORDS, 2, NULL, NULL, NULL);
    if (bound->vertices && bound->deformed)
        deform_gpu_bind(NULL, NULL, bound->vertices, 0, 0);
}

static void bind_pose(const struct draw_desc *desc, GLuint vertices, uint32_t index)
{
    const struct scene_state *state = desc->state;
    const struct state_item *item = &state->items[index];
    const struct state_deformed *deformed = &state->deforms.items[item->deformed - 1];
    uint32_t part = deformed->primitive.part;
    const struct scene_geometry *from = &scene_gpu_of_part(desc->gpu, part)->geometry;
    uint32_t first = state->scene->part_count ? state->scene->parts[part].first_primitive : 0;
    deform_gpu_bind(&desc->arena->deforms, from, vertices, deformed->primitive.first_vertex,
                    from->layout.ranges[item->primitive - first].first_vertex);
}

static void bind_vertices(const struct draw_desc *desc, GLuint wanted, uint32_t deformed)
{
    struct draw_arena *arena = desc->arena;
    bool is_bound = wanted == arena->bound.vertices;
    if (deformed && !(is_bound && deformed == arena->bound.deformed))
        bind_pose(desc, wanted, deformed - 1);
    if (is_bound) {
        arena->bound.deformed = deformed;
        return;
    }
    let_buffers_go(&arena->bound);
    arena->bound.vertices = wanted;
    arena->bound.deformed = deformed;
    glBindVertexArray(wanted);
    GLuint draws = arena->draws.name, instances = arena->instances.buffer.name;
    const GLuint buffers[2] = {draws, instances ? instances : draws};
    const GLintptr offsets[2] = {0, (GLintptr)(instances ? arena->instances_offset : 0)};
    const GLsizei strides[2] = {sizeof(struct draw_record), sizeof(struct draw_instance)};
    glVertexArrayVertexBuffers(wanted, BINDING_RECORDS, 2, buffers, offsets, strides);
}

void draws_format_instances(const struct gl_vertex_array *array)
{
    scene_gpu_format_instances(array->name);
}

void draws_bind_instances(const struct draw_arena *arena, const struct gl_vertex_array *array,
                          bool is_on)
{
    glVertexArrayVertexBuffer(array->name, BINDING_INSTANCES,
                              is_on ? arena->instances.buffer.name : 0,
                              (GLintptr)arena->instances_offset, sizeof(struct draw_instance));
}

void draws_run(const struct draw_desc *desc, const struct draw_range *range)
{
    struct draw_arena *arena = desc->arena;
    for (uint32_t i = range->first; i < range->first + range->count; i++) {
        const struct draw_batch *batch = &arena->batches[i];
        if (batch->state.program != arena->bound.program)
            gl_program_use(batch->state.program);
        arena->bound.program = batch->state.program;
        bind_vertices(desc, batch->state.vertices, batch->state.deformed);
        set_faces(&arena->bound, &batch->state);
        draw_batch(desc, batch);
    }
}

void draws_end(struct draw_arena *arena)
{
    set_faces(&arena->bound, &(struct draw_state){.culls_back = false});
    let_buffers_go(&arena->bound);
    arena->bound = (struct draw_bound){.program = NULL};
}

bool draws_submit(const struct draw_desc *desc, struct draw_counts *counts, struct error *err)
{
    struct draw_range range;
    if (!desc->item_count)
        return true;
    draws_begin(desc->arena);
    if (!draws_add(desc, &range, err) || !draws_upload(desc->arena, err))
        return false;
    draws_run(desc, &range);
    draws_end(desc->arena);
    if (counts)
        count_items(desc, range.count, counts);
    return true;
}
