/* SPDX-License-Identifier: MIT */
/* The results of a comparison, for people and for programs. */
#ifndef VITRAIL_CLIENTS_COMPARE_PRINT_H
#define VITRAIL_CLIENTS_COMPARE_PRINT_H

#include <jansson.h>

#include "clients/compare/measure.h"

/* What was drawn; file NULL: nothing. */
struct compare_picture {
    const char *file, *map;
    double scale;
};

/* A table on stdout. */
void comparison_print(const struct comparison *comparison, const struct compare_options *options,
                      const struct compare_picture *picture);

/* The same as an object (docs/reference/cli.md); NULL when there is no memory. */
json_t *comparison_json(const struct comparison *comparison, const struct compare_options *options,
                        const struct compare_picture *picture);

#endif
