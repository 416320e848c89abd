/* SPDX-License-Identifier: MIT */
/* Lighting surfaces of one mesh side by side, with what they have alike evaluated once. */
#include "renderer/raytrace/rt_whole_light.h"

#include <assert.h>
#include <string.h>

#include "renderer/raytrace/rt_batch_light.h"
#include "renderer/raytrace/rt_job.h"
#include "renderer/raytrace/rt_path.h"
#include "renderer/raytrace/rt_wide_lists.h"

enum { RAYS_UNASKED = 16384 }; /* shadow rays between two questions whether to go on */

static void evaluate(struct rt_batch *batch, struct rt_whole_alike *alike, uint32_t triangle)
{
    const struct rt_fragment fragment = {
        .hit = {.mesh = alike->mesh, .triangle = triangle, .u = 0.25, .v = 0.25, .is_front = true},
        .is_opaque = batch->desc.scene->meshes[alike->mesh].class_ == STATE_OPAQUE};
    const struct rt_lit lit = {.fragment = &fragment,
                               .view = {0, 1, 0},
                               .surface = &alike->surface,
                               .reflector = &alike->reflector};
    alike->shading = (struct rt_shading){.alpha = 1};
    bool is_lit = rt_lit_evaluate(batch, &lit, &alike->shading);
    assert(is_lit);
}

struct rt_whole_alike *rt_whole_evaluate(struct rt_batch *batch, uint32_t mesh, uint32_t triangle)
{
    const uint32_t slot = mesh % RT_WHOLE_GROUPS;
    struct rt_whole_alike *alike = &batch->wholes->alikes[slot];
    if (alike->mesh == mesh)
        return alike;
    if (batch->wholes->groups[slot].count) /* of the mesh before */
        rt_whole_light_group(batch, &batch->wholes->groups[slot]);
    alike->mesh = mesh;
    evaluate(batch, alike, triangle);
    return alike;
}

struct rt_whole_group *rt_whole_open(struct rt_batch *batch, uint32_t mesh, uint32_t triangle)
{
    struct rt_whole_group *group = &batch->wholes->groups[mesh % RT_WHOLE_GROUPS];
    if (group->count == RT_WIDE)
        rt_whole_light_group(batch, group);
    rt_whole_evaluate(batch, mesh, triangle);
    return group;
}

static bool is_any_sought(const struct rt_whole_group *group)
{
    uint32_t any = 0;
    for (int i = 0; i < group->count; i++)
        any |= group->sought[i];
    return any;
}

static void place(const struct rt_batch *batch, struct rt_whole_group *group)
{
    const struct rt_scene *scene = batch->desc.scene;
    const struct rt_mesh *mesh = &scene->meshes[group->alike->mesh];
    const struct camera *camera = batch->desc.camera;
    double eye[3];
    vec3_sub(camera->eye, scene->origin, eye);
    if (is_any_sought(group))
        rt_wide_find(eye, mesh->is_mirrored, batch->desc.samples, group->ways, group->sought,
                     &group->wide);
    struct rt_wide_mesh alike = {.is_mirrored = mesh->is_mirrored,
                                 .nudge_m = scene->nudge_m,
                                 .is_smoothed = mesh->class_ == STATE_OPAQUE &&
                                                !rt_wide_is_flat(&group->wide, group->count)};
    memcpy(alike.normal_matrix, mesh->normal_matrix, sizeof alike.normal_matrix);
    memcpy(alike.origin, scene->origin, sizeof alike.origin);
    memcpy(alike.eye, camera->eye, sizeof alike.eye);
    memcpy(alike.back, camera->back, sizeof alike.back);
    rt_wide_place(&alike, &group->wide);
    rt_wide_look(&group->alike->reflector, &group->wide);
}

/* What they emit, and reflect of the hemisphere. */
static void begin_light(const struct rt_batch *batch, struct rt_whole_group *group, uint32_t lanes,
                        double radiance[3][RT_WIDE])
{
    const struct scene_state *state = batch->desc.scene->state;
    const struct rt_wide *wide = &group->wide;
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < RT_WIDE; i++)
            radiance[k][i] = group->alike->shading.radiance[k];
    for (; state->has_environment && lanes; lanes &= lanes - 1) {
        const int i = __builtin_ctz(lanes);
        struct rt_reflector *reflector = &group->alike->reflector;
        double sum[3];
        for (int k = 0; k < 3; k++) {
            reflector->view[k] = wide->view[k][i];
            group->alike->surface.normal[k] = reflector->normal[k] = wide->normal[k][i];
            sum[k] = radiance[k][i];
        }
        reflector->n_dot_v = wide->n_dot_v[i];
        reflector->seen = wide->seen[i];
        rt_reflect_hemisphere(state, reflector, &group->alike->surface, sum);
        for (int k = 0; k < 3; k++)
            radiance[k][i] = sum[k];
    }
}

/* From which the shadow rays of a group are made one by one, where they meet filters. */
struct maker {
    const struct rt_batch *batch;
    const struct rt_whole_group *group;
};

static void make_ray(const void *from, int lane, struct rt_ray *ray)
{
    const struct maker *maker = from;
    const struct rt_wholes *wholes = maker->batch->wholes;
    const struct rt_scene *scene = maker->batch->desc.scene;
    const struct rt_hit on = {.mesh = maker->group->alike->mesh};
    *ray = (struct rt_ray){.t_min = wholes->rays.t_min[lane],
                           .t_max = wholes->rays.t_max[lane],
                           .skip_mesh = on.mesh,
                           .skip_triangle = maker->group->triangles[lane],
                           .excluded_node = rt_path_excluded_node(scene, &on)};
    for (int k = 0; k < 3; k++) {
        ray->origin[k] = wholes->rays.origin[k][lane];
        ray->direction[k] = wholes->rays.direction[k][lane];
    }
}

/* Traces the shadow rays of the light. Returns the lanes that it reaches; passes: what filters let
 * through. */
static uint32_t pass_shadows(struct rt_batch *batch, const struct rt_whole_group *group,
                             uint32_t lanes)
{
    struct rt_wholes *wholes = batch->wholes;
    const struct rt_scene *scene = batch->desc.scene;
    const struct maker maker = {batch, group};
    const struct rt_wide_way way = {
        .epsilon = scene->epsilon, .size_m = scene->size_m, .nudge_m = scene->nudge_m};
    struct rt_packet *packet = &batch->packet;
    rt_wide_leave(&way, &group->wide, &wholes->light, &wholes->rays);
    packet->count = group->count;
    packet->make = make_ray;
    packet->from = &maker;
    batch->shadow_rays += (uint64_t)__builtin_popcount(lanes);
    lanes =
        rt_packet_pass(packet, &wholes->rays, lanes,
                       scene->meshes[group->alike->mesh].no_self_shadow ? NULL : wholes->passes);
    for (uint32_t left = lanes & packet->used; left; left &= left - 1) {
        const int i = __builtin_ctz(left);
        double passed[3] = {1, 1, 1}, no_media[3] = {0};
        batch->has_overflowed |= packet->hits[i].has_overflowed;
        if (!packet->hits[i].count)
            continue;
        rt_path_transmittance(scene, &packet->hits[i], rt_packet_ray(packet, i), no_media,
                              batch->desc.view->quality.blend_filter, passed);
        for (int k = 0; k < 3; k++)
            wholes->passes[k][i] = passed[k];
    }
    return lanes;
}

static void ask_light(struct rt_batch *batch, struct rt_whole_group *group, uint32_t light,
                      uint32_t lanes)
{
    struct rt_wholes *wholes = batch->wholes;
    const struct rt_light_record *record = &batch->desc.light_set->records[light];
    uint32_t reaches[RT_WIDE];
    rt_wide_arrive(record, &group->wide, &wholes->light);
    lanes &= rt_wide_lanes(wholes->light.arrives);
    if (!lanes)
        return;
    batch->lights_reaching += (uint64_t)__builtin_popcount(lanes);
    rt_wide_reflect(&group->alike->reflector, record, &group->wide, &wholes->light);
    lanes &= rt_wide_lanes(wholes->light.reflects);
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < RT_WIDE; i++)
            wholes->passes[k][i] = 1;
    if (lanes && record->casts_shadow && batch->desc.view->quality.shadows != SHADOWS_NONE)
        lanes = pass_shadows(batch, group, lanes);
    for (int i = 0; i < RT_WIDE; i++)
        reaches[i] = lanes >> i & 1;
    rt_wide_add(&wholes->light, reaches, wholes->passes, wholes->radiance);
}

/* Lights without shadows first, as they are added to fragments. */
static void ask_list(struct rt_batch *batch, struct rt_whole_group *group,
                     const struct rt_light_list *list, uint32_t lanes)
{
    const struct rt_light_record *records = batch->desc.light_set->records;
    batch->lights_listed += list->count * (uint64_t)__builtin_popcount(lanes);
    for (int casts = 0; casts < 2; casts++)
        for (size_t i = 0; i < list->count; i++) {
            uint32_t light = rt_light_list_at(list, i);
            if (records[light].casts_shadow == casts)
                ask_light(batch, group, light, lanes);
        }
}

void rt_whole_light(struct rt_batch *batch, struct rt_whole_group *group, uint32_t lanes)
{
    struct rt_wholes *wholes = batch->wholes;
    struct rt_wide_places places = {.count = group->count, .view_z = group->wide.view_z};
    struct rt_light_list lists[RT_WIDE];
    uint32_t of_list[RT_WIDE];
    place(batch, group);
    begin_light(batch, group, lanes, wholes->radiance);
    memcpy(places.x, group->x, sizeof places.x);
    memcpy(places.y, group->y, sizeof places.y);
    batch->surfaces += (uint64_t)__builtin_popcount(lanes);
    int count = rt_wide_lists(batch->desc.light_set, &places, lists, of_list);
    for (int i = 0; i < count; i++)
        if (of_list[i] & lanes)
            ask_list(batch, group, &lists[i], of_list[i] & lanes);
    if (batch->shadow_rays - wholes->asked_at > RAYS_UNASKED) {
        wholes->asked_at = batch->shadow_rays;
        batch->is_cancelled |= rt_job_is_cancelled(batch->desc.job);
    }
}

void rt_whole_light_group(struct rt_batch *batch, struct rt_whole_group *group)
{
    const struct rt_wholes *wholes = batch->wholes;
    rt_whole_light(batch, group, (1u << group->count) - 1);
    for (int i = 0; i < group->count; i++)
        for (int k = 0; k < 3; k++)
            group->radiance[i][k] = wholes->radiance[k][i];
    group->count = 0;
}
