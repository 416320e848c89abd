/* SPDX-License-Identifier: MIT */
/* Holds what draws read: material records of a frame, and draw records relative to a space. */
#include <assert.h>
#include <epoxy/gl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/matrix.h"
#include "renderer/draw/scene_gpu_internal.h"
#include "renderer/draw/shader_needs.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"
#include "shaders/shared/records.h"

enum { RECORDS_KEPT = 1 << 19 }; /* 56 MiB; one placement may be larger */

struct draw_arena *draw_arena_create(const struct gl_limits *limits, struct error *err)
{
    struct draw_arena *arena = calloc(1, sizeof *arena);
    if (!arena) {
        error_set(err, ERROR_NO_MEMORY, "draw arena");
        return NULL;
    }
    arena->limits = limits;
    return arena;
}

static void caps_finish(struct cap_gpu *gpu)
{
    gl_buffer_finish(&gpu->positions);
    gl_buffer_finish(&gpu->normals);
    gl_buffer_finish(&gpu->indices);
    gl_vertex_array_finish(&gpu->array);
    *gpu = (struct cap_gpu){0};
}

void draw_arena_destroy(struct draw_arena *arena)
{
    if (!arena)
        return;
    gl_buffer_finish(&arena->draws);
    gl_buffer_finish(&arena->materials);
    gl_stream_finish(&arena->commands);
    gl_stream_finish(&arena->instances);
    caps_finish(&arena->caps);
    deform_gpu_finish(&arena->deforms);
    free(arena->item_materials);
    free(arena->records);
    free(arena->placed);
    free(arena->command_list);
    free(arena->batches);
    free(arena->instance_list);
    free(arena->entries);
    free(arena);
}

uint32_t material_flags(const struct state_material *material)
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
    if (state_bend_of(m) != STATE_BEND_NONE)
        flags |= MATERIAL_BENDS;
    if (m->flags & SCENE_MATERIAL_SPECULAR)
        flags |= MATERIAL_SPECULAR;
    if (m->clearcoat > 0)
        flags |= MATERIAL_CLEARCOAT;
    if (scene_material_has_sheen(m))
        flags |= MATERIAL_SHEEN;
    if (m->iridescence > 0)
        flags |= MATERIAL_FILM;
    if (m->anisotropy > 0)
        flags |= MATERIAL_GRAIN;
    if (m->diffuse_transmission > 0)
        flags |= MATERIAL_TRANSLUCENT;
    if (material->catches_shadows)
        flags |= MATERIAL_GROUND;
    return flags;
}

static_assert(SLOTS_OF_BASE == SCENE_TEXTURE_THICKNESS + 1, "the slots of lobes follow");
static_assert(SCENE_TEXTURE_SLOT_COUNT <= 3 * SLOTS_OF_BASE, "two records have those of lobes");

static void fill_textures(const struct scene_material *m, int first_slot, struct material_record *r)
{
    for (int i = 0; i < SLOTS_OF_BASE && first_slot + i < SCENE_TEXTURE_SLOT_COUNT; i++) {
        const struct scene_texture_ref *ref = &m->textures[first_slot + i];
        if (ref->texcoord == 1)
            r->texcoord_mask |= 1u << i;
        for (int row = 0; row < 2; row++)
            for (int k = 0; k < 3; k++)
                r->uv_transforms[2 * i + row].v[k] = ref->uv_transform[3 * row + k];
    }
}

/* Fills as many records as the lobes have. */
static void fill_lobes(const struct scene_material *m, uint32_t count, struct material_record *r)
{
    const float *sheen = m->sheen_color, *tint = m->specular_color;
    *r = (struct material_record){
        .LOBES_SPECULAR = {{tint[0], tint[1], tint[2], m->specular}},
        .LOBES_COAT_SHEEN = {{m->clearcoat, m->clearcoat_roughness, m->sheen_roughness,
                              m->clearcoat_normal_scale}},
        .LOBES_SHEEN_COLOR = {{sheen[0], sheen[1], sheen[2], 0}},
        .LOBES_FILM = {{m->iridescence, m->film_ior, m->film_nm[0], m->film_nm[1]}},
        .LOBES_GRAIN = {{m->anisotropy, (float)cos((double)m->anisotropy_rad),
                         (float)sin((double)m->anisotropy_rad), 0}},
    };
    for (int k = 0; k < 3; k++)
        r->LOBES_TRANSLUCENT.v[k] = m->diffuse_transmission_color[k];
    r->LOBES_TRANSLUCENT.v[3] = m->diffuse_transmission;
    fill_textures(m, SLOTS_OF_BASE, r);
    if (count > 1) {
        r[1] = (struct material_record){.flags = 0};
        fill_textures(m, 2 * SLOTS_OF_BASE, &r[1]);
    }
}

static void fill_material(const struct state_material *material, struct material_record *r)
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
        .attenuation = {{0, 0, 0, m->ior}},
        .edge_color = {{m->edge_color[0], m->edge_color[1], m->edge_color[2],
                        (m->ior - 1) * 0.025f * m->dispersion}},
        .flags = material_flags(material),
    };
    for (int k = 0; k < 3; k++)
        r->attenuation.v[k] = (float)material->sigma[k];
    fill_textures(m, 0, r);
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
    return item->is_medium || item->bend == STATE_BEND_SOLID || is_scaled(state, item);
}

static void assign_materials(struct draw_arena *arena, const struct scene_state *state,
                             struct material_record *records)
{
    uint32_t next = state->material_count;
    for (size_t i = 0; i < state->item_count; i++) {
        const struct state_item *item = &state->items[i];
        arena->item_materials[i] = item->material;
        if (!needs_copy(state, item))
            continue;
        records[next] = records[item->material];
        records[next].transmission_f0_thickness.v[2] *= item->length_scale;
        if (item->is_medium)
            records[next].flags |= MATERIAL_MEDIUM;
        if (item->bend == STATE_BEND_SOLID)
            records[next].flags |= MATERIAL_SOLID;
        arena->item_materials[i] = next++;
    }
}

/* Records that its lobes have. */
static uint32_t lobe_records(const struct state_material *material)
{
    return shader_needs_lobes(material_flags(material));
}

/* Behind all others, and before copies are made of those that name them. */
static void add_lobes(const struct scene_state *state, struct material_record *records,
                      uint32_t next)
{
    for (uint32_t i = 0; i < state->material_count; i++) {
        uint32_t count = lobe_records(&state->materials[i]);
        if (!count)
            continue;
        fill_lobes(&state->materials[i].base, count, &records[next]);
        records[i].lobes = next;
        next += count;
    }
}

static bool reserve_items(struct draw_arena *arena, size_t count, struct error *err)
{
    free(arena->item_materials);
    arena->item_materials = calloc(count + 1, sizeof *arena->item_materials);
    return arena->item_materials ||
           error_set(err, ERROR_NO_MEMORY, "records of %zu drawables", count);
}

static void let_records_go(struct draw_arena *arena)
{
    arena->used = 0;
    arena->epoch++;
}

static bool upload_caps(struct cap_gpu *gpu, const struct state_caps *caps, struct error *err)
{
    if (gpu->serial == caps->serial)
        return true;
    caps_finish(gpu);
    if (!caps->count)
        return true;
    uint64_t bytes = (uint64_t)caps->vertex_count * 3 * sizeof(float);
    gl_vertex_array_init(&gpu->array, "caps");
    if (!gl_buffer_init(&gpu->positions,
                        &(struct gl_buffer_desc){.label = "caps.positions",
                                                 .size_bytes = bytes,
                                                 .data = caps->positions},
                        err) ||
        !gl_buffer_init(&gpu->normals,
                        &(struct gl_buffer_desc){
                            .label = "caps.normals", .size_bytes = bytes, .data = caps->normals},
                        err) ||
        !gl_buffer_init(&gpu->indices,
                        &(struct gl_buffer_desc){.label = "caps.indices",
                                                 .size_bytes = bytes / 3,
                                                 .data = caps->indices},
                        err))
        return false;
    const struct gl_buffer *streams[] = {&gpu->positions, &gpu->normals};
    for (uint32_t i = 0; i < 2; i++) {
        glEnableVertexArrayAttrib(gpu->array.name, i);
        glVertexArrayAttribFormat(gpu->array.name, i, 3, GL_FLOAT, GL_FALSE, 0);
        glVertexArrayAttribBinding(gpu->array.name, i, i);
        glVertexArrayVertexBuffer(gpu->array.name, i, streams[i]->name, 0, 3 * sizeof(float));
    }
    glVertexArrayElementBuffer(gpu->array.name, gpu->indices.name);
    scene_gpu_format_records(gpu->array.name);
    gpu->serial = caps->serial;
    return true;
}

bool draw_arena_begin(struct draw_arena *arena, const struct scene_state *state, struct error *err)
{
    size_t count = state->material_count;
    for (size_t i = 0; i < state->item_count; i++)
        count += needs_copy(state, &state->items[i]);
    const uint32_t first_lobes = (uint32_t)count;
    for (uint32_t i = 0; i < state->material_count; i++)
        count += lobe_records(&state->materials[i]);
    uint64_t most = gl_limits_block(arena->limits, sizeof(struct material_record));
    if (count > most)
        return error_set(
            err, ERROR_OVER_BUDGET,
            "%zu materials, with those that media, scaled nodes and lobes need of their own: "
            "a storage block of this device holds %llu",
            count, (unsigned long long)most);
    struct material_record *records = calloc(count + 1, sizeof *records);
    if (!records || !reserve_items(arena, state->item_count, err)) {
        free(records);
        return error_set(err, ERROR_NO_MEMORY, "%zu materials", count);
    }
    for (uint32_t i = 0; i < state->material_count; i++) {
        fill_material(&state->materials[i], &records[i]);
        records[i].source = i;
    }
    for (size_t i = state->whole_count; i < state->item_count; i++)
        records[state->items[i].material].source =
            state->caps.caps[state->items[i].cap - 1].source_material;
    add_lobes(state, records, first_lobes);
    assign_materials(arena, state, records);
    let_records_go(arena);
    uint64_t bytes = count * sizeof *records;
    bool ok =
        gl_buffer_reserve(&arena->materials,
                          &(struct gl_buffer_desc){
                              .label = "frame.materials", .size_bytes = bytes, .is_uploaded = true},
                          false, err);
    if (ok) {
        arena->material_bytes = bytes;
        gl_buffer_write(&arena->materials, 0, bytes, records);
        draw_arena_bind_materials(arena);
    }
    free(records);
    return ok && upload_caps(&arena->caps, &state->caps, err) &&
           deform_gpu_upload(&arena->deforms, &state->deforms, err);
}

void draw_arena_bind_materials(const struct draw_arena *arena)
{
    gl_buffer_bind_storage_range(&arena->materials, 0, arena->material_bytes, BIND_MATERIALS);
}

/* Cofactors transform normals for any invertible matrix, without dividing. They are normalised in
 * the shader, so they may be scaled to keep tiny and huge objects inside f32. */
static void fill_normals(const double m[16], const double axes[3][3], double sign,
                         struct draw_record *r)
{
    vec4 *rows[3] = {&r->normal_0, &r->normal_1, &r->normal_2};
    double columns[3][3], square = 0;
    for (int c = 0; c < 3; c++) {
        vec3_cross(m + 4 * ((c + 1) % 3), m + 4 * ((c + 2) % 3), columns[c]);
        square += vec3_dot(columns[c], columns[c]);
    }
    double scale = square > 0 && isfinite(square) ? sign / sqrt(square) : sign;
    for (int i = 0; i < 3; i++)
        for (int c = 0; c < 3; c++)
            rows[i]->v[c] = (float)(vec3_dot(axes[i], columns[c]) * scale);
    r->normal_0.v[3] = (float)sign;
}

uint32_t draw_arena_material(const struct draw_arena *arena, uint32_t item)
{
    return arena->item_materials[item];
}

static void place_record(const struct draw_arena *arena, const struct draw_place_desc *desc,
                         uint32_t index, struct draw_record *r)
{
    const struct draw_space *space = &desc->space;
    const struct state_item *item = &desc->state->items[index];
    const struct state_geometry geometry = state_geometry_of(desc->state, item);
    const double *m = geometry.world;
    double offset[3];
    vec3_sub(m + 12, space->origin, offset);
    *r = (struct draw_record){.material = arena->item_materials[index],
                              .node = item->node,
                              .primitive = item->primitive,
                              .object = item->node};
    vec4 *rows[3] = {&r->row_0, &r->row_1, &r->row_2};
    for (int i = 0; i < 3; i++) {
        for (int c = 0; c < 3; c++)
            rows[i]->v[c] = (float)(vec3_dot(space->axes[i], m + 4 * c) / space->unit_m);
        rows[i]->v[3] = (float)(vec3_dot(space->axes[i], offset) / space->unit_m);
    }
    fill_normals(m, space->axes, item->is_mirrored ? -1 : 1, r);
    r->normal_1.v[3] = geometry.primitive->flags & SCENE_PRIMITIVE_IS_SMOOTH ? 1 : 0;
}

static bool reserve_records(struct draw_arena *arena, size_t count, struct error *err)
{
    if (count <= arena->record_capacity)
        return true;
    void *records = realloc(arena->records, count * sizeof *arena->records);
    if (records)
        arena->records = records;
    void *placed = records ? realloc(arena->placed, count * sizeof *arena->placed) : NULL;
    if (!placed)
        return error_set(err, ERROR_NO_MEMORY, "%zu draws", count);
    arena->placed = placed;
    arena->record_capacity = count;
    return true;
}

static bool is_same_space(const struct draw_space *a, const struct draw_space *b)
{
    bool is_same = a->unit_m == b->unit_m;
    for (int i = 0; i < 3; i++) {
        is_same = is_same && a->origin[i] == b->origin[i];
        for (int k = 0; k < 3; k++)
            is_same = is_same && a->axes[i][k] == b->axes[i][k];
    }
    return is_same;
}

/* Whether the placement can be that of the call before. */
static bool is_repeated(const struct draw_arena *arena, const struct draw_place_desc *desc)
{
    return arena->placement.epoch == arena->epoch && arena->placed_count == desc->item_count &&
           is_same_space(&arena->placed_space, &desc->space) &&
           memcmp(arena->placed, desc->items, desc->item_count * sizeof *desc->items) == 0;
}

static bool is_missing(const struct draw_arena *arena, const struct draw_place_desc *desc,
                       const struct draw_placement *placement)
{
    return desc->item_count && placement->epoch != arena->epoch;
}

static size_t count_missing(const struct draw_arena *arena, const struct draw_place_desc *descs,
                            struct draw_placement *const *placements, size_t count)
{
    size_t missing = 0;
    for (size_t i = 0; i < count; i++)
        missing += is_missing(arena, &descs[i], placements[i]) ? descs[i].item_count : 0;
    return missing;
}

static uint64_t most_records(const struct draw_arena *arena)
{
    uint64_t block = gl_limits_block(arena->limits, sizeof(struct draw_record));
    return block < RECORDS_KEPT ? block : RECORDS_KEPT;
}

bool draw_arena_has_block(const struct draw_arena *arena)
{
    return arena->used <= gl_limits_block(arena->limits, sizeof(struct draw_record));
}

bool draw_arena_place_all(struct draw_arena *arena, const struct draw_place_desc *descs,
                          struct draw_placement *const *placements, size_t count, struct error *err)
{
    const uint64_t size = sizeof *arena->records;
    size_t missing = count_missing(arena, descs, placements, count), filled = 0;
    if (!missing)
        return true;
    if (arena->used + missing > most_records(arena)) {
        let_records_go(arena);
        missing = count_missing(arena, descs, placements, count);
    }
    if (!reserve_records(arena, missing, err) ||
        !gl_buffer_reserve(&arena->draws,
                           &(struct gl_buffer_desc){.label = "frame.draws",
                                                    .size_bytes = (arena->used + missing) * size,
                                                    .is_uploaded = true},
                           true, err))
        return false;
    for (size_t i = 0; i < count; i++) {
        if (!is_missing(arena, &descs[i], placements[i]))
            continue;
        *placements[i] = (struct draw_placement){arena->epoch, (uint32_t)(arena->used + filled)};
        for (size_t k = 0; k < descs[i].item_count; k++)
            place_record(arena, &descs[i], descs[i].items[k], &arena->records[filled++]);
    }
    gl_buffer_write(&arena->draws, arena->used * size, missing * size, arena->records);
    arena->used += missing;
    return true;
}

bool draw_arena_place(struct draw_arena *arena, const struct draw_place_desc *desc,
                      struct draw_placement *placement, struct error *err)
{
    if (!is_missing(arena, desc, placement))
        return true;
    if (is_repeated(arena, desc)) {
        *placement = arena->placement;
        return true;
    }
    if (!draw_arena_place_all(arena, desc, &placement, 1, err))
        return false;
    memcpy(arena->placed, desc->items, desc->item_count * sizeof *desc->items);
    arena->placed_space = desc->space;
    arena->placed_count = desc->item_count;
    arena->placement = *placement;
    return true;
}
