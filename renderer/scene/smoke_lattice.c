/* SPDX-License-Identifier: MIT */
/* Points of the lattice against nodes of the picture. */
#include "renderer/scene/smoke_lattice.h"

#include <math.h>

#include "renderer/base/matrix.h"
#include "renderer/scene/atmosphere_grid.h"
#include "renderer/scene/smoke_nodes.h"

static const double STEPS_LEAST = 64; /* along the longest side */

void smoke_lattice_steps(const struct state_grid *grid, uint32_t steps[3])
{
    double sides_m[3], longest_m = 0;
    for (int k = 0; k < 3; k++) {
        sides_m[k] = vec3_length(&grid->world_from_voxel[4 * k]) * grid->values.size[k];
        longest_m = fmax(longest_m, sides_m[k]);
    }
    for (int k = 0; k < 3; k++)
        steps[k] =
            (uint32_t)fmax(2.0 * grid->values.size[k], ceil(STEPS_LEAST * sides_m[k] / longest_m));
}

static bool are_alike(const double a[3], const double b[3])
{
    for (int k = 0; k < 3; k++) {
        int next = (k + 1) % 3;
        double left = a[k] * b[next], right = a[next] * b[k];
        if (fabs(left - right) > 1e-6 * fmax(fabs(left), fabs(right)))
            return false;
    }
    return true;
}

struct smoke_lattice smoke_lattice_of(const struct scene_state *state)
{
    struct smoke_lattice lattice = {.channels = 1};
    for (size_t i = 0; i < state->grid_count; i++) {
        uint64_t points = 1;
        uint32_t steps[3];
        smoke_lattice_steps(&state->grids[i], steps);
        for (int k = 0; k < 3; k++)
            points *= steps[k] + 1;
        lattice.points += points;
        if (!are_alike(state->grids[0].sigma, state->grids[i].sigma))
            lattice.channels = 3;
    }
    return lattice;
}

uint64_t smoke_lattice_bytes(const struct scene_state *state)
{
    const struct smoke_lattice lattice = smoke_lattice_of(state);
    return lattice.points * (uint64_t)lattice.channels * state->light_count * SMOKE_DEPTH_BYTES;
}

/* Where a box is in the picture. */
struct extent {
    double low[3], high[3]; /* x and y in [-1,1] over the picture; z the depth [m] */
};

static struct extent extent_of(const struct state_grid *grid, const struct camera *camera)
{
    struct extent extent = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    bool is_behind = false; /* some corner: it may be anywhere in the picture */
    for (int corner = 0; corner < 8; corner++) {
        double point[3], at[3];
        for (int k = 0; k < 3; k++)
            point[k] = corner >> k & 1 ? grid->values.size[k] : 0;
        mat4_transform_point(grid->world_from_voxel, point, point);
        camera_to_view(camera, point, at);
        double unit_m = camera->is_orthographic ? 1 : at[2];
        is_behind |= !camera->is_orthographic && at[2] <= camera->z_near;
        at[0] /= camera->half_width * unit_m;
        at[1] /= camera->half_height * unit_m;
        for (int k = 0; k < 3; k++) {
            extent.low[k] = fmin(extent.low[k], at[k]);
            extent.high[k] = fmax(extent.high[k], at[k]);
        }
    }
    for (int k = 0; k < 2; k++) {
        extent.low[k] = is_behind ? -1 : fmax(extent.low[k], -1);
        extent.high[k] = is_behind ? 1 : fmin(extent.high[k], 1);
    }
    return extent;
}

/* The share of its box that a grid fills: nodes elsewhere are not lit. */
static double filled_share(const struct density_grid *values)
{
    size_t filled = 0, count = 1;
    for (int k = 0; k < 3; k++)
        count *= values->bricks_along[k];
    for (size_t i = 0; i < count; i++)
        filled += values->bricks[i].values != 0;
    return (double)filled / (double)count;
}

static bool pays(const struct view *view, const struct scene_state *state,
                 const struct camera *camera)
{
    const struct camera_window whole = camera_window_whole(view->width_px, view->height_px);
    const struct atmosphere_grid grid = atmosphere_grid_of(view, &whole);
    const struct smoke_nodes nodes = smoke_nodes_of(view, state, camera);
    double columns = (double)atmosphere_columns(&grid), around = 0;
    double all = columns * (nodes.cells + 1), points = (double)smoke_lattice_of(state).points;
    if (points > all)
        return false;
    for (size_t i = 0; i < state->grid_count; i++) {
        const struct extent extent = extent_of(&state->grids[i], camera);
        double share = 0.25 * fmax(extent.high[0] - extent.low[0], 0) *
                       fmax(extent.high[1] - extent.low[1], 0);
        if (extent.high[2] > 0) /* one node before it and one behind are lit, too */
            around +=
                filled_share(&state->grids[i].values) * share * columns *
                (smoke_node_at(&nodes, extent.high[2]) - smoke_node_at(&nodes, extent.low[2]) + 2);
    }
    return points <= fmin(around, all);
}

static bool is_any_dimmed(const struct view *view, const struct scene_state *state)
{
    bool is_any = false;
    for (size_t i = 0; i < state->light_count; i++)
        is_any |= state->lights[i].casts_shadow;
    return is_any && state->grid_count > 0 && view->quality.shadows != SHADOWS_NONE;
}

bool smoke_lattice_serves(const struct view *view, const struct scene_state *state,
                          const struct camera *camera, uint64_t most_bytes)
{
    return is_any_dimmed(view, state) && smoke_lattice_bytes(state) <= most_bytes &&
           (!camera || pays(view, state, camera));
}
