/* SPDX-License-Identifier: MIT */
/* How the groups of rt_whole.h are lit. Internal to rt_whole. Thread: one per batch. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_WHOLE_LIGHT_H
#define VITRAIL_RENDERER_RAYTRACE_RT_WHOLE_LIGHT_H

#include "renderer/raytrace/rt_whole.h"

/* What all surfaces of a mesh have alike, evaluated at any of its triangles. It stays until another
 * mesh takes its place. */
struct rt_whole_alike *rt_whole_evaluate(struct rt_batch *batch, uint32_t mesh, uint32_t triangle);

/* The group in which surfaces of the mesh wait, with room for one more. */
struct rt_whole_group *rt_whole_open(struct rt_batch *batch, uint32_t mesh, uint32_t triangle);

/* Lights what waits there. */
void rt_whole_light_group(struct rt_batch *batch, struct rt_whole_group *group);

/* Brings to the batch's `radiance` what the surfaces of those lanes reflect and emit. */
void rt_whole_light(struct rt_batch *batch, struct rt_whole_group *group, uint32_t lanes);

#endif
