/* SPDX-License-Identifier: MIT */
/* Projection and clipping. */
#include "renderer/overlay/overlay_screen.h"

#include <math.h>

#include "renderer/base/matrix.h"

void overlay_screen_init(struct overlay_screen *screen, const struct camera *camera,
                         const struct view *view)
{
    *screen = (struct overlay_screen){.camera = camera,
                                      .width_px = view->width_px,
                                      .height_px = view->height_px,
                                      .drawn = view_tile_of(view),
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

void overlay_screen_project(const struct overlay_screen *screen, const double point[3],
                            double pixel[2])
{
    const struct camera *camera = screen->camera;
    double scale = camera->is_orthographic ? 1 : 1 / point[2];
    pixel[0] = 0.5 * (1 + point[0] * scale / camera->half_width) * screen->width_px;
    pixel[1] = 0.5 * (1 - point[1] * scale / camera->half_height) * screen->height_px;
}

int overlay_screen_clip(const struct overlay_screen *screen, double corners[POLYGON_CORNERS_MAX][3],
                        int count)
{
    for (size_t i = 0; i < screen->plane_count && count; i++)
        count = polygon_clip(screen->planes[i], corners, count);
    return count;
}

bool overlay_screen_clip_segment(const struct overlay_screen *screen, double ends[2][3])
{
    for (size_t i = 0; i < screen->plane_count; i++) {
        double above[2] = {plane_height(screen->planes[i], ends[0]),
                           plane_height(screen->planes[i], ends[1])};
        if (above[0] < 0 && above[1] < 0)
            return false;
        if ((above[0] < 0) != (above[1] < 0))
            plane_meet(screen->planes[i], ends[0], ends[1], ends[above[0] < 0 ? 0 : 1]);
    }
    return true;
}

double overlay_screen_pixel_m(const struct overlay_screen *screen, double depth_m)
{
    const struct camera *camera = screen->camera;
    double tall = 2 * camera->half_height / screen->height_px;
    return camera->is_orthographic ? tall : tall * depth_m;
}
