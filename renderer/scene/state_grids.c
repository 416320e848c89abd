/* SPDX-License-Identifier: MIT */
/* Placing density grids in the world. */
#include "renderer/scene/state_grids.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/fnv.h"
#include "renderer/base/matrix.h"
#include "renderer/scene/atmosphere.h"
#include "renderer/scene/scene_state.h"

/* Of an affine matrix whose determinant is known, and not 0. */
static void invert(const double m[16], double determinant, double out[16])
{
    mat4_identity(out);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            int a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
            out[4 * i + j] = (m[4 * a + c] * m[4 * b + d] - m[4 * a + d] * m[4 * b + c]);
            out[4 * i + j] /= determinant;
        }
    double shift[3] = {-m[12], -m[13], -m[14]};
    mat4_transform_direction(out, shift, shift);
    memcpy(out + 12, shift, sizeof shift);
}

/* False for one without a volume. */
static bool place(const struct scene_grid *source, const double world[16], struct state_grid *grid)
{
    double box[16];
    mat4_identity(box);
    for (int k = 0; k < 3; k++) {
        box[5 * k] =
            ((double)source->bounds_max[k] - (double)source->bounds_min[k]) / source->size[k];
        box[12 + k] = (double)source->bounds_min[k];
    }
    mat4_mul(world, box, grid->world_from_voxel);
    double determinant = mat4_determinant3(grid->world_from_voxel);
    if (!(fabs(determinant) > 1e-60) || !isfinite(determinant))
        return false;
    invert(grid->world_from_voxel, determinant, grid->voxel_from_world);
    for (int k = 0; k < 3; k++) {
        grid->bounds_min[k] = INFINITY;
        grid->bounds_max[k] = -INFINITY;
    }
    for (int corner = 0; corner < 8; corner++) {
        double point[3];
        for (int k = 0; k < 3; k++)
            point[k] = corner >> k & 1 ? source->size[k] : 0;
        mat4_transform_point(grid->world_from_voxel, point, point);
        for (int k = 0; k < 3; k++) {
            grid->bounds_min[k] = fmin(grid->bounds_min[k], point[k]);
            grid->bounds_max[k] = fmax(grid->bounds_max[k], point[k]);
        }
    }
    return true;
}

static bool attenuates(const struct scene_grid *source)
{
    return source->largest > 0 && source->density > 0 &&
           (source->extinction[0] > 0 || source->extinction[1] > 0 || source->extinction[2] > 0);
}

static void override_factors(struct scene_grid *grid, const struct view_grid_override *o)
{
    if (o->has_density)
        grid->density = o->density;
    if (o->has_extinction)
        memcpy(grid->extinction, o->extinction, sizeof grid->extinction);
    if (o->has_color)
        memcpy(grid->color, o->color, sizeof grid->color);
    if (o->has_anisotropy)
        grid->anisotropy = o->anisotropy;
}

/* The scene's grids with the overrides of the view. The caller frees them. */
static struct scene_grid *copy_grids(const struct scene *scene, const struct view *view,
                                     struct error *err)
{
    struct scene_grid *grids = calloc(scene->grid_count + 1, sizeof *grids);
    if (!grids) {
        error_set(err, ERROR_NO_MEMORY, "%u density grids", scene->grid_count);
        return NULL;
    }
    if (scene->grid_count)
        memcpy(grids, scene->grids, scene->grid_count * sizeof *grids);
    for (size_t i = 0; i < view->grid_override_count; i++) {
        const struct view_grid_override *o = &view->grids[i];
        int32_t index = scene_find_grid(scene, o->grid);
        if (index < 0) {
            error_set_at(err, ERROR_NOT_FOUND, "/overrides/grids",
                         "the scene has no density grid '%s'", o->grid);
            free(grids);
            return NULL;
        }
        override_factors(&grids[index], o);
    }
    return grids;
}

static void fill(const struct scene_state *state, const struct scene_grid *source, uint32_t node,
                 struct state_grid *grid)
{
    const struct scene *scene = state->scene;
    grid->node = node;
    grid->values = density_grid_of(scene, source);
    grid->anisotropy = source->anisotropy;
    grid->largest = source->largest;
    memcpy(grid->color, source->color, sizeof grid->color);
    for (int k = 0; k < 3; k++)
        grid->sigma[k] = (double)source->density * (double)source->extinction[k];
    uint64_t hash = fnv_add(FNV_BEGIN, &grid->index, sizeof grid->index);
    hash = fnv_add(hash, grid->voxel_from_world, sizeof grid->voxel_from_world);
    hash = fnv_add(hash, grid->sigma, sizeof grid->sigma);
    uint64_t part = scene->part_count ? scene->parts[source->part].identity : 0;
    grid->shadow_hash = fnv_add(hash, &part, sizeof part);
}

static bool list_grids(struct scene_state *state, const struct scene_grid *grids, struct error *err)
{
    const struct scene *scene = state->scene;
    size_t count = 0;
    for (uint32_t i = 0; i < scene->node_count; i++)
        count += scene->nodes[i].grid >= 0 && state->is_visible[i];
    if (!count)
        return true;
    state->grids = calloc(count, sizeof *state->grids);
    if (!state->grids)
        return error_set(err, ERROR_NO_MEMORY, "%zu density grids", count);
    for (uint32_t i = 0; i < scene->node_count; i++) {
        int32_t index = scene->nodes[i].grid;
        struct state_grid *grid = &state->grids[state->grid_count];
        if (index < 0 || !state->is_visible[i] || !attenuates(&grids[index]) ||
            !place(&grids[index], state->world[i], grid))
            continue;
        grid->index = (uint32_t)index;
        fill(state, &grids[index], i, grid);
        state->grid_count++;
        for (int k = 0; k < 3; k++) {
            state->bounds_min[k] = fmin(state->bounds_min[k], grid->bounds_min[k]);
            state->bounds_max[k] = fmax(state->bounds_max[k], grid->bounds_max[k]);
        }
    }
    return true;
}

bool state_grids_init(struct scene_state *state, const struct view *view, struct error *err)
{
    if (!view->grid_override_count)
        return list_grids(state, state->scene->grids, err);
    struct scene_grid *grids = copy_grids(state->scene, view, err);
    bool ok = grids && list_grids(state, grids, err);
    free(grids);
    return ok;
}

void state_grids_finish(struct scene_state *state)
{
    free(state->grids);
    state->grids = NULL;
    state->grid_count = 0;
}

double state_grid_phase(const struct state_grid *grid, double cosine)
{
    const struct view_atmosphere air = {.anisotropy = (double)grid->anisotropy};
    return atmosphere_phase(&air, cosine);
}

double state_grid_dark_m(const struct state_grid *grid)
{
    static const double DARK = 20; /* optical depth */
    double least = fmin(grid->sigma[0], fmin(grid->sigma[1], grid->sigma[2]));
    return least > 0 ? DARK / least : INFINITY;
}
