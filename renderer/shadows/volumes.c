/* SPDX-License-Identifier: MIT */
/* Casters are uploaded where they changed, the rest in each frame. */
#include "renderer/shadows/volumes.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/matrix.h"
#include "renderer/base/wall_clock.h"
#include "renderer/shadows/shadow_traced.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"

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

/* Chunks begin where a block may begin. In a buffer with `bytes` for each element. */
static uint64_t chunk_place(size_t chunk, const struct volume_range *range, uint64_t bytes)
{
    uint64_t place = range->first * bytes + chunk * GL_BUFFER_ALIGNMENT;
    return place - place % GL_BUFFER_ALIGNMENT;
}

/* Of a buffer for all chunks, of which the last may have nothing, and is bound all the same. */
static uint64_t chunked_bytes(const struct volume_casters *casters, size_t count, uint64_t bytes)
{
    return count * bytes +
           (casters->chunk_count > 1 ? casters->chunk_count * GL_BUFFER_ALIGNMENT : 0);
}

uint64_t volumes_triangle_bytes(const struct volumes *volumes, uint64_t bytes)
{
    return chunked_bytes(&volumes->casters, volumes->casters.triangle_count, bytes);
}

static const struct chunked {
    enum volume_buffer buffer;
    uint32_t binding, bytes;
    size_t range; /* its place in a chunk */
} chunked[] = {
    {BUFFER_VERTICES, BIND_VOLUME_VERTICES, 16, offsetof(struct volume_chunk, vertices)},
    {BUFFER_EDGES, BIND_VOLUME_EDGES, 16, offsetof(struct volume_chunk, edges)},
    {BUFFER_SIDES, BIND_VOLUME_SIDES, 8, offsetof(struct volume_chunk, sides)},
    {BUFFER_TRIANGLES, BIND_VOLUME_TRIANGLES, 16, offsetof(struct volume_chunk, triangles)},
    {BUFFER_SIGNS, BIND_VOLUME_SIGNS, VOLUME_SIGN_BYTES, offsetof(struct volume_chunk, triangles)},
    {BUFFER_PARTS, BIND_VOLUME_PARTS, 8, offsetof(struct volume_chunk, parts)}, /* the last */
};
enum { CHUNKED = sizeof chunked / sizeof *chunked };

static const struct volume_range *range_of(const struct volume_chunk *chunk,
                                           const struct chunked *kind)
{
    return (const struct volume_range *)((const char *)chunk + kind->range);
}

void volumes_bind_chunk(const struct volumes *volumes, size_t chunk)
{
    for (int i = 0; i < (volumes_draw_counts(volumes) ? CHUNKED : CHUNKED - 1); i++) {
        const struct chunked *kind = &chunked[i];
        const struct volume_range *range = range_of(&volumes->casters.chunks[chunk], kind);
        gl_buffer_bind_storage_range(
            &volumes->buffers[kind->buffer], chunk_place(chunk, range, kind->bytes),
            (range->count ? range->count : 1) * kind->bytes, kind->binding);
    }
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
    if (!volume_casters_init(casters, volumes->state,
                             gl_limits_block(finding->limits, VOLUME_FACE_BYTES), err))
        return false;
    volumes->most_faces = 0;
    for (size_t i = 0; i < casters->chunk_count; i++) {
        uint64_t faces = casters->chunks[i].edges.count + casters->chunks[i].triangles.count;
        volumes->most_faces = faces > volumes->most_faces ? faces : volumes->most_faces;
    }
    casters->key = key;
    return true;
}

static bool upload_chunks(struct volumes *volumes, enum volume_buffer buffer, const void *data,
                          size_t count, struct error *err)
{
    const struct volume_casters *casters = &volumes->casters;
    const struct chunked *kind = chunked;
    while (kind->buffer != buffer)
        kind++;
    if (!reserve(volumes, buffer, chunked_bytes(casters, count, kind->bytes), true, err))
        return false;
    for (size_t i = 0; i < casters->chunk_count; i++) {
        const struct volume_range *range = range_of(&casters->chunks[i], kind);
        gl_buffer_write(&volumes->buffers[buffer], chunk_place(i, range, kind->bytes),
                        range->count * kind->bytes,
                        (const char *)data + range->first * kind->bytes);
    }
    return true;
}

static bool upload_casters(struct volumes *volumes, struct error *err)
{
    const struct volume_casters *casters = &volumes->casters;
    volumes->is_uploaded =
        volumes->is_uploaded ||
        (upload_chunks(volumes, BUFFER_EDGES, casters->edges, casters->edge_count, err) &&
         upload_chunks(volumes, BUFFER_SIDES, casters->sides, casters->side_count, err) &&
         upload_chunks(volumes, BUFFER_TRIANGLES, casters->triangles, casters->triangle_count,
                       err) &&
         upload_chunks(volumes, BUFFER_PARTS, casters->parts, casters->part_count, err));
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
    bool ok = upload_chunks(volumes, BUFFER_VERTICES, placed, casters->vertex_count, err);
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

void volumes_light_reach(const struct volumes *volumes, uint32_t light, float cone[4],
                         float *range_m)
{
    const struct state_light *source = &volumes->state->lights[light];
    double axes[3][3];
    camera_axes(volumes->camera, axes);
    for (int k = 0; k < 3; k++)
        cone[k] = (float)vec3_dot(axes[k], source->direction);
    cone[3] = source->type == SCENE_LIGHT_SPOT ? (float)cos((double)source->outer_cone_rad) : -2;
    *range_m = source->range;
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
