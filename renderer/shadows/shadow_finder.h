/* SPDX-License-Identifier: MIT */
/* What finds the light that arrives at each point of a window: rays on the processor, or programs
 * on the device. The functions of a structure of SHADOW_PER_WINDOW (technique.h); shadow_traced.h
 * collects the points, gives room, and binds what was found for shading. Thread: GL. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_FINDER_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_FINDER_H

#include "renderer/gl/program_list.h"
#include "renderer/lights/light_lists.h"
#include "renderer/raytrace/raytrace_shadows.h"
#include "renderer/shadows/shadow_needs.h"
#include "renderer/window/window.h"

struct traced_shadows;

struct shadow_finding { /* a frame; all required */
    /* view, state and camera, which live as long as the frame; and, for rays, all that
     * raytrace_shadows_create takes */
    const struct raytrace_desc *desc;
    const bool *is_shadowed; /* per light of the state */
    const struct shadow_needs *needs;
    struct program_cache *programs;
    const struct gl_limits *limits;
    const char *scene_key; /* equal keys, equal scenes; of begin alone */
    uint64_t loop_steps;   /* of one invocation, at most: of struct shade */
};

/* Some lights of every point's list: light_list_chunk of shaders/lights. */
struct shadow_chunk {
    const struct window_frame *frame; /* required */
    const struct light_lists *lists;  /* required; clustered */
    uint32_t first, count;            /* entries of each list */
};

struct shadow_report { /* for a frame's report */
    struct frame_report *report;
    const char *because, *technique;
};

/* A finder fills, for each chunk, traced->table and traced->filters as
 * shaders/shadows/shadow_traced.glsl reads them: per point its first filter and its cluster; then,
 * from there on, as many filters of each light of the chunk that is shadowed as `filters` says, in
 * the order of the point's list. What it keeps from one frame to the next is behind traced->own. */
struct shadow_finder {
    /* The points are read back, into traced->window. Else their number is, alone. */
    bool reads_points;
    uint64_t point_bytes; /* on the device, that it takes beside what all finders do */
    /* Begins a frame. Failed: `end` is called nevertheless. Rays are behind traced->rays, with the
     * frame's. */
    bool (*begin)(struct traced_shadows *traced, const struct shadow_finding *finding,
                  struct error *err);
    /* How many filters the light has at a point; 0: it has no shadow. */
    uint32_t (*filters)(const struct traced_shadows *traced, size_t light);
    /* Entries of each list whose filters have room for all points of the window; 0: not even one.
     */
    uint32_t (*room)(const struct traced_shadows *traced, const struct clusters *clusters,
                     size_t capacity);
    /* Finds the shadows of the points that were collected last. filter_count: out. */
    bool (*find)(struct traced_shadows *traced, const struct shadow_chunk *chunk,
                 uint64_t *filter_count, struct error *err);
    /* Adds what it did, after the last window. */
    void (*report)(const struct traced_shadows *traced, const struct shadow_report *report);

    /* The rest is optional. */

    /* Thread: any. */
    void (*list_programs)(const struct window_frame *frame, struct program_list *list);
    void (*end)(struct traced_shadows *traced); /* drops what belongs to the frame alone */
    uint64_t (*size_bytes)(const struct traced_shadows *traced); /* of traced->own, on the device */
    void (*free)(struct traced_shadows *traced);                 /* gives that back to the device */
    void (*finish)(struct traced_shadows *traced); /* frees traced->own, which may be NULL */
};

extern const struct shadow_finder shadow_finder_rays, shadow_finder_area, shadow_finder_volume,
    shadow_finder_silhouette;

#endif
