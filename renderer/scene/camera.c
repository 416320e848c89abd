/* SPDX-License-Identifier: MIT */
/* Resolution of a view's camera into eye, axes and projection. */
#include "renderer/scene/camera.h"

#include <assert.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"

static const double degree = 0.017453292519943295;
enum { DEFAULT_FOV_Y_DEG = 45 };

struct bounds_sphere {
    double center[3], radius;
};

/* Around the bounding box: what a fitted camera looks at. */
static struct bounds_sphere box_sphere(const struct scene_state *state)
{
    struct bounds_sphere sphere = {.radius = 1};
    double diagonal[3];
    if (!(state->bounds_min[0] <= state->bounds_max[0]))
        return sphere; /* nothing visible: a unit sphere at the origin */
    vec3_sub(state->bounds_max, state->bounds_min, diagonal);
    for (int k = 0; k < 3; k++)
        sphere.center[k] = 0.5 * (state->bounds_min[k] + state->bounds_max[k]);
    double radius = 0.5 * vec3_length(diagonal);
    sphere.radius = radius > 0 ? radius : 1;
    return sphere;
}

/* Around the items' spheres, but that of the ground, about the mean of their middles: turns with
 * the scene. */
static struct bounds_sphere scene_sphere(const struct scene_state *state)
{
    struct bounds_sphere sphere = {0};
    const size_t count = state->item_count - state->ground_plane.is_there; /* it is the last */
    for (size_t i = 0; i < count; i++)
        for (int k = 0; k < 3; k++)
            sphere.center[k] += state->items[i].center[k] / (double)count;
    for (size_t i = 0; i < count; i++) {
        double offset[3];
        vec3_sub(state->items[i].center, sphere.center, offset);
        sphere.radius = fmax(sphere.radius, vec3_length(offset) + state->items[i].radius_m);
    }
    if (!(sphere.radius > 0))
        sphere.radius = 1;
    return sphere;
}

static bool set_axes(struct camera *camera, const double forward[3], const double up[3],
                     struct error *err)
{
    double unit_up[3] = {up[0], up[1], up[2]};
    for (int k = 0; k < 3; k++)
        camera->back[k] = -forward[k];
    if (!vec3_normalize(camera->back) || !vec3_normalize(unit_up))
        return error_set(err, ERROR_INVALID_REQUEST, "the camera looks nowhere: eye equals target");
    vec3_cross(unit_up, camera->back, camera->right);
    if (vec3_length(camera->right) < 1e-9 || !vec3_normalize(camera->right))
        return error_set(err, ERROR_INVALID_REQUEST, "the camera's up is parallel to its view");
    vec3_cross(camera->back, camera->right, camera->up);
    return true;
}

static void set_perspective(struct camera *camera, double fov_y_deg, double aspect)
{
    camera->half_height = tan(0.5 * (fov_y_deg > 0 ? fov_y_deg : DEFAULT_FOV_Y_DEG) * degree);
    camera->half_width = camera->half_height * aspect;
}

/* All that a camera of a file shows is in the image: one that is narrower than the file's aspect
 * (width over height; 0: that of the image) shows more above and below. */
static void keep_width(struct camera *camera, double file_aspect, double aspect)
{
    if (file_aspect <= aspect)
        return;
    camera->half_width = camera->half_height * file_aspect;
    camera->half_height = camera->half_width / aspect;
}

/* From the point to the farthest pair of planes of the item's box in its own axes that it lies
 * outside of: no more than the distance to the item, and at least that over the root of three where
 * the axes are at right angles. 0 inside. */
static double distance_to_item(const struct scene_state *state, const struct state_item *item,
                               const double point[3])
{
    const struct state_geometry geometry = state_geometry_of(state, item);
    const struct scene_primitive *p = geometry.primitive;
    const double *world = geometry.world;
    double offset[3], distance;
    vec3_sub(point, item->center, offset);
    distance = fmax(vec3_length(offset) - item->radius_m, 0);
    for (int k = 0; k < 3; k++) {
        double normal[3];
        double half = 0.5 * ((double)p->bounds_max[k] - (double)p->bounds_min[k]);
        vec3_cross(world + 4 * ((k + 1) % 3), world + 4 * ((k + 2) % 3), normal);
        if (vec3_normalize(normal))
            distance = fmax(distance, fabs(vec3_dot(normal, offset)) -
                                          half * fabs(vec3_dot(normal, world + 4 * k)));
    }
    return distance;
}

/* Clip depth that keeps the ratio of near to far moderate, so that depths interpolated across large
 * triangles keep their precision; relative to the scene, never in absolute metres. Where something
 * is nearer than that it decides; of things around the eye, the largest. Turns with the scene. A
 * power of two in the scene's unit, so that dividing it rounds every depth alike, wherever it is.
 */
static double choose_near(const struct camera *camera, const struct scene_state *state,
                          const struct bounds_sphere *sphere, double outside)
{
    const double share = 2e-4, least = 1e-10; /* of a radius */
    double near = fmax(share * sphere->radius, 0.25 * outside), around = 0;
    for (size_t i = 0; i < state->item_count; i++) {
        const struct state_item *item = &state->items[i];
        double offset[3];
        vec3_sub(camera->eye, item->center, offset);
        if (vec3_length(offset) - item->radius_m > 2 * near)
            continue;
        double distance = distance_to_item(state, item, camera->eye);
        if (distance > 0)
            near = fmin(near, 0.5 * distance);
        else
            around = fmax(around, item->radius_m);
    }
    if (around > 0)
        near = fmin(near, share * around);
    near = fmax(near, least * sphere->radius);
    return state->unit_m * exp2(floor(log2(near / state->unit_m)));
}

/* Nothing behind the eye. */
static void set_orthographic_depths(struct camera *camera, const struct scene_state *state,
                                    const struct bounds_sphere *sphere, double along)
{
    const struct state_ground_plane *ground = &state->ground_plane;
    double near = along - sphere->radius * 1.001, far = along + sphere->radius * 1.001;
    if (ground->is_there) {
        double to_ground[3], reach = 1.001 * M_SQRT2 * ground->reach_m;
        vec3_sub(ground->center, camera->eye, to_ground);
        double along_ground = -vec3_dot(to_ground, camera->back);
        near = fmin(near, along_ground - reach);
        far = fmax(far, along_ground + reach);
    }
    camera->z_near = fmax(near, 0);
    camera->z_far = fmax(far, camera->z_near + sphere->radius);
}

static void set_clip_depths(struct camera *camera, const struct scene_state *state,
                            const struct bounds_sphere *sphere)
{
    double to_center[3];
    vec3_sub(sphere->center, camera->eye, to_center);
    double distance = vec3_length(to_center);
    if (camera->is_orthographic) {
        set_orthographic_depths(camera, state, sphere, -vec3_dot(to_center, camera->back));
        return;
    }
    camera->z_near = choose_near(camera, state, sphere, distance - sphere->radius);
}

static bool resolve_matrix(struct camera *camera, const double m[16], struct error *err)
{
    double forward[3] = {-m[8], -m[9], -m[10]}, up[3] = {m[4], m[5], m[6]};
    for (int k = 0; k < 16; k++)
        if (!isfinite(m[k]))
            return error_set(err, ERROR_INVALID_REQUEST, "the camera's matrix is not finite");
    memcpy(camera->eye, m + 12, sizeof camera->eye);
    return set_axes(camera, forward, up, err);
}

static bool resolve_node(struct camera *camera, const struct view *view,
                         const struct scene_state *state, int32_t node, double aspect,
                         struct error *err)
{
    const struct scene *scene = state->scene;
    if (scene->nodes[node].camera < 0)
        return error_set_at(err, ERROR_NOT_FOUND, "/camera/node", "node '%s' carries no camera",
                            scene->strings + scene->nodes[node].name);
    const struct scene_camera *cameras = state->cameras ? state->cameras : scene->cameras;
    const struct scene_camera *source = &cameras[scene->nodes[node].camera];
    if (!resolve_matrix(camera, state->world[node], err))
        return false;
    if (source->is_orthographic && view->camera.fov_y_deg <= 0) {
        camera->is_orthographic = true;
        camera->half_height = (double)source->y_mag;
        camera->half_width = camera->half_height * aspect;
        keep_width(camera, (double)source->x_mag / (double)source->y_mag, aspect);
    } else if (view->camera.fov_y_deg > 0) {
        set_perspective(camera, view->camera.fov_y_deg, aspect);
    } else {
        set_perspective(camera, (double)source->y_fov_rad / degree, aspect);
        keep_width(camera, (double)source->aspect, aspect);
    }
    struct bounds_sphere sphere = scene_sphere(state);
    set_clip_depths(camera, state, &sphere);
    if (source->z_near > 0)
        camera->z_near = fmax(camera->z_near, (double)source->z_near);
    if (camera->is_orthographic && source->z_far > 0)
        camera->z_far = fmin(camera->z_far, (double)source->z_far);
    if (camera->is_orthographic && camera->z_far <= camera->z_near)
        camera->z_far = camera->z_near + 1e-3 * sphere.radius; /* it misses the scene */
    return true;
}

/* The image against the box, projected. Of a three-quarter view the box fills nine tenths, and what
 * is in it about 80 %, by a lens that is longer than the default one. */
static const double FIT_MARGIN = 1.02, THREE_QUARTER_MARGIN = 1.1;
enum { THREE_QUARTER_FOV_Y_DEG = 30 };

/* Fits the height of the picture to the bounding box, seen along the camera's axes. */
static void fit_orthographic(struct camera *camera, const double half[3], double aspect,
                             double margin)
{
    double half_x = 0, half_y = 0;
    for (int k = 0; k < 3; k++) {
        half_x += half[k] * fabs(camera->right[k]);
        half_y += half[k] * fabs(camera->up[k]);
    }
    double height = fmax(half_y, half_x / aspect);
    camera->is_orthographic = true;
    camera->half_height = height > 0 ? margin * height : 1;
    camera->half_width = camera->half_height * aspect;
}

/* The least distance from the middle of the bounding box at which each of its corners is projected
 * into the image. */
static double fit_distance(const struct camera *camera, const double half[3], double margin)
{
    double distance = 0;
    for (int corner = 0; corner < 8; corner++) {
        double offset[3];
        for (int k = 0; k < 3; k++)
            offset[k] = corner >> k & 1 ? half[k] : -half[k];
        double across = fmax(fabs(vec3_dot(camera->right, offset)) / camera->half_width,
                             fabs(vec3_dot(camera->up, offset)) / camera->half_height);
        distance = fmax(distance, vec3_dot(camera->back, offset) + margin * across);
    }
    return distance;
}

static bool resolve_fit(struct camera *camera, const struct view *view,
                        const struct scene_state *state, double aspect, struct error *err)
{
    static const double directions[][3] = {
        {0, 0, -1}, {0, -1, 0}, {-1, 0, 0}, {-1, -0.7, -1},
        {0, 0, 1},  {1, 0, 0},  {0, 1, 0},  {-0.539, -0.342, -0.770} /* 35 deg aside, 20 above */};
    static const double ups[][3] = {{0, 1, 0}, {0, 0, -1}, {0, 1, 0}, {0, 1, 0},
                                    {0, 1, 0}, {0, 1, 0},  {0, 0, 1}, {0, 1, 0}};
    int fit = view->camera.kind == VIEW_CAMERA_FIT ? (int)view->camera.fit : VIEW_FIT_FRONT;
    struct bounds_sphere box = box_sphere(state), sphere = scene_sphere(state);
    if (!set_axes(camera, directions[fit], ups[fit], err))
        return false;
    bool is_three_quarter = fit == VIEW_FIT_THREE_QUARTER;
    double margin = is_three_quarter ? THREE_QUARTER_MARGIN : FIT_MARGIN;
    double fov_y_deg = view->camera.fov_y_deg;
    set_perspective(
        camera, is_three_quarter && fov_y_deg <= 0 ? THREE_QUARTER_FOV_Y_DEG : fov_y_deg, aspect);
    double half[3];
    for (int k = 0; k < 3; k++)
        half[k] = fmax(0.5 * (state->bounds_max[k] - state->bounds_min[k]), 0);
    bool is_point = !(vec3_length(half) > 0); /* or nothing: the unit sphere */
    double distance = is_point ? margin / sin(atan(fmin(camera->half_height, camera->half_width)))
                               : fit_distance(camera, half, margin);
    for (int k = 0; k < 3; k++)
        camera->eye[k] = box.center[k] + camera->back[k] * distance;
    if (view->camera.kind == VIEW_CAMERA_FIT && view->camera.is_orthographic)
        fit_orthographic(camera, half, aspect, margin);
    set_clip_depths(camera, state, &sphere);
    return true;
}

static bool resolve_kind(struct camera *camera, const struct view *view,
                         const struct scene_state *state, double aspect, struct error *err)
{
    const struct view_camera *source = &view->camera;
    int32_t node = state->scene->header ? state->scene->header->default_camera_node : -1;
    static const double world_up[3] = {0, 1, 0};
    double forward[3];
    switch (source->kind) {
    case VIEW_CAMERA_NODE:
        node = scene_find_node(state->scene, source->node);
        if (node < 0)
            return error_set_at(err, ERROR_NOT_FOUND, "/camera/node", "the scene has no node '%s'",
                                source->node);
        return resolve_node(camera, view, state, node, aspect, err);
    case VIEW_CAMERA_LOOK_AT:
        memcpy(camera->eye, source->eye, sizeof camera->eye);
        vec3_sub(source->target, source->eye, forward);
        set_perspective(camera, source->fov_y_deg, aspect);
        return set_axes(camera, forward, vec3_length(source->up) > 0 ? source->up : world_up, err);
    case VIEW_CAMERA_MATRIX:
        set_perspective(camera, source->fov_y_deg, aspect);
        return resolve_matrix(camera, source->matrix, err);
    case VIEW_CAMERA_FIT:
        return resolve_fit(camera, view, state, aspect, err);
    case VIEW_CAMERA_DEFAULT:
        break;
    }
    return node >= 0 ? resolve_node(camera, view, state, node, aspect, err)
                     : resolve_fit(camera, view, state, aspect, err);
}

bool camera_resolve(struct camera *camera, const struct view *view, const struct scene_state *state,
                    struct error *err)
{
    double aspect = (double)view->width_px / view->height_px;
    *camera = (struct camera){0};
    if (!resolve_kind(camera, view, state, aspect, err))
        return false;
    struct bounds_sphere sphere = scene_sphere(state);
    if (view->camera.ortho_height > 0) {
        camera->is_orthographic = true;
        camera->half_height = 0.5 * view->camera.ortho_height;
        camera->half_width = camera->half_height * aspect;
        set_clip_depths(camera, state, &sphere);
    } else if (camera->z_near <= 0 && !camera->is_orthographic) {
        set_clip_depths(camera, state, &sphere);
    }
    return true;
}

void camera_to_view(const struct camera *camera, const double world[3], double view[3])
{
    double from_eye[3];
    vec3_sub(world, camera->eye, from_eye);
    view[0] = vec3_dot(from_eye, camera->right);
    view[1] = vec3_dot(from_eye, camera->up);
    view[2] = -vec3_dot(from_eye, camera->back);
}

bool camera_may_see(const struct camera *camera, const double center[3], double radius_m,
                    double wider)
{
    double at[3];
    camera_to_view(camera, center, at);
    for (int axis = 0; axis < 2; axis++) {
        double half = wider * (axis ? camera->half_height : camera->half_width);
        double room =
            camera->is_orthographic ? half + radius_m : half * at[2] + radius_m * hypot(1, half);
        if (fabs(at[axis]) > room)
            return false;
    }
    return at[2] > -radius_m;
}

void camera_axes(const struct camera *camera, double axes[3][3])
{
    memcpy(axes[0], camera->right, sizeof axes[0]);
    memcpy(axes[1], camera->up, sizeof axes[1]);
    memcpy(axes[2], camera->back, sizeof axes[2]);
}

/* Along one axis: parts begin at multiples of half their length, so that each window of at most
 * that is within one. */
static void part_along(int first, int size, int image, int *part_first, int *part_size)
{
    const int step = CAMERA_PART_PX / 2;
    *part_first = 0;
    *part_size = image;
    if (image <= CAMERA_PART_PX)
        return;
    assert(size <= step);
    *part_first = first / step * step;
    *part_size = CAMERA_PART_PX;
}

struct camera_part camera_part_of(const struct camera_window *window)
{
    struct camera_part part = {.image_width = window->image_width,
                               .image_height = window->image_height};
    part_along(window->x, window->width, window->image_width, &part.x, &part.width);
    part_along(window->y, window->height, window->image_height, &part.y, &part.height);
    return part;
}

void camera_clip(const struct camera *camera, const struct camera_part *part, double unit_m,
                 float across[4], float depth[4])
{
    double wider = (double)part->image_width / part->width;
    double taller = (double)part->image_height / part->height;
    bool is_flat = camera->is_orthographic;
    double unit = is_flat ? unit_m : 1;
    across[0] = (float)(unit / camera->half_width * wider);
    across[1] = (float)(unit / camera->half_height * taller);
    across[2] = (float)((part->image_width - 2.0 * part->x) / part->width - 1);
    across[3] = (float)(1 - (part->image_height - 2.0 * part->y) / part->height);
    double range = camera->z_far - camera->z_near;
    depth[0] = (float)(is_flat ? camera->z_far / range : camera->z_near / unit_m);
    depth[1] = is_flat ? (float)(unit_m / range) : 0;
    depth[2] = is_flat ? 1 : 0;
    depth[3] = is_flat ? 0 : -1;
}
