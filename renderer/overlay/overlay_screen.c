/* SPDX-License-Identifier: MIT */
/* Projection and clipping. */
#include "renderer/overlay/overlay_screen.h"

#include <math.h>
#include <string.h>

#include "renderer/scene/matrix.h"

void overlay_screen_init(struct overlay_screen *screen, const struct camera *camera,
                         const struct view *view)
{
    *screen = (struct overlay_screen){.camera = camera,
                                      .width_px = view->width_px,
                                      .height_px = view->height_px,
                                      .planes = {{0, 0, 1, -camera->z_near}},
                                      .plane_count = 1};
    for (size_t i = 0; i < view->clip_plane_count; i++) {
        const double *world = view->clip_planes[i];
        double *plane = screen->planes[screen->plane_count++];
        plane[0] = vec3_dot(world, camera->right);
        plane[1] = vec3_dot(world, camera->up);
        plane[2] = -vec3_dot(world, camera->back);
        plane[3] = world[3] + vec3_dot(world, camera->eye);
    }
}

void overlay_screen_view(const struct overlay_screen *screen, const double world[3],
                         double point[3])
{
    const struct camera *camera = screen->camera;
    double from_eye[3];
    vec3_sub(world, camera->eye, from_eye);
    point[0] = vec3_dot(camera->right, from_eye);
    point[1] = vec3_dot(camera->up, from_eye);
    point[2] = -vec3_dot(camera->back, from_eye);
}

void overlay_screen_project(const struct overlay_screen *screen, const double point[3],
                            double pixel[2])
{
    const struct camera *camera = screen->camera;
    double scale = camera->is_orthographic ? 1 : 1 / point[2];
    pixel[0] = 0.5 * (1 + point[0] * scale / camera->half_width) * screen->width_px;
    pixel[1] = 0.5 * (1 - point[1] * scale / camera->half_height) * screen->height_px;
}

static double height_above(const double plane[4], const double point[3])
{
    return vec3_dot(plane, point) + plane[3];
}

static void meet(const double a[3], const double b[3], double above_a, double above_b,
                 double point[3])
{
    double t = above_a / (above_a - above_b);
    for (int k = 0; k < 3; k++)
        point[k] = a[k] + t * (b[k] - a[k]);
}

/* Sutherland and Hodgman 1974, "Reentrant Polygon Clipping", one plane. */
static int clip_by(const double plane[4], double (*corners)[3], int count)
{
    double kept[SCREEN_CORNERS_MAX + 1][3];
    int kept_count = 0;
    for (int i = 0; i < count; i++) {
        const double *a = corners[i], *b = corners[(i + 1) % count];
        double above_a = height_above(plane, a), above_b = height_above(plane, b);
        if (above_a >= 0)
            memcpy(kept[kept_count++], a, sizeof *kept);
        if ((above_a >= 0) != (above_b >= 0))
            meet(a, b, above_a, above_b, kept[kept_count++]);
    }
    memcpy(corners, kept, (size_t)kept_count * sizeof *kept);
    return kept_count;
}

int overlay_screen_clip(const struct overlay_screen *screen, double corners[SCREEN_CORNERS_MAX][3],
                        int count)
{
    for (size_t i = 0; i < screen->plane_count && count; i++)
        count = clip_by(screen->planes[i], corners, count);
    return count;
}

bool overlay_screen_clip_segment(const struct overlay_screen *screen, double ends[2][3])
{
    for (size_t i = 0; i < screen->plane_count; i++) {
        double above[2] = {height_above(screen->planes[i], ends[0]),
                           height_above(screen->planes[i], ends[1])};
        if (above[0] < 0 && above[1] < 0)
            return false;
        if ((above[0] < 0) != (above[1] < 0))
            meet(ends[0], ends[1], above[0], above[1], ends[above[0] < 0 ? 0 : 1]);
    }
    return true;
}

double overlay_screen_pixel_m(const struct overlay_screen *screen, double depth_m)
{
    const struct camera *camera = screen->camera;
    double tall = 2 * camera->half_height / screen->height_px;
    return camera->is_orthographic ? tall : tall * depth_m;
}
