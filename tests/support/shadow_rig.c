/* SPDX-License-Identifier: MIT */
/* Pane scenes and the rig that prepares and queries their shadows. */
#include "tests/support/shadow_rig.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>

#include "renderer/scene/matrix.h"

static const float quad_positions[12] = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0};
static const float quad_normals[12] = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
static const float quad_texcoords[8] = {0, 0, 1, 0, 1, 1, 0, 1};
static const uint8_t checker[16] = {255, 255, 255, 255, 255, 255, 255, 0,
                                    255, 255, 255, 0,   255, 255, 255, 255};
static const struct scene_image checker_image = {.width_px = 2, .height_px = 2};
static const struct scene_texture checker_texture = {
    .mag_filter = 9728, .min_filter = 9728, .wrap_s = 33071, .wrap_t = 33071}; /* nearest, clamped
                                                                                */
static const uint32_t quad_indices[6] = {0, 1, 2, 0, 2, 3};

double rig_random(uint64_t *seed)
{
    *seed = *seed * 6364136223846793005ull + 1442695040888963407ull;
    return (double)(*seed >> 11) * 0x1p-53;
}

void pane_scene_finish(struct pane_scene *panes)
{
    free(panes->panes);
    free(panes->nodes);
    free(panes->meshes);
    free(panes->primitives);
    free(panes->materials);
    *panes = (struct pane_scene){0};
}

static void *grow(void *array, size_t capacity, size_t element)
{
    void *grown = realloc(array, (capacity + 1) * element);
    assert(grown);
    return grown;
}

static void refresh(struct pane_scene *panes)
{
    static const char no_strings[1] = "";
    panes->scene = (struct scene){
        .strings = no_strings,
        .nodes = panes->nodes,
        .node_count = panes->count,
        .meshes = panes->meshes,
        .mesh_count = panes->count,
        .primitives = panes->primitives,
        .primitive_count = panes->count,
        .materials = panes->materials,
        .material_count = panes->count,
        .indices = quad_indices,
        .index_count = 6,
        .vertex_count = 4,
        .positions = quad_positions,
        .normals = quad_normals,
        .texcoords_0 = quad_texcoords,
        .textures = &checker_texture,
        .texture_count = 1,
        .images = &checker_image,
        .image_count = 1,
        .pixels = checker,
        .pixel_bytes = sizeof checker,
    };
}

void pane_scene_set(struct pane_scene *panes, uint32_t index, const struct pane *pane)
{
    struct scene_node *node = &panes->nodes[index];
    struct scene_material *material = &panes->materials[index];
    panes->panes[index] = *pane;
    *node = (struct scene_node){.parent = -1, .mesh = (int32_t)index, .camera = -1, .light = -1};
    double n[3];
    vec3_cross(pane->u, pane->v, n);
    vec3_normalize(n);
    mat4_identity(node->local_matrix);
    memcpy(node->local_matrix, pane->u, sizeof pane->u);
    memcpy(node->local_matrix + 4, pane->v, sizeof pane->v);
    memcpy(node->local_matrix + 8, n, sizeof n);
    memcpy(node->local_matrix + 12, pane->center, sizeof pane->center);
    memcpy(node->world_matrix, node->local_matrix, sizeof node->world_matrix);
    panes->meshes[index] = (struct scene_mesh){.first_primitive = index, .primitive_count = 1};
    panes->primitives[index] = (struct scene_primitive){
        .material = index,
        .topology = SCENE_TRIANGLES,
        .index_count = 6,
        .vertex_count = 4,
        .flags = SCENE_PRIMITIVE_HAS_NORMALS | SCENE_PRIMITIVE_HAS_TEXCOORDS_0,
        .bounds_min = {-1, -1, 0},
        .bounds_max = {1, 1, 0},
    };
    *material = (struct scene_material){
        .base_color = {pane->color[0], pane->color[1], pane->color[2], 1},
        .roughness = 1,
        .transmission = pane->is_opaque || pane->is_blended ? 0 : 1,
        .alpha_mode = pane->is_blended                        ? SCENE_BLEND
                      : pane->is_opaque && pane->is_checkered ? SCENE_MASK
                                                              : SCENE_OPAQUE,
        .alpha_cutoff = 0.5f,
        .ior = 1.5f,
        .attenuation_color = {1, 1, 1},
        .pass_through = pane->pass_through,
    };
    for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++)
        material->textures[slot] =
            (struct scene_texture_ref){.texture = -1, .uv_transform = {1, 0, 0, 0, 1, 0}};
    if (pane->is_checkered)
        material->textures[SCENE_TEXTURE_BASE_COLOR].texture = 0;
    refresh(panes);
}

uint32_t pane_scene_add(struct pane_scene *panes, const struct pane *pane)
{
    if (panes->count == panes->capacity) {
        panes->capacity = panes->capacity ? 2 * panes->capacity : 64;
        panes->panes = grow(panes->panes, panes->capacity, sizeof *panes->panes);
        panes->nodes = grow(panes->nodes, panes->capacity, sizeof *panes->nodes);
        panes->meshes = grow(panes->meshes, panes->capacity, sizeof *panes->meshes);
        panes->primitives = grow(panes->primitives, panes->capacity, sizeof *panes->primitives);
        panes->materials = grow(panes->materials, panes->capacity, sizeof *panes->materials);
    }
    pane_scene_set(panes, panes->count++, pane);
    refresh(panes);
    return panes->count - 1;
}

static void must(bool ok, const struct error *err)
{
    if (!ok) {
        fprintf(stderr, "rig: %s\n", err->message);
        abort();
    }
}

bool shadow_rig_open(struct shadow_rig *rig, uint64_t budget_bytes, uint64_t first_linked_elements)
{
    struct error err = {0};
    *rig = (struct shadow_rig){0};
    rig->context = gl_context_create(&(struct gl_context_desc){.is_strict = true}, &err);
    if (!rig->context) {
        fprintf(stderr, "skipped: %s\n", err.message);
        return false;
    }
    rig->programs = program_cache_create(getenv("VITRAIL_DUMP_SHADERS"), &err);
    rig->timeline = gpu_timeline_create(rig->context, &err);
    rig->arena = draw_arena_create(&err);
    must(rig->programs && rig->timeline && rig->arena, &err);
    struct shadow_system_desc desc = {
        .programs = rig->programs,
        .timeline = rig->timeline,
        .limits = gl_context_limits(rig->context),
        .budget_bytes = budget_bytes,
        .first_linked_elements = first_linked_elements,
    };
    for (int i = 0; i < 2; i++) {
        desc.scans_on_device = i == 1;
        rig->systems[i] = shadow_system_create(&desc, &err);
        must(rig->systems[i], &err);
    }
    rig->shadows = rig->systems[0];
    return true;
}

static void drop_scene(struct shadow_rig *rig)
{
    scene_gpu_destroy(rig->gpu);
    rig->gpu = NULL;
    if (rig->state.scene)
        scene_state_finish(&rig->state);
}

void shadow_rig_close(struct shadow_rig *rig)
{
    drop_scene(rig);
    shadow_system_destroy(rig->systems[0]);
    shadow_system_destroy(rig->systems[1]);
    draw_arena_destroy(rig->arena);
    gpu_timeline_destroy(rig->timeline);
    program_cache_destroy(rig->programs);
    gl_context_destroy(rig->context);
    *rig = (struct shadow_rig){0};
}

static struct view_material_override *override_flags(const struct pane_scene *panes,
                                                     char (*names)[16])
{
    struct view_material_override *overrides = calloc(panes->count + 1, sizeof *overrides);
    assert(overrides);
    for (uint32_t i = 0; i < panes->count; i++) {
        snprintf(names[i], sizeof names[i], "#%u", i);
        overrides[i] = (struct view_material_override){
            .material = names[i],
            .has_self_shadow = panes->panes[i].no_self_shadow,
            .has_cast_once = panes->panes[i].cast_once,
            .cast_once = true,
        };
    }
    return overrides;
}

bool shadow_rig_prepare(struct shadow_rig *rig, const struct pane_scene *panes,
                        const struct view_light *lights, size_t light_count, const double eye[3],
                        const struct view_quality *quality, struct error *err)
{
    drop_scene(rig);
    char(*names)[16] = calloc(panes->count + 1, sizeof *names);
    struct view_material_override *overrides = override_flags(panes, names);
    struct view view = {.lights = lights,
                        .light_count = light_count,
                        .materials = overrides,
                        .material_override_count = panes->count};
    rig->panes = panes;
    rig->scene = panes->scene;
    rig->quality = *quality;
    rig->report = (struct frame_report){0};
    memcpy(rig->eye, eye, sizeof rig->eye);
    bool ok = scene_state_init(&rig->state, &rig->scene, &view, err);
    free(overrides);
    free(names);
    rig->gpu = ok ? scene_gpu_create(&rig->scene, err) : NULL;
    if (!rig->gpu || !draw_arena_begin(rig->arena, &rig->state, err))
        return false;
    struct shadow_prepare_desc desc = {.scene_key = "panes",
                                       .gpu = rig->gpu,
                                       .state = &rig->state,
                                       .arena = rig->arena,
                                       .quality = quality};
    memcpy(desc.eye, eye, sizeof desc.eye);
    ok = shadow_system_prepare(rig->shadows, &desc, &rig->report, err);
    gpu_timeline_collect(rig->timeline, &rig->report);
    return gl_context_check(rig->context, "preparing shadows", err) && ok;
}

void shadow_rig_query(struct shadow_rig *rig, uint32_t light, const double (*points)[3],
                      const double normal[3], uint32_t count, uint32_t object, float (*out)[4])
{
    struct error err = {0};
    struct shadow_probe_point *probes = calloc(count, sizeof *probes);
    assert(probes);
    for (uint32_t i = 0; i < count; i++) {
        for (int k = 0; k < 3; k++) {
            probes[i].p[k] = (float)(points[i][k] - rig->eye[k]);
            probes[i].n[k] = (float)normal[k];
        }
        probes[i].object = object;
        probes[i].shadow = shadow_system_record(rig->shadows, light);
    }
    bool ok = shadow_probe_run(rig->shadows, rig->programs, probes, count, 1, out, &err);
    must(ok && gl_context_check(rig->context, "asking for shadows", &err), &err);
    free(probes);
}
