/* SPDX-License-Identifier: MIT */
/* Asking lights for a batch of surfaces; shadow rays go to one light in packets. */
#include "renderer/raytrace/rt_batch_light.h"

#include "renderer/base/matrix.h"
#include "renderer/raytrace/rt_batch_wide.h"
#include "renderer/raytrace/rt_environment.h"
#include "renderer/raytrace/rt_haze.h"
#include "renderer/raytrace/rt_job.h"
#include "renderer/raytrace/rt_light.h"
#include "renderer/raytrace/rt_math.h"
#include "renderer/raytrace/rt_path.h"
#include "renderer/raytrace/rt_terminator.h"

static void add_light(struct rt_shading *shading, const struct rt_ray_job *job,
                      const double transmittance[3])
{
    for (int k = 0; k < 3; k++)
        shading->radiance[k] += (double)job->weight[k] * transmittance[k];
}

/* From just off the surface on the light's side to just before the light: f32 may misplace both,
 * and a caster that the light touches, by nudge_m. */
static void place_ray(const struct rt_scene *scene, const struct rt_start *start,
                      const struct rt_ray_job *job, struct rt_ray *ray)
{
    for (int k = 0; k < 3; k++)
        ray->direction[k] = (double)job->direction[k];
    double side = vec3_dot(start->offset, ray->direction) < 0 ? -1 : 1;
    for (int k = 0; k < 3; k++)
        ray->origin[k] = start->point[k] + side * start->offset[k];
    rt_shadow_range(scene, (double)job->distance_m, ray);
    if (isfinite(job->distance_m))
        ray->t_max = rt_max(ray->t_max - 8 * scene->nudge_m, ray->t_min);
    ray->culls_back_faces = ray->is_bent = ray->only_media = false;
    ray->skip_mesh = start->mesh;
    ray->skip_triangle = start->triangle;
    ray->excluded_node = start->excluded_node;
}

static void light_media(struct rt_batch *batch, const struct rt_ray_job *job, double sigma[3])
{
    const struct rt_light_set *light_set = batch->desc.light_set;
    if (light_set->sigma && light_set->records[job->light].samples == 1) {
        memcpy(sigma, light_set->sigma[job->light], 3 * sizeof *sigma);
        return;
    }
    struct rt_arrival arrival = {.distance_m = (double)job->distance_m};
    for (int k = 0; k < 3; k++)
        arrival.direction[k] = (double)job->direction[k];
    rt_light_media(batch->desc.scene, &arrival, batch->starts[job->fragment].point, &batch->scratch,
                   sigma);
}

static void trace_jobs(struct rt_batch *batch, const uint32_t *numbers, size_t count)
{
    struct rt_packet *packet = &batch->packet;
    const struct rt_scene *scene = batch->desc.scene;
    const bool has_media = scene->state->medium_count, has_grids = scene->state->grid_count;
    packet->count = (int)count;
    for (size_t i = 0; i < count; i++) {
        const struct rt_ray_job *job = &batch->jobs[numbers[i]];
        place_ray(scene, &batch->starts[job->fragment], job, &packet->rays[i]);
    }
    rt_packet_occlude(packet);
    for (size_t i = 0; i < count; i++) {
        const struct rt_hits *hits = &packet->hits[i];
        const struct rt_ray_job *job = &batch->jobs[numbers[i]];
        double transmittance[3] = {1, 1, 1}, sigma[3];
        batch->has_overflowed |= hits->has_overflowed;
        if (packet->is_occluded[i])
            continue;
        if (has_media)
            light_media(batch, job, sigma);
        if (has_media || has_grids || hits->count)
            rt_path_transmittance(scene, hits, &packet->rays[i], sigma,
                                  batch->desc.view->quality.blend_filter, transmittance);
        add_light(&batch->shadings[job->fragment], job, transmittance);
    }
    batch->shadow_rays += count;
}

/* Sorts the jobs by light, in the order of their surfaces: neighbours go together, and what lies
 * behind panes, often metres away, goes apart from the panes. counts: of the jobs of each light, on
 * opaque and on transparent surfaces; on return where they end. */
static void sort_jobs(struct rt_batch *batch, uint32_t *counts)
{
    uint32_t first = 0;
    for (size_t i = 0; i < 2 * rt_batch_light_slots(batch); i++) {
        uint32_t count = counts[i];
        counts[i] = first;
        first += count;
    }
    for (size_t i = 0; i < batch->job_count; i++) {
        const struct rt_ray_job *job = &batch->jobs[i];
        batch->sorted[counts[2 * (size_t)job->light + job->is_transparent]++] = (uint32_t)i;
    }
}

void rt_lit_flush(struct rt_batch *batch)
{
    size_t lights = rt_batch_light_slots(batch);
    uint32_t *counts = batch->light_counts;
    sort_jobs(batch, counts);
    batch->is_cancelled = rt_job_is_cancelled(batch->desc.job);
    size_t i = 0;
    for (size_t light = 0; light < lights && !batch->is_cancelled; light++)
        for (size_t end, last = counts[2 * light + 1]; i < last; i = end) {
            end = i + RT_LANES < last ? i + RT_LANES : last;
            trace_jobs(batch, &batch->sorted[i], end - i);
        }
    memset(counts, 0, 2 * lights * sizeof *counts);
    batch->job_count = 0;
}

void rt_lit_send(struct rt_batch *batch, const struct rt_ray_job *job, bool casts_shadow)
{
    struct rt_shading *shading = &batch->shadings[job->fragment];
    for (int k = 0; k < 3 && shading->is_ground; k++)
        shading->unshadowed[k] += (double)job->weight[k];
    if (!casts_shadow || batch->desc.view->quality.shadows == SHADOWS_NONE) {
        add_light(shading, job, (const double[3]){1, 1, 1});
        return;
    }
    batch->light_counts[2 * (size_t)job->light + job->is_transparent]++;
    batch->job_count++; /* it is in its place */
}

double rt_lit_pass_haze(const struct rt_batch *batch, const struct rt_lit *lit,
                        const struct rt_ray_job *job)
{
    struct rt_arrival arrival = {.distance_m = (double)job->distance_m};
    if (!batch->desc.haze)
        return 1;
    for (int k = 0; k < 3; k++)
        arrival.direction[k] = (double)job->direction[k];
    return rt_haze_arrives(batch->desc.scene, batch->desc.view, &arrival, lit->point);
}

/* job: all but its weight. */
static void ask(struct rt_batch *batch, const struct rt_lit *lit, struct rt_ray_job *job,
                double gain)
{
    const struct rt_light_record *record = &batch->desc.light_set->records[job->light];
    double l[3] = {(double)job->direction[0], (double)job->direction[1], (double)job->direction[2]};
    double reflected[3];
    if (!rt_reflect(lit->reflector, l, reflected))
        return;
    gain *= rt_lit_pass_haze(batch, lit, job);
    for (int k = 0; k < 3; k++)
        job->weight[k] = (float)(reflected[k] * gain * (double)record->color[k]);
    rt_lit_send(batch, job, record->casts_shadow);
}

void rt_lit_ask_area(struct rt_batch *batch, const struct rt_lit *lit, uint32_t light)
{
    const struct rt_fragment *fragment = lit->fragment;
    struct rt_light_sample sample = {.count = batch->desc.light_set->records[light].samples,
                                     .seed = rt_job_seed(fragment->x, fragment->y, 0) + light};
    for (; sample.index < sample.count; sample.index++) {
        struct rt_arrival arrival;
        rt_light_arrive(&batch->desc.scene->state->lights[light], &sample,
                        batch->desc.scene->origin, lit->point, &arrival);
        if (arrival.gain <= 0)
            continue;
        struct rt_ray_job *job = rt_lit_begin_job(batch, lit->index, light);
        job->distance_m = (float)arrival.distance_m;
        for (int k = 0; k < 3; k++)
            job->direction[k] = (float)arrival.direction[k];
        ask(batch, lit, job, arrival.gain);
    }
}

static void ask_light(struct rt_batch *batch, const struct rt_lit *lit, uint32_t light,
                      const float point[3])
{
    const struct rt_light_set *light_set = batch->desc.light_set;
    if (light_set->records[light].is_area) {
        rt_lit_ask_area(batch, lit, light);
        return;
    }
    struct rt_ray_job *job = rt_lit_begin_job(batch, lit->index, light);
    float gain = rt_light_set_arrive(light_set, light, point, job->direction, &job->distance_m);
    if (gain > 0)
        ask(batch, lit, job, (double)gain);
    else
        batch->lights_reaching--;
}

static void ask_lights(struct rt_batch *batch, const struct rt_lit *lit)
{
    const struct rt_light_set *light_set = batch->desc.light_set;
    const struct rt_light_list list =
        rt_light_set_near(light_set, lit->fragment->x, lit->fragment->y, lit->view_z);
    float point[3], normal[3];
    for (int k = 0; k < 3; k++) {
        point[k] = (float)lit->point[k];
        normal[k] = lit->reflector->transmits ? 0 : (float)lit->surface->normal[k];
    }
    batch->surfaces++;
    batch->lights_listed += list.count;
    for (size_t first = 0; first < list.count; first += RT_BLOCK_LIGHTS) {
        uint32_t lights[RT_BLOCK_LIGHTS];
        size_t reaching, count;
        count = rt_light_block_look(rt_light_set_block(light_set, batch->blocks, &list, first),
                                    point, normal, lights, &reaching);
        batch->lights_reaching += reaching;
        for (size_t i = 0; i < count; i++)
            ask_light(batch, lit, lights[i], point);
    }
}

void rt_lit_ask_environment(struct rt_batch *batch, const struct rt_lit *lit)
{
    const struct environment_light *light = batch->desc.environment;
    const uint32_t slot = (uint32_t)rt_batch_light_slots(batch) - 1;
    const uint32_t count = rt_environment_count(light, &batch->desc.view->quality);
    struct rt_environment_sampler sampler;
    if (!count)
        return;
    rt_environment_begin(&sampler, light, lit->reflector, count,
                         rt_job_seed(lit->fragment->x, lit->fragment->y, 0) + slot);
    for (uint32_t i = 0; i < count; i++) {
        double l[3], arriving[3], reflected[3];
        if (!rt_environment_draw(&sampler, i, l, arriving) ||
            !rt_reflect(sampler.reflector, l, reflected))
            continue;
        struct rt_ray_job *job = rt_lit_begin_job(batch, lit->index, slot);
        job->distance_m = INFINITY;
        for (int k = 0; k < 3; k++) {
            job->direction[k] = (float)l[k];
            job->weight[k] = (float)(reflected[k] * arriving[k]);
        }
        rt_lit_send(batch, job, true);
    }
}

/* Any single sample would shift shadows and textures by up to half a pixel; the middle of all of
 * them is the pixel's middle inside a surface. */
static void place_in_the_middle(struct rt_batch *batch, struct rt_fragment *fragment,
                                struct rt_lit *lit, double normal[3])
{
    const struct rt_scene *scene = batch->desc.scene;
    double count = fragment->sum.count, relative[3];
    fragment->hit.u = fragment->sum.u / count;
    fragment->hit.v = fragment->sum.v / count;
    for (int k = 0; k < 3; k++) {
        lit->point[k] = fragment->sum.point[k] / count;
        lit->view[k] = -fragment->sum.direction[k];
        relative[k] = lit->point[k] + scene->origin[k] - batch->desc.camera->eye[k];
    }
    vec3_normalize(lit->view);
    rt_scene_normal(scene, &fragment->hit, normal);
    lit->view_z = -vec3_dot(relative, batch->desc.camera->back);
    if (scene->meshes[fragment->hit.mesh].slots)
        rt_batch_footprint(batch, &fragment->hit, lit->view_z, lit->view, &lit->footprint);
}

static void start_rays(struct rt_batch *batch, const struct rt_lit *lit, const double normal[3])
{
    const struct rt_hit *hit = &lit->fragment->hit;
    struct rt_start *start = &batch->starts[lit->index];
    for (int k = 0; k < 3; k++) {
        start->point[k] = lit->point[k];
        start->offset[k] = normal[k] * batch->desc.scene->nudge_m;
    }
    struct rt_smooth_start smooth;
    if (hit->is_opaque && rt_terminator_find(batch->desc.scene, hit, lit->point, &smooth))
        for (int k = 0; k < 3; k++) {
            start->point[k] += smooth.offset[k];
            start->offset[k] = smooth.normal[k] * batch->desc.scene->nudge_m;
        }
    start->mesh = hit->mesh;
    start->triangle = hit->triangle;
    start->excluded_node = rt_path_excluded_node(batch->desc.scene, hit);
}

/* Of a sampler without levels of detail one sample of a texture that is finer than the pixel would
 * flicker. */
static void average_base(const struct rt_scene *scene, const struct rt_lit *lit)
{
    struct rt_surface *surface = lit->surface;
    const struct rt_fragment *fragment = lit->fragment;
    int32_t texture = surface->material->textures[SCENE_TEXTURE_BASE_COLOR].texture;
    double sum[4] = {surface->base[0], surface->base[1], surface->base[2], surface->alpha};
    if (texture < 0 || rt_texture_has_levels(&scene->state->scene->textures[texture]))
        return;
    for (int i = 0; i < fragment->texel_count; i++) {
        const struct rt_hit hit = {.mesh = fragment->hit.mesh,
                                   .triangle = fragment->texels[i].triangle,
                                   .u = (double)fragment->texels[i].u,
                                   .v = (double)fragment->texels[i].v};
        double base[4];
        rt_surface_base(scene, &hit, &lit->footprint, base);
        for (int k = 0; k < 4; k++)
            sum[k] += base[k];
    }
    for (int k = 0; k < 3; k++)
        surface->base[k] = sum[k] / (fragment->texel_count + 1);
    if (surface->material->alpha_mode == SCENE_BLEND)
        surface->alpha = sum[3] / (fragment->texel_count + 1);
}

bool rt_lit_evaluate(struct rt_batch *batch, const struct rt_lit *lit, struct rt_shading *shading)
{
    const struct rt_fragment *fragment = lit->fragment;
    struct rt_surface *surface = lit->surface;
    rt_surface_evaluate(batch->desc.scene, &fragment->hit, &lit->footprint, surface);
    average_base(batch->desc.scene, lit);
    if (fragment->is_opaque)
        surface->alpha = 1, surface->transmission = 0;
    else
        rt_surface_view_filter(surface, lit->view, fragment->hit.is_front, shading->filter);
    shading->alpha = surface->alpha;
    shading->is_ground = batch->desc.scene->meshes[fragment->hit.mesh].is_ground;
    bool is_textured = surface->material->textures[SCENE_TEXTURE_BASE_COLOR].texture >= 0;
    for (int k = 0; k < 3; k++)
        shading->base[k] = is_textured ? (float)surface->base[k] : 1;
    if (surface->material->flags & SCENE_MATERIAL_UNLIT) {
        for (int k = 0; k < 3; k++)
            shading->radiance[k] = surface->base[k] + surface->emissive[k];
        return false;
    }
    rt_reflector_init(lit->reflector, surface, lit->view);
    rt_reflector_emission(lit->reflector, surface, shading->radiance);
    return true;
}

void rt_lit_add_hemisphere(const struct rt_batch *batch, const struct rt_lit *lit,
                           struct rt_shading *shading)
{
    const struct scene_state *state = batch->desc.scene->state;
    if (state->has_environment)
        rt_reflect_hemisphere(state, lit->reflector, lit->surface, shading->radiance);
    if (shading->is_ground)
        memcpy(shading->unshadowed, shading->radiance, sizeof shading->unshadowed);
}

void rt_lit_begin(struct rt_batch *batch, uint32_t index)
{
    struct rt_fragment *fragment = &batch->fragments[index];
    struct rt_shading *shading = &batch->shadings[index];
    struct rt_lit lit;
    struct rt_surface surface;
    struct rt_reflector reflector;
    double normal[3];
    lit.index = index;
    lit.fragment = fragment;
    lit.surface = &surface;
    lit.reflector = &reflector;
    place_in_the_middle(batch, fragment, &lit, normal);
    if (!rt_lit_evaluate(batch, &lit, shading))
        return;
    rt_lit_add_hemisphere(batch, &lit, shading);
    start_rays(batch, &lit, normal);
    ask_lights(batch, &lit);
    rt_lit_ask_environment(batch, &lit);
}

/* All its light is there: it sends nothing, and filters what lies behind. */
static void end_ground(const struct rt_batch *batch, uint32_t index)
{
    struct rt_shading *shading = &batch->shadings[index];
    if (!shading->is_ground)
        return;
    rt_ground_share(batch->desc.scene, batch->starts[index].point, shading->radiance,
                    shading->unshadowed, shading->filter);
    shading->alpha = 0;
}

void rt_batch_light(struct rt_batch *batch, uint32_t first)
{
    rt_batch_wide_begin(batch, first);
    rt_lit_flush(batch);
    if (!batch->desc.scene->state->ground_plane.is_there)
        return;
    for (uint32_t i = first; i < batch->fragment_count && !batch->is_cancelled; i++)
        end_ground(batch, i);
}
