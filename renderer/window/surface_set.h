/* SPDX-License-Identifier: MIT */
/* Surfaces of a window that one pass lights: opaque samples (renderer/shading/opaque_samples.h), or
 * what a transparency method hands out (renderer/transparency/method.h). Lighting
 * (renderer/shading/lighting.h) knows of a set what stands here, and treats all alike. */
#ifndef VITRAIL_RENDERER_WINDOW_SURFACE_SET_H
#define VITRAIL_RENDERER_WINDOW_SURFACE_SET_H

#include "renderer/window/time_slice_pace.h"
#include "renderer/window/window.h"

/* What decides the program of a kind, beside the frame. */
struct surface_facts {
    bool has_shadow_maps; /* shadows are looked up in structures, not traced */
    /* The source that composites the transparent surfaces in view (LAYERS of
     * shaders/shading/shade_pixels.comp.glsl); NULL: there are none. */
    const char *compositing;
};

enum surface_order {
    SURFACES_IN_ROWS,  /* a unit is a row of the window, and 8 rows are a row of work groups */
    SURFACES_IN_ITEMS, /* a unit is an invocation, and 64 of them are a work group */
};

enum { SURFACE_DEFINES_BYTES = 224 };

/* How the surfaces of sets are read, and where their light goes; constant. */
struct surface_kind {
    const char *pass; /* that lights them: for the plan, the report and the lists of programs */
    /* The compute shader: u_first is the first unit of a dispatch, u_end is behind its last. */
    const char *program;
    const char *source; /* SURFACES of shaders/shading/shade_surfaces.comp.glsl; NULL of others */
    /* POINTS of shaders/shadows/shadow_points_surfaces.comp.glsl: where rays towards the lights
     * start; NULL: they start nowhere, or, of opaque samples, where another program finds. */
    const char *points;
    bool are_transparent; /* of their materials struct shader_needs has the layer_kinds */
    enum surface_order order;
    enum time_slice_kind slice_kind; /* whose pace is that of lighting them */
    /* #define items of the program beside those of lighting, each behind a space; NULL: none.
     * Thread: any. */
    void (*describe)(const struct window_frame *frame, const struct surface_facts *facts,
                     char text[SURFACE_DEFINES_BYTES]);
    /* Bindings and uniforms of the program beside those of lighting, and those of the transparency
     * method. Thread: GL. */
    void (*bind)(const struct window_frame *frame, const struct gl_program *program);
};

/* With neither count nor groups: an empty set. */
struct surface_set {
    const struct surface_kind *kind; /* required */
    uint64_t first, count;           /* units */
    uint64_t unit_surfaces;          /* of a unit, for the size of time slices; 0 means 1 */
    /* Where the device alone knows how many units there are: three words at `groups_at_bytes` of
     * this buffer are the work groups that take them. The set is then lit in one time slice. */
    const struct gl_buffer *groups;
    uint64_t groups_at_bytes;
    const char *technique;           /* required; for the report, as the next */
    char because[REPORT_TEXT_BYTES]; /* required */
};

/* Whoever lights sets, with those of the lights that are at hand. */
struct surface_lighter {
    void *context;
    bool is_continued; /* other lights have lit the surfaces before: what they give is added */
    bool (*light)(void *context, const struct surface_set *set, struct error *err);
};

#endif
