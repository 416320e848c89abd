/* SPDX-License-Identifier: MIT */
/* Submission of drawables: material and draw records, state per item, indexed draws. */
#include <assert.h>
#include <epoxy/gl.h>
#include <math.h>
#include <stdlib.h>

#include "renderer/scene/matrix.h"
#include "renderer/scene/scene_gpu_internal.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

struct draw_arena {
    struct gl_buffer draws, materials;
    uint32_t *item_materials;    /* per item of the state: index of its material record */
    struct draw_record *records; /* of the submission in the making */
    size_t record_capacity;
    size_t used; /* records of this frame already on the GPU */
};

struct draw_arena *draw_arena_create(struct error *err)
{
    struct draw_arena *arena = calloc(1, sizeof *arena);
    if (!arena)
        error_set(err, ERROR_NO_MEMORY, "draw arena");
    return arena;
}

void draw_arena_destroy(struct draw_arena *arena)
{
    if (!arena)
        return;
    gl_buffer_finish(&arena->draws);
    gl_buffer_finish(&arena->materials);
    free(arena->item_materials);
    free(arena->records);
    free(arena);
}

static uint32_t material_flags(const struct state_material *material)
{
    const struct scene_material *m = &material->base;
    uint32_t flags = 0;
    if (m->flags & SCENE_MATERIAL_UNLIT)
        flags |= MATERIAL_UNLIT;
    if (m->flags & SCENE_MATERIAL_DOUBLE_SIDED)
        flags |= MATERIAL_DOUBLE_SIDED;
    if (m->alpha_mode == SCENE_MASK)
        flags |= MATERIAL_MASK;
    if (m->alpha_mode == SCENE_BLEND)
        flags |= MATERIAL_BLEND;
    if (m->transmission > 0)
        flags |= MATERIAL_TRANSMISSION;
    if (m->pass_through == SCENE_PASS_SLAB)
        flags |= MATERIAL_PASS_SLAB;
    if (m->pass_through == SCENE_PASS_EDGE)
        flags |= MATERIAL_PASS_EDGE;
    if (material->no_self_shadow)
        flags |= MATERIAL_NO_SELF_SHADOW;
    if (material->cast_once)
        flags |= MATERIAL_CAST_ONCE;
    if (m->thickness > 0)
        flags |= MATERIAL_VOLUME;
    return flags;
}

static void fill_textures(const struct scene *scene, const struct scene_material *m,
                          struct material_record *r)
{
    for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++) {
        const struct scene_texture_ref *ref = &m->textures[slot];
        if (ref->texture >= 0 && scene->textures[ref->texture].image >= 0)
            r->texture_mask |= 1u << slot;
        if (ref->texcoord == 1)
            r->texcoord_mask |= 1u << slot;
        for (int row = 0; row < 2; row++)
            for (int k = 0; k < 3; k++)
                r->uv_transforms[2 * slot + row].v[k] = ref->uv_transform[3 * row + k];
    }
}

static void fill_material(const struct scene *scene, const struct state_material *material,
                          struct material_record *r)
{
    const struct scene_material *m = &material->base;
    float reflectance = (m->ior - 1) / (m->ior + 1);
    float f0 = m->ior > 0 ? reflectance * reflectance : 1;
    *r = (struct material_record){
        .base_color = {{m->base_color[0], m->base_color[1], m->base_color[2], m->base_color[3]}},
        .emissive_alpha_cutoff = {{m->emissive[0], m->emissive[1], m->emissive[2],
                                   m->alpha_cutoff}},
        .metallic_roughness_normal_occlusion = {{m->metallic, m->roughness, m->normal_scale,
                                                 m->occlusion_strength}},
        .transmission_f0_thickness = {{m->transmission, f0, m->thickness, m->edge_exponent}},
        .edge_color = {{m->edge_color[0], m->edge_color[1], m->edge_color[2], 0}},
        .flags = material_flags(material),
    };
    for (int k = 0; k < 3; k++)
        r->attenuation.v[k] = (float)material->sigma[k];
    fill_textures(scene, m, r);
}

/* Thickness is a length of the model and grows with its node (KHR_materials_volume), by one factor
 * here; only closed items are media. Items that either changes use copies of their material's
 * record. */
static bool is_scaled(const struct scene_state *state, const struct state_item *item)
{
    const struct scene_material *m = &state->materials[item->material].base;
    return m->transmission > 0 && m->thickness > 0 && fabsf(item->length_scale - 1) > 1e-6f;
}

static bool needs_copy(const struct scene_state *state, const struct state_item *item)
{
    return item->is_medium || is_scaled(state, item);
}

static void assign_materials(struct draw_arena *arena, const struct scene_state *state,
                             struct material_record *records)
{
    uint32_t next = state->scene->material_count;
    for (size_t i = 0; i < state->item_count; i++) {
        const struct state_item *item = &state->items[i];
        arena->item_materials[i] = item->material;
        if (!needs_copy(state, item))
            continue;
        records[next] = records[item->material];
        records[next].transmission_f0_thickness.v[2] *= item->length_scale;
        if (item->is_medium)
            records[next].flags |= MATERIAL_MEDIUM;
        arena->item_materials[i] = next++;
    }
}

bool draw_arena_begin(struct draw_arena *arena, const struct scene_state *state, struct error *err)
{
    size_t count = state->scene->material_count;
    for (size_t i = 0; i < state->item_count; i++)
        count += needs_copy(state, &state->items[i]);
    struct material_record *records = calloc(count, sizeof *records);
    free(arena->item_materials);
    arena->item_materials = calloc(state->item_count + 1, sizeof *arena->item_materials);
    if (!records || !arena->item_materials) {
        free(records);
        return error_set(err, ERROR_NO_MEMORY, "%zu materials", count);
    }
    for (uint32_t i = 0; i < state->scene->material_count; i++) {
        fill_material(state->scene, &state->materials[i], &records[i]);
        records[i].source = i;
    }
    assign_materials(arena, state, records);
    arena->used = 0;
    uint64_t bytes = count * sizeof *records;
    bool ok =
        gl_buffer_reserve(&arena->materials,
                          &(struct gl_buffer_desc){
                              .label = "frame.materials", .size_bytes = bytes, .is_dynamic = true},
                          false, err);
    if (ok) {
        gl_buffer_write(&arena->materials, 0, bytes, records);
        gl_buffer_bind_storage(&arena->materials, BIND_MATERIALS);
    }
    free(records);
    return ok;
}

void draw_arena_bind_materials(const struct draw_arena *arena)
{
    gl_buffer_bind_storage(&arena->materials, BIND_MATERIALS);
}

static void fill_record(const struct draw_desc *desc, size_t item_index, struct draw_record *r)
{
    const struct state_item *item = &desc->state->items[item_index];
    const double *m = desc->state->world[item->node];
    double offset[3];
    vec3_sub(m + 12, desc->origin, offset);
    vec4 *rows[3] = {&r->row_0, &r->row_1, &r->row_2};
    vec4 *normals[3] = {&r->normal_0, &r->normal_1, &r->normal_2};
    double sign = item->is_mirrored ? -1 : 1;
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        for (int c = 0; c < 3; c++) {
            int c1 = (c + 1) % 3, c2 = (c + 2) % 3;
            rows[i]->v[c] = (float)m[4 * c + i];
            /* cofactor: transforms normals for any invertible matrix, without dividing */
            double cofactor = m[4 * c1 + j] * m[4 * c2 + k] - m[4 * c2 + j] * m[4 * c1 + k];
            normals[i]->v[c] = (float)(sign * cofactor);
        }
        rows[i]->v[3] = (float)offset[i];
        normals[i]->v[3] = 0;
    }
    r->normal_0.v[3] = (float)sign;
    r->material = desc->arena->item_materials[item_index];
    r->node = item->node;
    r->primitive = item->primitive;
    r->object = item->node;
}

/* Normals are normalised in the shader, so cofactors may be scaled to keep tiny and huge objects
 * inside f32. */
static void scale_normals(struct draw_record *r)
{
    vec4 *normals[3] = {&r->normal_0, &r->normal_1, &r->normal_2};
    float largest = 0;
    for (int i = 0; i < 3; i++)
        for (int c = 0; c < 3; c++)
            largest = fmaxf(largest, fabsf(normals[i]->v[c]));
    if (!(largest > 0) || !isfinite(largest))
        return;
    for (int i = 0; i < 3; i++)
        for (int c = 0; c < 3; c++)
            normals[i]->v[c] /= largest;
}

static bool upload_records(const struct draw_desc *desc, struct error *err)
{
    struct draw_arena *arena = desc->arena;
    if (desc->item_count > arena->record_capacity) {
        void *grown = realloc(arena->records, desc->item_count * sizeof *arena->records);
        if (!grown)
            return error_set(err, ERROR_NO_MEMORY, "%zu draws", desc->item_count);
        arena->records = grown;
        arena->record_capacity = desc->item_count;
    }
    for (size_t i = 0; i < desc->item_count; i++) {
        fill_record(desc, desc->items[i], &arena->records[i]);
        scale_normals(&arena->records[i]);
    }
    uint64_t size = sizeof *arena->records;
    if (!gl_buffer_reserve(
            &arena->draws,
            &(struct gl_buffer_desc){.label = "frame.draws",
                                     .size_bytes = (arena->used + desc->item_count) * size,
                                     .is_dynamic = true},
            true, err))
        return false;
    gl_buffer_write(&arena->draws, arena->used * size, desc->item_count * size, arena->records);
    gl_buffer_bind_storage(&arena->draws, BIND_DRAWS);
    gl_buffer_bind_storage(&arena->materials, BIND_MATERIALS);
    return true;
}

static void bind_material(const struct draw_desc *desc, uint32_t material)
{
    const struct scene_material *m = &desc->state->materials[material].base;
    for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++)
        if (m->textures[slot].texture >= 0)
            scene_gpu_bind_texture(desc->gpu, slot, m->textures[slot].texture,
                                   UNIT_MATERIAL_0 + (uint32_t)slot);
}

static void set_culling(const struct draw_desc *desc, const struct state_item *item)
{
    const struct scene_material *m = &desc->state->materials[item->material].base;
    if (desc->cull_back_faces && !(m->flags & SCENE_MATERIAL_DOUBLE_SIDED) && !item->is_medium)
        glEnable(GL_CULL_FACE);
    else
        glDisable(GL_CULL_FACE);
    glFrontFace(item->is_mirrored ? GL_CW : GL_CCW);
}

static void draw_item(const struct draw_desc *desc, const struct state_item *item, GLuint slot)
{
    static const GLenum modes[] = {GL_POINTS, GL_LINES, GL_TRIANGLES};
    const struct scene_primitive *p = &desc->state->scene->primitives[item->primitive];
    const char *first = (const char *)NULL + (size_t)p->first_index * 4;
    glDrawElementsInstancedBaseVertexBaseInstance(modes[p->topology], (GLsizei)p->index_count,
                                                  GL_UNSIGNED_INT, first, 1, (GLint)p->first_vertex,
                                                  slot);
}

bool draws_submit(const struct draw_desc *desc, struct draw_counts *counts, struct error *err)
{
    if (!desc->item_count)
        return true;
    if (!upload_records(desc, err))
        return false;
    glBindVertexArray(desc->gpu->vertex_array.name);
    const struct gl_program *bound = NULL;
    int64_t material = -1;
    for (size_t i = 0; i < desc->item_count; i++) {
        const struct state_item *item = &desc->state->items[desc->items[i]];
        const struct gl_program *program = desc->program_for(desc->context, item, err);
        if (!program)
            return false;
        if (program != bound)
            gl_program_use(program);
        bound = program;
        if (desc->needs_textures && material != item->material)
            bind_material(desc, item->material);
        material = item->material;
        set_culling(desc, item);
        draw_item(desc, item, (GLuint)(desc->arena->used + i));
        if (counts) {
            const struct scene_primitive *p = &desc->state->scene->primitives[item->primitive];
            counts->draws++;
            counts->triangles += p->topology == SCENE_TRIANGLES ? p->index_count / 3 : 0;
        }
    }
    glDisable(GL_CULL_FACE);
    glFrontFace(GL_CCW);
    desc->arena->used += desc->item_count;
    return true;
}
