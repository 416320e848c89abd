/* SPDX-License-Identifier: MIT */
/* The visible share of an area light from one point, as exactly as asked: where a sequence of N
 * points on the light errs by N^(-3/4), because shadows have edges, this follows the edges. The
 * light's square is halved in both directions (as Warnock 1969 halves pictures) until a cell is
 * crossed by an edge at most once or too small to matter; there the edge is bisected on the cell's
 * sides, and the cell is divided by the line between. Thread: that of the lighting. */
#ifndef VITRAIL_TESTS_SUPPORT_AREA_INTEGRAL_H
#define VITRAIL_TESTS_SUPPORT_AREA_INTEGRAL_H

#include "renderer/raytrace/rt_light.h"

/* Mean transmittance over the light's area. samples: about how many rays to spend where one edge of
 * a shadow crosses the light, from 64; what is smaller than 2 / sqrt(samples) of the light's side
 * and lies in its shadow alone can be missed. */
void area_integral_transmittance(struct rt_lighting *lighting, const struct state_light *light,
                                 const double point[3], uint32_t samples, double out[3]);

#endif
