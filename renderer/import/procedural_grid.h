/* SPDX-License-Identifier: MIT */
/* Density grids by procedures: a column of smoke, a layer of fog, a cloud. Their shapes come from
 * value noise in octaves (Perlin 1985, "An Image Synthesizer", SIGGRAPH; the lattice is hashed), so
 * that a seed always gives the same. Pure functions. Thread: any. */
#ifndef VITRAIL_RENDERER_IMPORT_PROCEDURAL_GRID_H
#define VITRAIL_RENDERER_IMPORT_PROCEDURAL_GRID_H

#include <stdbool.h>
#include <stdint.h>

enum procedural_shape {
    PROCEDURAL_SMOKE, /* a column that rises from the middle of the floor, widens and turns */
    PROCEDURAL_FOG,   /* lies on the floor, with an uneven surface */
    PROCEDURAL_CLOUD, /* a heap with a flat base */
    PROCEDURAL_SHAPES
};
enum { PROCEDURAL_OCTAVES_MAX = 8 };

struct procedural_grid {
    enum procedural_shape shape;
    uint32_t seed;
    int octaves; /* of the noise, [1, PROCEDURAL_OCTAVES_MAX] */
};

const char *procedural_shape_name(int shape); /* NULL: none has this number */

/* All values of a grid of so many voxels, x fastest, then y (up), then z: in [0, 1]. */
void procedural_grid_fill(const struct procedural_grid *grid, const uint32_t size[3],
                          float *values);

#endif
