/* SPDX-License-Identifier: MIT */
/* Density grids of the GLB builder. */
#include <float.h>

#include "glb/glb_internal.h"

enum { GL_COMPONENT_FLOAT = 5126 };

static bool is_zero(const double values[3])
{
    return values[0] == 0 && values[1] == 0 && values[2] == 0;
}

static const double ones[3] = {1, 1, 1};

static bool check(struct glb_builder *builder, const struct glb_grid_desc *desc)
{
    for (int k = 0; k < 3; k++)
        if (!glb_check_range(builder, desc->size[k], 1, 8192, "grid.size") ||
            !glb_check_range(builder, desc->color[k], 0, 1, "grid.color") ||
            !glb_check_range(builder, desc->extinction[k], 0, FLT_MAX, "grid.extinction"))
            return false;
    return glb_check_range(builder, desc->density, 0, FLT_MAX, "grid.density") &&
           glb_check_range(builder, desc->anisotropy, -0.999, 0.999, "grid.anisotropy");
}

int glb_builder_add_grid(struct glb_builder *builder, const struct glb_grid_desc *desc)
{
    if (builder->failure.code != ERROR_NONE)
        return 0;
    if (!check(builder, desc))
        return error_wrap(&builder->failure, "grid '%s'", desc->name ? desc->name : "");
    size_t count = (size_t)desc->size[0] * desc->size[1] * desc->size[2];
    const double size[3] = {desc->size[0], desc->size[1], desc->size[2]};
    int view = glb_add_view(builder, desc->values, count * sizeof *desc->values, 0);
    int values = glb_append(builder, GLB_KIND_ACCESSOR,
                            glb_accessor(builder, view, GL_COMPONENT_FLOAT, count, "SCALAR"));
    if (!values)
        return 0;
    json_t *grid = glb_object(builder);
    glb_put_name(builder, grid, desc->name);
    glb_put(builder, grid, "size", glb_numbers(builder, size, 3, "grid.size"));
    glb_put(builder, grid, "values", json_integer(values - 1));
    glb_put(builder, grid, "min", glb_numbers(builder, desc->low, 3, "grid.low"));
    glb_put(builder, grid, "max", glb_numbers(builder, desc->high, 3, "grid.high"));
    if (desc->density != 0)
        glb_put(builder, grid, "density", glb_number(builder, desc->density, "grid.density"));
    const double *color = is_zero(desc->color) && !desc->is_black ? ones : desc->color;
    glb_put(builder, grid, "color", glb_numbers(builder, color, 3, "grid.color"));
    glb_put(builder, grid, "extinction",
            glb_numbers(builder, is_zero(desc->extinction) ? ones : desc->extinction, 3,
                        "grid.extinction"));
    glb_put(builder, grid, "anisotropy", glb_number(builder, desc->anisotropy, "grid.anisotropy"));
    glb_use_extension(builder, "VITRAIL_density_grids");
    return glb_append(builder, GLB_KIND_GRID, grid);
}
