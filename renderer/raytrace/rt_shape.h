/* SPDX-License-Identifier: MIT */
/* Shapes of large scenes: what several nodes show is in Embree's memory once, and each of them is
 * an instance of it. Thread: built by one, then read by any. */
#ifndef VITRAIL_RENDERER_RAYTRACE_RT_SHAPE_H
#define VITRAIL_RENDERER_RAYTRACE_RT_SHAPE_H

#include "renderer/raytrace/embree.h"
#include "renderer/scene/scene_state.h"

/* A scene of more triangles shares: below, one hierarchy over all of them costs little memory, and
 * rays go through it faster than through one of instances. */
enum { RT_SHARING_TRIANGLES = 1 << 20 };

struct rt_shapes {     /* zeroed: none */
    RTCScene *scenes;  /* owned; one per shape */
    uint32_t *of_item; /* owned; per item of the state: 1 + its shape, 0: a mesh of its own; NULL:
                          nothing is shared */
    size_t count;
};

/* Chooses what is shared, by what casts shadows in the state; the shapes are built by
 * rt_shape_take.
 */
MUST_CHECK bool rt_shapes_init(struct rt_shapes *shapes, const struct scene_state *state,
                               struct error *err);
void rt_shapes_finish(struct rt_shapes *shapes); /* accepts zeroed */

/* Whether f32 places an instance of the item as well as it places its vertices: it is hardly
 * sheared, and its vertices are not far from the origin of their coordinates. */
bool rt_shape_fits(const struct scene_state *state, const struct state_item *item);

/* The shape of an item that has one, built when it is first asked for. Filter: of what is not
 * opaque. NULL without memory. */
RTCScene rt_shape_take(struct rt_shapes *shapes, size_t shape, RTCDevice device,
                       const struct scene_state *state, const struct state_item *item,
                       RTCFilterFunctionN filter);

/* Places an instance: the item's world matrix, relative to the origin. Not yet committed. */
void rt_shape_place(RTCGeometry instance, const double world[16], const double origin[3]);

#endif
