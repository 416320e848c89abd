/* SPDX-License-Identifier: MIT */
/* Reflection model and shadow rays of the ground truth. Formulas: docs/shading.md, glTF 2.0
 * appendix B. */
#include "renderer/raytrace/rt_light.h"

#include <float.h>
#include <stdlib.h>

#include "renderer/scene/matrix.h"

static const double pi = 3.14159265358979323846;
static const double min_alpha = 1e-3;

bool rt_lighting_init(struct rt_lighting *lighting, const struct rt_scene *scene,
                      const struct view *view, struct error *err)
{
    *lighting = (struct rt_lighting){.scene = scene, .view = view};
    lighting->shadow_hits.hits = calloc(RT_HITS_MAX, sizeof *lighting->shadow_hits.hits);
    if (!lighting->shadow_hits.hits)
        return error_set(err, ERROR_NO_MEMORY, "hits of a shadow ray");
    return true;
}

void rt_lighting_finish(struct rt_lighting *lighting)
{
    free(lighting->shadow_hits.hits);
    *lighting = (struct rt_lighting){0};
}

/* Unit direction to the light and the distance to it (infinite for directional ones). */
static double toward_light(const struct rt_scene *scene, const struct state_light *light,
                           const double point[3], double l[3])
{
    if (light->type == SCENE_LIGHT_DIRECTIONAL) {
        for (int k = 0; k < 3; k++)
            l[k] = -light->direction[k];
        return INFINITY;
    }
    for (int k = 0; k < 3; k++)
        l[k] = light->position[k] - scene->origin[k] - point[k];
    double distance = vec3_length(l);
    vec3_normalize(l);
    return distance;
}

void rt_transmittance(struct rt_lighting *lighting, const struct state_light *light,
                      const double point[3], const struct rt_hit *on, double out[3])
{
    const struct rt_scene *scene = lighting->scene;
    struct rt_ray ray = {.skip_mesh = on ? on->mesh : UINT32_MAX,
                         .skip_triangle = on ? on->triangle : UINT32_MAX};
    out[0] = out[1] = out[2] = 1;
    if (!light->casts_shadow)
        return;
    memcpy(ray.origin, point, sizeof ray.origin);
    double distance = toward_light(scene, light, point, ray.direction);
    double diagonal[3];
    vec3_sub(scene->state->bounds_max, scene->state->bounds_min, diagonal);
    ray.t_max = isfinite(distance) ? distance : 4 * vec3_length(diagonal) + 1;
    ray.t_min = scene->epsilon * ray.t_max;
    rt_scene_collect(scene, &ray, &lighting->shadow_hits);
    lighting->shadow_rays++;
    lighting->has_overflowed |= lighting->shadow_hits.has_overflowed;
    for (size_t i = 0; i < lighting->shadow_hits.count; i++) {
        const struct rt_hit *hit = &lighting->shadow_hits.hits[i];
        if (rt_scene_is_opaque(scene, hit)) {
            out[0] = out[1] = out[2] = 0;
            return;
        }
        if (scene->meshes[hit->mesh].item->class_ == STATE_MASKED)
            continue; /* a hole of the mask */
        struct rt_surface surface;
        double filter[3];
        rt_surface_evaluate(scene, hit, &surface);
        /* the light comes from the far end of this ray: it enters where the ray sees the back */
        rt_surface_light_filter(&surface, fabs(vec3_dot(hit->normal, ray.direction)),
                                !hit->is_front, lighting->view->quality.blend_filter, filter);
        for (int k = 0; k < 3; k++)
            out[k] *= filter[k];
    }
}

/* KHR_lights_punctual: irradiance on a facing plane [lx]. */
static double light_gain(const struct state_light *light, double distance, const double l[3])
{
    if (light->type == SCENE_LIGHT_DIRECTIONAL)
        return 1;
    double gain = 1 / fmax(distance * distance, 1e-12);
    if (light->range > 0) {
        double q = distance / (double)light->range;
        gain *= fmax(0, 1 - q * q * q * q);
    }
    if (light->type == SCENE_LIGHT_SPOT) {
        double outer = cos((double)light->outer_cone_rad);
        double scale = 1 / fmax(cos((double)light->inner_cone_rad) - outer, 1e-3);
        double cone = fmin(fmax((-vec3_dot(light->direction, l) - outer) * scale, 0), 1);
        gain *= cone * cone;
    }
    return gain;
}

static double schlick(double cosine)
{
    return pow(fmin(fmax(1 - cosine, 0), 1), 5);
}

static double ggx(double n_dot_h, double n_dot_l, double n_dot_v, double alpha)
{
    double a2 = alpha * alpha;
    double f = n_dot_h * n_dot_h * (a2 - 1) + 1;
    double d = a2 / (pi * f * f);
    double visibility = n_dot_v * sqrt(n_dot_l * n_dot_l * (1 - a2) + a2) +
                        n_dot_l * sqrt(n_dot_v * n_dot_v * (1 - a2) + a2);
    return d * 0.5 / fmax(visibility, 1e-10);
}

static void half_vector(const double a[3], const double b[3], double h[3])
{
    for (int k = 0; k < 3; k++)
        h[k] = a[k] + b[k];
    vec3_normalize(h);
}

/* f * cosine of appendix B.3, and the mirrored lobe of KHR_materials_transmission. */
static void reflect_light(const struct rt_surface *s, const double v[3], const double l[3],
                          double out[3])
{
    double alpha = fmax(s->roughness * s->roughness, min_alpha);
    double n_dot_v = fmax(vec3_dot(s->normal, v), 1e-4), n_dot_l = vec3_dot(s->normal, l);
    double h[3];
    if (n_dot_l > 0) {
        half_vector(l, v, h);
        double lobe = ggx(fmin(fmax(vec3_dot(s->normal, h), 0), 1), n_dot_l, n_dot_v, alpha);
        double w = schlick(vec3_dot(v, h)), fresnel = rt_surface_fresnel(s, vec3_dot(v, h));
        for (int k = 0; k < 3; k++) {
            double diffuse = s->base[k] * (1 - s->transmission) / pi;
            double dielectric = diffuse + (lobe - diffuse) * fresnel;
            double metal = lobe * (s->base[k] + (1 - s->base[k]) * w);
            out[k] = (dielectric + (metal - dielectric) * s->metallic) * n_dot_l;
        }
        return;
    }
    out[0] = out[1] = out[2] = 0;
    if (s->transmission <= 0 || s->metallic >= 1)
        return;
    double mirrored[3];
    for (int k = 0; k < 3; k++)
        mirrored[k] = l[k] - 2 * n_dot_l * s->normal[k];
    half_vector(mirrored, v, h);
    double lobe =
        ggx(fmin(fmax(vec3_dot(s->normal, h), 0), 1), fmax(-n_dot_l, 1e-4), n_dot_v, alpha);
    double fresnel = rt_surface_fresnel(s, vec3_dot(v, h));
    for (int k = 0; k < 3; k++)
        out[k] = s->base[k] * s->transmission * (1 - fresnel) * (1 - s->metallic) * lobe * -n_dot_l;
}

/* Karis 2014, "Physically Based Shading on Mobile". */
static void environment_split(double roughness, double n_dot_v, double split[2])
{
    double r[4] = {1 - roughness, 0.0425 - 0.0275 * roughness, 1.04 - 0.572 * roughness,
                   0.022 * roughness - 0.04};
    double a = fmin(r[0] * r[0], exp2(-9.28 * n_dot_v)) * r[0] + r[1];
    split[0] = -1.04 * a + r[2];
    split[1] = 1.04 * a + r[3];
}

static void add_hemisphere(const struct scene_state *state, const struct rt_surface *s,
                           const double v[3], double out[3])
{
    double n_dot_v = fmin(fmax(vec3_dot(s->normal, v), 0), 1);
    double up = 0.5 + 0.5 * s->normal[1];
    double mirror_y = 2 * vec3_dot(s->normal, v) * s->normal[1] - v[1];
    double spread = 0.05 + 0.95 * s->roughness;
    double mirror_up = fmin(fmax(0.5 + 0.5 * mirror_y / spread, 0), 1);
    double split[2];
    environment_split(s->roughness, n_dot_v, split);
    for (int k = 0; k < 3; k++) {
        double sky = (double)state->sky[k], ground = (double)state->ground[k];
        double f0 = s->f0 + (s->base[k] - s->f0) * s->metallic;
        double diffuse = s->base[k] * (1 - s->metallic) * (1 - s->transmission) * (1 - s->f0);
        out[k] += (diffuse * (ground + (sky - ground) * up) +
                   (ground + (sky - ground) * mirror_up) * (f0 * split[0] + split[1])) *
                  s->occlusion;
    }
}

void rt_radiance(struct rt_lighting *lighting, const struct rt_hit *hit,
                 const struct rt_surface *surface, const double point[3], const double view[3],
                 double out[3])
{
    const struct scene_state *state = lighting->scene->state;
    if (surface->material->flags & SCENE_MATERIAL_UNLIT) {
        for (int k = 0; k < 3; k++)
            out[k] = surface->base[k] + surface->emissive[k];
        return;
    }
    memcpy(out, surface->emissive, 3 * sizeof *out);
    if (state->has_environment)
        add_hemisphere(state, surface, view, out);
    for (size_t i = 0; i < state->light_count; i++) {
        const struct state_light *light = &state->lights[i];
        double l[3], reflected[3], transmittance[3] = {1, 1, 1};
        double distance = toward_light(lighting->scene, light, point, l);
        double gain = light_gain(light, distance, l);
        if (gain <= 0)
            continue;
        reflect_light(surface, view, l, reflected);
        if (reflected[0] <= 0 && reflected[1] <= 0 && reflected[2] <= 0)
            continue;
        if (lighting->view->quality.shadows != VIEW_SHADOWS_NONE)
            rt_transmittance(lighting, light, point, hit, transmittance);
        for (int k = 0; k < 3; k++)
            out[k] += reflected[k] * transmittance[k] * gain * (double)light->color[k];
    }
}
