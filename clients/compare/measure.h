/* SPDX-License-Identifier: MIT */
/* All metrics of a pair of inputs, and the one that decides the exit code. */
#ifndef VITRAIL_CLIENTS_COMPARE_MEASURE_H
#define VITRAIL_CLIENTS_COMPARE_MEASURE_H

#include "clients/compare/input.h"
#include "clients/vitrail/compare.h"
#include "renderer/accuracy/edges.h"
#include "renderer/accuracy/flip.h"

struct comparison {
    struct compare_input image, reference;
    int color_channels; /* the first so many are what `plain.overall` is over: no alpha */
    struct image_metrics plain;
    double energy;    /* mean of the image over that of the reference, less 1; 0 when both are 0 */
    double differing; /* share of values that are not the same number */
    bool has_flip, has_hdr_flip, has_edges, has_transmittance;
    struct flip flip, hdr_flip;
    struct image flip_map; /* of the HDR form where there is one; empty without has_flip */
    struct edge_distance edges;
    struct probe_metrics transmittance; /* of the output of that name */
};

/* Whether --metric, --max-error and --map say something; before any file is read. */
bool compare_options_check(const struct compare_options *options, struct failure *failure);

/* Makes the pair fit: color layers without a common alpha lose it. Measures what is asked for. */
bool comparison_measure(struct comparison *comparison, const struct compare_options *options,
                        struct failure *failure);
void comparison_finish(struct comparison *comparison);

/* The metric of --metric, by default rmse. False when this pair does not have it. */
bool comparison_value(const struct comparison *comparison, const char *metric, double *value);

/* Whether the pair passes --max-error; true without one. */
bool comparison_passes(const struct comparison *comparison, const struct compare_options *options);

#endif
