/* SPDX-License-Identifier: MIT */
/* Curves through the keys of a camera. Eye and target follow centripetal Catmull-Rom curves:
 * Yuksel, Schaefer and Keyser 2011, "Parameterization and Applications of Catmull-Rom Curves", eq.
 * 1 to 3 with alpha = 1/2, whose segments have neither cusps nor loops. When the curve is where is
 * told by cubics without overshoot (Fritsch and Butland 1984, "A Method for Constructing Local
 * Monotone Piecewise Cubic Interpolants"), from the moments of the keys to the knots of the curve,
 * so that each key is met at its moment and the speed does not jump. Lenses and ups follow such
 * cubics, too. */
#include "protocol/camera_path.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Two keys, and those before and after them where there are any. */
struct span {
    double at[4];
    const struct camera_key *key[4]; /* [1] and [2] always; [0] and [3] may be NULL */
    double share;                    /* of the way from [1] to [2], [0, 1] */
};

/* ---- which keys ---- */

/* The key at an index, which on a closed path goes round; NULL: there is none. */
static const struct camera_key *key_at(const struct camera_path *path, int index, double *at)
{
    int turn = 0;
    if (!path->is_closed && (index < 0 || index >= path->count))
        return NULL;
    while (index < 0) {
        index += path->count;
        turn--;
    }
    while (index >= path->count) {
        index -= path->count;
        turn++;
    }
    *at = path->keys[index].at + turn * (path->closes_at - path->keys[0].at);
    return &path->keys[index];
}

static double go_round(const struct camera_path *path, double moment)
{
    double first = path->keys[0].at, period = path->closes_at - first;
    if (!path->is_closed || (moment >= first && moment < path->closes_at))
        return moment;
    double within = fmod(moment - first, period);
    within += within < 0 ? period : 0;
    return within < period ? first + within : first;
}

/* The last key that is not after the moment; the first where all are. */
static int find_key(const struct camera_path *path, double moment)
{
    int low = 0, high = path->count;
    while (high - low > 1) {
        int middle = low + (high - low) / 2;
        if (path->keys[middle].at <= moment)
            low = middle;
        else
            high = middle;
    }
    return low;
}

static struct span find_span(const struct camera_path *path, double moment)
{
    struct span span = {0};
    int first = find_key(path, moment);
    if (!path->is_closed && first > path->count - 2)
        first = path->count - 2;
    for (int k = 0; k < 4; k++)
        span.key[k] = key_at(path, first + k - 1, &span.at[k]);
    span.share = fmin(fmax((moment - span.at[1]) / (span.at[2] - span.at[1]), 0), 1);
    return span;
}

/* ---- one span ---- */

/* Ends and the slopes there, per share of the span. */
static double hermite(double share, const double end[2], const double slope[2])
{
    double s2 = share * share, s3 = s2 * share;
    return (2 * s3 - 3 * s2 + 1) * end[0] + (s3 - 2 * s2 + share) * slope[0] +
           (3 * s2 - 2 * s3) * end[1] + (s3 - s2) * slope[1];
}

/* The slope at a point between two straight pieces, by their slopes and lengths: their weighted
 * harmonic mean, or 0 at an extreme. */
static double monotone_slope(const double slope[2], const double length[2])
{
    double weight[2] = {2 * length[1] + length[0], length[1] + 2 * length[0]};
    if (!(slope[0] * slope[1] > 0))
        return 0;
    return (weight[0] + weight[1]) / (weight[0] / slope[0] + weight[1] / slope[1]);
}

/* A cubic through values at the moments of a span, which stays between those of its ends. The
 * values of keys that are not there are not read. */
static double monotone(const struct span *span, const double value[4])
{
    double length[3], slope[3] = {0}, tangent[2];
    for (int k = 0; k < 3; k++) {
        length[k] = span->at[k + 1] - span->at[k];
        if (span->key[k] && span->key[k + 1])
            slope[k] = (value[k + 1] - value[k]) / length[k];
    }
    tangent[0] = length[1] * (span->key[0] ? monotone_slope(slope, length) : slope[1]);
    tangent[1] = length[1] * (span->key[3] ? monotone_slope(slope + 1, length + 1) : slope[1]);
    double low = fmin(value[1], value[2]), high = fmax(value[1], value[2]);
    return fmin(fmax(hermite(span->share, value + 1, tangent), low), high); /* but for rounding */
}

/* The derivative by the knots at the middle of three points: `step` are the two differences of
 * knots. Points that coincide have no knots between them and the curve rests there. */
static double knot_slope(const double point[3], const double step[2])
{
    double before = step[0] > 0 ? (point[1] - point[0]) / step[0] : 0;
    double after = step[1] > 0 ? (point[2] - point[1]) / step[1] : 0;
    double both = step[0] + step[1] > 0 ? (point[2] - point[0]) / (step[0] + step[1]) : 0;
    return before - both + after;
}

static double distance3(const double *a, const double *b)
{
    return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) +
                (a[2] - b[2]) * (a[2] - b[2]));
}

/* point: of each key that is there. */
static void curve(const struct span *span, const double *const point[4], double out[3])
{
    double step[3] = {0}, knot[4] = {0};
    assert(point[1] && point[2]); /* the ends of the span */
    for (int k = 0; k < 3; k++) {
        if (point[k] && point[k + 1])
            step[k] = sqrt(distance3(point[k], point[k + 1])); /* |...|^alpha, eq. 3 */
        knot[k + 1] = knot[k] + step[k];
    }
    memcpy(out, point[1], 3 * sizeof *out);
    if (!(step[1] > 0))
        return;
    double along = (monotone(span, knot) - knot[1]) / step[1];
    for (int axis = 0; axis < 3; axis++) {
        double value[4] = {0}, slope[2];
        for (int k = 0; k < 4; k++)
            value[k] = point[k] ? point[k][axis] : 0;
        slope[0] = point[0] ? step[1] * knot_slope(value, step) : value[2] - value[1];
        slope[1] = point[3] ? step[1] * knot_slope(value + 1, step + 1) : value[2] - value[1];
        out[axis] = hermite(along, value + 1, slope);
    }
}

/* ---- a camera ---- */

static double length3(const double v[3])
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static double between(double a, double b, double share)
{
    return share < 1 ? a + (b - a) * share : b;
}

static void unit_up(const struct camera_key *key, double up[3])
{
    double length = length3(key->up);
    for (int axis = 0; axis < 3; axis++)
        up[axis] = key->up[axis] / length;
}

static void straight_camera(const struct span *span, struct request_camera *camera)
{
    const struct camera_key *a = span->key[1], *b = span->key[2];
    double up_a[3], up_b[3];
    unit_up(a, up_a);
    unit_up(b, up_b);
    for (int axis = 0; axis < 3; axis++) {
        camera->eye[axis] = between(a->eye[axis], b->eye[axis], span->share);
        camera->target[axis] = between(a->target[axis], b->target[axis], span->share);
        camera->up[axis] = between(up_a[axis], up_b[axis], span->share);
    }
    camera->fov_y_deg = between(a->fov_y_deg, b->fov_y_deg, span->share);
    camera->ortho_height = between(a->ortho_height, b->ortho_height, span->share);
}

static void curved_camera(const struct span *span, struct request_camera *camera)
{
    const double *eye[4] = {0}, *target[4] = {0};
    double up[3][4] = {{0}}, fov[4] = {0}, height[4] = {0};
    for (int k = 0; k < 4; k++) {
        const struct camera_key *key = span->key[k];
        double unit[3];
        if (!key)
            continue;
        unit_up(key, unit);
        eye[k] = key->eye;
        target[k] = key->target;
        fov[k] = key->fov_y_deg;
        height[k] = key->ortho_height;
        for (int axis = 0; axis < 3; axis++)
            up[axis][k] = unit[axis];
    }
    curve(span, eye, camera->eye);
    curve(span, target, camera->target);
    for (int axis = 0; axis < 3; axis++)
        camera->up[axis] = monotone(span, up[axis]);
    camera->fov_y_deg = monotone(span, fov);
    camera->ortho_height = monotone(span, height);
}

static struct request_camera camera_of(const struct camera_key *key)
{
    struct request_camera camera = {.kind = REQUEST_CAMERA_LOOK_AT,
                                    .fov_y_deg = key->fov_y_deg,
                                    .ortho_height = key->ortho_height};
    memcpy(camera.eye, key->eye, sizeof camera.eye);
    memcpy(camera.target, key->target, sizeof camera.target);
    memcpy(camera.up, key->up, sizeof camera.up);
    return camera;
}

double camera_path_moment(const struct camera_path *path, int frame, double frame_rate)
{
    return path->is_timed ? frame / frame_rate : frame;
}

struct request_camera camera_path_at(const struct camera_path *path, double moment)
{
    const struct span span = find_span(path, go_round(path, moment));
    if (span.share <= 0)
        return camera_of(span.key[1]);
    if (span.share >= 1)
        return camera_of(span.key[2]);
    struct request_camera camera = {.kind = REQUEST_CAMERA_LOOK_AT};
    if (path->interpolation == CAMERA_INTERPOLATION_LINEAR)
        straight_camera(&span, &camera);
    else
        curved_camera(&span, &camera);
    double length = length3(camera.up);
    for (int axis = 0; axis < 3 && length > 0; axis++)
        camera.up[axis] /= length;
    return camera;
}
