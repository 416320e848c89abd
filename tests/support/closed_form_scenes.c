/* SPDX-License-Identifier: MIT */
/* The common parts of the closed-form scenes: receivers, panes, light, and the exact answer. */
#include "tests/support/closed_form_scenes.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "glb/shapes.h"
#include "tests/support/closed_form_internal.h"

static const double pi = 3.14159265358979323846;

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

struct glb_builder *closed_form_begin(struct closed_form_scene *scene, const char *name,
                                      int pane_count)
{
    *scene = (struct closed_form_scene){.albedo = 0.5, .pane_count = pane_count};
    scene->panes = calloc((size_t)pane_count + 1, sizeof *scene->panes);
    assert(scene->panes);
    struct glb_builder *builder = glb_builder_create(name, NULL);
    assert(builder);
    return builder;
}

void closed_form_end(struct closed_form_scene *scene, struct glb_builder *builder)
{
    struct error err = {0};
    bool is_built = glb_builder_finish(builder, &scene->glb, &scene->size_bytes, &err);
    assert(is_built);
    glb_builder_destroy(builder);
}

void closed_form_scene_finish(struct closed_form_scene *scene)
{
    free(scene->glb);
    free(scene->panes);
    *scene = (struct closed_form_scene){0};
}

int closed_form_receiver(struct closed_form_scene *scene, struct glb_builder *builder)
{
    double a = scene->albedo;
    return glb_builder_add_material(builder, &(struct glb_material_desc){.name = "Receiver",
                                                                         .base_color = {a, a, a, 1},
                                                                         .roughness = 1,
                                                                         .has_ior = true,
                                                                         .ior = 1,
                                                                         .is_double_sided = true});
}

void closed_form_quad(struct glb_builder *builder, const char *name, int material,
                      const double corner[3], const double u[3], const double v[3])
{
    /* The corner goes into the node, in f64; the mesh holds the edges only. */
    struct shape shape = {0};
    shape_add_quad(&shape, (double[]){0, 0, 0}, u, v);
    struct glb_node_desc node = {.name = name,
                                 .mesh = shape_give_mesh(&shape, builder, name, material),
                                 .translation = {corner[0], corner[1], corner[2]}};
    glb_builder_add_node(builder, &node);
}

void closed_form_floor(struct closed_form_scene *scene, struct glb_builder *builder, double half)
{
    closed_form_quad(builder, "Floor", closed_form_receiver(scene, builder),
                     (double[]){-half, 0, half}, (double[]){2 * half, 0, 0},
                     (double[]){0, 0, -2 * half});
}

void closed_form_add_pane(struct glb_builder *builder, const struct closed_form_pane *pane)
{
    struct glb_material_desc material = {.name = "Pane",
                                         .has_ior = true,
                                         .ior = 1,
                                         .roughness = pane->is_blend ? 1 : 0,
                                         .transmission = pane->is_blend ? 0 : 1,
                                         .alpha_mode = pane->is_blend ? GLB_BLEND : GLB_OPAQUE,
                                         .is_double_sided = true};
    memcpy(material.base_color, pane->color, sizeof material.base_color);
    closed_form_quad(builder, "Pane", glb_builder_add_material(builder, &material), pane->corner,
                     pane->u, pane->v);
}

void closed_form_add_light(struct closed_form_scene *scene, struct glb_builder *builder)
{
    struct closed_form_light *light = &scene->light;
    for (int i = 0; i < 3; i++)
        light->color[i] = 1;
    if (light->type == GLB_LIGHT_SPOT) {
        light->inner_deg = 40;
        light->outer_deg = 45;
    }
    struct glb_light_desc desc = {.name = "Light",
                                  .type = light->type,
                                  .intensity = light->intensity,
                                  .inner_cone_deg = light->inner_deg,
                                  .outer_cone_deg = light->outer_deg};
    struct glb_node_desc node = {.name = "Light", .light = glb_builder_add_light(builder, &desc)};
    double target[3];
    for (int i = 0; i < 3; i++)
        target[i] = light->position[i] + light->direction[i];
    glb_node_look_at(&node, light->position, target);
    glb_builder_add_node(builder, &node);
}

void closed_form_camera(struct glb_builder *builder, const char *name, const double eye[3],
                        const double target[3], double fov_y_deg)
{
    struct glb_camera_desc desc = {.name = name, .fov_y_deg = fov_y_deg, .z_near = 0.001};
    struct glb_node_desc node = {.name = name, .camera = glb_builder_add_camera(builder, &desc)};
    glb_node_look_at(&node, eye, target);
    glb_builder_add_node(builder, &node);
}

/* SplitMix64, Steele, Lea and Flood 2014, "Fast splittable pseudorandom number generators". */
double closed_form_random(uint64_t *state, double low, double high)
{
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return low + (high - low) * ((double)(z >> 11) * 0x1p-53);
}

void closed_form_filter(const struct closed_form_pane *pane, double filter[3])
{
    double alpha = pane->color[3];
    for (int i = 0; i < 3; i++)
        filter[i] =
            pane->is_blend ? (1 - alpha) * (1 - alpha * (1 - pane->color[i])) : pane->color[i];
}

/* Where the segment origin + t * way, t in (0, 1), meets the plane of the pane: coordinates (s, t)
 * along its edges. False when it does not. */
static bool meet_plane(const struct closed_form_pane *pane, const double origin[3],
                       const double way[3], double st[2])
{
    double normal[3], q[3], along[3];
    cross(pane->u, pane->v, normal);
    double facing = dot(normal, way);
    if (facing == 0)
        return false;
    for (int i = 0; i < 3; i++)
        q[i] = pane->corner[i] - origin[i];
    double at = dot(normal, q) / facing;
    if (!(at > 0 && at < 1))
        return false;
    for (int i = 0; i < 3; i++)
        q[i] = origin[i] + at * way[i] - pane->corner[i];
    /* q = s u + t v, solved with the plane's own dual basis. */
    double area = dot(normal, normal);
    cross(q, pane->v, along);
    st[0] = dot(along, normal) / area;
    cross(pane->u, q, along);
    st[1] = dot(along, normal) / area;
    return true;
}

double closed_form_transmittance(const struct closed_form_scene *scene, const double point[3],
                                 double transmittance[3])
{
    const struct closed_form_light *light = &scene->light;
    double origin[3], way[3], nearest = INFINITY;
    for (int i = 0; i < 3; i++) {
        transmittance[i] = 1;
        bool is_directional = light->type == GLB_LIGHT_DIRECTIONAL;
        origin[i] = is_directional ? point[i] - 1000 * light->direction[i] : light->position[i];
        way[i] = point[i] - origin[i];
    }
    for (int k = 0; k < scene->pane_count; k++) {
        const struct closed_form_pane *pane = &scene->panes[k];
        double st[2], filter[3], normal[3];
        if (!meet_plane(pane, origin, way, st))
            continue;
        cross(pane->u, pane->v, normal);
        double area = sqrt(dot(normal, normal)); /* over one edge: the distance of its opposites */
        double s_m = fmin(fabs(st[0]), fabs(1 - st[0])) * area / sqrt(dot(pane->v, pane->v));
        double t_m = fmin(fabs(st[1]), fabs(1 - st[1])) * area / sqrt(dot(pane->u, pane->u));
        bool is_beside_s = st[0] < 0 || st[0] > 1, is_beside_t = st[1] < 0 || st[1] > 1;
        if (!is_beside_s && !is_beside_t) {
            closed_form_filter(pane, filter);
            for (int i = 0; i < 3; i++)
                transmittance[i] *= filter[i];
            nearest = fmin(nearest, fmin(s_m, t_m));
        } else {
            /* At least as far away as the larger of the two overshoots. */
            nearest = fmin(nearest, fmax(is_beside_s ? s_m : 0, is_beside_t ? t_m : 0));
        }
    }
    return nearest;
}

void closed_form_camera_onto(struct glb_builder *builder, const char *name, const double eye[3],
                             const double target[3], double half)
{
    double way[3] = {target[0] - eye[0], target[1] - eye[1], target[2] - eye[2]};
    closed_form_camera(builder, name, eye, target, 2 * atan(half / sqrt(dot(way, way))) * 180 / pi);
}

void closed_form_unshadowed(const struct closed_form_scene *scene, const double point[3],
                            const double normal[3], double radiance[3])
{
    const struct closed_form_light *light = &scene->light;
    double to_light[3], illuminance;
    for (int i = 0; i < 3; i++)
        to_light[i] = light->position[i] - point[i];
    double distance = sqrt(dot(to_light, to_light));
    if (light->type == GLB_LIGHT_DIRECTIONAL)
        illuminance = -light->intensity * dot(light->direction, normal);
    else
        illuminance = light->intensity * dot(to_light, normal) / (distance * distance * distance);
    for (int i = 0; i < 3; i++)
        radiance[i] = fmax(0, illuminance) * light->color[i] * scene->albedo / pi;
}

void closed_form_radiance(const struct closed_form_scene *scene, const double point[3],
                          const double normal[3], double radiance[3])
{
    double transmittance[3];
    closed_form_unshadowed(scene, point, normal, radiance);
    closed_form_transmittance(scene, point, transmittance);
    for (int i = 0; i < 3; i++)
        radiance[i] *= transmittance[i];
}
