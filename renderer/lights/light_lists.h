/* SPDX-License-Identifier: MIT */
/* Which lights can reach a point in view. Two techniques under one interface: `clustered` (default;
 * CPU-filled 3-D clusters, conservative, deterministic) and `linked` (Lindbeck 2015, two-pass light
 * linked lists). Thread: GL. */
#ifndef VITRAIL_RENDERER_LIGHTS_LIGHT_LISTS_H
#define VITRAIL_RENDERER_LIGHTS_LIGHT_LISTS_H

#include "renderer/frame_report.h"
#include "renderer/gl/program_list.h"
#include "renderer/gl/scope.h"
#include "renderer/scene/camera.h"
#include "renderer/scene/scene_state.h"

struct clusters;
struct light_bounds;
struct light_lists;

struct light_lists *light_lists_create(struct program_cache *programs,
                                       struct gpu_timeline *timeline, struct error *err);
void light_lists_destroy(struct light_lists *lists);

struct light_lists_desc {
    enum view_light_lists technique;  /* AUTO means clustered */
    bool faithful;                    /* linked: exactly as published (not conservative) */
    const struct state_light *lights; /* required */
    size_t light_count;
    const struct camera *camera;        /* required */
    const struct camera_window *window; /* required */
    const struct light_bounds *bounds;  /* of these lights for this camera; NULL: found here */
    const struct gl_limits *limits; /* of the device; NULL: our own cores, with blocks of 128 MiB */
    bool rebuilds; /* for measuring: builds them even where those of before would do */
};

/* Builds the lists for one window, or keeps those of the last call: where the camera, the window
 * and all that says how far lights reach are the same; colours may differ. Unbounded and
 * directional lights come first in every list (a global prefix). */
MUST_CHECK bool light_lists_prepare(struct light_lists *lists, const struct light_lists_desc *desc,
                                    struct frame_report *report, struct error *err);
uint64_t light_lists_size_bytes(const struct light_lists *lists); /* on the device */
/* The next call of light_lists_prepare builds. */
void light_lists_forget(struct light_lists *lists);
/* So does it after this, which gives their memory back to the device. */
void light_lists_drop(struct light_lists *lists);
/* The #define items that select the technique's shaders/lights/light_list.glsl, for
 * program_desc.defines.
 */
const char *light_lists_defines(const struct light_lists *lists);
const char *light_lists_technique_defines(enum view_light_lists technique); /* likewise */
/* The programs of the technique's build. Thread: any. */
void light_lists_list_programs(enum view_light_lists technique, bool is_faithful, bool is_software,
                               struct program_list *list);
/* Binds buffers, and sets the uniforms of light_list.glsl on `program`, which is in use. */
void light_lists_bind(const struct light_lists *lists, const struct gl_program *program);

/* All lights in the order in which every list has them: the prefix, then the others, each by index.
 * order: room for light_count, that of the lists. Clustered lists; linked ones have the prefix
 * first, and then an order of their own. */
void light_lists_order(const struct light_lists *lists, size_t light_count, uint32_t *order);

/* The lists in memory, or NULL where the linked technique keeps them on the GPU. */
const struct clusters *light_lists_clusters(const struct light_lists *lists);

/* Upper bound of the lights that one point walks, prefix included. All loops of one shader
 * invocation share 65,535 steps on llvmpipe, so shading that does more per light than one step must
 * split long lists. */
uint32_t light_lists_longest(const struct light_lists *lists);

#endif
