/* SPDX-License-Identifier: MIT */
/* Contours by marching squares (Lorensen, Cline 1987, in the plane), nearest segments by rings of
 * buckets, and penumbra widths. */
#include "renderer/accuracy/edges.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/accuracy/sum.h"

enum { BUCKET_PX = 8 };

struct segment {
    double x[2], y[2];
};

/* Segments sorted by the bucket of their first end; a segment is never longer than a cell's
 * diagonal, so it may reach one pixel beyond its bucket. */
struct contour {
    struct segment *segments; /* owned */
    size_t count, capacity;
    uint32_t *starts; /* owned; [columns * rows + 1] */
    int columns, rows;
    double length;
};

static void contour_finish(struct contour *contour)
{
    free(contour->segments);
    free(contour->starts);
}

static bool contour_add(struct contour *contour, const double a[2], const double b[2],
                        struct error *err)
{
    if (contour->count == contour->capacity) {
        size_t capacity = contour->capacity ? 2 * contour->capacity : 256;
        struct segment *grown = reallocarray(contour->segments, capacity, sizeof *grown);
        if (!grown)
            return error_set(err, ERROR_NO_MEMORY, "a contour of %zu segments", contour->count);
        contour->segments = grown;
        contour->capacity = capacity;
    }
    contour->segments[contour->count++] = (struct segment){{a[0], b[0]}, {a[1], b[1]}};
    contour->length += hypot(a[0] - b[0], a[1] - b[1]);
    return true;
}

/* ---- marching squares ---- */

/* Corners of a cell in the order around it; side k lies between corners k and k + 1. */
static const int corner_x[4] = {0, 1, 1, 0}, corner_y[4] = {0, 0, 1, 1};

static void crossing(const double v[4], int side, double level, int x, int y, double point[2])
{
    int a = side, b = (side + 1) % 4;
    double t = (level - v[a]) / (v[b] - v[a]);
    point[0] = x + corner_x[a] + t * (corner_x[b] - corner_x[a]);
    point[1] = y + corner_y[a] + t * (corner_y[b] - corner_y[a]);
}

/* Adds the segments of the cell whose first corner is pixel (x, y). With four crossings the mean of
 * the corners says which of them belong together. */
static bool march_cell(struct contour *contour, const double v[4], double level, int x, int y,
                       struct error *err)
{
    double points[4][2];
    int count = 0;
    for (int side = 0; side < 4; side++)
        if ((v[side] >= level) != (v[(side + 1) % 4] >= level))
            crossing(v, side, level, x, y, points[count++]);
    if (count == 2)
        return contour_add(contour, points[0], points[1], err);
    if (count == 4) {
        bool is_middle_in = (v[0] + v[1] + v[2] + v[3]) / 4 >= level;
        /* the corner 0 is cut off by its sides 0 and 3, unless it is joined with the middle */
        int shift = is_middle_in == (v[0] >= level) ? 1 : 3;
        return contour_add(contour, points[0], points[shift], err) &&
               contour_add(contour, points[2], points[(2 + shift) % 4], err);
    }
    return true;
}

static bool read_cell(const struct image *image, int channel, int x, int y, double v[4])
{
    const float *pixels = image->pixels;
    bool is_finite = true;
    for (int i = 0; i < 4; i++) {
        size_t pixel =
            (size_t)(y + corner_y[i]) * (size_t)image->width_px + (size_t)(x + corner_x[i]);
        v[i] = (double)pixels[pixel * (size_t)image->channels + (size_t)channel];
        is_finite = is_finite && isfinite(v[i]);
    }
    return is_finite;
}

static bool march(const struct edge_distance_desc *desc, double level, struct contour contours[2],
                  struct edge_distance *distance, struct error *err)
{
    for (int y = 0; y + 1 < desc->image->height_px; y++)
        for (int x = 0; x + 1 < desc->image->width_px; x++) {
            double v[2][4];
            bool is_finite = read_cell(desc->image, desc->channel, x, y, v[0]);
            is_finite = read_cell(desc->reference, desc->channel, x, y, v[1]) && is_finite;
            distance->blind_cells += !is_finite;
            for (int i = 0; is_finite && i < 2; i++)
                if (!march_cell(&contours[i], v[i], level, x, y, err))
                    return false;
        }
    return true;
}

/* ---- nearest segments ---- */

static int bucket_of(const struct contour *contour, double x, double y)
{
    int column = (int)x / BUCKET_PX, row = (int)y / BUCKET_PX;
    return row * contour->columns + column;
}

/* Counting sort by bucket. */
static bool contour_index(struct contour *contour, const struct image *image, struct error *err)
{
    contour->columns = image->width_px / BUCKET_PX + 1;
    contour->rows = image->height_px / BUCKET_PX + 1;
    size_t buckets = (size_t)contour->columns * (size_t)contour->rows;
    contour->starts = calloc(buckets + 1, sizeof *contour->starts);
    struct segment *sorted = calloc(contour->count + 1, sizeof *sorted);
    if (!contour->starts || !sorted || contour->count > UINT32_MAX) {
        free(sorted);
        return error_set(err, ERROR_NO_MEMORY, "a contour of %zu segments", contour->count);
    }
    uint32_t *starts = contour->starts;
    for (size_t i = 0; i < contour->count; i++)
        starts[bucket_of(contour, contour->segments[i].x[0], contour->segments[i].y[0]) + 1]++;
    for (size_t i = 0; i < buckets; i++)
        starts[i + 1] += starts[i];
    for (size_t i = contour->count; i-- > 0;) { /* from behind: starts become those of before */
        const struct segment *s = &contour->segments[i];
        size_t bucket = (size_t)bucket_of(contour, s->x[0], s->y[0]);
        sorted[--starts[bucket + 1]] = *s;
    }
    memmove(starts, starts + 1, buckets * sizeof *starts);
    starts[buckets] = (uint32_t)contour->count;
    free(contour->segments);
    contour->segments = sorted;
    return true;
}

static double distance_to_segment(const struct segment *s, double x, double y)
{
    double dx = s->x[1] - s->x[0], dy = s->y[1] - s->y[0], squared = dx * dx + dy * dy;
    double t = squared > 0 ? ((x - s->x[0]) * dx + (y - s->y[0]) * dy) / squared : 0;
    t = fmin(fmax(t, 0), 1);
    return hypot(x - s->x[0] - t * dx, y - s->y[0] - t * dy);
}

static double nearest_in_bucket(const struct contour *contour, int column, int row, double x,
                                double y, double nearest)
{
    if (column < 0 || row < 0 || column >= contour->columns || row >= contour->rows)
        return nearest;
    size_t bucket = (size_t)row * (size_t)contour->columns + (size_t)column;
    for (uint32_t i = contour->starts[bucket]; i < contour->starts[bucket + 1]; i++)
        nearest = fmin(nearest, distance_to_segment(&contour->segments[i], x, y));
    return nearest;
}

/* Rings of buckets around the point, until what lies further out cannot be nearer: a segment of
 * ring r + 1 is at least r buckets away, less the pixel that it may reach over. */
static double nearest_distance(const struct contour *contour, double x, double y)
{
    int column = (int)x / BUCKET_PX, row = (int)y / BUCKET_PX;
    int rings = contour->columns > contour->rows ? contour->columns : contour->rows;
    double nearest = INFINITY;
    for (int r = 0; r <= rings && nearest > (r - 1) * BUCKET_PX - 1.5; r++) {
        for (int i = -r; i <= r; i++) {
            nearest = nearest_in_bucket(contour, column + i, row - r, x, y, nearest);
            if (r > 0)
                nearest = nearest_in_bucket(contour, column + i, row + r, x, y, nearest);
        }
        for (int i = -r + 1; i < r; i++) {
            nearest = nearest_in_bucket(contour, column - r, row + i, x, y, nearest);
            nearest = nearest_in_bucket(contour, column + r, row + i, x, y, nearest);
        }
    }
    return nearest;
}

/* Simpson's rule over each segment, whose ends and middle are also where the largest is looked
 * for. */
static void measure_from(const struct contour *from, const struct contour *to,
                         struct edge_distance *distance, struct sum *integral)
{
    for (size_t i = 0; i < from->count; i++) {
        const struct segment *s = &from->segments[i];
        double length = hypot(s->x[1] - s->x[0], s->y[1] - s->y[0]), weighted = 0;
        for (int k = 0; k < 3; k++) {
            double x = s->x[0] + (s->x[1] - s->x[0]) * k / 2;
            double y = s->y[0] + (s->y[1] - s->y[0]) * k / 2;
            double d = nearest_distance(to, x, y);
            weighted += d * (k == 1 ? 4 : 1) / 6;
            if (d > distance->hausdorff_px) {
                distance->hausdorff_px = d;
                distance->max_x = (int)lrint(x);
                distance->max_y = (int)lrint(y);
            }
        }
        sum_add(integral, weighted * length);
    }
}

static void measure_contours(const struct contour contours[2], struct edge_distance *distance)
{
    struct sum integral = {0};
    distance->length_image_px = contours[0].length;
    distance->length_reference_px = contours[1].length;
    if (!contours[0].count && !contours[1].count)
        return;
    if (!contours[0].count || !contours[1].count) {
        distance->hausdorff_px = distance->mean_px = INFINITY;
        return;
    }
    measure_from(&contours[0], &contours[1], distance, &integral);
    measure_from(&contours[1], &contours[0], distance, &integral);
    double length = contours[0].length + contours[1].length;
    distance->mean_px = length > 0 ? sum_value(&integral) / length : distance->hausdorff_px;
}

bool edge_distance_measure(const struct edge_distance_desc *desc, struct edge_distance *distance,
                           struct error *err)
{
    struct contour contours[2] = {{0}};
    double level = desc->level != 0 ? desc->level : 0.5;
    memset(distance, 0, sizeof *distance);
    if (!image_pair_check(desc->image, desc->reference, err))
        return false;
    if (desc->channel < 0 || desc->channel >= desc->image->channels)
        return error_set(err, ERROR_INVALID_REQUEST,
                         "channel %d is asked for, the images have %d channels", desc->channel,
                         desc->image->channels);
    if (!isfinite(level))
        return error_set(err, ERROR_INVALID_REQUEST, "the level of the contour is not finite");
    bool is_done = march(desc, level, contours, distance, err) &&
                   contour_index(&contours[0], desc->image, err) &&
                   contour_index(&contours[1], desc->image, err);
    if (is_done)
        measure_contours(contours, distance);
    contour_finish(&contours[0]);
    contour_finish(&contours[1]);
    return is_done;
}
