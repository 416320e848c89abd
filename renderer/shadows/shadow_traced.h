/* SPDX-License-Identifier: MIT */
/* Shadows of the points of a window in a rasterised frame. The rasteriser finds the surfaces of a
 * window, opaque ones and every layer of the lists; a finder (shadow_finder.h) finds what each
 * light loses on its way to them; shading reads that in place of any map. Rays on the CPU
 * (renderer/raytrace/raytrace_shadows.h) find besides how much of a map's light gets there, and
 * what lights haze. Thread: GL. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_TRACED_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_TRACED_H

#include "renderer/lights/clusters.h"
#include "renderer/raytrace/raytrace_shadows.h"
#include "renderer/shadows/shadow_finder.h"
#include "renderer/transparency/method.h"

enum {
    /* one storage block, or a buffer texture of 2^27 texels, of every device */
    TRACED_POINTS_MAX = 4 << 20,
    TRACED_FILTERS_MAX = 16 << 20,
};

/* Points that a window may have. */
uint64_t traced_shadows_points_max(const struct gl_limits *limits);

/* In the memory of the CPU. */
enum traced_array {
    TRACED_POINTS,
    TRACED_HEADS,
    TRACED_LAYER_ENDS,
    TRACED_TABLE,
    TRACED_FILTERS,
    TRACED_VISIBILITY,
    TRACED_ARRAYS
};

struct traced_shadows { /* zeroed before begin; buffers are kept between frames */
    struct gl_buffer points, heads, counter, table, filters, visibility;
    struct gl_texture head_view, table_view, filter_view;

    const struct shadow_finder *finder; /* of the frame; NULL: of no light */
    const char *technique;              /* of its points, for the report */
    void *own;                          /* the finder's; kept between frames that have the same */
    const struct shadow_finder *owner;  /* of `own` */
    struct raytrace_shadows *rays;      /* of the frame; NULL where nothing is traced */
    struct yield_point yield;           /* of the frame */
    struct raytrace_stats stats;

    bool has_lights;       /* of the frame: some light's shadow is found */
    bool has_fixed_points; /* likewise: points of areas are the same at every pixel */
    /* Likewise: enum VISIBILITY_* of each point; 0: light of a map passes all. */
    uint32_t visibility_lobes;

    /* Of the points that were collected last: the end of each pixel's layers among them, NULL
     * without any, and the most that a pixel has. */
    const struct gl_buffer *layer_ends;
    uint64_t longest_layers;
    struct raytrace_shadow_points window; /* its arrays are NULL where they are not read back */
    void *arrays[TRACED_ARRAYS];          /* of the window */
    size_t filter_capacity;
    uint64_t window_bytes; /* on the device, of the window of this frame that took most */
    uint64_t most_bytes;   /* that the buffers may take; 0: any */
    /* That the last window would have taken at least, where those were too few. */
    uint64_t missing_bytes;
};

struct traced_desc {
    const struct shadow_finder *finder; /* NULL: no light's shadow is found */
    const char *technique;              /* required */
    struct shadow_finding finding;      /* is_shadowed: nowhere without a finder */
    uint32_t visibility_lobes;          /* of struct traced_shadows */
};
/* Begins a frame. */
MUST_CHECK bool traced_shadows_begin(struct traced_shadows *traced, const struct traced_desc *desc,
                                     struct error *err);
/* The value for the light's record: NO_SHADOW, or any other. */
uint32_t traced_shadows_record(const struct traced_shadows *traced, size_t light);
/* Drops what belongs to the frame. */
void traced_shadows_end(struct traced_shadows *traced);

enum traced_outcome { TRACED_FAILED, TRACED_COLLECTED, TRACED_TOO_MANY };

/* Collects the points of a window, after its surfaces and lists are drawn. TOO_MANY asks the caller
 * to split the window, for points or, with missing_bytes, for memory; err is then untouched. */
enum traced_outcome traced_shadows_collect(struct traced_shadows *traced,
                                           const struct window_frame *frame,
                                           const struct layers *layers, struct error *err);

/* Afterwards, in their place, the points of the samples that are shaded apart: of `count` pixels of
 * the list (renderer/window/apart.h) from the first-th on, a multiple of 64. apart_room: pixels
 * that take no more points than those of the window, before its first call. */
uint32_t traced_shadows_apart_room(const struct traced_shadows *traced, int samples);
MUST_CHECK bool traced_shadows_collect_apart(struct traced_shadows *traced,
                                             const struct window_frame *frame, uint32_t first,
                                             uint32_t count, struct error *err);

/* Lights of each list that one chunk has room for; 0: the window must be split, as above. */
uint32_t traced_shadows_room(struct traced_shadows *traced, const struct clusters *clusters);

/* Finds the shadows of the chunk's lights, for shading. */
MUST_CHECK bool traced_shadows_find(struct traced_shadows *traced, const struct shadow_chunk *chunk,
                                    struct error *err);

/* Of finders: room in table and filters. Without a budget, or within it, as the window has. */
MUST_CHECK bool traced_shadows_reserve(struct traced_shadows *traced, uint64_t filters,
                                       struct error *err);
/* The most filters that a chunk may have, beside the buffers of points. */
size_t traced_shadows_most_filters(const struct traced_shadows *traced);

/* With visibility_lobes: finds what is left of the map's light at the points that were collected
 * last, and uploads it. */
MUST_CHECK bool traced_shadows_see(struct traced_shadows *traced, struct error *err);

/* Lights the slices of the haze's grid over a window with the shadows of all lights, into
 * frame->targets->atmosphere, which has room. */
MUST_CHECK bool traced_shadows_light_haze(struct traced_shadows *traced,
                                          const struct window_frame *frame,
                                          struct raytrace_shadow_haze *haze, struct error *err);

/* The programs that collect points, and those of the finder, which may be NULL; of frame what
 * geometry_list_transparent needs. layers: the kind of the transparent surfaces in view; NULL:
 * there are none. Thread: any. */
void traced_shadows_list_programs(const struct window_frame *frame,
                                  const struct surface_kind *layers,
                                  const struct shadow_finder *finder, struct program_list *list);

/* Binds the buffers of a shading program with HAS_TRACED_SHADOWS. */
void traced_shadows_bind(const struct traced_shadows *traced, const struct gl_program *program);

/* Binds the buffers of one with HAS_ENVIRONMENT_VISIBILITY. */
void traced_shadows_bind_visibility(const struct traced_shadows *traced,
                                    const struct gl_program *program);

/* Limits the buffers from now on; 0: to nothing. Without a call they have no limit. */
void traced_shadows_set_budget(struct traced_shadows *traced, uint64_t bytes);
/* Adds what the finder did to a report, after the last window of a frame. */
void traced_shadows_report(const struct traced_shadows *traced, const struct shadow_report *report);
/* Gives what the buffers take back to the device; rays stay. */
void traced_shadows_free(struct traced_shadows *traced);
void traced_shadows_finish(struct traced_shadows *traced);
uint64_t traced_shadows_size_bytes(const struct traced_shadows *traced); /* of the GPU */

#endif
