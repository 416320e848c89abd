/* SPDX-License-Identifier: MIT */
/* The growing arrays of a shape, and its flat pieces: quads, grids, boxes and cloth. */
#include "glb/shapes_internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

void shape_finish(struct shape *shape)
{
    free(shape->positions);
    free(shape->normals);
    free(shape->texcoords);
    free(shape->indices);
    memset(shape, 0, sizeof *shape);
}

void shape_set_place(struct shape *shape, const double origin[3], const double x_axis[3],
                     const double y_axis[3])
{
    static const double zero[3] = {0, 0, 0}, unit_x[3] = {1, 0, 0}, unit_y[3] = {0, 1, 0};
    const double *x = x_axis ? x_axis : unit_x, *y = y_axis ? y_axis : unit_y;
    memcpy(shape->origin, origin ? origin : zero, sizeof shape->origin);
    memcpy(shape->x, x, sizeof shape->x);
    memcpy(shape->y, y, sizeof shape->y);
    for (int i = 0; i < 3; i++)
        shape->z[i] = x[(i + 1) % 3] * y[(i + 2) % 3] - x[(i + 2) % 3] * y[(i + 1) % 3];
}

int shape_give_mesh(struct shape *shape, struct glb_builder *builder, const char *name,
                    int material)
{
    int mesh = 0;
    if (shape->is_out_of_memory) {
        struct error cause = {0};
        error_set(&cause, ERROR_NO_MEMORY, "shape '%s'", name);
        glb_builder_fail(builder, &cause);
    } else {
        struct glb_primitive_desc primitive = {
            .material = material,
            .vertex_count = shape->vertex_count,
            .positions = shape->positions,
            .normals = shape->normals,
            .texcoords = shape->texcoords,
            .indices = shape->indices,
            .index_count = shape->index_count,
        };
        mesh = glb_builder_add_mesh(builder, name, &primitive, 1);
    }
    shape_finish(shape);
    return mesh;
}

/* Gives *array room for count elements of `each` floats. */
static bool grow_floats(float **array, size_t count, size_t each)
{
    float *grown = reallocarray(*array, count, each * sizeof *grown);
    if (grown)
        *array = grown;
    return grown != NULL;
}

static void fail(struct shape *shape)
{
    shape_finish(shape);
    shape->is_out_of_memory = true;
}

uint32_t shape_add_vertex(struct shape *shape, const double position[3], const double normal[3],
                          double u, double v)
{
    if (shape->is_out_of_memory)
        return 0;
    if (shape->x[0] == 0 && shape->x[1] == 0 && shape->x[2] == 0)
        shape_set_place(shape, shape->origin, NULL, NULL);
    if (shape->vertex_count == shape->vertex_capacity) {
        size_t capacity = shape->vertex_capacity ? 2 * shape->vertex_capacity : 256;
        if (capacity > INT32_MAX || !grow_floats(&shape->positions, capacity, 3) ||
            !grow_floats(&shape->normals, capacity, 3) ||
            !grow_floats(&shape->texcoords, capacity, 2)) {
            fail(shape);
            return 0;
        }
        shape->vertex_capacity = capacity;
    }
    size_t index = shape->vertex_count++;
    double n[3], length = 0;
    for (int i = 0; i < 3; i++) {
        n[i] = shape->x[i] * normal[0] + shape->y[i] * normal[1] + shape->z[i] * normal[2];
        length += n[i] * n[i];
    }
    double inverse_length = length > 0 ? 1 / sqrt(length) : 0;
    for (int i = 0; i < 3; i++) {
        shape->positions[3 * index + (size_t)i] =
            (float)(shape->origin[i] + shape->x[i] * position[0] + shape->y[i] * position[1] +
                    shape->z[i] * position[2]);
        shape->normals[3 * index + (size_t)i] = (float)(n[i] * inverse_length);
    }
    shape->texcoords[2 * index] = (float)u;
    shape->texcoords[2 * index + 1] = (float)v;
    return (uint32_t)index;
}

void shape_add_triangle(struct shape *shape, uint32_t a, uint32_t b, uint32_t c)
{
    if (shape->is_out_of_memory)
        return;
    if (shape->index_count + 3 > shape->index_capacity) {
        size_t capacity = shape->index_capacity ? 2 * shape->index_capacity : 768;
        uint32_t *grown = reallocarray(shape->indices, capacity, sizeof *grown);
        if (!grown) {
            fail(shape);
            return;
        }
        shape->indices = grown;
        shape->index_capacity = capacity;
    }
    uint32_t *at = shape->indices + shape->index_count;
    at[0] = a;
    at[1] = b;
    at[2] = c;
    shape->index_count += 3;
}

void shape_add_cell(struct shape *shape, uint32_t a, uint32_t b, uint32_t c, uint32_t d)
{
    shape_add_triangle(shape, a, b, c);
    shape_add_triangle(shape, a, c, d);
}

void shape_add_quad(struct shape *shape, const double corner[3], const double edge_u[3],
                    const double edge_v[3])
{
    shape_add_grid(shape, corner, edge_u, edge_v, 1, 1);
}

void shape_add_grid(struct shape *shape, const double corner[3], const double edge_u[3],
                    const double edge_v[3], int columns, int rows)
{
    double normal[3];
    for (int i = 0; i < 3; i++)
        normal[i] =
            edge_u[(i + 1) % 3] * edge_v[(i + 2) % 3] - edge_u[(i + 2) % 3] * edge_v[(i + 1) % 3];
    uint32_t first = (uint32_t)shape->vertex_count, stride = (uint32_t)columns + 1;
    for (int row = 0; row <= rows; row++)
        for (int column = 0; column <= columns; column++) {
            double s = (double)column / columns, t = (double)row / rows;
            double p[3];
            for (int i = 0; i < 3; i++)
                p[i] = corner[i] + s * edge_u[i] + t * edge_v[i];
            shape_add_vertex(shape, p, normal, s, 1 - t);
        }
    for (uint32_t row = 0; row < (uint32_t)rows; row++)
        for (uint32_t column = 0; column < (uint32_t)columns; column++) {
            uint32_t a = first + row * stride + column;
            shape_add_cell(shape, a, a + 1, a + stride + 1, a + stride);
        }
}

void shape_add_box(struct shape *shape, const double low[3], const double high[3])
{
    for (int face = 0; face < 6; face++) {
        int axis = face / 2, s = (axis + 1) % 3, t = (axis + 2) % 3;
        bool is_high = face % 2;
        double normal[3] = {0};
        normal[axis] = is_high ? 1 : -1;
        uint32_t corner[4];
        for (int i = 0; i < 4; i++) {
            double p[3];
            p[axis] = is_high ? high[axis] : low[axis];
            p[s] = i == 1 || i == 2 ? high[s] : low[s];
            p[t] = i >= 2 ? high[t] : low[t];
            /* v runs down the walls: y is t of the x faces and s of the z faces. */
            double u = axis == 0 ? p[2] : p[0], v = axis == 1 ? p[2] : -p[1];
            corner[i] = shape_add_vertex(shape, p, normal, u, v);
        }
        if (is_high)
            shape_add_cell(shape, corner[0], corner[1], corner[2], corner[3]);
        else
            shape_add_cell(shape, corner[3], corner[2], corner[1], corner[0]);
    }
}

/* Position of the cloth at (s, t) in [0,1]^2, t = 0 at the rail. */
static void curtain_point(const struct shape_curtain_desc *desc, double s, double t, double p[3])
{
    double drawn = 1 - desc->gather * t * t;
    double depth = desc->fold_depth * (0.35 + 0.65 * sqrt(t));
    double angle = 2 * pi * desc->folds * s + desc->phase_rad;
    /* A second, slower wave keeps the folds from looking machined. */
    p[0] = desc->width * s * drawn + 0.2 * depth * sin(2 * angle);
    p[1] = -desc->height * t;
    p[2] = depth * (sin(angle) + 0.35 * sin(0.37 * angle + 1.3 + 1.1 * t));
}

void shape_add_curtain(struct shape *shape, const struct shape_curtain_desc *desc)
{
    uint32_t first = (uint32_t)shape->vertex_count, stride = (uint32_t)desc->columns + 1;
    for (int row = 0; row <= desc->rows; row++)
        for (int column = 0; column <= desc->columns; column++) {
            double s = (double)column / desc->columns, t = (double)row / desc->rows, h = 1e-4;
            double p[3], along[3], down[3], normal[3];
            curtain_point(desc, s, t, p);
            curtain_point(desc, s + h, t, along);
            curtain_point(desc, s, t + h, down);
            for (int i = 0; i < 3; i++) {
                along[i] -= p[i];
                down[i] -= p[i];
            }
            for (int i = 0; i < 3; i++)
                normal[i] = (down[(i + 1) % 3] * along[(i + 2) % 3] -
                             down[(i + 2) % 3] * along[(i + 1) % 3]) /
                            (h * h);
            shape_add_vertex(shape, p, normal, s, t);
        }
    for (uint32_t row = 0; row < (uint32_t)desc->rows; row++)
        for (uint32_t column = 0; column < (uint32_t)desc->columns; column++) {
            uint32_t a = first + row * stride + column;
            shape_add_cell(shape, a + stride, a + stride + 1, a + 1, a);
        }
}
