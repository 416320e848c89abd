/* SPDX-License-Identifier: MIT */
/* Light clusters and falloff for rays in packets. */
#include "renderer/raytrace/rt_light_set.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_emitter.h"
#include "renderer/raytrace/rt_math.h"
#include "renderer/raytrace/rt_path.h"

static void fill_lamp(const struct rt_scene *scene, const struct state_light *light,
                      const struct view_quality *quality, struct rt_light_record *record)
{
    double outer = cos((double)light->outer_cone_rad);
    double scale = 1 / rt_max(cos((double)light->inner_cone_rad) - outer, 1e-3);
    *record = (struct rt_light_record){.cone_scale = (float)scale,
                                       .cone_offset = (float)(-outer * scale),
                                       .least_cosine = (float)outer,
                                       .inverse_range = light->range > 0 ? 1 / light->range : 0,
                                       .type = light->type,
                                       .is_area = state_light_is_area(light),
                                       .casts_shadow = light->casts_shadow,
                                       .samples = rt_light_sample_count(light, quality)};
    for (int k = 0; k < 3; k++) {
        record->position[k] = (float)(light->position[k] - scene->origin[k]);
        record->direction[k] = (float)light->direction[k];
        record->color[k] = light->color[k];
    }
}

static bool find_media(struct rt_light_set *light_set, const struct rt_scene *scene,
                       struct error *err)
{
    struct rt_hits scratch;
    light_set->sigma = calloc(light_set->state->light_count + 1, sizeof *light_set->sigma);
    if (!light_set->sigma || !rt_hits_init(&scratch, err))
        return error_set(err, ERROR_NO_MEMORY, "%zu lights in media",
                         light_set->state->light_count);
    for (size_t i = 0; i < light_set->state->light_count; i++) {
        const struct state_light *light = &light_set->state->lights[i];
        double at[3];
        vec3_sub(light->position, scene->origin, at);
        if (light->type != SCENE_LIGHT_DIRECTIONAL)
            rt_media_at(scene, at, &scratch, light_set->sigma[i]);
    }
    rt_hits_finish(&scratch);
    return true;
}

/* Whatever certainly is on the wrong side: by more than rounding. */
static const float CLEARLY = 1 + 2e-5f;

static void put_in_block(const struct rt_light_set *light_set, uint32_t light,
                         struct rt_light_block *block)
{
    const struct rt_light_record *record = &light_set->records[light];
    bool is_far = record->type == SCENE_LIGHT_DIRECTIONAL;
    size_t i = block->count++;
    float square = record->least_cosine * fabsf(record->least_cosine);
    block->lights[i] = light;
    block->x[i] = is_far ? -record->direction[0] : record->position[0];
    block->y[i] = is_far ? -record->direction[1] : record->position[1];
    block->z[i] = is_far ? -record->direction[2] : record->position[2];
    block->moves[i] = is_far ? 0 : 1;
    block->axis_x[i] = record->direction[0];
    block->axis_y[i] = record->direction[1];
    block->axis_z[i] = record->direction[2];
    /* points of an area light are wherever they are */
    block->inverse_square[i] =
        is_far || record->is_area ? 0 : record->inverse_range * record->inverse_range / CLEARLY;
    block->edge[i] = record->type != SCENE_LIGHT_SPOT ? -FLT_MAX
                     : square > 0                     ? square / CLEARLY
                                                      : square * CLEARLY;
    block->behind[i] = record->is_area ? -FLT_MAX : -1e-10f;
}

static bool list_all(struct rt_light_set *light_set, struct error *err)
{
    size_t count = light_set->state->light_count;
    light_set->all = calloc(count / RT_BLOCK_LIGHTS + 1, sizeof *light_set->all);
    for (size_t i = 0; light_set->all && i < count; i++)
        put_in_block(light_set, (uint32_t)i, &light_set->all[i / RT_BLOCK_LIGHTS]);
    return light_set->all || error_set(err, ERROR_NO_MEMORY, "list of all lights");
}

/* The whole picture, so that lists and the order of their lights are the same for all tiles; but of
 * pictures whose clusters would be too many, the blocks of pixels that the tile meets. */
static struct camera_window window_of(const struct view *view)
{
    enum { BLOCK_PX = 16 };
    struct camera_window window = camera_window_whole(view->width_px, view->height_px);
    const struct view_tile *tile = &view->tile;
    if (!tile->width_px ||
        (view->width_px <= VIEW_SIDE_MAX_PX && view->height_px <= VIEW_SIDE_MAX_PX))
        return window;
    int right = (tile->x_px + tile->width_px + BLOCK_PX - 1) / BLOCK_PX * BLOCK_PX;
    int below = (tile->y_px + tile->height_px + BLOCK_PX - 1) / BLOCK_PX * BLOCK_PX;
    window.x = tile->x_px / BLOCK_PX * BLOCK_PX;
    window.y = tile->y_px / BLOCK_PX * BLOCK_PX;
    window.width = (right < view->width_px ? right : view->width_px) - window.x;
    window.height = (below < view->height_px ? below : view->height_px) - window.y;
    return window;
}

bool rt_light_set_init(struct rt_light_set *light_set, const struct rt_scene *scene,
                       const struct raytrace_desc *desc, struct error *err)
{
    const struct scene_state *state = scene->state;
    light_set->state = state;
    light_set->window = window_of(desc->view);
    light_set->records = calloc(state->light_count + 1, sizeof *light_set->records);
    if (!light_set->records)
        return error_set(err, ERROR_NO_MEMORY, "%zu lights", state->light_count);
    for (size_t i = 0; i < state->light_count; i++)
        fill_lamp(scene, &state->lights[i], &desc->view->quality, &light_set->records[i]);
    if (state->medium_count && !find_media(light_set, scene, err))
        return false;
    if (desc->asks_all_lights)
        return list_all(light_set, err);
    return clusters_build(&light_set->clusters,
                          &(struct clusters_desc){.lights = state->lights,
                                                  .light_count = state->light_count,
                                                  .camera = desc->camera,
                                                  .window = &light_set->window},
                          err);
}

void rt_light_set_finish(struct rt_light_set *light_set)
{
    clusters_finish(&light_set->clusters);
    free(light_set->records);
    free(light_set->sigma);
    free(light_set->all);
    *light_set = (struct rt_light_set){0};
}

struct rt_light_list rt_light_set_near(const struct rt_light_set *light_set, int x, int y,
                                       double view_z)
{
    const struct clusters *clusters = &light_set->clusters;
    if (light_set->all)
        return (struct rt_light_list){.count = light_set->state->light_count};
    const struct camera_window *w = &light_set->window;
    size_t cluster = clusters_find(clusters, x - w->x, w->y + w->height - 1 - y, (float)view_z);
    const uint32_t *head = clusters->heads + 2 * cluster;
    return (struct rt_light_list){.cluster = cluster,
                                  .items = {clusters->items, clusters->items + head[0]},
                                  .counts = {clusters->prefix_count, head[1]},
                                  .count = clusters->prefix_count + head[1]};
}

const struct rt_light_block *rt_light_set_block(const struct rt_light_set *light_set,
                                                struct rt_light_blocks *blocks,
                                                const struct rt_light_list *list, size_t first)
{
    size_t part = first / RT_BLOCK_LIGHTS;
    if (light_set->all)
        return &light_set->all[part];
    size_t key = (list->cluster << 32 | part) + 1; /* never 0: an empty place */
    struct rt_light_block *block = &blocks->kept[(list->cluster + part) % RT_BLOCKS_KEPT];
    if (block->key == key)
        return block;
    block->key = key;
    block->count = 0;
    for (size_t i = first; i < list->count && block->count < RT_BLOCK_LIGHTS; i++)
        put_in_block(light_set, rt_light_list_at(list, i), block);
    return block;
}

/* Comparisons leave in what is not a number. */
size_t rt_light_block_look(const struct rt_light_block *b, const float point[3],
                           const float normal[3], uint32_t lights[RT_BLOCK_LIGHTS],
                           size_t *reaching)
{
    enum { TOGETHER = 8, FEW = 2 };
    if (b->count <= FEW) { /* asking them is as quick */
        memcpy(lights, b->lights, b->count * sizeof *lights);
        return *reaching = b->count;
    }
    int32_t reaches[RT_BLOCK_LIGHTS], counts[RT_BLOCK_LIGHTS];
    const float p[3] = {point[0], point[1], point[2]}, n[3] = {normal[0], normal[1], normal[2]};
    for (size_t first = 0; first < b->count; first += TOGETHER) {
        for (size_t i = first; i < first + TOGETHER; i++) {
            float x = b->x[i] - b->moves[i] * p[0];
            float y = b->y[i] - b->moves[i] * p[1];
            float z = b->z[i] - b->moves[i] * p[2];
            float square = x * x + y * y + z * z;
            float along = -(b->axis_x[i] * x + b->axis_y[i] * y + b->axis_z[i] * z);
            float facing = n[0] * x + n[1] * y + n[2] * z;
            reaches[i] = !(square * b->inverse_square[i] >= 1) &
                         !(along * fabsf(along) < b->edge[i] * square);
            counts[i] = reaches[i] & !(facing * fabsf(facing) < b->behind[i] * square);
        }
    }
    size_t found = 0, all = 0;
    for (size_t i = 0; i < b->count; i++) {
        lights[found] = b->lights[i];
        found += (size_t)counts[i];
        all += (size_t)reaches[i];
    }
    *reaching = all;
    return found;
}

/* Whether the cone certainly leaves the point out: before any root or division. to_light: not of
 * unit length. */
static bool is_outside(const struct rt_light_record *record, const float to_light[3], float square)
{
    static const float clearly = 1 + 1e-5f; /* by more than rounding */
    const float *d = record->direction, c = record->least_cosine;
    float along = -(d[0] * to_light[0] + d[1] * to_light[1] + d[2] * to_light[2]);
    float is = along * fabsf(along), least = c * fabsf(c) * square;
    return is < (least > 0 ? least / clearly : least * clearly);
}

float rt_light_set_arrive(const struct rt_light_set *light_set, uint32_t light,
                          const float point[3], float l[3], float *distance_m)
{
    const struct rt_light_record *record = &light_set->records[light];
    enum scene_light_type type = record->type;
    if (type == SCENE_LIGHT_DIRECTIONAL) {
        for (int k = 0; k < 3; k++)
            l[k] = -record->direction[k];
        *distance_m = INFINITY;
        return 1;
    }
    for (int k = 0; k < 3; k++)
        l[k] = record->position[k] - point[k];
    float square = l[0] * l[0] + l[1] * l[1] + l[2] * l[2];
    if (square * record->inverse_range * record->inverse_range >= 1 ||
        (type == SCENE_LIGHT_SPOT && is_outside(record, l, square)))
        return 0;
    float distance = sqrtf(square), gain = 1 / rt_max_f32(square, 1e-24f);
    float q = distance * record->inverse_range;
    gain *= rt_max_f32(1 - q * q * q * q, 0);
    float inverse = 1 / rt_max_f32(distance, 1e-30f);
    for (int k = 0; k < 3; k++)
        l[k] *= inverse;
    if (type == SCENE_LIGHT_SPOT) {
        const float *d = record->direction;
        float cosine = -(d[0] * l[0] + d[1] * l[1] + d[2] * l[2]);
        float cone =
            rt_min_f32(rt_max_f32(cosine * record->cone_scale + record->cone_offset, 0), 1);
        gain *= cone * cone;
    }
    *distance_m = distance;
    return gain;
}
