/* SPDX-License-Identifier: MIT */
/* A trade-off for people: a plot, and a page with the pictures beside it. Thread: any. */
#ifndef VITRAIL_SERVER_TRADEOFFS_TRADEOFF_PLOT_H
#define VITRAIL_SERVER_TRADEOFFS_TRADEOFF_PLOT_H

#include <stdio.h>

#include "protocol/error.h"
#include "protocol/tradeoff.h"

/* SVG 1.1 without script: warm milliseconds against RMSE, both logarithmic; a colour and a shape
 * per technique, hollow for one sample per pixel; the Pareto front as a line, its points with
 * labels that do not overlap; every point tells all of its numbers when pointed at. Its colours
 * are attributes, so that any program draws it; browsers with a dark scheme get dark ones. Row i is
 * the element with id "m<i>". malloc'ed; NULL: no memory.
 */
MUST_CHECK char *tradeoff_to_svg(const struct tradeoff *tradeoff);

/* One HTML file that needs nothing else and no script: the plot, the table, and the reference's
 * picture beside that of the setting that is pointed at. images_fd: the pictures, borrowed, -1:
 * none. malloc'ed. */
MUST_CHECK char *tradeoff_to_html(const struct tradeoff *tradeoff, int images_fd);

/* Writes text with the five characters of XML escaped. */
void xml_write(FILE *out, const char *text);

#endif
