/* SPDX-License-Identifier: MIT */
/* The parts of an environment, shared by the files of this folder only. */
#ifndef VITRAIL_RENDERER_ENVIRONMENT_ENVIRONMENT_INTERNAL_H
#define VITRAIL_RENDERER_ENVIRONMENT_ENVIRONMENT_INTERNAL_H

#include "renderer/environment/environment.h"

struct environment_texels {
    float *pixels;
    int width, height;
};

struct environment {
    bool is_borrowed; /* its arrays are those of a blob, else its own */
    struct environment_texels radiance, diffuse, specular[ENVIRONMENT_LEVELS];
    /* Chances of a row, and of a texel within its row, summed up from 0 to 1: in
     * f64, because a sky beside the sun has chances below the steps of f32 at 1. */
    double *rows;    /* height + 1 */
    double *columns; /* height times (width + 1) */
    /* Where to look for a number in these sums: for each of `cells` equal parts of [0, 1) the step
     * that its begin lies in, and the last step; of the rows, then of each row's columns. Always
     * its own. */
    uint16_t *guides;
    int row_cells, column_cells; /* powers of two */
    double mean[3];              /* over all directions [nt]; environment_find_mean */
};

MUST_CHECK bool environment_texels_init(struct environment_texels *texels, int width, int height,
                                        struct error *err);

/* The coordinates of a direction in a map, each in [0, 1]. */
void environment_coordinates(const double direction[3], double *u, double *v);
void environment_direction(double u, double v, double direction[3]);

/* Linear between the middles of texels. */
void environment_texels_look(const struct environment_texels *texels, double u, double v,
                             double out[3]);

MUST_CHECK bool environment_make_tables(struct environment *environment, struct error *err);
MUST_CHECK bool environment_make_guides(struct environment *environment, struct error *err);
void environment_find_mean(struct environment *environment); /* with the diffuse map */
/* The diffuse map and the specular ones. */
MUST_CHECK bool environment_prefilter(struct environment *environment, struct error *err);

#endif
