/* SPDX-License-Identifier: MIT */
/* How a light looks at the scene: one perspective face, the six of a cube, or one orthographic
 * face. All in f64 and independent of the camera. Thread: any. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_FRAME_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_FRAME_H

#include <stdint.h>

#include "renderer/scene/scene_state.h"

struct shadow_frame {
    uint32_t shape;      /* SHADOW_ONE_FACE, SHADOW_CUBE, SHADOW_ORTHOGRAPHIC */
    uint32_t face_count; /* 1 or 6 */
    double origin[3]; /* world; of the light, or the middle of the orthographic box's near side */
    /* Rows x, y, z of light_from_world; the light looks along +z; y x x = z, so nothing is
     * mirrored. */
    double axis[3][3];
    double scale[2]; /* perspective: 1 / tan(half angle); orthographic: 1 / half extent [1/m] */
    double unit_m;   /* of the scene; what is drawn for the light is in this unit */
    double near_m;   /* perspective */
    double depth_m;  /* orthographic: extent of the box along z */
    double range_m;  /* perspective: beyond it the light does not reach; 0 = unbounded */
    double cone[3];  /* direction of the outer cone */
    double cone_rad; /* its half angle; pi for all directions */
};

/* A directional light's box is as wide as the casters and as deep as the whole scene. A point or
 * spot light that is far from all casters looks at them alone, through one face; one that is so far
 * that its rays are parallel is framed as a directional one. False when nothing casts. */
bool shadow_frame_init(struct shadow_frame *frame, const struct state_light *light,
                       const struct scene_state *state, int resolution);
/* The same where density grids cast as meshes do. */
bool shadow_frame_init_with_grids(struct shadow_frame *frame, const struct state_light *light,
                                  const struct scene_state *state, int resolution);

/* Bit f is set when the item's bounds may touch face f. */
uint32_t shadow_frame_faces(const struct shadow_frame *frame, const struct state_item *item);

/* Rows (x, y, z) of face_from_light: looking along +z. Of 0, 1 and -1, so that it turns without
 * rounding. */
void shadow_frame_face_turn(const struct shadow_frame *frame, uint32_t face, double rows[3][3]);
/* Rows (x, y, z) of face_from_world about the origin. The model of the tests
 * asks it, too. */
void shadow_frame_face_axes(const struct shadow_frame *frame, uint32_t face, double axes[3][3]);

#endif
