/* SPDX-License-Identifier: MIT */
/* Filling the clusters: one run of slices per light and tile, then count, scan and scatter. */
#include "renderer/lights/clusters.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double SLICE_SLACK = 1e-4; /* of the depth: 20 times the error of a poor log2 */
/* Finer slices next to the eye would be wasted on few pixels. */
static const double DEPTH_RATIO_MAX = 4096;
static const double DEPTH_RATIO_MIN = 1.05; /* keeps the f32 slice mapping well conditioned */

static void set_slices(struct clusters *clusters, double begin, double end)
{
    double f_begin = clusters->is_linear ? begin : log2(begin);
    double f_end = clusters->is_linear ? end : log2(end);
    double scale = clusters->slices / (f_end - f_begin);
    clusters->slice_scale = (float)scale;
    clusters->slice_offset = (float)(-f_begin * scale);
}

/* Exponential between the nearest and the farthest bounded light in view; linear for orthographic
 * cameras. */
static void choose_slices(struct clusters *clusters, const struct camera *camera)
{
    double begin = INFINITY, end = -INFINITY;
    for (size_t i = 0; i < clusters->bounds->count; i++) {
        begin = fmin(begin, clusters->bounds->items[i].z_lo);
        end = fmax(end, clusters->bounds->items[i].z_hi);
    }
    begin = fmax(begin, camera->z_near);
    if (clusters->is_linear) {
        end = fmin(end, camera->z_far);
        double least = 1e-3 * fmax(fmax(fabs(begin), fabs(end)), 1e-30);
        set_slices(clusters, begin, fmax(end, begin + least));
    } else {
        begin = fmax(begin, end / DEPTH_RATIO_MAX);
        set_slices(clusters, begin, fmax(end, begin * DEPTH_RATIO_MIN));
    }
}

static int slice_of(const struct clusters *clusters, double z)
{
    double f = clusters->is_linear ? z : (double)log2f((float)(z > 1e-37 ? z : 1e-37));
    double k = floor(f * clusters->slice_scale + clusters->slice_offset);
    return k > 0 ? (k < clusters->slices ? (int)k : clusters->slices - 1) : 0;
}

/* How far the shader's f32 depth and slice mapping may be off at this depth. */
static double depth_slack(const struct clusters *clusters, double z)
{
    if (!clusters->is_linear)
        return SLICE_SLACK * fabs(z);
    return 1e-3 / fabs((double)clusters->slice_scale) + 4e-7 * fabs(z);
}

size_t clusters_find(const struct clusters *clusters, int x, int y, float view_z)
{
    size_t tile = (size_t)(y / clusters->tile_px) * (size_t)clusters->columns +
                  (size_t)(x / clusters->tile_px);
    return tile * (size_t)clusters->slices + (size_t)slice_of(clusters, view_z);
}

static bool reserve(void **array, size_t *capacity, size_t count, size_t item_bytes,
                    struct error *err)
{
    if (count <= *capacity)
        return true;
    size_t grown = count + count / 2;
    void *moved = realloc(*array, grown * item_bytes);
    if (!moved)
        return error_set(err, ERROR_NO_MEMORY, "light lists of %zu bytes", grown * item_bytes);
    *array = moved;
    *capacity = grown;
    return true;
}

static bool add_run(struct clusters *clusters, uint32_t light, size_t tile, int first, int last,
                    struct error *err)
{
    void *runs = clusters->runs;
    bool ok = reserve(&runs, &clusters->run_capacity, clusters->run_count + 1,
                      sizeof *clusters->runs, err);
    clusters->runs = runs;
    if (!ok)
        return false;
    clusters->runs[clusters->run_count++] =
        (struct cluster_run){light, (uint32_t)(tile * (size_t)clusters->slices + (size_t)first),
                             (uint32_t)(last - first + 1)};
    clusters->entry_count += (uint64_t)(last - first + 1);
    return true;
}

static bool fill_tile(struct clusters *clusters, const struct light_bound *bound, int column,
                      int row, const struct view_ball *ball, struct error *err)
{
    struct view_ray ray = tile_grid_ray(&clusters->grid, column, row);
    double front, back;
    if (!light_bound_interval(bound, &ray, &front, &back))
        return true;
    front = fmax(front, ball->center[2] - ball->radius_m);
    back = fmin(back, ball->center[2] + ball->radius_m);
    if (front > back)
        return true;
    size_t tile = (size_t)row * (size_t)clusters->columns + (size_t)column;
    return add_run(clusters, bound->light, tile,
                   slice_of(clusters, front - depth_slack(clusters, front)),
                   slice_of(clusters, back + depth_slack(clusters, back)), err);
}

static bool fill_light(struct clusters *clusters, const struct light_bound *bound,
                       struct error *err)
{
    struct tile_rect rect;
    if (!tile_grid_cover(&clusters->grid, bound, &rect))
        return true;
    for (int row = rect.y0; row <= rect.y1; row++) {
        struct view_ball in_row = {.radius_m = bound->radius_m};
        memcpy(in_row.center, bound->center, sizeof in_row.center);
        if (!tile_grid_clip(&clusters->grid, 1, row, &in_row))
            continue;
        for (int column = rect.x0; column <= rect.x1; column++) {
            struct view_ball ball = in_row;
            if (tile_grid_clip(&clusters->grid, 0, column, &ball) &&
                !fill_tile(clusters, bound, column, row, &ball, err))
                return false;
        }
    }
    return true;
}

static bool check_budget(const struct clusters *clusters, const struct clusters_desc *desc,
                         struct error *err)
{
    uint64_t entries_max = desc->entries_max ? desc->entries_max : CLUSTER_ENTRIES_MAX;
    uint64_t needed = clusters->entry_count + clusters->prefix_count;
    if (needed <= entries_max)
        return true;
    return error_set(err, ERROR_OVER_BUDGET,
                     "light lists of %zu lights in %dx%dx%d clusters need more than %llu entries "
                     "of 4 bytes; shorten the ranges of the lights or render fewer pixels",
                     desc->light_count, clusters->columns, clusters->rows, clusters->slices,
                     (unsigned long long)entries_max);
}

/* Runs of all bounded lights. A light in more than 3/4 of the clusters becomes global: in the
 * others it is tested in vain, which costs a pixel less than its entries cost everywhere. */
static bool fill(struct clusters *clusters, const struct clusters_desc *desc, struct error *err)
{
    uint64_t most = 3ull * (uint64_t)clusters->columns * (uint64_t)clusters->rows *
                    (uint64_t)clusters->slices / 4;
    for (size_t i = 0; i < clusters->bounds->count; i++) {
        size_t run_count = clusters->run_count;
        uint64_t entry_count = clusters->entry_count;
        if (!fill_light(clusters, &clusters->bounds->items[i], err))
            return false;
        if (clusters->entry_count - entry_count > most) {
            clusters->run_count = run_count;
            clusters->entry_count = entry_count;
            clusters->items[clusters->prefix_count++] = clusters->bounds->items[i].light;
        }
        if (!check_budget(clusters, desc, err))
            return false;
    }
    return true;
}

/* The prefix grows from the front while lights are filled, so it has room for every light. */
static bool begin_prefix(struct clusters *clusters, size_t light_count, struct error *err)
{
    void *items = clusters->items;
    bool ok = reserve(&items, &clusters->item_capacity, light_count, sizeof *clusters->items, err);
    clusters->items = items;
    clusters->prefix_count = clusters->bounds->global_count;
    if (ok && clusters->prefix_count)
        memcpy(clusters->items, clusters->bounds->global,
               clusters->prefix_count * sizeof *clusters->items);
    return ok;
}

static int compare_u32(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

static bool scatter(struct clusters *clusters, struct error *err)
{
    size_t cluster_count =
        (size_t)clusters->columns * (size_t)clusters->rows * (size_t)clusters->slices;
    void *heads = clusters->heads, *items = clusters->items;
    bool ok = reserve(&heads, &clusters->head_capacity, cluster_count, 2 * sizeof(uint32_t), err);
    clusters->heads = heads;
    clusters->item_count = clusters->prefix_count + clusters->entry_count;
    ok = ok &&
         reserve(&items, &clusters->item_capacity, clusters->item_count, sizeof(uint32_t), err);
    clusters->items = items;
    if (!ok)
        return false;
    memset(clusters->heads, 0, cluster_count * 2 * sizeof(uint32_t));
    for (size_t i = 0; i < clusters->run_count; i++)
        for (uint32_t k = 0; k < clusters->runs[i].count; k++)
            clusters->heads[2 * (clusters->runs[i].cluster + k)]++;
    uint32_t offset = (uint32_t)clusters->prefix_count;
    /* Counts become offsets; the second word counts again. */
    for (size_t c = 0; c < cluster_count; c++) {
        uint32_t count = clusters->heads[2 * c];
        clusters->heads[2 * c] = offset;
        offset += count;
        if (count + clusters->prefix_count > clusters->longest)
            clusters->longest = (uint32_t)(count + clusters->prefix_count);
    }
    for (size_t i = 0; i < clusters->run_count; i++) {
        for (uint32_t k = 0; k < clusters->runs[i].count; k++) {
            uint32_t *head = &clusters->heads[2 * (clusters->runs[i].cluster + k)];
            clusters->items[head[0] + head[1]++] = clusters->runs[i].light;
        }
    }
    return true;
}

bool clusters_build(struct clusters *clusters, const struct clusters_desc *desc, struct error *err)
{
    clusters->run_count = 0;
    clusters->entry_count = 0;
    clusters->bounds = desc->bounds ? desc->bounds : &clusters->own_bounds;
    if ((!desc->bounds && !light_bounds_collect(&clusters->own_bounds, desc->lights,
                                                desc->light_count, desc->camera, err)) ||
        !tile_grid_init(&clusters->grid, desc->camera, desc->window, CLUSTER_TILE_PX, err) ||
        !begin_prefix(clusters, desc->light_count, err))
        return false;
    clusters->columns = clusters->grid.columns;
    clusters->rows = clusters->grid.rows;
    clusters->tile_px = clusters->grid.tile_px;
    clusters->slices = clusters->bounds->count ? CLUSTER_SLICES : 1;
    clusters->is_linear = desc->camera->is_orthographic;
    clusters->longest = (uint32_t)clusters->prefix_count;
    if (clusters->bounds->count)
        choose_slices(clusters, desc->camera);
    else
        clusters->slice_scale = clusters->slice_offset = 0;
    if (!fill(clusters, desc, err))
        return false;
    if (clusters->prefix_count > 1)
        qsort(clusters->items, clusters->prefix_count, sizeof *clusters->items, compare_u32);
    return scatter(clusters, err);
}

void clusters_finish(struct clusters *clusters)
{
    light_bounds_finish(&clusters->own_bounds);
    tile_grid_finish(&clusters->grid);
    free(clusters->runs);
    free(clusters->heads);
    free(clusters->items);
    *clusters = (struct clusters){0};
}
