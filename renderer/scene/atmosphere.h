/* SPDX-License-Identifier: MIT */
/* The haze of a view in f64: how much of it lies between two points, and how it scatters
 * (docs/explanation/media.md). Pure functions. Thread: any. */
#ifndef VITRAIL_RENDERER_SCENE_ATMOSPHERE_H
#define VITRAIL_RENDERER_SCENE_ATMOSPHERE_H

#include "renderer/view.h"

/* Extinction at a height along +Y of the world [1/m]. */
double atmosphere_extinction(const struct view_atmosphere *air, double height_m);

/* Optical depth of a straight way that begins at a height and climbs by so much per metre; length_m
 * may be INFINITY, and so may the result. */
double atmosphere_depth(const struct view_atmosphere *air, double height_m, double climb,
                        double length_m);

/* Henyey and Greenstein 1941, "Diffuse radiation in the Galaxy": of the light that is scattered,
 * the share that goes on at an angle with this cosine to its way [1/sr]. */
double atmosphere_phase(const struct view_atmosphere *air, double cosine);

#endif
