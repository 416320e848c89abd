/* SPDX-License-Identifier: MIT */
/* Planes of a window's frustum, and bounds against them. */
#include "renderer/scene/frustum.h"

#include "renderer/base/matrix.h"

/* A point's or a line's pixels reach a little beyond its place. */
static const double MARGIN_PX = 2;

/* The window in the image's normalised coordinates, y up, grown by the margin. */
static void window_rect(const struct camera_window *w, double low[2], double high[2])
{
    low[0] = low[1] = -1;
    high[0] = high[1] = 1;
    if (w->image_width <= 0)
        return;
    low[0] = 2 * (w->x - MARGIN_PX) / w->image_width - 1;
    high[0] = 2 * (w->x + w->width + MARGIN_PX) / w->image_width - 1;
    low[1] = 1 - 2 * (w->y + w->height + MARGIN_PX) / w->image_height;
    high[1] = 1 - 2 * (w->y - MARGIN_PX) / w->image_height;
}

/* sign * (dot(axis, v) - edge * depth) >= 0, edge being a slope, or a length where orthographic. */
static void add_side(struct frustum *frustum, const struct camera *camera, const double axis[3],
                     double edge, double sign)
{
    double *plane = frustum->planes[frustum->plane_count++];
    double slope = camera->is_orthographic ? 0 : edge;
    double length = sqrt(1 + slope * slope);
    for (int k = 0; k < 3; k++) /* the depth is -dot(back, v) */
        plane[k] = sign * (axis[k] + slope * camera->back[k]) / length;
    plane[3] = camera->is_orthographic ? -sign * edge : 0;
}

void frustum_init(struct frustum *frustum, const struct camera *camera,
                  const struct camera_window *window)
{
    double low[2], high[2];
    window_rect(window, low, high);
    *frustum = (struct frustum){0};
    memcpy(frustum->eye, camera->eye, sizeof frustum->eye);
    add_side(frustum, camera, camera->right, low[0] * camera->half_width, 1);
    add_side(frustum, camera, camera->right, high[0] * camera->half_width, -1);
    add_side(frustum, camera, camera->up, low[1] * camera->half_height, 1);
    add_side(frustum, camera, camera->up, high[1] * camera->half_height, -1);
    if (camera->is_orthographic)
        return;
    double *behind = frustum->planes[frustum->plane_count++];
    for (int k = 0; k < 3; k++)
        behind[k] = -camera->back[k];
}

bool frustum_meets(const struct frustum *frustum, const struct state_item *item)
{
    double center[3];
    vec3_sub(item->center, frustum->eye, center);
    double margin = FRUSTUM_MARGIN * (item->radius_m + vec3_length(center));
    for (int i = 0; i < frustum->plane_count; i++) {
        const double *plane = frustum->planes[i];
        double box = 0; /* half its extent along the normal */
        for (int k = 0; k < 3; k++)
            box += 0.5 * fabs(plane[k]) * (item->bounds_max[k] - item->bounds_min[k]);
        double reach = fmin(box, item->radius_m) + margin;
        if (vec3_dot(plane, center) + plane[3] + reach < 0)
            return false;
    }
    return true;
}
