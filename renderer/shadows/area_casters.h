/* SPDX-License-Identifier: MIT */
/* The triangles of a scene that cast shadows, side by side on the device, as the grids of
 * area_grid.h read them. Thread: GL, but where said otherwise. */
#ifndef VITRAIL_RENDERER_SHADOWS_AREA_CASTERS_H
#define VITRAIL_RENDERER_SHADOWS_AREA_CASTERS_H

#include "renderer/base/content_key.h"
#include "renderer/gl/context.h"
#include "renderer/gl/object.h"
#include "renderer/scene/scene_state.h"

struct area_casters { /* zeroed before the first call */
    struct gl_buffer corners, owners, items;
    struct content_key key; /* of what the buffers hold */
    bool is_reused;         /* the last call kept them */
    uint32_t triangle_count, item_count;
    bool has_filters; /* some are transparent */
    bool has_curves;  /* vertices of some opaque ones have normals of their own */
    double origin[3]; /* world: what positions are relative to */
    double radius_m;  /* none is farther from there */
    double nudge_m;   /* how far f32 may misplace a point of the scene */
    double size_m;    /* rays to lights infinitely far away are this long */
};

struct area_casters_desc {
    const struct scene_state *state; /* required */
    const char *scene_key;           /* required: equal keys, equal scenes */
    enum view_blend_filter blend;
    const struct gl_limits *limits; /* required */
};

/* Keeps what is on the device where the same casters stand at the same places. ERROR_OVER_BUDGET
 * where they exceed a block of the device. */
MUST_CHECK bool area_casters_prepare(struct area_casters *casters,
                                     const struct area_casters_desc *desc, struct error *err);
uint64_t area_casters_size_bytes(const struct area_casters *casters);
void area_casters_finish(struct area_casters *casters);

/* Whether some of the state's casters are transparent, and whether vertices of some opaque ones may
 * have normals of their own. Thread: any. */
void area_casters_foretell(const struct scene_state *state, bool *has_filters, bool *has_curves);

#endif
