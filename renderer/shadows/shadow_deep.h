/* SPDX-License-Identifier: MIT */
/* The default deep shadow map: per texel a contiguous, sorted list of transmittance events, built
 * exactly and deterministically by count, scan, scatter and sort for all lights of a frame
 * together. Thread: GL.
 *
 * Layout. Heads: n + 1 offsets for n texels; the events of texel i lie from head[i] to head[i + 1].
 * What is left to be written of each list, n counts, is in the pool of depths until it is built.
 *   event   16 bytes  depth [m] (distance from the light; along it for directional ones) and the
 *                     product of all filters up to and including this one, rgb; with
 *                     SHADOW_FLAG_RAW this one's own filter
 *   key      2 bytes  of each event but the first: its depth in steps, to search by: SHADOW_KEYS_AT
 *   object   4 bytes  SHADOW_FLAG_RAW: node, and bit 31 for one that casts once
 *   medium  16 bytes  SHADOW_FLAG_MEDIA: sigma, the extinction that acts behind the event, rgb
 *                     [1/m]; with SHADOW_FLAG_RAW the event's own, negative where it leaves
 * A medium is two events, where the ray enters and where it leaves, kept even if the interface
 * filters nothing. Transmittance at depth z, i the last event before it: P_i exp(-sigma_i (z -
 * z_i)), which is exact for homogeneous media, however they overlap; before the first event P = 1,
 * z_i = 0 and sigma is that of the light's own place (shadow_media.h), so that lists which opaque
 * casters cut short need no matching of ends. The last two streams exist once a light needs them.
 * With SHADOW_FLAG_NODES the events are nodes of a compressed function: shadow_compress.h.
 */
#ifndef VITRAIL_RENDERER_SHADOWS_SHADOW_DEEP_H
#define VITRAIL_RENDERER_SHADOWS_SHADOW_DEEP_H

#include "renderer/shadows/caster_painter.h"
#include "renderer/shadows/shadow_guesses.h"

#define SHADOW_EVENT_BYTES 18u  /* an event and its key */
#define SHADOW_MEDIUM_BYTES 16u /* more, with SHADOW_FLAG_MEDIA */

struct shadow_builder { /* what the list builders share */
    struct program_cache *programs;
    struct gpu_timeline *timeline;
    struct shadow_store *store;
    struct caster_painter *painter;
    struct gl_buffer sums, statistics; /* of a scan */
    struct gl_buffer lights, table;    /* struct deep_light; lists of texels: shadow_deep_job.h */
    /* of a sort; freed after it */
    struct gl_buffer texels, scratch, scratch_objects, scratch_media;
    uint64_t first_elements;        /* linked: first guess per light; 0 means one of its own */
    uint64_t refused_locks;         /* linked, as published: of shadow_system_desc */
    bool scans_on_host;             /* the device is our own cores: counts of deep lists are scanned
                                       in C, and GL clears what shaders fill elsewhere */
    bool may_guess;                 /* deep: room for lists, from what guesses know of them */
    struct shadow_guesses *guesses; /* deep: NULL for lists that are no light's */
};

void shadow_builder_finish(struct shadow_builder *builder);

/* Draws the opaque casters of all builds, which have one resolution, into store->target, and takes
 * their part of the pool of depths: for the counts of lists, while these are built. `because` names
 * the requirement for the report. */
MUST_CHECK bool shadow_depth_build(struct shadow_builder *builder, struct shadow_build *builds,
                                   size_t count, const struct shadow_scene *scene,
                                   const char *because, struct error *err);

/* Keeps what they left in the target in the pool of depths: when all deep lists stand. */
MUST_CHECK bool shadow_depth_keep(const struct shadow_builder *builder, struct shadow_build *builds,
                                  size_t count, const char *because, struct error *err);

/* Builds the lists of all builds of deep lists, whose faces stand in store->target. Takes
 * their heads and events from the store. `because` names the requirement for the report. */
MUST_CHECK bool shadow_deep_build(struct shadow_builder *builder, struct shadow_build *builds,
                                  size_t count, const struct shadow_scene *scene,
                                  const char *because, struct error *err);

/* As above for linked lists with sorted insertion (Lindbeck 2015); as published with
 * a lock per list, and without them for a light whose elements found no lock. */
MUST_CHECK bool shadow_linked_build(struct shadow_builder *builder, struct shadow_build *builds,
                                    size_t count, const struct shadow_scene *scene,
                                    const char *because, struct error *err);

/* The program that looks over finished linked lists. Thread: any. */
void shadow_linked_list_programs(bool is_faithful, struct program_list *list);

#endif
