/* SPDX-License-Identifier: MIT */
/* The default deep shadow map: per texel a contiguous, sorted list of transmittance events, built
 * exactly and deterministically by count, scan, scatter and sort for all lights of a frame
 * together. Thread: GL. */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_DEEP_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_DEEP_H

#include "renderer/shadows/shadow_casters.h"

struct shadow_builder { /* what the list builders share */
    struct program_cache *programs;
    struct gpu_timeline *timeline;
    struct shadow_store *store;
    struct caster_painter *painter;
    struct gl_buffer sums, statistics;                 /* of a scan */
    struct gl_buffer texels, scratch, scratch_objects; /* of a sort; freed after it */
    uint64_t first_elements; /* linked: first guess per light; 0 means 4 per texel */
    bool scans_on_host;      /* deep: scan counts in C, where the device is our own cores */
};

void shadow_builder_finish(struct shadow_builder *builder);

/* Draws the opaque casters of all builds, which have one resolution, into store->target and keeps
 * what they leave in the pool of depths. `because` names the requirement for the report. */
MUST_CHECK bool shadow_depth_build(struct shadow_builder *builder, struct shadow_build *builds,
                                   size_t count, const struct shadow_scene *scene,
                                   const char *because, struct error *err);

/* Builds the lists of all builds of kind SHADOW_DEEP, whose faces stand in store->target. Takes
 * their heads and events from the store. `because` names the requirement for the report. */
MUST_CHECK bool shadow_deep_build(struct shadow_builder *builder, struct shadow_build *builds,
                                  size_t count, const struct shadow_scene *scene,
                                  const char *because, struct error *err);

/* As above for SHADOW_LINKED: linked lists with a lock per list and sorted insertion (Lindbeck
 * 2015). */
MUST_CHECK bool shadow_linked_build(struct shadow_builder *builder, struct shadow_build *builds,
                                    size_t count, const struct shadow_scene *scene,
                                    const char *because, struct error *err);

#endif
