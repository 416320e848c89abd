/* SPDX-License-Identifier: MIT */
/* Density grids of VITRAIL_density_grids: dense values become bricks, of which only those with
 * anything in them are kept. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/import/importer.h"
#include "renderer/import/procedural_grid.h"
#include "renderer/scene/density_grid.h"

enum { PROCEDURAL_VOXELS_MAX = 1 << 23 }; /* a procedure takes about a microsecond for each */
#define GRID_COORDINATE_MAX 1e12          /* m, as that of nodes */

static bool import_size(struct gltf_numbers size, struct scene_grid *grid, uint64_t *voxels,
                        struct error *err)
{
    *voxels = 1;
    if (size.count != 3)
        return error_set(err, ERROR_INVALID_SCENE, "size has %zu numbers, not 3", size.count);
    for (int k = 0; k < 3; k++) {
        if (!(size.values[k] >= 1 && size.values[k] <= SCENE_GRID_SIDE_MAX) ||
            floor(size.values[k]) != size.values[k])
            return error_set(err, ERROR_INVALID_SCENE,
                             "size is %g voxels along an axis, not 1 to %d", size.values[k],
                             SCENE_GRID_SIDE_MAX);
        grid->size[k] = (uint32_t)size.values[k];
        *voxels *= grid->size[k];
    }
    return *voxels <= SCENE_GRID_VOXELS_MAX ||
           error_set(err, ERROR_TOO_LARGE, "it has %llu voxels, the limit is %d",
                     (unsigned long long)*voxels, SCENE_GRID_VOXELS_MAX);
}

static bool import_factors(const struct gltf_grid *from, struct scene_grid *grid, struct error *err)
{
    for (int k = 0; k < 3; k++)
        grid->extinction[k] = grid->color[k] = 1;
    if (from->min.count != 3 || from->max.count != 3)
        return error_set(err, ERROR_INVALID_SCENE, "it needs min and max of three numbers");
    if (!import_numbers(from->min, 3, -GRID_COORDINATE_MAX, GRID_COORDINATE_MAX, grid->bounds_min,
                        "min", err) ||
        !import_numbers(from->max, 3, -GRID_COORDINATE_MAX, GRID_COORDINATE_MAX, grid->bounds_max,
                        "max", err) ||
        !import_number(from->density, 0, (double)SCENE_GRID_VALUE_MAX, &grid->density, "density",
                       err) ||
        !import_numbers(from->extinction, 3, 0, (double)SCENE_GRID_VALUE_MAX, grid->extinction,
                        "extinction", err) ||
        !import_numbers(from->color, 3, 0, 1, grid->color, "color", err))
        return false;
    for (int k = 0; k < 3; k++)
        if (!(grid->bounds_max[k] > grid->bounds_min[k]))
            return error_set(err, ERROR_INVALID_SCENE, "max is %g, not above min, %g",
                             (double)grid->bounds_max[k], (double)grid->bounds_min[k]);
    if (!(fabs(from->anisotropy) <= 0.999))
        return error_set(err, ERROR_INVALID_SCENE, "anisotropy is %g, not in [-0.999, 0.999]",
                         from->anisotropy);
    grid->anisotropy = (float)from->anisotropy;
    return true;
}

/* All values, x fastest: malloc'ed. */
static float *read_values(const struct importer *importer, const struct gltf_grid *from,
                          uint64_t voxels, uint64_t *negative, struct error *err)
{
    struct accessor accessor;
    if (!accessor_open(&importer->source, from->values, &accessor, err))
        return NULL;
    if (accessor.components != 1 || accessor.count != voxels) {
        error_set(err, ERROR_INVALID_SCENE,
                  "its values are %u elements of %d numbers, its size says %llu of 1",
                  accessor.count, accessor.components, (unsigned long long)voxels);
        return NULL;
    }
    float *values = malloc(voxels * sizeof *values);
    if (!values)
        error_set(err, ERROR_NO_MEMORY, "%llu voxels", (unsigned long long)voxels);
    for (uint32_t i = 0; values && i < accessor.count; i++) {
        bool is_good = accessor_read(&accessor, i, &values[i], err);
        if (is_good && values[i] > SCENE_GRID_VALUE_MAX)
            is_good = error_set(err, ERROR_INVALID_SCENE, "value %u is %g, the limit is %g", i,
                                (double)values[i], (double)SCENE_GRID_VALUE_MAX);
        if (!is_good) {
            free(values);
            return NULL;
        }
        *negative += values[i] < 0;
        values[i] = values[i] > 0 ? values[i] : 0; /* -0 too */
    }
    return values;
}

/* Of the brick at (x, y, z), where it is cut off by the end of the grid filled with zeros. Returns
 * the largest. */
static float take_brick(const struct scene_grid *grid, const float *values, const uint32_t at[3],
                        float out[SCENE_BRICK_VALUES])
{
    enum { SIDE = SCENE_BRICK_SIDE };
    float largest = 0;
    for (uint32_t i = 0; i < SCENE_BRICK_VALUES; i++) {
        uint32_t x = at[0] * SIDE + i % SIDE, y = at[1] * SIDE + i / SIDE % SIDE,
                 z = at[2] * SIDE + i / (SIDE * SIDE);
        bool is_inside = x < grid->size[0] && y < grid->size[1] && z < grid->size[2];
        out[i] =
            is_inside ? values[x + (uint64_t)grid->size[0] * (y + (uint64_t)grid->size[1] * z)] : 0;
        largest = out[i] > largest ? out[i] : largest;
    }
    return largest;
}

static bool append_bricks(struct blob_writer *writer, struct scene_grid *grid, const float *values,
                          struct error *err)
{
    enum { SIDE = SCENE_BRICK_SIDE };
    uint64_t count = scene_grid_brick_count(grid);
    grid->first_brick = (uint32_t)writer->sections[SCENE_GRID_BRICKS].count;
    if (!blob_writer_append(writer, SCENE_GRID_BRICKS, count, err))
        return false;
    uint32_t along[2] = {(grid->size[0] + SIDE - 1) / SIDE, (grid->size[1] + SIDE - 1) / SIDE};
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t at[3] = {i % along[0], i / along[0] % along[1], i / along[0] / along[1]};
        float brick[SCENE_BRICK_VALUES];
        float largest = take_brick(grid, values, at, brick);
        if (!(largest > 0))
            continue;
        float *kept = blob_writer_append(writer, SCENE_GRID_VALUES, 1, err);
        if (!kept)
            return false;
        memcpy(kept, brick, sizeof brick);
        struct scene_grid_brick *record =
            (struct scene_grid_brick *)writer->sections[SCENE_GRID_BRICKS].records +
            grid->first_brick + i;
        record->values = (uint32_t)writer->sections[SCENE_GRID_VALUES].count;
        record->largest = largest;
        grid->largest = largest > grid->largest ? largest : grid->largest;
    }
    return true;
}

static float *make_values(const struct gltf_grid *from, const struct scene_grid *grid,
                          uint64_t voxels, struct error *err)
{
    struct procedural_grid procedure = {.octaves = (int)from->detail,
                                        .seed = (uint32_t)(uint64_t)from->seed};
    int shape = 0;
    while (procedural_shape_name(shape) &&
           strcmp(procedural_shape_name(shape), from->procedure) != 0)
        shape++;
    if (!procedural_shape_name(shape)) {
        error_set(err, ERROR_INVALID_SCENE,
                  "the type of its procedure is '%.40s', not smoke, fog "
                  "or cloud",
                  from->procedure);
        return NULL;
    }
    if (!(from->detail >= 1 && from->detail <= PROCEDURAL_OCTAVES_MAX) ||
        !(from->seed <= UINT32_MAX)) {
        error_set(err, ERROR_INVALID_SCENE,
                  "its procedure has the detail %g and the seed %g, which are in [1, %d] and "
                  "[0, %u]",
                  from->detail, from->seed, PROCEDURAL_OCTAVES_MAX, UINT32_MAX);
        return NULL;
    }
    if (voxels > PROCEDURAL_VOXELS_MAX) {
        error_set(err, ERROR_TOO_LARGE, "its procedure has %llu voxels, the limit is %d",
                  (unsigned long long)voxels, PROCEDURAL_VOXELS_MAX);
        return NULL;
    }
    float *values = malloc(voxels * sizeof *values);
    procedure.shape = (enum procedural_shape)shape;
    if (values)
        procedural_grid_fill(&procedure, grid->size, values);
    else
        error_set(err, ERROR_NO_MEMORY, "%llu voxels", (unsigned long long)voxels);
    return values;
}

static bool import_grid(struct importer *importer, const struct gltf_grid *from, uint64_t *negative,
                        struct error *err)
{
    struct scene_grid grid = {.size = {0}};
    uint64_t voxels;
    if (!import_size(from->size, &grid, &voxels, err) || !import_factors(from, &grid, err))
        return false;
    if ((from->values >= 0) == (from->procedure != NULL))
        return error_set(err, ERROR_INVALID_SCENE, "it needs either values or a procedure");
    float *values = from->procedure ? make_values(from, &grid, voxels, err)
                                    : read_values(importer, from, voxels, negative, err);
    bool is_done = values && append_bricks(&importer->writer, &grid, values, err) &&
                   blob_writer_add_text(&importer->writer, from->name, &grid.name, err);
    free(values);
    struct scene_grid *record =
        is_done ? blob_writer_append(&importer->writer, SCENE_GRIDS, 1, err) : NULL;
    if (record)
        *record = grid;
    return record != NULL;
}

bool import_grids(struct importer *importer, struct error *err)
{
    uint64_t negative = 0;
    for (size_t i = 0; i < importer->document->grid_count; i++) {
        const struct gltf_grid *from = &importer->document->grids[i];
        if (!import_grid(importer, from, &negative, err))
            return error_wrap(err, "density grid %zu '%s'", i, from->name);
    }
    return negative == 0 ||
           importer_warn(importer, err, "%llu %s of density grids below 0: taken as 0",
                         (unsigned long long)negative, negative == 1 ? "value" : "values");
}
