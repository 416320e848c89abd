/* SPDX-License-Identifier: MIT */
/* What a camera sees, about: a sample of the triangles is clipped to the image and laid over a
 * coarse grid of cells. Each sampled triangle stands for its neighbours in the file, which
 * modelling programs write side by side. */
#include <float.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"
#include "renderer/cost/workload.h"

enum {
    COLUMNS = SCENE_COLUMNS,
    ROWS = SCENE_ROWS,
    CELLS = COLUMNS * ROWS,
    TRIANGLES_MAX = 4096, /* sampled: half a millisecond */
    COARSE_TRIANGLES_MIN = 256,
    COARSE_PIXELS = 16, /* of a frame of a view in motion, for each triangle */
    ITEM_TRIANGLES_MIN = 4,
    FINE = 4, /* rays through a cell, per side, where layers are peeled */
    POINTS = CELLS * FINE * FINE,
    PEELED_TRIANGLES_MAX = 1 << 16, /* that are laid over them: 20 milliseconds */
    CORNERS_MAX = 9,                /* of a triangle cut by five planes, and one to spare */
};

/* Where peeling ends (shaders/transparency/peeled_add.comp.glsl), -log2; layers that edges add with
 * samples, times: as on generated scenes of panes. */
static const double PEELED_STOPS = 25, PEELED_EDGES = 2;

struct polygon { /* in view space: x right, y up, z forward */
    double corners[CORNERS_MAX][3];
    int count;
};

struct sampled {    /* a triangle's visible part */
    double area;    /* share of the image */
    double weight;  /* triangles that it stands for */
    double x, y, z; /* middle, in cells; view depth */
    double world[3], normal[3];
    double plane[4]; /* in view space: x, y and z by the first three make the fourth */
    bool is_opaque;
    int textures;
    struct polygon shown; /* x and y in cells, z the depth */
};

/* A ray of the camera, before what is opaque: transparent surfaces, and -log2 of what they let
 * through. */
struct peeled_point {
    double layers, stops;
};

struct canvas {
    const struct workload_desc *desc;
    struct sampled *items;
    size_t count;
    double covered[CELLS]; /* share of the cell's area with something opaque */
    double depth[CELLS];   /* of what is opaque */
    double end[CELLS];     /* the same, of planes in the cell's middle */
    struct peeled_point points[POINTS];
};

/* ---- clipping ---- */

/* Signed distance from one of the frustum's planes, positive inside. */
static double inside(const struct camera *camera, int plane, const double p[3])
{
    double reach = camera->is_orthographic ? 1 : p[2];
    switch (plane) {
    case 0:
        return p[2] - (camera->is_orthographic ? 0 : camera->z_near);
    case 1:
        return camera->half_width * reach - p[0];
    case 2:
        return camera->half_width * reach + p[0];
    case 3:
        return camera->half_height * reach - p[1];
    default:
        return camera->half_height * reach + p[1];
    }
}

/* Sutherland and Hodgman 1974, "Reentrant polygon clipping". */
static void clip(const struct camera *camera, struct polygon *polygon)
{
    for (int plane = 0; plane < 5 && polygon->count; plane++) {
        struct polygon from = *polygon;
        polygon->count = 0;
        for (int i = 0; i < from.count; i++) {
            const double *a = from.corners[i], *b = from.corners[(i + 1) % from.count];
            double da = inside(camera, plane, a), db = inside(camera, plane, b);
            if (da >= 0 && polygon->count < CORNERS_MAX)
                memcpy(polygon->corners[polygon->count++], a, sizeof polygon->corners[0]);
            if ((da >= 0) == (db >= 0) || polygon->count >= CORNERS_MAX)
                continue;
            double t = da / (da - db), *cut = polygon->corners[polygon->count++];
            for (int k = 0; k < 3; k++)
                cut[k] = a[k] + t * (b[k] - a[k]);
        }
    }
}

/* To cells, keeping the depth; returns twice the signed area in cells. */
static double project(const struct camera *camera, struct polygon *polygon)
{
    double area = 0;
    for (int i = 0; i < polygon->count; i++) {
        double *p = polygon->corners[i], reach = camera->is_orthographic ? 1 : p[2];
        p[0] = (p[0] / (camera->half_width * reach) + 1) * 0.5 * COLUMNS;
        p[1] = (p[1] / (camera->half_height * reach) + 1) * 0.5 * ROWS;
    }
    for (int i = 0; i < polygon->count; i++) {
        const double *a = polygon->corners[i], *b = polygon->corners[(i + 1) % polygon->count];
        area += a[0] * b[1] - a[1] * b[0];
    }
    return area;
}

/* ---- sampling ---- */

static int count_textures(const struct scene_material *material)
{
    int count = 0;
    for (int slot = 0; slot < SCENE_TEXTURE_SLOT_COUNT; slot++)
        count += material->textures[slot].texture >= 0;
    return count;
}

static void set_plane(struct sampled *sampled)
{
    double edges[2][3];
    vec3_sub(sampled->shown.corners[1], sampled->shown.corners[0], edges[0]);
    vec3_sub(sampled->shown.corners[2], sampled->shown.corners[0], edges[1]);
    vec3_cross(edges[0], edges[1], sampled->plane);
    sampled->plane[3] = vec3_dot(sampled->plane, sampled->shown.corners[0]);
}

static void take_triangle(struct canvas *canvas, const struct state_item *item, uint32_t triangle,
                          double weight)
{
    const struct scene_state *state = canvas->desc->state;
    const struct camera *camera = canvas->desc->camera;
    const struct state_geometry geometry = state_geometry_of(state, item);
    struct sampled *sampled = &canvas->items[canvas->count];
    double world[3][3], edges[2][3], to_eye[3];
    *sampled = (struct sampled){.weight = weight,
                                .is_opaque = item->class_ != STATE_TRANSPARENT,
                                .textures = count_textures(&state->materials[item->material].base)};
    for (uint32_t i = 0; i < 3; i++) {
        state_geometry_corner(&geometry, 3 * (size_t)triangle + i, world[i]);
        camera_to_view(camera, world[i], sampled->shown.corners[i]);
    }
    sampled->shown.count = 3;
    set_plane(sampled);
    clip(camera, &sampled->shown);
    double area = 0.5 * project(camera, &sampled->shown) * (item->is_mirrored ? -1 : 1);
    bool is_culled =
        !(state->materials[item->material].base.flags & SCENE_MATERIAL_DOUBLE_SIDED) && area < 0;
    sampled->area = fabs(area) / CELLS;
    if (!(sampled->area > 0) || !isfinite(sampled->area) || is_culled)
        return;
    for (int i = 0; i < sampled->shown.count; i++) {
        sampled->x += sampled->shown.corners[i][0] / sampled->shown.count;
        sampled->y += sampled->shown.corners[i][1] / sampled->shown.count;
        sampled->z += sampled->shown.corners[i][2] / sampled->shown.count;
    }
    vec3_sub(world[1], world[0], edges[0]);
    vec3_sub(world[2], world[0], edges[1]);
    vec3_cross(edges[0], edges[1], sampled->normal);
    if (!vec3_normalize(sampled->normal))
        return;
    double reach = camera->is_orthographic ? 1 : sampled->z;
    double x = (2 * sampled->x / COLUMNS - 1) * camera->half_width * reach;
    double y = (2 * sampled->y / ROWS - 1) * camera->half_height * reach;
    for (int k = 0; k < 3; k++)
        sampled->world[k] = camera->eye[k] + x * camera->right[k] + y * camera->up[k] -
                            sampled->z * camera->back[k];
    vec3_sub(camera->eye, sampled->world, to_eye);
    if (vec3_dot(to_eye, sampled->normal) < 0)
        for (int k = 0; k < 3; k++)
            sampled->normal[k] = -sampled->normal[k];
    canvas->count++;
}

static uint32_t triangles_of(const struct scene_state *state, const struct state_item *item)
{
    const struct scene_primitive *p = &state->scene->primitives[item->primitive];
    return p->topology == SCENE_TRIANGLES ? p->index_count / 3 : 0;
}

/* Of a picture that takes a few milliseconds no more is looked at than it is worth. */
static double triangles_wanted(const struct view *view)
{
    double pixels = (double)view->width_px * view->height_px;
    double coarse = fmax(pixels / COARSE_PIXELS, COARSE_TRIANGLES_MIN);
    return 0.5 * (view->quality.may_be_coarse ? fmin(coarse, TRIANGLES_MAX) : TRIANGLES_MAX);
}

static void sample(struct canvas *canvas, struct scene_sampling *sampling)
{
    const struct scene_state *state = canvas->desc->state;
    for (size_t i = 0; i < state->whole_count; i++) {
        double triangles = triangles_of(state, &state->items[i]);
        sampling->triangles += triangles;
        if (!camera_may_see(canvas->desc->camera, state->items[i].center, state->items[i].radius_m,
                            1))
            continue;
        sampling->triangles_in_view += triangles;
        if (state->items[i].class_ == STATE_TRANSPARENT)
            sampling->peeled_triangles += triangles;
    }
    double wanted_in_all = triangles_wanted(canvas->desc->view);
    double share = fmin(1, wanted_in_all / fmax(sampling->triangles_in_view, 1));
    for (size_t i = 0; i < state->whole_count; i++) {
        const struct state_item *item = &state->items[i];
        uint32_t triangles = triangles_of(state, item);
        if (!triangles || !camera_may_see(canvas->desc->camera, item->center, item->radius_m, 1))
            continue;
        double wanted = fmax(ceil(share * triangles), ITEM_TRIANGLES_MIN);
        uint32_t step = (uint32_t)fmax(1, floor(triangles / wanted));
        uint32_t taken = (triangles + step - 1) / step;
        for (uint32_t t = 0; t < triangles && canvas->count < TRIANGLES_MAX; t += step)
            take_triangle(canvas, item, t, (double)triangles / taken);
    }
}

/* ---- the grid ---- */

static bool holds(const struct polygon *polygon, double x, double y)
{
    bool has_left = false, has_right = false;
    for (int i = 0; i < polygon->count; i++) {
        const double *a = polygon->corners[i], *b = polygon->corners[(i + 1) % polygon->count];
        double side = (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]);
        has_left |= side > 0;
        has_right |= side < 0;
    }
    return !(has_left && has_right);
}

static int cell_at(double x, double y)
{
    int column = (int)fmin(fmax(x, 0), COLUMNS - 1), row = (int)fmin(fmax(y, 0), ROWS - 1);
    return row * COLUMNS + column;
}

typedef void visit_cell(struct canvas *canvas, const struct sampled *sampled, int cell,
                        double share);

/* A small triangle and its neighbours, as a square about it. */
static void spread_square(struct canvas *canvas, const struct sampled *sampled, visit_cell *visit)
{
    double cells = sampled->area * CELLS * sampled->weight;
    int side = (int)ceil(sqrt(cells)), first[2], last[2];
    const double at[2] = {sampled->x, sampled->y};
    const int limits[2] = {COLUMNS, ROWS};
    for (int k = 0; k < 2; k++) {
        first[k] = (int)fmax(floor(at[k] - 0.5 * side + 0.5), 0);
        last[k] = (int)fmin(first[k] + fmax(side, 1), limits[k]);
        first[k] = first[k] < limits[k] ? first[k] : limits[k] - 1;
    }
    double share = cells / fmax(side * side, 1);
    for (int row = first[1]; row < last[1]; row++)
        for (int column = first[0]; column < last[0]; column++)
            visit(canvas, sampled, row * COLUMNS + column, share);
}

/* Calls `visit` for each cell that the triangle and those it stands for lie in, with the share of
 * the cell's area that they cover together. */
static void spread(struct canvas *canvas, const struct sampled *sampled, visit_cell *visit)
{
    double cells = sampled->area * CELLS, low[2] = {DBL_MAX, DBL_MAX}, high[2] = {0, 0};
    if (cells < 0.5) {
        spread_square(canvas, sampled, visit);
        return;
    }
    for (int i = 0; i < sampled->shown.count; i++)
        for (int k = 0; k < 2; k++) {
            low[k] = fmin(low[k], sampled->shown.corners[i][k]);
            high[k] = fmax(high[k], sampled->shown.corners[i][k]);
        }
    for (int row = (int)low[1]; row < ROWS && row < high[1]; row++)
        for (int column = (int)low[0]; column < COLUMNS && column < high[0]; column++)
            if (holds(&sampled->shown, column + 0.5, row + 0.5))
                visit(canvas, sampled, row * COLUMNS + column, sampled->weight);
}

/* Of the triangle's plane at a place in cells, not beyond the triangle. */
static double depth_at(const struct camera *camera, const struct sampled *sampled, double column,
                       double row)
{
    double low = sampled->z, high = sampled->z;
    for (int i = 0; i < sampled->shown.count; i++) {
        low = fmin(low, sampled->shown.corners[i][2]);
        high = fmax(high, sampled->shown.corners[i][2]);
    }
    double x = (2 * column / COLUMNS - 1) * camera->half_width;
    double y = (2 * row / ROWS - 1) * camera->half_height;
    const double *plane = sampled->plane;
    double aside = x * plane[0] + y * plane[1];
    double depth =
        camera->is_orthographic ? (plane[3] - aside) / plane[2] : plane[3] / (plane[2] + aside);
    return isfinite(depth) ? fmin(fmax(depth, low), high) : sampled->z;
}

static void cover(struct canvas *canvas, const struct sampled *sampled, int cell, double share)
{
    const int column = cell % COLUMNS, row = cell / COLUMNS;
    canvas->covered[cell] += share;
    if (share >= 0.5)
        canvas->end[cell] = fmin(canvas->end[cell],
                                 depth_at(canvas->desc->camera, sampled, column + 0.5, row + 0.5));
    if (share >= 0.5 || canvas->covered[cell] >= 0.5)
        canvas->depth[cell] = fmin(canvas->depth[cell], sampled->z);
}

int workload_peeled_sides(enum transparency transparency)
{
    return transparency == TRANSPARENCY_DEPTH_PEELING        ? 1
           : transparency == TRANSPARENCY_DUAL_DEPTH_PEELING ? 2
                                                             : 0;
}

/* Of the view; 0 where its layers have lists, as renderer/plan/plan.c chooses. */
static int peeled_sides(const struct workload_desc *desc)
{
    const struct scene_state *state = desc->state;
    const struct view *view = desc->view;
    bool bends = false, has_media = false;
    for (size_t i = 0; i < state->whole_count; i++) {
        const struct state_item *item = &state->items[i];
        bool is_seen = camera_may_see(desc->camera, item->center, item->radius_m, 1);
        bends |= is_seen && item->bend != STATE_BEND_NONE;
        has_media |= is_seen && item->is_medium;
    }
    bends &= view->quality.refraction != VIEW_REFRACTION_OFF;
    if (bends || has_media || view_has_atmosphere(view) || state->grid_count ||
        state->ground_plane.is_there || view->outputs != 1u << VIEW_OUTPUT_COLOR)
        return 0;
    return workload_peeled_sides(view->quality.transparency);
}

/* -log2 of what the surface lets through; 0 where textures or colours tell. */
static double stops_of(const struct scene_state *state, const struct state_item *item)
{
    const struct scene_material *m = &state->materials[item->material].base;
    bool is_plain = m->alpha_mode == SCENE_BLEND && m->transmission <= 0 &&
                    m->textures[SCENE_TEXTURE_BASE_COLOR].texture < 0;
    return is_plain ? fmin(-log2(fmax(1 - (double)m->base_color[3], 1e-9)), PEELED_STOPS) : 0;
}

/* Lays a transparent triangle over the points. */
static void lay_over(struct canvas *canvas, const struct sampled *sampled, double weight,
                     double stops)
{
    double low[2] = {DBL_MAX, DBL_MAX}, high[2] = {0, 0};
    for (int i = 0; i < sampled->shown.count; i++)
        for (int k = 0; k < 2; k++) {
            low[k] = fmin(low[k], FINE * sampled->shown.corners[i][k]);
            high[k] = fmax(high[k], FINE * sampled->shown.corners[i][k]);
        }
    for (int row = (int)low[1]; row < ROWS * FINE && row < high[1]; row++)
        for (int column = (int)low[0]; column < COLUMNS * FINE && column < high[0]; column++) {
            double x = (column + 0.5) / FINE, y = (row + 0.5) / FINE;
            struct peeled_point *point = &canvas->points[row * COLUMNS * FINE + column];
            if (!holds(&sampled->shown, x, y) ||
                depth_at(canvas->desc->camera, sampled, x, y) > canvas->end[cell_at(x, y)])
                continue;
            point->layers += weight;
            point->stops += weight * stops;
        }
}

static void lay_all_over(struct canvas *canvas, const struct scene_sampling *sampling)
{
    const struct scene_state *state = canvas->desc->state;
    uint32_t step = 1 + (uint32_t)(sampling->peeled_triangles / PEELED_TRIANGLES_MAX);
    for (size_t i = 0; i < state->whole_count; i++) {
        const struct state_item *item = &state->items[i];
        double stops = stops_of(state, item);
        if (item->class_ != STATE_TRANSPARENT ||
            !camera_may_see(canvas->desc->camera, item->center, item->radius_m, 1))
            continue;
        for (uint32_t t = 0; t < triangles_of(state, item); t += step) {
            canvas->count = 0;
            take_triangle(canvas, item, t, step);
            if (canvas->count)
                lay_over(canvas, &canvas->items[0], step, stops);
        }
    }
}

/* Layers until no pixel lets anything through, which is looked at after every few sets, and no more
 * than are peeled (renderer/transparency/peeling.c). */
static double most_layers(const struct canvas *canvas, int sides)
{
    const double look = 8.0 * sides, end_of_all = 512;
    double most = 0, needed = 0;
    for (int i = 0; i < POINTS; i++) {
        const struct peeled_point *point = &canvas->points[i];
        double end = point->stops > PEELED_STOPS ? PEELED_STOPS * point->layers / point->stops
                                                 : point->layers;
        most = fmax(most, point->layers);
        needed = fmax(needed, end);
    }
    return fmin(fmin(most, end_of_all), look * ceil(needed / look));
}

/* Each time layers are drawn and lit in the bounds of what has one left. With samples, pixels that
 * an edge crosses have a layer on each of its sides. */
static void count_peels(const struct canvas *canvas, int sides, struct scene_sampling *sampling)
{
    double edges = canvas->desc->view->quality.samples == 1 ? 1 : PEELED_EDGES;
    double most = most_layers(canvas, sides), step = sides / edges;
    for (int peel = 0; peel * step < most; peel++) {
        const double peeled = peel * step;
        int low[2] = {COLUMNS * FINE, ROWS * FINE}, high[2] = {0, 0};
        for (int i = 0; i < POINTS; i++) {
            const int at[2] = {i % (COLUMNS * FINE), i / (COLUMNS * FINE)};
            for (int k = 0; k < 2 && canvas->points[i].layers > peeled; k++) {
                low[k] = at[k] < low[k] ? at[k] : low[k];
                high[k] = at[k] + 1 > high[k] ? at[k] + 1 : high[k];
            }
        }
        sampling->peeled_pixels += fmax(high[0] - low[0], 0) * fmax(high[1] - low[1], 0) / POINTS;
        sampling->peels++;
    }
}

static void sample_peels(struct canvas *canvas, struct scene_sampling *sampling)
{
    int sides = peeled_sides(canvas->desc);
    sampling->peeled_sides = sampling->peeled_triangles > 0 ? sides : 0;
    if (!sampling->peeled_sides) {
        sampling->peeled_triangles = 0;
        return;
    }
    lay_all_over(canvas, sampling);
    count_peels(canvas, sides, sampling);
}

static bool is_seen(const struct canvas *canvas, const struct sampled *sampled)
{
    double slack = sampled->is_opaque ? 1.05 : 1;
    return sampled->z <= slack * canvas->depth[cell_at(sampled->x, sampled->y)];
}

/* Points at equal steps of visible area. */
static void choose_points(const struct canvas *canvas, struct scene_sampling *sampling)
{
    double total = 0, passed = 0;
    for (size_t i = 0; i < canvas->count; i++) {
        const struct sampled *sampled = &canvas->items[i];
        double area = is_seen(canvas, sampled) ? sampled->area * sampled->weight : 0;
        total += area;
        sampling->textures += area * sampled->textures;
    }
    sampling->textures /= fmax(total, DBL_MIN);
    double step = total / SCENE_SAMPLES_MAX;
    for (size_t i = 0; i < canvas->count && sampling->point_count < SCENE_SAMPLES_MAX; i++) {
        const struct sampled *sampled = &canvas->items[i];
        double before = floor(passed / step);
        if (!is_seen(canvas, sampled))
            continue;
        passed += sampled->area * sampled->weight;
        double steps = floor(passed / step) - before;
        if (steps < 1)
            continue;
        struct scene_sample *point = &sampling->points[sampling->point_count++];
        point->weight = steps;
        memcpy(point->position, sampled->world, sizeof point->position);
        memcpy(point->normal, sampled->normal, sizeof point->normal);
    }
}

bool scene_sampling_run(struct scene_sampling *sampling, const struct workload_desc *desc,
                        struct error *err)
{
    *sampling = (struct scene_sampling){0};
    struct canvas *canvas = calloc(1, sizeof *canvas);
    struct sampled *items = malloc((TRIANGLES_MAX + 1) * sizeof *items);
    bool ok = canvas && items;
    if (!ok) {
        error_set(err, ERROR_NO_MEMORY, "sampling of the view");
    } else {
        canvas->desc = desc;
        canvas->items = items;
        for (int i = 0; i < CELLS; i++)
            canvas->depth[i] = canvas->end[i] = DBL_MAX;
        sample(canvas, sampling);
        for (size_t i = 0; i < canvas->count; i++)
            if (items[i].is_opaque)
                spread(canvas, &items[i], cover);
        for (size_t i = 0; i < canvas->count; i++)
            if (!items[i].is_opaque && is_seen(canvas, &items[i]))
                sampling->layers += items[i].area * items[i].weight;
        for (int i = 0; i < CELLS; i++) {
            sampling->covered += fmin(canvas->covered[i], 1) / CELLS;
            sampling->depths[i] = canvas->depth[i] < DBL_MAX ? (float)canvas->depth[i] : INFINITY;
            sampling->ends[i] =
                canvas->end[i] < DBL_MAX ? (float)canvas->end[i] : sampling->depths[i];
        }
        choose_points(canvas, sampling);
        sample_peels(canvas, sampling);
    }
    free(items);
    free(canvas);
    return ok;
}
