/* SPDX-License-Identifier: MIT */
/* What the finder of shadow volumes keeps on the device: casters with their edges, which stay until
 * something moves, and what a frame says of them. Thread: GL. */
#ifndef VITRAIL_RENDERER_SHADOWS_VOLUMES_H
#define VITRAIL_RENDERER_SHADOWS_VOLUMES_H

#include "renderer/gl/object.h"
#include "renderer/shadows/shadow_finder.h"
#include "renderer/shadows/volume_casters.h"

enum {
    VOLUME_BATCH = 6, /* groups that are counted at once */
    VOLUME_FACE_BYTES = 32,
    VOLUME_GROUPS_MOST = 24, /* casters of more filters are summed as `volume` does */
};

/* Those before BUFFER_FACES are the frame's, the others a window's. */
enum volume_buffer {
    BUFFER_VERTICES,
    BUFFER_EDGES,
    BUFFER_SIDES,
    BUFFER_TRIANGLES,
    BUFFER_WEIGHTS,
    BUFFER_REACH,
    BUFFER_LIGHTS,
    BUFFER_GROUPS,
    BUFFER_FACES,
    BUFFER_SPANS,
    BUFFER_SMALL,
    BUFFER_TILES,
    BUFFER_SIGNS,
    BUFFER_STARTS,
    BUFFER_SUMS,
    BUFFER_COUNTERS,
    VOLUME_BUFFERS
};

struct volumes {
    struct volume_casters casters; /* kept while their key is the same */
    struct gl_buffer buffers[VOLUME_BUFFERS];
    bool is_uploaded; /* edges, sides and triangles are those of the casters */
    uint64_t span_room;

    /* of the frame */
    const struct scene_state *state;
    const struct camera *camera;
    bool *is_shadowed;   /* owned */
    bool is_kept;        /* the casters stood already */
    bool counts_groups;  /* `silhouette` */
    uint64_t most_spans; /* of a pass */
    uint64_t most_tiles;
    size_t group_count; /* 0: not counted by groups */
    double build_ms;
    double nudge_m;
};

/* Takes the casters of a frame: all that the buffers before BUFFER_FACES hold. counts_groups of
 * volumes is set. */
MUST_CHECK bool volumes_begin(struct volumes *volumes, const struct shadow_finding *finding,
                              struct error *err);
/* Room in a buffer of a window. */
MUST_CHECK bool volumes_reserve(struct volumes *volumes, enum volume_buffer buffer, uint64_t bytes,
                                struct error *err);
uint32_t volumes_reach_words(const struct scene_state *state); /* of a light */

#endif
