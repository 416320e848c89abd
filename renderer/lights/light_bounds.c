/* SPDX-License-Identifier: MIT */
/* Bounds of lights in view space, and where a widened line of sight meets them. */
#include "renderer/lights/light_bounds.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/matrix.h"

/* A f32 cosine of two unit vectors is wrong by some 4 ulp; near the axis that is 1.4e-3 rad of
 * angle. */
static const double COSINE_SLACK = 1e-6;
/* 60 ulp of f32: eye-relative light and surface positions, each through a dozen roundings. */
static const double POSITION_SLACK = 4e-6;
static const double SPHERE_SLACK = 1e-5; /* of the range: keeps discriminants above rounding */
static const double CONE_SLACK = 1e-4; /* of the range: keeps slopes of narrow cones above theirs */

static void to_view(const struct camera *camera, const double world[3], double view[3])
{
    view[0] = vec3_dot(camera->right, world);
    view[1] = vec3_dot(camera->up, world);
    view[2] = -vec3_dot(camera->back, world);
}

static bool is_bounded(const struct state_light *light)
{
    return light->type != SCENE_LIGHT_DIRECTIONAL && light->range > 0 && isfinite(light->range);
}

/* Smallest sphere around a spherical sector: through apex and rim up to 45 degrees, else on the
 * rim's disc. */
static void bound_sector(struct light_bound *bound)
{
    double along = bound->cos_outer > M_SQRT1_2 ? bound->range_m / (2 * bound->cos_outer)
                                                : bound->range_m * bound->cos_outer;
    bound->radius_m = bound->cos_outer > M_SQRT1_2 ? along : bound->range_m * bound->sin_outer;
    for (int i = 0; i < 3; i++)
        bound->center[i] = bound->apex[i] + bound->axis[i] * along;
}

static struct light_bound bound_light(const struct state_light *light, uint32_t index,
                                      const struct camera *camera)
{
    struct light_bound bound = {.light = index, .range_m = light->range, .radius_m = light->range};
    double relative[3];
    vec3_sub(light->position, camera->eye, relative);
    to_view(camera, relative, bound.apex);
    to_view(camera, light->direction, bound.axis);
    memcpy(bound.center, bound.apex, sizeof bound.center);
    double cos_outer = cos((double)light->outer_cone_rad) - COSINE_SLACK;
    bound.is_cone = light->type == SCENE_LIGHT_SPOT && cos_outer >= 0;
    bound.slack_m = (bound.is_cone ? CONE_SLACK : SPHERE_SLACK) * bound.range_m +
                    POSITION_SLACK * vec3_length(bound.apex);
    if (bound.is_cone) {
        bound.cos_outer = cos_outer;
        bound.sin_outer = sqrt(1 - cos_outer * cos_outer);
        bound_sector(&bound);
    }
    bound.radius_m += bound.slack_m;
    double forward[3] = {0, 0, 1}, backward[3] = {0, 0, -1};
    bound.z_hi = light_bound_support(&bound, forward);
    bound.z_lo = -light_bound_support(&bound, backward);
    if (!camera->is_orthographic)
        bound.z_lo = fmax(bound.z_lo, 0);
    return bound;
}

static bool reserve(struct light_bounds *bounds, size_t count, struct error *err)
{
    bounds->count = bounds->global_count = 0;
    if (count <= bounds->capacity)
        return true;
    light_bounds_finish(bounds);
    bounds->items = calloc(count, sizeof *bounds->items);
    bounds->global = calloc(count, sizeof *bounds->global);
    if (!bounds->items || !bounds->global) {
        light_bounds_finish(bounds);
        return error_set(err, ERROR_NO_MEMORY, "bounds of %zu lights", count);
    }
    bounds->capacity = count;
    return true;
}

bool light_bounds_collect(struct light_bounds *bounds, const struct state_light *lights,
                          size_t light_count, const struct camera *camera, struct error *err)
{
    if (!reserve(bounds, light_count, err))
        return false;
    for (size_t i = 0; i < light_count; i++) {
        struct light_bound bound = {0};
        bool is_global = !is_bounded(&lights[i]);
        if (!is_global) {
            bound = bound_light(&lights[i], (uint32_t)i, camera);
            /* what arithmetic cannot place is left to the shading itself */
            is_global = !isfinite(bound.radius_m + bound.z_lo + bound.z_hi + bound.center[0] +
                                  bound.center[1]);
        }
        if (is_global)
            bounds->global[bounds->global_count++] = (uint32_t)i;
        else if (camera->is_orthographic || bound.z_hi > 0)
            bounds->items[bounds->count++] = bound;
    }
    return true;
}

void light_bounds_finish(struct light_bounds *bounds)
{
    free(bounds->items);
    free(bounds->global);
    *bounds = (struct light_bounds){0};
}

/* A sector's farthest point is the pole of its cap, a point of the rim, or the apex. */
double light_bound_support(const struct light_bound *bound, const double unit[3])
{
    double sphere = vec3_dot(bound->center, unit) + bound->radius_m;
    if (!bound->is_cone)
        return sphere;
    double cos_phi = fmin(fmax(vec3_dot(bound->axis, unit), -1), 1);
    double reach = cos_phi >= bound->cos_outer ? 1
                                               : cos_phi * bound->cos_outer +
                                                     sqrt(1 - cos_phi * cos_phi) * bound->sin_outer;
    double sector = vec3_dot(bound->apex, unit) + bound->range_m * fmax(reach, 0) + bound->slack_m;
    return fmin(sphere, sector);
}

/* |p(z) - center| <= radius + spread(z) is a quadratic in z; it is solved about the point of
 * closest approach, where nothing large cancels. */
static bool sphere_interval(const struct light_bound *bound, const struct view_ray *ray,
                            double *front, double *back)
{
    double q[3] = {ray->slope[0], ray->slope[1], 1};
    double to_center[3] = {bound->center[0] - ray->origin[0], bound->center[1] - ray->origin[1],
                           bound->center[2]};
    double qq = vec3_dot(q, q), w1 = ray->spread_per_m;
    double a = qq - w1 * w1;
    if (a < 0.25 * qq) /* a block so wide that it is no beam: keep the light's own depths */
        return true;
    double z = vec3_dot(q, to_center) / qq;
    double m[3] = {z * q[0] - to_center[0], z * q[1] - to_center[1], z - to_center[2]};
    double rho = bound->radius_m + ray->spread_m + w1 * z;
    double discriminant = rho * rho * w1 * w1 + a * (rho * rho - vec3_dot(m, m));
    if (discriminant < 0)
        return false;
    double root = sqrt(discriminant);
    *front = fmax(*front, z + (rho * w1 - root) / a);
    *back = fmin(*back, z + (rho * w1 + root) / a);
    return *front <= *back;
}

/* The gap g(u) = cos * sqrt(a u^2 + 2 b u + c) - d - e u along a line, u = z - apex z: a lower
 * bound of the distance to the cone, less what the block allows. Convex, being the norm of an
 * affine function plus an affine function. */
struct cone_line {
    double a, b, c, d, e, cos_outer;
};

static struct cone_line place_line(const struct light_bound *bound, const struct view_ray *ray)
{
    double q[3] = {ray->slope[0], ray->slope[1], 1};
    double v[3] = {ray->origin[0] + bound->apex[2] * q[0] - bound->apex[0],
                   ray->origin[1] + bound->apex[2] * q[1] - bound->apex[1], 0};
    double v_axial = vec3_dot(v, bound->axis), q_axial = vec3_dot(q, bound->axis);
    return (struct cone_line){
        .a = vec3_dot(q, q) - q_axial * q_axial,
        .b = vec3_dot(v, q) - v_axial * q_axial,
        .c = vec3_dot(v, v) - v_axial * v_axial,
        .d = bound->sin_outer * v_axial + ray->spread_m + bound->apex[2] * ray->spread_per_m +
             bound->slack_m,
        .e = bound->sin_outer * q_axial + ray->spread_per_m,
        .cos_outer = bound->cos_outer,
    };
}

static double cone_gap(const struct cone_line *line, double u, double *slope)
{
    double square = (line->a * u + 2 * line->b) * u + line->c;
    double rho = square > 0 ? sqrt(square) : 0;
    double rho_slope = rho > 0 ? (line->a * u + line->b) / rho : 0;
    *slope = line->cos_outer * rho_slope - line->e;
    return line->cos_outer * rho - line->d - line->e * u;
}

/* Newton's method from outside never passes the root of a convex function, so stopping early is
 * still conservative. */
static bool cone_interval(const struct light_bound *bound, const struct view_ray *ray,
                          double *front, double *back)
{
    enum { STEPS = 3 }; /* chosen: a fourth moves the ends by less than a slice */
    const struct cone_line line = place_line(bound, ray);
    double z = bound->apex[2], low = *front - z, high = *back - z, slope;
    for (int i = 0; i < STEPS; i++) {
        double gap = cone_gap(&line, low, &slope);
        if (gap <= 0)
            break;
        if (slope >= 0)
            return false;
        low -= gap / slope;
        if (low > high)
            return false;
    }
    for (int i = 0; i < STEPS; i++) {
        double gap = cone_gap(&line, high, &slope);
        if (gap <= 0)
            break;
        if (slope <= 0)
            return false;
        high -= gap / slope;
        if (high < low)
            return false;
    }
    *front = low + z;
    *back = high + z;
    return true;
}

bool light_bound_interval(const struct light_bound *bound, const struct view_ray *ray,
                          double *front, double *back)
{
    *front = bound->z_lo;
    *back = bound->z_hi;
    if (!sphere_interval(bound, ray, front, back))
        return false;
    return !bound->is_cone || cone_interval(bound, ray, front, back);
}
