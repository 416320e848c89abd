/* SPDX-License-Identifier: MIT */
/* Light linked lists (Lindbeck 2015; after Bezrati 2014): one list of {front, back, light, next}
 * per 4x4 pixels, sorted by front. Faithful: light geometry in two passes per light, under a spin
 * lock; it samples tile centres and so loses lights. Corrected: one instanced pass with
 * conservative analytic intervals, lock-free. Thread: GL. */
#ifndef VITRAIL_RENDERER_LIGHTS_LINKED_LISTS_H
#define VITRAIL_RENDERER_LIGHTS_LINKED_LISTS_H

#include "renderer/gl/object.h"
#include "renderer/gl/program_list.h"
#include "renderer/lights/tile_grid.h"

enum {
    LINKED_TILE_PX = 4, /* "each list covers 16 pixels" */
    LINKED_ELEMENT_BYTES = 16,
    LINKED_ELEMENTS_MAX = 8 << 20, /* 128 MiB, the storage block of every device */
    /* Pool of the first build, unless the lights cannot need as many. */
    LINKED_ELEMENTS_FIRST = 1 << 20,
    /* An insertion walks its list; llvmpipe ends loops after 65,535 steps. */
    LINKED_LIGHTS_MAX = 16384,
    LINKED_HEADER_WORDS = 4, /* counter, failures, unused, before the heads */
};

struct linked_draw; /* one light, its record and its tiles */

/* Zeroed = empty. Outputs: what light_list_linked.glsl reads. */
struct linked_lists {
    struct tile_grid grid;
    struct light_bounds own_bounds;
    const struct light_bounds *bounds; /* of the last collect, as in struct clusters */
    size_t prefix_count;
    uint32_t element_count; /* prefix included, after a build */
    int builds;             /* of the last prepare: more than 1 when the pool had to grow */
    struct gl_buffer heads, elements;
    struct gl_texture heads_view, elements_view;

    struct linked_draw *draws;
    size_t draw_count, draw_capacity;
    uint32_t elements_most; /* that a storage block holds, of the last collect */
    uint64_t tile_sum; /* of all rectangles: no build needs more elements, but for the prefix */
    struct gl_buffer records, mesh;
    struct gl_texture records_view, mesh_view, front;
    struct gl_framebuffer front_target, insert_target;
    struct gl_vertex_array vertex_array;
    int target_columns, target_rows;
};

struct linked_desc {
    const struct state_light *lights; /* required unless light_count is 0 */
    size_t light_count;
    const struct camera *camera;        /* required */
    const struct camera_window *window; /* required */
    const struct light_bounds *bounds;  /* of these lights for this camera; NULL: found here */
    bool faithful;
    const struct gl_limits *limits; /* of the device; NULL: our own cores, with blocks of 128 MiB */
    uint32_t elements_first;        /* 0 means LINKED_ELEMENTS_FIRST; tests make it small */
};

/* CPU part: bounds, tiles, records. ERROR_OVER_BUDGET above LINKED_LIGHTS_MAX bounded lights. */
MUST_CHECK bool linked_lists_collect(struct linked_lists *lists, const struct linked_desc *desc,
                                     struct error *err);
/* GPU part, of the last collect. Reads the counter back, and repeats with a larger pool when it
 * overflowed. */
MUST_CHECK bool linked_lists_build(struct linked_lists *lists, const struct linked_desc *desc,
                                   struct program_cache *programs, struct error *err);
/* The programs of a build, of which none draws where no light is bounded. Thread: any. */
void linked_lists_list_programs(bool is_faithful, bool is_software, const char *pass,
                                struct program_list *list);
/* What the last build's lists take; its buffers may be larger. */
uint64_t linked_lists_used_bytes(const struct linked_lists *lists);
void linked_lists_finish(struct linked_lists *lists);

#endif
