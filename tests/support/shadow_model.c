/* SPDX-License-Identifier: MIT */
/* What a deep shadow map must answer, computed from its definition in f64: taps at texel centres,
 * receiver-plane depth, and the product of all panes in front. Shares nothing with the shaders but
 * the light's frame. */
#include <math.h>
#include <string.h>

#include "renderer/base/matrix.h"
#include "shaders/shared/layout.h"
#include "tests/support/shadow_rig.h"

#include "shaders/shared/records.h"

/* How near to a decision the model declines to answer: of depths and borders; of panes' edges,
 * which rasterisers round to 1/256 of a texel. */
static const double HAIR = 1e-4, EDGE_HAIR = 6e-3;
/* Texel widths by which vertices are snapped, as shadow_query.glsl allows for. */
static const double SNAPPING = 0.75 / 256;

struct ray {
    double origin[3], direction[3];
}; /* parameter = depth along the face's z */
struct reach {
    double depth, rounding;
}; /* of the receiver along a ray */

/* Where the line is inside a box or a ball: parameters of entering and leaving. False when it
 * passes by. */
static bool solid_interval(const struct pane *pane, const struct ray *ray, double interval[2])
{
    const double *axes[3] = {pane->u, pane->v, pane->w};
    double o[3], d[3], offset[3], inverse[3];
    vec3_sub(ray->origin, pane->center, offset);
    for (int k = 0; k < 3; k++) { /* in the solid's own axes, which need not be right-angled */
        vec3_cross(axes[(k + 1) % 3], axes[(k + 2) % 3], inverse);
        double volume = vec3_dot(axes[k], inverse);
        o[k] = vec3_dot(offset, inverse) / volume;
        d[k] = vec3_dot(ray->direction, inverse) / volume;
    }
    interval[0] = -INFINITY;
    interval[1] = INFINITY;
    if (pane->shape == PANE_BALL) {
        double a = vec3_dot(d, d), b = vec3_dot(o, d), c = vec3_dot(o, o) - 1;
        double root = sqrt(fmax(b * b - a * c, 0));
        interval[0] = (-b - root) / a;
        interval[1] = (-b + root) / a;
        return b * b > a * c;
    }
    for (int k = 0; k < 3; k++) {
        double near = (-copysign(1, d[k]) - o[k]) / d[k], far = (copysign(1, d[k]) - o[k]) / d[k];
        interval[0] = fmax(interval[0], near);
        interval[1] = fmin(interval[1], far);
    }
    return interval[0] < interval[1];
}

/* Multiplies by what the medium leaves of the light that comes to depth. */
static void cross_medium(const struct shadow_rig *rig, uint32_t index, const struct ray *ray,
                         const struct reach *reach, double out[3], bool *is_clear)
{
    const struct pane *pane = &rig->panes->panes[index];
    double t[2], metres = vec3_length(ray->direction);
    bool filters = pane->color[0] < 1 || pane->color[1] < 1 || pane->color[2] < 1;
    if (!solid_interval(pane, ray, t))
        return;
    for (int i = 0; filters && i < 2; i++)
        if (fabs(t[i] - reach->depth) < reach->rounding)
            *is_clear = false;
    if ((t[1] - t[0]) * metres < 0.05 * vec3_length(pane->u))
        *is_clear = false; /* a silhouette */
    double length = fmax(fmin(t[1], reach->depth) - fmax(t[0], 0), 0) * metres;
    int crossings = (t[0] > 0 && t[0] < reach->depth) + (t[1] > 0 && t[1] < reach->depth);
    for (int k = 0; k < 3; k++)
        out[k] *= pow((double)pane->color[k], crossings) *
                  exp(-rig->state.materials[index].sigma[k] * length);
}

/* Whether the ray meets the pane before depth; false in *is_clear when that hangs by a hair. */
static bool pane_is_before(const struct pane *pane, const struct ray *ray,
                           const struct reach *reach, double *n_dot_l, bool *is_clear)
{
    double n[3], offset[3], hit[3];
    vec3_cross(pane->u, pane->v, n);
    vec3_normalize(n);
    vec3_sub(pane->center, ray->origin, offset);
    double slope = vec3_dot(n, ray->direction);
    if (fabs(slope) < 1e-9)
        return false; /* edge on */
    double t = vec3_dot(n, offset) / slope;
    for (int k = 0; k < 3; k++)
        hit[k] = ray->origin[k] + t * ray->direction[k] - pane->center[k];
    double a = vec3_dot(hit, pane->u) / vec3_dot(pane->u, pane->u);
    double b = vec3_dot(hit, pane->v) / vec3_dot(pane->v, pane->v);
    double outside = fmax(fabs(a), fabs(b)) - 1;
    if (t <= 0 || outside > EDGE_HAIR)
        return false;
    if (outside > -EDGE_HAIR || fabs(t - reach->depth) < reach->rounding)
        *is_clear = false;
    *n_dot_l = fabs(slope) / vec3_length(ray->direction);
    return t < reach->depth;
}

static bool tap_model(const struct shadow_rig *rig, const struct ray *ray,
                      const struct reach *reach, double out[3])
{
    bool is_clear = true;
    out[0] = out[1] = out[2] = 1;
    for (uint32_t i = 0; i < rig->panes->count; i++) {
        const struct pane *pane = &rig->panes->panes[i];
        double cosine = 1;
        if (pane->shape != PANE_FLAT) {
            cross_medium(rig, i, ray, reach, out, &is_clear);
            continue;
        }
        if (!pane_is_before(pane, ray, reach, &cosine, &is_clear))
            continue;
        for (int k = 0; k < 3; k++) {
            double t = pane->is_opaque ? 0 : (double)pane->color[k];
            out[k] *= pane->pass_through == SCENE_PASS_SLAB ? pow(t, 1 / fmax(cosine, 1e-6)) : t;
        }
    }
    return is_clear;
}

static void to_face(double axes[3][3], const double v[3], double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = vec3_dot(axes[k], v);
}

static uint32_t cube_face(const double v[3])
{
    int k = 0;
    for (int c = 1; c < 3; c++)
        if (fabs(v[c]) > fabs(v[k]))
            k = c;
    return (uint32_t)(2 * k + (v[k] < 0));
}

/* The ray through a texel's centre, in world space; a texel beyond the border of a cube's face is
 * that of its neighbour. */
static void texel_ray(const struct shadow_frame *frame, uint32_t face, double x, double y,
                      int resolution, struct ray *ray)
{
    double axes[3][3];
    double size = (double)resolution, ndc[2] = {(x + 0.5) * 2 / size - 1, (y + 0.5) * 2 / size - 1};
    shadow_frame_face_axes(frame, face, axes);
    bool is_off = fabs(ndc[0]) > 1 || fabs(ndc[1]) > 1;
    if (is_off && frame->shape == SHADOW_CUBE) {
        double v[3], f[3];
        for (int k = 0; k < 3; k++)
            v[k] = ndc[0] * axes[0][k] + ndc[1] * axes[1][k] + axes[2][k];
        face = cube_face(v);
        shadow_frame_face_axes(frame, face, axes);
        to_face(axes, v, f);
        for (int k = 0; k < 2; k++)
            ndc[k] = (fmin(floor((f[k] / f[2] * 0.5 + 0.5) * size), size - 1) + 0.5) * 2 / size - 1;
    }
    for (int k = 0; k < 2; k++)
        ndc[k] = fmax(-1 + 1 / size, fmin(1 - 1 / size, ndc[k]));
    bool is_flat = frame->shape == SHADOW_ORTHOGRAPHIC;
    for (int k = 0; k < 3; k++) {
        double aside =
            ndc[0] / frame->scale[0] * axes[0][k] + ndc[1] / frame->scale[1] * axes[1][k];
        ray->origin[k] = frame->origin[k] + (is_flat ? aside : 0);
        ray->direction[k] = axes[2][k] + (is_flat ? 0 : aside);
    }
}

/* False where the plane is met so late or so flatly that the depth is clamped or uncertain. */
static bool plane_reach(const struct shadow_frame *frame, const struct ray *ray, int resolution,
                        const double point[3], const double normal[3], struct reach *reach)
{
    double offset[3];
    vec3_sub(point, ray->origin, offset);
    bool is_flat = frame->shape == SHADOW_ORTHOGRAPHIC;
    double length = vec3_length(ray->direction), slope = vec3_dot(normal, ray->direction);
    double steepness = fmin(vec3_length(normal) * length / fmax(fabs(slope), 1e-9), 50);
    reach->depth = vec3_dot(normal, offset) / slope;
    reach->rounding = HAIR * steepness * (is_flat ? frame->depth_m : fabs(reach->depth));
    double texel = 2 * (is_flat ? 1 : vec3_length(offset)) /
                   (resolution * fmin(frame->scale[0], frame->scale[1]));
    reach->rounding += SNAPPING * texel * 1.42 * sqrt(fmax(steepness * steepness - 1, 0));
    if (steepness >= 50)
        return false;
    if (is_flat)
        return fabs(reach->depth - vec3_dot(offset, ray->direction)) < 0.99 * frame->depth_m;
    return reach->depth > 0 && reach->depth < 1.9 * vec3_length(offset) / length;
}

static int tap_side(int taps)
{
    return taps >= 64 ? 8 : taps >= 16 ? 4 : taps >= 9 ? 3 : taps >= 4 ? 2 : 1;
}

bool shadow_rig_model(const struct shadow_rig *rig, uint32_t light, const double point[3],
                      const double normal[3], double out[3])
{
    struct shadow_frame frame;
    int resolution = rig->quality.shadow_resolution, side = tap_side(rig->quality.shadow_taps);
    out[0] = out[1] = out[2] = 1;
    if (!shadow_frame_init(&frame, &rig->state.lights[light], &rig->state, resolution))
        return true;
    double axes[3][3], offset[3], f[3], c[2], first[2];
    vec3_sub(point, frame.origin, offset);
    uint32_t face = frame.shape == SHADOW_CUBE ? cube_face(offset) : 0;
    shadow_frame_face_axes(&frame, face, axes);
    to_face(axes, offset, f);
    bool is_clear = true;
    for (int k = 0; k < 2; k++) {
        double ndc = frame.shape == SHADOW_ORTHOGRAPHIC ? f[k] * frame.scale[k]
                                                        : f[k] * frame.scale[k] / f[2];
        if (fabs(ndc) > 1 - HAIR)
            return false;
        c[k] = (ndc * 0.5 + 0.5) * resolution;
        first[k] = floor(c[k] - 0.5 * (side - 1));
        double from_edge = fabs(c[k] - 0.5 * (side - 1) - round(c[k] - 0.5 * (side - 1)));
        is_clear = is_clear && from_edge > 0.01; /* f32 may choose the neighbour */
    }
    double sum[3] = {0, 0, 0}, weights = 0;
    for (int i = 0; i < side * side; i++) {
        double x = first[0] + i % side, y = first[1] + i / side, t[3];
        double weight =
            side == 1 ? 1
                      : (0.5 * side - fabs(x + 0.5 - c[0])) * (0.5 * side - fabs(y + 0.5 - c[1]));
        struct ray ray;
        struct reach reach;
        texel_ray(&frame, face, x, y, resolution, &ray);
        is_clear = plane_reach(&frame, &ray, resolution, point, normal, &reach) && is_clear;
        is_clear = tap_model(rig, &ray, &reach, t) && is_clear;
        for (int k = 0; k < 3; k++)
            sum[k] += weight * t[k];
        weights += weight;
    }
    for (int k = 0; k < 3; k++)
        out[k] = sum[k] / weights;
    return is_clear;
}
