/* SPDX-License-Identifier: MIT */
/* Frames of lights, and which drawables they meet. */
#include "renderer/shadows/shadow_frame.h"

#include <float.h>

#include "renderer/base/matrix.h"
#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

/* Texels between the outermost caster or cone and the border of the map: room for the taps of the
 * widest tent. */
static const double BORDER_TEXELS = 2;
/* Reversed infinite depth keeps f32's relative precision at any ratio, so near may be very small: a
 * billionth of the scene's unit, and a power of two, so that dividing it rounds nothing. */
static const double NEAR_UNITS = 0x1p-30;
static const double PI = 3.14159265358979323846;
static const double WIDEST_FACE_RAD = 1.0472; /* 60 degrees: beyond it a single face wastes most of
                                                 its texels */

/* Least sine of an angle between two directions that span a plane. */
static const double LEAST_SINE = 1e-3;

/* Texels turn with the node of a light, so that a scene turned as a whole keeps its shadows. Lights
 * that have no `up` take an axis of the world. */
static void set_axes(struct shadow_frame *frame, const double direction[3],
                     const struct state_light *light)
{
    double *x = frame->axis[0], *y = frame->axis[1], *z = frame->axis[2];
    double helper[3] = {light->up[0], light->up[1], light->up[2]};
    memcpy(z, direction, 3 * sizeof *z);
    vec3_cross(helper, z, x);
    if (!(vec3_length(x) > LEAST_SINE * vec3_length(helper))) {
        int least = 0;
        for (int k = 1; k < 3; k++)
            if (fabs(z[k]) < fabs(z[least]))
                least = k;
        memset(helper, 0, sizeof helper);
        helper[least] = 1;
        vec3_cross(helper, z, x);
    }
    vec3_normalize(x);
    vec3_cross(x, z, y); /* then y x x = z */
}

/* Those of the light's node, which looks along its -Z, or the world's. */
static void find_own_axes(const struct state_light *light, double axes[3][3])
{
    double *x = axes[0], *y = axes[1], *z = axes[2];
    vec3_cross(light->direction, light->up, x);
    if (vec3_length(x) > LEAST_SINE * vec3_length(light->up)) {
        vec3_normalize(x);
        for (int k = 0; k < 3; k++)
            z[k] = -light->direction[k];
        vec3_cross(z, x, y);
        return;
    }
    for (int k = 0; k < 3; k++)
        for (int c = 0; c < 3; c++)
            axes[k][c] = k == c;
}

/* Beyond so many radii of what casts, a light is far. Eight: a cube's face, 90 degrees wide, would
 * spend less than an eightieth of its texels on the casters. */
static const double FAR_RADII = 8;
/* And beyond so many, its rays are parallel: over the casters' depth they part by a thousandth of
 * the radius, half a texel of a map of 1024. */
static const double PARALLEL_RADII = 1000;

struct caster_sphere {
    double center[3], radius, distance; /* of its centre from the light */
};

struct caster_set { /* what a frame is made for */
    const struct scene_state *state;
    bool has_grids;
};

static size_t grid_count(const struct caster_set *set)
{
    return set->has_grids ? set->state->grid_count : 0;
}

/* By the box of the primitive's own coordinates, which turns with its node. */
static void grow_interval(const struct scene_state *state, const struct state_item *item,
                          const double axis[3], double interval[2])
{
    const struct state_geometry geometry = state_geometry_of(state, item);
    const struct scene_primitive *p = geometry.primitive;
    const double *world = geometry.world;
    double low = vec3_dot(axis, world + 12), high = low;
    for (int k = 0; k < 3; k++) {
        double along = vec3_dot(axis, world + 4 * k);
        double a = along * (double)p->bounds_min[k], b = along * (double)p->bounds_max[k];
        low += fmin(a, b);
        high += fmax(a, b);
    }
    interval[0] = fmin(interval[0], low);
    interval[1] = fmax(interval[1], high);
}

/* Likewise of a box along the world's axes. */
static void grow_interval_by_box(const double low[3], const double high[3], const double axis[3],
                                 double interval[2])
{
    double middle = 0, half = 0;
    for (int k = 0; k < 3; k++) {
        middle += 0.5 * axis[k] * (low[k] + high[k]);
        half += 0.5 * fabs(axis[k]) * (high[k] - low[k]);
    }
    interval[0] = fmin(interval[0], middle - half);
    interval[1] = fmax(interval[1], middle + half);
}

static void grow_interval_by_grids(const struct caster_set *set, const double axis[3],
                                   double interval[2])
{
    for (size_t i = 0; i < grid_count(set); i++)
        grow_interval_by_box(set->state->grids[i].bounds_min, set->state->grids[i].bounds_max, axis,
                             interval);
}

/* Of the casters' box along the world's axes: where a light is so near, it is not far from their
 * box along any axes, whose radius is at most the root of three smaller. */
static const double NEAR_RADII = 2;

static bool find_world_sphere(const struct state_light *light, const struct caster_set *set,
                              struct caster_sphere *sphere)
{
    const struct scene_state *state = set->state;
    double low[3] = {DBL_MAX, DBL_MAX, DBL_MAX}, high[3] = {-DBL_MAX, -DBL_MAX, -DBL_MAX};
    double diagonal[3], to_center[3];
    for (size_t i = 0; i < state->item_count; i++) {
        const struct state_item *item = &state->items[i];
        for (int k = 0; k < 3 && item->casts_shadow; k++) {
            low[k] = fmin(low[k], item->bounds_min[k]);
            high[k] = fmax(high[k], item->bounds_max[k]);
        }
    }
    for (size_t i = 0; i < grid_count(set); i++)
        for (int k = 0; k < 3; k++) {
            low[k] = fmin(low[k], state->grids[i].bounds_min[k]);
            high[k] = fmax(high[k], state->grids[i].bounds_max[k]);
        }
    vec3_sub(high, low, diagonal);
    sphere->radius = 0.5 * vec3_length(diagonal);
    for (int k = 0; k < 3; k++)
        sphere->center[k] = 0.5 * (low[k] + high[k]);
    vec3_sub(sphere->center, light->position, to_center);
    sphere->distance = vec3_length(to_center);
    return low[0] <= high[0] && sphere->radius > 0;
}

/* Around all casters. Where the light may be far: about their box along the light's own axes, on a
 * grid of a sixteenth of its radius that starts at the light, so that small edits keep the frame
 * and it turns and grows with the scene. */
static bool find_casters(const struct state_light *light, const struct caster_set *set,
                         struct caster_sphere *sphere)
{
    const struct scene_state *state = set->state;
    if (!find_world_sphere(light, set, sphere))
        return false;
    if (sphere->distance < NEAR_RADII * sphere->radius)
        return true;
    double axes[3][3], box[3][2], diagonal[3];
    find_own_axes(light, axes);
    for (int k = 0; k < 3; k++) {
        box[k][0] = DBL_MAX, box[k][1] = -DBL_MAX;
        for (size_t i = 0; i < state->item_count; i++)
            if (state->items[i].casts_shadow)
                grow_interval(state, &state->items[i], axes[k], box[k]);
        grow_interval_by_grids(set, axes[k], box[k]);
        diagonal[k] = box[k][1] - box[k][0];
    }
    double radius = 0.5 * vec3_length(diagonal), unit = state->unit_m;
    double cell = unit * exp2(ceil(log2(radius / unit)) - 4), to_center[3] = {0, 0, 0};
    for (int k = 0; k < 3; k++) {
        double along = 0.5 * (box[k][0] + box[k][1]) - vec3_dot(axes[k], light->position);
        for (int c = 0; c < 3; c++)
            to_center[c] += axes[k][c] * cell * round(along / cell);
    }
    for (int c = 0; c < 3; c++)
        sphere->center[c] = light->position[c] + to_center[c];
    sphere->radius = cell * (ceil(radius / cell) + 1); /* the centre moved by less than a cell */
    sphere->distance = vec3_length(to_center);
    return true;
}

/* One face onto the casters. False where the light is near, or its own cone is narrower. */
static bool init_far(struct shadow_frame *frame, const struct state_light *light,
                     const struct caster_sphere *sphere, int resolution)
{
    if (!(sphere->distance > FAR_RADII * sphere->radius))
        return false;
    double sine = sphere->radius / sphere->distance, direction[3];
    if (light->type == SCENE_LIGHT_SPOT && (double)light->outer_cone_rad <= asin(sine))
        return false;
    vec3_sub(sphere->center, light->position, direction);
    vec3_normalize(direction);
    frame->shape = SHADOW_ONE_FACE;
    frame->face_count = 1;
    set_axes(frame, direction, light);
    double tangent = sine / sqrt(1 - sine * sine);
    frame->scale[0] = frame->scale[1] = 1 / (tangent * (1 + 2 * BORDER_TEXELS / resolution));
    return true;
}

static void init_perspective(struct shadow_frame *frame, const struct state_light *light,
                             const struct caster_sphere *sphere, int resolution)
{
    memcpy(frame->origin, light->position, sizeof frame->origin);
    frame->near_m = NEAR_UNITS * frame->unit_m;
    frame->range_m = (double)light->range;
    memcpy(frame->cone, light->direction, sizeof frame->cone);
    bool is_cone = light->type == SCENE_LIGHT_SPOT || state_light_is_area(light);
    frame->cone_rad = is_cone ? (double)light->outer_cone_rad : PI;
    if (init_far(frame, light, sphere, resolution))
        return;
    if (light->type == SCENE_LIGHT_SPOT && (double)light->outer_cone_rad <= WIDEST_FACE_RAD) {
        frame->shape = SHADOW_ONE_FACE;
        frame->face_count = 1;
        set_axes(frame, light->direction, light);
        double tangent = tan(fmax((double)light->outer_cone_rad, 1e-4));
        frame->scale[0] = frame->scale[1] = 1 / (tangent * (1 + 2 * BORDER_TEXELS / resolution));
    } else {
        frame->shape = SHADOW_CUBE;
        frame->face_count = 6;
        find_own_axes(light, frame->axis);
        frame->scale[0] = frame->scale[1] = 1;
    }
}

static bool init_orthographic(struct shadow_frame *frame, const struct state_light *light,
                              const double direction[3], const struct caster_set *set,
                              int resolution)
{
    const struct scene_state *state = set->state;
    frame->shape = SHADOW_ORTHOGRAPHIC;
    frame->face_count = 1;
    frame->cone_rad = PI;
    set_axes(frame, direction, light);
    double box[3][2] = {{DBL_MAX, -DBL_MAX}, {DBL_MAX, -DBL_MAX}, {DBL_MAX, -DBL_MAX}};
    for (size_t i = 0; i < state->item_count; i++) {
        const struct state_item *item = &state->items[i];
        for (int k = 0; k < 2 && item->casts_shadow; k++)
            grow_interval(state, item, frame->axis[k], box[k]);
        if (!item->is_ground) /* it lies behind all casters that shadow it */
            grow_interval(state, item, frame->axis[2], box[2]);
    }
    for (int k = 0; k < 3; k++)
        grow_interval_by_grids(set, frame->axis[k], box[k]);
    if (box[0][0] > box[0][1])
        return false;
    double depth = fmax(box[2][1] - box[2][0], 0);
    double widest = fmax(fmax(box[0][1] - box[0][0], box[1][1] - box[1][0]), depth);
    double least = fmax(1e-6 * widest, 1e-12); /* a flat scene still has a box */
    double middle[3];
    for (int k = 0; k < 2; k++) {
        double half =
            fmax(0.5 * (box[k][1] - box[k][0]), least) * (1 + 2 * BORDER_TEXELS / resolution);
        frame->scale[k] = 1 / half;
        middle[k] = 0.5 * (box[k][0] + box[k][1]);
    }
    double margin = fmax(1e-3 * depth, least);
    frame->depth_m = depth + 2 * margin;
    middle[2] = box[2][0] - margin;
    for (int k = 0; k < 3; k++)
        frame->origin[k] = middle[0] * frame->axis[0][k] + middle[1] * frame->axis[1][k] +
                           middle[2] * frame->axis[2][k];
    return true;
}

static bool init(struct shadow_frame *frame, const struct state_light *light,
                 const struct caster_set *set, int resolution)
{
    const struct scene_state *state = set->state;
    *frame = (struct shadow_frame){.unit_m = state->unit_m};
    if (state->bounds_min[0] > state->bounds_max[0])
        return false;
    if (light->type == SCENE_LIGHT_DIRECTIONAL)
        return init_orthographic(frame, light, light->direction, set, resolution);
    struct caster_sphere sphere = {0};
    if (!find_casters(light, set, &sphere))
        return false;
    if (sphere.distance > PARALLEL_RADII * sphere.radius) {
        double direction[3];
        vec3_sub(sphere.center, light->position, direction);
        vec3_normalize(direction);
        return init_orthographic(frame, light, direction, set, resolution);
    }
    init_perspective(frame, light, &sphere, resolution);
    return true;
}

bool shadow_frame_init(struct shadow_frame *frame, const struct state_light *light,
                       const struct scene_state *state, int resolution)
{
    return init(frame, light, &(struct caster_set){.state = state}, resolution);
}

bool shadow_frame_init_with_grids(struct shadow_frame *frame, const struct state_light *light,
                                  const struct scene_state *state, int resolution)
{
    return init(frame, light, &(struct caster_set){.state = state, .has_grids = true}, resolution);
}

void shadow_frame_face_turn(const struct shadow_frame *frame, uint32_t face, double rows[3][3])
{
    memset(rows, 0, sizeof frame->axis);
    if (frame->shape != SHADOW_CUBE) {
        rows[0][0] = rows[1][1] = rows[2][2] = 1;
        return;
    }
    uint32_t k = face / 2;
    double s = face % 2 ? -1 : 1;
    rows[0][(k + 1) % 3] = 1;
    rows[1][(k + 2) % 3] = -s;
    rows[2][k] = s;
}

void shadow_frame_face_axes(const struct shadow_frame *frame, uint32_t face, double axes[3][3])
{
    double turn[3][3];
    shadow_frame_face_turn(frame, face, turn);
    for (int row = 0; row < 3; row++)
        for (int c = 0; c < 3; c++)
            axes[row][c] = turn[row][0] * frame->axis[0][c] + turn[row][1] * frame->axis[1][c] +
                           turn[row][2] * frame->axis[2][c];
}

/* Of the distance and the size: far more than f32 positions are off. */
static const double FACE_SLACK = 1e-5;

/* Whether the item's sphere and box both touch the pyramid |x|, |y| <= z / scale. offset: of their
 * common centre. */
static bool pyramid_touches(const struct shadow_frame *frame, const double axes[3][3],
                            const struct state_item *item, const double offset[3], double slack)
{
    for (int side = 0; side < 5; side++) { /* the fifth: before the light */
        double slope = side < 4 ? 1 / frame->scale[side / 2] : 1;
        double outward[3], half = 0;
        for (int c = 0; c < 3; c++) {
            double across = side < 4 ? (side % 2 ? -1 : 1) * axes[side / 2][c] : 0;
            outward[c] = across - slope * axes[2][c];
            half += 0.5 * fabs(outward[c]) * (item->bounds_max[c] - item->bounds_min[c]);
        }
        double length = vec3_length(outward);
        if (vec3_dot(outward, offset) > fmin(half, item->radius_m * length) + slack * length)
            return false;
    }
    return true;
}

/* From the point to the nearest of the item's box. */
static double box_distance(const double point[3], const struct state_item *item)
{
    double nearest[3];
    for (int k = 0; k < 3; k++)
        nearest[k] = fmax(fmax(item->bounds_min[k] - point[k], point[k] - item->bounds_max[k]), 0);
    return vec3_length(nearest);
}

static bool cone_touches(const struct shadow_frame *frame, const struct state_item *item,
                         const double offset[3], double distance)
{
    if (frame->shape != SHADOW_CUBE || frame->cone_rad >= PI || distance <= item->radius_m)
        return true;
    const double slack = 0.1; /* rad; taps reach a little beyond the cone */
    double to_center = acos(fmax(-1, fmin(1, vec3_dot(offset, frame->cone) / distance)));
    return to_center - asin(item->radius_m / distance) <= frame->cone_rad + slack;
}

uint32_t shadow_frame_faces(const struct shadow_frame *frame, const struct state_item *item)
{
    double offset[3];
    vec3_sub(item->center, frame->origin, offset);
    double distance = vec3_length(offset);
    if (frame->shape == SHADOW_ORTHOGRAPHIC)
        return 1; /* the box holds every caster */
    double slack = FACE_SLACK * (distance + item->radius_m);
    if (frame->range_m > 0 && box_distance(frame->origin, item) > frame->range_m + slack)
        return 0;
    if (!cone_touches(frame, item, offset, distance))
        return 0;
    uint32_t faces = 0;
    for (uint32_t face = 0; face < frame->face_count; face++) {
        double axes[3][3];
        shadow_frame_face_axes(frame, face, axes);
        if (pyramid_touches(frame, axes, item, offset, slack))
            faces |= 1u << face;
    }
    return faces;
}
