/* SPDX-License-Identifier: MIT */
/* The command line of `vitrail compare`, read by two programs: vitrail, which starts in
 * milliseconds, and vitrail-compare beside it, which holds the image library and does the work. */
#ifndef VITRAIL_CLIENTS_VITRAIL_COMPARE_H
#define VITRAIL_CLIENTS_VITRAIL_COMPARE_H

#include "clients/vitrail/options.h"

struct compare_options {
    struct common_options common;
    const char *layer;       /* --output; NULL: see compare_input_load */
    const char *output_file; /* NULL: no picture */
    const char *map;         /* NULL means flip */
    const char *metric;      /* NULL means rmse */
    struct option_number max_error, pixels_per_degree, scale, edge_level;
    bool no_flip;
};

extern const struct option COMPARE_OPTIONS[];
extern const char COMPARE_DETAILS[];

/* All of the command but what runs it. */
#define COMPARE_COMMAND                                                                           \
    .name = "compare", .synopsis = "IMAGE REFERENCE [options]",                                   \
    .summary = "Measure how far an image is from a reference; draw the difference",               \
    .details = COMPARE_DETAILS, .options = COMPARE_OPTIONS, .operands_min = 2, .operands_max = 2, \
    .options_bytes = sizeof(struct compare_options)

#endif
