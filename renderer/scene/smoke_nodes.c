/* SPDX-License-Identifier: MIT */
/* Depths of density grids, divided into cells. */
#include "renderer/scene/smoke_nodes.h"

#include <math.h>

#include "renderer/base/matrix.h"
#include "renderer/scene/atmosphere_grid.h"

static const double SPAN = 64, GROWTH_LEAST = 0.01;

static void add_depths(const struct state_grid *grid, const struct camera *camera, double *near,
                       double *far)
{
    for (int corner = 0; corner < 8; corner++) {
        double point[3], view[3];
        for (int k = 0; k < 3; k++)
            point[k] = corner >> k & 1 ? grid->values.size[k] : 0;
        mat4_transform_point(grid->world_from_voxel, point, point);
        camera_to_view(camera, point, view);
        *near = fmin(*near, view[2]);
        *far = fmax(*far, view[2]);
    }
}

struct smoke_nodes smoke_nodes_of(const struct view *view, const struct scene_state *state,
                                  const struct camera *camera)
{
    const struct camera_window one = camera_window_whole(1, 1);
    double near = INFINITY, far = 0;
    for (size_t i = 0; i < state->grid_count; i++)
        add_depths(&state->grids[i], camera, &near, &far);
    near = isfinite(near) ? fmax(near, 0) : 0;
    far = fmax(far, near * (1 + 1e-6) + 1e-6);
    return (struct smoke_nodes){
        .first_m = near,
        .length_m = far - near,
        .growth = fmax(log2(far / fmax(near, far / SPAN)), GROWTH_LEAST),
        .cells = atmosphere_grid_of(view, &one).slices - 1,
    };
}

double smoke_node_at(const struct smoke_nodes *nodes, double view_z)
{
    double u = fmin(fmax((view_z - nodes->first_m) / nodes->length_m, 0), 1);
    double at = log2(1 + u * (exp2(nodes->growth) - 1)) / nodes->growth;
    return fmin(fmax(at, 0), 1) * nodes->cells;
}

uint64_t smoke_pixel_bytes(const struct view *view, const struct scene_state *state)
{
    const struct camera_window one = camera_window_whole(1, 1);
    uint64_t side = (uint64_t)atmosphere_side_px(view);
    uint64_t column = (uint64_t)atmosphere_grid_of(view, &one).slices * SMOKE_NODE_BYTES;
    return state->grid_count ? column / (side * side) + 1 : 0;
}
