/* SPDX-License-Identifier: MIT */
/* Boxes on the picture: each becomes a rectangle of blocks, which is counted by its four corners
 * (a summed table), so that a large one costs no more than a small one. */
#include "renderer/raytrace/rt_silhouette.h"

#include <math.h>
#include <stdlib.h>

#include "renderer/base/matrix.h"

/* Hits are found in f32, from an eye and along a direction of f32: this much of the distance they
 * lie beside, at most. */
static const double MARGIN = 1e-6;
static const double MARGIN_PX = 1;

/* Of the picture, in units of half its width and height. */
struct rectangle {
    double low[2], high[2];
};

struct projection {
    const struct camera *camera;
    double nearest; /* depth of the nearest hit that counts; perspective */
    double nudge_m;
};

static void add_point(const struct projection *to, const double point[3], double margin,
                      struct rectangle *rectangle)
{
    const double halves[2] = {to->camera->half_width, to->camera->half_height};
    double depth = to->camera->is_orthographic ? 1 : point[2];
    for (int k = 0; k < 2; k++) {
        double at = point[k] / depth, beside = margin / depth * (1 + fabs(at));
        rectangle->low[k] = fmin(rectangle->low[k], (at - beside) / halves[k]);
        rectangle->high[k] = fmax(rectangle->high[k], (at + beside) / halves[k]);
    }
}

/* Where the box's edges run through the plane of the nearest hits. */
static void add_crossings(const struct projection *to, const double corners[8][3], double margin,
                          struct rectangle *rectangle)
{
    for (int edge = 0; edge < 24; edge++) {
        const double *from = corners[edge / 3], *end = corners[edge / 3 ^ 1 << edge % 3];
        if (from[2] < to->nearest && end[2] >= to->nearest) {
            double share = (to->nearest - from[2]) / (end[2] - from[2]), point[3];
            for (int k = 0; k < 2; k++)
                point[k] = from[k] + share * (end[k] - from[k]);
            point[2] = to->nearest;
            add_point(to, point, margin, rectangle);
        }
    }
}

static void find_corners(const struct projection *to, const struct scene_state *state,
                         const struct state_item *item, double corners[8][3])
{
    const struct state_geometry geometry = state_geometry_of(state, item);
    const struct scene_primitive *p = geometry.primitive;
    for (int corner = 0; corner < 8; corner++) {
        double local[3], world[3];
        for (int k = 0; k < 3; k++)
            local[k] = (double)(corner >> k & 1 ? p->bounds_max[k] : p->bounds_min[k]);
        mat4_transform_point(geometry.world, local, world);
        camera_to_view(to->camera, world, corners[corner]);
    }
}

/* Not well ordered where nothing of the item is seen. Media are entered before the near plane. */
static struct rectangle find_rectangle(const struct projection *to, const struct scene_state *state,
                                       const struct state_item *item)
{
    struct rectangle rectangle = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
    double corners[8][3], from_eye[3];
    int beyond = 0, before_eye = 0;
    vec3_sub(item->center, to->camera->eye, from_eye);
    double margin = MARGIN * (vec3_length(from_eye) + item->radius_m) + 4 * to->nudge_m;
    find_corners(to, state, item, corners);
    for (int i = 0; i < 8; i++) {
        bool is_seen = to->camera->is_orthographic || corners[i][2] >= to->nearest;
        beyond += is_seen;
        before_eye += is_seen || corners[i][2] > -margin;
        if (is_seen)
            add_point(to, corners[i], margin, &rectangle);
    }
    if (item->is_medium && before_eye && beyond < 8)
        return (struct rectangle){{-INFINITY, -INFINITY}, {INFINITY, INFINITY}};
    if (beyond && beyond < 8)
        add_crossings(to, (const double(*)[3])corners, margin, &rectangle);
    return rectangle;
}

/* First and end of the blocks along an axis that a range of pixels lies in. What is no number is
 * anywhere. */
static void find_blocks(double low_px, double high_px, int count, int range[2])
{
    double first = floor((low_px - MARGIN_PX) / RT_SILHOUETTE_PX);
    double end = floor((high_px + MARGIN_PX) / RT_SILHOUETTE_PX) + 1;
    range[0] = first > 0 ? (int)fmin(first, count) : 0;
    range[1] = end < count ? (int)fmax(end, 0) : count;
}

static void add_rectangle(struct rt_silhouette *silhouette, const struct view *view,
                          const struct rectangle *rectangle)
{
    int across[2], down[2];
    size_t stride = (size_t)silhouette->columns + 1;
    find_blocks((rectangle->low[0] + 1) / 2 * view->width_px - silhouette->x_px,
                (rectangle->high[0] + 1) / 2 * view->width_px - silhouette->x_px,
                silhouette->columns, across);
    find_blocks((1 - rectangle->high[1]) / 2 * view->height_px - silhouette->y_px,
                (1 - rectangle->low[1]) / 2 * view->height_px - silhouette->y_px, silhouette->rows,
                down);
    if (across[0] >= across[1] || down[0] >= down[1])
        return;
    uint32_t *top = silhouette->boxes + (size_t)down[0] * stride;
    uint32_t *bottom = silhouette->boxes + (size_t)down[1] * stride;
    top[across[0]]++; /* modulo 2^32 the sums are right */
    top[across[1]]--;
    bottom[across[0]]--;
    bottom[across[1]]++;
}

static void sum_up(struct rt_silhouette *silhouette)
{
    size_t stride = (size_t)silhouette->columns + 1;
    for (size_t row = 0; row <= (size_t)silhouette->rows; row++) {
        uint32_t *at = silhouette->boxes + row * stride, sum = 0;
        for (size_t column = 0; column < stride; column++) {
            sum += at[column];
            at[column] = sum + (row ? at[column - stride] : 0);
        }
    }
}

bool rt_silhouette_init(struct rt_silhouette *silhouette, const struct rt_job *job,
                        const struct view_tile *blocks, struct error *err)
{
    const struct scene_state *state = job->scene->state;
    const struct camera *camera = job->desc->camera;
    const struct projection to = {
        .camera = camera, .nearest = camera->z_near * (1 - 1e-3), .nudge_m = job->scene->nudge_m};
    *silhouette = (struct rt_silhouette){
        .x_px = blocks->x_px,
        .y_px = blocks->y_px,
        .columns = (blocks->width_px + RT_SILHOUETTE_PX - 1) / RT_SILHOUETTE_PX,
        .rows = (blocks->height_px + RT_SILHOUETTE_PX - 1) / RT_SILHOUETTE_PX};
    size_t count = ((size_t)silhouette->columns + 1) * ((size_t)silhouette->rows + 1);
    silhouette->boxes = calloc(count, sizeof *silhouette->boxes);
    if (!silhouette->boxes)
        return error_set(err, ERROR_NO_MEMORY, "%zu blocks of the picture", count);
    for (size_t i = 0; i < state->item_count; i++) {
        if (!state_item_is_traced(&state->items[i]))
            continue;
        struct rectangle rectangle = find_rectangle(&to, state, &state->items[i]);
        if (rectangle.low[0] <= rectangle.high[0])
            add_rectangle(silhouette, job->desc->view, &rectangle);
    }
    sum_up(silhouette);
    return true;
}

void rt_silhouette_finish(struct rt_silhouette *silhouette)
{
    free(silhouette->boxes);
    *silhouette = (struct rt_silhouette){0};
}
