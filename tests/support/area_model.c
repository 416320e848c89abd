/* SPDX-License-Identifier: MIT */
/* Grids of triangles in f64. */
#include "tests/support/area_model.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/base/matrix.h"

enum { OUTLINE = 15 }; /* three corners, and each of them extruded from four corners of the light */

static void to_light(const struct area_light *light, const double position[3], double out[3])
{
    double from[3];
    vec3_sub(position, light->center, from);
    for (int k = 0; k < 3; k++)
        out[k] = vec3_dot(from, light->axes[k]);
}

static void project(const struct area_model *model, const double p[3], double place[2])
{
    for (int k = 0; k < 2; k++)
        place[k] = p[k] / (p[2] + model->light->behind_m);
}

uint32_t area_model_cell(const struct area_model *model, const double place[2])
{
    uint32_t at[2];
    for (int k = 0; k < 2; k++) {
        double size = model->high[k] - model->low[k];
        double share = size > 0 ? (place[k] - model->low[k]) / size : 0;
        at[k] = (uint32_t)fmin(fmax(floor(share * model->side), 0), model->side - 1.0);
    }
    return at[1] * model->side + at[0];
}

void area_model_init(struct area_model *model, const struct area_stage *stage,
                     const struct area_light *light, uint32_t side)
{
    const size_t cells = (size_t)side * side;
    *model = (struct area_model){.light = light,
                                 .side = side,
                                 .point_count = stage->point_count,
                                 .places = calloc(stage->point_count, sizeof *model->places),
                                 .low = {INFINITY, INFINITY},
                                 .high = {-INFINITY, -INFINITY},
                                 .depths = calloc(cells, sizeof *model->depths),
                                 .cell_points = calloc(cells, sizeof *model->cell_points)};
    assert(model->places && model->depths && model->cell_points);
    for (uint32_t i = 0; i < stage->point_count; i++) {
        double p[3];
        to_light(light, stage->points[i], p);
        assert(p[2] > 0);
        project(model, p, model->places[i]);
        model->places[i][2] = p[2];
        model->farthest = fmax(model->farthest, p[2]);
        for (int k = 0; k < 2; k++) {
            model->low[k] = fmin(model->low[k], model->places[i][k]);
            model->high[k] = fmax(model->high[k], model->places[i][k]);
        }
    }
    for (size_t i = 0; i < cells; i++)
        model->depths[i] = -1;
    for (uint32_t i = 0; i < stage->point_count; i++) {
        uint32_t cell = area_model_cell(model, model->places[i]);
        model->depths[cell] = fmax(model->depths[cell], model->places[i][2]);
        model->cell_points[cell]++;
    }
}

void area_model_finish(struct area_model *model)
{
    free(model->places);
    free(model->depths);
    free(model->cell_points);
    *model = (struct area_model){.light = NULL};
}

/* Returns the depth of the triangle's nearest corner. */
static double find_outline(const struct area_model *model, const struct area_triangle *triangle,
                           double depth_m, double outline[OUTLINE][2])
{
    const double *half = model->light->half;
    double nearest = INFINITY;
    for (int i = 0; i < 3; i++) {
        double p[3];
        to_light(model->light, triangle->at[i], p);
        assert(p[2] > 0);
        nearest = fmin(nearest, p[2]);
        project(model, p, outline[5 * i]);
        double ratio = fmax(depth_m / p[2], 1);
        for (int j = 0; j < 4; j++) {
            double corner[2] = {j & 1 ? half[0] : -half[0], j & 2 ? half[1] : -half[1]};
            double f[3] = {corner[0] + (p[0] - corner[0]) * ratio,
                           corner[1] + (p[1] - corner[1]) * ratio, fmax(depth_m, p[2])};
            project(model, f, outline[5 * i + 1 + j]);
        }
    }
    return nearest;
}

static double rectangle_of(const struct area_model *model, const struct area_triangle *triangle,
                           double depth_m, struct area_rectangle *rectangle)
{
    double outline[OUTLINE][2], nearest = find_outline(model, triangle, depth_m, outline);
    for (int k = 0; k < 2; k++) {
        rectangle->low[k] = INFINITY;
        rectangle->high[k] = -INFINITY;
        for (int i = 0; i < OUTLINE; i++) {
            rectangle->low[k] = fmin(rectangle->low[k], outline[i][k]);
            rectangle->high[k] = fmax(rectangle->high[k], outline[i][k]);
        }
    }
    return nearest;
}

struct area_rectangle area_model_rectangle(const struct area_model *model,
                                           const struct area_triangle *triangle, double depth_m)
{
    struct area_rectangle rectangle;
    rectangle_of(model, triangle, depth_m, &rectangle);
    return rectangle;
}

struct cells { /* columns and rows, last ones included */
    uint32_t first[2], last[2];
};

/* False: the rectangle is beside all points. */
static bool find_cells(const struct area_model *model, const struct area_rectangle *rectangle,
                       double margin, struct cells *cells)
{
    double low[2], high[2];
    for (int k = 0; k < 2; k++) {
        low[k] = rectangle->low[k] - margin;
        high[k] = rectangle->high[k] + margin;
        if (low[k] > model->high[k] || high[k] < model->low[k])
            return false;
    }
    uint32_t first = area_model_cell(model, low), last = area_model_cell(model, high);
    *cells = (struct cells){.first = {first % model->side, first / model->side},
                            .last = {last % model->side, last / model->side}};
    return true;
}

static double depth_of(const struct area_model *model, const struct cells *cells)
{
    double depth = -1;
    for (uint32_t y = cells->first[1]; y <= cells->last[1]; y++)
        for (uint32_t x = cells->first[0]; x <= cells->last[0]; x++)
            depth = fmax(depth, model->depths[y * model->side + x]);
    return depth;
}

/* Whether cells are met that hold a point behind the triangle. depth_m, in and out: to which the
 * triangle is extruded, and that of the farthest of their points. */
static bool narrow(const struct area_model *model, const struct area_triangle *triangle,
                   struct area_margins margins, double *depth_m, struct cells *cells)
{
    struct area_rectangle rectangle;
    double nearest = rectangle_of(model, triangle, *depth_m, &rectangle);
    if (!find_cells(model, &rectangle, margins.place, cells))
        return false;
    *depth_m = depth_of(model, cells) + margins.depth_m;
    return *depth_m >= nearest;
}

double area_model_depth(const struct area_model *model, const struct area_triangle *triangle,
                        struct area_margins margins)
{
    struct cells cells;
    double depth_m = model->farthest + margins.depth_m;
    return narrow(model, triangle, margins, &depth_m, &cells) ? depth_m : -1;
}

void area_model_assign(const struct area_model *model, const struct area_triangle *triangle,
                       enum area_extrusion extrusion, struct area_margins margins,
                       void (*visit)(void *context, uint32_t cell), void *context)
{
    struct cells cells, own;
    struct area_rectangle rectangle;
    double depth_m = model->farthest + margins.depth_m;
    if (extrusion != AREA_EXTRUDE_ALL)
        depth_m = area_model_depth(model, triangle, margins);
    if (depth_m < 0)
        return;
    double nearest = rectangle_of(model, triangle, depth_m, &rectangle);
    if (!find_cells(model, &rectangle, margins.place, &cells))
        return;
    for (uint32_t y = cells.first[1]; y <= cells.last[1]; y++)
        for (uint32_t x = cells.first[0]; x <= cells.last[0]; x++) {
            uint32_t cell = y * model->side + x;
            if (model->depths[cell] < 0 || model->depths[cell] + margins.depth_m < nearest)
                continue;
            if (extrusion == AREA_EXTRUDE_CELL) {
                rectangle_of(model, triangle, model->depths[cell], &rectangle);
                if (!find_cells(model, &rectangle, margins.place, &own) || x < own.first[0] ||
                    x > own.last[0] || y < own.first[1] || y > own.last[1])
                    continue;
            }
            visit(context, cell);
        }
}

/* ---- convex hulls ---- */

static int compare_places(const void *a, const void *b)
{
    const double *p = a, *q = b;
    if (p[0] != q[0])
        return p[0] < q[0] ? -1 : 1;
    return p[1] < q[1] ? -1 : p[1] > q[1];
}

static double turn(const double a[2], const double b[2], const double c[2])
{
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/* Andrew's monotone chain: counter-clockwise. Sorts the points; returns the number of corners. */
static int find_hull(double points[OUTLINE][2], double hull[OUTLINE + 1][2])
{
    int count = 0;
    qsort(points, OUTLINE, sizeof *points, compare_places);
    for (int pass = 0; pass < 2; pass++) {
        int begin = count;
        for (int i = 0; i < OUTLINE; i++) {
            const double *p = points[pass ? OUTLINE - 1 - i : i];
            while (count >= begin + 2 && turn(hull[count - 2], hull[count - 1], p) <= 0)
                count--;
            memcpy(hull[count++], p, sizeof *hull);
        }
        count--; /* begins the other chain */
    }
    return count;
}

static bool is_within(double hull[OUTLINE + 1][2], int count, const double place[2])
{
    for (int i = 0; i < count; i++)
        if (turn(hull[i], hull[(i + 1) % count], place) < 0)
            return false;
    return true;
}

void area_model_count_hull(const struct area_model *model, const struct area_triangle *triangle,
                           uint64_t *in_rectangle, uint64_t *in_hull)
{
    double outline[OUTLINE][2], hull[OUTLINE + 1][2];
    double depth_m = area_model_depth(model, triangle, (struct area_margins){.place = 0});
    *in_rectangle = *in_hull = 0;
    if (depth_m < 0)
        return;
    const struct area_rectangle box = area_model_rectangle(model, triangle, depth_m);
    find_outline(model, triangle, depth_m, outline);
    int count = find_hull(outline, hull);
    for (uint32_t i = 0; i < model->point_count; i++) {
        const double *p = model->places[i];
        if (p[0] < box.low[0] || p[0] > box.high[0] || p[1] < box.low[1] || p[1] > box.high[1])
            continue;
        ++*in_rectangle;
        *in_hull += is_within(hull, count, p);
    }
}
