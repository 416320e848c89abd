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
    VOLUME_SIGN_BYTES = 4,
};

/* Those before BUFFER_FACES are the frame's, the others a window's. */
enum volume_buffer {
    BUFFER_VERTICES,
    BUFFER_EDGES,
    BUFFER_SIDES,
    BUFFER_TRIANGLES,
    BUFFER_PARTS,
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

/* What holds the sums of a way. */
enum volume_form {
    VOLUME_SUMS,     /* integers: `volume` */
    VOLUME_COUNTS,   /* integers for each filter: `silhouette` */
    VOLUME_LOGS,     /* half floats, as published: logarithms that are added up, */
    VOLUME_PRODUCTS, /* or factors that are multiplied */
};

/* Of VOLUME_LOGS and VOLUME_PRODUCTS: pictures of half floats, of surfaces and nearest layers. */
struct volume_drawing {
    struct gl_texture maps[2];
    struct gl_framebuffer target;
    struct gl_vertex_array corners; /* without attributes */
    /* of counts, which are drawn into buffers */
    struct gl_framebuffer window;
    struct gl_texture stencil; /* of the window, if any */
    int window_px[2];
};

struct volumes {
    struct volume_casters casters; /* kept while their key is the same */
    struct gl_buffer buffers[VOLUME_BUFFERS];
    bool is_uploaded;    /* edges, sides and triangles are those of the casters */
    uint64_t most_faces; /* of a chunk of the casters */
    uint64_t span_room;
    struct volume_drawing drawing;

    /* of the frame */
    const struct scene_state *state;
    const struct camera *camera;
    bool *is_shadowed; /* owned */
    bool is_kept;      /* the casters stood already */
    enum volume_form form;
    enum view_silhouette_form drawn_by; /* of VOLUME_COUNTS */
    uint64_t most_spans;                /* of a pass */
    uint64_t most_tiles;
    uint64_t most_drawn;                          /* pixels of pictures */
    size_t group_count;                           /* 0: not counted by groups */
    uint64_t group_triangles[VOLUME_GROUPS_MOST]; /* of each */
    double build_ms;
    double nudge_m;
};

/* Whether other stages than those of compute draw faces into counts. */
bool volumes_draw_counts(const struct volumes *volumes);
/* Takes the casters of a frame: all that the buffers before BUFFER_FACES hold. The form of
 * volumes is set. */
MUST_CHECK bool volumes_begin(struct volumes *volumes, const struct shadow_finding *finding,
                              struct error *err);
/* Room in a buffer of a window. */
MUST_CHECK bool volumes_reserve(struct volumes *volumes, enum volume_buffer buffer, uint64_t bytes,
                                struct error *err);
/* Of a buffer that holds something of each triangle, chunk by chunk. */
uint64_t volumes_triangle_bytes(const struct volumes *volumes, uint64_t bytes);
/* Binds what a chunk of the casters has of the frame's buffers, and of BUFFER_SIGNS. */
void volumes_bind_chunk(const struct volumes *volumes, size_t chunk);
uint32_t volumes_reach_words(const struct scene_state *state); /* of a light */
/* at: in view space, homogeneous; eye: u_eye of volume.glsl. */
void volumes_place_light(const struct volumes *volumes, uint32_t light, float at[4], float *eye);
/* cone: a spot's axis in view space and the cosine of its outer cone, of other lights -2; range_m:
 * 0 = unbounded. */
void volumes_light_reach(const struct volumes *volumes, uint32_t light, float cone[4],
                         float *range_m);

#endif
