/* SPDX-License-Identifier: MIT */
/* Surfaces of a batch side by side. What those of a plain mesh have alike is evaluated once, by the
 * scalar form, at the first of them; materials of other meshes are evaluated lane by lane. */
#include "renderer/raytrace/rt_batch_wide.h"

#include <assert.h>
#include <string.h>

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_batch_light.h"
#include "renderer/raytrace/rt_path.h"
#include "renderer/raytrace/rt_wide.h"
#include "renderer/raytrace/rt_wide_lists.h"

enum {
    GROUPS = 32, /* meshes that gather surfaces at a time */
    LEAST = 4,   /* surfaces that are worth sixteen lanes */
};

struct group { /* surfaces of one mesh, waiting */
    uint32_t mesh;
    bool is_opaque;
    int count;
    uint32_t fragments[RT_WIDE];
};

struct wide_lit { /* a group being lit */
    struct rt_batch *batch;
    const struct group *group;
    struct rt_wide wide;
    struct rt_wide_light light;
    bool are_alike;            /* surfaces of a plain mesh */
    struct rt_surface surface; /* as lit has it; where they differ, of the one evaluated last */
    struct rt_reflector reflectors[RT_WIDE]; /* of each lane; the first is that of all, where they
                                                are alike */
    struct rt_lit lit;
};

/* Returns whether its vertices have one normal. */
static bool gather_lane(const struct rt_mesh *mesh, const struct rt_fragment *fragment,
                        struct rt_wide *wide, int i)
{
    const uint32_t *triangle = mesh->triangles + 3 * (size_t)fragment->hit.triangle;
    double room[3][3];
    const double *corners[3];
    bool is_flat = true;
    rt_mesh_corners(mesh, fragment->hit.triangle, room, corners);
    for (int c = 0; c < 3; c++) {
        const float *normal = mesh->normals + 3 * (size_t)triangle[c];
        for (int k = 0; k < 3; k++) {
            wide->corners[c][k][i] = corners[c][k];
            wide->normals[c][k][i] = normal[k];
            is_flat &= normal[k] == wide->normals[0][k][i];
        }
    }
    for (int k = 0; k < 3; k++) {
        wide->point[k][i] = fragment->sum.point[k];
        wide->direction[k][i] = fragment->sum.direction[k];
    }
    wide->u[i] = fragment->sum.u;
    wide->v[i] = fragment->sum.v;
    wide->count[i] = fragment->sum.count;
    wide->side[i] = fragment->hit.is_front ? 1 : -1;
    return is_flat;
}

/* Lanes beyond the group's keep what they had, and no one looks at what comes of it. */
static void place(struct wide_lit *w, const struct rt_mesh *mesh)
{
    const struct rt_scene *scene = w->batch->desc.scene;
    const struct camera *camera = w->batch->desc.camera;
    struct rt_wide_mesh alike = {.is_mirrored = mesh->is_mirrored, .nudge_m = scene->nudge_m};
    bool are_flat = true;
    memcpy(alike.normal_matrix, mesh->normal_matrix, sizeof alike.normal_matrix);
    memcpy(alike.origin, scene->origin, sizeof alike.origin);
    memcpy(alike.eye, camera->eye, sizeof alike.eye);
    memcpy(alike.back, camera->back, sizeof alike.back);
    for (int i = 0; i < w->group->count; i++)
        are_flat &= gather_lane(mesh, &w->batch->fragments[w->group->fragments[i]], &w->wide, i);
    alike.is_smoothed = w->group->is_opaque && !are_flat;
    rt_wide_place(&alike, &w->wide);
}

/* Makes the first reflector, which is that of all, a lane's. */
static void turn_to(struct wide_lit *w, int lane)
{
    const struct rt_wide *wide = &w->wide;
    struct rt_reflector *reflector = &w->reflectors[0];
    for (int k = 0; k < 3; k++) {
        reflector->view[k] = wide->view[k][lane];
        w->surface.normal[k] = reflector->normal[k] = wide->normal[k][lane];
    }
    reflector->n_dot_v = wide->n_dot_v[lane];
    reflector->seen = wide->seen[lane];
}

/* Makes lit that of a lane, and the surface, where all are alike. */
static void stand_at(struct wide_lit *w, int lane)
{
    const struct rt_wide *wide = &w->wide;
    w->lit.index = w->group->fragments[lane];
    w->lit.fragment = &w->batch->fragments[w->lit.index];
    w->lit.view_z = wide->view_z[lane];
    w->lit.reflector = &w->reflectors[w->are_alike ? 0 : lane];
    for (int k = 0; k < 3; k++) {
        w->lit.point[k] = wide->middle[k][lane];
        w->lit.view[k] = wide->view[k][lane];
    }
    if (w->are_alike)
        turn_to(w, lane);
}

static void start_rays(struct wide_lit *w, int lane)
{
    const struct rt_fragment *fragment = &w->batch->fragments[w->group->fragments[lane]];
    struct rt_start *start = &w->batch->starts[w->group->fragments[lane]];
    for (int k = 0; k < 3; k++) {
        start->point[k] = w->wide.start[k][lane];
        start->offset[k] = w->wide.offset[k][lane];
    }
    start->mesh = fragment->hit.mesh;
    start->triangle = fragment->hit.triangle;
    start->excluded_node = rt_path_excluded_node(w->batch->desc.scene, &fragment->hit);
}

static struct rt_fragment *find_middle(struct wide_lit *w, int lane)
{
    struct rt_fragment *fragment = &w->batch->fragments[w->group->fragments[lane]];
    fragment->hit.u = w->wide.u[lane] / w->wide.count[lane];
    fragment->hit.v = w->wide.v[lane] / w->wide.count[lane];
    stand_at(w, lane);
    return fragment;
}

static void begin_alike(struct wide_lit *w)
{
    struct rt_shading *shadings = w->batch->shadings, alike = {.alpha = 0};
    const bool has_hemisphere = w->batch->desc.scene->state->has_environment;
    find_middle(w, 0);
    bool is_lit = rt_lit_evaluate(w->batch, &w->lit, &alike);
    assert(is_lit);
    rt_wide_look(&w->reflectors[0], &w->wide);
    for (int i = 0; i < w->group->count; i++) {
        struct rt_shading *shading = &shadings[w->group->fragments[i]];
        *shading = alike;
        if (has_hemisphere || alike.is_ground) {
            stand_at(w, i);
            rt_lit_add_hemisphere(w->batch, &w->lit, shading);
        }
        start_rays(w, i);
    }
}

static void begin_different(struct wide_lit *w, const struct rt_mesh *mesh)
{
    for (int i = 0; i < w->group->count; i++) {
        struct rt_shading *shading = &w->batch->shadings[w->group->fragments[i]];
        const struct rt_fragment *fragment = find_middle(w, i);
        if (mesh->slots)
            rt_batch_footprint(w->batch, &fragment->hit, w->lit.view_z, w->lit.view,
                               &w->lit.footprint);
        bool is_lit = rt_lit_evaluate(w->batch, &w->lit, shading);
        assert(is_lit);
        rt_lit_add_hemisphere(w->batch, &w->lit, shading);
        rt_wide_paint(w->lit.reflector, i, &w->wide);
        start_rays(w, i);
    }
}

static void pass_haze(struct wide_lit *w, uint32_t lanes)
{
    struct rt_ray_job job;
    for (; lanes; lanes &= lanes - 1) {
        int lane = __builtin_ctz(lanes);
        stand_at(w, lane);
        job.distance_m = w->light.distance_m[lane];
        for (int k = 0; k < 3; k++)
            job.direction[k] = w->light.direction[k][lane];
        w->light.gain[lane] *= rt_lit_pass_haze(w->batch, &w->lit, &job);
    }
}

static void send(struct wide_lit *w, uint32_t light, bool casts_shadow, uint32_t lanes)
{
    const struct rt_wide_light *from = &w->light;
    for (; lanes; lanes &= lanes - 1) {
        int lane = __builtin_ctz(lanes);
        struct rt_ray_job *job = rt_lit_begin_job(w->batch, w->group->fragments[lane], light);
        job->distance_m = from->distance_m[lane];
        for (int k = 0; k < 3; k++) {
            job->direction[k] = from->direction[k][lane];
            job->weight[k] = from->weight[k][lane];
        }
        rt_lit_send(w->batch, job, casts_shadow);
    }
}

static void ask_light(struct wide_lit *w, uint32_t light, uint32_t lanes)
{
    const struct rt_light_record *record = &w->batch->desc.light_set->records[light];
    if (record->is_area) {
        w->batch->lights_reaching += (uint64_t)__builtin_popcount(lanes);
        for (; lanes; lanes &= lanes - 1) {
            stand_at(w, __builtin_ctz(lanes));
            rt_lit_ask_area(w->batch, &w->lit, light);
        }
        return;
    }
    rt_wide_arrive(record, &w->wide, &w->light);
    lanes &= rt_wide_lanes(w->light.arrives);
    if (!lanes)
        return;
    w->batch->lights_reaching += (uint64_t)__builtin_popcount(lanes);
    if (w->batch->desc.haze)
        pass_haze(w, lanes);
    rt_wide_reflect(w->are_alike ? &w->reflectors[0] : NULL, record, &w->wide, &w->light);
    send(w, light, record->casts_shadow, lanes & rt_wide_lanes(w->light.reflects));
}

static void ask_list(struct wide_lit *w, const struct rt_light_list *list, uint32_t lanes)
{
    w->batch->lights_listed += list->count * (uint64_t)__builtin_popcount(lanes);
    for (size_t i = 0; i < list->count; i++)
        ask_light(w, rt_light_list_at(list, i), lanes);
}

static void ask_lights(struct wide_lit *w)
{
    struct rt_wide_places places = {.count = w->group->count, .view_z = w->wide.view_z};
    struct rt_light_list lists[RT_WIDE];
    uint32_t lanes[RT_WIDE];
    for (int i = 0; i < w->group->count; i++) {
        const struct rt_fragment *fragment = &w->batch->fragments[w->group->fragments[i]];
        places.x[i] = fragment->x;
        places.y[i] = fragment->y;
    }
    int count = rt_wide_lists(w->batch->desc.light_set, &places, lists, lanes);
    w->batch->surfaces += (uint64_t)w->group->count;
    for (int i = 0; i < count; i++)
        ask_list(w, &lists[i], lanes[i]);
}

static void light_group(struct wide_lit *w, const struct group *group)
{
    struct rt_batch *batch = w->batch;
    const struct rt_mesh *mesh = &batch->desc.scene->meshes[group->mesh];
    if (group->count < LEAST) {
        for (int i = 0; i < group->count; i++)
            rt_lit_begin(batch, group->fragments[i]);
        return;
    }
    w->group = group;
    w->are_alike = mesh->is_plain;
    place(w, mesh);
    if (w->are_alike)
        begin_alike(w);
    else
        begin_different(w, mesh);
    ask_lights(w);
    for (int i = 0; batch->desc.environment && i < group->count; i++) {
        stand_at(w, i);
        rt_lit_ask_environment(batch, &w->lit);
    }
}

static void add(struct wide_lit *w, struct group groups[GROUPS], uint32_t fragment)
{
    const struct rt_fragment *from = &w->batch->fragments[fragment];
    struct group *group = &groups[from->hit.mesh % GROUPS];
    if (group->count && (group->count == RT_WIDE || group->mesh != from->hit.mesh ||
                         group->is_opaque != from->is_opaque)) {
        light_group(w, group);
        group->count = 0;
    }
    group->mesh = from->hit.mesh;
    group->is_opaque = from->is_opaque;
    group->fragments[group->count++] = fragment;
}

void rt_batch_wide_begin(struct rt_batch *batch, uint32_t first)
{
    const struct rt_mesh *meshes = batch->desc.scene->meshes;
    struct group groups[GROUPS];
    struct wide_lit w; /* large: what is read is set below, or by the group */
    w.batch = batch;
    w.lit.surface = &w.surface;
    memset(&w.wide, 0, sizeof w.wide);
    memset(&w.light, 0, sizeof w.light);
    for (int i = 0; i < GROUPS; i++)
        groups[i].count = 0;
    for (uint32_t i = first; i < batch->fragment_count && !batch->is_cancelled; i++)
        if (meshes[batch->fragments[i].hit.mesh].is_bare)
            add(&w, groups, i);
        else
            rt_lit_begin(batch, i);
    for (int i = 0; i < GROUPS && !batch->is_cancelled; i++)
        light_group(&w, &groups[i]);
}
