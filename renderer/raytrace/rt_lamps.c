/* SPDX-License-Identifier: MIT */
/* Light clusters and falloff for rays in packets. */
#include "renderer/raytrace/rt_lamps.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_emitter.h"
#include "renderer/raytrace/rt_math.h"
#include "renderer/raytrace/rt_path.h"

static void fill_lamp(const struct rt_scene *scene, const struct state_light *light,
                      const struct view_quality *quality, struct rt_lamp *lamp)
{
    double outer = cos((double)light->outer_cone_rad);
    double scale = 1 / rt_max(cos((double)light->inner_cone_rad) - outer, 1e-3);
    *lamp = (struct rt_lamp){.cone_scale = (float)scale,
                             .cone_offset = (float)(-outer * scale),
                             .least_cosine = (float)outer,
                             .inverse_range = light->range > 0 ? 1 / light->range : 0,
                             .type = light->type,
                             .is_area = state_light_is_area(light),
                             .casts_shadow = light->casts_shadow,
                             .samples = rt_light_sample_count(light, quality)};
    for (int k = 0; k < 3; k++) {
        lamp->position[k] = (float)(light->position[k] - scene->origin[k]);
        lamp->direction[k] = (float)light->direction[k];
        lamp->color[k] = light->color[k];
    }
}

static bool find_media(struct rt_lamps *lamps, const struct rt_scene *scene, struct error *err)
{
    struct rt_hits scratch;
    lamps->sigma = calloc(lamps->state->light_count + 1, sizeof *lamps->sigma);
    if (!lamps->sigma || !rt_hits_init(&scratch, err))
        return error_set(err, ERROR_NO_MEMORY, "%zu lights in media", lamps->state->light_count);
    for (size_t i = 0; i < lamps->state->light_count; i++) {
        const struct state_light *light = &lamps->state->lights[i];
        double at[3];
        vec3_sub(light->position, scene->origin, at);
        if (light->type != SCENE_LIGHT_DIRECTIONAL)
            rt_media_at(scene, at, &scratch, lamps->sigma[i]);
    }
    rt_hits_finish(&scratch);
    return true;
}

/* Whatever certainly is on the wrong side: by more than rounding. */
static const float CLEARLY = 1 + 2e-5f;

static void put_in_block(const struct rt_lamps *lamps, uint32_t light, struct rt_lamp_block *block)
{
    const struct rt_lamp *lamp = &lamps->lamps[light];
    bool is_far = lamp->type == SCENE_LIGHT_DIRECTIONAL;
    size_t i = block->count++;
    float square = lamp->least_cosine * fabsf(lamp->least_cosine);
    block->lights[i] = light;
    block->x[i] = is_far ? -lamp->direction[0] : lamp->position[0];
    block->y[i] = is_far ? -lamp->direction[1] : lamp->position[1];
    block->z[i] = is_far ? -lamp->direction[2] : lamp->position[2];
    block->moves[i] = is_far ? 0 : 1;
    block->axis_x[i] = lamp->direction[0];
    block->axis_y[i] = lamp->direction[1];
    block->axis_z[i] = lamp->direction[2];
    /* points of an area light are wherever they are */
    block->inverse_square[i] =
        is_far || lamp->is_area ? 0 : lamp->inverse_range * lamp->inverse_range / CLEARLY;
    block->edge[i] = lamp->type != SCENE_LIGHT_SPOT ? -FLT_MAX
                     : square > 0                   ? square / CLEARLY
                                                    : square * CLEARLY;
    block->behind[i] = lamp->is_area ? -FLT_MAX : -1e-10f;
}

static bool list_all(struct rt_lamps *lamps, struct error *err)
{
    size_t count = lamps->state->light_count;
    lamps->all = calloc(count / RT_BLOCK_LIGHTS + 1, sizeof *lamps->all);
    for (size_t i = 0; lamps->all && i < count; i++)
        put_in_block(lamps, (uint32_t)i, &lamps->all[i / RT_BLOCK_LIGHTS]);
    return lamps->all || error_set(err, ERROR_NO_MEMORY, "list of all lights");
}

bool rt_lamps_init(struct rt_lamps *lamps, const struct rt_scene *scene,
                   const struct raytrace_desc *desc, struct error *err)
{
    const struct scene_state *state = scene->state;
    const struct view *view = desc->view;
    struct camera_window window = {
        0, 0, view->width_px, view->height_px, view->width_px, view->height_px};
    lamps->state = state;
    lamps->height_px = view->height_px;
    lamps->lamps = calloc(state->light_count + 1, sizeof *lamps->lamps);
    if (!lamps->lamps)
        return error_set(err, ERROR_NO_MEMORY, "%zu lights", state->light_count);
    for (size_t i = 0; i < state->light_count; i++)
        fill_lamp(scene, &state->lights[i], &view->quality, &lamps->lamps[i]);
    if (state->medium_count && !find_media(lamps, scene, err))
        return false;
    if (desc->asks_all_lights)
        return list_all(lamps, err);
    return clusters_build(&lamps->clusters,
                          &(struct clusters_desc){.lights = state->lights,
                                                  .light_count = state->light_count,
                                                  .camera = desc->camera,
                                                  .window = &window},
                          err);
}

void rt_lamps_finish(struct rt_lamps *lamps)
{
    clusters_finish(&lamps->clusters);
    free(lamps->lamps);
    free(lamps->sigma);
    free(lamps->all);
    *lamps = (struct rt_lamps){0};
}

struct rt_lamp_list rt_lamps_near(const struct rt_lamps *lamps, int x, int y, double view_z)
{
    const struct clusters *clusters = &lamps->clusters;
    if (lamps->all)
        return (struct rt_lamp_list){.count = lamps->state->light_count};
    size_t cluster = clusters_find(clusters, x, lamps->height_px - 1 - y, (float)view_z);
    const uint32_t *head = clusters->heads + 2 * cluster;
    return (struct rt_lamp_list){.cluster = cluster,
                                 .items = {clusters->items, clusters->items + head[0]},
                                 .counts = {clusters->prefix_count, head[1]},
                                 .count = clusters->prefix_count + head[1]};
}

const struct rt_lamp_block *rt_lamps_block(const struct rt_lamps *lamps,
                                           struct rt_lamp_blocks *blocks,
                                           const struct rt_lamp_list *list, size_t first)
{
    size_t part = first / RT_BLOCK_LIGHTS;
    if (lamps->all)
        return &lamps->all[part];
    size_t key = (list->cluster << 32 | part) + 1; /* never 0: an empty place */
    struct rt_lamp_block *block = &blocks->kept[(list->cluster + part) % RT_BLOCKS_KEPT];
    if (block->key == key)
        return block;
    block->key = key;
    block->count = 0;
    for (size_t i = first; i < list->count && block->count < RT_BLOCK_LIGHTS; i++)
        put_in_block(lamps,
                     i < list->counts[0] ? list->items[0][i] : list->items[1][i - list->counts[0]],
                     block);
    return block;
}

/* Comparisons leave in what is not a number. */
size_t rt_lamps_look(const struct rt_lamp_block *b, const float point[3], const float normal[3],
                     uint32_t lights[RT_BLOCK_LIGHTS], size_t *reaching)
{
    enum { TOGETHER = 8 };
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
static bool is_outside(const struct rt_lamp *lamp, const float to_light[3], float square)
{
    static const float clearly = 1 + 1e-5f; /* by more than rounding */
    const float *d = lamp->direction, c = lamp->least_cosine;
    float along = -(d[0] * to_light[0] + d[1] * to_light[1] + d[2] * to_light[2]);
    float is = along * fabsf(along), least = c * fabsf(c) * square;
    return is < (least > 0 ? least / clearly : least * clearly);
}

float rt_lamp_arrive(const struct rt_lamps *lamps, uint32_t light, const float point[3], float l[3],
                     float *distance_m)
{
    const struct rt_lamp *lamp = &lamps->lamps[light];
    enum scene_light_type type = lamp->type;
    if (type == SCENE_LIGHT_DIRECTIONAL) {
        for (int k = 0; k < 3; k++)
            l[k] = -lamp->direction[k];
        *distance_m = INFINITY;
        return 1;
    }
    for (int k = 0; k < 3; k++)
        l[k] = lamp->position[k] - point[k];
    float square = l[0] * l[0] + l[1] * l[1] + l[2] * l[2];
    if (square * lamp->inverse_range * lamp->inverse_range >= 1 ||
        (type == SCENE_LIGHT_SPOT && is_outside(lamp, l, square)))
        return 0;
    float distance = sqrtf(square), gain = 1 / rt_max_f32(square, 1e-24f);
    float q = distance * lamp->inverse_range;
    gain *= rt_max_f32(1 - q * q * q * q, 0);
    float inverse = 1 / rt_max_f32(distance, 1e-30f);
    for (int k = 0; k < 3; k++)
        l[k] *= inverse;
    if (type == SCENE_LIGHT_SPOT) {
        const float *d = lamp->direction;
        float cosine = -(d[0] * l[0] + d[1] * l[1] + d[2] * l[2]);
        float cone = rt_min_f32(rt_max_f32(cosine * lamp->cone_scale + lamp->cone_offset, 0), 1);
        gain *= cone * cone;
    }
    *distance_m = distance;
    return gain;
}
