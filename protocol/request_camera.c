/* SPDX-License-Identifier: MIT */
/* Reading cameras, directions and matrices, and refusing the degenerate ones. */
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/limits.h"
#include "protocol/request_parts.h"

/* Shorter vectors have no direction that survives squaring in a float's range of exponents. */
static const double DIRECTION_LENGTH_MIN = 1e-15;

/* sin of the angle between view and up, and volume of the parallelepiped of a matrix's unit
 * columns, below which f32 on the GPU cannot tell the vectors apart. */
static const double INDEPENDENCE_MIN = 1e-6;

static const double MATRIX_SCALE_MIN = 1e-12, MATRIX_SCALE_MAX = 1e12;

static double length3(const double *v)
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static void cross3(const double *a, const double *b, double *out)
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

bool request_read_direction(const struct json_node *node, double *direction)
{
    if (!node->value)
        return true;
    if (!json_read_numbers(node, 3, -LIMIT_COORDINATE, LIMIT_COORDINATE, direction))
        return false;
    if (length3(direction) < DIRECTION_LENGTH_MIN)
        return json_refuse(node, ERROR_INVALID_REQUEST, "must have a length of at least %.0e",
                           DIRECTION_LENGTH_MIN);
    return true;
}

bool request_are_independent(const double a[3], const double b[3])
{
    double across[3];
    cross3(a, b, across);
    return length3(across) >= INDEPENDENCE_MIN * length3(a) * length3(b);
}

bool request_read_matrix(const struct json_node *node, double *matrix)
{
    if (!node->value)
        return true;
    if (!json_read_numbers(node, 16, -LIMIT_COORDINATE, LIMIT_COORDINATE, matrix))
        return false;
    if (matrix[3] != 0 || matrix[7] != 0 || matrix[11] != 0 || matrix[15] != 1)
        return json_refuse(node, ERROR_INVALID_REQUEST,
                           "must be affine and column-major: elements 3, 7, 11 are 0 and 15 is 1");
    double unit[3][3], normal[3];
    for (int column = 0; column < 3; column++) {
        double scale = length3(matrix + 4 * column);
        if (!(scale >= MATRIX_SCALE_MIN && scale <= MATRIX_SCALE_MAX))
            return json_refuse(node, ERROR_INVALID_REQUEST,
                               "column %d has length %.3g, must be from %.0e to %.0e", column,
                               scale, MATRIX_SCALE_MIN, MATRIX_SCALE_MAX);
        for (int row = 0; row < 3; row++)
            unit[column][row] = matrix[4 * column + row] / scale;
    }
    cross3(unit[0], unit[1], normal);
    double volume = normal[0] * unit[2][0] + normal[1] * unit[2][1] + normal[2] * unit[2][2];
    if (fabs(volume) < INDEPENDENCE_MIN)
        return json_refuse(node, ERROR_INVALID_REQUEST, "is singular: its columns span no volume");
    return true;
}

void request_default_up(const double forward[3], double up[3])
{
    const double y[3] = {0, 1, 0};
    bool is_level = request_are_independent(forward, y);
    up[0] = 0;
    up[1] = is_level ? 1 : 0;
    up[2] = is_level ? 0 : forward[1] < 0 ? -1 : 1;
}

/* Whether eye and target are far enough apart to say where to look. */
static bool has_direction(const struct request_camera *camera, double forward[3], double *distance)
{
    for (int i = 0; i < 3; i++)
        forward[i] = camera->target[i] - camera->eye[i];
    *distance = length3(forward);
    double magnitude = fmax(length3(camera->eye), length3(camera->target));
    return *distance >= DIRECTION_LENGTH_MIN && *distance >= 8 * DBL_EPSILON * magnitude;
}

const char *request_look_at_fault(const struct request_camera *camera)
{
    double forward[3], distance;
    if (!has_direction(camera, forward, &distance))
        return "eye meets its target";
    if (length3(camera->up) < DIRECTION_LENGTH_MIN || !request_are_independent(forward, camera->up))
        return "up is parallel to its view direction";
    return NULL;
}

bool request_read_look_at(const struct json_node *node, struct request_camera *camera)
{
    struct json_node eye = json_member(node, "eye"), target = json_member(node, "target");
    struct json_node up = json_member(node, "up");
    if (!json_expect_present(&eye) || !json_expect_present(&target) ||
        !json_read_numbers(&eye, 3, -LIMIT_COORDINATE, LIMIT_COORDINATE, camera->eye) ||
        !json_read_numbers(&target, 3, -LIMIT_COORDINATE, LIMIT_COORDINATE, camera->target) ||
        !request_read_direction(&up, camera->up))
        return false;

    double forward[3], distance;
    if (!has_direction(camera, forward, &distance))
        return json_refuse(&target, ERROR_INVALID_REQUEST,
                           "%.3g m from eye: too near to say where to look", distance);

    if (!up.value)
        request_default_up(forward, camera->up);
    if (!request_are_independent(forward, camera->up))
        return json_refuse(&up, ERROR_INVALID_REQUEST,
                           "parallel to the view direction; give an up across it");
    return true;
}

bool request_read_lens(const struct json_node *node, struct request_camera *camera)
{
    struct json_node fov = json_member(node, "fov_y_deg");
    struct json_node ortho = json_member(node, "ortho_height");
    if (!json_read_number(&fov, 0.001, 179, &camera->fov_y_deg))
        return false;
    if (camera->fov_y_deg == 179)
        return json_refuse(&fov, ERROR_INVALID_REQUEST, "must be less than 179");
    return json_read_number(&ortho, 1e-9, LIMIT_COORDINATE, &camera->ortho_height);
}

/* The member that names the form of a camera decides which others may stand beside it. */
struct camera_form {
    const char *names[4]; /* the first is the one that names the form */
};
static const struct camera_form forms[] = {
    [REQUEST_CAMERA_DEFAULT] = {{NULL}},
    [REQUEST_CAMERA_NODE] = {{"node", NULL}},
    [REQUEST_CAMERA_LOOK_AT] = {{"eye", "target", "up", NULL}},
    [REQUEST_CAMERA_MATRIX] = {{"matrix", NULL}},
    [REQUEST_CAMERA_FIT] = {{"fit", NULL}},
};

static bool read_form(const struct json_node *node, enum request_camera_kind *form)
{
    static const char *const known[] = {"node", "eye",       "target",       "up",         "matrix",
                                        "fit",  "fov_y_deg", "ortho_height", "projection", NULL};
    if (!json_expect_object(node, known))
        return false;
    for (int kind = REQUEST_CAMERA_NODE; kind <= REQUEST_CAMERA_FIT; kind++) {
        for (const char *const *name = forms[kind].names; *name; name++) {
            struct json_node member = json_member(node, *name);
            if (!member.value || *form == (enum request_camera_kind)kind)
                continue;
            if (*form != REQUEST_CAMERA_DEFAULT)
                return json_refuse(&member, ERROR_INVALID_REQUEST,
                                   "but the camera is given by '%s' already",
                                   forms[*form].names[0]);
            *form = (enum request_camera_kind)kind;
        }
    }
    return true;
}

static const char *projection_name(int projection)
{
    static const char *const names[] = {"perspective", "orthographic"};
    return projection >= 0 && projection < 2 ? names[projection] : NULL;
}

/* An orthographic camera has a height: that of the request, or of the scene that it fits. */
static bool read_projection(const struct json_node *node, struct request_camera *camera)
{
    const struct json_choice projections = {.name = projection_name};
    struct json_node projection = json_member(node, "projection");
    int index = camera->ortho_height > 0;
    if (!json_read_choice(&projection, &projections, &index))
        return false;
    bool is_orthographic = index == 1;
    if (camera->ortho_height > 0 && !is_orthographic)
        return json_refuse(&projection, ERROR_INVALID_REQUEST,
                           "but ortho_height makes the camera orthographic");
    if (is_orthographic && camera->ortho_height <= 0 && camera->kind != REQUEST_CAMERA_FIT)
        return json_refuse(&projection, ERROR_INVALID_REQUEST,
                           "but only fit knows its height: give ortho_height");
    camera->is_orthographic = is_orthographic && camera->ortho_height <= 0;
    return true;
}

bool request_read_camera(const struct json_node *node, struct request_camera *camera)
{
    if (!node->value)
        return true;
    if (!read_form(node, &camera->kind) || !request_read_lens(node, camera) ||
        !read_projection(node, camera))
        return false;
    if (camera->kind == REQUEST_CAMERA_LOOK_AT)
        return request_read_look_at(node, camera);

    struct json_node name = json_member(node, "node"), matrix = json_member(node, "matrix");
    struct json_node fit = json_member(node, "fit");
    const char *node_name = NULL;
    int fit_index = 0;
    const struct json_choice fits = {.name = request_fit_name};
    if (!json_read_name(&name, &node_name) || !request_read_matrix(&matrix, camera->matrix) ||
        !json_read_choice(&fit, &fits, &fit_index))
        return false;
    camera->fit = (enum request_fit)fit_index;
    if (node_name && !(camera->node = strdup(node_name)))
        return error_set(node->err, ERROR_NO_MEMORY, "camera node name");
    return true;
}
