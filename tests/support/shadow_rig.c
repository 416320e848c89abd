/* SPDX-License-Identifier: MIT */
/* Pane scenes and the rig that prepares and queries their shadows. */
#include "tests/support/shadow_rig.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/matrix.h"

enum {
    SMALL_VERTICES = 12, /* of the rectangle and the box */
    SMALL_INDICES = 42,
    BALL_COLUMNS = 2 * BALL_ROWS,
    BALL_VERTICES = (BALL_ROWS + 1) * BALL_COLUMNS,
    BALL_INDICES = 6 * (BALL_ROWS - 1) * BALL_COLUMNS,
};
static const float small_positions[3 * SMALL_VERTICES] = {
    -1, -1, 0,  1, -1, 0,  1,  1,  0, -1, 1,  0, -1, -1, -1, 1, -1, -1,
    -1, 1,  -1, 1, 1,  -1, -1, -1, 1, 1,  -1, 1, -1, 1,  1,  1, 1,  1};
static const float small_normals[3 * SMALL_VERTICES] = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
static const float small_texcoords[2 * SMALL_VERTICES] = {0, 0, 1, 0, 1, 1, 0, 1};
static const uint8_t checker[16] = {255, 255, 255, 255, 255, 255, 255, 0,
                                    255, 255, 255, 0,   255, 255, 255, 255};
static const struct scene_image checker_image = {.width_px = 2, .height_px = 2};
/* Nearest, clamped. */
static const struct scene_texture checker_texture = {
    .mag_filter = 9728, .min_filter = 9728, .wrap_s = 33071, .wrap_t = 33071};
static const uint32_t small_indices[SMALL_INDICES] = {0, 1, 2, 0, 2, 3, 0, 2, 1, 1, 2, 3, 4, 5,
                                                      6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3,
                                                      6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};

double rig_random(uint64_t *seed)
{
    *seed = *seed * 6364136223846793005ull + 1442695040888963407ull;
    return (double)(*seed >> 11) * 0x1p-53;
}

void rig_random_points(double (*points)[3], uint32_t count, double half, double low, double high)
{
    uint64_t seed = 11;
    for (uint32_t i = 0; i < count; i++) {
        points[i][0] = 2 * half * rig_random(&seed) - half;
        points[i][1] = high > low ? low + (high - low) * rig_random(&seed) : low;
        points[i][2] = 2 * half * rig_random(&seed) - half;
    }
}

void pane_scene_finish(struct pane_scene *panes)
{
    free(panes->panes);
    free(panes->nodes);
    free(panes->meshes);
    free(panes->primitives);
    free(panes->materials);
    free(panes->ball_positions);
    free(panes->ball_indices);
    *panes = (struct pane_scene){0};
}

static void *grow(void *array, size_t capacity, size_t element)
{
    void *grown = realloc(array, (capacity + 1) * element);
    assert(grown);
    return grown;
}

/* Rows of latitude; those at the poles are points, and lack half their triangles. */
static void add_ball(struct pane_scene *panes)
{
    if (panes->ball_positions)
        return;
    float *p = calloc(3 * (SMALL_VERTICES + BALL_VERTICES), sizeof *p);
    uint32_t *i = calloc(SMALL_INDICES + BALL_INDICES, sizeof *i);
    assert(p && i);
    panes->ball_positions = memcpy(p, small_positions, sizeof small_positions);
    panes->ball_indices = memcpy(i, small_indices, sizeof small_indices);
    p += 3 * SMALL_VERTICES;
    i += SMALL_INDICES;
    for (uint32_t row = 0; row <= BALL_ROWS; row++) {
        for (uint32_t column = 0; column < BALL_COLUMNS; column++) {
            bool is_pole = row == 0 || row == BALL_ROWS;
            double latitude = M_PI * row / BALL_ROWS, turn = 2 * M_PI * column / BALL_COLUMNS;
            *p++ = is_pole ? 0 : (float)(sin(latitude) * cos(turn));
            *p++ = is_pole ? 0 : (float)(sin(latitude) * sin(turn));
            *p++ = (float)cos(latitude);
            uint32_t a = row * BALL_COLUMNS + column, c = a + BALL_COLUMNS;
            uint32_t b = row * BALL_COLUMNS + (column + 1) % BALL_COLUMNS, d = b + BALL_COLUMNS;
            for (int k = 0; k < 3 && row > 0 && row < BALL_ROWS; k++)
                *i++ = (uint32_t[]){a, c, b}[k];
            for (int k = 0; k < 3 && row < BALL_ROWS - 1; k++)
                *i++ = (uint32_t[]){b, c, d}[k];
        }
    }
    assert(i == panes->ball_indices + SMALL_INDICES + BALL_INDICES);
}

static void refresh(struct pane_scene *panes)
{
    bool has_ball = panes->ball_positions != NULL;
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
        .indices = has_ball ? panes->ball_indices : small_indices,
        .index_count = has_ball ? SMALL_INDICES + BALL_INDICES : SMALL_INDICES,
        .vertex_count = has_ball ? SMALL_VERTICES + BALL_VERTICES : SMALL_VERTICES,
        .positions = has_ball ? panes->ball_positions : small_positions,
        .normals = has_ball ? panes->ball_positions : small_normals,
        .texcoords_0 = has_ball ? NULL : small_texcoords,
        .textures = &checker_texture,
        .texture_count = 1,
        .images = &checker_image,
        .image_count = 1,
        .pixels = checker,
        .pixel_bytes = sizeof checker,
    };
}

static struct scene_primitive primitive_of(enum pane_shape shape, uint32_t index)
{
    struct scene_primitive p = {.material = index,
                                .topology = SCENE_TRIANGLES,
                                .index_count = 6,
                                .vertex_count = 4,
                                .flags =
                                    SCENE_PRIMITIVE_HAS_NORMALS | SCENE_PRIMITIVE_HAS_TEXCOORDS_0,
                                .bounds_min = {-1, -1, 0},
                                .bounds_max = {1, 1, 0}};
    if (shape == PANE_FLAT)
        return p;
    p.first_index = shape == PANE_BOX ? 6 : SMALL_INDICES;
    p.index_count = shape == PANE_BOX ? SMALL_INDICES - 6 : BALL_INDICES;
    p.first_vertex = shape == PANE_BOX ? 4 : SMALL_VERTICES;
    p.vertex_count = shape == PANE_BOX ? SMALL_VERTICES - 4 : BALL_VERTICES;
    p.flags = SCENE_PRIMITIVE_HAS_NORMALS | SCENE_PRIMITIVE_IS_CLOSED;
    p.bounds_min[2] = -1;
    p.bounds_max[2] = 1;
    return p;
}

void pane_scene_set(struct pane_scene *panes, uint32_t index, const struct pane *pane)
{
    bool is_medium = pane->shape != PANE_FLAT;
    struct scene_node *node = &panes->nodes[index];
    struct scene_material *material = &panes->materials[index];
    panes->panes[index] = *pane;
    *node = (struct scene_node){
        .parent = -1, .mesh = (int32_t)index, .camera = -1, .light = -1, .grid = -1};
    double n[3];
    vec3_cross(pane->u, pane->v, n);
    vec3_normalize(n);
    mat4_identity(node->local_matrix);
    memcpy(node->local_matrix, pane->u, sizeof pane->u);
    memcpy(node->local_matrix + 4, pane->v, sizeof pane->v);
    memcpy(node->local_matrix + 8, is_medium ? pane->w : n, sizeof n);
    memcpy(node->local_matrix + 12, pane->center, sizeof pane->center);
    memcpy(node->world_matrix, node->local_matrix, sizeof node->world_matrix);
    panes->meshes[index] = (struct scene_mesh){.first_primitive = index, .primitive_count = 1};
    if (pane->shape == PANE_BALL)
        add_ball(panes);
    panes->primitives[index] = primitive_of(pane->shape, index);
    *material = (struct scene_material){
        .base_color = {pane->color[0], pane->color[1], pane->color[2], 1},
        .roughness = 1,
        .transmission = pane->is_opaque || pane->is_blended ? 0 : 1,
        .alpha_mode = pane->is_blended                        ? SCENE_BLEND
                      : pane->is_opaque && pane->is_checkered ? SCENE_MASK
                                                              : SCENE_OPAQUE,
        .alpha_cutoff = 0.5f,
        .ior = 1.5f,
        .attenuation_color = {expf(-pane->sigma[0]), expf(-pane->sigma[1]), expf(-pane->sigma[2])},
        .attenuation_distance = 1,
        .thickness = is_medium ? 1 : 0,
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

void pane_scene_add_random(struct pane_scene *panes, int count, uint64_t seed)
{
    for (int i = 0; i < count; i++) {
        double a = 6.283 * rig_random(&seed), lean = 0.4 * (rig_random(&seed) - 0.5);
        struct pane pane = {
            .center = {5 * rig_random(&seed) - 2.5, 1 + 6 * rig_random(&seed),
                       5 * rig_random(&seed) - 2.5},
            .u = {1.5 * cos(a), 1.5 * lean, 1.5 * sin(a)},
            .v = {-1.5 * sin(a), 0, 1.5 * cos(a)},
            .is_opaque = i % 9 == 4,
        };
        for (int k = 0; k < 3; k++)
            pane.color[k] = 0.05f + 0.95f * (float)rig_random(&seed);
        pane_scene_add(panes, &pane);
    }
}

uint32_t pane_scene_add_sheet(struct pane_scene *panes, double y, const float color[3])
{
    struct pane pane = {.center = {0, y, 0}, .u = {3, 0, 0}, .v = {0, 0, 3}};
    memcpy(pane.color, color, sizeof pane.color);
    return pane_scene_add(panes, &pane);
}

static void must(bool ok, const struct error *err)
{
    if (!ok) {
        fprintf(stderr, "rig: %s\n", err->message);
        abort();
    }
}

const struct view_light shadow_rig_lamps[SHADOW_RIG_LAMPS] = {
    {.type = SCENE_LIGHT_DIRECTIONAL,
     .direction = {0.1, -1, 0.05},
     .color = {1, 1, 1},
     .intensity = 1},
    {.type = SCENE_LIGHT_POINT, .position = {0.1, 10, 0.2}, .color = {1, 1, 1}, .intensity = 1},
    {.type = SCENE_LIGHT_SPOT,
     .position = {0.1, 10, 0.2},
     .direction = {0, -1, 0},
     .color = {1, 1, 1},
     .intensity = 1,
     .outer_cone_deg = 30},
};

bool shadow_rig_open(struct shadow_rig *rig, uint64_t budget_bytes, uint64_t first_linked_elements)
{
    return shadow_rig_open_without_locks(rig, budget_bytes, first_linked_elements, 0);
}

bool shadow_rig_open_without_locks(struct shadow_rig *rig, uint64_t budget_bytes,
                                   uint64_t first_linked_elements, uint64_t refused_locks)
{
    struct error err = {0};
    *rig = (struct shadow_rig){0};
    rig->context = gl_context_create(&(struct gl_context_desc){.is_strict = true}, &err);
    if (!rig->context) {
        fprintf(stderr, "skipped: %s\n", err.message);
        return false;
    }
    rig->programs = program_cache_create(NULL, &err);
    rig->timeline = gpu_timeline_create(rig->context, &err);
    rig->arena = draw_arena_create(gl_context_limits(rig->context), &err);
    rig->textures =
        texture_pool_create(&(struct texture_pool_desc){.budget_bytes = 1ull << 40}, &err);
    must(rig->programs && rig->timeline && rig->arena && rig->textures, &err);
    struct shadow_system_desc desc = {
        .programs = rig->programs,
        .timeline = rig->timeline,
        .limits = gl_context_limits(rig->context),
        .budget_bytes = budget_bytes,
        .first_linked_elements = first_linked_elements,
        .refused_locks = refused_locks,
    };
    for (int i = 0; i < 2; i++) {
        desc.scans_on_device = desc.layers_faces = i == 1;
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
    texture_pool_destroy(rig->textures);
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

/* As a frame does before its casters are drawn. */
static bool bring_textures(struct shadow_rig *rig, struct error *err)
{
    struct report_textures report;
    const struct texture_demand demand = {.store = scene_gpu_textures(rig->gpu, 0)};
    const struct texture_request request = {.demands = &demand, .count = 1};
    assert(scene_gpu_part_count(rig->gpu) == 1);
    return texture_pool_prepare(rig->textures, &request, &report, err);
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
    rig->gpu = ok ? scene_gpu_create(&rig->scene, rig->textures, err) : NULL;
    if (!rig->gpu || !bring_textures(rig, err) || !draw_arena_begin(rig->arena, &rig->state, err))
        return false;
    struct shadow_prepare_desc desc = {.scene_key = "panes",
                                       .gpu = rig->gpu,
                                       .state = &rig->state,
                                       .arena = rig->arena,
                                       .quality = quality,
                                       .yield = rig->yield};
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
    struct shadow_probe_desc desc = {
        .points = probes, .count = count, .tolerance = {rig->tolerance[0], rig->tolerance[1]}};
    bool ok = shadow_probe_run(rig->shadows, rig->programs, &desc, out, &err);
    must(ok && gl_context_check(rig->context, "asking for shadows", &err), &err);
    free(probes);
}

void shadow_rig_prepare_lamps(struct shadow_rig *rig, const struct pane_scene *panes,
                              const struct view_quality *quality)
{
    static const double no_eye[3] = {0, 0, 0};
    struct error err = {0};
    bool ok =
        shadow_rig_prepare(rig, panes, shadow_rig_lamps, SHADOW_RIG_LAMPS, no_eye, quality, &err);
    must(ok, &err);
}

void shadow_rig_ask(struct shadow_rig *rig, uint32_t light, const double (*points)[3],
                    uint32_t count, float (*out)[4])
{
    static const double up[3] = {0, 1, 0};
    shadow_rig_query(rig, light, points, up, count, UINT32_MAX, out);
}
