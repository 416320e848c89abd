/* SPDX-License-Identifier: MIT */
/* Counts what the sides of shadow volumes cover of a picture, without the edges of the casters:
 * where one triangle of a file faces a light and the next does not, an edge of the silhouette lies
 * between them, or one like it. From there its side goes away from the light, over the picture,
 * until what is seen lies before it. */
#include <stdlib.h>

#include "protocol/quality_defaults.h"
#include "renderer/base/matrix.h"
#include "renderer/cost/workload.h"
#include "renderer/shadows/shadow_frame.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/bindings.h"

enum {
    PAIRS_MAX = 8192,       /* of neighbours that are looked at: half a millisecond */
    PAIRS_OF_MOTION = 1024, /* in a view in motion */
    LIGHTS_SAMPLED = 4,     /* at equal steps; the others are taken to be alike */
    WAYS_MAX = 256,         /* that are followed for each light, ... */
    STEPS_MAX = 128,        /* ... a tile's width at a time, ... */
    BEHIND_MAX = 16,        /* ... until so many lie behind what is seen */
};

static const double GOLDEN = 0.6180339887498949; /* steps of it lie evenly, however many */

struct counter {
    const struct workload_desc *desc;
    const struct scene_sampling *sampling;
    struct workload_pair *pairs;
    size_t count;
};

/* ---- neighbours ---- */

static double normal_of(double corners[3][3], double normal[3])
{
    double edges[3][3], square = 0;
    for (int i = 0; i < 3; i++) {
        vec3_sub(corners[(i + 1) % 3], corners[i], edges[i]);
        square += vec3_dot(edges[i], edges[i]) / 3;
    }
    vec3_cross(edges[0], edges[1], normal);
    return sqrt(square);
}

static void take_pair(struct counter *counter, size_t item, uint32_t triangle, double weight)
{
    const struct scene_state *state = counter->desc->state;
    const struct state_geometry geometry = state_geometry_of(state, &state->items[item]);
    struct workload_pair *pair = &counter->pairs[counter->count++];
    double corners[3][3];
    *pair = (struct workload_pair){.weight = weight, .item = item};
    for (uint32_t t = 0; t < 2; t++) {
        for (uint32_t i = 0; i < 3; i++)
            state_geometry_corner(&geometry, 3 * ((size_t)triangle + t) + i, corners[i]);
        pair->edge_m += 0.5 * normal_of(corners, pair->normals[t]);
        for (int k = 0; k < 9; k++)
            pair->at[k % 3] += corners[k / 3][k % 3] / 6;
    }
}

static uint32_t pairs_of(const struct scene_state *state, const struct state_item *item)
{
    const struct scene_primitive *p = &state->scene->primitives[item->primitive];
    bool has_any = item->casts_shadow && p->topology == SCENE_TRIANGLES && p->index_count > 3;
    return has_any ? p->index_count / 3 - 1 : 0;
}

static size_t most_pairs(const struct workload_desc *desc)
{
    return desc->view->quality.may_be_coarse ? PAIRS_OF_MOTION : PAIRS_MAX;
}

static void sample_pairs(struct counter *counter)
{
    const struct scene_state *state = counter->desc->state;
    const size_t most = most_pairs(counter->desc);
    double all = 0, passed = 0;
    for (size_t i = 0; i < state->whole_count; i++)
        all += pairs_of(state, &state->items[i]);
    double step = fmax(1, all / (double)most);
    for (size_t i = 0; i < state->whole_count; i++) {
        uint32_t pairs = pairs_of(state, &state->items[i]);
        double wanted = floor((passed + pairs) / step) - floor(passed / step), place = 0;
        passed += pairs;
        for (double k = 0; k < wanted && counter->count < most; k++) {
            place = step > 1 ? fmod(place + GOLDEN, 1) : k / pairs;
            take_pair(counter, i, (uint32_t)(place * pairs), step);
        }
    }
}

/* Those that are kept, or new ones. */
static bool find_pairs(struct counter *counter, struct error *err)
{
    const struct workload_kept *kept = counter->desc->kept;
    if (kept && kept->pairs) {
        counter->pairs = kept->pairs;
        counter->count = kept->pair_count;
        return true;
    }
    counter->pairs = malloc(most_pairs(counter->desc) * sizeof *counter->pairs);
    if (!counter->pairs)
        return error_set(err, ERROR_NO_MEMORY, "sampling of shadow volumes");
    sample_pairs(counter);
    return true;
}

/* Keeps those of a view in motion, which are a hundred kilobytes; others are eight times as many,
 * and pictures at rest take longer to draw. */
static void give_pairs(struct counter *counter)
{
    struct workload_kept *kept = counter->desc->kept;
    if (!counter->pairs)
        return;
    if (kept && counter->desc->view->quality.may_be_coarse) {
        kept->pairs = counter->pairs;
        kept->pair_count = counter->count;
    } else {
        free(counter->pairs);
    }
}

/* ---- ways over the picture ---- */

/* In view space; the last coordinate is the depth. */
struct way {
    double from[3], step[3]; /* away from the light, as far as the scene may be seen */
    double begin, end;       /* what lies in view */
    double widening;         /* of a side at the end of the step, over that at `from` */
};

/* Cuts the way off where it leaves the frustum. */
static bool clip(struct way *way, const struct camera *camera)
{
    for (int plane = 0; plane < 5; plane++) {
        double ends[2];
        for (int i = 0; i < 2; i++) {
            double p[3], reach;
            for (int k = 0; k < 3; k++)
                p[k] = way->from[k] + i * way->step[k];
            reach = camera->is_orthographic ? 1 : p[2];
            ends[i] = plane == 0   ? p[2] - (camera->is_orthographic ? 0 : camera->z_near)
                      : plane == 1 ? camera->half_width * reach - p[0]
                      : plane == 2 ? camera->half_width * reach + p[0]
                      : plane == 3 ? camera->half_height * reach - p[1]
                                   : camera->half_height * reach + p[1];
        }
        double cut = ends[0] / (ends[0] - ends[1]);
        if (ends[0] < 0 && ends[1] < 0)
            return false;
        if (ends[0] < 0)
            way->begin = fmax(way->begin, cut);
        else if (ends[1] < 0)
            way->end = fmin(way->end, cut);
    }
    return way->begin < way->end;
}

static void place_at(const struct way *way, const struct camera *camera, double s, double at[3])
{
    for (int k = 0; k < 3; k++)
        at[k] = way->from[k] + s * way->step[k];
    double reach = camera->is_orthographic ? 1 : at[2];
    at[0] = (at[0] / (camera->half_width * reach) + 1) * 0.5 * SCENE_COLUMNS;
    at[1] = (at[1] / (camera->half_height * reach) + 1) * 0.5 * SCENE_ROWS;
}

/* One over the depth of what is opaque, between the middles of cells: linear over a plane. */
static double nearness_at(const struct counter *counter, const double at[2])
{
    const float *ends = counter->sampling->ends;
    double x = fmin(fmax(at[0] - 0.5, 0), SCENE_COLUMNS - 1.001);
    double y = fmin(fmax(at[1] - 0.5, 0), SCENE_ROWS - 1.001);
    int column = (int)x, row = (int)y;
    double found = 0;
    for (int i = 0; i < 4; i++) {
        int right = i & 1, up = i >> 1;
        double share = (right ? x - column : 1 - x + column) * (up ? y - row : 1 - y + row);
        found += share / (double)ends[(row + up) * SCENE_COLUMNS + column + right];
    }
    return found;
}

/* Whether something that the light may reach is seen behind the place, which is in cells. */
static bool is_before(const struct counter *counter, const struct state_light *light,
                      const double at[3])
{
    const struct camera *camera = counter->desc->camera;
    double nearness = nearness_at(counter, at), point[3];
    if (!(nearness > 0) || at[2] * nearness > 1)
        return false;
    double depth = 1 / nearness, reach = camera->is_orthographic ? 1 : depth;
    double x = (2 * at[0] / SCENE_COLUMNS - 1) * camera->half_width * reach;
    double y = (2 * at[1] / SCENE_ROWS - 1) * camera->half_height * reach;
    for (int k = 0; k < 3; k++)
        point[k] =
            camera->eye[k] + x * camera->right[k] + y * camera->up[k] - depth * camera->back[k];
    return workload_shines_into(light, point);
}

/* Pixels of the tiles that a side covers. */
static double follow(const struct counter *counter, const struct state_light *light,
                     const struct way *way, double edge_m)
{
    const struct workload_desc *desc = counter->desc;
    const double tile_px = VOLUME_TILE_PX, px = desc->view->height_px;
    double first[3], last[3], pixels = 0;
    place_at(way, desc->camera, way->begin, first);
    place_at(way, desc->camera, way->end, last);
    double long_px = hypot((last[0] - first[0]) * desc->view->width_px / SCENE_COLUMNS,
                           (last[1] - first[1]) * px / SCENE_ROWS);
    int steps = (int)fmin(fmax(ceil(long_px / tile_px), 1), STEPS_MAX);
    for (int i = 0, behind = 0; i < steps && behind < BEHIND_MAX; i++) {
        double at[3], share = (i + 0.5) / steps, reach, s;
        for (int k = 0; k < 2; k++)
            at[k] = first[k] + share * (last[k] - first[k]);
        at[2] = desc->camera->is_orthographic
                    ? first[2] + share * (last[2] - first[2])
                    : 1 / (1 / first[2] + share * (1 / last[2] - 1 / first[2]));
        behind = is_before(counter, light, at) ? 0 : behind + 1;
        if (behind)
            continue;
        reach = desc->camera->is_orthographic ? 1 : at[2];
        s = last[2] != first[2] ? (at[2] - first[2]) / (last[2] - first[2]) : share;
        s = way->begin + s * (way->end - way->begin);
        double wide_px =
            edge_m * (1 + s * (way->widening - 1)) * px / (2 * desc->camera->half_height * reach);
        pixels += long_px / steps * (fmin(wide_px, desc->view->width_px) + tile_px);
    }
    return pixels;
}

static double follow_from(const struct counter *counter, const struct state_light *light,
                          const struct workload_pair *pair, double length_m)
{
    const struct camera *camera = counter->desc->camera;
    struct way way = {.end = 1, .widening = 1};
    double away[3], to[3], end[3], distance;
    if (light->type == SCENE_LIGHT_DIRECTIONAL)
        memcpy(away, light->direction, sizeof away);
    else
        vec3_sub(pair->at, light->position, away);
    distance = vec3_length(away);
    if (!vec3_normalize(away))
        return 0;
    if (light->type != SCENE_LIGHT_DIRECTIONAL)
        way.widening = 1 + length_m / distance;
    for (int k = 0; k < 3; k++)
        end[k] = pair->at[k] + length_m * away[k];
    camera_to_view(camera, pair->at, way.from);
    camera_to_view(camera, end, to);
    vec3_sub(to, way.from, way.step);
    return clip(&way, camera) ? follow(counter, light, &way, pair->edge_m) : 0;
}

/* Whether the neighbours face the light alike. */
static bool is_inner(const struct state_light *light, const struct workload_pair *pair)
{
    double to_light[3] = {-light->direction[0], -light->direction[1], -light->direction[2]};
    if (light->type != SCENE_LIGHT_DIRECTIONAL)
        vec3_sub(light->position, pair->at, to_light);
    return (vec3_dot(to_light, pair->normals[0]) > 0) == (vec3_dot(to_light, pair->normals[1]) > 0);
}

static double count_light(const struct counter *counter, const struct state_light *light)
{
    const struct scene_state *state = counter->desc->state;
    double size[3], pixels = 0, outer = 0, followed = 0;
    vec3_sub(state->bounds_max, state->bounds_min, size);
    double length_m = vec3_length(size);
    size_t found = 0, step;
    struct shadow_frame frame;
    if (!shadow_frame_init(&frame, light, state, SHADOW_RESOLUTION_DEFAULT))
        return 0;
    for (size_t i = 0; i < counter->count; i++)
        found += !is_inner(light, &counter->pairs[i]);
    step = found / WAYS_MAX + 1;
    found = 0;
    for (size_t i = 0; i < counter->count; i++) {
        const struct workload_pair *pair = &counter->pairs[i];
        if (is_inner(light, pair))
            continue;
        outer += pair->weight;
        if (found++ % step)
            continue;
        followed += pair->weight;
        if (shadow_frame_faces(&frame, &state->items[pair->item]))
            pixels += pair->weight * follow_from(counter, light, pair, length_m);
    }
    return followed > 0 ? pixels * outer / followed : 0;
}

bool workload_measure_volumes(struct workload *workload, const struct workload_desc *desc,
                              const struct scene_sampling *sampling,
                              const struct light_reach *reach, struct error *err)
{
    struct counter counter = {.desc = desc, .sampling = sampling};
    size_t step = workload->lights / LIGHTS_SAMPLED + 1, visible = 0, taken = 0;
    if (workload->shadowed_lights && !find_pairs(&counter, err))
        return false;
    for (size_t i = 0; i < desc->state->light_count && counter.count; i++) {
        const struct state_light *light = &desc->state->lights[i];
        if (!reach->is_in_view[i] || visible++ % step != 0)
            continue;
        taken++;
        if (light->casts_shadow && !state_light_is_area(light))
            workload->side_pixels += count_light(&counter, light);
    }
    workload->side_pixels *= taken ? (double)workload->lights / (double)taken : 0;
    give_pairs(&counter);
    return true;
}
