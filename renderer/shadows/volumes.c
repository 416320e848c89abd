/* SPDX-License-Identifier: MIT */
/* Casters are uploaded where they changed, the rest in each frame. */
#include "renderer/shadows/volumes.h"

#include <stdlib.h>
#include <string.h>

#include "renderer/base/matrix.h"
#include "renderer/base/wall_clock.h"
#include "renderer/shadows/shadow_traced.h"

static const char *const labels[VOLUME_BUFFERS] = {
    [BUFFER_VERTICES] = "shadow.volume.vertices", [BUFFER_EDGES] = "shadow.volume.edges",
    [BUFFER_SIDES] = "shadow.volume.sides",       [BUFFER_TRIANGLES] = "shadow.volume.triangles",
    [BUFFER_PARTS] = "shadow.volume.parts",       [BUFFER_WEIGHTS] = "shadow.volume.items",
    [BUFFER_REACH] = "shadow.volume.reach",       [BUFFER_LIGHTS] = "shadow.volume.lights",
    [BUFFER_GROUPS] = "shadow.volume.groups",     [BUFFER_FACES] = "shadow.volume.faces",
    [BUFFER_SPANS] = "shadow.volume.spans",       [BUFFER_SMALL] = "shadow.volume.small",
    [BUFFER_TILES] = "shadow.volume.tiles",       [BUFFER_SIGNS] = "shadow.volume.signs",
    [BUFFER_STARTS] = "shadow.volume.starts",     [BUFFER_SUMS] = "shadow.volume.sums",
    [BUFFER_COUNTERS] = "shadow.volume.counters"};

static bool reserve(struct volumes *volumes, enum volume_buffer buffer, uint64_t bytes,
                    bool is_uploaded, struct error *err)
{
    return gl_buffer_reserve(&volumes->buffers[buffer],
                             &(struct gl_buffer_desc){.label = labels[buffer],
                                                      .size_bytes = bytes,
                                                      .is_uploaded = is_uploaded,
                                                      .is_dynamic = !is_uploaded},
                             false, err);
}

static bool upload(struct volumes *volumes, enum volume_buffer buffer, const void *data,
                   uint64_t bytes, struct error *err)
{
    if (!reserve(volumes, buffer, bytes, true, err))
        return false;
    if (bytes)
        gl_buffer_write(&volumes->buffers[buffer], 0, bytes, data);
    return true;
}

bool volumes_reserve(struct volumes *volumes, enum volume_buffer buffer, uint64_t bytes,
                     struct error *err)
{
    return reserve(volumes, buffer, bytes, false, err);
}

/* ---- the casters ---- */

static bool check_room(const struct volume_casters *casters, const struct gl_limits *limits,
                       struct error *err)
{
    uint64_t most = gl_limits_block(limits, VOLUME_FACE_BYTES);
    uint64_t faces = casters->edge_count + casters->triangle_count;
    return faces <= most ||
           error_set(err, ERROR_OVER_BUDGET,
                     "shadow volumes of %llu edges and triangles, and a storage block of %llu "
                     "bytes has room for %llu",
                     (unsigned long long)faces, (unsigned long long)limits->max_storage_block_bytes,
                     (unsigned long long)most);
}

static bool take_casters(struct volumes *volumes, const struct shadow_finding *finding,
                         struct error *err)
{
    const struct content_key key = volume_casters_key(volumes->state, finding->scene_key);
    struct volume_casters *casters = &volumes->casters;
    volumes->is_kept = content_key_equals(key, casters->key);
    if (volumes->is_kept)
        return true;
    volumes->is_uploaded = false;
    volume_casters_finish(casters);
    if (!volume_casters_init(casters, volumes->state, err) ||
        !check_room(casters, finding->limits, err))
        return false;
    casters->key = key;
    return true;
}

static bool upload_casters(struct volumes *volumes, struct error *err)
{
    const struct volume_casters *casters = &volumes->casters;
    volumes->is_uploaded = volumes->is_uploaded ||
                           (upload(volumes, BUFFER_EDGES, casters->edges,
                                   casters->edge_count * sizeof *casters->edges, err) &&
                            upload(volumes, BUFFER_SIDES, casters->sides,
                                   casters->side_count * sizeof *casters->sides, err) &&
                            upload(volumes, BUFFER_TRIANGLES, casters->triangles,
                                   casters->triangle_count * sizeof *casters->triangles, err) &&
                            upload(volumes, BUFFER_PARTS, casters->parts,
                                   casters->part_count * sizeof *casters->parts, err));
    return volumes->is_uploaded;
}

/* In view space, where the eye is the origin: what f32 rounds off is seen under a small angle. */
static bool upload_vertices(struct volumes *volumes, struct error *err)
{
    const struct volume_casters *casters = &volumes->casters;
    float(*placed)[4] = malloc((casters->vertex_count + 1) * sizeof *placed);
    double axes[3][3], offset[3];
    if (!placed)
        return error_set(err, ERROR_NO_MEMORY, "%zu vertices of shadow volumes",
                         casters->vertex_count);
    camera_axes(volumes->camera, axes);
    for (size_t i = 0; i < casters->vertex_count; i++) {
        vec3_sub(casters->vertices[i], volumes->camera->eye, offset);
        for (int k = 0; k < 3; k++)
            placed[i][k] = (float)vec3_dot(axes[k], offset);
        placed[i][3] = 1;
    }
    bool ok = upload(volumes, BUFFER_VERTICES, placed, casters->vertex_count * sizeof *placed, err);
    free(placed);
    return ok;
}

bool volumes_draw_counts(const struct volumes *volumes)
{
    return volumes->form == VOLUME_COUNTS && volumes->drawn_by != VIEW_SILHOUETTE_COMPUTE;
}

static bool upload_weights(struct volumes *volumes, enum view_blend_filter blend, struct error *err)
{
    const struct scene_state *state = volumes->state;
    struct volume_weight *weights = calloc(state->item_count + 1, sizeof *weights);
    struct volume_weight kinds[VOLUME_GROUPS_MOST];
    float filters[VOLUME_GROUPS_MOST + VOLUME_BATCH][4];
    const size_t groups = volume_groups_find(state, blend, kinds);
    if (!weights)
        return error_set(err, ERROR_NO_MEMORY, "%zu casters", state->item_count);
    for (size_t i = 0; i < state->item_count; i++)
        if (state->items[i].casts_shadow)
            weights[i] = volume_weight_of(state, &state->items[i], blend);
    if (volumes->form == VOLUME_COUNTS && !volume_groups_check(groups, volumes->drawn_by, err)) {
        free(weights);
        return false;
    }
    volumes->group_count =
        volumes->form == VOLUME_COUNTS && groups <= VOLUME_GROUPS_MOST ? groups : 0;
    for (size_t i = 0; i < volumes->group_count + VOLUME_BATCH; i++)
        for (int k = 0; k < 4; k++)
            filters[i][k] =
                i < volumes->group_count ? (float)volume_weight_filter(&kinds[i], k) : 1;
    for (size_t i = 0; volumes->group_count && i < state->item_count; i++)
        weights[i] =
            (struct volume_weight){.log2 = {(uint32_t)volume_group_of(kinds, groups, &weights[i])}};
    memset(volumes->group_triangles, 0, sizeof volumes->group_triangles);
    for (size_t i = 0; volumes->group_count && i < volumes->casters.triangle_count; i++)
        volumes->group_triangles[weights[volumes->casters.triangles[i][3]].log2[0]]++;
    bool ok = upload(volumes, BUFFER_WEIGHTS, weights, state->item_count * sizeof *weights, err) &&
              upload(volumes, BUFFER_GROUPS, filters,
                     (volumes->group_count + VOLUME_BATCH) * sizeof *filters, err);
    free(weights);
    return ok;
}

uint32_t volumes_reach_words(const struct scene_state *state)
{
    return (uint32_t)(state->item_count + 31) / 32;
}

static bool upload_reach(struct volumes *volumes, const struct shadow_needs *needs,
                         struct error *err)
{
    size_t each = volumes_reach_words(volumes->state), count = needs->light_count * each;
    uint32_t *words = calloc(count + 1, sizeof *words);
    if (!words)
        return error_set(err, ERROR_NO_MEMORY, "casters of %zu lights", needs->light_count);
    for (size_t i = 0; i < needs->light_count; i++) {
        const struct shadow_casters *casters = &needs->lights[i].casters;
        for (size_t k = 0; k < casters->count; k++)
            words[i * each + casters->items[k] / 32] |= 1u << casters->items[k] % 32;
    }
    bool ok = upload(volumes, BUFFER_REACH, words, count * sizeof *words, err);
    free(words);
    return ok;
}

static bool upload_lights(struct volumes *volumes, const bool *is_shadowed, struct error *err)
{
    size_t count = volumes->state->light_count;
    uint32_t *words = calloc(count + 1, sizeof *words);
    volumes->is_shadowed = calloc(count + 1, sizeof *volumes->is_shadowed);
    bool ok = words && volumes->is_shadowed;
    if (!ok)
        error_set(err, ERROR_NO_MEMORY, "%zu lights", count);
    for (size_t i = 0; ok && i < count; i++)
        words[i] = volumes->is_shadowed[i] = is_shadowed[i];
    ok = ok && upload(volumes, BUFFER_LIGHTS, words, count * sizeof *words, err);
    free(words);
    return ok;
}

/* As rays have it (renderer/raytrace/rt_scene.c). */
static double find_nudge(const struct scene_state *state)
{
    double diagonal[3] = {0};
    if (state->bounds_min[0] <= state->bounds_max[0])
        vec3_sub(state->bounds_max, state->bounds_min, diagonal);
    return 1e-6 * 0.5 * vec3_length(diagonal);
}

void volumes_place_light(const struct volumes *volumes, uint32_t light, float at[4], float *eye)
{
    const struct state_light *source = &volumes->state->lights[light];
    const struct camera *camera = volumes->camera;
    double axes[3][3], offset[3];
    bool is_far = source->type == SCENE_LIGHT_DIRECTIONAL;
    camera_axes(camera, axes);
    vec3_sub(source->position, camera->eye, offset);
    for (int k = 0; k < 3; k++)
        at[k] = (float)(is_far ? -vec3_dot(axes[k], source->direction) : vec3_dot(axes[k], offset));
    at[3] = !is_far;
    /* so that no volume of a light at infinity is there */
    *eye = is_far && at[2] < 0 ? -1 : 1;
}

bool volumes_begin(struct volumes *volumes, const struct shadow_finding *finding, struct error *err)
{
    double begin_ms = wall_ms();
    volumes->state = finding->desc->state;
    volumes->camera = finding->desc->camera;
    volumes->nudge_m = find_nudge(volumes->state);
    volumes->most_spans = volumes->most_tiles = volumes->most_drawn = 0;
    bool ok = take_casters(volumes, finding, err) && upload_casters(volumes, err) &&
              upload_vertices(volumes, err) &&
              upload_weights(volumes, finding->desc->view->quality.blend_filter, err) &&
              upload_reach(volumes, finding->needs, err) &&
              upload_lights(volumes, finding->is_shadowed, err);
    volumes->build_ms = wall_ms() - begin_ms;
    return ok;
}
