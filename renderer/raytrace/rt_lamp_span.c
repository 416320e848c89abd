/* SPDX-License-Identifier: MIT */
/* A way against a sphere and a cone. */
#include "renderer/raytrace/rt_lamp_span.h"

#include <math.h>

#include "renderer/base/matrix.h"

struct sight {              /* a way, seen from a lamp */
    double off[3], way[3];  /* from the lamp to the way's origin; unit */
    double axis[3], cosine; /* of a spot; of its outer cone */
};

static void cut_to_range(const struct sight *s, double range, struct rt_span *span)
{
    double middle = -vec3_dot(s->off, s->way);
    double square = range * range - vec3_dot(s->off, s->off) + middle * middle;
    double half = square > 0 ? sqrt(square) : -1;
    span->from = fmax(span->from, half >= 0 ? middle - half : INFINITY);
    span->to = fmin(span->to, middle + half);
}

static bool is_in_cone(const struct sight *s, double at)
{
    double along = 0, square = 0;
    for (int k = 0; k < 3; k++) {
        double d = s->off[k] + at * s->way[k];
        along += d * s->axis[k];
        square += d * d;
    }
    return along >= s->cosine * sqrt(square);
}

/* A cone of less than half of all directions is convex, so that a line is in it on one stretch:
 * from the roots of a quadratic. */
static void cut_to_cone(const struct sight *s, struct rt_span *span)
{
    if (!(s->cosine > 0.01))
        return;
    double way_along = vec3_dot(s->way, s->axis), off_along = vec3_dot(s->off, s->axis);
    double square = s->cosine * s->cosine, a = way_along * way_along - square;
    double b = way_along * off_along - square * vec3_dot(s->way, s->off);
    double k = off_along * off_along - square * vec3_dot(s->off, s->off), root = b * b - a * k;
    if (fabs(a) < 1e-9 || !(root > 0)) /* along its side, or beside it all the way */
        return;
    double low = (-b - sqrt(root)) / a, high = (-b + sqrt(root)) / a;
    double first = fmin(low, high), last = fmax(low, high), apart = 1 + fabs(first) + fabs(last);
    if (is_in_cone(s, 0.5 * (first + last)))
        span->from = fmax(span->from, first), span->to = fmin(span->to, last);
    else if (is_in_cone(s, last + apart))
        span->from = fmax(span->from, last);
    else if (is_in_cone(s, first - apart))
        span->to = fmin(span->to, first);
    else
        span->to = -1;
}

struct rt_span rt_lamp_span(const struct rt_scene *scene, const struct state_light *light,
                            const double origin[3], const double way[3])
{
    struct rt_span span = {0, INFINITY};
    if (light->type == SCENE_LIGHT_DIRECTIONAL || state_light_is_area(light))
        return span;
    struct sight sight;
    for (int k = 0; k < 3; k++) {
        sight.off[k] = origin[k] + scene->origin[k] - light->position[k];
        sight.way[k] = way[k];
        sight.axis[k] = (double)light->direction[k];
    }
    if (light->range > 0)
        cut_to_range(&sight, (double)light->range, &span);
    if (light->type == SCENE_LIGHT_SPOT) {
        sight.cosine = cos((double)light->outer_cone_rad);
        cut_to_cone(&sight, &span);
    }
    return span;
}
