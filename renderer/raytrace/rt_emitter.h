/* SPDX-License-Identifier: MIT */
/* Computes the light that arrives at a point when nothing is in between
 * (docs/explanation/shading.md, section 4). An area light is sampled at points that a stratified
 * sequence chooses. Thread: any. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_EMITTER_H
#define VITRAIL_RENDERER_RAYTRACE_RT_EMITTER_H

#include "renderer/scene/scene_state.h"

/* One of the points that stand for a light; point-like lights have only one. */
struct rt_light_sample {
    uint32_t index, count; /* index < count */
    uint32_t seed;         /* turns the sequence; equal seeds give equal points */
};

struct rt_arrival {
    double direction[3]; /* unit, from the point to the light */
    double distance_m;   /* INFINITY for directional lights */
    double gain;         /* irradiance on a facing plane, over light->color; 0: nothing arrives */
};

/* Points to take of a light: 1, or for area lights quality.area_samples or its default. */
uint32_t rt_light_sample_count(const struct state_light *light, const struct view_quality *quality);

/* The point of an area light (world) at a place of the unit square, of which equal areas are equal
 * areas of the light; the disk by Shirley and Chiu 1997, "A Low Distortion Map Between Disk and
 * Square". Outside of this module, tests integrate over it. */
void rt_light_place(const struct state_light *light, const double unit[2], double point[3]);

/* The index-th point of the unit square, in (0, 1): the first two dimensions of Sobol's sequence
 * (Sobol 1967), every power of two of whose points has one in each elementary interval, scrambled
 * by random digits (Kollig and Keller 2002, "Efficient Multidimensional Sampling"). Equal seeds
 * give equal points. */
void rt_sequence_point(uint32_t index, uint32_t seed, double xy[2]);

/* origin: world position that `point` is relative to. */
void rt_light_arrive(const struct state_light *light, const struct rt_light_sample *sample,
                     const double origin[3], const double point[3], struct rt_arrival *arrival);

#endif
