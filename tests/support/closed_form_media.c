/* SPDX-License-Identifier: MIT */
/* Segments against boxes, wedges and spheres, in f64, and the bodies as triangles. */
#include "tests/support/closed_form_media.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#include "glb/shapes.h"
#include "tests/support/closed_form_internal.h"

static bool is_opaque(const struct closed_form_body *body)
{
    return body->distance <= 0;
}

void closed_form_sigma(const struct closed_form_body *body, double sigma[3])
{
    for (int k = 0; k < 3; k++)
        sigma[k] = is_opaque(body) ? 0 : -log((double)body->remains[k]) / (double)body->distance;
}

/* Cuts [range[0], range[1]] to where a + b t <= 0. */
static void cut(double a, double b, double range[2])
{
    if (b > 0)
        range[1] = fmin(range[1], -a / b);
    else if (b < 0)
        range[0] = fmax(range[0], -a / b);
    else if (a > 0)
        range[1] = -INFINITY;
}

/* The part of the whole line from + t (to - from) that lies inside. */
static void line_range(const struct closed_form_body *body, const double from[3],
                       const double way[3], double range[2])
{
    range[0] = -INFINITY;
    range[1] = INFINITY;
    if (body->shape == BODY_SPHERE) {
        double a = 0, b = 0, c = 0, radius = INFINITY;
        for (int k = 0; k < 3; k++) {
            double q = from[k] - 0.5 * (body->low[k] + body->high[k]);
            radius = fmin(radius, 0.5 * (body->high[k] - body->low[k]));
            a += way[k] * way[k];
            b += way[k] * q;
            c += q * q;
        }
        double root = b * b - a * (c - radius * radius);
        range[0] = root > 0 ? (-b - sqrt(root)) / a : INFINITY;
        range[1] = root > 0 ? (-b + sqrt(root)) / a : -INFINITY;
        return;
    }
    for (int k = 0; k < 3; k++) {
        cut(body->low[k] - from[k], -way[k], range);
        cut(from[k] - body->high[k], way[k], range);
    }
    if (body->shape == BODY_WEDGE) {
        double slope = (body->high[1] - body->low[1]) / (body->high[0] - body->low[0]);
        cut(from[1] - body->low[1] - slope * (from[0] - body->low[0]), way[1] - slope * way[0],
            range);
    }
}

double closed_form_length(const struct closed_form_body *body, const double from[3],
                          const double to[3], int *crossings)
{
    double way[3], range[2], length = 0;
    for (int k = 0; k < 3; k++) {
        way[k] = to[k] - from[k];
        length += way[k] * way[k];
    }
    line_range(body, from, way, range);
    *crossings = 0;
    if (!(range[0] < range[1]))
        return 0;
    *crossings = (range[0] > 0 && range[0] < 1) + (range[1] > 0 && range[1] < 1);
    return fmax(0, fmin(range[1], 1) - fmax(range[0], 0)) * sqrt(length);
}

double closed_form_opaque_at(const struct closed_form_body *bodies, int count, const double from[3],
                             const double to[3])
{
    double way[3], nearest = 1;
    for (int k = 0; k < 3; k++)
        way[k] = to[k] - from[k];
    for (int i = 0; i < count; i++) {
        double range[2];
        line_range(&bodies[i], from, way, range);
        if (!is_opaque(&bodies[i]) || !(range[0] < range[1]))
            continue;
        double at = range[0] > 0 ? range[0] : range[1]; /* from inside, its back */
        if (at > 0)
            nearest = fmin(nearest, at);
    }
    return nearest;
}

void closed_form_through(const struct closed_form_body *bodies, int count, const double from[3],
                         const double to[3], double transmittance[3])
{
    double tau[3] = {0}, product[3] = {1, 1, 1};
    for (int i = 0; i < count; i++) {
        int crossings;
        double sigma[3], length = closed_form_length(&bodies[i], from, to, &crossings);
        closed_form_sigma(&bodies[i], sigma);
        for (int k = 0; k < 3; k++) {
            tau[k] += sigma[k] * length;
            if (bodies[i].filter[0] > 0 || bodies[i].filter[1] > 0 || bodies[i].filter[2] > 0)
                product[k] *= pow((double)bodies[i].filter[k], crossings);
            if (is_opaque(&bodies[i]) && crossings)
                product[k] = 0;
        }
    }
    for (int k = 0; k < 3; k++)
        transmittance[k] = product[k] * exp(-tau[k]);
}

static void add_wedge(struct shape *shape, const double high[3])
{
    struct shape_outline outline = {.points = {{0, 0}, {high[0], 0}, {high[0], high[1]}},
                                    .count = 3};
    shape_add_extrusion(shape, &outline, high[2]);
}

static int add_glowing(struct glb_builder *builder)
{
    return glb_builder_add_material(
        builder,
        &(struct glb_material_desc){.name = "Glowing", .is_unlit = true, .is_double_sided = true});
}

static int add_material(struct closed_form_scene *scene, struct glb_builder *builder,
                        const struct closed_form_body *body)
{
    if (is_opaque(body) && body->glows)
        return add_glowing(builder);
    if (is_opaque(body))
        return closed_form_receiver(scene, builder);
    struct glb_material_desc material = {.name = "Medium",
                                         .base_color = {1, 1, 1, 1},
                                         .transmission = 1,
                                         .has_ior = true,
                                         .ior = 1,
                                         .thickness = 1,
                                         .attenuation_distance = (double)body->distance,
                                         .is_double_sided = body->is_double_sided};
    for (int k = 0; k < 3; k++) {
        material.attenuation_color[k] = (double)body->remains[k];
        if (body->filter[0] > 0 || body->filter[1] > 0 || body->filter[2] > 0)
            material.base_color[k] = (double)body->filter[k];
    }
    return glb_builder_add_material(builder, &material);
}

/* The mesh begins at the origin, so that the corner is the node's and exact. */
static void add_body(struct closed_form_scene *scene, struct glb_builder *builder,
                     const struct closed_form_body *body)
{
    struct shape shape = {0};
    double size[3], half = INFINITY;
    for (int k = 0; k < 3; k++) {
        size[k] = body->high[k] - body->low[k];
        half = fmin(half, 0.5 * size[k]);
    }
    double middle[3] = {0.5 * size[0], 0.5 * size[1], 0.5 * size[2]};
    if (body->shape == BODY_BOX)
        shape_add_box(&shape, (double[]){0, 0, 0}, size);
    else if (body->shape == BODY_WEDGE)
        add_wedge(&shape, size);
    else
        shape_add_sphere(&shape, middle, half, 128, 64);
    struct glb_node_desc node = {
        .name = "Body",
        .mesh = shape_give_mesh(&shape, builder, "Body", add_material(scene, builder, body)),
        .translation = {body->low[0], body->low[1], body->low[2]}};
    if (body->is_mirrored) {
        assert(body->shape != BODY_WEDGE);
        node.scale[0] = -1;
        node.scale[1] = node.scale[2] = 1;
        node.translation[0] = body->high[0];
    }
    glb_builder_add_node(builder, &node);
}

void media_scene_build(const struct media_scene_desc *desc, struct closed_form_scene *scene)
{
    static const double none[3][3];
    struct glb_builder *builder = closed_form_begin(scene, "Media", 0);
    scene->light = desc->light;
    if (desc->has_floor)
        closed_form_floor(scene, builder, desc->floor_half > 0 ? desc->floor_half : 4);
    if (memcmp(desc->wall, none, sizeof none) != 0)
        closed_form_quad(builder, "Wall", add_glowing(builder), desc->wall[0], desc->wall[1],
                         desc->wall[2]);
    for (int i = 0; i < desc->count; i++)
        add_body(scene, builder, &desc->bodies[i]);
    if (desc->light.intensity > 0)
        closed_form_add_light(scene, builder);
    closed_form_end(scene, builder);
}
