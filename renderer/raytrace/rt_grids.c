/* SPDX-License-Identifier: MIT */
/* Optical depths of density grids along rays. */
#include "renderer/raytrace/rt_grids.h"

#include <math.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"

static bool begin(const struct rt_scene *scene, const struct state_grid *grid,
                  const struct rt_ray *ray, const double range[2], double from, double to,
                  struct density_walk *walk)
{
    double origin[3], step[3];
    for (int k = 0; k < 3; k++)
        origin[k] = ray->origin[k] + scene->origin[k];
    mat4_transform_point(grid->voxel_from_world, origin, origin);
    mat4_transform_direction(grid->voxel_from_world, ray->direction, step);
    return density_walk_begin(walk, &grid->values, origin, step, fmax(from, range[0]),
                              fmin(to, range[1]));
}

void rt_grids_pass(const struct rt_scene *scene, const struct rt_ray *ray, const double range[2],
                   double from, double to, double through[3])
{
    double unit_m = vec3_length(ray->direction);
    for (size_t i = 0; i < scene->state->grid_count; i++) {
        const struct state_grid *grid = &scene->state->grids[i];
        struct density_walk walk;
        struct density_piece piece;
        double deep = 0, dark = state_grid_dark_m(grid) / unit_m;
        if (!begin(scene, grid, ray, range, from, to, &walk))
            continue;
        while (deep < dark && density_walk_next(&walk, &piece))
            if (piece.bound > 0)
                deep += density_walk_integrate(&walk, piece.from, piece.to);
        for (int k = 0; k < 3; k++)
            through[k] *= exp(-grid->sigma[k] * deep * unit_m);
    }
}

bool rt_grid_lines_init(struct rt_grid_lines *lines, const struct scene_state *state,
                        struct error *err)
{
    size_t longest = 0;
    *lines = (struct rt_grid_lines){.count = 0};
    if (!state->grid_count)
        return true;
    for (size_t i = 0; i < state->grid_count; i++) {
        const uint32_t *size = state->grids[i].values.size;
        size_t borders = (size_t)size[0] + size[1] + size[2] + 8;
        longest = borders > longest ? borders : longest;
    }
    lines->capacity = longest;
    lines->lines = calloc(state->grid_count, sizeof *lines->lines);
    lines->borders = calloc(2 * longest * state->grid_count, sizeof *lines->borders);
    return (lines->lines && lines->borders) ||
           error_set(err, ERROR_NO_MEMORY, "%zu density grids on a ray", state->grid_count);
}

void rt_grid_lines_finish(struct rt_grid_lines *lines)
{
    free(lines->lines);
    free(lines->borders);
    *lines = (struct rt_grid_lines){.count = 0};
}

/* Where there is no more room for borders, which rounding alone can bring about, the last piece is
 * as long as what is left. */
static void fill(struct rt_grid_line *line, size_t capacity, double unit_m, double *at,
                 double *deep)
{
    struct density_piece piece;
    const double dark = state_grid_dark_m(line->grid);
    at[0] = line->walk.t;
    deep[0] = 0;
    line->count = 1;
    while (deep[line->count - 1] < dark && density_walk_next(&line->walk, &piece)) {
        size_t last = line->count - 1;
        double more =
            piece.bound > 0 ? density_walk_integrate(&line->walk, piece.from, piece.to) : 0;
        if (line->count < capacity) {
            deep[line->count] = deep[last];
            last = line->count++;
        }
        deep[last] += more * unit_m;
        at[last] = piece.to;
    }
    line->at = at;
    line->deep = deep;
}

void rt_grid_lines_find(struct rt_grid_lines *lines, const struct rt_scene *scene,
                        const struct rt_ray *ray, const double range[2], double from, double to)
{
    lines->count = 0;
    lines->unit_m = vec3_length(ray->direction);
    for (size_t i = 0; i < scene->state->grid_count; i++) {
        struct rt_grid_line *line = &lines->lines[lines->count];
        double *borders = lines->borders + 2 * lines->capacity * lines->count;
        line->grid = &scene->state->grids[i];
        if (!begin(scene, line->grid, ray, range, from, to, &line->walk))
            continue;
        fill(line, lines->capacity, lines->unit_m, borders, borders + lines->capacity);
        lines->count += line->count >= 2 && line->deep[line->count - 1] > 0;
    }
}

double rt_grid_line_deep(const struct rt_grid_lines *lines, const struct rt_grid_line *line,
                         double at)
{
    size_t low = 0, high = line->count - 1;
    if (at <= line->at[0])
        return 0;
    if (at >= line->at[high])
        return line->deep[high];
    while (high - low > 1) {
        size_t middle = (low + high) / 2;
        *(line->at[middle] <= at ? &low : &high) = middle;
    }
    if (line->deep[high] == line->deep[low])
        return line->deep[low];
    return line->deep[low] + density_walk_integrate(&line->walk, line->at[low], at) * lines->unit_m;
}

double rt_grid_line_value(const struct rt_grid_line *line, double at)
{
    double point[3];
    for (int k = 0; k < 3; k++)
        point[k] = line->walk.from[k] + at * line->walk.step[k];
    return density_grid_at(line->walk.grid, point);
}

void rt_grid_lines_pass(const struct rt_grid_lines *lines, double at, double through[3])
{
    for (size_t i = 0; i < lines->count; i++) {
        double deep = rt_grid_line_deep(lines, &lines->lines[i], at);
        for (int k = 0; k < 3; k++)
            through[k] *= exp(-lines->lines[i].grid->sigma[k] * deep);
    }
}
