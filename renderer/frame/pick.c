/* SPDX-License-Identifier: MIT */
/* Picking: the view as the rasteriser sees it, asked by rays. */
#include "renderer/raytrace/pick.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/frame/frame_raytrace.h"
#include "renderer/frame/renderer_internal.h"
#include "renderer/frame/scene_parts.h"

/* The result that the rays of one call fill in. */
struct picking {
    const struct pick_desc *desc;
    struct pick_result *result;
    uint64_t *pixels, *last_ray; /* per node of the scene */
    uint64_t ray;
    bool has_failed;
};

void pick_result_finish(struct pick_result *result)
{
    free(result->layers);
    free(result->nodes);
    *result = (struct pick_result){0};
}

static void keep_layers(void *context, const struct raytrace_layer *layers, size_t count)
{
    struct picking *picking = context;
    size_t kept = picking->desc->is_through || count == 0 ? count : 1;
    struct raytrace_layer *copy = kept ? malloc(kept * sizeof *copy) : NULL;
    picking->has_failed = kept && !copy;
    if (!copy)
        return;
    memcpy(copy, layers, kept * sizeof *copy);
    picking->result->layers = copy;
    picking->result->layer_count = kept;
}

static void count_nodes(void *context, const struct raytrace_layer *layers, size_t count)
{
    struct picking *picking = context;
    size_t kept = picking->desc->is_through || count == 0 ? count : 1;
    picking->ray++;
    for (size_t i = 0; i < kept; i++) {
        uint32_t node = layers[i].node;
        picking->pixels[node] += picking->last_ray[node] != picking->ray;
        picking->last_ray[node] = picking->ray;
    }
}

static bool list_nodes(struct picking *picking, uint32_t node_count, struct error *err)
{
    struct pick_result *result = picking->result;
    size_t count = 0;
    for (uint32_t i = 0; i < node_count; i++)
        count += picking->pixels[i] > 0;
    result->nodes = calloc(count + 1, sizeof *result->nodes);
    if (!result->nodes)
        return error_set(err, ERROR_NO_MEMORY, "%zu nodes", count);
    for (uint32_t i = 0; i < node_count; i++)
        if (picking->pixels[i] > 0)
            result->nodes[result->node_count++] = (struct pick_node){i, picking->pixels[i]};
    return true;
}

static bool pick_point(const struct raytrace_desc *rays, struct picking *picking, struct error *err)
{
    const struct pick_desc *desc = picking->desc;
    bool ok = raytrace_pick(rays,
                            &(struct raytrace_pick){.x = desc->x,
                                                    .y = desc->y,
                                                    .width = 1,
                                                    .height = 1,
                                                    .context = picking,
                                                    .visit = keep_layers},
                            err);
    return ok && (!picking->has_failed || error_set(err, ERROR_NO_MEMORY, "layers of a ray"));
}

static bool pick_rectangle(const struct raytrace_desc *rays, struct picking *picking,
                           struct error *err)
{
    const struct pick_desc *desc = picking->desc;
    uint32_t node_count = rays->state->scene->node_count;
    picking->pixels = calloc(node_count + 1u, sizeof *picking->pixels);
    picking->last_ray = calloc(node_count + 1u, sizeof *picking->last_ray);
    bool ok = picking->pixels && picking->last_ray;
    if (!ok)
        error_set(err, ERROR_NO_MEMORY, "%u nodes", node_count);
    ok = ok &&
         raytrace_pick(rays,
                       &(struct raytrace_pick){.x = desc->x + 0.5,
                                               .y = desc->y + 0.5,
                                               .width = desc->width,
                                               .height = desc->height,
                                               .context = picking,
                                               .visit = count_nodes},
                       err) &&
         list_nodes(picking, node_count, err);
    free(picking->pixels);
    free(picking->last_ray);
    return ok;
}

bool renderer_pick(struct renderer *renderer, const char *scene_key, const struct view *view,
                   const struct pick_desc *desc, struct pick_result *result, struct error *err)
{
    struct scene_state state;
    struct camera camera;
    struct frame_context *context = renderer_next_context(renderer, err);
    struct resident_scene *scene =
        context ? renderer_find_scene(renderer, scene_key, view, err) : NULL;
    *result = (struct pick_result){0};
    if (!scene)
        return false;
    if (!scene_state_init(&state, &scene->scene, view, err))
        return false;
    frame_drop_other_traced(context, scene->key);
    bool ok = camera_resolve(&camera, view, &state, err);
    const struct raytrace_desc rays = {
        .view = view, .state = &state, .camera = &camera, .cache = renderer->traced};
    struct picking picking = {.desc = desc, .result = result};
    bool is_point = desc->width == 0;
    ok = ok && (is_point ? pick_point(&rays, &picking, err) : pick_rectangle(&rays, &picking, err));
    scene_state_finish(&state);
    if (!ok)
        pick_result_finish(result);
    return ok;
}
