/* SPDX-License-Identifier: MIT */
/* For each angle the points are in order along it, and leave one after the other. */
#include "renderer/shadows/area_table.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/raytrace/rt_emitter.h"
#include "renderer/raytrace/rt_job.h"

static double column_place(uint32_t column)
{
    return AREA_TABLE_REACH * (2.0 * column / (AREA_TABLE_SIDE - 1) - 1);
}

static void find_places(bool is_disk, uint32_t points, double (*places)[2])
{
    const struct state_light unit = {.type = is_disk ? SCENE_LIGHT_DISK : SCENE_LIGHT_RECT,
                                     .half_u = {1, 0, 0},
                                     .half_v = {0, 1, 0}};
    for (uint32_t i = 0; i < points; i++) {
        double square[2], at[3];
        rt_sequence_point(i, rt_job_seed(0, 0, 0), square);
        rt_light_place(&unit, square, at);
        memcpy(places[i], at, sizeof places[i]);
    }
}

struct ordered {
    double along;
    uint32_t point;
};

static int compare(const void *a, const void *b)
{
    const struct ordered *x = a, *y = b;
    return (x->along > y->along) - (x->along < y->along);
}

static void fill_row(uint32_t row, uint32_t points, const double (*places)[2], uint32_t *masks)
{
    const uint32_t words = area_table_vectors(points) * 4;
    const double angle = 2 * M_PI * row / AREA_TABLE_SIDE, x = cos(angle), y = sin(angle);
    struct ordered order[AREA_TABLE_POINTS_MAX];
    uint32_t mask[AREA_TABLE_POINTS_MAX / 32] = {0}, gone = 0;
    for (uint32_t i = 0; i < points; i++) {
        order[i] = (struct ordered){x * places[i][0] + y * places[i][1], i};
        mask[i / 32] |= 1u << i % 32;
    }
    qsort(order, points, sizeof *order, compare);
    for (uint32_t column = 0; column < AREA_TABLE_SIDE; column++) {
        for (; gone < points && order[gone].along < column_place(column); gone++)
            mask[order[gone].point / 32] &= ~(1u << order[gone].point % 32);
        memcpy(masks + (size_t)column * words, mask, words * sizeof *mask);
    }
}

void area_table_fill(bool is_disk, uint32_t points, uint32_t *masks)
{
    double places[AREA_TABLE_POINTS_MAX][2];
    const size_t row_words = (size_t)area_table_words(points) / AREA_TABLE_SIDE;
    find_places(is_disk, points, places);
    for (uint32_t row = 0; row < AREA_TABLE_SIDE; row++)
        fill_row(row, points, (const double(*)[2])places, masks + row * row_words);
}
