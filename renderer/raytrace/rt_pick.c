/* SPDX-License-Identifier: MIT */
/* Camera rays that tell what they meet. */
#include <math.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_job.h"

static void describe(const struct rt_scene *scene, const struct camera *camera,
                     const struct rt_ray *ray, const struct rt_hit *hit,
                     struct raytrace_layer *layer)
{
    const struct state_item *item = scene->meshes[hit->mesh].item;
    const struct scene_state *state = scene->state;
    uint32_t material =
        item->cap ? state->caps.caps[item->cap - 1].source_material : item->material;
    double normal[3];
    rt_scene_normal(scene, hit, normal);
    double side = vec3_dot(normal, ray->direction) > 0 ? -1 : 1;
    *layer =
        (struct raytrace_layer){.node = item->node,
                                .material = material,
                                .depth = hit->t + (camera->is_orthographic ? camera->z_near : 0),
                                .is_front = hit->is_front,
                                .is_transparent = !hit->is_opaque};
    for (int k = 0; k < 3; k++) {
        layer->position[k] = ray->origin[k] + ray->direction[k] * hit->t + scene->origin[k];
        layer->normal[k] = side * normal[k];
    }
}

/* Drops what is not seen: hidden surfaces, masked ones where they are cut out, and the ground. */
static size_t collect(const struct rt_scene *scene, const struct camera *camera,
                      const struct rt_ray *ray, struct rt_hits *hits, struct raytrace_layer *layers)
{
    size_t count = 0;
    rt_scene_collect(scene, ray, hits);
    for (size_t i = 0; i < hits->count; i++) {
        const struct rt_hit *hit = &hits->hits[i];
        const struct rt_mesh *mesh = &scene->meshes[hit->mesh];
        bool is_cut_out = mesh->class_ == STATE_MASKED && !hit->is_opaque;
        if (!hit->is_hidden && !is_cut_out && !mesh->is_ground)
            describe(scene, camera, ray, hit, &layers[count++]);
    }
    return count;
}

/* A ray by ray; what it meets is in `layers`. */
struct looker {
    const struct rt_job *job;
    struct rt_hits hits;
    struct raytrace_layer *layers; /* owned */
};

static bool look_through(struct looker *looker, double x, double y, size_t *count,
                         struct error *err)
{
    const struct rt_job *job = looker->job;
    struct rt_ray ray;
    rt_job_camera_ray(job, x, y, &ray);
    *count = collect(job->scene, job->desc->camera, &ray, &looker->hits, looker->layers);
    return !looker->hits.has_overflowed ||
           error_set(err, ERROR_OVER_BUDGET, "a ray meets more than %d surfaces", RT_HITS_MAX);
}

static bool visit_rectangle(struct looker *looker, const void *asked, struct error *err)
{
    const struct raytrace_pick *pick = asked;
    for (int y = 0; y < pick->height; y++)
        for (int x = 0; x < pick->width; x++) {
            size_t count;
            if (!look_through(looker, pick->x + x, pick->y + y, &count, err))
                return false;
            pick->visit(pick->context, looker->layers, count);
        }
    return true;
}

static bool visit_points(struct looker *looker, const void *asked, struct error *err)
{
    const struct raytrace_look *look = asked;
    for (size_t i = 0; i < look->count; i++) {
        size_t count;
        if (!look_through(looker, look->pixels[i][0], look->pixels[i][1], &count, err))
            return false;
        look->visit(look->context, i, looker->layers, count);
    }
    return true;
}

static bool run(const struct raytrace_desc *desc,
                bool (*visit)(struct looker *looker, const void *asked, struct error *err),
                const void *asked, struct error *err)
{
    struct rt_scene own = {0}, *scene;
    bool is_reused;
    if (!rt_job_take_scene(desc, &own, &scene, &is_reused, err))
        return false;
    struct rt_job job = {.desc = desc, .scene = scene};
    struct looker looker = {.job = &job, .layers = malloc(RT_HITS_MAX * sizeof *looker.layers)};
    bool ok = looker.layers ? rt_hits_init(&looker.hits, err)
                            : error_set(err, ERROR_NO_MEMORY, "layers of a ray");
    ok = ok && visit(&looker, asked, err);
    rt_hits_finish(&looker.hits);
    free(looker.layers);
    rt_scene_finish(&own);
    return ok;
}

bool raytrace_pick(const struct raytrace_desc *desc, const struct raytrace_pick *pick,
                   struct error *err)
{
    return run(desc, visit_rectangle, pick, err);
}

bool raytrace_look(const struct raytrace_desc *desc, const struct raytrace_look *look,
                   struct error *err)
{
    return run(desc, visit_points, look, err);
}
