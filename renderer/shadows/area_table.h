/* SPDX-License-Identifier: MIT */
/* Points of an area light on one side of a line, for many lines: what `area` shadows as published
 * rasterise edges of triangles with (Eisemann and Decoret 2007, "Visibility Sampling on GPU and
 * Applications"; Wang et al. 2014, table 3). The points are the same at every pixel. Pure
 * functions. Thread: any. */
#ifndef VITRAIL_RENDERER_SHADOWS_AREA_TABLE_H
#define VITRAIL_RENDERER_SHADOWS_AREA_TABLE_H

#include <stdbool.h>
#include <stdint.h>

#include "shaders/shared/layout.h"

#include "shaders/shared/records.h"

enum { AREA_TABLE_POINTS_MAX = 256 };

/* uvec4 that hold a bit for each point; 0: a table holds no so many. */
static inline uint32_t area_table_vectors(uint32_t points)
{
    return points > AREA_TABLE_POINTS_MAX ? 0 : (points + 127) / 128;
}

static inline uint64_t area_table_words(uint32_t points)
{
    return (uint64_t)AREA_TABLE_SIDE * AREA_TABLE_SIDE * area_table_vectors(points) * 4;
}

/* Points are the first of rt_sequence_point's, in units of half the light's sides. Row a and column
 * d have the points p with dot(p, (cos, sin)(a * 2 pi / AREA_TABLE_SIDE)) >= AREA_TABLE_REACH * (2
 * d / (AREA_TABLE_SIDE - 1) - 1), point i at bit i % 32 of word i / 32. masks: area_table_words. At
 * most AREA_TABLE_POINTS_MAX points. */
void area_table_fill(bool is_disk, uint32_t points, uint32_t *masks);

#endif
