/* SPDX-License-Identifier: MIT */
/* Counts of lights, shadow maps and what is drawn into them. */
#include "renderer/cost/workload.h"

#include <stdlib.h>

#include "protocol/quality_defaults.h"
#include "renderer/base/matrix.h"
#include "renderer/lights/clusters.h"
#include "renderer/scene/atmosphere_grid.h"
#include "renderer/shadows/shadow_casters.h"
#include "renderer/shadows/shadow_frame.h"
#include "renderer/shadows/technique.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

enum {
    /* Whose casters are looked at, at equal steps; the others are taken to be alike. */
    LIGHTS_SAMPLED = 8,
    TRIANGLES_SAMPLED = 256, /* of the transparent casters of one light */
    LIST_TESTS_MAX = 4096,   /* of a light against the cluster of a surface: 0.3 ms */
};
static const double PI = 3.14159265358979323846;

bool workload_shines_on(const struct state_light *light, const struct scene_sample *point)
{
    double to_light[3];
    if (light->type == SCENE_LIGHT_DIRECTIONAL)
        return vec3_dot(light->direction, point->normal) < 0;
    vec3_sub(light->position, point->position, to_light);
    double distance = vec3_length(to_light);
    double along = -vec3_dot(to_light, light->direction);
    if (vec3_dot(to_light, point->normal) <= 0 ||
        (light->range > 0 && distance > (double)light->range))
        return false;
    if (state_light_is_area(light))
        return along > 0;
    return light->type != SCENE_LIGHT_SPOT || along > distance * cos((double)light->outer_cone_rad);
}

static void count_lit(struct workload *workload, const struct workload_desc *desc,
                      const struct scene_sampling *sampling, const struct light_reach *reach)
{
    int area_samples = desc->view->quality.area_samples;
    double points = 0;
    for (int p = 0; p < sampling->point_count; p++)
        points += sampling->points[p].weight;
    for (size_t i = 0; i < desc->state->light_count; i++) {
        const struct state_light *light = &desc->state->lights[i];
        bool is_area = state_light_is_area(light);
        double rays = is_area ? quality_or(area_samples, AREA_SAMPLES_DEFAULT) : 1, lit = 0;
        for (int p = 0; p < sampling->point_count && reach->is_in_view[i]; p++)
            if (workload_shines_on(light, &sampling->points[p]))
                lit += sampling->points[p].weight / points;
        workload->lit += rays * lit;
        workload->lit_areas += is_area ? lit : 0;
        workload->area_rays += is_area ? rays * lit : 0;
    }
}

static double count_directions(const struct view *view)
{
    int samples = view->quality.environment_samples;
    return view_has_environment(view) ? quality_or(samples, ENVIRONMENT_SAMPLES_DEFAULT) : 0;
}

bool workload_shines_into(const struct state_light *light, const double point[3])
{
    double to_light[3];
    if (light->type == SCENE_LIGHT_DIRECTIONAL)
        return true;
    vec3_sub(light->position, point, to_light);
    double distance = vec3_length(to_light), along = -vec3_dot(to_light, light->direction);
    if (state_light_is_area(light))
        return along > 0;
    return !(light->range > 0 && distance > (double)light->range) &&
           (light->type != SCENE_LIGHT_SPOT ||
            along > distance * cos((double)light->outer_cone_rad));
}

/* The grid of the haze before the samples: at three points on the way to each. */
static void measure_haze(struct workload *workload, const struct workload_desc *desc,
                         const struct scene_sampling *sampling)
{
    enum { PLACES = 3 };
    const struct camera *camera = desc->camera;
    const struct camera_window whole =
        camera_window_whole(desc->view->width_px, desc->view->height_px);
    if (!view_has_atmosphere(desc->view) || !desc->state->light_count)
        return;
    const struct atmosphere_grid grid = atmosphere_grid_of(desc->view, &whole);
    const struct atmosphere_slices slices = atmosphere_slices_of(desc->view, desc->state, camera);
    double lit = 0, seen = 0, points = 0;
    for (int p = 0; p < sampling->point_count; p++) {
        const struct scene_sample *sample = &sampling->points[p];
        double view[3], at[3];
        camera_to_view(camera, sample->position, view);
        points += sample->weight;
        seen += sample->weight * (1 + atmosphere_slice(&slices, grid.slices, view[2]));
        for (int place = 1; place <= PLACES; place++) {
            double share = (double)place / (PLACES + 1);
            for (int k = 0; k < 3; k++)
                at[k] = camera->is_orthographic
                            ? sample->position[k] + camera->back[k] * view[2] * (1 - share)
                            : camera->eye[k] + share * (sample->position[k] - camera->eye[k]);
            for (size_t i = 0; i < desc->state->light_count; i++)
                lit += sample->weight / PLACES * workload_shines_into(&desc->state->lights[i], at);
        }
    }
    double reach = points > 0 ? seen / points : grid.slices;
    workload->haze_slices = (double)atmosphere_columns(&grid) *
                            (workload->covered * reach + (1 - workload->covered) * grid.slices);
    workload->haze_lit = points > 0 ? lit / points : (double)desc->state->light_count;
}

/* Half of the depth of a cluster over the depth of its middle, as renderer/lights/clusters.c cuts
 * the depths that lights span. */
static double slice_share(const struct light_bounds *bounds, const struct camera *camera)
{
    double begin = INFINITY, end = 0;
    for (size_t i = 0; i < bounds->count; i++) {
        begin = fmin(begin, bounds->items[i].z_lo);
        end = fmax(end, bounds->items[i].z_hi);
    }
    begin = fmax(fmax(begin, camera->z_near), 1e-4 * end);
    return end > begin ? (pow(end / begin, 1. / CLUSTER_SLICES) - 1) / 2 : 0;
}

/* The middle of the image's tile that shows the point, widened to hold the tile. */
static struct view_ray tile_around(const struct workload_desc *desc, const double point[3],
                                   double *depth)
{
    const struct camera *camera = desc->camera;
    double offset[3], half_tile = CLUSTER_TILE_PX * sqrt(0.5);
    vec3_sub(point, camera->eye, offset);
    double x = vec3_dot(offset, camera->right), y = vec3_dot(offset, camera->up);
    double spread = half_tile * 2 * camera->half_height / desc->view->height_px;
    *depth = -vec3_dot(offset, camera->back);
    if (camera->is_orthographic)
        return (struct view_ray){.origin = {x, y}, .spread_m = spread};
    double per_m = 1 / fmax(*depth, 1e-9);
    return (struct view_ray){.slope = {x * per_m, y * per_m}, .spread_per_m = spread};
}

/* Lights in the lists of visible surfaces. */
static double count_listed(const struct workload_desc *desc, const struct scene_sampling *sampling,
                           const struct light_reach *reach)
{
    const struct light_bounds *bounds = &reach->bounds;
    double share = slice_share(bounds, desc->camera), listed = 0, points = 0;
    size_t step = bounds->count * (size_t)sampling->point_count / LIST_TESTS_MAX + 1;
    for (int p = 0; p < sampling->point_count; p++)
        points += sampling->points[p].weight;
    for (int p = 0; p < sampling->point_count; p++) {
        const struct scene_sample *point = &sampling->points[p];
        double depth, front, back;
        const struct view_ray ray = tile_around(desc, point->position, &depth);
        for (size_t i = (size_t)p % step; i < bounds->count; i += step)
            if (reach->is_in_view[bounds->items[i].light] &&
                light_bound_interval(&bounds->items[i], &ray, &front, &back) &&
                depth * (1 + share) >= front && depth * (1 - share) <= back)
                listed += (double)step * point->weight / points;
    }
    return listed + (double)bounds->global_count;
}

/* ---- shadow maps ---- */

static double triangles_of(const struct scene_state *state, const struct state_item *item)
{
    uint32_t count = state->scene->primitives[item->primitive].index_count / 3;
    return count;
}

/* Share of one face's texels that a triangle covers: its solid angle as a flat patch, or its shadow
 * on the plane of parallel rays. */
static double share_of_face(const struct shadow_frame *frame, double corners[3][3])
{
    double edges[2][3], normal[3], middle[3], to_light[3];
    vec3_sub(corners[1], corners[0], edges[0]);
    vec3_sub(corners[2], corners[0], edges[1]);
    vec3_cross(edges[0], edges[1], normal); /* twice the area */
    if (frame->shape == SHADOW_ORTHOGRAPHIC)
        return 0.5 * fabs(vec3_dot(normal, frame->axis[2])) * frame->scale[0] * frame->scale[1] / 4;
    for (int k = 0; k < 3; k++)
        middle[k] = (corners[0][k] + corners[1][k] + corners[2][k]) / 3;
    vec3_sub(middle, frame->origin, to_light);
    double distance = vec3_length(to_light);
    bool is_out = frame->range_m > 0 && distance > frame->range_m;
    if (!(distance > 0) || is_out ||
        vec3_dot(to_light, frame->cone) < distance * cos(frame->cone_rad))
        return 0;
    double angle = 0.5 * fabs(vec3_dot(normal, to_light)) / (distance * distance * distance);
    double face =
        frame->shape == SHADOW_CUBE ? 4 * PI / 6 : 4 / (frame->scale[0] * frame->scale[1]);
    return fmin(angle, 2 * PI) / face;
}

/* As the maps are divided when they are built. What is refused then has no layers here. */
static bool count_layers(const struct workload_desc *desc, const struct shadow_frame *frame,
                         uint32_t light, struct workload_map_load *load, struct error *err)
{
    const struct shadow_method *method = shadow_method_of(desc->view->quality.shadows);
    struct shadow_map map = {.frame = *frame,
                             .method = method,
                             .resolution = SHADOW_RESOLUTION_DEFAULT,
                             .is_faithful = desc->view->quality.faithful};
    struct shadow_build build = {.map = &map, .light = light};
    struct error refused = {0};
    if (!method || !method->structure->divide)
        return true;
    bool ok = shadow_casters_collect(&build.casters, frame, desc->state, err);
    if (ok && method->structure->divide(&build, desc->state, &refused))
        load->layers = map.layers;
    free(build.partitions);
    shadow_casters_finish(&build.casters);
    return ok;
}

static void add_events(const struct workload_desc *desc, const struct shadow_frame *frame,
                       const struct state_item *item, double budget, struct workload_map_load *load)
{
    const struct state_geometry geometry = state_geometry_of(desc->state, item);
    double triangles = triangles_of(desc->state, item), corners[3][3];
    double step = fmax(1, floor(triangles / fmax(budget, 1))), sum = 0, taken = 0;
    for (uint32_t t = 0; t < (uint32_t)triangles; t += (uint32_t)step) {
        for (uint32_t i = 0; i < 3; i++)
            state_geometry_corner(&geometry, 3 * (size_t)t + i, corners[i]);
        sum += share_of_face(frame, corners);
        taken++;
    }
    load->events += sum * triangles / fmax(taken, 1);
}

static bool load_map(const struct workload_desc *desc, size_t index, struct workload_map_load *load,
                     struct error *err)
{
    const struct state_light *light = &desc->state->lights[index];
    struct shadow_frame frame;
    double transparent = 0;
    *load = (struct workload_map_load){0};
    if (!light->casts_shadow ||
        !shadow_frame_init(&frame, light, desc->state, SHADOW_RESOLUTION_DEFAULT))
        return true;
    for (size_t i = 0; i < desc->state->whole_count; i++) {
        const struct state_item *item = &desc->state->items[i];
        uint32_t faces = item->casts_shadow ? shadow_frame_faces(&frame, item) : 0;
        double drawn = triangles_of(desc->state, item);
        if (faces && item->class_ == STATE_TRANSPARENT)
            transparent += drawn;
        *(item->class_ == STATE_TRANSPARENT ? &load->transparent : &load->opaque) +=
            drawn * __builtin_popcount(faces);
    }
    for (size_t i = 0; i < desc->state->whole_count && transparent > 0; i++) {
        const struct state_item *item = &desc->state->items[i];
        if (item->class_ == STATE_TRANSPARENT && item->casts_shadow &&
            shadow_frame_faces(&frame, item))
            add_events(desc, &frame, item,
                       TRIANGLES_SAMPLED * triangles_of(desc->state, item) / transparent, load);
    }
    load->faces = frame.face_count;
    return !(load->transparent > 0) || count_layers(desc, &frame, (uint32_t)index, load, err);
}

/* As load_map, once for all views of the state. */
static bool find_load(const struct workload_desc *desc, size_t index,
                      struct workload_map_load *load, struct error *err)
{
    struct workload_map_load *known = desc->kept ? desc->kept->loads : NULL;
    if (known && known[index].is_known) {
        *load = known[index];
        return true;
    }
    if (!load_map(desc, index, load, err))
        return false;
    load->is_known = true;
    if (known)
        known[index] = *load;
    return true;
}

static bool measure_maps(struct workload *workload, const struct workload_desc *desc,
                         const struct light_reach *reach, struct error *err)
{
    double events = 0, layers = 0;
    size_t step = workload->lights / LIGHTS_SAMPLED + 1, visible = 0, taken = 0;
    double shadowed = 0, deep = 0;
    for (size_t i = 0; i < desc->state->light_count; i++) {
        struct workload_map_load load;
        if (!reach->is_in_view[i] || visible++ % step != 0)
            continue;
        taken++;
        if (!find_load(desc, i, &load, err))
            return false;
        if (!(load.opaque + load.transparent > 0))
            continue;
        shadowed++;
        deep += load.transparent > 0;
        workload->map_faces += load.faces;
        workload->deep_faces += load.transparent > 0 ? load.faces : 0;
        workload->map_triangles += load.opaque;
        workload->deep_triangles += load.transparent;
        events += load.events;
        layers += load.faces * load.layers;
    }
    double scale = taken ? (double)workload->lights / (double)taken : 0;
    workload->deep_share = workload->deep_faces > 0 ? events / workload->deep_faces : 0;
    workload->deep_layers = workload->deep_faces > 0 ? layers / workload->deep_faces : 0;
    workload->shadowed_lights = (size_t)round(shadowed * scale);
    workload->deep_lights = (size_t)round(deep * scale);
    workload->map_faces *= scale;
    workload->deep_faces *= scale;
    workload->map_triangles *= scale;
    workload->deep_triangles *= scale;
    return true;
}

/* ---- what no camera changes ---- */

static void forget_state(struct workload_kept *kept)
{
    free(kept->loads);
    free(kept->edges);
    *kept = (struct workload_kept){.picks = kept->picks};
}

void workload_kept_finish(struct workload_kept *kept)
{
    forget_state(kept);
    edge_picks_finish(&kept->picks);
}

/* Forgets what belongs to another state or other maps. Without memory nothing is kept. */
static void keep_for(struct workload_kept *kept, const struct workload_desc *desc)
{
    const struct view_quality *quality = &desc->view->quality;
    struct content_key key = desc->state_key;
    content_key_add_word(&key, (uint64_t)quality->shadows << 1 | quality->faithful);
    content_key_add_word(&key, quality->may_be_coarse);
    if (content_key_equals(kept->key, key))
        return;
    forget_state(kept);
    kept->key = key;
    kept->loads = calloc(desc->state->light_count + 1, sizeof *kept->loads);
}

bool workload_measure(struct workload *workload, const struct workload_desc *desc,
                      struct error *err)
{
    struct scene_sampling sampling;
    struct light_reach own = {0}, *reach = desc->reach ? desc->reach : &own;
    *workload = (struct workload){.pixels = (double)desc->view->width_px * desc->view->height_px};
    if (desc->kept)
        keep_for(desc->kept, desc);
    bool ok = scene_sampling_run(&sampling, desc, err) &&
              light_reach_collect(reach, desc->state, desc->camera, err);
    if (ok) {
        workload->covered = sampling.covered;
        workload->layers = sampling.layers;
        workload->peeled_sides = sampling.peeled_sides;
        workload->peels = sampling.peels;
        workload->peeled_pixels = sampling.peeled_pixels;
        workload->peeled_triangles = sampling.peeled_triangles;
        workload->textures = sampling.textures;
        workload->triangles = sampling.triangles;
        workload->triangles_in_view = sampling.triangles_in_view;
        workload->lights = desc->state->light_count - reach->unseen_count;
        count_lit(workload, desc, &sampling, reach);
        workload->directions = count_directions(desc->view);
        workload->listed = count_listed(desc, &sampling, reach);
        ok = measure_maps(workload, desc, reach, err) &&
             workload_measure_volumes(workload, desc, &sampling, reach, err);
        measure_haze(workload, desc, &sampling);
        workload_measure_grids(workload, desc, &sampling);
    }
    light_reach_finish(&own);
    return ok;
}
